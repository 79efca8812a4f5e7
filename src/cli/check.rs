//! `snaprod check SCENE`: the faults of a scene; the scene argument of all commands.

use super::files::{print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::json;
use snaprod::scene::{Faults, ReadError, Scene};
use snaprod::study::dispatch;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct CheckArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// The scene argument of a command.
#[derive(Args)]
pub struct SceneArgs {
    /// The scene, a TOML file.
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Replace or add a field of the scene, as in --set rod.damping=0.2; may be repeated.
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,
}

impl SceneArgs {
    /// The scene, or all its faults.
    pub fn read(&self) -> Result<Scene, ReadError> {
        let set: Vec<&str> = self.set.iter().map(String::as_str).collect();
        Scene::read_with(&self.path, &set)
    }

    /// Default directory without --out: out/<name of the scene>.
    pub fn directory(&self) -> PathBuf {
        Path::new("out").join(self.path.file_stem().unwrap_or_default())
    }
}

/// Reads a scene of motion, or refuses with all its faults.
pub fn read(given: &SceneArgs) -> Result<Scene, Refusal> {
    let scene = given.read().map_err(refuse)?;
    if !scene.is_bar() {
        scene.run().map_err(|e| no_start(&given.path, &e))?;
    }
    Ok(scene)
}

/// Reads a scene of motion or an assembly (in motion or statics), or refuses with all its faults.
pub fn read_modes(given: &SceneArgs) -> Result<Scene, Refusal> {
    let scene = given.read().map_err(refuse)?;
    if !scene.is_assembly() {
        scene.run().map_err(|e| no_start(&given.path, &e))?;
    }
    Ok(scene)
}

/// Reads a scene of statics or an assembly (in motion or statics), or refuses with all its faults.
pub fn read_equilibrium(given: &SceneArgs) -> Result<Scene, Refusal> {
    let scene = given.read().map_err(refuse)?;
    if !scene.is_assembly() {
        scene.end().map_err(|e| no_start(&given.path, &e))?;
    }
    Ok(scene)
}

pub fn refuse(e: ReadError) -> Refusal {
    match e {
        ReadError::Scene { file, faults } => report(&file, &faults),
        ReadError::File(e) => Refusal(e.to_string()),
    }
}

fn report(file: &str, faults: &Faults) -> Refusal {
    let count = match faults.count() {
        1 => "one fault".to_owned(),
        n => format!("{n} faults"),
    };
    Refusal(format!("{count} in the scene\n{}", faults.in_file(file)))
}

/// Refusal of a scene that cannot start.
pub fn no_start(path: &Path, e: &snaprod::Error) -> Refusal {
    Refusal(format!("{}: {e}", path.display()))
}

/// Reports every fault of the scene. A scene without faults is also set up, so that a start without equilibrium is
/// found here and not in the run.
pub fn check(args: &CheckArgs) -> Result<Ending, Refusal> {
    let file = args.scene.path.display().to_string();
    match args.scene.read() {
        Ok(scene) => match dispatch::check(&scene) {
            Ok(mass) => {
                if args.json {
                    let mass = mass.map(|mass| mass.json());
                    print_json(json!({ "scene": file, "valid": true, "faults": [], "mass": mass }));
                } else {
                    print(&format!("{file}: no faults\n"));
                    if let Some(mass) = mass {
                        print(&format!("{}\n", mass.text(scene.units)));
                    }
                }
                Ok(Ending::Done)
            }
            Err(e) => {
                if args.json {
                    print_json(
                        json!({ "scene": file, "valid": false, "faults": [], "start": e.to_string() }),
                    );
                }
                Err(no_start(&args.scene.path, &e))
            }
        },
        Err(ReadError::Scene { faults, .. }) => {
            if args.json {
                print_json(json!({ "scene": file, "valid": false, "faults": faults }));
            }
            Err(report(&file, &faults))
        }
        Err(ReadError::File(e)) => Err(Refusal(e.to_string())),
    }
}
