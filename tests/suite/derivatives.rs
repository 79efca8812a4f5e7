//! Derivatives of equilibria, special points, frequencies and runs by fields; stiffness and compliance.

use serde_json::Value;
use snaprod::scene::SceneText;
use snaprod::study::branch::branch_by;
use snaprod::study::run::{Fields, derivatives};
use snaprod::study::{Data, FirstOrder, Fit, Silent, Table, Vary, dispatch};
use std::f64::consts::PI;

/// Summary of the equilibrium of a text, with derivatives by fields and its responses.
fn rest(text: &str, by: &[&str], responses: bool) -> Value {
    let text = SceneText::new(text, &[]);
    let by = by.iter().map(|path| text.field(path).unwrap()).collect();
    let asked = FirstOrder { by, responses };
    dispatch::rest(&text.scene().unwrap(), &asked).unwrap().0
}

/// Number at a dotted path.
#[track_caller]
fn at(value: &Value, path: &str) -> f64 {
    let found = path
        .split('|')
        .fold(value, |at, step| match step.parse::<usize>() {
            Ok(k) if at.is_array() => &at[k],
            _ => &at[step],
        });
    found.as_f64().unwrap_or_else(|| panic!("{path}: {found}"))
}

/// Derivative of a number of the summary by a field.
#[track_caller]
fn by(summary: &Value, field: &str, path: &str) -> f64 {
    at(&summary["derivatives"][field], path)
}

#[track_caller]
fn near(found: f64, expected: f64, error: f64) {
    let off = (found - expected).abs();
    assert!(off <= error, "{found} for {expected}: {off:.1e} off");
}

const CIRCLE: &str = r#"
[rod]
model = "cosserat"
length = 1.3
section = { bending = [2.0, 2.0], torsion = 1.5 }
[end]
couple = [0.0, 0.9, 0.0]
"#;

/// A wrong chain from the text of a scene to its equilibrium, or from the unknowns to a number of the summary. A couple
/// C bends the rod to a circle of the curvature k = C/B.
#[test]
fn a_rod_bent_to_a_circle_has_the_derivatives_of_the_circle() {
    let found = rest(CIRCLE, &["rod.length", "end.couple.1"], false);
    let (l, b, c) = (1.3_f64, 2.0, 0.9);
    let k = c / b;
    // x = (1 - cos kL)/k, z = sin(kL)/k, energy = C^2 L/(2 B).
    let (sin, cos) = (k * l).sin_cos();
    near(by(&found, "rod.length", "position|0"), sin, 1e-10);
    near(by(&found, "rod.length", "position|2"), cos, 1e-10);
    near(by(&found, "rod.length", "energy"), c * c / (2.0 * b), 1e-10);
    let by_k = [(l * sin - (1.0 - cos) / k) / k, (l * cos - sin / k) / k];
    near(by(&found, "end.couple.1", "position|0"), by_k[0] / b, 1e-10);
    near(by(&found, "end.couple.1", "position|2"), by_k[1] / b, 1e-10);
    near(by(&found, "end.couple.1", "energy"), c * l / b, 1e-10);
    near(by(&found, "end.couple.1", "tip_couple|1"), 1.0, 1e-11);
    // The other bending stiffness has no part in the circle.
    let stiffer = rest(
        CIRCLE,
        &["rod.section.bending[0]", "rod.section.bending[1]"],
        false,
    );
    let sum = |path| {
        by(&stiffer, "rod.section.bending[0]", path) + by(&stiffer, "rod.section.bending[1]", path)
    };
    near(sum("energy"), -c * c * l / (2.0 * b * b), 1e-10);
    near(sum("position|2"), -by_k[1] * k / b, 1e-10);
}

const ARCH: &str = r#"
units = "si"
[rod]
model = "cosserat"
length = 0.4
material = { E = 2e11, nu = 0.3 }
section = { rectangle = { width = 0.02, thickness = 0.001 } }
[end]
position = [0.05, 0.02, 0.3]
rotation = { axis = [0.0, 1.0, 0.0], angle = 0.4 }
"#;

