//! Taut rods in the chart by force and end pose.

use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::math::se3::{halves, join};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome};
use snaprod::rod::{EndConditions, Problem, Rod, Taut, Tip};
use snaprod::section::Linear;
use std::f64::consts::PI;

const FREE: Tip = Tip::Loaded {
    couple: Vector3::new(0.0, 0.0, 0.0),
    arm: Vector3::new(0.0, 0.0, 0.0),
};

/// d(couple, n)/d(turn, place) of the end, from derivatives by the force and by the turn.
fn stiffness(found: &Taut, at_base: bool) -> Matrix6<f64> {
    let by = |d: &snaprod::rod::Derivatives| if at_base { d.base_couple } else { d.couple };
    let of_place = found.by_force.position.try_inverse().expect("no fold");
    let of_turn = -of_place * found.by_tip.position;
    let mut k = Matrix6::zeros();
    let blocks = [
        (0, 0, by(&found.by_tip) + by(&found.by_force) * of_turn),
        (0, 3, by(&found.by_force) * of_place),
        (3, 0, of_turn),
        (3, 3, of_place),
    ];
    for (i, j, block) in blocks {
        k.fixed_view_mut::<3, 3>(i, j).copy_from(&block);
    }
    k
}

fn small(what: &str, off: f64, bound: f64) {
    assert!(off <= bound, "{what}: {off:.1e} > {bound:.0e}");
}

/// Against the base wrench, which is accurate below lam = 12: any law, bent and looped rods, their stiffness, index
/// and shape. Catches a wrong term of the variations, of the second variation, of the elimination.
#[test]
fn taut_rods_are_those_of_the_base_wrench() {
    let mut seed = 12345_u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut indices = [0; 3];
    for trial in 0..60 {
        let lam = 8.5 + 3.5 * random();
        let coupled = Matrix6::from_fn(|_, _| 0.3 * random());
        let stiff = Vector6::new(1.0, 1.0, 1.0, 400.0, 300.0, 500.0);
        let bent = |law: Linear, a: f64, b: f64, c: f64| law.with_rest([a, b], c).unwrap();
        let plain = Linear::diagonal([1.0, 1.0 + 0.4 * random()], 0.8 + 0.3 * random()).unwrap();
        let law = match trial % 4 {
            0 => bent(plain, random(), random(), random()),
            1 => {
                let law = plain.with_shear([300.0, 200.0]).unwrap();
                bent(law.with_axial(400.0).unwrap(), random(), random(), random())
            }
            2 => {
                let matrix = coupled * coupled.transpose() + Matrix6::from_diagonal(&stiff);
                Linear::full(matrix).unwrap()
            }
            _ => Linear::diagonal([1.0, 1.0], 0.8).unwrap(),
        };
        let rod = Rod::new(1.0, law).unwrap();
        let pull = Vector3::new(0.7 * random(), 0.7 * random(), 1.0).normalize();
        let angle = pull.angle(&Vector3::z());
        let axis = Vector3::z().cross(&pull).normalize();
        // Near the pendulum's separatrix, more or less.
        let mut m = axis * (2.0 * lam * (0.5 * angle).sin()) + pull * (3.0 * random());
        let aside = if trial % 3 == 0 { 0.0 } else { 30.0 };
        m += Vector3::new(random(), random(), random()) * (aside * lam * (-lam).exp());
        if trial % 5 == 0 {
            m += axis * (0.2 * lam * random());
        }
        let n = pull * lam * lam;
        let base = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
        let exact = rod.end(&base, 1e-14).unwrap();
        let end = &exact.section;
        let held = EndConditions::pose(end.position, end.pose().rotation);
        let free = EndConditions {
            couple: end.couple,
            ..EndConditions::ball(end.position)
        };
        let loaded = Tip::Loaded {
            couple: end.couple,
            arm: Vector3::zeros(),
        };
        for (tip, conditions) in [(Tip::Turned(end.directors), held), (loaded, free)] {
            let found = rod.taut(&base, &tip, None, 1e-13).unwrap();
            small("m(0)", (found.base - base).amax() / lam, 2e-12);
            small("r", (found.end.position - end.position).amax(), 2e-12);
            // Errors of the base wrench, exp(lam) times rounding.
            small(
                "directors",
                (found.end.directors - end.directors).amax(),
                2e-9,
            );
            small("m(1)", (found.end.couple - end.couple).amax() / lam, 2e-10);
            small("energy", (found.end.energy - end.energy).abs(), 2e-12 * lam);
            let problem = Problem::new(rod.clone(), conditions, 1e-13).unwrap();
            let index = problem.index_at(&base).unwrap();
            assert_eq!(rod.taut_index(&found).unwrap(), index, "trial {trial}");
            indices[index.min(2)] += 1;
            if matches!(tip, Tip::Turned(_)) {
                let inverse = exact.tangent.try_inverse().unwrap();
                let off = stiffness(&found, true) - inverse;
                small("stiffness", off.norm() / inverse.norm(), 2e-9);
                let at = [0.0, 0.1, 0.37, 0.5, 0.93, 1.0];
                let there = rod.taut_shape(&found, &at, 1e-12).unwrap();
                for (a, b) in there.iter().zip(rod.shape(&base, &at, 1e-14).unwrap()) {
                    small("place", (a.position - b.position).amax(), 1e-10);
                    small("strain", (a.strain - b.strain).amax() / lam, 1e-10);
                    small("energy there", (a.energy - b.energy).abs(), 1e-10 * lam);
                }
            }
        }
    }
    assert!(indices.iter().all(|count| *count > 2), "{indices:?}");
}

