//! Reader of the joint between an end of a rod and its attachment.

use super::ends::direction;
use super::table::Table;
use crate::scene::{FaultKind, SiteJoint, SlideAxis, TurnAxis};

/// Fields of joints with axes, beside `axis`.
const LAW: [&str; 7] = [
    "second_axis",
    "slide",
    "couple",
    "force",
    "stiffness",
    "rest",
    "damping",
];
/// Largest cosine of the angle between two axes that count as perpendicular.
const ACROSS: f64 = 1e-9;

/// Reads the joint of a planar rod to its clamp: a weld, or a hinge about the normal of the plane.
pub(super) fn joint_in_plane(table: &Table) -> Option<SiteJoint> {
    let hinge = SiteJoint::Hinge(TurnAxis {
        // Planar rods in space have d1 across the plane.
        axis: [1.0, 0.0, 0.0],
        slide: None,
        couple: 0.0,
        stiffness: 0.0,
        rest: 0.0,
        damping: 0.0,
    });
    table.word("joint", &[SiteJoint::Weld, hinge])
}

/// Reads the joint of a rod end: the kind, the axes, and the laws of the axes.
pub(super) fn joint(table: &Table) -> Option<SiteJoint> {
    let kinds = ["weld", "ball", "hinge", "universal", "slider", "roller"];
    let kind = table.word("joint", &kinds)?;
    let allowed: &[&str] = match kind {
        "hinge" => &["axis", "slide", "couple", "stiffness", "rest", "damping"],
        "universal" => &[
            "axis",
            "second_axis",
            "slide",
            "couple",
            "stiffness",
            "rest",
            "damping",
        ],
        "slider" | "roller" => &["axis", "force", "stiffness", "rest", "damping"],
        _ => &[],
    };
    let mut fits = true;
    for name in table.given(&LAW).into_iter().chain(table.given(&["axis"])) {
        if !allowed.contains(&name) {
            fits = false;
            let hint = match (kind, name) {
                ("weld" | "ball", _) => format!(
                    "a {kind} has no axis of its own: write joint = \"hinge\" beside it, or leave it out"
                ),
                ("slider" | "roller", "couple") => {
                    format!("a {kind} is free along a direction: write force")
                }
                (_, "force") => "the joint is free about an axis: write couple".to_owned(),
                _ => format!("a {kind} has one axis"),
            };
            table.fault(
                FaultKind::Conflict,
                name,
                format!("left out of joint = {kind:?}"),
                hint,
            );
        }
    }
    if allowed.is_empty() {
        let joint = if kind == "ball" {
            SiteJoint::Ball
        } else {
            SiteJoint::Weld
        };
        return fits.then_some(joint);
    }
    let vector =
        "an array of three finite numbers, not all 0, along the directors of the attachment";
    if !table.has("axis") {
        let example = match kind {
            "slider" | "roller" => "axis = [1.0, 0.0, 0.0]",
            _ => "axis = [0.0, 1.0, 0.0]",
        };
        table.missing("axis", &format!("{vector}, with joint = {kind:?}"), example);
        fits = false;
    }
    let axis = table
        .has("axis")
        .then(|| direction(table, "axis"))
        .flatten();
    let slide = if table.has("slide") {
        direction(table, "slide").map(Some)
    } else {
        Some(None)
    };
    let [stiffness, rest, damping] =
        ["stiffness", "rest", "damping"].map(|name| table.number(name));
    let load = table.number(if kind == "hinge" || kind == "universal" {
        "couple"
    } else {
        "force"
    });
    let second = if kind != "universal" {
        Some([0.0; 3])
    } else if table.has("second_axis") {
        direction(table, "second_axis")
    } else {
        let allowed =
            format!("{vector}, across axis: it stays with the rod, axis with the attachment");
        table.missing("second_axis", &allowed, "second_axis = [1.0, 0.0, 0.0]");
        None
    };
    let (axis, second, load) = (axis?, second?, load?);
    let (stiffness, rest, damping) = (stiffness?, rest?, damping?);
    let turn = TurnAxis {
        axis,
        slide: slide?,
        couple: load,
        stiffness,
        rest,
        damping,
    };
    let slide = SlideAxis {
        axis,
        force: load,
        stiffness,
        rest,
        damping,
    };
    let joint = match kind {
        "hinge" => SiteJoint::Hinge(turn),
        "universal" => {
            let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let dot: f64 = axis.iter().zip(&second).map(|(a, b)| a * b).sum();
            if !(dot.abs() <= ACROSS * norm(axis) * norm(second)) {
                let hint = format!(
                    "the cosine of their angle is {:.3e}",
                    dot / (norm(axis) * norm(second))
                );
                return table.refuse(
                    FaultKind::Value,
                    "second_axis",
                    "a direction across axis",
                    hint,
                );
            }
            SiteJoint::Universal {
                first: turn,
                second_axis: second,
            }
        }
        "slider" => SiteJoint::Slider(slide),
        _ => SiteJoint::Roller(slide),
    };
    fits.then_some(joint)
}
