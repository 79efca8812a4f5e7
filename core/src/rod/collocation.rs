//! End of a uniform linear rod and its tangent by Gauss collocation (theory Sec. 3): the initial-value problem of
//! `ivp`.
//!
//! On a step of length h the slopes k_i at the eight nodes of the Gauss rule satisfy
//!
//! ```text
//! z_i = z(s) + h sum_j a_ij k_j,   k_i = f(z_i),   z(s + h) = z(s) + h sum_j b_j k_j,   a_ij = int_0^{c_i} l_j,
//! ```
//!
//! of order 16 at the end. The slopes are iterated to convergence by sweeps that begin with the polynomials of the
//! step before. Sweeps are cheap, since the sections at the nodes are processed side by side as the lanes of wide
//! registers. Gauss methods keep quadratic invariants, such as |q|^2 = 1: the directors need no division.
//!
//! Vectors are given along axes of which the third is that of the force, n = (0, 0, |n|). The third component of m =
//! m(0) - r x n is then constant along the rod. Frame and place across the force, (q, r_1, r_2), are all that is
//! swept; for the tangent, four variables for each column (see `tangent`). The angle needed for the Morse index is
//! followed in `conjugate_angle`.

mod conjugate_angle;
mod tangent;

use super::ivp::{LineState, STEP_LIMIT, Wrench, integration_error, rate};
use super::scaled_law::ScaledLaw;
use crate::error::Result;
use crate::math::lanes8::{Eight, Extension, GaussRule};
use crate::math::registers::wide;
use crate::math::se3::{Turn, conjugate, product};
use crate::section::{Compliance, UniformLinear};
use crate::solve::cost::Cost;
use conjugate_angle::DeterminantAngle;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use pulp::{Simd, WithSimd};
use tangent::carry;

/// Number of sweeps beyond which a step is halved, and the number aimed at: longer steps need about proportionally
/// more. These, [`SAFETY`], [`ACCEPTED_EXCESS`] and the first step minimise the work for the nineteen uniform rods of
/// tests/data/rod_ivp.json at errors of 1e-7 and of 1e-10.
const MOST_SWEEPS: usize = 28;
const TARGET_SWEEPS: f64 = 15.0;

/// Step control: the coefficient of P_7 in the slopes that goes with the tolerance 1, fitted to the errors of these
/// rods; the part of the predicted step that is tried next; the largest ratio of the coefficient to its goal at which
/// a step is accepted.
const P7_PER_TOLERANCE: f64 = 4.0;
const SAFETY: f64 = 0.75;
const ACCEPTED_EXCESS: f64 = 1.5;

/// A uniform linear rod; other rods are integrated by `ivp`.
#[derive(Clone, Copy)]
pub(super) struct Collocated<'a> {
    law: &'a ScaledLaw,
    linear: &'a UniformLinear,
}

impl<'a> Collocated<'a> {
    pub(super) fn of(law: &'a ScaledLaw) -> Option<Self> {
        Some(Self {
            law,
            linear: law.uniform()?,
        })
    }

    /// The end, with `K` columns of its tangent, by the components of the base wrench from `first` on.
    ///
    /// # Errors
    /// If the integration cannot go on: the arclength at which it fails.
    pub(super) fn end<const K: usize>(
        &self,
        b: &Wrench,
        first: usize,
        tolerance: f64,
    ) -> Result<(LineState<K>, Cost)> {
        let along = Integration::new(self, b, first, K, tolerance)?;
        let ended = along.follow(None);
        let ended = ended.map_err(|s| integration_error(self.law, b, None, s))?;
        Ok((along.end_along_clamp_axes(&ended), ended.cost))
    }
}

/// One compliance dominates if the squared trace exceeds the sum of the pairwise products by this factor: it is then
/// at least about 8 times the sum of the others.
const SOFT: f64 = 10.0;

/// Axes, by columns, of which the third is along the force (Duff et al., *Building an orthonormal basis, revisited*,
/// J. Comput. Graph. Tech. 6 (2017) 1-8). A force in a plane of the clamp's third axis and another axis leaves the
/// axes in that plane, so planar rods stay planar.
fn axes(n: &Vector3<f64>) -> Matrix3<f64> {
    let size = n.amax();
    let [x, y, z] = if size > 0.0 {
        (n / size).normalize().into()
    } else {
        [0.0, 0.0, 1.0]
    };
    let sign = 1.0_f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    Matrix3::new(
        1.0 + sign * x * x * a,
        b,
        x,
        sign * b,
        sign + y * y * a,
        y,
        -sign * x,
        -y,
        z,
    )
}

