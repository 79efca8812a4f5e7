//! Kinematics of a rod from its strains: shape, pose of the end, and resultants of an end wrench at the sections.

use super::grid::Grid;
use super::loads_at_nodes::{LoadsAtNodes, TurningAtNode};
use super::material::Constant;
use crate::body::EndPose;
use nalgebra::{DMatrix, SMatrix, SVector, Vector3, Vector6};
use std::fmt::Debug;

/// A local quantity of one node: strains, rates, resultants.
pub type Local<const M: usize> = SVector<f64, M>;
/// A quantity of the end: velocity, or wrench.
pub type AtEnd<const D: usize> = SVector<f64, D>;

/// End of a rod in a state, and powers of the rod.
#[derive(Debug, Clone, PartialEq)]
pub struct EndAndPowers<P> {
    /// Pose of the end.
    pub pose: P,
    /// Energy dissipated per time.
    pub dissipated: f64,
    /// Power of loads along the rod without a potential, and of a law in time.
    pub driven: f64,
}

/// Effect of a dead load along a rod: local resultants g at the nodes, beside those of the end wrench, and potential
/// -int f.r.
#[derive(Debug, Clone, PartialEq)]
pub struct Borne<const M: usize> {
    /// g at the nodes.
    pub resultants: Vec<Local<M>>,
    /// The potential.
    pub potential: f64,
}

/// Rods with `M` strains at a section and an end with `D` velocities.
///
/// The rod leaves its clamp at s = 0 and has length 1. All fields are given at the nodes of a [`Grid`], in their order.
pub trait Kinematics<const M: usize, const D: usize>: Debug + Clone + Send + Sync {
    /// Shape of the rod: the quantities that the strains determine at the nodes and at the end.
    type Shape: Debug + Clone + Default;

    /// Workspace, reused from one shape to the next.
    type Room: Debug + Default + Send;

    /// The pose of the end.
    type Pose: EndPose + Debug + Clone;

    /// Sets `shape` to that of the rod with `strains` at the nodes; None, with an unusable shape, if a strain is not
    /// finite.
    fn reshape(
        &self,
        grid: &Grid,
        strains: &[Local<M>],
        shape: &mut Self::Shape,
        room: &mut Self::Room,
    ) -> Option<()>;

    /// The shape of the rod with `strains` at the nodes; None if a strain is not finite.
    fn shape(&self, grid: &Grid, strains: &[Local<M>]) -> Option<Self::Shape> {
        let mut shape = Self::Shape::default();
        self.reshape(grid, strains, &mut shape, &mut Self::Room::default())?;
        Some(shape)
    }

    /// The pose of the end.
    fn pose(&self, shape: &Self::Shape) -> Self::Pose;

    /// Q at node i, so that the local resultants under the end wrench w are Q w, and the end moves at
    /// V = int Q^T e_t ds.
    fn transfer(&self, shape: &Self::Shape, i: usize) -> SMatrix<f64, M, D>;

    /// Adds d(Q_i w)/d e_j, at a fixed end wrench `w`, to the block (i, j) of `out`, of size (n M) x (n M).
    ///
    /// Strains at node j change the shape as the quadrature has it: d(pose)/d e_j = weight_j Q_j^T.
    fn load_stiffness(
        &self,
        grid: &Grid,
        shape: &Self::Shape,
        w: &AtEnd<D>,
        out: &mut DMatrix<f64>,
    );

    /// Resultants (couple, force) along the directors at the nodes under the end wrench `w` and loads at the nodes,
    /// those of rigid strains among them.
    fn resultants(
        &self,
        grid: &Grid,
        shape: &Self::Shape,
        w: &AtEnd<D>,
        loads: Option<&LoadsAtNodes>,
    ) -> Vec<Vector6<f64>>;

    /// Effect on the rod of a dead load `force` per length at the nodes, in the frame of the clamp.
    fn borne(&self, grid: &Grid, shape: &Self::Shape, force: &[Vector3<f64>]) -> Borne<M>;

    /// Adds d g_i/d e_j of that load to the block (i, j) of `out`.
    fn borne_stiffness(
        &self,
        grid: &Grid,
        shape: &Self::Shape,
        force: &[Vector3<f64>],
        out: &mut DMatrix<f64>,
    );

    /// Local resultants g at the nodes of loads without a potential. Their power is sum_i weight_i g_i.e_t. Rods in
    /// space alone bear such loads.
    fn turned(&self, _: &Grid, _: &Self::Shape, _: &[TurningAtNode]) -> Vec<Local<M>> {
        Vec::new()
    }

    /// Adds d g_i/d e_j of those loads to the block (i, j) of `out`.
    fn turned_stiffness(
        &self,
        _: &Grid,
        _: &Self::Shape,
        _: &[TurningAtNode],
        _: &mut DMatrix<f64>,
    ) {
    }

    /// d(sum_i weight_i Q_i^T rate_i)/d e_j at fixed `rates`, in column block j of `out`, of size D x (n M).
    fn convection(
        &self,
        grid: &Grid,
        shape: &Self::Shape,
        rates: &[Local<M>],
        out: &mut DMatrix<f64>,
    );

    /// Length of the pose of the end in a state: its position, after the quaternion (w, x, y, z) of its rotation if
    /// the body is welded to the end.
    const PLACE: usize;

    /// Writes the pose as these numbers.
    fn place(pose: &Self::Pose, out: &mut [f64]);

    /// Resultants Q_i w of several states at once, node by node at the head of each of `out`; each state begins with
    /// its strains, node by node. With a `law`, strain rates are written instead. Each end comes with the dissipation
    /// per time, which is 0 without a law. False if the states must be evaluated one by one.
    fn loaded(
        &self,
        _grid: &Grid,
        _law: Option<&Constant<M>>,
        _states: &[(&[f64], AtEnd<D>)],
        _out: &mut [&mut [f64]],
        _ends: &mut [Option<EndAndPowers<Self::Pose>>],
        _room: &mut Self::Room,
    ) -> bool {
        false
    }

    /// Places of the axis at arc lengths in [0, 1], each with its derivative by arclength, in the frame of the clamp.
    fn axis(
        &self,
        grid: &Grid,
        shape: &Self::Shape,
        strains: &[Local<M>],
        places: &[f64],
    ) -> Vec<[Vector3<f64>; 2]>;

    /// Error of the shape on these nodes beyond that measured by the tails of the strains; 0 if the shape is exact
    /// for polynomial strains.
    fn defect(&self, grid: &Grid, shape: &Self::Shape) -> f64;
}
