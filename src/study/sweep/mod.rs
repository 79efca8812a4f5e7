//! Sweeps: one scene with some fields varied on a grid, or at random; a row of quantities for each point.
//!
//! A row depends on the number of its point only. Chunks of rows can therefore be computed in any order, by any
//! number of threads or machines, with identical bytes.

mod column_units;
mod csv;
mod directory;
mod extremes;
mod quantity_names;
mod special_names;
mod vary;

pub use csv::{fields, records};
pub use directory::{ChunkStatus, Directory, Rows};
pub(in crate::study) use extremes::is_extreme;
pub use vary::Vary;

use super::record::DiscardRows;
use super::run::Fields;
use super::{Cell, Column, Csv, FirstOrder, Hooks, Quiet, Sink, Table, branch, dispatch};
use crate::error::{Error, Result};
use crate::scene::Scene;
use extremes::{Extremes, looked_at};
use serde_json::{Value, json};
pub(in crate::study) use special_names::SpecialName;
use std::ops::Range;

/// A sweep.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The text of the scene.
    scene: String,
    /// Overrides applied before the varied fields, as `rod.damping=0.2`.
    set: Vec<String>,
    vary: Vec<Vary>,
    /// Number of random points and seed; `None`: all points of the grid, the last field varying fastest.
    random: Option<(usize, u64)>,
    /// Paths into the summary, into `events`, or to an extreme of the trajectory: "end.x", "events.-1.t", "greatest.y".
    quantities: Vec<String>,
    /// Quantities requested by the user. The others are the usual ones, which some scenes do not have.
    asked: Vec<String>,
}

/// The sweep was interrupted before the row of a point was complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

/// Columns of every sweep.
const POINT: &str = "point";
const WHY: &str = "why";
/// Largest number of points of a sweep.
const MOST: usize = 1_000_000_000;
/// Largest number of points in a chunk, and approximate minimum of the number of chunks.
const CHUNK: usize = 256;
const CHUNKS: usize = 64;

impl Sweep {
    /// A sweep of a scene given as text. `set`: overrides of the scene. `quantities`: columns of the results, as
    /// paths into summary.json, with `events` for events.json, `least.` and `greatest.` for the extremes of a
    /// trajectory column. Without any, the usual ones of the scene are taken. Varied fields always have a column.
    ///
    /// # Errors
    /// No field to vary, or a repeated one; a count that is missing in a grid, or given in a random sweep; no points,
    /// or more than 1e9; a quantity without a name, or with the name of a column of every sweep.
    pub fn new(
        scene: String,
        set: Vec<String>,
        vary: Vec<Vary>,
        random: Option<(usize, u64)>,
        quantities: Vec<String>,
    ) -> Result<Self> {
        let refuse = |why: String| Err(Error::domain(why));
        if vary.is_empty() {
            return refuse("a sweep varies something: give --vary PATH=FROM:TO:COUNT".to_owned());
        }
        for (i, one) in vary.iter().enumerate() {
            if vary[..i].iter().any(|other| other.is_of(&one.path)) {
                return refuse(format!("--vary: {} is varied twice", one.path));
            }
            match (one.count(), random) {
                (None, None) => {
                    return refuse(format!(
                        "--vary {}: a grid needs a count, as in FROM:TO:COUNT; or give --random N",
                        one.path
                    ));
                }
                (Some(_), Some(_)) if !one.is_list() => {
                    return refuse(format!(
                        "--vary {}: points at random have no count; write FROM:TO",
                        one.path
                    ));
                }
                _ => {}
            }
        }
        let mut sweep = Self {
            scene,
            set,
            vary: vary.into_iter().map(Vary::of_field).collect(),
            random,
            quantities: Vec::new(),
            asked: Vec::new(),
        };
        let mut all = sweep.vary.iter().map(|one| one.count().unwrap_or(1));
        let all = all.try_fold(1usize, |all, n| all.checked_mul(n));
        match random.map_or(all, |(n, _)| Some(n)) {
            Some(n) if (1..=MOST).contains(&n) => {}
            _ => return refuse(format!("a sweep has from 1 to {MOST} points")),
        }
        sweep = sweep.telling(quantities)?;
        if sweep.quantities.is_empty() {
            sweep.quantities = sweep.usual();
        }
        Ok(sweep)
    }