/// Derivatives that do not belong to one potential: the stored energy changes by the work at the end, and wrenches at
/// the end by a symmetric matrix. The material enters as a factor. The rod has units and a section by its shape.
#[test]
fn an_arch_in_si_units_obeys_virtual_work_and_reciprocity() {
    let fields = [
        "end.position.0",
        "end.position.1",
        "end.position.2",
        "rod.material.E",
    ];
    let found = rest(ARCH, &fields, true);
    let force = |k: usize| at(&found, &format!("tip_force|{k}"));
    let scale = force(0).hypot(force(2));
    let size = by(&found, "end.position.2", "tip_force|2").abs();
    for (k, field) in fields[..3].iter().enumerate() {
        near(by(&found, field, "energy"), force(k), 1e-8 * scale);
        for (j, other) in fields[..k].iter().enumerate() {
            let back = by(&found, other, &format!("tip_force|{k}"));
            near(
                by(&found, field, &format!("tip_force|{j}")),
                back,
                1e-8 * size,
            );
        }
    }
    let (e, energy) = (2e11, at(&found, "energy"));
    near(
        by(&found, "rod.material.E", "energy") * e,
        energy,
        1e-9 * energy,
    );
    // The tangent of the rod is another route to the same numbers.
    let size = at(&found, "responses|end|stiffness|5|5").abs();
    for (k, field) in fields[..3].iter().enumerate() {
        for j in 0..3 {
            let tangent = at(
                &found,
                &format!("responses|end|stiffness|{}|{}", 3 + j, 3 + k),
            );
            near(
                by(&found, field, &format!("tip_force|{j}")),
                tangent,
                1e-8 * size,
            );
        }
    }
}

const BEAM: &str = r#"
[rod]
model = "cosserat"
length = 2.0
[rod.section]
bending = [3.0, 3.0]
torsion = 1.7
axial = 50.0
[end]
position = [0.0, 0.0, 2.0]
rotation = { axis = [0.0, 1.0, 0.0], angle = 0.0 }
[[station]]
name = "middle"
s = 1.0
"#;

/// A wrong frame, order or unit of stiffness and compliance, of the end and of stations: those of a straight beam are
/// known.
#[test]
fn a_straight_beam_has_the_matrices_of_the_textbook() {
    let found = rest(BEAM, &[], true);
    let (b, l) = (3.0, 2.0_f64);
    let end = |i: usize, j: usize| at(&found, &format!("responses|end|stiffness|{i}|{j}"));
    let known = [
        ((0, 0), 4.0 * b / l),
        ((1, 1), 4.0 * b / l),
        ((2, 2), 1.7 / l),
        ((3, 3), 12.0 * b / l.powi(3)),
        ((4, 4), 12.0 * b / l.powi(3)),
        ((5, 5), 50.0 / l),
        ((3, 1), -6.0 * b / (l * l)),
        ((1, 3), -6.0 * b / (l * l)),
        ((4, 0), 6.0 * b / (l * l)),
        ((0, 4), 6.0 * b / (l * l)),
    ];
    for ((i, j), value) in known {
        near(end(i, j), value, 1e-10);
    }
    near(end(0, 1), 0.0, 1e-11);
    near(at(&found, "responses|end|compliance|2|2"), l / 1.7, 1e-10);
    // Between two clamps: L^3/(192 B), L/(16 B), L/(4 EA), L/(4 GJ).
    let middle = |i: usize| {
        at(
            &found,
            &format!("responses|stations|middle|compliance|{i}|{i}"),
        )
    };
    near(middle(3), l.powi(3) / (192.0 * b), 1e-10);
    near(middle(0), l / (16.0 * b), 1e-10);
    near(middle(5), l / (4.0 * 50.0), 1e-10);
    near(middle(2), l / (4.0 * 1.7), 1e-10);
    let stiff = at(&found, "responses|stations|middle|stiffness|4|4");
    near(stiff, 192.0 * b / l.powi(3), 1e-7);
}

/// NaN or infinities in place of words where an equilibrium is at a fold, or cannot move in a direction.
#[test]
fn a_rigid_direction_leaves_the_compliance_alone() {
    let straight = BEAM.replace("axial = 50.0\n", "").replace(
        "position = [0.0, 0.0, 2.0]\nrotation = { axis = [0.0, 1.0, 0.0], angle = 0.0 }",
        "force = [0.0, 0.0, 0.0]",
    );
    let found = rest(&straight, &[], true);
    let end = &found["responses"]["end"];
    assert!(end["stiffness"].is_null() && end["reason"].as_str().unwrap().contains("stiffness"));
    near(at(end, "compliance|3|3"), 8.0 / 9.0, 1e-10);
    near(at(end, "compliance|5|5"), 0.0, 1e-10);
}

const COLUMN: &str = r#"
[rod]
model = "cosserat"
length = 1.2
section = { bending = [9.0, 2.0], torsion = 0.8 }
[end]
force = [0.0, 0.0, -1.0]
couple = [0.0, 0.0, 0.0]
[continue]
parameter = "end.load"
from = 0.0
to = 5.0
"#;

