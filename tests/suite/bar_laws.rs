//! Laws of bars, Riemann problems and breaking: comparison with closed forms in 30 digits and hulls built by another
//! program (tests/data/waves).

use crate::support::{assert_close, json, list, number, rows};
use snaprod::bar::{Law1d, Material, Stress, Wave, WaveKind};

pub fn mooney() -> Material {
    Material::new(&Stress::Mooney(24.0, 1.5), 1e-4).expect("a law")
}

fn biderman() -> Material {
    let law = Stress::Biderman([0.208e6, -0.0024e6, 0.0005e6, 0.0233e6]);
    Material::new(&law, 1000.0).expect("a law")
}

/// Catches any wrong term of a law: stress, speed, energy and the integral of the speed.
#[test]
fn laws_match_closed_forms() {
    let data = json("waves/rod_exact_given.json");
    let law = mooney();
    for row in rows(&data, "states", 8) {
        let lam = number(row, "lam");
        let near = |got, key: &str| {
            assert_close(
                got,
                number(row, key),
                1e-12,
                1.0,
                &format!("{key} at {lam}"),
            )
        };
        near(law.stress(lam), "sigma_psi");
        near(law.speed(lam), "c_in_s");
        near(law.energy(lam), "W_psi");
        near(law.phi(1.0, lam), "Phi_in_s");
        assert_close(
            law.stretch(law.stress(lam)).unwrap(),
            lam,
            1e-14,
            1.0,
            "inverse",
        );
    }
}

/// Catches a derivative that does not belong to its function, for every kind of law, and equivalent laws that
/// disagree.
#[test]
fn laws_are_consistent() {
    let rows = (0..=20).map(|i| {
        let lam = 0.5 + 0.125 * f64::from(i);
        [lam, mooney().stress(lam)]
    });
    let table: Vec<[f64; 2]> = rows.collect();
    let laws = [
        Stress::Linear(3.0),
        Stress::NeoHookean(1.0),
        Stress::Mooney(24.0, 1.5),
        Stress::Biderman([0.208, -0.0024, 0.0005, 0.0233]),
        Stress::Polynomial(vec![3.0, -1.0, 0.7]),
        Stress::Table(table),
    ];
    for stress in &laws {
        let law = Material::new(stress, 2.0).expect("a law");
        assert_eq!(law.jet(1.0)[..2], [0.0, 0.0], "{stress:?}");
        for lam in [0.61, 0.87, 1.07, 1.73, 2.6] {
            let h = 1e-4;
            let (a, b) = (law.jet(lam - h), law.jet(lam + h));
            let here = law.jet(lam);
            for i in 0..3 {
                let slope = (b[i] - a[i]) / (2.0 * h);
                assert_close(
                    slope,
                    here[i + 1],
                    1e-6,
                    1.0,
                    &format!("{stress:?} {i} at {lam}"),
                );
            }
            let slope = (law.phi(1.0, lam + h) - law.phi(1.0, lam - h)) / (2.0 * h);
            assert_close(slope, law.speed(lam), 1e-6, 0.0, "phi");
            assert_close(
                law.phi(lam, 1.0),
                -law.phi(1.0, lam),
                1e-14,
                0.0,
                "phi back",
            );
        }
        for lam in [0.0, -1.0, f64::NAN] {
            assert!(law.check(lam).unwrap_err().is_domain(), "{stress:?} {lam}");
        }
    }
    let (neo, mooney) = (Stress::NeoHookean(25.5), Stress::Mooney(25.5, 0.0));
    let [neo, mooney] = [neo, mooney].map(|law| Material::new(&law, 1.0).unwrap());
    assert_eq!(neo, mooney);
    // A table compared with the law from which the table was made.
    let law = Material::new(&laws[5], 1e-4).unwrap();
    assert_close(
        law.stress(1.4),
        self::mooney().stress(1.4),
        1e-2,
        0.0,
        "table",
    );
    for stress in [
        Stress::Linear(-1.0),
        Stress::NeoHookean(f64::NAN),
        Stress::Polynomial(vec![]),
        Stress::Table(vec![[0.5, -1.0], [2.0, 1.0]]),
        Stress::Table(vec![[0.5, -1.0], [1.0, 0.0], [2.0, -1.0]]),
    ] {
        assert!(
            Material::new(&stress, 1.0).unwrap_err().is_domain(),
            "{stress:?}"
        );
    }
    assert!(Material::new(&laws[0], 0.0).unwrap_err().is_domain());
    // A stress that falls again beyond 1 + 1/sqrt(3).
    let hump = Material::new(&Stress::Polynomial(vec![1.0, 0.0, -1.0]), 1.0).unwrap();
    assert_close(
        hump.reach()[1],
        1.0 + 3f64.sqrt().recip(),
        1e-14,
        0.0,
        "reach",
    );
    assert!(hump.stretch(0.5).unwrap_err().is_unreachable());
}

