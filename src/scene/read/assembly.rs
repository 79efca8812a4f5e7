//! Reader of assemblies: `[[rod]]`, `[[body]]` and their common tables.

use super::branch::continuation;
use super::ends::{direction, inertia, orientation};
use super::fields::{BODY, CONTINUE, GUESS, LOADS, ROD, RUN, SITE, SOLVE, START, Spec};
use super::groove::groove;
use super::load_list::{Bearers, BearingRod, Listed, load_list};
use super::loads::{load, loads, spread};
use super::obstacle::{CONTACT, body_shape, can_be_followed, choose_tolerance, contact, obstacles};
use super::plane::{lies_in_plane, lift};
use super::ranges::MOMENT;
use super::reader::Reader;
use super::rod::{RodTraits, rod};
use super::rod_end::{BodyTraits, has_free_end, site};
use super::run::{run, solve};
use super::scene::{default, part, units};
use super::solid::{Matter, has_extent, matter};
use super::station::stations;
use super::table::{Absent, Table};
use super::tendon::is_driven_as_known;
use crate::scene::lower::heavy_in_space;
use crate::scene::{
    AssemblyBody, AssemblyRod, AssemblyScene, Clamp, ContactRules, Extent, FaultKind, Force,
    FreeRod, Guess, InitialShape, Load, LoadAlong, Loads, Rod, Scene, SceneKind, Site, SiteJoint,
    Solve, Start, Straight,
};

/// A rod as read. A rod held at both ends also has the attachment of its end and the load along it.
type AnyRod = (FreeRod, Option<(Site, LoadAlong)>);

