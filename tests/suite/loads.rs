//! Loads in time, follower loads and moving supports, in scenes: each compared with an equivalent scene or another
//! solution.

use crate::support::{assert_close, worst};
use nalgebra::{Complex, Quaternion, UnitQuaternion, Vector3};
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::assembly::equilibrium;
use snaprod::study::{self, Silent, Table, run};

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

/// The trajectory of a scene.
fn ran(text: &str) -> Table {
    let prepared = run::Prepared::new(&parsed(text)).expect(text);
    let mut tables: Vec<Table> = Vec::new();
    let fields = run::Fields::default();
    let record = run::run(&prepared, fields, &mut tables, &mut Silent).expect(text);
    assert_eq!(record.reason(), None);
    tables.remove(0)
}

/// Largest difference of columns of two tables, relative to the largest value of the second.
fn apart(one: &Table, other: &Table, names: &[(&str, &str)]) -> f64 {
    let columns = names
        .iter()
        .map(|(a, b)| (one.reals(a), other.reals(b)))
        .collect::<Vec<_>>();
    let size = |column: &[f64]| column.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let most = columns.iter().map(|(_, b)| size(b)).fold(1e-300, f64::max);
    let mut off: f64 = 0.0;
    for (a, b) in &columns {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().chain(b.iter()).all(|x| x.is_finite()));
        off = a
            .iter()
            .zip(*b)
            .fold(off, |off, (a, b)| off.max((a - b).abs()));
    }
    off / most
}

const ROD: &str = "model = \"cosserat\"\nlength = 0.8\nsection = { bending = [0.5, 0.7], torsion = 0.4, shear = [60.0, 70.0], axial = 150.0 }\n\
                   rest = { curvature = [0.6, -0.3], twist = 0.4 }\n";
const BODY: &str = "mass = 0.3\ninertia = [0.01, 0.012, 0.015]\noffset = [0.02, -0.03, 0.05]\n";
const MOTION: &str = "{ translate = [[0.0, 0.0, 0.0, 0.0], [0.4, 0.1, -0.05, 0.02], [0.9, 0.0, 0.1, 0.05]], \
                      turn = { axis = [0.3, 1.0, 0.2], amplitude = 0.4, frequency = 0.9, phase = 0.3 } }";
const TURNED: &str = "rotation = { axis = [1.0, 0.5, -0.2], angle = 0.7 }";
/// Forces and couples of every form, in the world and turning with the body.
const FORCE: &str = "[{ direction = [1.0, 0.0, 2.0], amplitude = 0.3, frequency = 1.1, phase = 0.2 }, \
                     { direction = [0.0, 1.0, 1.0], pulse = { at = 0.5, width = 0.4, amplitude = 0.6 }, follower = true }, \
                     { direction = [1.0, 1.0, 0.0], constant = 0.2, follower = true }]";
const COUPLE: &str = "[{ direction = [0.0, 0.3, 1.0], ramp = { to = 0.02, until = 0.6 } }, \
                      { direction = [1.0, 0.0, 0.0], table = [[0.1, 0.0], [0.5, 0.03], [0.8, -0.01]], follower = true }]";

/// One rod and one body in motion under all loads, as `[rod]` and as `[[rod]]`; the rod with the given mass and
/// distributed load.
fn both_ways(start: &str, mass: &str, along: &str) -> [String; 2] {
    let run = "[run]\nduration = 1.2\ntolerance = 1e-11\nsamples = 25\n";
    let gravity = "gravity = [0.0, -1.0, 2.0]";
    let velocity = "velocity = [0.1, 0.2, -0.3]\nangular_velocity = [0.5, -0.2, 0.4]";
    let drag = "drag = 0.05\nrotational_drag = 0.003";
    let place = format!("position = [0.1, 0.2, -0.3]\n{TURNED}");
    [
        format!(
            "[rod]\n{ROD}{mass}[clamp]\n{place}\nmotion = {MOTION}\n[body]\n{BODY}[loads]\n{gravity}\n{drag}\n{along}force = {FORCE}\n\
             couple = {COUPLE}\n[start]\n{start}\n{velocity}\n{run}"
        ),
        format!(
            "[[rod]]\nname = \"r\"\n{ROD}{mass}{along}from = {{ {}, motion = {MOTION} }}\nto = {{ body = \"b\" }}\n\
             [[body]]\nname = \"b\"\n{BODY}{drag}\nforce = {FORCE}\ncouple = {COUPLE}\n{velocity}\n\
             [loads]\n{gravity}\n[start]\n{start}\n{run}",
            place.replace('\n', ", ")
        ),
    ]
}

