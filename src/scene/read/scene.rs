//! Reader of a whole scene: kind, tables, and conditions between tables.

use super::assembly::assembly;
use super::bar::bar;
use super::branch::continuation;
use super::ends::{body, clamp, end, in_reach};
use super::fields::{
    ASSEMBLY, BAR, BODY, CLAMP, CONTINUE, END, FLOWS, INFLATIONS, Kinds, LOADS, MEMBRANES, PLANE,
    ROD, RUN, SOLVE, SPACE, START, STATICS, Spec, TOP, TUBES,
};
use super::flow::flow;
use super::inflation::inflation;
use super::jointed::EndJoints;
use super::kind::scene_kind;
use super::load_list::{Bearers, BearingRod, Listed, load_list};
use super::loads::loads;
use super::obstacle::{CONTACT, can_be_followed, choose_tolerance, contact, obstacles};
use super::reader::Reader;
use super::rod::{RodTraits, rod};
use super::run::{run, solve};
use super::sources::Sources;
use super::start::{Known, start};
use super::station::stations;
use super::table::{Absent, Table};
use super::tendon::is_driven_as_known;
use super::wall::{membrane, tube};
use crate::scene::lower::heavy_in_space;
use crate::scene::{
    Clamp, ContactRules, End, FaultKind, Faults, Loads, Scene, SceneKind, Solve, Start, Units,
};
use toml::Spanned;
use toml::de::DeValue;

/// Reads a scene, or every fault of it.
pub(in crate::scene) fn scene(sources: &Sources) -> Result<Scene, Faults> {
    let reader = Reader::new(sources);
    let document = reader.document();
    let scene = document.and_then(|document| {
        reader.kind.set(scene_kind(&document));
        // Missing tables are reported at the end of the text, where they can be added.
        let at = sources.document().len().saturating_sub(1);
        let top = Table::open(&reader, "", &document, at, &TOP);
        match reader.kind.get() {
            ASSEMBLY => assembly(&top),
            BAR => bar(&top),
            TUBES => tube(&top),
            FLOWS => flow(&top),
            MEMBRANES => membrane(&top),
            INFLATIONS => inflation(&top),
            _ => resolve(&top),
        }
    });
    match scene {
        Some(scene) if reader.is_clean() => Ok(scene),
        _ => Err(reader.into_faults()),
    }
}

