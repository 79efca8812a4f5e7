//! Bifurcation diagrams: branches of equilibria over a parameter, with their stability.

use super::axes::{Axis, Panel};
use super::canvas::{Canvas, Pen};
use super::geometry::{Pixel, apart, finite, midway};
use super::labels;
use super::legend::{Entry, Key, Mark, draw_mark};
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::palette::{Colour, GREY, INK, category};
use super::paper::Paper;
use snaprod_core::error::{Error, Result};

/// One branch of equilibria; points that are not finite break the branch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchLine {
    /// Name in the legend; empty for none.
    pub name: String,
    /// The parameter at each point.
    pub x: Vec<f64>,
    /// The measure at each point.
    pub y: Vec<f64>,
    /// The Morse index at each point, `None` where unknown (also past the end of this list).
    pub index: Vec<Option<usize>>,
    /// Index of the palette's colour; by default the index in the list.
    pub colour: Option<usize>,
}

/// Kind of a special point of a branch; it selects the mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpecialKind {
    /// A fold (limit point): a disc.
    #[default]
    Fold,
    /// Branches cross: a square.
    BranchPoint,
    /// A change of the index for any reason: a diamond.
    StabilityChange,
    /// A cusp: a triangle.
    Cusp,
    /// A contact begins, ends or changes: a cross.
    Contact,
    /// The end of the computed branch: a ring.
    End,
}

impl SpecialKind {
    const ALL: [(Self, Mark, &'static str); 6] = [
        (Self::Fold, Mark::Disc, "fold"),
        (Self::BranchPoint, Mark::Square, "branch point"),
        (Self::StabilityChange, Mark::Diamond, "stability change"),
        (Self::Cusp, Mark::Triangle, "cusp"),
        (Self::Contact, Mark::Cross, "contact"),
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
    /// Kind of the point.
    pub kind: SpecialKind,
    /// Text beside the point, such as "LP1"; may be empty.
    pub label: String,
}

/// One measure of the branches over the parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchPanel {
    /// The name of the measure, with its unit.
    pub y_label: String,
    /// Range of the measure; by default it holds all points.
    pub y_range: Option<[f64; 2]>,
    /// The branches.
    pub branches: Vec<BranchLine>,
    /// Special points.
    pub specials: Vec<Special>,
}

/// A bifurcation diagram of one or more panels over a common parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BranchDiagram {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The name of the parameter, with its unit.
    pub x_label: String,
    /// Range of the parameter; by default it holds all points.
    pub x_range: Option<[f64; 2]>,
    /// From top to bottom. The same branch has the same name, place and colour in each.
    pub panels: Vec<BranchPanel>,
    /// True if the lines are curves of folds: each point stands for two equilibria that meet, of its index
    /// and the next.
    pub folds: bool,
    /// True if the loads have no potential: the index then does not decide stability, and nothing is called stable.
    pub without_potential: bool,
}

/// Draws branches over a parameter as SVG: stable ones (index 0) thick and solid, index 1 dashed, index 2 in
/// shorter dashes, higher ones dotted, unknown ones thin and grey. Colours tell branches apart, marks the
/// kinds of special points.
///
/// Where the index changes from one point to the next, the line passes through the special point between them
/// (or at one of them) and changes its style exactly there; without a special point, half-way.
///
/// Fails if there is no panel, or one without a finite point.
pub fn branch_diagram(data: &BranchDiagram, paper: &Paper) -> Result<String> {
    let nothing = |i: usize| {
        let panel = i + 1;
        Error::domain(format!(
            "branch diagram: panel {panel} has no finite point to show"
        ))
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
    let mut blocks = Vec::new();
    for (i, panel) in data.panels.iter().enumerate() {
        let values: Vec<f64> = points(panel).map(|p| p.1).collect();
        let wanted = (height / 52.0) as usize;
        // A range given by hand does not make an empty panel worth showing.
        let fitted = Axis::over(&values, panel.y_range, &panel.y_label, wanted);
        let y = fitted
            .filter(|_| !values.is_empty())
            .ok_or_else(|| nothing(i))?;
        let block = PageBlock::plane(x.clone(), y, Height::Pixels(height), Vec::new());
        blocks.push(block.over(|canvas, frame| paint(canvas, frame, panel)));
    }
    let page = Page::new("Branches of equilibria", &data.title, legends(data));
    page.column(Width::Whole(WIDTH), blocks).draw(paper)
}

/// All finite points of a panel.
fn points(panel: &BranchPanel) -> impl Iterator<Item = (f64, f64)> {
    let branches = panel.branches.iter();
    let curves = branches.flat_map(|b| b.x.iter().copied().zip(b.y.iter().copied()));
    let specials = panel.specials.iter().map(|s| (s.x, s.y));
    curves.chain(specials).filter(finite)
}

/// Line style of a piece of a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    Stable,
    One,
    Two,
    More,
    Unknown,
}

