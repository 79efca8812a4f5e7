//! First-order mass of elastic rods in space, in scenes: when it applies, its report, its accuracy.

use crate::support::{number_at, worst};
use nalgebra::Vector3;
use serde_json::Value;
use snaprod::scene::{Inertia, Scene};
use snaprod::study::{Silent, Table, Values, run};

/// A point mass that swings out of the plane on a bent rod of two stiffnesses.
const SWING: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.6], torsion = 0.8 }
mass = 0.05
section_inertia = [1e-4, 2e-4, 3e-4]
[body]
mass = 1.0
joint = "ball"
[loads]
gravity = [0.0, 0.4, -0.6]
[start]
equilibrium = { force = [1.0, 0.6, -1.2] }
velocity = [0.2, -0.3, 0.1]
[run]
duration = 0.25
tolerance = 1e-9
"#;

/// Two bodies in a row on two rods.
const CHAIN: &str = r#"
[loads]
gravity = [0.0, -1.0, 0.3]
[[rod]]
name = "a"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 2.0], torsion = 0.7, axial = 200.0 }
mass = 0.04
from = { position = [0.0, 0.0, 0.0] }
to = { body = "p" }
[[rod]]
name = "b"
model = "cosserat"
length = 0.8
section = { bending = [2.0, 1.0], torsion = 0.7, axial = 200.0 }
mass = 0.05
from = { body = "p", position = [0.0, 0.0, 0.1] }
to = { body = "q", joint = "ball" }
[[body]]
name = "p"
mass = 1.0
inertia = [0.02, 0.03, 0.02]
velocity = [0.1, 0.2, 0.0]
[[body]]
name = "q"
mass = 0.8
[run]
duration = 0.5
tolerance = 1e-9
"#;

fn summary(text: &str, set: &[&str]) -> Value {
    let scene = Scene::parse_with(text, set).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let prepared = run::Prepared::new(&scene).unwrap();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
    record.summary()
}

/// Catches a default applied silently, or applied to an unsupported mass.
#[test]
fn light_rods_are_followed_by_default_where_they_can_be() {
    let note = |set: &[&str]| {
        let scene = Scene::parse_with(SWING, set).unwrap();
        let notes = scene.mass_notes();
        let text = notes.first().and_then(|note| note.text());
        // The scene written out reads back as the same scene.
        let written = toml::to_string(&scene).unwrap();
        assert_eq!(
            Scene::parse(&written).unwrap().rod.inertia,
            scene.rod.inertia
        );
        (scene.rod.inertia, text.unwrap_or_default())
    };
    let (inertia, text) = note(&[]);
    assert_eq!(inertia, Some(Inertia::FirstOrder));
    assert!(
        text.contains("5.00e-2") && text.contains("\"none\""),
        "{text}"
    );
    assert_eq!(
        note(&["rod.inertia=\"none\""]),
        (Some(Inertia::None), String::new())
    );
    let explicit = note(&["rod.inertia=\"first-order\"", "rod.mass=0.2"]);
    assert_eq!(explicit.0, Some(Inertia::FirstOrder));
    for (set, why) in [
        (&["rod.mass=0.2"][..], "not small"),
        (&["run.method=\"symmetric\""], "symmetric"),
    ] {
        let (inertia, text) = note(set);
        assert_eq!(inertia, None, "{text}");
        assert!(text.contains("is ignored") && text.contains(why), "{text}");
        if why == "not small" {
            continue;
        }
        let set = [set, &["rod.inertia=\"first-order\""]].concat();
        let faults = Scene::parse_with(SWING, &set).unwrap_err().to_string();
        assert!(
            faults.contains("inertia") && faults.contains(why),
            "{faults}"
        );
    }
    let damped = Scene::parse_with(SWING, &["rod.damping={ proportional = 0.1 }"]).unwrap();
    assert_eq!(damped.rod.inertia, None);
    assert!(damped.mass_notes().is_empty());
}

