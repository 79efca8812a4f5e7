//! The Jacobian of the equations of strains, memory and body, and its factors.

use super::{Hold, Layout};
use crate::body::EndLinear;
use crate::math::small_matrices::{add_times, times};
use crate::solve::lu::Lu;
use crate::solve::system::{Factor, Linearised, Scalar};
use crate::viscoelastic::end_pose;
use crate::viscoelastic::kinematics::AtEnd;
use crate::viscoelastic::reduced::{Drift, Linear, loose, solve};
use nalgebra::{DMatrix, DVector, SMatrix};
use std::sync::Arc;

/// Rounding of a pose, relative to the rod's length.
const POSE: f64 = 5e-16;

/// Jacobian of a [`ViscousSystem`](super::ViscousSystem): blocks by node, terms of the rank of the end's velocities,
/// and geometry.
#[derive(Debug, Clone)]
pub struct ViscousLinear<const M: usize, const D: usize> {
    pub(super) layout: Layout,
    pub(super) rod: Arc<Linear<M, D>>,
    /// G of AMV (5.10).
    pub(super) mobility: SMatrix<f64, D, D>,
    pub(super) relaxing: Arc<[Relaxing<M>]>,
    pub(super) body: EndLinear<D>,
    pub(super) spin: SMatrix<f64, D, D>,
    pub(super) place: Arc<[f64]>,
    pub(super) hold: Hold,
}

/// A Maxwell branch: d e_t/d z at the nodes, and its relaxation time.
pub(super) type Relaxing<const M: usize> = (Vec<SMatrix<f64, M, M>>, f64);

/// Factors of sigma - J with memory and velocity eliminated: strains and end wrench remain.
#[derive(Debug)]
pub struct ViscousFactor<T, const M: usize, const D: usize> {
    linear: ViscousLinear<M, D>,
    sigma: T,
    /// Matrices sigma - a_V and sigma - spin.
    damped: SMatrix<T, D, D>,
    turning: SMatrix<T, D, D>,
    /// Factor of gather in the rows of the body.
    follows: SMatrix<T, D, D>,
    solver: Solver<T, M, D>,
    /// Unit of the wrench.
    unit: f64,
}

/// Solver for strains and wrench.
#[derive(Debug)]
enum Solver<T, const M: usize, const D: usize> {
    /// LU factors of the full matrix. Its rows are scaled to one size: rows of strains are rates, rows of the body
    /// forces over masses.
    Whole { lu: Lu, rows: Vec<f64> },
    /// Block elimination: inverses of the nodes' own blocks ([`Drift::Local`]), and of the Schur complement of the
    /// wrench.
    Local {
        blocks: Vec<SMatrix<T, M, M>>,
        wrench: SMatrix<T, D, D>,
    },
}

impl<T: Scalar, const M: usize, const D: usize> Solver<T, M, D> {
    /// Factors of a full matrix; None if singular.
    fn whole(mut matrix: DMatrix<T>) -> Option<Self> {
        let n = matrix.nrows();
        let mut rows = vec![0.0_f64; n];
        for column in matrix.as_slice().chunks_exact(n) {
            for (size, entry) in rows.iter_mut().zip(column) {
                *size = size.max(entry.norm1());
            }
        }
        for size in &mut rows {
            if !(*size > 0.0 && size.is_finite()) {
                return None;
            }
            *size = 1.0 / *size;
        }
        for column in matrix.as_mut_slice().chunks_exact_mut(n) {
            for (entry, row) in column.iter_mut().zip(&rows) {
                *entry = entry.scale(*row);
            }
        }
        Some(Self::Whole {
            lu: Lu::new(&matrix)?,
            rows,
        })
    }
}

impl<const M: usize, const D: usize> Linearised for ViscousLinear<M, D> {
    type Factor<T: Scalar> = ViscousFactor<T, M, D>;