impl Style {
    /// All styles with their words, and their words for curves of folds. Index 0 is called stable where the
    /// index decides stability.
    const ALL: [(Self, [&'static str; 2]); 5] = [
        (Self::Stable, ["index 0", "indices 0 and 1"]),
        (Self::One, ["index 1", "indices 1 and 2"]),
        (Self::Two, ["index 2", "indices 2 and 3"]),
        (Self::More, ["index ≥ 3", "indices ≥ 3"]),
        (Self::Unknown, ["index unknown"; 2]),
    ];

    fn words(self, data: &BranchDiagram) -> &'static str {
        let own = Self::ALL.iter().find(|(style, _)| *style == self);
        match (self, data.folds) {
            (Self::Stable, false) if !data.without_potential => "stable (index 0)",
            (Self::Stable, true) if !data.without_potential => "stable meets index 1",
            (_, folds) => own.map_or("", |(_, words)| words[usize::from(folds)]),
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

    fn pen(self, colour: Colour) -> Pen {
        match self {
            Self::Stable => Pen::new(colour, 2.4),
            Self::One => Pen::new(colour, 1.6).dashed(9.0, 4.5),
            Self::Two => Pen::new(colour, 1.6).dashed(4.5, 3.5),
            Self::More => Pen::new(colour, 1.9).dashed(1.9, 3.2),
            Self::Unknown => Pen::new(GREY, 0.9),
        }
    }
}

/// The style at each point of a branch.
fn styles(branch: &BranchLine) -> impl Iterator<Item = Style> {
    let index = branch.index.iter().copied().chain(std::iter::repeat(None));
    index.map(Style::new)
}

/// Legend rows of the names of branches, styles of lines and kinds of marks that occur.
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
        .map(|(style, _)| Entry::new(Key::Line(style.pen(INK)), style.words(data)));
    let marks = SpecialKind::ALL
        .into_iter()
        .filter(|(kind, ..)| {
            let mut all = data.panels.iter().flat_map(|p| &p.specials);
            all.any(|s| s.kind == *kind && s.x.is_finite() && s.y.is_finite())
        })
        .map(|(kind, mark, word)| match kind {
            SpecialKind::Fold if data.folds => Entry::new(Key::Mark(mark, INK), "turning point"),
            SpecialKind::StabilityChange if data.without_potential => {
                Entry::new(Key::Mark(mark, INK), "index change")
            }
            _ => Entry::new(Key::Mark(mark, INK), word),
        });
    vec![names.collect(), lines.collect(), marks.collect()]
}

fn paint(canvas: &mut Canvas, frame: &Panel, panel: &BranchPanel) {
    let marks: Vec<(Pixel, &Special)> = panel
        .specials
        .iter()
        .map(|s| (frame.at(s.x, s.y), s))
        .filter(|(at, _)| finite(at))
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
    // Stable branches can be observed: they lie on top.
    runs.sort_by_key(|(style, ..)| *style == Style::Stable);
    for (style, run, colour) in &runs {
        frame.pixel_line(canvas, run, style.pen(*colour));
    }
    let mut shown: Vec<(Pixel, &Special)> = Vec::new();
    for &(at, special) in marks.iter().filter(|(at, _)| frame.holds(*at)) {
        // A point on two branches is given twice.
        let again = |&(other, s): &(Pixel, &Special)| {
            apart(other, at) < 0.5 && (s.kind, &s.label) == (special.kind, &special.label)
        };
        if !shown.iter().any(again) {
            shown.push((at, special));
            draw_mark(canvas, at, special.kind.mark(), 4.0, INK);
        }
    }
    let lines = runs.iter().map(|(_, run, _)| run);
    let spots: Vec<Pixel> = shown.iter().map(|(at, _)| *at).collect();
    let words = shown.iter().map(|(at, s)| (*at, s.label.as_str()));
    labels::write(canvas, frame, lines, &spots, &words.collect::<Vec<_>>());
}

/// Cuts a branch at changes of style: at a special point if one is near, else half-way.
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
                let s = spot.copied().unwrap_or(midway(a, b, 0.5));
                push(style[0], a, s);
                push(style[1], s, b);
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches index 0 called stable in a problem without a potential.
    #[test]
    fn without_a_potential_nothing_is_called_stable() {
        let branches = vec![BranchLine {
            x: vec![0.0, 1.0, 2.0],
            y: vec![0.0, 1.0, 0.0],
            index: vec![Some(0), Some(0), Some(2)],
            ..BranchLine::default()
        }];
        let specials = vec![Special {
            x: 1.0,
            y: 1.0,
            kind: SpecialKind::StabilityChange,
            label: String::new(),
        }];
        let panel = BranchPanel {
            branches,
            specials,
            ..BranchPanel::default()
        };
        let data = BranchDiagram {
            panels: vec![panel],
            without_potential: true,
            ..BranchDiagram::default()
        };
        let svg = branch_diagram(&data, &Paper::SCREEN).unwrap();
        assert!(svg.contains("index 0") && svg.contains("index change"));
        assert!(!svg.contains("stable") && !svg.contains("stability"));
    }

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