/// Derivatives of special points by fields.
fn specials(text: &str, by: &[&str]) -> Vec<Value> {
    let text = SceneText::new(text, &[]);
    let by: Vec<_> = by.iter().map(|path| text.field(path).unwrap()).collect();
    let record = branch_by(&text.scene().unwrap(), &by, &mut Silent).unwrap();
    record.summary()["special_points"]
        .as_array()
        .unwrap()
        .clone()
}

/// A wrong derivative of the load at which a column buckles, P = pi^2 B/(4 L^2), and one of a field that lets no
/// branch point be.
#[test]
fn the_load_of_a_column_has_the_derivatives_of_euler() {
    let fields = [
        "rod.length",
        "rod.section.bending[0]",
        "rod.section.bending[1]",
        "end.couple[0]",
        "end.couple[1]",
    ];
    let found = specials(COLUMN, &fields);
    let (l, b) = (1.2_f64, 2.0);
    let load = PI.powi(2) * b / (4.0 * l * l);
    let euler = &found[0];
    near(at(euler, "parameter"), load, 1e-9);
    let rate = |field: &str| at(&euler["derivatives"], field);
    near(rate("rod.length"), -2.0 * load / l, 1e-8);
    near(
        rate("rod.section.bending[0]") + rate("rod.section.bending[1]"),
        load / b,
        1e-8,
    );
    let unfolds = |field: &str| {
        euler["no_derivatives"][field]
            .as_str()
            .is_some_and(|why| why.contains("symmetry"))
    };
    assert!(
        unfolds("end.couple[0]") != unfolds("end.couple[1]"),
        "{euler}"
    );
}

/// A wrong derivative of the load of a fold. Force and couple C grow in proportion, so that the factor of a rod of the
/// length L and the stiffness B is B/L^2 g(C/L). The derivatives obey B P_B = P and L P_L + C P_C = -2 P. That by C is
/// compared with folds located beside.
#[test]
fn the_fold_of_an_imperfect_column_scales_and_moves() {
    let imperfect = |c: f64| {
        COLUMN
            .replace(
                "couple = [0.0, 0.0, 0.0]",
                &format!("couple = [0.0, {c:?}, 0.0]\nposition = [0.0, 0.0, \"free\"]"),
            )
            .replace(
                "section = { bending = [9.0, 2.0]",
                "section = { bending = [2.0, 2.0]",
            )
            .replace("to = 5.0", "to = 60.0")
    };
    let (l, b, c) = (1.2, 2.0, 0.1);
    let fields = [
        "rod.length",
        "rod.section.bending[0]",
        "rod.section.bending[1]",
        "end.couple[1]",
    ];
    let found = specials(&imperfect(c), &fields);
    let fold = found.iter().find(|at| at["kind"] == "fold").unwrap();
    let rate = |field: &str| at(&fold["derivatives"], field);
    let load = at(fold, "parameter");
    let by_b = rate(fields[1]) + rate(fields[2]);
    near(b * by_b, load, 1e-8 * load);
    near(
        l * rate(fields[0]) + c * rate(fields[3]),
        -2.0 * load,
        1e-8 * load,
    );
    let located = |c: f64| {
        let found = specials(&imperfect(c), &[]);
        at(
            found.iter().find(|at| at["kind"] == "fold").unwrap(),
            "parameter",
        )
    };
    let h = 2e-3;
    let wide = (located(c + 2.0 * h) - located(c - 2.0 * h)) / (4.0 * h);
    let narrow = (located(c + h) - located(c - h)) / (2.0 * h);
    near(
        rate(fields[3]),
        (4.0 * narrow - wide) / 3.0,
        1e-5 * rate(fields[3]).abs(),
    );
}

const HANGING: &str = r#"
[[rod]]
name = "left"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.3], torsion = 0.9, axial = 200.0 }
from = { position = [-0.7, 0.0, 0.0], rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 } }
to = { body = "m" }
[[rod]]
name = "right"
model = "cosserat"
length = 1.1
section = { bending = [1.5, 1.0], torsion = 1.0, axial = 200.0 }
from = { position = [0.9, 0.1, 0.0], rotation = { axis = [0.0, 1.0, 0.0], angle_degrees = 90.0 } }
to = { body = "m" }
[[body]]
name = "m"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
force = [0.2, 0.1, -1.0]
guess = { position = [0.1, 0.0, -0.3] }
"#;