/// Multiple shooting in 80-bit arithmetic, and closed forms, at lam = 30, 100, 300, 1000.
#[test]
fn taut_rods_of_other_programs() {
    let path = format!(
        "{}/tests/data/space/string_limit_given.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let given: Value = serde_json::from_str(&text).expect("JSON");
    let number = |v: &Value| match v {
        Value::String(digits) => digits.parse::<f64>().expect("a number"),
        v => v.as_f64().expect("a number"),
    };
    let vector = |v: &Value| Vector3::from_fn(|i, _| number(&v[i]));
    let cases = given["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 20);
    for case in cases {
        let lam = number(&case["lam"]);
        let k = &case["stiffnesses"];
        let (bending, torsion) = if k.is_array() {
            ([number(&k[0]), number(&k[1])], number(&k[2]))
        } else {
            ([1.0; 2], 0.7)
        };
        let mut law = Linear::diagonal(bending, torsion).unwrap();
        if k[3].is_number() {
            law = law.with_shear([number(&k[3]), number(&k[4])]).unwrap();
        }
        if k[5].is_number() {
            law = law.with_axial(number(&k[5])).unwrap();
        }
        if case["rest_curvature_u0"].is_array() {
            let u = vector(&case["rest_curvature_u0"]);
            law = law.with_rest([u.x, u.y], u.z).unwrap();
        }
        let rod = Rod::new(1.0, law).unwrap();
        let n = if case["force"].is_array() {
            vector(&case["force"])
        } else {
            Vector3::z() * number(&case["tension"])
        };
        let q = &case["quaternion"];
        let tip = if q.is_array() {
            let q = [0, 1, 2, 3].map(|i| number(&q[i]));
            let turn = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
            Tip::Turned(*turn.to_rotation_matrix().matrix())
        } else {
            FREE
        };
        let base = Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
        for tolerance in [1e-13, 1e-9] {
            let found = rod.taut(&base, &tip, None, tolerance).unwrap();
            // Digits of the reference, and rounding.
            let bound = 0.1 * tolerance + 2e-14;
            let place = (found.end.position - vector(&case["position"])).amax();
            small("place", place, bound);
            if case["end_couple"].is_array() {
                let m1 = found.end.couple - vector(&case["end_couple"]);
                let m0 = found.base.fixed_rows::<3>(0) - vector(&case["base_couple"]);
                small("m(1)", m1.amax() / lam, bound);
                small("m(0)", m0.amax() / lam, bound);
            }
            if !case["elastic"].is_null() {
                let elastic = number(&case["elastic"]);
                small(
                    "energy",
                    (found.end.energy - elastic).abs(),
                    10.0 * bound * lam,
                );
            }
            // The stiffness of inextensible rods has lam^3 times the error.
            let off = if case["stiffness"].is_array() {
                let wanted = Matrix6::from_fn(|i, j| number(&case["stiffness"][i][j]));
                (stiffness(&found, false) - wanted).amax() / wanted.amax()
            } else {
                let wanted = Matrix3::from_fn(|i, j| number(&case["stiffness_3x3"][i][j]));
                (found.by_force.position.try_inverse().unwrap() - wanted).amax() / wanted.amax()
            };
            small("stiffness", off, 1e3 * tolerance + 1e-11);
            assert_eq!(rod.taut_index(&found).unwrap(), 0);
            assert!(found.error <= tolerance && found.sign == 1.0);
        }
    }
}

/// The straight rod under tension is a beam-column: with B = B' v3, L = L' v3, l = lam sqrt(v3) and t = tanh l, over
/// cosh l, k_vv = T l t/(L phi) .. , phi = 2/cosh - 2 + l t. All entries of the stiffness, up to lam = 1e4.
#[test]
fn a_straight_rod_under_tension_is_a_beam_column() {
    for lam in [3.0, 10.0, 30.0, 100.0, 1e3, 1e4_f64] {
        let (bending, torsion, tension) = ([1.0, 1.7], 0.7, lam * lam);
        let axial = 20.0 * tension;
        let v3 = 1.0 + tension / axial;
        let law = Linear::diagonal(bending, torsion)
            .unwrap()
            .with_axial(axial)
            .unwrap();
        let rod = Rod::new(1.0, law).unwrap();
        let base = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, tension);
        let found = rod
            .taut(&base, &Tip::Turned(Matrix3::identity()), None, 1e-13)
            .unwrap();
        small("place", (found.end.position.z - v3).abs(), 4e-15);
        let mut want = Matrix6::zeros();
        want[(2, 2)] = torsion;
        want[(5, 5)] = axial;
        for (axis, b) in bending.into_iter().enumerate() {
            let b = b * v3;
            let l = (tension / b).sqrt() * v3;
            let (tanh, one) = (l.tanh(), 1.0 / l.cosh());
            let phi = 2.0 * one - 2.0 + l * tanh;
            // A turn about d1 moves the end along -d2.
            let (across, sign) = (4 - axis, if axis == 0 { -1.0 } else { 1.0 });
            want[(axis, axis)] = b / v3 * l * (l - tanh) / phi;
            want[(across, across)] = b / v3.powi(3) * l.powi(3) * tanh / phi;
            let mixed = -sign * b / v3.powi(2) * l * l * (1.0 - one) / phi;
            want[(axis, across)] = mixed;
            want[(across, axis)] = mixed;
        }
        let got = stiffness(&found, false);
        for i in 0..6 {
            for j in 0..6 {
                let size = (want[(i, i)] * want[(j, j)]).sqrt();
                small(
                    "beam-column",
                    (got[(i, j)] - want[(i, j)]).abs() / size,
                    2e-12,
                );
            }
        }
    }
}

/// A wire of length 1 in two halves with a mass in the middle, under tension lam^2 (B = 1), along z.
fn wire(lam: f64, axial: f64, joint: Joint) -> Assembly {
    let v3 = 1.0 + lam * lam / axial;
    let half = || {
        let law = Linear::diagonal([1.0, 1.0], 0.7)
            .and_then(|law| law.with_axial(axial))
            .unwrap();
        Rod::new(0.5, law).unwrap()
    };
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI);
    let at = |z: f64| Isometry3::translation(0.0, 0.0, z);
    let turned = |z: f64| Isometry3::from_parts(at(z).translation, turn);
    let upper = if joint == Joint::Weld {
        turned(0.0)
    } else {
        at(0.0)
    };
    let link = |from, to| {
        let (from, to) = (Attachment::ground(from), Attachment::body(0, to));
        Link::new(half(), from, to, joint)
    };
    let links = vec![link(at(-0.5 * v3), at(0.0)), link(turned(0.5 * v3), upper)];
    let carrier = match joint {
        Joint::Weld => {
            let inertia = Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.02));
            Body::rigid(RigidBody::new(1.0, inertia).unwrap())
        }
        Joint::Ball => Body::point(PointMass::new(1.0).unwrap()),
    };
    Assembly::new(vec![carrier], links).unwrap()
}

