//! Observer of a motion: writes the tables and stores data for figures.

use super::bounces::Bounces;
use super::contacts::{self, BranchContacts};
use super::moment::{FigureState, Moment, ShapesAt};
use super::outward;
use super::prepared::Prepared;
use super::record::RunBranch;
use super::rest::LazyRest;
use super::tree::BranchOrigin;
use super::{Fields, places, table};
use crate::error::{Quantity, Result};
use crate::motion::viscoelastic::Layer;
use crate::motion::{
    Cause, Event, LedgerClosure, LightSnap, Motion, Observer, Outcome, Snap, State, Stuck,
};
use crate::scene::ModelKind;
use crate::study::decimate::Thinned;
use crate::study::light_rod_reference::LightRods;
use crate::study::neglected_mass::{BouncePassed, FoldPassed};
use crate::study::{Cell, Column, Hooks, Sink};

/// Moments per step for figures, its end included: a step of order 8 may span half an oscillation.
const INNER: usize = 6;
/// Moments per step in space, where an intermediate state costs a good part of a step.
const INNER_IN_SPACE: usize = 2;
/// Steps of a rod with strains resolve fast decay or waves: their ends are dense enough for figures of the body.
const STEP_ENDS: usize = 1;
/// Largest number of moments kept for a run, for one drawn from its steps, and for a stroboscopic section; at the
/// limit every second one is dropped.
const KEPT: usize = 4000;
const KEPT_TO_DRAW: usize = 24_000;
const KEPT_OF_SECTION: usize = 100_000;
/// Largest number of samples kept with their strains.
const KEPT_WITH_STRAINS: usize = 1200;
const KEPT_OF_PASSAGE: usize = 400;
/// Number of passages kept for figures: several, since figures skip a passage if the end of the rod moves.
const PASSAGES: usize = 8;
/// Number of times with shapes of rods in space.
const SHAPES: usize = 10;
/// Distance from equilibrium above which the states of a passage are kept.
const AWAY: f64 = 1e-3;
/// Sections of a drawn axis, and of a drawn rod in space.
const CURVE: usize = 60;
const SECTIONS: usize = 61;
/// Number of samples in the strain field table, unless all are requested.
const INSTANTS: usize = 401;

/// Collected results of the branches of a run, beside their records.
#[derive(Default)]
pub(super) struct Passed {
    /// Folds passed by rods of known mass.
    pub folds: Vec<FoldPassed>,
    /// Stored bounces of rods of known mass.
    pub bounces: Vec<BouncePassed>,
}

/// Destinations of a run: tables, caller, density of the strain field.
pub(super) struct Outlets<'o> {
    pub sink: &'o mut dyn Sink,
    pub hooks: &'o mut dyn Hooks,
    pub fields: Fields,
}

/// The observer of one branch. Snaps, layers and the ledger are kept in the units of the motion.
pub(super) struct Recorder<'r> {
    prepared: &'r Prepared,
    rest: &'r LazyRest<'r>,
    sink: &'r mut dyn Sink,
    hooks: &'r mut dyn Hooks,
    places: Vec<f64>,
    trajectory: usize,
    /// The columns of the trajectory, without values.
    columns: Vec<Column>,
    strain: Option<StrainTable>,
    /// The table of contacts and their extremes; None without obstacles.
    contacts: Option<(usize, BranchContacts)>,
    first: Moment,
    closing: LedgerClosure,
    snaps: Vec<Snap>,
    layers: Vec<Layer>,
    beside: LightRods,
    bounces: Bounces,
    bounced: Vec<BouncePassed>,
    way: Thinned<Moment>,
    track: Thinned<FigureState>,
    shapes: Thinned<ShapesAt>,
    passage: Thinned<FigureState>,
    /// Completed passages, in order of decreasing dissipation.
    passages: Vec<Vec<FigureState>>,
    /// True if figures need moments between the samples.
    dense: bool,
}

/// Strain table with every `stride`-th sample.
struct StrainTable {
    table: usize,
    stride: usize,
    seen: usize,
}

/// Stride of the samples in the strain table.
pub(super) fn stride(prepared: &Prepared, fields: Fields) -> Option<usize> {
    match fields {
        _ if prepared.header.strains.is_empty() => None,
        Fields::None => None,
        Fields::All => Some(1),
        Fields::Some => {
            let steps = prepared.header.run.samples - 1;
            Some(steps.div_ceil(INSTANTS - 1).max(1))
        }
    }
}

