//! Rods in space against independent references (tools/rod_reference.py).

use crate::support::{json, number, rows};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde_json::Value;
use snaprod::rod::Rod;
use snaprod::rod::section::Linear;

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
    let law = Linear::new(Matrix6::from_row_slice(&entries), rigid)
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
