//! From a scene to its viscoelastic section.

use super::viscous::{ELASTIC, planar_section};
use crate::error::{Error, Result};
use crate::scene::{Damping, FrictionLaw, Maxwell as SceneMaxwell, Scene, StrainMatrix};
use crate::section::SectionLaw;
use crate::section::rate::{
    Carreau, FrictionBarrier, KelvinVoigt, Maxwell, RateLaw, Viscoelastic, Viscosity,
};
use nalgebra::Matrix6;
use std::sync::Arc;

impl Scene {
    /// The section of the rod, in the scene's units: stored energy, friction, Maxwell branches. In the plane only
    /// u1, bending, is meant.
    ///
    /// # Errors
    /// A scene without damping; as [`Scene::cosserat_rod`]; matrices that are not positive definite in the strains that the section does
    /// not hold rigid; Maxwell branches in proportion to a section that varies along the rod.
    pub fn viscoelastic(&self) -> Result<Viscoelastic> {
        let Some(damping) = &self.rod.damping else {
            return Err(Error::domain(format!(
                "{ELASTIC} no section that creeps or remembers; write damping > 0"
            )));
        };
        if self.is_planar() {
            return planar_section(&self.rod, self.rod.bending_stiffness()?, damping);
        }
        let rod = self.cosserat_rod()?;
        let elastic = rod.law().clone();
        let rate = rate_law(damping, &elastic, rod.reference_stiffness())
            .map_err(|e| e.context("rod.damping"))?;
        let mut law = Viscoelastic::new(elastic, rate)?;
        for (i, branch) in self.rod.relaxation.iter().enumerate() {
            let branch = maxwell(&law, branch)
                .and_then(|branch| law.clone().with_branch(branch))
                .map_err(|e| e.context(format!("rod.relaxation[{i}]")));
            law = branch?;
        }
        Ok(law)
    }
}

fn rate_law(
    damping: &Damping,
    elastic: &Arc<dyn SectionLaw>,
    bending: f64,
) -> Result<Arc<dyn RateLaw>> {
    let viscosity = match (&damping.viscosity, damping.viscosity.rows()) {
        (StrainMatrix::Proportional(time), _) => Viscosity::proportional(elastic.clone(), *time)?,
        (_, Some(rows)) => full(&rows, elastic.rigid())?,
        (_, None) => return Err(Error::domain("a viscosity must have rows")),
    };
    Ok(match damping.law {
        FrictionLaw::Linear => Arc::new(KelvinVoigt::new(viscosity)),
        FrictionLaw::Power(power) => {
            let StrainMatrix::Proportional(time) = damping.viscosity else {
                return Err(Error::domain(
                    "a power of the rate needs a viscosity in proportion to the section: write `proportional = 0.05`",
                ));
            };
            // e_t.H e_t/onset = e_t.K e_t/(B rate^2) with H = time K.
            let onset = time * bending * power.rate * power.rate;
            Arc::new(Carreau::new(viscosity, onset, power.exponent)?)
        }
        FrictionLaw::Barrier(barrier) => Arc::new(FrictionBarrier::new(
            viscosity,
            barrier.half_widths,
            barrier.strength,
        )?),
    })
}

/// A viscosity matrix; rows and columns of strains that are rigid have no effect.
fn full(rows: &[[f64; 6]; 6], rigid: [bool; 3]) -> Result<Viscosity> {
    let mut matrix = without(rows, rigid);
    // Something positive in their place.
    for k in (0..3).filter(|k| rigid[*k]) {
        matrix[(3 + k, 3 + k)] = matrix[(0, 0)];
    }
    Viscosity::full(matrix)?.held(rigid)
}

fn maxwell(law: &Viscoelastic, branch: &SceneMaxwell) -> Result<Maxwell> {
    match (&branch.stiffness, branch.stiffness.rows()) {
        (_, Some(rows)) => Maxwell::new(without(&rows, law.elastic.rigid()), branch.time),
        (StrainMatrix::Proportional(0.0), _) => Maxwell::new(Matrix6::zeros(), branch.time),
        (StrainMatrix::Proportional(_), _) if !law.elastic.is_uniform() => Err(Error::domain(
            "stiffness = { proportional = .. }: the section varies along the rod, and a branch is the same all along; give six stiffnesses",
        )),
        (StrainMatrix::Proportional(share), _) => {
            Maxwell::proportional(&*law.elastic, *share, branch.time)
        }
        _ => Err(Error::domain("a stiffness must have rows")),
    }
}

fn without(rows: &[[f64; 6]; 6], rigid: [bool; 3]) -> Matrix6<f64> {
    let held = |i: usize| i > 2 && rigid[i - 3];
    Matrix6::from_fn(|i, j| if held(i) || held(j) { 0.0 } else { rows[i][j] })
}
