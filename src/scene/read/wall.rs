//! Readers of `[tube]` and `[membrane]`, walls under pressure at rest.

use super::fields::{
    CONTINUE, FLUID, GAS, LAW, LOADS, MEMBRANE_TABLE, OUTSIDE, START, TUBE_LAW, TUBE_MATERIAL,
    TUBE_TABLE,
};
use super::ranges::FINITE;
use super::scene::{default, part, units};
use super::table::{Absent, Table};
use crate::membrane::gas::Vessel;
use crate::membrane::{Inflated, Rubber, Shape};
use crate::scene::{
    FaultKind, MembraneLoad, MembraneScene, Scene, SceneKind, TubeLaw, TubeLoad, TubeScene,
    TubeWall, WallBranch, WallParameter, WallScene, WallStiffness,
};

/// Reads a scene of a section of a tube.
pub(super) fn tube(top: &Table) -> Option<Scene> {
    let units = units(top);
    let table = part(top, &TUBE_TABLE).flatten();
    let outside = default(part(top, &OUTSIDE), None, |table| {
        table.optional("pressure")
    });
    let density = default(part(top, &FLUID), None, |table| table.optional("density"));
    let parameters = [WallParameter::Pressure, WallParameter::Area];
    let follow = default(part(top, &CONTINUE), None, |table| {
        branch(table, &parameters).map(Some)
    });
    let table = table?;
    let wall = tube_wall(&table);
    let area = table.optional("area");
    let (outside, area, follow) = (outside?, area?, follow?);
    let state = match (outside, area) {
        (Some(pressure), None) => TubeLoad::Pressure(pressure),
        (None, Some(area)) => TubeLoad::Area(area),
        (Some(_), Some(_)) => {
            let hint = "the section has one load: keep [outside] pressure or tube.area";
            return table.refuse(
                FaultKind::Conflict,
                "area",
                "left out where outside.pressure is given",
                hint,
            );
        }
        (None, None) => match follow {
            Some(WallBranch {
                parameter: WallParameter::Area,
                from,
                ..
            }) => TubeLoad::Area(from),
            Some(WallBranch { from, .. }) => TubeLoad::Pressure(from),
            None => {
                let allowed = "a load: [outside] pressure, or the area ratio tube.area";
                table.missing("area", allowed, "area = 0.5");
                return None;
            }
        },
    };
    let scene = TubeScene {
        wall: wall?,
        density: density?,
        state,
        follow,
    };
    if let Err(error) = scene.wall.tube() {
        let allowed = "a tube whose wall can be made";
        return refuse_tube(top, table.at, allowed, error.to_string());
    }
    Some(Scene::without_rods(
        units?,
        SceneKind::Wall(WallScene::Tube(scene)),
    ))
}

/// Refuses the table `[tube]` that begins at `at`.
pub(super) fn refuse_tube<T>(top: &Table, at: usize, allowed: &str, hint: String) -> Option<T> {
    let reader = top.reader;
    reader.record(FaultKind::Value, at, "tube", None, allowed, Some(hint));
    None
}

/// Reads the wall of `[tube]`.
pub(super) fn tube_wall(table: &Table) -> Option<TubeWall> {
    let (radius, stretch) = (table.number("radius"), table.number("stretch"));
    let (thickness, stiffness) = (table.optional("thickness"), table.optional("stiffness"));
    let material = if table.has("material") {
        table
            .inner("material", &TUBE_MATERIAL)
            .and_then(|material| {
                let (modulus, nu) = (material.number("E"), material.number("nu"));
                Some(Some([modulus?, nu?]))
            })
    } else {
        Some(None)
    };
    let mode = table.count("mode");
    let law = table.read("law", "", Absent::Or(TubeLaw::Ring), |field, value| {
        let words = [
            ("ring", TubeLaw::Ring),
            ("extensible", TubeLaw::Extensible),
            ("neo-hookean", TubeLaw::NeoHookean),
        ];
        let allowed =
            r#""ring", "extensible", "neo-hookean" or a table such as { power = [10.0, -1.5] }"#;
        if value.get_ref().is_table() {
            let inner = table.reader.table(field, value, &TUBE_LAW, allowed)?;
            let number = |field: &str, value: &_| table.reader.number(field, value, &FINITE);
            return inner.read(
                "power",
                "two numbers, [m, n]",
                Absent::Fault,
                |field, value| {
                    table
                        .reader
                        .array(field, value, "two numbers, [m, n]", &number)
                        .map(TubeLaw::Power)
                },
            );
        }
        table.reader.choice(field, value, &words, allowed)
    });
    let (radius, thickness) = (radius?, thickness?);
    if let Some(thick) = thickness
        && !(thick <= 0.5 * radius)
    {
        let allowed = format!("at most half the radius, {}", 0.5 * radius);
        let hint = "the laws of tubes are for walls thinner than that";
        return table.refuse(FaultKind::Value, "thickness", allowed, hint);
    }
    let stiffness = match (material?, stiffness?) {
        (Some(material), None) => WallStiffness::Material(material),
        (None, Some(stiffness)) => WallStiffness::Bending(stiffness),
        (Some(_), Some(_)) => {
            table.conflict("stiffness", &["material"], "keep one of the two");
            return None;
        }
        (None, None) => {
            let allowed = "the stiffness of the wall: material, or stiffness";
            table.missing("material", allowed, "material = { E = 1.5e6, nu = 0.5 }");
            return None;
        }
    };
    let law = law?;
    if let (TubeLaw::NeoHookean, WallStiffness::Material([_, nu])) = (law, stiffness)
        && nu != 0.5
    {
        let hint = "a neo-Hookean wall is incompressible: write nu = 0.5";
        return table.refuse(
            FaultKind::Conflict,
            "law",
            "of an incompressible material",
            hint,
        );
    }
    Some(TubeWall {
        radius,
        thickness,
        stiffness,
        // Bounded by the table of fields.
        mode: u32::try_from(mode?).ok()?,
        law,
        stretch: stretch?,
    })
}

