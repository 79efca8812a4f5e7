//! Directory of a sweep, filled by any number of threads, processes or machines.
//!
//! A chunk is written to a temporary file and renamed. A file is thus complete or absent after any interruption, and
//! the next process continues with the missing chunks.

use super::{Interrupted, Sweep, fields, records};
use crate::error::{Error, Result};
use crate::study::export::Array;
use crate::study::{Csv, Hooks, json_text};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// File that identifies the sweep of the chunks.
const PLAN: &str = "sweep.json";
/// Directory of the chunks.
const CHUNKS: &str = "chunks";

/// A sweep and the directory of its chunks.
#[derive(Debug)]
pub struct Directory {
    sweep: Sweep,
    path: PathBuf,
    chunks: Vec<Range<usize>>,
}

impl Directory {
    /// Makes `path` the directory of this sweep, or finds it is so already. First the requested quantities are
    /// checked against the results of a point, which `hooks` may interrupt.
    ///
    /// # Errors
    /// A directory with another sweep, or with foreign files among the chunks, or that cannot be written; a quantity
    /// that no point has; an interrupt.
    pub fn open(sweep: Sweep, path: &Path, hooks: &mut dyn Hooks) -> Result<Self> {
        let opened = Self {
            chunks: sweep.chunks(),
            sweep,
            path: path.to_path_buf(),
        };
        let plan = path.join(PLAN);
        let identity = opened.sweep.identity();
        if !plan.exists() {
            let wrong = opened.sweep.unknown_quantity_message(hooks);
            let wrong = wrong.map_err(|Interrupted| {
                Error::domain("interrupted before the names of the columns were looked for")
            })?;
            if let Some(why) = wrong {
                return Err(Error::domain(why));
            }
            let chunks = path.join(CHUNKS);
            fs::create_dir_all(&chunks).map_err(|e| cannot("make", &chunks, e))?;
            let mut there = fs::read_dir(&chunks).into_iter().flatten().flatten();
            // Another process with the same sweep writes the plan before any chunk.
            if let Some(stranger) = there.find(|entry| !is_aside(&entry.path()))
                && !plan.exists()
            {
                return Err(Error::domain(format!(
                    "{} is there, and no {PLAN} beside {CHUNKS} says what it belongs to; choose another directory with --out, or move it away",
                    stranger.path().display()
                )));
            }
            if !plan.exists() {
                whole(&plan, json_text(identity.clone()).as_bytes())?;
            }
        }
        let there: Value = serde_json::from_str(&read(&plan)?).map_err(|e| {
            Error::domain(format!(
                "{} is damaged ({e}), and nothing else says what the chunks beside it belong to; remove {}, or choose another directory with --out",
                plan.display(),
                path.display()
            ))
        })?;
        if there == identity {
            return Ok(opened);
        }
        let keys = identity.as_object().into_iter().flatten();
        let differ: Vec<&str> = keys
            .filter(|(key, value)| there[key.as_str()] != **value)
            .map(|(key, _)| key.as_str())
            .collect();
        Err(Error::domain(format!(
            "{} holds another sweep (it differs in: {}); choose another directory with --out, or remove that one",
            path.display(),
            differ.join(", ")
        )))
    }

    /// The sweep.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// Path of the directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of points in a chunk.
    pub fn points_of(&self, chunk: usize) -> usize {
        self.chunks.get(chunk).map_or(0, ExactSizeIterator::len)
    }

    /// State of the chunks, each of which is read for the check.
    pub fn made(&self) -> ChunkStatus {
        let all = 0..self.chunks.len();
        let missing: Vec<usize> = all.filter(|k| self.chunk(*k).is_none()).collect();
        let files = missing.iter().map(|k| self.file(*k));
        let lacking: usize = missing.iter().map(|k| self.points_of(*k)).sum();
        ChunkStatus {
            damaged: files.filter(|file| file.exists()).collect(),
            kept: self.sweep.points() - lacking,
            missing,
        }
    }

    /// Text and cells of a chunk; `None` if absent or incomplete.
    fn chunk(&self, k: usize) -> Option<(String, Vec<Vec<String>>)> {
        let text = fs::read_to_string(self.file(k)).ok()?;
        let cells: Vec<Vec<String>> = records(&text).map(fields).collect();
        let columns = self.sweep.table().columns.len();
        let is_row = |(row, point): (&Vec<String>, usize)| {
            row.len() == columns && row[0].parse() == Ok(point)
        };
        let points = self.chunks[k].clone();
        let is_whole = text.ends_with('\n')
            && cells.len() == points.len()
            && cells.iter().zip(points).all(is_row);
        is_whole.then_some((text, cells))
    }

