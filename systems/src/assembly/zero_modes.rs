//! Zero modes of an assembly: motions that a symmetry leaves free, so that they cost nothing (theory 3.4).
//!
//! Under a symmetry each rod moves as a rigid body, and an isotropic rod spins beside: its sections turn about their
//! tangents. Seen from its base such a rod keeps its chart q = (m(0), n) but for the spin a about d3 of the base,
//! ```text
//! q' = -a (e3 x m(0), e3 x n).
//! ```
//! Motions of the bodies and nodes together with these spins are the candidates, the columns of T. A combination c is a
//! zero mode if J T c = 0 with J the Jacobian of the equations of statics: gaps stay closed and forces in balance. At a
//! fold or a branch point other charts change, so that a critical motion is no candidate.
//!
//! The equations are singular where there is a zero mode z. Under loads with a potential J^T has the null vector l. In
//! its rows of balance l has the motions of the bodies; the rows of the gaps follow from those of the charts,
//! ```text
//! l_gap = -(J_gap,chart)^-T (J_balance,chart)^T l_balance.
//! ```
//! A rod may spin while its ends rest, as between coaxial clamps of the ground. Its block G of J_gap,chart is then
//! singular.
//! Two changes of the chart keep the symplectic form of the end of the rod,
//! ```text
//! (rotation, position)_1.(couple, force)_2 - (rotation, position)_2.(couple, force)_1 = 0,
//! ```
//! because the base is clamped. A spin z moves the end nowhere. The change (m'(1), n') of the wrench at the end by z is
//! therefore at right angles to all displacements of the end. This is the null vector u of G^T. G + u z^T takes the
//! place of G, and u is added to l.
//!
//! Along a branch each zero mode keeps its phase: t.(x - x_0) = 0, with x_0 and t = z of the equilibrium at the start.
//! This times l is added to the equations. J + l t^T is singular at true folds and branch points alone.

use super::configuration::Configuration;
use super::equations::UnknownScales;
use super::guide::Guide;
use super::network::Assembly;
use super::rod_element::LinkPoint;
use crate::error::Result;
use crate::math::se3::{halves, join, left_jacobian};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

/// A motion c costs nothing if the norm of J T c is at most this part of the norm of J.
const NEUTRAL: f64 = 1e-9;
/// Ratio of the least pivot of a matrix to its least singular value beyond which the second is not looked at.
const SURELY: f64 = 1e3;
/// Bound in place of [`NEUTRAL`] near an equilibrium that has the zero mode.
const NEARLY: f64 = 1e-3;
/// A spin that changes the chart of a rod by less than this part leaves the rod as it is.
const AT_REST: f64 = 1e-9;
/// Part of a motion, of length 1 in the unknowns, that is rounding.
const STANDING: f64 = 1e-7;

/// A motion of an assembly that costs nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FreeMotion {
    /// All sections of the rod with this number turn about their own tangents.
    Spin(usize),
    /// Parts turn about an axis with this unit vector, through the point nearest to the origin.
    Turn {
        /// Direction.
        axis: Vector3<f64>,
        /// Point of the axis.
        through: Vector3<f64>,
    },
    /// Parts move along this unit vector.
    Slide(Vector3<f64>),
}

/// The phase that zero modes keep along a branch: their unknowns at its start, and themselves there as columns.
#[derive(Debug, Clone)]
pub(super) struct FreePhase {
    at: DVector<f64>,
    along: DMatrix<f64>,
}

/// Candidates for zero modes: columns of unit length in the unknowns, first one for each freedom of the bodies.
struct Candidates {
    columns: DMatrix<f64>,
    bodies: usize,
    /// Rods that may spin, and the angle of the spin of the candidate.
    spins: Vec<(usize, f64)>,
}

