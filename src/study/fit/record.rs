//! Record of a fit.

use super::least::{is_certain, is_seen};
use super::noise::{self, Undetermined, unweighed};
use super::{Fit, SearchEnd, TIME};
use crate::error::Result;
use crate::study::fit::confidence::quantile;
use crate::study::{Cell, Column, Table, Values};
use serde_json::{Value, json};

/// Probability of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A fitted field.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Path of the field in the scene.
    pub path: String,
    /// Best value.
    pub value: f64,
    /// Standard error of the value, to first order. `None` if the data do not determine it, at an end of the range,
    /// or with as many free fields as numbers. With noise estimated for several columns it includes the uncertainty
    /// of the weights.
    pub standard_error: Option<f64>,
    /// Interval that holds the true value with a probability of 95 %, for a correct model, nearly linear over the
    /// interval, and normal noise.
    pub interval: Option<[f64; 2]>,
    /// True if the value lies at an end of its range: a better one may lie outside.
    pub at_bound: bool,
}

/// A compared data column.
#[derive(Debug, Clone, PartialEq)]
pub struct FitColumn {
    /// Name of the column.
    pub name: String,
    /// Model values, row by row.
    pub model: Vec<f64>,
    /// Measured values; NaN where missing.
    pub data: Vec<f64>,
    /// Unit of the values, where known.
    pub unit: String,
    /// The model at the places of [`FitRecord::between`].
    pub curve: Vec<f64>,
    /// Root mean square of model - data.
    pub rms: f64,
    /// Standard deviation of the noise: given, or estimated from the residuals and their degrees of freedom.
    pub noise: f64,
    /// True if the noise was given.
    pub known: bool,
}

/// Record of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRecord {
    /// The fitted fields.
    pub parameters: Vec<Parameter>,
    /// Correlations of the errors; 0 without a standard error.
    pub correlations: Vec<Vec<f64>>,
    /// The compared columns.
    pub columns: Vec<FitColumn>,
    /// Abscissa of the rows: `t`, the first given column, or the row number.
    pub along: Column,
    /// Abscissae of the model curve: dense over time; empty otherwise.
    pub between: Vec<f64>,
    /// Sum of (model - data)^2/noise^2 if the noise of every column was given; near `freedom` if model and noise are
    /// right.
    pub chi_squared: Option<f64>,
    /// Number of compared values less free fields.
    pub freedom: usize,
    /// Numbers of searches, of searches that ended here, and of runs of the scene (or of all its rows).
    pub effort: [usize; 3],
    /// Remarks.
    pub remarks: Vec<String>,
}

impl Fit {
    /// Record of an end of the search with these `model` values.
    pub(super) fn record(
        &self,
        found: &SearchEnd,
        model: Vec<Vec<f64>>,
        between: Option<&Table>,
        effort: [usize; 3],
    ) -> Result<FitRecord> {
        let least = &found.least;
        let freedom = self.points() - self.free.len();
        let known = self.compared.iter().all(|one| one.noise.is_some());
        // Fixed values have no errors; the errors of the others are conditional on them.
        let moving = self.moving(least);
        let (seen, certain) = (is_seen(&least.slopes), is_certain(least));
        let linear = self.linear(found);
        let noise = noise::noise(&linear, found.noise.clone());
        let errors = match noise::errors(&linear, &noise) {
            Err(Undetermined::Noise(c)) if linear.len() > 1 => {
                let one = &self.compared[c];
                return Err(unweighed(&self.data.names[one.place], self.count(one)));
            }
            errors => errors,
        };
        let untold = errors.as_ref().err();
        let errors = errors.as_ref().ok();
        let covariance = errors.map(|errors| &errors.covariance);
        let place = |i: usize| moving.iter().position(|k| *k == i);
        let mut remarks = Vec::new();
        let mut parameters = Vec::new();
        for (i, (one, part)) in self.free.iter().zip(&least.at).enumerate() {
            let [value, by] = one.number(*part).unwrap_or([f64::NAN; 2]);
            let error = covariance.and_then(|c| place(i).map(|k| c[(k, k)].sqrt()));
            let freedom = errors.zip(place(i)).map(|(e, k)| e.freedom[k]);
            let width = freedom.map_or(f64::NAN, |freedom| quantile(CONFIDENCE, freedom));
            let at_bound = seen[i] && certain[i] && place(i).is_none();
            if !seen[i] {
                remarks.push(format!(
                    "the data do not determine {}: no measured value depends on it, so it keeps its start value; do not free it",
                    one.path
                ));
            }
            if seen[i] && !certain[i] {
                remarks.push(format!(
                    "the data do not determine {}: its effect on the model is below the error of the numerical derivative; do not free it, \
                     or give a narrower range, log: or a smaller run.tolerance",
                    one.path
                ));
            }
            if at_bound {
                remarks.push(format!(
                    "{} lies at an end of its range: a better value may lie outside; the errors of the other fields hold for this fixed value",
                    one.path
                ));
            }
            // Logarithmic fields: an interval symmetric in the logarithm is asymmetric in the value.
            let end = |side: f64| one.number(part + side * width * error?).map(|[x, _]| x);
            let interval = end(-1.0).zip(end(1.0)).map(|(low, high)| [low, high]);
            let is_finite = |ends: &[f64; 2]| ends.iter().all(|x| x.is_finite());
            if !interval.iter().all(is_finite) {
                remarks.push(format!(
                    "the data hardly determine {}: its confidence interval is not finite; do not free it",
                    one.path
                ));
            }
            parameters.push(Parameter {
                path: one.path.clone(),
                value,
                standard_error: error.map(|error| error * by.abs()),
                interval: interval.filter(is_finite),
                at_bound,
            });
        }
        remarks.extend(untold.map(|untold| match untold {
            Undetermined::Noise(_) => "there are as many free fields as measured values, so the noise cannot be estimated; give it by --noise".to_owned(),
            Undetermined::Fields(apart) => {
                let names: Vec<&str> = apart.iter().map(|k| self.free[moving[*k]].path.as_str()).collect();
                format!(
                    "the data do not separate the free fields {}: changing them together leaves the model unchanged; free fewer of them",
                    names.join(", ")
                )
            }
        }));
        if !least.settled {
            remarks.push(
                "the search reached its step limit before it converged: narrow the ranges"
                    .to_owned(),
            );
        }
        let [starts, agreeing, _] = effort;
        if starts > 1 && agreeing == 1 {
            remarks.push(format!(
                "only one of {starts} searches converged to this minimum: a better one may exist; raise --starts"
            ));
        }
        let count = self.free.len();
        let correlation = |i: usize, j: usize| {
            let (Some(c), Some(i), Some(j)) = (covariance, place(i), place(j)) else {
                return 0.0;
            };
            c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
        };
        let curves = match between {
            Some(table) => self.over_time(table)?,
            None => vec![("", [].as_slice()); self.compared.len()],
        };
        let columns = self.compared.iter().zip(model).zip(&noise).zip(curves);
        let columns = columns.map(|(((one, model), noise), (unit, curve))| {
            let data: Vec<f64> = self.data.column(one.place).collect();
            let pairs = data.iter().zip(&model).filter(|(x, _)| !x.is_nan());
            let squares: Vec<f64> = pairs.map(|(x, m)| (m - x).powi(2)).collect();
            FitColumn {
                name: self.data.names[one.place].clone(),
                rms: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
                noise: *noise,
                known: one.noise.is_some(),
                unit: unit.to_owned(),
                curve: curve.to_vec(),
                model,
                data,
            }
        });
        let along = match (self.time, self.given.first()) {
            (Some(i), _) => {
                let unit = between.and_then(|table| table.column(TIME));
                let unit = unit.map_or("".into(), |t| t.unit.clone());
                (i, Column::reals(TIME, unit, "time of the measurement"))
            }
            (None, Some((i, _))) => {
                let name = self.data.names[*i].clone();
                (*i, Column::reals(name, "", "as it was set"))
            }
            (None, None) => (
                usize::MAX,
                Column::reals("row", "", "number of the row, from 1"),
            ),
        };
        let places = match along.0 {
            usize::MAX => (1..=self.data.rows.len()).map(|k| k as f64).collect(),
            i => self.data.column(i).collect(),
        };
        let along = Column {
            values: Values::Reals(places),
            ..along.1
        };
        Ok(FitRecord {
            parameters,
            correlations: (0..count)
                .map(|i| (0..count).map(|j| correlation(i, j)).collect())
                .collect(),
            columns: columns.collect(),
            along,
            chi_squared: known.then(|| least.square()),
            freedom,
            between: between.map_or(Vec::new(), |table| table.reals(TIME).to_vec()),
            effort,
            remarks,
        })
    }
}

