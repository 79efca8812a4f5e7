//! Distances of the rods of an assembly from obstacles. In motion the contact of rods is not followed, so the run ends
//! where a rod touches.

use super::{AssemblyRun, StateVector};
use crate::contact::{Mark, Marks, NearestPlace, nearest_place, way_of};
use crate::event::Outcome;
use crate::locate::{end_at_zero, seen_inside};
use crate::run::{RodBound, RodTouch};
use nalgebra::Vector3;
use snaprod_systems::assembly::Evaluated;
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::stepper::AcceptedStep;

/// Intervals of a rod; the centreline is interpolated between their ends.
const INTERVALS: usize = 32;
/// Intervals of the second look at the place that is nearest.
const FINER: usize = 8;
/// Gap, in lengths of the rod, below which the nearest place is looked at again.
const NEAR: f64 = 0.02;
impl<'a> AssemblyRun<'a> {
    /// Places of a rod at the given fractions of the rod's length.
    fn marks(&self, at: &Evaluated, rod: usize, places: &[f64]) -> Option<Marks> {
        let point = &at.points[rod];
        let link = &self.assembly.links()[rod];
        let seen = link
            .seen_at(at.integrals.time, &point.base.pose.rotation)
            .ok()?;
        let length = seen.rod().length();
        let at_places: Vec<f64> = places.iter().map(|s| s * length).collect();
        let sections = seen.shape(&at.now.charts[rod], &point.held(), &at_places, self.along());
        let base = point.base.pose;
        let mark = |(s, section): (&f64, snaprod_systems::rod::RodSection)| {
            let pose = base * section.pose();
            let strain = section.strain;
            let stretch = Vector3::new(strain[3], strain[4], strain[5]);
            Mark {
                s: *s,
                x: pose.translation.vector,
                along: pose.rotation * stretch * length,
            }
        };
        Some(places.iter().zip(sections.ok()?).map(mark).collect())
    }

    /// All rods at a state, and the one that is nearest to an obstacle.
    fn look_at_rods(&self, state: &StateVector) -> Option<(Vec<Marks>, Option<RodTouch>)> {
        let bodies = self.among()?;
        let at = (self.assembly).evaluated(&state.seen(self.until).0, self.along())?;
        let t = at.integrals.time;
        let even = |from: f64, to: f64, n: usize| -> Vec<f64> {
            (0..=n)
                .map(|i| from + (to - from) * i as f64 / n as f64)
                .collect()
        };
        let mut all = Vec::new();
        let mut touch: Option<RodTouch> = None;
        for (rod, link) in self.assembly.links().iter().enumerate() {
            let marks = self.marks(&at, rod, &even(0.0, 1.0, INTERVALS))?;
            let diameter = link.diameter().unwrap_or(0.0);
            let held = diameter / link.rod().length();
            let apart = [held, 1.0 - held];
            let mut found = nearest_place(&marks, bodies.gaps_of_rod(rod, t), apart);
            let close = |near: &&NearestPlace| near.gap - diameter < NEAR * link.rod().length();
            if let Some(near) = found.as_ref().filter(close) {
                // A second look where the rod is nearest.
                let first = near.first.saturating_sub(1);
                let last = (near.first + 2).min(INTERVALS);
                let fine = even(marks[first].s, marks[last].s, FINER);
                let fine = self.marks(&at, rod, &fine)?;
                found = nearest_place(&fine, bodies.gaps_of_rod(rod, t), apart);
            }
            if let Some(found) = found {
                let gap = found.gap - 0.5 * diameter;
                if touch.is_none_or(|touch| gap < touch.gap) {
                    touch = Some(RodTouch {
                        bound: RodBound::Touch,
                        rod,
                        obstacle: found.obstacle,
                        s: found.s * link.rod().length(),
                        gap,
                    });
                }
            }
            all.push(marks);
        }
        Some((all, touch))
    }

    /// Looks at the rods now. Returns the place that is nearest to an obstacle; None if rods pass through.
    pub(super) fn mark_rods(&mut self) -> Option<RodTouch> {
        if !self.contacts.as_ref()?.rods_touch {
            return None;
        }
        let (marks, touch) = self.look_at_rods(self.solver.state())?;
        self.extra.evaluations += 2;
        self.contacts.as_mut()?.marks = marks;
        touch
    }

    /// Shortens the step to the first touch of a rod with an obstacle. The inner None: the touch was lost.
    pub(super) fn rod_touch(
        &mut self,
        step: &mut AcceptedStep<StateVector>,
    ) -> Option<Option<Outcome>> {
        if !self.contacts.as_ref()?.rods_touch {
            return None;
        }
        let (marks, near) = self.look_at_rods(step.to())?;
        self.extra.evaluations += 2;
        let before = std::mem::replace(&mut self.contacts.as_mut()?.marks, marks.clone());
        let way = (before.iter().zip(&marks)).map(|(from, to)| way_of(from, to));
        let way = way.fold(0.0, f64::max);
        let nearest = |state: &StateVector| self.look_at_rods(state).and_then(|(_, near)| near);
        let mut cost = Cost::default();
        let mut found = near.filter(RodTouch::is_one).map(|touch| (1.0, touch));
        if found.is_none() {
            if near.is_none_or(|near| near.gap > way) {
                return None;
            }
            let f = self.right_hand_side();
            let look = |state: &StateVector| nearest(state).filter(RodTouch::is_one);
            let inside = seen_inside(step, &mut { f }, look, &mut cost);
            found = inside.flatten();
        }
        let gap = |state: &StateVector| nearest(state).map_or(f64::INFINITY, |near| near.gap);
        let f = self.right_hand_side();
        let shorter = found
            .map(|(part, touch)| end_at_zero(step, &mut { f }, (part, touch.gap), gap, &mut cost));
        self.extra.evaluations += cost.evaluations;
        let (_, touch) = found?;
        let Some(shorter) = shorter.flatten() else {
            return Some(None);
        };
        *step = shorter;
        self.solver
            .rewind(step.to().clone(), step.end_slope().clone());
        let there = self.look_at_rods(step.to()).and_then(|(_, near)| near);
        Some(Some(Outcome::RodTouch(there.unwrap_or(touch))))
    }
}
