//! A motion as moving pictures: states at times of their own, close where much moves and around snaps.

use super::Hooks;
use super::assembly::AssemblyPrepared;
use super::run::{Prepared, Shapes, shapes::poses};
use crate::error::{Error, Result};
use crate::motion::{Event, Labels, Ledger, Motion, Outcome, Snap, State};
use crate::rod::Fallen;
use nalgebra::{Isometry3, Vector3};

/// Sections of a light rod.
const SECTIONS: usize = 41;
/// States of a step that are looked at, at most.
const INNER: usize = 64;
/// Around moments of attention pictures are so many times as close, for this part of the duration.
const CLOSER: f64 = 4.0;
const AROUND: f64 = 0.01;
/// Snaps whose layer is shown, and shapes of one of them; snaps whose two sides are kept whatever is dropped.
const LAYERS: usize = 6;
const FALL: usize = 14;
const SIDES: usize = 40;
/// The way of a director's tip that counts as much as that of its section, in lengths of the rod.
const ARM: f64 = 0.3;

/// A motion in pictures, and its trace.
#[derive(Debug, Clone)]
pub struct Film {
    /// The pictures, in the order of time.
    pub stills: Vec<Still>,
    /// What bodies and energies do, closer than the pictures.
    pub trace: Vec<Traced>,
    /// Steps of the run.
    pub steps: usize,
}

/// A point of the trace, in the world and the scene's units.
#[derive(Debug, Clone)]
pub struct Traced {
    /// Time.
    pub t: f64,
    /// Pose and velocity of each body; of a single rod of its end.
    pub bodies: Vec<(Isometry3<f64>, Vector3<f64>)>,
    /// Energies.
    pub ledger: Ledger,
}

/// One picture, in the world and the scene's units.
#[derive(Debug, Clone)]
pub struct Still {
    /// Time, bodies and energies.
    pub now: Traced,
    /// Each rod, from its base to its end.
    pub rods: Vec<Vec<Isometry3<f64>>>,
    /// The equilibrium of the elastica that a planar rod is in, or near.
    pub labels: Option<Labels>,
    /// Where in the motion it stands.
    pub place: Place,
}

/// Where in a motion a picture stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// On the way.
    Way,
    /// At a fold, before the snap.
    Fold,
    /// In the layer of a snap, in which time stands still.
    Layer,
    /// After the snap.
    Landing,
}

/// What can be filmed: a scene of motion made ready to run.
pub trait Filmed {
    /// Bodies and energies of a state.
    fn traced(&self, state: &dyn State) -> Traced;

    /// Its rods: so many sections of light ones.
    ///
    /// # Errors
    /// Rods that have no shape.
    fn rods(&self, state: &dyn State, sections: usize) -> Result<Shapes>;

    /// The units of length, time and energy in those of the scene.
    fn scales(&self) -> [f64; 3];
}

impl Filmed for Prepared {
    fn traced(&self, state: &dyn State) -> Traced {
        let now = self.passing(state);
        Traced {
            t: now.t,
            bodies: vec![(now.pose, now.velocity)],
            ledger: now.ledger,
        }
    }

    fn rods(&self, state: &dyn State, sections: usize) -> Result<Shapes> {
        Ok(vec![self.curve(state, sections)])
    }

    fn scales(&self) -> [f64; 3] {
        let k = &self.scales;
        [k.length, k.time, k.energy]
    }
}

impl Filmed for AssemblyPrepared {
    fn traced(&self, state: &dyn State) -> Traced {
        let now = self.passing(state);
        let bodies = now.bodies.iter();
        Traced {
            t: now.t,
            bodies: bodies.map(|body| (body.pose, body.velocity)).collect(),
            ledger: now.ledger,
        }
    }

    fn rods(&self, state: &dyn State, sections: usize) -> Result<Shapes> {
        self.shapes(state, sections - 1)
    }

    fn scales(&self) -> [f64; 3] {
        let k = &self.setup.scales;
        [k.length, k.time, k.energy]
    }
}

