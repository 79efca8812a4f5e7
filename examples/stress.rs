//! Random scenes, in any number, on all cores: each must end in a stated outcome.
//!
//! cargo run --release --example stress -- FROM TO [LOG [SECONDS]]
//!
//! Runs the seeds FROM to TO - 1. The outcome of each seed is a line of LOG (default stress.log); seeds already in LOG
//! are left out, so a run can be interrupted and resumed. A scene is interrupted after SECONDS (default 3), which is a
//! valid outcome: this allows many scenes over a short time, or fewer of them further.
//!
//! Panics, NaN and infinite numbers, spurious energy, and scenes that do not end within two minutes are reported with
//! their seeds; `stress SEED` prints the scene of a seed. Without arguments twenty scenes are run, and no log is
//! written.

#[path = "../tests/suite/stress_scenes.rs"]
mod stress_scenes;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::OpenOptions;
use std::io::Write;
use std::panic::catch_unwind;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use stress_scenes::{judged, scene};

/// Time limits of a scene in seconds: until its interruption, and until it is reported as endless.
const PATIENCE: f64 = 3.0;
const ENDLESS: Duration = Duration::from_secs(120);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize| given.get(k).map(|text| text.parse::<u64>()).transpose();
    if let (Some(seed), None) = (number(0)?, number(1)?) {
        println!("{}", scene(seed));
        println!(
            "# {:?}",
            judged(&scene(seed), Duration::from_secs_f64(PATIENCE))
        );
        return Ok(());
    }
    let (from, to) = (number(0)?.unwrap_or(0), number(1)?.unwrap_or(20));
    let patience = given.get(3).map(|text| text.parse()).transpose()?;
    let patience = Duration::try_from_secs_f64(patience.unwrap_or(PATIENCE))?;
    let path = given.get(2).map_or("stress.log", String::as_str);
    let done = if given.is_empty() {
        String::new()
    } else {
        std::fs::read_to_string(path).unwrap_or_default()
    };
    let done: BTreeSet<u64> = (done.lines())
        .filter_map(|line| line.split('\t').next()?.parse().ok())
        .collect();
    let log = if given.is_empty() {
        None
    } else {
        Some(OpenOptions::new().create(true).append(true).open(path)?)
    };
    let (log, next) = (Mutex::new(log), AtomicU64::new(from));
    let counts: Mutex<BTreeMap<String, usize>> = Mutex::default();
    let bad: Mutex<Vec<String>> = Mutex::default();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let working: Vec<Mutex<Option<(u64, Instant)>>> =
        (0..cores).map(|_| Mutex::default()).collect();
    let tell = |seed: u64, word: &str| {
        if let Some(file) = log.lock().expect("the log").as_mut() {
            let _ = writeln!(file, "{seed}\t{word}");
        }
    };
    std::panic::set_hook(Box::new(|_| {}));
    std::thread::scope(|scope| {
        for place in &working {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= to {
                        break;
                    }
                    if done.contains(&seed) {
                        continue;
                    }
                    *place.lock().expect("a place") = Some((seed, Instant::now()));
                    let found = catch_unwind(|| judged(&scene(seed), patience));
                    *place.lock().expect("a place") = None;
                    let word = match found {
                        Ok(Ok(word)) => word,
                        Ok(Err(why)) => format!("WRONG: {why}"),
                        Err(_) => "WRONG: panic".to_owned(),
                    };
                    tell(seed, &word);
                    if word.starts_with("WRONG") {
                        bad.lock()
                            .expect("the list")
                            .push(format!("{seed}: {word}"));
                    }
                    *counts.lock().expect("the counts").entry(word).or_default() += 1;
                }
            });
        }
        while next.load(Ordering::Relaxed) < to + cores as u64 {
            std::thread::sleep(Duration::from_millis(200));
            for place in &working {
                if let Some((seed, since)) = *place.lock().expect("a place")
                    && since.elapsed() > ENDLESS
                {
                    tell(seed, "WRONG: endless");
                    eprintln!("{seed}: does not end");
                    std::process::exit(1);
                }
            }
        }
    });
    for (word, count) in counts.into_inner()? {
        println!("{count:7}  {word}");
    }
    let bad = bad.into_inner()?;
    bad.iter().for_each(|line| println!("{line}"));
    assert!(bad.is_empty(), "{} scenes went wrong", bad.len());
    Ok(())
}
