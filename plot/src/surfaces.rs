//! Solution sheets in space, and motions on them.

use super::axes::extent;
use super::camera::Camera;
use super::canvas::{Canvas, Pen};
use super::data::{AxisUnits, Bounds, Patch, View};
use super::faces::Faces;
use super::geometry::{Point, finite};
use super::legend::{Entry, Key, Mark, draw_mark};
use super::motion::circle;
use super::page::{Page, PageBlock, WIDTH, Width};
use super::palette::{ALARM, BLACK, Colour, GREY, WHITE, category};
use super::paper::Paper;
use super::stage::Stage;
use snaprod_core::error::{Error, Result};

const HEIGHT: f64 = 520.0;
/// Width of panels side by side.
const BESIDE: f64 = 480.0;

/// A named curve in space; points that are not finite break the curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceCurve {
    /// Name in the legend; may be empty.
    pub name: String,
    /// Points of the curve.
    pub points: Vec<[f64; 3]>,
    /// True for a curve of straight rods, drawn black; false for a fold.
    pub straight: bool,
}

impl SpaceCurve {
    fn pen(&self) -> Pen {
        if self.straight { STRAIGHT } else { FOLD }
    }
}

/// Sheets of solutions as surfaces: one panel of a figure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sheets {
    /// Title above the panel; may be empty.
    pub title: String,
    /// The sheets; see [`Patch`] for the resolution to use.
    pub patches: Vec<Patch>,
    /// Folds and other curves on the sheets, drawn in dark red.
    pub curves: Vec<SpaceCurve>,
    /// Viewpoint; by default a side that shows the folds.
    pub view: Option<View>,
    /// The box shown, which cuts everything; by default it holds all points (over the disc, the disc's square).
    pub bounds: Option<Bounds>,
    /// True if positions over the disc are measured along the clamp and across it, as for a turned or moving clamp.
    pub from_clamp: bool,
    /// Units; only figures over the disc use them.
    pub units: AxisUnits,
}

/// Draws sheets in (lam, alpha, theta(1)), panel beside panel with a common legend: points of the patches are
/// such triples. AMV's Fig. 3.22.
///
/// Fails if there is no panel, or one without a patch with finite points.
pub fn sheets_lambda_alpha(panels: &[Sheets], paper: &Paper) -> Result<String> {
    draw_panels(panels, paper, |sheets| {
        Ok(BoxFrame {
            sheets,
            labels: ["λ", "α (rad)", "θ(1) (rad)"].map(String::from),
            view: View {
                azimuth: -26.0,
                elevation: 19.0,
            },
            bounds: bounds_or(sheets.bounds, &sheets.patches)?,
            aspect: ASPECT,
            disc: None,
        })
    })
}

/// Draws sheets over the disc of the free end, panel beside panel with a common legend: points of the patches
/// are (x, y, theta(1)). AMV's Fig. 3.24.
///
/// Fails if there is no panel, or one without a patch with finite points.
pub fn sheets_over_disc(panels: &[Sheets], paper: &Paper) -> Result<String> {
    draw_panels(panels, paper, BoxFrame::over_disc)
}

/// Draws panels in rows of two.
fn draw_panels<'a>(
    panels: &'a [Sheets],
    paper: &Paper,
    frame: impl Fn(&'a Sheets) -> Result<BoxFrame<'a>>,
) -> Result<String> {
    let frames: Vec<BoxFrame> = panels.iter().map(frame).collect::<Result<_>>()?;
    if frames.is_empty() {
        return Err(Error::domain("figure of sheets: no surface to show"));
    }
    let in_row = frames.len().min(2);
    let width = if in_row > 1 { BESIDE } else { WIDTH };
    let mut page = Page::new("Sheets of equilibria", "", vec![entries(panels, None)]);
    for column in 0..in_row {
        let frames = frames.iter().skip(column).step_by(in_row);
        let blocks = frames.map(|frame| frame.block(width, None)).collect();
        page = page.column(Width::Whole(width), blocks);
    }
    page.draw(paper)
}

/// A motion on the sheets over the disc.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PathOnSurface {
    /// The sheets, points (x, y, theta(1)).
    pub sheets: Sheets,
    /// The motion; points that are not finite (as between the ends of a jump) break the path.
    pub path: Vec<[f64; 3]>,
    /// Jumps, each from the fold to the landing.
    pub jumps: Vec<[[f64; 3]; 2]>,
}

