//! Second derivatives of the tip over (p, lam), in closed form: what cusps and error bounds need.

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

/// The pendulum of the rod at the distance u = lam of `Integrals` from the tip: the angle psi and the place Z(u) = int_0^u (cos psi,
/// sin psi) with their derivatives along u and, at fixed u, along the modulus p.
pub(super) struct Swing<T = f64> {
    pub z: [T; 2],
    pub z_p: [T; 2],
    pub z_pp: [T; 2],
    pub psi_p: T,
    pub psi_u: T,
    pub psi_pp: T,
    pub psi_pu: T,
    pub psi_uu: T,
    cos_psi: T,
    sin_psi: T,
}

impl Swing {
    #[inline(always)]
    pub fn new(i: &Integrals) -> Self {
        let modulus = Modulus {
            kap: i.kap,
            kap_c: i.kap_c,
        };
        Self::at(&modulus, i.lam, [i.s, i.c, i.d, 1.0 / i.d, i.b])
    }
}

impl<T: Real> Swing<T> {
    /// At the distance u with (s, c, d, 1/d, b) of `Integrals`.
    #[inline(always)]
    pub fn at(modulus: &Modulus, u: T, [s, c, d, over_d, b]: [T; 5]) -> Self {
        let (kap, kc2) = (modulus.kap, modulus.kap_c * modulus.kap_c);
        let kap2 = kap * kap;
        let c_over = c * over_d;
        let cd = c * d;
        // G = kap t.
        let t = s.times_plus(c_over, b);
        let (g, st, sb) = (t * kap, s * t, s * b);
        let dg = d * g;
        let c_dg = c * dg;
        let rate = s.times_plus(s.all(kap2) - d * d, cd * b * kap2);
        // At fixed u: c_p = s D G, s_p = -c D G.
        let d_p = c * (c_over * (-kap * kc2) - st * (kap * kap2));
        let gap = u - b;
        let less = gap * kc2;
        let g_p = less - c_over * c_over * b * (kap2 * kc2);
        let z_p = [
            less * (-2.0 * kap) - d * dg * 2.0,
            s * (2.0 * kc2) - c_dg * (2.0 * kap),
        ];
        // kap B_p at fixed u, free of the division by kap.
        let kap_b_p = (gap - t) * kc2 - s * st * kap2;
        let d_p_g = d_p * g;
        let bent = d.times_plus(g_p, d_p_g);
        let z_pp = [
            less * (4.0 * kap2 - 2.0 * kc2) + kap_b_p * (2.0 * kc2) - d * (bent + d_p_g) * 2.0,
            s * (-4.0 * kap * kc2)
                - c_dg * (4.0 * kc2)
                - c.times_plus(bent, s * dg * dg) * (2.0 * kap),
        ];
        let twice = cd * (2.0 * kap);
        let across = s * (2.0 * kap);
        Self {
            // Z_x = 2 int D^2 - u, int D^2 = kap'^2 u + kap^2 B.
            z: [u * (2.0 * kc2 - 1.0) + b * (2.0 * kap2), across],
            z_p,
            z_pp,
            psi_p: cd * 2.0 + sb * (2.0 * kap2),
            psi_u: across * -1.0,
            psi_pp: ((s * u - c_over) * (kap * kc2) - g * rate) * 2.0,
            psi_pu: rate * 2.0,
            psi_uu: twice * -1.0,
            // D^2 + kap^2 c^2 = 1.
            cos_psi: (d - c * kap) * (d + c * kap),
            sin_psi: twice,
        }
    }

    /// dZ/du.
    #[inline(always)]
    pub fn z_u(&self) -> [T; 2] {
        [self.cos_psi, self.sin_psi]
    }
}

impl TipDerivatives {
    /// The derivatives at a chart point.
    pub fn new(at: &ChartPoint) -> Self {
        let swing = Swing::new(&at.integrals);
        let inv = 1.0 / at.integrals.lam;
        // (cos psi, sin psi) at the clamp is (cos alpha, -sin alpha).
        let tangent = swing.z_u();
        let normal = quarter(tangent);
        let r = at.turned;
        let r_l = combine([(inv, tangent), (-inv, r)]);
        let r_ll = combine([(inv * swing.psi_u, normal), (-2.0 * inv, r_l)]);
        let r_p = swing.z_p.map(|v| v * inv);
        let r_pl = combine([(inv * swing.psi_p, normal), (-inv, r_p)]);
        let r_pp = swing.z_pp.map(|v| v * inv);
        // alpha = -psi at the clamp.
        let (a_p, a_l) = (-swing.psi_p, -swing.psi_u);
        Self {
            p: combine([(1.0, r_p), (a_p, quarter(r))]),
            l: combine([(1.0, r_l), (a_l, quarter(r))]),
            pp: turned(r, r_pp, a_p, r_p, a_p, r_p, -swing.psi_pp),
            pl: turned(r, r_pl, a_p, r_p, a_l, r_l, -swing.psi_pu),
            ll: turned(r, r_ll, a_l, r_l, a_l, r_l, -swing.psi_uu),
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

/// The second derivative of Rot(alpha) r, in the turned axes, from that of r and the first derivatives of both along two parameters.
fn turned(
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

/// J v: a quarter turn.
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
