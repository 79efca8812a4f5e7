//! Rods of small mass between bodies: their inertia to first order (theory 3.9).
//!
//! The rod stays on its equilibria between its attachments, under its load. What it adds to their equations of motion is that of the rod in
//! (V, b', Omega) ([`Rod::generalized_inertia`](crate::rod::Rod::generalized_inertia)), seen along the directors of its base as they are now, b' the
//! rate of the base wrench. Its chart follows the attachments (`along`), b' = q' + Omega x b, and so do their accelerations,
//! ```text
//! J b'' = (what J q' is of the accelerations) - D^2(end)[(b', Omega), (b', Omega)].
//! ```
//! So base and end feel a mass matrix of 12 x 12, which couples them, and a force; the accelerations of all bodies follow from one
//! linear system.
//!
//! Where bodies are seen from a clamp that moves, twists and accelerations of the attachments are those in the world, along the axes of the clamp.

use super::stiffness::{add, carried};
use super::{Assembly, Carrier, Evaluated, Joint, Link, LinkPoint, Mass, On, Place};
use crate::body::{Frame, Support};
use crate::error::{Error, Result};
use crate::math::se3::{halves, joined};
use crate::rod::{Generalized, SectionMass, Swaying, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use std::borrow::Cow;

/// Times T_i before a fold within which a rod is not followed, and beyond which it is again (theory 2.8, 2.9).
const CLEAR: [f64; 2] = [2.0, 3.0];
/// A fold is looked for within this part of the base wrench, where the rod's normal form tells of it.
const NEAR: f64 = 0.25;

/// What is known of the mass of a rod that is followed to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct LightRod {
    /// Its mass and the inertia of its sections. Its weight is a load along the rod ([`Link::with_distributed`]).
    pub sections: SectionMass,
    /// True while the motion feels it.
    pub followed: bool,
}

/// A light rod at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighed {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Its centre of mass, in the world, or seen from the clamp if bodies are.
    pub centre: Vector3<f64>,
    /// (angular momentum about the base attachment, momentum) in the world, along the same axes.
    pub momentum: Vector6<f64>,
}

/// What attachments feel of a rod: wrenches on base and end of their accelerations, and of those that they have while no body accelerates
/// along its own velocities.
struct Felt {
    matrix: SMatrix<f64, 12, 12>,
    force: SVector<f64, 12>,
}

/// The accelerations of bodies with their rods.
pub(super) struct Together {
    /// What accelerations of the bodies alone become, in their own velocities.
    pub shared: DMatrix<f64>,
    /// The power of the supports that move, against the inertia of the rods.
    pub power: f64,
}

/// The rod as it moves.
struct Moving {
    inertia: Generalized,
    /// (V, b', Omega) by the twists of base and end in the world, and what they are.
    by_twists: SMatrix<f64, 12, 12>,
    now: SVector<f64, 12>,
    /// b'' while nothing accelerates the attachments.
    bent: Vector6<f64>,
}

