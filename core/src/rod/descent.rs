//! Rest by descent: the stable equilibrium to which a rod falls that is let go from its unloaded shape.
//!
//! The rod is a chain of `n` intervals with a rotation R_j at every node. On interval k, of length h, the strains u =
//! log(R_k^T R_k+1)/h and v are constant, and the middle section has the rotation R = R_k exp(h u/2). The energy is
//! ```text
//! E = sum_k (h W(u_k, v_k) - G_k . h R v_k) - F . R_n a + (K/2) sum (x - held place)^2 + (T/2) (held turn)^2,
//! ```
//! G_k is the dead load beyond the middle of interval k, F the force on the end, a the arm of the force. K and T are
//! stiffnesses of springs that stand for a held end. Only neighbours are coupled, but for the springs of the place:
//! the Hessian is block tridiagonal plus a matrix of rank 3, and a Newton step costs a time linear in n. Steps are
//! regularised until the Hessian is positive definite, and E falls in every step (a trust region by Levenberg's
//! shift). Intervals that turn far are halved. [`Chain::section`] gives the guess from which collocation converges.

use super::Problem;
use super::distributed_load::ScaledLoad;
use super::scaled_law::ScaledLaw;
use crate::error::Result;
use crate::math::se3::{
    Turn, conjugate, exponential, frame, inverse_left_jacobian, left_jacobian, product,
    rotation_vector,
};
use crate::section::Free;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

/// Unknowns of an interval: turn of the far node, strains v.
type IntervalPart = Vector6<f64>;
type IntervalBlock = SMatrix<f64, 6, 6>;
/// Right-hand sides: the gradient, and the derivatives of three held coordinates of the end.
const SIDES: usize = 4;
type Sides = SMatrix<f64, 6, SIDES>;

/// Intervals at first, most intervals, and the turn in radians beyond which an interval is halved.
const FEWEST: usize = 40;
const MOST: usize = 1_200;
const TURNED: f64 = 0.25;
/// Turn of an interval in radians beyond which the chain is refined at once.
const SHARP: f64 = 0.8;
/// Stiffness of the springs of a held end, over the size of forces and couples.
const HOLD: f64 = 100.0;
/// Stiffness of the springs of a flexure or twist that is held rigid, over the size of forces and couples.
const STIFF: f64 = 1e3;
/// Tilt of the unloaded rod about d2, and axes of a generic tilt: no unstable equilibrium is kept by symmetry.
const TILT: f64 = 1e-2;
const GENERIC: [f64; 3] = [0.7, 1.0, 0.4];
/// Largest turn of a section in a step, in radians, and the turn at which a coarse and the last mesh have converged.
const LONGEST_STEP: f64 = 0.6;
const LOOSE: f64 = 0.03;
const CONVERGED: f64 = 1e-4;
/// Most steps on all meshes together.
const STEPS: usize = 600;
/// Step of the differences that form the second derivatives.
const DIFFERENCE: f64 = 1e-6;
/// Falls in turn. The first keeps to a plane of symmetry where it can. The second looks out of the plane, and leaves
/// equilibria that are unstable by little.
pub(super) const FALLS: [Lean; 2] = [
    Lean {
        way: [0.0, 1.0],
        tilt: 1e-7,
        neutral: 1e-6,
    },
    Lean {
        way: [0.0, 1.0],
        tilt: 1e-2,
        neutral: 1e-8,
    },
];
/// Axes of the first tilt, in d1 and d2, from which all equilibria of a heavy rod are looked for.
const WAYS: [[f64; 2]; 4] = [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]];
/// Least part of the predicted fall of energy that a step must reach.
const ENOUGH: f64 = 1e-4;

/// Start and end of a fall.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lean {
    /// Axis of the first tilt, in d1 and d2; in a plane the sign of its sum is that of the turn about the normal.
    way: [f64; 2],
    /// Tilt of the unloaded rod about generic axes.
    tilt: f64,
    /// Largest shift, over 1 + the force, at which an equilibrium counts as stable: neutral directions are allowed.
    neutral: f64,
}

impl Lean {
    /// This fall, begun from tilts every way.
    pub fn every_way(self) -> impl Iterator<Item = Self> {
        WAYS.into_iter().map(move |way| Self { way, ..self })
    }
}

