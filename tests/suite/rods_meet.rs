//! Rods with all of their mass that touch each other and themselves: against differences, conservation laws, closed
//! forms.

use crate::heavy_assemblies::{given, link, weld};
use crate::heavy_obstacles::ran;
use nalgebra::{DVector, Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use snaprod::assembly::{Attachment, Body, BodyMotion};
use snaprod::body::RigidBody;
use snaprod::full_mass::assembly::HeavyAssembly;
use snaprod::full_mass::elements::{BarrierStrength, ElementAssembly, Mesh};
use snaprod::full_mass::obstacles::{ObstaclesOfRods, RoundSurface};
use snaprod::scene::Scene;
use snaprod::solve::system::{Linearised, System};
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table};
use std::f64::consts::TAU;

/// Radius, pitch and turns of a coil, and the thickness of its rod.
const COIL: [f64; 4] = [0.15, 0.105, 2.2, 0.1];

/// The section of the coil at s in [0, 1].
fn coil(s: f64) -> BodyMotion {
    let [radius, pitch, turns, _] = COIL;
    let phi = TAU * turns * s;
    let place = Vector3::new(radius * phi.cos(), radius * phi.sin(), pitch * turns * s);
    let along = Vector3::new(-radius * phi.sin(), radius * phi.cos(), pitch / TAU).normalize();
    let out = Vector3::new(phi.cos(), phi.sin(), 0.0);
    let turn = Rotation3::from_basis_unchecked(&[out, along.cross(&out), along]);
    let half = UnitQuaternion::from_rotation_matrix(&turn);
    BodyMotion::at_rest(Isometry3::from_parts(Translation3::from(place), half))
}

/// A coil on a body, whose turns push each other with this friction, in a state that moves; with anchors of the state
/// before a displacement.
fn coiled(friction: f64, settling: f64) -> (ElementAssembly, DVector<f64>) {
    let [radius, pitch, turns, thick] = COIL;
    let length = turns * (TAU * radius).hypot(pitch);
    let rod = given(0.4, 0.0, length, Vector3::zeros(), &[0, 1, 2, 3, 4, 5]);
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.03, 0.02, 0.04));
    let body = RigidBody::new(1.0, inertia).unwrap();
    let on = Attachment::body(0, Isometry3::identity());
    let links = vec![link(rod, 6, weld(on), None)];
    let touching = ObstaclesOfRods {
        obstacles: Vec::new(),
        frame: Isometry3::identity(),
        rods: vec![RoundSurface {
            radius: 0.5 * thick,
            friction: Vec::new(),
        }],
        between: vec![vec![Some(friction)]],
        balls: Vec::new(),
        gap: 0.02,
        stick: 2e-3,
    };
    let touching = touching.checked(1.0).unwrap();
    let assembly = HeavyAssembly::new(vec![Body::rigid(body)], links).unwrap();
    let mesh = Mesh {
        elements: vec![vec![6]],
        degree: 6,
    };
    let model = ElementAssembly::new(&assembly.among(touching), mesh).unwrap();
    let strength = BarrierStrength {
        push: 300.0,
        settling,
    };
    let model = model.with_barrier_strength(Some(strength));
    let nodes: Vec<BodyMotion> = model.places(0).iter().map(|s| coil(*s)).collect();
    let mut y = model.state(&[nodes[0]], &[nodes]);
    let (time, sites) = (model.time(), model.sites());
    // Quaternions of one sign along the rod.
    for i in 1..sites {
        let dot: f64 = (3..7).map(|k| y[7 * i + k] * y[7 * (i - 1) + k]).sum();
        if dot < 0.0 {
            (3..7).for_each(|k| y[7 * i + k] = -y[7 * i + k]);
        }
    }
    let moment = model.moment(&y).unwrap();
    let model = model.with_near_rods(&moment, 0.0).anchored(&moment);
    for i in 0..sites {
        for k in 0..3 {
            y[7 * i + k] += 2e-4 * (1.7 * (3 * i + k) as f64 + 0.4).sin();
        }
    }
    for i in 7 * sites..time {
        y[i] += 0.05 * (1.3 * i as f64 + 0.1).sin();
    }
    assert!(model.moment(&y).unwrap().barrier() > 0.0);
    (model, y)
}

