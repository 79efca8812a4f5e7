//! Cosserat rods in space (AMV Secs. 2, 4): section laws, and the equilibrium manifold charted by the base wrench.

mod all_equilibria;
mod branch;
mod chart;
mod closed_form;
mod collocation;
mod conjugate_points;
pub mod contact;
mod descent;
mod distributed_load;
mod end_response;
mod equilibrium;
mod first_order_mass;
mod fold;
mod follower_load;
mod free_end;
mod index;
mod ivp;
mod ivp_trace;
mod law_in_time;
mod loaded_turning_base;
mod manifold;
mod path_to_target;
mod planar;
mod planar_index;
mod problem;
mod scaled_law;
mod solution_path;
mod starts;
mod taut;
mod two_ended_chart;
mod zero_modes;

pub use all_equilibria::{AllEquilibria, Finding, ListedEquilibrium};
pub use branch::{BranchEquilibrium, RodFamily, Statical};
pub use chart::{Chart, Spatial};
pub use closed_form::ClosedForm;
pub use distributed_load::DistributedLoad;
pub use end_response::EndResponse;
pub use equilibrium::{Equilibrium, Route};
pub use first_order_mass::{RodRates, SectionMass, SpaceRodInertia, Trace};
pub use fold::Fold;
pub use free_end::FreeEnd;
pub use ivp::Wrench;
pub use law_in_time::EndRates;
pub use loaded_turning_base::{LoadPower, LoadedEnd};
pub use manifold::{BallJointed, Welded};
pub use planar::Plane;
pub use problem::{EndConditions, LoadsWithoutPotential, Problem};
pub use solution_path::{ChosenPath, Path, ProblemChart};
pub use taut::{Derivatives, Fallen, Rates, Spring, Taut, TautLoad, Tip};
pub use two_ended_chart::BothEnds;
pub use zero_modes::{FreePhase, ZeroMode};

use crate::error::{Error, Result};
use crate::section::{self, MassAlong, Measures, SectionLaw, Strain};
use crate::solve::cost::Cost;
use distributed_load::LoadState;
use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use scaled_law::ScaledLaw;
use std::sync::Arc;

/// A rod: a section law along a length, clamped at s = 0.
///
/// Every quantity is in one consistent system of units of the user's choice.
#[derive(Debug, Clone)]
pub struct Rod {
    length: f64,
    stiffness: f64,
    /// Section law as given, in the user's units.
    section: Arc<dyn SectionLaw>,
    law: ScaledLaw,
    clamp: Isometry3<f64>,
    /// Variation of mass and rotary inertia along the rod; `None` for a uniform rod.
    mass_along: Option<Arc<MassAlong>>,
}

/// One section of a rod in equilibrium, in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct RodSection {
    /// Arclength from the clamp, in the unloaded state.
    pub s: f64,
    /// Centreline.
    pub position: Vector3<f64>,
    /// Directors d1, d2, d3 as columns, orthonormal to rounding.
    pub directors: Matrix3<f64>,
    /// Couple m(s) of the part beyond s on the part before s.
    pub couple: Vector3<f64>,
    /// Force n(s); constant along a rod without a load.
    pub force: Vector3<f64>,
    /// Strains along the directors.
    pub strain: Strain,
    /// Energy stored between the clamp and this section.
    pub energy: f64,
}

/// The end of a rod with its tangent.
#[derive(Debug, Clone, PartialEq)]
pub struct RodEnd {
    /// The section at s = L.
    pub section: RodSection,
    /// d(phi, r)(L)/d(m(0), n), phi the rotation vector of the directors, world frame.
    pub tangent: Matrix6<f64>,
    /// Steps along the rod.
    pub steps: u64,
}

impl RodSection {
    /// Position and directors.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = Rotation3::from_matrix_unchecked(self.directors);
        Isometry3::from_parts(
            self.position.into(),
            UnitQuaternion::from_rotation_matrix(&turn),
        )
    }
}

