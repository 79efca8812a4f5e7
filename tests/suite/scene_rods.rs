//! Scenes of rods in space: accepted input, refused input with the place of faults, and parameters.

use crate::scene::{check_faults, damaged};
use crate::support::SAMPLE;
use proptest::prelude::*;
use snaprod::scene::{
    Along, Component, Continue, Fault, FaultKind, Orientation, Parameter, Rigid, Rotation, Scene,
    Section, Shape, Stiffness, StrainName, Transverse,
};
use snaprod::section::Material;
use std::path::Path;

/// A scene with nearly every other field.
const BRANCH: &str = r#"units = "si"
[rod]
model = "cosserat"
length = 2.0
[rod.section]
bending = [1.0, { s = [0.0, 0.5, 2.0], values = [1.0, 0.8, 0.2] }]
torsion = { polynomial = [1.0, -1.0, 0.5] }
[rod.rest]
curvature = [0.25, 0.5]
twist = -1.0
[clamp]
position = [0.1, 0.2, 0.3]
rotation = { axis = [0.0, 2.0, 0.0], angle_degrees = 90 }
[end]
position = [0.5, "free", 1.0]
force = [0, 3.0, 0]
couple = [0.0, 0.0, 0.4]
load = 0.5
[start]
wrench = [0, 0, 1, 0, 0, -1]
[solve]
tolerance = 1e-11
path = "spatial"
[continue]
parameter = "end.position.x"
to = -0.5
step = 0.02
min_step = 1e-6
max_step = 0.05
points = 50
switch = true
both = true
deflate = true
at = [0.0, 1.25]
second = { parameter = "rod.rest.twist", from = -1.5, to = 2, max_step = 0.2 }
"#;

