//! The elastica's chart near the straight rod: q = (sigma, ln Z), by Cartesian components of the end force.
//!
//! The amplitude chart (p, w) is polar: kap is the sine of half the angle between tip and force, lam^2 the size of
//! the force. A mass that shakes along the rod takes the pull through zero, past the pole at lam = 0, twice in every
//! period. Cartesian force components have no pole. From the free end, with delta = theta(1) - theta and
//! z = tan(delta/2), the rod obeys
//! ```text
//! ds = dz / sqrt(z (G + P z)(1 + z^2)),     (P, G): pull along the tip's tangent, and across it
//! z = Z chi(sigma),   chi = (cosh(b sigma) - 1)/(cosh b - 1),   b^2 = P
//! ds = dsigma / sqrt(1 + z^2),   0 <= sigma <= 1
//! ```
//! The rod of P and Z = tan(theta(1)/2) thus has the length l = int dsigma/sqrt(1 + z^2), by which it is scaled to 1.
//! Its end and its energy are
//! ```text
//! 1 - x = 2 Z^2/(l (1 + Z^2)) int (1 - chi)^2 (1 + z^2)^(-3/2) dsigma
//!     y = 2 Z/(l (1 + Z^2)) int (1 - chi)(1 + Z^2 chi) (1 + z^2)^(-3/2) dsigma
//!     U = 2 l Z^2 int chi'^2 (1 + z^2)^(-3/2) dsigma
//! ```
//! For small z the square roots are series in z^2. All quantities are then sums of the moments M_k = int chi^k,
//! smooth functions of P through 0, to the first fold and beyond. There is no elliptic integral and no difference of
//! nearly equal numbers; relative accuracy holds down to Z = 1e-100. To leading order this is the beam under tension
//! of theory 2.3.

use super::chart::{Integrals, Modulus};
use crate::manifold::{ManifoldPoint, Sign, adjugate_times};
use nalgebra::{Matrix2, Vector2};

/// Largest z at which a motion stays in this chart; there the terms left out of the series are of relative size
/// 3e-16.
const MAX_Z: f64 = 1e-2;
/// Largest z of any point of the chart: an integrator's trial step may pass [`MAX_Z`], but not reach where the
/// series lose digits.
const MAX_TRIAL_Z: f64 = 2.0 * MAX_Z;
/// Largest z at which a motion enters this chart, below [`MAX_Z`] for hysteresis.
const ENTRY_Z: f64 = 0.6 * MAX_Z;
/// Largest Z of the pulled rods served by [`modulus_under_pull`].
const MAX_PULLED_Z: f64 = 0.1 * MAX_Z;
/// Smallest Z of the chart: its square is still a normal number.
const MIN_Z: f64 = 1e-100;
/// Smallest Z given to a rod on the axis.
const ON_AXIS_Z: f64 = 1e-90;
/// Largest push -P of the chart, beyond that of the first fold, 36.21. At 4 pi^2 the end is parallel to the clamp for
/// every shape.
const MOST_PUSH: f64 = 38.0;
/// Amplitude w at which lam^2 is about [`MOST_PUSH`].
const MOST_W: f64 = 6.1;

/// Pull P = -lam^2 at the first fold of the straight rod, and pull at which a rod that leaves this fold lands. Both
/// shapes have (1 - x)/y^2 = 0.734496396.
const FOLD: f64 = -36.211_401_677_2;
const LANDING: f64 = -9.436_451_114_8;
/// Newton steps from [`LANDING`]; the guess is wrong by Z^2.
const NEWTON: usize = 4;

/// Coefficients of (1 + z^2)^(-1/2) and (1 + z^2)^(-3/2) in powers of z^2.
const LENGTH: [f64; 4] = [1.0, -0.5, 0.375, -0.3125];
const TIP: [f64; 4] = [1.0, -1.5, 1.875, -2.1875];

/// Newton steps to the rod of a given deflection or load.
const ROUNDS: usize = 3;

/// |P| below which the moments come from their series in P (which converges for |P| < 4 pi^2), and its number
/// of terms.
pub(super) const SERIES_MAX_PULL: f64 = 3.0;
const TERMS: usize = 18;
/// Highest moment.
const ORDER: usize = 8;

