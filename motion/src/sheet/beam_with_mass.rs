//! Rods of small mass next to the straight one, whose mass is followed (theory 2.9).
//!
//! The equilibria that a rod with mass would stay on have no bounded pull where their end passes the axis: the rod's own inertia bends it across, by the
//! order of its mass, and the pull that this stands for differs from the body's own by a multiple of eps y''/y. But for the motion across that does not matter to
//! this order. So next to the straight rod the distance from the circle of full reach is slaved to the deflection, as in [`glide`](super::slow_beam), and the rod's
//! mass is part of the motion across. With u = y (N - f_x + x'') the rod is bent by w_N u beyond the beam under the body's pull, and its end is farther in by
//! c' y u, |c'| u^2/2 being stored. Most of u is slaved to inertia and weight; the rest, a shaking along the rod, is an oscillator of its own, as fast as the rod
//! vibrates where y^2 is small against its mass. States keep it, and its rate, as their component along the rod.

use super::slow_beam::{Glide, Gliding, Moment, aside};
use super::{Carried, OnSheet, Phase, rod_error, slope};
use crate::locate::changes;
use nalgebra::SVector;
use snaprod_systems::manifold::{Bending, Multivalued, Patch, RodMass};

/// Height of the end beyond which the chart takes over, and the one below which it ends.
const HEIGHT: [f64; 2] = [3e-3, 2e-3];
/// Part of |N| by which the pull of equilibria may differ from the body's own where the chart takes over, and that beyond which it ends.
const SHIFTED: [f64; 2] = [0.5, 1.0];
/// |N| above which it may take over there, and below which it ends: the global chart is polar about N = 0, where it loses digits of the rod's mass.
const SLACK: [f64; 2] = [0.3, 0.2];
/// Height at which the chart takes over in any case, and the one below which it may end.
const HIGHEST: [f64; 2] = [0.016, 0.012];
/// Height from which on a rod is no longer next to the straight one, however it shakes.
const FARTHEST: f64 = 0.024;
/// Places within a step at which it is looked whether a rod is next to the straight one.
const PLACES: u32 = 16;
/// How far within its bound, of numbers of size 1, a motion that shakes there at both ends of a step does so all along.
const WITHIN: f64 = 0.5;
/// How far, of numbers of size 1, the state in which a step was ended where it comes near, or away, may be from there: what is found on the step's interpolant is
/// made again by a shorter step.
const FOUND_NEAR: f64 = 1e-2;
/// Shaking by more than this part of 1 + |N| is no linear one.
const SHAKEN: f64 = 10.0;
/// Time over which the rates of what the rod's own inertia does are measured.
const SOON: f64 = 1e-4;
/// How well the pull is found with which it does.
const FOUND: f64 = 1e-8;

/// A moment of a rod bent by its own inertia.
struct Shifted<const N: usize> {
    now: Moment<N>,
    /// What the pull of equilibria is beyond the body's own, and the most that its slaved part and its shaking are of that.
    more: f64,
    apart: [f64; 2],
    /// What 1 - x is larger by, and the rate of it.
    missing: f64,
    shortening: f64,
}

/// A state of the chart, and how far it is from a motion next to the straight rod. Numbers are positive before what they tell of, and of size 1.
struct Beside<const N: usize> {
    /// From the end of the straight rod.
    distance: f64,
    /// Before it is near, ...
    far: f64,
    /// ... while it shakes too hard, ...
    shaking: f64,
    /// ... and as long as the chart serves there.
    steady: f64,
    /// The state by deflection and shaking.
    start: Phase<N>,
    /// What of its distance is shaking.
    apart: f64,
}

/// What a motion is to do with the mass of its rod, next to the straight one.
pub enum Passage<const N: usize> {
    /// Nothing: it is not there, or not to pass by.
    None,
    /// It shakes so hard that the mass is to be left out.
    Shakes,
    /// It goes on as a beam with its mass.
    Glides(Box<Glide<N>>),
}

/// How near a motion is to the straight rod.
pub struct Nearness<const N: usize> {
    /// From its end; 0 where that cannot be told.
    pub distance: f64,
    /// What it is to do there.
    pub passage: Passage<N>,
}

impl<const N: usize> Beside<N> {
    /// Positive as long as it neither begins nor shakes, or, of one that `shakes`, as long as it is near.
    fn room(&self, shakes: bool) -> f64 {
        match shakes {
            true => -self.far,
            false => self
                .far
                .max((-self.shaking).min(self.shaking.max(self.steady))),
        }
    }
}