/// The integration along a rod: law, base wrench, axes and step control.
struct Integration<'a> {
    linear: &'a UniformLinear,
    sense: f64,
    /// Axes along which vectors are given, by columns.
    axes: Matrix3<f64>,
    /// m(0) and |n|.
    m: [f64; 3],
    n: f64,
    /// The component of the base wrench of the first column of the tangent, and the number of columns.
    first: usize,
    count: usize,
    /// True if one of the compliances in bending and torsion is much greater than the others.
    alone: bool,
    /// Rate of change of the rod's variables along s.
    rate: f64,
    /// The first step.
    step: f64,
    /// Target for the coefficient of P_7 in the slopes.
    goal: f64,
    /// Sweeps stop once the next would change the step by less than this.
    stays: f64,
}

/// Vector fields at the nodes.
type VectorField<S> = [Eight<S>; 3];
type MatrixField<S> = [VectorField<S>; 3];

/// Number of swept variables: the frame as a quaternion, then the place across the force.
const FRAME: usize = 6;
/// Largest number of columns.
const MAX_COLUMNS: usize = 6;

/// Sections at the nodes of a step.
struct NodeSections<S: Simd> {
    /// Directors, by number.
    d: MatrixField<S>,
    /// (u, v).
    strain: [Eight<S>; 6],
    /// r'.
    along: VectorField<S>,
    /// Twice the energy per length.
    energy: Eight<S>,
}

/// State at the end of the rod, along the axes of the integration.
struct EndState {
    q: [f64; 4],
    r: [f64; 3],
    energy: f64,
    columns: SweptColumns,
    turning: Option<DeterminantAngle>,
    cost: Cost,
}

/// Columns of the tangent at the clamp, (dm(0), dn), and at a section, (phi, rho); zeros for columns that are not
/// asked for.
#[derive(Clone, Copy)]
struct SweptColumns {
    base: [[f64; 6]; MAX_COLUMNS],
    tangent: [[f64; 6]; MAX_COLUMNS],
}

/// A step: its rule and length, the place of its start, the sections at the nodes, and the slopes of the columns
/// there.
struct CollocationStep<'a, S: Simd> {
    rule: &'a GaussRule<S>,
    h: f64,
    from: &'a [f64; 3],
    at: &'a NodeSections<S>,
    slopes: &'a [[Eight<S>; 6]],
}

/// The last step tried, from which the slopes of the next are extrapolated: its start and length, the third component
/// of the place there, and the swept slopes.
struct LastTrial<S: Simd> {
    s: f64,
    h: f64,
    along: f64,
    slopes: [Eight<S>; FRAME],
    swept: SweptSlopes<S>,
}

/// Slopes of x = (phi, tau) across the force, by columns.
struct SweptSlopes<S: Simd> {
    turning: [[Eight<S>; 2]; MAX_COLUMNS],
    pulled: [[Eight<S>; 2]; MAX_COLUMNS],
}

/// Start of the sweeps of the variations on a step.
struct VariationStart<'a, S: Simd> {
    /// Slopes of the last step. The sweeps overwrite them with the slopes of the new step.
    swept: &'a mut SweptSlopes<S>,
    /// Extrapolation of these slopes, and how much earlier along the force the last step begins; None: no guess.
    extension: Option<(&'a Extension<S>, f64)>,
    /// Change of the slopes at which the sweeps stop.
    stays: f64,
}

/// The integration from clamp to end, with the angle of the columns if asked for.
struct Whole<'a> {
    along: &'a Integration<'a>,
    turning: Option<DeterminantAngle>,
}

