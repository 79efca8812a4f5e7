//! Rotations along an element by collocation at its Gauss nodes.
//!
//! The equation p' = p o u/2 for the unit quaternion p of R, with u along the directors, is linear: the values at the
//! nodes solve p_i = p_0 + sum_j A_ij p_j o u_j/2, with A the integration matrix of the element. Their accuracy is
//! that of the polynomials that resolve the rotation, and twice as many digits at the end of the element.

use crate::math::se3::{Turn, conjugate, exponential, product, spin};
use crate::viscoelastic::grid::{Element, Grid};
use nalgebra::{DMatrix, SVector, Vector3};

/// Defect reported if the nodes are too few for any estimate.
const COARSE: f64 = 0.5;

/// Largest number of corrections: two or three suffice, five on nodes that barely resolve p, fifteen on nodes that do
/// not at all.
const CORRECTIONS: usize = 40;

/// out_i = sum_j a_ij f_j, four rows at a time.
pub(super) fn integrate<const K: usize>(
    a: &DMatrix<f64>,
    f: &[SVector<f64, K>],
    out: &mut [SVector<f64, K>],
) {
    let rows = f.len();
    for (block, out) in out.chunks_mut(4).enumerate() {
        let mut sums = [[0.0; K]; 4];
        let mut first = 4 * block;
        for value in f {
            let column = &a.as_slice()[first..first + out.len()];
            let value = &value.data.0[0];
            if let [a0, a1, a2, a3] = *column {
                for k in 0..K {
                    sums[0][k] += value[k] * a0;
                    sums[1][k] += value[k] * a1;
                    sums[2][k] += value[k] * a2;
                    sums[3][k] += value[k] * a3;
                }
            } else {
                for (i, a) in column.iter().enumerate() {
                    for k in 0..K {
                        sums[i][k] += value[k] * a;
                    }
                }
            }
            first += rows;
        }
        for (i, out) in out.iter_mut().enumerate() {
            out.data.0[0] = sums[i];
        }
    }
}

/// Workspace: the intermediate fields of an element with up to n nodes.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    angles: Vec<Vector3<f64>>,
    residual: Vec<Turn>,
    field: Vec<Turn>,
    /// Corrections and their effects on the residual, alternating, and the squared norms of the latter.
    tried: Vec<Turn>,
    squares: Vec<f64>,
}

impl Scratch {
    /// Resizes the workspace for n nodes.
    pub(super) fn fit(&mut self, n: usize) {
        self.angles.resize(n, Vector3::zeros());
        self.residual.resize(n, Turn::zeros());
        self.field.resize(n, Turn::zeros());
    }
}

/// Unit quaternions at the nodes of an element, from `start` at its beginning, into `p`. Returns the one at its end
/// and the defect: the deviation of |p| from 1 by the collocation, about a third of the error of the rotations at the
/// nodes.
pub(super) fn turn(
    grid: &Grid,
    element: &Element,
    start: &Turn,
    u: &[Vector3<f64>],
    p: &mut [Turn],
    scratch: &mut Scratch,
) -> (Turn, f64) {
    let weights = &grid.weights()[element.nodes()];
    guess(grid, element, start, u, p, &mut scratch.angles);
    let mut defect = correct(element, start, u, p, scratch);
    let mut end = *start;
    for ((p, u), weight) in p.iter_mut().zip(u).zip(weights) {
        end += spin(p, u) * *weight;
        let norm = p.norm();
        let off = (norm - 1.0).abs();
        if !(off < COARSE) {
            defect = COARSE;
        } else if off > defect {
            defect = off;
        }
        *p /= norm;
    }
    if !(defect < COARSE) {
        // Far too few nodes for a collocation: the defect requests more, and until then these rotations serve.
        end = guess(grid, element, start, u, p, &mut scratch.angles);
    }
    (end / end.norm(), defect)
}

