//! Reduced-order dynamics of light rods that carry heavy rigid bodies.
#![warn(missing_docs)]

pub mod body;
pub mod dynamics;
pub mod elastica;
pub mod error;
pub mod manifold;
pub mod math;
#[cfg(feature = "plot")]
pub mod plot;
#[cfg(feature = "scene")]
pub mod scene;
pub mod solve;
pub mod truss;

pub use error::{Error, Result};
