//! Friction that becomes infinite at total compression: AMV (2.40), (2.41).
//!
//! Let h1, h2 be the half-widths of the section, V^2 = h2^2 u1^2 + h1^2 u2^2 and delta = v3 - V. The fibres keep
//! their orientation if delta > 0 (2.7), as in [`Barrier`](crate::section::Barrier). delta has no gradient on the
//! axis u1 = u2 = 0 of the cone, so that a law in terms of delta would not be smooth for straight rods. Instead the
//! law uses
//! ```text
//! d = (v3^2 - V^2)/v3 = delta (1 + V/v3),    delta <= d <= 2 delta,    d = v3 for a straight section.
//! ```
//! d is analytic in the cone, homogeneous of degree 1 as delta is, and zero where delta is. The law
//! ```text
//! D = H e_t + Omega(d) d_t g,   g = d(d)/de,   d_t = g.e_t,   Omega = strength/d
//! ```
//! is symmetric and dissipates Omega d_t^2 more than H does. Its inverse is that of a matrix of rank one more:
//! ```text
//! d_t = g.H^-1 w/(1 + Omega c),   c = g.H^-1 g,   e_t = H^-1 (w - Omega d_t g).
//! ```
//! Hence (1 + Omega c) d_t = g.H^-1 w. The integral of Omega over (0, d) is infinite: d cannot reach zero as long as
//! the integral of the overstress over time is finite, which is the argument of (7.14). (For that argument the bound
//! (2.41) is to be read n3 <= +Omega delta_t + C for delta_t < 0: friction resists compression.)

use super::active_strains::{check_constraints, free_overstress};
use super::{Rate, RateLaw, Viscosity};
use crate::error::{Error, Result, check_finite};
use crate::section::{BarrierTerm, Resultant, Strain};
use nalgebra::{Matrix6, Vector6};

/// The law D = H e_t + Omega(d) d_t d(d)/de with Omega = strength/d, d = (v3^2 - V^2)/v3: linear in the rates, with a
/// viscosity that is infinite at total compression (see the head of the module).
#[derive(Debug, Clone)]
pub struct FrictionBarrier {
    viscosity: Viscosity,
    term: BarrierTerm,
}

/// d and its derivatives.
struct Depth {
    value: f64,
    slope: Vector6<f64>,
    curvature: Matrix6<f64>,
}

impl FrictionBarrier {
    /// The viscosity H with a friction barrier for a section of `half_widths` h1, h2 along d1, d2. `strength` is the
    /// increase of the axial viscosity of a straight unstretched section, in the same units.
    ///
    /// # Errors
    /// Half-widths or a strength not finite and > 0; a viscosity that holds v3 rigid.
    pub fn new(viscosity: Viscosity, half_widths: [f64; 2], strength: f64) -> Result<Self> {
        let term = BarrierTerm::new(half_widths, strength)?;
        if viscosity.rigid()[5] {
            return Err(Error::domain(
                "a law that holds v3 rigid cannot have a friction barrier against total compression: \
                 give an axial viscosity, or leave the barrier out",
            ));
        }
        Ok(Self { viscosity, term })
    }

    /// Omega(d), d > 0.
    pub fn friction(&self, depth: f64) -> f64 {
        self.term.strength / depth
    }

    /// d = (v3^2 - V^2)/v3.
    ///
    /// # Errors
    /// Strains at or beyond total compression, v3 <= V.
    pub fn depth(&self, e: &Strain) -> Result<f64> {
        check_finite("strains", e.as_slice())?;
        let compressed = self.term.checked_limit(e)?;
        Ok((e[5] - compressed) * (1.0 + compressed / e[5]))
    }

    fn at(&self, e: &Strain) -> Result<Depth> {
        let value = self.depth(e)?;
        let [b, a] = self.term.half_widths.map(|h| h * h);
        let (x, y, v) = (e[0] / e[5], e[1] / e[5], e[5]);
        let flat = a * x * x + b * y * y;
        let slope = Vector6::new(-2.0 * a * x, -2.0 * b * y, 0.0, 0.0, 0.0, 1.0 + flat);
        let mut curvature = Matrix6::zeros();
        curvature[(0, 0)] = -2.0 * a / v;
        curvature[(1, 1)] = -2.0 * b / v;
        curvature[(5, 5)] = -2.0 * flat / v;
        for (k, entry) in [(0, 2.0 * a * x / v), (1, 2.0 * b * y / v)] {
            curvature[(k, 5)] = entry;
            curvature[(5, k)] = entry;
        }
        Ok(Depth {
            value,
            slope,
            curvature,
        })
    }
}

impl RateLaw for FrictionBarrier {
    fn rate(&self, s: f64, e: &Strain, overstress: &Resultant) -> Result<Rate> {
        let driving = free_overstress(overstress, self.viscosity.rigid())?;
        let inverse = self.viscosity.at(s)?.inverse;
        let depth = self.at(e)?;
        let across = inverse * depth.slope;
        // In terms of 1/Omega, which is 0 at total compression, where Omega is infinite.
        let give = depth.value / self.term.strength;
        let c = depth.slope.dot(&across);
        let share = give / (give + c);
        let push = across.dot(&driving);
        // Friction force Omega d_t.
        let friction = push / (give + c);
        // Rate at constant d, projected twice off H^-1 g: near total compression it is small and must keep its
        // digits.
        let mut rate = inverse * driving - across * (push / c);
        rate -= across * (depth.slope.dot(&rate) / c);
        rate += across * (push / c * share);
        let by_overstress = inverse - across * across.transpose() / (give + c);
        // dD/de at fixed e_t is Omega' d_t g g^T + Omega d_t G + Omega g (G e_t)^T, Omega' = -Omega/d.
        let along = depth.slope * (-friction / depth.value);
        let turned = depth.curvature * rate;
        let by_strain = -(across * (along * share).transpose()
            + by_overstress * depth.curvature * friction
            + across * turned.transpose() / (give + c));
        Ok(Rate {
            rate,
            by_overstress,
            by_strain,
        })
    }

    fn overstress(&self, s: f64, e: &Strain, rate: &Strain) -> Result<Resultant> {
        check_constraints(rate, self.viscosity.rigid())?;
        let depth = self.at(e)?;
        let friction = self.friction(depth.value) * depth.slope.dot(rate);
        let rigid = self.viscosity.rigid();
        let barrier = Vector6::from_fn(|k, _| if rigid[k] { 0.0 } else { depth.slope[k] });
        Ok(self.viscosity.at(s)?.matrix * rate + barrier * friction)
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn rigid(&self) -> [bool; 6] {
        self.viscosity.rigid()
    }

    fn breaks(&self) -> Vec<f64> {
        self.viscosity.breaks()
    }
}
