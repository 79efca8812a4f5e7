//! Gauss-Legendre rules, with matrices of integration and of Legendre coefficients.

use crate::math::small_sort::sort_few;
use gauss_quad::GaussLegendre;
use nalgebra::DMatrix;

/// A Gauss-Legendre rule on [0, 1]: exact for polynomials of degree 2 n - 1, to rounding.
#[derive(Debug, Clone)]
pub struct Rule {
    /// The nodes, in growing order in (0, 1).
    pub nodes: Vec<f64>,
    /// Weights, of sum 1.
    pub weights: Vec<f64>,
    /// Nodes on [-1, 1], the interval of the Legendre polynomials.
    centred: Vec<f64>,
}

impl Rule {
    /// The rule of `count` >= 1 nodes.
    pub fn new(count: usize) -> Self {
        let rule = GaussLegendre::new(count.max(1).try_into().expect("not zero"));
        let mut pairs: Vec<_> = rule.as_node_weight_pairs().to_vec();
        sort_few(&mut pairs, |pair| pair.0);
        Self {
            nodes: pairs.iter().map(|(x, _)| 0.5 * (1.0 + x)).collect(),
            weights: pairs.iter().map(|(_, weight)| 0.5 * weight).collect(),
            centred: pairs.into_iter().map(|(x, _)| x).collect(),
        }
    }

    /// Matrices (integrate, modes) for the values f of a function at the nodes. (integrate f)_i is the integral from
    /// 0 to node i, and (modes f)_k is the coefficient of the Legendre polynomial P_k. Both are exact for polynomials
    /// of degree n - 1.
    pub fn matrices(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let count = self.nodes.len();
        let table: Vec<Vec<f64>> = (self.centred.iter())
            .map(|x| legendre(*x, count + 1))
            .collect();
        // f = sum_k (2k+1)/2 <f, P_k> P_k and int_{-1}^x P_k = (P_{k+1} - P_{k-1})/(2k+1).
        let rise = |k: usize| {
            table
                .iter()
                .map(move |values| values[k + 1] - values[k - 1])
        };
        let rises: Vec<Vec<f64>> = (1..count).map(|k| rise(k).collect()).collect();
        let mut integrate = Vec::with_capacity(count * count);
        for (values, weight) in table.iter().zip(&self.weights) {
            // The sums over k are independent operations, which overlap in the processor.
            let mut sums = vec![0.0; count];
            for (value, rises) in values[1..].iter().zip(&rises) {
                for (sum, rise) in sums.iter_mut().zip(rises) {
                    *sum += rise * value;
                }
            }
            let of = |(sum, x): (f64, &f64)| 0.5 * weight * (1.0 + x + sum);
            integrate.extend(sums.into_iter().zip(&self.centred).map(of));
        }
        let integrate = DMatrix::from_vec(count, count, integrate);
        let modes = DMatrix::from_fn(count, count, |k, j| {
            (2 * k + 1) as f64 * self.weights[j] * table[j][k]
        });
        (integrate, modes)
    }
}

/// P_0(x) .. P_{count-1}(x), the Legendre polynomials, by their recurrence.
pub fn legendre(x: f64, count: usize) -> Vec<f64> {
    let mut values = vec![1.0; count];
    if count > 1 {
        values[1] = x;
    }
    for k in 1..count.saturating_sub(1) {
        let n = k as f64;
        values[k + 1] = ((2.0 * n + 1.0) * x * values[k] - n * values[k - 1]) / (n + 1.0);
    }
    values
}

/// Nodes on [0, 1], ends included, and weights of sum 1 of the Gauss-Lobatto rule of `count` >= 2 nodes: exact for
/// polynomials of degree 2 n - 3.
pub fn lobatto(count: usize) -> (Vec<f64>, Vec<f64>) {
    let last = count.max(2) - 1;
    let degree = last as f64;
    // Inner nodes are the zeros of P_n'. Newton's method is that of x P_n - P_(n-1), which has the same zeros.
    let node = |i: usize| {
        let mut x = -(std::f64::consts::PI * i as f64 / degree).cos();
        if i == 0 || i == last {
            return x;
        }
        for _ in 0..50 {
            let p = legendre(x, last + 1);
            let change = (x * p[last] - p[last - 1]) / ((degree + 1.0) * p[last]);
            x -= change;
            if change.abs() < 1e-16 {
                break;
            }
        }
        x
    };
    let nodes: Vec<f64> = (0..=last).map(node).collect();
    let weight = |x: &f64| 1.0 / (degree * (degree + 1.0) * legendre(*x, last + 1)[last].powi(2));
    let weights = nodes.iter().map(weight).collect();
    (nodes.iter().map(|x| 0.5 * (1.0 + x)).collect(), weights)
}
