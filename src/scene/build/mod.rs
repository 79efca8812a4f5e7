//! From a scene to the library's types: one scaling, to units of the rod.

mod clamp;
mod in_time;
mod planar;
mod rod;
mod section;
mod space;
mod viscous;

pub use planar::Setup;
pub use space::{MotionSetup, Moving, SpaceField};
pub use viscous::ViscousSetup;
