//! Bodies in grooves: comparison with another program, the balance of momenta, and the energy along the groove.

use crate::support::{json, number, rows, vector3, worst};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{Groove, PointMass, RigidBody};
use snaprod::motion::assembly::{AssemblyRun, AssemblySample};
use snaprod::motion::{Event, Motion, Options, Outcome, State};
use snaprod::rod::Rod;
use snaprod::section::Linear;

fn six(m: Vector3<f64>, n: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
}

/// A run to its last time: samples at `times`, change of the ledger's total, outcome.
fn course(
    assembly: &Assembly,
    now: &Configuration,
    times: &[f64],
    tolerance: f64,
) -> (Vec<AssemblySample>, f64, Outcome) {
    let end = *times.last().expect("a time");
    let options = Options::new(end).and_then(|o| o.with_tolerance(tolerance));
    let mut run =
        AssemblyRun::new(assembly.clone(), now, options.expect("options")).expect("a run");
    let total = run.now().ledger().total();
    let (mut samples, mut opened, mut next) = (Vec::new(), 0.0_f64, times.iter().peekable());
    loop {
        match run.advance().expect("an event") {
            Event::Step { to, .. } => {
                while let Some(t) = next.next_if(|t| **t <= to) {
                    samples.push(run.state_at(*t).expect("a state inside the step"));
                }
                opened = worst([opened, (run.now().ledger().total() - total).abs()]);
            }
            Event::Stop(outcome) => return (samples, opened, outcome),
            other => panic!("{other:?}"),
        }
    }
}

