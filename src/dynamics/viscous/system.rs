//! The differential equations of strains, memory and body, and their linearisation.
//!
//! State: strains e at the nodes, strains z of the dashpots of every Maxwell branch, velocity V of the end; then, which
//! nothing depends on but loads in time: time, energy dissipated in the rod, work of the loads without a potential, loss
//! to drag.

use crate::body::{EndBody, EndLinear};
use crate::solve::system::{Factor, Linearised, System};
use crate::viscous::kinematics::{AtEnd, Kinematics, Local};
use crate::viscous::reduced::{Configuration, Flow, Linear, Reduced, loose, solve};
use nalgebra::{ComplexField, DMatrix, DVector, Dyn, LU, SMatrix};

/// Where what stands in a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Nodes.
    pub nodes: usize,
    /// Strains at a node.
    pub strains: usize,
    /// Maxwell branches.
    pub branches: usize,
    /// Velocities of the end.
    pub end: usize,
}

/// The rate at which the velocity of the end of a straight rod comes back to what the rod allows.
const FADES: f64 = 10.0;
/// Time, dissipated, work, loss to drag.
const INTEGRALS: usize = 4;

impl Layout {
    /// Size of the field of strains.
    pub fn field(&self) -> usize {
        self.nodes * self.strains
    }

    /// Where the velocity stands.
    pub fn velocity(&self) -> usize {
        self.field() * (1 + self.branches)
    }

    /// Where time stands; dissipated energy, work and loss to drag follow.
    pub fn time(&self) -> usize {
        self.velocity() + self.end
    }

    /// Size of the state.
    pub fn len(&self) -> usize {
        self.time() + INTEGRALS
    }

    /// Never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A viscoelastic rod and the body on its end.
#[derive(Debug)]
pub struct ViscousSystem<'a, K, B, const M: usize, const D: usize> {
    /// The rod.
    pub rod: Reduced<K, M, D>,
    /// The body.
    pub body: &'a B,
}

impl<K, B, const M: usize, const D: usize> ViscousSystem<'_, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    /// The layout of its states.
    pub fn layout(&self) -> Layout {
        Layout {
            nodes: self.rod.grid.len(),
            strains: M,
            branches: self.rod.material.branches().len(),
            end: D,
        }
    }

    /// A state at time 0.
    pub fn state(
        &self,
        strains: &[Local<M>],
        memory: &[Vec<Local<M>>],
        v: &AtEnd<D>,
    ) -> DVector<f64> {
        let layout = self.layout();
        let mut y = DVector::zeros(layout.len());
        let fields = std::iter::once(strains).chain(memory.iter().map(Vec::as_slice));
        for (k, field) in fields.enumerate() {
            write(&mut y.as_mut_slice()[k * layout.field()..], field);
        }
        y.fixed_rows_mut::<D>(layout.velocity()).copy_from(v);
        y
    }

    /// The strains of a state.
    pub fn strains(&self, y: &DVector<f64>) -> Vec<Local<M>> {
        read(&y.as_slice()[..self.layout().field()])
    }

    /// The dashpots' strains of a state, branch by branch.
    pub fn memory(&self, y: &DVector<f64>) -> Vec<Vec<Local<M>>> {
        let layout = self.layout();
        let fields = y.as_slice()[layout.field()..layout.velocity()].chunks(layout.field().max(1));
        fields.map(read).collect()
    }

    /// The velocity of the end.
    pub fn velocity(&self, y: &DVector<f64>) -> AtEnd<D> {
        y.fixed_rows::<D>(self.layout().velocity()).into_owned()
    }

    /// Shape and flow of a state; None outside the law's domain.
    #[allow(clippy::type_complexity)] // Two things that are always wanted together.
    pub fn at(&self, y: &DVector<f64>) -> Option<(Configuration<K::Shape, M, D>, Flow<M, D>)> {
        let at = self.rod.configuration(self.strains(y), self.memory(y))?;
        let mut flow = self.rod.flow(&at, &self.velocity(y))?;
        self.hold(y, &at, &mut flow);
        Some((at, flow))
    }

    /// A straight inextensible rod holds its end along the clamp whatever the wrench: G is singular, and
    /// V = int Q^T e_t says nothing of that component of w1. Its derivative does: V_t = (int Q^T e_t)_t, in which e_tt
    /// has no part; what V has drifted off fades.
    fn hold(&self, y: &DVector<f64>, at: &Configuration<K::Shape, M, D>, flow: &mut Flow<M, D>) {
        let g = self.rod.mobility(at, flow);
        for i in loose(&g) {
            let pose = self.rod.kinematics.pose(&at.shape);
            let (time, v) = (y[self.layout().time()], self.velocity(y));
            let n = self.layout().field();
            let mut convection = DMatrix::zeros(D, n);
            self.rod
                .kinematics
                .convection(&self.rod.grid, &at.shape, &flow.rates, &mut convection);
            let rates = flow.rates.iter().flat_map(|rate| rate.iter().copied());
            let bound = convection * DVector::from_iterator(n, rates);
            let wrench = -flow.wrench;
            let free = self.body.motion(time, &pose, &v, &wrench).acceleration;
            let give = self.body.linearised(time, &pose, &v, &wrench).by_wrench;
            let moved: f64 = (0..flow.rates.len())
                .map(|k| self.rod.grid.weights()[k] * at.transfer[k].column(i).dot(&flow.rates[k]))
                .sum();
            let off = FADES * (v[i] - moved);
            flow.wrench[i] += (free[i] - bound[i] + off) / give[(i, i)];
        }
    }
}

