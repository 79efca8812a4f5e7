//! Rods at rest: the end of an initial-value problem, an equilibrium, a branch.

use crate::problems::{DATA, Problem, Ran, tolerances};
use crate::support::{base_wrench, json, list, quaternion, rod, rows, vector3};
use nalgebra::{Matrix3, Vector3};
use snaprod::scene::Scene;
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{Silent, branch};
use std::hint::black_box;
use std::time::Instant;

/// Positions in a row, then directors.
fn pose(position: Vector3<f64>, directors: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let columns = directors.column_iter().map(Into::into);
    std::iter::once(position).chain(columns).collect()
}

/// The end of a rod with its tangent from its base wrench; `rod_precision` has more rods, and the errors of their
/// tangents.
pub fn end() -> Problem {
    const MANY: usize = 200;
    let data = json("rod_ivp.json");
    let row = &rows(&data, "rows", 22)[9];
    let (rod, base) = (rod(row), base_wrench(row));
    let directors = Matrix3::from_row_slice(&list(&row["rotation"]));
    let run = move |tolerance: f64| {
        let clock = Instant::now();
        for _ in 0..MANY {
            black_box(rod.end(black_box(&base), tolerance).expect("an end"));
        }
        let ms = clock.elapsed().as_secs_f64() * 1e3 / MANY as f64;
        let end = rod.end(&base, tolerance).expect("an end");
        Ran {
            end: pose(end.section.position, &end.section.directors),
            work: None,
            ms,
        }
    };
    Problem {
        key: "end",
        title: "statics, end of a rod with its tangent",
        settings: tolerances([4, 6, 8, 10, 12]),
        reference: pose(vector3(row, "position"), &directors),
        source: DATA,
        floor: 1e-14,
        compute: Box::new(run),
    }
}

const REST: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.5], torsion = 0.7, shear = [100.0, 120.0], axial = 300.0 }
[end]
force = [1.0, -2.0, 0.5]
couple = [0.3, 0.2, -0.8]
"#;

/// The equilibrium under a load on the end, found from the unloaded rod.
pub fn rest() -> Problem {
    let data = json("rod_loads.json");
    let row = &rows(&data, "rows", 16)[0];
    let directors = quaternion(row, "quaternion").to_rotation_matrix();
    let run = move |tolerance: f64| {
        let set = format!("solve.tolerance={tolerance:e}");
        let scene = Scene::parse_with(REST, &[&set]).expect("a scene");
        let problem = scene.problem().expect("a problem");
        let clock = Instant::now();
        let found = problem.solve(None).expect("an equilibrium");
        let ms = clock.elapsed().as_secs_f64() * 1e3;
        Ran {
            end: pose(found.end.position, &found.end.directors),
            work: None,
            ms,
        }
    };
    Problem {
        key: "rest",
        title: "statics, at rest under an end load",
        settings: tolerances([4, 6, 8, 10, 12]),
        reference: pose(vector3(row, "position"), directors.matrix()),
        source: DATA,
        floor: 1e-14,
        compute: Box::new(run),
    }
}

/// A planar rod with a pinned end, which is moved across to a fold and back.
const FOLD: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [2.0, 1.0], torsion = 0.8 }
[end]
position = [0.3, 0.0, 0.57369935533303649497]
[solve]
path = "planar"
[continue]
parameter = "end.position.x"
to = -0.8
back = true
"#;

/// The fold of the branch, by integration along the rod: in closed form, the program's default, the fold is exact.
pub fn fold() -> Problem {
    // A row of tests/data/fold_curve.csv, mirrored: its x is the z of the scene.
    const ACROSS: f64 = -0.622_187_663_977_434_9;
    let across = |x: f64| vec![Vector3::new(x, 0.0, 0.0)];
    let run = move |tolerance: f64| {
        let set = format!("solve.tolerance={tolerance:e}");
        let scene = Scene::parse_with(FOLD, &[&set]).expect("a scene");
        let clock = Instant::now();
        let found = branch(&scene, &mut Silent).expect("a branch");
        let ms = clock.elapsed().as_secs_f64() * 1e3;
        let specials = &found.branches.specials;
        let fold = specials.iter().find(|s| s.kind == SpecialKind::Fold);
        Ran {
            end: across(fold.expect("a fold").parameter),
            work: None,
            ms,
        }
    };
    Problem {
        key: "fold",
        title: "statics, a branch to a fold and back",
        settings: tolerances([4, 6, 8, 10, 12]),
        reference: across(ACROSS),
        source: DATA,
        floor: 1e-15,
        compute: Box::new(run),
    }
}
