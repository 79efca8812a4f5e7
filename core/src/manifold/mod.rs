//! The equilibrium manifold: a global chart q with smooth pose, force, energy and shape on it.
//!
//! Do not ask "given the pose, what is the force?" (many answers, and folds where answers merge);
//! ask "given q, what are pose and force?". Everything that follows, folds, index, inversion,
//! motion, jumps, is written once over this map (theory 1: q -> g(q), w(q), U(q), dU = -w . dg).

mod added_inertia;
mod manifold8;
pub mod truss;

pub use added_inertia::{
    BendingLoad, DeflectionInertia, DeflectionState, EndInertia, FirstOrderInertia,
};
pub use manifold8::{EightPoints, Eightfold};

use crate::error::{Error, Result};
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DefaultAllocator, Dim, OMatrix, OVector, SMatrix, SVector};

/// Load lambda = sqrt(tension L^2/B) above which a rod that is bent only at its ends counts as taut: a body that it
/// turns round there bounces.
pub const TAUT: f64 = 20.0;

/// Rounding of an energy in closed form, relative to its size: 4e-14 (1 + p) of the elastica (docs/accuracy.md), with
/// p below 24 on rods whose landing double precision determines.
pub const ENERGY_ROUNDING: f64 = 1e-12;

/// True if a rod whose end is held can fall from an equilibrium of the energy `from` to one of the energy `to`:
/// friction takes energy and gives none. `error`: how well energies are known, relative to their size.
pub fn energy_allows_landing(from: f64, to: f64, error: f64) -> bool {
    to - from <= error * (from.abs() + to.abs())
}

/// Values of the manifold at one chart point, for a chart and a pose of dimension `N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManifoldPoint<const N: usize> {
    /// Pose of the body, g(q).
    pub pose: SVector<f64, N>,
    /// Force of the rod on the body; -dU/dpose.
    pub force: SVector<f64, N>,
    /// Stored energy U(q).
    pub energy: f64,
    /// d pose / d q; singular at a fold.
    pub jacobian: SMatrix<f64, N, N>,
    /// The size of det(jacobian) below which a motion should slow its own time (> 0): small where
    /// the chart is stretched, so that bounces and folds are crossed in steps of equal effort.
    pub pace: f64,
}

/// Sheet of the manifold: the number of interior zeros of the rod's couple (or the model's own count of branches) and
/// a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sheet {
    /// Mode, 0, 1, 2, ...
    pub mode: u32,
    /// The sign that tells the two sheets of a mode apart.
    pub sign: Sign,
}

/// Sign, + or -.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Sign {
    /// +
    #[cfg_attr(feature = "serde", serde(rename = "+"))]
    Plus,
    /// -
    #[cfg_attr(feature = "serde", serde(rename = "-"))]
    Minus,
}

impl Sign {
    /// The sign of `x`; zero counts as plus.
    pub fn of(x: f64) -> Self {
        if x < 0.0 { Self::Minus } else { Self::Plus }
    }

    /// +1 or -1.
    pub fn value(self) -> f64 {
        match self {
            Self::Plus => 1.0,
            Self::Minus => -1.0,
        }
    }

    /// "+" or "-".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Plus => "+",
            Self::Minus => "-",
        }
    }
}

impl std::fmt::Display for Sheet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "S_{}^{}", self.mode, self.sign.as_str())
    }
}

/// Chart in which a motion is followed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Patch {
    /// Global chart.
    #[default]
    Global,
    /// Chart of one side of a state onto which the global chart collapses.
    Near(Sign),
}

/// Rod at a state onto which its chart collapses: it holds the body along a line and bends across it. Under the small
/// deflection y the end moves back by shortening y^2, against the cross force stiffness y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxialConstraint<const N: usize> {
    /// Pose at the state.
    pub pose: SVector<f64, N>,
    /// The direction in which the rod holds the body, outward.
    pub along: SVector<f64, N>,
    /// The direction of the deflection.
    pub across: SVector<f64, N>,
    /// Cross force over deflection.
    pub stiffness: f64,
    /// Retreat of the end along the line, over y^2.
    pub shortening: f64,
    /// Change of the shortening with the pull; negative.
    pub softening: f64,
}