/// Reads every field before returning `None`, for a complete list of faults.
pub(super) fn assembly(top: &Table) -> Option<Scene> {
    let units = units(top);
    let rod_tables = if !top.has("rod") && bodies_are_free(top) {
        Some(Vec::new())
    } else {
        tables(
            top,
            "rod",
            &ROD,
            "name = \"left\", model = \"cosserat\", ...",
        )
    };
    let full = rod_tables
        .iter()
        .flatten()
        .any(|rod| RodTraits::of(rod).heavy);
    let body_tables = if top.has("body") || top.has("run") && !full {
        tables(top, "body", &BODY, "name = \"m\" and mass = 1.0")
    } else {
        Some(Vec::new())
    };
    // One rod stands for all: differences between rods are reported separately.
    let memory = rod_tables.iter().flatten().next().map(RodTraits::of);
    let run = match part(top, &RUN) {
        Some(Some(table)) => run(&table, memory).map(Some),
        Some(None) => Some(None),
        None => None,
    };
    let motion = top.has("run");
    let plane = if top.has("plane") {
        direction(top, "plane").map(Some)
    } else {
        Some(None)
    };
    let loads = default(part(top, &LOADS), Loads::default(), |table| {
        loads(table, None, false, None)
    });
    let solve = default(part(top, &SOLVE), Solve::default(), solve);
    let bodies = body_tables.as_deref().map(|tables| {
        let names = names(tables, "body");
        let read = tables.iter().zip(&names);
        let read = read.map(|(table, name)| body(table, name.clone(), motion, full));
        let list: Vec<Option<AssemblyBody>> = read.collect();
        let points = tables
            .iter()
            .map(|table| is_point(table, motion, full))
            .collect();
        (list, BodyTraits { names, points })
    });
    if let Some(tables) = &body_tables {
        guesses_are_whole(tables);
    }
    let rods = rod_tables.as_deref().map(|tables| {
        let none = BodyTraits {
            names: Vec::new(),
            points: Vec::new(),
        };
        let known = bodies.as_ref().map_or(&none, |(_, known)| known);
        let read = tables.iter().zip(names(tables, "rod"));
        let kind = (motion, top.has("plane"));
        let read = read.map(|(table, name)| one_rod(table, name, known, bodies.is_some(), kind));
        read.collect::<Vec<Option<AnyRod>>>()
    });
    let start = default(part(top, &START), settled(), |table| {
        let rods = rod_tables.iter().flatten();
        // Only loops of light rods are excluded here; loops of heavy rods are checked when the rods are placed.
        let light = rods.filter(|rod| !has_free_end(rod) && !RodTraits::of(rod).heavy);
        let bodies = body_tables.as_ref().map_or(0, Vec::len);
        start(table, motion, light.count(), bodies)
    });
    rod_tables.as_deref().map(free_come_last);
    body_tables.as_deref().map(free_bodies_come_last);
    let alike = rod_tables
        .as_deref()
        .is_none_or(|tables| masses_are_alike(tables, motion));
    let rods: Option<Vec<AnyRod>> = rods.and_then(|rods| rods.into_iter().collect());
    let rods = rods.map(|all| {
        let (mut held, mut free) = (Vec::new(), Vec::new());
        for (rod, to) in all {
            match to {
                None => free.push(rod),
                Some((to, distributed)) => held.push(AssemblyRod {
                    name: rod.name,
                    rod: rod.rod,
                    distributed,
                    from: rod.from,
                    to,
                }),
            }
        }
        (held, free)
    });
    let free = matches!(&start, Some(start) if matches!(start.place, InitialShape::Rest { .. }));
    if let (Some((rods, _)), Some(tables), Some((_, known)), false) =
        (&rods, &body_tables, &bodies, free)
    {
        all_are_reached(tables, known, rods, motion);
    }
    let bodies: Option<Vec<AssemblyBody>> =
        bodies.and_then(|(bodies, _)| bodies.into_iter().collect());
    let ((rods, free), bodies) = (rods?, bodies?);
    if rods.is_empty()
        && !full
        && let Some(table) = rod_tables.iter().flatten().next()
    {
        let hint = "write to = { body = \"...\" } or to = { position = [...] } in a [[rod]]";
        let allowed = "on a body or on the ground, of one rod at least: an assembly is what such rods hold together";
        return table.refuse(FaultKind::Conflict, "to", allowed, hint);
    }
    let mut given = AssemblyScene {
        plane: plane?,
        rods,
        free,
        bodies,
    };
    for listed in load_list(top, &bearers(&given, motion))? {
        match listed {
            Listed::Rod { rod, load } => given.rods[rod].rod.loads.push(load),
            Listed::Body {
                body,
                force,
                couple,
            } => {
                given.bodies[body].force.extend(force);
                given.bodies[body].couple.extend(couple);
            }
        }
    }
    if motion && given.is_heavy() {
        given.fill_massless();
    } else if motion && !given.bodies.iter().any(|body| !body.is_massless()) {
        let hint = "rods without mass move with heavy bodies: give one [[body]] a mass, or the rods a mass and inertia = \"full\"";
        let allowed = "of one [[body]] at least: a finite number > 0";
        return top.refuse(FaultKind::Conflict, "body", allowed, hint);
    }
    let held = given.rods.iter().map(|rod| (&rod.name, &rod.rod));
    let free = given.free.iter().map(|rod| (&rod.name, &rod.rod));
    let lengths = held.chain(free);
    let lengths: Vec<(&str, f64)> = lengths
        .map(|(name, rod)| (name.as_str(), rod.length))
        .collect();
    let bodies = given.bodies.iter().map(|body| body.name.as_str());
    let bodies: Vec<&str> = bodies.collect();
    let stations = stations(top, &lengths, &bodies)?;
    let obstacles = obstacles(top);
    let rules = default(part(top, &CONTACT), ContactRules::default(), contact);
    let first = given.every_rod().next().cloned();
    let mut scene = Scene {
        units: units?,
        rod: first.unwrap_or_else(Rod::unit),
        clamp: Clamp::default(),
        body: None,
        end: None,
        start: start?,
        loads: loads?,
        stations,
        obstacles: obstacles?,
        contact: rules?,
        run: run?,
        solve: solve?,
        continuation: None,
        kind: SceneKind::Assembly(given),
    };
    let follow = default(part(top, &CONTINUE), None, |table| {
        if motion {
            let hint = "a branch is one of equilibria; a scene with [run] is one of motion";
            return top.refuse(
                FaultKind::Conflict,
                "continue",
                "left out where there is [run]",
                hint,
            );
        }
        continuation(table, Some(&scene)).map(Some)
    });
    scene.continuation = follow?;
    if !alike {
        return None;
    }
    let tables = rod_tables.as_deref().unwrap_or_default();
    for (k, table) in tables.iter().enumerate() {
        if table
            .get("inertia")
            .and_then(|value| value.get_ref().as_str())
            == Some("first-order")
            && let Some(why) = scene.not_first_order_in_assembly(k)
        {
            let hint = format!("the mass is not followed to first order: {why}");
            return table.refuse(FaultKind::Conflict, "inertia", "\"none\" here", hint);
        }
    }
    let lists = (tables, body_tables.as_deref().unwrap_or_default());
    if !(scene.assembly()).is_some_and(|given| lies_in_plane(top, lists, &scene, given)) {
        return None;
    }
    let tables = rod_tables?;
    if let (true, SceneKind::Assembly(given)) = (motion, &mut scene.kind) {
        lift(given, &tables);
        if let Some(first) = given.every_rod().next() {
            scene.rod = first.clone();
        }
    }
    scene.choose_inertia();
    choose_tolerance(top, &mut scene);
    (can_be_built(top, &tables, &scene) && can_be_followed(top, &scene)).then_some(scene)
}

