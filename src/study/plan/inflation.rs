//! The plan of a membrane in motion.

use super::trial::trial;
use super::{Plan, choice};
use crate::error::Result;
use crate::membrane::Shape;
use crate::motion::StateVariables;
use crate::scene::{InflationScene, Mover, Scene};

pub(super) fn plan(scene: &Scene, given: &InflationScene, seconds: f64) -> Result<Plan> {
    let mut plan = Plan::empty(scene, given.duration);
    plan.leave_out(
        "bending of the membrane",
        "a membrane has no stiffness against bending: it wrinkles where it is compressed, which is told",
    );
    plan.leave_out("friction", "rubber and gas lose no energy but in snaps");
    let (model, chart, state, method) = match (&given.mover, given.membrane.shape) {
        (Mover::Piston(_), _) => {
            plan.leave_out("the mass of the balloon", "the piston has the mass, [body]");
            (
                choice(
                    "a heavy piston on a vessel of gas, with a light balloon",
                    "[body] beside [membrane]",
                ),
                choice(
                    "the stretch of the balloon",
                    "place of the piston and pressure follow from it, also past folds",
                ),
                (
                    "stretch of the balloon, velocity of the piston, work, time",
                    4,
                ),
                choice(
                    "explicit steps of order 8 (DOP853) in desingularised time, snaps at folds",
                    "the only method",
                ),
            )
        }
        (Mover::Membrane { .. }, Shape::Sphere) => {
            plan.leave_out("motions that are not round", "a sphere stays a sphere");
            (
                choice("a sphere with mass", "[membrane] with density and [run]"),
                choice("the stretch", "radius, volume and pressure follow from it"),
                ("stretch, its rate, work, time", 4),
                choice("explicit steps of order 8 (DOP853)", "the only method"),
            )
        }
        (Mover::Membrane { elements, .. }, Shape::Disc) => (
            choice(
                "a disc with mass, round about its axis",
                "[membrane] with density and [run]",
            ),
            choice(
                "places of the rims of conical rings",
                "membrane.elements says how many",
            ),
            (
                "places and velocities of the rims that move",
                4 * elements - 2,
            ),
            choice(
                "central differences in the velocity form",
                "the only method; the stiffest ring bounds the step",
            ),
        ),
    };
    (plan.model, plan.chart, plan.method) = (model, chart, method);
    let (what, numbers) = state;
    plan.state = vec![StateVariables { what, numbers }];
    plan.trial = trial(scene, seconds)?;
    Ok(plan)
}
