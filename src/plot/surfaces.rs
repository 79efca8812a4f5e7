//! Solution sheets in space, and motions on them.

use super::axes::{Mark, TITLE, draw_mark, extent};
use super::camera::Point;
use super::canvas::{Canvas, Pen, Side, Type, draw};
use super::data::{AxisUnits, Bounds, Patch, View};
use super::faces::Faces;
use super::legend::{Entry, Key, Legend};
use super::motion::circle;
use super::page::{ABOVE_LEGEND, WIDTH, head};
use super::palette::{ALARM, BLACK, Colour, GREY, category};
use super::stage::Stage;
use crate::error::{Error, Result};

const HEIGHT: f64 = 520.0;
/// Width of a panel beside another.
const BESIDE: f64 = 480.0;

/// A named curve in space; a point that is not finite breaks it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpaceCurve {
    /// Its name in the legend; may be empty.
    pub name: String,
    /// Its points.
    pub points: Vec<[f64; 3]>,
}

/// Sheets of solutions as surfaces: one panel of a figure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sheets {
    /// What stands above the panel; may be empty.
    pub title: String,
    /// The sheets; see [`Patch`] for the resolution to use.
    pub patches: Vec<Patch>,
    /// Curves drawn in dark red on them: folds.
    pub curves: Vec<SpaceCurve>,
    /// Where from; by default a side that shows the folds.
    pub view: Option<View>,
    /// The box shown, at which everything is cut; by default what holds all points (over the disc, the
    /// disc's square).
    pub bounds: Option<Bounds>,
    /// Units; only figures over the disc use them.
    pub units: AxisUnits,
}

/// Draws sheets in (lam, alpha, theta(1)), panel beside panel with a common legend: points of the patches are
/// such triples. AMV's Fig. 3.22.
///
/// Errs if there is no panel, or one without a patch with finite points.
pub fn sheets_lambda_alpha(panels: &[Sheets]) -> Result<String> {
    let frame = |data: &Sheets| {
        Ok(Frame {
            labels: ["λ", "α (rad)", "θ(1) (rad)"].map(String::from),
            aspect: [1.0, 1.0, 0.85],
            view: data.view.unwrap_or(View {
                azimuth: -26.0,
                elevation: 19.0,
            }),
            bounds: bounds_or(data.bounds, &data.patches)?,
            disc: None,
        })
    };
    draw_panels(panels, frame)
}

/// Draws sheets over the disc of the free end, panel beside panel with a common legend: points of the patches
/// are (x, y, theta(1)). AMV's Fig. 3.24.
///
/// Errs if there is no panel, or one without a patch with finite points.
pub fn sheets_over_disc(panels: &[Sheets]) -> Result<String> {
    draw_panels(panels, |data| {
        Frame::over_disc(data.bounds, &data.patches, data.view, &data.units)
    })
}

/// Panels in rows of two.
fn draw_panels(panels: &[Sheets], frame: impl Fn(&Sheets) -> Result<Frame>) -> Result<String> {
    let frames: Vec<Frame> = panels.iter().map(frame).collect::<Result<_>>()?;
    if frames.is_empty() {
        return Err(Error::domain("figure of sheets: no surface to show"));
    }
    let in_row = frames.len().min(2);
    let width = if in_row > 1 { BESIDE } else { WIDTH };
    let height = width * HEIGHT / WIDTH;
    let patches: Vec<&Patch> = panels.iter().flat_map(|p| &p.patches).collect();
    let curves: Vec<&SpaceCurve> = panels.iter().flat_map(|p| &p.curves).collect();
    let total = in_row as f64 * width;
    let legend = Legend::new(entries(&patches, &curves, None), total - 60.0);
    let titled = panels.iter().any(|p| !p.title.is_empty());
    let step = height + if titled { 22.0 } else { 0.0 };
    let top = ABOVE_LEGEND + legend.height();
    let rows = frames.len().div_ceil(in_row);
    Ok(draw(total, top + rows as f64 * step, |canvas| {
        head(canvas, "", &legend, 30.0);
        for (i, (frame, data)) in frames.iter().zip(panels).enumerate() {
            let left = (i % in_row) as f64 * width;
            let bottom = top + (i / in_row + 1) as f64 * step;
            let font = Type::new(TITLE, Side::Start, Side::Middle);
            canvas.text((left + 30.0, bottom - step + 14.0), &data.title, font);
            let place = [left, bottom - height, width, height];
            frame.draw(canvas, place, &data.patches, &data.curves, None);
        }
    }))
}

