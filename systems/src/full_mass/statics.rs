//! Statics of a rod with mass: equilibria with its weight, rates tangent to the equilibria of its end, small
//! vibrations.

use super::damped_modes::{Branch, decaying};
use super::frames::Curve;
use super::mass::Mass;
use super::rod::{Derivatives, HeavyRod, RodState};
use crate::error::{Error, Result};
use crate::math::small_sort::sort_few;
use crate::solve::positive_definite::definite;
use nalgebra::{Complex, DMatrix, DVector, Vector3, Vector6};

/// A small vibration about an equilibrium.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// Square of the angular frequency; negative if the equilibrium is unstable.
    pub square: f64,
    /// Decay rate of the amplitude, to first order in the friction.
    pub decay: f64,
    /// Change of the coordinates, normalised to mass 1.
    pub shape: DVector<f64>,
}

/// Motions with friction need all vibrations: a force on a body acts across the rod at its end, which a few
/// vibrations do not resolve. With 24 of them eigenvalues were off by 1e-6 to 1e-4 with drag on the body, a rotor in
/// it or friction of the rod. Beck's column fluttered at 0.97 of its load.
pub(super) const ALL: usize = usize::MAX;
/// Largest number of steps of the search for an equilibrium.
const STEPS: usize = 400;
/// Largest number of shifts tried for an indefinite stiffness, each ten times the one before.
const SHIFTS: i32 = 24;
/// Residual, a couple in EI/length, at which the search stops, and the residual over 1 + that at the start at which
/// it has converged: under great loads rounding is a part of the latter.
const SOLVED: f64 = 1e-13;
const FOUND: f64 = 1e-9;
/// Stiffnesses above minus this, in units of EI/length and of the largest one, count as neutral.
const NEUTRAL: f64 = 1e-9;
const ROUNDING: f64 = 1e-13;
/// Squares of frequencies below this, in units of the rod and the body, count as those of neutral directions of a rod
/// or an assembly.
const NEUTRAL_SQUARE: f64 = 1e-8;
/// Mean strains over the rod, tried in order, by which it is bent away from an unstable equilibrium.
const ASIDE: [f64; 3] = [0.3, 0.03, 0.003];
/// Bend (flexures, twist, shear, stretch) along which a rod in space leaves an unstable equilibrium: it breaks every
/// symmetry.
const BEND: [f64; 6] = [0.6, 0.8, 0.01, 0.02, 0.01, 0.005];
/// If the unstable part of that bend is smaller than this, the rod leaves along the lowest mode instead.
const ACROSS: f64 = 1e-3;
/// Largest number of unstable equilibria left before the search gives up.
const MAX_UNSTABLE_LEFT: usize = 6;
/// Rotation of a clamp for the difference quotient of the rod's balance.
pub(super) const TURN: f64 = 1e-5;

impl HeavyRod {
    /// The coordinates of a stable equilibrium under the loads at time `t`, the clamp at rest, searched from `q`
    /// downhill in the energy. Under loads without a potential stability is not decided.
    ///
    /// A symmetric rod in space, which may buckle to several sides alike, buckles to one of them.
    ///
    /// # Errors
    /// A law left on the way; no stable equilibrium found; a planar rod that may buckle to either side alike.
    pub fn settled(&self, t: f64, q: &[f64]) -> Result<Vec<f64>> {
        let standing = self.standing_at(t);
        let mut q = standing.descended(t, q)?;
        for _ in 0..MAX_UNSTABLE_LEFT {
            let Some(way) = standing.way_down(t, &q)? else {
                return Ok(q);
            };
            q = standing.left(t, &q, &way)?;
        }
        Err(unstable())
    }

