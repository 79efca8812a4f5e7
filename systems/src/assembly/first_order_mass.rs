//! First-order inertia of light rods between bodies (theory 3.9).
//!
//! The rod stays on its equilibria between its attachments, under its load. Its inertia acts on them in the variables
//! (V, b', Omega) ([`Rod::generalized_inertia`](crate::rod::Rod::generalized_inertia)), along the present directors
//! of its base. Here b' is the rate of the base wrench. The chart follows the attachments (`along`),
//! b' = q' + Omega x b, and the accelerations follow likewise:
//! ```text
//! J b'' = (J q' with accelerations for velocities) - D^2(end)[(b', Omega), (b', Omega)].
//! ```
//! For a taut rod the twist of its end replaces b' ([`Rod::taut_inertia`](crate::rod::Rod::taut_inertia)), and no
//! chart has to follow. Base and end thus get a coupled 12 x 12 mass matrix and a force. One linear system gives the
//! accelerations of all bodies.
//!
//! If bodies are seen from a moving clamp, twists and accelerations of the attachments are those in the world, along
//! the axes of the clamp.

use super::chord_spin::Free;
use super::stiffness::{add, carried};
use super::{
    Assembly, AttachedTo, BodyMotion, Evaluated, HeavyBody, Joint, Link, LinkEnd, LinkPoint, Mass,
};
use crate::body::{Frame, Support};
use crate::error::{Error, Result};
use crate::math::se3::{halves, joined};
use crate::rod::{Rates, RodRates, SectionMass, SpaceRodInertia, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use std::borrow::Cow;

/// A motion starts to include the inertia of a rod if the rod has at most this part of the bodies' kinetic energy.
const MOST_OF_BODIES: f64 = 0.1;

/// Mass properties of a rod treated to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct LightRod {
    /// Mass and rotary inertia of the sections. The weight is a load along the rod ([`Link::with_distributed`]).
    pub sections: SectionMass,
    /// True while the motion includes the rod's inertia.
    pub followed: bool,
}

/// Energy and momenta of a light rod at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodMomentum {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Centre of mass, in the world, or relative to the clamp if bodies are.
    pub centre: Vector3<f64>,
    /// (angular momentum about the base attachment, momentum) in the world, along the same axes.
    pub momentum: Vector6<f64>,
}

/// Wrenches on base and end that the inertia of a rod requires: linear in the accelerations of base and end, plus a
/// part for the accelerations present while no body accelerates along its own velocities.
struct AttachmentInertia {
    matrix: SMatrix<f64, 12, 12>,
    force: SVector<f64, 12>,
    /// Rate of the spin about the chord, if the rod has one: linear in the accelerations, and constant part.
    spin: Option<(SVector<f64, 12>, f64)>,
}

/// Coupled accelerations of bodies and rods.
pub(super) struct CoupledAccelerations {
    /// Matrix from the accelerations of the bodies alone to those with rods, in the bodies' own velocities.
    pub shared: DMatrix<f64>,
    /// Power of the moving supports against the inertia of the rods.
    pub power: f64,
    /// Rates of the spins about the chords, by rod.
    pub spins: Vec<(usize, f64)>,
    /// Wrenches of the attachments on base and end of a rod that its inertia requires, by rod, along the axes of the
    /// world.
    pub borne: Vec<(usize, SVector<f64, 12>)>,
}

/// Motion of a rod.
struct RodMotion {
    inertia: SpaceRodInertia,
    /// (V, b', Omega) as a linear function of the twists of base and end in the world, and its present value.
    by_twists: SMatrix<f64, 12, 12>,
    now: SVector<f64, 12>,
    /// b'' and Omega_t, in the same rows, while nothing accelerates the attachments; 0 for a taut rod.
    bent: SVector<f64, 12>,
    /// Free spin about the chord of a rod between two ball joints.
    free: Option<Free>,
}

