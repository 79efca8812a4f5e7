//! Shapes and trajectory rows of a run at given times.

use super::{Prepared, table};
use crate::error::{Error, Quantity, Result};
use crate::motion::{Event, RodCurve, State};
use crate::study::{Hooks, Table};
use nalgebra::Isometry3;

/// The rods at one time: sections of each rod from base to end, as arclength and pose in the world and the units of
/// the scene.
pub type Shapes = Vec<RodCurve>;

/// The poses of sections.
pub(in crate::study) fn poses(curve: RodCurve) -> Vec<Isometry3<f64>> {
    curve.into_iter().map(|(_, pose)| pose).collect()
}

/// The rods of a scene at `times`, in the units of the scene and in any order; those with a free end come last. A rod
/// whose strains give no shape has no sections.
///
/// The motion is computed again up to the last of the times and stops at each exactly, without interpolation. A light
/// elastic rod has `points` sections, in space evenly spaced, in the plane closer where the rod bends. A rod with
/// strain unknowns has its Gauss nodes, `points` per element, and its two ends. If the run branches, the trunk is
/// followed.
///
/// ```
/// use snaprod::{scene::Scene, study::{Silent, run}};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "elastica"
///     length = 1.0
///     bending_stiffness = 1.0
///     [body]
///     mass = 1.0
///     [start]
///     lambda = 6.3
///     kappa = 0.6
///     [run]
///     duration = 1.0
///     "#,
/// )?;
/// let prepared = run::Prepared::new(&scene)?;
/// let shapes = run::shapes(&prepared, &[0.5, 0.0], 21, &mut Silent)?;
/// assert_eq!(shapes[1][0].len(), 21);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A time that the run does not reach, or before its start; an interrupt; a start from which no run can go.
pub fn shapes(
    prepared: &Prepared,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<Vec<Shapes>> {
    let mut shape = |state: &dyn State| prepared.curves(state, points);
    at_times(prepared, times, hooks, &mut shape)
}

/// The trajectory of a scene's run at `times` only, in the units of the scene and in any order. Rows are as in the
/// table `trajectory` of [`super::run`]. As in [`shapes`] nothing is interpolated.
///
/// # Errors
/// Those of [`shapes`].
pub fn samples(prepared: &Prepared, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    let header = &prepared.header;
    let mut row = |state: &dyn State| {
        let stations = prepared.stations(state)?;
        let joints = prepared.joints(state)?;
        Ok(table::row(
            header,
            &prepared.moment(state),
            &stations,
            &joints,
        ))
    };
    let rows = at_times(prepared, times, hooks, &mut row)?;
    let mut table = table::trajectory(header, 0);
    for row in &rows {
        table.push(row)?;
    }
    Ok(table)
}

/// Values of `seen` at `times` of a scene's motion, in the units of the scene.
pub(in crate::study) fn at_times<T>(
    prepared: &Prepared,
    times: &[f64],
    hooks: &mut dyn Hooks,
    seen: &mut dyn FnMut(&dyn State) -> Result<T>,
) -> Result<Vec<T>> {
    let mut motion = prepared.motion()?;
    let unit = prepared.header.scales.unit(Quantity::Time);
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|i, j| times[*i].total_cmp(&times[*j]));
    let mut found: Vec<Option<T>> = times.iter().map(|_| None).collect();
    let mut waiting = order.into_iter().peekable();
    let last = times.iter().copied().fold(0.0, f64::max);
    if let Some(t) = times.iter().find(|t| !(**t >= 0.0 && t.is_finite())) {
        return Err(Error::domain(format!(
            "t = {t}: a time of the run must be finite and >= 0"
        )));
    }
    {
        let given = motion.given();
        while let Some(i) = waiting.next_if(|i| times[*i] / unit <= given.time()) {
            found[i] = Some(seen(&*given)?);
        }
    }
    while waiting.peek().is_some() {
        let to = match motion.advance() {
            Some(Event::Step { to, .. }) => to,
            Some(Event::Stop(_)) | None => break,
            Some(_) => continue,
        };
        while let Some(i) = waiting.next_if(|i| times[*i] / unit <= to) {
            if let Some(state) = motion.sample(times[i] / unit) {
                found[i] = Some(seen(&*state)?);
            }
        }
        hooks.progress((to * unit / last).min(1.0), to * unit);
        if hooks.interrupted() {
            return Err(Error::domain("it was interrupted"));
        }
    }
    // The last moment, up to rounding of its time by the units.
    let now = motion.now();
    let end = now.time() * (1.0 + 4.0 * f64::EPSILON);
    while let Some(i) = waiting.next_if(|i| times[*i] / unit <= end) {
        found[i] = Some(seen(&*now)?);
    }
    let ended = now.time() * unit;
    let each = found.into_iter().zip(times);
    each.map(|(found, t)| {
        let missing = format!("t = {t}: the run, or its trunk, ended at t = {ended}");
        found.ok_or_else(|| Error::domain(missing))
    })
    .collect()
}
