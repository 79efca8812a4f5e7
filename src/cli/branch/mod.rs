//! `snaprod branch SCENE`: a branch of equilibria in one parameter, with its figures.

mod figures;

use super::check::{SceneArgs, no_start, read_equilibrium};
use super::files::{exact, json_text, number, print, print_json};
use super::first_order::ByArgs;
use super::output::{Output, OutputArgs};
use super::page::{Page, PageKind, branch_data, scene_text};
use super::signals::Signals;
use super::{Ending, Refusal, wall};
use clap::Args;
use snaprod::plot::{branch_diagram, rod_shapes};
use snaprod::solve::special_points::SpecialKind;
use snaprod::study::{self, BranchRecord, Hooks, branch::CurveSet, branch::SpecialPoint};
use std::fmt::Write;

#[derive(Args)]
pub struct BranchArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub by: ByArgs,
    /// Write branch.html, a page that shows the shape at every point; it is one file and needs no network.
    #[arg(long)]
    pub html: bool,
}

/// Bound on the number of points with shapes on a page.
const PICTURES: usize = 240;

/// Hooks of the study: signals, and pictures for a page.
struct BranchHooks {
    signals: Signals,
    pictures: usize,
}

impl Hooks for BranchHooks {
    fn interrupted(&mut self) -> bool {
        self.signals.interrupted()
    }

    fn pictures(&mut self) -> usize {
        self.pictures
    }
}

/// Files of the command.
pub(super) const FILES: &[&str] = &[
    "branch.*",
    "special_points.json",
    "shapes.*",
    "fold_curve.*",
];

/// Follows the branch of the scene with all requested additions, and writes the results.
pub fn branch(args: &BranchArgs) -> Result<Ending, Refusal> {
    let scene = read_equilibrium(&args.scene)?;
    if scene.wall().is_some() {
        if !args.by.by.is_empty() {
            return Err(Refusal(format!("--by: {}", study::dispatch::WALL)));
        }
        return wall::branch(args, &scene);
    }
    let mut wishes = BranchHooks {
        signals: Signals::watched(),
        pictures: if args.html { PICTURES } else { 0 },
    };
    let by = args.by.fields(&args.scene)?;
    let record = study::branch::branch_by(&scene, &by, &mut wishes)
        .map_err(|e| no_start(&args.scene.path, &e))?;
    let summary = record.summary();
    let directory = args.output.directory(&args.scene, "");
    let out = Output::open(Some(&directory), FILES, args.output.figures)?;
    out.table(&record.branches.points)?;
    out.write("special_points.json", json_text(summary.clone()).as_bytes())?;
    out.figure("branch", || Ok(figures::diagram(&record)), branch_diagram);
    out.figure("shapes", || Ok(figures::shapes(&record)), rod_shapes);
    if let Some(folds) = &record.fold_curves
        && folds.curves.points.rows() > 0
    {
        out.table(&folds.curves.points)?;
        let curves = || Ok(figures::fold_curves(&record, folds));
        out.figure("fold_curve", curves, branch_diagram);
    }
    if args.html {
        out.page("branch", |figures| Ok(page(args, &record, figures)));
    }
    out.finish(args.output.speaks())?;
    if args.output.json {
        print_json(summary);
    } else if args.output.speaks() {
        let mut text = text(&record);
        let _ = writeln!(text, "written: {}", directory.display());
        print(&text);
    }
    Ok(if record.is_complete() {
        Ending::Done
    } else {
        Ending::Short
    })
}

fn page(args: &BranchArgs, record: &BranchRecord, mut figures: Vec<(String, String)>) -> Page {
    // The page draws the diagram itself.
    figures.retain(|(name, _)| name != "branch");
    Page {
        name: args.scene.name(),
        kind: PageKind::Branch,
        data: branch_data(record, figures::measure(record).1),
        words: text(record),
        events: Vec::new(),
        figures,
        scene: scene_text(&args.scene),
    }
}

