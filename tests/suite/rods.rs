//! Rods in space against independent references (tools/rod_reference.py).

use crate::support::{json, number, rows};
use nalgebra::{Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::rod::section::Linear;
use snaprod::rod::{End, Problem, Rod};

fn list(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

fn vector3(row: &Value, key: &str) -> Vector3<f64> {
    Vector3::from_row_slice(&list(&row[key]))
}

fn wrench(row: &Value, couple: &str, force: &str) -> Vector6<f64> {
    let (m, n) = (vector3(row, couple), vector3(row, force));
    Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
}

/// The rod of a row; None if its section varies along the rod.
pub fn rod(row: &Value) -> Option<Rod> {
    let section = &row["section"];
    if number(section, "taper") != 0.0 {
        return None;
    }
    let entries: Vec<f64> = rows(section, "stiffness", 6)
        .iter()
        .flat_map(list)
        .collect();
    let mut rigid = [false; 6];
    for i in section["rigid"].as_array().expect("a list") {
        rigid[i.as_u64().expect("an index") as usize] = true;
    }
    let rest = list(&section["rest"]);
    let mut stiffness = Matrix6::from_row_slice(&entries);
    for i in (0..6).filter(|i| rigid[*i]) {
        stiffness[(i, i)] = 1.0;
    }
    let law = Linear::full(stiffness)
        .and_then(|law| law.rigid([rigid[3], rigid[4], rigid[5]]))
        .and_then(|law| law.with_rest([rest[0], rest[1]], rest[2]))
        .expect("a law");
    Some(Rod::new(number(row, "length"), law).expect("a rod"))
}

/// Catches any slip in frame, balance, inverse law, energy or tangent: 80-bit Taylor series know nothing of ours.
#[test]
fn initial_value_problems_agree_with_taylor_series() {
    let data = json("rod_ivp.json");
    let (mut tested, mut worst) = (0, 0.0_f64);
    for row in rows(&data, "rows", 15) {
        let Some(rod) = rod(row) else { continue };
        let end = rod
            .end(&wrench(row, "base_couple", "base_force"), 1e-13)
            .expect("an end");
        let name = &row["name"];
        let position = vector3(row, "position");
        let rotation = Matrix3::from_row_slice(
            &rows(row, "rotation", 3)
                .iter()
                .flat_map(list)
                .collect::<Vec<_>>(),
        );
        let tangent = Matrix6::from_row_slice(
            &rows(row, "tangent", 6)
                .iter()
                .flat_map(list)
                .collect::<Vec<_>>(),
        );
        let section = &end.section;
        let gaps = [
            (section.position - position).norm() / rod.length(),
            (section.directors - rotation).norm(),
            (section.directors.transpose() * section.directors - Matrix3::identity()).norm() * 1e3,
            (section.couple - vector3(row, "tip_couple")).norm()
                / (1.0 + vector3(row, "tip_couple").norm()),
            (section.energy - number(row, "energy")).abs() / (1.0 + number(row, "energy")),
            (end.tangent - tangent).norm() / tangent.norm(),
        ];
        for gap in gaps {
            assert!(gap < 2e-11, "{name}: {gaps:?}");
            worst = worst.max(gap);
        }
        tested += 1;
    }
    assert!(tested >= 12, "only {tested} uniform rods");
    println!("{tested} rods, worst gap {worst:e}");
}

fn quaternion(row: &Value, key: &str) -> UnitQuaternion<f64> {
    let q = list(&row[key]);
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

/// Catches a wrong balance at the end, a load in the wrong frame, a path that ends elsewhere.
#[test]
fn end_loads_agree_with_an_independent_solver() {
    let data = json("rod_loads.json");
    let mut tested = 0;
    for row in rows(&data, "rows", 10) {
        let Some(rod) = rod(row) else { continue };
        let load = &row["end"];
        let (f, m) = (vector3(load, "force"), vector3(load, "couple"));
        let end = if load["follower"] == true {
            End::follower(f, m)
        } else {
            End::load(f, m)
        };
        let problem = Problem::new(rod, end, 1e-12).expect("a problem");
        let found = problem
            .solve(None)
            .unwrap_or_else(|e| panic!("{}: {e}", row["name"]));
        let base = wrench(row, "base_couple", "base_force");
        let q = UnitQuaternion::from_matrix(&found.end.directors);
        let gaps = [
            (found.end.position - vector3(row, "position")).norm(),
            q.angle_to(&quaternion(row, "quaternion")),
            (found.base - base).norm() / (1.0 + base.norm()),
            (found.end.couple - vector3(row, "tip_couple")).norm() / (1.0 + base.norm()),
            found.end.energy - number(row, "energy"),
        ];
        println!(
            "{} index {} {gaps:?} {:?}",
            row["name"], found.index, found.route
        );
        assert!(
            gaps.iter().all(|g| g.abs() < 1e-8),
            "{}: {gaps:?}",
            row["name"]
        );
        tested += 1;
    }
    assert!(tested >= 10, "only {tested}");
}

fn end_condition(row: &Value) -> End {
    match row["kind"].as_str().expect("a kind") {
        "pose" => End::pose(vector3(row, "position"), quaternion(row, "quaternion")),
        "ball" => End::ball(vector3(row, "position")),
        "free" => End::load(vector3(row, "base_force"), Vector3::zeros()),
        other => panic!("{other}"),
    }
}

/// Catches a wrong equation of a held end: the stored wrench solves it, and the solver finds some equilibrium there.
#[test]
fn held_ends_are_solved() {
    let data = json("rod_held.json");
    let mut tested = 0;
    for row in rows(&data, "rows", 10) {
        let Some(rod) = rod(row) else { continue };
        let problem = Problem::new(rod, end_condition(row), 1e-12).expect("a problem");
        let base = wrench(row, "base_couple", "base_force");
        let near = problem
            .solve(Some(&(base * 1.001)))
            .expect("the equilibrium nearby");
        assert!(
            (near.base - base).norm() < 1e-8 * (1.0 + base.norm()),
            "{}",
            row["name"]
        );
        let found = problem
            .solve(None)
            .unwrap_or_else(|e| panic!("{}: {e}", row["name"]));
        assert!(found.residual < 1e-9, "{}: {}", row["name"], found.residual);
        assert_eq!(found.index, 0, "{}", row["name"]);
        tested += 1;
    }
    assert!(tested >= 10, "only {tested}");
}

/// Catches a conjugate point that is missed or counted twice, or a wrong correction for the end condition: the reference
/// counts negative eigenvalues of a discretised second variation.
#[test]
fn indices_agree_with_discretised_second_variations() {
    let data = json("rod_index.json");
    let (mut tested, mut wrong) = (0, Vec::new());
    for row in rows(&data, "rows", 20) {
        let Some(rod) = rod(row) else { continue };
        let base = wrench(row, "base_couple", "base_force");
        let end = rod.end(&base, 1e-12).expect("an end").section;
        let condition = match row["end"].as_str().expect("an end") {
            "pose" => End::pose(end.position, UnitQuaternion::from_matrix(&end.directors)),
            "ball" => End::ball(end.position),
            "free" => End::load(end.force, end.couple),
            other => panic!("{other}"),
        };
        let index = match Problem::new(rod, condition, 1e-12) {
            Ok(problem) => problem.index_at(&base).expect("an index"),
            Err(e) => {
                println!("{}: {e}", row["name"]);
                continue;
            }
        };
        if Some(index as u64) != row["index"].as_u64() {
            wrong.push(format!(
                "{} {}: {index}, not {} (nearest {})",
                row["name"], row["end"], row["index"], row["nearest_eigenvalue"]
            ));
        }
        tested += 1;
    }
    assert!(wrong.is_empty(), "of {tested}: {wrong:#?}");
    assert!(tested >= 20, "only {tested}");
}