/// Would catch a groove drawn off the path of its body, drawn twice round, beyond its ends, or only along the path.
#[test]
fn a_groove_is_drawn_beside_the_way() {
    let line = Groove::line(Vector3::y(), Vector3::x() * 3.0).expect("a line");
    let drawn = line.points_along(&[Vector3::x(), -Vector3::x()], 0.5);
    let ends = [drawn[0], drawn[drawn.len() - 1]];
    assert!((ends[0] - Vector3::new(-1.5, 1.0, 0.0)).norm() < 1e-12);
    assert!((ends[1] - Vector3::new(1.5, 1.0, 0.0)).norm() < 1e-12);

    let circle = Groove::circle(Vector3::zeros(), Vector3::z(), 2.0, None).expect("a circle");
    let at = |phi: f64| circle.at(phi)[0];
    let long = |points: &[Vector3<f64>]| -> f64 {
        points
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).norm())
            .sum()
    };
    // Across the angle pi, where the nearest parameter jumps.
    let arc = circle.points_along(&[at(3.0), at(3.3)], 0.2);
    assert!((long(&arc) - 1.0).abs() < 1e-4, "{}", long(&arc));
    let round: Vec<Vector3<f64>> = (0..40).map(|k| at(0.4 * f64::from(k))).collect();
    let length = long(&circle.points_along(&round, 1.0));
    assert!(
        (length - 2.0 * std::f64::consts::TAU).abs() < 1e-2,
        "{length}"
    );

    let points = [[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
    let spline = Groove::spline(&points, false).expect("a spline");
    let drawn = spline.points_along(&[points[1]], 9.0);
    assert!((drawn[0] - points[0]).norm() < 1e-9);
    assert!((drawn[drawn.len() - 1] - points[2]).norm() < 1e-9);
    assert!(spline.points_along(&[], 1.0).is_empty());
}

/// Would catch a wrong curve, sign or mass in the equation along the groove, or a groove force that differs from the
/// other program's.
#[test]
fn a_mass_in_a_circular_groove_moves_as_another_program_has_it() {
    let data = json("space/support_groove_given.json");
    let cases = rows(&data, "cases", 4).iter();
    let mut count = 0;
    for case in cases.filter(|case| case["body"]["groove"].is_object()) {
        count += 1;
        let (row, start) = (&case["body"]["groove"], &case["start"]);
        let (centre, e1, e2) = (
            vector3(row, "centre"),
            vector3(row, "e1"),
            vector3(row, "e2"),
        );
        let radius = number(row, "radius");
        let groove = Groove::circle(centre, e1.cross(&e2), radius, Some(e1)).expect("a groove");
        let law = Linear::diagonal([1.0, 1.5], 0.7).and_then(|law| law.rigid([true; 3]));
        let rod = Rod::new(number(case, "length"), law.expect("a law")).expect("a rod");
        let here = Isometry3::identity();
        let (from, to) = (Attachment::ground(here), Attachment::body(0, here));
        let link = Link::new(rod, from, to, Joint::Ball);
        let units = link.units();
        let body = PointMass::new(number(&case["body"], "mass"))
            .and_then(|body| body.with_gravity(vector3(case, "gravity")));
        let carrier = Body::point(body.expect("a mass")).in_groove(groove.clone());
        let [x, along, _] = groove.at(number(start, "phi"));
        let wrench = |row: &Value| six(vector3(row, "couple"), vector3(row, "force"));
        let now = Configuration {
            bodies: vec![BodyMotion {
                pose: Isometry3::translation(x.x, x.y, x.z),
                twist: six(Vector3::zeros(), along * number(start, "phi_rate")),
            }],
            charts: vec![wrench(&start["base_wrench"]).component_div(&units)],
            spins: Vec::new(),
        };
        let assembly = Assembly::new(vec![carrier], vec![link]).expect("an assembly");
        let states = rows(case, "states", 5);
        let times: Vec<f64> = states.iter().map(|state| number(state, "t")).collect();
        let (samples, opened, outcome) = course(&assembly, &now, &times, 1e-11);
        assert_eq!(outcome, Outcome::EndOfTime);
        assert!(opened < 1e-10, "the ledger opens by {opened:e}");
        for (sample, state) in samples.iter().zip(states) {
            let (t, row) = (number(state, "t"), &rows(state, "bodies", 1)[0]);
            let place = &sample.at.now.bodies[0];
            let r = place.pose.translation.vector;
            let off = (r - vector3(row, "position")).norm();
            assert!(off < 1e-9, "t = {t}: the mass is {off:e} off");
            let v = place.twist.fixed_rows::<3>(3) - vector3(row, "velocity");
            assert!(
                v.norm() < 1e-8,
                "t = {t}: the velocity is {:e} off",
                v.norm()
            );
            let q = sample.at.now.charts[0].component_mul(&units);
            let given = wrench(&rows(state, "rods", 1)[0]["base_wrench_chart"]);
            let off = (q - given).norm() / given.norm();
            assert!(off < 1e-8, "t = {t}: the base wrench is {off:e} off");
            let force = sample.groove_forces()[0].expect("a groove");
            let off = (force - vector3(state, "constraint_force")).norm();
            assert!(
                off < 1e-7,
                "t = {t}: the force of the groove is {off:e} off"
            );
            let radial = ((r - centre).norm() - radius).abs();
            assert!(radial < 1e-15, "t = {t}: {radial:e} beside the groove");
        }
    }
    assert_eq!(count, 1, "the data have a groove");
}

/// A rigid body, its centre of mass off the groove, with a rotor and drag, on two rods.
fn slider(groove: Groove) -> (Assembly, Configuration) {
    let inertia = Matrix3::new(0.3, 0.02, 0.01, 0.02, 0.2, -0.03, 0.01, -0.03, 0.25);
    let body = RigidBody::new(2.0, inertia)
        .and_then(|body| body.with_centre(Vector3::new(0.2, -0.1, 0.15)))
        .and_then(|body| body.with_rotor(Vector3::new(0.1, 0.2, -0.3)))
        .and_then(|body| body.with_gravity(Vector3::new(0.1, 0.2, -0.7)))
        .and_then(|body| body.with_rotational_drag(0.05))
        .and_then(|body| body.with_drag(0.03));
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| law.with_shear([50.0, 60.0]))
        .and_then(|law| law.with_axial(80.0))
        .and_then(|law| law.with_rest([0.2, -0.3], 0.1))
        .expect("a law");
    let rod = || Rod::new(1.0, law).expect("a rod");
    let turned = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis);
    let at = |r: Vector3<f64>, turn| Isometry3::from_parts(r.into(), turn);
    let links = vec![
        Link::new(
            rod(),
            Attachment::ground(at(
                Vector3::new(0.0, 0.0, -0.1),
                turned(Vector3::new(0.2, 0.3, 0.0)),
            )),
            Attachment::body(
                0,
                at(
                    Vector3::new(0.1, 0.0, 0.0),
                    turned(Vector3::new(0.1, 0.4, 0.1)),
                ),
            ),
            Joint::Weld,
        ),
        Link::new(
            rod(),
            Attachment::ground(at(
                Vector3::new(0.9, 0.5, 1.2),
                turned(Vector3::new(2.5, 0.4, 0.3)),
            )),
            Attachment::body(0, at(Vector3::new(0.0, 0.2, 0.1), turned(Vector3::zeros()))),
            Joint::Ball,
        ),
    ];
    let carrier = Body::rigid(body.expect("a body")).in_groove(groove);
    let assembly = Assembly::new(vec![carrier], links).expect("an assembly");
    let found = assembly.equilibrium(None, 1e-11).expect("an equilibrium");
    assert_eq!(found.index, 0);
    (assembly, found.now)
}

