//! Poses of the end as numbers in a state: a position, after a quaternion (w, x, y, z) if the end's rotation counts.
//!
//! A state that carries its pose beside its strains can require that poses agree, in place of velocities. In stiff
//! rods (small viscosities) a velocity is a small difference of large terms, a pose is not.

use super::kinematics::AtEnd;
use nalgebra::{ComplexField, Quaternion, SMatrix, SVector, Vector3};

/// True if a place of this length holds a rotation.
fn turns(place: &[f64]) -> bool {
    place.len() == 7
}

fn quaternion(place: &[f64]) -> Quaternion<f64> {
    Quaternion::new(place[0], place[1], place[2], place[3])
}

/// Rates of a place that moves at `v`.
pub fn rates<const D: usize>(place: &[f64], v: &AtEnd<D>, out: &mut [f64]) {
    if !turns(place) {
        out.copy_from_slice(v.as_slice());
        return;
    }
    // p_t = 1/2 omega p.
    let omega = Quaternion::from_imag(Vector3::new(v[0], v[1], v[2]));
    let rate = omega * quaternion(place) * 0.5;
    out[..4].copy_from_slice(&[rate.w, rate.i, rate.j, rate.k]);
    out[4..].copy_from_slice(&v.as_slice()[3..]);
}

/// The twist (rotation vector, then translation; world frame) from `place` to `other`, to first order.
pub fn gap<const D: usize>(place: &[f64], other: &[f64]) -> AtEnd<D> {
    if !turns(place) {
        return AtEnd::from_fn(|i, _| other[i] - place[i]);
    }
    let p = quaternion(place);
    let turn = quaternion(other) * p.conjugate() / p.norm_squared();
    let side = if turn.w < 0.0 { -2.0 } else { 2.0 };
    AtEnd::from_fn(|i, _| match i {
        0 => side * turn.i,
        1 => side * turn.j,
        2 => side * turn.k,
        _ => other[i + 1] - place[i + 1],
    })
}

/// Matrix spin of (d twist)_t = dV + spin (d twist), for a place that moves at `v`.
pub fn spin<const D: usize>(place: &[f64], v: &AtEnd<D>) -> SMatrix<f64, D, D> {
    let mut spin = SMatrix::<f64, D, D>::zeros();
    if turns(place) {
        let cross = Vector3::new(v[0], v[1], v[2]).cross_matrix();
        spin.fixed_view_mut::<3, 3>(0, 0).copy_from(&cross);
    }
    spin
}

/// Splits a change of the numbers of `place` into a twist and, for quaternions, the relative change of the norm.
pub fn split<T: ComplexField<RealField = f64> + Copy, const D: usize>(
    place: &[f64],
    change: &[T],
) -> (SVector<T, D>, T) {
    let real = T::from_real;
    if !turns(place) {
        return (SVector::from_fn(|i, _| change[i]), T::zero());
    }
    let p = quaternion(place);
    let size = p.norm_squared();
    // change p^* / |p|^2 = (norm, 1/2 twist).
    let (w, v) = (p.w / size, p.imag() / -size);
    let b = [change[1], change[2], change[3]];
    let cross = |i: usize, j: usize| b[i] * real(v[j]) - b[j] * real(v[i]);
    let turned = [cross(1, 2), cross(2, 0), cross(0, 1)];
    let dot = b[0] * real(v[0]) + b[1] * real(v[1]) + b[2] * real(v[2]);
    let norm = change[0] * real(w) - dot;
    let twist = SVector::from_fn(|i, _| {
        if i < 3 {
            (change[0] * real(v[i]) + b[i] * real(w) + turned[i]) * real(2.0)
        } else {
            change[i + 1]
        }
    });
    (twist, norm)
}

/// Inverse of [`split`]: the change of the numbers of `place`.
pub fn join<T: ComplexField<RealField = f64> + Copy, const D: usize>(
    place: &[f64],
    twist: &SVector<T, D>,
    norm: T,
    out: &mut [T],
) {
    let real = T::from_real;
    if !turns(place) {
        out.copy_from_slice(twist.as_slice());
        return;
    }
    let p = quaternion(place);
    let (w, v) = (p.w, p.imag());
    let half = real(0.5);
    let b = [twist[0] * half, twist[1] * half, twist[2] * half];
    let cross = |i: usize, j: usize| b[i] * real(v[j]) - b[j] * real(v[i]);
    let turned = [cross(1, 2), cross(2, 0), cross(0, 1)];
    out[0] = norm * real(w) - (b[0] * real(v[0]) + b[1] * real(v[1]) + b[2] * real(v[2]));
    for i in 0..3 {
        out[i + 1] = norm * real(v[i]) + b[i] * real(w) + turned[i];
        out[i + 4] = twist[i + 3];
    }
}
