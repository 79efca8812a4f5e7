//! Differential equations of rods with mass, for explicit and implicit steps.
//!
//! State: the bodies; quaternion and spin of each free base; strains q, their rates w, the dashpots of Maxwell
//! branches; time, energy lost to friction, work, loss to drag. Then come accelerations z', q'' and multipliers l,
//! which implicit steps keep as unknowns:
//! ```text
//! places' = z,   z' = z',   q' = w,   w' = q'',   0 = G(places, z, q, w, z', q'', l, t).
//! ```
//! Passes along the rods evaluate the balance G. Newton's iteration alone needs the mass matrix G_a:
//! sigma^2 G_a + sigma G_w + G_q. The stiff parts (rates k^2/sqrt(eps), friction k^4/eps at mode k) are of the size of
//! the stiffness of the rods.

use super::block_elimination::{BlockVector, Factored, LevelCombination, Shared};
use super::{HeavyAssembly, HeavyBalance, HeavyState};
use crate::assembly::Body;
use crate::full_mass::maxwell_nodes::Memory;
use crate::math::se3::{spin, unit};
use crate::solve::system::{Factor, Linearised, Scalar, System};
use nalgebra::{DVector, Matrix4x3, Vector3, Vector4};
use std::ops::Range;
use std::sync::Arc;

/// Number of integrals over time in a state: time itself, energy dissipated, work, loss to drag.
pub const INTEGRALS: usize = 4;

/// Map between the numbers of a state and displacements and velocities.
#[derive(Debug, Clone)]
pub(super) struct StateMap {
    /// Quaternions: index in the state, index of the rotation vector, derivative of the quaternion by the latter.
    pub turns: Vec<(usize, usize, Matrix4x3<f64>)>,
    /// Positions and groove parameters: index in the state, and range of displacements.
    pub shifts: Vec<(usize, Range<usize>)>,
    /// Velocities: index in the state, and range among all velocities.
    pub velocities: Vec<(usize, Range<usize>)>,
    pub strains: Vec<Range<usize>>,
    pub rates: Vec<Range<usize>>,
    pub dashpots: Vec<Range<usize>>,
    time: usize,
    free: usize,
    unknowns: usize,
}

/// Rates of change of a quaternion by spins in the world.
fn by_spin(p: &Vector4<f64>) -> Matrix4x3<f64> {
    let back = unit(p).inverse();
    let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| spin(p, &(back * axis)));
    Matrix4x3::from_columns(&columns)
}

impl HeavyAssembly {
    pub(super) fn places(&self, y: &DVector<f64>) -> StateMap {
        let layout = &self.layout;
        let mut places = StateMap {
            turns: Vec::new(),
            shifts: Vec::new(),
            velocities: Vec::new(),
            strains: layout.strains.clone(),
            rates: layout.rates.clone(),
            dashpots: layout.dashpots.clone(),
            time: layout.time,
            free: layout.free,
            unknowns: layout.unknowns,
        };
        let quaternion = |at: usize| by_spin(&y.fixed_rows::<4>(at).into_owned());
        let bodies = self.carriers.iter().zip(&layout.bodies);
        for ((carrier, range), z) in bodies.zip(&layout.velocities) {
            let [turn, position, spinning, velocity] =
                carrier.slots().map(|slots| slots.start + range.start);
            let turnings = Body::turnings(carrier);
            let after = z + turnings..z + carrier.freedoms();
            if carrier.turns() {
                places.turns.push((turn, *z, quaternion(turn)));
                places.velocities.push((spinning, *z..z + turnings));
            }
            places.shifts.push((position, after.clone()));
            places.velocities.push((velocity, after));
        }
        for (range, z) in layout.turns.iter().zip(&layout.turning) {
            if let Some(z) = z {
                places
                    .turns
                    .push((range.start, *z, quaternion(range.start)));
                places.velocities.push((range.start + 4, *z..z + 3));
            }
        }
        let joints = layout.joints.iter().zip(&layout.sliding);
        for (range, z) in joints.flat_map(|(ranges, first)| ranges.iter().zip(first)) {
            if let Some(z) = z {
                let axes = range.len() / 2;
                places.shifts.push((range.start, *z..z + axes));
                places.velocities.push((range.start + axes, *z..z + axes));
            }
        }
        places
    }

