//! The program killed at random moments: every file is whole or absent, and a resumed run gives the undisturbed
//! result.

use crate::program::Place;
use crate::stress_scenes::Dice;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::DirEntryExt;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// The results below a directory with their bytes.
type Files = BTreeMap<String, Vec<u8>>;

/// True for results; partial files and the lock are none.
fn is_result(name: &str) -> bool {
    !name.ends_with(".part") && name != "snaprod.lock"
}

fn results(place: &Place, directory: &str) -> Files {
    let mut found = Files::new();
    for name in place.files(directory) {
        let path = format!("{directory}/{name}");
        match place.join(&path).is_dir() {
            true => found.extend(results(place, &path)),
            false if !is_result(&name) => {}
            false => {
                found.insert(name, fs::read(place.join(&path)).unwrap());
            }
        }
    }
    found
}

/// Names of all entries of a directory.
fn listed(place: &Place, directory: &str) -> Vec<String> {
    let mut names = place.files(directory);
    if place.join(&format!("{directory}/chunks")).is_dir() {
        names.extend(place.files(&format!("{directory}/chunks")));
    }
    names
}

fn begun(place: &Place, words: &[&str], out: &str) -> Child {
    let mut command = place.command(words);
    command.args(["--out", out]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

/// Runs the command undisturbed; returns the duration.
#[track_caller]
fn ended(place: &Place, words: &[&str], out: &str) -> Duration {
    let start = Instant::now();
    let status = begun(place, words, out).wait().unwrap();
    assert!(status.success(), "{words:?}: {status}");
    start.elapsed()
}

/// Kills the process after a random time, evenly over the undisturbed duration. Every other time the kill comes after
/// the first result has appeared or vanished, that is, while files take their names.
fn killed(mut child: Child, dice: &mut Dice, taken: Duration, out: &Path) {
    if dice.chance(0.5) {
        std::thread::sleep(taken.mul_f64(dice.within(0.0, 1.1)));
    } else {
        let found = || {
            let entries = fs::read_dir(out).into_iter().flatten().flatten();
            let results = entries.filter(|entry| entry.file_name().to_str().is_some_and(is_result));
            let mut found: Vec<_> = results
                .map(|entry| (entry.file_name(), entry.ino()))
                .collect();
            found.sort();
            found
        };
        let first = found();
        while found() == first && child.try_wait().unwrap().is_none() {}
        std::thread::sleep(taken.mul_f64(dice.within(0.0, 0.01)));
    }
    // A finished process cannot be killed, which is a valid outcome.
    let _ = child.kill();
    child.wait().unwrap();
}

/// A command of two scenes, both into the same directory.
struct Job {
    name: &'static str,
    words: [Vec<String>; 2],
    whole: [Files; 2],
    taken: Duration,
}

impl Job {
    fn new(place: &Place, name: &'static str, words: &[&str], set: [&str; 2]) -> Self {
        let words = set.map(|field| {
            let all = words.iter().copied().chain(["--set", field]);
            all.map(str::to_owned).collect::<Vec<_>>()
        });
        let mut taken = Duration::ZERO;
        let whole = [0, 1].map(|k| {
            let out = format!("{name}-{k}");
            taken = ended(place, &refs(&words[k]), &out);
            results(place, &out)
        });
        assert!(
            whole[0].keys().eq(whole[1].keys()) && whole[0] != whole[1],
            "{name}"
        );
        Self {
            name,
            words,
            whole,
            taken,
        }
    }

    /// Kills the job `kills` times, alternating its scenes, and judges the directory each time.
    fn disturb(&self, place: &Place, dice: &mut Dice, kills: usize) {
        for kill in 0..kills {
            let words = refs(&self.words[kill % 2]);
            killed(
                begun(place, &words, self.name),
                dice,
                self.taken,
                &place.join(self.name),
            );
            if place.join(self.name).is_dir() {
                self.judge(&results(place, self.name), kill);
            }
        }
        ended(place, &refs(&self.words[0]), self.name);
        assert!(
            listed(place, self.name).iter().eq(self.whole[0].keys()),
            "{}",
            self.name
        );
        assert!(results(place, self.name) == self.whole[0], "{}", self.name);
    }

    /// Asserts that every file is whole, and all belong to one run.
    fn judge(&self, found: &Files, kill: usize) {
        let strangers = [0, 1].map(|k| {
            let whole = &self.whole[k];
            let strange = found
                .iter()
                .filter(|(name, bytes)| whole.get(*name) != Some(bytes));
            strange.map(|(name, _)| name).collect::<Vec<_>>()
        });
        assert!(
            strangers.iter().any(Vec::is_empty),
            "{} after kill {kill}: not of the one run and not of the other: {strangers:?}",
            self.name
        );
    }
}

fn refs(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}

/// Kills a sweep repeatedly until it is complete; then starts another from nothing, until the number of kills is
/// reached.
fn disturb_sweeps(place: &Place, dice: &mut Dice, kills: usize) {
    place.write("swept.toml", crate::sweeps::SCENE);
    let vary = ["start.velocity.0=-1:1:12", "body.mass=0.5:3:5"];
    let words = [
        "sweep",
        "swept.toml",
        "--vary",
        vary[0],
        "--vary",
        vary[1],
        "--npz",
    ];
    let taken = ended(place, &words, "sweep");
    let whole = results(place, "sweep");
    let mut resumed = 0;
    for kill in 0..kills {
        killed(
            begun(place, &words, "killed"),
            dice,
            taken.mul_f64(0.7),
            &place.join("killed"),
        );
        if !place.join("killed").is_dir() {
            continue;
        }
        let found = results(place, "killed");
        let cut = found
            .iter()
            .find(|(name, bytes)| whole.get(*name) != Some(bytes));
        assert!(
            cut.is_none(),
            "kill {kill}: {:?}",
            cut.map(|(name, _)| name)
        );
        if found.len() == whole.len() || kill + 1 == kills {
            let chunks = found.keys().filter(|name| name.starts_with("00")).count();
            let answer = place
                .run(&[&words[..], &["--out", "killed", "--json"]].concat())
                .json(0);
            let points = answer["points"].as_u64().unwrap();
            assert_eq!(
                answer["made"].as_u64(),
                Some(points - chunks as u64),
                "a chunk is a point here"
            );
            assert!(results(place, "killed") == whole, "kill {kill}");
            let left = listed(place, "killed");
            assert!(left.iter().all(|name| is_result(name)), "{left:?}");
            resumed += usize::from(chunks > 0);
            fs::remove_dir_all(place.join("killed")).unwrap();
        }
    }
    assert!(resumed > 0, "no sweep was taken up");
}

fn disturb(test: &str, kills: [usize; 3]) {
    let place = Place::new(test);
    let dice = &mut Dice::new(1);
    let bundled = |name: &str| format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let [snap, lateral] = ["snap", "lateral"].map(bundled);
    // Large files of shapes, for a long phase of writing.
    let run = [
        "run",
        &snap,
        "--vtk",
        "--npz",
        "--html",
        "--set",
        "run.samples=100",
        "--set",
        "run.duration=0.3",
    ];
    let run = Job::new(&place, "run", &run, ["body.mass=1.0", "body.mass=1.5"]);
    run.disturb(&place, dice, kills[0]);
    let branch = ["branch", &lateral, "--html", "--npz"];
    let branch = Job::new(
        &place,
        "branch",
        &branch,
        ["continue.max_step=0.02", "continue.max_step=0.03"],
    );
    branch.disturb(&place, dice, kills[1]);
    disturb_sweeps(&place, dice, kills[2]);
}

/// Catches a truncated result, files of different runs side by side, and leftovers of a killed run that the next one
/// keeps. Catches a killed sweep that restarts from nothing, or ends with another result.
#[test]
fn a_killed_program_leaves_whole_files_or_none() {
    disturb("kills", [4, 3, 4]);
}

/// 200 kills: `cargo test --test suite -- --ignored two_hundred_kills`.
#[test]
#[ignore = "minutes: 200 runs, branches and sweeps"]
fn two_hundred_kills() {
    disturb("kills200", [80, 60, 60]);
}
