//! Layout of every figure: a title, a legend, and columns of blocks. A block is a panel in the plane or a box
//! of space, with an optional title, legend and colour bar.

use super::axes::{Axis, Panel, ROOM_BELOW, TITLE, room_left};
use super::canvas::{Canvas, Side, Type, draw};
use super::legend::{ColourBar, Entry, Legend, PlottedCurve};
use super::paper::{Paper, Print};
use super::stage::Stage;
use snaprod_core::error::Result;

/// The usual width of a figure, in pixels.
pub(crate) const WIDTH: f64 = 640.0;
/// Distance from a panel to the right edge of the column, and to the colour bar.
const ROOM_RIGHT: f64 = 18.0;
/// Distance from the left edge to the words over a box of space.
const INSET: f64 = 30.0;
/// Distance from the upper edge of the figure, or from its title, to the legend, and to a panel without one.
const ABOVE_LEGEND: f64 = 6.0;
const ABOVE: f64 = 10.0;
/// Gap between panels that share an axis.
const GAP: f64 = 14.0;
/// Height of a title.
const TITLE_HEIGHT: f64 = 24.0;
/// Least width of columns side by side, and of those of a figure that is printed narrow, whose panels are alike.
const NARROW: f64 = 230.0;
const NARROWEST: f64 = 180.0;
/// Most height of the block over several columns, as a part of the width.
const HEAD: f64 = 0.52;
/// Least height of panels in narrow figures, relative to the usual.
const LOW: f64 = 0.75;
/// Most height of a printed stack of panels, as a part of the width: 120 mm of a figure that is 85 mm wide.
const TALL: f64 = 1.4;

type Paint<'a, T> = Box<dyn Fn(&mut Canvas, &T) + 'a>;
type PanelDrawing<'a> = Box<dyn Fn([f64; 4]) -> Stage + 'a>;

/// The height of a panel.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Height {
    Pixels(f64),
    /// Equal scales of x and y; the axes are widened to keep the height within these bounds.
    Equal(f64, f64),
}

struct PlanePanel<'a> {
    x: Axis,
    y: Axis,
    height: Height,
    curves: Vec<PlottedCurve>,
    grid: bool,
    under: Paint<'a, Panel>,
    over: Paint<'a, Panel>,
}

enum BlockContent<'a> {
    Plane(Box<PlanePanel<'a>>),
    Space {
        height: f64,
        place: PanelDrawing<'a>,
        paint: Paint<'a, Stage>,
    },
}

/// A panel or a box of space.
pub(crate) struct PageBlock<'a> {
    pub title: &'a str,
    /// Legend of the block; common entries stand in that of the page.
    pub legend: Vec<Vec<Entry>>,
    pub bar: Option<ColourBar>,
    body: BlockContent<'a>,
}

impl<'a> PageBlock<'a> {
    /// A panel with curves.
    pub(crate) fn plane(x: Axis, y: Axis, height: Height, curves: Vec<PlottedCurve>) -> Self {
        Self::new(BlockContent::Plane(Box::new(PlanePanel {
            x,
            y,
            height,
            curves,
            grid: true,
            under: Box::new(|_, _| ()),
            over: Box::new(|_, _| ()),
        })))
    }

    /// A box of space: `place` puts it into the pixels [left, top, width, height].
    pub(crate) fn space(
        height: f64,
        place: impl Fn([f64; 4]) -> Stage + 'a,
        paint: impl Fn(&mut Canvas, &Stage) + 'a,
    ) -> Self {
        let (place, paint) = (Box::new(place), Box::new(paint));
        Self::new(BlockContent::Space {
            height,
            place,
            paint,
        })
    }

    fn new(body: BlockContent<'a>) -> Self {
        Self {
            title: "",
            legend: Vec::new(),
            bar: None,
            body,
        }
    }

    /// Sets the painting under the curves of a panel.
    pub(crate) fn under(mut self, paint: impl Fn(&mut Canvas, &Panel) + 'a) -> Self {
        if let BlockContent::Plane(plane) = &mut self.body {
            plane.under = Box::new(paint);
        }
        self
    }

