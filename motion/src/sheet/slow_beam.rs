//! Glides: motions next to, and through, a state onto which the chart collapses, of a body that does not shake.
//!
//! An example is a mass at the straight rod let go without a push along it. Its distance from the circle of
//! full reach is slaved to the deflection (theory 2.3), and what is left is a beam's equation,
//! ```text
//! m y'' = f_y - k(N) y,   1 - x = c(N) y^2,   N = f_x + m (c y^2)''
//! ```
//! up to terms of order d^3 at the distance d: smooth, with a period of order 1, and regular at y = 0, where
//! the rod is straight. A rod whose mass is followed takes part in the motion across (theory 2.9): see
//! [`beam_with_mass`](super::beam_with_mass).

use super::Phase;
use crate::locate::first_change;
use crate::options::LOCAL;
use nalgebra::SVector;
use snaprod_systems::body::{EndMotion, PointMass};
use snaprod_systems::manifold::{
    AxialConstraint, DeflectionInertia, DeflectionState, FirstOrderInertia, Multivalued, Patch,
};
use snaprod_systems::solve::dop853::{Dense, Dop853, Step};
use snaprod_systems::solve::roots::chandrupatla;

/// Largest speed of a shaking that counts as none, as a part of the size of the motion (distance or speed).
const STILL: f64 = 1e-4;
/// Largest relative difference of 1 - x from its slaved value in a glide.
const SLAVED: f64 = 1e-3;
/// Velocity scale below which the shaking has periods lost in the digits of time itself: leaving it out loses
/// no known digit.
const HAIR: f64 = 3e-12;
/// Time increment of the differences that give the rate of the pull.
const BRIEF: f64 = 1e-5;
/// Hysteresis: ratio of the distances at which a glide is left and entered.
const BEYOND: f64 = 2.0;

/// A body and its rod.
#[derive(Clone, Copy)]
pub(super) struct Gliding<'a, M, const N: usize> {
    pub manifold: &'a M,
    pub body: &'a PointMass<N>,
    /// The mass of the rod; None if it is not followed.
    pub rod: Option<&'a dyn FirstOrderInertia<N>>,
}

/// The rod and the body at one moment.
pub(super) struct BeamMoment<const N: usize> {
    pub rod: AxialConstraint<N>,
    /// Pull N and its rate.
    pub pull: f64,
    pub tightening: f64,
    /// Deflection y and its rate y'.
    pub height: f64,
    pub speed: f64,
    pub action: EndMotion<N>,
    pub felt: Option<DeflectionInertia>,
}

impl<const N: usize> BeamMoment<N> {
    /// Acceleration y'' across the rod.
    pub fn rise(&self) -> f64 {
        self.action.acceleration.dot(&self.rod.across)
    }
}

/// The state a short `time` after `at`, to second order, with the acceleration `rise`.
pub(super) fn aside<const N: usize>(at: &Phase<N>, rise: &SVector<f64, N>, time: f64) -> Phase<N> {
    Phase {
        q: at.q + (at.v + rise * (0.5 * time)) * time,
        v: at.v + rise * time,
        t: at.t + time,
        ..*at
    }
}

/// The pull in balance with the body's motion, and the acceleration across under this pull.
struct PulledBeam {
    pull: f64,
    rise: f64,
}

/// A gliding motion in terms of the deflection: `q` and `v` of its states lie across the rod.
pub struct Glide<const N: usize> {
    solver: Dop853<Phase<N>>,
    last: Option<Step<Phase<N>>>,
    dense: Option<Dense<Phase<N>>>,
    farthest: f64,
    /// True if the motion has left the range of validity.
    over: bool,
}

