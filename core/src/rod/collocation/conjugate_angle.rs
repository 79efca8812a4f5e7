//! Angle of det(P + i kappa J) along a uniform linear rod, which counts conjugate points (see `index`).
//!
//! At the nodes of a step the rate of the angle of det X, X = P + i kappa J, is known. Its integral determines how
//! many whole turns are added to the difference of the determinants' arguments at both ends of the step.

use super::tangent::cross;
use super::{
    Collocated, CollocationStep, Integration, MAX_COLUMNS, SweptColumns, VectorField, largest,
};
use crate::error::Result;
use crate::math::lanes8::Eight;
use crate::math::real::Real;
use crate::rod::conjugate_points::{
    FollowedRod, MIXING_SIZE, complex_columns, mixing_matrix, variations_error,
};
use crate::rod::ivp::Wrench;
use nalgebra::{Complex, Matrix3, SMatrix, Vector3};
use pulp::Simd;
use std::f64::consts::TAU;

impl Collocated<'_> {
    /// The rod from clamp to end: the fast path of `conjugate_points::follow_variations`.
    pub(in crate::rod) fn follow_variations<const K: usize>(
        &self,
        b: &Wrench,
        weight: f64,
        tolerance: f64,
    ) -> Result<FollowedRod<K>> {
        let along = Integration::new(self, b, 0, K, tolerance)?;
        let turning = DeterminantAngle {
            weight,
            longest: MAX_STEP_TIMES_RATE / along.rate,
            last: Complex::new(1.0, 0.0),
            angle: 0.0,
            growth: 1.0,
        };
        let ended = along
            .follow(Some(turning))
            .map_err(|_| variations_error())?;
        let turning = ended.turning.as_ref().ok_or_else(variations_error)?;
        let base = along.rotate_pairs::<K>(&ended.columns.base);
        Ok(FollowedRod {
            end: along.end_along_clamp_axes(&ended),
            dm: std::array::from_fn(|i| std::array::from_fn(|k| base[k][i])),
            angle: turning.angle,
            growth: turning.growth,
        })
    }
}

/// The longest step, times the rate of the rod's variables.
const MAX_STEP_TIMES_RATE: f64 = 4.0;

/// The widest gap between neighbouring nodes, in parts of a step, and the largest turn of the angle in that gap.
const GAP: f64 = 0.184;
const TURN: f64 = 1.5;

/// Angle of the determinant along a rod.
pub(super) struct DeterminantAngle {
    /// kappa.
    weight: f64,
    /// The longest step.
    pub longest: f64,
    /// The normalised determinant at the start of the next step.
    last: Complex<f64>,
    angle: f64,
    pub growth: f64,
}

impl DeterminantAngle {
    /// Follows a step that takes the columns to `to`, and may mix them; false asks for a shorter step.
    #[inline(always)]
    pub fn follow<S: Simd>(
        &mut self,
        along: &Integration,
        step: &CollocationStep<S>,
        columns: &SweptColumns,
        r: &[f64; 3],
        to: &mut SweptColumns,
    ) -> bool {
        let rate = self.rate(along, step, columns);
        let (expected, fastest) = (step.rule.integral(&rate), rate.abs().greatest());
        self.take(along, r, to, expected, fastest * step.h)
    }

    /// Rate of the angle of det X at the nodes: that of tr(X^-1 X'), where P' = n x rho' + (m' x phi + m x phi')/2.
    #[inline(always)]
    fn rate<S: Simd>(
        &self,
        along: &Integration,
        step: &CollocationStep<S>,
        columns: &SweptColumns,
    ) -> Eight<S> {
        let CollocationStep { rule, at, .. } = step;
        let ([m1, m2, m3], n) = (along.couple(step.from), along.n);
        let a = rule.places(&[0.0; 3], &at.along);
        let half = a[0].with(0.5);
        let m = [
            (a[0].with(m1) - a[1] * n) * half,
            (a[0].with(m2) + a[0] * n) * half,
            a[0].with(0.5 * m3),
        ];
        let zero = a[0].with(0.0);
        let turned = [
            zero - at.along[1] * (0.5 * n),
            at.along[0] * (0.5 * n),
            zero,
        ];
        let mut x = [[[zero; 3]; 2]; 3];
        let mut dx = x;
        for k in 0..3 {
            let [p1, p2, p3, r1, r2, r3] = rule.places(&columns.tangent[k], &step.slopes[k]);
            let [dp1, dp2, dp3, dr1, dr2, _] = step.slopes[k];
            let (phi, dphi) = ([p1, p2, p3], [dp1, dp2, dp3]);
            // rho = rho* + phi x a.
            let lever = cross(&phi, &a);
            let (by, moved) = (cross(&dphi, &a), cross(&phi, &at.along));
            let rho = [r1 + lever[0], r2 + lever[1], r3];
            let drho = [dr1 + by[0] + moved[0], dr2 + by[1] + moved[1]];
            let borne = cross(&m, &phi);
            let (by, moved) = (cross(&turned, &phi), cross(&m, &dphi));
            let base = &columns.base[k];
            x[k][0] = [
                zero.with(base[0]) - rho[1] * n + borne[0],
                zero.with(base[1]) + rho[0] * n + borne[1],
                zero.with(base[2]) + borne[2],
            ];
            dx[k][0] = [
                by[0] + moved[0] - drho[1] * n,
                by[1] + moved[1] + drho[0] * n,
                by[2] + moved[2],
            ];
            for i in 0..3 {
                x[k][1][i] = phi[i] * self.weight;
                dx[k][1][i] = dphi[i] * self.weight;
            }
        }
        let [x1, x2, x3] = &x;
        // Columns of the adjugate matrix.
        let beside = [
            complex_cross(x2, x3),
            complex_cross(x3, x1),
            complex_cross(x1, x2),
        ];
        let [re, im] = complex_dot(x1, &beside[0]);
        let (mut dre, mut dim) = (zero, zero);
        for k in 0..3 {
            let [more_re, more_im] = complex_dot(&dx[k], &beside[k]);
            dre = dre + more_re;
            dim = dim + more_im;
        }
        let size = re.times_plus(re, im * im);
        (dim * re - dre * im) * size.inverse()
    }

