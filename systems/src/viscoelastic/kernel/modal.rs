//! The rod in modal strains at the nodes of a grid, and the operator T off the moving fields.

use super::super::grid::{Grid, more};
use super::Mode;
use crate::error::{Error, Result};
use crate::section::rate::{Viscoelastic, inverse_of_free, rigid_of};
use crate::section::{Resultant, Strain};
use nalgebra::{Cholesky, DMatrix, Dyn, Matrix6, OMatrix, U6, Vector6};

/// Most unknowns (nodes times free strains).
const MOST: usize = 384;
/// Relative change of G(p) below which the grid is fine enough.
const STILL: f64 = 1e-13;
/// Largest deviation of the unloaded strains from straight.
const BENT: f64 = 1e-12;
/// Strength below which a mode, against the fastest rate, is rounding.
const WEAK: f64 = 1e-14;

/// A row for each modal strain, a column for each component of the end wrench.
pub(super) type ModalLoads = OMatrix<f64, Dyn, U6>;

/// A point of the rod in modal strains y: e = E y with E E^T = A^-1, E^T B E = diag(rates).
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub s: f64,
    pub weight: f64,
    pub rates: Vec<f64>,
    /// E^T Q: rows are modal strains.
    pub load: ModalLoads,
}

impl Node {
    /// load^T diag(f(rate)) load.
    fn sum(&self, f: impl Fn(f64) -> f64) -> Matrix6<f64> {
        let scaled = self
            .load
            .map_with_location(|i, _, entry| entry * f(self.rates[i]));
        self.load.transpose() * scaled * self.weight
    }
}

pub(super) fn flat() -> Error {
    Error::ill_conditioned(
        "stiffnesses or viscosities are too far apart in size: to rounding the end is held in some direction",
    )
}

pub(super) fn total(nodes: &[Node], f: impl Fn(f64) -> f64 + Copy) -> Matrix6<f64> {
    nodes
        .iter()
        .fold(Matrix6::zeros(), |sum, node| sum + node.sum(f))
}

/// Normalisation of the end: units in which int Q^T A^-1 Q is 1.
pub(super) struct EndUnits {
    pub reach: [bool; 6],
    /// K^-T of int Q^T A^-1 Q = K K^T; zero rows and columns where the end does not move.
    pub unit: Matrix6<f64>,
}

impl EndUnits {
    pub fn new(nodes: &[Node]) -> Result<Self> {
        let mut mobility = total(nodes, |_| 1.0);
        let reach = std::array::from_fn(|k| mobility[(k, k)] > 0.0);
        for k in (0..6).filter(|k| !reach[*k]) {
            mobility[(k, k)] = 1.0;
        }
        let lower = Cholesky::new(mobility).ok_or_else(flat)?.l();
        let mut unit = lower
            .solve_lower_triangular(&Matrix6::identity())
            .ok_or_else(flat)?
            .transpose();
        for k in (0..6).filter(|k| !reach[*k]) {
            unit[(k, k)] = 0.0;
        }
        Ok(Self { reach, unit })
    }

    pub fn still(&self) -> [bool; 6] {
        self.reach.map(|reach| !reach)
    }

    pub fn physical(&self, matrix: &Matrix6<f64>) -> Matrix6<f64> {
        let product = self.unit * matrix * self.unit.transpose();
        0.5 * (product + product.transpose())
    }
}

