//! Motion of a body on a viscoelastic rod: strains with memory, theory Sec. 5.
//!
//! [`ViscousRun`] is an iterator over events. It starts from any strains ([`ViscousStart`]), chooses its
//! nodes and its method unless the options do, and keeps an energy ledger, onto which nothing is projected.
//!
//! * [`ViscousSystem`]: the equations in two forms ([`Hold`]). Explicit steps take w1 from strains and
//!   velocity by the mobility G. So do implicit steps where the end relaxes faster than the strains. Other
//!   implicit steps carry pose and w1 as unknowns, with the constraint that the rod ends at the body; this
//!   stays regular as the viscosity vanishes.
//! * [`AroundRod`]: obstacles that the body hits.
//! * [`Nodes`](super::Nodes): how many Gauss nodes, by the tails of the strains.
//! * [`ViscousSample`]: a state with shape, wrench, rates, dissipation along the rod, and distance from equilibrium.
//! * [`small_in_plane`], [`small_in_space`]: eigenvalues of small motions about an equilibrium, the friction
//!   of the rod included.
//! * [`Layer`]: a passage far from equilibrium, such as a snap (AMV (8.6)). [`near_equilibrium`]: the labels
//!   of the equilibrium that a planar rod is near.

mod contacts;
mod motions;
mod nearby_equilibrium;
mod run;
mod sample;
mod small_motions;
mod snap_layer;

pub use contacts::AroundRod;
pub use motions::{AlongRod, FreeStrains, in_plane, in_space};
pub use nearby_equilibrium::near_equilibrium;
pub use run::{ViscousRun, ViscousStart};
pub use sample::ViscousSample;
pub use small_motions::{SmallCreep, small_in_plane, small_in_space};
pub use snap_layer::Layer;
pub use snaprod_systems::viscoelastic::resolution::MOST_NODES;
pub use snaprod_systems::viscoelastic::system::{
    Hold, Layout, Rates, ViscousFactor, ViscousLinear, ViscousSystem,
};