    /// A descent direction of the coordinates, of mean size 1 over the rod, from the equilibrium `q` on a clamp at
    /// rest; None if that is stable.
    ///
    /// # Errors
    /// A planar rod that falls to either side alike; strains outside the law's domain.
    fn way_down(&self, t: f64, q: &[f64]) -> Result<Option<DVector<f64>>> {
        if !self.is_conservative(t) {
            return Ok(None);
        }
        let scale = self.norm_weights();
        let (slope, found) = self.small(t, q)?;
        let whole = (&found.by_strain + found.by_strain.transpose()) * 0.5;
        let size = self.size();
        let stiffness = DMatrix::from_fn(size, size, |i, j| whole[(i, j)] * scale[i] * scale[j]);
        let neutral = NEUTRAL + ROUNDING * stiffness.amax();
        if definite(&(&stiffness + DMatrix::identity(size, size) * neutral)).is_some() {
            return Ok(None);
        }
        let eigen = stiffness.symmetric_eigen();
        let slope = slope.component_mul(&scale);
        let lowest = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let way = match self.given.curve {
            Curve::Plane if slope.dot(&lowest) == 0.0 => {
                return Err(Error::ambiguous(EITHER_SIDE));
            }
            Curve::Plane => {
                let down = -slope.dot(&lowest).signum();
                lowest * down
            }
            Curve::Space => {
                let bend = self.coordinates(&vec![BEND.into(); self.sections.grid.len()]);
                let bend = DVector::from_vec(bend).component_div(&scale).normalize();
                let falling = (0..size).filter(|i| eigen.eigenvalues[*i] < -neutral);
                let modes = falling.map(|i| eigen.eigenvectors.column(i));
                let bent = modes.fold(DVector::zeros(size), |sum, mode| {
                    sum + mode * mode.dot(&bend)
                });
                let way = if bent.norm() > ACROSS {
                    bent.normalize()
                } else {
                    lowest.into_owned()
                };
                let uphill = slope.dot(&way) > NEUTRAL;
                way * if uphill { -1.0 } else { 1.0 }
            }
        };
        Ok(Some(way.component_mul(&scale)))
    }

    /// The equilibrium to which the rod falls from the unstable one `q` along `way`.
    fn left(&self, t: f64, q: &[f64], way: &DVector<f64>) -> Result<Vec<f64>> {
        let found = ASIDE.iter().find_map(|part| {
            let aside: Vec<f64> = q
                .iter()
                .zip(way.iter())
                .map(|(q, x)| q + part * x)
                .collect();
            self.descended(t, &aside).ok()
        });
        found.ok_or_else(unstable)
    }

    /// True if all loads at time `t` have a potential.
    fn is_conservative(&self, t: f64) -> bool {
        match &self.given.body {
            Some(Mass::Rigid(body)) => body.is_conservative(t),
            _ => true,
        }
    }

    fn descended(&self, t: f64, q: &[f64]) -> Result<Vec<f64>> {
        let m = self.size();
        let none = vec![0.0; m];
        let outside =
            || Error::domain("the search for the equilibrium left the domain of the section law");
        let energy = |at: &RodState| Some(self.stored(at)?.0 + self.potential(t, at));
        let mut q = q.to_vec();
        let mut at = self.moving(&q, &none).ok_or_else(outside)?;
        let mut balance = self.balance(t, &at, &none).ok_or_else(outside)?;
        let weights = self.norm_weights();
        let size = |r: &DVector<f64>| (r.component_mul(&weights)).norm();
        let first = size(&balance.residual);
        let mut shift = 0.0;
        for _ in 0..STEPS {
            let slope = self
                .derivatives(t, &at, &balance)
                .ok_or_else(outside)?
                .by_strain;
            let residual = size(&balance.residual);
            let here = energy(&at).ok_or_else(outside)?;
            let mut taken = None;
            // A shift removes negative curvature: the step then leads downhill.
            for _ in 0..60 {
                let mut matrix = (&slope + slope.transpose()) * 0.5;
                for i in 0..m {
                    matrix[(i, i)] += shift / (weights[i] * weights[i]);
                }
                let step = matrix
                    .cholesky()
                    .map(|factors| -factors.solve(&balance.residual));
                let tried = step.and_then(|step| {
                    let next: Vec<f64> = q.iter().zip(step.iter()).map(|(q, d)| q + d).collect();
                    let at = self.moving(&next, &none)?;
                    let balance = self.balance(t, &at, &none)?;
                    let less = energy(&at)? < here || size(&balance.residual) < 0.5 * residual;
                    less.then_some((next, at, balance))
                });
                match tried {
                    Some(found) => {
                        taken = Some(found);
                        shift = if shift < 1e-3 { 0.0 } else { 0.2 * shift };
                        break;
                    }
                    None => shift = (4.0 * shift).max(1e-2),
                }
            }
            let Some((next, there, balanced)) = taken else {
                break;
            };
            (q, at, balance) = (next, there, balanced);
            if size(&balance.residual) <= SOLVED && shift == 0.0 {
                break;
            }
        }
        let left = size(&balance.residual);
        if left <= FOUND * (1.0 + first) {
            Ok(q)
        } else {
            Err(Error::unreachable(format!(
                "no equilibrium of the rod with its weight was found: the best leaves a couple of {left:.1e} EI/length; start from \
             another shape, or from rest"
            )))
        }
    }

