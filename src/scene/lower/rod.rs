//! Conversion of a scene of statics to the rod and its boundary-value problem.

use super::equilibrium_tolerance;
use crate::error::{Error, Result};
use crate::rod::{DistributedLoad, EndConditions, LoadsWithoutPotential, Problem, Rod, Wrench};
use crate::scene::{
    Barrier, BarrierTerm, Component, Drive, Full, InitialShape, Loads, Orientation, Outline,
    Parameter, Pull, Rod as SceneRod, RodLoad, Scene, Section, StrainName, Tendon,
};
use crate::section::{self, Along, Driven, Linear, Material, Profile, Transverse, Varying};
use nalgebra::{Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};

/// Reason why a rod with friction has no load along it that is dead in the world on a clamp that turns.
const TURNS_WITH_FRICTION: &str = "a rod with friction (damping) under its weight, or another load along it, on a clamp that turns is followed with all of its mass \
                                   alone: write inertia = \"full\" in [rod]; or leave out its friction, or its mass (a material by E and nu, without a density)";

impl Scene {
    /// The boundary-value problem of the scene, in the scene's units.
    ///
    /// # Errors
    /// A scene of motion; a law that is not convex, an end out of reach; faults that [`Scene::parse`] cannot see from
    /// the numbers alone.
    pub fn problem(&self) -> Result<Problem> {
        self.has_no_obstacles()?;
        self.problem_of_rod_alone()
    }

    /// Refuses obstacles, for computations that do not look for contact.
    ///
    /// # Errors
    /// A scene with obstacles.
    pub(crate) fn has_no_obstacles(&self) -> Result<()> {
        if !self.has_contact() {
            return Ok(());
        }
        let others = if self.is_motion() {
            "use `snaprod run`"
        } else {
            "use `snaprod equilibrium` or `snaprod branch`"
        };
        Err(Error::domain(format!(
            "this command does not look for contact yet: {others}, or leave out [[obstacle]], and bodies with a shape or a position"
        )))
    }

    /// The equilibrium problem of the rod without the obstacles of the scene.
    ///
    /// # Errors
    /// As [`Scene::problem`].
    pub(crate) fn problem_of_rod_alone(&self) -> Result<Problem> {
        let held = self.end()?;
        let given = |tendon: &Tendon| matches!(tendon.pull, Pull::Length(_));
        if self.rod.tendons.iter().any(given) {
            return Err(Error::domain(
                "the tension of a tendon of given length is found for one equilibrium alone: write `tension` in place of `length` in [[rod.tendon]]",
            ));
        }
        let rod = self.cosserat_rod()?;
        let mut end = EndConditions {
            position: held.position.map(Component::held),
            orientation: held.orientation.as_ref().map(rotation),
            follower: held.follower,
            turning: [held.follower_couple, held.follower_force]
                .map(|load| Vector3::from(load) * held.load),
            ..EndConditions::load(held.applied_force().into(), held.applied_couple().into())
        };
        let on_end = self.rod.loads.iter().filter(|load| load.is_on_end());
        for load in on_end {
            if end.follower {
                // Beside listed loads all loads along the directors have one place.
                end.turning[0] += std::mem::take(&mut end.couple);
                end.turning[1] += std::mem::take(&mut end.force);
                end.follower = false;
            }
            let [force, couple] = load.applied();
            if load.follows {
                end.turning[0] += couple;
                end.turning[1] += force;
            } else {
                end.couple += couple;
                end.force += force;
            }
        }
        let problem = Problem::new(rod, end, equilibrium_tolerance(self))?;
        let problem = problem.with_path(self.solve.path);
        let problem = if self.is_loaded_along() {
            problem.with_distributed(&self.load_along()?)
        } else {
            problem
        };
        Ok(match self.followers()? {
            Some(loads) => problem.with_followers(&loads),
            None => problem,
        })
    }

    /// True for a rod in statics with a load along it that turns with the directors, including one that a branch
    /// varies from 0.
    pub(in crate::scene) fn is_followed_along(&self) -> bool {
        !self.loads.follower.is_zero() || self.varies(Parameter::is_follower_along)
    }

    /// True if a branch varies a parameter of this kind.
    pub(in crate::scene) fn varies(&self, kind: impl Fn(Parameter) -> bool) -> bool {
        let branch = self.continuation.iter();
        let mut varied = branch.flat_map(|wanted| {
            let second = wanted.second.as_ref().map(|second| second.parameter);
            std::iter::once(wanted.parameter).chain(second)
        });
        varied.any(kind)
    }