/// True if there are bodies, and every body has a `position`: no rod holds a body.
fn bodies_are_free(top: &Table) -> bool {
    let bodies = top.get("body").and_then(|list| list.get_ref().as_array());
    let placed = |body: &toml::Spanned<toml::de::DeValue>| {
        let body = body.get_ref().as_table();
        body.is_some_and(|body| body.contains_key("position"))
    };
    bodies.is_some_and(|list| !list.is_empty() && list.iter().all(placed))
}

/// Reports bodies with a place of their own before others. Paths such as `body[0]` then count the same bodies with and
/// without those that no rod holds.
fn free_bodies_come_last(tables: &[Table]) {
    let held = tables.iter().rposition(|table| !table.has("position"));
    let before = tables.iter().take(held.unwrap_or(0));
    for table in before.filter(|table| table.has("position")) {
        let allowed = "of bodies that come after all others";
        let hint = "move this [[body]] below the bodies that rods hold";
        table.fault(FaultKind::Conflict, "position", allowed, hint);
    }
}

/// Bodies and rods that loads may act on.
fn bearers(given: &AssemblyScene, motion: bool) -> Bearers<'_> {
    let bodies = given.bodies.iter();
    let rods = given.rods.iter();
    Bearers {
        bodies: bodies.clone().map(|body| body.name.as_str()).collect(),
        rigid: bodies.map(|body| body.extent.is_some()).collect(),
        rods: rods
            .map(|rod| BearingRod::new(&rod.name, &rod.rod))
            .collect(),
        held: false,
        motion,
    }
}

/// The tables of an array that must not be empty.
fn tables<'a>(
    top: &Table<'a>,
    name: &'static str,
    spec: &'static Spec,
    example: &str,
) -> Option<Vec<Table<'a>>> {
    let allowed = format!("tables [[{name}]], one at least");
    let hint = format!("add `[[{name}]]` with {example}");
    let Some(value) = top.get(name) else {
        let kind = FaultKind::Missing;
        top.reader.record(kind, top.at, name, None, allowed, hint);
        return None;
    };
    if value.get_ref().is_table() {
        let hint = format!("write it with two brackets, [[{name}]]: there may be several");
        top.reader.wrong_type(name, value, &allowed, Some(&hint));
        return None;
    }
    let words = format!("a table, [[{name}]]");
    let read = |field: &str, value| top.reader.table(field, value, spec, &words);
    let all = top.reader.all(name, value, &allowed, &read)?;
    if all.is_empty() {
        return top.refuse(FaultKind::Value, name, allowed, hint);
    }
    Some(all)
}

