//! The plan of a wall under pressure.

use super::{Plan, choice};
use crate::motion::StateVariables;
use crate::scene::{Scene, WallScene};

pub(super) fn plan(scene: &Scene, given: &WallScene) -> Plan {
    let mut plan = Plan::empty(scene, 0.0);
    plan.leave_out("time", "a wall under pressure is computed at rest");
    let (model, chart) = match given {
        WallScene::Tube(_) => {
            plan.leave_out(
                "the length of the tube",
                "every section is in equilibrium by itself",
            );
            (
                "a section of a tube",
                "the amplitude of the curvature around the section",
            )
        }
        WallScene::Membrane(_) => ("an inflated membrane", "the stretch at the pole"),
    };
    plan.model = choice(model, "[tube] or [membrane] in place of [rod]");
    plan.chart = choice(
        chart,
        "pressure and area or volume follow from it, whatever is held",
    );
    plan.state = vec![StateVariables {
        what: "numbers of the chart",
        numbers: 1,
    }];
    plan.method = choice("a bracketed root in the chart", "one number is sought");
    plan.notes.extend(
        given
            .follow()
            .map(|follow| format!("`snaprod branch` follows it in {}", follow.parameter.name())),
    );
    plan
}
