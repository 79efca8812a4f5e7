//! Spheres and discs of rubber in motion under pressure, against a reference by other rings, closed forms, and the
//! balance of energy.

use crate::membranes::{close, data, number, unit};
use serde_json::Value;
use snaprod::body::History;
use snaprod::membrane::breathing::{SphereEnd, SphereMotion};
use snaprod::membrane::rings::{Direction, DiscMotion};
use snaprod::membrane::sphere::{dynamic_snap, step_response};
use snaprod::membrane::{Inflated, Rubber, Shape};
use std::f64::consts::PI;

/// The disc of the thesis in inches, psi and seconds, in 40 rings. The pressure is 1.65 psi after a ramp of 2 ms, and
/// `after` from 4 ms on.
fn disc_of_the_thesis(
    after: impl Fn(f64) -> f64 + Send + Sync + 'static,
    breaks: Vec<f64>,
) -> DiscMotion {
    let rubber = Rubber::mooney(24.0, 1.5).expect("rubber");
    let disc = Inflated::new(Shape::Disc, rubber, 4.0, 0.05).expect("a disc");
    let pressure = move |t: f64| {
        let p = match t {
            t if t < 2e-3 => 825.0 * t,
            t if t < 4e-3 => 1.65,
            t => after(t),
        };
        // The motion asks for no derivative of the pressure.
        [p, f64::NAN, f64::NAN]
    };
    DiscMotion::new(disc, 1e-4, 40, History::custom(pressure, breaks)).expect("a motion")
}

/// The row of a case of the thesis in the reference.
fn row<'a>(given: &'a Value, case: &str) -> &'a Value {
    let rows = given["runs"].as_array().expect("rows");
    rows.iter().find(|row| row["case"] == case).expect("a case")
}

/// Follows a case through the times of the reference: heights to 0.2 % before 7 ms and to 2 % after.
fn follow(motion: &mut DiscMotion, row: &Value) {
    let heights = row["height_at"].as_object().expect("heights");
    let mut times: Vec<(f64, f64)> = (heights.iter())
        .map(|(time, height)| (time.parse().expect("a time"), number(height)))
        .collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (time, height) in times {
        motion.advance(1e-3 * time).expect("no collapse");
        let tolerance = if time < 7.0 { 2e-3 } else { 2e-2 };
        close("height", motion.height(), height, tolerance);
    }
}

/// Catches a pressure that does not follow the surface, wrong masses or stretches, and a height that is read off
/// beside the maximum: acceptance line 15 of waves, with case 3 of the thesis at Q = 1 psi.
#[test]
fn discs_in_motion() {
    let given = data("circular_dynamic");
    let held = || disc_of_the_thesis(|_| 1.65, vec![2e-3]);
    let let_go = || {
        let pressure = |t: f64| if t < 6e-3 { 1.65 } else { 0.0 };
        disc_of_the_thesis(pressure, vec![2e-3, 6e-3])
    };
    let shaken = || {
        let pressure = |t: f64| 1.65 + (1000.0 * PI * t).sin();
        disc_of_the_thesis(pressure, vec![2e-3, 4e-3])
    };
    let cases = [
        ("case1", let_go()),
        ("case2", held()),
        ("case3 Q=1.0", shaken()),
    ];
    for (case, mut motion) in cases {
        let row = row(&given, case);
        follow(&mut motion, row);
        // After 8.17 ms the disc of case 1, without pressure, is of no interest.
        let end = if case == "case1" { 8.17e-3 } else { 18e-3 };
        motion.advance(end).expect("no collapse");
        let highest = motion.highest();
        close(
            "maximum",
            highest.value,
            number(&row["max_height_in"]),
            5e-3,
        );
        close("time", 1e3 * highest.time, number(&row["at_ms"]), 5e-3);
        let ledger = motion.ledger();
        assert!(
            ledger.error().abs() < 1e-4 * ledger.work,
            "{case} {ledger:?}"
        );
    }
}

/// Catches a ring that collapses without a word, which case 3 of the thesis does at Q = 1.6 psi. The reference says
/// that rings collapse after 14 ms.
#[test]
fn a_disc_collapses_by_name() {
    let given = data("circular_dynamic");
    let pressure = |t: f64| 1.65 + 1.6 * (1000.0 * PI * t).sin();
    let mut motion = disc_of_the_thesis(pressure, vec![2e-3, 4e-3]);
    follow(&mut motion, row(&given, "case3 Q=1.6"));
    let end = motion.advance(20e-3).expect_err("a collapse");
    assert!(14e-3 < end.at.time && end.at.time < 16e-3, "{end}");
    assert_eq!(end.at.direction, Direction::Parallel);
    assert!(0.0 < end.stretch && end.stretch < 0.1);
    let wrinkle = motion.wrinkle().expect("compression before the collapse");
    assert!(wrinkle.time < end.at.time);
    assert!(end.to_string().starts_with("collapse at t = 0.01"), "{end}");
}

