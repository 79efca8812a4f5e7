//! Poses, twists and wrenches in space: storage and shared operations.
//!
//! A twist (angular velocity, velocity) and a wrench (couple, force) are six numbers, the rotational half first. A
//! quaternion that is stored as numbers is (w, x, y, z), w its scalar part.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector4, Vector6};

/// Rotational and translational halves of a twist, or couple and force of a wrench.
pub fn halves(pair: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        pair.fixed_rows::<3>(0).into_owned(),
        pair.fixed_rows::<3>(3).into_owned(),
    )
}

/// A twist or a wrench from its halves, the rotational one first.
pub fn join(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Twist or wrench with both halves rotated.
pub fn rotate_halves(turn: &UnitQuaternion<f64>, pair: &Vector6<f64>) -> Vector6<f64> {
    let (a, b) = halves(pair);
    join(&(turn * a), &(turn * b))
}

/// The rotation vector of a rotation, of length at most pi.
pub fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    // Closed form: an iteration from the identity would stall half a turn away.
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).scaled_axis()
}

/// d(rotation vector)/d(spin): I - (phi x)/2 + c (phi x)^2.
pub fn inverse_left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let angle = phi.norm();
    let c = if angle < 1e-2 {
        let square = angle * angle;
        1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
    };
    let cross = phi.cross_matrix();
    Matrix3::identity() - 0.5 * cross + c * cross * cross
}

/// d(spin)/d(rotation vector), the inverse of [`inverse_left_jacobian`]: I + a (phi x) + b (phi x)^2.
pub fn left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let square = phi.norm_squared();
    let (a, b) = if square < 1e-4 {
        (
            0.5 - square / 24.0 + square * square / 720.0,
            1.0 / 6.0 - square / 120.0 + square * square / 5040.0,
        )
    } else {
        let angle = square.sqrt();
        (
            2.0 * (0.5 * angle).sin().powi(2) / square,
            (angle - angle.sin()) / (square * angle),
        )
    };
    let cross = phi.cross_matrix();
    Matrix3::identity() + a * cross + b * cross * cross
}

/// Quaternion (w, x, y, z) of a rotation, of norm 1 to rounding unless stated otherwise.
pub type Turn = Vector4<f64>;

/// No rotation.
#[inline]
pub fn identity() -> Turn {
    Vector4::new(1.0, 0.0, 0.0, 0.0)
}

/// Rotation of `p`, for any norm of `p`.
#[inline]
pub fn unit(p: &Turn) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(quaternion(p))
}

#[inline]
fn quaternion(p: &Turn) -> Quaternion<f64> {
    Quaternion::new(p[0], p[1], p[2], p[3])
}

/// The product a b: first b, then a.
#[inline]
pub fn product(a: &Turn, b: &Turn) -> Turn {
    let c = quaternion(a) * quaternion(b);
    Vector4::new(c.w, c.i, c.j, c.k)
}

/// The conjugate: for a unit quaternion the inverse rotation.
#[inline]
pub fn conjugate(p: &Turn) -> Turn {
    Vector4::new(p[0], -p[1], -p[2], -p[3])
}

/// Rate p u/2 of `p` for a frame that turns with the angular velocity `u`, in components along the frame.
#[inline]
pub fn spin(p: &Turn, u: &Vector3<f64>) -> Turn {
    let (w, x, y, z) = (p[0], p[1], p[2], p[3]);
    Vector4::new(
        -0.5 * (x * u.x + y * u.y + z * u.z),
        0.5 * (w * u.x + y * u.z - z * u.y),
        0.5 * (w * u.y + z * u.x - x * u.z),
        0.5 * (w * u.z + x * u.y - y * u.x),
    )
}

/// The rotation matrix of `p`, orthonormal to rounding whatever the norm of `p`.
#[inline]
pub fn frame(p: &Turn) -> Matrix3<f64> {
    let (w, x, y, z) = (p[0], p[1], p[2], p[3]);
    let twice = 2.0 / p.norm_squared();
    let (qw, qx, qy, qz) = (twice * w, twice * x, twice * y, twice * z);
    let (xx, yy, zz) = (qx * x, qy * y, qz * z);
    let (xy, yz, zx) = (qx * y, qy * z, qz * x);
    let (wx, wy, wz) = (qw * x, qw * y, qw * z);
    Matrix3::new(
        1.0 - (yy + zz),
        xy - wz,
        zx + wy,
        xy + wz,
        1.0 - (zz + xx),
        yz - wx,
        zx - wy,
        yz + wx,
        1.0 - (xx + yy),
    )
}

/// The quaternion of a rotation vector, to rounding, by series where sin(angle/2)/angle would lose digits.
pub fn exponential(angle: &Vector3<f64>) -> Turn {
    let square = 0.25 * angle.norm_squared();
    let (ratio, cos) = if square < 0.06 {
        // The next terms are below 1e-15.
        let series = |a: f64, b: f64, c: f64, d: f64, e: f64| {
            1.0 - square / a
                * (1.0 - square / b * (1.0 - square / c * (1.0 - square / d * (1.0 - square / e))))
        };
        (
            series(6.0, 20.0, 42.0, 72.0, 110.0),
            series(2.0, 12.0, 30.0, 56.0, 90.0),
        )
    } else {
        let half = square.sqrt();
        let (sin, cos) = half.sin_cos();
        (sin / half, cos)
    };
    let v = angle * (0.5 * ratio);
    Vector4::new(cos, v.x, v.y, v.z)
}