/// Catches a missing or wrong mass of a rod released from the straight shape, while still straight. Compared with the
/// full rod, the end is off by the square of the mass; without the correction by the first power. The positions of the
/// full rod at t = 0.4 are those of `snaprod run` of this scene with rod.inertia = "full", rod.nodes = 4 and
/// run.tolerance = 1e-7; with 8 nodes and 1e-9 they are the same to 1e-8.
#[test]
fn a_rod_that_is_held_straight_and_let_go_is_followed_to_first_order() {
    let text = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.1
[body]
mass = 1.0
[loads]
gravity = [0.0, -2.0]
[start]
rest = "straight"
[run]
duration = 0.4
tolerance = 1e-9
"#;
    let full = [
        (0.1, [0.985_640_877_530, -0.154_831_566_506]),
        (0.03, [0.985_929_963_675, -0.153_325_087_697]),
    ];
    let errors = full.map(|(mass, expected)| {
        let mass = format!("rod.mass={mass}");
        let ran = summary(text, &[&mass, "rod.inertia=\"first-order\""]);
        let [x, y] = ["/end/x", "/end/y"].map(|path| number_at(&ran, path));
        (x - expected[0]).hypot(y - expected[1])
    });
    let order = (errors[0] / errors[1]).ln() / (0.1_f64 / 0.03).ln();
    assert!(
        errors[0] < 8e-5 && (1.6..2.8).contains(&order),
        "{errors:?} {order}"
    );
    // First order is the default under the rod's weight, too.
    let scene = Scene::parse_with(text, &["rod.mass=0.05"]).unwrap();
    let told = scene.mass_notes()[0].text().unwrap();
    assert!(told.contains("is followed to first order"), "{told}");
}

/// Catches a rod's mass without its energy, weight or clamp motion, for rods that start straight or pass the straight
/// shape; the clamp may turn to and fro. Catches vibrations there that exhaust the steps, and energy lost in the
/// change of coordinates: each run has an energy of some 0.05 to 0.3, the last one 12.5.
#[test]
#[ignore = "second tier: 9 s"]
fn straight_starts_keep_the_energy_of_the_rod() {
    let text = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.05
inertia = "first-order"
[body]
mass = 1.0
[loads]
gravity = [0.3, -1.0]
[start]
rest = "straight"
[run]
duration = 0.4
tolerance = 1e-9
"#;
    let cases: [(&[&str], f64); 6] = [
        (&[], 1e-5),
        (&["start.velocity=[0.0, 0.5]", "run.duration=4.0"], 1e-5),
        (
            &[
                "loads.gravity=[2.0, 0.0]",
                "start.velocity=[0.0, 0.3]",
                "run.duration=12.0",
            ],
            1e-5,
        ),
        (
            &["loads.gravity=[-1.0, 0.0]", "start.velocity=[0.0, 0.3]"],
            1e-5,
        ),
        (
            &[
                "clamp={ motion = { turn = { amplitude = 0.1, frequency = 0.8 } } }",
                "start.with_clamp=true",
                "run.duration=4.0",
            ],
            1e-4,
        ),
        (
            &[
                "loads.dead=[2500.0, 0.0]",
                "loads.gravity=[0.0, 0.0]",
                "start.velocity=[0.0, 5.0]",
                "run.duration=0.3",
            ],
            1e-2,
        ),
    ];
    for (set, bound) in cases {
        let ran = summary(text, &[set, &["run.max_steps=20000"]].concat());
        assert_eq!(ran["outcome"], "end_of_time", "{set:?}: {}", ran["reason"]);
        let off = number_at(&ran, "/energy_error/relative");
        let lost = number_at(&ran, "/end/dissipated");
        assert!(
            off < 1e-8 && lost.abs() < bound,
            "{set:?}: {off:e} {lost:e}"
        );
    }
}