    /// Accelerations and multipliers that balance a state, with the matrix of the solution and its factors.
    pub(super) fn solved(&self, at: &HeavyState) -> Option<(DVector<f64>, Shared, Factored<f64>)> {
        let none = vec![0.0; self.layout.unknowns];
        let rest = self.balance(at, &none)?.residual;
        let blocks = Arc::new(self.mass_blocks(at)?);
        let factored = blocks.mass()?;
        let mut found = self.sides(&-rest);
        if !factored.solve(&mut found) {
            return None;
        }
        Some((self.unsplit(&found), blocks, factored))
    }

    /// Accelerations and multipliers that balance a state; None if the ends constrain each other in more ways than
    /// the rods have freedoms.
    pub fn accelerations(&self, at: &HeavyState) -> Option<DVector<f64>> {
        if !self.is_open() {
            return Some(self.solved(at)?.0);
        }
        // Rods with free ends on the ground do not feel each other.
        let mut found = self.balance(at, &vec![0.0; self.layout.unknowns])?.residual;
        for ((link, rod), range) in self.links.iter().zip(&at.rods).zip(&self.layout.second) {
            let (mass, _) = link.rod.mass_matrix(at.t, rod)?;
            let mut own = found.rows_mut(range.start, range.len());
            if let Some(factors) = mass.clone().cholesky() {
                factors.solve_mut(&mut own);
            } else if !mass.lu().solve_mut(&mut own) {
                // At many nodes the smallest masses are rounding: they need not be positive.
                return None;
            }
            own.neg_mut();
        }
        Some(found)
    }

    /// Splits a vector of accelerations and multipliers, or of residuals, by rod, and by bodies with the multipliers.
    pub(super) fn sides(&self, unknowns: &DVector<f64>) -> BlockVector<f64> {
        let layout = &self.layout;
        let held = layout.wrenches.iter().flat_map(Range::clone);
        let free: Vec<f64> = (0..layout.free).chain(held).map(|i| unknowns[i]).collect();
        let rods = layout.second.iter();
        BlockVector {
            rods: rods
                .map(|range| unknowns.rows(range.start, range.len()).into_owned())
                .collect(),
            free: DVector::from_vec(free),
        }
    }

    /// Inverse of `sides`: one vector, first bodies and bases, then the rods, then the multipliers.
    pub(super) fn unsplit(&self, sides: &BlockVector<f64>) -> DVector<f64> {
        let layout = &self.layout;
        let free = sides.free.rows(0, layout.free);
        let rods = sides.rods.iter().flat_map(|rod| rod.iter());
        let held = sides.free.iter().skip(layout.free);
        let all = free.iter().chain(rods).chain(held).copied();
        DVector::from_iterator(layout.unknowns, all)
    }

    /// Writes the rates of all components of a state, and the balance at the indices of accelerations and
    /// multipliers.
    fn write(
        &self,
        y: &DVector<f64>,
        at: &HeavyState,
        unknowns: &[f64],
        out: &mut DVector<f64>,
    ) -> Option<()> {
        let HeavyBalance {
            residual, powers, ..
        } = HeavyAssembly::balance(self, at, unknowns)?;
        let places = self.places(y);
        let mut z = vec![0.0; places.free];
        for (slot, range) in &places.velocities {
            for (i, z_at) in range.clone().enumerate() {
                z[z_at] = y[slot + i];
                out[slot + i] = unknowns[z_at];
            }
        }
        for (slot, range) in &places.shifts {
            for (i, z_at) in range.clone().enumerate() {
                out[slot + i] = z[z_at];
            }
        }
        for (slot, at, by) in &places.turns {
            let rate = by * Vector3::new(z[*at], z[at + 1], z[at + 2]);
            out.fixed_rows_mut::<4>(*slot).copy_from(&rate);
        }
        let rods = self.layout.second.iter();
        for (second, (q, w)) in rods.zip(places.strains.iter().zip(&places.rates)) {
            let slots = out.as_mut_slice();
            slots[q.clone()].copy_from_slice(&y.as_slice()[w.clone()]);
            slots[w.clone()].copy_from_slice(&unknowns[second.clone()]);
        }
        let rods = self.links.iter().zip(&places.strains);
        for ((link, q), z) in rods.zip(&places.dashpots) {
            let (q, rates) = (&y.as_slice()[q.clone()], &mut out.as_mut_slice()[z.clone()]);
            link.rod.memory.rates(q, &y.as_slice()[z.clone()], rates);
        }
        let (time, slots) = (places.time, out.as_mut_slice());
        slots[time] = 1.0;
        slots[time + 1..time + INTEGRALS].copy_from_slice(&powers);
        slots[time + INTEGRALS..].copy_from_slice(residual.as_slice());
        slots.iter().all(|x| x.is_finite()).then_some(())
    }
}

