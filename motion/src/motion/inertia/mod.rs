//! Motion of a body on a rod with mass.
//!
//! A snap is a fast motion here and no event: the rod passes a fold of its equilibria, and what that sets free is found in the kinetic
//! energy of the rod, and as friction.

mod run;
mod sample;

pub use run::{HeavyRate, HeavyRun, HeavyStart, SPILL};
pub use sample::HeavySample;
