//! Runs of a mass on the planar elastica whose rod touches obstacles: one run on each sheet, free or with touches.
//!
//! A touch exchanges no impulse: force and energy are continuous, and the force has a kink. A run on a sheet ends where
//! the rod comes to touch an obstacle, or where a reaction comes to zero. A run on the next sheet takes over state,
//! ledger and contacts of the body.

use super::contacts::{AmongObstacles, GapBy, HandedOver, RodBound, RodGap, RodTouch, TOUCHES};
use super::elastica::free_rod_gap;
use super::rod_gap::frame;
use super::touched_sample::{TouchedSample, contact_of};
use super::{Phase, Run, Sample};
use crate::contact::{Bodies, Mark, Marks, RodContactChange, RodContactEvent, nearest_place};
use crate::drive::{Motion, StateVariables};
use crate::event::{Event, Outcome};
use crate::options::Options;
use crate::snap::Snap;
use crate::state::{StateRef, planar};
use nalgebra::{Isometry3, Vector2, Vector3};
use snaprod_systems::body::PointMass;
use snaprod_systems::contact::MAX_AT_ONCE;
use snaprod_systems::elastica::{Elastica, Equilibrium};
use snaprod_systems::error::{Cause, Error, Result, Stuck};
use snaprod_systems::manifold::invert_near;
use snaprod_systems::math::se3::join;
use snaprod_systems::rod::contact::{
    ContactGuess, ElasticaAmong, GuessedTouch, SheetSection, Surface, TouchedSheet,
};
use snaprod_systems::solve::cost::Cost;
use std::collections::VecDeque;
use std::sync::Arc;

/// Compliance that makes a distance of a reaction: where a touch begins, the rounding of its place is no pull.
const SOFT: f64 = 1e-4;
/// Changes of the touches at one moment before a run gives up.
const CHANGES: u32 = 20;
/// Distance from the centre of a chart within which a step that collapses has another cause than the chart.
const NEAR_CENTRE: f64 = 0.05;
/// Intervals of a rod with touches in the search for touches that are not followed.
const MARKS: usize = 64;
/// Accuracy of the place of the end on a free sheet.
const PLACE: f64 = 1e-15;

/// A run of a mass on a planar elastic rod among obstacles that the rod may touch.
pub(super) struct TouchingRun<'a> {
    body: &'a PointMass<2>,
    obstacles: AmongObstacles<'a>,
    options: Options,
    stage: Stage<'a>,
    /// The rod among the obstacles whose touches are followed; None without any.
    rod: Option<Arc<ElasticaAmong>>,
    /// The obstacle of each surface of `rod`.
    surfaces: Arc<[usize]>,
    /// Obstacles at which a touch ends the run: obstacles with a motion or with sharp edges.
    unfollowed: Arc<[usize]>,
    given: Sample<2>,
    /// Events that are still to be reported.
    events: VecDeque<Event>,
    /// Time of the last change of the touches, and changes at this time.
    at_once: (f64, u32),
    interrupted: bool,
    stopped: bool,
}

