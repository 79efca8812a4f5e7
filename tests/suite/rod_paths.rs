//! Planar and closed-form paths against the spatial one; the rod as an equilibrium manifold.

use crate::support::assert_close;
use nalgebra::{DVector, Rotation3, UnitQuaternion, Vector3, Vector6};
use snaprod::elastica::Elastica;
use snaprod::manifold::{EquilibriumManifold, ManifoldPoint, invert_near};
use snaprod::rod::{
    BallJointed, Chart, EndConditions, Equilibrium, FreeEnd, Path, Problem, ProblemChart, Rod,
    RodFamily, Welded,
};
use snaprod::section::{Along, Barrier, Linear, Varying};
use snaprod::solve::arclength::{Continuation, Options};
use snaprod::solve::parametrised_problem::Family;
use std::f64::consts::PI;

fn kirchhoff(bending: [f64; 2]) -> Rod {
    Rod::new(1.3, Linear::diagonal(bending, 0.7).unwrap()).unwrap()
}

fn elastic() -> Linear {
    Linear::diagonal([1.5, 1.0], 0.7)
        .and_then(|law| law.with_shear([90.0, 110.0]))
        .and_then(|law| law.with_axial(250.0))
        .unwrap()
}

/// Rods of all kinds that stay in the plane of z and x when the data do.
fn planar_rods() -> Vec<(&'static str, Rod)> {
    let curved = elastic().with_rest([0.0, 0.8], 0.0).unwrap();
    let tapered = Varying::diagonal(
        [
            Along::polynomial(&[1.5, -0.5]).unwrap(),
            Along::polynomial(&[1.0, -0.4]).unwrap(),
        ],
        Along::polynomial(&[0.7, -0.2]).unwrap(),
    )
    .unwrap();
    let barrier = Barrier::new(elastic(), [0.05, 0.05], 2.0).unwrap();
    vec![
        ("rigid", kirchhoff([1.5, 1.0])),
        ("elastic", Rod::new(1.3, elastic()).unwrap()),
        ("curved", Rod::new(1.3, curved).unwrap()),
        ("tapered", Rod::new(1.3, tapered).unwrap()),
        ("barrier", Rod::new(1.3, barrier).unwrap()),
    ]
}

fn planar_ends() -> Vec<(&'static str, EndConditions)> {
    let (x, z) = (Vector3::x(), Vector3::z());
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.9);
    let force = x * 0.7 - z * 0.9;
    let place = x * 0.55 + z * 0.9;
    vec![
        ("dead", EndConditions::load(force, Vector3::y() * 0.4)),
        (
            "dead, no couple",
            EndConditions::load(force, Vector3::zeros()),
        ),
        (
            "follower",
            EndConditions::follower(force, Vector3::y() * 0.4),
        ),
        ("ball", EndConditions::ball(place)),
        ("pose", EndConditions::pose(place, turn)),
        (
            "slide",
            EndConditions {
                position: [Some(0.3), Some(0.0), None],
                orientation: Some(turn),
                ..EndConditions::load(-z * 0.5, Vector3::zeros())
            },
        ),
    ]
}

/// Catches a wrong planar equation, a lost compliance, a frame or sign error of the plane, and clamps anywhere in
/// space.
#[test]
fn the_plane_gives_what_space_gives() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.1, 0.6));
    for (rod_name, rod) in planar_rods() {
        for (end_name, end) in planar_ends() {
            for turned in [false, true] {
                // Partly held ends refer to the axes of the world, which must coincide with the plane's.
                let mixed = end.position.iter().flatten().count() == 2;
                if turned && mixed {
                    continue;
                }
                let (rod, end) = if turned {
                    moved(&rod, &end, &turn)
                } else {
                    (rod.clone(), end)
                };
                let name = format!("{rod_name}, {end_name}, turned: {turned}");
                let problem = Problem::new(rod, end, 1e-12).unwrap();
                let flat = problem
                    .clone()
                    .with_path(Path::Planar)
                    .solve(None)
                    .unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_eq!(flat.taken.path, Path::Planar, "{name}");
                assert!(flat.residual < 1e-9, "{name}: {}", flat.residual);
                let spatial = problem
                    .clone()
                    .with_path(Path::Spatial)
                    .solve(Some(&flat.base))
                    .unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_eq!(spatial.taken.path, Path::Spatial, "{name}");
                let gap = (spatial.base - flat.base).norm() / (1.0 + flat.base.norm());
                assert!(gap < 1e-9, "{name}: wrenches {gap:.1e} apart");
                assert_eq!(spatial.index, flat.index, "{name}");
            }
        }
    }
}

