//! Rods in space against independent references (tools/rod_reference.py).

use crate::support::{base_wrench, json, list, number, quaternion, rod, rows, tapers, vector3};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::rod::{EndConditions, Problem, Rod};
use snaprod::section::{Along, Linear, Varying};
use std::f64::consts::{LN_2, PI};

/// Catches any slip in frame, balance, inverse law, energy or tangent: 80-bit Taylor series are an independent method.
#[test]
fn initial_value_problems_agree_with_taylor_series() {
    let data = json("rod_ivp.json");
    let rows = rows(&data, "rows", 22);
    assert_eq!(rows.iter().filter(|row| tapers(row)).count(), 3);
    for row in rows {
        let rod = rod(row);
        let end = rod.end(&base_wrench(row), 1e-13).expect("an end");
        let name = &row["name"];
        let position = vector3(row, "position");
        let rotation = Matrix3::from_row_slice(&list(&row["rotation"]));
        let tangent = Matrix6::from_row_slice(&list(&row["tangent"]));
        let section = &end.section;
        let gaps = [
            (section.position - position).norm() / rod.length(),
            (section.directors - rotation).norm(),
            (section.directors.transpose() * section.directors - Matrix3::identity()).norm() * 1e3,
            (section.couple - vector3(row, "tip_couple")).norm()
                / (1.0 + vector3(row, "tip_couple").norm()),
            (section.energy - number(row, "energy")).abs() / (1.0 + number(row, "energy")),
            (end.tangent - tangent).norm() / tangent.norm(),
        ];
        for gap in gaps {
            assert!(gap < 2e-11, "{name}: {gaps:?}");
        }
    }
}

/// Catches a break that is stepped over: a rod whose stiffness jumps is two uniform rods, the second clamped to the
/// end of the first, to rounding and without small steps at the jump.
#[test]
fn a_rod_with_a_jump_is_two_rods() {
    let jump = |a: f64, b: f64| Along::table(&[(0.0, a), (0.4, a), (0.4, b), (1.0, b)]);
    let law = Varying::diagonal(
        [jump(1.0, 0.3).unwrap(), jump(1.4, 0.5).unwrap()],
        jump(0.8, 0.2).unwrap(),
    );
    let whole = Rod::new(1.0, law.unwrap()).expect("a rod");
    // General varying laws, with the same integrator as the law with the jump.
    let part = |length: f64, [a, b, c]: [f64; 3]| {
        let law = move |_: f64| Linear::diagonal([a, b], c);
        Rod::new(length, Varying::by(law)).expect("a rod")
    };
    let (first, second) = (part(0.4, [1.0, 1.4, 0.8]), part(0.6, [0.3, 0.5, 0.2]));
    for base in [
        Vector6::new(1.0, -0.5, 0.7, 2.0, 1.0, -1.5),
        Vector6::new(-0.3, 0.8, 0.2, -3.0, 0.5, 4.0),
    ] {
        let end = whole.end(&base, 1e-12).expect("an end");
        let middle = first.end(&base, 1e-12).expect("an end");
        let at = &middle.section;
        let (m, n) = (at.couple, at.force);
        let turn = UnitQuaternion::from_matrix(&at.directors);
        let last = second
            .clone()
            .with_clamp(at.position, turn)
            .end(&Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z), 1e-12)
            .expect("an end");
        let gap = (end.section.position - last.section.position).norm()
            + (end.section.directors - last.section.directors).norm()
            + (end.section.energy - at.energy - last.section.energy).abs();
        assert!(gap < 1e-11, "{gap:e}");
        assert!(
            end.steps <= middle.steps + last.steps + 3,
            "{} steps, not {} + {}",
            end.steps,
            middle.steps,
            last.steps
        );
    }
}

/// Catches a method of lower order, and an ineffective error control: on uniform rods the error of pose and tangent
/// falls like the sixteenth power of the number of steps.
#[test]
fn the_error_falls_with_high_order() {
    let data = json("rod_ivp.json");
    let mut slopes = Vec::new();
    for row in rows(&data, "rows", 22).iter().filter(|row| !tapers(row)) {
        let (rod, base) = (rod(row), base_wrench(row));
        let position = Vector3::from_row_slice(&list(&row["position"]));
        let rotation = Matrix3::from_row_slice(&list(&row["rotation"]));
        let tangent = Matrix6::from_row_slice(&list(&row["tangent"]));
        let mut points = Vec::new();
        for digits in 4..=11 {
            let tolerance = 10.0_f64.powi(-digits);
            let end = rod.end(&base, tolerance).expect("an end");
            let error = ((end.section.position - position).norm() / rod.length())
                .max((end.section.directors - rotation).norm())
                .max((end.tangent - tangent).norm() / tangent.norm());
            assert!(
                error < 20.0 * tolerance,
                "{}: {error:e} at {tolerance:e}",
                row["name"]
            );
            // Steps are limited by the length of the rod, at every tolerance.
            if error > 1e-13 && end.steps > 1 {
                points.push(((end.steps as f64).ln(), error.ln()));
            }
        }
        // Too few steps to judge, as for an unloaded rod.
        let grown = |(first, last): (&(f64, f64), &(f64, f64))| last.0 - first.0 > LN_2 - 1e-9;
        if !points.first().zip(points.last()).is_some_and(grown) {
            continue;
        }
        let count = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / count;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
        slopes.push(-slope);
    }
    slopes.sort_by(f64::total_cmp);
    assert!(slopes.len() >= 5, "only {} rods", slopes.len());
    let median = slopes[slopes.len() / 2];
    assert!(slopes[0] > 10.0, "{slopes:?}");
    assert!((12.0..20.0).contains(&median), "{slopes:?}");
}

