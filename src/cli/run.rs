//! `snaprod run SCENE`: drives the run, writes trajectory.csv, events.json, summary.json and figures.

use super::check::{Runnable, SceneArgs};
use super::files::{json_text, number, print, print_error, print_json, rounded};
use super::output::{FigureArgs, Output};
use super::recorder::{Branch, Recorder};
use super::{Ending, Refusal, check, figures, signals, viscous};
use clap::Args;
use serde_json::{Value, json};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::motion::{Outcome, Run, Sample, Snap, SnapEnd, drive};
use snaprod::scene::{Scales, Scene, Setup};
use snaprod::solve::dop853::Work;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where to write; default out/<name of the scene>, or nothing with --json.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Print the summary with the events as one JSON object.
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors; no progress bar.
    #[arg(long)]
    pub quiet: bool,
    #[command(flatten)]
    pub figures: FigureArgs,
}

/// Runs the scene.
pub fn run(args: &RunArgs) -> Result<Ending, Refusal> {
    let scene = match check::read(&args.scene)? {
        Runnable::Planar(scene) if scene.rod.damping.is_some() => {
            return viscous::run_planar(args, &scene);
        }
        Runnable::Planar(scene) => scene,
        Runnable::Spatial(scene) => return viscous::run_space(args, &scene),
    };
    let no_start = |e| check::no_start(&args.scene.path, &e);
    let setup = Setup::new(&scene).map_err(no_start)?;
    let root = setup.run().map_err(no_start)?;
    let out = output(args)?;
    signals::watch();
    let tree = Tree::grow(args, &scene, &setup, root, &out)?;
    let summary = tree.summary(&scene, &setup);
    let events = Value::Array(tree.events(&setup.scales));
    out.write("events.json", json_text(events).as_bytes())?;
    out.write("summary.json", json_text(summary.clone()).as_bytes())?;
    figures::write(&out, &scene, &setup, &tree.branches);
    out.finish()?;
    let out = directory(args);
    if args.json {
        let mut object = summary;
        super::query::merge(
            &mut object,
            json!({ "events": tree.events(&setup.scales), "out": out }),
        );
        print_json(object);
    } else if !args.quiet {
        print(&tree.text(&scene, &setup, out.as_deref()));
    }
    let short = tree.reason(&scene, &setup);
    if short.is_none() {
        return Ok(Ending::Done);
    }
    if let Some(why) = short
        && !args.json
    {
        print_error(&format!("the run ended short: {why}"));
    }
    Ok(Ending::Short)
}

/// Where to write: --out, else out/<scene>, else (with --json) nowhere.
pub fn directory(args: &RunArgs) -> Option<PathBuf> {
    match &args.out {
        Some(out) => Some(out.clone()),
        None if args.json => None,
        None => Some(args.scene.directory()),
    }
}

/// The files of a run of any kind.
pub fn output(args: &RunArgs) -> Result<Output, Refusal> {
    const FILES: &[&str] = &[
        "trajectory.csv",
        "trajectory-*.csv",
        "strain.csv",
        "events.json",
        "summary.json",
        "snapshots.*",
        "energies.*",
        "surface.*",
        "strain*.svg",
        "strain*.png",
        "layer.*",
        "losses.*",
        "shapes.*",
        "path.*",
    ];
    Output::open(directory(args).as_deref(), FILES, args.figures)
}

/// A run, or under landing = "all" the runs into which it branches, each after its parent.
struct Tree {
    branches: Vec<Branch>,
    /// Snaps whose branches were not followed because the bound was reached.
    cut: usize,
}

impl Tree {
    fn grow(
        args: &RunArgs,
        scene: &Scene,
        setup: &Setup,
        root: Run<'_, Elastica, 2>,
        out: &Output,
    ) -> Result<Self, Refusal> {
        let total = root.now().ledger.total();
        let mut waiting = std::collections::VecDeque::from([(None, None, root)]);
        let mut tree = Self {
            branches: Vec::new(),
            cut: 0,
        };
        while let Some((parent, entered, mut run)) = waiting.pop_front() {
            let id = tree.branches.len();
            let first = run.now();
            let mut recorder = Recorder::new(args, scene, setup.scales, out, id, total)?;
            let outcome = drive(&mut run, scene.run()?.samples, &mut recorder)?;
            if let Outcome::Branched(snaps) = &outcome {
                for snap in snaps {
                    // The bound counts whole runs: a fork replaces one by several.
                    if tree.branches.len() + waiting.len() + 1 < scene.run()?.branches {
                        waiting.push_back((Some(id), Some(*snap), run.branch(snap)?));
                    } else {
                        tree.cut += 1;
                    }
                }
            }
            tree.branches.push(recorder.finish(Branch {
                id,
                parent,
                entered,
                first,
                last: run.now(),
                outcome,
                work: run.work(),
                ..Branch::default_for(&first)
            })?);
        }
        Ok(tree)
    }

