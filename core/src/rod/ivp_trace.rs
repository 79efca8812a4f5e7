//! Stages of an integration along a rod, kept for integrals over them.

use super::distributed_load::LoadState;
use super::ivp::{
    LineState, Passage, Wrench, WrenchFlow, clamp_with_columns, first_step, over_pieces,
};
use super::scaled_law::ScaledLaw;
use crate::error::Result;
use crate::solve::cost::Cost;
use crate::solve::dop853::{COUNT, Step};
use std::cell::RefCell;

/// The sections at the stages of all steps of an integration, for later integrals
/// ([`integrate_alongside`](crate::solve::dop853::integrate_alongside)).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track<const K: usize, C = ()> {
    /// Lengths of the steps.
    steps: Vec<f64>,
    /// Stages of the accepted steps in order, then those of the trial step.
    stages: Vec<LineState<K, C>>,
}

impl<const K: usize, C: LoadState<K>> Track<K, C> {
    /// Number of steps sufficient for most integrations.
    const USUAL: usize = 8;

    pub(super) fn new() -> Self {
        Self {
            steps: Vec::with_capacity(Self::USUAL),
            stages: Vec::with_capacity((Self::USUAL + 1) * COUNT),
        }
    }

    /// Records a section at which slopes are evaluated.
    #[inline]
    fn record_stage(&mut self, at: &LineState<K, C>) {
        self.stages.push(*at);
    }

    /// Accepts the step of the last trial stages, its end included.
    fn accept_step(&mut self, step: &Step<LineState<K, C>>) {
        let (start, tried) = (self.steps.len() * COUNT, self.stages.len());
        self.stages.copy_within(tried - COUNT..tried - 1, start + 1);
        self.stages[start] = step.from;
        self.stages.truncate(start + COUNT);
        self.steps.push(step.h);
    }

    /// The accepted steps, each with its length.
    pub(super) fn steps(&self) -> impl Iterator<Item = (f64, &[LineState<K, C>])> {
        (self.steps.iter().copied()).zip(self.stages.chunks_exact(COUNT))
    }
}

/// The end of the rod, with the unit columns of [`clamp_with_columns`], and the stages of the integration.
pub(super) fn tracked_end<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    tolerance: f64,
) -> Result<(LineState<K, C>, Cost, Track<K, C>)> {
    let track = RefCell::new(Track::new());
    let (clamp, [dm, dn]) = clamp_with_columns();
    let mut flow = WrenchFlow::<K, C>::new(law, load, b, dm, dn);
    let first = first_step(law, b, tolerance)?;
    let found = over_pieces(
        law,
        clamp,
        Passage {
            place: LineState::place,
            cross: |state: &mut LineState<K, C>, s| state.cross(load, s),
        },
        first,
        tolerance,
        |at, slope| {
            track.borrow_mut().record_stage(at);
            flow.write_slope(at, slope)
        },
        |step, _| track.borrow_mut().accept_step(step),
    );
    let (end, cost) = found.map_err(|s| flow.integration_error(s))?;
    Ok((end, cost, track.into_inner()))
}
