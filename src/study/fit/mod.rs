//! Least-squares fit of fields of a scene to measured data.
//!
//! Data with a column `t` are compared with the trajectory of one run at these times. Otherwise each row is a scene
//! of its own: columns that are `given` are set in it. The other columns are quantities of the result, named as in a
//! sweep (`end.x`, `events.-1.t`), or of the small motions with prefix `modes.` (`modes.angular_frequencies.0`).

mod confidence;
mod data;
mod least;
mod noise;
mod record;
mod slopes;

pub use data::Data;
pub use record::{FitColumn, FitRecord, Parameter};

use super::sweep::{Vary, cell, chance, is_extreme, outcome, quantity};
use super::{Cell, Column, Hooks, Quiet, Table, Values, dispatch, modes};
use crate::error::{Error, Result};
use crate::scene::Scene;
use least::{LocalMinimum, Model, is_certain, is_seen};
use nalgebra::{DMatrix, DVector};
use noise::{LinearisedColumn, unweighed};

/// Name of the time column of the data.
const TIME: &str = "t";
/// Prefix of the names of quantities of small motions.
const MODES: &str = "modes.";
/// Largest number of rounds in which the noise of several columns is estimated from the residuals.
const ROUNDS: usize = 8;
/// Relative change of the noise estimates that ends the rounds.
const SETTLED: f64 = 1e-2;
/// Smallest noise of a column, relative to its spread: noise-free data must not lead to division by 0.
const NOISE: f64 = 1e-9;
/// Number of intervals of the drawn model curve over time.
const FINE: usize = 400;
/// Two searches have the same end if their sums of squares differ by less than this, relatively, or by the effect of
/// the least noise.
const ALIKE: f64 = 1e-3;
/// Distance from an end of the range, as a fraction of the range, below which a value counts as on its bound.
const WALL: f64 = 1e-6;

/// A requested fit.
#[derive(Debug, Clone)]
pub struct Fit {
    scene: String,
    set: Vec<String>,
    free: Vec<Vary>,
    data: Data,
    /// Columns set in the scene, with their fields.
    given: Vec<(usize, String)>,
    /// Columns compared with the model.
    compared: Vec<ComparedColumn>,
    /// Index of the time column.
    time: Option<usize>,
    /// Row numbers in the original data, from 1.
    numbers: Vec<usize>,
}

/// A data column compared with the model.
#[derive(Debug, Clone)]
struct ComparedColumn {
    place: usize,
    /// Standard deviation of the noise, where known.
    noise: Option<f64>,
    /// Standard deviation of the values.
    spread: f64,
}

/// End of a search from one start.
#[derive(Debug, Clone)]
pub struct SearchEnd {
    least: LocalMinimum,
    noise: Vec<f64>,
    evaluations: usize,
}

