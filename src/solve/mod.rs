//! Generic algorithms that know nothing of rods.

pub mod dop853;
mod dop853_tableau;
pub mod newton;
pub mod roots;
