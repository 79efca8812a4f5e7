//! First-order mass of the planar rod: folds and vibrations (theory 2.8, 2.9).

use crate::support::worst;
use nalgebra::{Matrix2, Vector2};
use snaprod::body::PointMass;
use snaprod::elastica::{
    Elastica, Equilibrium, FoldNormalForm, LightRod, RodInertia, fold_at, held_modes,
};
use snaprod::math::gauss::Rule;
use snaprod::motion::{Event, Options, Outcome, Run};
use std::sync::Arc;

fn rod(p: f64, lam: f64) -> RodInertia {
    let at = Equilibrium::from_lambda_p(lam, p).unwrap();
    RodInertia::new(at.p, at.w).unwrap()
}

/// Differences of sixth order.
fn slope<T>(f: impl Fn(f64) -> T, h: f64) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let odd = |k: f64| f(k * h) - f(-k * h);
    (odd(1.0) * 45.0 + odd(2.0) * -9.0 + odd(3.0)) * (1.0 / (60.0 * h))
}

/// Twenty points of the chart, from slightly loaded rods to beyond the first folds.
fn points() -> impl Iterator<Item = (f64, f64)> {
    (0..20).map(|k| {
        let x = f64::from(k);
        let p = [1.0, -1.0][k as usize % 2] * (0.2 + 2.6 * (x * 0.618_034).fract());
        (p, 0.4 + 7.0 * (x * 0.754_878).fract())
    })
}

/// Catches a wrong velocity field: N is twice the kinetic energy of positions by differences, and that of a full rod
/// in the reference data.
#[test]
fn metric_is_the_kinetic_energy_of_the_rod() {
    let place = |p: f64, lam: f64, s: f64| {
        let at = Equilibrium::from_lambda_p(lam, p)
            .unwrap()
            .section(s)
            .unwrap();
        Vector2::new(at.x, at.y)
    };
    let rule = Rule::new(60);
    for (p, lam) in points() {
        let sum = |n: Matrix2<f64>, (s, weight): (&f64, &f64)| {
            let by = Matrix2::from_columns(&[
                slope(|h| place(p + h, lam, *s), 2e-3),
                slope(|h| place(p, lam + h, *s), 2e-3),
            ]);
            n + by.transpose() * by * *weight
        };
        let expected = rule
            .nodes
            .iter()
            .zip(&rule.weights)
            .fold(Matrix2::zeros(), sum);
        let (found, _) = rod(p, lam).metric();
        let error = (found - expected).amax() / expected.amax();
        assert!(error < 1e-10, "p {p} lam {lam}: {error:e}");
    }
    // rod_kinetic of the given runs through a snap: mass 0.01, velocity (-0.799, -0.033).
    let v = Vector2::new(-0.799, -0.033);
    let added = rod(0.855, 6.4292).added(&v, &Vector2::zeros()).unwrap();
    assert!((0.005 * v.dot(&(added.mass * v)) - 0.001_755_896_1).abs() < 1e-10);
    // Across the straight rod.
    let straight = rod(0.003, 0.02);
    let by = straight.end().0.column(1).norm_squared();
    assert!((straight.metric().0[(1, 1)] / by - 33.0 / 140.0).abs() < 2e-5);
    let bent = rod(0.8, 2.0);
    let by = bent.end().0.column(1).norm_squared();
    assert!((bent.metric().0[(1, 1)] / by - 33.0 / 140.0).abs() > 1e-3);
}

/// Catches a wrong second derivative of the field: the force on the end is that of Lagrange's equations, by
/// differences of N.
#[test]
fn force_of_the_moving_rod_is_that_of_lagrange() {
    let v = Vector2::new(0.4, -0.7);
    for (p, lam) in points() {
        let here = rod(p, lam);
        let (by, second) = here.end();
        let inverse = by.try_inverse().unwrap();
        let q = inverse * v;
        let n = |p: f64, lam: f64| rod(p, lam).metric().0;
        let by_q = [
            slope(|h| n(p + h, lam), 1e-3),
            slope(|h| n(p, lam + h), 1e-3),
        ];
        let moved = (by_q[0] * q[0] + by_q[1] * q[1]) * q;
        let pulled = Vector2::new(q.dot(&(by_q[0] * q)), q.dot(&(by_q[1] * q))) * 0.5;
        let end =
            second[0] * (q[0] * q[0]) + second[1] * (2.0 * q[0] * q[1]) + second[2] * (q[1] * q[1]);
        let terms = [
            inverse.transpose() * (n(p, lam) * inverse * end),
            inverse.transpose() * (pulled - moved),
        ];
        let found = here.added(&v, &Vector2::zeros()).unwrap().force;
        let error =
            (found - (terms[0] + terms[1])).norm() / terms.map(|t| t.norm()).iter().sum::<f64>();
        assert!(error < 1e-8, "p {p} lam {lam}: {error:e}");
    }
}