    /// Why it fell short, if it did.
    fn reason(&self, scene: &Scene, setup: &Setup) -> Option<String> {
        if self.cut > 0 {
            return Some(format!(
                "{} branches were not followed: the bound branches = {} was reached; raise it in [run]",
                self.cut,
                scene.run().map_or(0, |run| run.branches)
            ));
        }
        self.branches
            .iter()
            .find(|b| !is_complete(&b.outcome))
            .map(|b| why_short(b, scene, setup))
    }

    fn events(&self, scales: &Scales) -> Vec<Value> {
        let several = self.branches.len() > 1;
        let mut events = Vec::new();
        for branch in &self.branches {
            for snap in branch.entered.iter().chain(&branch.snaps) {
                let mut event = snap_json(snap, scales);
                if several {
                    super::query::merge(
                        &mut event,
                        json!({ "branch": branch.id, "parent": branch.parent }),
                    );
                }
                events.push(event);
            }
        }
        events
    }

    fn summary(&self, scene: &Scene, setup: &Setup) -> Value {
        let k = &setup.scales;
        let root = &self.branches[0];
        let last = self.branches.last().unwrap_or(root);
        let worst = self
            .branches
            .iter()
            .map(energy_error)
            .fold((0.0f64, 0.0f64), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        let short = self.reason(scene, setup);
        let mut summary = json!({
            "outcome": if short.is_none() { "end_of_time" } else { self.short_key() },
            "complete": short.is_none(),
            "reason": short,
            "units": scene.units,
            "start": state_json(&root.first, k),
            "start_index": root.first.index,
            "end": state_json(&last.last, k),
            "snaps": self.branches.iter().map(|b| b.snaps.len() + usize::from(b.entered.is_some())).sum::<usize>(),
            "energy_error": { "absolute": worst.0 * k.energy, "relative": worst.1 },
            "work": work_json(&self.branches),
            "scales": { "length": k.length, "force": k.force, "energy": k.energy, "time": k.time },
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
            "scene": scene,
        });
        if root.first.index > 0 {
            super::query::merge(
                &mut summary,
                json!({ "warning": unstable_start(root.first.index) }),
            );
        }
        if self.branches.len() > 1 {
            let list: Vec<Value> = self
                .branches
                .iter()
                .map(|b| {
                    json!({
                        "branch": b.id,
                        "parent": b.parent,
                        "outcome": b.outcome.key(),
                        "from": b.first.phase.t * k.time,
                        "end": state_json(&b.last, k),
                        "trajectory": trajectory_name(b.id),
                    })
                })
                .collect();
            super::query::merge(&mut summary, json!({ "branches": list }));
        }
        summary
    }

    fn short_key(&self) -> &'static str {
        if self.cut > 0 {
            return "branch_limit";
        }
        self.branches
            .iter()
            .find(|b| !is_complete(&b.outcome))
            .map_or("end_of_time", |b| b.outcome.key())
    }

    fn text(&self, scene: &Scene, setup: &Setup, out: Option<&Path>) -> String {
        let k = &setup.scales;
        let mut lines = Vec::new();
        let root = &self.branches[0];
        if root.first.index > 0 {
            lines.push(format!("note: {}", unstable_start(root.first.index)));
        }
        let u = scene.units;
        for branch in &self.branches {
            if self.branches.len() > 1 {
                lines.push(match branch.parent {
                    None => "branch 0".to_owned(),
                    Some(parent) => format!("branch {} (from branch {parent})", branch.id),
                });
            }
            const SHOWN: usize = 20;
            let snaps: Vec<&Snap<2>> = branch.entered.iter().chain(&branch.snaps).collect();
            for snap in snaps.iter().take(SHOWN) {
                lines.push(format!(
                    "snap at t = {}{}: {} -> {}, released {}{}{}",
                    rounded(snap.t * k.time, 12),
                    unit(u.time()),
                    snap.from.sheet,
                    snap.to.sheet,
                    rounded(snap.released * k.energy, 9),
                    unit(u.energy()),
                    // Rules other than "viscous" choose from all that is stable, whatever its energy.
                    if snap.released < 0.0 {
                        " (the landing lies higher: a rod left to itself does not get there)"
                    } else {
                        ""
                    }
                ));
            }
            if snaps.len() > SHOWN {
                lines.push(format!("... and {} more snaps", snaps.len() - SHOWN));
            }
            let end = &branch.last;
            lines.push(format!(
                "t = {}{}: {}; r = ({}, {}){}, v = ({}, {}){}, {}",
                number(end.phase.t * k.time),
                unit(u.time()),
                if is_complete(&branch.outcome) {
                    branch.outcome.to_string()
                } else {
                    // The reason follows on the error stream.
                    format!("ended short ({})", branch.outcome.key())
                },
                rounded(end.pose[0] * k.length, 12),
                rounded(end.pose[1] * k.length, 12),
                unit(u.length()),
                rounded(end.phase.v[0] * k.velocity, 12),
                rounded(end.phase.v[1] * k.velocity, 12),
                unit(u.velocity()),
                end.sheet
            ));
            let (absolute, relative) = energy_error(branch);
            lines.push(format!(
                "energy ledger closes to {:.1e}{} ({relative:.1e} of its largest term); {} steps, {} right-hand sides",
                absolute * k.energy,
                unit(u.energy()),
                branch.work.steps,
                branch.work.evaluations
            ));
        }
        if let Some(out) = out {
            lines.push(format!("written to {}", out.display()));
        }
        lines.join("\n") + "\n"
    }
}