/// The run on the present sheet.
enum Stage<'a> {
    Free(Box<Run<'a, Elastica, 2>>),
    Touched(Box<Run<'a, TouchedSheet, 2>>),
}

/// Continuation of the touches at a bound.
enum Next {
    /// The rod goes on with these touches; the guess is for the state now.
    Touches(ContactGuess),
    /// The rod goes on free.
    Free(Vector2<f64>),
}

/// A bound that was reached.
enum Passed {
    /// The run goes on behind the event.
    Through(Box<RodContactEvent>),
    /// The run ends there.
    Ends(RodBound),
}

/// The surface of an obstacle whose touches are followed; None for obstacles that move, or have sharp edges.
fn followed(bodies: &Bodies, obstacle: usize) -> Option<Surface> {
    let obstacle = &bodies.obstacles[obstacle];
    let stands = obstacle.motion(0.0).0.pose == Isometry3::identity() && !obstacle.moves();
    let surface = stands.then(|| Surface::new(obstacle.obstacle().clone(), 0.0));
    surface?.ok()
}

/// The rod with its clamp among surfaces.
fn rod_among(surfaces: Vec<Surface>, body: &PointMass<2>) -> Option<Arc<ElasticaAmong>> {
    let seen = frame(body, 0.0);
    let origin = seen.place(&Vector2::zeros());
    let along = seen.outward(&Vector2::x());
    let clamp = planar(origin.x, origin.y, along.y.atan2(along.x));
    let among = ElasticaAmong::new(&clamp, surfaces);
    among.ok().map(Arc::new)
}

/// Places of a rod on a sheet with touches.
fn marks(sheet: &TouchedSheet, body: &PointMass<2>, at: &Phase<2>) -> Option<Marks> {
    let places: Vec<f64> = (0..=MARKS).map(|k| k as f64 / MARKS as f64).collect();
    let seen = frame(body, at.t);
    let mark = |section: SheetSection| {
        let shape = section.shape;
        let (sin, cos) = shape.theta.sin_cos();
        Mark {
            s: shape.s,
            x: seen.place(&Vector2::new(shape.x, shape.y)).push(0.0),
            along: seen.outward(&Vector2::new(cos, sin)).push(0.0),
        }
    };
    let sections = sheet.sections(&at.q, &places)?;
    Some(sections.into_iter().map(mark).collect())
}

/// The room of a rod with touches; `obstacles` has the obstacle of each surface, `unfollowed` the other obstacles.
fn touched_rod_gap<'a>(
    sheet: &'a TouchedSheet,
    obstacles: Arc<[usize]>,
    unfollowed: Arc<[usize]>,
    bodies: &'a Bodies,
    body: &'a PointMass<2>,
) -> RodGap<'a, 2> {
    Box::new(move |at: &Phase<2>, by: GapBy| {
        let mut least = RodTouch::FAR;
        if by == GapBy::Reach {
            // A rod that touches an obstacle is always near.
            least.gap = f64::NEG_INFINITY;
            return least;
        }
        for room in sheet.rooms(&at.q).unwrap_or_default() {
            let bound = room.bound.into();
            let gap = match bound {
                RodBound::Release => room.left * SOFT,
                _ => room.left,
            };
            let obstacle = obstacles[room.surface];
            if by.looks_at(bound, obstacle) && gap < least.gap {
                least = RodTouch {
                    bound,
                    obstacle,
                    s: room.s,
                    gap,
                    ..least
                };
            }
        }
        let looked_at = |k: &usize| unfollowed.contains(k) && by.looks_at(RodBound::Touch, *k);
        if unfollowed.iter().any(looked_at)
            && let Some(marks) = marks(sheet, body, at)
        {
            let gaps = bodies.gaps_of_rod(0, at.t).filter(|(k, _)| looked_at(k));
            let near = nearest_place(&marks, gaps, [0.0, 1.0]);
            if let Some(near) = near.filter(|near| near.gap < least.gap) {
                least = RodTouch {
                    obstacle: near.obstacle,
                    s: near.s,
                    gap: near.gap,
                    ..RodTouch::FAR
                };
            }
        }
        least
    })
}

