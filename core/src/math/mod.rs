//! Pure numerical kernels, independent of rods. Their only state is the choice of registers.

pub(crate) mod agm;
pub(crate) mod carlson;
pub(crate) mod collocation_tables;
pub mod curve_fit;
pub mod difference;
mod domain;
pub mod elliptic;
pub mod frame;
pub mod gauss;
pub mod history;
pub mod jacobi;
pub mod lanes8;
pub mod piecewise;
pub mod product;
pub mod real;
pub mod registers;
mod rest_spline;
pub mod se3;
pub mod small_matrices;
pub mod small_sort;
pub(crate) mod theta;

pub use domain::DomainError;

/// Numbers at eight places.
pub type Row = [f64; 8];