/// Rotations of the nodes of a rod, and the strains v of its intervals.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub places: Vec<f64>,
    turns: Vec<Turn>,
    v: Vec<Vector3<f64>>,
    /// Couples m of the intervals, in the directors of the clamp.
    couples: Vec<Vector3<f64>>,
    /// Force n(0).
    pub base_force: Vector3<f64>,
}

/// A rod with dead loads and a held end, in the clamp's frame and the numerics' units.
struct ChainFall<'a> {
    law: &'a ScaledLaw,
    weight: Option<&'a ScaledLoad>,
    force: Vector3<f64>,
    arm: Vector3<f64>,
    /// Held coordinates of the end: direction and value.
    held: Vec<(Vector3<f64>, f64)>,
    turned: Option<Matrix3<f64>>,
    /// Free strains among v.
    free: [bool; 3],
    /// Normal of the plane that the rod does not leave.
    normal: Option<Vector3<f64>>,
    lean: Lean,
    /// Size of the forces, at least 1.
    size: f64,
}

/// Way of the centreline along an interval, and the gradient of the energy by the turns of both ends and v.
struct ChainInterval {
    way: Vector3<f64>,
    gradient: [Vector3<f64>; 3],
    /// B of phi = (1 - B) phi_a + B phi_b, the turn of the middle section.
    share: Matrix3<f64>,
    middle: Matrix3<f64>,
    couple: Vector3<f64>,
}

/// The energy to second order about a chain.
struct Quadratic {
    energy: f64,
    gradient: Vec<IntervalPart>,
    diagonal: Vec<IntervalBlock>,
    below: Vec<IntervalBlock>,
    /// Derivatives of the held coordinates, column by column.
    held: Vec<SMatrix<f64, 6, 3>>,
}

/// A step of the chain.
struct ChainStep {
    parts: Vec<IntervalPart>,
    /// Largest turn.
    turn: f64,
    /// Predicted fall of the energy.
    fall: f64,
}

impl Problem {
    /// The chain at rest in a stable equilibrium to which the unloaded rod falls, in space or in the plane with a given
    /// normal. `None` for loads without a potential, and if the descent does not converge.
    pub(super) fn descended(&self, normal: Option<Vector3<f64>>, lean: Lean) -> Option<Chain> {
        if !self.is_conservative() {
            return None;
        }
        let (law, weight) = self.law_and_load();
        let mut force = Vector3::zeros();
        let mut held = Vec::new();
        for ((axis, target), is_held) in self.axes.iter().zip(self.targets).zip(self.is_held()) {
            if is_held {
                held.push((*axis, target));
            } else {
                force += axis * target;
            }
        }
        let borne = weight.map_or(0.0, |weight| weight.total().norm());
        let fall = ChainFall {
            law,
            weight,
            force,
            arm: self.arm,
            held,
            turned: self.orientation,
            free: std::array::from_fn(|k| !law.rigid()[3 + k]),
            normal,
            lean,
            size: 1.0 + force.norm() + borne,
        };
        fall.rest(fall.unloaded().ok()?)
    }
}

impl Chain {
    /// A heavy rod at rest under `force` on an end that is free to move. The end has the directors `turned`, or turns
    /// freely if none are given.
    pub fn at_rest_under(
        law: &ScaledLaw,
        weight: &ScaledLoad,
        force: Vector3<f64>,
        turned: Option<Matrix3<f64>>,
    ) -> Option<Self> {
        let fall = ChainFall {
            law,
            weight: Some(weight),
            force,
            arm: Vector3::zeros(),
            held: Vec::new(),
            turned,
            free: std::array::from_fn(|k| !law.rigid()[3 + k]),
            normal: None,
            lean: FALLS[0],
            size: 1.0 + force.norm() + weight.total().norm(),
        };
        fall.rest(fall.unloaded().ok()?)
    }

    /// Rotation and couple of the section at `s`.
    pub fn section(&self, s: f64) -> (Turn, Vector3<f64>) {
        let n = self.v.len();
        let k = self.interval(s);
        let (from, to) = (self.places[k], self.places[k + 1]);
        let x = (s - from) / (to - from);
        let turn = product(&self.turns[k], &exponential(&(self.turning(k) * x)));
        // Couples belong to the middle of an interval.
        let beside = if x < 0.5 {
            k.saturating_sub(1)
        } else {
            (k + 1).min(n - 1)
        };
        let middle = |k: usize| 0.5 * (self.places[k] + self.places[k + 1]);
        let (here, there) = (middle(k), middle(beside));
        let part = if beside == k {
            0.0
        } else {
            (s - here) / (there - here)
        };
        (
            turn,
            self.couples[k] + (self.couples[beside] - self.couples[k]) * part,
        )
    }

