//! Output directory of a command.
//!
//! Files are first written as `name.part`, and are renamed together in [`Output::finish`]. A run that is killed, or
//! whose disk fills up, thus leaves the files of the previous run whole. A lock keeps a second run out of the
//! directory. This protects against the death of the program at any moment, not against power failure, since files are
//! not flushed to the disk.

use super::check::SceneArgs;
use super::files::{print, print_error};
use super::page::Page;
use super::{Refusal, signals};
use clap::Args;
use snaprod::plot::Paper;
use snaprod::study::export::{Array, npz};
use snaprod::study::{Cell, Csv, Sink, Table};
use std::cell::RefCell;
use std::fs::{self, File, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// A figure as PNG and as PDF, if requested.
type Copies = [Option<Vec<u8>>; 2];
/// Closure with owned data; draws a figure.
type Drawing = Box<dyn FnOnce() -> snaprod::Result<String> + Send>;

/// Options of commands that write files into a directory, and report in words or JSON.
#[derive(Args, Debug, Default)]
pub struct OutputArgs {
    /// Directory of the files. Without it `run`, `branch`, `sweep` and `fit` write to out/ and the name of the scene,
    /// with -sweep or -fit after it, but `run --json` and other commands write no file.
    #[arg(short, long, help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Print nothing but errors; no progress bar.
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
    #[command(flatten)]
    pub figures: FigureArgs,
}

impl OutputArgs {
    /// True if the command reports in words, and shows its progress on a terminal.
    pub fn speaks(&self) -> bool {
        !self.quiet && !self.json
    }

    /// The directory of a command that always writes files, by default out/, the name of the scene and `suffix`.
    pub fn directory(&self, scene: &SceneArgs, suffix: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let mut name = scene.directory().into_os_string();
            name.push(suffix);
            name.into()
        })
    }
}

/// Options of figures, and the format of tables.
#[derive(Args, Debug, Clone, Copy, Default)]
#[command(next_help_heading = "Figures and tables")]
pub struct FigureArgs {
    #[command(flatten)]
    pub print: PrintArgs,
    /// Draw no figures.
    #[arg(long, conflicts_with_all = ["png", "pdf", "width", "font"])]
    pub no_figures: bool,
    /// Write every table as NPZ, too, for NumPy, MATLAB and others.
    #[arg(long)]
    pub npz: bool,
}

/// The size and the formats of figures.
#[derive(Args, Debug, Clone, Copy, Default)]
pub struct PrintArgs {
    /// Write a PNG beside every figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
    /// Write a PDF beside every figure (needs the feature `pdf`).
    #[arg(long)]
    pdf: bool,
    /// The width of every figure in print, as in 85mm, 8.5cm or 3.3in.
    #[arg(long, value_name = "LENGTH", value_parser = millimetres)]
    width: Option<f64>,
    /// The size of letters in figures, as in 8pt; default 8pt if a width is given.
    #[arg(long, value_name = "LENGTH", value_parser = points)]
    font: Option<f64>,
}

impl PrintArgs {
    /// Refuses formats that the program was built without, and sizes too small for a figure.
    pub fn check(self) -> Result<(), Refusal> {
        let formats = [
            (self.png, cfg!(feature = "png"), "png"),
            (self.pdf, cfg!(feature = "pdf"), "pdf"),
        ];
        for (asked, built, name) in formats {
            if asked && !built {
                return Err(Refusal(format!(
                    "--{name}: this program was built without {}; build it with `cargo build --release --features {name}`, or use the SVG files",
                    name.to_uppercase()
                )));
            }
        }
        let paper = self.paper().check();
        paper.map_err(|e| Refusal(format!("--width, --font: {e}")))
    }

    /// The paper of the figures.
    pub fn paper(self) -> Paper {
        Paper {
            width: self.width,
            font: self.font,
        }
    }
}

/// Parses a printed length, in millimetres.
fn millimetres(text: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 4] = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72.0)];
    let text = text.trim();
    let length = UNITS.iter().find_map(|(name, unit)| {
        let number: f64 = text.strip_suffix(name)?.trim_end().parse().ok()?;
        (number > 0.0 && number.is_finite()).then_some(number * unit)
    });
    length.ok_or_else(|| "give a positive length with its unit: mm, cm, in or pt".to_owned())
}

/// Parses a printed length, in points.
fn points(text: &str) -> Result<f64, String> {
    millimetres(text).map(|length| length * 72.0 / 25.4)
}

/// The files of one command, in a directory; no file is written without a directory.
pub struct Output {
    place: Option<OutputDirectory>,
    figures: FigureArgs,
}

