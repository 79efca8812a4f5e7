//! A motion as a film: pictures at adapted times, dense where much moves and around snaps.

use super::Hooks;
use super::run::{BodyMoment, Moment, Prepared, shapes::poses};
use crate::error::{Error, Quantity, Result};
use crate::motion::{Event, Ledger, Outcome, Snap, State};
use crate::rod::Fallen;
use crate::scene::Scales;
use nalgebra::{Isometry3, Vector3};

/// Sections of a light rod.
const SECTIONS: usize = 41;
/// Largest number of states examined within a step.
const INNER: usize = 64;
/// Density factor of pictures around moments of attention, and width of such a neighbourhood as a fraction of the
/// duration.
const CLOSER: f64 = 4.0;
const AROUND: f64 = 0.01;
/// Number of snaps with a film of their layer, number of shapes in each, and number of snaps whose two sides are
/// always kept.
const LAYERS: usize = 6;
const FALL: usize = 14;
const SIDES: usize = 40;
/// Length of the director arm whose tip counts as a moving point, in lengths of the rod.
const ARM: f64 = 0.3;

/// A motion in pictures, and its trace.
#[derive(Debug, Clone)]
pub struct Film {
    /// The pictures, in the order of time.
    pub stills: Vec<Still>,
    /// Bodies and energies, at more times than the pictures.
    pub trace: Vec<Moment>,
    /// Steps of the run.
    pub steps: usize,
}

/// One picture, in the world and the scene's units.
#[derive(Debug, Clone)]
pub struct Still {
    /// The state, with the labels of the equilibrium of the elastica that a planar rod is in, or near.
    pub now: Moment,
    /// Sections of each rod, from base to end.
    pub rods: Vec<Vec<Isometry3<f64>>>,
    /// Role of the picture in the motion.
    pub place: PictureRole,
}

/// Role of a picture in a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureRole {
    /// In the course of the motion.
    Way,
    /// At a fold, before the snap.
    Fold,
    /// In the layer of a snap, at a fixed time.
    Layer,
    /// After the snap.
    Landing,
}

/// Films a motion from its start: at most `pictures` pictures, apart from those of the first snaps, and a trace of at
/// most `points`.
///
/// The motion was run before and is computed again along `line`, which names the branch to follow at each fork
/// ([`RunBranch::fork`](super::run::RunBranch::fork)). Pictures are evenly spaced in motion and time, and denser around
/// the times `moments`. At a snap there are the shapes before and after it. Where a planar elastica falls along the
/// viscous layer, its shapes and energies in the layer are inserted.
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
/// let film = film::film(&prepared, &[], &[0.0256], [100, 300], &mut Silent)?;
/// let layer = film.stills.iter().filter(|at| at.place == film::PictureRole::Layer);
/// assert!(layer.count() > 8 && film.stills.len() < 125);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A start from which no motion is possible; rods without a shape; a branch of `line` missing in the motion; an
/// interrupt.
pub fn film(
    of: &Prepared,
    line: &[usize],
    moments: &[f64],
    [pictures, points]: [usize; 2],
    hooks: &mut dyn Hooks,
) -> Result<Film> {
    let k = &of.header.scales;
    let time = k.unit(Quantity::Time);
    let mut motion = of.motion()?;
    let duration = motion.duration();
    let mut camera = FilmCamera {
        of,
        whole: motion.resolution().is_some(),
        pictures: ThinnedList::new(pictures),
        trace: ThinnedList::new(points),
        measure: StateDistance {
            length: k.unit(Quantity::Length),
            duration: duration * time,
            moments,
        },
    };
    let mut last = camera.keep(&*motion.given(), PictureRole::Way)?;
    let mut branches = line.iter();
    let (mut snaps, mut steps) = (0, 0);
    while let Some(event) = motion.advance() {
        match event {
            Event::Step { from, to } => {
                steps += 1;
                let now = camera.look(&*motion.now())?;
                // Long steps are examined inside.
                let near = camera.trace.step.min(camera.pictures.step);
                let parts = (camera.measure.way(&last, &now.at) / near).ceil();
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
                // `now` builds a new state at every call.
                if camera.follow(&now) {
                    camera.picture(&*motion.now(), &now)?;
                }
                last = now.at;
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
                    camera.keep(&*state, PictureRole::Fold)?;
                    if snaps <= LAYERS {
                        camera.fall(&snap, motion.fall(&snap));
                    }
                }
                last = camera.keep(&*motion.now(), PictureRole::Landing)?;
            }
            Event::Stop(Outcome::Branched(snaps)) => {
                let Some(next) = branches.next() else { break };
                let found = snaps.get(*next).ok_or_else(|| {
                    Error::domain("the motion does not branch as it did when it was run")
                })?;
                camera.keep(&*motion.now(), PictureRole::Fold)?;
                motion = motion.branch(found)?;
                last = camera.keep(&*motion.now(), PictureRole::Landing)?;
            }
            Event::Stop(_) => break,
            Event::Layer(_) | Event::Bounce(_) | Event::Contact(_) | Event::RodContact(_) => {}
        }
    }
    camera.thin();
    // The last state may have been skipped or dropped.
    if camera.pictures.lacks(last.t) {
        camera.keep(&*motion.now(), PictureRole::Way)?;
    }
    if camera.trace.lacks(last.t) {
        let traced = of.moment_without_index(&*motion.now());
        let kept = Kept::freely(last, traced);
        camera.trace.keep(&camera.measure, kept);
    }
    let shaped = |still: &Still| still.rods.iter().all(|rod| rod.len() > 1);
    let stills = camera.pictures.kept.into_iter().map(|kept| kept.item);
    let trace = camera.trace.kept.into_iter();
    Ok(Film {
        stills: stills.filter(shaped).collect(),
        trace: trace.map(|kept| kept.item).collect(),
        steps,
    })
}

