//! Light rods under a distributed dead load, such as their weight, at rest and in motion; loads as tables along the
//! rod.

use crate::support::assert_close;
use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, AssemblyFamily, Attachment, Body, BodyMotion, Configuration, Joint, Link, LinkPoint,
};
use snaprod::body::{PointMass, RigidBody};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome, State};
use snaprod::rod::{DistributedLoad, EndConditions, Problem, Rod};
use snaprod::section::Linear;
use snaprod::solve::parametrised_problem::Family;

/// A rod with all six strains, bent and twisted at rest.
fn rod() -> Rod {
    let law = Linear::diagonal([1.0, 1.5], 0.8)
        .and_then(|law| law.with_shear([90.0, 110.0])?.with_axial(200.0))
        .and_then(|law| law.with_rest([0.3, -0.2], 0.4))
        .expect("a law");
    Rod::new(1.3, law).expect("a rod")
}

/// A load with a kink that is nowhere along a symmetry.
fn load() -> DistributedLoad {
    let rows = [
        (0.0, Vector3::new(0.3, -0.8, -0.2)),
        (0.35, Vector3::new(-0.4, -1.5, 0.5)),
        (1.0, Vector3::new(0.1, 0.2, -0.9)),
    ];
    let curved = vec![Vector3::x() * 0.2, Vector3::zeros(), Vector3::z() * 0.4];
    let table = DistributedLoad::table(&rows).expect("a table");
    table
        .plus(&DistributedLoad::polynomial(curved).expect("a polynomial"))
        .expect("a load")
}

fn solid() -> RigidBody {
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.2, 0.3, 0.25)));
    body.and_then(|body| body.with_centre(Vector3::new(0.05, -0.1, 0.08)))
        .and_then(|body| body.with_gravity(Vector3::new(0.1, 0.3, -1.2)))
        .expect("a body")
}

fn place(r: [f64; 3], turn: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
    Isometry3::from_parts(Vector3::from(r).into(), turn)
}

/// A body on a rod from the ground; the rod starts at the ground, or at the body, with a turning base.
fn one_body(begun_at_body: bool, joint: Joint) -> Assembly {
    let ground = Attachment::ground(place([0.2, -0.1, 0.3], [0.4, -0.7, 0.2]));
    let site = place([0.1, 0.05, -0.1], [0.2, 0.3, -0.4]);
    let link = match (begun_at_body, joint) {
        (false, _) => {
            Link::new(rod(), ground, Attachment::body(0, site), joint).with_distributed(load())
        }
        (true, Joint::Weld) => Link::reversed(&rod(), ground, Attachment::body(0, site), joint)
            .and_then(|link| link.with_distributed(load().reversed())),
        _ => unreachable!(),
    };
    let link = link.expect("a link");
    Assembly::new(vec![Body::rigid(solid())], vec![link]).expect("an assembly")
}

/// Configuration with the bodies at the given poses and the rods in equilibrium.
fn held(assembly: &Assembly, bodies: Vec<BodyMotion>) -> Configuration {
    let mut now = assembly.held(bodies, 1e-12);
    for (link, q) in assembly.links().iter().zip(&mut now.charts) {
        let point = link.point(0.0, &now.bodies, q, 1e-13).expect("a point");
        let seen = link.with_base_rotation(&point.base.pose.rotation);
        *q = seen.polished(q, &point.held(), 1e-13).expect("a chart");
    }
    now
}

/// The pose turned and moved aside.
fn beside(pose: &Isometry3<f64>, aside: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(
        (pose.translation.vector + aside.translation.vector).into(),
        aside.rotation * pose.rotation,
    )
}

fn points(assembly: &Assembly, now: &Configuration) -> Vec<LinkPoint> {
    let points = assembly.points(0.0, &now.bodies, &now.charts, 1e-13);
    points.expect("points")
}

fn states(
    assembly: &Assembly,
    start: &Configuration,
    end: f64,
    tolerance: f64,
) -> Vec<AssemblySample> {
    let options = Options::new(end).and_then(|o| o.with_tolerance(tolerance));
    let options = options.expect("options");
    let mut run = AssemblyRun::new(assembly.clone(), start, options).expect("a run");
    let mut states = vec![run.sample_now()];
    while let Some(event) = run.advance() {
        match event {
            Event::Step { .. } => states.push(run.sample_now()),
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            Event::Snap(_) => {}
            other => panic!("{other:?}"),
        }
    }
    states
}

