//! Branches of equilibria of an assembly as a parameter moves.

use super::equations::Frame;
use super::padded::{self, Equations};
use super::{Assembly, Configuration, LinkPoint};
use crate::error::{Error, Result};
use crate::solve::arclength::{Options, Stop};
use crate::solve::special::{SpecialKind, Status};
use nalgebra::{DMatrix, DVector};

/// The tightest tolerance of the integration along rods.
const FINEST: f64 = 1e-14;

/// Assemblies in one parameter: loads, places of supports, sections.
///
/// The equations and their derivatives by the unknowns are exact; those by the parameter are central differences, of balance
/// and gaps alone unless the parameter changes the rods. They only set directions: no point depends on them.
pub struct AssemblyFamily<P> {
    at: P,
    changes_rods: bool,
    step: f64,
    tolerance: f64,
}

/// A point of a branch of equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyPoint {
    /// The parameter.
    pub parameter: f64,
    /// Arclength along the branch in the unknowns without dimension.
    pub arclength: f64,
    /// Where everything is.
    pub now: Configuration,
    /// Stored energy and potential of the constant forces.
    pub energy: f64,
    /// Morse index with the bodies free; None where it is not defined.
    pub index: Option<usize>,
    /// Estimated distance from the branch.
    pub error: f64,
}

/// A special point of a branch of equilibria.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblySpecial {
    /// What it is; a fold is a limit point of the parameter.
    pub kind: SpecialKind,
    /// Whether it was located.
    pub status: Status,
    /// The place.
    pub point: AssemblyPoint,
    /// Bound of the error of the parameter, that of the integration along the rods included.
    pub error: f64,
    /// Estimated error of the arclength.
    pub error_s: f64,
    /// Arclengths between which it lies.
    pub interval: (f64, f64),
    /// Index before and after.
    pub index: (Option<usize>, Option<usize>),
    /// True of a branch point at which the parameter turns as well.
    pub turning: bool,
}

/// A branch of equilibria.
#[derive(Debug, Clone)]
pub struct AssemblyBranch {
    /// In the order in which they were found.
    pub points: Vec<AssemblyPoint>,
    /// Folds, branch points, changes of stability.
    pub specials: Vec<AssemblySpecial>,
    /// Why it ended.
    pub stop: Stop,
    /// True if it was interrupted.
    pub interrupted: bool,
}

impl<P: Fn(f64) -> Result<Assembly>> AssemblyFamily<P> {
    /// `at(p)` for every p of a range of length `span`, all with the same bodies and rods in the same order; `changes_rods` if
    /// lengths, sections or rest strains depend on p. `tolerance` is that of the integration along the rods.
    pub fn new(at: P, changes_rods: bool, span: f64, tolerance: f64) -> Self {
        let step = if changes_rods { 1e-4 } else { 1e-5 };
        Self {
            at,
            changes_rods,
            step: step * span.abs(),
            tolerance,
        }
    }

    /// The branch of equilibria through that near `start`, at the parameter `options.from`. Steps are in the unknowns without
    /// dimension (rotations, displacements in mean lengths of the rods, charts in B/L and B/L^2) and in the parameter times
    /// `options.weight`.
    ///
    /// # Errors
    /// No equilibrium near `start`; a start at a limit point; options outside their sets; more than 72 unknowns; the errors of the
    /// closure.
    pub fn branch(&self, start: &Configuration, options: &Options) -> Result<AssemblyBranch> {
        self.branch_while(start, options, &mut |_| true)
    }