impl Candidates {
    fn new(assembly: &Assembly, now: &Configuration) -> Self {
        let bodies = assembly.freedoms().1;
        let size = assembly.unknowns();
        let mut columns: Vec<DVector<f64>> = (0..bodies)
            .map(|i| DVector::from_fn(size, |j, _| f64::from(u8::from(i == j))))
            .collect();
        let mut spins = Vec::new();
        for (k, (link, q)) in assembly.links().iter().zip(&now.charts).enumerate() {
            let (m, n) = halves(q);
            let spun: Vector6<f64> = -join(&Vector3::z().cross(&m), &Vector3::z().cross(&n));
            let length = spun.norm();
            if length > AT_REST * (1.0 + q.norm()) && link.rod().is_axisymmetric() {
                let mut column = DVector::zeros(size);
                column
                    .rows_mut(bodies + 6 * k, 6)
                    .copy_from(&(spun / length));
                columns.push(column);
                spins.push((k, 1.0 / length));
            }
        }
        Self {
            columns: beside(size, &columns),
            bodies,
            spins,
        }
    }

    /// The spin of rod `k`, of length 1 in its chart, if its ends stay where they are up to `apart`; `gap` is the
    /// derivative of the gap of the rod by its chart.
    fn spin_alone(&self, k: usize, gap: &Matrix6<f64>, apart: f64) -> Option<Vector6<f64>> {
        let number = self.spins.iter().position(|(rod, _)| *rod == k)?;
        let column = self.columns.column(self.bodies + number);
        let spin = column.fixed_rows::<6>(self.bodies + 6 * k).into_owned();
        ((gap * spin).norm() <= apart).then_some(spin)
    }

    /// Combinations of candidates that cost nothing, as orthonormal columns. Off equilibrium J T c is as large as the
    /// residual: there the least `known` are taken.
    fn neutral(&self, jacobian: &DMatrix<f64>, known: usize) -> DMatrix<f64> {
        let count = self.columns.ncols();
        let none = DMatrix::zeros(count, 0);
        let moved = jacobian * &self.columns;
        if count == 0 || !moved.iter().all(|x| x.is_finite()) {
            return none;
        }
        let size = jacobian.norm();
        let bound = if known > 0 { NEARLY } else { NEUTRAL };
        // The least pivot is near the least singular value, at a fraction of the cost.
        let pivots = moved.clone().col_piv_qr().r().diagonal().abs();
        if pivots.min() > SURELY * bound * size {
            return none;
        }
        let parts = moved.svd(false, true);
        let Some(v_t) = parts.v_t else {
            return none;
        };
        // Singular values fall.
        let free = (0..count).filter(|i| {
            let within = if count - i <= known { NEARLY } else { NEUTRAL };
            parts.singular_values[*i] <= within * size
        });
        let free: Vec<_> = free.map(|i| v_t.row(i).transpose()).collect();
        beside(count, &free)
    }
}

/// The matrix with these columns of length `rows`.
fn beside(rows: usize, columns: &[DVector<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns.len(), |i, j| columns[j][i])
}

/// The columns of `rest` without their parts along `by`; columns that vanish are dropped.
fn without(rest: &DMatrix<f64>, by: &DVector<f64>) -> DMatrix<f64> {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for column in rest.column_iter() {
        let mut left = column - by * (by.dot(&column) / by.norm_squared());
        for other in &kept {
            left -= other * other.dot(&left);
        }
        if left.norm() > STANDING {
            kept.push(left.normalize());
        }
    }
    beside(rest.nrows(), &kept)
}

/// Sparse basis of the columns' space: Gauss-Jordan elimination with column pivots.
fn sparse(mut basis: DMatrix<f64>) -> DMatrix<f64> {
    for k in 0..basis.ncols() {
        let row = basis.column(k).iamax();
        let pivot = basis[(row, k)];
        basis.column_mut(k).unscale_mut(pivot);
        for j in (0..basis.ncols()).filter(|j| *j != k) {
            let by = basis[(row, j)];
            let taken = basis.column(k) * by;
            let mut column = basis.column_mut(j);
            column -= taken;
        }
    }
    for mut column in basis.column_iter_mut() {
        column.normalize_mut();
    }
    basis
}

