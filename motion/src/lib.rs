//! The moving half of [snaprod](https://docs.rs/snaprod)'s numerics: creep of viscoelastic rods, assemblies of rods and bodies, their motion,
//! waves in bars. It stands on `snaprod-core` and re-exports it. Use `snaprod`, which re-exports both.
#![warn(missing_docs)]

pub mod assembly;
pub mod bar;
pub mod creep;
pub mod inertia;
pub mod motion;

pub use snaprod_core::{Error, Result};
pub use snaprod_core::{body, elastica, error, manifold, math, rod, section, solve};
