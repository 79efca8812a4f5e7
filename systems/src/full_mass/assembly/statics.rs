//! Statics of rods with mass: closing of gaps, equilibria with weight near a state.

use super::block_elimination::{BlockVector, LevelCombination};
use super::{HeavyAssembly, HeavyState, attachment_kinematics};
use crate::assembly::{AttachedTo, Body};
use crate::error::{Error, Result};
use crate::full_mass::rod::RodDescription;
use nalgebra::{DVector, Vector3};

/// Largest number of Newton steps towards an equilibrium.
const STEPS: usize = 60;
/// Largest step in strains and poses, relative to 1 + the largest of them.
const LONGEST: f64 = 0.3;
/// Relative step at which Newton's method has converged.
const SHORT: f64 = 1e-12;
/// If Newton's method stalls on rounding, a relative step below this counts as converged.
const NEARLY: f64 = 1e-8;
/// Number of rounds for closing gaps of positions; one round for velocities follows.
const ROUNDS: usize = 3;
/// Gaps beyond this, in radians and lengths, are not closed.
const FAR: f64 = 0.1;
/// Singular values below this, relative to the largest, are zero.
pub(super) const DEPENDENT: f64 = 1e-11;
/// Multiple of the mass that Newton's matrix adds to the stiffness of an assembly with a free direction. It is far
/// below the squares of the frequencies and far above rounding, and changes the steps alone.
const HOLD: f64 = 1e-2;

impl HeavyAssembly {
    /// Gaps of all held ends (0), or rates of the gaps (1).
    pub(super) fn gaps(&self, at: &HeavyState, which: usize) -> DVector<f64> {
        let rods = self.links.iter().enumerate();
        let gaps = rods.flat_map(|(k, link)| {
            let parts = at.apart(k).zip(link.to.as_ref());
            let parts = parts.map(|(apart, tie)| apart[which].as_slice()[tie.rows()].to_vec());
            parts.unwrap_or_default()
        });
        DVector::from_vec(gaps.collect())
    }

    /// Largest gap between ends and attachments, in radians and lengths; and largest rate of a gap.
    pub fn gap(&self, at: &HeavyState) -> [f64; 2] {
        [0, 1].map(|which| self.gaps(at, which).amax())
    }

    /// The nearest state without gaps between ends and attachments in pose and velocity: nearest in strains, in the
    /// mean over the rods, and in poses.
    ///
    /// # Errors
    /// Ends that are farther apart than 0.1, or cannot be brought together.
    pub fn closed(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let mut y = y.clone();
        if self.multipliers() == 0 {
            return Ok(y);
        }
        let outside = || Error::domain("the strains give no shape of the rods");
        for round in 0..=ROUNDS {
            let at = self.at(&y).ok_or_else(outside)?;
            let gap = self.gap(&at)[0];
            if !(gap <= FAR) {
                return Err(Error::domain(format!(
                    "an end of a rod is {gap:.1e} (radians or lengths) away from its attachment at the start; give shapes that fit together"
                )));
            }
            // Places first, then velocities.
            let which = usize::from(round == ROUNDS);
            let change = self.bridged(&at, which);
            match which {
                0 => self.displace(&mut y, &change, 1.0),
                _ => self.accelerate(&mut y, &change),
            }
        }
        Ok(y)
    }

    /// Smallest change of strains and poses, or of rates and velocities, that closes the gaps.
    fn bridged(&self, at: &HeavyState, which: usize) -> BlockVector<f64> {
        let gaps = self.gaps(at, which);
        let ends = self.ends(at);
        let mut weighted = ends.clone();
        for (mut column, scale) in weighted.column_iter_mut().zip(self.scale().iter()) {
            column *= scale * scale;
        }
        let metric = &weighted * ends.transpose();
        let found = metric.svd(true, true).solve(&gaps, DEPENDENT);
        let wrench = found.unwrap_or_else(|_| DVector::zeros(gaps.len()));
        self.change(&weighted.tr_mul(&wrench))
    }