fn ledger_is_closed(states: &[AssemblySample], within: f64) {
    let total = |state: &AssemblySample| state.ledger().total();
    let first = total(&states[0]);
    for state in states {
        let off = (total(state) - first).abs();
        assert!(
            off <= within,
            "t = {}: the ledger is {off:e} off",
            state.time()
        );
    }
}

/// One rod, started at its ground end or at its body end: relative to the ground its load is fixed, relative to the
/// body the load turns. Catches any error of a load in a turning base frame: in the end pose, in the couples and
/// forces at both ends, in the tangents, in the potential, in loads counted from the other end; out of equilibrium and
/// in motion.
#[test]
fn a_rod_begun_on_the_body_is_that_begun_on_the_ground() {
    let both = [false, true].map(|at_body| one_body(at_body, Joint::Weld));
    let found = both
        .each_ref()
        .map(|assembly| assembly.equilibrium(None, 1e-12).expect("an equilibrium"));
    let [a, b] = found.each_ref().map(|found| found.now.bodies[0].pose);
    assert!((a.inverse() * b).translation.vector.norm() < 1e-11);
    assert!(a.rotation.angle_to(&b.rotation) < 1e-11);
    assert_close(found[0].energy, found[1].energy, 1e-11, 1.0, "energy");
    assert_eq!(found[0].index, found[1].index);
    // Out of equilibrium nothing cancels.
    let aside = place([0.1, -0.15, 0.05], [0.3, 0.2, -0.25]);
    let pose = beside(&a, &aside);
    let twist = Vector6::new(0.4, -0.3, 0.5, 0.2, 0.1, -0.3);
    let starts = both
        .each_ref()
        .map(|assembly| held(assembly, vec![BodyMotion { pose, twist }]));
    let stiffness = [0, 1].map(|i| {
        let points = points(&both[i], &starts[i]);
        let balance = both[i].balance(0.0, &starts[i].bodies, &points);
        let stiffness = both[i].stiffness(0.0, &starts[i].bodies, &points);
        (balance, stiffness.expect("a stiffness").matrix)
    });
    let off = (&stiffness[0].0 - &stiffness[1].0).norm() / stiffness[0].0.norm();
    assert!(off < 1e-11, "balance: {off:e}");
    let off = (&stiffness[0].1 - &stiffness[1].1).norm() / stiffness[0].1.norm();
    assert!(off < 1e-9, "stiffness: {off:e}");
    let runs = [0, 1].map(|i| states(&both[i], &starts[i], 1.5, 1e-11));
    for run in &runs {
        ledger_is_closed(run, 1e-9);
    }
    let last = runs
        .each_ref()
        .map(|run| run.last().expect("a state").bodies()[0]);
    let off = (last[0].pose.translation.vector - last[1].pose.translation.vector).norm();
    assert!(off < 1e-9, "place after the motion: {off:e}");
    assert!((last[0].twist - last[1].twist).norm() < 1e-8);
    let potential = runs
        .each_ref()
        .map(|run| run.last().expect("a state").ledger().potential);
    assert_close(potential[0], potential[1], 1e-9, 1.0, "potential");
}

