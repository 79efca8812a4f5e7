//! Motion of bodies on rods with mass.
//!
//! A snap is a fast motion here and no event: the rod passes a fold of its equilibria, and what that sets free is found in the kinetic
//! energy of the rod, and as friction.

mod assembly;
mod model;
mod rod;
mod run;
mod sample;

pub use assembly::{HeavyAssemblyStart, RodStart};
pub use rod::{EndVelocity, HeavyRate, HeavyStart};
pub use run::{HeavyRun, SPILL};
pub use sample::HeavySample;
