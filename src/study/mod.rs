//! Studies: a scene goes in, records come out.
//!
//! Every study takes a scene and [`Hooks`], and returns plain data: [`Table`]s of typed columns that know their names,
//! units and meaning, and the few numbers and words that sum them up. Everything that is printed, written or drawn is
//! made from these records.

pub mod all_equilibria;
pub mod assembly;
pub mod bar;
pub mod branch;
pub mod contact;
mod decimate;
pub mod dispatch;
pub mod elastica;
pub mod equilibrium;
pub mod export;
pub mod film;
pub mod first_order;
pub mod fit;
pub mod flow;
pub mod folds;
pub mod inflation;
mod light_rod_reference;
pub mod memory;
pub mod modes;
pub mod neglected_mass;
mod outline;
pub mod plan;
pub mod record;
pub mod run;
pub mod sheets;
mod solid;
mod space;
mod stations;
pub mod sweep;
pub mod tendons;
pub mod wall;

pub use all_equilibria::{AllEquilibriaRecord, all_equilibria};
pub use branch::{BranchRecord, branch};
pub use contact::{ContactRecord, ContactsRecord};
pub use elastica::{ElasticaRecord, EquilibriaRecord, elastica, equilibria};
pub use equilibrium::{EquilibriumRecord, equilibrium};
pub use first_order::FirstOrder;
pub use fit::{Data, Fit, FitRecord};
pub use folds::folds;
pub use memory::{MemoryRecord, memory};
pub use modes::{ModesRecord, modes};
pub use outline::{outline, outline_in_plane};
pub use plan::plan;
pub use record::{Cell, Column, Csv, Sink, Table, Values, exact, json_text};
pub use sheets::{SheetsRecord, sheets};
pub use solid::Solid;
pub use stations::{PlacedStation, StationValues};
pub use sweep::{Sweep, Vary};

use crate::error::Result;

/// Callbacks of a study for interrupt and progress. Every method has a default, so that a caller implements only the
/// necessary ones.
pub trait Hooks {
    /// Checked after every step; true ends the study, which returns its results so far, marked as interrupted.
    fn interrupted(&mut self) -> bool {
        false
    }

    /// Called after every step with the completed fraction in [0, 1], and the time or parameter reached, in the units
    /// of the scene.
    fn progress(&mut self, _fraction: f64, _at: f64) {}

    /// Called with every sample of the trajectory of a run: the columns without values, and the row.
    fn sample(&mut self, _columns: &[Column], _row: &[Cell]) {}

    /// True if [`Hooks::event`] is to be called.
    fn hears_events(&self) -> bool {
        false
    }

    /// Called with every event of a run, in the form of events.json, bounces included. A bar, a flow or a membrane
    /// tells the events at the end.
    fn event(&mut self, _event: serde_json::Value) {}

    /// For branches: number of points with shapes for figures, in addition to the few of every record and the special
    /// points. For a run: any number but 0 makes the record denser than the samples, for figures.
    fn pictures(&mut self) -> usize {
        0
    }
}

/// The trajectory of a bar, a flow or a membrane, whose rows go to files and to the hooks.
struct Trajectory {
    table: usize,
    columns: Vec<Column>,
}

impl Trajectory {
    fn begin(table: Table, sink: &mut dyn Sink) -> Result<Self> {
        let columns = table.columns.clone();
        let table = sink.begin(table)?;
        Ok(Self { table, columns })
    }

    fn row(&self, row: &[Cell], sink: &mut dyn Sink, hooks: &mut dyn Hooks) -> Result<()> {
        sink.row(self.table, row)?;
        hooks.sample(&self.columns, row);
        Ok(())
    }
}

/// Equally spaced times from 0 to `duration`, both included.
fn sample_times(duration: f64, samples: usize) -> impl Iterator<Item = f64> {
    let rows = samples - 1;
    (0..=rows).map(move |i| duration * i as f64 / rows as f64)
}

/// Tells the events of a run at its end.
fn tell(events: Vec<serde_json::Value>, hooks: &mut dyn Hooks) {
    if hooks.hears_events() {
        events.into_iter().for_each(|event| hooks.event(event));
    }
}

/// Hooks of a caller that waits for the end.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Hooks for Silent {}

/// Hooks that forward interrupts but no progress: for one run among many.
struct Quiet<'a>(&'a mut dyn Hooks);

impl Hooks for Quiet<'_> {
    fn interrupted(&mut self) -> bool {
        self.0.interrupted()
    }
}
