//! A straight rod is wound up between two clamps until it buckles into a helix (Greenhill 1883).
//!
//! `cargo run --release --example greenhill`

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use snaprod::rod::{EndConditions, Problem, Rod, RodFamily, Statical};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options};

fn main() -> snaprod::Result<()> {
    // Round section: bending stiffness 1, torsional stiffness 0.7, length 1. The critical couple does not depend on
    // the torsional stiffness.
    let torsion = 0.7;
    let table = [
        (-20.0, 5.771_135_703_3),
        (0.0, 8.986_818_915_8),
        (20.0, 11.800_329_535_4),
    ];
    println!("end tension   critical turn (rad)   critical couple");
    for (tension, computed) in table {
        // The far clamp is turned about the axis and may slide along it under the tension.
        let wound = |turn: f64| {
            let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion)?)?;
            let turned = UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
            let end = EndConditions {
                position: [Some(0.0), Some(0.0), None],
                force: Vector3::z() * tension,
                ..EndConditions::pose(Vector3::zeros(), turned)
            };
            Problem::new(rod, end, 1e-12)
        };
        // The branch of the straight rod, from almost no twist to three turns.
        let family = RodFamily::new(wound, false, 20.0);
        let start = wound(0.1)?.solve(Some(&Vector6::new(0.0, 0.0, 0.07, 0.0, 0.0, tension)))?;
        assert_eq!(start.index, 0);
        let x = family.unknowns(&start.base, 0.1)?;
        let options = Options {
            max_step: 1.0,
            ..Options::between(0.1, 20.0)
        };
        let trace = Continuation::new(&family, x, 0.1, options)?.trace();

        // Two modes lose stability together: the helix may buckle in any direction.
        let first = &trace.specials[0];
        assert_eq!(first.index, (Some(0), Some(2)));
        let at = family.state(&first.point.x, first.point.p)?;
        let couple = at.end.couple.z;
        println!("{tension:>11}   {:19.10}   {couple:15.10}", first.point.p);
        assert!((couple / computed - 1.0).abs() < 1e-10);
    }
    Ok(())
}