impl WithSimd for Whole<'_> {
    type Output = std::result::Result<EndState, f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self {
            along,
            turning: mut angle,
        } = self;
        let zero = Eight::all(simd, 0.0);
        let mut cost = Cost::default();
        let (mut s, mut energy) = (0.0, 0.0);
        let (mut q, mut r) = (along.clamp(), [0.0; 3]);
        let mut columns = SweptColumns {
            base: [[0.0; 6]; MAX_COLUMNS],
            tangent: [[0.0; 6]; MAX_COLUMNS],
        };
        // `count` is a run-time number: the loops over columns are long and are not unrolled.
        let count = along.count.min(MAX_COLUMNS);
        for k in 0..count {
            columns.base[k][(along.first + k) % 6] = 1.0;
        }
        let mut tried = LastTrial {
            s: 0.0,
            h: 0.0,
            along: 0.0,
            slopes: [zero; FRAME],
            swept: SweptSlopes {
                turning: [[zero; 2]; MAX_COLUMNS],
                pulled: [[zero; 2]; MAX_COLUMNS],
            },
        };
        // The rate of the angle is not known yet: begin with a short step.
        let (first, longest) = match &angle {
            Some(angle) => (0.4 * angle.longest, angle.longest),
            None => (1.0, 1.0),
        };
        let mut step = along.step.min(first);
        while 1.0 - s > 1e-14 {
            if cost.steps + cost.rejected > STEP_LIMIT {
                return Err(s);
            }
            // Divide the remaining length into equal steps.
            let h = (1.0 - s) / ((1.0 - s) / step - 1e-6).ceil().max(1.0);
            let rule = GaussRule::new(simd, h);
            let start = [q[0], q[1], q[2], q[3], r[0], r[1]];
            let extension =
                (tried.h > 0.0).then(|| Extension::new(simd, (s - tried.s) / tried.h, h / tried.h));
            let mut turning = [zero; FRAME];
            if let Some(extension) = &extension {
                turning = extension.of(&tried.slopes);
            }
            let mut varying = [[zero; 6]; MAX_COLUMNS];
            let varying = &mut varying[..count];
            let Some(mut sweeps) = along.sweep(&rule, &start, &mut turning, h) else {
                step = 0.5 * h;
                cost.rejected += 1;
                continue;
            };
            cost.evaluations += 8 * sweeps as u64;
            let at = along.sections(&rule.places(&start, &turning));
            let [q0, q1, q2, q3, ..] = turning;
            let mut top = rule.top(&[q0, q1, q2, q3]).max(rule.top(&at.along));
            if top <= ACCEPTED_EXCESS * along.goal {
                if count > 0 {
                    let size = largest(&columns.tangent[..count]).max(1.0);
                    let stays = size * along.stays / h;
                    let start = VariationStart {
                        swept: &mut tried.swept,
                        extension: extension.as_ref().map(|by| (by, r[2] - tried.along)),
                        stays,
                    };
                    let swept = along.vary(&at, &rule, &r, &columns, start, varying);
                    let Some(more) = swept else {
                        step = 0.5 * h;
                        cost.rejected += 1;
                        tried.h = 0.0;
                        continue;
                    };
                    cost.evaluations += 8 * more as u64;
                    sweeps = sweeps.max(more);
                    for column in &*varying {
                        top = top.max(rule.top(column) / size);
                    }
                }
                (tried.s, tried.h, tried.along, tried.slopes) = (s, h, r[2], turning);
            }
            let longer = (TARGET_SWEEPS / sweeps as f64).min(2.0);
            step = h * (SAFETY * (along.goal / top).powf(1.0 / 7.0)).clamp(0.2, longer);
            step = step.min(longest);
            if top > ACCEPTED_EXCESS * along.goal {
                cost.rejected += 1;
                continue;
            }
            let mut to = r;
            let mut moved = [0.0; 3];
            for i in 0..3 {
                moved[i] = rule.integral(&at.along[i]);
                to[i] += moved[i];
            }
            let mut carried = columns;
            carry(&mut carried.tangent, &rule, varying, &moved);
            if let Some(angle) = &mut angle {
                let taken = CollocationStep {
                    rule: &rule,
                    h,
                    from: &r,
                    at: &at,
                    slopes: varying,
                };
                let growth = angle.growth;
                if !angle.follow(along, &taken, &columns, &to, &mut carried) {
                    step = 0.5 * h;
                    cost.rejected += 1;
                    continue;
                }
                if angle.growth != growth {
                    // The columns were mixed: discard the extrapolation.
                    tried.h = 0.0;
                }
            }
            for (z, slope) in q.iter_mut().zip(&turning) {
                *z += rule.integral(slope);
            }
            (r, columns) = (to, carried);
            energy += 0.5 * along.sense * rule.integral(&at.energy);
            cost.steps += 1;
            s += h;
        }
        Ok(EndState {
            q,
            r,
            energy,
            columns,
            turning: angle,
            cost,
        })
    }
}

