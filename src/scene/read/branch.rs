//! Reader of `[continue]`.

use super::ends::{REACH, out_of_reach};
use super::fields::SECOND;
use super::phrases::{Short, nearest};
use super::ranges::{NON_NEGATIVE, SIZE, VALUE};
use super::table::{Absent, Table};
use crate::scene::{Continue, FaultKind, Parameter, Scene, Second};

/// Reads `[continue]`. `scene` is the rest of the scene; `None` if the rest has faults, and then only the table itself
/// is checked.
pub(super) fn continuation(table: &Table, scene: Option<&Scene>) -> Option<Continue> {
    let reader = table.reader;
    let parameter = parameter(table, scene);
    let ends = ends(table, scene, parameter);
    let (least, step, most) = steps(table);
    let limit = table.count("points");
    let (switch, deflate) = (table.flag("switch"), table.flag("deflate"));
    let (both, back) = (table.flag("both"), table.flag("back"));
    let words = "an array of finite numbers, values of the parameter";
    let at = table.read("at", words, Absent::Or(Vec::new()), |field, value| {
        reader.numbers(field, value, words, &VALUE)
    });
    let allowed = "a table such as { parameter = \"end.force.x\", to = 1.0 }";
    let second = table.maybe("second", |field, value| {
        second(
            &reader.table(field, value, &SECOND, allowed)?,
            scene,
            parameter,
        )
    });
    let (from, to) = ends?;
    let continuation = Continue {
        parameter: parameter?,
        name: scene?.name_of(&parameter?),
        from,
        to,
        step: step?,
        min_step: least?,
        max_step: most?,
        points: limit?,
        switch: switch?,
        both: both?,
        back: back?,
        deflate: deflate?,
        at: at?,
        second: second?,
    };
    let (least, most) = continuation.range();
    let outside = continuation
        .at
        .iter()
        .position(|x| !(least <= *x && *x <= most));
    let element = |i: usize| table.get("at")?.get_ref().as_array()?.get(i);
    if let Some((i, value)) = outside.and_then(|i| Some((i, element(i)?))) {
        let (least, most) = (Short(least), Short(most));
        let allowed = format!("between {least} and {most}, where the branch goes");
        let field = format!("continue.at[{i}]");
        return reader.refuse(FaultKind::Value, &field, value, allowed, None);
    }
    Some(continuation)
}

/// Reads the path of a number of the scene.
fn parameter(table: &Table, scene: Option<&Scene>) -> Option<Parameter> {
    let all = scene.map_or_else(Parameter::all, Scene::parameters);
    let name = |parameter: &Parameter| {
        scene.map_or_else(|| parameter.to_string(), |s| s.name_of(parameter))
    };
    let paths: Vec<String> = all.iter().map(name).collect();
    let allowed = format!("one of {}", paths.join(", "));
    table.read("parameter", &allowed, Absent::Fault, |field, value| {
        let Some(path) = value.get_ref().as_str() else {
            table.reader.wrong_type(field, value, &allowed, None);
            return None;
        };
        let numbered = scene.map_or_else(|| path.to_owned(), |scene| numbered(path, scene));
        let hint = match numbered.parse::<Parameter>() {
            Ok(parameter) if all.contains(&parameter) => return Some(parameter),
            Ok(parameter) => Some(parameter.absence().to_owned()),
            Err(_) if path.ends_with("rotation.angle_degrees") => {
                let path = path.trim_end_matches("_degrees");
                Some(format!(
                    "a branch turns ends in radians: write parameter = {path:?}, and from and to in radians, of which 30 degrees are 0.5236"
                ))
            }
            Err(_) => nearest(path, &mut paths.iter().map(String::as_str))
                .map(|meant| format!("did you mean {meant:?}?")),
        };
        table
            .reader
            .refuse(FaultKind::Value, field, value, allowed.as_str(), hint)
    })
}

/// The path with indices of bodies and rods in place of their names: `body[0].force.z` for `body.crown.force.z`.
fn numbered(path: &str, scene: &Scene) -> String {
    if let Some((k, field)) = path
        .strip_prefix("load.")
        .and_then(|rest| rest.split_once('.'))
    {
        return format!("load[{k}].{field}");
    }
    let Some((list, rest)) = path.split_once('.') else {
        return path.to_owned();
    };
    let (name, field) = rest.split_once('.').unwrap_or((rest, ""));
    let number = match (list, scene.assembly()) {
        ("body", Some(assembly)) => assembly.bodies.iter().position(|body| body.name == name),
        ("rod", Some(assembly)) => assembly.rods.iter().position(|rod| rod.name == name),
        ("obstacle", _) => scene.obstacles.iter().position(|each| each.name == name),
        _ => None,
    };
    match number {
        Some(number) => format!("{list}[{number}].{field}"),
        None => path.to_owned(),
    }
}