/// Rod and end condition moved rigidly.
fn moved(rod: &Rod, end: &EndConditions, turn: &UnitQuaternion<f64>) -> (Rod, EndConditions) {
    let place = Vector3::new(0.2, -0.1, 0.4);
    let there = |x: [Option<f64>; 3]| match x {
        [Some(x), Some(y), Some(z)] => {
            let r = place + turn * Vector3::new(x, y, z);
            [Some(r.x), Some(r.y), Some(r.z)]
        }
        free => free,
    };
    let along = |v: &Vector3<f64>| if end.follower { *v } else { turn * v };
    let end = EndConditions {
        position: there(end.position),
        orientation: end.orientation.map(|q| turn * q),
        force: along(&end.force),
        couple: along(&end.couple),
        follower: end.follower,
        turning: end.turning,
        arm: end.arm,
    };
    (rod.clone().with_clamp(place, *turn), end)
}

/// Catches a wrong scale between rod and elastica, a wrong force derivative, a wrong inverse of the chart.
#[test]
fn the_closed_form_gives_what_space_gives() {
    for bending in [[1.5, 1.0], [2.0, 2.0], [0.9, 3.0]] {
        for end in [
            EndConditions::ball(Vector3::new(0.55, 0.0, 0.7)),
            EndConditions::ball(Vector3::new(-0.8, 0.0, 0.3)),
            EndConditions::load(Vector3::new(0.7, 0.0, -0.9), Vector3::zeros()),
            EndConditions::load(Vector3::new(-2.0, 0.0, 1.0), Vector3::zeros()),
        ] {
            let problem = Problem::new(kirchhoff(bending), end, 1e-12).unwrap();
            let closed = problem.clone().with_path(Path::ClosedForm).solve(None);
            let closed = closed.unwrap_or_else(|e| panic!("{bending:?} {end:?}: {e}"));
            let spatial = problem
                .clone()
                .with_path(Path::Spatial)
                .solve(Some(&closed.base))
                .unwrap();
            let gap = (spatial.base - closed.base).norm() / (1.0 + closed.base.norm());
            assert!(gap < 1e-9, "{bending:?} {end:?}: wrenches {gap:.1e} apart");
            // Started from a wrench, the search finds the same point of the chart.
            let again = problem
                .clone()
                .with_path(Path::ClosedForm)
                .solve(Some(&(closed.base * 1.001)))
                .unwrap();
            assert!(
                (again.base - closed.base).norm() < 1e-9 * (1.0 + closed.base.norm()),
                "{bending:?} {end:?}"
            );
            let auto = problem.solve(None).unwrap();
            assert!(auto.index <= closed.index);
            if closed.index == 0 {
                assert_eq!(auto.taken.path, Path::ClosedForm, "{bending:?} {end:?}");
            }
        }
    }
}

/// Catches an inapplicable path that is accepted, and refusals without the reason.
#[test]
fn paths_are_refused_with_the_reason() {
    let force = Vector3::new(1.0, -2.0, 0.5);
    let sheared = Rod::new(1.0, elastic()).unwrap();
    let twisted = kirchhoff([1.5, 1.0]);
    let cases = [
        (
            sheared.clone(),
            EndConditions::load(force, Vector3::zeros()),
            Path::Planar,
            "out of every plane",
        ),
        (
            sheared,
            EndConditions::load(Vector3::x(), Vector3::zeros()),
            Path::ClosedForm,
            "sheared or stretched",
        ),
        (
            twisted.clone(),
            EndConditions::load(Vector3::x(), Vector3::y()),
            Path::ClosedForm,
            "couple",
        ),
        (
            twisted,
            EndConditions::follower(Vector3::x(), Vector3::zeros()),
            Path::ClosedForm,
            "follows",
        ),
    ];
    for (rod, end, path, reason) in cases {
        let problem = Problem::new(rod, end, 1e-10).unwrap().with_path(path);
        let message = problem.solve(None).unwrap_err().to_string();
        assert!(message.contains(reason), "{message}");
        assert!(message.contains("\"auto\""), "{message}");
    }
}