    /// With the change of velocity dV = follow de - b_l the strains and the wrench obey
    /// ```text
    /// (sigma - drift - sum_k relaxing_k/(1 + sigma tau_k)) de - push dw = b_e + ...
    /// ((sigma - a_V) follow - a_pose gather) de + a_w dw = b_V + (sigma - a_V) b_l.
    /// ```
    /// By velocity, de_t = sigma de - b_e makes follow = sigma gather + convection, b_l = gather b_e. By place, the
    /// change of place dr = gather de - b_c makes follow = (sigma - spin) gather, b_l = (sigma - spin) b_c + b_r.
    fn shifted<T: Scalar>(&self, sigma: T) -> Option<ViscousFactor<T, M, D>> {
        let real = T::from_real;
        let largest = self.rod.push.amax();
        let unit = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        let (damped, turning) = (self.damped(sigma), self.turning(sigma));
        // The rows of the body are these times gather: by place entirely, by velocity in the terms with sigma.
        let follows = match self.hold {
            Hold::Place => damped * turning,
            Hold::Velocity | Hold::Together => damped * sigma,
        } - self.body.by_pose.map(real);
        let solver = match &self.rod.drift {
            Drift::Whole(drift) => {
                Solver::whole(self.whole(drift, sigma, &follows, &damped, unit))?
            }
            Drift::Local(own) => {
                let blocks = self.inverted(own, sigma)?;
                let condensed = self.condensed(&blocks, &follows, &damped);
                Solver::Local {
                    blocks,
                    wrench: condensed.scale(unit).try_inverse()?,
                }
            }
        };
        Some(ViscousFactor {
            linear: self.clone(),
            sigma,
            damped,
            turning,
            follows,
            solver,
            unit,
        })
    }

    /// Rounding of a velocity. If a wrench moves the end slowly (a nearly straight inextensible rod, at an angle a),
    /// the velocity relaxes fast, at the rate of M^-1 G^-1 ~ 1/a^2. By velocity the strain rates inherit the rounding
    /// of the wrench times 1/a. By place the velocity inherits that of the pose, at that rate or over a step.
    fn rounding(&self, h: f64) -> f64 {
        let rate = relaxation(&self.body.by_wrench, &self.mobility);
        POSE * match self.hold {
            Hold::Velocity | Hold::Together => rate.sqrt(),
            Hold::Place => rate.min(1.0 / h),
        }
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let layout = self.layout;
        let n = layout.field();
        let mut out = DVector::zeros(x.len());
        let e = x.rows(0, n).into_owned();
        let mut rate = self.rod.drift.times(&e);
        for (k, (blocks, time)) in self.relaxing.iter().enumerate() {
            let z = x.rows((k + 1) * n, n);
            for (node, block) in blocks.iter().enumerate() {
                let pull = block * z.fixed_rows::<M>(node * M);
                let mut at = rate.fixed_rows_mut::<M>(node * M);
                at += pull;
            }
            out.rows_mut((k + 1) * n, n).copy_from(&((&e - z) / *time));
        }
        let v = x.fixed_rows::<D>(layout.velocity()).into_owned();
        let missing = v - &self.rod.convection * &e - &self.rod.gather * &rate;
        if loose(&self.mobility).next().is_some() {
            // The velocity along a straight inextensible rod relaxes at once.
            out.fill(f64::INFINITY);
            return out;
        }
        let missing = AtEnd::<D>::from_column_slice(missing.as_slice());
        let w = solve(&self.mobility, &missing).unwrap_or_else(AtEnd::zeros);
        rate += &self.rod.push * w;
        out.rows_mut(0, n).copy_from(&rate);
        let moved = AtEnd::<D>::from_column_slice((&self.rod.gather * e).as_slice());
        let acceleration =
            self.body.by_pose * moved + self.body.by_velocity * v - self.body.by_wrench * w;
        out.fixed_rows_mut::<D>(layout.velocity())
            .copy_from(&acceleration);
        out
    }
}

