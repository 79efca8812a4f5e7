//! Starts on clamps that move at t = 0, and starts at rest under loads.

use crate::support::assert_close;
use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, UnitQuaternion, Vector3, vector};
use snaprod::body::{EndBody, EndLinear, EndMotion};
use snaprod::motion::Options;
use snaprod::motion::viscoelastic::{ViscousRun, ViscousStart};
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table};
use snaprod::viscoelastic::kinematics::Local;
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::space::Space;

/// A rod in the plane, and one in space whose z and x axes are the plane's x and y.
const PLANE: &str = r#"[rod]
model = "elastica"
length = 2.0
bending_stiffness = 3.0
damping = { proportional = 0.05 }
[body]
mass = 1.5
[run]
duration = 1.0
tolerance = 1e-11
samples = 2
"#;
const SPACE: &str = r#"[rod]
model = "cosserat"
length = 2.0
damping = { proportional = 0.05 }
[rod.section]
bending = [3.0, 3.0]
torsion = 2.0
[body]
mass = 1.5
joint = "ball"
[run]
duration = 1.0
tolerance = 1e-11
samples = 2
"#;

fn prepared(text: &str) -> snaprod::Result<Prepared> {
    Prepared::new(&Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}")))
}

/// Runs a scene whose ledger must close.
fn recorded(text: &str) -> RunRecord {
    let mut tables: Vec<Table> = Vec::new();
    let prepared = prepared(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    let (error, _) = record.energy_error();
    assert!(error < 1e-9, "{error:e}");
    assert_eq!(record.reason(), None, "{text}");
    record
}

/// Final position and velocity of the end.
fn ended(text: &str) -> [Vector3<f64>; 2] {
    let last = &recorded(text).branches[0].last;
    [last.position(), last.end().velocity]
}

#[track_caller]
fn agree(got: &[Vector3<f64>; 2], want: &[Vector3<f64>; 2], tolerance: f64) {
    for (got, want) in got.iter().zip(want) {
        let off = (got - want).norm();
        assert!(off < tolerance, "{got} {want}, off by {off:e}");
    }
}

/// Catches a start in space on a clamp that turns at t = 0 and is refused, or whose velocity, shape or position
/// differs from the planar start: any planar scene, in the plane and in space.
#[test]
fn a_clamp_that_turns_at_the_start_is_the_same_in_the_plane_and_in_space() {
    let turns = [
        "rate = 1.3",
        "amplitude = 0.7, frequency = 0.5, phase = 0.3",
    ];
    let moves = [
        ["[1.0, 0.5]", "[0.5, 0.0, 1.0]"],
        ["[0.0, 1.0]", "[1.0, 0.0, 0.0]"],
    ];
    let starts = [
        [
            "curvature = [0.6, -0.2]\nvelocity = [0.1, -0.3]",
            "strain = { u2 = [0.6, -0.2] }\nvelocity = [-0.3, 0.0, 0.1]",
        ],
        [
            "position = [0.05, 2.0]\nsheet = \"lowest\"\nwith_clamp = true\nvelocity = [0.1, -0.3]",
            "pose = { position = [2.0, 0.0, 0.05] }\nwith_clamp = true\nvelocity = [-0.3, 0.0, 0.1]",
        ],
    ];
    for (turn, direction) in turns.into_iter().zip(moves) {
        for start in starts {
            let shaken =
                |d: &str| format!("{{ direction = {d}, amplitude = 0.1, frequency = 0.7 }}");
            let flat = format!(
                "{PLANE}[clamp]\nangle = 0.4\nposition = [0.1, 0.2]\nmotion = {{ turn = {{ {turn} }}, translate = {} }}\n\
                 [start]\n{}\n[loads]\ngravity = [-1.0, 0.7]\ndrag = 0.2\n",
                shaken(direction[0]),
                start[0]
            );
            let whole = format!(
                "{SPACE}[clamp]\nrotation = {{ axis = [0.0, 1.0, 0.0], angle = 0.4 }}\nposition = [0.2, 0.0, 0.1]\n\
                 motion = {{ turn = {{ axis = [0.0, 1.0, 0.0], {turn} }}, translate = {} }}\n\
                 [start]\n{}\n[loads]\ngravity = [0.7, 0.0, -1.0]\ndrag = 0.2\n",
                shaken(direction[1]),
                start[1]
            );
            let want = ended(&flat).map(|v| vector![v.y, 0.0, v.x]);
            agree(&ended(&whole), &want, 1e-9);
        }
    }
}

/// A point mass in a frame that turns at the constant rate Omega: r'' = f/m - Omega x (Omega x r) - 2 Omega x r'.
#[derive(Debug)]
struct Whirled(Matrix3<f64>);

impl EndBody<3> for Whirled {
    type Pose = Isometry3<f64>;

    fn motion(
        &self,
        _: f64,
        pose: &Isometry3<f64>,
        v: &Vector3<f64>,
        rod: &Vector3<f64>,
    ) -> EndMotion<3> {
        let r = pose.translation.vector;
        EndMotion {
            acceleration: rod - self.0 * self.0 * r - self.0 * v * 2.0,
            power: 0.0,
            loss: 0.0,
        }
    }

    fn linearised(
        &self,
        _: f64,
        _: &Isometry3<f64>,
        _: &SVector<f64, 3>,
        _: &SVector<f64, 3>,
    ) -> EndLinear<3> {
        EndLinear {
            by_pose: -self.0 * self.0,
            by_velocity: self.0 * -2.0,
            by_wrench: SMatrix::identity(),
        }
    }

    fn kinetic(&self, _: f64, _: &Isometry3<f64>, v: &SVector<f64, 3>) -> f64 {
        0.5 * v.norm_squared()
    }

    fn potential(&self, _: f64, pose: &Isometry3<f64>) -> f64 {
        -0.5 * (self.0 * pose.translation.vector).norm_squared()
    }

    fn next_break(&self, _: f64) -> f64 {
        f64::INFINITY
    }
}

/// Catches a wrong rigid rotation with the clamp. An arc is bent out of the plane of the rotation, at rest in the
/// frame of a clamp that turns about any axis. In that frame it moves under centrifugal and Coriolis forces.
/// with_clamp is the velocity Omega x r of the end of the arc, given in the world.
#[test]
fn a_turning_clamp_is_a_frame_with_centrifugal_and_coriolis_forces() {
    let (axis, rate, kappa) = (vector![1.0, 2.0, -0.5].normalize(), 1.7, 1.4f64);
    let text = |joint: &str, start: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\ndamping = {{ proportional = 0.05 }}\n[rod.section]\nbending = [1.0, 1.0]\n\
             torsion = 0.8\n[body]\nmass = 1.0\n{joint}\n[clamp]\nmotion = {{ turn = {{ axis = [1.0, 2.0, -0.5], rate = 1.7 }} }}\n\
             [start]\nstrain = {{ u2 = [1.4] }}\n{start}\n[run]\nduration = 1.5\ntolerance = 1e-11\nsamples = 2\n"
        )
    };
    let ball = "joint = \"ball\"";
    let got = ended(&text(ball, "with_clamp = true"));

    let scene = Scene::parse(&text(ball, "with_clamp = true")).unwrap();
    let law = scene.viscoelastic().unwrap();
    let law = law.law_in_units(scene.scales().unwrap().measures());
    let body = Whirled((axis * rate).cross_matrix());
    let start = ViscousStart {
        strain: &|_| Local::<3>::new(0.0, kappa, 0.0),
        relaxed: None,
        velocity: Vector3::zeros(),
    };
    let options = Options::new(1.5)
        .and_then(|o| o.with_tolerance(1e-11))
        .unwrap();
    let material = Material::new(law, [0, 1, 2]).unwrap();
    let mut seen = ViscousRun::new(Space::<3, 3>::new(), material, &body, &start, options).unwrap();
    seen.by_ref().for_each(drop);
    let turn = UnitQuaternion::from_scaled_axis(axis * (rate * 1.5));
    let place = turn * seen.now().pose.translation.vector;
    let velocity = turn * seen.now().velocity + (axis * rate).cross(&place);
    agree(&got, &[place, velocity], 1e-9);

    let end = vector![(1.0 - kappa.cos()) / kappa, 0.0, kappa.sin() / kappa];
    let omega = axis * rate;
    let carried = format!("velocity = {:?}", omega.cross(&end).as_slice());
    agree(&ended(&text(ball, &carried)), &got, 1e-11);
    let weld = "offset = [0.1, 0.0, 0.05]\ninertia = [0.02, 0.03, 0.04]";
    let turning = format!("{carried}\nangular_velocity = {:?}", omega.as_slice());
    let with_clamp = ended(&text(weld, "with_clamp = true"));
    agree(&ended(&text(weld, &turning)), &with_clamp, 1e-11);
}