/// Catches a wrong derivative in any chart: central differences of its own residual.
#[test]
fn charts_have_exact_derivatives() {
    let x = Vector3::new(0.55, 0.0, 0.7);
    for end in [
        EndConditions::ball(x),
        EndConditions::load(Vector3::new(0.7, 0.0, -0.9), Vector3::zeros()),
    ] {
        let make = |rod: Rod| move |_: f64| Problem::new(rod.clone(), end, 1e-13);
        let problem = Problem::new(kirchhoff([1.5, 1.0]), end, 1e-13).unwrap();
        let found = problem.solve(None).unwrap();
        let (closed, _) = problem.choose_chart(None).unwrap();
        let (plane, _) = problem
            .clone()
            .with_path(Path::Planar)
            .choose_chart(None)
            .unwrap();
        let make = make(problem.rod().clone());
        if let ProblemChart::ClosedForm(chart) = closed {
            let family = RodFamily::in_chart(make.clone(), false, 1.0, chart);
            differences(&family, family.unknowns(&found.base, 0.0).unwrap());
        } else {
            panic!("not in closed form: {closed:?}");
        }
        let ProblemChart::Planar(plane) = plane else {
            panic!("not planar: {plane:?}");
        };
        let family = RodFamily::in_chart(make.clone(), false, 1.0, plane);
        differences(&family, family.unknowns(&found.base, 0.0).unwrap());
        let family = RodFamily::in_chart(make, false, 1.0, FreeEnd);
        differences(&family, family.unknowns(&found.base, 0.0).unwrap());
    }
}

fn differences(family: &dyn Family, x: DVector<f64>) {
    let at = family.linearised(&x, 0.0).unwrap();
    assert!(at.residual.norm() < 1e-8, "{}", at.residual);
    let h = 1e-4;
    for k in 0..family.size() {
        let value = |steps: f64| {
            let mut x = x.clone();
            x[k] += steps * h;
            family.linearised(&x, 0.0).unwrap().residual
        };
        let slope = (8.0 * (value(1.0) - value(-1.0)) - (value(2.0) - value(-2.0))) / (12.0 * h);
        let gap = (&slope - at.jacobian.column(k)).norm();
        assert!(gap < 1e-7 * (1.0 + slope.norm()), "column {k}: {gap:.1e}");
    }
}

/// Catches a wrong reversal of the rod, frame or sign: on the elastica's plane the manifold of the ball-jointed rod
/// is the closed form, index included.
#[test]
fn the_ball_jointed_rod_holds_the_elastica() {
    let rod = Rod::new(1.0, Linear::diagonal([40.0, 1.0], 40.0).unwrap()).unwrap();
    // 2/(1/40 + 1): the unit of force is not the plane's own.
    let unit = rod.reference_stiffness();
    let spatial = BallJointed::new(rod, 1e-13).unwrap();
    for (lambda, kappa) in [(1.0, 0.3), (5.0, -0.7), (6.2, 0.45), (9.0, 0.6)] {
        let closed = snaprod::elastica::Equilibrium::from_lambda_kappa(lambda, kappa).unwrap();
        let tip = closed.section(1.0).unwrap();
        // Force on the end, seen from its directors: the elastica's (x, y) are (d3, d1).
        let turn = Rotation3::new(Vector3::y() * tip.theta);
        let n = Vector3::new(-closed.force[1], 0.0, -closed.force[0]);
        let q = turn.inverse() * n / unit;
        let at: ManifoldPoint<3> = spatial.point(&q).unwrap();
        assert_close(at.pose.z, closed.x, 1e-10, 1.0, "x");
        assert_close(at.pose.x, closed.y, 1e-10, 1.0, "y");
        assert_close(at.energy, closed.energy, 1e-10, 1.0, "energy");
        assert_close(at.force.z, closed.force[0], 1e-10, 1.0, "force");
        assert_close(at.force.x, closed.force[1], 1e-10, 1.0, "force");
        let index = Elastica.index(&nalgebra::Vector2::new(closed.p, closed.w));
        assert_eq!(
            spatial.index(&q).unwrap(),
            index.unwrap(),
            "{lambda} {kappa}"
        );
    }
}