/// Rotations from node to node by the first two terms of Magnus, with errors of fourth order in the distance of the
/// nodes; returns the one at the end.
fn guess(
    grid: &Grid,
    element: &Element,
    start: &Turn,
    u: &[Vector3<f64>],
    p: &mut [Turn],
    angles: &mut [Vector3<f64>],
) -> Turn {
    let nodes = element.nodes();
    let (s, weights) = (&grid.nodes()[nodes.clone()], &grid.weights()[nodes]);
    let last = u.len() - 1;
    let angles = &mut angles[..=last];
    integrate(element.integrate(), u, angles);
    let mut at = *start;
    let mut before = Vector3::zeros();
    for (i, (p, angle)) in p.iter_mut().zip(&*angles).enumerate() {
        // For u linear between two nodes the second term is h^2/12 u_a x u_b; outside of them u is extrapolated.
        let commutator = if i == 0 {
            let h = s[0] - element.from();
            u[0].cross(&u[1]) * (h * h * h / (12.0 * (s[1] - s[0])))
        } else {
            let h = s[i] - s[i - 1];
            u[i - 1].cross(&u[i]) * (h * h / 12.0)
        };
        at = product(&at, &exponential(&(angle - before + commutator)));
        *p = at;
        before = *angle;
    }
    let total = u
        .iter()
        .zip(weights)
        .fold(Vector3::zeros(), |sum, (u, w)| sum + u * *w);
    let h = element.to() - s[last];
    let commutator = u[last - 1].cross(&u[last]) * (h * h * h / (12.0 * (s[last] - s[last - 1])));
    product(&at, &exponential(&(total - before + commutator)))
}

/// Solves the equations of the collocation by corrections of p; returns the residual, 0 for rounding.
///
/// Variation of constants: d = rho + eta o p solves d' = d o u/2 + rho' if p solves it without rho' and
/// eta' = (rho o u/2) o p*. This is Newton's method if the nodes resolve eta o p, and slow in the last few modes. So
/// every d is combined with those before for the least residual (generalised conjugate residuals), with quaternions
/// for coefficients: the equations are linear over them.
fn correct(
    element: &Element,
    start: &Turn,
    u: &[Vector3<f64>],
    p: &mut [Turn],
    scratch: &mut Scratch,
) -> f64 {
    let n = u.len();
    let a = element.integrate();
    let (residual, field) = (&mut scratch.residual[..n], &mut scratch.field[..n]);
    let Scratch { tried, squares, .. } = scratch;
    tried.clear();
    squares.clear();
    let most = |squares: f64, square: f64| squares.max(square);
    let largest = u.iter().map(Vector3::norm_squared).fold(0.0, most).sqrt();
    let rounding = f64::EPSILON * (12.0 + (element.to() - element.from()) * largest);

    for ((f, p), u) in field.iter_mut().zip(&*p).zip(u) {
        *f = spin(p, u);
    }
    integrate(a, field, residual);
    for (rho, p) in residual.iter_mut().zip(&*p) {
        *rho += start - p;
    }
    let mut left = f64::INFINITY;
    for _ in 0..CORRECTIONS {
        let last = left;
        left = residual.iter().map(Turn::norm_squared).fold(0.0, most);
        left = left.sqrt();
        if left <= rounding {
            return 0.0;
        }
        if !(left < 0.99 * last) {
            break;
        }

        // The correction d, and its effect c = d - int d o u/2 on the residual.
        for (((f, rho), p), u) in field.iter_mut().zip(&*residual).zip(&*p).zip(u) {
            *f = product(&spin(rho, u), &conjugate(p));
        }
        let before = tried.len();
        tried.resize(before + 2 * n, Turn::zeros());
        let (before, new) = tried.split_at_mut(before);
        let (d, c) = new.split_at_mut(n);
        integrate(a, field, d);
        for ((d, rho), p) in d.iter_mut().zip(&*residual).zip(&*p) {
            *d = rho + product(d, p);
        }
        for ((f, d), u) in field.iter_mut().zip(&*d).zip(u) {
            *f = spin(d, u);
        }
        integrate(a, field, c);
        for (c, d) in c.iter_mut().zip(&*d) {
            *c = d - *c;
        }
        for (old, square) in before.chunks_exact(2 * n).zip(&*squares) {
            let (d0, c0) = old.split_at(n);
            let theta = inner(c, c0) / -*square;
            add(&theta, c0, c);
            add(&theta, d0, d);
        }
        let square = c.iter().map(Turn::norm_squared).sum();
        let theta = inner(residual, c) / square;
        add(&theta, d, p);
        add(&-theta, c, residual);
        squares.push(square);
    }
    left
}

/// sum_i a_i o b_i*.
fn inner(a: &[Turn], b: &[Turn]) -> Turn {
    a.iter()
        .zip(b)
        .fold(Turn::zeros(), |sum, (a, b)| sum + product(a, &conjugate(b)))
}

/// Adds theta o a_i to every b_i.
fn add(theta: &Turn, a: &[Turn], b: &mut [Turn]) {
    for (b, a) in b.iter_mut().zip(a) {
        *b += product(theta, a);
    }
}
