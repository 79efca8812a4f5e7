//! The body's motion: on a sheet, through its fold, onto the next; exact reductions of viscoelastic rods.

mod drive;
mod in_space;
mod ledger;
mod motion;
pub mod reduction;
mod run;
mod snap;
mod start;
pub mod viscous;

pub use drive::{Observer, drive};
pub use in_space::InSpace;
pub use ledger::Ledger;
pub use motion::{Motion, Phase, Progress};
pub use run::{Outcome, Run, RunEvent, RunOptions, Sample};
pub use snap::{LandingRule, Snap, SnapEnd};