/// Coefficients of P^j in (g, M_1, .., M_8), from
/// ```text
/// M_k = (sinh(b)/b - (k+1)/2 P q M_(k+1)) / (2k+1),   q = 2 (cosh b - 1)/P,   g = 4/q
/// ```
const SERIES: [[f64; ORDER + 1]; TERMS] = series();

const fn series() -> [[f64; ORDER + 1]; TERMS] {
    let (mut q, mut sinh) = ([1.0; TERMS], [1.0; TERMS]);
    let mut j = 1;
    while j < TERMS {
        let n = 2.0 * j as f64;
        q[j] = q[j - 1] / ((n + 1.0) * (n + 2.0));
        sinh[j] = sinh[j - 1] / (n * (n + 1.0));
        j += 1;
    }
    let mut table = [[0.0; ORDER + 1]; TERMS];
    table[0][0] = 4.0;
    j = 1;
    while j < TERMS {
        let mut i = 1;
        while i <= j {
            table[j][0] -= q[i] * table[j - i][0];
            i += 1;
        }
        j += 1;
    }
    // The coefficient of P^j needs that of P^(j-1) in the next moment: moments TERMS orders higher do not count.
    let mut above = [0.0; TERMS];
    let mut k = ORDER + TERMS;
    while k > 0 {
        let mut moment = [0.0; TERMS];
        j = 0;
        while j < TERMS {
            let (mut product, mut i) = (0.0, 0);
            while i < j {
                product += q[i] * above[j - 1 - i];
                i += 1;
            }
            moment[j] = (sinh[j] - 0.5 * (k as f64 + 1.0) * product) / (2.0 * k as f64 + 1.0);
            if k <= ORDER {
                table[j][k] = moment[j];
            }
            j += 1;
        }
        above = moment;
        k -= 1;
    }
    table
}

/// Factor g = 2 P/(cosh b - 1) of the cross force at the tip, G = g Z, the moments M_0 .. M_8, and the derivatives of
/// all by P.
pub(super) struct Moments {
    pub g: f64,
    pub m: [f64; ORDER + 1],
    pub slope: [f64; ORDER + 1],
}

impl Moments {
    #[inline]
    pub fn new(pull: f64) -> Self {
        let mut slope = [0.0; ORDER + 1];
        if pull.abs() < SERIES_MAX_PULL {
            let mut value = SERIES[TERMS - 1];
            for row in SERIES[..TERMS - 1].iter().rev() {
                for k in 0..=ORDER {
                    slope[k] = slope[k] * pull + value[k];
                    value[k] = value[k] * pull + row[k];
                }
            }
            let g = value[0];
            (value[0], slope[0]) = (1.0, 0.0);
            return Self { g, m: value, slope };
        }
        // tau = chi'(1) = b coth(b/2).
        let b = pull.abs().sqrt();
        let (tau, g) = if pull > 0.0 {
            let e = (-b).exp();
            let rest = 1.0 - e;
            (b * (1.0 + e) / rest, 4.0 * pull * e / (rest * rest))
        } else {
            let (sin, cos) = (0.5 * b).sin_cos();
            (b * cos / sin, -pull / (sin * sin))
        };
        let inverse = 1.0 / pull;
        let tau_slope = (0.5 * tau - 0.25 * g) * inverse;
        let g_slope = g * (1.0 - 0.5 * tau) * inverse;
        let mut m = [1.0; ORDER + 1];
        // chi'^2 = P chi^2 + g chi, and so int (chi^(k-1) chi')' = chi'(1) = k P M_k + (k - 1/2) g M_(k-1).
        for k in 1..=ORDER {
            let (n, before) = (k as f64, k as f64 - 0.5);
            let share = inverse / n;
            m[k] = (tau - before * g * m[k - 1]) * share;
            slope[k] =
                (tau_slope - n * m[k] - before * (g_slope * m[k - 1] + g * slope[k - 1])) * share;
        }
        Self { g, m, slope }
    }

