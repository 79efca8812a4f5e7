//! Motion of a body on a viscoelastic rod: strains with memory, theory Sec. 5.

mod drive;
mod labels;
mod layer;
mod resolution;
mod run;
mod sample;
mod system;

pub use drive::{ViscousObserver, drive_viscous};
pub use labels::near_equilibrium;
pub use layer::Layer;
pub use resolution::{MOST_NODES, Nodes};
pub use run::{ViscousEvent, ViscousOptions, ViscousOutcome, ViscousRun, ViscousStart};
pub use sample::ViscousSample;
pub use system::{Hold, Layout, ViscousFactor, ViscousLinear, ViscousSystem};
