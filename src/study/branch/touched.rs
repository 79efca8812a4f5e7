//! Branches of a rod among the obstacles of its scene.

use super::follow::branch_options;
use super::record::{
    BranchRecord, ContactAt, CurveRecord, CurveSet, ShapeRecord, SpecialPoint, even_of,
};
use super::rod::SECTIONS;
use super::subject::{INDEX, LoadClass};
use crate::error::{Error, Result};
use crate::rod::contact::{
    ContactBranch, ContactBranchPoint, ContactEvent, ContactEventKind, ContactGuess, ContactStop,
    GuessedTouch,
};
use crate::rod::{ChosenPath, Path};
use crate::scene::{Continue, Scene};
use crate::solve::arclength::{Direction, Stop};
use crate::solve::special_points::SpecialKind;
use crate::study::contact::{self, ContactsRecord};
use crate::study::record::{Cell, Column, Table};
use crate::study::{Hooks, space};
use nalgebra::Vector3;

/// Shapes of a record.
const SHOWN: usize = 12;

/// Refuses what branches among obstacles do not have.
fn check(scene: &Scene, wanted: &Continue) -> Result<()> {
    if !scene.stations.is_empty() {
        return Err(Error::domain(
            "branches of a rod among obstacles have no columns of stations yet: leave out [[station]], or use `snaprod equilibrium`, which has them",
        ));
    }
    let asked = [
        (wanted.switch, "switch"),
        (wanted.deflate, "deflate"),
        (wanted.both, "both"),
        (wanted.second.is_some(), "second"),
    ];
    match asked.iter().find(|(asked, _)| *asked) {
        None => Ok(()),
        Some((_, name)) => Err(Error::domain(format!(
            "continue.{name} is not there for a rod among obstacles: leave it out, or leave out [[obstacle]]"
        ))),
    }
}

/// Follows the branch of a scene with obstacles.
///
/// # Errors
/// Requests that branches among obstacles do not have; no equilibrium at the start; those of the rod on the way.
pub(super) fn branch(
    scene: &Scene,
    wanted: &Continue,
    hooks: &mut dyn Hooks,
) -> Result<BranchRecord> {
    check(scene, wanted)?;
    let (_, among, first) = contact::touched(&scene.with(&wanted.parameter, wanted.from))?;
    let at = |p: f64| {
        let there = scene.with(&wanted.parameter, p).contact_problem()?;
        there.in_plane_of(&among)
    };
    let start = ContactGuess {
        base: first.base,
        touches: (first.touches.iter()).map(GuessedTouch::from).collect(),
    };
    let options = branch_options(scene, wanted, &[], Direction::Forward);
    let interrupted = std::cell::Cell::new(false);
    let hooks = std::cell::RefCell::new(hooks);
    let watched = |p: f64| {
        let mut hooks = hooks.borrow_mut();
        if hooks.interrupted() {
            interrupted.set(true);
            return Err(Error::domain("interrupted"));
        }
        let fraction = (p - wanted.from) / (wanted.to - wanted.from);
        hooks.progress(fraction.clamp(0.0, 1.0), p);
        at(p)
    };
    let found = ContactBranch::follow(watched, &start, wanted.from, options)?;
    let pictures = hooks.borrow_mut().pictures();
    let rows = rows(&found);
    let table = table(scene, wanted, &rows, &found)?;
    let shapes = |chosen: Vec<usize>| -> Result<Vec<ShapeRecord>> {
        let last = SECTIONS - 1;
        let places: Vec<f64> = (0..=last).map(|i| i as f64 / last as f64).collect();
        let shape = |row: usize| {
            let point = rows[row].point;
            Ok(ShapeRecord {
                row,
                parameter: point.p,
                unstable: point.equilibrium.index.is_some_and(|index| index > 0),
                sections: at(point.p)?.sections(&point.equilibrium, &places)?,
            })
        };
        chosen.into_iter().map(shape).collect()
    };
    let mut pictured = even_of(pictures, rows.len());
    pictured.extend((0..rows.len()).filter(|k| pictures > 0 && rows[*k].event.is_some()));
    pictured.sort_unstable();
    pictured.dedup();
    let problem = among.problem();
    let loads = LoadClass::new(problem.is_conservative(), problem.is_followed());
    let shown = shapes(even_of(SHOWN, rows.len()))?;
    let sections = shown.iter().flat_map(|shape| &shape.sections);
    let points: Vec<Vector3<f64>> = sections.map(|section| section.position).collect();
    let outlines = ContactsRecord::new(scene, &first).outlines(&points);
    let (complete, end) = described_end(wanted, &found);
    Ok(BranchRecord {
        parameter: wanted.parameter,
        name: wanted.name.clone(),
        units: scene.units,
        length: scene.rod.length,
        conservative: loads == LoadClass::Conservative,
        taken: Some(ChosenPath {
            path: if among.is_planar() {
                Path::Planar
            } else {
                Path::Spatial
            },
            why: "the rod may touch obstacles: shooting with a jump of the force at each contact"
                .to_owned(),
        }),
        branches: CurveSet {
            points: table,
            specials: specials(scene, &found),
            curves: vec![CurveRecord {
                origin: "the scene".to_owned(),
                ends: vec![end],
                complete,
            }],
        },
        fold_curves: None,
        deflation: None,
        shapes: shown,
        pictures: shapes(pictured)?,
        masses: Vec::new(),
        obstacles: outlines,
        remarks: loads.remark().map(str::to_owned).into_iter().collect(),
        lost: Vec::new(),
        interrupted: interrupted.get(),
    })
}

