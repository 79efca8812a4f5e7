use super::*;
use crate::solve::system::System;
use nalgebra::DMatrix;
use std::cell::Cell;

/// y' = cos t - y, with time.
struct Forced;

impl System for Forced {
    type Linearised = DMatrix<f64>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        (out[0], out[1]) = (y[1].cos() - y[0], 1.0);
        Some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        Some(DMatrix::from_row_slice(
            2,
            2,
            &[-1.0, -y[1].sin(), 0.0, 0.0],
        ))
    }

    fn mean_square(&self, error: &DVector<f64>, _: &DVector<f64>, _: &DVector<f64>) -> f64 {
        0.5 * error.norm_squared()
    }
}

/// y' = -y, with time.
struct Fading;

impl System for Fading {
    type Linearised = DMatrix<f64>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        (out[0], out[1]) = (-y[0], 1.0);
        Some(())
    }

    fn linearised(&self, _: &DVector<f64>) -> Option<DMatrix<f64>> {
        Some(DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, 0.0]))
    }

    fn mean_square(&self, error: &DVector<f64>, _: &DVector<f64>, _: &DVector<f64>) -> f64 {
        error[0] * error[0]
    }
}

/// Catches a wrong time where a motion has come to rest and steps grow for ever (seed 500934 of `stress`).
#[test]
fn rest_is_timed_by_steps_of_any_length() {
    let (start, slope) = ([1.0, 0.0], [-1.0, 1.0]);
    let [start, slope] = [start, slope].map(|x| DVector::from_vec(x.to_vec()));
    let mut radau = Radau::new(start, slope, 1e-2, 1e-8);
    for _ in 0..400 {
        radau.step(&Fading, 1e300).expect("a step");
        let passed = radau.state()[1] - radau.from()[1];
        let off = passed / radau.span() - 1.0;
        assert!(off.abs() < 1e-9, "{off:e} at {:e}", radau.state()[1]);
    }
    assert!(radau.state()[1] > LONGEST);
}

/// A swing y'' = -sin y on a stiff, bent curve: x is drawn to y^2. In its rough Jacobian the pull of x is `wrong`
/// times as strong.
struct Drawn {
    wrong: Option<f64>,
    whole: Cell<u64>,
}

impl Drawn {
    const PULL: f64 = 1e4;

    fn jacobian(y: &DVector<f64>, pull: f64) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(4, 4);
        (jacobian[(0, 1)], jacobian[(1, 0)]) = (1.0, -y[0].cos());
        (jacobian[(2, 0)], jacobian[(2, 2)]) = (2.0 * pull * y[0], -pull);
        jacobian
    }
}

impl System for Drawn {
    type Linearised = DMatrix<f64>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let pull = Self::PULL * (y[0] * y[0] - y[2]);
        out.copy_from_slice(&[y[1], -y[0].sin(), pull, 1.0]);
        Some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        self.whole.set(self.whole.get() + 1);
        Some(Self::jacobian(y, Self::PULL))
    }

    fn roughly_linearised(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        Some(Self::jacobian(y, self.wrong? * Self::PULL))
    }

    fn mean_square(&self, error: &DVector<f64>, _: &DVector<f64>, _: &DVector<f64>) -> f64 {
        error.rows(0, 3).norm_squared() / 3.0
    }
}

/// Catches good rough Jacobians left unused, and bad ones kept in use.
#[test]
fn rough_jacobians_serve_or_are_left() {
    let run = |wrong: Option<f64>| {
        let system = Drawn {
            wrong,
            whole: Cell::new(0),
        };
        let (start, slope) = ([1.0, 0.0, 1.0, 0.0], [0.0, -1.0_f64.sin(), 0.0, 1.0]);
        let [start, slope] = [start, slope].map(|x| DVector::from_vec(x.to_vec()));
        let mut radau = Radau::new(start, slope, 1e-3, 1e-8);
        while radau.state()[3] < 200.0 {
            let left = 200.0 - radau.state()[3];
            radau.step(&system, left).expect("a step");
        }
        (radau.state()[0], radau.cost(), system.whole.get())
    };
    let (exact, cost, _) = run(None);
    for (wrong, most, served) in [
        (1.0, 1.05, true),
        (1.1, 2.0, true),
        (4.0, 1.2, false),
        (0.1, 1.2, false),
        (-1.0, 1.2, false),
    ] {
        let (end, with, whole) = run(Some(wrong));
        assert!((end - exact).abs() < 1e-8, "{wrong}: {end} for {exact}");
        let more = with.evaluations as f64 / cost.evaluations as f64;
        assert!(more < most, "{wrong}: {more} of the evaluations");
        let share = whole as f64 / with.jacobians as f64;
        assert_eq!(share < 0.05, served, "{wrong}: {share} are whole");
    }
}