    /// Eigenvalues s of the `count` slowest motions exp(s t) about the equilibrium `q`, Im s >= 0, ordered by Im s:
    /// with friction, drag, rotors and loads that turn with the body.
    ///
    /// # Errors
    /// As [`HeavyRod::vibrations`]; eigenvalues that are not found.
    pub fn decaying(&self, t: f64, q: &[f64], count: usize) -> Result<Vec<Complex<f64>>> {
        let (_, found) = self.small(t, q)?;
        let matrices = [&found.by_strain, &found.by_rate];
        let conservative = self.is_conservative(t);
        let modes = slowest([matrices[0], matrices[1], &found.mass], ALL)?;
        let branches: Vec<Branch> = self.memory.branches_from(0).collect();
        decaying(&modes, (matrices, conservative), &branches, count)
    }

    /// Balance about the equilibrium `q` at rest, and its derivatives.
    fn small(&self, t: f64, q: &[f64]) -> Result<(DVector<f64>, Derivatives)> {
        let none = vec![0.0; self.size()];
        let found = self.moving(q, &none).and_then(|at| {
            let balance = self.balance(t, &at, &none)?;
            let derivatives = self.derivatives(t, &at, &balance)?;
            Some((balance.residual, derivatives))
        });
        found.ok_or_else(|| {
            Error::domain("the strains of the equilibrium are outside the law's domain")
        })
    }

    /// 1/sqrt(weight) for each coordinate: norms become means over the rod.
    pub(super) fn norm_weights(&self) -> DVector<f64> {
        let count = self.given.law.active().len();
        let weights = self.sections.grid.weights();
        DVector::from_fn(self.size(), |i, _| 1.0 / weights[i / count].sqrt())
    }

