//! Tracks of shocks through time.

use crate::bar::Shock;
use serde::Serialize;

/// A shock at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShockPoint {
    /// The time.
    pub time: f64,
    /// The material coordinate.
    pub position: f64,
    /// Speed relative to the material, positive towards +X.
    pub speed: f64,
    /// The stretch ahead.
    pub ahead: f64,
    /// The stretch behind.
    pub behind: f64,
    /// Energy lost per time.
    pub loss_rate: f64,
}

/// A shock from first to last detection.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShockTrack {
    /// States of the shock in the order of time.
    pub points: Vec<ShockPoint>,
}

/// Connects the shocks of one time with those of the previous time.
#[derive(Default)]
pub(in crate::study) struct Tracker {
    /// True if shocks may stand, with a speed of either sign.
    standing: bool,
    open: Vec<ShockTrack>,
    done: Vec<ShockTrack>,
}

/// Allowed deviation of a shock between two samples, in addition to a cell, as a fraction of the distance travelled.
const STRAY: f64 = 0.5;

impl Tracker {
    /// For shocks that may stand.
    pub fn of_standing() -> Self {
        Self {
            standing: true,
            ..Self::default()
        }
    }

    pub fn look(&mut self, time: f64, found: &[Shock], cell: f64) {
        let mut left: Vec<&Shock> = found.iter().collect();
        let mut open = Vec::new();
        for mut track in std::mem::take(&mut self.open) {
            let last = track.points[track.points.len() - 1];
            let step = last.speed * (time - last.time);
            let off = |shock: &Shock| (shock.position - last.position - step).abs();
            let same = |shock: &Shock| {
                let goes_on = shock.speed * last.speed > 0.0 || self.standing && step.abs() <= cell;
                goes_on && off(shock) <= STRAY * step.abs() + cell
            };
            let near = (0..left.len())
                .filter(|i| same(left[*i]))
                .min_by(|a, b| off(left[*a]).total_cmp(&off(left[*b])));
            match near {
                Some(i) => {
                    track.points.push(point(time, left.swap_remove(i)));
                    open.push(track);
                }
                None => self.done.push(track),
            }
        }
        open.extend(left.into_iter().map(|shock| ShockTrack {
            points: vec![point(time, shock)],
        }));
        self.open = open;
    }

    /// All tracks by the time of their first point. A front detected once only, as when two shocks pass through each
    /// other, is dropped, except at the end.
    pub fn finish(mut self) -> Vec<ShockTrack> {
        self.done.retain(|track| track.points.len() > 1);
        self.done.append(&mut self.open);
        self.done
            .sort_by(|a, b| a.points[0].time.total_cmp(&b.points[0].time));
        self.done
    }
}

fn point(time: f64, shock: &Shock) -> ShockPoint {
    ShockPoint {
        time,
        position: shock.position,
        speed: shock.speed,
        ahead: shock.ahead,
        behind: shock.behind,
        loss_rate: shock.loss_rate,
    }
}
