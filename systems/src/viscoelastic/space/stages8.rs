//! Shapes of up to eight states of a rod at once, such as the stages of an implicit step: wide registers, one state
//! per lane.
//!
//! The equations and their order are those of [`super::rotations`], with one number of corrections for all states.
//! Functions that are always inlined are compiled for these registers; closures are not, and loops count by hand.
#![allow(clippy::needless_range_loop)]

mod algebra;

use super::super::grid::{Element, Grid};
use crate::math::lanes8::Eight;
use crate::math::real::Real;
use crate::math::registers::Registers;
use algebra::{
    Quaternion8, Vector, added, cross, directors, dot, exponential, over, product, scaled, spin,
    square,
};
use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};
use std::any::Any;

/// Number of states evaluated at once.
pub(super) const LANES: usize = 8;
/// Corrections after which the iteration is left to [`super::rotations`]: nodes that resolve the rotations take two or
/// three.
const CORRECTIONS: usize = 8;
/// Defect of the rotations beyond which [`super::rotations`] takes over.
const COARSE: f64 = 1e-2;

/// Pose of the end, and dissipation.
#[derive(Clone, Copy, Default)]
pub(super) struct EndPose {
    /// Rotation (w, x, y, z).
    pub turn: [f64; 4],
    /// Position.
    pub place: [f64; 3],
    /// Dissipation per time, with a law.
    pub dissipated: f64,
}

/// A law of m strains, matrices by columns: rates = fluidity (resultants - stiffness (strains - rest)).
#[derive(Clone, Copy)]
pub(super) struct Flowing<'a> {
    pub stiffness: &'a [f64],
    pub rest: &'a [f64],
    pub fluidity: &'a [f64],
}

/// Local resultants at the nodes under end wrenches, or strain rates with a law, and poses of the ends. Not generic
/// in strains and end, which would compile one copy for each.
pub(super) struct Loading<'a, 'b> {
    pub grid: &'a Grid,
    /// Indices among u1 .. v3 of the strains that can change.
    pub places: &'a [usize],
    /// States, which begin with the strains node by node.
    pub states: &'a [&'a [f64]; LANES],
    /// End wrench (m1, n1) of each state.
    pub wrenches: &'a [[f64; 6]; LANES],
    /// Law for strain rates in `out`; without a law `out` receives resultants.
    pub law: Option<Flowing<'a>>,
    /// Outputs, written at the head of each, node by node; there may be fewer than lanes.
    pub out: &'a mut [&'b mut [f64]],
    pub ends: &'a mut [EndPose; LANES],
    pub lanes: &'a mut Lanes,
}

/// Workspace in the registers of this processor, kept between calls.
#[derive(Debug, Default)]
pub(super) struct Lanes(Option<Box<dyn Any + Send>>);

impl Lanes {
    /// A workspace of `size` numbers, with arbitrary contents.
    #[inline(always)]
    fn room<S: Simd>(&mut self, zero: Eight<S>, size: usize) -> Option<&mut [Eight<S>]> {
        let kept = self
            .0
            .get_or_insert_with(|| Box::new(Vec::<Eight<S>>::new()));
        let kept = kept.downcast_mut::<Vec<Eight<S>>>()?;
        if kept.len() < size {
            kept.resize(size, zero);
        }
        Some(&mut kept[..size])
    }
}

impl Loading<'_, '_> {
    /// Evaluates all lanes. False if the nodes do not resolve a shape, it is not finite, or the processor lacks such
    /// registers; the outputs are then unusable.
    pub(super) fn evaluate(self) -> bool {
        Registers::in_use().is_some_and(|registers| registers.work(self))
    }
}

