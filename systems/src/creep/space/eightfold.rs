//! Up to eight states of a rod at once: the stages of an implicit step, whose shapes are found in wide registers, a state in each lane.
//!
//! The same equations in the same order as [`super::turn`], with one number of corrections for all states. What is inlined, always, is compiled for these registers; closures are not,
//! and loops count by hand.
#![allow(clippy::needless_range_loop)]

use super::super::grid::{Element, Grid};
use crate::math::eight::{Eight, Registers};
use crate::math::real::Real;
use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};
use std::any::Any;

/// States that are worked on at once.
pub(super) const LANES: usize = 8;
/// Half an angle below this, squared, has the cosine and the sine of the series in [`exponential`] to 1e-12.
const SMALL: f64 = 0.25;
/// Corrections after which the iteration is left to [`super::turn`]: nodes that resolve the rotations take two or three.
const CORRECTIONS: usize = 8;
/// Corrections for which there is room from the beginning.
const USUAL: usize = 3;
/// A defect of the rotations beyond which they are left to [`super::turn`].
const COARSE: f64 = 1e-2;

type Vector<S> = [Eight<S>; 3];
/// (w, x, y, z) of a quaternion.
type Turn<S> = [Eight<S>; 4];

/// Where the end is.
#[derive(Clone, Copy, Default)]
pub(super) struct End {
    /// Its rotation (w, x, y, z).
    pub turn: [f64; 4],
    /// Its position.
    pub place: [f64; 3],
    /// What is dissipated per time, with a law.
    pub dissipated: f64,
}

/// A law of m strains, matrices by columns: rates = fluidity (resultants - stiffness (strains - rest)).
#[derive(Clone, Copy)]
pub(super) struct Flowing<'a> {
    pub stiffness: &'a [f64],
    pub rest: &'a [f64],
    pub fluidity: &'a [f64],
}

/// The local resultants that end wrenches make at the nodes, or the strain rates under them, and where the ends are. Not generic in the strains and the
/// end: it would be compiled for each.
pub(super) struct Loading<'a, 'b> {
    pub grid: &'a Grid,
    /// Places of the strains that can change among u1 .. v3.
    pub places: &'a [usize],
    /// States, which begin with the strains node by node.
    pub states: &'a [&'a [f64]; LANES],
    /// (m1, n1) of each.
    pub wrenches: &'a [[f64; 6]; LANES],
    /// With it rates, without it resultants are put into `out`.
    pub law: Option<Flowing<'a>>,
    /// At the head of each, node by node; there may be fewer than lanes.
    pub out: &'a mut [&'b mut [f64]],
    pub ends: &'a mut [End; LANES],
    pub lanes: &'a mut Lanes,
}

/// Room kept from one call to the next, of numbers in the registers of this processor.
#[derive(Debug, Default)]
pub(super) struct Lanes(Option<Box<dyn Any + Send>>);

