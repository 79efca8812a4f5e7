//! Proof of the bounds of third derivatives, by interval arithmetic over a subdivision of the whole chart region of
//! the search (theory 2.4).
//!
//! Over a box of (p, lam) the pendulum (s, c, D, B) is enclosed at the centre by Carlson's ladder in intervals, and
//! around it by its rates. The Taylor coefficients of the tip to third order follow from the differential equations
//! of the pendulum along both coordinates. The closed form of the derivatives in `curvature` is not used. A box that
//! does not show the bounds is halved.

mod enclosure;
mod interval;
mod series;

use super::{
    BoxCoordinate, FAR, LINEAR, LOG_X, LOG_Y, Local, MOVED, PASSING, QUARTER, bound_terms,
    chart_point,
};
use crate::elastica::chart::Integrals;
use crate::elastica::folds::{MIN_FOLD_LAM, QUARTERS};
use crate::elastica::inversion::{LOADED, MAX_P_BEYOND_LAM};
use enclosure::{Enclosure, Place};
use interval::Interval;
use series::{Jet, Pendulum};
use std::sync::atomic::{AtomicUsize, Ordering};

type I = Interval;

fn at(x: f64) -> I {
    I::point(x)
}

impl Enclosure {
    /// Ok if all bounds hold over the box, u > 0.
    fn holds(&self, kind: BoxCoordinate) -> Result<(), Miss> {
        let pendulum = Pendulum::new(kind, self.u, self.values);
        let tip = pendulum.tip(pendulum.over_lam());
        let third = [&tip[0], &tip[1]].map(|jet| {
            [
                jet.derivative(3, 0),
                jet.derivative(2, 1),
                jet.derivative(1, 2),
                jet.derivative(0, 3),
            ]
        });
        self.compare(kind, third, &tip)
    }

    /// Ok if these third derivatives of 1 - x and y and the speed of |r| along p are within their bounds. The bounds
    /// are the least over the box.
    fn compare(
        &self,
        kind: BoxCoordinate,
        [x, y]: [[I; 4]; 2],
        [_, _, along, across]: &[Jet; 4],
    ) -> Result<(), Miss> {
        let (lam, p) = (self.u.lo, self.values[0].lo);
        let check = |value: I, bound: f64, k: usize, what| {
            let bound = bound * (1.0 - 1e-12);
            if value.size() <= bound {
                Ok(())
            } else {
                Err(Miss {
                    what,
                    k,
                    value,
                    bound,
                })
            }
        };
        match kind {
            BoxCoordinate::Log => {
                let [bound_x, bound_y] = [LOG_X, LOG_Y].map(|terms| bound_terms(p * lam, terms));
                for k in 0..4 {
                    check(x[k], bound_x[k], k, "x")?;
                    check(y[k], bound_y[k], k, "y")?;
                }
            }
            BoxCoordinate::Linear => {
                let any = bound_terms(lam, LINEAR);
                let turns = (lam / self.quarter.hi).max(1.0);
                let longest = (along.0[0][0].square() + across.0[0][0].square()).sqrt();
                let far = at(-self.far_from_bends()).exp().lo;
                let size = PASSING * (longest.lo + 4.0 / self.u.hi) * far;
                let passing = bound_terms(turns, [[0.0, size]; 4]);
                for k in 0..4 {
                    let bound = any[k].min(passing[k]);
                    check(x[k], bound, k, "x")?;
                    check(y[k], bound, k, "y")?;
                }
                let moved = MOVED * (turns + 1.0) / self.u.hi;
                let speed = along.0[1][0].square() + across.0[1][0].square();
                check(speed.sqrt(), moved, 0, "|r|")?;
            }
        }
        Ok(())
    }

    /// Largest distance of u from the nearest odd multiple of K.
    fn far_from_bends(&self) -> f64 {
        let near = (self.u.lo / self.quarter.lo / 2.0).floor();
        [-1.0, 1.0, 3.0].iter().fold(FAR, |far, more| {
            let bend = 2.0 * near + more;
            let away = |u: f64, k: f64| (u - bend * k).abs();
            let most = [self.quarter.lo, self.quarter.hi]
                .iter()
                .fold(0.0f64, |most, &k| {
                    most.max(away(self.u.lo, k)).max(away(self.u.hi, k))
                });
            if bend > 0.0 {
                far.min(most + 1e-12)
            } else {
                far
            }
        })
    }
}

/// Bound that a box fails to show.
#[derive(Debug)]
#[expect(dead_code, reason = "printed")]
struct Miss {
    what: &'static str,
    k: usize,
    value: I,
    bound: f64,
}

