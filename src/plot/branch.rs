//! Bifurcation diagrams: branches of equilibria over a parameter, with their stability.

use super::axes::{Axis, LABEL, Mark, Panel, SMALL, clip, draw_mark};
use super::canvas::{Canvas, Pen, Side, Type};
use super::legend::{Entry, Key};
use super::page::{Column, WIDTH};
use super::palette::{GREY, INK, category};
use super::text;
use crate::error::{Error, Result};

/// One branch of equilibria; points that are not finite break it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchLine {
    /// Its name in the legend; without one it is left out there.
    pub name: String,
    /// The parameter at each point.
    pub x: Vec<f64>,
    /// The measure at each point.
    pub y: Vec<f64>,
    /// The Morse index at each point, `None` where unknown (also past the end of this list).
    pub index: Vec<Option<usize>>,
    /// Which colour of the palette; by default its place in the list.
    pub colour: Option<usize>,
}

/// What is special about a point of a branch: its mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpecialKind {
    /// A fold (limit point): a disc.
    #[default]
    Fold,
    /// Branches cross: a square.
    BranchPoint,
    /// The index changes, for whatever reason: a diamond.
    StabilityChange,
    /// A cusp: a triangle.
    Cusp,
    /// The branch was left here: a ring.
    End,
}

impl SpecialKind {
    const ALL: [(Self, Mark, &'static str); 5] = [
        (Self::Fold, Mark::Disc, "fold"),
        (Self::BranchPoint, Mark::Square, "branch point"),
        (Self::StabilityChange, Mark::Diamond, "stability change"),
        (Self::Cusp, Mark::Triangle, "cusp"),
        (Self::End, Mark::Ring, "end"),
    ];

    fn mark(self) -> Mark {
        Self::ALL
            .iter()
            .find(|(kind, ..)| *kind == self)
            .map_or(Mark::Cross, |&(_, mark, _)| mark)
    }
}

/// A special point of a branch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Special {
    /// The parameter.
    pub x: f64,
    /// The measure.
    pub y: f64,
    /// What it is.
    pub kind: SpecialKind,
    /// Written beside it, such as "LP1"; may be empty.
    pub label: String,
}

/// One measure of the branches over the parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchPanel {
    /// The name of the measure, with its unit.
    pub y_label: String,
    /// The range of the measure; by default what holds all points.
    pub y_range: Option<[f64; 2]>,
    /// The branches.
    pub branches: Vec<BranchLine>,
    /// Special points.
    pub specials: Vec<Special>,
}

/// A bifurcation diagram of one or more panels over a common parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchDiagram {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The name of the parameter, with its unit.
    pub x_label: String,
    /// The range of the parameter; by default what holds all points.
    pub x_range: Option<[f64; 2]>,
    /// From top to bottom. The same branch has the same name, place and colour in each.
    pub panels: Vec<BranchPanel>,
    /// The lines are curves of folds: each point stands for two equilibria that meet, of its index and the next.
    pub folds: bool,
}

/// Draws branches over a parameter as SVG: stable ones (index 0) thick and solid, index 1 dashed, index 2 in
/// shorter dashes, higher ones dotted, unknown ones thin and grey. Colours tell branches apart, marks the kinds of special
/// points.
///
/// Where the index changes from one point to the next, the line passes through the special point between
/// them (or at one of them) and changes its style exactly there; without a special point, half-way.
///
/// Errs if there is no panel, or one without a finite point.
pub fn branch_diagram(data: &BranchDiagram) -> Result<String> {
    let nothing = |i: usize| {
        let what = format!(
            "branch diagram: panel {} has no finite point to show",
            i + 1
        );
        Error::domain(what)
    };
    if data.panels.is_empty() {
        return Err(Error::domain("branch diagram: no panel to show"));
    }
    let height = match data.panels.len() {
        1 => 360.0,
        2 => 235.0,
        _ => 180.0,
    };
    let xs: Vec<f64> = data.panels.iter().flat_map(points).map(|p| p.0).collect();
    let x = Axis::over(&xs, data.x_range, &data.x_label, 7).ok_or_else(|| nothing(0))?;
    let mut axes = Vec::new();
    for (i, panel) in data.panels.iter().enumerate() {
        let values: Vec<f64> = points(panel).map(|p| p.1).collect();
        let wanted = (height / 52.0) as usize;
        // A range given by hand does not make an empty panel worth showing.
        let fitted = Axis::over(&values, panel.y_range, &panel.y_label, wanted);
        let fitted = fitted.filter(|_| !values.is_empty());
        axes.push((fitted.ok_or_else(|| nothing(i))?, height));
    }
    let page = Column::new(WIDTH, &data.title, legends(data), &x, axes);
    Ok(page.draw(|canvas, i, frame| paint(canvas, frame, &data.panels[i])))
}

