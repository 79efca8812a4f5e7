//! A run on a rod of small mass: where its mass is followed to first order, where not, and what energy changes hands between.

use super::{OnSheet, Phase, Progress, Run, Sample};
use crate::body_with_rod::{force_of_mass, rod_error};
use crate::locate::changes;
use crate::sheet::{Glide, Passage};
use snaprod_systems::error::Result;
use snaprod_systems::manifold::{Multivalued, RodMass};
use std::mem;
use std::ops::ControlFlow;

/// A motion begins to feel the mass of a rod that then has at most this part of the kinetic energy of its body.
const MOST_OF_BODY: f64 = 0.1;
/// Places within a step at which it is looked whether the mass of a rod is begun to be followed, or given up: a body that is turned round may be slow enough for
/// less than a step, and a fold near for less than one.
const PLACES: u32 = 16;
/// Room at both ends of a step with which a mass that is followed stays so. Lows between are not looked for: that would cost a quarter of a step.
const AMPLE: f64 = 0.25;

impl<'a, M: Multivalued<N>, const N: usize> Run<'a, M, N> {
    /// Kinetic energy and potential of the rod.
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

    /// The state with what the mass of the rod does, where that is felt: the force on the body is that of the equilibrium and that of its inertia. Beside the
    /// straight rod the latter is not known.
    pub(super) fn with_mass(&self, phase: Phase<N>) -> Sample<N> {
        if !self.followed {
            return self.with_energies(phase, [0.0; 2]);
        }
        let mut state = self.with_energies(phase, self.of_rod(&phase));
        let error = rod_error(self.body, self.options.tolerance);
        let rod = (self.body.rod()).filter(|_| !self.motion.passes_straight());
        let felt = rod.and_then(|rod| {
            let at = self.manifold.point(&phase.q)?;
            force_of_mass(rod, self.body, (&phase, &at), error)
        });
        if let Some(felt) = felt {
            state.force += felt;
        }
        state
    }

    /// Goes on from the state `to`, after `from`, with the mass of the rod, or without it. What energy is lost there, as the rod's own where the motion ceases
    /// to follow it, is counted as lost to vibrations, and as got back where it does again: both belong to the snap between.
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

    /// A step of the motion, with the mass of the rod where that can be followed.
    pub(super) fn step(&mut self) -> Result<Option<Progress>> {
        let Some(rod) = self.body.rod() else {
            return Ok(self.motion.step(self.options.duration));
        };
        let from = self.motion.phase().t;
        let progress = self.step_on(rod);
        if !self.followed {
            self.unfelt += self.motion.phase().t - from;
        }
        progress
    }

    fn step_on(&mut self, rod: &'a dyn RodMass<N>) -> Result<Option<Progress>> {
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
            if (self.motion).ends_at_straight(rod, (self.followed, false), distance) {
                (progress, self.at_edge) = (Some(Progress::Moved), true);
            }
            if self.ends_where_it_changes(rod, (&from, room)) {
                self.at_edge = false;
                return Ok(Some(Progress::Moved));
            }
        }
        if self.followed && !matches!(progress, Some(Progress::Moved | Progress::Arrived)) {
            // No step could be taken with the mass, or one came upon a fold of which its normal form did not tell.
            self.follow(false, from, from)?;
            (self.due, self.room) = (None, None);
            return Ok(self.motion.step(end));
        }
        Ok(progress)
    }

    /// Positive as long as the mass of the rod is to be followed on, or not, as it is now. A motion without the mass of its rod that shakes along an all but straight one would
    /// have to get the energy of a rod that is swept across from nowhere; it is the rod that shakes there, and its equilibria are not what it is on.
    fn room(&self, rod: &'a dyn RodMass<N>, at: &Phase<N>) -> f64 {
        let room = rod.room(&at.q, &at.v, self.followed);
        if self.followed {
            return room;
        }
        let [kinetic, _] = self.of_rod(at);
        (kinetic / (MOST_OF_BODY * self.describe(*at).ledger.kinetic) - 1.0).max(-room)
    }

    /// Looks whether the mass of the rod ceases to be followed in the step that was just taken, or begins to be, and ends the step at that moment: the motion
    /// depends on it, so that it must not be where a step happens to end, nor missed where it lasts for less than a step. The next step goes on the other way. False where the step
    /// stays as it is.
    fn ends_where_it_changes(
        &mut self,
        rod: &'a dyn RodMass<N>,
        (from, room): (&Phase<N>, Option<f64>),
    ) -> bool {
        let now = self.followed;
        let before = room.unwrap_or_else(|| self.room(rod, from));
        let after = self.room(rod, &self.motion.phase());
        if now && before.min(after) > AMPLE {
            (self.due, self.room) = (Some(now), Some(after));
            return false;
        }
        let inside = self.motion.inside();
        let fraction = inside.and_then(|inside| changes(inside, PLACES, |at| self.room(rod, at)));
        let ends = fraction.is_some_and(|fraction| self.motion.end_after(fraction));
        self.due = (ends || after > 0.0).then_some(ends != now);
        ends
    }

    /// Goes on next to the straight rod with its mass.
    pub(super) fn go_straight(&mut self, rod: &'a dyn RodMass<N>, glide: Glide<N>) -> bool {
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

    /// A step next to the straight rod, with its mass where that can be followed; elsewhere none, but how far it is from there.
    fn step_past_straight(
        &mut self,
        rod: &'a dyn RodMass<N>,
    ) -> Result<ControlFlow<Option<Progress>, f64>> {
        let (from, end) = (self.motion.phase(), self.options.duration);
        if let Some(left) = self.motion.leaves_straight() {
            self.follow(left.is_some(), from, left.unwrap_or(from))?;
            return Ok(ControlFlow::Continue(0.0));
        }
        if !self.motion.passes_straight() {
            let (at_edge, known) = (mem::take(&mut self.at_edge), (self.followed, self.shakes));
            let near = self.motion.nears_straight(rod, known, at_edge);
            self.shakes = matches!(near.passage, Passage::Shakes);
            match near.passage {
                Passage::None => return Ok(ControlFlow::Continue(near.distance)),
                Passage::Glides(glide) => {
                    if !self.go_straight(rod, *glide) {
                        return Ok(ControlFlow::Continue(near.distance));
                    }
                }
                Passage::Shakes => {
                    if self.followed {
                        self.follow(false, from, from)?;
                    }
                    let mut progress = self.motion.step(end);
                    if progress.is_some()
                        && (self.motion).ends_at_straight(rod, (false, true), near.distance)
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
