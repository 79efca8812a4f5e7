//! Stable equilibria of rods on clamps with free ends, found downhill in the energy.

use super::{HeavyAssembly, HeavyBalance, HeavyState};
use crate::error::{Error, Result};
use crate::full_mass::frames::Curve;
use crate::solve::positive_definite::definite;
use nalgebra::{DMatrix, DVector};

/// Largest number of steps of the search for an equilibrium.
const STEPS: usize = 400;
/// Largest number of shifts tried in a step.
const SHIFTS: usize = 60;
/// Residual, a couple in EI/length, at which the search stops, and the residual over 1 + that at the start at which
/// it has converged: under great loads rounding is a part of the latter.
const SOLVED: f64 = 1e-13;
const FOUND: f64 = 1e-8;
/// Stiffnesses above minus this, in units of EI/length and of the largest one, count as neutral.
const NEUTRAL: f64 = 1e-9;
const ROUNDING: f64 = 1e-13;
/// Mean strains over the rod, tried in order, by which a rod is bent away from an unstable equilibrium.
const ASIDE: [f64; 3] = [0.3, 0.03, 0.003];
/// Bend (flexures, twist, shear, stretch) along which a rod in space leaves an unstable equilibrium: it breaks every
/// symmetry.
const BEND: [f64; 6] = [0.6, 0.8, 0.01, 0.02, 0.01, 0.005];
/// If the unstable part of that bend is smaller than this, the rod leaves along the lowest mode instead.
const ACROSS: f64 = 1e-3;
/// Largest number of unstable equilibria left before the search gives up.
const MAX_UNSTABLE_LEFT: usize = 6;

/// A state at rest.
struct Resting {
    y: DVector<f64>,
    at: HeavyState,
    balance: HeavyBalance,
    /// Elastic energy and potential.
    energy: f64,
}

impl Resting {
    /// None where the strains are outside the domain of a law, or too large for a curve.
    fn new(rods: &HeavyAssembly, y: DVector<f64>) -> Option<Self> {
        let at = rods.at(&y)?;
        let balance = rods.balance(&at, &vec![0.0; rods.unknowns()])?;
        let ([_, _, elastic, potential], _) = rods.energies(&at)?;
        let energy = elastic + potential;
        Some(Self {
            y,
            at,
            balance,
            energy,
        })
    }

    /// Symmetric part of the stiffness.
    fn stiffness(&self, rods: &HeavyAssembly) -> Option<DMatrix<f64>> {
        let unknowns = vec![0.0; rods.unknowns()];
        let blocks = rods.blocks(&self.at, &self.balance, &unknowns)?;
        let whole = blocks.level(0).dense();
        Some((&whole + whole.transpose()) * 0.5)
    }
}

impl HeavyAssembly {
    /// True if strains alone change in a motion, and no end is held.
    pub(super) fn is_open(&self) -> bool {
        self.layout.free == 0 && self.multipliers() == 0
    }

    /// A stable equilibrium of open rods on standing clamps, searched from `y` downhill in the energy. Under loads
    /// without a potential stability is not decided.
    ///
    /// A symmetric rod in space, which may buckle to several sides alike, buckles to one of them.
    pub(super) fn fallen(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let mut found = self.descended(self.still(y))?;
        for _ in 0..MAX_UNSTABLE_LEFT {
            let Some(way) = self.way_down(&found)? else {
                return Ok(found.y);
            };
            let tries = ASIDE.iter();
            let mut tries = tries.map(|part| self.displaced(&found.y, &way, *part));
            let left = tries.find_map(|aside| self.descended(aside).ok());
            found = left.ok_or_else(unstable)?;
        }
        Err(unstable())
    }

