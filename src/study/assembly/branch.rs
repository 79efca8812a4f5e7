//! Branches of equilibria of an assembly.

use crate::assembly::{AssemblyFamily, AssemblyPoint, AssemblySpecial};
use crate::error::Result;
use crate::math::se3::halves;
use crate::rod::RodSection;
use crate::scene::{AssemblySetup, Continue, Scales, Scene};
use crate::solve::arclength::Options;
use crate::solve::special::{SpecialKind, Status};
use crate::study::branch::follow::{TYPICAL, ended, short};
use crate::study::branch::{
    BranchRecord, CurveRecord, CurveSet, ShapeRecord, SpecialPoint, missing,
};
use crate::study::space::upward;
use crate::study::{Cell, Column, Hooks, Table};

/// How many configurations a record shows, and sections of each rod, less one.
const SHOWN: usize = 8;
const SECTIONS: usize = 100;
/// Where else an equilibrium may be.
const ELSEWHERE: &str = "begin from another `guess` of the bodies";

/// Follows the branch that the scene's `[continue]` describes: [`study::branch`](crate::study::branch()) of an assembly.
///
/// # Errors
/// A scene without `[continue]`; no equilibrium at its start.
pub fn branch(scene: &Scene, hooks: &mut dyn Hooks) -> Result<BranchRecord> {
    let Some(wanted) = &scene.continuation else {
        return Err(missing("body[0].force[2]"));
    };
    let in_units = |e| scene.in_own_units(e);
    let at = |p: f64| AssemblySetup::new(&scene.with(&wanted.parameter, p));
    let first = at(wanted.from).map_err(in_units)?;
    let start = first.equilibrium().map_err(in_units)?;
    let span = wanted.to - wanted.from;
    // That of the integration along the rods: a part of what points are solved to.
    let tolerance = (0.01 * scene.solve.tolerance).max(1e-13);
    let family = AssemblyFamily::new(|p| Ok(at(p)?.assembly), false, span, tolerance);
    let options = Options {
        at: wanted.at.clone(),
        initial_step: TYPICAL * wanted.step,
        min_step: TYPICAL * wanted.min_step,
        max_step: TYPICAL * wanted.max_step,
        tolerance: scene.solve.tolerance,
        weight: TYPICAL / span.abs(),
        max_points: wanted.points,
        ..Options::between(wanted.from, wanted.to)
    };
    let followed = family
        .branch_while(&start.now, &options, &mut |p| {
            hooks.progress(((p - wanted.from) / span).clamp(0.0, 1.0), p);
            !hooks.interrupted()
        })
        .map_err(in_units)?;

    let mut rows: Vec<(&AssemblyPoint, String)> = followed
        .points
        .iter()
        .map(|point| (point, String::new()))
        .collect();
    let mut specials = Vec::new();
    for special in &followed.specials {
        let label = labelled(&specials, special.kind);
        rows.push((&special.point, label.clone()));
        specials.push(described(special, label));
    }
    rows.sort_by(|(a, _), (b, _)| a.arclength.total_cmp(&b.arclength));
    let last = followed.points.last().map(|point| point.parameter);
    let (complete, words) = match followed.interrupted {
        true => {
            let at = last.unwrap_or(wanted.from);
            (
                false,
                short(wanted, 0, false, &format!("it was interrupted at {at}")),
            )
        }
        false => ended(wanted, (0, false), &followed.stop, last, ELSEWHERE),
    };
    let mut remarks = Vec::new();
    if first.assembly.is_followed(0.0) {
        remarks.push(
            "loads turn with the bodies: equilibria have no index, and stability may be lost by growing oscillations, which `snaprod modes` \
             shows"
                .to_owned(),
        );
    }
    Ok(BranchRecord {
        parameter: wanted.parameter,
        units: scene.units,
        length: first.scales.length,
        taken: None,
        branches: CurveSet {
            points: table(scene, wanted, &rows, &at)?,
            curves: vec![CurveRecord {
                origin: "the scene".to_owned(),
                ends: vec![words],
                complete,
            }],
            specials,
        },
        fold_curves: None,
        deflation: None,
        shapes: shapes(&rows, &at, tolerance),
        remarks,
        interrupted: followed.interrupted,
    })
}

/// The next name of a special point of this kind.
fn labelled(before: &[SpecialPoint], kind: SpecialKind) -> String {
    let stem = |kind: SpecialKind| match kind {
        SpecialKind::Fold => "LP",
        SpecialKind::BranchPoint => "BP",
        SpecialKind::Cusp => "CP",
        SpecialKind::StabilityChange | SpecialKind::Event => "SC",
    };
    let same = before.iter().filter(|at| stem(at.kind) == stem(kind));
    format!("{}{}", stem(kind), same.count() + 1)
}

