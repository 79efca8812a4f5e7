//! Reader of `[[rod.tendon]]`.

use super::fields::{HELIX, HISTORY, OFFSET, STATICS, TENDON};
use super::loads::size;
use super::phrases::Short;
use super::ranges::{Rule, SIZE, VALUE};
use super::table::{Absent, Alternative, MissingField, Table};
use super::varying::ROUNDING;
use crate::scene::{FaultKind, History, Inertia, Pull, Rod, Tendon};
use crate::section::Route;

/// Bound on the number of tendons of a rod.
pub(in crate::scene) const TENDONS: usize = 16;

/// Reads the tendons of a rod of the given length, if known.
pub(super) fn tendons(rod: &Table, length: Option<f64>) -> Option<Vec<Tendon>> {
    let reader = rod.reader;
    let words = "an array of at most 16 tables [[rod.tendon]], such as { offset = [0.01, 0.0], tension = 5.0 }";
    rod.read("tendon", "", Absent::Or(Vec::new()), |field, value| {
        let one = |field: &str, value| {
            let example = "a table such as { offset = [0.01, 0.0], tension = 5.0 }";
            tendon(&reader.table(field, value, &TENDON, example)?, length)
        };
        let list = reader.list(field, value, words, &one)?;
        if list.len() > TENDONS {
            let hint = format!("it has {} elements", list.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        list.into_iter().collect()
    })
}

fn tendon(table: &Table, length: Option<f64>) -> Option<Tendon> {
    let to = anchor(table, length);
    let until = to.flatten().or(length);
    let route = route(table, until);
    let pull = pull(table);
    Some(Tendon {
        route: route?,
        to: to?,
        pull: pull?,
    })
}

fn anchor(table: &Table, length: Option<f64>) -> Option<Option<f64>> {
    let to = table.optional("to")?;
    match (to, length) {
        (Some(to), Some(length)) if !(to <= length * (1.0 + ROUNDING)) => {
            let allowed = format!("at most the length of the rod, {}", Short(length));
            table.refuse(FaultKind::Value, "to", allowed, None)
        }
        (Some(to), Some(length)) => Some(Some(to.min(length))),
        _ => Some(to),
    }
}

fn pull(table: &Table) -> Option<Pull> {
    let given = |name: &str, rule: &Rule, hint: &str| {
        let x = table.optional(name)?;
        match x {
            Some(x) if !(rule.holds)(x) => {
                table.refuse(FaultKind::Value, name, rule.allowed, hint.to_owned())
            }
            x => Some(x),
        }
    };
    let slack = "a tendon only pulls; one that nothing pulls has tension = 0";
    let tension = if table.has("tension") {
        tension(table, slack).map(Some)
    } else {
        Some(None)
    };
    let length = given("length", &SIZE, "it is the path from s = 0 to the anchor");
    if table.reader.kind.get() != STATICS && table.has("length") {
        let hint =
            "a tendon of given length is for statics of one rod, [rod] and [end]; write `tension`";
        return table.refuse(FaultKind::Conflict, "length", "left out here", hint);
    }
    table.either(
        Alternative {
            name: "tension",
            value: tension.map(|x| x.map(Pull::Tension)),
        },
        Alternative {
            name: "length",
            value: length.map(|x| x.map(Pull::Length)),
        },
        "keep one of the two: the other follows",
        &MissingField {
            name: "tension",
            allowed: "a finite number >= 0; or length, a number > 0",
            example: "tension = 5.0",
        },
    )
}

/// Reads a tension, constant or in time.
fn tension(table: &Table, slack: &str) -> Option<History> {
    let tension = number_or_history(table, "tension", &VALUE)?;
    let sinks = match &tension {
        History::Constant(x) => !(*x >= 0.0),
        History::Ramp(ramp) => !(ramp.from >= 0.0 && ramp.to >= 0.0),
        History::Pulse(pulse) => !(pulse.amplitude >= 0.0),
        History::Sine(sine) => !(sine.mean >= sine.amplitude.abs()),
        History::Table(rows) => rows.iter().any(|row| !(row[1] >= 0.0)),
        _ => true,
    };
    if sinks {
        let allowed =
            "a finite number >= 0, or a sine, a ramp, a pulse or a table that is never negative";
        return table.refuse(FaultKind::Value, "tension", allowed, slack.to_owned());
    }
    Some(tension)
}

/// Refuses driven rest strains, and section laws in time, of rods for which there is no computation.
pub(super) fn is_driven_as_known(table: &Table, rod: &Rod, motion: bool) -> Option<()> {
    let kind = FaultKind::Conflict;
    let Some(name) = rod.field_in_time() else {
        return Some(());
    };
    if !motion {
        let hint =
            "at rest there is no time: write a number; a table in time is for a scene with [run]";
        return table.refuse(kind, name, "constant at rest", hint);
    }
    if rod.inertia == Some(Inertia::FirstOrder) {
        let hint = "a section law varies in time of a rod with inertia = \"none\", and of one with inertia = \"full\": write one of the two";
        let allowed = "constant of a rod with first-order inertia";
        return table.refuse(kind, name, allowed, hint);
    }
    Some(())
}

/// Reads a number or, in a motion in space, a table in time.
pub(super) fn number_or_history(table: &Table, name: &str, rule: &Rule) -> Option<History> {
    let reader = table.reader;
    let default = History::Constant(table.default(name));
    let absent = if table.default(name).is_finite() {
        Absent::Or(default)
    } else {
        Absent::Fault
    };
    table.read(name, rule.allowed, absent, |field, value| {
        if !value.get_ref().is_table() {
            return reader.number(field, value, rule).map(History::Constant);
        }
        if reader.kind.get() == STATICS {
            let hint = "a table in time is for motions of elastic rods, with a body and [run]";
            return reader.refuse(
                FaultKind::Conflict,
                field,
                value,
                rule.allowed,
                hint.to_owned(),
            );
        }
        let allowed = "a number; or a table such as { ramp = { to = 1.0, until = 1.0 } }";
        size(&reader.table(field, value, &HISTORY, allowed)?)
    })
}

/// Reads the offset of a tendon with its anchor at `until`, if known.
fn route(table: &Table, until: Option<f64>) -> Option<Route> {
    let reader = table.reader;
    let allowed = "two finite numbers, [d1, d2]; or { linear = [[d1, d2], [d1, d2]] }, \
                   { helix = { distance = 0.01, phase = 0.0, turns = 1.0 } } or { table = [[s, d1, d2], ..] }";
    table.read("offset", allowed, Absent::Fault, |field, value| {
        let pair = |field: &str, value: &_| {
            let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
            reader.array(field, value, "two finite numbers, [d1, d2]", &number)
        };
        if value.get_ref().is_array() {
            let at = pair(field, value)?;
            return Some(Route::Linear([at, at]));
        }
        let inner = reader.table(field, value, &OFFSET, allowed)?;
        let given = inner.given(&["linear", "helix", "table"]);
        let [form, rest @ ..] = given.as_slice() else {
            inner.missing("linear", allowed, "linear = [[0.01, 0.0], [0.002, 0.0]]");
            return None;
        };
        if let [second, ..] = rest {
            inner.conflict(second, &[form], "keep one of the forms");
            return None;
        }
        match *form {
            "linear" => {
                let words = "two offsets, [[d1, d2], [d1, d2]], at s = 0 and at the anchor";
                inner.read("linear", words, Absent::Fault, |field, value| {
                    reader.array(field, value, words, &pair).map(Route::Linear)
                })
            }
            "helix" => {
                let helix = inner.inner("helix", &HELIX)?;
                let (distance, phase) = (helix.number("distance"), helix.number("phase"));
                let turns = helix.number("turns");
                Some(Route::Helix {
                    distance: distance?,
                    phase: phase?,
                    turns: turns?,
                })
            }
            _ => rows(&inner, until),
        }
    })
}

fn rows(table: &Table, until: Option<f64>) -> Option<Route> {
    let reader = table.reader;
    let words = "2 to 500 rows [s, d1, d2], s growing from 0 at least to the anchor";
    table.read("table", words, Absent::Fault, |field, value| {
        let row = |field: &str, value| {
            let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
            reader.array(field, value, "a row [s, d1, d2]", &number)
        };
        let mut rows: Vec<[f64; 3]> = reader.all(field, value, words, &row)?;
        let grows = rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        let begins = rows.first().is_some_and(|row| row[0] == 0.0);
        let last = rows.last().map_or(f64::NAN, |row| row[0]);
        let until = until.unwrap_or(last);
        let covers = last >= until * (1.0 - ROUNDING);
        if !((2..=500).contains(&rows.len()) && grows && begins && covers) {
            let hint = format!(
                "it has {} rows, the anchor is at s = {}; a guide is a kink of the table",
                rows.len(),
                Short(until)
            );
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        if let Some(row) = rows.last_mut() {
            row[0] = row[0].max(until);
        }
        Some(Route::Table(rows))
    })
}