/// A motion on the sheets over the disc.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PathOnSurface {
    /// The sheets, points (x, y, theta(1)).
    pub patches: Vec<Patch>,
    /// Folds of the sheets.
    pub folds: Vec<SpaceCurve>,
    /// The motion; a point that is not finite (as between the two ends of a jump) breaks it.
    pub path: Vec<[f64; 3]>,
    /// Jumps, each from the fold to the landing.
    pub jumps: Vec<[[f64; 3]; 2]>,
    /// Where from; by default a side that shows the folds.
    pub view: Option<View>,
    /// The box shown, at which everything is cut; by default the disc's square and all heights.
    pub bounds: Option<Bounds>,
    /// Units.
    pub units: AxisUnits,
}

/// Draws a motion on the sheets over the disc: parts of the path that lie behind a sheet are thin and
/// dotted, jumps are dashed, the start is a ring and the end a disc.
///
/// Errs if there is no patch or no path with finite points.
pub fn path_on_surface(data: &PathOnSurface) -> Result<String> {
    if !data.path.iter().any(|p| p.iter().all(|c| c.is_finite())) {
        return Err(Error::domain("figure of a path on sheets: no path to show"));
    }
    let frame = Frame::over_disc(data.bounds, &data.patches, data.view, &data.units)?;
    let patches: Vec<&Patch> = data.patches.iter().collect();
    let folds: Vec<&SpaceCurve> = data.folds.iter().collect();
    let legend = Legend::new(entries(&patches, &folds, Some(data)), WIDTH - 60.0);
    let top = ABOVE_LEGEND + legend.height();
    Ok(draw(WIDTH, top + HEIGHT, |canvas| {
        head(canvas, "", &legend, 30.0);
        let place = [0.0, top, WIDTH, HEIGHT];
        frame.draw(canvas, place, &data.patches, &data.folds, Some(data));
    }))
}

/// Red for folds and snaps as in the plane figures; darker, to be seen on every sheet.
const FOLD: Pen = Pen::new(Colour(150, 10, 40), 1.4);
const PATH: Pen = Pen::new(BLACK, 1.8);
const JUMP: Pen = Pen::new(ALARM, 1.5).dashed(5.0, 3.5);

/// The same line where it is hidden.
fn behind(pen: Pen) -> Pen {
    Pen {
        width: 0.6 * pen.width,
        alpha: 0.55,
        dash: Some((1.6, 2.6)),
        ..pen
    }
}

/// What the figures of sheets have in common.
struct Frame {
    labels: [String; 3],
    aspect: Point,
    view: View,
    bounds: Bounds,
    /// Draw the disc of this radius on the floor.
    disc: Option<f64>,
}

impl Frame {
    fn over_disc(
        bounds: Option<Bounds>,
        patches: &[Patch],
        view: Option<View>,
        units: &AxisUnits,
    ) -> Result<Self> {
        let radius = units.radius();
        let heights = bounds_or(bounds, patches)?;
        let flat = [-1.05 * radius, 1.05 * radius];
        Ok(Self {
            labels: [
                units.length_of("x"),
                units.length_of("y"),
                "θ(1) (rad)".into(),
            ],
            aspect: [1.0, 1.0, 0.85],
            view: view.unwrap_or(View {
                azimuth: -62.0,
                elevation: 21.0,
            }),
            bounds: bounds.unwrap_or([flat, flat, heights[2]]),
            disc: Some(radius),
        })
    }

    /// Draws into the rectangle [left, top, width, height].
    fn draw(
        &self,
        canvas: &mut Canvas,
        place: [f64; 4],
        patches: &[Patch],
        curves: &[SpaceCurve],
        motion: Option<&PathOnSurface>,
    ) {
        let floor = self.bounds[2][0];
        let [x, y, _] = self.bounds;
        // Equal scales for two positions, whatever box was asked for.
        let aspect = match self.disc {
            Some(_) => {
                let (w, h) = (x[1] - x[0], y[1] - y[0]);
                [w / w.max(h), h / w.max(h), self.aspect[2]]
            }
            None => self.aspect,
        };
        let stage = Stage::parallel(self.bounds, &self.labels, aspect, self.view, place);
        stage.walls(canvas);
        let mut scene = Faces::new(stage.clone());
        if let Some(radius) = self.disc {
            let rim = circle(radius);
            let rim: Vec<Point> = rim
                .x
                .iter()
                .zip(&rim.y)
                .map(|(x, y)| [*x, *y, floor])
                .collect();
            let pen = Pen::new(GREY, 0.9);
            scene.curve(canvas, &rim, pen, pen);
        }
        scene.pale(if motion.is_some() { 0.35 } else { 0.0 });
        for patch in patches {
            scene.add(patch);
        }
        scene.paint(canvas);
        for curve in curves {
            scene.curve(canvas, &curve.points, FOLD, behind(FOLD));
        }
        if let Some(motion) = motion {
            draw_motion(canvas, &scene, motion);
        }
        stage.axes(canvas);
    }
}

