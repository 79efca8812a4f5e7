//! The von Mises truss against its closed form: integrator, folds and jumps without a rod.

use crate::support::worst;
use gauss_quad::GaussLegendre;
use nalgebra::Vector1;
use snaprod::body::{PointMass, TimeLoad};
use snaprod::manifold::truss::Truss;
use snaprod::manifold::{EquilibriumManifold, Multivalued, Sheet, Sign};
use snaprod::motion::{Event, LandingRule, Options, Outcome, Run, Sample, Snap};
use std::f64::consts::FRAC_PI_3;

const UPPER: Sheet = Sheet {
    mode: 0,
    sign: Sign::Plus,
};
const LOWER: Sheet = Sheet {
    mode: 0,
    sign: Sign::Minus,
};

/// The textbook formulas, written again.
#[derive(Clone, Copy)]
struct Law {
    h: f64,
    k: f64,
    c: f64,
}

/// Two folds at a = +-0.3847.., z = -+0.4357..
const SOFT: Law = Law {
    h: 1.0,
    k: 1.0,
    c: 0.3,
};

impl Law {
    fn truss(self) -> Truss {
        Truss::new(self.h, self.k, self.c).unwrap()
    }
    fn length(self) -> f64 {
        (1.0 + self.h * self.h).sqrt()
    }
    fn sigma(self) -> f64 {
        self.c / (2.0 * self.k)
    }
    /// Energy of bars and spring with the body held at z.
    fn held(self, z: f64, a: f64) -> f64 {
        let stretch = (1.0 + a * a).sqrt() - self.length();
        self.k * stretch * stretch + 0.5 * self.c * (z - a) * (z - a)
    }
    fn force(self, a: f64) -> f64 {
        2.0 * self.k * a * (1.0 - self.length() / (1.0 + a * a).sqrt())
    }
    fn z(self, a: f64) -> f64 {
        a + self.force(a) / self.c
    }
    fn dz(self, a: f64) -> f64 {
        1.0 + (1.0 - self.length() / (1.0 + a * a).powf(1.5)) / self.sigma()
    }
    fn u(self, a: f64) -> f64 {
        self.held(self.z(a), a)
    }
    /// cos^3 of the bar's angle at the fold is (1 + sigma) / L.
    fn fold(self) -> f64 {
        ((1.0 + self.sigma()) / self.length())
            .powf(1.0 / 3.0)
            .acos()
            .tan()
    }
    /// Landing from the upper fold. With t = tan(angle / 2), z(a) = z reads t^4 + p t^3 + r t - 1 = 0, p = 2 (1 +
    /// sigma + L)/(sigma z). The fold is its double root s, which leaves t^2 + (p + 2 s) t - 1/s^2 = 0.
    fn landing(self) -> f64 {
        let a = self.fold();
        let s = (0.5 * a.atan()).tan();
        let p = 2.0 * (1.0 + self.sigma() + self.length()) / (self.sigma() * self.z(a));
        let u = p + 2.0 * s;
        // u < 0, the roots have opposite signs: the one below zero, without cancellation.
        let t = -2.0 / (s * s) / ((u * u + 4.0 / (s * s)).sqrt() - u);
        (2.0 * t.atan()).tan()
    }
    /// Time of a free body from a0, at speed `v` there, to a1 on the upper sheet: int dz / speed. The
    /// chart regularises the fold, a = a0 + (a1 - a0) x^2 a start from rest.
    fn time(self, mass: f64, v: f64, a0: f64, a1: f64) -> f64 {
        let inner = GaussLegendre::new(40.try_into().unwrap());
        let outer = GaussLegendre::new(120.try_into().unwrap());
        // U(a) - U(a0) = int F dz, from the offset: no cancellation near a0.
        let speed = |offset: f64| {
            let gained = inner.integrate(0.0, offset, |x| self.force(a0 + x) * self.dz(a0 + x));
            (v * v - 2.0 * gained / mass).sqrt()
        };
        let integral = outer.integrate(0.0, 1.0, |x| {
            let offset = (a1 - a0) * x * x;
            self.dz(a0 + offset) * 2.0 * x / speed(offset)
        });
        integral * (a1 - a0).abs()
    }
}

