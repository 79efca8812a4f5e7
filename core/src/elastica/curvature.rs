//! Second derivatives of the tip over (p, lam) in closed form, for cusps and error bounds.

use super::chart::{ChartPoint, Integrals, Modulus};
use crate::math::real::Real;

/// First and second derivatives of the tip (x, y) with respect to p and lam, in the turned axes of
/// [`ChartPoint`] (rotate with `to_fixed`).
///
/// The tip is Rot(alpha) Z(lam)/lam with Z(u) = int_0^u (cos psi, sin psi); along the chart line
/// psi_p = 2 (c D + kap^2 s B), psi_u = -2 kap s, and t_p = -D G with G = kap (B + c s/D).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipDerivatives {
    /// d/dp at fixed lam.
    pub p: [f64; 2],
    /// d/dlam at fixed p.
    pub l: [f64; 2],
    /// d2/dp2.
    pub pp: [f64; 2],
    /// d2/dp dlam.
    pub pl: [f64; 2],
    /// d2/dlam2.
    pub ll: [f64; 2],
}

/// Pendulum of the rod at the distance u = lam of `Integrals` from the tip: the angle psi and the place
/// Z(u) = int_0^u (cos psi, sin psi), with derivatives along u and, at fixed u, along the modulus p. As Z_y = 2 kap
/// s, psi_u = -Z_y, psi_pu = -Z_y,p and psi_uu = -Z_y,u.
pub(super) struct Swing<T = f64> {
    pub z: [T; 2],
    pub z_p: [T; 2],
    pub z_pp: [T; 2],
    pub z_u: [T; 2],
    pub psi_p: T,
    pub psi_pp: T,
}

impl Swing {
    #[inline(always)]
    pub fn new(i: &Integrals) -> Self {
        let modulus = Modulus {
            kap: i.kap,
            kap_c: i.kap_c,
        };
        Self::at(&modulus, i.lam, [i.s, i.c, i.d, i.b])
    }
}

impl<T: Real> Swing<T> {
    /// Pendulum at the distance u, with (s, c, d, b) of `Integrals`.
    ///
    /// h = (D, kap c) has half the angle psi, which turns with p at the rate f = c D + kap^2 s B. With m = kap n,
    /// n = D B + s c, all formulas are free of divisions: s_p = -c m, c_p = s m, kap B_p = kap'^2 (u - B) - D n, and
    ///
    /// ```text
    /// Z_p = (-2 kap kap'^2 (u - B), 2 kap'^2 s) - 2 m h
    /// m_p = kap'^2 n + D kap B_p + kap (m (s^2 - c^2) - kap c f B)
    /// f_p = kap (kap'^2 s (u + B) - c (c f + m kap B))
    /// ```
    #[inline(always)]
    pub fn at(modulus: &Modulus, u: T, [s, c, d, b]: [T; 4]) -> Self {
        let (kap, kc2) = (modulus.kap, modulus.kap_c * modulus.kap_c);
        let kap2 = kap * kap;
        let half = c * kap;
        let n = d.times_plus(b, s * c);
        let m = n * kap;
        let f = c.times_plus(d, s * b * kap2);
        let gap = u - b;
        let kap_b_p = T::weighted_sum([kc2, -1.0], [gap, d * n]);
        let mf = m * f;
        let turned = T::weighted_sum([kap, -2.0 * kap], [m, m * c * c]);
        let m_p = d.times_plus(
            kap_b_p,
            T::weighted_sum([kc2, 1.0, -kap], [n, turned, half * b * f]),
        );
        let d2 = d * -2.0;
        let half2 = half * -2.0;
        let z = [
            T::weighted_sum([2.0 * kc2 - 1.0, 2.0 * kap2], [u, b]),
            s * (2.0 * kap),
        ];
        Self {
            z_p: [
                d2.times_plus(m, gap * (-2.0 * kap * kc2)),
                half2.times_plus(m, s * (2.0 * kc2)),
            ],
            z_pp: [
                d2.times_plus(
                    m_p,
                    T::weighted_sum(
                        [2.0 * kc2 * (2.0 * kap2 - kc2), 2.0 * kc2, 2.0],
                        [gap, kap_b_p, half * mf],
                    ),
                ),
                d2.times_plus(
                    mf,
                    half2.times_plus(
                        m_p,
                        T::weighted_sum([-4.0 * kap * kc2, -2.0 * kc2], [s, c * m]),
                    ),
                ),
            ],
            // D^2 + kap^2 c^2 = 1.
            z_u: [(d - half) * (d + half), d * half * 2.0],
            psi_p: f * 2.0,
            psi_pp: T::weighted_sum(
                [2.0 * kap * kc2, -2.0 * kap],
                [s * (u + b), c * (c * f + m * b * kap)],
            ),
            // Z_x = 2 int D^2 - u, int D^2 = kap'^2 u + kap^2 B.
            z,
        }
    }

