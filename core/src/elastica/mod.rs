//! The planar elastica with a point mass at its free end, in closed form (theory Sec. 2).

mod along;
pub mod atlas;
mod beam;
mod boxes;
pub mod chart;
pub mod curvature;
mod dragged;
mod eightfold;
pub mod equilibrium;
pub mod folds;
mod held;
pub mod inertia;
pub mod inversion;
mod lanes;
mod layer;
pub mod model;
mod near;
mod settled;
mod shaken;
mod slight;
pub mod stable;
pub mod stiffness;
pub mod straight;

pub use atlas::{GridPoint, SheetGrid, sheet_grid, sheet_grid_in, stable_grid};
pub use dragged::{Dragged, DraggedSnap};
pub use equilibrium::{Equilibrium, PlanarSection};
pub use folds::{FoldPoint, fold_at, fold_curve, fold_distance};
pub use held::{HeldMode, held_modes};
pub use inertia::{LightRod, Passage, RodInertia, TautInertia};
pub use inversion::{Found, equilibria_at};
pub use layer::LayerShape;
pub use model::Elastica;
pub use settled::{settled, settled_with};
pub use stable::{FoldLine, StableRegion};
pub use stiffness::EndStiffness;
