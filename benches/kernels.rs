//! Timings of kernels: `cargo bench --bench kernels`.
//!
//! The aims come from a compiled peer (C++, Boost's Carlson functions): 0.65-0.8 us for a right-hand side with its
//! share of the integrator.

use divan::{Bencher, black_box};
use nalgebra::Vector2;
use snaprod::bar::{Bar, BarMotion as _, End, FiniteVolumes, Material, Stress};
use snaprod::body::{History, PointMass};
use snaprod::elastica::{Elastica, equilibria_at};
use snaprod::manifold::{EquilibriumManifold, Multivalued, invert_near};
use snaprod::math::jacobi::sn_cn_dn;
use snaprod::motion::{Event, Options, Run};

fn main() {
    divan::main();
}

/// Chart points along a line; each call takes another one, as in a motion.
const LINE: usize = 1000;

/// Position, force, energy and first derivatives at one chart point; aim: 200 ns.
#[divan::bench(args = [0.5, 1.3, 2.5, 4.0], sample_count = 200)]
fn chart_point(bencher: Bencher, w: f64) {
    bencher.counter(LINE).bench(|| {
        (0..LINE).fold(0.0, |sum, i| {
            let q = Vector2::new(0.2 + 1e-3 * i as f64, w);
            sum + Elastica.point(black_box(&q)).map_or(0.0, |at| at.energy)
        })
    });
}

/// Right-hand sides of motion W with everything that the integrator adds; aim: 0.4 us each.
#[divan::bench(sample_count = 50)]
fn right_hand_side_with_integrator(bencher: Bencher) {
    let body = PointMass::new(1.0)
        .unwrap()
        .with_dead_force(Vector2::new(-8.0, -2.0))
        .unwrap();
    let q = Elastica.stable_at(&Vector2::new(-0.2, 0.5)).unwrap()[0];
    let options = Options::new(20.0).unwrap().with_tolerance(1e-10).unwrap();
    let run = || {
        let mut run = Run::new(&Elastica, &body, q, Vector2::zeros(), options).unwrap();
        while !matches!(run.next(), Some(Event::Stop(_))) {}
        run.cost().evaluations
    };
    bencher.counter(run() as usize).bench(run);
}

/// sn, cn, dn in one call; aim: 60 ns.
#[divan::bench(args = [0.9, 0.5, 0.1, 1e-2, 1e-4, 1e-8], sample_count = 200)]
fn jacobi_sn_cn_dn(bencher: Bencher, kc: f64) {
    bencher.counter(LINE).bench(|| {
        (0..LINE).fold(0.0, |sum, i| {
            sum + sn_cn_dn(black_box(6e-3 * i as f64), black_box(kc))
                .map_or(0.0, |v| v.0 + v.1 + v.2)
        })
    });
}

/// The equilibrium at a neighbouring pose, from a warm start; aim: 1 us.
#[divan::bench(args = [1e-3, 1e-5], sample_count = 200)]
fn warm_inversion(bencher: Bencher, away: f64) {
    let q = Vector2::new(0.7, 2.2);
    let pose = Elastica.point(&q).unwrap().pose + Vector2::new(away, -away);
    bencher.bench(|| {
        invert_near(&Elastica, black_box(&pose), black_box(&q), 1e-13)
            .unwrap()
            .q
    });
}

/// All equilibria at a point, lambda < 14; aim: 0.5 ms.
#[divan::bench(args = [(0.3, -0.5), (0.5, 0.0), (-0.3, 0.0), (0.9, 0.0), (0.1, -0.14), (0.9995, 0.01)], sample_count = 30)]
fn all_equilibria(bencher: Bencher, at: (f64, f64)) {
    bencher.bench(|| {
        equilibria_at(black_box(at.0), black_box(at.1), 14.0)
            .unwrap()
            .len()
    });
}

/// A viscous landing from the fold of the reference run; aim: 0.35 ms.
#[divan::bench(sample_count = 30)]
fn landing(bencher: Bencher) {
    let fold = snaprod::elastica::fold_at(1, 0.639250507)
        .unwrap()
        .equilibrium;
    let q = Vector2::new(fold.p, fold.w);
    bencher.bench(|| {
        let kernel = snaprod::manifold::fold_kernel(&Elastica.point(&q).unwrap().jacobian).unwrap();
        Elastica.settle(black_box(&q), &-kernel).unwrap()
    });
}

/// Cells times steps of finite volumes, a bar under a sine load with its ends; aim: 100 ns each.
#[divan::bench(args = [300, 5000], sample_count = 5)]
fn finite_volumes(bencher: Bencher, cells: usize) {
    let rubber = Material::new(&Stress::Mooney(24.0, 1.5), 1e-4).unwrap();
    let sine = End::Loaded(History::sine(1.7, std::f64::consts::TAU / 0.002, 0.0));
    let bar = Bar::new(rubber, 3.0, 0.0314, [End::Wall, sine]).unwrap();
    let run = || {
        let mut volumes = FiniteVolumes::new(&bar, cells).unwrap();
        volumes.advance(0.002).unwrap();
        volumes.updates()
    };
    bencher.counter(run() as usize).bench(run);
}