/// The state at `t`, and the energy error.
fn moved(
    assembly: Assembly,
    start: &Configuration,
    t: f64,
    tolerance: f64,
) -> (AssemblySample, f64) {
    let options = Options::new(t)
        .and_then(|o| o.with_tolerance(tolerance))
        .unwrap();
    let mut run = AssemblyRun::new(assembly, start, options).unwrap();
    let total = run.now().ledger().total();
    while let Some(event) = run.advance() {
        if let Event::Stop(outcome) = event {
            assert_eq!(outcome, Outcome::EndOfTime);
        }
    }
    let last = run.sample_now();
    let opened = (last.ledger.total() - total).abs();
    (last, opened)
}

/// A mass in the middle of a tight wire, struck across: a quarter period of the harmonic oscillator of string and
/// beam, with a small cubic term in the force. Catches a drifting chart, and a force that does not match the position.
#[test]
#[ignore = "second tier: 3 s"]
fn a_mass_on_a_tight_wire_swings() {
    // The welded body twists and turns about two axes more slowly than it moves across.
    for (lam, joint, mode) in [(100.0, Joint::Weld, 3), (1e4, Joint::Ball, 0)] {
        let assembly = wire(lam, 20.0 * lam * lam, joint);
        let mut now = assembly.equilibrium(None, 1e-11).unwrap().now;
        let omega = assembly.modes(&now, 1e-12).unwrap().frequencies[mode];
        let way = 1e-4;
        now.bodies[0].twist[3] = way * omega;
        let quarter = 0.5 * PI / omega;
        let (there, opened) = moved(assembly, &now, quarter, 1e-9);
        // The wire is longer by way^2/2 over 1/4 on each side; the frequency grows by 3/8 of that stiffness, some 1e-7.
        let x = there.at.now.bodies[0].pose.translation.vector.x;
        small("swing", (x / way - 1.0).abs(), 3e-6);
        small("ledger", opened / there.ledger.elastic, 1e-10);
        small("drift", there.drift(), 1e-9);
    }
}

