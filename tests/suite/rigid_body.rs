//! Body at the rod's end: equations of motion, derivatives, energy.

use crate::support::assert_close;
use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use snaprod::body::{EndBody, History, PointMass, RigidBody, Support, TimeLoad};

fn inertia() -> Matrix3<f64> {
    Matrix3::new(0.7, 0.1, -0.05, 0.1, 0.9, 0.2, -0.05, 0.2, 1.1)
}

/// The angular momentum of a rotor in the body.
fn rotor() -> Vector3<f64> {
    Vector3::new(0.4, -0.6, 0.5)
}

fn body() -> RigidBody {
    RigidBody::new(1.3, inertia())
        .and_then(|b| b.with_centre(Vector3::new(0.3, -0.2, 0.4)))
        .and_then(|b| b.with_gravity(Vector3::new(0.0, 1.0, -9.81)))
        .and_then(|b| b.with_dead_force(Vector3::new(0.5, 0.1, 0.2)))
        .and_then(|b| b.with_dead_couple(Vector3::new(-0.3, 0.2, 0.6)))
        .and_then(|b| b.with_drag(0.4))
        .and_then(|b| b.with_rotational_drag(0.25))
        .and_then(|b| b.with_rotor(rotor()))
        .expect("a body")
        .with_force(TimeLoad::sine(Vector3::new(1.0, -2.0, 0.5), 3.0, 0.2).unwrap())
        .with_follower_force(TimeLoad::sine(Vector3::new(-0.7, 0.4, 1.1), 2.2, 0.9).unwrap())
        .with_follower_couple(TimeLoad::sine(Vector3::new(0.2, 0.9, -0.5), 1.3, 0.5).unwrap())
}

/// Force and couple of the loads that turn with the body, in the world frame.
fn following(t: f64, turn: &UnitQuaternion<f64>) -> [Vector3<f64>; 2] {
    let force = Vector3::new(-0.7, 0.4, 1.1) * (2.2 * t + 0.9f64).sin();
    let couple = Vector3::new(0.2, 0.9, -0.5) * (1.3 * t + 0.5f64).sin();
    [turn * force, turn * couple]
}

fn pose() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.2, -0.5, 0.9),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.9, 1.3)),
    )
}

/// The pose moved by a twist (dphi, dr) in the world frame.
fn moved(pose: &Isometry3<f64>, twist: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(0).into_owned());
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + twist.fixed_rows::<3>(3)),
        turn * pose.rotation,
    )
}

fn state() -> (f64, Isometry3<f64>, Vector6<f64>, Vector6<f64>) {
    (
        0.7,
        pose(),
        Vector6::new(0.8, -1.1, 0.6, 0.3, 0.9, -0.4),
        Vector6::new(1.2, 0.4, -0.9, 2.0, -1.5, 0.7),
    )
}

/// Six-point central differences of f along the six directions, as columns.
fn jacobian(f: impl Fn(&Vector6<f64>) -> Vector6<f64>) -> Matrix6<f64> {
    let h = 1e-2;
    let columns: Vec<Vector6<f64>> = (0..6)
        .map(|j| {
            let odd = |k: f64| {
                let mut step = Vector6::zeros();
                step[j] = k * h;
                f(&step) - f(&-step)
            };
            (odd(1.0) * 45.0 - odd(2.0) * 9.0 + odd(3.0)) / (60.0 * h)
        })
        .collect();
    Matrix6::from_columns(&columns)
}

/// Catches a wrong or missing term of AMV (2.15), (2.16): linear and angular momentum, including a rotor's,
/// differentiated numerically along the motion itself, against the loads; also the sign of the rod's wrench.
#[test]
fn momenta_change_as_the_loads_say() {
    let (body, (t, pose, v, rod)) = (body(), state());
    let motion = body.motion(t, &pose, &v, &rod);
    let along = |h: f64| {
        // Second order in h suffices for the first derivative of momentum at 0 by symmetric differences.
        let v1 = v + motion.acceleration * h;
        let pose1 = moved(&pose, &(v * h + motion.acceleration * (0.5 * h * h)));
        let r = pose1.rotation.to_rotation_matrix().into_inner();
        let omega = v1.fixed_rows::<3>(0).into_owned();
        let c = r * Vector3::new(0.3, -0.2, 0.4);
        let momentum = (v1.fixed_rows::<3>(3) + omega.cross(&c)) * 1.3;
        let turning = r * (inertia() * (r.transpose() * omega) + rotor());
        (momentum, turning, c, omega)
    };
    let h = 1e-4;
    let ((p1, l1, ..), (p0, l0, ..)) = (along(h), along(-h));
    let (p, _, c, omega) = along(0.0);
    let (m, n) = (rod.fixed_rows::<3>(0), rod.fixed_rows::<3>(3));
    let drive = Vector3::new(1.0, -2.0, 0.5) * (3.0 * t + 0.2f64).sin();
    let centre = p / 1.3;
    let [push, twist] = following(t, &pose.rotation);
    let force = n + Vector3::new(0.5, 1.4, 0.2 - 1.3 * 9.81) - centre * 0.4 + drive + push;
    let couple = m - c.cross(&n) + Vector3::new(-0.3, 0.2, 0.6) + twist - omega * 0.25;
    for k in 0..3 {
        assert_close((p1 - p0)[k] / (2.0 * h), force[k], 1e-6, 1.0, "force");
        assert_close((l1 - l0)[k] / (2.0 * h), couple[k], 1e-6, 1.0, "couple");
    }
    let power = (drive + push).dot(&centre) + (Vector3::new(-0.3, 0.2, 0.6) + twist).dot(&omega);
    assert_close(motion.power, power, 1e-13, 1.0, "power");
    let loss = 0.4 * centre.norm_squared() + 0.25 * omega.norm_squared();
    assert_close(motion.loss, loss, 1e-13, 1.0, "loss");
    // d(kinetic + potential)/dt = rod . V + power - loss.
    let energy = |h: f64| {
        let pose1 = moved(&pose, &(v * h + motion.acceleration * (0.5 * h * h)));
        let v1 = v + motion.acceleration * h;
        body.kinetic(t, &pose1, &v1) + body.potential(t, &pose1)
    };
    let rate = (energy(h) - energy(-h)) / (2.0 * h);
    let want = rod.dot(&v) + motion.power - motion.loss;
    assert_close(rate, want, 1e-6, 1.0, "energy");
}