fn wavy(closed: bool) -> Groove {
    let points = (0..9).map(|k| {
        let a = 0.7 * f64::from(k);
        Vector3::new(
            0.35 + 0.3 * a.cos(),
            0.3 * a.sin(),
            0.8 + 0.1 * (2.0 * a).sin(),
        )
    });
    Groove::spline(&points.collect::<Vec<_>>(), closed).expect("a groove")
}

/// Rates of momentum and of angular momentum about the centre of mass, by differences in time, equal the action of
/// rods, loads and groove; the groove force is normal to the groove. Would catch a groove force with a wrong lever or
/// mass, a spin without its share, knots inside steps, a groove that does work.
#[test]
fn a_rigid_body_in_a_groove_obeys_the_balance_of_momenta() {
    let circle = Groove::circle(
        Vector3::new(0.3, 0.1, 0.7),
        Vector3::new(0.3, -0.2, 1.0),
        0.4,
        None,
    );
    for groove in [wavy(true), circle.expect("a groove"), wavy(false)] {
        let (assembly, mut now) = slider(groove.clone());
        let r = now.bodies[0].pose.translation.vector;
        let along = groove.at(groove.nearest(&r))[1].normalize();
        let speed = if groove.period().is_some() { 2.0 } else { 0.3 };
        now.bodies[0].twist = six(Vector3::new(0.5, -1.0, 0.8), along * speed);
        let h = 1e-3;
        let times: Vec<f64> = [0.3, 0.7, 1.1]
            .iter()
            .flat_map(|t| [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| t + k * h))
            .collect();
        let (samples, opened, outcome) = course(&assembly, &now, &times, 1e-12);
        assert_eq!(outcome, Outcome::EndOfTime);
        assert!(opened < 1e-10, "the ledger opens by {opened:e}");
        let mass = assembly.carriers()[0].mass();
        let snaprod::body::Mass::Rigid(body) = mass else {
            panic!("a rigid body")
        };
        let momenta = |sample: &AssemblySample| {
            let BodyMotion { pose, twist } = sample.at.now.bodies[0];
            let turn = pose.rotation.to_rotation_matrix();
            let (omega, v) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
            let centre = v + omega.cross(&(turn * body.offset()));
            let spun = turn * (body.inertia() * (turn.transpose() * omega) + body.rotor());
            six(spun, centre * body.mass())
        };
        for five in samples.chunks(5) {
            let p: Vec<Vector6<f64>> = five.iter().map(momenta).collect();
            let rate = ((p[3] - p[1]) * 8.0 - (p[4] - p[0])) / (12.0 * h);
            let at = &five[2].at;
            let BodyMotion { pose, twist } = at.now.bodies[0];
            let rods = assembly.wrenches(&at.now.bodies, &at.points)[0];
            let force = five[2].groove_forces()[0].expect("a groove");
            let c = pose.rotation * body.offset();
            let (omega, v) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
            let (m, n) = (rods.fixed_rows::<3>(0), rods.fixed_rows::<3>(3));
            let end = n + force;
            let all = end + body.centre().load(0.0) - (v + omega.cross(&c)) * 0.03;
            let couple = m - c.cross(&end) - omega * 0.05;
            let off = (rate - six(couple, all)).norm() / (1.0 + force.norm());
            assert!(off < 1e-7, "momenta are {off:e} off");
            let tangent = groove.at(groove.nearest(&pose.translation.vector));
            let along = tangent[1].normalize().dot(&force) / (1.0 + force.norm());
            assert!(
                along.abs() < 1e-12,
                "the groove pushes along itself by {along:e}"
            );
            let beside = (tangent[0] - pose.translation.vector).norm();
            assert!(beside < 1e-14, "{beside:e} beside the groove");
        }
    }
}

