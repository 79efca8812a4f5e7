//! Evaluation of rods between their attachments: end, tangent, wrenches on the attachments, index.

use super::attachment::{AttachedTo, Joint};
use super::body::BodyMotion;
use super::configuration::Configuration;
use super::network::Assembly;
use super::rod_element::{EndKind, Link, LinkEnd, LinkPoint};
use crate::error::Result;
use crate::math::se3::{halves, join};
use crate::rod::{EndConditions, Problem, Trace, Wrench};
use nalgebra::{Isometry3, Matrix6, SMatrix, Vector3, Vector6};
use std::borrow::Cow;
use std::sync::Arc;

/// Relative rotation (or couple) of the rod's end per unit base couple, at fixed force, below which the rod counts as
/// neutral.
const NEUTRAL: f64 = 1e-7;
/// Change of the chart, relative to 1 + |q|, at which the index is counted instead if the rod is neutral under its
/// force.
const ASIDE: f64 = 1e-6;

impl Link {
    /// End of the rod at the chart point q = (m(0), n), in units B/L, B/L^2, by integration from the base; for taut
    /// rods see [`Link::held`].
    ///
    /// # Errors
    /// As [`crate::rod::Rod::end`].
    pub fn end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let tolerance = self.finer(tolerance);
        let end = if self.is_loaded() {
            self.loaded_end(q, tolerance)
        } else {
            self.unloaded_end(q, tolerance)
        };
        Ok(self.with_slider(end?))
    }

    fn unloaded_end(&self, q: &Wrench, tolerance: f64) -> Result<LinkEnd> {
        let units = self.units();
        let base = q.component_mul(&units);
        let (found, trace) = if self.mass.is_none() {
            (self.rod.end(&base, tolerance)?, None)
        } else {
            let (found, trace) = self.rod.traced_end(&base, self.traces_turns(), tolerance)?;
            (found, Some(Arc::new(trace)))
        };
        let section = &found.section;
        let change = Matrix6::from_diagonal(&units);
        let tangent = found.tangent * change;
        // m(1) = m(0) - r(1) x n.
        let lever = section.position.cross_matrix() * change.fixed_rows::<3>(3);
        let couple = change.fixed_rows::<3>(0)
            + section.force.cross_matrix() * tangent.fixed_rows::<3>(3)
            - lever;
        let mut resultants = SMatrix::<f64, 9, 6>::zeros();
        resultants.fixed_rows_mut::<6>(0).copy_from(&change);
        resultants.fixed_rows_mut::<3>(6).copy_from(&couple);
        let (mut jacobian, mut drive) = (tangent, Matrix6::identity());
        let kind = match self.joints {
            [Joint::Weld, Joint::Weld] => EndKind::Welded { trace },
            [Joint::Weld, Joint::Ball] => {
                jacobian.fixed_rows_mut::<3>(0).copy_from(&couple);
                drive.fixed_rows_mut::<3>(0).fill(0.0);
                EndKind::OnBall { trace }
            }
            [Joint::Ball, _] => {
                let chord = section
                    .position
                    .try_normalize(f64::MIN_POSITIVE)
                    .unwrap_or_else(Vector3::z);
                (jacobian, drive) = self.along_chord(&tangent, &couple, section, &chord);
                // The base turns with the chord, and the force turns with it.
                let force = chord * chord.transpose() * change.fixed_rows::<3>(3);
                resultants.fixed_rows_mut::<3>(3).copy_from(&force);
                EndKind::Pinned {
                    chord,
                    per_couple: self.rod.length() / units[0],
                    trace,
                }
            }
        };
        Ok(LinkEnd {
            pose: section.pose(),
            base_couple: halves(q).0 * units[0],
            couple: section.couple,
            force: section.force,
            along: None,
            energy: section.energy,
            tangent,
            resultants,
            jacobian,
            drive,
            kind,
        })
    }

    /// Record of the integration to the end of the rod in base-wrench chart.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub(super) fn traced(&self, q: &Wrench, tolerance: f64) -> Result<Arc<Trace>> {
        let tolerance = self.finer(tolerance);
        let base = q.component_mul(&self.units());
        let trace = if self.load.is_none() {
            let turns = self.traces_turns();
            self.rod.traced_end(&base, turns, tolerance)?.1
        } else {
            let problem = self.base_wrench_problem(tolerance)?;
            problem.traced_loaded_end(&base, self.base_turns())?.1
        };
        Ok(Arc::new(trace))
    }

    /// True if the record of an integration includes turns of the base.
    fn traces_turns(&self) -> bool {
        self.base_turns() || self.clamp_turns
    }

    /// The rod between its attachments at time `t`.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub fn point(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        q: &Wrench,
        tolerance: f64,
    ) -> Result<LinkPoint> {
        let (base, tip) = (self.from.at(t, bodies), self.to.at(t, bodies));
        let seen = self.seen_at(t, &base.pose.rotation)?;
        let end = seen.held(q, &base.pose.inv_mul(&tip.pose), tolerance)?;
        let driven = seen.drive_at(t, q, &end, tolerance)?;
        if let (Some(found), Cow::Owned(_)) = (end.taut(), &seen) {
            self.last_taut.keep(found);
        }
        let mut point = self.placed(t, bodies, end);
        point.driven = driven;
        Ok(point)
    }

    /// The rod at rest at the chart point of the evaluated rod `known`, from which it differs little
    /// ([`Link::held_beside`]).
    pub(super) fn point_beside(
        &self,
        bodies: &[BodyMotion],
        q: &Wrench,
        known: &LinkEnd,
        tolerance: f64,
    ) -> Result<LinkPoint> {
        let (base, tip) = (self.from.at(0.0, bodies), self.to.at(0.0, bodies));
        let seen = self.seen_at(0.0, &base.pose.rotation)?;
        let end = seen.held_beside(q, &base.pose.inv_mul(&tip.pose), known, tolerance)?;
        Ok(self.placed(0.0, bodies, end))
    }

    /// A known end placed between its attachments at time `t`; the base of a rod between ball joints is turned along
    /// its chord.
    pub(super) fn placed(&self, t: f64, bodies: &[BodyMotion], end: LinkEnd) -> LinkPoint {
        let (base, tip) = (self.from.at(t, bodies), self.to.at(t, bodies));
        let spin = 0.0;
        let mut point = LinkPoint {
            base,
            tip,
            end,
            spin,
            driven: None,
        };
        point.align();
        point
    }

    /// Equilibrium problem of the rod with its end held by its joint at a pose relative to the base.
    pub(super) fn held_at(&self, end: &Isometry3<f64>, tolerance: f64) -> Result<Problem> {
        let conditions = match self.joint() {
            Joint::Weld => EndConditions::pose(end.translation.vector, end.rotation),
            // Between two ball joints as if the base were clamped.
            Joint::Ball => EndConditions::ball(end.translation.vector),
        };
        self.bearing(conditions, tolerance)
    }

    /// Morse index of the rod with its end held as it is: number of directions in which it could buckle to less
    /// energy.
    ///
    /// # Errors
    /// As [`Problem::index_at`]; as [`Rod::taut`](crate::rod::Rod::taut).
    pub fn index(&self, q: &Wrench, held: &Isometry3<f64>, tolerance: f64) -> Result<usize> {
        if self.is_taut(q, held) {
            return self.rod.taut_index(&*self.solve_taut(q, held, tolerance)?);
        }
        // The index depends on which components are held, not on the pose.
        if self.is_pinned() {
            return self.pinned_index(q, held, tolerance);
        }
        let problem = self.held_at(&Isometry3::identity(), tolerance)?;
        let count = |q: &Wrench| problem.index_at(&q.component_mul(&self.units()));
        // Count first with dead force. If the rod is neutral under that force (an elastica free to turn about its
        // force), rounding decides the count; nearby it does not, and away from folds the index of the held rod is
        // the same there.
        let end = self.end(q, tolerance)?;
        let loaded = (self.gap_scale(&end) * end.jacobian)
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        if loaded.singular_values().min() < NEUTRAL && self.regular(&end).is_some() {
            let aside = Wrench::new(0.6, -0.8, 0.3, 0.7, 0.4, -0.5) * (ASIDE * (1.0 + q.norm()));
            if let (Ok(a), Ok(b)) = (count(&(q + aside)), count(&(q - aside)))
                && a == b
            {
                return Ok(a);
            }
        }
        count(q)
    }
}