    /// The sweep with additional quantities; those that already have a column are not repeated.
    ///
    /// # Errors
    /// A quantity without a name, or with the name of a column of every sweep.
    pub fn telling(mut self, quantities: Vec<String>) -> Result<Self> {
        for path in quantities {
            if path.trim().is_empty() {
                return Err(Error::domain(format!(
                    "column {path:?}: its name is empty; write a path into summary.json, or into events, as in end.x or events.-1.t"
                )));
            }
            if [POINT, WHY].contains(&path.as_str()) {
                return Err(Error::domain(format!(
                    "column {path}: every sweep has a column of this name, which is no quantity of a point; leave it out"
                )));
            }
            let column = self.column_of(&path);
            if self.varied(&column).is_some() {
                continue;
            }
            if !self.quantities.contains(&column) {
                self.quantities.push(column.clone());
            }
            self.asked.push(column);
        }
        Ok(self)
    }

    /// Column name of a quantity or varied field, for any spelling of its path.
    pub fn column_of(&self, path: &str) -> String {
        let field = self.varied(path).map_or(path, |one| &one.path);
        field.to_owned()
    }

    fn varied(&self, path: &str) -> Option<&Vary> {
        self.vary.iter().find(|one| one.is_of(path))
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        let all = self.vary.iter().map(|one| one.count().unwrap_or(1));
        self.random.map_or_else(|| all.product(), |(n, _)| n)
    }

    /// The varied fields.
    pub fn vary(&self) -> &[Vary] {
        &self.vary
    }

    /// True for a grid, false for random points.
    pub fn is_grid(&self) -> bool {
        self.random.is_none()
    }

    /// Paths of the quantities in a row.
    pub fn quantities(&self) -> &[String] {
        &self.quantities
    }

    /// Points of each chunk, in order; they depend on the number of points only.
    pub fn chunks(&self) -> Vec<Range<usize>> {
        let points = self.points();
        let size = (points / CHUNKS).clamp(1, CHUNK);
        let starts = (0..points).step_by(size);
        starts.map(|from| from..(from + size).min(points)).collect()
    }

    /// Identity of the sweep: equal identities imply equal rows.
    pub fn identity(&self) -> Value {
        let texts = |i: usize| self.values(i);
        json!({
            "scene": self.scene,
            "set": self.set,
            "vary": self.vary.iter().map(|one| &one.path).collect::<Vec<_>>(),
            "first": texts(0),
            "last": texts(self.points() - 1),
            "counts": self.vary.iter().map(Vary::count).collect::<Vec<_>>(),
            // A range is determined by ends, count and spacing, a list by its values.
            "logarithmic": self.vary.iter().map(Vary::is_logarithmic).collect::<Vec<_>>(),
            "lists": self.vary.iter().map(Vary::listed).collect::<Vec<_>>(),
            "random": self.random.map(|(points, seed)| json!({ "points": points, "seed": seed })),
            "columns": self.quantities,
            "points": self.points(),
            "chunk": self.chunks()[0].len(),
            "versions": { "snaprod": env!("CARGO_PKG_VERSION") },
        })
    }

    /// Values of the varied fields at a point, as TOML.
    pub fn values(&self, point: usize) -> Vec<String> {
        match self.random {
            Some((_, seed)) => {
                let all = self.vary.iter().enumerate();
                all.map(|(k, one)| one.drawn(chance(seed, point as u64, k as u64)))
                    .collect()
            }
            None => {
                let mut rest = point;
                let mut values: Vec<String> = (self.vary.iter().rev())
                    .map(|one| {
                        let count = one.count().unwrap_or(1);
                        let i = rest % count;
                        rest /= count;
                        one.on_grid(i)
                    })
                    .collect();
                values.reverse();
                values
            }
        }
    }

    /// Error of the first point if the last is invalid, too: then hardly any point is valid.
    pub fn refused(&self) -> Option<String> {
        match (self.scene(0), self.scene(self.points() - 1)) {
            (Err(why), Err(_)) => Some(why),
            _ => None,
        }
    }

    /// Scene of a point.
    ///
    /// # Errors
    /// Errors of the scene, as text.
    pub fn scene(&self, point: usize) -> std::result::Result<Scene, String> {
        let varied = self.vary.iter().zip(self.values(point));
        let varied: Vec<String> = varied
            .map(|(one, value)| format!("{}={value}", one.path))
            .collect();
        let all: Vec<&str> = self.set.iter().chain(&varied).map(String::as_str).collect();
        Scene::parse_with(&self.scene, &all).map_err(|faults| faults.to_string())
    }