/// One turn of a body of mass 1 that shakes along the line on which a state holds it, from one inner turning point to
/// the next. The chart collapses onto this state. The small deflection y and the load along the line are fixed.
/// Averages are over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShakingTurn {
    /// Duration of the turn, which grows as the root of the body's mass.
    pub period: f64,
    /// Deflection y.
    pub height: f64,
    /// Average cross force over y.
    pub stiffness: f64,
    /// Average retreat of the end over y^2.
    pub shortening: f64,
    /// Twice the average kinetic energy, over y^2.
    pub kinetic: f64,
    /// Pull at the inner turning point.
    pub inner_pull: f64,
    /// Cross force over y at the inner turning point.
    pub inner_stiffness: f64,
    /// Retreat over y^2 at the inner turning point.
    pub inner_shortening: f64,
}

/// An equilibrium manifold with a chart and poses of dimension `N`.
pub trait EquilibriumManifold<const N: usize> {
    /// Pose, force, energy and Jacobian at `q`; None outside the chart.
    fn point(&self, q: &SVector<f64, N>) -> Option<ManifoldPoint<N>>;

    /// Morse index of the stored energy with the pose held: 0 is stable.
    ///
    /// # Errors
    /// `q` outside the chart.
    fn index(&self, q: &SVector<f64, N>) -> Result<usize>;

    /// Difference from the pose of `at` to `pose`, in the coordinates of the Jacobian's rows: a subtraction, unless
    /// poses hold rotations.
    fn gap(&self, at: &ManifoldPoint<N>, pose: &SVector<f64, N>) -> SVector<f64, N> {
        pose - at.pose
    }
}

/// Manifold on which a body can jump: landings, bounces and changes of chart, besides the chart itself.
pub trait Multivalued<const N: usize>: EquilibriumManifold<N> {
    /// The sheet on which `q` lies.
    fn sheet(&self, q: &SVector<f64, N>) -> Sheet;

    /// Load lambda = sqrt(|force|) if the rod is so taut at `q` that a body it turns round there bounces; `None`
    /// otherwise, and in models without a taut state.
    fn tautness(&self, _patch: Patch, _q: &SVector<f64, N>) -> Option<f64> {
        None
    }

    /// Chart for the continuation of a motion that has come to `q` in `patch`.
    fn better_patch(&self, _patch: Patch, _q: &SVector<f64, N>) -> Patch {
        Patch::Global
    }

    /// Coordinates in the chart `to` of the point `q` of the chart `from`. Changes of chart keep the sign of
    /// det(jacobian).
    fn change_patch(&self, q: &SVector<f64, N>, _from: Patch, _to: Patch) -> SVector<f64, N> {
        *q
    }

    /// Point at `q` in the chart `patch`, as [`EquilibriumManifold::point`].
    fn point_in(&self, _patch: Patch, q: &SVector<f64, N>) -> Option<ManifoldPoint<N>> {
        self.point(q)
    }

    /// Evaluator of `patch` at eight places at once, with places and forces as good as `error`; `None` if the chart
    /// has none.
    fn eightfold(&self, _patch: Patch, _error: f64) -> Option<Box<dyn Eightfold<N> + Send>> {
        None
    }

    /// Direction along which a body shakes near the state that `patch` surrounds, so fast that the motion is averaged
    /// over many turns; `None` in other charts, and in models without such a state.
    fn shaking_direction(&self, _patch: Patch) -> Option<SVector<f64, N>> {
        None
    }

    /// Turn of a body near the state that `patch` surrounds, with the inner turning point `q`, under `load` along the
    /// direction of [`Multivalued::shaking_direction`]; `None` where the turn has no closed form.
    fn shaking_turn(&self, _patch: Patch, _q: &SVector<f64, N>, _load: f64) -> Option<ShakingTurn> {
        None
    }

    /// Rod under a pull along the line at a state onto which the chart collapses, if stable; `None` in models without
    /// one.
    fn axial_constraint(&self, _pull: f64) -> Option<AxialConstraint<N>> {
        None
    }

    /// Chart and point of the rod under `pull` with the small deflection `across`, where
    /// [`Multivalued::axial_constraint`] is Some.
    fn deflected_point(&self, _pull: f64, _across: f64) -> Option<(Patch, SVector<f64, N>)> {
        None
    }

