//! Poses and wrenches in space as columns of records.

use super::record::Column;
use crate::rod::{RodSection, Wrench};
use crate::scene::Units;
use nalgebra::{Rotation3, UnitQuaternion};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Columns of position and quaternion of the end.
pub(super) fn pose_columns(units: Units) -> impl Iterator<Item = Column> {
    let position =
        AXES.map(|k| Column::reals(k, units.length(), format!("position of the end along {k}")));
    let quaternion = ["qw", "qx", "qy", "qz"].map(|k| {
        Column::reals(
            k,
            "",
            "unit quaternion of the directors at the end, qw >= 0",
        )
    });
    position.into_iter().chain(quaternion)
}

/// Columns of force and couple of a wrench at the "base" or the "tip".
pub(super) fn wrench_columns(place: &'static str, units: Units) -> impl Iterator<Item = Column> {
    let part = move |letter: &str, what: &str, unit: &'static str| {
        AXES.map(|k| {
            Column::reals(
                format!("{place}_{letter}{k}"),
                unit,
                format!("{what} at the {place} along {k}"),
            )
        })
    };
    let force = part("f", "force", units.force());
    force.into_iter().chain(part("m", "couple", units.couple()))
}

/// Quaternion [w, x, y, z] of the directors, w >= 0.
pub(super) fn quaternion(section: &RodSection) -> [f64; 4] {
    let q = Rotation3::from_matrix_unchecked(section.directors);
    upward(&UnitQuaternion::from_rotation_matrix(&q))
}

/// Quaternion [w, x, y, z] of a rotation, w >= 0.
pub(super) fn upward(q: &UnitQuaternion<f64>) -> [f64; 4] {
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|x| sign * x)
}

/// Values of [`pose_columns`].
pub(super) fn pose(end: &RodSection) -> impl Iterator<Item = f64> {
    (0..3).map(|k| end.position[k]).chain(quaternion(end))
}

/// Values of [`wrench_columns`] for a wrench (couple, force).
pub(super) fn wrench(w: &Wrench) -> [f64; 6] {
    [w[3], w[4], w[5], w[0], w[1], w[2]]
}

/// Values of [`wrench_columns`] for the resultants at a section.
pub(super) fn tip_wrench(end: &RodSection) -> [f64; 6] {
    let (n, m) = (end.force, end.couple);
    [n.x, n.y, n.z, m.x, m.y, m.z]
}
