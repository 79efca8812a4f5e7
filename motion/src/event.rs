//! Events of a run, and the reasons for its end.

use super::contact::{ContactEvent, RodContactEvent};
use super::run::RodTouch;
use super::snap::Snap;
use super::viscoelastic::Layer;
use nalgebra::DVector;
use snaprod_systems::assembly::Contact;
use snaprod_systems::error::{Cause, Stuck};

/// The result of one advance of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A step; states between these times can be sampled now.
    Step {
        /// Time at the start.
        from: f64,
        /// Time at the end.
        to: f64,
    },
    /// An elastic rod jumped at a fold.
    Snap(Snap),
    /// A viscoelastic rod passed from one equilibrium to the neighbourhood of another, or came to rest near one.
    Layer(Layer),
    /// A taut elastic rod reversed the outward motion of a body within the last step.
    Bounce(Bounce),
    /// A body hit an obstacle or another body, or a contact changed within the last step.
    Contact(ContactEvent),
    /// A rod came to touch an obstacle, or left it, at the end of the last step.
    RodContact(RodContactEvent),
    /// The end; no event follows.
    Stop(Outcome),
}

/// Bounce of a body at the end of its tether: the taut rod reverses its outward motion.
///
/// The rod is bent only over a length 1/lambda next to its welded ends, and fast: friction, which the elastic rod
/// leaves out, matters more than anywhere else. See [`Bounce::loss`]; for the mass of the rod, [`Bounce::inertia`].
#[derive(Debug, Clone, PartialEq)]
pub struct Bounce {
    /// The rod, by its number in an assembly.
    pub rod: usize,
    /// Time at which the end is farthest out.
    pub t: f64,
    /// Position of the end at `t`: in a plane x, y, in space x, y, z along the directors of its base.
    pub pose: DVector<f64>,
    /// Velocity of the end at `t`, across the pull.
    pub velocity: DVector<f64>,
    /// The pull at `t`, its largest value.
    pub tension: f64,
    /// sqrt(tension L^2/B).
    pub lambda: f64,
    /// Stored energy at `t`, the kinetic energy m v^2/2 of the radial motion. In space it is that of the bent
    /// ends: tension times their share of the rod's reach.
    pub elastic: f64,
    /// The mass m that the pull has to turn round: the body's, in an assembly the effective mass at both ends.
    pub mass: f64,
}

impl Bounce {
    /// Radial speed v with which the ends parted: m v^2/2 is all stored at the turning point.
    pub fn speed(&self) -> f64 {
        (2.0 * self.elastic / self.mass).sqrt()
    }

    /// Relative energy loss of this bounce for a Kelvin-Voigt rod whose viscosities are its stiffnesses times `eta`,
    /// in units of m v^2/2: (16/15) eta tension/(m v). This is the leading order for small losses, up to a factor of
    /// 1.2 for pulls across the clamp (theory 2.8). The elastic bounce is physical only if the loss is far below 1.
    pub fn loss(&self, eta: f64) -> f64 {
        eta / self.viscosity()
    }

    /// The viscosity, over the stiffness, at which [`Bounce::loss`] is 1: eta* = m v/((16/15) tension).
    pub fn viscosity(&self) -> f64 {
        self.mass * self.speed() / (16.0 / 15.0 * self.tension)
    }

    /// Dimensionless number of a rod of this mass and length: the travel time of a wave along it under the
    /// tension over the duration of the bounce. This is (L/c)/(d/v), d the reach taken by the bent ends, c^2
    /// = tension L/mass (theory 2.8). The rod's mass takes no part where the number is small.
    pub fn inertia(&self, mass: f64, length: f64) -> f64 {
        (mass * length * self.tension).sqrt() * self.speed() / self.elastic
    }
}

/// Reason for the end of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The end of time was reached.
    EndOfTime,
    /// At a fold the landing rule found no stable equilibrium.
    NoStableEquilibrium,
    /// At a fold under the rule `All`: each snap continues in a run of its own.
    Branched(Vec<Snap>),
    /// The body of this number reached an end of the groove.
    GrooveEnd(usize),
    /// A rod touches itself or another rod.
    SelfContact(Contact),
    /// A rod among obstacles came to a bound beyond which contact of the rod is not followed.
    RodTouch(RodTouch),
    /// The bound on steps was reached.
    StepLimit,
    /// The bound on snaps was reached.
    SnapLimit,
    /// The bound on impacts was reached.
    ImpactLimit,
    /// The run cannot go on.
    Stuck(Stuck),
    /// Interrupted by the caller.
    Interrupted,
}

impl Outcome {
    /// The end of a run that cannot go on after the time `at`.
    pub(super) fn stuck(at: f64, cause: Cause, remedy: impl Into<String>) -> Self {
        Self::Stuck(Stuck::new(at, cause, remedy))
    }

    /// A stable key: end_of_time, no_stable_equilibrium, branched, groove_end, self_contact, rod_touch,
    /// step_limit, snap_limit, impact_limit, stuck, interrupted.
    pub fn key(&self) -> &'static str {
        match self {
            Self::EndOfTime => "end_of_time",
            Self::NoStableEquilibrium => "no_stable_equilibrium",
            Self::Branched(_) => "branched",
            Self::GrooveEnd(_) => "groove_end",
            Self::SelfContact(_) => "self_contact",
            Self::RodTouch(_) => "rod_touch",
            Self::StepLimit => "step_limit",
            Self::SnapLimit => "snap_limit",
            Self::ImpactLimit => "impact_limit",
            Self::Stuck(_) => "stuck",
            Self::Interrupted => "interrupted",
        }
    }

    /// True at the end of time, and for a run that goes on in branches: nothing is missing.
    pub fn is_complete(&self) -> bool {
        matches!(self, Self::EndOfTime | Self::Branched(_))
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::EndOfTime => f.write_str("the end of time was reached"),
            Self::NoStableEquilibrium => f.write_str(
                "the rod passed its fold, and the landing rule found no stable equilibrium of lower energy at this pose; landing = \"viscous\" \
                 always finds one if there is one",
            ),
            Self::Branched(snaps) => write!(f, "the run branched into {}", snaps.len()),
            Self::GrooveEnd(_) => f.write_str(
                "the body has come to the end of its groove; make the groove longer, or close it",
            ),
            Self::SelfContact(_) => f.write_str(
                "a rod touches itself or another, and the run does not follow the forces of this contact; to ignore contact, \
                 leave the contact diameter out",
            ),
            Self::RodTouch(touch) => write!(
                f,
                "the rod {} an obstacle; {}",
                touch.bound.verb(),
                touch.bound.why()
            ),
            Self::StepLimit => f.write_str("the bound max_steps was reached"),
            Self::SnapLimit => f.write_str("the bound max_snaps was reached"),
            Self::ImpactLimit => f.write_str("the bound max_impacts was reached"),
            Self::Stuck(stuck) => stuck.fmt(f),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}
