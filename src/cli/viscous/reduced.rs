//! Motions in space that are the body's ordinary differential equation: the run, the equivalent spring and dashpot.

use super::super::files::rounded;
use super::super::run::unit;
use super::super::{Ending, Refusal};
use super::recorder::Recorder;
use super::space::{Spatial, further, notes};
use super::{Done, Kind, Task, conclude, space_figures};
use nalgebra::DMatrix;
use serde_json::{Value, json};
use snaprod::motion::creep::ViscousOutcome;
use snaprod::motion::reduction::{Equivalent, ReducedRun, ReducedSample, Reduction};
use snaprod::scene::{MotionSetup, Scales, StrainName, Units};

/// A step's error as a part of the tolerance: the errors of the steps add up.
const LOCAL: f64 = 0.1;
/// Errors below this drown in rounding.
const FINEST: f64 = 1e-14;

/// Runs the reduction.
pub fn run(task: &Task, setup: &MotionSetup, reduction: &Reduction) -> Result<Ending, Refusal> {
    let tolerance = (LOCAL * setup.options.tolerance).max(FINEST);
    let mut run = reduction.run(tolerance)?;
    let kind = Spatial::<ReducedSample>::new(setup, task);
    let first = run.sample_at(0.0)?;
    let mut recorder = Recorder::new(&kind, task, &first)?;
    let (outcome, last) = drive(&mut run, &first, task, setup, &mut recorder)?;
    let spring = Spring {
        equivalent: reduction.equivalent()?,
        scales: &setup.scales,
        units: task.units,
    };
    let mut notes = notes(setup);
    notes.push(spring.text());
    let mut entry = spring.json();
    let how = json!({ "by_symmetry": reduction.is_identical(), "defect": last.defect });
    super::super::query::merge(&mut entry, how);
    let done = Done {
        record: recorder.finish(&last)?,
        outcome,
        t: last.time * setup.scales.time,
        first: kind.json(&first),
        last: kind.json(&last),
        place: kind.text(&last),
        layers: Vec::new(),
        work: run.work(),
        nodes: None,
        notes,
        further: further(setup, entry, None),
    };
    conclude(task, &done, || space_figures::write(task, setup, &done))
}

/// Samples the motion at even times.
fn drive(
    run: &mut ReducedRun,
    first: &ReducedSample,
    task: &Task,
    setup: &MotionSetup,
    recorder: &mut Recorder<Spatial<ReducedSample>>,
) -> Result<(ViscousOutcome, ReducedSample), Refusal> {
    let last = task.samples.max(2) - 1;
    let mut now = first.clone();
    recorder.take(&now)?;
    for i in 1..=last {
        if run.work().steps >= setup.options.max_steps {
            return Ok((ViscousOutcome::StepLimit, now));
        }
        match run.sample_at(setup.options.duration * i as f64 / last as f64) {
            Ok(sample) => now = sample,
            Err(e) => {
                let why = format!("{e} (`reduce = false` in [run] integrates the whole rod)");
                return Ok((ViscousOutcome::Stuck(why), now));
            }
        }
        recorder.take(&now)?;
        if i < last && !recorder.go_on(now.time) {
            return Ok((ViscousOutcome::Interrupted, now));
        }
    }
    Ok((ViscousOutcome::EndOfTime, now))
}

/// The equivalent spring and dashpot in the scene's units: per displacement of the end, and per angle for u3.
struct Spring<'a> {
    equivalent: Equivalent,
    scales: &'a Scales,
    units: Units,
}

impl Spring<'_> {
    fn names(&self) -> Vec<&'static str> {
        let moving = self.equivalent.moving.iter();
        moving.map(|i| StrainName::ALL[*i].as_str()).collect()
    }

    /// A matrix against displacements and angles, of entries in units of energy over those, times `time`.
    fn matrix(&self, matrix: &DMatrix<f64>, time: f64) -> Vec<Vec<f64>> {
        let k = self.scales;
        let moved = |a: usize| match self.equivalent.moving[a] {
            0..3 => 1.0,
            _ => k.length,
        };
        let entry = |a, b| matrix[(a, b)] * k.energy * time / moved(a) / moved(b);
        (0..matrix.nrows())
            .map(|a| (0..matrix.ncols()).map(|b| entry(a, b)).collect())
            .collect()
    }

    fn json(&self) -> Value {
        let (of, time) = (&self.equivalent, self.scales.time);
        let branches: Vec<Value> = of
            .branches
            .iter()
            .map(|(modulus, relaxation)| {
                json!({ "stiffness": self.matrix(modulus, 1.0), "time": relaxation * time })
            })
            .collect();
        let modes: Vec<Value> = of
            .modes
            .iter()
            .map(|mode| {
                json!({
                    "natural_frequency": mode.natural_frequency / time,
                    "damping_ratio": mode.damping_ratio,
                })
            })
            .collect();
        json!({
            "kind": of.kind.to_string(),
            "moving": self.names(),
            "stiffness": self.matrix(&of.stiffness, 1.0),
            "dashpot": self.matrix(&of.dashpot, time),
            "branches": branches,
            "mass": self.matrix(&of.mass, time * time),
            "drag": self.matrix(&of.drag, time),
            "modes": modes,
        })
    }

    fn text(&self) -> String {
        let (of, u, time) = (&self.equivalent, self.units, self.scales.time);
        let stiffness = self.matrix(&of.stiffness, 1.0);
        let dashpot = self.matrix(&of.dashpot, time);
        let parts = self.names().into_iter().enumerate().map(|(a, name)| {
            // Per radian, or per length.
            let per = |angle: &str, length: &str| match (u, of.moving[a]) {
                (Units::Dimensionless, _) => String::new(),
                (Units::Si, 0..3) => unit(angle),
                (Units::Si, _) => unit(length),
            };
            format!(
                "{name}: spring {}{}, dashpot {}{}",
                rounded(stiffness[a][a], 9),
                per("N m/rad", "N/m"),
                rounded(dashpot[a][a], 9),
                per("N m s/rad", "N s/m"),
            )
        });
        let modes = of.modes.iter().map(|mode| {
            format!(
                "natural angular frequency {}{}, damping ratio {}",
                rounded(mode.natural_frequency / time, 9),
                if u == Units::Si { " rad/s" } else { "" },
                rounded(mode.damping_ratio, 6),
            )
        });
        let branches = match of.branches.len() {
            0 => None,
            1 => Some("one Maxwell branch beside".to_owned()),
            n => Some(format!("{n} Maxwell branches beside")),
        };
        let all: Vec<String> = parts.chain(branches).chain(modes).collect();
        format!(
            "{} motion, integrated as the body's ordinary differential equation, which is exact; {}",
            of.kind,
            all.join("; ")
        )
    }
}