fn one(x: f64) -> Vector1<f64> {
    Vector1::new(x)
}

fn options(duration: f64, tolerance: f64) -> Options {
    Options::new(duration)
        .unwrap()
        .with_tolerance(tolerance)
        .unwrap()
}

#[track_caller]
fn close(what: &str, got: f64, want: f64, relative: f64) {
    let error = (got - want).abs();
    assert!(
        error <= relative * want.abs().max(f64::MIN_POSITIVE),
        "{what}: {got:e}, wanted {want:e}, off by {:.2e} relative",
        error / want.abs()
    );
}

fn first_snap<M: Multivalued<1>>(run: &mut Run<M, 1>) -> Snap {
    for event in run {
        match event {
            Event::Snap(snap) => return snap,
            Event::Stop(outcome) => panic!("no snap: {outcome}"),
            _ => {}
        }
    }
    unreachable!()
}

/// Runs to the stop; checks that time never runs back.
fn finish<M: Multivalued<1>>(
    run: &mut Run<M, 1>,
    mut each: impl FnMut(&Sample<1>),
) -> (Vec<Snap>, Outcome) {
    let mut snaps = vec![];
    loop {
        match run.next().expect("a run ends with a stop") {
            Event::Snap(snap) => snaps.push(snap),
            Event::Stop(outcome) => return (snaps, outcome),
            Event::Step { from, to } => assert!(to > from, "time stood still: {from} -> {to}"),
            other => panic!("a truss has none of these: {other:?}"),
        }
        each(&run.now());
    }
}

/// Central difference of order 8.
fn difference(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    const C: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    (1..=4)
        .map(|i| C[i - 1] * (f(x + i as f64 * h) - f(x - i as f64 * h)))
        .sum::<f64>()
        / h
}

/// Catches a wrong sign of the force, a factor in the energy of either spring, and a Jacobian that is not the
/// derivative of the pose. Catches an index that does not count the unstable directions of the held truss.
#[test]
fn manifold_is_lagrangian() {
    const STEP: f64 = 0.004;
    let mut seen = [0, 0];
    for law in [
        SOFT,
        Law { c: 2.0, ..SOFT },
        Law {
            h: 0.2,
            k: 3.0,
            c: 0.01,
        },
        Law {
            h: 3.0,
            k: 0.5,
            c: 0.7,
        },
    ] {
        let truss = law.truss();
        let at = |a: f64| truss.point(&one(a)).unwrap();
        for i in -60..=60 {
            let a = 0.05 * i as f64 + 0.013;
            let here = at(a);
            let du = difference(|a| at(a).energy, a, STEP);
            let dz = difference(|a| at(a).pose[0], a, STEP);
            let jacobian = here.jacobian[(0, 0)];
            let scale = 1.0 + jacobian.abs();
            assert!((dz - jacobian).abs() < 1e-11 * scale, "dz/da at {a}");
            let lagrange = du + here.force[0] * dz;
            assert!(
                lagrange.abs() < 1e-11 * scale * (1.0 + here.force[0].abs()),
                "dU + w dz = {lagrange:e} at {a}"
            );
            close("energy", here.energy, law.u(a), 1e-12);
            let z = here.pose[0];
            let curvature = difference(|b| difference(|b| law.held(z, b), b, STEP), a, STEP);
            assert!(
                (curvature - law.c * jacobian).abs()
                    < 1e-9 * (1.0 + curvature.abs() + law.held(z, a))
            );
            let index = truss.index(&one(a)).unwrap();
            assert_eq!(index, usize::from(curvature < 0.0), "index at {a}");
            seen[index] += 1;
        }
    }
    assert!(seen[0] > 100 && seen[1] > 20, "{seen:?}");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (h, k, c) in [(bad, 1.0, 1.0), (1.0, bad, 1.0), (1.0, 1.0, bad)] {
            assert!(Truss::new(h, k, c).unwrap_err().is_domain());
        }
        if !bad.is_finite() {
            assert!(SOFT.truss().point(&one(bad)).is_none());
            assert!(SOFT.truss().stable_at(&one(bad)).unwrap_err().is_domain());
        }
    }
    assert!(SOFT.truss().index(&one(f64::NAN)).unwrap_err().is_domain());
}