impl<M: Multivalued<N>, const N: usize> Gliding<'_, M, N> {
    /// The pull slaved to the deflection `at`; None outside the range of validity.
    fn pulled(&self, at: &Phase<N>) -> Option<PulledBeam> {
        let mass = self.body.mass();
        let straight = self.manifold.axial_constraint(0.0)?;
        let (height, speed) = (at.q.dot(&straight.across), at.v.dot(&straight.across));
        let (pose, v) = (
            straight.pose + straight.across * height,
            straight.across * speed,
        );
        let free = self.body.action(at.t, &pose, &v, &SVector::zeros());
        let load = mass * free.acceleration.dot(&straight.along);
        let rod = self.manifold.axial_constraint(load)?;
        let rise = free.acceleration.dot(&rod.across) - rod.stiffness * height / mass;
        let pull = load + 2.0 * mass * rod.shortening * (speed * speed + height * rise);
        Some(PulledBeam { pull, rise })
    }

    /// N' and N'' at the deflection `at`, whose acceleration is `rise`. Next to a break of the loads N' is
    /// one-sided and N'' is 0.
    fn rates(&self, at: &Phase<N>, pull: f64, rise: &SVector<f64, N>) -> Option<[f64; 2]> {
        let aside = |time: f64| Some(self.pulled(&aside(at, rise, time))?.pull);
        let smooth = |t: f64| self.body.next_break(t) >= t + BRIEF;
        match (smooth(at.t - BRIEF), smooth(at.t)) {
            (true, false) => Some([(pull - aside(-BRIEF)?) / BRIEF, 0.0]),
            (false, true) => Some([(aside(BRIEF)? - pull) / BRIEF, 0.0]),
            _ => {
                let (before, after) = (aside(-BRIEF)?, aside(BRIEF)?);
                Some([
                    (after - before) / (2.0 * BRIEF),
                    (after - 2.0 * pull + before) / (BRIEF * BRIEF),
                ])
            }
        }
    }

    pub(super) fn moment(&self, at: &Phase<N>) -> Option<BeamMoment<N>> {
        let (body, mass) = (self.body, self.body.mass());
        let PulledBeam { pull, rise } = self.pulled(at)?;
        let rod = self.manifold.axial_constraint(pull)?;
        let (height, speed) = (at.q.dot(&rod.across), at.v.dot(&rod.across));
        let [tightening, tightened] = self.rates(at, pull, &(rod.across * rise))?;
        // m (c y^2)'' also has terms in N' and N''.
        let rates = 4.0 * tightening * speed + tightened * height;
        let pull = pull + mass * rod.softening * height * rates;
        let rod = self.manifold.axial_constraint(pull)?;
        let back = rod.shortening * height;
        let pose = rod.pose + rod.across * height - rod.along * (back * height);
        let v = rod.across * speed - rod.along * (2.0 * back * speed);
        let force = rod.along * -pull - rod.across * (rod.stiffness * height);
        let mut now = BeamMoment {
            pull,
            tightening,
            height,
            speed,
            action: body.action(at.t, &pose, &v, &force),
            felt: None,
            rod,
        };
        if let Some(rod) = self.rod {
            let frame = body.support().map(|support| support.at(at.t));
            let felt = rod.deflection_inertia(
                frame.as_ref(),
                &DeflectionState {
                    pull,
                    tightening,
                    height,
                    speed,
                },
            )?;
            let alone = now.rise();
            let rise = (mass * alone + felt.force) / (mass + felt.mass);
            now.action.acceleration += now.rod.across * (rise - alone);
            if let Some(frame) = frame {
                let borne = mass
                    * (rise - alone)
                    * frame.velocity_of_fixed_point(&pose).dot(&now.rod.across);
                now.action.power += borne + felt.pull * rise + felt.power;
            }
            now.felt = Some(felt);
        }
        Some(now)
    }

    fn slope(&self, at: &Phase<N>) -> Option<Phase<N>> {
        let now = self.moment(at)?;
        let [rise, shaking] = self.shaken(&now, at);
        Some(Phase {
            q: at.v,
            v: now.rod.across * rise + now.rod.along * shaking,
            t: 1.0,
            work: now.action.power,
            drag_loss: now.action.loss,
        })
    }

    /// Velocity along the rod that is slaved to the deflection and the loads.
    pub(super) fn slaved(now: &BeamMoment<N>) -> f64 {
        let AxialConstraint {
            shortening,
            softening,
            ..
        } = now.rod;
        -now.height * (2.0 * shortening * now.speed + softening * now.tightening * now.height)
    }

    /// The state `at` in a chart.
    pub fn charted(&self, at: &Phase<N>) -> Option<(Patch, Phase<N>)> {
        let now = self.moment(at)?;
        let (patch, q) = self.manifold.deflected_point(now.pull, now.height)?;
        let v = now.rod.across * now.speed + now.rod.along * Self::slaved(&now);
        Some((patch, Phase { q, v, ..*at }))
    }

    /// Begins a glide at the state `at` of the chart `patch`; None if the state is too far out or shakes.
    pub fn begin(&self, patch: Patch, at: &Phase<N>, tolerance: f64) -> Option<Glide<N>> {
        let farthest = tolerance.cbrt();
        if !(at.v.norm() < farthest) {
            return None;
        }
        let rod = self.manifold.axial_constraint(0.0)?;
        let point = self.manifold.point_in(patch, &at.q)?;
        let only_across = |v: &SVector<f64, N>| rod.across * v.dot(&rod.across);
        let start = Phase {
            q: only_across(&point.pose),
            v: only_across(&at.v),
            ..*at
        };
        let size = start.q.norm().max(start.v.norm());
        if !(size < farthest) {
            return None;
        }
        let now = self.moment(&start)?;
        // Energies of the shaking, over m/2: kinetic, and of the difference of the pull from the slaved one.
        let speed = at.v.dot(&rod.along) - Self::slaved(&now);
        let pull = -point.force.dot(&rod.along) - now.pull;
        let stored = -now.rod.softening * (now.height * pull).powi(2) / self.body.mass();
        let shaking = (speed * speed + stored).sqrt();
        // On the axis no pull stores energy in this measure: the pull itself has to be the slaved one.
        let slaved = (now.rod.softening * pull).abs() < SLAVED * now.rod.shortening;
        let all = (at.v.norm_squared() + 2.0 * point.energy / self.body.mass()).sqrt();
        // A shaking that is left out is an error of the whole run, not of every step.
        let unseen = (tolerance / LOCAL).min(STILL * size);
        if !(all < HAIR || slaved && shaking < unseen) {
            return None;
        }
        self.started(start, tolerance, BEYOND * farthest)
    }

    /// The glide from `start`, valid up to the distance `farthest`.
    pub(super) fn started(
        &self,
        start: Phase<N>,
        tolerance: f64,
        farthest: f64,
    ) -> Option<Glide<N>> {
        let slope = self.slope(&start)?;
        Some(Glide {
            solver: Dop853::new(start, slope, 1e-3, tolerance),
            last: None,
            dense: None,
            farthest,
            over: false,
        })
    }
}