impl Fit {
    /// A fit of the fields `free` to `data`, for a scene given as text with the overrides `set`. `given`: names of
    /// columns that are fields of the scene, as `loads.force.0`; `noise`: standard deviations of columns, as (`x`,
    /// 1e-3).
    ///
    /// # Errors
    /// No free field, or a repeated one; data without a named column, without a column to compare, or with fewer
    /// numbers than free fields; a noise that is not positive, or of a column not compared; given columns beside `t`,
    /// or that are free; a time below 0, or any time of a bar; a column of unknown noise with a single number, beside
    /// other columns.
    pub fn new(
        scene: String,
        set: Vec<String>,
        free: Vec<Vary>,
        mut data: Data,
        given: &[String],
        noise: &[(String, f64)],
    ) -> Result<Self> {
        let refuse = |why: String| Err(Error::domain(why));
        if free.is_empty() {
            return refuse("a fit has something free: give --free PATH=FROM:TO".to_owned());
        }
        for (i, one) in free.iter().enumerate() {
            if free[..i].iter().any(|other| other.is_of(&one.path)) {
                return refuse(format!("--free: {} is free twice", one.path));
            }
            if one.number(0.5).is_none() {
                return refuse(format!("--free: {} needs a range FROM:TO", one.path));
            }
        }
        let known = data.names.join(", ");
        let place = |option: &str, name: &str| {
            data.place(name).ok_or_else(|| {
                Error::domain(format!(
                    "{option} {name}: the data have no such column; they have {known}"
                ))
            })
        };
        let time = data.place(TIME);
        if let (Some(_), Some(name)) = (time, given.first()) {
            return refuse(format!(
                "--given {name}: data over time t are of one run, in which nothing is set row by row; leave out the column t, or --given"
            ));
        }
        let given: Result<Vec<(usize, String)>> = given
            .iter()
            .map(|name| Ok((place("--given", name)?, name.trim().to_owned())))
            .collect();
        let given = given?;
        if let Some((_, path)) = given
            .iter()
            .find(|(_, path)| free.iter().any(|one| one.is_of(path)))
        {
            return refuse(format!(
                "--given {path}: the field is free, too: it is either set row by row or searched; leave out --given or --free"
            ));
        }
        let mut known_noise = vec![None; data.names.len()];
        for (name, sigma) in noise {
            if !(*sigma > 0.0 && sigma.is_finite()) {
                return refuse(format!(
                    "--noise {name}={sigma}: a standard deviation is > 0"
                ));
            }
            let i = place("--noise", name)?;
            if Some(i) == time || given.iter().any(|(j, _)| *j == i) {
                return refuse(format!(
                    "--noise {name}={sigma}: the column is not compared but taken as exact, as times and columns that are given are; leave it out"
                ));
            }
            known_noise[i] = Some(*sigma);
        }
        let others =
            (0..data.names.len()).filter(|i| Some(*i) != time && given.iter().all(|(j, _)| j != i));
        let (mut compared, mut numbers) = (Vec::new(), Vec::new());
        for i in others {
            let values: Vec<f64> = data.column(i).filter(|x| x.is_finite()).collect();
            if values.is_empty() {
                return refuse(format!(
                    "column {} of the data has no number",
                    data.names[i]
                ));
            }
            numbers.push((i, values.len()));
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let spread = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
            // The spread of a constant column is replaced by the size of its number.
            let spread = match spread.sqrt() {
                spread if spread > 1e-12 * mean.abs() => spread,
                _ if mean != 0.0 => mean.abs(),
                _ => 1.0,
            };
            compared.push(ComparedColumn {
                place: i,
                noise: known_noise[i],
                spread,
            });
        }
        if compared.is_empty() {
            return refuse(format!(
                "the data have nothing to compare: their columns are {known}"
            ));
        }
        let alone = |(i, count): &&(usize, usize)| *count == 1 && known_noise[*i].is_none();
        if let Some((i, count)) = numbers.iter().find(alone)
            && numbers.len() > 1
        {
            return Err(unweighed(&data.names[*i], *count));
        }
        let needed = time.into_iter().chain(given.iter().map(|(i, _)| *i));
        for i in needed {
            if let Some(row) = data.column(i).position(|x| x.is_nan()) {
                return refuse(format!(
                    "row {} of the data has no {}, which every row needs",
                    row + 1,
                    data.names[i]
                ));
            }
        }
        let mut rows: Vec<usize> = (1..=data.rows.len()).collect();
        if let Some(time) = time {
            let measured = |row: &Vec<f64>| numbers.iter().any(|(i, _)| !row[*i].is_nan());
            let early = |row: &Vec<f64>| row[time] < 0.0 && measured(row);
            if let Some(row) = data.rows.iter().position(early) {
                return refuse(format!(
                    "row {} of the data, {TIME} = {}: times are >= 0, counted from the start of the motion; shift them, or leave out what was measured before",
                    row + 1,
                    data.rows[row][time]
                ));
            }
            // Times without measurements need not be reached.
            rows.retain(|number| measured(&data.rows[number - 1]));
            data.rows.retain(measured);
        }
        let fit = Self {
            scene,
            set,
            free,
            data,
            given,
            compared,
            time,
            numbers: rows,
        };
        if fit.time.is_some()
            && let Ok(scene) = fit.scene(&fit.values(&fit.start(0, 0)))
            && scene.is_medium()
        {
            return refuse(format!(
                "column {TIME} of the data: a bar, a flow or a membrane is not followed to times of data; name the column run.duration, set it row by row with --given \
                 run.duration, and compare quantities of its end such as end.tip.x"
            ));
        }
        match fit.points() {
            points if points < fit.free.len() => refuse(format!(
                "{points} numbers are measured and {} fields are free: there are more unknowns than numbers",
                fit.free.len()
            )),
            _ => Ok(fit),
        }
    }

