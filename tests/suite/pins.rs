//! Rods between two ball joints, springs along their chords: against Euler's elastica in closed form, differences, and a ledger.

use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Carrier, Configuration, Link, Place};
use snaprod::body::Body;
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, Outcome};
use snaprod::rod::Rod;
use snaprod::section::Linear;
use std::f64::consts::PI;

fn straight(bending: [f64; 2], axial: f64) -> Rod {
    let law = Linear::diagonal(bending, 0.8)
        .and_then(|law| law.rigid([true, true, false]))
        .and_then(|law| law.with_axial(axial))
        .expect("a law");
    Rod::new(1.0, law).expect("a rod")
}

fn alone(rod: Rod) -> Link {
    let place = Attachment::ground(Isometry3::identity());
    Link::pinned(rod, place, Attachment::body(0, Isometry3::identity()))
}

/// Catches an index that counts the spin, or not the turning of the base: Euler's column between two hinges buckles about its weaker axis
/// at pi^2 EI/L^2, then about the other.
#[test]
fn a_column_between_hinges_buckles_where_euler_says() {
    let link = alone(straight([1.0, 1.5], 1e4));
    for (push, index) in [(0.9, 0), (1.2, 1), (1.7, 2), (-3.0, 0)] {
        let q = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -push * PI * PI / link.units()[5]);
        let end = link.end(&q, 1e-12).expect("an end").pose;
        assert_eq!(
            link.index(&q, &end, 1e-11).expect("an index"),
            index,
            "{push}"
        );
    }
}

/// Catches a wrong chord, couple or Jacobian of a rod that has buckled, and the spin of a round one in its own curve: Euler's elastica,
/// P = 4 K^2, chord 2 E/K - 1 at k = sin(alpha/2), found again from beside it.
#[test]
fn a_buckled_round_rod_is_eulers_elastica() {
    let link = alone(straight([1.0, 1.0], 1e9));
    for alpha in [0.6, 1.1_f64] {
        let k = (0.5 * alpha).sin();
        let (big_k, big_e) = complete(k);
        let (push, chord) = (4.0 * big_k * big_k, 2.0 * big_e / big_k - 1.0);
        let turn = 0.7_f64;
        let n = -push
            * Vector3::new(
                alpha.sin() * turn.cos(),
                alpha.sin() * turn.sin(),
                alpha.cos(),
            );
        let q = Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
        let end = link.end(&q, 1e-12).expect("an end");
        let length = end.pose.translation.vector.norm();
        assert!((length - chord).abs() < 1e-7, "{length} {chord}");
        assert!(end.couple.norm() < 1e-6, "{:e}", end.couple.norm());
        let beside = q + Vector6::new(0.0, 0.0, 0.0, 0.05, 0.02, -0.04);
        let held = Isometry3::translation(0.0, 0.0, chord);
        let found = link.polished(&beside, &held, 1e-12).expect("the elastica");
        let force = found.fixed_rows::<3>(3).norm();
        assert!((force - push).abs() < 1e-5 * push, "{force} {push}");
    }
}

/// K and E by the arithmetic-geometric mean.
fn complete(k: f64) -> (f64, f64) {
    let (mut a, mut b, mut c, mut power, mut sum) =
        (1.0, (1.0 - k * k).sqrt(), k, 0.5, 0.5 * k * k);
    while f64::abs(c) > 1e-16 {
        (a, b, c) = (0.5 * (a + b), f64::sqrt(a * b), 0.5 * (a - b));
        power *= 2.0;
        sum += power * c * c;
    }
    let big_k = 0.5 * PI / a;
    (big_k, big_k * (1.0 - sum))
}

