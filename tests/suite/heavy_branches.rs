//! Branches in the load of heavy rods, and lists of their equilibria: they end where the equilibrium of the scene is.

use crate::support::assert_close;
use snaprod::scene::Scene;
use snaprod::study::{BranchRecord, Silent, all_equilibria, assembly, branch, equilibrium};

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"))
}

/// A rod that sags between clamps, sqrt(f L^3/B) = sqrt(weight); `path` is the branch in its load, if any.
fn sag(weight: f64, path: &str) -> String {
    format!(
        r#"
[rod]
model = "cosserat"
length = 1.0
section = {{ bending = [1.0, 1.0], torsion = 0.8 }}
mass = {weight:?}
[clamp]
rotation = {{ axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 }}
[end]
position = [0.8, 0.0, 0.1]
rotation = {{ axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 }}
[loads]
gravity = [0.0, 0.0, -1.0]
{path}"#
    )
}

/// The rod as an assembly, with the given joints at both ends.
fn assembled(weight: f64, joint: &str, path: &str) -> String {
    let turn = "rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 }";
    format!(
        r#"
plane = [0.0, 1.0, 0.0]
[[rod]]
name = "a"
model = "cosserat"
length = 1.0
mass = {weight:?}
section = {{ bending = [1.0, 1.0], torsion = 0.8 }}
from = {{ {turn}, joint = "{joint}" }}
to = {{ position = [0.8, 0.0, 0.1], {turn}, joint = "{joint}" }}
[loads]
gravity = [0.0, 0.0, -1.0]
{path}"#
    )
}

/// The last row of a branch in the load agrees with the equilibrium of the whole load.
fn arrives_single(weight: f64, from: f64) {
    let path = format!("[continue]\nparameter = \"loads.load\"\nfrom = {from:?}\nto = 1.0");
    let record = branch(&parsed(&sag(weight, &path)), &mut Silent).expect("a branch");
    assert!(record.is_complete(), "{:?}", record.branches.curves);
    assert!(record.branches.specials.is_empty());
    let found = equilibrium::equilibrium(&parsed(&sag(weight, ""))).expect("an equilibrium");
    let points = &record.branches.points;
    for (k, name) in ["base_fx", "base_fz"].into_iter().enumerate() {
        let force = found.found.base[3 + 2 * k];
        let last = points.reals(name)[points.rows() - 1];
        assert_close(last, force, 1e-9, 1.0, name);
    }
}

/// Catches a branch that creeps because the derivative by the load is taken over a step in which the rod stands beside
/// another spring.
#[test]
#[ignore = "second tier: 4 s"]
fn the_load_of_a_heavy_rod_grows_from_one_percent() {
    arrives_single(1e5, 0.01);
}

/// Catches a branch that creeps at the weight of acceptance line 2: lam grows from 100 to 1000.
#[test]
#[ignore = "second tier: 3 s"]
fn the_load_of_a_very_heavy_rod_grows_from_one_percent() {
    arrives_single(1e6, 0.01);
}

/// The branch in the gravity of an assembly.
fn under_growing_gravity(scene: impl Fn(&str) -> String) -> BranchRecord {
    let path = "[continue]\nparameter = \"loads.gravity.z\"\nfrom = -0.01\nto = -1.0";
    let record = branch(&parsed(&scene(path)), &mut Silent).expect("a branch");
    assert!(record.is_complete(), "{:?}", record.branches.curves);
    record
}

/// The last row of a branch in the gravity of an assembly agrees with the equilibrium under the whole gravity.
fn arrives_assembled(joint: &str) {
    let record = under_growing_gravity(|path| assembled(400.0, joint, path));
    let scene = parsed(&assembled(400.0, joint, ""));
    let found = assembly::equilibrium(&scene).expect("an equilibrium");
    let points = &record.branches.points;
    for (k, name) in ["a.base_fx", "a.base_fz"].into_iter().enumerate() {
        let last = points.reals(name)[points.rows() - 1];
        assert_close(last, found.rods[0].1[3 + 2 * k], 1e-9, 1.0, name);
    }
}

/// Catches a derivative by the load over so long a step that errors at the base, which grow as exp(lam), spoil it: the
/// branch then creeps.
#[test]
fn the_load_of_a_heavy_rod_between_balls_grows_from_one_percent() {
    arrives_assembled("ball");
}

/// Catches what `the_load_of_a_heavy_rod_between_balls_grows_from_one_percent` catches, for a rod between clamps.
#[test]
#[ignore = "second tier: 1 s"]
fn the_load_of_a_heavy_rod_between_clamps_grows_from_one_percent() {
    arrives_assembled("weld");
}