/// Catches a wrong force, energy or Jacobian: dU = -force . (Jacobian dq), and a wrong pose: the inverse leads back.
#[test]
fn manifolds_are_lagrangian_and_invertible() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.1, 0.6));
    for rod in [
        Rod::new(1.3, elastic().with_rest([0.4, -0.3], 0.5).unwrap()).unwrap(),
        kirchhoff([1.5, 1.0]),
        Rod::new(1.3, Barrier::new(elastic(), [0.05, 0.05], 2.0).unwrap()).unwrap(),
    ] {
        let rod = rod.with_clamp(Vector3::new(0.2, -0.1, 0.4), turn);
        let ball = BallJointed::new(rod.clone(), 1e-13).unwrap();
        lagrangian(&ball, Vector3::new(2.0, -1.5, -1.0));
        let welded = Welded::new(rod, 1e-13).unwrap();
        lagrangian(&welded, Vector6::new(1.2, -0.6, 0.5, -1.0, 0.8, 0.7));
    }
}

fn lagrangian<M: EquilibriumManifold<N>, const N: usize>(
    manifold: &M,
    q: nalgebra::SVector<f64, N>,
) {
    let at = manifold.point(&q).unwrap();
    let h = 1e-4;
    for k in 0..N {
        let there = |steps: f64| {
            let mut q = q;
            q[k] += steps * h;
            manifold.point(&q).unwrap()
        };
        let points = [there(-2.0), there(-1.0), there(1.0), there(2.0)];
        let weights = [1.0, -8.0, 8.0, -1.0].map(|w| w / (12.0 * h));
        let mut slope = 0.0;
        let mut column = nalgebra::SVector::<f64, N>::zeros();
        for (weight, point) in weights.iter().zip(&points) {
            slope += weight * point.energy;
            column += manifold.gap(&at, &point.pose) * *weight;
        }
        let work = -at.force.dot(&at.jacobian.column(k));
        assert_close(slope, work, 1e-8, 1.0, "dU");
        let gap = (column - at.jacobian.column(k)).norm();
        assert!(gap < 1e-7 * (1.0 + column.norm()), "column {k}: {gap:.1e}");
    }
    let found = invert_near(manifold, &at.pose, &(q * 1.05), 1e-11).unwrap();
    assert!((found.q - q).norm() < 1e-8, "{} {}", found.q, q);
    assert!(manifold.index(&q).is_ok());
}

