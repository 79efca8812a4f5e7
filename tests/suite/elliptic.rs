//! Elliptic functions against mpmath, identities, and every bit pattern.

use proptest::prelude::*;
use snaprod::math::DomainError;
use snaprod::math::elliptic::*;
use snaprod::math::jacobi::{jacobi, sn_cn_dn};
use std::f64::consts::{FRAC_PI_2, PI};

/// Largest error allowed, in ulp; for sn ... sd in eps (|f| + |u f'|).
fn bound(function: &str, region: &str) -> f64 {
    let beyond = region.starts_with("beyond") || region.starts_with("phi 50");
    match function {
        "K" | "E" | "E_kc" => 4.0,
        "B" | "K_kc" => 6.0,
        "F(phi)" => 5.0,
        "E(phi)" if !beyond => 4.0,
        "B(phi)" if !beyond => 5.0,
        "E(phi)" | "B(phi)" => 8.0,
        "F_kc(phi)" | "E_kc(phi)" => 8.0,
        "sn" | "am" => 2.5,
        "cn" | "dn" | "cd" | "sd" => 5.0,
        "RF" | "RD" => 5.0,
        other => panic!("no bound for {other}"),
    }
}

#[test]
fn errors_against_mpmath_are_bounded_in_every_region() {
    for ((function, region), rows) in &crate::elliptic_data::load() {
        for row in rows {
            let got = crate::elliptic_data::ours(row)
                .unwrap_or_else(|fault| panic!("{function}, {region}, {:?}: {fault}", row.input));
            let error = row.error(got);
            assert!(
                error <= bound(function, region),
                "{function}, {region}, {:?}: {got:e} for {:e}, error {error:.2}",
                row.input,
                row.value
            );
        }
    }
}

#[test]
fn an_error_of_sign_or_nan_is_infinite() {
    let (_, rows) = &crate::elliptic_data::load()[0];
    assert!(rows[0].error(f64::NAN).is_infinite());
    assert!(rows[0].error(-rows[0].value).is_infinite());
    assert!(rows[0].error(rows[0].value) < 0.51);
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

/// A complementary modulus, small ones as often as large ones.
fn modulus() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-150.0..0.0f64).prop_map(|e| 10f64.powf(e)),
        0.01..1.0f64,
        Just(1.0)
    ]
}

/// Any f64 at all: every bit pattern, and the notorious ones more often.
fn anything() -> impl Strategy<Value = f64> {
    let notorious = vec![
        0.0,
        -0.0,
        1.0,
        -1.0,
        FRAC_PI_2,
        PI,
        -FRAC_PI_2,
        1.0 - f64::EPSILON / 2.0,
        1.0 + f64::EPSILON,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN,
        f64::MIN_POSITIVE,
        5e-324,
        1e-8,
    ];
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        proptest::sample::select(notorious),
        (-320.0..308.0f64).prop_map(|e| 10f64.powf(e)),
        modulus(),
        -100.0..100.0f64,
    ]
}

