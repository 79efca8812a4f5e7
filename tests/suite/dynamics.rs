//! Motions with snaps: reference runs, ledger, starts on folds, walls, symmetries.

use nalgebra::{Vector2, vector};
use snaprod::body::{PointMass, TimeLoad};
use snaprod::elastica::chart::amplitude;
use snaprod::elastica::{Elastica, FoldPoint, equilibria_at, fold_at, fold_curve, folds};
use snaprod::manifold::{EquilibriumManifold, Multivalued};
use snaprod::motion::{Event, Options, Outcome, Run, Sample, Snap};

type Pair = Vector2<f64>;

/// Record of a run.
struct Track {
    /// Samples at the requested times.
    samples: Vec<Sample<2>>,
    snaps: Vec<Snap>,
    end: Sample<2>,
    /// Largest |total - total at the start| over all steps, and the largest term.
    closing: f64,
    largest: f64,
    /// Largest |r|.
    radius: f64,
    /// Largest decrease of the dissipated energy.
    regained: f64,
}

fn free() -> PointMass<2> {
    PointMass::new(1.0).unwrap()
}

fn chart(p: f64, lam: f64) -> Pair {
    vector![p, amplitude(p, lam).unwrap()]
}

/// Runs to `duration`, sampling at `times` (ascending); every run must reach its end.
fn track(
    body: &PointMass<2>,
    q: Pair,
    v: Pair,
    duration: f64,
    tolerance: f64,
    times: impl IntoIterator<Item = f64>,
) -> Track {
    let mut options = Options::new(duration)
        .and_then(|o| o.with_tolerance(tolerance))
        .unwrap();
    options.max_steps = 100_000;
    let mut run = Run::new(&Elastica, body, q, v, options).unwrap();
    let start = run.now();
    let energy = start.ledger.total();
    let mut out = Track {
        samples: Vec::new(),
        snaps: Vec::new(),
        closing: 0.0,
        largest: start.ledger.largest(),
        end: start,
        radius: 0.0,
        regained: 0.0,
    };
    let mut times = times.into_iter().peekable();
    let mut dissipated = 0.0;
    while let Some(event) = run.next() {
        match event {
            Event::Step { to, .. } => {
                while let Some(t) = times.next_if(|&t| t <= to) {
                    out.samples
                        .push(run.sample(t).expect("inside the last step"));
                }
            }
            Event::Snap(snap) => out.snaps.push(snap),
            Event::Bounce(_) => {}
            Event::Contact(_) | Event::RodContact(_) => {
                panic!("a run without obstacles has no contact")
            }
            Event::Layer(layer) => panic!("an elastic rod has no layers: {layer:?}"),
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
        }
        let now = run.now();
        let error = (now.ledger.total() - energy).abs();
        // A NaN must not pass for a small number.
        assert!(error.is_finite() && now.pose.norm().is_finite());
        out.closing = out.closing.max(error);
        out.largest = out.largest.max(now.ledger.largest());
        out.radius = out.radius.max(now.pose.norm());
        out.regained = out.regained.max(dissipated - now.ledger.dissipated);
        dissipated = now.ledger.dissipated;
        out.end = now;
    }
    assert!(times.peek().is_none(), "a sample was left out");
    out
}

