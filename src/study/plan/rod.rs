//! The plan of a motion of one rod.

use super::{Plan, RADAU, RADAU_LIGHT, RADAU7, choice, steps, symmetric};
use crate::elastica::Elastica;
use crate::error::Result;
use crate::manifold::{Multivalued, Patch};
use crate::motion::LandingRule;
use crate::scene::{Joint, Scene};
use crate::solve::integrator::Method;
use crate::study::run::{ModelKind, Prepared};

pub(super) fn plan(scene: &Scene) -> Result<Plan> {
    let prepared = Prepared::new(scene)?;
    let (kind, run) = (prepared.kind(), scene.run()?);
    let mut plan = Plan::empty(scene, run.duration);
    plan.state = prepared.motion()?.carries();
    let full = prepared.is_full();
    let lifted = scene.is_planar() && kind.in_space();
    plan.model = match (kind, full) {
        (ModelKind::Sheet, _) => choice(
            "the planar elastica: end, force and stiffness in closed form",
            "rod.model = \"elastica\", no damping, no load along the rod: elliptic integrals know all that the body feels",
        ),
        (ModelKind::ElasticSpace, _) if lifted => choice(
            "an elastic rod in space that is stiff out of its plane",
            "rod.model = \"elastica\" with a load along the rod (its weight, loads.distributed), which no closed form has",
        ),
        (ModelKind::ElasticSpace, _) => choice(
            "an elastic rod in space, integrated along itself from its base at every evaluation",
            "rod.model = \"cosserat\", no damping",
        ),
        (ModelKind::Planar | ModelKind::Space, true) => choice(
            "a rod with all of its mass: the strains at nodes along it, and their rates",
            "rod.inertia = \"full\"",
        ),
        (ModelKind::Planar, false) => choice(
            "a viscoelastic rod in the plane: the curvature at nodes along it",
            "rod.model = \"elastica\" with rod.damping: strains have rates of their own and are no equilibrium",
        ),
        (ModelKind::Space, false) => choice(
            "a viscoelastic rod in space: the strains at nodes along it",
            "rod.model = \"cosserat\" with rod.damping: strains have rates of their own and are no equilibrium",
        ),
    };
    plan.chart = match kind {
        ModelKind::Sheet => choice(
            "(p, w), modulus and amplitude of the elastica",
            "one chart for all sheets, slack and taut: it goes on through folds, so that a fold is where its Jacobian vanishes",
        ),
        ModelKind::ElasticSpace => choice(
            "the wrench at the base; of a taut rod its force alone",
            "the equilibrium manifold is one sheet over it, whatever folds it has over the place of the end",
        ),
        ModelKind::Planar | ModelKind::Space => choice(
            "the strains themselves",
            match scene.rod.nodes {
                Some(_) => "at as many nodes as rod.nodes says",
                None => "at as many nodes as the tolerance asks for, which change between steps",
            },
        ),
    };
    // Only some processors have eight lanes.
    let eight = Elastica.eightfold(Patch::Global, 1.0).is_some();
    plan.method = match (kind, run.method) {
        (_, Method::Symmetric) => symmetric(),
        (ModelKind::Sheet, _) if scene.rod.is_light() || !eight => choice(
            "explicit steps of order 8 (DOP853)",
            "in a time of their own, which slows at folds and next to the taut wall, so that the motion is smooth there",
        ),
        (ModelKind::Sheet, _) => choice(
            "collocation of order 16, by slopes at eight places at once",
            "in a time of their own, which slows at folds and next to the taut wall, so that the motion is smooth there; beside the straight rod one slope after the other, explicit steps of order 8 (DOP853)",
        ),
        (ModelKind::ElasticSpace, method) => steps(method, RADAU7),
        (_, method) if full => steps(method, RADAU),
        (_, method) => steps(method, RADAU_LIGHT),
    };
    parts_of_rod(&mut plan, scene, &prepared)?;
    Ok(plan)
}

fn parts_of_rod(plan: &mut Plan, scene: &Scene, prepared: &Prepared) -> Result<()> {
    let kind = prepared.kind();
    let (full, in_space) = (prepared.is_full(), kind.in_space());
    if kind.is_elastic() {
        plan.leave_out(
            "rates of the strains",
            "without damping the rod is in equilibrium at every moment but those of its snaps",
        );
        if scene.run()?.landing == LandingRule::Viscous {
            plan.leave_out(
                "the fast fall of the rod",
                "at its snaps alone: there it settles with its end held, which decides where it lands",
            );
        }
    }
    if kind == ModelKind::Sheet {
        plan.leave_out(
            "the shape of the rod",
            "the end and its force do not need it; it is found at the samples that are drawn or written",
        );
    }
    if !in_space {
        plan.leave_out(
            "motion out of the plane",
            "rod.model = \"elastica\": clamp, loads and start lie in the plane, and nothing asks whether it would leave it",
        );
    } else {
        let all = ["u1", "u2", "u3", "v1", "v2", "v3"];
        let moving = prepared.strains();
        let rigid: Vec<&str> = (all.into_iter())
            .filter(|name| moving.iter().all(|(moves, _)| moves != name))
            .collect();
        if !rigid.is_empty() {
            plan.leave_out(
                &format!("the strains {}", rigid.join(", ")),
                "the section holds them rigid",
            );
        }
    }
    if scene.body()?.joint == Joint::Ball && in_space {
        plan.leave_out(
            "the turning of the body",
            "it hangs on a ball joint (body.joint), which takes no couple: it is a point",
        );
    }
    if !full && !scene.rod.is_light() {
        plan.leave_out(
            "the inertia of the rod",
            match scene.rod.mass() {
                None => "its mass is not known: neither rod.mass nor a material with a density",
                Some(_) => "its mass weighs and does no more: rod.inertia = \"full\" has all of it",
            },
        );
    }
    if !full && !scene.is_loaded_along() {
        plan.leave_out(
            "loads along the rod",
            "neither loads.distributed nor a weight: its force is one vector from base to end",
        );
    }
    if scene.clamp.motion.is_none() {
        plan.leave_out("accelerations of the clamp", "it stands: no clamp.motion");
    }
    if !prepared.is_driven() {
        plan.leave_out(
            "the work of loads in time",
            "no load changes in time, and the clamp stands",
        );
    }
    if scene.rod.damping.is_some() && scene.rod.relaxation.is_empty() {
        plan.leave_out(
            "strains of dashpots",
            "no rod.relaxation: the damping is of Kelvin-Voigt's kind",
        );
    }
    let looked_for = !scene.is_planar() && (full || kind.is_elastic());
    if prepared.thickness.is_none() {
        plan.leave_out(
            "contact of the rod with itself",
            if looked_for { "it has neither an outline nor rod.contact_diameter" } else { "this model does not look for it: rods in space do, elastic ones and those with inertia = \"full\"" },
        );
    }
    if let Some(Ok(spring)) = prepared.spring()? {
        plan.notes.push(format!(
            "this {} motion is exactly that of a spring and a dashpot, which the run prints; it is integrated as every other is",
            spring.kind
        ));
    }
    Ok(())
}
