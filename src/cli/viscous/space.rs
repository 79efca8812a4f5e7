//! Rods in space with damping: their tables, the full run.

use super::super::check::no_start;
use super::super::figures::labels_of;
use super::super::files::{exact, rounded};
use super::super::run::{RunArgs, unit};
use super::super::table::energies;
use super::super::{Ending, Refusal};
use super::recorder::Recorder;
use super::{Done, Kind, Task, conclude, energies_json, reduced, scaled_layers, space_figures};
use nalgebra::{Isometry3, Vector3};
use serde_json::{Value, json};
use snaprod::body::EndBody;
use snaprod::creep::space::Space;
use snaprod::motion::creep::{ViscousRun, ViscousSample, drive_viscous};
use snaprod::motion::{InSpace, Ledger};
use snaprod::scene::{MotionSetup, MotionState, Scene, WithRun};
use std::marker::PhantomData;

/// Points of a drawn axis.
const CURVE: usize = 60;

/// Runs the scene.
pub fn run(args: &RunArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let refuse = |e| no_start(&args.scene.path, &e);
    let setup = MotionSetup::new(scene).map_err(refuse)?;
    let begin = || {
        let k = setup.scales;
        let natural = k.length == 1.0 && k.stiffness() == 1.0 && k.mass == 1.0;
        Task::begin(
            args,
            scene,
            (scene.units, k),
            "length, bending stiffness and mass are 1, in the frame of the clamp",
            labels_of(scene.units, k.length, natural),
        )
    };
    let why = if scene.run()?.reduce {
        match setup.reduction().map_err(refuse)? {
            Ok(reduction) => return reduced::run(&begin()?, &setup, &reduction),
            Err(refusal) => refusal.to_string(),
        }
    } else {
        "[run] reduce = false".to_owned()
    };
    let full = Full {
        task: &begin,
        setup: &setup,
        why,
    };
    setup.with_run(full).map_err(refuse)?
}

/// The full run: strains along the rod.
struct Full<'a, F> {
    /// The files are begun once the start is known to be sound.
    task: &'a F,
    setup: &'a MotionSetup,
    /// Why it is not reduced.
    why: String,
}

impl<'a, F: Fn() -> Result<Task<'a>, Refusal>> WithRun for Full<'_, F> {
    type Output = Result<Ending, Refusal>;

    fn with<B, const M: usize, const D: usize>(
        self,
        mut run: ViscousRun<'_, Space<M, D>, B, M, D>,
    ) -> Self::Output
    where
        B: EndBody<D, Pose = Isometry3<f64>>,
    {
        let (task, setup) = ((self.task)()?, self.setup);
        let kind = Spatial::<ViscousSample<Space<M, D>, M, D>>::new(setup, &task);
        let mut recorder = Recorder::new(&kind, &task, run.first())?;
        let outcome = drive_viscous(&mut run, task.samples, &mut recorder)?;
        let done = Done {
            record: recorder.finish(run.now())?,
            outcome,
            t: run.now().t * setup.scales.time,
            first: kind.json(run.first()),
            last: kind.json(run.now()),
            place: kind.text(run.now()),
            layers: scaled_layers(run.layers(), &setup.scales),
            work: run.work(),
            nodes: Some((run.most_nodes(), run.tail())),
            notes: notes(setup),
            further: further(setup, json!(null), Some(&self.why)),
        };
        conclude(&task, &done, || space_figures::write(&task, setup, &done))
    }
}

/// What is to be said of the start.
pub fn notes(setup: &MotionSetup) -> Vec<String> {
    warning(setup)
        .map(|why| format!("note: {why}"))
        .into_iter()
        .collect()
}

fn warning(setup: &MotionSetup) -> Option<String> {
    let index = setup.start_index.filter(|index| *index > 0)?;
    Some(format!(
        "the equilibrium at the start has Morse index {index}: it is not stable, and the rod leaves it as rounding or loads will"
    ))
}

/// Entries of summary.json that only rods in space have.
pub fn further(setup: &MotionSetup, reduction: Value, why_not: Option<&str>) -> Value {
    let mut entries = json!({ "reduction": reduction, "not_reduced": why_not });
    if setup.start_index.is_some() {
        let index = json!({ "start_index": setup.start_index });
        super::super::query::merge(&mut entries, index);
    }
    if let Some(why) = warning(setup) {
        super::super::query::merge(&mut entries, json!({ "warning": why }));
    }
    entries
}

