//! What the charts of rods stand for, as they are pulled taut and let go.

use super::step::LOOSE;
use super::{AssemblyRun, Numbers};
use crate::rod::Wrench;
use std::sync::Arc;

impl AssemblyRun {
    /// Changes what charts stand for as their rods are pulled taut or let go; true if one did. A rod whose other chart does not say the
    /// same keeps its own.
    pub(super) fn look(&mut self) -> bool {
        let links = self.assembly.links().iter().zip(&self.watch).enumerate();
        let changed: Vec<_> = links
            .filter(|(_, (link, rod))| link.seen() != rod.better)
            .map(|(k, (_, rod))| (k, rod.better))
            .collect();
        if changed.is_empty() {
            return false;
        }
        let along = self.along();
        let Some(at) = self.assembly.evaluated(&self.solver.state().0, along) else {
            return false;
        };
        let mut other = (*self.assembly).clone();
        for (k, seen) in changed {
            other.see(k, seen);
        }
        // The couples of rods that were taut are those that their forces make.
        let told = |charts: &[Wrench]| {
            let state = self.solver.state().0.clone();
            let charts = charts.iter().enumerate();
            Numbers(charts.fold(state, |state, (k, q)| self.assembly.with_chart(state, k, q)))
        };
        let state = told(&at.now.charts);
        let agrees = other
            .evaluated(&state.0, along)
            .filter(|there| other.drift(there) <= LOOSE * self.options.tolerance)
            .and_then(|there| other.corrected(&there));
        self.extra.evaluations += 2;
        let Some(charts) = agrees else {
            return false;
        };
        let state = told(&charts);
        let before = std::mem::replace(&mut self.assembly, Arc::new(other));
        let h = self.solver.next_step();
        if self.resume(state, None, h).is_none() {
            self.assembly = before;
            return false;
        }
        true
    }
}
