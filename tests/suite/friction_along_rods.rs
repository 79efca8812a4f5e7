//! Friction and memory of rods with variable or anisotropic sections: comparison with the reversed rod, and with the
//! plane.

use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table};

/// Final values of the given columns of a run.
fn ended<const N: usize>(text: &str, names: [&str; N]) -> [f64; N] {
    let scene = Scene::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap();
    run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    names.map(|name| *tables[0].reals(name).last().unwrap())
}

/// A planar rod of EI = 1.3 in the strongly thinning range, released bent under its weight, and the same rod in space
/// about its weak axis. Catches a thinning onset by the stiffness of the wrong axis, which is 130.
#[test]
fn a_power_of_the_rate_about_the_weak_axis_is_that_of_the_plane() {
    let rest = "[run]\nduration = 0.3\ntolerance = 1e-9\nsamples = 2\n[body]\nmass = 1.0\n";
    let damping = "length = 0.9\ndamping = { proportional = 0.1, exponent = 0.5, rate = 0.7 }\n";
    let heavy = "mass = 0.2\ninertia = \"full\"\n";
    for (own, rotary, bound) in [
        ("", "", 1e-6),
        (heavy, "section_inertia = [1e-9, 1e-9, 2e-9]\n", 1e-6),
    ] {
        let plane = format!(
            "[rod]\nmodel = \"elastica\"\nbending_stiffness = 1.3\n{damping}{own}[loads]\ngravity = [0.0, -0.8]\n\
             [start]\ncurvature = [0.9, -0.9]\n{rest}"
        );
        let space = format!(
            "[rod]\nmodel = \"cosserat\"\nsection = {{ bending = [1.3, 130.0], torsion = 0.8 }}\n{damping}{own}{rotary}\
             [loads]\ngravity = [0.0, 0.8, 0.0]\n[start]\nstrain = {{ u1 = [0.9, -0.9] }}\n{rest}joint = \"ball\"\n"
        );
        let [x, y, lost] = ended(&plane, ["x", "y", "dissipated"]);
        let [z, across, wasted] = ended(&space, ["z", "y", "dissipated"]);
        for (a, b) in [(x, z), (y, -across), (lost, wasted)] {
            assert!((a - b).abs() < bound, "{own}: {a} {b}");
        }
        assert!(lost > 1e-2, "friction is to matter: {lost}");
    }
}

/// A tapered rod with power-law friction moves as the reversed rod, which is thin at the base. Catches an onset by the
/// stiffness of the section at the base.
#[test]
fn a_power_of_the_rate_does_not_know_the_base() {
    let scene = |ends: &str, bending: [&str; 2]| {
        let [first, second] = bending;
        format!(
            "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nmass = 0.15\ninertia = \"full\"\nnodes = 8\n\
             section_inertia = [1e-3, 1e-3, 2e-3]\ndamping = {{ proportional = 0.05, exponent = 0.5, rate = 0.3 }}\n\
             section = {{ bending = [{{ polynomial = {first} }}, {{ polynomial = {second} }}], torsion = 0.9 }}\n{ends}\
             [[body]]\nname = \"A\"\nmass = 1.0\ninertia = [0.05, 0.07, 0.04]\n[start]\nrest = \"straight\"\n\
             [loads]\ngravity = [3.0, 1.0, 0.0]\n[run]\nduration = 0.2\ntolerance = 1e-7\nsamples = 2\n"
        )
    };
    let there = scene(
        "from = {}\nto = { body = \"A\" }\n",
        ["[3.0, -2.6]", "[2.0, -1.0]"],
    );
    let turned = "quaternion = [0.0, 1.0, 0.0, 0.0]";
    let ends = format!("from = {{ body = \"A\", {turned} }}\nto = {{ {turned} }}\n");
    let back = scene(&ends, ["[0.4, 2.6]", "[1.0, 1.0]"]);
    let [there, back] = [there, back].map(|text| ended(&text, ["A.x", "A.y", "dissipated"]));
    for (a, b) in there.iter().zip(back) {
        assert!((a - b).abs() < 1e-6 * a.abs(), "{there:?} {back:?}");
    }
}

/// A branch in proportion to the section requires a constant stiffness along the rod, but not constant rest strains.
/// Catches a curved rod called variable, a modulus other than the section's, and an accepted tapered rod.
#[test]
fn branches_are_in_proportion_to_rods_that_are_bent_at_rest() {
    const FULL: &str = "stiffness = [[1.0, 0.1, 0.2, 0.5, 0.0, 0.3], [0.1, 1.6, -0.1, 0.0, 0.2, 0.4], [0.2, -0.1, 0.7, 0.1, 0.3, -0.6], \
                        [0.5, 0.0, 0.1, 50.0, 2.0, 1.0], [0.0, 0.2, 0.3, 2.0, 60.0, 0.5], [0.3, 0.4, -0.6, 1.0, 0.5, 90.0]]";
    let of = |section: &str| {
        let text = format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 0.9\ndamping = {{ proportional = 0.1 }}\n\
             relaxation = [{{ stiffness = {{ proportional = 0.5 }}, time = 0.3 }}]\n[rod.section]\n{section}\n\
             [rod.rest]\ncurvature = [0.5, {{ polynomial = [0.2, -0.6] }}]\n[body]\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n\
             [start]\nrest = \"straight\"\n[run]\nduration = 0.1\n"
        );
        let scene = Scene::parse(&text).map_err(|faults| faults.to_string())?;
        scene.viscoelastic().map_err(|why| why.to_string())
    };
    for (section, bending) in [
        (FULL, [1.0, 1.6, 0.1]),
        ("bending = [1.2, 2.0]\ntorsion = 0.7", [1.2, 2.0, 0.0]),
    ] {
        let modulus = of(section).unwrap().branches[0].modulus;
        for (at, wanted) in [(0, 0), (1, 1), (0, 1)].into_iter().zip(bending) {
            assert!((modulus[at] - 0.5 * wanted).abs() < 1e-14, "{modulus}");
        }
    }
    let why = of("bending = [1.2, { polynomial = [2.0, -1.0] }]\ntorsion = 0.7").unwrap_err();
    assert!(why.contains("the stiffness of the section varies"), "{why}");
}
