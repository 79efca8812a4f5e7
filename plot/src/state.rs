//! Figure of one equilibrium of a rod in space: shape, and couples, forces and strains along the rod.

use super::axes::{Axis, extent};
use super::canvas::Pen;
use super::data::{AxisUnits, View, with_unit};
use super::geometry::{Point, along, dot, unit};
use super::legend::{Entry, Key, PlottedCurve, named};
use super::page::{Height, Page, PageBlock, Width};
use super::painter::Painter;
use super::palette::{ALARM, Colour, GREY, category};
use super::paper::Paper;
use super::scenery::{OBSTACLE, OBSTACLE_NAME, Scenery, SpaceRod};
use super::text;
use snaprod_core::error::{Error, Result};

/// One equilibrium. The lists over s are as long as `s`, or empty to leave their panel out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RodState {
    /// Title over the figure; may be empty.
    pub title: String,
    /// The shape; grey by default, since the directors have the colours of their components.
    pub rod: SpaceRod,
    /// Width of the strip along d1, as a length; 0 for a line alone.
    pub ribbon: f64,
    /// Points of the tendons beside the rod.
    pub tendons: Vec<Vec<[f64; 3]>>,
    /// Lines on obstacles.
    pub obstacles: Vec<Vec<[f64; 3]>>,
    /// Contacts with obstacles: place on the rod, and the unit normal along which the obstacle presses.
    pub contacts: Vec<[[f64; 3]; 2]>,
    /// The load on the end, in the frame of space: the force n at the last point.
    pub end_force: Option<[f64; 3]>,
    /// The couple m at the last point, in the frame of space.
    pub end_couple: Option<[f64; 3]>,
    /// Arclength (of the reference configuration).
    pub s: Vec<f64>,
    /// Couples m1, m2, m3 along the directors.
    pub couples: Vec<[f64; 3]>,
    /// Forces n1, n2, n3 along the directors.
    pub forces: Vec<[f64; 3]>,
    /// Curvatures u1, u2 and twist u3.
    pub curvatures: Vec<[f64; 3]>,
    /// Shears v1, v2 and stretch v3 (drawn is v3 - 1).
    pub stretches: Vec<[f64; 3]>,
    /// Bending stiffness of the rod, the scale for roundoff of forces and couples; 0 if unknown.
    pub stiffness: f64,
    /// Viewpoint; by default the side from which the shape is seen best.
    pub view: Option<View>,
    /// Units.
    pub units: AxisUnits,
}

const FORCE: Colour = ALARM;
const COUPLE: Colour = Colour(110, 40, 140);
const CONTACT: Pen = Pen::new(Colour(20, 120, 60), 2.0);
const TENDON: Pen = Pen::new(Colour(150, 90, 30), 1.2);
/// Pen of components and loads that vanish.
const ZERO: Pen = Pen::new(GREY, 0.9);
/// Size, relative to the loads, below which components are roundoff.
const ROUNDOFF: f64 = 1e-9;