/// All finite points of a panel.
fn points(panel: &BranchPanel) -> impl Iterator<Item = (f64, f64)> {
    let curves = panel
        .branches
        .iter()
        .flat_map(|b| b.x.iter().copied().zip(b.y.iter().copied()));
    let specials = panel.specials.iter().map(|s| (s.x, s.y));
    curves
        .chain(specials)
        .filter(|p| p.0.is_finite() && p.1.is_finite())
}

/// How a piece of a branch is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    Stable,
    One,
    Two,
    More,
    Unknown,
}

impl Style {
    const ALL: [(Self, &'static str); 5] = [
        (Self::Stable, "stable (index 0)"),
        (Self::One, "index 1"),
        (Self::Two, "index 2"),
        (Self::More, "index ≥ 3"),
        (Self::Unknown, "index unknown"),
    ];

    /// Its words where lines are curves of folds.
    fn of_folds(self) -> &'static str {
        match self {
            Self::Stable => "stable meets index 1",
            Self::One => "indices 1 and 2",
            Self::Two => "indices 2 and 3",
            Self::More => "indices ≥ 3",
            Self::Unknown => "index unknown",
        }
    }

    fn new(index: Option<usize>) -> Self {
        match index {
            None => Self::Unknown,
            Some(0) => Self::Stable,
            Some(1) => Self::One,
            Some(2) => Self::Two,
            Some(_) => Self::More,
        }
    }

    fn pen(self, colour: super::palette::Colour) -> Pen {
        match self {
            Self::Stable => Pen::new(colour, 2.4),
            Self::One => Pen::new(colour, 1.6).dashed(9.0, 4.5),
            Self::Two => Pen::new(colour, 1.6).dashed(4.5, 3.5),
            Self::More => Pen::new(colour, 1.9).dashed(1.9, 3.2),
            Self::Unknown => Pen::new(GREY, 0.9),
        }
    }
}

type Pixel = (f64, f64);

/// The style at each point of a branch.
fn styles(branch: &BranchLine) -> impl Iterator<Item = Style> {
    let index = branch.index.iter().copied().chain(std::iter::repeat(None));
    index.map(Style::new)
}

/// Names of branches, styles of lines and kinds of marks, as far as they occur: rows of each.
fn legends(data: &BranchDiagram) -> Vec<Vec<Entry>> {
    let mut named: Vec<(usize, &str)> = Vec::new();
    let mut seen = Vec::new();
    for panel in &data.panels {
        for (i, branch) in panel.branches.iter().enumerate() {
            let name = (branch.colour.unwrap_or(i), branch.name.as_str());
            if !branch.name.is_empty() && !named.contains(&name) {
                named.push(name);
            }
            let points = branch.x.iter().zip(&branch.y).zip(styles(branch));
            for ((x, y), style) in points {
                if x.is_finite() && y.is_finite() && !seen.contains(&style) {
                    seen.push(style);
                }
            }
        }
    }
    let names = named
        .into_iter()
        .map(|(i, name)| Entry::new(Key::Line(Pen::new(category(i), 2.4)), name));
    let lines = Style::ALL
        .into_iter()
        .filter(|(style, _)| seen.contains(style))
        .map(|(style, word)| match data.folds {
            true => Entry::new(Key::Line(style.pen(INK)), style.of_folds()),
            false => Entry::new(Key::Line(style.pen(INK)), word),
        });
    let marks = SpecialKind::ALL
        .into_iter()
        .filter(|(kind, ..)| {
            let mut all = data.panels.iter().flat_map(|p| &p.specials);
            all.any(|s| s.kind == *kind && s.x.is_finite() && s.y.is_finite())
        })
        .map(|(kind, mark, word)| match kind {
            SpecialKind::Fold if data.folds => Entry::new(Key::Mark(mark, INK), "turning point"),
            _ => Entry::new(Key::Mark(mark, INK), word),
        });
    vec![names.collect(), lines.collect(), marks.collect()]
}