fn slope(model: &ElementAssembly, y: &DVector<f64>) -> DVector<f64> {
    let mut out = DVector::zeros(y.len());
    System::slope(model, y, &mut out).unwrap();
    out
}

/// Energies of a smooth motion are kept, and the loss at closing and to friction is booked. Catches forces that are not
/// those of the energy, a nearest place that does not follow, a wrong lever of friction, and a wrong rate of a gap.
#[test]
fn forces_of_rods_on_each_other_are_those_of_their_energy() {
    for (friction, settling) in [(0.0, 0.0), (0.0, 1.5), (0.4, 1.5)] {
        let (model, y) = coiled(friction, settling);
        let rate = slope(&model, &y);
        let total = |y: &DVector<f64>| -> f64 {
            let moment = model.moment(y).unwrap();
            let books = y.as_slice()[model.time() + 1..].iter();
            let lost: f64 = books
                .enumerate()
                .map(|(i, x)| if i == 1 { -x } else { *x })
                .sum();
            model.energies(&moment).iter().sum::<f64>() + lost
        };
        let h = 1e-5;
        let change = (total(&(&y + &rate * h)) - total(&(&y - &rate * h))) / (2.0 * h);
        let barrier = |h: f64| model.moment(&(&y + &rate * h)).unwrap().barrier();
        let size = ((barrier(h) - barrier(-h)) / (2.0 * h)).abs();
        assert!(size > 1e-3, "{size}");
        assert!(
            change.abs() < 1e-5 * size,
            "friction {friction}, settling {settling}: {change:e} of {size:e}"
        );
    }
}

/// Derivative of the accelerations along `x` by the barrier alone: by Newton's matrix, and by differences.
fn by_barrier(model: &ElementAssembly, y: &DVector<f64>, x: &DVector<f64>) -> [DVector<f64>; 2] {
    let none = BarrierStrength {
        push: 0.0,
        settling: 0.0,
    };
    let without = model.clone().with_barrier_strength(Some(none));
    let found = [model, &without].map(|model| System::linearised(model, y).unwrap().times(x));
    let step = 1e-7;
    let difference = |model: &ElementAssembly| {
        (slope(model, &(y + x * step)) - slope(model, &(y - x * step))) / (2.0 * step)
    };
    [
        &found[0] - &found[1],
        difference(model) - difference(&without),
    ]
}

/// Newton's matrix is that of differences. It leaves out how levers and direction of friction turn with the normal: a
/// part of the size of the sticking length over the thickness.
#[test]
fn the_matrix_of_rods_that_touch_is_that_of_differences() {
    for (friction, bound) in [(0.0, 1e-5), (0.4, 3e-2)] {
        let (model, y) = coiled(friction, 1.5);
        let (time, sites) = (model.time(), model.sites());
        let mut x = DVector::zeros(y.len());
        for i in 0..sites {
            for k in 0..3 {
                x[7 * i + k] = (0.9 * (3 * i + k) as f64 + 0.2).sin();
            }
        }
        for i in 7 * sites..time {
            x[i] = 0.1 * (0.7 * i as f64).sin();
        }
        let [found, wanted] = by_barrier(&model, &y, &x);
        let speeds = 7 * sites..time;
        let size = wanted.rows(speeds.start, speeds.len()).amax();
        let off = (found - &wanted).rows(speeds.start, speeds.len()).amax();
        assert!(
            size > 0.0 && off < bound * size,
            "friction {friction}: {off:e} of {size:e}"
        );
    }
}

/// In a motion of the whole as one body nothing slides and no gap changes: contacts then give no power, which is to say
/// that their forces and couples have no sum. Catches friction without its couples.
#[test]
fn contacts_of_rods_give_no_power_in_a_rigid_motion() {
    let (model, mut y) = coiled(0.4, 1.5);
    let sites = model.sites();
    let (spin, shift) = (Vector3::new(0.3, -0.7, 0.5), Vector3::new(0.2, 0.1, -0.4));
    for i in 0..sites {
        let place = Vector3::new(y[7 * i], y[7 * i + 1], y[7 * i + 2]);
        let velocity = shift + spin.cross(&place);
        for k in 0..3 {
            y[7 * sites + 6 * i + k] = spin[k];
            y[7 * sites + 6 * i + 3 + k] = velocity[k];
        }
    }
    let rate = slope(&model, &y);
    let barrier = |h: f64| model.moment(&(&y + &rate * h)).unwrap().barrier();
    let change = (barrier(1e-4) - barrier(-1e-4)) / 2e-4;
    assert!(change.abs() < 1e-6 * barrier(0.0), "{change:e}");
    let contacts = model.barrier_contacts(&model.moment(&y).unwrap());
    let friction: f64 = contacts.iter().map(|at| at.friction.norm()).sum();
    let lost = rate[model.time() + 4].abs() + rate[model.time() + 5].abs();
    assert!(friction > 1e-2, "{friction}");
    assert!(lost < 1e-9 * friction, "{lost:e}");
}