    /// Computes a chunk unless it exists; false if interrupted by `hooks`.
    ///
    /// # Errors
    /// A chunk number out of range; a file that cannot be written.
    pub fn make(&self, chunk: usize, hooks: &mut dyn Hooks) -> Result<bool> {
        let Some(points) = self.chunks.get(chunk) else {
            return Err(Error::domain(format!(
                "there is no chunk {chunk}: there are {}",
                self.chunks.len()
            )));
        };
        if self.chunk(chunk).is_some() {
            return Ok(true);
        }
        match self.sweep.rows(points.clone(), hooks) {
            Ok(rows) => whole(&self.file(chunk), rows.as_bytes()).map(|()| true),
            Err(Interrupted) => Ok(false),
        }
    }

    /// All rows, once no chunk is missing. Temporary files of interrupted processes are removed.
    ///
    /// # Errors
    /// A missing or damaged chunk.
    pub fn rows(&self) -> Result<Rows> {
        for directory in [&self.path, &self.path.join(CHUNKS)] {
            for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
                if is_aside(&entry.path()) {
                    // Another process may have removed the file.
                    let _ = fs::remove_file(entry.path());
                }
            }
        }
        let names = self.sweep.table().columns.into_iter();
        let names: Vec<String> = names.map(|c| c.name.into_owned()).collect();
        let (mut csv, mut cells) = (Vec::new(), Vec::new());
        // Tables in memory do not fail.
        let _ = Csv::new(&mut csv, &self.sweep.table());
        for k in 0..self.chunks.len() {
            let (text, rows) = self.chunk(k).ok_or_else(|| {
                Error::domain(format!(
                    "{} does not hold its rows; make the sweep once more: what is whole is kept",
                    self.file(k).display()
                ))
            })?;
            csv.extend(text.as_bytes());
            cells.extend(rows);
        }
        Ok(Rows { names, cells, csv })
    }

    fn file(&self, chunk: usize) -> PathBuf {
        self.path.join(CHUNKS).join(format!("{chunk:06}.csv"))
    }
}

/// State of the chunks of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct ChunkStatus {
    /// Chunks that are missing or damaged.
    pub missing: Vec<usize>,
    /// Files of damaged chunks, changed since the chunk was written.
    pub damaged: Vec<PathBuf>,
    /// Number of points in complete chunks.
    pub kept: usize,
}

/// All rows of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// The names of the columns.
    pub names: Vec<String>,
    /// The cells of each row.
    pub cells: Vec<Vec<String>>,
    /// Content of sweep.csv.
    pub csv: Vec<u8>,
}

impl Rows {
    /// Cells of a column; empty for an unknown name.
    pub fn column(&self, name: &str) -> impl Iterator<Item = &str> {
        let place = self.names.iter().position(|other| other == name);
        self.cells
            .iter()
            .filter_map(move |row| Some(row[place?].as_str()))
    }

    /// The columns as arrays: reals (NaN for empty cells) if all other cells are numbers, words otherwise.
    pub fn arrays(&self) -> Vec<Array> {
        let array = |(k, name): (usize, &String)| {
            let cells = self.cells.iter().map(|row| row[k].as_str());
            let number = |cell: &str| match cell {
                "" => Some(f64::NAN),
                _ => cell.parse().ok(),
            };
            match cells.clone().map(number).collect::<Option<Vec<f64>>>() {
                Some(reals) => Array::reals(name, &[reals.len()], &reals),
                None => Array::words(name, &cells.collect::<Vec<_>>()),
            }
        };
        self.names.iter().enumerate().map(array).collect()
    }

    /// Number of points by outcome.
    pub fn outcomes(&self) -> BTreeMap<&str, usize> {
        let mut counts = BTreeMap::new();
        for outcome in self.column("outcome") {
            *counts.entry(outcome).or_default() += 1;
        }
        counts
    }
}

/// Writes a temporary file `name.PROCESS.part`, one per process, and renames it.
fn whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let aside = path.with_extension(format!("{}.{PART}", std::process::id()));
    match fs::write(&aside, bytes).and_then(|()| fs::rename(&aside, path)) {
        // Another process with the same content may have removed the temporary file.
        Err(e) if !path.exists() => Err(cannot("write", path, e)),
        _ => Ok(()),
    }
}

/// Extension of temporary files.
const PART: &str = "part";

/// True if the file is a temporary one of [`whole`].
fn is_aside(path: &Path) -> bool {
    let process = |stem: &Path| stem.extension()?.to_str()?.parse::<u32>().ok();
    path.extension().is_some_and(|end| end == PART) && process(&path.with_extension("")).is_some()
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).map_err(|e| cannot("read", path, e))
}

fn cannot(what: &str, path: &Path, e: std::io::Error) -> Error {
    Error::io(format!("cannot {what} {}", path.display())).caused_by(e)
}
