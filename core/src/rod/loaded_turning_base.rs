//! End of a rod with loads along it, with the tangents that a turning base needs (theory 3.8).
//!
//! Without a load the end turns rigidly with the base, at a given base wrench along its directors. A load does not
//! turn with the base. Seen from the base the end then moves by
//!
//! ```text
//! d(phi, r)(1) = [T (psi x m(0), psi x n(0)) + T_psi psi] - (psi, psi x r(1)),
//! ```
//!
//! T the tangent by the base wrench, T_psi that by a turn psi of the base at a given base wrench and load: three more
//! columns of the same equations, which begin at phi(0) = psi. Loads along the directors turn with the base, and have
//! no such effect of their own.

use super::RodSection;
use super::distributed_load::{LoadMoment, LoadState, ScaledLoad};
use super::first_order_mass::{Trace, Tracked};
use super::follower_load::FollowedMoment;
use super::ivp;
use super::ivp::{LineState, Wrench};
use super::ivp_trace;
use super::problem::Problem;
use crate::error::Result;
use crate::math::se3::halves;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, RowVector3, RowVector6, SMatrix};

/// Power of the loads along a rod that have no potential, in the world and the user's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPower {
    /// By the rate of the base wrench (m(0), n(0)) along the directors of a fixed base.
    pub by_wrench: RowVector6<f64>,
    /// By the angular velocity of the base at the same base wrench along its directors; 0 if not asked for. The
    /// velocity of the base adds its product with the whole force of these loads.
    pub by_turn: RowVector3<f64>,
}

/// The end of a rod under a load along it, in the world and the user's units.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedEnd {
    /// The section at s = L, with the couple and the force there.
    pub section: RodSection,
    /// d(phi, r)(L)/d(m(0), n(0)).
    pub tangent: Matrix6<f64>,
    /// d m(L)/d(m(0), n(0)).
    pub couple: Matrix3x6<f64>,
    /// d(n(L) - n(0))/d(m(0), n(0)): 0 unless a load turns with the rod.
    pub taken: Matrix3x6<f64>,
    /// Potential -int f.r ds of the load.
    pub potential: f64,
    /// d(phi, r, m, n)(L), seen from the clamp, by a turn of the clamp at the same base wrench along its directors: the
    /// effect of the dead load, which does not turn along. None if not asked for.
    pub by_turn: Option<SMatrix<f64, 12, 3>>,
    /// Power of the loads without a potential; `None` without such loads.
    pub power: Option<LoadPower>,
}

impl Problem {
    /// The end of the rod under the base wrench (m(0), n(0)), with its exact tangents; `turns` asks for the tangent
    /// by a turn of the clamp, which costs half as much again.
    ///
    /// # Errors
    /// As [`super::Rod::end`].
    pub fn loaded_end(&self, base: &Wrench, turns: bool) -> Result<LoadedEnd> {
        if !turns {
            self.with_columns::<6>(base)
        } else {
            self.with_columns::<9>(base)
        }
    }

    /// The end as [`Problem::loaded_end`], with the record of the integration.
    ///
    /// # Errors
    /// As [`super::Rod::end`].
    pub fn traced_loaded_end(&self, base: &Wrench, turns: bool) -> Result<(LoadedEnd, Trace)> {
        Ok(if !turns {
            let (end, trace) = self.track_end::<6>(base)?;
            (end, Trace::held(trace))
        } else {
            let (end, trace) = self.track_end::<9>(base)?;
            (end, Trace::turning(trace))
        })
    }

    fn track_end<const K: usize>(
        &self,
        base: &Wrench,
    ) -> Result<(LoadedEnd, Tracked<K, LoadMoment<K>>)> {
        let nothing = ScaledLoad::nothing();
        let weight = self.weight.as_ref().unwrap_or(&nothing);
        let (rod, b) = (&self.rod, self.rod.inward(base));
        let (at, _, track) =
            ivp_trace::tracked_end::<K, LoadMoment<K>>(&rod.law, weight, &b, self.tolerance)?;
        Ok((self.described(&at, &b, weight)?, (track, at)))
    }

    fn with_columns<const K: usize>(&self, base: &Wrench) -> Result<LoadedEnd> {
        let (rod, b) = (&self.rod, self.rod.inward(base));
        if let Some(loads) = &self.followed() {
            let (at, _) =
                ivp::loaded_end::<K, FollowedMoment<K>>(&rod.law, loads, &b, self.tolerance)?;
            return self.described(&at, &b, loads);
        }
        let nothing = ScaledLoad::nothing();
        let weight = self.weight.as_ref().unwrap_or(&nothing);
        let (at, _) = ivp::loaded_end::<K, LoadMoment<K>>(&rod.law, weight, &b, self.tolerance)?;
        self.described(&at, &b, weight)
    }

