//! Branches of rods under any pull: base wrench and both ends in one set of unknowns.

use nalgebra::{UnitQuaternion, Vector3};
use snaprod::rod::{
    BothEnds, Chart, EndConditions, Path, Problem, Rod, RodFamily, Spatial, Statical,
};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Item, Options, Stop};
use snaprod::solve::parametrised_problem::Family;
use snaprod::solve::special_points::SpecialKind;

fn bent() -> Linear {
    let law = Linear::diagonal([1.1, 1.0], 0.75);
    law.and_then(|law| law.with_rest([0.1, -0.05], 0.2))
        .unwrap()
}

fn turned(by: Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    Some(UnitQuaternion::from_scaled_axis(by))
}

/// Every kind of end at lam = 9.5, in the form with the base wrench, and beyond, in the form with both ends. The
/// derivatives by the unknowns are compared with central differences, as is the derivative by a parameter that moves
/// the end condition. The determinant keeps its sign between the forms.
#[test]
fn equations_of_both_forms_have_one_sign_and_their_derivatives() {
    type Make = fn(Vector3<f64>, f64) -> EndConditions;
    let ends: [(&str, Make); 5] = [
        ("load", |f, c| {
            EndConditions::load(f, Vector3::new(0.4, 0.2, 1.0 + c))
        }),
        ("weight", |f, c| {
            let arm = Vector3::new(0.1, 0.05, -0.1);
            EndConditions::weight(f * (1.0 + 0.1 * c), arm, Vector3::zeros())
        }),
        ("turned", |f, c| EndConditions {
            orientation: turned(Vector3::new(0.3, 0.4, 1.0 + c)),
            ..EndConditions::load(f, Vector3::zeros())
        }),
        ("half held", |f, c| EndConditions {
            position: [Some(0.05 + 0.01 * c), None, None],
            ..EndConditions::load(f, Vector3::zeros())
        }),
        ("held", |f, c| {
            let place = f.normalize() * (1.0 - 0.6 / f.norm().sqrt() + 1e-4 * c);
            EndConditions {
                orientation: turned(Vector3::new(0.1, 0.0, 0.5)),
                ..EndConditions::ball(place)
            }
        }),
    ];
    for (name, make) in ends {
        let mut signs = Vec::new();
        for lam in [9.5_f64, 18.0, 300.0] {
            let force = Vector3::new(0.3, -0.2, 0.9).normalize() * lam * lam;
            let rod = Rod::new(1.0, bent()).unwrap();
            let problem = |c: f64| Problem::new(rod.clone(), make(force, c), 1e-13);
            let first = problem(0.0).unwrap();
            let Ok(found) = first.solve(None) else {
                panic!("{name} at {lam}: not solved");
            };
            assert_eq!(found.index, 0, "{name} at {lam}");
            let chart = BothEnds::new(&first, None);
            let family = RodFamily::in_chart(problem, false, 1.0, chart);
            let x = family.unknowns(&found.base, 0.0).unwrap();
            let there = family.linearised(&x, 0.0).unwrap();
            let scale = 1.0 + lam * lam;
            assert!(there.residual.norm() < 1e-11 * scale, "{name} at {lam}");
            let h = 1e-4;
            for k in 0..x.len() {
                let at = |way: f64| {
                    let mut x = x.clone();
                    x[k] += way;
                    family.linearised(&x, 0.0).unwrap().residual
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                let off = (slope - there.jacobian.column(k)).norm();
                let bound = if lam < 10.0 { 1e-3 } else { 1e-5 };
                let size = 1.0 + there.jacobian.column(k).norm();
                assert!(
                    off < bound * size,
                    "{name} at {lam}: d/dx{k} {:.1e}",
                    off / size
                );
            }
            let at = |c: f64| family.linearised(&x, c).unwrap().residual;
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let off = (slope - &there.slope).norm() / (1.0 + there.slope.norm());
            assert!(off < 1e-6, "{name} at {lam}: d/dc {off:.1e}");
            signs.push(there.jacobian.determinant().signum());
            // Both forms give the same end, energy and index.
            let state = family.state(&x, 0.0).unwrap();
            let apart = (state.end.position - found.end.position).norm();
            assert!(apart < 1e-9, "{name} at {lam}: {apart:.1e}");
            assert_eq!(family.index(&x, 0.0).unwrap(), Some(0), "{name} at {lam}");
        }
        assert!(
            signs.iter().all(|sign| *sign == signs[0]),
            "{name}: {signs:?}"
        );
    }
}

fn options(from: f64, to: f64, step: f64) -> Options {
    Options {
        initial_step: 0.12,
        max_step: step,
        min_step: 1e-6,
        tolerance: 1e-10,
        weight: 12.0 / (to - from).abs(),
        max_points: 1500,
        ..Options::between(from, to)
    }
}

/// Special points of a branch, and its last point.
type Followed = (Vec<(SpecialKind, f64, Option<usize>)>, f64, usize);

fn followed(family: &dyn Statical, x: nalgebra::DVector<f64>, options: Options) -> Followed {
    let (from, mut last, mut points, mut specials) = (options.from, f64::NAN, 0, Vec::new());
    for item in Continuation::new(family, x, from, options).unwrap() {
        match item {
            Item::Point(point) => {
                last = point.p;
                points += 1;
            }
            Item::Special(special) => {
                assert!(special.is_converged(), "{special:?}");
                specials.push((special.kind, special.point.p, special.index.1));
            }
            Item::Stop(stop) => {
                assert!(
                    matches!(stop, Stop::Reached | Stop::LeftAtStart),
                    "{stop:?} at {last}"
                );
            }
        }
    }
    (specials, last, points)
}

/// A rod whose end is held near full reach and twisted. Its branch goes through folds into loops and back out, with
/// lam between 6 and 12, from one form of the equations to the other. Reference: the base wrench, accurate there.
/// Catches a confusion of equilibria.
#[test]
fn a_twisted_rod_folds_alike_in_both() {
    let rod = Rod::new(1.0, bent()).unwrap();
    let problem = |angle: f64| {
        let place = Vector3::new(0.0, 0.0, 0.95);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        Problem::new(rod.clone(), EndConditions::pose(place, turn), 1e-12)
    };
    let first = problem(0.0).unwrap();
    let start = first.solve(None).unwrap();
    let base = RodFamily::new(problem, false, 20.0);
    let both = RodFamily::in_chart(problem, false, 20.0, BothEnds::new(&first, None));
    let mut found = Vec::new();
    let x = base.unknowns(&start.base, 0.0).unwrap();
    found.push(followed(&base, x, options(0.0, 20.0, 1.2)).0);
    let x = both.unknowns(&start.base, 0.0).unwrap();
    found.push(followed(&both, x, options(0.0, 20.0, 0.6)).0);
    assert!(found[0].len() >= 2, "{found:?}");
    for (base, both) in found[0].iter().zip(&found[1]).take(2) {
        assert_eq!((base.0, base.2), (both.0, both.2));
        assert!((base.1 - both.1).abs() < 1e-9, "{base:?} {both:?}");
    }
}

/// Loads that grow from nothing to lam = 1e4 in one branch, of a rod whose end is free, bears a body beside it, or is
/// held along one axis. The end of the branch is the equilibrium found there directly, stable throughout, in some
/// hundred steps.
#[test]
#[ignore = "second tier: 56 s"]
fn branches_lead_from_slack_rods_to_strings() {
    let direction = Vector3::new(0.3, -0.2, 0.9).normalize();
    let rod = Rod::new(1.0, bent()).unwrap();
    type Make = fn(Vector3<f64>) -> EndConditions;
    let makes: [Make; 3] = [
        |f| EndConditions::load(f, Vector3::zeros()),
        |f| EndConditions::weight(f, Vector3::new(0.1, 0.05, -0.1), Vector3::zeros()),
        |f| EndConditions {
            position: [None, Some(-0.1), None],
            ..EndConditions::load(f, Vector3::zeros())
        },
    ];
    for (k, make) in makes.into_iter().enumerate() {
        let to = 1e8;
        let problem = |p: f64| Problem::new(rod.clone(), make(direction * p), 1e-12);
        let first = problem(0.0).unwrap();
        let start = first.solve(None).unwrap();
        let family = RodFamily::in_chart(problem, false, to, BothEnds::new(&first, None));
        let x = family.unknowns(&start.base, 0.0).unwrap();
        let mut end = None;
        let mut points = 0;
        for item in Continuation::new(&family, x, 0.0, options(0.0, to, 1.2)).unwrap() {
            match item {
                Item::Point(point) => {
                    points += 1;
                    end = Some(point);
                }
                Item::Special(special) => panic!("end {k}: {special:?}"),
                Item::Stop(stop) => assert_eq!(stop, Stop::Reached, "end {k}"),
            }
        }
        let end = end.unwrap();
        let state = family.state(&end.x, to).unwrap();
        let alone = problem(to).unwrap().solve(None).unwrap();
        let apart = (state.end.position - alone.end.position).norm();
        assert!(apart < 1e-13, "end {k}: {apart:.1e}");
        let couple = (state.base - alone.base).fixed_rows::<3>(0).norm();
        assert!(couple < 1e-10 * 1e4, "end {k}: {couple:.1e}");
        assert_eq!((end.index, alone.index), (Some(0), 0), "end {k}");
        assert!(points < 600, "end {k}: {points} points");
    }
}

/// A straight rod that is pulled along and wound up: it buckles where its variation under the dead force is neutral.
/// Both charts, and a scan of the base wrench's determinant in between, at lam = 20. A clamped end that only turns:
/// |m| = 2 sqrt(B F) and a little more.
#[test]
fn a_wound_wire_buckles_where_the_base_wrench_says() {
    let rod = Rod::new(1.0, Linear::diagonal([1.1, 1.0], 0.75).unwrap()).unwrap();
    let problem = |angle: f64| {
        let end = EndConditions {
            orientation: turned(Vector3::z() * angle),
            ..EndConditions::load(Vector3::z() * 400.0, Vector3::zeros())
        };
        Problem::new(rod.clone(), end, 1e-13)
    };
    let first = problem(50.0).unwrap();
    let both = RodFamily::in_chart(problem, false, 6.0, BothEnds::new(&first, None));
    let base = RodFamily::in_chart(problem, false, 6.0, Spatial);
    let wound = |angle: f64| nalgebra::Vector6::new(0.0, 0.0, 0.75 * angle, 0.0, 0.0, 400.0);
    let scan = |family: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = (55.0, 55.248);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if family(middle) * family(low) > 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    };
    let of = |family: &dyn Family, x: nalgebra::DVector<f64>, angle: f64| {
        let at = family.linearised(&x, angle).unwrap();
        at.jacobian.determinant()
    };
    let by_both = scan(&|a| of(&both, both.unknowns(&wound(a), a).unwrap(), a));
    let by_base = scan(&|a| of(&base, base.unknowns(&wound(a), a).unwrap(), a));
    assert!((by_both - by_base).abs() < 1e-8, "{by_both} {by_base}");
    // Greenhill's couple of a rod with equal stiffnesses is a bound from below for the softer plane.
    assert!(0.75 * by_both > 2.0 * 400.0_f64.sqrt());
    assert_eq!(first.solve(None).unwrap().index, 0);
}

