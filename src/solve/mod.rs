//! Generic algorithms that know nothing of rods.

pub mod arclength;
mod corrector;
pub mod dop853;
mod dop853_tableau;
mod elimination;
pub mod family;
pub mod newton;
pub mod roots;
pub mod special;