fn read<const M: usize>(values: &[f64]) -> Vec<Local<M>> {
    values
        .chunks_exact(M)
        .map(Local::from_column_slice)
        .collect()
}

fn write<const M: usize>(to: &mut [f64], field: &[Local<M>]) {
    for (place, value) in to.chunks_exact_mut(M).zip(field) {
        place.copy_from_slice(value.as_slice());
    }
}

impl<K, B, const M: usize, const D: usize> System for ViscousSystem<'_, K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    type Linearised = ViscousLinear<M, D>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let layout = self.layout();
        let (at, flow) = self.at(y)?;
        let slots = out.as_mut_slice();
        write(slots, &flow.rates);
        for (k, (branch, z)) in self
            .rod
            .material
            .branches()
            .iter()
            .zip(&at.memory)
            .enumerate()
        {
            let rates: Vec<Local<M>> = at
                .strains
                .iter()
                .zip(z)
                .map(|(e, z)| (e - z) / branch.time)
                .collect();
            write(&mut slots[(k + 1) * layout.field()..], &rates);
        }
        let pose = self.rod.kinematics.pose(&at.shape);
        let time = layout.time();
        let motion = self
            .body
            .motion(y[time], &pose, &self.velocity(y), &-flow.wrench);
        out.fixed_rows_mut::<D>(layout.velocity())
            .copy_from(&motion.acceleration);
        let density = self.rod.dissipation(&at, &flow);
        out[time] = 1.0;
        out[time + 1] = density
            .iter()
            .zip(self.rod.grid.weights())
            .map(|(d, w)| d * w)
            .sum();
        out[time + 2] = motion.power;
        out[time + 3] = motion.loss;
        out.iter().all(|x| x.is_finite()).then_some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<ViscousLinear<M, D>> {
        let (at, flow) = self.at(y)?;
        let rod = self.rod.linear(&at, &flow)?;
        let pose = self.rod.kinematics.pose(&at.shape);
        let time = y[self.layout().time()];
        Some(ViscousLinear {
            layout: self.layout(),
            relaxing: self
                .rod
                .material
                .branches()
                .iter()
                .map(|branch| {
                    let blocks = rod.fluidity.iter().map(|c| c * branch.modulus).collect();
                    (blocks, branch.time)
                })
                .collect(),
            body: self
                .body
                .linearised(time, &pose, &self.velocity(y), &-flow.wrench),
            rod,
        })
    }

    /// Strains and memory are judged in the mean over the rod, relative to 1 + their size; so are velocity and energies.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let layout = self.layout();
        let part = |i: usize| (error[i] / (1.0 + from[i].abs().max(to[i].abs()))).powi(2);
        let mut sum = 0.0;
        for k in 0..=layout.branches {
            for (node, weight) in self.rod.grid.weights().iter().enumerate() {
                let first = k * layout.field() + node * M;
                sum += weight * (first..first + M).map(part).sum::<f64>() / M as f64;
            }
        }
        let velocity = layout.velocity();
        sum += (velocity..velocity + D).map(part).sum::<f64>() / D as f64;
        let time = layout.time();
        sum += (time + 1..time + INTEGRALS).map(part).sum::<f64>();
        sum / (2 + layout.branches) as f64
    }
}

