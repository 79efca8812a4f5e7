//! The plan of a bar.

use super::trial::trial;
use super::{Plan, choice};
use crate::bar::Scheme;
use crate::error::Result;
use crate::motion::StateVariables;
use crate::scene::Scene;
use crate::study::bar::BarPrepared;

pub(super) fn plan(scene: &Scene, seconds: f64) -> Result<Plan> {
    let prepared = BarPrepared::new(scene)?;
    let given = prepared.given();
    let mut plan = Plan::empty(scene, given.duration);
    plan.model = choice(
        "a bar with mass in longitudinal motion",
        "rod.model = \"bar\": stretch and velocity along it, waves and shocks",
    );
    plan.chart = choice(
        "stretch and velocity of every cell",
        "rod.cells says how many",
    );
    plan.state = vec![StateVariables {
        what: "stretches and velocities of the cells",
        numbers: 2 * given.cells,
    }];
    plan.method = match given.scheme {
        Scheme::FiniteVolume => choice(
            "finite volumes with an exact Riemann solver, of high resolution where the motion is smooth",
            "rod.scheme, or its default",
        ),
        other => choice(format!("the scheme {:?}", other.name()), "rod.scheme"),
    };
    plan.leave_out(
        "bending, shear and torsion",
        "a bar stays straight; rod.model = \"cosserat\" with inertia = \"full\" has them all, without shocks",
    );
    if given.scheme != Scheme::FiniteVolume {
        plan.leave_out(
            "shocks",
            "only finite volumes resolve them and book what they lose",
        );
    }
    plan.trial = trial(scene, seconds)?;
    Ok(plan)
}
