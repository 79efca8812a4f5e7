//! The obstacles of a scene of motion, and its bodies as obstacles see them, in units of the rod.

use super::clamp::{moving_support, out_of_plane};
use crate::body::{Mass, PointMass};
use crate::contact::{MovingObstacle, Shape, SurfacePair};
use crate::error::{Quantity, Result};
use crate::motion::AmongObstacles;
use crate::motion::contact::{Bodies, Partner};
use crate::scene::{BodyShape, Obstacle, RodsInContact, Scales, Scene};
use nalgebra::Isometry3;

/// Normal speed after an impact below which bounces are summed up, in units of the rod.
const SETTLE_SPEED: f64 = 1e-6;
/// Most impacts of a run.
const MOST_IMPACTS: u64 = 100_000;

/// Obstacles with the body of one rod, in units of the rod.
#[derive(Clone)]
pub struct Obstacles {
    bodies: Bodies,
    settle_speed: f64,
    rods: RodsInContact,
}

impl std::fmt::Debug for Obstacles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Obstacles")
            .field("settle_speed", &self.settle_speed)
            .field("rods", &self.rods)
            .finish_non_exhaustive()
    }
}

impl Obstacles {
    /// The obstacles of a scene of one rod with a point mass; `None` without obstacles.
    ///
    /// # Errors
    /// A number that overflows in units of the rod.
    pub fn of_point_mass(scene: &Scene) -> Result<Option<Self>> {
        if scene.obstacles.is_empty() {
            return Ok(None);
        }
        let (scales, rules) = (scene.scales()?, &scene.contact);
        let surface = |friction: f64, restitution: f64| {
            SurfacePair::new(restitution, friction).map(|pair| pair.with_law(rules.law))
        };
        let mut bodies = Bodies::new(surface(rules.friction, rules.restitution)?);
        let shape = match scene.body()?.shape {
            None | Some(BodyShape::Point) => Shape::Point,
            Some(BodyShape::Ball(diameter)) => {
                Shape::ball(0.5 * scales.inward(Quantity::Length, diameter))?
            }
        };
        bodies.add_body(Mass::Point(PointMass::new(1.0)?), shape)?;
        for obstacle in &scene.obstacles {
            let number = bodies.add_obstacle(moving(obstacle, &scales)?);
            let friction = obstacle.friction.unwrap_or(rules.friction);
            let restitution = obstacle.restitution.unwrap_or(rules.restitution);
            let pair = surface(friction, restitution)?;
            bodies.set_surface(0, Partner::Obstacle(number), pair)?;
        }
        let names = scene.obstacles.iter().map(|each| each.name.clone());
        bodies.set_names(vec!["the body".to_owned()], names.collect());
        let given = rules.settle_speed;
        let settle_speed = given.map(|speed| scales.inward(Quantity::Velocity, speed));
        Ok(Some(Self {
            bodies,
            settle_speed: settle_speed.unwrap_or(SETTLE_SPEED),
            rods: rules.rods,
        }))
    }

    /// The obstacles for a run.
    pub fn among(&self) -> AmongObstacles<'_> {
        AmongObstacles {
            bodies: &self.bodies,
            resting_speed: self.settle_speed,
            max_impacts: MOST_IMPACTS,
            rod_touches: self.rods == RodsInContact::All,
        }
    }
}

/// An obstacle with its motion, in units of the rod.
fn moving(obstacle: &Obstacle, scales: &Scales) -> Result<MovingObstacle> {
    let named = |e: crate::Error| e.context(format!("obstacle {:?}", obstacle.name));
    let standing = obstacle.in_units(scales.length).map_err(named)?;
    let Some(motion) = &obstacle.motion else {
        return Ok(standing.into());
    };
    let motion = out_of_plane(&scales.motion(motion.clone()));
    let support = moving_support(&Isometry3::identity(), &motion).map_err(named)?;
    Ok(MovingObstacle::carried(standing, support))
}
