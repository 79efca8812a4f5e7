//! Sparse elimination of matrices of small blocks, one row of blocks for each site.
//!
//! Sites are eliminated in the order of fewest neighbours. Along a chain of elements the cost is linear in their
//! number; closed loops and joints add little. Diagonal blocks are inverted with pivots of their own: the masses in
//! the matrix are large enough beside the stiffness for that.

use crate::math::small_matrices::Scalar;
use nalgebra::SMatrix;

/// Blocks of a matrix of sites: their places, and the order of elimination.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// Sites in the order of elimination.
    order: Vec<usize>,
    /// For each site, in the order of the sites: blocks of its row right of the diagonal, by growing order of
    /// elimination, as (site, number of the block of the row, number of the block of the column).
    later: Vec<Vec<SiteLink>>,
    /// Number of blocks; the first ones are diagonal.
    blocks: usize,
    /// For the elimination of each site: blocks changed, as (changed, of the column, of the row).
    updates: Vec<Vec<[usize; 3]>>,
}

#[derive(Debug, Clone, Copy)]
struct SiteLink {
    site: usize,
    above: usize,
    below: usize,
}

impl Pattern {
    /// Pattern of a matrix of `sites` sites, with a block for every pair of sites in one clique.
    pub fn new(sites: usize, cliques: &[Vec<usize>]) -> Self {
        let mut near = vec![std::collections::BTreeSet::new(); sites];
        for clique in cliques {
            for a in clique {
                near[*a].extend(clique.iter().copied().filter(|b| b != a));
            }
        }
        let mut place = vec![usize::MAX; sites];
        let mut order = Vec::with_capacity(sites);
        let mut rows = vec![Vec::new(); sites];
        for step in 0..sites {
            let open = (0..sites).filter(|i| place[*i] == usize::MAX);
            let Some(next) = open.min_by_key(|i| near[*i].len()) else {
                break;
            };
            (place[next], rows[next]) = (step, near[next].iter().copied().collect());
            order.push(next);
            let around = std::mem::take(&mut near[next]);
            for a in &around {
                near[*a].remove(&next);
                near[*a].extend(around.iter().copied().filter(|b| b != a));
            }
        }
        let mut blocks = sites;
        let mut later: Vec<Vec<SiteLink>> = Vec::with_capacity(sites);
        for row in &mut rows {
            row.sort_by_key(|site| place[*site]);
            let links = row.iter().map(|site| {
                blocks += 2;
                SiteLink {
                    site: *site,
                    above: blocks - 2,
                    below: blocks - 1,
                }
            });
            later.push(links.collect());
        }
        let mut pattern = Self {
            order,
            later,
            blocks,
            updates: Vec::new(),
        };
        let updates = (0..sites).map(|site| {
            let row = &pattern.later[site];
            let pairs = row.iter().flat_map(|a| row.iter().map(move |b| (a, b)));
            let changed = pairs.map(|(a, b)| [pattern.block(a.site, b.site), a.below, b.above]);
            changed.collect()
        });
        pattern.updates = updates.collect();
        pattern
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// Number of the block of two sites of one clique.
    pub fn block(&self, row: usize, column: usize) -> usize {
        if row == column {
            return row;
        }
        let find = |from: usize, to: usize| self.later[from].iter().find(|link| link.site == to);
        match (find(row, column), find(column, row)) {
            (Some(link), _) => link.above,
            (None, Some(link)) => link.below,
            (None, None) => usize::MAX,
        }
    }

    /// y += A x for a real matrix of blocks.
    pub fn add_scaled<T: Scalar, const D: usize>(
        &self,
        matrix: &[SMatrix<f64, D, D>],
        x: &[NodeColumn<T, D>],
        y: &mut [NodeColumn<T, D>],
    ) {
        let add = |y: &mut NodeColumn<T, D>, m: &SMatrix<f64, D, D>, x: &NodeColumn<T, D>| {
            for i in 0..D {
                for j in 0..D {
                    y[i] += x[j] * T::from_real(m[(i, j)]);
                }
            }
        };
        for (site, links) in self.later.iter().enumerate() {
            add(&mut y[site], &matrix[site], &x[site]);
            for link in links {
                add(&mut y[site], &matrix[link.above], &x[link.site]);
                add(&mut y[link.site], &matrix[link.below], &x[site]);
            }
        }
    }

    /// y += A x for a matrix of blocks.
    pub fn add_product<const D: usize>(
        &self,
        matrix: &[SMatrix<f64, D, D>],
        x: &[nalgebra::SVector<f64, D>],
        y: &mut [nalgebra::SVector<f64, D>],
    ) {
        for (site, links) in self.later.iter().enumerate() {
            y[site] += matrix[site] * x[site];
            for link in links {
                y[site] += matrix[link.above] * x[link.site];
                y[link.site] += matrix[link.below] * x[site];
            }
        }
    }
}

type NodeBlock<T, const D: usize> = [[T; D]; D];
type NodeColumn<T, const D: usize> = [T; D];

/// a -= b c.
#[inline]
fn subtract<T: Scalar, const D: usize>(
    a: &mut NodeBlock<T, D>,
    b: &NodeBlock<T, D>,
    c: &NodeBlock<T, D>,
) {
    for i in 0..D {
        for k in 0..D {
            let factor = b[i][k];
            for j in 0..D {
                a[i][j] -= factor * c[k][j];
            }
        }
    }
}

/// a -= b x.
#[inline]
fn subtract_from<T: Scalar, const D: usize>(
    a: &mut NodeColumn<T, D>,
    b: &NodeBlock<T, D>,
    x: &NodeColumn<T, D>,
) {
    for i in 0..D {
        for j in 0..D {
            a[i] -= b[i][j] * x[j];
        }
    }
}

/// Inverse by Gauss-Jordan with pivots in columns; None if singular.
fn inverse<T: Scalar, const D: usize>(mut a: NodeBlock<T, D>) -> Option<NodeBlock<T, D>> {
    let mut out = [[T::zero(); D]; D];
    for (i, row) in out.iter_mut().enumerate() {
        row[i] = T::one();
    }
    for k in 0..D {
        let size = |i: &usize| a[*i][k].modulus();
        let pivot = (k..D).max_by(|i, j| size(i).total_cmp(&size(j)))?;
        let largest = size(&pivot);
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        a.swap(k, pivot);
        out.swap(k, pivot);
        let scale = T::one() / a[k][k];
        for j in 0..D {
            a[k][j] *= scale;
            out[k][j] *= scale;
        }
        for i in (0..D).filter(|i| *i != k) {
            let factor = a[i][k];
            for j in 0..D {
                let (above, right) = (a[k][j], out[k][j]);
                a[i][j] -= factor * above;
                out[i][j] -= factor * right;
            }
        }
    }
    Some(out)
}

/// Factors of a matrix of blocks of size D.
#[derive(Debug)]
pub struct BlockLu<T: Scalar, const D: usize> {
    blocks: Vec<NodeBlock<T, D>>,
}

impl<T: Scalar, const D: usize> BlockLu<T, D> {
    /// Factors of a sum of real matrices, each times a number; None if singular.
    pub fn new(pattern: &Pattern, parts: &[(T, &[SMatrix<f64, D, D>])]) -> Option<Self> {
        let mut blocks = vec![[[T::zero(); D]; D]; pattern.blocks];
        for (factor, part) in parts {
            for (block, part) in blocks.iter_mut().zip(*part) {
                for (i, row) in block.iter_mut().enumerate() {
                    for (j, x) in row.iter_mut().enumerate() {
                        *x += *factor * T::from_real(part[(i, j)]);
                    }
                }
            }
        }
        for site in &pattern.order {
            blocks[*site] = inverse(blocks[*site])?;
            let own = blocks[*site];
            for link in &pattern.later[*site] {
                let mut solved = [[T::zero(); D]; D];
                subtract(&mut solved, &own, &blocks[link.above]);
                for x in solved.iter_mut().flatten() {
                    *x = -*x;
                }
                blocks[link.above] = solved;
            }
            for [changed, below, above] in &pattern.updates[*site] {
                let (below, above) = (blocks[*below], blocks[*above]);
                subtract(&mut blocks[*changed], &below, &above);
            }
        }
        Some(Self { blocks })
    }

    /// Overwrites the right-hand side by the solution.
    pub fn solve(&self, pattern: &Pattern, b: &mut [NodeColumn<T, D>]) {
        for site in &pattern.order {
            let mut own = [T::zero(); D];
            subtract_from(&mut own, &self.blocks[*site], &b[*site]);
            own.iter_mut().for_each(|x| *x = -*x);
            b[*site] = own;
            for link in &pattern.later[*site] {
                subtract_from(&mut b[link.site], &self.blocks[link.below], &own);
            }
        }
        for site in pattern.order.iter().rev() {
            let mut own = b[*site];
            for link in &pattern.later[*site] {
                subtract_from(&mut own, &self.blocks[link.above], &b[link.site]);
            }
            b[*site] = own;
        }
    }
}

impl<const D: usize> BlockLu<f64, D> {
    /// True if the factored matrix, which is symmetric, is positive definite: all pivots are.
    pub fn is_positive(&self, pattern: &Pattern) -> bool {
        pattern.order.iter().all(|site| {
            let own = &self.blocks[*site];
            let inverse = SMatrix::<f64, D, D>::from_fn(|i, j| 0.5 * (own[i][j] + own[j][i]));
            inverse.cholesky().is_some()
        })
    }
}