    /// Sets the painting over the curves of a panel.
    pub(crate) fn over(mut self, paint: impl Fn(&mut Canvas, &Panel) + 'a) -> Self {
        if let BlockContent::Plane(plane) = &mut self.body {
            plane.over = Box::new(paint);
        }
        self
    }

    /// Leaves the grid out, for filled panels.
    pub(crate) fn without_grid(mut self) -> Self {
        if let BlockContent::Plane(plane) = &mut self.body {
            plane.grid = false;
        }
        self
    }

    /// Room left of the block.
    fn room(&self) -> f64 {
        match &self.body {
            BlockContent::Plane(plane) => room_left(&plane.y),
            BlockContent::Space { .. } => INSET,
        }
    }

    /// Distance from the lower edge to the next block, or the end of the figure.
    fn gap(&self, shared: bool) -> f64 {
        match &self.body {
            BlockContent::Plane(_) if shared => GAP,
            BlockContent::Plane(_) => ROOM_BELOW,
            BlockContent::Space { .. } => 0.0,
        }
    }

    /// Widens the axes of a panel of this width to keep the height within the bounds.
    fn even(&mut self, width: f64) {
        if let BlockContent::Plane(plane) = &mut self.body
            && let PlanePanel {
                x,
                y,
                height: Height::Equal(least, most),
                ..
            } = plane.as_mut()
        {
            let (least, most) = (*least, *most);
            let (across, up) = (x.hi - x.lo, y.hi - y.lo);
            let tall = (width * up / across).clamp(least, most);
            let scale = (width / across).min(tall / up);
            x.widen(width / scale);
            y.widen(tall / scale);
        }
    }

    /// Adapts a panel whose width changes by the factor `times`: height in proportion, number of marks to the room.
    fn stretch(&mut self, times: f64) {
        match &mut self.body {
            BlockContent::Plane(plane) => {
                plane.x.stretch(times);
                match &mut plane.height {
                    Height::Pixels(height) => *height *= times.max(LOW),
                    Height::Equal(least, most) => {
                        (*least, *most) = (*least * times, *most * times);
                        plane.y.stretch(times);
                    }
                }
            }
            BlockContent::Space { height, .. } => *height *= times,
        }
    }

    fn height(&self, width: f64) -> f64 {
        match &self.body {
            BlockContent::Space { height, .. } => *height,
            BlockContent::Plane(plane) => match plane.height {
                Height::Pixels(height) => height,
                Height::Equal(..) => width * (plane.y.hi - plane.y.lo) / (plane.x.hi - plane.x.lo),
            },
        }
    }

    /// True if the block below has the same horizontal axis.
    fn shares(&self, below: Option<&Self>) -> bool {
        match (&self.body, below.map(|b| &b.body)) {
            (BlockContent::Plane(plane), Some(BlockContent::Plane(other))) => {
                let (x, other) = (&plane.x, &other.x);
                (x.lo, x.hi, &x.label) == (other.lo, other.hi, &other.label)
            }
            _ => false,
        }
    }
}

/// Width of a column.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Width {
    /// Width including everything beside the panels.
    Whole(f64),
    /// Width of the panels alone.
    Panels(f64),
}

/// A figure.
pub(crate) struct Page<'a> {
    /// Description for screen readers if the figure has no title.
    about: &'static str,
    title: &'a str,
    /// Each group of entries begins a row.
    legend: Vec<Vec<Entry>>,
    columns: Vec<(Width, Vec<PageBlock<'a>>)>,
    /// A block over all columns, as wide as they are together.
    head: Option<PageBlock<'a>>,
    /// True for panels of one kind, in rows: a narrow figure has fewer panels in a row.
    grid: bool,
}

/// A block as laid out: [left, top, width, height] of its panel or box.
struct PlacedBlock<'p> {
    block: &'p PageBlock<'p>,
    legend: Legend,
    place: [f64; 4],
    shared: bool,
    alone: bool,
}

