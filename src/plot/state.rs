//! One equilibrium of a rod in space: its shape, and couples, forces and strains along it.

use super::axes::{Axis, LABEL, Panel, ROOM_BELOW, room_left};
use super::camera::{Point, along, dot, unit};
use super::canvas::{Pen, draw};
use super::data::{View, with_unit};
use super::legend::{Entry, Key, Legend};
use super::page::{ABOVE_LEGEND, head, title_height};
use super::painter::Painter;
use super::palette::{ALARM, Colour, GREY, category};
use super::scenery::{RodUnits, Scenery, SpaceRod};
use super::text;
use crate::error::{Error, Result};

/// One equilibrium. The lists over s are as long as `s`, or empty to leave their panel out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RodState {
    /// Written over the figure; may be empty.
    pub title: String,
    /// The shape; its colour is grey by default, as its directors have the colours of their components.
    pub rod: SpaceRod,
    /// The width of the strip along d1, as a length; 0 for a line alone.
    pub ribbon: f64,
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
    /// Where from; by default the side from which the shape is seen best.
    pub view: Option<View>,
    /// Units.
    pub units: RodUnits,
}

const FORCE: Colour = ALARM;
const COUPLE: Colour = Colour(110, 40, 140);
/// Components below this part of the loads' size are roundoff.
const ROUNDOFF: f64 = 1e-9;

/// Draws one equilibrium as SVG: at the left its shape in perspective with the force (one head) and the
/// couple (two heads) on its end, at the right its couples, forces and strains along s. A component that vanishes
/// is a thin grey line. An arrow that presses on the rod has its tip at the rod's end; arrows are of one length, the legend
/// gives their sizes.
///
/// Errs if the rod has no finite point, if a list is not as long as `s`, or if `s` has no finite
/// number while there is something to draw over it.
pub fn rod_state(data: &RodState) -> Result<String> {
    const LEFT: f64 = 440.0;
    const RIGHT: f64 = 420.0;
    let groups = groups(data)?;
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
        let text = match way {
            Some(_) => format!("{name} |{letter}| = {} {unit_name}", number(size)),
            None => format!("{name} {letter} = 0"),
        };
        entries.push(Entry::new(Key::Line(pen), text));
        if let (Some(way), Some((_, last))) = (way, data.rod.ends()) {
            let length = if heads == 1 { 2.2 } else { 1.6 } * scenery.arm;
            let end = data.rod.points[last];
            let presses = data
                .rod
                .heading(last)
                .is_some_and(|d| dot(d, way) < -0.25 && heads == 1);
            let gap = 0.2 * scenery.arm;
            let ends = if presses {
                [along(end, -gap - length, way), along(end, -gap, way)]
            } else {
                [end, along(end, length, way)]
            };
            scenery.hold(&ends);
            // The name stands at the free end of the arrow.
            let name = if presses { [ends[1], ends[0]] } else { ends };
            arrows.push((ends, pen, heads, name, letter));
        }
    }
    scenery.view = data.view;
    let top = ABOVE_LEGEND + title_height(&data.title);
    let legend = Legend::new(entries, LEFT - 24.0);

    let plots = panels(&groups, data, LEFT + 20.0, RIGHT - 38.0, top);
    let below = plots.last().map_or(0.0, |p| p.panel.bottom() + ROOM_BELOW);
    let height = below.max(top + 430.0);
    let width = if plots.is_empty() { LEFT } else { LEFT + RIGHT };
    let shown = top + legend.height();
    let stage = scenery.stage(&data.units.axes(), [0.0, shown, LEFT, height - shown]);
    Ok(draw(width, height, |canvas| {
        head(canvas, &data.title, &legend, 16.0);
        stage.walls(canvas);
        let mut painter = Painter::new(&stage, !scenery.plane);
        painter.rod(&data.rod, category(data.rod.colour.unwrap_or(6)), &scenery);
        for (ends, pen, heads, name, letter) in arrows {
            painter.arrow(ends[0], ends[1], pen, heads);
            painter.word(name[0], name[1], letter, pen.colour);
        }
        painter.paint(canvas);
        stage.axes(canvas);
        for plot in &plots {
            plot.legend.draw(
                canvas,
                plot.panel.left,
                plot.panel.top - plot.legend.height(),
            );
            plot.panel.grid(canvas);
            for (values, pen) in &plot.curves {
                plot.panel.line(canvas, &data.s, values, *pen);
            }
            plot.panel.frame(canvas);
        }
    }))
}

/// Three digits.
fn number(value: f64) -> String {
    if (1e-3..1e5).contains(&value.abs()) {
        let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 6);
        text::fixed(value, decimals as usize)
    } else {
        text::scientific(format!("{value:.2e}").parse().unwrap_or(value))
    }
}

