//! Record of branches of equilibria, fold curves and special points.

use super::follow::{Located, Row, signed};
use super::subject::Subject;
use crate::error::Result;
use crate::rod::contact::ContactEventKind;
use crate::rod::{ChosenPath, RodSection};
use crate::scene::{Continue, Parameter, Scene, Second, Units};
use crate::solve::implicit_derivative::Rate;
use crate::solve::special_points::{SpecialKind, Status};
use crate::study::neglected_mass::{FoldAtRest, MassEffect};
use crate::study::record::{Cell, Column, Table};
use serde_json::{Value, json};

/// Branches of equilibria, with their special points, fold curves and remarks.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchRecord {
    /// The parameter that varies along the branches.
    pub parameter: Parameter,
    /// Path of the parameter with the names of the scene.
    pub name: String,
    /// The units of every quantity.
    pub units: Units,
    /// Length of the rod (of an assembly: of its first rod).
    pub length: f64,
    /// True if the loads have a potential on every branch: only then the index decides stability.
    pub conservative: bool,
    /// Solution path of the equilibria and the reason for its choice; `None` for an assembly, which has only one
    /// path.
    pub taken: Option<ChosenPath>,
    /// The branches: the scene's own first, then those that cross it, then those found by deflation.
    pub branches: CurveSet,
    /// Curves of folds in two parameters, if requested.
    pub fold_curves: Option<FoldCurves>,
    /// The search by deflation, if requested.
    pub deflation: Option<DeflationRecord>,
    /// Rods at a few points of the branches, evenly chosen.
    pub shapes: Vec<ShapeRecord>,
    /// Rods at as many points as [`Hooks::pictures`](crate::study::Hooks::pictures) asks for, and at the special
    /// points.
    pub pictures: Vec<ShapeRecord>,
    /// Effect of the mass of the rods at the first and the last stable point of every branch, where the mass is
    /// known.
    pub masses: Vec<BranchMass>,
    /// Lines on the obstacles of the scene, for figures.
    pub obstacles: Vec<Vec<[f64; 3]>>,
    /// Further remarks, in sentences.
    pub remarks: Vec<String>,
    /// Branches and fold curves that exist but were not followed: start of each, and the reason.
    pub lost: Vec<String>,
    /// True if the caller interrupted the study; the record has the results up to then.
    pub interrupted: bool,
}

/// Curves and the special points found on them.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveSet {
    /// A row for each point and special point, curve after curve.
    pub points: Table,
    /// The curves, by number.
    pub curves: Vec<CurveRecord>,
    /// The special points, in the order of the rows.
    pub specials: Vec<SpecialPoint>,
}

/// The curves of folds in the parameter and a second one.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldCurves {
    /// The second parameter.
    pub second: Parameter,
    /// Path of the second parameter with the names of the scene.
    pub name: String,
    /// The curves.
    pub curves: CurveSet,
}

/// A branch (or fold curve) that was followed.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveRecord {
    /// Description of the start of the curve.
    pub origin: String,
    /// Descriptions of how the ends of the curve were reached.
    pub ends: Vec<String>,
    /// True if the curve was followed as far as was asked.
    pub complete: bool,
}

/// A special point of a branch or of a fold curve.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecialPoint {
    /// Label of the point, such as "LP1", as in the table.
    pub label: String,
    /// Kind of special point.
    pub kind: SpecialKind,
    /// Event of a contact with an obstacle.
    pub contact: Option<ContactAt>,
    /// Number of the curve of this point.
    pub curve: usize,
    /// Reason for doubt, if the location is only a guess.
    pub doubt: Option<String>,
    /// Value of the parameter.
    pub parameter: f64,
    /// Value of the second parameter, on a fold curve.
    pub second: Option<f64>,
    /// Arclength along the curve, in the measure of [`Continue`].
    pub arclength: f64,
    /// Arclengths that bracket the point.
    pub interval: [f64; 2],
    /// Bound of the error of the followed parameter (on a fold curve: the second), including the error of the
    /// integration along the rod.
    pub precision: f64,
    /// Bound of the error of the first parameter, on a fold curve.
    pub first_precision: Option<f64>,
    /// Estimated error of the arclength.
    pub arclength_precision: f64,
    /// Morse index before and after, in the direction of growing arclength.
    pub index: [Option<usize>; 2],
    /// True at a change of the index by an odd number that no equation within the plane explains: a branch leaves the
    /// plane here.
    pub out_of_plane: bool,
    /// At a fold of a branch: normal form of the dynamics with which a rod of known mass departs.
    pub fold: Option<FoldAtRest>,
    /// Derivatives of the parameter by the fields asked for.
    pub derivatives: Vec<PointDerivative>,
}