fn text(record: &BranchRecord) -> String {
    let branches = &record.branches;
    let which = match branches.curves.len() {
        1 => "the branch".to_owned(),
        n => format!("{n} branches"),
    };
    let points = branches.points.rows();
    let mut text = String::new();
    // Lost branches come first.
    for lost in &record.lost {
        let _ = writeln!(text, "lost: {lost}");
    }
    let _ = writeln!(text, "{points} points of {which} in {}", record.name);
    found(&mut text, branches, record.conservative);
    if let Some(folds) = &record.fold_curves {
        let (points, first, second) = (folds.curves.points.rows(), &record.name, &folds.name);
        let _ = writeln!(text, "{points} points of fold curves in {first}, {second}");
        found(&mut text, &folds.curves, record.conservative);
    }
    if let Some(taken) = &record.taken {
        let _ = writeln!(text, "path: {}, because {}", taken.path.as_str(), taken.why);
    }
    let masses = record.masses.iter().map(|at| {
        let parameter = format!("{} = {}", record.name, exact(at.parameter));
        (parameter, at.mass.text(record.units))
    });
    // Mirror images have the same note, which is printed once.
    let mut told = Vec::new();
    for of in masses.filter(|(_, words)| !words.is_empty()) {
        if !told.contains(&of) {
            let _ = writeln!(text, "mass at {}: {}", of.0, of.1);
            told.push(of);
        }
    }
    for remark in &record.remarks {
        let _ = writeln!(text, "remark: {remark}");
    }
    text
}

/// Prints the special points and the ends of the curves.
fn found(text: &mut String, set: &CurveSet, conservative: bool) {
    for at in &set.specials {
        line(text, at, conservative);
    }
    for end in set.curves.iter().flat_map(|curve| &curve.ends) {
        let _ = writeln!(text, "end: {end}");
    }
}

fn line(text: &mut String, at: &SpecialPoint, conservative: bool) {
    let label = &at.label;
    // Without a potential of the loads the index does not decide stability.
    let kind = match (at.kind, conservative) {
        (SpecialKind::StabilityChange, false) => "index change".to_owned(),
        _ => at.kind_name(),
    };
    let _ = match at.second {
        Some(second) => write!(
            text,
            "{label:<5} {kind:<17} at {} +- {}, {} +- {}",
            exact(at.parameter),
            upward(at.first_precision.unwrap_or(f64::NAN)),
            exact(second),
            upward(at.precision)
        ),
        None => {
            let [before, after] = at
                .index
                .map(|i| i.map_or_else(|| "?".to_owned(), |i| i.to_string()));
            let bound = if at.precision.is_nan() {
                String::new()
            } else {
                format!(" +- {}", upward(at.precision))
            };
            let leaves = if at.out_of_plane {
                ", a branch point out of the plane"
            } else {
                ""
            };
            let on = at.contact.as_ref().map_or(String::new(), |contact| {
                let place = contact
                    .s
                    .map_or(String::new(), |s| format!(" at s = {}", number(s)));
                format!(" with {}{place}", contact.obstacle)
            });
            write!(
                text,
                "{label:<5} {kind:<17} at {}{bound}{on}, index {before} -> {after}{leaves}",
                exact(at.parameter),
            )
        }
    };
    let _ = match &at.doubt {
        Some(why) => writeln!(text, " (uncertain: {why})"),
        None => writeln!(text),
    };
    if let Some(fold) = &at.fold {
        let _ = writeln!(text, "      {}", fold.text());
    }
    for of in &at.derivatives {
        let (field, rate) = (&of.field, &of.rate);
        let _ = match rate {
            Ok(rate) => writeln!(
                text,
                "      derivative by {field}: {} +- {}",
                number(rate.value),
                upward(rate.error)
            ),
            Err(why) => writeln!(text, "      no derivative by {field}: {why}"),
        };
    }
}

/// A bound rounded up to one digit.
fn upward(bound: f64) -> String {
    let text = format!("{bound:.0e}");
    match text.parse() {
        Ok(shown) if bound <= shown => text,
        _ => format!("{:.0e}", 1.5 * bound),
    }
}
