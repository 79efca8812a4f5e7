//! Rods that snap or become unstable: B9 to B11, B13.

use super::{Number, number, planar_rod, rows, specials, tilt};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::Result;
use snaprod::rod::{BranchEquilibrium, EndConditions, Problem, Rod};
use snaprod::section::Linear;
use snaprod::solve::special_points::{Special, SpecialKind};
use std::f64::consts::PI;

/// Condition of the far end while one clamp is turned.
#[derive(Clone, Copy, PartialEq)]
enum Far {
    Clamped,
    Hinged,
    /// Clamped and turned the other way.
    Turned,
}

/// Special points up to the fold of a rod with one clamp turned by the angle p. The ends are 1 - s apart, and the rod
/// is at first bent away from the turn.
fn turning(s: f64, far: Far, count: usize) -> Result<Vec<(Special, BranchEquilibrium)>> {
    let end = Vector3::z() * (1.0 - s);
    let problem = move |a: f64| {
        let turn = |a: f64| UnitQuaternion::from_scaled_axis(Vector3::y() * a);
        let rod = planar_rod(1.0)?.with_clamp(Vector3::zeros(), turn(a));
        let end = match far {
            Far::Clamped => EndConditions::pose(end, UnitQuaternion::identity()),
            Far::Hinged => EndConditions::ball(end),
            Far::Turned => EndConditions::pose(end, turn(-a)),
        };
        Problem::new(rod, end, 1e-13)
    };
    // Buckled away from the turn: load, couple and force across to second order in the bending.
    let (load, couple, across) = match far {
        Far::Hinged => (-20.19, -8.987, -8.987),
        _ => (-4.0 * PI * PI, -4.0 * PI, 0.0),
    };
    let root = s.sqrt();
    let guess = Vector6::new(
        0.0,
        couple * root,
        0.0,
        across * root,
        0.0,
        load * (1.0 + 0.5 * s),
    );
    let base = problem(0.0)?.solve(Some(&guess))?.base;
    specials(problem, base, (0.0, 2.6 * s.sqrt()), count)
}

/// The value at s = 0 of a polynomial through samples at s, s/2, s/4, ... (Neville).
fn extrapolated(samples: &[f64]) -> f64 {
    let mut row = samples.to_vec();
    let mut factor = 1.0;
    while row.len() > 1 {
        factor *= 2.0;
        row = row
            .windows(2)
            .map(|pair| (factor * pair[1] - pair[0]) / (factor - 1.0))
            .collect();
    }
    row[0]
}

/// B9: the fold values for vanishing shortening, by extrapolation in s.
pub fn shallow_snaps(data: &Value) -> Result<Vec<Number>> {
    let outputs = &data["B9"]["outputs"];
    let mut numbers = Vec::new();
    for (key, what, far, count) in [
        ("clamped", "far end clamped flat", Far::Clamped, 1),
        ("hinged", "far end hinged", Far::Hinged, 1),
        ("symmetric", "both clamps turned", Far::Turned, 2),
    ] {
        let mut all = Vec::new();
        for i in 0..5 {
            let s = 0.02 * 0.5_f64.powi(i);
            let found = turning(s, far, count)?;
            assert_eq!(found.len(), count, "{key}");
            assert_eq!(found[count - 1].0.kind, SpecialKind::Fold, "{key}");
            all.push(
                found
                    .iter()
                    .map(|(special, at)| [special.point.p / s.sqrt(), -at.end.force.z])
                    .collect::<Vec<_>>(),
            );
        }
        let limit = |which: usize, part: usize| {
            extrapolated(&all.iter().map(|at| at[which][part]).collect::<Vec<_>>())
        };
        let fold = Number::new(
            "B9",
            format!("{what}: fold, mu"),
            limit(count - 1, 0),
            number(&outputs[key], "fold_mu"),
        );
        numbers.push(if key == "clamped" {
            fold.printed(1.78, "Gomez, Moulton & Vella 2017")
        } else {
            fold
        });
        numbers.push(Number::new(
            "B9",
            "P",
            limit(count - 1, 1),
            number(&outputs[key], "fold_P"),
        ));
        if count == 2 {
            let pitchfork = &outputs["symmetric_pitchfork"];
            numbers.push(Number::new(
                "B9",
                "pitchfork before it, mu",
                limit(0, 0),
                number(pitchfork, "mu"),
            ));
            numbers.push(Number::new("B9", "P", limit(0, 1), number(pitchfork, "P")));
        }
    }
    Ok(numbers)
}

