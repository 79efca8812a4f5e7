//! The body's motion, whatever rod it hangs on: one vocabulary, one way to drive it.
//!
//! * [`Options`]: what a run is asked to do; [`Event`]: what happens in it; [`Outcome`]: why it ends; [`Ledger`]: the energies
//!   at one moment; [`State`]: what any state shows.
//! * [`Motion`]: a motion seen from outside, whichever model is integrated; [`drive`] samples it and tells an [`Observer`].
//! * [`Run`]: an elastic rod, whose state is a point of the equilibrium manifold: motion on a sheet ([`OnSheet`]), through its
//!   fold, by a [`Snap`] onto the next.
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
