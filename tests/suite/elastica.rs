//! Closed form of the elastica against shooting in 256-bit arithmetic (tools/ref_equilibria.py and others).

use crate::support::{assert_close, json, number, rows};
use nalgebra::Vector2;
use proptest::prelude::*;
use snaprod::elastica::chart::ChartPoint;
use snaprod::elastica::curvature::TipDerivatives;
use snaprod::elastica::{
    Elastica, Equilibrium, equilibrium_under_load, fold_at, fold_curve, fold_distance,
};
use snaprod::manifold::{EquilibriumManifold, Multivalued, Sign, adjugate_times};
use std::f64::consts::PI;

fn reference(row: &serde_json::Value) -> Equilibrium {
    Equilibrium::from_lambda_p(number(row, "lam"), number(row, "p")).expect("a legal equilibrium")
}

/// Catches any wrong term of the chart: 64 equilibria, generic, near-straight, slight, taut, looped.
/// U, y and 1 - x must hold *relative* accuracy also where they are 1e-18.
#[test]
fn equilibria_match_shooting() {
    let data = json("equilibria.json");
    for row in rows(&data, "rows", 60) {
        let e = reference(row);
        let what = format!("{} lam {} kap {}", row["kind"], row["lam"], row["kap"]);
        // p as a double moves a taut rod by eps p, which the exponentials feel.
        let p = number(row, "p").abs();
        let eps = 4e-14 * (1.0 + p);
        let near = |got, key: &str, floor: f64| {
            assert_close(got, number(row, key), eps, floor, &format!("{what}: {key}"));
        };
        near(e.lambda, "lam", 0.0);
        near(e.kappa, "kap", 0.0);
        near(e.kappa_c, "kapc", 0.0);
        near(e.alpha, "alpha", 1e-2 * e.kappa_c.min(e.k));
        near(e.theta1, "theta1", 1.0);
        near(e.one_minus_x, "one_minus_x", 0.0);
        near(e.x, "x", 1.0);
        near(e.y, "y", 0.01 * e.k.min(1.0));
        near(e.energy, "U", 0.0);
        near(e.force[0].hypot(e.force[1]), "force", 0.0);
        assert_eq!(e.sheet.mode, number(row, "mode") as u32, "{what}");
        assert_eq!(e.sheet.sign.value(), number(row, "sign"), "{what}");
        for section in rows(row, "shape", 3) {
            let s = number(section, "s");
            let got = e.section(s).expect("s in [0, 1]");
            let size = e.theta1.abs().max(e.k);
            let near = |got, key: &str, floor| {
                assert_close(
                    got,
                    number(section, key),
                    10.0 * eps,
                    floor,
                    &format!("{what} s {s}: {key}"),
                );
            };
            near(got.theta, "theta", size);
            near(got.curvature, "dtheta", e.lambda * size);
            near(got.x, "x", 1.0);
            near(got.y, "y", size.min(1.0));
        }
    }
}

/// Catches a label that is not the inverse of another: (p, w) -> (j, +-, k, beta) -> (p, w) and
/// (lam, kap) -> (p, w), and the paper's formulas (3.14), (3.17) themselves.
#[test]
fn labels_go_both_ways() {
    use snaprod::math::elliptic::{complete_e, complete_k, incomplete_e, incomplete_f};
    for p in [0.3, -0.3, 1.2, -2.5] {
        for w in [0.2, 1.5, 1.7, 3.0, 3.3, 4.6, 6.2, 6.4, 9.0] {
            let e = Equilibrium::new(p, w).unwrap();
            let back = Equilibrium::from_sheet(e.sheet, e.k, e.beta).unwrap();
            assert_close(back.p, p, 1e-14, 0.0, "p from the sheet");
            assert_close(back.w, w, 1e-15, 0.0, "w from the sheet");
            let back = Equilibrium::from_lambda_p(e.lambda, p).unwrap();
            assert_close(back.w, w, 1e-13, 0.0, "w from the load");
            let (j, sign) = (f64::from(e.sheet.mode), e.sheet.sign.value());
            let (kc, beta) = (e.kappa_c, e.beta);
            let periods = 2.0 * j + 1.0;
            let lam = periods * complete_k(kc).unwrap() + sign * incomplete_f(beta, kc).unwrap();
            assert_close(lam, e.lambda, 1e-13, 0.0, "AMV (3.14b)");
            assert_close(
                2.0 * (e.k * beta.sin()).asin(),
                e.alpha,
                1e-14,
                1.0,
                "AMV (3.14a)",
            );
            let (sin, cos) = e.alpha.sin_cos();
            let energy = periods * complete_e(kc).unwrap() + sign * incomplete_e(beta, kc).unwrap();
            let along = cos * e.x + sin * e.y;
            let across = -sin * e.x + cos * e.y;
            assert_close(along, -1.0 + 2.0 * energy / lam, 1e-13, 1.0, "AMV (3.17)");
            assert_close(
                across,
                sign * 2.0 * e.k * beta.cos() / lam,
                1e-13,
                1.0,
                "AMV (3.17)",
            );
            let mirror = Equilibrium::new(-p, w).unwrap();
            assert!(mirror.x == e.x && mirror.y == -e.y && mirror.sheet.sign != e.sheet.sign);
        }
    }
}