impl FitRecord {
    /// Content of fit.json.
    pub fn summary(&self) -> Value {
        let parameters = self.parameters.iter().map(|one| {
            json!({
                "path": one.path,
                "value": one.value,
                "standard_error": one.standard_error,
                "interval": one.interval,
                "at_bound": one.at_bound,
            })
        });
        let columns = self.columns.iter().map(|one| {
            json!({
                "name": one.name,
                "points": one.data.iter().filter(|x| !x.is_nan()).count(),
                "rms": one.rms,
                "noise": one.noise,
                "noise_known": one.known,
            })
        });
        let [starts, agreeing, runs] = self.effort;
        json!({
            "parameters": parameters.collect::<Vec<_>>(),
            "confidence": CONFIDENCE,
            "correlations": self.correlations,
            "columns": columns.collect::<Vec<_>>(),
            "chi_squared": self.chi_squared,
            "degrees_of_freedom": self.freedom,
            "starts": starts,
            "agreeing": agreeing,
            "runs": runs,
            "remarks": self.remarks,
        })
    }

    /// Model curve between the data, if any.
    pub fn curve(&self) -> Option<Table> {
        let reals = |list: &Vec<f64>| Values::Reals(list.clone());
        let along = Column {
            values: reals(&self.between),
            ..self.along.clone()
        };
        let each = self.columns.iter().map(|one| Column {
            values: reals(&one.curve),
            ..Column::reals(one.name.clone(), one.unit.clone(), "as the scene has it")
        });
        let columns = std::iter::once(along).chain(each).collect();
        (!self.between.is_empty()).then(|| Table::new("curve", columns))
    }

    /// Data, model and residuals, row by row.
    pub fn table(&self) -> Table {
        let mut columns = vec![Column {
            values: Values::Reals(Vec::new()),
            ..self.along.clone()
        }];
        for one in &self.columns {
            let name = |part: &str| format!("{}.{part}", one.name);
            columns.extend([
                Column::reals(name("data"), one.unit.clone(), "as it was measured"),
                Column::reals(name("model"), one.unit.clone(), "as the scene has it"),
                Column::reals(name("left"), one.unit.clone(), "data less model"),
            ]);
        }
        let mut table = Table::new("fit", columns);
        for k in 0..self.columns.first().map_or(0, |one| one.data.len()) {
            let numbers = self.columns.iter().flat_map(|one| {
                let (x, m) = (one.data[k], one.model[k]);
                [x, m, x - m]
            });
            let place = std::iter::once(self.along.cell(k));
            let cells: Vec<Cell> = place.chain(numbers.map(Cell::Real)).collect();
            // Tables in memory do not fail.
            let _ = table.push(&cells);
        }
        table
    }
}
