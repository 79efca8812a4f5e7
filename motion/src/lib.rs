//! The runs of [snaprod](https://docs.rs/snaprod): motion in time with its events, snaps, contacts and the ledger of
//! energies.
//!
//! All models of rods share one vocabulary and one interface to drive a motion. The crate stands on
//! `snaprod-systems`, whose equations it runs. Use `snaprod`, which re-exports both.
//!
//! * [`Options`]: the options of a run; [`Event`]: its events; [`Outcome`]: the reason for its end;
//!   [`Ledger`]: the energies at one moment; [`State`]: the quantities of any state.
//! * [`Motion`]: the interface of a motion of any model; [`drive`] samples it and reports to an [`Observer`].
//! * [`Run`]: an elastic rod, whose state is a point of the equilibrium manifold: motion on a sheet
//!   ([`OnSheet`]), through its fold, by a [`Snap`] onto the next.
//! * [`viscoelastic`]: a viscoelastic rod, whose state is the field of its strains.
//! * [`full_mass`]: a rod with mass, whose state is the field of its strains and of their rates.
//! * [`sensitivity`]: derivatives of a motion on sheets by a parameter, through its snaps.
//! * [`contact`]: rigid bodies without rods that hit obstacles and each other.
//! * [`reduction`]: motions of viscoelastic rods that are exactly those of springs and dashpots.
#![warn(missing_docs)]

mod adaptive_nodes;
pub mod assembly;
mod body_with_rod;
pub mod contact;
mod drive;
mod event;
pub mod full_mass;
mod groove_turning_points;
mod ledger;
mod light_rod_reference;
mod locate;
mod options;
pub mod reduction;
mod run;
mod saved_state;
pub mod sensitivity;
mod sheet;
mod snap;
mod start;
mod state;
mod straight_release;
pub mod viscoelastic;

pub use drive::{Motion, Observer, Resolution, StateVariables, drive};
pub use event::{Bounce, Event, Outcome};
pub use ledger::{Ledger, LedgerClosure};
pub use light_rod_reference::{
    LightInSpace, LightReference, LightSnap, LossReason, MasslessRod, UnknownInterval,
};
pub use options::{Nodes, Options};
pub use run::{AmongObstacles, RodBound, RodTouch, Run, Sample, on_elastica};
pub use saved_state::SavedState;
pub use sheet::{OnSheet, Phase, Progress};
pub use snap::{LandingRule, Snap, SnapEnd};
pub use snaprod_systems::error::{Cause, Error, Result, Stuck};
pub use state::{
    EndInWorld, Labels, RodCurve, SectionState, State, StateRef, curve_outward, outward,
};