/// Two rods of length 1 across each other, each between a clamp and a clamp that slides along the rod. The lower one
/// rises by `0.11`, of which it takes 0.01 to the touch.
fn crossed(gap: f64, more: &str) -> String {
    let rod = |name: &str, ends: [&str; 2], along: &str, motion: &str| {
        format!(
            r#"
            [[rod]]
            name = "{name}"
            model = "cosserat"
            length = 1.0
            mass = 0.02
            inertia = "full"
            contact_diameter = 0.02
            damping = {{ proportional = 0.1 }}
            section = {{ bending = [1.0, 1.0], torsion = 0.8 }}
            from = {{ position = {}, tangent = {along}{motion} }}
            to = {{ position = {}, tangent = {along}, joint = "slider", axis = [0.0, 0.0, 1.0]{motion} }}
            "#,
            ends[0], ends[1]
        )
    };
    let rises = ", motion = { translate = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.11]] }";
    let upper = rod(
        "upper",
        ["[-0.5, 0.0, 0.0]", "[0.5, 0.0, 0.0]"],
        "[1.0, 0.0, 0.0]",
        "",
    );
    let lower = rod(
        "lower",
        ["[0.0, -0.5, -0.03]", "[0.0, 0.5, -0.03]"],
        "[0.0, 1.0, 0.0]",
        rises,
    );
    let run = "[run]\nduration = 2.0\nsamples = 5\ntolerance = 1e-3\n";
    format!("{upper}{lower}[contact]\ngap = {gap}\n{more}\n{run}")
}

/// Rods pressed on each other across: the force of the elastica, whose ends move in by 0.00602070462. Two routes give
/// the numbers (acceptance of contact in space, `crossed`, overlap 0.1). The error falls with the gap.
/// Catches a wrong size of the barrier's sums, and force on one rod alone.
#[test]
fn crossed_rods_press_each_other_as_elasticas_do() {
    let wanted = [9.699905241729098, 0.0060207046204058205];
    let off = [4e-4, 1e-4].map(|gap| {
        let ran = ran(&crossed(gap, ""), 5e-3);
        let force: f64 = ran.last_contacts("normal").iter().sum();
        let ends = ["upper", "lower"].map(|name| ran.last(&format!("{name}.to.shift")));
        let [a, b] = ends;
        assert!((a - b).abs() < 1e-6 * a.abs(), "{a} {b}");
        [force / wanted[0] - 1.0, -a / wanted[1] - 1.0]
    });
    for (far, near) in off[0].iter().zip(off[1]) {
        assert!(0.0 < near && near < 2e-3, "{off:?}");
        assert!((2.5..6.0).contains(&(far / near)), "{off:?}");
    }
}

