//! Impacts at one contact: three laws against given numbers, in space against another integration.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::body::{Mass, RigidBody};
use snaprod::contact::{
    Complementarity, Impact, ImpactLaw, Mode, OneContact, RigidMotion, SurfacePair, Touch,
};

/// The numbers of a file of tests/data/contact.
pub fn data(name: &str) -> Value {
    let path = format!("{}/tests/data/contact/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    serde_json::from_str(&text).expect("JSON")
}

pub fn number(of: &Value, key: &str) -> f64 {
    of[key]
        .as_f64()
        .unwrap_or_else(|| panic!("no number {key}"))
}

fn numbers(of: &Value) -> Vec<f64> {
    let list = of.as_array().expect("a list");
    list.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// Fails on a difference of more than `tolerance` relative to 1 + size, and on NaN.
#[track_caller]
pub fn near(value: f64, reference: f64, tolerance: f64) {
    let difference = (value - reference).abs();
    assert!(
        difference <= tolerance * reference.abs().max(1.0),
        "{value} is off {reference} by {difference:e}"
    );
}

fn law(name: &str) -> ImpactLaw {
    match name {
        "newton" => ImpactLaw::Newton,
        "poisson" => ImpactLaw::Poisson,
        "stronge" => ImpactLaw::Stronge,
        other => panic!("{other}"),
    }
}

/// A uniform rod that meets the plane y = 0 with its end left below its centre, and the axes of the contact.
fn rod_end(beta: f64, before: &[f64], along: &Vector3<f64>) -> (Impact, Matrix3<f64>) {
    let lever = Vector3::new(-0.5 * beta.cos(), -0.5 * beta.sin(), 0.0);
    let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / 12.0));
    let mass = Mass::Rigid(RigidBody::new(1.0, inertia).expect("a body"));
    let twist = Vector6::new(0.0, 0.0, before[2], before[0], before[1], 0.0);
    let motion = RigidMotion::new(Isometry3::identity(), &twist);
    let touch = Touch {
        gap: 0.0,
        normal: Vector3::y(),
        point: lever,
        normal_rate: Vector3::zeros(),
        point_rate: Vector3::zeros(),
        spread: None,
    };
    let axes = touch.axes(along);
    let rows = touch.rows(&motion, &axes);
    let inverse = mass.inverse_matrix(&UnitQuaternion::identity());
    let impact = Impact {
        inverse_mass: rows * inverse * rows.transpose(),
        slip: axes.tr_mul(&motion.velocity_at(&lever)),
    };
    (impact, axes)
}

/// Catches a wrong law, a missed change from slip to stick or back, and components that depend on the choice of
/// tangents. Newton's law must not create energy without a word.
#[test]
fn three_laws_in_the_plane() {
    let mut refused = 0;
    for case in data("small_given.json")["rigid"].as_array().expect("cases") {
        let before = numbers(&case["before"]);
        for along in [Vector3::x(), Vector3::z(), Vector3::new(1.0, 0.0, 2.0)] {
            let (impact, axes) = rod_end(number(case, "beta"), &before, &along);
            let surface =
                SurfacePair::new(number(case, "e"), number(case, "mu")).expect("a surface");
            for result in case["results"].as_array().expect("results") {
                let law = law(result["law"].as_str().expect("a law"));
                let rebound = impact.rebound(&surface.with_law(law));
                if number(result, "energy_change") > 0.0 {
                    let words = rebound.expect_err("creates energy").to_string();
                    assert!(
                        words.contains("1.132e-1") && words.contains("stronge"),
                        "{words}"
                    );
                    refused += 1;
                    continue;
                }
                let rebound = rebound.expect("a rebound");
                let impulse = axes * rebound.impulse;
                near(impulse.y, number(result, "Jn"), 1e-14);
                near(impulse.x, number(result, "Jt"), 1e-14);
                near(impulse.z, 0.0, 1e-15);
                near(rebound.slip.x, number(result, "vn"), 1e-14);
                near((axes * rebound.slip).x, number(result, "vt"), 1e-14);
                near(rebound.normal_work, number(result, "normal_work"), 1e-14);
                near(-rebound.lost, number(result, "energy_change"), 1e-14);
            }
        }
    }
    assert_eq!(refused, 3);
}

/// Catches a contact that may jam and is not refused, and the reverse: a uniform rod at tan(angle) = 2 jams from
/// mu = 4/3 on.
#[test]
fn jamming_is_refused() {
    let (impact, _) = rod_end(2.0_f64.atan(), &[0.0, -1.0, 0.0], &Vector3::x());
    let at = |mu: f64| impact.rebound(&SurfacePair::new(0.5, mu).expect("a surface"));
    assert!(at(4.0 / 3.0 - 1e-9).is_ok());
    let words = at(4.0 / 3.0 + 1e-9).expect_err("jams").to_string();
    assert!(
        words.contains("Painleve") && words.contains("1.333333"),
        "{words}"
    );
}

