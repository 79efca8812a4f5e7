//! Saved states of runs on sheets: chart point, velocity, time, and the sums of the ledger.

use super::{Phase, Run, Sample};
use crate::saved_state::{SavedState, outside_step};
use nalgebra::SVector;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::manifold::Multivalued;

/// Method of the states.
const METHOD: &str = "an elastic rod on its sheets";

impl<M: Multivalued<N>, const N: usize> Run<'_, M, N> {
    /// The state at a time within the last step or at its end.
    ///
    /// # Errors
    /// A time outside the last step; a run among obstacles; a rod with mass that passes the straight shape, and the
    /// first moments of a rod that is let go straight.
    pub fn save(&mut self, t: f64) -> Result<SavedState> {
        if self.contacts.is_some() {
            return Err(Error::domain(
                "the state of a motion among obstacles cannot be saved yet: follow the run to its end, or leave the obstacles out",
            ));
        }
        if self.early.is_some() && t < self.time() {
            return Err(Error::domain(
                "a rod that is let go straight opens by a series of its own, whose state cannot be saved: step once first",
            ));
        }
        if self.motion.passes_straight() {
            return Err(Error::domain(
                "the state of a rod with mass next to the straight shape cannot be saved: advance until it has passed, or leave the \
                 rod's mass out, inertia = \"none\"",
            ));
        }
        let now = if t == self.time() {
            self.now()
        } else {
            self.sample(t).ok_or_else(|| outside_step(t))?
        };
        let Sample { phase, ledger, .. } = now;
        let numbers = |v: SVector<f64, N>| v.as_slice().to_vec();
        Ok(SavedState::new(METHOD, t, &ledger)
            .with("chart", numbers(phase.q))
            .with("velocity", numbers(phase.v))
            .with("work", [phase.work])
            .with("drag", [phase.drag_loss])
            .with("snaps", [self.snaps as f64])
            .with("time_without_mass", [self.unfelt]))
    }

    /// Goes on from a saved state.
    ///
    /// # Errors
    /// The state of another method, or one outside the chart; a run among obstacles.
    pub fn restore(&mut self, saved: &SavedState) -> Result<()> {
        saved.check(METHOD)?;
        if self.contacts.is_some() {
            return Err(Error::domain(
                "a motion among obstacles does not go on from a saved state yet: leave the obstacles out",
            ));
        }
        let vector = |name: &str| saved.array::<N>(name).map(SVector::from);
        let [snaps] = saved.array("snaps")?;
        let begun = |work: f64| {
            let phase = Phase {
                q: vector("chart")?,
                v: vector("velocity")?,
                t: saved.t,
                work,
                drag_loss: saved.array::<1>("drag")?[0],
            };
            Self::start(
                self.manifold,
                self.body,
                phase,
                self.options,
                0.0,
                snaps as u64,
            )
        };
        let [work] = saved.array("work")?;
        let mut run = begun(work)?;
        let change = saved.work_of_change(&run.now().ledger)?;
        if change != 0.0 {
            run = begun(work + change)?;
        }
        run.past = self.cost();
        [run.unfelt] = saved.array("time_without_mass")?;
        // Losses in snaps, and the energy of the rod's mass where the mass begins or ceases to be followed here.
        run.snapped = saved.ledger()?.total() - run.now().ledger.total();
        *self = run;
        Ok(())
    }
}
