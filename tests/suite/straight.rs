//! Elastic runs that begin with a straight rod, or next to one.

use nalgebra::{Vector2, vector};
use snaprod::body::{Body, History, TimeLoad};
use snaprod::elastica::Elastica;
use snaprod::elastica::chart::amplitude;
use snaprod::motion::{Cause, Event, Options, Outcome, Run, Sample};

fn options(duration: f64, tolerance: f64) -> Options {
    Options::new(duration)
        .and_then(|o| o.with_tolerance(tolerance))
        .unwrap()
}

fn loaded(force: [f64; 2]) -> Body<2> {
    let body = Body::new(1.0).unwrap();
    body.with_dead_force(force.into()).unwrap()
}

/// A run of the straight rod: its states at `times` (the last is its end), and the worst error of its ledger.
fn let_go(body: &Body<2>, across: f64, tolerance: f64, times: &[f64]) -> (Vec<Sample<2>>, f64) {
    let options = options(times[times.len() - 1], tolerance);
    let mut run = Run::straight(body, vector![0.0, across], options).unwrap();
    let given = run.given();
    assert_eq!((given.phase.t, given.pose), (0.0, vector![1.0, 0.0]));
    let (mut samples, mut worst) = (Vec::new(), 0f64);
    while let Some(event) = run.next() {
        if let Event::Step { to, .. } = event {
            while samples.len() < times.len() && times[samples.len()] <= to {
                samples.push(run.sample(times[samples.len()]).unwrap());
            }
        }
        if let Event::Stop(outcome) = event {
            assert_eq!(outcome, Outcome::EndOfTime);
        }
        let error = run.now().ledger.total() - given.ledger.total();
        assert!(error.is_finite());
        worst = worst.max(error.abs());
    }
    assert_eq!(samples.len(), times.len());
    (samples, worst)
}

/// (x, y, vx, vy) at t = 1 by an independent integration in the position itself, not in the chart: the rod's force by
/// Newton's method on its differential equation at 24 Gauss nodes, from the first terms of the series at two early times
/// that agree to 1e-8 (loads) and 2e-10 (velocities); `tools/ref_straight.py`.
const INDEPENDENT: [([f64; 2], f64, [f64; 4]); 4] = [
    (
        [0.0, -1.0595],
        0.0,
        [
            0.904_257_550_9,
            -0.388_919_263_5,
            -0.267_210_181_6,
            -0.508_712_557_6,
        ],
    ),
    (
        [4.0, 2.0],
        0.0,
        [
            0.866_015_062_8,
            0.460_620_092_2,
            -0.107_206_844_4,
            0.166_343_533_0,
        ],
    ),
    (
        [0.0, 0.0],
        1.0,
        [
            0.814_698_588_76,
            0.522_318_720_26,
            0.112_636_117_2,
            -0.135_257_547_8,
        ],
    ),
    (
        [-1.0, 0.0],
        0.8,
        [
            0.807_958_744_51,
            0.528_098_357_08,
            -0.099_162_084_0,
            0.116_231_864_6,
        ],
    ),
];

/// Catches a wrong series: a wrong pull at the start would leave the mass shaking along the rod.
#[test]
fn a_straight_rod_let_go_moves_as_an_independent_integration_has_it() {
    for (force, across, expected) in INDEPENDENT {
        let (samples, ledger) = let_go(&loaded(force), across, 1e-12, &[1.0]);
        let end = samples[0];
        let state = [end.pose[0], end.pose[1], end.phase.v[0], end.phase.v[1]];
        for (a, b) in state.iter().zip(expected) {
            assert!((a - b).abs() < 2e-8, "{force:?}, {across}: {state:?}");
        }
        assert!(ledger < 1e-12, "{force:?}, {across}: {ledger}");
    }
}