/// Rows (t, x, y, vx, vy) of a reference motion computed with 30 digits; fails on a missing or short file.
fn reference(name: &str) -> Vec<[f64; 5]> {
    let path = format!(
        "{}/tests/data/motion_{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(data["motion"], name);
    let rows: Vec<[f64; 5]> = serde_json::from_value(data["rows"].clone()).unwrap();
    assert_eq!(rows.len(), 201);
    assert_eq!((rows[0][0], rows[200][0]), (0.0, 20.0));
    rows
}

/// Worst distance, in position and velocity, from a reference motion that starts at rest on the
/// equilibrium of lowest energy.
fn distance_from_reference(name: &str, body: &PointMass<2>, tolerance: f64) -> f64 {
    let rows = reference(name);
    let [_, x, y, ..] = rows[0];
    let pose = vector![x, y];
    let q = Elastica.stable_at(&pose).unwrap()[0];
    let track = track(
        body,
        q,
        vector![0.0, 0.0],
        20.0,
        tolerance,
        rows.iter().map(|r| r[0]),
    );
    assert!(track.snaps.is_empty());
    assert!(track.radius < 1.0);
    rows.iter()
        .zip(&track.samples)
        .map(|(row, sample)| {
            let r = (sample.pose - vector![row[1], row[2]]).norm();
            let v = (sample.phase.v - vector![row[3], row[4]]).norm();
            assert!(r.is_finite() && v.is_finite());
            r.max(v)
        })
        .fold(0.0, f64::max)
}

/// Catches any error of force, chart, time transformation or dense output on a smooth motion.
#[test]
fn the_smooth_motion_under_a_dead_load_is_the_reference() {
    let body = free().with_dead_force(vector![-8.0, -2.0]).unwrap();
    let error = distance_from_reference("W", &body, 1e-13);
    assert!(error < 1e-10, "{error:e}");
}

/// Catches loss of accuracy at the taut wall: 78 bounces.
#[test]
fn the_motion_of_78_bounces_is_the_reference() {
    let error = distance_from_reference("B", &free(), 1e-13);
    assert!(error < 1e-8, "{error:e}");
}

/// Catches loss of accuracy where the contact force is large: 44 bounces, force to 14,810.
#[test]
fn the_motion_of_44_hard_bounces_is_the_reference() {
    let error = distance_from_reference("H", &free(), 1e-13);
    assert!(error < 1e-7, "{error:e}");
}

/// The start of the reference run with a snap (theory 2.6).
fn snapping() -> (Pair, Pair) {
    (chart(0.6f64.atanh(), 6.3), vector![0.0, -0.5])
}

/// Catches a fold located by interpolation, a wrong landing, a force of the wrong sign after it.
#[test]
fn the_snap_is_the_reference() {
    let (q, v) = snapping();
    let track = track(&free(), q, v, 3.0, 1e-12, []);
    assert_eq!(track.snaps.len(), 1);
    let snap = &track.snaps[0];
    assert!((snap.t - 0.025570197858).abs() < 1e-10);
    assert!(snap.time_error < 1e-12);
    assert!((&snap.pose - vector![0.237480258, -0.640322242]).norm() < 2e-9);
    assert!((snap.from.q[0] - 0.639250507).abs() < 1e-8);
    assert!((snap.released - 10.263064640).abs() < 1e-8);
    assert!((&snap.to.q - chart(-0.629404651, 3.350990350)).norm() < 1e-8);
    assert_eq!((snap.from.index, snap.to.index), (0, 0));
    assert!((track.end.pose - vector![0.7925457, -0.1708947]).norm() < 1e-6);
    assert!((track.end.phase.v - vector![-1.3784564, 0.9055016]).norm() < 1e-6);
}

/// Catches energy that leaks at snaps or walls, and a work integral with an error of its own.
#[test]
fn the_ledger_closes_over_a_long_run_with_snaps() {
    let (q, v) = snapping();
    let driven = free()
        .with_drag(0.3)
        .unwrap()
        .with_gravity(vector![0.5, -1.0])
        .unwrap()
        .with_force(TimeLoad::sine(vector![-14.0, 12.0], 2.0, 0.3).unwrap());
    for (body, duration, least) in [(free(), 60.0, 3), (driven, 60.0, 5)] {
        let track = track(&body, q, v, duration, 1e-12, []);
        assert!(track.snaps.len() >= least, "{} snaps", track.snaps.len());
        let relative = track.closing / track.largest;
        assert!(relative < 1e-10, "{relative:e}");
        assert!(track.radius < 1.0);
        for snap in &track.snaps {
            assert!(snap.released > 0.0);
            let landed = Elastica
                .point(&snap.to.q.fixed_rows::<2>(0).into_owned())
                .unwrap();
            assert!((landed.pose - &snap.pose).norm() < 1e-14);
        }
    }
}

/// Catches an ineffective error control: the error must fall with the tolerance.
#[test]
fn the_error_falls_with_the_tolerance() {
    let (q, v) = snapping();
    let end = |tolerance| track(&free(), q, v, 2.0, tolerance, []).end.pose;
    let exact = end(1e-14);
    let errors = [1e-5, 1e-7, 1e-9, 1e-11].map(|tolerance| (end(tolerance) - exact).norm());
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.2 * pair[0], "{errors:?}");
    }
    assert!(errors[3] < 1e-8, "{errors:?}");
}

