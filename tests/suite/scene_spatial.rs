//! Scenes of motion in space: accepted input, refused input with the place of faults, and values in the library's
//! units.

use crate::support::{one_fault, text_of};
use snaprod::scene::{
    BarrierTerm, Damping, EndLoad, EndPose, FaultKind, FrictionLaw, History, InitialShape, Joint,
    Load, Method, Orientation, PowerLaw, RelaxedAt, Scene, Start, StrainField, StrainMatrix,
    StrainName, Units,
};
use snaprod::section::Strain;
use snaprod::section::rate::Viscoelastic;

/// A scene with every table and nearly every field; its lines are counted below.
const FULL: &str = r#"units = "si"
[rod]
model = "cosserat"
length = 0.5
damping = [0.003, 0.004, 0.002, 0.1, 0.2, 0.5]
relaxation = [{ stiffness = [0.01, 0.02, 0.0, 1, 2, 3], time = 2.0 }, { stiffness = { proportional = 0.25 }, time = 0.5 }]
nodes = 16
[rod.section]
bending = [0.03, 0.015]
torsion = 0.01
shear = [10.0, 12.0]
axial = 30.0
[clamp]
position = [0.1, 0.0, 0.2]
[body]
mass = 0.05
offset = [0.0, 0.01, 0.02]
inertia = [1e-4, 2e-4, 3e-4]
[start]
strain = { u1 = [0.5, -0.25], v3 = [1.1] }
relaxed = { u2 = [0.3] }
velocity = [0.0, 2.0, 0.0]
angular_velocity = [0.0, 0.0, 4.0]
[loads]
gravity = [0.0, 0.0, -9.81]
dead = [0.04, 0.0, 0.0]
couple = [0.0, 0.02, 0.0]
drag = 0.1
force = { direction = [0.0, 3.0, 4.0], amplitude = 0.16, frequency = 2.0 }
[run]
duration = 2.0
method = "explicit"
"#;

/// A ball joint on a rod that can only bend and twist, and defaults.
const BALL: &str = r#"[rod]
model = "cosserat"
length = 1.0
damping = { proportional = 0.05 }
[rod.section]
bending = [1.0, 1.5]
torsion = 0.7
[body]
mass = 1.0
joint = "ball"
[start]
velocity = [0.5, 0.0, 0.0]
[run]
duration = 3.0
"#;

fn parse(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

/// `base` with `from` (which must occur) replaced by `to`.
fn edit(base: &str, from: &str, to: &str) -> String {
    assert!(base.contains(from), "{from}");
    base.replacen(from, to, 1)
}

fn damping(text: &str) -> String {
    edit(BALL, "{ proportional = 0.05 }", text)
}

fn start(text: &str) -> String {
    edit(BALL, "velocity", &format!("{text}\nvelocity"))
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 4e-15 * a.abs().max(b.abs()), "{a} {b}");
}

fn all_close(a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).for_each(|(a, b)| close(*a, *b));
}

fn field(entries: &[(StrainName, &[f64])]) -> StrainField {
    let mut field = StrainField::default();
    for (name, polynomial) in entries {
        field.0[*name as usize] = Some(polynomial.to_vec());
    }
    field
}

const MATRIX: &str = "[[1,0,0,0,0,0], [0,2,0,0.5,0,0], [0,0,3,0,0,0], [0,0.5,0,10,0,0], [0,0,0,0,10,0], [0,0,0,0,0,20]]";
const BARRIER: &str = "barrier = { strength = 0.1, half_widths = [0.05, 0.1] }";

