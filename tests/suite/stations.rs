//! Stations on rods: ends, differences of positions in time, resultants that balance the end, references at rest.

use crate::support::{json, list, rows};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::run::{Prepared, samples};
use snaprod::study::{Silent, Table, assembly, branch, equilibrium};

/// Stations at base, inside and end of the rod.
const STATIONS: &str = "[[station]]\nname = 'base'\ns = 0.0\n[[station]]\nname = 'mid'\ns = 0.37\n\
                        [[station]]\nname = 'tip'\ns = 1.0\n";
const ELASTICA: &str = "[rod]\nmodel = 'elastica'\nlength = 1.0\nbending_stiffness = 1.0\n";
const SPACE: &str =
    "[rod]\nmodel = 'cosserat'\nlength = 1.0\nsection = { bending = [1.0, 1.5], torsion = 0.8 }\n";
const HEAVY: &str = "mass = 0.3\ninertia = 'full'\n";
const DAMPED: &str = "damping = { proportional = 0.05 }\n";
const BODY: &str = "[body]\nmass = 1.0\n";
const RIGID: &str = "[body]\nmass = 1.0\ninertia = [0.1, 0.2, 0.1]\n";
const FORCES: &str = "[loads]\ngravity = [-0.4, 0.3, 0.2]\n";
/// Time between the samples of a difference, the allowed error of a velocity, and its growth with the tolerance.
const STEP: f64 = 1e-3;
const VELOCITY: f64 = 2e-6;
const PER_TOLERANCE: f64 = 60.0;

fn run(duration: f64, tolerance: f64) -> String {
    format!("[run]\nduration = {duration}\ntolerance = {tolerance:e}\nsamples = 3\n")
}

/// Samples of a scene at these times.
fn sampled(text: &str, times: &[f64]) -> Table {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}\n{text}"));
    samples(&prepared, times, &mut Silent).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

/// Numbers of some columns in a row.
fn numbers<const N: usize>(table: &Table, prefix: &str, names: [&str; N], row: usize) -> [f64; N] {
    names.map(|name| table.reals(&format!("{prefix}{name}"))[row])
}

fn vector(table: &Table, prefix: &str, names: [&str; 3], row: usize) -> Vector3<f64> {
    numbers(table, prefix, names, row).into()
}

fn turn(table: &Table, prefix: &str, row: usize) -> UnitQuaternion<f64> {
    let [w, x, y, z] = numbers(table, prefix, ["qw", "qx", "qy", "qz"], row);
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}

const PLACE: [&str; 3] = ["x", "y", "z"];
const VELOCITIES: [&str; 3] = ["vx", "vy", "vz"];
const SPINS: [&str; 3] = ["wx", "wy", "wz"];
const FORCE: [&str; 3] = ["n1", "n2", "n3"];
const COUPLE: [&str; 3] = ["m1", "m2", "m3"];

/// Asserts that two vectors agree.
fn assert_near(found: Vector3<f64>, wanted: Vector3<f64>, bound: f64, what: &str) {
    let error = (found - wanted).norm();
    assert!(
        error <= bound,
        "{what}: {found:?} {wanted:?}, off by {error:e}"
    );
}

