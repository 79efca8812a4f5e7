//! Where a motion feels the mass of its rods to first order, and where it does not (theory 3.9).

use super::step::Progress;
use super::{AssemblyRun, Numbers};
use crate::locate::{Timed, changes, part};
use crate::options::Options;
use snaprod_systems::assembly::{Assembly, Evaluated};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::solve::cost::Cost;
use snaprod_systems::solve::integrator::Method;
use std::sync::Arc;

/// Places within a step at which it is looked whether the mass of a rod is begun to be felt, or given up.
const PLACES: u32 = 8;
/// Room at both ends of a step with which masses that are felt stay so.
const AMPLE: f64 = 0.25;
/// Room with which a mass ceases to be felt, or begins to be, where that was found: it is 0 there up to rounding.
const FOUND: f64 = 1e-6;
/// Where the energy of a rod cannot be told at the tolerance along it, it is told at one that is so much looser.
const LOOSER: f64 = 100.0;

/// Refuses symmetric steps where rods have mass, which they do not follow.
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

impl AssemblyRun {
    /// Feels, from here on, the mass of every rod where it can be followed. What energy a rod has is counted as lost, to vibrations of its own,
    /// where the motion ceases to feel it, and as got back where it does again.
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

    /// How much room there is for the mass of each rod to stay felt, or not, as it is now.
    fn rooms(&self, assembly: &Assembly, at: &Evaluated) -> Vec<(usize, bool, f64)> {
        let rods = assembly.light_rods();
        let each = rods.map(|(k, light)| {
            let room = match (self.unfit[k], light.followed) {
                (true, true) => -1.0,
                (true, false) => 1.0,
                (false, _) => assembly.room(k, at, self.along()),
            };
            (k, light.followed, room)
        });
        each.collect()
    }

    /// The rods whose mass is to be felt from a state on, and is not, or is, and is to be felt no more: those with no more than so much room.
    fn changing(&self, assembly: &Assembly, at: &Evaluated, room: f64) -> Vec<(usize, bool)> {
        let rooms = self.rooms(assembly, at).into_iter();
        let ended = rooms.filter(|(.., left)| !(*left > room));
        ended.map(|(k, followed, _)| (k, !followed)).collect()
    }

    /// Looks whether the mass of a rod ceases to be felt in the step that was just taken, or begins to be, and ends the step at that moment: the motion depends on
    /// it, so that it must not be where a step happens to end, nor missed where it lasts for less than one. The next step goes on the other way. False where the step stays as it is; None
    /// where the motion cannot go on from there.
    fn ends_where_it_changes(&mut self, room: Option<f64>) -> Option<bool> {
        let Some(taken) = &self.step else {
            return Some(false);
        };
        let (assembly, slowed) = self.taken_by.clone();
        let along = self.along();
        let evaluated = |state: &Numbers| assembly.evaluated(&state.0, along);
        let room_at = |state: &Numbers| {
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
        let found = step.inside(&mut { f }, &mut cost).and_then(|dense| {
            let fraction = changes(|x| dense.at(x), PLACES, room_at)?;
            let due = self.changing(&assembly, &evaluated(&dense.at(fraction))?, FOUND);
            Some((part(&step, &mut { f }, fraction, &mut cost)?, due))
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

    /// Feels the mass of rods from here on, or no more. A rod whose energy cannot be told here is not begun to be followed; where one that is
    /// followed cannot be let go for that reason, None, so that no energy is lost unseen.
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
            Arc::make_mut(&mut self.assembly).feel(*k, *felt);
        }
        self.room = None;
        let (state, h) = (self.solver.state().clone(), self.solver.next_step());
        self.resume(state, self.slowed.clone(), h)
    }

    /// A step, as [`AssemblyRun::advance_to`], that feels the mass of rods where it can be followed.
    pub(super) fn advance_with_rods(&mut self, end: f64) -> Option<Progress> {
        let from = self.solver.state().time();
        let progress = self.advance_weighed(end);
        if self.assembly.light_rods().any(|(_, light)| !light.followed) {
            self.unfelt += self.solver.state().time() - from;
        }
        progress
    }

    fn advance_weighed(&mut self, end: f64) -> Option<Progress> {
        if self.assembly.light_rods().next().is_none() {
            return self.advance_to(end);
        }
        self.weigh()?;
        let room = self.room.take();
        let (from, near) = (self.solver.state().clone(), self.near.clone());
        let progress = self.advance_to(end);
        if progress.is_some() && self.ends_where_it_changes(room)? {
            self.near = near;
            return Some(Progress::Moved);
        }
        // A step came upon a fold of which its normal form did not tell, or none could be taken.
        let lost = match &progress {
            Some(Progress::Fold { rods, .. }) => self.felt(Some(rods)),
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

    /// Goes back to `state` and on from there without the mass of these rods, until they have landed.
    pub(super) fn give_up(&mut self, state: Numbers, rods: &[usize]) -> Option<()> {
        let h = self.solver.next_step();
        self.resume(state, None, h)?;
        (self.due, self.room) = (None, None);
        for k in rods {
            self.unfit[*k] = true;
        }
        self.weigh()
    }

    /// The rods whose mass is felt, among these if they are told.
    pub(super) fn felt(&self, among: Option<&[(usize, f64)]>) -> Vec<usize> {
        let told = |k: &usize| among.is_none_or(|rods| rods.iter().any(|(rod, _)| rod == k));
        let felt = self
            .assembly
            .light_rods()
            .filter(|(_, light)| light.followed);
        felt.map(|(k, _)| k).filter(told).collect()
    }
}
