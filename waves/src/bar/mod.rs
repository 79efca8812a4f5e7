//! Longitudinal waves in a hyperelastic bar: uniaxial, without lateral inertia, with shocks (docs/bars.md).
//!
//! With the stretch lam, the velocity v and the stress sigma(lam), all over the undeformed bar 0 <= X <= length,
//!
//! ```text
//! lam_t = v_X,   density v_t = sigma(lam)_X.
//! ```
//!
//! A [`Bar`] is computed by one of the [`Scheme`]s. [`FiniteVolumes`] is the one to use where there are shocks,
//! [`Spectral`] where the motion stays smooth; the others are the schemes of the thesis from which the examples come,
//! with their faults. [`Material`] holds the law and solves Riemann problems exactly, of laws with inflections, too;
//! [`breaking`] says when a load at an end makes a shock.

pub mod breaking;
mod edge;
mod finite_volumes;
pub mod heavy;
mod lattice;
mod material;
mod riemann;
mod shocks;
mod spectral;
mod stability;

pub use crate::law1d::{Law1d, Wave, WaveKind};
pub use finite_volumes::FiniteVolumes;
pub use lattice::Lattice;
pub use material::{Material, Stress};
pub use riemann::Star;
pub use shocks::{Shock, shocks};
pub use spectral::Spectral;
pub use stability::{growth, stable_limit};

use snaprod_core::body::History;
use snaprod_core::error::{Cause, Error, Result, Stuck};
use std::fmt;
use std::sync::Arc;

/// Condition at an end of the bar.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// Held in place.
    Wall,
    /// A force along +X in time, on a free end: constant zero leaves it free.
    Loaded(History),
    /// A heavy mass with a force along +X on it.
    Mass {
        /// The mass, > 0.
        mass: f64,
        /// The force on the mass.
        force: History,
    },
}

impl End {
    /// The force of the load at `t`.
    fn force(&self, t: f64) -> f64 {
        match self {
            Self::Wall => 0.0,
            Self::Loaded(force) | Self::Mass { force, .. } => force.at(t),
        }
    }

    /// The force and its rate.
    fn force_rate(&self, t: f64) -> [f64; 2] {
        match self {
            Self::Wall => [0.0; 2],
            Self::Loaded(force) | Self::Mass { force, .. } => {
                let [force, rate, _] = force.with_rates(t);
                [force, rate]
            }
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Wall => f64::INFINITY,
            Self::Loaded(force) | Self::Mass { force, .. } => force.next_break(t),
        }
    }
}

/// \[stretch, velocity\] along the bar, at the start.
pub type Start = Arc<dyn Fn(f64) -> [f64; 2] + Send + Sync>;

/// A uniform bar with end conditions and initial state, in any consistent units.
#[derive(Clone)]
pub struct Bar {
    material: Material,
    length: f64,
    area: f64,
    ends: [End; 2],
    start: Start,
}

impl fmt::Debug for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bar")
            .field("material", &self.material)
            .field("length", &self.length)
            .field("area", &self.area)
            .field("ends", &self.ends)
            .finish_non_exhaustive()
    }
}

impl Bar {
    /// A bar of this length and area, at rest and unstretched, with these ends at X = 0 and X = length.
    ///
    /// # Errors
    /// A length, an area or a mass that is not positive and finite; a history that is no function.
    pub fn new(material: Material, length: f64, area: f64, ends: [End; 2]) -> Result<Self> {
        for (name, value) in [("length", length), ("area", area)] {
            positive(name, value)?;
        }
        for end in &ends {
            if let End::Mass { mass, .. } = end {
                positive("mass of an end", *mass)?;
            }
            if let End::Loaded(force) | End::Mass { force, .. } = end {
                force.clone().checked()?;
            }
        }
        let start: Start = Arc::new(|_| [1.0, 0.0]);
        Ok(Self {
            material,
            length,
            area,
            ends,
            start,
        })
    }

