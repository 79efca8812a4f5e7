//! One-sided Riemann problems at the ends of finite volumes (docs/bars.md 2).

use super::finite_volumes::{COURANT, STEEPEST};
use super::{Bar, End, Law1d};
use crate::profile::limited;
use snaprod_core::error::Result;

/// State at an end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// Stress of the bar at the end.
    pub stress: f64,
    /// Velocity of the end.
    pub velocity: f64,
    /// Upper bound of the speed of the wave from the end into the bar.
    pub fastest: f64,
}

impl Bar {
    /// The one-sided Riemann problem at an end (0 left, 1 right) with cells of width `h` and the states
    /// \[stretch, velocity\]. Also given are the velocity of the mass, and the force of the load with its rate.
    pub(super) fn edge(
        &self,
        side: usize,
        h: f64,
        [lam, v]: [&[f64]; 2],
        mass: f64,
        [force, rate]: [f64; 2],
    ) -> Result<Edge> {
        let material = &self.material;
        let place = |k: usize| if side == 0 { k } else { lam.len() - 1 - k };
        // A wave into the bar from the right end goes towards -X, and adds its rise.
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let [_, stress, slope, _] = material.jet(lam[place(0)]);
        let next = material.stress(lam[place(1)]);
        let [v0, v1, v2] = [0, 1, 2].map(|k| v[place(k)]);
        // 1 for an evenly varying velocity, 0 in a shock, to avoid overshoot at the reflection.
        let even = 1.0
            - (8.0 * (v0 - 2.0 * v1 + v2) / (v0 - v2 + f64::MIN_POSITIVE))
                .powi(2)
                .min(1.0);
        // From the last cell to the end. One variable is given at the end. The other's gradient follows from the load
        // or the mass: density v_t = sigma_X, lam_t = v_X.
        let half = 0.5 * sign * h;
        let inside = match &self.ends[side] {
            End::Loaded(_) => {
                let given = sign * force / self.area;
                let change = half * sign * rate / (self.area * slope);
                (
                    stress + 0.5 * limited(STEEPEST, stress - next, 2.0 * (given - stress)),
                    v0 + bounded(change, v0 - v1),
                )
            }
            End::Wall => (
                stress,
                v0 + 0.5 * even * limited(STEEPEST, v0 - v1, -2.0 * v0),
            ),
            End::Mass { mass: m, .. } => {
                let change = half * material.density() * (force - sign * self.area * stress) / m;
                (
                    stress + bounded(change, stress - next),
                    v0 + 0.5 * even * limited(STEEPEST, v0 - v1, 2.0 * (mass - v0)),
                )
            }
        };
        let mut inside = (lam[place(0)] + (inside.0 - stress) / slope, inside.1);
        if material.check(inside.0).is_err() {
            inside = (lam[place(0)], v0);
        }
        let under = |stress: f64| -> Result<Edge> {
            let lam = material.stretch(stress)?;
            Ok(Edge {
                stress,
                velocity: inside.1 + sign * material.velocity_jump(inside.0, lam).0,
                fastest: material.fastest(inside.0, lam),
            })
        };
        let moving = |velocity: f64| -> Result<Edge> {
            let lam = material.behind(inside.0, sign * (velocity - inside.1))?;
            Ok(Edge {
                stress: material.stress(lam),
                velocity,
                fastest: material.fastest(inside.0, lam),
            })
        };
        let given = sign * force / self.area;
        match self.ends[side] {
            End::Loaded(_) => under(given),
            End::Wall => moving(0.0),
            End::Mass { mass: m, .. } => {
                let held = moving(mass)?;
                // A body lighter than the material that waves pass in a step would overtake the bar that pulls it. It
                // moves as if it had that mass, and the rest of the load acts on the end: as the body vanishes, it
                // becomes a free end.
                let share = m / (COURANT * material.density() * self.area * h);
                if share >= 1.0 {
                    return Ok(held);
                }
                let free = under(given)?;
                let mixed = under(share * held.stress + (1.0 - share) * given)?;
                Ok(Edge {
                    fastest: mixed.fastest.max(held.fastest).max(free.fastest),
                    ..mixed
                })
            }
        }
    }
}

/// A change over half a cell, limited by that from the neighbour.
fn bounded(change: f64, before: f64) -> f64 {
    if change * before > 0.0 {
        change.abs().min(before.abs()).copysign(before)
    } else {
        0.0
    }
}
