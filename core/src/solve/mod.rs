//! Generic algorithms that know nothing of rods.

pub mod arclength;
mod corrector;
pub mod cost;
pub mod deflation;
pub mod differences;
pub mod dop853;
mod dop853_tableau;
mod elimination;
pub mod family;
pub mod fold_curve;
pub mod gauss;
pub mod integrator;
pub mod lobatto;
pub mod lu;
pub mod newton;
pub mod normal_form;
pub mod radau;
pub mod radau7;
mod radau_stages;
mod relocate;
pub mod roots;
mod rough;
pub mod special;
pub mod stepper;
pub mod switching;
pub mod system;
pub mod warm;