    /// chi'(1).
    fn tau(&self, pull: f64) -> f64 {
        pull * self.m[1] + 0.5 * self.g
    }
}

/// Sum over j of weights_j u^j f_j, its derivative by u, and the same sum with df/dP.
#[inline]
fn sum(weights: &[f64; 4], u: f64, f: impl Fn(usize) -> (f64, f64)) -> [f64; 3] {
    let (mut value, mut by_u, mut by_pull) = (0.0, 0.0, 0.0);
    for j in (0..4).rev() {
        let (f, f_pull) = f(2 * j);
        by_u = by_u * u + value;
        value = value * u + weights[j] * f;
        by_pull = by_pull * u + weights[j] * f_pull;
    }
    [value, by_u, by_pull]
}

/// Pull P = sigma sqrt(1 + sigma^2) and the root. P is linear in sigma for small pulls; sigma tends to lam for taut
/// rods.
#[inline]
fn pull_of(sigma: f64) -> (f64, f64) {
    let root = (1.0 + sigma * sigma).sqrt();
    (sigma * root, root)
}

fn sigma_of(pull: f64) -> f64 {
    pull * (2.0 / (1.0 + f64::hypot(1.0, 2.0 * pull))).sqrt()
}

/// Largest z along the rod. Under a strong push chi oscillates, and the maximum lies between clamp and tip.
#[inline]
fn largest(pull: f64, tip: f64) -> f64 {
    if pull > -10.0 {
        return tip;
    }
    let half = (0.5 * (-pull).sqrt()).sin();
    tip / (half * half)
}

/// Rod of unit length and stiffness, bent to the side of Z > 0.
struct BentRod {
    pull: f64,
    /// sqrt(1 + sigma^2).
    root: f64,
    z: f64,
    /// End (1 - x, y), and its derivatives by sigma and by ln Z.
    tip: [f64; 2],
    by_sigma: [f64; 2],
    by_ln: [f64; 2],
    /// Force of the rod on the body.
    force: [f64; 2],
    energy: f64,
}

impl BentRod {
    /// `None` outside the chart.
    #[inline]
    fn new(sigma: f64, ln_z: f64) -> Option<Self> {
        let z = ln_z.exp();
        let (pull, root) = pull_of(sigma);
        if !(pull > -MOST_PUSH && z >= MIN_Z && largest(pull, z) < MAX_TRIAL_Z) {
            return None;
        }
        let moments = Moments::new(pull);
        let (m, d, g) = (&moments.m, &moments.slope, moments.g);
        let u = z * z;
        let [l, l_u, l_pull] = sum(&LENGTH, u, |k| (m[k], d[k]));
        let second = |a: &[f64; ORDER + 1], k: usize| a[k] - 2.0 * a[k + 1] + a[k + 2];
        let [x, x_u, x_pull] = sum(&TIP, u, |k| (second(m, k), second(d, k)));
        let first = |k: usize| (m[k] - m[k + 1], d[k] - d[k + 1]);
        let [straight, straight_u, straight_pull] = sum(&TIP, u, first);
        let [bent, bent_u, bent_pull] = sum(&TIP, u, |k| first(k + 1));
        let (y, y_pull) = (straight + u * bent, straight_pull + u * bent_pull);
        let y_u = straight_u + bent + u * bent_u;
        let [stretch, ..] = sum(&TIP, u, |k| (pull * m[k + 2] + g * m[k + 1], 0.0));

        let (inverse, share) = (1.0 / l, 1.0 / (1.0 + u));
        let scale = 2.0 * z * inverse * share;
        // d ln(scale)/d ln Z and d ln(scale)/dP.
        let by_ln = 1.0 - 2.0 * u * (share + l_u * inverse);
        let by_pull = -l_pull * inverse;
        let short = scale * z;
        // dP/dsigma.
        let rate = (2.0 * root * root - 1.0) / root;
        let (along, across) = (pull * l * l, g * z * l * l);
        let (cos, sin) = ((1.0 - u) * share, 2.0 * z * share);
        Some(Self {
            pull,
            root,
            z,
            tip: [short * x, scale * y],
            by_sigma: [
                rate * short * (x_pull + by_pull * x),
                rate * scale * (y_pull + by_pull * y),
            ],
            by_ln: [
                short * ((1.0 + by_ln) * x + 2.0 * u * x_u),
                scale * (by_ln * y + 2.0 * u * y_u),
            ],
            force: [across * sin - along * cos, -along * sin - across * cos],
            energy: 2.0 * l * u * stretch,
        })
    }
}

