//! `snaprod run` and `check` for rods in space with damping.

use crate::program::{Place, Table, keys};
use crate::support::worst;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

const COLUMNS: &str = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz,fx,fy,fz,mx,my,mz,kinetic,elastic,potential,dissipated,work,total";

fn bundled(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// A scene from the contents of its tables; `rod` ends in [rod.section].
pub fn scene(rod: &str, body: &str, start: &str, rest: &str, run: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\n{rod}\n[body]\n{body}\n[start]\n{start}\n{rest}\n[run]\n{run}\n"
    )
}

/// Runs a scene and reads its trajectory and summary.
pub fn run(place: &Place, text: &str) -> (Table, Value) {
    let summary = place.scene(text).json(0);
    (Table::parse(&place.read("out/trajectory.csv")), summary)
}

fn vectors(table: &Table, names: [&str; 3]) -> Vec<Vector3<f64>> {
    let [x, y, z] = names.map(|name| table.column(name));
    (0..x.len())
        .map(|i| Vector3::new(x[i], y[i], z[i]))
        .collect()
}

fn turns(table: &Table) -> Vec<UnitQuaternion<f64>> {
    let [w, x, y, z] = ["qw", "qx", "qy", "qz"].map(|name| table.column(name));
    let turn = |i: usize| Quaternion::new(w[i], x[i], y[i], z[i]);
    (0..w.len())
        .map(|i| {
            assert!((turn(i).norm() - 1.0).abs() < 1e-14);
            UnitQuaternion::new_unchecked(turn(i))
        })
        .collect()
}

/// Largest difference, relative to the largest value; NaN is infinite.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let largest = b.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let off = worst(a.iter().zip(b).map(|(a, b)| (a - b).abs()));
    if largest > 0.0 { off / largest } else { off }
}

/// Catches columns, keys and files that are missing or in another order, a ledger that does not close, and a text that
/// contradicts the summary.
#[test]
fn a_run_in_space_writes_its_files() {
    let place = Place::new("whirl");
    let text = std::fs::read_to_string(bundled("whirl")).unwrap();
    let short = text.replace("duration = 10.0", "duration = 0.6\nsamples = 13");
    assert_ne!(text, short);
    place.write("whirl.toml", &short);
    let answer = place.run(&["run", "whirl.toml"]);
    let text = answer.text();
    assert!(
        text.contains("t = 0.6: the end of time was reached; r = ("),
        "{text}"
    );
    let expected = [
        "energies.svg",
        "events.json",
        "path.svg",
        "resolved.toml",
        "shapes.svg",
        "strain.csv",
        "strain_u1.svg",
        "strain_u2.svg",
        "strain_u3.svg",
        "summary.json",
        "trajectory.csv",
    ];
    assert_eq!(place.files("out/whirl"), expected);

    let table = Table::parse(&place.read("out/whirl/trajectory.csv"));
    assert_eq!(table.columns.join(","), COLUMNS);
    assert_eq!(table.rows.len(), 13);
    let total = table.column("total");
    assert!(total.iter().all(|e| (e - total[0]).abs() < 1e-9));
    let lost = table.column("dissipated");
    assert!(lost[0] == 0.0 && lost.windows(2).all(|pair| pair[0] < pair[1]));
    turns(&table);
    // Bent by 0.8 about d1: the end of the arc, and 1/2 m v^2 + 1/2 B1 u1^2.
    let (x, y, z) = (table.column("x"), table.column("y"), table.column("z"));
    let arc = ((0.8_f64.cos() - 1.0) / 0.8, 0.8_f64.sin() / 0.8);
    assert!(x[0] == 0.0 && (y[0] - arc.0).abs() < 1e-13 && (z[0] - arc.1).abs() < 1e-13);
    assert!((table.column("elastic")[0] - 0.32).abs() < 1e-14);
    assert!((table.column("kinetic")[0] - 0.18).abs() < 1e-14);

    let field = Table::parse(&place.read("out/whirl/strain.csv"));
    assert_eq!(field.columns.join(","), "t,s,u1,u2,u3,v1,v2,v3,dissipation");
    assert_eq!(field.rows.len(), 13 * 61);
    let u1 = field.column("u1");
    assert!(u1[..61].iter().all(|u| (u - 0.8).abs() < 1e-13));

    let summary = place.json("out/whirl/summary.json");
    keys(
        &summary,
        &[
            "outcome",
            "complete",
            "reason",
            "units",
            "start",
            "end",
            "layers",
            "energy_error",
            "nodes",
            "work",
            "scales",
            "versions",
            "scene",
            "reduction",
            "not_reduced",
        ],
    );
    assert_eq!(summary["outcome"], "end_of_time");
    assert!(summary["reduction"].is_null());
    assert!(
        summary["not_reduced"]
            .as_str()
            .unwrap()
            .contains("u1 = 0.8")
    );
    assert!(summary["energy_error"]["relative"].as_f64().unwrap() < 1e-9);
    for name in COLUMNS.split(',') {
        let last = table.column(name)[12];
        assert!(
            (summary["end"][name].as_f64().unwrap() - last).abs() <= 1e-15,
            "{name}"
        );
    }
}