impl<'a> Page<'a> {
    pub(crate) fn new(about: &'static str, title: &'a str, legend: Vec<Vec<Entry>>) -> Self {
        Self {
            about,
            title,
            legend,
            columns: Vec::new(),
            head: None,
            grid: false,
        }
    }

    /// Says that the blocks are alike, and stand in rows across the columns.
    pub(crate) fn grid(mut self) -> Self {
        self.grid = true;
        self
    }

    /// Adds a column at the right.
    pub(crate) fn column(mut self, width: Width, blocks: Vec<PageBlock<'a>>) -> Self {
        self.columns.push((width, blocks));
        self
    }

    /// Title and description for screen readers: the quantities on the axes, and the names in the legends.
    fn words(&self) -> [String; 2] {
        let columns = || self.columns.iter().flat_map(|(_, blocks)| blocks);
        let blocks = || self.head.iter().chain(columns());
        let axes = blocks().filter_map(|block| match &block.body {
            BlockContent::Plane(plane) => {
                Some(match (plane.y.label.as_str(), plane.x.label.as_str()) {
                    (y, "") => y.to_owned(),
                    (y, x) => format!("{y} over {x}"),
                })
            }
            BlockContent::Space { .. } => None,
        });
        let spaces = blocks().filter(|block| matches!(block.body, BlockContent::Space { .. }));
        let titles = blocks().map(|block| block.title.to_owned());
        let panels: Vec<String> = titles
            .chain(axes)
            .filter(|words| !words.is_empty())
            .collect();
        let legends = blocks().flat_map(|block| &block.legend);
        let entries = self.legend.iter().chain(legends).flatten();
        let bars = blocks().filter_map(|block| block.bar.as_ref());
        let mut named: Vec<String> = entries.map(|entry| entry.text().to_owned()).collect();
        named.extend(bars.map(|bar| format!("colours: {}", bar.label())));
        named.retain(|name| !name.is_empty());
        named.dedup();
        let mut said = panels;
        said.extend((spaces.count() > 0).then(|| "a view in perspective".to_owned()));
        said.extend((!named.is_empty()).then(|| named.join(", ")));
        let title = match self.title {
            "" => self.about.to_owned(),
            title => format!("{}: {title}", self.about),
        };
        [title, said.join("; ")]
    }

    /// Draws the figure; fails if the paper has no room for it.
    pub(crate) fn draw(mut self, paper: &Paper) -> Result<String> {
        let print = paper.print()?;
        let mut measures = self.measure();
        if let Some(Print {
            width: Some(width), ..
        }) = print
        {
            self.fit(width.round(), &measures);
            measures = self.measure();
        }
        let total: f64 = measures.iter().map(|m| m[2]).sum();
        let left = measures.first().map_or(0.0, |m| m[0]);
        let legend = Legend::new(&self.legend, total - left - ROOM_RIGHT);
        let titled = if self.title.is_empty() {
            0.0
        } else {
            TITLE_HEIGHT
        };
        let mut blocks = self.columns.iter().flat_map(|(_, blocks)| blocks);
        let above = if blocks.any(|b| !b.title.is_empty()) {
            TITLE_HEIGHT
        } else {
            0.0
        };

        let mut laid: Vec<PlacedBlock> = Vec::new();
        let mut start = ABOVE + titled + legend.height();
        let spans = (self.head.as_mut())
            .map(|head| measure(Width::Whole(total), std::slice::from_mut(head)));
        let (_, high) = self.placed(&measures, start, above);
        if print.is_some() && high > TALL * total {
            self.lower(high - TALL * total);
            measures = self.measure();
        }
        if let (Some(head), Some([room, inner, _])) = (&self.head, spans) {
            let own = Legend::new(&head.legend, inner);
            let top = start + above + own.height();
            let height = head.height(inner).min(HEAD * total);
            start = top + height + head.gap(false);
            laid.push(PlacedBlock {
                block: head,
                legend: own,
                place: [room, top, inner, height],
                shared: false,
                alone: false,
            });
        }
        let (below, bottom) = self.placed(&measures, start, above);
        laid.extend(below);
        // A box of space beside panels is as high as they are.
        for at in laid.iter_mut().filter(|at| at.alone) {
            if let BlockContent::Space { .. } = at.block.body {
                at.place[3] = bottom - at.place[1];
            }
        }
        let words = self.words();
        // The pixel size compensates for the rounding of the width to whole pixels.
        let pixel = print.map(|print| match print.width {
            Some(width) => print.pixel * width / total.round(),
            None => print.pixel,
        });
        Ok(draw([total, bottom], pixel, &words, |canvas| {
            let font = Type::new(TITLE, Side::Start, Side::End);
            canvas.text((left, 23.0), self.title, font);
            legend.draw(canvas, left, ABOVE_LEGEND + titled);
            laid.iter().for_each(|block| block.paint(canvas));
        }))
    }