/// Catches an assembly that omits the mass, weight or name of a rod.
#[test]
fn rods_of_assemblies_are_followed_too() {
    let found = summary(CHAIN, &[]);
    assert_eq!(found["outcome"], "end_of_time");
    assert!(number_at(&found, "/energy_error/relative") < 1e-9);
    assert!(number_at(&found, "/end/rod_kinetic") > 1e-4);
    let notes = found["rod_masses"].as_array().unwrap();
    let eps: Vec<f64> = notes.iter().map(|note| number_at(note, "/eps")).collect();
    assert_eq!(eps, [0.04, 0.0625]);
    // The static state is equal: at the start the rods bear their weight in either case.
    let none = ["rod[0].inertia=\"none\"", "rod[1].inertia=\"none\""];
    let without = summary(CHAIN, &none);
    for path in ["/start/potential", "/start/elastic", "/start/kinetic"] {
        assert_eq!(number_at(&found, path), number_at(&without, path));
    }
    let moved = number_at(&found, "/end/bodies/q/position/1")
        - number_at(&without, "/end/bodies/q/position/1");
    assert!((1e-5..1e-2).contains(&moved.abs()), "{moved}");
    assert!(without["end"].get("rod_kinetic").is_none());
    for (set, said) in [
        (
            "rod[0].from.motion={ turn = { axis = [0.0, 0.0, 1.0], rate = 0.1 } }",
            "is followed to first order",
        ),
        ("run.method=\"symmetric\"", "is ignored: symmetric"),
    ] {
        let scene = Scene::parse_with(CHAIN, &[set]).unwrap();
        let notes = scene.mass_notes();
        let texts: Vec<String> = notes.iter().filter_map(|note| note.text()).collect();
        assert!(texts.iter().all(|text| text.contains(said)), "{texts:?}");
    }
}

/// Order of the correction in space: the position of the body differs from that of the full rod by the order 2 of the
/// rod's mass, without the correction by the order 1 (theory 3.9). A rod under its weight would start from another
/// shape, so a dead load bends it.
#[test]
#[ignore = "second tier: 3 s"]
fn first_order_in_space_is_off_by_the_square_of_the_mass() {
    let places = |eps: &str, inertia: &str| -> Vec<Vector3<f64>> {
        let inertia = format!("rod.inertia=\"{inertia}\"");
        let mut set = vec![eps, inertia.as_str(), "run.duration=0.15", "run.samples=16"];
        set.extend([
            "loads.gravity=[0.0, 0.0, 0.0]",
            "loads.dead=[0.0, 0.4, -0.6]",
        ]);
        if inertia.contains("full") {
            set.extend(["rod.nodes=6", "run.tolerance=1e-6"]);
        }
        let scene = Scene::parse_with(SWING, &set).unwrap();
        let prepared = run::Prepared::new(&scene).unwrap();
        let mut tables: Vec<Table> = Vec::new();
        run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
        let column = |k: usize| match &tables[0].columns[1 + k].values {
            Values::Reals(values) => values.clone(),
            other => panic!("{other:?}"),
        };
        let [x, y, z] = [0, 1, 2].map(column);
        (0..x.len())
            .map(|i| Vector3::new(x[i], y[i], z[i]))
            .collect()
    };
    let [large, small] = ["rod.mass=0.1", "rod.mass=0.03"].map(|eps| {
        let full = places(eps, "full");
        ["first-order", "none"].map(|inertia| {
            let other = places(eps, inertia);
            assert_eq!(other.len(), full.len());
            let apart = other.iter().zip(&full).map(|(a, b)| (a - b).norm());
            worst(apart)
        })
    });
    let order = |k: usize| (large[k] / small[k]).ln() / (0.1_f64 / 0.03).ln();
    assert!((1.6..2.3).contains(&order(0)), "{large:?} {small:?}");
    assert!((0.85..1.15).contains(&order(1)), "{large:?} {small:?}");
    assert!(large[0] < 0.05 * large[1], "{large:?}");
}

