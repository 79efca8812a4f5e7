//! Assemblies: rigid bodies and point masses joined by elastic rods (theory 3.3, 3.4).
//!
//! A rod without inertia sits between two attachments: the ground, a support that moves, or the frame of a body. Its
//! chart is the base wrench q = (m(0), n) on the equilibrium manifold, in the directors of its base. The end of the
//! rod moves by the twist of one attachment relative to the other. The bodies are free but for the wrenches of their
//! rods.
//!
//! Data, whose files import no operation:
//!
//! * [`Body`]: a point mass or a rigid body, free or in a groove.
//! * [`Attachment`], [`Joint`]: the ends of rods.
//! * [`Link`]: a rod between two attachments; [`FreeRod`]: one with a free end.
//! * [`Assembly`]: bodies and rods; [`Configuration`]: poses and charts.
//!
//! Operations on them:
//!
//! * [`Assembly::balance`], [`Assembly::stiffness`], [`Assembly::index`]: forces, their derivatives, the Morse index.
//! * [`Assembly::equilibrium`], [`Assembly::modes`], [`AssemblyFamily`]: statics, small vibrations, branches.
//! * [`Assembly::write_slope`], [`LinearisedStage`]: equations of motion; [`Nearness`]: contact of rods.

mod attachment;
mod axial_slider;
mod ball_ball_rod;
mod body;
mod branch;
mod branch_point_ahead;
mod chord_spin;
mod configuration;
mod contact;
mod distributed_load;
mod equations;
mod evaluation;
mod first_order_mass;
mod fold;
mod fold_ahead;
mod free_end;
mod frequency_shift;
mod guide;
mod homotopy;
mod implicit;
mod inextensible_pull;
mod joined_rods;
mod jointed_fall;
mod landing;
mod light_rod;
mod modes;
mod moving_sections;
mod network;
mod reach;
mod rod_element;
mod rod_in_time;
mod state;
mod statics;
mod stiffness;
mod taut;
mod viscous_layer;
mod zero_modes;

pub use attachment::{AttachedTo, Attachment, Joint};
pub use body::{Body, BodyMotion};
pub use branch::{AssemblyFamily, AssemblyState};
pub use branch_point_ahead::NeutralApproach;
pub use configuration::{Configuration, Evaluated, Integrals, Spin};
pub use contact::{Contact, Nearness, Tube};
pub use first_order_mass::RodMomentum;
pub use fold::{AssemblyFold, CriticalMotion};
pub use free_end::FreeRod;
pub use frequency_shift::HeldFold;
pub use guide::{FreeAxis, Guide, JointLaw};
pub use implicit::LinearisedStage;
pub use inextensible_pull::Tether;
pub use jointed_fall::JointedLanding;
pub use landing::Landing;
pub use modes::Modes;
pub use moving_sections::MovingSection;
pub use network::Assembly;
pub use rod_element::{EndSlider, LightRod, Link, LinkEnd, LinkPoint, RodChart};
pub use state::{ReactionPower, Reactions, RodMonitor, SlowedTime};
pub use statics::{AssemblyEquilibrium, AssemblyRoute};
pub use stiffness::Stiffness;
pub use zero_modes::FreeMotion;
