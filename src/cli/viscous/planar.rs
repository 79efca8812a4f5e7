//! Planar rods with damping: their tables, and the figures of shapes and of the layer of a snap.

use super::super::check::no_start;
use super::super::figures::{labels, path_folds};
use super::super::files::rounded;
use super::super::run::{RunArgs, unit};
use super::super::table::{COLUMNS, Labels, Row};
use super::super::{Ending, Refusal};
use super::recorder::{Moment, Recorder};
use super::{Done, Kind, Task, conclude, energies_json, figures, scaled_layers, scaled_ledger};
use nalgebra::Vector2;
use serde_json::{Value, json};
use snaprod::creep::plane::Plane;
use snaprod::elastica::Elastica;
use snaprod::elastica::chart::ChartPoint;
use snaprod::manifold::EquilibriumManifold;
use snaprod::motion::Ledger;
use snaprod::motion::creep::{Layer, ViscousSample, drive_viscous, near_equilibrium};
use snaprod::plot::{self, Curve, LayerFigure, LayerRun, Shape, Snapshots};
use snaprod::scene::{Scales, Scene, Units, ViscousSetup};

type Sample = ViscousSample<Plane, 1, 2>;

/// Points of a drawn axis.
const CURVE: usize = 60;
/// Shapes drawn at even times; shapes of a layer.
const SHAPES: usize = 11;

/// Runs the scene.
pub fn run(args: &RunArgs, scene: &Scene) -> Result<Ending, Refusal> {
    let refuse = |e| no_start(&args.scene.path, &e);
    let setup = ViscousSetup::new(scene).map_err(refuse)?;
    let mut run = setup.run().map_err(refuse)?;
    let k = setup.scales;
    let task = Task::begin(
        args,
        scene,
        (scene.units, k),
        "L = EI = m = 1",
        labels(scene),
    )?;
    let kind = Planar {
        scales: k,
        units: scene.units,
    };
    let mut recorder = Recorder::new(&kind, &task, run.first())?;
    let outcome = drive_viscous(&mut run, scene.run()?.samples, &mut recorder)?;
    let done = Done {
        record: recorder.finish(run.now())?,
        outcome,
        t: run.now().t * k.time,
        first: kind.json(run.first()),
        last: kind.json(run.now()),
        place: kind.text(run.now()),
        layers: scaled_layers(run.layers(), &k),
        work: run.work(),
        nodes: Some((run.most_nodes(), run.tail())),
        notes: Vec::new(),
        further: json!({}),
    };
    conclude(&task, &done, || {
        draw(&task, &done, setup.viscosity, setup.body.is_driven())
    })
}

impl From<&Sample> for Row {
    fn from(sample: &Sample) -> Self {
        let labels = near_equilibrium(sample).and_then(|near| {
            let q = Vector2::new(near.p, near.w);
            Some(Labels {
                q,
                sheet: near.sheet,
                index: Elastica.index(&q).ok()?,
            })
        });
        Self {
            t: sample.t,
            pose: sample.pose,
            velocity: sample.velocity,
            labels,
            force: -sample.flow.wrench,
            ledger: sample.ledger,
        }
    }
}

struct Planar {
    scales: Scales,
    units: Units,
}

/// The body and the rod's axis.
struct Drawn {
    body: [f64; 2],
    curve: Vec<[f64; 2]>,
    /// Energy dissipated in the rod so far.
    lost: f64,
}

impl Kind for Planar {
    type Sample = Sample;
    type Shape = Drawn;
    type Axis = ();

    const COLUMNS: &'static [&'static str] = &COLUMNS;
    const PASSAGE: bool = true;

    fn row(&self, at: &Sample) -> Vec<String> {
        Row::from(at).cells(&self.scales)
    }

    fn ledger(&self, at: &Sample) -> (f64, Ledger) {
        let k = &self.scales;
        (at.t * k.time, scaled_ledger(&at.ledger, k.energy))
    }

    fn distance(&self, at: &Sample) -> f64 {
        at.distance()
    }

    fn strain_names(&self) -> Vec<&'static str> {
        vec!["curvature"]
    }

    fn strains(&self, at: &Sample, places: &[f64]) -> Vec<Vec<f64>> {
        let strains = at.strains_at(places);
        vec![strains.iter().map(|e| e[0] / self.scales.length).collect()]
    }

    fn dissipation(&self, at: &Sample, places: &[f64]) -> Vec<f64> {
        let k = &self.scales;
        let density = k.energy / k.length / k.time;
        let values = at.dissipation_at(places);
        values.iter().map(|d| d * density).collect()
    }

    fn shape(&self, at: &Sample) -> Drawn {
        let length = self.scales.length;
        let curve = at.curve(CURVE).into_iter();
        Drawn {
            body: [at.pose[0] * length, at.pose[1] * length],
            curve: curve.map(|[x, y]| [x * length, y * length]).collect(),
            lost: at.friction * self.scales.energy,
        }
    }

    /// Every moment has one.
    fn axis(&self, _: &Sample) {}

    fn json(&self, at: &Sample) -> Value {
        let k = &self.scales;
        let row = Row::from(at);
        let labels = row.labels.as_ref();
        let mut state = json!({
            "t": row.t * k.time,
            "x": row.pose[0] * k.length,
            "y": row.pose[1] * k.length,
            "vx": row.velocity[0] * k.velocity,
            "vy": row.velocity[1] * k.velocity,
            "lam": labels.map(|l| ChartPoint::new(l.q[0], l.q[1]).integrals.lam),
            "p": labels.map(|l| l.q[0]),
            "w": labels.map(|l| l.q[1]),
            "mode": labels.map(|l| l.sheet.mode),
            "sign": labels.map(|l| l.sheet.sign.as_str()),
            "index": labels.map(|l| l.index),
            "fx": row.force[0] * k.force,
            "fy": row.force[1] * k.force,
        });
        let energies = energies_json(&self.ledger(at).1);
        super::super::query::merge(&mut state, energies);
        state
    }

    fn text(&self, at: &Sample) -> String {
        let (k, u) = (&self.scales, self.units);
        let row = Row::from(at);
        format!(
            "r = ({}, {}){}, v = ({}, {}){}, {}",
            rounded(at.pose[0] * k.length, 12),
            rounded(at.pose[1] * k.length, 12),
            unit(u.length()),
            rounded(at.velocity[0] * k.velocity, 12),
            rounded(at.velocity[1] * k.velocity, 12),
            unit(u.velocity()),
            row.labels.map_or_else(
                || "near no equilibrium".to_owned(),
                |l| format!("near {}", l.sheet)
            ),
        )
    }
}

