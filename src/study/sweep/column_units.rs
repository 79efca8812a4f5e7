//! Units and meanings of the columns of a sweep.

use super::extremes::{GREATEST, LEAST};
use super::{SpecialName, Sweep};
use crate::scene::{Scene, Units};
use crate::study::dispatch;

/// The letters of components, and of the parts of a quaternion.
const AXES: [&str; 3] = ["x", "y", "z"];
const PARTS: [&str; 4] = ["w", "x", "y", "z"];

impl Sweep {
    /// Unit and meaning of a column: of a varied field, or a quantity of trajectories, summaries and events; `None`
    /// if unknown.
    pub fn described(&self, column: &str) -> Option<[String; 2]> {
        // The last point replaces an invalid first point.
        let ends = [0, self.points() - 1];
        let scene = ends.iter().find_map(|point| self.scene(*point).ok())?;
        if self.varied(column).is_some() {
            let (name, unit) = scene.described(column)?;
            let is_told = scene.units == Units::Si || unit == "rad";
            return Some([if is_told { unit } else { "" }.to_owned(), name]);
        }
        if let Some(name) = SpecialName::parse(column) {
            let wanted = scene
                .continuation
                .as_ref()
                .filter(|_| name.is_parameter())?;
            let meaning = format!("{} at the special point", wanted.name);
            return Some([wanted.parameter.unit(scene.units).to_owned(), meaning]);
        }
        let parts: Vec<&str> = column.split('.').collect();
        of_trajectory(&scene, &parts).or_else(|| {
            let unit = unit(scene.units, &parts)?;
            Some([unit.to_owned(), "as the summary has it".to_owned()])
        })
    }
}

/// Unit and meaning of a state, an extreme or an event, from the trajectory column.
fn of_trajectory(scene: &Scene, parts: &[&str]) -> Option<[String; 2]> {
    let (name, [before, after]) = match parts {
        ["start", state @ ..] => (of_state(state)?, ["", ", at the start"]),
        ["end", state @ ..] => (of_state(state)?, ["", ", at the end"]),
        [LEAST, name @ ..] => (name.join("."), ["least along the run: ", ""]),
        [GREATEST, name @ ..] => (name.join("."), ["greatest along the run: ", ""]),
        ["events", _, "from", name] => ((*name).to_owned(), ["", " before the event"]),
        ["events", _, "to", name] => ((*name).to_owned(), ["", " after the event"]),
        ["events", _, name] => ((*name).to_owned(), ["", " of the event"]),
        _ => return None,
    };
    let table = dispatch::columns(scene).ok()?;
    let found = table.column(&name)?;
    Some([
        found.unit.to_string(),
        format!("{before}{}{after}", found.meaning),
    ])
}

/// Trajectory column of a number of a state.
fn of_state(parts: &[&str]) -> Option<String> {
    Some(match parts {
        ["bodies", body, of, k] => {
            let (before, letters): (_, &[&str]) = match *of {
                "position" => ("", &AXES),
                "quaternion" => ("q", &PARTS),
                "velocity" => ("v", &AXES),
                "angular_velocity" => ("w", &AXES),
                "groove_force" => ("groove_", &AXES),
                _ => return None,
            };
            // A component by index or by letter.
            let number = k.parse::<usize>().ok();
            let letter = number.map_or(Some(k), |k| letters.get(k))?;
            format!("{body}.{before}{letter}")
        }
        // Every column of a bar refers to the end X = length.
        ["tip", "stress"] => "tip_stress".to_owned(),
        ["tip", name] => (*name).to_owned(),
        ["base", name] => format!("base_{name}"),
        ["ledger", name] | [name] => (*name).to_owned(),
        _ => return None,
    })
}

/// Unit of a number of a summary or event that no trajectory has. Each such name has one meaning everywhere.
fn unit(units: Units, parts: &[&str]) -> Option<&'static str> {
    let mut names = parts.iter().rev();
    let name = names.find(|part| part.parse::<i64>().is_err() && !AXES.contains(part))?;
    Some(match *name {
        "time" | "peak" | "emitted" | "time_error" | "min_time" | "max_time" | "friction_time"
        | "until" | "inertial_delay" | "viscous_delay" | "until_next" => units.time(),
        "position" | "X" | "contact_diameter" => units.length(),
        "speed" => units.velocity(),
        "energy"
        | "potential"
        | "kinetic"
        | "elastic"
        | "released"
        | "absolute"
        | "dissipated"
        | "dissipated_by_faces"
        | "elastic_from"
        | "elastic_to" => units.energy(),
        "base_force" | "tip_force" | "force" | "weight" | "tension" => units.force(),
        "base_couple" | "tip_couple" | "couple" => units.couple(),
        "loss_rate" => units.power(),
        "min" | "max" => units.stress(),
        "bar_mass" => units.mass(),
        _ => return None,
    })
}