/// Catches a vector that is not turned into the clamp's frame, or back, or turned the wrong way.
#[test]
fn a_turned_clamp_turns_everything() {
    let turn = UnitQuaternion::from_axis_angle(
        &nalgebra::Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5)),
        2.1,
    );
    let shift = Vector3::new(0.4, -0.7, 1.3);
    let text = |turn: UnitQuaternion<f64>, shift: Vector3<f64>| {
        let world = |x: f64, y: f64, z: f64| {
            let v = turn * Vector3::new(x, y, z);
            format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
        };
        let q = turn.quaternion();
        scene(
            "length = 1.0\ndamping = { proportional = 0.05 }\n[rod.section]\nbending = [1.0, 1.4]\ntorsion = 0.7",
            "mass = 1.0\noffset = [0.0, 0.05, 0.1]\ninertia = [0.02, 0.03, 0.04]",
            &format!(
                "equilibrium = {{ force = {}, couple = {} }}\nvelocity = {}\nangular_velocity = {}",
                world(0.8, -0.5, 0.3),
                world(0.1, 0.3, 0.2),
                world(0.02, 0.01, -0.005),
                world(0.2, -0.3, 0.5),
            ),
            &format!(
                "[clamp]\nposition = [{:?}, {:?}, {:?}]\nquaternion = [{:?}, {:?}, {:?}, {:?}]\n[loads]\ngravity = {}\ndead = {}\ncouple = {}\ndrag = 0.2\n\
                 force = {{ direction = {}, amplitude = 0.5, frequency = 1.0 }}",
                shift.x,
                shift.y,
                shift.z,
                q.w,
                q.i,
                q.j,
                q.k,
                world(0.1, 0.2, -0.5),
                world(0.3, 0.0, 0.1),
                world(0.1, -0.2, 0.3),
                world(0.0, 0.6, 0.8),
            ),
            "duration = 0.4\nsamples = 5",
        )
    };
    let place = Place::new("turned");
    let (plain, _) = run(&place, &text(UnitQuaternion::identity(), Vector3::zeros()));
    let (turned, _) = run(&place, &text(turn, shift));
    for names in [
        ["x", "y", "z"],
        ["vx", "vy", "vz"],
        ["wx", "wy", "wz"],
        ["fx", "fy", "fz"],
        ["mx", "my", "mz"],
    ] {
        let by = if names[0] == "x" {
            shift
        } else {
            Vector3::zeros()
        };
        let pairs = vectors(&plain, names)
            .into_iter()
            .zip(vectors(&turned, names));
        for (a, b) in pairs {
            assert!((turn * a + by - b).norm() < 1e-8, "{names:?} {a} {b}");
        }
    }
    for (a, b) in turns(&plain).iter().zip(&turns(&turned)) {
        assert!((turn * a).angle_to(b) < 1e-8);
    }
    for name in ["kinetic", "elastic", "potential", "dissipated", "work"] {
        assert!(
            apart(&turned.column(name), &plain.column(name)) < 1e-8,
            "{name}"
        );
    }
}

