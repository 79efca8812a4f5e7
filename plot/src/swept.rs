//! Outcomes of a sweep over one field of a scene: numbers over that field.

use super::axes::Axis;
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
/// joins neighbours with the same word; between others the outcome changes.
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

fn paint(canvas: &mut Canvas, pixels: &[Pixel], colours: &[Colour], words: &[String]) {
    for i in 1..pixels.len() {
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
