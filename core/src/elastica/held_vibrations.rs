//! The vibrations of a rod with mass while its end is held in place (theory 2.9).
//!
//! About an equilibrium, with the rotation dtheta of the sections and dr = int n dtheta, n the normal of the rod:
//! ```text
//! K = int dtheta'^2 ds + int f . t dtheta^2 ds,   M = m int |dr|^2 ds,   dr(1) = 0
//! ```
//! Here f is the force that holds the end, t the tangent. Units: length 1, bending stiffness 1.

use super::chart::{ChartPoint, Integrals};
use crate::error::{Error, Result};
use crate::math::gauss::Rule;
use crate::math::small_sort::sort_few;
use nalgebra::{DMatrix, DVector};

/// A vibration of the held rod, per unit of the rod's mass m and of the Kelvin-Voigt time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldMode {
    /// omega^2 m: negative where the held rod is unstable.
    pub stiffness: f64,
    /// Damping: the amplitude falls as exp(-friction eta t/m).
    pub friction: f64,
}

impl HeldMode {
    /// Angular frequency for a rod of mass `mass`; `None` for an unstable mode.
    pub fn frequency(&self, mass: f64) -> Option<f64> {
        (self.stiffness > 0.0).then(|| (self.stiffness / mass).sqrt())
    }
}

/// Number of Gauss nodes: a constant, and its growth with lam.
const NODES: [f64; 2] = [20.0, 4.0];

/// First `count` vibrations of the rod at (p, w) with its end held, by frequency. Spectral: errors of the first ones
/// are of order 1e-10 for lam < 10.
///
/// # Errors
/// A point outside the chart, or a rod pulled too hard to be resolved.
pub fn held_modes(p: f64, w: f64, count: usize) -> Result<Vec<HeldMode>> {
    let at = ChartPoint::new(p, w);
    let lam = at.integrals.lam;
    if !(lam > 0.0 && lam < 50.0) {
        return Err(Error::domain(format!(
            "the rod is pulled with lambda = {lam}; its vibrations are found for 0 < lambda < 50"
        )));
    }
    let nodes = (NODES[0] + NODES[1] * lam) as usize + 2 * count;
    let rule = Rule::new(nodes);
    let (integrate, _) = rule.matrices();
    let weights = DVector::from_column_slice(&rule.weights);
    let mut cos = DVector::zeros(nodes);
    let mut sin = DVector::zeros(nodes);
    let mut along = DVector::zeros(nodes);
    for (k, s) in rule.nodes.iter().enumerate() {
        let inner = Integrals::at_load(p, lam * (1.0 - s))?;
        let (cos_psi, sin_psi) = (
            (inner.d - inner.kap * inner.c) * (inner.d + inner.kap * inner.c),
            2.0 * inner.kap * inner.c * inner.d,
        );
        // theta = alpha + psi; the rod pulls its end with lam^2 along alpha, the hand pushes back.
        cos[k] = at.cos_alpha * cos_psi - at.sin_alpha * sin_psi;
        sin[k] = at.sin_alpha * cos_psi + at.cos_alpha * sin_psi;
        along[k] = -lam * lam * cos_psi;
    }
    // Unknowns: sqrt(weight) dtheta' at the nodes.
    let roots = weights.map(f64::sqrt);
    let turn = &integrate * DMatrix::from_diagonal(&roots.map(|x| 1.0 / x));
    let by_weight = DMatrix::from_diagonal(&weights);
    let displaced = [-&sin, cos].map(|n| DMatrix::from_diagonal(&n) * &turn);
    let field = displaced.each_ref().map(|d| &integrate * d);
    let stiffness = DMatrix::identity(nodes, nodes)
        + turn.transpose() * DMatrix::from_diagonal(&weights.component_mul(&along)) * &turn;
    let mass = field
        .iter()
        .map(|f| f.transpose() * &by_weight * f)
        .fold(DMatrix::zeros(nodes, nodes), |sum, part| sum + part);
    let ends = displaced.each_ref().map(|d| d.transpose() * &weights);
    let free = complement(&ends);
    let (stiffness, mass) = (
        free.transpose() * stiffness * &free,
        free.transpose() * mass * &free,
    );
    modes(&stiffness, &mass, count)
}

/// Orthonormal basis of the orthogonal complement of two vectors.
fn complement(two: &[DVector<f64>; 2]) -> DMatrix<f64> {
    let rows = DMatrix::from_columns(two);
    let n = rows.nrows();
    let q = rows.qr();
    // Householder's reflections applied to the remaining unit vectors.
    let mut basis = DMatrix::identity(n, n);
    q.q_tr_mul(&mut basis);
    basis.rows(2, n - 2).transpose()
}

/// Solves M x = nu (K + shift M) x: the low frequencies are the large nu, which the eigensolver finds to rounding. K
/// is the bending stiffness plus a compact term, so that a finite shift makes it positive where the held rod is
/// unstable.
fn modes(stiffness: &DMatrix<f64>, mass: &DMatrix<f64>, count: usize) -> Result<Vec<HeldMode>> {
    let mut shift = 0.0;
    let factor = loop {
        if let Some(factor) = (stiffness + mass * shift).cholesky() {
            break factor.l();
        }
        shift = 4.0 * shift + 100.0;
        if !(shift < 1e12) {
            return Err(Error::ill_conditioned(
                "the vibrations of the held rod are not resolved",
            ));
        }
    };
    let lost = || Error::ill_conditioned("the vibrations of the held rod are not resolved");
    let left = factor.solve_lower_triangular(mass).ok_or_else(lost)?;
    let both = (factor.solve_lower_triangular(&left.transpose())).ok_or_else(lost)?;
    let eigen = ((&both + both.transpose()) * 0.5).symmetric_eigen();
    let of = |k: usize| {
        let nu = eigen.eigenvalues[k];
        let x = factor.tr_solve_lower_triangular(&eigen.eigenvectors.column(k))?;
        Some(HeldMode {
            stiffness: 1.0 / nu - shift,
            friction: 0.5 * x.norm_squared() / nu,
        })
    };
    let found: Option<Vec<_>> = (0..eigen.eigenvalues.len()).map(of).collect();
    let mut found = found.ok_or_else(lost)?;
    found.retain(|mode| mode.stiffness.is_finite() && mode.stiffness > -shift);
    sort_few(&mut found, |mode| mode.stiffness);
    found.truncate(count);
    Ok(found)
}