/// Catches a sign or factor in any derivative: dU = -F . dr, and the Jacobian and the second
/// derivatives against differences of order 6.
#[test]
fn derivatives_match_differences() {
    let h = 1e-3;
    let six = |f: &dyn Fn(f64) -> f64| {
        (45.0 * (f(h) - f(-h)) - 9.0 * (f(2.0 * h) - f(-2.0 * h)) + f(3.0 * h) - f(-3.0 * h))
            / (60.0 * h)
    };
    for (p, w) in [
        (0.4, 0.8),
        (-1.1, 2.6),
        (1.5, 5.0),
        (2.5, 3.0),
        (0.05, 6.0),
        (4.0, 1.2),
    ] {
        let at = |dp: f64, dw: f64| Elastica.point(&Vector2::new(p + dp, w + dw)).unwrap();
        let here = at(0.0, 0.0);
        for (column, along) in [(0, [1.0, 0.0]), (1, [0.0, 1.0])] {
            let moved = |s: f64| at(s * along[0], s * along[1]);
            let slope = here.jacobian.column(column).into_owned();
            for i in 0..2 {
                let difference = six(&|s| moved(s).pose[i]);
                assert_close(slope[i], difference, 1e-10, 1.0, "Jacobian");
            }
            let work = six(&|s| moved(s).energy);
            assert_close(-here.force.dot(&slope), work, 1e-10, 1.0, "dU = -F . dr");
        }
        let lam = ChartPoint::new(p, w).integrals.lam;
        let derivatives = |dp: f64, dl: f64| {
            let point = ChartPoint::at_load(p + dp, lam + dl).unwrap();
            let t = TipDerivatives::new(&point);
            [t.p, t.l, t.pp, t.pl, t.ll].map(|v| point.to_fixed(v))
        };
        let [_, _, pp, pl, ll] = derivatives(0.0, 0.0);
        for i in 0..2 {
            assert_close(
                pp[i],
                six(&|s| derivatives(s, 0.0)[0][i]),
                1e-9,
                1.0,
                "r_pp",
            );
            assert_close(
                pl[i],
                six(&|s| derivatives(0.0, s)[0][i]),
                1e-9,
                1.0,
                "r_pl",
            );
            assert_close(
                ll[i],
                six(&|s| derivatives(0.0, s)[1][i]),
                1e-9,
                1.0,
                "r_ll",
            );
        }
    }
}