    /// Takes a step to `to`, along which the angle is expected to turn by `expected`; `fastest` is the largest rate of
    /// the angle times the length of the step. False if the step must be shorter.
    fn take(
        &mut self,
        along: &Integration,
        r: &[f64; 3],
        to: &mut SweptColumns,
        expected: f64,
        fastest: f64,
    ) -> bool {
        let pair = along.conjugate(r, to);
        let next = complex_columns(&pair, self.weight).determinant();
        let turned = (next * self.last.conj()).arg();
        let whole = ((expected - turned) / TAU).round() * TAU;
        let known = (turned + whole - expected).abs() < 0.5;
        if !(known && fastest * GAP < TURN) {
            return false;
        }
        self.angle += turned + whole;
        self.last = next / next.norm();
        if largest(&to.tangent) > MIXING_SIZE {
            // The mixing matrix has a positive determinant: the angle is unchanged.
            let Some((mixing, size)) = mixing_matrix(&pair) else {
                return false;
            };
            self.growth *= size;
            for columns in [&mut to.base, &mut to.tangent] {
                let all = SMatrix::<f64, 6, MAX_COLUMNS>::from_fn(|i, k| columns[k][i]) * mixing;
                *columns = std::array::from_fn(|k| all.column(k).into_owned().into());
            }
        }
        true
    }
}

impl Integration<'_> {
    /// J and P of all columns at a section.
    fn conjugate(
        &self,
        r: &[f64; 3],
        columns: &SweptColumns,
    ) -> (SMatrix<f64, 3, MAX_COLUMNS>, SMatrix<f64, 3, MAX_COLUMNS>) {
        let part = |pairs: &[[f64; 6]; MAX_COLUMNS], from: usize| {
            SMatrix::<f64, 3, MAX_COLUMNS>::from_fn(|i, k| pairs[k][from + i])
        };
        let m: Matrix3<f64> = Vector3::from(self.couple(r)).cross_matrix();
        let n = Vector3::new(0.0, 0.0, self.n).cross_matrix();
        let j = part(&columns.tangent, 0);
        let p = part(&columns.base, 0) + n * part(&columns.tangent, 3) + m * j * 0.5;
        (j, p)
    }
}

/// Real and imaginary parts of a vector field.
type Complexes<S> = [VectorField<S>; 2];

/// a x b.
#[inline(always)]
fn complex_cross<S: Simd>(a: &Complexes<S>, b: &Complexes<S>) -> Complexes<S> {
    let (rr, ii) = (cross(&a[0], &b[0]), cross(&a[1], &b[1]));
    let (ri, ir) = (cross(&a[0], &b[1]), cross(&a[1], &b[0]));
    let mut all = [rr, ri];
    for i in 0..3 {
        all[0][i] = rr[i] - ii[i];
        all[1][i] = ri[i] + ir[i];
    }
    all
}

/// a.b without conjugation.
#[inline(always)]
fn complex_dot<S: Simd>(a: &Complexes<S>, b: &Complexes<S>) -> [Eight<S>; 2] {
    let (mut re, mut im) = (a[0][0] * b[0][0], a[0][0] * b[1][0]);
    for i in 0..3 {
        if i > 0 {
            re = a[0][i].times_plus(b[0][i], re);
            im = a[0][i].times_plus(b[1][i], im);
        }
        re = re - a[1][i] * b[1][i];
        im = a[1][i].times_plus(b[0][i], im);
    }
    [re, im]
}
