//! Scenes of several rods and bodies: reading, building and scaling as in data of other programs (tests/data/space),
//! and refusal of scenes that make no assembly.

use crate::support::{json, list, number, quaternion, rows, vector3};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::assembly::equilibrium;
use snaprod::study::{Silent, Table, run};
use std::fmt::Write;
use std::path::Path;

/// Units of length, force and mass in which the numbers of a file are written.
#[derive(Clone, Copy)]
struct System {
    length: f64,
    force: f64,
    mass: f64,
}

const PLAIN: System = System {
    length: 1.0,
    force: 1.0,
    mass: 1.0,
};
/// No unit is 1 or a power of another.
const ODD: System = System {
    length: 0.4,
    force: 0.03,
    mass: 0.7,
};

impl System {
    fn time(self) -> f64 {
        (self.mass * self.length / self.force).sqrt()
    }
}

fn times(x: &[f64], by: f64) -> String {
    let numbers: Vec<String> = x.iter().map(|x| format!("{:?}", x * by)).collect();
    format!("[{}]", numbers.join(", "))
}

fn site(row: &Value, u: System) -> String {
    let on = row["on"].as_str().expect("on");
    let body = match on.strip_prefix("body ") {
        Some(number) => format!("body = \"b{number}\", "),
        None => String::new(),
    };
    format!(
        "{{ {body}position = {}, quaternion = {} }}",
        times(&list(&row["position"]), u.length),
        times(&list(&row["quaternion"]), 1.0)
    )
}

/// A network of the data files as a scene, with velocities if there is a start.
fn text(network: &Value, start: Option<&Value>, u: System) -> String {
    let mut text = String::new();
    let gravity = times(&list(&network["gravity"]), u.force / u.mass);
    writeln!(text, "[loads]\ngravity = {gravity}").expect("text");
    let bending = u.force * u.length * u.length;
    for (k, rod) in rows(network, "rods", 2).iter().enumerate() {
        let (stiffness, rest) = (list(&rod["stiffness"]), list(&rod["rest_curvature_u0"]));
        write!(
            text,
            "[[rod]]\nname = \"r{k}\"\nmodel = \"cosserat\"\nlength = {:?}\n\
             section = {{ bending = {}, torsion = {:?}, shear = {}, axial = {:?} }}\n\
             rest = {{ curvature = {}, twist = {:?} }}\nfrom = {}\nto = {}\n",
            number(rod, "length") * u.length,
            times(&stiffness[..2], bending),
            stiffness[2] * bending,
            times(&stiffness[3..5], u.force),
            stiffness[5] * u.force,
            times(&rest[..2], 1.0 / u.length),
            rest[2] / u.length,
            site(&rod["base"], u),
            site(&rod["end"], u),
        )
        .expect("text");
    }
    for (k, body) in rows(network, "bodies", 1).iter().enumerate() {
        let inertia = list(&body["inertia_about_com"]);
        let by = u.mass * u.length * u.length;
        let inertia: Vec<String> = inertia.chunks(3).map(|row| times(row, by)).collect();
        write!(
            text,
            "[[body]]\nname = \"b{k}\"\nmass = {:?}\ninertia = [{}]\noffset = {}\nforce = {}\n",
            number(body, "mass") * u.mass,
            inertia.join(", "),
            times(&list(&body["com_offset"]), u.length),
            times(&list(&body["dead_force_at_com"]), u.force),
        )
        .expect("text");
        if let Some(start) = start {
            let row = &rows(start, "bodies", 1)[k];
            // In the data along the axes of the body.
            let omega = quaternion(row, "quaternion") * vector3(row, "angular_velocity");
            writeln!(
                text,
                "velocity = {}\nangular_velocity = {}",
                times(&list(&row["velocity"]), u.length / u.time()),
                times(omega.as_slice(), 1.0 / u.time()),
            )
            .expect("text");
        }
    }
    text
}

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn bundled(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Scene::read(&path.join(name)).expect("a scene")
}

/// Position, relative to a length, and rotation against a row of the data.
fn assert_pose(
    position: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    row: &Value,
    u: System,
    what: &str,
    tolerance: f64,
) {
    let off = (position / u.length - vector3(row, "position")).norm();
    assert!(off <= tolerance, "{what}: {off:e} off");
    let off = turn.angle_to(&quaternion(row, "quaternion"));
    assert!(off <= tolerance, "{what}: turned {off:e} too far");
}