    fn described<const K: usize, C: LoadState<K>>(
        &self,
        at: &LineState<K, C>,
        b: &Wrench,
        load: &C::Load,
    ) -> Result<LoadedEnd> {
        let rod = &self.rod;
        let (couple, force) = rod.units();
        let (m, n) = at.resultants(b, load);
        let mut taken = [[0.0; K]; 3];
        at.carried.take_columns(&mut taken);
        let r = at.position();
        let followed = at.carried.taken_force();
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        // Derivatives of (phi, r, m, n)(1), in the numerics' units: dn(1) = dn(0) - dg,
        // dm(1) = dm(0) - r x dn(1) - rho x n(1) - dw.
        let mut by = SMatrix::<f64, 12, K>::from_fn(|i, j| match i {
            0..6 => at.tangent[i][j],
            6..9 => taken[i - 6][j] + unit(i - 6, j),
            _ => unit(i - 6, j) - followed.map_or(0.0, |dg| dg[i - 9][j]),
        });
        let pulled =
            n.cross_matrix() * by.fixed_rows::<3>(3) - r.cross_matrix() * by.fixed_rows::<3>(9);
        let mut couples = by.fixed_rows_mut::<3>(6);
        couples += pulled;
        // The base wrench turns with the directors.
        let (m0, n0) = halves(b);
        let mut turned = SMatrix::<f64, 6, 3>::zeros();
        for (row, f) in [(0, m0), (3, n0)] {
            let mut part = turned.fixed_rows_mut::<3>(row);
            part -= f.cross_matrix();
        }
        let power = at.carried.power().map(|power| {
            let power = SMatrix::<f64, 1, K>::from_row_slice(power);
            let by_wrench = power.fixed_columns::<6>(0).into_owned();
            let by_turn = if K == 9 {
                by_wrench * turned + power.fixed_columns::<3>(K - 3)
            } else {
                RowVector3::zeros()
            };
            (by_wrench, by_turn)
        });
        let by_turn = (K == 9).then(|| {
            // The rigid rotation is subtracted.
            let mut rigid = SMatrix::<f64, 12, 3>::zeros();
            rigid.fixed_rows_mut::<3>(0).fill_with_identity();
            for (row, f) in [(3, r), (6, m), (9, n)] {
                let mut part = rigid.fixed_rows_mut::<3>(row);
                part -= f.cross_matrix();
            }
            by.fixed_columns::<6>(0) * turned + by.fixed_columns::<3>(6) - rigid
        });
        let turn = rod.clamp.rotation.to_rotation_matrix();
        let units = [1.0, rod.length, couple, force];
        let outward = |of: usize, by: Matrix3<f64>, unit: f64| {
            turn.matrix() * by * turn.matrix().transpose() * (units[of] / unit)
        };
        let mut all = SMatrix::<f64, 12, 6>::zeros();
        for (column, unit) in [(0, couple), (3, force)] {
            for of in 0..4 {
                let block = outward(of, by.fixed_view::<3, 3>(3 * of, column).into(), unit);
                all.fixed_view_mut::<3, 3>(3 * of, column).copy_from(&block);
            }
        }
        let mut taken = all.fixed_rows::<3>(9).into_owned();
        let mut own = taken.fixed_columns_mut::<3>(3);
        own -= Matrix3::identity();
        let by_turn = by_turn.map(|by: SMatrix<f64, 12, 3>| {
            let mut turned = by;
            for of in 0..4 {
                let block = outward(of, by.fixed_rows::<3>(3 * of).into(), 1.0);
                turned.fixed_rows_mut::<3>(3 * of).copy_from(&block);
            }
            turned
        });
        let power = power.map(|(by_wrench, by_turn)| {
            let back = turn.matrix().transpose();
            let mut outward = by_wrench;
            for (column, unit) in [(0, 1.0), (3, couple / force)] {
                let part = by_wrench.fixed_columns::<3>(column) * back * unit;
                outward.fixed_columns_mut::<3>(column).copy_from(&part);
            }
            LoadPower {
                by_wrench: outward,
                by_turn: by_turn * back * couple,
            }
        });
        let nothing = ScaledLoad::nothing();
        let dead = self.weight.as_ref().unwrap_or(&nothing);
        Ok(LoadedEnd {
            section: rod.outward(at, b, load)?,
            tangent: all.fixed_rows::<6>(0).into_owned(),
            couple: all.fixed_rows::<3>(6).into_owned(),
            taken,
            potential: dead.potential(LoadState::<K>::work(&at.carried)) * couple,
            by_turn,
            power,
        })
    }
}
