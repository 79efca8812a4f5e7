//! `snaprod run SCENE` for a planar rod with damping: the run, its table and summary.

mod figures;
mod recorder;

use super::files::{
    exact, json_text, make_directory, number, print, print_error, print_json, rounded, write_whole,
};
use super::progress::watch_interrupts;
use super::run::{directory, unit};
use super::table::Row;
use super::{Ending, Refusal, RunArgs, check};
use recorder::{Record, Recorder};
use serde_json::{Value, json};
use snaprod::dynamics::viscous::{Layer, ViscousOutcome, ViscousSample, drive_viscous};
use snaprod::scene::{Scales, Scene, ViscousSetup};
use snaprod::solve::integrator::Work;
use snaprod::viscous::plane::Plane;
use std::path::Path;

type Sample = ViscousSample<Plane, 1, 2>;

/// Runs the scene.
pub fn run(args: &RunArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let no_start = |e| check::no_start(&args.scene, &e);
    let setup = ViscousSetup::new(scene).map_err(no_start)?;
    let mut run = setup.run().map_err(no_start)?;
    let out = directory(args);
    if let Some(out) = &out {
        make_directory(out)?;
    }
    watch_interrupts();
    let mut recorder = Recorder::new(args, scene, setup.scales, out.as_deref(), run.first())?;
    let outcome = drive_viscous(&mut run, scene.run.samples, &mut recorder)?;
    let done = Done {
        record: recorder.finish()?,
        outcome,
        first: run.first().clone(),
        last: run.now().clone(),
        layers: run.layers().to_vec(),
        work: run.work(),
        nodes: run.most_nodes(),
        tail: run.tail(),
    };
    let summary = done.summary(scene, &setup);
    let events: Vec<Value> = done
        .layers
        .iter()
        .map(|l| layer_json(l, &setup.scales))
        .collect();
    if let Some(out) = &out {
        write_whole(
            &out.join("events.json"),
            json_text(json!(events)).as_bytes(),
        )?;
        write_whole(
            &out.join("summary.json"),
            json_text(summary.clone()).as_bytes(),
        )?;
        figures::write(out, scene, &setup, &done, args.png)?;
    }
    if args.json {
        let mut object = summary;
        super::query::merge(&mut object, json!({ "events": events, "out": out }));
        print_json(object);
    } else if !args.quiet {
        print(&done.text(scene, &setup, out.as_deref()));
    }
    match done.reason(scene, &setup.scales) {
        None => Ok(Ending::Done),
        Some(why) => {
            if !args.json {
                print_error(&format!("the run ended short: {why}"));
            }
            Ok(Ending::Short)
        }
    }
}

/// A run that has ended.
struct Done {
    record: Record,
    outcome: ViscousOutcome,
    first: Sample,
    last: Sample,
    layers: Vec<Layer>,
    work: Work,
    nodes: usize,
    tail: f64,
}

impl Done {
    /// Why it fell short, if it did.
    fn reason(&self, scene: &Scene, k: &Scales) -> Option<String> {
        let t = format!(
            "at t = {}{}",
            number(self.last.t * k.time),
            unit(scene.units.time())
        );
        match &self.outcome {
            ViscousOutcome::EndOfTime => None,
            ViscousOutcome::StepLimit => Some(format!(
                "{t}: the bound max_steps = {} was reached; raise it in [run]",
                scene.run.max_steps
            )),
            ViscousOutcome::Stuck(why) if k.length == 1.0 && k.time == 1.0 => Some(why.clone()),
            ViscousOutcome::Stuck(why) => Some(format!(
                "{t}: in units of the rod, in which L = EI = m = 1: {why}"
            )),
            ViscousOutcome::Interrupted => Some(format!("{t}: interrupted")),
        }
    }

    fn summary(&self, scene: &Scene, setup: &ViscousSetup) -> Value {
        let k = &setup.scales;
        let reason = self.reason(scene, k);
        json!({
            "outcome": self.outcome.key(),
            "complete": reason.is_none(),
            "reason": reason,
            "units": scene.units,
            "start": state_json(&self.first, k),
            "end": state_json(&self.last, k),
            "layers": self.layers.len(),
            "energy_error": {
                "absolute": self.record.error * k.energy,
                "relative": self.record.error / self.record.largest.max(f64::MIN_POSITIVE),
            },
            "nodes": { "most": self.nodes, "tail": self.tail },
            "work": work_json(&self.work),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": scene,
        })
    }