/// The body of the tests on a clamp that is offset and tilted, moves and turns.
fn carried() -> (RigidBody, Support<3>) {
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, -0.2));
    let clamp = Support::<3>::new(Vector3::new(0.4, -0.3, 0.1), &tilt)
        .and_then(|s| {
            s.with_translation(Vector3::new(0.3, 0.5, -1.0), History::sine(0.4, 2.0, 0.3))
        })
        .and_then(|s| s.with_turning(&Vector3::new(1.0, -2.0, 0.5), History::sine(0.9, 1.5, 0.6)))
        .expect("a clamp");
    let couple = TimeLoad::sine(Vector3::new(0.5, 0.1, -0.4), 1.7, 0.2).expect("a couple");
    let body = body().with_couple(couple).with_support(clamp.clone());
    (body, clamp)
}

/// Catches a wrong term of the motion relative to a moving clamp. The motion to second order in time is mapped to the
/// world by the clamp's pose alone. There it must have the momenta given by the loads, and the energy supplied by the
/// rod, the loads and the clamp.
#[test]
fn a_body_on_a_moving_clamp_obeys_the_laws_of_the_world() {
    let (body, clamp) = carried();
    let (t, pose, v, rod) = state();
    let motion = body.motion(t, &pose, &v, &rod);
    let seen = |h: f64| moved(&pose, &(v * h + motion.acceleration * (0.5 * h * h)));
    let world = |h: f64| clamp.pose(t + h) * seen(h);
    let offset = Vector3::new(0.3, -0.2, 0.4);
    let centre = |h: f64| world(h) * nalgebra::Point3::from(offset);
    let h = 1e-3;
    let now = world(0.0);
    let turn = clamp.pose(t).rotation;
    let half = |k: usize| turn * rod.fixed_rows::<3>(k).into_owned();
    let (m, n, c) = (half(0), half(3), now.rotation * offset);
    // Velocities between the moments, by differences.
    let (ahead, behind) = (
        (centre(h) - centre(0.0)) / h,
        (centre(0.0) - centre(-h)) / h,
    );
    let speed = (ahead + behind) * 0.5;
    let drive = Vector3::new(1.0, -2.0, 0.5) * (3.0 * t + 0.2f64).sin();
    let [push, twist] = following(t, &now.rotation);
    let force = n + Vector3::new(0.5, 1.4, 0.2 - 1.3 * 9.81) - speed * 0.4 + drive + push;
    let spin =
        |a: f64, b: f64| (world(b).rotation * world(a).rotation.inverse()).scaled_axis() / (b - a);
    let moment = |a: f64, b: f64| {
        let r = world(0.5 * (a + b)).rotation.to_rotation_matrix();
        r * (inertia() * (r.inverse() * spin(a, b)) + rotor())
    };
    let omega = spin(-h, h);
    let more = Vector3::new(0.5, 0.1, -0.4) * (1.7 * t + 0.2f64).sin();
    let dead = Vector3::new(-0.3, 0.2, 0.6);
    let couple = m - c.cross(&n) + dead + more + twist - omega * 0.25;
    let (momentum, turning) = (
        (ahead - behind) * (1.3 / h),
        (moment(0.0, h) - moment(-h, 0.0)) / h,
    );
    for k in 0..3 {
        assert_close(momentum[k], force[k], 1e-5, 1.0, "force");
        assert_close(turning[k], couple[k], 1e-5, 1.0, "couple");
    }
    let energy = |h: f64| {
        let (pose, v) = (seen(h), v + motion.acceleration * h);
        body.kinetic(t + h, &pose, &v) + body.potential(t + h, &pose)
    };
    let rate = (energy(h) - energy(-h)) / (2.0 * h);
    let want = rod.dot(&v) + motion.power - motion.loss;
    assert_close(rate, want, 1e-5, 1.0, "energy");
    // The rotor's own energy is constant, and is not counted.
    let moment = moment(-h, h) - now.rotation * rotor();
    let kinetic = 0.5 * (1.3 * speed.norm_squared() + omega.dot(&moment));
    assert_close(body.kinetic(t, &pose, &v), kinetic, 1e-5, 1.0, "kinetic");
}

