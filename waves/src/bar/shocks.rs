//! Detection of shocks in a computed state.

use super::{Bar, Law1d, Snapshot, WaveKind};
use crate::profile::{Passage, passages};

/// A shock: position, speed, states on both sides and loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shock {
    /// The material coordinate.
    pub position: f64,
    /// The speed over the material, positive towards +X.
    pub speed: f64,
    /// The stretch ahead.
    pub ahead: f64,
    /// The stretch behind.
    pub behind: f64,
    /// Energy dissipated per time, computed from the two states.
    pub loss_rate: f64,
}

/// Least dissipation over the power [sigma] [v]: weaker fronts are steep waves as often as shocks.
const WEAK: f64 = 4e-3;
/// Jumps below this part of the range of stretches are ignored.
const FAINT: f64 = 0.02;

/// The shocks in a state on equal cells, by growing position.
///
/// A shock is a monotone passage of few cells between states that are flat beside it. The states meet the jump
/// conditions, and the jump dissipates. Its position is that of a sharp jump between these states with the same total
/// stretch.
pub fn shocks(bar: &Bar, state: &Snapshot) -> Vec<Shock> {
    let (lam, v) = (&state.stretch, &state.velocity);
    let material = bar.material();
    let bounds = lam
        .iter()
        .fold((1.0f64, 1.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    let faint = FAINT * (bounds.1 - bounds.0) + 1e-9;
    let mut found: Vec<Shock> = Vec::new();
    for Passage { from: a, to: b } in passages(lam, faint) {
        let (dl, dv) = (lam[b] - lam[a], v[b] - v[a]);
        let x = state.x[a] - 0.5 * (state.x[1] - state.x[0]);
        if dl * dv == 0.0 {
            continue;
        }
        // [v] = -s [lam].
        let right = dl * dv < 0.0;
        let (ahead, behind) = if right {
            (lam[b], lam[a])
        } else {
            (lam[a], lam[b])
        };
        let waves = material.waves(ahead, behind);
        let jumps = waves.iter().filter(|wave| wave.kind == WaveKind::Shock);
        let height: f64 = jumps.map(|wave| (wave.to - wave.from).abs()).sum();
        let speed = material.chord_speed(ahead, behind);
        let matched = (dv.abs() / (speed * dl.abs()) - 1.0).abs() < 0.15;
        let loss_rate = bar.area() * material.dissipation(ahead, behind);
        let power =
            bar.area() * dv.abs() * (material.stress(ahead) - material.stress(behind)).abs();
        if !(matched && height > 0.5 * dl.abs() && loss_rate > WEAK * power) {
            continue;
        }
        let width = state.x[1] - state.x[0];
        let mean: f64 = lam[a..=b].iter().map(|lam| lam * width).sum();
        let length = width * (b - a + 1) as f64;
        found.push(Shock {
            position: x + (mean - lam[b] * length) / (lam[a] - lam[b]),
            speed: if right { speed } else { -speed },
            ahead,
            behind,
            loss_rate,
        });
    }
    found
}
