//! Reader of `[[obstacle]]`, `[contact]` and the shapes of bodies: what is not entered, and the rules of contact.

use super::assembly::plain_name;
use super::ends::{direction, motion, rotation};
use super::fields::{
    ASSEMBLY, CLAMP_MOTION, Form, Kinds, Need, PLANE, ROTATION, RUNS, SOLID as MATTER, SPACE,
    STATICS, Spec, field, spec,
};
use super::ranges::{FINITE, NON_NEGATIVE, POSITIVE, Rule, SILENT, SIZE, VALUE};
use super::table::{Absent, Table};
use crate::contact::ImpactLaw;
use crate::motion::LandingRule;
use crate::obstacle;
use crate::scene::{
    BodyShape, ContactMethod, ContactPair, ContactRules, FaultKind, Obstacle, ObstacleShape,
    RodsInContact, Scene,
};
use nalgebra::Vector2;

/// Most obstacles of a scene.
const OBSTACLES: usize = 100;
/// Default tolerance of rods with all of their mass among obstacles.
const AMONG_OBSTACLES: f64 = 1e-3;
/// Finest tolerance of rods in elements.
const COARSE: f64 = 0.99e-5;
/// Kinds of scenes with obstacles.
pub(super) const ON: Kinds = STATICS | RUNS;
/// Kinds of scenes in which bodies hit obstacles.
pub(super) const HIT: Kinds = RUNS;
/// Kinds of scenes with bodies that turn.
const TURNING: Kinds = SPACE | ASSEMBLY;
/// Kinds of scenes with obstacles in space.
const SOLID: Kinds = ON & !PLANE;

/// A restitution.
static RESTITUTION: Rule = Rule {
    allowed: "a number in [0, 1]",
    holds: |x| (0.0..=1.0).contains(&x),
    hint: |x| (x > 1.0).then_some("an impact does not create energy"),
};
/// Width of a barrier in lengths of the rod.
static GAP: Rule = Rule {
    allowed: "a number in [1e-8, 0.05], in lengths of the rod",
    holds: |x| (1e-8..=0.05).contains(&x),
    hint: SILENT,
};
/// A coefficient of friction.
static FRICTION: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: NON_NEGATIVE.holds,
    hint: SILENT,
};

