//! The plan of a motion of one rod.

use super::{Plan, RADAU, RADAU_LIGHT, RADAU7, RIGID, choice, steps, symmetric};
use crate::elastica::Elastica;
use crate::error::Result;
use crate::manifold::{Multivalued, Patch};
use crate::motion::LandingRule;
use crate::scene::{Joint, Scene};
use crate::solve::integrator::Method;
use crate::study::run::{ModelKind, Prepared};

pub(super) fn plan(scene: &Scene) -> Result<Plan> {
    let prepared = Prepared::new(scene)?;
    let (kind, run) = (kind(&prepared), scene.run()?);
    let mut plan = Plan::empty(scene, run.duration);
    plan.carries(&*prepared.motion()?);
    let full = prepared.header.full;
    let lifted = scene.is_planar() && kind.in_space();
    plan.model = match (kind, full) {
        (ModelKind::Sheet, _) => choice(
            "the planar elastica: end, force and stiffness in closed form",
            "rod.model = \"elastica\", no damping, no load along the rod: elliptic integrals give force and stiffness at the end",
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
            "one chart for all sheets, slack and taut: it is regular through folds, which are zeros of its Jacobian",
        ),
        ModelKind::ElasticSpace => choice(
            "the wrench at the base; of a taut rod its force alone",
            "equilibria are a single-valued function of the wrench, even where they fold over the position of the end",
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
            "in a rescaled time, which slows at folds and near full reach, so that the motion is smooth there",
        ),
        (ModelKind::Sheet, _) => choice(
            "collocation of order 16, by slopes at eight places at once",
            "in a rescaled time, which slows at folds and near full reach, so that the motion is smooth there; beside the straight rod one slope after the other, explicit steps of order 8 (DOP853)",
        ),
        (ModelKind::ElasticSpace, method) => steps(method, RADAU7),
        (_, method) if full => steps(method, RADAU),
        (_, method) => steps(method, RADAU_LIGHT),
    };
    parts_of_rod(&mut plan, scene, &prepared)?;
    Ok(plan)
}

fn kind(prepared: &Prepared) -> ModelKind {
    // A scene of one rod has a model.
    prepared.header.model.unwrap_or(ModelKind::Space)
}

fn parts_of_rod(plan: &mut Plan, scene: &Scene, prepared: &Prepared) -> Result<()> {
    let (kind, header) = (kind(prepared), &prepared.header);
    let (full, in_space) = (header.full, kind.in_space());
    if kind.is_elastic() {
        plan.leave_out(
            "rates of the strains",
            "without damping the rod is in equilibrium at every moment but those of its snaps",
        );
        if scene.run()?.landing == LandingRule::Viscous {
            plan.leave_out(
                "the fast fall of the rod",
                "it is computed only at snaps, where the rod relaxes with its end held, which decides the landing",
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
            "rod.model = \"elastica\": clamp, loads and start lie in the plane, and stability out of the plane is not tested",
        );
    } else {
        let all = ["u1", "u2", "u3", "v1", "v2", "v3"];
        let moving = &header.strains;
        let rigid: Vec<&str> = (all.into_iter())
            .filter(|name| moving.iter().all(|(moves, _)| moves != name))
            .collect();
        if !rigid.is_empty() {
            plan.leave_out(&format!("the strains {}", rigid.join(", ")), RIGID);
        }
    }
    let body = scene.body.as_ref();
    if body.is_some_and(|body| body.joint == Joint::Ball) && in_space {
        plan.leave_out(
            "rotation of the body",
            "body.joint is a ball joint, which transmits no couple: the body is a point mass",
        );
    }
    if !full && !scene.rod.is_light() {
        plan.leave_out(
            "the inertia of the rod",
            match scene.rod.mass() {
                None => "its mass is not known: neither rod.mass nor a material with a density",
                Some(_) => "its mass acts as weight only: set rod.inertia = \"full\" to include its inertia",
            },
        );
    }
    if !full && !scene.is_loaded_along() && !scene.rod.has_turning_loads() {
        plan.leave_out(
            "loads along the rod",
            "neither loads.distributed, nor [[load]] on it, nor a weight: its force is one vector from base to end",
        );
    }
    if scene.clamp.motion.is_none() {
        plan.leave_out(
            "accelerations of the clamp",
            "no clamp.motion: the clamp is fixed",
        );
    }
    if !header.driven {
        plan.leave_out(
            "the work of loads in time",
            "no load changes in time, and the clamp is fixed",
        );
    }
    if scene.rod.damping.is_some() && scene.rod.relaxation.is_empty() {
        plan.leave_out(
            "strains of dashpots",
            "no rod.relaxation: the damping is of Kelvin-Voigt's kind",
        );
    }
    let looked_for = !scene.is_planar() && (full || kind.is_elastic());
    if header.rods.iter().all(|rod| rod.thickness.is_none()) {
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