/// B10: a clamp turned to the fold.
pub fn turned_clamps(data: &Value) -> Result<Vec<Number>> {
    let mut numbers = Vec::new();
    for row in rows(&data["B10"]["outputs"]) {
        let name = row["far_end"].as_str().expect("a name");
        let far = if name == "hinged" {
            Far::Hinged
        } else {
            Far::Clamped
        };
        let s = number(row, "s");
        let found = turning(s, far, 1)?;
        let [(fold, _)] = &found[..] else {
            panic!("no fold: {row}")
        };
        assert_eq!(fold.kind, SpecialKind::Fold);
        numbers.push(Number::new(
            "B10",
            format!("far end {name}, s = {s}: fold at a, rad"),
            fold.point.p,
            number(row, "a"),
        ));
    }
    Ok(numbers)
}

/// B11: the clamp of a loaded column is turned until it snaps back.
pub fn catapults(data: &Value) -> Result<Vec<Number>> {
    let mut numbers = Vec::new();
    for row in rows(&data["B11"]["outputs"]) {
        let ratio = number(row, "P_over_Pcr");
        let load = EndConditions::load(-ratio * 0.25 * PI * PI * Vector3::z(), Vector3::zeros());
        let problem = |phi: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * phi);
            Problem::new(
                planar_rod(1.0)?.with_clamp(Vector3::zeros(), turn),
                load,
                1e-12,
            )
        };
        let buckled = problem(0.0)?.solve(None)?;
        // The clamp turns away from the side to which the rod leans.
        let side = -buckled.end.position.x.signum();
        let problem = |phi: f64| problem(side * phi);
        let found = specials(problem, buckled.base, (0.0, PI), 1)?;
        let [(fold, at)] = &found[..] else {
            panic!("no fold: {row}")
        };
        assert_eq!(fold.kind, SpecialKind::Fold);
        numbers.extend([
            Number::new(
                "B11",
                format!("P/Pcr = {ratio}: snap-back at, deg"),
                fold.point.p.to_degrees(),
                number(row, "phi_deg"),
            ),
            Number::new(
                "B11",
                "end slope there, deg",
                tilt(&at.end).to_degrees(),
                number(row, "tip_deg"),
            ),
        ]);
    }
    Ok(numbers)
}

/// B13: a straight rod wound up between clamps, and a ring.
pub fn twisted_rods(data: &Value) -> Result<Vec<Number>> {
    let torsion = 0.7;
    let mut numbers = Vec::new();
    for row in rows(&data["greenhill"]["rows"]) {
        let tension = number(row, "tension");
        let problem = |couple: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (couple / torsion));
            let end = EndConditions {
                position: [Some(0.0), Some(0.0), None],
                force: tension * Vector3::z(),
                ..EndConditions::pose(Vector3::zeros(), turn)
            };
            Problem::new(
                Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion)?)?,
                end,
                1e-12,
            )
        };
        let guess = Vector6::new(0.0, 0.0, 0.5, 0.0, 0.0, tension);
        let found = specials(problem, guess, (0.5, 13.0), 1)?;
        let [(first, _)] = &found[..] else {
            panic!("no instability: {row}")
        };
        assert_eq!(first.index, (Some(0), Some(2)));
        numbers.push(Number::new(
            "B13",
            format!("end tension {tension}: couple"),
            first.point.p,
            number(row, "critical_couple"),
        ));
    }
    numbers.push(Number::new(
        "B13",
        "ring: twisting couple",
        michells_couple(torsion)?,
        2.0 * PI * 3.0_f64.sqrt(),
    ));
    Ok(numbers)
}

/// The couple at which a twisted ring, cut and clamped, becomes unstable: by bisection on the index.
fn michells_couple(torsion: f64) -> Result<f64> {
    // The plane of the ring may turn about the clamp's d3, a neutral mode counted as one or none: only the jump of the
    // index matters.
    let index = |couple: f64| {
        let base = Vector6::new(0.0, 2.0 * PI, couple, 0.0, 2.0 * PI * couple, 0.0);
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion)?)?;
        let end = rod.end(&base, 1e-12)?.section;
        assert!(end.position.norm() < 1e-11, "the ring does not close");
        let directors = UnitQuaternion::from_matrix(&end.directors);
        Problem::new(rod, EndConditions::pose(end.position, directors), 1e-12)?.index_at(&base)
    };
    let (mut low, mut high) = (9.0, 12.0);
    assert!(index(high)? >= 2 && index(low)? < 2, "no jump by two");
    while high - low > 1e-11 {
        let middle = 0.5 * (low + high);
        if index(middle)? < 2 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}
