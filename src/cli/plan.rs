//! `snaprod plan SCENE`: forecast of the computations and the cost of a run.

use super::check::{SceneArgs, no_start, refuse};
use super::files::{print, print_json};
use super::{Ending, Refusal};
use clap::Args;
use snaprod::study;

#[derive(Args)]
pub struct PlanArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Seconds of processor time of the trial run for the cost; 0: no trial. The trial takes up to four times as long
    /// while its forecast falls, or while it has covered less than 1 % of the run. A run of up to about three times
    /// these seconds is followed to its end.
    #[arg(long, default_value_t = 1.0)]
    pub seconds: f64,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Reports the computations of a run of the scene, the omissions with reasons, and the cost.
pub fn plan(args: &PlanArgs) -> Result<Ending, Refusal> {
    if !(0.0..=1e6).contains(&args.seconds) {
        return Err(Refusal(format!(
            "--seconds {}: the time of a trial must lie in [0, 1e6] seconds; 0 leaves it out",
            args.seconds
        )));
    }
    let scene = args.scene.read().map_err(refuse)?;
    let found = study::plan(&scene, args.seconds).map_err(|e| no_start(&args.scene.path, &e))?;
    if args.json {
        print_json(found.json())
    } else {
        print(&found.text())
    }
    Ok(Ending::Done)
}
