//! The inverse law of a nonlinear section: damped Newton for the minimum of W(e) - w.e (AMV after (2.32)).

use super::StrainName;
use super::linear::unit_at_rigid;
use super::{Compliance, Inverse, Resultant, Strain};
use crate::error::{Error, Result, check_finite};
use nalgebra::{Matrix6, Vector6};

/// A law at one point, in well-conditioned coordinates x.
pub(crate) struct LawPoint {
    /// e(x).
    pub strain: Strain,
    /// W(e(x)).
    pub energy: f64,
    /// w(x) = dW/de.
    pub resultants: Resultant,
    /// de/dx.
    pub frame: Matrix6<f64>,
    /// dw/dx.
    pub slope: Matrix6<f64>,
}

/// A strictly convex stored energy at a fixed s. The coordinates of rigid strains are the strains themselves.
pub(crate) trait Potential {
    /// Marks of the rigid strains.
    fn rigid(&self) -> [bool; 6];

    /// The law at x; None outside the domain.
    ///
    /// # Errors
    /// A law that is not convex at x.
    fn at(&self, x: &Vector6<f64>) -> Result<Option<LawPoint>>;
}

/// Most Newton steps, and most trials within a step.
const STEPS: usize = 200;
const TRIALS: usize = 60;

/// Residuals relative to their terms: each below `DONE`, or no longer falling and below `ROUNDOFF` in total.
const DONE: f64 = 4.0 * f64::EPSILON;
const ROUNDOFF: f64 = 1e-12;

/// Residual below which full steps are taken: energies can no longer be compared.
const CLOSE: f64 = 1e-7;

/// Solves w(x) = w from the admissible coordinates `x`. `seen` receives the residual of every iterate.
pub(crate) fn invert(
    law: &impl Potential,
    mut x: Vector6<f64>,
    w: &Resultant,
    mut seen: impl FnMut(f64),
) -> Result<Inverse> {
    check_finite("the resultants", w.as_slice())?;
    let outside = |x: &Vector6<f64>| {
        Error::domain(format!(
            "the inverse law has nowhere to start: the law is not defined at {}",
            crate::error::named(&crate::error::STRAINS, x.as_slice())
        ))
    };
    let mut point = law.at(&x)?.ok_or_else(|| outside(&x))?;
    let mut before = f64::INFINITY;
    let mut residual = f64::INFINITY;
    for _ in 0..STEPS {
        let (off, inverse) = linearise(law, &point, w)?;
        let compliance = point.frame * inverse;
        let compliance = 0.5 * (compliance + compliance.transpose());
        let single;
        (single, residual) = sizes(&point, &x, w, &off, &compliance);
        seen(residual);
        if single <= DONE || residual <= ROUNDOFF && !(single < 0.5 * before) {
            return Ok(Inverse {
                strain: point.strain,
                energy: point.energy,
                compliance: Compliance::Full(compliance),
            });
        }
        before = single;
        let dx = inverse * off;
        match search(law, &x, &point, w, &off, &dx, residual)? {
            Some(next) => (x, point) = next,
            None => break,
        }
    }
    Err(Error::no_convergence(format!(
        "the inverse law found no strains for the resultants {}: the relative residual is {residual:.1e} at the strains {}; \
         the stored energy may grow too slowly or not be smooth",
        crate::error::named(&crate::error::RESULTANTS, w.as_slice()),
        crate::error::named(&crate::error::STRAINS, point.strain.as_slice())
    )))
}

/// Residual of w, and dx/dw; zero for rigid strains.
fn linearise(
    law: &impl Potential,
    point: &LawPoint,
    w: &Resultant,
) -> Result<(Resultant, Matrix6<f64>)> {
    let rigid = law.rigid();
    let mut off = w - point.resultants;
    let mut inverse =
        equilibrated_inverse(&unit_at_rigid(&point.slope, rigid)).ok_or_else(|| {
            Error::no_convergence(format!(
                "the inverse law met a singular tangent at the strains {}",
                crate::error::named(&crate::error::STRAINS, point.strain.as_slice())
            ))
        })?;
    for k in (0..6).filter(|k| rigid[*k]) {
        off[k] = 0.0;
        inverse[(k, k)] = 0.0;
    }
    Ok((off, inverse))
}

/// Inverse after scaling rows, then columns, to largest entry 1: the choice of pivots must not depend on units.
fn equilibrated_inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let rows = Vector6::from_fn(|i, _| matrix.row(i).amax().recip());
    let scaled = matrix.map_with_location(|i, _, entry| entry * rows[i]);
    let columns = Vector6::from_fn(|j, _| scaled.column(j).amax().recip());
    let scaled = scaled.map_with_location(|_, j, entry| entry * columns[j]);
    let inverse = scaled.try_inverse()?;
    let inverse = inverse.map_with_location(|i, j, entry| entry * columns[i] * rows[j]);
    inverse.iter().all(|x| x.is_finite()).then_some(inverse)
}

