//! Flow in a light tube: the wall is in equilibrium at every place, and the fluid moves (docs/tubes.md 5).
//!
//! With the area A(x, t), the mean velocity u, the pressure p = p_e + Kp Phi(A/A0) and the friction f,
//!
//! ```text
//! A_t + (A u)_x = 0,   (A u)_t + (A u^2)_x + (A/rho) p_x = -f.
//! ```
//!
//! A [`FlowTube`] holds wall, fluid, ends and start; [`FlowVolumes`] moves it. [`FlowLaw`] solves Riemann problems
//! exactly, also where the wall touches itself. [`steady`] has steady flows, choked ones among them.
//!
//! ```
//! # use snaprod_walls as snaprod;
//! use snaprod::flow::{FlowLaw, FlowState};
//! use snaprod::tube::PowerLaw;
//! let law = FlowLaw::power(PowerLaw { stiffness: 1.0, inflated: 0.0, collapsed: -1.5 });
//! let at = |area| FlowState { area, velocity: 0.0 };
//! let star = law.riemann(at(1.0), at(0.3))?;
//! assert!((star.between.area - 0.48014711991716436).abs() < 1e-13);
//! # Ok::<(), snaprod_core::Error>(())
//! ```

pub mod coupling;
mod ends;
mod face;
mod jumps;
mod law;
mod riemann;
pub mod starling;
pub mod steady;
mod volumes;

pub use jumps::ElasticJump;
pub use law::{FlowLaw, WallState};
pub use riemann::{FlowStar, FlowState, FlowWave};
pub use snaprod_waves::law1d::{Law1d, WaveKind};
pub use volumes::FlowVolumes;

use snaprod_core::body::History;
use snaprod_core::{Error, Result};
use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

/// Reynolds number at which the flow of [`Friction::Darcy`] becomes turbulent. The report on veins gives none.
pub const TURBULENT: f64 = 2300.0;

/// Wall and surroundings at a place of the tube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Area A0 of the round tube without pressure.
    pub area: f64,
    /// Stiffness Kp, the unit of pressure of the wall law.
    pub stiffness: f64,
    /// Pressure p_e outside.
    pub outside: f64,
}

/// Friction of the fluid at the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// None.
    None,
    /// 8 pi nu u: that of a slow flow in a round tube, with the kinematic viscosity nu.
    Linear(f64),
    /// lam S u|u|/8 with S = pi D0 and the diameter D0 of the round tube, (39) of the report on veins. With
    /// Re = |u| D0/nu, lam = 64/Re below [`TURBULENT`] and 1.02 (log10 Re)^-2.5 above; nu is given.
    Darcy(f64),
}

impl Friction {
    /// Force f per length over the density, along -u.
    pub fn force(self, place: &Place, velocity: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear(viscosity) => 8.0 * PI * viscosity * velocity,
            Self::Darcy(viscosity) => {
                let diameter = 2.0 * (place.area / PI).sqrt();
                let reynolds = velocity.abs() * diameter / viscosity;
                if !(reynolds > TURBULENT) {
                    return 8.0 * PI * viscosity * velocity;
                }
                let coefficient = 1.02 * reynolds.log10().powf(-2.5);
                coefficient * PI * diameter * velocity * velocity.abs() / 8.0
            }
        }
    }
}

/// A reservoir with a restrictor and a rigid tube between it and the end.
#[derive(Debug, Clone, PartialEq)]
pub struct Reservoir {
    /// Pressure of the reservoir.
    pub pressure: History,
    /// Fall of the pressure over the flow, in the restrictor.
    pub resistance: f64,
    /// Fall of the pressure over the rate of the flow, in the rigid tube: density x length/area.
    pub inertance: f64,
    /// Part of the dynamic pressure that is regained where the flow leaves the tube, 1 - chi; 0 is a jet.
    pub recovery: f64,
}

impl Reservoir {
    /// A reservoir at the end itself.
    pub fn at_pressure(pressure: f64) -> Self {
        Self {
            pressure: History::Constant(pressure),
            resistance: 0.0,
            inertance: 0.0,
            recovery: 0.0,
        }
    }
}

