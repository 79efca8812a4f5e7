//! Peer programs: alternatives that people would use in place of a model (tools/peers), run on the same problems.
//!
//! A peer receives the references as `KEY=number,number,...`, one for each problem. It prints lines
//! `KEY method setting error right-hand-sides milliseconds`; 0 right-hand sides means not counted. In the name of a
//! method ~ stands for a blank.

use crate::problems::Problem;
use std::path::{Path, PathBuf};
use std::process::Command;

/// An error and the work of the run.
pub struct Point {
    pub setting: String,
    pub error: f64,
    pub work: Option<u64>,
    pub ms: f64,
}

/// A peer program and the problems that have a solver in the program.
pub struct Peer {
    pub name: &'static str,
    source: &'static str,
    keys: &'static [&'static str],
}

pub const ALL: [Peer; 4] = [
    Peer {
        name: "C++ with Boost",
        source: "boost_plane.cpp",
        keys: &["W", "B", "H"],
    },
    Peer {
        name: "scipy",
        source: "scipy_rods.py",
        keys: &["W", "rest"],
    },
    Peer {
        name: "PyElastica",
        source: "pyelastica_let_go.py",
        keys: &["let-go"],
    },
    Peer {
        name: "AUTO-07p",
        source: "auto_fold.py",
        keys: &["fold"],
    },
];

/// Curves: title, index of the problem, points.
type Found = Vec<(String, usize, Vec<Point>)>;

impl Peer {
    /// Runs the peer on its problems; an error gives the reason why no points exist.
    pub fn run(&self, problems: &[Problem]) -> Result<Found, String> {
        let given = problems
            .iter()
            .filter(|problem| self.keys.contains(&problem.key));
        let given: Vec<String> = given
            .map(|problem| {
                let numbers = problem.reference.iter().flatten();
                let numbers: Vec<String> = numbers.map(|x| format!("{x:?}")).collect();
                format!("{}={}", problem.key, numbers.join(","))
            })
            .collect();
        if given.is_empty() {
            return Ok(Vec::new());
        }
        let output = self.command()?.args(given).output();
        let output = output.map_err(|e| e.to_string())?;
        if !output.status.success() {
            return Err(last_line(&output.stderr));
        }
        let mut found: Found = Vec::new();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let [key, method, setting, rest @ ..] =
                &line.split_whitespace().collect::<Vec<_>>()[..]
            else {
                return Err(format!("it printed {line:?}"));
            };
            let numbers: Vec<f64> = rest.iter().filter_map(|word| word.parse().ok()).collect();
            let problem = problems.iter().position(|p| p.key == *key);
            let (Some(i), &[error, work, ms]) = (problem, &numbers[..]) else {
                return Err(format!("it printed {line:?}"));
            };
            let title = format!("{key} by {}", method.replace('~', " "));
            let point = Point {
                setting: (*setting).to_owned(),
                error,
                work: (work > 0.0).then_some(work as u64),
                ms,
            };
            match found.iter_mut().find(|(name, ..)| *name == title) {
                Some((.., points)) => points.push(point),
                None => found.push((title, i, vec![point])),
            }
        }
        Ok(found)
    }

    /// The start command: a script by the interpreter named in PYTHON, or python3; C++ is compiled first.
    fn command(&self) -> Result<Command, String> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../tools/peers")
            .join(self.source);
        if self.source.ends_with(".py") {
            let python = std::env::var_os("PYTHON").unwrap_or("python3".into());
            let mut command = Command::new(python);
            command.arg(source);
            return Ok(command);
        }
        let program = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("peer");
        let compiled = Command::new("c++")
            .args(["-O3", "-march=native", "-std=c++17", "-o"])
            .args([&program, &source])
            .output()
            .map_err(|e| format!("there is no compiler c++ ({e})"))?;
        if compiled.status.success() {
            Ok(Command::new(program))
        } else {
            Err(last_line(&compiled.stderr))
        }
    }
}

/// The most informative line of an error output: the last, or the first of a compiler.
fn last_line(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    let fatal = text.lines().find(|line| line.contains("fatal error"));
    let line = fatal.or_else(|| text.lines().rev().find(|line| !line.trim().is_empty()));
    line.unwrap_or("it failed without a word").to_owned()
}
