//! The continuation tool on problems with closed forms. Work is counted in evaluations of F.

use crate::support::assert_close;
use nalgebra::{SMatrix, SVector, matrix, vector};
use snaprod::solve::arclength::{Branch, Direction, Options, Predictor, Role, Stop, Trace};
use snaprod::solve::family::{Family, Linearised};
use snaprod::solve::special::{Kind, Special};

/// A family from closures: F with derivatives, and an index.
struct Given<const N: usize, F, I> {
    f: F,
    index: I,
}

type Parts<const N: usize> = (SVector<f64, N>, SMatrix<f64, N, N>, SVector<f64, N>);

impl<const N: usize, F, I> Family<N> for Given<N, F, I>
where
    F: Fn(&SVector<f64, N>, f64) -> Option<Parts<N>>,
    I: Fn(&SVector<f64, N>, f64) -> Option<usize>,
{
    fn linearised(&self, x: &SVector<f64, N>, p: f64) -> snaprod::Result<Linearised<N>> {
        let (residual, jacobian, slope) =
            (self.f)(x, p).ok_or_else(|| snaprod::Error::io("F ends here"))?;
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }

    fn index(&self, x: &SVector<f64, N>, p: f64) -> snaprod::Result<Option<usize>> {
        Ok((self.index)(x, p))
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

fn kinds<const N: usize>(trace: &Trace<N>) -> Vec<Kind> {
    trace.specials.iter().map(|s| s.kind).collect()
}

#[track_caller]
fn located<const N: usize>(special: &Special<N>, kind: Kind, p: f64, accuracy: f64) {
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

fn per_point<const N: usize>(trace: &Trace<N>) -> f64 {
    let points = trace.points.len() - 1;
    let spent = trace.evaluations as f64 / points as f64;
    println!(
        "{points} points, {} special, {} evaluations, {spent:.2} per point",
        trace.specials.len(),
        trace.evaluations
    );
    spent
}

/// Catches folds missed or misplaced, arclength that drifts, loops that run on.
#[test]
fn circle_has_two_folds_and_closes() {
    let family = given(circle);
    for (predictor, bound) in [(Predictor::Tangent, 4.0), (Predictor::Cubic, 3.0)] {
        let options = Options {
            predictor,
            ..Options::between(-2.0, 2.0)
        };
        let trace = Branch::new(&family, vector![0.8], 0.6, options)
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Closed);
        assert_eq!(kinds(&trace), [Kind::Fold, Kind::Fold]);
        located(&trace.specials[0], Kind::Fold, 1.0, 1e-13);
        located(&trace.specials[1], Kind::Fold, -1.0, 1e-13);
        assert!(trace.specials[0].point.x[0].abs() < 1e-9);
        let last = trace.points.last().unwrap();
        assert_eq!(
            (last.x, last.p, last.role),
            (trace.points[0].x, 0.6, Role::End)
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
    let down = Branch::new(&family, vector![1.0], 0.0, options)
        .unwrap()
        .trace();
    assert_eq!(down.stop, Stop::LeftAtStart);
    assert_eq!(down.points.last().unwrap().p, -0.7);
    let up = Branch::new(&family, vector![1.0], 0.0, options_up)
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

/// x' = p x - x^3 in the first unknown: pitchfork at 0, both ways round.
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
        let trace = Branch::new(&family, vector![0.0], start, Options::between(-1.0, 1.0))
            .unwrap()
            .trace();
        assert_eq!(trace.stop, Stop::Reached);
        assert_eq!(trace.specials.len(), 1, "{:#?}", trace.specials);
        located(&trace.specials[0], Kind::BranchPoint, 0.0, 1e-10);
        assert_eq!(trace.specials[0].index, (Some(0), Some(1)));
        assert!(!trace.specials[0].turning);
        assert!(per_point(&trace) < 4.0);
    }
    let trace = Branch::new(
        &family,
        vector![1.0],
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
    located(&trace.specials[0], Kind::BranchPoint, 0.0, 1e-10);
    assert!(trace.specials[0].turning);
    assert_close(
        trace.points.last().unwrap().x[0],
        -2.0_f64.sqrt(),
        1e-11,
        0.0,
        "x",
    );
}
