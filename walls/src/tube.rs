//! Tubes in the units of a scene: wall laws that relate the pressure outside less inside to the area of the lumen.
//!
//! Every law is a function both ways, P(A) and A(P), with dP/dA < 0, and stores the energy U, dU = -P dA.

use crate::ring::{Ring, Section};
use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;

/// The round wall of a thick tube of neo-Hookean material, W = mu (I1 - 3)/2, at a fixed stretch along its axis.
///
/// With the radii Ri, Re of the unloaded tube and ri, re of the loaded one, re^2 - ri^2 = (Re^2 - Ri^2)/lam,
/// ```text
/// p - p_e = (mu/2) { (1/lam) ln[(Re ri/(re Ri))^2] + (1/lam^2) [(Re/re)^2 - (Ri/ri)^2] }.
/// ```
/// This corrects (65) of the report on bridging veins, which integrates with r/R as if R were constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThickWall {
    /// Shear modulus mu.
    pub shear_modulus: f64,
    /// Inner radius Ri of the unloaded tube.
    pub inner_radius: f64,
    /// Thickness of the unloaded wall.
    pub thickness: f64,
    /// Stretch lam along the axis.
    pub stretch: f64,
}

impl ThickWall {
    /// Pressure inside less outside, and its derivative by beta, where beta is the area of the lumen over pi Ri^2.
    pub fn pressure(&self, beta: f64) -> (f64, f64) {
        let (stretch, thickness) = (self.stretch, self.thickness / self.inner_radius);
        // In units of Ri: the squares of ri, Re, re.
        let (ri, outer) = (beta, (1.0 + thickness).powi(2));
        let re = ri + (outer - 1.0) / stretch;
        let pressure = (outer * ri / re).ln() / stretch + (outer / re - 1.0 / ri) / stretch.powi(2);
        let slope = (1.0 / ri - 1.0 / re) / stretch
            + (1.0 / (ri * ri) - outer / (re * re)) / stretch.powi(2);
        let scale = 0.5 * self.shear_modulus;
        (scale * pressure, scale * slope)
    }

    /// The pressure inside less outside that no state reaches: (mu/lam) ln(Re/Ri).
    pub fn greatest_pressure(&self) -> f64 {
        self.shear_modulus / self.stretch * (self.thickness / self.inner_radius).ln_1p()
    }
}

/// The wall of a thin tube of neo-Hookean material: the limit of [`ThickWall`], with an error of first order in h0/R0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinWall {
    /// Shear modulus mu.
    pub shear_modulus: f64,
    /// Radius R0 of the unloaded tube.
    pub radius: f64,
    /// Thickness h0 of the unloaded wall.
    pub thickness: f64,
    /// Stretch lam along the axis.
    pub stretch: f64,
}

impl ThinWall {
    /// mu h0/R0.
    fn scale(&self) -> f64 {
        self.shear_modulus * self.thickness / self.radius
    }

    /// Pressure inside less outside at beta = A/A0: (mu h0/(lam R0)) (1 - 1/(lam beta)^2). It grows with beta at every
    /// fixed lam.
    pub fn pressure(&self, beta: f64) -> f64 {
        self.scale() / self.stretch * (1.0 - (self.stretch * beta).powi(-2))
    }

    /// Speed of pulses in a fluid of the density `density` at beta: c^2 = 2 mu h0/(rho R0 lam^3 beta^2).
    pub fn wave_speed(&self, beta: f64, density: f64) -> f64 {
        (2.0 * self.scale() / (density * self.stretch.powi(3))).sqrt() / beta
    }

    /// (69) of the report on bridging veins as printed: (mu h0/R0) (1 - 1/beta) (1/(lam^2 beta) - beta).
    ///
    /// Two slips make it: (65) takes R out of an integral over r/R, (66) leaves out lam in 2 pi R0 h0 = 2 pi lam r h.
    /// Its maximum of the pressure, which the report takes for an aneurysm, is theirs: [`ThinWall::pressure`] has none.
    pub fn pressure_as_printed_69(&self, beta: f64) -> f64 {
        self.scale() * (1.0 - 1.0 / beta) * (1.0 / (self.stretch.powi(2) * beta) - beta)
    }

    /// (82) of the report as printed: c^2 = (mu h0/(rho R0)) (1/lam^2 - 1). It vanishes without stretch, and is not a
    /// number for lam > 1.
    pub fn wave_speed_as_printed_82(&self, density: f64) -> f64 {
        (self.scale() / density * (self.stretch.powi(-2) - 1.0)).sqrt()
    }
}

