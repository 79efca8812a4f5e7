//! Quaternions and vectors of eight states at once.

use crate::math::lanes8::Eight;
use crate::math::real::Real;
use pulp::Simd;

/// Squared half angle below which the series in [`exponential`] give cosine and sine to 1e-12.
const SMALL: f64 = 0.25;

pub(super) type Vector<S> = [Eight<S>; 3];
/// (w, x, y, z) of a quaternion.
pub(super) type Quaternion8<S> = [Eight<S>; 4];

/// The quaternion of a rotation vector: by the series for an angle that is halved until it is small, then doubled.
#[inline(always)]
pub(super) fn exponential<S: Simd>(angle: &Vector<S>) -> Quaternion8<S> {
    let mut square = dot(angle, angle) * 0.25;
    let (mut halvings, mut largest) = (0, square.greatest());
    while largest > SMALL && halvings < 64 {
        (halvings, largest) = (halvings + 1, 0.25 * largest);
        square = square * 0.25;
    }
    let minus = square * -1.0;
    let cos = minus.series(&[
        1.0,
        0.5,
        1.0 / 24.0,
        1.0 / 720.0,
        1.0 / 40320.0,
        1.0 / 3_628_800.0,
    ]);
    let ratio = minus.series(&[
        1.0,
        1.0 / 6.0,
        1.0 / 120.0,
        1.0 / 5040.0,
        1.0 / 362_880.0,
        1.0 / 39_916_800.0,
    ]);
    let half = ratio * (0.5 * 0.5_f64.powi(halvings));
    let mut p = [cos, angle[0] * half, angle[1] * half, angle[2] * half];
    for _ in 0..halvings {
        p = product(&p, &p);
    }
    p
}

/// The product a b: first b, then a.
#[inline(always)]
pub(super) fn product<S: Simd>(a: &Quaternion8<S>, b: &Quaternion8<S>) -> Quaternion8<S> {
    let v = a[1].times_plus(b[1], a[2].times_plus(b[2], a[3] * b[3]));
    let mut c = [a[0] * b[0] - v, v, v, v];
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        let sum = a[j].times_plus(b[k], a[i].times_plus(b[0], a[0] * b[i]));
        c[i] = sum - a[k] * b[j];
    }
    c
}

/// The product a b*.
#[inline(always)]
pub(super) fn over<S: Simd>(a: &Quaternion8<S>, b: &Quaternion8<S>) -> Quaternion8<S> {
    let mut c = [a[0] * b[0]; 4];
    for k in 1..4 {
        c[0] = a[k].times_plus(b[k], c[0]);
    }
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        let sum = a[k].times_plus(b[j], a[i] * b[0]);
        c[i] = sum - a[j].times_plus(b[k], a[0] * b[i]);
    }
    c
}

/// p u/2.
#[inline(always)]
pub(super) fn spin<S: Simd>(p: &Quaternion8<S>, u: &Vector<S>) -> Quaternion8<S> {
    let h = [u[0] * 0.5, u[1] * 0.5, u[2] * 0.5];
    let v = p[1].times_plus(h[0], p[2].times_plus(h[1], p[3] * h[2]));
    let mut c = [v * -1.0; 4];
    for (i, j, k) in [(1, 2, 3), (2, 3, 1), (3, 1, 2)] {
        c[i] = p[j].times_plus(h[k - 1], p[0] * h[i - 1]) - p[k] * h[j - 1];
    }
    c
}

#[inline(always)]
pub(super) fn square<S: Simd>(p: &Quaternion8<S>) -> Eight<S> {
    let pair = p[1].times_plus(p[1], p[0] * p[0]);
    p[3].times_plus(p[3], p[2].times_plus(p[2], pair))
}

#[inline(always)]
pub(super) fn dot<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Eight<S> {
    a[2].times_plus(b[2], a[1].times_plus(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(super) fn cross<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(super) fn added<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(super) fn scaled<S: Simd>(a: &Vector<S>, factor: Eight<S>) -> Vector<S> {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// d1, d2, d3 of a unit quaternion.
#[inline(always)]
pub(super) fn directors<S: Simd>(p: &Quaternion8<S>) -> [Vector<S>; 3] {
    let [w, x, y, z] = *p;
    let one = w.with(1.0);
    let (qw, qx, qy, qz) = (w + w, x + x, y + y, z + z);
    let (xx, yy, zz) = (qx * x, qy * y, qz * z);
    let (xy, yz, zx) = (qx * y, qy * z, qz * x);
    let (wx, wy, wz) = (qw * x, qw * y, qw * z);
    [
        [one - (yy + zz), xy + wz, zx - wy],
        [xy - wz, one - (zz + xx), yz + wx],
        [zx + wy, yz - wx, one - (xx + yy)],
    ]
}