/// Catches starts that miss the stable state: overloaded columns, clamped or free, are found buckled in the first mode.
#[test]
fn overloaded_columns_are_found_buckled() {
    let column = || Rod::new(1.0, Linear::diagonal([40.0, 1.0], 40.0).unwrap()).unwrap();
    // Free end: the slope at the end grows with the load (B2: 176 deg at 9.116218298).
    let mut slope = 0.0;
    for ratio in [1.1, 2.0, 5.0, 8.5, 9.116218298, 12.0] {
        let load = ratio * PI * PI / 4.0;
        let end = EndConditions::load(Vector3::new(0.0, 0.0, -load), Vector3::zeros());
        let found = Problem::new(column(), end, 1e-12)
            .unwrap()
            .solve(None)
            .unwrap();
        assert_eq!(found.index, 0, "{ratio}");
        let d3 = found.end.directors.column(2).into_owned();
        let tilt = d3.xy().norm().atan2(d3.z).to_degrees();
        assert!(tilt > slope, "{ratio}: {tilt}");
        slope = tilt;
        if ratio == 9.116218298 {
            assert_close(tilt, 176.0, 1e-7, 0.0, "slope");
        }
    }
    // Clamped: B3 at s = 0.1 and 0.3.
    for (s, load) in [(0.1, 41.5702557932), (0.3, 46.6121208798)] {
        let end = EndConditions::pose(Vector3::z() * (1.0 - s), UnitQuaternion::identity());
        let found = Problem::new(column(), end, 1e-12)
            .unwrap()
            .solve(None)
            .unwrap();
        assert_eq!(found.index, 0, "{s}");
        assert_close(-found.base[5], load, 1e-10, 0.0, "load");
    }
    // Equal stiffnesses: any plane will do, and moving round is neither stable nor unstable.
    for end in [
        EndConditions::load(Vector3::z() * -25.0, Vector3::zeros()),
        EndConditions::pose(Vector3::z() * 0.9, UnitQuaternion::identity()),
    ] {
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 0.7).unwrap()).unwrap();
        let found = Problem::new(rod, end, 1e-11).unwrap().solve(None).unwrap();
        assert_eq!(found.index, 0, "{end:?}");
        assert!(found.end.energy > 1.0, "{end:?}: {}", found.end.energy);
    }
}

/// Catches searches that end on a coil although the rod can trail along the load, and endless searches: dead forces of
/// all directions and sizes, whose energy is bounded below, so a stable state exists.
#[test]
fn dead_forces_are_trailed() {
    let laws = [
        Linear::diagonal([1.0, 1.5], 0.7).unwrap(),
        Linear::diagonal([1.0, 1.0], 1.0)
            .and_then(|law| law.with_shear([400.0, 400.0]))
            .and_then(|law| law.with_axial(400.0))
            .unwrap(),
        Linear::diagonal([1.0, 1.5], 0.7)
            .and_then(|law| law.with_rest([0.8, -0.5], 1.0))
            .unwrap(),
    ];
    for law in laws {
        for size in [3.0, 30.0, 100.0] {
            for angle in [0.0, 0.5, 1.6, 2.9, PI] {
                let rod = Rod::new(1.0, law).unwrap();
                let (sin, cos) = f64::sin_cos(angle);
                let (y, x) = f64::sin_cos(0.7);
                let force = Vector3::new(sin * x, sin * y, cos) * size;
                let problem =
                    Problem::new(rod, EndConditions::load(force, Vector3::zeros()), 1e-11);
                let found = problem.unwrap().solve(None);
                let name = format!("{law:?} {size} {angle}");
                let found = found.unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_eq!(found.index, 0, "{name}");
                // The load's work exceeds the stored energy.
                let work = force.dot(&(found.end.position - Vector3::z()));
                assert!(
                    found.end.energy <= work + 0.5 * size * size / 100.0 + 1.0,
                    "{name}"
                );
            }
        }
    }
}

/// Catches an index for loads that have none.
#[test]
fn followers_have_no_index_on_branches() {
    let make = |p: f64| {
        let end = EndConditions::follower(Vector3::z() * -p, Vector3::zeros());
        Problem::new(kirchhoff([1.5, 1.0]), end, 1e-11)
    };
    let family = RodFamily::new(make, false, 30.0);
    let trace = Continuation::new(&family, DVector::zeros(6), 0.0, Options::between(0.0, 30.0))
        .unwrap()
        .trace();
    // Beck's column: no other equilibrium at any load.
    assert!(trace.specials.is_empty(), "{:?}", trace.specials);
    assert!(trace.points.iter().all(|point| point.index.is_none()));
    assert!(!make(1.0).unwrap().is_conservative());
}

