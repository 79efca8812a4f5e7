//! Walls under pressure at rest: sections of tubes and inflated membranes, and their branches.

use super::{Cell, Column, Table};
use crate::error::{Error, Result};
use crate::membrane::InflatedState;
use crate::ring::Section;
use crate::scene::{
    MembraneLoad, MembraneScene, Scene, TubeScene, Units, WallBranch, WallParameter, WallScene,
};
use crate::tube::{Tube, TubeSection, WallLaw};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Points on half a lobe of a section.
const POINTS: usize = 41;
/// Shapes of a branch that are drawn.
const SHAPES: usize = 7;

/// A wall in equilibrium, in the units of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct WallRecord {
    /// Units of all quantities.
    pub units: Units,
    /// All numbers of the state, as JSON.
    pub summary: Value,
    /// Outline of the section, or meridian of the membrane.
    pub shape: Table,
}

/// A branch of a wall, in the units of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct WallBranchRecord {
    /// Units of all quantities.
    pub units: Units,
    /// The parameter with its range.
    pub branch: WallBranch,
    /// A row for each point and special point.
    pub points: Table,
    /// Special points, in the order of the rows.
    pub specials: Vec<WallSpecial>,
    /// Shapes at a few points, each with the parameter there.
    pub shapes: Vec<(f64, Vec<[f64; 2]>)>,
    /// Reason for an end of the branch before the last value; None if the last value was reached.
    pub stop: Option<String>,
}

/// A special point of the branch of a wall.
#[derive(Debug, Clone, PartialEq)]
pub struct WallSpecial {
    /// "buckling", "touch" or "line" of a tube; "LP1", "LP2", .. of a membrane.
    pub label: String,
    /// The kind: as the label of a tube, "fold" of a membrane.
    pub kind: &'static str,
    /// Value of the parameter.
    pub parameter: f64,
    /// Pressure there.
    pub pressure: f64,
}

impl WallBranchRecord {
    /// All but the tables and shapes, as JSON.
    pub fn summary(&self) -> Value {
        let special = |at: &WallSpecial| json!({ "label": at.label, "kind": at.kind, "parameter": at.parameter, "pressure": at.pressure });
        json!({
            "parameter": self.branch.parameter.name(),
            "points": self.points.rows(),
            "special_points": self.specials.iter().map(special).collect::<Vec<_>>(),
            "complete": self.stop.is_none(),
            "stop": self.stop,
        })
    }
}

fn wall(scene: &Scene) -> Result<&WallScene> {
    scene.wall().ok_or_else(|| {
        Error::domain(
            "this is no scene of a wall under pressure: it has neither [tube] nor [membrane]",
        )
    })
}

/// Equilibrium of the wall of a scene.
///
/// # Errors
/// A scene without a wall; a load that no state has.
pub fn equilibrium(scene: &Scene) -> Result<WallRecord> {
    let units = scene.units;
    let (summary, shape) = match wall(scene)? {
        WallScene::Tube(given) => {
            let tube = given.wall.tube()?;
            let at = given.section(&tube)?;
            let points = outline(&tube, &at);
            let mut summary = tube_summary(given, &tube, &at);
            summary["shape"] = json!(points);
            (summary, shape_table(units, ["x", "y"], &points)?)
        }
        WallScene::Membrane(given) => {
            let at = given.equilibrium()?;
            let points = given.membrane.meridian(at.stretch)?;
            let mut summary = membrane_summary(given, &at)?;
            summary["shape"] = json!(points);
            (summary, shape_table(units, ["r", "z"], &points)?)
        }
    };
    Ok(WallRecord {
        units,
        summary,
        shape,
    })
}

/// A finite number, or null.
fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn tube_summary(given: &TubeScene, tube: &Tube, at: &TubeSection) -> Value {
    let radius = tube.radius();
    let ring = at.ring.as_ref();
    let over = |x: f64| x / radius;
    let round = radius * at.area_ratio.sqrt();
    let axes = ring.map_or([round; 2], |ring| [ring.tip * radius, ring.trough * radius]);
    json!({
        "pressure": at.pressure,
        "area": at.area_ratio,
        "lumen_area": at.area,
        "energy": at.energy,
        "wave_speed": given.density.map_or(Value::Null, |density| finite(at.wave_speed(density))),
        "compliance": finite(-1.0 / at.slope),
        "contact": ring.map_or("none", |ring| ring.contact.name()),
        "contact_force": ring.map(|ring| ring.contact_force * tube.pressure_scale() * radius),
        "contact_length": ring.map(|ring| 2.0 * ring.contact_half_length * radius),
        "curvature_tip": ring.map_or(1.0 / round, |ring| over(ring.curvature_tip)),
        "curvature_trough": ring.map_or(1.0 / round, |ring| over(ring.curvature_trough)),
        "axes": axes,
    })
}