/// The motion of a wire of lam = 24 in two halves, in 80-bit arithmetic by their base wrenches; these halves leave and
/// re-enter the base-wrench charts during the motion.
#[test]
#[ignore = "second tier: 3 s"]
fn a_wire_moves_as_another_program_has_it() {
    let given = crate::support::json("space/tight_wire_given.json");
    let motion = &given["motion"];
    let vector = |v: &Value| Vector3::from_fn(|i, _| v[i].as_f64().expect("a number"));
    let assembly = wire(24.0, 20000.0, Joint::Ball);
    let gravity = PointMass::new(1.0)
        .and_then(|body| body.with_gravity(vector(&motion["gravity"])))
        .unwrap();
    let assembly = Assembly::new(vec![Body::point(gravity)], assembly.links().to_vec()).unwrap();
    let mut now = assembly.unloaded(1e-12).unwrap();
    now.bodies[0] = BodyMotion::at_rest(Isometry3::identity());
    let velocity = vector(&motion["start"]["velocity"]);
    now.bodies[0]
        .twist
        .fixed_rows_mut::<3>(3)
        .copy_from(&velocity);
    for (link, q) in assembly.links().iter().zip(&mut now.charts) {
        q[5] = 576.0 / link.units()[3];
    }
    let states = motion["states"].as_array().expect("states");
    assert_eq!(states.len(), 3);
    for state in states {
        let t = state["t"].as_f64().expect("a time");
        let (there, opened) = moved(assembly.clone(), &now, t, 1e-11);
        let place = &there.at.now.bodies[0];
        let row = &state["bodies"][0];
        let off = place.pose.translation.vector - vector(&row["position"]);
        small("place", off.norm(), 1e-10);
        let off = place.twist.fixed_rows::<3>(3) - vector(&row["velocity"]);
        small("velocity", off.norm(), 1e-8);
        let elastic = state["elastic"].as_f64().expect("an energy");
        small("energy", (there.ledger.elastic / elastic - 1.0).abs(), 1e-8);
        small("ledger", opened, 1e-8);
        for (k, rod) in there.at.points.iter().enumerate() {
            let force = vector(&state["rods"][k]["base_wrench_chart"]["force"]);
            small("force", (rod.end.force - force).norm() / force.norm(), 1e-8);
        }
    }
}