/// Draws a motion on the sheets over the disc: parts of the path that lie behind a sheet are thin and dotted,
/// jumps are dashed, the start is a ring and the end a disc.
///
/// Fails if there is no patch or no path with finite points.
pub fn path_on_surface(data: &PathOnSurface, paper: &Paper) -> Result<String> {
    if !data.path.iter().any(|p| p.iter().all(|c| c.is_finite())) {
        return Err(Error::domain("figure of a path on sheets: no path to show"));
    }
    let frame = BoxFrame::over_disc(&data.sheets)?;
    let legend = entries(std::slice::from_ref(&data.sheets), Some(data));
    let page = Page::new("A motion on the sheets of equilibria", "", vec![legend]);
    let block = frame.block(WIDTH, Some(data));
    page.column(Width::Whole(WIDTH), vec![block]).draw(paper)
}

/// Red for folds and snaps as in the plane figures; darker, for contrast on every sheet.
const FOLD: Pen = Pen::new(Colour(150, 10, 40), 1.4);
const STRAIGHT: Pen = Pen::new(BLACK, 1.4);
const PATH: Pen = Pen::new(BLACK, 1.8);
const JUMP: Pen = Pen::new(ALARM, 1.5).dashed(5.0, 3.5);

/// The pen of a line on its hidden parts.
fn behind(pen: Pen) -> Pen {
    Pen {
        width: 0.6 * pen.width,
        alpha: 0.55,
        dash: Some((1.6, 2.6)),
        ..pen
    }
}

/// The edges of a box before the camera.
const ASPECT: Point = [1.0, 1.0, 0.85];

/// Common parts of the figures of sheets.
struct BoxFrame<'a> {
    sheets: &'a Sheets,
    labels: [String; 3],
    /// Default viewpoint.
    view: View,
    bounds: Bounds,
    aspect: Point,
    /// Radius of a disc to draw on the floor.
    disc: Option<f64>,
}

impl<'a> BoxFrame<'a> {
    fn over_disc(sheets: &'a Sheets) -> Result<Self> {
        let units = &sheets.units;
        let radius = units.radius();
        let heights = bounds_or(sheets.bounds, &sheets.patches)?[2];
        let flat = [-1.05 * radius, 1.05 * radius];
        let bounds = sheets.bounds.unwrap_or([flat, flat, heights]);
        let [along, across] = if sheets.from_clamp {
            ["along the clamp", "across it"]
        } else {
            ["x", "y"]
        };
        let end = if radius == 1.0 { "1" } else { "L" };
        // Equal scales for both positions, whatever the requested box.
        let [w, h] = [0, 1].map(|i| bounds[i][1] - bounds[i][0]);
        Ok(Self {
            sheets,
            labels: [
                units.length_of(along),
                units.length_of(across),
                format!("θ({end}) (rad)"),
            ],
            view: View {
                azimuth: -62.0,
                elevation: 21.0,
            },
            bounds,
            aspect: [w / w.max(h), h / w.max(h), ASPECT[2]],
            disc: Some(radius),
        })
    }

    /// The box with everything in it, of a width in pixels.
    fn block(&'a self, width: f64, motion: Option<&'a PathOnSurface>) -> PageBlock<'a> {
        let camera = Camera::new(self.sheets.view.unwrap_or(self.view), f64::INFINITY);
        let stage = move |place| {
            Stage::seen(
                self.bounds,
                &self.labels,
                self.aspect,
                camera.clone(),
                place,
            )
        };
        let mut block = PageBlock::space(width * HEIGHT / WIDTH, stage, move |canvas, stage| {
            let mut scene = Faces::new(stage.clone());
            if let Some(radius) = self.disc {
                let floor = self.bounds[2][0];
                let rim = circle(radius);
                let rim = rim.points().map(|(x, y)| [x, y, floor]);
                let pen = Pen::new(GREY, 0.9);
                scene.curve(canvas, &rim.collect::<Vec<_>>(), pen, pen);
            }
            scene.pale(if motion.is_some() { 0.35 } else { 0.0 });
            for patch in &self.sheets.patches {
                scene.add(patch);
            }
            scene.paint(canvas);
            for curve in &self.sheets.curves {
                scene.curve(canvas, &curve.points, curve.pen(), behind(curve.pen()));
            }
            if let Some(motion) = motion {
                draw_motion(canvas, &scene, motion);
            }
        });
        block.title = &self.sheets.title;
        block
    }
}

