//! Motion of rigid bodies that hit obstacles and each other, without rods: flight, impacts, rest and slip in contact.
//!
//! [`Bodies`] is the data: bodies, obstacles, the properties of their surfaces, forces. [`BodyMotion`] runs it from
//! event to event. Lengths, masses and times are in units of the user's choice that belong together.
//!
//! ```
//! # use snaprod_motion as motion;
//! use motion::contact::{Bodies, BodyMotion, BodyOptions, ContactEvent};
//! use motion::Event;
//! use nalgebra::{Isometry3, Vector3, Vector6};
//! use snaprod_systems::body::{Mass, PointMass};
//! use snaprod_systems::contact::{Obstacle, RigidMotion, Shape, SurfacePair};
//!
//! // A ball falls on a floor from the height 1 over its lowest point, and bounces.
//! let ball = PointMass::new(1.0)?.with_gravity(Vector3::new(0.0, 0.0, -2.0))?;
//! let mut bodies = Bodies::new(SurfacePair::new(0.5, 0.0)?);
//! bodies.add_body(Mass::Point(ball), Shape::ball(0.1)?)?;
//! bodies.add_obstacle(Obstacle::plane(Vector3::zeros(), Vector3::z())?);
//! let start = RigidMotion::new(Isometry3::translation(0.0, 0.0, 1.1), &Vector6::zeros());
//! let mut motion = BodyMotion::new(&bodies, &[start], BodyOptions::new(4.0)?)?;
//! let mut impacts = Vec::new();
//! while let Some(event) = motion.advance() {
//!     if let Event::Contact(ContactEvent::Impact(impact)) = event {
//!         impacts.push(impact);
//!     }
//! }
//! assert!((impacts[0].t - 1.0).abs() < 1e-12);
//! assert!((impacts[0].lost - 1.5).abs() < 1e-12);
//! assert!((motion.now().ledger.total() - 2.2).abs() < 1e-12);
//! # Ok::<(), snaprod_systems::Error>(())
//! ```

mod bodies;
mod body_at_end;
mod body_ledger;
mod body_motion;
mod body_options;
mod contact_books;
mod contact_dynamics;
mod contact_event;
mod contact_forces;
mod contact_sample;
mod contact_set;
mod first_touch;
mod impacts;
mod rest;
mod rod_contact;
mod rod_marks;
mod sheet_list;

pub use bodies::{Bodies, ContactId, Forces, Partner};
pub use body_ledger::BodyLedger;
pub use body_motion::{BodiesSample, BodyMotion};
pub use body_options::BodyOptions;
pub use contact_event::{ContactChange, ContactEvent, ImpactRecord, RuleOfImpact};
pub use contact_sample::ContactSample;
pub use contact_set::ContactNow;
pub use rod_contact::{
    RodContactChange, RodContactEvent, RodContactNow, RodPartner, Rubbing, SLIPPING,
};

pub(crate) use body_at_end::{BodyAtEnd, EndContacts};
pub(crate) use contact_books::{ContactBooks, Sums};
pub(crate) use contact_dynamics::ContactDynamics;
pub(crate) use contact_forces::{AccelerationBound, Closed, Grip, Moment};
pub(crate) use contact_set::Found;
pub(crate) use rod_marks::{Mark, Marks, NearestPlace, nearest_place, way_of};