/// Would catch a wrong scale, place, frame or load anywhere between a scene of statics and the library: a platform on
/// three rods, in plain and in odd units, and the bundled one.
#[test]
fn platforms_rest_as_another_program_has_it() {
    let data = json("space/network_statics_given.json");
    let cases = rows(&data, "cases", 6);
    for (case, u) in [(0, PLAIN), (0, ODD), (1, PLAIN), (2, ODD)] {
        let case = &cases[case];
        let (name, given) = (case["name"].as_str().expect("a name"), &case["equilibrium"]);
        let found = equilibrium(&parsed(&text(&case["network"], None, u))).expect(name);
        let pose = found.bodies[0].1;
        let row = &rows(given, "bodies", 1)[0];
        assert_pose(pose.translation.vector, pose.rotation, row, u, name, 1e-9);
        assert_eq!(found.index, 0, "{name}");
        let summary = found.summary();
        for (k, row) in rows(given, "rods", 3).iter().enumerate() {
            // The chart of the data is along the directors of the base.
            let wrench = &summary["rods"][format!("r{k}")]["base_wrench_in_directors"];
            let row = &row["base_wrench_chart"];
            let off = vector3(wrench, "force") / u.force - vector3(row, "force");
            assert!(
                off.norm() <= 1e-8,
                "{name}: a force is {:e} off",
                off.norm()
            );
            let off = vector3(wrench, "couple") / (u.force * u.length) - vector3(row, "couple");
            assert!(
                off.norm() <= 1e-8,
                "{name}: a couple is {:e} off",
                off.norm()
            );
        }
    }
    let (found, given) = (
        equilibrium(&bundled("platform.toml")),
        &cases[0]["equilibrium"],
    );
    let pose = found.expect("platform.toml").bodies[0].1;
    let row = &rows(given, "bodies", 1)[0];
    assert_pose(
        pose.translation.vector,
        pose.rotation,
        row,
        PLAIN,
        "platform.toml",
        1e-9,
    );
}

/// Would catch a lost guess, a wrong ball joint, and a difference made by starting a rod at its other end: the deep
/// arch of another program, its hinged half from the crown to the hinge and from the hinge to the crown.
#[test]
fn the_arch_leans_as_another_program_has_it() {
    let data = json("space/network_statics_given.json");
    let point = &rows(&data["cases"][5], "points", 1)[0];
    let scene = bundled("arch.toml");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arch.toml");
    let text = std::fs::read_to_string(path).expect("arch.toml");
    // Half a turn about d1: the directors of the rod started at its other end.
    let half = |q: [f64; 4]| {
        let turned = Quaternion::new(q[0], q[1], q[2], q[3]) * Quaternion::new(0.0, 1.0, 0.0, 0.0);
        times(&[turned.w, turned.i, turned.j, turned.k], 1.0)
    };
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let crown = format!(
        "body = \"crown\", quaternion = {}",
        half([root, 0.0, root, 0.0])
    );
    let (head, tail) = text.split_at(text.find("# from the crown").expect("the hinged rod"));
    let tail = tail.replace(
        "from = { body = \"crown\", quaternion = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0] }",
        "from = { position = [0.9537169507482269, 0.0, -0.3007057995042731], joint = \"ball\" }",
    );
    let tail = tail.replace(
        "to = { position = [0.9537169507482269, 0.0, -0.3007057995042731], joint = \"ball\" }",
        &format!("to = {{ {crown} }}"),
    );
    let turned = parsed(&format!("{head}{tail}"));
    let (one, other) = (
        equilibrium(&scene).expect("the arch"),
        equilibrium(&turned).expect("the arch from its hinge"),
    );
    let lean =
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), number(point, "rotation_about_y"));
    for found in [&one, &other] {
        let pose = found.bodies[0].1;
        let off = (pose.translation.vector - vector3(point, "position")).norm();
        assert!(off <= 1e-9, "the crown is {off:e} off");
        let off = pose.rotation.angle_to(&lean);
        assert!(off <= 1e-9, "the crown is turned {off:e} too far");
        assert_eq!(found.index, 0);
    }
    // The hinge bears no couple; the force is that on the crown, reversed.
    let (at_crown, at_hinge) = (one.rods[1].1, other.rods[1].1);
    let (couple, force) = (at_hinge.fixed_rows::<3>(0), at_hinge.fixed_rows::<3>(3));
    assert!(
        couple.norm() <= 1e-9,
        "a couple {:e} at the hinge",
        couple.norm()
    );
    let off = (force + at_crown.fixed_rows::<3>(3)).norm();
    assert!(off <= 1e-8, "the force at the hinge is {off:e} off");
    // Both are drawn from base to end.
    let ends = |found: &snaprod::study::assembly::AssemblyEquilibriumRecord| {
        let shape = &found.shapes[1];
        [shape[0].1, shape[shape.len() - 1].1].map(|pose| pose.translation.vector)
    };
    let ([crown, hinge], [first, last]) = (ends(&one), ends(&other));
    assert!((crown - last).norm() <= 1e-8 && (hinge - first).norm() <= 1e-8);
}

