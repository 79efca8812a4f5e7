//! `snaprod new`, `schema`, `completions`, `man`: templates of scenes, and files for editors, shells and `man`.

use super::files::{print, print_json};
use super::{Cli, Ending, Refusal};
use clap::{Args, CommandFactory, ValueEnum};
use clap_complete::Shell;
use snaprod::scene;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

/// Templates of scenes, with every line explained.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Template {
    /// A steel strip with a mass at its end, let go
    Strip,
    /// A strip that snaps and throws its mass
    Catapult,
    /// A soft arm in space that sags and swings
    SiliconeArm,
    /// A buckled strip that is pushed over
    BuckledStrip,
    /// A branch of equilibria with its folds
    Branch,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Self::Strip => include_str!("templates/strip.toml"),
            Self::Catapult => include_str!("templates/catapult.toml"),
            Self::SiliconeArm => include_str!("templates/silicone-arm.toml"),
            Self::BuckledStrip => include_str!("templates/buckled-strip.toml"),
            Self::Branch => include_str!("templates/branch.toml"),
        }
    }
}

#[derive(Args)]
pub struct NewArgs {
    /// The template.
    name: Template,
    /// File to write, which must not exist yet; default standard output.
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Args)]
pub struct SchemaArgs {
    /// The reference of all fields, docs/scene.md, instead of a JSON Schema.
    #[arg(long)]
    markdown: bool,
}

#[derive(Args)]
pub struct CompletionArgs {
    /// The shell.
    shell: Shell,
}

/// Writes a commented scene.
pub fn new(args: &NewArgs) -> Result<Ending, Refusal> {
    let text = args.name.text();
    let Some(path) = &args.out else {
        print(text);
        return Ok(Ending::Done);
    };
    let written = File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|e| {
        Refusal(match e.kind() {
            ErrorKind::AlreadyExists => format!(
                "{} exists already; choose another file with --out",
                path.display()
            ),
            _ => format!("cannot write {}: {e}", path.display()),
        })
    })?;
    print(&format!("{}\n", path.display()));
    Ok(Ending::Done)
}

/// Prints the fields of scenes.
pub fn schema(args: &SchemaArgs) -> Result<Ending, Refusal> {
    if args.markdown {
        print(&scene::reference())
    } else {
        print_json(scene::json_schema())
    }
    Ok(Ending::Done)
}

/// Prints the completions of a shell.
pub fn completions(args: &CompletionArgs) -> Result<Ending, Refusal> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "snaprod", &mut text);
    print(&String::from_utf8_lossy(&text));
    Ok(Ending::Done)
}

/// Prints the manual, one page for the program and one for each of its commands, in roff.
pub fn man() -> Result<Ending, Refusal> {
    let mut command = Cli::command();
    command.build();
    let mut text = Vec::new();
    let commands = command.get_subcommands().filter(|c| c.get_name() != "help");
    for page in std::iter::once(&command).chain(commands) {
        clap_mangen::Man::new(page.clone())
            .render(&mut text)
            .map_err(|e| Refusal(format!("cannot write the manual: {e}")))?;
    }
    print(&String::from_utf8_lossy(&text));
    Ok(Ending::Done)
}