/// Catches a mass that is lost, or vibrations, where the rod's end passes the straight shape. Driven across to and
/// fro, the end differs from that of the full rod by the square of the mass. The positions of the full rod at t = 2
/// are those of `snaprod run` of this scene with rod.inertia = "full", rod.nodes = 4 and run.tolerance = 1e-7. Without
/// its mass the end is off by 8.3e-3 and 2.5e-3.
#[test]
fn a_rod_passes_the_straight_one_with_its_mass() {
    let text = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.1
inertia = "first-order"
[body]
mass = 1.0
[loads]
force = { direction = [0.0, 1.0], amplitude = 2.0, frequency = 0.8 }
[start]
rest = "straight"
[run]
duration = 2.0
tolerance = 1e-9
"#;
    let full = [
        (0.1, [0.999_972_390_287, 0.006_901_301_312]),
        (0.03, [0.999_999_257_486, 0.001_152_710_667]),
    ];
    let errors = full.map(|(mass, expected)| {
        let ran = summary(text, &[&format!("rod.mass={mass}")]);
        let [x, y] = ["/end/x", "/end/y"].map(|path| number_at(&ran, path));
        println!(
            "PASS {mass} {} dx {:e} dy {:e}",
            ran["work"]["steps"],
            x - expected[0],
            y - expected[1]
        );
        (x - expected[0]).hypot(y - expected[1])
    });
    assert!(errors[0] < 1.5e-5 && errors[1] < 4e-6, "{errors:?}");
}

/// Catches a rod whose mass is left out of small swings about the straight rod, which never leave its neighbourhood:
/// the beam's shape swings with the end, (1 + 33/140 m) y'' = -3 y, up to the square of the deflection.
#[test]
fn small_swings_about_the_straight_rod_have_its_mass() {
    let text = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.08
[body]
mass = 1.0
[start]
rest = "straight"
velocity = [0.0, 1e-4]
[run]
duration = 40.0
tolerance = 1e-10
"#;
    let ran = summary(text, &[]);
    let rate = (3.0 / (1.0 + 33.0 / 140.0 * 0.08_f64)).sqrt();
    let [y, expected] = [number_at(&ran, "/end/y"), 1e-4 / rate * (40.0 * rate).sin()];
    assert!((y - expected).abs() < 1e-6 * 1e-4, "{y:e} {expected:e}");
    assert!(number_at(&ran, "/end/dissipated").abs() < 1e-12);
}

/// A mass on an elastica, and one on a line, whose rods have some mass.
const ELASTICA: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.05
[body]
mass = 1.0
[start]
lambda = 2.0
kappa = 0.5
velocity = [0.1, 0.2]
[run]
duration = 0.5
"#;
const LINE: &str = r#"
[rod]
model = "cosserat"
length = 1.0
mass = 0.05
section_inertia = [1e-6, 1e-6, 1e-6]
section = { bending = [1.0, 1.4], torsion = 0.9 }
rest = { curvature = [0.6, -0.4], twist = 0.5 }
[body]
mass = 1.0
joint = "ball"
groove = { line = { direction = [1.0, 0.2, 0.3], point = [-0.13938164811131598, -0.3133106253872173, 0.9166094774238054] } }
[start]
velocity = [0.1, 0.02, 0.03]
[run]
duration = 0.25
"#;

/// Catches forces of the equilibrium alone, without the inertia and weight of the rod that the body feels. Mass times
/// acceleration, by differences of velocities, is the force of rod, groove and gravity.
#[test]
fn forces_are_those_that_the_body_feels() {
    let weight = "loads.gravity=[0.3,-0.6]";
    let cases: [(&str, &[&str], [f64; 3]); 4] = [
        (ELASTICA, &[], [0.0; 3]),
        (ELASTICA, &[weight], [0.3, -0.6, 0.0]),
        (SWING, &[], [0.0, 0.4, -0.6]),
        (LINE, &[], [0.0; 3]),
    ];
    for (text, set, gravity) in cases {
        let samples = ["run.samples=501", "run.tolerance=1e-11"];
        let scene = Scene::parse_with(text, &[set, &samples].concat()).unwrap();
        let prepared = run::Prepared::new(&scene).unwrap();
        let mut tables: Vec<Table> = Vec::new();
        run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
        let of = |name: &str| tables[0].reals(name).to_vec();
        let (t, mut largest) = (of("t"), 0.0_f64);
        let h = t[1] - t[0];
        for (axis, gravity) in ["x", "y", "z"].iter().zip(gravity) {
            let [v, f, g] = ["v", "f", "g"].map(|letter| of(&format!("{letter}{axis}")));
            for i in (2..v.len().saturating_sub(2)).step_by(7) {
                let rise = (v[i - 2] - v[i + 2] + 8.0 * (v[i + 1] - v[i - 1])) / (12.0 * h);
                let groove = g.get(i).copied().unwrap_or_default();
                let off = (rise - gravity - f[i] - groove) / (1.0 + f[i].abs());
                assert!(off.abs() < 1e-6, "{set:?} {axis} at {}: {off:e}", t[i]);
                largest = largest.max(f[i].abs());
            }
        }
        assert!(largest > 0.1, "{text}");
    }
}

