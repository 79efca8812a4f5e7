//! Motion of bodies on rods with mass.
//!
//! A snap is a fast motion here and no event: the rod passes a fold of its equilibria. The energy set free
//! appears as kinetic energy of the rod and as friction.

mod assembly;
mod model;
mod rod;
mod run;
mod sample;

pub use assembly::{HeavyAssemblyStart, RodStart};
pub use rod::{EndVelocity, HeavyRate, HeavyStart};
pub use run::{HeavyRun, SPILL};
pub use sample::HeavySample;