/// Would catch a wrong start, velocity, time scale or column of the trajectory: a chain released unloaded, and a body
/// on two rods struck at its equilibrium.
#[test]
fn chains_and_loops_move_as_another_program_has_it() {
    let data = json("space/network_motion_given.json");
    let cases = rows(&data, "cases", 2);
    for (case, start, u) in [
        (0, "rest = \"straight\"", PLAIN),
        (0, "rest = \"straight\"", ODD),
        (1, "settled = true", ODD),
    ] {
        let case = &cases[case];
        let name = case["name"].as_str().expect("a name");
        let text = format!(
            "{}[start]\n{start}\n[run]\nduration = {:?}\ntolerance = 1e-11\nsamples = 7\n",
            text(&case["network"], Some(&case["start"]), u),
            1.5 * u.time()
        );
        let prepared = run::Prepared::new(&parsed(&text)).expect(name);
        let mut tables: Vec<Table> = Vec::new();
        let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect(name);
        assert_eq!(record.reason(), None, "{name}");
        let table = &tables[0];
        for state in rows(case, "states", 5) {
            let row = (number(state, "t") / 0.25).round() as usize;
            for (k, body) in rows(state, "bodies", 1).iter().enumerate() {
                let at = |column: &str| table.reals(&format!("b{k}.{column}"))[row];
                let what = format!("{name}, t = {}", number(state, "t"));
                let r = Vector3::new(at("x"), at("y"), at("z"));
                let q = Quaternion::new(at("qw"), at("qx"), at("qy"), at("qz"));
                let q = UnitQuaternion::from_quaternion(q);
                assert_pose(r, q, body, u, &what, 1e-8);
                let v = Vector3::new(at("vx"), at("vy"), at("vz")) * (u.time() / u.length);
                let off = (v - vector3(body, "velocity")).norm();
                assert!(off <= 1e-8, "{what}: a velocity is {off:e} off");
                let w = Vector3::new(at("wx"), at("wy"), at("wz")) * u.time();
                let off = (w - q * vector3(body, "angular_velocity")).norm();
                assert!(off <= 1e-8, "{what}: an angular velocity is {off:e} off");
            }
        }
    }
}

/// Would catch a field that is written but not read again, or read and lost.
#[test]
fn a_resolved_assembly_is_the_same_scene() {
    for name in ["platform.toml", "arch.toml"] {
        let scene = bundled(name);
        let text = toml::to_string(&scene).expect("TOML");
        assert_eq!(parsed(&text), scene, "{name}");
    }
}

/// The faults of a scene: line, kind, field.
fn faults(text: &str) -> Vec<(usize, FaultKind, String)> {
    let faults = Scene::parse(text).expect_err("faults");
    let list = faults.into_iter();
    list.map(|fault| (fault.line, fault.kind, fault.field.clone()))
        .collect()
}

const ROD: &str =
    "model = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n";

/// Would catch a fault that hides another, or is reported at the wrong place. Faults: a misspelt body, a duplicate
/// name, a rod welded to a point mass, an impossible inertia, friction, and a body without rods.
#[test]
fn every_fault_of_an_assembly_is_found_at_once() {
    let text = format!(
        "[[rod]]\nname = \"a\"\n{ROD}from = {{}}\nto = {{ body = \"plattform\" }}\n\
         [[rod]]\nname = \"a\"\n{ROD}from = {{}}\nto = {{ body = \"mass\", joint = \"weld\" }}\ndamping = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]\n\
         [[body]]\nname = \"platform\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.3]\n\
         [[body]]\nname = \"mass\"\nmass = 1.0\nvelocity = [1.0, 0.0, 0.0]\n"
    );
    let found = faults(&text);
    let want = [
        (7, FaultKind::Unknown, "rod[0].to.body"),
        (9, FaultKind::Conflict, "rod[1].name"),
        (14, FaultKind::Conflict, "rod[1].to.joint"),
        (15, FaultKind::Conflict, "rod[1].damping"),
        (19, FaultKind::Value, "body[0].inertia"),
        (23, FaultKind::Conflict, "body[1].velocity"),
    ];
    for (line, kind, field) in want {
        let fault = (line, kind, field.to_owned());
        assert!(found.contains(&fault), "{fault:?} is not in {found:?}");
    }
    assert_eq!(found.len(), want.len(), "{found:?}");
    let message = Scene::parse(&text).expect_err("faults").to_string();
    assert!(message.contains("did you mean \"platform\"?"), "{message}");
}