/// Catches asymmetry between left and right: a chart evaluated differently for p < 0, a signed threshold. The mirrored
/// run must agree to the last bit.
#[test]
fn the_mirror_image_of_a_run_is_the_run_of_the_mirror_image() {
    let (q, v) = snapping();
    let mirrored = track(
        &free(),
        vector![-q[0], q[1]],
        vector![v[0], -v[1]],
        3.0,
        1e-9,
        [],
    );
    let track = track(&free(), q, v, 3.0, 1e-9, []);
    assert_eq!(track.snaps.len(), mirrored.snaps.len());
    let (a, b) = (track.end, mirrored.end);
    assert_eq!((a.pose[0], a.pose[1]), (b.pose[0], -b.pose[1]));
    assert_eq!((a.phase.v[0], a.phase.v[1]), (b.phase.v[0], -b.phase.v[1]));
    assert_eq!(a.ledger, b.ledger);
}

/// Catches a force that depends on the velocity, or asymmetry of time.
#[test]
fn a_motion_on_one_sheet_runs_back_to_its_start() {
    let body = free().with_dead_force(vector![-8.0, -2.0]).unwrap();
    let (q, v) = (chart(1.0, 3.0), vector![0.3, -0.2]);
    let there = track(&body, q, v, 2.0, 1e-13, []);
    assert!(there.snaps.is_empty());
    let back = track(&body, there.end.phase.q, -there.end.phase.v, 2.0, 1e-13, []);
    assert!((back.end.phase.q - q).norm() < 1e-9);
    assert!((back.end.phase.v + v).norm() < 1e-9);
}

/// Catches a drift or noise in the force: under minus the rod's force an equilibrium stays put.
#[test]
fn rest_stays_rest() {
    // Poses at which the rod's own stiffness is positive: a little off the far side, and taut.
    for (p, lam) in [(0.8, 2.0), (-1.5, 2.5), (3.0, 2.0), (-5.0, 4.0)] {
        let q = chart(p, lam);
        let at = Elastica.point(&q).unwrap();
        let body = free().with_dead_force(-at.force).unwrap();
        let track = track(&body, q, vector![0.0, 0.0], 20.0, 1e-10, []);
        let drift = (track.end.pose - at.pose).norm();
        assert!(drift < 1e-10, "p = {p}, lam = {lam}: {drift:e}");
    }
}

/// Catches drag of the wrong sign, and energy booked twice.
#[test]
fn drag_only_dissipates() {
    let (q, v) = snapping();
    let body = free()
        .with_gravity(vector![-6.0, 1.0])
        .unwrap()
        .with_drag(0.4)
        .unwrap();
    let track = track(&body, q, v, 20.0, 1e-10, []);
    let snapped: f64 = track.snaps.iter().map(|s| s.released).sum();
    assert_eq!(track.regained, 0.0);
    assert!(track.end.ledger.dissipated > snapped + 0.1);
    assert_eq!(track.end.ledger.work, 0.0);
    assert!(track.closing < 1e-7 * track.largest);
}

/// Catches a chart that ends before the wall does: fast masses near the straight rod press with
/// forces to 1e15 and more, and must bounce with their energy and stay inside the disc.
#[test]
fn fast_masses_bounce_off_the_wall_with_their_energy() {
    let mut hardest = 0.0f64;
    for (x, y) in [(0.99, 0.02), (0.999, 0.001), (0.9999, 0.01)] {
        let q = Elastica.stable_at(&vector![x, y]).unwrap()[0];
        for speed in [1.0f64, 30.0, 1000.0] {
            for angle in [0.0f64, 0.5, 1.5] {
                let v = vector![speed * angle.cos(), speed * angle.sin()];
                let body = free();
                let options = Options::new(0.2 / speed)
                    .and_then(|o| o.with_tolerance(1e-12))
                    .unwrap();
                let mut run = Run::new(&Elastica, &body, q, v, options).unwrap();
                let start = run.now().ledger.total();
                while let Some(event) = run.next() {
                    let now = run.now();
                    hardest = hardest.max(now.force.norm());
                    // |r| < 1 holds up to the rounding of the pose itself.
                    assert!(now.pose.norm() < 1.0 + 4e-15);
                    let error = (now.ledger.total() - start).abs() / now.ledger.largest();
                    assert!(error < 1e-10, "({x}, {y}), speed {speed}: {error:e}");
                    if let Event::Stop(outcome) = event {
                        assert_eq!(outcome, Outcome::EndOfTime);
                    }
                }
            }
        }
    }
    assert!(hardest > 1e15, "{hardest:e}");
}

