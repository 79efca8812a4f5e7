//! The directory that a command writes into: whole files, one run at a time, signals.

use crate::program::{Answer, Place, Table};
use snaprod::scene::Scene;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn bundled(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// A practically endless run into out/, with the table begun.
fn endless(place: &Place) -> Child {
    let forced = fs::read_to_string(bundled("forced")).unwrap();
    place.write(
        "long.toml",
        &forced.replace("duration = 20.0", "duration = 1e5\nsamples = 1000000"),
    );
    let mut child = place
        .command(&["run", "long.toml", "--out", "out", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let table = place.join("out/trajectory.csv.part");
    while fs::metadata(&table).map_or(0, |m| m.len()) == 0 {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status();
    assert!(sent.unwrap().success());
}

/// Catches a run whose work is lost, or whose table is cut within a row, after a request to end.
#[cfg(unix)]
#[test]
fn ctrl_c_and_sigterm_keep_what_was_computed() {
    for signal in ["-INT", "-TERM"] {
        let place = Place::new(&format!("interrupt{signal}"));
        let child = endless(&place);
        send(signal, &child);
        let summary = Answer::of(child.wait_with_output().unwrap()).json(1);
        assert_eq!(summary["outcome"], "interrupted");
        assert!(summary["end"]["t"].as_f64().unwrap() < 1e5);
        assert_eq!(place.json("out/summary.json")["outcome"], "interrupted");
        let table = Table::parse(&place.read("out/trajectory.csv"));
        let last = *table.column("t").last().unwrap();
        assert_eq!(Some(last), summary["end"]["t"].as_f64());
        let files = place.files("out");
        assert!(files.iter().all(|name| !name.ends_with(".part")));
        assert!(files.contains(&"energies.svg".to_owned()));
    }
}

/// Catches figures drawn in spite of a second Ctrl-C, and data lost by it: a pipe holds up the first figure until the
/// second signal has come.
#[cfg(unix)]
#[test]
fn a_second_ctrl_c_skips_the_figures() {
    let place = Place::new("hurry");
    let child = endless(&place);
    let pipe = place.join("out/snapshots.svg.part");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    send("-INT", &child);
    let last = place.join("out/resolved.toml.part");
    while !last.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    send("-INT", &child);
    // The program writes into the pipe only if the signal comes after the figure was begun.
    std::thread::spawn(move || fs::read(pipe));
    let summary = Answer::of(child.wait_with_output().unwrap()).json(1);
    assert_eq!(summary["outcome"], "interrupted");
    assert_eq!(place.json("out/summary.json")["end"], summary["end"]);
    let files = place.files("out");
    for figure in ["energies", "surface"] {
        assert!(!files.contains(&format!("{figure}.svg")), "{files:?}");
    }
    assert!(files.contains(&"resolved.toml".to_owned()), "{files:?}");
}

/// True if the process catches interrupts (its mask of signals caught, bit 2).
#[cfg(target_os = "linux")]
fn catches_interrupts(child: &Child) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    caught.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 2 != 0)
}

/// Catches a branch whose points are lost, or called complete, after a request to end.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_branch_is_written() {
    for signal in ["-INT", "-TERM"] {
        let place = Place::new(&format!("branch{signal}"));
        let slow = [
            "continue.step=1e-6",
            "continue.max_step=1e-6",
            "continue.points=1000000",
        ];
        let file = bundled("lateral");
        let mut words = vec!["branch", &file, "--out", "out", "--json"];
        words.extend(slow.iter().flat_map(|field| ["--set", field]));
        let mut command = place.command(&words);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = child.spawn().unwrap();
        while !catches_interrupts(&child) {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(300));
        send(signal, &child);
        let summary = Answer::of(child.wait_with_output().unwrap()).json(1);
        assert_eq!(summary["interrupted"], true);
        let end = summary["stop"][0].as_str().unwrap();
        assert!(end.contains("interrupted at"), "{end}");
        let points = Table::parse(&place.read("out/branch.csv")).column("parameter");
        assert_eq!(Some(points.len() as u64), summary["points"].as_u64());
        assert!((2..1_000_000).contains(&points.len()), "{}", points.len());
        assert!(place.files("out").contains(&"branch.svg".to_owned()));
    }
}

/// Catches two runs that mix their tables in one directory, and a lock that outlives its process. Catches files of an
/// earlier run that are lost or cut if the next run is killed.
#[cfg(unix)]
#[test]
fn one_run_at_a_time_writes_into_a_directory() {
    let place = Place::new("lock");
    let run = || place.run(&["run", &bundled("snap"), "--out", "out", "--no-figures"]);
    run().text();
    let mut child = endless(&place);
    let refused = run();
    let why = refused.refusal();
    assert!(why.contains("out is being written by another run"), "{why}");
    assert!(why.contains(&format!("process {}", child.id())), "{why}");
    assert!(why.contains("long.toml") && why.contains("--out"), "{why}");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(place.files("out").contains(&"snaprod.lock".to_owned()));
    assert_eq!(place.json("out/summary.json")["outcome"], "end_of_time");
    run().text();
    let expected = [
        "events.json",
        "resolved.toml",
        "summary.json",
        "trajectory.csv",
    ];
    assert_eq!(place.files("out"), expected);
}

/// Catches stale figures and tables of an earlier run, and the removal of foreign files.
#[test]
fn files_of_an_earlier_run_go() {
    let place = Place::new("stale");
    fs::create_dir(place.join("out")).unwrap();
    for name in [
        "trajectory-3.csv",
        "layer.svg",
        "strain.csv",
        "notes.txt",
        "kernel.csv",
    ] {
        place.write(&format!("out/{name}"), "old");
    }
    place
        .run(&["run", &bundled("snap"), "--out", "out", "--no-figures"])
        .text();
    let expected = [
        "events.json",
        "kernel.csv",
        "notes.txt",
        "resolved.toml",
        "summary.json",
        "trajectory.csv",
    ];
    assert_eq!(place.files("out"), expected);
}

/// A command and the files removed by the command, each with the option for making the file again.
type Removal<'a> = (&'a [&'a str], &'a [(&'a str, &'a str)]);

/// Catches a page, archive or figure of an earlier run that a command removes silently. Catches also a message if
/// nothing is lost, and a message in spite of `--quiet` or `--json`.
#[test]
fn files_that_go_are_named_with_what_makes_them_again() {
    let place = Place::new("named");
    let (snap, column, lateral) = (bundled("snap"), bundled("heavy_column"), bundled("lateral"));
    let cases: [Removal; 4] = [
        (
            &["run", &snap, "--no-figures"],
            &[
                ("run.html", "with --html"),
                ("shapes.npz", "with --npz"),
                ("run.vtkhdf", "with --vtk"),
                ("run.glb", "with --gltf"),
                ("energies.png", "with --png"),
                ("energies.svg", "without --no-figures"),
            ],
        ),
        (
            &["equilibrium", &lateral, "--no-figures"],
            &[("shape.npz", "with --npz")],
        ),
        (
            &["branch", &column, "--no-figures"],
            &[("branch.html", "with --html"), ("branch.npz", "with --npz")],
        ),
        (
            &[
                "sweep",
                &snap,
                "--vary",
                "run.duration=0.1:0.2:2",
                "--no-figures",
            ],
            &[("sweep.npz", "with --npz")],
        ),
    ];
    for (command, files) in cases {
        let out = format!("out_{}", command[0]);
        let again = |more: &[&str]| {
            let answer = place.run(&[command, &["--out", &out], more].concat());
            assert_eq!(answer.code, 0, "{answer:?}");
            answer.stdout
        };
        let note = |text: &str| {
            let lines = text.lines();
            let found = lines.filter(|line| line.starts_with("note: removed files of"));
            found.map(str::to_owned).collect::<Vec<_>>()
        };
        assert!(note(&again(&[])).is_empty(), "{command:?}");
        for (file, _) in files {
            place.write(&format!("{out}/{file}"), "old");
        }
        let told = note(&again(&[]));
        assert_eq!(told.len(), 1, "{command:?}");
        for (file, flag) in files {
            let group = told[0].split("; ").find(|group| group.contains(file));
            let group = group.unwrap_or_else(|| panic!("{file} in {told:?}"));
            assert!(group.ends_with(&format!("(again {flag})")), "{told:?}");
        }
        assert!(
            !told[0].contains("csv") && !told[0].contains("json"),
            "{told:?}"
        );
        place.write(&format!("{out}/{}", files[0].0), "old");
        assert!(note(&again(&["--json"])).is_empty(), "{command:?}");
    }
    place.write("out_run/run.html", "old");
    let quiet = place.run(&["run", &snap, "--out", "out_run", "--no-figures", "--quiet"]);
    assert_eq!((quiet.stdout, quiet.stderr), (String::new(), String::new()));
}

/// Catches a finished run that ends with the code of bad input because one of its figures failed.
#[test]
fn a_figure_that_cannot_be_made_is_a_warning() {
    let place = Place::new("figure");
    // A directory blocks the temporary name of the figure.
    fs::create_dir_all(place.join("out/energies.svg.part/in")).unwrap();
    let answer = place.run(&["run", &bundled("snap"), "--out", "out"]);
    assert_eq!(answer.code, 0, "{answer:?}");
    assert!(answer.stdout.contains("snap at t = "), "{answer:?}");
    assert!(
        answer
            .stderr
            .starts_with("warning: energies.svg is missing: ")
    );
    assert!(place.join("out/surface.svg").exists());
}

/// Catches a warning of missing figures over time for a motion of zero duration: a body at the end of its groove that
/// moves outward.
#[test]
fn a_run_that_ends_at_its_start_has_no_motion_to_draw() {
    let place = Place::new("at_start");
    let rod = "[[rod]]\nname = \"a\"\nmodel = \"cosserat\"\nlength = 1.0\nfrom = {}\nto = { body = \"m\", joint = \"ball\" }\n\
               section = { bending = [1.0, 1.0], torsion = 1.0, axial = 1e3, shear = [1e3, 1e3] }\n";
    let body = "[[body]]\nname = \"m\"\nmass = 1.0\nvelocity = [0.5, 0.0, 0.0]\n\
                groove = { spline = [[-0.2, 0.0, 1.0], [-0.1, 0.0, 1.0], [0.0, 0.0, 1.0]] }\n";
    let run = "[start]\nrest = \"straight\"\n[run]\nduration = 0.1\n";
    place.write("scene.toml", &format!("{rod}{body}{run}"));
    let answer = place.run(&["run", "scene.toml", "--out", "out"]);
    assert!(answer.stdout.contains("(groove_end)"), "{answer:?}");
    let note = "note: no energies.svg and no path_*.svg: the run ended at its start";
    assert!(answer.stderr.starts_with(note), "{answer:?}");
    assert!(!answer.stderr.contains("is missing"), "{answer:?}");
}

/// Catches a faulty starter scene, and one written over an existing file.
#[test]
fn new_scenes_are_sound() {
    let place = Place::new("new");
    for (name, duration) in [
        ("strip", "0.05"),
        ("catapult", "0.5"),
        ("silicone-arm", "0.1"),
        ("buckled-strip", "1.0"),
        ("branch", ""),
    ] {
        let file = format!("{name}.toml");
        let answer = place.run(&["new", name, "--out", &file]);
        assert_eq!(answer.text(), format!("{file}\n"));
        assert_eq!(place.run(&["new", name]).text(), place.read(&file));
        place.run(&["check", &file]).text();
        if name == "branch" {
            let found = place
                .run(&["branch", &file, "--json", "--no-figures"])
                .json(0);
            assert_eq!(found["complete"], true);
            let kinds = found["special_points"].as_array().unwrap().iter();
            assert!(
                kinds
                    .map(|at| &at["kind"])
                    .any(|kind| kind == "branch point")
            );
        } else {
            let short = format!("run.duration={duration}");
            let summary = place
                .run(&["run", &file, "--json", "--set", &short])
                .json(0);
            assert_eq!(summary["outcome"], "end_of_time", "{name}");
            let snaps = summary["snaps"].as_u64();
            assert!(name != "catapult" || snaps > Some(0), "{summary}");
        }
        let again = place.run(&["new", name, "--out", &file]);
        assert!(again.refusal().contains("exists already"), "{again:?}");
    }
    place.run(&["completions", "bash"]).text();
    place.run(&["schema"]).json(0);
    let manual = place.run(&["man"]);
    assert!(manual.text().matches("\n.TH ").count() > 10, "{manual:?}");
}

/// Catches a command that ignores overrides, or a fault in an override that is not attributed to it.
#[test]
fn every_command_that_takes_a_scene_takes_overrides() {
    let place = Place::new("set");
    let bad = "rod.length=-1";
    for command in ["run", "check", "equilibrium", "branch", "memory"] {
        let refused = place.run(&[command, &bundled("twist"), "--set", bad]);
        assert!(
            refused.refusal().contains("--set rod.length=-1: "),
            "{command}: {refused:?}"
        );
    }
    let given = ["--set", "body.mass=2.0", "--set", "run.duration=0.01"];
    let file = bundled("snap");
    let mut words = vec!["run", file.as_str(), "--json"];
    words.extend(given);
    let summary = place.run(&words).json(0);
    assert_eq!(summary["scene"]["body"]["mass"], 2.0);
    assert_eq!(summary["end"]["t"], 0.01);
}

/// Catches a resolved scene that differs from the scene run, in the plane or in space.
#[test]
fn resolved_scenes_run_the_same() {
    let place = Place::new("resolved");
    for (name, set) in [("snap", "run.duration=0.1"), ("whirl", "run.duration=0.05")] {
        let file = bundled(name);
        let first = ["run", &file, "--set", set, "--out", name, "--no-figures"];
        place.run(&first).text();
        let resolved = format!("{name}/resolved.toml");
        let again = ["run", &resolved, "--out", "again", "--no-figures"];
        place.run(&again).text();
        let summary = |of: &str| place.json(&format!("{of}/summary.json"));
        for key in ["scene", "start", "end"] {
            assert_eq!(summary(name)[key], summary("again")[key], "{name}: {key}");
        }
    }
}

/// Catches a resolved scene that is refused or differs, for every kind of scene that is bundled or that `snaprod new`
/// writes.
#[test]
fn resolved_scenes_are_scenes() {
    for folder in ["scenes", "src/cli/templates"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let file = path.display();
            let scene = Scene::read(&path).unwrap_or_else(|e| panic!("{e}"));
            let written = toml::to_string(&scene).unwrap();
            let again = Scene::parse(&written).unwrap_or_else(|faults| panic!("{file}: {faults}"));
            assert_eq!(toml::to_string(&again).unwrap(), written, "{file}");
        }
    }
}
