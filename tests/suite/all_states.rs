//! Lists of all equilibria of one scene: energies, indices in space and in the plane, symmetry, completeness.

use crate::program::Place;
use snaprod::scene::Scene;
use snaprod::study::{AllEquilibriaRecord, Silent, all_equilibria, equilibria};

fn listed(text: &str) -> AllEquilibriaRecord {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    all_equilibria(&scene, 14.0, &mut Silent).unwrap()
}

/// An isotropic rod with both ends clamped 30 degrees upward, 0.6 apart. Energies are those of a shooting with
/// Runge-Kutta steps (PyElastica, issue 475). Catches a state that is missing, a mirror image that is missing, and an
/// index of the M-shaped state that mixes the plane with space.
#[test]
#[ignore = "second tier: 7 s"]
fn the_clamped_rod_has_its_planar_states() {
    let record = listed(
        r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.0], torsion = 0.8 }
[clamp]
rotation = { axis = [0, 1, 0], angle_degrees = 30.0 }
[end]
position = [0.0, 0.0, 0.6]
rotation = { axis = [0, 1, 0], angle_degrees = -30.0 }
"#,
    );
    let flat = |energy: f64| {
        let same = move |x: f64| (x / energy - 1.0).abs() < 1e-7;
        let states = record
            .states
            .iter()
            .filter(|state| state.index_in_plane.is_some());
        states
            .filter(|state| same(state.energy))
            .collect::<Vec<_>>()
    };
    let told = || {
        let one = |state: &snaprod::study::all_equilibria::StateRecord| {
            (state.energy, state.index, state.index_in_plane, state.how)
        };
        record.states.iter().map(one).collect::<Vec<_>>()
    };
    for energy in [9.737_617_32, 27.293_570_75, 53.908_315_74, 89.071_374_5] {
        assert_eq!(flat(energy).len(), 1, "{energy}: {:?}", told());
    }
    assert_eq!(flat(35.567_957_8).len(), 2, "{:?}", told());
    let (arch, m) = (flat(9.737_617_32)[0], flat(27.293_570_75)[0]);
    assert_eq!((arch.index, arch.index_in_plane), (0, Some(0)));
    assert_eq!((m.index, m.index_in_plane), (2, Some(0)));
    assert!(record.proven.contains("nothing is proven"));
}

/// The elastica with its end on a ball joint: all equilibria below lambda = 14, with the indices in the plane that
/// follow from the fold curves (`elastica::equilibria_at`). Here the index is counted by conjugate points of the rod.
#[test]
fn the_list_of_the_elastica_is_complete_in_its_plane() {
    let record = listed(
        r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [40.0, 1.0], torsion = 30.0 }
[end]
position = [0.35, 0.0, 0.3]
"#,
    );
    let planar = equilibria([0.3, 0.35], 14.0).unwrap();
    let mut expected: Vec<(f64, usize)> = (planar.found.iter())
        .map(|found| (found.equilibrium.energy, found.index))
        .collect();
    expected.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<(f64, usize)> = (record.states.iter())
        .filter_map(|state| Some((state.energy, state.index_in_plane?)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(
        expected.len() > 4 && found.len() >= expected.len(),
        "{found:?}"
    );
    for ((energy, index), (other, flat)) in expected.iter().zip(&found) {
        assert!(
            (energy / other - 1.0).abs() < 1e-8,
            "{expected:?} {found:?}"
        );
        assert_eq!(index, flat, "{expected:?} {found:?}");
    }
    assert!(record.proven.contains("complete below lambda = 14"));
}

/// A strip between clamps pushed together, as one rod and as two rods with a body between them. Catches a bow of one
/// rod to one side alone, and energies of an assembly in other units.
#[test]
#[ignore = "second tier: 24 s"]
fn a_strip_bows_to_both_sides() {
    let one = listed(
        r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 20.0], torsion = 2.0 }
[end]
position = [0.0, 0.0, 0.9]
rotation = { axis = [0, 0, 1], angle = 0.0 }
"#,
    );
    let two = listed(
        r#"
[[rod]]
name = "left"
model = "cosserat"
length = 0.5
section = { bending = [1.0, 20.0], torsion = 2.0 }
from = { position = [0.0, 0.0, 0.0] }
to = { body = "middle" }
[[rod]]
name = "right"
model = "cosserat"
length = 0.5
section = { bending = [1.0, 20.0], torsion = 2.0 }
from = { body = "middle" }
to = { position = [0.0, 0.0, 0.9] }
[[body]]
name = "middle"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
"#,
    );
    let stable = |record: &AllEquilibriaRecord| -> Vec<f64> {
        let states = record.states.iter().filter(|state| state.index == 0);
        states.map(|state| state.energy).collect()
    };
    let (one, two) = (stable(&one), stable(&two));
    assert_eq!((one.len(), two.len()), (2, 2), "{one:?} {two:?}");
    for energy in one.iter().chain(&two) {
        assert!((energy / one[0] - 1.0).abs() < 1e-8, "{one:?} {two:?}");
    }
}

/// Catches a command without its files, a figure without a panel for each state, and a scene of motion taken as one of
/// statics.
#[test]
fn the_command_writes_a_panel_for_each_state() {
    let place = Place::new("all-states");
    place.write(
        "strip.toml",
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 20.0], torsion = 2.0 }\n[end]\n\
         position = [0.3, 0.0, 0.4]\n",
    );
    let told = place.run(&["equilibria", "strip.toml", "--out", "out"]);
    assert_eq!(told.code, 0, "{}", told.stderr);
    assert!(told.stdout.contains("in plane") && told.stdout.contains("complete below lambda = 14"));
    let summary = place.json("out/equilibria.json");
    let states = summary["equilibria"].as_array().unwrap().len();
    let figure = std::fs::read_to_string(place.join("out/equilibria.svg")).unwrap();
    for k in 1..=states {
        assert!(figure.contains(&format!("{k}: energy")), "{k} of {states}");
    }
    let files = place.files("out");
    assert!(
        ["equilibria.csv", "shapes.csv"]
            .iter()
            .all(|file| files.iter().any(|f| f == file))
    );
    place.write("motion.toml", include_str!("../../scenes/snap.toml"));
    let told = place.run(&["equilibria", "motion.toml"]);
    assert!(
        told.code == 2 && told.stderr.contains("[end]"),
        "{}",
        told.stderr
    );
    assert_eq!(place.run(&["equilibria"]).code, 2);
}