/// The outcome after the audit of the ledger: a complete run that lost or gained energy has ended early.
fn outcome_after_audit(
    outcome: Outcome,
    closing: &LedgerClosure,
    tolerance: f64,
    at: f64,
) -> Outcome {
    if outcome != Outcome::EndOfTime || closing.is_closed(tolerance) {
        return outcome;
    }
    let relative = closing.relative();
    Outcome::Stuck(Stuck::new(
        at,
        Cause::Ledger { relative },
        "do not trust the motion: lower the tolerance, or end before the error arises (column `total` of the trajectory)",
    ))
}

impl<'r> Recorder<'r> {
    /// A recorder of branch `id` from the present state of `motion`; `total`: expected total of the ledger, in units of
    /// the motion.
    pub fn new(
        prepared: &'r Prepared,
        rest: &'r LazyRest<'r>,
        outlets: &'r mut Outlets<'_>,
        id: usize,
        motion: &dyn Motion<'_>,
        total: f64,
    ) -> Result<Self> {
        let (header, first) = (&prepared.header, motion.now());
        let mut closing = LedgerClosure::new(total);
        closing.look(&first.ledger());
        let moment = prepared.moment(&*first);
        let Outlets {
            sink,
            hooks,
            fields,
        } = outlets;
        let table = table::trajectory(header, id);
        let columns = table.columns.clone();
        let trajectory = sink.begin(table)?;
        let strain = match stride(prepared, *fields) {
            None => None,
            Some(stride) => Some(StrainTable {
                table: sink.begin(table::strain(header, id))?,
                stride,
                seen: 0,
            }),
        };
        let contacts = if header.has_contact {
            let table = sink.begin(contacts::table(header, id))?;
            Some((table, BranchContacts::new()))
        } else {
            None
        };
        let strobe = header.run.strobe.is_some();
        let dense = !strobe && hooks.pictures() > 0;
        let kept = if strobe {
            KEPT_OF_SECTION
        } else if dense {
            KEPT_TO_DRAW
        } else {
            KEPT
        };
        Ok(Self {
            prepared,
            rest,
            sink: *sink,
            dense,
            hooks: *hooks,
            places: places(),
            trajectory,
            columns,
            strain,
            contacts,
            first: moment,
            closing,
            snaps: Vec::new(),
            layers: Vec::new(),
            beside: LightRods::new(prepared.model.light_rods(rest, &*first)),
            bounces: Bounces::default(),
            bounced: Vec::new(),
            way: Thinned::new(kept),
            track: Thinned::new(KEPT_WITH_STRAINS),
            shapes: Thinned::new(SHAPES),
            passage: Thinned::new(KEPT_OF_PASSAGE),
            passages: Vec::new(),
        })
    }

    /// Returns the record of the branch in the units of the scene; its folds and bounces are added to `passed`.
    pub fn finish(
        mut self,
        motion: &dyn Motion<'_>,
        origin: BranchOrigin,
        outcome: Outcome,
        passed: &mut Passed,
    ) -> Result<RunBranch> {
        let (last, prepared) = (motion.now(), self.prepared);
        let (k, model) = (&prepared.header.scales, &prepared.model);
        self.end_passage();
        self.end_shapes(&*last)?;
        self.closing.look(&last.ledger());
        let moment = prepared.moment(&*last);
        let (crossed, lost) = self.beside.told();
        let snaps: Vec<Snap> = origin.entered.into_iter().chain(self.snaps).collect();
        let folds = self
            .rest
            .folds(&prepared.header, origin.id, &snaps, &crossed, &moment);
        passed.folds.extend(folds);
        passed.bounces.extend(self.bounced);
        let mut snaps: Vec<Snap> = snaps
            .iter()
            .map(|snap| model.snap(snap))
            .collect::<Result<_>>()?;
        let within = snaps.split_off(usize::from(origin.parent.is_some()));
        let light = |crossed: LightSnap| -> Result<LightSnap> {
            Ok(LightSnap {
                snap: model.light_snap(&crossed.snap)?,
                ledger: crossed.ledger.scaled(k.energy),
            })
        };
        let tolerance = prepared.header.run.tolerance;
        let outcome = outcome_after_audit(outcome, &self.closing, tolerance, last.time());
        let (time, energy) = (k.unit(Quantity::Time), k.unit(Quantity::Couple));
        Ok(RunBranch {
            id: origin.id,
            parent: origin.parent,
            fork: origin.fork,
            entered: snaps.pop(),
            first: self.first,
            last: moment,
            outcome: match outcome {
                Outcome::SelfContact(contact) => Outcome::SelfContact(model.contact(&contact)),
                outcome => outcome,
            },
            cost: motion.cost(),
            unfelt: motion.time_without_mass() * time,
            resolution: motion.resolution(),
            why_no_elements: motion.why_no_elements().map(str::to_owned),
            snaps: within,
            layers: self
                .layers
                .iter()
                .map(|layer| layer.scaled(time, energy))
                .collect(),
            crossed: crossed.into_iter().map(light).collect::<Result<_>>()?,
            lost: lost
                .into_iter()
                .map(|lost| outward::interval(k, lost))
                .collect(),
            bounces: self.bounces,
            contacts: self.contacts.map(|(_, contacts)| contacts.outward(k)),
            closing: self.closing.scaled(energy),
            way: self.way.list,
            track: self.track.list,
            passages: self.passages,
            shapes: self.shapes.list,
        })
    }

