//! Pure numerical kernels: no state and no rods; only [`gauss`] allocates, once a rule.

pub(crate) mod carlson;
mod domain;
pub mod eight;
pub mod elliptic;
pub mod fixed;
pub mod frame;
pub mod gauss;
#[cfg(test)]
pub(crate) mod interval;
pub mod jacobi;
pub(crate) mod means;
pub mod order;
pub mod product;
pub mod real;
pub mod registers;
pub mod se3;
pub(crate) mod theta;

pub use domain::DomainError;

/// Numbers at eight places.
pub type Row = [f64; 8];
