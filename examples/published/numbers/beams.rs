//! Loaded beams: B4 to B7.

use super::{Number, loaded, number, planar_rod, rows, solve, tilt};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde_json::Value;
use snaprod::Result;
use snaprod::rod::{EndConditions, Rod};
use snaprod::section::Linear;
use std::f64::consts::PI;

/// B4: cantilevers under a transverse load, and under a couple that bends one into a closed circle.
pub fn cantilevers(data: &Value) -> Result<Vec<Number>> {
    let source = "Mattiasson 1981";
    let printed = [
        [0.06636, 0.00265, 0.09964],
        [0.30172, 0.05643, 0.46135],
        [0.60325, 0.25442, 0.98602],
        [0.81061, 0.55500, 1.43029],
    ];
    let mut numbers = Vec::new();
    for (row, [w, u, angle]) in rows(&data["B4"]["outputs"]).zip(printed) {
        let load = number(row, "P");
        let found = loaded(planar_rod(1.0)?, load * Vector3::x())?;
        let position = found.end.position;
        numbers.extend([
            Number::new("B4", format!("P = {load}: w"), position.x, number(row, "w"))
                .printed(w, source),
            Number::new("B4", "u", 1.0 - position.z, number(row, "u")).printed(u, source),
            Number::new("B4", "end angle", tilt(&found.end), number(row, "angle"))
                .printed(angle, source),
        ]);
    }
    let circle = EndConditions::load(Vector3::zeros(), 2.0 * PI * Vector3::y());
    let gap = solve(planar_rod(1.0)?, circle)?.end.position.norm();
    numbers.push(Number::new("B4", "M = 2 pi: gap of the circle", gap, 0.0));
    Ok(numbers)
}

/// B5: shear and stretch.
pub fn shearable_cantilever(data: &Value) -> Result<Vec<Number>> {
    let source = "Nachbagauer 2011 in Exudyn, 1024 elements";
    let input = |key: &str| number(&data["B5"]["inputs"], key);
    let output = |key: &str| number(&data["B5"]["outputs"], key);
    let law = Linear::diagonal([input("EI"); 2], input("EI"))?
        .with_shear([input("GA"); 2])?
        .with_axial(input("EA"))?;
    let found = loaded(Rod::new(input("L"), law)?, input("F") * Vector3::x())?;
    let position = found.end.position;
    Ok(vec![
        Number::new("B5", "u_x", input("L") - position.z, output("ux")).printed(0.15097102, source),
        Number::new("B5", "u_y", position.x, output("uy")).printed(0.71056836, source),
    ])
}

/// B6: bending about both axes with torsion.
pub fn princeton_beam(data: &Value) -> Result<Vec<Number>> {
    let input = |key: &str| number(&data["B6"]["inputs"], key);
    let law = Linear::diagonal([input("weak"), input("strong")], input("GJ"))?
        .with_shear([input("GA"); 2])?
        .with_axial(input("EA"))?;
    let mut numbers = Vec::new();
    for row in rows(&data["B6"]["outputs"]) {
        let (load, degrees) = (number(row, "P"), number(row, "beta_deg"));
        // Bending about the weak axis alone: no rounding of cos 90 degrees.
        let across = if degrees == 90.0 {
            0.0
        } else {
            degrees.to_radians().cos()
        };
        let force = load * Vector3::new(across, degrees.to_radians().sin(), 0.0);
        let found = loaded(Rod::new(input("L"), law)?, force)?;
        let position = found.end.position;
        let mut pair = [
            Number::new(
                "B6",
                format!("{load} N at {degrees} deg: -u_y"),
                position.x,
                number(row, "minus_uy"),
            ),
            Number::new("B6", "u_z", position.y, number(row, "uz")),
        ];
        if (load, degrees) == (8.896, 45.0) {
            let [u_y, u_z] = pair;
            pair = [
                u_y.printed(0.00883723, "ANSYS"),
                u_z.printed(0.10898794, "ANSYS"),
            ];
        }
        numbers.extend(pair);
    }
    Ok(numbers)
}

/// B7: an arc of 45 degrees bent out of its plane.
pub fn bend(data: &Value) -> Result<Vec<Number>> {
    let ei = 1e7 / 12.0;
    // d3 along the world's x, d1 along y, d2 along z.
    let directors = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let clamp = UnitQuaternion::from_matrix(&directors);
    let mut numbers = Vec::new();
    for row in rows(&data["B7"]["outputs"]) {
        let name = row["law"].as_str().expect("a law");
        let torsion = if name.contains("8.3333e5") {
            8.3333e5
        } else {
            ei
        };
        let mut law = Linear::diagonal([ei, ei], torsion)?.with_rest([0.0, 0.01], 0.0)?;
        if !name.contains("unshearable") {
            law = law.with_shear([5e6; 2])?.with_axial(1e7)?;
        }
        let rod = Rod::new(25.0 * PI, law)?.with_clamp(Vector3::zeros(), clamp);
        let load = number(row, "F");
        let found = loaded(rod, load * Vector3::z())?;
        let printed = match (name, load) {
            ("GJ = 8.3333e5", 300.0) => Some([58.84, 22.33, 40.08]),
            ("GJ = 8.3333e5", 600.0) => Some([47.23, 15.79, 53.37]),
            ("GJ = 1e7/12", 600.0) => Some([47.2, 15.9, 53.4]),
            _ => None,
        };
        let source = if torsion == ei {
            "Bathe & Bolourchi 1979"
        } else {
            "Simo & Vu-Quoc 1986, 8 elements"
        };
        for (i, want) in rows(&row["tip"]).enumerate() {
            let what = match i {
                0 => format!("F = {load}, {name}: x"),
                1 => "y".into(),
                _ => "z".into(),
            };
            let want = want.as_f64().expect("a place");
            let row = Number::new("B7", what, found.end.position[i], want);
            numbers.push(match printed {
                Some(tip) => row.printed(tip[i], source),
                None => row,
            });
        }
    }
    Ok(numbers)
}