/// Statics of one rod, inextensible, in the limit of the string (exact up to exp(-lam)): n at an angle g from the
/// clamp, r = (1 - (4/lam) sin^2(g/4), -(2/lam) sin(g/2)) along and across it. From the force, from the place, and
/// the shape in between.
#[test]
fn equilibria_of_taut_rods() {
    let rod = |b: f64| Rod::new(2.0, Linear::diagonal([b, b], 0.7 * b).unwrap()).unwrap();
    for lam in [40.0, 100.0, 1e3, 1e4_f64] {
        for angle in [0.3, 0.5 * PI, 2.5_f64] {
            // B = 3, L = 2.
            let tension = 3.0 * lam * lam / 4.0;
            let along = Vector3::new(angle.sin(), 0.0, angle.cos());
            let across = Vector3::new(angle.cos(), 0.0, -angle.sin());
            let out = 1.0 - 4.0 / lam * (0.25 * angle).sin().powi(2);
            let place = (along * out - across * (2.0 / lam * (0.5 * angle).sin())) * 2.0;
            let load = EndConditions::load(along * tension, Vector3::zeros());
            let problem = Problem::new(rod(3.0), load, 1e-12).unwrap();
            let found = problem.solve(None).unwrap();
            small("place", (found.end.position - place).norm(), 1e-12);
            assert_eq!(found.index, 0);
            let couple = 3.0 / 2.0 * 2.0 * lam * (0.5 * angle).sin();
            small("m(0)", (found.base[1] / couple - 1.0).abs(), 1e-11);
            assert_eq!(problem.index_at(&found.base).unwrap(), 0);
            // Half way along, the layer has decayed to exp(-lam/2).
            let shape = problem.shape(&found.base, 3).unwrap();
            let middle = place - along;
            let off = (shape[1].position - middle).norm();
            small("middle", off, 1e-11 + 20.0 / lam * (-0.5 * lam).exp());
            let held = Problem::new(rod(3.0), EndConditions::ball(place), 1e-12).unwrap();
            let found = held.solve(None).unwrap();
            let n = found.base.fixed_rows::<3>(3) - along * tension;
            // Positions are rounded, and the force by lam times that.
            small("force", n.norm() / tension, 1e-14 * lam + 1e-12);
            assert_eq!(found.index, 0);
            // Welded at the current pose, with an additional twist.
            let turn = found.end.pose().rotation
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.2);
            let held = Problem::new(rod(3.0), EndConditions::pose(place, turn), 1e-12).unwrap();
            let found = held.solve(None).unwrap();
            let torque = found.end.couple.dot(&along) - 0.2 * 0.7 * 3.0 / 2.0;
            // The layers leave their plane by the twist over lam, and rotate the rod by as much.
            small("torque", torque.abs(), 0.5 / lam);
            let n = found.base.fixed_rows::<3>(3) - along * tension;
            small("force with a twist", n.norm() / tension, 5.0 / (lam * lam));
        }
    }
}

/// The steel wire of the scene: string and bending, B' = B v3, l = lam sqrt(v3) of a half, k = T/(L v3 (1 - tanh
/// l/l)) each.
#[cfg(feature = "scene")]
#[test]
fn the_wire_of_the_scenes_swings_as_string_and_beam() {
    use snaprod::scene::{AssemblySetup, Scene};
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/wire.toml");
    let scene = Scene::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    let setup = AssemblySetup::new(&scene).unwrap();
    let found = setup.equilibrium().unwrap();
    assert_eq!(found.index, 0);
    let (bending, axial, mass) = (9.8175e-3_f64, 1.5708e5_f64, 0.1_f64);
    let (long, v3) = (0.5003183_f64, 0.5003183 / 0.5);
    let tension = axial * (v3 - 1.0);
    let l = (tension / (bending * v3)).sqrt() * long;
    let across = (2.0 * tension / (mass * long * (1.0 - l.tanh() / l))).sqrt();
    let along = (4.0 * axial / mass).sqrt();
    let modes = setup.assembly.modes(&found.now, 1e-12).unwrap();
    for (got, want) in modes.frequencies.iter().zip([across, across, along]) {
        small(
            "frequency",
            (got / setup.scales.time / want - 1.0).abs(),
            1e-10,
        );
    }
    let (run, _) = setup.motion(&scene).unwrap();
    let mut run: Box<dyn Motion<'_>> = run;
    let total = run.now().ledger().total();
    while let Some(event) = run.advance() {
        if let Event::Stop(outcome) = event {
            assert_eq!(outcome, Outcome::EndOfTime);
        }
    }
    let ledger = run.now().ledger();
    small(
        "ledger",
        (ledger.total() - total).abs() / ledger.elastic,
        1e-7,
    );
}