/// Reads a scene of a membrane.
pub(super) fn membrane(top: &Table) -> Option<Scene> {
    let units = units(top);
    let table = part(top, &MEMBRANE_TABLE).flatten();
    let stretch = default(part(top, &START), None, |table| table.optional("stretch"));
    let pressure = default(part(top, &LOADS), None, |table| table.optional("pressure"));
    let gas = default(part(top, &GAS), None, |table| of_gas(table).map(Some));
    let follow = default(part(top, &CONTINUE), None, |table| {
        branch(table, &[WallParameter::Stretch]).map(Some)
    });
    let table = table?;
    let made = of_membrane(&table);
    let (stretch, pressure, gas, follow) = (stretch?, pressure?, gas?, follow?);
    let mut loads = Vec::new();
    loads.extend(pressure.map(MembraneLoad::Pressure));
    loads.extend(stretch.map(MembraneLoad::Stretch));
    loads.extend(gas.map(|(contents, vessel)| MembraneLoad::Gas { contents, vessel }));
    if let (true, Some(follow)) = (loads.is_empty(), follow) {
        loads.push(MembraneLoad::Stretch(follow.from));
    }
    let (membrane, constants) = made?;
    let [state] = loads[..] else {
        let hint = format!(
            "{} are given: a membrane has one of [loads] pressure, [start] stretch (at the pole) and [gas] contents",
            loads.len()
        );
        let allowed = "a membrane with one load";
        top.reader.record(
            FaultKind::Conflict,
            table.at,
            "membrane",
            None,
            allowed,
            Some(hint),
        );
        return None;
    };
    let scene = MembraneScene {
        membrane,
        constants,
        state,
        follow,
    };
    Some(Scene::without_rods(
        units?,
        SceneKind::Wall(WallScene::Membrane(scene)),
    ))
}

/// Reads `[gas]`: the content, and the vessel.
pub(super) fn of_gas(table: &Table) -> Option<(f64, Vessel)> {
    let (contents, volume) = (table.number("contents"), table.number("volume"));
    let outside = table.number("outside");
    Some((contents?, Vessel::new(outside?, volume?).ok()?))
}

/// Reads `[membrane]`: the membrane, and the constants of its law.
pub(super) fn of_membrane(table: &Table) -> Option<(Inflated, [f64; 4])> {
    let shape = table.word("shape", &[Shape::Sphere, Shape::Disc]);
    let (radius, thickness) = (table.number("radius"), table.number("thickness"));
    let allowed = "a table such as { mooney = [24.0, 1.5] }";
    let constants = table.read("law", allowed, Absent::Fault, |field, value| {
        let law = table.reader.table(field, value, &LAW, allowed)?;
        let number = |field: &str, value: &_| table.reader.number(field, value, &FINITE);
        match law.given(&["neo_hookean", "mooney", "biderman"])[..] {
            ["neo_hookean"] => law.number("neo_hookean").map(|c| [c, 0.0, 0.0, 0.0]),
            ["mooney"] => law.read("mooney", "", Absent::Fault, |field, value| {
                let [c1, c2] =
                    table
                        .reader
                        .array(field, value, "two numbers, [C1, C2]", &number)?;
                Some([c1, 0.0, 0.0, c2])
            }),
            ["biderman"] => law.read("biderman", "", Absent::Fault, |field, value| {
                table
                    .reader
                    .array(field, value, "four numbers, [B1, B2, B3, B4]", &number)
            }),
            _ => {
                let one = "one law: neo_hookean, mooney or biderman";
                law.missing("mooney", one, "mooney = [24.0, 1.5]");
                None
            }
        }
    });
    let (shape, radius, thickness, constants) = (shape?, radius?, thickness?, constants?);
    let made = Rubber::biderman(constants)
        .and_then(|rubber| Inflated::new(shape, rubber, radius, thickness));
    match made {
        Ok(membrane) => Some((membrane, constants)),
        Err(error) => table.refuse(
            FaultKind::Value,
            "law",
            "that of a rubber",
            error.to_string(),
        ),
    }
}

/// Reads `[continue]` of a wall.
fn branch(table: &Table, parameters: &[WallParameter]) -> Option<WallBranch> {
    let (parameter, points) = (table.word("parameter", parameters), table.count("points"));
    let (from, to) = (table.number("from"), table.number("to"));
    let (from, to) = (from?, to?);
    if from == to {
        return table.refuse(
            FaultKind::Value,
            "to",
            "another value than from",
            "a branch has a length",
        );
    }
    Some(WallBranch {
        parameter: parameter?,
        from,
        to,
        points: points?,
    })
}
