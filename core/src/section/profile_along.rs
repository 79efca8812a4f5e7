//! Scalar profiles along a rod: constant, or functions of the arclength.

use crate::error::{Error, Result, check_positive};
use crate::math::piecewise::Piecewise;

/// A number as a function of the arclength s of the unloaded rod, 0 <= s <= L.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(transparent))]
pub struct Along(ProfileForm);

#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(untagged))]
enum ProfileForm {
    Constant(f64),
    /// Linear between the nodes, s in growing order; a repeated place is a jump.
    Table {
        s: Vec<f64>,
        values: Vec<f64>,
    },
    /// Coefficients of 1, x, x^2, ..., x = s/L.
    Polynomial {
        polynomial: Vec<f64>,
    },
    /// Polynomials between neighbouring places s, in powers of the part of the piece before a place.
    Pieces {
        s: Vec<f64>,
        pieces: Vec<Vec<f64>>,
    },
}

/// Largest distance of s beyond the ends of a table, relative to its length: rounding.
const BEYOND: f64 = 1e-12;

impl From<f64> for Along {
    fn from(value: f64) -> Self {
        Self(ProfileForm::Constant(value))
    }
}

impl Along {
    /// Linear between the nodes (s, value). A repeated place is a jump; at the jump itself the second value holds.
    /// The interior nodes are breaks ([`SectionLaw::breaks`](super::SectionLaw::breaks)). The table must cover the
    /// rod.
    ///
    /// # Errors
    /// Fewer than two nodes, numbers that are not finite, places out of order or given more than twice.
    pub fn table(nodes: &[(f64, f64)]) -> Result<Self> {
        if nodes.len() < 2 {
            return Err(Error::domain(format!(
                "a table along the rod has {} nodes (s, value), it needs at least 2",
                nodes.len()
            )));
        }
        for (k, (s, value)) in nodes.iter().enumerate() {
            if !(s.is_finite() && value.is_finite()) {
                return Err(Error::domain(format!(
                    "table node {k} = ({s}, {value}) must be finite"
                )));
            }
        }
        for (k, pair) in nodes.windows(2).enumerate() {
            if !(pair[0].0 <= pair[1].0) {
                return Err(Error::domain(format!(
                    "table nodes must be in growing order of s: s = {} stands before s = {} (nodes {k} and {})",
                    pair[0].0,
                    pair[1].0,
                    k + 1
                )));
            }
        }
        let last = nodes.len() - 1;
        let crowd = nodes.windows(3).find(|three| three[0].0 == three[2].0);
        let ends = [&nodes[..2], &nodes[last - 1..]];
        let crowd = crowd.or(ends.into_iter().find(|two| two[0].0 == two[1].0));
        if let Some(crowd) = crowd {
            return Err(Error::domain(format!(
                "s = {} stands too often in the table: twice is a jump, and only inside",
                crowd[0].0
            )));
        }
        let (s, values) = nodes.iter().copied().unzip();
        Ok(Self(ProfileForm::Table { s, values }))
    }

    /// c0 + c1 x + c2 x^2 + ..., x = s/L.
    ///
    /// # Errors
    /// No coefficients, or one that is not finite.
    pub fn polynomial(coefficients: &[f64]) -> Result<Self> {
        if coefficients.is_empty() || !coefficients.iter().all(|c| c.is_finite()) {
            return Err(Error::domain(format!(
                "the coefficients {coefficients:?} of a polynomial along the rod must be finite, at least one"
            )));
        }
        let polynomial = coefficients.to_vec();
        Ok(Self(ProfileForm::Polynomial { polynomial }))
    }

    /// A polynomial between each two neighbours of the growing places `s`, which cover the rod. Coefficients are those
    /// of 1, y, y^2, ..., where y goes from 0 to 1 between the two places. The inner places are breaks.
    ///
    /// # Errors
    /// Another number of polynomials than of intervals; numbers that are not finite; places out of order.
    pub fn pieces_between(s: &[f64], pieces: Vec<Vec<f64>>) -> Result<Self> {
        let rising = s.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = s
            .iter()
            .chain(pieces.iter().flatten())
            .all(|x| x.is_finite());
        if !(rising && finite && !pieces.is_empty() && s.len() == pieces.len() + 1) {
            return Err(Error::domain(format!(
                "{} polynomials along the rod need {} finite places in growing order, and finite coefficients",
                pieces.len(),
                pieces.len() + 1
            )));
        }
        let s = s.to_vec();
        Ok(Self(ProfileForm::Pieces { s, pieces }))
    }

