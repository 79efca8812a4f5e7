//! Branches of equilibria of an assembly in one parameter, for the continuation of [`crate::solve::arclength`].

use super::body::Body;
use super::configuration::Configuration;
use super::equations::UnknownScales;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use super::zero_modes::FreePhase;
use crate::error::{Error, Result};
use crate::rod::Taut;
use crate::solve::difference_step::derivative;
use crate::solve::extrapolated_slope::{Slope, first_step};
use crate::solve::parametrised_problem::{Family, Linearised};
use crate::solve::warm_start::WarmStart;
use nalgebra::DVector;
use std::sync::Arc;

/// Change of the equations over which a difference by the parameter is taken.
const CHANGE: f64 = 1e-2;

/// Couples and forces of charts up to this size, in B/L and B/L^2, enter logarithmic unknowns nearly unscaled.
const SLACK: f64 = 10.0;
/// Gap from a taut rod to its attachment, in rod lengths and B/L, up to which later rods begin from this one.
const CLOSE: f64 = 0.05;

/// Assemblies in one parameter: loads, poses of supports, sections.
///
/// The unknowns of the bodies are rotation vectors and displacements (in mean rod lengths) from a reference
/// configuration. Those of the rods are the charts q, in B/L and B/L^2 of each, or x with q = 10 sinh(x/10)
/// ([`AssemblyFamily::with_logarithmic_charts`]).
///
/// The equations and their derivatives by the unknowns are exact. Those by the parameter are central differences, of
/// balance and gaps alone unless the parameter changes the rods. They only set directions: no point depends on them.
/// Motions that cost nothing by a symmetry ([`Assembly::zero_modes`]) keep the phase that they have at the reference,
/// and do not make the Jacobian singular.
pub struct AssemblyFamily<P> {
    at: P,
    frame: UnknownScales,
    bodies: usize,
    rods: usize,
    size: usize,
    /// True if large wrenches enter the unknowns by their logarithm.
    logarithmic: bool,
    /// Phase of the zero modes of the reference, if it has some.
    phase: Option<FreePhase>,
    /// The taut rods last solved, shared with the families made of this one.
    warm: Arc<[WarmStart<Taut>]>,
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
    /// Stored energy of the rods alone; that of tendons is tension times length.
    pub stored: f64,
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
        let frame = UnknownScales::new(&first, reference.bodies.iter().map(|place| place.pose));
        // A reference that cannot be evaluated has no phase.
        let phase = first.free_phase(&frame, reference, tolerance);
        Ok(Self {
            frame,
            phase: phase.unwrap_or_default(),
            bodies,
            rods,
            size: first.unknowns(),
            logarithmic: false,
            warm: (0..rods).map(|_| WarmStart::default()).collect(),
            changes_rods,
            step: step(changes_rods) * span.abs(),
            tolerance,
            at,
        })
    }

    /// The family with logarithms of the wrenches of taut rods as unknowns. A branch then takes about as many steps for
    /// each power of ten of its forces.
    #[must_use]
    pub fn with_logarithmic_charts(self) -> Self {
        Self {
            logarithmic: true,
            ..self
        }
    }

    /// Size of charts, in B/L and B/L^2, with unknowns of the given size.
    pub fn reach(&self, size: f64) -> f64 {
        if self.logarithmic {
            SLACK * (size / SLACK).sinh()
        } else {
            size
        }
    }

    /// Index of the first unknown of the rods' charts.
    fn first_of_charts(&self) -> usize {
        self.size - 6 * self.rods
    }

    /// Displacements of the bodies and charts at the unknowns x.
    fn plain(&self, x: &DVector<f64>) -> DVector<f64> {
        let first = self.first_of_charts();
        DVector::from_fn(
            x.len(),
            |i, _| {
                if i < first { x[i] } else { self.reach(x[i]) }
            },
        )
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
            logarithmic: self.logarithmic,
            phase: self.phase.clone(),
            warm: self.warm.clone(),
            changes_rods,
            step: step(changes_rods) * span.abs(),
            tolerance,
        }
    }

    /// The family with its unknowns counted from another reference, and with the charts themselves as unknowns.
    pub(super) fn counted_from(
        &self,
        frame: UnknownScales,
        phase: Option<FreePhase>,
    ) -> AssemblyFamily<impl Fn(f64) -> Result<Assembly> + use<'_, P>> {
        AssemblyFamily {
            at: |p| (self.at)(p),
            frame,
            bodies: self.bodies,
            rods: self.rods,
            size: self.size,
            logarithmic: false,
            phase,
            warm: self.warm.clone(),
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
        let mut x = self.frame.unknowns(&self.assembly(p)?, now);
        if self.logarithmic {
            let charts = x.iter_mut().skip(self.first_of_charts());
            charts.for_each(|q| *q = SLACK * (*q / SLACK).asinh());
        }
        Ok(x)
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
            stored: points.iter().map(|point| point.end.energy).sum(),
            now,
        })
    }

    /// Lets the taut rods of an assembly of the family begin from those last solved.
    pub fn warm(&self, assembly: &Assembly) {
        for (link, warm) in assembly.links().iter().zip(&*self.warm) {
            if let Some(last) = warm.last() {
                link.last_taut.keep(&last);
            }
        }
    }

    /// Keeps each taut rod whose end nearly meets its attachment, as a start for the next point.
    fn keep_warm(&self, assembly: &Assembly, points: &[LinkPoint]) {
        let rods = assembly.links().iter().zip(points).zip(&*self.warm);
        for ((link, point), warm) in rods {
            if let Some(taut) = point.end.taut()
                && (link.gap_scale(&point.end) * point.gap()).amax() < CLOSE
            {
                warm.keep(taut);
            }
        }
    }

    /// The assembly at p.
    pub(super) fn assembly(&self, p: f64) -> Result<Assembly> {
        let assembly = (self.at)(p)?;
        if assembly.unknowns() == self.size {
            self.warm(&assembly);
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
            let x = self.plain(x);
            return Ok(self.frame.configuration(assembly, x.as_slice()));
        }
        Err(Error::domain(format!(
            "the assembly has {} unknowns, not {}",
            self.size,
            x.len()
        )))
    }

    /// The evaluated rods at (x, p).
    fn points(&self, x: &DVector<f64>, p: f64) -> Result<Vec<LinkPoint>> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)
    }

    /// Residual at another parameter.
    fn residual(&self, x: &DVector<f64>, p: f64, known: &[LinkPoint]) -> Result<DVector<f64>> {
        let assembly = self.assembly(p)?;
        let now = self.configuration(&assembly, x)?;
        // A load along a rod depends on the parameter, or on the rotation of its base; a taut rod depends on its end.
        let bears = |link: &Link| link.is_loaded();
        let taut = |point: &LinkPoint| point.end.along.is_some() || point.end.is_taut();
        if self.changes_rods || known.iter().any(taut) || assembly.links().iter().any(bears) {
            let rods = assembly.links().iter().zip(&now.charts).zip(known);
            let points = rods.map(|((link, q), known)| {
                link.point_beside(&now.bodies, q, &known.end, self.tolerance)
            });
            let points = points.collect::<Result<Vec<_>>>()?;
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
        let plain = self.plain(x);
        self.frame.check(&assembly, plain.as_slice(), &now)?;
        Body::within_ends(assembly.carriers(), &now.bodies)?;
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        self.keep_warm(&assembly, &points);
        let mut residual = self.frame.residual(&assembly, &now.bodies, &points);
        let mut jacobian = self
            .frame
            .jacobian(&assembly, plain.as_slice(), &now.bodies, &points);
        if let Some(phase) = &self.phase {
            assembly.hold_phase(&plain, &now, &points, phase, &mut residual, &mut jacobian);
        }
        if self.logarithmic {
            for i in self.first_of_charts()..self.size {
                jacobian.column_mut(i).scale_mut((x[i] / SLACK).cosh());
            }
        }
        let slope = derivative(p, self.step, CHANGE, &|p| self.residual(x, p, &points))?;
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }

    fn by_parameter(&self, x: &DVector<f64>, p: f64, step: f64) -> Result<Slope> {
        let known = self.points(x, p)?;
        Slope::at(step, &mut |h| self.residual(x, p + h, &known))
    }

    fn first_step(&self, x: &DVector<f64>, p: f64) -> Result<f64> {
        let known = self.points(x, p)?;
        first_step(p, &mut |p| self.residual(x, p, &known))
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
