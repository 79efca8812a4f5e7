//! Rods under their own weight, or another load along them, at rest (tests/data/mass/selfweight_given.json).

use crate::support::{assert_close, json, list, number, rows, worst};
use nalgebra::{DVector, Rotation3, UnitQuaternion, Vector3, Vector6};
use snaprod::rod::{
    Chart, DistributedLoad, EndConditions, Equilibrium, Path, Problem, ProblemChart, Rod,
    RodFamily, Spatial, Statical,
};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options, Role};
use snaprod::solve::branch_switching::switch;
use snaprod::solve::special_points::SpecialKind;

const GREENHILL: f64 = 7.83734743894348;

/// A straight rod of length and in-plane stiffness 1 along +x, d1 along z: it bends in the plane (x, y) about d1.
fn laid(out_of_plane: f64) -> Rod {
    let law = Linear::diagonal([1.0, out_of_plane], 0.8).expect("a law");
    let rod = Rod::new(1.0, law).expect("a rod");
    rod.with_clamp(Vector3::zeros(), crate::support::laid())
}

fn along(load: Vector3<f64>) -> DistributedLoad {
    DistributedLoad::constant(load).expect("a load")
}

fn free(force: Vector3<f64>) -> EndConditions {
    EndConditions::load(force, Vector3::zeros())
}

fn problem(rod: Rod, end: EndConditions, load: &DistributedLoad) -> Problem {
    let problem = Problem::new(rod, end, 1e-13).expect("a problem");
    problem.with_distributed(load)
}

/// Tangent's angle at the end in the plane (x, y).
fn angle(found: &Equilibrium) -> f64 {
    let along = found.end.directors.column(2);
    along.y.atan2(along.x)
}

/// Compares a planar row with an equilibrium, or with its mirror image.
fn compare(found: &Equilibrium, row: &serde_json::Value, side: f64, what: &str) {
    let of = |key: &str| number(row, key);
    let at = found.end.position;
    for (got, want, name) in [
        (side * angle(found), of("theta_tip"), "theta"),
        (at.x, of("x"), "x"),
        (side * at.y, of("y"), "y"),
        (side * found.base[2], of("curvature_base"), "curvature"),
        (found.end.energy, of("U"), "energy"),
    ] {
        assert_close(got, want, 1e-10, 1.0, &format!("{what}: {name}"));
    }
    assert_eq!(found.index, 0, "{what}: index");
}

/// Catches any error in the balance laws, in the continuation of the load from zero, or in the choice of a chart, for
/// every path.
#[test]
fn heavy_cantilevers_hang_as_given() {
    let data = json("mass/selfweight_given.json");
    for row in rows(&data, "horizontal", 4) {
        let q = number(row, "q");
        for path in [Path::Auto, Path::Planar, Path::Spatial] {
            let load = along(-q * Vector3::y());
            let problem = problem(laid(3.0), free(Vector3::zeros()), &load).with_path(path);
            let found = problem.solve(None).expect("an equilibrium");
            compare(&found, row, 1.0, &format!("q = {q}, {path:?}"));
            let held = Vector3::new(
                list(&row["clamp_force"])[0],
                list(&row["clamp_force"])[1],
                0.0,
            );
            let base = found.base.fixed_rows::<3>(3).into_owned();
            assert!(
                (base + held).norm() < 1e-10 * (1.0 + q),
                "clamp force {base}"
            );
        }
    }
    for row in rows(&data, "mixed", 1) {
        let (direction, tip) = (list(&row["direction"]), list(&row["tip_force"]));
        let plane = |v: &[f64]| Vector3::new(v[0], v[1], 0.0);
        let load = along(number(row, "q") * plane(&direction));
        let found = problem(laid(3.0), free(plane(&tip)), &load).solve(None);
        compare(&found.expect("an equilibrium"), row, 1.0, "mixed");
    }
}