/// Catches a field read into another place, and undocumented defaults.
#[test]
fn fields_and_defaults() {
    let scene = parse(FULL);
    let linear = |viscosity| {
        let law = FrictionLaw::Linear;
        Some(Damping { viscosity, law })
    };
    let six = [0.003, 0.004, 0.002, 0.1, 0.2, 0.5];
    assert_eq!(scene.units, Units::Si);
    assert_eq!(scene.rod.damping, linear(StrainMatrix::Diagonal(six)));
    assert_eq!(
        scene
            .rod
            .damping
            .as_ref()
            .unwrap()
            .viscosity
            .rows()
            .unwrap()[3][3],
        0.1
    );
    assert_eq!(scene.rod.relaxation.len(), 2);
    assert_eq!(
        scene.rod.relaxation[1].modulus,
        StrainMatrix::Proportional(0.25)
    );
    assert_eq!((scene.rod.nodes, scene.rod.length), (Some(16), 0.5));
    let inertia = [[1e-4, 0.0, 0.0], [0.0, 2e-4, 0.0], [0.0, 0.0, 3e-4]];
    let offset = [0.0, 0.01, 0.02];
    assert_eq!(
        scene.body().unwrap().joint,
        Joint::Weld {
            offset,
            inertia,
            rotor: [0.0; 3]
        }
    );
    let bent = field(&[(StrainName::U1, &[0.5, -0.25]), (StrainName::V3, &[1.1])]);
    assert_eq!(bent.at(StrainName::U1, 0.5), Some(0.375));
    assert_eq!(bent.at(StrainName::U2, 0.5), None);
    assert_eq!(scene.start.place, InitialShape::Strain { strain: bent });
    assert_eq!(
        scene.start.relaxed,
        RelaxedAt::Strain(field(&[(StrainName::U2, &[0.3])]))
    );
    assert_eq!(scene.start.velocity, [0.0, 2.0, 0.0]);
    assert_eq!(scene.start.angular_velocity, [0.0, 0.0, 4.0]);
    assert_eq!(
        (scene.loads.couple.clone(), scene.loads.drag),
        (Load::Constant([0.0, 0.02, 0.0]), 0.1)
    );
    assert_eq!(scene.run().unwrap().method, Method::Explicit);
    assert!(scene.run().unwrap().reduce);
    let elastic = edit(BALL, "damping = { proportional = 0.05 }\n", "");
    let stiff = edit(&elastic, "[run]", "[run]\nmethod = \"implicit\"");
    assert_eq!(parse(&stiff).run().unwrap().method, Method::Implicit);
    let whole = parse(&edit(FULL, "method =", "reduce = false\nmethod ="));
    assert!(!whole.run().unwrap().reduce);
    assert!(whole.rod == scene.rod && whole.run().unwrap().method == scene.run().unwrap().method);

    let scene = parse(&edit(BALL, "[start]\nvelocity = [0.5, 0.0, 0.0]\n", ""));
    assert_eq!(scene.rod.damping, linear(StrainMatrix::Proportional(0.05)));
    assert_eq!(
        (scene.body().unwrap().joint.is_weld(), scene.rod.nodes),
        (false, None)
    );
    assert_eq!(scene.start, Start::default());
    assert_eq!(scene.loads, Default::default());
    assert_eq!(
        (
            scene.run().unwrap().tolerance,
            scene.run().unwrap().samples,
            scene.run().unwrap().max_steps
        ),
        (1e-8, 400, 10_000_000)
    );
    assert_eq!(scene.run().unwrap().method, Method::Auto);
    // A weld and no offset are the defaults; the entries of rigid strains have no effect.
    let weld = edit(
        BALL,
        "joint = \"ball\"",
        "inertia = [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1]]",
    );
    let Joint::Weld {
        offset, inertia, ..
    } = parse(&weld).body.unwrap().joint
    else {
        panic!()
    };
    assert_eq!((offset, inertia[0][1]), ([0.0; 3], 0.1));
    parse(&damping("[1, 1, 1, 0, -1, 0]"));
    parse(&damping(&edit(MATRIX, "10,0,0]", "-10,0,0]")));
}

