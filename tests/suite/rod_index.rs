//! The Morse index of rods: independence of the integration path, and behaviour near neutral modes.

use super::rods_invariants::{Shared, coupled, diagonal};
use nalgebra::{Rotation3, Vector3, Vector6};
use snaprod::rod::{EndConditions, Problem, Rod};
use snaprod::section::Linear;
use std::f64::consts::PI;
use std::sync::Arc;

/// Index of linear rods against explicit steps with their own columns, for loads up to some twenty turns and every
/// kind of end. Catches an angle that loses half a turn on a long step or at a mixing of columns, and columns mixed by
/// inconsistent matrices.
#[test]
fn the_index_of_a_linear_rod_is_that_of_any_rod() {
    let curved = |law: Linear, twist: f64| law.with_rest([0.8, -0.5], twist).expect("a law");
    let thin = Linear::diagonal([1.0, 25.0], 0.3).expect("a law");
    let laws = [
        curved(diagonal([1.0, 1.6]), 1.7),
        curved(coupled(), 0.0),
        curved(thin, 9.0),
        diagonal([1.0, 1.0]),
    ];
    let (mut most, mut count) = (0, 0);
    for (which, law) in laws.into_iter().enumerate() {
        let rod = Rod::new(1.0, law).expect("a rod");
        let other = Rod::new(1.0, Shared(Arc::new(law))).expect("a rod");
        for trial in 0..24 {
            let size = 400.0_f64.powf(f64::from(trial) / 23.0);
            let base = Vector6::from_fn(|i, _| {
                let x = (3.1 * f64::from(trial) + 1.7 * i as f64 + which as f64).sin();
                x * if i < 3 { size.sqrt() } else { size }
            });
            let at = rod.end(&base, 1e-10).expect("an end").section;
            let turn = Rotation3::from_matrix_unchecked(at.directors);
            let mut line = EndConditions::load(Vector3::zeros(), Vector3::zeros());
            line.position[0] = Some(at.position.x);
            let ends = [
                EndConditions::load(Vector3::zeros(), Vector3::zeros()),
                EndConditions::weight(
                    Vector3::new(0.0, 0.0, -1.0),
                    Vector3::new(0.1, 0.0, 0.2),
                    Vector3::zeros(),
                ),
                EndConditions::ball(at.position),
                EndConditions::pose(at.position, turn.into()),
                line,
            ];
            for (end, name) in ends
                .into_iter()
                .zip(["load", "weight", "ball", "pose", "line"])
            {
                let index = |rod: &Rod| {
                    Problem::new(rod.clone(), end, 1e-11).and_then(|p| p.index_at(&base))
                };
                let (here, there) = (index(&rod), index(&other));
                if let (Ok(here), Ok(there)) = (&here, &there) {
                    assert_eq!(here, there, "law {which}, trial {trial}, {name}");
                    (most, count) = (most.max(*here), count + 1);
                }
                assert_eq!(
                    here.is_ok(),
                    there.is_ok(),
                    "law {which}, trial {trial}, {name}: {here:?}, {there:?}"
                );
            }
        }
    }
    assert!(most > 15 && count > 400, "{most}, {count}");
}

/// A mode neutral at given force, but not at given pose: the index equals that on both sides. Catches an index decided
/// by rounding there, and a refusal.
#[test]
fn the_index_goes_on_through_conjugate_points_at_given_force() {
    let law = diagonal([1.0, 1.6]).with_rest([0.8, -0.5], 1.7);
    let rod = Rod::new(1.0, law.expect("a law")).expect("a rod");
    let mut passed = 0;
    for trial in 0..6 {
        let base = |size: f64| {
            Vector6::from_fn(|i, _| (3.1 * f64::from(trial) + 1.7 * i as f64).sin() * size)
        };
        let turning = |size: f64| {
            let end = rod.end(&base(size), 1e-13).expect("an end");
            end.tangent.fixed_view::<3, 3>(0, 0).determinant()
        };
        let index = |size: f64| {
            let at = rod.end(&base(size), 1e-13).expect("an end").section;
            let turn = Rotation3::from_matrix_unchecked(at.directors);
            let end = EndConditions::pose(at.position, turn.into());
            Problem::new(rod.clone(), end, 1e-11).and_then(|problem| problem.index_at(&base(size)))
        };
        let sizes: Vec<f64> = (0..400).map(|k| 1.0 + 0.1 * f64::from(k)).collect();
        for pair in sizes.windows(2) {
            let (mut below, mut above) = (pair[0], pair[1]);
            let sign = turning(below).signum();
            if turning(above).signum() == sign {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (below + above);
                if turning(middle).signum() == sign {
                    below = middle;
                } else {
                    above = middle;
                }
            }
            let beside = [0.9999, 1.0001].map(|part| index(part * below).expect("an index"));
            if beside[0] == beside[1] {
                let at = index(below).unwrap_or_else(|why| panic!("trial {trial}, {below}: {why}"));
                assert_eq!(at, beside[0], "trial {trial}, {below}");
                passed += 1;
            }
        }
    }
    assert!(passed > 12, "{passed}");
}

/// A column under a dead load loses a mode at each (k - 1/2)^2 pi^2 B of both its stiffnesses. Catches a rough count
/// accepted although its dead zone hides the mode: the load of a lost mode was off by 1e-6 of it, for every tolerance.
#[test]
fn a_column_loses_its_modes_at_the_loads_of_euler() {
    let stiffness = [1.0, 2.3];
    let law = Linear::diagonal(stiffness, 0.7).expect("a law");
    let rod = Rod::new(1.0, law).expect("a rod");
    let mut loads: Vec<f64> = stiffness
        .iter()
        .flat_map(|b| (0..3).map(move |k| b * (PI * (f64::from(k) + 0.5)).powi(2)))
        .collect();
    loads.sort_by(f64::total_cmp);
    // Beyond them comes the fourth of the softer bending, below the third of the other.
    for (lost, load) in loads[..5].iter().enumerate() {
        for (part, index) in [(1.0 - 1e-9, lost), (1.0 + 1e-9, lost + 1)] {
            let force = Vector3::new(0.0, 0.0, -load * part);
            let end = EndConditions::load(force, Vector3::zeros());
            let base = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, force.z);
            let column = Problem::new(rod.clone(), end, 1e-12).expect("a column");
            let found = column.index_at(&base).expect("an index");
            assert_eq!(found, index, "{load} * {part}");
        }
    }
}
