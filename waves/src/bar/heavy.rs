//! A light bar with a heavy end: the motion without waves, its next order, and the frequencies of a linear bar
//! (docs/bars.md 3).

use super::{Bar, End, Law1d, Material, positive};
use nalgebra::Vector4;
use snaprod_core::error::{Error, Result};
use snaprod_core::solve::dop853::Dop853;
use snaprod_core::solve::roots::chandrupatla;

/// Motion of the mass at X = length of a bar held at X = 0 whose stretch is uniform at every instant:
/// m r'' = -area sigma(r/length) + force, m the mass of the end and, with `first_order`, a third of that of the bar.
/// The error is of the order of eps = mass of the bar over mass of the end, or of eps^2. Gives \[r, r'\] at the
/// growing `times`.
///
/// # Errors
/// Other ends; a start that is not uniform in the stretch; a motion that leaves the reach of the law.
pub fn reduced(bar: &Bar, first_order: bool, times: &[f64]) -> Result<Vec<[f64; 2]>> {
    let (End::Wall, End::Mass { mass, force }) = (&bar.ends[0], &bar.ends[1]) else {
        let said =
            "the motion without waves is that of a bar held at X = 0 with a mass at X = length";
        return Err(Error::domain(said));
    };
    let [stretch, velocity] = bar.at_start(bar.length);
    bar.material.check(stretch)?;
    if bar.at_start(0.0)[0] != stretch || bar.at_start(0.5 * bar.length)[0] != stretch {
        let said = "the motion without waves starts from a uniform stretch";
        return Err(Error::domain(said));
    }
    let mass = mass + if first_order { bar.mass() / 3.0 } else { 0.0 };
    let mut state = Vector4::new(stretch * bar.length, velocity, 0.0, 0.0);
    let mut found = Vec::new();
    let mut size = 0.01 * bar.length / bar.material.speed(1.0) * (mass / bar.mass()).sqrt();
    for until in times {
        while state[2] < *until {
            let stop = force.next_break(state[2]);
            let slope = |y: &Vector4<f64>| {
                let stretch = y[0] / bar.length;
                bar.material.check(stretch).ok()?;
                let load = force.at(y[2].min(stop.next_down()));
                let pull = bar.area * bar.material.stress(stretch);
                Some(Vector4::new(y[1], (load - pull) / mass, 1.0, 0.0))
            };
            let collapsed = || {
                Error::no_convergence(format!(
                    "the reduced motion of a bar stops at t = {}",
                    state[2]
                ))
            };
            let first = slope(&state).ok_or_else(collapsed)?;
            let mut integrator = Dop853::new(state, first, size, 1e-13);
            let end = until.min(stop);
            while integrator.state()[2] < end {
                let left = end - integrator.state()[2];
                let step = integrator.step(slope, left).map_err(|_| collapsed())?;
                if step.h >= left {
                    break;
                }
            }
            size = integrator.next_step();
            state = *integrator.state();
            state[2] = end;
        }
        found.push([state[0], state[1]]);
    }
    Ok(found)
}

/// The lowest circular frequencies of small longitudinal vibrations about a uniform stretch, of a bar held at one end
/// with a mass at the other: w tan w = eps, times speed/length.
///
/// # Errors
/// A stretch outside the reach of the law; a length or a ratio of masses that is not positive.
pub fn frequencies(
    material: &Material,
    stretch: f64,
    length: f64,
    eps: f64,
    count: usize,
) -> Result<Vec<f64>> {
    material.check(stretch)?;
    positive("length", length)?;
    positive("mass over that of the end", eps)?;
    let unit = material.speed(stretch) / length;
    let found = (0..count).map(|k| {
        let foot = std::f64::consts::PI * k as f64;
        // With w = foot + a, a in (0, pi/2): (foot + a) sin a - eps cos a grows from -eps.
        let f = |a: f64| (foot + a) * a.sin() - eps * a.cos();
        let top = std::f64::consts::FRAC_PI_2;
        let root = chandrupatla(f, (0.0, f(0.0)), (top, f(top)), 0.0);
        unit * (foot + root.unwrap_or(f64::NAN))
    });
    Ok(found.collect())
}
