//! Benchmark problems: for every model a motion or an equilibrium whose end is known from an independent source.

use crate::support::{json, list, number, rows, vector3};
use crate::{bars, statics};
use nalgebra::{Isometry3, Vector3, Vector6};
use snaprod::motion::{Event, Motion, Outcome};
use snaprod::scene::Scene;
use snaprod::study::run::Prepared;
use std::time::Instant;

/// Final state and work of a run.
pub struct Ran {
    /// Positions and velocities at the end; for equilibria, position and directors.
    pub end: Vec<Vector3<f64>>,
    /// Right-hand sides, where they are counted.
    pub work: Option<u64>,
    /// Milliseconds from the first step to the last, without the preparation, such as the search for the start.
    pub ms: f64,
}

/// A problem, the settings of its models from coarse to fine, and the source of its reference.
pub struct Problem {
    /// Name in the protocol of the peers.
    pub key: &'static str,
    /// Name in tables and figures.
    pub title: &'static str,
    pub settings: Vec<Setting>,
    /// Reference values, laid out as [`Ran::end`].
    pub reference: Vec<Vector3<f64>>,
    pub source: &'static str,
    /// Uncertainty of the reference: smaller errors are meaningless.
    pub floor: f64,
    pub compute: Box<dyn Fn(f64) -> Ran>,
}

/// Resolution parameter: a tolerance, or a number of cells or nodes.
#[derive(Clone, Copy)]
pub enum Setting {
    Tolerance(f64),
    Count(usize),
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tolerance(tolerance) => write!(f, "{tolerance:e}"),
            Self::Count(count) => write!(f, "{count}"),
        }
    }
}

impl Problem {
    /// Runs the problem at a setting.
    pub fn run(&self, setting: Setting) -> Ran {
        (self.compute)(match setting {
            Setting::Tolerance(tolerance) => tolerance,
            Setting::Count(count) => count as f64,
        })
    }

    /// The largest distance of a position or a velocity from the reference.
    pub fn error(&self, ran: &Ran) -> f64 {
        assert_eq!(ran.end.len(), self.reference.len(), "{}", self.key);
        let pairs = ran.end.iter().zip(&self.reference);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, |worst, off| {
            // NaN is kept.
            if off <= worst { worst } else { off }
        })
    }
}

/// Reference given by other programs and by data that hold more digits than doubles.
pub const DATA: &str = "tests/data";
const OWN: &str = "own run, finer";

pub fn tolerances(digits: impl IntoIterator<Item = i32>) -> Vec<Setting> {
    let tolerance = |k: i32| Setting::Tolerance(10f64.powi(-k));
    digits.into_iter().map(tolerance).collect()
}

pub fn counts(counts: &[usize]) -> Vec<Setting> {
    counts.iter().map(|count| Setting::Count(*count)).collect()
}

/// All problems, grouped by figure.
pub fn all() -> [(&'static str, Vec<Problem>); 3] {
    let others = vec![
        own("first-order", "plane, W with rod mass to first order", {
            let rod = "mass = 0.05\ninertia = \"first-order\"\n";
            scene("W").replacen("[body]", &format!("{rod}[body]"), 1)
        }),
        full(),
        let_go(),
        viscous(),
        space(),
        space_viscous(),
        chain(),
        bars::volumes(),
        bars::spectral(),
    ];
    let statics = vec![statics::end(), statics::rest(), statics::fold()];
    [
        ("plane", planar()),
        ("motions", others),
        ("statics", statics),
    ]
}

/// The elastic rod in the plane.
pub fn planar() -> Vec<Problem> {
    let motion = |key: &'static str, title| {
        let data = json(&format!("motion_{key}.json"));
        let last = list(
            data["rows"]
                .as_array()
                .and_then(|r| r.last())
                .expect("rows"),
        );
        motion(key, title, scene(key), plane(&last[1..]), 1e-14)
    };
    let data = json("snap_run.json");
    let last = rows(&data, "rows", 2).last().expect("a row");
    let state = ["x", "y", "vx", "vy"].map(|key| number(last, key));
    vec![
        motion("W", "plane, W: smooth"),
        motion("B", "plane, B: 78 taut bounces"),
        motion("H", "plane, H: 44 taut bounces"),
        self::motion("snap", "plane, a snap", scene("snap"), plane(&state), 1e-14),
    ]
}

/// x, y, vx, vy as two vectors.
pub fn plane(state: &[f64]) -> Vec<Vector3<f64>> {
    let vectors = state.chunks(2).map(|v| Vector3::new(v[0], v[1], 0.0));
    vectors.collect()
}

const ELASTICA: &str = "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n";

