//! `snaprod elastica`: one equilibrium of the elastica.

use super::files::{number, pair, print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use snaprod::elastica::Equilibrium;
use snaprod::manifold::{Sheet, Sign};
use snaprod::study::{self, ElasticaRecord};
use std::fmt::Write;

#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct ElasticaArgs {
    /// lambda = sqrt(|force|) > 0.
    #[arg(long, requires = "modulus", conflicts_with_all = ["mode", "sign", "k", "beta"])]
    pub lambda: Option<f64>,
    /// kappa = sin((theta(1) - alpha)/2), in (-1, 1).
    #[arg(long, group = "modulus", requires = "lambda")]
    pub kappa: Option<f64>,
    /// p, kappa = tanh p: for taut and looped rods.
    #[arg(long, group = "modulus", requires = "lambda")]
    pub p: Option<f64>,
    /// Mode j of the sheet S_j^+-.
    #[arg(long, requires_all = ["sign", "k", "beta"])]
    pub mode: Option<u32>,
    /// Sign of the sheet, + or -.
    #[arg(long, requires = "mode", value_parser = ["+", "-"], allow_hyphen_values = true)]
    pub sign: Option<String>,
    /// k of AMV, in [0, 1).
    #[arg(long, requires = "mode")]
    pub k: Option<f64>,
    /// beta of AMV, in [-pi/2, pi/2].
    #[arg(long, requires = "mode")]
    pub beta: Option<f64>,
    /// Arclengths, in [0, 1], at which to describe the shape.
    #[arg(long, value_delimiter = ',', num_args = 1..)]
    pub s: Vec<f64>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Describes one equilibrium.
pub fn elastica(args: &ElasticaArgs) -> Result<Ending, Refusal> {
    let record = study::elastica(asked(args)?, &args.s)?;
    if args.json {
        print_json(record.summary())
    } else {
        print(&text(&record))
    }
    Ok(Ending::Done)
}

fn asked(args: &ElasticaArgs) -> Result<Equilibrium, Refusal> {
    Ok(match (args.lambda, args.kappa, args.p) {
        (Some(lambda), Some(kappa), _) => Equilibrium::from_lambda_kappa(lambda, kappa)?,
        (Some(lambda), None, Some(p)) => Equilibrium::from_lambda_p(lambda, p)?,
        _ => match (args.mode, args.sign.as_deref(), args.k, args.beta) {
            (Some(mode), Some(sign), Some(k), Some(beta)) => {
                let sign = if sign == "-" { Sign::Minus } else { Sign::Plus };
                Equilibrium::from_sheet(Sheet { mode, sign }, k, beta)?
            }
            _ => {
                return Err(Refusal(
                    "give --lambda with --kappa or --p, or --mode, --sign, --k and --beta"
                        .to_owned(),
                ));
            }
        },
    })
}

fn text(record: &ElasticaRecord) -> String {
    let e = &record.equilibrium;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15}{value}");
    };
    line(
        "sheet",
        format!(
            "{} (mode {}, sign {})",
            e.sheet,
            e.sheet.mode,
            e.sheet.sign.as_str()
        ),
    );
    line("lambda", number(e.lambda));
    line(
        "kappa",
        format!(
            "{}   (p = {}, kappa' = {})",
            number(e.kappa),
            number(e.p),
            number(e.kappa_c)
        ),
    );
    line("w", number(e.w));
    line("k, beta", pair(e.k, e.beta));
    line("alpha", number(e.alpha));
    line("theta(1)", number(e.theta1));
    line(
        "x, y",
        format!("{}   (1 - x = {})", pair(e.x, e.y), number(e.one_minus_x)),
    );
    line("energy", number(e.energy));
    line("force on mass", pair(e.force[0], e.force[1]));
    line(
        "index",
        if record.is_stable() {
            format!("{} (stable)", record.index)
        } else {
            format!("{} (unstable)", record.index)
        },
    );
    line(
        "fold distance",
        match record.fold_distance {
            Some(distance) => format!(
                "{} in lambda, to the first fold at this kappa",
                number(distance)
            ),
            None => "too large for double precision: hundreds in lambda".to_owned(),
        },
    );
    if !record.sections.is_empty() {
        line("s", "theta, theta', x, y".to_owned());
        for s in &record.sections {
            line(
                &number(s.s),
                format!("{}, {}", pair(s.theta, s.curvature), pair(s.x, s.y)),
            );
        }
    }
    text
}
