//! Reader of scenes of a bar.

use super::fields::{BODY, LAW, LOADS, ROD, RUN, START};
use super::loads::size;
use super::ranges::FINITE;
use super::reader::Reader;
use super::scene::{default, part, units};
use super::table::{Absent, Table};
use crate::bar::{Scheme, Stress, motion};
use crate::scene::{BarScene, FaultKind, History, Model, Scene, SceneKind};
use toml::Spanned;
use toml::de::DeValue;

/// Reads every field before returning `None`, for a complete list of faults.
pub(super) fn bar(top: &Table) -> Option<Scene> {
    let units = units(top);
    let rod = part(top, &ROD).flatten();
    let at = rod.as_ref().map_or(0, |table| table.at);
    let rod = rod.as_ref().and_then(of_rod);
    let mass = default(part(top, &BODY), None, |table| {
        table.number("mass").map(Some)
    });
    let force = default(part(top, &LOADS), None, load);
    let start = default(part(top, &START), [1.0, 0.0], |table| {
        let (stretch, velocity) = (table.number("stretch"), table.number("velocity"));
        Some([stretch?, velocity?])
    });
    let run = part(top, &RUN).flatten().and_then(|table| {
        let (duration, samples) = (table.number("duration"), table.count("samples"));
        let step = table.optional("time_step");
        Some((duration?, samples?, step?))
    });
    let (units, mass, force) = (units?, mass?, force?);
    let (stretch_velocity, (duration, samples, time_step)) = (start?, run?);
    let [stretch, velocity] = stretch_velocity;
    let bar = BarScene {
        mass,
        force,
        stretch,
        velocity,
        duration,
        samples,
        time_step,
        ..rod?
    };
    can_be_built(top, at, &bar)?;
    Some(Scene::without_rods(units, SceneKind::Bar(bar)))
}

/// Reads `[rod]`; the rest of the scene is filled in later.
fn of_rod(table: &Table) -> Option<BarScene> {
    let model = table.word("model", &[Model::Bar]);
    let (length, area, density) = (
        table.number("length"),
        table.number("area"),
        table.number("density"),
    );
    let law = table.read(
        "law",
        "a table such as { mooney = [24.0, 1.5] }",
        Absent::Fault,
        |field, value| law(table.reader, field, value),
    );
    let scheme = table.word("scheme", &Scheme::ALL);
    let held = |name: &str, first: bool| table.word(name, &[first, !first]);
    let (base, tip) = (held("base", true), held("tip", false));
    let cells = if !table.has("cells") && scheme == Some(Scheme::Spectral) {
        Some(24)
    } else {
        table.count("cells")
    };
    let unstable = table.flag("unstable");
    model?;
    Some(BarScene {
        length: length?,
        area: area?,
        density: density?,
        law: law?,
        scheme: scheme?,
        cells: cells?,
        unstable: unstable?,
        walls: [base?, tip?],
        mass: None,
        force: None,
        stretch: 1.0,
        velocity: 0.0,
        duration: 0.0,
        samples: 0,
        time_step: None,
    })
}

fn law<'a>(reader: &'a Reader<'a>, field: &str, value: &'a Spanned<DeValue<'a>>) -> Option<Stress> {
    let table = reader.table(
        field,
        value,
        &LAW,
        "a table such as { mooney = [24.0, 1.5] }",
    )?;
    let names = [
        "linear",
        "neo_hookean",
        "mooney",
        "biderman",
        "polynomial",
        "table",
    ];
    let chosen = table.given(&names);
    let [form, others @ ..] = chosen.as_slice() else {
        table.missing(
            "mooney",
            "one law: linear, neo_hookean, mooney, biderman, polynomial or table",
            "mooney = [24.0, 1.5]",
        );
        return None;
    };
    for other in others {
        table.conflict(other, &[form], "a bar has one law: keep one of them");
    }
    if !others.is_empty() {
        return None;
    }
    let allowed = "an array of finite numbers";
    let number = |field: &str, value: &_| reader.number(field, value, &FINITE);
    table.read(form, allowed, Absent::Fault, |field, value| match *form {
        "linear" => table.number("linear").map(Stress::Linear),
        "neo_hookean" => table.number("neo_hookean").map(Stress::NeoHookean),
        "mooney" => {
            let pair: [f64; 2] = reader.array(field, value, "two numbers, [C1, C2]", &number)?;
            Some(Stress::Mooney(pair[0], pair[1]))
        }
        "biderman" => {
            let all = reader.array(field, value, "four numbers, [B1, B2, B3, B4]", &number)?;
            Some(Stress::Biderman(all))
        }
        "polynomial" => reader
            .all(field, value, allowed, &number)
            .map(Stress::Polynomial),
        _ => {
            let row =
                |field: &str, value| reader.array(field, value, "a row [stretch, stress]", &number);
            let rows = reader.all(field, value, "rows [stretch, stress]", &row)?;
            Some(Stress::Table(rows))
        }
    })
}

fn load(loads: &Table) -> Option<Option<History>> {
    let reader = loads.reader;
    let allowed = "a table such as { block = { size = 2.0, until = 0.002 } } or { amplitude = 1.7, frequency = 500.0 }";
    loads.maybe("force", |field, value| {
        size(&reader.table(field, value, &super::fields::FORCE, allowed)?)
    })
}

/// Checks that the bar can be made and that its scheme can compute it; reports the fault at the most telling field.
fn can_be_built(top: &Table, at: usize, scene: &BarScene) -> Option<()> {
    let made = scene.bar().and_then(|bar| {
        motion(
            &bar,
            scene.scheme,
            scene.cells,
            scene.time_step,
            scene.unstable,
        )
        .map(drop)
    });
    let refuse = |field: &str, allowed: &str, hint: String| {
        top.reader
            .record(FaultKind::Value, at, field, None, allowed, Some(hint));
        None
    };
    if scene.walls[1] && (scene.mass.is_some() || scene.force.is_some()) {
        let hint = "a wall holds the end X = length: leave out [body] and [loads], or write tip = \"free\"";
        return refuse(
            "rod.tip",
            "\"free\" where there is a body or a load",
            hint.to_owned(),
        );
    }
    match made {
        Ok(()) => Some(()),
        Err(error) => refuse(
            "rod",
            "a bar that its scheme can compute",
            error.to_string(),
        ),
    }
}