/// The scene of a planar motion, without its tolerance.
fn scene(key: &str) -> String {
    let (start, loads, duration) = match key {
        "W" => (
            "position = [-0.2, 0.5]\nsheet = \"lowest\"",
            "[-8.0, -2.0]",
            20.0,
        ),
        "B" => (
            "position = [0.8, 0.4]\nsheet = \"lowest\"",
            "[0.0, 0.0]",
            20.0,
        ),
        "H" => (
            "position = [0.6, 0.3]\nsheet = \"lowest\"",
            "[0.0, 0.0]",
            20.0,
        ),
        "snap" => (
            "lambda = 6.3\nkappa = 0.6\nvelocity = [0.0, -0.5]",
            "[0.0, 0.0]",
            3.0,
        ),
        other => panic!("no motion {other}"),
    };
    format!(
        "{ELASTICA}[body]\nmass = 1.0\n[start]\n{start}\n[loads]\ndead = {loads}\n[run]\nduration = {duration:?}\n"
    )
}

/// A scene of motion at any tolerance.
fn motion(
    key: &'static str,
    title: &'static str,
    scene: String,
    reference: Vec<Vector3<f64>>,
    floor: f64,
) -> Problem {
    Problem {
        key,
        title,
        settings: tolerances([4, 6, 8, 10, 12]),
        reference,
        source: DATA,
        floor,
        compute: Box::new(move |tolerance| moved(&scene, tolerance)),
    }
}

/// A scene of motion against its own run at 1e-13.
fn own(key: &'static str, title: &'static str, scene: String) -> Problem {
    let reference = moved(&scene, 1e-13).end;
    Problem {
        settings: tolerances([4, 5, 6, 8, 10]),
        source: OWN,
        ..motion(key, title, scene, reference, 1e-12)
    }
}

/// Runs a scene of motion, of one rod or of several, to the end time.
fn moved(text: &str, tolerance: f64) -> Ran {
    let scene = Scene::parse_with(text, &[&format!("run.tolerance={tolerance:e}")])
        .unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let duration = scene.run().expect("a motion").duration;
    let prepared = Prepared::new(&scene).expect("a scene");
    followed(prepared.motion().expect("a start"), duration)
}

/// Takes a motion to its end. `duration` is in the scene's units; rods have the length 1.
fn followed<'a>(mut motion: Box<dyn Motion<'a> + 'a>, duration: f64) -> Ran {
    let unit = duration / motion.duration();
    let clock = Instant::now();
    let outcome = loop {
        if let Some(Event::Stop(outcome)) = motion.advance() {
            break outcome;
        }
    };
    let ms = clock.elapsed().as_secs_f64() * 1e3;
    assert_eq!(outcome, Outcome::EndOfTime);
    let now = motion.now();
    let state = |pose: &Isometry3<f64>, twist: &Vector6<f64>| {
        [pose.translation.vector, twist.fixed_rows::<3>(3) / unit]
    };
    let end = match now.bodies() {
        [] => state(&now.pose(), &now.twist()).to_vec(),
        bodies => bodies
            .iter()
            .flat_map(|b| state(&b.pose, &b.twist))
            .collect(),
    };
    Ran {
        end,
        work: Some(motion.cost().evaluations),
        ms,
    }
}

/// All of the rod's mass, with friction.
fn full() -> Problem {
    let scene = format!(
        "{ELASTICA}mass = 0.1\ninertia = \"full\"\ndamping = {{ proportional = 0.05 }}\n[body]\nmass = 1.0\n\
         [start]\ncurvature = [1.5, -1.5]\ncurvature_rate = [0.0]\n[run]\nduration = 2.0\n"
    );
    let data = json("mass/run_smooth_given.json");
    let last = rows(&data, "states", 3).last().expect("a state");
    assert_eq!(number(last, "t"), 2.0);
    let digits = |key: &str| last[key].as_array().expect("two numbers").iter();
    let digits = digits("r").chain(digits("v")).map(|word| {
        let word = word.as_str().expect("a decimal string");
        word.parse().expect("a number")
    });
    let end: Vec<f64> = digits.collect();
    Problem {
        settings: tolerances([2, 4, 6, 8]),
        ..motion(
            "full",
            "plane, all of the rod's mass",
            scene,
            plane(&end),
            5e-11,
        )
    }
}

/// All of the rod's mass without friction, released from the straight rod: a problem within the reach of PyElastica.
/// The release excites waves along the rod that no grid resolves, and the velocities are noisy; the position of the
/// end converges.
fn let_go() -> Problem {
    let place = |nodes: f64, tolerance: f64| {
        let mut ran = moved(
            &format!(
                "{ELASTICA}mass = 0.01\ninertia = \"full\"\nnodes = {nodes}\n[body]\nmass = 1.0\n\
                 [start]\nrest = \"straight\"\n[loads]\ndead = [0.0, -2.0]\n[run]\nduration = 0.5\n"
            ),
            tolerance,
        );
        ran.end.truncate(1);
        ran
    };
    Problem {
        key: "let-go",
        title: "plane, let go with all of its mass",
        settings: counts(&[4, 5, 6, 7]),
        reference: place(8.0, 1e-5).end,
        source: OWN,
        // Change from 10 to 12 nodes.
        floor: 5e-10,
        compute: Box::new(move |nodes| place(nodes, 1e-3)),
    }
}