impl WithSimd for Loading<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let (grid, n, m) = (self.grid, self.grid.len(), self.places.len());
        let zero = Eight::all(simd, 0.0);
        let states = self.states;
        let stretched = if m > 3 { n } else { 0 };
        let size = n * (21 + 8 * CORRECTIONS) + 3 * stretched;
        let Some(room) = self.lanes.room(zero, size) else {
            return false;
        };
        let mut room = FieldPool(room);
        let (u, v) = (room.take::<3>(n), room.take::<3>(stretched));
        for v in &mut *v {
            *v = [zero, zero, zero.with(1.0)];
        }
        for i in 0..n {
            for (k, place) in self.places.iter().enumerate() {
                let at = i * m + k;
                let strain = Eight::of(
                    simd,
                    [
                        states[0][at],
                        states[1][at],
                        states[2][at],
                        states[3][at],
                        states[4][at],
                        states[5][at],
                        states[6][at],
                        states[7][at],
                    ],
                );
                match *place {
                    0..3 => u[i][*place] = strain,
                    _ => v[i][*place - 3] = strain,
                }
            }
        }
        let (p, positions) = (room.take::<4>(n), room.take::<3>(n));
        let mut start = [zero.with(1.0), zero, zero, zero];
        let mut scratch = ElementFields {
            angles: room.take(n),
            residual: room.take(n),
            field: room.take(n),
            tried: room.take(2 * n * CORRECTIONS),
        };
        for element in grid.elements() {
            let nodes = element.nodes();
            let (u, p) = (&u[nodes.clone()], &mut p[nodes]);
            match turn(grid, element, start, u, p, &mut scratch) {
                Some(end) => start = end,
                None => return false,
            }
        }
        let mut end = [zero; 3];
        for element in grid.elements() {
            let nodes = element.nodes();
            let tangents = &mut scratch.angles[..nodes.len()];
            for (t, i) in tangents.iter_mut().zip(nodes.clone()) {
                let [d1, d2, d3] = directors(&p[i]);
                *t = d3;
                if m > 3 {
                    let shear = added(&scaled(&d1, v[i][0]), &scaled(&d2, v[i][1]));
                    *t = added(&shear, &scaled(&d3, v[i][2]));
                }
            }
            let out = &mut positions[nodes.clone()];
            integrate(element.integrate(), tangents, out);
            for r in out.iter_mut() {
                *r = added(r, &end);
            }
            for (t, weight) in tangents.iter().zip(&grid.weights()[nodes]) {
                end = added(&scaled(t, zero.with(*weight)), &end);
            }
        }
        let mut wrench = [zero; 6];
        for (k, wrench) in wrench.iter_mut().enumerate() {
            let mut at = [0.0; LANES];
            for lane in 0..LANES {
                at[lane] = self.wrenches[lane][k];
            }
            *wrench = Eight::of(simd, at);
        }
        let [m1, m2, m3, n1, n2, n3] = wrench;
        let (couple, force) = ([m1, m2, m3], [n1, n2, n3]);
        let mut dissipated = zero;
        for i in 0..n {
            let r = &positions[i];
            let arm = [end[0] - r[0], end[1] - r[1], end[2] - r[2]];
            let moment = added(&cross(&arm, &force), &couple);
            let directors = directors(&p[i]);
            let mut local = [zero; 6];
            for (local, place) in local.iter_mut().zip(self.places) {
                *local = match *place {
                    0..3 => dot(&directors[*place], &moment),
                    _ => dot(&directors[*place - 3], &force),
                };
            }
            if let Some(law) = self.law {
                // Sums stay in registers although the number m of terms is unknown to the compiler.
                let (mut short, mut overstress) = ([zero; 6], [zero; 6]);
                for (k, place) in self.places.iter().enumerate() {
                    let strain = match *place {
                        0..3 => u[i][*place],
                        _ => v[i][*place - 3],
                    };
                    short[k] = zero.with(law.rest[k]) - strain;
                }
                for l in 0..m {
                    overstress[l] = mixed(&law.stiffness[l..], m, &short, local[l]);
                }
                for l in 0..m {
                    local[l] = mixed(&law.fluidity[l..], m, &overstress, zero);
                }
                let mut density = zero;
                for k in 0..m {
                    density = overstress[k].times_plus(local[k], density);
                }
                let weight = zero.with(grid.weights()[i]);
                dissipated = density.times_plus(weight, dissipated);
            }
            for k in 0..m {
                let numbers = local[k].numbers();
                for lane in 0..self.out.len() {
                    self.out[lane][i * m + k] = numbers[lane];
                }
            }
        }
        let turns = start.map(Eight::numbers);
        let places = end.map(Eight::numbers);
        let dissipated = dissipated.numbers();
        for lane in 0..self.out.len() {
            let end = EndPose {
                turn: turns.map(|x| x[lane]),
                place: places.map(|x| x[lane]),
                dissipated: dissipated[lane],
            };
            if !(end.turn.iter().sum::<f64>() + end.place.iter().sum::<f64>()).is_finite() {
                return false;
            }
            self.ends[lane] = end;
        }
        true
    }
}

/// Workspace from which fields are allocated.
struct FieldPool<'a, S: Simd>(&'a mut [Eight<S>]);