/// Catches a load, support or scale that the two kinds of scenes read, turn or measure differently: the single rod
/// uses the frame of its clamp with inertial forces on the body, an assembly the world frame. The second start is an
/// equilibrium with follower loads. With a distributed load, which turns relative to a moving clamp, the single rod
/// uses the world frame, too: catches a body, start or event left in the frame of the clamp.
#[test]
fn a_rod_moves_alike_in_both_kinds_of_scenes() {
    let along = "distributed = { polynomial = [[0.2, -0.1, 0.3], [0.0, 0.4, -0.2]] }\n";
    for (start, mass, along, bound) in [
        ("rest = \"straight\"", "", "", 1e-8),
        ("settled = true", "", "", 1e-8),
        (
            "settled = true",
            "mass = 0.02\ninertia = \"none\"\n",
            along,
            1e-9,
        ),
        (
            "settled = true",
            "mass = 0.02\ninertia = \"first-order\"\n",
            along,
            1e-9,
        ),
    ] {
        let [single, listed] = both_ways(start, mass, along);
        let (single, listed) = (ran(&single), ran(&listed));
        for group in [
            &[("b.x", "x"), ("b.y", "y"), ("b.z", "z")][..],
            &[
                ("b.qw", "qw"),
                ("b.qx", "qx"),
                ("b.qy", "qy"),
                ("b.qz", "qz"),
            ],
            &[("b.vx", "vx"), ("b.vy", "vy"), ("b.vz", "vz")],
            &[("b.wx", "wx"), ("b.wy", "wy"), ("b.wz", "wz")],
            &[("work", "work")],
            &[("dissipated", "dissipated")],
        ] {
            let off = apart(&listed, &single, group);
            assert!(off <= bound, "{start}, {group:?}: {off:e}");
        }
        for table in [&single, &listed] {
            let total = table.reals("total");
            let opened = worst(total.iter().map(|x| (x - total[0]).abs()));
            assert!(opened <= 1e-9, "{start}: the ledger opens by {opened:e}");
        }
        let work = listed.reals("work");
        assert!(work[work.len() - 1].abs() > 1e-2);
    }
}

