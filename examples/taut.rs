//! Error and cost of taut rods against sqrt(F L^2/B), compared with the base wrench: a table of
//! docs/validation/rods.md.
//!
//! A uniform inextensible rod in a plane is pulled at 0.3 rad from its clamp, its end turned by 0.5. Errors are those
//! of the end position: from sqrt(F L^2/B) = 30 on against the closed form of the string limit (exact up to
//! exp(-lam)), below against the finest mesh. Costs are times of an evaluation with all derivatives, relative to the
//! base wrench at lam = 10. Taut rods start from the rod under a pull one per cent less.

use nalgebra::{Matrix3, Rotation3, Vector3, Vector6};
use snaprod::Result;
use snaprod::rod::{Rod, Taut, Tip};
use snaprod::section::Linear;
use std::time::Instant;

const PULL: f64 = 0.3;
const END: f64 = 0.5;
const ROUNDS: u32 = 20;

/// The shortest time of an evaluation.
fn time(mut each: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let begun = Instant::now();
        for _ in 0..ROUNDS {
            each()?;
        }
        best = best.min(begun.elapsed().as_secs_f64() / f64::from(ROUNDS));
    }
    Ok(best)
}

fn main() -> Result<()> {
    let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 0.7)?)?;
    let turn: Matrix3<f64> = *Rotation3::from_axis_angle(&Vector3::y_axis(), END).matrix();
    let tip = Tip::Turned(turn);
    println!(
        "| lam | base wrench, 1e-13: error | cost | taut, 1e-13: error | intervals | cost | taut, 1e-9: error | intervals | cost |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let load = Vector6::new(0.0, 3.0, 0.0, 30.0, 0.0, 95.0);
    let unit = time(|| rod.end(&load, 1e-13).map(|_| ()))?;
    for lam in [
        5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 24.0, 30.0, 100.0, 1e3, 1e4_f64,
    ] {
        let along = Vector3::new(PULL.sin(), 0.0, PULL.cos());
        let across = Vector3::new(PULL.cos(), 0.0, -PULL.sin());
        let rest = END - PULL;
        let n = along * lam * lam;
        let guess = Vector6::new(0.0, 2.0 * lam * (0.5 * PULL).sin(), 0.0, n.x, n.y, n.z);
        let finest = rod.taut(&guess, &tip, None, 1e-14)?;
        let place = if lam < 30.0 {
            finest.end.position
        } else {
            let layers = (0.25 * PULL).sin().powi(2) + (0.25 * rest).sin().powi(2);
            along * (1.0 - 4.0 / lam * layers)
                + across * (2.0 / lam * ((0.5 * rest).sin() - (0.5 * PULL).sin()))
        };
        let error = |at: &Vector3<f64>| format!("{:.0e}", (at - place).norm());
        let mut row = vec![format!("{lam}")];
        match rod.end(&finest.base, 1e-13) {
            Ok(end) if lam <= 30.0 => {
                row.push(error(&end.section.position));
                let spent = time(|| rod.end(&finest.base, 1e-13).map(|_| ()))?;
                row.push(format!("{:.1}", spent / unit));
            }
            _ => row.extend(["-".to_owned(), "-".to_owned()]),
        }
        for tolerance in [1e-13, 1e-9] {
            let found: Taut = rod.taut(&guess, &tip, None, tolerance)?;
            row.push(error(&found.end.position));
            // Exact up to exp(-lam): the closed form has full accuracy here.
            let off = (found.end.position - place).norm();
            assert!(
                lam != 1e3 || tolerance > 1e-13 || off < 1e-12,
                "lam = {lam}: the end is off by {off:e}"
            );
            row.push(format!("{}", found.intervals()));
            let before = rod.taut(&(guess * 0.99), &tip, Some(&found), tolerance)?;
            let spent = time(|| {
                rod.taut(&found.base, &tip, Some(&before), tolerance)
                    .map(|_| ())
            })?;
            row.push(format!("{:.1}", spent / unit));
        }
        println!("| {} |", row.join(" | "));
    }
    Ok(())
}
