//! Reader of `[loads]`.

use super::ends::{check_increasing, direction, sine};
use super::fields::{ASSEMBLY, BLOCK, DISTRIBUTED, FORCE, PLANE, PULSE, RAMP, SPACE, STATICS};
use super::load_file::from_file;
use super::phrases::Short;
use super::ranges::{FINITE, VALUE};
use super::reader::Reader;
use super::table::{Absent, Table};
use super::varying::ROUNDING;
use crate::scene::{Block, FaultKind, Force, History, Load, LoadAlong, Loads, Pulse, Ramp};
use toml::Spanned;
use toml::de::{DeArray, DeValue};

/// Reads `[loads]`. `massless` is true for a rod known to have no mass; `length` is the length of the rod, if known.
pub(super) fn loads(
    table: &Table,
    weld: Option<bool>,
    massless: bool,
    length: Option<f64>,
) -> Option<Loads> {
    if table.reader.kind.get() == STATICS {
        return along_the_rod(table, massless, length);
    }
    if table.reader.kind.get() == ASSEMBLY {
        let gravity = table.vector("gravity")?;
        return Some(Loads {
            gravity,
            ..Loads::default()
        });
    }
    let (gravity, dead) = (table.vector("gravity"), table.vector("dead"));
    let distributed = spread(table, "distributed", length);
    let drag = table.number("drag");
    let (couple, rotational_drag) = match table.reader.kind.get() {
        SPACE => (couple(table, weld), rotational_drag(table, weld)),
        _ => (Some(Load::default()), Some(0.0)),
    };
    let force = forces(table, weld);
    Some(Loads {
        gravity: gravity?,
        dead: dead?,
        distributed: distributed?,
        couple: couple?,
        drag: drag?,
        rotational_drag: rotational_drag?,
        force: force?,
        ..Loads::default()
    })
}

/// Reads the loads of a rod in statics.
fn along_the_rod(table: &Table, massless: bool, length: Option<f64>) -> Option<Loads> {
    let (gravity, distributed) = (
        table.vector("gravity"),
        spread(table, "distributed", length),
    );
    let (follower, load) = (spread(table, "follower", length), table.number("load"));
    let gravity = gravity?;
    if massless && gravity != [0.0; 3] {
        let hint = "gravity acts on the mass of the rod: write mass = 0.02 in [rod], or give its material a density and its section a shape";
        let allowed = "0, or left out, where the rod has no mass";
        return table.refuse(FaultKind::Conflict, "gravity", allowed, hint);
    }
    Some(Loads {
        gravity,
        distributed: distributed?,
        follower: follower?,
        load: load?,
        ..Loads::default()
    })
}

/// Reads a force per length of a rod: constant, a polynomial in s/length, or a table in s.
pub(super) fn spread(table: &Table, name: &str, length: Option<f64>) -> Option<LoadAlong> {
    let reader = table.reader;
    let (plane, allowed) = match reader.kind.get() {
        PLANE => (
            true,
            "two finite numbers, [fx, fy], constant; or a table such as { table = [[0.0, 0.0, -1.0], [1.0, 0.0, -2.0]] } or \
             { polynomial = [[0.0, -1.0], [0.0, -1.0]] }",
        ),
        _ => (
            false,
            "three finite numbers, [fx, fy, fz], constant; or a table such as { table = [[0.0, 0.0, 0.0, -1.0], [1.0, 0.0, 0.0, -2.0]] } \
             or { polynomial = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]] }",
        ),
    };
    let point = |field: &str, value: &_| reader.point(field, value, &VALUE);
    table.read(
        name,
        "",
        Absent::Or(LoadAlong::default()),
        |field, value| {
            if value.get_ref().is_array() {
                return point(field, value).map(LoadAlong::Constant);
            }
            let inner = reader.table(field, value, &DISTRIBUTED, allowed)?;
            if inner.has("polynomial") {
                let hint = "keep one of the two forms";
                if inner.has("table") {
                    inner.conflict("table", &["polynomial"], hint);
                    return None;
                }
                let words = "an array of 1 to 16 vectors, c0 + c1 x + ..., x = s / length";
                return inner.read("polynomial", words, Absent::Fault, |field, value| {
                    let polynomial = reader.all(field, value, words, &point)?;
                    if !(1..=16).contains(&polynomial.len()) {
                        let hint = Some(format!("it has {} elements", polynomial.len()));
                        return reader.refuse(FaultKind::Value, field, value, words, hint);
                    }
                    Some(LoadAlong::Polynomial { polynomial })
                });
            }
            let words = if plane {
                "2 to 500 rows [s, fx, fy], s growing from 0 to the length of the rod"
            } else {
                "2 to 500 rows [s, fx, fy, fz], s growing from 0 to the length of the rod"
            };
            inner.read("table", words, Absent::Fault, |field, value| {
                let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
                let row = |field: &str, value| {
                    if plane {
                        let row = reader.array(field, value, "a row [s, fx, fy]", &number);
                        row.map(|[s, x, y]| [s, x, y, 0.0])
                    } else {
                        reader.array(field, value, "a row [s, fx, fy, fz]", &number)
                    }
                };
                let mut table: Vec<[f64; 4]> = reader.all(field, value, words, &row)?;
                let count = table.len();
                let grows = table.windows(2).all(|pair| pair[0][0] < pair[1][0]);
                let begins = table.first().is_some_and(|first| first[0] == 0.0);
                let ends = match table.last_mut() {
                    Some(last) => {
                        let length = length.unwrap_or(last[0]);
                        let ends = (last[0] - length).abs() <= ROUNDING * length;
                        last[0] = length;
                        begins && ends
                    }
                    None => false,
                };
                if !((2..=500).contains(&count) && grows && ends) {
                    let told = length.map_or(String::new(), |length| {
                        format!(", the rod is {} long", Short(length))
                    });
                    let hint = Some(format!("it has {count} rows{told}; a jump is a short ramp"));
                    return reader.refuse(FaultKind::Value, field, value, words, hint);
                }
                Some(LoadAlong::Table { table })
            })
        },
    )
}