/// A loaded rod between two bodies, written in either direction. Both ends belong to bodies, so the stiffness includes
/// the effect of a turning base at both ends. For a rod started on the only body the couple at the other end does not
/// enter. Catches any error there, such as a load that turns along.
#[test]
fn a_loaded_rod_between_two_bodies_is_its_reverse() {
    let site = place([0.1, 0.05, -0.1], [0.2, 0.3, -0.4]);
    let chain = |backwards: bool| {
        let foot = Attachment::ground(place([0.2, -0.1, 0.3], [0.4, -0.7, 0.2]));
        let held = Link::new(rod(), foot, Attachment::body(0, site), Joint::Weld);
        let far = place([-0.05, 0.1, 0.02], [-0.3, 0.1, 0.2]);
        let ends = (Attachment::body(0, site), Attachment::body(1, far));
        let middle = if !backwards {
            Link::new(rod(), ends.0, ends.1, Joint::Weld).with_distributed(load())
        } else {
            Link::reversed(&rod(), ends.0, ends.1, Joint::Weld)
                .and_then(|link| link.with_distributed(load().reversed()))
        };
        let bodies = [solid(), solid()].map(Body::rigid);
        Assembly::new(bodies.into(), vec![held, middle.expect("a link")]).expect("an assembly")
    };
    let both = [false, true].map(chain);
    let found = both
        .each_ref()
        .map(|assembly| assembly.equilibrium(None, 1e-12).expect("an equilibrium"));
    for (a, b) in found[0].now.bodies.iter().zip(&found[1].now.bodies) {
        let apart = a.pose.translation.vector - b.pose.translation.vector;
        assert!(apart.norm() < 1e-11, "{:e}", apart.norm());
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-11);
    }
    assert_close(found[0].energy, found[1].energy, 1e-11, 1.0, "energy");
    // Out of equilibrium nothing cancels.
    let asides = [
        place([0.1, -0.15, 0.05], [0.3, 0.2, -0.25]),
        place([-0.05, 0.1, 0.12], [-0.2, 0.25, 0.3]),
    ];
    let off = found[0].now.bodies.iter().zip(&asides);
    let places = off.map(|(body, aside)| BodyMotion::at_rest(beside(&body.pose, aside)));
    let places: Vec<BodyMotion> = places.collect();
    let [one, other] = both.each_ref().map(|assembly| {
        let now = held(assembly, places.clone());
        let points = points(assembly, &now);
        let balance = assembly.balance(0.0, &now.bodies, &points);
        let stiffness = assembly.stiffness(0.0, &now.bodies, &points);
        (balance, stiffness.expect("a stiffness").matrix)
    });
    let off = (&one.0 - &other.0).norm() / one.0.norm();
    assert!(off < 1e-11, "balance: {off:e}");
    let off = (&one.1 - &other.1).norm() / one.1.norm();
    assert!(off < 1e-9, "stiffness: {off:e}");
}

/// The rod at rest under its load, with the body, agrees with statics; a motion started there stays there; small
/// motions have the frequencies given by static equilibria under small forces and couples. Catches a load applied at
/// one point of the rod.
#[test]
fn rest_and_small_motions_are_those_of_statics() {
    let ground = place([0.2, -0.1, 0.3], [0.4, -0.7, 0.2]);
    let clamped = rod().with_clamp(ground.translation.vector, ground.rotation);
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.2, 0.3, 0.25)))
        .and_then(|body| body.with_gravity(Vector3::new(0.1, 0.3, -1.2)))
        .expect("a body");
    let solved = |wrench: Vector6<f64>| {
        let (couple, force) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
        let force = Vector3::new(0.1, 0.3, -1.2) + force;
        let end = EndConditions::load(force, couple.into_owned());
        let problem = Problem::new(clamped.clone(), end, 1e-13).expect("a problem");
        problem
            .with_distributed(&load())
            .solve(None)
            .expect("an equilibrium")
    };
    let link = Link::new(
        rod(),
        Attachment::ground(ground),
        Attachment::body(0, Isometry3::identity()),
        Joint::Weld,
    );
    let link = link.with_distributed(load()).expect("a link");
    let assembly = Assembly::new(vec![Body::rigid(body)], vec![link]).expect("an assembly");
    let rest = assembly.equilibrium(None, 1e-12).expect("an equilibrium");
    let want = solved(Vector6::zeros());
    let at = rest.now.bodies[0].pose;
    assert!((at.translation.vector - want.end.position).norm() < 1e-11);
    assert_eq!(rest.index, want.index);
    for state in states(&assembly, &rest.now, 5.0, 1e-11) {
        let off = (state.bodies()[0].pose.translation.vector - at.translation.vector).norm();
        assert!(off < 1e-10, "t = {}: {off:e} off", state.time());
    }
    // The compliance by differences of statics.
    let step = 1e-4;
    let compliance = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|j| {
        let [ahead, behind] = [step, -step].map(|h| solved(Vector6::ith(j, h)).end.pose());
        let turn = (ahead.rotation * behind.rotation.inverse()).scaled_axis();
        let way = ahead.translation.vector - behind.translation.vector;
        Vector6::new(turn.x, turn.y, turn.z, way.x, way.y, way.z) / (2.0 * step)
    }));
    let turn = at.rotation.to_rotation_matrix();
    let mut mass = Matrix6::identity();
    let inertia = turn.matrix()
        * Matrix3::from_diagonal(&Vector3::new(0.2, 0.3, 0.25))
        * turn.matrix().transpose();
    mass.fixed_view_mut::<3, 3>(0, 0).copy_from(&inertia);
    let squares = (compliance * mass).complex_eigenvalues();
    let mut want: Vec<f64> = squares.iter().map(|x| (1.0 / x.re).sqrt()).collect();
    want.sort_by(f64::total_cmp);
    let modes = assembly.modes(&rest.now, 1e-12).expect("modes");
    assert!(modes.stable);
    for (got, want) in modes.frequencies.iter().zip(&want) {
        assert_close(*got, *want, 1e-6, *want, "frequency");
    }
}