impl<'a> TouchingRun<'a> {
    /// The run `free` among its obstacles. The rod starts without touches.
    pub fn new(
        free: Run<'a, Elastica, 2>,
        body: &'a PointMass<2>,
        obstacles: AmongObstacles<'a>,
        options: Options,
    ) -> Self {
        let touched = obstacles.bodies.gaps_of_rod(0, 0.0);
        let (mut numbers, mut surfaces, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for (obstacle, _) in touched {
            match followed(obstacles.bodies, obstacle) {
                Some(surface) => {
                    numbers.push(obstacle);
                    surfaces.push(surface);
                }
                None => others.push(obstacle),
            }
        }
        Self {
            body,
            obstacles,
            options,
            rod: rod_among(surfaces, body),
            surfaces: numbers.into(),
            unfollowed: others.into(),
            given: free.given(),
            stage: Stage::Free(Box::new(free)),
            events: VecDeque::new(),
            at_once: (f64::NEG_INFINITY, 0),
            interrupted: false,
            stopped: false,
        }
    }

    /// The room of the rod on a sheet with touches.
    fn room_on(&self, sheet: &'a TouchedSheet) -> RodGap<'a, 2> {
        let (surfaces, others) = (self.surfaces.clone(), self.unfollowed.clone());
        touched_rod_gap(sheet, surfaces, others, self.obstacles.bodies, self.body)
    }

    fn phase(&self) -> Phase<2> {
        match &self.stage {
            Stage::Free(run) => run.now().phase,
            Stage::Touched(run) => run.now().phase,
        }
    }

    fn stop(&mut self, outcome: Outcome) -> Event {
        self.stopped = true;
        Event::Stop(outcome)
    }

    /// The end of a run whose rod with touches cannot be followed.
    fn lost(&mut self, why: Error) -> Event {
        let cause = Cause::Failed(why.context("the contact of the rod with an obstacle"));
        let remedy = "change the obstacles or the start a little";
        self.stop(Outcome::stuck(self.phase().t, cause, remedy))
    }

    /// The touches of the rod now, as a guess.
    fn touches(&self) -> Result<ContactGuess> {
        match &self.stage {
            Stage::Touched(run) => {
                let guess = run.manifold.guess(&run.now().phase.q);
                guess.ok_or_else(|| Error::no_convergence("a rod with touches has left its chart"))
            }
            Stage::Free(run) => {
                let q = run.now().phase.q;
                let rod = Equilibrium::new(q[0], q[1])?;
                let seen = frame(self.body, 0.0);
                let force = -seen.outward(&Vector2::from(rod.force));
                let couple = Vector3::z() * rod.section(0.0)?.curvature;
                Ok(ContactGuess {
                    base: join(&couple, &force.push(0.0)),
                    touches: Vec::new(),
                })
            }
        }
    }

    /// The surface of the rod that an obstacle is.
    fn surface_of(&self, obstacle: usize) -> Result<usize> {
        let found = self.surfaces.iter().position(|of| *of == obstacle);
        found.ok_or_else(|| {
            Error::no_convergence("the rod touches an obstacle that the rod passes through")
        })
    }

    /// True if the touch of an obstacle, beside others, is followed.
    fn can_touch(&self, obstacle: usize, others: usize) -> bool {
        let slides = self.obstacles.bodies.friction_of(obstacle) == 0.0;
        let follows = self.rod.is_some() && self.surfaces.contains(&obstacle);
        follows && slides && others < MAX_AT_ONCE
    }

    /// The touches beyond a bound; None if the rod is not followed there.
    fn beyond(&self, bound: &RodTouch) -> Result<Option<Next>> {
        let mut guess = self.touches()?;
        match bound.bound {
            RodBound::Touch if self.can_touch(bound.obstacle, guess.touches.len()) => {
                guess.touches.push(GuessedTouch {
                    surface: self.surface_of(bound.obstacle)?,
                    s: Some(bound.s),
                    reaction: 0.0,
                    length: 0.0,
                });
                Ok(Some(Next::Touches(guess)))
            }
            RodBound::Release => {
                let surface = self.surface_of(bound.obstacle)?;
                let own = |touch: &GuessedTouch| touch.surface == surface;
                let apart = |touch: &GuessedTouch| (touch.s.unwrap_or(1.0) - bound.s).abs();
                let near = (0..guess.touches.len())
                    .filter(|i| own(&guess.touches[*i]))
                    .min_by(|i, j| apart(&guess.touches[*i]).total_cmp(&apart(&guess.touches[*j])));
                let gone = || Error::no_convergence("the touch that releases was lost");
                guess.touches.remove(near.ok_or_else(gone)?);
                if guess.touches.is_empty() {
                    return Ok(Some(Next::Free(self.released_chart_point()?)));
                }
                Ok(Some(Next::Touches(guess)))
            }
            _ => Ok(None),
        }
    }

    /// The chart point of the elastica in the shape of a rod whose last reaction is zero.
    fn released_chart_point(&self) -> Result<Vector2<f64>> {
        let lost = || Error::no_convergence("the free rod was not found");
        let Stage::Touched(run) = &self.stage else {
            return Err(lost());
        };
        let now = run.now();
        let sections = run
            .manifold
            .sections(&now.phase.q, &[1.0])
            .ok_or_else(lost)?;
        let end = sections.first().ok_or_else(lost)?;
        free_chart_point(&-end.force, end.shape.theta, &now.pose)
    }

    /// Hands over to the run on the sheet with the touches of `next`, with the velocity as it is.
    fn go_on(&mut self, next: Next) -> Result<()> {
        let phase = self.phase();
        let pose = match &self.stage {
            Stage::Free(run) => run.now().pose,
            Stage::Touched(run) => run.now().pose,
        };
        let stage = match next {
            Next::Free(q) => {
                let rod = free_rod_gap(self.obstacles, self.body);
                let (body, options) = (self.body, self.options);
                let phase = Phase { q, ..phase };
                let run = Run::taken_over(&Elastica, body, phase, options, self.hand_over(), rod)?;
                Stage::Free(Box::new(run))
            }
            Next::Touches(guess) => {
                let none = || Error::domain("the rod touches no obstacle here");
                let among = Arc::clone(self.rod.as_ref().ok_or_else(none)?);
                let sheet = TouchedSheet::new(among, &guess, &pose)?;
                self.on_sheet(sheet, phase)?
            }
        };
        self.stage = stage;
        Ok(())
    }

    /// The run that takes over at the centre of a sheet.
    fn on_sheet(&mut self, sheet: TouchedSheet, phase: Phase<2>) -> Result<Stage<'a>> {
        let sheet = self.obstacles.bodies.sheets.add(sheet);
        let (body, options) = (self.body, self.options);
        let phase = Phase {
            q: Vector2::zeros(),
            ..phase
        };
        let rod = self.room_on(sheet);
        let run = Run::taken_over(sheet, body, phase, options, self.hand_over(), rod)?;
        Ok(Stage::Touched(Box::new(run)))
    }

    fn hand_over(&mut self) -> HandedOver<'a, 2> {
        match &mut self.stage {
            Stage::Free(run) => run.hand_over(),
            Stage::Touched(run) => run.hand_over(),
        }
    }