fn couple(table: &Table, weld: Option<bool>) -> Option<Load> {
    let couple = load(table, "couple", weld)?;
    if weld != Some(false) || couple == Load::default() {
        return Some(couple);
    }
    let hint = "an end that is free to turn takes no couple, and its body is a point; write joint = \"weld\" in [body]";
    let allowed = "0, or left out, where the joint is a ball";
    table.refuse(FaultKind::Conflict, "couple", allowed, hint)
}

fn rotational_drag(table: &Table, weld: Option<bool>) -> Option<f64> {
    let drag = table.number("rotational_drag")?;
    if weld != Some(false) || drag == 0.0 {
        return Some(drag);
    }

    let hint = "the end of a ball joint is free to turn, and its body is a point; write joint = \"weld\" in [body]";
    table.refuse(
        FaultKind::Conflict,
        "rotational_drag",
        "0, or left out, where the joint is a ball",
        hint,
    )
}

fn forces(loads: &Table, weld: Option<bool>) -> Option<Vec<Force>> {
    let allowed = match loads.reader.kind.get() {
        PLANE => {
            "a table such as { direction = [0.0, 1.0], amplitude = 0.5, frequency = 2.0 }, or an array of them"
        }
        _ => {
            "a table such as { direction = [0.0, 1.0, 0.0], amplitude = 0.5, frequency = 2.0 }, or an array of them"
        }
    };
    loads.read("force", "", Absent::Or(Vec::new()), |field, value| {
        in_time(loads.reader, field, value, allowed, weld)
    })
}

/// Reads a force or couple in space: a constant vector, or tables in time. `weld` is true if the body has directors.
pub(super) fn load(table: &Table, name: &str, weld: Option<bool>) -> Option<Load> {
    let reader = table.reader;
    let allowed = "three finite numbers, [x, y, z], constant; or a table such as { direction = [0.0, 1.0, 0.0], amplitude = 0.5, \
                   frequency = 2.0 }, or an array of tables";
    table.read(name, "", Absent::Or(Load::default()), |field, value| {
        let numbers = |array: &DeArray| !array.iter().any(|part| part.get_ref().is_table());
        if value.get_ref().as_array().is_some_and(numbers) {
            reader.point(field, value, &VALUE).map(Load::Constant)
        } else {
            in_time(reader, field, value, allowed, weld).map(Load::InTime)
        }
    })
}

fn in_time<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    allowed: &str,
    weld: Option<bool>,
) -> Option<Vec<Force>> {
    let DeValue::Array(array) = value.get_ref() else {
        return forces_of(reader, field, value, allowed, weld);
    };
    let read = |(i, value)| forces_of(reader, &format!("{field}[{i}]"), value, allowed, weld);
    let forces: Vec<Option<Vec<Force>>> = array.iter().enumerate().map(read).collect();
    let forces: Option<Vec<Vec<Force>>> = forces.into_iter().collect();
    forces.map(|forces| forces.into_iter().flatten().collect())
}