/// Proves the bounds over a box; returns the number of pieces.
fn prove(kind: BoxCoordinate, whole: Place) -> usize {
    let mut queue = vec![whole];
    let mut pieces = 0;
    while let Some(place) = queue.pop() {
        let [[p_low, p_high], [low, high]] = [place.p, place.u];
        pieces += 1;
        let enclosure = Enclosure::new(kind, &place);
        let Err(miss) = enclosure.holds(kind) else {
            continue;
        };
        assert!(
            !(miss.value.least() > miss.bound) && p_high - p_low > 1e-6,
            "{kind:?} {place:?}: {miss:?}"
        );
        // Along p the rod turns faster in proportion to its number of bends.
        let turns = 1.0 + high / enclosure.quarter.lo;
        let split = |[low, high]: [f64; 2]| {
            let middle = 0.5 * (low + high);
            [[low, middle], [middle, high]]
        };
        if (p_high - p_low) * turns > high - low {
            queue.extend(split(place.p).map(|p| Place { p, ..place }));
        } else {
            queue.extend(split(place.u).map(|u| Place { u, ..place }));
        }
    }
    pieces
}

/// Ranges of the columns: those of ln p end a little beyond p = 1, those of p begin a little before. The search
/// widens boxes by a quarter of their half width, which is at most 1/2, in p and in lam.
const LOG_TO: f64 = 1.15;
const LINEAR_FROM: f64 = 0.85;
const LEAST: f64 = LOADED - 0.25;
const MOST: f64 = 60.25;
/// Largest p - lam of the proof: the search's boxes begin no farther than MAX_P_BEYOND_LAM beyond lam, and reach this
/// far when widened.
const BEYOND: f64 = MAX_P_BEYOND_LAM + 2.25;
const WIDTH: f64 = 0.25;

/// Ranges of lam that are proven one by one.
fn rows() -> Vec<[f64; 2]> {
    let mut ends = vec![LEAST];
    ends.extend((2..=60).map(f64::from));
    ends.push(MOST);
    ends.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Proves the bounds over the `part`-th of `parts` equal parts of a row, by ln p and by p; returns the numbers of
/// pieces.
fn prove_row(u: [f64; 2], part: usize, parts: usize) -> [usize; 2] {
    let sides = [
        (BoxCoordinate::Log, 0.0, LOG_TO),
        (BoxCoordinate::Linear, LINEAR_FROM, u[1] + BEYOND),
    ];
    sides.map(|(kind, from, to)| {
        let columns = ((to - from) / WIDTH).ceil() as usize;
        let end = |i: usize| from + (to - from) * i as f64 / columns as f64;
        let mine = (0..columns).filter(|i| i % parts == part);
        mine.map(|i| {
            let p = [end(i), end(i + 1)];
            prove(kind, Place { p, u })
        })
        .sum()
    })
}

/// Catches a constant that is too small, on a sample: one column in 29 of six rows. Full proof:
/// [`all_bounds_are_proven`].
#[test]
fn bounds_are_proven_on_a_sample() {
    for (i, u) in rows().into_iter().enumerate().filter(|(i, _)| i % 11 == 1) {
        prove_row(u, i % 29, 29);
    }
}

/// Proof of the bounds for LEAST < lam < MOST and 0 < p < lam + BEYOND; prints the number of pieces of each row. Run:
/// `cargo test -p snaprod-core -- --ignored --nocapture all_bounds_are_proven`.
#[test]
#[ignore = "three minutes of one core: 14 million boxes"]
fn all_bounds_are_proven() {
    // K(p) - p falls with p, since dK/dp = kap B(K) < 1.
    assert!(enclosure::at_point(1.0, 1.0).1.hi < 1.0 + QUARTER);
    let (rows, next) = (rows(), AtomicUsize::new(0));
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(u) = rows.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let [log, linear] = prove_row(*u, 0, 1);
                    println!("lam {u:?}: {log} boxes of ln p, {linear} of p");
                }
            });
        }
    });
}

