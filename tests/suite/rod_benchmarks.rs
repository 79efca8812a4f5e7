//! Published and independently computed numbers of rods in space (tests/data/rod_branch.json).

use crate::support::{assert_close, json, number, rows};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use snaprod::elastica::Equilibrium as Elastica;
use snaprod::rod::{EndConditions, Problem, Rod, RodFamily};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Direction, Options, Trace};
use snaprod::solve::special_points::SpecialKind;

/// Unshearable, inextensible, in-plane bending stiffness 1; bending about d2 moves the rod in the plane (z, x).
fn kirchhoff(out_of_plane: f64, torsion: f64) -> Rod {
    let law = Linear::diagonal([out_of_plane, 1.0], torsion).expect("a law");
    Rod::new(1.0, law).expect("a rod")
}

fn planar(m: f64, n: [f64; 2]) -> Vector6<f64> {
    // Planar x along z, planar y along x: the couple is about y.
    Vector6::new(0.0, m, 0.0, n[1], 0.0, n[0])
}

/// Catches any disagreement of the spatial rod with the closed form of the planar elastica: end, energy, in-plane
/// index.
#[test]
fn the_planar_elastica_is_reproduced() {
    for (lambda, kappa) in [
        (1.0, 0.3),
        (3.0, -0.5),
        (5.0, 0.7),
        (6.2, 0.45),
        (7.5, 0.6),
        (2.5, 0.95),
    ] {
        let closed = Elastica::from_lambda_kappa(lambda, kappa).expect("an equilibrium");
        let base = closed.section(0.0).expect("the clamp");
        // Force of the rod on the mass is minus the force on the rod.
        let n = [-closed.force[0], -closed.force[1]];
        // Stiff out of the plane: the index is that of the plane.
        let rod = kirchhoff(40.0, 40.0);
        let wrench = planar(base.curvature, n);
        let end = rod.end(&wrench, 1e-13).expect("an end").section;
        assert_close(end.position.z, closed.x, 1e-10, 1.0, "x");
        assert_close(end.position.x, closed.y, 1e-10, 1.0, "y");
        assert_close(end.energy, closed.energy, 1e-10, 1.0, "energy");
        assert!(
            end.couple.norm() < 1e-10 * (1.0 + lambda * lambda),
            "couple {}",
            end.couple
        );
        let problem =
            Problem::new(rod, EndConditions::ball(end.position), 1e-12).expect("a problem");
        let index = problem.index_at(&wrench).expect("an index");
        let expected = snaprod::manifold::EquilibriumManifold::index(
            &snaprod::elastica::Elastica,
            &nalgebra::Vector2::new(closed.p, closed.w),
        );
        assert_eq!(
            index,
            expected.expect("an index"),
            "index at lambda {lambda}, kappa {kappa}"
        );
    }
}

fn branch(
    problem: impl Fn(f64) -> snaprod::Result<Problem>,
    guess: Vector6<f64>,
    from: f64,
    to: f64,
) -> Trace {
    let family = RodFamily::new(problem, false, to - from);
    let start = family
        .problem(from)
        .and_then(|p| p.solve(Some(&guess)))
        .expect("a start");
    let x = family.unknowns(&start.base, from).expect("the unknowns");
    let options = Options {
        initial_step: 0.05,
        max_step: 1.0,
        weight: 10.0 / (to - from).abs(),
        ..Options::between(from, to)
    };
    Continuation::new(&family, x, from, options)
        .expect("a branch")
        .trace()
}

