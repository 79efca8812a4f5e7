//! Bracketed scalar roots.

/// A root of `f` between `a` and `b`, where `fa`, `fb` have opposite signs, by Chandrupatla's method (inverse
/// quadratic interpolation if safe, else bisection): to |b - a| <= tolerance or f = 0. None if the signs agree or a
/// value is NaN.
pub fn chandrupatla(
    mut f: impl FnMut(f64) -> f64,
    a: (f64, f64),
    b: (f64, f64),
    tolerance: f64,
) -> Option<f64> {
    search(&mut f, a, b, tolerance)
}

/// Takes a trait object: compiled once, not for every function.
fn search(
    f: &mut dyn FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
    tolerance: f64,
) -> Option<f64> {
    if fa == 0.0 {
        return Some(a);
    }
    if fb == 0.0 {
        return Some(b);
    }
    if !(fa * fb.signum() < 0.0) {
        return None;
    }
    let (mut c, mut fc);
    let mut t: f64 = 0.5;
    for _ in 0..200 {
        let x = a + t * (b - a);
        let fx = f(x);
        if fx.is_nan() {
            return None;
        }
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let best = if fa.abs() < fb.abs() { a } else { b };
        let floor = 2.0 * f64::EPSILON * best.abs() + 0.5 * tolerance;
        let relative = floor / (b - a).abs();
        if fx == 0.0 || relative > 0.5 {
            return Some(best);
        }
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        t = if phi * phi < xi && (1.0 - phi).powi(2) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        t = t.clamp(relative, 1.0 - relative);
    }
    None
}