/// The stiffness against second differences of the energy with the rods' ends held, at an equilibrium. Would catch a
/// groove without its curvature, interchanged freedoms of the body, and a false equilibrium.
#[test]
fn statics_in_a_groove_is_that_of_the_energy() {
    let (assembly, now) = slider(wavy(true));
    let carrier = &assembly.carriers()[0];
    let energy = |own: [f64; 4]| {
        let bodies = vec![BodyMotion::at_rest(
            carrier.moved(&now.bodies[0].pose, &own),
        )];
        let mut charts = now.charts.clone();
        for (link, q) in assembly.links().iter().zip(&mut charts) {
            let point = link.point(0.0, &bodies, q, 1e-14).expect("a rod");
            let held = point.base.pose.inv_mul(&point.tip.pose);
            *q = link.polished(q, &held, 1e-14).expect("an equilibrium");
        }
        let points = assembly.points(0.0, &bodies, &charts, 1e-14).expect("rods");
        let elastic: f64 = points.iter().map(|point| point.end.energy).sum();
        elastic + carrier.potential(0.0, &bodies[0].pose)
    };
    let points = assembly
        .points(0.0, &now.bodies, &now.charts, 1e-14)
        .expect("rods");
    let k = assembly
        .stiffness(0.0, &now.bodies, &points)
        .expect("a stiffness")
        .matrix;
    assert_eq!(k.shape(), (4, 4));
    assert!((&k - k.transpose()).amax() < 1e-9 * k.amax());
    let h = 2e-3;
    for i in 0..4 {
        for j in 0..=i {
            let at = |a: f64, b: f64| {
                let mut own = [0.0; 4];
                own[i] += a * h;
                own[j] += b * h;
                energy(own)
            };
            let cross =
                |s: f64| (at(s, s) - at(s, -s) - at(-s, s) + at(-s, -s)) / (4.0 * s * s * h * h);
            let second = (4.0 * cross(1.0) - cross(2.0)) / 3.0;
            // Half turns about two axes do not commute: rotation vectors along one another differ by second order only.
            let off = (second - k[(i, j)]).abs() / k.amax();
            assert!(
                off < 1e-6,
                "K_{i}{j} is {} and the energy's {second}",
                k[(i, j)]
            );
        }
    }
    // The lowest mode predicts a small motion: the energy of a start along the mode recurs.
    let modes = assembly.modes(&now, 1e-13).expect("modes");
    assert_eq!((modes.squares.len(), modes.stable), (4, true));
}

/// An open groove ends: would catch a body that leaves its groove, or an end that is found late.
#[test]
fn a_body_stops_at_the_end_of_its_groove() {
    let groove = wavy(false);
    let [begin, end] = groove.ends().expect("ends");
    let (assembly, mut now) = slider(groove.clone());
    let r = now.bodies[0].pose.translation.vector;
    let along = groove.at(groove.nearest(&r))[1].normalize();
    now.bodies[0].twist = six(Vector3::zeros(), along * 6.0);
    let options = Options::new(2.0).and_then(|o| o.with_tolerance(1e-11));
    let mut run = AssemblyRun::new(assembly, &now, options.expect("options")).expect("a run");
    let outcome = loop {
        if let Event::Stop(outcome) = run.advance().expect("an event") {
            break outcome;
        }
    };
    assert_eq!(outcome, Outcome::GrooveEnd(0));
    let last = run.sample_now();
    let r = last.at.now.bodies[0].pose.translation.vector;
    let off = [begin, end].map(|phi| (groove.at(phi)[0] - r).norm());
    assert!(off[0].min(off[1]) < 1e-13, "{off:?}");
    assert!(last.time() > 0.0 && last.time() < 2.0);
}

