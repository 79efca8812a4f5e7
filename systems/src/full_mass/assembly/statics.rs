//! Statics of assemblies with heavy rods: closing of gaps, equilibria with weight, rates tangent to the equilibria.

use super::block_elimination::{BlockVector, Blocks, LevelCombination};
use super::{HeavyAssembly, HeavyState, attachment_kinematics};
use crate::assembly::{AttachedTo, BodyMotion, HeavyBody};
use crate::error::{Error, Result};
use crate::full_mass::mass::Mass;
use crate::full_mass::statics::TURN;
use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use std::ops::Range;

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
    /// Largest gap between ends and attachments, in radians and lengths; and largest rate of a gap.
    pub fn gap(&self, at: &HeavyState) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for (k, link) in self.links.iter().enumerate() {
            if let (Some(apart), Some(tie)) = (at.apart(k), &link.to) {
                for (worst, apart) in worst.iter_mut().zip(apart) {
                    let part = &apart.as_slice()[tie.rows()];
                    *worst = part.iter().fold(*worst, |worst, x| worst.max(x.abs()));
                }
            }
        }
        worst
    }

    /// The nearest state without gaps between ends and attachments in pose and velocity: nearest in strains, in the
    /// mean over the rods, and in poses.
    ///
    /// # Errors
    /// Ends that are farther apart than 0.1, or cannot be brought together.
    pub fn closed(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let mut y = y.clone();
        let outside = || Error::domain("the strains give no shape of the rods");
        for round in 0..=ROUNDS {
            let at = self.at(&y).ok_or_else(outside)?;
            let gap = self.gap(&at)[0];
            if !(gap <= FAR) {
                return Err(Error::domain(format!(
                    "an end of a rod is {gap:.1e} (radians or lengths) away from its attachment at the start; give shapes that fit together"
                )));
            }
            let blocks = self.mass_blocks(&at).ok_or_else(outside)?;
            // Places first, then velocities.
            let which = usize::from(round == ROUNDS);
            let change = self.bridged(&at, &blocks, which);
            match which {
                0 => self.displace(&mut y, &change, 1.0),
                _ => self.accelerate(&mut y, &change),
            }
        }
        Ok(y)
    }

    /// Smallest change of strains and poses, or of rates and velocities, that closes the gaps.
    fn bridged(&self, at: &HeavyState, blocks: &Blocks, which: usize) -> BlockVector<f64> {
        let free = self.layout.free;
        let (mut gaps, mut rows) = (Vec::new(), Vec::new());
        for (k, link) in self.links.iter().enumerate() {
            if let (Some(apart), Some(tie)) = (at.apart(k), &link.to) {
                gaps.extend_from_slice(&apart[which].as_slice()[tie.rows()]);
                rows.extend(tie.rows().map(|_| k));
            }
        }
        let held = gaps.len();
        let mut metric = DMatrix::zeros(held, held);
        let mut first = 0;
        let mut ends = DMatrix::zeros(held, free);
        for (k, link) in self.links.iter().enumerate() {
            let [own, by_free] = blocks.level(0).end(k);
            let mut scaled = own.clone();
            for (mut column, scale) in scaled.column_iter_mut().zip(link.rod.norm_weights().iter())
            {
                column *= scale * scale;
            }
            let c = own.nrows();
            metric
                .view_mut((first, first), (c, c))
                .copy_from(&(scaled * own.transpose()));
            ends.rows_mut(first, c).copy_from(by_free);
            first += c;
        }
        metric += &ends * ends.transpose();
        let gaps = DVector::from_vec(gaps);
        let found = metric.svd(true, true).solve(&gaps, DEPENDENT);
        let wrench = found.unwrap_or_else(|_| DVector::zeros(held));
        let mut change = BlockVector {
            rods: Vec::with_capacity(self.links.len()),
            free: DVector::zeros(free + held),
        };
        change
            .free
            .rows_mut(0, free)
            .copy_from(&ends.tr_mul(&wrench));
        let mut first = 0;
        for (k, link) in self.links.iter().enumerate() {
            let [own, _] = blocks.level(0).end(k);
            let scale = link.rod.norm_weights();
            let push = own.tr_mul(&wrench.rows(first, own.nrows()));
            change
                .rods
                .push(push.component_mul(&scale).component_mul(&scale));
            first += own.nrows();
        }
        change
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
    fn is_held(&self) -> bool {
        let ties = self.links.iter();
        let mut ties = ties.flat_map(|link| std::iter::once(&link.from).chain(&link.to));
        ties.any(|tie| !matches!(tie.on.on, AttachedTo::Body(_)))
            || self.carriers.iter().any(|body| body.groove().is_some())
    }

    /// Index of the first translation of each body among the velocities.
    fn shifts(&self) -> impl Iterator<Item = usize> {
        let bodies = self.carriers.iter().zip(&self.layout.velocities);
        bodies.map(|(carrier, start)| start + carrier.turnings())
    }

    /// Acceleration of an unsupported assembly under its loads at rest: free fall.
    fn fall(&self, at: &HeavyState, unknowns: &DVector<f64>) -> Option<Vector3<f64>> {
        let left = self.balance(at, unknowns.as_slice())?.residual;
        let force: Vector3<f64> = self.shifts().map(|i| -left.fixed_rows::<3>(i)).sum();
        let bodies = self.masses.iter().map(Mass::mass);
        let rods = self.links.iter().map(|link| link.rod.given.mass);
        Some(force / bodies.chain(rods).sum::<f64>())
    }

    /// An equilibrium near the state `y` under the loads at time 0, the weight of the rods included, at rest and with
    /// fixed supports, by Newton's method. An unsupported assembly is in equilibrium in free fall, and stays near its
    /// place.
    ///
    /// # Errors
    /// A law left on the way; none found.
    pub fn settled(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        self.standing_at(0.0).balanced(y)
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
        let mut unknowns = self
            .accelerations(&self.at(&y).ok_or_else(outside)?)
            .ok_or_else(rigid)?;
        let stands = self.is_held();
        let mix = LevelCombination {
            balance: levels,
            ends: &[(1.0, 2)],
            memory: None,
        };
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let inner = self.layout.wrenches.iter().map(Range::len);
            let held: usize = inner.sum();
            // At rest only an unsupported assembly accelerates.
            unknowns.rows_mut(0, self.unknowns() - held).fill(0.0);
            let at = self.at(&y).ok_or_else(outside)?;
            if !stands {
                let fall = self.fall(&at, &unknowns).ok_or_else(outside)?;
                for i in self.shifts() {
                    unknowns.fixed_rows_mut::<3>(i).copy_from(&fall);
                }
            }
            let balance = self.balance(&at, unknowns.as_slice()).ok_or_else(outside)?;
            let blocks = self
                .blocks(&at, &balance, unknowns.as_slice())
                .ok_or_else(outside)?;
            let mut change = self.sides(&-&balance.residual);
            let mut row = self.layout.free;
            for (k, link) in self.links.iter().enumerate() {
                if let (Some([apart, _]), Some(tie)) = (at.apart(k), &link.to) {
                    for i in tie.rows() {
                        change.free[row] = apart[i];
                        row += 1;
                    }
                }
            }
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
                unknowns[self.unknowns() - held + i] += x * part;
            }
            if step <= SHORT * scale || (step <= NEARLY * scale && step >= 0.5 * last) {
                let bodies = self.carriers.iter().zip(&self.layout.bodies);
                let places = bodies.map(|(body, range)| body.read(&y.as_slice()[range.clone()]));
                HeavyBody::within_ends(&self.carriers, &places.collect::<Vec<_>>())?;
                return Ok(y);
            }
            last = step;
        }
        Err(Error::no_convergence(
            "no equilibrium of the assembly with the weight of its rods was found near that without it: start from rest = \"straight\", or \
             near another shape",
        ))
    }

    /// Rate of the balance at rest, of rods, bodies and bases, as supports turn: relative to a support the weight of
    /// its rods turns.
    fn drift(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let supports = || {
            self.links.iter().filter_map(|link| match &link.from.on.on {
                AttachedTo::Support(support) => Some(support.at(0.0).spin_rate()),
                _ => None,
            })
        };
        let fastest = supports().fold(0.0, f64::max);
        if fastest == 0.0 {
            return Ok(DVector::zeros(self.scale().len()));
        }
        let outside = || Error::domain("the strains are outside the domain of a section law");
        let still = self.still(y);
        let here = self.standing_at(0.0);
        let at = here.at(&still).ok_or_else(outside)?;
        let mut unknowns = here.accelerations(&at).ok_or_else(rigid)?;
        let wrenches: usize = self.layout.wrenches.iter().map(Range::len).sum();
        unknowns.rows_mut(0, self.unknowns() - wrenches).fill(0.0);
        let step = TURN / (1.0 + fastest);
        let turned = |by: f64| -> Result<DVector<f64>> {
            let there = self.standing_at(by);
            let balance = there
                .at(&still)
                .and_then(|at| there.balance(&at, unknowns.as_slice()));
            let sides = there.sides(&balance.ok_or_else(outside)?.residual);
            let rods = sides.rods.iter().flat_map(|rod| rod.iter());
            let free = sides.free.iter().take(self.layout.free);
            Ok(DVector::from_iterator(
                self.scale().len(),
                rods.chain(free).copied(),
            ))
        };
        Ok((turned(step)? - turned(-step)?) / (2.0 * step))
    }

    /// State with these twists of the bodies (angular first), in which the rods follow as if without mass: their
    /// rates are tangent to the equilibria with the bodies held.
    ///
    /// # Errors
    /// Velocities that the rods cannot follow: a straight inextensible rod cannot be stretched.
    pub fn following(&self, y: &DVector<f64>, twists: &[Vector6<f64>]) -> Result<DVector<f64>> {
        let mut y = self.still(y);
        let bodies = self.carriers.iter().zip(&self.layout.bodies).zip(twists);
        let mut moves = false;
        for ((carrier, range), twist) in bodies {
            let numbers = &mut y.as_mut_slice()[range.clone()];
            let place = BodyMotion {
                twist: *twist,
                ..carrier.read(numbers)
            };
            carrier.write(&place, numbers);
            moves |= *twist != Vector6::zeros();
        }
        let at = self.at(&y);
        let at = at.ok_or_else(|| Error::domain("the strains give no shape of the rods"))?;
        let driven = self.gap(&at)[1] > 0.0;
        if !moves && !driven {
            return Ok(y);
        }
        let ([stiffness, ..], ends) = self.standing_at(0.0).small(&y)?;
        let scale = self.scale();
        let size = stiffness.nrows();
        let first = size - self.layout.free;
        let own = |carrier: &HeavyBody| carrier.freedoms();
        let held: usize = self.carriers.iter().map(own).sum();
        // Rods, then the free bases; the bodies are held.
        let unknown: Vec<usize> = (0..first).chain(first + held..size).collect();
        let (n, c) = (unknown.len(), ends.nrows());
        let mut whole = DMatrix::zeros(n + c, n + c);
        for (i, p) in unknown.iter().enumerate() {
            for (j, r) in unknown.iter().enumerate() {
                whole[(i, j)] = stiffness[(*p, *r)] * scale[*p] * scale[*r];
            }
            for k in 0..c {
                whole[(n + k, i)] = ends[(k, *p)] * scale[*p];
                whole[(i, n + k)] = -whole[(n + k, i)];
            }
        }
        let mut z = DVector::zeros(size);
        let places = self.places(&y);
        for (slot, range) in &places.velocities {
            z.rows_mut(first + range.start, range.len())
                .copy_from(&y.rows(*slot, range.len()));
        }
        let pushed = &stiffness * &z + self.drift(&y)?;
        let mut right = DVector::zeros(n + c);
        for (i, p) in unknown.iter().enumerate() {
            right[i] = -pushed[*p] * scale[*p];
        }
        // Velocities of attachments relative to ends of rods that keep their shapes: by bodies and by supports.
        let mut row = n;
        for (k, link) in self.links.iter().enumerate() {
            if let (Some([_, leaves]), Some(tie)) = (at.apart(k), &link.to) {
                for i in tie.rows() {
                    right[row] = leaves[i];
                    row += 1;
                }
            }
        }
        let found = match whole.clone().lu().solve(&right) {
            Some(found) if found.iter().all(|x| x.abs() < 1e12) => found,
            _ => whole
                .svd(true, true)
                .solve(&right, DEPENDENT)
                .map_err(|_| rigid())?,
        };
        let mut change = BlockVector {
            rods: Vec::with_capacity(self.links.len()),
            free: DVector::zeros(self.layout.free + c),
        };
        let mut at = 0;
        for link in &self.links {
            let rates = (at..at + link.rod.size()).map(|i| found[i] * scale[i]);
            change
                .rods
                .push(DVector::from_iterator(link.rod.size(), rates));
            at += link.rod.size();
        }
        for (i, p) in unknown.iter().enumerate().skip(first) {
            change.free[p - first] = found[i];
        }
        self.accelerate(&mut y, &change);
        let left = self.at(&y).map_or(f64::NAN, |at| self.gap(&at)[1]);
        let most = twists.iter().map(Vector6::amax).fold(1.0, f64::max);
        if left <= 1e-8 * most {
            Ok(y)
        } else {
            Err(Error::domain(format!(
                "the rods cannot follow the velocities of the bodies: an end would leave its attachment at {left:.1e}; a straight \
             inextensible rod cannot be stretched"
            )))
        }
    }
}

pub(super) fn rigid() -> Error {
    Error::ill_conditioned(
        "the rods hold each other in more ways than they can deform: straight inextensible rods close a loop; let the rods stretch (axial \
         stiffness), or bend them",
    )
}
