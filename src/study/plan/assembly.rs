//! The plan of a motion of rods and bodies.

use super::{Plan, RADAU, RADAU7, choice, steps};
use crate::assembly::Joint;
use crate::error::Result;
use crate::scene::{AssemblyRod, AssemblyScene, Scene};
use crate::study::run::Prepared;

pub(super) fn plan(scene: &Scene, given: &AssemblyScene) -> Result<Plan> {
    let run = scene.run()?;
    let prepared = Prepared::new(scene)?;
    let mut plan = Plan::empty(scene, run.duration);
    plan.carries(&*prepared.motion()?);
    let rods = || given.rods.iter();
    let full = rods().any(|rod| rod.rod.is_heavy());
    (plan.model, plan.chart, plan.method) = if full {
        (
            choice(
                "rods with mass between bodies: strains at nodes along every rod, and their rates",
                "[[rod]] inertia = \"full\"",
            ),
            choice(
                "the strains themselves, and places of the bodies",
                "ends of rods are held by multipliers, which are solved for with the accelerations",
            ),
            steps(run.method, RADAU),
        )
    } else {
        (
            choice(
                "elastic rods between bodies, each integrated along itself from its base at every evaluation",
                "[[rod]] without damping and without inertia = \"full\"",
            ),
            choice(
                "the wrench at the base of every rod; of a taut one its force alone",
                "the bodies give the positions of the ends; the wrench selects among the equilibria of each rod there",
            ),
            if rods().any(AssemblyRod::has_joint_axes) {
                choice(
                    "explicit steps of order 8 (DOP853)",
                    "joints with axes on rods without mass of their own",
                )
            } else {
                steps(run.method, RADAU7)
            },
        )
    };
    if !full {
        plan.leave_out(
            "rates of the strains",
            "without damping and inertia = \"full\" the rods are in equilibrium at every moment but those of their snaps",
        );
    }
    let bodies = given.bodies.iter();
    let points = bodies.filter(|body| body.extent.is_none());
    plan.leave_out_of(
        points.map(|body| body.name.as_str()),
        |names| format!("rotation of {names}"),
        "point masses: no inertia, held by ball joints",
    );
    let some = |chosen: &dyn Fn(&AssemblyRod) -> bool| -> Vec<&str> {
        let rods = rods().filter(|rod| !full && chosen(rod));
        rods.map(|rod| rod.name.as_str()).collect()
    };
    let pinned = |rod: &AssemblyRod| {
        [&rod.from, &rod.to].map(|site| site.joint.of_rod()) == [Joint::Ball; 2]
            && !rod.rod.is_light()
    };
    plan.leave_out_of(
        some(&pinned).into_iter(),
        |names| format!("the spin of {names} about the chord"),
        "between two ball joints only the mass of the rod depends on it: the rod is a spring along its chord",
    );
    plan.leave_out_of(
        some(&|rod| rod.rod.mass().is_none()).into_iter(),
        |names| format!("the inertia of {names}"),
        "the mass is not known: neither mass nor a material with a density",
    );
    let floats = scene.loads.gravity == [0.0; 3];
    let bare = |rod: &AssemblyRod| {
        rod.distributed.is_zero()
            && rod.rod.loads.is_empty()
            && (floats || rod.rod.mass().is_none())
    };
    plan.leave_out_of(
        some(&bare).into_iter(),
        |names| format!("loads along {names}"),
        "neither distributed nor a weight: the force is one vector from base to end",
    );
    if rods().all(|rod| rod.rod.thickness().is_none()) {
        plan.leave_out(
            "contacts of rods",
            "none has an outline or a contact_diameter",
        );
    }
    if rods().all(|rod| rod.from.motion.is_none() && rod.to.motion.is_none()) {
        plan.leave_out(
            "motion of supports",
            "no site has a motion: all supports are fixed",
        );
    }
    if full && scene.obstacles.is_empty() {
        plan.leave_out("contact with obstacles", "no [[obstacle]]");
    }
    if !full && !given.free.is_empty() {
        plan.leave_out(
            "rods with a free end",
            "nothing hangs on them: they are equilibria alone, found when they are drawn",
        );
    }
    Ok(plan)
}