/// The Jacobian of a [`ViscousSystem`]: blocks by node, of the rank of the end's velocities, and the geometry.
#[derive(Debug, Clone)]
pub struct ViscousLinear<const M: usize, const D: usize> {
    layout: Layout,
    rod: Linear<M, D>,
    /// Of every Maxwell branch: d e_t/d z by node, and the time.
    relaxing: Vec<(Vec<SMatrix<f64, M, M>>, f64)>,
    body: EndLinear<D>,
}

/// sigma - J without the memory and the velocity, which are eliminated: strains and end wrench remain.
#[derive(Debug)]
pub struct ViscousFactor<T: ComplexField, const M: usize, const D: usize> {
    linear: ViscousLinear<M, D>,
    sigma: T,
    lu: LU<T, Dyn, Dyn>,
    rows: Vec<f64>,
}

impl<const M: usize, const D: usize> Linearised for ViscousLinear<M, D> {
    type Factor<T: ComplexField<RealField = f64> + Copy> = ViscousFactor<T, M, D>;

    /// With de_t = sigma de - b_e the velocity is dV = (sigma gather + convection) de - gather b_e, and
    /// ```text
    /// (sigma - drift - sum_k relaxing_k/(1 + sigma tau_k)) de - push dw = b_e + ...
    /// ((sigma - a_V)(sigma gather + convection) - a_pose gather) de + a_w dw = b_V + (sigma - a_V) gather b_e.
    /// ```
    fn shifted<T: ComplexField<RealField = f64> + Copy>(
        &self,
        sigma: T,
    ) -> Option<ViscousFactor<T, M, D>> {
        let n = self.layout.field();
        let real = T::from_real;
        let mut matrix = DMatrix::<T>::zeros(n + D, n + D);
        for j in 0..n {
            for i in 0..n {
                matrix[(i, j)] = real(-self.rod.drift[(i, j)]);
            }
            matrix[(j, j)] += sigma;
        }
        for (blocks, time) in &self.relaxing {
            let share = T::one() / (T::one() + sigma * real(*time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    matrix[(node * M + i, node * M + j)] -= real(block[(i, j)]) * share;
                }
            }
        }
        let largest = self.rod.push.amax();
        let wrench = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        for j in 0..D {
            for i in 0..n {
                matrix[(i, n + j)] = real(-self.rod.push[(i, j)] * wrench);
            }
            for i in 0..D {
                matrix[(n + i, n + j)] = real(self.body.by_wrench[(i, j)] * wrench);
            }
        }
        // Row by row: (sigma - a_V) applied to the velocity's rows.
        for j in 0..n {
            let mut velocity = [T::zero(); D];
            for (i, v) in velocity.iter_mut().enumerate() {
                *v = sigma * real(self.rod.gather[(i, j)]) + real(self.rod.convection[(i, j)]);
            }
            for i in 0..D {
                let mut entry = sigma * velocity[i];
                for k in 0..D {
                    entry -= real(self.body.by_velocity[(i, k)]) * velocity[k]
                        + real(self.body.by_pose[(i, k)] * self.rod.gather[(k, j)]);
                }
                matrix[(n + i, j)] = entry;
            }
        }
        // Rows of one size: stiffness and inertia have none in common.
        let mut rows = vec![0.0; n + D];
        for (i, row) in rows.iter_mut().enumerate() {
            let size = (0..n + D)
                .map(|j| matrix[(i, j)].modulus())
                .fold(0.0, f64::max);
            if !(size > 0.0 && size.is_finite()) {
                return None;
            }
            *row = 1.0 / size;
            for j in 0..n + D {
                matrix[(i, j)] *= real(*row);
            }
        }
        Some(ViscousFactor {
            linear: self.clone(),
            sigma,
            lu: matrix.lu(),
            rows,
        })
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let layout = self.layout;
        let n = layout.field();
        let mut out = DVector::zeros(x.len());
        let e = x.rows(0, n);
        let mut rate = &self.rod.drift * e;
        for (k, (blocks, time)) in self.relaxing.iter().enumerate() {
            let z = x.rows((k + 1) * n, n);
            for (node, block) in blocks.iter().enumerate() {
                let pull = block * z.fixed_rows::<M>(node * M);
                let mut at = rate.fixed_rows_mut::<M>(node * M);
                at += pull;
            }
            out.rows_mut((k + 1) * n, n).copy_from(&((e - z) / *time));
        }
        let v = x.fixed_rows::<D>(layout.velocity()).into_owned();
        let missing = v - &self.rod.convection * e - &self.rod.gather * &rate;
        let g = (&self.rod.gather * &self.rod.push)
            .fixed_view::<D, D>(0, 0)
            .into_owned();
        let w = solve(&g, &AtEnd::<D>::from_column_slice(missing.as_slice()))
            .unwrap_or_else(AtEnd::zeros);
        rate += &self.rod.push * w;
        out.rows_mut(0, n).copy_from(&rate);
        let moved = AtEnd::<D>::from_column_slice((&self.rod.gather * e).as_slice());
        let acceleration =
            self.body.by_pose * moved + self.body.by_velocity * v - self.body.by_wrench * w;
        out.fixed_rows_mut::<D>(layout.velocity())
            .copy_from(&acceleration);
        out
    }
}