/// Catches unstable rods instead of stable ones, and a search without result where an unstable one exists. A force
/// pointing back along the clamp turns a rod about its stiffer axis, up to about 120 degrees; beyond, the rod leaves
/// that plane. The integrals of a rod under a dead force, m . n = 0 and m . B^-1 m/2 + n . d3 = |n|, hold at the
/// clamp, and out of the plane the rod stores less than in it.
#[test]
#[ignore = "second tier: 5 s"]
fn forces_far_back_turn_rods_out_of_their_plane() {
    let bending = [1.0, 2.0];
    for (torsion, force) in [(1.5, 1e4), (1.5, 1e6), (0.4, 1e5), (8.0, 1e5)] {
        let mut out_of_plane = 0;
        for degrees in [90.0, 100.0, 125.0, 140.0, 155.0, 170.0, 179.0, 180.0_f64] {
            let angle = degrees.to_radians();
            let pull = if degrees < 180.0 {
                Vector3::new(angle.sin(), 0.0, angle.cos())
            } else {
                -Vector3::z()
            };
            let rod = Rod::new(1.0, Linear::diagonal(bending, torsion).unwrap()).unwrap();
            let load = EndConditions::load(pull * force, Vector3::zeros());
            let found = Problem::new(rod, load, 1e-12).unwrap().solve(None).unwrap();
            let what = format!("torsion {torsion}, force {force:e}, {degrees} degrees");
            assert_eq!(found.index, 0, "{what}");
            let m = Vector3::new(found.base[0], found.base[1], found.base[2]);
            let size = m.norm();
            small(&format!("{what}: m . n"), m.dot(&pull).abs() / size, 1e-9);
            let stored =
                0.5 * (m.x * m.x / bending[0] + m.y * m.y / bending[1] + m.z * m.z / torsion);
            let integral = stored / force + pull.z - 1.0;
            small(&format!("{what}: integral"), integral.abs(), 1e-9);
            // Energy stored by a pendulum of stiffness B from this angle on.
            let planar = |b: f64| 2.0 * (b * force).sqrt() * (1.0 - (0.5 * angle).cos());
            let none = |x: f64| x.abs() < 1e-6 * size;
            if !(none(m.z) && (none(m.x) || none(m.y))) {
                out_of_plane += 1;
                assert!(found.end.energy < planar(bending[1]), "{what}");
                assert!(found.end.energy > planar(bending[0]), "{what}");
            } else {
                let b = bending[usize::from(m.y.abs() > m.x.abs())];
                small(&what, (found.end.energy / planar(b) - 1.0).abs(), 1e-9);
            }
        }
        assert!(out_of_plane >= 3, "torsion {torsion}: {out_of_plane}");
    }
}

/// Catches a rod lost between two evaluations of a motion with a fast falling pull, where the guess leads to the other
/// side. A rod turned by more than pi from its clamp into the pull must be continued from one with two thirds of the
/// force, whose couple differs strongly.
#[test]
fn the_equilibrium_that_is_meant_is_led_to() {
    let rod = Rod::new(1.0, Linear::diagonal([1.2, 1.0], 0.8).unwrap()).unwrap();
    let pull = |lam: f64, angle: f64| Vector3::new(angle.sin(), 0.0, angle.cos()) * lam * lam;
    // Small steps: first about the clamp, then with more force.
    let turning = (0..=30).map(|k| (17.8, PI * (0.75 + 0.01 * f64::from(k))));
    let pulling = (1..=43).map(|k| (17.8 + 0.1 * f64::from(k), 1.05 * PI));
    let mut on_the_way: Vec<Taut> = Vec::new();
    for (lam, angle) in turning.chain(pulling) {
        let last = on_the_way.last();
        let m = last.map_or(Vector3::zeros(), |last| halves(&last.base).0);
        let found = rod.taut(&join(&m, &pull(lam, angle)), &FREE, last, 1e-12);
        on_the_way.push(found.unwrap());
    }
    let (far, meant) = (&on_the_way[30], &on_the_way[73]);
    let off = |found: &Taut| (found.base - meant.base).norm() / meant.base.norm();
    let led = rod.taut(&meant.base, &FREE, Some(far), 1e-12).unwrap();
    assert!(off(&led) < 1e-10, "{:.1e}", off(&led));
    assert!((led.end.position - meant.end.position).norm() < 1e-10);
    // The couple is that of the long way round.
    assert!(halves(&led.base).0.y > 0.0);
    let guessed = rod.taut(&meant.base, &FREE, None, 1e-12).unwrap();
    assert!(off(&guessed) > 0.1, "the guess serves as well");
}
