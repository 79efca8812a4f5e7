//! Differential equations of strains, memory and body, and their linearisation.
//!
//! State: strains e at the nodes, strains z of the dashpots of each Maxwell branch, velocity V of the end. Then come
//! time, energy dissipated in the rod, work of the loads without a potential, loss to drag; then place and wrench w1
//! of the end.
//!
//! The equations of theory Sec. 5 are solved in one of three forms ([`Hold`]), which differ in the equation for the
//! wrench w1:
//!
//! * From strains and velocity, by the positive definite G (5.10). Explicit steps always use this form; place and
//!   wrench in the state are then idle.
//! * As an unknown of its own, beside strains and velocity, in the equation int Q^T e_t = V. An inextensible rod that
//!   is straight to within an angle a has G ~ a^2 along the clamp. In the first form an error d of the velocity
//!   becomes d/a^2 in the wrench and d/a in the stresses, which breaks a nonlinear friction law. With w1 unknown the
//!   equations have nothing of size 1/a, and implicit steps pass through the straight rod.
//! * From the place of the end. For small viscosities eta the strain rates are small differences of terms of size
//!   1/eta, which must cancel in the velocity of the end. Newton's iteration of an implicit step then contracts only
//!   for steps up to eta^(1/3). The time integrals of those equations have nothing of size 1/eta beside e_t itself,
//!   and become those of the elastic rod as eta -> 0:
//! ```text
//! e_t = R(e, Q w1 - S),   M V_t = -w1 + loads,   place_t = V,   0 = pose(e) - place.
//! ```

mod linear;
mod small_motions;

pub use linear::{ViscousFactor, ViscousLinear};
pub use small_motions::Rates;

use crate::body::EndBody;
use crate::math::small_matrices::times;
use crate::solve::system::System;
use crate::viscoelastic::end_pose;
use crate::viscoelastic::kinematics::{AtEnd, EndAndPowers, Kinematics, Local};
use crate::viscoelastic::reduced::{Configuration, Flow, Linear, Reduced, Workspace, loose, solve};
use linear::relaxation;
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::cell::RefCell;
use std::slice;
use std::sync::Arc;

/// Layout of a state: sizes and indices of its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of strains at a node.
    pub strains: usize,
    /// Number of Maxwell branches.
    pub branches: usize,
    /// Number of velocities of the end.
    pub end: usize,
    /// Number of components of the pose of the end.
    pub place: usize,
}

/// Relaxation rate for a straight inextensible rod: the velocity of its end along the rod, which drifts by errors of
/// the steps, returns at this rate to the velocity of the strain rates.
const FADES: f64 = 10.0;
/// Largest number of states whose slopes are found together: the stages of an implicit step.
const STAGES: usize = 8;
/// Number of integrals over time in a state: time itself, energy dissipated, work, loss to drag.
const INTEGRALS: usize = 4;

impl Layout {
    /// Size of the field of strains.
    pub fn field(&self) -> usize {
        self.nodes * self.strains
    }

    /// Index of the velocity.
    pub fn velocity(&self) -> usize {
        self.field() * (1 + self.branches)
    }

    /// Index of time; dissipated energy, work and loss to drag follow.
    pub fn time(&self) -> usize {
        self.velocity() + self.end
    }

    /// Index of the place of the end.
    pub fn place(&self) -> usize {
        self.time() + INTEGRALS
    }

    /// Index of the wrench on the end.
    pub fn wrench(&self) -> usize {
        self.place() + self.place
    }

    /// Size of the state.
    pub fn len(&self) -> usize {
        self.wrench() + self.end
    }

    /// Always false: a state holds time at least.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The equation from which implicit steps find the wrench w1 on the end (see the module's head).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// The end moves at V, int Q^T e_t = V, solved for w1 at every evaluation of the slope.
    Velocity,
    /// The equation of [`Hold::Velocity`], solved for w1 together with the strains and the velocity of an implicit
    /// step.
    Together,
    /// The pose of the strains equals the integrated place: pose(e) = place.
    Place,
}