impl Rod {
    /// A rod along +z from the origin, directors along the world's axes.
    ///
    /// # Errors
    /// A length that is not positive and finite; a law that cannot be inverted without load.
    pub fn new(length: f64, law: impl SectionLaw + 'static) -> Result<Self> {
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::domain(format!(
                "the length is {length}; it must be positive and finite"
            )));
        }
        let law: Arc<dyn SectionLaw> = Arc::new(law);
        let unloaded = law.inverse(0.0, &Vector6::zeros())?;
        let c = unloaded.compliance.matrix();
        let stiffness = 2.0 / (c[(0, 0)] + c[(1, 1)]);
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(Error::domain(
                "the section is rigid or limp in bending; its flexural compliance must be positive and finite",
            ));
        }
        let units = Measures {
            length,
            stiffness,
            time: 1.0,
        };
        Ok(Self {
            length,
            stiffness,
            law: ScaledLaw::new(law.clone(), units)?,
            section: law,
            clamp: Isometry3::identity(),
            mass_along: None,
        })
    }

    /// This rod in other units, from the origin along z.
    pub fn measured(&self, units: Measures) -> Self {
        Self {
            length: self.length / units.length,
            stiffness: self.stiffness / units.stiffness,
            law: self.law.clone(),
            section: section::law_in_units(self.section.clone(), units),
            clamp: Isometry3::identity(),
            mass_along: self.mass_along.clone(),
        }
    }

    /// The rod with mass and rotary inertia that vary along it, for its first-order inertia. By default both are
    /// uniform. Jumps must be breaks of the section law.
    #[must_use]
    pub fn with_mass_along(mut self, along: Option<MassAlong>) -> Self {
        self.mass_along = along.map(Arc::new);
        self
    }

    /// Variation of mass and rotary inertia along the rod; `None` for a uniform rod.
    pub fn mass_along(&self) -> Option<&MassAlong> {
        self.mass_along.as_deref()
    }

    /// This rod with another section law in the same units. The units of the chart stay, whatever the stiffness.
    ///
    /// # Errors
    /// A law whose breaks are not in growing order.
    pub fn with_law(&self, law: Arc<dyn SectionLaw>) -> Result<Self> {
        let units = Measures {
            length: self.length,
            stiffness: self.stiffness,
            time: 1.0,
        };
        Ok(Self {
            law: ScaledLaw::new(law.clone(), units)?,
            section: law,
            ..self.clone()
        })
    }

    /// The rod with its clamp in the given pose.
    #[must_use]
    pub fn with_clamp(mut self, position: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        self.clamp = Isometry3::from_parts(position.into(), rotation);
        self
    }

    /// This rod begun at its other end: s* = L - s, with directors turned by pi about d1, so that d3 points along the
    /// rod again: d1* = d1, d2* = -d2, d3* = -d3. Strains and resultants of s* are (-u1, u2, u3, -v1, v2, v3) of s,
    /// and couple and force transform likewise. The clamp is back at the origin.
    ///
    /// # Errors
    /// A law that cannot be inverted without load at its other end.
    pub fn reversed(&self) -> Result<Self> {
        let law = section::reverse_law(self.section.clone(), self.length);
        let along = self.mass_along.as_ref().map(|along| along.reversed());
        Ok(Self::new(self.length, law)?.with_mass_along(along))
    }

    /// Pose of the clamp.
    pub fn clamp_pose(&self) -> &Isometry3<f64> {
        &self.clamp
    }

    /// Length.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The section law.
    pub fn law(&self) -> &Arc<dyn SectionLaw> {
        &self.section
    }

    /// Bending stiffness B that scales the numerics: 2/(C11 + C22) at the unloaded clamp.
    pub fn reference_stiffness(&self) -> f64 {
        self.stiffness
    }

    /// True if a turn of a section about its d3 changes nothing: isotropic, and straight at rest.
    pub fn is_axisymmetric(&self) -> bool {
        self.law.is_axisymmetric()
    }

    /// True if the inverse of the section law is formed once, not at every section.
    pub fn hoists_inverse(&self) -> bool {
        self.law.uniform().is_some()
    }

    /// True if the unloaded section cannot be stretched or sheared at the clamp.
    ///
    /// # Errors
    /// A law that refuses zero resultants at the clamp.
    pub fn is_inextensible(&self) -> Result<bool> {
        let c = self
            .law
            .inverse(0.0, &Vector6::zeros())?
            .compliance
            .matrix();
        Ok((3..6).all(|i| c[(i, i)] == 0.0))
    }

    /// (B/L, B/L^2): units of couple and of force.
    pub fn units(&self) -> (f64, f64) {
        let couple = self.stiffness / self.length;
        (couple, couple / self.length)
    }

    /// A base wrench of the world frame along the clamp's directors, in units B/L and B/L^2.
    pub fn inward(&self, base: &Wrench) -> Wrench {
        let (couple, force) = self.units();
        let turn = self.clamp.rotation.inverse();
        let m = turn * base.fixed_rows::<3>(0).into_owned() / couple;
        let n = turn * base.fixed_rows::<3>(3).into_owned() / force;
        Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
    }

    /// A base wrench of the numerics in the world frame and the user's units.
    pub fn outward_wrench(&self, b: &Wrench) -> Wrench {
        let (couple, force) = self.units();
        let turn = self.clamp.rotation;
        let m = turn * b.fixed_rows::<3>(0).into_owned() * couple;
        let n = turn * b.fixed_rows::<3>(3).into_owned() * force;
        Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
    }

    fn outward<const K: usize, C: LoadState<K>>(
        &self,
        at: &ivp::LineState<K, C>,
        b: &Wrench,
        load: &C::Load,
    ) -> Result<RodSection> {
        let (couple, force) = self.units();
        let turn = self.clamp.rotation;
        let r = at.position();
        let (m, n) = at.resultants(b, load);
        let directors = at.rotation();
        let (local_m, local_n) = (directors.transpose() * m, directors.transpose() * n);
        let local = Vector6::new(
            local_m.x, local_m.y, local_m.z, local_n.x, local_n.y, local_n.z,
        );
        let e = self.law.inverse(at.s(), &local)?.strain;
        let l = self.length;
        // The steps along the rod add up to 1 up to rounding.
        let part = if (at.s() - 1.0).abs() < 1e-13 {
            1.0
        } else {
            at.s()
        };
        Ok(RodSection {
            s: part * l,
            position: self.clamp.translation.vector + turn * r * l,
            directors: turn.to_rotation_matrix().matrix() * directors,
            couple: turn * m * couple,
            force: turn * n * force,
            strain: Vector6::new(e[0] / l, e[1] / l, e[2] / l, e[3], e[4], e[5]),
            energy: at.energy() * couple,
        })
    }

    /// Sections at the steps of an integration to `tolerance`, base and end included.
    ///
    /// # Errors
    /// As [`Rod::shape`].
    pub fn trace(&self, base: &Wrench, tolerance: f64) -> Result<Vec<RodSection>> {
        let b = self.inward(base);
        let steps = ivp::steps(&self.law, &b, tolerance)?;
        steps.iter().map(|at| self.outward(at, &b, &())).collect()
    }

    /// The end of the rod under the base wrench (m(0), n) in the world frame, with its exact tangent.
    ///
    /// # Errors
    /// A section law that refuses a resultant on the way; a wrench too large for the integration.
    pub fn end(&self, base: &Wrench, tolerance: f64) -> Result<RodEnd> {
        let b = self.inward(base);
        let (at, cost) = ivp::end::<6>(&self.law, &b, tolerance)?;
        self.described(&at, &b, cost)
    }

    /// The end as [`Rod::end`], with the record of the integration; `turns` says whether the base is to turn.
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn traced_end(
        &self,
        base: &Wrench,
        turns: bool,
        tolerance: f64,
    ) -> Result<(RodEnd, Trace)> {
        let b = self.inward(base);
        let (at, cost, track) = ivp_trace::tracked_end::<6, ()>(&self.law, &(), &b, tolerance)?;
        let trace = Trace::bare(track, at, turns);
        Ok((self.described(&at, &b, cost)?, trace))
    }

    fn described(&self, at: &ivp::LineState<6>, b: &Wrench, cost: Cost) -> Result<RodEnd> {
        let (couple, force) = self.units();
        let turn = *self.clamp.rotation.to_rotation_matrix().matrix();
        let mut turned = Matrix6::zeros();
        turned.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        turned.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        let unit = |i: usize| if i < 3 { couple } else { force };
        let local = Matrix6::from_fn(|i, j| {
            at.tangent[i][j] * if i < 3 { 1.0 } else { self.length } / unit(j)
        });
        Ok(RodEnd {
            section: self.outward(at, b, &())?,
            tangent: turned * local * turned.transpose(),
            steps: cost.steps,
        })
    }

    /// Sections at the arclengths `at`, in growing order in [0, L].
    ///
    /// # Errors
    /// As [`Rod::end`].
    pub fn shape(&self, base: &Wrench, at: &[f64], tolerance: f64) -> Result<Vec<RodSection>> {
        let b = self.inward(base);
        let scaled: Vec<f64> = at.iter().map(|s| s / self.length).collect();
        ivp::sections::<0>(&self.law, &b, tolerance, &scaled)?
            .iter()
            .map(|section| self.outward(section, &b, &()))
            .collect()
    }
}
