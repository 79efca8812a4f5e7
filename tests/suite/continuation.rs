//! Continuation on problems with closed forms. Work is counted in evaluations of F.

use crate::support::assert_close;
use nalgebra::{DMatrix, DVector, SMatrix, SVector, dmatrix, dvector, matrix, vector};
use snaprod::solve::arclength::{Continuation, Direction, Options, Predictor, Role, Stop, Trace};
use snaprod::solve::branch_switching::{SwitchMethod, switch};
use snaprod::solve::deflation::{self, find_further};
use snaprod::solve::fold_curve::{Family2, FoldCurve, Linearised2};
use snaprod::solve::newton;
use snaprod::solve::parametrised_problem::{Family, Linearised};
use snaprod::solve::special_points::{Special, SpecialKind};

/// A family from closures: F with derivatives, and an index.
struct Given<const N: usize, F, I> {
    f: F,
    index: I,
}

type Parts<const N: usize> = (SVector<f64, N>, SMatrix<f64, N, N>, SVector<f64, N>);

/// Vector of static size.
fn sized<const N: usize>(x: &DVector<f64>) -> SVector<f64, N> {
    SVector::from_column_slice(x.as_slice())
}

/// Vector of dynamic size, as used by the solvers.
fn dynamic<const N: usize>(x: SVector<f64, N>) -> DVector<f64> {
    DVector::from_column_slice(x.as_slice())
}

fn dynamic_matrix<const N: usize>(matrix: SMatrix<f64, N, N>) -> DMatrix<f64> {
    DMatrix::from_column_slice(N, N, matrix.as_slice())
}

impl<const N: usize, F, I> Family for Given<N, F, I>
where
    F: Fn(&SVector<f64, N>, f64) -> Option<Parts<N>>,
    I: Fn(&SVector<f64, N>, f64) -> Option<usize>,
{
    fn size(&self) -> usize {
        N
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> snaprod::Result<Linearised> {
        let (residual, jacobian, slope) =
            (self.f)(&sized(x), p).ok_or_else(|| snaprod::Error::io("F ends here"))?;
        Ok(Linearised {
            residual: dynamic(residual),
            jacobian: dynamic_matrix(jacobian),
            slope: dynamic(slope),
        })
    }

    fn index(&self, x: &DVector<f64>, p: f64) -> snaprod::Result<Option<usize>> {
        Ok((self.index)(&sized(x), p))
    }
}

fn given<const N: usize, F>(f: F) -> Given<N, F, impl Fn(&SVector<f64, N>, f64) -> Option<usize>>
where
    F: Fn(&SVector<f64, N>, f64) -> Option<Parts<N>>,
{
    Given {
        f,
        index: |_: &SVector<f64, N>, _: f64| None,
    }
}

fn circle(x: &SVector<f64, 1>, p: f64) -> Option<Parts<1>> {
    Some((
        vector![x[0] * x[0] + p * p - 1.0],
        matrix![2.0 * x[0]],
        vector![2.0 * p],
    ))
}

fn kinds(trace: &Trace) -> Vec<SpecialKind> {
    trace.specials.iter().map(|s| s.kind).collect()
}

#[track_caller]
fn located(special: &Special, kind: SpecialKind, p: f64, accuracy: f64) {
    assert_eq!(special.kind, kind, "{special:?}");
    assert!(special.is_converged(), "{special:?}");
    assert_close(special.point.p, p, accuracy, 1.0, "p of a special point");
    let wrong = (special.point.p - p).abs();
    assert!(
        wrong <= 10.0 * special.error_p + 1e-14,
        "off by {wrong:e}, but estimated {:e}",
        special.error_p
    );
    let s = special.point.arclength;
    let (low, high) = special.interval;
    assert!(
        low - special.error_s <= s && s <= high + special.error_s,
        "{special:?}"
    );
}

fn per_point(trace: &Trace) -> f64 {
    let points = trace.points.len() - 1;
    let spent = trace.evaluations as f64 / points as f64;
    println!(
        "{points} points, {} special, {} evaluations, {spent:.2} per point",
        trace.specials.len(),
        trace.evaluations
    );
    spent
}

/// Catches folds missed or misplaced, arclength drift, loops that do not close.
#[test]
fn circle_has_two_folds_and_closes() {
    let family = given(circle);
    for (predictor, bound) in [(Predictor::Tangent, 4.0), (Predictor::Cubic, 3.0)] {
        let options = Options {
            predictor,
            ..Options::between(-2.0, 2.0)
        };
        let trace = Continuation::new(&family, dvector![0.8], 0.6, options)
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Closed);
        assert_eq!(kinds(&trace), [SpecialKind::Fold, SpecialKind::Fold]);
        located(&trace.specials[0], SpecialKind::Fold, 1.0, 1e-13);
        located(&trace.specials[1], SpecialKind::Fold, -1.0, 1e-13);
        assert!(trace.specials[0].point.x[0].abs() < 1e-9);
        let last = trace.points.last().unwrap();
        assert_eq!(
            (&last.x, last.p, last.role),
            (&trace.points[0].x, 0.6, Role::End)
        );
        assert_close(
            last.arclength,
            std::f64::consts::TAU,
            1e-5,
            1.0,
            "arclength",
        );
        for point in &trace.points {
            let off = (point.x[0].hypot(point.p) - 1.0).abs();
            assert!(off < 1e-10, "off the circle by {off:e}");
        }
        let spent = per_point(&trace);
        assert!(spent < bound, "{spent} evaluations per point");
    }
}
/// Catches ends that are not hit exactly, or hit once instead of each time.
#[test]
fn requested_values_are_hit_exactly() {
    let family = given(circle);
    let options = Options {
        at: vec![0.9, -0.3, 0.999_999],
        direction: Direction::Backward,
        weight: 3.0,
        ..Options::between(-0.7, 2.0)
    };
    let options_up = Options {
        direction: Direction::Forward,
        ..options.clone()
    };
    let down = Continuation::new(&family, dvector![1.0], 0.0, options)
        .unwrap()
        .trace();
    assert_eq!(down.stop, Stop::LeftAtStart);
    assert_eq!(down.points.last().unwrap().p, -0.7);
    let up = Continuation::new(&family, dvector![1.0], 0.0, options_up)
        .unwrap()
        .trace();
    assert_eq!(up.stop, Stop::LeftAtStart);
    let hit: Vec<f64> = up
        .points
        .iter()
        .filter(|p| p.role == Role::Requested)
        .map(|p| p.p)
        .collect();
    assert_eq!(hit, [0.9, 0.999_999, 0.999_999, 0.9, -0.3]);
    let end = up.points.last().unwrap();
    assert_eq!((end.p, end.role), (-0.7, Role::End));
    assert_close(end.x[0], -(1.0_f64 - 0.49).sqrt(), 1e-12, 0.0, "x");
    let order: Vec<f64> = up.points.iter().map(|p| p.arclength).collect();
    assert!(order.is_sorted(), "{order:?}");
}