/// A point of the branch, with the number of an event at the point.
struct NumberedPoint<'a> {
    point: &'a ContactBranchPoint,
    event: Option<usize>,
}

/// Points and events in the order of the arclength.
fn rows(found: &ContactBranch) -> Vec<NumberedPoint<'_>> {
    let own = |point: &&ContactBranchPoint| {
        let same = |event: &ContactEvent| event.point == **point;
        !found.events.iter().any(same)
    };
    let points = found.points.iter().filter(own);
    let points = points.map(|point| NumberedPoint { point, event: None });
    let events = found.events.iter().enumerate();
    let events = events.map(|(k, event)| NumberedPoint {
        point: &event.point,
        event: Some(k),
    });
    let mut rows: Vec<NumberedPoint<'_>> = points.chain(events).collect();
    rows.sort_by(|a, b| a.point.arclength.total_cmp(&b.point.arclength));
    rows
}

/// Two letters of the labels of a kind of event.
fn letters(kind: ContactEventKind) -> &'static str {
    match kind {
        ContactEventKind::Touch => "TC",
        ContactEventKind::Release => "RC",
        ContactEventKind::EndSlides => "ES",
        ContactEventKind::Line => "LC",
        ContactEventKind::Point => "PC",
        ContactEventKind::LineLifts => "LL",
        ContactEventKind::LineAtEnd => "LE",
        ContactEventKind::SlipOff => "SO",
        ContactEventKind::Corner => "CF",
        ContactEventKind::Fold => "LP",
        ContactEventKind::BranchPoint => "BP",
        ContactEventKind::StabilityChange => "SC",
    }
}

/// Labels of the events: letters of the kind and a number from 1.
fn labels(found: &ContactBranch) -> Vec<String> {
    let events = found.events.iter().enumerate();
    events
        .map(|(k, event)| {
            let before = found.events[..k].iter();
            let number = before.filter(|other| other.kind == event.kind).count() + 1;
            format!("{}{number}", letters(event.kind))
        })
        .collect()
}

fn specials(scene: &Scene, found: &ContactBranch) -> Vec<SpecialPoint> {
    let each = found.events.iter().zip(labels(found));
    let special = |(event, label): (&ContactEvent, String)| {
        let place = event.point.arclength;
        SpecialPoint {
            label,
            kind: match event.kind {
                ContactEventKind::Fold => SpecialKind::Fold,
                ContactEventKind::BranchPoint => SpecialKind::BranchPoint,
                ContactEventKind::StabilityChange => SpecialKind::StabilityChange,
                _ => SpecialKind::Event,
            },
            contact: event.surface.map(|surface| ContactAt {
                kind: event.kind,
                obstacle: scene.obstacles[surface].name.clone(),
                s: event.s,
            }),
            curve: 0,
            doubt: None,
            parameter: event.point.p,
            second: None,
            arclength: place,
            interval: [place, place],
            precision: f64::NAN,
            first_precision: None,
            arclength_precision: f64::NAN,
            index: [event.index.0, event.index.1],
            out_of_plane: false,
            fold: None,
            derivatives: Vec::new(),
        }
    };
    each.map(special).collect()
}

fn described_end(wanted: &Continue, found: &ContactBranch) -> (bool, String) {
    let at = found.points.last().map_or(wanted.from, |point| point.p);
    let complete = matches!(found.stop, ContactStop::Smooth(Stop::Reached));
    let words = if complete {
        format!("branch 0 reached {} = {at}", wanted.name)
    } else {
        format!("branch 0 ended at {} = {at}: {}", wanted.name, found.stop)
    };
    (complete, words)
}

fn table(
    scene: &Scene,
    wanted: &Continue,
    rows: &[NumberedPoint<'_>],
    found: &ContactBranch,
) -> Result<Table> {
    let units = scene.units;
    let mut columns = vec![
        Column::integers("branch", "number of the branch"),
        Column::reals(
            "parameter",
            wanted.parameter.unit(units),
            wanted.name.clone(),
        ),
        Column::reals(
            "arclength",
            "",
            "length along the curve, the whole range of the parameter counting as 1",
        ),
    ];
    columns.extend(space::pose_columns(units));
    columns.extend(space::wrench_columns("base", units));
    columns.extend(space::wrench_columns("tip", units));
    columns.push(Column::reals(
        "energy",
        units.energy(),
        "elastic energy of the rod",
    ));
    columns.push(Column::reals(
        "normal_total",
        units.force(),
        "sum of the reactions of all contacts",
    ));
    columns.push(Column::integers("contacts", "number of contacts"));
    columns.push(Column::integers("index", INDEX));
    let meaning = "size of the equations left over, in units of the rod";
    columns.push(Column::reals("residual", "", meaning));
    columns.push(Column::words("label", "name of the special point"));
    let labels = labels(found);
    let mut table = Table::new("branch", columns);
    for row in rows {
        let (point, at) = (row.point, &row.point.equilibrium);
        let total: f64 = at.touches.iter().map(|touch| touch.reaction).sum();
        let reals = [point.p, point.arclength].into_iter();
        let reals = reals
            .chain(space::pose(&at.end))
            .chain(space::wrench(&at.base))
            .chain(space::tip_wrench(&at.end))
            .chain([at.end.energy, total]);
        let mut cells: Vec<Cell> = vec![0_usize.into()];
        cells.extend(reals.map(Cell::Real));
        cells.push(at.touches.len().into());
        cells.push(at.index.into());
        cells.push(Cell::Real(at.residual));
        let label = row.event.map_or(String::new(), |k| labels[k].clone());
        cells.push(label.into());
        table.push(&cells)?;
    }
    Ok(table)
}
