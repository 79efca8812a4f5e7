//! The program, run in a temporary directory, and its answers.

use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A directory of one test, removed at the end.
pub struct Place(pub PathBuf);

impl Place {
    pub fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("snaprod-cli-{}-{test}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.join(name), text).unwrap();
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_snaprod"));
        command.args(arguments).current_dir(&self.0);
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Answer {
        Answer::of(self.command(arguments).output().unwrap())
    }

    /// Runs the program with `text` on its standard input.
    pub fn run_with_input(&self, arguments: &[&str], text: &str) -> Answer {
        let mut command = self.command(arguments);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program");
        let mut input = child.stdin.take().expect("its standard input");
        input
            .write_all(text.as_bytes())
            .expect("a program that reads");
        drop(input);
        Answer::of(child.wait_with_output().expect("its answer"))
    }

    /// Writes `text` as scene.toml and runs it into out/.
    pub fn scene(&self, text: &str) -> Answer {
        self.write("scene.toml", text);
        self.run(&["run", "scene.toml", "--out", "out", "--json"])
    }

    pub fn files(&self, directory: &str) -> Vec<String> {
        let entries = fs::read_dir(self.join(directory)).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.join(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Answer of the program: exit code and outputs.
#[derive(Debug)]
pub struct Answer {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Answer {
    pub fn of(output: Output) -> Self {
        Self {
            code: output.status.code().expect("ended by a signal"),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// The one JSON object on standard output.
    #[track_caller]
    pub fn json(&self, code: i32) -> Value {
        assert_eq!(self.code, code, "{self:?}");
        assert_eq!(self.stderr, "");
        let value: Value = serde_json::from_str(&self.stdout).unwrap();
        assert!(value.is_object());
        assert!(!self.stdout.contains("-0.0\n") && !self.stdout.contains("-0.0,"));
        value
    }

    /// Readable text of a fully successful command.
    #[track_caller]
    pub fn text(&self) -> &str {
        assert_eq!(self.code, 0, "{self:?}");
        assert_eq!(self.stderr, "");
        assert!(!self.stdout.contains("NaN") && !self.stdout.contains("inf"));
        &self.stdout
    }

    /// Error message of a command with bad input, its only output.
    #[track_caller]
    pub fn refusal(&self) -> &str {
        assert_eq!(self.code, 2, "{self:?}");
        assert_eq!(self.stdout, "");
        assert!(self.stderr.starts_with("error: "), "{}", self.stderr);
        &self.stderr
    }
}

/// A table with named columns.
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn parse(text: &str) -> Self {
        assert!(text.ends_with('\n'), "the last line is not complete");
        let mut lines = text
            .lines()
            .map(|l| l.split(',').map(str::to_owned).collect());
        let columns: Vec<String> = lines.next().unwrap();
        let rows: Vec<Vec<String>> = lines.collect();
        assert!(rows.iter().all(|row| row.len() == columns.len()));
        Self { columns, rows }
    }

    pub fn texts(&self, name: &str) -> Vec<String> {
        let at = self.columns.iter().position(|c| c == name).unwrap();
        self.rows.iter().map(|row| row[at].clone()).collect()
    }

    pub fn column(&self, name: &str) -> Vec<f64> {
        let values = self.texts(name).into_iter().map(|x| x.parse().unwrap());
        values.inspect(|x: &f64| assert!(x.is_finite())).collect()
    }
}

#[track_caller]
pub fn close(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap();
    assert!(
        (value - expected).abs() <= tolerance * expected.abs().max(1.0),
        "{value} is not {expected}"
    );
}

#[track_caller]
pub fn keys(value: &Value, expected: &[&str]) {
    for key in expected {
        assert!(value.get(key).is_some(), "no {key} in {value}");
    }
}

/// A line as text with a `#` for every number, and the numbers as written.
pub fn parts(line: &str) -> (String, Vec<String>) {
    let chars: Vec<char> = line
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .chars()
        .collect();
    let digit = |i: usize| chars.get(i).is_some_and(char::is_ascii_digit);
    let (mut text, mut numbers, mut i) = (String::new(), Vec::new(), 0);
    while i < chars.len() {
        let signed = chars[i] == '-' && digit(i + 1) && (i == 0 || !chars[i - 1].is_alphanumeric());
        if !signed && !digit(i) {
            text.push(chars[i]);
            i += 1;
            continue;
        }
        let start = i;
        i += 1;
        while digit(i) || (chars.get(i) == Some(&'.') && digit(i + 1)) {
            i += 1;
        }
        let exponent = usize::from(matches!(chars.get(i + 1), Some('-' | '+')));
        if chars.get(i) == Some(&'e') && digit(i + 1 + exponent) {
            i += 1 + exponent;
            while digit(i) {
                i += 1;
            }
        }
        text.push('#');
        numbers.push(chars[start..i].iter().collect());
    }
    (text, numbers)
}
