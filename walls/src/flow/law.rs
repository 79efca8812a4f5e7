//! Wall laws of flows: pressure and energy over the area, and waves of the fluid that the wall holds.
//!
//! Areas are in A0, pressures in Kp, energies per length in A0 Kp, speeds in (Kp/rho)^1/2. With Phi = p - p_e, the
//! pressure inside less outside, and the energy U, dU = Phi da,
//!
//! ```text
//! a_t + (a u)_x = 0,   (a u)_t + (a u^2 + Pi)_x = 0,   Pi = a Phi - U,   c^2 = a dPhi/da.
//! ```
//!
//! Over the volume of fluid these are the equations of a [`Law1d`] with lam = 1/a, sigma = -Pi and W = U/a.

use super::Place;
use crate::ring::{Contact, Ring, RingTable};
use crate::tube::{PowerLaw, ThickWall, Tube, WallLaw};
use snaprod_core::{Error, Result};
use snaprod_waves::law1d::{Law1d, Panels, sign_changes};
use std::f64::consts::PI;

/// Areas between which changes of curvature are sought, and the factor of a step of the search.
const SOUGHT: [f64; 2] = [0.02, 20.0];
const FINE: f64 = 1.02;

/// Wall law of a flow.
#[derive(Debug, Clone)]
pub struct FlowLaw {
    kind: Kind,
    /// Interval of lam = 1/a.
    reach: [f64; 2],
    bends: Vec<f64>,
    /// Values of lam at which the law is not smooth.
    knots: Vec<f64>,
    panels: Panels,
}

#[derive(Debug, Clone)]
enum Kind {
    /// a^m - a^n.
    Power([f64; 2]),
    /// A thick round wall with the shear modulus 1, inner radius 1.
    Thick(ThickWall),
    /// A ring. Above a = 1 it is round, with the stiffness `hoop` k against stretching.
    Ring {
        table: Box<RingTable>,
        hoop: Option<f64>,
        buckling: f64,
    },
}

/// The wall at an area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallState {
    /// Energy U.
    pub energy: f64,
    /// Pressure Phi inside less outside.
    pub pressure: f64,
    /// dPhi/da.
    pub slope: f64,
}

impl WallState {
    /// Pi = a Phi - U.
    pub fn thrust(&self, area: f64) -> f64 {
        area * self.pressure - self.energy
    }
}

impl FlowLaw {
    /// The law of a tube, and the tube's A0 and Kp without a pressure outside. `hoop` is the stiffness of a ring as in
    /// [`FlowLaw::ring`].
    ///
    /// # Errors
    /// An extensible ring: its table ends at contact along a line.
    pub fn of(tube: &Tube, hoop: Option<f64>) -> Result<(Self, Place)> {
        let (law, stiffness) = match tube.law() {
            WallLaw::Ring(ring) if ring.is_extensible() => {
                return Err(Error::domain(
                    "law = \"extensible\" has no flow: write law = \"ring\", whose round part stretches where the tube \
                     has a thickness",
                ));
            }
            WallLaw::Ring(ring) => (Self::ring(ring, hoop)?, tube.pressure_scale()),
            WallLaw::NeoHookean(wall) => (Self::thick(*wall), wall.shear_modulus),
            WallLaw::Power(law) => (Self::power(*law), law.stiffness),
        };
        let place = Place {
            area: PI * tube.radius().powi(2),
            stiffness,
            outside: 0.0,
        };
        Ok((law, place))
    }

    /// The law a^m - a^n; the stiffness of `law` is the unit of pressure.
    pub fn power(law: PowerLaw) -> Self {
        Self::new(
            Kind::Power([law.inflated, law.collapsed]),
            [0.0, f64::INFINITY],
        )
    }

    /// The law of a thick round wall; the shear modulus is the unit of pressure, the unloaded lumen that of area.
    pub fn thick(wall: ThickWall) -> Self {
        let unit = ThickWall {
            shear_modulus: 1.0,
            inner_radius: 1.0,
            thickness: wall.thickness / wall.inner_radius,
            stretch: wall.stretch,
        };
        Self::new(Kind::Thick(unit), [0.0, f64::INFINITY])
    }

