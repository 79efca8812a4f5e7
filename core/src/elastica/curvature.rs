//! Second derivatives of the tip over (p, lam), in closed form: what cusps and error bounds need.

use super::chart::ChartPoint;

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

impl TipDerivatives {
    /// The derivatives at a chart point.
    pub fn new(at: &ChartPoint) -> Self {
        let i = &at.integrals;
        let (kap, kc2, s, c, d, lam, b) = (i.kap, i.kap_c * i.kap_c, i.s, i.c, i.d, i.lam, i.b);
        let (inv, kap2) = (1.0 / lam, kap * kap);
        let g = i.lam_p();
        let dg = d * g;
        // psi and its derivatives at the clamp, u = lam; alpha = -psi.
        let psi_p = 2.0 * (c * d + kap2 * s * b);
        let psi_u = -2.0 * kap * s;
        let rate = s * (kap2 - d * d) + kap2 * c * d * b;
        let psi_pu = 2.0 * rate;
        let psi_pp = 2.0 * (kap * kc2 * (s * lam - c / d) - g * rate);
        let psi_uu = -2.0 * kap * c * d;
        // At fixed u: c_p = s D G, s_p = -c D G.
        let d_p = -kap * kc2 * c * c / d - kap2 * s * c * g;
        let g_p = kc2 * (lam - b) + kap * kc2 * c * c / (d * d) * (kap * s * c / d - g);
        let z_p = [
            -2.0 * (kap * kc2 * (lam - b) + d * dg),
            2.0 * (kc2 * s - kap * c * dg),
        ];
        // kap B_p at fixed u, free of the division by kap.
        let kap_b_p = kc2 * (lam - 2.0 * b - c * s / d) - kap * s * s * g;
        let z_pp = [
            -2.0 * (kc2 * (kc2 - 2.0 * kap2) * (lam - b) - kc2 * kap_b_p
                + 2.0 * d * d_p * g
                + d * d * g_p),
            2.0 * (-2.0 * kap * kc2 * s
                - 2.0 * kc2 * c * dg
                - kap * (s * dg * dg + c * d_p * g + c * d * g_p)),
        ];
        // (cos psi, sin psi) at the clamp is (cos alpha, -sin alpha).
        let tangent = [at.cos_alpha, -at.sin_alpha];
        let normal = [at.sin_alpha, at.cos_alpha];
        let r = at.turned;
        let r_l = combine([(inv, tangent), (-inv, r)]);
        let r_ll = combine([(inv * psi_u, normal), (-2.0 * inv, r_l)]);
        let r_p = z_p.map(|v| v * inv);
        let r_pl = combine([(inv * psi_p, normal), (-inv, r_p)]);
        let r_pp = z_pp.map(|v| v * inv);
        let (a_p, a_l) = (-psi_p, -psi_u);
        let turned = |second: [f64; 2], a: f64, ra: [f64; 2], b: f64, rb: [f64; 2], ab: f64| {
            combine([
                (1.0, second),
                (a, quarter(rb)),
                (b, quarter(ra)),
                (ab, quarter(r)),
                (-a * b, r),
            ])
        };
        Self {
            p: combine([(1.0, r_p), (a_p, quarter(r))]),
            l: combine([(1.0, r_l), (a_l, quarter(r))]),
            pp: turned(r_pp, a_p, r_p, a_p, r_p, -psi_pp),
            pl: turned(r_pl, a_p, r_p, a_l, r_l, -psi_pu),
            ll: turned(r_ll, a_l, r_l, a_l, r_l, -psi_uu),
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