impl System for HeavyAssembly {
    type Linearised = HeavyAssemblyLinear;

    fn slope(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let at = self.at(y)?;
        let unknowns = self.accelerations(&at)?;
        self.write(y, &at, unknowns.as_slice(), out)?;
        out.rows_mut(self.time() + INTEGRALS, self.unknowns())
            .fill(0.0);
        Some(())
    }

    fn algebraic(&self) -> usize {
        self.unknowns()
    }

    fn balance(&self, y: &DVector<f64>, out: &mut DVector<f64>) -> Option<()> {
        let at = self.at(y)?;
        self.write(y, &at, self.second(y), out)
    }

    fn settle(&self, y: &mut DVector<f64>) -> Option<()> {
        let unknowns = self.accelerations(&self.at(y)?)?;
        y.rows_mut(self.time() + INTEGRALS, self.unknowns())
            .copy_from(&unknowns);
        Some(())
    }

    fn linearised(&self, y: &DVector<f64>) -> Option<HeavyAssemblyLinear> {
        let at = self.at(y)?;
        let (unknowns, _, mass) = self.solved(&at)?;
        let balance = HeavyAssembly::balance(self, &at, unknowns.as_slice())?;
        let blocks = Arc::new(self.blocks(&at, &balance, unknowns.as_slice())?);
        Some(HeavyAssemblyLinear {
            blocks,
            mass,
            places: self.places(y),
            memory: self
                .links
                .iter()
                .map(|link| link.rod.memory.clone())
                .collect(),
        })
    }

    /// Error norm: strains and rates of each rod in the mean over it, relative to 1 + their size; places and
    /// velocities of bodies likewise, in the mean over them; energies.
    fn mean_square(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let part = |i: usize| (error[i] / (1.0 + from[i].abs().max(to[i].abs()))).powi(2);
        let layout = &self.layout;
        let bodies = self.places_slots();
        let mut sum = bodies.clone().map(part).sum::<f64>() / bodies.len().max(1) as f64;
        for (k, link) in self.links.iter().enumerate() {
            let count = link.rod.given.law.active().len();
            let [q, w] = [&layout.strains[k], &layout.rates[k]].map(|range| range.start);
            for (node, weight) in link.rod.sections.grid.weights().iter().enumerate() {
                for i in node * count..(node + 1) * count {
                    sum += weight * (part(q + i) + part(w + i)) / count as f64;
                }
            }
            let first = layout.dashpots[k].start;
            sum += link.rod.memory.mean_square(|i| part(first + i));
        }
        sum += (layout.time + 1..layout.time + INTEGRALS)
            .map(part)
            .sum::<f64>();
        sum / 3.0
    }
}

/// Jacobian of rods with mass.
#[derive(Debug)]
pub struct HeavyAssemblyLinear {
    blocks: Shared,
    mass: Factored<f64>,
    places: StateMap,
    memory: Arc<[Memory]>,
}

/// Factors of sigma^2 G_a + sigma G_w + G_q with the multipliers.
#[derive(Debug)]
pub struct HeavyAssemblyFactor<T: Scalar> {
    blocks: Shared,
    places: StateMap,
    memory: Arc<[Memory]>,
    sigma: T,
    factored: Factored<T>,
}

impl StateMap {
    /// Displacements of a state-like vector.
    fn displacements<T: Scalar>(&self, b: &DVector<T>) -> BlockVector<T> {
        let mut x = self.none(&self.strains, b);
        for (slot, range) in &self.shifts {
            for (i, z) in range.clone().enumerate() {
                x.free[z] = b[slot + i];
            }
        }
        // Spins from rates of the quaternion: the columns are at right angles, of length 1/2.
        for (slot, z, by) in &self.turns {
            for (k, column) in by.column_iter().enumerate() {
                let along = (0..4).map(|i| b[slot + i] * T::from_real(4.0 * column[i]));
                x.free[z + k] = along.fold(T::zero(), |sum, x| sum + x);
            }
        }
        x
    }