/// [`Hold::Place`] is chosen only if the strains relax faster than the velocity of the end by this factor.
const FASTER: f64 = 3.0;
/// [`Hold::Place`] is chosen once the fastest relaxation rate of the strains, times the step, exceeds the first
/// number, and left once that product falls below the second.
const STIFF: [f64; 2] = [1e2, 1e1];
/// Bounds of [`Hold::Together`], likewise, for the relaxation rate of the velocity of the end.
const TIGHT: [f64; 2] = [1e3, 1e2];

/// A viscoelastic rod and the body on its end.
#[derive(Debug)]
pub struct ViscousSystem<K: Kinematics<M, D>, B, const M: usize, const D: usize> {
    /// The rod.
    pub rod: Reduced<K, M, D>,
    /// The body, owned or borrowed.
    pub body: B,
    /// The form of implicit steps.
    pub hold: Hold,
    /// Workspace of right-hand sides, to avoid allocations; without state.
    room: RefCell<Workspace<K, M, D>>,
}

impl<K, B, const M: usize, const D: usize> ViscousSystem<K, B, M, D>
where
    K: Kinematics<M, D>,
{
    /// A rod with a body on its end, and the form of implicit steps.
    pub fn new(rod: Reduced<K, M, D>, body: B, hold: Hold) -> Self {
        let room = RefCell::default();
        Self {
            rod,
            body,
            hold,
            room,
        }
    }
}