fn parse(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn faults(text: &str) -> Vec<Fault> {
    match Scene::parse(text) {
        Ok(scene) => panic!("accepted: {scene:?}\n{text}"),
        Err(faults) => faults.as_slice().to_vec(),
    }
}

/// `base` with `from` (which must occur) replaced by `to`.
fn edit(base: &str, from: &str, to: &str) -> String {
    assert!(base.contains(from), "{from}");
    base.replacen(from, to, 1)
}

/// SAMPLE with another section.
fn section(lines: &str) -> String {
    let (head, tail) = SAMPLE.split_once("bending").unwrap();
    let (_, tail) = tail.split_once("[rod.rest]").unwrap();
    format!("{head}{lines}\n[rod.rest]{tail}")
}

/// SAMPLE with another end, and further text.
fn end(lines: &str) -> String {
    let (head, _) = SAMPLE.split_once("force").unwrap();
    format!("{head}{lines}\n")
}

/// SAMPLE with another end, for an inextensible and unshearable rod.
fn stiff_end(lines: &str) -> String {
    let text = edit(&end(lines), "axial = 300.0 ", "axial = \"rigid\"");
    edit(&text, "[100.0, 120.0]", "\"rigid\"")
}

const MATRIX: &str = "stiffness = [[1,0,0,0,0,0], [0,2,0.1,0,0,0], [0,0.1,3,0,0,0], \
                      [0,0,0,10,0,0], [0,0,0,0,10,0], [0,0,0,0,0,20]]";
const CIRCLE: &str = "shape = \"circle\"\nradius = 0.01\nyoung = 2.1e11\npoisson = 0.3";
const BARRIER: &str = "law = \"barrier\"\nbending = [1, 1]\ntorsion = 1\naxial = 100\n\
                       barrier = { strength = 2.0, half_widths = [0.1, 0.2] }";

/// Catches a field of the reference's sample that is not read, or read into another place.
#[test]
fn sample_is_accepted() {
    let scene = parse(SAMPLE);
    let Section::Diagonal(law) = &scene.rod.section else {
        panic!("{:?}", scene.rod.section)
    };
    let constant = |value: f64| Along::from(value);
    assert_eq!(law.bending, [1.0.into(), 1.5.into()]);
    assert_eq!(law.torsion, 0.7.into());
    assert_eq!(
        law.shear,
        Stiffness::Elastic([constant(100.0), constant(120.0)])
    );
    assert_eq!(law.axial, Stiffness::Elastic(constant(300.0)));
    assert_eq!(scene.clamp.orientation.quaternion(), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(scene.clamp.position, [0.0; 3]);
    assert_eq!(scene.end().unwrap().force, [1.0, -2.0, 0.5]);
    assert_eq!(scene.end().unwrap().couple, [0.3, 0.2, -0.8]);
    let end = scene.end().unwrap();
    assert!(end.is_loaded() && !end.follower && end.load == 1.0);
    assert_eq!(
        (scene.solve.tolerance, scene.solve.path),
        (1e-10, snaprod::rod::Path::Auto)
    );
    assert_eq!((scene.start.wrench, scene.continuation), (None, None));
}

/// Catches undocumented defaults, and fields read into the wrong place.
#[test]
fn every_field_and_default() {
    let text = "[rod]\nmodel='cosserat'\nlength=2\n[rod.section]\nbending=[1,2]\ntorsion=3\n[end]";
    let scene = parse(text);
    let Section::Diagonal(law) = &scene.rod.section else {
        panic!("{:?}", scene.rod.section)
    };
    assert_eq!(
        (&law.shear, &law.axial),
        (&Stiffness::Rigid, &Stiffness::Rigid)
    );
    assert!(scene.rod.section.is_inextensible());
    assert_eq!(scene.end, Some(snaprod::scene::End::default()));
    let scene = parse(&format!(
        "{text}\nforce=[0,0,1]\n[continue]\nparameter='load'\nto=3"
    ));
    let branch = scene.continuation.unwrap();
    let expected = Continue {
        parameter: "end.load".parse().unwrap(),
        name: "end.load".to_owned(),
        from: 1.0,
        to: 3.0,
        step: 0.01,
        min_step: 1e-8,
        max_step: 0.1,
        points: 200,
        switch: false,
        both: false,
        back: false,
        deflate: false,
        at: vec![],
        second: None,
    };
    assert_eq!(branch, expected);

    let scene = parse(BRANCH);
    assert_eq!(
        scene.end().unwrap().position,
        [Component::Held(0.5), Component::Free, Component::Held(1.0)]
    );
    assert_eq!(scene.end().unwrap().orientation, None);
    assert_eq!(scene.end().unwrap().applied_force(), [0.0, 1.5, 0.0]);
    let quarter = std::f64::consts::FRAC_PI_2;
    let turned = Rotation {
        axis: [0.0, 1.0, 0.0],
        angle: quarter,
    };
    assert_eq!(scene.clamp.orientation, Orientation::Rotation(turned));
    let half = 0.5_f64.sqrt();
    let q = scene.clamp.orientation.quaternion();
    assert!(
        (q[0] - half).abs() < 1e-15 && (q[2] - half).abs() < 1e-15,
        "{q:?}"
    );
    let branch = scene.continuation.as_ref().unwrap();
    assert_eq!(
        (branch.parameter, branch.from, branch.to),
        ("end.position.x".parse().unwrap(), 0.5, -0.5)
    );
    assert_eq!(branch.range(), (-0.5, 1.5));
    let second = branch.second.as_ref().unwrap();
    assert_eq!(
        (second.parameter, second.from, second.to),
        ("rod.rest.twist".parse().unwrap(), -1.5, 2.0)
    );
    assert_eq!(
        (second.step, second.min_step, second.max_step, second.points),
        (0.01, 1e-8, 0.2, 400)
    );
    assert_eq!(scene.start.wrench, Some([0.0, 0.0, 1.0, 0.0, 0.0, -1.0]));
    assert_eq!(
        (scene.solve.tolerance, scene.solve.path),
        (1e-11, snaprod::rod::Path::Spatial)
    );
    let Section::Diagonal(law) = &scene.rod.section else {
        panic!("{:?}", scene.rod.section)
    };
    let bending = |s| law.bending[1].elastic().unwrap().at(s, 2.0).unwrap();
    // Halfway between (0.5, 0.8) and (2, 0.2), and 1 - x + x^2/2 at x = 1/2.
    assert!((bending(1.25) - 0.5).abs() < 1e-15);
    assert_eq!((bending(0.0), bending(2.0)), (1.0, 0.2));
    let torsion = law.torsion.elastic().unwrap();
    assert_eq!(torsion.at(1.0, 2.0).unwrap(), 0.625);
}

/// Catches a form of the section law that is not read, or loses a number.
#[test]
fn sections_in_all_forms() {
    let of = |lines: &str| parse(&section(lines)).rod.section;
    let Section::Full(full) = of(&format!("{MATRIX}\nrigid = [\"v3\", \"v1\", \"v2\"]")) else {
        panic!("full")
    };
    assert_eq!(full.rigid, [StrainName::V1, StrainName::V2, StrainName::V3]);
    assert_eq!((full.stiffness[1][2], full.stiffness[5][5]), (0.1, 20.0));
    assert!(Section::Full(full).is_inextensible() && !of(MATRIX).is_inextensible());
    // Rigid rows have no effect and are not checked.
    of(&format!(
        "{}\nrigid = ['v3']",
        MATRIX.replace("20]]", "0]]")
    ));

    let shaped = |lines: &str| match of(lines) {
        Section::Profile(profile) => profile,
        other => panic!("{other:?}"),
    };
    let circle = shaped(CIRCLE);
    assert_eq!(circle.shape, Shape::Circle { radius: 0.01 }.into());
    assert_eq!(
        (circle.material.young, circle.material.transverse),
        (2.1e11, Transverse::Poisson(0.3))
    );
    let unit = Material {
        young: 2.6,
        ..circle.material
    };
    assert!((unit.shear() - 1.0).abs() < 1e-15);
    assert_eq!(
        circle,
        shaped(&edit(CIRCLE, "radius = 0.01", "diameter = 0.02"))
    );
    let rest =
        "young = 1\nshear_modulus = 0.5\nshear_factor = 0.9\ntorsion_constant = 2\nshear = 'rigid'";
    let rectangle = shaped(&format!(
        "shape = 'rectangle'\nwidth = 1\nheight = 3\n{rest}"
    ));
    let (width, height) = (1.0, 3.0);
    assert_eq!(rectangle.shape, Shape::Rectangle { width, height }.into());
    assert_eq!(rectangle.material.transverse, Transverse::ShearModulus(0.5));
    assert_eq!(
        (rectangle.set.shear_factor, rectangle.set.torsion_constant),
        (Some(0.9), Some(2.0))
    );
    assert_eq!(
        (rectangle.set.shear, rectangle.set.axial),
        (Some(Rigid::Rigid), None)
    );
    let tube = shaped("shape = 'tube'\nouter_diameter = 4\nthickness = 1\nyoung = 1\npoisson = 0");
    let (outer_radius, thickness) = (2.0, 1.0);
    assert_eq!(
        tube.shape,
        Shape::Tube {
            outer_radius,
            thickness
        }
        .into()
    );

    let Section::Barrier(law) = of(BARRIER) else {
        panic!("barrier")
    };
    assert_eq!(
        (law.barrier.strength, law.barrier.half_widths),
        (2.0, [0.1, 0.2])
    );
    assert_eq!(law.linear.axial, Stiffness::Elastic(100.0.into()));
    let linear = "law = 'linear'\nbending = [1, 1]\ntorsion = 1";
    assert!(matches!(of(linear), Section::Diagonal(_)));
}

/// Catches an end condition that reads as another.
#[test]
fn ends_in_all_forms() {
    let of = |lines: &str| parse(&end(lines)).end.unwrap();
    let ball = of("position = [0.5, 0.1, 0.5]\ncouple = [0, 0, 1]");
    assert_eq!(
        (ball.position, ball.orientation),
        ([0.5, 0.1, 0.5].map(Component::Held), None)
    );
    let q = "quaternion = [0.6, 0, 0.8, 0]";
    let clamped = of(&format!("position = [0.5, 0.1, 0.5]\n{q}"));
    assert_eq!(
        clamped.orientation,
        Some(Orientation::Quaternion([0.6, 0.0, 0.8, 0.0]))
    );
    assert_eq!(
        clamped,
        of(&format!("pose = {{ position = [0.5, 0.1, 0.5], {q} }}"))
    );
    let guided = of(&format!("{q}\nforce = [1, 2, 3]"));
    assert!(!guided.is_loaded() && guided.position == [Component::Free; 3]);
    assert_eq!(guided.force, [1.0, 2.0, 3.0]);
    let free = of("position = [\"free\", \"free\", \"free\"]\nforce = [1, 0, 0]\nfollower = true");
    assert!(free.is_loaded() && free.follower);
    // Seven digits suffice for a unit quaternion, which is then normalised.
    let q = parse(&end("quaternion = [0.7071068, 0, 0.7071068, 0]"))
        .end
        .unwrap()
        .orientation
        .unwrap()
        .quaternion();
    assert!((q[0] * q[0] + q[2] * q[2] - 1.0).abs() < 1e-15);
}

/// Catches a resolved scene that cannot be run again, or runs differently.
#[test]
fn resolved_scene_reads_back() {
    let sixth = "rotation = { axis = [1, 2, 3], angle_degrees = 60 }";
    let texts = [
        SAMPLE.to_owned(),
        BRANCH.to_owned(),
        section(MATRIX),
        section(&format!("{MATRIX}\nrigid = ['v1', 'v2']")),
        section(CIRCLE),
        section(
            "shape = 'rectangle'\nwidth = 0.1\nheight = 0.2\nyoung = 3\nshear_modulus = 1\naxial = 'rigid'",
        ),
        section(
            "shape = 'tube'\nouter_radius = 0.1\nthickness = 0.02\nyoung = 3\npoisson = 0.3\nshear_factor = 0.5",
        ),
        section(BARRIER),
        end(&format!("position = [0.1, 0.2, 0.3]\n{sixth}")),
        end(&format!(
            "{sixth}\nforce = [0.1, 0, 0]\n[continue]\nparameter = 'end.force.x'\nto = 1"
        )),
        end(
            "pose = { position = [0.1, 'free', 0.3], quaternion = [0.1825742, 0.3651484, 0.5477226, 0.7302967] }",
        ),
        end("[solve]\npath = 'closed-form'"),
        end("[loads]\ndistributed = [0.1, 0, 0.2]\nload = 0.5"),
        end("[loads]\ngravity = [0, 0, -9.81]").replace("[rod]", "[rod]\nmass = 0.25"),
    ];
    for text in texts {
        let scene = parse(&text);
        let written = toml::to_string(&scene).unwrap();
        assert_eq!(parse(&written), scene, "{written}");
        assert_eq!(
            serde_json::to_value(&scene).unwrap()["rod"]["model"],
            "cosserat"
        );
    }
}

/// Catches invalid scene files; results are tested with the branches.
#[test]
fn scene_files_are_accepted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["cantilever", "heavy_column", "lateral", "twist"] {
        let path = folder.join(format!("{name}.toml"));
        let read = Scene::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(!read.is_motion());
    }
}

/// (text, line, field, kind, words of the message): each text has this one fault.
#[rustfmt::skip]
fn bad() -> Vec<(String, usize, &'static str, FaultKind, &'static str)> {
    use FaultKind::*;
    let sample = |from, to| edit(SAMPLE, from, to);
    let branch = |from, to| edit(BRANCH, from, to);
    let go = |lines: &str| format!("{SAMPLE}[continue]\n{lines}\n");
    let stretch = |x: &str| stiff_end(&format!("position = {x}"));
    let ball = "position = [0.3, 0.0, 0.6]\n";
    vec![
        // The rod.
        (sample("length = 1.0", "length = 0"), 3, "rod.length", Value, "> 0"),
        (sample("length = 1.0", ""), 1, "rod.length", Missing, "length = 1.0"),
        (sample("length = 1.0", "length = 1e-50"), 3, "rod.length", Value, "units"),
        (sample("length = 1.0", "lenght = 1.0"), 3, "rod.lenght", Unknown, "did you mean `length`"),
        (sample("\"cosserat\"", "\"coserat\""), 2, "rod.model", Value, "did you mean \"cosserat\""),
        (sample("length = 1.0", "length = 1.0\ndamping = 1"), 4, "rod.damping", Conflict, "no rates"),
        (sample("length = 1.0", "length = 1.0\ntorsion = 1"), 4, "rod.torsion", Unknown, "belongs in [rod.section]"),
        (format!("{SAMPLE}[body]\nmass = 1"), 16, "body", Conflict, "keep one of the two"),
        (format!("{SAMPLE}[loads]\ndrag = 1"), 17, "loads.drag", Conflict, "in [end]"),
        (format!("{SAMPLE}[loads]\ngravity = [0, 0, -9.81]"), 17, "loads.gravity", Conflict, "mass = 0.02"),
        (format!("{SAMPLE}[loads]\ndistributed = [0, 1]"), 17, "loads.distributed", Value, "2 elements"),
        (sample("length = 1.0", "length = 1.0\nmass = 0"), 4, "rod.mass", Value, "> 0"),
        (go("parameter = 'loads.load'\nto = 1"), 17, "continue.parameter", Value, "common factor of loads.gravity"),
        (go("parameter = 'loads.gravity.z'\nto = 1"), 17, "continue.parameter", Value, "mass = 0.02"),
        (format!("{SAMPLE}[run]\nduration = 1"), 16, "run", Conflict, "keep one of the two"),
        (format!("{SAMPLE}[clamps]"), 16, "clamps", Unknown, "did you mean `clamp`"),
        // The section.
        (sample("[1.0, 1.5]", "[1.0, 0.0]"), 5, "rod.section.bending[1]", Value, "zero stiffness"),
        (sample("[1.0, 1.5]", "[1.0, -2]"), 5, "rod.section.bending[1]", Value, "not convex"),
        (sample("[1.0, 1.5]", "1.0"), 5, "rod.section.bending", Type, "it is a float"),
        (sample("[1.0, 1.5]", "[1.0, 1.5, 2]"), 5, "rod.section.bending", Value, "3 elements"),
        (sample("torsion = 0.7", "torsion = inf"), 6, "rod.section.torsion", Value, "\"rigid\""),
        (sample("torsion = 0.7", "torsion = nan"), 6, "rod.section.torsion", Value, "> 0"),
        (sample("torsion = 0.7", "torsion = \"stiff\""), 6, "rod.section.torsion", Value, "\"rigid\""),
        (sample("torsion = 0.7", ""), 4, "rod.section.torsion", Missing, "torsion = 0.7"),
        (sample("[100.0, 120.0] ", "\"rigged\""), 7, "rod.section.shear", Value, "did you mean \"rigid\""),
        (sample("[100.0, 120.0] ", "[100.0, 0]"), 7, "rod.section.shear[1]", Value, "zero stiffness"),
        (sample("axial = 300.0 ", "axial = 0.0"), 8, "rod.section.axial", Value, "zero stiffness"),
        (section(""), 4, "rod.section", Missing, "bending and torsion"),
        (edit(&section(""), "[rod.section]", "[start]"), 1, "rod.section", Missing, "section law"),
        (section(&format!("{MATRIX}\ntorsion = 1")), 6, "rod.section.torsion", Conflict, "rod.section.stiffness (line 5)"),
        (section(&edit(MATRIX, "[0,0.1,3", "[0,0.2,3")), 5, "rod.section.stiffness", Value, "symmetric"),
        (section(&edit(MATRIX, "[1,0", "[0,0")), 5, "rod.section.stiffness[0][0]", Value, "zero stiffness"),
        (section(&MATRIX.replace("0.1", "2.5")), 5, "rod.section.stiffness", Value, "not convex"),
        (section(&edit(MATRIX, "[1,0,0,0,0,0]", "[1,0,0,0,0]")), 5, "rod.section.stiffness[0]", Value, "5 elements"),
        (section("stiffness = 3"), 5, "rod.section.stiffness", Type, "six rows"),
        (section(&format!("{MATRIX}\nrigid = ['w1']")), 6, "rod.section.rigid[0]", Value, "u1, u2"),
        (section(&format!("{MATRIX}\nrigid = ['u1','u2','u3','v1','v2','v3']")), 6, "rod.section.rigid", Value, "at most one of u1 and u2"),
        (section(&edit(CIRCLE, "circle", "cirle")), 5, "rod.section.shape", Value, "did you mean \"circle\""),
        (section(&format!("{CIRCLE}\nwidth = 1")), 9, "rod.section.width", Conflict, "radius, diameter"),
        (section(&edit(CIRCLE, "0.3", "0.6")), 8, "rod.section.poisson", Value, "0.5"),
        (section(&edit(CIRCLE, "0.3", "-1")), 8, "rod.section.poisson", Value, "(-1"),
        (section(&edit(CIRCLE, "poisson = 0.3", "")), 4, "rod.section.poisson", Missing, "shear_modulus"),
        (section(&format!("{CIRCLE}\nshear_modulus = 1")), 8, "rod.section.poisson", Conflict, "keep one"),
        (section(&format!("{CIRCLE}\nbending = [1, 1]")), 9, "rod.section.bending", Conflict, "shape"),
        (section(&format!("{CIRCLE}\nshear = 3")), 9, "rod.section.shear", Type, "follows from the shape"),
        (section("shape = 'tube'\nouter_radius = 1\nthickness = 1\nyoung = 1\npoisson = 0"), 7, "rod.section.thickness", Value, "circle"),
        (section(&edit(BARRIER, "barrier\"", "barier\"")), 5, "rod.section.law", Value, "did you mean \"barrier\""),
        (section(&edit(BARRIER, "axial = 100", "axial = 'rigid'")), 8, "rod.section.axial", Conflict, "cannot be compressed"),
        (section(&edit(BARRIER, "axial = 100", "")), 4, "rod.section.axial", Missing, "axial = 300.0"),
        (section(&edit(BARRIER, "2.0", "-1")), 9, "rod.section.barrier.strength", Value, "> 0"),
        (section(&edit(BARRIER, "law = \"barrier\"", "")), 9, "rod.section.barrier", Conflict, "law = \"barrier\""),
        (edit(&section(BARRIER), "curvature = [0.0", "curvature = [6.0"), 11, "rod.rest.curvature", Value, "1.2"),
        // Along the rod.
        (sample("torsion = 0.7", "torsion = { s = [0, 0.5], values = [1, 1] }"), 6, "rod.section.torsion.s", Value, "ends at 0.5"),
        (sample("torsion = 0.7", "torsion = { s = [0, 0.5, 0.5, 0.5, 1], values = [1, 1, 2, 2, 2] }"), 6, "rod.section.torsion.s", Value, "inside the rod"),
        (sample("torsion = 0.7", "torsion = { s = [0, 1], values = [1, 0] }"), 6, "rod.section.torsion.values[1]", Value, "zero stiffness"),
        (sample("torsion = 0.7", "torsion = { s = [0, 1], values = [1] }"), 6, "rod.section.torsion.values", Value, "s has 2"),
        (sample("torsion = 0.7", "torsion = { s = [0, 1] }"), 6, "rod.section.torsion.values", Missing, "values ="),
        (sample("torsion = 0.7", "torsion = { polynomial = [1, -4, 4] }"), 6, "rod.section.torsion.polynomial", Value, "0.5"),
        (sample("torsion = 0.7", "torsion = { polynomial = [] }"), 6, "rod.section.torsion.polynomial", Value, "0 elements"),
        (sample("torsion = 0.7", "torsion = { polynomial = [1], values = [1] }"), 6, "rod.section.torsion.values", Conflict, "keep one"),
        (sample("twist = 0.0", "twist = { s = [1, 0], values = [1, 2] }"), 11, "rod.rest.twist.s", Value, "grow"),
        (sample("twist = 0.0", "twist = \"0\""), 11, "rod.rest.twist", Type, "leave out the quotes"),
        // Clamp and end.
        (sample("[end]", "quaternion = [1, 1, 0, 0]\n[end]"), 13, "clamp.quaternion", Value, "1.414213562"),
        (sample("[end]", "quaternion = [0, 0, 0, 0]\n[end]"), 13, "clamp.quaternion", Value, "a rotation"),
        (sample("[end]", "rotation = { axis = [0, 0, 0], angle = 1 }\n[end]"), 13, "clamp.rotation.axis", Value, "not all 0"),
        (sample("[end]", "rotation = { axis = [0, 0, 1] }\n[end]"), 13, "clamp.rotation.angle", Missing, "radians"),
        (sample("[end]", "rotation = { axis = [0, 0, 1], angle = 1, angle_degrees = 2 }\n[end]"), 13, "clamp.rotation.angle_degrees", Conflict, "keep one"),
        (sample("[end]", "quaternion = [1, 0, 0, 0]\nrotation = { axis = [0, 0, 1], angle = 1 }\n[end]"), 14, "clamp.rotation", Conflict, "keep one"),
        (end("force = [1, 2]"), 14, "end.force", Value, "2 elements"),
        (end("force = [1, nan, 2]"), 14, "end.force[1]", Value, "finite"),
        (end("force = [1, 1e60, 2]"), 14, "end.force[1]", Value, "units"),
        (end("follower = \"true\""), 14, "end.follower", Type, "leave out the quotes"),
        (end(&format!("{ball}force = [0, 1, 0]")), 15, "end.force[1]", Conflict, "reaction"),
        (end("quaternion = [1, 0, 0, 0]\ncouple = [0, 0, 1]"), 15, "end.couple[2]", Conflict, "reaction"),
        (end(&format!("{ball}follower = true")), 15, "end.follower", Conflict, "free"),
        (end("position = [0.3, \"fre\", 0.6]"), 14, "end.position[1]", Value, "did you mean \"free\""),
        (end("pose = { position = [0.3, 0, 0.6] }"), 14, "end.pose.quaternion", Missing, "unit quaternion"),
        (end("pose = { quaternion = [1, 0, 0, 0] }"), 14, "end.pose.position", Missing, "position ="),
        (end(&format!("{ball}pose = {{ position = [0.3, 0, 0.6], quaternion = [1, 0, 0, 0] }}")), 14, "end.position", Conflict, "end.pose (line 15)"),
        (stretch("[0.6, 0.8, 0.1]"), 14, "end.position", Value, "distance 1.004988"),
        (stretch("[0.6, 0.0, 0.8]"), 14, "end.position", Value, "taut"),
        (stretch("[1.5, \"free\", \"free\"]"), 14, "end.position", Value, "cannot reach"),
        (stiff_end("pose = { position = [0, 3, 4], quaternion = [1, 0, 0, 0] }"), 14, "end.pose.position", Value, "distance 5.0"),
        (edit(&stretch("[0.5, 0, 0]"), "[end]", "position = [-0.6, 0, 0]\n[end]"), 15, "end.position", Value, "distance 1.1"),
        // Start and solve.
        (format!("{SAMPLE}[start]\nwrench = [1, 2, 3]"), 17, "start.wrench", Value, "3 elements"),
        (format!("{SAMPLE}[solve]\ntolerance = 1e-3"), 17, "solve.tolerance", Value, "[1e-13, 1e-4]"),
        (format!("{SAMPLE}[solve]\npath = \"closed_form\""), 17, "solve.path", Value, "did you mean \"closed-form\""),
        // A branch.
        (SAMPLE.split_once("\n[end]").unwrap().0.to_owned(), 12, "end", Missing, "left empty"),
        (branch("from = -1.5, to", "from = -0.5, to"), 35, "continue.second.from", Value, "the value in the scene"),
        (go("to = 1"), 16, "continue.parameter", Missing, "end.force.x"),
        (go("parameter = \"end.force[0]\""), 16, "continue.to", Missing, "to = 1.0"),
        (go("parameter = \"end.forc.x\"\nto = 3"), 17, "continue.parameter", Value, "did you mean \"end.force.x\""),
        (go("parameter = \"end.force[3]\"\nto = 3"), 17, "continue.parameter", Value, "one of end.force.x, end.force.y"),
        (go("parameter = 3\nto = 3"), 17, "continue.parameter", Type, "an integer"),
        (go("parameter = \"end.position.x\"\nto = 3"), 17, "continue.parameter", Value, "not held"),
        (go("parameter = \"clamp.rotation.angle\"\nto = 3"), 17, "continue.parameter", Value, "rotation = {"),
        (go("parameter = \"end.force.y\"\nto = -2"), 18, "continue.to", Value, "end.force.y = -2 in the scene"),
        (go("parameter = \"end.force.y\"\nfrom = 1\nto = 1"), 19, "continue.to", Value, "one value to another"),
        (go("parameter = \"rod.section.torsion\"\nto = 0"), 18, "continue.to", Value, "> 0"),
        (go("parameter = \"rod.length\"\nfrom = -1\nto = 3"), 18, "continue.from", Value, "> 0"),
        (go("parameter = \"load\"\nto = 3\nstep = 0"), 19, "continue.step", Value, "(0, 1]"),
        (go("parameter = \"load\"\nto = 3\nstep = 0.5\nmax_step = 0.1"), 19, "continue.step", Conflict, "max_step = 0.1"),
        (go("parameter = \"load\"\nto = 3\nmin_step = 0.5\nmax_step = 0.1"), 20, "continue.max_step", Conflict, "min_step = 0.5"),
        (go("parameter = \"load\"\nto = 3\npoints = 1"), 19, "continue.points", Value, "from 2"),
        (go("parameter = \"load\"\nto = 3\nat = [2, 4]"), 19, "continue.at[1]", Value, "between 1 and 3"),
        (go("parameter = \"load\"\nto = 3\nswitch = 1"), 19, "continue.switch", Type, "true or false"),
        (go("parameter = \"load\"\nto = 3\nsecond = { parameter = 'end.load', to = 2 }"), 19, "continue.second.parameter", Conflict, "another"),
        (go("parameter = \"load\"\nto = 3\nsecond = { parameter = 'rod.rest.twst', to = 2 }"), 19, "continue.second.parameter", Value, "rod.rest.twist"),
        (branch("to = -0.5", "to = 2.1"), 26, "continue.to", Value, "distance 2.118962"),
        (branch("\"end.position.x\"", "\"end.position.y\""), 25, "continue.parameter", Value, "not held"),
        (branch("\"end.position.x\"", "\"end.force.x\""), 25, "continue.parameter", Value, "is held"),
        (branch("\"end.position.x\"", "\"rod.section.torsion\""), 25, "continue.parameter", Value, "varies along the rod"),
        (branch("\"end.position.x\"", "\"rod.section.axial\""), 25, "continue.parameter", Value, "rigid"),
        (branch("\"end.position.x\"", "\"rod.length\""), 25, "continue.parameter", Value, "polynomial"),
    ]
}

/// Catches a fault that is not found, is reported at another line or field, or has another message.
#[test]
fn every_fault_has_its_message_and_line() {
    let mut wrong = String::new();
    for (text, line, field, kind, words) in bad() {
        let found = match Scene::parse(&text) {
            Ok(_) => {
                wrong += &format!("accepted: {field} {words}\n");
                continue;
            }
            Err(faults) => faults,
        };
        let [fault] = found.as_slice() else {
            wrong += &format!("want only {field} {words:?}, got\n{found}\n");
            continue;
        };
        let place = (fault.line, fault.field.as_str(), fault.kind);
        if place != (line, field, kind) || !found.to_string().contains(words) {
            wrong += &format!("want {line} {field} {kind:?} {words:?}, got\n{found}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Catches a fault that hides another.
#[test]
fn every_fault_is_reported() {
    let text = r#"[rod]
model = "cosserat"
length = -1.0
[rod.section]
bending = [0.0, "stiff"]
torsion = { s = [0.0, 1.0], values = [1.0, -1.0] }
shear = "no"
[clamp]
quaternion = [1.0, 1.0, 0.0, 0.0]
[end]
position = [1, 2]
follower = 1
[solve]
path = "fast"
[continue]
parameter = "end.forse[0]"
step = 2
"#;
    let seen: Vec<(usize, String)> = faults(text)
        .into_iter()
        .map(|f| (f.line, f.field))
        .collect();
    let expected = [
        (3, "rod.length"),
        (5, "rod.section.bending[0]"),
        (5, "rod.section.bending[1]"),
        (6, "rod.section.torsion.values[1]"),
        (7, "rod.section.shear"),
        (9, "clamp.quaternion"),
        (11, "end.position"),
        (12, "end.follower"),
        (14, "solve.path"),
        (15, "continue.to"),
        (16, "continue.parameter"),
        (17, "continue.step"),
    ];
    let expected = expected.map(|(line, field)| (line, field.to_owned()));
    assert_eq!(seen, expected);
}

/// Catches a path to a wrong number: `with` must change exactly the number read by `value`, and the result equals the
/// scene with that number in its text.
#[test]
fn parameters_are_the_numbers_they_name() {
    let all = r#"
        [rod]
        model = "cosserat"
        length = 8.25
        mass = 0.3125
        [loads]
        gravity = [31.5, 32.5, 33.5]
        distributed = [34.5, 35.5, 36.5]
        follower = [51.5, 52.5, 53.5]
        load = 37.5
        [rod.section]
        bending = [11.5, 12.5]
        torsion = 13.5
        shear = [14.5, 15.5]
        axial = 16.5
        [rod.rest]
        curvature = [17.5, 18.5]
        twist = 19.5
        [clamp]
        position = [1.25, 1.375, 1.75]
        rotation = { axis = [0.0, 0.0, 1.0], angle = 2.125 }
        [end]
    "#;
    let load = format!(
        "{all}\nforce = [21.5, 22.5, 23.5]\ncouple = [24.5, 25.5, 26.5]\nload = 27.5\n\
                 follower_force = [41.5, 42.5, 43.5]\nfollower_couple = [44.5, 45.5, 46.5]"
    );
    let held = format!(
        "{all}\nposition = [3.25, 3.125, 3.75]\nrotation = {{ axis = [1.0, 0.0, 0.0], angle = 28.5 }}"
    );
    let law = load.replace(
        "[rod.section]",
        "[rod.section]\nlaw = 'barrier'\nbarrier = { strength = 1, half_widths = [0.01, 0.02] }",
    );
    let driven = load.replace(
        "[rod.section]",
        "[[rod.tendon]]\noffset = [0.0, 0.1]\ntension = 0.4375\n\
         [rod.drive]\ncurvature = [0.0, 1.0]\namplitude = 0.1875\n[rod.section]",
    ) + "\n[[load]]\ns = 2.0\nforce = [61.5, 62.5, 63.5]\ncouple = [64.5, 65.5, 66.5]\nfactor = 67.5\n";
    let expected = [
        ("rod.length", 8.25),
        ("rod.tendon[0].tension", 0.4375),
        ("rod.drive.amplitude", 0.1875),
        ("rod.section.bending[0]", 11.5),
        ("rod.section.bending[1]", 12.5),
        ("rod.section.torsion", 13.5),
        ("rod.section.shear[0]", 14.5),
        ("rod.section.shear[1]", 15.5),
        ("rod.section.axial", 16.5),
        ("rod.rest.curvature[0]", 17.5),
        ("rod.rest.curvature[1]", 18.5),
        ("rod.rest.twist", 19.5),
        ("clamp.position[0]", 1.25),
        ("clamp.position.y", 1.375),
        ("clamp.position[2]", 1.75),
        ("clamp.rotation.angle", 2.125),
        ("end.force[0]", 21.5),
        ("end.force.y", 22.5),
        ("end.force[2]", 23.5),
        ("end.couple.x", 24.5),
        ("end.couple[1]", 25.5),
        ("end.couple[2]", 26.5),
        ("end.load", 27.5),
        ("end.follower_force[0]", 41.5),
        ("end.follower_force.y", 42.5),
        ("end.follower_force[2]", 43.5),
        ("end.follower_couple.x", 44.5),
        ("end.follower_couple[1]", 45.5),
        ("end.follower_couple[2]", 46.5),
        ("end.position[0]", 3.25),
        ("end.position[1]", 3.125),
        ("end.position.z", 3.75),
        ("end.rotation.angle", 28.5),
        ("loads.gravity[0]", 31.5),
        ("loads.gravity.y", 32.5),
        ("loads.gravity[2]", 33.5),
        ("loads.distributed.x", 34.5),
        ("loads.distributed[1]", 35.5),
        ("loads.distributed[2]", 36.5),
        ("loads.load", 37.5),
        ("loads.follower[0]", 51.5),
        ("loads.follower.y", 52.5),
        ("loads.follower[2]", 53.5),
        ("load[0].force.x", 61.5),
        ("load[0].force[1]", 62.5),
        ("load[0].force.z", 63.5),
        ("load[0].couple[0]", 64.5),
        ("load[0].couple.y", 65.5),
        ("load[0].couple[2]", 66.5),
        ("load[0].factor", 67.5),
    ];
    let mut seen = Vec::new();
    for text in [&load, &held, &law, &driven] {
        let scene = parse(text);
        for (path, value) in expected {
            let parameter: Parameter = path.parse().unwrap();
            if !scene.has(&parameter) {
                assert!(scene.value(&parameter).is_nan(), "{path}");
                assert_eq!(scene.with(&parameter, 1.0), scene, "{path}");
                continue;
            }
            seen.push(parameter);
            assert_eq!(scene.value(&parameter), value, "{path}");
            assert_eq!(
                parameter.to_string().parse::<Parameter>().unwrap(),
                parameter
            );
            // Every number of the text is another one.
            let other = text.replacen(&format!("{value}"), "9.875", 1);
            assert_eq!(scene.with(&parameter, 9.875), parse(&other), "{path}");
        }
    }
    assert!(
        Parameter::all()
            .iter()
            .all(|parameter| seen.contains(parameter))
    );
    for bad in [
        "",
        "end.force",
        "end.force[3]",
        "end.force[00]",
        "rod.section.bending.x",
        "end.force.w",
        "é[0]",
    ] {
        assert!(bad.parse::<Parameter>().is_err(), "{bad}");
    }
    let scene = parse(SAMPLE);
    let of_no_body: Parameter = "body[7].force.x".parse().unwrap();
    assert!(scene.value(&of_no_body).is_nan());
    assert_eq!(scene.with(&of_no_body, 1.0), scene);
}

/// Catches an accepted polynomial stiffness that is not positive, against sampling.
#[test]
fn polynomial_stiffness_is_positive() {
    for i in 0..200 {
        // (x - a)^2 + b, b on both sides of 0, by its coefficients.
        let a = f64::from(i) / 200.0;
        for b in [1e-3, -1e-3] {
            let torsion = format!(
                "torsion = {{ polynomial = [{:?}, {:?}, 1] }}",
                a * a + b,
                -2.0 * a
            );
            let text = edit(SAMPLE, "torsion = 0.7", &torsion);
            assert_eq!(Scene::parse(&text).is_ok(), b > 0.0, "{torsion}");
        }
    }
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        check(&bytes)?;
    }

    /// Damaged scenes get further than noise: fragments are put in, and spans are cut out.
    #[test]
    fn no_damage_panics(
        which in 0..5usize,
        edits in prop::collection::vec((0..2000usize, 0..40usize, 0..FRAGMENTS.len()), 1..6),
    ) {
        let text = match which {
            0 => SAMPLE.to_owned(),
            1 => section(MATRIX),
            2 => section(CIRCLE),
            3 => section(BARRIER),
            _ => BRANCH.to_owned(),
        };
        check(&damaged(&text, &edits, &FRAGMENTS))?;
    }
}

const FRAGMENTS: [&str; 32] = [
    "",
    "\n",
    "=",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "nan",
    "-inf",
    "1e999",
    "1e39",
    "0x1F",
    "\"free\"",
    "\"rigid\"",
    "\n[start]\n",
    "\n[[end]]\n",
    "\n[rod.section.torsion]\npolynomial = [1, -2, 1]\n",
    "{ s = [0, 1], values = [1, 2] }",
    "{ s = [], values = [] }",
    "\nshape = 'tube'\n",
    "\nlaw = 'barrier'\n",
    "\nstiffness = [[]]\n",
    "\nposition = [3, 4, 0]\n",
    "\npose = {}\n",
    "\nquaternion = [0, 0, 0, 0]\n",
    "\nparameter = 'rod.length'\n",
    "\r\n",
    "é",
    "\u{feff}",
    "\n'a b'.c = 2020-01-01\n",
    "\n[continue.second]\n",
];

/// Accepted, and then written and read as the same; or refused with at least one fault, each on a line of the
/// text.
fn check(bytes: &[u8]) -> Result<(), TestCaseError> {
    match Scene::from_bytes(bytes) {
        Ok(scene) => {
            let written = toml::to_string(&scene).unwrap();
            let again = Scene::parse(&written);
            prop_assert_eq!(again.as_ref(), Ok(&scene), "{}", written);
            Ok(())
        }
        Err(faults) => check_faults(bytes, &faults),
    }
}
