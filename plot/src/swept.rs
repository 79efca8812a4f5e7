//! Outcomes of a sweep over one field of a scene: numbers over that field.

use super::axes::{Axis, extent};
use super::canvas::{Canvas, Pen};
use super::data::as_many;
use super::geometry::{Pixel, finite};
use super::legend::{Entry, Key, Mark, draw_mark};
use super::outcome::{NAMED, SweptAxis, named};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{Colour, GREY, category};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// A sweep over one field.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweptCurves {
    /// Title over the figure, as the meaning of the words; may be empty.
    pub title: String,
    /// The varied field.
    pub x: SweptAxis,
    /// Numbers for each value of the field, NaN for none, with their name and unit: a panel each.
    pub curves: Vec<(String, Vec<f64>)>,
    /// Outcome of each value of the field as a word, which selects the colour; empty if all are alike.
    pub words: Vec<String>,
}

const FIGURE: &str = "figure of a sweep";
/// Number of points above which marks are small dots.
const MARKS: usize = 120;

/// Draws numbers of a sweep over its field as marks, as SVG, in the colours of an outcome map. A thin line
/// joins neighbours with the same word; between others the outcome changes. The line breaks at jumps.
///
/// Fails if a list has not as many entries as the field has values, or if nothing is finite.
pub fn swept_curves(data: &SweptCurves, paper: &Paper) -> Result<String> {
    let nothing = || Error::domain(format!("{FIGURE}: nothing to show"));
    let (points, axis) = (data.x.values.len(), &data.x);
    let x = Axis::fit(&axis.values, axis.log, &axis.label, 6).ok_or_else(nothing)?;
    if !data.words.is_empty() {
        as_many(FIGURE, "words", data.words.len(), points, "values")?;
    }
    let named = named(&data.words);
    let colour = |i: usize| match data.words.get(i) {
        None => category(0),
        Some(word) => match named.iter().position(|name| name == word) {
            None => GREY,
            Some(k) => category(k.min(NAMED)),
        },
    };
    let colours: Vec<Colour> = (0..points).map(colour).collect();
    let mut blocks = Vec::new();
    for (label, values) in &data.curves {
        as_many(FIGURE, label, values.len(), points, "values")?;
        let Some(y) = Axis::over(values, None, label, 5) else {
            continue;
        };
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(150.0), Vec::new());
        let colours = &colours;
        blocks.push(block.over(move |canvas, panel| {
            let pixels = panel.pixels(&axis.values, values);
            paint(canvas, &pixels, colours, &data.words);
        }));
    }
    if blocks.is_empty() {
        return Err(nothing());
    }
    let key = |(k, name): (usize, &&str)| {
        let name = if k < NAMED { name } else { "other" };
        Entry::new(Key::Mark(Mark::Disc, category(k)), name)
    };
    let entries = named.iter().take(NAMED + 1).enumerate().map(key);
    let page = Page::new(
        "What comes of a sweep",
        &data.title,
        vec![entries.collect()],
    );
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

/// Rise that is a jump: in medians of all rises, and as a part of the range.
const JUMP: f64 = 8.0;
const PART: f64 = 0.25;

/// True for each point to which the values jump from the one before.
fn jumps(pixels: &[Pixel]) -> Vec<bool> {
    let rises: Vec<f64> = pixels
        .windows(2)
        .map(|two| (two[1].1 - two[0].1).abs())
        .collect();
    let mut known: Vec<f64> = rises
        .iter()
        .copied()
        .filter(|rise| rise.is_finite())
        .collect();
    known.sort_by(f64::total_cmp);
    let heights: Vec<f64> = pixels.iter().map(|at| at.1).collect();
    let (Some(median), Some((low, high))) = (known.get(known.len() / 2), extent(&heights)) else {
        return vec![false; pixels.len()];
    };
    let least = (JUMP * median).max(PART * (high - low));
    // Of few points each may be far from the next.
    let many = pixels.len() > 8;
    std::iter::once(false)
        .chain(rises.iter().map(|rise| many && *rise > least))
        .collect()
}

fn paint(canvas: &mut Canvas, pixels: &[Pixel], colours: &[Colour], words: &[String]) {
    let jumps = jumps(pixels);
    for i in 1..pixels.len() {
        if jumps[i] {
            continue;
        }
        if words.is_empty() || words[i - 1] == words[i] {
            canvas.line(&pixels[i - 1..=i], Pen::new(colours[i].tint(0.4), 1.2));
        }
    }
    let mark = match pixels.len() {
        0..MARKS => Mark::Disc,
        _ => Mark::Dot,
    };
    for (at, colour) in pixels.iter().zip(colours).filter(|(at, _)| finite(at)) {
        draw_mark(canvas, *at, mark, 3.2, *colour);
    }
}