/// Catches a planar rod that leaves its plane, or starts relative to the clamp without the clamp's motion. Under a
/// distributed load, on a clamp that shakes and turns, the rod equals a rod in space that is stiff out of its plane.
/// If `lambda` and `kappa` give the end position, they refer to the clamp at t = 0.
#[test]
fn planar_rods_bear_their_loads_on_clamps_that_turn() {
    let rod = |inertia: &str| format!("length = 0.8\nmass = 0.02\ninertia = \"{inertia}\"\n");
    let (shift, turn) = (
        0.25_f64,
        "amplitude = 0.5, frequency = 0.4, phase = 0.5235987755982988",
    );
    let moved = |zero: &str, axis: &str| {
        format!(
            "motion = {{ translate = [[0.0, 0.0, 0.0{zero}], [0.2, 0.01, -0.02{zero}], [0.5, 0.03, 0.0{zero}]], turn = {{ {axis}{turn} }} }}"
        )
    };
    let rest = "[run]\nduration = 0.25\ntolerance = 1e-10\nsamples = 6\n";
    let plane = |inertia: &str, clamp: &str, start: &str| {
        format!(
            "[rod]\nmodel = \"elastica\"\nbending_stiffness = 0.5\n{}[clamp]\nposition = [0.1, 0.2]\n{clamp}\n[body]\nmass = 0.3\n\
             [loads]\ngravity = [0.4, -1.0]\ndistributed = [0.3, -0.5]\n[start]\n{start}\nvelocity = [-0.1, 0.1]\n{rest}",
            rod(inertia)
        )
    };
    for inertia in ["none", "first-order"] {
        let single = ran(&plane(inertia, &moved("", ""), "settled = true"));
        let listed = ran(&format!(
            "[[rod]]\nname = \"r\"\nmodel = \"cosserat\"\nsection = {{ bending = [0.5, 5e3], torsion = 5e3 }}\n{}distributed = [0.3, -0.5, 0.0]\n\
             from = {{ position = [0.1, 0.2, 0.0], rotation = {{ axis = [1.0, 0.0, 1.0], angle_degrees = 180.0 }}, {} }}\n\
             to = {{ body = \"b\", joint = \"ball\" }}\n[[body]]\nname = \"b\"\nmass = 0.3\nvelocity = [-0.1, 0.1, 0.0]\n\
             [loads]\ngravity = [0.4, -1.0, 0.0]\n[start]\nsettled = true\n{rest}",
            rod(inertia),
            moved(", 0.0", "axis = [0.0, 0.0, 1.0], ")
        ));
        for group in [
            &[("b.x", "x"), ("b.y", "y")][..],
            &[("b.vx", "vx"), ("b.vy", "vy")],
            &[("work", "work"), ("total", "total")],
        ] {
            let off = apart(&listed, &single, group);
            assert!(off <= 1e-9, "{inertia}, {group:?}: {off:e}");
        }
        let total = single.reals("total");
        let opened = worst(total.iter().map(|x| (x - total[0]).abs()));
        assert!(opened <= 1e-10, "{inertia}: the ledger opens by {opened:e}");
    }
    let bent = "lambda = 1.5\nkappa = 0.5";
    let moving = ran(&plane("none", &moved("", ""), bent));
    let standing = ran(&plane("none", &format!("angle = {shift}"), bent));
    for name in ["x", "y"] {
        let off = moving.reals(name)[0] - standing.reals(name)[0];
        assert!(off.abs() < 1e-10, "{name}: {off:e}");
    }
}

/// Catches a wrong phase, frequency or sign of a shaken support: bodies on feet shaken together move, relative to the
/// feet, as under the force -m a sin''. The work of the supports is the difference of the energies.
#[test]
fn shaken_feet_are_an_inertial_force() {
    // The force is 0 at t = 0: both settle alike.
    let (amplitude, frequency, phase) = (0.08, 1.3, std::f64::consts::PI);
    let w = std::f64::consts::TAU * frequency;
    let masses = [0.3, 0.2];
    let scene = |shaken: bool| {
        let motion = if shaken {
            format!(
                ", motion = {{ translate = {{ direction = [2.0, 0.0, 1.0], amplitude = {amplitude}, frequency = {frequency}, phase = {phase} }} }}"
            )
        } else {
            String::new()
        };
        let force = |mass: f64| {
            if shaken {
                String::new()
            } else {
                format!(
                    "force = {{ direction = [2.0, 0.0, 1.0], amplitude = {:?}, frequency = {frequency}, phase = {phase} }}\n",
                    mass * amplitude * w * w
                )
            }
        };
        // Seen from the feet the bodies start with minus their velocity.
        let v = if shaken {
            0.0
        } else {
            -amplitude * w * phase.cos()
        };
        let v = Vector3::new(2.0, 0.0, 1.0).normalize() * v;
        let body = |name: &str, mass: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [0.01, 0.012, 0.015]\nvelocity = {:?}\n{}",
                v.as_slice(),
                force(mass)
            )
        };
        let feet = "rotation = { axis = [0.0, 1.0, 0.0], angle = 0.4 }";
        format!(
            "[[rod]]\nname = \"l\"\n{ROD}from = {{ position = [-0.4, 0.0, 0.0]{motion} }}\nto = {{ body = \"a\" }}\n\
             [[rod]]\nname = \"r\"\n{ROD}from = {{ body = \"a\", position = [0.0, 0.1, 0.0] }}\nto = {{ body = \"b\" }}\n\
             [[rod]]\nname = \"s\"\n{ROD}from = {{ body = \"b\", position = [0.1, 0.0, 0.0] }}\nto = {{ position = [0.5, 0.1, 0.3], {feet}{motion} }}\n\
             {}{}[run]\nduration = 0.7\ntolerance = 1e-10\nsamples = 8\n",
            body("a", masses[0]),
            body("b", masses[1])
        )
    };
    let (shaken, still) = (ran(&scene(true)), ran(&scene(false)));
    let direction = Vector3::new(2.0, 0.0, 1.0).normalize();
    let t = shaken.reals("t");
    for name in ["a", "b"] {
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            let column = format!("{name}.{axis}");
            let (a, b) = (shaken.reals(&column), still.reals(&column));
            for (i, t) in t.iter().enumerate() {
                let moved = direction[k] * amplitude * (w * t + phase).sin();
                assert_close(a[i] - moved, b[i], 1e-8, 1.0, &column);
            }
        }
    }
    // The work of the supports.
    let last = t.len() - 1;
    let energy = |table: &Table, i: usize| table.reals("kinetic")[i] + table.reals("elastic")[i];
    let work = shaken.reals("work")[last];
    assert_close(
        work,
        energy(&shaken, last) - energy(&shaken, 0),
        1e-8,
        1.0,
        "work",
    );
    assert!(work.abs() > 0.05);
}

