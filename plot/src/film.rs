//! Films of rods and bodies: a drawing for each frame, over one box, and all of them as one moving SVG.

use super::axes::{Axis, Panel, extent};
use super::canvas::{Canvas, Pen};
use super::data::AxisUnits;
use super::geometry::Pixel;
use super::motion::wall;
use super::page::{Height, Page, PageBlock, WIDTH, Width};
use super::painter::Painter;
use super::palette::{ALARM, Colour, GREY, INK, category};
use super::paper::Paper;
use super::scenery::{GROOVE, Ground, OBSTACLE, Scenery, SpaceBody, SpaceRod};
use snaprod_core::error::{Error, Result};
use std::fmt::Write;

/// One frame of a film.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FilmFrame {
    /// Words over the frame, as for example the time.
    pub words: String,
    /// Seconds for which the frame is shown.
    pub seconds: f64,
    /// The rods.
    pub rods: Vec<SpaceRod>,
    /// The bodies.
    pub bodies: Vec<SpaceBody>,
    /// Forces of contacts, each from the place to the end of the arrow.
    pub forces: Vec<[[f64; 3]; 2]>,
    /// True while a rod falls: it then has another colour.
    pub falls: bool,
}

/// A motion as frames, and what stands still.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FilmFigure {
    /// The frames, in order.
    pub frames: Vec<FilmFrame>,
    /// Paths of the bodies.
    pub paths: Vec<Vec<[f64; 3]>>,
    /// Lines on obstacles.
    pub obstacles: Vec<Vec<[f64; 3]>>,
    /// Curves that bodies slide in.
    pub grooves: Vec<Vec<[f64; 3]>>,
    /// True for a motion in the plane z = 0, drawn over x and y; otherwise in perspective.
    pub planar: bool,
    /// Units.
    pub units: AxisUnits,
}

const PATH: Pen = Pen::new(Colour(150, 150, 150), 0.9);
const FORCE: Pen = Pen::new(ALARM, 1.8);
const BODY: Colour = Colour(110, 110, 110);
const FALLING: Colour = Colour(213, 94, 0);
/// Most rods by which the box and the viewpoint of a film in space are chosen.
const SEEN: usize = 200;

/// Draws each frame as SVG. All frames have one size, one box and one viewpoint.
///
/// # Errors
/// A film without a rod or a body that has a finite point.
pub fn film(data: &FilmFigure, paper: &Paper) -> Result<Vec<String>> {
    let frames = data.frames.iter();
    if data.planar {
        let axes = plane_axes(data)?;
        return frames
            .map(|frame| in_plane(data, frame, &axes, paper))
            .collect();
    }
    let all: Vec<&SpaceRod> = data.frames.iter().flat_map(|frame| &frame.rods).collect();
    let every = all.len().div_ceil(SEEN).max(1);
    let some: Vec<SpaceRod> = all
        .iter()
        .step_by(every)
        .map(|rod| (*rod).clone())
        .collect();
    let mut scenery = Scenery::new(&some, 0.0, false, false)?;
    scenery.shadow = false;
    for frame in &data.frames {
        let corners = frame.bodies.iter().filter_map(SpaceBody::corners);
        scenery.hold(&corners.flatten().collect::<Vec<_>>());
        for rod in &frame.rods {
            scenery.hold(&rod.points);
        }
    }
    for line in data
        .paths
        .iter()
        .chain(&data.grooves)
        .chain(&data.obstacles)
    {
        scenery.hold(line);
    }
    frames
        .map(|frame| in_space(data, frame, &scenery, paper))
        .collect()
}

/// Points of everything that moves or stands in a film.
fn points(data: &FilmFigure) -> impl Iterator<Item = [f64; 3]> + '_ {
    let moving = data.frames.iter().flat_map(|frame| {
        let rods = frame.rods.iter().flat_map(|rod| rod.points.iter().copied());
        let bodies = frame.bodies.iter().flat_map(|body| match body.corners() {
            Some(corners) => corners.to_vec(),
            None => vec![body.centre],
        });
        rods.chain(bodies)
    });
    moving.chain(data.grooves.iter().flatten().copied())
}

