//! The obstacles of a scene of motion, and its bodies as obstacles see them, in units of the rod.

use super::clamp::{moving_support, out_of_plane};
use super::in_space::in_world;
use crate::body::{Mass, PointMass};
use crate::contact::{MovingObstacle, PlacedShape, Shape, SurfacePair};
use crate::error::{Error, Message, Quantity, Result};
use crate::full_mass::obstacles::{BallOnBody, Bearer, ObstaclesOfRods, RoundSurface};
use crate::motion::AmongObstacles;
use crate::motion::contact::{Bodies, Partner};
use crate::motion::viscoelastic::AroundRod;
use crate::scene::{BodyShape, Joint, Obstacle, Rod, RodsInContact, Scales, Scene};
use nalgebra::{Isometry3, Vector3};

/// Normal speed after an impact below which bounces are summed up, in units of the rod.
const SETTLE_SPEED: f64 = 1e-6;
/// Most impacts of a run.
const MOST_IMPACTS: u64 = 100_000;

/// Obstacles, and bodies that hit obstacles, in units of the rod.
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

/// A body as obstacles see it, in units of the rod.
pub(super) struct HittingBody {
    /// Mass and loads, in the frame of the world.
    pub mass: Mass,
    /// Shape about the centre of mass; a point if `None`.
    pub shape: Option<BodyShape>,
    /// Name in messages.
    pub name: String,
}

impl Obstacles {
    /// The obstacles of a scene of one rod with a point mass in the plane; `None` without obstacles.
    ///
    /// # Errors
    /// As [`Obstacles::new`].
    pub fn of_point_mass(scene: &Scene) -> Result<Option<Self>> {
        if scene.obstacles.is_empty() {
            return Ok(None);
        }
        let body = HittingBody {
            mass: Mass::Point(PointMass::new(1.0)?),
            shape: scene.body()?.shape,
            name: "the body".to_owned(),
        };
        Self::new(scene, [body]).map(Some)
    }

    /// The obstacles of a scene of one rod in space, with the body at its end; `None` without obstacles.
    ///
    /// # Errors
    /// As [`Obstacles::new`].
    pub(super) fn of_end_body(scene: &Scene) -> Result<Option<Self>> {
        if scene.obstacles.is_empty() {
            return Ok(None);
        }
        let body = HittingBody {
            mass: in_world(&scene.dimensionless()?)?,
            shape: scene.body()?.shape,
            name: "the body".to_owned(),
        };
        Self::new(scene, [body]).map(Some)
    }

    /// The obstacles of a scene, with its bodies in their order.
    ///
    /// # Errors
    /// A number that overflows in units of the rod; a body that is seen from a clamp.
    pub(super) fn new(
        scene: &Scene,
        hitting: impl IntoIterator<Item = HittingBody>,
    ) -> Result<Self> {
        let (scales, rules) = (scene.scales()?, &scene.contact);
        let surface = |friction: f64, restitution: f64| {
            SurfacePair::new(restitution, friction).map(|pair| pair.with_law(rules.law))
        };
        let mut bodies = Bodies::new(surface(rules.friction, rules.restitution)?);
        let mut names = Vec::new();
        for HittingBody { mass, shape, name } in hitting {
            let shape = shape.map_or(Ok(Shape::Point), |shape| shape.in_units(scales.length))?;
            let centre = mass
                .as_rigid()
                .map_or(Vector3::zeros(), |body| *body.offset());
            let placed = PlacedShape {
                shape,
                place: Isometry3::translation(centre.x, centre.y, centre.z),
            };
            bodies.add_body(mass, placed)?;
            names.push(name);
        }
        for obstacle in &scene.obstacles {
            let number = bodies.add_obstacle(moving(obstacle, &scales)?);
            let friction = obstacle.friction.unwrap_or(rules.friction);
            let restitution = obstacle.restitution.unwrap_or(rules.restitution);
            for body in 0..bodies.len() {
                let pair = surface(friction, restitution)?;
                bodies.set_surface(body, Partner::Obstacle(number), pair)?;
            }
        }
        Self::set_pairs(scene, &mut bodies)?;
        let obstacles = scene.obstacles.iter().map(|each| each.name.clone());
        bodies.set_names(names, obstacles.collect());
        if rules.rods != RodsInContact::None {
            Self::check_bases(scene, &bodies, &scales)?;
        }
        let given = rules.settle_speed;
        let settle_speed = given.map(|speed| scales.inward(Quantity::Velocity, speed));
        Ok(Self {
            bodies,
            settle_speed: settle_speed.unwrap_or(SETTLE_SPEED),
            rods: rules.rods,
        })
    }