/// R(0) and the modes of T off the moving fields S.
pub(super) fn off_the_moving(nodes: &[Node], end: &EndUnits) -> Option<(Matrix6<f64>, Vec<Mode>)> {
    let places: Vec<(usize, usize)> = (0..nodes.len())
        .flat_map(|k| (0..nodes[k].rates.len()).map(move |i| (k, i)))
        .filter(|(k, i)| nodes[*k].load.row(*i).amax() > 0.0)
        .collect();
    let rates: Vec<f64> = places.iter().map(|(k, i)| nodes[*k].rates[*i]).collect();
    let fastest = rates.iter().fold(0.0_f64, |max, rate| max.max(*rate));
    // An orthonormal basis U of S.
    let mut basis = DMatrix::zeros(places.len(), 6);
    for (row, (k, i)) in places.iter().enumerate() {
        let shape = nodes[*k].load.row(*i) * end.unit * nodes[*k].weight.sqrt();
        basis.row_mut(row).copy_from(&shape);
    }
    let mut moved = basis.clone();
    for (row, rate) in rates.iter().enumerate() {
        moved.row_mut(row).scale_mut(*rate);
    }
    let inner = basis.transpose() * &moved;
    let glassy = Matrix6::from_fn(|i, j| inner[(i, j)]);
    // (1 - U U^T) T (1 - U U^T) + 2 fastest U U^T: the part on S is moved beyond all rates.
    let lifted = &basis * (&inner + DMatrix::identity(6, 6) * (2.0 * fastest));
    let mut operator = &lifted * basis.transpose();
    let cross = &moved * basis.transpose();
    operator -= &cross + cross.transpose();
    for (row, rate) in rates.iter().enumerate() {
        operator[(row, row)] += rate;
    }
    let eigen = operator.try_symmetric_eigen(f64::EPSILON, 0)?;
    let mut modes = Vec::new();
    for (rate, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *rate > 1.5 * fastest {
            continue;
        }
        let force = moved.transpose() * vector;
        if force.amax() > WEAK * fastest {
            modes.push(Mode {
                rate: *rate,
                force: end.unit * Vector6::from_fn(|i, _| force[i]),
            });
        }
    }
    modes.sort_by(|a, b| a.rate.total_cmp(&b.rate));
    Some((end.physical(&glassy), modes))
}

/// The rod on the nodes of a sufficiently fine grid, and the change in the last refinement.
pub(super) fn nodes(
    section: &Viscoelastic,
    length: f64,
    carried: [bool; 6],
) -> Result<(Vec<Node>, f64)> {
    if !(0.0 < length && length.is_finite()) {
        return Err(Error::domain(format!(
            "length = {length} must be finite and > 0"
        )));
    }
    let breaks = section.breaks().into_iter().map(|s| s / length);
    let breaks: Vec<f64> = breaks.filter(|x| 0.0 < *x && *x < 1.0).collect();
    let elements = breaks.len() + 1;
    let free = section.rate.rigid().iter().filter(|rigid| !**rigid).count();
    let strains = free * (1 + section.branches.len());
    let at = |count: usize| -> Result<Vec<Node>> {
        let grid = Grid::new(&breaks, &vec![count; elements]);
        let places = grid.nodes().iter().zip(grid.weights());
        places
            .map(|(x, weight)| node(section, length, length * x, length * weight, carried))
            .collect()
    };
    let mut count = 6;
    let mut coarse = at(4)?;
    loop {
        let fine = at(count)?;
        let change = change(&coarse, &fine);
        let next = more(count);
        if change <= STILL || next * elements * strains > MOST {
            return Ok((fine, change));
        }
        (coarse, count) = (fine, next);
    }
}

/// The largest change of an entry of G(p) over p, against the diagonal.
fn change(coarse: &[Node], fine: &[Node]) -> f64 {
    let rates = || {
        fine.iter()
            .flat_map(|node| {
                let loads = node.load.row_iter().map(|row| row.amax());
                node.rates.iter().copied().zip(loads)
            })
            .filter(|(_, load)| *load > 0.0)
            .map(|(rate, _)| rate)
    };
    let slowest = rates().fold(f64::INFINITY, f64::min);
    let fastest = rates().fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for step in 0..8 {
        // p = 0, between the rates, infinite.
        let p = slowest * (fastest / slowest).powf((f64::from(step) - 1.0) / 5.0);
        let compliance = |rate: f64| match step {
            0 => 1.0 / rate,
            7 => 1.0,
            _ => 1.0 / (p + rate),
        };
        let (old, new) = (total(coarse, compliance), total(fine, compliance));
        for i in 0..6 {
            for j in 0..6 {
                let size = (new[(i, i)] * new[(j, j)]).sqrt();
                if size > 0.0 {
                    worst = worst.max((old[(i, j)] - new[(i, j)]).abs() / size);
                }
            }
        }
    }
    worst
}