    /// Checks that double precision resolves a motion at `q`.
    ///
    /// # Errors
    /// A motion that double precision does not resolve.
    fn check_resolution(&self, _q: &SVector<f64, N>) -> Result<()> {
        Ok(())
    }

    /// Every stable equilibrium at `pose`, by energy, lowest first.
    ///
    /// # Errors
    /// A pose that no equilibrium has, or a search that could not be completed.
    fn stable_at(&self, pose: &SVector<f64, N>) -> Result<Vec<SVector<f64, N>>>;

    /// The only stable equilibrium at the pose of the fold `q`, if `q` determines it better than the digits of the pose
    /// do; `None` otherwise.
    fn only_landing(&self, _q: &SVector<f64, N>) -> Option<SVector<f64, N>> {
        None
    }

    /// Every equilibrium on which a rod that leaves the fold `q` with its end held can come to rest. These are the
    /// stable ones at the pose of the fold with no more energy than it, the fold itself excluded, lowest energy
    /// first.
    ///
    /// # Errors
    /// As [`Multivalued::stable_at`].
    fn landings(&self, q: &SVector<f64, N>) -> Result<Vec<SVector<f64, N>>> {
        if let Some(landed) = self.only_landing(q) {
            return Ok(vec![landed]);
        }
        let outside = || Error::domain("the fold lies outside the chart");
        let fold = self.point(q).ok_or_else(outside)?;
        let mut stable = self.stable_at(&fold.pose)?;
        stable.retain(|other| {
            // Rounding may leave a twin of the fold in the list.
            let is_other = (other - q).norm() > 1e-4 * (1.0 + q.norm());
            let landing = self.point(other);
            is_other
                && landing.is_some_and(|at| {
                    energy_allows_landing(fold.energy, at.energy, ENERGY_ROUNDING)
                })
        });
        Ok(stable)
    }

    /// Landing of a rod that leaves the equilibrium `q` (a fold, or unstable) with its body held, in the chart
    /// direction `leaving`: the fast viscous layer.
    ///
    /// # Errors
    /// A layer that does not settle.
    fn settle(&self, q: &SVector<f64, N>, leaving: &SVector<f64, N>) -> Result<SVector<f64, N>>;
}

/// (det A, adj(A) v): the Cramer product, smooth through det A = 0.
///
/// Closed form for N <= 2; beyond, LU with complete pivoting, which leaves a single small pivot at a
/// simple fold and never divides by it.
#[inline]
pub fn adjugate_times<D: Dim>(a: &OMatrix<f64, D, D>, v: &OVector<f64, D>) -> (f64, OVector<f64, D>)
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    let mut x = v.clone();
    match a.nrows() {
        1 => (a[(0, 0)], x),
        2 => {
            x[0] = a[(1, 1)] * v[0] - a[(0, 1)] * v[1];
            x[1] = a[(0, 0)] * v[1] - a[(1, 0)] * v[0];
            (a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(1, 0)], x)
        }
        _ => adjugate_times_pivoted(a, v),
    }
}

fn adjugate_times_pivoted<D: Dim>(
    a: &OMatrix<f64, D, D>,
    v: &OVector<f64, D>,
) -> (f64, OVector<f64, D>)
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    let (mut u, mut b) = (a.clone(), v.clone());
    let n = u.nrows();
    let mut columns = OVector::<usize, D>::from_fn_generic(v.shape_generic().0, Const, |i, _| i);
    let mut sign = 1.0;
    for k in 0..n {
        let (mut row, mut column) = (k, k);
        for i in k..n {
            for j in k..n {
                if u[(i, j)].abs() > u[(row, column)].abs() {
                    (row, column) = (i, j);
                }
            }
        }
        if row != k {
            u.swap_rows(k, row);
            b.swap_rows(k, row);
            sign = -sign;
        }
        if column != k {
            u.swap_columns(k, column);
            columns.swap_rows(k, column);
            sign = -sign;
        }
        if u[(k, k)] == 0.0 {
            break;
        }
        for i in k + 1..n {
            let factor = u[(i, k)] / u[(k, k)];
            for j in k..n {
                let below = factor * u[(k, j)];
                u[(i, j)] -= below;
            }
            b[i] -= factor * b[k];
        }
    }
    let leading: f64 = sign * (0..n - 1).map(|k| u[(k, k)]).product::<f64>();
    let det = leading * u[(n - 1, n - 1)];
    let mut x = OVector::<f64, D>::zeros_generic(v.shape_generic().0, Const);
    if leading == 0.0 {
        return (0.0, x);
    }
    let mut y = &b * det;
    y[n - 1] = leading * b[n - 1];
    for i in (0..n - 1).rev() {
        for j in i + 1..n {
            y[i] -= u[(i, j)] * y[j];
        }
        y[i] /= u[(i, i)];
    }
    for k in 0..n {
        x[columns[k]] = y[k];
    }
    (det, x)
}