impl Carrier {
    /// The mass matrix about the reference point, in the world.
    fn mass_matrix(&self, place: &Place) -> Matrix6<f64> {
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
    /// None where the chart is singular, or the law refuses.
    fn moving(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<Moving> {
        let back = point.base.pose.rotation.to_rotation_matrix().transpose();
        let factors = self.regular(&point.end)?;
        let scale = self.gap_scale(&point.end);
        let chart = factors.solve(&(scale * point.drive_by_twists()))?;
        let mut by_twists = SMatrix::<f64, 12, 12>::zeros();
        let mut turned = |row: usize, column: usize, block: &Matrix3<f64>| {
            let mut view = by_twists.fixed_view_mut::<3, 3>(row, column);
            view += block * back.matrix();
        };
        turned(0, 3, &Matrix3::identity());
        turned(9, 0, &Matrix3::identity());
        let (m, n) = halves(q);
        turned(3, 0, &-m.cross_matrix());
        turned(6, 0, &-n.cross_matrix());
        let mut rows = by_twists.fixed_rows_mut::<6>(3);
        rows += chart;
        let mut twists = SVector::<f64, 12>::zeros();
        twists.fixed_rows_mut::<6>(0).copy_from(&point.base.twist);
        twists.fixed_rows_mut::<6>(6).copy_from(&point.tip.twist);
        let now = by_twists * twists;
        let motion = Swaying {
            rate: now.fixed_rows::<6>(3).into_owned(),
            spin: now.fixed_rows::<3>(9).into_owned(),
        };
        let inertia = self.inertia(&light.sections, (q, point), &motion, tolerance)?;
        let bent = factors.solve(&-(scale * self.second(&inertia)))?;
        Some(Moving {
            inertia,
            by_twists,
            now,
            bent,
        })
    }

    /// The inertia of the rod as it moves; None where its law refuses.
    pub(super) fn inertia(
        &self,
        sections: &SectionMass,
        (q, point): (&Wrench, &LinkPoint),
        motion: &Swaying,
        tolerance: f64,
    ) -> Option<Generalized> {
        let seen = self.facing(&point.base.pose.rotation);
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

    /// The second derivative of what its attachment holds, in the rows of the Jacobian.
    fn second(&self, inertia: &Generalized) -> Vector6<f64> {
        let (turned, moved) = halves(&inertia.second);
        match self.joint() {
            Joint::Weld => joined(&turned, &moved),
            Joint::Ball | Joint::Pins => joined(&inertia.couple, &moved),
        }
    }

    fn felt(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        drawn: &SVector<f64, 12>,
        tolerance: f64,
    ) -> Option<Felt> {
        let moving = self.moving(light, (q, point), tolerance)?;
        let Generalized { matrix, force, .. } = &moving.inertia;
        let by_twists = &moving.by_twists;
        let bending = matrix.fixed_columns::<6>(3) * moving.bent;
        let matrix = by_twists.tr_mul(&(matrix * by_twists));
        Some(Felt {
            matrix,
            force: by_twists.tr_mul(&(force + bending)) + matrix * drawn,
        })
    }

    /// The accelerations (spin, place) of both attachments in the world while no body accelerates along its own velocities: those of supports,
    /// of places beside the reference point of a body that turns, and across a groove, which `bent` has of every body.
    fn drawn(&self, t: f64, (bodies, bent): (&[Place], &[Vector3<f64>])) -> SVector<f64, 12> {
        let mut drawn = SVector::<f64, 12>::zeros();
        for (k, site) in [&self.from, &self.to].into_iter().enumerate() {
            let own = match &site.on {
                On::Ground => continue,
                On::Support(support) => {
                    let lever = joined(&Vector3::zeros(), &site.place.translation.vector);
                    support.at(t).of_poses().drawn(&lever)
                }
                On::Body(body) => {
                    let Place { pose, twist } = &bodies[*body];
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

    /// True if the mass of the rod should be followed here: no fold is so near that it cannot stay on its equilibria, and it is not taut.
    /// `followed` tells whether it is now.
    fn holds(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        followed: bool,
        tolerance: f64,
    ) -> bool {
        if point.end.slack.is_some() {
            return false;
        }
        self.passage(light, (q, point), tolerance)
            .is_some_and(|fold| {
                let clear = CLEAR[usize::from(!followed)];
                fold.way > NEAR * q.norm() || !(fold.ahead <= clear * fold.inertial)
            })
    }

    /// The fold that the rod nears, by its normal form: with z and u the null vectors of J, scaled to u . J z = sigma, and (by the law of
    /// reciprocity) the wrench that z makes on the end, ell = s u, the fold lies sigma/(2 B) away along z, B = |u . D^2[z, z]|/2, and is reached
    /// after sigma^2/(4 A B), A = |u . drive|. None where that cannot be told.
    pub(super) fn passage(
        &self,
        light: &LightRod,
        (q, point): (&Wrench, &LinkPoint),
        tolerance: f64,
    ) -> Option<Passage> {
        let scale = self.gap_scale(&point.end);
        let svd = (scale * point.end.jacobian).svd(true, true);
        let least = svd.singular_values.imin();
        let sigma = svd.singular_values[least];
        let u = svd.u?.column(least).into_owned();
        let z = svd.v_t?.row(least).transpose();
        let motion = Swaying {
            rate: z,
            spin: Vector3::zeros(),
        };
        let inertia = self.inertia(&light.sections, (q, point), &motion, tolerance)?;
        let bend = u.dot(&(scale * self.second(&inertia)));
        let drive = u.dot(&(scale * point.drive()));
        let away = bend * drive >= 0.0;
        let (drive, bend) = (drive.abs(), 0.5 * bend.abs());
        // ell against u, where both are dual to velocities.
        let ell = point.end.resultants * z;
        let given = scale * u;
        let of = |rows: usize, column: usize| {
            let ell = ell.rows(rows, 3);
            let u = given.rows(column, 3);
            (ell.dot(&u), u.norm_squared())
        };
        let (force, couple) = (of(3, 3), of(6, 0));
        let (along, size) = match self.joint() {
            Joint::Weld => (force.0 + couple.0, force.1 + couple.1),
            Joint::Ball | Joint::Pins => force,
        };
        let stiffness = (along / size).abs();
        let mass = z.dot(&(inertia.matrix.fixed_view::<6, 6>(3, 3) * z));
        let ahead = sigma * sigma / (4.0 * drive * bend);
        Some(Passage {
            way: sigma / (2.0 * bend),
            ahead: if away { f64::INFINITY } else { ahead },
            inertial: mass.powf(0.4) * (stiffness * stiffness * drive * bend).powf(-0.2),
        })
    }
}

/// A fold ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passage {
    /// How far in the chart.
    pub way: f64,
    /// The time until it; infinite if the rod moves away from it.
    pub ahead: f64,
    /// T_i, the time in which inertia lets the rod go.
    pub inertial: f64,
}

impl Assembly {
    /// Gives rods mass that is followed to first order, one entry for each rod.
    ///
    /// # Errors
    /// A rod between two ball joints; a mass or inertia that is not finite and positive.
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
            if link.joint() == Joint::Pins {
                return refuse("between two ball joints it can spin about its chord as it likes");
            }
            if clamp_turns && link.distributed().is_some() {
                return refuse(
                    "it bears a load along it, and the clamp from which it is seen turns",
                );
            }
        }
        for (link, light) in self.links.iter_mut().zip(&light) {
            link.keeps_trace = light.is_some();
            link.clamp_turns = clamp_turns;
        }
        self.light = light;
        Ok(self)
    }

    /// The rods whose mass is followed to first order, by number; empty where there is none.
    pub fn light_rods(&self) -> impl Iterator<Item = (usize, &LightRod)> {
        let all = self.light.iter().enumerate();
        all.filter_map(|(k, light)| Some((k, light.as_ref()?)))
    }

    /// True if a rod has mass that is felt now.
    pub fn feels_rods(&self) -> bool {
        self.light_rods().any(|(_, light)| light.followed)
    }

    /// Lets the motion feel the mass of rod `k`, or not.
    pub fn feel(&mut self, k: usize, followed: bool) {
        if let Some(Some(light)) = self.light.get_mut(k) {
            light.followed = followed;
        }
    }

    /// True if the mass of rod `k` should be felt in this state.
    pub fn should_feel(&self, k: usize, at: &Evaluated, tolerance: f64) -> bool {
        let Some(Some(light)) = self.light.get(k) else {
            return false;
        };
        let rod = (&at.now.charts[k], &at.points[k]);
        self.links[k].holds(light, rod, light.followed, tolerance)
    }

    /// The clamp from which the bodies are seen, if they are.
    fn clamp(&self) -> Option<&Support<3>> {
        let mut supports = self.carriers.iter().map(|carrier| match carrier.mass() {
            Mass::Point(body) => body.support(),
            Mass::Rigid(body) => body.support(),
        });
        supports.find_map(|support| support)
    }

    /// The same at time `t`.
    fn seen_from(&self, t: f64) -> Option<Frame<6>> {
        Some(self.clamp()?.at(t).of_poses())
    }

    /// What rod `k` with mass is at this moment, followed or not; None where its chart is singular.
    pub fn weighed(&self, k: usize, at: &Evaluated, tolerance: f64) -> Option<Weighed> {
        let light = self.light.get(k)?.as_ref()?;
        let frame = self.seen_from(at.integrals.time);
        let point = &absolute(&at.points[k], frame.as_ref());
        let moving = self.links[k].moving(light, (&at.now.charts[k], point), tolerance)?;
        let Generalized {
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
        Some(Weighed {
            kinetic: 0.5 * moving.now.dot(&all),
            centre: point.base.pose.translation.vector + turn * centre,
            momentum: joined(&(turn * angular), &(turn * all.fixed_rows::<3>(0))),
        })
    }

    /// Kinetic energy of the rods whose mass is felt.
    pub fn rod_kinetic(&self, at: &Evaluated, tolerance: f64) -> f64 {
        let felt = self.light_rods().filter(|(_, light)| light.followed);
        felt.filter_map(|(k, _)| Some(self.weighed(k, at, tolerance)?.kinetic))
            .sum()
    }

    /// Adds to the wrenches on the bodies those of the inertia of the rods; None where one cannot be followed.
    pub(super) fn feel_rods(
        &self,
        at: &Evaluated,
        tolerance: f64,
        wrenches: &mut [Vector6<f64>],
    ) -> Option<Together> {
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
        // Along a groove the body is accelerated across it, too.
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
        let mut supported = Vec::new();
        for (k, light) in self.light_rods().filter(|(_, light)| light.followed) {
            let link = &self.links[k];
            let levers = link.levers(bodies);
            let point = &at.points[k];
            let mut drawn = link.drawn(t, (bodies, &bent));
            let mut driven = [&link.from, &link.to]
                .into_iter()
                .zip([&point.base, &point.tip])
                .map(|(site, place)| matches!(site.on, On::Support(_)).then_some(place.twist))
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
            if driven.iter().any(Option::is_some) {
                supported.push((k, felt, driven));
            }
        }
        let factors = matrix.cholesky()?;
        let together = factors.solve(&right);
        let mut power = 0.0;
        for (k, felt, driven) in supported {
            // Wrenches of both attachments on the rod.
            let mut wrench = felt.force;
            for (j, lever) in self.links[k].levers(bodies).iter().enumerate() {
                let Some((body, arm)) = lever else { continue };
                let rows = together.rows(starts[*body], self.carriers[*body].freedoms());
                let twist = carried(arm) * (&own[*body] * rows);
                wrench += felt.matrix.fixed_columns::<6>(6 * j) * twist;
            }
            for (i, twist) in driven.iter().enumerate() {
                let twist = twist.unwrap_or_default();
                power += wrench.fixed_rows::<6>(6 * i).dot(&twist);
            }
        }
        for (body, carrier) in self.carriers.iter().enumerate() {
            let rows = together.rows(starts[body], carrier.freedoms());
            let change = &own[body] * rows - free[body];
            wrenches[body] += masses[body] * change;
        }
        Some(Together {
            shared: factors.solve(&alone),
            power,
        })
    }
}

/// A place as a pose's frame counts it.
fn lever(place: &Place) -> Vector6<f64> {
    joined(&Vector3::zeros(), &place.pose.translation.vector)
}

/// The attachments with their twists in the world, along the axes of the clamp from which they are seen.
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

#[cfg(test)]
mod tests {
    use super::super::{Attachment, Configuration, Integrals};
    use super::*;
    use crate::body::Body;
    use crate::elastica::{self, Equilibrium};
    use crate::rod::Rod;
    use crate::section::Linear;
    use nalgebra::{Isometry3, Vector2};

    /// Catches a wrong scale of the null vectors, a wrong stiffness or a wrong mass: at the fold of the reference snap (theory 2.6) the
    /// planar rod has its normal form in closed form, and both are right up to the distance from it.
    #[test]
    fn folds_ahead_are_those_of_the_plane() {
        const EPS: f64 = 1e-3;
        let (fold, start) = ([0.639_250_507, 6.556_218_856], [0.7, 6.3]);
        let v = Vector2::new(0.0, -0.5);
        for off in [1e-2, 1e-3] {
            let [p, lam] = [0, 1].map(|k| fold[k] + off * (start[k] - fold[k]));
            let at = Equilibrium::from_lambda_p(lam, p).unwrap();
            let expected = elastica::Passage::new(at.p, at.w, &v).unwrap();
            let rod = Rod::new(1.0, Linear::diagonal([1.0; 2], 1.0).unwrap()).unwrap();
            let here = Isometry3::identity();
            let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
            let link = Link::new(rod, from, to, Joint::Ball);
            let body = Carrier::point(Body::new(1.0).unwrap());
            let light = LightRod {
                sections: SectionMass {
                    mass: EPS,
                    rotary: Vector3::zeros(),
                },
                followed: true,
            };
            let assembly = Assembly::new(vec![body], vec![link]).unwrap();
            let end = Vector3::new(at.y, 0.0, at.x);
            let force = Vector3::new(at.alpha.sin(), 0.0, at.alpha.cos()) * -lam * lam;
            let mut place = Place::at_rest(Isometry3::translation(end.x, end.y, end.z));
            place.twist = joined(&Vector3::zeros(), &Vector3::new(v.y, 0.0, v.x));
            let now = Configuration {
                bodies: vec![place],
                charts: vec![joined(&end.cross(&force), &force)],
            };
            let state = assembly.state(&now, &Integrals::default());
            let at = assembly.evaluated(&state, 1e-12).unwrap();
            let rod = (&at.now.charts[0], &at.points[0]);
            let found = assembly.links[0].passage(&light, rod, 1e-12).unwrap();
            let near = |found: f64, expected: f64| {
                let error = (found / expected - 1.0).abs();
                assert!(error < 10.0 * off, "{found} {expected}");
            };
            near(found.inertial, expected.inertial(EPS));
            near(found.ahead, expected.time_ahead());
        }
    }
}
