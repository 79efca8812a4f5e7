//! Time integration of stiff systems: Radau IIA, and the choice between Radau and DOP853.

use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use snaprod::solve::integrator::{Integrator, Method};
use snaprod::solve::system::System;

type Slope = dyn Fn(&DVector<f64>, &mut DVector<f64>);
type Jacobian = dyn Fn(&DVector<f64>) -> DMatrix<f64>;

/// A system given by functions; errors count relative to floor_i + |y_i|.
struct Problem {
    slope: Box<Slope>,
    jacobian: Box<Jacobian>,
    floor: Vec<f64>,
}

impl Problem {
    fn new(
        slope: impl Fn(&DVector<f64>, &mut DVector<f64>) + 'static,
        jacobian: impl Fn(&DVector<f64>) -> DMatrix<f64> + 'static,
        floor: &[f64],
    ) -> Self {
        Self {
            slope: Box::new(slope),
            jacobian: Box::new(jacobian),
            floor: floor.to_vec(),
        }
    }
}

impl System for Problem {
    type Linearised = DMatrix<f64>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        (self.slope)(y, out);
        out.iter().all(|x| x.is_finite()).then_some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        Some((self.jacobian)(y))
    }

    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let part = |i: usize| error[i] / (self.floor[i] + from[i].abs().max(to[i].abs()));
        (0..error.len()).map(|i| part(i).powi(2)).sum::<f64>() / error.len() as f64
    }
}

/// Integrates over `span`, and calls `look` at every step.
fn run(
    problem: &Problem,
    y: DVector<f64>,
    span: f64,
    tolerance: f64,
    method: Method,
    mut each: impl FnMut(&mut Integrator, f64),
) -> Integrator {
    let mut integrator = Integrator::new(problem, y, tolerance, method, None).unwrap();
    let mut t = 0.0;
    while span - t > 1e-14 * span {
        integrator
            .step(problem, span - t)
            .unwrap_or_else(|e| panic!("{e:?} at {t}: {:?}", integrator.cost()));
        t += integrator.span();
        each(&mut integrator, t);
    }
    integrator
}

fn worst(got: &DVector<f64>, want: &[f64], floor: &[f64]) -> f64 {
    assert!(got.iter().all(|x| x.is_finite()), "{got}");
    let parts = got.iter().zip(want).zip(floor);
    parts.fold(0.0, |e, ((a, b), f)| e.max((a - b).abs() / (b.abs() + f)))
}

/// y' = -rate(t) (y - cos t) - sin t, with time and the integral of y^2, whose row of the Jacobian is left zero.
/// `noise` models rounding of the size of the terms of y - cos t.
fn decay(rate: impl Fn(f64) -> f64 + Copy + 'static, noise: f64) -> Problem {
    Problem::new(
        move |y, out| {
            let (sin, cos) = y[1].sin_cos();
            let rounding = noise * (1e15 * (y[0] + y[1])).sin();
            out[0] = -rate(y[1]) * (y[0] - cos + rounding) - sin;
            out[1] = 1.0;
            out[2] = y[0] * y[0];
        },
        move |y| {
            let (k, (sin, cos)) = (rate(y[1]), y[1].sin_cos());
            dmatrix![-k, -k * sin - cos, 0.0; 0.0, 0.0, 0.0; 0.0, 0.0, 0.0]
        },
        &[1.0; 3],
    )
}

/// The state of [`decay`] on cos t.
fn on_cosine(t: f64) -> [f64; 3] {
    [t.cos(), t, 0.5 * t + 0.25 * (2.0 * t).sin()]
}

fn van_der_pol(epsilon: f64) -> Problem {
    Problem::new(
        move |y, out| {
            out[0] = y[1];
            out[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) / epsilon;
        },
        move |y| {
            dmatrix![0.0, 1.0;
                (-2.0 * y[0] * y[1] - 1.0) / epsilon, (1.0 - y[0] * y[0]) / epsilon]
        },
        &[1.0; 2],
    )
}

