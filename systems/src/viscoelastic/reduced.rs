//! The reduced rod: end wrench and strain rates from strains, memory and the velocity of the end.
//!
//! The stored energy and the Maxwell branches take S_i of the resultants Q_i w1 at node i. The rates are
//! e_t = R(e, Q w1 - S), and w1 makes the end move at V:
//! ```text
//! sum_i weight_i Q_i^T R(e_i, Q_i w1 - S_i) = V.
//! ```
//! A load along the rod adds its own resultants g, known from the shape: they count as -g among the S_i. The left
//! side is the gradient of a convex function of w1 with the Hessian G = sum_i weight_i Q_i^T dR_i Q_i, AMV
//! (5.10). Laws that are linear in the overstress take one solve, others Newton's method with a line search.

use super::grid::Grid;
use super::kinematics::{AtEnd, EndAndPowers, Kinematics, Local};
use super::loads_at_nodes::LoadsAtNodes;
use super::material::Material;
use crate::math::small_matrices::{add_times, add_transposed_times, times};
use nalgebra::{DMatrix, DVector, SMatrix};
use std::sync::Arc;

/// A viscoelastic rod on a grid.
#[derive(Debug, Clone)]
pub struct Reduced<K, const M: usize, const D: usize> {
    /// Kinematics: the shape from the strains.
    pub kinematics: K,
    /// The section.
    pub material: Material<M>,
    /// The nodes.
    pub grid: Arc<Grid>,
}

/// Strains and memory of the rod, shape, transfer matrices and elastic resultants.
#[derive(Debug, Clone, Default)]
pub struct Configuration<S, const M: usize, const D: usize> {
    /// Strains e at the nodes.
    pub strains: Vec<Local<M>>,
    /// Strains of the dashpots of the Maxwell branches, branch by branch.
    pub memory: Vec<Vec<Local<M>>>,
    /// The shape.
    pub shape: S,
    /// Matrices Q at the nodes.
    pub transfer: Vec<SMatrix<f64, M, D>>,
    /// Resultants taken by the stored energy and the branches, less those of a load along the rod.
    pub taken: Vec<Local<M>>,
    /// Stored energy, including the branches.
    pub energy: f64,
    /// Potential of a load along the rod.
    pub potential: f64,
    /// Resultants, along the rod, of the loads without a potential; empty without such loads.
    pub turning: Vec<Local<M>>,
}

/// Wrench, rates and overstress of the rod at one moment.
#[derive(Debug, Clone)]
pub struct Flow<const M: usize, const D: usize> {
    /// The wrench w1 that the body exerts on the end.
    pub wrench: AtEnd<D>,
    /// e_t at the nodes.
    pub rates: Vec<Local<M>>,
    /// Overstress at the nodes.
    pub overstress: Vec<Local<M>>,
    /// d e_t/d(overstress) at the nodes.
    pub fluidity: Vec<SMatrix<f64, M, M>>,
    /// d e_t/d e at fixed overstress.
    pub by_strain: Vec<SMatrix<f64, M, M>>,
    /// Mobility G of AMV (5.10): symmetric, positive definite unless an inextensible rod is straight.
    pub mobility: SMatrix<f64, D, D>,
}

impl<const M: usize, const D: usize> Default for Flow<M, D> {
    fn default() -> Self {
        Self {
            wrench: AtEnd::zeros(),
            rates: Vec::new(),
            overstress: Vec::new(),
            fluidity: Vec::new(),
            by_strain: Vec::new(),
            mobility: SMatrix::zeros(),
        }
    }
}

/// Workspace of repeated evaluations, which then allocate nothing.
#[derive(Debug)]
pub struct Workspace<K: Kinematics<M, D>, const M: usize, const D: usize> {
    /// A configuration and its flow.
    pub at: Configuration<K::Shape, M, D>,
    /// Flow of the configuration `at`.
    pub flow: Flow<M, D>,
    next: Flow<M, D>,
    /// Workspace for shapes.
    pub shaping: K::Room,
}

