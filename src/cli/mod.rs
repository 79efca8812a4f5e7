//! The command line: one module per command, no physics.
//!
//! Exit codes: 0 done, 1 the run ended short of what was asked (the reason is in the output), 2 bad input.

mod assembly_equilibrium;
mod bar;
mod branch;
mod check;
mod elastica;
mod equilibria;
mod equilibrium;
mod files;
mod first_order;
mod fit;
mod flow;
mod folds;
mod inflation;
mod memory;
mod modes;
mod new;
mod output;
mod page;
mod plan;
mod progress;
mod rod_figures;
mod run;
mod run_figures;
mod run_film;
mod run_page;
mod run_text;
mod sheets;
mod signals;
mod sweep;
mod sweep_map;
mod wall;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use snaprod::math::registers::Width;
use std::io::Write;
use std::process::ExitCode;

/// Exit codes, as `--help` prints them.
const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  the command ended short of what was asked; the reason is on standard error
  2  bad input; nothing was computed";

/// Commands by subject, as `--help` lists them.
const GROUPS: &[(&str, &[&str])] = &[
    ("Motion", &["run", "plan", "modes"]),
    (
        "Equilibria",
        &["equilibrium", "equilibria", "branch", "memory"],
    ),
    ("Many scenes", &["sweep", "fit"]),
    (
        "The elastica of length 1 and bending stiffness 1",
        &["elastica", "folds", "sheets"],
    ),
    ("Scenes", &["check", "new", "schema"]),
    ("The program", &["completions", "man", "help"]),
];

/// Reduced-order dynamics of light rods that carry heavy bodies.
#[derive(Parser)]
#[command(name = "snaprod", version, about, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print all digits of numbers; by default six. Tables and JSON always have all digits.
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scene: trajectory, snaps, energy ledger, figures.
    Run(run::RunArgs),
    /// Describes one equilibrium of the elastica (length 1, bending stiffness 1).
    #[command(allow_negative_numbers = true)]
    Elastica(elastica::ElasticaArgs),
    /// Finds all equilibria of a scene of statics, or of the elastica with the end at a point.
    #[command(allow_negative_numbers = true)]
    Equilibria(equilibria::EquilibriaArgs),
    /// Prints the fold curves as CSV, cusps marked.
    #[command(allow_negative_numbers = true)]
    Folds(folds::FoldsArgs),
    /// Draws the solution sheets, the fold curves and the energies of stable equilibria.
    Sheets(sheets::SheetsArgs),
    /// Solves the statics of a rod in space: shape, wrench, strains, energy, index.
    Equilibrium(equilibrium::EquilibriumArgs),
    /// Follows a branch of equilibria in one parameter: special points, figures.
    Branch(branch::BranchArgs),
    /// Describes small motions of a straight viscoelastic rod's end: spring, dashpot, memory kernel.
    #[command(allow_negative_numbers = true)]
    Memory(memory::MemoryArgs),
    /// Runs a scene over a grid of its fields, or at random points, on all cores: a table, and a map of the outcomes.
    #[command(allow_negative_numbers = true)]
    Sweep(sweep::SweepArgs),
    /// Fits the values of fields of a scene to measured data.
    Fit(fit::FitArgs),
    /// Natural frequencies and mode shapes about the equilibrium of a scene of motion.
    Modes(modes::ModesArgs),
    /// Contents of a run: computed quantities, omissions with reasons, cost.
    #[command(allow_negative_numbers = true)]
    Plan(plan::PlanArgs),
    /// Checks a scene and reports every fault at once.
    Check(check::CheckArgs),
    /// Writes a commented scene to start from.
    New(new::NewArgs),
    /// Prints all fields of scenes: a JSON Schema for editors, or their reference.
    Schema(new::SchemaArgs),
    /// Prints completions for a shell.
    Completions(new::CompletionArgs),
    /// Prints the manual for man: `snaprod man | man -l -`.
    Man,
}

/// The command line, with its commands listed by [`GROUPS`]; commands of no group come last.
fn command() -> clap::Command {
    let mut whole = Cli::command();
    whole.build();
    let head = whole.get_styles().get_header();
    let literal = whole.get_styles().get_literal();
    let mut list = String::new();
    let mut section = |subject: &str, commands: &[&clap::Command]| {
        if !commands.is_empty() {
            list += &format!("{head}{subject}:{head:#}\n");
        }
        for command in commands {
            let about = command.get_about().map(ToString::to_string);
            let (name, about) = (command.get_name(), about.unwrap_or_default());
            list += &format!("  {literal}{name:<12}{literal:#} {about}\n");
        }
        list += if commands.is_empty() { "" } else { "\n" };
    };
    for (subject, names) in GROUPS {
        let commands: Vec<_> = names
            .iter()
            .filter_map(|name| whole.find_subcommand(name))
            .collect();
        section(subject, &commands);
    }
    let is_grouped = |name: &str| GROUPS.iter().any(|(_, names)| names.contains(&name));
    let others: Vec<_> = whole
        .get_subcommands()
        .filter(|c| !is_grouped(c.get_name()))
        .collect();
    section("Others", &others);
    let template = format!(
        "{{about}}\n\n{{usage-heading}} {{usage}}\n\n{list}{head}Options:{head:#}\n{{options}}{{after-help}}"
    );
    Cli::command().help_template(template)
}

/// Completion of a command.
enum Ending {
    /// The command completed its task.
    Done,
    /// The run ended short of its goal.
    Short,
}

/// Refusal of a command, with the message for stderr.
struct Refusal(String);

impl From<snaprod::Error> for Refusal {
    fn from(e: snaprod::Error) -> Self {
        Self(e.to_string())
    }
}

/// Parses the command line and runs the command.
pub fn main() -> ExitCode {
    ExitCode::from(main_of(std::env::args_os()))
}

/// Parses these words, the first of them the name of the program, and runs the command. Returns the exit code.
pub fn main_of(words: impl IntoIterator<Item = std::ffi::OsString>) -> u8 {
    let parsed = command().try_get_matches_from(words);
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version are no errors; clap chooses the stream.
            let code = if e.use_stderr() { 2 } else { 0 };
            files::survive(e.print().and_then(|()| std::io::stdout().flush()));
            return code;
        }
    };
    files::print_all_digits(cli.verbose);
    let ending = match Width::from_environment() {
        Ok(_) => obey(&cli.command),
        Err(why) => Err(why.into()),
    };
    match ending {
        Ok(Ending::Done) => 0,
        Ok(Ending::Short) => 1,
        Err(Refusal(why)) => {
            files::print_refusal(&why);
            2
        }
    }
}

/// Runs a command.
fn obey(command: &Command) -> Result<Ending, Refusal> {
    match command {
        Command::Run(args) => run::run(args),
        Command::Elastica(args) => elastica::elastica(args),
        Command::Equilibria(args) => equilibria::equilibria(args),
        Command::Folds(args) => folds::folds(args),
        Command::Sheets(args) => sheets::sheets(args),
        Command::Equilibrium(args) => equilibrium::equilibrium(args),
        Command::Branch(args) => branch::branch(args),
        Command::Memory(args) => memory::memory(args),
        Command::Sweep(args) => sweep::sweep(args),
        Command::Fit(args) => fit::fit(args),
        Command::Modes(args) => modes::modes(args),
        Command::Plan(args) => plan::plan(args),
        Command::Check(args) => check::check(args),
        Command::New(args) => new::new(args),
        Command::Schema(args) => new::schema(args),
        Command::Completions(args) => new::completions(args),
        Command::Man => new::man(),
    }
}
