//! Uniaxial hyperelastic laws: energy, stress, speed and the integral Phi of the speed (docs/bars.md 1).

use super::positive;
use crate::law1d::{Law1d, Panels, sign_changes};
use snaprod_core::error::{Error, Result};
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
    /// Stretches at which the law is not smooth: the rows of a table.
    knots: Vec<f64>,
    panels: Panels,
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
        let reach = kind.reach();
        Ok(Self {
            inflections: kind.inflections(reach),
            knots: match &kind {
                MaterialKind::Table(knots) => knots.iter().map(|knot| knot.lam).collect(),
                _ => Vec::new(),
            },
            kind,
            density,
            reach,
            panels: Panels::default(),
        })
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
}

impl Law1d for Material {
    fn density(&self) -> f64 {
        self.density
    }

    fn reach(&self) -> [f64; 2] {
        self.reach
    }

    fn bends(&self) -> &[f64] {
        &self.inflections
    }

    #[inline]
    fn jet(&self, lam: f64) -> [f64; 4] {
        self.kind.jet(lam)
    }

    fn phi(&self, from: f64, to: f64) -> f64 {
        self.panels
            .integral(&|lam| self.speed(lam), &self.knots, from, to)
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
        sign_changes(&bend, [low.max(1.0 / FAR), high.min(FAR)], FINE)
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