    /// Refuses obstacles that move over the base of a rod on the ground.
    fn check_bases(scene: &Scene, bodies: &Bodies, scales: &Scales) -> Result<()> {
        let sites: Vec<(usize, [f64; 3])> = match scene.assembly() {
            None if scene.clamp.motion.is_some() => Vec::new(),
            None => vec![(0, scene.clamp.position)],
            Some(given) => {
                let rods = given.rods.iter().enumerate();
                let ends = rods.flat_map(|(k, rod)| [(k, &rod.from), (k, &rod.to)]);
                let stands = ends.filter(|(_, end)| end.body.is_none() && end.motion.is_none());
                stands.map(|(k, end)| (k, end.position)).collect()
            }
        };
        let duration = scales.inward(Quantity::Time, scene.run()?.duration);
        for (rod, base) in sites {
            let base = Vector3::from(base) / scales.length;
            if let Some((k, t)) = bodies.moves_over(rod, &base, duration) {
                let told = Message::from(format!(
                    "the obstacle {:?} moves over the place on the ground that holds a rod, at t = ",
                    scene.obstacles[k].name
                ))
                .number(t, Quantity::Time)
                .words("; let it move elsewhere, name what it touches in `touches`, or write rods = \"none\" in [contact]");
                return Err(Error::domain(told));
            }
        }
        Ok(())
    }

    /// Leaves out what does not touch, and sets the surfaces of single pairs.
    fn set_pairs(scene: &Scene, bodies: &mut Bodies) -> Result<()> {
        let (names, rods) = scene.names_in_contact();
        for (k, obstacle) in scene.obstacles.iter().enumerate() {
            let Some(touches) = &obstacle.touches else {
                continue;
            };
            for body in (0..names.len()).filter(|body| !touches.contains(&names[*body])) {
                bodies.leave_out(body, Partner::Obstacle(k))?;
            }
            for rod in (0..rods.len()).filter(|rod| !touches.contains(&rods[*rod])) {
                bodies.leave_out_rod(rod, k);
            }
        }
        let rules = &scene.contact;
        for pair in &rules.pairs {
            let body = |name: &String| names.iter().position(|other| other == name);
            let obstacle = |name: &String| scene.obstacles.iter().position(|one| one.name == *name);
            let [a, b] = &pair.between;
            let sides = match (body(a), body(b), obstacle(a), obstacle(b)) {
                (Some(a), Some(b), ..) => (a, Partner::Body(b)),
                (Some(a), None, _, Some(b)) | (None, Some(a), Some(b), _) => {
                    (a, Partner::Obstacle(b))
                }
                _ => continue,
            };
            if pair.apart {
                bodies.leave_out(sides.0, sides.1)?;
                continue;
            }
            let own = match sides.1 {
                Partner::Obstacle(k) => scene.obstacles.get(k),
                Partner::Body(_) => None,
            };
            let friction = pair.friction.or(own.and_then(|own| own.friction));
            let restitution = pair.restitution.or(own.and_then(|own| own.restitution));
            let surface = SurfacePair::new(
                restitution.unwrap_or(rules.restitution),
                friction.unwrap_or(rules.friction),
            )?;
            bodies.set_surface(sides.0, sides.1, surface.with_law(rules.law))?;
        }
        Ok(())
    }

    /// The obstacles for a run.
    pub fn among(&self) -> AmongObstacles<'_> {
        AmongObstacles {
            bodies: &self.bodies,
            resting_speed: self.settle_speed,
            max_impacts: MOST_IMPACTS,
            rod_touches: self.rods != RodsInContact::None,
        }
    }

    /// The obstacles about a rod with friction on a clamp that stands, all in units of the rod.
    pub(super) fn around(&self, clamp: Isometry3<f64>, diameter: f64) -> AroundRod<'_> {
        AroundRod {
            obstacles: self.among(),
            clamp,
            diameter,
        }
    }
}

/// An obstacle with its motion, in units of the rod.
fn moving(obstacle: &Obstacle, scales: &Scales) -> Result<MovingObstacle> {
    let named = |e: crate::Error| e.context(format!("obstacle {:?}", obstacle.name));
    let Some(motion) = &obstacle.motion else {
        let standing = obstacle.in_units(scales.length).map_err(named)?;
        return Ok(standing.into());
    };
    let motion = out_of_plane(&scales.motion(motion.clone()));
    let middle = obstacle.shape.middle();
    let seen = obstacle.seen_from(middle, scales.length).map_err(named)?;
    let middle = Vector3::from(middle) / scales.length;
    let place = Isometry3::translation(middle.x, middle.y, middle.z);
    let support = moving_support(&place, &motion).map_err(named)?;
    Ok(MovingObstacle::carried(seen, support))
}

/// Displacement of sticking surfaces, over the width of the barrier.
const STICK: f64 = 1e-2;
/// Least displacement of sticking surfaces, over the tolerance of the run. Steps leave errors of that size: with less,
/// anchors follow the errors, and what sticks creeps.
const HOLDS: f64 = 0.1;
/// Mass of a body that stands for none, over the unit of mass.
const NO_MASS: f64 = 1e-6;