/// Catches a solver that stays on the straight column beyond its buckling load, or misses the buckled one at great
/// loads.
#[test]
fn heavy_columns_buckle_as_given() {
    let data = json("mass/selfweight_given.json");
    for row in rows(&data, "column_post_buckled", 3) {
        let q = number(row, "q");
        for path in [Path::Auto, Path::Planar, Path::Spatial] {
            let load = along(-q * Vector3::x());
            let problem = problem(laid(3.0), free(Vector3::zeros()), &load).with_path(path);
            let found = problem.solve(None).expect("an equilibrium");
            let side = found.end.position.y.signum();
            compare(&found, row, side, &format!("q = {q}, {path:?}"));
        }
    }
}

/// Catches errors that show only when bending, twist and natural curvature meet.
#[test]
fn a_curved_and_twisted_rod_sags_as_given() {
    let data = json("mass/selfweight_given.json");
    for row in rows(&data, "spatial", 1) {
        let vector = |key: &str| {
            let row = row[key].as_array().expect("three numbers");
            Vector3::from_fn(|i, _| match &row[i] {
                serde_json::Value::String(text) => text.parse().expect("a number"),
                value => value.as_f64().expect("a number"),
            })
        };
        let (bending, natural) = (list(&row["bending"]), vector("natural_strain"));
        let law = Linear::diagonal([bending[0], bending[1]], number(row, "torsion"))
            .expect("a law")
            .with_rest([natural.x, natural.y], natural.z)
            .expect("a law");
        let load = along(vector("direction") * number(row, "weight"));
        let rod = Rod::new(1.0, law).expect("a rod");
        let found = problem(rod, free(vector("tip_force")), &load)
            .solve(None)
            .expect("an equilibrium");
        let column = |k: usize| found.end.directors.column(k).into_owned();
        for (got, key) in [
            (found.end.position, "tip"),
            (column(2), "d3_tip"),
            (column(0), "d1_tip"),
            (found.base.fixed_rows::<3>(0).into_owned(), "base_couple"),
        ] {
            let off = (got - vector(key)).norm();
            assert!(off < 1e-9, "{key}: {got}, off by {off:e}");
        }
        assert_eq!(found.index, 0);
    }
}

/// The upright column under -q x along it, in a plane or in space.
fn column(q: f64, path: Path, out_of_plane: f64) -> Problem {
    let load = along(-q * Vector3::x());
    problem(laid(out_of_plane), free(Vector3::zeros()), &load).with_path(path)
}

/// Catches a wrong index of heavy rods: the straight column loses its stability at Greenhill's loads, in one plane or
/// in two.
#[test]
fn the_index_of_upright_columns_counts_greenhills_loads() {
    let data = json("mass/selfweight_given.json");
    let critical: Vec<f64> = (data["critical"].as_array().expect("a list").iter())
        .map(|q| q.as_str().and_then(|q| q.parse().ok()).expect("a number"))
        .collect();
    assert!((critical[0] - GREENHILL).abs() < 1e-12);
    for out_of_plane in [1.0, 3.0] {
        let at = |q: f64| {
            let base = Vector6::new(0.0, 0.0, 0.0, -q, 0.0, 0.0);
            let index = column(q, Path::Auto, out_of_plane).index_at(&base);
            index.expect("an index")
        };
        let mut steps: Vec<f64> = critical.clone();
        steps.extend(critical.iter().map(|q| q * out_of_plane));
        for q in &critical {
            for factor in [1.0 - 1e-5, 1.0 + 1e-5] {
                let q = q * factor;
                let below = steps.iter().filter(|step| **step < q).count();
                assert_eq!(at(q), below, "q = {q}, stiffness {out_of_plane}");
            }
        }
    }
}

/// Catches a wrong tangent: the branch of the straight column finds Greenhill's load as a singularity, and the
/// branches switched there lead, on both sides, through the given buckled columns.
#[test]
fn a_branch_finds_greenhills_load() {
    let start = column(0.0, Path::Planar, 3.0);
    let Ok((ProblemChart::Planar(plane), _)) = start.choose_chart(None) else {
        panic!("not planar");
    };
    let planar = RodFamily::in_chart(|q| Ok(column(q, Path::Planar, 3.0)), true, 20.0, plane);
    let spatial = RodFamily::new(|q| Ok(column(q, Path::Spatial, 3.0)), true, 20.0);
    buckles(&planar, 3);
    buckles(&spatial, 6);
}