/// p x - x^3: pitchfork at 0.
fn pitchfork(x: &SVector<f64, 1>, p: f64) -> Option<Parts<1>> {
    let x = x[0];
    Some((
        vector![p * x - x * x * x],
        matrix![p - 3.0 * x * x],
        vector![x],
    ))
}

/// Catches branch points missed, taken for folds, or blurred by the singular corrector; a step that
/// falls on the branch point itself.
#[test]
fn pitchfork_on_both_branches() {
    let family = Given {
        f: pitchfork,
        index: |x: &SVector<f64, 1>, p: f64| Some(usize::from(p - 3.0 * x[0] * x[0] > 0.0)),
    };
    for start in [-1.0, -0.98, -0.5] {
        let trace = Continuation::new(&family, dvector![0.0], start, Options::between(-1.0, 1.0))
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Reached);
        assert_eq!(trace.specials.len(), 1, "{:#?}", trace.specials);
        located(&trace.specials[0], SpecialKind::BranchPoint, 0.0, 1e-10);
        assert_eq!(trace.specials[0].index, (Some(0), Some(1)));
        assert!(!trace.specials[0].turning);
        assert!(per_point(&trace) < 4.0);
    }
    let trace = Continuation::new(
        &family,
        dvector![1.0],
        1.0,
        Options {
            direction: Direction::Backward,
            ..Options::between(-1.0, 2.0)
        },
    )
    .unwrap()
    .trace();
    assert_eq!(trace.stop, Stop::Reached);
    assert_eq!(trace.specials.len(), 1, "{:#?}", trace.specials);
    located(&trace.specials[0], SpecialKind::BranchPoint, 0.0, 1e-10);
    assert!(trace.specials[0].turning);
    assert_close(
        trace.points.last().unwrap().x[0],
        -2.0_f64.sqrt(),
        1e-11,
        0.0,
        "x",
    );
}