/// Reads a name.
pub(super) fn plain_name<'a>(
    reader: &Reader,
    field: &str,
    value: &'a toml::Spanned<toml::de::DeValue<'a>>,
    allowed: &str,
) -> Option<&'a str> {
    let Some(word) = value.get_ref().as_str() else {
        reader.wrong_type(field, value, allowed, None);
        return None;
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if word.is_empty() || !word.chars().all(plain) {
        return reader.refuse(FaultKind::Value, field, value, allowed, None);
    }
    Some(word)
}

/// Names of rods or bodies; `None` for a name with a fault.
fn names(tables: &[Table], of: &str) -> Vec<Option<String>> {
    let mut names: Vec<Option<String>> = Vec::new();
    for table in tables {
        let allowed = "a name: letters, digits, - and _";
        let name = table.read("name", allowed, Absent::Fault, |field, value| {
            let reader = table.reader;
            let word = plain_name(reader, field, value, allowed)?;
            let same = |name: &Option<String>| name.as_deref() == Some(word);
            if let Some(first) = names.iter().position(same) {
                let hint = format!("{of}[{first}] has this name already (counted from 0)");
                let allowed = format!("another name than those of the other [[{of}]]");
                return reader.refuse(FaultKind::Conflict, field, value, allowed, hint);
            }
            Some(word.to_owned())
        });
        names.push(name);
    }
    names
}

/// True for a node: a body without mass and inertia. In a motion of light rods the mass 0 must be given.
fn is_node(table: &Table, motion: bool, full: bool) -> bool {
    let left_out = !table.has("mass") && (!motion || full);
    (left_out || is_massless(table)) && !has_extent(table)
}

/// True for a point mass.
fn is_point(table: &Table, motion: bool, full: bool) -> bool {
    !has_extent(table) && !is_node(table, motion, full)
}

