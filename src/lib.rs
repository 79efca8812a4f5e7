//! Reduced-order dynamics of light rods that carry heavy rigid bodies.
#![warn(missing_docs)]

pub mod elastica;
pub mod error;
pub mod math;
#[cfg(feature = "plot")]
pub mod plot;
pub mod solve;

pub use error::{Error, Result};
