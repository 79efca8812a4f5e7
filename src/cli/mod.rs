//! The command line: one module a command, no physics.
//!
//! Exit codes: 0 done, 1 the run ended short of what was asked (the reason is in the output), 2 bad input.

mod branch;
mod check;
mod equilibrium;
mod figures;
mod files;
mod folds;
mod memory;
mod progress;
mod query;
mod recorder;
mod run;
mod sheets;
mod table;
mod viscous;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Reduced-order dynamics of light rods that carry heavy bodies.
#[derive(Parser)]
#[command(name = "snaprod", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scene: trajectory, snaps, energy ledger, figures.
    Run(RunArgs),
    /// Describes one equilibrium of the elastica (length 1, bending stiffness 1).
    #[command(allow_negative_numbers = true)]
    Elastica(ElasticaArgs),
    /// Finds all equilibria with the end at a point.
    #[command(allow_negative_numbers = true)]
    Equilibria(EquilibriaArgs),
    /// Prints the fold curves as CSV, cusps marked.
    #[command(allow_negative_numbers = true)]
    Folds(FoldsArgs),
    /// Draws the solution sheets, the fold curves and the energies of stable equilibria.
    Sheets(SheetsArgs),
    /// Solves the statics of a rod in space: shape, wrench, strains, energy, index.
    Equilibrium(EquilibriumArgs),
    /// Follows a branch of equilibria in one parameter: special points, figures.
    Branch(BranchArgs),
    /// Describes small motions of a straight viscoelastic rod's end: spring, dashpot, memory kernel.
    #[command(allow_negative_numbers = true)]
    Memory(MemoryArgs),
    /// Checks a scene and reports every fault at once.
    Check(CheckArgs),
}

#[derive(Args)]
struct RunArgs {
    /// The scene, a TOML file.
    scene: PathBuf,
    /// Where to write; default out/<name of the scene>, or nothing with --json.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the summary with the events as one JSON object.
    #[arg(long)]
    json: bool,
    /// Print nothing but errors; no progress bar.
    #[arg(long)]
    quiet: bool,
    /// Write a PNG beside every figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
struct ElasticaArgs {
    /// lambda = sqrt(|force|) > 0.
    #[arg(long, requires = "modulus", conflicts_with_all = ["mode", "sign", "k", "beta"])]
    lambda: Option<f64>,
    /// kappa = sin((theta(1) - alpha)/2), in (-1, 1).
    #[arg(long, group = "modulus", requires = "lambda")]
    kappa: Option<f64>,
    /// p, kappa = tanh p: for taut and looped rods.
    #[arg(long, group = "modulus", requires = "lambda")]
    p: Option<f64>,
    /// Mode j of the sheet S_j^+-.
    #[arg(long, requires_all = ["sign", "k", "beta"])]
    mode: Option<u32>,
    /// Sign of the sheet, + or -.
    #[arg(long, requires = "mode", value_parser = ["+", "-"], allow_hyphen_values = true)]
    sign: Option<String>,
    /// The paper's k, in [0, 1).
    #[arg(long, requires = "mode")]
    k: Option<f64>,
    /// The paper's beta, in [-pi/2, pi/2].
    #[arg(long, requires = "mode")]
    beta: Option<f64>,
    /// Arclengths, in [0, 1], at which to describe the shape.
    #[arg(long, value_delimiter = ',', num_args = 1..)]
    s: Vec<f64>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct EquilibriaArgs {
    /// End position x,y (length 1).
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_point)]
    at: [f64; 2],
    /// Only equilibria with lambda below this, at most 60.
    #[arg(long, default_value_t = 14.0)]
    lambda_max: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct FoldsArgs {
    /// How many fold curves.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=20))]
    count: u8,
    /// Print one JSON object instead of CSV.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct SheetsArgs {
    /// Modes j, 0 to 3, of the sheets S_j^+- to draw.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0,1",
        allow_hyphen_values = true
    )]
    modes: Vec<String>,
    /// Where to write.
    #[arg(long, default_value = "figures")]
    out: PathBuf,
    /// Write a PNG beside every figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
    /// Print the list of files as one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct EquilibriumArgs {
    /// The scene, a TOML file with model = "cosserat".
    scene: PathBuf,
    /// Where to write shape.csv, equilibrium.json and equilibrium.svg; nothing is written without it.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write a PNG beside the figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct BranchArgs {
    /// The scene, a TOML file with model = "cosserat" and [continue].
    scene: PathBuf,
    /// Where to write branch.csv, special_points.json and figures; default out/<name of the scene>.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the special points as one JSON object.
    #[arg(long)]
    json: bool,
    /// Write a PNG beside every figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
}

#[derive(Args)]
struct MemoryArgs {
    /// The scene, a TOML file with damping.
    scene: PathBuf,
    /// First time, in the scene's unit; default a decade before the first relaxation.
    #[arg(long)]
    from: Option<f64>,
    /// Last time; default a decade after the last relaxation.
    #[arg(long)]
    to: Option<f64>,
    /// How many times, logarithmically spaced, from 2 to 100000.
    #[arg(long, default_value_t = 201)]
    points: usize,
    /// Where to write kernel.csv, memory.json and kernel.svg; nothing is written without it.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write a PNG beside the figure (needs the feature `png`).
    #[arg(long)]
    png: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct CheckArgs {
    /// The scene, a TOML file.
    scene: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<_> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.as_slice() {
        [Ok(x), Ok(y)] => Ok([*x, *y]),
        _ => Err("write two numbers with a comma between them, as in 0.5,-0.2".to_owned()),
    }
}

/// How a command ended.
enum Ending {
    /// All that was asked.
    Done,
    /// The run ended short of it.
    Short,
}

/// A command that could not be carried out; the text goes to stderr.
struct Refusal(String);

impl From<snaprod::Error> for Refusal {
    fn from(e: snaprod::Error) -> Self {
        Self(e.to_string())
    }
}

/// Parses the command line and carries it out.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version are no errors; clap knows which stream is whose.
            let code = if e.use_stderr() { 2 } else { 0 };
            let _ = e.print();
            return ExitCode::from(code);
        }
    };
    let ending = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Elastica(args) => query::elastica(args),
        Command::Equilibria(args) => query::equilibria(args),
        Command::Folds(args) => folds::folds(args),
        Command::Sheets(args) => sheets::sheets(args),
        Command::Equilibrium(args) => equilibrium::equilibrium(args),
        Command::Branch(args) => branch::branch(args),
        Command::Memory(args) => memory::memory(args),
        Command::Check(args) => check::check(args),
    };
    match ending {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Short) => ExitCode::from(1),
        Err(Refusal(why)) => {
            files::print_error(&format!("error: {why}"));
            ExitCode::from(2)
        }
    }
}
