//! The way along a rod that an integration has found, for what is carried along it afterwards.

use super::distributed_load::Carried;
use super::ivp::{Flow, LineState, Wrench, begun, first_step, over_pieces};
use super::scaled_law::ScaledLaw;
use crate::error::Result;
use crate::solve::cost::Cost;
use crate::solve::dop853::{COUNT, Step};
use std::cell::RefCell;

/// The sections at the stages of all steps of an integration, for what is carried along afterwards
/// ([`over_stages`](crate::solve::dop853::over_stages)).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track<const K: usize, C = ()> {
    /// The lengths of the steps.
    steps: Vec<f64>,
    /// One step after the other; behind them what may become the next.
    stages: Vec<LineState<K, C>>,
}

impl<const K: usize, C: Carried<K>> Track<K, C> {
    /// Steps that most integrations do with.
    const USUAL: usize = 8;

    pub(super) fn new() -> Self {
        Self {
            steps: Vec::with_capacity(Self::USUAL),
            stages: Vec::with_capacity((Self::USUAL + 1) * COUNT),
        }
    }

    /// A section at which slopes are asked for.
    #[inline]
    fn tried(&mut self, at: &LineState<K, C>) {
        self.stages.push(*at);
    }

    /// What was tried last, its end included, is a step.
    fn taken(&mut self, step: &Step<LineState<K, C>>) {
        let (start, tried) = (self.steps.len() * COUNT, self.stages.len());
        self.stages.copy_within(tried - COUNT..tried - 1, start + 1);
        self.stages[start] = step.from;
        self.stages.truncate(start + COUNT);
        self.steps.push(step.h);
    }

    /// The steps, each with its length.
    pub(super) fn steps(&self) -> impl Iterator<Item = (f64, &[LineState<K, C>])> {
        (self.steps.iter().copied()).zip(self.stages.chunks_exact(COUNT))
    }
}

/// The end of the rod, with the unit columns of [`begun`], and the way there.
pub(super) fn tracked_end<const K: usize, C: Carried<K>>(
    (law, load): (&ScaledLaw, &C::Load),
    b: &Wrench,
    tolerance: f64,
) -> Result<(LineState<K, C>, Cost, Track<K, C>)> {
    let track = RefCell::new(Track::new());
    let (clamp, [dm, dn]) = begun();
    let mut flow = Flow::<K, C>::new(law, load, b, dm, dn);
    let first = first_step(law, b, tolerance)?;
    let found = over_pieces(
        law,
        clamp,
        LineState::place,
        (first, tolerance),
        |at, slope| {
            track.borrow_mut().tried(at);
            flow.write_slope(at, slope)
        },
        |step, _| track.borrow_mut().taken(step),
    );
    let (end, cost) = found.map_err(|s| flow.lost(s))?;
    Ok((end, cost, track.into_inner()))
}