/// Catches a start whose length matters: the state within the opening of a long run, at its end, and beyond it, against
/// runs whose opening was cut short by their duration or by a break of a load.
#[test]
fn the_length_of_the_opening_does_not_matter() {
    let sine = || TimeLoad::sine(vector![0.3, 2.0], 3.0, 0.0).unwrap();
    let nothing = History::Table(vec![[0.0, 0.0], [0.11, 0.0], [0.2, 0.0]]);
    let nothing = TimeLoad::new(vector![1.0, 0.0], nothing).unwrap();
    for across in [0.0, 0.7] {
        let body = Body::new(0.5)
            .unwrap()
            .with_drag(0.4)
            .unwrap()
            .with_force(sine());
        let (long, _) = let_go(&body, across, 1e-13, &[0.05, 0.3, 0.8]);
        let (short, _) = let_go(&body, across, 1e-13, &[0.05]);
        let (cut, _) = let_go(
            &body.clone().with_force(nothing.clone()),
            across,
            1e-13,
            &[0.05, 0.3, 0.8],
        );
        let pairs = [
            (&long[0], &short[0]),
            (&long[0], &cut[0]),
            (&long[1], &cut[1]),
            (&long[2], &cut[2]),
        ];
        for (a, b) in pairs {
            assert!(
                (a.pose - b.pose).norm() < 1e-11 && (a.phase.v - b.phase.v).norm() < 1e-10,
                "{a:?} {b:?}"
            );
            let (work, loss) = (
                a.ledger.work - b.ledger.work,
                a.ledger.dissipated - b.ledger.dissipated,
            );
            assert!(work.abs() < 1e-12 && loss.abs() < 1e-12);
        }
    }
}

/// The strip of 0.3 m x 20 x 0.5 mm with 50 g, held horizontally and let go, undamped, in units of the rod (force 1.0595).
/// Catches a start that shakes: the mass swings down, and comes back to where it began within 1e-3.
#[test]
fn the_strip_let_go_swings_back() {
    let bending = 200e9 * 0.02 * 0.0005_f64.powi(3) / 12.0;
    let weight = 0.05 * 9.81 * 0.3 * 0.3 / bending;
    let (samples, ledger) = let_go(&loaded([0.0, -weight]), 0.0, 1e-10, &[1.7, 3.3]);
    assert!(ledger < 1e-10, "{ledger}");
    assert!(samples[0].pose[1] < -0.5 && (samples[1].pose - vector![1.0, 0.0]).norm() < 2e-3);
}

/// Catches a refusal that does not say which field makes it run.
#[test]
fn starts_that_are_not_determined_are_refused_with_the_reason() {
    let refused = |force: [f64; 2], v: [f64; 2]| -> String {
        let body = loaded(force);
        let run = Run::straight(&body, v.into(), options(1.0, 1e-10));
        run.err().expect("refused").to_string()
    };
    assert!(refused([0.0, 1.0], [-0.1, 0.0]).contains("first component must be 0"));
    assert!(refused([1.0, 0.0], [0.0, 0.0]).contains("nothing acts across"));
    assert!(refused([-2.5, 0.1], [0.0, 0.0]).contains("Euler"));
    assert!(refused([5000.0, 1.0], [0.0, 0.0]).contains("3600"));
    // Just below Euler's load it runs.
    let_go(&loaded([-2.4, 0.1]), 0.0, 1e-10, &[0.5]);
}

fn chart(p: f64, lam: f64) -> Vector2<f64> {
    vector![p, amplitude(p, lam).unwrap()]
}

/// Catches a run that goes on with an open ledger: of a rod with a tight loop, the chart at lambda = 60, p = -30 lost 2 % of
/// the energy by t = 5e-4 and ended well.
#[test]
fn a_loop_beyond_double_precision_is_refused_with_the_reason() {
    let body = Body::new(1.0).unwrap();
    let run = |p: f64| {
        Run::new(
            &Elastica,
            &body,
            chart(p, 60.0),
            vector![0.0, 0.0],
            options(5e-4, 1e-10),
        )
    };
    for p in [-30.0, -27.0] {
        let error = run(p).err().expect("refused");
        assert!(
            error.is_ill_conditioned() && error.to_string().contains("loop"),
            "{error}"
        );
    }
    let mut fine = run(-16.0).unwrap();
    let total = fine.now().ledger.total();
    assert_eq!(fine.by_ref().last(), Some(Event::Stop(Outcome::EndOfTime)));
    assert!((fine.now().ledger.total() - total).abs() < 1e-10 * total);
}