impl<'a, S: Simd> FieldPool<'a, S> {
    /// A field with K numbers at n points.
    #[inline(always)]
    fn take<const K: usize>(&mut self, n: usize) -> &'a mut [[Eight<S>; K]] {
        let (field, rest) = std::mem::take(&mut self.0).split_at_mut(n * K);
        self.0 = rest;
        field.as_chunks_mut().0
    }
}

/// Intermediate fields of an element.
struct ElementFields<'a, S: Simd> {
    angles: &'a mut [Vector<S>],
    residual: &'a mut [Quaternion8<S>],
    field: &'a mut [Quaternion8<S>],
    /// Corrections and their effects on the residual, alternating.
    tried: &'a mut [Quaternion8<S>],
}

/// Unit quaternions at the nodes of an element, from `start` at its beginning, into `p`. Returns the one at its end.
/// None if the nodes do not resolve the rotation.
#[inline(always)]
fn turn<S: Simd>(
    grid: &Grid,
    element: &Element,
    start: Quaternion8<S>,
    u: &[Vector<S>],
    p: &mut [Quaternion8<S>],
    scratch: &mut ElementFields<'_, S>,
) -> Option<Quaternion8<S>> {
    guess(grid, element, start, u, p, scratch.angles);
    if !correct(element, start, u, p, scratch) {
        return None;
    }
    let one = start[0].with(1.0);
    let (mut end, mut defect) = (start, start[0].with(0.0));
    for ((p, u), weight) in p.iter_mut().zip(u).zip(&grid.weights()[element.nodes()]) {
        let rate = spin(p, u);
        let norm = square(p).sqrt();
        defect = defect.greater((norm - one).abs());
        for k in 0..4 {
            end[k] = rate[k].times_plus(one.with(*weight), end[k]);
            p[k] = p[k] * norm.inverse();
        }
    }
    let norm = square(&end).sqrt().inverse();
    (defect.greatest() < COARSE).then_some([
        end[0] * norm,
        end[1] * norm,
        end[2] * norm,
        end[3] * norm,
    ])
}

/// Rotations from node to node by the first two terms of Magnus, as in [`super::rotations`].
#[inline(always)]
fn guess<S: Simd>(
    grid: &Grid,
    element: &Element,
    start: Quaternion8<S>,
    u: &[Vector<S>],
    p: &mut [Quaternion8<S>],
    angles: &mut [Vector<S>],
) {
    let s = &grid.nodes()[element.nodes()];
    let angles = &mut angles[..u.len()];
    integrate(element.integrate(), u, angles);
    let mut at = start;
    for i in 0..u.len() {
        let mut angle = angles[i];
        let (pair, weight) = if i == 0 {
            let h = s[0] - element.from();
            ([0, 1], h * h * h / (12.0 * (s[1] - s[0])))
        } else {
            for k in 0..3 {
                angle[k] = angle[k] - angles[i - 1][k];
            }
            let h = s[i] - s[i - 1];
            ([i - 1, i], h * h / 12.0)
        };
        let commutator = cross(&u[pair[0]], &u[pair[1]]);
        for k in 0..3 {
            angle[k] = commutator[k].times_plus(commutator[k].with(weight), angle[k]);
        }
        at = product(&at, &exponential(&angle));
        p[i] = at;
    }
}

