//! Changes of the rods' charts as they are pulled taut and let go, and of their axial compliance.

use super::step::LOOSE;
use super::{AssemblyRun, StateVector};
use crate::locate::Timed;
use snaprod_systems::assembly::Assembly;
use snaprod_systems::error::Result;
use std::sync::Arc;

impl AssemblyRun<'_> {
    /// Changes the kind of charts whose rods are pulled taut or let go; true if one changed. A rod whose
    /// other chart disagrees with the present state keeps its own.
    pub(super) fn update_charts(&mut self) -> bool {
        let links = self.assembly.links().iter().zip(&self.watch).enumerate();
        let changed: Vec<_> = links
            .filter(|(_, (link, rod))| link.chart() != rod.better)
            .map(|(k, (_, rod))| (k, *rod))
            .collect();
        if changed.is_empty() {
            return false;
        }
        let along = self.along();
        let Some(at) = self.assembly.evaluated(&self.solver.state().0, along) else {
            return false;
        };
        let mut other = (*self.assembly).clone();
        for (k, rod) in &changed {
            other.set_chart(*k, rod.better);
        }
        // For rods that were taut the couples follow from the forces.
        let told = (self.assembly).with_charts(self.solver.state().0.clone(), &at.now.charts);
        let agrees = other
            .evaluated(&told, along)
            .filter(|there| other.drift(there) <= LOOSE * self.options.tolerance)
            .and_then(|there| other.close_gaps(told, &there));
        self.extra.evaluations += 2;
        let Some(state) = agrees.map(StateVector) else {
            return false;
        };
        // A rod with mass sways differently under the same motion of the bodies if the compliance of its end
        // changes. The difference in kinetic energy is booked as lost or regained.
        let compliance = |rod: &Assembly, k: usize| {
            let slider = rod.links()[k].chart().slider();
            slider.map(|slider| slider.compliance)
        };
        let slides = |(k, _): &(usize, _)| compliance(&self.assembly, *k) != compliance(&other, *k);
        let lost = if other.feels_rods() && changed.iter().any(slides) {
            other.evaluated(&state.0, along).map_or(0.0, |after| {
                self.assembly.rod_kinetic(&at, along) - other.rod_kinetic(&after, along)
            })
        } else {
            0.0
        };
        let before = std::mem::replace(&mut self.assembly, Arc::new(other));
        let h = self.solver.next_step();
        if self.resume(state, None, h).is_none() {
            self.assembly = before;
            return false;
        }
        self.released += lost;
        self.booked += lost;
        // The new chart has another det J.
        for (k, _) in changed {
            self.largest[k] = 0.0;
        }
        true
    }

    /// Changes the chart of a rod after a landing to the kind best suited to the new state.
    pub(super) fn see_anew(&mut self, state: &StateVector, link: usize) -> Result<()> {
        let (t, now) = (state.time(), self.assembly.configuration(&state.0));
        let rod = &self.assembly.links()[link];
        let q = &now.charts[link];
        let point = rod
            .with_chart_by_pull()
            .point(t, &now.bodies, q, self.along())?;
        let suited = rod.suited_chart(q, &point);
        Arc::make_mut(&mut self.assembly).set_chart(link, suited);
        Ok(())
    }
}