/// Reads `from` and `to` of a branch, and checks that the scene is possible at both values.
fn ends(table: &Table, scene: Option<&Scene>, parameter: Option<Parameter>) -> Option<(f64, f64)> {
    let rule = match parameter {
        Some(parameter) if parameter.is_positive() => &SIZE,
        Some(parameter) if parameter.is_non_negative() => &NON_NEGATIVE,
        _ => &VALUE,
    };
    let number = |field: &str, value: &_| table.reader.number(field, value, rule);
    let from = table.maybe("from", number);
    let to = table.read("to", rule.allowed, Absent::Fault, number);
    let (scene, parameter) = (scene?, parameter?);
    let from = from?.unwrap_or_else(|| scene.value(&parameter));
    let mut reachable = true;
    for (name, x) in [("from", Some(from)), ("to", to)] {
        let given = x.filter(|_| table.get(name).is_some());
        let beyond = given.and_then(|x| out_of_reach(&scene.with(&parameter, x)));
        if let Some(hint) = beyond {
            let allowed = format!("such that the end of the rod is {REACH}");
            table.fault(FaultKind::Value, name, allowed, hint);
            reachable = false;
        }
    }
    let to = to?;
    if from == to {
        let shown = Short(from);
        let hint = match table.get("from") {
            Some(_) => "a branch goes from one value to another".to_owned(),
            None => format!(
                "{} = {shown} in the scene, where the branch begins",
                scene.name_of(&parameter)
            ),
        };
        let allowed = format!("another number than `from`, {shown}");
        return table.refuse(FaultKind::Value, "to", allowed, hint);
    }
    reachable.then_some((from, to))
}

/// Least, first and greatest step. Defaults of steps that are not written adapt to the written ones.
fn steps(table: &Table) -> (Option<f64>, Option<f64>, Option<f64>) {
    let given = ["min_step", "step", "max_step"].map(|name| table.optional(name));
    let [Some(least), Some(step), Some(most)] = given else {
        return (None, None, None);
    };
    let default = |name| table.default(name);
    let written = [least, step, most];
    let smallest = written.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let largest = written.into_iter().flatten().fold(0.0, f64::max);
    let least = least.unwrap_or(default("min_step").min(smallest));
    let most = most.unwrap_or(default("max_step").max(largest));
    let first = step.unwrap_or(default("step").min(most).max(least));
    if least <= first && first <= most {
        return (Some(least), Some(first), Some(most));
    }
    // At least two of the three steps are written, and the later one is at fault.
    let (name, allowed) = if least > most {
        ("max_step", format!("at least min_step = {least}"))
    } else {
        (
            "step",
            format!("from min_step = {least} to max_step = {most}"),
        )
    };
    table.fault(FaultKind::Conflict, name, allowed, None);
    (None, None, None)
}

fn second(table: &Table, scene: Option<&Scene>, first: Option<Parameter>) -> Option<Second> {
    let parameter = parameter(table, scene);
    let ends = ends(table, scene, parameter);
    let (least, step, most) = steps(table);
    let points = table.count("points");
    if let (Some(parameter), true) = (parameter, parameter == first) {
        let allowed = format!("another parameter than {}", scene?.name_of(&parameter));
        return table.refuse(FaultKind::Conflict, "parameter", allowed, None);
    }
    let (from, to) = ends?;
    let here = scene?.value(&parameter?);
    if !(from.min(to) <= here && here <= from.max(to)) {
        // Only a written `from` fails here: the default of `from` is the value in the scene.
        let here = Short(here);
        let allowed =
            format!("such that {here}, the value in the scene, lies between `from` and `to`");
        let hint = "the curves begin at the folds of the branch, which has that value";
        return table.refuse(FaultKind::Value, "from", allowed, hint);
    }
    Some(Second {
        parameter: parameter?,
        name: scene?.name_of(&parameter?),
        from,
        to,
        step: step?,
        min_step: least?,
        max_step: most?,
        points: points?,
    })
}