    /// Usual quantities for the scene of the first valid end point; empty if both ends are refused.
    fn usual(&self) -> Vec<String> {
        let scene = self.scene(0).or_else(|_| self.scene(self.points() - 1));
        let Ok(scene) = scene else {
            return Vec::new();
        };
        let words: &[&str] = if scene.is_bar() {
            &[
                "outcome",
                "end.t",
                "end.tip.x",
                "end.tip.v",
                "breaking.time",
            ]
        } else if scene.flow().is_some() {
            &["outcome", "end.t"]
        } else if scene.inflation().is_some() {
            &[
                "outcome",
                "end.t",
                "max_height.value",
                "energy_error.relative",
            ]
        } else if scene.wall().is_some() {
            &["pressure", "energy"]
        } else if scene.is_assembly() && scene.is_motion() {
            &["outcome", "end.t", "snaps", "energy_error.relative"]
        } else if scene.continuation.is_some() {
            &["complete", "LP1", "BP1"]
        } else if !scene.is_motion() {
            &["energy", "index"]
        } else if scene.is_planar() {
            &[
                "outcome",
                "end.t",
                "end.x",
                "end.y",
                "end.vx",
                "end.vy",
                "snaps",
                "layers",
                "events.-1.t",
                "end.dissipated",
                "energy_error.relative",
            ]
        } else {
            &[
                "outcome",
                "end.t",
                "end.x",
                "end.y",
                "end.z",
                "snaps",
                "layers",
                "events.-1.t",
                "end.dissipated",
                "energy_error.relative",
            ]
        };
        words.iter().map(|word| (*word).to_owned()).collect()
    }

    /// Table of the sweep without rows: point number, varied fields, quantities, and the error of a point.
    pub fn table(&self) -> Table {
        // Cells are written as text, since the type of a column is not known beforehand.
        let varied = self.vary.iter().map(|one| (&one.path, "varied"));
        let told = self.quantities.iter().map(|path| (path, "of the summary"));
        let middle = varied
            .chain(told)
            .map(|(path, meaning)| Column::words(path.clone(), meaning));
        let point = Column::integers(POINT, "its number, from 0");
        let why = Column::words(WHY, "why the point has no run, or its run fell short");
        let columns = std::iter::once(point).chain(middle).chain([why]);
        Table::new("sweep", columns.collect())
    }

