//! Breaking of waves: the envelope of characteristics from a loaded end, and the law of acceleration waves
//! (docs/bars.md 1).

use super::{Bar, End, Law1d, Material, WaveKind};

/// Place and time at which the first shock forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breaking {
    /// The time.
    pub time: f64,
    /// The material coordinate.
    pub position: f64,
    /// Time of emission of the characteristic that breaks first.
    pub emitted: f64,
}

/// Samples of a smooth part of a load's history, from which the first crossing is bracketed.
const SAMPLES: usize = 4000;

/// The first shock of the waves that a load in time sends into a bar at rest in a uniform state. It must form before
/// `until`, and before a wave from the other end, reflected or its own, can have reached it. It is found on the
/// envelope of the characteristics, X = c^2/(dc/dtau) from the end and t = tau + X/c for the time tau of emission
/// (docs/bars.md 1). None if no such shock forms, or for other ends or starts.
pub fn first(bar: &Bar, until: f64) -> Option<Breaking> {
    let [stretch, velocity] = bar.at_start(0.0);
    let samples = 64;
    let uniform = (0..=samples).all(|i| {
        bar.at_start(bar.length() * f64::from(i) / f64::from(samples)) == [stretch, velocity]
    });
    if !uniform || velocity != 0.0 {
        return None;
    }
    let loaded = [0, 1].map(|side| matches!(bar.ends()[side], End::Loaded(_)).then_some(side));
    let found = loaded
        .into_iter()
        .flatten()
        .filter_map(|side| from_end(bar, side, until));
    found.min_by(|a, b| a.time.total_cmp(&b.time))
}

fn from_end(bar: &Bar, side: usize, until: f64) -> Option<Breaking> {
    let End::Loaded(history) = &bar.ends()[side] else {
        return None;
    };
    let material = bar.material();
    let rest = bar.at_start(0.0)[0];
    let sign = if side == 0 { -1.0 } else { 1.0 };
    // (c, X of the envelope, stretch) of the characteristic that leaves at tau; X is infinite for a spreading wave.
    let ray = |tau: f64| {
        let [force, rate, _] = history.with_rates(tau);
        let lam = material.stretch(sign * force / bar.area()).ok()?;
        let [_, _, slope, bend] = material.jet(lam);
        let c = (slope / material.density()).sqrt();
        let stretching = sign * rate / bar.area() / slope;
        let quickening = bend / (2.0 * material.density() * c) * stretching;
        Some((
            c,
            if quickening > 0.0 {
                c * c / quickening
            } else {
                f64::INFINITY
            },
            lam,
        ))
    };
    let crossing = |tau: f64| ray(tau).map_or(f64::INFINITY, |(c, x, _)| tau + x / c);
    // (time, emitted, X) of the first crossing of each smooth part of the history.
    let mut found = Vec::new();
    let mut start = 0.0;
    let mut before = rest;
    while start < until {
        let stop = history.next_break(start).min(until);
        // A jump whose hull has a chord is a shock at once, unless the jump is rounding.
        let now = ray(start)?.2;
        let waves = material.waves(before, now);
        let shocks = waves.iter().any(|wave| wave.kind == WaveKind::Shock);
        if shocks && (now - before).abs() > 1e-9 * before {
            found.push((start, start, 0.0));
        }
        let at = |i: usize| start + (stop.next_down() - start) * i as f64 / SAMPLES as f64;
        let times: Vec<f64> = (0..=SAMPLES).map(|i| crossing(at(i))).collect();
        let least = (0..=SAMPLES).min_by(|a, b| times[*a].total_cmp(&times[*b]))?;
        let (mut a, mut b) = (at(least.saturating_sub(1)), at((least + 1).min(SAMPLES)));
        // Golden section: the crossing time has one minimum here.
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..80 {
            let (c, d) = (b - golden * (b - a), a + golden * (b - a));
            if crossing(c) < crossing(d) {
                b = d
            } else {
                a = c
            }
        }
        let tau = 0.5 * (a + b);
        found.push((crossing(tau), tau, ray(tau)?.1));
        before = ray(stop.next_down())?.2;
        start = stop;
    }
    let (time, tau, x) = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let faster = (0..=SAMPLES)
        .filter_map(|i| ray(until * i as f64 / SAMPLES as f64))
        .map(|(c, ..)| c);
    let fastest = faster.fold(material.speed(rest), f64::max);
    // A wave comes back from the other end, or begins there before.
    let back = bar.length() / material.speed(rest);
    let (leaves, fastest) = match wakened(bar, 1 - side, until) {
        None => (back, fastest),
        Some((since, speed)) => (since.min(back), fastest.max(speed)),
    };
    let reached = leaves + (bar.length() - x) / fastest;
    (time <= until && time < reached && x <= bar.length()).then_some(Breaking {
        time,
        position: if side == 0 { x } else { bar.length() - x },
        emitted: tau,
    })
}

/// Time from which the load of an end disturbs the bar at rest, and the speed in the fastest state of the end before
/// `until`; None if the load never disturbs the bar.
fn wakened(bar: &Bar, side: usize, until: f64) -> Option<(f64, f64)> {
    let (material, rest) = (bar.material(), bar.at_start(0.0)[0]);
    let sign = if side == 0 { -1.0 } else { 1.0 };
    let end = &bar.ends()[side];
    if matches!(end, End::Wall) {
        return None;
    }
    let time = |i: usize| until * i as f64 / SAMPLES as f64;
    let stresses = (0..=SAMPLES).map(|i| (i, sign * end.force(time(i)) / bar.area()));
    let held = material.stress(rest);
    let off = |(_, stress): &(usize, f64)| {
        (stress - held).abs()
            > 1e-12 * (held.abs() + material.density() * material.speed(rest).powi(2))
    };
    let mut woken = stresses.filter(off).peekable();
    // Between two samples at the earliest.
    let since = time(woken.peek()?.0.saturating_sub(1));
    let speeds =
        woken.filter_map(|(_, stress)| Some(material.speed(material.stretch(stress).ok()?)));
    Some((since, speeds.fold(material.speed(rest), f64::max)))
}

/// An acceleration wave that runs into a uniform state at rest: a front across which the acceleration jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelerationWave {
    /// Jump of the acceleration at the start, positive if it pushes in the direction of the front, and compresses.
    pub start: f64,
    /// Time at which the jump becomes infinite and a shock forms; a wave with negative time decays. Infinite for a
    /// linear law.
    pub blow_up: f64,
    /// Distance travelled by the front until the blow-up.
    pub distance: f64,
}

impl AccelerationWave {
    /// An acceleration wave into the uniform stretch `stretch` at rest, with this jump at the start:
    /// a' = -sigma'' a^2/(2 density c^3).
    ///
    /// # Errors
    /// A stretch outside the reach of the law.
    pub fn new(material: &Material, stretch: f64, start: f64) -> snaprod_core::Result<Self> {
        material.check(stretch)?;
        let c = material.speed(stretch);
        let blow_up = -2.0 * material.density() * c.powi(3) / (material.jet(stretch)[3] * start);
        Ok(Self {
            start,
            blow_up,
            distance: c * blow_up,
        })
    }

    /// The jump at `t`, while it is finite.
    pub fn at(&self, t: f64) -> f64 {
        self.start / (1.0 - t / self.blow_up)
    }
}