    /// Dead load along a rod: weight and distributed force, times their common factor, and the dead forces of the list.
    ///
    /// # Errors
    /// As [`LoadAlong::on`](crate::scene::LoadAlong::on).
    pub fn load_along(&self) -> Result<DistributedLoad> {
        let Loads {
            gravity,
            distributed,
            load,
            ..
        } = &self.loads;
        let whole = distributed.and_weight(&self.rod, *gravity)?;
        whole.mapped(|f| f * *load).plus(&self.rod.dead_forces()?)
    }

    /// Dead load along a rod in motion, its weight included, in the world and the scene's units. `None` without a load,
    /// for a rod with its full mass, and for a planar first-order rod under its weight alone.
    ///
    /// # Errors
    /// A rod with friction on a clamp that turns; as [`LoadAlong::on`](crate::scene::LoadAlong::on).
    pub(in crate::scene) fn light_load(&self) -> Result<Option<DistributedLoad>> {
        if self.rod.is_heavy() || (self.rod.is_light() && self.stays_in_plane()) {
            return Ok(None);
        }
        let load = (self.loads.distributed).with_weight(&self.rod, self.loads.gravity)?;
        if load.is_some() && self.turns_with_friction() {
            return Err(Error::domain(TURNS_WITH_FRICTION));
        }
        Ok(load)
    }

    /// True for a rod with friction on a clamp that turns.
    fn turns_with_friction(&self) -> bool {
        let motion = self.clamp.motion.as_ref();
        self.rod.damping.is_some() && motion.is_some_and(|motion| motion.turn.is_some())
    }

    /// Loads along a rod in motion that have no potential, in the world and the scene's units. `None` without such
    /// loads, and for a rod with its full mass.
    ///
    /// # Errors
    /// Couples on a rod with friction on a clamp that turns; a place outside of the rod.
    pub(in crate::scene) fn light_turning_loads(&self) -> Result<Option<LoadsWithoutPotential>> {
        let any = !self.rod.is_heavy() && self.rod.has_turning_loads();
        let dead_couple = |load: &RodLoad| !load.follows && load.couple != [0.0; 3];
        if any && self.turns_with_friction() && self.rod.loads.iter().any(dead_couple) {
            return Err(Error::domain(TURNS_WITH_FRICTION));
        }
        any.then(|| self.rod.turning_loads()).transpose()
    }

    /// Dead load along a rod in the equilibrium at the start of a motion, in the world and the scene's units. It equals
    /// [`Scene::light_load`], or, for a heavy rod that settles, the load under which it settles. `None` without a load.
    ///
    /// # Errors
    /// As [`Scene::light_load`].
    pub(in crate::scene) fn load_at_start(&self) -> Result<Option<DistributedLoad>> {
        let settles = matches!(self.start.place, InitialShape::Settled { .. });
        if self.rod.is_heavy() && settles {
            (self.loads.distributed).with_weight(&self.rod, self.loads.gravity)
        } else {
            self.light_load()
        }
    }

    /// True for a rod in statics with a load along it, including a load that a branch varies from 0. An invalid load
    /// also counts; its error is reported where it is used.
    pub fn is_loaded_along(&self) -> bool {
        let Loads {
            gravity,
            distributed,
            load,
            ..
        } = &self.loads;
        let whole = distributed.and_weight(&self.rod, *gravity);
        let dead = whole.map_or(true, |load| !load.is_zero());
        let counts = *load != 0.0 || self.varies(Parameter::is_factor_along);
        let listed = self.rod.loads.iter().any(RodLoad::is_dead_force);
        dead && counts || listed || self.varies(Parameter::is_along)
    }

    /// Initial guess of the base wrench from `[start]`, if any.
    pub fn guess(&self) -> Option<Wrench> {
        self.start.wrench.map(Vector6::from)
    }

    /// The rod of the scene, in the scene's units.
    ///
    /// # Errors
    /// A planar scene; faults that [`Scene::parse`] cannot see from the numbers alone: a law without an unloaded
    /// state.
    pub fn cosserat_rod(&self) -> Result<Rod> {
        let position = self.clamp.position.into();
        let rod = self.rod.unclamped()?;
        Ok(rod.with_clamp(position, rotation(&self.clamp.orientation)))
    }
}

impl SceneRod {
    fn profile(&self, outline: &Outline) -> Result<Profile<Along>> {
        let given = self.material.map(|m| (m.young, m.poisson, m.shear));
        let (young, transverse) = match given {
            Some((young, _, Some(modulus))) => (young, Transverse::ShearModulus(modulus)),
            Some((young, Some(ratio), None)) => (young, Transverse::Poisson(ratio)),
            _ => {
                return Err(Error::domain(
                    "rod.material: a rod in space needs E and nu, or E and G",
                ));
            }
        };
        Ok(Profile {
            shape: outline.shape.clone(),
            material: Material { young, transverse },
            set: outline.set,
        })
    }