/// Catches a rod at rest on its clamp that cannot start on a clamp moving at t = 0, in any model, or a refusal without
/// an admissible velocity.
#[test]
fn a_rod_starts_at_rest_on_a_clamp_that_moves() {
    let elastic = PLANE.replace("damping = { proportional = 0.05 }\n", "");
    let shake = |d: &str| {
        format!(
            "[clamp]\nmotion.translate = {{ direction = {d}, amplitude = 0.01, frequency = 2.0 }}\n[start]\nrest = \"straight\"\n"
        )
    };
    let weld = SPACE.replace("joint = \"ball\"", "inertia = [0.1, 0.1, 0.1]");
    // Speed 2 pi 2.0 0.01 along the rod.
    for (text, direction, value) in [
        (&elastic[..], "[1.0, 0.0]", "[0.12566370614359174, 0.0]"),
        (PLANE, "[1.0, 0.0]", "[0.12566370614359174, 0.0]"),
        (SPACE, "[0.0, 0.0, 1.0]", "[0.0, 0.0, 0.12566370614359174]"),
        (&weld, "[0.0, 0.0, 1.0]", "[0.0, 0.0, 0.12566370614359174]"),
    ] {
        let bare = format!("{text}{}", shake(direction));
        let begun = prepared(&bare).and_then(|prepared| prepared.motion().map(drop));
        let why = begun.expect_err(&bare).to_string();
        for words in ["with_clamp = true", &format!("velocity = {value}")] {
            assert!(why.contains(words), "{words}: {why}");
        }
        // Across the rod every velocity is admissible, and both starts agree: at rest on the clamp.
        let across = direction
            .replace("1.0", "X")
            .replacen("0.0", "1.0", 1)
            .replace('X', "0.0");
        let velocity = across.replace("1.0", "0.12566370614359174");
        let text = format!("{text}{}", shake(&across));
        let with_clamp = ended(&format!("{text}with_clamp = true\n"));
        agree(
            &ended(&format!("{text}velocity = {velocity}\n")),
            &with_clamp,
            1e-12,
        );
    }
}

