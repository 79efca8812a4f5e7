//! Stepping of stiff systems: Radau IIA, and the choice between it and DOP853.

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

/// Integrates over `span`, with a look at every step.
fn run(
    problem: &Problem,
    y: DVector<f64>,
    span: f64,
    tolerance: f64,
    method: Method,
    mut each: impl FnMut(&mut Integrator<Problem>, f64),
) -> Integrator<Problem> {
    let mut integrator = Integrator::new(problem, y, tolerance, method, None).unwrap();
    let mut t = 0.0;
    while span - t > 1e-14 * span {
        integrator
            .step(problem, span - t)
            .unwrap_or_else(|e| panic!("{e:?} at {t}: {:?}", integrator.work()));
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

/// y' = rate (y - cos t) - sin t, with time and, slaved, the integral of y^2: its row of the Jacobian is left zero.
fn decay(rate: f64) -> Problem {
    Problem::new(
        move |y, out| {
            out[0] = rate * (y[0] - y[1].cos()) - y[1].sin();
            out[1] = 1.0;
            out[2] = y[0] * y[0];
        },
        move |y| {
            dmatrix![rate, rate * y[1].sin() - y[1].cos(), 0.0; 0.0, 0.0, 0.0; 0.0, 0.0, 0.0]
        },
        &[1.0; 3],
    )
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
const ROBERTSON: [f64; 3] = [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050];

#[test]
fn explore() {
    for rate in [-1.0, -1e3, -1e6, -1e8] {
        for tol in [1e-6, 1e-8, 1e-10, 1e-12, 1e-13] {
            for method in [Method::Implicit, Method::Auto] {
                let p = decay(rate);
                let (mut sample, mut poly): (f64, f64) = (0.0, 0.0);
                let mut y0 = dvector![1.0, 0.0, 0.0];
                if rate == -1e6 { y0[0] = 2.0 }
                let r = run(&p, y0, 3.0, tol, method, |i, t| {
                    let h = i.span();
                    if t < 0.2 { return }
                    if i.work().steps % 3 == 0 {
                        for x in [0.1, 0.5, 0.8] {
                            let y = i.at(&p, x).unwrap();
                            sample = sample.max((y[0] - (t - (1.0 - x) * h).cos()).abs());
                            let y = i.glance(x);
                            poly = poly.max((y[0] - (t - (1.0 - x) * h).cos()).abs());
                        }
                    }
                });
                let q = 1.5 + 6f64.sin() / 4.0;
                println!("decay {rate:e} {tol:e} {method:?} err {:.1e} quad {:.1e} sample {sample:.1e} poly {poly:.1e} {:?}",
                    (r.state()[0] - 3f64.cos()).abs(), r.state()[2] - q, r.work());
            }
        }
    }
    for tol in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13] {
        for method in [Method::Implicit, Method::Auto] {
            let r = run(&van_der_pol(1e-6), dvector![2.0, 0.0], 2.0, tol, method, |_, _| {});
            println!("vdp {tol:e} {method:?} {:.1e} {:?}", worst(r.state(), &VAN_DER_POL, &[1.0; 2]), r.work());
            let mut y = DVector::zeros(8);
            y[0] = 1.0;
            y[7] = 0.0057;
            let r = run(&hires(), y, 321.8122, tol, method, |_, _| {});
            println!("hires {tol:e} {method:?} {:.1e} {:?}", worst(r.state(), &HIRES, &[1e-3; 8]), r.work());
            let r = run(&robertson(), dvector![1.0, 0.0, 0.0], 1e11, tol, method, |_, _| {});
            println!("rober {tol:e} {method:?} {:.1e} {:?}", worst(r.state(), &ROBERTSON, &[1e-7, 1e-13, 1e-7]), r.work());
        }
    }
}