/// Two bodies far from other objects, joined by a loaded rod: the total load changes their momenta, about every axis.
/// Catches a load lost between the rod and its ends, in position or in motion.
#[test]
fn the_load_on_a_rod_between_free_bodies_moves_their_momenta() {
    let free = |inertia: [f64; 3]| {
        RigidBody::new(1.0, Matrix3::from_diagonal(&inertia.into())).expect("a body")
    };
    let bodies = [free([0.2, 0.3, 0.25]), free([0.15, 0.1, 0.2])];
    let site = place([0.1, 0.2, -0.1], [0.4, 0.1, -0.3]);
    let link = Link::new(
        rod(),
        Attachment::body(0, site),
        Attachment::body(1, Isometry3::identity()),
        Joint::Weld,
    );
    let link = link.with_distributed(load()).expect("a link");
    let carriers = bodies.iter().cloned().map(Body::rigid).collect();
    let first = place([0.0; 3], [0.3, -0.5, 0.2]);
    let end = link
        .with_base_rotation(&(first * site).rotation)
        .end(&Vector6::zeros(), 1e-14)
        .expect("an end");
    let start = Configuration {
        bodies: vec![
            BodyMotion {
                pose: first,
                twist: Vector6::new(0.6, -0.4, 0.3, 0.1, 0.2, -0.3),
            },
            BodyMotion {
                pose: first * site * end.pose,
                twist: Vector6::new(-0.5, 0.7, 0.2, 0.4, -0.1, 0.2),
            },
        ],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let assembly = Assembly::new(carriers, vec![link]).expect("an assembly");
    let states = states(&assembly, &start, 1.5, 1e-11);
    ledger_is_closed(&states, 1e-9);
    let total = load().total(1.3);
    let momentum = |state: &AssemblySample| {
        let each = state.bodies().iter();
        each.map(|place| place.twist.fixed_rows::<3>(3).into_owned())
            .sum::<Vector3<f64>>()
    };
    for state in &states {
        let want = momentum(&states[0]) + total * state.time();
        let off = (momentum(state) - want).norm();
        assert!(
            off < 1e-9,
            "t = {}: the momentum is {off:e} off",
            state.time()
        );
    }
    // Moments about the origin, integrated along the rod by Simpson's rule on each side of the load's kink.
    let now = &states[states.len() / 2];
    let sections = |s: &[f64]| now.rod_sections(0, s);
    let base = now.bodies()[0].pose * site;
    let moment = |s: f64, position: Vector3<f64>| {
        let r = base * nalgebra::Point3::from(position);
        r.coords.cross(&load().density(s)) * 1.3
    };
    let mut want = Vector3::zeros();
    for (from, to) in [(0.0, 0.35), (0.35, 1.0)] {
        let n: i32 = 200;
        let s: Vec<f64> = (0..=n)
            .map(|i| from + (to - from) * f64::from(i) / f64::from(n))
            .collect();
        for (i, (s, at)) in s.iter().zip(sections(&s)).enumerate() {
            let weight = if i == 0 || i == 200 {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
            want += moment(*s, at.position) * (weight * (to - from) / (3.0 * f64::from(n)));
        }
    }
    let points = &now.at.points;
    let wrenches = assembly.wrenches(now.bodies(), points);
    let got: Vector3<f64> = wrenches
        .iter()
        .zip(now.bodies())
        .map(|(w, place)| {
            let (m, n) = (
                w.fixed_rows::<3>(0).into_owned(),
                w.fixed_rows::<3>(3).into_owned(),
            );
            m + place.pose.translation.vector.cross(&n)
        })
        .sum();
    assert!((got - want).norm() < 1e-9, "moments: {got} {want}");
}

/// A point mass on a ball joint under the weight of its rod: the chart without end couple. Catches the rows of m(1) in
/// tangents and drive of a turning base.
#[test]
fn a_ball_joint_bears_no_couple_under_a_load() {
    let ground = place([0.0; 3], [0.4, -0.7, 0.2]);
    let bodies = vec![
        Body::rigid(solid()),
        Body::point(
            PointMass::new(0.7)
                .and_then(|b| b.with_gravity(Vector3::new(0.0, 0.2, -0.5)))
                .expect("a body"),
        ),
    ];
    let whole = Isometry3::identity();
    let links = vec![
        Link::new(
            rod(),
            Attachment::ground(ground),
            Attachment::body(0, whole),
            Joint::Weld,
        ),
        Link::new(
            rod(),
            Attachment::body(0, place([0.1, 0.0, 0.1], [0.5, 0.2, 0.1])),
            Attachment::body(1, whole),
            Joint::Ball,
        ),
    ];
    let links = links
        .into_iter()
        .map(|link| link.with_distributed(load()).expect("a link"));
    let assembly = Assembly::new(bodies, links.collect()).expect("an assembly");
    let rest = assembly.equilibrium(None, 1e-12).expect("an equilibrium");
    let mut start = rest.now.clone();
    start.bodies[0].twist = Vector6::new(0.5, -0.4, 0.3, 0.2, 0.1, -0.1);
    start.bodies[1].twist = Vector6::new(0.0, 0.0, 0.0, -0.3, 0.2, 0.1);
    let states = states(&assembly, &start, 1.5, 1e-11);
    ledger_is_closed(&states, 1e-9);
    let last = states.last().expect("a state");
    assert!(last.at.points[1].end.couple.norm() < 1e-9);
    assert!(last.drift() < 1e-9);
    // The stiffness, twice: by tangents, and by differences of the balance.
    let points = points(&assembly, &rest.now);
    let stiffness = assembly
        .stiffness(0.0, &rest.now.bodies, &points)
        .expect("a stiffness");
    // Branch in the size of the load, starting from none: the slope by the parameter against residuals.
    let over = |p: f64| {
        let links = assembly.links().iter();
        let links = links.map(|link| {
            let bare = Link::new(
                link.rod().clone(),
                link.from().clone(),
                link.to().clone(),
                link.joint(),
            );
            match p {
                0.0 => Ok(bare),
                p => bare.with_distributed(load().mapped(|f| f * p)),
            }
        });
        Assembly::new(
            assembly.carriers().to_vec(),
            links.collect::<Result<_, _>>()?,
        )
    };
    let family = AssemblyFamily::new(over, &rest.now, 0.0, false, 1.0, 1e-13).expect("a family");
    let x = family.unknowns(&rest.now, 0.0).expect("unknowns");
    let at = |p: f64| family.linearised(&x, p).expect("a point");
    for p in [0.0, 0.7] {
        let want = (at(p + 1e-3).residual - at(p - 1e-3).residual) / 2e-3;
        let off = (at(p).slope - &want).norm() / want.norm();
        assert!(off < 1e-6, "the slope at {p} is {off:e} off");
    }
    let asymmetry =
        (&stiffness.matrix - stiffness.matrix.transpose()).norm() / stiffness.matrix.norm();
    assert!(asymmetry < 1e-10, "{asymmetry:e}");
}