    /// Sets the start \[stretch, velocity\] = `start`(X).
    #[must_use]
    pub fn started(mut self, start: impl Fn(f64) -> [f64; 2] + Send + Sync + 'static) -> Self {
        self.start = Arc::new(start);
        self
    }

    /// The law.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// The undeformed length.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The undeformed area of the cross-section.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// End conditions at X = 0 and at X = length.
    pub fn ends(&self) -> &[End; 2] {
        &self.ends
    }

    /// density x area x length.
    pub fn mass(&self) -> f64 {
        self.material.density() * self.area * self.length
    }

    /// \[stretch, velocity\] at X, at the start.
    pub fn at_start(&self, x: f64) -> [f64; 2] {
        (self.start)(x)
    }

    /// Stretches and velocities at the points `x` at the start.
    ///
    /// # Errors
    /// A stretch outside the reach of the law, a velocity that is not finite.
    fn sampled(&self, x: impl Iterator<Item = f64>) -> Result<(Vec<f64>, Vec<f64>)> {
        let mut states = (Vec::new(), Vec::new());
        for x in x {
            let [stretch, velocity] = self.at_start(x);
            self.material.check(stretch)?;
            if !velocity.is_finite() {
                let said = format!("the velocity {velocity} at X = {x} must be finite");
                return Err(Error::domain(said));
            }
            states.0.push(stretch);
            states.1.push(velocity);
        }
        Ok(states)
    }

    /// The stretch of the end `side` under its load at `t`.
    ///
    /// # Errors
    /// A load beyond all stresses of the law.
    fn under_load(&self, side: usize, t: f64) -> Result<f64> {
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let force = sign * self.ends[side].force(t);
        self.material.stretch(force / self.area)
    }

    /// Reason why the bar cannot go on at `t`, if an end's load exceeds all stresses of the law.
    fn overloaded(&self, t: f64) -> Option<Stuck> {
        let loaded = |side: &usize| matches!(self.ends[*side], End::Loaded(_));
        let error = (0..2)
            .filter(loaded)
            .find_map(|side| self.under_load(side, t).err())?;
        Some(Stuck::new(t, Cause::Failed(error), LOWER))
    }

    fn next_break(&self, t: f64) -> f64 {
        let [left, right] = &self.ends;
        left.next_break(t).min(right.next_break(t))
    }
}

/// Numerical scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Finite volumes with slopes, for motions with shocks.
    FiniteVolume,
    /// One spectral element, for motions that stay smooth.
    Spectral,
    /// Linear elements, lumped mass, central differences.
    CentralLumped,
    /// Linear elements, consistent mass, central differences.
    CentralConsistent,
    /// The Lax-Wendroff finite elements in the stretch as printed in the thesis: unstable.
    StretchTaylor,
    /// [`Scheme::StretchTaylor`] with the stretch moved by the new rate.
    StretchSequential,
    /// Two-step Lax-Wendroff for stretch and velocity.
    LaxWendroff,
}

impl Scheme {
    /// All schemes.
    pub const ALL: [Self; 7] = [
        Self::FiniteVolume,
        Self::Spectral,
        Self::CentralLumped,
        Self::CentralConsistent,
        Self::StretchTaylor,
        Self::StretchSequential,
        Self::LaxWendroff,
    ];

    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::FiniteVolume => "finite-volume",
            Self::Spectral => "spectral",
            Self::CentralLumped => "central-lumped",
            Self::CentralConsistent => "central-consistent",
            Self::StretchTaylor => "stretch-taylor",
            Self::StretchSequential => "stretch-sequential",
            Self::LaxWendroff => "lax-wendroff",
        }
    }
}

/// A bar in motion.
pub trait BarMotion {
    /// The time.
    fn time(&self) -> f64;

    /// Takes at most `steps` steps, and not beyond the time `until`.
    ///
    /// # Errors
    /// The motion cannot go on: where, why and what would help.
    fn go(&mut self, until: f64, steps: usize) -> Result<(), Stuck>;

