//! Reader of one end of a rod of an assembly: on the ground, on a body, or free.

use super::ends::{motion, orientation};
use super::fields::SITE;
use super::joint::joint;
use super::phrases::{listed, nearest};
use super::table::Table;
use crate::scene::{ClampMotion, FaultKind, Site, SiteJoint};
use toml::Spanned;
use toml::de::DeValue;

/// Properties of the bodies on which rods depend, known even if the bodies have faults.
pub(super) struct BodyTraits {
    pub names: Vec<Option<String>>,
    pub points: Vec<bool>,
}

/// True if the rod has a free end, `to = "free"`.
pub(super) fn has_free_end(rod: &Table) -> bool {
    let to = rod.get("to");
    to.is_some_and(|to| to.get_ref().as_str() == Some("free"))
}

/// Reads one end of a rod.
pub(super) fn site(
    rod: &Table,
    which: &'static str,
    bodies: &BodyTraits,
    bodies_known: bool,
    moves: bool,
) -> Option<Site> {
    let allowed = match which {
        "from" => {
            "a table with body (left out: the ground), position, quaternion or rotation, joint"
        }
        _ => {
            "\"free\", or a table with body (left out: the ground), position, quaternion or rotation, joint"
        }
    };
    if let Some(value) = rod.get(which).filter(|value| value.get_ref().is_str()) {
        let free = which == "from" && value.get_ref().as_str() == Some("free");
        let hint = if free {
            "a rod that nothing holds begins on a [[body]] of mass 0: its guess is the place at the start (scenes/flying_beam.toml); one \
             rod alone has [clamp] with free = true"
        } else {
            "the ground is `{ position = [0.0, 0.0, 0.0] }`, a body `{ body = \"m\" }`"
        };
        return rod
            .reader
            .refuse(FaultKind::Value, &rod.field(which), value, allowed, hint);
    }
    if !rod.has(which) {
        let example = match which {
            "from" => "from = { position = [0.0, 0.0, 0.0] }",
            _ => "to = { body = \"m\" }",
        };
        rod.missing(which, allowed, example);
        return None;
    }
    let table = rod.inner(which, &SITE)?;
    let reader = table.reader;
    let body = table.maybe("body", |field, value: &Spanned<DeValue>| {
        let known: Vec<&str> = bodies.names.iter().flatten().map(String::as_str).collect();
        let allowed = if known.is_empty() {
            "the name of a [[body]]".to_owned()
        } else {
            format!("the name of a [[body]]: {}", listed(&known))
        };
        let Some(word) = value.get_ref().as_str() else {
            reader.wrong_type(field, value, &allowed, None);
            return None;
        };
        if let Some(body) = bodies.names.iter().position(|n| n.as_deref() == Some(word)) {
            return Some((word.to_owned(), body));
        }
        // A body whose own name has a fault may be the one meant.
        if !bodies_known || bodies.names.iter().any(Option::is_none) {
            return None;
        }
        let hint = match nearest(word, &mut known.into_iter()) {
            Some(name) => format!("did you mean {name:?}?"),
            None => {
                format!("add `[[body]]` with `name = {word:?}`; an end on the ground has no `body`")
            }
        };
        reader.refuse(FaultKind::Unknown, field, value, allowed, hint)
    });
    let position = table.vector("position");
    let orientation = orientation(&table);
    let motion = site_motion(&table, moves);
    let joint = joint(&table);
    let (body, position, joint, motion) = (body?, position?, joint?, motion?);
    // A point mass turns nothing: without a joint in the scene the end of the rod is free to turn.
    let on_point = body.as_ref().is_some_and(|(_, body)| bodies.points[*body]);
    let joint = if on_point && !table.has("joint") {
        SiteJoint::Ball
    } else {
        joint
    };
    if let Some((name, _)) = body.as_ref().filter(|(_, body)| bodies.points[*body]) {
        let hint = format!(
            "{name:?} is a point mass, and an end on it is free to turn; a body with `inertia` can hold the rod"
        );
        if has_free_end(rod) {
            let allowed = "a body with `inertia`, where `to` is \"free\"; or left out: the ground";
            let hint = format!(
                "{name:?} is a point mass, about which a rod with a free end would turn as it likes"
            );
            return table.refuse(FaultKind::Conflict, "body", allowed, hint);
        }
        if joint != SiteJoint::Ball {
            table.fault(FaultKind::Conflict, "joint", "\"ball\"", hint.clone());
            return None;
        }
        if position != [0.0; 3] {
            let allowed = "[0.0, 0.0, 0.0], or left out, on a point mass";
            return table.refuse(FaultKind::Conflict, "position", allowed, hint);
        }
    }
    Some(Site {
        body: body.map(|(name, _)| name),
        position,
        orientation: orientation?.unwrap_or_default(),
        joint,
        motion,
    })
}

/// Reads the motion of an attachment on the ground.
fn site_motion(table: &Table, moves: bool) -> Option<Option<ClampMotion>> {
    let motion = motion(table);
    let (allowed, hint) = match (table.has("body"), moves) {
        (true, _) => (
            "left out where the rod is on a body",
            "a body moves as its rods and loads have it; on the ground, without `body`, the place can be moved",
        ),
        (false, false) => (
            "left out where there is no [run]",
            "at rest nothing moves; a scene with [run] is one of motion",
        ),
        (false, true) => return motion,
    };
    if table.has("motion") {
        table.refuse(FaultKind::Conflict, "motion", allowed, hint)
    } else {
        motion
    }
}
