//! Printed examples of README and docs against the output of the program.
//!
//! A fenced block of the language `console` holds commands, `$ snaprod ...`, each followed by lines of its output in
//! order; lines may be left out. Every command is run here, and every line is searched in its output.

use crate::program::{Answer, Place, parts};
use std::fs;
use std::path::{Path, PathBuf};

/// The documents with examples.
fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = vec![root.join("README.md")];
    for entry in fs::read_dir(root.join("docs")).expect("docs") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "md") {
            found.push(path);
        }
    }
    found
}

/// The fenced blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.strip_prefix("```") == Some(language) {
            let block: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            found.push(block.join("\n"));
        }
    }
    found
}

/// One unit of the last digit written.
fn last_digit(number: &str) -> f64 {
    let decimals = number.split_once('.').map_or(0, |(_, after)| after.len());
    10f64.powi(-(decimals as i32))
}

/// True if two numbers of a line agree. An estimate of an error (1.6e-11) must agree within a factor of 30, a count of
/// work within a tenth. Other numbers must agree up to the last digit written, or ten times the uncertainty that
/// follows it.
fn same(written: &str, printed: &str, counts: bool, uncertainty: Option<f64>) -> bool {
    let [a, b]: [f64; 2] = [written, printed].map(|n| n.parse().expect("a number"));
    if written.contains("e-") || printed.contains("e-") {
        return a.signum() == b.signum() && a.abs() <= 30.0 * b.abs() && b.abs() <= 30.0 * a.abs();
    }
    if counts && !written.contains('.') {
        return (a - b).abs() <= 0.1 * a.abs();
    }
    (a - b).abs() <= 2.0 * last_digit(written) + 10.0 * uncertainty.unwrap_or(0.0)
        || written == printed
}

fn agree(written: &str, printed: &str) -> bool {
    let ((text, numbers), (other, values)) = (parts(written), parts(printed));
    let counts = written.contains("right-hand sides") || written.contains("points of the branch");
    text == other
        && numbers.iter().zip(&values).enumerate().all(|(i, (a, b))| {
            let place = text.match_indices('#').nth(i).map_or(0, |(at, _)| at);
            let uncertain = text[place..].starts_with("# +- #");
            let bound = || numbers[i + 1].parse::<f64>().ok();
            same(a, b, counts, if uncertain { bound() } else { None })
        })
}

/// The lines that the program printed, on either stream.
fn lines(answer: &Answer) -> Vec<&str> {
    answer.stdout.lines().chain(answer.stderr.lines()).collect()
}

/// A directory with the scenes of the repository, where commands may write.
fn workplace() -> Place {
    let place = Place::new("printed");
    fs::create_dir_all(place.join("scenes")).expect("a directory");
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for entry in fs::read_dir(scenes).expect("scenes") {
        let path = entry.expect("an entry").path();
        let copy = place.join("scenes").join(path.file_name().expect("a name"));
        fs::copy(&path, copy).expect("a copy");
    }
    place
}

/// Catches printed examples that are out of date.
#[test]
fn printed_examples_are_what_the_program_prints() {
    let place = workplace();
    let mut seen = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("a document");
        for block in blocks(&text, "console") {
            let mut printed = Vec::new();
            let mut command = "";
            for line in block.lines() {
                if let Some(wanted) = line.strip_prefix("$ snaprod ") {
                    command = wanted;
                    let answer = place.run(&command.split_whitespace().collect::<Vec<_>>());
                    printed = lines(&answer)
                        .into_iter()
                        .rev()
                        .map(str::to_owned)
                        .collect();
                    seen += 1;
                    continue;
                }
                // The remaining lines are at the end of `printed`.
                let at = printed.iter().rposition(|p: &String| agree(line, p));
                let Some(at) = at else {
                    panic!(
                        "{}: snaprod {command} does not print\n{line}\nbut\n{}",
                        path.display(),
                        printed.iter().rev().cloned().collect::<Vec<_>>().join("\n")
                    );
                };
                printed.truncate(at);
            }
        }
    }
    assert!(seen >= 8, "only {seen} commands found");
}

/// Catches a documented scene that the program refuses.
#[test]
fn printed_scenes_check() {
    let place = Place::new("printed-scenes");
    let mut seen = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("a document");
        for scene in blocks(&text, "toml").iter().filter(|b| b.contains("[rod]")) {
            place.write("scene.toml", scene);
            let answer = place.run(&["check", "scene.toml"]);
            assert_eq!(answer.code, 0, "{}: {answer:?}\n{scene}", path.display());
            seen += 1;
        }
    }
    assert!(seen >= 1);
}
