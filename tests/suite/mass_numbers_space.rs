//! Estimated effects of the mass of rods in space, reported for light rods: comparison with the plane, closed forms,
//! and rods with full mass.

use crate::support::{near, number_at};
use nalgebra::{Isometry3, Matrix3, Vector2, Vector3, Vector6};
use serde_json::Value;
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::elastica::folds::fold_at;
use snaprod::elastica::{self, Equilibrium, held_modes as held_in_plane};
use snaprod::full_mass::held_vibrations::{Massive, fold_form, held_modes};
use snaprod::math::se3::join;
use snaprod::rod::{Rod, SectionMass};
use snaprod::scene::Scene;
use snaprod::section::Linear;
use snaprod::study::{self, Silent, Table, run};

const EPS: f64 = 1e-3;

fn massive(rod: &Rod) -> Massive {
    let sections = SectionMass {
        mass: EPS,
        rotary: Vector3::zeros(),
    };
    Massive::new(rod, None, sections).unwrap()
}

/// One rod from the ground to a body.
fn single(law: Linear, joint: Joint) -> Assembly {
    let here = Isometry3::identity();
    let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
    let link = Link::new(Rod::new(1.0, law).unwrap(), from, to, joint);
    let body = match joint {
        Joint::Weld => Body::rigid(
            RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.15))).unwrap(),
        ),
        _ => Body::point(PointMass::new(1.0).unwrap()),
    };
    Assembly::new(vec![body], vec![link]).unwrap()
}

/// Planar section law in space: bending as the planar rod in the plane of d1 and d3, stiff out of it.
fn flat() -> Linear {
    Linear::diagonal([40.0, 1.0], 40.0).unwrap()
}

/// The planar equilibrium in the plane of d1 and d3, its end moving with v.
fn laid(link: &Link, at: &Equilibrium, v: &Vector2<f64>) -> Configuration {
    let end = Vector3::new(at.y, 0.0, at.x);
    let force = Vector3::new(at.alpha.sin(), 0.0, at.alpha.cos()) * -at.lambda * at.lambda;
    let mut place = BodyMotion::at_rest(Isometry3::translation(end.x, end.y, end.z));
    place.twist = join(&Vector3::zeros(), &Vector3::new(v.y, 0.0, v.x));
    Configuration {
        bodies: vec![place],
        charts: vec![join(&end.cross(&force), &force).component_div(&link.units())],
        spins: Vec::new(),
    }
}

/// Catches a wrong stiffness, mass or constraint of the held rod. Straight rods have closed forms, x^4 with cos x cosh
/// x = 1 for clamped ends and tan x = tanh x for one pinned end; friction in proportion to the stiffness gives a decay
/// of half that multiple.
#[test]
fn straight_rods_have_the_vibrations_of_beams() {
    for (joints, root) in [
        ([Joint::Weld, Joint::Weld], 4.730_040_744_862_704_f64),
        ([Joint::Weld, Joint::Ball], 3.926_602_312_047_919),
        ([Joint::Ball, Joint::Ball], std::f64::consts::PI),
    ] {
        for length in [1.0, 2.0] {
            let law = || Linear::diagonal([1.0, 1.7], 0.6).unwrap();
            let rod = Rod::new(length, law()).unwrap();
            let here = Isometry3::identity();
            let (from, to) = (
                Attachment::ground(here),
                Attachment::ground(Isometry3::translation(0.0, 0.0, length)),
            );
            let link = match joints {
                [Joint::Weld, joint] => Link::new(rod, from, to, joint),
                _ => Link::pinned(rod, from, to),
            };
            let q = Vector6::zeros();
            let point = link.point(0.0, &[], &q, 1e-13).unwrap();
            let found = held_modes(&massive(link.rod()), &link, &q, &point, 2).unwrap();
            for (mode, bending) in found.iter().zip([1.0, 1.7]) {
                let square = bending * root.powi(4) / (EPS * length.powi(3));
                near(mode.square, square, 1e-8);
                near(mode.proportional, 0.5 * square, 1e-8);
                assert_eq!(mode.decay, 0.0);
            }
        }
    }
}