/// Catches a frequency in radians instead of cycles, a lost phase, an amplitude times the length of its direction: a
/// mass driven across a straight rod, k = 3 EI/L^3, from rest.
#[test]
fn a_small_sine_drives_an_oscillator() {
    let (mass, amplitude, frequency) = (0.3, 2e-6, 0.7);
    let text = format!(
        "[[rod]]\nname = \"r\"\nmodel = \"cosserat\"\nlength = 0.8\nsection = {{ bending = [0.5, 0.5], torsion = 0.4, axial = 900.0 }}\n\
         from = {{}}\nto = {{ body = \"m\", joint = \"ball\" }}\n\
         [[body]]\nname = \"m\"\nmass = {mass}\n\
         force = {{ direction = [3.0, 0.0, 0.0], amplitude = {amplitude}, frequency = {frequency}, phase = 0.6 }}\n\
         [start]\nrest = \"straight\"\n[run]\nduration = 2.0\ntolerance = 1e-12\nsamples = 21\n"
    );
    let table = ran(&text);
    let own = (3.0 * 0.5 / (0.8_f64.powi(3) * mass)).sqrt();
    let (w, phase) = (std::f64::consts::TAU * frequency, 0.6_f64);
    let response = amplitude / (mass * (own * own - w * w));
    for (t, x) in table.reals("t").iter().zip(table.reals("m.x")) {
        let own_part = phase.sin() * (own * t).cos() + w / own * phase.cos() * (own * t).sin();
        let want = response * ((w * t + phase).sin() - own_part);
        assert_close(*x, want, 1e-6, response.abs(), "the mass");
    }
}