/// Catches a misplaced or false fold: against the bar's angle there, and the pose against the astroid.
#[test]
fn folds_in_closed_form() {
    for law in [
        SOFT,
        Law {
            h: 3.0,
            k: 0.5,
            c: 0.7,
        },
        Law { c: 1e-6, ..SOFT },
    ] {
        let truss = law.truss();
        let f = truss.fold().unwrap();
        close("fold", f, law.fold(), 1e-14);
        let astroid =
            (law.length().powf(2.0 / 3.0) - (1.0 + law.sigma()).powf(2.0 / 3.0)).powf(1.5);
        for side in [1.0, -1.0] {
            let at = truss.point(&one(side * f)).unwrap();
            close("pose", at.pose[0], -side * astroid / law.sigma(), 1e-13);
            assert!(at.jacobian[(0, 0)].abs() < 1e-14 * at.pace);
        }
    }
    // A shallow truss, h = 1e-4: f^2 = 2 (h^2/2 - sigma)/3 to leading order, all digits kept.
    let law = Law {
        h: 1e-4,
        k: 1.0,
        c: 5e-9,
    };
    close(
        "shallow fold",
        law.truss().fold().unwrap(),
        (5e-9 / 3.0_f64).sqrt(),
        1e-7,
    );
    let critical = 2.0 * (SOFT.length() - 1.0);
    let with = |c| Law { c, ..SOFT }.truss();
    assert!(with(critical * (1.0 - 1e-12)).fold().is_some());
    assert!(with(critical * (1.0 + 1e-12)).fold().is_none());
}

/// Catches a sheet or an equilibrium lost, an unstable one marked as stable, a wrong order by energy, a layer that
/// runs the wrong way or leaves a stable point.
#[test]
fn stable_equilibria_and_layer() {
    let truss = SOFT.truss();
    let f = SOFT.fold();
    let reach = SOFT.z(f).abs();
    for i in -40..=40 {
        let z = 0.1 * i as f64;
        let stable = truss.stable_at(&one(z)).unwrap();
        assert_eq!(stable.len(), if z.abs() < reach { 2 } else { 1 }, "at {z}");
        let mut last = f64::NEG_INFINITY;
        for q in &stable {
            assert_eq!(truss.index(q).unwrap(), 0);
            assert!((SOFT.z(q[0]) - z).abs() < 1e-13 * (1.0 + z.abs()));
            let energy = SOFT.held(z, q[0]);
            assert!(energy >= last - 1e-15);
            last = energy;
        }
        let stiff = Law { c: 2.0, ..SOFT };
        let only = stiff.truss().stable_at(&one(z)).unwrap();
        assert_eq!(only.len(), 1);
        assert!((stiff.z(only[0][0]) - z).abs() < 1e-13 * (1.0 + z.abs()));
        assert!(stiff.truss().settle(&only[0], &one(1.0)).is_err());
    }
    for a in [-0.3, -0.01, 0.0, 0.2] {
        for direction in [1.0, -1.0] {
            let to = truss.settle(&one(a), &one(direction)).unwrap()[0];
            assert!((to - a) * direction > 0.0 && to.abs() > f);
            let z = SOFT.z(a);
            assert!((SOFT.z(to) - z).abs() < 1e-14);
            // Downhill all the way.
            let path = |i: i32| SOFT.held(z, a + (to - a) * f64::from(i) / 100.0);
            assert!((0..100).all(|i| path(i + 1) < path(i)));
        }
    }
    for (a, direction) in [(f, 1.0), (-f, -1.0), (1.0, -1.0), (-1.0, 1.0), (0.0, 0.0)] {
        assert!(
            truss
                .settle(&one(a), &one(direction))
                .unwrap_err()
                .is_domain()
        );
    }
    assert!(truss.settle(&one(0.1), &one(f64::NAN)).is_err());
    assert!(truss.settle(&one(f64::NAN), &one(1.0)).is_err());
    let sheets = [(1.0, UPPER), (f, UPPER), (-f, LOWER), (-2.0, LOWER)];
    for (a, sheet) in sheets {
        assert_eq!(truss.sheet(&one(a)), sheet);
    }
    assert_eq!(truss.sheet(&one(0.1)).mode, 1);
}

