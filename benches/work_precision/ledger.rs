//! Energy errors of long runs, and the cost per right-hand side of a planar rod's mass.

use nalgebra::Vector2;
use snaprod::body::{PointMass, TimeLoad};
use snaprod::elastica::{Elastica, Equilibrium, LightRod};
use snaprod::motion::{Event, Options, Run};
use std::f64::consts::SQRT_2;
use std::sync::Arc;
use std::time::Instant;

/// Energy errors over 1000 time units.
pub fn ledgers() {
    for (name, body) in ledger_scenes() {
        println!("{}", ledger(name, &body));
    }
}

/// Cost of following the mass of a planar rod to first order.
pub fn masses() {
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        for start in ROD_MASS {
            println!("{}", rod_mass(start, tolerance));
        }
    }
}

/// Loads of the runs over 1000 time units whose energy error is measured.
fn ledger_scenes() -> [(&'static str, PointMass<2>); 3] {
    let free = || PointMass::new(1.0).unwrap();
    let shaken = TimeLoad::sine(Vector2::new(0.0, 8.0), 2.0, 0.0).unwrap();
    [
        ("free", free()),
        (
            "gravity",
            free().with_gravity(Vector2::new(0.0, -3.0)).unwrap(),
        ),
        (
            "drag and forcing",
            free().with_drag(0.1).unwrap().with_force(shaken),
        ),
    ]
}

/// One line on the energy error from the start of the snap run, at tolerance 1e-12.
fn ledger(name: &str, body: &PointMass<2>) -> String {
    let start = Equilibrium::from_lambda_kappa(6.3, 0.6).unwrap();
    let options = Options::new(1000.0).unwrap().with_tolerance(1e-12).unwrap();
    let q = Vector2::new(start.p, start.w);
    let mut run = Run::new(&Elastica, body, q, Vector2::new(0.0, -0.5), options).unwrap();
    let total = run.now().ledger.total();
    let clock = Instant::now();
    while !matches!(run.next(), Some(Event::Stop(_))) {}
    let end = run.now();
    let error = (end.ledger.total() - total).abs();
    format!(
        "ledger, {name}: t = {}, {} snaps, {} steps in {:.1} s: off by {error:.1e}, {:.1e} of its largest term",
        end.phase.t,
        run.snaps(),
        run.cost().steps,
        clock.elapsed().as_secs_f64(),
        error / end.ledger.largest()
    )
}

/// Motions with the mass of the rod: lambda, p, velocity, dead load, duration.
type Heavy = (f64, f64, [f64; 2], [f64; 2], f64);
const ROD_MASS: [Heavy; 5] = [
    (SQRT_2, -1.6088, [0.0, 0.3], [0.0, -2.0], 5.0),
    (4.0, 0.855, [0.3, 0.1], [-10.0, 3.0], 5.0),
    (10.0, 9.0, [0.3, 0.1], [-84.0, -58.0], 2.0),
    (19.5, 18.5, [0.3, 0.1], [-420.0, -290.0], 0.5),
    (100.0, 99.0, [0.3, 0.1], [-11_000.0, -7500.0], 0.1),
];

/// One line on the cost of following the rod's mass to first order.
fn rod_mass((lam, p, v, load, duration): Heavy, tolerance: f64) -> String {
    let start = Equilibrium::from_lambda_p(lam, p).unwrap();
    let options = Options::new(duration)
        .unwrap()
        .with_tolerance(tolerance)
        .unwrap();
    let none = PointMass::new(1.0)
        .unwrap()
        .with_dead_force(load.into())
        .unwrap();
    let rod = LightRod {
        mass: 0.01,
        gravity: Vector2::zeros(),
    };
    let first = none.clone().with_rod(Arc::new(rod));
    let [none, first] = [none, first].map(|body| {
        let time = |_| {
            let q = Vector2::new(start.p, start.w);
            let mut run = Run::new(&Elastica, &body, q, v.into(), options).unwrap();
            let clock = Instant::now();
            while !matches!(run.next(), Some(Event::Stop(_))) {}
            let ms = 1e3 * clock.elapsed().as_secs_f64();
            (ms, 1e3 * ms / run.cost().evaluations as f64)
        };
        let runs = (0..30).map(time);
        runs.fold((f64::INFINITY, 0.0), |best, run| {
            if run.0 < best.0 { run } else { best }
        })
    });
    format!(
        "mass of the rod, from lambda = {lam:.2}, tolerance {tolerance:e}: {:.3} ms without, {:.3} to first order, {:.3} us a right-hand side: ratio {:.2}",
        none.0,
        first.0,
        first.1,
        first.0 / none.0
    )
}
