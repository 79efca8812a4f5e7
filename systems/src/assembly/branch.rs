//! Branches of equilibria of an assembly in one parameter, for the continuation of [`crate::solve::arclength`].

use super::body::Body;
use super::configuration::Configuration;
use super::equations::UnknownScales;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use crate::error::{Error, Result};
use crate::solve::difference_step::derivative;
use crate::solve::parametrised_problem::{Family, Linearised};
use nalgebra::DVector;

/// Change of the equations over which a difference by the parameter is taken.
const CHANGE: f64 = 1e-2;

/// Assemblies in one parameter: loads, poses of supports, sections.
///
/// The unknowns of the bodies are rotation vectors and displacements (in mean rod lengths) from a reference
/// configuration. Those of the rods are the charts, in B/L and B/L^2 of each.
///
/// The equations and their derivatives by the unknowns are exact. Those by the parameter are central differences, of
/// balance and gaps alone unless the parameter changes the rods. They only set directions: no point depends on them.
pub struct AssemblyFamily<P> {
    at: P,
    frame: UnknownScales,
    bodies: usize,
    rods: usize,
    size: usize,
    changes_rods: bool,
    step: f64,
    tolerance: f64,
}

/// A point of a branch of equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyState {
    /// Poses of the bodies and charts of the rods.
    pub now: Configuration,
    /// Stored energy and potential of the constant forces.
    pub energy: f64,
}

impl<P: Fn(f64) -> Result<Assembly>> AssemblyFamily<P> {
    /// The family `at(p)` for every p of a range of length `span`, all with the same bodies and rods in the same
    /// order. The configuration `reference` belongs to the value `p`, preferably an equilibrium. Set `changes_rods` if
    /// lengths, sections or rest strains depend on p. `tolerance` is that of the integration along the rods.
    ///
    /// # Errors
    /// A reference with other numbers of bodies or rods; the errors of the closure.
    pub fn new(
        at: P,
        reference: &Configuration,
        p: f64,
        changes_rods: bool,
        span: f64,
        tolerance: f64,
    ) -> Result<Self> {
        let first = at(p)?;
        let (bodies, rods) = (first.carriers().len(), first.links().len());
        if reference.bodies.len() != bodies || reference.charts.len() != rods {
            return Err(Error::domain(format!(
                "the reference of a branch has {} bodies and {} rods; the assembly has {bodies} and {rods}",
                reference.bodies.len(),
                reference.charts.len()
            )));
        }
        Ok(Self {
            frame: UnknownScales::new(&first, reference.bodies.iter().map(|place| place.pose)),
            bodies,
            rods,
            size: first.unknowns(),
            changes_rods,
            step: step(changes_rods) * span.abs(),
            tolerance,
            at,
        })
    }

    /// A family with the same unknowns in another parameter, or to another tolerance. The assemblies have the same
    /// bodies and rods.
    pub fn over<Q: Fn(f64) -> Result<Assembly>>(
        &self,
        at: Q,
        changes_rods: bool,
        span: f64,
        tolerance: f64,
    ) -> AssemblyFamily<Q> {
        AssemblyFamily {
            at,
            frame: self.frame.clone(),
            bodies: self.bodies,
            rods: self.rods,
            size: self.size,
            changes_rods,
            step: step(changes_rods) * span.abs(),
            tolerance,
        }
    }

    /// The family with its unknowns counted from another reference.
    pub(super) fn counted_from(
        &self,
        frame: UnknownScales,
    ) -> AssemblyFamily<impl Fn(f64) -> Result<Assembly> + use<'_, P>> {
        AssemblyFamily {
            at: |p| (self.at)(p),
            frame,
            bodies: self.bodies,
            rods: self.rods,
            size: self.size,
            changes_rods: self.changes_rods,
            step: self.step,
            tolerance: self.tolerance,
        }
    }

    /// Tolerance of the integration along the rods.
    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Unknowns of a configuration at p.
    ///
    /// # Errors
    /// Another number of bodies or rods; the errors of the closure.
    pub fn unknowns(&self, now: &Configuration, p: f64) -> Result<DVector<f64>> {
        if (now.bodies.len(), now.charts.len()) != (self.bodies, self.rods) {
            return Err(Error::domain(format!(
                "a configuration of {} bodies and {} rods is none of an assembly of {} and {}",
                now.bodies.len(),
                now.charts.len(),
                self.bodies,
                self.rods
            )));
        }
        Ok(self.frame.unknowns(&self.assembly(p)?, now))
    }

    /// Configuration and energy at a point of the branch.
    ///
    /// # Errors
    /// Those of the closure and of the rods; another number of unknowns.
    pub fn state(&self, x: &DVector<f64>, p: f64) -> Result<AssemblyState> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        Ok(AssemblyState {
            energy: assembly.statical_energy(&now, &points),
            now,
        })
    }

    /// The assembly at p.
    pub(super) fn assembly(&self, p: f64) -> Result<Assembly> {
        let assembly = (self.at)(p)?;
        if assembly.unknowns() == self.size {
            return Ok(assembly);
        }
        Err(Error::domain(format!(
            "the assemblies of a branch have the same bodies and rods: at {p} there are {} unknowns, at its reference {}",
            assembly.unknowns(),
            self.size
        )))
    }

    pub(super) fn configuration(
        &self,
        assembly: &Assembly,
        x: &DVector<f64>,
    ) -> Result<Configuration> {
        if x.len() == self.size {
            return Ok(self.frame.configuration(assembly, x.as_slice()));
        }
        Err(Error::domain(format!(
            "the assembly has {} unknowns, not {}",
            self.size,
            x.len()
        )))
    }

    /// Residual at another parameter.
    fn residual(&self, x: &DVector<f64>, p: f64, known: &[LinkPoint]) -> Result<DVector<f64>> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        // A load along a rod depends on the parameter, or on the rotation of its base.
        let bears = |link: &Link| link.is_loaded();
        let loaded = known.iter().any(|point| point.end.along.is_some());
        if self.changes_rods || loaded || assembly.links().iter().any(bears) {
            let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
            return Ok(self.frame.residual(&assembly, &now.bodies, &points));
        }
        // The rods are integrated once for both differences.
        let points = assembly
            .links()
            .iter()
            .zip(known)
            .map(|(link, known)| link.placed(0.0, &now.bodies, known.end.clone()));
        Ok(self
            .frame
            .residual(&assembly, &now.bodies, &points.collect::<Vec<_>>()))
    }
}

/// Step of the differences by the parameter, relative to its range.
fn step(changes_rods: bool) -> f64 {
    if changes_rods { 1e-4 } else { 1e-5 }
}

impl<P: Fn(f64) -> Result<Assembly>> Family for AssemblyFamily<P> {
    fn size(&self) -> usize {
        self.size
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        self.frame.check(&assembly, x.as_slice(), &now)?;
        Body::within_ends(assembly.carriers(), &now.bodies)?;
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        let residual = self.frame.residual(&assembly, &now.bodies, &points);
        let jacobian = self
            .frame
            .jacobian(&assembly, x.as_slice(), &now.bodies, &points);
        let slope = derivative(p, self.step, CHANGE, |p| self.residual(x, p, &points))?;
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }

    fn index(&self, x: &DVector<f64>, p: f64) -> Result<Option<usize>> {
        let assembly = self.assembly(p)?;
        // Loads that turn with bodies have no potential: no index, and only singular tangents are special.
        if assembly.is_followed(0.0) {
            return Ok(None);
        }
        let now = self.configuration(&assembly, x)?;
        assembly
            .index(0.0, &now, self.tolerance.max(1e-11))
            .map(Some)
    }
}