/// Catches an integrator or a location of the fold with errors in the 12th digit, a wrong mass, and a landing or
/// released energy that differs from the closed form.
#[test]
fn fold_time_against_quadrature() {
    let (truss, f, landing) = (SOFT.truss(), SOFT.fold(), SOFT.landing());
    assert!(landing < -f && (SOFT.z(landing) - SOFT.z(f)).abs() < 1e-14);
    for (mass, a0, v0) in [
        (1.0, 1.0, -2.5),
        (0.3, 1.4, -0.7),
        (2.0, 0.6, -5.0),
        (1.0, 2.0, 0.0),
    ] {
        let body = PointMass::new(mass).unwrap();
        let want = SOFT.time(mass, v0, a0, f);
        let v_fold = -(v0 * v0 + 2.0 * (SOFT.u(a0) - SOFT.u(f)) / mass).sqrt();
        for side in [1.0, -1.0] {
            let mut run = Run::new(
                &truss,
                &body,
                one(side * a0),
                one(side * v0),
                options(100.0, 1e-13),
            )
            .unwrap();
            let snap = first_snap(&mut run);
            println!(
                "t = {:.15}, off by {:.1e}, time_error {:.1e}",
                snap.t,
                snap.t - want,
                snap.time_error
            );
            close("fold time", snap.t, want, 1e-11);
            close("velocity", snap.velocity[0], side * v_fold, 1e-12);
            close("fold", snap.from.q[0], side * f, 1e-13);
            close("fold pose", snap.pose[0], side * SOFT.z(f), 1e-13);
            close("landing", snap.to.q[0], side * landing, 1e-13);
            let released = SOFT.u(f) - SOFT.u(landing);
            assert!(released > 0.1);
            close("released", snap.released, released, 1e-13);
            assert_eq!((snap.from.index, snap.to.index), (0, 0));
            let sheets = if side > 0.0 {
                (UPPER, LOWER)
            } else {
                (LOWER, UPPER)
            };
            assert_eq!(
                (snap.from.sheet, snap.to.sheet),
                (Some(sheets.0), Some(sheets.1))
            );
            assert!(snap.time_error <= 1e-12 && snap.time_error > 0.0);
            assert!((snap.t - want).abs() <= 100.0 * snap.time_error + 1e-12 * want);
            let after = run.now();
            assert_eq!(after.phase.v, snap.velocity);
            assert_eq!(after.phase.q, snap.to.q);
        }
    }
}

