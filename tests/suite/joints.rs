//! Joints of free axes, nodes without mass, and assemblies in a plane.
//!
//! `tests/data/rods/hinges.json` has numbers of another program, with the route and the uncertainty of each.

use serde_json::Value;
use snaprod::assembly::Configuration;
use snaprod::scene::{AssemblySetup, Scene};
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::assembly::{AssemblyEquilibriumRecord, equilibrium};
use snaprod::study::{self, Silent};
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

fn cases() -> Vec<Value> {
    let path = format!("{}/tests/data/rods/hinges.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    serde_json::from_str(&text).expect("JSON")
}

fn case(name: &str) -> Value {
    let found = cases().into_iter().find(|case| case["name"] == name);
    found.unwrap_or_else(|| panic!("no case {name:?}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list");
    list.iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A chain of rods in the plane of x and z, with nodes without mass where they meet: in space with hinges about y, or
/// in the plane with ball joints. `load` is the size of the dead force on the loaded node.
fn chain(case: &Value, planar: bool, load: f64) -> String {
    let data = &case["data"];
    let rods = data["rods_length_B_invEA_invGA"].as_array().expect("rods");
    let angles = numbers(&data["directions_at_rest"]);
    let mut places = vec![[0.0, 0.0]];
    for (rod, angle) in rods.iter().zip(&angles) {
        let (length, [x, z]) = (number(&rod[0]), places[places.len() - 1]);
        places.push([x + length * angle.cos(), z + length * angle.sin()]);
    }
    let joint = |word: &Value| match (word == "hinge", planar) {
        (false, _) => "",
        (true, true) => ", joint = \"ball\"",
        (true, false) => ", joint = \"hinge\", axis = [0.0, 1.0, 0.0]",
    };
    let rigid_or = |compliance: &Value, count: usize| match number(compliance) {
        0.0 => "\"rigid\"".to_owned(),
        c if count == 1 => format!("{:?}", 1.0 / c),
        c => format!("[{:?}, {:?}]", 1.0 / c, 1.0 / c),
    };
    let mut text = if planar {
        "plane = [0.0, 1.0, 0.0]\n"
    } else {
        ""
    }
    .to_owned();
    let last = rods.len() - 1;
    for (k, (rod, angle)) in rods.iter().zip(&angles).enumerate() {
        let turn = format!(
            "rotation = {{ axis = [0.0, 1.0, 0.0], angle = {:?} }}",
            FRAC_PI_2 - angle
        );
        let site = |end: usize, word: &Value| {
            let on = if end == 0 || end == rods.len() {
                format!(
                    "position = [{:?}, 0.0, {:?}]",
                    places[end][0], places[end][1]
                )
            } else {
                format!("body = \"n{end}\"")
            };
            format!("{{ {on}, {turn}{} }}", joint(word))
        };
        let weld = Value::from("weld");
        let from = if k == 0 {
            &data["feet"][0]
        } else {
            &data["joints"][k - 1]
        };
        let to = if k == last { &data["feet"][1] } else { &weld };
        let b = number(&rod[1]);
        writeln!(
            text,
            "[[rod]]\nname = \"r{k}\"\nmodel = \"cosserat\"\nlength = {:?}\n\
             section = {{ bending = [{:?}, {b:?}], torsion = {:?}, axial = {}, shear = {} }}\nfrom = {}\nto = {}",
            number(&rod[0]), 100.0 * b, 100.0 * b, rigid_or(&rod[2], 1), rigid_or(&rod[3], 2), site(k, from), site(k + 1, to),
        )
        .expect("text");
    }
    let way = numbers(&data["load_direction"]);
    for node in 1..rods.len() {
        writeln!(text, "[[body]]\nname = \"n{node}\"").expect("text");
        if number(&data["load_node_1_is_after_rod_1"]) == node as f64 {
            writeln!(
                text,
                "force = [{:?}, 0.0, {:?}]",
                load * way[0],
                load * way[1]
            )
            .expect("text");
        }
    }
    text
}

fn solved(text: &str) -> AssemblyEquilibriumRecord {
    let scene = Scene::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    equilibrium(&scene).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

fn close(found: f64, wanted: f64, to: f64, what: &str) {
    assert!(
        (found - wanted).abs() <= to * wanted.abs().max(1.0),
        "{what}: {found} for {wanted}"
    );
}

/// Catches a hinge that bears a couple, and an axis that does not turn. Catches a planar assembly that leaves its plane
/// or counts what the plane forbids. First folds of frames, without any guess: index 0 before, 1 after.
#[test]
fn folds_of_frames_with_hinges() {
    let folds = cases()
        .into_iter()
        .filter(|case| case["values"]["fold_load"].is_number());
    for case in folds {
        let (name, values) = (&case["name"], &case["values"]);
        let node = number(&case["data"]["load_node_1_is_after_rod_1"]) as usize;
        let wanted = number(&values["fold_load"]);
        for planar in [false, true] {
            let how = format!(
                "[continue]\nparameter = \"body.n{node}.force.z\"\nto = {:?}\npoints = 400\n",
                -1.2 * wanted
            );
            let text = chain(&case, planar, 0.0) + &how;
            let scene = Scene::parse(&text).unwrap_or_else(|why| panic!("{why}\n{text}"));
            let record =
                study::branch(&scene, &mut Silent).unwrap_or_else(|why| panic!("{name}: {why}"));
            let what = format!("{name}, in the plane: {planar}");
            let first = record
                .branches
                .specials
                .first()
                .unwrap_or_else(|| panic!("{what}: no fold"));
            assert_eq!(first.kind, SpecialKind::Fold, "{what}");
            close(-first.parameter, wanted, 1e-9, &what);
            let points = &record.branches.points;
            let index = points.integers("index");
            let label = points.words("label");
            let at = label
                .iter()
                .position(|label| !label.is_empty())
                .expect("the fold");
            assert!(
                index[..at].iter().all(|i| *i == Some(0)),
                "{what}: index before"
            );
            assert_eq!(index[at + 1], Some(1), "{what}: index after");
            for (k, place) in values["nodes"]
                .as_array()
                .expect("nodes")
                .iter()
                .enumerate()
            {
                for (axis, x) in ["x", "z"].iter().zip(numbers(place)) {
                    if k + 1 < values["nodes"].as_array().map_or(0, Vec::len) {
                        let column = points.reals(&format!("n{}.{axis}", k + 1));
                        assert!(
                            (column[at] - x).abs() <= 1e-6 * x.abs().max(1.0),
                            "{what}: {} for {x}",
                            column[at]
                        );
                    }
                }
            }
        }
    }
}

/// Catches a wrong place, force or couple of frames under a given load: a portal on hinged feet, and two clamped rods
/// with a hinge between.
#[test]
fn frames_under_a_load() {
    for name in [
        "portal, hinged feet, load on the beam",
        "two rods, clamped, hinge between, dead force",
    ] {
        let case = case(name);
        let load = number(&case["data"]["load"]);
        for planar in [false, true] {
            let found = solved(&chain(&case, planar, load));
            assert_eq!(found.index, 0, "{name}");
            let values = &case["values"];
            for ((_, pose), place) in found
                .bodies
                .iter()
                .zip(values["nodes"].as_array().expect("nodes"))
            {
                let place = numbers(place);
                close(pose.translation.x, place[0], 1e-9, name);
                close(pose.translation.z, place[1], 1e-9, name);
                assert!(pose.translation.y.abs() < 1e-12, "{name}");
            }
            let wrench = found.rods[0].1;
            let force = numbers(&values["base_force"]);
            close(wrench[3], force[0], 1e-9, name);
            close(wrench[5], force[1], 1e-9, name);
            assert!(
                wrench[1].abs() < 1e-12,
                "{name}: the couple {} at the base",
                wrench[1]
            );
        }
    }
}

/// Catches a rod between two ball joints that needs a body, a guess or a clamp, and a rod in a plane that is not the
/// one in space: pinned-pinned elastica at a given distance, as one rod and as two halves with a node between, in space
/// and in the plane, against the closed form.
#[test]
fn rods_between_two_ball_joints() {
    let section = "model = \"cosserat\"\nsection = { bending = [1.0, 1.0], torsion = 1.0 }";
    let bare = "model = \"elastica\"\nbending_stiffness = 1.0";
    for distance in [0.99, 0.9, 0.5] {
        let case = case(&format!(
            "pinned-pinned elastica, distance {distance}, mode 1"
        ));
        let values = &case["values"];
        let to = format!("{{ position = [0.0, 0.0, {distance:?}], joint = \"ball\" }}");
        let from = "{ joint = \"ball\" }";
        for (plane, section) in [("", section), ("plane = [0.0, 1.0, 0.0]\n", bare)] {
            let one = format!(
                "{plane}[[rod]]\nname = \"a\"\nlength = 1.0\n{section}\nfrom = {from}\nto = {to}\n"
            );
            let half = |name: &str, from: &str, to: &str| {
                format!(
                    "[[rod]]\nname = \"{name}\"\nlength = 0.5\n{section}\nfrom = {from}\nto = {to}\n"
                )
            };
            let node = "{ body = \"m\" }";
            let two = format!(
                "{plane}{}{}[[body]]\nname = \"m\"\n",
                half("a", from, node),
                half("b", node, &to)
            );
            for text in [one, two] {
                let found = solved(&text);
                assert_eq!(found.index, 0, "{text}");
                let wrench = found.rods[0].1;
                close(wrench[5].abs(), number(&values["compression"]), 1e-9, &text);
                close(found.energy, number(&values["energy"]), 1e-9, &text);
                let all = found.shapes.iter().flatten();
                let height = all
                    .map(|(_, pose)| pose.translation.x.hypot(pose.translation.y))
                    .fold(0.0, f64::max);
                close(height, number(&values["height_of_middle"]), 1e-9, &text);
                if !plane.is_empty() {
                    let mut sections = found.shapes.iter().flatten();
                    assert!(
                        sections.all(|(_, pose)| pose.translation.y.abs() < 1e-12),
                        "{text}"
                    );
                }
            }
        }
    }
}

/// An arch between forks with couples M at both ends, bent more where M > 0. The chord is along x, and its end is free
/// to slide along it.
fn forks(bending: f64, couple: f64) -> String {
    let end = |x: f64, angle: f64, couple: f64, slide: &str| {
        format!(
            "{{ position = [{x:?}, 0.0, 0.0], rotation = {{ axis = [0.0, 1.0, 0.0], angle = {angle:?} }}, joint = \"universal\", \
             axis = [0.0, 1.0, 0.0], second_axis = [1.0, 0.0, 0.0], couple = {couple:?}{slide} }}"
        )
    };
    // A quarter circle about y: the tangent turns from 45 degrees to 135 degrees from z.
    let (chord, angle) = (2.0f64.sqrt(), 1.5 * FRAC_PI_2);
    let slide = format!(", slide = [{:?}, 0.0, {:?}]", angle.cos(), angle.sin());
    format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = {FRAC_PI_2:?}\nsection = {{ bending = [1.0, {bending:?}], torsion = 0.8 }}\n\
         rest = {{ curvature = [0.0, 1.0] }}\nfrom = {}\nto = {}\n",
        end(0.0, 0.5 * FRAC_PI_2, -couple, ""),
        end(chord, angle, couple, &slide)
    )
}

/// Catches a fork that turns about the tangent, or holds one of its two axes: the index changes at the critical couples
/// of an arch between forks, of lateral buckling and of the swing about the chord, and nowhere between.
#[test]
fn couples_that_buckle_an_arch_between_forks() {
    for (bending, criticals) in [
        (1.0, vec![-12.0, 1.0]),
        (1000.0, vec![-0.892_445_508_745_45, 2.694_087_022_156_4]),
    ] {
        let assembly = |couple: f64| {
            let scene = Scene::parse(&forks(bending, couple)).expect("a scene");
            AssemblySetup::new(&scene).expect("a rod").assembly
        };
        for critical in criticals {
            let index = |couple: f64, from: &Configuration| {
                let there = assembly(couple);
                let found = there.equilibrium(Some(from), 1e-11).expect("the arch");
                (found.index, found.now)
            };
            let steps = 24;
            let mut now = index(0.0, &assembly(0.0).unloaded(1e-11).expect("unloaded")).1;
            let mut before = 0;
            for step in 1..=steps {
                let couple = critical * (1.0 - 1e-7) * f64::from(step) / f64::from(steps);
                (before, now) = index(couple, &now);
            }
            let (after, _) = index(critical * (1.0 + 1e-7), &now);
            // Beyond other critical couples the arch is unstable in other ways, too.
            assert_eq!(
                before.abs_diff(after),
                1,
                "bending {bending}, couple {critical}: from {before} to {after}"
            );
        }
    }
}

/// Catches a universal joint whose axes do not stay with their rods, and couples about them: two clamped rods of two
/// bending stiffnesses under a force at the joint.
#[test]
fn a_universal_joint_between_clamped_rods() {
    let case = case("universal joint, clamped rods");
    let values = &case["values"];
    let rod = "model = \"cosserat\"\nsection = { bending = [1.0, 1.5], torsion = 0.8 }";
    let [joint, turn] = ["joint", "rod1_end_quaternion_wxyz"].map(|name| numbers(&values[name]));
    let text = format!(
        "[[rod]]\nname = \"one\"\nlength = 1.0\n{rod}\nfrom = {{}}\nto = {{ body = \"joint\" }}\n\
         [[rod]]\nname = \"two\"\nlength = 0.8\n{rod}\n\
         from = {{ body = \"joint\", joint = \"universal\", axis = [1.0, 0.0, 0.0], second_axis = [0.0, 1.0, 0.0] }}\n\
         to = {{ position = {:?}, quaternion = {:?} }}\n\
         [[body]]\nname = \"joint\"\nforce = {:?}\nguess = {{ position = {joint:?}, quaternion = {turn:?} }}\n",
        numbers(&case["data"]["rod2"]["end_clamped_at"]),
        numbers(&case["data"]["rod2"]["end_quaternion_wxyz"]),
        numbers(&case["data"]["force_at_joint"]),
    );
    let found = solved(&text);
    for (i, x) in joint.iter().enumerate() {
        close(
            found.bodies[0].1.translation.vector[i],
            *x,
            1e-9,
            "the joint",
        );
    }
    let [force, couple] = ["base_force", "base_couple"].map(|name| numbers(&values[name]));
    for i in 0..3 {
        close(found.rods[0].1[3 + i], force[i], 1e-9, "the base force");
        close(found.rods[0].1[i], couple[i], 1e-9, "the base couple");
    }
    let (one, two) = (
        found.shapes[0].last().expect("an end").1,
        found.shapes[1][0].1,
    );
    let (a, b) = (
        one.rotation * nalgebra::Vector3::x(),
        two.rotation * nalgebra::Vector3::y(),
    );
    assert!(a.dot(&b).abs() < 1e-12, "the axes turn out of each other");
    let couple = found.rods[1].1.fixed_rows::<3>(0).into_owned();
    assert!(
        couple.dot(&a).abs() < 1e-10 && couple.dot(&b).abs() < 1e-10,
        "couples about the axes"
    );
    close(
        found.energy - potential(&case, &joint),
        number(&values["energy"]),
        1e-9,
        "the energy",
    );
}

/// Potential of the force at the joint.
fn potential(case: &Value, joint: &[f64]) -> f64 {
    let force = numbers(&case["data"]["force_at_joint"]);
    -force.iter().zip(joint).map(|(f, x)| f * x).sum::<f64>()
}

/// Catches a slider that turns, or bears a force along its direction, in space and in the plane.
#[test]
fn a_slider_holds_its_direction() {
    let case = case("roller, direction held");
    let values = &case["values"];
    let along = "rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 }";
    let text = format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [100.0, 1.0], torsion = 100.0 }}\n\
         distributed = [0.0, 0.0, -20.0]\nfrom = {{ {along} }}\n\
         to = {{ position = [1.0, 0.0, -0.1], {along}, joint = \"slider\", axis = [0.0, 0.0, 1.0], force = -3.0 }}\n"
    );
    for plane in ["", "plane = [0.0, 1.0, 0.0]\n"] {
        let found = solved(&format!("{plane}{text}"));
        assert_eq!(found.index, 0);
        let end = found.shapes[0].last().expect("an end").1.translation;
        close(end.x, number(&values["end_x"]), 1e-9, "the end");
        close(end.z, -0.1, 1e-9, "the end");
        let (wrench, force) = (found.rods[0].1, numbers(&values["base_force"]));
        close(wrench[3], force[0], 1e-9, "the base force");
        close(wrench[5], force[1], 1e-9, "the base force");
        // In space M > 0 of the plane is a couple about -y.
        close(
            wrench[1],
            -number(&values["base_moment"]),
            1e-9,
            "the base couple",
        );
    }
}

/// Catches a spring in a joint of the wrong size or rest: a straight rod on a hinge with a spring, under a couple.
#[test]
fn springs_in_hinges() {
    let [stiffness, rest, couple]: [f64; 3] = [0.3, 0.2, 0.15];
    let text = format!(
        "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 1.0 }}\n\
         from = {{ joint = \"hinge\", axis = [0.0, 2.0, 0.0], stiffness = {stiffness:?}, rest = {rest:?}, couple = {couple:?} }}\n\
         to = {{ body = \"m\" }}\n[[body]]\nname = \"m\"\n"
    );
    let found = solved(&text);
    let end = found.bodies[0].1.translation;
    let angle = rest + couple / stiffness;
    close(end.x, angle.sin(), 1e-9, "the end");
    close(end.z, angle.cos(), 1e-9, "the end");
    // Potentials of the spring and of the couple.
    close(
        found.energy,
        0.5 * couple * couple / stiffness - couple * angle,
        1e-9,
        "the energy",
    );
}

/// Catches joints and planes that are taken wrong without a word.
#[test]
fn joints_and_planes_are_refused_in_words() {
    let rod = |extra: &str, top: &str| {
        format!(
            "{top}[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 1.0 }}\n\
             from = {{ {extra} }}\nto = {{ position = [0.0, 0.0, 0.9], joint = \"ball\" }}\n"
        )
    };
    for (extra, top, words) in [
        ("joint = \"hinge\"", "", "axis = [0.0, 1.0, 0.0]"),
        ("joint = \"hinge\", axis = [0.0, 0.0, 0.0]", "", "not all 0"),
        (
            "joint = \"universal\", axis = [0.0, 1.0, 0.0]",
            "",
            "second_axis",
        ),
        (
            "joint = \"universal\", axis = [0.0, 1.0, 0.0], second_axis = [0.0, 1.0, 1.0]",
            "",
            "across axis",
        ),
        ("axis = [0.0, 1.0, 0.0]", "", "a weld has no axis"),
        (
            "joint = \"slider\", axis = [0.0, 1.0, 0.0], couple = 1.0",
            "",
            "write force",
        ),
        (
            "joint = \"hinge\", axis = [1.0, 0.0, 0.0]",
            "plane = [0.0, 1.0, 0.0]\n",
            "turns about its normal",
        ),
        (
            "rotation = { axis = [0.0, 0.0, 1.0], angle = 0.3 }",
            "plane = [0.0, 1.0, 0.0]\n",
            "d1 or d2 along the normal",
        ),
        (
            "joint = \"ball\"",
            "plane = [0.0, 1.0, 0.0]\n[loads]\ngravity = [0.0, -9.8, 0.0]\n",
            "in the plane",
        ),
    ] {
        let text = rod(extra, top);
        let why = Scene::parse(&text).expect_err(&text).to_string();
        assert!(why.contains(words), "{text}\n{why}");
    }
}
