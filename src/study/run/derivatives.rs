//! Derivatives of runs by fields of the scene: states at samples, times and energies of snaps.
//!
//! The derivatives are integrated with the motion ([`crate::motion::sensitivity`]). A field enters by the start, the
//! body with its loads, the frame of the clamp, and the units of length and time. Each is lowered from the scene at
//! four values beside that of the field, and differenced to the fourth order.

use crate::body::{Frame, PointMass};
use crate::elastica::Elastica;
use crate::error::{Error, Result};
use crate::manifold::EquilibriumManifold;
use crate::motion::sensitivity::{
    BESIDE, Reached, Sensitivity, Tangent, TimedTangent, VariedBody, difference,
};
use crate::motion::{Event, Options, Outcome, Phase, Snap, on_elastica};
use crate::scene::{ElasticPlane, MotionModel, ScalarField, Scales, Scene, Setup};
use crate::study::{Cell, Column, Table};
use nalgebra::{SVector, Vector1, Vector2, Vector3};
use serde_json::{Map, Value, json};

/// Step of the differences by a field, relative to the field; itself at 0.
const STEP: f64 = 1e-3;
/// Step along the derivative of a state.
const ALONG: f64 = 1e-5;
/// Coarsest tolerance of the derivatives.
const TOLERANCE: f64 = 1e-11;
/// Names of the columns of a state.
pub(in crate::study) const NAMES: [&str; 4] = ["x", "y", "vx", "vy"];

/// Place and velocity of the body in the world: x, y, vx, vy.
type World = SVector<f64, 4>;

/// Derivatives of a run by one field.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDerivative {
    /// Path of the field.
    pub field: String,
    /// Derivatives of x, y, vx, vy at the samples.
    pub samples: Vec<[f64; 4]>,
    /// Derivatives of time, place and released energy of each snap.
    pub snaps: Vec<SnapDerivative>,
}

/// Derivatives of a snap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnapDerivative {
    /// Of the time.
    pub t: f64,
    /// Of the place of the body at the time of the snap.
    pub place: [f64; 2],
    /// Of the released energy.
    pub released: f64,
}

/// Derivatives of a run by fields.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDerivatives {
    /// Times of the samples.
    pub times: Vec<f64>,
    /// By each field.
    pub each: Vec<RunDerivative>,
    scene: Scene,
}

/// A planar elastic rod with a point mass, lowered from its scene.
struct Lowered {
    body: PointMass<2>,
    q: Vector2<f64>,
    v: Vector2<f64>,
    scales: Scales,
    clamp: Frame<3>,
}

impl Lowered {
    fn new(scene: &Scene) -> Result<Self> {
        let model = ElasticPlane::new(scene)?;
        let start = model.start.as_ref().ok_or_else(|| {
            Error::domain(
                "derivatives of a run do not start from the straight rod; give [start] a pose that is bent, as by imperfection",
            )
        })?;
        Ok(Self {
            q: Vector2::new(start.p, start.w),
            v: model.velocity,
            scales: scene.scales()?,
            clamp: model.clamp(0.0),
            body: model.body,
        })
    }

    /// Place and velocity in the world.
    fn world(&self, phase: &Phase<2>) -> Result<World> {
        let at = Elastica.point(&phase.q);
        let at = at.ok_or_else(|| Error::domain("a state outside of the chart"))?;
        let lifted = |v: &Vector2<f64>| Vector3::new(v.x, v.y, 0.0);
        let (x, v) = (lifted(&at.pose), lifted(&phase.v));
        let k = &self.scales;
        let x_world = self.clamp.place(&x) * k.length;
        let v_world = self.clamp.absolute_velocity(&x, &v) * (k.length / k.time);
        Ok(World::new(x_world.x, x_world.y, v_world.x, v_world.y))
    }
}

/// The scene at the value of a field, and beside it.
struct Varied {
    here: Lowered,
    beside: [Lowered; 4],
    step: f64,
}

impl Varied {
    fn new(field: &ScalarField) -> Result<Self> {
        let p = field.value;
        let step = if p == 0.0 { STEP } else { STEP * p.abs() };
        let lowered = |place: f64| Lowered::new(&field.scene(p + place * step)?);
        let [a, b, c, d] = BESIDE.map(lowered);
        Ok(Self {
            here: lowered(0.0)?,
            beside: [a?, b?, c?, d?],
            step,
        })
    }

    /// Derivative, per step, of a number of the scenes.
    fn rate(&self, of: impl Fn(&Lowered) -> f64) -> f64 {
        let values = self.beside.each_ref().map(|one| Vector1::new(of(one)));
        difference(&values, Vector1::zeros(), 1.0).x
    }