/// Splines: interpolation, four continuous derivatives, a circle to the order of the degree, correct ends. Would catch
/// a wrong coefficient or a wrong row of their equations.
#[test]
fn splines_are_smooth_and_go_through_their_points() {
    let on = |a: f64| Vector3::new(a.cos(), a.sin(), 0.3 * (2.0 * a).cos());
    let errors = [24, 48].map(|n: i32| {
        let points: Vec<_> = (0..n)
            .map(|k| on(std::f64::consts::TAU * f64::from(k) / f64::from(n)))
            .collect();
        let groove = Groove::spline(&points, true).expect("a groove");
        let mut worst = 0.0_f64;
        for k in 0..400 {
            let a = std::f64::consts::TAU * f64::from(k) / 400.0;
            let [x, ..] = groove.at(groove.nearest(&on(a)));
            worst = worst.max((x - on(a)).norm());
        }
        for point in &points {
            assert!((groove.at(groove.nearest(point))[0] - point).norm() < 1e-14);
        }
        worst
    });
    let order = (errors[0] / errors[1]).log2();
    assert!(order > 5.5, "order {order}, errors {errors:?}");
    for groove in [wavy(true), wavy(false)] {
        // Between knots, across them and round a closed curve the derivatives match differences of the values.
        let h = 1e-4;
        let mut phi = 0.01;
        while let Some(knot) = groove
            .first_break(phi, phi + 1.0)
            .filter(|knot| *knot < 2.5)
        {
            let [_, first, second] = groove.at(knot);
            let [before, after] = [groove.at(knot - h), groove.at(knot + h)];
            let slope = (after[0] - before[0]) / (2.0 * h) - first;
            let curve = (after[1] - before[1]) / (2.0 * h) - second;
            // Third and fourth derivatives continuous: second differences of x'' have one limit from both sides.
            let fourth = (after[2] - second * 2.0 + before[2]) / h;
            assert!(
                slope.norm() < 1e-5 && curve.norm() < 1e-4,
                "{slope} {curve}"
            );
            assert!(fourth.norm() < 0.2, "{fourth}");
            phi = knot;
        }
        assert!(phi > 1.0);
    }
    assert!(Groove::spline(&[Vector3::x(), Vector3::x(), Vector3::y()], false).is_err());
    assert!(Groove::circle(Vector3::zeros(), Vector3::z(), 1.0, Some(Vector3::z())).is_err());
    assert!(Groove::line(Vector3::zeros(), Vector3::zeros()).is_err());
}