    fn frame(&self, state: &dyn State) -> FigureState {
        let (prepared, model) = (self.prepared, self.prepared.header.model);
        // Without the index in space, which no figure shows.
        let moment = match model {
            Some(ModelKind::ElasticSpace) => prepared.moment_without_index(state),
            _ => prepared.moment(state),
        };
        let axis = match model {
            Some(ModelKind::Planar) => prepared.curves(state, CURVE).unwrap_or_default(),
            _ => Vec::new(),
        };
        let axis = axis.iter().flatten();
        FigureState {
            moment,
            strains: prepared.strains_at(state, &self.places),
            dissipation: prepared.dissipation_at(state, &self.places),
            axis: axis
                .map(|(_, at)| [at.translation.x, at.translation.y])
                .collect(),
        }
    }

    /// Keeps a sample with its strains, at the stride of the track, if the rod has strains; `frame` if already made.
    fn show(&mut self, state: &dyn State, frame: Option<FigureState>) {
        if self.prepared.header.strains.is_empty() {
            return;
        }
        let mut track = std::mem::replace(&mut self.track, Thinned::new(0));
        track.show(|| frame.unwrap_or_else(|| self.frame(state)));
        self.track = track;
    }

    /// Writes the strain field of a state.
    fn write_strain(&mut self, table: usize, frame: &FigureState) -> Result<()> {
        let k = &self.prepared.header.scales;
        // A taut rod next to its fold may have no shape.
        let known = |strain: &Vec<f64>| strain.len() == self.places.len();
        if !frame.strains.iter().all(known) {
            return Ok(());
        }
        for (i, s) in self.places.iter().enumerate() {
            let strains = frame.strains.iter().map(|strain| strain[i]);
            let s = k.outward(Quantity::Length, *s);
            let row = [frame.moment.t, s].into_iter().chain(strains);
            let row: Vec<Cell> = row.chain([frame.dissipation[i]]).map(Cell::Real).collect();
            self.sink.row(table, &row)?;
        }
        Ok(())
    }

    fn write(&mut self, state: &dyn State, moment: &Moment) -> Result<()> {
        let stations = self.prepared.stations(state)?;
        let joints = self.prepared.joints(state)?;
        let row = table::row(&self.prepared.header, moment, &stations, &joints);
        self.sink.row(self.trajectory, &row)?;
        self.hooks.sample(&self.columns, &row);
        let Some(((table, seen), sample)) = self.contacts.as_mut().zip(state.contact()) else {
            return Ok(());
        };
        seen.look(sample);
        for row in moment
            .contact
            .iter()
            .flat_map(|contact| contacts::rows(&self.prepared.header, moment.t, contact))
        {
            self.sink.row(*table, &row)?;
        }
        Ok(())
    }

    /// Appends the last shapes of rods in space, or replaces previous ones at nearly the same time.
    fn end_shapes(&mut self, last: &dyn State) -> Result<()> {
        if !self.prepared.header.in_space() {
            return Ok(());
        }
        let now = self.prepared.shapes_at(last, SECTIONS)?;
        let shapes = &mut self.shapes.list;
        if let [.., before, near] = shapes.as_slice()
            && now.t - near.t < 0.5 * (near.t - before.t)
        {
            shapes.pop();
        }
        shapes.push(now);
        Ok(())
    }

    /// Keeps the passage if its dissipation is among the largest.
    fn end_passage(&mut self) {
        let passage = std::mem::replace(&mut self.passage, Thinned::new(KEPT_OF_PASSAGE)).list;
        let lost = |passage: &[FigureState]| match passage {
            [first, .., last] => last.moment.ledger.dissipated - first.moment.ledger.dissipated,
            _ => 0.0,
        };
        let loss = lost(&passage);
        if loss > 0.0 {
            let place = self.passages.partition_point(|other| lost(other) >= loss);
            self.passages.insert(place, passage);
            self.passages.truncate(PASSAGES);
        }
    }

