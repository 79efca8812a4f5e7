//! Uniaxial hyperelastic laws: energy, stress, speed and the integral Phi of the speed (docs/bars.md 1).

use super::positive;
use snaprod_core::error::{Error, Result};
use snaprod_core::math::gauss::Rule;
use snaprod_core::solve::roots::chandrupatla;

/// A law as given in a scene; sigma is force per undeformed area. The neo-Hookean, Mooney and Biderman laws are those
/// of an incompressible material in uniaxial stress, I1 = lam^2 + 2/lam, I2 = 2 lam + 1/lam^2.
#[derive(Debug, Clone, PartialEq)]
pub enum Stress {
    /// sigma = modulus (lam - 1).
    Linear(f64),
    /// W = C (I1 - 3).
    NeoHookean(f64),
    /// W = C1 (I1 - 3) + C2 (I2 - 3).
    Mooney(f64, f64),
    /// W = B1 (I1 - 3) + B2 (I1 - 3)^2 + B3 (I1 - 3)^3 + B4 (I2 - 3).
    Biderman([f64; 4]),
    /// sigma = sum of a_k (lam - 1)^k, k = 1, 2, ..
    Polynomial(Vec<f64>),
    /// Rows \[lam, sigma\] of growing lam and sigma, among them \[1, 0\]: a monotone cubic between them.
    Table(Vec<[f64; 2]>),
}

/// A law with its density.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    kind: MaterialKind,
    density: f64,
    /// Interval of stretches around 1 in which the stress grows: the speed of waves is real.
    reach: [f64; 2],
    /// Stretches at which the curvature of the stress changes sign, in growing order.
    inflections: Vec<f64>,
    nodes: [f64; PANEL],
    weights: [f64; PANEL],
}

#[derive(Debug, Clone, PartialEq)]
enum MaterialKind {
    /// Coefficients of j, j^2, j^3, k with j = I1 - 3, k = I2 - 3.
    Invariants([f64; 4]),
    Polynomial(Vec<f64>),
    Table(Vec<Knot>),
}

/// A point of a table, with the slope of the stress and the energy at the point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    lam: f64,
    sigma: f64,
    slope: f64,
    energy: f64,
}

/// Nodes of a panel of the quadrature of Phi.
const PANEL: usize = 12;
/// Zeros of sigma' and sigma'' are sought between 1/FAR and FAR, in steps of lam by the factor FINE.
const FAR: f64 = 1e3;
const FINE: f64 = 1.01;

impl Material {
    /// The law with a density.
    ///
    /// # Errors
    /// A density that is not positive; numbers that make no law: not finite, or of a stress that does not grow at
    /// lam = 1.
    pub fn new(stress: &Stress, density: f64) -> Result<Self> {
        positive("density", density)?;
        let kind = match stress {
            Stress::Linear(modulus) => MaterialKind::Polynomial(vec![*modulus]),
            Stress::NeoHookean(c) => MaterialKind::Invariants([*c, 0.0, 0.0, 0.0]),
            Stress::Mooney(c1, c2) => MaterialKind::Invariants([*c1, 0.0, 0.0, *c2]),
            Stress::Biderman(b) => MaterialKind::Invariants(*b),
            Stress::Polynomial(a) => MaterialKind::Polynomial(a.clone()),
            Stress::Table(rows) => MaterialKind::Table(knots(rows)?),
        };
        let slope = kind.jet(1.0)[2];
        if !(slope > 0.0 && slope.is_finite()) {
            return Err(Error::domain(format!(
                "the stress of {stress:?} must grow with the stretch: its slope at stretch 1 is {slope}"
            )));
        }
        let rule = Rule::new(PANEL);
        let reach = kind.reach();
        Ok(Self {
            inflections: kind.inflections(reach),
            kind,
            density,
            reach,
            nodes: std::array::from_fn(|i| rule.nodes[i]),
            weights: std::array::from_fn(|i| rule.weights[i]),
        })
    }

    /// Mass per undeformed volume.
    pub fn density(&self) -> f64 {
        self.density
    }

    /// The open interval of stretches around 1 in which the stress grows, so that waves have a speed.
    pub fn reach(&self) -> [f64; 2] {
        self.reach
    }

