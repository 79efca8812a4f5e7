//! All equilibria at a point: comparison with an exhaustive scan in 256-bit arithmetic (tools/ref_inversion.py) and
//! with counts by degree.

use crate::support::{assert_close, close, json, number, rows};
use nalgebra::Vector2;
use proptest::prelude::*;
use snaprod::elastica::{Elastica, equilibria_at, fold_at};
use snaprod::manifold::{EquilibriumManifold, invert_near};

/// Catches a missed, doubled or invented equilibrium, and every label of those found.
#[test]
fn all_equilibria_match_the_scan() {
    let data = json("inversion.json");
    for target in rows(&data, "targets", 14) {
        let (x, y) = (number(target, "x"), number(target, "y"));
        let found = equilibria_at(x, y, 14.0).unwrap();
        let mut expected: Vec<_> = rows(target, "equilibria", 0).to_vec();
        expected.sort_by(|a, b| {
            let key = |v: &serde_json::Value| (number(v, "lam") * 1e9).round();
            key(a)
                .total_cmp(&key(b))
                .then(number(b, "kap").total_cmp(&number(a, "kap")))
        });
        let mut found = found;
        found.sort_by(|a, b| {
            let key =
                |f: &snaprod::elastica::FoundEquilibrium| (f.equilibrium.lambda * 1e9).round();
            key(a)
                .total_cmp(&key(b))
                .then(b.equilibrium.kappa.total_cmp(&a.equilibrium.kappa))
        });
        // A target on a fold is rounded to one side: the double root may come as two, or as one.
        let double = expected.iter().any(|e| e["double_root"] == true);
        if !double {
            assert_eq!(found.len(), expected.len(), "at ({x}, {y})");
        } else {
            assert!(found.len() == expected.len() || found.len() == expected.len() + 1);
        }
        // Near (1, 0) the target's own rounding moves the root: eps / distance^2.
        let tolerance = 1e-12 + 1e-15 / ((1.0 - x).powi(2) + y * y);
        for (k, want) in expected.iter().enumerate() {
            let what = format!("at ({x}, {y}), lam {}", want["lam"]);
            let f = if !double {
                &found[k]
            } else if want["double_root"] == true {
                continue;
            } else {
                // The single roots beside the double one have full accuracy.
                let is = |f: &&snaprod::elastica::FoundEquilibrium| {
                    close(f.equilibrium.lambda, number(want, "lam"), tolerance, 1.0)
                        && close(f.equilibrium.kappa, number(want, "kap"), tolerance, 0.01)
                };
                found.iter().find(is).expect(&what)
            };
            let e = &f.equilibrium;
            assert_close(e.lambda, number(want, "lam"), tolerance, 1.0, &what);
            assert_close(e.kappa, number(want, "kap"), tolerance, 0.01, &what);
            assert_close(e.alpha, number(want, "alpha"), tolerance, 1.0, &what);
            assert_close(e.theta1, number(want, "theta1"), tolerance, 1.0, &what);
            assert_close(e.energy, number(want, "U"), tolerance, 0.01, &what);
            // Where theta'(0) = 0 two sheets meet and rounding chooses the name.
            if e.w.sin().abs() > 1e-12 {
                assert_eq!(e.sheet.mode, number(want, "mode") as u32, "{what}");
                assert_eq!(e.sheet.sign.value(), number(want, "sign"), "{what}");
            }
            assert_eq!(f.index, number(want, "index") as usize, "{what}");
            assert!(f.residual < 1e-14, "{what}: residual {}", f.residual);
        }
    }
}

/// Catches a target on a fold that slips between two boxes: for every fold point there must be an answer.
#[test]
fn targets_on_folds_are_answered() {
    for number in 1..=3 {
        for p in [0.02, 0.1, 0.5, 1.0, 1.45, 1.5, 1.51, 1.6, 2.0, 3.0] {
            let fold = fold_at(number, p).unwrap().equilibrium;
            if fold.lambda > 13.9 {
                continue;
            }
            let found = equilibria_at(fold.x, fold.y, 14.0).unwrap();
            let near: Vec<_> = found
                .iter()
                .filter(|f| {
                    (f.equilibrium.p - p).abs() < 1e-4
                        && (f.equilibrium.lambda - fold.lambda).abs() < 1e-3
                })
                .collect();
            assert!(!near.is_empty(), "fold {number} at p = {p}");
            assert!(near.iter().all(|f| f.residual < 1e-13));
        }
    }
}

/// Catches a root dropped because Newton's method left its box: this happens near folds, and the count of roots then
/// failed at these points.
#[test]
fn roots_next_to_folds_are_not_dropped() {
    for (x, y) in [
        (9.984242476894247e-1, -4.628972330984331e-2),
        (3.92005237114463e-1, -1.0327234580689638e-1),
        (-1.340991258540861e-1, -1.843776694997845e-1),
        (4.2706951238542357e-1, -6.44231032528499e-1),
    ] {
        let found = equilibria_at(x, y, 14.0).unwrap();
        assert!(found.iter().any(|f| f.index == 0), "({x}, {y})");
        assert!(found.iter().all(|f| f.residual < 1e-13), "({x}, {y})");
    }
}

/// Points outside, on the rim, at (1, 0), NaN: each has its own message.
#[test]
fn unreachable_positions_are_refused() {
    for (x, y, part) in [
        (1.1, 0.0, "inextensible"),
        (0.6, 0.8, "inextensible"),
        (1.0, 0.0, "straight"),
        (f64::NAN, 0.0, "finite"),
    ] {
        let e = equilibria_at(x, y, 14.0).unwrap_err();
        assert!(e.to_string().contains(part), "({x}, {y}): {e}");
    }
    assert!(equilibria_at(0.5, 0.1, -1.0).unwrap_err().is_domain());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// For any equilibrium, the search at its end position finds it again, and its mirror image at the mirrored
    /// position.
    #[test]
    fn every_equilibrium_is_found_again(p in 0.02..6.0f64, lam in 1.0..13.5f64, side in proptest::bool::ANY) {
        let p = if side { p } else { -p };
        let e = snaprod::elastica::Equilibrium::from_lambda_p(lam, p).unwrap();
        prop_assume!(e.x.hypot(e.y) < 1.0);
        let found = equilibria_at(e.x, e.y, 14.0).unwrap();
        let again = found.iter().any(|f| {
            (f.equilibrium.lambda - lam).abs() < 1e-5 && (f.equilibrium.p - p).abs() < 1e-5 * (1.0 + p.abs())
        });
        prop_assert!(again, "lam {} p {} at ({}, {})", lam, p, e.x, e.y);
    }

    /// Warm-started inversion: from a neighbour of a motion, a few Newton steps, to rounding.
    #[test]
    fn warm_inversion_is_short(p in 0.1..2.0f64, w in 0.5..4.0f64, dx in -1e-4..1e-4f64, dy in -1e-4..1e-4f64) {
        let q = Vector2::new(p, w);
        let at = Elastica.point(&q).unwrap();
        let (det, _) = snaprod::manifold::adjugate_times(&at.jacobian, &at.pose);
        prop_assume!(det.abs() > 0.02);
        let pose = at.pose + Vector2::new(dx, dy);
        let found = invert_near(&Elastica, &pose, &q, 1e-14).unwrap();
        prop_assert!(found.residual < 1e-14);
        prop_assert!(found.evaluations <= 5, "{} evaluations", found.evaluations);
    }
}