    /// Places of a mesh on which sections turn by at most `turn` radians, and which are at most `longest` long.
    pub fn mesh(&self, turn: f64, longest: f64) -> Vec<f64> {
        let (mut places, mut passed) = (vec![0.0], 0.0);
        for k in 0..self.v.len() {
            passed += self.turning(k).norm();
            let last = places[places.len() - 1];
            let next = self.places.get(k + 2).copied().unwrap_or(f64::INFINITY);
            if passed > turn || next - last > longest {
                places.push(self.places[k + 1]);
                passed = 0.0;
            }
        }
        if places[places.len() - 1] < 1.0 {
            places.push(1.0);
        }
        places
    }

    fn interval(&self, s: f64) -> usize {
        let after = self.places.partition_point(|place| *place <= s);
        after.clamp(1, self.v.len()) - 1
    }

    /// Rotation vector from one end of an interval to the other, in the frame of the former.
    fn turning(&self, k: usize) -> Vector3<f64> {
        logarithm(&product(&conjugate(&self.turns[k]), &self.turns[k + 1]))
    }

    fn length(&self, k: usize) -> f64 {
        self.places[k + 1] - self.places[k]
    }

    fn moved(&self, step: &ChainStep) -> Self {
        let mut next = self.clone();
        for (k, part) in step.parts.iter().enumerate() {
            let phi = part.fixed_rows::<3>(0).into_owned();
            let turn = product(&exponential(&phi), &self.turns[k + 1]);
            next.turns[k + 1] = turn / turn.norm();
            next.v[k] += part.fixed_rows::<3>(3);
        }
        next
    }

    /// True if an interval turns by more than [`SHARP`] and the chain has room for more intervals.
    fn is_sharp(&self) -> bool {
        let n = self.v.len();
        n <= MOST && (0..n).any(|k| self.turning(k).norm() > SHARP)
    }

    /// The chain with intervals of large turn halved; `None` if no interval turns far.
    fn refined(&self) -> Option<Self> {
        let far: Vec<bool> = (0..self.v.len())
            .map(|k| self.turning(k).norm() > TURNED)
            .collect();
        if !far.contains(&true) || self.v.len() > MOST {
            return None;
        }
        let mut finer = Self {
            places: vec![0.0],
            turns: vec![self.turns[0]],
            v: Vec::new(),
            ..self.clone()
        };
        for (k, far) in far.into_iter().enumerate() {
            if far {
                let half = exponential(&(self.turning(k) * 0.5));
                finer
                    .places
                    .push(0.5 * (self.places[k] + self.places[k + 1]));
                finer.turns.push(product(&self.turns[k], &half));
                finer.v.push(self.v[k]);
            }
            finer.places.push(self.places[k + 1]);
            finer.turns.push(self.turns[k + 1]);
            finer.v.push(self.v[k]);
        }
        Some(finer)
    }
}

