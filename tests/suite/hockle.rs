//! Twisted rods under a strong pull: past the loss of stability under dead force to the fold, and down the snap.

use crate::support::falls;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, Attachment, Body, BodyMotion, Configuration, Joint, LightRod, Link, RodChart,
};
use snaprod::body::RigidBody;
use snaprod::full_mass::held_vibrations::{Massive, fold_form};
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, Outcome, Snap};
use snaprod::rod::{Rod, SectionMass};
use snaprod::section::Linear;

const MASS: f64 = 40.0;
const INERTIA: Vector3<f64> = Vector3::new(20.0, 20.0, 10.0);
const SPIN: f64 = 18.0;

/// Gravity, time of the first fold, energy released there (tools/ref_hockle.py).
const FIRST: (f64, f64, f64) = (5.0, 2.903_126_673_568, 364.964_819_302);

fn rod() -> Rod {
    let law = Linear::diagonal([1.1, 1.0], 0.75)
        .and_then(|law| law.with_axial(2e4))
        .and_then(|law| law.with_rest([0.1, -0.05], 0.0));
    Rod::new(1.0, law.unwrap()).unwrap()
}

/// A heavy body hangs on a rod and spins: it winds the rod up until the rod forms a loop.
fn hockle(gravity: f64) -> (Assembly, Configuration) {
    let (from, to) = (
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
    );
    let body = RigidBody::new(MASS, Matrix3::from_diagonal(&INERTIA))
        .and_then(|body| body.with_gravity(Vector3::new(0.0, 0.0, gravity)))
        .unwrap();
    let link = Link::new(rod(), from, to, Joint::Weld);
    let assembly = Assembly::new(vec![Body::rigid(body)], vec![link]).unwrap();
    let mut now = assembly.equilibrium(None, 1e-11).unwrap().now;
    now.bodies[0].twist[2] = SPIN;
    (assembly, now)
}

/// A rod at its fold: link, base wrench, pose of the end.
type Fold = (Link, Vector6<f64>, Isometry3<f64>);

const TOLERANCE: f64 = 1e-8;

/// All snaps until `duration`, with the rod at each fold; the ledger stays closed.
fn followed(gravity: f64, duration: f64) -> (Vec<Snap>, Vec<Fold>) {
    let (assembly, now) = hockle(gravity);
    let options = Options::new(duration)
        .and_then(|o| o.with_tolerance(TOLERANCE))
        .unwrap();
    let link = assembly.links()[0].clone();
    let mut run = AssemblyRun::new(assembly, &now, options).unwrap();
    let total = run.now().ledger().total();
    let (mut snaps, mut folds) = (Vec::new(), Vec::new());
    while let Some(event) = run.advance() {
        match event {
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            Event::Step { .. } => {
                let ledger = run.now().ledger();
                let opened = (ledger.total() - total).abs() / ledger.largest();
                assert!(opened < 1e3 * TOLERANCE, "g = {gravity}: {opened:.1e}");
            }
            Event::Snap(snap) => {
                if snaps.is_empty() {
                    falls(&run, &snap, snap.released);
                }
                let before = run.before_snap().unwrap();
                let pose = before.pose();
                let q = Vector6::from_column_slice(snap.from.q.as_slice());
                folds.push((link.clone(), q, pose));
                snaps.push(snap);
            }
            _ => {}
        }
    }
    (snaps, folds)
}

/// Catches a chart that ends where the rod becomes neutral under dead force, which is before its fold (at g = 5 at t =
/// 2.50); a confusion of equilibria, a false landing, a first fold too early or too late.
#[test]
#[ignore = "second tier: 14 s"]
fn a_twisted_rod_goes_through_its_folds() {
    for (gravity, duration, count) in [(5.0, 3.2, 3), (40.0, 0.5, 0)] {
        let (snaps, folds) = followed(gravity, duration);
        assert_eq!(snaps.len(), count, "g = {gravity}");
        // Relative error within a tenth of the bound, which falls with the tolerance.
        let (at, t, released) = FIRST;
        if at == gravity {
            let late = (snaps[0].t / t - 1.0).abs();
            let more = (snaps[0].released / released - 1.0).abs();
            assert!(
                late < TOLERANCE && more < TOLERANCE,
                "g = {gravity}: {late:.1e} {more:.1e}"
            );
        }
        for (snap, (link, q, held)) in snaps.iter().zip(&folds) {
            // The base wrench gives the same fold, at the same position of the end.
            let end = link.end(q, 1e-13).unwrap();
            let off = (end.pose.translation.vector - held.translation.vector).norm();
            assert!(off < 1e-6, "g = {gravity}: {off:.1e}");
            let pull = q[5].abs();
            let columns = Vector6::new(1.0, 1.0, 1.0, pull, pull, pull);
            let scaled = end.jacobian * Matrix6::from_diagonal(&columns);
            let values = scaled.singular_values();
            let part = values.min() / values.max();
            assert!(part < 1e-7, "g = {gravity}: {part:.1e}");
            assert!(snap.released > 0.0);
            assert_eq!((snap.from.index, snap.to.index), (0, 0));
            // At the landing the base wrench leads to the same end.
            let to = Vector6::from_column_slice(snap.to.q.as_slice());
            let end = link.end(&to, 1e-13).unwrap();
            let off = (end.pose.translation.vector - held.translation.vector).norm();
            let turned = end.pose.rotation.angle_to(&held.rotation);
            assert!(
                off.max(turned) < 1e-6,
                "g = {gravity}: {off:.1e} {turned:.1e}"
            );
            assert!((end.energy - snap.to.elastic).abs() < 1e-5 * end.energy);
        }
    }
}

