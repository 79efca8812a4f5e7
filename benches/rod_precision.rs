//! Error against work of rods: `cargo bench --bench rod_precision` prints the table of docs/validation/rods.md.
//!
//! The end of a rod with its 6 x 6 tangent, against Taylor series in 80-bit arithmetic (tests/data/rod_ivp.json).

#[allow(dead_code)]
#[path = "../tests/suite/support.rs"]
mod support;

use nalgebra::{Matrix3, Matrix6, Vector6};
use serde_json::Value;
use snaprod::rod::{Rod, RodEnd};
use std::hint::black_box;
use std::time::Instant;
use support::{base_wrench, json, list, rod, rows, vector3};

/// Rows of rod_ivp.json: diagonal, transversely isotropic, curved, coupled, unshearable and inextensible.
const CASES: [usize; 5] = [0, 4, 8, 9, 13];
/// Aim: an accuracy of 1e-10 in 10 us.
const ACCURACY: f64 = 1e-10;

struct Case {
    name: char,
    rod: Rod,
    base: Vector6<f64>,
    row: Value,
}

impl Case {
    fn new(name: char, row: &Value) -> Self {
        let w = base_wrench(row);
        println!(
            "* {name}: {}, m(0) = ({}, {}, {}), n = ({}, {}, {})",
            row["name"].as_str().expect("a name"),
            w[0],
            w[1],
            w[2],
            w[3],
            w[4],
            w[5]
        );
        Self {
            name,
            rod: rod(row),
            base: w,
            row: row.clone(),
        }
    }

    fn end(&self, tolerance: f64) -> RodEnd {
        self.rod
            .end(black_box(&self.base), tolerance)
            .expect("an end")
    }

    /// Errors of the pose (position over length, directors) and of the tangent, relative to its norm.
    fn errors(&self, end: &RodEnd) -> [f64; 2] {
        let position = vector3(&self.row, "position");
        let rotation = Matrix3::from_row_slice(&list(&self.row["rotation"]));
        let tangent = Matrix6::from_row_slice(&list(&self.row["tangent"]));
        let place = (end.section.position - position).norm() / self.rod.length();
        [
            place.max((end.section.directors - rotation).norm()),
            (end.tangent - tangent).norm() / tangent.norm(),
        ]
    }

    /// Microseconds per end with tangent: the best of many short rounds, between which other programs may run.
    fn time(&self, tolerance: f64) -> f64 {
        let count = 20;
        let rounds = (0..200).map(|_| {
            let start = Instant::now();
            for _ in 0..count {
                black_box(self.end(tolerance));
            }
            start.elapsed().as_secs_f64() * 1e6 / f64::from(count)
        });
        rounds.fold(f64::INFINITY, f64::min)
    }
}

fn main() {
    let data = json("rod_ivp.json");
    let all = rows(&data, "rows", 22);
    let names = ['A', 'B', 'C', 'D', 'E'];
    let cases: Vec<Case> = names
        .iter()
        .zip(CASES)
        .map(|(name, i)| Case::new(*name, &all[i]))
        .collect();
    println!("\n| rod | tolerance | error of the pose | of the tangent | steps | us |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut summary = Vec::new();
    for case in &cases {
        let mut enough = None;
        for digits in 4..=13 {
            let tolerance = 10.0_f64.powi(-digits);
            let end = case.end(tolerance);
            let [pose, tangent] = case.errors(&end);
            let time = case.time(tolerance);
            println!(
                "| {} | 1e-{digits} | {pose:.1e} | {tangent:.1e} | {} | {time:.1} |",
                case.name, end.steps
            );
            if pose.max(tangent) <= ACCURACY && enough.is_none() {
                enough = Some(format!(
                    "{}: 1e-10 is reached at tolerance 1e-{digits}, {} steps, {time:.1} us",
                    case.name, end.steps
                ));
            }
        }
        summary.push(enough.unwrap_or_else(|| format!("{}: 1e-10 is not reached", case.name)));
    }
    println!("\nBar: pose and tangent to 1e-10 in 10 us.\n");
    for line in summary {
        println!("* {line}");
    }
}
