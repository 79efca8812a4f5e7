//! Reader of `[[load]]`: loads on ends, bodies, stations and parts of rods.

use super::fields::{ASSEMBLY, LISTED, PLANE, STATICS};
use super::loads::load;
use super::phrases::Short;
use super::ranges::VALUE;
use super::reader::Reader;
use super::table::{Absent, Table};
use super::varying::ROUNDING;
use crate::scene::{EndWord, FaultKind, Force, Load, LoadPlace, Rod, RodLoad};

/// Most loads of a scene.
const LOADS: usize = 100;

/// Bodies and rods that a load may act on.
pub(super) struct Bearers<'a> {
    /// Names of the bodies of an assembly.
    pub bodies: Vec<&'a str>,
    /// The rods.
    pub rods: Vec<BearingRod<'a>>,
    /// True for each body that has directors.
    pub rigid: Vec<bool>,
    /// True if something of the end is held, in statics of one rod.
    pub held: bool,
    /// True for a scene of motion.
    pub motion: bool,
}

/// A rod that a load may act on.
pub(super) struct BearingRod<'a> {
    /// Name in an assembly.
    pub name: &'a str,
    pub length: f64,
    /// True for a rod with friction or full mass: its state is a field of strains.
    pub has_nodes: bool,
    /// True for a rod with full mass.
    pub is_heavy: bool,
    /// The name of a field of the rod that varies in time; None if no field does.
    pub in_time: Option<&'static str>,
}

impl<'a> BearingRod<'a> {
    pub fn new(name: &'a str, rod: &Rod) -> Self {
        Self {
            name,
            length: rod.length,
            has_nodes: rod.damping.is_some() || rod.is_heavy(),
            is_heavy: rod.is_heavy(),
            in_time: rod.field_in_time(),
        }
    }
}

/// A load, with the number of the body or rod under the load.
pub(super) enum Listed {
    /// Force and couple on a body; of one rod the body at its end.
    Body {
        /// Number of the body.
        body: usize,
        force: Vec<Force>,
        couple: Vec<Force>,
    },
    /// A load on a rod.
    Rod {
        /// Number of the rod.
        rod: usize,
        load: RodLoad,
    },
}

