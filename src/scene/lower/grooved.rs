//! A rod with mass whose body slides in a groove: an assembly of one rod and one body, in the clamp's frame.

use super::elastic_space::ElasticSpace;
use super::heavy::HeavySpace;
use super::in_space::{SpaceField, joint_of};
use crate::assembly::{Attachment, Body, BodyMotion, Joint};
use crate::body::Groove;
use crate::error::{Error, Result};
use crate::full_mass::assembly::{HeavyAssembly, HeavyLink, Tie};
use crate::full_mass::rod::{HeavyRod, RodDescription};
use crate::scene::{Inertia, Scene};
use crate::section::Strain;
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::resolution::MOST_NODES;
use nalgebra::Isometry3;

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
    /// The rod between the clamp and its body in the groove.
    pub(super) fn grooved(&self, groove: &Groove) -> Result<HeavyAssembly> {
        let here = Isometry3::identity();
        let link = HeavyLink {
            rod: HeavyRod::coarse(self.without_body())?,
            from: Tie::new(Attachment::ground(here), Joint::Weld),
            to: Some(Tie::new(
                Attachment::body(0, here),
                joint_of(&self.common.carried),
            )),
        };
        let carrier = Body::new(self.common.carried.clone()).in_groove(groove.clone());
        HeavyAssembly::new(vec![carrier], vec![link])
    }

    fn without_body(&self) -> RodDescription {
        RodDescription {
            body: None,
            ..self.given.clone()
        }
    }

    /// Pose and twist of the body in the groove, from the initial strains and strain rates.
    pub(super) fn body_in_groove(&self) -> Result<BodyMotion> {
        let given = self.without_body();
        let breaks = given.breaks();
        let mut nodes = INITIAL_NODES;
        loop {
            let grid = Grid::new(&breaks, &vec![nodes; breaks.len() + 1]);
            let rod = HeavyRod::new(given.clone(), grid)?;
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
                let mut end = at.end();
                if self.rate.is_none() {
                    end.twist = self.common.velocity;
                }
                return Ok(end);
            }
            nodes *= 2;
        }
    }
}