/// Catches the cancellation of det as lam -> 0 (theory 2.3): det d(x, y)/d(p, lam) of a slight rod scales
/// with a power of lam, so its logarithmic slope must settle; and derivatives match across the switch.
#[test]
fn slight_rods_keep_their_derivatives() {
    let det = |p: f64, lam: f64| {
        let at = ChartPoint::at_load(p, lam).unwrap();
        at.det() * at.integrals.d
    };
    for p in [0.3, 1.0, -2.0, 5.0, 8.0] {
        for lam in [1e-4, 1e-3, 1e-2, 0.1] {
            let order = (det(p, 2.0 * lam) / det(p, lam)).log2();
            assert!(
                (order - 7.0).abs() < 0.1 + 3.0 * lam,
                "p {p} lam {lam}: order {order}"
            );
        }
        // The closed form still has twelve digits on the other side of the switch.
        let [below, above] = [0.3 * (1.0 - 1e-9), 0.3 * (1.0 + 1e-9)].map(|lam| det(p, lam));
        assert_close(above, below, 2e-8, 0.0, "det across the switch");
    }
    // From shooting at lam = 0.3, 0.05, 0.01: the derivative of 1 - x along lam by differences of tips.
    let h = 1e-3;
    for lam in [0.05, 0.1, 0.2] {
        let tip = |l: f64| Equilibrium::from_lambda_p(l, 0.7).unwrap().one_minus_x;
        let slope = (8.0 * (tip(lam * (1.0 + h)) - tip(lam * (1.0 - h)))
            - (tip(lam * (1.0 + 2.0 * h)) - tip(lam * (1.0 - 2.0 * h))))
            / (12.0 * h * lam);
        let at = ChartPoint::at_load(0.7, lam).unwrap();
        let along_lam = at.column_w.map(|v| v * at.integrals.d);
        assert_close(-along_lam[0], slope, 1e-9, 0.0, "d(1 - x)/d lam");
    }
}

/// Catches cusps lost or doubled on steep curves (the loads of the twentieth change by 1.8 while p changes by 0.02),
/// and points assigned to another curve. Each half of a fold curve has two cusps, at which its image reverses its
/// direction.
#[test]
fn every_fold_curve_has_two_cusps() {
    for number in [1, 2, 5, 10, 16, 17, 18, 20] {
        let curve = fold_curve(number, 0.01, 8.0, 0.05).unwrap();
        let cusps: Vec<f64> = (curve.iter().filter(|at| at.cusp))
            .map(|at| at.equilibrium.p)
            .collect();
        assert_eq!(cusps.len(), 2, "curve {number}: {cusps:?}");
        for p in cusps {
            let at = |p: f64| {
                let e = fold_at(number, p).unwrap().equilibrium;
                Vector2::new(e.x, e.y)
            };
            let [before, cusp, after] = [p - 1e-4, p, p + 1e-4].map(at);
            let [come, go] = [cusp - before, after - cusp];
            let back = come.dot(&go) / (come.norm() * go.norm());
            assert!(back < -0.99, "curve {number} at p = {p}: {back}");
        }
        for point in curve.iter().step_by(40) {
            let e = &point.equilibrium;
            let counted = fold_at(number, e.p).unwrap().equilibrium.lambda;
            assert_close(e.lambda, counted, 1e-11, 0.0, "lambda of a fold");
        }
    }
}