    /// CSV rows of a range of points, without the line of names. A point without a run has a row with its error.
    ///
    /// # Errors
    /// [`Interrupted`] on request of `hooks`, which see every point.
    pub fn rows(
        &self,
        points: Range<usize>,
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<String, Interrupted> {
        let mut rows = Vec::with_capacity(points.len());
        for point in points {
            rows.push(self.row(point, hooks)?);
            hooks.progress(1.0, point as f64);
        }
        let mut text = Vec::new();
        let mut csv = Csv::without_names(&mut text);
        for row in &rows {
            // Tables in memory do not fail.
            let _ = csv.row(row);
        }
        Ok(String::from_utf8(text).unwrap_or_default())
    }

    /// Summary of a point with its events, or the reason for no run.
    fn comes_of(
        &self,
        point: usize,
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<std::result::Result<Value, String>, Interrupted> {
        let extremes = self.quantities.iter().any(|path| is_extreme(path));
        let found = self
            .scene(point)
            .and_then(|scene| outcome(scene, extremes, hooks).map_err(|e| e.to_string()));
        match found {
            Ok(summary) if summary["outcome"] == "interrupted" => Err(Interrupted),
            found => Ok(found),
        }
    }

    fn row(
        &self,
        point: usize,
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Vec<Cell>, Interrupted> {
        let mut row = vec![Cell::from(point)];
        row.extend(self.values(point).into_iter().map(Cell::from));
        match self.comes_of(point, hooks)? {
            Ok(summary) => {
                let each = self.quantities.iter();
                let mut why = cell(&summary, "reason");
                row.extend(each.map(|path| {
                    quantity(&summary, path).unwrap_or_else(|absence| {
                        // The first absent point tells what the branch has.
                        if why == Cell::Missing && self.asked.contains(path) {
                            why = absence.into();
                        }
                        Cell::Missing
                    })
                }));
                row.push(why);
            }
            Err(why) => {
                row.extend(self.quantities.iter().map(|path| match path.as_str() {
                    "outcome" => "refused".into(),
                    _ => Cell::Missing,
                }));
                // One line: errors have their location in further lines.
                let why: Vec<&str> = why.lines().map(str::trim).collect();
                row.push(why.join(" ").into());
            }
        }
        Ok(row)
    }
}

/// Summary of a scene of any kind with its events; `extremes`: including the extremes of the trajectory.
pub(in crate::study) fn outcome(
    mut scene: Scene,
    extremes: bool,
    hooks: &mut dyn Hooks,
) -> Result<Value> {
    if extremes {
        looked_at(&mut scene);
    } else if let Some(run) = &mut scene.run {
        // Two rows of an unread table.
        run.samples = 2;
    }
    if scene.continuation.is_some() {
        let record = branch(&scene, &mut Quiet(hooks))?;
        let mut summary = record.summary();
        if record.interrupted {
            summary["outcome"] = "interrupted".into();
        }
        if !record.is_complete() {
            let ends = record.branches.curves.iter().flat_map(|curve| &curve.ends);
            let ends: Vec<&str> = record.lost.iter().chain(ends).map(String::as_str).collect();
            summary["reason"] = ends.join("; ").into();
        }
        return Ok(summary);
    }
    if !scene.is_medium() && !scene.is_motion() {
        let (mut summary, _) = dispatch::rest(&scene, &FirstOrder::default())?;
        summary["events"] = Value::Array(Vec::new());
        return Ok(summary);
    }
    let mut seen = Extremes::default();
    let sink: &mut dyn Sink = if extremes {
        &mut seen
    } else {
        &mut DiscardRows
    };
    let found = dispatch::motion(&scene, Fields::None, sink, &mut Quiet(hooks))?;
    let mut summary = found.summary;
    seen.put_into(&mut summary);
    summary["events"] = Value::Array(found.events);
    Ok(summary)
}

/// Value of a quantity: at a path of the summary, or at a special point.
///
/// # Errors
/// Reason for the absence of a special point.
pub(in crate::study) fn quantity(summary: &Value, path: &str) -> std::result::Result<Cell, String> {
    match SpecialName::parse(path) {
        Some(name) => name.find(summary),
        None => Ok(cell(summary, path)),
    }
}

/// Value at a path of names and indices (negative: from the end); missing unless a word or number.
pub(in crate::study) fn cell(summary: &Value, path: &str) -> Cell {
    let mut at = summary;
    for step in path.split('.') {
        let inner = match at {
            Value::Array(list) => element(list, step),
            other => other.get(step),
        };
        let Some(inner) = inner else {
            return Cell::Missing;
        };
        at = inner;
    }
    number(at)
}

/// Cell of a number or word.
fn number(at: &Value) -> Cell {
    match at {
        Value::Number(number) => match number.as_i64() {
            Some(whole) => Cell::Integer(whole),
            None => Cell::Real(number.as_f64().unwrap_or(f64::NAN)),
        },
        Value::Bool(true) => "true".into(),
        Value::Bool(false) => "false".into(),
        Value::String(word) => Cell::Word(word.clone().into()),
        Value::Null | Value::Array(_) | Value::Object(_) => Cell::Missing,
    }
}

/// List element by index (negative: from the end), or vector component by its letter.
fn element<'v>(list: &'v [Value], step: &str) -> Option<&'v Value> {
    let axis = || ["x", "y", "z"].iter().position(|axis| *axis == step);
    if let (true, Some(k)) = (list.len() <= 3, axis()) {
        return list.get(k).filter(|component| component.is_number());
    }
    let i = step.parse::<i64>().ok()?;
    let from_start = if i < 0 { list.len() as i64 + i } else { i };
    list.get(usize::try_from(from_start).ok()?)
}

/// Hash of seed, point and field to [0, 1): two rounds of splitmix64's finaliser, a stream without state.
pub(in crate::study) fn chance(seed: u64, point: u64, field: u64) -> f64 {
    let mixed = |x: u64| {
        let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let x = mixed(mixed(mixed(seed) ^ point) ^ field);
    (x >> 11) as f64 / (1u64 << 53) as f64
}