impl ChainFall<'_> {
    /// The unloaded rod, a little tilted.
    fn unloaded(&self) -> Result<Chain> {
        let mut places: Vec<f64> = (0..=FEWEST).map(|k| k as f64 / FEWEST as f64).collect();
        let breaks = self.law.pieces().iter().skip(1).map(|(from, _)| *from);
        places.extend(breaks);
        places.sort_by(f64::total_cmp);
        places.dedup_by(|later, earlier| *later - *earlier < 1e-6);
        let mut fine = vec![0.0];
        let (mut turns, mut v) = (vec![crate::math::se3::identity()], Vec::new());
        for pair in places.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let rest = self.law.inverse(middle, &Vector6::zeros())?.strain;
            let u = rest.fixed_rows::<3>(0).into_owned();
            let parts = (u.norm() * (pair[1] - pair[0]) / TURNED).ceil().max(1.0);
            let h = (pair[1] - pair[0]) / parts;
            for k in 1..=parts as usize {
                fine.push(pair[0] + h * k as f64);
                let turn = product(&turns[turns.len() - 1], &exponential(&(u * h)));
                turns.push(turn / turn.norm());
                v.push(rest.fixed_rows::<3>(3).into_owned());
            }
        }
        let last = fine.len() - 1;
        fine[last] = 1.0;
        let [along, across] = self.lean.way;
        for (turn, s) in turns.iter_mut().zip(&fine) {
            let tilt = match self.normal {
                Some(normal) => normal * (TILT * (along + across)),
                None => {
                    let first = Vector3::new(along, across, 0.0) * TILT;
                    Vector3::from(GENERIC) * self.lean.tilt + first
                }
            };
            *turn = product(&exponential(&(tilt * *s)), turn);
        }
        Ok(Chain {
            couples: vec![Vector3::zeros(); v.len()],
            base_force: Vector3::zeros(),
            places: fine,
            turns,
            v,
        })
    }

    /// The chain after its fall.
    fn rest(&self, mut chain: Chain) -> Option<Chain> {
        let mut shift = self.size;
        let mut left = STEPS;
        loop {
            let finer = chain.refined();
            let goal = if finer.is_some() { LOOSE } else { CONVERGED };
            self.descend(&mut chain, &mut shift, goal, &mut left)?;
            match chain.refined() {
                Some(finer) => chain = finer,
                None if goal == CONVERGED => break,
                None => {}
            }
        }
        let force = self.spring_force(&chain);
        chain.couples = (0..chain.v.len())
            .map(|k| {
                Some(
                    self.piece(&chain, k, &self.beyond(&chain, k, &force))?
                        .couple,
                )
            })
            .collect::<Option<_>>()?;
        let borne = self.weight.map_or_else(Vector3::zeros, ScaledLoad::total);
        chain.base_force = self.force + force + borne;
        Some(chain)
    }

    /// Steps downhill until the sections turn by less than `goal` in a step without a shift, or an interval turns
    /// sharply.
    fn descend(
        &self,
        chain: &mut Chain,
        shift: &mut f64,
        goal: f64,
        left: &mut usize,
    ) -> Option<()> {
        let least = self.lean.neutral * self.size;
        loop {
            let here = self.quadratic(chain)?;
            loop {
                *left = left.checked_sub(1)?;
                let step = here.step(*shift, HOLD * self.size, chain);
                let Some(step) = step.filter(|step| step.turn < LONGEST_STEP) else {
                    *shift = (2.0 * *shift).max(least);
                    continue;
                };
                if step.turn < goal && *shift <= least {
                    if step.turn < CONVERGED || goal > CONVERGED {
                        *chain = chain.moved(&step);
                    }
                    return Some(());
                }
                let next = chain.moved(&step);
                let fallen = self
                    .energy(&next)
                    .map_or(f64::NEG_INFINITY, |energy| here.energy - energy);
                // Near rest the fall of the energy is rounding.
                let rounding = 1e-13 * here.energy.abs().max(self.size);
                if fallen + rounding >= ENOUGH * step.fall {
                    *chain = next;
                    if fallen > 0.6 * step.fall || step.fall < rounding {
                        *shift = if *shift < least { 0.0 } else { *shift / 5.0 };
                    }
                    if chain.is_sharp() {
                        return Some(());
                    }
                    break;
                }
                *shift = (4.0 * *shift).max(least);
            }
        }
    }

    /// Dead load beyond the middle of interval `k`, with the force `spring` of a held end.
    fn beyond(&self, chain: &Chain, k: usize, spring: &Vector3<f64>) -> Vector3<f64> {
        let middle = 0.5 * (chain.places[k] + chain.places[k + 1]);
        let load = self.weight.map_or_else(Vector3::zeros, |weight| {
            weight.total() - weight.integral_to(middle)
        });
        self.force + spring + load
    }

    fn end(&self, chain: &Chain) -> Vector3<f64> {
        let ways = (0..chain.v.len()).map(|k| chain.way(k));
        ways.sum()
    }

    /// Force of the springs on the held end.
    fn spring_force(&self, chain: &Chain) -> Vector3<f64> {
        let end = self.end(chain);
        let stiffness = HOLD * self.size;
        let each = self.held.iter();
        each.map(|(axis, at)| axis * (stiffness * (at - axis.dot(&end))))
            .sum()
    }

    /// Turn of the end from the held orientation, and stiffness of the spring against the turn.
    fn turned_off(&self, chain: &Chain) -> Option<(Vector3<f64>, f64)> {
        let target = self.turned?;
        let end = frame(&chain.turns[chain.v.len()]);
        let off = rotation_vector(&(end * target.transpose()));
        Some((off, HOLD * self.size.sqrt()))
    }

    fn energy(&self, chain: &Chain) -> Option<f64> {
        let mut sum = 0.0;
        for k in 0..chain.v.len() {
            let strain = chain.strain(k);
            let middle = 0.5 * (chain.places[k] + chain.places[k + 1]);
            let stored = self.free(middle, &strain)?.energy;
            let load = self.beyond(chain, k, &Vector3::zeros());
            sum += chain.length(k) * stored - load.dot(&chain.way(k));
        }
        let end = self.end(chain);
        for (axis, at) in &self.held {
            sum += 0.5 * HOLD * self.size * (at - axis.dot(&end)).powi(2);
        }
        if let Some((off, stiffness)) = self.turned_off(chain) {
            sum += 0.5 * stiffness * off.norm_squared();
        }
        let lever = frame(&chain.turns[chain.v.len()]) * self.arm;
        sum -= self.force.dot(&lever);
        sum.is_finite().then_some(sum)
    }

    /// Energy, resultants and tangent of a section. Springs hold flexures and twist that the law holds rigid.
    fn free(&self, s: f64, strain: &Vector6<f64>) -> Option<Free> {
        let rigid = self.law.rigid();
        if rigid[..3] == [false; 3] {
            return self.law.free(s, strain).ok();
        }
        let rest = self.law.inverse(s, &Vector6::zeros()).ok()?.strain;
        let held = Vector6::from_fn(|k, _| {
            if k < 3 && rigid[k] {
                rest[k]
            } else {
                strain[k]
            }
        });
        let mut free = self.law.free(s, &held).ok()?;
        for k in (0..3).filter(|k| rigid[*k]) {
            let (give, spring) = (strain[k] - held[k], STIFF * self.size);
            free.energy += 0.5 * spring * give * give;
            free.resultants[k] = spring * give;
            free.tangent[(k, k)] = spring;
        }
        Some(free)
    }

    fn piece(&self, chain: &Chain, k: usize, load: &Vector3<f64>) -> Option<ChainInterval> {
        self.piece_of(
            chain.places[k],
            chain.places[k + 1],
            &chain.turns[k],
            &chain.turns[k + 1],
            &chain.v[k],
            load,
        )
    }

    fn piece_of(
        &self,
        from: f64,
        to: f64,
        a: &Turn,
        b: &Turn,
        v: &Vector3<f64>,
        load: &Vector3<f64>,
    ) -> Option<ChainInterval> {
        let h = to - from;
        let psi = logarithm(&product(&conjugate(a), b));
        let u = psi / h;
        let strain = Vector6::new(u.x, u.y, u.z, v.x, v.y, v.z);
        let free = self.free(0.5 * (from + to), &strain)?;
        let m = free.resultants.fixed_rows::<3>(0).into_owned();
        let n = free.resultants.fixed_rows::<3>(3).into_owned();
        let first = frame(a);
        let back = inverse_left_jacobian(&psi);
        let couple = first * back.tr_mul(&m);
        let middle = frame(&product(a, &exponential(&(psi * 0.5))));
        let share = first * (left_jacobian(&(psi * 0.5)) * back) * first.transpose() * 0.5;
        let way = middle * v * h;
        let q = way.cross(load);
        let shared = share.tr_mul(&q);
        let mut by_v = (n - middle.tr_mul(load)) * h;
        for (x, free) in by_v.iter_mut().zip(self.free) {
            if !free {
                *x = 0.0;
            }
        }
        Some(ChainInterval {
            way,
            gradient: [shared - q - couple, couple - shared, by_v],
            share,
            middle,
            couple: middle * m,
        })
    }

    /// The energy of the chain to second order.
    fn quadratic(&self, chain: &Chain) -> Option<Quadratic> {
        let n = chain.v.len();
        let spring = self.spring_force(chain);
        let mut found = Quadratic {
            energy: self.energy(chain)?,
            gradient: vec![IntervalPart::zeros(); n],
            diagonal: vec![IntervalBlock::zeros(); n],
            below: vec![IntervalBlock::zeros(); n],
            held: vec![SMatrix::zeros(); n],
        };
        for k in 0..n {
            let load = self.beyond(chain, k, &spring);
            let (piece, second) = self.second(chain, k, &load)?;
            let [a, b, v] = piece.gradient;
            let mut part = found.gradient[k].fixed_rows_mut::<3>(0);
            part += b;
            let mut part = found.gradient[k].fixed_rows_mut::<3>(3);
            part += v;
            found.diagonal[k] += second.fixed_view::<6, 6>(3, 3);
            if k > 0 {
                let mut part = found.gradient[k - 1].fixed_rows_mut::<3>(0);
                part += a;
                let mut part = found.diagonal[k - 1].fixed_view_mut::<3, 3>(0, 0);
                part += second.fixed_view::<3, 3>(0, 0);
                found.below[k]
                    .fixed_columns_mut::<3>(0)
                    .copy_from(&second.fixed_view::<6, 3>(3, 0));
            }
            for (i, free) in self.free.iter().enumerate() {
                if !free {
                    found.diagonal[k][(3 + i, 3 + i)] = 1.0;
                }
            }
            for (i, (axis, _)) in self.held.iter().enumerate() {
                let w = piece.way.cross(axis);
                let far = piece.share.tr_mul(&w);
                let mut column = found.held[k].fixed_view_mut::<3, 1>(0, i);
                column += far;
                let along = piece.middle.tr_mul(axis) * chain.length(k);
                for (j, free) in self.free.iter().enumerate() {
                    if *free {
                        found.held[k][(3 + j, i)] += along[j];
                    }
                }
                if k > 0 {
                    let mut column = found.held[k - 1].fixed_view_mut::<3, 1>(0, i);
                    column += w - far;
                }
            }
        }
        let last = n - 1;
        let mut put = |gradient: Vector3<f64>, second: Matrix3<f64>| {
            let mut part = found.gradient[last].fixed_rows_mut::<3>(0);
            part += gradient;
            let mut part = found.diagonal[last].fixed_view_mut::<3, 3>(0, 0);
            part += (second + second.transpose()) * 0.5;
        };
        if let Some((off, stiffness)) = self.turned_off(chain) {
            put(off * stiffness, inverse_left_jacobian(&off) * stiffness);
        }
        if self.arm != Vector3::zeros() {
            let lever = frame(&chain.turns[n]) * self.arm;
            let (f, l) = (self.force.cross_matrix(), lever.cross_matrix());
            put(-lever.cross(&self.force), -(f * l));
        }
        if let Some(normal) = &self.normal {
            found.keep_in_plane(normal);
        }
        Some(found)
    }

    /// An interval with its second derivatives by the turns of both ends and v, under a constant load.
    fn second(
        &self,
        chain: &Chain,
        k: usize,
        load: &Vector3<f64>,
    ) -> Option<(ChainInterval, SMatrix<f64, 9, 9>)> {
        let piece = self.piece(chain, k, load)?;
        let (from, to) = (chain.places[k], chain.places[k + 1]);
        let mut second = SMatrix::<f64, 9, 9>::zeros();
        for column in 0..9 {
            if column >= 6 && !self.free[column - 6] {
                continue;
            }
            let unit = Vector3::ith(column % 3, DIFFERENCE);
            let (mut a, mut b, mut v) = (chain.turns[k], chain.turns[k + 1], chain.v[k]);
            match column / 3 {
                0 => a = product(&exponential(&unit), &a),
                1 => b = product(&exponential(&unit), &b),
                _ => v += unit,
            }
            let beside = self.piece_of(from, to, &a, &b, &v, load)?;
            for row in 0..3 {
                let change = (beside.gradient[row] - piece.gradient[row]) / DIFFERENCE;
                second
                    .fixed_view_mut::<3, 1>(3 * row, column)
                    .copy_from(&change);
            }
        }
        Some((piece, (second + second.transpose()) * 0.5))
    }
}

