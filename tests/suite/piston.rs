//! A heavy piston on a balloon: the motion of a body on a membrane, by the runs that move bodies on rods.

use crate::membranes::piston_on_balloon;
use gauss_quad::GaussLegendre;
use nalgebra::Vector1;
use snaprod::body::PointMass;
use snaprod::manifold::{EquilibriumManifold, Multivalued};
use snaprod::motion::{Event, Options, Outcome, Run};

/// Catches a fold of the gas that the run does not see, a wrong time or speed at the fold, and a ledger that the snap
/// opens. Independent route: the time by quadrature over the stretch, the speed by the energy.
#[test]
fn a_heavy_piston_makes_the_balloon_snap() {
    let piston = piston_on_balloon();
    let point = |x: f64| piston.point(&Vector1::new(x)).expect("a point");
    let (mass, start, speed) = (3.0, 1.4, 4.0);
    let fold = piston.folds()[0];
    let landing = piston
        .settle(&Vector1::new(fold), &Vector1::new(1.0))
        .expect("a landing");
    let squared = |x: f64| speed * speed + 2.0 * (point(start).energy - point(x).energy) / mass;
    let rule = GaussLegendre::new(60.try_into().expect("not zero"));
    let time = rule.integrate(start, fold, |x| {
        point(x).jacobian[(0, 0)] / squared(x).sqrt()
    });

    let body = PointMass::new(mass).expect("a mass");
    let options = Options::new(3.0)
        .and_then(|options| options.with_tolerance(1e-12))
        .expect("options");
    let mut run = Run::new(
        &piston,
        &body,
        Vector1::new(start),
        Vector1::new(speed),
        options,
    )
    .expect("a run");
    let total = run.now().ledger.total();
    let mut snaps = Vec::new();
    let outcome = loop {
        match run.next().expect("a run ends with a stop") {
            Event::Snap(snap) => snaps.push(snap),
            Event::Stop(outcome) => break outcome,
            _ => {}
        }
    };
    assert_eq!(outcome, Outcome::EndOfTime);
    let ledger = run.now().ledger;
    assert!((ledger.total() - total).abs() < 1e-10 * ledger.largest());
    let snap = snaps.first().expect("a snap");
    let off = |found: f64, reference: f64| (found / reference - 1.0).abs();
    assert!(off(snap.t, time) < 1e-9, "{} {time}", snap.t);
    assert!(off(snap.velocity[0], squared(fold).sqrt()) < 1e-9);
    assert!(off(snap.to.q[0], landing[0]) < 1e-9);
    let released = point(fold).energy - point(landing[0]).energy;
    assert!(released > 0.1 && off(snap.released, released) < 1e-9);
}