/// Derivative of the parameter at a special point by a field of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDerivative {
    /// Path of the field.
    pub field: String,
    /// The derivative with an estimated error, or the reason why none exists.
    pub rate: std::result::Result<Rate, String>,
}

/// Event of a contact on a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactAt {
    /// Kind of event.
    pub kind: ContactEventKind,
    /// Name of the obstacle.
    pub obstacle: String,
    /// Arclength of the unloaded rod.
    pub s: Option<f64>,
}

/// Extent and result of the search by deflation.
#[derive(Debug, Clone, PartialEq)]
pub struct DeflationRecord {
    /// Branches found.
    pub found: usize,
    /// Values of the parameter at which further equilibria were sought.
    pub values: Vec<f64>,
    /// Largest base wrench searched, couple in B/L, force in B/L^2. For an assembly: norm over all rods, with
    /// rotations (rad) and displacements (mean rod lengths) of the bodies.
    pub largest_wrench: f64,
    /// Evaluations of the equations.
    pub evaluations: usize,
}

/// Effect of the mass of the rods at a point of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchMass {
    /// The number of the branch.
    pub branch: usize,
    /// Value of the parameter.
    pub parameter: f64,
    /// Change of frequencies and stability by the mass.
    pub mass: MassEffect,
}

/// Effect of mass at the first and the last stable point of every branch.
pub(super) fn masses(
    scene: &Scene,
    wanted: &Continue,
    subject: &dyn Subject,
    rows: &[Row],
) -> Vec<BranchMass> {
    let stable = |row: &&Row| row.index == Some(0);
    let count = rows.last().map_or(0, |row| row.curve + 1);
    let ends = (0..count).flat_map(|branch| {
        let mut own = rows
            .iter()
            .filter(move |row| row.curve == branch)
            .filter(stable);
        let first = own.next();
        first.into_iter().chain(own.next_back())
    });
    let mass = |row: &Row| {
        Some(BranchMass {
            branch: row.curve,
            parameter: row.p,
            mass: subject.mass(&scene.with(&wanted.parameter, row.p), &row.x)?,
        })
    };
    ends.filter_map(mass).collect()
}

/// A rod at one point of a branch; an assembly has one for each of its rods.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeRecord {
    /// The row of the point in the table.
    pub row: usize,
    /// Value of the parameter.
    pub parameter: f64,
    /// True if the equilibrium is known to be unstable.
    pub unstable: bool,
    /// Evenly spaced sections.
    pub sections: Vec<RodSection>,
}

/// Indices of `count` rows, evenly spaced.
pub(super) fn even(count: usize, rows: &[Row]) -> Vec<usize> {
    even_of(count, rows.len())
}

/// Indices of `count` of `rows` rows, evenly spaced.
pub(super) fn even_of(count: usize, rows: usize) -> Vec<usize> {
    let shown = count.min(rows);
    let row = |k: usize| k * (rows - 1) / (shown - 1).max(1);
    (0..shown).map(row).collect()
}

/// Indices of `count` evenly spaced rows and of all special points; empty if `count` is 0.
pub(super) fn even_and_special(count: usize, rows: &[Row]) -> Vec<usize> {
    if count == 0 {
        return Vec::new();
    }
    let special = |k: &usize| !rows[*k].label.is_empty();
    let mut chosen = even(count, rows);
    chosen.extend((0..rows.len()).filter(special));
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Shapes at the `chosen` rows, for figures only: a shape that cannot be computed is left out.
pub(super) fn shapes(
    scene: &Scene,
    wanted: &Continue,
    subject: &dyn Subject,
    rows: &[Row],
    chosen: Vec<usize>,
) -> Vec<ShapeRecord> {
    let shapes = |k: usize| {
        let row = &rows[k];
        let rods = subject.shapes(&scene.with(&wanted.parameter, row.p), &row.x);
        let record = move |sections| ShapeRecord {
            row: k,
            parameter: row.p,
            unstable: row.index.is_some_and(|i| i > 0),
            sections,
        };
        rods.unwrap_or_default().into_iter().map(record)
    };
    chosen.into_iter().flat_map(shapes).collect()
}

/// Table of branches, or of fold curves over a second parameter.
pub(super) fn table(
    scene: &Scene,
    wanted: &Continue,
    second: Option<&Second>,
    subject: &dyn Subject,
    rows: &[Row],
) -> Result<Table> {
    let units = scene.units;
    let parameter = |column: &'static str, of: Parameter, name: &String| {
        Column::reals(column, of.unit(units), name.clone())
    };
    let (name, curve) = match second {
        Some(_) => (
            "fold_curve",
            Column::integers("curve", "number of the fold curve"),
        ),
        None => ("branch", Column::integers("branch", "number of the branch")),
    };
    let mut columns = vec![
        curve,
        parameter("parameter", wanted.parameter, &wanted.name),
    ];
    columns.extend(second.map(|second| parameter("second", second.parameter, &second.name)));
    columns.push(Column::reals(
        "arclength",
        "",
        "length along the curve, the whole range of the parameter counting as 1",
    ));
    let (numbers, left_over) = subject.columns();
    columns.extend(numbers);
    let label = Column::words("label", "name of the special point");
    columns.extend([subject.index(), left_over, label]);
    let mut table = Table::new(name, columns);
    for row in rows {
        let mut cells: Vec<Cell> = vec![row.curve.into(), row.p.into()];
        cells.extend(row.q.map(Cell::Real));
        let numbers = row.state.numbers.iter().copied();
        cells.extend(
            std::iter::once(row.arclength)
                .chain(numbers)
                .map(Cell::Real),
        );
        cells.extend([
            row.index.into(),
            row.state.left_over.into(),
            row.label.clone().into(),
        ]);
        table.push(&cells)?;
    }
    Ok(table)
}

