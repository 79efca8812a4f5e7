//! The numerical core of [snaprod](https://docs.rs/snaprod): the equilibrium manifolds of rods and the bodies at
//! their ends. `snaprod-systems` and `snaprod-motion` compute their motion; `snaprod` re-exports all and adds scenes,
//! studies, figures and the program. Use `snaprod`, with `default-features = false` for the numerics alone; its front
//! page lists modules, units and terms.
#![warn(missing_docs)]

pub mod body;
pub mod contact;
pub mod elastica;
pub mod error;
pub mod manifold;
pub mod math;
pub mod obstacle;
pub mod rod;
pub mod section;
pub mod solve;

pub use error::{Error, Result};