    /// The law of an inextensible ring, in D/R^3. With the stiffness `hoop` k, 12 (R/h)^2 for a wall of the thickness
    /// h, the round ring stretches under pressures below buckling: Phi = 1 - n^2 + k (1 - a^(-1/2)). Without, areas
    /// are below 1.
    ///
    /// # Errors
    /// As [`RingTable::new`].
    pub fn ring(ring: &Ring, hoop: Option<f64>) -> Result<Self> {
        let table = RingTable::new(ring)?;
        let last = ring.last().map_or(f64::INFINITY, |last| 1.0 / last.area);
        let first = if hoop.is_some() { 0.0 } else { 1.0 };
        let kind = Kind::Ring {
            table: Box::new(table),
            hoop,
            buckling: ring.buckling().pressure,
        };
        Ok(Self::new(kind, [first, last]))
    }

    fn new(kind: Kind, reach: [f64; 2]) -> Self {
        let mut law = Self {
            kind,
            reach,
            bends: Vec::new(),
            knots: Vec::new(),
            panels: Panels::default(),
        };
        law.knots = match &law.kind {
            Kind::Ring { table, .. } => table.junctions().iter().map(|area| 1.0 / area).collect(),
            Kind::Power(_) | Kind::Thick(_) => Vec::new(),
        };
        let inside = |lam: f64| reach[0] < lam && lam < reach[1];
        let low = (1.0 / SOUGHT[1]).max(reach[0] * FINE);
        let high = (1.0 / SOUGHT[0]).min(reach[1]);
        let mut bends = sign_changes(&|lam| law.jet(lam)[3], [low, high], FINE);
        // The slope of the pressure jumps at buckling and at touch, not at contact along a line.
        let jumps = law.knots.iter().take(2).copied().filter(|lam| inside(*lam));
        let jumps: Vec<f64> = jumps.collect();
        bends.retain(|lam| jumps.iter().all(|jump| (lam / jump - 1.0).abs() > 1e-9));
        bends.extend(jumps);
        bends.sort_by(f64::total_cmp);
        law.bends = bends;
        law
    }

    /// The interval of areas that the law has.
    pub fn areas(&self) -> [f64; 2] {
        [1.0 / self.reach[1], 1.0 / self.reach[0]]
    }

    /// The wall at the area `area`; NaN outside of [`FlowLaw::areas`].
    #[inline]
    pub fn at(&self, area: f64) -> WallState {
        match &self.kind {
            Kind::Power([m, n]) => {
                let (up, down) = (area.powf(*m), area.powf(*n));
                WallState {
                    energy: power_energy(area, up, *m) - power_energy(area, down, *n),
                    pressure: up - down,
                    slope: (m * up - n * down) / area,
                }
            }
            Kind::Thick(wall) => {
                let (pressure, slope) = wall.pressure(area);
                WallState {
                    energy: thick_energy(wall, area),
                    pressure,
                    slope,
                }
            }
            Kind::Ring {
                hoop: Some(hoop),
                buckling,
                ..
            } if area >= 1.0 => {
                let root = area.sqrt();
                WallState {
                    energy: (hoop - buckling) * (area - 1.0) - 2.0 * hoop * (root - 1.0),
                    pressure: hoop * (1.0 - 1.0 / root) - buckling,
                    slope: 0.5 * hoop / (area * root),
                }
            }
            Kind::Ring { table, .. } => {
                let [energy, pressure, slope, _] = table.jet(area);
                WallState {
                    energy,
                    pressure: -pressure,
                    slope: -slope,
                }
            }
        }
    }

    /// The second derivative of Phi by the area.
    fn bend(&self, area: f64) -> f64 {
        match &self.kind {
            Kind::Power([m, n]) => {
                m * (m - 1.0) * area.powf(m - 2.0) - n * (n - 1.0) * area.powf(n - 2.0)
            }
            Kind::Thick(wall) => {
                let step = 1e-4 * area;
                (wall.pressure(area + step).1 - wall.pressure(area - step).1) / (2.0 * step)
            }
            Kind::Ring {
                hoop: Some(hoop), ..
            } if area >= 1.0 => -0.75 * hoop / (area * area * area.sqrt()),
            Kind::Ring { table, .. } => -table.jet(area)[3],
        }
    }