/// Catches a start from an equilibrium or a pose with strains that differ from statics, or forces on the body of the
/// wrong sign.
#[test]
fn an_equilibrium_stays_where_it_is() {
    let place = Place::new("stays");
    let rod = "length = 0.5\ndamping = { proportional = 0.02 }\n[rod.section]\nbending = [0.03, 0.02]\ntorsion = 0.015\naxial = 30.0";
    let text = |start: &str| {
        scene(
            rod,
            "mass = 0.2\ninertia = [1e-4, 2e-4, 1e-4]",
            start,
            "[clamp]\nposition = [0.1, 0.2, 0.3]\nrotation = { axis = [0.6, 0.0, 0.8], angle = 1.1 }\n\
             [loads]\ndead = [0.05, -0.1, 0.02]\ncouple = [0.0, 0.004, 0.0]",
            "duration = 0.5\nsamples = 3",
        )
    };
    let (table, summary) = run(
        &place,
        &text("equilibrium = { force = [0.05, -0.1, 0.02], couple = [0.0, 0.004, 0.0] }"),
    );
    assert_eq!(summary["start_index"], 0);
    let state = &summary["end"];
    let number = |name: &str| state[name].as_f64().unwrap();
    let rest = (number("elastic"), number("kinetic"));
    assert!(rest.0 > 1e-3 && rest.1 < 1e-14, "{rest:?}");
    let feels = [
        ("fx", -0.05),
        ("fy", 0.1),
        ("fz", -0.02),
        ("mx", 0.0),
        ("my", -0.004),
        ("mz", 0.0),
    ];
    for (name, expected) in feels {
        assert!((number(name) - expected).abs() < 1e-8, "{name}");
    }
    let elastic = number("elastic");
    let r = &vectors(&table, ["x", "y", "z"])[0];
    let q = turns(&table)[0];
    let pose = format!(
        "pose = {{ position = [{:?}, {:?}, {:?}], quaternion = [{:?}, {:?}, {:?}, {:?}] }}",
        r.x, r.y, r.z, q.w, q.i, q.j, q.k
    );
    let (_, summary) = run(&place, &text(&pose));
    let again = summary["start"]["elastic"].as_f64().unwrap();
    assert!((again - elastic).abs() < 1e-8, "{again} {elastic}");
    assert!(summary["end"]["kinetic"].as_f64().unwrap() < 1e-14);
}

/// Catches bending about the wrong director and a ball joint that carries a couple: a rod in a plane of space moves
/// as the planar one does.
#[test]
fn a_planar_motion_in_space() {
    let place = Place::new("planar");
    let run_text = "duration = 0.6\nsamples = 7\ntolerance = 1e-9";
    let space = scene(
        "length = 1.0\ndamping = { proportional = 0.1 }\n[rod.section]\nbending = [1.0, 1.0]\ntorsion = 0.7",
        "mass = 1.0\njoint = \"ball\"",
        "strain = { u2 = [1.5, -0.5, 0.4] }",
        "[loads]\ngravity = [0.3, 0.0, -0.8]",
        run_text,
    );
    let (space, _) = run(&place, &space);
    let plane = format!(
        "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\ndamping = 0.1\n[body]\nmass = 1.0\n\
         [start]\ncurvature = [1.5, -0.5, 0.4]\n[loads]\ngravity = [-0.8, 0.3]\n[run]\n{run_text}\n"
    );
    let (plane, _) = run(&place, &plane);
    for (a, b) in [
        ("z", "x"),
        ("x", "y"),
        ("vz", "vx"),
        ("vx", "vy"),
        ("fz", "fx"),
        ("fx", "fy"),
        ("dissipated", "dissipated"),
        ("total", "total"),
    ] {
        assert!(apart(&space.column(a), &plane.column(b)) < 1e-7, "{a}");
    }
    for name in ["y", "vy", "fy", "mx", "my", "mz", "wx", "wz"] {
        assert!(space.column(name).iter().all(|x| x.abs() < 1e-12), "{name}");
    }
    assert!(space.column("wy")[6].abs() > 1e-3);
}

/// Catches a wrong equivalent spring, dashpot or period, and a whole rod that moves differently (closed form of the
/// damped oscillator).
#[test]
fn a_rod_that_is_a_spring_moves_like_one() {
    let place = Place::new("reduced");
    let text = std::fs::read_to_string(bundled("plunge")).unwrap();
    let text = text.replace("duration = 4.0", "duration = 0.8\nsamples = 9");
    let (reduced, summary) = run(&place, &text);
    let (full, whole) = run(&place, &text.replace("samples", "reduce = false\nsamples"));
    assert!(whole["reduction"].is_null() && whole["not_reduced"].is_string());
    assert_eq!(reduced.rows, full.rows);
    let found = &summary["reduction"];
    assert_eq!(
        (&found["kind"], &found["by_symmetry"]),
        (&"longitudinal".into(), &true.into())
    );
    let near = |value: &Value, expected: f64| {
        let value = value.as_f64().unwrap();
        assert!(
            (value - expected).abs() < 1e-12 * expected,
            "{value} {expected}"
        );
    };
    near(&found["stiffness"][0][0], 100.0);
    near(&found["dashpot"][0][0], 2.0);
    near(&found["modes"][0]["natural_frequency"], 10.0);
    near(&found["modes"][0]["damping_ratio"], 0.1);
    // z'' = -100 (z - 1) - 2 z' - 0.5, z(0) = 1, z'(0) = -1.
    let (sigma, omega) = (1.0, 99.0_f64.sqrt());
    for (t, z) in reduced.column("t").iter().zip(reduced.column("z")) {
        let (a, b) = (0.005, (-1.0 + sigma * 0.005) / omega);
        let swing = (-sigma * t).exp() * (a * (omega * t).cos() + b * (omega * t).sin());
        assert!((z - (1.0 - 0.005 + swing)).abs() < 1e-8, "{t} {z}");
    }
    place.write("scene.toml", &text);
    let words = place.run(&["run", "scene.toml", "--out", "words"]);
    assert!(words.text().starts_with(
        "longitudinal motion: the rod is exactly a spring and a dashpot; v3: spring 100,"
    ));
}