    /// The rod at the origin, in the scene's units.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`].
    pub(in crate::scene) fn unclamped(&self) -> Result<Rod> {
        match self.tendon_law()? {
            Some(law) => Rod::new(self.length, law),
            None => self.backbone(),
        }
    }

    /// The rod at the origin without its tendons, in the scene's units.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`].
    pub(in crate::scene) fn backbone(&self) -> Result<Rod> {
        let rod = self.undriven()?;
        let Some(Drive { shape, amplitude }) = &self.drive else {
            return Ok(rod);
        };
        let law = Driven::new(
            rod.law().clone(),
            shape.clone(),
            amplitude.at(0.0),
            self.length,
        )?;
        Rod::new(self.length, law)
    }

    /// The rod at the origin, without tendons and without driven rest strains.
    pub(in crate::scene) fn undriven(&self) -> Result<Rod> {
        let length = self.length;
        match &self.section {
            Section::Bending(_) => Err(Error::domain(
                "rod.model = \"elastica\" is a rod in the plane; one in space is \"cosserat\"",
            )),
            Section::Diagonal(law) => match law.uniform(&self.rest)? {
                Some(law) => Rod::new(length, law),
                None => Rod::new(
                    length,
                    Varying::new(law.clone(), self.rest.clone(), length)?,
                ),
            },
            Section::Full(law) => self.with_rest_strains(full(law)?),
            Section::Profile(profile) => self.shaped(profile.clone()),
            Section::Outline(outline) => self.shaped(self.profile(outline)?),
            Section::Barrier(law) => self.barrier(law),
        }
    }

    /// Shape and material of a rod of varying shape; `None` for an even shape.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`].
    pub(super) fn varying_profile(&self) -> Result<Option<Profile<Along>>> {
        let profile = match &self.section {
            Section::Profile(profile) => profile.clone(),
            Section::Outline(outline) => self.profile(outline)?,
            _ => return Ok(None),
        };
        Ok(Some(profile).filter(|profile| profile.shape.uniform().is_none()))
    }

    /// The rod of a shape and a material.
    fn shaped(&self, profile: Profile<Along>) -> Result<Rod> {
        match profile.shape.uniform() {
            Some(_) => self.with_rest_strains(profile.at(0.0, self.length)?.law()?),
            None => Rod::new(
                self.length,
                Varying::shaped(profile, self.rest.clone(), self.length)?,
            ),
        }
    }

    /// Linear section law of a matrix, or of a shape and a material, at the base.
    pub(super) fn linear(&self) -> Result<Linear> {
        match &self.section {
            Section::Full(law) => full(law),
            Section::Profile(profile) => profile.at(0.0, self.length)?.law(),
            Section::Outline(outline) => self.profile(outline)?.at(0.0, self.length)?.law(),
            Section::Bending(_) | Section::Diagonal(_) | Section::Barrier(_) => Err(Error::domain(
                "rod.section: not a matrix of stiffnesses, and not a shape",
            )),
        }
    }

    /// The rod of a law with the scene's rest strains, which may vary along the rod.
    fn with_rest_strains(&self, law: Linear) -> Result<Rod> {
        match self.rest.uniform() {
            Some((curvature, twist)) => Rod::new(self.length, law.with_rest(curvature, twist)?),
            None => {
                let law = Varying::from_linear(law, self.rest.clone(), self.length)?;
                Rod::new(self.length, law)
            }
        }
    }

    fn barrier(&self, law: &Barrier) -> Result<Rod> {
        let Some(base) = law.linear.uniform(&self.rest)? else {
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

/// Conversion of an orientation to a rotation.
pub(super) fn rotation(orientation: &Orientation) -> UnitQuaternion<f64> {
    let [w, x, y, z] = orientation.quaternion();
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn full(law: &Full) -> Result<Linear> {
    let mut stiffness = Matrix6::from_fn(|i, j| law.stiffness[i][j]);
    let marked = StrainName::ALL.map(|name| law.rigid.contains(&name));
    let free = StrainName::ALL
        .iter()
        .filter(|name| !marked[**name as usize]);
    let size = free.map(|name| stiffness[(*name as usize, *name as usize)]);
    let size = size.fold(0.0, f64::max);
    for i in (0..6).filter(|i| marked[*i]) {
        // Rows and columns of rigid strains have no effect; this keeps the matrix positive definite.
        stiffness.row_mut(i).fill(0.0);
        stiffness.column_mut(i).fill(0.0);
        stiffness[(i, i)] = size;
    }
    Linear::full(stiffness)?.holding(marked)
}