impl<K: Kinematics<M, D>, const M: usize, const D: usize> Default for Workspace<K, M, D> {
    fn default() -> Self {
        Self {
            at: Configuration::default(),
            flow: Flow::default(),
            next: Flow::default(),
            shaping: K::Room::default(),
        }
    }
}

/// The flow linearised in strains e, memory z, end velocity V and wrench w1, all nodes in one column:
/// ```text
/// d e_t = drift de + sum_k relaxing_k dz_k + push dw1,      dV = gather d e_t + convection de.
/// ```
#[derive(Debug, Clone)]
pub struct Linear<const M: usize, const D: usize> {
    /// d e_t/d e at fixed memory and wrench.
    pub drift: Drift<M>,
    /// d e_t/d(overstress) at the nodes.
    pub fluidity: Vec<SMatrix<f64, M, M>>,
    /// d e_t/d w1, (n M) x D: the fluidity times Q_i at node i.
    pub push: DMatrix<f64>,
    /// D x (n M): weight_i Q_i^T; also the change of the end's pose with the strains.
    pub gather: DMatrix<f64>,
    /// Change of the end's velocity with the strains at fixed rates, D x (n M).
    pub convection: DMatrix<f64>,
}

/// d e_t/d e at fixed memory and wrench, for n nodes of M strains.
#[derive(Debug, Clone)]
pub enum Drift<const M: usize> {
    /// Full matrix, (n M) x (n M).
    Whole(DMatrix<f64>),
    /// Blocks by node, from the strains at a node to their own rates; the rotation of the loads relative to the
    /// deforming rod is neglected.
    Local(Vec<SMatrix<f64, M, M>>),
}

impl<const M: usize> Drift<M> {
    /// Product with a change of the strains.
    pub fn times(&self, strains: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::Whole(drift) => drift * strains,
            Self::Local(blocks) => {
                let mut rates = strains.clone();
                for (i, block) in blocks.iter().enumerate() {
                    let mut rate = rates.fixed_rows_mut::<M>(i * M);
                    let product = times(block, &rate.clone_owned());
                    rate.copy_from(&product);
                }
                rates
            }
        }
    }
}

/// Number of solves of the linear equations for the wrench of a linear law: the second removes the rounding error of
/// the first.
const REFINEMENTS: usize = 2;
/// Most steps of Newton's method for a wrench.
const MOST: usize = 60;
/// Newton's method for a wrench ends once its decrement (the square of the error) is below this part of the powers.
/// The last, linear correction then leaves an error of this order.
const CONVERGED: f64 = 1e-19;
/// Relative decrement below which a stagnating Newton iteration is at rounding.
const ROUNDED: f64 = 1e-12;
/// Eigenvalues of G, scaled to a unit diagonal, below this part of the largest count as zero.
const SINGULAR: f64 = 1e-13;
/// Diagonal entries of G below this part of the largest count as zero: the rod is straight, and velocities do not
/// determine the wrench along it.
const STRAIGHT: f64 = 1e-13;

impl<K: Kinematics<M, D>, const M: usize, const D: usize> Reduced<K, M, D> {
    /// Configuration from strains and memory; None outside the law's domain.
    pub fn configuration(
        &self,
        strains: Vec<Local<M>>,
        memory: Vec<Vec<Local<M>>>,
    ) -> Option<Configuration<K::Shape, M, D>> {
        let mut at = Configuration {
            strains,
            memory,
            ..Configuration::default()
        };
        self.configure(&mut at, &mut K::Room::default())?;
        Some(at)
    }