    /// Strain rates for which the end moves at `velocity` (angular first; for a point mass the velocity alone) while
    /// the rod, as if without inertia, stays in equilibrium under its loads at time `t` and a wrench on its end.
    ///
    /// # Errors
    /// A velocity that the rod cannot follow: a straight inextensible rod cannot be stretched.
    pub fn following(&self, t: f64, at: &RodState, velocity: &Vector6<f64>) -> Result<Vec<f64>> {
        let m = self.size();
        let wrong = || Error::domain("the strains at the start are outside the law's domain");
        let turned = self.sections.turned(&at.shape, false);
        let last = self.sections.grid.len();
        let turns = self.given.body.as_ref().is_some_and(Mass::turns);
        let first = if turns { 0 } else { 3 };
        // Components of the end's motion that the rod admits.
        let rows: Vec<(DVector<f64>, f64)> = (first..6)
            .map(|k| {
                let of = if k < 3 { &turned.phi } else { &turned.r };
                (of[k % 3].row(last).transpose(), velocity[k])
            })
            .collect();
        let moves: Vec<&(DVector<f64>, f64)> =
            rows.iter().filter(|(row, _)| row.amax() > 0.0).collect();
        let d = moves.len();
        let gather = DMatrix::from_fn(d, m, |i, j| moves[i].0[j]);
        let wanted = DVector::from_fn(d, |i, _| moves[i].1);
        // End wrench, beside the loads, with which the rod is in, or closest to, equilibrium: J^T f = -residual.
        let standing = self.standing_at(t);
        let balance = standing.balance(t, at, &vec![0.0; m]).ok_or_else(wrong)?;
        let small = standing.derivatives(t, at, &balance).ok_or_else(wrong)?;
        let (residual, mut slope) = (balance.residual, small.by_strain);
        let scale = self.norm_weights();
        let scaled = DMatrix::from_fn(m, d, |i, k| gather[(k, i)] * scale[i]);
        let wrench = scaled
            .svd(true, true)
            .solve(&(-residual.component_mul(&scale)), 1e-12)
            .map_err(|_| wrong())?;
        let mut end = Vector6::zeros();
        let mut at_row = 0;
        for (k, (row, _)) in rows.iter().enumerate() {
            if row.amax() > 0.0 {
                end[first + k] = wrench[at_row];
                at_row += 1;
            }
        }
        let mut couples = vec![Vector3::zeros(); last + 1];
        let mut forces = couples.clone();
        couples[last] = end.fixed_rows::<3>(0).into_owned();
        forces[last] = end.fixed_rows::<3>(3).into_owned();
        slope += self
            .sections
            .geometric(&at.shape, &turned, &couples, &forces);
        let mut whole = DMatrix::zeros(m + d, m + d);
        for i in 0..m {
            for j in 0..m {
                whole[(i, j)] = slope[(i, j)] * scale[i] * scale[j];
            }
            for k in 0..d {
                whole[(i, m + k)] = gather[(k, i)] * scale[i];
                whole[(m + k, i)] = gather[(k, i)] * scale[i];
            }
        }
        let mut right = DVector::zeros(m + d);
        right.rows_mut(m, d).copy_from(&wanted);
        if let Some(support) = self.given.grain.support().filter(|clamp| clamp.turns()) {
            // Gravity along the rod turns relative to the clamp.
            let step = TURN / (1.0 + support.at(t).spin_rate());
            let turned = |by: f64| {
                let standing = self.standing_at(t + by);
                Some(standing.balance(t, at, &vec![0.0; m])?.residual)
            };
            let [before, after] = [turned(-step), turned(step)].map(|r| r.ok_or_else(wrong));
            let drift = (after? - before?) / (2.0 * step);
            right
                .rows_mut(0, m)
                .copy_from(&-drift.component_mul(&scale));
        }
        let found = match whole.clone().lu().solve(&right) {
            Some(found) if found.iter().all(|x| x.abs() < 1e12) => found,
            _ => whole
                .svd(true, true)
                .solve(&right, 1e-11)
                .map_err(|_| wrong())?,
        };
        let rates: Vec<f64> = (0..m).map(|i| found[i] * scale[i]).collect();
        let moved = &gather * DVector::from_column_slice(&rates);
        if !((&moved - &wanted).norm() <= 1e-9 * (1.0 + wanted.norm())) {
            return Err(Error::domain(format!(
                "the rod cannot follow the velocity {:?} of its end: it is straight and inextensible, or cannot be strained that way; it \
                 would move at {:?}",
                wanted.as_slice(),
                moved.as_slice()
            )));
        }
        Ok(rates)
    }

    /// The `count` slowest vibrations about the equilibrium `q` at time `t`, by rising square of the frequency.
    ///
    /// # Errors
    /// Strains outside the law's domain; a mass matrix that is not positive definite to rounding.
    pub fn vibrations(&self, t: f64, q: &[f64], count: usize) -> Result<Vec<Vibration>> {
        let (_, found) = self.small(t, q)?;
        let modes = slowest([&found.by_strain, &found.by_rate, &found.mass], count)?;
        Ok(held_or_neutral(modes, &found.by_strain))
    }
}