fn body(table: &Table, name: Option<String>, motion: bool, full: bool) -> Option<AssemblyBody> {
    let allowed =
        "an array of three finite numbers > 0, about the axes of the body; or three rows of three";
    let (is_node, is_point) = (is_node(table, motion, full), is_point(table, motion, full));
    let Matter {
        mass,
        inertia: moments,
    } = if is_node {
        Matter {
            mass: Some(0.0),
            inertia: Some(Some([[0.0; 3]; 3])),
        }
    } else {
        matter(table, || {
            table.maybe("inertia", |field, value| {
                inertia(table.reader, field, value, allowed, &MOMENT)
            })
        })
    };
    let (offset, rotor) = (table.vector("offset"), table.vector("rotor"));
    let rigid = Some(!is_point);
    let (force, couple) = (load(table, "force", rigid), load(table, "couple", rigid));
    let (drag, rotational_drag) = (table.number("drag"), table.number("rotational_drag"));
    let velocity = table.vector("velocity");
    let angular_velocity = table.vector("angular_velocity");
    let mut fits = true;
    let mut refuse = |names: &[&str], allowed: &str, hint: &str| {
        for name in table.given(names) {
            fits = false;
            table.fault(FaultKind::Conflict, name, allowed, hint);
        }
    };
    if !motion {
        refuse(
            &[
                "velocity",
                "angular_velocity",
                "drag",
                "rotational_drag",
                "position",
                "quaternion",
                "rotation",
            ],
            "left out at rest",
            "a scene with [run] is one of motion",
        );
        for (name, load) in [("force", &force), ("couple", &couple)] {
            let varies = |load: &Load| load.in_time().iter().any(Force::varies);
            if load.as_ref().is_some_and(varies) {
                refuse(
                    &[name],
                    "constant at rest: three numbers, or a table with `constant`",
                    "a scene with [run] is one of motion",
                );
            }
        }
    }
    if mass == Some(0.0) && !is_node {
        refuse(
            &["inertia", "solid"],
            "left out of a body without mass",
            "a body of mass 0 is a node of the rods that it joins: give it a mass, or leave this out",
        );
    }
    if is_node && motion && !full {
        let hint = "a node among rods without mass stands where they balance: only a body with a mass has a motion and drag of its own";
        refuse(
            &[
                "velocity",
                "angular_velocity",
                "drag",
                "rotational_drag",
                "position",
            ],
            "left out of a node",
            hint,
        );
        for (name, load) in [("force", &force), ("couple", &couple)] {
            let varies = |load: &Load| load.in_time().iter().any(Force::varies);
            if load.as_ref().is_some_and(varies) {
                let hint = "a load in time needs a body that moves: give this body a small mass and inertia";
                refuse(&[name], "constant on a node of rods without mass", hint);
            }
        }
    }
    if is_node {
        refuse(
            &["offset", "rotor", "groove"],
            "left out of a node, a body without mass and inertia",
            "a node only joins rods and bears loads; a body has mass and inertia",
        );
    }
    if is_point {
        refuse(
            &[
                "offset",
                "rotor",
                "couple",
                "rotational_drag",
                "angular_velocity",
            ],
            "left out of a point mass",
            "a body that turns has an inertia: write `inertia = [0.01, 0.01, 0.01]`",
        );
    }
    let guess = if table.has("guess") {
        table.inner("guess", &GUESS).and_then(|inner| {
            let allowed = "an array of three finite numbers, [x, y, z]";
            let position = if inner.has("position") {
                inner.vector("position")
            } else {
                inner.missing("position", allowed, "position = [0.5, 0.0, 0.2]");
                None
            };
            let orientation = orientation(&inner);
            Some(Some(Guess {
                position: position?,
                orientation: orientation?.unwrap_or_default(),
            }))
        })
    } else {
        Some(None)
    };
    let place = if table.has("position") {
        let (position, orientation) = (table.vector("position"), orientation(table));
        position.zip(orientation).map(|(position, orientation)| {
            Some(Guess {
                position,
                orientation: orientation.unwrap_or_default(),
            })
        })
    } else {
        let turned = table.given(&["quaternion", "rotation"]);
        for name in &turned {
            let hint = "of a body that no rod holds `position` says the place; one on rods turns with them";
            table.fault(FaultKind::Conflict, name, "given with `position`", hint);
        }
        Some(None).filter(|_| turned.is_empty())
    };
    let (groove, shape) = (groove(table), body_shape(table));
    let (offset, rotor) = (offset?, rotor?);
    let body = AssemblyBody {
        name: name?,
        mass: mass?,
        extent: moments?.map(|inertia| Extent {
            inertia,
            offset,
            rotor,
        }),
        force: force?,
        couple: couple?,
        drag: drag?,
        rotational_drag: rotational_drag?,
        guess: guess?,
        place: place?,
        groove: groove?,
        shape: shape?,
        velocity: velocity?,
        angular_velocity: angular_velocity?,
        functions: Vec::new(),
    };
    fits.then_some(body)
}

/// True for a body of mass 0.
fn is_massless(table: &Table) -> bool {
    let zero = |value: &toml::Spanned<toml::de::DeValue>| match value.get_ref() {
        toml::de::DeValue::Float(x) => x.as_str().parse() == Ok(0.0),
        toml::de::DeValue::Integer(x) => x.as_str() == "0",
        _ => false,
    };
    table.get("mass").is_some_and(zero)
}

/// Reports the bodies without a guess if other bodies have one.
fn guesses_are_whole(tables: &[Table]) {
    if !tables.iter().any(|table| table.has("guess")) {
        return;
    }
    let held = tables.iter().filter(|table| !table.has("position"));
    for table in held.filter(|table| !table.has("guess")) {
        let allowed = "given where another body has one: of all bodies, or of none";
        table.missing("guess", allowed, "guess = { position = [0.5, 0.0, 0.2] }");
    }
}