/// Forms of damping and of the start. Catches a form that is read as another.
#[test]
fn forms_of_damping_and_start() {
    let of = |text: &str| parse(&damping(text)).rod.damping.unwrap();
    let power = PowerLaw {
        exponent: 0.5,
        rate: 2.0,
    };
    let found = of("{ proportional = 0.1, exponent = 0.5, rate = 2 }");
    assert_eq!(found.law, FrictionLaw::Power(power));
    assert_eq!(found.viscosity, StrainMatrix::Proportional(0.1));
    let elastic = edit(
        FULL,
        "[0.003, 0.004, 0.002, 0.1, 0.2, 0.5]",
        &format!("{{ viscosity = {MATRIX}, {BARRIER} }}"),
    );
    let found = parse(&elastic).rod.damping.unwrap();
    let barrier = BarrierTerm {
        strength: 0.1,
        half_widths: [0.05, 0.1],
    };
    assert_eq!(found.law, FrictionLaw::Barrier(barrier));
    assert_eq!(found.viscosity.rows().unwrap()[3][1], 0.5);

    let of = |text: &str| parse(&start(text)).start.place;
    let (force, couple) = ([1.0, 0.0, -2.0], [0.0; 3]);
    let equilibrium = EndLoad { force, couple };
    let load = InitialShape::Equilibrium { equilibrium };
    assert_eq!(of("equilibrium = { force = [1, 0, -2] }"), load);
    let pose = EndPose {
        position: [0.3, 0.0, 0.5],
        orientation: None,
    };
    assert_eq!(
        of("pose = { position = [0.3, 0, 0.5] }"),
        InitialShape::Pose { pose }
    );
    let welded = edit(
        FULL,
        "strain = { u1 = [0.5, -0.25], v3 = [1.1] }",
        "pose = { position = [0.3, 0, 0.5], quaternion = [0, 1, 0, 0] }",
    );
    let InitialShape::Pose { pose } = parse(&welded).start.place else {
        panic!()
    };
    assert_eq!(
        pose.orientation,
        Some(Orientation::Quaternion([0.0, 1.0, 0.0, 0.0]))
    );
}

/// Catches lost content, and content written in a form that is refused.
#[test]
fn scenes_read_back() {
    let mut texts = vec![
        FULL.to_owned(),
        BALL.to_owned(),
        text_of("whirl"),
        edit(FULL, "relaxed = { u2 = [0.3] }", "relaxed = false"),
        edit(
            FULL,
            "strain = { u1 = [0.5, -0.25], v3 = [1.1] }",
            "pose = { position = [0.3, 0, 0.5], rotation = { axis = [1, 1, 0], angle = 0.3 } }",
        ),
        edit(
            FULL,
            "strain = { u1 = [0.5, -0.25], v3 = [1.1] }",
            "equilibrium = { couple = [0.3, 0, 0.5] }",
        ),
        edit(
            FULL,
            "[0.003, 0.004, 0.002, 0.1, 0.2, 0.5]",
            &format!("{{ proportional = 1, {BARRIER} }}"),
        ),
        edit(
            FULL,
            "[0.003, 0.004, 0.002, 0.1, 0.2, 0.5]",
            &format!("{{ viscosity = {MATRIX}, {BARRIER} }}"),
        ),
    ];
    texts.extend(["{ proportional = 1, exponent = 2, rate = 3 }", MATRIX].map(damping));
    texts.extend(["equilibrium = {}", "pose = { position = [0.1, 0.2, 0.3] }"].map(start));
    for text in texts {
        let scene = parse(&text);
        let written = toml::to_string(&scene).unwrap();
        assert_eq!(parse(&written), scene, "{written}");
    }
}