fn membrane_summary(given: &MembraneScene, at: &InflatedState) -> Result<Value> {
    let membrane = &given.membrane;
    let mut summary = json!({
        "pressure": at.pressure,
        "pressure_number": membrane.pressure_number(at.pressure),
        "height": at.height,
        "volume": at.volume,
        "energy": at.energy,
        "stretch": at.stretch,
        "edge_stretch": at.edge_stretch,
        "edge_angle": at.edge_angle,
    });
    let slope = match given.state {
        MembraneLoad::Gas { vessel, .. } => {
            summary["contents"] = json!(vessel.contents(at));
            vessel.slope(membrane, at.stretch)?
        }
        MembraneLoad::Pressure(_) | MembraneLoad::Stretch(_) => membrane.slope(at.stretch)?,
    };
    summary["stable"] = json!(slope > 0.0);
    Ok(summary)
}

/// Outline of a section, in the units of the tube; a circle of its area for laws without a ring.
fn outline(tube: &Tube, at: &TubeSection) -> Vec<[f64; 2]> {
    let radius = tube.radius();
    match &at.ring {
        Some(ring) => scaled(ring, radius),
        None => {
            let round = radius * at.area_ratio.sqrt();
            let angle = |k: usize| 2.0 * PI * k as f64 / 160.0;
            (0..=160)
                .map(|k| [round * angle(k).cos(), round * angle(k).sin()])
                .collect()
        }
    }
}

fn scaled(ring: &Section, radius: f64) -> Vec<[f64; 2]> {
    let points = ring.outline(POINTS).into_iter();
    points.map(|point| point.map(|x| x * radius)).collect()
}

