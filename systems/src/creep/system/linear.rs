//! The Jacobian of the equations of strains, memory and body, and its factors.

use super::{Hold, Layout};
use crate::body::EndLinear;
use crate::creep::kinematics::AtEnd;
use crate::creep::place;
use crate::creep::reduced::{Linear, loose, solve};
use crate::solve::lu::Lu;
use crate::solve::system::{Factor, Linearised, Scalar};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Rounding of a pose, relative to the rod's length.
const POSE: f64 = 5e-16;

/// The Jacobian of a [`ViscousSystem`](super::ViscousSystem): blocks by node, of the rank of the end's velocities, and the geometry.
#[derive(Debug, Clone)]
pub struct ViscousLinear<const M: usize, const D: usize> {
    pub(super) layout: Layout,
    pub(super) rod: Linear<M, D>,
    /// For every Maxwell branch: d e_t/d z at the nodes, and its relaxation time.
    pub(super) relaxing: Vec<(Vec<SMatrix<f64, M, M>>, f64)>,
    pub(super) body: EndLinear<D>,
    pub(super) spin: SMatrix<f64, D, D>,
    pub(super) place: Vec<f64>,
    pub(super) hold: Hold,
}

/// sigma - J without the memory and the velocity, which are eliminated: strains and end wrench remain.
#[derive(Debug)]
pub struct ViscousFactor<T, const M: usize, const D: usize> {
    layout: Layout,
    hold: Hold,
    sigma: T,
    /// sigma - a_V and sigma - spin.
    damped: SMatrix<T, D, D>,
    turning: SMatrix<T, D, D>,
    gather: DMatrix<f64>,
    convection: DMatrix<f64>,
    relaxing: Vec<(Vec<SMatrix<f64, M, M>>, f64)>,
    place: Vec<f64>,
    lu: Lu,
    rows: Vec<f64>,
    wrench: f64,
}

impl<const M: usize, const D: usize> Linearised for ViscousLinear<M, D> {
    type Factor<T: Scalar> = ViscousFactor<T, M, D>;

    /// With the change of velocity dV = follow de - b_l the strains and the wrench obey
    /// ```text
    /// (sigma - drift - sum_k relaxing_k/(1 + sigma tau_k)) de - push dw = b_e + ...
    /// ((sigma - a_V) follow - a_pose gather) de + a_w dw = b_V + (sigma - a_V) b_l.
    /// ```
    /// By velocity, de_t = sigma de - b_e makes follow = sigma gather + convection, b_l = gather b_e. By place, the change
    /// of place dr = gather de - b_c makes follow = (sigma - spin) gather, b_l = (sigma - spin) b_c + b_r.
    fn shifted<T: Scalar>(&self, sigma: T) -> Option<ViscousFactor<T, M, D>> {
        let n = self.layout.field();
        let real = T::from_real;
        let mut matrix = DMatrix::<T>::zeros(n + D, n + D);
        let largest = self.rod.push.amax();
        let wrench = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        let fill = |column: &mut [T], rates: &[f64], factor: f64| {
            for (entry, rate) in column.iter_mut().zip(rates) {
                *entry = real(-rate * factor);
            }
        };
        let (damped, turning) = (self.damped(sigma), self.turning(sigma));
        // By place, and as far as it stands in sigma by velocity too, the rows of the body are these times gather.
        let follows = match self.hold {
            Hold::Place => damped * turning,
            Hold::Velocity | Hold::Together => damped * sigma,
        } - self.body.by_pose.map(real);
        let rates = self.rod.drift.as_slice().chunks_exact(n.max(1));
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
            fill(column, push.as_slice(), wrench);
            fill(
                &mut column[n..],
                self.body.by_wrench.column(j).as_slice(),
                -wrench,
            );
        }
        for (blocks, time) in &self.relaxing {
            let share = T::one() / (T::one() + sigma * real(*time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    matrix[(node * M + i, node * M + j)] -= real(block[(i, j)]) * share;
                }
            }
        }
        // Rows are scaled to one size: those of the strains are rates, those of the body forces over masses.
        let mut rows = vec![0.0_f64; n + D];
        for column in matrix.as_slice().chunks_exact(n + D) {
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
        for column in matrix.as_mut_slice().chunks_exact_mut(n + D) {
            for (entry, row) in column.iter_mut().zip(&rows) {
                *entry = entry.scale(*row);
            }
        }
        Some(ViscousFactor {
            layout: self.layout,
            hold: self.hold,
            sigma,
            damped,
            turning,
            gather: self.rod.gather.clone(),
            convection: self.rod.convection.clone(),
            relaxing: self.relaxing.clone(),
            place: self.place.clone(),
            lu: Lu::new(&matrix)?,
            rows,
            wrench,
        })
    }