/// The data's mass in its circular groove as scenes in odd units, alone and as an assembly, and a straight groove in
/// statics. Would catch a groove that is not scaled or not relative to its clamp, columns missing or in the wrong
/// axes, an accepted start beside the groove.
#[cfg(feature = "scene")]
#[test]
fn scenes_have_grooves_and_report_their_force() {
    use snaprod::scene::Scene;
    use snaprod::study::{Silent, Table, run};
    let data = json("space/support_groove_given.json");
    let mut cases = rows(&data, "cases", 4).iter();
    let case = cases.find(|case| case["body"]["groove"].is_object());
    let case = case.expect("a groove");
    // Length 0.4, force 0.03, mass 0.7; the clamp turned and moved.
    let (l, f, m) = (0.4, 0.03, 0.7_f64);
    let time = (m * l / f).sqrt();
    let clamp = Isometry3::from_parts(
        Vector3::new(0.1, -0.2, 0.3).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.9)),
    );
    let place = |x: Vector3<f64>| clamp.transform_point(&(x * l).into()).coords;
    let turned = |v: Vector3<f64>| clamp.rotation * v;
    let text = |v: Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
    let (groove, start) = (&case["body"]["groove"], &case["start"]);
    let (phi, rate) = (number(start, "phi"), number(start, "phi_rate"));
    let radius = number(groove, "radius");
    let centre = vector3(groove, "centre");
    let at = centre + Vector3::new(phi.cos(), phi.sin(), 0.0) * radius;
    let v = Vector3::new(-phi.sin(), phi.cos(), 0.0) * radius * rate * l / time;
    let ring = format!(
        "groove = {{ circle = {{ centre = {}, axis = {}, radius = {:?} }} }}\n",
        text(place(centre)),
        text(turned(Vector3::z())),
        radius * l
    );
    let b = f * l * l;
    let rod = format!(
        "model = \"cosserat\"\nlength = {l}\nsection = {{ bending = [{:?}, {:?}], torsion = {:?}, shear = \"rigid\", axial = \"rigid\" }}\n",
        b,
        1.5 * b,
        0.7 * b
    );
    let q = clamp.rotation;
    let pose = format!(
        "position = {}, quaternion = [{:?}, {:?}, {:?}, {:?}]",
        text(clamp.translation.vector),
        q.w,
        q.i,
        q.j,
        q.k
    );
    let gravity = text(turned(vector3(case, "gravity")) * (f / m));
    let last = format!(
        "[loads]\ngravity = {gravity}\n[run]\nduration = {:?}\nsamples = 9\ntolerance = 1e-10\n",
        2.0 * time
    );
    let parsed =
        |text: &str| Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let alone = |v: Vector3<f64>| {
        parsed(&format!(
            "[rod]\n{rod}[clamp]\n{}\n[body]\nmass = {m}\njoint = \"ball\"\n{ring}[start]\npose = {{ position = {} }}\nvelocity = {}\n{last}",
            pose.replace(", quaternion", "\nquaternion"),
            text(place(at)),
            text(turned(v))
        ))
    };
    let prepared = run::Prepared::new(&alone(v)).expect("a scene that runs");
    let mut tables: Vec<Table> = Vec::new();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a run");
    assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
    let vector = |table: &Table, names: [&str; 3], row: usize| {
        Vector3::from_fn(|i, _| table.reals(names[i])[row])
    };
    // The start agrees with the data if the search finds the same rod.
    let states = rows(case, "states", 5);
    for (row, state) in [(1, 0), (2, 1), (4, 2), (6, 3), (8, 4)] {
        let state = &states[state];
        let r = vector(&tables[0], ["x", "y", "z"], row);
        let want = place(vector3(&rows(state, "bodies", 1)[0], "position"));
        assert!((r - want).norm() < 1e-8 * l, "row {row}: {r} and {want}");
        let force = vector(&tables[0], ["gx", "gy", "gz"], row);
        let want = turned(vector3(state, "constraint_force")) * f;
        assert!(
            (force - want).norm() < 1e-6 * f,
            "row {row}: {force} and {want}"
        );
    }
    let beside = alone_beside(&parsed, &rod, &ring);
    let refusal = run::Prepared::new(&beside).and_then(|p| p.motion().map(drop));
    let message = refusal.expect_err("a start beside the groove").to_string();
    assert!(message.contains("beside its groove"), "{message}");
    // In the groove with a velocity across it: the message names the admissible direction.
    let across = |v| run::Prepared::new(&alone(v)).and_then(|p| p.motion().map(drop));
    let message = across(Vector3::z())
        .expect_err("a start across the groove")
        .to_string();
    let (_, list) = message.rsplit_once('[').expect("a direction");
    let (list, _) = list.split_once(']').expect("a direction");
    let along: Vec<f64> = list.split(", ").map(|x| x.parse().unwrap()).collect();
    let tangent = Vector3::new(-phi.sin(), phi.cos(), 0.0);
    assert!(
        Vector3::from_row_slice(&along).cross(&tangent).norm() < 1e-5,
        "{message}"
    );

    // An assembly at its equilibrium in a straight groove: the force along the groove vanishes.
    let text = format!(
        "[[rod]]\nname = \"r\"\n{}from = {{}}\nto = {{ body = \"m\", joint = \"ball\" }}\n\
         [[body]]\nname = \"m\"\nmass = {m}\ninertia = [0.02, 0.02, 0.02]\nforce = [0.1, 0.2, 0.0]\n\
         groove = {{ line = {{ point = [0.1, 0.0, 0.3], direction = [2.0, 1.0, 1.0] }} }}\n\
         [run]\nduration = 1.0\nsamples = 3\n",
        rod.replace("axial = \"rigid\"", "axial = 20.0")
    );
    let prepared = run::Prepared::new(&parsed(&text)).expect("a scene that runs");
    let mut tables: Vec<Table> = Vec::new();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a run");
    let [first, last] = [&record.branches[0].first, &record.last().last];
    let moved = first.bodies[0].pose.translation.vector - last.bodies[0].pose.translation.vector;
    assert!(moved.norm() < 1e-8, "it moves by {moved}");
    let force = vector(&tables[0], ["m.groove_x", "m.groove_y", "m.groove_z"], 2);
    assert!((force - first.bodies[0].groove.expect("a groove")).norm() < 1e-8);
    let direction = Vector3::new(2.0, 1.0, 1.0).normalize();
    assert!(force.norm() > 1e-3 && direction.dot(&force).abs() < 1e-12);
    let point = first.bodies[0].pose.translation.vector - Vector3::new(0.1, 0.0, 0.3);
    assert!((point - direction * direction.dot(&point)).norm() < 1e-15);
}