/// The three folds of the theory: A, B, M0, D0 to the digits printed there; the held rod is soft at the fold, and
/// damped as D0/(2 M0).
#[test]
fn folds_have_the_numbers_of_their_normal_form() {
    let cases = [
        (
            (6.4292, 0.855, [-0.799, -0.033]),
            [34.444, 6.0367, 0.020073, 13.481],
            [0.2457, 2.2355],
        ),
        (
            (5.7354, 2.334, [0.934, 0.359]),
            [21.075, 6.8356, 0.11194, 25.688],
            [0.5258, 3.8830],
        ),
        (
            (6.3, 0.6f64.atanh(), [0.0, -0.5]),
            [22.281, 4.3230, 0.015452, 9.3137],
            [0.2581, 2.2579],
        ),
    ];
    let body = PointMass::new(1.0).unwrap();
    for ((lam, p, v), numbers, escapes) in cases {
        let start = Equilibrium::from_lambda_p(lam, p).unwrap();
        let mut run = Run::new(
            &Elastica,
            &body,
            Vector2::new(start.p, start.w),
            v.into(),
            Options::new(1.0).unwrap(),
        )
        .unwrap();
        let snap = run.find_map(|event| match event {
            Event::Snap(snap) => Some(snap),
            _ => None,
        });
        let snap = snap.expect("a snap");
        let q = &snap.from.q;
        let fold = FoldNormalForm::new(
            q[0],
            q[1],
            &Vector2::new(snap.velocity[0], snap.velocity[1]),
        )
        .unwrap();
        let found = [fold.drive, fold.bend, fold.mass, fold.friction];
        for (found, expected) in found.iter().zip(numbers) {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
        let found = [
            3.411_684_340 * fold.inertial(1.0),
            2.338_107_410 * fold.viscous(1.0),
        ];
        for (found, expected) in found.iter().zip(escapes) {
            assert!((found / expected - 1.0).abs() < 3e-4, "{found} {expected}");
        }
        assert!(fold.ahead < 1e-9);
        let held = held_modes(q[0], q[1], 2).unwrap();
        assert!(
            held[0].stiffness.abs() < 1e-6 * held[1].stiffness,
            "{held:?}"
        );
        assert!((held[0].friction * 2.0 * fold.mass / fold.friction - 1.0).abs() < 1e-6);
    }
}

/// Catches energy lost where the rod's mass is followed or switched off: smooth motion under weight, and through a
/// snap.
#[test]
fn ledger_closes_with_the_mass_of_the_rod() {
    let cases = [
        (
            std::f64::consts::SQRT_2,
            -1.6088,
            [0.0, 0.3],
            [0.0, -2.0],
            0,
        ),
        (6.4292, 0.855, [-0.799, -0.033], [0.0, 0.0], 1),
    ];
    for (lam, p, v, gravity, snaps) in cases {
        let start = Equilibrium::from_lambda_p(lam, p).unwrap();
        let gravity = Vector2::from(gravity);
        let rod = LightRod {
            mass: 0.01,
            gravity,
        };
        let body = PointMass::new(1.0)
            .unwrap()
            .with_gravity(gravity)
            .unwrap()
            .with_rod(Arc::new(rod));
        let options = Options {
            tolerance: 1e-10,
            ..Options::new(0.5).unwrap()
        };
        let mut run = Run::new(
            &Elastica,
            &body,
            Vector2::new(start.p, start.w),
            v.into(),
            options,
        )
        .unwrap();
        let total = run.now().ledger.total();
        let mut kinetic: f64 = 0.0;
        while let Some(event) = run.next() {
            let ledger = run.now().ledger;
            kinetic = kinetic.max(ledger.rod_kinetic);
            assert!(
                (ledger.total() - total).abs() < 1e-8 * ledger.largest(),
                "{event:?}"
            );
            if let Event::Stop(outcome) = event {
                assert!(matches!(outcome, Outcome::EndOfTime), "{outcome:?}");
            }
        }
        assert!(run.snaps() >= snaps && kinetic > 1e-5);
    }
}

/// Catches a switch-off of the mass too late before a fold: far from folds M0 is not computed but assumed to be 1, an
/// upper bound.
#[test]
fn the_mass_of_a_critical_shape_is_below_one() {
    let v = Vector2::new(1.0, 0.3);
    let mut folds = 0;
    for number in 1..12 {
        // p = 0 is the straight rod, whose lam is invisible in the chart.
        for k in -30..30 {
            let Ok(fold) = fold_at(number, 0.1 + 0.2 * f64::from(k)) else {
                continue;
            };
            let at = fold.equilibrium;
            // Pulls beyond lam = 100 are refused.
            let Ok(passage) = FoldNormalForm::new(at.p, at.w, &v) else {
                continue;
            };
            assert!(passage.mass > 0.0 && passage.mass < 1.0, "{passage:?}");
            folds += 1;
        }
    }
    assert!(folds > 300, "{folds}");
}

/// Catches a quadrature with too few nodes for the required accuracy, as with poles of the pendulum nearer than
/// assumed.
#[test]
fn integrals_along_the_rod_are_as_good_as_asked() {
    let (v, still) = (Vector2::new(0.7, -0.3), Vector2::zeros());
    for part in [1e-4, 1e-6, 1e-8, 1e-10] {
        for p in [0.1, 0.4, 0.9, 1.6, 2.6, 4.0, 9.0, 18.0] {
            for lam in [1.4, 3.0, 5.3, 8.0, 10.0, 14.0, 25.0] {
                let [rough, fine] = [part, 1e-12].map(|part| {
                    let rod = RodInertia::at_load(p, lam).unwrap().with_error(part);
                    rod.added(&v, &still).unwrap()
                });
                let mass = (rough.mass - fine.mass).norm() / fine.mass.norm();
                let force = (rough.force - fine.force).norm() / fine.force.norm();
                let off = worst([mass, force]) / part;
                assert!(off < 10.0, "p {p} lam {lam} part {part:e}: {off}");
            }
        }
    }
}