fn hires() -> Problem {
    Problem::new(
        |y, f| {
            let fast = 280.0 * y[5] * y[7];
            f[0] = -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007;
            f[1] = 1.71 * y[0] - 8.75 * y[1];
            f[2] = -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4];
            f[3] = 8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3];
            f[4] = -1.745 * y[4] + 0.43 * (y[5] + y[6]);
            f[5] = -fast + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6];
            f[6] = fast - 1.81 * y[6];
            f[7] = -fast + 1.81 * y[6];
        },
        |y| {
            let (a, b) = (280.0 * y[7], 280.0 * y[5]);
            dmatrix![
                -1.71, 0.43, 8.32, 0.0, 0.0, 0.0, 0.0, 0.0;
                1.71, -8.75, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0;
                0.0, 0.0, -10.03, 0.43, 0.035, 0.0, 0.0, 0.0;
                0.0, 8.32, 1.71, -1.12, 0.0, 0.0, 0.0, 0.0;
                0.0, 0.0, 0.0, 0.0, -1.745, 0.43, 0.43, 0.0;
                0.0, 0.0, 0.0, 0.69, 1.71, -a - 0.43, 0.69, -b;
                0.0, 0.0, 0.0, 0.0, 0.0, a, -1.81, b;
                0.0, 0.0, 0.0, 0.0, 0.0, -a, 1.81, -b
            ]
        },
        &[1e-3; 8],
    )
}

fn robertson() -> Problem {
    Problem::new(
        |y, f| {
            let (a, b, c) = (0.04 * y[0], 1e4 * y[1] * y[2], 3e7 * y[1] * y[1]);
            f[0] = b - a;
            f[1] = a - b - c;
            f[2] = c;
        },
        |y| {
            let (b1, b2, c) = (1e4 * y[2], 1e4 * y[1], 6e7 * y[1]);
            dmatrix![-0.04, b1, b2; 0.04, -b1 - c, -b2; 0.0, c, 0.0]
        },
        &[1e-7, 1e-13, 1e-7],
    )
}

// References: Test Set for IVP Solvers (Mazzia, Magherini; Bari), computed there in quadruple precision.
const VAN_DER_POL: [f64; 2] = [1.706167732170483, -0.8928097010247975];
const HIRES: [f64; 8] = [
    0.7371312573325668e-3,
    0.1442485726316185e-3,
    0.5888729740967575e-4,
    0.1175651343283149e-2,
    0.2386356198831331e-2,
    0.6238968252742796e-2,
    0.2849998395185769e-2,
    0.2850001604814231e-2,
];
const ROBERTSON: [f64; 3] = [
    0.2083340149701255e-7,
    0.8333360770334713e-13,
    0.999999979166505,
];

fn no_look(_: &mut Integrator, _: f64) {}

/// Catches wrong stages, a wrong error estimate, and Newton left too early (the quadrature lags behind it): errors
/// near the tolerance on a smooth problem, in steps of order 5 and of order 9.
#[test]
fn radau_keeps_the_tolerance() {
    let problem = decay(|_| 1.0, 0.0);
    for tolerance in [1e-6, 1e-7, 1e-8, 1e-10, 1e-12] {
        let start = dvector![1.0, 0.0, 0.0];
        let end = run(&problem, start, 3.0, tolerance, Method::Implicit, no_look);
        let error = worst(end.state(), &on_cosine(3.0), &[1.0; 3]);
        assert!(error < tolerance, "{error:e} at {tolerance:e}");
    }
}

/// Catches a Newton iteration judged by the slope, whose rounding is 1e-8 here, and a collapse of the step size.
/// Samples inside the steps are as accurate as the ends.
#[test]
fn rounding_of_a_stiff_slope_does_no_harm() {
    for (rate, noise, allowed) in [
        (1e3, 0.0, 60.0),
        (1e6, 0.0, 1.0),
        (1e8, 0.0, 1.0),
        (1e8, 1e-15, 1.0),
    ] {
        for tolerance in [1e-6, 1e-8, 1e-10, 1e-12, 1e-13] {
            for method in [Method::Implicit, Method::Auto] {
                let problem = decay(move |_| rate, noise);
                let start = dvector![1.0, 0.0, 0.0];
                let mut sample = 0.0_f64;
                let end = run(&problem, start, 3.0, tolerance, method, |integrator, t| {
                    if integrator.cost().steps.is_multiple_of(5) {
                        for x in [0.1, 0.5, 0.8] {
                            let y = integrator.at(&problem, x).unwrap();
                            let at = t - (1.0 - x) * integrator.span();
                            sample = sample.max(worst(&y, &on_cosine(at), &[1.0; 3]));
                        }
                    }
                });
                let error = worst(end.state(), &on_cosine(3.0), &[1.0; 3]);
                let what = format!(
                    "{rate:e} {noise:e} {tolerance:e} {method:?}: {:?}",
                    end.cost()
                );
                let bound = allowed * tolerance + 1e-14;
                assert!(error < bound, "{error:e}, {what}");
                assert!(sample < 4.0 * bound, "sample {sample:e}, {what}");
                let budget = 60.0 + 20.0 * (1e-6 / tolerance).powf(1.0 / 6.0);
                assert!((end.cost().steps as f64) < budget, "{budget} {what}");
                assert!(end.cost().rejected < 20, "{what}");
            }
        }
    }
}

