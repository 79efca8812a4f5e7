//! Agreement of the committed figures with the program's.

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
        // At rounding limits of coordinates another machine may keep one more point.
        assert!(
            different * 500 <= drawn.lines().count(),
            "{name} has changed in {different} lines: look at it, then run `snaprod sheets --out figures`"
        );
    }
}

/// Number of lines of two figures that differ by more than 0.3 pixels in a coordinate (figures are drawn ten times
/// enlarged) or in anything else: functions of another machine's library differ by an ulp.
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

/// Catches paths drawn from samples alone: the mass is thrown back ten times between two samples. Catches paths that
/// leave the motion or go back in time, costs for runs without figures, and times just after a step that no step
/// contains.
#[test]
#[ignore = "second tier: 6 s"]
fn motions_are_drawn_closer_than_their_samples() {
    let path = format!("{}/scenes/bounce.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains("samples = 400"));
    let scene = Scene::parse(&text.replace("samples = 400", "samples = 5")).unwrap();
    let prepared = run::Prepared::new(&scene).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
    assert_eq!(record.branches[0].way.len(), 5);
    let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Draws).unwrap();
    let way = &record.branches[0].way;
    assert_eq!(tables.iter().map(Table::rows).collect::<Vec<_>>(), [5, 5]);
    let apart = |two: &[run::Moment]| (two[0].position() - two[1].position()).norm();
    let rises = |way: &[run::Moment]| way.windows(2).all(|two| two[0].t < two[1].t);
    let near = |way: &[run::Moment], most: f64| way.windows(2).all(|two| apart(two) < most);
    assert!(
        rises(way) && near(way, 0.05),
        "a way of a twentieth of the rod"
    );
    let true_to = |prepared: &run::Prepared, way: &[run::Moment], names: [&str; 2], bound: f64| {
        let some: Vec<&run::Moment> = way.iter().step_by(way.len().div_ceil(40)).collect();
        let times: Vec<f64> = some.iter().map(|moment| moment.t).collect();
        let exact = run::samples(prepared, &times, &mut Silent).unwrap();
        for (k, moment) in some.iter().enumerate() {
            let at = moment.position();
            let at = [at.x, if names[1] == "z" { at.z } else { at.y }];
            let off = (at[0] - exact.reals(names[0])[k]).hypot(at[1] - exact.reals(names[1])[k]);
            assert!(off < bound, "at {}: {off:e}", moment.t);
        }
    };
    true_to(&prepared, way, ["x", "y"], 1e-9);
    // Rods with friction and with mass keep their strains at the samples alone.
    for (scene, most) in [("creep", 0.2), ("heavy_snap", 0.1), ("whirl", 0.2)] {
        let path = format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::read_with(path.as_ref(), &["run.samples=3"]).unwrap();
        let prepared = run::Prepared::new(&scene).unwrap();
        let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Draws).unwrap();
        let branch = &record.branches[0];
        assert_eq!(branch.track.len(), 3);
        assert!(rises(&branch.way) && near(&branch.way, most) && branch.way.len() > 50);
        let names = ["x", if prepared.header.in_space() { "z" } else { "y" }];
        true_to(&prepared, &branch.way, names, 1e-7);
        // Steps end at these times. The next double after each of them lies in the step that follows.
        let (_, before) = branch.way.split_last().expect("a way");
        let after: Vec<f64> = before.iter().map(|moment| moment.t.next_up()).collect();
        let told = run::samples(&prepared, &after, &mut Silent).unwrap();
        assert_eq!(told.rows(), after.len());
    }
}

/// Catches figures, of all kinds of runs, without descriptions for screen readers, with descriptions that are invalid
/// XML, or with NaN; and a small motion drawn as a dot in a large disc.
#[test]
fn figures_have_words_and_small_motions_a_panel() {
    let place = Place::new("words");
    for (scene, close) in [
        ("snap", Some(true)),
        ("oscillation", Some(true)),
        ("three_snaps", Some(false)),
        ("creep", Some(false)),
        ("whirl", None),
        ("plunge", None),
        ("platform", None),
        ("pulse_small", None),
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
        let Some(close) = close else {
            continue;
        };
        let svg = place.read(&format!("{scene}/snapshots.svg"));
        assert_eq!(svg.contains("the path, closer"), close, "{scene}");
        let snaps = matches!(scene, "snap" | "three_snaps");
        assert_eq!(svg.contains("before a snap"), snaps, "{scene}");
    }
}

/// Catches a rod drawn in the frame of its clamp with a mass drawn in the world frame, for a turned clamp and for a
/// turning one.
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
    let way = &record.branches[0].way;
    let times: Vec<f64> = way.iter().map(|moment| moment.t).collect();
    let shapes = run::shapes(&prepared, &times, 5, &mut Silent).unwrap();
    assert_eq!(way.len(), 3);
    for (moment, shape) in way.iter().zip(&shapes) {
        let axis = record.axis(moment).unwrap();
        let off = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v);
        assert!(off(axis[axis.len() - 1], moment.place()) < 1e-9);
        let base = shape[0][0].1;
        let ahead = base * nalgebra::Point3::new(0.0, 0.0, 0.5);
        assert!(off(axis[0], [base.translation.x, base.translation.y]) < 1e-12);
        assert!(off(moment.placed([0.5, 0.0]), [ahead.x, ahead.y]) < 1e-12);
        // The clamp turns, starting from the angle in the scene.
        let angle = given + 0.004 * moment.t;
        assert!(off([ahead.x, ahead.y], [0.5 * angle.cos(), 0.5 * angle.sin()]) < 1e-12);
    }
}

/// Texts of a figure.
fn words(place: &Place, file: &str) -> Vec<String> {
    let svg = place.read(file);
    let document = roxmltree::Document::parse(&svg).unwrap();
    let texts = document.descendants().filter(|n| n.has_tag_name("text"));
    let words = texts.filter_map(|n| n.text());
    words.map(|word| word.trim().to_owned()).collect()
}

/// Catches a fold passage of a rod with friction called a snap, a snap called a passage, and a map of strains that
/// ends before the motion.
#[test]
fn figures_tell_snaps_from_passages() {
    let place = Place::new("passages");
    let scene = |name: &str| format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    for (name, told, never) in [
        ("plunge", "away from equilibrium", "snap"),
        ("flywheel", "snap", "away from equilibrium"),
    ] {
        place.run(&["run", &scene(name), "--out", name]).text();
        let strain = if name == "plunge" {
            "strain_v3"
        } else {
            "strain_u1"
        };
        for figure in ["energies", "path", strain] {
            let words = words(&place, &format!("{name}/{figure}.svg"));
            let has = |word: &str| words.iter().any(|other| other == word);
            assert!(has(told) && !has(never), "{name} {figure}: {words:?}");
        }
    }
    // 1.0 is the end of the rod, and that of the motion.
    let words = words(&place, "flywheel/strain_u1.svg");
    assert_eq!(
        words.iter().filter(|word| *word == "1.0").count(),
        2,
        "{words:?}"
    );
}

/// Catches a diagram in which both arms of a pitchfork coincide.
#[test]
fn branches_that_differ_are_seen_to_differ() {
    let place = Place::new("pitchfork");
    let scene = format!("{}/scenes/heavy_column.toml", env!("CARGO_MANIFEST_DIR"));
    place.run(&["branch", &scene, "--out", "out"]).text();
    let words = words(&place, "out/branch.svg");
    assert!(words.iter().any(|word| word == "x of the end"), "{words:?}");
}