/// Would catch an impossible inertia accepted in one kind of scene only, and a needle refused with the sole advice to
/// make it a point mass.
#[test]
fn an_inertia_is_that_of_a_body_whatever_carries_it() {
    let rest = "[start]\nrest = \"straight\"\n[run]\nduration = 1.0\n";
    let said = |inertia: &str| {
        let body = format!("mass = 1.0\ninertia = {inertia}\n{rest}");
        let single = format!("[rod]\n{ROD}[body]\n{body}");
        let several = format!(
            "[[rod]]\nname = \"a\"\n{ROD}from = {{}}\nto = {{ body = \"m\" }}\n[[body]]\nname = \"m\"\n{body}"
        );
        [single, several].map(|text| Scene::parse(&text).err().map(|faults| faults.to_string()))
    };
    assert_eq!(said("[0.1, 0.1, 0.2]"), [None, None]);
    let tilted = "[[0.2, 0.1, 0.0], [0.1, 0.2, 0.0], [0.0, 0.0, 0.05]]";
    for inertia in ["[0.1, 0.1, 0.3]", tilted] {
        for message in said(inertia) {
            let message = message.expect("faults");
            let both = [
                "its principal moments are ",
                "at most the sum of the other two",
            ];
            assert!(
                both.iter().all(|words| message.contains(words)),
                "{message}"
            );
        }
    }
    let needle = said("[0.1, 0.1, 0.0]").map(|message| message.expect("faults"));
    for message in &needle {
        let both = ["needle", "mass * diameter^2 / 8"];
        assert!(
            both.iter().all(|words| message.contains(words)),
            "{message}"
        );
    }
    assert!(needle[0].contains("joint = \"ball\"") && needle[1].contains("leave the inertia out"));
}

/// Would catch an impossible assembly that passes the reader, with faults visible only in all rods together.
#[test]
fn rods_must_make_an_assembly() {
    let body = |name: &str| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n")
    };
    let rod = |name: &str, from: &str, to: &str| {
        format!("[[rod]]\nname = \"{name}\"\n{ROD}from = {{ {from} }}\nto = {{ {to} }}\n")
    };
    let on = |name: &str| format!("body = \"{name}\"");
    let tree = rod("r", "", &on("a")) + &body("a");
    assert!(Scene::parse(&tree).is_ok());
    for (text, line, field) in [
        (tree.clone() + &body("b"), 12, "body[1]"),
        (
            tree.clone() + &rod("s", &on("b"), &on("c")) + &body("b") + &body("c"),
            19,
            "body[1]",
        ),
        (
            tree.clone() + &rod("s", &on("a"), &on("a")),
            18,
            "rod[1].to",
        ),
        (
            tree.clone()
                + &rod("s", "", &on("a"))
                + "[run]\nduration = 1.0\n[start]\nrest = \"straight\"\n",
            22,
            "start.rest",
        ),
        (tree.clone() + "guess = { }\n", 12, "body[0].guess.position"),
        (tree.clone() + "[clamp]\nangle = 0.0\n", 12, "clamp"),
        (tree.replace("[[body]]", "[body]"), 8, "body"),
    ] {
        let found = faults(&text);
        let told = found.iter().any(|(l, _, f)| *l == line && f == field);
        assert!(told, "{field} in line {line} is not in {found:?}\n{text}");
    }
}

/// Would catch a snap without its wrenches, or with those of another unit, end or frame: the flywheel as one rod on a
/// tilted clamp, and as an assembly.
#[test]
fn a_snap_tells_the_wrenches_of_its_rod() {
    let rod = "model = \"cosserat\"\nlength = 0.5\nsection = { bending = [1.2, 1.0], torsion = 0.7, shear = [600.0, 720.0], axial = 1400.0 }\n\
               rest = { curvature = [0.6, -0.4], twist = 0.4 }\n";
    let body = "mass = 60.0\ninertia = [2.5, 2.5, 0.15]\n";
    let place = "position = [0.3, -0.1, 0.2]\nrotation = { axis = [1.0, 2.0, -0.5], angle = 0.8 }";
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(1.0, 2.0, -0.5).normalize() * 0.8);
    let spin = turn * Vector3::new(0.0, 0.0, 51.0);
    let rest = "rest = \"straight\"\n";
    let run_for = "[run]\nduration = 0.35\ntolerance = 1e-9\nsamples = 3\n";
    let spin = format!("angular_velocity = {:?}\n", spin.as_slice());
    let single =
        format!("[rod]\n{rod}[clamp]\n{place}\n[body]\n{body}[start]\n{rest}{spin}{run_for}");
    let listed = format!(
        "[[rod]]\nname = \"axle\"\n{rod}from = {{ {} }}\nto = {{ body = \"wheel\" }}\n[[body]]\nname = \"wheel\"\n{body}{spin}[start]\n{rest}{run_for}",
        place.replace('\n', ", ")
    );
    let mut tables: Vec<Table> = Vec::new();
    let prepared = run::Prepared::new(&parsed(&single)).expect("one rod");
    let fields = run::Fields::default();
    let want = run::run(&prepared, fields, &mut tables, &mut Silent)
        .expect("one rod")
        .events();
    let prepared = run::Prepared::new(&parsed(&listed)).expect("an assembly");
    let found = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent)
        .expect("an assembly")
        .events();
    assert!(!want.is_empty(), "no snap");
    assert_eq!(want.len(), found.len());
    for (want, found) in want.iter().zip(&found) {
        assert_eq!(found["rod"], "axle");
        for side in ["from", "to"] {
            let (want, found) = (&want[side], &found[side]);
            for part in ["couple", "force"] {
                let (a, b) = (list(&want[part]), list(&found[part]));
                assert_eq!(b.len(), 3);
                let size = a.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
                for (a, b) in a.iter().zip(&b) {
                    assert!((a - b).abs() <= 1e-5 * size, "{side} {part}: {a} {b}");
                }
            }
            let off = number(want, "elastic") - number(found, "elastic");
            assert!(off.abs() <= 1e-7 * number(want, "elastic"), "{off:e}");
        }
    }
}