/// (text, line, field, kind, words of the message): each text has this one fault.
#[rustfmt::skip]
fn bad() -> Vec<(String, usize, &'static str, FaultKind, &'static str)> {
    use FaultKind::*;
    let full = |from, to| edit(FULL, from, to);
    let ball = |from, to| edit(BALL, from, to);
    let matrix = |from, to| damping(&edit(MATRIX, from, to));
    // Shear and stretch are possible, and viscous.
    let loose = |text: &str| edit(FULL, "[0.003, 0.004, 0.002, 0.1, 0.2, 0.5]", text);
    let branch = |text: &str| edit(FULL, "{ proportional = 0.25 }", text);
    let place = |text: &str| edit(FULL, "strain = { u1 = [0.5, -0.25], v3 = [1.1] }", text);
    vec![
        // Damping.
        (ball("damping = { proportional = 0.05 }", "nodes = 8"), 4, "rod.nodes", Conflict, "no strains of its own"),
        (ball("damping = { proportional = 0.05 }", "relaxation = []"), 4, "rod.relaxation", Conflict, "{ proportional = 0.1 }"),
        (edit(&ball("damping = { proportional = 0.05 }\n", ""), "[start]", "[start]\nstrain = { u1 = [0.5] }"), 11, "start.strain", Conflict, "a pose"),
        (damping("0.1"), 4, "rod.damping", Type, "{ proportional = 0.1 }"),
        (damping("-0.1"), 4, "rod.damping", Value, ">= 0"),
        (damping("true"), 4, "rod.damping", Type, "u1 u2 u3"),
        (damping("[1, 2, 3]"), 4, "rod.damping", Value, "3 elements"),
        (damping("[1, 0, 3, 0, 0, 0]"), 4, "rod.damping[1]", Value, "however small"),
        (damping("[1, -1, 3, 0, 0, 0]"), 4, "rod.damping[1]", Value, "> 0"),
        (damping("[1, nan, 3, 0, 0, 0]"), 4, "rod.damping[1]", Value, "finite"),
        (loose("[1, 1, 1, 0, 1, 1]"), 5, "rod.damping[3]", Value, "however small"),
        (matrix("[1,0", "[-1,0"), 4, "rod.damping[0][0]", Value, "feed energy"),
        (matrix("[1,0,0", "[1,0.1,0"), 4, "rod.damping", Value, "symmetric"),
        (loose(&MATRIX.replace("0.5", "5")), 5, "rod.damping", Value, "feed energy"),
        (matrix("[1,0,0,0,0,0]", "[1,0]"), 4, "rod.damping[0]", Value, "2 elements"),
        (damping("{}"), 4, "rod.damping.proportional", Missing, "viscosity, a matrix"),
        (damping("{ proportional = 0 }"), 4, "rod.damping.proportional", Value, "> 0"),
        (damping("{ proportional = 1, viscosity = [1, 1, 1, 0, 0, 0] }"), 4, "rod.damping.viscosity", Conflict, "keep one"),
        (damping("{ proportional = 1, exponent = 0.5 }"), 4, "rod.damping.rate", Missing, "rate = 1.0"),
        (damping("{ viscosity = [1, 1, 1, 0, 0, 0], exponent = 0.5, rate = 1 }"), 4, "rod.damping.viscosity", Conflict, "write `proportional"),
        (damping("{ viscosity = [1, 0, 1, 0, 0, 0] }"), 4, "rod.damping.viscosity[1]", Value, "however small"),
        (damping(&format!("{{ proportional = 1, {BARRIER} }}")), 4, "rod.damping.barrier", Conflict, "cannot be compressed"),
        (loose(&format!("{{ proportional = 1, exponent = 1, rate = 1, {BARRIER} }}")), 5, "rod.damping.barrier", Conflict, "keep one"),
        (loose(&format!("{{ proportional = 1, {} }}", BARRIER.replace("0.05", "0"))), 5, "rod.damping.barrier.half_widths[0]", Value, "> 0"),
        (damping("{ proportonal = 1 }"), 4, "rod.damping.proportonal", Unknown, "did you mean `proportional`"),
        // Branches and nodes.
        (branch("1.0"), 6, "rod.relaxation[1].stiffness", Type, "so many times the stiffness"),
        (branch("[1, 1, 1, 1, 1, -1]"), 6, "rod.relaxation[1].stiffness[5]", Value, ">= 0"),
        (branch(&MATRIX.replace("0.5", "5")), 6, "rod.relaxation[1].stiffness", Value, "semidefinite"),
        (branch("{ proportional = -1 }"), 6, "rod.relaxation[1].stiffness.proportional", Value, ">= 0"),
        (full("time = 0.5", "time = 0"), 6, "rod.relaxation[1].time", Value, "> 0"),
        (full("nodes = 16", "nodes = 3"), 7, "rod.nodes", Value, "from 4 to 400"),
        // The rod and its clamp have the faults of statics.
        (ball("torsion = 0.7", "torsion = 0"), 7, "rod.section.torsion", Value, "zero stiffness"),
        (full("[0.1, 0.0, 0.2]", "[0.1]"), 14, "clamp.position", Value, "1 elements"),
        // The body.
        (ball("mass = 1.0", "mass = 0"), 9, "body.mass", Value, "> 0"),
        (ball("\"ball\"", "\"bal\""), 10, "body.joint", Value, "did you mean \"ball\""),
        (ball("joint = \"ball\"", ""), 8, "body.inertia", Missing, "inertia = [0.01"),
        (ball("mass = 1.0", "mass = 1.0\ninertia = [1, 1, 1]"), 10, "body.inertia", Conflict, "body.joint (line 11)"),
        (ball("mass = 1.0", "mass = 1.0\noffset = [1, 0, 0]"), 10, "body.offset", Conflict, "point mass"),
        (full("[1e-4, 2e-4, 3e-4]", "[1e-4, 2e-4, 0]"), 18, "body.inertia[2]", Value, "\"ball\""),
        (full("[1e-4, 2e-4, 3e-4]", "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]"), 18, "body.inertia", Value, "positive definite"),
        (full("[1e-4, 2e-4, 3e-4]", "[[1, 2, 0], [0, 1, 0], [0, 0, 1]]"), 18, "body.inertia", Value, "symmetric"),
        (full("[1e-4, 2e-4, 3e-4]", "1.0"), 18, "body.inertia", Type, "three rows of three"),
        // The start.
        (start("strain = { u1 = [] }"), 12, "start.strain.u1", Value, "1 to 16"),
        (start("strain = { v3 = [1.0] }"), 12, "start.strain.v3", Conflict, "give it a stiffness"),
        (start("strain = { w1 = [1.0] }"), 12, "start.strain.w1", Unknown, "u1, u2"),
        (place("strain = { v3 = [1.0, -1.5] }"), 20, "start.strain.v3", Value, "total compression"),
        (start("strain = [1.0]"), 12, "start.strain", Type, "polynomials"),
        (start("curvature = [1.0]"), 12, "start.curvature", Unknown, "belongs in [rod.rest]"),
        (start("equilibrium = { couple = [1, 0, 0] }"), 12, "start.equilibrium.couple", Conflict, "ball"),
        (start("angular_velocity = [1, 0, 0]"), 12, "start.angular_velocity", Conflict, "ball"),
        (start("equilibrium = {}\nstrain = {}"), 12, "start.equilibrium", Conflict, "start.strain (line 13)"),
        (start("pose = {}"), 12, "start.pose.position", Missing, "position = ["),
        (start("pose = { position = [0, 0, 1] }"), 12, "start.pose.position", Value, "taut and straight"),
        (start("pose = { position = [0, 0, 1.5] }"), 12, "start.pose.position", Value, "cannot reach"),
        (start("pose = { position = [0, 0, 0.5], quaternion = [1, 0, 0, 0] }"), 12, "start.pose.quaternion", Conflict, "ball"),
        (place("pose = { position = [0, 0, 0.5] }"), 20, "start.pose.quaternion", Missing, "welded"),
        (start("relaxed = true"), 12, "start.relaxed", Conflict, "relaxation = ["),
        (full("{ u2 = [0.3] }", "[0.3]"), 21, "start.relaxed", Type, "{ u1 = [0.5, -0.5] }"),
        (full("{ u2 = [0.3] }", "1"), 21, "start.relaxed", Type, "unloaded rod"),
        (full("[0.0, 2.0, 0.0]", "[0.0, 2.0]"), 22, "start.velocity", Value, "[x, y, z]"),
        // Loads and run.
        (ball("[run]", "[loads]\ncouple = [0, 0, 1]\n[run]"), 14, "loads.couple", Conflict, "ball"),
        (full("[0.0, 0.0, -9.81]", "[0.0, -9.81]"), 25, "loads.gravity", Value, "2 elements"),
        (full("[0.0, 3.0, 4.0]", "[0, 0, 0]"), 29, "loads.force.direction", Value, "not all 0"),
        (full("[0.0, 3.0, 4.0]", "[0, 1]"), 29, "loads.force.direction", Value, "2 elements"),
        (full("drag = 0.1", "drag = -1"), 28, "loads.drag", Value, ">= 0"),
        (full("\"explicit\"", "\"rk4\""), 32, "run.method", Value, "\"implicit\""),
        (full("method = \"explicit\"", "landing = \"lowest\""), 32, "run.landing", Conflict, "its own way"),
        (full("method = \"explicit\"", "reduce = 0"), 32, "run.reduce", Type, "true or false"),
        (full("method = \"explicit\"", "tolerance = 0.1"), 32, "run.tolerance", Value, "1e-14"),
        (full("duration = 2.0", ""), 30, "run.duration", Missing, "duration = 3.0"),
        (full("duration = 2.0", "duration = 1e-320"), 2, "rod", Value, "units"),
        // Two kinds of scene at once.
        (format!("{BALL}[end]"), 15, "end", Conflict, "keep one of the two"),
        (format!("{BALL}[solve]"), 15, "solve", Conflict, "keep one of the two"),
        (format!("{BALL}[contineu]"), 15, "contineu", Unknown, "one of units"),
    ]
}