fn buckles(family: &impl Statical, size: usize) {
    let data = json("mass/selfweight_given.json");
    let given = rows(&data, "column_post_buckled", 3);
    let options = Options {
        tolerance: 1e-12,
        initial_step: 0.05,
        max_step: 1.0,
        weight: 0.5,
        at: given.iter().map(|row| number(row, "q")).collect(),
        ..Options::between(0.0, 21.0)
    };
    let straight = Continuation::new(family, DVector::zeros(size), 0.0, options.clone());
    let trace = straight.expect("a branch").trace();
    let [special] = &trace.specials[..] else {
        panic!("{:?}", trace.specials);
    };
    assert_eq!(special.kind, SpecialKind::BranchPoint);
    assert_eq!(special.index, (Some(0), Some(1)));
    assert_close(special.point.p, GREENHILL, 1e-8, 1.0, "Greenhill's load");
    let leaving = switch(family, special, 0.05, &options).expect("branches");
    assert_eq!(leaving.starts.len(), 2);
    let mut sides = 0.0;
    for start in &leaving.starts {
        let buckled = Continuation::along(family, start, options.clone());
        let trace = buckled.expect("a branch").trace();
        let mut met = 0;
        for point in &trace.points {
            let row = given.iter().find(|row| number(row, "q") == point.p);
            let Some(row) = row.filter(|_| point.role == Role::Requested) else {
                continue;
            };
            let at = family.state(&point.x, point.p).expect("a state");
            let side = at.end.position.y.signum();
            let close = |got: f64, key: &str| assert_close(got, number(row, key), 1e-10, 1.0, key);
            close(at.end.position.x, "x");
            close(side * at.end.position.y, "y");
            close(side * at.base[2], "curvature_base");
            close(at.end.energy, "U");
            assert_eq!(point.index, Some(0));
            (met, sides) = (met + 1, sides + side);
        }
        assert_eq!(met, given.len());
    }
    assert_eq!(sides, 0.0);
}

/// Catches a tangent that is not the derivative of its function: central differences at two steps, whose errors fall
/// by four.
#[test]
fn tangents_are_derivatives() {
    let law = Linear::diagonal([1.0, 0.7], 0.6)
        .expect("a law")
        .with_shear([30.0, 20.0])
        .expect("a law")
        .with_axial(50.0)
        .expect("a law")
        .with_rest([0.3, -0.8], 1.1)
        .expect("a law");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.9));
    let rod = Rod::new(1.3, law)
        .expect("a rod")
        .with_clamp(Vector3::new(0.1, 0.2, -0.3), turn);
    let vary = [
        Vector3::new(1.0, -4.0, 0.5),
        Vector3::new(-2.0, 1.0, 3.0),
        Vector3::new(0.3, 0.2, -2.0),
    ];
    let load = DistributedLoad::polynomial(vary.to_vec()).expect("a load");
    let ends = [
        free(Vector3::new(0.3, 0.4, -0.7)),
        EndConditions::ball(Vector3::new(0.4, 0.5, 0.2)),
        EndConditions::pose(Vector3::new(0.4, 0.5, 0.2), turn.inverse()),
        EndConditions::weight(
            Vector3::new(0.3, 0.4, -0.7),
            Vector3::new(0.1, 0.2, 0.3),
            Vector3::zeros(),
        ),
        EndConditions::follower(Vector3::new(0.2, 0.1, -0.5), Vector3::new(0.1, 0.3, 0.2)),
    ];
    let x = DVector::from_vec(vec![0.7, -0.4, 0.5, 1.1, -0.8, 0.6]);
    for end in ends {
        differentiate(&problem(rod.clone(), end, &load), &Spatial, &x);
    }
    let x = DVector::from_vec(vec![0.7, -1.4, 2.5]);
    let flat = DistributedLoad::polynomial(vec![Vector3::new(1.0, -4.0, 0.0), Vector3::y() * 2.0]);
    let flat = flat.expect("a load");
    for end in [
        free(Vector3::new(0.3, 0.4, 0.0)),
        EndConditions::ball(Vector3::new(0.4, 0.5, 0.0)),
        EndConditions::follower(Vector3::new(0.0, 0.1, -0.5), Vector3::x() * 0.2),
    ] {
        let problem = problem(laid(3.0), end, &flat);
        let Ok((ProblemChart::Planar(plane), _)) = problem.choose_chart(None) else {
            panic!("not planar");
        };
        differentiate(&problem, &plane, &x);
    }
}

