//! Viscoelastic rods: the reduced system, its Jacobian, its references.

use nalgebra::{Complex, DVector, Matrix6, Vector1, Vector2};
use snaprod::body::Body;
use snaprod::dynamics::viscous::{
    Nodes, ViscousEvent, ViscousOptions, ViscousRun, ViscousStart, ViscousSystem,
};
use snaprod::rod::section::{Linear, Resultant, Strain};
use snaprod::solve::integrator::Method;
use snaprod::solve::system::{Factor, Linearised, System};
use snaprod::viscous::grid::Grid;
use snaprod::viscous::law::{Maxwell, Rate, RateLaw, Viscoelastic};
use snaprod::viscous::material::{Material, Units};
use snaprod::viscous::plane::Plane;
use snaprod::viscous::reduced::Reduced;
use std::sync::Arc;

#[derive(Debug)]
struct Kv(f64);
impl RateLaw for Kv {
    fn rate(&self, _: f64, _: &Strain, o: &Resultant) -> snaprod::Result<Rate> {
        Ok(Rate {
            rate: o / self.0,
            by_overstress: Matrix6::identity() / self.0,
            by_strain: Matrix6::zeros(),
        })
    }
    fn overstress(&self, _: f64, _: &Strain, r: &Strain) -> snaprod::Result<Resultant> {
        Ok(r * self.0)
    }
    fn is_linear(&self) -> bool {
        true
    }
    fn uniform_fluidity(&self) -> Option<Matrix6<f64>> {
        Some(Matrix6::identity() / self.0)
    }
    fn rigid(&self) -> [bool; 6] {
        [false, false, false, true, true, true]
    }
}

fn material(eta: f64, branches: Vec<Maxwell>) -> Material<1> {
    let law = Viscoelastic {
        elastic: Arc::new(Linear::diagonal([1.0, 1.0], 1.0).unwrap()),
        rate: Arc::new(Kv(eta)),
        branches,
    };
    Material::new(law, Units::ONE, [0]).unwrap()
}

#[test]
fn jacobian() {
    let branches = vec![
        Maxwell {
            modulus: Matrix6::identity() * 0.7,
            time: 0.3,
        },
        Maxwell {
            modulus: Matrix6::identity() * 0.2,
            time: 5.0,
        },
    ];
    let body = Body::new(1.3).unwrap().with_drag(0.4).unwrap();
    let system = ViscousSystem {
        rod: Reduced {
            kinematics: Plane,
            material: material(0.1, branches),
            grid: Arc::new(Grid::new(&[0.4], &[6, 7])),
        },
        body: &body,
    };
    let grid = &system.rod.grid;
    let e: Vec<_> = grid
        .nodes()
        .iter()
        .map(|s| Vector1::new(1.5 - 2.0 * s * s))
        .collect();
    let z: Vec<_> = grid.nodes().iter().map(|s| Vector1::new(0.5 + s)).collect();
    let y = system.state(&e, &[z.clone(), z], &Vector2::new(0.3, -0.8));
    let j = system.linearised(&y).unwrap();
    let n = y.len();
    let mut worst = 0.0f64;
    for k in 0..n {
        let h = 1e-5;
        let f = |d: f64| {
            let mut y = y.clone();
            y[k] += d;
            let mut out = DVector::zeros(n);
            system.slope(&y, &mut out).unwrap();
            out
        };
        let difference = (f(-2.0 * h) - f(-h) * 8.0 + f(h) * 8.0 - f(2.0 * h)) / (12.0 * h);
        let unit = DVector::from_fn(n, |i, _| if i == k { 1.0 } else { 0.0 });
        let exact = j.times(&unit);
        for i in 0..n - 4 {
            worst = worst.max((difference[i] - exact[i]).abs());
        }
        for sigma in [
            Complex::new(3.0, 1.0),
            Complex::new(1e4, -2e4),
            Complex::new(0.2, 0.0),
        ] {
            let x = unit.map(|v| Complex::new(v, 0.0));
            let mut b = x.map(|v| v * sigma) - exact.map(|v| Complex::new(v, 0.0));
            if k >= n - 4 {
                continue;
            }
            assert!(j.shifted(sigma).unwrap().solve(&mut b));
            let d = (b - x).norm();
            assert!(d < 1e-9, "{k} {sigma} {d}");
        }
    }
    println!("worst {worst:e}");
    assert!(worst < 1e-6);
}

#[test]
fn reference() {
    let body = Body::new(1.0).unwrap();
    for (tol, nodes, method) in [
        (1e-6, Nodes::Adaptive, Method::Auto),
        (1e-10, Nodes::Adaptive, Method::Auto),
        (1e-10, Nodes::Fixed(24), Method::Auto),
        (1e-10, Nodes::Fixed(24), Method::Explicit),
        (1e-10, Nodes::Fixed(24), Method::Implicit),
        (1e-12, Nodes::Fixed(32), Method::Auto),
    ] {
        let clock = std::time::Instant::now();
        let options = ViscousOptions::new(3.0)
            .unwrap()
            .with_tolerance(tol)
            .unwrap()
            .with_nodes(nodes)
            .with_method(method);
        let start = ViscousStart {
            strain: &|s| Vector1::new(1.5 * (1.0 - s)),
            relaxed: None,
            velocity: Vector2::new(0.0, -1.0),
        };
        let mut run =
            ViscousRun::new(Plane, material(0.1, vec![]), &body, &start, options).unwrap();
        let total = run.first().ledger.total();
        while let Some(event) = run.next() {
            if let ViscousEvent::Step { from, to } = event {
                for t in [0.5, 1.0] {
                    if from < t && t <= to {
                        let s = run.sample(t).unwrap();
                        println!(
                            "{t} {:.12?} {:.12?} {:.10} {:.10}",
                            s.pose.as_slice(),
                            s.velocity.as_slice(),
                            s.ledger.elastic,
                            s.ledger.dissipated
                        );
                    }
                }
            }
        }
        let s = run.now();
        println!(
            "{tol:e} {nodes:?} {method:?} {:.12?} {:.12?} {:.10} {:.10}",
            s.pose.as_slice(),
            s.velocity.as_slice(),
            s.ledger.elastic,
            s.ledger.dissipated
        );
        println!(
            "   total {:e} nodes {} tail {:e} {:?} {:?}",
            s.ledger.total() - total,
            run.most_nodes(),
            run.tail(),
            run.work(),
            clock.elapsed()
        );
        println!("   {:?}", run.layers());
    }
    println!(
        "ref (0.9100385606, 0.3763304412) v = (-0.0901301852, 0.1757726349) U = 0.2299558860, dissipated 0.6255343792"
    );
}
