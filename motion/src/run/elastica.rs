//! Runs of a mass on the planar elastica, with starts from the straight rod.

use super::contacts::{AmongObstacles, GapBy, RodGap};
use super::rod_gap::{nearest_place, within_reach};
use super::touching::TouchingRun;
use super::{Phase, Run};
use crate::drive::Motion;
use crate::options::Options;
use crate::sheet::{MassNow, MassTreatment};
use crate::straight_release::Opening;
use nalgebra::Vector2;
use snaprod_systems::body::PointMass;
use snaprod_systems::elastica::Elastica;
use snaprod_systems::error::{Error, Result};

impl<'a> Run<'a, Elastica, 2> {
    /// A run of the straight rod let go at (1, 0) with a velocity across, by a special opening (see
    /// `straight_release.rs`).
    ///
    /// The motion leaves the straight state with a pull of order t^2 beyond that of the loads; no other
    /// motion keeps the pull bounded as t -> 0.
    ///
    /// # Errors
    /// A velocity along the rod; nothing that acts across it; a push beyond Euler's load, under which the
    /// straight rod is unstable; a pull above 3600 EI/L^2.
    pub fn straight(body: &'a PointMass<2>, v: Vector2<f64>, options: Options) -> Result<Self> {
        let opening = Opening::new(body, v, options.duration)?;
        let state = |t: f64| {
            opening.at(t).ok_or_else(|| {
                Error::no_convergence("the start from the straight rod has no shape")
            })
        };
        let given = Phase { v, ..state(0.0)? };
        let mut run = Self::start(&Elastica, body, state(opening.until)?, options, 0.0, 0)?;
        if let Some(rod) = body.rod()
            && let MassTreatment::Glides(glide) = run
                .motion
                .nears_straight(rod, MassNow::default(), false)
                .passage
        {
            run.go_straight(rod, *glide);
            run.snapped = 0.0;
        }
        run.given = given;
        run.given_pose = Some((Vector2::new(1.0, 0.0), opening.of_rod(0.0)));
        run.early = Some(Box::new(move |t| Some((opening.at(t)?, opening.of_rod(t)))));
        Ok(run)
    }
}

/// The motion of a mass on the planar elastica from the equilibrium at a chart point (p, w), or from the straight
/// rod. It is boxed behind the trait of all motions, so that callers do not compile the generic run again.
///
/// # Errors
/// As [`Run::new`] and [`Run::straight`]; a start inside an obstacle.
pub fn on_elastica<'a>(
    body: &'a PointMass<2>,
    from: Option<Vector2<f64>>,
    v: Vector2<f64>,
    obstacles: Option<AmongObstacles<'a>>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let run = match from {
        Some(q) => Run::new(&Elastica, body, q, v, options)?,
        None => Run::straight(body, v, options)?,
    };
    match obstacles {
        Some(obstacles) if obstacles.rod_touches => Ok(Box::new(TouchingRun::new(
            run.among_obstacles(obstacles)?,
            body,
            obstacles,
            options,
        ))),
        Some(obstacles) => Ok(Box::new(run.among_obstacles(obstacles)?)),
        None => Ok(Box::new(run)),
    }
}

impl<'a> Run<'a, Elastica, 2> {
    /// The run with obstacles that the body hits. The clamp must stand still.
    ///
    /// # Errors
    /// A start inside an obstacle; contact forces without a solution; a rod with mass; a clamp that moves.
    pub fn among_obstacles(self, obstacles: AmongObstacles<'a>) -> Result<Self> {
        if (self.body.support()).is_some_and(|support| !support.is_fixed()) {
            return Err(Error::domain(
                "obstacles are for clamps that stand: leave out the motion of the clamp, or the obstacles",
            ));
        }
        let body = self.body;
        let rod = obstacles.rod_touches;
        self.among(obstacles, rod.then(|| free_rod_gap(obstacles, body)))
    }
}

/// The room of a rod that touches no obstacle.
pub(super) fn free_rod_gap<'a>(
    obstacles: AmongObstacles<'a>,
    body: &'a PointMass<2>,
) -> RodGap<'a, 2> {
    Box::new(move |at: &Phase<2>, by: GapBy| match by {
        GapBy::Reach => within_reach(obstacles.bodies, body, at),
        _ => nearest_place(obstacles.bodies, body, at, by),
    })
}
