//! A law of a medium in one dimension: waves between two states, and the state between two waves.
//!
//! The medium has a stretch lam, a velocity v, a stress sigma(lam) that grows with the stretch, and a density, all over
//! the material:
//!
//! ```text
//! lam_t = v_X,   density v_t = sigma(lam)_X.
//! ```
//!
//! A bar is such a medium (docs/bars.md 1). So is the fluid in a light tube, with X the volume of fluid, lam = 1/A and
//! sigma = -Pi (docs/tubes.md 5).

mod hull;

pub use hull::{Wave, WaveKind};

use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;

/// A law sigma(lam) with a density; see the head of the module.
pub trait Law1d {
    /// Mass per material length, or volume.
    fn density(&self) -> f64;

    /// The open interval of stretches with growing stress, in which waves have a speed.
    fn reach(&self) -> [f64; 2];

    /// Stretches, in growing order, at which the curvature of the stress changes sign or the slope of the stress jumps.
    fn bends(&self) -> &[f64];

    /// \[W, sigma, sigma', sigma''\] at a stretch inside the reach, with the energy W, W' = sigma. Of sigma'' the sign
    /// alone is used.
    fn jet(&self, lam: f64) -> [f64; 4];

    /// The integral of the speed from one stretch to another: the change of velocity across a fan.
    fn phi(&self, from: f64, to: f64) -> f64;

    /// A stretch inside the reach, at which a search may begin.
    fn middle(&self) -> f64 {
        1.0
    }

    /// The strain energy.
    fn energy(&self, lam: f64) -> f64 {
        self.jet(lam)[0]
    }

    /// The stress.
    fn stress(&self, lam: f64) -> f64 {
        self.jet(lam)[1]
    }

    /// The speed of waves over the material, (sigma'/density)^1/2.
    fn speed(&self, lam: f64) -> f64 {
        (self.jet(lam)[2] / self.density()).sqrt()
    }

    /// The greatest speed of waves at the stretches from `a` to `b`, an upper bound for the parts of the wave between
    /// them.
    fn fastest(&self, a: f64, b: f64) -> f64 {
        let (low, high) = (a.min(b), a.max(b));
        let inner = self.bends().iter().copied();
        let inner = inner.filter(|lam| low < *lam && *lam < high);
        let speeds = inner.map(|lam| self.speed(lam));
        speeds.fold(self.speed(a).max(self.speed(b)), f64::max)
    }

    /// The parts of the wave that changes the stretch `ahead` of it to the stretch `behind` it, the foremost first:
    /// the upper concave hull of the stress if the wave stretches, the lower convex hull if it shortens; chords are
    /// shocks, arcs fans.
    fn waves(&self, ahead: f64, behind: f64) -> Vec<Wave> {
        hull::waves(self, ahead, behind)
    }

    /// The speed of a shock, density s^2 = \[sigma\]/\[lam\]; the speed of waves if the states are equal.
    fn chord_speed(&self, from: f64, to: f64) -> f64 {
        let width = to - from;
        // Below this the difference of the stresses loses more digits than the curvature of the law contributes.
        if width.abs() >= 1e-8 * from {
            let rise = self.stress(to) - self.stress(from);
            return (rise / width / self.density()).sqrt();
        }
        let slope = |a: f64, b: f64| self.jet(0.5 * (a + b))[2];
        let between = |bend: &&f64| from.min(to) < **bend && **bend < from.max(to);
        match self.bends().iter().find(between) {
            Some(bend) => {
                let part = (bend - from) / width;
                let mean = part * slope(from, *bend) + (1.0 - part) * slope(*bend, to);
                (mean / self.density()).sqrt()
            }
            None => self.speed(0.5 * (from + to)),
        }
    }

    /// Energy that a shock dissipates per area and time: its speed times the area between the stress and its chord.
    /// Negative for an inadmissible jump.
    fn dissipation(&self, ahead: f64, behind: f64) -> f64 {
        let [w0, s0, ..] = self.jet(ahead);
        let [w1, s1, ..] = self.jet(behind);
        self.chord_speed(ahead, behind) * (w0 - w1 - 0.5 * (s0 + s1) * (ahead - behind))
    }

    /// Change of the velocity by the wave from `ahead` to `behind`, positive for a stretching wave, and its
    /// derivative by `behind`. A wave towards -X adds the change, one towards +X subtracts it.
    fn velocity_jump(&self, ahead: f64, behind: f64) -> (f64, f64) {
        hull::velocity_jump(self, ahead, behind)
    }

    /// \[stretch, velocity\] between the waves of the Riemann problem of the states \[stretch, velocity\] `left` and
    /// `right`, which lie inside the reach; `None` if the state between is outside.
    fn star(&self, left: [f64; 2], right: [f64; 2]) -> Option<[f64; 2]> {
        let speeds = [left[0], right[0]].map(|lam| self.speed(lam));
        let apart = right[1] - left[1];
        // Guess for two weak waves.
        let guess = (apart + speeds[0] * left[0] + speeds[1] * right[0]) / (speeds[0] + speeds[1]);
        let residual = |lam: f64| {
            let (a, b) = (
                self.velocity_jump(left[0], lam),
                self.velocity_jump(right[0], lam),
            );
            Some((a.0 + b.0 - apart, a.1 + b.1))
        };
        let stretch = self.increasing(guess, residual)?;
        let (a, b) = (
            self.velocity_jump(left[0], stretch).0,
            self.velocity_jump(right[0], stretch).0,
        );
        Some([stretch, 0.5 * (left[1] + a + right[1] - b)])
    }