/// Solves the equations of the collocation by corrections of p, as in [`super::rotations`]; false if they take too
/// many.
#[inline(always)]
fn correct<S: Simd>(
    element: &Element,
    start: Quaternion8<S>,
    u: &[Vector<S>],
    p: &mut [Quaternion8<S>],
    scratch: &mut ElementFields<'_, S>,
) -> bool {
    let n = u.len();
    let a = element.integrate();
    let zero = start[0].with(0.0);
    let (residual, field) = (&mut scratch.residual[..n], &mut scratch.field[..n]);
    let mut inverses = [zero; CORRECTIONS];
    let mut largest = zero;
    for u in u {
        largest = largest.greater(dot(u, u));
    }
    let length = element.to() - element.from();
    let rounding = f64::EPSILON * (12.0 + length * largest.greatest().sqrt());

    for ((f, p), u) in field.iter_mut().zip(&*p).zip(u) {
        *f = spin(p, u);
    }
    integrate(a, field, residual);
    for (rho, p) in residual.iter_mut().zip(&*p) {
        for k in 0..4 {
            rho[k] = rho[k] + (start[k] - p[k]);
        }
    }
    let mut left = f64::INFINITY;
    for correction in 0..CORRECTIONS {
        let last = left;
        let mut most = zero;
        for rho in &*residual {
            most = most.greater(square(rho));
        }
        left = most.greatest().sqrt();
        if left <= rounding || (left < 10.0 * rounding && !(left < 0.99 * last)) {
            return true;
        }
        for (((f, rho), p), u) in field.iter_mut().zip(&*residual).zip(&*p).zip(u) {
            *f = over(&spin(rho, u), p);
        }
        let (before, new) = scratch.tried.split_at_mut(2 * n * correction);
        let (d, c) = new[..2 * n].split_at_mut(n);
        integrate(a, field, d);
        for ((d, rho), p) in d.iter_mut().zip(&*residual).zip(&*p) {
            let moved = product(d, p);
            for k in 0..4 {
                d[k] = rho[k] + moved[k];
            }
        }
        for ((f, d), u) in field.iter_mut().zip(&*d).zip(u) {
            *f = spin(d, u);
        }
        integrate(a, field, c);
        for (c, d) in c.iter_mut().zip(&*d) {
            for k in 0..4 {
                c[k] = d[k] - c[k];
            }
        }
        for (old, inverse) in before.chunks_exact(2 * n).zip(inverses) {
            let (d0, c0) = old.split_at(n);
            let theta = inner(c, c0, inverse * -1.0);
            add(&theta, c0, c);
            add(&theta, d0, d);
        }
        let mut size = zero;
        for c in &*c {
            size = size + square(c);
        }
        // A lane whose equations hold exactly has nothing to add.
        let inverse = size.below(f64::MIN_POSITIVE, zero, size.inverse());
        let theta = inner(residual, c, inverse);
        add(&theta, d, p);
        add(
            &[
                theta[0] * -1.0,
                theta[1] * -1.0,
                theta[2] * -1.0,
                theta[3] * -1.0,
            ],
            c,
            residual,
        );
        inverses[correction] = inverse;
    }
    false
}

/// out_i = sum_j a_ij f_j.
#[inline(always)]
fn integrate<S: Simd, const K: usize>(
    a: &DMatrix<f64>,
    f: &[[Eight<S>; K]],
    out: &mut [[Eight<S>; K]],
) {
    let n = f.len();
    let entries = a.as_slice();
    let zero = f[0][0].with(0.0);
    let mut i = 0;
    while i + 2 <= n {
        let (mut one, mut two) = ([zero; K], [zero; K]);
        for (j, f) in f.iter().enumerate() {
            let (a, b) = (
                zero.with(entries[j * n + i]),
                zero.with(entries[j * n + i + 1]),
            );
            for k in 0..K {
                one[k] = f[k].times_plus(a, one[k]);
                two[k] = f[k].times_plus(b, two[k]);
            }
        }
        (out[i], out[i + 1]) = (one, two);
        i += 2;
    }
    if i < n {
        let mut sum = [zero; K];
        for (j, f) in f.iter().enumerate() {
            let a = zero.with(entries[j * n + i]);
            for k in 0..K {
                sum[k] = f[k].times_plus(a, sum[k]);
            }
        }
        out[i] = sum;
    }
}

/// sum_i a_i o b_i*, times a number.
#[inline(always)]
fn inner<S: Simd>(a: &[Quaternion8<S>], b: &[Quaternion8<S>], factor: Eight<S>) -> Quaternion8<S> {
    let mut sum = [factor.with(0.0); 4];
    for (a, b) in a.iter().zip(b) {
        let product = over(a, b);
        for k in 0..4 {
            sum[k] = sum[k] + product[k];
        }
    }
    [
        sum[0] * factor,
        sum[1] * factor,
        sum[2] * factor,
        sum[3] * factor,
    ]
}

/// Adds theta o a_i to each b_i.
#[inline(always)]
fn add<S: Simd>(theta: &Quaternion8<S>, a: &[Quaternion8<S>], b: &mut [Quaternion8<S>]) {
    for (b, a) in b.iter_mut().zip(a) {
        let product = product(theta, a);
        for k in 0..4 {
            b[k] = b[k] + product[k];
        }
    }
}

/// Product of a matrix row with x, added to `sum`; the m entries stand m apart in `row`.
#[inline(always)]
fn mixed<S: Simd>(row: &[f64], m: usize, x: &[Eight<S>; 6], mut sum: Eight<S>) -> Eight<S> {
    for k in 0..m {
        sum = x[k].times_plus(sum.with(row[k * m]), sum);
    }
    sum
}