/// Catches a planar rod that does not start along its tilted clamp, in any model: released straight with its weight
/// along the clamp's tangent it stays straight; with its weight across it falls as under the turned weight.
#[test]
fn a_straight_rod_lies_along_its_tilted_clamp() {
    let elastic = PLANE.replace("damping = { proportional = 0.05 }\n", "");
    let (sin, cos) = 0.7f64.sin_cos();
    for text in [&elastic[..], PLANE] {
        let tilted = format!(
            "{text}[clamp]\nangle = 0.7\n[start]\nrest = \"straight\"\n[loads]\ngravity = [0.0, -1.0]\n"
        );
        let turned = format!(
            "{text}[start]\nrest = \"straight\"\n[loads]\ngravity = [{:?}, {:?}]\n",
            -sin, -cos
        );
        let want =
            ended(&turned).map(|v| vector![cos * v.x - sin * v.y, sin * v.x + cos * v.y, 0.0]);
        agree(&ended(&tilted), &want, 1e-9);
    }
    let tilted = format!(
        "{SPACE}[clamp]\nrotation = {{ axis = [0.0, 1.0, 0.0], angle = 0.7 }}\n[start]\nrest = \"straight\"\n[loads]\ngravity = [-1.0, 0.0, 0.0]\n"
    );
    let flat = format!(
        "{PLANE}[clamp]\nangle = 0.7\n[start]\nrest = \"straight\"\n[loads]\ngravity = [0.0, -1.0]\n"
    );
    agree(
        &ended(&tilted),
        &ended(&flat).map(|v| vector![v.y, 0.0, v.x]),
        1e-9,
    );
}