/// A simple branch point from a transcritical and a pitchfork: catches the wrong tangent, a start on
/// the known branch, a lost way.
#[test]
fn branches_are_switched_at_simple_branch_points() {
    let options = Options::between(-1.0, 1.0);
    let transcritical = given(|x: &SVector<f64, 1>, p: f64| {
        Some((
            vector![x[0] * (p - 2.0 * x[0])],
            matrix![p - 4.0 * x[0]],
            vector![x[0]],
        ))
    });
    let trace = Continuation::new(&transcritical, dvector![0.0], -1.0, options.clone())
        .unwrap()
        .trace();
    let found = switch(&transcritical, &trace.specials[0], 0.1, &options).unwrap();
    assert_eq!(
        (found.method, found.starts.len(), found.corank),
        (SwitchMethod::Quadratic, 2, 1)
    );
    for start in &found.starts {
        let ahead = Continuation::along(&transcritical, start, options.clone())
            .unwrap()
            .trace();
        assert_eq!(ahead.specials, []);
        let end = ahead.points.last().unwrap();
        assert_close(end.p.abs(), 1.0, 1e-15, 0.0, "p");
        assert_close(end.x[0], 0.5 * end.p, 1e-12, 0.0, "x = p / 2");
    }
    assert!(found.starts[0].p * found.starts[1].p < 0.0);

    let family = given(pitchfork);
    let trace = Continuation::new(&family, dvector![0.0], -1.0, options.clone())
        .unwrap()
        .trace();
    let found = switch(&family, &trace.specials[0], 0.1, &options).unwrap();
    assert_eq!(
        (found.method, found.starts.len()),
        (SwitchMethod::Quadratic, 2)
    );
    let ends: Vec<f64> = found
        .starts
        .iter()
        .map(|s| {
            Continuation::along(&family, s, options.clone())
                .unwrap()
                .trace()
        })
        .map(|t| t.points.last().unwrap().x[0])
        .collect();
    assert_close(ends[0] * ends[1], -1.0, 1e-11, 0.0, "x = 1 and x = -1");
    assert!(found.evaluations < 20, "{}", found.evaluations);

    // A fold is no branch point.
    let folds = Continuation::new(
        &given(circle),
        dvector![1.0],
        0.0,
        Options::between(-2.0, 2.0),
    )
    .unwrap()
    .trace();
    let refused = switch(&given(circle), &folds.specials[0], 0.1, &options).unwrap_err();
    assert!(refused.is_domain(), "{refused}");
}

/// x (p^2 - x^2) (p - 3 x): three further branches through 0 where the quadratic part vanishes. Catches a
/// bifurcation equation trusted beyond its reach.
#[test]
fn degenerate_branch_point_is_sampled() {
    let f = |x: &SVector<f64, 1>, p: f64| {
        let x = x[0];
        let (u, v) = (p * p - x * x, p - 3.0 * x);
        Some((
            vector![x * u * v],
            matrix![u * v - 2.0 * x * x * v - 3.0 * x * u],
            vector![x * (2.0 * p * v + u)],
        ))
    };
    let family = Given {
        f,
        index: |x: &SVector<f64, 1>, p: f64| Some(usize::from(f(x, p).unwrap().1[0] > 0.0)),
    };
    let options = Options::between(-1.0, 1.0);
    let trace = Continuation::new(&family, dvector![0.0], -0.97, options.clone())
        .unwrap()
        .trace();
    assert_eq!(trace.specials.len(), 1, "{:#?}", trace.specials);
    assert!(trace.specials[0].point.p.abs() < 1e-5);
    let found = switch(&family, &trace.specials[0], 0.1, &options).unwrap();
    assert_eq!(found.method, SwitchMethod::Sampled);
    let mut slopes: Vec<f64> = found.starts.iter().map(|s| s.x[0] / s.p).collect();
    slopes.sort_by(f64::total_cmp);
    let want = [-1.0, -1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0, 1.0];
    assert_eq!(slopes.len(), want.len(), "{slopes:?}");
    for (got, want) in slopes.iter().zip(want) {
        assert_close(*got, want, 1e-9, 0.0, "slope");
    }
}

/// x' = (p - |x|^2) x in the plane: two unknowns buckle at once, no determinant changes sign.
fn symmetric(x: &SVector<f64, 2>, p: f64) -> Option<Parts<2>> {
    let left = p - x.norm_squared();
    Some((
        x * left,
        SMatrix::identity() * left - x * x.transpose() * 2.0,
        *x,
    ))
}