/// A finite value, or an error that names an argument.
fn total(result: Result<f64, DomainError>) -> bool {
    match result {
        Ok(value) => value.is_finite(),
        Err(fault) => {
            let error = snaprod::Error::from(fault);
            error.is_domain() && error.to_string().contains(fault.argument)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..Default::default() })]

    #[test]
    fn every_input_gives_a_finite_value_or_an_error(x in anything(), y in anything(), z in anything()) {
        for function in [complete_k, complete_e, complete_b] {
            prop_assert!(total(function(x)));
        }
        for function in [incomplete_f, incomplete_e, incomplete_b] {
            prop_assert!(total(function(x, y)));
        }
        for function in [carlson_rf, carlson_rd] {
            prop_assert!(total(function(x, y, z)));
        }
        let sum = |v: Complete| v.k.abs().max(v.e).max(v.b).max(v.k_kc.abs()).max(v.e_kc.abs());
        prop_assert!(total(complete(x).map(sum)));
        if let Ok(v) = complete(x) {
            prop_assert!([v.k, v.e, v.b, v.k_kc, v.e_kc].iter().all(|f| f.is_finite()));
        }
        match incomplete(x, y) {
            Ok(v) => prop_assert!(
                [v.f, v.e, v.b, v.f_phi, v.e_phi, v.b_phi, v.f_kc, v.e_kc].iter().all(|f| f.is_finite())
            ),
            Err(fault) => prop_assert!(total(Err(fault))),
        }
        match jacobi(x, y) {
            Ok(j) => {
                let all = [j.sn, j.cn, j.dn, j.am, j.cd(), j.sd()];
                prop_assert!(all.iter().all(|f| f.is_finite()), "{j:?}");
                prop_assert!(j.sn.abs() <= 1.0 && j.cn.abs() <= 1.0 && j.dn <= 1.0);
                prop_assert!(j.dn >= y * (1.0 - 1e-14));
                prop_assert_eq!(sn_cn_dn(x, y), Ok((j.sn, j.cn, j.dn)));
            }
            Err(fault) => prop_assert!(total(Err(fault)) && sn_cn_dn(x, y).is_err()),
        }
    }

    /// sn^2 + cn^2 = 1 and dn^2 = cn^2 + kc^2 sn^2 (DLMF 22.6.1), the latter relatively.
    #[test]
    fn jacobi_squares(u in -1e3..1e3f64, kc in modulus()) {
        let j = jacobi(u, kc).unwrap();
        prop_assert!(close(j.sn * j.sn + j.cn * j.cn, 1.0, 1e-15));
        prop_assert!(close(j.cn.hypot(kc * j.sn), j.dn, 1e-14 * j.dn));
    }

    /// F(am u) = u and am(F(am u)) = am u. The first only where am resolves u: next to odd multiples
    /// of pi/2 one ulp of am is many units of u.
    #[test]
    fn amplitude_inverts_f(u in -1e3..1e3f64, kc in modulus()) {
        let j = jacobi(u, kc).unwrap();
        let back = incomplete_f(j.am, kc).unwrap();
        let ulp_of_am = f64::EPSILON * j.am.abs() / j.dn;
        if ulp_of_am < 1e-4 {
            let slack = 8.0 * (f64::EPSILON * u.abs() + ulp_of_am);
            prop_assert!(close(back, u, slack), "{u} {kc:e} {back} {slack:e}");
        }
        let again = jacobi(back, kc).unwrap().am;
        let slack = 8.0 * f64::EPSILON * (j.am.abs() + u.abs() * j.dn);
        prop_assert!(close(again, j.am, slack), "{u} {kc:e} {again} {}", j.am);
    }

    /// am(u + 2K) = am(u) + pi, am odd and increasing.
    #[test]
    fn amplitude_is_continuous(u in 0.0..1e3f64, kc in modulus()) {
        let am = |u: f64| jacobi(u, kc).unwrap().am;
        let period = 2.0 * complete_k(kc).unwrap();
        prop_assert_eq!(am(-u), -am(u));
        prop_assert!(am(u * (1.0 + 1e-13) + 1e-300) >= am(u) - 4.0 * f64::EPSILON * am(u));
        prop_assert!(close(am(u + period), am(u) + PI, 1e-14 * (u + period)));
    }

    /// Legendre's relation E K' + E' K - K K' = pi/2 (DLMF 19.7.1).
    #[test]
    fn legendre_relation(angle in 0.01..1.56f64) {
        let (k, kc) = angle.sin_cos();
        let (a, b) = (complete(kc).unwrap(), complete(k).unwrap());
        let left = a.e * b.k + b.e * a.k - a.k * b.k;
        prop_assert!(close(left, FRAC_PI_2, 1e-14 * a.k * b.k));
    }

    /// E = kc^2 F + k^2 B, periods, oddness; the structure agrees with the functions.
    #[test]
    fn incomplete_relations(phi in -50.0..50.0f64, kc in modulus()) {
        let v = incomplete(phi, kc).unwrap();
        let e = kc * kc * v.f + (1.0 - kc) * (1.0 + kc) * v.b;
        prop_assert!(close(e, v.e, 4e-15 * v.e.abs()));
        prop_assert!(close(v.f, incomplete_f(phi, kc).unwrap(), 2e-15 * v.f.abs()));
        prop_assert!(close(v.b, incomplete_b(phi, kc).unwrap(), 2e-15 * v.b.abs()));
        prop_assert_eq!(incomplete_e(-phi, kc).unwrap(), -incomplete_e(phi, kc).unwrap());
        prop_assert!(close(v.f_phi * v.e_phi, 1.0, 1e-15));
    }

    /// Derivatives by phi against central differences (those by kc: mpmath's data).
    #[test]
    fn slopes_by_amplitude(phi in -20.0..20.0f64, kc in 0.2..1.0f64) {
        let h = 1e-4;
        let (low, high) = (incomplete(phi - h, kc).unwrap(), incomplete(phi + h, kc).unwrap());
        let at = incomplete(phi, kc).unwrap();
        let width = 2.0 * h;
        prop_assert!(close((high.f - low.f) / width, at.f_phi, 1e-5));
        prop_assert!(close((high.e - low.e) / width, at.e_phi, 1e-6));
        prop_assert!(close((high.b - low.b) / width, at.b_phi, 1e-5));
    }

    /// sn' = cn dn, cn' = -sn dn, dn' = -k^2 sn cn, am' = dn, against central differences.
    #[test]
    fn slopes_of_jacobi(u in -20.0..20.0f64, kc in modulus()) {
        let h = 1e-4;
        let (low, high) = (jacobi(u - h, kc).unwrap(), jacobi(u + h, kc).unwrap());
        let j = jacobi(u, kc).unwrap();
        let k2 = (1.0 - kc) * (1.0 + kc);
        let slope = |a: f64, b: f64| (b - a) / (2.0 * h);
        prop_assert!(close(slope(low.sn, high.sn), j.cn * j.dn, 1e-7));
        prop_assert!(close(slope(low.cn, high.cn), -j.sn * j.dn, 1e-7));
        prop_assert!(close(slope(low.dn, high.dn), -k2 * j.sn * j.cn, 1e-7));
        prop_assert!(close(slope(low.am, high.am), j.dn, 1e-7));
    }

    /// Symmetry and homogeneity of RF and RD, also at the ends of the range.
    #[test]
    fn carlson_scales(x in 0.1..10.0f64, y in 0.1..10.0f64, z in 0.1..10.0f64, e in -250i32..250) {
        let scale = 4f64.powi(2 * e);
        let rf = carlson_rf(x, y, z).unwrap();
        prop_assert_eq!(rf, carlson_rf(z, x, y).unwrap());
        let scaled = carlson_rf(x * scale, y * scale, z * scale).unwrap();
        prop_assert!(close(scaled * scale.sqrt(), rf, 1e-15 * rf));
        if e.abs() < 160 {
            let rd = carlson_rd(x, y, z).unwrap();
            let scaled = carlson_rd(x * scale, y * scale, z * scale).unwrap();
            prop_assert!(close(scaled * scale * scale.sqrt(), rd, 2e-15 * rd));
        }
    }
}

