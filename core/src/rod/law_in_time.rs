//! Rods whose section law W(e, s, t) varies in time (theory 3.8).
//!
//! At a given base wrench the strains follow the law: `W_ee e_t = -W_et` at fixed resultants. So the end moves by the
//! equations of the tangent with one more term, `phi_t' = R u_t + ..` and `r_t' = R v_t + ..`. The drive works at the
//! rate `int W_t ds`, by which the stored energy grows at fixed strains.

use super::Rod;
use super::distributed_load::{LoadMoment, LoadState, ScaledLoad};
use super::ivp::{TIME, Wrench, end_in_time};
use super::problem::Problem;
use crate::error::Result;
use nalgebra::Vector3;

/// Rates of the end of a rod whose law varies in time, at a given base wrench, in the world and the user's units.
#[derive(Debug, Clone, PartialEq)]
pub struct EndRates {
    /// Angular velocity of the end.
    pub turn: Vector3<f64>,
    /// Velocity of the end.
    pub position: Vector3<f64>,
    /// Rate of the couple m(L).
    pub couple: Vector3<f64>,
    /// Power of the drive on the whole rod.
    pub power: f64,
}

impl Rod {
    /// Rates of the end at the base wrench (m(0), n).
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn end_rates(&self, base: &Wrench, tolerance: f64) -> Result<EndRates> {
        self.rates_under::<()>(&(), base, tolerance)
    }

    fn rates_under<C: LoadState<TIME>>(
        &self,
        load: &C::Load,
        base: &Wrench,
        tolerance: f64,
    ) -> Result<EndRates> {
        let b = self.inward(base);
        let at = end_in_time::<C>(&self.law, load, &b, tolerance)?;
        let part = |from: usize| Vector3::from_fn(|i, _| at.tangent[from + i][0]);
        let (turn, position) = (part(0), part(3));
        let (_, n) = at.resultants(&b, load);
        let mut taken = [[0.0; TIME]; 3];
        at.carried.take_columns(&mut taken);
        let couple = n.cross(&position) + Vector3::from_fn(|i, _| taken[i][0]);
        let (outward, unit) = (self.clamp.rotation, self.units().0);
        Ok(EndRates {
            turn: outward * turn,
            position: outward * position * self.length,
            couple: outward * couple * unit,
            power: at.energy() * unit,
        })
    }
}

impl Problem {
    /// Rates of the end under the load along the rod, at the base wrench (m(0), n(0)).
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn end_rates(&self, base: &Wrench) -> Result<EndRates> {
        let nothing = ScaledLoad::nothing();
        let weight = self.weight.as_ref().unwrap_or(&nothing);
        self.rod
            .rates_under::<LoadMoment<TIME>>(weight, base, self.tolerance)
    }
}