/// Would catch a message that calls a rod by number instead of name.
#[test]
fn a_start_that_fails_is_told_by_names() {
    let straight = "[[rod]]\nname = \"mast\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n\
                    from = { body = \"a\" }\nto = { body = \"b\" }\n";
    let bodies = "[[body]]\nname = \"a\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n[[body]]\nname = \"b\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n";
    let rod = "[[rod]]\nname = \"arm\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0, axial = 50.0 }\n\
               from = {}\nto = { body = \"a\" }\n";
    let run = "[run]\nduration = 1.0\n";
    let refused = |text: &str| {
        let prepared = run::Prepared::new(&parsed(text)).expect(text);
        prepared.motion().err().expect("a refusal").to_string()
    };
    let text = format!("{rod}{straight}{bodies}[start]\nrest = \"straight\"\n{run}");
    let why = refused(&text);
    assert!(
        why.contains("rod \"mast\" stands exactly at a fold"),
        "{why}"
    );
}

/// Would catch a parameter of an assembly that changes another number, a limit point or index missing in the records,
/// and an error bound that is too small: the deep arch pushed through, by the name of its body.
#[test]
fn the_arch_is_pushed_through_from_a_scene() {
    let data = json("space/network_statics_given.json");
    let given = rows(&data["cases"][5], "points", 1);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arch.toml");
    let follow =
        "continue={ parameter = \"body.crown.force.z\", from = 1.5, to = -12.0, points = 400 }";
    let scene = Scene::read_with(&path, &[follow, "solve.tolerance=1e-11"]).expect("arch.toml");
    let record = snaprod::study::branch(&scene, &mut Silent).expect("a branch");
    // Records, figures and the scene use the scene's name of the parameter, however written.
    let numbered = follow.replace("body.crown.force.z", "body[0].force[2]");
    let other = Scene::read_with(&path, &[&numbered]).expect("arch.toml");
    assert_eq!(other.continuation, scene.continuation);
    assert_eq!(record.name, "body.crown.force.z");
    assert!(record.summary()["parameter"] == record.name.as_str());
    let written = serde_json::to_value(&other).expect("a scene");
    assert_eq!(written["continue"]["parameter"], "body.crown.force.z");
    let ends = &record.branches.curves[0].ends;
    assert!(ends[0].contains("body.crown.force.z = -12"), "{ends:?}");
    assert!(record.is_complete(), "{:?}", record.branches.curves);
    let limits: Vec<&Value> = given
        .iter()
        .filter(|point| point["kind"] == "limit point")
        .collect();
    let folds: Vec<_> = record
        .branches
        .specials
        .iter()
        .filter(|at| at.label.starts_with("LP"))
        .collect();
    assert_eq!((folds.len(), limits.len()), (2, 2));
    let table = &record.branches.points;
    for (fold, given) in folds.iter().zip(limits) {
        let off = (fold.parameter + number(given, "load_down")).abs();
        assert!(
            off <= fold.precision.max(1e-10),
            "{}: {off:e} off, not {:e}",
            fold.label,
            fold.precision
        );
        assert!(fold.precision <= 1e-8, "{:e}", fold.precision);
        let row = record.branches.row(fold).expect("its row");
        let at = |k: &str| table.reals(&format!("crown.{k}"))[row];
        let place = Vector3::new(at("x"), at("y"), at("z"));
        let off = (place - vector3(given, "position")).norm();
        assert!(off <= 1e-6, "the crown is {off:e} off");
    }
    assert_eq!(folds[0].index, [Some(0), Some(1)]);
    assert_eq!(folds[1].index, [Some(1), Some(0)]);
    // On every row the crown is balanced: the sum of the rods' forces on the ground is the load.
    let sum = |row: usize| {
        ["x", "z"].map(|k| {
            table.reals(&format!("clamped.base_f{k}"))[row]
                - table.reals(&format!("hinged.base_f{k}"))[row]
        })
    };
    for row in 0..table.rows() {
        let [x, z] = sum(row);
        let load = table.reals("parameter")[row];
        assert!(
            x.abs() <= 1e-8 && (z - load).abs() <= 1e-8,
            "{x:e}, {z} under {load}"
        );
    }
    // A branch of an assembly has parameters that single rods do not have.
    let faults = |follow: &str| {
        let faults = Scene::read_with(&path, &[follow]).expect_err("a fault");
        faults.to_string()
    };
    let told = faults("continue={ parameter = \"rod.length\", to = 2.0 }");
    assert!(told.contains("body.crown.force.z"), "{told}");
}

