//! Pure kernels: no allocation, no state, nothing that knows of rods.

pub(crate) mod carlson;
mod domain;
pub mod elliptic;
pub mod jacobi;

pub use domain::DomainError;