/// Reads the loads of a scene; none without the list.
pub(super) fn load_list(top: &Table, bearers: &Bearers) -> Option<Vec<Listed>> {
    let reader = top.reader;
    let words = "tables [[load]], at most 100, such as { s = 0.5, force = [0.0, 0.0, -1.0] }";
    top.read("load", words, Absent::Or(Vec::new()), |field, value| {
        if value.get_ref().is_table() {
            let hint = "write it with two brackets, [[load]]: there may be several";
            reader.wrong_type(field, value, words, Some(hint));
            return None;
        }
        let one = |field: &str, value| {
            let table = reader.table(field, value, &LISTED, "a table, [[load]]")?;
            listed(&table, bearers)
        };
        let list = reader.list(field, value, words, &one)?;
        if list.len() > LOADS {
            let hint = format!("it has {} elements", list.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        let all: Option<Vec<Listed>> = list.into_iter().collect();
        all.map(|mut all| {
            for (k, listed) in all.iter_mut().enumerate() {
                if let Listed::Rod { load, .. } = listed {
                    load.number = k;
                }
            }
            all
        })
    })
}

/// Part of a scene on which a load acts.
enum On {
    Body(usize),
    Rod(usize, LoadPlace),
}

fn listed(table: &Table, bearers: &Bearers) -> Option<Listed> {
    let on = place(table, bearers);
    let kind = table.reader.kind.get();
    let follows = table.flag("follows");
    let rigid = match &on {
        Some(On::Body(body)) => bearers.rigid.get(*body).copied(),
        _ => None,
    };
    let of = |name: &str| match (kind, name) {
        (STATICS, name) => table.vector(name).map(Load::Constant),
        (PLANE, "couple") => Some(Load::default()),
        (_, name) => load(table, name, rigid),
    };
    let (force, couple) = (of("force"), of("couple"));
    let factor = table.number("factor");
    let (on, follows, force, couple, factor) = (on?, follows?, force?, couple?, factor?);
    if table.given(&["force", "couple"]).is_empty() {
        let example = match kind {
            PLANE => "force = [0.0, -1.0]",
            _ => "force = [0.0, 0.0, -1.0]",
        };
        table.missing("force", "the force of the load; or couple", example);
        return None;
    }
    let on = match on {
        On::Body(body) if follows && follows_end(bearers, body) => {
            let s = bearers.rods[0].length;
            On::Rod(0, LoadPlace::Station { s })
        }
        on => on,
    };
    match on {
        On::Body(body) => on_body(table, body, bearers, follows, [force, couple], factor),
        On::Rod(rod, place) => {
            let hint = if table.has("on") {
                "a load in time that turns with the end of its rod needs a body with directors there: give the body an inertia"
            } else {
                "a load in time, or one from a file, acts on a body of a motion: on = \"end\", or on the body by its name"
            };
            let constant = |name: &str, load: &Load| match load {
                Load::Constant(vector) => Some(*vector),
                Load::InTime(_) => {
                    let allowed = "three constant numbers on a rod";
                    table.refuse(FaultKind::Conflict, name, allowed, hint)
                }
            };
            let (force, couple) = (constant("force", &force), constant("couple", &couple));
            let load = RodLoad {
                number: 0,
                place,
                force: force?,
                couple: couple?,
                follows,
                factor,
            };
            on_rod(table, rod, &load, bearers)?;
            Some(Listed::Rod { rod, load })
        }
    }
}

/// True for a point mass at the end of one rod without full mass: a load on it turns with the rod's end.
fn follows_end(bearers: &Bearers, body: usize) -> bool {
    let alone = bearers.bodies.is_empty() && bearers.motion;
    let light = bearers.rods.first().is_some_and(|rod| !rod.is_heavy);
    alone && light && bearers.rigid.get(body) == Some(&false)
}

/// Refuses a load on a rod that no model computes.
fn on_rod(table: &Table, rod: usize, load: &RodLoad, bearers: &Bearers) -> Option<()> {
    if table.reader.kind.get() == STATICS {
        if load.is_on_end() && bearers.held {
            let hint =
                "something of the end is held; the force on a component that is free is end.force";
            return table.refuse(
                FaultKind::Conflict,
                "on",
                "left out where [end] holds the end",
                hint,
            );
        }
        return Some(());
    }
    let bearer = bearers.rods.get(rod);
    if table.reader.kind.get() == PLANE && load.follows && bearer.is_some_and(|rod| rod.is_heavy) {
        let hint = "loads turn with a planar elastic rod, or with a rod in space: write model = \"cosserat\" with a section";
        let allowed = "left out of a planar rod with inertia = \"full\"";
        return table.refuse(FaultKind::Conflict, "follows", allowed, hint);
    }
    // Nodes of a rod with full mass carry every load.
    if bearer.is_some_and(|rod| rod.is_heavy) {
        return Some(());
    }
    if load.follows || load.couple != [0.0; 3] {
        turns_as_known(table, load, bearer)?;
    }
    if load.is_at_station() && bearers.motion && bearer.is_some_and(|rod| rod.has_nodes) {
        let hint = "a force at one place needs an elastic rod, or one with inertia = \"full\"; write a short part of the rod, from and to, \
                    with the force per length, or two rods that a body joins";
        return table.refuse(
            FaultKind::Conflict,
            "s",
            "left out of a rod with friction and without mass in a motion",
            hint,
        );
    }
    Some(())
}

/// Refuses a load without a potential on a rod without full mass in a motion, where no model computes it.
fn turns_as_known(table: &Table, load: &RodLoad, bearer: Option<&BearingRod>) -> Option<()> {
    let field = if load.follows { "follows" } else { "couple" };
    let rubs = bearer.is_some_and(|rod| rod.has_nodes);
    if rubs && table.reader.kind.get() == PLANE {
        let hint = "in a motion with friction loads turn with rods in space: write model = \"cosserat\" with a section, or leave out damping";
        let allowed = "left out of a planar rod with friction in a motion";
        return table.refuse(FaultKind::Conflict, field, allowed, hint);
    }
    if rubs && table.has("on") {
        let hint = "a load turns with the end of an elastic rod; of a rod with friction write a short part of the rod, from and to, with the load per \
                    length, or give the body an inertia";
        let allowed = "left out on the point mass of a rod with friction";
        return table.refuse(FaultKind::Conflict, field, allowed, hint);
    }
    if rubs {
        return Some(());
    }
    if let Some(name) = bearer.and_then(|rod| rod.in_time) {
        let hint = format!(
            "{name} varies in time, and the motion of an elastic rod follows one of the two; inertia = \"full\" follows both"
        );
        let allowed = "left out of an elastic rod whose section law varies in time";
        return table.refuse(FaultKind::Conflict, field, allowed, hint);
    }
    Some(())
}

fn on_body(
    table: &Table,
    body: usize,
    bearers: &Bearers,
    follows: bool,
    [force, couple]: [Load; 2],
    factor: f64,
) -> Option<Listed> {
    let rigid = bearers.rigid.get(body).copied();
    for (name, load) in [("force", &force), ("couple", &couple)] {
        if !bearers.motion && load.in_time().iter().any(Force::varies) {
            let allowed = "constant at rest: three numbers, or a table with `constant`";
            return table.refuse(
                FaultKind::Conflict,
                name,
                allowed,
                "a scene with [run] is one of motion",
            );
        }
    }
    if rigid == Some(false) && couple != Load::default() {
        let hint = "a point mass takes no couple; give the body an inertia, or write joint = \"weld\" in [body]";
        return table.refuse(
            FaultKind::Conflict,
            "couple",
            "left out on a point mass",
            hint,
        );
    }
    if rigid == Some(false) && follows {
        let hint =
            "a point mass has no directors that the load could turn with; give the body an inertia";
        return table.refuse(
            FaultKind::Conflict,
            "follows",
            "false, or left out, on a point mass",
            hint,
        );
    }
    if factor != 1.0 {
        let hint = "a body takes the force itself: write it times the factor";
        return table.refuse(FaultKind::Conflict, "factor", "left out on a body", hint);
    }
    let parts = |load: Load| match load {
        Load::Constant(vector) if vector == [0.0; 3] => Vec::new(),
        Load::Constant(vector) => vec![Force::constant(vector, follows)],
        Load::InTime(mut parts) => {
            for part in &mut parts {
                part.follower |= follows;
            }
            parts
        }
    };
    Some(Listed::Body {
        body,
        force: parts(force),
        couple: parts(couple),
    })
}

/// Reads where a load acts.
fn place(table: &Table, bearers: &Bearers) -> Option<On> {
    let reader = table.reader;
    let kind = reader.kind.get();
    let given = table.given(&["on", "s", "from"]);
    let example = if kind == ASSEMBLY {
        "on = \"name of a body\""
    } else {
        "on = \"end\""
    };
    let [form, others @ ..] = given.as_slice() else {
        let allowed =
            "what the load acts on; or s, a place on a rod; or from and to, a part of a rod";
        table.missing("on", allowed, example);
        return None;
    };
    if let [second, ..] = others {
        table.conflict(
            second,
            &[form],
            "a load acts on one place; write another [[load]] for another",
        );
        return None;
    }
    if *form == "on" {
        if let Some(name) = table.given(&["to", "rod"]).into_iter().next() {
            table.conflict(name, &["on"], "a load acts on one place");
            return None;
        }
        return on_name(table, bearers);
    }
    let rod = rod_of(table, bearers);
    let number = |name: &str| -> Option<f64> {
        table.read(name, "a finite number", Absent::Fault, |field, value| {
            reader.number(field, value, &VALUE)
        })
    };
    if *form == "s" {
        if table.has("to") {
            table.conflict(
                "to",
                &["s"],
                "a load acts at s, or along a part, from and to",
            );
            return None;
        }
        let (s, (rod, length)) = (number("s")?, rod?);
        if !(s > 0.0 && s < length * (1.0 - ROUNDING)) {
            let hint = match kind {
                ASSEMBLY => {
                    "at an end of the rod the load acts on the body there: on = \"name of the body\""
                }
                _ => {
                    "at the length of the rod write on = \"end\"; a load at s = 0 acts on the clamp alone"
                }
            };
            let allowed = format!("inside the rod, between 0 and its length {}", Short(length));
            return table.refuse(FaultKind::Value, "s", allowed, hint.to_owned());
        }
        return Some(On::Rod(rod, LoadPlace::Station { s }));
    }
    let (from, to) = (number("from"), number("to"));
    let (from, to, (rod, length)) = (from?, to?, rod?);
    let allowed = format!("from 0 to the length of the rod, {}", Short(length));
    if !(0.0..length).contains(&from) {
        return table.refuse(FaultKind::Value, "from", allowed, None);
    }
    if !(to > from && to <= length * (1.0 + ROUNDING)) {
        let allowed = format!(
            "more than `from`, {}, and at most the length of the rod, {}",
            Short(from),
            Short(length)
        );
        return table.refuse(FaultKind::Value, "to", allowed, None);
    }
    let to = if to >= length * (1.0 - ROUNDING) {
        length
    } else {
        to
    };
    Some(On::Rod(rod, LoadPlace::Along { from, to }))
}

/// Reads `on`: the end of the rod, or a body by name.
fn on_name(table: &Table, bearers: &Bearers) -> Option<On> {
    let reader = table.reader;
    let kind = reader.kind.get();
    let quoted: Vec<String> = bearers
        .bodies
        .iter()
        .map(|name| format!("{name:?}"))
        .collect();
    let allowed = match kind {
        ASSEMBLY if quoted.is_empty() => "left out: this assembly has no bodies".to_owned(),
        ASSEMBLY => format!("the name of a body, one of {}", quoted.join(", ")),
        _ => "\"end\"".to_owned(),
    };
    table.read("on", &allowed, Absent::Fault, |field, value| {
        let Some(word) = value.get_ref().as_str() else {
            reader.wrong_type(field, value, &allowed, None);
            return None;
        };
        let found = match kind {
            ASSEMBLY => bearers
                .bodies
                .iter()
                .position(|name| *name == word)
                .map(On::Body),
            STATICS if word == "end" => Some(On::Rod(0, LoadPlace::End { on: EndWord::End })),
            _ if word == "end" => Some(On::Body(0)),
            _ => None,
        };
        found.or_else(|| {
            let hint = "a place on a rod is s, or from and to".to_owned();
            reader.refuse(FaultKind::Value, field, value, allowed.as_str(), hint)
        })
    })
}

/// Number and length of the rod that a load acts on.
fn rod_of(table: &Table, bearers: &Bearers) -> Option<(usize, f64)> {
    if table.reader.kind.get() != ASSEMBLY {
        return bearers.rods.first().map(|rod| (0, rod.length));
    }
    let names: Vec<String> = bearers
        .rods
        .iter()
        .map(|rod| format!("{:?}", rod.name))
        .collect();
    let allowed = format!(
        "the name of a rod held at both ends, one of {}",
        names.join(", ")
    );
    if !table.has("rod") {
        table.missing("rod", &allowed, "rod = \"name of a rod\"");
        return None;
    }
    table.read("rod", &allowed, Absent::Fault, |field, value| {
        let found = value.get_ref().as_str();
        let found = found.and_then(|word| bearers.rods.iter().position(|rod| rod.name == word));
        match found {
            Some(k) => Some((k, bearers.rods[k].length)),
            None => {
                let reader: &Reader = table.reader;
                reader.refuse(FaultKind::Value, field, value, allowed.as_str(), None)
            }
        }
    })
}
