//! Carlson's symmetric integrals RF and RD of the same arguments, in one duplication ladder.
//!
//! The elastica needs both at every point, and they share their square roots: together they cost
//! little more than RF alone.
//!
//! The ladder carries 4^n times the arguments of DLMF 19.26.18, x -> x + lambda. No factor 1/4 thus lengthens the
//! chain from one square root to the next. The distances of the arguments from their mean are invariant, so the last
//! step is known at the start.

/// Largest relative distances of the arguments from their mean at which the series, complete
/// through degree 8, are exact to 4e-17, whatever the direction.
const RF_SPREAD: f64 = 0.025;
const RD_SPREAD: f64 = 0.0205;

const THIRD: f64 = 1.0 / 3.0;

/// More duplications than any arguments need: each halves the logarithm of their ratio, at most
/// 2^11, and then quarters their spread.
const DUPLICATIONS: usize = 40;

/// (RF(x,y,z), RD(x,y,z)) of DLMF 19.16.1 and 19.16.5, by duplication (19.26.18, 19.26.20) and the
/// series 19.36.1, 19.36.2 with the terms of degree 8 from 19.19.6.
///
/// `x`, `y` >= 0, at most one of them zero, `z` > 0, all finite and with products of three roots in range. The caller
/// ensures this (public, checked forms: [`super::elliptic`]). Accuracy: a few ulp; no subtraction outside the series.
#[inline]
pub(crate) fn rf_rd(mut x: f64, mut y: f64, mut z: f64) -> (f64, f64) {
    let (low, high) = (x.min(y).min(z), x.max(y).max(z));
    let enough_f = (3.0 / RF_SPREAD) * distance((x + y + z) * THIRD, low, high);
    let enough_d = (5.0 / RD_SPREAD) * distance((x + y + 3.0 * z) * 0.2, low, high);
    let mut power = 1.0;
    let mut sum = 0.0;
    for _ in 0..DUPLICATIONS {
        let xy = x + y;
        if xy + z >= enough_f && xy + 3.0 * z >= enough_d {
            break;
        }
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * (ry + rz) + ry * rz;
        x += lambda;
        y += lambda;
        z += lambda;
        sum += power / (rz * z);
        power *= 2.0;
    }
    (
        power * rf_series(x, y, z),
        power * rd_series(x, y, z) + 3.0 * sum,
    )
}

/// RF alone, under the conditions of [`rf_rd`], except that `z` may be the one argument that is zero.
#[inline]
pub(crate) fn rf(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (low, high) = (x.min(y).min(z), x.max(y).max(z));
    let enough = (3.0 / RF_SPREAD) * distance((x + y + z) * THIRD, low, high);
    let mut power = 1.0;
    for _ in 0..DUPLICATIONS {
        if x + y + z >= enough {
            break;
        }
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * (ry + rz) + ry * rz;
        x += lambda;
        y += lambda;
        z += lambda;
        power *= 2.0;
    }
    power * rf_series(x, y, z)
}

/// Largest distance of the arguments from their mean.
#[inline]
fn distance(mean: f64, low: f64, high: f64) -> f64 {
    (mean - low).max(high - mean)
}

#[inline]
fn rf_series(x: f64, y: f64, z: f64) -> f64 {
    let a = (x + y + z) * THIRD;
    let inv = 1.0 / a;
    let (dx, dy) = ((a - x) * inv, (a - y) * inv);
    let dz = -(dx + dy);
    let e2 = dx * dy - dz * dz;
    let e3 = dx * dy * dz;
    let tail = e2 * (-1.0 / 10.0 + e2 * (1.0 / 24.0 - e2 * (5.0 / 208.0 - e2 * (35.0 / 2176.0))))
        + e3 * (1.0 / 14.0 - e2 * (3.0 / 44.0 - e2 * (1.0 / 16.0))
            + e3 * (3.0 / 104.0 - e2 * (15.0 / 272.0)));
    (1.0 + tail) / a.sqrt()
}

#[inline]
fn rd_series(x: f64, y: f64, z: f64) -> f64 {
    let a = (x + y + 3.0 * z) * 0.2;
    let inv = 1.0 / a;
    let (dx, dy) = ((a - x) * inv, (a - y) * inv);
    let dz = -(dx + dy) * THIRD;
    let (xy, zz) = (dx * dy, dz * dz);
    let e2 = xy - 6.0 * zz;
    let e3 = (3.0 * xy - 8.0 * zz) * dz;
    let e4 = 3.0 * (xy - zz) * zz;
    let e5 = xy * zz * dz;
    let tail = e2 * (-3.0 / 14.0 + e2 * (9.0 / 88.0 - e2 * (1.0 / 16.0 - e2 * (105.0 / 2432.0))))
        + e3 * (1.0 / 6.0 - e2 * (9.0 / 52.0 - e2 * (45.0 / 272.0))
            + e3 * (3.0 / 40.0 - e2 * (45.0 / 304.0)))
        + e4 * (-3.0 / 22.0 + e2 * (3.0 / 20.0 - e2 * (45.0 / 304.0)) - e3 * (9.0 / 68.0)
            + e4 * (9.0 / 152.0))
        + e5 * (3.0 / 26.0 - e2 * (9.0 / 68.0) + e3 * (9.0 / 76.0));
    (1.0 + tail) * inv / a.sqrt()
}

/// (K, B) for the complementary modulus `kc` in (0, 1]: K = int_0^{pi/2} dt/D, B = int sin^2 t/D dt
/// with D^2 = sin^2 t + kc^2 cos^2 t, by one arithmetic-geometric mean (Bulirsch's cel2).
/// Sums of positive terms only: a few ulp for every `kc` down to 1e-300.
#[inline]
pub(crate) fn complete_kb(kc: f64) -> (f64, f64) {
    let mut g = kc;
    let mut m = 1.0;
    let mut doubled = 1.0;
    let (mut a, mut b, mut c) = (1.0, 0.0, 1.0);
    // Subnormal kc take 15 steps; 0 and NaN, which have no value, must terminate.
    for _ in 0..20 {
        b = 2.0 * (c * g + b);
        c = a;
        let m0 = m;
        m += g;
        a += b / m;
        doubled *= 2.0;
        if (m0 - g).abs() <= 1e-8 * m0 {
            break;
        }
        g = 2.0 * (g * m0).sqrt();
    }
    let quarter = std::f64::consts::FRAC_PI_4 / m;
    (quarter * 2.0 * doubled, quarter * a)
}
