//! Columns under thrust: B1 to B3.

use super::{Number, number, planar_rod, rows, specials, stable_states, tilt};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::Result;
use snaprod::rod::{EndConditions, Problem};
use snaprod::solve::special_points::SpecialKind;
use std::f64::consts::PI;

/// B1: bifurcation loads of the straight rod.
pub fn euler_loads(data: &Value) -> Result<Vec<Number>> {
    let source = "Timoshenko & Gere 1961";
    let free = EndConditions::load(Vector3::zeros(), Vector3::zeros());
    // The end may slide along z under the load.
    let pinned = EndConditions {
        position: [Some(0.0), Some(0.0), None],
        ..free
    };
    let clamped = EndConditions {
        orientation: Some(UnitQuaternion::identity()),
        ..pinned
    };
    let mut numbers = Vec::new();
    for (key, length, end, printed) in [
        ("clamped_free", 1.0, free, 2.467),
        // A pinned rod is twice a clamped-free one of half the length.
        ("pinned", 0.5, free, 9.8696),
        ("clamped_pinned", 1.0, pinned, 20.19),
        ("clamped_clamped", 1.0, clamped, 39.48),
    ] {
        let computed: Vec<f64> = rows(&data["B1"]["outputs"][key])
            .map(|x| x.as_f64().expect("a load"))
            .collect();
        let problem = |load: f64| {
            let force = -load * Vector3::z();
            Problem::new(planar_rod(length)?, EndConditions { force, ..end }, 1e-12)
        };
        let last = computed[computed.len() - 1];
        let found = specials(problem, Vector6::zeros(), (0.0, 1.1 * last), computed.len())?;
        assert_eq!(found.len(), computed.len(), "{key}");
        for (i, ((special, _), want)) in found.iter().zip(&computed).enumerate() {
            assert_eq!(special.kind, SpecialKind::BranchPoint, "{key}");
            assert_eq!(special.index, (Some(i), Some(i + 1)), "{key}");
            let what = format!("{}, load {}", key.replace('_', "-"), i + 1);
            let row = Number::new("B1", what, special.point.p, *want);
            numbers.push(if i == 0 {
                row.printed(printed, source)
            } else {
                row
            });
        }
    }
    Ok(numbers)
}

/// B2: the cantilever beyond its Euler load, and the pinned elastica with its ends together, as two halves.
pub fn beyond_the_euler_load(data: &Value) -> Result<Vec<Number>> {
    let source = "Timoshenko & Gere 1961";
    let euler = 0.25 * PI * PI;
    let printed = [
        [0.970, 0.220],
        [0.741, 0.593],
        [0.349, 0.792],
        [-0.107, 0.750],
        [-0.577, 0.421],
    ];
    let loads: Vec<f64> = rows(&data["B2"]["outputs"])
        .map(|row| number(row, "load") * euler)
        .collect();
    let pressed = |load: f64| {
        let end = EndConditions::load(-load * Vector3::z(), Vector3::zeros());
        Problem::new(planar_rod(1.0)?, end, 1e-12)
    };
    let states = stable_states(pressed, &loads)?;
    let mut numbers = Vec::new();
    for ((row, [x, y]), found) in rows(&data["B2"]["outputs"]).zip(printed).zip(states) {
        let tip = tilt(&found.end).to_degrees();
        let position = found.end.position;
        let degrees = number(row, "tip_deg");
        numbers.extend([
            Number::new(
                "B2",
                format!("P/Pcr = {:.6}: end slope, deg", number(row, "load")),
                tip,
                degrees,
            ),
            Number::new("B2", "x", position.z, number(row, "x")).printed(x, source),
            Number::new("B2", "y", position.x.abs(), number(row, "y")).printed(y, source),
        ]);
    }
    let meet = EndConditions {
        position: [None, None, Some(0.0)],
        ..EndConditions::load(Vector3::zeros(), Vector3::zeros())
    };
    let found = Problem::new(planar_rod(1.0)?, meet, 1e-12)?
        .solve(Some(&Vector6::new(0.0, 4.3, 0.0, 0.0, 0.0, -5.5)))?;
    numbers.push(Number::new(
        "B2",
        "pinned, ends meet: P/P_E",
        -found.end.force.z / euler,
        number(&data["B2"]["ends_meet"], "load"),
    ));
    numbers.push(Number::new(
        "B2",
        "its modulus k",
        (0.5 * tilt(&found.end)).sin(),
        number(&data["B2"]["ends_meet"], "k"),
    ));
    Ok(numbers)
}

/// B3: clamped ends moved together.
pub fn clamped_columns(data: &Value) -> Result<Vec<Number>> {
    let shortenings: Vec<f64> = rows(&data["B3"]["outputs"])
        .map(|row| number(row, "s"))
        .collect();
    let problem = |s: f64| {
        let end = EndConditions::pose(Vector3::z() * (1.0 - s), UnitQuaternion::identity());
        Problem::new(planar_rod(1.0)?, end, 1e-12)
    };
    let states = stable_states(problem, &shortenings)?;
    let mut numbers = Vec::new();
    for (row, found) in rows(&data["B3"]["outputs"]).zip(states) {
        let s = number(row, "s");
        let middle = &problem(s)?.shape(&found.base, 3)?[1].position;
        numbers.extend([
            Number::new(
                "B3",
                format!("shortening {s}: P"),
                -found.end.force.z,
                number(row, "load"),
            ),
            Number::new(
                "B3",
                "deflection of the middle",
                middle.x.abs(),
                number(row, "deflection"),
            ),
        ]);
    }
    Ok(numbers)
}
