//! The plan of a flow in a tube.

use super::trial::trial;
use super::{Plan, choice};
use crate::error::Result;
use crate::motion::StateVariables;
use crate::scene::{FlowMedium, FlowScene, Scene};

pub(super) fn plan(scene: &Scene, given: &FlowScene, seconds: f64) -> Result<Plan> {
    let mut plan = Plan::empty(scene, given.duration);
    plan.leave_out(
        "the mass of the wall",
        "the wall is in equilibrium at every place",
    );
    plan.leave_out(
        "the tension along the tube",
        "every section is in equilibrium by itself",
    );
    let (model, state, method) = match &given.medium {
        FlowMedium::Tube(tube) => (
            choice(
                "a flow in a light tube, one-dimensional",
                "[tube] with [run]",
            ),
            StateVariables {
                what: "areas and flows of the cells",
                numbers: 2 * tube.cells,
            },
            choice(
                "finite volumes of second order that keep steady flows, with exact Riemann problems at strong jumps",
                "the only method; tube.cells says how many",
            ),
        ),
        FlowMedium::Lumped(_) => (
            choice("a Starling resistor", "tube.lumped"),
            StateVariables {
                what: "two flows and an area",
                numbers: 3,
            },
            choice("explicit steps of order 8", "the only method"),
        ),
    };
    (plan.model, plan.state, plan.method) = (model, vec![state], method);
    plan.chart = choice(
        "the area of a section",
        "pressure follows from the area at every place",
    );
    plan.trial = trial(scene, seconds)?;
    Ok(plan)
}