/// Catches a fold in the wrong place: the curves 1 to 3, their limits as kap -> 0 and their cusps
/// against 256-bit arithmetic, and the first against the project's first table.
#[test]
fn folds_match_references() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/folds.csv");
    let text = std::fs::read_to_string(path).expect("tests/data/folds.csv");
    let mut counts = [0; 4];
    for line in text
        .lines()
        .filter(|l| !l.starts_with('#') && !l.starts_with("kind"))
    {
        let cells: Vec<&str> = line.split(',').collect();
        let value = |i: usize| cells[i].parse::<f64>().expect("a number");
        let number = value(1) as usize;
        match cells[0] {
            "limit" => {
                counts[0] += 1;
                let f = fold_at(number, 0.0).unwrap().equilibrium;
                assert_close(f.lambda, value(4), 1e-14, 0.0, "limit");
            }
            "fold" => {
                counts[1] += 1;
                let f = fold_at(number, value(3)).unwrap().equilibrium;
                for (got, i) in [
                    (f.lambda, 4),
                    (f.x, 5),
                    (f.y, 6),
                    (f.alpha, 7),
                    (f.energy, 9),
                ] {
                    assert_close(got, value(i), 1e-11, 1.0, line);
                }
            }
            "cusp" => {
                counts[2] += 1;
                let curve = fold_curve(number, 0.5, 3.0, 0.1).unwrap();
                let nearest = curve
                    .iter()
                    .filter(|f| f.cusp)
                    .map(|f| f.equilibrium)
                    .min_by(|a, b| (a.p - value(3)).abs().total_cmp(&(b.p - value(3)).abs()))
                    .expect("a cusp");
                for (got, i) in [(nearest.lambda, 4), (nearest.x, 5), (nearest.y, 6)] {
                    assert_close(got, value(i), 1e-9, 1.0, line);
                }
            }
            "vertical" => {
                // There det has a triple root in lam: the point lies on the curve, but lam at this p is
                // known to a third of the digits only.
                counts[3] += 1;
                let f = fold_at(number, value(3)).unwrap().equilibrium;
                for (got, i) in [(f.lambda, 4), (f.x, 5), (f.y, 6)] {
                    assert_close(got, value(i), 1e-4, 1.0, line);
                }
            }
            other => panic!("unknown kind {other}"),
        }
    }
    assert!(
        counts[0] >= 3 && counts[1] >= 30 && counts[2] >= 6 && counts[3] >= 3,
        "{counts:?}"
    );

    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fold_curve.csv");
    let text = std::fs::read_to_string(path).expect("tests/data/fold_curve.csv");
    let mut seen = 0;
    for line in text
        .lines()
        .filter(|l| !l.starts_with('#') && !l.starts_with('p'))
    {
        let v: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
        let f = fold_at(1, v[0]).unwrap().equilibrium;
        for (got, want) in [
            (f.lambda, v[2]),
            (f.x, v[3]),
            (f.y, v[4]),
            (f.alpha, v[5]),
            (f.energy, v[6]),
        ] {
            assert_close(got, want, 1e-9, 1.0, line);
        }
        seen += 1;
    }
    assert!(seen >= 90, "only {seen} rows");
}