/// How states in space are written and drawn.
pub struct Spatial<'a, S> {
    setup: &'a MotionSetup,
    task: &'a Task<'a>,
    sample: PhantomData<S>,
}

impl<'a, S> Spatial<'a, S> {
    pub fn new(setup: &'a MotionSetup, task: &'a Task<'a>) -> Self {
        Self {
            setup,
            task,
            sample: PhantomData,
        }
    }
}

impl<S: InSpace> Kind for Spatial<'_, S> {
    type Sample = S;
    /// The end.
    type Shape = Vector3<f64>;
    /// The sections from the clamp to the end.
    type Axis = Vec<Isometry3<f64>>;

    const COLUMNS: &'static [&'static str] = &[
        "t",
        "x",
        "y",
        "z",
        "qw",
        "qx",
        "qy",
        "qz",
        "vx",
        "vy",
        "vz",
        "wx",
        "wy",
        "wz",
        "fx",
        "fy",
        "fz",
        "mx",
        "my",
        "mz",
        "kinetic",
        "elastic",
        "potential",
        "dissipated",
        "work",
        "total",
    ];
    const PASSAGE: bool = false;

    fn row(&self, at: &S) -> Vec<String> {
        let state = self.setup.state(at);
        let columns = columns(&state);
        let mut cells: Vec<String> = columns.into_iter().map(exact).collect();
        cells.extend(energies(&state.ledger, 1.0));
        cells
    }

    fn ledger(&self, at: &S) -> (f64, Ledger) {
        let state = self.setup.state(at);
        (state.t, state.ledger)
    }

    fn distance(&self, at: &S) -> f64 {
        at.distance()
    }

    fn strain_names(&self) -> Vec<&'static str> {
        let names = self.setup.strains.names();
        names.iter().map(|name| name.as_str()).collect()
    }

    fn strains(&self, at: &S, places: &[f64]) -> Vec<Vec<f64>> {
        let strains = self.setup.strains(at, places);
        let names = self.setup.strains.names();
        names
            .iter()
            .map(|name| strains.iter().map(|e| e[*name as usize]).collect())
            .collect()
    }

    fn dissipation(&self, at: &S, places: &[f64]) -> Vec<f64> {
        let k = &self.setup.scales;
        let density = k.energy / k.length / k.time;
        let values = at.dissipation_at(places);
        values.iter().map(|d| d * density).collect()
    }

    fn shape(&self, at: &S) -> Vector3<f64> {
        self.setup.state(at).pose.translation.vector
    }

    fn axis(&self, at: &S) -> Vec<Isometry3<f64>> {
        self.setup.sections(at, CURVE)
    }

    fn json(&self, at: &S) -> Value {
        let state = self.setup.state(at);
        let names = Self::COLUMNS.iter().map(|name| (*name).to_owned());
        let mut entries = Value::Object(names.zip(columns(&state).map(|x| json!(x))).collect());
        super::super::query::merge(&mut entries, energies_json(&state.ledger));
        entries
    }

    fn text(&self, at: &S) -> String {
        let state = self.setup.state(at);
        let u = self.task.units;
        let vector = |v: &Vector3<f64>, symbol: &str| {
            let parts = [v.x, v.y, v.z].map(|x| rounded(x, 9)).join(", ");
            format!("({parts}){}", unit(symbol))
        };
        format!(
            "r = {}, v = {}",
            vector(&state.pose.translation.vector, u.length()),
            vector(&state.velocity, u.velocity()),
        )
    }
}

/// The columns before the energies.
fn columns(state: &MotionState) -> [f64; 20] {
    let (r, q) = (state.pose.translation.vector, state.pose.rotation);
    let (v, w) = (state.velocity, state.angular_velocity);
    let (f, m) = (state.force, state.couple);
    [
        state.t, r.x, r.y, r.z, q.w, q.i, q.j, q.k, v.x, v.y, v.z, w.x, w.y, w.z, f.x, f.y, f.z,
        m.x, m.y, m.z,
    ]
}