/// Catches an enclosure that misses its function: pendulum, tip and third derivatives (by differences of the closed
/// second ones), at pseudo-random places of pseudo-random boxes.
#[test]
fn enclosures_hold_the_closed_form() {
    let mut seed = 5_u64;
    let mut random = move || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    for i in 0..600 {
        let lam = 0.6 + 59.0 * random().powi(2);
        let (kind, p) = match i % 2 {
            0 => (BoxCoordinate::Log, 0.02 + 1.1 * random()),
            _ => (BoxCoordinate::Linear, 0.85 + (lam + 5.0) * random().powi(2)),
        };
        let [a, b] = [
            0.02 * random().powi(3) * p.min(1.0),
            0.05 * random().powi(3),
        ];
        let place = Place {
            p: [p - a, p + a],
            u: [lam - b, lam + b],
        };
        let known = Enclosure::new(kind, &place);
        let pendulum = Pendulum::new(kind, known.u, known.values);
        let jets = pendulum.tip(pendulum.over_lam());
        let (p, lam) = (
            p + a * (2.0 * random() - 1.0),
            lam + b * (2.0 * random() - 1.0),
        );
        let at = Integrals::at_load(p, lam).unwrap();
        let holds = |known: I, value: f64, error: f64| {
            assert!(
                known.lo - error <= value && value <= known.hi + error,
                "{kind:?} {place:?} at {p} {lam}: {value:e} in {known:?}"
            );
        };
        let exact = [at.kap, at.kap_c, at.s, at.c, at.d, at.b];
        for (field, value) in [1, 2, 5, 6, 7, 8].into_iter().zip(exact) {
            holds(known.values[field], value, 1e-13 * (1.0 + lam));
        }
        let first = match kind {
            BoxCoordinate::Log => p.ln(),
            BoxCoordinate::Linear => p,
        };
        let second = |first: f64, lam: f64| {
            let (p, at) = chart_point(kind, first, lam).unwrap();
            Local::bending(kind, p, &at, [[0.0; 2]; 4]).second
        };
        let h = 1e-4;
        let [ahead, behind] = [h, -h].map(|h| second(first + h, lam));
        let [above, below] = [h, -h].map(|h| second(first, lam + h));
        for k in 0..2 {
            // Derivatives by ln p are in units of p^2 and p.
            let unit = match kind {
                BoxCoordinate::Log => p.powi(2 - k as i32),
                BoxCoordinate::Linear => 1.0,
            };
            let slope = |a: &[[f64; 2]; 3], b: &[[f64; 2]; 3], i: usize| {
                (a[i][k] - b[i][k]) / (2.0 * h * unit)
            };
            let third = [
                (3, 0, slope(&ahead, &behind, 0)),
                (2, 1, slope(&ahead, &behind, 1)),
                (1, 2, slope(&above, &below, 1)),
                (0, 3, slope(&above, &below, 2)),
            ];
            for (i, j, value) in third {
                holds(
                    jets[k].derivative(i, j),
                    value,
                    1e-5 * (1.0 + value.abs()) / unit,
                );
            }
        }
    }
}

/// Enclosure of det d(x, y)/d(p, lam)/kap^2 over a box, from the columns at fixed w and at fixed p in turned axes
/// (theory 2.2). The first column is small there, and no large terms cancel.
fn fold_function(known: &Enclosure) -> I {
    let [_, kap, kc, _, _, s, c, d, b] = known.values;
    let (two, over) = (at(2.0), I::ONE / known.u);
    let kc2 = kc.square();
    // Names: X + 1; Y, lam_p, X_p, Y_lam, alpha_lam over kap, X_lam over kap^2.
    let reach = two * (kc2 + kap.square() * b * over);
    let x = reach - I::ONE;
    let y = two * s * over;
    let lam_p = b + c * s / d;
    let x_p = -(two * kc2 * (known.u - b) + reach * lam_p) * over;
    let y_p = (two * kc2 * s - kap.square() * y * lam_p) * over;
    let alpha_p = -(two * kc2 * c / d);
    let x_lam = two * (s.square() - b * over) * over;
    let y_lam = (two * c * d - y) * over;
    let alpha_lam = two * s;
    (x_p - y * alpha_p) * (y_lam + x * alpha_lam) - (y_p + x * alpha_p) * (x_lam - y * alpha_lam)
}

/// Catches a fold below the start of the scan: for p < 30 none lies between lam = K, where theory 2.4 ends, and the
/// start.
#[test]
fn no_fold_lies_below_the_scan() {
    let mut queue = vec![Place {
        p: [0.0, 30.0],
        u: [1.5, 57.0],
    }];
    while let Some(place) = queue.pop() {
        let ([p_low, p_high], [low, high]) = (place.p, place.u);
        let [least, most] = place.p.map(|p| enclosure::at_point(p.max(1e-9), 1.0).1);
        if high < least.lo || low > MIN_FOLD_LAM.max(QUARTERS * most.hi) {
            continue;
        }
        let (wide, long) = (p_high - p_low, high - low);
        if wide.max(long) < 0.5 {
            let det = fold_function(&Enclosure::new(BoxCoordinate::Linear, &place));
            if det.lo > 0.0 {
                continue;
            }
            assert!(long > 1e-6 && det.hi > 0.0, "{place:?}: {det:?}");
        }
        let halves = |[low, high]: [f64; 2]| {
            let middle = 0.5 * (low + high);
            [[low, middle], [middle, high]]
        };
        if wide > long {
            queue.extend(halves(place.p).map(|p| Place { p, ..place }));
        } else {
            queue.extend(halves(place.u).map(|u| Place { u, ..place }));
        }
    }
}
