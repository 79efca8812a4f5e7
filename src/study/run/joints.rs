//! Joints with axes in a run: angle or shift of each, with its rate, as columns.

use crate::assembly::BodyMotion;
use crate::error::Quantity;
use crate::scene::{PlacedJoint, Scales, Units};
use crate::study::Column;
use crate::study::stations::StationValues;
use nalgebra::Vector6;

/// A joint with axes of a run, as columns name it.
#[derive(Debug, Clone)]
pub struct RunJoint {
    /// Name before the columns: that of the rod, and "from" or "to".
    pub name: String,
    /// Number of axes about which the joint turns.
    pub turns: usize,
    /// Number of directions along which the joint slides.
    pub slides: usize,
}

impl RunJoint {
    pub(super) fn new(joint: &PlacedJoint) -> Self {
        Self {
            name: joint.name.clone(),
            turns: joint.guide.turnings(),
            slides: joint.guide.shiftings(),
        }
    }

    /// Number of columns.
    pub(super) fn count(&self) -> usize {
        2 * (self.turns + self.slides)
    }
}

/// Coordinates and rates of a joint at the time `t` of the motion, in the scene's units, from the section there.
pub(super) fn numbers(
    joint: &PlacedJoint,
    (t, bodies): (f64, &[BodyMotion]),
    at: &StationValues,
    k: &Scales,
) -> Vec<f64> {
    let mut pose = at.pose;
    pose.translation.vector /= k.length;
    let twist = at.twist.unwrap_or(Vector6::repeat(f64::NAN));
    let inward = |i: usize| match i {
        0..3 => k.inward(Quantity::AngularVelocity, twist[i]),
        _ => k.inward(Quantity::Velocity, twist[i]),
    };
    let carried = BodyMotion {
        pose,
        twist: Vector6::from_fn(|i, _| inward(i)),
    };
    let found = joint.guide.coordinates_and_rates(t, bodies, &carried);
    let each = found.into_iter().enumerate();
    each.flat_map(|(i, [y, rate])| {
        if i < joint.guide.turnings() {
            [y, k.outward(Quantity::AngularVelocity, rate)]
        } else {
            [
                k.outward(Quantity::Length, y),
                k.outward(Quantity::Velocity, rate),
            ]
        }
    })
    .collect()
}

/// Columns of the joints of a run.
pub(super) fn columns(joints: &[RunJoint], u: Units) -> Vec<Column> {
    let (turn, pace) = match u.time() {
        "" => ("", ""),
        _ => ("rad", "rad/s"),
    };
    let mut columns = Vec::new();
    for joint in joints {
        let RunJoint {
            name,
            turns,
            slides,
        } = joint;
        let mut pair = |what: &str, units: [&'static str; 2], meaning: &str| {
            let at = format!("{meaning} of the joint {name}");
            columns.push(Column::reals(
                format!("{name}.{what}"),
                units[0],
                at.clone(),
            ));
            let rate = format!("rate of the {at}");
            columns.push(Column::reals(format!("{name}.{what}_rate"), units[1], rate));
        };
        let axes = [
            ("angle", "angle about the axis"),
            ("angle2", "angle about the second axis"),
        ];
        for (what, meaning) in &axes[..*turns] {
            pair(what, [turn, pace], meaning);
        }
        if *slides > 0 {
            pair("shift", [u.length(), u.velocity()], "shift along the axis");
        }
    }
    columns
}
