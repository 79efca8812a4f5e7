//! Rods of planar assemblies: sections that bend in the plane alone.
//!
//! Out of the plane the section is stiff beyond any load, so that equilibria and their indices are those in the plane.
//! Strains and couples in the plane do not depend on the stiffness out of it.

use crate::error::{Error, Result};
use crate::rod::Rod;
use crate::scene::{Diagonal, Rod as SceneRod, Section};
use crate::section::{Stiffness, Varying};

/// Stiffness out of the plane over the reference stiffness of the rod.
const HELD: f64 = 1e6;

impl SceneRod {
    /// The rod at the origin, in the scene's units, that bends about its director `normal` (0 or 1) alone.
    ///
    /// # Errors
    /// As [`SceneRod::unclamped`]; a section law with a barrier, or that couples strains.
    pub(in crate::scene) fn in_plane(&self, normal: usize) -> Result<Rod> {
        let free = self.unclamped()?;
        let held = HELD * free.reference_stiffness();
        if let Some(profile) = self.varying_profile()? {
            if !self.tendons.is_empty() {
                return Err(Error::domain(
                    "rod.tendon: tendons of a rod whose shape varies are for assemblies in space: leave out plane",
                ));
            }
            let law = Varying::shaped(profile, self.rest.clone(), self.length)?;
            return Rod::new(self.length, law.in_plane(normal, held));
        }
        let law = match &self.section {
            Section::Diagonal(law) => law.clone(),
            Section::Barrier(_) => {
                return Err(Error::domain(
                    "rod.section: a law with a barrier is for assemblies in space: leave out plane",
                ));
            }
            _ => self.diagonal()?,
        };
        if law.bending[normal] == Stiffness::Rigid {
            return Err(Error::domain(format!(
                "rod.section.bending[{normal}] = \"rigid\": in the plane the rod bends about this director alone: give it a number, or leave out plane"
            )));
        }
        let mut bending = law.bending;
        bending[1 - normal] = held.into();
        let section = Section::Diagonal(Diagonal {
            bending,
            torsion: held.into(),
            ..law
        });
        let rod = Self {
            section,
            ..self.clone()
        };
        rod.unclamped()
    }

    /// The section law as one stiffness per strain.
    fn diagonal(&self) -> Result<Diagonal> {
        let law = self.linear()?;
        let k = law.stiffness();
        if (0..6).any(|i| (0..6).any(|j| i != j && k[(i, j)] != 0.0)) {
            return Err(Error::domain(
                "rod.section: a stiffness that couples strains is for assemblies in space: leave out plane",
            ));
        }
        let rigid = law.is_rigid();
        let stiffness = |i: usize| {
            if rigid[i] {
                Stiffness::Rigid
            } else {
                k[(i, i)].into()
            }
        };
        Ok(Diagonal {
            bending: [stiffness(0), stiffness(1)],
            torsion: stiffness(2),
            shear: if rigid[3] {
                Stiffness::Rigid
            } else {
                Stiffness::Elastic([k[(3, 3)].into(), k[(4, 4)].into()])
            },
            axial: stiffness(5),
        })
    }
}