    /// Records the end of a step of one rod with strains. On a sheet the state would have to be computed.
    fn step(&mut self, now: &dyn State) {
        self.closing.look(&now.ledger());
        if self.prepared.header.in_space() {
            return;
        }
        if now.distance() > AWAY {
            let mut passage = std::mem::replace(&mut self.passage, Thinned::new(0));
            passage.show(|| self.frame(now));
            self.passage = passage;
        } else if !self.passage.list.is_empty() {
            self.end_passage();
        }
    }

    /// Records one side of a snap; its row is left out of a stroboscopic section.
    fn side(&mut self, state: &dyn State) -> Result<()> {
        self.closing.look(&state.ledger());
        if !self.prepared.header.strains.is_empty() {
            self.track.keep(self.frame(state));
        }
        let moment = self.prepared.moment(state);
        if self.prepared.header.run.strobe.is_none() {
            self.write(state, &moment)?;
        }
        self.way.keep(moment);
        Ok(())
    }
}

impl Observer for Recorder<'_> {
    fn sample(&mut self, state: &dyn State) -> Result<()> {
        let prepared = self.prepared;
        let moment = prepared.moment(state);
        self.write(state, &moment)?;
        self.closing.measure(state);
        let mut frame = None;
        if let Some(strain) = &mut self.strain {
            let written = strain.seen.is_multiple_of(strain.stride);
            strain.seen += 1;
            let table = strain.table;
            if written {
                let now = self.frame(state);
                self.write_strain(table, &now)?;
                frame = Some(now);
            }
        }
        if prepared.header.in_space() {
            let shapes = || prepared.shapes_at(state, SECTIONS);
            self.shapes.try_show(shapes)?;
        }
        self.show(state, frame);
        // Other moments come from the steps.
        if !self.dense || self.way.list.is_empty() {
            self.way.show(|| moment);
        }
        Ok(())
    }

    fn event(&mut self, event: &Event, motion: &mut dyn Motion<'_>) -> Result<()> {
        let is_step = matches!(event, Event::Step { .. });
        if !is_step
            && self.hooks.hears_events()
            && let Some(told) = self.prepared.told(event)?
        {
            self.hooks.event(told);
        }
        match event {
            Event::Step { .. } if motion.resolution().is_some() => {
                self.beside.step(motion);
                if !self.prepared.header.is_assembly() {
                    self.step(&*motion.now());
                }
            }
            Event::Snap(snap) => {
                self.snaps.push(snap.clone());
                if let Some(before) = motion.before_snap() {
                    self.side(&*before)?;
                }
                self.side(&*motion.now())?;
            }
            Event::Layer(layer) => {
                self.layers.push(*layer);
                self.beside.land(&*motion.now());
            }
            Event::Bounce(bounce) => {
                if self.bounces.add(self.prepared.model.bounce(bounce))
                    && !self.prepared.header.full
                {
                    let rest = self.rest.get();
                    self.bounced
                        .extend(rest.and_then(|rest| rest.bounced(bounce)));
                }
            }
            Event::Contact(event) => {
                if let Some((_, contacts)) = &mut self.contacts {
                    contacts.events.push(*event);
                }
            }
            Event::RodContact(event) => {
                if let Some((_, contacts)) = &mut self.contacts {
                    contacts.rod_events.push(*event);
                }
            }
            Event::Step { .. } | Event::Stop(_) => {}
        }
        Ok(())
    }

    fn moments(&self) -> usize {
        let header = &self.prepared.header;
        if !self.dense {
            0
        } else if header.is_sheet() {
            INNER
        } else if header.is_elastic() {
            INNER_IN_SPACE
        } else {
            STEP_ENDS
        }
    }

    fn look(&mut self, state: &dyn State) {
        // The first sample is already recorded.
        let t = self.prepared.time(state.time());
        if let [only] = self.way.list.as_slice()
            && only.t == t
        {
            return;
        }
        let prepared = self.prepared;
        self.way.show(|| {
            if prepared.header.is_sheet() {
                prepared.moment(state)
            } else {
                // For other models no figure needs the equilibrium labels or the index.
                prepared.moment_without_index(state)
            }
        });
    }

    fn go_on(&mut self, time: f64) -> bool {
        let header = &self.prepared.header;
        let t = header.scales.outward(Quantity::Time, time);
        self.hooks.progress(t / header.run.duration, t);
        !self.hooks.interrupted()
    }
}
