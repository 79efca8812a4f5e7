//! Gauss nodes along a rod, in elements between the points at which its law is not smooth.
//!
//! A field is a polynomial on each element, given by its values at the element's Gauss nodes: integrals are exact to
//! degree 2n - 1, and the Legendre coefficients measure the resolution.

use crate::math::gauss::{Rule, legendre};
use nalgebra::{DMatrix, SVector};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Gauss nodes in elements that together cover [0, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    elements: Vec<Element>,
    s: Vec<f64>,
    weights: Vec<f64>,
    /// Cache of the first result of [`Grid::finer`].
    finer: OnceLock<(usize, Arc<Grid>)>,
}

/// One element and its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    from: f64,
    to: f64,
    /// Range of nodes in the grid.
    nodes: Range<usize>,
    /// int_from^{s_i} of the polynomial through values at the nodes; row i, column j.
    integrate: DMatrix<f64>,
    /// Integration matrix of the first half of the nodes, for the symmetric and antisymmetric parts of fields: half
    /// the work.
    symmetric: DMatrix<f64>,
    antisymmetric: DMatrix<f64>,
    /// Coefficients in P_k(2x - 1), x in [0, 1], of the polynomial through values at the nodes; row k, column j.
    modes: DMatrix<f64>,
}

/// Fewest nodes of an element.
pub const FEWEST: usize = 4;

impl Grid {
    /// A grid with elements between `breaks` (inside (0, 1), in growing order). `nodes` lists the number of nodes of
    /// each element, at least [`FEWEST`].
    pub fn new(breaks: &[f64], nodes: &[usize]) -> Self {
        let ends: Vec<f64> = [0.0].iter().chain(breaks).chain(&[1.0]).copied().collect();
        let mut grid = Self {
            elements: Vec::new(),
            s: Vec::new(),
            weights: Vec::new(),
            finer: OnceLock::new(),
        };
        for (pair, &count) in ends
            .windows(2)
            .zip(nodes.iter().chain(std::iter::repeat(&FEWEST)))
        {
            grid.push(pair[0], pair[1], count.max(FEWEST));
        }
        grid
    }

    /// A grid of one element.
    pub fn uniform(nodes: usize) -> Self {
        Self::new(&[], &[nodes])
    }

    /// A grid with `nodes` nodes on each of its elements, for drawing curves. The first is cached: its matrices cost
    /// more than a curve.
    pub fn finer(&self, nodes: usize) -> Arc<Self> {
        let make = || {
            let counts = vec![nodes; self.elements.len()];
            Arc::new(Self::new(&self.breaks(), &counts))
        };
        let (kept, finer) = self.finer.get_or_init(|| (nodes, make()));
        if *kept == nodes {
            finer.clone()
        } else {
            make()
        }
    }

    fn push(&mut self, from: f64, to: f64, count: usize) {
        let rule = Rule::new(count);
        let length = to - from;
        let first = self.s.len();
        self.s.extend(rule.nodes.iter().map(|x| from + length * x));
        self.weights.extend(rule.weights.iter().map(|w| length * w));
        let (integrate, modes) = rule.matrices();
        let integrate = integrate * length;
        let half = count / 2;
        let mirrored = |i: usize, j: usize, sign: f64| {
            0.5 * (integrate[(i, j)] + sign * integrate[(i, count - 1 - j)])
        };
        self.elements.push(Element {
            symmetric: DMatrix::from_fn(half, count - half, |i, j| mirrored(i, j, 1.0)),
            antisymmetric: DMatrix::from_fn(count - half, half, |i, j| mirrored(i, j, -1.0)),
            from,
            to,
            nodes: first..first + count,
            integrate,
            modes,
        });
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.s.len()
    }

    /// Always false: a grid has nodes.
    pub fn is_empty(&self) -> bool {
        self.s.is_empty()
    }

    /// The nodes, in growing order in (0, 1).
    pub fn nodes(&self) -> &[f64] {
        &self.s
    }

    /// Quadrature weights; their sum is 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The elements.
    pub fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// int_0^1 f.
    pub fn total<const K: usize>(&self, f: &[SVector<f64, K>]) -> SVector<f64, K> {
        self.weights
            .iter()
            .zip(f)
            .fold(SVector::zeros(), |sum, (w, f)| sum + f * *w)
    }

    /// int_0^{s_i} f at every node into `out`; returns int_0^1 f.
    pub fn integrate<const K: usize>(
        &self,
        f: &[SVector<f64, K>],
        out: &mut [SVector<f64, K>],
    ) -> SVector<f64, K> {
        let mut before = SVector::<f64, K>::zeros();
        for element in &self.elements {
            let range = element.nodes.clone();
            let (f, weights) = (&f[range.clone()], &self.weights[range.clone()]);
            let total = f
                .iter()
                .zip(weights)
                .fold(SVector::<f64, K>::zeros(), |sum, (f, w)| sum + f * *w);
            element.integrate_into(f, &before, &total, &mut out[range]);
            before += total;
        }
        before
    }