/// In a plane the unknowns are those of the plane: half as many, the same equilibria.
#[test]
fn branches_in_a_plane_stay_in_it() {
    let law = Linear::diagonal([1.0, 1.3], 0.8).and_then(|law| law.with_rest([0.4, 0.0], 0.0));
    let rod = Rod::new(1.0, law.unwrap()).unwrap();
    let problem = |p: f64| {
        let force = Vector3::new(0.0, 0.6, 0.8) * p;
        let end = EndConditions::load(force, Vector3::zeros());
        Ok(Problem::new(rod.clone(), end, 1e-12)?.with_path(Path::Planar))
    };
    let first: Problem = problem(1.0).unwrap();
    let start = first.solve(None).unwrap();
    let snaprod::rod::ProblemChart::Planar(plane) = first.choose_chart(None).unwrap().0 else {
        panic!("not planar");
    };
    let chart = BothEnds::new(&first, Some(plane));
    assert_eq!((chart.size(), BothEnds::new(&first, None).size()), (5, 9));
    let family = RodFamily::in_chart(problem, false, 1e6, chart);
    let x = family.unknowns(&start.base, 1.0).unwrap();
    let (specials, last, _) = followed(&family, x.clone(), options(1.0, 1e6, 1.2));
    assert_eq!((specials.len(), last), (0, 1e6));
    let alone = problem(1e6).unwrap().solve(None).unwrap();
    assert_eq!((alone.taken.path, alone.index), (Path::Planar, 0));
    assert!(alone.base[0].abs() > 1.0 && alone.base[1].abs().max(alone.base[2].abs()) < 1e-6);
    let spatial = Problem::new(
        rod.clone(),
        EndConditions::load(Vector3::new(0.0, 0.6, 0.8) * 1e6, Vector3::zeros()),
        1e-12,
    );
    let spatial = spatial.unwrap().solve(None).unwrap();
    assert!((spatial.end.position - alone.end.position).norm() < 1e-14);
}