/// Would catch a rod between two ball joints that bears a couple or a force off its chord: a weight on two such rods,
/// of different lengths and rest shapes, balanced as a truss.
#[test]
fn a_weight_hangs_on_two_hinged_rods() {
    let rod = |name: &str, foot: &str, curvature: f64| {
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\nlength = 1.0\n\
             section = {{ bending = [1.0, 1.3], torsion = 0.8, axial = 200.0 }}\nrest = {{ curvature = [{curvature:?}, 0.2], twist = 0.3 }}\n\
             from = {{ position = {foot}, joint = \"ball\" }}\nto = {{ body = \"m\", joint = \"ball\" }}\n"
        )
    };
    let scene = parsed(&format!(
        "{}{}[[body]]\nname = \"m\"\nmass = 1.0\nforce = [0.3, 0.0, -1.0]\nguess = {{ position = [0.0, 0.0, -0.8] }}\n",
        rod("left", "[-0.5, 0.0, 0.0]", 0.6),
        rod("right", "[0.5, 0.0, 0.0]", -0.9)
    ));
    let found = equilibrium(&scene).expect("a truss");
    let at = found.bodies[0].1.translation.vector;
    let mut sum = Vector3::zeros();
    for ((_, wrench), foot) in found.rods.iter().zip([-0.5, 0.5]) {
        let (couple, force) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
        let chord = at - Vector3::new(foot, 0.0, 0.0);
        assert!(
            couple.norm() < 1e-8 && force.cross(&chord).norm() < 1e-8,
            "{wrench}"
        );
        sum += force;
    }
    assert!((sum - Vector3::new(0.3, 0.0, -1.0)).norm() < 1e-8, "{sum}");
}

/// A blow drives rods past their folds and back: time is slowed and runs freely again. Would catch a state inside a
/// step that is interpolated under another clock than the step's.
#[test]
fn a_hard_blow_keeps_the_ledger_at_every_sample() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/platform.toml");
    let text = std::fs::read_to_string(path).expect("a scene");
    for velocity in ["[1.0, 0.3, 0.0]", "[3.0, 1.0, 0.0]"] {
        let blow = text.replace(
            "velocity = [0.3, 0.1, 0.0]",
            &format!("velocity = {velocity}"),
        );
        let scene = parsed(&blow.replace("samples = 301", "samples = 1201"));
        let prepared = run::Prepared::new(&scene).expect("a scene that runs");
        let mut tables: Vec<Table> = Vec::new();
        let record =
            run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record");
        assert_eq!(record.outcome(), "end_of_time", "{:?}", record.reason());
        let opened = record.branches[0].closing.relative();
        assert!(opened < 1e-9, "{velocity}: the ledger opens by {opened:e}");
    }
}

