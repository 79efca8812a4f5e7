//! stub, to be replaced
use super::carlson::complete_kb;
use crate::error::Result;
#[derive(Debug, Clone, Copy)]
pub struct Jacobi {
    pub sn: f64,
    pub cn: f64,
    pub dn: f64,
    pub am: f64,
}
pub fn jacobi(u: f64, kc: f64) -> Result<Jacobi> {
    let (k, _) = complete_kb(kc);
    let n = (u / (2.0 * k)).round();
    let r = u - n * 2.0 * k;
    let (mut a, mut em, mut en) = (1.0f64, [0.0; 24], [0.0; 24]);
    let mut emc = kc * kc;
    let mut c;
    let mut l = 0;
    loop {
        em[l] = a;
        emc = emc.sqrt();
        en[l] = emc;
        c = 0.5 * (a + emc);
        if (a - emc).abs() <= 1e-9 * a || l == 23 {
            break;
        }
        emc *= a;
        a = c;
        l += 1;
    }
    let v = r * c;
    let (mut sn, mut cn) = v.sin_cos();
    let mut dn = 1.0;
    if sn != 0.0 {
        let mut a = cn / sn;
        c *= a;
        for ii in (0..=l).rev() {
            let b = em[ii];
            a *= c;
            c *= dn;
            dn = (en[ii] + a) / (b + a);
            a = c / b;
        }
        let q = 1.0 / (c * c + 1.0).sqrt();
        sn = q.copysign(sn);
        cn = c * sn;
    }
    let am0 = sn.atan2(cn);
    let odd = (n as i64) & 1 == 1;
    let (sn, cn) = if odd { (-sn, -cn) } else { (sn, cn) };
    Ok(Jacobi {
        sn,
        cn,
        dn,
        am: am0 + n * std::f64::consts::PI,
    })
}