    /// Stretches at which the curvature of the stress changes sign.
    pub fn inflections(&self) -> &[f64] {
        &self.inflections
    }

    /// Refuses a stretch outside the reach.
    ///
    /// # Errors
    /// A stretch that is not inside; NaN.
    pub fn check(&self, lam: f64) -> Result<()> {
        let [low, high] = self.reach;
        if low < lam && lam < high {
            return Ok(());
        }
        Err(Error::domain(format!(
            "the stretch {lam} must lie between {low} and {high}, where the stress of the bar grows with the stretch"
        )))
    }

    /// \[W, sigma, sigma', sigma''\] at a stretch inside the reach.
    #[inline]
    pub fn jet(&self, lam: f64) -> [f64; 4] {
        self.kind.jet(lam)
    }

    /// The strain energy per undeformed volume.
    pub fn energy(&self, lam: f64) -> f64 {
        self.jet(lam)[0]
    }

    /// The stress, force per undeformed area.
    pub fn stress(&self, lam: f64) -> f64 {
        self.jet(lam)[1]
    }

    /// The speed of waves over the material, (sigma'/density)^1/2.
    pub fn speed(&self, lam: f64) -> f64 {
        (self.jet(lam)[2] / self.density).sqrt()
    }

    /// The greatest speed of waves at the stretches from `a` to `b`, an upper bound for the parts of the wave between
    /// them.
    pub(super) fn fastest(&self, a: f64, b: f64) -> f64 {
        let (low, high) = (a.min(b), a.max(b));
        let inner = self.inflections.iter().copied();
        let inner = inner.filter(|lam| low < *lam && *lam < high);
        let speeds = inner.map(|lam| self.speed(lam));
        speeds.fold(self.speed(a).max(self.speed(b)), f64::max)
    }

    /// The stretch at the stress `sigma`.
    ///
    /// # Errors
    /// A stress that no stretch inside the reach has.
    pub fn stretch(&self, sigma: f64) -> Result<f64> {
        let beyond = || {
            Error::unreachable(format!(
                "no stretch between {} and {} has the stress {sigma}",
                self.reach[0], self.reach[1]
            ))
        };
        let residual = |lam: f64| {
            let [_, stress, slope, _] = self.jet(lam);
            Some((stress - sigma, slope))
        };
        self.increasing(1.0, residual).ok_or_else(beyond)
    }

    /// Stresses and slopes of the stress at many stretches; false if one of these is outside the reach.
    pub(super) fn fill(&self, lam: &[f64], sigma: &mut [f64], slope: &mut [f64]) -> bool {
        let [low, high] = self.reach;
        let inside = lam
            .iter()
            .fold(true, |inside, &x| inside & (low < x) & (x < high));
        let out = lam.iter().zip(sigma.iter_mut().zip(slope));
        if let MaterialKind::Invariants([c1, 0.0, 0.0, c2]) = self.kind {
            for (&lam, (sigma, slope)) in out {
                let r = 1.0 / lam;
                let r3 = r * r * r;
                *sigma = 2.0 * (1.0 - r3) * (c1 * lam + c2);
                *slope = 2.0 * (c1 * (1.0 + 2.0 * r3) + 3.0 * c2 * r3 * r);
            }
        } else {
            for (&lam, (sigma, slope)) in out {
                [_, *sigma, *slope, _] = self.jet(lam);
            }
        }
        inside
    }

    /// Phi(to) - Phi(from), the integral of the speed, to rounding: the change of velocity across a fan.
    pub fn phi(&self, from: f64, to: f64) -> f64 {
        let MaterialKind::Table(knots) = &self.kind else {
            return self.panel(from, to);
        };
        let (low, high) = (from.min(to), from.max(to));
        let inner = knots.iter().map(|knot| knot.lam);
        let inner: Vec<f64> = inner.filter(|lam| low < *lam && *lam < high).collect();
        let ends = [&[low][..], &inner, &[high]].concat();
        let sum: f64 = ends
            .windows(2)
            .map(|pair| self.panel(pair[0], pair[1]))
            .sum();
        if from < to { sum } else { -sum }
    }