impl Assembly {
    /// Motions of an equilibrium that cost nothing by a symmetry. They are left out of the index.
    ///
    /// # Errors
    /// As [`super::Link::end`].
    pub fn zero_modes(&self, now: &Configuration, tolerance: f64) -> Result<Vec<FreeMotion>> {
        let points = self.points(0.0, &now.bodies, &now.charts, tolerance)?;
        let candidates = Candidates::new(self, now);
        let frame = UnknownScales::new(self, now.bodies.iter().map(|place| place.pose));
        let x = frame.unknowns(self, now);
        let jacobian = frame.jacobian(self, x.as_slice(), &now.bodies, &points);
        let mut rest = candidates.neutral(&jacobian, 0);
        let mut found = Vec::new();
        for (number, (k, angle)) in candidates.spins.iter().enumerate() {
            let alone = self.spun(
                *k,
                *angle,
                &points[*k],
                candidates.bodies + number,
                &candidates,
            );
            let spun = rest.tr_mul(&alone).norm();
            if spun > (1.0 - STANDING) * alone.norm() {
                found.push(FreeMotion::Spin(*k));
                rest = without(&rest, &alone);
            }
        }
        let rest = sparse(rest);
        let motions = rest.column_iter();
        found.extend(motions.filter_map(|c| {
            let c = c.into_owned();
            self.described_motion(now, &frame, &points, &candidates, &c)
        }));
        Ok(found)
    }

    /// The spin of rod `k` alone as a combination of candidates: nodes at its ends turn along with the rod.
    fn spun(
        &self,
        k: usize,
        angle: f64,
        point: &LinkPoint,
        column: usize,
        candidates: &Candidates,
    ) -> DVector<f64> {
        let mut alone = DVector::zeros(candidates.columns.ncols());
        alone[column] = 1.0;
        let link = &self.links()[k];
        let starts = self.freedoms().0;
        let tangents = [
            point.base.pose.rotation * Vector3::z(),
            point.base.pose.rotation * (point.end.pose.rotation * Vector3::z()),
        ];
        for (site, tangent) in [link.from(), link.to()].into_iter().zip(tangents) {
            let node = site.carried_by();
            let ball =
                node.filter(|node| self.carriers()[*node].joint().is_some_and(Guide::is_ball));
            if let Some(node) = ball {
                let mut turn = alone.rows_mut(starts[node], 3);
                turn += tangent * angle;
            }
        }
        alone
    }

    /// The rigid motion of the first part that moves in the combination `c` of candidates.
    fn described_motion(
        &self,
        now: &Configuration,
        frame: &UnknownScales,
        points: &[LinkPoint],
        candidates: &Candidates,
        c: &DVector<f64>,
    ) -> Option<FreeMotion> {
        let (starts, _) = self.freedoms();
        let own = self.own_twists(&now.bodies);
        let velocities = frame.twists(self, &(&candidates.columns * c));
        let rods = self.links().iter().zip(points).enumerate();
        let rods = rods.map(|(k, (link, point))| {
            let mut twist = Vector6::zeros();
            for (start, twists) in self.twists_of(&link.from, &now.bodies, (&starts, &own)) {
                twist += &twists * velocities.rows(start, twists.ncols());
            }
            let (mut spin, velocity) = halves(&twist);
            let number = candidates.spins.iter().position(|(rod, _)| *rod == k);
            if let Some(number) = number {
                let angle = candidates.spins[number].1 * c[candidates.bodies + number];
                spin -= point.base.pose.rotation * Vector3::z() * angle;
            }
            (spin, velocity, point.base.pose.translation.vector)
        });
        let bodies = own.iter().zip(&starts).zip(&now.bodies);
        let bodies = bodies.map(|((own, start), place)| {
            let twist = own * velocities.rows(*start, own.ncols());
            let (spin, velocity) = halves(&twist);
            (spin, velocity, place.pose.translation.vector)
        });
        let mut parts = rods.chain(bodies);
        let (spin, velocity, at) =
            parts.find(|(spin, velocity, _)| spin.norm() + velocity.norm() > STANDING)?;
        let size = spin.norm();
        if size <= STANDING {
            return Some(FreeMotion::Slide(upright(velocity.normalize())));
        }
        let whole = velocity - spin.cross(&at);
        Some(FreeMotion::Turn {
            axis: upright(spin / size),
            through: spin.cross(&whole) / (size * size),
        })
    }

