//! `snaprod run SCENE` for a rod with damping, planar or in space: tables, summary, figures.

mod figures;
mod planar;
mod recorder;
mod reduced;
mod space;
mod space_figures;

pub use planar::run as run_planar;
pub use space::run as run_space;

use super::files::{json_text, number, print, print_error, print_json, rounded};
use super::output::Output;
use super::run::{RunArgs, output, unit};
use super::{Ending, Refusal, signals};
use recorder::Record;
use serde::Serialize;
use serde_json::{Value, json};
use snaprod::motion::Ledger;
use snaprod::motion::creep::{Layer, ViscousOutcome};
use snaprod::scene::{Scales, Units};
use snaprod::solve::integrator::Work;

/// How the states of a rod are written and drawn. Everything that it gives is in the scene's units.
trait Kind {
    /// A state of its run.
    type Sample;
    /// What figures show of every kept state beside strains and energies.
    type Shape;
    /// What they show of a few states, evenly spaced.
    type Axis;

    /// Columns of trajectory.csv.
    const COLUMNS: &'static [&'static str];
    /// True if the passage through which the rod dissipated most is drawn.
    const PASSAGE: bool;

    /// A row of trajectory.csv.
    fn row(&self, at: &Self::Sample) -> Vec<String>;

    /// Time, energies.
    fn ledger(&self, at: &Self::Sample) -> (f64, Ledger);

    /// How far the rod is from equilibrium.
    fn distance(&self, at: &Self::Sample) -> f64;

    /// Names of the strains that move.
    fn strain_names(&self) -> Vec<&'static str>;

    /// Each of these strains at places in [0, 1].
    fn strains(&self, at: &Self::Sample, places: &[f64]) -> Vec<Vec<f64>>;

    /// Dissipation per length and time at places in [0, 1].
    fn dissipation(&self, at: &Self::Sample, places: &[f64]) -> Vec<f64>;

    /// The shape.
    fn shape(&self, at: &Self::Sample) -> Self::Shape;

    /// The axis.
    fn axis(&self, at: &Self::Sample) -> Self::Axis;

    /// The state in summary.json.
    fn json(&self, at: &Self::Sample) -> Value;

    /// Where the body is, in a line.
    fn text(&self, at: &Self::Sample) -> String;
}

/// What a scene of either kind asks of the program.
struct Task<'a> {
    args: &'a RunArgs,
    units: Units,
    scales: Scales,
    duration: f64,
    samples: usize,
    max_steps: usize,
    /// What is 1 in the units of the run.
    natural: &'static str,
    /// The resolved scene.
    scene: Value,
    /// Labels of figures.
    labels: snaprod::plot::Units,
    out: Output,
}

impl<'a> Task<'a> {
    /// Makes the directory of the output, and lets Ctrl-C end the run with what it has.
    fn begin(
        args: &'a RunArgs,
        scene: &impl Serialize,
        (units, scales): (Units, Scales),
        natural: &'static str,
        labels: snaprod::plot::Units,
    ) -> Result<Self, Refusal> {
        let scene = serde_json::to_value(scene)
            .map_err(|e| Refusal(format!("the scene cannot be written: {e}")))?;
        let out = output(args)?;
        signals::watch();
        let asked = |name: &str| scene["run"][name].as_u64().unwrap_or_default() as usize;
        Ok(Self {
            args,
            units,
            scales,
            duration: scene["run"]["duration"].as_f64().unwrap_or_default(),
            samples: asked("samples"),
            max_steps: asked("max_steps"),
            natural,
            scene,
            labels,
            out,
        })
    }
}

/// A run that has ended, in the scene's units.
struct Done<K: Kind> {
    record: Record<K>,
    outcome: ViscousOutcome,
    /// When it ended.
    t: f64,
    first: Value,
    last: Value,
    /// Where it ended.
    place: String,
    layers: Vec<Layer>,
    work: Work,
    /// Most nodes, and the largest relative size of the last coefficients of a field; None if nothing was discretised.
    nodes: Option<(usize, f64)>,
    /// Lines before the others.
    notes: Vec<String>,
    /// Further entries of summary.json.
    further: Value,
}

/// Writes what came of a run, with its figures, and says so.
fn conclude<K: Kind>(
    task: &Task,
    done: &Done<K>,
    figures: impl FnOnce(),
) -> Result<Ending, Refusal> {
    let summary = done.summary(task);
    let events: Vec<Value> = done.layers.iter().map(layer_json).collect();
    let out = &task.out;
    out.write("events.json", json_text(json!(events)).as_bytes())?;
    out.write("summary.json", json_text(summary.clone()).as_bytes())?;
    figures();
    out.finish()?;
    if task.args.json {
        let mut object = summary;
        super::query::merge(&mut object, json!({ "events": events, "out": out.path() }));
        print_json(object);
    } else if !task.args.quiet {
        print(&done.text(task));
    }
    match done.reason(task) {
        None => Ok(Ending::Done),
        Some(why) => {
            if !task.args.json {
                print_error(&format!("the run ended short: {why}"));
            }
            Ok(Ending::Short)
        }
    }
}