    /// Number of compared values.
    pub fn points(&self) -> usize {
        self.compared.iter().map(|one| self.count(one)).sum()
    }

    /// The free fields with their ranges.
    pub fn free(&self) -> &[Vary] {
        &self.free
    }

    /// Start of search `k` as fractions of the ranges: the middle for k = 0, otherwise random.
    pub fn start(&self, k: usize, seed: u64) -> Vec<f64> {
        let all = 0..self.free.len();
        match k {
            0 => vec![0.5; self.free.len()],
            _ => all.map(|i| chance(seed, k as u64, i as u64)).collect(),
        }
    }

    /// Searches from a start; `None` if the scene cannot run there.
    ///
    /// # Errors
    /// An interrupt; columns of the data missing in the results.
    pub fn search(&self, start: &[f64], hooks: &mut dyn Hooks) -> Result<Option<SearchEnd>> {
        let noise = self.compared.iter();
        let noise = noise.map(|one| one.noise.unwrap_or(one.spread)).collect();
        self.descend(start, noise, hooks)
    }

    fn descend(
        &self,
        start: &[f64],
        noise: Vec<f64>,
        hooks: &mut dyn Hooks,
    ) -> Result<Option<SearchEnd>> {
        let mut model = FitModel {
            fit: self,
            noise: &noise,
            hooks,
            has_slopes: true,
            evaluations: 0,
        };
        let least = LocalMinimum::from(start, &mut model)?;
        let evaluations = model.evaluations;
        Ok(least.map(|least| SearchEnd {
            least,
            noise,
            evaluations,
        }))
    }

    /// The best end of the searches. If the noise of several columns is unknown, each is weighted by its residuals,
    /// and the search is continued.
    ///
    /// # Errors
    /// No search with a result (the message says why the scene cannot run in the middle of the ranges); a column
    /// whose noise cannot be estimated; an interrupt.
    pub fn best(
        &self,
        found: Vec<SearchEnd>,
        starts: usize,
        hooks: &mut dyn Hooks,
    ) -> Result<FitRecord> {
        let mut evaluations: usize = found.iter().map(|one| one.evaluations).sum();
        let square = |one: &SearchEnd| one.least.square();
        let best = found.iter().min_by(|a, b| square(a).total_cmp(&square(b)));
        let Some(mut best) = best.cloned() else {
            let why = match self.model(&self.start(0, 0), hooks) {
                Err(ModelFault::Fatal(error)) => return Err(error),
                Err(ModelFault::NoRun(why)) => why,
                Ok(_) => "elsewhere it can".to_owned(),
            };
            return Err(Error::domain(format!(
                "from no start of the search the scene can be run; in the middle of the ranges: {why}"
            )));
        };
        let each = self.compared.iter().zip(&best.noise);
        let rounding: f64 = each
            .map(|(one, sigma)| self.count(one) as f64 * (NOISE * one.spread / sigma).powi(2))
            .sum();
        let agreeing = found
            .iter()
            .filter(|one| square(one) <= square(&best) * (1.0 + ALIKE) + rounding)
            .count();
        let unknown = self.compared.iter().filter(|one| one.noise.is_none());
        if unknown.count() > 0 && self.compared.len() > 1 {
            for _ in 0..ROUNDS {
                let noise = noise::noise(&self.linear(&best), best.noise.clone());
                let mut changes = noise.iter().zip(&best.noise);
                if changes.all(|(new, old)| (new / old - 1.0).abs() < SETTLED) {
                    break;
                }
                let start = best.least.at.clone();
                if let Some(better) = self.descend(&start, noise, hooks)? {
                    evaluations += better.evaluations;
                    best = better;
                }
            }
        }
        let model = match self.model(&best.least.at, hooks) {
            Ok(model) => model,
            Err(ModelFault::Fatal(error)) => return Err(error),
            Err(ModelFault::NoRun(why)) => return Err(Error::domain(why)),
        };
        let between = self.between(&best.least.at, hooks);
        let effort = [starts, agreeing, evaluations + 2];
        self.record(&best, model, between.as_ref(), effort)
    }