    /// True if the reaction of a new touch, the last of the guess, grows while the body moves on.
    fn presses(&self, guess: &ContactGuess) -> Result<bool> {
        let Some(among) = &self.rod else {
            return Ok(false);
        };
        let now = match &self.stage {
            Stage::Free(run) => run.now(),
            Stage::Touched(run) => run.now(),
        };
        let sheet = TouchedSheet::new(Arc::clone(among), guess, &now.pose)?;
        let rates = sheet.reaction_rates(&Vector2::zeros(), &now.phase.v);
        Ok(rates.is_some_and(|rates| rates.last().is_some_and(|rate| *rate > 0.0)))
    }

    /// Passes a bound: the event, or the end of the run.
    fn pass(&mut self, at: RodTouch) -> Event {
        match self.passed(at) {
            Ok(Passed::Through(event)) => Event::RodContact(*event),
            Ok(Passed::Ends(bound)) => self.stop(Outcome::RodTouch(RodTouch { bound, ..at })),
            Err(why) => {
                let cause = Cause::Failed(why.context("the contact of the rod with an obstacle"));
                let outcome = Outcome::stuck(
                    self.phase().t,
                    cause,
                    "change the obstacles or the start a little, or write rods = \"none\" in [contact]",
                );
                self.stop(outcome)
            }
        }
    }

    fn passed(&mut self, bound: RodTouch) -> Result<Passed> {
        let t = self.phase().t;
        self.at_once = match self.at_once {
            (last, count) if t <= last => (last, count + 1),
            _ => (t, 0),
        };
        if self.at_once.1 > CHANGES {
            return Err(Error::no_convergence(
                "the rod touches obstacles and leaves them again and again at one moment",
            ));
        }
        let Some(next) = self.beyond(&bound)? else {
            return Ok(Passed::Ends(bound.bound));
        };
        let change = match &next {
            Next::Touches(guess) if bound.bound == RodBound::Touch => {
                if !self.presses(guess)? {
                    return Ok(Passed::Ends(RodBound::Corner));
                }
                RodContactChange::Touch
            }
            _ => RodContactChange::Release,
        };
        let before = self.touch_near(&bound);
        self.go_on(next)?;
        let at = match change {
            RodContactChange::Touch => self.touch_near(&bound),
            RodContactChange::Release => before,
        };
        let lost = || Error::no_convergence("the touch at an event was lost");
        let mut at = at.ok_or_else(lost)?;
        // Zero up to the error of the event's place.
        at.normal_force = at.normal_force.max(0.0);
        Ok(Passed::Through(Box::new(RodContactEvent { t, change, at })))
    }

