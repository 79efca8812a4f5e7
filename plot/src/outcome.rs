//! Outcomes of a sweep over two fields of a scene: a word or a number in each cell of a grid.

use super::axes::{Axis, Scale};
use super::cells::Cells;
use super::data::as_many;
use super::heat::{GAP, edges};
use super::legend::{ColourBar, Entry, Key};
use super::page::{Height, Page, PageBlock, Width};
use super::palette::{Colour, category, sequential};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};
use std::cmp::Ordering;

/// A varied field.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweptAxis {
    /// Name with unit.
    pub label: String,
    /// Values, rising or falling.
    pub values: Vec<f64>,
    /// True for a logarithmic axis.
    pub log: bool,
}

/// Outcomes of the points, `y.values.len()` for each value of x.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcomes {
    /// Words; empty for none. The seven most frequent have colours of their own.
    Words(Vec<String>),
    /// Numbers, NaN for none, with the name of their scale.
    Numbers(Vec<f64>, String),
}

/// A sweep over two fields.
#[derive(Debug, Clone, PartialEq)]
pub struct OutcomeMap {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The field drawn across.
    pub x: SweptAxis,
    /// The field drawn up.
    pub y: SweptAxis,
    /// Outcomes: the point `x.values[i]`, `y.values[j]` has the index `i * y.values.len() + j`.
    pub outcomes: Outcomes,
}

const FIGURE: &str = "outcome map";
/// Number of words with colours of their own; the others share the next.
pub(crate) const NAMED: usize = 7;

impl SweptAxis {
    /// The axis, and the edges of the cells as fractions of the axis.
    fn placed(&self, name: &str) -> Result<(Axis, Vec<f64>)> {
        let (Some(&first), Some(&last)) = (self.values.first(), self.values.last()) else {
            return Err(Error::domain(format!("{FIGURE}: {name} has no values")));
        };
        let (low, high) = (first.min(last), first.max(last));
        let rises = self
            .values
            .windows(2)
            .all(|p| (p[1] > p[0]) == (last > first) && p[1] != p[0]);
        if !(low < high && low.is_finite() && high.is_finite() && rises) {
            return Err(Error::domain(format!(
                "{FIGURE}: {name} must rise, or fall, over two finite values or more"
            )));
        }
        let scale = match self.log {
            true if !(low > 0.0) => {
                return Err(Error::domain(format!(
                    "{FIGURE}: {name} must be > 0 to be drawn by logarithms"
                )));
            }
            true => Scale::Log,
            false => Scale::Linear,
        };
        // Cells at the border extend as far beyond their values as the others do.
        let beyond = |at: f64, before: f64| {
            if self.log {
                at * (at / before).sqrt()
            } else {
                at + 0.5 * (at - before)
            }
        };
        let n = self.values.len();
        let ends = [
            beyond(first, self.values[1]),
            beyond(last, self.values[n - 2]),
        ];
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let axis = Axis::scaled(scale, low, high, &self.label, 6);
        let places: Vec<f64> = self.values.iter().map(|x| axis.place(*x)).collect();
        let edges = edges(&places, axis.place(ends[0]), axis.place(ends[1]));
        Ok((axis, edges))
    }
}

/// Draws the outcomes of a sweep as coloured cells, as SVG. Words have a legend, sorted by frequency (numbers
/// as words: rising), numbers have a scale.
///
/// Fails if an axis does not rise or fall, if there are not as many outcomes as points, or if all are empty.
pub fn outcome_map(data: &OutcomeMap, paper: &Paper) -> Result<String> {
    let (x, across) = data.x.placed("x")?;
    let (y, up) = data.y.placed("y")?;
    let points = data.x.values.len() * data.y.values.len();
    let none = || Error::domain(format!("{FIGURE}: no outcome to show"));
    let mut entries = Vec::new();
    let (cells, colours, bar);
    match &data.outcomes {
        Outcomes::Words(words) => {
            as_many(FIGURE, "words", words.len(), points, "points")?;
            let named = named(words);
            if named.is_empty() {
                return Err(none());
            }
            let bands = named.len().min(NAMED + 1);
            let level = |word: &String| match named.iter().position(|name| *name == word) {
                None => f64::NAN,
                Some(k) => (k.min(NAMED) as f64 + 0.5) / bands as f64,
            };
            let levels: Vec<f64> = words.iter().map(level).collect();
            cells = Cells::banded(&across, &up, &levels, &[bands]);
            colours = (0..bands).map(category).collect::<Vec<Colour>>();
            for (k, colour) in colours.iter().enumerate() {
                let name = if k < NAMED { named[k] } else { "other" };
                entries.push(Entry::new(Key::Fill(*colour), name));
            }
            bar = None;
        }
        Outcomes::Numbers(numbers, label) => {
            as_many(FIGURE, "numbers", numbers.len(), points, "points")?;
            let finite = || numbers.iter().filter(|x| x.is_finite());
            let low = finite().copied().fold(f64::INFINITY, f64::min);
            let high = finite().copied().fold(f64::NEG_INFINITY, f64::max);
            if !(low <= high) {
                return Err(none());
            }
            let high = if low < high {
                high
            } else {
                low + low.abs().max(1.0)
            };
            let scale = Axis::linear(low, high, label, 6);
            let level = |x: &f64| {
                if x.is_finite() {
                    scale.place(*x)
                } else {
                    f64::NAN
                }
            };
            let levels: Vec<f64> = numbers.iter().map(level).collect();
            cells = Cells::new(&across, &up, &levels);
            let bands = cells.bands;
            let colour = |k: usize| sequential(k as f64 / (bands - 1) as f64);
            colours = (0..bands).map(colour).collect();
            bar = Some(ColourBar::new(scale, colours.clone(), [false; 2]));
        }
    }
    if cells.gaps {
        entries.push(Entry::new(Key::Fill(GAP), "no value"));
    }
    let mut block = PageBlock::plane(x, y, Height::Pixels(470.0), Vec::new())
        .without_grid()
        .under(move |canvas, panel| {
            if cells.gaps {
                canvas.polygon(&panel.ring()[..4], GAP, 1.0);
            }
            cells.paint(canvas, panel, &colours);
        });
    block.bar = bar;
    let page = Page::new("What comes of a sweep", &data.title, vec![entries]);
    page.column(Width::Panels(470.0), vec![block]).draw(paper)
}

/// The words sorted by falling frequency, equals alphabetically. If all words are numbers, those with colours
/// of their own are sorted by value.
pub(crate) fn named(words: &[String]) -> Vec<&str> {
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    for word in words.iter().filter(|word| !word.is_empty()) {
        *counts.entry(word).or_default() += 1;
    }
    let mut named: Vec<(&str, usize)> = counts.into_iter().collect();
    named.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let mut named: Vec<&str> = named.into_iter().map(|(word, _)| word).collect();
    let number = |word: &str| word.parse::<f64>().ok();
    if named.iter().all(|word| number(word).is_some()) {
        let coloured = named.len().min(NAMED);
        named[..coloured]
            .sort_by(|a, b| number(a).partial_cmp(&number(b)).unwrap_or(Ordering::Equal));
    }
    named
}