    /// dpsi/du.
    #[inline(always)]
    pub fn psi_u(&self) -> T {
        self.z[1] * -1.0
    }
}

impl TipDerivatives {
    /// Derivatives at a chart point.
    pub fn new(at: &ChartPoint) -> Self {
        let swing = Swing::new(&at.integrals);
        let inv = 1.0 / at.integrals.lam;
        // (cos psi, sin psi) at the clamp is (cos alpha, -sin alpha).
        let tangent = swing.z_u;
        let normal = quarter(tangent);
        let r = at.turned;
        let r_l = combine([(inv, tangent), (-inv, r)]);
        let r_ll = combine([(inv * swing.psi_u(), normal), (-2.0 * inv, r_l)]);
        let r_p = swing.z_p.map(|v| v * inv);
        let r_pl = combine([(inv * swing.psi_p, normal), (-inv, r_p)]);
        let r_pp = swing.z_pp.map(|v| v * inv);
        // alpha = -psi at the clamp.
        let (a_p, a_l) = (-swing.psi_p, -swing.psi_u());
        Self {
            p: combine([(1.0, r_p), (a_p, quarter(r))]),
            l: combine([(1.0, r_l), (a_l, quarter(r))]),
            pp: rotate_second_derivative(r, r_pp, a_p, r_p, a_p, r_p, -swing.psi_pp),
            pl: rotate_second_derivative(r, r_pl, a_p, r_p, a_l, r_l, swing.z_p[1]),
            ll: rotate_second_derivative(r, r_ll, a_l, r_l, a_l, r_l, swing.z_u[1]),
        }
    }

    /// det d(x, y)/d(p, lam) and its gradient.
    pub fn det_with_gradient(&self) -> (f64, [f64; 2]) {
        (
            cross(self.p, self.l),
            [
                cross(self.pp, self.l) + cross(self.p, self.pl),
                cross(self.pl, self.l) + cross(self.p, self.ll),
            ],
        )
    }
}

/// Second derivative of Rot(alpha) r in the turned axes, from that of r and the first derivatives of alpha and r
/// along two parameters.
fn rotate_second_derivative(
    r: [f64; 2],
    second: [f64; 2],
    a: f64,
    ra: [f64; 2],
    b: f64,
    rb: [f64; 2],
    ab: f64,
) -> [f64; 2] {
    combine([
        (1.0, second),
        (a, quarter(rb)),
        (b, quarter(ra)),
        (ab, quarter(r)),
        (-a * b, r),
    ])
}

fn combine<const N: usize>(terms: [(f64, [f64; 2]); N]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (weight, v) in terms {
        sum[0] += weight * v[0];
        sum[1] += weight * v[1];
    }
    sum
}

/// Rotation by a right angle: J v.
fn quarter(v: [f64; 2]) -> [f64; 2] {
    [-v[1], v[0]]
}

/// The planar cross product.
pub(super) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The scalar product.
pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