fn paint(canvas: &mut Canvas, frame: &Panel, panel: &BranchPanel) {
    let marks: Vec<(Pixel, &Special)> = panel
        .specials
        .iter()
        .map(|s| (frame.at(s.x, s.y), s))
        .filter(|(at, _)| at.0.is_finite() && at.1.is_finite())
        .collect();
    let spots: Vec<Pixel> = marks.iter().map(|(at, _)| *at).collect();
    let mut runs = Vec::new();
    for (i, branch) in panel.branches.iter().enumerate() {
        let colour = category(branch.colour.unwrap_or(i));
        let pixels = frame.pixels(&branch.x, &branch.y);
        let styles: Vec<Style> = styles(branch).take(pixels.len()).collect();
        for (style, run) in cut(&pixels, &styles, &spots) {
            runs.push((style, run, colour));
        }
    }
    // What can be observed lies on top.
    runs.sort_by_key(|(style, ..)| *style == Style::Stable);
    for (style, run, colour) in &runs {
        frame.pixel_line(canvas, run, style.pen(*colour));
    }
    let mut shown: Vec<(Pixel, &Special)> = Vec::new();
    for &(at, special) in marks.iter().filter(|(at, _)| frame.holds(*at)) {
        // A point that two branches share is given twice.
        let again = |&(other, s): &(Pixel, &Special)| {
            apart(other, at) < 0.5 && (s.kind, &s.label) == (special.kind, &special.label)
        };
        if !shown.iter().any(again) {
            shown.push((at, special));
        }
    }
    for &(at, special) in &shown {
        draw_mark(canvas, at, special.kind.mark(), 4.0, INK);
    }
    let edges = [frame.left, frame.top, frame.right(), frame.bottom()];
    let ink: Vec<Pixel> = runs
        .iter()
        .flat_map(|(_, run, _)| clip(run, edges))
        .flat_map(|run| dotted(&run))
        .collect();
    let spots: Vec<Pixel> = shown.iter().map(|(at, _)| *at).collect();
    let words: Vec<&str> = shown.iter().map(|(_, s)| s.label.as_str()).collect();
    let font = Type::new(SMALL, Side::Middle, Side::Middle);
    for (place, word) in labels(edges, &ink, &spots, &words).iter().zip(words) {
        if let Some([from, to]) = place.leader {
            canvas.line(&[from, to], Pen::new(INK, 0.6));
        }
        canvas.halo_text(place.at, word, font);
    }
}

fn apart(a: Pixel, b: Pixel) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

/// Cuts a branch where its style changes: at the special point there, if there is one.
fn cut(pixels: &[Pixel], styles: &[Style], spots: &[Pixel]) -> Vec<(Style, Vec<Pixel>)> {
    const SAME: f64 = 0.01;
    let mut runs: Vec<(Style, Vec<Pixel>)> = Vec::new();
    let mut push = |style: Style, from: Pixel, to: Pixel| match runs.last_mut() {
        Some((last, run)) if *last == style && run.last() == Some(&from) => run.push(to),
        _ => runs.push((style, vec![from, to])),
    };
    for (ends, style) in pixels.windows(2).zip(styles.windows(2)) {
        let (a, b) = (ends[0], ends[1]);
        let length = apart(a, b);
        if !length.is_finite() {
            continue;
        }
        if style[0] == style[1] {
            push(style[0], a, b);
            continue;
        }
        // A fold lies a little beyond the chord.
        let way = |s: &Pixel| apart(a, *s) + apart(*s, b);
        let spot = spots
            .iter()
            .filter(|s| way(s) <= 1.6 * length + 4.0)
            .min_by(|s, t| way(s).total_cmp(&way(t)));
        match spot {
            // The index computed at a singular point means nothing.
            Some(&s) if apart(a, s) < SAME => push(style[1], a, b),
            Some(&s) if apart(b, s) < SAME => push(style[0], a, b),
            _ => {
                let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
                let s = spot.copied().unwrap_or(middle);
                push(style[0], a, s);
                push(style[1], s, b);
            }
        }
    }
    runs
}

/// Points on a line, at most three pixels apart.
fn dotted(run: &[Pixel]) -> Vec<Pixel> {
    let mut dots = Vec::new();
    for pair in run.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let n = (apart(a, b) / 3.0).ceil().clamp(1.0, 2000.0);
        for i in 0..=n as usize {
            let t = i as f64 / n;
            dots.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
        }
    }
    dots
}

