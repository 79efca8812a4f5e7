//! Inextensible rods that start straight: the end cannot move axially, and an axial wrench causes no motion.

use crate::viscous_identities::sampled;
use nalgebra::{Isometry3, Vector1, Vector2, Vector3};
use snaprod::body::PointMass;
use snaprod::motion::viscoelastic::{ViscousRun, ViscousStart};
use snaprod::motion::{Options, Outcome};
use snaprod::section::Linear;
use snaprod::section::rate::{Carreau, RateLaw, Viscoelastic, Viscosity};
use snaprod::viscoelastic::kinematics::Local;
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use snaprod::viscoelastic::space::Space;
use std::sync::Arc;

/// EI = 1, viscosity 0.1 that thins or thickens with the exponent p from the rate 1 on.
fn section(p: f64) -> Viscoelastic {
    let eta = 0.1;
    let h = Viscosity::diagonal([eta; 2], eta).unwrap();
    let rate: Arc<dyn RateLaw> = Arc::new(Carreau::new(h, eta, p).unwrap());
    let elastic = Arc::new(Linear::diagonal([1.0; 2], 1.0).unwrap());
    Viscoelastic::new(elastic, rate).unwrap()
}

/// Position and velocity of the end, and how far the ledger opened.
type End = (Vector2<f64>, Vector2<f64>, f64);

/// A rod bent by `bend` (1 - s) whose end is thrown across at speed 1, one unit of time later. Of the steps tried fewer
/// may fail than succeed.
fn thrown(p: f64, bend: f64, tolerance: f64) -> End {
    let material = Material::new(section(p), [0]).unwrap();
    let body = PointMass::new(1.0).unwrap();
    let start = ViscousStart {
        strain: &|s| Vector1::new(bend * (1.0 - s)),
        relaxed: None,
        velocity: Vector2::new(0.0, -1.0),
    };
    let mut run = ViscousRun::new(Plane, material, &body, &start, options(1.0, tolerance)).unwrap();
    let (_, outcome) = sampled(&mut run, &[]);
    assert_eq!(outcome, Outcome::EndOfTime);
    let work = run.cost();
    assert!(
        2 * work.rejected <= work.steps + 20,
        "p = {p}, bend {bend:e}: {work:?}"
    );
    let (first, last) = (run.first(), run.now());
    let opened = (last.ledger.total() - first.ledger.total()).abs();
    (last.pose, last.velocity, opened)
}

fn options(duration: f64, tolerance: f64) -> Options {
    let options = Options::new(duration).and_then(|o| o.with_tolerance(tolerance));
    let mut options = options.unwrap();
    options.max_steps = 2000;
    options
}

/// Catches nonlinear friction that stalls or wastes steps where G is nearly singular: the motion of the straight rod
/// is the limit of those of bent ones, at every tolerance, in the plane and in space.
#[test]
fn power_laws_leave_the_straight_rod() {
    for p in [0.5, 1.0, 2.0] {
        let (at, v, opened) = thrown(p, 0.0, 1e-10);
        assert!(opened <= 1e-9, "p = {p}: the ledger opens by {opened:e}");
        for (bend, tolerance) in [(0.0, 1e-6), (0.0, 1e-8), (1e-6, 1e-10), (-1e-9, 1e-10)] {
            let (near, near_v, opened) = thrown(p, bend, tolerance);
            let off = (near - at).norm().max((near_v - v).norm());
            let bound = 3.0 * bend.abs() + 5.0 * tolerance + 1e-9;
            assert!(
                off <= bound,
                "p = {p}, bend {bend:e}, tolerance {tolerance:e}: off by {off:e}"
            );
            assert!(
                opened <= 10.0 * tolerance + 1e-9,
                "p = {p}: ledger {opened:e}"
            );
        }
        let material = Material::new(section(p), [0, 1, 2]).unwrap();
        let body = PointMass::<3>::new(1.0).unwrap();
        let start = ViscousStart {
            strain: &|_| Local::<3>::zeros(),
            relaxed: None,
            velocity: Vector3::new(0.6, 0.8, 0.0),
        };
        let kinematics = Space::<3, 3>::new();
        let mut run =
            ViscousRun::new(kinematics, material, &body, &start, options(1.0, 1e-8)).unwrap();
        let (_, outcome) = sampled(&mut run, &[]);
        assert_eq!(outcome, Outcome::EndOfTime);
        let end: &Isometry3<f64> = &run.now().pose;
        let across = Vector3::new(0.6, 0.8, 0.0) * -at.y;
        let off = (end.translation.vector - across - Vector3::z() * at.x).norm();
        assert!(off <= 1e-7, "p = {p}, in space: off by {off:e}");
    }
}

/// A typical first problem: a steel strip, 0.3 m x 20 mm x 0.5 mm, E = 200 GPa, with 50 g on its end, released
/// horizontally, damped by 1 ms. Catches a start from rest at which tension grows as t^2; the position after 1 s is
/// that of an independent computation.
#[test]
fn strip_let_go() {
    let (length, stiffness, mass): (f64, f64, f64) =
        (0.3, 200e9 * 0.02 * 0.0005f64.powi(3) / 12.0, 0.05);
    let time = (mass * length.powi(3) / stiffness).sqrt();
    let h = Viscosity::diagonal([1e-3 / time; 2], 1e-3 / time).unwrap();
    let rate = Arc::new(snaprod::section::rate::KelvinVoigt::new(h));
    let elastic = Arc::new(Linear::diagonal([1.0; 2], 1.0).unwrap());
    let section = Viscoelastic::new(elastic, rate).unwrap();
    let material = Material::new(section, [0]).unwrap();
    let weight = Vector2::new(0.0, -9.81 * time * time / length);
    let body = PointMass::new(1.0)
        .and_then(|b| b.with_gravity(weight))
        .unwrap();
    let start = ViscousStart {
        strain: &|_| Vector1::zeros(),
        relaxed: None,
        velocity: Vector2::zeros(),
    };
    let options = options(1.0 / time, 1e-10);
    let mut run = ViscousRun::new(Plane, material, &body, &start, options).unwrap();
    let (_, outcome) = sampled(&mut run, &[]);
    assert_eq!(outcome, Outcome::EndOfTime);
    let off = run.now().pose * length - Vector2::new(0.261_597_932_3, -0.133_441_459_7);
    assert!(off.amax() <= 1e-10, "off by {off:?} m");
}