impl HeavyBody {
    /// Mass matrix about the reference point, in the world.
    fn mass_matrix(&self, place: &BodyMotion) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        let mut put = |row: usize, column: usize, block: Matrix3<f64>| {
            matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        };
        match self.mass() {
            Mass::Point(body) => put(3, 3, Matrix3::identity() * body.mass()),
            Mass::Rigid(body) => {
                let turn = place.pose.rotation.to_rotation_matrix();
                let c = (turn * body.offset()).cross_matrix();
                let own = turn.matrix() * body.inertia() * turn.matrix().transpose();
                put(0, 0, own - c * c * body.mass());
                put(0, 3, c * body.mass());
                put(3, 0, -c * body.mass());
                put(3, 3, Matrix3::identity() * body.mass());
            }
        }
        matrix
    }
}

impl Link {
    /// (V, b', Omega) from the twists of base and end in the world and the rates of the chart. For a taut rod, whose
    /// base wrench does not determine its end, the twist of the end replaces b'.
    pub(super) fn base_motion_of<const C: usize>(
        &self,
        (q, point): (&Wrench, &LinkPoint),
        twists: &SMatrix<f64, 12, C>,
        rates: &SMatrix<f64, 6, C>,
    ) -> SMatrix<f64, 12, C> {
        let mut swept = point.base_motion(q, twists, rates);
        if point.end.taut.is_some() {
            let mut own = swept.fixed_rows_mut::<6>(3);
            own.copy_from(&(point.relative_by_twists() * twists));
            own.fixed_rows_mut::<3>(3).unscale_mut(self.rod().length());
        }
        swept
    }

