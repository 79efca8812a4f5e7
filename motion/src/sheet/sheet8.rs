//! Collocation steps of a motion with slopes at eight places at once.

use super::Phase;
use nalgebra::SVector;
use snaprod_systems::body::{EightMotion, PointMass};
use snaprod_systems::manifold::{Multivalued, Patch};
use snaprod_systems::math::Row;
use snaprod_systems::solve::lobatto::{
    Eightwise, Lobatto, NodeRows, Slopes, Solved, StepFailure, Unsolved, solve,
};

/// Steps with slopes at eight places at once, and the eightfold motion of the body.
pub(super) struct EightfoldSteps<'a, const N: usize> {
    pub steps: Lobatto<Phase<N>>,
    pub motion: EightMotion<'a, N>,
}

/// Error of poses and forces, as a part of the local error.
const PART: f64 = 0.03;

impl<'a, const N: usize> EightfoldSteps<'a, N> {
    /// Steps in the global chart whose local errors are about `tolerance`, the first of the length `h`. None
    /// for models that evaluate one place at a time.
    pub fn new<M: Multivalued<N>>(
        manifold: &M,
        body: &'a PointMass<N>,
        orientation: f64,
        h: f64,
        tolerance: f64,
    ) -> Option<Self> {
        let chart = manifold.eightfold(Patch::Global, PART * tolerance)?;
        Some(Self {
            steps: Lobatto::new(h, tolerance),
            motion: EightMotion::new(chart, body, orientation),
        })
    }
}

impl<const N: usize> Eightwise<Phase<N>> for EightMotion<'_, N> {
    fn row(&self, state: &Phase<N>) -> Row {
        let mut row = [0.0; 8];
        row[..N].copy_from_slice(state.q.as_slice());
        row[N..2 * N].copy_from_slice(state.v.as_slice());
        row[2 * N] = state.t;
        row[2 * N + 1] = state.work;
        row[2 * N + 2] = state.drag_loss;
        row
    }

    fn state(&self, row: &Row) -> Phase<N> {
        Phase {
            q: SVector::from_column_slice(&row[..N]),
            v: SVector::from_column_slice(&row[N..2 * N]),
            t: row[2 * N],
            work: row[2 * N + 1],
            drag_loss: row[2 * N + 2],
        }
    }

    fn states(&self, at: &NodeRows) -> [Phase<N>; 8] {
        let vector = |first: usize, i: usize| SVector::from_fn(|k, _| at.0[first + k][i]);
        std::array::from_fn(|i| Phase {
            q: vector(0, i),
            v: vector(N, i),
            t: at.0[2 * N][i],
            work: at.0[2 * N + 1][i],
            drag_loss: at.0[2 * N + 2][i],
        })
    }

    fn solve(&mut self, step: &Unsolved<'_>, to: &mut Solved) -> Result<(), StepFailure> {
        solve(self, step, to)
    }
}

/// The right-hand side at one place, with the eightfold one where the model has it.
pub(super) struct OneOrEight<'b, 'a, F, const N: usize> {
    pub one: F,
    pub eight: Option<&'b mut EightMotion<'a, N>>,
}

impl<F: Fn(&Phase<N>) -> Option<Phase<N>>, const N: usize> Slopes<Phase<N>>
    for OneOrEight<'_, '_, F, N>
{
    fn slope(&mut self, at: &Phase<N>) -> Option<Phase<N>> {
        (self.one)(at)
    }

    fn eightwise(&mut self) -> Option<&mut dyn Eightwise<Phase<N>>> {
        self.eight.as_mut().map(|motion| &mut **motion as _)
    }
}
