//! Observer of a motion: writes the tables and stores data for figures.

use super::ModelKind;
use super::bounces::Bounces;
use super::prepared::{Prepared, RestState};
use super::record::{Bounds, Frame, Moment, RunBranch, unresolved};
use super::table;
use super::{Fields, places};
use crate::error::Result;
use crate::motion::viscoelastic::Layer;
use crate::motion::{
    Cause, Event, LedgerClosure, LightSnap, Motion, Observer, Outcome, Snap, State, Stuck,
};
use crate::scene::Units;
use crate::study::decimate::Thinned;
use crate::study::light_rod_reference::LightRods;
use crate::study::{Cell, Hooks, Sink};
use nalgebra::Isometry3;

/// Moments per step for figures, its end included: a step of order 8 may span half an oscillation.
const INNER: usize = 6;
/// Moments per step in space, where an intermediate state costs a good part of a step.
pub(in crate::study) const INNER_IN_SPACE: usize = 2;
/// Steps of a rod with strains resolve fast decay or waves: their ends are dense enough for figures of the body.
pub(in crate::study) const STEP_ENDS: usize = 1;
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
const AXES: usize = 10;
/// Distance from equilibrium above which the states of a passage are kept.
const AWAY: f64 = 1e-3;
/// Points of a drawn axis.
const CURVE: usize = 60;
/// Number of samples in the strain field table, unless all are requested.
const INSTANTS: usize = 401;

/// The observer of one branch.
pub(super) struct Recorder<'r> {
    prepared: &'r Prepared,
    sink: &'r mut dyn Sink,
    hooks: &'r mut dyn Hooks,
    places: Vec<f64>,
    trajectory: usize,
    strain: Option<Strain>,
    closing: LedgerClosure,
    snaps: Vec<Snap>,
    layers: Vec<Layer>,
    beside: LightRods,
    bounces: Bounces,
    way: Thinned<Moment>,
    track: Thinned<Frame>,
    axes: Thinned<(f64, Vec<Isometry3<f64>>)>,
    passage: Thinned<Frame>,
    /// Completed passages, in order of decreasing dissipation.
    passages: Vec<Vec<Frame>>,
    /// True if figures need moments between the samples.
    dense: bool,
}

/// Strain table with every `stride`-th sample.
struct Strain {
    table: usize,
    stride: usize,
    seen: usize,
}

/// Stride of the samples in the strain table.
pub(super) fn stride(prepared: &Prepared, fields: Fields) -> Option<usize> {
    match fields {
        _ if prepared.strains().is_empty() => None,
        Fields::None => None,
        Fields::All => Some(1),
        Fields::Some => Some((prepared.run.samples - 1).div_ceil(INSTANTS - 1).max(1)),
    }
}

/// The outcome after the audit of the ledger: a complete run that lost or gained energy has ended early.
pub(in crate::study) fn outcome_after_audit(
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

/// Least speed of a resolved motion in units of the rod, as a multiple of the tolerance.
const RESOLVED: f64 = 1e3;

/// Stable key of the outcome: key of the first outcome that fell short, branch_limit where branches were cut, or
/// end_of_time.
pub(in crate::study) fn outcome_key<'a>(
    cut: usize,
    mut outcomes: impl Iterator<Item = &'a Outcome>,
) -> &'static str {
    let short = outcomes.find(|outcome| !outcome.is_complete());
    match cut {
        0 => short.map_or("end_of_time", Outcome::key),
        _ => "branch_limit",
    }
}

/// Sum of the times; `None` if zero.
pub(in crate::study) fn total_time(times: impl Iterator<Item = f64>) -> Option<f64> {
    let time: f64 = times.sum();
    (time > 0.0).then_some(time)
}

/// Warning about unresolved strain rates or energies beyond the tolerance, from ledger and last strain rate
/// coefficients of each branch.
pub(in crate::study) fn resolution_warning<'a>(
    told: impl Iterator<Item = (&'a LedgerClosure, Option<f64>)> + Clone,
    (energy, units): (f64, Units),
    bounds: &Bounds,
) -> Option<String> {
    let rate_tails = told.clone().filter_map(|(_, rate_tail)| rate_tail);
    unresolved(rate_tails, bounds.fixed_nodes).or_else(|| {
        let closings = told.map(|(closing, _)| closing);
        untrusted(closings, (energy, units), bounds.tolerance)
    })
}

