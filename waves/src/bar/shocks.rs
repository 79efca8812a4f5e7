//! Detection of shocks in a computed state.

use super::{Bar, Snapshot, WaveKind};

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

/// Largest number of cells over which a scheme spreads either half of a shock beside its steepest face.
const SPREAD: usize = 6;
/// Jumps down to this fraction of the steepest belong to the shock.
const FOOT: f64 = 0.12;
/// Least part of the shock's jump on its steepest face.
const STEEP: f64 = 0.2;
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
    let n = lam.len();
    let material = bar.material();
    let bounds = lam
        .iter()
        .fold((1.0f64, 1.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    let faint = FAINT * (bounds.1 - bounds.0) + 1e-9;
    let jump = |i: usize| lam[i + 1] - lam[i];
    let mut found: Vec<Shock> = Vec::new();
    let mut i = 0;
    while i + 1 < n {
        let steepest = jump(i).abs();
        let near = i.saturating_sub(SPREAD)..(i + SPREAD + 1).min(n - 1);
        if !(steepest > 0.2 * faint) || near.clone().any(|k| jump(k).abs() > steepest) {
            i += 1;
            continue;
        }
        let belongs = |k: usize| jump(k) * jump(i) > 0.0 && jump(k).abs() > FOOT * steepest;
        let (mut a, mut b) = (i, i + 1);
        while a > 0 && i - a < SPREAD && belongs(a - 1) {
            a -= 1;
        }
        while b + 1 < n && b - i < SPREAD + 1 && belongs(b) {
            b += 1;
        }
        let spread = (a > 0 && belongs(a - 1)) || (b + 1 < n && belongs(b));
        // Extends the shock by up to three flat cells on either side.
        for _ in 0..3 {
            let flat = |k: usize| jump(k).abs() <= FOOT * steepest;
            a -= usize::from(a > 0 && flat(a - 1));
            b += usize::from(b + 1 < n && flat(b));
        }
        let (dl, dv) = (lam[b] - lam[a], v[b] - v[a]);
        let x = state.x[a] - 0.5 * (state.x[1] - state.x[0]);
        i = b;
        if spread || dl.abs() < faint || dl * dv == 0.0 || steepest < STEEP * dl.abs() {
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