/// The output directory.
struct OutputDirectory {
    directory: PathBuf,
    /// Names of the files that the command may write, with at most one `*` each; a CSV also stands for its NPZ.
    owned: &'static [&'static str],
    /// Names of the complete `.part` files.
    written: RefCell<Vec<String>>,
    /// Figures drawn up to now, for the page.
    drawn: RefCell<Vec<(String, String)>>,
    _lock: Option<Lock>,
}

impl Output {
    /// Makes the directory and locks it. Without a directory no file is written, and everything else works the same.
    ///
    /// `owned` names every file that the command may write, with at most one `*` in a name. At the end, such files of
    /// an earlier run are removed unless written again, so that no figure stands beside the table of another run.
    pub fn open(
        directory: Option<&Path>,
        owned: &'static [&'static str],
        figures: FigureArgs,
    ) -> Result<Self, Refusal> {
        figures.print.check()?;
        let place = directory.map(|directory| OutputDirectory::open(directory, owned));
        Ok(Self {
            place: place.transpose()?,
            figures,
        })
    }

    /// A sink for the tables of a study; each table is written as `name.csv` during the computation.
    pub fn tables(&self) -> Tables<'_> {
        Tables {
            output: self,
            open: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// Writes a table as `name.csv`, with `--npz` also as `name.npz`.
    pub fn table(&self, table: &Table) -> Result<(), Refusal> {
        self.write(&format!("{}.csv", table.name), table.csv().as_bytes())?;
        if self.figures.npz {
            self.arrays(&table.name, &table.arrays())
        } else {
            Ok(())
        }
    }

    /// Writes arrays as `name.npz`.
    pub fn arrays(&self, name: &str, arrays: &[Array]) -> Result<(), Refusal> {
        if self.place.is_none() {
            return Ok(());
        }
        self.write(&format!("{name}.npz"), &npz(arrays)?)
    }

    /// True if figures are drawn.
    pub fn draws(&self) -> bool {
        self.place.is_some() && !self.figures.no_figures && !signals::hurried()
    }

    /// Writes a file.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Refusal> {
        let Some(place) = &self.place else {
            return Ok(());
        };
        fs::write(place.draft(name), bytes).map_err(|e| place.refuse(name, e))?;
        place.written.borrow_mut().push(name.to_owned());
        Ok(())
    }

    /// Draws `name.svg` from the data, with `name.png` and `name.pdf` if requested. A failure is only a warning, since
    /// the numbers are worth more than their picture. A second Ctrl-C abandons the figure at once.
    pub fn figure<D: Send + 'static>(
        &self,
        name: &str,
        data: impl FnOnce() -> Result<D, Refusal>,
        draw: impl FnOnce(&D, &Paper) -> snaprod::Result<String> + Send + 'static,
    ) {
        if !self.draws() {
            return;
        }
        let paper = self.figures.print.paper();
        let drawing = data().map(|data| Box::new(move || draw(&data, &paper)) as Drawing);
        if let Err(Refusal(why)) = drawing.and_then(|drawing| self.try_figure(name, drawing)) {
            print_error(&format!("warning: {name}.svg is missing: {why}"));
        }
    }

    fn try_figure(&self, name: &str, draw: Drawing) -> Result<(), Refusal> {
        let asked = self.figures.print;
        let (send, receive) = channel();
        // A thread draws the figure, and a signal need not wait for the drawing.
        std::thread::spawn(move || {
            let drawn = draw().and_then(|svg| Ok((copies(&svg, asked)?, svg)));
            // After a second Ctrl-C the channel is closed.
            let _ = send.send(drawn);
        });
        let (copies, svg) = loop {
            match receive.recv_timeout(Duration::from_millis(50)) {
                Ok(drawn) => break drawn?,
                Err(RecvTimeoutError::Timeout) if signals::hurried() => return Ok(()),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Refusal("its drawing broke off".to_owned()));
                }
            }
        };
        self.write(&format!("{name}.svg"), svg.as_bytes())?;
        if let Some(place) = &self.place {
            place.drawn.borrow_mut().push((name.to_owned(), svg));
        }
        for (copy, kind) in copies.into_iter().zip(["png", "pdf"]) {
            if let Some(bytes) = copy {
                self.write(&format!("{name}.{kind}"), &bytes)?;
            }
        }
        Ok(())
    }

    /// Writes the page `name.html` into the directory, if there is one; `page` receives the figures drawn up to now. A
    /// failure is only a warning.
    pub fn page(
        &self,
        name: &str,
        page: impl FnOnce(Vec<(String, String)>) -> Result<Page, Refusal>,
    ) {
        let Some(place) = &self.place else {
            return;
        };
        let page = page(place.drawn.take());
        let file = format!("{name}.html");
        let written = page.and_then(|page| self.write(&file, page.html().as_bytes()));
        if let Err(Refusal(why)) = written {
            print_error(&format!("warning: {file} is missing: {why}"));
        }
    }

    /// Removes the files of an earlier run, then renames those of this run. A command killed in between leaves files of
    /// one run only, never the table of one beside the figure of another. With `words` a printed line names the removed
    /// files that were not written again.
    pub fn finish(&self, words: bool) -> Result<Vec<String>, Refusal> {
        let Some(place) = &self.place else {
            return Ok(Vec::new());
        };
        let gone = place.remove(|name| place.owns(name) && !name.ends_with(PART));
        let written = place.written.take();
        if let Some(line) = self.removal(&gone, &written).filter(|_| words) {
            print(&format!("{line}\n"));
        }
        for name in &written {
            fs::rename(place.draft(name), place.directory.join(name))
                .map_err(|e| place.refuse(name, e))?;
        }
        Ok(written)
    }

    /// Message that names the removed files of an earlier run which were not written again, and the flags that produce
    /// them.
    fn removal(&self, removed: &[String], written: &[String]) -> Option<String> {
        let mut gone: Vec<&str> = removed
            .iter()
            .filter(|name| !written.contains(name))
            .map(String::as_str)
            .collect();
        gone.sort_unstable();
        let mut groups: Vec<(Option<&str>, Vec<&str>)> = Vec::new();
        for name in gone {
            let flag = self.flag(name, written);
            match groups.iter_mut().find(|group| group.0 == flag) {
                Some(group) => group.1.push(name),
                None => groups.push((flag, vec![name])),
            }
        }
        let told = groups.iter().map(|(flag, names)| {
            let names = brief(names);
            match flag {
                Some(flag) => format!("{names} (again {flag})"),
                None => names,
            }
        });
        let told: Vec<String> = told.collect();
        (!told.is_empty())
            .then(|| format!("note: removed files of an earlier run: {}", told.join("; ")))
    }

    /// Option that produces the file `name`; `None` if this run was asked for files of the same kind and made none of
    /// this name.
    fn flag(&self, name: &str, written: &[String]) -> Option<&'static str> {
        let asked = self.figures.print;
        let kind = name.rsplit_once('.')?.1;
        let (flag, given) = match kind {
            "html" => ("with --html", false),
            "npz" => ("with --npz", self.figures.npz),
            "vtkhdf" | "vtu" | "pvd" => ("with --vtk", false),
            "glb" => ("with --gltf", false),
            "png" => ("with --png", asked.png),
            "pdf" => ("with --pdf", asked.pdf),
            "svg" => ("without --no-figures", !self.figures.no_figures),
            _ => return None,
        };
        let same_kind = |other: &String| other.rsplit_once('.').is_some_and(|(_, end)| end == kind);
        (!given && !written.iter().any(same_kind)).then_some(flag)
    }
}