fn differentiate<C: Chart>(problem: &Problem, chart: &C, x: &DVector<f64>) {
    let trial = chart.trial(problem, x).expect("a trial");
    let (value, tangent) = chart.equations(problem, &trial);
    let at = |x: &DVector<f64>| {
        let bare = chart.bare_trial(problem, x).expect("a trial");
        chart.residual(problem, &bare)
    };
    assert!((at(x) - value).norm() < 1e-11);
    let off = |h: f64| {
        worst((0..x.len()).map(|j| {
            let step = DVector::from_fn(x.len(), |i, _| if i == j { h } else { 0.0 });
            let slope = (at(&(x + &step)) - at(&(x - &step))) / (2.0 * h);
            (slope - tangent.column(j)).norm()
        }))
    };
    let (coarse, fine) = (off(4e-3), off(2e-3));
    assert!(fine < 1e-5, "off by {fine:e}");
    let ratio = coarse / fine;
    assert!((ratio - 4.0).abs() < 0.1, "{coarse:e}, {fine:e}");
}

/// Catches loads that vary along the rod and are integrated wrongly: the planar equations stepped by the method of
/// Runge and Kutta.
#[test]
fn a_load_that_varies_along_the_rod_is_that_of_its_equations() {
    let c = [
        Vector3::new(-1.0, -2.0, 0.0),
        Vector3::new(3.0, -6.0, 0.0),
        Vector3::new(-2.0, 4.0, 0.0),
    ];
    let load = DistributedLoad::polynomial(c.to_vec()).expect("a load");
    let tip = Vector3::new(0.5, -0.7, 0.0);
    let found = problem(laid(3.0), free(tip), &load)
        .solve(None)
        .expect("an equilibrium");
    let whole = load.total(1.0);
    let n = |s: f64| tip + whole - (c[0] * s + c[1] * (s * s / 2.0) + c[2] * (s.powi(3) / 3.0));
    // theta, theta', x, y.
    let slope = |s: f64, y: [f64; 4]| {
        let (sin, cos) = y[0].sin_cos();
        [y[1], sin * n(s).x - cos * n(s).y, cos, sin]
    };
    let add = |y: [f64; 4], h: f64, k: [f64; 4]| std::array::from_fn(|i| y[i] + h * k[i]);
    let steps = 4000;
    let h = 1.0 / f64::from(steps);
    let mut y = [0.0, found.base[2], 0.0, 0.0];
    for k in 0..steps {
        let s = h * f64::from(k);
        let k1 = slope(s, y);
        let k2 = slope(s + h / 2.0, add(y, h / 2.0, k1));
        let k3 = slope(s + h / 2.0, add(y, h / 2.0, k2));
        let k4 = slope(s + h, add(y, h, k3));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    for (got, want, what) in [
        (angle(&found), y[0], "theta"),
        (0.0, y[1], "couple at the end"),
        (found.end.position.x, y[2], "x"),
        (found.end.position.y, y[3], "y"),
    ] {
        assert_close(got, want, 1e-10, 1.0, what);
    }
}

/// Catches a base wrench that does not balance the loads: integrals over the shape by Simpson's rule, in space.
#[test]
fn the_clamp_balances_end_load_and_weight() {
    let law = Linear::diagonal([1.0, 0.7], 0.6)
        .expect("a law")
        .with_rest([0.5, -0.8], 1.5)
        .expect("a law");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.9));
    let place = Vector3::new(0.1, 0.2, -0.3);
    let rod = Rod::new(2.0, law).expect("a rod").with_clamp(place, turn);
    let (f, tip) = (Vector3::new(0.2, 0.3, -0.9), Vector3::new(-0.1, 0.3, 0.2));
    let couple = Vector3::new(0.05, -0.1, 0.2);
    let problem = problem(rod, EndConditions::load(tip, couple), &along(f));
    let found = problem.solve(None).expect("an equilibrium");
    let parts = 400;
    let shape = problem.shape(&found.base, parts + 1).expect("a shape");
    let weight = |k: usize| match k {
        0 => 1.0,
        k if k == parts => 1.0,
        k => [2.0, 4.0][k % 2],
    };
    let h = 2.0 / parts as f64;
    let mean: Vector3<f64> = (shape.iter().enumerate())
        .map(|(k, section)| section.position * (weight(k) * h / 3.0))
        .sum();
    let base = |at: usize| found.base.fixed_rows::<3>(at).into_owned();
    assert!((base(3) - tip - f * 2.0).norm() < 1e-11);
    let arm = found.end.position - place;
    let moment = couple + arm.cross(&tip) + (mean - place * 2.0).cross(&f);
    assert!((base(0) - moment).norm() < 1e-9, "{} {moment}", base(0));
    assert_close(found.potential, -f.dot(&mean), 1e-9, 1.0, "potential");
    let last = shape.last().expect("a section");
    assert!((last.force - tip).norm() < 1e-10);
    assert!((last.couple - couple).norm() < 1e-10);
    assert!((last.position - found.end.position).norm() < 1e-11);
}