/// Catches an accepted scene that cannot be run, and faults with misleading advice.
#[test]
fn bad_scenes_are_refused() {
    for (text, line, field, kind, words) in bad() {
        let found = match Scene::parse(&text) {
            Ok(scene) => panic!("accepted: {scene:?}\n{text}"),
            Err(faults) => faults,
        };
        one_fault(found.as_slice(), &text, (line, field, kind, words));
    }
}

/// Catches a scene taken for another kind, and a demand for fields of another kind.
#[test]
fn what_a_scene_is_follows_from_its_content() {
    let statics = text_of("cantilever");
    let kinds = |text: &str| {
        let scene = parse(text);
        (scene.is_planar(), scene.is_motion())
    };
    assert_eq!(kinds(&statics), (false, false));
    assert_eq!(kinds(FULL), (false, true));
    assert_eq!(kinds(&text_of("snap")), (true, true));
    let no_end = parse(FULL).problem().unwrap_err().to_string();
    assert!(no_end.contains("snaprod run"), "{no_end}");
    let no_run = parse(&statics).scales().unwrap_err().to_string();
    assert!(no_run.contains("snaprod equilibrium"), "{no_run}");
    let one = |text: &str, field: &str| {
        let faults = Scene::parse(text).unwrap_err();
        assert_eq!(faults.as_slice().len(), 1, "{faults}");
        assert_eq!(faults.as_slice()[0].field, field, "{faults}");
    };
    // One table of the other kind is one fault.
    one(&format!("{statics}\n[body]\nmass = 1.0"), "body");
    // Without a model, or with a slip in it, the rest decides.
    for text in [BALL, &text_of("snap"), &statics] {
        let model = if text.contains("cosserat") {
            "cosserat"
        } else {
            "elastica"
        };
        let written = format!("\nmodel = \"{model}\"");
        let slip = format!("\nmodel = \"{}\"", &model[1..]);
        one(&edit(text, &written, &slip), "rod.model");
        one(&edit(text, &written, ""), "rod.model");
    }
}