/// Catches a wrong balance at the end, a load in the wrong frame, a path that ends elsewhere.
#[test]
fn end_loads_agree_with_an_independent_solver() {
    let data = json("rod_loads.json");
    for row in rows(&data, "rows", 16) {
        let rod = rod(row);
        let load = &row["end"];
        let (f, m) = (vector3(load, "force"), vector3(load, "couple"));
        let end = if load["follower"] == true {
            EndConditions::follower(f, m)
        } else {
            EndConditions::load(f, m)
        };
        let problem = Problem::new(rod, end, 1e-12).expect("a problem");
        let found = problem
            .solve(None)
            .unwrap_or_else(|e| panic!("{}: {e}", row["name"]));
        let base = base_wrench(row);
        let q = UnitQuaternion::from_matrix(&found.end.directors);
        let gaps = [
            (found.end.position - vector3(row, "position")).norm(),
            q.angle_to(&quaternion(row, "quaternion")),
            (found.base - base).norm() / (1.0 + base.norm()),
            (found.end.couple - vector3(row, "tip_couple")).norm() / (1.0 + base.norm()),
            found.end.energy - number(row, "energy"),
        ];
        assert!(
            gaps.iter().all(|g| g.abs() < 1e-8),
            "{}: {gaps:?}",
            row["name"]
        );
    }
}

fn end_condition(row: &Value) -> EndConditions {
    match row["kind"].as_str().expect("a kind") {
        "pose" => EndConditions::pose(vector3(row, "position"), quaternion(row, "quaternion")),
        "ball" => EndConditions::ball(vector3(row, "position")),
        "free" => EndConditions::load(vector3(row, "base_force"), Vector3::zeros()),
        other => panic!("{other}"),
    }
}

/// Catches a wrong equation of a held end: the stored wrench solves it, and the solver finds some equilibrium there.
#[test]
fn held_ends_are_solved() {
    let data = json("rod_held.json");
    for row in rows(&data, "rows", 17) {
        let rod = rod(row);
        let problem = Problem::new(rod, end_condition(row), 1e-12).expect("a problem");
        let base = base_wrench(row);
        let near = problem
            .solve(Some(&(base * 1.001)))
            .expect("the equilibrium nearby");
        assert!(
            (near.base - base).norm() < 1e-8 * (1.0 + base.norm()),
            "{}",
            row["name"]
        );
        let found = problem
            .solve(None)
            .unwrap_or_else(|e| panic!("{}: {e}", row["name"]));
        assert!(found.residual < 1e-9, "{}: {}", row["name"], found.residual);
        assert_eq!(found.index, 0, "{}", row["name"]);
    }
}

/// Catches a conjugate point that is missed or counted twice, or a wrong correction for the end condition: the
/// reference counts negative eigenvalues of a discretised second variation.
#[test]
fn indices_agree_with_discretised_second_variations() {
    let data = json("rod_index.json");
    let (mut tested, mut wrong) = (0, Vec::new());
    for row in rows(&data, "rows", 20) {
        let rod = rod(row);
        let base = base_wrench(row);
        let end = rod.end(&base, 1e-12).expect("an end").section;
        let condition = match row["end"].as_str().expect("an end") {
            "pose" => {
                EndConditions::pose(end.position, UnitQuaternion::from_matrix(&end.directors))
            }
            "ball" => EndConditions::ball(end.position),
            "free" => EndConditions::load(end.force, end.couple),
            other => panic!("{other}"),
        };
        // A straight inextensible rod held at its full length is refused.
        let Ok(problem) = Problem::new(rod, condition, 1e-12) else {
            assert!(end.position.norm() > 1.0 - 1e-12, "{}", row["name"]);
            continue;
        };
        let index = problem.index_at(&base).expect("an index");
        if Some(index as u64) != row["index"].as_u64() {
            wrong.push(format!(
                "{} {}: {index}, not {} (nearest {})",
                row["name"], row["end"], row["index"], row["nearest_eigenvalue"]
            ));
        }
        tested += 1;
    }
    assert!(wrong.is_empty(), "of {tested}: {wrong:#?}");
    assert!(tested >= 20, "only {tested}");
}

