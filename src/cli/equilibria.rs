//! `snaprod equilibria`: all equilibria of the elastica with the end at a point.

use super::files::{number, pair, print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use snaprod::study::{self, EquilibriaRecord};
use std::fmt::Write;

#[derive(Args)]
pub struct EquilibriaArgs {
    /// End position x,y (length 1).
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_point)]
    pub at: [f64; 2],
    /// Only equilibria with lambda below this, at most 60.
    #[arg(long, default_value_t = 14.0)]
    pub lambda_max: f64,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<_> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.as_slice() {
        [Ok(x), Ok(y)] => Ok([*x, *y]),
        _ => Err("write two numbers with a comma between them, as in 0.5,-0.2".to_owned()),
    }
}

/// Lists all equilibria at a point.
pub fn equilibria(args: &EquilibriaArgs) -> Result<Ending, Refusal> {
    let record = study::equilibria(args.at, args.lambda_max)?;
    if args.json {
        print_json(record.summary())
    } else {
        print(&text(&record))
    }
    Ok(Ending::Done)
}

fn text(record: &EquilibriaRecord) -> String {
    if let Some(note) = record.note {
        return format!("at (1, 0) {note}\n");
    }
    let mut text = format!(
        "{} with the end at ({}) and lambda < {}\n",
        match record.found.len() {
            0 => "no equilibrium".to_owned(),
            1 => "one equilibrium".to_owned(),
            n => format!("{n} equilibria"),
        },
        pair(record.at[0], record.at[1]),
        number(record.lambda_max)
    );
    if record.found.is_empty() {
        text.push_str("near full reach lambda is larger: try --lambda-max 60, or `snaprod elastica` with --lambda and --p\n");
    } else {
        let _ = writeln!(
            text,
            "{:>6} {:>14} {:>14} {:>12} {:>12} {:>14} {:>5}",
            "sheet", "lambda", "p", "alpha", "theta(1)", "energy", "index"
        );
    }
    for f in &record.found {
        let e = &f.equilibrium;
        let _ = writeln!(
            text,
            "{:>6} {:>14.9} {:>14.9} {:>12.8} {:>12.8} {:>14.9} {:>5}{}",
            e.sheet.to_string(),
            e.lambda,
            e.p,
            e.alpha,
            e.theta1,
            e.energy,
            f.index,
            if f.degenerate {
                "  at a fold (double)"
            } else if f.stable() {
                "  stable"
            } else {
                ""
            }
        );
    }
    text
}
