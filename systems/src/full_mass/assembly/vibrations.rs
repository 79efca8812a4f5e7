//! Small motions of rods with mass about an equilibrium: vibrations, eigenvalues with friction, shapes.

use super::statics::{DEPENDENT, rigid};
use super::{HeavyAssembly, HeavyState};
use crate::assembly::{AttachedTo, Attachment, Body};
use crate::error::{Error, Result};
use crate::full_mass::damped_modes::decaying;
use crate::full_mass::vibration::{ALL, Vibration, held_or_neutral, slowest};
use nalgebra::{Complex, DMatrix, DVector, Vector6};

/// Friction on a neutral motion, relative to the largest on the slow ones, below which it is rounding.
const UNFELT: f64 = 1e-9;
const SLOW: usize = 24;

impl HeavyAssembly {
    /// Stiffness, damping and mass of a state at rest in strains, then bodies and bases.
    pub(super) fn small(&self, y: &DVector<f64>) -> Result<[DMatrix<f64>; 3]> {
        self.without_point_loads()?;
        let at = self.at(&self.still(y)).ok_or_else(outside)?;
        self.small_at(&at, &self.at_rest(&at).ok_or_else(rigid)?)
    }

    /// [`HeavyAssembly::small`] of a state at rest with these accelerations and wrenches.
    pub(super) fn small_at(
        &self,
        at: &HeavyState,
        unknowns: &DVector<f64>,
    ) -> Result<[DMatrix<f64>; 3]> {
        let balance = self.balance(at, unknowns.as_slice()).ok_or_else(outside)?;
        let blocks = self
            .blocks(at, &balance, unknowns.as_slice())
            .ok_or_else(outside)?;
        Ok([0, 1, 2].map(|j| blocks.level(j).dense()))
    }

    /// True if all loads at time 0 have a potential.
    pub fn is_conservative(&self) -> bool {
        let mut rods = self.links.iter();
        rods.all(|link| link.rod.given.turning.is_none())
            && self.bodies().iter().all(|body| body.is_conservative(0.0))
    }

    /// 1/sqrt(weight) for each strain, and 1 for bodies and bases.
    pub(super) fn scale(&self) -> DVector<f64> {
        let rods = self.links.iter().map(|link| link.rod.norm_weights());
        let mut scale: Vec<f64> = rods.flat_map(|w| w.as_slice().to_vec()).collect();
        scale.resize(scale.len() + self.layout.free, 1.0);
        DVector::from_vec(scale)
    }

    /// The assembly with all clamps and supports fixed at their poses of time `t`.
    #[must_use]
    pub fn standing_at(&self, t: f64) -> Self {
        let mut standing = self.clone();
        let stand = |body: &Body| body.clone().standing_at(t);
        standing.carriers = self.carriers.iter().map(stand).collect();
        for link in &mut standing.links {
            link.rod = link.rod.standing_at(t);
            for tie in std::iter::once(&mut link.from).chain(&mut link.to) {
                if let AttachedTo::Support(support) = &tie.on.on {
                    tie.on = Attachment::ground(support.pose(t) * tie.on.place);
                }
            }
        }
        standing
    }

    /// The `count` slowest vibrations about the equilibrium `y`, by rising square of the frequency, in strains, rod
    /// by rod, then bodies and free bases. The square is 0 in a neutral direction of the assembly.
    ///
    /// # Errors
    /// Strains outside the law's domain; a mass matrix that is singular to rounding.
    pub fn vibrations(&self, y: &DVector<f64>, count: usize) -> Result<Vec<Vibration>> {
        self.within(y, &self.small(y)?, count)
    }

    /// Eigenvalues s of the `count` slowest motions exp(s t) about the equilibrium `y`, Im s >= 0, ordered by Im s:
    /// with friction, drag, rotors and loads that turn with a body. Neutral motions without friction are left out.
    ///
    /// # Errors
    /// As [`HeavyAssembly::vibrations`]; eigenvalues that are not found.
    pub fn decaying(&self, y: &DVector<f64>, count: usize) -> Result<Vec<Complex<f64>>> {
        let matrices = self.small(y)?;
        let mut modes = self.within(y, &matrices, ALL)?;
        let [stiffness, damping, _] = &matrices;
        // The friction of the fastest vibrations is larger by orders of magnitude.
        let slow = modes.iter().take(SLOW);
        let most = slow.map(|mode| (damping * &mode.shape).amax());
        let most = most.fold(0.0, f64::max);
        modes.retain(|mode| mode.square != 0.0 || (damping * &mode.shape).amax() > UNFELT * most);
        let mut branches = Vec::new();
        let mut first = 0;
        for link in &self.links {
            branches.extend(link.rod.memory.branches_from(first));
            first += link.rod.size();
        }
        let (forms, conservative) = ([stiffness, damping], self.is_conservative());
        decaying(&modes, forms, conservative, &branches, count)
    }