/// Catches results limited by the instability of shooting from the clamp: under a pull lam^2 an error grows as
/// exp(lam). m(0) = lam is known (theory 2.3).
#[test]
fn heavy_pulls_are_solved() {
    let (sin, cos) = (PI / 3.0).sin_cos();
    for across in [1.0, 3.0] {
        for lam in [5.0, 10.0, 12.0, 15.0, 20.0, 25.0, 40.0, 1000.0_f64] {
            let rod = Rod::new(1.0, Linear::diagonal([across, 1.0], 0.7).unwrap()).unwrap();
            let end =
                EndConditions::load(Vector3::new(sin, 0.0, cos) * lam * lam, Vector3::zeros());
            let found = Problem::new(rod, end, 1e-12).unwrap().solve(None).unwrap();
            assert_eq!(found.index, 0, "{across} {lam}");
            assert!(found.residual < 1e-5, "{across} {lam}: {}", found.residual);
            // theta' = 2 lam sin(gam/2), gam the angle of the pull.
            let gap = (found.base[1] / lam - 1.0).abs();
            assert!(
                gap < 4.0 * (-lam).exp() * lam + 1e-9,
                "{across} {lam}: {gap:e}"
            );
        }
    }
}

/// Catches an index that depends on a soft torsion, or is aliased by fast growth of variations: with vanishing
/// torsional stiffness the index of an isotropic rod without end couple does not change.
#[test]
fn soft_torsion_does_not_change_the_index() {
    let index = |torsion: f64| {
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], torsion).unwrap()).unwrap();
        let ball = BallJointed::new(rod, 1e-10).unwrap();
        ball.index(&Vector3::new(1.0, 2.0, -3.0)).unwrap()
    };
    let first = index(1.0);
    for torsion in [0.1, 1e-2, 1e-3, 1e-4, 1e-5] {
        assert_eq!(index(torsion), first, "torsion {torsion}");
    }
}

/// Catches a stability change misplaced or missed because the chart does not contain the unstable mode: out of the
/// plane of the chart. In space it is a root of the determinant.
#[test]
fn charts_agree_where_the_rod_leaves_the_plane() {
    let held_at = |y: f64| {
        let rod = Rod::new(1.0, Linear::diagonal([2.0, 1.0], 0.8)?)?;
        Problem::new(rod, EndConditions::ball(Vector3::new(y, 0.0, 0.6)), 1e-12)
    };
    let start = held_at(0.3).unwrap().solve(None).unwrap();
    let planar = held_at(0.3).unwrap().with_path(Path::Planar);
    let (ProblemChart::ClosedForm(closed), ProblemChart::Planar(plane)) = (
        held_at(0.3).unwrap().choose_chart(None).unwrap().0,
        planar.choose_chart(None).unwrap().0,
    ) else {
        panic!("other charts")
    };
    let spatial = leaving(RodFamily::new(held_at, false, 1.0), &start);
    for place in [
        leaving(RodFamily::in_chart(held_at, false, 1.0, FreeEnd), &start),
        leaving(RodFamily::in_chart(held_at, false, 1.0, plane), &start),
        leaving(RodFamily::in_chart(held_at, false, 1.0, closed), &start),
    ] {
        assert_close(place[0], spatial[0], 1e-9, 0.0, "leaving the plane");
        assert_close(place[1], -0.612021928121196, 1e-11, 0.0, "AUTO's fold");
    }
}

/// Parameters of the index changes 0 -> 1 and 1 -> 2 on the way from y = 0.3 down.
fn leaving<P, C>(family: RodFamily<P, C>, start: &Equilibrium) -> [f64; 2]
where
    P: Fn(f64) -> snaprod::Result<Problem>,
    C: Chart,
{
    let x = family.unknowns(&start.base, 0.3).unwrap();
    let options = Options {
        max_step: 0.5,
        weight: 10.0,
        ..Options::between(0.35, -0.65)
    };
    let trace = Continuation::new(&family, x, 0.3, options).unwrap().trace();
    [(0, 1), (1, 2)].map(|(before, after)| {
        let special = trace
            .specials
            .iter()
            .find(|special| special.index == (Some(before), Some(after)));
        special.expect("a change of the index").point.p
    })
}