    /// Number of measured values in a column.
    fn count(&self, one: &ComparedColumn) -> usize {
        let column = self.data.column(one.place);
        column.filter(|x| !x.is_nan()).count()
    }

    /// The fields that move freely at an end of a search. Values at an end of their range are fixed, and so are those
    /// without an effect above the errors of the differences.
    fn moving(&self, least: &LocalMinimum) -> Vec<usize> {
        let inside = |part: f64| (WALL..=1.0 - WALL).contains(&part);
        let (seen, certain) = (is_seen(&least.slopes), is_certain(least));
        let all = 0..self.free.len();
        all.filter(|&i| seen[i] && certain[i] && inside(least.at[i]))
            .collect()
    }

    /// Linearised columns at an end of a search, with the fields that move freely.
    fn linear(&self, found: &SearchEnd) -> Vec<LinearisedColumn> {
        let least = &found.least;
        let moving = self.moving(least);
        let both = [&least.slopes, &least.doubts].map(|of| of.select_columns(&moving));
        let mut from = 0;
        let each = self.compared.iter().zip(&found.noise);
        each.map(|(one, sigma)| {
            let count = self.count(one);
            let both = both.each_ref().map(|of| of.rows(from, count) * *sigma);
            let left = least.residuals.rows(from, count) * *sigma;
            from += count;
            LinearisedColumn::new(both, left, one.noise, NOISE * one.spread)
        })
        .collect()
    }

    /// (model - data)/noise of all measured values, column by column.
    fn residuals(&self, model: &[Vec<f64>], noise: &[f64]) -> DVector<f64> {
        let mut all = Vec::with_capacity(self.points());
        for ((one, values), sigma) in self.compared.iter().zip(model).zip(noise) {
            let pairs = self.data.column(one.place).zip(values);
            all.extend(
                pairs
                    .filter(|(x, _)| !x.is_nan())
                    .map(|(x, m)| (m - x) / sigma),
            );
        }
        DVector::from_vec(all)
    }