/// Catches a mass switched off before a fold, or on after it, at the end of a step: the motion then depended on its
/// steps, by 3e-3 at a tolerance of 1e-6 and by 5e-5 at 1e-10. (In space: `first_order_pins`.)
#[test]
fn the_moment_at_which_mass_is_given_up_is_that_of_no_step() {
    let snap = include_str!("../../scenes/snap.toml");
    let ends = [1e-6, 1e-8, 1e-10].map(|tolerance| {
        let ran = summary(
            snap,
            &[
                "rod.mass=0.01",
                "run.duration=0.5",
                &format!("run.tolerance={tolerance:e}"),
            ],
        );
        ["/end/x", "/end/y", "/rod_unfelt"].map(|path| number_at(&ran, path))
    });
    for (k, bound) in [(0, 1e-6), (1, 1e-8)] {
        for (a, b) in ends[k].iter().zip(ends[2]) {
            assert!((a - b).abs() < bound, "{ends:?}");
        }
    }
}

/// A mass is shaken past the straight rod, swings and snaps. Catches a mass switched off although no fold is near: far
/// from folds the normal form may predict a near one. In the plane the rod was without its mass for 0.207 and snapped
/// 4e-4 too early, an error of the end of 1.8e-3. In space the base wrench locates folds.
#[test]
fn mass_is_given_up_before_snaps_only() {
    let loads = |across: &str, dead: &str| {
        format!(
            "[loads]\ndead = {dead}\ndrag = 8.0\nforce = {{ direction = {across}, amplitude = 55.7, frequency = 0.119, phase = 0.0 }}\n\
             [start]\nsettled = true\n[run]\nduration = 5.44\ntolerance = 1e-8\nsamples = 3\n"
        )
    };
    let plane = format!(
        "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\nmass = 0.01\n[body]\nmass = 1.0\n{}",
        loads("[0.0, 1.0]", "[-3.7, 0.05]")
    );
    let space = format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [20.0, 1.0], torsion = 20.0 }}\nmass = 0.01\n\
         [body]\nmass = 1.0\njoint = \"ball\"\n{}",
        loads("[1.0, 0.0, 0.0]", "[0.05, 0.0, -3.7]")
    );
    let [plane, space] = [(plane, "/end/y"), (space, "/end/x")].map(|(scene, across)| {
        let ran = summary(&scene, &["rod.inertia=\"first-order\""]);
        assert!(number_at(&ran, "/rod_unfelt") < 0.01, "{ran:#}");
        number_at(&ran, across)
    });
    // The end goes at a speed of 4.8 there.
    assert!((plane - space).abs() < 2e-4, "{plane} {space}");
}