/// Films a motion from its start: at most `pictures`, those of the first snaps beside them, and a trace of at most `points`.
///
/// The motion, which was run before, is followed once more, along `line`, the snaps by which the branches from its trunk are entered.
/// Pictures are even in what moves and in time, and closer around the times `moments`. At a snap there are the shapes before and
/// after it; where a planar elastica falls along the viscous layer, its shapes there stand between, with the energies that they have.
///
/// ```
/// use snaprod::{scene::Scene, study::{Silent, film, run}};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 1.0
///     bending_stiffness = 1.0
///     [body]
///     mass = 1.0
///     [start]
///     lambda = 6.3
///     kappa = 0.6
///     velocity = [0.0, -0.5]
///     [run]
///     duration = 1.0
///     "#,
/// )?;
/// let prepared = run::Prepared::new(&scene)?;
/// let film = film::film(&prepared, prepared.motion()?, &[], &[0.0256], [100, 300], &mut Silent)?;
/// let layer = film.stills.iter().filter(|at| at.place == film::Place::Layer);
/// assert!(layer.count() > 8 && film.stills.len() < 125);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Rods without a shape; a branch of `line` that the motion does not have; an interrupt.
pub fn film<'m>(
    of: &dyn Filmed,
    mut motion: Box<dyn Motion<'m> + 'm>,
    line: &[Snap],
    moments: &[f64],
    [pictures, points]: [usize; 2],
    hooks: &mut dyn Hooks,
) -> Result<Film> {
    let [_, time, _] = of.scales();
    let duration = motion.duration();
    let mut camera = Camera {
        of,
        whole: motion.resolution().is_some(),
        pictures: Reel::new(pictures),
        trace: Reel::new(points),
        measure: Measure {
            length: of.scales()[0],
            duration: duration * time,
            moments,
        },
    };
    let mut last = camera.keep(&*motion.given(), Place::Way)?;
    let mut branches = line.iter();
    let (mut snaps, mut steps) = (0, 0);
    while let Some(event) = motion.advance() {
        match event {
            Event::Step { from, to } => {
                steps += 1;
                let now = camera.look(&*motion.now())?;
                // A long step is looked into.
                let near = camera.trace.step.min(camera.pictures.step);
                let parts = (camera.measure.way(&last, &now.0) / near).ceil();
                let parts = (parts as usize).clamp(1, INNER);
                for k in 1..parts {
                    let t = from + (to - from) * k as f64 / parts as f64;
                    if let Some(state) = motion.sample(t) {
                        let seen = camera.look(&*state)?;
                        if camera.follow(&seen) {
                            camera.picture(&*state, &seen)?;
                        }
                    }
                }
                // The state now is made anew at every call.
                if camera.follow(&now) {
                    camera.picture(&*motion.now(), &now)?;
                }
                last = now.0;
                hooks.progress((to / duration).min(1.0), to * time);
                if hooks.interrupted() {
                    return Err(Error::domain("it was interrupted"));
                }
            }
            Event::Snap(snap) => {
                snaps += 1;
                if snaps > SIDES {
                    continue;
                }
                if let Some(state) = motion.before_snap() {
                    camera.keep(&*state, Place::Fold)?;
                    if snaps <= LAYERS {
                        camera.fall(&snap, motion.fall(&snap));
                    }
                }
                last = camera.keep(&*motion.now(), Place::Landing)?;
            }
            Event::Stop(Outcome::Branched(snaps)) => {
                let Some(next) = branches.next() else { break };
                let found = snaps.iter().find(|snap| snap.to.q == next.to.q);
                let found = found.ok_or_else(|| {
                    Error::domain("the motion does not branch as it did when it was run")
                })?;
                camera.keep(&*motion.now(), Place::Fold)?;
                motion = motion.branch(found)?;
                last = camera.keep(&*motion.now(), Place::Landing)?;
            }
            Event::Stop(_) => break,
            Event::Layer(_) | Event::Bounce(_) => {}
        }
    }
    camera.thin();
    // The end may not have been wanted, or dropped again.
    if camera.pictures.lacks(last.t) {
        camera.keep(&*motion.now(), Place::Way)?;
    }
    if camera.trace.lacks(last.t) {
        let traced = of.traced(&*motion.now());
        camera.trace.keep(&camera.measure, (last, traced, false));
    }
    let shaped = |still: &Still| still.rods.iter().all(|rod| rod.len() > 1);
    let stills = camera.pictures.kept.into_iter().map(|(_, still, _)| still);
    let trace = camera.trace.kept.into_iter();
    Ok(Film {
        stills: stills.filter(shaped).collect(),
        trace: trace.map(|(_, traced, _)| traced).collect(),
        steps,
    })
}