/// Fold points all over the first two curves, the cusps of the first among them.
fn fold_points() -> Vec<FoldPoint> {
    let mut points = Vec::new();
    for number in 1..=2 {
        for p in [0.3, 0.64, 1.2, 1.55, 2.5, 4.0] {
            points.push(fold_at(number, p).unwrap());
            points.push(fold_at(number, -p).unwrap());
        }
    }
    let curve = fold_curve(1, 0.05, 3.0, 0.1).unwrap();
    let cusps = points.len();
    points.extend(curve.into_iter().filter(|point| point.cusp));
    assert!(points.len() >= cusps + 2);
    points
}

/// Catches starts that never leave (t' = 0 on a fold), leave to the wrong side, or snap for ever.
#[test]
fn starts_on_folds_and_cusps_get_under_way() {
    for fold in fold_points() {
        let q = vector![fold.equilibrium.p, fold.equilibrium.w];
        for v in [
            vector![0.0, 0.0],
            vector![1.0, 0.3],
            vector![-1.0, -0.3],
            vector![0.2, -1.0],
        ] {
            for gravity in [vector![0.0, 0.0], vector![0.0, -40.0], vector![30.0, 20.0]] {
                let body = free().with_gravity(gravity).unwrap();
                let place = format!(
                    "fold {} at p = {}, v = {v:?}, g = {gravity:?}",
                    fold.number, q[0]
                );
                let track = track(&body, q, v, 0.2, 1e-10, []);
                assert!(
                    track.closing < 1e-8 * track.largest,
                    "{place}: {:e}",
                    track.closing
                );
                assert!(
                    track.snaps.len() < 20,
                    "{place}: {} snaps",
                    track.snaps.len()
                );
                for snap in &track.snaps {
                    assert!(
                        snap.released > 0.0 && snap.to.index == 0,
                        "{place}: {snap:?}"
                    );
                }
            }
        }
    }
}

/// Catches a viscous layer that "lands" on its own fold or does not settle, mostly near the straight rod (all is small
/// there) and for loops (the energy is flat).
#[test]
fn every_fold_lands_lower_and_stable() {
    for number in 1..=2 {
        for p in [0.011, 0.05, 0.17, 0.6, 1.3, 1.6, 2.5, 4.9, 8.0] {
            for p in [p, -p] {
                let fold = fold_at(number, p).unwrap();
                let q = vector![p, fold.equilibrium.w];
                let at = Elastica.point(&q).unwrap();
                let kernel = snaprod::manifold::fold_kernel(&at.jacobian).unwrap();
                for leaving in [kernel, -kernel] {
                    let Ok(landed) = Elastica.settle(&q, &leaving) else {
                        panic!("fold {number} at p = {p} does not settle");
                    };
                    let there = Elastica.point(&landed).unwrap();
                    assert_eq!(folds::index(landed[0], landed[1]).unwrap(), 0);
                    assert!((there.pose - at.pose).norm() < 1e-14);
                }
            }
        }
    }
}

/// Catches a departure too far from the fold, or a fall in steps too coarse, which ends in another basin. Reference:
/// the flow whose shapes are shown, ten times as accurate, from nearer the fold and in shorter steps, along the first
/// fold curve up to lam = 14.
#[test]
fn landings_are_those_of_a_more_careful_flow() {
    for k in 0..20 {
        let p = 0.02 * (6.4_f64 / 0.02).powf(f64::from(k) / 19.0);
        let fold = fold_at(1, p).unwrap().equilibrium;
        let q = vector![p, fold.w];
        let kernel = snaprod::manifold::fold_kernel(&Elastica.point(&q).unwrap().jacobian).unwrap();
        let (shapes, landed) = [kernel, -kernel]
            .iter()
            .filter_map(|leaving| Elastica.layer(&q, leaving).ok())
            .find(|(_, landed)| (landed - q).norm() > 0.1)
            .expect("one side of a fold falls");
        assert!(shapes.len() > 20, "{}", shapes.len());
        let settled = [kernel, -kernel].map(|leaving| Elastica.settle(&q, &leaving).unwrap());
        let apart = settled.map(|found| (found - landed).norm()).into_iter();
        let apart = apart.fold(f64::INFINITY, f64::min);
        assert!(apart < 1e-9, "p = {p}: {landed} is {apart:e} off");
    }
}