fn one_rod(
    table: &Table,
    name: Option<String>,
    bodies: &BodyTraits,
    bodies_known: bool,
    (moves, flat): (bool, bool),
) -> Option<AnyRod> {
    let rod = rod(table).rod();
    if let Some(rod) = &rod {
        is_driven_as_known(table, rod, moves)?;
        if flat && rod.drive.is_some() {
            let hint = "driven rest strains are for assemblies in space: leave out plane";
            let allowed = "left out of an assembly in a plane";
            return table.refuse(FaultKind::Conflict, "drive", allowed, hint);
        }
    }
    let length = rod.as_ref().map(|rod| rod.length);
    let distributed = spread(table, "distributed", length);
    if has_free_end(table) {
        let from = site(table, "from", bodies, bodies_known, moves);
        return Some((free_rod(table, name, rod, from?)?, None));
    }
    let (from, to) = (
        site(table, "from", bodies, bodies_known, moves),
        site(table, "to", bodies, bodies_known, moves),
    );
    let (from, to) = (from?, to?);
    let kind = FaultKind::Conflict;
    if let Some(name) = from.body.as_ref().filter(|_| from.body == to.body) {
        let allowed = "on another body than `from`, or on the ground";
        let hint = format!("the rod begins and ends on {name:?}");
        return table.refuse(kind, "to", allowed, hint);
    }
    let heavy = RodTraits::of(table).heavy;
    if moves && !heavy && from.body.is_none() && to.body.is_none() {
        let allowed = "on a body, where `from` is on the ground, in a scene with [run]; or inertia = \"full\"";
        let hint = "a rod without its own mass that joins no body moves nothing; without [run] its equilibrium is found";
        return table.refuse(kind, "to", allowed, hint);
    }
    if !flat
        && table
            .get("model")
            .is_some_and(|model| model.get_ref().as_str() == Some("elastica"))
    {
        let hint = "write `plane = [0.0, 1.0, 0.0]`, its normal, at the top of the file";
        return table.refuse(
            kind,
            "model",
            "\"cosserat\" without plane: an elastica bends in a plane",
            hint,
        );
    }
    let rod = FreeRod {
        name: name?,
        rod: rod?,
        from,
    };
    Some((rod, Some((to, distributed?))))
}

/// A rod with a free end. Faults: a load or contact on the rod, or without mass a joint at its base, which leaves its
/// rotation undetermined.
fn free_rod(table: &Table, name: Option<String>, rod: Option<Rod>, from: Site) -> Option<FreeRod> {
    let kind = FaultKind::Conflict;
    let heavy = RodTraits::of(table).heavy;
    if from.joint != SiteJoint::Weld && !heavy {
        let hint = "nothing loads a rod without mass with a free end: on a joint it would turn as it likes; a weld holds it, or inertia = \"full\"";
        let at = table.inner("from", &SITE)?;
        return at.refuse(
            kind,
            "joint",
            "\"weld\", or left out, where `to` is \"free\"",
            hint,
        );
    }
    if let Some(name) = rod.as_ref().and_then(Rod::field_in_time).filter(|_| !heavy) {
        let hint = "the section law varies in time of rods that are held at both ends, or that have inertia = \"full\"";
        return table.refuse(kind, name, "constant where `to` is \"free\"", hint);
    }
    if table.has("distributed") {
        let hint = "a rod with a free end bears nothing along it: put a small body at its end; at rest a [[body]] with a name alone is enough";
        let allowed = "left out where `to` is \"free\"";
        return table.refuse(kind, "distributed", allowed, hint);
    }
    for name in ["inertia", "section_inertia"] {
        if table.has(name) && !heavy {
            let hint = "without all of its mass a rod with a free end rides on its base as it is";
            let allowed = "left out where `to` is \"free\", or inertia = \"full\"";
            return table.refuse(kind, name, allowed, hint);
        }
    }
    if table.has("contact_diameter") && !heavy {
        let hint = "contact would load the free end; contacts of such a rod are looked for where it has inertia = \"full\"";
        let allowed = "left out where `to` is \"free\", or inertia = \"full\"";
        return table.refuse(kind, "contact_diameter", allowed, hint);
    }
    Some(FreeRod {
        name: name?,
        rod: rod?,
        from,
    })
}