/// A mass on three curved rods that are free to turn at both ends.
fn tripod() -> Assembly {
    let law = || {
        Linear::diagonal([1.0, 1.3], 0.8)
            .and_then(|law| law.with_shear([90.0, 100.0]))
            .and_then(|law| law.with_axial(300.0))
            .and_then(|law| law.with_rest([0.8, -0.3], 0.4))
            .expect("a law")
    };
    let mass = Body::new(1.0)
        .and_then(|body| body.with_dead_force(Vector3::new(0.1, -0.2, -0.6)))
        .expect("a mass");
    let links = (0..3).map(|k| {
        let around = UnitQuaternion::from_scaled_axis(Vector3::z() * (2.1 * f64::from(k)));
        let foot = around * Vector3::new(0.6, 0.0, 0.0);
        let place = Isometry3::from_parts(foot.into(), around);
        let rod = Rod::new(1.0, law()).expect("a rod");
        Link::pinned(
            rod,
            Attachment::ground(place),
            Attachment::body(0, Isometry3::identity()),
        )
    });
    Assembly::new(vec![Carrier::point(mass)], links.collect()).expect("an assembly")
}

/// Catches a wrong derivative of a force that turns with its chord, a couple at a joint, and energy that is lost in motion: stiffness by
/// differences, the balance at rest, the ledger of a motion.
#[test]
fn a_mass_on_three_hinged_rods() {
    let assembly = tripod();
    let start = assembly.held(
        vec![Place::at_rest(Isometry3::translation(0.0, 0.0, 0.7))],
        1e-11,
    );
    let found = assembly
        .equilibrium(Some(&start), 1e-11)
        .expect("an equilibrium");
    assert_eq!(found.index, 0);
    assert!(found.residual < 1e-10);
    let charts = |bodies: &[Place]| -> Vec<Vector6<f64>> {
        let links = assembly.links().iter().zip(&found.now.charts);
        links
            .map(|(link, q)| {
                let tip = bodies[0].pose.translation.vector - link.from().place.translation.vector;
                let held = Isometry3::translation(0.0, 0.0, tip.norm());
                link.polished(q, &held, 1e-13).expect("a chart")
            })
            .collect()
    };
    let balance = |shift: Vector3<f64>| -> DVector<f64> {
        let mut pose = found.now.bodies[0].pose;
        pose.translation.vector += shift;
        let bodies = vec![Place::at_rest(pose)];
        let points = assembly
            .points(0.0, &bodies, &charts(&bodies), 1e-13)
            .expect("rods");
        for point in &points {
            let [base, _] = point.wrenches();
            let (force, chord) = (
                base.fixed_rows::<3>(3),
                pose.translation.vector - point.base.pose.translation.vector,
            );
            assert!(force.cross(&chord).norm() < 1e-9 && base.fixed_rows::<3>(0).norm() < 1e-9);
        }
        assembly.balance(0.0, &bodies, &points)
    };
    let points = assembly
        .points(0.0, &found.now.bodies, &found.now.charts, 1e-13)
        .expect("rods");
    let stiffness = assembly
        .stiffness(0.0, &found.now.bodies, &points)
        .expect("a stiffness")
        .matrix;
    let h = 1e-3;
    for k in 0..3 {
        let odd = |by: f64| {
            let mut shift = Vector3::zeros();
            shift[k] = by * h;
            balance(shift) - balance(-shift)
        };
        let column = (odd(1.0) * 8.0 - odd(2.0)) / (-12.0 * h);
        let off = (column - stiffness.column(k)).norm();
        assert!(off < 1e-6 * stiffness.norm(), "column {k}: {off:e}");
    }
    let mut now: Configuration = found.now;
    now.bodies[0].twist = Vector6::new(0.0, 0.0, 0.0, 0.2, -0.3, 0.1);
    let options = Options::new(0.5)
        .and_then(|o| o.with_tolerance(1e-9))
        .expect("options");
    let mut run = AssemblyRun::new(assembly, &now, options).expect("a run");
    let total = run.now().ledger().total();
    let mut steps = 0;
    while let Some(event) = run.advance() {
        match event {
            Event::Step { .. } => steps += 1,
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
        let at = run.sample_now();
        let opened = (run.now().ledger().total() - total).abs();
        assert!(
            opened < 1e-8 && at.drift() < 1e-7,
            "{opened:e} {:e}",
            at.drift()
        );
    }
    assert!(steps > 3);
}
