//! Tendons through rods at rest, against the loads of Rucker and Webster (tests/data/tendons.json) and closed forms.

use crate::support::{assert_close, json, list, number};
use nalgebra::Vector3;
use snaprod::scene::Scene;
use snaprod::study::{EquilibriumRecord, Silent, branch, equilibrium};

const LENGTH: f64 = 0.242;
const BENDING: f64 = 0.0042223005264247;

fn text(tendons: &[String], end: &str) -> String {
    let tendons: Vec<String> = tendons
        .iter()
        .map(|t| format!("[[rod.tendon]]\n{t}"))
        .collect();
    format!(
        "units = \"si\"\n[rod]\nmodel = \"cosserat\"\nlength = {LENGTH}\n\
         section = {{ bending = [{BENDING}, {BENDING}], torsion = 0.0032169908772759 }}\n{}\n[end]\n{end}\n",
        tendons.join("\n")
    )
}

fn solved(text: &str) -> EquilibriumRecord {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    equilibrium(&scene).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

fn each(found: &EquilibriumRecord) -> &snaprod::study::tendons::TendonsRecord {
    found.tendons.as_ref().expect("tendons")
}

/// Catches a wrong pull of a tendon, a wrong derivative of it, a wrong route, or a wrong split between rod and tendons:
/// the reference has distributed loads and an anchor in place of a stored energy.
#[test]
fn rods_bend_as_under_the_loads_of_their_tendons() {
    let cases = json("tendons.json");
    let cases = cases.as_array().expect("cases");
    assert_eq!(cases.len(), 3);
    for case in cases {
        let name = case["name"].as_str().expect("a name");
        let offset = case["offset"].as_str().expect("an offset");
        let tendon = format!("offset = {offset}\ntension = {}", number(case, "tension"));
        let found = solved(&text(&[tendon], &format!("force = {}", case["tip"])));
        let end = Vector3::from_row_slice(&list(&case["end"]));
        assert!(
            (found.found.end.position - end).norm() < 1e-10 * LENGTH,
            "{name}: end"
        );
        let couple = Vector3::from_row_slice(&list(&case["rod_couple"]));
        assert!(
            (each(&found).base[0] - couple).norm() < 1e-12,
            "{name}: couple of the rod"
        );
        // The totals balance the dead force alone.
        let tip = Vector3::from_row_slice(&list(&case["tip"]));
        let (_, force) = snaprod::math::se3::halves(&found.found.base);
        assert!((force - tip).norm() < 1e-13, "{name}: total force");
        assert_eq!(found.found.index, 0, "{name}");
    }
}

/// Catches a tendon that goes on beyond its anchor, a jump of the totals there, and one of the rod alone that is not
/// the arm times the tension.
#[test]
fn a_tendon_ends_at_its_anchor() {
    let (tension, arm, to) = (5.0, 0.008, 0.6 * LENGTH);
    let found = solved(&text(
        &[format!(
            "offset = [{arm}, 0.0]\ntension = {tension}\nto = {to}"
        )],
        "",
    ));
    // Closed form: an arc of curvature T d/B to the anchor, then a straight line.
    let bent = tension * arm / BENDING;
    let (sin, cos) = (bent * to).sin_cos();
    let beyond = LENGTH - to;
    let end = Vector3::new(
        (1.0 - cos) / bent + beyond * sin,
        0.0,
        sin / bent + beyond * cos,
    );
    assert!((found.found.end.position - end).norm() < 1e-11 * LENGTH);
    let tendons = each(&found);
    assert_close(
        tendons.each[0].length,
        to * (1.0 - arm * bent),
        1e-12,
        1e-3,
        "length",
    );
    let both = found.sections.iter().zip(&tendons.along);
    for (section, rod) in both.filter(|(section, _)| (section.s - to).abs() > 1e-9) {
        assert!(
            section.couple.norm() + section.force.norm() < 1e-12,
            "totals at {}",
            section.s
        );
        let couple = if section.s < to { tension * arm } else { 0.0 };
        assert!(
            (rod[1] - couple).abs() < 1e-12,
            "couple of the rod at {}",
            section.s
        );
    }
}

/// Catches a tension that is not the multiplier of the length, a slack tendon that pushes, and a potential that is not
/// that of the tensions: dPi/dT = l.
#[test]
fn given_lengths_have_their_tensions() {
    let of = |pull: &str| solved(&text(&[format!("offset = [0.008, 0.0]\n{pull}")], ""));
    let found = of("length = 0.23");
    let tension = BENDING * (1.0 - 0.23 / LENGTH) / (0.008 * 0.008);
    let tendon = each(&found).each[0];
    assert_close(tendon.tension, tension, 1e-11, 1.0, "tension");
    assert!(!tendon.slack && found.found.index == 0);
    let found = of("length = 0.25");
    let tendon = each(&found).each[0];
    assert!(tendon.slack && tendon.tension == 0.0, "{tendon:?}");
    assert!((found.found.end.position - Vector3::new(0.0, 0.0, LENGTH)).norm() < 1e-14);

    let tip = Vector3::new(0.05, 0.01, -0.02);
    let potential = |tension: f64| {
        let tendon = format!(
            "offset = {{ helix = {{ distance = 0.008, turns = 0.7 }} }}\ntension = {tension}"
        );
        let found = solved(&text(&[tendon], "force = [0.05, 0.01, -0.02]"));
        let end = &found.found.end;
        let pulled = each(&found);
        (
            end.energy + pulled.potential() - tip.dot(&end.position),
            pulled.each[0].length,
        )
    };
    let by = 1e-3;
    let slope = (potential(4.0 + by).0 - potential(4.0 - by).0) / (2.0 * by);
    assert_close(slope, potential(4.0).1, 1e-8, 1.0, "virtual work");
}

/// Catches a tension that a branch cannot vary, or a branch that ends at another state than the equilibrium.
#[test]
fn branches_go_along_a_tension() {
    let tendons = [
        "offset = [0.008, 0.0]\ntension = 0.0",
        "offset = [0.0, 0.006]\ntension = 1.0",
    ];
    let tendons = tendons.map(str::to_owned);
    let varied =
        "force = [0.0, 0.02, 0.0]\n[continue]\nparameter = \"rod.tendon.0.tension\"\nto = 4.0";
    let scene = Scene::parse(&text(&tendons, varied)).expect("a scene");
    let found = branch(&scene, &mut Silent).expect("a branch");
    let table = &found.branches.points;
    let at = |name: &str| *table.reals(name).last().expect("points");
    let pulled = tendons.map(|t| t.replace("tension = 0.0", "tension = 4.0"));
    let direct = solved(&text(&pulled, "force = [0.0, 0.02, 0.0]"));
    let place = direct.found.end.position;
    for (name, want) in [("x", place.x), ("y", place.y), ("z", place.z)] {
        assert_close(at(name), want, 1e-9, LENGTH, name);
    }
    assert_close(at("energy"), direct.found.end.energy, 1e-9, 1e-3, "energy");
}

/// Catches the acceptance of a tendon with negative tension, an anchor beyond the rod's end, or a faulty route.
#[test]
fn impossible_tendons_are_refused() {
    for (tendon, field, words) in [
        (
            "offset = [0.01, 0.0]\ntension = -1.0",
            "rod.tendon[0].tension",
            ">= 0",
        ),
        (
            "offset = [0.01, 0.0]\ntension = 1.0\nto = 0.3",
            "rod.tendon[0].to",
            "length of the rod",
        ),
        ("offset = [0.01, 0.0]", "rod.tendon[0].tension", "length"),
        (
            "offset = [0.01, 0.0]\ntension = 1.0\nlength = 0.2",
            "rod.tendon[0].length",
            "left out",
        ),
        (
            "offset = { table = [[0.0, 0.01, 0.0], [0.2, 0.0, 0.0], [0.1, 0.0, 0.0]] }\ntension = 1.0",
            "rod.tendon[0].offset.table",
            "growing",
        ),
    ] {
        let faults = Scene::parse(&text(&[tendon.to_owned()], "")).expect_err(tendon);
        let told = faults.to_string();
        assert!(
            told.contains(field) && told.contains(words),
            "{tendon}: {told}"
        );
    }
    // Far outside of the section is allowed.
    solved(&text(
        &["offset = [0.1, 0.0]\ntension = 0.01".to_owned()],
        "",
    ));
}