    /// The matrix of [`Grid::integrate`]: row i holds int_0^{s_i}.
    pub fn integration(&self) -> DMatrix<f64> {
        let n = self.len();
        let mut matrix = DMatrix::zeros(n, n);
        for element in &self.elements {
            let Range { start, end } = element.nodes;
            for j in 0..start {
                for i in start..end {
                    matrix[(i, j)] = self.weights[j];
                }
            }
            matrix
                .view_mut((start, start), (end - start, end - start))
                .copy_from(&element.integrate);
        }
        matrix
    }

    /// Interpolates the field with these values at the nodes at the point `s` in [0, 1].
    pub fn at<const K: usize>(&self, f: &[SVector<f64, K>], s: f64) -> SVector<f64, K> {
        let last = self.elements.len() - 1;
        let at = self.elements.partition_point(|e| e.to < s).min(last);
        self.elements[at].evaluate(&f[self.elements[at].nodes.clone()], s)
    }

    /// int_0^s of the field with these values at the nodes, for `s` in [0, 1]: exact, as [`Grid::integrate`] is.
    pub fn integral_at<const K: usize>(&self, f: &[SVector<f64, K>], s: f64) -> SVector<f64, K> {
        let last = self.elements.len() - 1;
        let at = self.elements.partition_point(|e| e.to < s).min(last);
        let element = &self.elements[at];
        let before =
            (0..element.nodes.start).fold(SVector::zeros(), |sum, i| sum + f[i] * self.weights[i]);
        before + element.integral(&f[element.nodes.clone()], s)
    }

    /// As [`Grid::at`], at several points in growing order.
    pub fn at_each<const K: usize>(
        &self,
        f: &[SVector<f64, K>],
        places: &[f64],
    ) -> Vec<SVector<f64, K>> {
        let mut values = Vec::with_capacity(places.len());
        let last = self.elements.len() - 1;
        for (k, element) in self.elements.iter().enumerate() {
            let coefficients = element.coefficients(&f[element.nodes.clone()]);
            while let Some(&s) = places.get(values.len())
                && (s <= element.to || k == last)
            {
                values.push(element.sum(&coefficients, s));
            }
        }
        values
    }

    /// A field interpolated on another grid with the same elements: exact if that has as many nodes or more.
    pub fn carried<const K: usize>(
        &self,
        f: &[SVector<f64, K>],
        to: &Grid,
    ) -> Vec<SVector<f64, K>> {
        let mut values = Vec::with_capacity(to.len());
        for (element, target) in self.elements.iter().zip(&to.elements) {
            let coefficients = element.coefficients(&f[element.nodes.clone()]);
            for &s in &to.s[target.nodes.clone()] {
                values.push(element.sum(&coefficients, s));
            }
        }
        values
    }

    /// For each element the size of the last two Legendre coefficients of a field, and the same on fewer nodes: see
    /// [`Tail`].
    pub fn tails<const K: usize>(&self, f: &[SVector<f64, K>]) -> Vec<Tail> {
        self.elements
            .iter()
            .map(|element| {
                let coefficients = element.coefficients(&f[element.nodes.clone()]);
                let count = coefficients.len();
                let size = |range: Range<usize>| {
                    coefficients[range]
                        .iter()
                        .map(|c| c.amax())
                        .fold(0.0, f64::max)
                };
                let fewer = fewer(count);
                Tail {
                    now: size(count - 2..count),
                    fewer: size(fewer - 2..count),
                }
            })
            .collect()
    }

    /// Nodes per element.
    pub fn counts(&self) -> Vec<usize> {
        self.elements.iter().map(|e| e.nodes.len()).collect()
    }

    /// Points between elements.
    pub fn breaks(&self) -> Vec<f64> {
        self.elements[1..].iter().map(|e| e.from).collect()
    }
}

/// Resolution of a field on one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tail {
    /// Largest of the last two Legendre coefficients.
    pub now: f64,
    /// Largest of the coefficients at the end of, or left out by, the next coarser choice ([`fewer`]).
    pub fewer: f64,
}

/// The next finer choice of nodes.
pub fn more(nodes: usize) -> usize {
    nodes + (nodes / 2).max(2)
}

/// The next coarser choice of nodes.
pub fn fewer(nodes: usize) -> usize {
    (nodes - nodes / 3).max(FEWEST)
}

impl Element {
    /// Start of the element.
    pub fn from(&self) -> f64 {
        self.from
    }