/// A problem of the test set with its published end; errors may reach `factor` tolerances.
struct Case<'a> {
    name: &'a str,
    problem: Problem,
    start: DVector<f64>,
    span: f64,
    want: &'a [f64],
    floor: &'a [f64],
    factor: f64,
}

/// Catches errors in the handling of relaxation, of slow manifolds and of steps that grow by fifteen orders: published
/// references, to within a few tolerances, for a bounded amount of work.
#[test]
fn test_set_references_are_met() {
    let mut first = DVector::zeros(8);
    first[0] = 1.0;
    first[7] = 0.0057;
    let small = [1e-7, 1e-13, 1e-7];
    let case = |name, problem, start, span, want, floor, factor| Case {
        name,
        problem,
        start,
        span,
        want,
        floor,
        factor,
    };
    let pair = dvector![2.0, 0.0];
    let triple = dvector![1.0, 0.0, 0.0];
    let cases = [
        case(
            "van der Pol",
            van_der_pol(1e-6),
            pair,
            2.0,
            &VAN_DER_POL[..],
            &[1.0; 2][..],
            3.0,
        ),
        case("HIRES", hires(), first, 321.8122, &HIRES, &[1e-3; 8], 60.0),
        case(
            "Robertson",
            robertson(),
            triple,
            1e11,
            &ROBERTSON,
            &small,
            1.0,
        ),
    ];
    // Steps allowed of Radau at each tolerance, and slopes allowed of the free choice.
    let steps = [
        [600, 130, 380],
        [1200, 260, 750],
        [2600, 540, 1600],
        [5700, 1200, 3400],
    ];
    let slopes = [
        [4500, 1700, 3600],
        [7500, 2900, 7500],
        [14000, 6000, 17000],
        [34000, 17000, 39000],
    ];
    for (i, tolerance) in [1e-6, 1e-8, 1e-10, 1e-12].into_iter().enumerate() {
        for (j, case) in cases.iter().enumerate() {
            for method in [Method::Implicit, Method::Auto] {
                let end = run(
                    &case.problem,
                    case.start.clone(),
                    case.span,
                    tolerance,
                    method,
                    no_look,
                );
                let error = worst(end.state(), case.want, case.floor);
                let work = end.cost();
                let what = format!("{} {tolerance:e} {method:?}: {work:?}", case.name);
                assert!(error < case.factor * tolerance, "{error:e}, {what}");
                if method == Method::Implicit {
                    assert!(work.steps < steps[i][j], "{what}");
                    assert!(work.rejected < 20, "{what}");
                    assert!(work.jacobians < 120 * (i as u64 + 1), "{what}");
                } else {
                    assert!(work.evaluations < slopes[i][j], "{what}");
                }
            }
        }
    }
}

/// Catches a choice of method that never switches, never returns, or flips to and fro.
#[test]
fn the_method_follows_the_stiffness() {
    // Stiff around t = 5 only.
    let problem = decay(|t| 1.0 + 1e6 * (-2.0 * (t - 5.0).powi(2)).exp(), 0.0);
    for tolerance in [1e-6, 1e-9, 1e-12] {
        let start = dvector![1.0, 0.0, 0.0];
        let mut stiff = true;
        let end = run(
            &problem,
            start,
            12.0,
            tolerance,
            Method::Auto,
            |integrator, t| {
                if (4.5..5.5).contains(&t) {
                    stiff &= integrator.method_now() == Method::Implicit;
                }
            },
        );
        let work = end.cost();
        let error = worst(end.state(), &on_cosine(12.0), &[1.0; 3]);
        assert!(error < 20.0 * tolerance, "{error:e} {tolerance:e} {work:?}");
        assert!(stiff && end.method_now() == Method::Explicit, "{work:?}");
        assert!(work.switches <= 6, "{work:?}");
    }
    // The orbit of a nonlinear oscillator is not stiff.
    let end = run(
        &van_der_pol(1.0),
        dvector![2.0, 0.0],
        20.0,
        1e-9,
        Method::Auto,
        no_look,
    );
    assert_eq!(end.cost().switches, 0);
    // Slow manifold, layer, slow manifold ...
    let end = run(
        &van_der_pol(1e-6),
        dvector![2.0, 0.0],
        2.0,
        1e-8,
        Method::Auto,
        no_look,
    );
    assert!((3..12).contains(&end.cost().switches), "{:?}", end.cost());
}