/// Catches stable equilibria left out by a bound on the load: taut rods near |r| = 1.
#[test]
fn stable_equilibria_of_any_load_are_found() {
    for (p, lam) in [(20.0, 16.0), (-60.0, 55.0), (3000.0, 2998.0)] {
        let q = chart(p, lam);
        assert_eq!(folds::index(q[0], q[1]).unwrap(), 0);
        let pose = Elastica.point(&q).unwrap().pose;
        let stable = Elastica.stable_at(&pose).unwrap();
        let near =
            |s: &Pair| (s[0] - p).abs() < 1e-3 * p.abs() && (s[1] - q[1]).abs() < 1e-3 * q[1];
        assert!(stable.iter().any(near), "p = {p}, lam = {lam}: {stable:?}");
    }
}

/// Catches a fold reported with the index of its upper side, where rounding decides.
#[test]
fn a_target_on_a_fold_has_the_index_of_the_lower_side() {
    for (number, p) in [(1, 0.6), (1, 1.2), (2, 0.5), (2, -1.0)] {
        let fold = fold_at(number, p).unwrap().equilibrium;
        let found = equilibria_at(fold.x, fold.y, 14.0).unwrap();
        let here: Vec<_> = found
            .iter()
            .filter(|f| f.degenerate && (f.equilibrium.p - p).abs() < 1e-4)
            .collect();
        assert_eq!(here.len(), 1, "fold {number} at p = {p}");
        assert_eq!(here[0].index, number - 1);
    }
}

/// Catches any error of sheet, fold, landing or bounces beyond 1e-11: the snap run in quadruple precision
/// (tools/ref_snap_run.py), fold and landing included.
#[test]
fn snap_run_in_quadruple_precision() {
    use crate::support::{json, number, rows};
    let data = json("snap_run.json");
    let start = snaprod::elastica::Equilibrium::from_lambda_kappa(6.3, 0.6).unwrap();
    let body = PointMass::new(1.0).unwrap();
    let options = Options::new(3.0).unwrap().with_tolerance(1e-13).unwrap();
    let q = Vector2::new(start.p, start.w);
    let mut run = Run::new(&Elastica, &body, q, Vector2::new(0.0, -0.5), options).unwrap();
    let rows = rows(&data, "rows", 10);
    let mut next = 0;
    let mut snapped = false;
    while let Some(event) = run.next() {
        match event {
            Event::Snap(snap) => {
                snapped = true;
                let (fold, landing) = (&data["fold"], &data["landing"]);
                for (got, want) in [
                    (snap.t, number(fold, "t")),
                    (snap.pose[0], number(fold, "x")),
                    (snap.pose[1], number(fold, "y")),
                    (snap.velocity[0], number(fold, "vx")),
                    (snap.velocity[1], number(fold, "vy")),
                    (snap.from.q[0], number(fold, "p")),
                    (snap.to.q[0], number(landing, "p")),
                    (snap.released, number(&data, "released")),
                ] {
                    assert!(
                        (got - want).abs() <= 1e-11 * want.abs().max(1.0),
                        "{got} {want}"
                    );
                }
            }
            Event::Step { to, .. } => {
                while next < rows.len() && number(&rows[next], "t") <= to {
                    let row = &rows[next];
                    let sample = run.sample(number(row, "t")).unwrap();
                    for (got, key) in [
                        (sample.pose[0], "x"),
                        (sample.pose[1], "y"),
                        (sample.phase.v[0], "vx"),
                        (sample.phase.v[1], "vy"),
                    ] {
                        let want = number(row, key);
                        assert!(
                            (got - want).abs() <= 2e-11,
                            "{key} at {}: {got} {want}",
                            row["t"]
                        );
                    }
                    next += 1;
                }
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            _ => {}
        }
    }
    assert!(snapped && next == rows.len());
}
