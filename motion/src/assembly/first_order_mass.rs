//! First-order mass of the rods of an assembly: the times at which a motion feels it, and the energy booked
//! at each change (theory 3.9).

use super::step::StepProgress;
use super::{AssemblyRun, StateVector};
use crate::locate::{Timed, first_change, shorten_step};
use crate::options::Options;
use snaprod_systems::assembly::{Assembly, Evaluated};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::Method;
use std::sync::Arc;

/// Samples per step in the search for the moment at which the mass of a rod begins or ceases to act.
const PLACES: u32 = 8;
/// Least margin at both ends of a step for which the mass of a rod acts throughout the step without a search.
const AMPLE: f64 = 0.25;
/// Margin at a change that was located: 0 up to rounding.
const FOUND: f64 = 1e-6;
/// Factor by which the tolerance along a rod is loosened if its energy cannot be computed at the first.
const LOOSER: f64 = 100.0;

/// Refuses symmetric steps for rods with mass: they do not follow the mass.
pub(super) fn check(assembly: &Assembly, options: &Options) -> Result<()> {
    match assembly.light_rods().next() {
        Some((k, _)) if options.method == Method::Symmetric => Err(Error::domain(format!(
            "run.method = \"symmetric\": {} has mass that is followed to first order, which symmetric steps do not; leave the method out, \
             or write inertia = \"none\"",
            assembly.rod_name(k)
        ))),
        _ => Ok(()),
    }
}

