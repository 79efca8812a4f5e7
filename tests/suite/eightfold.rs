//! Vectorised slopes, eight states at once, against slopes one by one: motions, samples, events and ledgers are the
//! same.

use crate::support::worst;
use nalgebra::{Vector2, vector};
use snaprod::Result;
use snaprod::body::{History, PointMass, Support, TimeLoad};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::manifold::{
    AxialConstraint, EquilibriumManifold, ManifoldPoint, Multivalued, Patch, Sheet,
};
use snaprod::math::registers::Registers;
use snaprod::motion::{Event, Options, Outcome, Phase, Run, Sample};

type Pair = Vector2<f64>;

/// The elastica with slopes of one state at a time, as DOP853 takes them.
pub struct OneByOne;

impl EquilibriumManifold<2> for OneByOne {
    fn point(&self, q: &Pair) -> Option<ManifoldPoint<2>> {
        Elastica.point(q)
    }

    fn index(&self, q: &Pair) -> Result<usize> {
        Elastica.index(q)
    }
}

impl Multivalued<2> for OneByOne {
    fn sheet(&self, q: &Pair) -> Sheet {
        Elastica.sheet(q)
    }

    fn tautness(&self, patch: Patch, q: &Pair) -> Option<f64> {
        Elastica.tautness(patch, q)
    }

    fn better_patch(&self, patch: Patch, q: &Pair) -> Patch {
        Elastica.better_patch(patch, q)
    }

    fn change_patch(&self, q: &Pair, from: Patch, to: Patch) -> Pair {
        Elastica.change_patch(q, from, to)
    }

    fn point_in(&self, patch: Patch, q: &Pair) -> Option<ManifoldPoint<2>> {
        Elastica.point_in(patch, q)
    }

    fn shaking_direction(&self, patch: Patch) -> Option<Pair> {
        Elastica.shaking_direction(patch)
    }

    fn axial_constraint(&self, pull: f64) -> Option<AxialConstraint<2>> {
        Elastica.axial_constraint(pull)
    }

    fn deflected_point(&self, pull: f64, across: f64) -> Option<(Patch, Pair)> {
        Elastica.deflected_point(pull, across)
    }

    fn stable_at(&self, pose: &Pair) -> Result<Vec<Pair>> {
        Elastica.stable_at(pose)
    }

    fn only_landing(&self, q: &Pair) -> Option<Pair> {
        Elastica.only_landing(q)
    }

    fn settle(&self, q: &Pair, leaving: &Pair) -> Result<Pair> {
        Elastica.settle(q, leaving)
    }
}

/// Results of a run.
struct Came {
    samples: Vec<Sample<2>>,
    snaps: Vec<f64>,
    bounces: Vec<[f64; 2]>,
    opened: f64,
    steps: u64,
    end: Phase<2>,
}

fn came(
    manifold: &impl Multivalued<2>,
    body: &PointMass<2>,
    (q, v): (Pair, Pair),
    duration: f64,
    samples: u32,
) -> Came {
    let options = Options::new(duration)
        .and_then(|o| o.with_tolerance(1e-11))
        .unwrap();
    let mut run = Run::new(manifold, body, q, v, options).unwrap();
    let first = run.now().ledger.total();
    let times: Vec<f64> = (1..=samples)
        .map(|k| duration * f64::from(k) / f64::from(samples))
        .collect();
    let mut came = Came {
        samples: Vec::new(),
        snaps: Vec::new(),
        bounces: Vec::new(),
        opened: 0.0,
        steps: 0,
        end: run.now().phase,
    };
    while let Some(event) = run.next() {
        match event {
            Event::Step { to, .. } => {
                while came.samples.len() < times.len() && times[came.samples.len()] <= to {
                    came.samples
                        .push(run.sample(times[came.samples.len()]).unwrap());
                }
            }
            Event::Snap(snap) => came.snaps.push(snap.t),
            Event::Bounce(bounce) => came.bounces.push([bounce.t, bounce.lambda]),
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            _ => {}
        }
        came.opened = worst([came.opened, (run.now().ledger.total() - first).abs()]);
    }
    came.steps = run.cost().steps;
    came.end = run.now().phase;
    came
}

/// Catches vectorised slopes, samples inside long steps, folds and bounces that differ from those of sequential
/// slopes; an omitted load in time or term of a moving clamp; and an unused fast path on wide registers: its steps are
/// less than half as many.
#[test]
fn eight_at_once_are_one_by_one() {
    let wide = Registers::in_use().is_some();
    let swinging = Support::<2>::new(vector![0.1, 0.2], 0.3)
        .and_then(|s| s.with_turning(History::sine(0.4, 2.0, 0.0)))
        .and_then(|s| s.with_translation(vector![1.0, 0.5], History::sine(0.1, 3.0, 0.2)))
        .unwrap();
    let plain = || PointMass::new(1.3).unwrap();
    let loaded = || {
        plain()
            .with_gravity(vector![0.4, -1.0])
            .and_then(|b| b.with_drag(0.3))
            .unwrap()
            .with_force(TimeLoad::sine(vector![0.5, 0.2], 3.0, 0.1).unwrap())
    };
    let at = |lambda: f64, kappa: f64| {
        let start = Equilibrium::from_lambda_kappa(lambda, kappa).unwrap();
        vector![start.p, start.w]
    };
    let thrown = vector![0.0, -0.5];
    let cases = [
        ("a snap and bounces", plain(), (at(6.3, 0.6), thrown), 3.0),
        (
            "loads and drag",
            loaded(),
            (at(1.9, 0.6), vector![0.3, 0.1]),
            6.0,
        ),
        (
            "a clamp that swings",
            loaded().with_support(swinging),
            (at(2.5, -0.5), vector![0.2, -0.4]),
            4.0,
        ),
        (
            "from a slack rod",
            plain(),
            (at(0.2, 0.3), vector![-0.4, 0.5]),
            3.0,
        ),
    ];
    for (name, body, start, duration) in cases {
        let (eight, one) = (
            came(&Elastica, &body, start, duration, 97),
            came(&OneByOne, &body, start, duration, 97),
        );
        assert_eq!(
            2 * eight.steps < one.steps,
            wide,
            "{name}: {} {}",
            eight.steps,
            one.steps
        );
        assert_eq!(eight.samples.len(), 97, "{name}");
        // Observation changes nothing.
        assert_eq!(
            came(&Elastica, &body, start, duration, 0).end,
            eight.end,
            "{name}"
        );
        for (a, b) in eight.samples.iter().zip(&one.samples) {
            let off = (a.pose - b.pose).norm() + (a.phase.v - b.phase.v).norm();
            assert!(off < 2e-9, "{name}: {off:e} at t = {}", a.phase.t);
        }
        assert_eq!(eight.snaps.len(), one.snaps.len(), "{name}");
        for (a, b) in eight.snaps.iter().zip(&one.snaps) {
            assert!((a - b).abs() < 1e-10, "{name}: snaps at {a} and {b}");
        }
        assert_eq!(eight.bounces.len(), one.bounces.len(), "{name}");
        for ([t, lambda], [u, mu]) in eight.bounces.iter().zip(&one.bounces) {
            let off = (t - u).abs() + (lambda - mu).abs() / mu;
            assert!(off < 1e-8, "{name}: bounces off by {off:e}");
        }
        assert!(
            eight.opened < 1e-9 && one.opened < 1e-9,
            "{name}: {:e} {:e}",
            eight.opened,
            one.opened
        );
    }
}