/// Catches a follower force that does not turn, or turns the wrong way: the equilibrium of one rod under
/// `end.follower`, solved from the loaded end, agrees with that of the assembly; neither has a decisive index.
#[test]
fn follower_loads_at_rest_are_those_of_one_rod() {
    let (force, couple) = ([0.4, -0.7, 0.5], [0.1, 0.05, -0.2]);
    let place = format!("position = [0.1, 0.2, -0.3]\n{TURNED}");
    let single = format!(
        "[rod]\n{ROD}[clamp]\n{place}\n[end]\nforce = {force:?}\ncouple = {couple:?}\nfollower = true\n"
    );
    let size = |v: [f64; 3]| Vector3::from(v).norm();
    let listed = format!(
        "[[rod]]\nname = \"r\"\n{ROD}from = {{ {} }}\nto = {{ body = \"b\" }}\n[[body]]\nname = \"b\"\nmass = 0.3\n\
         inertia = [0.01, 0.012, 0.015]\nforce = {{ direction = {force:?}, constant = {:?}, follower = true }}\n\
         couple = {{ direction = {couple:?}, constant = {:?}, follower = true }}\n",
        place.replace('\n', ", "),
        size(force),
        size(couple)
    );
    let want = study::equilibrium(&parsed(&single))
        .expect("one rod")
        .summary();
    let found = equilibrium(&parsed(&listed)).expect("an assembly");
    let summary = found.summary();
    assert!(summary["stable"].is_null() && want["stable"].is_null());
    let list = |v: &serde_json::Value| crate::support::list(v);
    let (r, q) = (list(&want["position"]), list(&want["quaternion"]));
    let pose = found.bodies[0].1;
    let off = (pose.translation.vector - Vector3::from_column_slice(&r)).norm();
    assert!(off <= 1e-9, "{off:e} off");
    let q = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    assert!(pose.rotation.angle_to(&q) <= 1e-9);
    let wrench = &summary["rods"]["r"]["base_wrench"];
    for (name, part) in [("force", "base_force"), ("couple", "base_couple")] {
        for (got, want) in list(&wrench[name]).iter().zip(list(&want[part])) {
            assert_close(*got, want, 1e-8, 1.0, name);
        }
    }
}

/// s with Im s >= 0 of M x'' + K x = 0, M = diag(m, j): from the quadratic of s^2.
fn roots_of(k: [[f64; 2]; 2], m: f64, j: f64) -> Vec<Complex<f64>> {
    let trace = k[0][0] / m + k[1][1] / j;
    let det = (k[0][0] * k[1][1] - k[0][1] * k[1][0]) / (m * j);
    let inner = Complex::from(0.25 * trace * trace - det).sqrt();
    let squares = [0.5 * trace + inner, 0.5 * trace - inner].map(|square| -square);
    let all = squares
        .iter()
        .flat_map(|square| [square.sqrt(), -square.sqrt()]);
    all.filter(|s| s.im >= -1e-12 * s.norm()).collect()
}

/// Catches a follower that does not turn with the body in small motions, or a stiffness treated as symmetric. A column
/// with a body on its end under a follower force along it, by the stiffness of beam-columns, below and in flutter;
/// straight and inextensible, so that only the compliance exists. As one rod and as an assembly.
#[test]
fn a_column_under_a_follower_flutters() {
    let (length, bending, torsion) = (0.8_f64, [0.5, 0.7_f64], 0.4);
    let (mass, inertia) = (0.3, [0.010, 0.012, 0.015]);
    let mut fluttered = 0;
    for push in [2.0, 7.0, 14.0_f64] {
        let mut want = vec![Complex::new(0.0, (torsion / length / inertia[2]).sqrt())];
        // Bent about d1 the inertia is that about d1.
        for axis in 0..2 {
            let k = (push / bending[axis]).sqrt();
            let (sin, cos) = (k * length).sin_cos();
            let phi = 2.0 - 2.0 * cos - k * length * sin;
            let stiff = |by: f64| bending[axis] * by / phi;
            let across = -stiff(k * k * (1.0 - cos));
            let stiffness = [
                [stiff(k.powi(3) * sin), across + push],
                [across, stiff(k * (sin - k * length * cos))],
            ];
            want.extend(roots_of(stiffness, mass, inertia[axis]));
        }
        let growing = want.iter().any(|s| s.re > 1e-6);
        fluttered += usize::from(growing);
        let rod = format!(
            "model = \"cosserat\"\nlength = {length}\nsection = {{ bending = {bending:?}, torsion = {torsion} }}\n"
        );
        let body = format!("mass = {mass}\ninertia = {inertia:?}\n");
        let load = format!(
            "force = {{ direction = [0.0, 0.0, -1.0], constant = {push}, follower = true }}\n"
        );
        let run = "[run]\nduration = 1.0\n";
        for text in [
            format!(
                "[[rod]]\nname = \"r\"\n{rod}from = {{}}\nto = {{ body = \"b\" }}\n[[body]]\nname = \"b\"\n{body}{load}"
            ),
            format!("[rod]\n{rod}[body]\n{body}[loads]\n{load}[start]\nsettled = true\n{run}"),
        ] {
            let record = study::modes(&parsed(&text)).expect(&text);
            let found = record.motions.eigenvalues.as_ref().expect("eigenvalues");
            assert_eq!(found.len(), want.len(), "{found:?} {want:?}");
            for s in &want {
                let off = found
                    .iter()
                    .map(|at| (at - s).norm())
                    .fold(f64::INFINITY, f64::min);
                assert!(
                    off <= 1e-6 * s.norm(),
                    "push {push}: {s} is {off:e} off in {found:?}"
                );
            }
            assert_eq!(record.motions.stable, !growing, "push {push}");
            let summary = record.summary();
            let rates = crate::support::list(&summary["decay_rates"]);
            assert_eq!(rates.iter().any(|rate| *rate < -1e-6), growing);
            assert!(
                summary["angular_frequencies"]
                    .as_array()
                    .is_some_and(|all| !all.is_empty())
            );
        }
    }
    assert!((1..3).contains(&fluttered), "{fluttered}");
}