/// Reads every field before returning `None`: `?` only after the last field, as in every reader.
fn resolve(top: &Table) -> Option<Scene> {
    let kind = top.reader.kind.get();
    let motion = kind != STATICS;
    let units = units(top);
    let rod_table = part(top, &ROD);
    let memory = rod_table
        .as_ref()
        .and_then(|table| Some(RodTraits::of(table.as_ref()?)));
    let parts = rod_table
        .as_ref()
        .and_then(|table| Some(rod(table.as_ref()?)));
    let elastic = parts.as_ref().and_then(|parts| parts.elastic());
    let rod = parts.and_then(|parts| parts.rod());
    let length = rod.as_ref().map(|rod| rod.length);
    let massless = rod.as_ref().is_some_and(|rod| rod.mass().is_none());
    let clamp_table = part(top, &CLAMP);
    let clamp = match &clamp_table {
        None => None,
        Some(None) => Some(Clamp::default()),
        Some(Some(table)) => clamp(table),
    };
    let clamp_table = clamp_table.flatten();
    let body_table = part(top, &BODY);
    let joints = EndJoints::read(
        clamp_table.as_ref(),
        body_table.as_ref().and_then(Option::as_ref),
    );
    let body_is_read = body_table.is_some();
    let body_table = body_table.flatten();
    let (weld, body) = match &body_table {
        Some(table) => {
            let (weld, body) = body(table, joints.holds_body());
            (weld, body.map(Some))
        }
        None if !body_is_read => (None, None),
        None if !motion => (None, Some(None)),
        // A free end turns, but for that of a rod in the plane.
        None if memory.is_some_and(|memory| memory.heavy) => (Some(kind == SPACE), Some(None)),
        None => {
            missing_body(top, kind);
            (None, None)
        }
    };
    let at_start = top
        .get("start")
        .and_then(|table| table.get_ref().as_table());
    let settled = at_start.is_some_and(|start| start.contains_key("settled"));
    let free = clamp_table.filter(|_| clamp.as_ref().is_some_and(|clamp| clamp.free));
    let flies = free.is_none_or(|table| {
        let moved = table.has("motion");
        let heavy = memory.is_some_and(|memory| memory.heavy);
        let grooved = body_table.as_ref().is_some_and(|body| body.has("groove"));
        may_fly(&table, kind, heavy, (moved, grooved, settled))
    });
    let grooved = body_table.filter(|table| table.has("groove"));
    if let Some(table) = grooved {
        let refuse = |allowed: &str, hint: &str| {
            table.fault(FaultKind::Conflict, "groove", allowed, hint);
        };
        if memory.is_some_and(|memory| memory.damped && !memory.heavy) {
            let hint = "bodies on rods with friction and without mass move freely; leave out one of the two, or give the rod its mass with \
                        inertia = \"full\"";
            refuse(
                "left out where the rod has damping, but with inertia = \"full\"",
                hint,
            );
        }
        if clamp.as_ref().is_some_and(|clamp| clamp.motion.is_some()) {
            let hint = "the end is seen from the clamp, and a groove stands in the world; write the rod as an assembly, [[rod]] and \
                        [[body]]";
            refuse("left out where the clamp moves", hint);
        }
    }
    let end = part(top, &END).flatten().and_then(|table| end(&table));
    let known = Known {
        elastic: elastic.as_ref(),
        clamp: clamp.as_ref(),
        weld,
        memory,
    };
    let start = default(part(top, &START), Start::default(), |table| {
        start(table, known)
    });
    let loads = default(part(top, &LOADS), Loads::default(), |table| {
        loads(table, weld, massless, length)
    });
    let bearers = Bearers {
        bodies: Vec::new(),
        rods: rod.iter().map(|rod| BearingRod::new("", rod)).collect(),
        rigid: weld.into_iter().collect(),
        held: end.as_ref().is_some_and(|end: &End| !end.is_loaded()),
        motion,
    };
    let listed = load_list(top, &bearers);
    let rods: Vec<(&str, f64)> = length.map(|length| ("", length)).into_iter().collect();
    let stations = stations(top, &rods, &[]);
    let obstacles = obstacles(top);
    let rules = default(part(top, &CONTACT), ContactRules::default(), contact);
    let run = part(top, &RUN)
        .flatten()
        .and_then(|table| run(&table, memory));
    let solve = default(part(top, &SOLVE), Solve::default(), solve);
    let whole = || {
        let (mut rod, mut loads) = (rod?, loads?);
        for listed in listed? {
            match listed {
                Listed::Rod { load, .. } => rod.loads.push(load),
                Listed::Body { force, couple, .. } => {
                    loads.force.extend(force);
                    loads.couple.extend(couple);
                }
            }
        }
        Some(Scene {
            units: units?,
            rod,
            clamp: clamp?,
            body: body?,
            end: Some(end).filter(|end| end.is_some() != motion)?,
            start: start?,
            loads,
            stations: stations?,
            obstacles: obstacles?,
            contact: rules?,
            run: Some(run).filter(|run| run.is_some() == motion)?,
            solve: solve?,
            continuation: None,
            kind: SceneKind::Rod,
        })
    };
    let scene = whole().filter(|scene| flies && (motion || in_reach(top, scene)));
    let follow = default(part(top, &CONTINUE), None, |table| {
        continuation(table, scene.as_ref()).map(Some)
    });
    let (mut scene, follow, jointed) = (scene?, follow?, joints.are_any()?);
    scene.continuation = follow;
    let at = rod_table.as_ref().and_then(Option::as_ref);
    if !can_be_built(top, at.map_or(0, |table| table.at), &scene) {
        return None;
    }
    if jointed {
        scene = joints.assembly(top, scene)?;
    }
    if let (true, Some(Some(table))) = (memory.is_some_and(|memory| memory.light), &rod_table)
        && let Some(why) = if scene.is_assembly() {
            scene.not_first_order_in_assembly(0)
        } else {
            scene.not_first_order()
        }
    {
        let hint = format!(
            "the mass is not followed to first order: {why}; inertia = \"full\" has all of it"
        );
        let allowed = "\"none\" or \"full\" here";
        return table.refuse(FaultKind::Conflict, "inertia", allowed, hint);
    }
    if let Some(Some(table)) = &rod_table {
        is_driven_as_known(table, &scene.rod, motion)?;
    }
    scene.choose_inertia();
    choose_tolerance(top, &mut scene);
    can_be_followed(top, &scene).then_some(scene)
}

/// A table of the top. `None`: faulty, or missing but required. `Some(None)`: left out, or not part of this kind of
/// scene.
#[allow(clippy::option_option)]
pub(super) fn part<'a>(top: &Table<'a>, spec: &'static Spec) -> Option<Option<Table<'a>>> {
    let kind = top.reader.kind.get();
    let Some(field) = TOP.field(spec.name, kind) else {
        return Some(None);
    };
    match (top.get(spec.name), &field.need) {
        (Some(_), _) => top.inner(spec.name, spec).map(Some),
        (None, super::fields::Need::Yes(example)) => {
            let hint = match spec.name {
                "end" => format!(
                    "add `[end]` with `{example}`; left empty it is an end that is free and without load"
                ),
                "rod" => "add `[rod]` with `model = \"elastica\"`, or with `model = \"cosserat\"` and [rod.section]".to_owned(),
                name => format!("add `[{name}]` with a line such as `{example}`"),
            };
            let names: Vec<&str> = spec.names(kind).collect();
            let allowed = format!("a table with {}", names.join(", "));
            let (at, kind) = (top.at, FaultKind::Missing);
            top.reader
                .record(kind, at, spec.name, None, allowed, Some(hint));
            None
        }
        (None, _) => Some(None),
    }
}