#[rustfmt::skip]
pub(super) static OBSTACLE: Spec = spec("obstacle", &[
    field("name", ON, Form::Name, "", Need::Or("\"obstacle1\", \"obstacle2\", ..."), "Name of the obstacle in tables and messages."),
    field("plane", ON, Form::Table(&HALF_SPACE), "", Need::No, "The half-space behind a plane."),
    field("cylinder", SOLID, Form::Table(&CYLINDER), "", Need::No, "A cylinder without ends, or a tube."),
    field("sphere", SOLID, Form::Table(&SPHERE), "", Need::No, "A sphere, or a shell."),
    field("capsule", SOLID, Form::Table(&CAPSULE), "", Need::No, "A straight bar with round ends."),
    field("box", SOLID, Form::Table(&BOX), "", Need::No, "A box."),
    field("disc", PLANE, Form::Table(&DISC), "", Need::No, "A disc, or a round hole."),
    field("segment", PLANE, Form::Table(&SEGMENT), "", Need::No, "A straight bar with round ends."),
    field("polygon", PLANE, Form::Rows(2), "m", Need::No, "Corners [x, y] of a convex polygon, from 3 to 250, either way round."),
    field("friction", HIT, Form::Number(&FRICTION), "", Need::No, "Coefficient of Coulomb friction between the surfaces; without it that of [contact]."),
    field("restitution", HIT, Form::Number(&RESTITUTION), "", Need::No, "Restitution of bodies that hit the obstacle, 0 (no bounce) to 1 (no loss); without it that of [contact]."),
    field("touches", HIT, Form::Array(&Form::Name), "", Need::No, "Names of the rods and bodies that touch the obstacle; without it all. One rod is called \"rod\", its body \"body\"."),
    field("motion", HIT, Form::Table(&CLAMP_MOTION), "", Need::No, "How the obstacle moves from its place, and turns about its `point`, its `centre`, or its middle; written as the motion of a clamp. Without it the obstacle stands."),
]);
#[rustfmt::skip]
static HALF_SPACE: Spec = spec("obstacle.plane", &[
    field("point", ON, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "A point of the plane."),
    field("normal", ON, Form::Vector(&VALUE), "", Need::Yes("normal = [0.0, 0.0, 1.0]"), "Normal from the obstacle outwards, not 0, of any length."),
]);
#[rustfmt::skip]
static DISC: Spec = spec("obstacle.disc", &[
    field("centre", PLANE, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0]"), "Centre."),
    field("radius", PLANE, Form::Number(&SIZE), "m", Need::Yes("radius = 0.1"), "Radius."),
    field("inside", PLANE, Form::Flag, "", Need::Or("false"), "true: a round hole, in which bodies are."),
]);
#[rustfmt::skip]
static SEGMENT: Spec = spec("obstacle.segment", &[
    field("from", PLANE, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0]"), "One end."),
    field("to", PLANE, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0]"), "The other end."),
    field("radius", PLANE, Form::Number(&NON_NEGATIVE), "m", Need::Yes("radius = 0.01"), "Distance of the surface from the segment."),
]);
#[rustfmt::skip]
static PAIR: Spec = spec("contact.pairs", &[
    field("between", HIT, Form::Array(&Form::Name), "", Need::Yes("between = [\"ball\", \"floor\"]"), "Names of a body and of an obstacle, of two bodies, or of rods with inertia = \"full\"; twice one name for a rod with itself."),
    field("friction", HIT, Form::Number(&FRICTION), "", Need::No, "Coefficient of Coulomb friction of the pair."),
    field("restitution", HIT, Form::Number(&RESTITUTION), "", Need::No, "Restitution of the pair."),
    field("apart", HIT, Form::Flag, "", Need::Or("false"), "true: the two pass through each other."),
]);
#[rustfmt::skip]
pub(super) static CONTACT: Spec = spec("contact", &[
    field("friction", HIT, Form::Number(&FRICTION), "", Need::Or("0.0"), "Coefficient of Coulomb friction of obstacles that do not say their own."),
    field("restitution", HIT, Form::Number(&RESTITUTION), "", Need::Or("0.0"), "Restitution of obstacles that do not say their own."),
    field("law", HIT, Form::Word(&["stronge", "poisson", "newton"]), "", Need::Or("\"stronge\""), "What the restitution is: a ratio of works, of impulses, or of normal velocities. The three agree for bodies that do not turn."),
    field("pairs", HIT, Form::Array(&Form::Table(&PAIR)), "", Need::No, "Surfaces of single pairs, each a table such as { between = [\"ball\", \"floor\"], friction = 0.2, restitution = 0.8 }."),
    field("rods", HIT, Form::Word(&["all", "none", "obstacles", "others"]), "", Need::Or("\"all\""), "\"all\": rods touch obstacles, light planar ones at points, and rods with inertia = \"full\" touch each other and themselves; the run ends where that is not followed. \"others\": such rods do not touch themselves. \"obstacles\": rods with inertia = \"full\" touch obstacles alone, and end the run where they touch each other. \"none\": rods pass through obstacles, and bodies alone hit them."),
    field("method", HIT, Form::Word(&["auto", "exact", "barrier"]), "", Need::Or("\"auto\""), "\"exact\": contacts have unknown places and forces. \"barrier\": obstacles push within the distance `gap`; for rods with inertia = \"full\". \"auto\": the one that follows the rods of the scene."),
    field("gap", HIT, Form::Number(&GAP), "", Need::No, "Distance from an obstacle or a rod within which a barrier pushes, in lengths of the shortest rod; without it 1e-4. A rod lies on a floor at this distance."),
    field("stick", HIT, Form::Number(&POSITIVE), "", Need::No, "Displacement at which friction of a barrier has its full size, in lengths of the shortest rod; without it a hundredth of `gap`, or a tenth of `run.tolerance` if that is more. What sticks gives way by less."),
    field("halve", HIT, Form::Flag, "", Need::Or("false"), "true: a run with a barrier is repeated with half the gap, and `contact.change_at_half_gap` of the summary is the largest change of the places of the bodies at the end, of one rod that of its end."),
    field("settle_speed", HIT, Form::Number(&POSITIVE), "m/s", Need::No, "Normal speed after an impact below which the bounces that are left are summed up; without it 1e-6 sqrt(EI/(mass length))."),
]);
#[rustfmt::skip]
pub(super) static BODY_SHAPE: Spec = spec("body.shape", &[
    field("ball", HIT, Form::Number(&SIZE), "m", Need::No, "Diameter of a ball about the centre of mass."),
    field("capsule", TURNING, Form::Numbers(2), "m", Need::No, "Diameter, and distance of the centres of the half balls, of a cylinder between two half balls along the third axis."),
    field("cylinder", TURNING, Form::Numbers(2), "m", Need::No, "Diameter and length, both > 0, of a cylinder with flat ends along the third axis."),
    field("box", TURNING, Form::Numbers(3), "m", Need::No, "Sides of a box along the three axes; one of them may be 0, which makes a plate."),
]);
#[rustfmt::skip]
static CYLINDER: Spec = spec("obstacle.cylinder", &[
    field("point", SOLID, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "A point of the axis."),
    field("axis", SOLID, Form::Vector(&VALUE), "", Need::Yes("axis = [0.0, 1.0, 0.0]"), "Direction of the axis, not 0, of any length."),
    field("radius", SOLID, Form::Number(&SIZE), "m", Need::Yes("radius = 0.1"), "Radius."),
    field("inside", SOLID, Form::Flag, "", Need::Or("false"), "true: a tube, which rods touch from inside."),
]);
#[rustfmt::skip]
static SPHERE: Spec = spec("obstacle.sphere", &[
    field("centre", SOLID, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "Centre."),
    field("radius", SOLID, Form::Number(&SIZE), "m", Need::Yes("radius = 0.1"), "Radius."),
    field("inside", SOLID, Form::Flag, "", Need::Or("false"), "true: a shell, which rods touch from inside."),
]);
#[rustfmt::skip]
static CAPSULE: Spec = spec("obstacle.capsule", &[
    field("from", SOLID, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "One end of its axis."),
    field("to", SOLID, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "The other end of its axis."),
    field("radius", SOLID, Form::Number(&NON_NEGATIVE), "m", Need::Yes("radius = 0.1"), "Distance of the surface from the axis."),
]);
#[rustfmt::skip]
static BOX: Spec = spec("obstacle.box", &[
    field("centre", SOLID, Form::Vector(&VALUE), "m", Need::Or("[0.0, 0.0, 0.0]"), "Centre."),
    field("sides", SOLID, Form::Vector(&SIZE), "m", Need::Yes("sides = [0.1, 0.1, 0.1]"), "Lengths of the sides."),
    field("rotation", SOLID, Form::Table(&ROTATION), "", Need::No, "Rotation from the world's axes to those of the box; without it along the axes."),
]);