/// Catches a meaningless load or motion that is accepted, and a fault reported at another place.
#[test]
fn loads_and_supports_without_meaning_are_refused() {
    let rod = format!("[[rod]]\nname = \"r\"\n{ROD}from = {{ }}\nto = {{ body = \"b\" }}\n");
    let rigid = "[[body]]\nname = \"b\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n";
    let point = "[[body]]\nname = \"b\"\nmass = 1.0\n";
    let run = "[run]\nduration = 1.0\n";
    let sine = "{ direction = [1.0, 0.0, 0.0], amplitude = 1.0, frequency = 1.0 }";
    let motion = "motion = { turn = { axis = [0.0, 0.0, 1.0], rate = 1.0 } }";
    let moving = |at: &str| {
        rod.replace(
            at,
            &at.replace('}', &format!(", {motion} }}"))
                .replace("{ ,", "{"),
        )
    };
    assert!(Scene::parse(&(moving("from = { }") + rigid + run)).is_ok());
    for (text, kind, field) in [
        (
            moving("from = { }") + rigid,
            FaultKind::Conflict,
            "rod[0].from.motion",
        ),
        (
            moving("to = { body = \"b\" }") + rigid + run,
            FaultKind::Conflict,
            "rod[0].to.motion",
        ),
        (
            rod.clone() + rigid + "force = " + sine,
            FaultKind::Conflict,
            "body[0].force",
        ),
        (
            rod.replace("\"b\"", "\"b\", joint = \"ball\"")
                + point
                + "force = { direction = [1.0, 0.0, 0.0], constant = 1.0, follower = true }",
            FaultKind::Conflict,
            "body[0].force.follower",
        ),
        (
            rod.clone()
                + rigid
                + "couple = [{ direction = [1.0, 0.0, 0.0], constant = 1.0, amplitude = 2.0 }]",
            FaultKind::Conflict,
            "body[0].couple[0].amplitude",
        ),
        (
            rod.clone() + rigid + "force = [1.0, 2.0]",
            FaultKind::Value,
            "body[0].force",
        ),
        (
            rod.clone() + rigid + "couple = \"much\"",
            FaultKind::Type,
            "body[0].couple",
        ),
    ] {
        let faults = Scene::parse(&text).expect_err(&text);
        let list: Vec<_> = faults
            .into_iter()
            .map(|f| (f.kind, f.field.clone()))
            .collect();
        assert_eq!(list, [(kind, field.to_owned())], "{text}");
    }
}

/// Catches a load field that is written but not read again.
#[test]
fn a_resolved_scene_keeps_its_loads() {
    for text in both_ways("settled = true", "", "") {
        let scene = parsed(&text);
        let written = toml::to_string(&scene).expect("TOML");
        assert_eq!(parsed(&written), scene, "{written}");
    }
}