    /// The start with its derivative per step.
    fn start(&self) -> Tangent {
        let phase = |one: &Lowered| Phase {
            q: one.q,
            v: one.v,
            t: 0.0,
            work: 0.0,
            drag_loss: 0.0,
        };
        let at = phase(&self.here);
        let both = |one: &Lowered| {
            SVector::<f64, 4>::from_fn(|i, _| [one.q[0], one.q[1], one.v[0], one.v[1]][i])
        };
        let by = difference(&self.beside.each_ref().map(both), SVector::zeros(), 1.0);
        let by = Phase {
            q: Vector2::new(by[0], by[1]),
            v: Vector2::new(by[2], by[3]),
            ..phase_of_rest()
        };
        Tangent { at, by }
    }

    /// Derivative by the field of the state in the world, at a fixed time of the scene.
    fn world(&self, state: &TimedTangent) -> Result<[f64; 4]> {
        let time = state.at.t * self.here.scales.time;
        let later = self.rate(|one| time / one.scales.time);
        let by = state.by.moved(later, &state.rate);
        let mut values = [World::zeros(); 4];
        for (value, one) in values.iter_mut().zip(&self.beside) {
            *value = one.world(&state.at)?;
        }
        let mut change = difference(&values, World::zeros(), 1.0);
        let size = by.largest();
        if size > 0.0 {
            let h = ALONG / size;
            for (value, place) in values.iter_mut().zip(BESIDE) {
                *value = self.here.world(&state.at.moved(place * h, &by))?;
            }
            change += difference(&values, World::zeros(), h);
        }
        Ok((change / self.step).into())
    }
}

fn phase_of_rest() -> Phase<2> {
    Phase {
        q: Vector2::zeros(),
        v: Vector2::zeros(),
        t: 0.0,
        work: 0.0,
        drag_loss: 0.0,
    }
}

/// Derivatives of the run of a scene by fields: one point mass on a planar elastic rod, with every snap.
///
/// # Errors
/// Another model; a rod with mass; obstacles; a clamp that moves; loads that jump in time; a run that ends early, or
/// passes next to the straight rod.
pub fn derivatives(scene: &Scene, fields: &[ScalarField]) -> Result<RunDerivatives> {
    scene.refuse_functions("derivatives of a run")?;
    let run = scene.run()?;
    let (steps, duration) = (run.samples.max(2) - 1, run.duration);
    let times = (0..=steps).map(|i| duration * i as f64 / steps as f64);
    derivatives_at(scene, fields, times.collect())
}

/// Derivatives of the run of a scene at these times, in rising order.
///
/// # Errors
/// As [`derivatives()`].
pub(in crate::study) fn derivatives_at(
    scene: &Scene,
    fields: &[ScalarField],
    times: Vec<f64>,
) -> Result<RunDerivatives> {
    check(scene)?;
    let options = Setup::new(scene)?.options;
    let lowered = Lowered::new(scene)?;
    if lowered.body.next_break(0.0).is_finite() {
        return Err(Error::domain(
            "derivatives of a run need loads that are smooth in time: leave out pulses, ramps, tables and a clamp that moves by a table",
        ));
    }
    let snaps = snaps(&lowered, options)?;
    let each = fields.iter().map(|field| {
        let found = by_field(field, &snaps, &times, options);
        found.map_err(|why| scene.in_own_units(why).context(field.path.clone()))
    });
    Ok(RunDerivatives {
        each: each.collect::<Result<_>>()?,
        times,
        scene: scene.clone(),
    })
}

/// Refuses scenes without derivatives of runs.
fn check(scene: &Scene) -> Result<()> {
    let reason = if scene.is_bar() || scene.is_assembly() || !scene.is_planar() {
        "derivatives of runs are those of model = \"elastica\" with a point mass"
    } else if scene.rod.damping.is_some() || scene.rod.mass().is_some() {
        "derivatives of runs are those of rods without friction and without mass"
    } else if !scene.obstacles.is_empty() {
        "derivatives of runs are not computed among obstacles"
    } else if scene.clamp.motion.is_some() {
        "derivatives of runs are those of clamps at rest"
    } else if scene.bearing_in_plane()?.is_some() {
        "derivatives of runs are those of rods without loads along them"
    } else {
        return Ok(());
    };
    Err(Error::domain(format!(
        "{reason}; take differences of a sweep with a fine tolerance"
    )))
}

/// The snaps of the run.
fn snaps(lowered: &Lowered, options: Options) -> Result<Vec<Snap>> {
    let mut run = on_elastica(&lowered.body, Some(lowered.q), lowered.v, None, options)?;
    let mut snaps = Vec::new();
    while let Some(event) = run.advance() {
        match event {
            Event::Snap(snap) => snaps.push(snap),
            Event::Stop(outcome) if !matches!(outcome, Outcome::EndOfTime) => {
                return Err(Error::domain(format!(
                    "a run that ends early has no derivatives: {outcome}"
                )));
            }
            _ => {}
        }
    }
    Ok(snaps)
}

