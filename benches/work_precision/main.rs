//! Error against work of every model and of the alternatives that others would use:
//! `cargo bench --bench work_precision`.
//!
//! Parts are chosen by `-- models`, `-- motions` (the elastic planar rod alone), `-- ledger`, `-- mass`.
//!
//! `models` prints the table of docs/benchmarks.md and draws figures/work_precision_plane.svg, _motions.svg and
//! _statics.svg. Each problem is run at a row of tolerances (cells, nodes) and its end compared with an independent
//! computation, if one exists. The peers are the scripts of tools/peers; peers that cannot run on this machine are
//! named and left out.

#[allow(dead_code)]
#[path = "../../tests/suite/support.rs"]
mod support;

mod bars;
mod ledger;
mod peers;
mod problems;
mod statics;

use peers::Point;
use problems::Problem;
use snaprod::plot::{self, LineStyle, Lines, Paper, Series};
use std::time::{Duration, Instant};

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let parts: [(&str, fn()); 4] = [
        ("models", models),
        ("motions", motions),
        ("ledger", ledger::ledgers),
        ("mass", ledger::masses),
    ];
    // The motions are among the models.
    let named = |name: &str| asked.iter().any(|word| word == name);
    let some = parts.iter().any(|(name, _)| named(name));
    for (name, part) in parts {
        if named(name) || (!some && name != "motions") {
            part();
            println!();
        }
    }
    if let Some(peak) = peak_memory() {
        println!("peak memory of this process: {peak:.1} MB");
    }
}

fn motions() {
    compare(&problems::planar());
}

fn models() {
    let figures = problems::all();
    let ends = figures.each_ref().map(|(_, problems)| problems.len());
    let (names, problems): (Vec<_>, Vec<_>) = figures.into_iter().unzip();
    let problems: Vec<Problem> = problems.into_iter().flatten().collect();
    let curves = compare(&problems);
    let mut first = 0;
    for (name, count) in names.into_iter().zip(ends) {
        let shown = first..first + count;
        let error = match name {
            "statics" => "error of the end: place (ℓ) or directors",
            _ => "error at the end (ℓ, or ℓ per unit of time)",
        };
        let curves = curves.iter();
        let drawn = figure(curves.filter(|curve| shown.contains(&curve.problem)), error);
        let path = format!(
            "{}/../figures/work_precision_{name}.svg",
            env!("CARGO_MANIFEST_DIR")
        );
        let drawn = plot::lines(&drawn, &Paper::SCREEN).expect("a figure");
        std::fs::write(path, drawn).expect("the directory figures");
        first = shown.end;
    }
}

/// The points of a model on a problem, or of a peer.
struct Curve {
    title: String,
    /// Index of the problem.
    problem: usize,
    peer: bool,
    points: Vec<Point>,
}

impl Curve {
    fn row(&self, point: &Point) -> String {
        let (work, each) = match point.work {
            Some(work) => (work.to_string(), digits(1e3 * point.ms / work as f64)),
            None => Default::default(),
        };
        let Point {
            setting, error, ms, ..
        } = point;
        format!(
            "| {} | {setting} | {error:.1e} | {work} | {} | {each} |",
            self.title,
            digits(*ms)
        )
    }

    /// The order p of error ~ work^-p: slope of a straight line through the logarithms of errors above the reference's
    /// own.
    fn order(&self, floor: f64) -> Option<f64> {
        let told = |p: &&Point| (10.0 * floor..1e-2).contains(&p.error);
        let points = self.points.iter().filter(told);
        let points = points.filter_map(|p| Some([(p.work? as f64).ln(), p.error.ln()]));
        let points: Vec<[f64; 2]> = points.collect();
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
        let slope = mean(&|p| (p[0] - x) * (p[1] - y)) / mean(&|p| (p[0] - x).powi(2));
        (n >= 3.0).then_some(-slope)
    }