#[cfg(feature = "scene")]
fn alone_beside(
    parsed: &dyn Fn(&str) -> snaprod::scene::Scene,
    rod: &str,
    ring: &str,
) -> snaprod::scene::Scene {
    parsed(&format!(
        "[rod]\n{rod}[body]\nmass = 0.7\njoint = \"ball\"\n{ring}[start]\npose = {{ position = [0.1, 0.1, 0.3] }}\n[run]\nduration = 1.0\n"
    ))
}

/// Would catch a groove of two curves, of none, or one that cannot be made passing the reader; friction with a groove.
#[cfg(feature = "scene")]
#[test]
fn faulty_grooves_are_refused() {
    use snaprod::scene::Scene;
    let scene = |rod: &str, groove: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 1.0 }}\n{rod}\
             [body]\nmass = 1.0\njoint = \"ball\"\ngroove = {groove}\n[run]\nduration = 1.0\n"
        )
    };
    let ring = "{ circle = { axis = [0.0, 0.0, 1.0], radius = 0.5 } }";
    let friction = "damping = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]\n";
    for (rod, groove, field) in [
        ("", "{}", "body.groove"),
        (
            "",
            "{ circle = { radius = 0.5 } }",
            "body.groove.circle.axis",
        ),
        (
            "",
            "{ circle = { axis = [0.0, 0.0, 1.0], radius = -1.0 } }",
            "body.groove.circle.radius",
        ),
        (
            "",
            "{ line = { direction = [0.0, 0.0, 0.0] } }",
            "body.groove.line.direction",
        ),
        (
            "",
            "{ spline = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]] }",
            "body.groove.spline",
        ),
        (
            "",
            "{ spline = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]] }",
            "body.groove",
        ),
        (
            "",
            "{ line = { direction = [1.0, 0.0, 0.0] }, closed = true }",
            "body.groove.closed",
        ),
        (
            "",
            "{ line = { direction = [1.0, 0.0, 0.0] }, circle = { axis = [0.0, 0.0, 1.0], radius = 1.0 } }",
            "body.groove.circle",
        ),
        (friction, ring, "body.groove"),
        (
            "[clamp]\nmotion = { turn = { axis = [1.0, 0.0, 0.0], amplitude = 0.1, frequency = 1.0 } }\n",
            ring,
            "body.groove",
        ),
    ] {
        let faults = Scene::parse(&scene(rod, groove)).expect_err(groove);
        let found = faults.into_iter().any(|fault| fault.field == field);
        assert!(found, "{groove} gives {faults}");
    }
    assert!(Scene::parse(&scene("", ring)).is_ok());
}