fn pairs<const M: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..M).flat_map(|i| (0..M).map(move |j| (i, j)))
}

impl<T: ComplexField<RealField = f64> + Copy, const M: usize, const D: usize> Factor<T>
    for ViscousFactor<T, M, D>
{
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let ViscousLinear {
            layout,
            rod,
            relaxing,
            body,
        } = &self.linear;
        let n = layout.field();
        let real = T::from_real;
        let mut right = DVector::<T>::zeros(n + D);
        right.rows_mut(0, n).copy_from(&b.rows(0, n));
        for (k, (blocks, time)) in relaxing.iter().enumerate() {
            // dz = (b_z + de/tau)/(sigma + 1/tau)
            let share = T::one() / (self.sigma + real(1.0 / time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    right[node * M + i] +=
                        real(block[(i, j)]) * share * b[(k + 1) * n + node * M + j];
                }
            }
        }
        let mut gathered = [T::zero(); D];
        for (i, sum) in gathered.iter_mut().enumerate() {
            for j in 0..n {
                *sum += real(rod.gather[(i, j)]) * b[j];
            }
        }
        let velocity = layout.velocity();
        for i in 0..D {
            right[n + i] = b[velocity + i] + self.sigma * gathered[i];
            for k in 0..D {
                right[n + i] -= real(body.by_velocity[(i, k)]) * gathered[k];
            }
        }
        for (value, row) in right.iter_mut().zip(&self.rows) {
            *value *= real(*row);
        }
        if !self.lu.solve_mut(&mut right) {
            return false;
        }
        for i in 0..D {
            let mut v = -gathered[i];
            for j in 0..n {
                v += (self.sigma * real(rod.gather[(i, j)]) + real(rod.convection[(i, j)]))
                    * right[j];
            }
            b[velocity + i] = v;
        }
        for (k, (_, time)) in relaxing.iter().enumerate() {
            let share = T::one() / (self.sigma + real(1.0 / time));
            for j in 0..n {
                let at = (k + 1) * n + j;
                b[at] = (b[at] + right[j] * real(1.0 / time)) * share;
            }
        }
        b.rows_mut(0, n).copy_from(&right.rows(0, n));
        for i in layout.time()..layout.len() {
            b[i] /= self.sigma;
        }
        b.iter().all(|x| x.is_finite())
    }
}