/// The obstacles of rods with all of their mass in units of the rod, seen from a motion in `frame`; `None` without.
///
/// # Errors
/// A number that overflows in units of the rod; a body that is neither a point nor a ball; surfaces that would creep.
pub(super) fn of_heavy_rods(
    scene: &Scene,
    frame: &Isometry3<f64>,
) -> Result<Option<ObstaclesOfRods>> {
    let Some(gap) = scene.barrier_gap() else {
        return Ok(None);
    };
    let (scales, rules) = (scene.scales()?, &scene.contact);
    let (body_names, rod_names) = scene.names_in_contact();
    let rods = scene.every_rod();
    // The coefficients of friction of something of this name; `None` for obstacles that are passed through.
    let friction = |name: &String| -> Vec<Option<f64>> {
        let each = scene.obstacles.iter().map(|obstacle| {
            let pair = rules.pairs.iter().find(|pair| {
                let [a, b] = &pair.between;
                (a == name && *b == obstacle.name) || (b == name && *a == obstacle.name)
            });
            let named = obstacle.touches.as_ref();
            let touches = named.is_none_or(|named| named.contains(name));
            let own = pair.and_then(|pair| pair.friction).or(obstacle.friction);
            (touches && pair.is_none_or(|pair| !pair.apart))
                .then_some(own.unwrap_or(rules.friction))
        });
        each.collect()
    };
    let of_rod = |(name, rod): (&String, &&Rod)| {
        // The centreline touches in the plane, but for a contact diameter.
        let diameter = if scene.is_planar() {
            rod.contact_diameter
        } else {
            rod.thickness()
        };
        RoundSurface {
            radius: scales.inward(Quantity::Length, 0.5 * diameter.unwrap_or(0.0)),
            friction: match rules.rods {
                RodsInContact::None => vec![None; scene.obstacles.len()],
                _ => friction(name),
            },
        }
    };
    // The coefficient of friction of two rods, or of one with itself; `None` where they pass through each other.
    let between = |k: usize, l: usize| -> Option<f64> {
        let thick = |rod: usize| rods[rod].thickness().is_some_and(|d| d > 0.0);
        let pair = rules.pairs.iter().find(|pair| {
            let [a, b] = &pair.between;
            (*a == rod_names[k] && *b == rod_names[l]) || (*b == rod_names[k] && *a == rod_names[l])
        });
        let looked_for = rules.rods == RodsInContact::All || k != l;
        let touches = looked_for && thick(k) && thick(l) && pair.is_none_or(|pair| !pair.apart);
        let friction = pair.and_then(|pair| pair.friction);
        touches.then_some(friction.unwrap_or(rules.friction))
    };
    let ball =
        |name: &String, mass: f64, shape: Option<BodyShape>, on: Bearer, centre: [f64; 3]| {
            let radius = match shape {
                Some(BodyShape::Ball(diameter)) => 0.5 * diameter,
                _ => 0.0,
            };
            BallOnBody {
                on,
                centre: Vector3::from(centre) / scales.length,
                mass: scales.inward(Quantity::Mass, mass),
                surface: RoundSurface {
                    radius: radius / scales.length,
                    friction: friction(name),
                },
            }
        };
    let balls: Vec<BallOnBody> = match scene.assembly() {
        Some(given) => {
            let bodies = given.bodies.iter().zip(&body_names).enumerate();
            let bodies = bodies.map(|(k, (body, name))| {
                let centre = body
                    .extent
                    .as_ref()
                    .map_or([0.0; 3], |extent| extent.offset);
                ball(name, body.mass, body.shape, Bearer::Listed(k), centre)
            });
            bodies.collect()
        }
        None => {
            let bodies = scene.body.iter().zip(&body_names);
            let bodies = bodies.map(|(body, name)| {
                let centre = match &body.joint {
                    Joint::Weld { offset, .. } => *offset,
                    Joint::Ball => [0.0; 3],
                };
                ball(name, body.mass, body.shape, Bearer::EndOf(0), centre)
            });
            bodies.collect()
        }
    };
    let lengths = rods
        .iter()
        .map(|rod| scales.inward(Quantity::Length, rod.length));
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let gap = gap * shortest;
    let tolerance = scene.run()?.tolerance;
    let holds = HOLDS * tolerance;
    if let Some(stick) = rules.stick.filter(|stick| *stick < holds) {
        return Err(Error::domain(format!(
            "contact.stick = {stick:e} must be a tenth of run.tolerance = {tolerance:e} at least, or what sticks creeps"
        )));
    }
    let obstacles = scene.obstacles.iter().map(|obstacle| {
        let standing = obstacle.in_units(scales.length);
        let named = |e: Error| e.context(format!("obstacle {:?}", obstacle.name));
        Ok(standing.map_err(named)?.seen_from(frame))
    });
    let made = ObstaclesOfRods {
        obstacles: obstacles.collect::<Result<_>>()?,
        frame: *frame,
        rods: rod_names.iter().zip(&rods).map(of_rod).collect(),
        between: if scene.rods_meet() {
            let count = rods.len();
            let row = |k: usize| (0..count).map(|l| between(k, l)).collect();
            (0..count).map(row).collect()
        } else {
            Vec::new()
        },
        balls: balls
            .into_iter()
            .filter(|ball| ball.mass > NO_MASS)
            .collect(),
        gap,
        stick: (rules.stick).map_or((STICK * gap).max(holds * shortest), |stick| {
            stick * shortest
        }),
    };
    made.checked(shortest).map(Some)
}