/// Catches a twist of the wrong sense, and a wrong couple on the body: in SI units J angle'' = -(C/L) (angle + 0.02
/// angle'), angle(0) = 0.5 L.
#[test]
fn a_twisted_rod_is_a_torsion_pendulum() {
    let place = Place::new("twist");
    let text = scene(
        "length = 0.4\ndamping = { proportional = 0.02 }\n[rod.section]\nbending = [0.3, 0.3]\ntorsion = 0.2",
        "mass = 0.5\ninertia = [0.01, 0.01, 0.02]",
        "strain = { u3 = [0.5] }",
        "[clamp]\nrotation = { axis = [0.0, 1.0, 0.0], angle = 1.5707963267948966 }",
        "duration = 0.6\nsamples = 7",
    );
    let (table, summary) = run(&place, &format!("units = \"si\"\n{text}"));
    let found = &summary["reduction"];
    assert_eq!(
        (&found["kind"], &found["moving"][0]),
        (&"twisting".into(), &"u3".into())
    );
    let spring = 0.2 / 0.4;
    for (key, expected) in [
        ("stiffness", spring),
        ("dashpot", 0.02 * spring),
        ("mass", 0.02),
    ] {
        let value = found[key][0][0].as_f64().unwrap();
        assert!((value - expected).abs() < 1e-12 * expected, "{key} {value}");
    }
    let sigma = 0.02 * spring / (2.0 * 0.02);
    let omega = (spring / 0.02 - sigma * sigma).sqrt();
    let clamp = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    let couples = table.column("mx");
    // d3 of the clamp is the world's x.
    for ((t, turn), (couple, spin)) in
        (table.column("t").iter().zip(turns(&table))).zip(couples.iter().zip(table.column("wx")))
    {
        let (sin, cos) = (omega * t).sin_cos();
        let swing = 0.2 * (-sigma * t).exp();
        let angle = swing * (cos + sigma / omega * sin);
        let rate = -swing * (omega + sigma * sigma / omega) * sin;
        let expected = clamp * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        assert!(
            turn.angle_to(&expected) < 1e-8 && (spin - rate).abs() < 1e-7,
            "{t}"
        );
        assert!(
            (couple + spring * (angle + 0.02 * rate)).abs() < 1e-8,
            "{t} {couple}"
        );
    }
}

/// Catches an unsupported set of rigid strains that runs as another set, an inadmissible start, and messages without
/// advice; `check` must find the faults that `run` finds.
#[test]
fn what_cannot_run_is_refused_by_name() {
    let place = Place::new("refused");
    let straight = |section: &str, start: &str| {
        let rod = format!(
            "length = 2.0\ndamping = {{ proportional = 0.05 }}\n[rod.section]\nbending = [1.0, 1.0]\ntorsion = 0.7\n{section}"
        );
        scene(
            &rod,
            "mass = 1.0\njoint = \"ball\"",
            start,
            "",
            "duration = 1.0",
        )
    };
    let sheared = straight("shear = [50.0, 50.0]", "");
    let pulled = straight("", "velocity = [0.0, 0.0, 1.0]");
    let branches = straight("", "").replacen(
        "[rod.section]\nbending = [1.0, 1.0]",
        "relaxation = [{ stiffness = { proportional = 0.5 }, time = 1.0 }]\n[rod.section]\nbending = [{ s = [0.0, 2.0], values = [1.0, 2.0] }, 1.0]",
        1,
    );
    let cases = [
        (
            sheared,
            "rod.section holds v3 rigid and lets v1 and v2 move",
            "give v3 a stiffness",
        ),
        (
            pulled,
            "[start], in the frame of the clamp",
            "bend the rod a little",
        ),
        (branches, "rod.relaxation[0]", "give six stiffnesses"),
    ];
    for (text, what, advice) in cases {
        place.write("scene.toml", &text);
        let checked = place.run(&["check", "scene.toml"]);
        let ran = place.run(&["run", "scene.toml"]);
        assert_eq!(checked.refusal(), ran.refusal());
        let message = ran.refusal();
        assert!(
            message.contains(what) && message.contains(advice),
            "{message}"
        );
        assert!(!place.join("out").exists());
    }
    for name in ["whirl", "plunge"] {
        assert!(
            place
                .run(&["check", &bundled(name)])
                .text()
                .contains("no faults")
        );
    }
}