/// Catches a mass switched off or on at the end of a step, or not at all if the interval is shorter than a step.
/// Catches a passage by the straight rod that begins or ends so, or is misplaced by rounding. Catches a loss of digits
/// at the transition from push to pull, which made a hundred times as many steps. Ends were up to 0.08 apart.
#[test]
fn what_is_felt_of_a_mass_does_not_depend_on_the_tolerance() {
    let clamp = "[clamp]\nposition = [0.2, -0.3]\nangle = 0.4\nmotion = { translate = { direction = [1.0, 0.5], amplitude = 0.1, frequency = 0.8, phase = 0.3 }, \
                 turn = { amplitude = 0.3, frequency = 0.5, phase = -0.4 } }\n";
    for (lambda, kappa, velocity, gravity, clamp) in [
        (2.544, 0.435, "[1.53, -1.44]", "[-3.34, 0.55]", ""),
        (2.81, -0.736, "[-0.44, 1.32]", "[1.16, 0.18]", ""),
        (2.248, 0.081, "[-0.96, -1.2]", "[-1.6, 2.74]", ""),
        (3.048, -0.198, "[-1.22, 2.26]", "[1.32, -0.61]", ""),
        (3.127, -0.225, "[0.05, 0.2]", "[2.33, -0.45]", ""),
        (4.899, -0.362, "[2.54, 0.32]", "[-0.48, 0.75]", ""),
        (2.279, -0.63, "[-0.58, 0.46]", "[0.76, -1.36]", ""),
        (3.721, 0.81, "[-1.32, 0.57]", "[2.68, 1.43]", ""),
        (2.5, 0.5, "[0.3, 0.6]", "[0.2, -2.0]", clamp),
    ] {
        let scene = format!(
            "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\nmass = 0.05\ninertia = \"first-order\"\n[body]\nmass = 1.0\n\
             [start]\nlambda = {lambda}\nkappa = {kappa}\nvelocity = {velocity}\n{clamp}\
             [loads]\ngravity = {gravity}\n[run]\nduration = 1.5\nsamples = 2\n"
        );
        let ends = ["1e-8", "1e-10", "1e-11"].map(|tolerance| {
            let ran = summary(&scene, &[&format!("run.tolerance={tolerance}")]);
            let steps = number_at(&ran, "/work/steps");
            assert!(
                steps < 3000.0,
                "lambda = {lambda}, {tolerance}: {steps} steps"
            );
            ["/end/x", "/end/y"].map(|at| number_at(&ran, at))
        });
        for (end, bound) in [(ends[0], 1e-4), (ends[1], 1e-6)] {
            let apart = (end[0] - ends[2][0]).hypot(end[1] - ends[2][1]);
            assert!(apart < bound, "lambda = {lambda}: {apart:.1e}");
        }
    }
}

/// Two rods in space that are pressed in and pulled out, without snaps. Catches a mass switched off or on at the end
/// of a step, or not at all during a short interval (an end was off by 2e-4). Catches energy created when the mass is
/// switched on again (0.28, with an initial energy of 0.25).
#[test]
#[ignore = "second tier: 37 s"]
fn what_is_felt_of_a_mass_in_space_does_not_depend_on_the_tolerance() {
    for (section, rest, mass, velocity, loads) in [
        (
            "bending = [1.142, 0.675], torsion = 0.958",
            "curvature = [0.175, -0.362], twist = -0.297",
            0.06695,
            "[0.3407, -0.2091, -0.5787]",
            "dead = [0.1349, -0.173, 0.3926]",
        ),
        (
            "bending = [1.163, 1.119], torsion = 1.369",
            "curvature = [-0.283, -0.086], twist = -1.119",
            0.00352,
            "[0.7309, 1.2737, 0.6564]",
            "dead = [-0.0522, -1.1468, 0.3648]\ndrag = 0.34",
        ),
    ] {
        let scene = format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ {section} }}\nrest = {{ {rest} }}\nmass = {mass}\ninertia = \"first-order\"\n\
             [body]\nmass = 1.0\njoint = \"ball\"\n[start]\nsettled = true\nvelocity = {velocity}\n[loads]\n{loads}\n[run]\nduration = 0.6\nsamples = 2\n"
        );
        let [a, b] = ["1e-7", "1e-8"].map(|tolerance| {
            let ran = summary(&scene, &[&format!("run.tolerance={tolerance}")]);
            // A tenth of the body's kinetic energy is tolerated.
            assert!(number_at(&ran, "/end/dissipated") > -0.02, "{ran:#}");
            ["/end/x", "/end/y", "/end/z", "/rod_unfelt"].map(|at| number_at(&ran, at))
        });
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
