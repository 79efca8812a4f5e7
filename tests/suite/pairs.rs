//! Scenes that both a cheap computation path and a more general one can run: parts that `snaprod plan` reports as not
//! computed must change nothing.

use nalgebra::Vector3;
use snaprod::scene::Scene;
use snaprod::study::run::Fields;
use snaprod::study::{Silent, Table, dispatch};

/// A scene in two forms, for the cheap and the general path.
pub struct Pair {
    /// Parts omitted by the cheap path.
    pub leaves_out: &'static str,
    /// Scene on the cheap path.
    pub cheap: String,
    /// Scene on the general path, with the same motion.
    pub general: String,
}

/// A run of a scene of one body.
pub struct Ran {
    table: Table,
    /// Number of right-hand sides of the run.
    pub work: u64,
}

impl Ran {
    /// The first and the last value of a quantity of the rod or body, under the names of a single rod; `None` without
    /// such a column.
    pub fn ends(&self, name: &str) -> Option<[f64; 2]> {
        let columns = [name.to_owned(), format!("m.{name}")];
        let there = columns
            .iter()
            .find(|name| self.table.column(name).is_some())?;
        let values = self.table.reals(there);
        Some([values[0], values[self.table.rows() - 1]])
    }

    /// The first and the last value of a vector; a rod in the plane has no z.
    pub fn vectors(&self, names: [&str; 3]) -> [Vector3<f64>; 2] {
        let [x, y, z] = names.map(|name| {
            let found = self.ends(name);
            assert!(found.is_some() || name.ends_with('z'), "no column {name}");
            found.unwrap_or_default()
        });
        [0, 1].map(|i| Vector3::new(x[i], y[i], z[i]))
    }
}

/// Runs a scene to the end time.
///
/// # Errors
///
/// The message of the refusal, as a user reads it.
pub fn ran(scene: &str) -> Result<Ran, String> {
    let scene = Scene::parse(scene).map_err(|faults| faults.to_string())?;
    let mut tables: Vec<Table> = Vec::new();
    let found = dispatch::motion(&scene, Fields::None, &mut tables, &mut Silent);
    let found = found.map_err(|why| why.to_string())?;
    assert_eq!(found.reason, None, "the run ends early");
    Ok(Ran {
        work: found.summary["work"]["evaluations"].as_u64().unwrap(),
        table: tables.swap_remove(0),
    })
}

/// Final position of the body, and the number of right-hand sides.
pub fn end(scene: &str) -> (Vector3<f64>, u64) {
    let ran = ran(scene).unwrap_or_else(|why| panic!("{why}\n{scene}"));
    (ran.vectors(["x", "y", "z"])[1], ran.work)
}

/// A planar rod, and its equivalent in space with d1 across the plane.
const PLANE: &str = "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n";
const SPACE: &str = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n";
pub const TURNED: &str = "quaternion = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]";
const POINT: &str = "[body]\nmass = 1.0\n";

/// Start, load and duration of a scene.
fn motion(start: &str, dead: &str, duration: f64) -> String {
    format!(
        "[start]\n{start}\n[loads]\ndead = [{dead}]\n[run]\nduration = {duration}\ntolerance = 1e-9\nsamples = 2\n"
    )
}