/// Reports rods with a free end before other rods. Paths such as `rod[0]` count only rods held at both ends, so these
/// must come first.
fn free_come_last(tables: &[Table]) {
    let held = tables.iter().rposition(|table| !has_free_end(table));
    let before = tables.iter().take(held.unwrap_or(0));
    for table in before.filter(|table| has_free_end(table)) {
        let allowed = "\"free\" of rods that come after all others";
        let hint = "move this [[rod]] below the rods that are held at both ends";
        table.fault(FaultKind::Conflict, "to", allowed, hint);
    }
}

/// Reports rods that differ in `inertia = "full"` or in the number of nodes, and heavy rods in statics.
fn masses_are_alike(tables: &[Table], motion: bool) -> bool {
    let heavy = |table: &Table| RodTraits::of(table).heavy;
    let mut alike = true;
    for table in tables {
        let mut refuse = |name: &str, allowed: &str, hint: &str| {
            alike = false;
            table.fault(FaultKind::Conflict, name, allowed, hint);
        };
        if heavy(table) && !motion {
            let hint = "at rest the mass of rods does nothing but weigh: leave inertia out; a scene with [run] is one of motion";
            refuse("inertia", "\"none\", or left out, at rest", hint);
        } else if heavy(table) && tables.iter().any(|other| !heavy(other)) {
            let hint = "give all rods of the assembly a mass and inertia = \"full\", or none";
            refuse("inertia", "the same in all [[rod]]", hint);
        }
    }
    let number = |table: &Table| {
        let value = table.get("nodes")?.get_ref().as_integer()?;
        Some(value.as_str().to_owned())
    };
    let unlike = tables
        .iter()
        .find(|table| number(table) != number(&tables[0]));
    if let Some(other) = unlike {
        alike = false;
        let table = if other.has("nodes") {
            other
        } else {
            &tables[0]
        };
        let hint = "leave it out, and the program chooses for every rod";
        table.fault(
            FaultKind::Conflict,
            "nodes",
            "the same in all [[rod]]",
            hint,
        );
    }
    alike
}

/// Reports every body that no chain of rods joins to the ground. If all rods are heavy, the whole assembly may float.
fn all_are_reached(tables: &[Table], known: &BodyTraits, rods: &[AssemblyRod], motion: bool) {
    let number = |site: &Site| {
        let name = site.body.as_deref()?;
        known.names.iter().position(|n| n.as_deref() == Some(name))
    };
    let ends = |rod: &AssemblyRod| [number(&rod.from), number(&rod.to)];
    let heavy = rods.iter().all(|rod| rod.rod.is_heavy());
    let held = rods.iter().flat_map(ends).any(|end| end.is_none());
    let in_air = motion && heavy && !held && !tables.iter().any(|table| table.has("groove"));
    let mut joined = vec![false; tables.len()];
    if in_air {
        let on = rods.iter().flat_map(ends).flatten();
        on.for_each(|body| joined[body] = true);
    }
    for _ in 0..tables.len() {
        for rod in rods {
            let ends = ends(rod);
            if ends.iter().any(|end| end.is_none_or(|body| joined[body])) {
                ends.iter().flatten().for_each(|body| joined[*body] = true);
            }
        }
    }
    for (body, table) in tables.iter().enumerate() {
        let name = known.names[body].as_deref().unwrap_or("?");
        let alone = rods
            .iter()
            .all(|rod| number(&rod.from) != Some(body) && number(&rod.to) != Some(body));
        if table.has("position") && !alone {
            let hint = "a body on rods starts at equilibrium, or on the unloaded rods: leave it out; `guess` says near where";
            let allowed = "left out of a body that a rod holds";
            table.fault(FaultKind::Conflict, "position", allowed, hint);
        }
        if joined[body] || table.has("position") {
            continue;
        }
        let hint = match alone {
            true => format!(
                "no rod reaches it: write `to = {{ body = {name:?} }}` in a [[rod]], or its own `position` in a motion"
            ),
            false if motion && heavy => "its rods lead to other bodies only, while others are held: hold one of these on the ground by a rod, leave \
                                         all of them in the air, or start from the unloaded rods, rest = \"straight\" in [start]"
                .to_owned(),
            false if motion => "its rods lead to other bodies only, which have no equilibrium of their own: hold one of them on the ground by a \
                                rod, start from the unloaded rods, rest = \"straight\" in [start], or give all rods inertia = \"full\""
                .to_owned(),
            false => "its rods lead to other bodies only: hold one of these on the ground by a rod"
                .to_owned(),
        };
        let allowed = format!("joined to the ground by a chain of rods ({name:?})");
        let kind = FaultKind::Conflict;
        let field = table.path().to_owned();
        table
            .reader
            .record(kind, table.at, &field, None, allowed, hint);
    }
}