    fn text(&self, scene: &Scene, setup: &ViscousSetup, out: Option<&Path>) -> String {
        const SHOWN: usize = 20;
        let (k, u) = (&setup.scales, scene.units);
        let mut lines = Vec::new();
        let whole: Vec<&Layer> = self.layers.iter().filter(|l| l.whole).collect();
        for layer in whole.iter().take(SHOWN) {
            lines.push(format!(
                "away from equilibrium from t = {} to {}{}, most at {}: dissipated {}{}, elastic energy released {}{}",
                rounded(layer.from * k.time, 6),
                rounded(layer.to * k.time, 6),
                unit(u.time()),
                rounded(layer.peak * k.time, 6),
                rounded(layer.dissipated * k.energy, 6),
                unit(u.energy()),
                rounded((layer.elastic_from - layer.elastic_to) * k.energy, 6),
                unit(u.energy()),
            ));
        }
        if whole.len() > SHOWN {
            lines.push(format!("... and {} more of these", whole.len() - SHOWN));
        }
        let end = &self.last;
        let row = Row::from(end);
        lines.push(format!(
            "t = {}{}: {}; r = ({}, {}){}, v = ({}, {}){}, {}",
            number(end.t * k.time),
            unit(u.time()),
            match &self.outcome {
                ViscousOutcome::EndOfTime => self.outcome.to_string(),
                // The reason follows on the error stream.
                _ => format!("ended short ({})", self.outcome.key()),
            },
            rounded(end.pose[0] * k.length, 12),
            rounded(end.pose[1] * k.length, 12),
            unit(u.length()),
            rounded(end.velocity[0] * k.velocity, 12),
            rounded(end.velocity[1] * k.velocity, 12),
            unit(u.velocity()),
            row.labels.map_or_else(
                || "near no equilibrium".to_owned(),
                |l| format!("near {}", l.sheet)
            ),
        ));
        lines.push(format!(
            "dissipated {}{}; energy ledger closes to {:.1e}{} ({:.1e} of its largest term)",
            rounded(end.ledger.dissipated * k.energy, 9),
            unit(u.energy()),
            self.record.error * k.energy,
            unit(u.energy()),
            self.record.error / self.record.largest.max(f64::MIN_POSITIVE),
        ));
        lines.push(format!(
            "{} steps, {} of them implicit, {} right-hand sides; up to {} nodes, which leave {} of the strains",
            self.work.steps,
            self.work.implicit_steps,
            self.work.evaluations,
            self.nodes,
            exact_short(self.tail),
        ));
        if let Some(out) = out {
            lines.push(format!("written to {}", out.display()));
        }
        lines.join("\n") + "\n"
    }
}

fn exact_short(x: f64) -> String {
    format!("{x:.1e}")
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

fn state_json(sample: &Sample, k: &Scales) -> Value {
    let row = Row::from(sample);
    let ledger = &row.ledger;
    let labels = row.labels.as_ref();
    json!({
        "t": row.t * k.time,
        "x": row.pose[0] * k.length,
        "y": row.pose[1] * k.length,
        "vx": row.velocity[0] * k.velocity,
        "vy": row.velocity[1] * k.velocity,
        "lam": labels.map(|l| snaprod::elastica::chart::ChartPoint::new(l.q[0], l.q[1]).integrals.lam),
        "p": labels.map(|l| l.q[0]),
        "w": labels.map(|l| l.q[1]),
        "mode": labels.map(|l| l.sheet.mode),
        "sign": labels.map(|l| l.sheet.sign.as_str()),
        "index": labels.map(|l| l.index),
        "fx": row.force[0] * k.force,
        "fy": row.force[1] * k.force,
        "kinetic": ledger.kinetic * k.energy,
        "elastic": ledger.elastic * k.energy,
        "potential": ledger.potential * k.energy,
        "dissipated": ledger.dissipated * k.energy,
        "work": ledger.work * k.energy,
        "total": ledger.total() * k.energy,
    })
}

fn layer_json(layer: &Layer, k: &Scales) -> Value {
    json!({
        "kind": "layer",
        "from": layer.from * k.time,
        "to": layer.to * k.time,
        "peak": layer.peak * k.time,
        "elastic_from": layer.elastic_from * k.energy,
        "elastic_to": layer.elastic_to * k.energy,
        "released": (layer.elastic_from - layer.elastic_to) * k.energy,
        "dissipated": layer.dissipated * k.energy,
        "whole": layer.whole,
    })
}

/// The places along the rod, in parts of its length, at which fields are written and drawn.
fn places() -> Vec<f64> {
    const ROWS: usize = 61;
    (0..ROWS).map(|i| i as f64 / (ROWS - 1) as f64).collect()
}

fn write_row(writer: &mut csv::Writer<std::fs::File>, row: [f64; 4]) -> csv::Result<()> {
    writer.write_record(row.map(exact))
}
