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
    linear: ViscousLinear<M, D>,
    sigma: T,
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
        for j in 0..n {
            for i in 0..n {
                matrix[(i, j)] = real(-self.rod.drift[(i, j)]);
            }
            matrix[(j, j)] += sigma;
        }
        for (blocks, time) in &self.relaxing {
            let share = T::one() / (T::one() + sigma * real(*time));
            for (node, block) in blocks.iter().enumerate() {
                for (i, j) in pairs::<M>() {
                    matrix[(node * M + i, node * M + j)] -= real(block[(i, j)]) * share;
                }
            }
        }
        let largest = self.rod.push.amax();
        let wrench = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        for j in 0..D {
            for i in 0..n {
                matrix[(i, n + j)] = real(-self.rod.push[(i, j)] * wrench);
            }
            for i in 0..D {
                matrix[(n + i, n + j)] = real(self.body.by_wrench[(i, j)] * wrench);
            }
        }
        let (damped, turning) = (self.damped(sigma), self.turning(sigma));
        let by_pose = self.body.by_pose.map(real);
        for j in 0..n {
            let gather = self.rod.gather.fixed_view::<D, 1>(0, j).map(real);
            let follow = match self.hold {
                Hold::Place => turning * gather,
                Hold::Velocity | Hold::Together => {
                    gather * sigma + self.rod.convection.fixed_view::<D, 1>(0, j).map(real)
                }
            };
            let row = damped * follow - by_pose * gather;
            matrix.fixed_view_mut::<D, 1>(n, j).copy_from(&row);
        }
        // Rows are scaled to one size: those of the strains are rates, those of the body forces over masses.
        let mut rows = vec![0.0; n + D];
        for (i, row) in rows.iter_mut().enumerate() {
            let size = (0..n + D)
                .map(|j| matrix[(i, j)].norm1())
                .fold(0.0, f64::max);
            if !(size > 0.0 && size.is_finite()) {
                return None;
            }
            *row = 1.0 / size;
            for j in 0..n + D {
                matrix[(i, j)] *= real(*row);
            }
        }
        Some(ViscousFactor {
            linear: self.clone(),
            sigma,
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
        let linear = &self.linear;
        let (layout, relaxing) = (linear.layout, &linear.relaxing);
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
            for (column, x) in linear.rod.gather.column_iter().zip(field) {
                for (sum, g) in sum.iter_mut().zip(column.iter()) {
                    *sum += real(*g) * *x;
                }
            }
            sum
        };
        let (moved, grown) = place::split::<T, D>(&linear.place, &b.as_slice()[placed.clone()]);
        let missed = -b.fixed_rows::<D>(layout.wrench()).into_owned();
        let turning = linear.turning(self.sigma);
        let lag = match linear.hold {
            Hold::Place => turning * missed + moved,
            Hold::Velocity => gathered(&b.as_slice()[..n]),
            Hold::Together => gathered(&b.as_slice()[..n]) + missed,
        };
        let pushed = b.fixed_rows::<D>(velocity).into_owned() + linear.damped(self.sigma) * lag;
        right.rows_mut(n, D).copy_from(&pushed);
        for (value, row) in right.iter_mut().zip(&self.rows) {
            *value *= real(*row);
        }
        if !self.lu.solve(&mut right) {
            return false;
        }
        let followed = gathered(&right.as_slice()[..n]);
        let (v, twist) = match linear.hold {
            Hold::Place => (turning * followed - lag, followed - missed),
            Hold::Velocity | Hold::Together => {
                let mut v = followed * self.sigma - lag;
                for (column, x) in linear.rod.convection.column_iter().zip(right.iter()) {
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
        place::join(&linear.place, &twist, grown / self.sigma, slots);
        for i in 0..D {
            let wrench = &mut b[layout.wrench() + i];
            *wrench = match linear.hold {
                Hold::Velocity => *wrench / self.sigma,
                Hold::Together | Hold::Place => right[n + i] * real(self.wrench),
            };
        }
        b.iter().all(|x| x.is_finite())
    }
}
