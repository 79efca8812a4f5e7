//! The committed figures are those that the program draws.

use crate::program::{Place, parts};
use snaprod::scene::Scene;
use snaprod::study::{Hooks, Silent, Table, run};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn sheets(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_snaprod"))
        .arg("sheets")
        .args(arguments)
        .output()
        .unwrap()
}

/// A directory of this test's own.
fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn sheets_are_drawn_as_committed() {
    let out = directory("sheets");
    let made = sheets(&["--json", "--out", out.to_str().unwrap()]);
    assert!(made.status.success(), "{made:?}");
    let report: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    let files = report["files"].as_array().unwrap();
    assert_eq!(files.len(), 5);
    for file in files {
        let name = file.as_str().unwrap();
        let drawn = std::fs::read_to_string(out.join(name)).unwrap();
        assert!(drawn.len() < 1_000_000, "{name}: {} bytes", drawn.len());
        let committed = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("figures")
            .join(name);
        let different = differences(&drawn, &std::fs::read_to_string(&committed).unwrap());
        // Where a coordinate is rounded, another machine may keep a point more.
        assert!(
            different * 500 <= drawn.lines().count(),
            "{name} has changed in {different} lines: look at it, then run `snaprod sheets --out figures`"
        );
    }
}

/// How many lines of two figures differ by more than 0.3 pixels in a coordinate (figures are drawn ten times enlarged) or in
/// anything else: functions of another machine's library are an ulp apart.
fn differences(a: &str, b: &str) -> usize {
    let alike = |a: &str, b: &str| {
        let ((text, numbers), (other, values)) = (parts(a), parts(b));
        let near = |(x, y): (&String, &String)| {
            let [x, y]: [f64; 2] = [x, y].map(|n| n.parse().unwrap());
            (x - y).abs() <= 3.0
        };
        text == other && numbers.iter().zip(&values).all(near)
    };
    let unlike = a.lines().zip(b.lines()).filter(|(a, b)| !alike(a, b));
    unlike.count() + a.lines().count().abs_diff(b.lines().count())
}

#[test]
fn many_modes_fit() {
    let out = directory("modes");
    let made = sheets(&["--modes", "3,0,2,1", "--out", out.to_str().unwrap()]);
    assert!(made.status.success(), "{made:?}");
    for line in String::from_utf8(made.stdout).unwrap().lines() {
        let size = std::fs::metadata(line).unwrap().len();
        assert!(size < 1_000_000, "{line}: {size} bytes");
    }
}

#[test]
fn bad_modes_are_named() {
    for bad in ["4", "-1", "x", "0,,1"] {
        let made = sheets(&["--modes", bad]);
        assert_eq!(made.status.code(), Some(2), "{bad}");
        let why = String::from_utf8(made.stderr).unwrap();
        assert!(
            why.contains("--modes") && why.contains("0, 1, 2, 3"),
            "{why}"
        );
    }
}

/// A caller who draws.
struct Draws;

impl Hooks for Draws {
    fn pictures(&mut self) -> usize {
        1
    }
}

/// Catches figures that are drawn from samples (of a mass that is thrown back ten times between two of them), that leave the motion, or go back in
/// time; and runs that nobody draws but that pay for it.
#[test]
fn motions_are_drawn_closer_than_their_samples() {
    let path = format!("{}/scenes/bounce.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains("samples = 400"));
    let scene = Scene::parse(&text.replace("samples = 400", "samples = 5")).unwrap();
    let prepared = run::Prepared::new(&scene).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
    assert_eq!(record.branches[0].track.len(), 5);
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Draws).unwrap();
    let track = &record.branches[0].track;
    assert_eq!(tables.iter().map(Table::rows).collect::<Vec<_>>(), [5, 5]);
    assert!(
        track
            .windows(2)
            .all(|two| two[0].moment.t < two[1].moment.t)
    );
    let apart = |two: &[run::Frame]| {
        let [[a, b], [c, d]] = [two[0].moment.place(), two[1].moment.place()];
        (a - c).hypot(b - d)
    };
    assert!(
        track.windows(2).all(|two| apart(two) < 0.05),
        "a way of a twentieth of the rod"
    );
    let some: Vec<&run::Frame> = track.iter().step_by(track.len() / 40).collect();
    let times: Vec<f64> = some.iter().map(|frame| frame.moment.t).collect();
    let exact = run::samples(&prepared, &times, &mut Silent).unwrap();
    for (k, frame) in some.iter().enumerate() {
        let [x, y] = frame.moment.place();
        let off = (x - exact.reals("x")[k]).hypot(y - exact.reals("y")[k]);
        assert!(off < 1e-9, "at {}: {off:e}", frame.moment.t);
    }
}