impl<const N: usize> Glide<N> {
    /// The current state, by deflection.
    pub(super) fn state(&self) -> &Phase<N> {
        self.solver.state()
    }

    /// True if the motion has left the range of validity.
    pub(super) fn is_over(&self) -> bool {
        self.over
    }

    /// One step, at most to the time `end`; returns its state in a chart. None if no step could be taken.
    pub(super) fn step<M: Multivalued<N>>(
        &mut self,
        gliding: &Gliding<'_, M, N>,
        end: f64,
    ) -> Option<(Patch, Phase<N>)> {
        let from = *self.solver.state();
        if self.over || !(from.t < end) {
            return None;
        }
        let written = |y: &Phase<N>, out: &mut Phase<N>| {
            *out = gliding.slope(y)?;
            Some(())
        };
        let mut step = self.solver.blank();
        let remaining = (end - from.t).min(gliding.reach(&from)?);
        self.solver
            .step_measured(written, relative, remaining, &mut step)
            .ok()?;
        if step.h == end - from.t {
            step.to.t = end;
            self.solver.rewind(step.to, *step.end_slope());
        }
        self.over = match gliding.rod {
            Some(_) => gliding.leaves(&step.to)?,
            None => step.to.q.norm().max(step.to.v.norm()) > self.farthest,
        };
        if self.over && gliding.rod.is_some() {
            // Chart and glide differ by more than a tolerance in the same state. So the chart takes over at
            // the moment of the event, not at the end of a step.
            let dense = step.dense(|y| gliding.slope(y), &mut Default::default())?;
            let room = |at: &Phase<N>| match gliding.leaves(at) {
                Some(false) => 1.0,
                _ => -1.0,
            };
            if let Some(fraction) = first_change(|x| dense.at(x), 1, room) {
                let part = fraction * step.h;
                self.solver.rewind(from, gliding.slope(&from)?);
                (self
                    .solver
                    .step_measured(written, relative, part, &mut step))
                .ok()?;
                self.over = step.h == part;
            }
        }
        let charted = gliding.charted(&step.to)?;
        self.dense = None;
        self.last = Some(step);
        Some(charted)
    }

    /// The state at the time `t` within the last step, in a chart.
    pub(super) fn at<M: Multivalued<N>>(
        &mut self,
        gliding: &Gliding<'_, M, N>,
        t: f64,
    ) -> Option<(Patch, Phase<N>)> {
        let step = self.last.as_mut()?;
        let (from, to) = (step.from.t, step.to.t);
        if self.dense.is_none() {
            self.dense = step.dense(|y| gliding.slope(y), &mut Default::default());
        }
        let dense = self.dense.as_ref()?;
        let x = chandrupatla(|x| dense.at(x).t - t, (0.0, from - t), (1.0, to - t), 0.0)?;
        gliding.charted(&Phase { t, ..dense.at(x) })
    }

    /// Number of slopes evaluated.
    pub fn evaluations(&self) -> u64 {
        self.solver.cost().evaluations
    }
}

/// Mean square of the errors, relative to the size of the motion however small.
fn relative<const N: usize>(error: &Phase<N>, from: &Phase<N>, to: &Phase<N>) -> f64 {
    let size = |at: &Phase<N>| at.q.norm_squared() + at.v.norm_squared();
    let size = size(from).max(size(to)).max(f64::MIN_POSITIVE);
    let sum = (error.q.norm_squared() + error.v.norm_squared()) / size
        + error.t * error.t
        + error.work * error.work
        + error.drag_loss * error.drag_loss;
    sum / (2 * N + 1) as f64
}
