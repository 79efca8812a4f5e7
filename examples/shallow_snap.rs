//! A shallow arch, one clamp of which is turned, snaps through (Gomez, Moulton & Vella 2017).
//!
//! `cargo run --release --example shallow_snap`

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use snaprod::rod::{EndConditions, Problem, Rod, RodFamily, Statical};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Item, Options};
use snaprod::solve::special_points::SpecialKind;
use std::f64::consts::PI;

/// Turns the clamp of an arch of length 1, with ends 1 - s apart, to the fold. Returns the angle a and the thrust at
/// the fold.
fn snap(s: f64) -> snaprod::Result<(f64, f64)> {
    let turned = |a: f64| {
        let clamp = UnitQuaternion::from_scaled_axis(Vector3::y() * a);
        // Bending stiffness 1 in the plane of z and x, stiff out of it.
        let rod = Rod::new(1.0, Linear::diagonal([40.0, 1.0], 40.0)?)?
            .with_clamp(Vector3::zeros(), clamp);
        let flat = EndConditions::pose(Vector3::z() * (1.0 - s), UnitQuaternion::identity());
        Problem::new(rod, flat, 1e-12)
    };
    // At a = 0 the arch is a buckled column, bent away from the turn to come: theta = -2 sqrt(s) sin(2 pi z) to first
    // order.
    let guess = Vector6::new(0.0, -4.0 * PI * s.sqrt(), 0.0, 0.0, 0.0, -4.0 * PI * PI);
    let arch = turned(0.0)?.solve(Some(&guess))?;
    assert_eq!(arch.index, 0);

    let family = RodFamily::new(turned, false, 1.0);
    let x = family.unknowns(&arch.base, 0.0)?;
    let options = Options {
        weight: 100.0,
        max_step: 1.0,
        ..Options::between(0.0, 1.0)
    };
    let fold = Continuation::new(&family, x, 0.0, options)?
        .find_map(|item| match item {
            Item::Special(special) if special.kind == SpecialKind::Fold => Some(special),
            _ => None,
        })
        .expect("a fold");
    let at = family.state(&fold.point.x, fold.point.p)?;
    Ok((fold.point.p, -at.end.force.z))
}

fn main() -> snaprod::Result<()> {
    println!("    s    a (rad)     a/sqrt(s)    thrust");
    for s in [0.04, 0.02, 0.01, 0.005, 0.0025] {
        let (a, thrust) = snap(s)?;
        println!("{s:6}   {a:.8}   {:.8}   {thrust:.6}", a / s.sqrt());
        if s == 0.01 {
            assert!((a - 0.178_231_358_6).abs() < 1e-10);
        }
    }
    // The linear theory of shallow arches: mu = a/sqrt(s) = 1.78177604, P = 57.55314. The error is of first order in s.
    let ((a, p), (b, q)) = (snap(1e-3)?, snap(5e-4)?);
    let mu = 2.0 * b / 5e-4_f64.sqrt() - a / 1e-3_f64.sqrt();
    println!("    0                {mu:.8}   {:.6}", 2.0 * q - p);
    assert!((mu - 1.781_776_04).abs() < 1e-6);
    assert!((2.0 * q - p - 57.553_14).abs() < 1e-4);
    Ok(())
}
