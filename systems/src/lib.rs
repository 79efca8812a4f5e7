//! Equations of motion of [snaprod](https://docs.rs/snaprod): creep of viscoelastic rods, assemblies of rods and
//! bodies, rods with mass. The crate builds on `snaprod-core` and re-exports it; `snaprod-motion` runs these
//! equations. Use `snaprod`, which re-exports all.
#![warn(missing_docs)]

pub mod assembly;
pub mod full_mass;
mod spectrum;
pub mod viscoelastic;

pub use snaprod_core::{Error, Result};
pub use snaprod_core::{
    body, contact, elastica, error, manifold, math, obstacle, rod, section, solve,
};