impl Located {
    /// Public record of the point. On a fold curve `first` is the first parameter with its error bound, and the
    /// second one is in `special`.
    pub(super) fn record(
        &self,
        first: Option<(f64, f64)>,
        fold: Option<FoldAtRest>,
    ) -> SpecialPoint {
        let special = &self.special;
        let along = |s: f64| signed(self.backward, s);
        let (a, b) = special.interval;
        let (before, after) = special.index;
        SpecialPoint {
            label: self.label.clone(),
            kind: special.kind,
            contact: None,
            curve: self.curve,
            doubt: match &special.status {
                Status::Converged => None,
                Status::Guess(why) => Some(why.clone()),
            },
            parameter: first.map_or(special.point.p, |(p, _)| p),
            second: first.map(|_| special.point.p),
            arclength: along(special.point.arclength),
            interval: [along(a).min(along(b)), along(a).max(along(b))],
            precision: special.error_p,
            first_precision: first.map(|(_, error)| error),
            arclength_precision: signed(false, special.error_s),
            index: if self.backward {
                [after, before]
            } else {
                [before, after]
            },
            out_of_plane: false,
            fold,
            derivatives: Vec::new(),
        }
    }
}

impl SpecialPoint {
    /// Name of the kind: a fold of a fold curve is a turning point, where two folds of the branches meet.
    pub fn kind_name(&self) -> String {
        if let Some(contact) = &self.contact {
            return contact.kind.as_str().to_owned();
        }
        match (self.kind, self.second) {
            (SpecialKind::Fold, Some(_)) => "turning point".to_owned(),
            (kind, _) => kind.to_string(),
        }
    }

    /// True if the index changes by an odd number where the equations of the branch stay regular.
    pub(super) fn is_odd_change(&self) -> bool {
        let jump = self.index[0].zip(self.index[1]);
        self.kind == SpecialKind::StabilityChange
            && jump.is_some_and(|(before, after)| before.abs_diff(after) % 2 == 1)
    }

    fn summary(&self) -> Value {
        let status = match &self.doubt {
            Some(_) => "guess",
            None => "converged",
        };
        let mut object = json!({
            "label": self.label,
            "kind": self.kind_name(),
            "out_of_plane": self.out_of_plane,
            "status": status,
            "reason": self.doubt,
            "parameter": self.parameter,
            "arclength": self.arclength,
            "interval": self.interval,
        });
        match self.second {
            Some(second) => {
                object["curve"] = self.curve.into();
                object["second"] = second.into();
                object["precision"] = json!({
                    "parameter": self.first_precision,
                    "second": self.precision,
                    "arclength": self.arclength_precision,
                });
            }
            None => {
                object["branch"] = self.curve.into();
                object["precision"] =
                    json!({ "parameter": self.precision, "arclength": self.arclength_precision });
                object["index_before"] = self.index[0].into();
                object["index_after"] = self.index[1].into();
                if let Some(contact) = &self.contact {
                    object["obstacle"] = contact.obstacle.as_str().into();
                    object["s"] = contact.s.into();
                }
                if let Some(fold) = &self.fold {
                    object["fold"] = fold.json();
                }
                if !self.derivatives.is_empty() {
                    derivatives_into(&mut object, &self.derivatives);
                }
            }
        }
        object
    }
}

