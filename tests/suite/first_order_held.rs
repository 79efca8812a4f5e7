//! First-order mass of rods in space on moving supports, in grooves, and with nonlinear section laws (theory 3.9).

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use snaprod::assembly::{
    Assembly, Attachment, Body, BodyMotion, Configuration, Joint, LightRod, Link,
};
use snaprod::body::{Groove, History, RigidBody, Support};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Motion, Options, State};
use snaprod::rod::{DistributedLoad, EndConditions, Problem, Rod, SectionMass};
use snaprod::section::{Barrier, Linear};

fn linear() -> Linear {
    let law = Linear::diagonal([1.0, 2.0], 0.8).unwrap();
    let law = law.with_shear([40.0, 50.0]).unwrap();
    let law = law.with_axial(100.0).unwrap();
    law.with_rest([0.4, -0.3], 0.5).unwrap()
}

/// A bent rod from an attachment of given initial pose to a rigid body, under a dead load along the rod.
fn held(
    rod: &Rod,
    from: (Attachment, Isometry3<f64>),
    twist: [f64; 6],
) -> (Body, Link, Configuration) {
    let (from, base) = from;
    let load = DistributedLoad::constant(Vector3::new(0.3, -0.2, 0.5)).unwrap();
    let q = Vector6::new(0.4, -0.3, 0.2, 0.5, 0.6, -0.7);
    let clamped = rod
        .clone()
        .with_clamp(base.translation.vector, base.rotation);
    let problem = Problem::new(
        clamped.clone(),
        EndConditions::load(Vector3::zeros(), Vector3::zeros()),
        1e-13,
    );
    let problem = problem.unwrap().with_distributed(&load);
    let end = problem
        .sections(&clamped.outward_wrench(&q), &[1.0])
        .unwrap()[0]
        .pose();
    let arm = Isometry3::new(Vector3::new(0.1, 0.05, -0.02), Vector3::new(0.1, -0.4, 0.2));
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.15));
    let body = RigidBody::new(1.0, inertia).unwrap();
    let body = body.with_centre(Vector3::new(0.05, -0.02, 0.03)).unwrap();
    let link = Link::new(rod.clone(), from, Attachment::body(0, arm), Joint::Weld);
    let link = link.with_distributed(load).unwrap();
    let now = Configuration {
        bodies: vec![BodyMotion {
            pose: end * arm.inverse(),
            twist: Vector6::from(twist),
        }],
        charts: vec![q],
        spins: Vec::new(),
    };
    (Body::rigid(body), link, now)
}

const TWIST: [f64; 6] = [-0.6, -0.2, 0.4, -0.2, 0.1, 0.3];

/// The first state and the last, with a rod of a fifth of the body's mass.
fn followed(
    (carrier, link, now): (Body, Link, Configuration),
    duration: f64,
) -> [AssemblySample; 2] {
    let light = LightRod {
        sections: SectionMass {
            mass: 0.2,
            rotary: Vector3::new(1e-3, 2e-3, 3e-3),
        },
        followed: false,
    };
    let assembly = Assembly::new(vec![carrier], vec![link]).unwrap();
    let assembly = assembly.with_light_rods(vec![Some(light)]).unwrap();
    let options = Options::new(duration)
        .unwrap()
        .with_tolerance(1e-10)
        .unwrap();
    let mut run = AssemblyRun::new(assembly, &now, options).unwrap();
    let first = run.sample_now();
    while run.advance().is_some() {}
    let last = run.sample_now();
    let felt = last.ledger.rod_kinetic;
    assert!(
        felt > 1e-3 && (felt / first.ledger.rod_kinetic - 1.0).abs() > 0.1,
        "{felt}"
    );
    [first, last]
}

/// Error of the ledger, and the work.
fn open([first, last]: &[AssemblySample; 2]) -> (f64, f64) {
    let change = last.ledger.total() - first.ledger.total();
    (change, last.ledger.work)
}