/// Catches a wrong entry in the derivatives that an implicit integrator uses, on a fixed and on a moving clamp.
#[test]
fn derivatives_agree_with_differences() {
    for body in [body(), carried().0] {
        derivatives_of(&body);
    }
}

fn derivatives_of(body: &RigidBody) {
    let (t, pose, v, rod) = state();
    let linear = body.linearised(t, &pose, &v, &rod);
    let cases = [
        (
            "by pose",
            linear.by_pose,
            jacobian(|d| body.motion(t, &moved(&pose, d), &v, &rod).acceleration),
        ),
        (
            "by velocity",
            linear.by_velocity,
            jacobian(|d| body.motion(t, &pose, &(v + d), &rod).acceleration),
        ),
        (
            "by wrench",
            linear.by_wrench,
            jacobian(|d| body.motion(t, &pose, &v, &(rod + d)).acceleration),
        ),
    ];
    for (what, got, want) in cases {
        assert!(
            (got - want).amax() <= 1e-10 * want.amax(),
            "{what}: {got} {want}"
        );
    }
    let mass = linear.by_wrench;
    assert!((mass - mass.transpose()).amax() < 1e-14 && mass.cholesky().is_some());
}

/// Catches a ball joint that feels couples, or takes the pose for the position.
#[test]
fn a_point_mass_on_a_ball_joint_is_a_body() {
    let body = PointMass::<3>::new(2.0)
        .and_then(|b| b.with_gravity(Vector3::new(0.0, 0.0, -3.0)))
        .and_then(|b| b.with_drag(0.5))
        .expect("a body");
    let (v, rod) = (Vector3::new(1.0, 2.0, -1.0), Vector3::new(0.4, 0.0, 1.0));
    let end: &dyn EndBody<3, Pose = Isometry3<f64>> = &body;
    let motion = end.motion(0.0, &pose(), &v, &rod);
    let want = (rod - v * 0.5) / 2.0 + Vector3::new(0.0, 0.0, -3.0);
    assert!((motion.acceleration - want).amax() < 1e-15);
    assert_close(
        end.potential(0.0, &pose()),
        2.0 * 3.0 * 0.9,
        1e-15,
        1.0,
        "potential",
    );
    assert_close(end.kinetic(0.0, &pose(), &v), 6.0, 1e-15, 1.0, "kinetic");
    let linear = end.linearised(0.0, &pose(), &v, &rod);
    assert_eq!(linear.by_pose, Matrix3::zeros());
    assert_eq!(linear.by_velocity, Matrix3::identity() * -0.25);
    assert_eq!(linear.by_wrench, Matrix3::identity() * 0.5);
}

/// Catches an accepted NaN, negative drag, or impossible inertia.
#[test]
fn faults_are_refused() {
    let nan = Vector3::new(0.0, f64::NAN, 0.0);
    let free = || RigidBody::new(1.0, inertia()).expect("a body");
    for (fault, word) in [
        (RigidBody::new(0.0, inertia()), "mass"),
        (RigidBody::new(1.0, -inertia()), "inertia"),
        (RigidBody::new(1.0, inertia() * f64::NAN), "inertia"),
        (
            RigidBody::new(1.0, Matrix3::new(1., 0.1, 0., 0., 1., 0., 0., 0., 1.)),
            "symmetric",
        ),
        (free().with_centre(nan), "centre"),
        (free().with_gravity(nan), "gravity"),
        (free().with_dead_force(nan), "force"),
        (free().with_dead_couple(nan), "couple"),
        (free().with_drag(-1.0), "drag"),
        (free().with_rotational_drag(f64::NAN), "rotational drag"),
    ] {
        let fault = fault.expect_err(word);
        assert!(
            fault.is_domain() && fault.to_string().contains(word),
            "{fault}"
        );
    }
}

/// Catches a box drawn for a body with another inertia: the moments of a box are m (b^2 + c^2)/3.
#[test]
fn a_body_is_drawn_as_the_box_of_its_inertia() {
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2))
        .to_rotation_matrix();
    let (half, mass): (Vector3<f64>, f64) = (Vector3::new(0.4, 0.1, 0.7), 2.5);
    let moments = Vector3::new(
        half.y.powi(2) + half.z.powi(2),
        half.x.powi(2) + half.z.powi(2),
        half.x.powi(2) + half.y.powi(2),
    ) * (mass / 3.0);
    let inertia = turn.matrix() * Matrix3::from_diagonal(&moments) * turn.matrix().transpose();
    let edges = RigidBody::new(mass, inertia).expect("a body").equal_box();
    // e e^T, summed over the half edges, does not depend on their order and sign.
    let want = turn.matrix()
        * Matrix3::from_diagonal(&half.component_mul(&half))
        * turn.matrix().transpose();
    assert!((edges * edges.transpose() - want).norm() < 1e-14, "{edges}");
}
