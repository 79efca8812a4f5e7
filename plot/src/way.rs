//! Path of a point in space, and the coordinates over time.

use super::axes::{Axis, extent};
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, as_many};
use super::energies::{SNAP, snap_lines, snap_name};
use super::geometry::{Pixel, Point, box_of, drawable, finite, thin};
use super::history::History;
use super::legend::{Entry, Key, Mark, PlottedCurve, Tones, draw_mark};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{ALARM, INK, category};
use super::paper::Paper;
use super::scenery::{GROOVE, GROOVE_NAME};
use super::spread::Spread;
use super::stage::{Stage, size_of};
use super::text;
use snaprod_core::error::{Error, Result};

/// Path of a point in space over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceWay {
    /// Title over the figure, as the name of the point; may be empty.
    pub title: String,
    /// Times, rising; two equal ones at a snap.
    pub time: Vec<f64>,
    /// Position at each time; one that is not finite breaks the path.
    pub points: Vec<[f64; 3]>,
    /// The groove of the point, cut off at the box of the path; empty without a groove.
    pub groove: Vec<[f64; 3]>,
    /// Times of snaps.
    pub snaps: Vec<f64>,
    /// Name of the snaps in the legend; if empty "snap".
    pub snaps_name: String,
    /// Units.
    pub units: AxisUnits,
}

const FIGURE: &str = "figure of a way in space";
/// The width of the box of space, and of the panels beside it.
const BOX: f64 = 400.0;
const PANELS: f64 = 440.0;
/// The height of the three panels together.
const BESIDE: f64 = 364.0;
/// Ratio of length and width of a path in a coordinate plane above which the axes have different scales.
const UNEQUAL: f64 = 4.0;
/// Relative width below which a path is a line, drawn without a box.
const LINE: f64 = 1e-3;
/// Movement of a coordinate, relative to the largest, below which it is an error of the motion.
const STILL: f64 = 1e-6;
/// Number of colours of the path in the box.
const TONES: f64 = 64.0;