/// Catches inertia without the support's acceleration, and a support without the reaction: the ledger closes, with the
/// work of a support that shakes and turns.
#[test]
fn supports_that_move_do_the_work_of_what_the_rods_gain() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2));
    let support = Support::<3>::new(Vector3::new(0.2, -0.1, 0.3), &turn).unwrap();
    let support = support
        .with_translation(Vector3::new(1.0, -0.5, 0.7), History::sine(0.1, 5.0, 0.4))
        .unwrap()
        .with_turning(&Vector3::new(0.2, 1.0, -0.4), History::sine(0.3, 4.0, 0.9))
        .unwrap();
    let place = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.3, 0.1, 0.2));
    let base = support.pose(0.0) * place;
    let mut site = Attachment::support(support);
    site.place = place;
    let rod = Rod::new(1.2, linear()).unwrap();
    let found = followed(held(&rod, (site, base), TWIST), 0.6);
    let (error, work) = open(&found);
    assert!(work.abs() > 0.05, "{work}");
    assert!(error.abs() < 1e-10, "{error:e}");
}

/// Catches velocities not taken relative to the support: uniform motion of the support is equivalent to rest on the
/// ground.
#[test]
fn uniform_motion_is_not_felt() {
    let v = Vector3::new(0.4, -0.3, 0.5);
    let rod = Rod::new(1.2, linear()).unwrap();
    let here = Isometry3::identity();
    let standing = followed(held(&rod, (Attachment::ground(here), here), TWIST), 0.4);
    let support = Support::<3>::new(Vector3::zeros(), &UnitQuaternion::identity()).unwrap();
    let support = support
        .with_translation(v, History::Rate { rate: 1.0 })
        .unwrap();
    let mut start = held(&rod, (Attachment::support(support), here), TWIST);
    let mut twist = start.2.bodies[0].twist.fixed_rows_mut::<3>(3);
    twist += v;
    let moving = followed(start, 0.4);
    let [a, b] = [&standing[1], &moving[1]].map(|sample| sample.bodies()[0]);
    let apart = b.pose.translation.vector - a.pose.translation.vector - v * 0.4;
    assert!(apart.norm() < 1e-10, "{apart:e}");
    assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-10);
    let (error, work) = open(&moving);
    assert!(work.abs() > 0.05 && error.abs() < 1e-10, "{work} {error:e}");
}

/// Catches inertia that moves a body across the groove, or ignores the groove's curvature.
#[test]
fn grooves_do_no_work() {
    let rod = Rod::new(1.2, linear()).unwrap();
    let here = Isometry3::identity();
    let (carrier, link, mut now) = held(&rod, (Attachment::ground(here), here), TWIST);
    let place = now.bodies[0].pose.translation.vector;
    let (out, along) = (Vector3::new(0.6, 0.0, 0.8), Vector3::y());
    let groove = Groove::circle(place - out * 0.5, out.cross(&along), 0.5, Some(out)).unwrap();
    now.bodies[0].twist = Vector6::new(-0.6, -0.2, 0.4, 0.0, 0.9, 0.0);
    let found = followed((carrier.in_groove(groove), link, now), 0.2);
    let (error, _) = open(&found);
    assert!(error.abs() < 1e-10, "{error:e}");
    let end = found[1].bodies()[0].pose.translation.vector;
    assert!(((end - place + out * 0.5).norm() - 0.5).abs() < 1e-12);
    assert!((end - place).norm() > 0.03);
}

/// Catches a nonlinear law treated as linear: the compliance changes during the motion, and enters the energy.
#[test]
fn laws_need_not_be_linear() {
    let law = Barrier::new(linear(), [0.3, 0.4], 2.0).unwrap();
    let rod = Rod::new(1.2, law).unwrap();
    let here = Isometry3::identity();
    let found = followed(held(&rod, (Attachment::ground(here), here), TWIST), 0.6);
    let (error, _) = open(&found);
    assert!(error.abs() < 1e-10, "{error:e}");
    // The nonlinearity matters: the linear law leads to another end.
    let rod = Rod::new(1.2, linear()).unwrap();
    let other = followed(held(&rod, (Attachment::ground(here), here), TWIST), 0.6);
    let [a, b] = [&found[1], &other[1]].map(|sample| sample.bodies()[0].pose.translation.vector);
    assert!((a - b).norm() > 1e-3);
}