/// Catches an index without the lever of an off-end force. A column with its load on a stiff mast of height h (below
/// the end for h < 0) buckles at lambda tan lambda = 1/h, lambda^2 the load. Under an excessive load, or one that
/// pulls sideways on an arm, exactly one of the shapes found is stable and balances it.
#[test]
fn a_load_on_a_mast_buckles_the_column_early() {
    let rod = Rod::new(1.0, Linear::diagonal([1.0, 2.0], 0.8).unwrap()).expect("a rod");
    let problem = |load: Vector3<f64>, arm: Vector3<f64>| {
        let end = EndConditions::weight(load, arm, Vector3::zeros());
        Problem::new(rod.clone(), end, 1e-12).expect("a problem")
    };
    let critical = |h: f64, b: f64| {
        let (mut low, mut high) = if h > 0.0 {
            (0.0, 0.5 * PI)
        } else {
            (0.5 * PI, PI)
        };
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let before = middle.sin() * h * middle < middle.cos();
            *(if before { &mut low } else { &mut high }) = middle;
        }
        b * low * low
    };
    for h in [0.5, 0.05, -0.3, -1.0] {
        let arm = Vector3::z() * h;
        let (first, second) = (critical(h, 1.0), critical(h, 2.0));
        for (load, index) in [
            (0.3 * first, 0),
            (0.999 * first, 0),
            (1.001 * first, 1),
            (0.999 * second, 1),
            (1.001 * second, 2),
            (-1.0, 0),
        ] {
            let problem = problem(Vector3::z() * -load, arm);
            let base = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -load);
            assert_eq!(
                problem.index_at(&base).unwrap(),
                index,
                "h = {h}, load {load}"
            );
        }
    }
    for (load, arm) in [
        (Vector3::new(0.0, 0.0, -3.0), Vector3::new(0.0, 0.0, 0.5)),
        (Vector3::new(0.1, -0.4, -2.0), Vector3::new(0.2, 0.1, 0.3)),
        (Vector3::new(3.0, 2.0, 1.0), Vector3::new(-0.5, 0.4, 0.0)),
        (Vector3::new(0.0, 6.0, 0.0), Vector3::new(0.0, 0.0, 1.0)),
    ] {
        let found = problem(load, arm).solve(None).expect("an equilibrium");
        assert_eq!(found.index, 0, "{load}");
        let couple = (found.end.directors * arm).cross(&load);
        let off = (found.end.couple - couple).norm() + (found.end.force - load).norm();
        assert!(off < 1e-10, "{load}: {off:e}");
    }
    let arm = Vector3::x();
    for end in [
        EndConditions {
            arm,
            ..EndConditions::ball(Vector3::z() * 0.5)
        },
        EndConditions {
            arm,
            ..EndConditions::follower(Vector3::x(), Vector3::zeros())
        },
    ] {
        assert!(
            Problem::new(rod.clone(), end, 1e-10)
                .unwrap_err()
                .is_domain()
        );
    }
}

/// Catches starts of the search that are not mirrored with the problem: images by d1, d2 and both had another stable
/// state, of the energies 21.31 and 8.46. Laws, targets, couples and turns are mirrored; energy and the cost of the
/// search are the same.
#[test]
fn mirror_images_have_mirror_images_as_equilibria() {
    let (k, twist) = ([1.5156, -0.2055], 1.4127);
    let (place, turn) = ([-0.0652, 0.0483, 0.7658], [0.8664, -0.4482, 0.1932, 0.1053]);
    let (couple, force) = ([0.4, -0.3, 0.2], [-1.0, 0.6, -2.5]);
    let solved = |one: f64, other: f64, held: bool| {
        // Polar vectors along d1 and d2, and axial vectors.
        let polar = |v: [f64; 3]| Vector3::new(one * v[0], other * v[1], v[2]);
        let axial = |v: [f64; 3]| Vector3::new(other * v[0], one * v[1], one * other * v[2]);
        let rest = axial([k[0], k[1], twist]);
        let law = Linear::diagonal([1.0, 1.8467], 1.3374)
            .and_then(|law| law.with_rest([rest.x, rest.y], rest.z))
            .expect("a law");
        let rod = Rod::new(1.0, law).expect("a rod");
        let about = axial([turn[1], turn[2], turn[3]]);
        let turned = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            turn[0], about.x, about.y, about.z,
        ));
        let end = if held {
            EndConditions::pose(polar(place), turned)
        } else {
            EndConditions::load(polar(force), axial(couple))
        };
        let problem = Problem::new(rod, end, 1e-10).expect("a problem");
        problem.solve(None).expect("an equilibrium")
    };
    for held in [true, false] {
        let one = solved(1.0, 1.0, held);
        for (x, y) in [(1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let other = solved(x, y, held);
            let energies = [one.end.energy, other.end.energy];
            assert!(
                (energies[0] - energies[1]).abs() < 1e-8 * (1.0 + energies[0]),
                "{x} {y}: {energies:?}"
            );
            assert_eq!(one.index, other.index);
            let cost = [&one, &other].map(|found| found.route.evaluations as f64);
            assert!((cost[0] - cost[1]).abs() < 0.1 * cost[0], "{cost:?}");
        }
    }
}