    /// Displacements of the bodies, in their own velocities, by the zero modes: one column each.
    pub(super) fn free_displacements(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
    ) -> DMatrix<f64> {
        let candidates = Candidates::new(self, now);
        let frame = UnknownScales::new(self, now.bodies.iter().map(|place| place.pose));
        let x = frame.unknowns(self, now);
        let jacobian = frame.jacobian(self, x.as_slice(), &now.bodies, points);
        let free = &candidates.columns * candidates.neutral(&jacobian, 0);
        let columns = free.column_iter();
        let columns: Vec<_> = columns
            .map(|z| frame.twists(self, &z.into_owned()))
            .collect();
        beside(candidates.bodies, &columns)
    }

    /// The phase of the zero modes at an equilibrium, in the unknowns of `frame`; None without zero modes.
    ///
    /// # Errors
    /// As [`super::Link::end`].
    pub(super) fn free_phase(
        &self,
        frame: &UnknownScales,
        now: &Configuration,
        tolerance: f64,
    ) -> Result<Option<FreePhase>> {
        let points = self.points(0.0, &now.bodies, &now.charts, tolerance)?;
        let candidates = Candidates::new(self, now);
        let at = frame.unknowns(self, now);
        let jacobian = frame.jacobian(self, at.as_slice(), &now.bodies, &points);
        let along = &candidates.columns * candidates.neutral(&jacobian, 0);
        Ok((along.ncols() > 0).then_some(FreePhase { at, along }))
    }

    /// Adds to the equations at the unknowns `x` that the zero modes keep their phase. Only folds and branch points
    /// then make the Jacobian singular.
    pub(super) fn hold_phase(
        &self,
        x: &DVector<f64>,
        now: &Configuration,
        points: &[LinkPoint],
        phase: &FreePhase,
        residual: &mut DVector<f64>,
        jacobian: &mut DMatrix<f64>,
    ) {
        let candidates = Candidates::new(self, now);
        let free = &candidates.columns * candidates.neutral(jacobian, phase.along.ncols());
        let (bodies, size) = (candidates.bodies, jacobian.nrows());
        if free.ncols() == 0 {
            return;
        }
        // The present zero modes that continue the zero modes at the start of the branch.
        let free = &free * free.tr_mul(&phase.along);
        let mut against = DMatrix::zeros(size, free.ncols());
        let (starts, _) = self.freedoms();
        against.rows_mut(0, bodies).copy_from(&free.rows(0, bodies));
        for (start, carrier) in starts.iter().zip(self.carriers()) {
            if carrier.guide().map_or(carrier.turns(), Guide::is_ball) {
                let turn = left_jacobian(&Vector3::new(x[*start], x[start + 1], x[start + 2]));
                let turned = turn * against.rows(*start, 3);
                against.rows_mut(*start, 3).copy_from(&turned);
            }
        }
        let mut still = DMatrix::zeros(size, free.ncols());
        for (k, link) in self.links().iter().enumerate() {
            let first = bodies + 6 * k;
            let by_chart = jacobian.view((0, first), (bodies, 6));
            let driven = -by_chart.tr_mul(&against.rows(0, bodies));
            let mut gap: Matrix6<f64> = jacobian.fixed_view::<6, 6>(first, first).into_owned();
            if let Some(spin) = candidates.spin_alone(k, &gap, NEARLY * jacobian.norm()) {
                let end = &points[k].end;
                let (force, couple) = halves(&(end.resultants.fixed_rows::<6>(3) * spin));
                let scale = link.gap_scale(end).diagonal();
                let held = join(&couple, &force).component_div(&scale).normalize();
                gap += held * spin.transpose();
                let held = held * (spin.transpose() * free.fixed_rows::<6>(first));
                still.rows_mut(first, 6).copy_from(&held);
            }
            let Some(follow) = gap.transpose().lu().solve(&driven) else {
                return;
            };
            against.rows_mut(first, 6).copy_from(&follow);
        }
        against += still;
        let scale = jacobian.norm() / (size as f64).sqrt() / against.norm();
        if scale.is_finite() {
            against *= scale;
            *residual += &against * phase.along.tr_mul(&(x - &phase.at));
            *jacobian += against * phase.along.transpose();
        }
    }
}

/// `v` or `-v`, with the sign that makes the last nonzero component positive.
fn upright(v: Vector3<f64>) -> Vector3<f64> {
    let last = v.iter().rev().find(|x| x.abs() > STANDING);
    v * last.map_or(1.0, |x| x.signum())
}