/// Catches a double crossing invisible to determinants, and a continuum of branches reported as a few.
#[test]
fn double_crossing_is_seen_by_the_index() {
    let family = Given {
        f: symmetric,
        index: |x: &SVector<f64, 2>, p: f64| {
            let square = x.norm_squared();
            Some(usize::from(p - square > 0.0) + usize::from(p - 3.0 * square > 0.0))
        },
    };
    let options = Options::between(-0.61, 1.0);
    let trace = Continuation::new(&family, dvector![0.0, 0.0], -0.61, options.clone())
        .unwrap()
        .trace();
    assert_eq!(trace.stop, Stop::Reached);
    assert_eq!(trace.specials.len(), 1, "{:#?}", trace.specials);
    let special = &trace.specials[0];
    located(special, SpecialKind::StabilityChange, 0.0, 1e-7);
    assert_eq!(special.index, (Some(0), Some(2)));
    assert!(per_point(&trace) < 6.0);
    let found = switch(&family, special, 0.1, &options).unwrap();
    assert_eq!((found.corank, found.method), (2, SwitchMethod::Sampled));
    assert!(found.starts.len() >= 8, "{found:?}");
    assert!(found.remarks[0].contains("continuous family"), "{found:?}");
    for start in &found.starts {
        assert_close(start.x.norm_squared(), start.p, 1e-9, 0.0, "p = |x|^2");
    }
}

/// A fixed orthogonal matrix: product of Householder reflections of fixed vectors.
fn mixer<const N: usize>() -> SMatrix<f64, N, N> {
    let mut mix = SMatrix::<f64, N, N>::identity();
    for k in 0..3 {
        let v = SVector::<f64, N>::from_fn(|i, _| ((3 * i + 7 * k + 2) as f64).sin());
        mix -= mix * v * v.transpose() * (2.0 / v.norm_squared());
    }
    mix
}