/// Catches figures without words for those who hear them, with words that are no XML, with numbers that are none, and a small motion that is
/// a dot in a large disc.
#[test]
fn figures_have_words_and_small_motions_a_panel() {
    let place = Place::new("words");
    for (scene, close) in [
        ("snap", true),
        ("oscillation", true),
        ("three_snaps", false),
    ] {
        let path = format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        let answer = place.run(&["run", &path, "--out", scene, "--quiet"]);
        assert_eq!((answer.code, answer.stderr.as_str()), (0, ""));
        for name in place
            .files(scene)
            .iter()
            .filter(|name| name.ends_with(".svg"))
        {
            let svg = place.read(&format!("{scene}/{name}"));
            for tag in ["title", "desc"] {
                let (_, rest) = svg.split_once(&format!("<{tag}>")).expect(name);
                let (words, _) = rest.split_once(&format!("</{tag}>")).expect(name);
                assert!(
                    words.len() > 5 && !words.contains(['<', '>']),
                    "{name}: {words}"
                );
            }
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        }
        let svg = place.read(&format!("{scene}/snapshots.svg"));
        assert_eq!(svg.contains("the path, closer"), close, "{scene}");
        assert_eq!(
            svg.contains("before a snap"),
            scene != "oscillation",
            "{scene}"
        );
    }
}

/// Catches a rod that is drawn in the frame of its clamp while its mass is drawn in the world: of a clamp that is turned, and of one that turns.
#[test]
fn the_rod_is_drawn_from_its_clamp_to_its_mass() {
    let path = format!("{}/scenes/catapult.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let given = 1.3;
    let short = text.replace("duration = 80.0", "duration = 4.0\nsamples = 3");
    let short = short.replace("angle = 1.5707", "angle = 1.3");
    assert_ne!(short, text);
    let scene = Scene::parse(&short).unwrap();
    let prepared = run::Prepared::new(&scene).unwrap();
    let record = run::run(&prepared, run::Fields::None, &mut Vec::new(), &mut Silent).unwrap();
    let track = &record.branches[0].track;
    let times: Vec<f64> = track.iter().map(|frame| frame.moment.t).collect();
    let shapes = run::shapes(&prepared, &times, 5, &mut Silent).unwrap();
    assert_eq!(track.len(), 3);
    for (frame, shape) in track.iter().zip(&shapes) {
        let axis = record.axis(frame).unwrap();
        let off = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v);
        assert!(off(axis[axis.len() - 1], frame.moment.place()) < 1e-9);
        let base = shape[0][0].1;
        let ahead = base * nalgebra::Point3::new(0.0, 0.0, 0.5);
        assert!(off(axis[0], [base.translation.x, base.translation.y]) < 1e-12);
        assert!(off(frame.moment.placed([0.5, 0.0]), [ahead.x, ahead.y]) < 1e-12);
        // It turns from where the scene has it.
        let angle = given + 0.004 * frame.moment.t;
        assert!(off([ahead.x, ahead.y], [0.5 * angle.cos(), 0.5 * angle.sin()]) < 1e-12);
    }
}