/// The largest residual relative to its terms, and the total relative residual in the energy norm.
fn sizes(
    point: &LawPoint,
    x: &Vector6<f64>,
    w: &Resultant,
    off: &Resultant,
    compliance: &Matrix6<f64>,
) -> (f64, f64) {
    let (mut single, mut numerator, mut denominator) = (0.0_f64, 0.0_f64, f64::MIN_POSITIVE);
    for i in 0..6 {
        let size = w[i].abs() + point.slope.row(i).transpose().abs().dot(&x.abs());
        if off[i] != 0.0 {
            single = single.max(off[i].abs() / size);
        }
        let softness = compliance[(i, i)].max(0.0).sqrt();
        numerator = numerator.max(off[i].abs() * softness);
        denominator = denominator.max(size * softness);
    }
    (single, numerator / denominator)
}

/// Line search along dx: W - w.e must fall, and its slope with the sign reversed be at most half of the first.
fn search(
    law: &impl Potential,
    x: &Vector6<f64>,
    point: &LawPoint,
    w: &Resultant,
    off: &Resultant,
    dx: &Vector6<f64>,
    residual: f64,
) -> Result<Option<(Vector6<f64>, LawPoint)>> {
    let value = |point: &LawPoint| point.energy - w.dot(&point.strain);
    let noise = 64.0 * f64::EPSILON * (point.energy.abs() + w.abs().dot(&point.strain.abs()));
    let slope = -off.dot(&(point.frame * dx));
    let mut t = 1.0;
    for _ in 0..TRIALS {
        let trial = x + t * dx;
        let Some(next) = law.at(&trial)? else {
            t *= 0.25;
            continue;
        };
        let there = (next.resultants - w).dot(&(next.frame * dx));
        let falls = there <= -0.5 * slope && value(&next) <= value(point) + noise;
        if falls || residual < CLOSE {
            return Ok(Some((trial, next)));
        }
        let secant = slope / (slope - there);
        t *= if there > 0.0 {
            secant.clamp(0.1, 0.5)
        } else {
            0.5
        };
    }
    Ok(None)
}

/// Convexity of an energy on the free strains, by its second derivative.
pub(crate) enum Convexity {
    /// Positive definite.
    Strict,
    /// Undecided by rounding; with the smallest eigenvalue.
    Hidden(f64),
    /// Not positive semidefinite; with the smallest eigenvalue and the strain of largest weight in its direction.
    Lost(f64, &'static str),
}

/// Size below which eigenvalues, after scaling to a unit diagonal, are rounding.
const HIDDEN: f64 = 1e-13;

impl Convexity {
    /// Convexity by a tangent with finite entries.
    pub(crate) fn of(tangent: &Matrix6<f64>, rigid: [bool; 6]) -> Self {
        let free = unit_at_rigid(tangent, rigid);
        let roots = free.diagonal().map(|entry| entry.abs().sqrt());
        let scaled = free.map_with_location(|i, j, entry| match roots[i] * roots[j] {
            0.0 => entry,
            _ => entry / roots[i] / roots[j],
        });
        let pivots = scaled.cholesky().map(|factor| factor.l_dirty().diagonal());
        if pivots.is_some_and(|pivots| pivots.iter().all(|pivot| pivot * pivot > HIDDEN)) {
            return Self::Strict;
        }
        let eigen = free.symmetric_eigen();
        let k = eigen.eigenvalues.imin();
        let smallest = eigen.eigenvalues[k];
        if scaled.symmetric_eigenvalues().min() > -HIDDEN {
            return Self::Hidden(smallest);
        }
        Self::Lost(
            smallest,
            StrainName::ALL[eigen.eigenvectors.column(k).iamax()].as_str(),
        )
    }

    /// Error unless strictly convex.
    ///
    /// # Errors
    /// Convexity that is lost, or hidden by rounding.
    pub(crate) fn strict(&self, s: f64, e: &Strain) -> Result<()> {
        let (what, smallest) = match self {
            Self::Strict => return Ok(()),
            Self::Hidden(smallest) => ("strictly convex beyond rounding".into(), smallest),
            Self::Lost(smallest, strain) => (format!("convex, mostly in {strain},"), smallest),
        };
        Err(Error::domain(format!(
            "the stored energy is not {what} at s = {s}, strains {}: \
             the smallest eigenvalue of its second derivative is {smallest:.3e}",
            crate::error::named(&crate::error::STRAINS, e.as_slice())
        )))
    }
}