/// Draws one equilibrium as SVG. At the left: its shape in perspective with the force (one head) and the
/// couple (two heads) on its end. At the right: its couples, forces and strains along s. A component that
/// vanishes is a thin grey line. An arrow that presses on the rod has its tip at the rod's end; arrows are of
/// one length, and the legend gives their sizes.
///
/// Fails if the rod has no finite point, if a list is not as long as `s`, or if `s` has no finite number for a list.
pub fn rod_state(data: &RodState, paper: &Paper) -> Result<String> {
    const LEFT: f64 = 440.0;
    const RIGHT: f64 = 420.0;
    let blocks = blocks(data)?;
    let rods = std::slice::from_ref(&data.rod);
    let mut scenery = Scenery::new(rods, data.ribbon, true, true)?;
    let loads = [(data.end_force, 1, FORCE), (data.end_couple, 2, COUPLE)];
    let sizes = scales(data);
    let mut arrows = Vec::new();
    let mut entries: Vec<Entry> = Vec::new();
    for (i, (load, heads, colour)) in loads.into_iter().enumerate() {
        let Some(load) = load.filter(|l| l.iter().all(|c| c.is_finite())) else {
            continue;
        };
        let (name, letter, unit_name) = [
            ("end force", "n", &data.units.force),
            ("end couple", "m", &data.units.couple),
        ][i];
        let size = dot(load, load).sqrt();
        let way = unit(load).filter(|_| size > ROUNDOFF * sizes[i]);
        let pen = Pen::new(colour, 2.4);
        let entry = match way {
            Some(_) => {
                let size = text::short(size, 3);
                let text = format!("{name} |{letter}| = {size} {unit_name}");
                Entry::new(Key::Line(pen), text)
            }
            None => Entry::new(Key::Line(ZERO), format!("{name} {letter} = 0")),
        };
        entries.push(entry);
        if let (Some(way), Some((_, last))) = (way, data.rod.ends()) {
            let length = if heads == 1 { 2.2 } else { 1.6 } * scenery.arm;
            let end = data.rod.points[last];
            let ahead = data.rod.heading(last);
            let presses = heads == 1 && ahead.is_some_and(|d| dot(d, way) < -0.25);
            let gap = 0.2 * scenery.arm;
            let ends = if presses {
                [along(end, -gap - length, way), along(end, -gap, way)]
            } else {
                [end, along(end, length, way)]
            };
            scenery.hold(&ends);
            // The name stands at the free end of the arrow.
            let name = if presses { ends[0] } else { ends[1] };
            arrows.push((ends, pen, heads, name, letter));
        }
    }
    if data.tendons.iter().any(|path| !path.is_empty()) {
        entries.push(Entry::new(Key::Line(TENDON), "tendon"));
    }
    if !data.contacts.is_empty() {
        entries.push(Entry::new(Key::Line(CONTACT), "contact force (direction)"));
    }
    if !data.obstacles.is_empty() {
        entries.push(Entry::new(Key::Line(OBSTACLE), OBSTACLE_NAME));
    }
    let lines = data.tendons.iter().chain(&data.obstacles);
    lines.for_each(|path| scenery.hold(path));
    scenery.view = data.view;
    let stage = |place: [f64; 4]| scenery.stage(&data.units, place);
    let mut shape = PageBlock::space(430.0, stage, |canvas, stage| {
        let mut painter = Painter::new(stage, !scenery.plane);
        for path in &data.obstacles {
            painter.path(path, OBSTACLE);
        }
        painter.rod(&data.rod, category(data.rod.colour.unwrap_or(6)), &scenery);
        for [place, normal] in &data.contacts {
            let from = along(*place, -1.2 * scenery.arm, *normal);
            painter.arrow(from, *place, CONTACT, 1);
        }
        for path in &data.tendons {
            painter.path(path, TENDON);
        }
        for &(ends, pen, heads, name, letter) in &arrows {
            painter.arrow(ends[0], ends[1], pen, heads);
            painter.word(name, letter, pen.colour);
        }
        painter.paint(canvas);
    });
    shape.legend = vec![entries];
    let page = Page::new("An equilibrium of a rod", &data.title, Vec::new())
        .column(Width::Whole(LEFT), vec![shape]);
    match blocks.len() {
        0 => page.draw(paper),
        _ => page.column(Width::Whole(RIGHT), blocks).draw(paper),
    }
}

/// Scales of force and couple. A couple without a force is compared with the rod's length, and both with the
/// load that bends the rod.
fn scales(data: &RodState) -> [f64; 2] {
    let largest = |list: &[[f64; 3]], end: Option<Point>| {
        let all = list.iter().flatten().chain(end.iter().flatten());
        all.filter(|v| v.is_finite())
            .fold(0.0, |m: f64, v| m.max(v.abs()))
    };
    let (n, m) = (
        largest(&data.forces, data.end_force),
        largest(&data.couples, data.end_couple),
    );
    let finite = data.s.iter().filter(|s| s.is_finite());
    let length = finite.fold(0.0, |m: f64, s| m.max(s.abs()));
    let length = if length > 0.0 { length } else { 1.0 };
    let bends = data.stiffness.abs() / length;
    let m = m.max(n * length).max(bends);
    [n.max(m / length), m]
}