fn forces_of<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    allowed: &str,
    weld: Option<bool>,
) -> Option<Vec<Force>> {
    let table = reader.table(field, value, &FORCE, allowed)?;
    let own = if table.has("file") {
        let strangers = [
            "direction",
            "constant",
            "amplitude",
            "frequency",
            "phase",
            "ramp",
            "pulse",
            "table",
        ];
        if let Some(stranger) = table.given(&strangers).into_iter().next() {
            table.conflict(stranger, &["file"], "the file has all components and times");
            return None;
        }
        None
    } else {
        Some((direction(&table, "direction"), size(&table)))
    };
    let follower = match reader.kind.get() {
        PLANE => Some(false),
        _ => table.flag("follower"),
    };
    if follower == Some(true) && weld == Some(false) {
        let hint =
            "a point mass has no directors that the load could turn with; give the body an inertia";
        return table.refuse(
            FaultKind::Conflict,
            "follower",
            "false, or left out, on a point mass",
            hint,
        );
    }
    let Some((direction, size)) = own else {
        return from_file(&table, follower?);
    };
    Some(vec![Force {
        direction: direction?,
        size: size?,
        follower: follower?,
    }])
}

pub(super) fn size(table: &Table) -> Option<History> {
    let chosen = table.given(&["constant", "ramp", "pulse", "block", "table"]);
    let [form, others @ ..] = chosen.as_slice() else {
        return sine(table).map(History::Sine);
    };
    let strangers = [others, &table.given(&["amplitude", "frequency", "phase"])].concat();
    for stranger in &strangers {
        let hint = "a force is constant, a sine, a ramp, a pulse or a table; for several forces write an array of tables";
        table.conflict(stranger, &[form], hint);
    }
    let size = match *form {
        // The field was already reported as unknown in this kind of scene.
        form if !table.knows(form) => None,
        "constant" => table.number("constant").map(History::Constant),
        "ramp" => ramp(table),
        "pulse" => pulse(table),
        "block" => block(table),
        _ => rows(table),
    };
    size.filter(|_| strangers.is_empty())
}

fn ramp(table: &Table) -> Option<History> {
    let allowed = "a table such as { to = 1.0, until = 1.0 }";
    table.read("ramp", allowed, Absent::Fault, |field, value| {
        let table = table.reader.table(field, value, &RAMP, allowed)?;
        let (from, to) = (table.number("from"), table.number("to"));
        let (start, until) = (table.number("start"), table.number("until"));
        let (start, until) = (start?, until?);
        if !(start < until) {
            let allowed = format!("a time after `start`, {start}");
            return table.refuse(FaultKind::Value, "until", allowed, None);
        }
        Some(History::Ramp(Ramp {
            from: from?,
            to: to?,
            start,
            until,
        }))
    })
}

fn pulse(table: &Table) -> Option<History> {
    let allowed = "a table such as { at = 1.0, width = 0.1, amplitude = 1.0 }";
    table.read("pulse", allowed, Absent::Fault, |field, value| {
        let table = table.reader.table(field, value, &PULSE, allowed)?;
        let (at, width) = (table.number("at"), table.number("width"));
        let amplitude = table.number("amplitude");
        Some(History::Pulse(Pulse {
            at: at?,
            width: width?,
            amplitude: amplitude?,
        }))
    })
}

fn block(table: &Table) -> Option<History> {
    let allowed = "a table such as { size = 2.0, until = 0.002 }";
    table.read("block", allowed, Absent::Fault, |field, value| {
        let table = table.reader.table(field, value, &BLOCK, allowed)?;
        let (size, start, until) = (
            table.number("size"),
            table.number("start"),
            table.number("until"),
        );
        let (start, until) = (start?, until?);
        if !(start < until) {
            let allowed = format!("a time after `start`, {start}");
            return table.refuse(FaultKind::Value, "until", allowed, None);
        }
        Some(History::Block(Block {
            size: size?,
            start,
            until,
        }))
    })
}

fn rows(table: &Table) -> Option<History> {
    let reader = table.reader;
    let allowed = "an array of rows [t, f] of growing times";
    table.read("table", allowed, Absent::Fault, |field, value| {
        let row = |field: &str, value| {
            let number = |field: &str, value: &_| reader.number(field, value, &FINITE);
            reader.array(field, value, "a row [t, f]", &number)
        };
        let rows: Vec<[f64; 2]> = reader.all(field, value, allowed, &row)?;
        let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
        check_increasing(reader, field, value, &times)?;
        Some(History::Table(rows))
    })
}