/// Catches a missed approach of a taut rod to a fold: its mass is switched off before each fold with its energy
/// booked, and on again after the landing, and at no other time.
#[test]
#[ignore = "second tier: 20 s"]
fn the_mass_of_a_twisted_rod_is_given_up_before_its_folds() {
    let (assembly, now) = hockle(2.0);
    let light = LightRod {
        sections: SectionMass {
            mass: 1e-4 * MASS,
            rotary: Vector3::new(2e-6, 1e-6, 3e-6),
        },
        followed: false,
    };
    let assembly = assembly.with_light_rods(vec![Some(light)]).unwrap();
    let options = Options::new(2.3).and_then(|o| o.with_tolerance(TOLERANCE));
    let mut run = AssemblyRun::new(assembly, &now, options.unwrap()).unwrap();
    let total = run.now().ledger().total();
    let (mut since, mut snaps, mut last, mut unfelt) = (None, 0, 0.0, 0.0);
    while let Some(event) = run.advance() {
        let ledger = run.now().ledger();
        let opened = (ledger.total() - total).abs() / ledger.largest();
        assert!(opened < 1e3 * TOLERANCE, "{opened:.1e}");
        if let Event::Snap(snap) = event {
            let since: f64 = since.expect("given up before the fold");
            assert!(snap.t - since < 0.02, "{} {since}", snap.t);
            snaps += 1;
        }
        let is_felt = ledger.rod_kinetic > 0.0;
        unfelt += if is_felt {
            0.0
        } else {
            run.now().time() - last
        };
        last = run.now().time();
        since = (!is_felt).then(|| since.unwrap_or(run.now().time()));
    }
    assert_eq!((snaps, since), (2, None));
    // By the normal form alone a fold seems near from 1.506 to 1.620, but the rod does not reach it.
    assert!(unfelt < 0.025, "{unfelt}");
}

/// The collocated layer and the layer by the base wrench, which is accurate here, lead to the same rest. Folds have
/// the same normal form by either: A, B, M0, D0 depend on the length of the critical direction, the delays do not.
#[test]
#[ignore = "second tier: 18 s"]
fn taut_rods_fall_as_slack_ones_do() {
    let (snaps, folds) = followed(2.0, 2.3);
    for (snap, (link, q, held)) in snaps.iter().zip(&folds) {
        let mut other = link.clone();
        let sprung = RodChart::Taut { spring: 1.0 };
        other.set_chart(sprung);
        let rest = other.settle(q, held, 1e-11).unwrap();
        let off = rest - Vector6::from_column_slice(snap.to.q.as_slice());
        assert!(off.norm() < 1e-6 * rest.norm(), "{:.1e}", off.norm());
        let sections = SectionMass {
            mass: 1e-3,
            rotary: Vector3::new(2e-6, 1e-6, 3e-6),
        };
        let massive = Massive::new(link.rod(), None, sections).unwrap();
        let mut body = BodyMotion::at_rest(*held);
        body.twist = Vector6::new(0.3, -0.2, 0.1, 0.4, 0.5, -0.7);
        let [by_base, taut] =
            [(link, RodChart::BaseWrench), (&other, sprung)].map(|(link, chart)| {
                let mut link = link.clone();
                link.set_chart(chart);
                let point = link.point(0.0, &[body], q, 1e-13).unwrap();
                assert_eq!(point.end.is_taut(), chart.is_taut());
                fold_form(&massive, &link, q, &point).unwrap().0
            });
        for (a, b) in [
            (by_base.inertial(1e-3), taut.inertial(1e-3)),
            (by_base.viscous(1e-3), taut.viscous(1e-3)),
            (by_base.friction / by_base.mass, taut.friction / taut.mass),
        ] {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }
}