/// A panel for each group of three components over s.
fn blocks(data: &RodState) -> Result<Vec<PageBlock<'static>>> {
    let units = &data.units;
    let [force, couple] = scales(data);
    let (lo, hi) = extent(&data.s).unwrap_or_default();
    let length = hi.abs().max(lo.abs());
    let bending = if length > 0.0 { ROUNDOFF / length } else { 0.0 };
    let (couples, forces) = (
        with_unit("couple", &units.couple),
        with_unit("force", &units.force),
    );
    // Each group with the size below which a component vanishes.
    let all = [
        (
            "couples",
            &data.couples,
            couples,
            ["m₁", "m₂", "m₃"],
            ROUNDOFF * couple,
        ),
        (
            "forces",
            &data.forces,
            forces,
            ["n₁", "n₂", "n₃"],
            ROUNDOFF * force,
        ),
        (
            "curvatures",
            &data.curvatures,
            units.curvature(),
            ["u₁", "u₂", "u₃"],
            bending,
        ),
        (
            "stretches",
            &data.stretches,
            "strain".into(),
            ["v₁", "v₂", "v₃ − 1"],
            ROUNDOFF,
        ),
    ];
    let mut blocks = Vec::new();
    for (field, list, label, names, least) in all {
        if list.is_empty() {
            continue;
        }
        if list.len() != data.s.len() || !data.s.iter().any(|s| s.is_finite()) {
            return Err(Error::domain(format!(
                "figure of a rod's state: {field} has {} entries for {} arclengths; it needs as many, or none",
                list.len(),
                data.s.len()
            )));
        }
        let from = [0.0, 0.0, if field == "stretches" { 1.0 } else { 0.0 }];
        let values = [0, 1, 2].map(|k| list.iter().map(|v| v[k] - from[k]).collect::<Vec<f64>>());
        blocks.extend(group(data, &label, names, &values, least));
    }
    Ok(blocks)
}

/// One panel, lower if all vanishes; `None` if nothing is finite.
fn group(
    data: &RodState,
    label: &str,
    names: [&'static str; 3],
    values: &[Vec<f64>; 3],
    least: f64,
) -> Option<PageBlock<'static>> {
    const HEIGHT: f64 = 112.0;
    let vanishes = |k: &usize| !values[*k].iter().any(|v| v.abs() > least);
    let (none, some): (Vec<usize>, Vec<usize>) = (0..3).partition(vanishes);
    let grey = none
        .iter()
        .map(|&k| PlottedCurve::line_of(ZERO, &data.s, &values[k]));
    let pens = some.iter().map(|&k| (k, Pen::new(category(k), 1.7)));
    let drawn =
        pens.map(|(k, pen)| PlottedCurve::new(Key::Line(pen), names[k], &data.s, &values[k]));
    let curves: Vec<PlottedCurve> = grey.chain(drawn).collect();
    let mut entries = named(&curves);
    if !none.is_empty() {
        let names: Vec<&str> = none.iter().map(|&k| names[k]).collect();
        let told = match names[..] {
            [one, _, other] if some.is_empty() => format!("{one} to {other} = 0"),
            _ => names.join(" = ") + " = 0",
        };
        entries.push(Entry::new(Key::Line(ZERO), told));
    }
    // Vanishing components are drawn at 0, whatever the roundoff on the panel's scale.
    let shown = some.iter().flat_map(|&k| values[k].iter().copied());
    let shown: Vec<f64> = shown.chain((!none.is_empty()).then_some(0.0)).collect();
    let (y, height) = if some.is_empty() {
        let mut flat = Axis::linear(-1.0, 1.0, label, 2);
        flat.ticks.retain(|tick| tick.value == 0.0);
        (flat, 0.5 * HEIGHT)
    } else {
        (Axis::over(&shown, None, label, 4)?, HEIGHT)
    };
    let s = with_unit("s", &data.units.length);
    let x = match extent(&data.s)? {
        (lo, hi) if hi > lo && (hi - lo).is_finite() => Axis::linear(lo, hi, &s, 6),
        _ => Axis::over(&data.s, None, &s, 6)?,
    };
    let mut block = PageBlock::plane(x, y, Height::Pixels(height), curves);
    block.legend = vec![entries];
    Some(block)
}