/// What tells states apart, with what it was made from.
#[derive(Debug, Clone)]
struct Glimpse {
    t: f64,
    places: Vec<Vector3<f64>>,
}

/// Takes pictures and traces.
struct Camera<'f> {
    of: &'f dyn Filmed,
    /// True if rods move beside their ends.
    whole: bool,
    pictures: Reel<Still>,
    trace: Reel<Traced>,
    measure: Measure<'f>,
}

impl Camera<'_> {
    fn look(&self, state: &dyn State) -> Result<(Glimpse, Traced)> {
        let now = self.of.traced(state);
        let arm = ARM * self.measure.length;
        let seen = |(pose, _): &(Isometry3<f64>, Vector3<f64>)| {
            let at = pose.translation.vector;
            [at, at + pose.rotation * Vector3::z() * arm]
        };
        let mut places: Vec<Vector3<f64>> = now.bodies.iter().flat_map(seen).collect();
        if self.whole {
            let rods = self.of.rods(state, 9)?;
            places.extend(rods.iter().flatten().map(|(_, at)| at.translation.vector));
        }
        Ok((Glimpse { t: now.t, places }, now))
    }

    fn still(&self, state: &dyn State, now: Traced, place: Place) -> Result<Still> {
        let rods = self.of.rods(state, SECTIONS)?;
        Ok(Still {
            now,
            rods: rods.into_iter().map(poses).collect(),
            labels: state.equilibrium(),
            place,
        })
    }

    /// Traces a state if it is far enough from the last one that was traced; true if it is far enough for a picture.
    fn follow(&mut self, (seen, traced): &(Glimpse, Traced)) -> bool {
        if self.trace.wants(&self.measure, seen) {
            self.trace
                .keep(&self.measure, (seen.clone(), traced.clone(), false));
        }
        self.pictures.wants(&self.measure, seen)
    }

    /// Takes a picture.
    fn picture(&mut self, state: &dyn State, (seen, traced): &(Glimpse, Traced)) -> Result<()> {
        let still = self.still(state, traced.clone(), Place::Way)?;
        self.pictures
            .keep(&self.measure, (seen.clone(), still, false));
        Ok(())
    }

    /// Takes a state whatever was taken before.
    fn keep(&mut self, state: &dyn State, place: Place) -> Result<Glimpse> {
        let (seen, traced) = self.look(state)?;
        let still = self.still(state, traced.clone(), place)?;
        let held = place != Place::Way;
        self.trace.keep(&self.measure, (seen.clone(), traced, held));
        self.pictures
            .keep(&self.measure, (seen.clone(), still, held));
        Ok(seen)
    }

    /// The shapes of the layer behind the picture of the fold, evenly chosen by how far they move.
    fn fall(&mut self, snap: &Snap, shapes: Option<Vec<Fallen>>) {
        let (Some((seen, fold, _)), Some(shapes)) = (self.pictures.kept.last(), shapes) else {
            return;
        };
        let seen = seen.clone();
        for still in falling(snap, &shapes, fold, self.of.scales()) {
            self.pictures
                .keep(&self.measure, (seen.clone(), still, true));
        }
    }

    fn thin(&mut self) {
        self.trace.thin(&self.measure, self.trace.most);
        self.pictures.thin(&self.measure, self.pictures.most - 1);
    }
}