impl Lanes {
    /// So many numbers; what they are says nothing.
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
    /// False if the nodes do not resolve a shape, it is not finite, or the processor has no registers for this; what has been written is then of no use.
    pub(super) fn done(self) -> bool {
        Registers::widest().is_some_and(|registers| registers.work(self))
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
        let size = n * (21 + 8 * USUAL) + 3 * stretched;
        let Some(room) = self.lanes.room(zero, size) else {
            return false;
        };
        let mut room = Room(room);
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
        let mut scratch = Scratch {
            angles: room.take(n),
            residual: room.take(n),
            field: room.take(n),
            tried: room.take(2 * n * USUAL),
            more: Vec::new(),
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
                // Sums that stay in their registers, for a number m of terms that the compiler does not know.
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
            let end = End {
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

/// Numbers of which fields are taken.
struct Room<'a, S: Simd>(&'a mut [Eight<S>]);

impl<'a, S: Simd> Room<'a, S> {
    /// A field with K numbers at n places.
    #[inline(always)]
    fn take<const K: usize>(&mut self, n: usize) -> &'a mut [[Eight<S>; K]] {
        let (field, rest) = std::mem::take(&mut self.0).split_at_mut(n * K);
        self.0 = rest;
        field.as_chunks_mut().0
    }
}

/// Intermediate fields of an element.
struct Scratch<'a, S: Simd> {
    angles: &'a mut [Vector<S>],
    residual: &'a mut [Turn<S>],
    field: &'a mut [Turn<S>],
    /// Corrections and what they take off the residual, in turn; more of them than are usual.
    tried: &'a mut [Turn<S>],
    more: Vec<Turn<S>>,
}

/// Unit quaternions at the nodes of an element, from `start` at its beginning, into `p`; returns the one at its end. None if the nodes do
/// not resolve it.
#[inline(always)]
fn turn<S: Simd>(
    grid: &Grid,
    element: &Element,
    start: Turn<S>,
    u: &[Vector<S>],
    p: &mut [Turn<S>],
    scratch: &mut Scratch<'_, S>,
) -> Option<Turn<S>> {
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

/// Rotations from node to node by the first two terms of Magnus, as in [`super::turn`].
#[inline(always)]
fn guess<S: Simd>(
    grid: &Grid,
    element: &Element,
    start: Turn<S>,
    u: &[Vector<S>],
    p: &mut [Turn<S>],
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

/// Solves the equations of the collocation by corrections of p, as in [`super::turn`]; false if they take too many.
#[inline(always)]
fn correct<S: Simd>(
    element: &Element,
    start: Turn<S>,
    u: &[Vector<S>],
    p: &mut [Turn<S>],
    scratch: &mut Scratch<'_, S>,
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
        if correction == USUAL {
            scratch.more.clear();
            scratch
                .more
                .extend_from_slice(&scratch.tried[..2 * n * USUAL]);
            scratch.more.resize(2 * n * CORRECTIONS, [zero; 4]);
        }
        let tried = match correction < USUAL {
            true => &mut *scratch.tried,
            false => &mut scratch.more[..],
        };
        let (before, new) = tried.split_at_mut(2 * n * correction);
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
fn inner<S: Simd>(a: &[Turn<S>], b: &[Turn<S>], factor: Eight<S>) -> Turn<S> {
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

/// Adds theta o a_i to every b_i.
#[inline(always)]
fn add<S: Simd>(theta: &Turn<S>, a: &[Turn<S>], b: &mut [Turn<S>]) {
    for (b, a) in b.iter_mut().zip(a) {
        let product = product(theta, a);
        for k in 0..4 {
            b[k] = b[k] + product[k];
        }
    }
}

/// The quaternion of a rotation vector: by the series for an angle that is halved until it is small, then doubled.
#[inline(always)]
fn exponential<S: Simd>(angle: &Vector<S>) -> Turn<S> {
    let mut square = dot(angle, angle) * 0.25;
    let (mut halvings, mut largest) = (0, square.greatest());
    while largest > SMALL && halvings < 64 {
        (halvings, largest) = (halvings + 1, 0.25 * largest);
        square = square * 0.25;
    }
    let minus = square * -1.0;
    let cos = minus.series(&[
        1.0,
        0.5,
        1.0 / 24.0,
        1.0 / 720.0,
        1.0 / 40320.0,
        1.0 / 3_628_800.0,
    ]);
    let ratio = minus.series(&[
        1.0,
        1.0 / 6.0,
        1.0 / 120.0,
        1.0 / 5040.0,
        1.0 / 362_880.0,
        1.0 / 39_916_800.0,
    ]);
    let half = ratio * (0.5 * 0.5_f64.powi(halvings));
    let mut p = [cos, angle[0] * half, angle[1] * half, angle[2] * half];
    for _ in 0..halvings {
        p = product(&p, &p);
    }
    p
}

/// Adds to a sum m numbers times those of a row, which stand m apart.
#[inline(always)]
fn mixed<S: Simd>(row: &[f64], m: usize, x: &[Eight<S>; 6], mut sum: Eight<S>) -> Eight<S> {
    for k in 0..m {
        sum = x[k].times_plus(sum.with(row[k * m]), sum);
    }
    sum
}

/// The product a b: first b, then a.
#[inline(always)]
fn product<S: Simd>(a: &Turn<S>, b: &Turn<S>) -> Turn<S> {
    let v = a[1].times_plus(b[1], a[2].times_plus(b[2], a[3] * b[3]));
    let mut c = [a[0] * b[0] - v, v, v, v];
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        let sum = a[j].times_plus(b[k], a[i].times_plus(b[0], a[0] * b[i]));
        c[i] = sum - a[k] * b[j];
    }
    c
}

/// The product a b*.
#[inline(always)]
fn over<S: Simd>(a: &Turn<S>, b: &Turn<S>) -> Turn<S> {
    let mut c = [a[0] * b[0]; 4];
    for k in 1..4 {
        c[0] = a[k].times_plus(b[k], c[0]);
    }
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        let sum = a[k].times_plus(b[j], a[i] * b[0]);
        c[i] = sum - a[j].times_plus(b[k], a[0] * b[i]);
    }
    c
}

/// p u/2.
#[inline(always)]
fn spin<S: Simd>(p: &Turn<S>, u: &Vector<S>) -> Turn<S> {
    let h = [u[0] * 0.5, u[1] * 0.5, u[2] * 0.5];
    let v = p[1].times_plus(h[0], p[2].times_plus(h[1], p[3] * h[2]));
    let mut c = [v * -1.0; 4];
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        c[i] = p[j].times_plus(h[k - 1], p[0] * h[i - 1]) - p[k] * h[j - 1];
    }
    c
}

#[inline(always)]
fn square<S: Simd>(p: &Turn<S>) -> Eight<S> {
    let pair = p[1].times_plus(p[1], p[0] * p[0]);
    p[3].times_plus(p[3], p[2].times_plus(p[2], pair))
}

#[inline(always)]
fn dot<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Eight<S> {
    a[2].times_plus(b[2], a[1].times_plus(b[1], a[0] * b[0]))
}

#[inline(always)]
fn cross<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn added<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn scaled<S: Simd>(a: &Vector<S>, factor: Eight<S>) -> Vector<S> {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// d1, d2, d3 of a unit quaternion.
#[inline(always)]
fn directors<S: Simd>(p: &Turn<S>) -> [Vector<S>; 3] {
    let [w, x, y, z] = *p;
    let one = w.with(1.0);
    let (qw, qx, qy, qz) = (w + w, x + x, y + y, z + z);
    let (xx, yy, zz) = (qx * x, qy * y, qz * z);
    let (xy, yz, zx) = (qx * y, qy * z, qz * x);
    let (wx, wy, wz) = (qw * x, qw * y, qw * z);
    [
        [one - (yy + zz), xy + wz, zx - wy],
        [xy - wz, one - (zz + xx), yz + wx],
        [zx + wy, yz - wx, one - (xx + yy)],
    ]
}