/// Condition at an end of the tube.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowEnd {
    /// The tube goes on: waves leave.
    Open,
    /// No flow.
    Closed,
    /// A flow along +x in time.
    Flow(History),
    /// Area and velocity both: an inflow faster than waves.
    Supercritical(FlowState),
    /// A reservoir.
    Reservoir(Reservoir),
}

impl FlowEnd {
    fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Flow(history)
            | Self::Reservoir(Reservoir {
                pressure: history, ..
            }) => history.next_break(t),
            Self::Open | Self::Closed | Self::Supercritical(_) => f64::INFINITY,
        }
    }
}

/// A function of the place along the tube.
pub type Along<T> = Arc<dyn Fn(f64) -> T + Send + Sync>;

/// A tube with its fluid, ends and start.
#[derive(Clone)]
pub struct FlowTube {
    /// Wall law.
    pub law: FlowLaw,
    /// Length; x runs from 0.
    pub length: f64,
    /// Density of the fluid.
    pub density: f64,
    /// Wall and surroundings along the tube: continuous.
    pub places: Along<Place>,
    /// Pressure in time, equal along the tube, added to the pressure outside.
    pub outside: History,
    /// Friction.
    pub friction: Friction,
    /// The ends x = 0 and x = length.
    pub ends: [FlowEnd; 2],
    /// Area over A0, and velocity, at the start.
    pub start: Along<FlowState>,
}

impl fmt::Debug for FlowTube {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FlowTube")
            .field("length", &self.length)
            .field("density", &self.density)
            .field("outside", &self.outside)
            .field("friction", &self.friction)
            .field("ends", &self.ends)
            .finish_non_exhaustive()
    }
}

impl FlowTube {
    /// A uniform tube in the units of its law, A0 = Kp = density = 1, without friction, with open ends.
    pub fn in_units_of_law(law: FlowLaw, length: f64, start: Along<FlowState>) -> Self {
        let place = Place {
            area: 1.0,
            stiffness: 1.0,
            outside: 0.0,
        };
        Self {
            law,
            length,
            density: 1.0,
            places: Arc::new(move |_| place),
            outside: History::Constant(0.0),
            friction: Friction::None,
            ends: [FlowEnd::Open, FlowEnd::Open],
            start,
        }
    }

    /// Refuses tubes without length or fluids without density.
    ///
    /// # Errors
    /// A length or a density that is not positive.
    fn check(&self) -> Result<()> {
        for (name, value) in [("length", self.length), ("density", self.density)] {
            if !(0.0 < value && value < f64::INFINITY) {
                return Err(Error::domain(format!(
                    "the {name} {value} of a tube with flow must be positive and finite"
                )));
            }
        }
        Ok(())
    }

    fn next_break(&self, t: f64) -> f64 {
        let ends = self.ends[0].next_break(t).min(self.ends[1].next_break(t));
        ends.min(self.outside.next_break(t))
    }

    /// Speed (Kp/rho)^1/2 at a place.
    fn unit_speed(&self, place: &Place) -> f64 {
        (place.stiffness / self.density).sqrt()
    }
}

/// Energies of a flow since its start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlowLedger {
    /// Kinetic energy of the fluid.
    pub kinetic: f64,
    /// Energy stored in the wall.
    pub wall: f64,
    /// Work at the two ends on the fluid in the tube.
    pub work: f64,
    /// Work of the pressure outside on the wall.
    pub outside: f64,
    /// Energy lost to friction.
    pub friction: f64,
    /// Energy lost in elastic jumps, by design of the scheme also in steep waves.
    pub jumps: f64,
    /// Energy at the start and works, less the other entries: the error of the steps in time.
    pub error: f64,
}

/// The state of a flow.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowSnapshot {
    /// The time.
    pub time: f64,
    /// Middles of the cells.
    pub x: Vec<f64>,
    /// Areas A.
    pub area: Vec<f64>,
    /// Velocities.
    pub velocity: Vec<f64>,
    /// Pressures inside.
    pub pressure: Vec<f64>,
    /// Speed indices S = u/c.
    pub index: Vec<f64>,
    /// The two ends.
    pub ends: [FlowEndState; 2],
}

/// The state of the tube at an end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlowEndState {
    /// Pressure inside.
    pub pressure: f64,
    /// Flow along +x.
    pub flow: f64,
    /// Area A.
    pub area: f64,
}
