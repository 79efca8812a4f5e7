//! Scenes as the program takes them: files, standard input, several at once, with overrides.

use crate::program::Place;
use serde_json::Value;
use std::fs;

fn bundled(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Catches an override that hides the other faults of a scene, and a fault that only the failed override makes.
#[test]
fn faults_of_overrides_come_beside_all_others() {
    let place = Place::new("overrides");
    let answer = place.run(&[
        "check",
        &bundled("snap"),
        "--set=body.mass=-2",
        "--set=run.duration=abc",
        "--set=loads.gravity=0,-9.81",
    ]);
    let refusal = answer.refusal();
    assert!(refusal.starts_with("error: 3 faults"), "{refusal}");
    for part in [
        "body.mass = -2: must be",
        "run.duration=abc: cannot be set",
        "a list needs its brackets: loads.gravity=[0,-9.81]",
    ] {
        assert!(refusal.contains(part), "{refusal}");
    }
    let text = place.run(&["new", "strip"]).text().replace("duration", "#");
    place.write("strip.toml", &text);
    let answer = place.run(&["check", "strip.toml", "--set=run.duration=abc"]);
    assert!(
        answer.refusal().starts_with("error: one fault"),
        "{answer:?}"
    );
}

/// Catches a scene on standard input that is read twice, or that another command takes for a file.
#[test]
fn a_scene_comes_from_standard_input() {
    let place = Place::new("stdin");
    let text = fs::read_to_string(bundled("snap")).expect("a scene");
    let answer = place.run_with_input(&["run", "-", "--html"], &text);
    assert!(answer.text().contains("written to out/stdin"));
    assert!(
        place
            .read("out/stdin/run.html")
            .contains("bending_stiffness")
    );
    let asked = [
        "sweep",
        "-",
        "--vary",
        "body.mass=1:2:2",
        "-q",
        "-o",
        "swept",
    ];
    let swept = place.run_with_input(&asked, &text);
    assert_eq!((swept.code, swept.stdout.as_str()), (0, ""), "{swept:?}");
    assert!(place.files("swept").contains(&"sweep.csv".to_owned()));
    let answer = place.run_with_input(&["check", "-"], "[rod]\nlenght = 1.0\n");
    assert!(
        answer
            .refusal()
            .contains("\nstandard input:2:1: rod.lenght"),
        "{answer:?}"
    );
}

/// Catches a check that ends at the first bad scene.
#[test]
fn several_scenes_are_checked() {
    let place = Place::new("several");
    place.write("bad.toml", "[rod]\n");
    let (snap, peg) = (bundled("snap"), bundled("peg"));
    let answer = place.run(&["check", &snap, "bad.toml", &peg]);
    assert_eq!(answer.code, 2);
    assert_eq!(answer.stdout.matches("no faults").count(), 2, "{answer:?}");
    assert!(answer.stderr.contains("\nbad.toml:"), "{answer:?}");
    let lines = place.run(&["check", &snap, "bad.toml", "--json"]).stdout;
    let valid: Vec<bool> = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("one object a line"))
        .map(|report| report["valid"] == true)
        .collect();
    assert_eq!(valid, [true, false]);
}