fn settled() -> Start {
    Start {
        place: InitialShape::Settled { settled: true },
        ..Start::default()
    }
}

fn start(table: &Table, motion: bool, rods: usize, bodies: usize) -> Option<Start> {
    let rest = table.has("rest");
    let straight = if rest {
        table.word("rest", &[Straight::Straight]).map(Some)
    } else {
        Some(None)
    };
    let flag = if table.has("settled") {
        table.maybe("settled", |field, value| table.reader.flag(field, value))
    } else {
        Some(None)
    };
    let (straight, flag) = (straight?, flag?);
    let kind = FaultKind::Conflict;
    if let Some(name) = table
        .given(&["rest", "settled"])
        .first()
        .filter(|_| !motion)
    {
        let hint = "at rest the equilibrium is what is asked for; bodies have a `guess`";
        return table.refuse(kind, name, "left out where there is no [run]", hint);
    }
    match (straight, flag) {
        (Some(_), Some(_)) => {
            table.conflict("settled", &["rest"], "keep one of them");
            None
        }
        (None, Some(false)) => {
            let hint = "for the unloaded rods write rest = \"straight\"";
            table.refuse(FaultKind::Value, "settled", "true, or left out", hint)
        }
        (Some(_), None) if rods > bodies => {
            let hint = format!(
                "{rods} rods hold {bodies} bodies and close a loop, in which unloaded rods need not fit together: leave it out, \
                 and the bodies start at equilibrium"
            );
            let allowed = "left out where rods close a loop";
            table.refuse(kind, "rest", allowed, hint)
        }
        (Some(rest), None) => Some(Start {
            place: InitialShape::Rest { rest },
            ..Start::default()
        }),
        (None, _) => Some(settled()),
    }
}

/// True if every rod can be made and the scales are normal numbers; otherwise reports the faults.
fn can_be_built(top: &Table, tables: &[Table], scene: &Scene) -> bool {
    let mut made = true;
    let Some(assembly) = scene.assembly() else {
        return false;
    };
    let held = assembly.rods.iter().map(|rod| &rod.rod);
    let rods = held.chain(assembly.free.iter().map(|rod| &rod.rod));
    for (rod, table) in rods.zip(tables) {
        let made_rod = rod.unclamped().and_then(|_| {
            if rod.is_heavy() {
                heavy_in_space(rod, &scene.scales()?).map(drop)
            } else {
                Ok(())
            }
        });
        if let Err(error) = made_rod {
            made = false;
            let allowed = "a rod whose section law can be made";
            let kind = FaultKind::Value;
            let (field, hint) = (table.path().to_owned(), error.to_string());
            top.reader
                .record(kind, table.at, &field, None, allowed, hint);
        }
    }
    if !made {
        return false;
    }
    let Some(hint) = scene.overflow() else {
        return true;
    };
    let at = tables.first().map_or(0, |table| table.at);
    let allowed = "in units in which the scales of force EI/L^2 and time sqrt(m L^3/EI), and the numbers measured by them, are numbers";
    top.reader
        .record(FaultKind::Value, at, "rod[0]", None, allowed, hint);
    false
}