    /// Velocities of a state-like vector.
    fn velocities<T: Scalar>(&self, b: &DVector<T>) -> BlockVector<T> {
        let mut x = self.none(&self.rates, b);
        for (slot, range) in &self.velocities {
            for (i, z) in range.clone().enumerate() {
                x.free[z] = b[slot + i];
            }
        }
        x
    }

    /// Parts of the rods, with zeros for bodies and multipliers.
    fn none<T: Scalar>(&self, rods: &[Range<usize>], b: &DVector<T>) -> BlockVector<T> {
        let own = rods
            .iter()
            .map(|range| b.rows(range.start, range.len()).into_owned());
        let inner: usize = rods.iter().map(Range::len).sum();
        BlockVector {
            rods: own.collect(),
            free: DVector::zeros(self.unknowns - inner),
        }
    }

    /// Indices of the first acceleration of the bodies, of the rods, and of the first multiplier.
    fn algebraic(&self) -> [usize; 3] {
        let first = self.time + INTEGRALS;
        let inner: usize = self.rates.iter().map(Range::len).sum();
        [first, first + self.free, first + self.free + inner]
    }

    /// Right-hand sides at the indices of accelerations and multipliers.
    fn right<T: Scalar>(&self, b: &DVector<T>) -> BlockVector<T> {
        let [first, mut inner, held] = self.algebraic();
        let ranges: Vec<Range<usize>> = self
            .rates
            .iter()
            .map(|range| {
                inner += range.len();
                inner - range.len()..inner
            })
            .collect();
        let mut x = self.none(&ranges, b);
        let ties = x.free.len() - self.free;
        x.free
            .rows_mut(0, self.free)
            .copy_from(&b.rows(first, self.free));
        x.free
            .rows_mut(self.free, ties)
            .copy_from(&b.rows(held, ties));
        x
    }
}

impl Linearised for HeavyAssemblyLinear {
    type Factor<T: Scalar> = HeavyAssemblyFactor<T>;

    fn shifted<T: Scalar>(&self, sigma: T) -> Option<HeavyAssemblyFactor<T>> {
        let levels = [(T::one(), 0), (sigma, 1), (sigma * sigma, 2)];
        let factored = self.blocks.factored(&LevelCombination {
            balance: &levels,
            ends: &levels,
            memory: Some((sigma, &self.memory)),
        })?;
        Some(HeavyAssemblyFactor {
            blocks: self.blocks.clone(),
            places: self.places.clone(),
            memory: self.memory.clone(),
            sigma,
            factored,
        })
    }

    /// Product for places and velocities alone; accelerations are dependent.
    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let places = &self.places;
        let (moved, faster) = (places.displacements(x), places.velocities(x));
        let [mut push, more] = [(0, &moved), (1, &faster)].map(|(j, x)| self.blocks.times(j, x));
        let mut out = DVector::zeros(x.len());
        push.free = -(push.free + more.free);
        for (k, (push, more)) in push.rods.iter_mut().zip(more.rods).enumerate() {
            *push += more;
            let (q, z) = (moved.rods[k].as_slice(), places.dashpots[k].clone());
            let dashpots = &x.as_slice()[z.clone()];
            self.memory[k].push(q, dashpots, push.as_mut_slice());
            self.memory[k].rates(q, dashpots, &mut out.as_mut_slice()[z]);
            *push = -&*push;
        }
        if !self.mass.solve(&mut push) {
            out.fill(f64::INFINITY);
            return out;
        }
        places.write(&mut out, &faster, &push);
        out
    }
}