    /// Updates a configuration from its strains and its memory. None outside the law's domain, with an unusable
    /// configuration.
    pub fn configure(
        &self,
        at: &mut Configuration<K::Shape, M, D>,
        room: &mut K::Room,
    ) -> Option<()> {
        (self.kinematics).reshape(&self.grid, &at.strains, &mut at.shape, room)?;
        at.energy = 0.0;
        at.taken.clear();
        at.transfer.clear();
        for (i, e) in at.strains.iter().enumerate() {
            let stored = self.material.stored(self.grid.nodes()[i], e)?;
            let (mut density, mut resultants) = (stored.energy, stored.resultants);
            for (branch, z) in self.material.branches().iter().zip(&at.memory) {
                let stretched = e - z[i];
                let force = times(&branch.modulus, &stretched);
                density += 0.5 * stretched.dot(&force);
                resultants += force;
            }
            at.energy += self.grid.weights()[i] * density;
            at.taken.push(resultants);
            at.transfer.push(self.kinematics.transfer(&at.shape, i));
        }
        at.potential = 0.0;
        at.turning.clear();
        if let Some(loads) = self.material.loads_at(self.grid.nodes()) {
            let borne = self.kinematics.borne(&self.grid, &at.shape, &loads.dead);
            at.potential = borne.potential;
            at.turning = self.turned(&at.shape, &loads);
            for g in [&borne.resultants, &at.turning] {
                for (taken, g) in at.taken.iter_mut().zip(g) {
                    *taken -= g;
                }
            }
        }
        at.energy.is_finite().then_some(())
    }

    /// Rates in several states under their end wrenches. The head of each of `out` receives the rates of strains and
    /// memory, `ends` the pose of the end and the powers of the rod. Each state begins with its strains, node by
    /// node, and continues with those of its dashpots, branch by branch. None outside the law's domain, and if a
    /// strain is not finite.
    pub fn flowing(
        &self,
        states: &[(&[f64], AtEnd<D>)],
        out: &mut [&mut [f64]],
        ends: &mut [Option<EndAndPowers<K::Pose>>],
        room: &mut Workspace<K, M, D>,
    ) -> Option<()> {
        let loads = self.material.loads_at(self.grid.nodes());
        let law = self.material.constant();
        let together = loads.is_none()
            && (self.kinematics).loaded(&self.grid, law, states, out, ends, &mut room.shaping);
        if together && law.is_some() {
            return Some(());
        }
        for (((state, w), out), end) in states.iter().zip(out).zip(ends) {
            let pose = match end.take().filter(|_| together) {
                Some(end) => end.pose,
                None => self.loaded(state, w, loads.as_ref(), out, room)?,
            };
            *end = Some(self.flowing_under(pose, state, &room.at.turning, out)?);
        }
        Some(())
    }

    /// Pose of the end in a state; the head of `out` receives the resultants at the nodes of the end wrench and the
    /// loads along the rod.
    fn loaded(
        &self,
        state: &[f64],
        w: &AtEnd<D>,
        loads: Option<&LoadsAtNodes>,
        out: &mut [f64],
        room: &mut Workspace<K, M, D>,
    ) -> Option<K::Pose> {
        let Configuration {
            strains,
            shape,
            turning,
            ..
        } = &mut room.at;
        let places = state.chunks_exact(M).take(self.grid.len());
        strains.clear();
        strains.extend(places.map(Local::<M>::from_column_slice));
        (self.kinematics).reshape(&self.grid, strains, shape, &mut room.shaping)?;
        turning.clear();
        let borne = loads.map(|loads| {
            *turning = self.turned(shape, loads);
            self.kinematics.borne(&self.grid, shape, &loads.dead)
        });
        for (i, place) in out.chunks_exact_mut(M).take(strains.len()).enumerate() {
            let mut local = times(&self.kinematics.transfer(shape, i), w);
            if let Some(borne) = &borne {
                local += borne.resultants[i];
            }
            if let Some(g) = turning.get(i) {
                local += g;
            }
            place.copy_from_slice(local.as_slice());
        }
        Some(self.kinematics.pose(shape))
    }

