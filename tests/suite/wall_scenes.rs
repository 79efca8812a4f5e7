//! Scenes of tubes and membranes: printed words, written files, refusals.

use crate::program::Place;
use serde_json::Value;
use snaprod::scene::Scene;
use snaprod::study::wall;

const RING: &str = "[tube]\nradius = 1.0\nstiffness = 1.0\n";
const DISC: &str = "[membrane]\nshape = \"disc\"\nradius = 4.0\nthickness = 0.05\nlaw = { mooney = [24.0, 1.5] }\n";

fn scene(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

#[track_caller]
fn close(value: &Value, reference: f64, tolerance: f64) {
    let found = value.as_f64().expect("a number");
    assert!(
        (found / reference - 1.0).abs() <= tolerance,
        "{found} is not {reference}"
    );
}

/// Catches a record in other units than the scene's, a missing key, and figures or tables that are not written.
#[test]
fn sections_of_tubes() {
    let place = Place::new("tubes");
    place.write(
        "ring.toml",
        &format!("{RING}[fluid]\ndensity = 1.0\n[outside]\npressure = 5.0\n"),
    );
    let found = place
        .run(&["equilibrium", "ring.toml", "--json", "--out", "out"])
        .json(0);
    close(&found["area"], 0.31700787634598865, 1e-12);
    close(&found["energy"], 8.191305150148109, 1e-12);
    close(&found["curvature_tip"], 3.762116154313993, 1e-12);
    close(&found["curvature_trough"], -0.9364223618728076, 1e-12);
    close(&found["axes"][0], 1.371622331196985, 1e-12);
    close(&found["axes"][1], 0.04395921932349906, 1e-11);
    close(&found["wave_speed"], 1.6146111587780363_f64.sqrt(), 1e-10);
    assert_eq!(found["contact"], "none");
    assert!(
        found["shape"]
            .as_array()
            .is_some_and(|points| points.len() > 100)
    );
    assert_eq!(
        place.files("out"),
        ["equilibrium.json", "equilibrium.svg", "shape.csv"]
    );
    // A tube of rubber: pressure by Kp = D/R^3, lengths by R.
    let rubber =
        "[tube]\nradius = 5.425e-3\nthickness = 0.85e-3\nmaterial = { E = 1.5e6, nu = 0.5 }\n";
    let at = |outside: f64| {
        let text = format!("{rubber}[outside]\npressure = {outside}\n");
        wall::equilibrium(&scene(&text)).expect("a section").summary
    };
    let (before, after) = (
        at(1923.2137437950857 * (1.0 - 1e-9)),
        at(1923.2137437950857 * (1.0 + 1e-9)),
    );
    assert!(before["area"] == 1.0 && after["area"].as_f64().is_some_and(|area| area < 1.0));
    assert!(before["wave_speed"].is_null());
    let (open, touching) = (at(3363.0), at(3364.0));
    assert_eq!(
        (&open["contact"], &touching["contact"]),
        (&"none".into(), &"point".into())
    );
    let line = at(8000.0);
    assert_eq!(line["contact"], "line");
    close(
        &line["curvature_tip"],
        1.0 / 5.425e-3
            * 4.5862854616302275
            * (8000.0 / 641.0712479316953 / 10.336032958617045_f64).cbrt(),
        1e-11,
    );
    // Stretched along its axis: Table 1 of the report.
    let stretched = "[tube]\nradius = 7.5e-3\nthickness = 1e-3\nmaterial = { E = 1.5e6 }\nstretch = 1.2482758620689656\n";
    let tube = match scene(&format!("{stretched}area = 0.5\n")).wall() {
        Some(snaprod::scene::WallScene::Tube(tube)) => tube.wall.tube().expect("a tube"),
        other => panic!("{other:?}"),
    };
    close(&tube.radius().into(), 6.712835071423443e-3, 1e-12);
    close(&tube.pressure_scale().into(), 395.0617283950617, 1e-12);
}

/// Catches special points that are missing, misplaced or without a label, and a branch that ends short in silence.
#[test]
fn branches_of_tubes_and_membranes() {
    let place = Place::new("wall-branches");
    let follow = |parameter: &str, from: f64, to: f64| {
        format!(
            "[continue]\nparameter = \"{parameter}\"\nfrom = {from:?}\nto = {to:?}\npoints = 21\n"
        )
    };
    place.write(
        "ring.toml",
        &format!("{RING}{}", follow("outside.pressure", 1.0, 12.0)),
    );
    let found = place
        .run(&["branch", "ring.toml", "--json", "--out", "out"])
        .json(0);
    let specials = found["special_points"].as_array().expect("special points");
    let labels: Vec<&str> = specials
        .iter()
        .filter_map(|at| at["label"].as_str())
        .collect();
    assert_eq!(labels, ["buckling", "touch", "line"]);
    for (at, reference) in specials
        .iter()
        .zip([3.0, 5.246886962531474, 10.336032958617045])
    {
        close(&at["parameter"], reference, 1e-12);
    }
    assert_eq!(found["points"], 24);
    let files = [
        "branch.csv",
        "branch.svg",
        "shapes.svg",
        "special_points.json",
    ];
    assert_eq!(place.files("out"), files);
    assert_eq!(place.read("out/branch.csv").lines().count(), 25);
    // By the area, downwards.
    let text = format!("{RING}{}", follow("tube.area", 0.9, 0.1));
    let record = wall::branch(&scene(&text)).expect("a branch");
    let labels: Vec<&str> = record.specials.iter().map(|at| at.label.as_str()).collect();
    assert_eq!(labels, ["touch", "line"]);
    // A branch without further sections names the reason.
    let text = format!("{RING}mode = 3\n{}", follow("outside.pressure", 9.0, 30.0));
    let record = wall::branch(&scene(&text)).expect("a branch");
    let stop = record.stop.clone().expect("an early end");
    assert!(
        stop.contains("21.65") && record.summary()["complete"] == false,
        "{stop}"
    );
    // Membranes: limit points under pressure, and none of the disc of the thesis.
    let sphere = "[membrane]\nshape = \"sphere\"\nradius = 1.0\nthickness = 1.0\nlaw = { neo_hookean = 1.0 }\n";
    let text = format!("{sphere}{}", follow("membrane.stretch", 1.0, 3.0));
    let record = wall::branch(&scene(&text)).expect("a branch");
    assert_eq!(
        (record.specials.len(), record.specials[0].label.as_str()),
        (1, "LP1")
    );
    close(
        &record.specials[0].parameter.into(),
        7f64.powf(1.0 / 6.0),
        1e-12,
    );
    close(&record.specials[0].pressure.into(), 2.478925804798, 1e-12);
    let text = format!("{DISC}{}", follow("membrane.stretch", 1.0, 8.0));
    assert!(
        wall::branch(&scene(&text))
            .expect("a branch")
            .specials
            .is_empty()
    );
}

/// Catches a state that is not the one of the load, and a stability that is not that of the load.
#[test]
fn inflated_membranes() {
    let at = |rest: &str| {
        wall::equilibrium(&scene(&format!("{DISC}{rest}")))
            .expect("a state")
            .summary
    };
    let by_pressure = at("[loads]\npressure = 1.65\n");
    close(&by_pressure["height"], 21.536146750215924, 1e-10);
    close(&by_pressure["pressure_number"], 5.5, 1e-12);
    close(&by_pressure["edge_stretch"], 9.64769265381, 1e-9);
    assert_eq!(by_pressure["stable"], true);
    close(
        &at("[start]\nstretch = 3.00285523733\n")["height"],
        6.8,
        1e-10,
    );
    let sphere = "[membrane]\nshape = \"sphere\"\nradius = 1.0\nthickness = 1.0\nlaw = { neo_hookean = 1.0 }\n";
    let at = |rest: &str| {
        wall::equilibrium(&scene(&format!("{sphere}{rest}")))
            .expect("a state")
            .summary
    };
    assert_eq!(at("[start]\nstretch = 1.3\n")["stable"], true);
    assert_eq!(at("[start]\nstretch = 1.5\n")["stable"], false);
    let gas = at("[gas]\ncontents = 30.0\nvolume = 8.0\noutside = 1.0\n");
    close(&gas["contents"], 30.0, 1e-12);
}

/// Catches bad input that is accepted, or refused without the name of its field and what is allowed.
#[test]
fn bad_walls_are_refused_by_name() {
    let refused = |text: &str, words: &[&str]| {
        let message = match Scene::parse(text) {
            Err(faults) => faults.to_string(),
            Ok(scene) => wall::equilibrium(&scene).expect_err(text).to_string(),
        };
        for word in words {
            assert!(message.contains(word), "{word:?} in:\n{message}\n{text}");
        }
    };
    let ring = |rest: &str| format!("{RING}{rest}");
    refused(&ring("area = 0.0\n"), &["tube.area", "> 0"]);
    refused(&ring("area = -1\n"), &["tube.area", "> 0"]);
    refused(&ring("area = nan\n"), &["tube.area", "> 0"]);
    refused(&ring("area = 1.1\n"), &["at most 1"]);
    refused(
        &ring("area = 0.5\n[outside]\npressure = 4.0\n"),
        &["tube.area", "outside.pressure"],
    );
    refused(&ring(""), &["tube.area", "[outside] pressure"]);
    refused(
        &ring("mode = 1\narea = 0.5\n"),
        &["tube.mode", "from 2 to 12"],
    );
    refused(
        &ring("mode = 3\n[outside]\npressure = 25.0\n"),
        &["21.65", "mode = 2"],
    );
    refused(
        &ring("thickness = 0.6\narea = 0.5\n"),
        &["tube.thickness", "half the radius"],
    );
    refused(
        &ring("law = \"extensible\"\narea = 0.5\n"),
        &["tube.thickness"],
    );
    refused(
        &ring("law = { power = [-1.0, 2.0] }\narea = 0.5\n"),
        &["alpha^m - alpha^n"],
    );
    refused(
        &ring("law = \"thin\"\narea = 0.5\n"),
        &["tube.law", "neo-hookean"],
    );
    refused(
        &ring("area = 0.5\n[run]\nduration = 1.0\n"),
        &["tube.area", "tube.length"],
    );
    refused("[tube]\nradius = 1.0\narea = 0.5\n", &["tube.material"]);
    refused(
        &format!("{DISC}[start]\nstretch = 0.9\n"),
        &["start.stretch", ">= 1"],
    );
    refused(
        &format!("{DISC}[loads]\npressure = -1.0\n"),
        &["loads.pressure", ">= 0"],
    );
    refused(
        &format!("{DISC}[gas]\ncontents = 1.0\noutside = -1.0\n"),
        &["gas.outside", ">= 0"],
    );
    refused(DISC, &["[loads] pressure", "[gas] contents"]);
    refused(
        &format!("{DISC}[start]\nstretch = 2.0\n[loads]\npressure = 1.0\n"),
        &["2 are given"],
    );
    let neo_hookean = DISC.replace("mooney = [24.0, 1.5]", "neo_hookean = 24.0");
    refused(
        &format!("{neo_hookean}[loads]\npressure = 2.0\n"),
        &["1.127"],
    );
    refused(&DISC.replace("24.0", "-24.0"), &["membrane.law"]);
    let place = Place::new("walls-refused");
    place.write("ring.toml", &ring("area = 0.5\n"));
    let refusal = place.run(&["run", "ring.toml"]);
    assert!(
        refusal.refusal().contains("snaprod equilibrium"),
        "{refusal:?}"
    );
    let refusal = place.run(&["branch", "ring.toml"]);
    assert!(refusal.refusal().contains("[continue]"), "{refusal:?}");
}