/// With friction crossed rods stick to each other where without friction they slide: the tip of a heavy cantilever that
/// falls across a stiffer rod. What sticks does not creep. Catches friction that creeps or exceeds Coulomb's.
#[test]
fn a_cantilever_sticks_to_the_rod_that_it_falls_on() {
    let rod = |name: &str, bending: f64, from: &str| {
        format!(
            r#"
            [[rod]]
            name = "{name}"
            model = "cosserat"
            length = 1.0
            mass = 1.0
            inertia = "full"
            contact_diameter = 0.02
            damping = {{ proportional = 0.1 }}
            section = {{ bending = [{bending:?}, {bending:?}], torsion = {bending:?}, shear = [1e4, 1e4], axial = 2e4 }}
            from = {{ {from} }}
            to = "free"
            "#
        )
    };
    let falls = rod(
        "falls",
        1.0,
        "position = [-0.5, 0.0, 0.0], tangent = [1.0, 0.0, 0.0]",
    );
    let bar = rod(
        "bar",
        20.0,
        "position = [0.0, -0.5, -0.1], tangent = [0.0, 1.0, 0.0]",
    );
    let scene = |friction: f64, duration: f64| {
        format!(
            "{falls}{bar}[start]\nrest = \"straight\"\n[loads]\ngravity = [0.0, 0.0, -4.0]\n\
             [contact]\ngap = 1e-3\nfriction = {friction:?}\n\
             [run]\nduration = {duration:?}\nsamples = 3\ntolerance = 1e-3\n"
        )
    };
    let place = |friction: f64, duration: f64| {
        let ran = ran(&scene(friction, duration), 2e-3);
        let [normal, rubbed, s] =
            ["normal", "tangential", "s"].map(|name| ran.last_contacts(name)[0]);
        assert!(rubbed <= friction * normal * (1.0 + 1e-12));
        (s, rubbed / normal)
    };
    let (slid, _) = place(0.0, 4.0);
    let (held, share) = place(0.4, 4.0);
    let (later, _) = place(0.4, 40.0);
    assert!((slid - held).abs() > 3e-4, "{slid} {held}");
    assert!(0.01 < share && share < 0.399, "{share}");
    assert!((later - held).abs() < 1e-6, "crept by {:e}", later - held);
}

fn tables_of(text: &str) -> Vec<Table> {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}"));
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent);
    let record = record.unwrap_or_else(|why| panic!("{why}"));
    assert!(record.reason().is_none(), "{:?}", record.reason());
    tables
}

/// The straight rod between clamps, one of which turns by 5 radians: C 5^2/2. Catches a quaternion of the clamp that
/// jumps to the other sign, as at 240 degrees.
#[test]
fn a_clamp_turns_a_rod_in_elements_by_more_than_240_degrees() {
    let text = r#"
        [[rod]]
        name = "bar"
        model = "cosserat"
        length = 1.0
        mass = 1.0
        inertia = "full"
        contact_diameter = 0.0
        damping = { proportional = 0.1 }
        section = { bending = [1.0, 1.0], torsion = 0.8, shear = [1e4, 1e4], axial = 2e4 }
        from = { position = [0.0, 0.0, 0.0], tangent = [0.0, 0.0, 1.0], motion = { turn = { axis = [0.0, 0.0, 1.0], table = [[0.0, 0.0], [2.0, 5.0]] } } }
        to = { position = [0.0, 0.0, 1.0], tangent = [0.0, 0.0, 1.0] }
        [run]
        duration = 4.0
        samples = 3
        tolerance = 1e-3
        "#;
    let tables = tables_of(text);
    let energy = *tables[0].reals("elastic").last().expect("rows");
    assert!((energy / 10.0 - 1.0).abs() < 1e-4, "{energy}");
}

/// Rods that start inside of each other are refused with the place, and rules of contact that would be ignored by name;
/// pairs that are apart pass through each other.
#[test]
fn rods_inside_of_each_other_are_refused_and_pairs_apart_pass() {
    let text = crossed(1e-3, "").replace("-0.03]", "-0.015]");
    let scene = Scene::parse(&text).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let why = match Prepared::new(&scene) {
        Ok(prepared) => run(&prepared, Fields::None, &mut tables, &mut Silent).err(),
        Err(why) => Some(why),
    };
    let why = why.expect("a refusal").to_string();
    assert!(why.contains("nearer to each other at the start"), "{why}");
    let refused = [
        (r#"method = "exact""#, "through a barrier"),
        (
            r#"pairs = [{ between = ["uper", "lower"], apart = true }]"#,
            "uper",
        ),
    ];
    for (more, words) in refused {
        let told = Scene::parse(&crossed(1e-3, more))
            .expect_err(more)
            .to_string();
        assert!(told.contains(words), "{told}");
    }
    let itself = r#"pairs = [{ between = ["upper", "upper"], apart = true }]"#;
    assert!(Scene::parse(&crossed(1e-3, itself)).is_ok());
    let apart = r#"pairs = [{ between = ["upper", "lower"], apart = true }]"#;
    let tables = tables_of(&crossed(1e-3, apart));
    let bent = *tables[0].reals("elastic").last().expect("rows");
    assert!(bent < 1e-6, "{bent}");
}