    /// Motion of the rod; None if the chart is singular or the law refuses.
    fn moving(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<RodMotion> {
        let scale = self.gap_scale(&point.end);
        // The end of a taut rod moves with its attachment, whatever the chart.
        let factors = match point.end.taut {
            Some(_) => None,
            None => Some(self.regular(&point.end)?),
        };
        let chart = match &factors {
            Some(factors) => factors.solve(&(scale * point.drive_by_twists()))?,
            None => SMatrix::zeros(),
        };
        let by_twists = self.base_motion_of((q, point), &SMatrix::identity(), &chart);
        let mut twists = SVector::<f64, 12>::zeros();
        twists.fixed_rows_mut::<6>(0).copy_from(&point.base.twist);
        twists.fixed_rows_mut::<6>(6).copy_from(&point.tip.twist);
        let mut now = by_twists * twists;
        if let Some(along) = point.free_spin(q) {
            now += along * point.spin;
        }
        let motion = swaying(&now);
        let rod = (q, point);
        let inertia = self.inertia(&light.sections, rod, (&motion, Rates::End), tolerance)?;
        let bent = match &factors {
            Some(factors) => {
                let rates =
                    factors.solve(&-(scale * self.constraint_curvature(&point.end, &inertia)))?;
                point.bent(q, (rates, &motion), &halves(&inertia.second).1)
            }
            None => SVector::zeros(),
        };
        let size = (light.sections.mass, self.rod().length());
        let free = point.freedom(q, &inertia.matrix, size);
        Some(RodMotion {
            inertia,
            by_twists,
            now,
            bent,
            free,
        })
    }

    /// Spin about the chord at which the rod's angular momentum about the chord vanishes, whatever spin the rod has.
    /// None if the rod has no such freedom.
    pub(super) fn idle_spin(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<f64> {
        let moving = self.moving(light, (q, point), tolerance)?;
        Some(point.spin + moving.free?.idle(&moving.now))
    }

    /// Generalized inertia of the moving rod, for a taut rod by `rates`; None where its law refuses.
    pub(super) fn inertia(
        &self,
        sections: &SectionMass,
        (q, point): (&Wrench, &LinkPoint),
        (motion, rates): (&RodRates, Rates),
        tolerance: f64,
    ) -> Option<SpaceRodInertia> {
        if let Some(taut) = &point.end.taut {
            return self
                .rod()
                .taut_inertia(sections, (taut, rates), motion)
                .ok();
        }
        let seen = self.with_base_rotation(&point.base.pose.rotation);
        let trace = match &point.end.trace {
            Some(trace) => trace.clone(),
            None => {
                let mut link = seen.clone().into_owned();
                link.keeps_trace = true;
                link.end(q, tolerance).ok()?.trace?
            }
        };
        let rod = (q, seen.borne());
        (self
            .rod()
            .generalized_inertia(sections, rod, motion, &trace))
        .ok()
    }

    /// Second derivative of the quantities held by the attachment, in the rows of the Jacobian.
    pub(super) fn constraint_curvature(
        &self,
        end: &LinkEnd,
        inertia: &SpaceRodInertia,
    ) -> Vector6<f64> {
        let (turned, moved) = halves(&inertia.second);
        match self.joint() {
            Joint::Weld => joined(&turned, &moved),
            Joint::Ball => joined(&inertia.couple, &moved),
            Joint::Pins => {
                let along = end.along();
                let across = inertia.couple * end.per_couple;
                joined(&Vector3::zeros(), &(along * along.dot(&moved) + across))
            }
        }
    }

    fn felt(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        drawn: &SVector<f64, 12>,
        tolerance: f64,
    ) -> Option<AttachmentInertia> {
        let moving = self.moving(light, (q, point), tolerance)?;
        let SpaceRodInertia { matrix, force, .. } = &moving.inertia;
        let by_twists = &moving.by_twists;
        let (mut left, mut force, mut spin) = (*matrix, *force, None);
        if let Some(free) = &moving.free {
            let by = -by_twists.tr_mul(&free.momentum) / free.inertia;
            let turned = point.chord_turns(&swaying(&moving.now).spin);
            let loaded = free.along.dot(&force) / free.inertia;
            let alone = free.idle(&moving.bent) - loaded + turned;
            spin = Some((by, alone + by.dot(drawn)));
            left = free.eliminated(matrix);
            force -= free.momentum * loaded;
        }
        let matrix = by_twists.tr_mul(&(left * by_twists));
        Some(AttachmentInertia {
            matrix,
            force: by_twists.tr_mul(&(force + left * moving.bent)) + matrix * drawn,
            spin,
        })
    }

    /// Accelerations (angular, linear) of both attachments in the world while no body accelerates along its own
    /// velocities: of supports, of points off the reference point of a turning body, and across grooves
    /// (`bent`, by body).
    fn prescribed_accelerations(
        &self,
        t: f64,
        (bodies, bent): (&[BodyMotion], &[Vector3<f64>]),
    ) -> SVector<f64, 12> {
        let mut drawn = SVector::<f64, 12>::zeros();
        for (k, site) in [&self.from, &self.to].into_iter().enumerate() {
            let own = match &site.on {
                AttachedTo::Ground => continue,
                AttachedTo::Support(support) => {
                    let lever = joined(&Vector3::zeros(), &site.place.translation.vector);
                    support.at(t).of_poses().acceleration_of_fixed_point(&lever)
                }
                AttachedTo::Body(body) => {
                    let BodyMotion { pose, twist } = &bodies[*body];
                    let (spin, arm) = (
                        halves(twist).0,
                        pose.rotation * site.place.translation.vector,
                    );
                    joined(
                        &Vector3::zeros(),
                        &(bent[*body] + spin.cross(&spin.cross(&arm))),
                    )
                }
            };
            drawn.fixed_rows_mut::<6>(6 * k).copy_from(&own);
        }
        drawn
    }
}

impl Assembly {
    /// Gives rods a mass that is treated to first order, one entry for each rod.
    ///
    /// # Errors
    /// A mass or inertia that is not finite and positive; a rod under a load along it, or between two ball joints,
    /// that is seen from a clamp that turns.
    pub fn with_light_rods(mut self, light: Vec<Option<LightRod>>) -> Result<Self> {
        let clamp_turns = self.clamp().is_some_and(Support::turns);
        for (k, light) in light.iter().enumerate() {
            let Some(light) = light else { continue };
            let name = self.rod_name(k);
            let refuse = |why: &str| {
                Err(Error::domain(format!(
                    "the mass of {name} is not followed to first order: {why}; write inertia = \"none\""
                )))
            };
            let SectionMass { mass, rotary } = &light.sections;
            let Some(link) = self.links.get(k) else {
                return refuse("there is no such rod");
            };
            if !(*mass > 0.0 && mass.is_finite() && rotary.iter().all(|j| *j >= 0.0)) {
                return refuse("its mass must be > 0, the inertia of its sections >= 0");
            }
            let turns = link.distributed().is_some() || link.joint() == Joint::Pins;
            if clamp_turns && turns {
                return refuse(
                    "it bears a load along it, or spins between two ball joints, and the clamp from which it is seen turns (attach it to a support)",
                );
            }
        }
        for (link, light) in self.links.iter_mut().zip(&light) {
            link.keeps_trace = light.is_some();
            link.clamp_turns = clamp_turns;
            link.felt = light.as_ref().is_some_and(|light| light.followed);
        }
        self.light = light;
        Ok(self)
    }

    /// Rods whose mass is treated to first order, by number.
    pub fn light_rods(&self) -> impl Iterator<Item = (usize, &LightRod)> {
        let all = self.light.iter().enumerate();
        all.filter_map(|(k, light)| Some((k, light.as_ref()?)))
    }

    /// True if the motion includes the inertia of a rod now.
    pub fn feels_rods(&self) -> bool {
        self.light_rods().any(|(_, light)| light.followed)
    }

    /// Switches the inertia of rod `k` on or off.
    pub fn set_inertia(&mut self, k: usize, followed: bool) {
        if let Some(Some(light)) = self.light.get_mut(k) {
            light.followed = followed;
            self.links[k].felt = followed;
        }
    }

    /// True if a motion from this state should start with the inertia of rod `k`.
    pub fn should_feel(&self, k: usize, at: &Evaluated, tolerance: f64) -> bool {
        (self.to_fold(k, at, true, tolerance)).is_some_and(|room| room > 0.0)
    }

    fn to_fold(&self, k: usize, at: &Evaluated, followed: bool, tolerance: f64) -> Option<f64> {
        let light = self.light.get(k)?.as_ref()?;
        let rod = (&at.now.charts[k], &at.points[k]);
        let room = self.links[k].room(light, rod, followed, tolerance)?;
        (!room.is_nan()).then_some(room)
    }

    /// Event function for switching the inertia of rod `k`: positive as long as the present setting is to be kept,
    /// falling steadily from 1 or more to 0 at the switch. Inertia is switched on again only if the rod then has a
    /// small part of the bodies' kinetic energy, since that energy comes from nowhere.
    pub fn inertia_margin(&self, k: usize, at: &Evaluated, tolerance: f64) -> f64 {
        let followed = matches!(self.light.get(k), Some(Some(light)) if light.followed);
        let room = self.to_fold(k, at, followed, tolerance);
        if followed {
            return room.unwrap_or(-1.0);
        }
        let free = || -> Option<f64> {
            let bodies = self.carriers.iter().zip(&at.now.bodies);
            let kinetic: f64 =
                (bodies.map(|(body, place)| body.kinetic(at.integrals.time, place))).sum();
            let rod = self.weighed(k, at, tolerance)?.kinetic;
            Some((rod / (MOST_OF_BODIES * kinetic) - 1.0).max(-room?))
        };
        free().unwrap_or(1.0)
    }

    /// Clamp from which the bodies are seen, if any.
    fn clamp(&self) -> Option<&Support<3>> {
        let mut supports = self.carriers.iter().map(|carrier| match carrier.mass() {
            Mass::Point(body) => body.support(),
            Mass::Rigid(body) => body.support(),
        });
        supports.find_map(|support| support)
    }

    /// Frame of that clamp at time `t`.
    fn seen_from(&self, t: f64) -> Option<Frame<6>> {
        Some(self.clamp()?.at(t).of_poses())
    }

    /// Energy and momenta of rod `k` at this moment, whether its inertia is on or off; None where its chart is
    /// singular.
    pub fn weighed(&self, k: usize, at: &Evaluated, tolerance: f64) -> Option<RodMomentum> {
        let light = self.light.get(k)?.as_ref()?;
        let frame = self.seen_from(at.integrals.time);
        let point = &absolute(&at.points[k], frame.as_ref());
        let moving = self.links[k].moving(light, (&at.now.charts[k], point), tolerance)?;
        let SpaceRodInertia {
            matrix,
            centre,
            momentum,
            ..
        } = &moving.inertia;
        let mass = light.sections.mass;
        let all: SVector<f64, 12> = matrix * moving.now;
        let v = moving.now.fixed_rows::<3>(0);
        let turn = point.base.pose.rotation;
        let angular = momentum + centre.cross(&v) * mass;
        Some(RodMomentum {
            kinetic: 0.5 * moving.now.dot(&all),
            centre: point.base.pose.translation.vector + turn * centre,
            momentum: joined(&(turn * angular), &(turn * all.fixed_rows::<3>(0))),
        })
    }

    /// Kinetic energy of the rods whose inertia is on.
    pub fn rod_kinetic(&self, at: &Evaluated, tolerance: f64) -> f64 {
        let felt = self.light_rods().filter(|(_, light)| light.followed);
        felt.filter_map(|(k, _)| Some(self.weighed(k, at, tolerance)?.kinetic))
            .sum()
    }

    /// Wrenches of the attachments on the rods that inertia requires: [`CoupledAccelerations::borne`]. Empty if a
    /// rod's inertia cannot be computed.
    fn borne(&self, at: &Evaluated, tolerance: f64) -> Vec<(usize, SVector<f64, 12>)> {
        if !self.feels_rods() {
            return Vec::new();
        }
        let mut wrenches = self.wrenches(&at.now.bodies, &at.points);
        let together = self.feel_rods(at, tolerance, &mut wrenches);
        together.map_or_else(Vec::new, |together| together.borne)
    }

    /// Wrench of rod `k` on the carrier of its end, at the attachment, along the directors of the base.
    pub fn end_action(&self, k: usize, at: &Evaluated, tolerance: f64) -> Vector6<f64> {
        let point = &at.points[k];
        let bent = -joined(&point.end.couple, &point.end.tip_force());
        let borne = self.borne(at, tolerance);
        let Some((_, borne)) = borne.iter().find(|(rod, _)| *rod == k) else {
            return bent;
        };
        let back = point.base.pose.rotation.inverse();
        let (couple, force) = halves(&borne.fixed_rows::<6>(6).into_owned());
        bent - joined(&(back * couple), &(back * force))
    }

    /// [`Assembly::wrenches`] plus the inertia wrenches of the rods.
    pub(super) fn felt_wrenches(&self, at: &Evaluated, tolerance: f64) -> Vec<Vector6<f64>> {
        let bodies = &at.now.bodies;
        let mut wrenches = self.wrenches(bodies, &at.points);
        for (k, borne) in self.borne(at, tolerance) {
            for (i, lever) in self.links[k].levers(bodies).iter().enumerate() {
                let Some((body, arm)) = lever else { continue };
                wrenches[*body] -= carried(arm).transpose() * borne.fixed_rows::<6>(6 * i);
            }
        }
        wrenches
    }

    /// Adds the inertia wrenches of the rods to those on the bodies; None if a rod's inertia cannot be computed.
    pub(super) fn feel_rods(
        &self,
        at: &Evaluated,
        tolerance: f64,
        wrenches: &mut [Vector6<f64>],
    ) -> Option<CoupledAccelerations> {
        let (bodies, t) = (&at.now.bodies, at.integrals.time);
        let frame = self.seen_from(t);
        let (starts, total) = self.freedoms();
        let own = self.own_twists(bodies);
        let masses: Vec<Matrix6<f64>> = (self.carriers.iter().zip(bodies))
            .map(|(carrier, place)| carrier.mass_matrix(place))
            .collect();
        let mut matrix = DMatrix::zeros(total, total);
        let mut right = DVector::zeros(total);
        let mut free = Vec::with_capacity(bodies.len());
        // A body in a curved groove has an acceleration across the groove, too.
        let bends = self.carriers.iter().zip(bodies).map(|(carrier, place)| {
            let (tangent, bend) = carrier.tangent(&place.pose)?;
            Some(bend * halves(&place.twist).1.dot(&tangent).powi(2))
        });
        let bent: Vec<Vector3<f64>> = bends.map(Option::unwrap_or_default).collect();
        for (body, carrier) in self.carriers.iter().enumerate() {
            let alone = carrier.motion(t, &bodies[body], &wrenches[body]);
            let twists = [&own[body]; 2];
            add(
                &mut matrix,
                (starts[body], starts[body]),
                &masses[body],
                twists,
            );
            let mut rows = right.rows_mut(starts[body], carrier.freedoms());
            let along = alone.acceleration - joined(&Vector3::zeros(), &bent[body]);
            rows += own[body].tr_mul(&(masses[body] * along));
            free.push(along);
        }
        let alone = matrix.clone();
        let mut followed = Vec::new();
        for (k, light) in self.light_rods().filter(|(_, light)| light.followed) {
            let link = &self.links[k];
            let levers = link.levers(bodies);
            let point = &at.points[k];
            let mut drawn = link.prescribed_accelerations(t, (bodies, &bent));
            let mut driven = [&link.from, &link.to]
                .into_iter()
                .zip([&point.base, &point.tip])
                .map(|(site, place)| {
                    matches!(site.on, AttachedTo::Support(_)).then_some(place.twist)
                })
                .collect::<Vec<_>>();
            if let Some(frame) = &frame {
                for (i, place) in [&point.base, &point.tip].into_iter().enumerate() {
                    let lever = lever(place);
                    let mut own = drawn.fixed_rows_mut::<6>(6 * i);
                    own += frame.swept(&lever, &place.twist);
                    driven[i] = Some(frame.carried(&lever));
                }
            }
            let point = absolute(point, frame.as_ref());
            let felt = link.felt(light, (&at.now.charts[k], &point), &drawn, tolerance)?;
            for (i, lever) in levers.iter().enumerate() {
                let Some((body, arm)) = lever else { continue };
                let onto = carried(arm).transpose();
                let push = onto * felt.force.fixed_rows::<6>(6 * i);
                let mut rows = right.rows_mut(starts[*body], self.carriers[*body].freedoms());
                rows -= own[*body].tr_mul(&push);
                for (j, other) in levers.iter().enumerate() {
                    let Some((other, lever)) = other else {
                        continue;
                    };
                    let block =
                        onto * felt.matrix.fixed_view::<6, 6>(6 * i, 6 * j) * carried(lever);
                    let at = (starts[*body], starts[*other]);
                    add(&mut matrix, at, &block, [&own[*body], &own[*other]]);
                }
            }
            followed.push((k, felt, driven));
        }
        let factors = matrix.cholesky()?;
        let together = factors.solve(&right);
        let (mut power, mut spins, mut borne) = (0.0, Vec::new(), Vec::new());
        for (k, felt, driven) in followed {
            let mut accelerations = SVector::<f64, 12>::zeros();
            for (j, lever) in self.links[k].levers(bodies).iter().enumerate() {
                let Some((body, arm)) = lever else { continue };
                let rows = together.rows(starts[*body], self.carriers[*body].freedoms());
                let twist = carried(arm) * (&own[*body] * rows);
                accelerations.fixed_rows_mut::<6>(6 * j).copy_from(&twist);
            }
            if let Some((by, alone)) = felt.spin {
                spins.push((k, alone + by.dot(&accelerations)));
            }
            let wrench = felt.force + felt.matrix * accelerations;
            for (i, twist) in driven.iter().enumerate() {
                let twist = twist.unwrap_or_default();
                power += wrench.fixed_rows::<6>(6 * i).dot(&twist);
            }
            borne.push((k, wrench));
        }
        for (body, carrier) in self.carriers.iter().enumerate() {
            let rows = together.rows(starts[body], carrier.freedoms());
            let change = &own[body] * rows - free[body];
            wrenches[body] += masses[body] * change;
        }
        Some(CoupledAccelerations {
            shared: factors.solve(&alone),
            power,
            spins,
            borne,
        })
    }
}

/// (b', Omega) of (V, b', Omega).
pub(super) fn swaying(motion: &SVector<f64, 12>) -> RodRates {
    RodRates {
        rate: motion.fixed_rows::<6>(3).into_owned(),
        spin: motion.fixed_rows::<3>(9).into_owned(),
    }
}

/// Position of an attachment as a lever from the frame's origin.
fn lever(place: &BodyMotion) -> Vector6<f64> {
    joined(&Vector3::zeros(), &place.pose.translation.vector)
}

/// The attachments with their absolute twists, along the axes of the clamp from which they are seen.
fn absolute<'a>(point: &'a LinkPoint, frame: Option<&Frame<6>>) -> Cow<'a, LinkPoint> {
    let Some(frame) = frame else {
        return Cow::Borrowed(point);
    };
    let mut moved = point.clone();
    for place in [&mut moved.base, &mut moved.tip] {
        place.twist += frame.carried(&lever(place));
    }
    Cow::Owned(moved)
}