/// The branch in the gravity of a clamped rod, written as an assembly, has no special points and ends where the single
/// rod stands, whose equations are others.
fn arrives_as_the_single_rod(plane: &str, weight: f64) {
    let scene = |path: &str| {
        let planar = assembled(weight, "weld", path);
        planar.replace("plane = [0.0, 1.0, 0.0]", plane)
    };
    let record = under_growing_gravity(scene);
    let (specials, points) = (&record.branches.specials, &record.branches.points);
    assert!(specials.is_empty(), "{plane}: {specials:?}");
    let indices = points.integers("index");
    assert!(indices.iter().all(|index| *index == Some(0)), "{plane}");
    let single = equilibrium::equilibrium(&parsed(&sag(weight, ""))).expect("an equilibrium");
    for (k, name) in ["a.base_fx", "a.base_fz"].into_iter().enumerate() {
        let last = points.reals(name)[points.rows() - 1];
        assert_close(last, single.found.base[3 + 2 * k], 1e-9, 1.0, name);
    }
}

/// Catches a branch that uses up its points where forces grow by powers of ten, and a branch point that is none where
/// a slack rod becomes taut: the chart of the rod changes there, and the sign of the determinant must not.
#[test]
fn the_load_of_a_heavier_rod_of_an_assembly_grows_from_one_percent() {
    arrives_as_the_single_rod("", 3e3);
}

/// Catches the same faults as `the_load_of_a_heavier_rod_of_an_assembly_grows_from_one_percent` at lam = 100, in the
/// plane and in space.
#[test]
#[ignore = "second tier: 8 s"]
fn the_load_of_a_very_heavy_rod_of_an_assembly_grows_from_one_percent() {
    for plane in ["plane = [0.0, 1.0, 0.0]", ""] {
        arrives_as_the_single_rod(plane, 1e4);
    }
}

/// Catches a list that lacks the answer of `snaprod equilibrium`, an index in the plane above that in space, and a
/// neutral motion that the rounding of a base wrench pretends.
#[test]
fn the_list_of_a_heavy_rod_has_its_equilibrium() {
    for weight in [1e4, 1e6] {
        let scene = parsed(&sag(weight, ""));
        let found = equilibrium::equilibrium(&scene).expect("an equilibrium");
        let list = all_equilibria(&scene, 14.0, &mut Silent).expect("a list");
        let whole = found.found.end.energy + found.found.potential;
        let first = &list.states[0];
        assert_close(first.energy, whole, 1e-11, 1.0, "energy");
        assert_eq!((first.index, first.index_in_plane), (0, Some(0)));
        assert!(!first.neutral);
    }
}

/// Catches energies of an assembly that contain loads or tendons, and tendons that another rod than the single one
/// would have.
#[test]
fn tendons_of_an_assembly_are_those_of_the_single_rod() {
    let rod = r#"model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.2], torsion = 0.8 }
tendon = [{ offset = [0.1, 0.02], tension = 3.0 }]
"#;
    let alone = format!("[rod]\n{rod}[end]\nforce = [0.0, 0.3, -0.2]\n");
    let alone = equilibrium::equilibrium(&parsed(&alone)).expect("an equilibrium");
    let joined = format!(
        "[[rod]]\nname = \"a\"\n{rod}from = {{ position = [0.0, 0.0, 0.0] }}\nto = {{ body = \"m\" }}\n[[body]]\nname = \"m\"\nforce = [0.0, 0.3, -0.2]\n"
    );
    let joined = assembly::equilibrium(&parsed(&joined)).expect("an equilibrium");
    let of_single = alone.tendons.as_ref().expect("tendons");
    let (_, of_rod) = &joined.tendons[0];
    let [one, other] = [of_single, of_rod].map(|tendons| tendons.each[0].length);
    assert_close(other, one, 1e-9, 1.0, "length");
    assert_close(joined.elastic, alone.found.end.energy, 1e-9, 1.0, "energy");
    for k in 0..2 {
        let off = (of_rod.base[k] - of_single.base[k]).norm();
        assert!(off < 1e-8, "what the rod alone bears is off by {off}");
    }
}

/// Catches a refusal of an angle in degrees that does not say how to write the branch.
#[test]
fn a_branch_in_degrees_is_told_to_use_radians() {
    let path = "[continue]\nparameter = \"clamp.rotation.angle_degrees\"\nto = 80.0";
    let faults = Scene::parse(&sag(1.0, path))
        .expect_err("degrees")
        .to_string();
    assert!(
        faults.contains("parameter = \"clamp.rotation.angle\""),
        "{faults}"
    );
}