    fn panel(&self, from: f64, to: f64) -> f64 {
        let whole = self.rule(from, to);
        // Far below the distance to any singularity of the speed.
        if (to - from).abs() < 1e-3 * from.min(to) {
            return whole;
        }
        self.halved(from, to, whole, f64::EPSILON * whole.abs())
    }

    fn halved(&self, from: f64, to: f64, whole: f64, floor: f64) -> f64 {
        let middle = 0.5 * (from + to);
        let (a, b) = (self.rule(from, middle), self.rule(middle, to));
        // A rule of 12 nodes gains some 7 digits by halving: 1e-8 here is rounding in the halves. NaN is not refined
        // either.
        let refined = (a + b - whole).abs();
        if !(refined > floor && refined > 1e-9 * whole.abs()) {
            return a + b;
        }
        self.halved(from, middle, a, floor) + self.halved(middle, to, b, floor)
    }

    fn rule(&self, from: f64, to: f64) -> f64 {
        let width = to - from;
        let nodes = self.nodes.iter().zip(&self.weights);
        let sum: f64 = nodes
            .map(|(x, weight)| weight * self.speed(from + width * x))
            .sum();
        width * sum
    }

    /// The root in the reach of a growing function with its derivative: Newton inside a bracket. None if there is none.
    pub(super) fn increasing(
        &self,
        guess: f64,
        f: impl Fn(f64) -> Option<(f64, f64)>,
    ) -> Option<f64> {
        let [mut low, mut high] = self.reach;
        let inside = low < guess && guess < high;
        let mut x = if inside { guess } else { 1.0 };
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

impl MaterialKind {
    #[inline]
    fn jet(&self, lam: f64) -> [f64; 4] {
        match self {
            Self::Invariants([b1, b2, b3, b4]) => {
                let r = 1.0 / lam;
                let (r2, e) = (r * r, lam - 1.0);
                let r3 = r2 * r;
                // Factored, so that no digits cancel near lam = 1.
                let j = e * e * (lam + 2.0) * r;
                let k = e * e * (2.0 * lam + 1.0) * r2;
                let j1 = 2.0 * e * (lam * lam + lam + 1.0) * r2;
                let k1 = j1 * r;
                let (j2, k2) = (2.0 + 4.0 * r3, 6.0 * r2 * r2);
                let (j3, k3) = (-12.0 * r2 * r2, -24.0 * r2 * r3);
                let f1 = b1 + j * (2.0 * b2 + j * 3.0 * b3);
                let f2 = 2.0 * b2 + 6.0 * b3 * j;
                [
                    j * (b1 + j * (b2 + j * b3)) + b4 * k,
                    f1 * j1 + b4 * k1,
                    f1 * j2 + f2 * j1 * j1 + b4 * k2,
                    f1 * j3 + 3.0 * f2 * j1 * j2 + 6.0 * b3 * j1 * j1 * j1 + b4 * k3,
                ]
            }
            Self::Polynomial(a) => {
                let e = lam - 1.0;
                let mut jet = [0.0; 4];
                for (k, a) in a.iter().enumerate().rev() {
                    let n = (k + 1) as f64;
                    jet[0] = jet[0] * e + a / (n + 1.0);
                    jet[1] = jet[1] * e + a;
                    jet[2] = jet[2] * e + n * a;
                    if k > 0 {
                        jet[3] = jet[3] * e + n * (n - 1.0) * a;
                    }
                }
                [jet[0] * e * e, jet[1] * e, jet[2], jet[3]]
            }
            Self::Table(knots) => {
                let after = knots.partition_point(|knot| knot.lam <= lam);
                let i = after.clamp(1, knots.len() - 1);
                cubic(&knots[i - 1], &knots[i], lam)
            }
        }
    }

    /// From 1 in both directions, up to where the stress ceases to grow.
    fn reach(&self) -> [f64; 2] {
        if let Self::Table(knots) = self {
            return [knots[0].lam, knots[knots.len() - 1].lam];
        }
        let slope = |lam: f64| self.jet(lam)[2];
        [1.0 / FINE, FINE].map(|factor| {
            let (mut lam, mut here) = (1.0, slope(1.0));
            while lam < FAR && lam > 1.0 / FAR {
                let next = lam * factor;
                let there = slope(next);
                if !(there > 0.0) {
                    let edge = chandrupatla(slope, (lam, here), (next, there), 0.0);
                    return edge.unwrap_or(lam);
                }
                (lam, here) = (next, there);
            }
            if factor < 1.0 { 0.0 } else { f64::INFINITY }
        })
    }

    fn inflections(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let bend = |lam: f64| self.jet(lam)[3];
        let mut found = Vec::new();
        if let Self::Table(knots) = self {
            // Linear in each interval, with jumps at the knots.
            let mut before = 0.0;
            for pair in knots.windows(2) {
                let [a, b] = [pair[0].lam, pair[1].lam];
                let ends = [a, b].map(|lam| cubic(&pair[0], &pair[1], lam)[3]);
                if before * ends[0] < 0.0 {
                    found.push(a);
                }
                if ends[0] * ends[1] < 0.0 {
                    found.push(a + (b - a) * ends[0] / (ends[0] - ends[1]));
                }
                before = if ends[1] == 0.0 { ends[0] } else { ends[1] };
            }
            return found;
        }
        let mut lam = low.max(1.0 / FAR);
        let mut here = bend(lam);
        while lam < high.min(FAR) {
            let next = lam * FINE;
            let there = bend(next);
            if here * there < 0.0 {
                found.extend(chandrupatla(bend, (lam, here), (next, there), 0.0));
            }
            (lam, here) = (next, there);
        }
        found
    }
}

/// Hermite's cubic between two knots, with its integral.
fn cubic(a: &Knot, b: &Knot, lam: f64) -> [f64; 4] {
    let h = b.lam - a.lam;
    let x = (lam - a.lam) / h;
    let rise = b.sigma - a.sigma;
    let c2 = 3.0 * rise - h * (2.0 * a.slope + b.slope);
    let c3 = -2.0 * rise + h * (a.slope + b.slope);
    let (c0, c1) = (a.sigma, h * a.slope);
    [
        a.energy + h * x * (c0 + x * (c1 / 2.0 + x * (c2 / 3.0 + x * c3 / 4.0))),
        c0 + x * (c1 + x * (c2 + x * c3)),
        (c1 + x * (2.0 * c2 + x * 3.0 * c3)) / h,
        (2.0 * c2 + x * 6.0 * c3) / (h * h),
    ]
}

/// Slopes by the weighted harmonic mean of Fritsch and Butland, at most twice the lesser secant: the cubics grow
/// strictly.
fn knots(rows: &[[f64; 2]]) -> Result<Vec<Knot>> {
    let grows = rows
        .windows(2)
        .all(|p| p[0][0] < p[1][0] && p[0][1] < p[1][1]);
    let finite = rows.iter().flatten().all(|x| x.is_finite());
    let rest = rows.iter().position(|row| *row == [1.0, 0.0]);
    let (true, true, Some(rest)) = (
        grows && finite && rows.len() > 1,
        rows.first().is_some_and(|row| row[0] > 0.0),
        rest,
    ) else {
        return Err(Error::domain(format!(
            "the table {rows:?} of a stress must hold finite rows [stretch, stress], both growing, stretches > 0, one of them [1, 0]"
        )));
    };
    let step = |i: usize| rows[i + 1][0] - rows[i][0];
    let secant = |i: usize| (rows[i + 1][1] - rows[i][1]) / step(i);
    let last = rows.len() - 1;
    let slope = |i: usize| match i {
        0 => secant(0),
        i if i == last => secant(last - 1),
        i => {
            let (a, b) = (step(i - 1), step(i));
            3.0 * (a + b) / ((2.0 * b + a) / secant(i - 1) + (b + 2.0 * a) / secant(i))
        }
    };
    let mut knots: Vec<Knot> = (0..=last)
        .map(|i| Knot {
            lam: rows[i][0],
            sigma: rows[i][1],
            slope: slope(i),
            energy: 0.0,
        })
        .collect();
    for i in 0..last {
        knots[i + 1].energy = cubic(&knots[i], &knots[i + 1], knots[i + 1].lam)[0];
    }
    let zero = knots[rest].energy;
    for knot in &mut knots {
        knot.energy -= zero;
    }
    Ok(knots)
}