fn viscous() -> Problem {
    let data = json("viscous_planar.json");
    let last = rows(&rows(&data, "runs", 1)[0], "rows", 20)
        .last()
        .expect("a row");
    let end: Vec<f64> = ["r", "v"].iter().flat_map(|key| list(&last[key])).collect();
    let scene = format!(
        "{ELASTICA}damping = 0.1\n[body]\nmass = 1.0\n[start]\ncurvature = [1.5, -1.5]\nvelocity = [0.0, -1.0]\n\
         [run]\nduration = 3.0\n"
    );
    motion("viscous", "plane, viscoelastic", scene, plane(&end), 1e-14)
}

const SPACE: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.5], torsion = 0.7, shear = [100.0, 120.0], axial = 300.0 }
rest = { curvature = [0.3, -0.2], twist = 0.4 }
[body]
mass = 1.0
inertia = [[0.05, 0.01, 0.0], [0.01, 0.07, -0.005], [0.0, -0.005, 0.04]]
offset = [0.05, -0.03, 0.1]
[start]
velocity = [0.3, 0.2, 0.0]
# (0.8, -0.6, 1.5) along the directors of the end.
angular_velocity = [0.7701880798586116, -0.732591740092843, 1.4560630700596198]
[loads]
gravity = [-1.0, 0.0, 0.3]
[run]
duration = 3.0
"#;

fn space() -> Problem {
    let data = json("space/motion_weld_given.json");
    let last = rows(&rows(&data, "cases", 1)[0], "states", 6)
        .last()
        .expect("a state");
    motion(
        "space",
        "space, elastic",
        SPACE.to_owned(),
        bodies(last),
        1e-12,
    )
}

/// Positions and velocities of all bodies of a state.
fn bodies(state: &serde_json::Value) -> Vec<Vector3<f64>> {
    let bodies = rows(state, "bodies", 1).iter();
    let both = bodies.flat_map(|body| ["position", "velocity"].map(|key| vector3(body, key)));
    both.collect()
}

const SPACE_VISCOUS: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.7, shear = [60.0, 60.0], axial = 100.0 }
damping = { proportional = 0.05 }
[body]
mass = 1.0
inertia = [[0.05, 0.01, 0.0], [0.01, 0.04, 0.0], [0.0, 0.0, 0.03]]
offset = [0.1, 0.05, 0.2]
[start]
velocity = [0.5, 0.2, -0.1]
angular_velocity = [0.3, -0.2, 0.4]
[loads]
gravity = [0.0, -1.0, 0.0]
[run]
duration = 2.0
"#;

fn space_viscous() -> Problem {
    let data = json("viscous_space.json");
    let last = rows(&rows(&data, "runs", 2)[1], "rows", 20)
        .last()
        .expect("a row");
    let end = ["r", "v"].map(|key| vector3(last, key)).to_vec();
    motion(
        "space-viscous",
        "space, viscoelastic",
        SPACE_VISCOUS.to_owned(),
        end,
        1e-13,
    )
}

const CHAIN: &str = r#"
[[rod]]
name = "lower"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.2], torsion = 0.8, shear = [100.0, 120.0], axial = 300.0 }
rest = { curvature = [0.4, -0.2], twist = 0.3 }
from = { position = [0.0, 0.0, 0.0] }
to = { body = "a" }
[[rod]]
name = "upper"
model = "cosserat"
length = 0.8
section = { bending = [0.8, 1.0], torsion = 0.6, shear = [90.0, 80.0], axial = 250.0 }
rest = { curvature = [-0.3, 0.5], twist = -0.2 }
from = { body = "a", position = [0.05, 0.0, 0.1], quaternion = [0.9837939627663755, 0.14918881929129063, 0.09945921286086044, 0.0] }
to = { body = "b" }
[[body]]
name = "a"
mass = 1.0
inertia = [[0.05, 0.01, 0.0], [0.01, 0.06, 0.0], [0.0, 0.0, 0.04]]
offset = [0.03, 0.0, 0.05]
velocity = [0.1, 0.1, 0.0]
angular_velocity = [0.4060934250134738, -0.3698445871275198, 0.44531237523035516]
[[body]]
name = "b"
mass = 0.7
inertia = [[0.03, 0.0, 0.005], [0.0, 0.04, 0.0], [0.005, 0.0, 0.02]]
offset = [0.0, 0.04, 0.05]
velocity = [0.0, 0.2, 0.1]
angular_velocity = [-0.2915096925228727, 0.2789816517215003, 0.4660379138739291]
[start]
rest = "straight"
[loads]
gravity = [0.2, 0.0, -0.6]
[run]
duration = 1.5
"#;

fn chain() -> Problem {
    let data = json("space/network_motion_given.json");
    let last = rows(&rows(&data, "cases", 1)[0], "states", 5)
        .last()
        .expect("a state");
    motion(
        "chain",
        "assembly, two rods and two bodies",
        CHAIN.to_owned(),
        bodies(last),
        1e-12,
    )
}
