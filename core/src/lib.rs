//! The numerical core of [snaprod](https://docs.rs/snaprod), which re-exports every module of it and adds scenes, studies, figures and the
//! program. Use `snaprod`, with `default-features = false` for the core alone; its front page says what is where, in which units, and what the
//! terms mean.
#![warn(missing_docs)]

pub mod assembly;
pub mod bar;
pub mod body;
pub mod creep;
pub mod elastica;
pub mod error;
pub mod manifold;
pub mod math;
pub mod motion;
pub mod rod;
pub mod section;
pub mod solve;

pub use error::{Error, Result};
