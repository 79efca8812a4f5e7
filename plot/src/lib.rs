//! Figures of [snaprod](https://docs.rs/snaprod) from data: each function takes plain numbers and returns an
//! SVG document.
//!
//! Only the layout is computed here, and equal data give equal bytes. Each function takes the [`Paper`] of
//! its figure; the default is a screen. SVG text asks for DejaVu Sans. With the features `png` and `pdf`,
//! `plot::png` and `plot::pdf` turn a figure into those formats with that font bundled.
//!
//! | figure | shows |
//! | --- | --- |
//! | [`snapshots`] | the rod at several times, the path of its mass, folds and snaps |
//! | [`energies`] | the ledger against time, and its error |
//! | [`space_way`] | the way of a point in space, and its coordinates over time |
//! | [`path_on_surface`] | a motion on the sheets over the disc, with its jumps |
//! | [`phase_portrait`] | orbits of the elastica's equation and the arcs that are solutions (AMV Fig. 3.12) |
//! | [`sheets_lambda_alpha`] | sheets in (lam, alpha, theta(1)) (AMV Fig. 3.22) |
//! | [`sheets_over_disc`] | sheets over the positions of the free end (AMV Fig. 3.24) |
//! | [`fold_map`] | fold curves, cusps, numbers of stable equilibria |
//! | [`energy_landscape`] | the elastic energy over the disc |
//! | [`lines`] | any curves, linear or logarithmic; orders of convergence with reference slopes |
//! | [`small_multiples`] | curves in panels beside each other, over common axes |
//! | [`stacked`] | curves in panels one over another, over one x axis |
//! | [`branch_diagram`] | branches of equilibria over a parameter, their stability, special points |
//! | [`rod_shapes`] | rods in space, in perspective |
//! | [`strain_map`] | strain and dissipation of a viscous rod over time and arclength |
//! | [`layer`] | a snap in stretched time: shapes and energies |
//! | [`dissipated_against_released`], [`losses_over_time`] | losses of a viscous run against the elastic limit |
//! | [`kernel`] | memory: relaxation and creep functions of the end |
//! | [`mode_shapes`] | small vibrations about an equilibrium, both ways |
//! | [`outcome_map`] | the outcome of a sweep over two fields of a scene |
//! | [`swept_curves`] | the outcome of a sweep over one field |
//! | [`fit`](fit()) | measured data, the model fitted to them, and the residuals |
//! | [`film`](film()), [`moving`] | a motion as frames, and as one moving picture |
//! | [`rod_state`] | one rod in space with its loads, couples, forces and strains |
//!
//! Numbers that are not finite break a curve or leave a hole; a figure without anything to show is an error
//! ([`Error::is_domain`](snaprod_core::error::Error::is_domain)).
#![warn(missing_docs)]

mod axes;
mod branch;
mod camera;
mod canvas;
mod cells;
mod contour;
mod data;
mod depth;
mod energies;
mod faces;
mod film;
mod fit;
#[cfg(any(feature = "png", feature = "pdf"))]
mod formats;
mod geometry;
mod heat;
mod history;
mod kernel;
mod labels;
mod layer;
mod legend;
mod lines;
mod losses;
mod maps;
mod modes;
mod motion;
mod outcome;
mod page;
mod painter;
mod palette;
mod panels;
mod paper;
mod portrait;
mod rods;
mod scenery;
mod slopes;
mod spread;
mod stage;
mod state;
mod surfaces;
mod swept;
mod text;
mod ticks;
mod way;

pub use axes::Scale;
pub use branch::{BranchDiagram, BranchLine, BranchPanel, Special, SpecialKind, branch_diagram};
pub use data::{AxisUnits, Bounds, Curve, Field, LineStyle, Patch, Series, View};
pub use energies::{Energies, energies};
pub use film::{FilmFigure, FilmFrame, film, moving};
pub use fit::{FitFigure, FittedCurve, fit};
#[cfg(feature = "pdf")]
pub use formats::pdf;
#[cfg(feature = "png")]
pub use formats::{gif, png};
pub use heat::{StrainMap, strain_map};
pub use kernel::{KernelCurve, KernelFigure, kernel};
pub use layer::{LayerFigure, LayerRun, layer};
pub use lines::{Lines, lines, small_multiples, stacked};
pub use losses::{
    LossGroup, LossesOverTime, SnapLosses, dissipated_against_released, losses_over_time,
};
pub use maps::{EnergyLandscape, FoldMap, energy_landscape, fold_map};
pub use modes::{ModeShape, ModeShapes, mode_shapes};
pub use motion::{DrawnShape, Snapshots, snapshots};
pub use outcome::{OutcomeMap, Outcomes, SweptAxis, outcome_map};
pub use panels::{RodPanel, RodPanels, rod_panels};
pub use paper::Paper;
pub use portrait::{Arc, NamedPoint, Portrait, phase_portrait};
pub use rods::{RodShapes, rod_shapes};
pub use scenery::{Ground, SpaceBody, SpaceRod};
pub use slopes::Slope;
pub use state::{RodState, rod_state};
pub use surfaces::{
    PathOnSurface, Sheets, SpaceCurve, path_on_surface, sheets_lambda_alpha, sheets_over_disc,
};
pub use swept::{SweptCurves, swept_curves};
pub use way::{SpaceWay, space_way};