/// Warning about motions with energies below the resolution of `tolerance`; `energy` is the unit of energy.
fn untrusted<'a>(
    closings: impl Iterator<Item = &'a LedgerClosure>,
    (energy, units): (f64, Units),
    tolerance: f64,
) -> Option<String> {
    let mut open = closings.filter(|closing| closing.is_open(energy));
    let closing = open.next()?;
    // Speed of a unit mass.
    let speed = (2.0 * closing.largest / energy).sqrt();
    let off = format!(
        "the energy balance error is {:.1e} of the largest energy, {:.1e}{}",
        closing.relative(),
        closing.largest,
        Units::suffix(units.energy())
    );
    Some(if RESOLVED * tolerance > speed {
        format!(
            "the motion is too small for run.tolerance, which is relative to 1 + size in units of the rod: speeds in these units are about {speed:.1e}, and \
         {off}; lower run.tolerance to a thousandth of these speeds, or rely on no more than that the motion is small"
        )
    } else {
        format!(
            "{off}: lower run.tolerance, or discard the motion from where column total of the trajectory drifts"
        )
    })
}

impl<'r> Recorder<'r> {
    /// A recorder of branch `id` from state `first`. `rest`: equilibrium with mass effects; `total`: expected total
    /// of the ledger, in the units of the rod.
    pub fn new(
        (prepared, rest): (&'r Prepared, Option<&RestState>),
        sink: &'r mut dyn Sink,
        hooks: &'r mut dyn Hooks,
        fields: Fields,
        (id, first): (usize, &dyn State),
        total: f64,
    ) -> Result<Self> {
        let mut closing = LedgerClosure::new(total);
        closing.look(&first.ledger());
        let trajectory = sink.begin(table::trajectory(prepared, id))?;
        let strain = match stride(prepared, fields) {
            None => None,
            Some(stride) => Some(Strain {
                table: sink.begin(table::strain(prepared, id))?,
                stride,
                seen: 0,
            }),
        };
        let strobe = prepared.run.strobe.is_some();
        let dense = !strobe && hooks.pictures() > 0;
        let kept = match (strobe, dense) {
            (true, _) => KEPT_OF_SECTION,
            (_, true) => KEPT_TO_DRAW,
            _ => KEPT,
        };
        Ok(Self {
            prepared,
            sink,
            dense,
            hooks,
            places: places(),
            trajectory,
            strain,
            closing,
            snaps: Vec::new(),
            layers: Vec::new(),
            beside: LightRods::new(
                prepared
                    .accompanying_light_rod(rest, first)
                    .into_iter()
                    .collect(),
            ),
            bounces: Bounces::default(),
            way: Thinned::new(kept),
            track: Thinned::new(KEPT_WITH_STRAINS),
            axes: Thinned::new(AXES),
            passage: Thinned::new(KEPT_OF_PASSAGE),
            passages: Vec::new(),
        })
    }

    /// Returns the record: `branch` with the data that the recorder kept.
    pub fn finish(mut self, motion: &dyn Motion<'_>, branch: RunBranch) -> RunBranch {
        let last = motion.now();
        self.end_passage();
        self.end_axes(&*last);
        self.closing.look(&last.ledger());
        let (crossed, lost) = self.beside.told();
        let outward = |crossed: LightSnap| LightSnap {
            snap: self.prepared.snap(&crossed.snap),
            ..crossed
        };
        RunBranch {
            outcome: outcome_after_audit(
                branch.outcome,
                &self.closing,
                self.prepared.run.tolerance,
                last.time(),
            ),
            snaps: self.snaps,
            layers: self.layers,
            crossed: crossed.into_iter().map(outward).collect(),
            lost,
            unfelt: motion.time_without_mass() * self.prepared.scales.time,
            bounces: self.bounces,
            closing: self.closing.scaled(self.prepared.scales.energy),
            way: self.way.list,
            track: self.track.list,
            passages: self.passages,
            axes: self.axes.list,
            ..branch
        }
    }

    fn frame(&self, state: &dyn State) -> Frame {
        let prepared = self.prepared;
        // Without the index in space, which no figure shows.
        let moment = match prepared.kind() {
            ModelKind::ElasticSpace => prepared.moment_without_index(state),
            _ => prepared.moment(state),
        };
        let axis = match prepared.kind() {
            ModelKind::Planar => prepared.sections(state, CURVE),
            ModelKind::Sheet | ModelKind::ElasticSpace | ModelKind::Space => Vec::new(),
        };
        Frame {
            moment,
            strains: prepared.strains_at(state, &self.places),
            dissipation: prepared.dissipation_at(state, &self.places),
            axis: axis
                .iter()
                .map(|at| [at.translation.x, at.translation.y])
                .collect(),
        }
    }

    /// Keeps a sample with its strains, at the stride of the track, if the rod has strains; `frame` if already made.
    fn show(&mut self, state: &dyn State, frame: Option<Frame>) {
        if self.prepared.kind() == ModelKind::Sheet {
            return;
        }
        let mut track = std::mem::replace(&mut self.track, Thinned::new(0));
        track.show(|| frame.unwrap_or_else(|| self.frame(state)));
        self.track = track;
    }

    /// Writes the strain field of a state.
    fn write_strain(&mut self, table: usize, frame: &Frame) -> Result<()> {
        let length = self.prepared.scales.length;
        // A taut rod next to its fold may have no shape.
        let known = |strain: &Vec<f64>| strain.len() == self.places.len();
        if !frame.strains.iter().all(known) {
            return Ok(());
        }
        for (i, s) in self.places.iter().enumerate() {
            let strains = frame.strains.iter().map(|strain| strain[i]);
            let row = [frame.moment.t, s * length].into_iter().chain(strains);
            let row: Vec<Cell> = row.chain([frame.dissipation[i]]).map(Cell::Real).collect();
            self.sink.row(table, &row)?;
        }
        Ok(())
    }

    /// Writes the row of an event, except in a stroboscopic section.
    fn write_event(&mut self, state: &dyn State) -> Result<()> {
        if self.prepared.run.strobe.is_some() {
            return Ok(());
        }
        self.write(&self.prepared.moment(state))
    }

    fn write(&mut self, moment: &Moment) -> Result<()> {
        let prepared = self.prepared;
        let row = table::row((prepared.kind(), prepared.is_heavy()), moment);
        self.sink.row(self.trajectory, &row)
    }

    /// Appends the last axis, or replaces a previous one at nearly the same time.
    fn end_axes(&mut self, last: &dyn State) {
        if !self.prepared.kind().in_space() {
            return;
        }
        let t = self
            .prepared
            .run
            .output_time(last.time(), self.prepared.scales.time);
        let axes = &mut self.axes.list;
        if let [.., (before, _), (near, _)] = axes.as_slice()
            && t - near < 0.5 * (near - before)
        {
            axes.pop();
        }
        axes.push((t, self.prepared.sections(last, CURVE)));
    }

    /// Keeps the passage if its dissipation is among the largest.
    fn end_passage(&mut self) {
        let passage = std::mem::replace(&mut self.passage, Thinned::new(KEPT_OF_PASSAGE)).list;
        let lost = |passage: &[Frame]| match passage {
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

    /// Records the end of a step of a rod with strains. On a sheet the state would have to be computed.
    fn step(&mut self, now: &dyn State) {
        self.closing.look(&now.ledger());
        if self.prepared.kind() != ModelKind::Planar {
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
}

impl Observer for Recorder<'_> {
    fn sample(&mut self, state: &dyn State) -> Result<()> {
        let prepared = self.prepared;
        let moment = prepared.moment(state);
        let t = moment.t;
        self.write(&moment)?;
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
        if prepared.kind().in_space() {
            self.axes.show(|| (t, prepared.sections(state, CURVE)));
        }
        self.show(state, frame);
        // Other moments come from the steps.
        if !self.dense || self.way.list.is_empty() {
            self.way.show(|| moment);
        }
        Ok(())
    }

    fn event(&mut self, event: &Event, motion: &mut dyn Motion<'_>) -> Result<()> {
        match event {
            Event::Step { .. } if motion.resolution().is_some() => {
                self.beside.step(motion);
                self.step(&*motion.now());
            }
            Event::Snap(snap) => {
                self.snaps.push(self.prepared.snap(snap));
                for state in [motion.before_snap(), Some(motion.now())]
                    .into_iter()
                    .flatten()
                {
                    self.closing.look(&state.ledger());
                    if self.prepared.kind() != ModelKind::Sheet {
                        self.track.keep(self.frame(&*state));
                    }
                    self.way.keep(self.prepared.moment(&*state));
                    self.write_event(&*state)?;
                }
            }
            Event::Layer(layer) => {
                let k = &self.prepared.scales;
                self.layers.push(layer.scaled(k.time, k.energy));
                self.beside.land(&*motion.now());
            }
            Event::Bounce(bounce) => self.bounces.add(self.prepared.bounce(bounce)),
            Event::Step { .. } | Event::Stop(_) => {}
        }
        Ok(())
    }

    fn moments(&self) -> usize {
        match self.prepared.kind() {
            _ if !self.dense => 0,
            ModelKind::Sheet => INNER,
            ModelKind::ElasticSpace => INNER_IN_SPACE,
            ModelKind::Planar | ModelKind::Space => STEP_ENDS,
        }
    }

    fn look(&mut self, state: &dyn State) {
        // The first sample is already recorded.
        let unit = self.prepared.scales.time;
        let t = self.prepared.run.output_time(state.time(), unit);
        if let [only] = self.way.list.as_slice()
            && only.t == t
        {
            return;
        }
        self.way.show(|| match self.prepared.kind() {
            ModelKind::Sheet => self.prepared.moment(state),
            // For these models no figure needs the equilibrium labels or the index.
            ModelKind::Planar | ModelKind::ElasticSpace | ModelKind::Space => {
                self.prepared.moment_without_index(state)
            }
        });
    }

    fn go_on(&mut self, time: f64) -> bool {
        let (t, duration) = (time * self.prepared.scales.time, self.prepared.run.duration);
        self.hooks.progress(t / duration, t);
        !self.hooks.interrupted()
    }
}