/// Algebraic law p - p_e = Kp (alpha^m - alpha^n), with m > n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// Stiffness Kp.
    pub stiffness: f64,
    /// Exponent m, which rules the inflated tube.
    pub inflated: f64,
    /// Exponent n, which rules the collapsed tube.
    pub collapsed: f64,
}

/// Wall law of a tube.
#[derive(Debug, Clone)]
pub enum WallLaw {
    /// A ring that buckles, in units of the ring's radius and bending stiffness.
    Ring(Box<Ring>),
    /// The round wall of a thick tube.
    NeoHookean(ThickWall),
    /// An algebraic law.
    Power(PowerLaw),
}

/// A tube: wall law and scales.
#[derive(Debug, Clone)]
pub struct Tube {
    law: WallLaw,
    /// Radius of the round tube, stretched and without pressure: of the middle line for a ring, of the lumen else.
    radius: f64,
    /// D/R^3 for a ring, 1 else.
    pressure_scale: f64,
}

/// A section of a tube in equilibrium, in the units of the tube.
#[derive(Debug, Clone)]
pub struct TubeSection {
    /// Pressure outside less inside.
    pub pressure: f64,
    /// Area, over that of the round tube without pressure.
    pub area_ratio: f64,
    /// Area A.
    pub area: f64,
    /// Stored energy per axial length, 0 for the round tube without pressure; dU = -pressure dA.
    pub energy: f64,
    /// dpressure/darea_ratio; minus infinity for a wall that does not stretch.
    pub slope: f64,
    /// The ring in units of R and D/R^3, for the laws that have one.
    pub ring: Option<Section>,
}

impl TubeSection {
    /// Speed of pulses in a fluid of the density `density`; infinite for a wall that does not stretch.
    pub fn wave_speed(&self, density: f64) -> f64 {
        (-self.area_ratio * self.slope / density).sqrt()
    }
}

impl Tube {
    /// A tube with the wall `ring`, the radius `radius` of the middle line and the bending stiffness `stiffness` per
    /// axial length.
    pub fn ring(ring: Ring, radius: f64, stiffness: f64) -> Self {
        Self {
            law: WallLaw::Ring(Box::new(ring)),
            radius,
            pressure_scale: stiffness / radius.powi(3),
        }
    }

    /// A tube with an algebraic law and the radius `radius` of the lumen without pressure.
    ///
    /// # Errors
    /// Exponents that make no stable tube: m must be above n.
    pub fn power(law: PowerLaw, radius: f64) -> Result<Self> {
        if !(law.inflated > law.collapsed && law.inflated >= 0.0 && law.collapsed <= 0.0) {
            return Err(Error::domain(format!(
                "the exponents [m, n] = [{}, {}] of Kp (alpha^m - alpha^n) must be m >= 0 >= n and differ, such as \
                 [10.0, -1.5]: otherwise the area does not grow with the pressure inside",
                law.inflated, law.collapsed
            )));
        }
        Ok(Self {
            law: WallLaw::Power(law),
            radius,
            pressure_scale: 1.0,
        })
    }

    /// A round thick tube of neo-Hookean material.
    pub fn neo_hookean(wall: ThickWall) -> Self {
        Self {
            radius: wall.inner_radius,
            law: WallLaw::NeoHookean(wall),
            pressure_scale: 1.0,
        }
    }

    /// The wall law.
    pub fn law(&self) -> &WallLaw {
        &self.law
    }

    /// D/R^3, the unit of pressure of a ring; 1 for other laws.
    pub fn pressure_scale(&self) -> f64 {
        self.pressure_scale
    }

    /// Radius of the round tube without pressure: of the middle line for a ring, of the lumen else.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The section under `pressure`, outside less inside.
    ///
    /// # Errors
    /// A pressure that no section has, with the extreme one; NaN.
    pub fn at_pressure(&self, pressure: f64) -> Result<TubeSection> {
        if !pressure.is_finite() {
            return Err(Error::domain(format!(
                "the pressure {pressure} outside less inside must be finite"
            )));
        }
        match &self.law {
            WallLaw::Ring(ring) => self.ring_under(ring, pressure),
            WallLaw::NeoHookean(wall) if !(-pressure < wall.greatest_pressure()) => {
                Err(Error::domain(format!(
                    "the pressure {} inside less outside must be below {}, which the round neo-Hookean tube reaches at \
                     no area",
                    -pressure,
                    wall.greatest_pressure()
                )))
            }
            WallLaw::NeoHookean(_) | WallLaw::Power(_) => self.at_area(self.area_under(pressure)?),
        }
    }

