//! First-order mass of rods between two ball joints, in scenes: comparison with full rods (theory 3.9).

use nalgebra::Vector3;
use snaprod::scene::{Inertia, Scene};
use snaprod::study::run;
use snaprod::study::{self, Silent, Table};

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

/// Final position of the second body.
fn end(text: &str) -> Vector3<f64> {
    let prepared = run::Prepared::new(&parsed(text)).expect(text);
    let mut tables: Vec<Table> = Vec::new();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect(text);
    assert_eq!(record.reason(), None);
    let last = |name: &str| *tables[0].reals(name).last().expect("rows");
    Vector3::new(last("b.x"), last("b.y"), last("b.z"))
}

/// A crooked rod, unloaded at the start, between two bodies that nothing holds and that are set in motion smoothly,
/// from rest.
fn pair(inertia: &str, eps: f64) -> String {
    let nodes = if inertia == "full" { "nodes = 8\n" } else { "" };
    let section: Vec<f64> = [1e-3, 2e-3, 3e-3].map(|j| j * eps).into();
    format!(
        "[[rod]]\nname = \"r\"\nmodel = \"cosserat\"\nlength = 1.0\nmass = {eps}\ninertia = \"{inertia}\"\nsection_inertia = {section:?}\n{nodes}\
         section = {{ bending = [1.0, 1.6], torsion = 0.8, axial = 60.0, shear = [40.0, 50.0] }}\nrest = {{ curvature = [1.2, -0.5], twist = 0.4 }}\n\
         from = {{ body = \"a\", joint = \"ball\", position = [0.05, 0.0, 0.1] }}\nto = {{ body = \"b\", joint = \"ball\", position = [0.0, 0.1, 0.0] }}\n\
         [[body]]\nname = \"a\"\nmass = 1.0\ninertia = [0.06, 0.08, 0.05]\nguess = {{ position = [0.0, 0.0, 0.0] }}\n\
         force = {{ direction = [0.3, -1.0, 0.5], amplitude = 3.0, frequency = 0.8 }}\n[[body]]\nname = \"b\"\nmass = 1.0\ninertia = [0.05, 0.06, 0.07]\nguess = {{ position = [0.9, 0.0, 0.1] }}\n\
         force = {{ direction = [0.4, 0.6, 1.0], amplitude = 4.0, frequency = 0.7 }}\n[start]\nrest = \"straight\"\n[run]\nduration = 0.4\ntolerance = 1e-8\n"
    )
}

/// Catches a spin equation, or a reaction of the spin on the bodies, that is wrong to first order. Compared with the
/// full rod the bodies are off by the square of the rod's mass; without the correction, by its first power.
#[test]
#[ignore = "second tier: 23 s"]
fn the_error_is_of_second_order_in_the_mass() {
    let errors = [0.06, 0.02].map(|eps| {
        let full = end(&pair("full", eps));
        ["none", "first-order"].map(|inertia| (end(&pair(inertia, eps)) - full).norm())
    });
    let order = |k: usize| (errors[0][k] / errors[1][k]).ln() / 3.0_f64.ln();
    println!("{errors:?} {} {}", order(0), order(1));
    assert!((order(0) - 1.0).abs() < 0.15, "{errors:?}");
    assert!(order(1) > 1.7, "{errors:?}");
}

/// Catches a change of frequency that is not reported, or in wrong units: each of three straight bars from the ground
/// adds a third of its mass to a point, for motion in any direction.
#[test]
fn bars_lower_the_frequency_by_a_third_of_their_mass() {
    let (length, mass, body) = (0.7, 0.02, 1.5);
    let feet = [[1.0, 0.2, 0.1], [-0.3, 0.9, 0.2], [-0.2, -0.5, 0.7]];
    let rods = feet.iter().enumerate().map(|(k, foot)| {
        let foot = Vector3::from(*foot).normalize() * length;
        format!(
            "[[rod]]\nname = \"r{k}\"\nmodel = \"cosserat\"\nlength = {length}\nmass = {mass}\n\
             section = {{ bending = [1.0, 1.6], torsion = 0.8, axial = 6e7 }}\n\
             from = {{ joint = \"ball\", position = {:?} }}\nto = {{ body = \"b\", joint = \"ball\" }}\n",
            foot.as_slice()
        )
    });
    let rods: String = rods.collect();
    let text = format!(
        "{rods}[[body]]\nname = \"b\"\nmass = {body}\nguess = {{ position = [0.0, 0.0, 0.0] }}\n[run]\nduration = 1.0\n"
    );
    let scene = parsed(&text);
    // Such rods are followed by default.
    let notes = scene.mass_notes();
    assert!(notes.len() == 3 && notes.iter().all(|note| note.inertia == Inertia::FirstOrder));
    let motions = study::modes(&scene).expect("modes").motions;
    let shift = motions.mass.expect("masses").frequency_shift;
    let expected = -0.5 * mass / body;
    assert!(
        (shift.expect("a shift") / expected - 1.0).abs() < 1e-6,
        "{shift:?}"
    );
}