/// Wrong derivatives of an assembly: those of the energy are the place of the load and the forces of supports, and
/// the compliance of the body is its answer to the load.
#[test]
fn an_assembly_obeys_virtual_work() {
    let fields = [
        "body.m.force.0",
        "body.m.force.2",
        "rod.left.from.position.0",
        "rod.right.length",
    ];
    let found = rest(HANGING, &fields, true);
    for (field, k) in [(fields[0], 0), (fields[1], 2)] {
        let place = at(&found, &format!("bodies|m|position|{k}"));
        near(by(&found, field, "energy"), -place, 1e-9);
        for j in [0, 1, 2] {
            let compliance = at(
                &found,
                &format!("responses|bodies|m|compliance|{}|{}", 3 + j, 3 + k),
            );
            near(
                by(&found, field, &format!("bodies|m|position|{j}")),
                compliance,
                1e-9,
            );
        }
    }
    let base = at(&found, "rods|left|base_wrench|force|0");
    near(by(&found, fields[2], "energy"), -base, 1e-9);
    let errors = &found["derivative_errors"][fields[3]];
    assert!(at(errors, "energy") < 1e-8, "{errors}");
}

/// Catches derivatives of numbers without a derivative, and messages without advice.
#[test]
fn derivatives_that_do_not_exist_are_refused_by_name() {
    let text = SceneText::new(CIRCLE, &[]);
    let why = text.field("rod.width").unwrap_err().to_string();
    assert!(why.contains("rod.width") && why.contains("--set"), "{why}");
    let wall = "[[obstacle]]\nplane = { point = [-5.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }\n";
    let text = SceneText::new(format!("{CIRCLE}{wall}"), &[]);
    let asked = FirstOrder {
        by: vec![text.field("rod.length").unwrap()],
        responses: false,
    };
    let why = dispatch::rest(&text.scene().unwrap(), &asked).unwrap_err();
    assert!(why.to_string().contains("[[obstacle]]"), "{why}");
}

/// Wrong derivatives of frequencies, which go with the square roots of all stiffnesses together and of the inverse of
/// all masses, also where the equilibrium moves with single ones.
#[test]
fn frequencies_scale_with_stiffness_and_mass() {
    let text = format!("{HANGING}\n[run]\nduration = 1.0\n");
    let text = text
        .replace("force = [0.2, 0.1, -1.0]", "force = [0.0, 0.0, 0.0]")
        .replace("axial = 200.0", "axial = 20.0");
    let text = SceneText::new(text, &[]);
    let scene = text.scene().unwrap();
    let paths = [
        "rod.left.section.bending.0",
        "rod.left.section.bending.1",
        "rod.left.section.torsion",
        "rod.left.section.axial",
        "rod.right.section.bending.0",
        "rod.right.section.bending.1",
        "rod.right.section.torsion",
        "rod.right.section.axial",
        "body.m.mass",
        "body.m.inertia.0",
        "body.m.inertia.1",
        "body.m.inertia.2",
    ];
    let fields: Vec<_> = paths.iter().map(|path| text.field(path).unwrap()).collect();
    let mut summary = snaprod::study::modes(&scene).unwrap().summary();
    let found = snaprod::study::modes::derivatives(&scene, &fields).unwrap();
    found.put_into(&mut summary);
    for k in 0..6 {
        let omega = at(&summary, &format!("angular_frequencies|{k}"));
        let relative = |i: usize| {
            let rate = by(&summary, paths[i], &format!("angular_frequencies|{k}"));
            rate * fields[i].value / omega
        };
        let stiff: f64 = (0..8).map(relative).sum();
        let heavy: f64 = (8..12).map(relative).sum();
        near(stiff, 0.5, 1e-8);
        near(heavy, -0.5, 1e-8);
    }
}

const SNAP: &str = r#"
[rod]
model = "elastica"
length = 1.2
bending_stiffness = 1.7
[body]
mass = 0.8
[start]
lambda = 5.25
kappa = 0.6
velocity = [0.1, -0.5]
[loads]
gravity = [0.0, -0.4]
drag = 0.1
[run]
duration = 0.6
samples = 4
tolerance = 1e-12
max_steps = 100000
"#;

/// End of a run, and time and energy of its snaps.
struct Ended {
    end: [f64; 4],
    snaps: Vec<[f64; 2]>,
}

