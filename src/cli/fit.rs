//! `snaprod fit SCENE DATA.csv --free PATH=FROM:TO ..`: least-squares fit of fields of a scene to measured data.

use super::check::{SceneArgs, text_of};
use super::files::{print, print_error, print_json};
use super::output::{Output, OutputArgs};
use super::progress::Tally;
use super::signals::{self, Signals};
use super::{Ending, Refusal};
use clap::Args;
use rayon::prelude::*;
use snaprod::plot::{self, FitFigure, FittedCurve};
use snaprod::scene::Units;
use snaprod::study::fit::SearchEnd;
use snaprod::study::{Data, Fit, FitRecord, Values, Vary};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct FitArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The data, CSV with a line of names: a column t and columns of the trajectory, or a row for each scene with
    /// quantities as `sweep --column` has them, or modes.angular_frequencies.0. Empty cells were not measured.
    #[arg(value_name = "DATA")]
    data: PathBuf,
    /// A field whose value is searched: PATH=FROM:TO or PATH=log:FROM:TO; may be repeated.
    #[arg(long, value_name = "PATH=RANGE", required = true)]
    free: Vec<String>,
    /// A column of the data that is a field of the scene, set row by row, as loads.force.0; may be repeated.
    #[arg(long, value_name = "COLUMN")]
    given: Vec<String>,
    /// The standard deviation of the noise of a column, as x=1e-3; without it the noise is estimated from the
    /// residuals. May be repeated.
    #[arg(long, value_name = "COLUMN=SIGMA")]
    noise: Vec<String>,
    /// Number of searches: the first starts from the middle of the ranges, the others from random places in them.
    #[arg(long, value_name = "N", default_value_t = 5)]
    starts: usize,
    /// Seed of the random starts.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    output: OutputArgs,
}

const FILES: &[&str] = &["fit.*", "curve.csv"];

/// Searches from all starts, on all cores, and reports the best result.
pub fn fit(args: &FitArgs) -> Result<Ending, Refusal> {
    let fit = planned(args)?;
    let directory = args.output.directory(&args.scene, "-fit");
    let out = Output::open(Some(&directory), FILES, args.output.figures)?;
    signals::watch();
    let starts = args.starts;
    let tally = Tally::new(starts, args.output.speaks());
    let searched: snaprod::Result<Vec<Option<SearchEnd>>> = (0..starts)
        .into_par_iter()
        .map(|k| {
            let found = fit.search(&fit.start(k, args.seed), &mut Signals);
            tally.count();
            found
        })
        .collect();
    tally.finish();
    let best = searched.and_then(|searched| {
        let found = searched.into_iter().flatten().collect();
        fit.best(found, starts, &mut Signals)
    });
    if signals::interrupted() {
        print_error("interrupted: the search did not finish, so there is no result");
        return Ok(Ending::Short);
    }
    let record = best?;
    let json = serde_json::to_string_pretty(&record.summary())
        .map_err(|e| Refusal(format!("fit.json: {e}")))?;
    out.write("fit.json", json.as_bytes())?;
    out.table(&record.table())?;
    if let Some(curve) = record.curve() {
        out.table(&curve)?;
    }
    out.figure("fit", || Ok(figure(&record)), plot::fit);
    out.finish(args.output.speaks())?;
    if args.output.json {
        print_json(record.summary());
    } else if args.output.speaks() {
        let mut text = report(&record);
        let _ = writeln!(text, "written to {}", directory.display());
        print(&text);
    }
    Ok(Ending::Done)
}

fn planned(args: &FitArgs) -> Result<Fit, Refusal> {
    let scene = args.scene.text()?;
    let data = Data::parse(&text_of(&args.data)?)
        .map_err(|e| Refusal(format!("{}: {e}", args.data.display())))?;
    let free: snaprod::Result<Vec<Vary>> = args.free.iter().map(|text| Vary::free(text)).collect();
    let noise: Result<Vec<(String, f64)>, Refusal> = args
        .noise
        .iter()
        .map(|text| {
            let parts = text.split_once('=');
            let noise =
                parts.and_then(|(name, x)| Some((name.trim().to_owned(), x.trim().parse().ok()?)));
            noise
                .ok_or_else(|| Refusal(format!("--noise {text}: write COLUMN=SIGMA, as in x=1e-3")))
        })
        .collect();
    if args.starts == 0 {
        return Err(Refusal(
            "--starts 0: how many searches, at least 1".to_owned(),
        ));
    }
    let set = args.scene.set.clone();
    Ok(Fit::new(scene, set, free?, data, &args.given, &noise?)?)
}

fn figure(record: &FitRecord) -> FitFigure {
    let along = &record.along;
    let curves = record.columns.iter().map(|one| FittedCurve {
        name: one.name.clone(),
        unit: one.unit.clone(),
        data: one.data.clone(),
        model: one.model.clone(),
        curve: one.curve.clone(),
    });
    FitFigure {
        title: String::new(),
        x_label: Units::label(&along.name, &along.unit),
        x: match &along.values {
            Values::Reals(x) => x.clone(),
            _ => Vec::new(),
        },
        between: record.between.clone(),
        curves: curves.collect(),
    }
}

/// The printed report. Writing to a string cannot fail.
fn report(record: &FitRecord) -> String {
    let mut text = String::new();
    for one in &record.parameters {
        let _ = write!(text, "{} = {:.8}", one.path, FixedDigits(one.value));
        if let (Some(error), Some([low, high])) = (one.standard_error, one.interval) {
            let _ = write!(
                text,
                ", standard error {:.2e}, 95 % between {:.6} and {:.6}",
                error,
                FixedDigits(low),
                FixedDigits(high)
            );
        }
        text.push('\n');
    }
    for one in &record.columns {
        let noise = if one.known { "given" } else { "estimated" };
        let _ = writeln!(
            text,
            "{}: {} values, rms residual {:.2e}, noise {:.2e} ({noise})",
            one.name,
            one.data.iter().filter(|x| !x.is_nan()).count(),
            one.rms,
            one.noise
        );
    }
    if let Some(square) = record.chi_squared {
        let _ = writeln!(
            text,
            "chi squared {square:.1} with {} degrees of freedom",
            record.freedom
        );
    }
    let [starts, agreeing, runs] = record.effort;
    let _ = writeln!(
        text,
        "{agreeing} of {starts} searches converged to this minimum; {runs} runs"
    );
    for remark in &record.remarks {
        let _ = writeln!(text, "remark: {remark}");
    }
    text
}

/// A number printed with a fixed number of digits in all, not of decimals.
struct FixedDigits(f64);

impl std::fmt::Display for FixedDigits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(6);
        let rounded = format!("{:.*e}", digits.saturating_sub(1), self.0);
        match rounded.parse::<f64>() {
            Ok(x) if x == 0.0 || (1e-4..1e6).contains(&x.abs()) => write!(f, "{x}"),
            Ok(x) => write!(f, "{x:e}"),
            Err(_) => f.write_str(&rounded),
        }
    }
}