/// Chart point at q = (+-sigma, ln Z), the sign of sigma being that of Z; `None` outside the chart.
#[inline]
pub(super) fn point(side: Sign, q: &Vector2<f64>) -> Option<ManifoldPoint<2>> {
    let sign = side.value();
    let rod = BentRod::new(sign * q[0], q[1])?;
    Some(ManifoldPoint {
        pose: Vector2::new(1.0 - rod.tip[0], sign * rod.tip[1]),
        force: Vector2::new(rod.force[0], sign * rod.force[1]),
        energy: rod.energy,
        jacobian: Matrix2::new(
            -sign * rod.by_sigma[0],
            -rod.by_ln[0],
            rod.by_sigma[1],
            sign * rod.by_ln[1],
        ),
        // Here det ~ Z^3/lam^2 at the taut wall; the pace makes time run like (1 - x)/lam.
        pace: rod.z / rod.root,
    })
}

/// Landing of a rod that leaves the first fold next to the straight rod at `q` = (p, w); `None` if `q` is no such
/// point.
///
/// Close to the straight rod the energy is the quadratic form of theta', and the fixed end restricts theta to a plane
/// and a sphere. Such a form has at most one local minimum besides the global one, so the landing is the other stable
/// rod with this end. Its (1 - x, y) is that of the fold to full relative accuracy, and its pull is [`LANDING`] up to
/// terms of order Z^2.
pub(super) fn landing(q: &Vector2<f64>) -> Option<Vector2<f64>> {
    let fold_side = entry_side(q[0], q[1])?;
    let fold = from_amplitude(q[0], q[1]);
    let rod = BentRod::new(fold_side.value() * fold[0], fold[1])?;
    // On the first fold y has the sign opposite to Z.
    if !((rod.pull - FOLD).abs() < 0.01 * FOLD.abs() && rod.tip[1] < 0.0) {
        return None;
    }
    let held = [rod.tip[0], -rod.tip[1]];
    let m = Moments::new(LANDING).m;
    let (mut sigma, mut ln_z) = (sigma_of(LANDING), (0.5 * held[1] / (1.0 - m[1])).ln());
    for _ in 0..NEWTON {
        let at = BentRod::new(sigma, ln_z)?;
        let gap = Vector2::new(held[0] - at.tip[0], held[1] - at.tip[1]);
        let slope = Matrix2::new(at.by_sigma[0], at.by_ln[0], at.by_sigma[1], at.by_ln[1]);
        let (det, step) = adjugate_times(&slope, &gap);
        sigma += step[0] / det;
        ln_z += step[1] / det;
    }
    let other = Sign::of(-fold_side.value());
    let landed = Vector2::new(other.value() * sigma, ln_z);
    Some(to_amplitude(other, &landed))
}

/// Distance 1 - x at (+-sigma, ln Z), to full relative accuracy; `None` outside the chart.
pub(super) fn inward(side: Sign, q: &Vector2<f64>) -> Option<f64> {
    Some(BentRod::new(side.value() * q[0], q[1])?.tip[0])
}

/// Chart point of the rod under `pull` whose end is deflected by the small `across`. A rod on the axis gets Z =
/// [`ON_AXIS_Z`].
pub(super) fn point_of_deflection(side: Sign, pull: f64, across: f64) -> Vector2<f64> {
    let height = across.abs();
    let sigma = sigma_of(pull);
    let z = 0.5 * height / (1.0 - Moments::new(pull).m[1]);
    let mut ln_z = z.max(ON_AXIS_Z).ln();
    // The first guess is right to leading order; each Newton step squares its error, which is of order y^2.
    for _ in 0..ROUNDS {
        let Some(rod) = BentRod::new(sigma, ln_z).filter(|_| z > ON_AXIS_Z) else {
            break;
        };
        ln_z += (height - rod.tip[1]) / rod.by_ln[1];
    }
    Vector2::new(sigma * side.value(), ln_z)
}