impl<const M: usize, const D: usize> ViscousLinear<M, D> {
    /// sigma - a_V, where a_V is the change of the end's acceleration with its velocity.
    fn damped<T: Scalar>(&self, sigma: T) -> SMatrix<T, D, D> {
        SMatrix::from_diagonal_element(sigma) - self.body.by_velocity.map(T::from_real)
    }

    /// sigma - spin: from changes of the end's place to changes of its velocity (see [`end_pose::spin`]).
    fn turning<T: Scalar>(&self, sigma: T) -> SMatrix<T, D, D> {
        SMatrix::from_diagonal_element(sigma) - self.spin.map(T::from_real)
    }

    /// Full matrix of strains and wrench.
    fn whole<T: Scalar>(
        &self,
        drift: &DMatrix<f64>,
        sigma: T,
        follows: &SMatrix<T, D, D>,
        damped: &SMatrix<T, D, D>,
        unit: f64,
    ) -> DMatrix<T> {
        let n = self.layout.field();
        let real = T::from_real;
        let mut matrix = DMatrix::<T>::zeros(n + D, n + D);
        let fill = |column: &mut [T], rates: &[f64], factor: f64| {
            for (entry, rate) in column.iter_mut().zip(rates) {
                *entry = real(-rate * factor);
            }
        };
        let rates = drift.as_slice().chunks_exact(n.max(1));
        let columns = matrix.as_mut_slice().chunks_exact_mut(n + D);
        for (j, (column, rates)) in columns.zip(rates).enumerate() {
            let (strains, end) = column.split_at_mut(n);
            fill(strains, rates, 1.0);
            strains[j] += sigma;
            let mut row = follows * self.rod.gather.fixed_view::<D, 1>(0, j).map(real);
            if self.hold != Hold::Place {
                row += damped * self.rod.convection.fixed_view::<D, 1>(0, j).map(real);
            }
            end.copy_from_slice(row.as_slice());
        }
        for (j, push) in self.rod.push.column_iter().enumerate() {
            let column = &mut matrix.as_mut_slice()[(n + j) * (n + D)..];
            fill(column, push.as_slice(), unit);
            fill(
                &mut column[n..],
                self.body.by_wrench.column(j).as_slice(),
                -unit,
            );
        }
        for (blocks, time) in &*self.relaxing {
            let share = T::one() / (T::one() + sigma * real(*time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    matrix[(node * M + i, node * M + j)] -= real(block[(i, j)]) * share;
                }
            }
        }
        matrix
    }

    /// Inverses of the nodes' blocks.
    fn inverted<T: Scalar>(
        &self,
        own: &[SMatrix<f64, M, M>],
        sigma: T,
    ) -> Option<Vec<SMatrix<T, M, M>>> {
        let real = T::from_real;
        let inverses = own.iter().enumerate().map(|(node, own)| {
            let mut block = SMatrix::from_diagonal_element(sigma) - own.map(real);
            for (blocks, time) in &*self.relaxing {
                let share = T::one() / (T::one() + sigma * real(*time));
                block -= blocks[node].map(|x| real(x) * share);
            }
            block.try_inverse()
        });
        inverses.collect()
    }

    /// Schur complement of the wrench, with the strains' response put into the rows of the body.
    fn condensed<T: Scalar>(
        &self,
        blocks: &[SMatrix<T, M, M>],
        follows: &SMatrix<T, D, D>,
        damped: &SMatrix<T, D, D>,
    ) -> SMatrix<T, D, D> {
        let n = self.layout.field();
        let rod = &self.rod;
        let (mut moved, mut convected) = (SMatrix::zeros(), SMatrix::zeros());
        let pushing = rod.push.as_slice();
        for (i, block) in blocks.iter().enumerate() {
            let mut strained = SMatrix::<T, M, D>::zeros();
            for (j, push) in pushing.chunks_exact(n).enumerate() {
                for (k, push) in push[i * M..(i + 1) * M].iter().enumerate() {
                    for l in 0..M {
                        strained[(l, j)] = strained[(l, j)].plus_scaled(*push, block[(l, k)]);
                    }
                }
            }
            add_moved(&rod.gather, i, &strained, &mut moved);
            if self.hold != Hold::Place {
                add_moved(&rod.convection, i, &strained, &mut convected);
            }
        }
        let real = T::from_real;
        let mut condensed = self.body.by_wrench.map(real);
        add_times(&mut condensed, follows, &moved);
        if self.hold != Hold::Place {
            add_times(&mut condensed, damped, &convected);
        }
        condensed
    }
}

