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

use super::attachment::AttachedTo;
use super::body::BodyMotion;
use super::configuration::{Configuration, Evaluated, Spin};
use super::light_rod::LightRodAt;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use super::stiffness::{add, carried};
use crate::body::Frame;
use crate::error::Result;
use crate::math::se3::{halves, join};
use crate::rod::SpaceRodInertia;
use nalgebra::{DMatrix, DVector, Matrix6, SVector, Vector3, Vector6};
use std::borrow::Cow;

/// A motion starts to include the inertia of a rod if the rod has at most this part of the bodies' kinetic energy.
const MOST_OF_BODIES: f64 = 0.1;

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

impl Assembly {
    /// Completes the unknown spins of a configuration. The base directors come from the attachments by the least
    /// rotation to the chord. The angular momentum about the chord is zero, as after blows on the bodies.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn complete_spins(&self, now: &Configuration, tolerance: f64) -> Result<Configuration> {
        let mut spun = now.clone();
        for (k, light) in self.light_rods() {
            if !self.links[k].is_pinned() || now.spin(k).is_some() {
                continue;
            }
            let point = self.placed(0.0, now, k, tolerance)?;
            let turn = point.base.pose.rotation;
            let rod = LightRodAt {
                link: &self.links[k],
                sections: &light.sections,
                q: &now.charts[k],
                point: &point,
                tolerance,
            };
            let rate = rod.idle_spin().unwrap_or(0.0);
            spun.spins.resize(self.links.len(), None);
            spun.spins[k] = Some(Spin { turn, rate });
        }
        Ok(spun)
    }

    /// True if a motion from this state should start with the inertia of rod `k`.
    pub fn should_feel(&self, k: usize, at: &Evaluated, tolerance: f64) -> bool {
        (self.to_fold(k, at, true, tolerance)).is_some_and(|room| room > 0.0)
    }

    /// Rod `k` at the moment, at `point`; None for a rod of unknown mass.
    fn light_rod<'a>(
        &'a self,
        k: usize,
        at: &'a Evaluated,
        point: &'a LinkPoint,
        tolerance: f64,
    ) -> Option<LightRodAt<'a>> {
        let link = self.links.get(k)?;
        Some(LightRodAt {
            link,
            sections: &link.mass()?.sections,
            q: &at.now.charts[k],
            point,
            tolerance,
        })
    }

    /// Event function of the inertia near a fold ([`LightRodAt::room`]).
    fn to_fold(&self, k: usize, at: &Evaluated, followed: bool, tolerance: f64) -> Option<f64> {
        let room = self
            .light_rod(k, at, &at.points[k], tolerance)?
            .room(followed)?;
        (!room.is_nan()).then_some(room)
    }

    /// Event function for switching the inertia of rod `k`: positive as long as the present setting is to be kept,
    /// falling steadily from 1 or more to 0 at the switch. Inertia is switched on again only if the rod then has a
    /// small part of the bodies' kinetic energy, since that energy comes from nowhere.
    pub fn inertia_margin(&self, k: usize, at: &Evaluated, tolerance: f64) -> f64 {
        let followed = self.links.get(k).is_some_and(Link::is_followed);
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

    /// Frame of that clamp at time `t`.
    fn seen_from(&self, t: f64) -> Option<Frame<6>> {
        Some(self.clamp()?.at(t).of_poses())
    }

    /// Energy and momenta of rod `k` at this moment, whether its inertia is on or off; None where its chart is
    /// singular.
    pub fn weighed(&self, k: usize, at: &Evaluated, tolerance: f64) -> Option<RodMomentum> {
        let frame = self.seen_from(at.integrals.time);
        let point = &absolute(at.points.get(k)?, frame.as_ref());
        let rod = self.light_rod(k, at, point, tolerance)?;
        let moving = rod.moving()?;
        let SpaceRodInertia {
            matrix,
            centre,
            momentum,
            ..
        } = &moving.inertia;
        let mass = rod.sections.mass;
        let all: SVector<f64, 12> = matrix * moving.now;
        let v = moving.now.fixed_rows::<3>(0);
        let turn = point.base.pose.rotation;
        let angular = momentum + centre.cross(&v) * mass;
        Some(RodMomentum {
            kinetic: 0.5 * moving.now.dot(&all),
            centre: point.base.pose.translation.vector + turn * centre,
            momentum: join(&(turn * angular), &(turn * all.fixed_rows::<3>(0))),
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
        let bent = -join(&point.end.couple, &point.end.tip_force());
        let borne = self.borne(at, tolerance);
        let Some((_, borne)) = borne.iter().find(|(rod, _)| *rod == k) else {
            return bent;
        };
        let back = point.base.pose.rotation.inverse();
        let (couple, force) = halves(&borne.fixed_rows::<6>(6).into_owned());
        bent - join(&(back * couple), &(back * force))
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
            .map(|(carrier, place)| carrier.mass().matrix(&place.pose.rotation))
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
            let along = alone.acceleration - join(&Vector3::zeros(), &bent[body]);
            rows += own[body].tr_mul(&(masses[body] * along));
            free.push(along);
        }
        let alone = matrix.clone();
        let mut followed = Vec::new();
        for (k, link) in self
            .links
            .iter()
            .enumerate()
            .filter(|(_, link)| link.is_followed())
        {
            let levers = link.levers(bodies);
            let point = &at.points[k];
            let mut drawn = prescribed_accelerations(link, t, bodies, &bent);
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
                    own += frame.acceleration_at_constant_velocity(&lever, &place.twist);
                    driven[i] = Some(frame.velocity_of_fixed_point(&lever));
                }
            }
            let point = absolute(point, frame.as_ref());
            let felt = self.light_rod(k, at, &point, tolerance)?.felt(&drawn)?;
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

/// Accelerations (angular, linear) of both attachments in the world while no body accelerates along its own
/// velocities: of supports, of points off the reference point of a turning body, and across grooves
/// (`bent`, by body).
fn prescribed_accelerations(
    link: &Link,
    t: f64,
    bodies: &[BodyMotion],
    bent: &[Vector3<f64>],
) -> SVector<f64, 12> {
    let mut drawn = SVector::<f64, 12>::zeros();
    for (k, site) in [&link.from, &link.to].into_iter().enumerate() {
        let own = match &site.on {
            AttachedTo::Ground => continue,
            AttachedTo::Support(support) => {
                let lever = join(&Vector3::zeros(), &site.place.translation.vector);
                support.at(t).of_poses().acceleration_of_fixed_point(&lever)
            }
            AttachedTo::Body(body) => {
                let BodyMotion { pose, twist } = &bodies[*body];
                let (spin, arm) = (
                    halves(twist).0,
                    pose.rotation * site.place.translation.vector,
                );
                join(
                    &Vector3::zeros(),
                    &(bent[*body] + spin.cross(&spin.cross(&arm))),
                )
            }
        };
        drawn.fixed_rows_mut::<6>(6 * k).copy_from(&own);
    }
    drawn
}

/// Position of an attachment as a lever from the frame's origin.
fn lever(place: &BodyMotion) -> Vector6<f64> {
    join(&Vector3::zeros(), &place.pose.translation.vector)
}

/// The attachments with their absolute twists, along the axes of the clamp from which they are seen.
fn absolute<'a>(point: &'a LinkPoint, frame: Option<&Frame<6>>) -> Cow<'a, LinkPoint> {
    let Some(frame) = frame else {
        return Cow::Borrowed(point);
    };
    let mut moved = point.clone();
    for place in [&mut moved.base, &mut moved.tip] {
        place.twist += frame.velocity_of_fixed_point(&lever(place));
    }
    Cow::Owned(moved)
}