fn described(special: &AssemblySpecial, label: String) -> SpecialPoint {
    let (a, b) = special.interval;
    SpecialPoint {
        label,
        kind: special.kind,
        curve: 0,
        doubt: match &special.status {
            Status::Converged => None,
            Status::Guess(why) => Some(why.clone()),
        },
        parameter: special.point.parameter,
        second: None,
        arclength: special.point.arclength / TYPICAL,
        interval: [a.min(b) / TYPICAL, a.max(b) / TYPICAL],
        precision: special.error,
        first_precision: None,
        arclength_precision: special.error_s / TYPICAL,
        index: [special.index.0, special.index.1],
    }
}

/// The rows of the branch: the bodies, the wrenches at the bases of the rods, energy and index.
fn table(
    scene: &Scene,
    wanted: &Continue,
    rows: &[(&AssemblyPoint, String)],
    at: &impl Fn(f64) -> Result<AssemblySetup>,
) -> Result<Table> {
    let units = scene.units;
    let parameter = wanted.parameter;
    let mut columns = vec![
        Column::integers("branch", "number of the branch"),
        Column::reals("parameter", parameter.unit(units), parameter.to_string()),
        Column::reals(
            "arclength",
            "",
            "length along the curve, the whole range of the parameter counting as 1",
        ),
    ];
    let given = scene.assembly.iter();
    for body in given.clone().flat_map(|given| &given.bodies) {
        let name = &body.name;
        let place = ["x", "y", "z"].map(|k| {
            let meaning = format!("position of the frame of {name} along {k}");
            Column::reals(format!("{name}.{k}"), units.length(), meaning)
        });
        let turn = ["qw", "qx", "qy", "qz"].map(|k| {
            let meaning = format!("unit quaternion of the frame of {name}, qw >= 0");
            Column::reals(format!("{name}.{k}"), "", meaning)
        });
        columns.extend(place.into_iter().chain(turn));
    }
    for rod in given.flat_map(|given| &given.rods) {
        let name = &rod.name;
        let parts = [
            ("f", units.force(), "force"),
            ("m", units.couple(), "couple"),
        ];
        for (letter, unit, what) in parts {
            columns.extend(["x", "y", "z"].map(|k| {
                let meaning = format!("{what} at the base of {name} along {k} of the world");
                Column::reals(format!("{name}.base_{letter}{k}"), unit, meaning)
            }));
        }
    }
    columns.extend([
        Column::reals(
            "energy",
            units.energy(),
            "stored energy and potential of gravity and constant forces",
        ),
        Column::integers("index", "Morse index, the bodies being free: 0 is stable"),
        Column::reals(
            "error",
            "",
            "estimated distance from the branch, in units of the rods",
        ),
        Column::words("label", "name of the special point"),
    ]);
    let mut table = Table::new("branch", columns);
    for (point, label) in rows {
        let setup = at(point.parameter)?;
        let k: Scales = setup.scales;
        let mut cells: Vec<Cell> = vec![
            0_usize.into(),
            point.parameter.into(),
            (point.arclength / TYPICAL).into(),
        ];
        for place in &point.now.bodies {
            let r = place.pose.translation.vector * k.length;
            let q = upward(&place.pose.rotation);
            cells.extend(r.iter().copied().chain(q).map(Cell::Real));
        }
        for wrench in setup.base_wrenches(&point.now)? {
            let (couple, force) = halves(&wrench);
            let parts = force.iter().chain(couple.iter());
            cells.extend(parts.map(|x| Cell::Real(*x)));
        }
        cells.extend([
            (point.energy * k.energy).into(),
            point.index.into(),
            point.error.into(),
            label.clone().into(),
        ]);
        table.push(&cells)?;
    }
    Ok(table)
}

/// All rods at a few points of the branch. They are for the eye: a point whose shapes cannot be had is left out.
fn shapes(
    rows: &[(&AssemblyPoint, String)],
    at: &impl Fn(f64) -> Result<AssemblySetup>,
    tolerance: f64,
) -> Vec<ShapeRecord> {
    let shown = SHOWN.min(rows.len());
    let shape = |k: usize| -> Option<Vec<ShapeRecord>> {
        let (point, _) = rows.get(k * (rows.len() - 1) / (shown - 1).max(1))?;
        let setup = at(point.parameter).ok()?;
        let length = setup.scales.length;
        let rods = setup
            .assembly
            .shapes(0.0, &point.now, SECTIONS, tolerance)
            .ok()?;
        let records = rods.into_iter().map(|sections| ShapeRecord {
            parameter: point.parameter,
            unstable: point.index.is_some_and(|index| index > 0),
            sections: sections
                .into_iter()
                .map(|section| RodSection {
                    s: section.s * length,
                    position: section.position * length,
                    ..section
                })
                .collect(),
        });
        Some(records.collect())
    };
    (0..shown).filter_map(shape).flatten().collect()
}
