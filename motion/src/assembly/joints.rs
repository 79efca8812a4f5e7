//! Light rods on joints other than weld and ball, or joined without a body: methods that follow them, and snaps.

use super::{AssemblyRun, AssemblySample, Event, LandingRule, Options, Snap, SnapEnd};
use nalgebra::DVector;
use snaprod_systems::assembly::{Assembly, Guide};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::rod::Wrench;
use snaprod_systems::solve::integrator::Method;

/// Refuses options that joints with axes, and nodes without mass, do not have.
///
/// # Errors
/// Implicit or symmetric steps; a landing other than that of the fast layer; nodes on ball joints; a section law in
/// time.
pub(super) fn check(assembly: &Assembly, options: &Options) -> Result<()> {
    if !assembly.has_nodes() {
        return Ok(());
    }
    let refuse = |why: &str| Err(Error::domain(why));
    if matches!(options.method, Method::Implicit | Method::Symmetric) {
        return refuse(
            "run.method: rods without their own mass on a hinge, universal joint, slider, roller or node move by explicit steps; leave method \
             out, or give the rods inertia = \"full\"",
        );
    }
    if options.landing != LandingRule::Viscous {
        return refuse(
            "landing: rods without their own mass on a hinge, universal joint, slider, roller or node land where the fast layer leads; leave \
             landing out",
        );
    }
    let mut guides = assembly.carriers().iter();
    if guides.any(|carrier| carrier.joint().is_some_and(Guide::is_ball)) {
        return refuse(
            "a node on a ball joint is for statics: a motion turns the end of the rod itself",
        );
    }
    let mut links = assembly.links().iter().enumerate();
    if let Some((k, _)) =
        (links.clone()).find(|(k, link)| link.varies_in_time() && assembly.is_jointed(*k))
    {
        return Err(Error::domain(format!(
            "{} has a section law in time and a joint with axes: a motion follows one of the two; weld its ends, or leave out the \
             histories in time",
            assembly.rod_name(k)
        )));
    }
    if let Some((k, _)) = links.find(|(k, link)| link.has_turning() && assembly.is_jointed(*k)) {
        return Err(Error::domain(format!(
            "{} bears loads that turn with it, or couples along it, and has a joint with axes: a motion follows one of the two; weld its ends, \
             or give it its mass in full (inertia = \"full\")",
            assembly.rod_name(k)
        )));
    }
    Ok(())
}

/// Method of the steps: explicit with joints and nodes.
pub(super) fn method(assembly: &Assembly, asked: Method) -> Method {
    if assembly.has_nodes() || assembly.links().is_empty() {
        Method::Explicit
    } else {
        asked
    }
}

impl AssemblyRun<'_> {
    /// At the fold of a rod with joints: continues from its landing, with the carriers of the joints held.
    pub(super) fn snap_with_joints(
        &mut self,
        link: usize,
        time_error: f64,
        here: AssemblySample,
    ) -> Result<Event> {
        let along = self.along();
        let assembly = self.assembly.clone();
        let landing = assembly.settle_jointed(link, &here.at, along)?;
        let mut now = here.at.now.clone();
        now.bodies.clone_from(&landing.bodies);
        now.charts[link] = landing.chart;
        let landed = assembly.state(&now, &here.at.integrals);
        let there = assembly
            .evaluated(&landed, along)
            .ok_or_else(|| Error::domain("the landing of the rod cannot be evaluated"))?;
        let point = &here.at.points[link];
        let end = |q: &Wrench, index, elastic| SnapEnd {
            q: DVector::from_column_slice(q.as_slice()),
            sheet: None,
            index,
            elastic,
        };
        let snap = Snap {
            t: here.at.integrals.time,
            time_error,
            pose: DVector::from_column_slice(point.held().translation.vector.as_slice()),
            velocity: DVector::from_column_slice(&point.relative_twist().as_slice()[3..]),
            released: landing.released,
            from: end(
                &here.at.now.charts[link],
                self.indices[link],
                point.end.energy,
            ),
            to: end(
                &landing.chart,
                assembly.index_of_rod(link, &there, along)?,
                there.points[link].end.energy,
            ),
            rod: link,
            joints: assembly.joints_of(&landed, link),
            base: point.base.pose.rotation,
            choices: None,
            reached: Some(true),
            moving: Some(Box::new(here.at.now.clone())),
        };
        self.land(&snap)?;
        (self.before_snap, self.folding) = (Some(here), None);
        Ok(Event::Snap(snap))
    }
}