    /// The same, as long as `go_on`, told the parameter at every point, says yes.
    ///
    /// # Errors
    /// As [`AssemblyFamily::branch`].
    pub fn branch_while(
        &self,
        start: &Configuration,
        options: &Options,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<AssemblyBranch> {
        let first = (self.at)(options.from)?;
        if start.bodies.len() != first.carriers().len() || start.charts.len() != first.links().len()
        {
            return Err(Error::domain(
                "the start of the branch has other numbers of bodies or rods than the assembly",
            ));
        }
        let frame = Frame::new(&first, start.bodies.iter().map(|place| place.pose));
        let x = frame.unknowns(&first, start);
        let framed = |tolerance: f64, step: f64| Framed {
            family: self,
            frame: frame.clone(),
            size: x.len(),
            tolerance,
            step: step * self.step,
        };
        // Two ways to compute the same special points with other errors.
        let finer = [(30.0, 0.4), (1000.0, 0.7)];
        let finer = finer.map(|(by, step)| framed((self.tolerance / by).max(FINEST), step));
        let finer = finer.each_ref().map(|finer| finer as &dyn Equations);
        let framed = framed(self.tolerance, 1.0);
        let followed = padded::follow(&framed, &finer, (&x, options.from), options, go_on)?;
        let points = followed.points.iter().map(|on| framed.point(on));
        let specials = followed.specials.iter().map(|special| {
            Ok(AssemblySpecial {
                kind: special.kind,
                status: special.status.clone(),
                point: framed.point(&special.at)?,
                error: special.error_p,
                error_s: special.error_s,
                interval: special.interval,
                index: special.index,
                turning: special.turning,
            })
        });
        Ok(AssemblyBranch {
            points: points.collect::<Result<_>>()?,
            specials: specials.collect::<Result<_>>()?,
            stop: followed.stop,
            interrupted: followed.interrupted,
        })
    }
}

/// A family in a frame.
struct Framed<'a, P> {
    family: &'a AssemblyFamily<P>,
    frame: Frame,
    size: usize,
    tolerance: f64,
    step: f64,
}

impl<P: Fn(f64) -> Result<Assembly>> Framed<'_, P> {
    fn point(&self, on: &padded::On) -> Result<AssemblyPoint> {
        let assembly = (self.family.at)(on.p)?;
        let now = self.frame.configuration(&assembly, on.x.as_slice());
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        Ok(AssemblyPoint {
            parameter: on.p,
            arclength: on.arclength,
            energy: assembly.statical_energy(&now, &points),
            index: on.index,
            error: on.error,
            now,
        })
    }

    /// The equations at another parameter.
    fn residual(&self, x: &[f64], p: f64, known: &[LinkPoint]) -> Result<DVector<f64>> {
        let assembly = (self.family.at)(p)?;
        let now = self.frame.configuration(&assembly, x);
        if self.family.changes_rods {
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

impl<P: Fn(f64) -> Result<Assembly>> Equations for Framed<'_, P> {
    fn size(&self) -> usize {
        self.size
    }

    fn linearised(&self, x: &[f64], p: f64) -> Result<(DVector<f64>, DMatrix<f64>, DVector<f64>)> {
        let assembly = (self.family.at)(p)?;
        let now = self.frame.configuration(&assembly, x);
        self.frame.check(&assembly, x, &now)?;
        let points = assembly.points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        let residual = self.frame.residual(&assembly, &now.bodies, &points);
        let jacobian = self.frame.jacobian(&assembly, x, &now.bodies, &points);
        let h = self.step;
        let slope = match (
            self.residual(x, p + h, &points),
            self.residual(x, p - h, &points),
        ) {
            (Ok(after), Ok(before)) => (after - before) / (2.0 * h),
            (Ok(after), Err(_)) => (after - &residual) / h,
            (Err(_), Ok(before)) => (&residual - before) / h,
            (Err(why), Err(_)) => return Err(why),
        };
        Ok((residual, jacobian, slope))
    }

    fn index(&self, x: &[f64], p: f64) -> Result<Option<usize>> {
        let assembly = (self.family.at)(p)?;
        // Loads that turn with bodies have no potential: no index, and only singular tangents are special.
        if assembly.is_followed(0.0) {
            return Ok(None);
        }
        let now = self.frame.configuration(&assembly, x);
        assembly
            .index(0.0, &now, self.tolerance.max(1e-11))
            .map(Some)
    }
}