    /// Slowest vibrations about `y` with all ends on the attachments.
    fn within(
        &self,
        y: &DVector<f64>,
        matrices: &[DMatrix<f64>; 3],
        count: usize,
    ) -> Result<Vec<Vibration>> {
        let ends = self.ends(&self.at(y).ok_or_else(rigid)?);
        let scale = self.scale();
        let size = scale.len();
        let scaled =
            |m: &DMatrix<f64>| DMatrix::from_fn(size, size, |i, j| m[(i, j)] * scale[i] * scale[j]);
        // Free motions: the orthogonal complement of the ends' rows, by reflections that take these to the first
        // axes.
        let mut turned = DMatrix::identity(size, size);
        let mut held = 0;
        if ends.nrows() > 0 {
            let rows = DMatrix::from_fn(size, ends.nrows(), |j, i| ends[(i, j)] * scale[j]);
            let factors = rows.col_piv_qr();
            factors.q_tr_mul(&mut turned);
            let diagonal = factors.unpack_r().diagonal().abs();
            let bound = DEPENDENT * diagonal.max();
            held = diagonal.iter().filter(|x| **x > bound).count();
        }
        let basis = turned.rows(held, size - held).transpose();
        let inner = matrices
            .each_ref()
            .map(|m| basis.tr_mul(&(scaled(m) * &basis)));
        let found = held_or_neutral(slowest(inner.each_ref(), count)?, &inner[0]);
        let whole = found.into_iter().map(|mode| Vibration {
            shape: (&basis * mode.shape).component_mul(&scale),
            ..mode
        });
        Ok(whole.collect())
    }

    /// Largest residual of the balance of a state at rest: of rods per part of their length, of bodies and bases; None
    /// outside the domain of a law.
    pub fn unbalanced(&self, y: &DVector<f64>) -> Option<f64> {
        let at = self.at(&self.still(y))?;
        let balance = self.balance(&at, self.at_rest(&at)?.as_slice())?;
        let scale = self.scale();
        let left = self.by_rods(&balance.residual);
        Some(left.component_mul(&scale).component_mul(&scale).amax())
    }

    /// Largest static amplitude, in these vibrations of mass 1, of a state at rest: that at which their stiffness
    /// balances the residual force.
    ///
    /// # Errors
    /// As [`HeavyAssembly::vibrations`].
    pub fn strained(&self, y: &DVector<f64>, modes: &[Vibration]) -> Result<f64> {
        let [.., mass] = self.small(y)?;
        let at = self.at(&self.still(y)).ok_or_else(rigid)?;
        let push = mass * self.by_rods(&self.accelerations(&at).ok_or_else(rigid)?);
        let elastic = modes.iter().filter(|mode| mode.square != 0.0);
        let parts = elastic.map(|mode| (mode.shape.dot(&push) / mode.square).abs());
        Ok(parts.fold(0.0, f64::max))
    }

    /// The state displaced by `part` of a vibration.
    pub fn displaced(&self, y: &DVector<f64>, shape: &DVector<f64>, part: f64) -> DVector<f64> {
        let mut y = self.still(y);
        self.displace(&mut y, &self.change(shape), part);
        y
    }

    /// Twists (angular first) of all bodies in a vibration about a state, as [`HeavyAssembly::bodies`]; None if the
    /// state has no shape.
    pub fn twists(&self, y: &DVector<f64>, shape: &DVector<f64>) -> Option<Vec<Vector6<f64>>> {
        let mut moving = self.still(y);
        self.accelerate(&mut moving, &self.change(shape));
        let places = self.places_of_bodies(&self.at(&moving)?);
        Some(places.iter().map(|place| place.twist).collect())
    }
}

fn outside() -> Error {
    Error::domain("the strains are outside the domain of a section law")
}