/// A load that turns with the end has no better chart than the base wrench: the form with both ends is not used, where
/// branch points would be rounding artefacts.
#[test]
fn following_loads_stay_with_the_base_wrench() {
    let rod = Rod::new(1.0, Linear::diagonal([1.1, 1.0], 0.75).unwrap()).unwrap();
    let couple = Vector3::z() * 0.7;
    let problem = |p: f64| {
        Problem::new(
            rod.clone(),
            EndConditions::follower(Vector3::z() * p, couple),
            1e-12,
        )
    };
    let first = problem(1.0).unwrap();
    let start = first.solve(None).unwrap();
    let both = RodFamily::in_chart(problem, false, 150.0, BothEnds::new(&first, None));
    let x = both.unknowns(&start.base, 1.0).unwrap();
    assert_eq!(both.index(&x, 1.0).unwrap(), None);
    let (specials, last, _) = followed(&both, x, options(1.0, 150.0, 1.2));
    assert!(specials.is_empty() && last == 150.0, "{specials:?} {last}");
    let alone = problem(150.0).unwrap().solve(None).unwrap();
    assert!(!first.is_taut(&alone.base, &alone.end));
    let off = alone.base - nalgebra::Vector6::new(0.0, 0.0, 0.7, 0.0, 0.0, 150.0);
    assert!(off.norm() < 1e-9 && (alone.end.position.z - 1.0).abs() < 1e-12);
}
