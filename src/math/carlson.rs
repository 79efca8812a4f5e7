//! Carlson's symmetric integrals RF and RD of the same arguments, in one duplication ladder.
//!
//! The elastica needs both at every point, and they share their square roots: together they cost
//! little more than RF alone.

/// Largest relative spread at which the series below are complete to rounding: the first omitted
/// terms are of degree 8, with coefficients below 1/4.
const SPREAD: f64 = 0.0125;

/// (RF(x,y,z), RD(x,y,z)) of DLMF 19.16.1 and 19.16.5, by duplication (19.26.18, 19.26.20) and the
/// series 19.36.1, 19.36.2.
///
/// `x`, `y` >= 0, at most one of them zero, `z` > 0, all finite and with ratios whose squares are
/// representable; the caller sees to that (public, checked forms: [`super::elliptic`]).
/// Accuracy: a few ulp; no subtraction outside the series.
#[inline]
pub(crate) fn rf_rd(x: f64, y: f64, z: f64) -> (f64, f64) {
    let (mut x, mut y, mut z) = (x, y, z);
    let mut spread = x.max(y).max(z) - x.min(y).min(z);
    let mut power = 1.0;
    let mut sum = 0.0;
    // The arithmetic mean never exceeds the largest argument, so 3/5 of z and 1/5 of x, y bound it.
    while spread > SPREAD * (x + y + 3.0 * z) * 0.2 || spread > SPREAD * (x + y + z) / 3.0 {
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * (ry + rz) + ry * rz;
        sum += power / (rz * (z + lambda));
        power *= 0.25;
        spread *= 0.25;
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
    }
    (rf_series(x, y, z), power * rd_series(x, y, z) + 3.0 * sum)
}

/// RF alone, under the same conditions, of which `z` > 0 may be weakened to: at most one of the
/// three is zero.
#[inline]
pub(crate) fn rf(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    let mut spread = x.max(y).max(z) - x.min(y).min(z);
    while spread > SPREAD * (x + y + z) / 3.0 {
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * (ry + rz) + ry * rz;
        spread *= 0.25;
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
    }
    rf_series(x, y, z)
}

#[inline]
fn rf_series(x: f64, y: f64, z: f64) -> f64 {
    let a = (x + y + z) / 3.0;
    let inv = 1.0 / a;
    let (dx, dy) = ((a - x) * inv, (a - y) * inv);
    let dz = -(dx + dy);
    let e2 = dx * dy - dz * dz;
    let e3 = dx * dy * dz;
    let tail = e2 * (-1.0 / 10.0 + e2 * (1.0 / 24.0 - e2 * (5.0 / 208.0)))
        + e3 * (1.0 / 14.0 - e2 * (3.0 / 44.0 - e2 * (1.0 / 16.0)) + e3 * (3.0 / 104.0));
    (1.0 + tail) / a.sqrt()
}

#[inline]
fn rd_series(x: f64, y: f64, z: f64) -> f64 {
    let a = (x + y + 3.0 * z) * 0.2;
    let inv = 1.0 / a;
    let (dx, dy) = ((a - x) * inv, (a - y) * inv);
    let dz = -(dx + dy) / 3.0;
    let (xy, zz) = (dx * dy, dz * dz);
    let e2 = xy - 6.0 * zz;
    let e3 = (3.0 * xy - 8.0 * zz) * dz;
    let e4 = 3.0 * (xy - zz) * zz;
    let e5 = xy * zz * dz;
    let tail = e2 * (-3.0 / 14.0 + e2 * (9.0 / 88.0 - e2 / 16.0 + e3 * (45.0 / 272.0)))
        + e3 * (1.0 / 6.0 - e2 * (9.0 / 52.0) + e3 * (3.0 / 40.0))
        + e4 * (-3.0 / 22.0 + e2 * (3.0 / 20.0) - e3 * (9.0 / 68.0))
        + e5 * (3.0 / 26.0 - e2 * (9.0 / 68.0));
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
    // Subnormal kc take 15 steps; 0 and NaN, which have no value, must not run for ever.
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
