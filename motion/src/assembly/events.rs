//! Motion of an assembly from event to event: the implementation of [`Motion`].

use super::step::StepProgress;
use super::{AssemblyPending, AssemblyRun};
use crate::drive::{Motion, StateVariables};
use crate::event::{Event, Outcome};
use crate::locate::Timed;
use crate::saved_state::SavedState;
use crate::snap::Snap;
use crate::state::StateRef;
use snaprod_systems::assembly::Body;
use snaprod_systems::error::{Cause, Error, Result};
use snaprod_systems::rod::{Fallen, Wrench};
use snaprod_systems::solve::cost::Cost;

impl<'a> Motion<'a> for AssemblyRun<'a> {
    fn advance(&mut self) -> Option<Event> {
        if self.stopped {
            return None;
        }
        if let Some(bounce) = self.bounces.pop_front() {
            return Some(Event::Bounce(bounce));
        }
        if let Some(happened) = self.contact_event() {
            return Some(happened.unwrap_or_else(|why| {
                let remedy = "change the obstacles, the start or the friction a little";
                self.stuck(Cause::Failed(why), remedy)
            }));
        }
        match self.pending.take() {
            None => {}
            Some(AssemblyPending::Stop(outcome)) => return Some(self.stop(outcome)),
            Some(AssemblyPending::Fold(time_error, crossing)) => {
                return Some(self.snap(time_error, crossing).unwrap_or_else(|why| {
                    self.stuck(
                        Cause::Failed(why),
                        "the rod found no way down from its fold; change the start a little, or tighten run.tolerance",
                    )
                }));
            }
        }
        if self.interrupted {
            return Some(self.stop(Outcome::Interrupted));
        }
        let from = self.solver.state().time();
        if from >= self.options.duration {
            return Some(self.stop(Outcome::EndOfTime));
        }
        if self.cost().steps >= self.options.max_steps {
            return Some(self.stop(Outcome::StepLimit));
        }
        for (largest, rod) in self.largest.iter_mut().zip(&self.watch) {
            *largest = largest.max(rod.det.abs());
        }
        let next = self.next_break(from);
        let end = next.min(self.end_of_step());
        let seen = self.look_until(next.next_down());
        let Some(progress) = seen.and_then(|()| self.advance_with_rods(end)) else {
            let cause = Cause::StepCollapsed {
                next: self.solver.next_step(),
                tolerance: self.options.tolerance,
            };
            let remedy = if self.assembly.links().is_empty() {
                "loads or contacts change too fast for double precision: smooth the loads, or change the obstacles or the start a little"
            } else {
                "a rod is pulled straight, or folds in a way that is not simple: give it stretch (a finite axial stiffness), or \
                 friction (damping)"
            };
            return Some(self.stuck(cause, remedy));
        };
        self.keep_contacts();
        self.look_back(from);
        if let Some((link, gap, lambda)) = self.loose() {
            let which = self.assembly.rod_name(link);
            let remedy = "let the rod stretch more (a smaller axial stiffness), give it friction (damping), or end before it is taut";
            let rod = &self.assembly.links()[link];
            let either = if rod.varies_in_time() {
                "its force is no chart of a rod whose section law varies in time"
            } else if rod.has_turning() {
                "its force is no chart of a rod under loads that turn with it"
            } else {
                "its force does not either, since the rod is neutral under it, as a loop in a taut wire can be"
            };
            let why = Error::ill_conditioned(format!(
                "the end of {which} can be held no better than {gap:.1e} of its length: under sqrt(F L^2/B) = {lambda:.1} its base wrench \
                 no longer tells where its end is, and {either}"
            ));
            return Some(self.stuck(Cause::Failed(why), remedy));
        }
        match progress {
            StepProgress::Fold {
                rods,
                time_error,
                crossing,
            } => {
                self.folded = rods;
                self.pending = Some(AssemblyPending::Fold(time_error, crossing));
            }
            StepProgress::End(outcome) => self.pending = Some(AssemblyPending::Stop(outcome)),
            StepProgress::Moved | StepProgress::Arrived => {}
        }
        Some(Event::Step {
            from,
            to: self.solver.state().time(),
        })
    }

    fn given(&self) -> StateRef<'_> {
        StateRef::Kept(&self.first)
    }

    fn now(&self) -> StateRef<'_> {
        StateRef::Made(Box::new(self.sample_now()))
    }

    fn before_snap(&self) -> Option<StateRef<'_>> {
        self.before_snap
            .as_ref()
            .map(|sample| StateRef::Kept(sample as _))
    }

    fn fall(&self, snap: &Snap) -> Option<Vec<Fallen>> {
        let held = self.before_snap.as_ref()?.at.points.get(snap.rod)?.held();
        let fold = Wrench::from_column_slice(snap.from.q.as_slice());
        // The search on a taut rod starts from the last solution, which is to be the fold.
        let rod = self.folding.clone()?;
        let (shapes, landed) = rod.fall(&fold, &held, self.along()).ok()?;
        snap.lands(landed.as_slice()).then_some(shapes)
    }

    fn sample(&mut self, t: f64) -> Option<StateRef<'_>> {
        Some(StateRef::Made(Box::new(self.state_at(t)?)))
    }

    fn save(&mut self, t: f64) -> Result<SavedState> {
        self.save(t)
    }

    fn restore(&mut self, saved: &SavedState) -> Result<()> {
        self.restore(saved)
    }

    fn renew(&mut self) -> Result<()> {
        // The next step then looks anew at the loads.
        self.until = f64::NAN;
        self.settle_contacts()
    }

    fn duration(&self) -> f64 {
        self.options.duration
    }

    fn interrupt(&mut self) {
        self.interrupted = true;
    }

    fn time_without_mass(&self) -> f64 {
        self.unfelt
    }

    fn cost(&self) -> Cost {
        self.solver.cost() + self.extra
    }

    fn carries(&self) -> Vec<StateVariables> {
        let links = self.assembly.links().len();
        let nodes = self.assembly.carriers().iter();
        let nodes = nodes.filter(|carrier| carrier.is_massless());
        let joints = nodes.map(Body::numbers).sum();
        let bodies = self.assembly.chart_slots(0).start - joints;
        let spins = self.assembly.time_slot() - self.assembly.chart_slots(links).start;
        StateVariables::some([
            ("charts of the rods", 6 * links),
            ("turns and spins of rods about their chords", spins),
            ("places and velocities of the bodies", bodies),
            ("angles and shifts of joints, places of nodes", joints),
            ("time, work and loss to drag", 3),
        ])
    }

    fn branch(&self, snap: &Snap) -> Result<Box<dyn Motion<'a> + 'a>> {
        if snap.rod >= self.assembly.links().len() || snap.to.q.len() != 6 {
            return Err(Error::domain("the snap is none of a rod of this assembly"));
        }
        let mut branch = self.clone();
        *branch.solver.cost_mut() = Cost::default();
        branch.extra = Cost::default();
        branch.stopped = false;
        branch.before_snap = None;
        branch.folding = None;
        branch.land(snap)?;
        branch.first = branch.sample_now();
        Ok(Box::new(branch))
    }
}