    /// The value at s, of a rod of this length.
    ///
    /// # Errors
    /// s outside a table.
    pub fn at(&self, s: f64, length: f64) -> Result<f64> {
        match &self.0 {
            ProfileForm::Constant(value) => Ok(*value),
            ProfileForm::Polynomial { polynomial } => {
                let x = s / length;
                Ok(polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c))
            }
            ProfileForm::Table { s: nodes, values } => {
                let last = nodes.len() - 1;
                let (from, to) = (nodes[0], nodes[last]);
                let slack = BEYOND * (to - from);
                if !(from - slack <= s && s <= to + slack) {
                    return Err(Error::domain(format!(
                        "s = {s} lies outside the table, which goes from s = {from} to s = {to}"
                    )));
                }
                let right = nodes.partition_point(|node| *node <= s).clamp(1, last);
                let (a, b) = (nodes[right - 1], nodes[right]);
                let t = ((s - a) / (b - a)).clamp(0.0, 1.0);
                Ok(values[right - 1] * (1.0 - t) + values[right] * t)
            }
            ProfileForm::Pieces { s: ends, pieces } => {
                let right = ends.partition_point(|end| *end <= s);
                let right = right.clamp(1, pieces.len());
                let (a, b) = (ends[right - 1], ends[right]);
                let y = ((s - a) / (b - a)).clamp(0.0, 1.0);
                let coefficients = pieces[right - 1].iter().rev();
                Ok(coefficients.fold(0.0, |sum, c| sum * y + c))
            }
        }
    }

    /// This profile times a number.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        match &mut self.0 {
            ProfileForm::Constant(value) => *value *= factor,
            ProfileForm::Table { values: all, .. }
            | ProfileForm::Polynomial { polynomial: all } => {
                all.iter_mut().for_each(|value| *value *= factor);
            }
            ProfileForm::Pieces { pieces, .. } => {
                let all = pieces.iter_mut().flatten();
                all.for_each(|value| *value *= factor);
            }
        }
        self
    }

    /// This profile on a rod that is longer by a factor: the value at s moves to s times the factor.
    #[must_use]
    pub fn stretched(mut self, factor: f64) -> Self {
        if let ProfileForm::Table { s, .. } | ProfileForm::Pieces { s, .. } = &mut self.0 {
            s.iter_mut().for_each(|place| *place *= factor);
        }
        self
    }

    /// Polynomials in x = s/L, piece by piece, of a rod of length L. A table must cover the rod.
    pub fn pieces(&self, length: f64) -> Piecewise {
        Piecewise::new(match &self.0 {
            ProfileForm::Constant(value) => vec![(0.0, vec![*value])],
            ProfileForm::Polynomial { polynomial } => vec![(0.0, polynomial.clone())],
            ProfileForm::Table { s, values } => {
                let steps = s.windows(2).zip(values.windows(2));
                let steps = steps.filter(|(s, _)| s[0] < s[1]);
                let piece = |(s, values): (&[f64], &[f64])| {
                    let slope = (values[1] - values[0]) / (s[1] - s[0]) * length;
                    (s[0] / length, vec![values[0], slope])
                };
                steps.map(piece).collect()
            }
            ProfileForm::Pieces { s, pieces } => {
                let each = s.windows(2).zip(pieces);
                let piece = |(s, coefficients): (&[f64], &Vec<f64>)| {
                    let over = length / (s[1] - s[0]);
                    let powers = coefficients.iter().enumerate();
                    let powers = powers.map(|(k, c)| c * over.powi(k as i32));
                    (s[0] / length, powers.collect())
                };
                each.map(piece).collect()
            }
        })
    }

    /// The value, if constant along the rod.
    pub fn constant(&self) -> Option<f64> {
        match self.0 {
            ProfileForm::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// The value, to be changed, if constant along the rod.
    pub fn constant_mut(&mut self) -> Option<&mut f64> {
        match &mut self.0 {
            ProfileForm::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// The arclengths of a table, or of the ends of polynomials, in growing order; empty for other forms.
    pub fn nodes(&self) -> &[f64] {
        match &self.0 {
            ProfileForm::Table { s, .. } | ProfileForm::Pieces { s, .. } => s,
            _ => &[],
        }
    }

    /// Interior nodes, where the profile is not smooth.
    pub(super) fn breaks(&self) -> &[f64] {
        match self.nodes() {
            [_, inside @ .., _] => inside,
            _ => &[],
        }
    }

    /// True if zero for all s.
    pub fn vanishes(&self) -> bool {
        match &self.0 {
            ProfileForm::Constant(value) => *value == 0.0,
            ProfileForm::Table { values: all, .. }
            | ProfileForm::Polynomial { polynomial: all } => all.iter().all(|value| *value == 0.0),
            ProfileForm::Pieces { pieces, .. } => {
                pieces.iter().flatten().all(|value| *value == 0.0)
            }
        }
    }

    /// Error unless positive, as far as known beforehand: linear pieces are positive if their nodes are.
    pub(super) fn check_positive(&self, name: &str) -> Result<()> {
        match &self.0 {
            ProfileForm::Constant(value) => check_positive(name, *value),
            ProfileForm::Table { s, values } => s
                .iter()
                .zip(values)
                .try_for_each(|(s, value)| check_positive(&format!("{name} at s = {s}"), *value)),
            ProfileForm::Polynomial { .. } | ProfileForm::Pieces { .. } => Ok(()),
        }
    }
}