    /// Resultants of the loads without a potential; empty without such loads.
    fn turned(&self, shape: &K::Shape, loads: &LoadsAtNodes) -> Vec<Local<M>> {
        if loads.turning.is_empty() {
            return Vec::new();
        }
        (self.kinematics).turned(&self.grid, shape, &loads.turning)
    }

    /// Replaces the resultants at the nodes by the rates of strains and memory of a state; returns the end, which has
    /// this pose, with the powers of the rod. `turning` are the resultants of loads without a potential.
    fn flowing_under(
        &self,
        pose: K::Pose,
        state: &[f64],
        turning: &[Local<M>],
        out: &mut [f64],
    ) -> Option<EndAndPowers<K::Pose>> {
        let n = self.grid.len() * M;
        let (mut dissipated, mut driven) = (0.0, 0.0);
        let nodes = self.grid.nodes().iter().zip(self.grid.weights());
        for (i, (s, weight)) in nodes.enumerate() {
            let at = |k: usize| k * n + i * M..k * n + (i + 1) * M;
            let e = Local::<M>::from_column_slice(&state[at(0)]);
            let (mut left, mut density) = (Local::<M>::from_column_slice(&out[at(0)]), 0.0);
            for (k, branch) in self.material.branches().iter().enumerate() {
                let place = at(k + 1);
                let stretched = e - Local::<M>::from_column_slice(&state[place.clone()]);
                let (force, rate) = (times(&branch.modulus, &stretched), stretched / branch.time);
                left -= force;
                density += force.dot(&rate);
                out[place].copy_from_slice(rate.as_slice());
            }
            let (rate, overstress) = self.material.flowing(*s, &e, &left)?;
            density += overstress.dot(&rate);
            dissipated += weight * density;
            driven += weight * self.driven_at(i, &e, turning, &rate)?;
            out[at(0)].copy_from_slice(rate.as_slice());
        }
        Some(EndAndPowers {
            pose,
            dissipated,
            driven,
        })
    }

    /// Power per length at node i of the loads without a potential and of a law in time.
    fn driven_at(
        &self,
        i: usize,
        e: &Local<M>,
        turning: &[Local<M>],
        rate: &Local<M>,
    ) -> Option<f64> {
        let turned = turning.get(i).map_or(0.0, |g| g.dot(rate));
        Some(turned + self.material.drive_power(self.grid.nodes()[i], e)?)
    }

    /// Power of the loads along the rod that have no potential, and of a law in time; None outside the law's domain.
    pub fn driven(&self, at: &Configuration<K::Shape, M, D>, flow: &Flow<M, D>) -> Option<f64> {
        if at.turning.is_empty() && !self.material.varies_in_time() {
            return Some(0.0);
        }
        let nodes = self.grid.weights().iter().zip(&at.strains);
        let mut nodes = nodes.zip(&flow.rates).enumerate();
        nodes.try_fold(0.0, |sum, (i, ((weight, e), rate))| {
            Some(sum + weight * self.driven_at(i, e, &at.turning, rate)?)
        })
    }

    /// Wrench and rates for the velocity `v` of the end; None where a law has no answer.
    ///
    /// The rates reproduce `v` to rounding of the rates themselves. In stiff rods (small viscosities) rates are small
    /// differences of large stresses, and their errors must not make the end drift.
    pub fn flow(&self, at: &Configuration<K::Shape, M, D>, v: &AtEnd<D>) -> Option<Flow<M, D>> {
        let mut flow = Flow::default();
        self.follow(at, v, &mut flow, &mut Flow::default())?;
        Some(flow)
    }

    /// [`Self::flow`] of the configuration in the workspace.
    pub fn flow_in(&self, room: &mut Workspace<K, M, D>, v: &AtEnd<D>) -> Option<()> {
        self.follow(&room.at, v, &mut room.flow, &mut room.next)
    }