    /// The touch nearest to a bound on the present sheet.
    fn touch_near(&self, bound: &RodTouch) -> Option<crate::contact::RodContactNow> {
        let Stage::Touched(run) = &self.stage else {
            return None;
        };
        let touches = run.manifold.touches(&run.now().phase.q)?;
        let surface = self.surface_of(bound.obstacle).ok()?;
        let own = touches.iter().filter(|at| at.surface == surface);
        let near = own.min_by(|a, b| {
            let apart = |s: f64| (s - bound.s).abs();
            apart(a.s).total_cmp(&apart(b.s))
        });
        near.map(|at| contact_of(at, &self.surfaces))
    }

    /// A bound that has been passed already at the start of a sheet, as when two touches close at one time.
    fn passed_at_once(&self) -> Option<RodTouch> {
        let Stage::Touched(run) = &self.stage else {
            return None;
        };
        let gap = self.room_on(run.manifold);
        let least = gap(&run.now().phase, GapBy::Shape);
        (least.gap <= TOUCHES).then_some(least)
    }

    /// The obstacle that a free rod enters in its fall to the landing of the viscous layer.
    fn met_in_fall(&self, snap: &Snap) -> Option<RodTouch> {
        let (bodies, seen) = (self.obstacles.bodies, frame(self.body, snap.t));
        let mut least = RodTouch {
            bound: RodBound::Landing,
            gap: TOUCHES,
            ..RodTouch::FAR
        };
        for (_, sections) in snap.fall()? {
            let last = sections.len().saturating_sub(1).max(1) as f64;
            // Clamp and body hold the ends.
            for (k, at) in sections.iter().enumerate().take(last as usize).skip(1) {
                let x = seen.place(&at.translation.vector.xy());
                for (obstacle, distance) in bodies.gaps_of_rod(0, snap.t) {
                    let gap = distance(&x.push(0.0)).value;
                    if gap < least.gap {
                        let s = k as f64 / last;
                        least = RodTouch {
                            obstacle,
                            s,
                            gap,
                            ..least
                        };
                    }
                }
            }
        }
        (least.gap < TOUCHES).then_some(least)
    }

    /// Goes on in a chart about the present state, if the motion has come far from the centre of the present one.
    fn centre(&mut self) -> Result<()> {
        self.centre_if(|sheet, q| sheet.is_left(q)).map(drop)
    }

    /// Goes on in a chart about the present state if the motion has left the centre of a chart where steps collapse:
    /// a chart may end far before its edge where the equilibria bend sharply, as near a fold. True if so.
    fn centre_after(&mut self, outcome: &Outcome) -> Result<bool> {
        match outcome {
            Outcome::Stuck(stuck) if is_collapse(stuck) => {
                self.centre_if(|_, q| q.norm() > NEAR_CENTRE)
            }
            _ => Ok(false),
        }
    }

    /// The outcome with the remedy for a rod with touches, where steps have collapsed.
    fn taut(&self, outcome: Outcome) -> Outcome {
        match (&self.stage, outcome) {
            (Stage::Touched(_), Outcome::Stuck(stuck)) if is_collapse(&stuck) => Outcome::stuck(
                stuck.at,
                stuck.cause,
                "a rod that is pulled taut over an obstacle is followed up to forces of some 100 B/L^2: pull less, or move the obstacle",
            ),
            (_, outcome) => outcome,
        }
    }

