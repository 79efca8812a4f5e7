//! Light walls under pressure, for [snaprod](https://docs.rs/snaprod): sections of tubes that buckle and close,
//! membranes that are inflated through limit points.
//!
//! The crate builds on `snaprod-core`. Use `snaprod`, which re-exports its modules.
#![warn(missing_docs)]

mod chebyshev;
pub mod flow;
pub mod membrane;
pub mod ring;
pub mod tube;
