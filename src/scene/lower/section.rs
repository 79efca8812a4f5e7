//! Conversion of a scene to its viscoelastic section.

use crate::error::{Error, Result};
use crate::scene::{Model, Rod, Scene};
use crate::section::rate::{Damping, Maxwell, StrainMatrix, Viscoelastic};
use crate::section::{Linear, SectionLaw};
use std::sync::Arc;

impl Scene {
    /// Section of the rod, in the scene's units: stored energy, friction, Maxwell branches. In the plane only u1,
    /// bending, has a meaning; the other stiffnesses are not used.
    ///
    /// # Errors
    /// A scene without damping; as [`Scene::cosserat_rod`]; matrices that are not positive definite in the strains that
    /// are not rigid; proportional Maxwell branches of a section whose stiffness varies along the rod.
    pub fn viscoelastic(&self) -> Result<Viscoelastic> {
        self.rod.viscoelastic()
    }
}

impl Rod {
    /// Viscoelastic section of this rod, see [`Scene::viscoelastic`].
    pub(super) fn viscoelastic(&self) -> Result<Viscoelastic> {
        let Some(damping) = &self.damping else {
            return Err(Error::domain(
                "rod.damping is missing or 0: an elastic rod has no section that creeps or remembers; write damping > 0",
            ));
        };
        let bending = match self.model {
            Model::Elastica => Some(self.bending_stiffness()?),
            _ => None,
        };
        let elastic: Arc<dyn SectionLaw> = match bending {
            Some(bending) => Arc::new(Linear::diagonal([bending; 2], bending)?),
            None => self.backbone()?.law().clone(),
        };
        let given = |matrix: &StrainMatrix| match bending {
            Some(bending) => matrix.in_plane(bending),
            None => matrix.clone(),
        };
        let damping = Damping {
            viscosity: given(&damping.viscosity),
            law: damping.law,
        };
        let rate = damping
            .law(&elastic)
            .map_err(|e| e.context("rod.damping"))?;
        let stored: Arc<dyn SectionLaw> = match self.tendons.as_slice() {
            [] => elastic.clone(),
            _ => Arc::new(self.with_tendons(elastic.clone())?),
        };
        let mut law = Viscoelastic::new(stored, rate)?;
        for (i, branch) in self.relaxation.iter().enumerate() {
            let branch = Maxwell {
                modulus: given(&branch.modulus),
                time: branch.time,
            };
            law = branch
                .branch_for(&*elastic)
                .and_then(|branch| law.with_branch(branch))
                .map_err(|e| e.context(format!("rod.relaxation[{i}]")))?;
        }
        Ok(law)
    }
}