impl StateMap {
    /// Writes displacements and velocities.
    fn write<T: Scalar>(
        &self,
        out: &mut DVector<T>,
        moved: &BlockVector<T>,
        faster: &BlockVector<T>,
    ) {
        for (slot, range) in &self.shifts {
            for (i, z) in range.clone().enumerate() {
                out[slot + i] = moved.free[z];
            }
        }
        for (slot, range) in &self.velocities {
            for (i, z) in range.clone().enumerate() {
                out[slot + i] = faster.free[z];
            }
        }
        for (slot, z, by) in &self.turns {
            for i in 0..4 {
                let each = (0..3).map(|k| moved.free[z + k] * T::from_real(by[(i, k)]));
                out[slot + i] = each.fold(T::zero(), |sum, x| sum + x);
            }
        }
        let rods = moved.rods.iter().zip(&faster.rods);
        for ((q, w), (moved, faster)) in self.strains.iter().zip(&self.rates).zip(rods) {
            out.rows_mut(q.start, q.len()).copy_from(moved);
            out.rows_mut(w.start, w.len()).copy_from(faster);
        }
    }
}

impl<T: Scalar> Factor<T> for HeavyAssemblyFactor<T> {
    /// Let x be the displacements, and b_a the right of the balance. Eliminating dx = (dv + b_x)/sigma and
    /// da = sigma dv - b_v leaves: (sigma^2 G_a + sigma G_v + G_x) dv/sigma + G_l dl = -b_a - G_x b_x/sigma + G_a
    /// b_v. Maxwell branches add to this (`memory`).
    ///
    /// A solution for dx would lose digits of dv: the smallest eigenvalues of G_a are near rounding, and b_x dominates.
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let (places, sigma) = (&self.places, self.sigma);
        let over = T::one() / sigma;
        let (mut moved, faster) = (places.displacements(b), places.velocities(b));
        let mut found = places.right(b);
        let [by_place, by_second] =
            [(0, &moved), (2, &faster)].map(|(j, x)| self.blocks.times(j, x));
        let right = |b: &mut DVector<T>, place: &DVector<T>, second: &DVector<T>| {
            for ((b, place), second) in b.iter_mut().zip(place.iter()).zip(second.iter()) {
                *b = *second - *b - *place * over;
            }
        };
        right(&mut found.free, &by_place.free, &by_second.free);
        let rods = by_place.rods.iter().zip(&by_second.rods);
        for (b, (place, second)) in found.rods.iter_mut().zip(rods) {
            right(b, place, second);
        }
        let rods = found.rods.iter_mut().zip(&moved.rods).zip(&self.memory[..]);
        for (((out, q), memory), z) in rods.zip(&places.dashpots) {
            let z = &b.as_slice()[z.clone()];
            memory.eliminate(sigma, q.as_slice(), z, out.as_mut_slice());
        }
        if !self.factored.solve(&mut found) {
            return false;
        }
        // Part of a quaternion's change along itself.
        let mut grown = Vec::with_capacity(places.turns.len());
        for (slot, z, by) in &places.turns {
            let part: Vec<T> = (0..4)
                .map(|i| {
                    let each = (0..3).map(|k| moved.free[z + k] * T::from_real(by[(i, k)]));
                    b[slot + i] - each.fold(T::zero(), |sum, x| sum + x)
                })
                .collect();
            grown.push(part);
        }
        let [first, inner, held] = places.algebraic();
        let mut at = inner;
        let mut next = found.clone();
        for ((next, moved), (found, faster)) in next
            .rods
            .iter_mut()
            .zip(&mut moved.rods)
            .zip(found.rods.iter().zip(&faster.rods))
        {
            for i in 0..found.len() {
                next[i] = found[i] * sigma;
                moved[i] = (next[i] + moved[i]) * over;
                b[at + i] = next[i] * sigma - faster[i];
            }
            at += found.len();
        }
        for i in 0..places.free {
            next.free[i] = found.free[i] * sigma;
            moved.free[i] = (next.free[i] + moved.free[i]) * over;
            b[first + i] = next.free[i] * sigma - faster.free[i];
        }
        for (i, x) in found.free.iter().skip(places.free).enumerate() {
            b[held + i] = *x;
        }
        places.write(b, &moved, &next);
        let rods = self.memory.iter().zip(&places.dashpots);
        for ((memory, z), q) in rods.zip(&moved.rods) {
            memory.follow(sigma, q, &mut b.as_mut_slice()[z.clone()]);
        }
        for ((slot, ..), part) in places.turns.iter().zip(grown) {
            for (i, x) in part.into_iter().enumerate() {
                b[slot + i] += x * over;
            }
        }
        for i in places.time..places.time + INTEGRALS {
            b[i] /= sigma;
        }
        b.iter().all(|x| x.is_finite())
    }
}
