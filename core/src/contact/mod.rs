//! Contact: obstacles and shapes with their gap functions, impacts with friction, contact forces.

mod complementarity;
mod contact_pair;
mod impact;
mod impact_in_space;
mod rigid_motion;
mod shape;
mod surface_pair;
mod touch;

pub use crate::obstacle::{Feature, Gap, Obstacle};
pub use complementarity::{Complementarity, ContactSolution, MAX_AT_ONCE, Mode, OneContact};
pub use contact_pair::{ContactPair, Face};
pub use impact::{Impact, Rebound};
pub use rigid_motion::{MovingObstacle, RigidMotion};
pub use shape::{PlacedShape, Shape};
pub use surface_pair::{ImpactLaw, SurfacePair};
pub use touch::{Accelerated, Spread, Touch};