/// The chart direction that leaves the pose unchanged to first order at a fold: the column of
/// adj(jacobian) of greatest length, of unit length. Its sign is arbitrary.
///
/// # Errors
/// A Jacobian of rank below its size less 1 (no simple fold).
pub fn fold_kernel<D: Dim>(jacobian: &OMatrix<f64, D, D>) -> Result<OVector<f64, D>>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D>,
{
    let zero = OVector::<f64, D>::zeros_generic(jacobian.shape_generic().0, Const);
    let mut best = zero.clone();
    for i in 0..jacobian.nrows() {
        let mut unit = zero.clone();
        unit[i] = 1.0;
        let (_, column) = adjugate_times(jacobian, &unit);
        if column.norm() > best.norm() {
            best = column;
        }
    }
    let length = best.norm();
    if !(length > 0.0) {
        return Err(Error::no_convergence(
            "the Jacobian of the pose has lost more than one rank here; this is no simple fold",
        ));
    }
    Ok(best / length)
}

/// Result of a warm-started inversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inversion<const N: usize> {
    /// The chart point.
    pub q: SVector<f64, N>,
    /// |g(q) - pose|.
    pub residual: f64,
    /// Points evaluated.
    pub evaluations: usize,
}

/// The equilibrium near `guess` at `pose`: Newton's method in the chart with step halving.
///
/// From a neighbouring point of a motion it takes two to four evaluations.
///
/// # Errors
/// No convergence within 60 evaluations; the message says where the iteration stood.
pub fn invert_near<const N: usize>(
    manifold: &impl EquilibriumManifold<N>,
    pose: &SVector<f64, N>,
    guess: &SVector<f64, N>,
    tolerance: f64,
) -> Result<Inversion<N>> {
    const LIMIT: usize = 60;
    let outside = || {
        Error::domain(format!(
            "the guess {} lies outside the chart",
            crate::error::named(&["q1", "q2"], guess.as_slice())
        ))
    };
    let mut q = *guess;
    let mut at = manifold.point(&q).ok_or_else(outside)?;
    let mut evaluations = 1;
    let mut residual = manifold.gap(&at, pose).norm();
    while residual > tolerance && evaluations < LIMIT {
        let (det, scaled) = adjugate_times(&at.jacobian, &manifold.gap(&at, pose));
        let full = scaled / det;
        let mut fraction = 1.0;
        let mut moved = false;
        while evaluations < LIMIT && fraction > 1e-6 {
            let trial = q + full * fraction;
            evaluations += 1;
            if let Some(there) = manifold.point(&trial) {
                let r = manifold.gap(&there, pose).norm();
                if r < residual {
                    (q, at, residual, moved) = (trial, there, r, true);
                    break;
                }
            }
            fraction *= 0.5;
        }
        if !moved {
            break;
        }
    }
    // Rounding sets a floor: the pose itself is only known to a few ulp.
    if !(residual <= tolerance.max(8.0 * f64::EPSILON * (1.0 + pose.norm()))) {
        return Err(Error::no_convergence(format!(
            "no equilibrium found near {}: the pose is still off by {residual:.3e} after {evaluations} evaluations; \
             start from a nearer point, or search for all equilibria at the pose",
            crate::error::named(&["q1", "q2"], q.as_slice())
        )));
    }
    Ok(Inversion {
        q,
        residual,
        evaluations,
    })
}