/// Catches a wrong wrench, end or sign on bent rods: the planar model computes the vibrations of the held rod
/// independently.
#[test]
fn bent_rods_vibrate_as_in_the_plane() {
    let assembly = single(flat(), Joint::Ball);
    let link = &assembly.links()[0];
    for (lam, p) in [(1.4, -1.6), (4.0, 0.7), (6.3, 0.7)] {
        let at = Equilibrium::from_lambda_p(lam, p).unwrap();
        let now = laid(link, &at, &Vector2::zeros());
        let point = link.point(0.0, &now.bodies, &now.charts[0], 1e-13).unwrap();
        let found = held_modes(&massive(link.rod()), link, &now.charts[0], &point, 1).unwrap()[0];
        let expected = held_in_plane(at.p, at.w, 1).unwrap()[0];
        near(found.square * EPS, expected.stiffness, 1e-8);
        near(found.proportional * EPS, expected.friction, 1e-8);
    }
}

/// Catches a wrong null vector, stiffness or unit of the normal form: at the three folds of theory 2.8 the spatial one
/// equals the planar one. A, B, M0, D0 depend on the length of the critical direction; the delays and D0/M0 do not.
#[test]
fn folds_have_the_normal_form_of_the_plane() {
    let assembly = single(flat(), Joint::Ball);
    let link = &assembly.links()[0];
    for (p, v) in [
        (0.639_250_507, [0.0, -0.5]),
        (0.9, [-0.799, -0.033]),
        (2.2, [0.934, 0.359]),
    ] {
        let v = Vector2::from(v);
        let at = fold_at(1, p).unwrap().equilibrium;
        let expected = elastica::FoldNormalForm::new(at.p, at.w, &v).unwrap();
        let now = laid(link, &at, &v);
        let point = link.point(0.0, &now.bodies, &now.charts[0], 1e-13).unwrap();
        let (found, eta) = fold_form(&massive(link.rod()), link, &now.charts[0], &point).unwrap();
        near(found.inertial(EPS), expected.inertial(EPS), 1e-6);
        near(found.viscous(1e-3), expected.viscous(1e-3), 1e-6);
        near(
            found.friction / found.mass,
            expected.friction / expected.mass,
            1e-6,
        );
        assert_eq!(eta, 0.0);
    }
}

/// Summary and events of a run.
fn ran(text: &str, set: &[&str]) -> (Value, Vec<Value>) {
    let scene = Scene::parse_with(text, set).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let prepared = run::Prepared::new(&scene).unwrap();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
    (record.summary(), record.events())
}

/// The reference snap of theory 2.6.
const SNAP: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 1e-4
inertia = "none"
[body]
mass = 1.0
[start]
lambda = 6.3
kappa = 0.6
velocity = [0.0, -0.5]
[run]
duration = 0.1
tolerance = 1e-9
"#;

/// Catches numbers of a spatial run in other units or of another moment: the planar rod under a tiny distributed load
/// runs in space, with the values of its planar closed form.
#[test]
fn a_run_in_space_tells_what_it_tells_in_the_plane() {
    let (plane, _) = ran(SNAP, &[]);
    let set = ["loads.distributed=[0.0, 1e-10]"];
    let (space, events) = ran(SNAP, &set);
    assert!(space["end"].get("z").is_some(), "{space:#}");
    for (field, tolerance) in [
        ("eps", 1e-12),
        ("frequency_shift", 1e-7),
        ("rod_frequency", 1e-8),
        ("folds/0/t", 1e-7),
        ("folds/0/inertial_delay", 1e-5),
    ] {
        let path = format!("/validity/{field}");
        near(
            number_at(&space, &path),
            number_at(&plane, &path),
            tolerance,
        );
    }
    let ratio = |of: &Value| {
        let folds = |field| number_at(of, &format!("/validity/folds/0/{field}"));
        // A rate over a Kelvin-Voigt time.
        folds("D0") / folds("M0") / number_at(of, "/scales/time").powi(2)
    };
    near(ratio(&space), ratio(&plane), 1e-5);
    assert_eq!(space["validity"]["verdict"], plane["validity"]["verdict"]);
    let delay = &space["validity"]["folds"][0]["inertial_delay"];
    assert_eq!(&events[0]["mass"]["inertial_delay"], delay);
    assert!(events[0]["mass"]["verdict"].is_string());
}

