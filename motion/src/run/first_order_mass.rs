//! Runs on a rod of small mass: switches between motions with and without the first-order mass, and the
//! energy exchanged at each switch.

use super::{OnSheet, Phase, Progress, Run, Sample};
use crate::body_with_rod::{force_of_mass, rod_error};
use crate::locate::first_change;
use crate::sheet::{Glide, MassNow, MassTreatment};
use snaprod_systems::error::Result;
use snaprod_systems::manifold::{FirstOrderInertia, Multivalued};
use std::mem;
use std::ops::ControlFlow;

/// Largest kinetic energy of the rod, as a part of the body's, at which a motion begins to feel the rod's mass.
const MOST_OF_BODY: f64 = 0.1;
/// Samples per step in the search for the moment at which the mass is first followed or given up. The motion
/// may qualify for less than one step: slow at a turning point, or near a fold.
const PLACES: u32 = 16;
/// Margin at both ends of a step with which the mass is taken to be followed throughout. Minima between are
/// not searched, which would cost a quarter of a step.
const AMPLE: f64 = 0.25;

impl<'a, M: Multivalued<N>, const N: usize> Run<'a, M, N> {
    /// Kinetic and potential energy of the rod.
    pub(super) fn of_rod(&self, phase: &Phase<N>) -> [f64; 2] {
        if self.motion.passes_straight() {
            return self.motion.energies_beside(phase).unwrap_or_default();
        }
        let rod = self.body.rod();
        let error = rod_error(self.body, self.options.tolerance);
        let frame = self.body.support().map(|support| support.at(phase.t));
        rod.and_then(|rod| rod.energies(frame.as_ref(), [&phase.q, &phase.v], error))
            .unwrap_or_default()
    }

    /// The state with the mass of the rod: the force on the body is that of the equilibrium plus that of the
    /// rod's inertia. Next to the straight rod the latter is unknown and left out.
    pub(super) fn with_mass(&self, phase: Phase<N>) -> Sample<N> {
        if !self.followed {
            return self.with_energies(phase, [0.0; 2]);
        }
        let mut state = self.with_energies(phase, self.of_rod(&phase));
        let error = rod_error(self.body, self.options.tolerance);
        let rod = (self.body.rod()).filter(|_| !self.motion.passes_straight());
        let felt = rod.and_then(|rod| {
            let at = self.manifold.point(&phase.q)?;
            force_of_mass(rod, self.body, &phase, &at, error)
        });
        if let Some(felt) = felt {
            state.force += felt;
        }
        state
    }

    /// Switches to a motion with (`rod`) or without the rod's mass, from the state `from` to `to`. The change
    /// of energy is counted in `snapped`: as lost to vibrations of the rod where the mass is given up, and as
    /// regained where it is followed again. Both belong to the snap between.
    fn follow(&mut self, rod: bool, from: Phase<N>, to: Phase<N>) -> Result<()> {
        let before = self.describe(from).ledger.total();
        let orientation = self.motion.orientation();
        let followed = self.body.rod().filter(|_| rod);
        let motion = OnSheet::new(
            self.manifold,
            self.body,
            to,
            orientation,
            followed,
            &self.options,
        )?;
        self.past = self.cost();
        self.followed = rod;
        self.motion = motion;
        self.straight = None;
        self.snapped += before - self.describe(to).ledger.total();
        Ok(())
    }

    /// A step of the motion, with the mass of the rod where it can be followed.
    pub(super) fn step(&mut self) -> Result<Option<Progress>> {
        let Some(rod) = self.body.rod() else {
            return Ok(self.motion.step(self.end_of_step()));
        };
        let from = self.motion.phase().t;
        let progress = self.step_on(rod);
        if !self.followed {
            self.unfelt += self.motion.phase().t - from;
        }
        progress
    }

    fn step_on(&mut self, rod: &'a dyn FirstOrderInertia<N>) -> Result<Option<Progress>> {
        let end = self.options.duration;
        let (due, mut room) = (self.due.take(), self.room.take());
        let distance = match self.step_past_straight(rod)? {
            ControlFlow::Break(progress) => return Ok(progress),
            ControlFlow::Continue(distance) => distance,
        };
        let from = self.motion.phase();
        let holds = due.unwrap_or_else(|| (self.room(rod, &from) > 0.0) == self.followed);
        if holds != self.followed {
            self.follow(holds, from, from)?;
            room = None;
        }
        let mut progress = self.motion.step(end);
        if progress.is_some() {
            let now = MassNow {
                followed: self.followed,
                shakes: false,
            };
            if (self.motion).ends_at_straight(rod, now, distance) {
                (progress, self.at_edge) = (Some(Progress::Moved), true);
            }
            if self.ends_where_it_changes(rod, &from, room) {
                self.at_edge = false;
                return Ok(Some(Progress::Moved));
            }
        }
        if self.followed && !matches!(progress, Some(Progress::Moved | Progress::Arrived)) {
            // The step with mass failed, or met a fold that the normal form had not predicted.
            self.follow(false, from, from)?;
            (self.due, self.room) = (None, None);
            return Ok(self.motion.step(end));
        }
        Ok(progress)
    }