/// Catches stations in the wrong frame, units or order, velocities that leave out the clamp or the chart, and
/// resultants with the wrong sign. Velocities are held against differences of positions in time, resultants against the
/// force on the body and against the section law.
#[test]
fn stations_of_one_rod_move_with_it() {
    let start = "[start]\nsettled = true\nvelocity = [0.3, 0.4, -0.2]\n";
    let flat = "[start]\nlambda = 2.0\nkappa = 0.6\nvelocity = [0.1, -0.4]\n";
    let curved = "[start]\ncurvature = [0.8]\nvelocity = [0.0, 0.0]\n";
    let settled = "[start]\nsettled = true\n";
    let pushed = "force = [{ direction = [0.3, 1.0], amplitude = 0.5, frequency = 0.7 }]\n";
    let pushed_in_space =
        "force = [{ direction = [0.3, 1.0, 0.2], amplitude = 0.5, frequency = 0.7 }]\n";
    let strained = "[start]\nstrain = { u1 = [0.8], u2 = [0.3] }\n";
    let driven = "[clamp]\nmotion = { translate = { direction = [0.0, 1.0, 0.5], amplitude = 0.05, frequency = 1.5 }, \
                  turn = { axis = [0.6, 0.0, 0.8], amplitude = 0.3, frequency = 1.0 } }\n";
    let plane = "[loads]\ngravity = [-0.4, 0.3]\n";
    // Kind, scene, whether the section law is elastic, whether force and couple are the same all along.
    let scenes = [
        ("sheet", [ELASTICA, BODY, flat, "", ""].concat(), true, true),
        (
            "plane, friction",
            [ELASTICA, DAMPED, BODY, curved, plane].concat(),
            false,
            true,
        ),
        (
            "plane, mass",
            [ELASTICA, HEAVY, BODY, settled, plane, pushed].concat(),
            true,
            false,
        ),
        (
            "space",
            [SPACE, RIGID, driven, start, FORCES].concat(),
            true,
            true,
        ),
        (
            "space, friction",
            [SPACE, DAMPED, RIGID, strained, FORCES].concat(),
            false,
            true,
        ),
        (
            "space, mass",
            [SPACE, HEAVY, RIGID, settled, FORCES, pushed_in_space].concat(),
            true,
            false,
        ),
    ];
    let t = 0.3;
    let times = [t - 2.0 * STEP, t - STEP, t, t + STEP, t + 2.0 * STEP];
    for (kind, scene, elastic, even) in &scenes {
        // Elements follow rods of full mass in space at coarse tolerances alone.
        let tolerances: &[f64] = match *kind {
            "space, mass" => &[1e-6, 1e-4],
            _ => &[1e-9],
        };
        for &tolerance in tolerances {
            let table = sampled(&[scene, STATIONS, &run(0.4, tolerance)].concat(), &times);
            let loose = (tolerance / 1e-7).max(1.0);
            let at = |prefix, names, row| vector(&table, prefix, names, row);
            let flat = table.column("z").is_none();
            let end = if flat { ["x", "y", "x"] } else { PLACE };
            let mut tip = at("", end, 2);
            let mut force = at(
                "",
                if flat {
                    ["fx", "fy", "fx"]
                } else {
                    ["fx", "fy", "fz"]
                },
                2,
            );
            if flat {
                (tip.z, force.z) = (0.0, 0.0);
            }
            assert_near(
                at("tip.", PLACE, 2),
                tip,
                1e-12 * loose,
                &format!("end, {kind}"),
            );
            for station in ["base.", "mid.", "tip."] {
                let what = format!("{station} of {kind} at {tolerance:e}");
                let [a, b] = [1, 2].map(|k| at(station, PLACE, 2 + k) - at(station, PLACE, 2 - k));
                let slope = (a * 8.0 - b) / (12.0 * STEP);
                let bound = VELOCITY.max(PER_TOLERANCE * tolerance);
                assert_near(
                    at(station, VELOCITIES, 2),
                    slope,
                    bound,
                    &format!("velocity, {what}"),
                );
                let [a, b] = [1, 2].map(|k| {
                    let [after, before] = [2 + k, 2 - k].map(|row| turn(&table, station, row));
                    (after * before.inverse()).scaled_axis()
                });
                let slope = (a * 8.0 - b) / (12.0 * STEP);
                assert_near(
                    at(station, SPINS, 2),
                    slope,
                    bound,
                    &format!("spin, {what}"),
                );
                if *even || station == "tip." {
                    let n = turn(&table, station, 2) * at(station, FORCE, 2);
                    // The resultants of rods of full mass are interpolated between their nodes.
                    let bound = if *even { 1e-7 } else { 1e-4 } * loose;
                    assert_near(n, -force, bound, &format!("force, {what}"));
                }
                if *elastic {
                    let u = at(station, ["u1", "u2", "u3"], 2);
                    let stiffness = if flat {
                        Vector3::new(1.0, 0.0, 0.0)
                    } else {
                        Vector3::new(1.0, 1.5, 0.8)
                    };
                    let m = u.component_mul(&stiffness);
                    assert_near(
                        at(station, COUPLE, 2),
                        m,
                        1e-6 * loose,
                        &format!("couple, {what}"),
                    );
                }
            }
        }
    }
}

/// A force on the body in time.
const PUSHED: &str = "force = [{ direction = [0.3, 1.0, 0.2], amplitude = 0.5, frequency = 0.7 }]";

