//! Waves in one dimension, for [snaprod](https://docs.rs/snaprod): conservation laws, Riemann problems, finite
//! volumes, spectral elements.
//!
//! The crate builds on `snaprod-core`. Use `snaprod`, which re-exports its modules.
#![warn(missing_docs)]

pub mod bar;
pub mod law1d;
pub mod profile;