/// Fingerprint of a state by which distances of states are measured.
#[derive(Debug, Clone)]
struct StateFingerprint {
    t: f64,
    places: Vec<Vector3<f64>>,
}

/// Takes pictures and traces.
struct FilmCamera<'f> {
    of: &'f Prepared,
    /// True if rods move while their ends are fixed.
    whole: bool,
    pictures: ThinnedList<Still>,
    trace: ThinnedList<Moment>,
    measure: StateDistance<'f>,
}

impl FilmCamera<'_> {
    fn look(&self, state: &dyn State) -> Result<Seen> {
        let now = self.of.moment_without_index(state);
        let arm = ARM * self.measure.length;
        let seen = |body: &BodyMoment| {
            let at = body.pose.translation.vector;
            [at, at + body.pose.rotation * Vector3::z() * arm]
        };
        let mut places: Vec<Vector3<f64>> = now.bodies.iter().flat_map(seen).collect();
        if self.whole {
            let rods = self.of.curves(state, 9)?;
            places.extend(rods.iter().flatten().map(|(_, at)| at.translation.vector));
        }
        let at = StateFingerprint { t: now.t, places };
        Ok(Seen { at, now })
    }

    fn still(&self, state: &dyn State, now: Moment, place: PictureRole) -> Result<Still> {
        let rods = self.of.curves(state, SECTIONS)?;
        Ok(Still {
            now: Moment {
                labels: state.equilibrium(),
                ..now
            },
            rods: rods.into_iter().map(poses).collect(),
            place,
        })
    }

    /// Traces a state if it is far enough from the last traced one; true if it is far enough from the last picture.
    fn follow(&mut self, seen: &Seen) -> bool {
        if self.trace.wants(&self.measure, &seen.at) {
            let kept = Kept::freely(seen.at.clone(), seen.now.clone());
            self.trace.keep(&self.measure, kept);
        }
        self.pictures.wants(&self.measure, &seen.at)
    }

    /// Takes a picture.
    fn picture(&mut self, state: &dyn State, seen: &Seen) -> Result<()> {
        let still = self.still(state, seen.now.clone(), PictureRole::Way)?;
        let kept = Kept::freely(seen.at.clone(), still);
        self.pictures.keep(&self.measure, kept);
        Ok(())
    }

    /// Keeps a picture of a state unconditionally.
    fn keep(&mut self, state: &dyn State, place: PictureRole) -> Result<StateFingerprint> {
        let Seen { at, now } = self.look(state)?;
        let still = self.still(state, now.clone(), place)?;
        let held = place != PictureRole::Way;
        let kept = Kept {
            held,
            ..Kept::freely(at.clone(), now)
        };
        self.trace.keep(&self.measure, kept);
        let kept = Kept {
            held,
            ..Kept::freely(at.clone(), still)
        };
        self.pictures.keep(&self.measure, kept);
        Ok(at)
    }

    /// Inserts shapes of the layer after the picture of the fold, evenly chosen by displacement.
    fn fall(&mut self, snap: &Snap, shapes: Option<Vec<Fallen>>) {
        let (Some(fold), Some(shapes)) = (self.pictures.kept.last(), shapes) else {
            return;
        };
        let at = fold.at.clone();
        for still in falling(snap, &shapes, &fold.item, &self.of.header.scales) {
            let kept = Kept {
                held: true,
                ..Kept::freely(at.clone(), still)
            };
            self.pictures.keep(&self.measure, kept);
        }
    }

    fn thin(&mut self) {
        self.trace.thin(&self.measure, self.trace.most);
        self.pictures.thin(&self.measure, self.pictures.most - 1);
    }
}