impl<K: Kind> Done<K> {
    /// Why it fell short, if it did.
    fn reason(&self, task: &Task) -> Option<String> {
        let k = &task.scales;
        let t = format!("at t = {}{}", number(self.t), unit(task.units.time()));
        match &self.outcome {
            ViscousOutcome::EndOfTime => None,
            ViscousOutcome::StepLimit => Some(format!(
                "{t}: the bound max_steps = {} was reached; raise it in [run]",
                task.max_steps
            )),
            ViscousOutcome::Stuck(why) if k.length == 1.0 && k.time == 1.0 => Some(why.clone()),
            ViscousOutcome::Stuck(why) => Some(format!(
                "{t}: in units of the rod, in which {}: {why}",
                task.natural
            )),
            ViscousOutcome::Interrupted => Some(format!("{t}: interrupted")),
        }
    }

    /// The largest change of the ledger's total, relative to its largest term.
    fn relative_error(&self) -> f64 {
        self.record.error / self.record.largest.max(f64::MIN_POSITIVE)
    }

    fn summary(&self, task: &Task) -> Value {
        let k = &task.scales;
        let reason = self.reason(task);
        let mut summary = json!({
            "outcome": self.outcome.key(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": task.units,
            "start": self.first,
            "end": self.last,
            "layers": self.layers.len(),
            "energy_error": { "absolute": self.record.error, "relative": self.relative_error() },
            "nodes": self.nodes.map(|(most, tail)| json!({ "most": most, "tail": tail })),
            "work": work_json(&self.work),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": task.scene,
        });
        super::query::merge(&mut summary, self.further.clone());
        summary
    }

    fn text(&self, task: &Task) -> String {
        const SHOWN: usize = 20;
        let u = task.units;
        let mut lines = self.notes.clone();
        let whole: Vec<&Layer> = figures::snaps(&self.layers).collect();
        for layer in whole.iter().take(SHOWN) {
            lines.push(format!(
                "away from equilibrium from t = {} to {}{}, most at {}: dissipated {}{}, elastic energy released {}{}",
                rounded(layer.from, 6),
                rounded(layer.to, 6),
                unit(u.time()),
                rounded(layer.peak, 6),
                rounded(layer.dissipated, 6),
                unit(u.energy()),
                rounded(layer.elastic_from - layer.elastic_to, 6),
                unit(u.energy()),
            ));
        }
        if whole.len() > SHOWN {
            lines.push(format!("... and {} more of these", whole.len() - SHOWN));
        }
        lines.push(format!(
            "t = {}{}: {}; {}",
            number(match &self.outcome {
                // The time of the run is this one to rounding.
                ViscousOutcome::EndOfTime => task.duration,
                _ => self.t,
            }),
            unit(u.time()),
            match &self.outcome {
                ViscousOutcome::EndOfTime => self.outcome.to_string(),
                // The reason follows on the error stream.
                _ => format!("ended short ({})", self.outcome.key()),
            },
            self.place,
        ));
        lines.push(format!(
            "dissipated {}{}; energy ledger closes to {:.1e}{} ({:.1e} of its largest term)",
            rounded(self.record.dissipated, 9),
            unit(u.energy()),
            self.record.error,
            unit(u.energy()),
            self.relative_error(),
        ));
        let mut cost = format!(
            "{} steps, {} of them implicit, {} right-hand sides",
            self.work.steps, self.work.implicit_steps, self.work.evaluations,
        );
        if let Some((most, tail)) = self.nodes {
            cost += &format!("; up to {most} nodes, which leave {tail:.1e} of the strains");
        }
        lines.push(cost);
        if let Some(out) = task.out.path() {
            lines.push(format!("written to {}", out.display()));
        }
        lines.join("\n") + "\n"
    }
}

fn work_json(work: &Work) -> Value {
    json!({
        "evaluations": work.evaluations,
        "steps": work.steps,
        "implicit_steps": work.implicit_steps,
        "rejected": work.rejected,
        "jacobians": work.jacobians,
        "factorisations": work.factorisations,
        "iterations": work.iterations,
    })
}

/// The entries of the energies in a state.
fn energies_json(ledger: &Ledger) -> Value {
    json!({
        "kinetic": ledger.kinetic,
        "elastic": ledger.elastic,
        "potential": ledger.potential,
        "dissipated": ledger.dissipated,
        "work": ledger.work,
        "total": ledger.total(),
    })
}

fn scaled_ledger(ledger: &Ledger, energy: f64) -> Ledger {
    Ledger {
        kinetic: ledger.kinetic * energy,
        elastic: ledger.elastic * energy,
        potential: ledger.potential * energy,
        dissipated: ledger.dissipated * energy,
        work: ledger.work * energy,
    }
}

/// Layers in the scene's units.
fn scaled_layers(layers: &[Layer], k: &Scales) -> Vec<Layer> {
    let scaled = |layer: &Layer| Layer {
        from: layer.from * k.time,
        to: layer.to * k.time,
        peak: layer.peak * k.time,
        elastic_from: layer.elastic_from * k.energy,
        elastic_to: layer.elastic_to * k.energy,
        dissipated: layer.dissipated * k.energy,
        whole: layer.whole,
    };
    layers.iter().map(scaled).collect()
}

fn layer_json(layer: &Layer) -> Value {
    json!({
        "kind": "layer",
        "from": layer.from,
        "to": layer.to,
        "peak": layer.peak,
        "elastic_from": layer.elastic_from,
        "elastic_to": layer.elastic_to,
        "released": layer.elastic_from - layer.elastic_to,
        "dissipated": layer.dissipated,
        "whole": layer.whole,
    })
}

/// The places along the rod, in parts of its length, at which fields are written and drawn.
fn places() -> Vec<f64> {
    const ROWS: usize = 61;
    (0..ROWS).map(|i| i as f64 / (ROWS - 1) as f64).collect()
}