    /// The stretch behind the wave into the stretch `ahead` that changes the velocity by `rise`, see
    /// [`Law1d::velocity_jump`]; `None` if the stretch behind is outside the reach.
    fn stretch_behind(&self, ahead: f64, rise: f64) -> Option<f64> {
        let residual = |lam: f64| {
            let (value, slope) = self.velocity_jump(ahead, lam);
            Some((value - rise, slope))
        };
        self.increasing(ahead + rise / self.speed(ahead), residual)
    }

    /// The root in the reach of a growing function with its derivative: Newton inside a bracket. None if there is none.
    fn increasing(&self, guess: f64, f: impl Fn(f64) -> Option<(f64, f64)>) -> Option<f64> {
        let [mut low, mut high] = self.reach();
        let inside = low < guess && guess < high;
        let mut x = if inside { guess } else { self.middle() };
        for _ in 0..200 {
            let (value, slope) = f(x)?;
            if value == 0.0 {
                return Some(x);
            }
            if value < 0.0 {
                low = x;
            } else if value > 0.0 {
                high = x;
            } else {
                return None;
            }
            // Bounded by a factor, since the law may be arbitrarily steep.
            let newton = (x - value / slope).clamp(0.25 * x, 4.0 * x);
            if (newton - x).abs() <= 2.0 * f64::EPSILON * x {
                return Some(newton);
            }
            let next = match low < newton && newton < high {
                true => newton,
                false if high.is_finite() => 0.5 * (low + high),
                false if newton <= low => 0.5 * (low + x),
                false => return None,
            };
            if (next - x).abs() <= 2.0 * f64::EPSILON * x {
                // At an edge of the reach the last iterate is a root only if the function vanishes.
                return (value.abs() <= 1e-9 * slope * x).then_some(next);
            }
            x = next;
        }
        None
    }
}

/// Nodes of a panel of the quadrature of [`Law1d::phi`].
const PANEL: usize = 12;

/// Quadrature of smooth functions of a stretch to rounding, by panels that are halved.
#[derive(Debug, Clone, PartialEq)]
pub struct Panels {
    nodes: [f64; PANEL],
    weights: [f64; PANEL],
}

impl Default for Panels {
    fn default() -> Self {
        let rule = Rule::new(PANEL);
        Self {
            nodes: std::array::from_fn(|i| rule.nodes[i]),
            weights: std::array::from_fn(|i| rule.weights[i]),
        }
    }
}

impl Panels {
    /// The integral of `f` between two stretches, with panels that end at the growing `knots`, where f is not smooth.
    pub fn integral(&self, f: &dyn Fn(f64) -> f64, knots: &[f64], from: f64, to: f64) -> f64 {
        let (low, high) = (from.min(to), from.max(to));
        let inner = knots.iter().copied().filter(|at| low < *at && *at < high);
        let (mut at, mut sum) = (low, 0.0);
        for end in inner.chain([high]) {
            sum += self.panel(f, at, end);
            at = end;
        }
        if from < to { sum } else { -sum }
    }

    fn panel(&self, f: &dyn Fn(f64) -> f64, from: f64, to: f64) -> f64 {
        let whole = self.rule(f, from, to);
        // Far below the distance to any singularity of the speed.
        if (to - from).abs() < 1e-3 * from.min(to) {
            return whole;
        }
        self.halved(f, [from, to], whole, f64::EPSILON * whole.abs())
    }

    fn halved(&self, f: &dyn Fn(f64) -> f64, [from, to]: [f64; 2], whole: f64, floor: f64) -> f64 {
        let middle = 0.5 * (from + to);
        let (a, b) = (self.rule(f, from, middle), self.rule(f, middle, to));
        // A rule of 12 nodes gains some 7 digits by halving: 1e-8 here is rounding in the halves. NaN is not refined
        // either.
        let refined = (a + b - whole).abs();
        if !(refined > floor && refined > 1e-9 * whole.abs()) {
            return a + b;
        }
        self.halved(f, [from, middle], a, floor) + self.halved(f, [middle, to], b, floor)
    }

    fn rule(&self, f: &dyn Fn(f64) -> f64, from: f64, to: f64) -> f64 {
        let width = to - from;
        let nodes = self.nodes.iter().zip(&self.weights);
        let sum: f64 = nodes.map(|(x, weight)| weight * f(from + width * x)).sum();
        width * sum
    }
}

/// Zeros of a function between two stretches at which the function changes sign, sought in steps by the factor `fine`.
pub fn sign_changes(f: &dyn Fn(f64) -> f64, [low, high]: [f64; 2], fine: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let (mut lam, mut here) = (low, f(low));
    while lam < high {
        let next = (lam * fine).min(high);
        let there = f(next);
        if here * there < 0.0 {
            found.extend(chandrupatla(f, (lam, here), (next, there), 0.0));
        }
        (lam, here) = (next, there);
    }
    found
}