/// An assembly whose first rod begins at a ball joint, and so runs the other way in the library.
fn assembly_of(rod: &str, more: &str) -> String {
    format!(
        "[[rod]]\nname = 'a'\nmodel = 'cosserat'\nlength = 1.0\nsection = {{ bending = [1.0, 1.5], torsion = 0.8 }}\n{rod}\
         from = {{ position = [0.0, 0.0, 0.0], joint = 'ball' }}\nto = {{ body = 'm' }}\n\
         [[rod]]\nname = 'b'\nmodel = 'cosserat'\nlength = 0.8\nsection = {{ bending = [1.0, 1.5], torsion = 0.8 }}\n{rod}\
         from = {{ position = [0.6, 0.0, 0.1] }}\nto = {{ body = 'm' }}\n\
         [[body]]\nname = 'm'\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n{}\n\
         [loads]\ngravity = [0.1, 0.2, -0.3]\n\
         [[station]]\nrod = 'a'\ns = 1.0\nname = 'end'\n[[station]]\nrod = 'b'\ns = 0.5\nname = 'inside'\n\
         [[station]]\nrod = 'a'\ns = 0.25\nname = 'low'\n[[station]]\nrod = 'a'\ns = 0.75\nname = 'high'\n{more}",
        if more.contains("[run]") { PUSHED } else { "" }
    )
}

/// Catches stations of rods that the library runs the other way, stations of the wrong rod, and stations whose order
/// along a rod is not that of the list.
#[test]
fn stations_of_assemblies_move_with_them() {
    let t = 0.2;
    let times = [t - 2.0 * STEP, t - STEP, t, t + STEP, t + 2.0 * STEP];
    for (rod, tolerance) in [("", 1e-9), (HEAVY, 1e-4)] {
        let table = sampled(&assembly_of(rod, &run(0.3, tolerance)), &times);
        let loose = (tolerance / 1e-7).max(1.0);
        let at = |prefix, names, row| vector(&table, prefix, names, row);
        assert_near(
            at("end.", PLACE, 2),
            at("m.", PLACE, 2),
            1e-9 * loose,
            "end of a",
        );
        for station in ["inside.", "low.", "high.", "end."] {
            let [a, b] = [1, 2].map(|k| at(station, PLACE, 2 + k) - at(station, PLACE, 2 - k));
            let slope = (a * 8.0 - b) / (12.0 * STEP);
            let bound = VELOCITY.max(PER_TOLERANCE * tolerance);
            assert_near(at(station, VELOCITIES, 2), slope, bound, station);
            let u = at(station, ["u1", "u2", "u3"], 2);
            let m = u.component_mul(&Vector3::new(1.0, 1.5, 0.8));
            assert_near(at(station, COUPLE, 2), m, 1e-6 * loose, station);
        }
        if rod.is_empty() {
            // The force is the same all along a light rod.
            let n = |station| turn(&table, station, 2) * at(station, FORCE, 2);
            assert_near(n("low."), n("high."), 1e-8, "force along a");
        }
    }
}

/// Catches stations at rest that are not at their places: the middles of heavy rods as in tests/data/rods.
#[test]
fn stations_at_rest_are_as_given() {
    let data = json("rod_heavy.json");
    for case in rows(&data, "cases", 10)
        .iter()
        .filter(|case| case["held"].is_null())
        .take(2)
    {
        let angle =
            std::f64::consts::FRAC_PI_2 - list(&case["angles"]).first().copied().unwrap_or(0.0);
        let text = format!(
            "[rod]\nmodel = 'cosserat'\nlength = 1.0\nmass = {:?}\nsection = {{ bending = [1.0, 1.0], torsion = 1.0 }}\n\
             [clamp]\nrotation = {{ axis = [0, 1, 0], angle = {angle:?} }}\n[end]\n[loads]\ngravity = [0, 0, -1]\n\
             [[station]]\ns = 0.5\n",
            case["weight"].as_f64().unwrap()
        );
        let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
        let found = equilibrium(&scene).unwrap();
        let (name, values) = &found.stations[0];
        assert_eq!(name, "station1");
        let place = values.as_ref().expect("a section").pose.translation.vector;
        let middle = list(&case["middle"]);
        // The hose hangs to either side.
        assert!(
            (place.xy().norm() - middle[0].abs()).abs() < 1e-9,
            "{place:?} {middle:?}"
        );
        assert!((place.z - middle[1]).abs() < 1e-9, "{place:?} {middle:?}");
        assert!(found.summary()["stations"]["station1"]["couple"][1].is_number());
    }
}

