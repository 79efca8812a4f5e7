//! Geometry of rods: shapes that vary along the rod or jump, strains held rigid, unloaded shapes, directors by tangent.
//! The references are in tests/data/sections.json, or closed forms.

use crate::support::{assert_close, frequencies, json, list, modes_of, number, rows, vector3};
use nalgebra::Vector3;
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{EquilibriumRecord, Silent, Table, assembly, equilibrium};
use std::f64::consts::{PI, TAU};

const TAPER: &str = "length = 0.4\nmaterial = { E = 2e6, nu = 0.5, density = 1100 }\n\
    section = { circle = { diameter = { s = [0, 0.4], values = [0.012, 0.005] } }, shear = 'rigid', axial = 'rigid' }\n";
const STEPS: &str = "length = 0.3\nmaterial = { E = 2e6, nu = 0.5, density = 1000 }\n\
    section = { shear = 'rigid', axial = 'rigid', circle = { diameter = { \
    s = [0, 0.1, 0.1, 0.2, 0.2, 0.3], values = [0.01, 0.01, 0.007, 0.007, 0.005, 0.005] } } }\n";

fn parse(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn solved(text: &str) -> EquilibriumRecord {
    equilibrium(&parse(text)).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

/// Rod, force on its end and gravity, in y and z, of each cantilever of the data.
const LOADED: [(&str, &str, &str); 2] = [
    (TAPER, "[0, -0.01, 0.02]", "[0, -9.81, 0]"),
    (STEPS, "[0, -0.02, 0]", "[0, 0, -9.81]"),
];

/// Catches a stiffness that is interpolated in place of the size, a jump that is a ramp or is integrated across, and a
/// weight that is spread evenly; in scenes of one rod, and of assemblies in space and in a plane.
#[test]
fn stiffness_and_weight_follow_the_shape() {
    let data = json("sections.json");
    for (case, (rod, force, gravity)) in rows(&data, "cantilevers", 2).iter().zip(LOADED) {
        let text = format!(
            "units = 'si'\n[rod]\nmodel = 'cosserat'\n{rod}[end]\nforce = {force}\n[loads]\ngravity = {gravity}\n"
        );
        let found = solved(&text);
        let end = list(&case["end"]);
        let at = found.found.end.position;
        assert_close(at.y, end[0], 1e-10, 0.1, "y");
        assert_close(at.z, end[1], 1e-10, 0.1, "z");
        let couple = -number(case, "base_couple");
        assert_close(found.found.base[0], couple, 1e-10, 0.01, "base couple");
        let energy = number(case, "energy");
        assert_close(found.found.end.energy, energy, 1e-10, 0.01, "energy");
        let mass = parse(&text).rod.mass().expect("a mass");
        assert_close(mass, number(case, "mass"), 1e-13, 0.0, "mass");
        assert_eq!(found.found.index, 0);
        let whole = format!(
            "units = 'si'\nPLANE\n[[rod]]\nname = 'a'\nmodel = 'cosserat'\n{rod}from = {{ }}\nto = {{ body = 'n' }}\n\
             [[body]]\nname = 'n'\nmass = 1e-12\ninertia = [1e-12, 1e-12, 1e-12]\nforce = {force}\n[loads]\ngravity = {gravity}\n"
        );
        // Assemblies reach the second case along a short path; the first one is heavier.
        let planes: &[&str] = if rod == STEPS {
            &["", "plane = [1.0, 0.0, 0.0]"]
        } else {
            &[]
        };
        for plane in planes {
            let scene = parse(&whole.replace("PLANE", plane));
            let found = assembly::equilibrium(&scene).expect("an equilibrium");
            let at = found.bodies[0].1.translation.vector;
            assert_close(at.y, end[0], 1e-8, 0.1, "y of the assembly");
            assert_close(at.z, end[1], 1e-8, 0.1, "z of the assembly");
        }
    }
}

/// Catches mass or rotary inertia that does not follow the shape in motion, or that a node at a jump loses.
#[test]
#[ignore = "second tier: 13 s"]
fn vibrations_follow_the_shape() {
    let data = json("sections.json");
    for (case, rod) in rows(&data, "frequencies", 2).iter().zip([TAPER, STEPS]) {
        let found = modes_of(&format!(
            "units = 'si'\n[rod]\nmodel = 'cosserat'\ninertia = 'full'\n{rod}[body]\nmass = 0.005\njoint = 'ball'\n\
             [start]\nrest = 'straight'\n[run]\nduration = 1.0\n"
        ));
        let found = frequencies(&found);
        for (k, omega) in list(&case["omega"]).into_iter().enumerate() {
            // Both directions across swing alike.
            assert_close(found[2 * k], omega, 1e-8, 0.0, "frequency");
            assert_close(found[2 * k + 1], omega, 1e-8, 0.0, "frequency");
        }
    }
}

fn one_way(bending: &str, torsion: &str, case: &serde_json::Value) -> EquilibriumRecord {
    let (force, couple) = (&case["force"], &case["couple"]);
    solved(&format!(
        "[rod]\nmodel = 'cosserat'\nlength = 1.0\nsection = {{ bending = {bending}, torsion = {torsion} }}\n\
         [end]\nforce = {force}\ncouple = {couple}\n"
    ))
}

/// Catches a change of a rigid flexure or twist, and a wrong reaction couple.
#[test]
fn rods_that_bend_one_way_and_rods_that_do_not_twist() {
    let data = json("sections.json");
    let cases = rows(&data, "one_way", 3);
    let sections = [
        ("['rigid', 1.0]", "0.8", 0),
        ("['rigid', 1.0]", "0.8", 0),
        ("[1.3, 1.0]", "'rigid'", 2),
    ];
    for (case, (bending, torsion, held)) in cases.iter().zip(sections) {
        let found = one_way(bending, torsion, case);
        let end = &found.found.end;
        assert!((end.position - vector3(case, "end")).norm() < 1e-12);
        let tangent = end.directors.column(2) - vector3(case, "tangent");
        assert!(tangent.norm() < 1e-12);
        let couple = found.found.base.fixed_rows::<3>(0) - vector3(case, "base_couple");
        assert!(couple.norm() < 1e-12);
        assert_close(end.energy, number(case, "energy"), 1e-12, 1.0, "energy");
        assert!(found.sections.iter().all(|s| s.strain[held] == 0.0));
    }
    // A stiff rod is away from the rigid one by 0.25 times its compliance, in the component y.
    let rigid = one_way("['rigid', 1.0]", "0.8", &cases[0]).found;
    for give in [1e-3, 1e-4, 1e-5] {
        let stiff = one_way(&format!("[{}, 1.0]", 1.0 / give), "0.8", &cases[0]).found;
        let away = (stiff.end.position - rigid.end.position).amax() / give;
        assert_close(away, 0.25, 1e-3, 1.0, "distance over compliance");
        assert_eq!(stiff.index, rigid.index);
    }
}

/// Catches a flexure that is rigid at rest and gives in motion: the rod has one bending mode of each order, not two.
/// Frequencies of Euler's beam with a point mass at its end.
#[test]
fn a_rod_that_bends_one_way_swings_one_way() {
    let found = modes_of(
        "[rod]\nmodel = 'cosserat'\nlength = 1.0\nmass = 1.0\ninertia = 'full'\n\
         section_inertia = [1e-11, 1e-11, 2e-11]\nsection = { bending = ['rigid', 1.0], torsion = 'rigid' }\n\
         [body]\nmass = 0.5\njoint = 'ball'\n[start]\nrest = 'straight'\n[run]\nduration = 1.0\n",
    );
    let end =
        |b: f64| 1.0 + b.cos() * b.cosh() + 0.5 * b * (b.cos() * b.sinh() - b.sin() * b.cosh());
    let found = frequencies(&found);
    for (k, (mut low, mut high)) in [(1.0, 2.0), (3.5, 4.5), (6.5, 7.8)].into_iter().enumerate() {
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if end(low) * end(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        assert_close(found[k], low * low, 1e-8, 0.0, "frequency");
    }
}

/// Catches a wrong curvature, twist, length or handedness of a helix or an arc, and directors that are not those of
/// tangent and normal: the ends are those of the curves.
#[test]
fn unloaded_shapes_are_helices_and_arcs() {
    let (r, pitch, turns) = (0.02, 0.05, 4.3);
    for (left, side) in [("", 1.0), (", left = true", -1.0)] {
        let found = solved(&format!(
            "[rod]\nmodel = 'cosserat'\nsection = {{ bending = [1, 1], torsion = 1 }}\n\
             rest = {{ helix = {{ radius = {r}, pitch = {pitch}, turns = {turns}{left} }} }}\n\
             [clamp]\nposition = [{r}, 0, 0]\ntangent = [0, {}, {}]\nnormal = [-1, 0, 0]\n[end]\n",
            r * TAU,
            side * pitch
        ));
        let (sin, cos) = (TAU * turns).sin_cos();
        let end = Vector3::new(r * cos, r * sin, side * pitch * turns);
        assert!((found.found.end.position - end).norm() < 1e-12);
        assert_close(
            found.length,
            turns * (TAU * r).hypot(pitch),
            1e-14,
            0.0,
            "length",
        );
        let inward = found.found.end.directors.column(0) + Vector3::new(cos, sin, 0.0);
        assert!(inward.norm() < 1e-10, "d1 points to the axis");
    }
    for (arc, angle) in [
        ("radius = 0.5, angle = 1.2", 1.2_f64),
        ("radius = 0.5, angle_degrees = -30", -30.0_f64.to_radians()),
    ] {
        let found = solved(&format!(
            "[rod]\nmodel = 'cosserat'\nsection = {{ bending = [1, 1], torsion = 1 }}\nrest = {{ arc = {{ {arc} }} }}\n\
             [clamp]\ntangent = [0, 2, 0]\nnormal = [3, 1, 0]\n[end]\n"
        ));
        let side = 0.5 * angle.signum();
        let end = Vector3::new(side * (1.0 - angle.cos()), 0.5 * angle.abs().sin(), 0.0);
        assert!((found.found.end.position - end).norm() < 1e-13);
    }
}

/// Catches bad input that is taken without a word, or told at another place.
#[test]
fn bad_geometry_is_told() {
    let rod = |lines: &str| format!("[rod]\nmodel = 'cosserat'\nlength = 1.0\n{lines}\n[end]\n");
    let shaped = |section: &str| rod(&format!("material = 'steel'\nsection = {{ {section} }}"));
    let rest = |shape: &str| {
        rod(&format!(
            "section = {{ bending = [1, 1], torsion = 1 }}\nrest = {{ {shape} }}"
        ))
    };
    let clamp = |lines: &str| {
        let rod = rod("section = { bending = [1, 1], torsion = 1 }");
        rod.replace("[end]", &format!("[clamp]\n{lines}\n[end]"))
    };
    let cases = [
        (
            shaped("circle = { diameter = { s = [0, 1], values = [0.01, 0] } }"),
            "rod.section.circle.diameter.values[1]",
            FaultKind::Value,
            "> 0",
        ),
        (
            shaped("circle = { diameter = { s = [0, 0.5], values = [0.01, 0.02] } }"),
            "rod.section.circle.diameter.s",
            FaultKind::Value,
            "ends at 0.5",
        ),
        (
            shaped("circle = { diameter = { s = [0, 1, 1], values = [1, 2, 3] } }"),
            "rod.section.circle.diameter.s",
            FaultKind::Value,
            "inside the rod",
        ),
        (
            shaped("tube = { diameter = { s = [0, 1], values = [0.04, 0.01] }, thickness = 0.01 }"),
            "rod.section.tube.thickness",
            FaultKind::Value,
            "at s = ",
        ),
        (
            shaped("circle = { diameter = 0.01 }, rigid = ['u1', 'u2']"),
            "rod.section.rigid",
            FaultKind::Value,
            "at most one",
        ),
        (
            rod("section = { bending = ['rigid', 'rigid'], torsion = 1 }"),
            "rod.section.bending",
            FaultKind::Value,
            "at most one",
        ),
        (
            rod("section = { bending = ['stiff', 1], torsion = 1 }"),
            "rod.section.bending[0]",
            FaultKind::Value,
            "rigid",
        ),
        (
            rest("helix = { radius = 0.02, pitch = 0.05, turns = 4 }"),
            "rod.length",
            FaultKind::Conflict,
            "0.5409",
        ),
        (
            rest("helix = { radius = 0.02, pitch = -0.05, left = true }"),
            "rod.rest.helix.pitch",
            FaultKind::Conflict,
            "left",
        ),
        (
            rest("helix = { radius = 0, pitch = 0.05 }"),
            "rod.rest.helix.radius",
            FaultKind::Value,
            "> 0",
        ),
        (
            rest("arc = { angle = 0.0 }"),
            "rod.rest.arc.angle",
            FaultKind::Value,
            "straight",
        ),
        (
            rest("arc = { angle = 1.0 }, twist = 1.0"),
            "rod.rest.twist",
            FaultKind::Conflict,
            "keep one",
        ),
        (
            clamp("tangent = [0, 0, 0]"),
            "clamp.tangent",
            FaultKind::Value,
            "not all 0",
        ),
        (
            clamp("normal = [0, 0, 1]"),
            "clamp.tangent",
            FaultKind::Missing,
            "tangent =",
        ),
        (
            clamp("tangent = [0, 0, 1]\nnormal = [0, 0, -2]"),
            "clamp.normal",
            FaultKind::Value,
            "not along tangent",
        ),
        (
            clamp("quaternion = [1, 0, 0, 0]\ntangent = [0, 0, 1]"),
            "clamp.tangent",
            FaultKind::Conflict,
            "keep one",
        ),
    ];
    for (text, field, kind, words) in cases {
        let faults = Scene::parse(&text).expect_err(&text);
        let [fault] = faults.as_slice() else {
            panic!("{faults}\n{text}")
        };
        assert_eq!(
            (fault.field.as_str(), fault.kind),
            (field, kind),
            "{fault}\n{text}"
        );
        assert!(fault.to_string().contains(words), "{fault}\n{text}");
    }
}

/// A rod that tapers and jumps, with a point mass at its end that moves across, under a pull.
fn tapered(pull: f64, duration: f64) -> String {
    format!(
        "[rod]\nmodel = 'cosserat'\nlength = 1.0\nmaterial = {{ E = 1e12, nu = 0.3, density = 1.6e4 }}\n\
         section = {{ circle = {{ diameter = {{ s = [0.0, 0.4, 0.4, 1.0], values = [3.4e-3, 3.4e-3, 2.8e-3, 1.7e-3] }} }} }}\n\
         [body]\nmass = 1.5\njoint = 'ball'\n[loads]\ndead = [0.0, 0.0, {pull}]\n\
         [start]\nsettled = true\nvelocity = [1e-3, 0.0, 0.0]\n[run]\nduration = {duration}\ntolerance = 1e-6\nsamples = 3\n"
    )
}

/// Deflection of that rod by a unit at its end, and int rho w^2 ds for a deflection of 1. From B w'' = 1 - s - P
/// (w(1) - w) by differences of second order: the part by the unit, and that by w(1), which makes w'(0) = 0.
fn deflected(pull: f64) -> [f64; 2] {
    const PARTS: usize = 10_000;
    let h = 1.0 / PARTS as f64;
    let diameter = |s: f64| {
        if s < 0.4 {
            3.4e-3
        } else {
            2.8e-3 - 1.1e-3 * (s - 0.4) / 0.6
        }
    };
    let about = |s: f64, f: &dyn Fn(f64) -> f64| 0.5 * (f(s - 1e-9) + f(s + 1e-9));
    let give = |s: f64| 64.0 / (1e12 * PI * diameter(s).powi(4));
    let rho = |s: f64| 1.6e4 * PI * diameter(s).powi(2) / 4.0;
    // w_(i-1) - (2 + h^2 P/B) w_i + w_(i+1) = h^2 load/B between w(0) = 0 and a given w(1), by elimination.
    let solved = |load: &dyn Fn(f64) -> f64, end: f64| {
        let mut eliminated = vec![[0.0, 0.0]; PARTS];
        for i in 1..PARTS {
            let s = i as f64 * h;
            let c = h * h * about(s, &give);
            let [by, right] = eliminated[i - 1];
            let pivot = -(2.0 + pull * c) - by;
            eliminated[i] = [1.0 / pivot, (c * load(s) - right) / pivot];
        }
        let mut w = vec![0.0; PARTS + 1];
        w[PARTS] = end;
        for i in (1..PARTS).rev() {
            w[i] = eliminated[i][1] - eliminated[i][0] * w[i + 1];
        }
        w
    };
    let parts = [solved(&|s| 1.0 - s, 0.0), solved(&|_| -pull, 1.0)];
    // w(h) = h^2/2 w''(0) where w'(0) = 0: B w''(0) = 1 - P w(1).
    let start = 0.5 * h * h * give(0.0);
    let end = (start - parts[0][1]) / (parts[1][1] + start * pull);
    let w = |i: usize| parts[0][i] / end + parts[1][i];
    let felt = (1..PARTS).map(|i| h * about(i as f64 * h, &rho) * w(i).powi(2));
    [end, felt.sum::<f64>() + 0.5 * h * rho(1.0)]
}

/// Catches a mass of a light rod that is spread evenly where its shape varies, on slack rods and on taut ones: small
/// motions have the stiffness and the mass of the static deflection.
#[test]
fn the_mass_of_a_tapered_rod_is_followed_to_first_order() {
    for pull in [0.0, 300.0] {
        let [give, felt] = deflected(pull);
        let rate = |mass: f64| (1.0 / (give * mass)).sqrt();
        let duration = 2.0 / rate(1.5);
        let moved = |mass: f64| 1e-3 / rate(mass) * (rate(mass) * duration).sin();
        let prepared = Prepared::new(&parse(&tapered(pull, duration)));
        let prepared = prepared.unwrap_or_else(|why| panic!("{why}"));
        let mut tables: Vec<Table> = Vec::new();
        let record = run(&prepared, Fields::default(), &mut tables, &mut Silent)
            .unwrap_or_else(|why| panic!("{why}"));
        assert_eq!(record.reason(), None);
        let off = |wanted: f64| (tables[0].reals("x")[2] / wanted - 1.0).abs();
        assert!(
            off(moved(1.5 + felt)) < 3e-4,
            "{pull}: {} {felt}",
            off(moved(1.5 + felt))
        );
        assert!(off(moved(1.5)) > 3e-3, "{pull}: {}", off(moved(1.5)));
    }
}