/// Rate M^-1 G^-1 at which the velocity of the end relaxes to that determined by strains and loads.
pub(super) fn relaxation<const D: usize>(
    by_wrench: &SMatrix<f64, D, D>,
    g: &SMatrix<f64, D, D>,
) -> f64 {
    let inverse = solve(g, &SMatrix::<f64, D, D>::identity());
    let rates = by_wrench * inverse.unwrap_or_else(SMatrix::zeros);
    rates
        .column_iter()
        .map(|rate| rate.norm())
        .fold(0.0, f64::max)
}

fn pairs<const M: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..M).flat_map(|i| (0..M).map(move |j| (i, j)))
}

impl<T: Scalar, const M: usize, const D: usize> ViscousFactor<T, M, D> {
    /// Replaces the right-hand sides of the strains by their solution; returns the wrench, in its unit, for these and
    /// the body's right-hand side `pushed`.
    fn strained(&self, strains: &mut [T], pushed: &SMatrix<T, D, 1>) -> Option<SMatrix<T, D, 1>> {
        let n = strains.len();
        let (blocks, inverse) = match &self.solver {
            Solver::Whole { lu, rows } => {
                let mut right = DVector::<T>::zeros(n + D);
                right.as_mut_slice()[..n].copy_from_slice(strains);
                right.rows_mut(n, D).copy_from(pushed);
                for (value, row) in right.iter_mut().zip(rows) {
                    *value = value.scale(*row);
                }
                if !lu.solve(&mut right) {
                    return None;
                }
                strains.copy_from_slice(&right.as_slice()[..n]);
                return Some(right.fixed_rows::<D>(n).into_owned());
            }
            Solver::Local { blocks, wrench } => (blocks, wrench),
        };
        let rod = &self.linear.rod;
        for (strain, block) in strains.as_chunks_mut::<M>().0.iter_mut().zip(blocks) {
            *strain = times(block, &SMatrix::<T, M, 1>::from(*strain)).data.0[0];
        }
        let mut missing = *pushed;
        add_times(
            &mut missing,
            &self.follows,
            &-gathered(&rod.gather, strains),
        );
        if self.linear.hold != Hold::Place {
            let convected = gathered(&rod.convection, strains);
            add_times(&mut missing, &self.damped, &-convected);
        }
        let wrench = times(inverse, &missing);
        let pushing = rod.push.as_slice();
        let scaled = wrench.scale(self.unit);
        let places = strains.as_chunks_mut::<M>().0.iter_mut().zip(blocks);
        for (i, (strain, block)) in places.enumerate() {
            let mut rate = SMatrix::<T, M, 1>::zeros();
            for (column, w) in pushing.chunks_exact(n).zip(&scaled.data.0[0]) {
                for (rate, push) in rate.data.0[0].iter_mut().zip(&column[i * M..]) {
                    *rate = rate.plus_scaled(*push, *w);
                }
            }
            let mut sum = SMatrix::<T, M, 1>::from(*strain);
            add_times(&mut sum, block, &rate);
            *strain = sum.data.0[0];
        }
        Some(wrench)
    }
}