fn by_field(
    field: &ScalarField,
    snaps: &[Snap],
    times: &[f64],
    options: Options,
) -> Result<RunDerivative> {
    let varied = Varied::new(field)?;
    let bodies = VariedBody {
        body: varied.here.body.clone(),
        beside: varied.beside.each_ref().map(|one| one.body.clone()),
        step: 1.0,
    };
    let tolerance = options.tolerance.min(TOLERANCE);
    let mut motion = Sensitivity::new(&bodies, varied.start(), tolerance)?;
    let (mut left, mut passed) = (snaps.iter(), Vec::new());
    let mut samples = Vec::with_capacity(times.len());
    for time in times {
        let tau = time / varied.here.scales.time;
        let state = loop {
            match motion.advance(tau)? {
                Reached::Time(state) => break state,
                Reached::Fold(fold) => {
                    let snap = left.next().ok_or_else(|| {
                        Error::no_convergence(
                            "the motion with its derivative snaps where the run does not; give the run a finer tolerance",
                        )
                    })?;
                    passed.push(at_snap(&varied, &mut motion, &fold, snap)?);
                }
            }
        };
        samples.push(varied.world(&state)?);
    }
    Ok(RunDerivative {
        field: field.path.clone(),
        samples,
        snaps: passed,
    })
}

/// Goes through a snap; the derivatives of its time, place and energy.
fn at_snap(
    varied: &Varied,
    motion: &mut Sensitivity<'_>,
    fold: &Tangent,
    snap: &Snap,
) -> Result<SnapDerivative> {
    let outside = || Error::domain("a snap outside of the chart");
    let to = Vector2::new(snap.to.q[0], snap.to.q[1]);
    let by_place = motion.land(fold, &to)?;
    let [before, after] = [fold.at.q, to].map(|q| Elastica.point(&q));
    let (before, after) = (before.ok_or_else(outside)?, after.ok_or_else(outside)?);
    let scales = &varied.here.scales;
    let time = |one: &Lowered| one.scales.time;
    // The rod's force does the work -F dr on its stored energy.
    let released = (after.force - before.force).dot(&by_place);
    let unit = varied.rate(|one| one.scales.energy);
    let placed = |one: &Lowered, r: &Vector2<f64>| {
        let world = one.clamp.place(&Vector3::new(r.x, r.y, 0.0)) * one.scales.length;
        Vector2::new(world.x, world.y)
    };
    let values = varied
        .beside
        .each_ref()
        .map(|one| placed(one, &before.pose));
    let origin = placed(&varied.here, &Vector2::zeros());
    let moved = placed(&varied.here, &by_place) - origin;
    let place = difference(&values, Vector2::zeros(), 1.0) + moved;
    let step = varied.step;
    Ok(SnapDerivative {
        t: (varied.rate(time) * fold.at.t + scales.time * fold.by.t) / step,
        place: (place / step).into(),
        released: (unit * snap.released + scales.energy * released) / step,
    })
}

impl RunDerivatives {
    /// Adds `derivatives.FIELD`: the end, and the snaps in the order of the events.
    pub fn put_into(&self, summary: &mut Value) {
        let each = self.each.iter().map(|one| {
            let end = one.samples.last().copied().unwrap_or([f64::NAN; 4]);
            let end = NAMES.iter().zip(end);
            let end: Map<String, Value> = end
                .map(|(name, value)| ((*name).to_owned(), value.into()))
                .collect();
            let snaps = one.snaps.iter().map(|snap| {
                json!({ "t": snap.t, "x": snap.place[0], "y": snap.place[1], "released": snap.released })
            });
            let object = json!({ "end": end, "events": snaps.collect::<Vec<_>>() });
            (one.field.clone(), object)
        });
        summary["derivatives"] = each.collect::<Map<_, _>>().into();
    }

    /// The table `derivatives`: a row for each sample, four columns for each field.
    ///
    /// # Errors
    /// None that is known of.
    pub fn table(&self) -> Result<Table> {
        let mut columns = vec![Column::reals("t", self.scene.units.time(), "time")];
        for one in &self.each {
            columns.extend(NAMES.map(|name| {
                let meaning = format!("derivative of {name} by {}", one.field);
                Column::reals(format!("{name} by {}", one.field), "", meaning)
            }));
        }
        let mut table = Table::new("derivatives", columns);
        for (i, time) in self.times.iter().enumerate() {
            let numbers = self.each.iter().flat_map(|one| one.samples[i]);
            let row: Vec<Cell> = std::iter::once(*time)
                .chain(numbers)
                .map(Cell::Real)
                .collect();
            table.push(&row)?;
        }
        Ok(table)
    }
}
