//! Student's distribution.

use crate::solve::roots::chandrupatla;
use std::f64::consts::FRAC_PI_2;

/// Degrees of freedom beyond which the distribution is normal to 1e-6.
const NORMAL: f64 = 1e6;

/// Half width, in standard errors, of the interval with this probability of holding the value, where the noise is
/// estimated with `freedom` >= 1 degrees of freedom. For fractional `freedom` the logarithm is interpolated linearly
/// in 1/freedom, which is too wide by up to 3 % below 2, 0.5 % beyond.
pub(super) fn quantile(probability: f64, freedom: f64) -> f64 {
    let freedom = freedom.clamp(1.0, NORMAL);
    let below = freedom.floor();
    let [low, high] = [below, below + 1.0].map(|n| whole(probability, n as usize).ln());
    // 1/freedom = (1 - part)/below + part/(below + 1).
    let part = (freedom - below) * (below + 1.0) / freedom;
    (low + (high - low) * part).exp()
}

/// Half width, in standard errors, for a whole number of degrees of freedom.
fn whole(probability: f64, freedom: usize) -> f64 {
    // t = sqrt(freedom) tan(angle).
    let miss = |angle: f64| within(angle, freedom) - probability;
    let ends = [1e-12, FRAC_PI_2 - 1e-12].map(|angle| (angle, miss(angle)));
    let angle = chandrupatla(miss, ends[0], ends[1], 1e-14);
    angle.map_or(f64::NAN, |angle| (freedom as f64).sqrt() * angle.tan())
}

/// The probability of |t| < sqrt(freedom) tan(angle): the finite sums of Abramowitz and Stegun, 26.7.3 and 26.7.4.
fn within(angle: f64, freedom: usize) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let square = cos * cos;
    let odd = freedom % 2 == 1;
    // cos + 2/3 cos^3 + ..., or 1 + 1/2 cos^2 + ...; the number of terms follows from the freedom.
    let (mut term, mut sum) = if odd { (cos, 0.0) } else { (1.0, 0.0) };
    let first = if odd { 1 } else { 0 };
    let mut k = first;
    while k + 2 <= freedom {
        sum += term;
        term *= square * (k + 1) as f64 / (k + 2) as f64;
        k += 2;
        if term < 1e-18 * sum {
            break;
        }
    }
    if odd {
        (angle + sin * sum) / FRAC_PI_2
    } else {
        sin * sum
    }
}

#[cfg(test)]
mod tests {
    use super::quantile;

    /// Catches a wrong term or a truncated sum (closed forms for 1 and 2 degrees of freedom, tables for 5 and 10,
    /// normal limit), and interpolation on the wrong side.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        let cases = [
            (1.0, 12.706_204_736),
            (2.0, 4.302_652_73),
            (3.0, 3.182_446_305),
            (5.0, 2.570_581_836),
            (10.0, 2.228_138_852),
            (f64::INFINITY, 1.959_966_4),
        ];
        for (freedom, t) in cases {
            let own = quantile(0.95, freedom);
            assert!((own / t - 1.0).abs() < 1e-7, "{freedom}: {own}, {t}");
        }
        for (freedom, t, wider) in [(1.5, 6.016_663, 0.03), (2.5, 3.574_655, 0.005)] {
            let own = quantile(0.95, freedom);
            assert!(
                (0.0..wider).contains(&(own / t - 1.0)),
                "{freedom}: {own}, {t}"
            );
        }
    }
}