    /// Speed c of pulses in the fluid at rest.
    pub fn wave_speed(&self, area: f64) -> f64 {
        (area * self.at(area).slope).sqrt()
    }

    /// The area under the pressure `pressure` inside less outside; `None` if no area has the pressure.
    pub fn area(&self, pressure: f64) -> Option<f64> {
        // Phi falls with lam.
        let residual = |lam: f64| {
            let wall = self.at(1.0 / lam);
            Some((pressure - wall.pressure, wall.slope / (lam * lam)))
        };
        self.increasing(self.middle(), residual)
            .map(|lam| 1.0 / lam)
    }

    /// Contact of the wall with itself at the area `area`.
    pub fn contact(&self, area: f64) -> Contact {
        match &self.kind {
            Kind::Ring { table, .. } => table.contact(area),
            Kind::Power(_) | Kind::Thick(_) => Contact::None,
        }
    }

    /// Areas below which the wall touches itself at a point and along a line; none for walls without contact.
    pub fn contacts(&self) -> Vec<f64> {
        match &self.kind {
            Kind::Ring { table, .. } => table.junctions().into_iter().skip(1).collect(),
            Kind::Power(_) | Kind::Thick(_) => Vec::new(),
        }
    }

    /// Refuses an area that the law does not have.
    ///
    /// # Errors
    /// An area outside of [`FlowLaw::areas`]; NaN.
    pub fn check(&self, area: f64) -> Result<()> {
        let [low, high] = self.areas();
        if low < area && area < high {
            return Ok(());
        }
        let hint = match &self.kind {
            Kind::Ring { hoop: None, .. } if area >= 1.0 => {
                ": the round ring of this tube does not stretch, and waves in it are infinitely fast; give the tube a \
                 thickness"
            }
            Kind::Ring { .. } if area <= low && low > 0.0 => {
                ": there the walls of each lobe touch, and what follows is not computed; mode = 2 goes on"
            }
            _ => "",
        };
        Err(Error::domain(format!(
            "the area {area} A0 must lie between {low} and {high}{hint}"
        )))
    }
}

/// The integral of a^e from 1, with `power` = a^e.
fn power_energy(area: f64, power: f64, exponent: f64) -> f64 {
    if exponent == -1.0 {
        area.ln()
    } else {
        (area * power - 1.0) / (exponent + 1.0)
    }
}

/// The integral of the pressure of a thick wall from a = 1.
fn thick_energy(wall: &ThickWall, area: f64) -> f64 {
    let outer = (1.0 + wall.thickness).powi(2);
    let (lam, between) = (wall.stretch, (outer - 1.0) / wall.stretch);
    // ri^2 = a, re^2 = a + between.
    let of = |a: f64| {
        let re = a + between;
        (a * (outer * a).ln() - re * re.ln()) / lam + (outer * re.ln() - a.ln()) / (lam * lam)
    };
    // The integral of ln(outer a/re) is a ln(outer a) - re ln(re) but for a constant.
    0.5 * wall.shear_modulus * (of(area) - of(1.0))
}

impl Law1d for FlowLaw {
    fn density(&self) -> f64 {
        1.0
    }

    fn reach(&self) -> [f64; 2] {
        self.reach
    }

    fn bends(&self) -> &[f64] {
        &self.bends
    }

    fn jet(&self, lam: f64) -> [f64; 4] {
        let area = 1.0 / lam;
        let wall = self.at(area);
        let squared = area * area;
        [
            wall.energy * lam,
            -wall.thrust(area),
            squared * area * wall.slope,
            -squared * squared * (3.0 * wall.slope + area * self.bend(area)),
        ]
    }

    fn phi(&self, from: f64, to: f64) -> f64 {
        self.panels
            .integral(&|lam| self.speed(lam), &self.knots, from, to)
    }

    fn middle(&self) -> f64 {
        let [low, high] = self.reach;
        if low < 1.0 {
            1.0_f64.min(0.5 * (low + high))
        } else {
            (1.5 * low).min(0.5 * (low + high))
        }
    }
}
