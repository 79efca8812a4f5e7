//! What a person asks of a rod: a scene goes in, records come out.
//!
//! Every study takes a scene and [`Hooks`], and returns plain data: [`Table`]s of typed columns that know their names,
//! units and meaning, and the few numbers and words that sum them up. Everything that is printed, written or drawn is
//! made from these records.

pub mod assembly;
pub mod bar;
pub mod branch;
mod decimate;
pub mod dispatch;
pub mod elastica;
pub mod equilibrium;
pub mod export;
pub mod film;
pub mod fit;
pub mod folds;
mod light_rod_reference;
pub mod memory;
pub mod modes;
pub mod neglected_mass;
pub mod plan;
pub mod record;
pub mod run;
pub mod sheets;
mod solid;
mod space;
pub mod sweep;

pub use branch::{BranchRecord, branch};
pub use elastica::{ElasticaRecord, EquilibriaRecord, elastica, equilibria};
pub use equilibrium::{EquilibriumRecord, equilibrium};
pub use fit::{Data, Fit, FitRecord};
pub use folds::folds;
pub use memory::{MemoryRecord, memory};
pub use modes::{ModesRecord, modes};
pub use plan::plan;
pub use record::{Cell, Column, Csv, Sink, Table, Values, exact, json_text};
pub use sheets::{SheetsRecord, sheets};
pub use solid::Solid;
pub use sweep::{Sweep, Vary};

/// What a study asks, and tells, while it works. Every method has a default, so that a caller implements what it needs.
pub trait Hooks {
    /// Asked after every step of the work; true ends the study, which returns what it has and says that it was
    /// interrupted.
    fn interrupted(&mut self) -> bool {
        false
    }

    /// Told after every step of the work: the fraction that is done, in [0, 1], and the time or the parameter reached, in
    /// the scene's units.
    fn progress(&mut self, _fraction: f64, _at: f64) {}

    /// Asked by a study of branches: of how many points it shall have the shapes beside the few of every record; special points come
    /// beside them. Asked by a run: whether its record shall follow the motion closer than the samples (any number but 0), for figures.
    fn pictures(&mut self) -> usize {
        0
    }
}

/// Hooks of a caller who waits for the end.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Hooks for Silent {}

/// Asked whether to stop, but told nothing: of one run among many.
struct Quiet<'a>(&'a mut dyn Hooks);

impl Hooks for Quiet<'_> {
    fn interrupted(&mut self) -> bool {
        self.0.interrupted()
    }
}