impl<K, B, const M: usize, const D: usize> ViscousSystem<K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    /// The rod with the section law of the time of a state; None where the law is not defined.
    fn rod_at(&self, y: &DVector<f64>) -> Option<Cow<'_, Reduced<K, M, D>>> {
        if !self.rod.material.varies_in_time() {
            return Some(Cow::Borrowed(&self.rod));
        }
        let material = self.rod.material.seen_at(y[self.layout().time()])?;
        Some(Cow::Owned(Reduced {
            material,
            ..self.rod.clone()
        }))
    }

    /// First time after `t` at which a load, a support or the section law is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        let law = self.rod.material.next_break(t);
        self.body.next_break(t).min(law)
    }

    /// Layout of the system's states.
    pub fn layout(&self) -> Layout {
        Layout {
            nodes: self.rod.grid.len(),
            strains: M,
            branches: self.rod.material.branches().len(),
            end: D,
            place: K::PLACE,
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
        if let Some(shape) = self.rod.kinematics.shape(&self.rod.grid, strains) {
            let slots = &mut y.as_mut_slice()[layout.place()..layout.wrench()];
            K::place(&self.rod.kinematics.pose(&shape), slots);
        }
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

    /// The form that implicit steps of about length `h` should take from here on. By place if the strains relax fast
    /// against the step and faster than the velocity of the end. Together if that velocity relaxes fast against the
    /// step, as for a nearly straight inextensible rod.
    pub fn suited(
        &self,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
        y: &DVector<f64>,
        h: f64,
    ) -> Hold {
        let nodes = self.rod.grid.nodes().iter().zip(&at.strains);
        let rod = self.rod_at(y);
        let tangent = |s: f64, e: &Local<M>| rod.as_ref()?.material.tangent(s, e);
        let strains = nodes
            .zip(&flow.fluidity)
            .filter_map(|((s, e), c)| Some(times(c, &tangent(*s, e)?).norm()))
            .fold(0.0, f64::max);
        let pose = self.rod.kinematics.pose(&at.shape);
        let time = y[self.layout().time()];
        let body = self
            .body
            .linearised(time, &pose, &self.velocity(y), &-flow.wrench);
        let g = &flow.mobility;
        let end = if loose(g).next().is_some() {
            f64::INFINITY
        } else {
            relaxation(&body.by_wrench, g)
        };
        let stiff = STIFF[usize::from(self.hold == Hold::Place)];
        let tight = TIGHT[usize::from(self.hold == Hold::Together)];
        if strains * h > stiff && strains > FASTER * end {
            Hold::Place
        } else if end * h > tight {
            Hold::Together
        } else {
            Hold::Velocity
        }
    }

    /// Sets the configuration in the workspace to that of a state.
    fn configure(
        &self,
        rod: &Reduced<K, M, D>,
        y: &DVector<f64>,
        room: &mut Workspace<K, M, D>,
    ) -> Option<()> {
        let layout = self.layout();
        let (strains, memory) = y.as_slice()[..layout.velocity()].split_at(layout.field());
        let refill = |field: &mut Vec<Local<M>>, values: &[f64]| {
            field.clear();
            field.extend(values.chunks_exact(M).map(Local::from_column_slice));
        };
        refill(&mut room.at.strains, strains);
        room.at.memory.resize(layout.branches, Vec::new());
        for (field, values) in (room.at.memory.iter_mut()).zip(memory.chunks(layout.field())) {
            refill(field, values);
        }
        rod.configure(&mut room.at, &mut room.shaping)
    }

    fn place<'y>(&self, y: &'y DVector<f64>) -> &'y [f64] {
        let layout = self.layout();
        &y.as_slice()[layout.place()..layout.wrench()]
    }

    /// Writes the rates of all components of a state but the end wrench.
    fn write_slope(
        &self,
        rod: &Reduced<K, M, D>,
        y: &DVector<f64>,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
        out: &mut DVector<f64>,
    ) -> Option<()> {
        let layout = self.layout();
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
            let places = slots[(k + 1) * layout.field()..].chunks_exact_mut(M);
            for ((place, e), z) in places.zip(&at.strains).zip(z) {
                place.copy_from_slice(((e - z) / branch.time).as_slice());
            }
        }
        let pose = self.rod.kinematics.pose(&at.shape);
        let end = EndAndPowers {
            pose,
            dissipated: rod.dissipated(at, flow),
            driven: rod.driven(at, flow)?,
        };
        self.write_body(y, &end, &flow.wrench, slots);
        slots[..layout.wrench()]
            .iter()
            .all(|x| x.is_finite())
            .then_some(())
    }

    /// Writes the rates of the body, of the integrals and of the place.
    fn write_body(
        &self,
        y: &DVector<f64>,
        end: &EndAndPowers<K::Pose>,
        wrench: &AtEnd<D>,
        slots: &mut [f64],
    ) {
        let layout = self.layout();
        let (time, velocity) = (layout.time(), self.velocity(y));
        let motion = self.body.motion(y[time], &end.pose, &velocity, &-wrench);
        slots[layout.velocity()..time].copy_from_slice(motion.acceleration.as_slice());
        slots[time] = 1.0;
        slots[time + 1] = end.dissipated;
        slots[time + 2] = motion.power + end.driven;
        slots[time + 3] = motion.loss;
        end_pose::rates(
            self.place(y),
            &velocity,
            &mut slots[layout.place()..layout.wrench()],
        );
    }

    /// Completes [`System::balance`] of [`Hold::Place`] beside the rates of strains and memory, from the end and the
    /// powers of the rod.
    fn held(
        &self,
        y: &DVector<f64>,
        end: &EndAndPowers<K::Pose>,
        out: &mut DVector<f64>,
    ) -> Option<()> {
        let (layout, slots) = (self.layout(), out.as_mut_slice());
        let wrench = y.fixed_rows::<D>(layout.wrench()).into_owned();
        self.write_body(y, end, &wrench, slots);
        let mut reached = [0.0; 7];
        let reached = &mut reached[..K::PLACE];
        K::place(&end.pose, reached);
        let gap = end_pose::gap::<D>(self.place(y), reached);
        slots[layout.wrench()..].copy_from_slice(gap.as_slice());
        slots.iter().all(|x| x.is_finite()).then_some(())
    }

    /// Shape and flow of a state; None outside the law's domain.
    #[allow(clippy::type_complexity)] // Configuration and flow are needed together.
    pub fn at(&self, y: &DVector<f64>) -> Option<(Configuration<K::Shape, M, D>, Flow<M, D>)> {
        let rod = self.rod_at(y)?;
        let at = rod.configuration(self.strains(y), self.memory(y))?;
        let mut flow = rod.flow(&at, &self.velocity(y))?;
        self.hold(y, &at, &mut flow);
        Some((at, flow))
    }

    /// Shape and flow of a state that an implicit step has reached. [`Hold::Together`] found its wrench. V differs
    /// from the velocity of strains and wrench by the remainder of Newton's iteration. That is small in V, but not in
    /// the wrench that would follow from V where G is small.
    #[allow(clippy::type_complexity)] // Configuration and flow.
    pub fn reached(&self, y: &DVector<f64>) -> Option<(Configuration<K::Shape, M, D>, Flow<M, D>)> {
        match self.hold {
            Hold::Together => self.under(y),
            Hold::Velocity | Hold::Place => self.at(y),
        }
    }

    /// Shape and flow under the wrench of the state.
    #[allow(clippy::type_complexity)] // Configuration and flow.
    fn under(&self, y: &DVector<f64>) -> Option<(Configuration<K::Shape, M, D>, Flow<M, D>)> {
        let rod = self.rod_at(y)?;
        let at = rod.configuration(self.strains(y), self.memory(y))?;
        let wrench = y.fixed_rows::<D>(self.layout().wrench()).into_owned();
        let flow = rod.under(&at, &wrench)?;
        Some((at, flow))
    }

    /// Shifts the end by a small twist `by`: the strains change as a wrench of the right size would change them. None
    /// where wrenches do not move the end that way, as along a straight rod that cannot stretch.
    pub fn shift_end(&self, y: &mut DVector<f64>, by: &AtEnd<D>) -> Option<()> {
        let (at, flow) = self.at(y)?;
        if loose(&flow.mobility).next().is_some() {
            return None;
        }
        let wrench = solve(&flow.mobility, by)?;
        for (i, (fluidity, transfer)) in flow.fluidity.iter().zip(&at.transfer).enumerate() {
            let change = fluidity * (transfer * wrench);
            let mut strain = y.fixed_rows_mut::<M>(i * M);
            strain += change;
        }
        let shape = (self.rod.kinematics).shape(&self.rod.grid, &self.strains(y))?;
        let layout = self.layout();
        let slots = &mut y.as_mut_slice()[layout.place()..layout.wrench()];
        K::place(&self.rod.kinematics.pose(&shape), slots);
        Some(())
    }

    /// Jacobian of the system from that of the rod.
    fn with_body(
        &self,
        y: &DVector<f64>,
        at: &Configuration<K::Shape, M, D>,
        flow: &Flow<M, D>,
        rod: Linear<M, D>,
    ) -> ViscousLinear<M, D> {
        let layout = self.layout();
        let pose = self.rod.kinematics.pose(&at.shape);
        let velocity = self.velocity(y);
        let branches = self.rod.material.branches().iter();
        ViscousLinear {
            layout,
            relaxing: branches
                .map(|branch| {
                    let blocks = rod
                        .fluidity
                        .iter()
                        .map(|c| times(c, &branch.modulus))
                        .collect();
                    (blocks, branch.time)
                })
                .collect(),
            body: self
                .body
                .linearised(y[layout.time()], &pose, &velocity, &-flow.wrench),
            spin: end_pose::spin(self.place(y), &velocity),
            place: self.place(y).into(),
            hold: self.hold,
            mobility: flow.mobility,
            rod: Arc::new(rod),
        }
    }

    /// A straight inextensible rod holds its end along the clamp for any wrench: G is singular, and V = int Q^T e_t
    /// leaves that component of w1 open. The derivative V_t = (int Q^T e_t)_t determines it, and e_tt has no part in
    /// that. The drift of V decays.
    fn hold(&self, y: &DVector<f64>, at: &Configuration<K::Shape, M, D>, flow: &mut Flow<M, D>) {
        let g = flow.mobility;
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

impl<K, B, const M: usize, const D: usize> System for ViscousSystem<K, B, M, D>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    type Linearised = ViscousLinear<M, D>;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let room = &mut *self.room.borrow_mut();
        let rod = &*self.rod_at(y)?;
        self.configure(rod, y, room)?;
        rod.flow_in(room, &self.velocity(y))?;
        self.hold(y, &room.at, &mut room.flow);
        self.write_slope(rod, y, &room.at, &room.flow, out)?;
        out.rows_mut(self.layout().wrench(), D).fill(0.0);
        Some(())
    }

    fn algebraic(&self) -> usize {
        match self.hold {
            Hold::Velocity => 0,
            Hold::Together | Hold::Place => D,
        }
    }

    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        match self.hold {
            Hold::Velocity => return self.slope(y, out),
            Hold::Place => return self.balances(slice::from_ref(y), slice::from_mut(out)),
            Hold::Together => {}
        }
        let room = &mut *self.room.borrow_mut();
        let rod = &*self.rod_at(y)?;
        self.configure(rod, y, room)?;
        let wrench = y.fixed_rows::<D>(self.layout().wrench()).into_owned();
        rod.press(&room.at, &wrench, &mut room.flow)?;
        self.write_slope(rod, y, &room.at, &room.flow, out)?;
        let gap = rod.moved(&room.at, &room.flow) - self.velocity(y);
        out.fixed_rows_mut::<D>(self.layout().wrench())
            .copy_from(&gap);
        out.iter().all(|x| x.is_finite()).then_some(())
    }

    /// By place the shapes of all states are found at once, since they are independent; one by one under a law that
    /// varies in time.
    fn balances(&self, states: &[DVector<f64>], out: &mut [DVector<f64>]) -> Option<()> {
        if self.hold != Hold::Place {
            let mut pairs = states.iter().zip(out);
            return pairs.try_for_each(|(y, out)| self.balance(y, out));
        }
        let (wrench, velocity) = (self.layout().wrench(), self.layout().velocity());
        let together = if self.rod.material.varies_in_time() {
            1
        } else {
            STAGES
        };
        for (states, out) in states.chunks(together).zip(out.chunks_mut(together)) {
            let n = states.len();
            let mut fields = [(&[][..], AtEnd::zeros()); STAGES];
            for ((field, w), y) in fields.iter_mut().zip(states) {
                *field = &y.as_slice()[..velocity];
                *w = y.fixed_rows::<D>(wrench).into_owned();
            }
            let mut ends = [const { None }; STAGES];
            let mut slopes = out.iter_mut();
            let mut rates: [&mut [f64]; STAGES] = std::array::from_fn(|_| match slopes.next() {
                Some(out) => &mut out.as_mut_slice()[..velocity],
                None => &mut [],
            });
            let room = &mut *self.room.borrow_mut();
            self.rod_at(&states[0])?.flowing(
                &fields[..n],
                &mut rates[..n],
                &mut ends[..n],
                room,
            )?;
            for ((y, out), end) in states.iter().zip(out).zip(&ends) {
                self.held(y, end.as_ref()?, out)?;
            }
        }
        Some(())
    }

    fn settle(&self, y: &mut DVector<f64>) -> Option<()> {
        let layout = self.layout();
        let (at, flow) = self.at(y)?;
        let slots = &mut y.as_mut_slice()[layout.place()..layout.wrench()];
        K::place(&self.rod.kinematics.pose(&at.shape), slots);
        y.fixed_rows_mut::<D>(layout.wrench())
            .copy_from(&flow.wrench);
        Some(())
    }

    /// Uses the wrench that follows from strains and velocity; the wrench in the state may be less accurate.
    fn linearised(&self, y: &DVector<f64>) -> Option<ViscousLinear<M, D>> {
        let (at, flow) = self.at(y)?;
        let rod = self.rod_at(y)?.linear(&at, &flow)?;
        Some(self.with_body(y, &at, &flow, rod))
    }

    /// Neglects the rotation of the loads relative to the deforming rod: the strains at a node then affect only each
    /// other and the end.
    fn roughly_linearised(&self, y: &DVector<f64>) -> Option<ViscousLinear<M, D>> {
        let (at, flow) = match self.hold {
            Hold::Velocity => self.at(y)?,
            Hold::Together | Hold::Place => self.under(y)?,
        };
        let rod = self.rod_at(y)?.roughly_linear(&at, &flow)?;
        Some(self.with_body(y, &at, &flow, rod))
    }

    /// Error norm: strains and memory in the mean over the rod, relative to 1 + their size; likewise velocity and
    /// energies.
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
        sum += (time + 1..layout.place()).map(part).sum::<f64>();
        sum / (2 + layout.branches) as f64
    }
}