/// Draws the figures of a run that has a motion to show. `viscosity` is in the run's units.
fn draw(task: &Task, done: &Done<Planar>, viscosity: f64, driven: bool) {
    let (out, record, layers) = (&task.out, &done.record, done.layers.as_slice());
    let (Some(first), Some(last)) = (record.track.first(), record.track.last()) else {
        return;
    };
    // A run that got nowhere has nothing to draw.
    if !(first.t < last.t) {
        return;
    }
    out.figure("snapshots", || snapshots(task, done), plot::snapshots);
    let energies = || Ok(figures::energies(task, record, layers, driven));
    out.figure("energies", energies, plot::energies);
    let strain = || Ok(figures::strain(task, record, layers, 0, ""));
    out.figure("strain", strain, plot::strain_map);
    // The drawn time is stretched by the viscosity in the scene's units: T is time over viscosity.
    let viscosity = viscosity * task.scales.viscosity();
    if let Some(layer) = layer(task, done, viscosity) {
        out.figure("layer", || Ok(layer), plot::layer);
    }
    figures::losses(task, layers);
}

fn shape(moment: &Moment<Drawn>, time: f64) -> Shape {
    Shape {
        time,
        axis: curve(moment),
    }
}

fn curve(moment: &Moment<Drawn>) -> Curve {
    Curve::new(moment.shape.curve.iter().copied())
}

fn snapshots(task: &Task, done: &Done<Planar>) -> Result<Snapshots, Refusal> {
    let track = &done.record.track;
    let (start, end) = (track[0].t, track[track.len() - 1].t);
    let at = |t: f64| &track[track.partition_point(|m| m.t < t).min(track.len() - 1)];
    let shapes = (0..SHAPES)
        .map(|i| at(start + (end - start) * i as f64 / (SHAPES - 1) as f64))
        .map(|moment| shape(moment, moment.t))
        .collect();
    Ok(Snapshots {
        shapes,
        path: Curve::new(track.iter().map(|m| m.shape.body)),
        folds: path_folds(task.scales.length)?,
        snaps: figures::snaps(&done.layers)
            .map(|layer| at(layer.peak).shape.body)
            .collect(),
        units: task.labels.clone(),
    })
}

/// The passage with the largest loss, in stretched time from where it left the neighbourhood of equilibrium.
fn layer(task: &Task, done: &Done<Planar>, viscosity: f64) -> Option<LayerFigure> {
    let passage = &done.record.passage;
    let (begin, end) = (passage.first()?, passage.last()?);
    let layer: &Layer =
        figures::snaps(&done.layers).find(|l| begin.t <= l.peak && l.peak <= end.t)?;
    let stretched = |t: f64| (t - layer.peak) / viscosity;
    let inside: Vec<&Moment<Drawn>> = passage
        .iter()
        .filter(|m| (layer.from..=layer.to).contains(&m.t))
        .collect();
    let (fold, landing) = (inside.first()?, inside.last()?);
    // Even in the energy that is lost: that is where the shape changes.
    let lost = |m: &Moment<Drawn>| m.shape.lost;
    let (low, high) = (lost(fold), lost(landing));
    let shapes = (1..SHAPES - 1)
        .filter_map(|i| {
            let level = low + (high - low) * i as f64 / (SHAPES - 1) as f64;
            inside.iter().find(|m| lost(m) >= level)
        })
        .map(|m| shape(m, stretched(m.t)))
        .collect();
    Some(LayerFigure {
        fold: curve(fold),
        landing: curve(landing),
        shapes,
        runs: vec![LayerRun {
            eta: viscosity,
            stretched: inside.iter().map(|m| stretched(m.t)).collect(),
            elastic: inside.iter().map(|m| m.ledger.elastic).collect(),
            dissipated: inside.iter().map(|m| lost(m) - low).collect(),
        }],
        units: task.labels.clone(),
        ..LayerFigure::default()
    })
}