/// A bent rod under gravity.
const BENT: &str = r#"
[rod]
model = "cosserat"
length = 2.0
section = { bending = [1.0, 1.6], torsion = 0.8 }
mass = 5e-3
section_inertia = [1e-6, 2e-6, 3e-6]
inertia = "none"
damping = { proportional = 0.001 }
[body]
mass = 5.0
joint = "ball"
[loads]
gravity = [0.0, 0.02, -0.03]
dead = [0.2, 0.1, -0.1]
[start]
settled = true
[run]
duration = 1.0
"#;

/// Catches numbers of another equilibrium, mass or unit, against the frequencies of the rod with full mass about the
/// same equilibrium. The lowest frequency differs by the shift. The first one beyond those of the body is that of the
/// held rod. Both hold up to the order of the mass; so does the decay.
#[test]
fn small_motions_in_space_tell_what_the_mass_changes() {
    let weld = [
        "body.joint=\"weld\"",
        "body.inertia=[0.4, 0.5, 0.6]",
        "body.offset=[0.1, 0.0, 0.2]",
    ];
    for (more, freedoms) in [(&[][..], 3), (&weld[..], 6)] {
        let of = |inertia: &str| {
            let mut set = more.to_vec();
            set.push(inertia);
            let scene = Scene::parse_with(BENT, &set).unwrap();
            study::modes(&scene).unwrap().motions
        };
        let near = |found: f64, expected: f64| near(found, expected, 0.01);
        let [light, full] = ["none", "full"].map(|kind| of(&format!("rod.inertia={kind:?}")));
        let mass = light.mass.as_ref().unwrap();
        let [own] = &*mass.rods else { panic!() };
        assert_eq!(own.eps, Some(1e-3));
        let [a, b] = [&light, &full].map(study::modes::SmallMotions::angular_frequencies);
        near(b[0] / a[0] - 1.0, mass.frequency_shift.unwrap());
        near(b[freedoms], own.frequency.unwrap());
        let decays = full.eigenvalues.unwrap();
        let rates = decays.iter().filter(|s| s.im > 0.5 * b[freedoms]);
        let slowest = rates.map(|s| -s.re).fold(f64::INFINITY, f64::min);
        near(slowest, own.decay.unwrap());
        assert!(full.mass.is_none());
    }
}

/// Two clamped rods of different length and mass, but equal EI/L^2, with a body between them, which does not turn in
/// transverse motion.
const BRIDGE: &str = r#"
[[rod]]
name = "left"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 2.0], torsion = 0.7, axial = 1e4 }
section_inertia = [1e-12, 1e-12, 1e-12]
mass = 0.01
inertia = "none"
from = { position = [0.0, 0.0, 0.0] }
to = { body = "p" }
[[rod]]
name = "right"
model = "cosserat"
length = 2.0
section = { bending = [4.0, 8.0], torsion = 0.7, axial = 1e4 }
section_inertia = [1e-12, 1e-12, 1e-12]
mass = 0.03
inertia = "none"
from = { body = "p" }
to = { position = [0.0, 0.0, 3.0] }
[[body]]
name = "p"
mass = 2.0
inertia = [0.02, 0.03, 0.02]
[run]
duration = 0.01
"#;

/// Catches a rod omitted, or counted about another base or with another body. Straight beams have 13/35 of their mass
/// in a transverse motion of one end, and the stiffness 12 EI/L^3; held rods vibrate between two clamps.
#[test]
fn rods_of_an_assembly_have_the_numbers_of_beams() {
    let clamped = 4.730_040_744_862_704_f64.powi(2);
    let (found, _) = ran(BRIDGE, &[]);
    let field = |path: &str| number_at(&found, &format!("/validity/{path}"));
    near(
        field("frequency_shift"),
        -0.5 * (0.04 / 2.0) * 13.0 / 35.0,
        1e-8,
    );
    near(field("eps"), 0.015, 1e-12);
    for (k, (stiffness, mass, length)) in [(1.0, 0.01, 1.0_f64), (4.0, 0.03, 2.0)]
        .into_iter()
        .enumerate()
    {
        near(field(&format!("rods/{k}/eps")), mass / 2.0, 1e-12);
        let omega = clamped * f64::sqrt(stiffness / (mass * length.powi(3)));
        near(field(&format!("rods/{k}/rod_frequency")), omega, 1e-8);
        assert_eq!(field(&format!("rods/{k}/rod_decay")), 0.0);
    }
    let verdict = found["validity"]["verdict"].as_str().unwrap();
    assert!(verdict.starts_with("massless rods"), "{verdict}");
}