fn unstable_start(index: usize) -> String {
    format!(
        "the start has Morse index {index}: it is not stable, a real rod would leave it at once; the run follows the sheet as asked"
    )
}

/// The symbol of a unit, behind a number.
pub fn unit(symbol: &str) -> String {
    if symbol.is_empty() {
        String::new()
    } else {
        format!(" {symbol}")
    }
}

fn is_complete(outcome: &Outcome<2>) -> bool {
    matches!(outcome, Outcome::EndOfTime | Outcome::Branched(_))
}

/// Why a branch ended before its time, in the scene's units.
fn why_short(branch: &Branch, scene: &Scene, setup: &Setup) -> String {
    let k = &setup.scales;
    let why = match &branch.outcome {
        Outcome::StepLimit => format!(
            "the bound max_steps = {} was reached; raise it in [run]",
            setup.options.max_steps
        ),
        Outcome::SnapLimit => format!(
            "the bound max_snaps = {} was reached; raise it in [run]",
            setup.options.max_snaps
        ),
        // The library's text has its own units, and says when and where by itself.
        Outcome::Stuck(why) if k.length == 1.0 && k.time == 1.0 => return why.clone(),
        Outcome::Stuck(why) => {
            format!("in units of the rod, in which L = EI = m = 1: {why}")
        }
        outcome => outcome.to_string(),
    };
    let t = branch.last.phase.t * k.time;
    format!("at t = {}{}: {why}", number(t), unit(scene.units.time()))
}

/// Largest change of the ledger's total: absolute, and relative to the ledger's largest term.
fn energy_error(branch: &Branch) -> (f64, f64) {
    (
        branch.error,
        branch.error / branch.largest.max(f64::MIN_POSITIVE),
    )
}

/// The file of a branch's trajectory.
pub fn trajectory_name(id: usize) -> String {
    if id == 0 {
        "trajectory.csv".to_owned()
    } else {
        format!("trajectory-{id}.csv")
    }
}

fn work_json(branches: &[Branch]) -> Value {
    let sum = |f: fn(&Work) -> u64| branches.iter().map(|b| f(&b.work)).sum::<u64>();
    json!({
        "evaluations": sum(|w| w.evaluations),
        "steps": sum(|w| w.steps),
        "rejected": sum(|w| w.rejected),
        "dense": sum(|w| w.dense),
    })
}

fn state_json(sample: &Sample<2>, k: &Scales) -> Value {
    let (p, w) = (sample.phase.q[0], sample.phase.q[1]);
    let ledger = &sample.ledger;
    json!({
        "t": sample.phase.t * k.time,
        "x": sample.pose[0] * k.length,
        "y": sample.pose[1] * k.length,
        "vx": sample.phase.v[0] * k.velocity,
        "vy": sample.phase.v[1] * k.velocity,
        "lam": lambda(p, w),
        "p": p,
        "w": w,
        "mode": sample.sheet.mode,
        "sign": sample.sheet.sign.as_str(),
        "index": sample.index,
        "fx": sample.force[0] * k.force,
        "fy": sample.force[1] * k.force,
        "kinetic": ledger.kinetic * k.energy,
        "elastic": ledger.elastic * k.energy,
        "potential": ledger.potential * k.energy,
        "dissipated": ledger.dissipated * k.energy,
        "work": ledger.work * k.energy,
        "total": ledger.total() * k.energy,
    })
}

fn snap_json(snap: &Snap<2>, k: &Scales) -> Value {
    let end = |e: &SnapEnd<2>| {
        json!({
            "lam": lambda(e.q[0], e.q[1]),
            "p": e.q[0],
            "w": e.q[1],
            "mode": e.sheet.mode,
            "sign": e.sheet.sign.as_str(),
            "index": e.index,
            "elastic": e.elastic * k.energy,
        })
    };
    json!({
        "kind": "snap",
        "t": snap.t * k.time,
        "x": snap.pose[0] * k.length,
        "y": snap.pose[1] * k.length,
        "vx": snap.velocity[0] * k.velocity,
        "vy": snap.velocity[1] * k.velocity,
        "from": end(&snap.from),
        "to": end(&snap.to),
        "released": snap.released * k.energy,
        "time_error": snap.time_error * k.time,
    })
}

fn lambda(p: f64, w: f64) -> Option<f64> {
    Equilibrium::new(p, w).ok().map(|e| e.lambda)
}