/// Catches a fault that hides another one.
#[test]
fn all_faults_at_once() {
    let text = r#"[rod]
model = "cosserat"
length = 1.0
damping = [1, 0, 1, 0, 0, 0]
nodes = 1
[rod.section]
bending = [1.0, 1.0]
torsion = 1.0
[end]
[body]
mass = -1.0
[start]
strain = { u1 = [nan] }
pose = {}
[loads]
drag = -1
[run]
method = 3
"#;
    let faults = Scene::parse(text).unwrap_err();
    let seen: Vec<_> = faults
        .into_iter()
        .map(|f| (f.line, f.field.as_str()))
        .collect();
    let expected = [
        (4, "rod.damping[1]"),
        (5, "rod.nodes"),
        (9, "end"),
        (10, "body.inertia"),
        (11, "body.mass"),
        (13, "start.strain.u1[0]"),
        (14, "start.pose.position"),
        (14, "start.pose.quaternion"),
        (14, "start.pose"),
        (16, "loads.drag"),
        (17, "run.duration"),
        (18, "run.method"),
    ];
    assert_eq!(seen, expected);
}

/// L = 0.5 m, B = 2/(1/0.03 + 1/0.015) = 0.02 N m^2, m = 0.05 kg by hand, time = sqrt(m L^3/B) = sqrt(0.3125) s.
/// Catches couples, forces, flexures and stretches scaled alike, and wrong powers of length or time.
#[test]
fn si_scales() {
    let scene = parse(FULL);
    let scales = scene.scales().unwrap();
    let time = 0.3125_f64.sqrt();
    close(scales.time, time);
    close(scales.force, 0.08);
    close(scales.energy, 0.04);
    let free = scene.dimensionless().unwrap();
    // A law in other units rounds several times.
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} {b}");
    let all_near = |a: &[f64], b: &[f64]| a.iter().zip(b).for_each(|(a, b)| near(*a, *b));
    let law = |scene: &Scene| {
        let measures = scene.scales().unwrap().measures();
        scene.viscoelastic().unwrap().law_in_units(measures)
    };
    // Overstress at the strain rates of one strain, from the unloaded rod.
    let friction = |law: &Viscoelastic, k: usize, rate: f64| {
        let rate = Strain::ith(k, rate);
        law.rate
            .overstress(0.0, &law.elastic.unloaded(0.0).unwrap(), &rate)
            .unwrap()
    };
    let full = law(&scene);
    for (k, h) in [0.15, 0.2, 0.1, 1.25, 2.5, 6.25].into_iter().enumerate() {
        near(friction(&full, k, 1.0)[k], h / time);
    }
    let stiffness = full
        .elastic
        .tangent(0.0, &full.elastic.unloaded(0.0).unwrap())
        .unwrap();
    let [first, second] = &full.branches[..] else {
        panic!()
    };
    all_near(
        first.modulus.diagonal().as_slice(),
        &[0.5, 1.0, 0.0, 12.5, 25.0, 37.5],
    );
    close(first.time, 2.0 / time);
    all_near(second.modulus.as_slice(), (stiffness * 0.25).as_slice());
    all_close(&free.clamp.position, &[0.2, 0.0, 0.4]);
    let Joint::Weld {
        offset, inertia, ..
    } = &free.body.as_ref().unwrap().joint
    else {
        panic!()
    };
    all_close(offset, &[0.0, 0.02, 0.04]);
    all_close(
        inertia.as_flattened(),
        &[0.008, 0.0, 0.0, 0.0, 0.016, 0.0, 0.0, 0.0, 0.024],
    );
    let InitialShape::Strain { strain } = &free.start.place else {
        panic!()
    };
    all_close(strain.polynomial(StrainName::U1).unwrap(), &[0.25, -0.125]);
    all_close(strain.polynomial(StrainName::V3).unwrap(), &[1.1]);
    let relaxed = field(&[(StrainName::U2, &[0.15])]);
    assert_eq!(free.start.relaxed, RelaxedAt::Strain(relaxed));
    close(free.start.velocity[1], 2.0 / 0.8_f64.sqrt());
    close(free.start.angular_velocity[2], 4.0 * time);
    close(free.loads.gravity[2], -9.81 / 1.6);
    close(free.loads.dead[0], 0.5);
    close(free.loads.couple.constant()[1], 0.5);
    close(free.loads.drag, 0.1 / (0.08 / 0.8_f64.sqrt()));
    all_close(&free.loads.force[0].unit(), &[0.0, 0.6, 0.8]);
    let History::Sine(sine) = &free.loads.force[0].size else {
        panic!()
    };
    close(sine.amplitude, 2.0);
    close(sine.frequency, 2.0 * time);

    let other = |text: &str| {
        let text = edit(FULL, "[0.003, 0.004, 0.002, 0.1, 0.2, 0.5]", text);
        law(&parse(&text))
    };
    let matrix = other(MATRIX);
    let [bend, shear] = [1, 3].map(|k| friction(&matrix, k, 1.0));
    all_near(
        &[bend[1], bend[3], shear[1], shear[3]],
        &[100.0, 12.5, 12.5, 125.0].map(|x| x / time),
    );
    // A rate of 4/(m s) about the weakest axis is 2 time; there friction is 2^((0.5 - 1)/2) of that of small rates.
    let power = other("{ proportional = 0.5, exponent = 0.5, rate = 4.0 }");
    let small = stiffness[(1, 1)] * 0.5 / time;
    near(friction(&power, 1, 1e-9)[1], small * 1e-9);
    near(
        friction(&power, 1, 2.0 * time)[1],
        small * 2.0 * time * 0.5_f64.powf(0.25),
    );
    let barrier = other(&format!("{{ proportional = 0.5, {BARRIER} }}"));
    let along = friction(&barrier, 5, 1.0)[5] - stiffness[(5, 5)] * 0.5 / time;
    near(along, 0.1 * 12.5 / time);
    let load = edit(
        FULL,
        "strain = { u1 = [0.5, -0.25], v3 = [1.1] }",
        "equilibrium = { force = [0.16, 0, 0], couple = [0, 0.04, 0] }",
    );
    let InitialShape::Equilibrium { equilibrium: load } =
        parse(&load).dimensionless().unwrap().start.place
    else {
        panic!()
    };
    all_close(&[load.force[0], load.couple[1]], &[2.0, 1.0]);
}