/// The planar end of a rod of length and stiffness 1 under the force (fx, fz) at the point (a, c) beside its end,
/// along the directors d1, d3 there. The equation is theta'' = fz sin theta - fx cos theta. It is integrated from the
/// end, where theta' is the couple of the force about it, to the clamp, where theta = 0. Methods: Runge and Kutta's
/// classical one and the secant method.
fn carried(force: [f64; 2], arm: [f64; 2], guess: f64) -> (f64, f64, f64) {
    let couple = |theta: f64| {
        let (sin, cos) = theta.sin_cos();
        let (x, z) = (cos * arm[0] + sin * arm[1], cos * arm[1] - sin * arm[0]);
        z * force[0] - x * force[1]
    };
    let shot = |end: f64| {
        let slope = |[theta, kappa, _, _]: [f64; 4]| {
            let (sin, cos) = theta.sin_cos();
            [kappa, force[1] * sin - force[0] * cos, sin, cos]
        };
        let n = 4000;
        let h = -1.0 / f64::from(n);
        let mut y = [end, couple(end), 0.0, 0.0];
        for _ in 0..n {
            let moved = |k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
            let a = slope(y);
            let b = slope(moved(a, 0.5 * h));
            let c = slope(moved(b, 0.5 * h));
            let d = slope(moved(c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        y
    };
    let (mut last, mut end) = (guess + 0.01, guess);
    let mut missed = shot(last)[0];
    for _ in 0..50 {
        let now = shot(end)[0];
        if now == missed || end == last {
            break;
        }
        let next = end - now * (end - last) / (now - missed);
        (last, end, missed) = (end, next, now);
    }
    let [_, _, x, z] = shot(end);
    (-x, -z, end)
}

/// Catches a weight applied at the end instead of the centre of mass of a body welded beside it, a start that was once
/// refused. The loads balance on the body, which stays in place, and the planar rod is the one found by shooting.
#[test]
fn a_body_beside_the_end_settles_under_its_weight() {
    let text = |offset: &str, loads: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\ndamping = {{ proportional = 0.05 }}\n[rod.section]\nbending = [1.4, 1.0]\n\
             torsion = 0.8\n[body]\nmass = 2.0\noffset = {offset}\ninertia = [0.02, 0.03, 0.04]\n[start]\nsettled = true\n\
             [loads]\n{loads}\n[run]\nduration = 1.0\ntolerance = 1e-11\nsamples = 2\n"
        )
    };
    let cases = [
        ("[0.3, 0.0, 0.2]", "gravity = [-0.5, 0.0, 0.3]"),
        (
            "[0.2, -0.25, 0.1]",
            "gravity = [0.4, -0.6, -0.3]\ndead = [0.1, 0.2, 0.3]\ncouple = [0.1, 0.0, -0.05]",
        ),
        (
            "[0.0, 0.2, -0.3]",
            "gravity = [1.0, 0.2, 0.5]\nforce = { direction = [0.0, 1.0, 0.0], ramp = { from = 0.4, to = 0.4, until = 1.0 } }",
        ),
    ];
    for (offset, loads) in cases {
        let text = text(offset, loads);
        let scene = Scene::parse(&text).unwrap();
        let record = recorded(&text);
        assert_eq!(record.start_index, Some(0));
        let (first, last) = (&record.branches[0].first, &record.branches[0].last);
        let body = scene.body().unwrap();
        let snaprod::scene::Joint::Weld { offset, .. } = body.joint else {
            panic!("{text}");
        };
        let force = Vector3::from(scene.loads.gravity) * body.mass
            + Vector3::from(scene.loads.dead)
            + Vector3::y() * if loads.contains("ramp") { 0.4 } else { 0.0 };
        let arm = first.end().pose.rotation * Vector3::from(offset);
        let couple = arm.cross(&force) + Vector3::from(scene.loads.couple.constant());
        let action = first.end().action.expect("one rod");
        assert!((action.force + force).norm() < 1e-10, "{text}");
        let off = (action.couple + couple).norm();
        assert!(off < 1e-10, "{off:e} {text}");
        let moved = (last.position() - first.position()).norm();
        assert!(moved < 1e-9, "{moved:e} {text}");
    }
    let record = recorded(&text(cases[0].0, cases[0].1));
    let pose = &record.branches[0].first.end().pose;
    let (x, z, turned) = carried([-1.0, 0.6], [0.3, 0.2], -0.4);
    let r = pose.translation.vector;
    assert_close(r.x, x, 1e-10, 1.0, "x");
    assert_close(r.z, z, 1e-10, 1.0, "z");
    assert_close(pose.rotation.scaled_axis().y, turned, 1e-10, 1.0, "angle");
    assert!(r.y.abs() < 1e-11);
}

/// Catches a straight rod under a push beyond Euler's load that is left standing, silently or without advice. Catches
/// an imperfection that buckles the rod to the other side, or under loads below buckling, or whose bend is not of the
/// given angle.
#[test]
fn a_push_beyond_euler_asks_for_an_imperfection() {
    let text = |damping: &str, push: f64, start: &str| {
        format!(
            "[rod]\nmodel = \"elastica\"\nlength = 2.0\nbending_stiffness = 3.0\n{damping}\n[body]\nmass = 1.5\n[start]\nrest = \"straight\"\n\
             {start}\n[loads]\ndead = [{push:?}, 0.0]\n[run]\nduration = 0.5\ntolerance = 1e-11\nsamples = 2\n"
        )
    };
    // EI/L^2 = 0.75.
    let euler = 0.75 * 0.25 * std::f64::consts::PI.powi(2);
    let damped = "damping = { proportional = 0.02 }";
    for damping in ["", damped] {
        let begun = prepared(&text(damping, -1.2 * euler, ""));
        let why = begun
            .and_then(|p| p.motion().map(drop))
            .unwrap_err()
            .to_string();
        for words in ["straight rod is unstable", "imperfection = 0.01 in [start]"] {
            assert!(why.contains(words), "{why}");
        }
        for angle in [0.01, -0.01] {
            let start = format!("imperfection = {angle:?}");
            let [place, velocity] = ended(&text(damping, -1.2 * euler, &start));
            assert!(
                place.y * angle > 0.0 && velocity.y * angle > 0.0,
                "{place} {velocity}"
            );
            // Under Euler's load the bent rod is in equilibrium; under a smaller one it straightens.
            let [_, straightens] = ended(&text(damping, -0.5 * euler, &start));
            assert!(straightens.y * angle < 0.0, "{straightens}");
        }
    }
    // theta(L) = 0.01 in the shape of buckling, sin(pi s/2L): y = 0.01 2 L/pi at the start.
    let mut tables: Vec<Table> = Vec::new();
    let prepared = prepared(&text("", -1.2 * euler, "imperfection = 0.01")).unwrap();
    run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    let y = tables[0].reals("y")[0];
    assert_close(
        y,
        0.02 / std::f64::consts::FRAC_PI_2,
        1e-4,
        1.0,
        "y at the start",
    );
    let clash = text(damped, -1.0, "imperfection = 0.01")
        .replace("rest = \"straight\"", "curvature = [0.1]");
    let faults = Scene::parse(&clash).unwrap_err().to_string();
    assert!(
        faults.contains("start.imperfection") && faults.contains("rest = \"straight\""),
        "{faults}"
    );
}

/// Catches refusals of an end held at full reach, with both ends clamped or the other pinned, whose advice does not
/// run.
#[test]
fn an_end_at_full_reach_runs_a_little_inside() {
    let text = |position: &str, end: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 2.0\n[rod.section]\nbending = [3.0, 1.0]\ntorsion = 0.7\n[end]\nposition = {position}\n{end}\n"
        )
    };
    for end in ["", "quaternion = [1.0, 0.0, 0.0, 0.0]"] {
        let faults = Scene::parse(&text("[0.0, 0.0, 2.0]", end))
            .unwrap_err()
            .to_string();
        assert!(
            faults.contains("a little inside, such as at 0.999 of that"),
            "{faults}"
        );
        let scene = Scene::parse(&text("[0.0, 0.0, 1.998]", end)).unwrap();
        let found = snaprod::study::equilibrium(&scene).unwrap().found;
        assert_eq!(found.index, 0);
        assert_close(found.end.position.z, 1.998, 1e-9, 1.0, "z");
    }
}