    /// Event function, positive as long as `followed` is to stay as it is. Without the rod's mass, a body
    /// that shakes along a nearly straight rod sweeps the rod across. The kinetic energy of the rod would
    /// have to come from nowhere: there the rod itself shakes and is not on its equilibria.
    fn room(&self, rod: &'a dyn FirstOrderInertia<N>, at: &Phase<N>) -> f64 {
        let room = rod.validity_margin(&at.q, &at.v, self.followed);
        if self.followed {
            return room;
        }
        let [kinetic, _] = self.of_rod(at);
        (kinetic / (MOST_OF_BODY * self.describe(*at).ledger.kinetic) - 1.0).max(-room)
    }

    /// Ends the last step at the moment at which the rod's mass ceases or begins to be followed; the next
    /// step switches. The motion depends on this moment, so it must not depend on where steps end, nor be
    /// missed within a step. False if the step is unchanged.
    fn ends_where_it_changes(
        &mut self,
        rod: &'a dyn FirstOrderInertia<N>,
        from: &Phase<N>,
        room: Option<f64>,
    ) -> bool {
        let now = self.followed;
        let before = room.unwrap_or_else(|| self.room(rod, from));
        let after = self.room(rod, &self.motion.phase());
        if now && before.min(after) > AMPLE {
            (self.due, self.room) = (Some(now), Some(after));
            return false;
        }
        let inside = self.motion.inside();
        let fraction =
            inside.and_then(|inside| first_change(inside, PLACES, |at| self.room(rod, at)));
        let ends = fraction.is_some_and(|fraction| self.motion.end_after(fraction));
        self.due = (ends || after > 0.0).then_some(ends != now);
        ends
    }

    /// Continues next to the straight rod with the rod's mass; false if that fails.
    pub(super) fn go_straight(
        &mut self,
        rod: &'a dyn FirstOrderInertia<N>,
        glide: Glide<N>,
    ) -> bool {
        let before = self.now().ledger.total();
        if self.motion.go_straight(rod, glide).is_none() {
            return false;
        }
        self.followed = true;
        let after = self.now().ledger.total();
        self.straight = Some(after - self.snapped);
        self.snapped += before - after;
        true
    }

    /// A step next to the straight rod, with its mass if possible. `Continue`: no step taken; the distance
    /// from the straight rod.
    fn step_past_straight(
        &mut self,
        rod: &'a dyn FirstOrderInertia<N>,
    ) -> Result<ControlFlow<Option<Progress>, f64>> {
        let (from, end) = (self.motion.phase(), self.options.duration);
        if let Some(left) = self.motion.leaves_straight() {
            self.follow(left.is_some(), from, left.unwrap_or(from))?;
            return Ok(ControlFlow::Continue(0.0));
        }
        if !self.motion.passes_straight() {
            let at_edge = mem::take(&mut self.at_edge);
            let now = MassNow {
                followed: self.followed,
                shakes: self.shakes,
            };
            let near = self.motion.nears_straight(rod, now, at_edge);
            self.shakes = matches!(near.passage, MassTreatment::Shakes);
            match near.passage {
                MassTreatment::None => return Ok(ControlFlow::Continue(near.distance)),
                MassTreatment::Glides(glide) => {
                    if !self.go_straight(rod, *glide) {
                        return Ok(ControlFlow::Continue(near.distance));
                    }
                }
                MassTreatment::Shakes => {
                    if self.followed {
                        self.follow(false, from, from)?;
                    }
                    let mut progress = self.motion.step(end);
                    if progress.is_some()
                        && (self.motion).ends_at_straight(rod, MassNow::SHAKES, near.distance)
                    {
                        (progress, self.at_edge) = (Some(Progress::Moved), true);
                    }
                    return Ok(ControlFlow::Break(progress));
                }
            }
        }
        let progress = self.motion.glide(end);
        if progress.is_none() {
            self.follow(false, from, from)?;
            return Ok(ControlFlow::Continue(0.0));
        }
        Ok(ControlFlow::Break(progress))
    }
}