    /// The blocks of all columns below `start`, with room `above` each for a title, and their lower edge.
    fn placed(&self, measures: &[[f64; 3]], start: f64, above: f64) -> (Vec<PlacedBlock<'_>>, f64) {
        let (mut edge, mut bottom) = (0.0, 0.0);
        let mut laid = Vec::new();
        for ((_, blocks), [room, inner, width]) in self.columns.iter().zip(measures) {
            let mut below = start;
            for (i, block) in blocks.iter().enumerate() {
                let own = Legend::new(&block.legend, *inner);
                let shared = block.shares(blocks.get(i + 1));
                let top = below + above + own.height();
                let place = [edge + room, top, *inner, block.height(*inner)];
                below = top + place[3] + block.gap(shared);
                laid.push(PlacedBlock {
                    block,
                    legend: own,
                    place,
                    shared,
                    alone: blocks.len() == 1,
                });
            }
            edge += width;
            bottom = f64::max(bottom, below);
        }
        (laid, bottom)
    }

    /// Takes this height from the panels with equal scales below the first one of a stack, up to half of each.
    fn lower(&mut self, over: f64) {
        let [(width, blocks)] = &mut self.columns[..] else {
            return;
        };
        let [_, inner, _] = measure(*width, blocks);
        let part = over / blocks.len().saturating_sub(1).max(1) as f64;
        for block in blocks.iter_mut().skip(1) {
            let height = block.height(inner);
            if let BlockContent::Plane(plane) = &mut block.body
                && let Height::Equal(least, most) = &mut plane.height
            {
                *most = (height - part).max(0.5 * height).max(*least);
            }
        }
    }

    /// The measures of all columns.
    fn measure(&mut self) -> Vec<[f64; 3]> {
        let columns = self.columns.iter_mut();
        columns
            .map(|(width, blocks)| measure(*width, blocks))
            .collect()
    }