/// Catches stations that differ between the two ways to write a rod, and branches without their columns.
#[test]
fn stations_of_an_assembly_at_rest_and_on_a_branch() {
    let scene = Scene::parse(&assembly_of("", "")).unwrap_or_else(|faults| panic!("{faults}"));
    let found = assembly::equilibrium(&scene).unwrap();
    let stations: Vec<_> = found
        .stations
        .iter()
        .map(|(_, values)| values.as_ref().unwrap())
        .collect();
    let [end, inside, low, high] = stations.as_slice() else {
        panic!("four stations");
    };
    let body = found.bodies[0].1;
    assert_near(
        end.pose.translation.vector,
        body.translation.vector,
        1e-9,
        "end",
    );
    assert!(end.pose.rotation.angle_to(&body.rotation) < 1e-8);
    for at in [inside, low, high, end] {
        let [u, m]: [Vector3<f64>; 2] =
            [&at.strain, &at.resultants].map(|x| x.fixed_rows::<3>(0).into());
        assert_near(
            m,
            u.component_mul(&Vector3::new(1.0, 1.5, 0.8)),
            1e-8,
            "couple",
        );
    }
    let force = |at: &snaprod::study::StationValues| {
        at.pose.rotation * Vector3::from(at.resultants.fixed_rows::<3>(3))
    };
    assert_near(force(low), force(end), 1e-9, "force");
    for (at, (_, base)) in [low, inside].into_iter().zip(&found.rods) {
        let base = Vector3::from(base.fixed_rows::<3>(3));
        assert_near(force(at), base, 1e-9, "force at the base");
    }
    let text = "[rod]\nmodel = 'cosserat'\nlength = 1.0\nsection = { bending = [1.0, 2.0], torsion = 1.0 }\n\
                [end]\nforce = [0.0, -1.0, 0.5]\n[continue]\nparameter = 'end.force.x'\nto = 1.0\n\
                [[station]]\ns = 1.0\nname = 'tip'\n[[station]]\ns = 0.4\n";
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let points = branch(&scene, &mut Silent).unwrap().branches.points;
    for name in ["x", "y", "z", "qw"] {
        let [end, tip] = [points.reals(name), points.reals(&format!("tip.{name}"))];
        assert!(
            end.iter().zip(tip).all(|(a, b)| (a - b).abs() < 1e-12),
            "{name}"
        );
    }
    let inner = points.reals("station2.z");
    assert!(inner.iter().all(|z| *z > 0.0 && *z <= 0.4), "{inner:?}");
}

/// Catches stations off the rod, stations of one name, and stations on unknown rods.
#[test]
fn stations_are_refused_in_words() {
    let refused = |text: &str| {
        let faults = Scene::parse(text).unwrap_err();
        let [fault] = faults.as_slice() else {
            panic!("{faults}\n{text}");
        };
        (fault.field.clone(), fault.kind)
    };
    let one = |more: &str| refused(&[SPACE, "[end]\n", more].concat());
    let many = |more: &str| refused(&assembly_of("", more));
    let beyond = one("[[station]]\ns = 1.2\n");
    assert_eq!(beyond, ("station[0].s".to_owned(), FaultKind::Value));
    let missing = one("[[station]]\nname = 'a'\n");
    assert_eq!(missing, ("station[0].s".to_owned(), FaultKind::Missing));
    let twice = one("[[station]]\nname = 'a'\ns = 0.1\n[[station]]\nname = 'a'\ns = 0.2\n");
    assert_eq!(twice, ("station".to_owned(), FaultKind::Value));
    let body = many("[[station]]\nrod = 'a'\ns = 0.1\nname = 'm'\n");
    assert_eq!(body, ("station[4].name".to_owned(), FaultKind::Conflict));
    let other = many("[[station]]\nrod = 'c'\ns = 0.1\n");
    assert_eq!(other, ("station[4].rod".to_owned(), FaultKind::Value));
}