impl AssemblyRun<'_> {
    /// Feels the mass of every rod that can be followed, from now on. The kinetic energy of a rod is booked
    /// as lost to its vibrations where its mass ceases to act, and as regained where its mass acts again.
    pub(super) fn weigh(&mut self) -> Option<()> {
        let due = self.due.take();
        if due.as_ref().is_some_and(Vec::is_empty) {
            return Some(());
        }
        let at = (self.assembly).evaluated(&self.solver.state().0, self.along())?;
        self.extra.evaluations += 1;
        let changed = due.unwrap_or_else(|| self.changing(&self.assembly, &at, 0.0));
        self.change(&at, &changed)
    }

    /// Margins of the rods: number, whether the mass acts, and the margin until this changes.
    fn rooms(&self, assembly: &Assembly, at: &Evaluated) -> Vec<(usize, bool, f64)> {
        let rods = assembly.light_rods();
        let each = rods.map(|(k, light)| {
            let room = match (self.unfit[k], light.followed) {
                (true, true) => -1.0,
                (true, false) => 1.0,
                (false, _) => assembly.inertia_margin(k, at, self.along()),
            };
            (k, light.followed, room)
        });
        each.collect()
    }

    /// Rods with no more than the margin `room`, each with the new value of its flag: true if the mass acts.
    fn changing(&self, assembly: &Assembly, at: &Evaluated, room: f64) -> Vec<(usize, bool)> {
        let rooms = self.rooms(assembly, at).into_iter();
        let ended = rooms.filter(|(.., left)| !(*left > room));
        ended.map(|(k, followed, _)| (k, !followed)).collect()
    }

    /// Ends the last step at the moment at which the mass of a rod ceases or begins to act; the next step
    /// switches. The motion depends on this moment, so it must not depend on where steps end, nor be missed
    /// within a step. False if the step is unchanged; None if the motion cannot continue from the moment.
    fn ends_where_it_changes(&mut self, room: Option<f64>) -> Option<bool> {
        let Some(taken) = &self.step else {
            return Some(false);
        };
        let (assembly, slowed) = self.taken_by.clone();
        let along = self.along();
        let evaluated = |state: &StateVector| assembly.evaluated(&state.0, along);
        let room_at = |state: &StateVector| {
            let rooms = evaluated(state).map(|at| self.rooms(&assembly, &at));
            let rooms = rooms.into_iter().flatten().map(|(.., room)| room);
            rooms.fold(f64::INFINITY, f64::min)
        };
        let before = room.unwrap_or_else(|| room_at(taken.from()));
        let after = room_at(taken.to());
        let all_felt = assembly.light_rods().all(|(_, light)| light.followed);
        if all_felt && before.min(after) > AMPLE {
            (self.due, self.room) = (Some(Vec::new()), Some(after));
            return Some(false);
        }
        let mut step = taken.clone();
        let f = &self.right_hand_side();
        let mut cost = Cost::default();
        let found = step.interpolant(&mut { f }, &mut cost).and_then(|dense| {
            let fraction = first_change(|x| dense.at(x), PLACES, room_at)?;
            let due = self.changing(&assembly, &evaluated(&dense.at(fraction))?, FOUND);
            Some((shorten_step(&step, &mut { f }, fraction, &mut cost)?, due))
        });
        self.extra.evaluations += cost.evaluations;
        self.extra.samples += cost.samples;
        let Some((part, due)) = found else {
            (self.due, self.room) = ((after > 0.0).then(Vec::new), Some(after));
            return Some(false);
        };
        let h = self.solver.next_step();
        self.assembly = assembly;
        self.resume(part.to().clone(), slowed, h)?;
        (self.step, self.dense) = (Some(part), None);
        (self.due, self.room) = (Some(due), None);
        Some(true)
    }

    /// Switches the mass of rods on or off. A rod whose energy cannot be computed here is not switched on.
    /// None if a rod cannot be switched off for that reason: no energy may be lost unseen.
    fn change(&mut self, at: &Evaluated, changed: &[(usize, bool)]) -> Option<()> {
        let along = self.along();
        let weighed = |k: usize| {
            let mut each = [along, LOOSER * along].into_iter();
            each.find_map(|tolerance| self.assembly.weighed(k, at, tolerance))
        };
        let mut booked = Vec::new();
        for (k, felt) in changed {
            match (weighed(*k), felt) {
                (Some(rod), _) => booked.push((*k, *felt, rod.kinetic)),
                (None, true) => {}
                (None, false) => return None,
            }
        }
        if booked.is_empty() {
            return Some(());
        }
        for (k, felt, energy) in &booked {
            self.released += if *felt { -energy } else { *energy };
            Arc::make_mut(&mut self.assembly).set_inertia(*k, *felt);
        }
        self.room = None;
        let (state, h) = (self.solver.state().clone(), self.solver.next_step());
        self.resume(state, self.slowed.clone(), h)
    }

    /// A step, as [`AssemblyRun::advance_to`], with the mass of the rods that can be followed.
    pub(super) fn advance_with_rods(&mut self, end: f64) -> Option<StepProgress> {
        let from = self.solver.state().time();
        let progress = self.advance_weighed(end);
        if self.assembly.light_rods().any(|(_, light)| !light.followed) {
            self.unfelt += self.solver.state().time() - from;
        }
        progress
    }

    fn advance_weighed(&mut self, end: f64) -> Option<StepProgress> {
        if self.assembly.light_rods().next().is_none() {
            return self.advance_to(end);
        }
        self.weigh()?;
        let room = self.room.take();
        let (from, near) = (self.solver.state().clone(), self.near.clone());
        let progress = self.advance_to(end);
        if progress.is_some() && self.ends_where_it_changes(room)? {
            self.near = near;
            return Some(StepProgress::Moved);
        }
        // A fold that the normal form had not predicted, or no step at all.
        let lost = match &progress {
            Some(StepProgress::Fold { rods, .. }) => self.felt(Some(rods)),
            Some(_) => Vec::new(),
            None => self.felt(None),
        };
        if lost.is_empty() {
            return progress;
        }
        self.near = near;
        self.give_up(from, &lost)?;
        self.advance_to(end)
    }

    /// Goes back to `state` and continues without the mass of `rods`, until they have landed.
    pub(super) fn give_up(&mut self, state: StateVector, rods: &[usize]) -> Option<()> {
        let h = self.solver.next_step();
        self.resume(state, None, h)?;
        (self.due, self.room) = (None, None);
        for k in rods {
            self.unfit[*k] = true;
        }
        self.weigh()
    }

    /// Numbers of the rods with mass in the motion; `among` restricts the choice to listed rods.
    pub(super) fn felt(&self, among: Option<&[(usize, f64)]>) -> Vec<usize> {
        let told = |k: &usize| among.is_none_or(|rods| rods.iter().any(|(rod, _)| rod == k));
        let felt = self
            .assembly
            .light_rods()
            .filter(|(_, light)| light.followed);
        felt.map(|(k, _)| k).filter(told).collect()
    }
}