impl<M: Multivalued<N>, const N: usize> Gliding<'_, M, N> {
    /// The moment `at`, and u: what of the rod's own inertia bends it, y times the pull of equilibria beyond the body's own, if that follows at once.
    fn bent(&self, at: &Phase<N>) -> Option<(Moment<N>, f64)> {
        let now = self.moment(at)?;
        let Bending { by_rise, rest, .. } = now.felt?.bending;
        let bent = (by_rise * now.rise() + rest) / now.rod.softening;
        Some((now, bent))
    }

    /// The same, with its own inertia: m b u'' + |c'| u is what bends it.
    fn shifted(&self, at: &Phase<N>) -> Option<Shifted<N>> {
        let (now, bent) = self.bent(at)?;
        let rise = now.rod.across * now.rise();
        let aside = |time: f64| Some(self.bent(&aside(at, &rise, time))?.1);
        let (before, after) = (aside(-SOON)?, aside(SOON)?);
        let second = (after - 2.0 * bent + before) / (SOON * SOON);
        let (shaken, shaking) = (at.q.dot(&now.rod.along), at.v.dot(&now.rod.along));
        let slaved = bent + now.felt?.bending.inertia / now.rod.softening * second;
        let rate = (after - before) / (2.0 * SOON) + shaking;
        let bent = slaved + shaken;
        let (softening, lever) = (now.rod.softening, self.lever(&now));
        let mass = now.felt?.bending.inertia + lever * now.height;
        let swing = (shaken * shaken - shaking * shaking * mass / softening).sqrt();
        Some(Shifted {
            more: bent / now.height,
            apart: [slaved.abs(), swing].map(|bent| bent / now.height.abs()),
            missing: now.rod.softening * bent * now.height,
            shortening: now.rod.softening * (bent * now.speed + rate * now.height),
            now,
        })
    }

    /// mu c'^2 y, by which the body takes part in a shaking.
    fn lever(&self, now: &Moment<N>) -> f64 {
        self.body.mass() * now.rod.softening.powi(2) * now.height
    }

    /// y'' and u'' where the rod shakes: m int (w y' + w_N u')^2 ds/2 is its energy of motion, mu ((c' y u)')^2/2 that of the body along it, and |c'| u^2/2 is
    /// stored.
    pub(super) fn shaken(&self, now: &Moment<N>, at: &Phase<N>) -> [f64; 2] {
        let (u, rate) = (at.q.dot(&now.rod.along), at.v.dot(&now.rod.along));
        let Some(felt) = now.felt.filter(|_| (u, rate) != (0.0, 0.0)) else {
            return [now.rise(), 0.0];
        };
        let (c, softening) = (now.rod.shortening, now.rod.softening);
        let (all, bending) = (self.body.mass() + felt.mass, felt.bending);
        let lever = self.lever(now);
        let held = lever * (2.0 * now.speed * rate + now.rise() * u) - softening * u;
        let inertia = bending.inertia + lever * now.height - bending.by_rise.powi(2) / all;
        let shaking = -held / inertia;
        let inward = now.rise() * u + 2.0 * now.speed * rate + now.height * shaking;
        let push = bending.by_rise * shaking + 2.0 * c * lever / softening * inward;
        [now.rise() - push / all, shaking]
    }

    /// True if the chart is to take over at the deflection `at`.
    pub(super) fn leaves(&self, at: &Phase<N>) -> Option<bool> {
        let Shifted { now, apart, .. } = self.shifted(at)?;
        let height = now.height.abs();
        let outward = now.height * now.speed >= 0.0;
        let calm = apart[0] + apart[1] < SHIFTED[0] * now.pull.abs() && now.pull.abs() > SLACK[0];
        Some(outward && (height > HIGHEST[0] || height > HEIGHT[0] && calm))
    }

    /// The longest step at the deflection `at`: not far beyond where the chart takes over.
    pub(super) fn reach(&self, at: &Phase<N>) -> Option<f64> {
        if self.rod.is_none() {
            return Some(f64::INFINITY);
        }
        let across = self.manifold.held(0.0)?.across;
        let [height, speed] = [at.q, at.v].map(|of| of.dot(&across).abs());
        Some((0.1 * HIGHEST[0] + (HIGHEST[0] - height).max(0.0)) / speed)
    }

    /// How far the state `at` in the chart `patch` is from a motion next to the straight rod, of one that `shakes` how far it is from there alone. None where that cannot be told.
    fn beside(
        &self,
        (patch, at): (Patch, &Phase<N>),
        (followed, shakes): (bool, bool),
    ) -> Option<Beside<N>> {
        let straight = self.manifold.held(0.0)?;
        let point = self.manifold.point_in(patch, &at.q)?;
        let off = point.pose - straight.pose;
        let distance = off.norm();
        let far = distance.max(off.dot(&straight.along).abs() / distance) / FARTHEST - 1.0;
        if shakes || !(far < 1.0) {
            return Some(Beside {
                distance,
                far,
                shaking: -1.0,
                steady: 1.0,
                start: *at,
                apart: 0.0,
            });
        }
        let only_across = |v: &SVector<f64, N>| straight.across * v.dot(&straight.across);
        let mut start = Phase {
            q: only_across(&off),
            v: only_across(&at.v),
            ..*at
        };
        let Shifted {
            now,
            missing,
            shortening,
            ..
        } = self.shifted(&start)?;
        // The chart's motion without the rod's mass has the body's own pull.
        let (missing, shortening) = if followed {
            (missing, shortening)
        } else {
            (0.0, 0.0)
        };
        // What is beyond that shakes: c' y u, and the rate of it.
        let along = |pose: &SVector<f64, N>| pose.dot(&now.rod.along);
        let (_, beam) = self.placed(now.pull, now.height)?;
        let farther = beam - along(&point.pose) - missing;
        let rate = Self::slaved(&now) - along(&at.v) - shortening;
        let softened = now.rod.softening * now.height;
        let shaken = farther / softened;
        let shaking = (rate / now.rod.softening - now.speed * shaken) / now.height;
        start.q += now.rod.along * shaken;
        start.v += now.rod.along * shaking;
        let Shifted { apart, .. } = self.shifted(&start)?;
        let (pull, height) = (now.pull.abs(), now.height.abs());
        let unsteady = ((apart[0] + apart[1]) / (SHIFTED[1] * pull)).max(SLACK[1] / pull);
        let low = (1.0 - unsteady).max(height / HIGHEST[1] - 1.0);
        Some(Beside {
            distance,
            far,
            shaking: apart[1] / (SHAKEN * (1.0 + pull)) - 1.0,
            steady: low.min(height / HEIGHT[1] - 1.0),
            start,
            apart: (softened * apart[1] * now.height).abs() / distance.powi(2),
        })
    }

    /// What a motion with the mass of the rod is to do at `beside`. One that `shakes` does so until it is far: it seems calm for a moment wherever it is turned round.
    fn passage(
        &self,
        beside: &Beside<N>,
        (shakes, at_edge): (bool, bool),
        tolerance: f64,
    ) -> Passage<N> {
        let slack = if at_edge { FOUND_NEAR } else { 0.0 };
        // What is all but at its bound there has just come to it.
        let near = beside.far < if shakes { -slack } else { slack };
        if near && (shakes || !(beside.shaking < -slack)) {
            return Passage::Shakes;
        }
        if !(near && beside.steady < slack) {
            return Passage::None;
        }
        let Some(across) = self.manifold.held(0.0).map(|straight| straight.across) else {
            return Passage::None;
        };
        let mut start = beside.start;
        if beside.apart < tolerance {
            (start.q, start.v) = (across * start.q.dot(&across), across * start.v.dot(&across));
        }
        (self.started(start, tolerance, f64::INFINITY))
            .map_or(Passage::Shakes, |glide| Passage::Glides(Box::new(glide)))
    }

    /// The equilibrium under `pull` with its end at the height `height`: its place in the global chart, and that of its end along the rod.
    fn placed(&self, pull: f64, height: f64) -> Option<(SVector<f64, N>, f64)> {
        let along = self.manifold.held(0.0)?.along;
        let (patch, q) = self.manifold.beside(pull, height)?;
        let q = self.manifold.carried(&q, patch, Patch::Global);
        Some((q, self.manifold.point(&q)?.pose.dot(&along)))
    }

    /// The state with which the chart takes over at the deflection `at`: a mass let go with the body's own pull would shake along the rod. With a pull beyond that
    /// by u/y, 1 - x is larger by c' u y. None if there is no such state.
    fn handed_over(&self, at: &Phase<N>) -> Option<Phase<N>> {
        let Shifted {
            now,
            more,
            missing,
            shortening,
            ..
        } = self.shifted(at)?;
        let (_, beam) = self.placed(now.pull, now.height)?;
        let (mut before, mut more) = ((0.0, -missing), more);
        for _ in 0..30 {
            let (q, end) = self.placed(now.pull + more, now.height)?;
            let gap = beam - end - missing;
            let step = -gap * (more - before.0) / (gap - before.1);
            if !(step.abs() > FOUND * (1.0 + more.abs())) {
                let v =
                    now.rod.across * now.speed + now.rod.along * (Self::slaved(&now) - shortening);
                return Some(Phase { q, v, ..*at });
            }
            before = (more, gap);
            more += step;
        }
        None
    }
}

