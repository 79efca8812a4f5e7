//! `snaprod sheets`: the figures of the elastica's solution sheets.

pub mod figures;

use super::files::{print, print_json};
use super::output::{FigureArgs, Output, PrintArgs};
use super::page::{Page, PageKind, sheets_data};
use super::signals::Signals;
use super::{Ending, Refusal};
use clap::Args;
use serde_json::json;
use snaprod::plot::{
    energy_landscape, fold_map, phase_portrait, sheets_lambda_alpha, sheets_over_disc,
};
use snaprod::study;
use std::path::PathBuf;

#[derive(Args)]
pub struct SheetsArgs {
    /// Modes j, 0 to 3, of the sheets S_j^+- to draw.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0,1",
        allow_hyphen_values = true
    )]
    pub modes: Vec<String>,
    /// Output directory.
    #[arg(long, default_value = "out/sheets")]
    pub out: PathBuf,
    /// Write sheets.html, a page whose sheets can be turned and show the rod at every node; it is one file and needs
    /// no network.
    #[arg(long)]
    pub html: bool,
    #[command(flatten)]
    pub print: PrintArgs,
    /// Print the list of files as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Modes that can be drawn.
const MODES: std::ops::RangeInclusive<u32> = 0..=3;
/// Files of the command.
const FILES: &[&str] = &[
    "phase_portrait.*",
    "sheets_lambda_alpha.*",
    "sheets_over_disc.*",
    "fold_map.*",
    "energy_landscape.*",
    "sheets.html",
];
/// Number of figures among the files.
const FIGURES: usize = FILES.len() - 1;

/// Writes the figures.
pub fn sheets(args: &SheetsArgs) -> Result<Ending, Refusal> {
    let modes = asked_modes(&args.modes)?;
    let figures = FigureArgs {
        print: args.print,
        ..FigureArgs::default()
    };
    let out = Output::open(Some(&args.out), FILES, figures)?;
    let record = study::sheets(&modes, &mut Signals::watched())?;
    out.figure(
        "phase_portrait",
        || Ok(figures::portrait(&modes)),
        phase_portrait,
    );
    if !record.over_load.is_empty() {
        let panels = || Ok(figures::over_load(&record));
        out.figure("sheets_lambda_alpha", panels, |panels, paper| {
            sheets_lambda_alpha(panels, paper)
        });
    }
    if !record.over_disc.is_empty() {
        let panels = || Ok(figures::over_disc(&record));
        out.figure("sheets_over_disc", panels, |panels, paper| {
            sheets_over_disc(panels, paper)
        });
    }
    if let Some(stable) = &record.stable {
        let map = || Ok(figures::map(stable, &record.folds));
        out.figure("fold_map", map, fold_map);
        let landscape = || Ok(figures::landscape(stable, &record.folds));
        out.figure("energy_landscape", landscape, energy_landscape);
    }
    if args.html {
        out.page("sheets", |figures| {
            if record.interrupted {
                return Err(Refusal("it was interrupted".to_owned()));
            }
            Ok(Page {
                name: "sheets".to_owned(),
                kind: PageKind::Sheets,
                data: sheets_data(&record)?,
                words: String::new(),
                events: Vec::new(),
                figures,
                scene: String::new(),
            })
        });
    }
    let files = out.finish(!args.json)?;
    if args.json {
        print_json(json!({ "out": args.out, "files": files }));
    } else {
        for file in &files {
            print(&format!("{}\n", args.out.join(file).display()));
        }
    }
    Ok(if files.len() < FIGURES {
        Ending::Short
    } else {
        Ending::Done
    })
}

fn asked_modes(texts: &[String]) -> Result<Vec<u32>, Refusal> {
    let mut modes = Vec::new();
    for text in texts {
        match text.trim().parse() {
            Ok(mode) if MODES.contains(&mode) => modes.push(mode),
            _ => {
                return Err(Refusal(format!(
                    "--modes: {text:?} is no mode that can be drawn; give some of 0, 1, 2, 3, separated by commas"
                )));
            }
        }
    }
    modes.sort_unstable();
    modes.dedup();
    Ok(modes)
}