/// Adds `derivatives`, `derivative_errors` and, where some are missing, `no_derivatives`.
fn derivatives_into(object: &mut Value, all: &[PointDerivative]) {
    for PointDerivative { field, rate } in all {
        match rate {
            Ok(Rate { value, error }) => {
                object["derivatives"][field] = json!(value);
                object["derivative_errors"][field] = json!(error);
            }
            Err(why) => {
                object["derivatives"][field] = Value::Null;
                object["no_derivatives"][field] = why.as_str().into();
            }
        }
    }
}

impl CurveRecord {
    pub(in crate::study) fn end(&mut self, complete: bool, words: String) {
        self.complete &= complete;
        self.ends.push(words);
    }
}

impl CurveSet {
    /// True if every curve was followed as far as was asked.
    pub fn is_complete(&self) -> bool {
        self.curves.iter().all(|curve| curve.complete)
    }

    /// The number of the curve of each row.
    pub fn numbers(&self) -> &[Option<i64>] {
        let first = self.points.columns.first();
        first.map_or(&[], |column| self.points.integers(&column.name))
    }

    /// The row of a special point.
    pub fn row(&self, at: &SpecialPoint) -> Option<usize> {
        let labels = self.points.words("label");
        labels.iter().position(|label| *label == at.label)
    }

    fn curve_summaries(&self) -> Value {
        let numbers = self.numbers();
        let one = |(number, curve): (usize, &CurveRecord)| {
            let own = numbers.iter().filter(|n| **n == Some(number as i64));
            json!({
                "number": number,
                "from": curve.origin,
                "points": own.count(),
                "ends": curve.ends,
                "complete": curve.complete,
            })
        };
        self.curves.iter().enumerate().map(one).collect()
    }

    fn special_summaries(&self) -> Value {
        let one = |at: &SpecialPoint| {
            let mut object = at.summary();
            if let Some(row) = self.row(at) {
                // The columns of the equilibrium follow the arclength.
                let columns = self.points.columns.iter();
                let after = columns.skip_while(|column| column.name != "arclength");
                let numbers = after.skip(1).filter_map(|column| match column.cell(row) {
                    Cell::Real(x) => Some((column.name.to_string(), x.into())),
                    _ => None,
                });
                object["state"] = Value::Object(numbers.collect());
            }
            object
        };
        self.specials.iter().map(one).collect()
    }
}

impl FoldCurves {
    /// The second parameter with its unit, for the axes of figures.
    pub fn label(&self, units: Units) -> String {
        Units::label(&self.name, self.second.unit(units))
    }
}

impl BranchRecord {
    /// The parameter with its unit, for the axes of figures.
    pub fn label(&self) -> String {
        Units::label(&self.name, self.parameter.unit(self.units))
    }

    /// True if everything was followed as far as was asked, and no branch was lost.
    pub fn is_complete(&self) -> bool {
        let folds = self.fold_curves.as_ref();
        !self.interrupted
            && self.lost.is_empty()
            && self.branches.is_complete()
            && folds.is_none_or(|folds| folds.curves.is_complete())
    }

    /// All but the tables and shapes, as JSON.
    pub fn summary(&self) -> Value {
        let branches = &self.branches;
        let ends = branches.curves.iter().flat_map(|curve| &curve.ends);
        let mut summary = json!({
            "parameter": self.name,
            "path": self.taken.as_ref().map(|taken| json!({ "kind": taken.path.as_str(), "why": taken.why })),
            "points": branches.points.rows(),
            "conservative": self.conservative,
            "branches": branches.curve_summaries(),
            "special_points": branches.special_summaries(),
            "complete": self.is_complete(),
            "lost": self.lost,
            "stop": ends.collect::<Vec<_>>(),
            "interrupted": self.interrupted,
            "remarks": self.remarks,
        });
        if !self.masses.is_empty() {
            let one = |at: &BranchMass| {
                let mut json = at.mass.json();
                json["branch"] = at.branch.into();
                json["parameter"] = at.parameter.into();
                json
            };
            summary["mass"] = self.masses.iter().map(one).collect();
        }
        if let Some(search) = &self.deflation {
            summary["deflation"] = json!({
                "found": search.found,
                "values": search.values,
                "largest_wrench": search.largest_wrench,
                "evaluations": search.evaluations,
            });
        }
        if let Some(folds) = &self.fold_curves {
            summary["fold_curves"] = json!({
                "second": folds.name,
                "points": folds.curves.points.rows(),
                "curves": folds.curves.curve_summaries(),
                "special_points": folds.curves.special_summaries(),
            });
        }
        summary
    }
}