/// Catches a step size that creeps: into a layer a million times thinner than the steps, and out of it.
#[test]
fn a_thin_layer_is_entered_and_left_quickly() {
    let width = 1e-8;
    let shape = move |t: f64| ((t - 1.0) / width).tanh();
    let problem = Problem::new(
        move |y, out| {
            let s = shape(y[1]);
            out[0] = 1e3 * (s - y[0]) + (1.0 - s * s) / width;
            out[1] = 1.0;
        },
        move |y| {
            let s = shape(y[1]);
            let rate = (1.0 - s * s) / width;
            dmatrix![-1e3, 1e3 * rate - 2.0 * s * rate / width; 0.0, 0.0]
        },
        &[1.0; 2],
    );
    for method in [Method::Implicit, Method::Auto] {
        let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
        let start = dvector![-1.0, 0.0];
        let end = run(&problem, start, 2.0, 1e-8, method, |integrator, t| {
            // A method would miss a layer without a step inside.
            if t > 0.5 {
                least = least.min(integrator.span());
            }
            largest = largest.max(integrator.span());
        });
        let work = end.cost();
        assert!(
            (end.state()[0] - 1.0).abs() < 1e-7,
            "{} {work:?}",
            end.state()
        );
        assert!(
            least < 1e-8 && largest > 0.02,
            "{least:e} {largest:e} {work:?}"
        );
        assert!(work.rejected < 60 && work.evaluations < 6000, "{work:?}");
    }
}

/// Catches a restart that loses the step size, or keeps data of the old dimension.
#[test]
fn a_restart_may_change_the_dimension() {
    let three = decay(|_| 1e4, 0.0);
    let two = Problem::new(
        |y, out| {
            out[0] = -1e4 * (y[0] - y[1].cos()) - y[1].sin();
            out[1] = 1.0;
        },
        |y| dmatrix![-1e4, -1e4 * y[1].sin() - y[1].cos(); 0.0, 0.0],
        &[1.0; 2],
    );
    for method in [Method::Explicit, Method::Implicit, Method::Auto] {
        let mut integrator = run(&three, dvector![1.0, 0.0, 0.0], 1.0, 1e-8, method, no_look);
        let (before, h) = (integrator.cost(), integrator.next_step());
        let y = integrator.state().rows(0, 2).into_owned();
        integrator.restart(&two, y, None).unwrap();
        assert_eq!(integrator.next_step(), h);
        while integrator.state()[1] < 2.0 - 1e-13 {
            let rest = 2.0 - integrator.state()[1];
            integrator.step(&two, rest).unwrap();
        }
        let after = integrator.cost();
        assert!((integrator.state()[0] - 2f64.cos()).abs() < 1e-7);
        assert!(
            method == Method::Explicit || after.rejected - before.rejected < 12,
            "{method:?} {before:?} {after:?}"
        );
    }
}

/// Catches endless loops: a solution that leaves the domain, y = sqrt(1 - t), ends with an error, and a start outside
/// is refused.
#[test]
fn the_end_of_the_domain_is_reported() {
    let problem = Problem::new(
        |y, out| out[0] = if y[0] > 0.0 { -0.5 / y[0] } else { f64::NAN },
        |y| dmatrix![0.5 / (y[0] * y[0])],
        &[1e-9],
    );
    for method in [Method::Explicit, Method::Implicit, Method::Auto] {
        assert!(Integrator::new(&problem, dvector![-1.0], 1e-8, method, None).is_none());
        let mut integrator = Integrator::new(&problem, dvector![1.0], 1e-8, method, None).unwrap();
        let mut t = 0.0;
        while integrator.step(&problem, 10.0).is_ok() {
            t += integrator.span();
            assert!(integrator.cost().evaluations < 100_000);
        }
        assert!((t - 1.0).abs() < 1e-6, "{method:?} {t}");
    }
}