/// A number in +-1 that depends on all digits of the arguments: noise without memory.
fn noise(x: &[f64], p: f64, i: usize) -> f64 {
    let mut h = p.to_bits() ^ (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for v in x {
        h = (h ^ v.to_bits()).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        h ^= h >> 29;
    }
    (h >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Six mixed unknowns x = mix^T y: y0 (p - 1/5 - y0^2), a pitchfork on y0 = 0; y1^3 - y1 = p, an S with two folds;
/// the others follow y1 smoothly. Noise of 1e-13 on all that is returned.
fn mixed(x: &SVector<f64, 6>, p: f64) -> Option<Parts<6>> {
    let mix = mixer::<6>();
    let y = mix * x;
    let mut f = SVector::<f64, 6>::zeros();
    let mut j = SMatrix::<f64, 6, 6>::zeros();
    let mut s = SVector::<f64, 6>::zeros();
    f[0] = y[0] * (p - 0.2 - y[0] * y[0]);
    j[(0, 0)] = p - 0.2 - 3.0 * y[0] * y[0];
    s[0] = y[0];
    f[1] = y[1].powi(3) - y[1] - p;
    j[(1, 1)] = 3.0 * y[1] * y[1] - 1.0;
    s[1] = -1.0;
    for k in 2..6 {
        let stiff = k as f64;
        f[k] = stiff * y[k] + y[k].powi(3) - (p * stiff).sin() * y[1];
        j[(k, k)] = stiff + 3.0 * y[k] * y[k];
        j[(k, 1)] = -(p * stiff).sin();
        s[k] = -(p * stiff).cos() * stiff * y[1];
    }
    // Rows are mixed too, to make all entries generic.
    let back = mixer::<6>().transpose() * SMatrix::from_fn(|i, k| if i == k { 1.0 } else { 0.1 });
    let mut parts = (back * f, back * j * mix, back * s);
    for i in 0..6 {
        parts.0[i] += 1e-13 * noise(x.as_slice(), p, i);
        parts.2[i] += 1e-13 * noise(x.as_slice(), p, 6 + i);
        for k in 0..6 {
            parts.1[(i, k)] += 1e-13 * noise(x.as_slice(), p, 12 + 6 * i + k);
        }
    }
    Some(parts)
}

/// Folds at p = +-2/(3 sqrt 3) and the pitchfork, each crossed three times by the S-shaped branch, under noise
/// and without alignment. Catches tolerances that noise defeats, and lost accuracy.
#[test]
fn mixed_unknowns_with_noise() {
    let index = |x: &SVector<f64, 6>, p: f64| {
        let y = mixer::<6>() * x;
        Some(usize::from(p > 0.2) + usize::from(3.0 * y[1] * y[1] < 1.0))
    };
    let family = Given { f: mixed, index };
    let mut y = SVector::<f64, 6>::zeros();
    y[1] = -1.2;
    let start = mixer::<6>().transpose() * y;
    let fold = 2.0 / 27.0_f64.sqrt();
    for (predictor, bound) in [(Predictor::Tangent, 6.0), (Predictor::Cubic, 4.5)] {
        let options = Options {
            predictor,
            ..Options::between(-0.8, 0.8)
        };
        let trace = Continuation::new(&family, dynamic(start), -0.8, options)
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Reached, "{}", trace.stop);
        let spent = per_point(&trace);
        assert!(spent < bound, "{spent} evaluations per point");
        let want = [
            (SpecialKind::BranchPoint, 0.2, 1e-9),
            (SpecialKind::Fold, fold, 1e-12),
            (SpecialKind::BranchPoint, 0.2, 1e-9),
            (SpecialKind::Fold, -fold, 1e-12),
            (SpecialKind::BranchPoint, 0.2, 1e-9),
        ];
        assert_eq!(trace.specials.len(), want.len(), "{:#?}", kinds(&trace));
        for (special, (kind, p, accuracy)) in trace.specials.iter().zip(want) {
            located(special, kind, p, accuracy);
            let (Some(before), Some(after)) = special.index else {
                panic!("no index: {special:?}");
            };
            assert_eq!(before.abs_diff(after), 1);
        }
        for point in &trace.points {
            let y = mixer::<6>() * sized::<6>(&point.x);
            let off = (y[1].powi(3) - y[1] - point.p).abs().max(y[0].abs());
            assert!(off < 4e-10, "off the branch by {off:e} at p = {}", point.p);
        }
    }
}

/// Catches a border of the domain that ends in an error, a lost point or an endless approach.
#[test]
fn a_family_may_end() {
    // x = sqrt(1 - p), undefined from p = 0.7 on.
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        (p < 0.7).then(|| {
            (
                vector![x[0] - (1.0 - p).sqrt()],
                matrix![1.0],
                vector![0.5 / (1.0 - p).sqrt()],
            )
        })
    });
    let trace = Continuation::new(&family, dvector![1.0], 0.0, Options::between(0.0, 2.0))
        .unwrap()
        .trace();
    let Stop::Undefined { p, ref reason, .. } = trace.stop else {
        panic!("{}", trace.stop)
    };
    assert_eq!(reason.to_string(), "F ends here");
    assert!(p < 0.7 && p > 0.7 - 1e-6, "stopped at {p}");
    assert_eq!(trace.points.last().unwrap().p, p);
    assert!(trace.evaluations < 150, "{}", trace.evaluations);
    // The range may end on the border itself.
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        (p <= 0.7).then(|| (vector![x[0] - p * p], matrix![1.0], vector![-2.0 * p]))
    });
    let trace = Continuation::new(&family, dvector![0.0], 0.0, Options::between(0.0, 0.7))
        .unwrap()
        .trace();
    assert_eq!(trace.stop, Stop::Reached);
    assert!(trace.evaluations < 40, "{}", trace.evaluations);
    // A kink: stuck, with the points so far.
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        let side = if x[0] > 0.0 { 30.0 } else { 1.0 };
        Some((vector![side * x[0] - p], matrix![side], vector![-1.0]))
    });
    let trace = Continuation::new(&family, dvector![-1.0], -1.0, Options::between(-1.0, 1.0))
        .unwrap()
        .trace();
    match trace.stop {
        Stop::StepTooSmall { p, ref reason, .. } => {
            assert!(p.abs() < 1e-3 && reason.contains("kink"), "{p}, {reason}");
        }
        ref stop => panic!("{stop}"),
    }
    // A wave far shorter than the range: the branch creeps, and says so.
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        let phase = 1e7 * p;
        Some((
            vector![x[0] - 1e-7 * phase.sin()],
            matrix![1.0],
            vector![-phase.cos()],
        ))
    });
    let fine = Options {
        min_step: 1e-12,
        ..Options::between(0.0, 1.0)
    };
    let trace = Continuation::new(&family, dvector![0.0], 0.0, fine)
        .unwrap()
        .trace();
    match trace.stop {
        Stop::StepTooSmall { p, ref reason, .. } => {
            assert!(p < 1e-4 && reason.contains("creeps"), "{p}, {reason}");
        }
        ref stop => panic!("{stop}"),
    }
    let few = Options {
        max_points: 3,
        ..Options::between(-2.0, 2.0)
    };
    let trace = Continuation::new(&given(circle), dvector![1.0], 0.0, few)
        .unwrap()
        .trace();
    assert_eq!((trace.stop, trace.points.len()), (Stop::MaxPoints, 3));
}

