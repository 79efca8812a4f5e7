//! Chart points at eight places at once, for methods that work at several places side by side.

use crate::math::Row;

/// Evaluator of a chart at eight places at once.
pub trait Eightfold<const N: usize> {
    /// Drops the points evaluated before: later results do not depend on them.
    fn begin(&mut self);

    /// Points at `q`, by component and place; false if one lies outside of the chart.
    fn points(&mut self, q: &[Row; N], to: &mut EightPoints<N>) -> bool;
}

/// Eight points of the manifold: [`super::ManifoldPoint`] without energy, by component and place.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct EightPoints<const N: usize> {
    /// Poses of the body.
    pub pose: [Row; N],
    /// Forces of the rod on the body.
    pub force: [Row; N],
    /// Adjugates of d pose/d q, by row and column.
    pub adjugate: [[Row; N]; N],
    /// Determinants of d pose/d q.
    pub det: Row,
    /// See [`super::ManifoldPoint::pace`].
    pub pace: Row,
}

impl<const N: usize> Default for EightPoints<N> {
    fn default() -> Self {
        let zero = [0.0; 8];
        Self {
            pose: [zero; N],
            force: [zero; N],
            adjugate: [[zero; N]; N],
            det: zero,
            pace: zero,
        }
    }
}