/// The shapes between the fold and the landing of a snap, evenly chosen by how far they move.
fn falling(
    snap: &Snap,
    shapes: &[Fallen],
    fold: &Still,
    [length, _, energy]: [f64; 3],
) -> Vec<Still> {
    let Some(base) = fold.rods.get(snap.rod).and_then(|rod| rod.first()) else {
        return Vec::new();
    };
    let apart = |a: &[Isometry3<f64>], b: &[Isometry3<f64>]| {
        let both = a.iter().zip(b);
        let ways = both.map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        ways.fold(0.0, f64::max)
    };
    let mut way = 0.0;
    let mut ways = vec![way];
    for pair in shapes.windows(2) {
        way += apart(&pair[0].1, &pair[1].1);
        ways.push(way);
    }
    let mut chosen: Vec<usize> = (1..FALL)
        .map(|k| ways.partition_point(|at| *at < way * k as f64 / FALL as f64))
        .filter(|k| *k < shapes.len())
        .collect();
    chosen.dedup();
    let still = |k: usize| {
        let (elastic, sections) = &shapes[k];
        // The first section is that of the base.
        let clamp = base.rotation * sections[0].rotation.inverse();
        let placed = |at: &Isometry3<f64>| {
            let place = base.translation.vector + clamp * at.translation.vector * length;
            Isometry3::from_parts(place.into(), clamp * at.rotation)
        };
        let ledger = &fold.now.ledger;
        let lost = (snap.from.elastic - elastic).max(0.0) * energy;
        let mut rods = fold.rods.clone();
        rods[snap.rod] = sections.iter().map(placed).collect();
        Still {
            rods,
            now: Traced {
                ledger: Ledger {
                    elastic: ledger.elastic - lost,
                    dissipated: ledger.dissipated + lost,
                    ..*ledger
                },
                ..fold.now.clone()
            },
            labels: None,
            place: Place::Layer,
        }
    };
    chosen.into_iter().map(still).collect()
}

/// How far states are apart.
struct Measure<'a> {
    length: f64,
    duration: f64,
    moments: &'a [f64],
}

impl Measure<'_> {
    /// The longest way of a place in lengths of the rod and the part of the duration, more next to the moments of attention.
    fn way(&self, a: &Glimpse, b: &Glimpse) -> f64 {
        let both = a.places.iter().zip(&b.places);
        let moved = both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let near = |moment: &f64| {
            let off = (b.t - moment) / (AROUND * self.duration);
            (CLOSER - 1.0) / (1.0 + off * off)
        };
        let weight = 1.0 + self.moments.iter().map(near).fold(0.0, f64::max);
        weight * (moved / self.length + (b.t - a.t) / self.duration)
    }
}

/// Things that stay few however long the motion is: where they become too many, some of those that are near each other are dropped,
/// but for those that are held.
struct Reel<T> {
    kept: Vec<(Glimpse, T, bool)>,
    /// They are as far apart as this.
    step: f64,
    most: usize,
}

impl<T> Reel<T> {
    fn new(most: usize) -> Self {
        Self {
            kept: Vec::new(),
            // Time alone makes a way of 1.
            step: 1.0 / most as f64,
            most,
        }
    }

    fn wants(&self, measure: &Measure, at: &Glimpse) -> bool {
        let far = |(last, ..): &(Glimpse, T, bool)| measure.way(last, at) >= self.step;
        self.kept.last().is_none_or(far)
    }

    /// True if all that was taken is before the time.
    fn lacks(&self, t: f64) -> bool {
        self.kept.last().is_none_or(|(at, ..)| at.t < t)
    }

    fn keep(&mut self, measure: &Measure, one: (Glimpse, T, bool)) {
        self.kept.push(one);
        if self.kept.len() > 2 * self.most {
            self.thin(measure, 3 * self.most / 2);
        }
    }

    /// Drops until there are no more than this, those held not counted.
    fn thin(&mut self, measure: &Measure, most: usize) {
        while self.kept.iter().filter(|(.., held)| !held).count() > most {
            self.step *= 1.05;
            for one in std::mem::take(&mut self.kept) {
                if one.2 || self.wants(measure, &one.0) {
                    self.kept.push(one);
                }
            }
        }
    }
}