    /// Adds displacements of bodies, bases and strains; the loads of Maxwell branches stay.
    pub(super) fn displace(&self, y: &mut DVector<f64>, change: &BlockVector<f64>, part: f64) {
        let places = self.places(y);
        let slots = y.as_mut_slice();
        for (slot, z, _) in &places.turns {
            let by = [0, 1, 2].map(|i| change.free[z + i] * part);
            let turned = attachment_kinematics::turned(&slots[*slot..slot + 4], &by);
            slots[*slot..slot + 4].copy_from_slice(&turned);
        }
        for (slot, range) in &places.shifts {
            for (i, z) in range.clone().enumerate() {
                slots[slot + i] += change.free[z] * part;
            }
        }
        for (range, change) in places.strains.iter().zip(&change.rods) {
            for (x, dx) in slots[range.clone()].iter_mut().zip(change.iter()) {
                *x += dx * part;
            }
        }
        for (range, change) in places.dashpots.iter().zip(&change.rods) {
            let slots = &mut slots[range.clone()];
            for (z, dx) in slots.iter_mut().zip(change.iter().cycle()) {
                *z += dx * part;
            }
        }
    }

    /// Adds velocities and rates.
    pub(super) fn accelerate(&self, y: &mut DVector<f64>, change: &BlockVector<f64>) {
        let places = self.places(y);
        for (slot, range) in &places.velocities {
            for (i, z) in range.clone().enumerate() {
                y[slot + i] += change.free[z];
            }
        }
        for (range, change) in places.rates.iter().zip(&change.rods) {
            let mut rates = y.rows_mut(range.start, range.len());
            rates += change;
        }
    }

    /// The state at rest, with Maxwell branches relaxed.
    pub(super) fn still(&self, y: &DVector<f64>) -> DVector<f64> {
        let mut y = y.clone();
        let places = self.places(&y);
        for (slot, range) in &places.velocities {
            y.rows_mut(*slot, range.len()).fill(0.0);
        }
        for range in &places.rates {
            y.rows_mut(range.start, range.len()).fill(0.0);
        }
        self.relaxed(y, &[])
    }

    /// True if a rod or a groove holds a body on the ground or on a support; if not, all of the assembly can
    /// translate.
    pub fn is_held(&self) -> bool {
        self.ties()
            .any(|tie| !matches!(tie.on.on, AttachedTo::Body(_)))
            || self.carriers.iter().any(|body| body.groove().is_some())
    }

    /// Index of the first translation of each body among the velocities.
    fn shifts(&self) -> impl Iterator<Item = usize> {
        let bodies = self.carriers.iter().zip(&self.layout.velocities);
        bodies.map(|(carrier, start)| start + carrier.turnings())
    }

    /// Sets the accelerations of an unsupported assembly under its loads at rest: free fall. Others, at rest, have
    /// none.
    pub(super) fn let_fall(&self, at: &HeavyState, unknowns: &mut DVector<f64>) -> Option<()> {
        let ties = self.multipliers();
        unknowns.rows_mut(0, self.unknowns() - ties).fill(0.0);
        if self.is_held() {
            return Some(());
        }
        let left = self.balance(at, unknowns.as_slice())?.residual;
        let force: Vector3<f64> = self.shifts().map(|i| -left.fixed_rows::<3>(i)).sum();
        let bodies = self.carriers.iter().map(|body| body.mass().mass());
        let rods = self.links.iter().map(|link| link.rod.given.mass);
        let fall = force / bodies.chain(rods).sum::<f64>();
        for i in self.shifts() {
            unknowns.fixed_rows_mut::<3>(i).copy_from(&fall);
        }
        Some(())
    }