impl<'a, M: Multivalued<N>, const N: usize> OnSheet<'a, M, N> {
    fn with_mass(&self, rod: &'a dyn RodMass<N>) -> Gliding<'a, M, N> {
        Gliding {
            rod: Some(rod),
            ..self.gliding()
        }
    }

    /// Where the motion is from the straight rod, and what it is to do there with the mass of `rod`. `followed` tells whether it has felt that mass until now, `shakes`
    /// whether it has shaken too hard for that, `at_edge` whether its last step was ended because either changes there.
    pub fn nears_straight(
        &self,
        rod: &'a dyn RodMass<N>,
        (followed, shakes): (bool, bool),
        at_edge: bool,
    ) -> Nearness<N> {
        let at = (self.patch, self.solver.state());
        let motion = self.with_mass(rod);
        let beside = motion.beside(at, (followed, shakes));
        Nearness {
            distance: beside.as_ref().map_or(0.0, |beside| beside.distance),
            passage: beside.map_or(Passage::None, |beside| {
                motion.passage(&beside, (shakes, at_edge), self.tolerance)
            }),
        }
    }

    /// Ends the last step where the motion next to the straight rod should begin, or, of one that `shakes` there, where that is over, if that is within it: what the
    /// motions with and without the rod's mass, and in the chart and beside it, make of the same state differs by more than a tolerance, so that it must not be where
    /// a step happens to end. The step began at `distance` from the end of the straight rod. False where it stays as it is.
    pub fn ends_at_straight(
        &mut self,
        rod: &'a dyn RodMass<N>,
        (followed, shakes): (bool, bool),
        distance: f64,
    ) -> bool {
        let goes_on = match shakes {
            true => self.stays_near(rod),
            false => !self.comes_near(distance),
        };
        if goes_on {
            return false;
        }
        let inside = self.inside();
        let fraction = inside.and_then(|inside| {
            let motion = self.with_mass(rod);
            changes(inside, PLACES, |at| {
                let beside = motion.beside((Patch::Global, at), (followed, shakes));
                beside.map_or(1.0, |beside| beside.room(shakes))
            })
        });
        fraction.is_some_and(|fraction| self.end_after(fraction))
    }

    /// True if the end of the rod may have come next to that of the straight one in the last step, which began at that distance from it.
    fn comes_near(&self, distance: f64) -> bool {
        self.last.as_ref().is_some_and(|step| {
            let (from, to) = (step.from(), step.to());
            let way = 2.0 * from.v.norm().max(to.v.norm()) * (to.t - from.t);
            distance < FARTHEST + way
        })
    }

    /// True if a motion that shakes next to the straight rod was well within where it does so at both ends of the last step.
    fn stays_near(&self, rod: &'a dyn RodMass<N>) -> bool {
        let motion = self.with_mass(rod);
        let well_within = |at: &Phase<N>| {
            let beside = motion.beside((Patch::Global, at), (false, true));
            beside.is_some_and(|beside| beside.room(true) > WITHIN)
        };
        (self.last.as_ref()).is_some_and(|step| well_within(step.from()) && well_within(step.to()))
    }

    /// Goes on by it, or None.
    pub fn go_straight(&mut self, rod: &'a dyn RodMass<N>, glide: Glide<N>) -> Option<()> {
        let (patch, charted) = self.with_mass(rod).charted(glide.state())?;
        let slope = slope(
            self.manifold,
            patch,
            self.body,
            None,
            self.orientation,
            &charted,
        )?;
        self.rod = Some(Carried {
            rod,
            error: rod_error(self.body, self.tolerance),
        });
        self.patch = patch;
        self.solver.rewind(charted, slope);
        self.dense = None;
        self.last = None;
        self.shaking.glide_by(glide);
        Some(())
    }

    /// True while the motion is one next to the straight rod with its mass.
    pub fn passes_straight(&self) -> bool {
        self.rod.is_some() && self.shaking.glides()
    }

    /// The state with which the chart takes over, where it should: none if it cannot with the mass of the rod.
    pub fn leaves_straight(&self) -> Option<Option<Phase<N>>> {
        let (_, glide) = (self.rod?, self.shaking.glide()?);
        glide
            .is_over()
            .then(|| self.gliding().handed_over(glide.state()))
    }

    /// Kinetic energy of the rod and its potential in a state next to the straight rod.
    pub fn energies_beside(&self, phase: &Phase<N>) -> Option<[f64; 2]> {
        let straight = self.manifold.held(0.0)?;
        let across = |v: SVector<f64, N>| straight.across * v.dot(&straight.across);
        let q = across(self.manifold.point(&phase.q)?.pose - straight.pose);
        let at = Phase {
            q,
            v: across(phase.v),
            ..*phase
        };
        Some(self.gliding().moment(&at)?.felt?.energies)
    }
}