/// Catches a message that blames anything but the start: at 6e-11 from the straight rod the mass shakes along the rod with a
/// period of 1e-11, which no run can follow to t = 1.
#[test]
fn a_start_next_to_the_straight_rod_says_why_it_does_not_run() {
    let body = Body::new(1.0).unwrap();
    let mut run = Run::new(
        &Elastica,
        &body,
        chart(1e-10, 1.0),
        vector![0.0, 0.0],
        options(1.0, 1e-10),
    )
    .unwrap();
    let Some(Event::Stop(Outcome::Stuck(stuck))) = run.by_ref().last() else {
        panic!("a run that cannot end");
    };
    let why = stuck.to_string();
    assert!(matches!(stuck.cause, Cause::TooSlow { .. }));
    assert!(
        why.contains("straight rod") && why.contains("kappa"),
        "{why}"
    );
    assert!(run.cost().steps <= 100_000);
}

/// Catches steps wasted where the undamped strip comes back to the straight rod, to 7e-9 of its length, and bounces along it 1500
/// times within 0.04 s: in the chart (p, w) that took 608,000 steps. The position after 1 s is that found in this chart with the
/// tolerance 1e-12.
#[test]
fn the_undamped_strip_runs_for_a_second() {
    let bending = 200e9 * 0.02 * 0.0005_f64.powi(3) / 12.0;
    let (length, time) = (0.3, (0.05 * 0.3_f64.powi(3) / bending).sqrt());
    let body = loaded([0.0, -0.05 * 9.81 * length * length / bending]);
    let mut run = Run::straight(&body, vector![0.0, 0.0], options(1.0 / time, 1e-10)).unwrap();
    let start = run.given().ledger.total();
    assert_eq!(run.by_ref().last(), Some(Event::Stop(Outcome::EndOfTime)));
    let end = run.now();
    let off = end.pose - vector![0.260_798_199_801, -0.134_722_768_219] / length;
    assert!(off.amax() < 1e-10, "{off:?}");
    assert!((end.ledger.total() - start).abs() < 1e-11);
    let cost = run.cost();
    assert!(
        cost.steps < 250_000 && cost.evaluations < 3_300_000,
        "{cost:?}"
    );
}

/// Catches landings on the fold's own twin: next to the straight rod 1 - x has no digits in the pose, and a rod that started with
/// kappa = 1e-3, or 1e-2, snapped ten thousand times at one instant, each time a little uphill.
#[test]
fn a_rod_next_to_the_straight_one_snaps_once() {
    let body = Body::new(1.0).unwrap();
    for (kappa, lambda) in [(1e-3, 2.0), (1e-2, 1.0)] {
        let start = chart(f64::atanh(kappa), lambda);
        let mut asked = options(1.0, 1e-10);
        asked.max_snaps = 10;
        let mut run = Run::new(&Elastica, &body, start, vector![0.0, 0.0], asked).unwrap();
        let total = run.now().ledger.total();
        let events: Vec<_> = run.by_ref().collect();
        assert_eq!(events.last(), Some(&Event::Stop(Outcome::EndOfTime)));
        let mut snaps = events.iter().filter_map(|event| match event {
            Event::Snap(snap) => Some(snap),
            _ => None,
        });
        let snap = snaps.next().expect("it comes to a fold");
        assert!(snaps.next().is_none() && snap.to.index == 0);
        assert!(snap.from.q[0] * snap.to.q[0] < 0.0, "{snap:?}");
        assert!(
            0.0 < snap.to.elastic && snap.to.elastic < 0.5 * snap.from.elastic,
            "{snap:?}"
        );
        assert!((run.now().ledger.total() - total).abs() < 1e-11);
    }
}