/// Catches a fold located only roughly: three folds with the end at (0.6, y), to the accuracy of an independent
/// continuation code (its own error is 9e-12).
#[test]
fn folds_with_the_end_held_agree_with_an_independent_code() {
    let closed = Elastica::from_lambda_kappa(4.0, 0.5).expect("an equilibrium");
    let wrench = planar(
        closed.section(0.0).expect("the clamp").curvature,
        [-closed.force[0], -closed.force[1]],
    );
    let ball = |x: f64, z: f64| {
        Problem::new(
            kirchhoff(2.0, 0.8),
            EndConditions::ball(Vector3::new(x, 0.0, z)),
            1e-12,
        )
    };
    let moved = branch(
        |part| ball(closed.y, closed.x + part * (0.6 - closed.x)),
        wrench,
        0.0,
        1.0,
    );
    let last = moved.points.last().expect("points");
    assert_eq!(last.p, 1.0, "{}", moved.stop);
    let family = RodFamily::new(|y| ball(y, 0.6), false, 1.5);
    let mut folds = Vec::new();
    for direction in [Direction::Forward, Direction::Backward] {
        let options = Options {
            direction,
            initial_step: 0.05,
            max_step: 1.0,
            weight: 10.0,
            ..Options::between(-0.75, 0.75)
        };
        let trace = Continuation::new(&family, last.x.clone(), closed.y, options)
            .expect("a branch")
            .trace();
        folds.extend(
            trace
                .specials
                .iter()
                .filter(|s| s.kind == SpecialKind::Fold)
                .map(|s| s.point.p),
        );
    }
    for want in [-0.612021928121196, 0.606265086391384, -0.604399349559271] {
        let near = folds
            .iter()
            .map(|y| (y.abs() - f64::abs(want)).abs())
            .fold(1.0, f64::min);
        assert!(near < 2e-11, "fold {want}: nearest {near:e} of {folds:?}");
    }
}

/// Catches an out-of-plane instability missed or misplaced: the planar elastica with a ball joint leaves its plane at
/// the points given by the Lame-type equation of the reference.
#[test]
fn the_elastica_leaves_its_plane_where_an_independent_equation_says() {
    let data = json("rod_branch.json");
    for row in rows(&data["ball_elastica"], "rows", 4) {
        let lam = number(row, "lam");
        let index = |lambda: f64| {
            let closed = Elastica::from_lambda_kappa(lambda, 0.5).expect("an equilibrium");
            let wrench = planar(
                closed.section(0.0).expect("the clamp").curvature,
                [-closed.force[0], -closed.force[1]],
            );
            let rod = kirchhoff(number(row, "out_of_plane"), number(row, "torsion"));
            let end = rod.end(&wrench, 1e-12).expect("an end").section;
            Problem::new(rod, EndConditions::ball(end.position), 1e-12)
                .and_then(|p| p.index_at(&wrench))
                .expect("an index")
        };
        assert_eq!(
            [index(lam - 1e-7), index(lam + 1e-7)],
            [0, 1],
            "at lam = {lam}"
        );
    }
}

/// Catches a wrong count for clamped ends: the post-buckled planar rod leaves its plane, index 0 -> 1 (or 1 -> 2).
#[test]
fn the_clamped_elastica_leaves_its_plane() {
    let data = json("rod_branch.json");
    for row in rows(&data["clamped_elastica"], "rows", 5) {
        // With equal bending, turning the plane of buckling is free: a zero eigenvalue whose sign is noise.
        if number(row, "out_of_plane") == 1.0 {
            continue;
        }
        let index = |k: f64| {
            let kk = snaprod::math::elliptic::complete_k((1.0 - k * k).sqrt()).expect("K");
            let wrench = planar(8.0 * kk * k, [-16.0 * kk * kk, 0.0]);
            let rod = kirchhoff(number(row, "out_of_plane"), number(row, "torsion"));
            let end = rod.end(&wrench, 1e-12).expect("an end").section;
            assert!(end.position.x.abs() < 1e-9 && end.directors[(0, 2)].abs() < 1e-9);
            let pose =
                EndConditions::pose(end.position, UnitQuaternion::from_matrix(&end.directors));
            Problem::new(rod, pose, 1e-12)
                .and_then(|p| p.index_at(&wrench))
                .expect("an index")
        };
        let k = number(row, "k");
        let want = [row["index_below"].as_u64(), row["index_above"].as_u64()]
            .map(|i| i.expect("an index") as usize);
        assert_eq!(
            [index(k - 1e-6), index(k + 1e-6)],
            want,
            "at k = {k}: {row}"
        );
    }
}
