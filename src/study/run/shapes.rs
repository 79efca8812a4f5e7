//! Shapes and trajectory rows of a run at given times.

use super::{Prepared, table};
use crate::error::{Error, Result};
use crate::motion::{Event, Motion, RodCurve, State};
use crate::study::{Hooks, Table};
use nalgebra::Isometry3;

/// The rods at one time: sections of each rod from base to end, as arclength and pose in the world and the units of
/// the scene.
pub type Shapes = Vec<RodCurve>;

/// The poses of sections.
pub(in crate::study) fn poses(curve: RodCurve) -> Vec<Isometry3<f64>> {
    curve.into_iter().map(|(_, pose)| pose).collect()
}

/// The rod of a scene at `times`, in the units of the scene and in any order. The result at each time is a list of
/// one rod, without sections where its strains give no shape.
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
    let mut shape = |state: &dyn State| Ok(vec![prepared.curve(state, points)]);
    at_times(
        &mut *prepared.motion()?,
        times,
        prepared.scales.time,
        hooks,
        &mut shape,
    )
}

/// The trajectory of a scene's run at `times` only, in the units of the scene and in any order. Rows are as in the
/// table `trajectory` of [`super::run`]. As in [`shapes`] nothing is interpolated.
///
/// # Errors
/// Those of [`shapes`].
pub fn samples(prepared: &Prepared, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    let kind = (prepared.kind(), prepared.is_heavy());
    let mut row = |state: &dyn State| Ok(table::row(kind, &prepared.moment(state)));
    let unit = prepared.scales.time;
    let rows = at_times(&mut *prepared.motion()?, times, unit, hooks, &mut row)?;
    let mut table = table::trajectory(prepared, 0);
    for row in &rows {
        table.push(row)?;
    }
    Ok(table)
}

/// Values of `seen` at `times` of a motion; `unit` is the unit of time of the motion in units of `times`.
pub(in crate::study) fn at_times<T>(
    motion: &mut dyn Motion<'_>,
    times: &[f64],
    unit: f64,
    hooks: &mut dyn Hooks,
    seen: &mut dyn FnMut(&dyn State) -> Result<T>,
) -> Result<Vec<T>> {
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
