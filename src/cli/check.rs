//! `snaprod check SCENE`.

use super::files::{print, print_json};
use super::{CheckArgs, Ending, Refusal};
use serde_json::json;
use snaprod::scene::{ReadError, Scene, Setup};
use std::path::Path;

/// Reads a scene, or says everything that is wrong with it.
pub fn read(path: &Path) -> Result<Scene, Refusal> {
    Scene::read(path).map_err(|e| Refusal(e.to_string()))
}

/// Reports every fault of the scene; a scene without faults is also set up, so that a start with no
/// equilibrium is found here and not in the run.
pub fn check(args: &CheckArgs) -> Result<Ending, Refusal> {
    let file = args.scene.display().to_string();
    let faults = match Scene::read(&args.scene) {
        Ok(scene) => match Setup::new(&scene) {
            Ok(_) => {
                if args.json {
                    print_json(&json!({ "scene": file, "valid": true, "faults": [] }));
                } else {
                    print(&format!("{file}: no faults\n"));
                }
                return Ok(Ending::Done);
            }
            Err(e) => {
                if args.json {
                    print_json(
                        &json!({ "scene": file, "valid": false, "faults": [], "start": e.to_string() }),
                    );
                }
                return Err(Refusal(format!("{file}: {e}")));
            }
        },
        Err(ReadError::Scene { faults, .. }) => faults,
        Err(e @ ReadError::File(_)) => return Err(Refusal(e.to_string())),
    };
    if args.json {
        print_json(&json!({ "scene": file, "valid": false, "faults": faults }));
    }
    Err(Refusal(format!(
        "{} in the scene\n{}",
        match faults.as_slice().len() {
            1 => "one fault".to_owned(),
            n => format!("{n} faults"),
        },
        faults.in_file(&file)
    )))
}
