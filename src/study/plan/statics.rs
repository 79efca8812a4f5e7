//! The plan of an equilibrium.

use super::{Plan, choice};
use crate::error::Result;
use crate::motion::StateVariables;
use crate::scene::{AssemblyBody, Scene};

pub(super) fn plan(scene: &Scene) -> Result<Plan> {
    let mut plan = Plan::empty(scene, 0.0);
    plan.leave_out("time", "a scene without [run] asks for an equilibrium");
    let numbers = |what, numbers| StateVariables { what, numbers };
    if let Some(given) = scene.assembly() {
        plan.model = choice(
            "the equilibrium of rods and bodies",
            "[[rod]] and [[body]] without [run]",
        );
        plan.chart = choice(
            "places of the bodies, and the wrench at the base of every rod",
            "all together: regular where a single rod is at its fold, and where it is straight",
        );
        let freedoms = |body: &AssemblyBody| {
            let turns = if body.extent.is_some() { 3 } else { 0 };
            turns + if body.groove.is_some() { 1 } else { 3 }
        };
        plan.state = vec![
            numbers(
                "places of the bodies",
                given.bodies.iter().map(freedoms).sum(),
            ),
            numbers("charts of the rods", 6 * given.rods.len()),
        ];
        plan.method = choice(
            "Newton's method from the guess, or a path from the unloaded rods, through limit points",
            "bodies have a guess or have none",
        );
        return Ok(branched(plan, scene));
    }
    let problem = scene.problem_of_rod_alone()?;
    let taken = problem.solve(scene.guess().as_ref())?.taken;
    plan.model = choice(
        "the equilibrium of one rod",
        "[end] in place of [body] and [run]",
    );
    plan.chart = choice(
        "the wrench at the base",
        "the rod follows from it by one integration, whatever holds its end",
    );
    plan.state = vec![numbers("components of the wrench", 6)];
    plan.method = choice(taken.path.as_str(), taken.why);
    if !scene.is_loaded_along() {
        plan.leave_out(
            "loads along the rod",
            "neither loads.distributed nor a weight: its force is one vector from base to end",
        );
    }
    if problem.rod().hoists_inverse() {
        plan.leave_out(
            "the inverse of the law of the section along the rod",
            "the law is linear and the same everywhere: it is inverted once",
        );
    }
    Ok(branched(plan, scene))
}

/// Adds notes on the continuation requested in a static scene.
fn branched(mut plan: Plan, scene: &Scene) -> Plan {
    plan.notes.extend(scene.continuation.as_ref().map(|wanted| {
        format!(
            "`snaprod branch` follows it in {}, by pseudo-arclength with these unknowns",
            wanted.name
        )
    }));
    plan
}