    /// Goes on until the time `until`.
    ///
    /// # Errors
    /// As [`BarMotion::go`].
    fn advance(&mut self, until: f64) -> Result<(), Stuck> {
        loop {
            self.go(until, usize::MAX)?;
            if self.time() >= until {
                return Ok(());
            }
        }
    }

    /// The present state.
    fn snapshot(&self) -> Snapshot;

    /// Present energies and momenta.
    fn ledger(&self) -> Ledger;

    /// The bounds of the stress at the two ends so far.
    fn extremes(&self) -> [Extremes; 2];
}

/// Advice if a bar reaches the edge of its law.
const LOWER: &str = "lower the loads, or check the law at this stretch";

/// Error for steps too short for the digits of the time.
fn no_time(at: f64) -> Stuck {
    let why = "waves pass a cell in less than the last digit of the time";
    let remedy = "check density and law, the units of both, or end earlier";
    Stuck::new(at, Cause::Failed(Error::ill_conditioned(why)), remedy)
}

/// Sets a bar in motion. `cells` counts cells or elements, or nodes of the spectral scheme; without a `time_step` the
/// scheme chooses.
///
/// # Errors
/// What the scheme cannot compute, and why; [`Scheme::StretchTaylor`] unless `unstable` is true.
pub fn motion(
    bar: &Bar,
    scheme: Scheme,
    cells: usize,
    time_step: Option<f64>,
    unstable: bool,
) -> Result<Box<dyn BarMotion>> {
    if let Some(step) = time_step {
        positive("time_step", step)?;
    }
    Ok(match scheme {
        Scheme::FiniteVolume => Box::new(FiniteVolumes::new(bar, cells)?.bounded(time_step)),
        Scheme::Spectral => Box::new(Spectral::new(bar, cells, 1e-13)?),
        _ => Box::new(Lattice::new(bar, scheme, cells, time_step, unstable)?),
    })
}

/// The state of a bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// The time.
    pub time: f64,
    /// Material coordinates: middles of cells or elements, or nodes.
    pub x: Vec<f64>,
    /// Stretch at these points.
    pub stretch: Vec<f64>,
    /// Velocity at these points.
    pub velocity: Vec<f64>,
    /// Stress at these points.
    pub stress: Vec<f64>,
    /// The two ends.
    pub ends: [EndState; 2],
}

/// The state of an end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EndState {
    /// Position; the end at X = 0 starts at 0.
    pub position: f64,
    /// Velocity.
    pub velocity: f64,
    /// Stress of the bar at the end.
    pub stress: f64,
}

/// The least and the greatest stress of an end, with the times at which they are first reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// The least.
    pub min: f64,
    /// Time of the least.
    pub min_time: f64,
    /// The greatest.
    pub max: f64,
    /// Time of the greatest.
    pub max_time: f64,
}

impl Extremes {
    fn new(time: f64, stress: f64) -> Self {
        Self {
            min: stress,
            min_time: time,
            max: stress,
            max_time: time,
        }
    }

    fn see(&mut self, time: f64, stress: f64) {
        if stress < self.min {
            (self.min, self.min_time) = (stress, time);
        }
        if stress > self.max {
            (self.max, self.max_time) = (stress, time);
        }
    }
}

/// Energies and momenta of bar and masses together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ledger {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Strain energy.
    pub strain: f64,
    /// Work of the loads since the start.
    pub work: f64,
    /// Energy at the start + work - kinetic - strain: the dissipation of shocks, and errors of the scheme.
    pub lost: f64,
    /// Dissipation by design of the scheme, summed independently of `lost`. Zero for schemes without.
    pub dissipated: f64,
    /// Momentum along +X.
    pub momentum: f64,
    /// Impulse of loads and walls since the start.
    pub impulse: f64,
}

fn positive(name: &str, value: f64) -> Result<()> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Error::domain(format!(
        "{name} = {value} of a bar must be positive and finite"
    )))
}