fn compare(got: &[Wave], want: &serde_json::Value, what: &str) {
    let want = want.as_array().expect("waves");
    assert_eq!(got.len(), want.len(), "{what}: {got:?}");
    for (got, want) in got.iter().zip(want) {
        let near = |got, key: &str| {
            assert_close(
                got,
                number(want, key),
                1e-10,
                0.0,
                &format!("{what}: {key}"),
            )
        };
        near(got.from, "from");
        near(got.to, "to");
        if want["kind"] == "shock" {
            assert_eq!(got.kind, WaveKind::Shock, "{what}");
            near(got.head, "speed");
            near(got.tail, "speed");
        } else {
            assert_eq!(got.kind, WaveKind::Fan, "{what}");
            near(got.head, "speed_head");
            near(got.tail, "speed_tail");
        }
    }
}

/// Catches a wave that breaks Oleinik's condition, a missing sonic shock, a wrong order, a wrong star state.
#[test]
fn riemann_problems_match_their_hulls() {
    let data = json("waves/riemann_given.json");
    let neo = Material::new(&Stress::NeoHookean(25.5), 1e-4).unwrap();
    let inflection = biderman().bends().to_vec();
    assert_eq!(inflection.len(), 1);
    assert_close(
        inflection[0],
        list(&data["biderman_inflection"])[0],
        1e-12,
        0.0,
        "inflection",
    );
    for row in rows(&data, "cases", 13) {
        let law = match row["material"].as_str() {
            Some("mooney") => mooney(),
            Some("neo") => neo.clone(),
            _ => biderman(),
        };
        let [left, right] = ["L", "R"].map(|side| {
            let state = list(&row[side]);
            [state[0], state[1]]
        });
        let what = format!("{left:?} | {right:?}");
        let got = law.riemann(left, right).expect("a star");
        let star = &row["star"];
        assert_close(got.stretch, number(star, "lam"), 1e-10, 0.0, &what);
        assert_close(got.velocity, number(star, "v"), 1e-10, 100.0, &what);
        assert_close(got.stress, number(star, "sigma"), 1e-10, 0.0, &what);
        compare(&got.left, &row["left_going"], &what);
        compare(&got.right, &row["right_going"], &what);
        // One side of the symmetrical problem, with a wall in the middle.
        if left[0] == right[0] && left[1] == -right[1] {
            let behind = law.behind(left[0], -left[1]).expect("a state");
            assert_close(behind, got.stretch, 1e-12, 0.0, "wall");
        }
    }
    let apart = biderman().riemann([1.0, 0.0], [f64::NAN, 0.0]);
    assert!(apart.unwrap_err().is_domain());
    let short = Material::new(&Stress::Polynomial(vec![1.0, 0.0, -1.0]), 1.0).unwrap();
    assert!(
        short
            .riemann([1.0, -5.0], [1.0, 5.0])
            .unwrap_err()
            .is_unreachable()
    );
}

/// Catches a hull of a law with two inflections that misses a chord between two arcs, or an inadmissible part: the
/// parts join, slow down, and dissipate; arcs bend the right way and no chord crosses the stress.
#[test]
fn hulls_of_many_inflections_are_admissible() {
    // sigma' = 1 + 0.9 cos(6 lam): a wavy law as a table and as its parts.
    let rows = (0..=280).map(|i| {
        let lam = 0.3 + 0.01 * f64::from(i);
        [lam, (lam - 1.0) + 0.15 * ((6.0 * lam).sin() - 6f64.sin())]
    });
    let mut rows: Vec<[f64; 2]> = rows.collect();
    rows[70] = [1.0, 0.0];
    let law = Material::new(&Stress::Table(rows), 1.0).expect("a law");
    let mut parts = 0;
    for i in 0..400 {
        let a = 0.35 + 2.6 * f64::from(i % 20) / 20.0;
        let b = 0.41 + 2.6 * f64::from(i / 20) / 20.0;
        let waves = law.waves(a, b);
        parts = parts.max(waves.len());
        let mut at = (a, f64::INFINITY);
        for wave in &waves {
            assert!(
                wave.from == at.0
                    && wave.head <= at.1 * (1.0 + 1e-9)
                    && wave.tail <= wave.head * (1.0 + 1e-9),
                "{a} {b} {waves:?}"
            );
            at = (wave.to, wave.tail);
            for k in 1..20 {
                let lam = wave.from + (wave.to - wave.from) * f64::from(k) / 20.0;
                let line = law.stress(wave.from) + wave.head.powi(2) * (lam - wave.from);
                let above = (line - law.stress(lam)) * (b - a).signum();
                match wave.kind {
                    WaveKind::Shock => assert!(
                        above > -1e-12,
                        "{a} {b}: {wave:?} crosses the stress by {above}"
                    ),
                    WaveKind::Fan => assert!(
                        law.jet(lam)[3] * (b - a) <= 1e-9 * law.jet(lam)[3].abs(),
                        "{a} {b}: {wave:?} at {lam}"
                    ),
                }
            }
        }
        assert_eq!(at.0, b);
    }
    assert!(parts >= 5, "at most {parts} parts");
}