/// The largest size of an entry.
#[inline(always)]
fn largest(columns: &[[f64; 6]]) -> f64 {
    // Row by row: six at once, without a chain of dependent maxima.
    let mut sizes = [0.0_f64; 6];
    for column in columns {
        for i in 0..6 {
            let size = column[i].abs();
            if size > sizes[i] {
                sizes[i] = size;
            }
        }
    }
    let [a, b, c, d, e, f] = sizes;
    a.max(b).max(c.max(d)).max(e.max(f))
}

impl<'a> Integration<'a> {
    fn new(
        rod: &Collocated<'a>,
        b: &Wrench,
        first: usize,
        count: usize,
        tolerance: f64,
    ) -> Result<Self> {
        let Collocated { law, linear } = *rod;
        let rate = rate(law, b)?;
        let axes = axes(&b.fixed_rows::<3>(3).into_owned());
        let m = axes.tr_mul(&b.fixed_rows::<3>(0));
        let n = axes.column(2).dot(&b.fixed_rows::<3>(3));
        let turning = linear.compliance.matrix();
        let turning = turning.fixed_view::<3, 3>(0, 0);
        let trace = turning.trace();
        // Sum of pairwise products c1 c2 + c2 c3 + c3 c1.
        let pairs = 0.5 * (trace * trace - turning.norm_squared());
        Ok(Self {
            linear,
            sense: law.sense(),
            axes,
            m: m.into(),
            n,
            first,
            count,
            alone: SOFT * pairs < trace * trace,
            rate,
            step: (7.5 * tolerance.powf(1.0 / 16.0) / rate).min(1.0),
            // Coefficients that fall like x^k make an error of about x^16 at the end of a step, where P_7 has x^7.
            goal: P7_PER_TOLERANCE * rate * (tolerance / rate).powf(7.0 / 16.0),
            stays: 0.005 * tolerance + 5e-16,
        })
    }

    /// Integrates the rod, or returns the arclength at which the integration fails. Compilation for each kind of
    /// processor takes long: there is one instance for any number of columns, with the angle or without.
    #[inline(never)]
    fn follow(&self, turning: Option<DeterminantAngle>) -> std::result::Result<EndState, f64> {
        wide(Whole {
            along: self,
            turning,
        })
    }

    /// Rotation from the axes of the integration to those of the clamp.
    fn clamp(&self) -> [f64; 4] {
        let clamp = Rotation3::from_matrix_unchecked(self.axes.transpose());
        let clamp = UnitQuaternion::from_rotation_matrix(&clamp);
        [clamp.w, clamp.i, clamp.j, clamp.k]
    }

    /// The end along the axes of the clamp.
    fn end_along_clamp_axes<const K: usize>(&self, ended: &EndState) -> LineState<K> {
        let q = product(&conjugate(&Turn::from(self.clamp())), &Turn::from(ended.q));
        let r = self.axes * Vector3::from(ended.r);
        let tangent = self.rotate_pairs(&ended.columns.tangent);
        LineState::from_end_data(q.into(), r.into(), ended.energy, &tangent)
    }

    /// Pairs of vectors along the axes of the clamp. Columns are by couples and forces, in threes, and are turned as
    /// well.
    fn rotate_pairs<const K: usize>(&self, pairs: &[[f64; 6]; MAX_COLUMNS]) -> [[f64; 6]; K] {
        let axes = &self.axes;
        std::array::from_fn(|k| {
            let block = k - k % 3;
            let mut sum = [0.0; 6];
            for (j, column) in pairs.iter().enumerate().skip(block).take(3) {
                for (sum, x) in sum.iter_mut().zip(column) {
                    *sum += axes[(k - block, j - block)] * x;
                }
            }
            let [a, b, c, d, e, f] = sum;
            let (first, second) = (axes * Vector3::new(a, b, c), axes * Vector3::new(d, e, f));
            [first.x, first.y, first.z, second.x, second.y, second.z]
        })
    }