/// Catches a frame or unit specific to the single rod: an assembly of one bent rod agrees with the single rod, and
/// does so started at its other end.
#[test]
fn an_assembly_of_one_rod_is_the_single_rod() {
    let rod = r#"
name = "r"
model = "cosserat"
length = 2.0
section = { bending = [1.0, 1.6], torsion = 0.8 }
mass = 5e-3
section_inertia = [1e-6, 2e-6, 3e-6]
inertia = "none"
"#;
    let body = r#"
[[body]]
name = "p"
mass = 5.0
inertia = [0.4, 0.5, 0.6]
force = [0.2, 0.1, -0.1]
[loads]
gravity = [0.0, 0.02, -0.03]
"#;
    let ways = [
        "from = { position = [0.0, 0.0, 0.0] }\nto = { body = \"p\" }",
        "from = { body = \"p\", quaternion = [0.0, 1.0, 0.0, 0.0] }\nto = { position = [0.0, 0.0, 0.0], quaternion = [0.0, 1.0, 0.0, 0.0] }",
    ];
    let mass = |text: &str, set: &[&str]| {
        let scene = Scene::parse_with(text, set).unwrap();
        study::modes(&scene).unwrap().motions.mass.unwrap()
    };
    let single = mass(
        &BENT.replace("damping = { proportional = 0.001 }\n", ""),
        &["body.joint=\"weld\"", "body.inertia=[0.4, 0.5, 0.6]"],
    );
    for way in ways {
        let found = mass(&format!("[[rod]]{rod}{way}\n{body}"), &[]);
        near(
            found.frequency_shift.unwrap(),
            single.frequency_shift.unwrap(),
            1e-8,
        );
        let [a, b] = [&found.rods[0], &single.rods[0]];
        assert_eq!(a.eps, b.eps);
        near(a.frequency.unwrap(), b.frequency.unwrap(), 1e-8);
    }
}

/// Catches a wrong unit, wrench or end in branches. A straight column under a push P with a held end vibrates with a
/// tanh b = b tan a. Here a^2 and -b^2 are the roots of x^2 - P x = omega^2 m L^3/B. For an assembly the numbers are
/// those of its equilibria.
#[test]
fn branches_tell_what_the_mass_changes() {
    const COLUMN: &str = r#"
[rod]
model = "cosserat"
length = 2.0
section = { bending = [3.0, 5.0], torsion = 2.0 }
mass = 0.7
[end]
force = [0.0, 0.0, -1.0]
[continue]
parameter = "end.load"
from = 0.0
to = 1.0
"#;
    let told = |text: &str| {
        let scene = Scene::parse(text).unwrap();
        let record = study::branch(&scene, &mut Silent).unwrap();
        record.summary()["mass"].clone()
    };
    let found = told(COLUMN);
    for (k, load) in [0.0_f64, 1.0].into_iter().enumerate() {
        assert_eq!(number_at(&found, &format!("/{k}/parameter")), load);
        assert!(found[k]["eps"].is_null() && found[k]["frequency_shift"].is_null());
        let omega = number_at(&found, &format!("/{k}/rod_frequency"));
        // Units of the length, the smaller stiffness and the mass.
        let (push, square) = (load * 4.0 / 3.0, omega * omega * 0.7 * 8.0 / 3.0);
        let root = (0.25 * push * push + square).sqrt();
        let (a, b) = ((root + 0.5 * push).sqrt(), (root - 0.5 * push).sqrt());
        // The slowest: a rises from 3.927 without a push to 4.493 where the column buckles.
        assert!(a > 3.92 && a < 4.5, "{a}");
        near(a * b.tanh(), b * a.tan(), 1e-6);
    }
    // The axial stiffness implies a rotary inertia of the sections, whose effect is 1e-5.
    let bridge = BRIDGE.replace("section_inertia = [1e-12, 1e-12, 1e-12]\n", "");
    let bridge = bridge.replace("axial = 1e4", "axial = 1e5").replace(
        "[run]\nduration = 0.01",
        "[continue]\nparameter = \"body[0].force[0]\"\nfrom = 0.0\nto = 0.1",
    );
    let found = told(&bridge);
    let shift = -0.5 * (0.04 / 2.0) * 13.0 / 35.0;
    near(number_at(&found, "/0/frequency_shift"), shift, 1e-3);
    near(number_at(&found, "/0/rods/1/eps"), 0.015, 1e-12);
}