/// All pairs of scenes.
pub fn pairs() -> Vec<Pair> {
    let (planar, spatial) = ("-0.5, -1.5", "-0.5, -1.5, 0.0");
    let plane = motion("settled = true\nvelocity = [0.3, 0.4]", planar, 2.0);
    let space = motion(
        "equilibrium = { force = [-0.5, -1.5, 0.0] }\nvelocity = [0.3, 0.4, 0.0]",
        spatial,
        2.0,
    );
    let bent = motion("curvature = [0.8]", planar, 1.0);
    let strained = motion("strain = { u1 = [0.8] }", spatial, 1.0);
    let brief = space.replace("duration = 2", "duration = 0.2");
    let moved = |rod: &str, motion: &str, duration: f64| {
        let section = SPACE.trim_start_matches("[rod]\n");
        format!(
            "[[rod]]\nname = \"r\"\n{section}{rod}from = {{ position = [0.0, 0.0, 0.0], {TURNED}{motion} }}\nto = {{ body = \"m\", joint = \"ball\" }}\n\
             [[body]]\nname = \"m\"\nmass = 1.0\nforce = [-0.5, -1.5, 0.0]\nvelocity = [0.3, 0.4, 0.0]\n\
             [run]\nduration = {duration}\ntolerance = 1e-9\nsamples = 2\n"
        )
    };
    let assembly = |rod: &str, duration: f64| moved(rod, "", duration);
    let laid = format!("[clamp]\n{TURNED}\n[body]\nmass = 1.0\njoint = \"ball\"\n");
    let light = "mass = 0.02\ninertia = \"first-order\"\n";
    let heavy = "mass = 0.1\ninertia = \"full\"\nsection_inertia = [1e-5, 1e-5, 2e-5]\nnodes = 10\ndamping = { proportional = 0.02 }\n";
    let flat = "mass = 0.1\ninertia = \"full\"\nnodes = 16\ndamping = { proportional = 0.02 }\n";
    // Sections of this inertia do not resist a turn; no motion in the plane twists the rod.
    let thin = "section_inertia = [1e-12, 1e-12, 2e-12]\n";
    let settled = motion("settled = true\nvelocity = [0.3, 0.4, 0.0]", spatial, 0.2);
    let driven = "motion = { translate = [[0.0, 0.0, 0.0, 0.0], [0.1, 0.01, -0.02, 0.03], [0.2, 0.03, 0.0, 0.05]], \
                  turn = { axis = [0.6, 0.0, 0.8], amplitude = 0.3, frequency = 4.0 } }";
    let still = "[clamp]\nmotion = { translate = { direction = [0.0, 1.0], amplitude = 1e-40, frequency = 1.0 } }\n";
    let pair = |leaves_out, cheap: [&str; 4], general: [&str; 4]| Pair {
        leaves_out,
        cheap: cheap.concat(),
        general: general.concat(),
    };
    vec![
        pair(
            "integration along the rod, motion out of the plane",
            [PLANE, POINT, &plane, ""],
            [SPACE, &laid, &space, ""],
        ),
        pair(
            "loads along the rod",
            [PLANE, POINT, &plane, ""],
            [
                PLANE,
                POINT,
                &plane.replace("[loads]\n", "[loads]\ndistributed = [0.0, -1e-40]\n"),
                "",
            ],
        ),
        pair(
            "accelerations of the clamp",
            [PLANE, POINT, &plane, ""],
            [PLANE, still, POINT, &plane],
        ),
        pair(
            "integration along the rod, its mass to first order",
            [PLANE, light, POINT, &plane],
            [SPACE, light, &laid, &space],
        ),
        pair(
            "other rods and bodies",
            [SPACE, &laid, &space, ""],
            [&assembly("", 2.0), "", "", ""],
        ),
        pair(
            "motion out of the plane, with friction",
            [PLANE, "damping = 0.02\n", POINT, &bent],
            [
                SPACE,
                "damping = { proportional = 0.02 }\n",
                &laid,
                &strained,
            ],
        ),
        pair(
            "other rods and bodies, with all of the rod's mass",
            [SPACE, heavy, &laid, &brief],
            [&assembly(heavy, 0.2), "", "", ""],
        ),
        pair(
            "the motion of the clamp in the world, with all of the rod's mass",
            [
                SPACE,
                heavy,
                &laid.replace("[body]", &format!("{driven}\n[body]")),
                &settled,
            ],
            [&moved(heavy, &format!(", {driven}"), 0.2), "", "", ""],
        ),
        pair(
            "motion out of the plane, with all of the rod's mass",
            [
                PLANE,
                flat,
                POINT,
                &plane.replace("duration = 2", "duration = 0.2"),
            ],
            [&assembly(&format!("{flat}{thin}"), 0.2), "", "", ""],
        ),
        pair(
            "fast decays, by implicit steps",
            [PLANE, "damping = 1e-4\n", POINT, &bent],
            [
                PLANE,
                "damping = 1e-4\n",
                POINT,
                &format!("{bent}method = \"explicit\"\n"),
            ],
        ),
    ]
}