/// Modulus |p| of the rod pulled by the force `load`, which is almost parallel to the clamp; `None` for a push, and for
/// Z below [`MIN_Z`] or from [`MAX_PULLED_Z`] on.
///
/// In the axes of the tip's tangent, at the angle 2 atan Z, the load is (P l^2, g Z l^2).
pub(super) fn modulus_under_pull(load: &Vector2<f64>) -> Option<f64> {
    let (along, across) = (load.x, load.y.abs());
    // Start: the linear beam. Each round reduces the error by the factor Z^2.
    let mut pull = along;
    let mut z = across / (Moments::new(pull).g + 2.0 * pull);
    if !(along > 0.0 && (MIN_Z..MAX_PULLED_Z).contains(&z)) {
        return None;
    }
    for _ in 0..ROUNDS {
        let moments = Moments::new(pull);
        let u = z * z;
        let [l, ..] = sum(&LENGTH, u, |k| (moments.m[k], 0.0));
        pull = ((1.0 - u) * along + 2.0 * z * across) / ((1.0 + u) * l * l);
        z = (1.0 - u) * across / ((1.0 + u) * l * l * moments.g + 2.0 * along);
    }
    Some(to_amplitude(Sign::Plus, &Vector2::new(sigma_of(pull), z.ln()))[0])
}

/// Root lam of the pull; `None` under a push.
pub(super) fn lambda(side: Sign, q: &Vector2<f64>) -> Option<f64> {
    let sigma = side.value() * q[0];
    (sigma > 0.0).then(|| pull_of(sigma).0.sqrt())
}

/// True if a motion through q = (+-sigma, ln Z) may stay in this chart.
pub(super) fn stays_in_chart(side: Sign, q: &Vector2<f64>) -> bool {
    let (pull, _) = pull_of(side.value() * q[0]);
    let z = q[1].exp();
    pull > -MOST_PUSH && z > MIN_Z && largest(pull, z) < MAX_Z
}

/// Side of the straight rod on which (p, w) lies, if a motion should enter this chart there; `None` otherwise.
pub(super) fn entry_side(p: f64, w: f64) -> Option<Sign> {
    if !(w < MOST_W && p != 0.0) {
        return None;
    }
    let (Modulus { kap, kap_c }, z) = tip(p, w);
    // For w > pi/2 the rod is pushed, and |z| is at most 2 kap/kap' along it.
    let most = if w < 1.5 { z } else { 2.0 * kap / kap_c };
    (z.abs() > 2.0 * MIN_Z && most.abs() < ENTRY_Z).then(|| Sign::of(p))
}

/// Modulus, and Z = tan((alpha + 2 asin kap)/2) with alpha = -2 atan2(kap cos w, D), by the addition theorem.
fn tip(p: f64, w: f64) -> (Modulus, f64) {
    let modulus = Modulus::new(p);
    let Modulus { kap, kap_c } = modulus;
    let (s, c) = w.sin_cos();
    let d = (kap_c * kap_c + kap * kap * s * s).sqrt();
    // D - kap' c, from (D - kap' c)(D + kap' c) = sin^2 w.
    let gap = if c > 0.0 {
        s * s / (d + kap_c * c)
    } else {
        d - kap_c * c
    };
    (modulus, kap * gap / (kap_c * d + kap * kap * c))
}

/// Chart point (+-sigma, ln Z) of the rod (p, w) near the straight one.
pub(super) fn from_amplitude(p: f64, w: f64) -> Vector2<f64> {
    let (Modulus { kap, kap_c }, z) = tip(p, w);
    let lam = Integrals::new(p, w).lam;
    let along = lam * lam * (kap * kap - kap_c * kap_c);
    let u = z * z;
    let mut pull = along;
    // The length differs from 1 by Z^2: each round reduces the error by this factor.
    for _ in 0..6 {
        let m = Moments::new(pull).m;
        let [l, ..] = sum(&LENGTH, u, |k| (m[k], 0.0));
        pull = along / (l * l);
    }
    Vector2::new(sigma_of(pull) * Sign::of(p).value(), z.abs().ln())
}

