//! `snaprod check SCENE`.

use super::files::{print, print_json};
use super::{CheckArgs, Ending, Refusal};
use serde_json::json;
use snaprod::scene::{AnyScene, Faults, ReadError, Scene, Setup, Statics, ViscousSetup, read_any};
use std::path::Path;

/// Reads a scene, or says everything that is wrong with it.
pub fn read(path: &Path) -> Result<Scene, Refusal> {
    match read_any(path).map_err(refuse)? {
        AnyScene::Dynamics(scene) => Ok(*scene),
        AnyScene::SpatialMotion(_) => Err(Refusal(format!(
            "{}: rods with damping in space cannot be run yet",
            path.display()
        ))),
        // Which says what can be done with it.
        AnyScene::Statics(_) => Scene::read(path).map_err(refuse),
    }
}

/// Reads a scene of statics, or says everything that is wrong with it.
pub fn read_statics(path: &Path) -> Result<Statics, Refusal> {
    Statics::read(path).map_err(refuse)
}

pub fn refuse(e: ReadError) -> Refusal {
    match e {
        ReadError::Scene { file, faults } => report(&file, &faults),
        ReadError::File(e) => Refusal(e.to_string()),
    }
}

fn report(file: &str, faults: &Faults) -> Refusal {
    let count = match faults.as_slice().len() {
        1 => "one fault".to_owned(),
        n => format!("{n} faults"),
    };
    Refusal(format!("{count} in the scene\n{}", faults.in_file(file)))
}

/// A scene that cannot start.
pub fn no_start(path: &Path, e: &snaprod::Error) -> Refusal {
    Refusal(format!("{}: {e}", path.display()))
}

/// Reports every fault of the scene; a scene without faults is also set up, so that a start with no
/// equilibrium is found here and not in the run.
pub fn check(args: &CheckArgs) -> Result<Ending, Refusal> {
    let file = args.scene.display().to_string();
    match read_any(&args.scene) {
        Ok(scene) => match start(&scene) {
            Ok(()) => {
                if args.json {
                    print_json(json!({ "scene": file, "valid": true, "faults": [] }));
                } else {
                    print(&format!("{file}: no faults\n"));
                }
                Ok(Ending::Done)
            }
            Err(e) => {
                if args.json {
                    print_json(
                        json!({ "scene": file, "valid": false, "faults": [], "start": e.to_string() }),
                    );
                }
                Err(no_start(&args.scene, &e))
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

/// What only setting up can find.
fn start(scene: &AnyScene) -> snaprod::Result<()> {
    match scene {
        AnyScene::Dynamics(scene) if scene.rod.damping.is_some() => {
            ViscousSetup::new(scene).and_then(|setup| setup.run().map(drop))
        }
        AnyScene::Dynamics(scene) => Setup::new(scene).and_then(|setup| setup.run().map(drop)),
        AnyScene::Statics(scene) => scene.problem().map(drop),
        AnyScene::SpatialMotion(scene) => scene.cosserat_rod().map(drop),
    }
}
