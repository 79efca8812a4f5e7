//! `snaprod check SCENE..`: the faults of scenes; the scene argument of all commands.

use super::files::{print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use serde_json::{Value, json};
use snaprod::scene::{Faults, ReadError, Scene, SceneText};
use snaprod::study::dispatch;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

#[derive(Args)]
pub struct CheckArgs {
    /// The scenes, TOML files; - is standard input.
    #[arg(value_name = "SCENE", required = true)]
    paths: Vec<PathBuf>,
    /// Replace or add a field of every scene, as in --set rod.damping=0.2; may be repeated.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Print one JSON object for each scene; one line for each of several scenes.
    #[arg(long)]
    json: bool,
}

/// The scene argument of a command.
#[derive(Args)]
pub struct SceneArgs {
    /// The scene, a TOML file; - is standard input.
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
        if is_standard_input(&self.path) {
            let text = standard_input()
                .map_err(|e| ReadError::File(snaprod::Error::domain(e.to_string())))?;
            return Scene::read_from(STDIN, &mut text.as_bytes(), &set);
        }
        Scene::read_with(&self.path, &set)
    }

    /// The text of the scene with its overrides.
    pub fn with_overrides(&self) -> Result<SceneText, Refusal> {
        let text = SceneText::new(self.text()?, &self.set);
        Ok(match self.path.parent() {
            Some(directory) if !is_standard_input(&self.path) => text.in_directory(directory),
            _ => text,
        })
    }

    /// Text of the scene, without the overrides.
    pub fn text(&self) -> Result<String, Refusal> {
        text_of(&self.path)
    }

    /// The name of the scene's file without its ending; "stdin" for standard input.
    pub fn name(&self) -> String {
        if is_standard_input(&self.path) {
            return "stdin".to_owned();
        }
        let stem = self.path.file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Default directory without --out: out/<name of the scene>.
    pub fn directory(&self) -> PathBuf {
        Path::new("out").join(self.name())
    }
}

/// Name of standard input in messages.
const STDIN: &str = "standard input";

fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The text of standard input, which can be read only once.
fn standard_input() -> std::io::Result<&'static str> {
    static TEXT: OnceLock<String> = OnceLock::new();
    if TEXT.get().is_none() {
        let text = std::io::read_to_string(std::io::stdin())?;
        let _ = TEXT.set(text);
    }
    Ok(TEXT.get().map_or("", String::as_str))
}

/// The text of a file; - is standard input.
pub fn text_of(path: &Path) -> Result<String, Refusal> {
    let text = if is_standard_input(path) {
        standard_input().map(str::to_owned)
    } else {
        std::fs::read_to_string(path)
    };
    text.map_err(|e| Refusal(format!("cannot read {}: {e}", shown(path))))
}

/// A path in messages.
pub fn shown(path: &Path) -> String {
    if is_standard_input(path) {
        STDIN.to_owned()
    } else {
        path.display().to_string()
    }
}

/// Reads a scene of motion, or refuses with all its faults.
pub fn read(given: &SceneArgs) -> Result<Scene, Refusal> {
    let scene = given.read().map_err(refuse)?;
    if !scene.is_medium() {
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
    if !scene.is_assembly() && scene.wall().is_none() {
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
    Refusal(format!("{}: {e}", shown(path)))
}

/// Reports every fault of every scene.
pub fn check(args: &CheckArgs) -> Result<Ending, Refusal> {
    let mut refused = Vec::new();
    for path in &args.paths {
        let verdict = Verdict::on(&SceneArgs {
            path: path.clone(),
            set: args.set.clone(),
        });
        match (args.json, args.paths.len()) {
            (true, 1) => print_json(verdict.json),
            (true, _) => print(&format!("{}\n", verdict.json)),
            (false, _) => {}
        }
        match verdict.text {
            Ok(text) if !args.json => print(&text),
            Ok(_) => {}
            Err(Refusal(why)) => refused.push(why),
        }
    }
    if refused.is_empty() {
        Ok(Ending::Done)
    } else {
        Err(Refusal(refused.join("\n")))
    }
}

/// Result of the check of one scene.
struct Verdict {
    json: Value,
    /// Report in words, or the reason of a refusal.
    text: Result<String, Refusal>,
}

impl Verdict {
    /// A scene without faults is also set up, so that a start without equilibrium is found here and not in the run.
    fn on(given: &SceneArgs) -> Self {
        let file = shown(&given.path);
        let json = |valid: bool| json!({ "scene": file, "valid": valid, "faults": [] });
        let (json, text) = match given.read() {
            Ok(scene) => match dispatch::check(&scene) {
                Ok(mass) => {
                    let mut json = json(true);
                    let mut text = format!("{file}: no faults\n");
                    if let Some(mass) = &mass {
                        text += &format!("{}\n", mass.text(scene.units));
                    }
                    json["mass"] = mass.map(|mass| mass.json()).into();
                    return Self {
                        json,
                        text: Ok(text),
                    };
                }
                Err(e) => {
                    let mut json = json(false);
                    json["start"] = e.to_string().into();
                    (json, no_start(&given.path, &e))
                }
            },
            Err(why) => {
                let mut json = json(false);
                match &why {
                    ReadError::Scene { faults, .. } => json["faults"] = json!(faults),
                    ReadError::File(e) => json["start"] = e.to_string().into(),
                }
                (json, refuse(why))
            }
        };
        Self {
            json,
            text: Err(text),
        }
    }
}