    fn centre_if(&mut self, wanted: impl Fn(&TouchedSheet, &Vector2<f64>) -> bool) -> Result<bool> {
        let Stage::Touched(run) = &self.stage else {
            return Ok(false);
        };
        let now = run.now();
        if !wanted(run.manifold, &now.phase.q) {
            return Ok(false);
        }
        let sheet = run.manifold.about(&now.phase.q, now.index)?;
        self.stage = self.on_sheet(sheet, now.phase)?;
        Ok(true)
    }
}

/// The chart point of the elastica with its end at `pose`, near the equilibrium with this force on the body and this
/// angle of the tangent at the end.
fn free_chart_point(force: &Vector2<f64>, angle: f64, pose: &Vector2<f64>) -> Result<Vector2<f64>> {
    let psi = angle - force.y.atan2(force.x);
    let psi = psi.sin().atan2(psi.cos());
    let near = Equilibrium::from_lambda_kappa(force.norm().sqrt(), (0.5 * psi).sin())?;
    let near = Vector2::new(near.p, near.w);
    Ok(invert_near(&Elastica, pose, &near, PLACE)?.q)
}

fn is_collapse(stuck: &Stuck) -> bool {
    matches!(stuck.cause, Cause::StepCollapsed { .. })
}

impl<'a> Motion<'a> for TouchingRun<'a> {
    fn advance(&mut self) -> Option<Event> {
        if let Some(event) = self.events.pop_front() {
            self.stopped |= matches!(event, Event::Stop(_));
            return Some(event);
        }
        if self.stopped {
            return None;
        }
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        if let Err(why) = self.centre() {
            return Some(self.lost(why));
        }
        let event = match &mut self.stage {
            Stage::Free(run) => run.next(),
            Stage::Touched(run) => run.next(),
        }?;
        match event {
            Event::Stop(Outcome::RodTouch(bound)) => {
                let event = self.pass(bound);
                if !self.stopped
                    && let Some(bound) = self.passed_at_once()
                {
                    let next = self.pass(bound);
                    self.events.push_back(next);
                }
                Some(event)
            }
            Event::Stop(outcome) => match self.centre_after(&outcome) {
                Ok(true) => self.advance(),
                Ok(false) => {
                    let outcome = self.taut(outcome);
                    Some(self.stop(outcome))
                }
                Err(why) => Some(self.lost(why)),
            },
            Event::Snap(snap) => {
                let met = self.met_in_fall(&snap);
                self.events
                    .extend(met.map(|at| Event::Stop(Outcome::RodTouch(at))));
                Some(Event::Snap(snap))
            }
            event => Some(event),
        }
    }

    fn given(&self) -> StateRef<'_> {
        StateRef::Kept(&self.given)
    }

    fn now(&self) -> StateRef<'_> {
        match &self.stage {
            Stage::Free(run) => StateRef::Made(Box::new(run.now())),
            Stage::Touched(run) => StateRef::Made(Box::new(TouchedSample::new(
                run.manifold,
                run.now(),
                &self.surfaces,
            ))),
        }
    }

    fn before_snap(&self) -> Option<StateRef<'_>> {
        match &self.stage {
            Stage::Free(run) => Motion::before_snap(&**run),
            Stage::Touched(_) => None,
        }
    }

    fn sample(&mut self, t: f64) -> Option<StateRef<'_>> {
        match &mut self.stage {
            Stage::Free(run) => Motion::sample(&mut **run, t),
            Stage::Touched(run) => {
                let sample = run.sample(t)?;
                Some(StateRef::Made(Box::new(TouchedSample::new(
                    run.manifold,
                    sample,
                    &self.surfaces,
                ))))
            }
        }
    }

    fn renew(&mut self) -> Result<()> {
        match &mut self.stage {
            Stage::Free(run) => run.see_loads_anew(),
            Stage::Touched(run) => run.see_loads_anew(),
        }
    }

    fn duration(&self) -> f64 {
        self.options.duration
    }

    fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn cost(&self) -> Cost {
        match &self.stage {
            Stage::Free(run) => run.cost(),
            Stage::Touched(run) => run.cost(),
        }
    }

    fn carries(&self) -> Vec<StateVariables> {
        StateVariables::some([
            ("chart of the sheet", 2),
            ("velocity of the body", 2),
            ("time, work and loss to drag", 3),
        ])
    }
}