/// Catches options that slip through, and starts without a direction.
#[test]
fn bad_requests_name_what_is_wrong() {
    let good = Options::between(-1.0, 1.0);
    let nan = f64::NAN;
    let bad = [
        ("to", Options::between(0.5, 0.5)),
        ("to", Options::between(nan, 0.5)),
        (
            "min_step",
            Options {
                min_step: 0.0,
                ..good.clone()
            },
        ),
        (
            "max_step",
            Options {
                max_step: nan,
                ..good.clone()
            },
        ),
        (
            "initial_step",
            Options {
                initial_step: 3.0,
                ..good.clone()
            },
        ),
        (
            "tolerance",
            Options {
                tolerance: 0.5,
                ..good.clone()
            },
        ),
        (
            "weight",
            Options {
                weight: -1.0,
                ..good.clone()
            },
        ),
        (
            "max_angle",
            Options {
                max_angle: 4.0,
                ..good.clone()
            },
        ),
        (
            "max_points",
            Options {
                max_points: 0,
                ..good.clone()
            },
        ),
        (
            "max_corrections",
            Options {
                max_corrections: 1,
                ..good.clone()
            },
        ),
        (
            "at",
            Options {
                at: vec![nan],
                ..good.clone()
            },
        ),
    ];
    for (name, options) in bad {
        let refused = Continuation::new(&given(circle), dvector![1.0], 0.0, options)
            .err()
            .unwrap();
        assert!(refused.is_domain(), "{refused}");
        assert!(
            refused.to_string().contains(&format!("{name} =")),
            "{refused}"
        );
    }
    let outside = Continuation::new(&given(circle), dvector![1.0], 1.5, good.clone())
        .err()
        .unwrap();
    assert!(outside.is_domain(), "{outside}");
    for wrong in [dvector![], dvector![1.0, 0.0]] {
        let refused = Continuation::new(&given(circle), wrong.clone(), 0.0, good.clone())
            .err()
            .unwrap();
        assert!(refused.to_string().contains("unknowns"), "{refused}");
        let guesses = [wrong];
        let refused = find_further(&given(circle), 0.0, &[], &guesses, &Default::default());
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("a guess has"), "{refused}");
    }
    let wide = Options::between(-3.0, 3.0);
    let nowhere = Continuation::new(&given(circle), dvector![1.0], 1.5, wide.clone())
        .err()
        .unwrap();
    assert!(nowhere.is_no_convergence(), "{nowhere}");
    let fold = Continuation::new(&given(pitchfork), dvector![0.0], 0.0, wide)
        .err()
        .unwrap();
    assert!(fold.is_ambiguous(), "{fold}");
}

/// Two pitchforks 0.005 apart, in one step: no determinant shows the pair, only the index does. Catches a
/// double crossing reported where two simple ones lie.
#[test]
fn two_branch_points_in_one_step_are_told_apart() {
    let at = [0.5, 0.505];
    let family = Given {
        f: |x: &SVector<f64, 2>, p: f64| {
            let (a, b) = (p - at[0] - x[0] * x[0], p - at[1] - x[1] * x[1]);
            Some((
                vector![x[0] * a, x[1] * b],
                matrix![a - 2.0 * x[0] * x[0], 0.0; 0.0, b - 2.0 * x[1] * x[1]],
                *x,
            ))
        },
        index: |_: &SVector<f64, 2>, p: f64| Some(at.iter().filter(|a| p > **a).count()),
    };
    let trace = Continuation::new(&family, dvector![0.0, 0.0], 0.0, Options::between(0.0, 1.0))
        .unwrap()
        .trace();
    assert_eq!(trace.specials.len(), 2, "{:#?}", trace.specials);
    for (k, special) in trace.specials.iter().enumerate() {
        located(special, SpecialKind::BranchPoint, at[k], 1e-10);
        assert_eq!(special.index, (Some(k), Some(k + 1)));
    }
}

/// F = x^2 + (p^2 - 1/4)^2 - 1/100: two isolas. Catches branches that leave a small loop, and loops not seen
/// as such because the step is of their size.
#[test]
fn isolas_close() {
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        let u = p * p - 0.25;
        Some((
            vector![x[0] * x[0] + u * u - 0.01],
            matrix![2.0 * x[0]],
            vector![4.0 * p * u],
        ))
    });
    for at in [-0.5, 0.5] {
        let trace = Continuation::new(&family, dvector![0.1], at, Options::between(-1.0, 1.0))
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Closed);
        assert_eq!(kinds(&trace), [SpecialKind::Fold, SpecialKind::Fold]);
        let (low, high) = (0.15_f64.sqrt(), 0.35_f64.sqrt());
        let ends = if at > 0.0 { [high, low] } else { [-low, -high] };
        for (special, p) in trace.specials.iter().zip(ends) {
            located(special, SpecialKind::Fold, p, 1e-13);
        }
    }
}