/// True if a rod may have a free base; otherwise reports the fault. The clamp moves, the body slides in a groove, the
/// start is settled, as told.
fn may_fly(
    clamp: &Table,
    kind: Kinds,
    heavy: bool,
    (moved, grooved, settled): (bool, bool, bool),
) -> bool {
    let (allowed, hint) = if kind == STATICS {
        (
            "false at rest",
            "what nothing holds rests anywhere, or nowhere: hold the base; a rod with mass, inertia = \"full\" and [run] flies",
        )
    } else if !heavy {
        (
            "false but with inertia = \"full\" in [rod]",
            "what flies has a mass: write `mass = 0.1` and `inertia = \"full\"` in [rod]",
        )
    } else if kind == PLANE {
        (
            "false where rod.model = \"elastica\"",
            "rods fly in space: write model = \"cosserat\" with [rod.section], and a motion that starts in a plane stays there",
        )
    } else if moved {
        (
            "false where the clamp moves",
            "leave out clamp.motion: a free base moves by itself",
        )
    } else if grooved {
        (
            "false where the body slides in a groove",
            "write the rod as an assembly, [[rod]] and [[body]]",
        )
    } else if settled {
        (
            "false where the start is settled",
            "what nothing holds settles nowhere: write rest = \"straight\", or strains, in [start]",
        )
    } else {
        return true;
    };
    clamp.fault(FaultKind::Conflict, "free", allowed, hint);
    false
}

/// Reports a motion without a body, of a rod that needs one.
fn missing_body(top: &Table, kind: Kinds) {
    let names: Vec<&str> = BODY.names(kind).collect();
    let allowed = format!("a table with {}", names.join(", "));
    let hint = "add `[body]` with a line such as `mass = 1.0`; a rod alone moves by its own mass: write `mass = 0.1` and \
                `inertia = \"full\"` in [rod]"
        .to_owned();
    top.reader.record(
        FaultKind::Missing,
        top.at,
        "body",
        None,
        allowed,
        Some(hint),
    );
}

/// Reads an optional table; `absent` if left out.
#[allow(clippy::option_option)]
pub(super) fn default<'a, T>(
    table: Option<Option<Table<'a>>>,
    absent: T,
    parse: impl FnOnce(&Table<'a>) -> Option<T>,
) -> Option<T> {
    match table? {
        None => Some(absent),
        Some(table) => parse(&table),
    }
}

/// Reads the system of units; SI for a rod or a tube of a material.
pub(super) fn units(top: &Table) -> Option<Units> {
    let material = |rod: &DeValue| {
        let rod = rod.as_table();
        rod.is_some_and(|rod| rod.contains_key("material"))
    };
    let given = top
        .get("rod")
        .or_else(|| top.get("tube"))
        .map(Spanned::get_ref);
    let default = if given.is_some_and(|rod| match rod.as_array() {
        Some(rods) => rods.iter().any(|rod| material(rod.get_ref())),
        None => material(rod),
    }) {
        Units::Si
    } else {
        Units::Dimensionless
    };
    top.read("units", "", Absent::Or(default), |field, value| {
        let words = [("si", Units::Si), ("dimensionless", Units::Dimensionless)];
        let allowed = r#""si" or "dimensionless""#;
        top.reader.choice(field, value, &words, allowed)
    })
}

/// True if the rod and its friction can be made, and all scales and scaled numbers are finite; otherwise reports the
/// fault at `[rod]`.
fn can_be_built(top: &Table, at: usize, scene: &Scene) -> bool {
    let refuse = |kind: FaultKind, allowed: &str, hint: String| {
        top.reader
            .record(kind, at, "rod", None, allowed, Some(hint));
        false
    };
    let kind: Kinds = top.reader.kind.get();
    let made = match kind {
        PLANE => scene.rod.bending_stiffness().map(drop),
        SPACE if scene.rod.is_heavy() => {
            let scales = scene.scales();
            scales.and_then(|scales| heavy_in_space(&scene.rod, &scales).map(drop))
        }
        SPACE if scene.rod.damping.is_some() => scene
            .moving()
            .map(drop)
            .and_then(|()| scene.viscoelastic().map(drop)),
        _ => scene.cosserat_rod().map(drop),
    };
    if let Err(error) = made {
        let allowed = "a rod whose section law can be made";
        return refuse(FaultKind::Value, allowed, error.to_string());
    }
    if kind == STATICS {
        return true;
    }
    let Some(hint) = scene.overflow() else {
        return true;
    };
    refuse(
        FaultKind::Value,
        "in units in which the scales of force EI/L^2, time sqrt(m L^3/EI), ..., and the velocity, the loads and \
         curvatures (with their squares), the viscosities and the duration measured by them, are numbers",
        hint,
    )
}