/// Three components over s.
struct Group {
    label: String,
    names: [&'static str; 3],
    values: [Vec<f64>; 3],
    /// What a component must exceed not to vanish.
    least: f64,
}

/// The sizes of force and couple: a couple with no force is measured against the rod's length.
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
    [n.max(m / length), m.max(n * length)]
}

fn groups(data: &RodState) -> Result<Vec<Group>> {
    let units = &data.units;
    let [force, couple] = scales(data);
    let finite = data.s.iter().filter(|s| s.is_finite());
    let length = finite.fold(0.0, |m: f64, s| m.max(s.abs()));
    let u_least = if length > 0.0 { ROUNDOFF / length } else { 0.0 };
    let all = [
        (
            "couples",
            &data.couples,
            with_unit("couple", &units.couple),
            ["m₁", "m₂", "m₃"],
            ROUNDOFF * couple,
        ),
        (
            "forces",
            &data.forces,
            with_unit("force", &units.force),
            ["n₁", "n₂", "n₃"],
            ROUNDOFF * force,
        ),
        (
            "curvatures",
            &data.curvatures,
            if units.length.is_empty() {
                "curvature".to_owned()
            } else {
                format!("curvature (1/{})", units.length)
            },
            ["u₁", "u₂", "u₃"],
            u_least,
        ),
        (
            "stretches",
            &data.stretches,
            "strain".to_string(),
            ["v₁", "v₂", "v₃ − 1"],
            ROUNDOFF,
        ),
    ];
    let mut groups = Vec::new();
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
        let of = |k: usize| -> Vec<f64> {
            let from = if names[k].ends_with('1') { 1.0 } else { 0.0 };
            list.iter().map(|v| v[k] - from).collect()
        };
        groups.push(Group {
            label,
            names,
            values: [of(0), of(1), of(2)],
            least,
        });
    }
    Ok(groups)
}

/// A group as drawn.
struct Plot {
    panel: Panel,
    legend: Legend,
    curves: Vec<(Vec<f64>, Pen)>,
}

fn panels(groups: &[Group], data: &RodState, left: f64, width: f64, top: f64) -> Vec<Plot> {
    const HEIGHT: f64 = 112.0;
    let mut plots: Vec<Plot> = Vec::new();
    let mut below = top;
    for (i, group) in groups.iter().enumerate() {
        let vanishes = |k: &usize| !group.values[*k].iter().any(|v| v.abs() > group.least);
        let (none, some): (Vec<usize>, Vec<usize>) = (0..3).partition(vanishes);
        let zero = Pen::new(GREY, 0.9);
        let mut entries = Vec::new();
        let mut curves = Vec::new();
        for &k in &none {
            curves.push((group.values[k].clone(), zero));
        }
        for &k in &some {
            let pen = Pen::new(category(k), 1.7);
            entries.push(Entry::new(Key::Line(pen), group.names[k]));
            curves.push((group.values[k].clone(), pen));
        }
        if !none.is_empty() {
            let names: Vec<&str> = none.iter().map(|&k| group.names[k]).collect();
            entries.push(Entry::new(Key::Line(zero), names.join(" = ") + " = 0"));
        }
        // What vanishes is drawn at 0 however large its roundoff on the panel's scale.
        let mut values: Vec<f64> = some.iter().flat_map(|&k| group.values[k].clone()).collect();
        if !none.is_empty() {
            values.push(0.0);
        }
        let all_vanish = some.is_empty();
        let y = if all_vanish {
            let mut flat = Axis::linear(-1.0, 1.0, &group.label, 2);
            flat.ticks.retain(|tick| tick.value == 0.0);
            Some(flat)
        } else {
            Axis::over(&values, None, &group.label, 4)
        };
        let label = with_unit("s", &data.units.length);
        let Some((y, x)) = y.zip(Axis::over(&data.s, None, &label, 6)) else {
            continue;
        };
        let ends = data.s.iter().filter(|s| s.is_finite());
        let (lo, hi) = ends.fold((f64::MAX, f64::MIN), |(l, h), s| (l.min(*s), h.max(*s)));
        let x = if hi > lo && (hi - lo).is_finite() {
            Axis::linear(lo, hi, &label, 6)
        } else {
            x
        };
        // Only the lowest has the numbers and the name.
        let x = if i + 1 == groups.len() { x } else { x.bare() };
        let legend = Legend::new(entries, width);
        let height = if all_vanish { 0.5 * HEIGHT } else { HEIGHT };
        let panel = Panel {
            left,
            top: below + legend.height(),
            width,
            height,
            x,
            y,
        };
        below = panel.bottom() + 9.0;
        plots.push(Plot {
            panel,
            legend,
            curves,
        });
    }
    // One left edge for all.
    let room = plots
        .iter()
        .map(|p| room_left(&p.panel.y))
        .fold(LABEL, f64::max);
    for plot in &mut plots {
        plot.panel.left = left + room;
        plot.panel.width = width - room;
    }
    plots
}
