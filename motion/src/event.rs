//! What happens in a run, and why it ends.

use super::snap::Snap;
use super::viscoelastic::Layer;
use nalgebra::DVector;
use snaprod_systems::assembly::Contact;
use snaprod_systems::error::{Cause, Stuck};

/// What one advance of a run was.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A step; states between these times can be asked for now.
    Step {
        /// Time at its start.
        from: f64,
        /// Time at its end.
        to: f64,
    },
    /// An elastic rod jumped at a fold.
    Snap(Snap),
    /// A viscoelastic rod passed from one equilibrium to the neighbourhood of another, or came to rest near one.
    Layer(Layer),
    /// A body was thrown back by an elastic rod that had become taut, within the last step.
    Bounce(Bounce),
    /// The end; nothing follows.
    Stop(Outcome),
}

/// What a rod holds is thrown back at the end of its tether: the taut rod turned its outward motion round.
///
/// The rod is bent over a length 1/lambda next to its welded ends alone, and there fast: friction that the elastic rod leaves out
/// matters more than anywhere else. See [`Bounce::loss`]; what the mass of the rod does, [`Bounce::inertia`].
#[derive(Debug, Clone, PartialEq)]
pub struct Bounce {
    /// The rod, by its number in an assembly.
    pub rod: usize,
    /// When its end was farthest out.
    pub t: f64,
    /// Place of its end there: in a plane x, y, in space x, y, z along the directors of its base.
    pub pose: DVector<f64>,
    /// Velocity there, across the pull.
    pub velocity: DVector<f64>,
    /// The pull there, its largest value.
    pub tension: f64,
    /// sqrt(tension L^2/B).
    pub lambda: f64,
    /// Stored energy there, in space that of the bent ends, tension times what they take of the rod's reach: the kinetic energy of the radial
    /// motion, m v^2/2.
    pub elastic: f64,
    /// The mass m that the pull has to turn round: the body's, in an assembly all that resists it at both ends.
    pub mass: f64,
}

impl Bounce {
    /// Radial speed v with which the ends parted: m v^2/2 is all stored where they are turned round.
    pub fn speed(&self) -> f64 {
        (2.0 * self.elastic / self.mass).sqrt()
    }

    /// What a Kelvin-Voigt rod, whose viscosities are its stiffnesses times `eta`, loses in this bounce, relative to the energy m v^2/2 of the
    /// radial motion: (16/15) eta tension/(m v), to leading order where it is small, and up to a factor of 1.2 for pulls across
    /// the clamp (theory 2.8). The elastic bounce is physical only if this is far below 1.
    pub fn loss(&self, eta: f64) -> f64 {
        eta / self.viscosity()
    }

    /// The viscosity, over the stiffness, at which [`Bounce::loss`] is 1: eta* = m v/((16/15) tension).
    pub fn viscosity(&self) -> f64 {
        self.mass * self.speed() / (16.0 / 15.0 * self.tension)
    }

    /// The number of a rod of this mass and length: the time in which a wave runs along it under the tension over that of the bounce,
    /// (L/c)/(d/v), d the reach that its ends take, c^2 = tension L/mass (theory 2.8). The rod's mass takes no part where it is small.
    pub fn inertia(&self, mass: f64, length: f64) -> f64 {
        (mass * length * self.tension).sqrt() * self.speed() / self.elastic
    }
}

/// Why a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The end of time was reached.
    EndOfTime,
    /// At a fold the landing rule found no stable equilibrium.
    NoStableEquilibrium,
    /// At a fold under the rule `All`: each snap continues in a run of its own.
    Branched(Vec<Snap>),
    /// The body of this number has come to the end of its groove.
    GrooveEnd(usize),
    /// A rod has come to touch itself, or another.
    SelfContact(Contact),
    /// The bound on steps was reached.
    StepLimit,
    /// The bound on snaps was reached.
    SnapLimit,
    /// The run cannot go on.
    Stuck(Stuck),
    /// Told to stop from outside.
    Interrupted,
}

impl Outcome {
    /// A run that cannot go on after the time `at`.
    pub(super) fn stuck(at: f64, cause: Cause, remedy: impl Into<String>) -> Self {
        Self::Stuck(Stuck::new(at, cause, remedy))
    }

    /// A stable key: end_of_time, no_stable_equilibrium, branched, groove_end, self_contact, step_limit, snap_limit, stuck, interrupted.
    pub fn key(&self) -> &'static str {
        match self {
            Self::EndOfTime => "end_of_time",
            Self::NoStableEquilibrium => "no_stable_equilibrium",
            Self::Branched(_) => "branched",
            Self::GrooveEnd(_) => "groove_end",
            Self::SelfContact(_) => "self_contact",
            Self::StepLimit => "step_limit",
            Self::SnapLimit => "snap_limit",
            Self::Stuck(_) => "stuck",
            Self::Interrupted => "interrupted",
        }
    }

    /// True if nothing is missing of what was asked: the end of time, or branches that go on by themselves.
    pub fn is_complete(&self) -> bool {
        matches!(self, Self::EndOfTime | Self::Branched(_))
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::EndOfTime => f.write_str("the end of time was reached"),
            Self::NoStableEquilibrium => f.write_str(
                "the rod ran out of its sheet and the landing rule leaves no stable equilibrium at this pose with less energy than at the fold; landing = \"viscous\" \
                 always finds one if there is one",
            ),
            Self::Branched(snaps) => write!(f, "the run branched into {}", snaps.len()),
            Self::GrooveEnd(_) => f.write_str(
                "the body has come to the end of its groove; make the groove longer, or close it",
            ),
            Self::SelfContact(_) => f.write_str(
                "a rod touches itself or another, and what contact does is not followed; where that does not matter, leave the \
                 contact diameter out",
            ),
            Self::StepLimit => f.write_str("the bound max_steps was reached"),
            Self::SnapLimit => f.write_str("the bound max_snaps was reached"),
            Self::Stuck(stuck) => stuck.fmt(f),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}
