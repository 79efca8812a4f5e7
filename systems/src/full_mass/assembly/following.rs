//! Rates with which rods follow their bodies as if without mass: tangent to the equilibria with the bodies held.

use super::block_elimination::{BlockVector, through_base};
use super::statics::{DEPENDENT, rigid};
use super::{HeavyAssembly, HeavyLink, HeavyState, Tie};
use crate::assembly::{AttachedTo, Attachment, Body, BodyMotion, Joint};
use crate::error::{Error, Result};
use crate::full_mass::rod::{HeavyRod, RodDescription};
use nalgebra::{DMatrix, DVector, Isometry3, Vector6};

/// Rotation of a clamp or a support for the difference quotient of the balance.
const TURN: f64 = 1e-5;
/// Motion of an end per strain of its rod below which a wrench that works on it strains no rod.
const STRAINLESS: f64 = 1e-7;

impl HeavyAssembly {
    /// State with these twists of all bodies (angular first, as [`HeavyAssembly::bodies`]), in which the rods follow
    /// as if without mass: their rates are tangent to the equilibria with the bodies held.
    ///
    /// # Errors
    /// Velocities that the rods cannot follow: a straight inextensible rod cannot be stretched.
    pub fn following(&self, y: &DVector<f64>, twists: &[Vector6<f64>]) -> Result<DVector<f64>> {
        if self.links.iter().any(|link| link.rod.given.body.is_some()) {
            return self.following_listed(y, twists);
        }
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
        let at = self.at(&y).ok_or_else(shapeless)?;
        let driven = self.gap(&at)[1] > 0.0 || self.turning() > 0.0;
        if !moves && !driven {
            return Ok(y);
        }
        let standing = self.standing_at(0.0);
        let resting = standing.at(&standing.still(&y)).ok_or_else(shapeless)?;
        let ends = standing.ends(&resting);
        let unknowns = standing.held_at_rest(&resting, &ends).ok_or_else(rigid)?;
        let [stiffness, ..] = standing.small_at(&resting, &unknowns)?;
        let scale = self.scale();
        let size = stiffness.nrows();
        let first = size - self.layout.free;
        let unknown = self.followers();
        // Ends without an unknown hold still, as ends of planar rods do across the plane.
        let acts = |row: &usize| unknown.iter().any(|i| ends[(*row, *i)] != 0.0);
        let rows: Vec<usize> = (0..ends.nrows()).filter(acts).collect();
        let (n, c) = (unknown.len(), rows.len());
        let mut whole = DMatrix::zeros(n + c, n + c);
        for (i, p) in unknown.iter().enumerate() {
            for (j, r) in unknown.iter().enumerate() {
                whole[(i, j)] = stiffness[(*p, *r)] * scale[*p] * scale[*r];
            }
            for (k, row) in rows.iter().enumerate() {
                whole[(n + k, i)] = ends[(*row, *p)] * scale[*p];
                whole[(i, n + k)] = -whole[(n + k, i)];
            }
        }
        let mut z = DVector::zeros(size);
        let places = self.places(&y);
        for (slot, range) in &places.velocities {
            z.rows_mut(first + range.start, range.len())
                .copy_from(&y.rows(*slot, range.len()));
        }
        let pushed = &stiffness * &z + self.turning_loads(&y)?;
        // Velocities of attachments relative to ends of rods that keep their shapes: by bodies and by supports.
        let leaves = self.gaps(&at, 1);
        let right = unknown.iter().map(|p| -pushed[*p] * scale[*p]);
        let right = right.chain(rows.iter().map(|row| leaves[*row]));
        let right = DVector::from_iterator(n + c, right);
        let found = match whole.clone().lu().solve(&right) {
            Some(found) if found.iter().all(|x| x.abs() < 1e12) => found,
            _ => whole
                .svd(true, true)
                .solve(&right, DEPENDENT)
                .map_err(|_| rigid())?,
        };
        let mut rates = DVector::zeros(size);
        for (p, x) in unknown.iter().zip(found.iter()) {
            // Free bases are not scaled.
            rates[*p] = x * scale[*p];
        }
        self.accelerate(&mut y, &self.change(&rates));
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

    /// [`HeavyAssembly::following`] with the bodies of the rods' own in the list.
    fn following_listed(&self, y: &DVector<f64>, twists: &[Vector6<f64>]) -> Result<DVector<f64>> {
        let listed = self.listed()?;
        let mut y = self.still(y);
        let at = self.at(&y).ok_or_else(shapeless)?;
        let places = self.places_of_bodies(&at);
        let rods = 0..self.links.len();
        let bases: Vec<_> = rods.clone().map(|k| at.base(k).rotation).collect();
        let strains: Vec<_> = rods.map(|k| self.strains(&y, k).to_vec()).collect();
        let still: Vec<_> = strains.iter().map(|q| vec![0.0; q.len()]).collect();
        let found = listed.state(&places, &bases, &strains, &still);
        let found = listed.with_joints_at(found, &self.joints_at(&y));
        let found = listed.following(&found, twists)?;
        let (to, from) = (&self.layout, &listed.layout);
        let bodies = to.bodies.iter().zip(&from.bodies);
        let turns = to.turns.iter().zip(&from.turns);
        let joints = to.joints.iter().flatten().zip(from.joints.iter().flatten());
        let turns = turns.chain(joints);
        for (to, from) in bodies.chain(turns).chain(to.rates.iter().zip(&from.rates)) {
            y.as_mut_slice()[to.clone()].copy_from_slice(&found.as_slice()[from.clone()]);
        }
        Ok(y)
    }

    /// The assembly with the bodies of the rods' own in the list, each tied to the end of its rod.
    fn listed(&self) -> Result<Self> {
        let mut number = self.carriers.len();
        let links = self.links.iter().map(|link| {
            let Some(body) = &link.rod.given.body else {
                return Ok(link.clone());
            };
            let given = RodDescription {
                body: None,
                ..link.rod.given.clone()
            };
            let on = Attachment::body(number, Isometry3::identity());
            number += 1;
            let joint = if body.turns() {
                Joint::Weld
            } else {
                Joint::Ball
            };
            Ok(HeavyLink {
                rod: HeavyRod::new(given, link.rod.sections.grid.clone())?,
                from: link.from.clone(),
                to: Some(Tie::new(on, joint)),
            })
        });
        let links = links.collect::<Result<_>>()?;
        Self::new(self.bodies(), links)
    }

    /// Indices, among strains, then velocities of bodies and bases, of all that moves with the bodies held: the rods
    /// and the free bases.
    fn followers(&self) -> Vec<usize> {
        let (size, first) = (self.freedoms(), self.freedoms() - self.layout.free);
        let held: usize = self.carriers.iter().map(Body::freedoms).sum();
        (0..first).chain(first + held..size).collect()
    }

    /// Twists of the held ends relative to their attachments, by strains, then by bodies and bases.
    pub(super) fn ends(&self, at: &HeavyState) -> DMatrix<f64> {
        let size = self.freedoms();
        let mut ends = DMatrix::zeros(self.multipliers(), size);
        let (mut row, mut first) = (0, 0);
        for (k, link) in self.links.iter().enumerate() {
            let m = link.rod.size();
            if let (Some(tie), (from, Some(seat))) = (&link.to, &at.seats[k]) {
                let rows = tie.rows();
                let end = link.rod.end(&at.rods[k]);
                let by_free = through_base(&end, m, &from.by) - &seat.by;
                ends.view_mut((row, first), (rows.len(), m))
                    .copy_from(&end.view((rows.start, 0), (rows.len(), m)));
                ends.view_mut(
                    (row, size - self.layout.free),
                    (rows.len(), self.layout.free),
                )
                .copy_from(&by_free.rows(rows.start, rows.len()));
                row += rows.len();
            }
            first += m;
        }
        ends
    }

    /// Accelerations and wrenches of a state at rest near an equilibrium. Nothing accelerates but an assembly that
    /// falls freely.
    pub(super) fn at_rest(&self, at: &HeavyState) -> Option<DVector<f64>> {
        let mut unknowns = if self.multipliers() > 0 {
            self.accelerations(at)?
        } else {
            DVector::zeros(self.unknowns())
        };
        self.let_fall(at, &mut unknowns)?;
        Some(unknowns)
    }

    /// [`HeavyAssembly::at_rest`] with the bodies held: the wrenches on the ends bring the rods closest to equilibrium.
    /// Parts that strain no rod stay, as the pull of a straight inextensible one.
    fn held_at_rest(&self, at: &HeavyState, ends: &DMatrix<f64>) -> Option<DVector<f64>> {
        let mut unknowns = self.at_rest(at)?;
        let ties = self.multipliers();
        if ties > 0 {
            let (scale, followers) = (self.scale(), self.followers());
            let left = self.by_rods(&self.balance(at, unknowns.as_slice())?.residual);
            let by = DMatrix::from_fn(followers.len(), ties, |i, k| {
                ends[(k, followers[i])] * scale[followers[i]]
            });
            let left = followers.iter().map(|i| left[*i] * scale[*i]);
            let left = DVector::from_iterator(followers.len(), left);
            let more = by.svd(true, true).solve(&left, STRAINLESS).ok()?;
            let first = self.unknowns() - ties;
            let mut wrenches = unknowns.rows_mut(first, ties);
            wrenches += more;
        }
        Some(unknowns)
    }

    /// Fastest rotation of a clamp or a support at time 0.
    fn turning(&self) -> f64 {
        let clamps = self.links.iter().map(|link| link.rod.given.grain.support());
        let supports = self.links.iter().map(|link| match &link.from.on.on {
            AttachedTo::Support(support) => Some(&**support),
            _ => None,
        });
        let rates = clamps.chain(supports).flatten();
        rates.fold(0.0, |most, support| most.max(support.at(0.0).spin_rate()))
    }

    /// Rate of the balance at rest, of rods, bodies and bases, as clamps and supports turn: relative to them the
    /// weight of the rods turns.
    fn turning_loads(&self, y: &DVector<f64>) -> Result<DVector<f64>> {
        let fastest = self.turning();
        if fastest == 0.0 {
            return Ok(DVector::zeros(self.freedoms()));
        }
        let outside = || Error::domain("the strains are outside the domain of a section law");
        let still = self.still(y);
        let here = self.standing_at(0.0);
        let at = here.at(&still).ok_or_else(outside)?;
        let unknowns = here.at_rest(&at).ok_or_else(rigid)?;
        let step = TURN / (1.0 + fastest);
        let turned = |by: f64| -> Result<DVector<f64>> {
            let there = self.standing_at(by);
            let balance = there
                .at(&still)
                .and_then(|at| there.balance(&at, unknowns.as_slice()));
            Ok(there.by_rods(&balance.ok_or_else(outside)?.residual))
        };
        Ok((turned(step)? - turned(-step)?) / (2.0 * step))
    }

    /// A residual, or accelerations, by strains, then by bodies and bases.
    pub(super) fn by_rods(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        let sides = self.sides(unknowns);
        let rods = sides.rods.iter().flat_map(|rod| rod.iter());
        let all = rods.chain(sides.free.iter().take(self.layout.free));
        DVector::from_iterator(self.freedoms(), all.copied())
    }

    /// A change of all strains, then of bodies and bases.
    pub(super) fn change(&self, all: &DVector<f64>) -> BlockVector<f64> {
        let mut at = 0;
        let rods = self.links.iter().map(|link| {
            at += link.rod.size();
            all.rows(at - link.rod.size(), link.rod.size()).into_owned()
        });
        BlockVector {
            rods: rods.collect(),
            free: all
                .rows(all.len() - self.layout.free, self.layout.free)
                .into_owned(),
        }
    }
}

fn shapeless() -> Error {
    Error::domain("the strains give no shape of the rods")
}
