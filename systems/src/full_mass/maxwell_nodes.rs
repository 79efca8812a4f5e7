//! Maxwell branches of a rod with mass: a spring in series with a dashpot, at each node, for each branch.
//!
//! With z the strains of a dashpot, E the modulus of its spring and tau its relaxation time,
//! ```text
//! z' = (e - z)/tau,      resultants + E (e - z),
//! energy + 1/2 (e - z) . E (e - z),      loss (e - z) . E (e - z)/tau.
//! ```
//! Implicit steps eliminate z at its node: sigma dz - (dq - dz)/tau = b leaves dz = (dq + tau b)/(1 + sigma tau). The
//! spring then adds E (dq - dz) = E tau (sigma dq - b)/(1 + sigma tau). The matrix of the rod keeps its size.

use super::damped_modes::Branch;
use super::law::Law;
use crate::section::Strain;
use nalgebra::{ComplexField, DMatrix, DVector};

/// Maxwell branches of a rod at its nodes. Dashpot strains are stored branch by branch, each in the order of the
/// coordinates.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    /// Indices of the strains that can change.
    active: Vec<usize>,
    /// Weights of the nodes.
    weights: Vec<f64>,
    /// Modulus among the active strains, and relaxation time, of each branch.
    branches: Vec<(DMatrix<f64>, f64)>,
}

impl Memory {
    /// The branches of a law at nodes of these weights.
    pub fn new(law: &Law, weights: impl Iterator<Item = f64>) -> Self {
        let active = law.active().to_vec();
        let branches = law.branches().iter().map(|branch| {
            let count = active.len();
            let among =
                DMatrix::from_fn(count, count, |i, j| branch.modulus[(active[i], active[j])]);
            (among, branch.time)
        });
        Self {
            branches: branches.collect(),
            weights: weights.collect(),
            active,
        }
    }

    /// Number of coordinates of the rod.
    fn size(&self) -> usize {
        self.active.len() * self.weights.len()
    }

    /// Number of all dashpot strains.
    pub fn numbers(&self) -> usize {
        self.branches.len() * self.size()
    }

    /// Strains of the springs from the coordinates and the dashpots: node by node, those of all branches.
    pub fn springs(&self, q: &[f64], z: &[f64]) -> Vec<Strain> {
        let (count, size) = (self.active.len(), self.size());
        let nodes = 0..self.weights.len();
        let all = nodes.flat_map(|node| (0..self.branches.len()).map(move |k| (node, k)));
        let springs = all.map(|(node, k)| {
            let mut spring = Strain::zeros();
            for (a, place) in self.active.iter().enumerate() {
                let i = node * count + a;
                spring[*place] = q[i] - z[k * size + i];
            }
            spring
        });
        springs.collect()
    }

    /// Dashpot strains of unloaded branches at these coordinates.
    pub fn relaxed(&self, q: &[f64]) -> Vec<f64> {
        q.repeat(self.branches.len())
    }

    /// z' at all dashpots.
    pub fn rates(&self, q: &[f64], z: &[f64], out: &mut [f64]) {
        let size = self.size();
        for (k, (_, time)) in self.branches.iter().enumerate() {
            for (i, q) in q.iter().enumerate() {
                out[k * size + i] = (q - z[k * size + i]) / time;
            }
        }
    }

    /// Squared error of all dashpots in the norm of a rod, from that of each number.
    pub fn mean_square(&self, part: impl Fn(usize) -> f64) -> f64 {
        let (count, size) = (self.active.len(), self.size());
        let all = (0..self.numbers()).map(|i| self.weights[i % size / count] * part(i));
        all.sum::<f64>() / count as f64
    }

    /// Branches of all nodes, with the nodes' weights, for a rod with coordinates from `first` on.
    pub fn branches_from(&self, first: usize) -> impl Iterator<Item = Branch> {
        let (count, size) = (self.active.len(), self.size());
        self.branches.iter().map(move |(e, time)| Branch {
            first,
            modulus: DMatrix::from_fn(size, size, |i, j| {
                if i / count == j / count {
                    self.weights[i / count] * e[(i % count, j % count)]
                } else {
                    0.0
                }
            }),
            time: *time,
        })
    }

    /// Adds weights E sigma tau/(1 + sigma tau): the response of the springs to a change of the strains.
    pub fn stiffen<T: ComplexField<RealField = f64> + Copy>(&self, sigma: T, out: &mut DMatrix<T>) {
        let count = self.active.len();
        for (modulus, time) in &self.branches {
            let part = sigma * T::from_real(*time);
            let part = part / (T::one() + part);
            for (node, weight) in self.weights.iter().enumerate() {
                for i in 0..count {
                    for j in 0..count {
                        let entry = T::from_real(weight * modulus[(i, j)]);
                        out[(node * count + i, node * count + j)] += part * entry;
                    }
                }
            }
        }
    }

    /// Adds weights E (q - z) of every branch times a factor of its time.
    fn add<T: ComplexField<RealField = f64> + Copy>(
        &self,
        factor: impl Fn(f64) -> T,
        q: &[T],
        z: &[T],
        out: &mut [T],
    ) {
        let (count, size) = (self.active.len(), self.size());
        for (k, (modulus, time)) in self.branches.iter().enumerate() {
            let factor = factor(*time);
            for (node, weight) in self.weights.iter().enumerate() {
                for j in 0..count {
                    let at = node * count + j;
                    let spring = (q[at] - z[k * size + at]) * factor;
                    for i in 0..count {
                        out[node * count + i] += spring * T::from_real(weight * modulus[(i, j)]);
                    }
                }
            }
        }
    }

    /// Adds the resultants of the springs, at the weights of the nodes.
    pub fn push(&self, q: &[f64], z: &[f64], out: &mut [f64]) {
        self.add(|_| 1.0, q, z, out);
    }

    /// Adds to the right of the balance the contributions of the right-hand sides of dashpots, and of the strains
    /// (dq = (dw + b)/sigma).
    pub fn eliminate<T: ComplexField<RealField = f64> + Copy>(
        &self,
        sigma: T,
        q: &[T],
        z: &[T],
        out: &mut [T],
    ) {
        let factor = |time: f64| {
            let time = T::from_real(time);
            -time / (T::one() + sigma * time)
        };
        self.add(factor, q, z, out);
    }

    /// Overwrites the right-hand sides of the dashpots with their changes, from those of the coordinates.
    pub fn follow<T: ComplexField<RealField = f64> + Copy>(
        &self,
        sigma: T,
        q: &DVector<T>,
        z: &mut [T],
    ) {
        let size = self.size();
        for (k, (_, time)) in self.branches.iter().enumerate() {
            let time = T::from_real(*time);
            for (i, q) in q.iter().enumerate() {
                let z = &mut z[k * size + i];
                *z = (*q + *z * time) / (T::one() + sigma * time);
            }
        }
    }
}