    /// Model values of every compared column, row by row.
    fn model(
        &self,
        at: &[f64],
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Vec<Vec<f64>>, ModelFault> {
        if hooks.interrupted() {
            return Err(ModelFault::interrupted());
        }
        let free = self.values(at);
        let Some(time) = self.time else {
            return self.by_rows(&free, hooks);
        };
        let times: Vec<f64> = self.data.column(time).collect();
        let table = self.trajectory(&free, &times, hooks)?;
        let columns = self.over_time(&table).map_err(ModelFault::Fatal)?;
        let columns: Vec<Vec<f64>> = columns.into_iter().map(|(_, x)| x.to_vec()).collect();
        self.is_told(&columns)?;
        Ok(columns)
    }

    /// Error if the trajectory has no number at a measured value.
    fn is_told(&self, columns: &[Vec<f64>]) -> std::result::Result<(), ModelFault> {
        let Some(time) = self.time else {
            return Ok(());
        };
        for (k, (row, number)) in self.data.rows.iter().zip(&self.numbers).enumerate() {
            let missing = |(one, column): &(&ComparedColumn, &Vec<f64>)| {
                !row[one.place].is_nan() && !column[k].is_finite()
            };
            if let Some((one, _)) = self.compared.iter().zip(columns).find(missing) {
                let name = &self.data.names[one.place];
                return Err(ModelFault::NoRun(format!(
                    "row {number} of the data, {TIME} = {}: the trajectory has no number {name} then, as lam of a rod with friction or mass where it is near \
                     no equilibrium; leave the cell empty, or the column out",
                    row[time]
                )));
            }
        }
        Ok(())
    }

    /// Overrides that set the free fields at a point of the box.
    fn values(&self, at: &[f64]) -> Vec<String> {
        let each = self.free.iter().zip(at);
        each.map(|(one, part)| format!("{}={}", one.path, one.at(*part)))
            .collect()
    }

    /// Model between the measurements, for a figure: over time the fitted trajectory at FINE times and at the times
    /// of the data.
    fn between(&self, at: &[f64], hooks: &mut dyn Hooks) -> Option<Table> {
        let measured = self.data.column(self.time?);
        let (low, high) = measured
            .clone()
            .fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)));
        let evenly = (0..=FINE).map(|k| low + (high - low) * k as f64 / FINE as f64);
        let mut times: Vec<f64> = evenly.chain(measured).map(|t| t.clamp(low, high)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        self.trajectory(&self.values(at), &times, hooks).ok()
    }

    fn scene(&self, free: &[String]) -> std::result::Result<Scene, ModelFault> {
        let all: Vec<&str> = self.set.iter().chain(free).map(String::as_str).collect();
        Scene::parse_with(&self.scene, &all).map_err(|faults| ModelFault::NoRun(faults.to_string()))
    }

    /// Trajectory at these times.
    fn trajectory(
        &self,
        free: &[String],
        times: &[f64],
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Table, ModelFault> {
        let mut scene = self.scene(free)?;
        if let Some(run) = &mut scene.run {
            let last = times.iter().copied().fold(0.0, f64::max);
            run.duration = last.max(f64::MIN_POSITIVE);
        }
        let table = dispatch::samples(&scene, times, &mut Quiet(hooks));
        if hooks.interrupted() {
            return Err(ModelFault::interrupted());
        }
        table.map_err(|e| ModelFault::NoRun(e.to_string()))
    }

    /// Compared columns of a trajectory.
    fn over_time<'t>(&self, table: &'t Table) -> Result<Vec<(&'t str, &'t [f64])>> {
        let each = self.compared.iter().map(|one| {
            let name = &self.data.names[one.place];
            let column = table.columns.iter().find(|column| column.name == *name);
            if let Some(Column {
                unit,
                values: Values::Reals(values),
                ..
            }) = column
            {
                return Ok((&**unit, values.as_slice()));
            }
            let numbers = table.columns.iter();
            let numbers = numbers.filter(|c| matches!(c.values, Values::Reals(_)));
            let names: Vec<&str> = numbers.map(|c| &*c.name).collect();
            Err(Error::domain(format!(
                "column {name} of the data: the trajectory has no such numbers; it has {}; leave the column out, or give it that name",
                names.join(", ")
            )))
        });
        each.collect()
    }

    /// Overrides that set the given columns, row by row.
    fn settings(&self) -> Vec<Vec<String>> {
        let rows = self.data.rows.iter().map(|row| {
            let given = self.given.iter();
            given
                .map(|(i, path)| format!("{path}={:e}", row[*i]))
                .collect()
        });
        rows.collect()
    }

    /// True for each compared column that is measured in a row with the settings `set`.
    fn asked(&self, settings: &[Vec<String>], set: &[String]) -> Vec<bool> {
        let rows = || self.data.rows.iter().zip(settings);
        (self.compared.iter())
            .map(|one| rows().any(|(row, own)| own == set && !row[one.place].is_nan()))
            .collect()
    }

    fn by_rows(
        &self,
        free: &[String],
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Vec<Vec<f64>>, ModelFault> {
        let mut model = vec![Vec::with_capacity(self.data.rows.len()); self.compared.len()];
        let settings = self.settings();
        // Rows with the same settings, such as repeated measurements, are one scene.
        let mut made: Vec<(&[String], Vec<f64>)> = Vec::new();
        for set in &settings {
            let values = match made.iter().find(|(own, _)| own == set) {
                Some((_, values)) => values.clone(),
                None => {
                    let asked = self.asked(&settings, set);
                    let scene = self.scene(&[free, set].concat())?;
                    let values = self.quantities(&scene, &asked, hooks)?;
                    made.push((set, values.clone()));
                    values
                }
            };
            for (column, x) in model.iter_mut().zip(values) {
                column.push(x);
            }
        }
        Ok(model)
    }

    /// The quantities of a scene named by the data. Requested ones (`asked`) must exist. Unmeasured ones are included
    /// if the scene has them.
    fn quantities(
        &self,
        scene: &Scene,
        asked: &[bool],
        hooks: &mut dyn Hooks,
    ) -> std::result::Result<Vec<f64>, ModelFault> {
        let names = || {
            let each = self.compared.iter().zip(asked);
            each.map(|(one, asked)| (self.data.names[one.place].as_str(), *asked))
        };
        let no_run = |e: Error| ModelFault::NoRun(e.to_string());
        let small = if names().any(|(name, asked)| asked && name.starts_with(MODES)) {
            Some(modes(scene).map_err(no_run)?.summary())
        } else {
            None
        };
        let extremes = names().any(|(name, asked)| asked && is_extreme(name));
        let summary = if names().any(|(name, asked)| asked && !name.starts_with(MODES)) {
            Some(outcome(scene.clone(), extremes, &mut Quiet(hooks)).map_err(no_run)?)
        } else {
            None
        };
        if hooks.interrupted() {
            return Err(ModelFault::interrupted());
        }
        let each = names().map(|(name, asked)| {
            let found = match name.strip_prefix(MODES) {
                Some(path) => small.as_ref().map(|small| cell(small, path)),
                None => match summary.as_ref().map(|summary| quantity(summary, name)) {
                    Some(Err(absence)) if asked => return Err(ModelFault::NoRun(absence)),
                    found => found.and_then(Result::ok),
                },
            };
            match found {
                Some(Cell::Real(x)) if x.is_finite() => Ok(x),
                Some(Cell::Integer(n)) => Ok(n as f64),
                _ if !asked => Ok(f64::NAN),
                // An early end of the run removes events present in other runs.
                _ => Err(ModelFault::NoRun(format!(
                    "what comes of the scene has no number {name}; names are those of summary.json, `events.` of events.json and `modes.` of \
                     `snaprod modes --json`; a column that is a field of the scene is named by --given"
                ))),
            }
        });
        each.collect()
    }
}