    /// Strain of a wrench: C w.
    #[inline(always)]
    fn change<S: Simd>(&self, w: &[Eight<S>; 6]) -> [Eight<S>; 6] {
        let mut change = *w;
        match &self.linear.compliance {
            Compliance::Diagonal(c) => {
                for i in 0..6 {
                    change[i] = w[i] * w[i].with(c[i]);
                }
            }
            Compliance::Full(c) => {
                for i in 0..6 {
                    let mut sum = w[0] * w[0].with(c[(i, 0)]);
                    for j in 1..6 {
                        sum = w[j].times_plus(w[j].with(c[(i, j)]), sum);
                    }
                    change[i] = sum;
                }
            }
        }
        change
    }

    /// q' = q (0, u)/2, and the part of r' across the force.
    #[inline(always)]
    fn slopes<S: Simd>(&self, z: &[Eight<S>; FRAME]) -> [Eight<S>; FRAME] {
        let [q0, q1, q2, q3, ..] = *z;
        let at = self.sections(z);
        let [u1, u2, u3, ..] = at.strain;
        let half = q0.with(0.5);
        let (u1, u2, u3) = (u1 * half, u2 * half, u3 * half);
        let none = q0.with(0.0);
        [
            none - q3.times_plus(u3, q2.times_plus(u2, q1 * u1)),
            q2.times_plus(u3, q0 * u1) - q3 * u2,
            q3.times_plus(u1, q0 * u2) - q1 * u3,
            q1.times_plus(u2, q0 * u3) - q2 * u1,
            at.along[0],
            at.along[1],
        ]
    }

    /// Sweeps the slopes of frame and place to convergence; returns the number of sweeps.
    #[inline(always)]
    fn sweep<S: Simd>(
        &self,
        rule: &GaussRule<S>,
        start: &[f64; FRAME],
        slopes: &mut [Eight<S>; FRAME],
        h: f64,
    ) -> Option<usize> {
        let zero = slopes[0].with(0.0);
        let stays = self.stays / h;
        let mut last = 0.0;
        for sweeps in 1..=MOST_SWEEPS {
            let new = self.slopes(&rule.places(start, slopes));
            let mut change = zero;
            for i in 0..FRAME {
                let moved = new[i] - slopes[i];
                change = moved.times_plus(moved, change);
            }
            *slopes = new;
            let change = change.total();
            // Convergence is superlinear: the next sweep would change the slopes by at most the square of this change
            // over the last.
            if change * change <= stays * stays * last {
                return Some(sweeps);
            }
            last = change;
        }
        None
    }

    /// Sections of the given frames and places.
    #[inline(always)]
    fn sections<S: Simd>(&self, z: &[Eight<S>; FRAME]) -> NodeSections<S> {
        let [w, x, y, zz, r1, r2] = *z;
        let (x2, y2, z2) = (x + x, y + y, zz + zz);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, zz * z2);
        let one = w.with(1.0);
        let d = [
            [one - (yy + zz), xy + wz, xz - wy],
            [xy - wz, one - (xx + zz), yz + wx],
            [xz + wy, yz - wx, one - (xx + yy)],
        ];
        let n = w.with(self.n);
        let m1 = w.with(self.m[0]) - r2 * n;
        let m2 = r1.times_plus(n, w.with(self.m[1]));
        let mut local = [one; 6];
        for k in 0..3 {
            local[k] = d[k][0].times_plus(m1, d[k][1].times_plus(m2, d[k][2] * self.m[2]));
            local[3 + k] = d[k][2] * n;
        }
        let change = self.change(&local);
        let mut energy = change[0] * local[0];
        for i in 1..6 {
            energy = change[i].times_plus(local[i], energy);
        }
        let mut strain = change;
        for i in 0..6 {
            strain[i] = change[i] + w.with(self.linear.rest[i]);
        }
        let along = turned_vector(&d, &[strain[3], strain[4], strain[5]]);
        NodeSections {
            d,
            strain,
            along,
            energy,
        }
    }
}

/// The rotated vector R v.
#[inline(always)]
fn turned_vector<S: Simd>(d: &MatrixField<S>, v: &VectorField<S>) -> VectorField<S> {
    let mut all = *v;
    for i in 0..3 {
        let sum = d[1][i].times_plus(v[1], d[0][i] * v[0]);
        all[i] = d[2][i].times_plus(v[2], sum);
    }
    all
}