    /// A descent direction of the strains, of mean size 1 over the rods, from an equilibrium; None if that is stable.
    fn way_down(&self, from: &Resting) -> Result<Option<DVector<f64>>> {
        if !self.is_conservative() {
            return Ok(None);
        }
        let scale = self.scale();
        let size = scale.len();
        let whole = from.stiffness(self).ok_or_else(outside)?;
        let stiffness = DMatrix::from_fn(size, size, |i, j| whole[(i, j)] * scale[i] * scale[j]);
        let neutral = NEUTRAL + ROUNDING * stiffness.amax();
        if definite(&(&stiffness + DMatrix::identity(size, size) * neutral)).is_some() {
            return Ok(None);
        }
        let eigen = stiffness.symmetric_eigen();
        let slope = from.balance.residual.component_mul(&scale);
        let lowest = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let planar = |link: &super::HeavyLink| link.rod.given.curve == Curve::Plane;
        let way = if self.links.iter().all(planar) {
            if slope.dot(&lowest) == 0.0 {
                return Err(Error::ambiguous(EITHER_SIDE));
            }
            lowest * -slope.dot(&lowest).signum()
        } else {
            let rods = self.links.iter().map(|link| &link.rod);
            let bend =
                rods.flat_map(|rod| rod.coordinates(&vec![BEND.into(); rod.sections.grid.len()]));
            let bend = DVector::from_iterator(size, bend)
                .component_div(&scale)
                .normalize();
            let falling = (0..size).filter(|i| eigen.eigenvalues[*i] < -neutral);
            let modes = falling.map(|i| eigen.eigenvectors.column(i));
            let bent = modes.fold(DVector::zeros(size), |sum, mode| {
                sum + mode * mode.dot(&bend)
            });
            let way = if bent.norm() > ACROSS {
                bent.normalize()
            } else {
                lowest.into_owned()
            };
            let uphill = slope.dot(&way) > NEUTRAL;
            way * if uphill { -1.0 } else { 1.0 }
        };
        Ok(Some(way.component_mul(&scale)))
    }

    /// An equilibrium, stable or not, downhill from a state at rest.
    fn descended(&self, y: DVector<f64>) -> Result<Resting> {
        let weights = self.scale();
        let size = |at: &Resting| at.balance.residual.component_mul(&weights).norm();
        let mut here = Resting::new(self, y).ok_or_else(outside)?;
        let first = size(&here);
        let mut shift = 0.0;
        for _ in 0..STEPS {
            let slope = here.stiffness(self).ok_or_else(outside)?;
            let mut taken = None;
            // A shift removes negative curvature: the step then leads downhill.
            for _ in 0..SHIFTS {
                let mut matrix = slope.clone();
                for (i, weight) in weights.iter().enumerate() {
                    matrix[(i, i)] += shift / (weight * weight);
                }
                let tried = matrix.cholesky().and_then(|factors| {
                    let step = -factors.solve(&here.balance.residual);
                    let next = Resting::new(self, self.displaced(&here.y, &step, 1.0))?;
                    let less = next.energy < here.energy || size(&next) < 0.5 * size(&here);
                    less.then_some(next)
                });
                if tried.is_some() {
                    taken = tried;
                    shift = if shift < 1e-3 { 0.0 } else { 0.2 * shift };
                    break;
                }
                shift = (4.0 * shift).max(1e-2);
            }
            let Some(next) = taken else {
                break;
            };
            here = next;
            if size(&here) <= SOLVED && shift == 0.0 {
                break;
            }
        }
        let left = size(&here);
        if left <= FOUND * (1.0 + first) {
            Ok(here)
        } else {
            Err(Error::unreachable(format!(
                "no equilibrium of the rod with its weight was found: the best leaves a couple of {left:.1e} EI/length; start from \
                 another shape, or from rest"
            )))
        }
    }
}

/// The message for a planar rod that can buckle to either side alike.
pub const EITHER_SIDE: &str = "the loads push the straight rod beyond the load at which it buckles, to either side alike; add a small load across the rod, or tilt \
                           the clamp a little, to choose one";

fn unstable() -> Error {
    Error::unreachable(
        "no stable equilibrium of the rod was found: every equilibrium that the search found is unstable; start from another shape, or from rest",
    )
}

fn outside() -> Error {
    Error::domain("the search for the equilibrium left the domain of the section law")
}