    /// Sets `flow` to [`Self::flow`]; `next` is workspace.
    fn follow(
        &self,
        at: &Configuration<K::Shape, M, D>,
        v: &AtEnd<D>,
        flow: &mut Flow<M, D>,
        next: &mut Flow<M, D>,
    ) -> Option<()> {
        self.press(at, &AtEnd::zeros(), flow)?;
        let mut residual = self.moved(at, flow) - v;
        if self.material.is_linear() {
            for step in 0..REFINEMENTS {
                let change = solve(&flow.mobility, &-residual)?;
                if step == 0 && !self.material.is_constant() {
                    // Derivatives of the rates by the strains depend on the overstress: they are taken at the final
                    // one.
                    self.press(at, &change, flow)?;
                } else {
                    self.load(at, flow, &change);
                }
                residual = self.moved(at, flow) - v;
            }
            return flow.wrench.iter().all(|x| x.is_finite()).then_some(());
        }
        // Convergence is judged by powers, which weigh the components of a wrench. A wrench along a rod that is
        // straight to within an angle a is known only to rounding/a, which suffices.
        let mut before = f64::INFINITY;
        for _ in 0..MOST {
            let change = solve(&flow.mobility, &-residual)?;
            let decrement = -residual.dot(&change);
            let power = self.power(at, flow);
            let settled = decrement <= CONVERGED * power;
            if settled || (decrement <= ROUNDED * power && !(decrement < 0.1 * before)) {
                self.load(at, flow, &change);
                return flow.wrench.iter().all(|x| x.is_finite()).then_some(());
            }
            before = decrement;
            // Along the step the slope of a convex function grows from -decrement towards zero. A step at whose end
            // the slope exceeds +0.9 decrement is too long and is halved.
            let mut fraction = 1.0;
            loop {
                self.press(at, &(flow.wrench + change * fraction), next)?;
                let after = self.moved(at, next) - v;
                if after.dot(&change) <= 0.9 * decrement || fraction < 1e-10 {
                    std::mem::swap(flow, next);
                    residual = after;
                    break;
                }
                fraction *= 0.5;
            }
        }
        None
    }

    /// Scale of rounding: the sum of the dissipations that the taken stresses and the overstress would each cause
    /// alone.
    fn power(&self, at: &Configuration<K::Shape, M, D>, flow: &Flow<M, D>) -> f64 {
        let nodes = at.taken.iter().zip(&flow.overstress).zip(&flow.fluidity);
        nodes
            .zip(self.grid.weights())
            .map(|(((taken, over), c), weight)| {
                weight * (taken.dot(&(c * taken)) + over.dot(&(c * over)))
            })
            .sum()
    }

    /// Adds `w` to the wrench, and its first-order effect to overstress and rates.
    fn load(&self, at: &Configuration<K::Shape, M, D>, flow: &mut Flow<M, D>, w: &AtEnd<D>) {
        flow.wrench += w;
        for (i, q) in at.transfer.iter().enumerate() {
            let more = times(q, w);
            flow.overstress[i] += more;
            add_times(&mut flow.rates[i], &flow.fluidity[i], &more);
        }
    }

    /// Flow under the end wrench `w`, for any velocity of the end.
    pub fn under(&self, at: &Configuration<K::Shape, M, D>, w: &AtEnd<D>) -> Option<Flow<M, D>> {
        let mut flow = Flow::default();
        self.press(at, w, &mut flow)?;
        Some(flow)
    }

