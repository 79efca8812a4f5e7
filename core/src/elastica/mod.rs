//! The planar elastica with a point mass at its free end, in closed form (theory Sec. 2).

pub mod atlas;
mod beam;
mod box_bounds;
pub mod chart;
mod chart8;
pub mod curvature;
mod dragged_end;
pub mod equilibrium;
pub mod first_order_mass;
pub mod folds;
mod held_vibrations;
pub mod inversion;
pub mod model;
mod rest_under_load;
mod shaking_average;
mod shape_by_theta;
mod simd_sums;
mod small_load;
pub mod stable_over_disc;
pub mod stiffness;
pub mod straight_beam;
mod straight_chart;
mod viscous_landing;

pub use atlas::{GridPoint, SheetGrid, sheet_grid, sheet_grid_in, stable_grid};
pub use dragged_end::{DraggedRod, DraggedSnap};
pub use equilibrium::{Equilibrium, PlanarSection};
pub use first_order_mass::{FoldNormalForm, LightRod, RodInertia, TautInertia};
pub use folds::{FoldPoint, fold_at, fold_curve, fold_distance};
pub use held_vibrations::{HeldMode, held_modes};
pub use inversion::{FoundEquilibrium, equilibria_at};
pub use model::Elastica;
pub use rest_under_load::{equilibrium_under_load, equilibrium_under_load_and_weight};
pub use stable_over_disc::{FoldLine, StableRegion};
pub use stiffness::EndStiffness;
pub use viscous_landing::LayerShape;
