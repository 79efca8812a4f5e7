//! Rods of full mass without bodies: frequencies of beams (tests/data/beams.json), a cantilever that is pushed.

use crate::support::{frequencies, json, list, modes_of, number, one_fault};
use nalgebra::Vector3;
use snaprod::motion::Outcome;
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table};

/// A rod of length, mass and bending stiffness 1 along x, that twists too fast to be among the slowest motions.
fn beam(more: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nmass = 1.0\ninertia = \"full\"\n{more}\n\
         [run]\nduration = 1.0\ntolerance = 1e-5\nsamples = 11\n"
    )
}

/// Frequencies of a beam in tests/data/beams.json.
fn exact(ends: &str, rotary: f64) -> Vec<f64> {
    let data = json("beams.json");
    let mut beams = data.as_array().expect("beams").iter();
    let beam = beams.find(|row| row["ends"] == ends && number(row, "rotary") == rotary);
    list(&beam.expect("the beam")["frequencies"])
}

fn record(text: &str) -> RunRecord {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).unwrap();
    run(
        &prepared,
        Fields::None,
        &mut Vec::<Table>::new(),
        &mut Silent,
    )
    .unwrap()
}

/// Catches an effect of the tiny mass that stands for the missing body, and rotary inertia where none is given. Catches
/// rods without a body that lack shear or rotary inertia.
#[test]
fn bare_cantilevers_have_the_frequencies_of_beams() {
    let slender = "section = { bending = [1.0, 1.0], torsion = 1.0 }";
    let thick = "section = { bending = [1.0, 1.0], torsion = 1e3, shear = [400.0, 400.0] }\n\
                 section_inertia = [2e-3, 2e-3, 4e-3]";
    for (rod, rotary) in [(slender, 0.0), (thick, 2e-3)] {
        let found = frequencies(&modes_of(&beam(rod)));
        for (pair, wanted) in found.chunks(2).zip(exact("cantilever", rotary)) {
            for omega in pair {
                assert!((omega - wanted).abs() < 1e-9 * wanted, "{omega} {wanted}");
            }
        }
    }
}

/// Catches loads that do not reach an end without a body, or a body that is still there. The deflection under a sudden
/// small force F across the end is the sum of 4 F/omega^2 (1 - cos omega t) over the vibrations.
#[test]
fn a_bare_cantilever_is_pushed() {
    let force = 0.03;
    let text = beam("section = { bending = [1.0, 1.0], torsion = 1.0 }")
        + &format!("[loads]\ndead = [{force}, 0.0, 0.0]\n[start]\nrest = \"straight\"\n");
    let found = record(&text);
    let branch = &found.branches[0];
    assert!(matches!(branch.outcome, Outcome::EndOfTime));
    for at in &branch.way {
        let terms = exact("cantilever", 0.0).into_iter();
        let terms = terms.map(|w| 4.0 * force / (w * w) * (1.0 - (w * at.t).cos()));
        let wanted: f64 = terms.sum();
        let x = at.position().x;
        assert!((x - wanted).abs() < 1e-4, "{x} {wanted} at {}", at.t);
    }
}

/// Catches a message on a missing body that does not name the alternative, the full mass of the rod.
#[test]
fn a_rod_without_its_mass_needs_a_body() {
    let text = beam("section = { bending = [1.0, 1.0], torsion = 1.0 }");
    let text = text.replace("inertia = \"full\"\n", "");
    let found = Scene::parse(&text).unwrap_err();
    let words = "`inertia = \"full\"` in [rod]";
    one_fault(
        found.as_slice(),
        &text,
        (9, "body", FaultKind::Missing, words),
    );
}

/// Catches a base that is felt, rigid motions told as vibrations or lost, and a fifth digit lost to the shift that free
/// motions need.
#[test]
fn free_beams_have_six_rigid_motions_and_the_frequencies_of_beams() {
    let slender = "section = { bending = [1.0, 1.0], torsion = 1.0 }";
    let thick = "section = { bending = [1.0, 1.0], torsion = 1e3, shear = [400.0, 400.0] }\n\
                 section_inertia = [2e-3, 2e-3, 4e-3]";
    for (rod, rotary) in [(slender, 0.0), (thick, 2e-3)] {
        let found = frequencies(&modes_of(&(beam(rod) + "[clamp]\nfree = true\n")));
        let (rigid, elastic) = found.split_at(6);
        assert_eq!(rigid, [0.0; 6]);
        for (pair, wanted) in elastic.chunks(2).zip(exact("free", rotary)) {
            for omega in pair {
                assert!((omega - wanted).abs() < 1e-9 * wanted, "{omega} {wanted}");
            }
        }
    }
}

/// Catches a held base or end, a start of the base with the motion of the end, and columns of the base in the frame of
/// the start. A straight rod under its weight alone flies as a rigid rod: its middle moves on a parabola, and the rod
/// turns evenly.
#[test]
fn a_free_rod_flies_and_turns() {
    let text = beam("section = { bending = [1.0, 1.0], torsion = 1.0 }")
        + "[clamp]\nfree = true\nposition = [0.2, 0.0, 0.0]\nrotation = { axis = [0.0, 1.0, 0.0], angle = 0.4 }\n\
           [loads]\ngravity = [0.0, 0.0, -2.0]\n\
           [start]\nrest = \"straight\"\nvelocity = [1.0, 0.0, 2.0]\nangular_velocity = [0.0, 1.5, 0.0]\n";
    let text = text.replace("tolerance = 1e-5", "tolerance = 1e-3");
    let found = record(&text);
    let branch = &found.branches[0];
    assert!(matches!(branch.outcome, Outcome::EndOfTime));
    for at in &branch.way {
        let half = |t: f64| {
            let angle: f64 = 0.4 + 1.5 * t;
            Vector3::new(angle.sin(), 0.0, angle.cos()) * 0.5
        };
        let first = Vector3::new(0.2, 0.0, 0.0) + half(0.0);
        let velocity = Vector3::new(1.0, 0.0, 2.0) + Vector3::new(0.0, 1.5, 0.0).cross(&half(0.0));
        let middle = first + velocity * at.t - Vector3::z() * (at.t * at.t);
        for (body, side) in at.bodies.iter().zip([1.0, -1.0]) {
            let off = (body.pose.translation.vector - middle - half(at.t) * side).norm();
            assert!(off < 1e-3, "{off} at {}", at.t);
        }
        assert_eq!(at.bodies.len(), 2);
    }
}

/// Catches a free base that is taken where nothing can move, without a word or without advice.
#[test]
fn free_bases_are_refused_where_nothing_flies() {
    let section = "section = { bending = [1.0, 1.0], torsion = 1.0 }";
    let free = "[clamp]\nfree = true\n";
    let statics = format!("[rod]\nmodel = \"cosserat\"\nlength = 1.0\n{section}\n{free}[end]\n");
    let light = beam(section).replace("inertia = \"full\"\n", "")
        + free
        + "[body]\nmass = 1.0\njoint = \"ball\"\n";
    let settled = beam(section) + free + "[start]\nsettled = true\n";
    for (text, line, words) in [
        (statics, 6, "false at rest"),
        (light, 11, "inertia = \"full\" in [rod]"),
        (settled, 12, "settles nowhere"),
    ] {
        let found = Scene::parse(&text).unwrap_err();
        one_fault(
            found.as_slice(),
            &text,
            (line, "clamp.free", FaultKind::Conflict, words),
        );
    }
}
