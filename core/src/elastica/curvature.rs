//! Second derivatives of the tip over (p, lam), in closed form: what cusps and error bounds need.

use super::chart::{ChartPoint, Integrals};

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
pub(super) struct Swing {
    pub z: [f64; 2],
    pub z_p: [f64; 2],
    pub z_pp: [f64; 2],
    pub psi_p: f64,
    pub psi_u: f64,
    pub psi_pp: f64,
    pub psi_pu: f64,
    pub psi_uu: f64,
    cos_psi: f64,
    sin_psi: f64,
}

impl Swing {
    pub fn new(i: &Integrals) -> Self {
        let (kap, kc2, s, c, d, u, b) = (i.kap, i.kap_c * i.kap_c, i.s, i.c, i.d, i.lam, i.b);
        let kap2 = kap * kap;
        let g = i.lam_p();
        let dg = d * g;
        let rate = s * (kap2 - d * d) + kap2 * c * d * b;
        // At fixed u: c_p = s D G, s_p = -c D G.
        let d_p = -kap * kc2 * c * c / d - kap2 * s * c * g;
        let g_p = kc2 * (u - b) + kap * kc2 * c * c / (d * d) * (kap * s * c / d - g);
        let z_p = [
            -2.0 * (kap * kc2 * (u - b) + d * dg),
            2.0 * (kc2 * s - kap * c * dg),
        ];
        // kap B_p at fixed u, free of the division by kap.
        let kap_b_p = kc2 * (u - 2.0 * b - c * s / d) - kap * s * s * g;
        let z_pp = [
            -2.0 * (kc2 * (kc2 - 2.0 * kap2) * (u - b) - kc2 * kap_b_p
                + 2.0 * d * d_p * g
                + d * d * g_p),
            2.0 * (-2.0 * kap * kc2 * s
                - 2.0 * kc2 * c * dg
                - kap * (s * dg * dg + c * d_p * g + c * d * g_p)),
        ];
        Self {
            z: [2.0 * i.de() - u, 2.0 * kap * s],
            z_p,
            z_pp,
            psi_p: 2.0 * (c * d + kap2 * s * b),
            psi_u: -2.0 * kap * s,
            psi_pp: 2.0 * (kap * kc2 * (s * u - c / d) - g * rate),
            psi_pu: 2.0 * rate,
            psi_uu: -2.0 * kap * c * d,
            // D^2 + kap^2 c^2 = 1.
            cos_psi: (d - kap * c) * (d + kap * c),
            sin_psi: 2.0 * kap * c * d,
        }
    }

    /// dZ/du.
    pub fn z_u(&self) -> [f64; 2] {
        [self.cos_psi, self.sin_psi]
    }

    /// d2Z/dp du.
    pub fn z_pu(&self) -> [f64; 2] {
        quarter(self.z_u()).map(|x| x * self.psi_p)
    }

    /// d2Z/du2.
    pub fn z_uu(&self) -> [f64; 2] {
        quarter(self.z_u()).map(|x| x * self.psi_u)
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
pub(super) fn turned(
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