/// Names in a row; the first few of many, and the number of the others.
fn brief(names: &[&str]) -> String {
    /// Number of names listed.
    const TOLD: usize = 8;
    match names.len().checked_sub(TOLD) {
        Some(more) if more > 0 => format!("{} and {more} more", names[..TOLD].join(", ")),
        _ => names.join(", "),
    }
}

impl OutputDirectory {
    fn open(directory: &Path, owned: &'static [&'static str]) -> Result<Self, Refusal> {
        fs::create_dir_all(directory).map_err(|e| {
            Refusal(format!(
                "cannot make the directory {}: {e}; choose another with --out",
                directory.display()
            ))
        })?;
        let place = Self {
            directory: directory.to_owned(),
            owned,
            written: RefCell::default(),
            drawn: RefCell::default(),
            _lock: Lock::take(directory)?,
        };
        place.sweep();
        Ok(place)
    }

    /// Path of the draft of the file `name`.
    fn draft(&self, name: &str) -> PathBuf {
        debug_assert!(self.owns(name), "{name} is not among the command's files");
        self.directory.join(format!("{name}{PART}"))
    }

    fn owns(&self, name: &str) -> bool {
        let as_npz = |pattern: &str| {
            let stem = pattern.strip_suffix(".csv");
            stem.is_some_and(|stem| matches(&format!("{stem}.npz"), name))
        };
        let mut owned = self.owned.iter();
        owned.any(|pattern| matches(pattern, name) || as_npz(pattern))
    }

    /// Removes the drafts of a killed run.
    fn sweep(&self) {
        self.remove(|name| name.strip_suffix(PART).is_some_and(|name| self.owns(name)));
    }

    /// Removes the files selected by `which`; returns their names.
    fn remove(&self, which: impl Fn(&str) -> bool) -> Vec<String> {
        let entries = fs::read_dir(&self.directory).into_iter().flatten();
        let names = entries
            .flatten()
            .filter_map(|entry| entry.file_name().into_string().ok());
        // A file left behind does no harm.
        names
            .filter(|name| which(name) && fs::remove_file(self.directory.join(name)).is_ok())
            .collect()
    }

    fn refuse(&self, name: &str, e: std::io::Error) -> Refusal {
        let path = self.directory.join(name);
        Refusal(format!("cannot write {}: {e}", path.display()))
    }
}

