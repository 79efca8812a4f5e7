//! From a scene of statics to the rod and the problem of its end.

use crate::error::{Error, Result};
use crate::rod::{EndConditions, Problem, Rod, Wrench};
use crate::scene::{
    Along, Barrier, BarrierTerm, Component, Diagonal, Full, Orientation, Profile as SceneProfile,
    Rod as SceneRod, Scene, Section, Shape, Shaped, Stiffness, Transverse,
};
use crate::section::{self, Linear, Material, Profile, Varying};
use nalgebra::{Matrix6, Quaternion, UnitQuaternion, Vector6};

impl Scene {
    /// The problem of the scene, in the scene's units.
    ///
    /// # Errors
    /// A scene of motion; a law that is not convex, an end out of reach; what [`Scene::parse`] cannot see from the numbers alone.
    pub fn problem(&self) -> Result<Problem> {
        let held = self.end()?;
        let rod = self.cosserat_rod()?;
        let end = EndConditions {
            position: held.position.map(Component::held),
            orientation: held.orientation.as_ref().map(rotation),
            force: held.applied_force().into(),
            couple: held.applied_couple().into(),
            follower: held.follower,
        };
        // Equilibria are solved a digit better than asked for.
        Ok(Problem::new(rod, end, 0.1 * self.solve.tolerance)?.with_path(self.solve.path))
    }

    /// The guess of `[start]`, if there is one.
    pub fn guess(&self) -> Option<Wrench> {
        self.start.wrench.map(Vector6::from)
    }

    /// The rod of the scene, in the scene's units.
    ///
    /// # Errors
    /// A planar scene; what [`Scene::parse`] cannot see from the numbers alone: flexure or twist held rigid, a law that has no
    /// unloaded state.
    pub fn cosserat_rod(&self) -> Result<Rod> {
        let position = self.clamp.position.into();
        let rod = self.rod.unclamped()?;
        Ok(rod.with_clamp(position, rotation(&self.clamp.orientation)))
    }
}

impl SceneRod {
    fn profile(&self, section: &SceneProfile) -> Result<Linear> {
        let material = match self.material.map(|m| (m.young, m.poisson, m.shear)) {
            Some((young, _, Some(shear))) => Material::with_shear(young, shear)?,
            Some((young, Some(ratio), None)) => Material::with_poisson(young, ratio)?,
            _ => {
                return Err(Error::domain(
                    "rod.material: a rod in space needs E and nu, or E and G",
                ));
            }
        };
        let (constant, factor) = (section.torsion_constant, section.shear_factor);
        let rigid = [section.shear.is_some(), section.axial.is_some()];
        law_of(section.outline.shape(), material, constant, factor, rigid)
    }

    fn unclamped(&self) -> Result<Rod> {
        let length = self.length;
        match &self.section {
            Section::Bending(_) => Err(Error::domain(
                "rod.model = \"elastica\" is a rod in the plane; one in space is \"cosserat\"",
            )),
            Section::Diagonal(law) => match self.uniform(law)? {
                Some(law) => Rod::new(length, law),
                None => Rod::new(length, self.varying(law)?),
            },
            Section::Full(law) => self.rested(length, full(law)?),
            Section::Shaped(law) => self.rested(length, shaped(law)?),
            Section::Profile(section) => self.rested(length, self.profile(section)?),
            Section::Barrier(law) => self.barrier(law),
        }
    }

    /// The law, if none of its numbers varies along the rod.
    fn uniform(&self, law: &Diagonal) -> Result<Option<Linear>> {
        let (Some(a), Some(b), Some(torsion)) = (
            law.bending[0].constant(),
            law.bending[1].constant(),
            law.torsion.constant(),
        ) else {
            return Ok(None);
        };
        let mut linear = Linear::diagonal([a, b], torsion)?;
        if let Stiffness::Elastic([first, second]) = &law.shear {
            let (Some(first), Some(second)) = (first.constant(), second.constant()) else {
                return Ok(None);
            };
            linear = linear.with_shear([first, second])?;
        }
        if let Stiffness::Elastic(axial) = &law.axial {
            let Some(axial) = axial.constant() else {
                return Ok(None);
            };
            linear = linear.with_axial(axial)?;
        }
        let rest = &self.rest;
        let (Some(k1), Some(k2), Some(twist)) = (
            rest.curvature[0].constant(),
            rest.curvature[1].constant(),
            rest.twist.constant(),
        ) else {
            return Ok(None);
        };
        linear.with_rest([k1, k2], twist).map(Some)
    }

    fn varying(&self, law: &Diagonal) -> Result<Varying> {
        let along = |a: &Along| self.along(a);
        let two = |pair: &[Along; 2]| Ok::<_, Error>([along(&pair[0])?, along(&pair[1])?]);
        let mut varying = Varying::diagonal(two(&law.bending)?, along(&law.torsion)?)?;
        if let Stiffness::Elastic(shear) = &law.shear {
            varying = varying.with_shear(two(shear)?)?;
        }
        if let Stiffness::Elastic(axial) = &law.axial {
            varying = varying.with_axial(along(axial)?)?;
        }
        let rest = &self.rest;
        varying.with_rest(two(&rest.curvature)?, along(&rest.twist)?)
    }