/// The model of a fit with the noise of its columns.
struct FitModel<'f> {
    fit: &'f Fit,
    noise: &'f [f64],
    hooks: &'f mut dyn Hooks,
    /// False once the scene has turned out to have no derivatives of its own.
    has_slopes: bool,
    evaluations: usize,
}

impl Model for FitModel<'_> {
    fn residuals(&mut self, at: &[f64]) -> Result<Option<DVector<f64>>> {
        self.evaluations += 1;
        match self.fit.model(at, self.hooks) {
            Ok(model) => Ok(Some(self.fit.residuals(&model, self.noise))),
            Err(ModelFault::Fatal(error)) => Err(error),
            Err(ModelFault::NoRun(_)) => Ok(None),
        }
    }

    fn slopes(&mut self, at: &[f64]) -> Result<Option<[DMatrix<f64>; 2]>> {
        if !self.has_slopes {
            return Ok(None);
        }
        let found = match self.fit.time {
            Some(time) => slopes::over_time(self.fit, time, at, self.noise),
            None => slopes::of_rows(self.fit, at, self.noise, self.hooks),
        };
        if self.hooks.interrupted() {
            return Err(Error::domain("the fit was interrupted"));
        }
        self.has_slopes = found.is_some();
        self.evaluations += usize::from(self.has_slopes);
        Ok(found)
    }
}

/// Reason for a missing model at a point.
enum ModelFault {
    /// The search tries another point.
    NoRun(String),
    /// The search ends.
    Fatal(Error),
}

impl ModelFault {
    fn interrupted() -> Self {
        Self::Fatal(Error::domain("the fit was interrupted"))
    }
}
