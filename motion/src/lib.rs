//! Runs of [snaprod](https://docs.rs/snaprod): motion in time with events, snaps, contacts and the energy ledger.
//!
//! The equations come from `snaprod-systems`, which is re-exported with `snaprod-core`. Use `snaprod`, which
//! re-exports all.
#![warn(missing_docs)]

pub mod motion;

pub use snaprod_systems::{Error, Result};
pub use snaprod_systems::{
    assembly, bar, body, creep, elastica, error, inertia, manifold, math, rod, section, solve,
};
