//! Jacobi's theta functions by the smaller nome, that of the modulus or of the complementary one. Then
//! q <= exp(-pi) = 0.0432, and four terms of each series are exact to rounding.

use super::real::Real;

/// Coefficients of the four theta functions of one nome q. Let z = 2 q cos 2v for a real v and z = 2 q cosh 2|v| for
/// an imaginary one; up to half a period |z| <= 1 or so. Then
///
/// ```text
/// theta_1(v) = 2 q^(1/4) (A - B) sin v     A = a0 + a2 z^2    theta_3(v) = C + D     C = c0 + c2 z^2
/// theta_2(v) = 2 q^(1/4) (A + B) cos v     B = z (b1 + b3 z^2)    theta_4(v) = C - D     D = z (d1 + d3 z^2)
/// ```
///
/// (DLMF 20.2.1-4, the multiples of 2v written by its cosine). z is available even where q underflows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nome {
    pub q: f64,
    /// Quotient of q and the square of its modulus: 1/16 for vanishing modulus.
    pub over_square: f64,
    /// theta_2(0)/(2 q^(1/4)), theta_3(0), theta_4(0).
    pub theta2: f64,
    pub theta3: f64,
    pub theta4: f64,
    /// Period factor theta_3(0)^2 = 2K/pi of the nome's modulus.
    pub period: f64,
    /// Reciprocal of `period`, by the third mean of Gauss between 1 and the larger modulus. The mean is wrong by the
    /// order of the nome's fourth power, and is corrected by a series. Neither needs the nome.
    pub pace: f64,
    /// Coefficients a0, a2 and so on.
    a: [f64; 2],
    b: [f64; 2],
    c: [f64; 2],
    d: [f64; 2],
}

impl Nome {
    /// Nome of the smaller of both moduli, given by its square, with the larger modulus. With root the square root of
    /// the larger modulus, (1 - root)/(1 + root) = 2 q + 2 q^9 - .. is formed without a difference (19.5.5).
    #[inline(always)]
    pub fn new(square: f64, large: f64) -> Self {
        let root = 1.0 + large.sqrt();
        let mean = 0.25 * (root * root);
        let per = 0.125 / ((1.0 + large) * mean);
        let e = per * square;
        let e4 = (e * e) * (e * e);
        let over_square = per * (1.0 + e4 * (2.0 + e4 * (15.0 + e4 * 150.0)));
        let q = over_square * square;
        let q2 = q * q;
        let (q4, q6) = (q2 * q2, q2 * q2 * q2);
        let q8 = q4 * q4;
        let (even, odd) = (1.0 + 2.0 * q4, 2.0 * (q + q8 * q));
        let more = odd + 2.0 * q4;
        Self {
            q,
            over_square,
            theta2: 1.0 + q2 + q6,
            theta3: even + odd,
            theta4: even - odd,
            pace: mean * (1.0 - e4 * (4.0 + e4 * (20.0 + e4 * 176.0))),
            // Rounded once.
            period: 1.0 + more * (2.0 + more),
            a: [1.0 - q2 - q6, q4 - q4 * q6],
            b: [q - q * q4, q8 * q],
            c: [1.0 - 2.0 * q4, q2],
            d: [1.0 - 3.0 * q8, q6],
        }
    }

    /// Combinations A - B, A + B, C + D and C - D.
    #[inline(always)]
    pub fn parts<T: Real>(&self, z: T) -> [T; 4] {
        let z2 = z * z;
        let a = z2.series(&self.a);
        let b = z * z2.series(&self.b);
        let c = z2.series(&self.c);
        let d = z * z2.series(&self.d);
        [a - b, a + b, c + d, c - d]
    }

    /// Derivative dtheta_3/dz.
    #[inline(always)]
    pub fn slope<T: Real>(&self, z: T) -> T {
        z.series(&[self.d[0], 2.0 * self.c[1], 3.0 * self.d[1]])
    }
}