impl Chain {
    fn strain(&self, k: usize) -> Vector6<f64> {
        let (u, v) = (self.turning(k) / self.length(k), &self.v[k]);
        Vector6::new(u.x, u.y, u.z, v.x, v.y, v.z)
    }

    /// Way of the centreline along an interval.
    fn way(&self, k: usize) -> Vector3<f64> {
        let half = exponential(&(self.turning(k) * 0.5));
        frame(&product(&self.turns[k], &half)) * self.v[k] * self.length(k)
    }
}

impl Quadratic {
    /// Leaves out turns about axes in the plane, and shear along its normal.
    fn keep_in_plane(&mut self, normal: &Vector3<f64>) {
        let along = normal * normal.transpose();
        let mut kept = IntervalBlock::zeros();
        kept.fixed_view_mut::<3, 3>(0, 0).copy_from(&along);
        kept.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(Matrix3::identity() - along));
        let rest = IntervalBlock::identity() - kept;
        for gradient in &mut self.gradient {
            *gradient = kept * *gradient;
        }
        for block in &mut self.diagonal {
            *block = kept * *block * kept + rest;
        }
        for block in &mut self.below {
            *block = kept * *block * kept;
        }
        for held in &mut self.held {
            *held = kept * *held;
        }
    }

    /// Newton's step with `shift` times the length of each interval added to the Hessian, the springs of held
    /// coordinates having the given stiffness. `None` if the shifted Hessian is not positive definite.
    fn step(&self, shift: f64, stiffness: f64, chain: &Chain) -> Option<ChainStep> {
        let n = self.gradient.len();
        let mut negative = 0;
        let mut inverses: Vec<IntervalBlock> = Vec::with_capacity(n);
        let mut sides: Vec<Sides> = Vec::with_capacity(n);
        for k in 0..n {
            let mut pivot = self.diagonal[k];
            for i in 0..6 {
                pivot[(i, i)] += shift * chain.length(k);
            }
            let mut side = Sides::zeros();
            side.fixed_columns_mut::<1>(0).copy_from(&-self.gradient[k]);
            side.fixed_columns_mut::<3>(1).copy_from(&self.held[k]);
            if k > 0 {
                let factor = self.below[k] * inverses[k - 1];
                pivot -= factor * self.below[k].transpose();
                side -= factor * sides[k - 1];
            }
            let inverse = match pivot.cholesky() {
                Some(factors) => factors.inverse(),
                None => {
                    let eigen = pivot.symmetric_eigen();
                    negative += eigen.eigenvalues.iter().filter(|x| **x < 0.0).count();
                    pivot.try_inverse()?
                }
            };
            inverses.push(inverse);
            sides.push(side);
        }
        // Back substitution for all sides.
        let mut found = vec![Sides::zeros(); n];
        for k in (0..n).rev() {
            let mut side = sides[k];
            if k + 1 < n {
                side -= self.below[k + 1].transpose() * found[k + 1];
            }
            found[k] = inverses[k] * side;
        }
        // Springs of the held coordinates, by the formula of Woodbury; columns without a held coordinate are zero.
        let mut compliance = Matrix3::identity() / stiffness;
        let mut moved = Vector3::zeros();
        for (found, held) in found.iter().zip(&self.held) {
            compliance += held.transpose() * found.fixed_columns::<3>(1);
            moved += held.transpose() * found.column(0);
        }
        let values = ((compliance + compliance.transpose()) * 0.5).symmetric_eigenvalues();
        // Haynsworth: the inertia of the bordered matrix in two ways.
        let taken = values.iter().filter(|x| **x < 0.0).count();
        if negative != taken {
            return None;
        }
        let pull = compliance.try_inverse()? * moved;
        let parts: Vec<IntervalPart> = found
            .iter()
            .map(|found| found.column(0) - found.fixed_columns::<3>(1) * pull)
            .collect();
        let (mut slope, mut size, mut turn) = (0.0, 0.0, 0.0_f64);
        for (k, part) in parts.iter().enumerate() {
            slope += self.gradient[k].dot(part);
            size += chain.length(k) * part.norm_squared();
            turn = turn.max(part.fixed_rows::<3>(0).norm());
        }
        turn.is_finite().then_some(ChainStep {
            parts,
            turn,
            fall: 0.5 * (shift * size - slope),
        })
    }
}

/// Rotation vector of a unit quaternion, of length at most pi.
fn logarithm(turn: &Turn) -> Vector3<f64> {
    let sign = if turn[0] < 0.0 { -1.0 } else { 1.0 };
    let x = SVector::<f64, 3>::new(turn[1], turn[2], turn[3]) * sign;
    let (sine, cosine) = (x.norm(), turn[0] * sign);
    if sine < 1e-6 {
        x * (2.0 / cosine)
    } else {
        x * (2.0 * sine.atan2(cosine) / sine)
    }
}
