//! Reader of `[[station]]`: places on rods that the tables of a scene follow.

use super::assembly::plain_name;
use super::fields::{ASSEMBLY, STATION};
use super::phrases::Short;
use super::ranges::VALUE;
use super::table::{Absent, Table};
use super::varying::ROUNDING;
use crate::scene::{FaultKind, Station};

/// Most stations of a scene.
const STATIONS: usize = 100;

/// Reads the stations of a scene on rods, each by its name and length; none without the list. `bodies`: names that
/// stations may not have.
pub(super) fn stations(top: &Table, rods: &[(&str, f64)], bodies: &[&str]) -> Option<Vec<Station>> {
    let reader = top.reader;
    let words = "tables [[station]], at most 100, such as { s = 0.5 }";
    top.read("station", words, Absent::Or(Vec::new()), |field, value| {
        if value.get_ref().is_table() {
            let hint = "write it with two brackets, [[station]]: there may be several";
            reader.wrong_type(field, value, words, Some(hint));
            return None;
        }
        let read = |field: &str, value| {
            let table = reader.table(field, value, &STATION, "a table, [[station]]")?;
            let name = named(&table, bodies);
            let rod = rod_of(&table, rods);
            let (number, rod) = (rod?, name?);
            let s = arclength(&table, rods[number].1)?;
            Some((rod, number, s))
        };
        let list = reader.list(field, value, words, &read)?;
        if list.len() > STATIONS {
            let hint = format!("it has {} elements", list.len());
            return reader.refuse(FaultKind::Value, field, value, words, hint);
        }
        let list: Vec<(Option<String>, usize, f64)> = list.into_iter().collect::<Option<_>>()?;
        let in_assembly = reader.kind.get() == ASSEMBLY;
        let stations: Vec<Station> = list
            .into_iter()
            .enumerate()
            .map(|(k, (name, rod, s))| Station {
                name: name.unwrap_or_else(|| format!("station{}", k + 1)),
                rod: in_assembly.then(|| rods[rod].0.to_owned()),
                s,
            })
            .collect();
        for (k, station) in stations.iter().enumerate() {
            if stations[..k].iter().any(|other| other.name == station.name) {
                let hint = format!("two of them are called {:?}", station.name);
                let allowed = "a list of stations with different names";
                return reader.refuse(FaultKind::Value, field, value, allowed, hint);
            }
        }
        Some(stations)
    })
}

/// Name of a station; the inner `None` if left out.
#[allow(clippy::option_option)]
fn named(table: &Table, bodies: &[&str]) -> Option<Option<String>> {
    let allowed = "a name of letters, digits, _ and -, other than that of a body";
    table.read("name", allowed, Absent::Or(None), |field, value| {
        let reader = table.reader;
        let word = plain_name(reader, field, value, allowed)?;
        if bodies.contains(&word) {
            return reader.refuse(FaultKind::Conflict, field, value, allowed, None);
        }
        Some(Some(word.to_owned()))
    })
}

/// Number of the rod of a station.
fn rod_of(table: &Table, rods: &[(&str, f64)]) -> Option<usize> {
    if table.reader.kind.get() != ASSEMBLY || (rods.len() == 1 && !table.has("rod")) {
        return (!rods.is_empty()).then_some(0);
    }
    let names: Vec<String> = rods.iter().map(|(name, _)| format!("{name:?}")).collect();
    let allowed = format!("the name of a rod, one of {}", names.join(", "));
    if !table.has("rod") {
        table.missing("rod", &allowed, "rod = \"name of a rod\"");
        return None;
    }
    table.read("rod", &allowed, Absent::Fault, |field, value| {
        let found = value.get_ref().as_str();
        let found = found.and_then(|word| rods.iter().position(|(name, _)| *name == word));
        found.or_else(|| {
            let reader = table.reader;
            reader.refuse(FaultKind::Value, field, value, allowed.as_str(), None)
        })
    })
}

/// Arclength of a station on a rod of this length, both ends included.
fn arclength(table: &Table, length: f64) -> Option<f64> {
    let reader = table.reader;
    let s = table.read("s", "a finite number", Absent::Fault, |field, value| {
        reader.number(field, value, &VALUE)
    })?;
    if !(s >= 0.0 && s <= length * (1.0 + ROUNDING)) {
        let allowed = format!("from 0 to the length of the rod, {}", Short(length));
        return table.refuse(FaultKind::Value, "s", allowed, None);
    }
    Some(s.min(length))
}
