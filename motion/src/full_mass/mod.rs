//! Motion of bodies on rods with mass.
//!
//! A snap is a fast motion here and no event: the rod passes a fold of its equilibria. The energy set free
//! appears as kinetic energy of the rod and as friction.

mod element_run;
mod element_sample;
mod resolution;
mod run;
mod sample;
mod start;
mod touch;

pub use element_run::{ElementRun, IN_ELEMENTS, heavy_motion};
pub use element_sample::ElementSample;
pub use run::{HeavyRun, SPILL};
pub use sample::HeavySample;
pub use start::{EndVelocity, HeavyStart, RodStart, StrainAt};