/// Catches energy lost or counted twice anywhere: on the sheets, in jumps, by gravity, drag, drive.
#[test]
fn ledger_closes() {
    let truss = SOFT.truss();
    let free = || PointMass::new(1.0).unwrap();
    let drive = TimeLoad::sine(one(0.9), 0.31, 0.4).unwrap();
    let cases = [
        ("free", free(), 8.0, 60.0, 4),
        (
            "gravity",
            free().with_gravity(one(-0.07)).unwrap(),
            6.0,
            60.0,
            3,
        ),
        ("drag", free().with_drag(0.05).unwrap(), 8.0, 60.0, 3),
        ("drive", free().with_force(drive.clone()), 1.0, 300.0, 25),
        (
            "all",
            free()
                .with_gravity(one(0.05))
                .unwrap()
                .with_drag(0.3)
                .unwrap()
                .with_force(drive),
            -1.0,
            300.0,
            25,
        ),
    ];
    for (name, body, v, duration, least) in cases {
        let mut run = Run::new(&truss, &body, one(1.0), one(v), options(duration, 1e-12)).unwrap();
        let total = run.now().ledger.total();
        let (mut opened, mut lost, mut largest) = (0.0_f64, 0.0, 0.0_f64);
        let (snaps, outcome) = finish(&mut run, |now| {
            let ledger = now.ledger;
            largest = largest.max(ledger.largest());
            opened = worst([opened, (ledger.total() - total).abs()]);
            assert!(ledger.dissipated >= lost, "{name}: dissipation fell");
            lost = ledger.dissipated;
            assert!(name != "free" || ledger.work == 0.0 && ledger.potential == 0.0);
        });
        let down = snaps.iter().filter(|s| s.to.sheet == Some(LOWER)).count();
        println!(
            "{name}: {} snaps, {down} down, off by {:.1e} of {largest:.2}, {:?}",
            snaps.len(),
            opened,
            run.cost()
        );
        assert_eq!(outcome, Outcome::EndOfTime);
        assert_eq!(run.time(), duration);
        assert!(opened <= 1e-11 * largest, "{name}: {opened:e} of {largest}");
        assert!(snaps.len() >= least, "{name}: {} snaps", snaps.len());
        assert!(down.abs_diff(snaps.len() - down) <= 1, "both ways in turn");
        for pair in snaps.windows(2) {
            assert_eq!(pair[0].to.sheet, pair[1].from.sheet);
            assert!(pair[0].t < pair[1].t);
        }
        let each = SOFT.u(SOFT.fold()) - SOFT.u(SOFT.landing());
        for snap in &snaps {
            close("released", snap.released, each, 1e-12);
        }
        let released = each * snaps.len() as f64;
        match name {
            "drag" | "all" => assert!(lost > released * (1.0 + 1e-6)),
            _ => close("dissipated", lost, released, 1e-12),
        }
    }
}

/// Catches a location of the fold of lower order than the integration, or an error not controlled by the tolerance:
/// order 8 with local control gives an error in proportion to the tolerance.
#[test]
fn fold_time_follows_tolerance() {
    let (truss, body) = (SOFT.truss(), PointMass::new(1.0).unwrap());
    // A third of a swing above and then down: a few time units.
    let (a0, v0) = (1.0, 2.5);
    let top = {
        // U(top) = E: bisect the energy.
        let e = SOFT.u(a0) + 0.5 * v0 * v0;
        let (mut low, mut high) = (a0, 10.0);
        for _ in 0..200 {
            let mid = 0.5 * (low + high);
            if SOFT.u(mid) < e {
                low = mid
            } else {
                high = mid
            }
        }
        low
    };
    let want = SOFT.time(1.0, 0.0, top, a0) + SOFT.time(1.0, 0.0, top, SOFT.fold());
    let mut first = f64::NAN;
    for digits in 2..=14 {
        let tolerance = 10_f64.powi(-digits);
        let mut run = Run::new(&truss, &body, one(a0), one(v0), options(50.0, tolerance)).unwrap();
        let snap = first_snap(&mut run);
        let error = (snap.t - want).abs();
        println!(
            "tolerance 1e-{digits}: off by {error:.1e}, time_error {:.1e}, {:?}",
            snap.time_error,
            run.cost()
        );
        assert!(
            error <= 20.0 * tolerance + 2e-13,
            "{error:e} at {tolerance:e}"
        );
        assert!(snap.time_error.is_finite() && snap.time_error <= 1e-2 * tolerance + 1e-13);
        if digits == 2 {
            first = error;
        }
        if digits == 12 {
            assert!(
                error <= 1e-7 * first.max(1e-5),
                "{error:e} against {first:e}"
            );
        }
    }
}

