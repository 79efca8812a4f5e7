//! Passage of the straight configuration by a rod of small mass, the mass followed to first order (theory 2.9).
//!
//! The equilibria that a rod with mass would stay on have no bounded pull where their end passes the axis.
//! The rod's own inertia bends the rod across, by the order of its mass. The pull with the same bend differs
//! from the body's own by a multiple of eps y''/y. To this order the motion across does not feel that
//! difference. So next to the straight rod the distance from the circle of full reach is slaved to the
//! deflection, as in [`slow_beam`](super::slow_beam). The rod's mass is part of the motion across.
//!
//! With u = y (N - f_x + x'') the rod is bent by w_N u beyond the beam under the body's pull. Its end is
//! farther in by c' y u, and |c'| u^2/2 is stored. Most of u is slaved to inertia and weight. The rest is a
//! longitudinal oscillation ("shaking"), as fast as the rod vibrates where y^2 is small against its mass.
//! States keep this rest, and its rate, as their component along the rod.

use super::slow_beam::{BeamMoment, Glide, Gliding, aside};
use super::{FollowedMass, OnSheet, Phase, rod_error, slope};
use crate::locate::first_change;
use nalgebra::SVector;
use snaprod_systems::manifold::{BendingLoad, FirstOrderInertia, Multivalued, Patch};

/// Deflection |y| of the end above which the chart may take over, and below which its motion ends.
const DEFLECTION_LIMITS: [f64; 2] = [3e-3, 2e-3];
/// Difference between the pull of the equilibria and the body's own, as a part of |N|: below the first the
/// chart may take over, above the second its motion ends.
const SHIFTED: [f64; 2] = [0.5, 1.0];
/// Pull |N| above which the chart may take over, and below which its motion ends: the global chart is polar
/// about N = 0, and loses digits of the rod's mass there.
const PULL_LIMITS: [f64; 2] = [0.3, 0.2];
/// Deflection above which the chart takes over in any case, and below which its motion may end.
const HIGHEST: [f64; 2] = [0.016, 0.012];
/// Radius of the neighbourhood of the straight rod: farther out the rod is not next to it, whether or not it shakes.
const FARTHEST: f64 = 0.024;
/// Samples per step in the search for entry into the neighbourhood of the straight rod.
const PLACES: u32 = 16;
/// Margin in the event functions (of size 1): a shaking motion that has this margin at both ends of a step is
/// taken to stay inside throughout.
const WITHIN: f64 = 0.5;
/// Tolerance in the event functions (of size 1) for a step that was ended at an event: the event is found on
/// the interpolant, and the step to it is integrated again.
const EVENT_TOLERANCE: f64 = 1e-2;
/// Largest amplitude of the shaking in the pull, relative to 1 + |N|, for a linear oscillator.
const SHAKEN: f64 = 10.0;
/// Time increment of the differences that give the rates of the bend by the rod's own inertia.
const SOON: f64 = 1e-4;
/// Tolerance of the pull at a handover to the chart, relative to 1 + the pull's excess over the body's own.
const FOUND: f64 = 1e-8;

/// Present treatment of the rod's mass by a motion.
#[derive(Debug, Clone, Copy, Default)]
pub struct MassNow {
    /// True if the motion feels the mass.
    pub followed: bool,
    /// True if the motion shakes too hard next to the straight rod to feel the mass.
    pub shakes: bool,
}

impl MassNow {
    /// A motion that shakes.
    pub const SHAKES: Self = Self {
        followed: false,
        shakes: true,
    };
}

/// A moment of a rod bent by its own inertia.
struct InertiaBend<const N: usize> {
    now: BeamMoment<N>,
    /// Excess of the pull of equilibria over the body's own, u/y; bounds of its slaved and of its shaking part.
    more: f64,
    apart: [f64; 2],
    /// Increase of 1 - x by the bend, c' y u, and its rate.
    missing: f64,
    shortening: f64,
}

/// A chart state with its event functions near the straight rod, each of size 1 and zero at its event.
struct NearStraight<const N: usize> {
    /// Distance of the end from the end of the straight rod.
    distance: f64,
    /// Positive outside the neighbourhood of the straight rod.
    far: f64,
    /// Positive while the shaking is too hard to be followed.
    shaking: f64,
    /// Positive while the chart is accurate enough.
    steady: f64,
    /// The state in terms of deflection (across) and shaking (along).
    start: Phase<N>,
    /// Share of the distance that is shaking.
    apart: f64,
}

