//! Motion of a body on rods of any model: shared vocabulary, and one interface to drive it.
//!
//! * [`Options`]: the options of a run; [`Event`]: its events; [`Outcome`]: the reason for its end;
//!   [`Ledger`]: the energies at one moment; [`State`]: the quantities of any state.
//! * [`Motion`]: the interface of a motion of any model; [`drive`] samples it and reports to an [`Observer`].
//! * [`Run`]: an elastic rod, whose state is a point of the equilibrium manifold: motion on a sheet
//!   ([`OnSheet`]), through its fold, by a [`Snap`] onto the next.
//! * [`creep`]: a viscoelastic rod, whose state is the field of its strains.
//! * [`inertia`]: a rod with mass, whose state is the field of its strains and of their rates.
//! * [`reduction`]: motions of viscoelastic rods that are exactly those of springs and dashpots.

pub mod assembly;
mod beside;
mod carried;
pub mod creep;
mod drive;
mod event;
pub mod inertia;
mod ledger;
mod locate;
mod nodes;
mod options;
pub mod reduction;
mod run;
mod sheet;
mod snap;
mod start;
mod state;
mod straight;
mod turning;

pub use crate::error::{Cause, Stuck};
pub use beside::{Beside, Crossed, Light, LightInSpace, Loss, Lost};
pub use drive::{Carried, Motion, Observer, Resolution, drive};
pub use event::{Bounce, Event, Outcome};
pub use ledger::{Closing, Ledger};
pub use options::{Nodes, Options};
pub use run::{Run, Sample, on_elastica};
pub use sheet::{OnSheet, Phase, Progress};
pub use snap::{LandingRule, Snap, SnapEnd};
pub use state::{Labels, RodCurve, Seen, State, curve_outward, outward};