/// The vibrations `modes`, with squares at the rounding level of a free motion set to 0. If the stiffness is positive
/// definite beyond rounding, no motion is free and all squares stay.
pub(super) fn held_or_neutral(modes: Vec<Vibration>, stiffness: &DMatrix<f64>) -> Vec<Vibration> {
    let symmetric = (stiffness + stiffness.transpose()) * 0.5;
    let neutral = definite(&symmetric).map_or(NEUTRAL_SQUARE, |_| 0.0);
    let told = modes.into_iter().map(|mode| Vibration {
        square: if mode.square.abs() > neutral {
            mode.square
        } else {
            0.0
        },
        ..mode
    });
    told.collect()
}

/// The message for a planar rod that can buckle to either side alike.
pub const EITHER_SIDE: &str = "the loads push the straight rod beyond the load at which it buckles, to either side alike; add a small load across the rod, or tilt \
                           the clamp a little, to choose one";

fn unstable() -> Error {
    Error::unreachable(
        "no stable equilibrium of the rod was found: every equilibrium that the search found is unstable; start from another shape, or from rest",
    )
}

/// The `count` slowest vibrations of a system with this stiffness K, damping and mass M, by rising square of the
/// frequency.
///
/// If K is positive definite, they come from (1/omega^2) K x = M x by Cholesky factors of K: low frequencies keep
/// their digits however fast the highest are. Otherwise they come from K + shift M, with 1/(omega^2 + shift). There
/// the rigid motions, 1/shift, leave rounding in the others. Their squares are then the Rayleigh quotients of their
/// shapes, whose error is the square of that of the shapes.
///
/// # Errors
/// A mass matrix that is singular to rounding where K is not positive definite.
pub(super) fn slowest(
    [stiffness, damping, mass]: [&DMatrix<f64>; 3],
    count: usize,
) -> Result<Vec<Vibration>> {
    let k = (stiffness + stiffness.transpose()) * 0.5;
    let degenerate =
        || Error::domain("the mass matrix of the rod is singular to rounding: use fewer nodes");
    // Start at the first frequency that a shift resolves, and go upwards. The stiffness of rigid motions is pure
    // rounding.
    let diagonal = k.diagonal().abs();
    let elastic = diagonal.iter().filter(|x| **x > 1e-10 * diagonal.max());
    let typical = elastic.copied().fold(f64::INFINITY, f64::min) / mass.diagonal().max();
    let shifts = (0..SHIFTS).map(|i| typical * 1e-6 * 10f64.powi(i));
    let (factors, shift) = std::iter::once(0.0)
        .chain(shifts)
        .find_map(|shift| Some(((&k + mass * shift).cholesky()?, shift)))
        .ok_or_else(degenerate)?;
    let l = factors.l();
    let half = l.solve_lower_triangular(mass).ok_or_else(degenerate)?;
    let whole = l
        .solve_lower_triangular(&half.transpose())
        .ok_or_else(degenerate)?;
    let eigen = ((&whole + whole.transpose()) * 0.5).symmetric_eigen();
    let shapes = l
        .tr_solve_lower_triangular(&eigen.eigenvectors)
        .ok_or_else(degenerate)?;
    let squares = eigen
        .eigenvalues
        .map(|x| 1.0 / x.max(f64::MIN_POSITIVE) - shift);
    let mut order: Vec<usize> = (0..k.nrows()).collect();
    sort_few(&mut order, |i| squares[*i]);
    Ok(order
        .into_iter()
        .take(count)
        .map(|i| {
            let shape: DVector<f64> = shapes.column(i).into_owned();
            let mass = shape.dot(&(mass * &shape));
            let friction = shape.dot(&(damping * &shape));
            let quotient = shape.dot(&(&k * &shape)) / mass;
            Vibration {
                square: if shift > 0.0 { quotient } else { squares[i] },
                decay: 0.5 * friction / mass,
                shape: shape / mass.sqrt(),
            }
        })
        .collect())
}
