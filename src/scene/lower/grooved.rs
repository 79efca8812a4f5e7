//! A rod with mass whose body slides in a groove: an assembly of one rod and one body, in the clamp's frame.

use super::elastic_space::ElasticSpace;
use super::heavy::HeavySpace;
use super::in_space::SpaceField;
use crate::assembly::{Attachment, BodyMotion, HeavyBody, Joint};
use crate::error::{Error, Result};
use crate::full_mass::assembly::{HeavyAssembly, HeavyLink, Tie};
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::motion::full_mass::{HeavyAssemblyStart, RodStart};
use crate::motion::reduction::TipBody;
use crate::scene::{Inertia, Scene};
use crate::section::Strain;
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::resolution::MOST_NODES;
use nalgebra::{Isometry3, UnitQuaternion};

/// Initial number of nodes of an element for the end of the rod at the start, and tolerance of the curve.
const INITIAL_NODES: usize = 16;
const SHAPE: f64 = 1e-13;

/// Strains of the massless rod in its equilibrium in the groove.
pub(super) fn settled(scene: &Scene) -> Result<SpaceField> {
    let mut light = scene.clone();
    light.rod.inertia = Some(Inertia::None);
    light.rod.damping = None;
    ElasticSpace::new(&light)?.field()
}

impl HeavySpace {
    /// The rod between the clamp and a body in its groove; `None` if the body is free.
    ///
    /// # Errors
    /// As [`HeavyRod::new`].
    pub fn assembly(&self) -> Result<Option<HeavyAssembly>> {
        let Some(groove) = &self.groove else {
            return Ok(None);
        };
        let (carrier, joint) = match &self.common.carried {
            TipBody::Welded(body) => (HeavyBody::rigid((**body).clone()), Joint::Weld),
            TipBody::BallJoint(body) => (HeavyBody::point(body.clone()), Joint::Ball),
        };
        let here = Isometry3::identity();
        let link = HeavyLink {
            rod: self.rod_without_body(INITIAL_NODES)?,
            from: Tie {
                on: Attachment::ground(here),
                joint: Joint::Weld,
            },
            to: Some(Tie {
                on: Attachment::body(0, here),
                joint,
            }),
        };
        let carrier = carrier.in_groove(groove.clone());
        HeavyAssembly::new(vec![carrier], vec![link]).map(Some)
    }

    /// Start of [`HeavySpace::assembly`].
    ///
    /// # Errors
    /// Strains that give no shape.
    pub fn assembly_start(&self) -> Result<HeavyAssemblyStart<'_>> {
        let mut body = self.end()?;
        if self.rate.is_none() {
            body.twist = self.common.velocity;
        }
        Ok(HeavyAssemblyStart {
            bodies: vec![body],
            rods: vec![RodStart {
                relaxed: self.relaxed.as_ref().map(|field| {
                    let of = move |s| self.scaled(field, s);
                    Box::new(of) as Box<dyn Fn(f64) -> Strain + '_>
                }),
                base: UnitQuaternion::identity(),
                strain: Box::new(|s| self.strain_at(s)),
                rate: Box::new(|s| self.rate_at(s)),
            }],
            settled: self.settled,
            following: self.rate.is_none(),
        })
    }

    /// The rod without its body.
    fn rod_without_body(&self, nodes: usize) -> Result<HeavyRod> {
        let given = RodDescription {
            body: None,
            ..self.given.clone()
        };
        let breaks = given.breaks();
        let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
        HeavyRod::new(given, grid)
    }

    /// Pose and twist of the end from the initial strains and strain rates.
    fn end(&self) -> Result<BodyMotion> {
        let mut nodes = INITIAL_NODES;
        loop {
            let rod = self.rod_without_body(nodes)?;
            let field = |f: &dyn Fn(f64) -> Strain| {
                let nodes = rod.sections.grid.nodes().iter();
                rod.coordinates(&nodes.map(|s| f(*s)).collect::<Vec<_>>())
            };
            let [q, w] = [field(&|s| self.strain_at(s)), field(&|s| self.rate_at(s))];
            let finite = q.iter().chain(&w).all(|x| x.is_finite());
            let at = rod.moving(&q, &w).filter(|_| finite).ok_or_else(|| {
                Error::domain("[start]: the strains and their rates give no shape of the rod")
            })?;
            if nodes >= MOST_NODES || at.shape.defect <= SHAPE {
                return Ok(BodyMotion {
                    pose: at.shape.end(),
                    twist: at.flow.end(),
                });
            }
            nodes *= 2;
        }
    }
}