/// The hinged rods of benchmark B10 are points of the first fold curve seen from the clamp.
#[test]
fn hinged_snap_points_lie_on_the_first_fold() {
    let curve = fold_curve(1, 0.05, 1.0, 0.002).unwrap();
    for (x, y) in [
        (0.968914, 0.203238),
        (0.710214, 0.552808),
        (0.267141, 0.647021),
    ] {
        let distance = curve
            .windows(2)
            .map(|pair| {
                let [a, b] = [0, 1].map(|i| {
                    Vector2::new(pair[i].equilibrium.x - x, pair[i].equilibrium.y.abs() - y)
                });
                let d = b - a;
                let t = (-a.dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
                (a + d * t).norm()
            })
            .fold(f64::INFINITY, f64::min);
        assert!(distance < 1e-6, "({x}, {y}) is {distance} off the fold");
    }
}

/// Catches an index that counts sheets instead of conjugate points: inertia of the second variation
/// (200 Legendre functions), both sides of the folds.
#[test]
fn index_matches_the_second_variation() {
    let data = json("index.json");
    for row in rows(&data, "rows", 40) {
        let e = Equilibrium::from_lambda_kappa(number(row, "lam"), number(row, "kap")).unwrap();
        let index = Elastica.index(&Vector2::new(e.p, e.w)).unwrap();
        assert_eq!(index, number(row, "index") as usize, "{row}");
        let stable_by_distance = fold_distance(&e).unwrap() > 0.0;
        assert_eq!(stable_by_distance, index == 0, "{row}");
    }
}

/// The benchmark B4: a transverse dead load (alpha = pi/2 up to reflection), from linear to large.
#[test]
fn cantilever_under_transverse_load() {
    for (load, w, u, angle) in [
        (0.2, 0.0663644821, 0.0026465483, 0.0996361630),
        (1.0, 0.3017207738, 0.0564332363, 0.4613519497),
        (3.0, 0.6032534411, 0.2544201846, 0.9860169467),
        (10.0, 0.8106090249, 0.5549955978, 1.4302855388),
    ] {
        // theta(1) = alpha + 2 asin kap with alpha = -pi/2: kap from the tip angle, then check all.
        let lambda = f64::sqrt(load);
        let (mut low, mut high): (f64, f64) = (0.0, 20.0);
        for _ in 0..200 {
            let p = 0.5 * (low + high);
            let alpha = Equilibrium::from_lambda_p(lambda, p).unwrap().alpha;
            if alpha > -0.5 * PI { low = p } else { high = p }
        }
        let e = Equilibrium::from_lambda_p(lambda, 0.5 * (low + high)).unwrap();
        assert_close(e.y, w, 1e-9, 0.0, "deflection");
        assert_close(e.one_minus_x, u, 1e-8, 0.01, "shortening");
        assert_close(e.theta1, angle, 1e-9, 0.0, "tip angle");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// No chart point, however extreme, gives a NaN, a tip outside the disc or a negative energy.
    #[test]
    fn chart_is_total(p in -400.0..400.0f64, w in 1e-6..40.0f64) {
        if let Ok(e) = Equilibrium::new(p, w) {
            prop_assert!(e.x.hypot(e.y) <= 1.0 + 1e-15);
            prop_assert!(e.energy >= 0.0 && e.lambda > 0.0 && e.lambda.is_finite());
            prop_assert!(e.one_minus_x >= 0.0 && e.alpha.abs() <= PI);
            for s in e.curve(9) {
                prop_assert!(s.x.is_finite() && s.y.is_finite() && s.theta.is_finite() && s.curvature.is_finite());
            }
        }
    }

    /// kap a few ulps from 0 and from 1 keeps the laws: U = 2 lam kap^2 B scales with kap^2 near 0,
    /// |r| < 1 near 1, and the index is even where det > 0.
    #[test]
    fn degenerate_moduli(ulps in 1u64..20, lam in 0.5..13.0f64) {
        let tiny = Equilibrium::from_lambda_kappa(lam, f64::from_bits(ulps)).unwrap();
        prop_assert!(tiny.x == 1.0 && tiny.energy >= 0.0);
        let small = Equilibrium::from_lambda_kappa(lam, 1e-9).unwrap();
        let twice = Equilibrium::from_lambda_kappa(lam, 2e-9).unwrap();
        prop_assert!((twice.energy / small.energy - 4.0).abs() < 1e-12);
        prop_assert!((twice.one_minus_x / small.one_minus_x - 4.0).abs() < 1e-11);
        let near_one = Equilibrium::from_lambda_kappa(lam, 1.0 - ulps as f64 * f64::EPSILON).unwrap();
        prop_assert!(near_one.x.hypot(near_one.y) <= 1.0);
    }

    /// The index has the parity of the sign of det, everywhere off the folds.
    #[test]
    fn index_parity(p in -5.0..5.0f64, lam in 0.3..30.0f64) {
        prop_assume!(p.abs() > 1e-3);
        let e = Equilibrium::from_lambda_p(lam, p).unwrap();
        let q = Vector2::new(e.p, e.w);
        let at = Elastica.point(&q).unwrap();
        let (det, _) = adjugate_times(&at.jacobian, &Vector2::zeros());
        let index = Elastica.index(&q).unwrap();
        prop_assert_eq!(det > 0.0, index % 2 == 0, "index {} det {}", index, det);
        prop_assert_eq!(Elastica.sheet(&q).sign, Sign::of(e.kappa * e.w.sin()));
    }
}

/// Catches a load direction found as a small difference of angles, which destroys a small deflection. Reference: the
/// beam under the axial load, y = F (1 - tanh b/b)/N under a pull N = b^2, F (tan b/b - 1)/|N| under a push.
#[test]
fn a_load_nearly_along_the_rod_deflects_it_as_a_beam() {
    for along in [-2.3, -1.0, -1e-3, 1e-3, 1.0, 30.0, 2500.0, 1e5] {
        for part in [1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4] {
            let b = f64::abs(along).sqrt();
            let series = [62.0 / 2835.0, 17.0 / 315.0, 2.0 / 15.0, 1.0 / 3.0];
            let beam = match b < 0.1 {
                // Rounding cancels most of b - tanh b and tan b - b.
                true => series.iter().fold(0.0, |sum, term| term - along * sum),
                false if along > 0.0 => (1.0 - b.tanh() / b) / along,
                false => (b.tan() / b - 1.0) / -along,
            };
            let across = -part * f64::abs(along);
            let y = equilibrium_under_load(&Vector2::new(along, across))
                .unwrap()
                .unwrap()
                .y;
            let error = (y / (across * beam) - 1.0).abs();
            let bound = 1e-12 + 1e3 * part * part;
            assert!(
                error < bound,
                "({along}, {across:e}): {y:e}, off by {error:e}"
            );
        }
    }
}

/// Catches an index counted only up to the number of fold curves (4096): a slightly bent rod under a push loses one
/// more mode with each half turn of w.
#[test]
fn the_index_grows_with_the_mode() {
    for lambda in [100.0, 1000.0, 12_800.0, 12_950.0, 20_000.0] {
        let rod = Equilibrium::from_lambda_kappa(lambda, 0.1).unwrap();
        let index = Elastica.index(&Vector2::new(rod.p, rod.w)).unwrap();
        assert_eq!(index + 1, rod.sheet.mode as usize, "lambda = {lambda}");
    }
    let far = Equilibrium::from_lambda_kappa(9e8, 0.1).unwrap();
    assert!(Elastica.index(&Vector2::new(far.p, far.w)).is_err());
}

/// Catches a rod at rest that does not balance its load, is unstable, or leans to the wrong side. Loads from slight to
/// enormous in all directions, and the cantilevers of the literature (transverse dead load, Mattiasson 1981; a
/// slightly pushed column at 1.5 times Euler's load).
#[test]
fn a_settled_rod_carries_its_load() {
    for size in [1e-8, 1e-3, 0.5, 3.0, 40.0, 2500.0, 1e5] {
        for k in 1..24 {
            let angle = f64::from(k) * std::f64::consts::PI / 12.0;
            if k == 12 {
                continue;
            }
            let load = size * Vector2::new(angle.cos(), angle.sin());
            let rod = equilibrium_under_load(&load).unwrap().expect("a bent rod");
            let off = (Vector2::from(rod.force) + load).norm();
            assert!(off <= 1e-12 * size, "{load}: off by {off:e}");
            assert!(rod.y * load.y > 0.0 && rod.w < std::f64::consts::FRAC_PI_2);
            assert_eq!(Elastica.index(&Vector2::new(rod.p, rod.w)).unwrap(), 0);
        }
    }
    let rod = equilibrium_under_load(&Vector2::new(0.0, -10.0))
        .unwrap()
        .unwrap();
    assert!((rod.one_minus_x - 0.5549955978).abs() < 1e-9 && (rod.y + 0.8106090249).abs() < 1e-9);
    let euler = std::f64::consts::PI * std::f64::consts::PI / 4.0;
    let rod = equilibrium_under_load(&Vector2::new(-1.518388793 * euler, 1e-9)).unwrap();
    let rod = rod.unwrap();
    assert!(
        (rod.x - 0.3489893004).abs() < 1e-7 && (rod.y - 0.7915395965).abs() < 1e-7,
        "{rod:?}"
    );
    // A clamp upright to rounding: loads along the rod to rounding.
    for push in [2.6, 3.0, 3.7011016504085092, 5.0, 8.0] {
        let rod = equilibrium_under_load(&Vector2::new(-push, -6e-17 * push))
            .unwrap()
            .expect("a bent rod");
        assert!(
            (rod.lambda * rod.lambda - push).abs() < 1e-12 * push,
            "{push}: {rod:?}"
        );
        assert!(
            (rod.w - std::f64::consts::FRAC_PI_2).abs() < 1e-12,
            "{push}: {rod:?}"
        );
    }
    for along in [-2.0, 1.0, 30.0] {
        for across in [0.0, 6e-17, -3e-16] {
            let load = Vector2::new(1.0, across) * along;
            assert!(equilibrium_under_load(&load).unwrap().is_none(), "{load}");
        }
    }
    assert!(
        equilibrium_under_load(&Vector2::new(-2.5, 0.0)).is_err()
            && equilibrium_under_load(&Vector2::new(0.0, 1e6)).is_err()
    );
}
