//! Bodies on rods with friction and without mass that hit obstacles.

use crate::impacts::{data, near, number};
use crate::obstacle_scenes::{Ran, of_kind, ran, reals};

/// A mass on a bar that stretches alone, pressed onto a wall by 8 + 7 sin(1.3 t).
const BAR: &str = r#"
[rod]
model = "cosserat"
length = 1.0
damping = [0.1, 0.1, 0.1, 0.0, 0.0, 0.8]
[rod.section]
bending = [1.0, 1.0]
torsion = 0.8
axial = 20.0
[body]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
[start]
rest = "straight"
[loads]
dead = [0.0, 0.0, 8.0]
[[loads.force]]
direction = [0.0, 0.0, 1.0]
amplitude = 7.0
frequency = 0.20690142601946396
[[obstacle]]
name = "wall"
plane = { point = [0.0, 0.0, 1.1], normal = [0.0, 0.0, -1.0] }
restitution = 0.6
[run]
duration = 3.9
tolerance = 1e-11
samples = 40
"#;

/// Times and speeds of the first impacts, by tools/ref_damped_bounce.py.
const HITS: [[f64; 2]; 6] = [
    [0.160_049_887_186_790_7, 1.208_503_718_847_609_6],
    [0.329_581_713_714_789_83, 0.733_236_291_146_239_5],
    [0.423_011_746_876_963_2, 0.440_623_345_423_769_7],
    [0.476_354_120_676_702_25, 0.264_209_179_887_267_2],
    [0.507_443_763_729_537, 0.158_387_587_330_229_9],
    [0.525_781_101_408_834_2, 0.094_967_176_643_020_62],
];
const ACCUMULATES: f64 = 0.552_856_069_701_904_1;
const LOST: f64 = 0.736_398_202_423_574;
const LEAVES: f64 = 3.208_684_195_713_495_4;
/// Stretch and its rate at the end.
const END: [f64; 2] = [0.026_761_347_216_152_473, -0.068_824_354_021_806_8];

/// The largest change of the energy, relative to its largest term.
fn drift(ran: &Ran) -> f64 {
    let of = |name: &str| reals(&ran.tables, "trajectory", name);
    let total = of("total");
    let spread = total.iter().map(|e| (e - total[0]).abs());
    let size = of("dissipated").iter().copied().fold(1.0, f64::max);
    spread.fold(0.0, f64::max) / size
}

/// Compares a mass on a damped bar with flights in closed form. Catches friction of the rod within an impact, a contact
/// force without the force of the rod, a wrong time of release, and implicit steps without the contact.
#[test]
fn a_mass_on_a_bar_bounces_rests_and_leaves() {
    for method in ["explicit", "implicit"] {
        let told = ran(&BAR.replace("[run]", &format!("[run]\nmethod = \"{method}\"")));
        let hits = of_kind(&told, "impact");
        assert!(hits.len() >= 20, "{method}: {}", hits.len());
        for (hit, [t, v]) in hits.iter().zip(HITS) {
            near(number(hit, "t"), t, 1e-9);
            near(hit["before"][2].as_f64().expect("v"), v, 1e-8);
            near(hit["after"][2].as_f64().expect("v"), -0.6 * v, 1e-8);
        }
        let time = |kind: &str| number(of_kind(&told, kind)[0], "t");
        near(time("accumulation"), ACCUMULATES, 1e-8);
        near(time("release"), LEAVES, 1e-8);
        near(number(&told.summary["contact"], "impact_lost"), LOST, 1e-8);
        let of = |table: &str, name: &str| reals(&told.tables, table, name);
        near(of("trajectory", "z")[39], 1.0 + END[0], 1e-8);
        near(of("trajectory", "vz")[39], END[1], 1e-8);
        let forces = of("contacts", "t")
            .into_iter()
            .zip(of("contacts", "normal"));
        let mut rests = 0;
        for (t, force) in forces.filter(|(t, _)| *t > ACCUMULATES && *t < LEAVES) {
            near(force, 6.0 + 7.0 * (1.3 * t).sin(), 1e-8);
            rests += 1;
        }
        assert!(rests > 20, "{method}: {rests}");
        let drift = drift(&told);
        assert!(drift < 1e-9, "{method}: {drift:e}");
        assert!(number(&told.summary["contact"], "min_gap") > -1e-10);
    }
}

const BOUNCE: &str = include_str!("../../scenes/bounce_on_floor.toml");

/// The scene of the given bounce with the viscosity `eta`, for the case of this friction.
fn with_viscosity(eta: f64, friction: f64) -> String {
    BOUNCE
        .replace(
            "bending_stiffness = 1.0",
            &format!("bending_stiffness = 1.0\ndamping = {eta:e}"),
        )
        .replace(
            "restitution = 0.5",
            &format!("restitution = 0.5\nfriction = {friction}"),
        )
        .replace("tolerance = 1e-13", "tolerance = 1e-10\nsamples = 101")
        .replace("duration = 2.0", "duration = 0.8")
}

/// Catches a contact that sees the rod's friction otherwise than to first order: as the viscosity goes to zero,
/// impacts come to be those of the elastic rod, given by another program.
#[test]
fn small_viscosities_lead_to_the_elastic_rod() {
    let cases = data("bounce_given.json");
    for case in cases.as_array().expect("cases") {
        let friction = number(case, "friction");
        let runs = [2e-4, 1e-4].map(|eta| ran(&with_viscosity(eta, friction)));
        for told in &runs {
            let drift = drift(told);
            assert!(drift < 1e-8, "{friction}: {drift:e}");
            assert!(number(&told.summary["contact"], "min_gap") > -1e-9);
            let cone = told.summary["contact"]["max_cone"].as_f64();
            assert!(cone.is_none_or(|cone| cone < 1e-12), "{cone:?}");
        }
        let hits = runs.each_ref().map(|told| of_kind(told, "impact"));
        let given = case["impacts"].as_array().expect("impacts");
        for (k, given) in given.iter().take(4).enumerate() {
            let t = number(given, "t");
            let [more, less] = hits.each_ref().map(|hits| number(hits[k], "t") - t);
            assert!(more.abs() > 1e-5, "no effect: {more:e}");
            // To second order in the viscosity.
            assert!((more / less - 2.0).abs() < 0.15, "{more:e}, {less:e}");
        }
    }
}

/// Catches a clamp elsewhere that is taken for the frame of the obstacles, and numbers in other units.
#[test]
fn clamps_and_units_change_nothing() {
    let plain = ran(&with_viscosity(0.02, 0.15));
    let moved = r#"
[rod]
model = "elastica"
length = 100.0
bending_stiffness = 1e3             # g cm^3/ms^2
damping = 2e4
[body]
mass = 1e3
[clamp]
position = [10.0, 20.0]
angle = 1.5707963267948966
[start]
lambda = 1.3241896270224394
p = -0.25
[loads]
dead = [0.3, -0.6]
[[obstacle]]
plane = { point = [40.0, 0.0], normal = [-2.0, 0.0] }
[contact]
restitution = 0.5
friction = 0.15
[run]
duration = 800.0
tolerance = 1e-10
"#;
    let moved = ran(moved);
    for kind in ["impact", "reverse", "stick"] {
        let (a, b) = (of_kind(&plain, kind), of_kind(&moved, kind));
        assert!(!a.is_empty() || kind == "reverse", "no {kind}");
        assert_eq!(a.len(), b.len(), "{kind}");
        for (a, b) in a.iter().zip(b) {
            near(1e-3 * number(b, "t"), number(a, "t"), 1e-7);
        }
    }
}
