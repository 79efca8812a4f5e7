//! Elastic jumps in a computed state.

use super::{FlowTube, Place};
use snaprod_waves::law1d::{Law1d, WaveKind};
use snaprod_waves::profile::{Passage, passages};

/// An elastic jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticJump {
    /// Place.
    pub position: f64,
    /// Speed along the tube.
    pub speed: f64,
    /// Area over A0 on the side of the fluid that enters the jump.
    pub ahead: f64,
    /// Area over A0 behind.
    pub behind: f64,
    /// Energy lost per time, from the two states.
    pub loss_rate: f64,
}

/// Rises of the area below this part of A0 are ignored.
const FAINT: f64 = 0.02;
/// Largest error of the velocity's jump, relative to that of a jump between the two areas.
const MATCHED: f64 = 0.15;
/// Least loss over the power \[Pi\] \[u\]: weaker fronts are steep waves as often as jumps.
const WEAK: f64 = 4e-3;

/// Elastic jumps of a state, by growing place: steep passages between two states that meet the conditions of a jump.
pub(super) fn find(
    tube: &FlowTube,
    places: &[Place],
    h: f64,
    area: &[f64],
    flow: &[f64],
) -> Vec<ElasticJump> {
    let ratios: Vec<f64> = (area.iter().zip(places))
        .map(|(area, place)| area / place.area)
        .collect();
    let law = &tube.law;
    let mut found = Vec::new();
    for Passage { from, to } in passages(&ratios, FAINT) {
        let place = &places[(from + to) / 2];
        let unit = tube.unit_speed(place);
        let [(a, u), (b, v)] = [from, to].map(|k| (ratios[k], flow[k] / area[k] / unit));
        // Over the fluid \[u\] = -s \[1/a\], with s > 0 for a jump towards +x.
        let (rise, swelling) = (v - u, 1.0 / b - 1.0 / a);
        if rise * swelling == 0.0 {
            continue;
        }
        let right = rise * swelling < 0.0;
        let ((ahead, before), behind) = if right { ((b, v), a) } else { ((a, u), b) };
        let (lam, mu) = (1.0 / ahead, 1.0 / behind);
        let speed = law.chord_speed(lam, mu);
        let jumps = law
            .waves(lam, mu)
            .into_iter()
            .filter(|wave| wave.kind == WaveKind::Shock);
        let height: f64 = jumps.map(|wave| (wave.to - wave.from).abs()).sum();
        let matched = (rise.abs() / (speed * swelling.abs()) - 1.0).abs() < MATCHED;
        let loss = law.dissipation(lam, mu);
        let power = rise.abs() * (law.stress(lam) - law.stress(mu)).abs();
        if !(matched && height > 0.5 * swelling.abs() && loss > WEAK * power) {
            continue;
        }
        // The place of a sharp jump with the volume of the passage.
        let volume: f64 = ratios[from..=to].iter().sum();
        let cells = (to - from + 1) as f64;
        let sign = if right { 1.0 } else { -1.0 };
        found.push(ElasticJump {
            position: h * (from as f64 + (volume - b * cells) / (a - b)),
            speed: unit * (before + sign * speed * lam),
            ahead,
            behind,
            loss_rate: place.area * place.stiffness * unit * loss,
        });
    }
    found
}