    fn along(&self, along: &Along) -> Result<section::Along> {
        match along {
            Along::Constant(value) => Ok((*value).into()),
            Along::Table { s, values } => {
                let nodes: Vec<_> = s.iter().copied().zip(values.iter().copied()).collect();
                section::Along::table(&nodes)
            }
            Along::Polynomial { polynomial } => {
                // The scene's are in s/L.
                let scaled: Vec<_> = polynomial
                    .iter()
                    .enumerate()
                    .map(|(k, c)| c / self.length.powi(k as i32))
                    .collect();
                section::Along::polynomial(&scaled)
            }
        }
    }

    /// A law with the scene's rest strains, which may vary along the rod.
    fn rested(&self, length: f64, law: Linear) -> Result<Rod> {
        let rest = &self.rest;
        let constants = (
            rest.curvature[0].constant(),
            rest.curvature[1].constant(),
            rest.twist.constant(),
        );
        if let (Some(k1), Some(k2), Some(twist)) = constants {
            return Rod::new(length, law.with_rest([k1, k2], twist)?);
        }
        let rest = rest.clone();
        let varying = Varying::by(move |s| {
            let curvature = [
                rest.curvature[0].at(s, length),
                rest.curvature[1].at(s, length),
            ];
            law.with_rest(curvature, rest.twist.at(s, length))
        });
        let breaks: Vec<f64> = self.rest_breaks();
        Rod::new(length, varying.with_breaks(&breaks)?)
    }

    fn rest_breaks(&self) -> Vec<f64> {
        let rest = &self.rest;
        [&rest.curvature[0], &rest.curvature[1], &rest.twist]
            .into_iter()
            .flat_map(|along| match along {
                Along::Table { s, .. } => s.clone(),
                _ => Vec::new(),
            })
            .collect()
    }

    fn barrier(&self, law: &Barrier) -> Result<Rod> {
        let Some(base) = self.uniform(&law.linear)? else {
            return Err(Error::domain(
                "rod.section: a law with a barrier must be the same all along the rod; give numbers, not tables or polynomials",
            ));
        };
        let BarrierTerm {
            strength,
            half_widths,
        } = law.barrier;
        let law = section::Barrier::new(base, half_widths, strength)?;
        Rod::new(self.length, law)
    }
}

/// As a rotation.
pub(super) fn rotation(orientation: &Orientation) -> UnitQuaternion<f64> {
    let [w, x, y, z] = orientation.quaternion();
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn full(law: &Full) -> Result<Linear> {
    let mut stiffness = Matrix6::from_fn(|i, j| law.stiffness[i][j]);
    let mut marked = [false; 3];
    for name in &law.rigid {
        let i = *name as usize;
        if i < 3 {
            return Err(Error::domain(format!(
                "rod.section.rigid = {:?}: flexure and twist cannot be rigid; only v1, v2, v3",
                name.as_str()
            )));
        }
        // Their rows and columns have no effect.
        stiffness.row_mut(i).fill(0.0);
        stiffness.column_mut(i).fill(0.0);
        stiffness[(i, i)] = stiffness[(0, 0)];
        marked[i - 3] = true;
    }
    Linear::full(stiffness)?.rigid(marked)
}

fn shaped(law: &Shaped) -> Result<Linear> {
    let shape = match law.shape {
        Shape::Circle { radius } => section::Shape::Circle { radius },
        Shape::Rectangle { width, height } => section::Shape::Rectangle { width, height },
        Shape::Tube {
            outer_radius,
            thickness,
        } => section::Shape::Tube {
            outer: outer_radius,
            inner: outer_radius - thickness,
        },
    };
    let material = match law.transverse {
        Transverse::ShearModulus(modulus) => Material::with_shear(law.young, modulus)?,
        Transverse::Poisson(ratio) => Material::with_poisson(law.young, ratio)?,
    };
    let rigid = [law.shear.is_some(), law.axial.is_some()];
    law_of(
        shape,
        material,
        law.torsion_constant,
        law.shear_factor,
        rigid,
    )
}

/// The law of a shape; `rigid`: shear, stretch.
fn law_of(
    shape: section::Shape,
    material: Material,
    torsion_constant: Option<f64>,
    shear_factor: Option<f64>,
    rigid: [bool; 2],
) -> Result<Linear> {
    let mut profile = Profile::new(shape, material)?;
    if let Some(constant) = torsion_constant {
        profile = profile.with_torsion_constant(constant)?;
    }
    // Where shear is rigid the factor is not used.
    if let Some(factor) = shear_factor.or(rigid[0].then_some(1.0)) {
        profile = profile.with_shear_factors([factor; 2])?;
    }
    profile.law()?.rigid([rigid[0], rigid[0], rigid[1]])
}