impl Drop for OutputDirectory {
    fn drop(&mut self) {
        self.sweep();
    }
}

/// Suffix of drafts, files still being written.
const PART: &str = ".part";

/// True if the name matches the pattern; its optional `*` stands for any text.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, tail)) => name
            .strip_prefix(head)
            .is_some_and(|rest| rest.ends_with(tail)),
    }
}

/// Tables written row by row; unfinished tables are not kept.
pub struct Tables<'o> {
    output: &'o Output,
    open: Vec<(String, Csv<BufWriter<File>>)>,
    /// Copies of the tables for NPZ, if requested.
    kept: Vec<Table>,
}

impl Sink for Tables<'_> {
    fn begin(&mut self, table: Table) -> snaprod::Result<usize> {
        if let Some(place) = &self.output.place {
            let name = format!("{}.csv", table.name);
            let csv = File::create(place.draft(&name))
                .and_then(|file| Csv::new(BufWriter::new(file), &table))
                .map_err(|e| broken(&name, e))?;
            self.open.push((name, csv));
            if self.output.figures.npz {
                self.kept.push(table);
            }
        }
        Ok(self.open.len().saturating_sub(1))
    }

    fn row(&mut self, table: usize, cells: &[Cell]) -> snaprod::Result<()> {
        if let Some(kept) = self.kept.get_mut(table) {
            kept.push(cells)?;
        }
        match self.open.get_mut(table) {
            None => Ok(()),
            Some((name, csv)) => csv.row(cells).map_err(|e| broken(name, e)),
        }
    }
}

impl Tables<'_> {
    /// Flushes all rows to the files.
    pub fn finish(self) -> Result<(), Refusal> {
        for (name, csv) in self.open {
            csv.finish().map_err(|e| broken(&name, e))?;
            if let Some(place) = &self.output.place {
                place.written.borrow_mut().push(name);
            }
        }
        for table in &self.kept {
            self.output.arrays(&table.name, &table.arrays())?;
        }
        Ok(())
    }
}

fn broken(name: &str, e: std::io::Error) -> snaprod::Error {
    snaprod::Error::io(format!("cannot write {name}")).caused_by(e)
}

/// A lock on a directory. The system releases the lock when the process ends in any way, so that a lock file left
/// behind excludes nobody.
struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Takes the lock; `None` on a file system without locks.
    fn take(directory: &Path) -> Result<Option<Self>, Refusal> {
        let path = directory.join("snaprod.lock");
        let refuse = |e| Refusal(format!("cannot write {}: {e}", path.display()));
        let command: Vec<String> = std::env::args_os()
            .skip(1)
            .map(|word| word.to_string_lossy().into_owned())
            .collect();
        let own = format!(
            "process {}: snaprod {}\n",
            std::process::id(),
            command.join(" ")
        );
        loop {
            let mut file = File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&path)
                .map_err(refuse)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let other = fs::read_to_string(&path).unwrap_or_default();
                    return Err(Refusal(format!(
                        "{} is being written by another run ({}); wait for its end, or choose another directory with --out",
                        directory.display(),
                        other.trim()
                    )));
                }
                Err(TryLockError::Error(_)) => return Ok(None),
            }
            file.set_len(0)
                .and_then(|()| file.write_all(own.as_bytes()))
                .map_err(refuse)?;
            // Between opening and locking, the last holder may have removed the file, and another process may have made
            // a new one.
            if fs::read_to_string(&path).is_ok_and(|text| text == own) || cfg!(windows) {
                return Ok(Some(Self { path, _file: file }));
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// The requested copies of a figure in other formats.
fn copies(svg: &str, asked: PrintArgs) -> snaprod::Result<Copies> {
    Ok([
        asked.png.then(|| as_png(svg)).transpose()?,
        asked.pdf.then(|| as_pdf(svg)).transpose()?,
    ])
}

#[cfg(feature = "png")]
fn as_png(svg: &str) -> snaprod::Result<Vec<u8>> {
    snaprod::plot::png(svg, 2.0)
}

#[cfg(not(feature = "png"))]
fn as_png(_: &str) -> snaprod::Result<Vec<u8>> {
    unreachable!("refused by PrintArgs::check")
}

#[cfg(feature = "pdf")]
fn as_pdf(svg: &str) -> snaprod::Result<Vec<u8>> {
    snaprod::plot::pdf(svg)
}

#[cfg(not(feature = "pdf"))]
fn as_pdf(_: &str) -> snaprod::Result<Vec<u8>> {
    unreachable!("refused by PrintArgs::check")
}