/// Catches an order 13 missed although cheaper, or one with a different result.
#[test]
fn orders_are_those_that_cost_less() {
    let run = |orders: Option<Orders>| {
        let system = Drawn {
            wrong: None,
            whole: Cell::new(0),
        };
        let (start, slope) = ([1.0, 0.0, 1.0, 0.0], [0.0, -1.0_f64.sin(), 0.0, 1.0]);
        let [start, slope] = [start, slope].map(|x| DVector::from_vec(x.to_vec()));
        let mut radau = Radau::new(start, slope, 1e-3, 1e-11);
        radau.orders = orders.unwrap_or(radau.orders);
        let mut high = 0;
        while radau.state()[3] < 500.0 {
            let left = 500.0 - radau.state()[3];
            radau.step(&system, left).expect("a step");
            high += u64::from(radau.stages.len() == 7);
        }
        let share = high as f64 / radau.cost().steps as f64;
        (radau.state()[0], radau.spent(), share)
    };
    let (exact, nine, _) = run(Some(Orders::only(Order::Nine)));
    let (end, free, share) = run(None);
    assert!((end - exact).abs() < 1e-9, "{end} for {exact}");
    assert!(
        free < 0.9 * nine && share > 0.5,
        "{free} for {nine}, {share} of the steps"
    );
}

/// Catches wrong stages and a wrong error estimate: errors fall with the steps by the order, and stay near the
/// tolerance.
#[test]
fn errors_fall_by_the_order() {
    let exact = |t: f64| 0.5 * (t.cos() + t.sin() - (-t).exp());
    for (order, tolerances, range) in [
        (Order::Five, [1e-8, 1e-11], 4.5..5.7),
        (Order::Nine, [1e-7, 1e-11], 8.0..10.0),
    ] {
        let runs = tolerances.map(|tolerance| {
            let (start, slope) = (DVector::zeros(2), DVector::repeat(2, 1.0));
            let mut radau = Radau::new(start, slope, 1e-2, tolerance);
            radau.orders = Orders::only(order);
            while radau.state()[1] < 9.0 {
                let left = 9.0 - radau.state()[1];
                radau.step(&Forced, left).expect("a step");
            }
            let error = (radau.state()[0] - exact(radau.state()[1])).abs();
            assert!(error < tolerance, "{order:?}: {error:e} at {tolerance:e}");
            (radau.cost().steps as f64, error)
        });
        let found = (runs[0].1 / runs[1].1).ln() / (runs[1].0 / runs[0].0).ln();
        assert!(range.contains(&found), "{order:?}: {found}, {runs:?}");
    }
}

/// Catches wrong stages: a step of y' = -y multiplies by the Pade approximant of e^-h of degrees s - 1 over s, whose
/// error is of order 2 s.
#[test]
fn steps_are_those_of_pade() {
    for (order, s, rounding) in [
        (Order::Five, 3, 1e-14),
        (Order::Nine, 5, 1e-14),
        (Order::Thirteen, 7, 1e-13),
    ] {
        for h in [0.3, 0.6] {
            let powers = |degree: i32, z: f64| {
                let term = |sum: f64, i: i32| {
                    // From the highest power down.
                    1.0 + sum * z * f64::from(degree - i) / f64::from((i + 1) * (2 * s - 1 - i))
                };
                (0..degree).rev().fold(1.0, term)
            };
            let expected = powers(s - 1, -h) / powers(s, h);
            let [start, slope] = [[1.0, 0.0], [-1.0, 1.0]].map(|x| DVector::from_vec(x.to_vec()));
            let mut radau = Radau::new(start, slope, h, 1e-2);
            radau.orders = Orders::only(order);
            radau.step(&Fading, h).expect("a step");
            assert_eq!(radau.span(), h, "{order:?}");
            let off = (radau.state()[0] - expected).abs();
            assert!(off < rounding, "{order:?}, {h}: {off:e}");
        }
    }
}