/// Would catch a failed guess that is ignored silently. An equilibrium reports that it was found from the unloaded
/// rods. A motion and its frequencies are refused. If all searches fail the reason is reported.
#[test]
fn a_guess_that_leads_nowhere_is_told() {
    let scene = |guess: &str, more: &str| {
        parsed(&format!(
            "[[rod]]\nname = \"r\"\n{ROD}from = {{}}\nto = {{ body = \"m\" }}\n\
             [[body]]\nname = \"m\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nforce = [0.4, 0.0, 0.2]\n\
             guess = {{ position = {guess} }}\n{more}"
        ))
    };
    let near = equilibrium(&scene("[0.12, 0.0, 0.98]", "")).expect("a near guess");
    assert_eq!(near.from_guess, Some(true));
    for guess in ["[30.0, -20.0, 5.0]", "[0.0, 0.0, 1e9]", "[0.0, 0.0, -40.0]"] {
        let far = equilibrium(&scene(guess, "")).expect("the unloaded rods lead there");
        assert_eq!(far.from_guess, Some(false), "{guess}");
        let off = (far.bodies[0].1.translation.vector - near.bodies[0].1.translation.vector).norm();
        assert!(off <= 1e-8, "{guess}: {off:e} off");
        let moving = scene(guess, "[run]\nduration = 1.0\n");
        let prepared = run::Prepared::new(&moving).expect("a scene that can be made");
        let Err(refused) = prepared.motion() else {
            panic!("{guess}: a motion starts");
        };
        let refused = refused.to_string();
        let modes = snaprod::study::modes(&moving).expect_err("no modes");
        for told in [refused, modes.to_string()] {
            assert!(
                told.contains("near the guess") && told.contains("give a nearer guess"),
                "{guess}: {told}"
            );
        }
    }
}

/// Solids against sums over their matter, of one rod and of assemblies; contradictory fields are refused by name.
/// Catches a moment about the wrong axis, a radius for a diameter.
#[test]
fn bodies_may_be_solids() {
    type Inside = fn([f64; 3]) -> bool;
    let cases: [(&str, [f64; 3], Inside); 3] = [
        ("box = [0.4, 0.3, 0.2]", [0.4, 0.3, 0.2], |_| true),
        ("cylinder = [0.3, 0.5]", [0.3, 0.3, 0.5], |[x, y, _]| {
            x.hypot(y) < 0.15
        }),
        ("ball = 0.4", [0.4; 3], |[x, y, z]| {
            x.hypot(y).hypot(z) < 0.2
        }),
    ];
    for (solid, around, inside) in cases {
        let (mut mass, mut moments) = (0.0, [0.0; 3]);
        const CELLS: usize = 120;
        let cell = 700.0 * around.iter().product::<f64>() / (CELLS * CELLS * CELLS) as f64;
        let at = |k: usize, side: f64| ((k as f64 + 0.5) / CELLS as f64 - 0.5) * side;
        for i in 0..CELLS * CELLS * CELLS {
            let place = [i % CELLS, i / CELLS % CELLS, i / CELLS / CELLS];
            let r: [f64; 3] = std::array::from_fn(|k| at(place[k], around[k]));
            if inside(r) {
                let square: f64 = r.iter().map(|x| x * x).sum();
                mass += cell;
                for (moment, x) in moments.iter_mut().zip(r) {
                    *moment += cell * (square - x * x);
                }
            }
        }
        let assembly = |body: &str| {
            format!(
                "[[rod]]\nname = \"r\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 1.0 }}\n\
                 from = {{ position = [0.0, 0.0, 0.0] }}\nto = {{ body = \"m\" }}\n[[body]]\nname = \"m\"\n{body}\n"
            )
        };
        let one = |body: &str| {
            format!(
                "[rod]\nmodel = \"cosserat\"\nlength = 1.0\n[rod.section]\nbending = [1.0, 1.0]\ntorsion = 1.0\n[body]\n{body}\n[run]\n\
                 duration = 1.0\n"
            )
        };
        let dense = format!("solid = {{ {solid}, density = 700.0 }}");
        let scene = parsed(&assembly(&dense));
        let body = &scene.assembly().expect("an assembly").bodies[0];
        let inertia = body.extent.as_ref().expect("an extent").inertia;
        assert!(
            (body.mass / mass - 1.0).abs() < 2e-3,
            "{solid}: {}",
            body.mass
        );
        for k in 0..3 {
            let off = inertia[k][k] / moments[k] - 1.0;
            assert!(off.abs() < 4e-3, "{solid}: moment {k} {off:.1e}");
        }
        let heavy = parsed(&assembly(&format!("mass = 2.0\nsolid = {{ {solid} }}")));
        let heavy = &heavy.assembly().expect("an assembly").bodies[0];
        let ratio = heavy.extent.as_ref().expect("an extent").inertia[1][1] / inertia[1][1];
        assert!((ratio * body.mass / 2.0 - 1.0).abs() < 1e-14, "{solid}");
        // The body given by its numbers, on one rod.
        let resolved = toml::to_string(&parsed(&one(&dense))).expect("TOML");
        assert!(
            resolved.contains(&format!("mass = {:?}", body.mass)),
            "{resolved}"
        );
        for (wrong, field) in [
            (format!("mass = 1.0\n{dense}"), "body[0].mass"),
            (
                format!("inertia = [1.0, 1.0, 1.0]\n{dense}"),
                "body[0].inertia",
            ),
            (format!("solid = {{ {solid} }}"), "body[0].solid.density"),
            ("solid = { density = 1.0 }".to_owned(), "body[0].solid.box"),
            (
                "solid = { box = [1.0, 1.0, 1.0], ball = 1.0, density = 1.0 }".to_owned(),
                "body[0].solid.ball",
            ),
            (
                "solid = { ball = 1e-30, density = 1e-20 }".to_owned(),
                "body[0].solid",
            ),
            (
                format!("solid = {{ {solid}, density = -1.0 }}"),
                "body[0].solid.density",
            ),
        ] {
            let found = faults(&assembly(&wrong));
            assert!(
                found.iter().any(|(_, _, name)| name == field),
                "{wrong}: {found:?}"
            );
        }
    }
}