fn plane_axes(data: &FilmFigure) -> Result<[Axis; 2]> {
    let axis = |i: usize, name: &str| -> Result<Axis> {
        let values: Vec<f64> = points(data).map(|p| p[i]).collect();
        let (low, high) = extent(&values)
            .ok_or_else(|| Error::domain("a film without a rod or a body to show"))?;
        let room = (0.06 * (high - low)).max(0.1 * data.units.radius());
        Ok(Axis::linear(
            low - room,
            high + room,
            &data.units.length_of(name),
            5,
        ))
    };
    Ok([axis(0, "x")?, axis(1, "y")?])
}

fn colour(frame: &FilmFrame, i: usize) -> Colour {
    if frame.falls { FALLING } else { category(i) }
}

fn in_plane(
    data: &FilmFigure,
    frame: &FilmFrame,
    [x, y]: &[Axis; 2],
    paper: &Paper,
) -> Result<String> {
    let block = PageBlock::plane(
        x.clone(),
        y.clone(),
        Height::Equal(160.0, 520.0),
        Vec::new(),
    );
    let block = block.over(|canvas, panel| {
        let at = |p: &[f64; 3]| panel.at(p[0], p[1]);
        let line = |canvas: &mut Canvas, points: &[[f64; 3]], pen: Pen| {
            let pixels: Vec<Pixel> = points.iter().map(at).collect();
            panel.pixel_line(canvas, &pixels, pen);
        };
        let still = [
            (&data.grooves, GROOVE),
            (&data.obstacles, OBSTACLE),
            (&data.paths, PATH),
        ];
        for (lines, pen) in still {
            lines.iter().for_each(|points| line(canvas, points, pen));
        }
        for (i, rod) in frame.rods.iter().enumerate() {
            line(canvas, &rod.points, Pen::new(colour(frame, i), 3.2));
            supports(canvas, panel, rod);
        }
        for body in &frame.bodies {
            body_in_plane(canvas, panel, body);
        }
        for force in &frame.forces {
            line(canvas, force, FORCE);
            canvas.disc(at(&force[0]), 2.6, ALARM, 1.0);
        }
    });
    let page = Page::new("A frame of a film", &frame.words, Vec::new());
    page.column(Width::Whole(WIDTH), vec![block]).draw(paper)
}

/// Clamps and joints on the ground.
fn supports(canvas: &mut Canvas, panel: &Panel, rod: &SpaceRod) {
    let Some((first, last)) = rod.ends() else {
        return;
    };
    let inner = |k: usize| {
        if k == first {
            first + 1
        } else {
            last.saturating_sub(1)
        }
    };
    for (k, ground) in [first, last].into_iter().zip(rod.ground) {
        let at = |k: usize| rod.points.get(k).map(|p| panel.at(p[0], p[1]));
        let (Some(held), Some(next)) = (at(k), at(inner(k))) else {
            continue;
        };
        match ground {
            Some(Ground::Clamp) => wall(canvas, held, next, 13.0),
            Some(Ground::Ball) => canvas.disc(held, 4.5, INK, 1.0),
            None => {}
        }
    }
}

fn body_in_plane(canvas: &mut Canvas, panel: &Panel, body: &SpaceBody) {
    let at = |p: [f64; 3]| panel.at(p[0], p[1]);
    let Some(corners) = body.corners() else {
        return canvas.disc(at(body.centre), 7.0, INK, 1.0);
    };
    const FACES: [[usize; 4]; 6] = [
        [0, 1, 2, 3],
        [4, 5, 6, 7],
        [0, 1, 5, 4],
        [1, 2, 6, 5],
        [2, 3, 7, 6],
        [3, 0, 4, 7],
    ];
    // A body in the plane shows one face, whichever of its axes is across.
    for face in FACES {
        let ring = face.map(|k| at(corners[k]));
        canvas.polygon(&ring, BODY, 1.0);
        canvas.line(
            &[ring[0], ring[1], ring[2], ring[3], ring[0]],
            Pen::new(INK, 0.9),
        );
    }
}