/// Where a label stands.
struct Place {
    /// Its middle.
    at: Pixel,
    /// A line to its point, if it stands far off.
    leader: Option<[Pixel; 2]>,
}

/// A place for each word near its spot: where it covers the least ink, no mark and no other word.
fn labels(edges: [f64; 4], ink: &[Pixel], spots: &[Pixel], words: &[&str]) -> Vec<Place> {
    const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
    const WAYS: [(f64, f64); 8] = [
        (DIAGONAL, -DIAGONAL),
        (1.0, 0.0),
        (DIAGONAL, DIAGONAL),
        (-DIAGONAL, -DIAGONAL),
        (-1.0, 0.0),
        (-DIAGONAL, DIAGONAL),
        (0.0, -1.0),
        (0.0, 1.0),
    ];
    let mut taken: Vec<[f64; 4]> = Vec::new();
    let mut places = Vec::new();
    for (&spot, word) in spots.iter().zip(words) {
        let (w, h) = (0.5 * text::width(word, SMALL) + 1.5, 0.5 * LABEL);
        let mut best: Option<(f64, Place, [f64; 4])> = None;
        for (off, dear) in [(7.0, 0.0), (13.0, 0.7), (24.0, 1.6)] {
            for (i, way) in WAYS.iter().enumerate() {
                let lean = |c: f64| if c.abs() < 0.1 { 0.0 } else { c.signum() };
                let at = (
                    spot.0 + off * way.0 + w * lean(way.0),
                    spot.1 + off * way.1 + h * lean(way.1),
                );
                let area = [at.0 - w, at.1 - h, at.0 + w, at.1 + h];
                let covers =
                    |p: &&Pixel| p.0 > area[0] && p.0 < area[2] && p.1 > area[1] && p.1 < area[3];
                let meets = |o: &&[f64; 4]| {
                    area[0] < o[2] && o[0] < area[2] && area[1] < o[3] && o[1] < area[3]
                };
                let near_mark = |p: &&Pixel| {
                    let grown = [area[0] - 4.5, area[1] - 4.5, area[2] + 4.5, area[3] + 4.5];
                    p.0 > grown[0] && p.0 < grown[2] && p.1 > grown[1] && p.1 < grown[3]
                };
                let outside = area[0] < edges[0] + 2.0
                    || area[1] < edges[1] + 2.0
                    || area[2] > edges[2] - 2.0
                    || area[3] > edges[3] - 2.0;
                let cost = 0.01 * i as f64
                    + dear
                    + ink.iter().filter(covers).count() as f64
                    + 8.0 * spots.iter().filter(near_mark).count() as f64
                    + 30.0 * taken.iter().filter(meets).count() as f64
                    + if outside { 100.0 } else { 0.0 };
                if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                    let to = (spot.0 + (off - 2.0) * way.0, spot.1 + (off - 2.0) * way.1);
                    let from = (spot.0 + 5.0 * way.0, spot.1 + 5.0 * way.1);
                    let leader = (off > 20.0 && !word.is_empty()).then_some([from, to]);
                    best = Some((cost, Place { at, leader }, area));
                }
            }
        }
        if let Some((_, place, area)) = best {
            if !word.is_empty() {
                taken.push(area);
            }
            places.push(place);
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a style that changes at a data point instead of at the fold between two of them, or
    /// that trusts the index computed at the fold itself.
    #[test]
    fn style_changes_at_the_special_point() {
        use Style::*;
        let line = [(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)];
        let spot = [(13.0, 1.0)];
        let runs = cut(&line, &[Stable, Stable, One], &spot);
        assert_eq!(runs[0], (Stable, vec![line[0], line[1], spot[0]]));
        assert_eq!(runs[1], (One, vec![spot[0], line[2]]));
        for moot in [Stable, One, More, Unknown] {
            let runs = cut(&line, &[Stable, moot, One], &[line[1]]);
            assert_eq!(runs[0], (Stable, vec![line[0], line[1]]), "{moot:?}");
            assert_eq!(runs[1], (One, vec![line[1], line[2]]), "{moot:?}");
        }
        // Far from any special point: half-way.
        let runs = cut(&line[..2], &[Stable, Two], &[(90.0, 90.0)]);
        assert_eq!(runs[0], (Stable, vec![line[0], (5.0, 0.0)]));
        assert_eq!(runs[1], (Two, vec![(5.0, 0.0), line[1]]));
    }
}