    /// Where an end wrench moves the end slowly (an inextensible rod that is nearly straight, by an angle a) the velocity
    /// relaxes fast, at the rate of M^-1 G^-1 ~ 1/a^2. By velocity the strain rates take over the rounding of the wrench
    /// 1/a times; by place the velocity takes over that of the pose at that rate, or of the pose over a step.
    fn rounding(&self, h: f64) -> f64 {
        let g = (&self.rod.gather * &self.rod.push)
            .fixed_view::<D, D>(0, 0)
            .into_owned();
        let rate = relaxation(&self.body.by_wrench, &g);
        POSE * match self.hold {
            Hold::Velocity | Hold::Together => rate.sqrt(),
            Hold::Place => rate.min(1.0 / h),
        }
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let layout = self.layout;
        let n = layout.field();
        let mut out = DVector::zeros(x.len());
        let e = x.rows(0, n);
        let mut rate = &self.rod.drift * e;
        for (k, (blocks, time)) in self.relaxing.iter().enumerate() {
            let z = x.rows((k + 1) * n, n);
            for (node, block) in blocks.iter().enumerate() {
                let pull = block * z.fixed_rows::<M>(node * M);
                let mut at = rate.fixed_rows_mut::<M>(node * M);
                at += pull;
            }
            out.rows_mut((k + 1) * n, n).copy_from(&((e - z) / *time));
        }
        let v = x.fixed_rows::<D>(layout.velocity()).into_owned();
        let missing = v - &self.rod.convection * e - &self.rod.gather * &rate;
        let g = (&self.rod.gather * &self.rod.push)
            .fixed_view::<D, D>(0, 0)
            .into_owned();
        if loose(&g).next().is_some() {
            // The velocity along a straight inextensible rod relaxes at once.
            out.fill(f64::INFINITY);
            return out;
        }
        let w = solve(&g, &AtEnd::<D>::from_column_slice(missing.as_slice()))
            .unwrap_or_else(AtEnd::zeros);
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

    /// sigma - spin, which takes a change of the end's place to that of its velocity (see [`place::spin`]).
    fn turning<T: Scalar>(&self, sigma: T) -> SMatrix<T, D, D> {
        SMatrix::from_diagonal_element(sigma) - self.spin.map(T::from_real)
    }
}

/// The rate M^-1 G^-1 at which the velocity of the end relaxes to the one that strains and loads determine.
pub(super) fn relaxation<const D: usize>(
    by_wrench: &SMatrix<f64, D, D>,
    g: &SMatrix<f64, D, D>,
) -> f64 {
    let unit = |j: usize| AtEnd::<D>::from_fn(|i, _| f64::from(u8::from(i == j)));
    (0..D)
        .filter_map(|j| Some((by_wrench * solve(g, &unit(j))?).norm()))
        .fold(0.0, f64::max)
}

fn pairs<const M: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..M).flat_map(|i| (0..M).map(move |j| (i, j)))
}

impl<T: Scalar, const M: usize, const D: usize> Factor<T> for ViscousFactor<T, M, D> {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let (layout, relaxing) = (self.layout, &self.relaxing);
        let n = layout.field();
        let (velocity, time) = (layout.velocity(), layout.time());
        let real = T::from_real;
        let mut right = DVector::<T>::zeros(n + D);
        right.rows_mut(0, n).copy_from(&b.rows(0, n));
        for (k, (blocks, time)) in relaxing.iter().enumerate() {
            // dz = (b_z + de/tau)/(sigma + 1/tau)
            let share = T::one() / (self.sigma + real(1.0 / time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    right[node * M + i] +=
                        real(block[(i, j)]) * share * b[(k + 1) * n + node * M + j];
                }
            }
        }
        let placed = layout.place()..layout.wrench();
        let gathered = |field: &[T]| {
            let mut sum = SMatrix::<T, D, 1>::zeros();
            for (column, x) in self.gather.column_iter().zip(field) {
                for (sum, g) in sum.iter_mut().zip(column.iter()) {
                    *sum += real(*g) * *x;
                }
            }
            sum
        };
        let (moved, grown) = place::split::<T, D>(&self.place, &b.as_slice()[placed.clone()]);
        let missed = -b.fixed_rows::<D>(layout.wrench()).into_owned();
        let turning = self.turning;
        let lag = match self.hold {
            Hold::Place => turning * missed + moved,
            Hold::Velocity => gathered(&b.as_slice()[..n]),
            Hold::Together => gathered(&b.as_slice()[..n]) + missed,
        };
        let pushed = b.fixed_rows::<D>(velocity).into_owned() + self.damped * lag;
        right.rows_mut(n, D).copy_from(&pushed);
        for (value, row) in right.iter_mut().zip(&self.rows) {
            *value *= real(*row);
        }
        if !self.lu.solve(&mut right) {
            return false;
        }
        let followed = gathered(&right.as_slice()[..n]);
        let (v, twist) = match self.hold {
            Hold::Place => (turning * followed - lag, followed - missed),
            Hold::Velocity | Hold::Together => {
                let mut v = followed * self.sigma - lag;
                for (column, x) in self.convection.column_iter().zip(right.iter()) {
                    for (v, c) in v.iter_mut().zip(column.iter()) {
                        *v += real(*c) * *x;
                    }
                }
                (v, (moved + v) / self.sigma)
            }
        };
        b.fixed_rows_mut::<D>(velocity).copy_from(&v);
        for (k, (_, time)) in relaxing.iter().enumerate() {
            let share = T::one() / (self.sigma + real(1.0 / time));
            for j in 0..n {
                let at = (k + 1) * n + j;
                b[at] = (b[at] + right[j] * real(1.0 / time)) * share;
            }
        }
        b.rows_mut(0, n).copy_from(&right.rows(0, n));
        for i in time..layout.place() {
            b[i] /= self.sigma;
        }
        let slots = &mut b.as_mut_slice()[placed];
        place::join(&self.place, &twist, grown / self.sigma, slots);
        for i in 0..D {
            let wrench = &mut b[layout.wrench() + i];
            *wrench = match self.hold {
                Hold::Velocity => *wrench / self.sigma,
                Hold::Together | Hold::Place => right[n + i] * real(self.wrench),
            };
        }
        b.iter().all(|x| x.is_finite())
    }
}