    /// An equilibrium near the state `y` under the loads at time 0, the weight of the rods included, at rest and with
    /// fixed clamps and supports. Rods on the ground with free ends fall to a stable one; Newton's method finds those
    /// of other assemblies, stable or not. An unsupported assembly is in equilibrium in free fall, and stays near its
    /// place.
    ///
    /// # Errors
    /// A law left on the way; none found; a load at one place of a rod; a planar rod that may buckle to either side
    /// alike.
    pub fn settled(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        self.without_point_loads()?;
        let standing = self.standing_at(0.0);
        if standing.is_open() {
            standing.fallen(y)
        } else {
            standing.balanced(y)
        }
    }

    /// An error if a load acts at one place of a rod, which strains at nodes do not carry.
    pub(super) fn without_point_loads(&self) -> Result<()> {
        let mut rods = self.links.iter().map(|link| &link.rod.given);
        if !rods.any(RodDescription::has_point_loads) {
            return Ok(());
        }
        Err(Error::domain(
            "a load at one place of a rod with mass: the equilibrium under it is not sought; start from rest = \"straight\", or write a short \
             part of the rod, from and to, with the load per length",
        ))
    }

    fn balanced(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let held = || self.newton(y, &[(1.0, 0), (HOLD, 2)]);
        if self.is_held() {
            // A buckled round rod can turn about its load at no cost: the added mass fixes that rotation.
            (self.newton(y, &[(1.0, 0)])).or_else(|why| held().map_err(|_| why))
        } else {
            held()
        }
    }

    /// Newton's method. The matrix is the sum of the `levels`: (factor, level of the derivative, see [`Blocks`]).
    fn newton(&self, y: &DVector<f64>, levels: &[(f64, usize)]) -> Result<DVector<f64>> {
        let outside =
            || Error::domain("the search for the equilibrium left the domain of a section law");
        let mut y = self.still(y);
        let begun = self.at(&y).ok_or_else(outside)?;
        let mut unknowns = self.at_rest(&begun).ok_or_else(rigid)?;
        let mix = LevelCombination {
            balance: levels,
            ends: &[(1.0, 2)],
            memory: None,
        };
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let at = self.at(&y).ok_or_else(outside)?;
            self.let_fall(&at, &mut unknowns).ok_or_else(outside)?;
            let balance = self.balance(&at, unknowns.as_slice()).ok_or_else(outside)?;
            let blocks = self
                .blocks(&at, &balance, unknowns.as_slice())
                .ok_or_else(outside)?;
            let mut change = self.sides(&-&balance.residual);
            let ties = self.multipliers();
            let mut ends = change.free.rows_mut(self.layout.free, ties);
            ends.copy_from(&self.gaps(&at, 0));
            let matrix = blocks.factored(&mix);
            if !matrix.ok_or_else(rigid)?.solve(&mut change) {
                return Err(rigid());
            }
            let size = |x: &DVector<f64>| x.amax();
            let free = change.free.rows(0, self.layout.free).amax();
            let step = change.rods.iter().map(size).fold(free, f64::max);
            let strains = (0..self.links.len()).flat_map(|k| self.strains(&y, k).iter());
            let scale = strains.fold(1.0, |most: f64, e| most.max(e.abs()));
            let part = (LONGEST * scale / step).min(1.0);
            self.displace(&mut y, &change, part);
            for (i, x) in change.free.iter().skip(self.layout.free).enumerate() {
                unknowns[self.unknowns() - ties + i] += x * part;
            }
            if step <= SHORT * scale || (step <= NEARLY * scale && step >= 0.5 * last) {
                let bodies = self.carriers.iter().zip(&self.layout.bodies);
                let places = bodies.map(|(body, range)| body.read(&y.as_slice()[range.clone()]));
                Body::within_ends(&self.carriers, &places.collect::<Vec<_>>())?;
                return Ok(y);
            }
            last = step;
        }
        Err(Error::no_convergence(
            "no equilibrium of the assembly with the weight of its rods was found near that without it: start from rest = \"straight\", or \
             near another shape",
        ))
    }
}

pub(super) fn rigid() -> Error {
    Error::ill_conditioned(
        "the rods hold each other in more ways than they can deform: straight inextensible rods close a loop; let the rods stretch (axial \
         stiffness), or bend them",
    )
}