    /// Milliseconds of the cheapest run with at most this error.
    fn cheapest(&self, error: f64) -> Option<f64> {
        let good = self.points.iter().filter(|p| p.error <= error);
        good.map(|p| p.ms).min_by(f64::total_cmp)
    }
}

/// Runs the models and their peers, and prints the two tables.
fn compare(problems: &[Problem]) -> Vec<Curve> {
    let models = problems.iter().enumerate().map(|(i, problem)| Curve {
        title: problem.title.to_owned(),
        problem: i,
        peer: false,
        points: (problem.settings.iter())
            .map(|setting| measured(problem, *setting))
            .collect(),
    });
    let mut curves: Vec<Curve> = models.collect();
    let mut skipped = Vec::new();
    for peer in peers::ALL {
        match peer.run(problems) {
            Ok(found) => curves.extend(found.into_iter().map(|(title, problem, points)| Curve {
                title,
                problem,
                peer: true,
                points,
            })),
            Err(why) => skipped.push(format!("{} skipped: {why}", peer.name)),
        }
    }
    // Peers stand below the model of the same problem.
    curves.sort_by_key(|curve| curve.problem);
    let head = [
        "tolerance, cells or nodes",
        "error at the end",
        "right-hand sides",
        "ms",
        "us each",
    ];
    print_head(&head);
    for curve in &curves {
        for point in &curve.points {
            println!("{}", curve.row(point));
        }
    }
    println!();
    print_head(&["reference", "order", "ms for 1e-3", "for 1e-6", "for 1e-9"]);
    for curve in &curves {
        println!("{}", summary(curve, &problems[curve.problem]));
    }
    println!();
    for line in skipped {
        println!("{line}");
    }
    curves
}

fn print_head(columns: &[&str]) {
    println!("| model and problem | {} |", columns.join(" | "));
    println!("| --- |{}", " --- |".repeat(columns.len()));
}

/// The best time of several runs: other load of the machine can only add.
fn measured(problem: &Problem, setting: problems::Setting) -> Point {
    const ENOUGH: Duration = Duration::from_millis(300);
    let begun = Instant::now();
    let first = problem.run(setting);
    let (mut ms, mut runs) = (first.ms, 1);
    while runs < 3 || (begun.elapsed() < ENOUGH && runs < 50) {
        ms = ms.min(problem.run(setting).ms);
        runs += 1;
    }
    Point {
        setting: setting.to_string(),
        error: problem.error(&first),
        work: first.work,
        ms,
    }
}

/// Line of text on a curve: reference, order, and time for given errors.
fn summary(curve: &Curve, problem: &Problem) -> String {
    let order = curve
        .order(problem.floor)
        .map_or(String::new(), |order| format!("{order:.1}"));
    let cost = |error: f64| curve.cheapest(error).map_or(String::new(), digits);
    let [coarse, middle, fine] = [1e-3, 1e-6, 1e-9].map(cost);
    format!(
        "| {} | {} | {order} | {coarse} | {middle} | {fine} |",
        curve.title, problem.source
    )
}

/// A number with three digits.
fn digits(x: f64) -> String {
    format!("{x:.*}", (2 - x.log10().floor() as i32).max(0) as usize)
}

/// Figure `name` of errors against time; peers dashed.
fn figure<'a>(curves: impl Iterator<Item = &'a Curve>, error: &str) -> Lines {
    let series = curves.map(|curve| Series {
        name: curve.title.clone(),
        x: curve.points.iter().map(|p| p.ms).collect(),
        y: curve.points.iter().map(|p| p.error).collect(),
        trace: if curve.peer {
            LineStyle::DashedMarks
        } else {
            LineStyle::LineMarks
        },
        ..Series::default()
    });
    Lines {
        x_label: "time on one core (ms)".into(),
        y_label: error.into(),
        x_log: true,
        y_log: true,
        series: series.collect(),
        ..Lines::default()
    }
}

/// Largest resident set so far, in MB, if the system reports the value.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM"))?;
    let kb = line.split_whitespace().nth(1)?.parse::<f64>().ok()?;
    Some(kb / 1024.0)
}