impl Assembly {
    /// Rod `k` of a configuration in place, with its spin.
    ///
    /// # Errors
    /// As [`Link::end`].
    pub(super) fn placed(
        &self,
        t: f64,
        now: &Configuration,
        k: usize,
        tolerance: f64,
    ) -> Result<LinkPoint> {
        let point = self.links[k].point(t, &now.bodies, &now.charts[k], tolerance)?;
        Ok(match now.spin(k) {
            None => point,
            Some(spin) => point.spinning(spin),
        })
    }

    /// All rods between their attachments.
    ///
    /// # Errors
    /// As [`Link::end`], with the rod's number.
    pub fn points(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        charts: &[Wrench],
        tolerance: f64,
    ) -> Result<Vec<LinkPoint>> {
        let links = self.links.iter().zip(charts).enumerate();
        links
            .map(|(k, (link, q))| {
                link.point(t, bodies, q, tolerance)
                    .map_err(|why| why.context(self.rod_name(k)))
            })
            .collect()
    }

    /// Sum of the rods' wrenches on every body, about its reference point in the world.
    pub fn wrenches(&self, bodies: &[BodyMotion], points: &[LinkPoint]) -> Vec<Vector6<f64>> {
        let mut sums = vec![Vector6::zeros(); bodies.len()];
        for (link, point) in self.links.iter().zip(points) {
            for (site, wrench) in [&link.from, &link.to].into_iter().zip(point.wrenches()) {
                if let Some(body) = site.carried_by() {
                    sums[body] += site.moved(bodies, &wrench);
                }
            }
        }
        // The wrench on a joint's node acts on the body that carries the joint.
        for (node, carrier) in self.carriers.iter().enumerate() {
            let Some((joint, parent)) = carrier
                .joint()
                .and_then(|joint| Some((joint, joint.parent()?)))
            else {
                continue;
            };
            let [at, from] = [node, parent].map(|k| bodies[k].pose.translation.vector);
            let (m, n) = halves(&sums[node]);
            let m = if joint.is_ball() { Vector3::zeros() } else { m };
            sums[parent] += join(&(m + (at - from).cross(&n)), &n);
        }
        sums
    }

    /// Power of moving supports and of section laws in time on the rods.
    pub fn power_on_rods(&self, points: &[LinkPoint]) -> f64 {
        let mut power = 0.0;
        for (link, point) in self.links.iter().zip(points) {
            power += point.driven.as_ref().map_or(0.0, |driven| driven.power);
            let ends = [(&link.from, &point.base), (&link.to, &point.tip)];
            for ((site, place), wrench) in ends.into_iter().zip(point.wrenches()) {
                let carrier = site
                    .carried_by()
                    .and_then(|body| self.carriers[body].joint());
                let on = carrier.map_or(&site.on, |joint| &joint.on().on);
                if let AttachedTo::Support(_) = on {
                    power -= wrench.dot(&place.twist);
                }
            }
        }
        power
    }
}