    /// Sets the width of the whole figure, shared in proportion by its columns; columns that would be too
    /// narrow are stacked.
    fn fit(&mut self, width: f64, measures: &[[f64; 3]]) {
        let total: f64 = measures.iter().map(|m| m[2]).sum();
        let widest =
            |measures: &[[f64; 3]]| measures.iter().fold(0.0, |most, m| f64::max(most, m[2]));
        let mut parts: Vec<f64> = measures.iter().map(|m| width * m[2] / total).collect();
        if self.columns.len() > 1 && parts.iter().any(|part| *part < NARROW) {
            let panels = self.columns.iter().map(|(_, blocks)| blocks.len()).max();
            let fewer = ((width / NARROWEST) as usize).clamp(1, self.columns.len());
            let fewer = if self.grid { fewer } else { 1 };
            let mut columns: Vec<_> = std::mem::take(&mut self.columns)
                .into_iter()
                .map(|(_, blocks)| blocks.into_iter())
                .collect();
            if let [first, _] = &mut columns[..]
                && first.len() == 1
                && panels > Some(2)
                && width >= 2.0 * NARROWEST
            {
                // One block over two columns of the panels beside it.
                self.head = first.next();
            }
            let rows = panels.unwrap_or(0);
            let in_order = (0..rows).flat_map(|_| {
                let row: Vec<PageBlock> = columns.iter_mut().filter_map(Iterator::next).collect();
                row
            });
            let blocks: Vec<PageBlock> = in_order.collect();
            let fewer = if self.head.is_some() { 2 } else { fewer };
            let mut dealt: Vec<Vec<PageBlock>> = (0..fewer).map(|_| Vec::new()).collect();
            for (k, block) in blocks.into_iter().enumerate() {
                dealt[k % fewer].push(block);
            }
            let wide = widest(measures);
            self.columns = dealt
                .into_iter()
                .map(|blocks| (Width::Whole(wide), blocks))
                .collect();
            parts = vec![width / fewer as f64; fewer];
            if let Some(head) = &mut self.head {
                let [_, before, _] =
                    measure(Width::Whole(measures[0][2]), std::slice::from_mut(head));
                let [_, after, _] = measure(Width::Whole(width), std::slice::from_mut(head));
                head.stretch(after / before);
            }
        }
        for ((was, blocks), part) in self.columns.iter_mut().zip(parts) {
            let [_, before, _] = measure(*was, blocks);
            *was = Width::Whole(part);
            let [_, after, _] = measure(*was, blocks);
            blocks
                .iter_mut()
                .for_each(|block| block.stretch(after / before));
        }
    }
}

/// Room left of a column's panels, width of the panels, width of the column.
fn measure(width: Width, blocks: &mut [PageBlock]) -> [f64; 3] {
    let bars = blocks.iter().filter_map(|b| b.bar.as_ref());
    let right = ROOM_RIGHT + bars.map(ColourBar::width).fold(0.0, f64::max);
    let mut room: f64 = 0.0;
    let mut inner = 0.0;
    // Widened axes have other numbers, which may be longer.
    for _ in 0..2 {
        room = blocks.iter().map(PageBlock::room).fold(room, f64::max);
        inner = match width {
            Width::Whole(width) => width - room - right,
            Width::Panels(inner) => inner,
        };
        blocks.iter_mut().for_each(|block| block.even(inner));
    }
    [room, inner, room + inner + right]
}

impl PlacedBlock<'_> {
    fn paint(&self, canvas: &mut Canvas) {
        let [left, top, width, height] = self.place;
        let words = top - self.legend.height();
        let font = Type::new(TITLE, Side::Start, Side::End);
        canvas.text((left, words - 5.0), self.block.title, font);
        self.legend.draw(canvas, left, words);
        match &self.block.body {
            BlockContent::Plane(plane) => {
                // Only the lowest of the panels that share an axis has numbers and a name.
                let x = &plane.x;
                let panel = Panel {
                    left,
                    top,
                    width,
                    height,
                    x: if self.shared { x.bare() } else { x.clone() },
                    y: plane.y.clone(),
                };
                if plane.grid {
                    panel.grid(canvas);
                }
                (plane.under)(canvas, &panel);
                let curves = plane.curves.iter();
                curves.clone().for_each(|curve| curve.line(canvas, &panel));
                curves.for_each(|curve| curve.marks(canvas, &panel));
                (plane.over)(canvas, &panel);
                panel.frame(canvas);
            }
            BlockContent::Space { place, paint, .. } => {
                // The words of the box reach to the edges of the column.
                let stage = place([left - INSET, top, width + INSET + ROOM_RIGHT, height]);
                stage.walls(canvas);
                paint(canvas, &stage);
                stage.axes(canvas);
            }
        }
        if let Some(bar) = &self.block.bar {
            let inset = match self.block.body {
                BlockContent::Plane(_) => 0.0,
                BlockContent::Space { .. } => 0.12 * height,
            };
            let right = left + width + ROOM_RIGHT;
            bar.draw(canvas, right, top + inset, top + height - inset);
        }
    }
}
