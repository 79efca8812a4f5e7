//! Scenes of rods under their own weight at rest.

use crate::support::{assert_close, json, number, rows};
use snaprod::scene::Scene;
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{Silent, branch, equilibrium};

fn parse(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Catches a bundled scene that contradicts its description: Greenhill's load, and the given buckled columns.
#[test]
fn the_heavy_column_buckles_at_greenhills_load() {
    let path = format!("{}/scenes/heavy_column.toml", env!("CARGO_MANIFEST_DIR"));
    let scene =
        Scene::read(std::path::Path::new(&path)).unwrap_or_else(|faults| panic!("{faults}"));
    let record = branch(&scene, &mut Silent).expect("a branch");
    let [greenhill] = &record.branches.specials[..] else {
        panic!("{:?}", record.branches.specials);
    };
    assert_eq!(greenhill.kind, SpecialKind::BranchPoint);
    assert_eq!(greenhill.index, [Some(0), Some(1)]);
    assert_close(greenhill.parameter, 7.83734743894348, 1e-8, 1.0, "load");
    assert!((greenhill.parameter - 7.83734743894348).abs() <= greenhill.precision);
    let points = &record.branches.points;
    let [loads, x, z] = ["parameter", "x", "z"].map(|name| points.reals(name));
    let [m, energy] = ["base_my", "energy"].map(|name| points.reals(name));
    let given = json("mass/selfweight_given.json");
    for row in rows(&given, "column_post_buckled", 3) {
        let q = number(row, "q");
        let buckled = (0..points.rows()).filter(|k| loads[*k] == q && x[*k].abs() > 1e-3);
        let mut sides = 0.0;
        for k in buckled {
            let side = x[k].signum();
            sides += side.abs();
            let tolerance = 1e-9;
            assert_close(z[k], number(row, "x"), tolerance, 1.0, "height");
            assert_close(side * x[k], number(row, "y"), tolerance, 1.0, "way aside");
            assert_close(
                side * m[k],
                number(row, "curvature_base"),
                tolerance,
                1.0,
                "couple",
            );
            assert_close(energy[k], number(row, "U"), tolerance, 1.0, "energy");
        }
        assert_eq!(sides, 2.0, "both sides at {q}");
    }
}

/// Catches a weight other than mass times gravity, for every form of the mass, or without the distributed force or the
/// factor.
#[test]
fn weights_are_those_of_mass_density_and_force() {
    let wire = r#"
        [rod]
        model = "cosserat"
        length = 0.6
        MASS
        material = { E = 200e9, nu = 0.3, density = 7850.0 }
        section = { circle = { diameter = 0.001 } }
        [clamp]
        rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90 }
        [end]
        [loads]
    "#;
    let area = std::f64::consts::PI * 0.25e-6;
    let density = wire.replace("MASS", "");
    let given = wire.replace("MASS", &format!("mass = {:?}", 7850.0 * area * 0.6));
    let force = 7850.0 * area * 9.81;
    let texts = [
        format!("{density} gravity = [0.0, 0.0, -9.81]"),
        format!("{given} gravity = [0.0, 0.0, -9.81]"),
        format!("{density} distributed = [0.0, 0.0, {:?}]", -force),
        format!(
            "{density} gravity = [0.0, 0.0, -3.0]\ndistributed = [0.0, 0.0, {:?}]\nload = 2.0",
            7850.0 * area * (3.0 - 0.5 * 9.81)
        ),
    ];
    let all: Vec<_> = texts
        .iter()
        .map(|text| equilibrium(&parse(text)).expect("an equilibrium"))
        .collect();
    let first = &all[0];
    for record in &all {
        assert_close(record.found.base[5], -0.6 * force, 1e-9, 0.0, "base force");
        let weight = record.weight.expect("a weight");
        assert_close(weight.z, -0.6 * force, 1e-12, 0.0, "weight");
        let off = (record.found.end.position - first.found.end.position).norm();
        assert!(off < 1e-9, "off by {off:e}");
        assert_eq!(record.summary()["weight"][2].as_f64(), Some(weight.z));
        assert!(record.found.potential < 0.0);
    }
    // Small enough for beam theory: the end sinks by q L^4/(8 E I), less some 0.5 %.
    let flexure = 200e9 * std::f64::consts::PI / 64.0 * 1e-12;
    let beam = force * 0.6_f64.powi(4) / (8.0 * flexure);
    let sunk = -first.found.end.position.z;
    assert!(0.97 * beam < sunk && sunk < beam, "{sunk} of {beam}");
    let bare = equilibrium(&parse(&density.replace("[loads]", ""))).expect("an equilibrium");
    assert_eq!(bare.weight, None);
    assert!(bare.summary().get("potential").is_none());
}