fn draw_motion(canvas: &mut Canvas, scene: &Faces, motion: &PathOnSurface) {
    let halo = Pen::new(WHITE, 3.2).alpha(0.8);
    scene.curve(canvas, &motion.path, halo, halo.alpha(0.0));
    scene.curve(canvas, &motion.path, PATH, behind(PATH));
    for jump in &motion.jumps {
        scene.curve(canvas, jump, JUMP, behind(JUMP));
        for (end, mark) in jump.iter().zip([Mark::Cross, Mark::Disc]) {
            let (at, seen) = scene.spot(*end);
            let (size, pale) = if seen { (3.6, 0.0) } else { (2.6, 0.45) };
            if finite(&at) {
                draw_mark(canvas, at, mark, size, ALARM.tint(pale));
            }
        }
    }
    let mut seen = motion
        .path
        .iter()
        .filter(|p| p.iter().all(|c| c.is_finite()));
    let (start, end) = (seen.clone().next(), seen.next_back());
    for (point, mark) in [(start, Mark::Ring), (end, Mark::Disc)] {
        if let Some(point) = point {
            draw_mark(canvas, scene.spot(*point).0, mark, 4.0, BLACK);
        }
    }
}

fn entries(panels: &[Sheets], motion: Option<&PathOnSurface>) -> Vec<Entry> {
    let pale = if motion.is_some() { 0.35 } else { 0.12 };
    let all = || panels.iter().flat_map(|sheets| &sheets.patches);
    let drawn = |stable: bool| move |patch: &&Patch| patch.shows(stable);
    let patches = all().filter(drawn(true)).map(|patch| {
        let fill = Key::Fill(category(patch.colour).tint(pale));
        (patch.name.clone(), fill)
    });
    let unstable = all().filter(drawn(false));
    let unstable = unstable.map(|patch| {
        let fill = Key::Fill(category(patch.colour).unstable().tint(pale));
        let name = format!("{} unstable", patch.name);
        (name.trim_start().to_owned(), fill)
    });
    let curves = panels.iter().flat_map(|sheets| &sheets.curves);
    let curves = curves.map(|curve| (curve.name.clone(), Key::Line(curve.pen())));
    let moving = [
        ("motion", Key::Line(PATH)),
        ("start", Key::Mark(Mark::Ring, BLACK)),
        ("end", Key::Mark(Mark::Disc, BLACK)),
        ("snap", Key::Line(JUMP)),
    ];
    let moving = moving.into_iter().take(match motion {
        None => 0,
        Some(motion) if motion.jumps.is_empty() => 3,
        Some(_) => 4,
    });
    let moving = moving.map(|(name, key)| (name.to_owned(), key));
    let mut entries: Vec<Entry> = Vec::new();
    for (name, key) in patches.chain(unstable).chain(curves).chain(moving) {
        if !(name.is_empty() || entries.iter().any(|entry| entry.text() == name)) {
            entries.push(Entry::new(key, name));
        }
    }
    entries
}

/// The requested box, or the bounding box of all finite points.
fn bounds_or(asked: Option<Bounds>, patches: &[Patch]) -> Result<Bounds> {
    let sound = patches.iter().filter(|patch| patch.is_sound());
    let points = sound
        .flat_map(|p| &p.points)
        .filter(|p| p.iter().all(|c| c.is_finite()));
    let mut bounds = [[0.0; 2]; 3];
    for (axis, range) in bounds.iter_mut().enumerate() {
        let (lo, hi) = extent(points.clone().map(|p| &p[axis]))
            .ok_or_else(|| Error::domain("figure of sheets: no surface to show"))?;
        let margin = if hi > lo { 0.0 } else { lo.abs().max(1.0) };
        *range = [lo - margin, hi + margin];
    }
    let bounds = asked.unwrap_or(bounds);
    if bounds
        .iter()
        .all(|r| r[1] > r[0] && (r[1] - r[0]).is_finite())
    {
        Ok(bounds)
    } else {
        Err(Error::domain("figure of sheets: the box to show is empty"))
    }
}