    /// Sets `flow` to [`Self::under`].
    pub fn press(
        &self,
        at: &Configuration<K::Shape, M, D>,
        w: &AtEnd<D>,
        flow: &mut Flow<M, D>,
    ) -> Option<()> {
        flow.wrench = *w;
        flow.mobility = SMatrix::zeros();
        flow.rates.clear();
        flow.overstress.clear();
        flow.fluidity.clear();
        flow.by_strain.clear();
        for (i, q) in at.transfer.iter().enumerate() {
            let overstress = times(q, w) - at.taken[i];
            let creep = self
                .material
                .creep(self.grid.nodes()[i], &at.strains[i], &overstress)?;
            let pushed = times(&creep.fluidity, q) * self.grid.weights()[i];
            add_transposed_times(&mut flow.mobility, q, &pushed);
            flow.rates.push(creep.rate);
            flow.overstress.push(overstress);
            flow.fluidity.push(creep.fluidity);
            flow.by_strain.push(creep.by_strain);
        }
        Some(())
    }

    /// int Q^T e_t, the velocity of the end for these rates.
    pub fn moved(&self, at: &Configuration<K::Shape, M, D>, flow: &Flow<M, D>) -> AtEnd<D> {
        let nodes = at.transfer.iter().zip(&flow.rates).zip(self.grid.weights());
        let mut sum = AtEnd::zeros();
        for ((q, rate), weight) in nodes {
            add_transposed_times(&mut sum, q, &(rate * *weight));
        }
        sum
    }

    /// Total dissipation per time.
    pub fn dissipated(&self, at: &Configuration<K::Shape, M, D>, flow: &Flow<M, D>) -> f64 {
        let nodes = self.grid.weights().iter().enumerate();
        nodes
            .map(|(i, w)| self.dissipated_at(at, flow, i) * w)
            .sum()
    }

    /// Dissipation density in s at the nodes: overstress times rate, including the Maxwell branches.
    pub fn dissipation(&self, at: &Configuration<K::Shape, M, D>, flow: &Flow<M, D>) -> Vec<f64> {
        (0..at.strains.len())
            .map(|i| self.dissipated_at(at, flow, i))
            .collect()
    }

    fn dissipated_at(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
        i: usize,
    ) -> f64 {
        let mut density = flow.overstress[i].dot(&flow.rates[i]);
        for (branch, z) in self.material.branches().iter().zip(&at.memory) {
            let stretched = at.strains[i] - z[i];
            density += stretched.dot(&times(&branch.modulus, &stretched)) / branch.time;
        }
        density
    }

    /// Linearisation of the flow; None where a law has none.
    pub fn linear(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
    ) -> Option<Linear<M, D>> {
        let n = at.strains.len();
        let mut drift = DMatrix::zeros(n * M, n * M);
        self.kinematics
            .load_stiffness(&self.grid, &at.shape, &flow.wrench, &mut drift);
        if let Some(loads) = self.material.loads_at(self.grid.nodes()) {
            self.kinematics
                .borne_stiffness(&self.grid, &at.shape, &loads.dead, &mut drift);
            if !loads.turning.is_empty() {
                self.kinematics
                    .turned_stiffness(&self.grid, &at.shape, &loads.turning, &mut drift);
            }
        }
        let own = self.own(at, flow)?;
        for (i, (own, fluidity)) in own.iter().zip(&flow.fluidity).enumerate() {
            let rows = i * M;
            for j in 0..n * M {
                let column = drift.fixed_view::<M, 1>(rows, j).into_owned();
                drift
                    .fixed_view_mut::<M, 1>(rows, j)
                    .copy_from(&(fluidity * column));
            }
            let mut block = drift.fixed_view_mut::<M, M>(rows, rows);
            block += own;
        }
        Some(self.with_drift(at, flow, Drift::Whole(drift)))
    }

    /// Linearisation without the rotation of the loads ([`Drift::Local`]): accurate for rods far below their buckling
    /// loads.
    pub fn roughly_linear(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
    ) -> Option<Linear<M, D>> {
        let own = self.own(at, flow)?;
        Some(self.with_drift(at, flow, Drift::Local(own)))
    }