/// Catches a wrong turn of the slip in space, a wrong end of slip, and a wrong direction after it: against an
/// integration in polar coordinates.
#[test]
fn curved_slip_in_space() {
    let mut kinds = std::collections::BTreeSet::new();
    for case in data("impacts.json")["space"].as_array().expect("cases") {
        kinds.insert((case["ends"].to_string(), case["sticks"].to_string()));
        let rows: Vec<Vec<f64>> = (case["inverse_mass"].as_array().expect("rows").iter())
            .map(numbers)
            .collect();
        let impact = Impact {
            inverse_mass: Matrix3::from_fn(|i, j| rows[i][j]),
            slip: Vector3::from_column_slice(&numbers(&case["slip"])),
        };
        let surface = SurfacePair::new(number(case, "e"), number(case, "mu")).expect("a surface");
        for name in ["newton", "poisson", "stronge"] {
            let rebound = impact
                .rebound(&surface.with_law(law(name)))
                .expect("a rebound");
            let result = &case["results"][name];
            let (impulse, slip) = (numbers(&result["impulse"]), numbers(&result["slip"]));
            for i in 0..3 {
                near(rebound.impulse[i], impulse[i], 1e-11);
                near(rebound.slip[i], slip[i], 1e-11);
            }
            near(rebound.normal_work, number(result, "normal_work"), 1e-11);
        }
    }
    assert_eq!(kinds.len(), 4, "{kinds:?}");
}

/// A number in [-1, 1] from a generator of its own.
fn drawn(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Catches energy from nowhere under the laws of Stronge and Poisson, friction beyond its cone, and an impulse that
/// does not give the velocities, on impacts drawn at random.
#[test]
fn impacts_lose_energy() {
    let mut seed = 7;
    let mut rebounds = 0;
    for k in 0..600 {
        let a = Matrix3::from_fn(|_, _| drawn(&mut seed));
        let inverse_mass = a * a.transpose() + Matrix3::identity() * 0.2;
        let [n, s, t, e, mu] = std::array::from_fn(|_| drawn(&mut seed));
        let impact = Impact {
            inverse_mass,
            slip: Vector3::new(-n.abs() - 0.01, s, t),
        };
        let surface = SurfacePair::new(e.abs(), mu.abs()).expect("a surface");
        let surface = surface.with_law([ImpactLaw::Stronge, ImpactLaw::Poisson][k % 2]);
        match impact.rebound(&surface) {
            Ok(rebound) => {
                rebounds += 1;
                assert!(rebound.lost >= -1e-13, "{rebound:?}");
                let slip = impact.slip + inverse_mass * rebound.impulse;
                assert!((slip - rebound.slip).norm() < 1e-12);
                let friction = rebound.impulse.yz().norm();
                assert!(friction <= mu.abs() * rebound.impulse.x * (1.0 + 1e-12));
            }
            Err(why) => assert!(why.to_string().contains("Painleve"), "{why}"),
        }
    }
    assert!(rebounds > 550);
}

/// Catches solutions of several contacts at once that break an inequality, on problems drawn at random, and a missing
/// solution.
#[test]
fn contacts_at_once_obey_their_inequalities() {
    let mut seed = 11;
    for _ in 0..60 {
        let n = 3;
        let a = nalgebra::DMatrix::from_fn(3 * n, 3 * n, |_, _| drawn(&mut seed));
        let mut inverse_mass = &a * a.transpose() * 0.1;
        for i in 0..3 * n {
            inverse_mass[(i, i)] += 1.0;
        }
        let problem = Complementarity {
            inverse_mass,
            free: nalgebra::DVector::from_fn(3 * n, |_, _| drawn(&mut seed)),
            contacts: vec![
                OneContact {
                    friction: 0.4,
                    least: 0.0,
                    slips_along: None,
                };
                n
            ],
        };
        let solution = problem.solve().expect("a solution");
        for (i, mode) in solution.modes.iter().enumerate() {
            let x = solution.forces.fixed_rows::<3>(3 * i);
            let u = solution.motion.fixed_rows::<3>(3 * i);
            assert!(x[0] >= -1e-9 && u[0] >= -1e-9 && (x[0] * u[0]).abs() < 1e-9);
            let friction = nalgebra::Vector2::new(x[1], x[2]);
            let slip = nalgebra::Vector2::new(u[1], u[2]);
            assert!(friction.norm() <= 0.4 * x[0] + 1e-9);
            match mode {
                Mode::Open => assert!(x.norm() < 1e-12),
                Mode::Stick => assert!(u.norm() < 1e-9),
                Mode::Slip(_) => {
                    let expected = -slip.normalize() * 0.4 * x[0];
                    assert!((friction - expected).norm() < 1e-8);
                }
            }
        }
    }
}

/// Catches surfaces without a meaning that are taken: each message names the number.
#[test]
fn refuses_what_is_no_surface() {
    for (e, mu, named) in [
        (1.1, 0.0, "restitution"),
        (f64::NAN, 0.0, "restitution"),
        (-0.1, 0.0, "restitution"),
        (0.5, -0.1, "friction"),
        (0.5, f64::NAN, "friction"),
        (0.5, f64::INFINITY, "friction"),
    ] {
        let words = SurfacePair::new(e, mu).expect_err("refused").to_string();
        assert!(words.contains(named), "{words}");
    }
    let parting = Impact {
        inverse_mass: Matrix3::identity(),
        slip: Vector3::x(),
    };
    assert!(parting.rebound(&SurfacePair::default()).is_err());
}
