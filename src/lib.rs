//! Reduced-order dynamics of light rods that carry heavy rigid bodies.
//!
//! The rod has no inertia: at every instant it is in equilibrium between its clamp and the body, so the
//! body alone moves, in a multivalued force field. The equilibria form a smooth manifold with a chart;
//! elastic motion is written over it. A viscoelastic rod has a state of its own, the field of its strains, which creep
//! under what of the resultants the stored energy does not take.
//!
//! * [`manifold`]: the trait, and what needs nothing else: inversion near a guess, kernels of folds.
//! * [`elastica`]: the planar elastica in closed form: equilibria with their labels, folds and cusps, Morse
//!   index, all equilibria at a point, viscous landings.
//! * [`rod`]: Cosserat rods in space: section laws, equilibria, branches, stability.
//! * [`manifold::truss`]: the von Mises truss, the smallest manifold with folds.
//! * [`creep`]: viscoelastic rods: laws of friction and relaxation, strains on Gauss nodes, the wrench that goes with a
//!   moving end; the memory of small motions.
//! * [`body`]: the mass, or the rigid body, and its loads.
//! * [`motion`]: motion on a sheet, snaps, ledger, runs; [`motion::creep`]: motion of a viscoelastic rod with its
//!   body; [`motion::reduction`]: motions of it that are exactly those of a spring and a dashpot.
//! * [`math`], [`solve`]: elliptic kernels; DOP853 with events, Radau IIA, bracketed roots, Newton, continuation.
//! * `scene` (feature `scene`): TOML scenes. `study` (feature `scene`): what a person asks of a scene, as records.
//!   `plot` (feature `plot`): SVG figures from data.
//!
//! Units are those of the rod: length 1, bending stiffness 1; forces are in EI/L^2, energies in EI/L, times
//! in sqrt(mu L^3/EI), viscosities in EI times that.
#![warn(missing_docs)]

#[cfg(feature = "cli")]
extern crate self as snaprod;

pub mod body;
// The program is compiled with the library, so that no generic code is instantiated twice; it speaks of the library by
// its name, as any other user does.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod creep;
pub mod elastica;
pub mod error;
pub mod manifold;
pub mod math;
pub mod motion;
#[cfg(feature = "plot")]
pub mod plot;
pub mod rod;
#[cfg(feature = "scene")]
pub mod scene;
pub mod section;
pub mod solve;
#[cfg(feature = "scene")]
pub mod study;

pub use error::{Error, Result};

/// The README's program, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
