//! Reduced-order dynamics of light rods that carry heavy rigid bodies.
//!
//! The rod has no inertia: at every instant it is in equilibrium between its clamp and the body, so the
//! body alone moves, in a multivalued force field. The equilibria form a smooth manifold with a chart;
//! everything is written over it.
//!
//! * [`manifold`]: the trait, and what needs nothing else: inversion near a guess, kernels of folds.
//! * [`elastica`]: the planar elastica in closed form: equilibria with their labels, folds and cusps, Morse
//!   index, all equilibria at a point, viscous landings.
//! * [`rod`]: Cosserat rods in space: section laws, equilibria, branches, stability.
//! * [`truss`]: the von Mises truss, the smallest manifold with folds.
//! * [`viscous`]: viscoelastic rods: rate laws, strains with memory.
//! * [`body`]: the mass and its loads. [`dynamics`]: motion on a sheet, snaps, ledger, runs.
//! * [`math`], [`solve`]: elliptic kernels; DOP853 with events, bracketed roots, Newton, continuation.
//! * `scene` (feature `scene`): TOML scenes. `plot` (feature `plot`): SVG figures from data.
//!
//! Units are those of the rod: length 1, bending stiffness 1; forces are in EI/L^2, energies in EI/L, times
//! in sqrt(mu L^3/EI).
#![warn(missing_docs)]

pub mod body;
pub mod dynamics;
pub mod elastica;
pub mod error;
pub mod manifold;
pub mod math;
#[cfg(feature = "plot")]
pub mod plot;
pub mod rod;
#[cfg(feature = "scene")]
pub mod scene;
pub mod solve;
pub mod truss;
pub mod viscous;

pub use error::{Error, Result};

/// The README's program, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
