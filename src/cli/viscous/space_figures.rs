//! Figures of a run in space: shapes, path of the end, energies, strains over (t, s).

use super::recorder::Moment;
use super::space::Spatial;
use super::{Done, Task, figures};
use nalgebra::{Isometry3, Vector3};
use snaprod::motion::InSpace;
use snaprod::plot::{
    Lines, RodShapes, RodUnits, Series, SpaceRod, energies, lines, rod_shapes, strain_map,
};
use snaprod::scene::{MotionSetup, StrainName, Units};

/// Strains that stay below this part of the largest one are not drawn.
const SMALL: f64 = 1e-3;

/// Draws the figures of a run that has a motion to show.
pub fn write<S: InSpace>(task: &Task, setup: &MotionSetup, done: &Done<Spatial<S>>) {
    let (out, record, layers) = (&task.out, &done.record, done.layers.as_slice());
    let (Some(first), Some(last)) = (record.track.first(), record.track.last()) else {
        return;
    };
    // A run that got nowhere has nothing to draw.
    if !(first.t < last.t) {
        return;
    }
    let track = &record.track;
    let drawn = drawn_strains(track, setup.strains.names(), task.scales.length);
    // A rod that only stretches is one line at all times.
    if drawn.iter().any(|(_, name)| *name != StrainName::V3) {
        let shapes = || Ok(shapes(task, &record.axes));
        out.figure("shapes", shapes, rod_shapes);
    }
    out.figure("path", || Ok(path(task, track)), lines);
    let data = || Ok(figures::energies(task, record, layers, setup.is_driven()));
    out.figure("energies", data, energies);
    for (i, name) in drawn {
        let map = || {
            let mut map = figures::strain(task, record, layers, i, &label(name, task));
            if name == StrainName::V3 {
                map.strain.iter_mut().flatten().for_each(|v3| *v3 -= 1.0);
            }
            Ok(map)
        };
        out.figure(&format!("strain_{}", name.as_str()), map, strain_map);
    }
    figures::losses(task, layers);
}

fn time_label(task: &Task) -> String {
    labelled("time", &task.labels.time)
}

fn shapes(task: &Task, axes: &[(f64, Vec<Isometry3<f64>>)]) -> RodShapes {
    let frame = |section: &Isometry3<f64>| {
        let frame = *section.rotation.to_rotation_matrix().matrix();
        std::array::from_fn(|j| frame.column(j).into_owned().into())
    };
    let rods = axes
        .iter()
        .map(|(t, sections)| SpaceRod {
            points: sections
                .iter()
                .map(|s| s.translation.vector.into())
                .collect(),
            directors: sections.iter().map(frame).collect(),
            value: Some(*t),
            ..SpaceRod::default()
        })
        .collect();
    RodShapes {
        rods,
        value_label: time_label(task),
        ribbon: 0.03 * task.scales.length,
        triads: false,
        units: match task.units {
            Units::Si => RodUnits::si(),
            Units::Dimensionless => RodUnits {
                length: String::new(),
                force: String::new(),
                couple: String::new(),
            },
        },
        ..RodShapes::default()
    }
}

/// Position of the end over time.
fn path(task: &Task, track: &[Moment<Vector3<f64>>]) -> Lines {
    let series = |(i, name): (usize, &str)| Series {
        name: name.to_owned(),
        x: track.iter().map(|m| m.t).collect(),
        y: track.iter().map(|m| m.shape[i]).collect(),
        ..Series::default()
    };
    Lines {
        x_label: time_label(task),
        y_label: labelled("position of the end", &task.labels.length),
        series: ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(series)
            .collect(),
        ..Lines::default()
    }
}

/// The flexures and the twist that are not small beside the largest of them; if there are none, the shear or stretch that
/// changes most.
fn drawn_strains(
    track: &[Moment<Vector3<f64>>],
    names: &'static [StrainName],
    length: f64,
) -> Vec<(usize, StrainName)> {
    let values = |i: usize| track.iter().flat_map(move |m| m.strains[i].iter().copied());
    let size = |i: usize| values(i).fold(0.0_f64, |most, x| most.max(x.abs()));
    let turning: Vec<f64> = (0..3).map(size).collect();
    let largest = turning.iter().copied().fold(0.0, f64::max);
    if largest * length > SMALL {
        return (0..3)
            .filter(|i| turning[*i] > SMALL * largest)
            .map(|i| (i, names[i]))
            .collect();
    }
    let span = |i: usize| {
        let (low, high) = values(i).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        high - low
    };
    let most = (0..names.len())
        .map(|i| (if i < 3 { length } else { 1.0 } * span(i), i))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    most.map(|(_, i)| (i, names[i])).into_iter().collect()
}

fn label(name: StrainName, task: &Task) -> String {
    let what = match name {
        StrainName::U1 => "flexure u1",
        StrainName::U2 => "flexure u2",
        StrainName::U3 => "twist u3",
        StrainName::V1 => "shear v1",
        StrainName::V2 => "shear v2",
        StrainName::V3 => "stretch v3 − 1",
    };
    match (name as usize, task.labels.length.as_str()) {
        (0..3, length) if !length.is_empty() => labelled(what, &format!("1/{length}")),
        _ => what.to_owned(),
    }
}

/// "name (unit)", or the name alone.
fn labelled(name: &str, unit: &str) -> String {
    match unit {
        "" => name.to_owned(),
        _ => format!("{name} ({unit})"),
    }
}