/// Catches energies that do not belong to the equilibria: d(U + V)/dq = V/q for a rod in equilibrium whose load grows.
#[test]
fn energy_and_potential_belong_together() {
    let direction = Vector3::new(0.3, -0.8, 0.4);
    let at = |q: f64| {
        let found = problem(laid(0.6), free(Vector3::zeros()), &along(direction * q)).solve(None);
        let found = found.expect("an equilibrium");
        (found.end.energy + found.potential, found.potential)
    };
    let (q, h) = (6.0, 1e-2);
    let slope = |h: f64| (at(q + h).0 - at(q - h).0) / (2.0 * h);
    let better = (4.0 * slope(h) - slope(2.0 * h)) / 3.0;
    assert_close(better, at(q).1 / q, 1e-8, 1.0, "d(U + V)/dq");
}

/// Catches a wrong effect of the load on a held end: the reaction on a rod held in its loaded equilibrium is zero.
#[test]
fn holding_a_heavy_rod_where_it_is_changes_nothing() {
    let load = along(Vector3::new(-1.0, -4.0, 1.0));
    let force = Vector3::new(0.5, -1.0, 0.7);
    let rod = laid(1.7);
    let found = problem(rod.clone(), free(force), &load).solve(None);
    let found = found.expect("an equilibrium");
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
        found.end.directors,
    ));
    let place = found.end.position;
    for end in [EndConditions::ball(place), EndConditions::pose(place, turn)] {
        let held = problem(rod.clone(), end, &load).solve(Some(&found.base));
        let held = held.expect("an equilibrium");
        assert!((held.base - found.base).norm() < 1e-8);
        assert_eq!(held.index, 0);
        let alone = problem(rod.clone(), end, &load).solve(None);
        let alone = alone.expect("an equilibrium without a guess");
        assert_eq!(alone.index, 0);
        assert!((alone.end.position - place).norm() < 1e-9);
    }
}

/// Catches a difference between a load of zero and no load.
#[test]
fn no_load_is_no_load() {
    let tip = Vector3::new(0.3, -1.2, 0.8);
    let bare = Problem::new(laid(2.0), free(tip), 1e-13).expect("a problem");
    let none = bare.clone().with_distributed(&along(Vector3::zeros()));
    let [bare, none] = [bare, none].map(|problem| problem.solve(None).expect("an equilibrium"));
    assert!((bare.base - none.base).norm() < 1e-10);
    assert_close(none.end.energy, bare.end.energy, 1e-11, 1.0, "energy");
    assert_eq!(bare.potential, 0.0);
}