/// Catches a wrong inertia or unit of time, and a maximum between two steps that is missed. Independent route:
/// amplitude and period by quadrature.
#[test]
fn a_sphere_under_a_step() {
    let (radius, thickness, density, first, ratio) = (0.3, 2e-3, 900.0, 4e5, 0.0625);
    let rubber = Rubber::mooney(first, first * ratio).expect("rubber");
    let sphere = Inflated::new(Shape::Sphere, rubber, radius, thickness).expect("a sphere");
    for number in [1.5, 3.0] {
        let unit = Rubber::mooney(1.0, ratio).expect("rubber");
        let response = step_response(&unit, number).expect("a response");
        let pressure = number * thickness * first / radius;
        let half = 0.5 * response.period * radius * (density / first).sqrt();
        let mut motion =
            SphereMotion::new(sphere, density, History::Constant(pressure)).expect("a motion");
        motion.advance(1.2 * half).expect("no end");
        let highest = motion.highest();
        close(
            "amplitude",
            highest.value,
            response.amplitude * radius,
            1e-9,
        );
        close("half a period", highest.time, half, 1e-7);
        motion.advance(2.0 * half).expect("no end");
        close("stretch", motion.stretch(), 1.0, 1e-9);
    }
}

/// Catches a snap at another step than the dynamic one, and a sphere that grows without a word.
#[test]
fn a_sphere_bursts_above_its_dynamic_snap() {
    let sphere = unit(Shape::Sphere, 0.0);
    let (snap, hangs) = dynamic_snap(&sphere.rubber).expect("a snap");
    let run = |pressure: f64| {
        let mut motion =
            SphereMotion::new(sphere, 1.0, History::Constant(pressure)).expect("a motion");
        let end = motion.advance(60.0);
        (end, motion.highest().value)
    };
    let (end, highest) = run(snap * (1.0 - 1e-6));
    assert!(end.is_ok() && highest < hangs, "{end:?} {highest}");
    let (end, _) = run(snap * (1.0 + 1e-6));
    assert!(matches!(end, Err(SphereEnd::Burst(_))), "{end:?}");
}

/// Catches a step across a jump of the pressure, and a silent compression.
#[test]
fn a_sphere_whose_pressure_ceases() {
    let off = |t: f64| [if t < 0.7 { 2.0 } else { 0.0 }, f64::NAN, f64::NAN];
    let sphere = unit(Shape::Sphere, 0.0);
    let pressure = History::custom(off, vec![0.7]);
    let mut motion = SphereMotion::new(sphere, 1.0, pressure).expect("a motion");
    motion.advance(0.7).expect("no end");
    assert_eq!(motion.compressed(), None);
    let work = 2.0 * (motion.volume() - 4.0 / 3.0 * PI);
    motion.advance(5.0).expect("no end");
    let ledger = motion.ledger();
    close("work", ledger.work, work, 1e-11);
    assert!(ledger.error().abs() < 1e-10 * work, "{ledger:?}");
    // The free sphere swings between the two stretches with the energy W = work.
    assert!(motion.compressed().is_some());
}

/// Catches bad input that goes unnoticed.
#[test]
fn membranes_in_motion_refuse_bad_input() {
    let steady = || History::Constant(1.0);
    let (sphere, disc) = (unit(Shape::Sphere, 0.0), unit(Shape::Disc, 0.0));
    let messages = [
        DiscMotion::new(sphere, 1.0, 40, steady()).err(),
        DiscMotion::new(disc, 0.0, 40, steady()).err(),
        DiscMotion::new(disc, 1.0, 1, steady()).err(),
        DiscMotion::new(disc, 1.0, 40, History::Constant(f64::NAN)).err(),
        SphereMotion::new(disc, 1.0, steady()).err(),
        SphereMotion::new(sphere, f64::NAN, steady()).err(),
    ];
    let parts = [
        "are for discs",
        "density 0",
        "2 rings or more",
        "",
        "for spheres",
        "density NaN",
    ];
    for (message, part) in messages.into_iter().zip(parts) {
        let message = message.expect("an error").to_string();
        assert!(message.contains(part), "{message}");
    }
}