    /// d e_t/d e at the nodes, at fixed resultants.
    fn own(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
    ) -> Option<Vec<SMatrix<f64, M, M>>> {
        let branches = self.material.branches().iter();
        let total = branches.fold(SMatrix::<f64, M, M>::zeros(), |sum, b| sum + b.modulus);
        let nodes = self.grid.nodes().iter().zip(&at.strains);
        let flows = flow.fluidity.iter().zip(&flow.by_strain);
        nodes
            .zip(flows)
            .map(|((s, e), (fluidity, by_strain))| {
                Some(by_strain - times(fluidity, &(self.material.tangent(*s, e)? + total)))
            })
            .collect()
    }

    fn with_drift(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
        drift: Drift<M>,
    ) -> Linear<M, D> {
        let n = at.strains.len();
        let mut push = DMatrix::zeros(n * M, D);
        let mut gather = DMatrix::zeros(D, n * M);
        for (i, q) in at.transfer.iter().enumerate() {
            push.fixed_view_mut::<M, D>(i * M, 0)
                .copy_from(&times(&flow.fluidity[i], q));
            gather
                .fixed_view_mut::<D, M>(0, i * M)
                .copy_from(&(q.transpose() * self.grid.weights()[i]));
        }
        let mut convection = DMatrix::zeros(D, n * M);
        self.kinematics
            .convection(&self.grid, &at.shape, &flow.rates, &mut convection);
        Linear {
            drift,
            fluidity: flow.fluidity.clone(),
            push,
            gather,
            convection,
        }
    }
}

/// The solutions of G x = b, zero in the directions that [`loose`] names; of least norm where G is singular
/// otherwise.
///
/// A nearly straight rod lets its end move along the clamp by far less than across. Scaled to a unit diagonal, G is
/// as regular there as elsewhere: no digits are lost.
pub(crate) fn solve<const D: usize, const K: usize>(
    g: &SMatrix<f64, D, D>,
    b: &SMatrix<f64, D, K>,
) -> Option<SMatrix<f64, D, K>> {
    if !g.iter().all(|x| x.is_finite()) {
        return None;
    }
    let mut scale = g.diagonal().map(|x| 1.0 / x.sqrt());
    for i in loose(g) {
        scale[i] = 0.0;
    }
    let mut scaled = *g;
    let mut right = *b;
    for i in 0..D {
        for j in 0..D {
            scaled[(i, j)] *= scale[i] * scale[j];
        }
        if scale[i] == 0.0 {
            scaled[(i, i)] = 1.0;
        }
        for j in 0..K {
            right[(i, j)] *= scale[i];
        }
    }
    let mut x = match scaled.cholesky() {
        Some(factor) if (0..D).all(|i| factor.l_dirty()[(i, i)].powi(2) > SINGULAR) => {
            factor.solve(&right)
        }
        _ => {
            let dense = DMatrix::from_fn(D, D, |i, j| scaled[(i, j)]);
            let eigen = dense.symmetric_eigen();
            let cut = SINGULAR * eigen.eigenvalues.amax();
            let mut x = SMatrix::zeros();
            let pairs = eigen
                .eigenvalues
                .iter()
                .zip(eigen.eigenvectors.column_iter());
            for (value, vector) in pairs.filter(|(value, _)| **value > cut) {
                let vector = SMatrix::<f64, D, 1>::from_iterator(vector.iter().copied());
                x += vector * (vector.transpose() * right) / *value;
            }
            x
        }
    };
    for (i, mut row) in x.row_iter_mut().enumerate() {
        row *= scale[i];
    }
    Some(x)
}

/// Directions in which no wrench moves the end: along the clamp for a straight inextensible rod, to about the root of
/// [`STRAIGHT`].
pub(crate) fn loose<const D: usize>(g: &SMatrix<f64, D, D>) -> impl Iterator<Item = usize> {
    let diagonal = g.diagonal();
    let largest = diagonal.max();
    (0..D).filter(move |i| !(diagonal[*i] > STRAIGHT * largest))
}