fn shape_table(units: Units, names: [&'static str; 2], points: &[[f64; 2]]) -> Result<Table> {
    let meaning = match names[0] {
        "x" => [
            "coordinate along the axis of a lobe",
            "coordinate across it",
        ],
        _ => [
            "distance from the axis of the membrane",
            "height above the edge, or above the centre of a sphere",
        ],
    };
    let columns = [0, 1].map(|k| Column::reals(names[k], units.length(), meaning[k]));
    let mut table = Table::new("shape", columns.into());
    for [x, y] in points {
        table.push(&[Cell::Real(*x), Cell::Real(*y)])?;
    }
    Ok(table)
}

/// Branch of the wall of a scene.
///
/// # Errors
/// A scene without a wall or without `[continue]`; a first value that no state has.
pub fn branch(scene: &Scene) -> Result<WallBranchRecord> {
    let wall = wall(scene)?;
    let follow = *wall.follow().ok_or_else(|| {
        Error::domain(
            "this scene has no [continue]: add [continue] with parameter, from and to, or use `snaprod equilibrium`",
        )
    })?;
    match wall {
        WallScene::Tube(given) => tube_branch(scene.units, given, follow),
        WallScene::Membrane(given) => membrane_branch(scene.units, given, follow),
    }
}

/// A value of the parameter that has a row, with the label of the row.
struct Stop {
    at: f64,
    label: String,
    kind: &'static str,
}

/// Values of the parameter in the order of the branch: even ones, and the special points between them.
fn stops(follow: WallBranch, specials: Vec<Stop>) -> Vec<Stop> {
    let last = follow.points - 1;
    let even = (0..=last).map(|k| Stop {
        at: follow.from + (follow.to - follow.from) * k as f64 / last as f64,
        label: String::new(),
        kind: "",
    });
    let (low, high) = (follow.from.min(follow.to), follow.from.max(follow.to));
    let between = specials
        .into_iter()
        .filter(|stop| (low..=high).contains(&stop.at));
    let mut all: Vec<Stop> = even.chain(between).collect();
    let sign = (follow.to - follow.from).signum();
    all.sort_by(|a, b| (sign * a.at).total_cmp(&(sign * b.at)));
    all
}

fn tube_branch(units: Units, given: &TubeScene, follow: WallBranch) -> Result<WallBranchRecord> {
    let tube = given.wall.tube()?;
    let by_area = follow.parameter == WallParameter::Area;
    let at = |value: f64| {
        if by_area {
            tube.at_area(value)
        } else {
            tube.at_pressure(value)
        }
    };
    let mut specials = Vec::new();
    if let WallLaw::Ring(ring) = tube.law() {
        let sections = [
            ("buckling", Some(ring.buckling())),
            ("touch", Some(ring.touch())),
            ("line", ring.line()),
        ];
        for (kind, section) in sections {
            specials.extend(section.map(|section| Stop {
                at: if by_area {
                    section.area
                } else {
                    section.pressure * tube.pressure_scale()
                },
                label: kind.to_owned(),
                kind,
            }));
        }
    }
    let columns = vec![
        parameter_column(units, follow.parameter),
        Column::reals("pressure", units.stress(), "pressure outside less inside"),
        Column::reals("area", "", "area over that of the round section at no load"),
        Column::reals("lumen_area", units.area(), "area of the section"),
        Column::reals(
            "energy",
            units.force(),
            "stored energy per length of the tube",
        ),
        Column::reals(
            "wave_speed",
            units.velocity(),
            "speed of pulses in the fluid",
        ),
        Column::words(
            "contact",
            "contact of the wall with itself: none, point or line",
        ),
        Column::reals(
            "axis_a",
            units.length(),
            "distance from the centre to the tip of a lobe",
        ),
        Column::reals(
            "axis_b",
            units.length(),
            "distance from the centre to the wall between lobes",
        ),
        Column::words("label", "name of the special point"),
    ];
    follow_stops(
        units,
        follow,
        columns,
        stops(follow, specials),
        &mut |stop, table| {
            let section = at(stop.at)?;
            let summary = tube_summary(given, &tube, &section);
            let axis = |k: usize| summary["axes"][k].as_f64().unwrap_or(f64::NAN);
            let speed = summary["wave_speed"].as_f64().unwrap_or(f64::NAN);
            let contact = section
                .ring
                .as_ref()
                .map_or("none", |ring| ring.contact.name());
            table.push(&[
                stop.at.into(),
                section.pressure.into(),
                section.area_ratio.into(),
                section.area.into(),
                section.energy.into(),
                speed.into(),
                contact.into(),
                axis(0).into(),
                axis(1).into(),
                stop.label.clone().into(),
            ])?;
            Ok((section.pressure, outline(&tube, &section)))
        },
    )
}

fn membrane_branch(
    units: Units,
    given: &MembraneScene,
    follow: WallBranch,
) -> Result<WallBranchRecord> {
    let membrane = &given.membrane;
    let (low, high) = (follow.from.min(follow.to), follow.from.max(follow.to));
    let gas = match given.state {
        MembraneLoad::Gas { vessel, .. } => Some(vessel),
        MembraneLoad::Pressure(_) | MembraneLoad::Stretch(_) => None,
    };
    let folds = match gas {
        Some(vessel) => vessel.folds(membrane, low, high)?,
        None => membrane.limit_points_between(low, high)?,
    };
    let numbered = folds.iter().enumerate().map(|(k, at)| Stop {
        at: at.stretch,
        label: format!("LP{}", k + 1),
        kind: "fold",
    });
    let mut columns = vec![
        parameter_column(units, follow.parameter),
        Column::reals("pressure", units.stress(), "pressure inside less outside"),
        Column::reals(
            "pressure_number",
            "",
            "pressure times radius over thickness and C1",
        ),
        Column::reals(
            "height",
            units.length(),
            "height of the pole; radius of a sphere",
        ),
        Column::reals("volume", units.volume(), "volume inside"),
        Column::reals("energy", units.energy(), "stored energy"),
        Column::reals("edge_stretch", "", "meridional stretch at the edge"),
        Column::reals(
            "edge_angle",
            "",
            "angle of the wall below the plane of the edge",
        ),
    ];
    if gas.is_some() {
        columns.push(Column::reals(
            "contents",
            units.energy(),
            "content p V of gas",
        ));
    }
    columns.push(Column::words("label", "name of the special point"));
    let stops = stops(follow, numbered.collect());
    follow_stops(units, follow, columns, stops, &mut |stop, table| {
        let at = membrane.at_stretch(stop.at)?;
        let numbers = [
            stop.at,
            at.pressure,
            membrane.pressure_number(at.pressure),
            at.height,
            at.volume,
            at.energy,
            at.edge_stretch,
            at.edge_angle,
        ];
        let mut cells: Vec<Cell> = numbers.map(Cell::Real).into();
        cells.extend(gas.map(|vessel| Cell::Real(vessel.contents(&at))));
        cells.push(stop.label.clone().into());
        table.push(&cells)?;
        Ok((at.pressure, membrane.meridian(stop.at)?))
    })
}

/// Adds the row of a stop to a table; returns the pressure and the points of the shape there.
type RowOf<'a> = dyn FnMut(&Stop, &mut Table) -> Result<(f64, Vec<[f64; 2]>)> + 'a;

fn parameter_column(units: Units, parameter: WallParameter) -> Column {
    Column::reals("parameter", parameter.unit(units), parameter.name())
}

/// Rows of a branch, each by `row`.
fn follow_stops(
    units: Units,
    branch: WallBranch,
    columns: Vec<Column>,
    stops: Vec<Stop>,
    row: &mut RowOf<'_>,
) -> Result<WallBranchRecord> {
    let mut record = WallBranchRecord {
        units,
        branch,
        points: Table::new("branch", columns),
        specials: Vec::new(),
        shapes: Vec::new(),
        stop: None,
    };
    let between = (stops.len() / SHAPES).max(1);
    for (k, stop) in stops.iter().enumerate() {
        let (pressure, shape) = match row(stop, &mut record.points) {
            Ok(found) => found,
            Err(error) if k == 0 => return Err(error),
            Err(error) => {
                record.stop = Some(error.to_string());
                break;
            }
        };
        if !stop.label.is_empty() {
            record.specials.push(WallSpecial {
                label: stop.label.clone(),
                kind: stop.kind,
                parameter: stop.at,
                pressure,
            });
        }
        if k % between == 0 || k + 1 == stops.len() {
            record.shapes.push((stop.at, shape));
        }
    }
    Ok(record)
}
