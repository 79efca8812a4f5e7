//! The body's motion: on a sheet, through its fold, onto the next; exact reductions of viscoelastic rods.

pub mod creep;
mod drive;
mod in_space;
mod ledger;
pub mod reduction;
mod run;
mod sheet;
mod snap;
mod start;

pub use drive::{Observer, drive};
pub use in_space::InSpace;
pub use ledger::Ledger;
pub use run::{Outcome, Run, RunEvent, RunOptions, Sample};
pub use sheet::{Motion, Phase, Progress};
pub use snap::{LandingRule, Snap, SnapEnd};
