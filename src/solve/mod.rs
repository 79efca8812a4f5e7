//! Generic algorithms that know nothing of rods.

mod dop853_tableau;