#[test]
fn limits_are_exact() {
    assert_eq!(complete_k(1.0), Ok(FRAC_PI_2));
    assert_eq!(complete_e(0.0), Ok(1.0));
    assert_eq!(complete_b(0.0), Ok(1.0));
    assert_eq!(incomplete_e(FRAC_PI_2 + PI, 0.0), Ok(3.0));
    assert!(close(
        incomplete_f(1.0, 0.0).unwrap(),
        1f64.sin().atanh(),
        1e-15
    ));
    assert_eq!(jacobi(0.0, 0.5).unwrap().am, 0.0);
    assert_eq!(carlson_rf(4.0, 4.0, 4.0), Ok(0.5));
    assert_eq!(carlson_rd(4.0, 4.0, 4.0), Ok(0.125));
}

#[test]
fn arguments_outside_are_refused_by_name() {
    let argument = |result: Result<f64, DomainError>| result.unwrap_err().argument;
    for kc in [0.0, -0.1, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY] {
        assert_eq!(argument(complete_k(kc)), "kc");
        assert_eq!(jacobi(1.0, kc).unwrap_err().argument, "kc");
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(argument(incomplete_f(x, 0.5)), "phi");
        assert_eq!(jacobi(x, 0.5).unwrap_err().argument, "u");
        assert_eq!(argument(carlson_rf(1.0, x, 1.0)), "y");
    }
    assert_eq!(argument(incomplete_f(2.0, 0.0)), "phi");
    assert_eq!(argument(carlson_rd(1.0, 1.0, 0.0)), "z");
    assert!(carlson_rf(0.0, 0.0, 1.0).is_err());
    let text = complete_k(1.5).unwrap_err().to_string();
    assert_eq!(
        text,
        "complete_k: kc = 1.5e0 is outside its set: (0, 1] (complementary modulus)"
    );
}