fn draw_motion(canvas: &mut Canvas, scene: &Faces, motion: &PathOnSurface) {
    let halo = Pen::new(Colour(255, 255, 255), 3.2).alpha(0.8);
    let none = Pen::new(Colour(255, 255, 255), 0.1).alpha(0.0);
    scene.curve(canvas, &motion.path, halo, none);
    scene.curve(canvas, &motion.path, PATH, behind(PATH));
    for jump in &motion.jumps {
        scene.curve(canvas, jump, JUMP, behind(JUMP));
        for (end, mark) in jump.iter().zip([Mark::Cross, Mark::Disc]) {
            let (at, seen) = scene.spot(*end);
            if at.0.is_finite() && at.1.is_finite() {
                let colour = if seen { ALARM } else { ALARM.tint(0.45) };
                draw_mark(canvas, at, mark, if seen { 3.6 } else { 2.6 }, colour);
            }
        }
    }
    let finite = |p: &&Point| p.iter().all(|c| c.is_finite());
    if let Some(start) = motion.path.iter().find(finite) {
        draw_mark(canvas, scene.spot(*start).0, Mark::Ring, 4.0, BLACK);
    }
    if let Some(end) = motion.path.iter().rev().find(finite) {
        draw_mark(canvas, scene.spot(*end).0, Mark::Disc, 4.0, BLACK);
    }
}

fn entries(
    patches: &[&Patch],
    curves: &[&SpaceCurve],
    motion: Option<&PathOnSurface>,
) -> Vec<Entry> {
    let mut names: Vec<&str> = Vec::new();
    let mut entries = Vec::new();
    for patch in patches {
        if !patch.name.is_empty() && !names.contains(&patch.name.as_str()) {
            names.push(&patch.name);
            let pale = if motion.is_some() { 0.35 } else { 0.12 };
            let fill = category(patch.colour).tint(pale);
            entries.push(Entry::new(Key::Fill(fill), patch.name.as_str()));
        }
    }
    for curve in curves {
        if !curve.name.is_empty() && !names.contains(&curve.name.as_str()) {
            names.push(&curve.name);
            entries.push(Entry::new(Key::Line(FOLD), curve.name.as_str()));
        }
    }
    if let Some(motion) = motion {
        entries.push(Entry::new(Key::Line(PATH), "motion"));
        entries.push(Entry::new(Key::Mark(Mark::Ring, BLACK), "start"));
        entries.push(Entry::new(Key::Mark(Mark::Disc, BLACK), "end"));
        if !motion.jumps.is_empty() {
            entries.push(Entry::new(Key::Line(JUMP), "snap"));
        }
    }
    entries
}

/// The box asked for, or the one that holds all finite points.
fn bounds_or(asked: Option<Bounds>, patches: &[Patch]) -> Result<Bounds> {
    let nothing = || Error::domain("figure of sheets: no surface to show");
    let mut bounds = [[0.0; 2]; 3];
    let sound: Vec<&Patch> = patches.iter().filter(|patch| patch.is_sound()).collect();
    for (axis, range) in bounds.iter_mut().enumerate() {
        let values = sound
            .iter()
            .flat_map(|p| p.points.iter())
            .filter(|p| p.iter().all(|c| c.is_finite()))
            .map(|p| &p[axis]);
        let (lo, hi) = extent(values).ok_or_else(nothing)?;
        let margin = if hi > lo { 0.0 } else { lo.abs().max(1.0) };
        *range = [lo - margin, hi + margin];
    }
    let Some(asked) = asked else {
        return Ok(bounds);
    };
    if asked
        .iter()
        .all(|r| r[1] > r[0] && (r[1] - r[0]).is_finite())
    {
        Ok(asked)
    } else {
        Err(Error::domain("figure of sheets: the box to show is empty"))
    }
}