/// Adds the end's motion by the strains of a node, a column for each wrench.
fn add_moved<T: Scalar, const M: usize, const D: usize>(
    columns: &DMatrix<f64>,
    node: usize,
    strained: &SMatrix<T, M, D>,
    moved: &mut SMatrix<T, D, D>,
) {
    let gather = columns.as_slice()[node * M * D..].chunks_exact(D);
    for (k, gather) in gather.take(M).enumerate() {
        for j in 0..D {
            let strain = strained[(k, j)];
            for (moved, g) in moved.data.0[j].iter_mut().zip(gather) {
                *moved = moved.plus_scaled(*g, strain);
            }
        }
    }
}

/// Sum of the columns weighted by the numbers of a field.
fn gathered<T: Scalar, const D: usize>(columns: &DMatrix<f64>, field: &[T]) -> SMatrix<T, D, 1> {
    let mut sum = SMatrix::<T, D, 1>::zeros();
    for (column, x) in columns.as_slice().as_chunks::<D>().0.iter().zip(field) {
        for (sum, g) in sum.data.0[0].iter_mut().zip(column) {
            *sum = sum.plus_scaled(*g, *x);
        }
    }
    sum
}

impl<T: Scalar, const M: usize, const D: usize> Factor<T> for ViscousFactor<T, M, D> {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let linear = &self.linear;
        let (layout, rod, hold) = (linear.layout, &linear.rod, linear.hold);
        let n = layout.field();
        let (velocity, time) = (layout.velocity(), layout.time());
        let real = T::from_real;
        let placed = layout.place()..layout.wrench();
        let (moved, grown) = end_pose::split::<T, D>(&linear.place, &b.as_slice()[placed.clone()]);
        let missed = -b.fixed_rows::<D>(layout.wrench()).into_owned();
        let turning = self.turning;
        let strains = || gathered(&rod.gather, &b.as_slice()[..n]);
        let lag = match hold {
            Hold::Place => times(&turning, &missed) + moved,
            Hold::Velocity => strains(),
            Hold::Together => strains() + missed,
        };
        let mut pushed = b.fixed_rows::<D>(velocity).into_owned();
        add_times(&mut pushed, &self.damped, &lag);
        for (k, (blocks, time)) in linear.relaxing.iter().enumerate() {
            // dz = (b_z + de/tau)/(sigma + 1/tau)
            let share = T::one() / (self.sigma + real(1.0 / time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    let stretched = b[(k + 1) * n + node * M + j];
                    b[node * M + i] += real(block[(i, j)]) * share * stretched;
                }
            }
        }
        let Some(wrench) = self.strained(&mut b.as_mut_slice()[..n], &pushed) else {
            return false;
        };
        let followed = gathered(&rod.gather, &b.as_slice()[..n]);
        let (v, twist) = match hold {
            Hold::Place => (times(&turning, &followed) - lag, followed - missed),
            Hold::Velocity | Hold::Together => {
                let convected = gathered(&rod.convection, &b.as_slice()[..n]);
                let v = followed * self.sigma - lag + convected;
                (v, (moved + v) / self.sigma)
            }
        };
        b.fixed_rows_mut::<D>(velocity).copy_from(&v);
        for (k, (_, time)) in linear.relaxing.iter().enumerate() {
            let share = T::one() / (self.sigma + real(1.0 / time));
            for j in 0..n {
                let at = (k + 1) * n + j;
                b[at] = (b[at] + b[j] * real(1.0 / time)) * share;
            }
        }
        for i in time..layout.place() {
            b[i] /= self.sigma;
        }
        let slots = &mut b.as_mut_slice()[placed];
        end_pose::join(&linear.place, &twist, grown / self.sigma, slots);
        for (place, wrench) in b.as_mut_slice()[layout.wrench()..]
            .iter_mut()
            .zip(wrench.iter())
        {
            *place = match hold {
                Hold::Velocity => *place / self.sigma,
                Hold::Together | Hold::Place => wrench.scale(self.unit),
            };
        }
        // No early exit: the loop then has no branches.
        (b.as_slice().iter()).fold(true, |finite, x| finite & x.is_finite())
    }
}