/// Amplitude chart point (p, w) of the rod (+-sigma, ln Z).
///
/// In polar coordinates the force at the tip is P + i G = -lam^2 exp(-i psi), hence sinh p = tan(psi/2). At the clamp
/// kap sin w = theta'(0)/(2 lam) and kap cos w = sin(psi/2 - theta(1)/2).
pub(super) fn to_amplitude(side: Sign, q: &Vector2<f64>) -> Vector2<f64> {
    let z = q[1].exp();
    let (pull, _) = pull_of(side.value() * q[0]);
    let moments = Moments::new(pull);
    let across = moments.g * z;
    let force = pull.hypot(across);
    let p = if pull <= 0.0 {
        (across / (force - pull)).asinh()
    } else {
        // G decays like exp(-b) and may underflow; its logarithm does not.
        let b = pull.sqrt();
        let ln_g = (4.0 * pull).ln() - b - 2.0 * (-(-b).exp_m1()).ln();
        let ln_tan = (force + pull).ln() - ln_g - q[1];
        if ln_tan > 20.0 {
            ln_tan + std::f64::consts::LN_2
        } else {
            ln_tan.exp().asinh()
        }
    };
    let Modulus { kap, kap_c } = Modulus::new(p);
    let w = (z * moments.tau(pull) / force.sqrt()).atan2(kap - kap_c * z);
    let w = if w < 0.0 {
        w + std::f64::consts::TAU
    } else {
        w
    };
    Vector2::new(p * side.value(), w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::beam::straight_rod_constraint;
    use crate::elastica::{Elastica, Equilibrium};
    use crate::manifold::{EquilibriumManifold, adjugate_times};

    const SIZES: [f64; 5] = [1e-90, 1e-30, 1e-8, 1e-4, 4e-3];

    fn close(a: f64, b: f64, tolerance: f64) -> bool {
        (a - b).abs() <= tolerance * b.abs()
    }

    /// Catches a wrong moment, series or change of chart. Taut, slack, pushed and folding rods of every size agree
    /// with the amplitude chart, the round trip is exact to rounding, and the sign of det is kept.
    #[test]
    fn the_charts_agree() {
        let pulls = [
            -6.05, -6.0, -5.0, -4.5, -2.9, -1.6, -1.5, -1e-3, 0.7, 1.65, 1.75, 5.0, 30.0, 1e3, 1e8,
        ];
        for (side, sigma, z) in every(&pulls) {
            let q = Vector2::new(sigma * side.value(), f64::ln(z));
            let Some(at) = point(side, &q) else {
                assert!(sigma < -5.9 && z > 1e-3);
                continue;
            };
            let global = to_amplitude(side, &q);
            let back = from_amplitude(global[0], global[1]);
            assert!(
                (back - q).amax() <= 1e-14 * (1.0 + q.amax()),
                "{sigma}, {z:e}: {back:?}"
            );
            let exact = Equilibrium::new(global[0], global[1]).unwrap();
            let chart = Elastica.point(&global).unwrap();
            let rod = BentRod::new(sigma, f64::ln(z)).unwrap();
            let same = close(at.pose[1], exact.y, 1e-13)
                && (exact.one_minus_x == 0.0 || close(rod.tip[0], exact.one_minus_x, 1e-13))
                && close(at.energy, exact.energy, 1e-13)
                && close(at.force[0], exact.force[0], 1e-13)
                && close(at.force[1], exact.force[1], 1e-13);
            let det = |at: &ManifoldPoint<2>| adjugate_times(&at.jacobian, &at.pose).0;
            assert!(
                same && det(&at) * det(&chart).signum() > 0.0,
                "{sigma}, {z:e}: {exact:?} {at:?}"
            );
        }
    }

    fn every(pulls: &[f64]) -> Vec<(Sign, f64, f64)> {
        let sides = [Sign::Plus, Sign::Minus].into_iter();
        let with_pulls = sides.flat_map(|side| pulls.iter().map(move |sigma| (side, *sigma)));
        with_pulls
            .flat_map(|(side, sigma)| SIZES.map(|z| (side, sigma, z)))
            .collect()
    }

    /// Catches a wrong derivative: the Jacobian against differences of the tip, and dU = -force . d(x, y).
    #[test]
    fn derivatives_are_those_of_the_tip() {
        for sigma in [-5.5, -4.4, -2.9, -1.4, 0.3, 1.5, 8.0] {
            let (ln_z, h) = (f64::ln(5e-4), 1e-5);
            let at = |sigma: f64, ln_z: f64| BentRod::new(sigma, ln_z).unwrap();
            let rod = at(sigma, ln_z);
            let pairs = [
                (at(sigma + h, ln_z), at(sigma - h, ln_z), rod.by_sigma),
                (at(sigma, ln_z + h), at(sigma, ln_z - h), rod.by_ln),
            ];
            for (ahead, behind, slope) in pairs {
                for (i, expected) in slope.into_iter().enumerate() {
                    let difference = (ahead.tip[i] - behind.tip[i]) / (2.0 * h);
                    let size = rod.tip[i].abs().max(expected.abs());
                    assert!(
                        (difference - expected).abs() <= 1e-8 * size,
                        "{sigma}, {i}: {difference:e} {expected:e}"
                    );
                }
                // d(1 - x) = -dx.
                let work = rod.force[0] * slope[0] - rod.force[1] * slope[1];
                let stored = (ahead.energy - behind.energy) / (2.0 * h);
                assert!(
                    (stored - work).abs() <= 1e-8 * rod.energy,
                    "{sigma}: {stored:e} {work:e}"
                );
            }
        }
    }

    /// Catches a wrong beam: the end, the forces and the softening of deflected rods are the limits of the chart.
    #[test]
    fn the_beam_is_the_limit_of_the_chart() {
        for pull in [-18.0_f64, -4.0, -1.0, 1e-3, 2.9, 40.0, 1e4] {
            let (beam, y) = (straight_rod_constraint(pull).unwrap(), 1e-7);
            let at = |pull: f64| {
                let q = point_of_deflection(Sign::Minus, pull, -y);
                let rod = BentRod::new(-q[0], q[1]).unwrap();
                (rod.tip, rod.force)
            };
            let (tip, force) = at(pull);
            assert!(close(tip[1], y, 1e-12) && close(tip[0], beam.shortening * y * y, 1e-12));
            assert!((force[0] + pull).abs() <= 1e-12 * (1.0 + pull.abs()));
            assert!(close(-force[1], beam.stiffness * y, 1e-11));
            let h = 1e-4 * (1.0 + pull.abs());
            let slope = (at(pull + h).0[0] - at(pull - h).0[0]) / (2.0 * h * y * y);
            assert!(close(beam.softening, slope, 1e-5) && slope < 0.0, "{pull}");
        }
        assert!(straight_rod_constraint(-19.5).is_none());
    }

    /// Catches a landing on the fold's own twin: on every scale the rod lands on the other side at the same end, and
    /// releases energy.
    #[test]
    fn rods_next_to_the_straight_one_land_on_the_other_side() {
        for kap in [1e-40, 1e-8, -1e-4, 2e-3] {
            let p = f64::atanh(kap);
            let fold = crate::elastica::fold_at(1, p).unwrap().equilibrium;
            let from = Vector2::new(p, fold.w);
            let to = landing(&from).unwrap();
            let (a, b) = (
                Equilibrium::new(p, fold.w).unwrap(),
                Equilibrium::new(to[0], to[1]).unwrap(),
            );
            assert!(kap * to[0] < 0.0 && Elastica.index(&to).unwrap() == 0);
            assert!(
                close(b.y, a.y, 1e-12)
                    && (kap.abs() < 1e-6 || close(b.one_minus_x, a.one_minus_x, 1e-8))
            );
            assert!(
                b.energy < 0.5 * a.energy,
                "{kap}: {} {}",
                a.energy,
                b.energy
            );
        }
    }
}