/// Catches a fold not recognised, a snap to the wrong side, and a start at rest that never leaves or leaves late.
/// Catches a missed end time inside the first step off the fold.
#[test]
fn starts_on_a_fold() {
    let (truss, f) = (SOFT.truss(), SOFT.fold());
    let fold = truss.fold().unwrap();
    let body = PointMass::new(1.0).unwrap();
    for side in [1.0, -1.0] {
        for wobble in [0.0, 1.0, -1.0] {
            // Onto the sheet, with velocity or from rest: the truss itself pushes in this direction.
            let start = one(side * fold * (1.0 + wobble * 1e-15));
            for v in [0.0, 0.4, 3.0] {
                for a in [0.4, 0.5, 0.9] {
                    let duration = SOFT.time(1.0, v, f, a);
                    let mut run = Run::new(
                        &truss,
                        &body,
                        start,
                        one(side * v),
                        options(duration, 1e-13),
                    )
                    .unwrap();
                    assert_eq!(run.now().index, 0);
                    let (snaps, outcome) = finish(&mut run, |_| {});
                    assert!(snaps.is_empty());
                    assert_eq!(outcome, Outcome::EndOfTime);
                    let got = run.now();
                    let off = got.pose[0] - side * SOFT.z(a);
                    println!("v = {v}, a = {a}: pose off by {off:.1e}");
                    assert!(off.abs() < 1e-12, "v = {v}, a = {a}: pose off by {off:e}");
                }
            }
            // Off the sheet: an immediate snap.
            for v in [-0.4, -3.0] {
                let mut run =
                    Run::new(&truss, &body, start, one(side * v), options(1.0, 1e-10)).unwrap();
                let Some(Event::Snap(snap)) = run.next() else {
                    panic!("no snap")
                };
                assert_eq!(snap.t, 0.0);
                assert_eq!(snap.velocity, one(side * v));
                close("landing", snap.to.q[0], side * SOFT.landing(), 1e-13);
            }
            let pressed = PointMass::new(1.0)
                .unwrap()
                .with_dead_force(one(side * -2.0))
                .unwrap();
            let mut run = Run::new(&truss, &pressed, start, one(0.0), options(1.0, 1e-10)).unwrap();
            let Some(Event::Snap(snap)) = run.next() else {
                panic!("no snap from rest")
            };
            close("landing", snap.to.q[0], side * SOFT.landing(), 1e-13);
            let (_, outcome) = finish(&mut run, |_| {});
            assert_eq!(outcome, Outcome::EndOfTime);
        }
    }
    // Ends of time deep inside the first step off the fold, where t grows like the square.
    for tolerance in [1e-3, 1e-6, 1e-10, 1e-13] {
        for duration in [1.0, 0.1, 1e-2, 1e-3, 1e-4] {
            let mut run = Run::new(
                &truss,
                &body,
                one(fold),
                one(2.0),
                options(duration, tolerance),
            )
            .unwrap();
            let (_, outcome) = finish(&mut run, |_| {});
            assert_eq!(outcome, Outcome::EndOfTime);
            let q = run.now().phase.q[0];
            let took = SOFT.time(1.0, 2.0, f, q);
            let off = (took - duration).abs();
            assert!(
                off <= tolerance * duration.max(1e-2) + 1e-13,
                "the state at t = {duration} belongs to {took}, tolerance {tolerance:e}"
            );
        }
    }
}

/// Catches an equilibrium that drifts, on either sheet and under gravity.
#[test]
fn rest_stays_at_rest() {
    let truss = SOFT.truss();
    for a in [1.0, -1.0, 0.7, 1.6] {
        let weight = one(SOFT.force(a));
        let body = PointMass::new(2.0)
            .unwrap()
            .with_dead_force(weight)
            .unwrap();
        let mut run = Run::new(&truss, &body, one(a), one(0.0), options(200.0, 1e-10)).unwrap();
        let (snaps, outcome) = finish(&mut run, |_| {});
        assert!(snaps.is_empty());
        assert_eq!(outcome, Outcome::EndOfTime);
        let now = run.now();
        let drift = (now.phase.q[0] - a).abs() + now.phase.v[0].abs();
        println!("drift {drift:e}");
        // The weight is balanced up to rounding; steps of tolerance 1e-10 may amplify the imbalance to 1e-10 only.
        assert!(
            drift <= if a.abs() == 1.0 { 0.0 } else { 1e-10 },
            "{drift:e}"
        );
    }
}

