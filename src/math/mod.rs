//! Pure kernels: no allocation, no state, nothing that knows of rods.

pub(crate) mod carlson;
pub mod jacobi;