/// Two folds within one step, with and without index. Catches pairs hidden by equal end signs.
#[test]
fn two_folds_in_one_step_are_noticed() {
    // p = x^3 - e x: folds at x = +-sqrt(e / 3), 0.08 apart, against steps of 0.2.
    let e = 0.005;
    let f = |x: &SVector<f64, 1>, p: f64| {
        let x = x[0];
        Some((
            vector![x * x * x - e * x - p],
            matrix![3.0 * x * x - e],
            vector![-1.0],
        ))
    };
    let options = Options {
        initial_step: 0.2,
        max_angle: 1.4,
        ..Options::between(-1.0, 1.0)
    };
    let trace = Continuation::new(&given(f), dvector![-1.0], -1.0, options)
        .unwrap()
        .trace();
    assert_eq!(kinds(&trace), [SpecialKind::Fold, SpecialKind::Fold]);
    let p = 2.0 * (e / 3.0_f64).powf(1.5);
    located(&trace.specials[0], SpecialKind::Fold, p, 1e-14);
    located(&trace.specials[1], SpecialKind::Fold, -p, 1e-14);
}

/// p - q x + x^3 in two parameters.
struct CuspForm;

impl Family2 for CuspForm {
    fn size(&self) -> usize {
        1
    }

    fn linearised(&self, x: &DVector<f64>, p: f64, q: f64) -> snaprod::Result<Linearised2> {
        let x = x[0];
        Ok(Linearised2 {
            residual: dvector![p - q * x + x * x * x],
            jacobian: dmatrix![3.0 * x * x - q],
            slope_p: dvector![1.0],
            slope_q: dvector![-x],
        })
    }
}

/// The cusp in three mixed unknowns, two of them slaved with curved graphs.
struct MixedCusp;

impl Family2 for MixedCusp {
    fn size(&self) -> usize {
        3
    }

    fn linearised(&self, x: &DVector<f64>, p: f64, q: f64) -> snaprod::Result<Linearised2> {
        let mix = mixer::<3>();
        let y = mix * sized::<3>(x);
        let f = vector![
            p - q * y[0] + y[0].powi(3),
            2.0 * y[1] + y[1].powi(3) - q * y[0],
            3.0 * y[2] - p * y[1] - y[0] * y[0]
        ];
        let j = matrix![
            3.0 * y[0] * y[0] - q, 0.0, 0.0;
            -q, 2.0 + 3.0 * y[1] * y[1], 0.0;
            -2.0 * y[0], -p, 3.0
        ];
        let back = mix.transpose();
        Ok(Linearised2 {
            residual: dynamic(back * f),
            jacobian: dynamic_matrix(back * j * mix),
            slope_p: dynamic(back * vector![1.0, 0.0, -y[1]]),
            slope_q: dynamic(back * vector![-y[0], -y[0], 0.0]),
        })
    }
}

fn cusp_curve(family: &dyn Family2, x: DVector<f64>, first: impl Fn(&DVector<f64>) -> f64) {
    let curve = FoldCurve::new(family);
    // From the fold of q = 1 through the cusp at q = 0 and back to q = 1.
    let options = Options {
        direction: Direction::Backward,
        ..Options::between(-1.0, 1.0)
    };
    let start = FoldCurve::unknowns(&x, 0.38);
    let trace = Continuation::new(&curve, start, 1.0, options)
        .unwrap()
        .trace();
    assert_eq!(trace.stop, Stop::Reached, "{}", trace.stop);
    for point in &trace.points {
        let (x, p) = FoldCurve::parts(&point.x);
        let (y, q) = (first(&x), point.p);
        let folded = (3.0 * y * y - q).abs().max((p - 2.0 * y.powi(3)).abs());
        assert!(folded < 1e-10, "off the fold by {folded:e} at q = {q}");
    }
    let cusps: Vec<_> = trace.specials.iter().collect();
    assert_eq!(cusps.len(), 1, "{cusps:#?}");
    located(cusps[0], SpecialKind::Cusp, 0.0, 1e-12);
    assert!(cusps[0].turning);
    let (x, p) = FoldCurve::parts(&cusps[0].point.x);
    assert!(
        p.abs() < 1e-12 && first(&x).abs() < 1e-6,
        "{p:e}, {:e}",
        first(&x)
    );
    assert!(per_point(&trace) < 4.0);
}