    /// End of the element.
    pub fn to(&self) -> f64 {
        self.to
    }

    /// Range of the element's nodes in the grid.
    pub fn nodes(&self) -> Range<usize> {
        self.nodes.clone()
    }

    /// int_from^{s_i} of the polynomial through values at the element's nodes; row i, column j.
    pub fn integrate(&self) -> &DMatrix<f64> {
        &self.integrate
    }

    /// int_0^{s_i} f at the nodes of the element into `out`, given int f `before` it and its own `total`.
    ///
    /// Fields split into parts symmetric and antisymmetric about the middle: with nodes i and i' that mirror each
    /// other, int to s_i' = total - (symmetric part) + (antisymmetric part) of int to s_i.
    fn integrate_into<const K: usize>(
        &self,
        f: &[SVector<f64, K>],
        before: &SVector<f64, K>,
        total: &SVector<f64, K>,
        out: &mut [SVector<f64, K>],
    ) {
        let n = f.len();
        let half = n / 2;
        let (near, far) = out.split_at_mut(n - half);
        near.fill(SVector::zeros());
        far.fill(SVector::zeros());
        multiply_add(&self.antisymmetric, |j| f[j] - f[n - 1 - j], near);
        // The middle node mirrors itself.
        let sum = |j: usize| {
            if 2 * j + 1 == n {
                f[j]
            } else {
                f[j] + f[n - 1 - j]
            }
        };
        multiply_add(&self.symmetric, sum, far);
        for (odd, even) in near.iter_mut().zip(far.iter_mut()) {
            (*odd, *even) = (before + *even + *odd, before + total - *even + *odd);
        }
        // Computed in the order of the mirror images, hence reversed.
        far.reverse();
        if n > 2 * half {
            near[half] += before + total * 0.5;
        }
    }

    /// Coefficients in P_k(2x - 1) of the polynomial through values at the element's nodes.
    pub(super) fn coefficients<const K: usize>(
        &self,
        f: &[SVector<f64, K>],
    ) -> Vec<SVector<f64, K>> {
        (0..f.len())
            .map(|k| (0..f.len()).fold(SVector::zeros(), |sum, j| sum + f[j] * self.modes[(k, j)]))
            .collect()
    }

    fn sum<const K: usize>(&self, coefficients: &[SVector<f64, K>], s: f64) -> SVector<f64, K> {
        let x = 2.0 * (s - self.from) / (self.to - self.from) - 1.0;
        legendre(x, coefficients.len())
            .iter()
            .zip(coefficients)
            .fold(SVector::zeros(), |sum, (p, c)| sum + c * *p)
    }

    /// int_from^s of the polynomial through values at the element's nodes.
    fn integral<const K: usize>(&self, f: &[SVector<f64, K>], s: f64) -> SVector<f64, K> {
        let half = 0.5 * (self.to - self.from);
        let x = (s - self.from) / half - 1.0;
        let table = legendre(x, f.len() + 1);
        // int_{-1}^x P_k = (P_{k+1} - P_{k-1})/(2k+1).
        self.coefficients(f)
            .iter()
            .enumerate()
            .fold(SVector::zeros(), |sum, (k, c)| {
                let below = if k == 0 { -1.0 } else { table[k - 1] };
                sum + c * (half * (table[k + 1] - below) / (2 * k + 1) as f64)
            })
    }

    fn evaluate<const K: usize>(&self, f: &[SVector<f64, K>], s: f64) -> SVector<f64, K> {
        self.sum(&self.coefficients(f), s)
    }
}

/// out += matrix x, four columns at a time.
fn multiply_add<const K: usize>(
    matrix: &DMatrix<f64>,
    x: impl Fn(usize) -> SVector<f64, K>,
    out: &mut [SVector<f64, K>],
) {
    let rows = out.len();
    if rows == 0 {
        return;
    }
    let columns = matrix.as_slice().chunks_exact(4 * rows);
    let last = columns.remainder();
    let first = matrix.ncols() / 4 * 4;
    for (j, column) in last.chunks_exact(rows).enumerate() {
        let x = x(first + j);
        for (o, a) in out.iter_mut().zip(column) {
            *o += x * *a;
        }
    }
    for (j, four) in columns.enumerate() {
        let x = [x(4 * j), x(4 * j + 1), x(4 * j + 2), x(4 * j + 3)];
        let (a, b) = four.split_at(2 * rows);
        let ((a, b), (c, d)) = (a.split_at(rows), b.split_at(rows));
        let (a, b, c, d) = (&a[..rows], &b[..rows], &c[..rows], &d[..rows]);
        for (i, o) in out.iter_mut().enumerate() {
            *o += x[0] * a[i] + x[1] * b[i] + x[2] * c[i] + x[3] * d[i];
        }
    }
}