/// A^-1 and B^-1 at s, zero rows and columns where a strain is rigid.
pub(super) fn compliances(section: &Viscoelastic, s: f64) -> Result<[Matrix6<f64>; 2]> {
    let unloaded = section.elastic.inverse(s, &Resultant::zeros())?;
    let bent = (unloaded.strain - Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)).amax();
    if !(bent <= BENT) {
        return Err(Error::domain(format!(
            "the rod must be straight and unstretched without load: at s = {s} its strains are {}; \
             the kernel is that of small motions about a straight rod: set rest curvature and twist to 0",
            crate::error::named(&crate::error::STRAINS, unloaded.strain.as_slice())
        )));
    }
    let rigid = rigid_of(&unloaded.compliance);
    if rigid != section.rate.rigid() {
        return Err(Error::domain(format!(
            "at s = {s} the elastic law holds other strains rigid than the rate law ({} and {}): they must agree",
            crate::error::marked_strains(&rigid),
            crate::error::marked_strains(&section.rate.rigid())
        )));
    }
    let mobility = section
        .rate
        .rate(s, &unloaded.strain, &Resultant::zeros())?
        .by_overstress;
    Ok([mobility, unloaded.compliance.matrix()])
}

fn node(
    section: &Viscoelastic,
    length: f64,
    s: f64,
    weight: f64,
    carried: [bool; 6],
) -> Result<Node> {
    let [mobility, compliance] = compliances(section, s)?;
    let rigid = section.rate.rigid();
    let tangent = inverse_of_free(&compliance, rigid).ok_or_else(flat)?;
    let free: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
    let block = |matrix: &Matrix6<f64>| {
        DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])])
    };
    let root = block(&mobility).cholesky().ok_or_else(flat)?.l();
    let mut springs = block(&tangent);
    let factors: Vec<DMatrix<f64>> = section
        .branches
        .iter()
        .map(|branch| factor(&block(&branch.modulus)))
        .collect::<Option<_>>()
        .ok_or_else(flat)?;
    let more: usize = factors.iter().map(|factor| factor.ncols()).sum();
    let (few, all) = (free.len(), free.len() + more);
    // Strains and dashpots: springs K, roots of the mobility.
    let mut joined = DMatrix::identity(all, all);
    let mut roots = DMatrix::identity(all, all);
    roots.view_mut((0, 0), (few, few)).copy_from(&root);
    let mut first = few;
    for (factor, branch) in factors.iter().zip(&section.branches) {
        let count = factor.ncols();
        springs += factor * factor.transpose();
        joined
            .view_mut((0, first), (few, count))
            .copy_from(&-factor);
        joined
            .view_mut((first, 0), (count, few))
            .copy_from(&-factor.transpose());
        for k in first..first + count {
            roots[(k, k)] = branch.time.sqrt().recip();
        }
        first += count;
    }
    joined.view_mut((0, 0), (few, few)).copy_from(&springs);
    let retarded = roots.transpose() * joined * &roots;
    let retarded = 0.5 * (&retarded + retarded.transpose());
    let eigen = retarded
        .try_symmetric_eigen(f64::EPSILON, 1000)
        .ok_or_else(flat)?;
    if !eigen.eigenvalues.iter().all(|rate| 0.0 < *rate) {
        return Err(flat());
    }
    let arm = length - s;
    let mut transfer = Matrix6::identity();
    (transfer[(0, 4)], transfer[(1, 3)]) = (-arm, arm);
    for k in (0..6).filter(|k| !carried[*k]) {
        transfer.column_mut(k).fill(0.0);
    }
    let moving = ModalLoads::from_fn_generic(Dyn(all), U6, |i, j| {
        free.get(i).map_or(0.0, |k| transfer[(*k, j)])
    });
    Ok(Node {
        s,
        weight,
        rates: eigen.eigenvalues.iter().copied().collect(),
        load: (roots * eigen.eigenvectors).transpose() * moving,
    })
}

/// F with F F^T = modulus, as many columns as its rank. Scaled to a unit diagonal, so that the result does not depend
/// on units.
fn factor(modulus: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let roots = modulus.diagonal().map(|entry| entry.max(0.0).sqrt());
    let scaled = modulus.map_with_location(|i, j, entry| match roots[i] * roots[j] {
        0.0 => 0.0,
        size => entry / size,
    });
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let kept: Vec<usize> = (0..roots.len())
        .filter(|k| eigen.eigenvalues[*k] > 1e-14)
        .collect();
    Some(DMatrix::from_fn(roots.len(), kept.len(), |i, k| {
        roots[i] * eigen.eigenvectors[(i, kept[k])] * eigen.eigenvalues[kept[k]].sqrt()
    }))
}
