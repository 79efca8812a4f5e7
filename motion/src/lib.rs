//! The runs of [snaprod](https://docs.rs/snaprod): motion in time with its events, snaps, contacts and the ledger of energies.
//! It stands on `snaprod-systems`, the equations it runs, and re-exports them with `snaprod-core`. Use `snaprod`, which re-exports all.
#![warn(missing_docs)]

pub mod motion;

pub use snaprod_systems::{Error, Result};
pub use snaprod_systems::{
    assembly, bar, body, creep, elastica, error, inertia, manifold, math, rod, section, solve,
};