/// A clamped strip of length 1.1 with a body in it; the distance of the clamps is the chord.
fn strip(chord: f64, force: f64, guess: &str) -> Scene {
    let turn = "rotation = { axis = [0, 1, 0], angle = 1.5707963267948966 }";
    parsed(&format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 0.6\nsection = {{ bending = [30.0, 1.0], torsion = 20.0 }}\n\
         from = {{ {turn} }}\nto = {{ body = \"M\", {turn} }}\n\
         [[rod]]\nname = \"b\"\nmodel = \"cosserat\"\nlength = 0.5\nsection = {{ bending = [30.0, 1.3], torsion = 20.0 }}\n\
         from = {{ body = \"M\", {turn} }}\nto = {{ position = [{chord:?}, 0.0, 0.05], {turn} }}\n\
         [[body]]\nname = \"M\"\nmass = 1.0\ninertia = [0.05, 0.05, 0.05]\nforce = [0.0, 0.0, {force:?}]\n{guess}\n"
    ))
}

/// Catches a search that ends at an unstable equilibrium, or takes minutes. A strip held in shape by two clamps is
/// stable as an arch, whose position (x, z, turn) and energy are those of two elasticas joined at the body. No path
/// from the unloaded rods ends there.
#[test]
fn a_strip_between_clamps_is_found_in_its_arch() {
    let found = equilibrium(&strip(1.0, 10.0, "")).expect("an arch");
    assert_eq!(found.index, 0);
    let (name, pose) = &found.bodies[0];
    let at = pose.translation.vector;
    let (x, z) = (0.537_915_73, 0.227_268_86);
    assert!(
        (at.x - x).abs() < 1e-7 && (at.z - z).abs() < 1e-7 && at.y.abs() < 1e-9,
        "{name}: {at}"
    );
    assert!(
        (found.energy - 1.371_046_22).abs() < 1e-7,
        "{}",
        found.energy
    );
    for (chord, force) in [(1.0, 0.0), (1.05, 10.0), (1.05, 0.0)] {
        let found = equilibrium(&strip(chord, force, "")).expect("an arch");
        assert_eq!(found.index, 0, "{chord}, {force}");
    }
}

/// Catches a search that gives up at the first path that is too long. Two rods that close a loop between clamps at a
/// chord of 1.1 have a stable equilibrium. Its energy is at most that of the branch on which the far clamp comes
/// nearer from 1.5 (E = 9.5846).
#[test]
fn a_path_that_is_too_long_leaves_the_other_starts() {
    let found = equilibrium(&parsed(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.2], torsion = 0.8 }\n\
         from = {}\nto = { body = \"M\" }\n\
         [[rod]]\nname = \"b\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.1, 1.0], torsion = 0.8 }\n\
         rest = { curvature = [0.1, 0.05] }\nfrom = { body = \"M\" }\nto = { position = [0.3, 0.1, 1.1] }\n\
         [[body]]\nname = \"M\"\nmass = 1.0\noffset = [0.05, 0.0, 0.02]\ninertia = [0.05, 0.05, 0.05]\n",
    ))
    .expect("a stable equilibrium");
    assert_eq!(found.index, 0);
    assert!(found.energy < 9.5847, "{}", found.energy);
}

/// Catches an unstable equilibrium near a guess returned without further search, and a guess beyond the rods' reach
/// without a remark.
#[test]
fn a_guess_tells_what_it_is_worth() {
    let guess = |x: f64, z: f64| {
        let guess = format!("guess = {{ position = [{x:?}, 0.0, {z:?}] }}");
        equilibrium(&strip(1.0, 10.0, &guess)).expect("an equilibrium")
    };
    let near = guess(0.53, 0.2);
    assert!(near.index > 0 && near.from_guess == Some(true));
    assert_eq!(near.overdrawn, None);
    assert_eq!(guess(0.53, 0.4).overdrawn.as_deref(), Some("a"));
}