fn in_space(
    data: &FilmFigure,
    frame: &FilmFrame,
    scenery: &Scenery,
    paper: &Paper,
) -> Result<String> {
    const HEIGHT: f64 = 500.0;
    let stage = |place: [f64; 4]| scenery.stage(&data.units, place);
    let needed = stage([0.0, 0.0, WIDTH, HEIGHT]).height();
    let block = PageBlock::space(needed.clamp(160.0, HEIGHT), stage, |canvas, stage| {
        let mut painter = Painter::new(stage, !scenery.plane);
        let still = [
            (&data.grooves, GROOVE),
            (&data.obstacles, OBSTACLE),
            (&data.paths, PATH),
        ];
        for (lines, pen) in still {
            lines.iter().for_each(|points| painter.path(points, pen));
        }
        for (i, rod) in frame.rods.iter().enumerate() {
            painter.rod(rod, colour(frame, i), scenery);
        }
        for body in &frame.bodies {
            painter.body(body, GREY);
        }
        for [from, to] in &frame.forces {
            painter.arrow(*from, *to, FORCE, 1);
        }
        painter.paint(canvas);
    });
    let page = Page::new("A frame of a film", &frame.words, Vec::new());
    page.column(Width::Whole(WIDTH), vec![block]).draw(paper)
}

/// Makes one moving SVG of the drawings of all frames, each shown for its seconds, over and over. What all frames have
/// in common at their begin and end is drawn once.
///
/// # Errors
/// No frame, or not one time for each frame.
pub fn moving(frames: &[String], seconds: &[f64]) -> Result<String> {
    let (Some(first), true) = (frames.first(), frames.len() == seconds.len()) else {
        return Err(Error::domain(
            "a film needs frames, and the seconds of each",
        ));
    };
    let all: Vec<Vec<&str>> = frames.iter().map(|svg| elements(svg)).collect();
    let common = |from: &dyn Fn(&[&str], usize) -> Option<String>| {
        let same = |k: usize| {
            let of = from(&all[0], k);
            of.is_some() && all.iter().all(|other| from(other, k) == of)
        };
        (0..all[0].len()).take_while(|k| same(*k)).count()
    };
    let ahead = common(&|all, k| all.get(k).map(|x| (*x).to_owned()));
    let shortest = all.iter().map(Vec::len).min().unwrap_or(0);
    let behind = common(&|all, k| all.iter().rev().nth(k).map(|x| (*x).to_owned()));
    let behind = behind.min(shortest - ahead.min(shortest));
    if frames.len() == 1 || ahead == 0 {
        return Ok(first.clone());
    }
    let whole: f64 = seconds.iter().sum();
    let mut svg = all[0][..ahead].concat();
    let mut begun = 0.0;
    for (frame, seconds) in all.iter().zip(seconds) {
        let (from, to) = (begun / whole, (begun + seconds) / whole);
        begun += seconds;
        // The first frame is what a reader without animation shows.
        let hidden = if from == 0.0 {
            ""
        } else {
            " visibility=\"hidden\""
        };
        let (values, times) = match (from > 0.0, to < 1.0 - 1e-9) {
            (true, true) => ("hidden;visible;hidden", format!("0;{from:.5};{to:.5}")),
            (true, false) => ("hidden;visible", format!("0;{from:.5}")),
            (false, _) => ("visible;hidden", format!("0;{to:.5}")),
        };
        let moving = frame[ahead..frame.len() - behind].concat();
        let _ = write!(
            svg,
            "<g{hidden}><animate attributeName=\"visibility\" dur=\"{whole:.2}s\" repeatCount=\"indefinite\" calcMode=\"discrete\" \
             keyTimes=\"{times}\" values=\"{values}\"/>\n{moving}</g>\n"
        );
    }
    svg += &all[0][all[0].len() - behind..].concat();
    Ok(svg)
}

/// The elements of a drawing, each with the end of the line; a text is one with all letters.
fn elements(svg: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = svg;
    while !rest.is_empty() {
        let end = if rest.starts_with("<text") {
            rest.find("</text>").map(|k| k + "</text>".len())
        } else {
            None
        };
        let from = end.unwrap_or(0);
        let end = rest[from..].find('\n').map_or(rest.len(), |k| from + k + 1);
        let (one, others) = rest.split_at(end);
        found.push(one);
        rest = others;
    }
    found
}