/// Shapes between fold and landing of a snap, evenly chosen by displacement.
fn falling(snap: &Snap, shapes: &[Fallen], fold: &Still, k: &Scales) -> Vec<Still> {
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
    let still = |i: usize| {
        let (elastic, sections) = &shapes[i];
        // The first section is the base section.
        let clamp = base.rotation * sections[0].rotation.inverse();
        let placed = |at: &Isometry3<f64>| {
            let place = base.translation.vector + clamp * at.translation.vector * k.length;
            Isometry3::from_parts(place.into(), clamp * at.rotation)
        };
        let ledger = &fold.now.ledger;
        let lost = k.outward(Quantity::Couple, (snap.from.elastic - elastic).max(0.0));
        let mut rods = fold.rods.clone();
        rods[snap.rod] = sections.iter().map(placed).collect();
        Still {
            rods,
            now: Moment {
                labels: None,
                ledger: Ledger {
                    elastic: ledger.elastic - lost,
                    dissipated: ledger.dissipated + lost,
                    ..*ledger
                },
                ..fold.now.clone()
            },
            place: PictureRole::Layer,
        }
    };
    chosen.into_iter().map(still).collect()
}

/// Distance between states.
struct StateDistance<'a> {
    length: f64,
    duration: f64,
    moments: &'a [f64],
}

impl StateDistance<'_> {
    /// Largest displacement in rod lengths plus elapsed fraction of the duration, weighted more near moments of
    /// attention.
    fn way(&self, a: &StateFingerprint, b: &StateFingerprint) -> f64 {
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

/// A state with its place on the way.
struct Seen {
    at: StateFingerprint,
    now: Moment,
}

/// An item of a thinned list.
struct Kept<T> {
    at: StateFingerprint,
    item: T,
    /// True if the item is never dropped.
    held: bool,
}

impl<T> Kept<T> {
    /// An item that may be dropped.
    fn freely(at: StateFingerprint, item: T) -> Self {
        let held = false;
        Self { at, item, held }
    }
}

/// A list of bounded length. At the bound the minimum distance grows, and items closer to each other are dropped,
/// except held ones.
struct ThinnedList<T> {
    kept: Vec<Kept<T>>,
    /// Current minimum distance.
    step: f64,
    most: usize,
}

impl<T> ThinnedList<T> {
    fn new(most: usize) -> Self {
        Self {
            kept: Vec::new(),
            // Elapsed time alone contributes a total distance of 1.
            step: 1.0 / most as f64,
            most,
        }
    }

    fn wants(&self, measure: &StateDistance, at: &StateFingerprint) -> bool {
        let far = |last: &Kept<T>| measure.way(&last.at, at) >= self.step;
        self.kept.last().is_none_or(far)
    }

    /// True if all items are earlier than t.
    fn lacks(&self, t: f64) -> bool {
        self.kept.last().is_none_or(|kept| kept.at.t < t)
    }

    fn keep(&mut self, measure: &StateDistance, one: Kept<T>) {
        self.kept.push(one);
        if self.kept.len() > 2 * self.most {
            self.thin(measure, 3 * self.most / 2);
        }
    }

    /// Drops items until at most `most` remain, besides held ones.
    fn thin(&mut self, measure: &StateDistance, most: usize) {
        while self.kept.iter().filter(|kept| !kept.held).count() > most {
            self.step *= 1.05;
            for one in std::mem::take(&mut self.kept) {
                if one.held || self.wants(measure, &one.at) {
                    self.kept.push(one);
                }
            }
        }
    }
}