/// Treatment of the rod's mass next to the straight configuration.
pub enum MassTreatment<const N: usize> {
    /// No change: the rod is not near the straight one, or the chart is still accurate enough.
    None,
    /// The body shakes too hard along the rod: the rod's mass is left out.
    Shakes,
    /// The motion goes on as that of a beam with mass.
    Glides(Box<Glide<N>>),
}

/// Position of a motion relative to the straight rod.
pub struct StraightProximity<const N: usize> {
    /// Distance of the end from the end of the straight rod; 0 if unknown.
    pub distance: f64,
    /// Treatment of the rod's mass at this position.
    pub passage: MassTreatment<N>,
}

impl<const N: usize> NearStraight<N> {
    /// Event function of a step. Not `shakes`: positive outside the neighbourhood, or inside while the
    /// shaking is weak and the chart is accurate. `shakes`: positive inside the neighbourhood.
    fn room(&self, shakes: bool) -> f64 {
        if shakes {
            -self.far
        } else {
            self.far
                .max((-self.shaking).min(self.shaking.max(self.steady)))
        }
    }
}

impl<M: Multivalued<N>, const N: usize> Gliding<'_, M, N> {
    /// The moment `at`, and the quasistatic u: the bend by the rod's own inertia, y times the excess of the
    /// pull of equilibria over the body's own.
    fn bent(&self, at: &Phase<N>) -> Option<(BeamMoment<N>, f64)> {
        let now = self.moment(at)?;
        let BendingLoad { by_rise, rest, .. } = now.felt?.bending;
        let bent = (by_rise * now.rise() + rest) / now.rod.softening;
        Some((now, bent))
    }

    /// The bend with the inertia of u itself: m b u'' + |c'| u equals the load on it.
    fn shifted(&self, at: &Phase<N>) -> Option<InertiaBend<N>> {
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
        Some(InertiaBend {
            more: bent / now.height,
            apart: [slaved.abs(), swing].map(|bent| bent / now.height.abs()),
            missing: now.rod.softening * bent * now.height,
            shortening: now.rod.softening * (bent * now.speed + rate * now.height),
            now,
        })
    }

    /// mu c'^2 y, by which the body takes part in the shaking.
    fn lever(&self, now: &BeamMoment<N>) -> f64 {
        self.body.mass() * now.rod.softening.powi(2) * now.height
    }

    /// y'' and u'' of a shaking rod. Its kinetic energy is m int (w y' + w_N u')^2 ds/2, that of the body
    /// along it mu ((c' y u)')^2/2, and |c'| u^2/2 is stored.
    pub(super) fn shaken(&self, now: &BeamMoment<N>, at: &Phase<N>) -> [f64; 2] {
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
        let InertiaBend { now, apart, .. } = self.shifted(at)?;
        let height = now.height.abs();
        let outward = now.height * now.speed >= 0.0;
        let calm =
            apart[0] + apart[1] < SHIFTED[0] * now.pull.abs() && now.pull.abs() > PULL_LIMITS[0];
        Some(outward && (height > HIGHEST[0] || height > DEFLECTION_LIMITS[0] && calm))
    }

    /// The longest time step at the deflection `at`: it ends not far beyond the handover to the chart.
    pub(super) fn reach(&self, at: &Phase<N>) -> Option<f64> {
        if self.rod.is_none() {
            return Some(f64::INFINITY);
        }
        let across = self.manifold.axial_constraint(0.0)?.across;
        let [height, speed] = [at.q, at.v].map(|of| of.dot(&across).abs());
        Some((0.1 * HIGHEST[0] + (HIGHEST[0] - height).max(0.0)) / speed)
    }

    /// Event functions of the state `at` in the chart `patch`. For a motion that shakes only the distance
    /// counts. None if they are undefined.
    fn beside(&self, patch: Patch, at: &Phase<N>, now: MassNow) -> Option<NearStraight<N>> {
        let straight = self.manifold.axial_constraint(0.0)?;
        let point = self.manifold.point_in(patch, &at.q)?;
        let off = point.pose - straight.pose;
        let distance = off.norm();
        let far = distance.max(off.dot(&straight.along).abs() / distance) / FARTHEST - 1.0;
        if now.shakes || !(far < 1.0) {
            return Some(NearStraight {
                distance,
                far,
                shaking: -1.0,
                steady: 1.0,
                start: *at,
                apart: 0.0,
            });
        }
        let feels = now.followed;
        let only_across = |v: &SVector<f64, N>| straight.across * v.dot(&straight.across);
        let mut start = Phase {
            q: only_across(&off),
            v: only_across(&at.v),
            ..*at
        };
        let InertiaBend {
            now,
            missing,
            shortening,
            ..
        } = self.shifted(&start)?;
        // The chart's motion without the rod's mass has the body's own pull.
        let (missing, shortening) = if feels {
            (missing, shortening)
        } else {
            (0.0, 0.0)
        };
        // The rest of the distance from the circle is shaking: c' y u, and its rate.
        let along = |pose: &SVector<f64, N>| pose.dot(&now.rod.along);
        let (_, beam) = self.placed(now.pull, now.height)?;
        let farther = beam - along(&point.pose) - missing;
        let rate = Self::slaved(&now) - along(&at.v) - shortening;
        let softened = now.rod.softening * now.height;
        let shaken = farther / softened;
        let shaking = (rate / now.rod.softening - now.speed * shaken) / now.height;
        start.q += now.rod.along * shaken;
        start.v += now.rod.along * shaking;
        let InertiaBend { apart, .. } = self.shifted(&start)?;
        let (pull, height) = (now.pull.abs(), now.height.abs());
        let unsteady = ((apart[0] + apart[1]) / (SHIFTED[1] * pull)).max(PULL_LIMITS[1] / pull);
        let low = (1.0 - unsteady).max(height / HIGHEST[1] - 1.0);
        Some(NearStraight {
            distance,
            far,
            shaking: apart[1] / (SHAKEN * (1.0 + pull)) - 1.0,
            steady: low.min(height / DEFLECTION_LIMITS[1] - 1.0),
            start,
            apart: (softened * apart[1] * now.height).abs() / distance.powi(2),
        })
    }

    /// Treatment of the rod's mass at `beside`. Hysteresis: shaking ends only when the rod has left the
    /// neighbourhood, since at turning points it looks calm.
    fn passage(
        &self,
        beside: &NearStraight<N>,
        shakes: bool,
        at_edge: bool,
        tolerance: f64,
    ) -> MassTreatment<N> {
        let slack = if at_edge { EVENT_TOLERANCE } else { 0.0 };
        // At an event the watched quantity equals its threshold up to `EVENT_TOLERANCE`, and counts as crossed.
        let near = beside.far < if shakes { -slack } else { slack };
        if near && (shakes || !(beside.shaking < -slack)) {
            return MassTreatment::Shakes;
        }
        if !(near && beside.steady < slack) {
            return MassTreatment::None;
        }
        let Some(across) = self
            .manifold
            .axial_constraint(0.0)
            .map(|straight| straight.across)
        else {
            return MassTreatment::None;
        };
        let mut start = beside.start;
        if beside.apart < tolerance {
            (start.q, start.v) = (across * start.q.dot(&across), across * start.v.dot(&across));
        }
        (self.started(start, tolerance, f64::INFINITY)).map_or(MassTreatment::Shakes, |glide| {
            MassTreatment::Glides(Box::new(glide))
        })
    }

    /// The equilibrium under `pull` with its end at the height `height`: its chart point (global), and the
    /// position of its end along the rod.
    fn placed(&self, pull: f64, height: f64) -> Option<(SVector<f64, N>, f64)> {
        let along = self.manifold.axial_constraint(0.0)?.along;
        let (patch, q) = self.manifold.deflected_point(pull, height)?;
        let q = self.manifold.change_patch(&q, patch, Patch::Global);
        Some((q, self.manifold.point(&q)?.pose.dot(&along)))
    }

    /// The chart state at a handover at the deflection `at`. A mass let go with the body's own pull would shake along
    /// the rod, so the pull exceeds it by u/y and 1 - x by c' u y. None if the secant search fails.
    fn handed_over(&self, at: &Phase<N>) -> Option<Phase<N>> {
        let InertiaBend {
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
    fn with_mass(&self, rod: &'a dyn FirstOrderInertia<N>) -> Gliding<'a, M, N> {
        Gliding {
            rod: Some(rod),
            ..self.gliding()
        }
    }

    /// Distance of the motion from the straight rod, and how the mass of `rod` is to be treated. `now` is the
    /// present treatment. `at_edge`: the last step was ended at an event of either kind.
    pub fn nears_straight(
        &self,
        rod: &'a dyn FirstOrderInertia<N>,
        now: MassNow,
        at_edge: bool,
    ) -> StraightProximity<N> {
        let motion = self.with_mass(rod);
        let beside = motion.beside(self.patch, self.solver.state(), now);
        StraightProximity {
            distance: beside.as_ref().map_or(0.0, |beside| beside.distance),
            passage: beside.map_or(MassTreatment::None, |beside| {
                motion.passage(&beside, now.shakes, at_edge, self.tolerance)
            }),
        }
    }

    /// Ends the last step at its first event: entry into the motion next to the straight rod or, for a motion that
    /// shakes, the end of the shaking. The motions with and without the rod's mass, in the chart and outside it,
    /// differ by more than a tolerance in the same state. So the change must not depend on the ends of steps.
    /// `distance`: from the end of the straight rod at the start of the step. False if the step is unchanged.
    pub fn ends_at_straight(
        &mut self,
        rod: &'a dyn FirstOrderInertia<N>,
        now: MassNow,
        distance: f64,
    ) -> bool {
        let goes_on = if now.shakes {
            self.stays_near(rod)
        } else {
            !self.comes_near(distance)
        };
        if goes_on {
            return false;
        }
        let inside = self.inside();
        let fraction = inside.and_then(|inside| {
            let motion = self.with_mass(rod);
            first_change(inside, PLACES, |at| {
                let beside = motion.beside(Patch::Global, at, now);
                beside.map_or(1.0, |beside| beside.room(now.shakes))
            })
        });
        fraction.is_some_and(|fraction| self.end_after(fraction))
    }

    /// True if the end of the rod may have entered the neighbourhood of the straight rod in the last step.
    /// `distance`: at the start of the step.
    fn comes_near(&self, distance: f64) -> bool {
        self.last.as_ref().is_some_and(|step| {
            let (from, to) = (step.from(), step.to());
            let way = 2.0 * from.v.norm().max(to.v.norm()) * (to.t - from.t);
            distance < FARTHEST + way
        })
    }

    /// True if a shaking motion was well inside the neighbourhood at both ends of the last step.
    fn stays_near(&self, rod: &'a dyn FirstOrderInertia<N>) -> bool {
        let motion = self.with_mass(rod);
        let well_within = |at: &Phase<N>| {
            let beside = motion.beside(Patch::Global, at, MassNow::SHAKES);
            beside.is_some_and(|beside| beside.room(true) > WITHIN)
        };
        (self.last.as_ref()).is_some_and(|step| well_within(step.from()) && well_within(step.to()))
    }

    /// Continues with `glide`, the motion of a beam with mass; None if its state has no chart point.
    pub fn go_straight(
        &mut self,
        rod: &'a dyn FirstOrderInertia<N>,
        glide: Glide<N>,
    ) -> Option<()> {
        let (patch, charted) = self.with_mass(rod).charted(glide.state())?;
        let slope = slope(
            self.manifold,
            patch,
            self.body,
            None,
            None,
            self.orientation,
            &charted,
        )?;
        self.rod = Some(FollowedMass {
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

    /// True during a motion next to the straight rod with the rod's mass.
    pub fn passes_straight(&self) -> bool {
        self.rod.is_some() && self.shaking.glides()
    }

    /// The chart state for a handover that is due: `Some(None)` if the chart cannot continue with the rod's mass.
    pub fn leaves_straight(&self) -> Option<Option<Phase<N>>> {
        let (_, glide) = (self.rod?, self.shaking.glide()?);
        glide
            .is_over()
            .then(|| self.gliding().handed_over(glide.state()))
    }

    /// Kinetic and potential energy of the rod in a state next to the straight rod.
    pub fn energies_beside(&self, phase: &Phase<N>) -> Option<[f64; 2]> {
        let straight = self.manifold.axial_constraint(0.0)?;
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