/// Catches a landing rule that ignores its sheet, and a branch that differs from the corresponding run.
#[test]
fn landing_rules() {
    let (truss, body) = (SOFT.truss(), PointMass::new(1.0).unwrap());
    let run = |landing| {
        let options = options(8.0, 1e-12).with_landing(landing);
        Run::new(&truss, &body, one(1.0), one(-4.0), options).unwrap()
    };
    let mut reference = run(LandingRule::Viscous);
    let (snaps, _) = finish(&mut reference, |_| {});
    assert!(snaps.len() > 1);
    let end = reference.now();

    let mut lowest = run(LandingRule::Lowest);
    assert_eq!(finish(&mut lowest, |_| {}).0.len(), snaps.len());
    assert!((lowest.now().phase.q - end.phase.q).amax() < 1e-11);

    let mut named = run(LandingRule::Named(LOWER));
    let (named_snaps, outcome) = finish(&mut named, |_| {});
    // Down as named; on the way back up the rule admits no equilibrium.
    let first = Snap {
        base: nalgebra::UnitQuaternion::identity(),
        choices: named_snaps[0].choices,
        ..snaps[0].clone()
    };
    assert_eq!(named_snaps, [first]);
    assert_eq!(outcome, Outcome::NoStableEquilibrium);
    let (none, outcome) = finish(&mut run(LandingRule::Named(UPPER)), |_| {});
    assert!(none.is_empty());
    assert_eq!(outcome, Outcome::NoStableEquilibrium);

    let mut branch = run(LandingRule::All);
    let mut taken = vec![];
    loop {
        match finish(&mut branch, |_| {}).1 {
            Outcome::Branched(mut found) => {
                assert_eq!(found.len(), 1);
                let snap = found.remove(0);
                branch = branch.branch(&snap).unwrap();
                assert_eq!(branch.now().phase.q, snap.to.q);
                taken.push(snap);
                assert_eq!(branch.snaps(), taken.len() as u64);
            }
            outcome => {
                assert_eq!(outcome, Outcome::EndOfTime);
                break;
            }
        }
    }
    assert_eq!(taken.len(), snaps.len());
    for (a, b) in taken.iter().zip(&snaps) {
        close("branched snap", a.t, b.t, 1e-11);
    }
    let now = branch.now();
    assert!((now.phase.q - end.phase.q).amax() < 1e-11);
    close("total", now.ledger.total(), end.ledger.total(), 1e-12);
    close(
        "dissipated",
        now.ledger.dissipated,
        end.ledger.dissipated,
        1e-12,
    );
}

/// Catches a tolerance at which runs get stuck, lose a fold or drift far beyond the tolerance.
#[test]
fn every_tolerance_works() {
    let truss = SOFT.truss();
    let body = PointMass::new(1.0)
        .unwrap()
        .with_force(TimeLoad::sine(one(1.1), 1.3, FRAC_PI_3).unwrap());
    for digits in 2..=14 {
        let tolerance = 10_f64.powi(-digits);
        let mut run =
            Run::new(&truss, &body, one(1.0), one(0.5), options(60.0, tolerance)).unwrap();
        let total = run.now().ledger.total();
        let mut opened = 0.0_f64;
        let (snaps, outcome) = finish(&mut run, |now| {
            opened = worst([opened, (now.ledger.total() - total).abs()]);
            assert!(now.index == 0 && truss.sheet(&now.phase.q).mode == 0);
        });
        println!(
            "1e-{digits}: {} snaps, ledger off by {opened:.1e}, {:?}",
            snaps.len(),
            run.cost()
        );
        assert_eq!(outcome, Outcome::EndOfTime);
        assert!(opened <= 300.0 * tolerance + 1e-12);
        for snap in &snaps {
            println!("  t = {} +- {:e}", snap.t, snap.time_error);
            assert!(snap.time_error > 0.0 && snap.time_error <= tolerance + 1e-12);
            close("fold", snap.from.q[0].abs(), SOFT.fold(), 1e-9);
        }
    }
}