/// Reads the obstacles of a scene; none without the list.
pub(super) fn obstacles(top: &Table) -> Option<Vec<Obstacle>> {
    let reader = top.reader;
    if !top.knows("obstacle") {
        return Some(Vec::new());
    }
    let words =
        "tables [[obstacle]], at most 100, such as { plane = { normal = [0.0, 0.0, 1.0] } }";
    top.read("obstacle", words, Absent::Or(Vec::new()), |field, value| {
        if value.get_ref().is_table() {
            let hint = "write it with two brackets, [[obstacle]]: there may be several";
            reader.wrong_type(field, value, words, Some(hint));
            return None;
        }
        let read = |field: &str, value| {
            let table = reader.table(field, value, &OBSTACLE, "a table, [[obstacle]]")?;
            obstacle(&table)
        };
        let list = reader.all(field, value, words, &read)?;
        if list.len() > OBSTACLES {
            let hint = format!("it has {} elements", list.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        let mut obstacles = list;
        for (k, obstacle) in obstacles.iter_mut().enumerate() {
            if obstacle.name.is_empty() {
                obstacle.name = format!("obstacle{}", k + 1);
            }
        }
        for (k, obstacle) in obstacles.iter().enumerate() {
            if obstacles[..k]
                .iter()
                .any(|other| other.name == obstacle.name)
            {
                let hint = format!("two of them are called {:?}", obstacle.name);
                let allowed = "a list of obstacles with different names";
                return reader.refuse(FaultKind::Value, field, value, allowed, hint);
            }
        }
        Some(obstacles)
    })
}

/// Reads an obstacle; its name is empty if left out.
fn obstacle(table: &Table) -> Option<Obstacle> {
    let allowed = "a name of letters, digits, _ and -";
    let name = table.maybe("name", |field, value| {
        plain_name(table.reader, field, value, allowed).map(str::to_owned)
    });
    let shapes = [
        "plane", "cylinder", "sphere", "capsule", "box", "disc", "segment", "polygon",
    ];
    let known: Vec<&str> = shapes
        .into_iter()
        .filter(|shape| table.knows(shape))
        .collect();
    let given = table.given(&shapes);
    let one = match given.as_slice() {
        [one] => *one,
        [first, .., last] => {
            table.conflict(
                last,
                &[*first],
                "an obstacle has one shape: write another [[obstacle]]",
            );
            return None;
        }
        [] => {
            let flat = table.reader.kind.get() == PLANE;
            let example = if flat {
                "plane = { normal = [0.0, 1.0] }"
            } else {
                "plane = { normal = [0.0, 0.0, 1.0] }"
            };
            let (last, first) = known.split_last()?;
            let allowed = format!("one of {} and {last}", first.join(", "));
            table.missing("plane", &allowed, example);
            return None;
        }
    };
    let shape = match one {
        "plane" => plane(&table.inner("plane", &HALF_SPACE)?),
        "cylinder" => cylinder(&table.inner("cylinder", &CYLINDER)?),
        "sphere" => sphere(&table.inner("sphere", &SPHERE)?),
        "capsule" => capsule(&table.inner("capsule", &CAPSULE)?),
        "disc" => disc(&table.inner("disc", &DISC)?),
        "segment" => segment(&table.inner("segment", &SEGMENT)?),
        "polygon" => polygon(table),
        _ => cuboid(&table.inner("box", &BOX)?),
    };
    let hits = table.knows("friction");
    let surface = |name: &str| {
        if hits {
            table.optional(name)
        } else {
            Some(None)
        }
    };
    let (friction, restitution) = (surface("friction"), surface("restitution"));
    let motion = if hits { motion(table) } else { Some(None) };
    let touches = if table.knows("touches") {
        names_of(table, "touches")
    } else {
        Some(None)
    };
    Some(Obstacle {
        name: name?.unwrap_or_default(),
        shape: shape?,
        friction: friction?,
        restitution: restitution?,
        motion: motion?,
        touches: touches?,
    })
}

/// Reads a list of names.
fn names_of(table: &Table, name: &str) -> Option<Option<Vec<String>>> {
    let allowed = "an array of names";
    table.maybe(name, |field, value| {
        let word = |field: &str, value| {
            plain_name(
                table.reader,
                field,
                value,
                "a name of letters, digits, _ and -",
            )
            .map(str::to_owned)
        };
        table.reader.all(field, value, allowed, &word)
    })
}

/// Reads the surfaces of one pair.
fn pair(table: &Table) -> Option<ContactPair> {
    let between = names_of(table, "between");
    let (friction, restitution) = (table.optional("friction"), table.optional("restitution"));
    let apart = table.flag("apart");
    if !table.has("between") {
        table.missing(
            "between",
            "two names of bodies and obstacles",
            "between = [\"ball\", \"floor\"]",
        );
        return None;
    }
    let between: Result<[String; 2], _> = between??.try_into();
    let Ok(between) = between else {
        let allowed = "two names of bodies and obstacles";
        return table.refuse(FaultKind::Value, "between", allowed, None);
    };
    Some(ContactPair {
        between,
        friction: friction?,
        restitution: restitution?,
        apart: apart?,
    })
}

/// True if all names of `touches` and `pairs` are known; otherwise reports the others.
fn names_are_known(top: &Table, scene: &Scene) -> bool {
    let (bodies, rods) = scene.names_in_contact();
    let list = |names: &mut dyn Iterator<Item = &String>| {
        let names: Vec<String> = names.map(|name| format!("{name:?}")).collect();
        names.join(", ")
    };
    for obstacle in &scene.obstacles {
        let named = obstacle.touches.iter().flatten();
        let mut unknown = named.filter(|name| !bodies.contains(*name) && !rods.contains(*name));
        if let Some(name) = unknown.next() {
            let hint = format!(
                "the obstacle {:?} touches {name:?}, which is not there",
                obstacle.name
            );
            let allowed = format!(
                "with names in `touches` of {}",
                list(&mut bodies.iter().chain(&rods))
            );
            top.fault(FaultKind::Value, "obstacle", allowed, hint);
            return false;
        }
    }
    let obstacles: Vec<String> = scene
        .obstacles
        .iter()
        .map(|each| each.name.clone())
        .collect();
    for pair in &scene.contact.pairs {
        let [a, b] = &pair.between;
        let heavy = scene.rod.is_heavy();
        let is_body = |name: &String| bodies.contains(name) || (heavy && rods.contains(name));
        let known = |name: &String| is_body(name) || obstacles.contains(name);
        let is_rod = |name: &String| heavy && rods.contains(name);
        // Rods touch obstacles, each other and themselves, and no bodies.
        let with_body = (is_rod(a) && bodies.contains(b)) || (bodies.contains(a) && is_rod(b));
        let differ = a != b || is_rod(a);
        let fits = known(a) && known(b) && (is_body(a) || is_body(b)) && differ && !with_body;
        if !fits {
            let hint = format!("{a:?} and {b:?} are no such pair");
            let allowed = format!(
                "with two names in each of `pairs`, of a body and of another body or an obstacle, or of rods with inertia = \"full\": {}",
                list(
                    &mut bodies
                        .iter()
                        .chain(rods.iter().filter(|_| heavy))
                        .chain(&obstacles)
                )
            );
            top.fault(FaultKind::Value, "contact", allowed, hint);
            return false;
        }
    }
    true
}

/// Reads the shape of a body.
pub(super) fn body_shape(table: &Table) -> Option<Option<BodyShape>> {
    let turns = table.reader.kind.get() & TURNING != 0;
    let allowed = if turns {
        "\"point\", \"solid\", or a table such as { ball = 0.04 }"
    } else {
        "\"point\", or a table such as { ball = 0.04 }"
    };
    table.maybe("shape", |field, value| {
        if value.get_ref().is_table() {
            return solid_shape(&table.reader.table(field, value, &BODY_SHAPE, allowed)?);
        }
        match value.get_ref().as_str() {
            Some("solid") if turns && table.has("solid") => {
                solid_shape(&table.inner("solid", &MATTER)?)
            }
            Some("solid") if turns => {
                let hint = "the body has no `solid`: write one, or the shape as a table";
                table
                    .reader
                    .refuse(FaultKind::Conflict, field, value, allowed, hint)
            }
            _ => {
                let words = [("point", BodyShape::Point)];
                table.reader.choice(field, value, &words, allowed)
            }
        }
    })
}

/// Reads the shape of a solid.
fn solid_shape(table: &Table) -> Option<BodyShape> {
    let shapes = ["ball", "capsule", "cylinder", "box"];
    let known: Vec<&str> = (shapes.into_iter())
        .filter(|shape| table.knows(shape))
        .collect();
    let allowed = format!("one of {}", known.join(", "));
    let one = match table.given(&shapes)[..] {
        [one] => one,
        [] => {
            table.missing("ball", &allowed, "ball = 0.04");
            return None;
        }
        [.., last] => {
            table.fault(FaultKind::Conflict, last, &allowed, "keep one of them");
            return None;
        }
    };
    let reader = table.reader;
    let number = |field: &str, value: &_| reader.number(field, value, &SIZE);
    let two = "an array of two finite numbers > 0, [diameter, length]";
    match one {
        "ball" => table.optional("ball")?.map(BodyShape::Ball),
        "box" => table
            .maybe("box", |field, value| {
                let sides: [f64; 3] = reader.vector(field, value, &NON_NEGATIVE)?;
                if sides.iter().filter(|side| **side == 0.0).count() > 1 {
                    let allowed = "three sides > 0; one of them may be 0, which makes a plate";
                    return reader.refuse(FaultKind::Value, field, value, allowed, None);
                }
                Some(sides)
            })?
            .map(BodyShape::Box),
        round => {
            let sizes = table.maybe(round, |field, value| {
                reader.array(field, value, two, &number)
            })?;
            sizes.map(if round == "capsule" {
                BodyShape::Capsule
            } else {
                BodyShape::Cylinder
            })
        }
    }
}

/// Reads `[contact]`.
pub(super) fn contact(table: &Table) -> Option<ContactRules> {
    let (friction, restitution) = (table.number("friction"), table.number("restitution"));
    let laws = [ImpactLaw::Stronge, ImpactLaw::Poisson, ImpactLaw::Newton];
    let law = table.word("law", &laws);
    let looked_for = [
        RodsInContact::All,
        RodsInContact::None,
        RodsInContact::Obstacles,
        RodsInContact::Others,
    ];
    let rods = table.word("rods", &looked_for);
    let methods = [
        ContactMethod::Auto,
        ContactMethod::Exact,
        ContactMethod::Barrier,
    ];
    let method = table.word("method", &methods);
    let (gap, stick) = (table.optional("gap"), table.optional("stick"));
    let halve = table.flag("halve");
    let settle_speed = table.optional("settle_speed");
    let words = "an array of tables such as { between = [\"ball\", \"floor\"], friction = 0.2 }";
    let pairs = table.maybe("pairs", |field, value| {
        let read = |field: &str, value| pair(&table.reader.table(field, value, &PAIR, words)?);
        table.reader.all(field, value, words, &read)
    });
    Some(ContactRules {
        friction: friction?,
        restitution: restitution?,
        law: law?,
        rods: rods?,
        method: method?,
        gap: gap?,
        stick: stick?,
        halve: halve?,
        settle_speed: settle_speed?,
        pairs: pairs?.unwrap_or_default(),
    })
}

/// True if a motion can follow the contacts of the scene; otherwise reports why not, at `[[obstacle]]`.
pub(super) fn can_be_followed(top: &Table, scene: &Scene) -> bool {
    if !scene.has_contact() {
        return rods_can_meet(top, scene);
    }
    let at = if scene.obstacles.is_empty() {
        "body"
    } else {
        "obstacle"
    };
    let refuse = |allowed: &str, hint: &str| {
        top.fault(FaultKind::Conflict, at, allowed, hint);
        false
    };
    if !scene.is_motion() {
        let hint = "at rest one rod in space touches obstacles, written with [rod]; with [run] the bodies of an assembly hit obstacles";
        return !scene.is_assembly() || refuse("left out of an assembly at rest", hint);
    }
    let run = scene.run.as_ref();
    let rods = scene.every_rod();
    if rods.iter().any(|rod| rod.is_heavy()) {
        return heavy_can_be_followed(top, scene, at);
    }
    if scene.contact.method == ContactMethod::Barrier {
        return refuse(
            "of rods with inertia = \"full\" where contact.method = \"barrier\"",
            "contacts of light rods and their bodies are exact: leave out contact.method",
        );
    }
    let damped = rods.iter().any(|rod| rod.damping.is_some());
    if damped && scene.clamp.free {
        return refuse(
            "left out where nothing holds the base of a rod with damping",
            "hold the base of the rod: leave out clamp.free",
        );
    }
    if (scene.is_planar() || damped) && scene.clamp.motion.is_some() {
        return refuse(
            "left out where the clamp moves",
            "an obstacle may move in its place: write `motion` in [[obstacle]], and leave out clamp.motion",
        );
    }
    if scene.is_planar() && !damped && scene.is_loaded_along() {
        return refuse(
            "left out where a planar rod bears a load along it",
            "leave out the rod's mass, loads.distributed and [[load]] on the rod",
        );
    }
    if scene.has_groove() {
        return refuse(
            "left out where a body slides in a groove",
            "bodies in grooves hit nothing: leave out the groove",
        );
    }
    if run.is_some_and(|run| run.landing == LandingRule::All) {
        return refuse(
            "left out where run.landing = \"all\"",
            "a run among obstacles follows one landing: write another rule",
        );
    }
    if run.is_some_and(|run| run.method == crate::scene::Method::Symmetric) {
        return refuse(
            "left out where run.method = \"symmetric\"",
            "impacts are not reversible: leave out run.method",
        );
    }
    if !names_are_known(top, scene) {
        return false;
    }
    if !damped && run.is_some_and(|run| run.method == crate::scene::Method::Implicit) {
        return refuse(
            "left out where run.method = \"implicit\"",
            "steps of elastic rods among obstacles are explicit: leave out run.method",
        );
    }
    let points: Vec<BodyShape> = scene.shapes_of_points().collect();
    let long = |shape: &BodyShape| !matches!(shape, BodyShape::Point | BodyShape::Ball(_));
    if points.iter().any(long) {
        return refuse(
            "of a point mass a point or a ball, whose directions do not matter",
            "a body that turns has an inertia: write `inertia`, or a `solid`",
        );
    }
    let rubs = |obstacle: &Obstacle| obstacle.friction.unwrap_or(scene.contact.friction) > 0.0;
    let rubs = scene.contact.friction > 0.0
        || scene.obstacles.iter().any(rubs)
        || (scene.contact.pairs.iter()).any(|pair| pair.friction.is_some_and(|mu| mu > 0.0));
    if rubs
        && points
            .iter()
            .any(|shape| matches!(shape, BodyShape::Ball(_)))
    {
        return refuse(
            "without friction where the shape of a point mass is a ball",
            "a point mass does not turn, and friction would turn a ball; write shape = \"point\", friction = 0, or a body with an inertia",
        );
    }
    true
}

/// True if the rules of a scene without obstacles are those of rods that touch each other; otherwise reports why not.
fn rods_can_meet(top: &Table, scene: &Scene) -> bool {
    let rules = &scene.contact;
    if !top.has("contact") {
        return true;
    }
    let refuse = |allowed: &str, hint: &str| {
        top.fault(FaultKind::Conflict, "contact", allowed, hint);
        false
    };
    if rules.rods == RodsInContact::Others && !scene.every_rod().iter().all(|rod| rod.is_heavy()) {
        return refuse(
            "without rods = \"others\" where a rod has no inertia = \"full\"",
            "only rods with all of their mass touch each other: write inertia = \"full\" in every rod, or leave contact.rods out",
        );
    }
    if !scene.rods_could_meet() {
        return true;
    }
    if rules.method == ContactMethod::Exact {
        return refuse(
            "of rods without mass where contact.method = \"exact\"",
            "rods with all of their mass touch each other through a barrier: leave contact.method out",
        );
    }
    names_are_known(top, scene)
}

/// Gives rods with all of their mass that touch obstacles or each other a tolerance that elements reach, unless the
/// scene has one.
pub(super) fn choose_tolerance(top: &Table, scene: &mut Scene) {
    let given = top.get("run").and_then(|run| run.get_ref().as_table());
    let free = given.is_some_and(|run| !run.contains_key("tolerance"));
    let touches = !scene.obstacles.is_empty() && scene.barrier_gap().is_some();
    let meets = top.has("contact") && scene.rods_could_meet();
    if let (true, Some(run)) = (free && (touches || meets), &mut scene.run) {
        run.tolerance = AMONG_OBSTACLES;
    }
}

/// True if a motion of rods with all of their mass can follow the contacts of the scene; otherwise reports why not.
fn heavy_can_be_followed(top: &Table, scene: &Scene, at: &'static str) -> bool {
    let refuse = |allowed: &str, hint: &str| {
        top.fault(FaultKind::Conflict, at, allowed, hint);
        false
    };
    if scene.obstacles.is_empty() {
        return refuse(
            "without `shape` and `position` where rods have inertia = \"full\" and there is no [[obstacle]]",
            "bodies on such rods touch obstacles alone, and not each other",
        );
    }
    let bodies = || scene.assembly().into_iter().flat_map(|given| &given.bodies);
    if bodies().any(|body| body.place.is_some()) {
        return refuse(
            "left out where rods have inertia = \"full\" and a body has a position",
            "bodies that no rod holds move beside light rods: write them in a scene of their own",
        );
    }
    if scene
        .obstacles
        .iter()
        .any(|obstacle| obstacle.motion.is_some())
    {
        return refuse(
            "without motion where a rod has inertia = \"full\"",
            "rods with all of their mass touch obstacles that stand: leave out the motion of the obstacle",
        );
    }
    if scene.contact.method == ContactMethod::Exact {
        return refuse(
            "of rods without mass where contact.method = \"exact\"",
            "rods with all of their mass touch obstacles through a barrier: leave out contact.method, or write inertia = \"none\"",
        );
    }
    if scene.has_groove() {
        return refuse(
            "left out where a body slides in a groove",
            "rods in elements have no grooves: leave out the groove",
        );
    }
    if scene.clamp.motion.is_some() {
        return refuse(
            "left out where the clamp moves",
            "write the rod as an assembly: [[rod]] with `motion` in `from`, and [[body]]",
        );
    }
    if (scene.every_rod().iter()).any(|rod| !rod.relaxation.is_empty() || rod.nodes.is_some()) {
        return refuse(
            "left out where the rod has relaxation or nodes",
            "rods touch obstacles in elements, which the program chooses: leave out rod.relaxation and rod.nodes",
        );
    }
    if let Some(run) = &scene.run
        && (run.method != crate::scene::Method::Auto || run.tolerance < COARSE)
    {
        return refuse(
            "left out where a rod has inertia = \"full\" and run.tolerance is below 1e-5 or run.method is given",
            "rods touch obstacles in elements: leave out run.method, and write tolerance = 1e-4 or 1e-3",
        );
    }
    let restitution = |obstacle: &Obstacle| obstacle.restitution.is_some_and(|e| e > 0.0);
    if scene.contact.restitution > 0.0
        || scene.obstacles.iter().any(restitution)
        || (scene.contact.pairs.iter()).any(|pair| pair.restitution.is_some_and(|e| e > 0.0))
    {
        return refuse(
            "without restitution where a rod has inertia = \"full\"",
            "a rod has no coefficient of restitution, its rebound is a result; leave restitution out",
        );
    }
    let one = scene.body.iter().filter_map(|body| body.shape);
    let shapes: Vec<BodyShape> = bodies().filter_map(|body| body.shape).chain(one).collect();
    let round = |shape: &BodyShape| matches!(shape, BodyShape::Point | BodyShape::Ball(_));
    if !shapes.iter().all(round) {
        return refuse(
            "of balls and points where a rod has inertia = \"full\"",
            "write shape = \"point\" or { ball = .. } in the body",
        );
    }
    let rubs = scene.contact.friction > 0.0
        || (scene.obstacles.iter()).any(|obstacle| obstacle.friction.is_some_and(|mu| mu > 0.0))
        || (scene.contact.pairs.iter()).any(|pair| pair.friction.is_some_and(|mu| mu > 0.0));
    if rubs
        && shapes
            .iter()
            .any(|shape| matches!(shape, BodyShape::Ball(_)))
    {
        return refuse(
            "without friction where a ball hangs on a rod with inertia = \"full\"",
            "friction would turn the ball, which is not computed; write shape = \"point\", or leave friction out",
        );
    }
    names_are_known(top, scene)
}

fn disc(table: &Table) -> Option<ObstacleShape> {
    let (centre, radius) = (table.vector("centre"), table.number("radius"));
    let inside = table.flag("inside");
    Some(ObstacleShape::Disc {
        centre: centre?,
        radius: radius?,
        inside: inside?,
    })
}

fn segment(table: &Table) -> Option<ObstacleShape> {
    let (from, to) = (table.vector("from"), table.vector("to"));
    let radius = table.number("radius");
    let (from, to, radius) = (from?, to?, radius?);
    if from == to {
        let name = if table.has("to") { "to" } else { "from" };
        let hint = "with one point it is a disc: write disc = { centre = .., radius = .. }";
        if !table.has(name) {
            table.missing("to", "another point than `from`", "to = [0.0, 1.0]");
            return None;
        }
        let allowed = "another point than the other end";
        return table.refuse(FaultKind::Value, name, allowed, hint);
    }
    Some(ObstacleShape::Segment { from, to, radius })
}

fn polygon(table: &Table) -> Option<ObstacleShape> {
    let reader = table.reader;
    let allowed = "corners [x, y] of a convex polygon, from 3 to 250, either way round";
    let corners = table.maybe("polygon", |field, value| {
        let corner = |field: &str, value| reader.vector::<2>(field, value, &FINITE);
        let corners: Vec<[f64; 2]> = reader.all(field, value, allowed, &corner)?;
        let points: Vec<Vector2<f64>> = corners.iter().copied().map(Vector2::from).collect();
        match obstacle::Obstacle::polygon(&points) {
            Ok(_) => Some(corners),
            Err(why) => reader.refuse(FaultKind::Value, field, value, allowed, why.to_string()),
        }
    });
    corners?.map(ObstacleShape::Polygon)
}

fn plane(table: &Table) -> Option<ObstacleShape> {
    let (point, normal) = (table.vector("point"), direction(table, "normal"));
    Some(ObstacleShape::Plane {
        point: point?,
        normal: normal?,
    })
}

fn cylinder(table: &Table) -> Option<ObstacleShape> {
    let (point, axis) = (table.vector("point"), direction(table, "axis"));
    let (radius, inside) = (table.number("radius"), table.flag("inside"));
    Some(ObstacleShape::Cylinder {
        point: point?,
        axis: axis?,
        radius: radius?,
        inside: inside?,
    })
}

fn sphere(table: &Table) -> Option<ObstacleShape> {
    let (centre, radius) = (table.vector("centre"), table.number("radius"));
    let inside = table.flag("inside");
    Some(ObstacleShape::Sphere {
        centre: centre?,
        radius: radius?,
        inside: inside?,
    })
}

fn capsule(table: &Table) -> Option<ObstacleShape> {
    let (from, to) = (table.vector("from"), table.vector("to"));
    let radius = table.number("radius");
    let (from, to, radius) = (from?, to?, radius?);
    if from == to {
        let name = if table.has("to") { "to" } else { "from" };
        if !table.has(name) {
            table.missing("to", "another point than `from`", "to = [0.0, 1.0, 0.0]");
            return None;
        }
        let hint = "with one point it is a sphere: write sphere = { centre = .., radius = .. }";
        return table.refuse(
            FaultKind::Value,
            name,
            "another point than the other end",
            hint,
        );
    }
    Some(ObstacleShape::Capsule { from, to, radius })
}

fn cuboid(table: &Table) -> Option<ObstacleShape> {
    let (centre, sides) = (table.vector("centre"), table.vector("sides"));
    let rotation = table.maybe("rotation", |field, value| {
        rotation(table.reader, field, value)
    });
    Some(ObstacleShape::Box {
        centre: centre?,
        sides: sides?,
        rotation: rotation?,
    })
}