fn run(text: &SceneText, path: &str, value: f64) -> Ended {
    let scene = text.field(path).unwrap().scene(value).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let found = dispatch::motion(&scene, Fields::None, &mut tables, &mut Silent).unwrap();
    let snaps = found.events.iter();
    Ended {
        end: ["x", "y", "vx", "vy"].map(|name| at(&found.summary["end"], name)),
        snaps: snaps
            .map(|snap| [at(snap, "t"), at(snap, "released")])
            .collect(),
    }
}

/// Derivatives that miss the jump at a fold or at a landing, or a way in which a field enters: start, loads, or the
/// units of length, force and time. Compared are differences of fine runs, of the fourth order.
#[test]
fn a_run_has_derivatives_through_its_snap() {
    let text = SceneText::new(SNAP, &[]);
    let scene = text.scene().unwrap();
    let fields = [
        ("body.mass", 5e-4),
        ("rod.length", 1.5e-4),
        ("rod.bending_stiffness", 5e-4),
        ("start.velocity.1", 5e-4),
        ("loads.drag", 5e-4),
        ("start.lambda", 1e-4),
    ];
    for (path, part) in fields {
        let field = text.field(path).unwrap();
        let found = derivatives(&scene, std::slice::from_ref(&field)).unwrap();
        let (mine, h) = (&found.each[0], part * field.value.abs());
        let beside = [1.0, -1.0, 2.0, -2.0].map(|k| run(&text, path, field.value + k * h));
        assert_eq!(mine.snaps.len(), 1);
        assert!(beside.iter().all(|one| one.snaps.len() == 1));
        let slope = |of: &dyn Fn(&Ended) -> f64| {
            let [a, b, c, d] = beside.each_ref().map(of);
            (8.0 * (a - b) - (c - d)) / (12.0 * h)
        };
        let end = mine.samples.last().unwrap();
        // Errors grow with the whole derivative, whichever component is large.
        let size = end.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
        for (k, found) in end.iter().enumerate() {
            near(*found, slope(&|of| of.end[k]), 1e-8 * size);
        }
        let snap = mine.snaps[0];
        near(snap.t, slope(&|of| of.snaps[0][0]), 1e-9);
        near(snap.released, slope(&|of| of.snaps[0][1]), 1e-8);
    }
}

/// Derivatives of runs whose derivatives are not followed, or a refusal without a way out.
#[test]
fn runs_without_derivatives_are_refused_by_name() {
    let refused = |change: [&str; 2], words: &str| {
        let text = SceneText::new(SNAP.replace(change[0], change[1]), &[]);
        let field = text.field("body.mass").unwrap();
        let why = derivatives(&text.scene().unwrap(), &[field]).unwrap_err();
        assert!(why.to_string().contains(words), "{why}");
    };
    let damped = [
        "bending_stiffness = 1.7",
        "bending_stiffness = 1.7\ndamping = 0.1",
    ];
    refused(damped, "without friction");
    refused(
        ["lambda = 5.25\nkappa = 0.6", "rest = \"straight\""],
        "straight rod",
    );
}

/// A fit that takes differences where derivatives are known, or derivatives in a wrong variable: length, stiffness and
/// couple of a rod bent to a circle take two studies a step, not seven.
#[test]
fn a_fit_of_an_equilibrium_uses_its_derivatives() {
    let (l, b, c) = (1.3_f64, 2.0, 0.9);
    let (sin, cos) = (l * c / b).sin_cos();
    let numbers = [(1.0 - cos) * b / c, sin * b / c, c * c * l / (2.0 * b), c];
    let names = ["position.0", "position.2", "energy", "tip_couple.1"];
    let row = numbers.map(|x| format!("{x:?}")).join(",");
    let data = Data::parse(&format!("{}\n{row}\n", names.join(","))).unwrap();
    let free = [
        "rod.length=1.0:2.0",
        "rod.section.bending.1=log:1.0:5.0",
        "end.couple.1=0.5:2.0",
    ];
    let free = free.map(|text| Vary::free(text).unwrap()).to_vec();
    let noise = names.map(|name| (name.to_owned(), 1e-3));
    let scene = CIRCLE.replace("length = 1.3", "length = 1.6");
    let fit = Fit::new(scene, Vec::new(), free, data, &[], &noise).unwrap();
    let found = fit.search(&fit.start(0, 0), &mut Silent).unwrap().unwrap();
    let record = fit.best(vec![found], 1, &mut Silent).unwrap();
    for (parameter, value) in record.parameters.iter().zip([l, b, c]) {
        near(parameter.value, value, 1e-8);
    }
    assert!(record.effort[2] <= 30, "{:?}", record.effort);
}