    /// The section of the area ratio `alpha` = A/A0.
    ///
    /// # Errors
    /// An area that no section has; NaN.
    pub fn at_area(&self, alpha: f64) -> Result<TubeSection> {
        if !(0.0 < alpha && alpha < f64::INFINITY) {
            return Err(Error::domain(format!(
                "the area ratio alpha = {alpha} must be finite and > 0"
            )));
        }
        if let WallLaw::Ring(ring) = &self.law {
            return self.of_ring(ring.at_area(alpha)?);
        }
        let (pressure, slope) = self.round_pressure(alpha);
        let reference = PI * self.radius.powi(2);
        Ok(TubeSection {
            pressure,
            area_ratio: alpha,
            area: alpha * reference,
            energy: reference * self.round_energy(alpha)?,
            slope,
            ring: None,
        })
    }

    /// The section of a ring under `pressure`; refusals are in the units of the tube.
    fn ring_under(&self, ring: &Ring, pressure: f64) -> Result<TubeSection> {
        let scale = self.pressure_scale;
        ring.at_pressure(pressure / scale).and_then(|section| self.of_ring(section)).map_err(|error| {
            match ring.last() {
                Some(last) if pressure > last.pressure * scale => Error::domain(format!(
                    "the pressure {pressure} outside less inside is above {}, the largest of this tube: {}",
                    last.pressure * scale,
                    ring.end_of_branch()
                )),
                _ if error.is_domain() => Error::domain(format!(
                    "the pressure {pressure} outside less inside has no section: the round tube bursts above some \
                     pressure inside"
                )),
                _ => error,
            }
        })
    }

    fn of_ring(&self, section: Section) -> Result<TubeSection> {
        Ok(TubeSection {
            pressure: section.pressure * self.pressure_scale,
            area_ratio: section.area,
            area: section.area * PI * self.radius.powi(2),
            energy: section.energy * self.pressure_scale * self.radius.powi(2),
            slope: section.slope * self.pressure_scale,
            ring: Some(section),
        })
    }

    /// Pressure outside less inside of the laws without a ring, and its derivative by alpha.
    fn round_pressure(&self, alpha: f64) -> (f64, f64) {
        match &self.law {
            WallLaw::Ring(_) => (f64::NAN, f64::NAN),
            WallLaw::NeoHookean(wall) => {
                let (pressure, slope) = wall.pressure(alpha);
                (-pressure, -slope)
            }
            WallLaw::Power(law) => {
                let (m, n) = (law.inflated, law.collapsed);
                (
                    -law.stiffness * (alpha.powf(m) - alpha.powf(n)),
                    -law.stiffness * (m * alpha.powf(m - 1.0) - n * alpha.powf(n - 1.0)),
                )
            }
        }
    }

    /// The area ratio under `pressure` of the laws without a ring: a root in the logarithm of alpha.
    fn area_under(&self, pressure: f64) -> Result<f64> {
        let off = |log: f64| self.round_pressure(log.exp()).0 - pressure;
        let mut span = 1.0;
        while span < 600.0 && !(off(-span) > 0.0 && off(span) < 0.0) {
            span *= 2.0;
        }
        let root = chandrupatla(off, (-span, off(-span)), (span, off(span)), 0.0);
        root.map(f64::exp).ok_or_else(|| {
            Error::domain(format!(
                "no area of the tube has the pressure {pressure} outside less inside"
            ))
        })
    }

    /// Energy of the laws without a ring, over A0: the integral of -P from the tube without pressure.
    fn round_energy(&self, alpha: f64) -> Result<f64> {
        match &self.law {
            WallLaw::Ring(_) => Ok(f64::NAN),
            WallLaw::Power(law) => {
                let part = |exponent: f64| {
                    if exponent == -1.0 {
                        alpha.ln()
                    } else {
                        (alpha.powf(exponent + 1.0) - 1.0) / (exponent + 1.0)
                    }
                };
                Ok(law.stiffness * (part(law.inflated) - part(law.collapsed)))
            }
            WallLaw::NeoHookean(_) => {
                let (from, to) = (self.area_under(0.0)?.ln(), alpha.ln());
                let rule = Rule::new(48);
                let nodes = rule.nodes.iter().zip(&rule.weights);
                let part = |(node, weight): (&f64, &f64)| {
                    let beta = (from + (to - from) * node).exp();
                    -weight * (to - from) * beta * self.round_pressure(beta).0
                };
                Ok(nodes.map(part).sum())
            }
        }
    }
}