/// Catches fold curves off their folds, and cusps missed where q and p turn together.
#[test]
fn fold_curve_passes_its_cusp() {
    let fold = (1.0_f64 / 3.0).sqrt();
    cusp_curve(&CuspForm, dvector![fold], |x| x[0]);
    let y = vector![fold, 0.28, 0.15];
    let start = dynamic(mixer::<3>().transpose() * y);
    cusp_curve(&MixedCusp, start, |x| (mixer::<3>() * sized::<3>(x))[0]);
}

/// The imperfect pitchfork x^3 - p x - 1/10 = 0: catches an omission of the branch that no path from the first one
/// reaches.
#[test]
fn deflation_finds_the_disconnected_branch() {
    let family = given(|x: &SVector<f64, 1>, p: f64| {
        let x = x[0];
        Some((
            vector![x * x * x - p * x - 0.1],
            matrix![3.0 * x * x - p],
            vector![-x],
        ))
    });
    let options = Options::between(-1.0, 1.0);
    let trace = Continuation::new(&family, dvector![-0.1], -1.0, options.clone())
        .unwrap()
        .trace();
    assert_eq!((trace.stop, trace.specials.len()), (Stop::Reached, 0));
    let known = &trace.points.last().unwrap().x;
    let found = find_further(
        &family,
        1.0,
        std::slice::from_ref(known),
        &[known.clone(), dvector![-1.0]],
        &deflation::Options::default(),
    )
    .unwrap();
    let mut x: Vec<f64> = found.solutions.iter().map(|s| s.x[0]).collect();
    x.sort_by(f64::total_cmp);
    // Viete: x = 2/sqrt 3 cos((acos(0.15 sqrt 3) - 2 pi k) / 3).
    let root = |k: f64| {
        let angle = ((0.15 * 3.0_f64.sqrt()).acos() - std::f64::consts::TAU * k) / 3.0;
        2.0 / 3.0_f64.sqrt() * angle.cos()
    };
    assert_eq!(x.len(), 2, "{found:#?}");
    assert_close(known[0], root(0.0), 1e-12, 0.0, "the known one");
    assert_close(x[0], root(2.0), 1e-12, 0.0, "lower");
    assert_close(x[1], root(1.0), 1e-12, 0.0, "middle");
    assert_eq!(found.ends.len(), 2);
    // The other branch has a fold where 27/100 = 4 p^3.
    let other = Options {
        direction: Direction::Backward,
        ..options
    };
    let other = Continuation::new(&family, dvector![x[0]], 1.0, other)
        .unwrap()
        .trace();
    assert_eq!(other.stop, Stop::Reached);
    located(
        &other.specials[0],
        SpecialKind::Fold,
        (0.27_f64 / 4.0).cbrt(),
        1e-13,
    );
}

/// Newton: catches damping that is missing (atan runs away undamped), noise taken for failure, and a
/// refusal without its reason.
#[test]
fn newton_is_damped_and_says_what_it_did() {
    let options = newton::Options::default();
    let atan = |x: &DVector<f64>| Ok((dvector![x[0].atan()], dmatrix![1.0 / (1.0 + x[0] * x[0])]));
    let solved = newton::solve(atan, &dvector![10.0], &options).unwrap();
    assert!(
        solved.x[0].abs() < 1e-15 && solved.damping < 0.5,
        "{solved:?}"
    );
    assert!(solved.evaluations < 25, "{solved:?}");
    // Rosenbrock's gradient system, badly scaled.
    let valley = |x: &DVector<f64>| {
        Ok((
            dvector![1e6 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            dmatrix![-2e6 * x[0], 1e6; -1.0, 0.0],
        ))
    };
    let solved = newton::solve(valley, &dvector![-1.2, 1.0], &options).unwrap();
    assert!(
        (&solved.x - dvector![1.0, 1.0]).norm() < 1e-14,
        "{solved:?}"
    );
    let noisy = |x: &DVector<f64>| {
        let value = x[0].exp() - 2.0 + 1e-12 * noise(x.as_slice(), 0.0, 0);
        Ok((dvector![value], dmatrix![x[0].exp()]))
    };
    let solved = newton::solve(noisy, &dvector![3.0], &options).unwrap();
    assert_close(solved.x[0], 2.0_f64.ln(), 2e-12, 0.0, "ln 2");
    let none = |x: &DVector<f64>| Ok((dvector![1.0 + x[0] * x[0]], dmatrix![2.0 * x[0]]));
    let refused = newton::solve(none, &dvector![3.0], &options).unwrap_err();
    assert!(refused.is_no_convergence(), "{refused}");
    let said = refused.to_string();
    assert!(
        said.contains("of 1 unknowns is") && said.contains("off by"),
        "{said}"
    );
}