/// Draws the path in a box of its own size, coloured by time, with start, end and snaps, and beside it the
/// three coordinates over time, as SVG. Each coordinate has a scale of its own. A path along a line has no
/// box. A path in a coordinate plane is drawn in that plane, with different scales if it is long and narrow.
/// A coordinate that moves by less than a millionth of another stands in the title, without a panel.
///
/// Fails if no point is finite, if there are not as many points as times, or if the times have no span.
pub fn space_way(data: &SpaceWay, paper: &Paper) -> Result<String> {
    as_many(
        FIGURE,
        "points",
        data.points.len(),
        data.time.len(),
        "times",
    )?;
    let nothing = || Error::domain(format!("{FIGURE}: no points to show"));
    let bounds = box_of(&data.points).ok_or_else(nothing)?;
    let spread = Spread::new(data.points.iter()).ok_or_else(nothing)?;
    let (start, end) = extent(&data.time)
        .filter(|(start, end)| end > start)
        .ok_or_else(|| Error::domain(format!("{FIGURE}: no span of time")))?;
    let time_label = data.units.time_of("time t");
    let x = Axis::linear(start, end, &time_label, 6);
    let snaps =
        |canvas: &mut Canvas, panel: &super::axes::Panel| snap_lines(canvas, panel, &data.snaps);
    let still = |i: &usize| bounds[*i][1] - bounds[*i][0] <= STILL * size_of(&bounds);
    let moves = (0..3).any(|i| !still(&i));
    let mut panels = Vec::new();
    let mut levels = Vec::new();
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        let values: Vec<f64> = data.points.iter().map(|p| p[i]).collect();
        let still = still(&i);
        let level = 0.5 * (bounds[i][0] + bounds[i][1]);
        if still && moves {
            // Rounding of a coordinate at rest is no level.
            let level = if level.abs() > STILL * size_of(&bounds) {
                level
            } else {
                0.0
            };
            let told = format!("{name} = {} {}", text::short(level, 4), data.units.length);
            levels.push(told.trim_end().to_owned());
            continue;
        }
        let values = if still {
            vec![level; values.len()]
        } else {
            values
        };
        let y = Axis::over(&values, None, &data.units.length_of(name), 4).ok_or_else(nothing)?;
        let history = History::new("", Pen::new(category(i), 1.4), &data.time, &values);
        let curves: Vec<PlottedCurve> = vec![history.line.clone()];
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(112.0), curves);
        panels.push(block.under(move |canvas, panel| {
            history.band(canvas, panel);
            snaps(canvas, panel);
        }));
    }
    let title = [data.title.as_str(), &levels.join(", ")];
    let title: Vec<&str> = title.into_iter().filter(|part| !part.is_empty()).collect();
    let title = title.join(": ");
    let mut entries = Vec::new();
    let line = spread.size[1] < LINE * spread.size[0].max(LINE);
    if !data.snaps.is_empty() {
        let key = if line {
            Key::Line(SNAP)
        } else {
            Key::Mark(Mark::Cross, ALARM)
        };
        entries.push(Entry::new(key, snap_name(&data.snaps_name)));
    }
    if line {
        let page = Page::new("Way of a point in space", &title, vec![entries]);
        return page.column(Width::Whole(WIDTH), panels).draw(paper);
    }
    entries.insert(0, Entry::new(Key::Mark(Mark::Ring, INK), "start"));
    entries.insert(1, Entry::new(Key::Mark(Mark::Square, INK), "end"));
    if data.groove.iter().any(drawable) {
        entries.push(Entry::new(Key::Line(GROOVE), GROOVE_NAME));
    }
    let tones = Tones::over(&data.time).ok_or_else(nothing)?;
    let labels = ["x", "y", "z"].map(|name| data.units.length_of(name));
    let moving: Vec<usize> = (0..3).filter(|i| !still(i)).collect();
    let mut way = match moving[..] {
        // A view along the coordinate at rest.
        [i, j] => {
            let axis = |i: usize| {
                let values: Vec<f64> = data.points.iter().map(|p| p[i]).collect();
                Axis::over(&values, None, &labels[i], 5).ok_or_else(nothing)
            };
            let (x, y) = (axis(i)?, axis(j)?);
            let ratio = (y.hi - y.lo) / (x.hi - x.lo);
            let height = if (1.0 / UNEQUAL..UNEQUAL).contains(&ratio) {
                Height::Equal(140.0, BESIDE)
            } else {
                Height::Pixels(BESIDE)
            };
            PageBlock::plane(x, y, height, Vec::new())
                .over(move |canvas, panel| paint(canvas, data, tones, |p| panel.at(p[i], p[j])))
        }
        _ => {
            let (view, labels) = (spread.view(), &labels);
            let place = move |place| Stage::new(bounds, labels, view, place);
            let needed = place([0.0, 0.0, BOX, BOX]).height();
            PageBlock::space(needed.clamp(200.0, BOX), place, move |canvas, stage| {
                paint(canvas, data, tones, |p| stage.pixel(*p))
            })
        }
    };
    way.bar = Some(tones.bar(&time_label));
    let page = Page::new("Way of a point in space", &title, vec![entries]);
    let page = page.column(Width::Whole(BOX + 60.0), vec![way]);
    page.column(Width::Whole(PANELS), panels).draw(paper)
}

/// Paints the path coloured by time, on its groove, with its start, its end and snaps; `at` gives the pixel
/// of a point.
fn paint(canvas: &mut Canvas, data: &SpaceWay, tones: Tones, at: impl Fn(&Point) -> Pixel) {
    let groove: Vec<Pixel> = data.groove.iter().map(&at).collect();
    canvas.line(&thin(&groove, 0.06), GROOVE);
    let (start, end) = extent(&data.time).unwrap_or_default();
    // Every point counts: fewer points of a fast motion would make another path.
    let tone = |t: f64| {
        ((t - start) / (end - start) * TONES)
            .floor()
            .min(TONES - 1.0)
    };
    let places: Vec<Pixel> = data.points.iter().map(&at).collect();
    let mut first = 0;
    for run in data.time.chunk_by(|a, b| tone(*a) == tone(*b)) {
        let last = (first + run.len()).min(places.len() - 1);
        let pen = Pen::new(tones.colour(run[0]).tint(0.2), 0.9);
        for part in places[first..=last].split(|place| !finite(place)) {
            canvas.line(&thin(part, 0.06), pen);
        }
        first += run.len();
    }
    let mut mark = |point: Option<&Point>, mark: Mark, colour| {
        if let Some(point) = point {
            draw_mark(canvas, at(point), mark, 4.2, colour);
        }
    };
    for snap in &data.snaps {
        let next = data.time.partition_point(|t| t < snap);
        let point = data.points.get(next).filter(|p| drawable(p));
        mark(point, Mark::Cross, ALARM);
    }
    let mut drawn = data.points.iter().filter(|p| drawable(p));
    mark(drawn.next(), Mark::Ring, INK);
    mark(drawn.next_back(), Mark::Square, INK);
}
