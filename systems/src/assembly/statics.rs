//! Equilibria of an assembly under its loads at t = 0, by Newton's method and a residual homotopy.
//!
//! Newton's method needs a start near by. Without one, rods are laid out unloaded along the tree of attachments from
//! the ground, which leaves a gap where they close a loop. The residual homotopy
//! R(y) = (1 - lambda) (R(y0) + springs) brings gaps and loads together from their start to zero; its path is
//! followed through its limit points. Rods slightly bent by couples serve if the unloaded ones lead to an unstable
//! equilibrium (a straight column) or begin singular (straight inextensible rods that hold each other): the bend
//! vanishes with the residual. From an unstable end the bodies fall, held by springs that slacken, to a stable one.

use super::attachment::{AttachedTo, Attachment};
use super::body::{Body, BodyMotion};
use super::configuration::Configuration;
use super::guide::Guide;
use super::homotopy::{BRIEF, FAR, FailedPath, PathBounds, Root, Statics, settled, solved};
use super::network::Assembly;
use super::rod_element::Link;
use crate::error::{Error, Result};
use crate::math::se3::join;
use crate::rod::{EndConditions, Problem, Wrench};
use crate::solve::parametrised_problem::Family;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use std::collections::VecDeque;

/// An equilibrium of an assembly.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyEquilibrium {
    /// Poses of the bodies and charts of the rods.
    pub now: Configuration,
    /// Stored energy and potential of the constant forces, those along rods included. Couples and loads in time have
    /// none.
    pub energy: f64,
    /// Stored energy of the rods alone; that of tendons is tension times length.
    pub stored: f64,
    /// Morse index with the bodies free; 0 is stable. Under loads without a potential ([`Assembly::is_conservative`])
    /// the index of the symmetric part of the stiffness, which does not decide stability. Not counted, and 0, where
    /// loads along rods have no potential ([`Assembly::has_turning`]).
    pub index: usize,
    /// Largest residual of the equations: gaps in radians and rod lengths, balance in B/L and B/L^2.
    pub residual: f64,
    /// Length of Newton's last correction, in radians, mean rod lengths, and B/L, B/L^2 of each rod.
    pub correction: f64,
    /// Route of the search.
    pub route: AssemblyRoute,
}

impl AssemblyEquilibrium {
    /// Sort key, lower is better: index, then energy.
    fn order(&self) -> (usize, f64) {
        (self.index, self.energy)
    }
}

/// Route by which an equilibrium was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AssemblyRoute {
    /// By Newton's method from the guess.
    Guess,
    /// Along the homotopy from the guess.
    FromGuess,
    /// Along the homotopy from the unloaded rods.
    Unloaded,
    /// Along the homotopy from slightly bent rods; the number is that of the bend.
    Bent(usize),
    /// At rest after a fall of all rods from their unloaded shapes.
    Fallen,
}

impl AssemblyRoute {
    /// True for a route from the guess.
    pub fn is_near_guess(self) -> bool {
        matches!(self, Self::Guess | Self::FromGuess)
    }
}

/// Couples (B/L) that bend the rods of a start, and whether every second rod is bent the other way. The directions
/// are generic, so no symmetry is kept.
const BENDS: [([f64; 3], bool); 6] = [
    ([0.011, 0.023, 0.001], false),
    ([0.021, -0.013, -0.002], true),
    ([-0.12, -0.22, 0.015], true),
    ([-0.2, 0.14, 0.01], false),
    ([0.7, 0.4, 0.05], true),
    ([-0.5, 0.8, -0.05], false),
];

/// Relative difference of energies up to which equilibria are one, or mirror images from which bodies fall alike.
const ALIKE: f64 = 1e-9;

impl Assembly {
    /// An equilibrium under the constant loads and those in time at t = 0, near `guess` or, without one, reached from
    /// the unloaded rods. The result is stable if one of a few starts leads to a stable one, and else of the lowest
    /// index found.
    ///
    /// Bodies that no chain of rods joins to the ground are in equilibrium at any common rigid displacement: the
    /// search begins with the first of them in the origin, and ends near by.
    ///
    /// `tolerance` bounds Newton's last correction relative to the unknowns ([`AssemblyEquilibrium::correction`]).
    ///
    /// # Errors
    /// A tolerance outside [1e-13, 1e-3]; rods that are too short; a guess of another assembly; no equilibrium found,
    /// with how far the best path came.
    pub fn equilibrium(
        &self,
        guess: Option<&Configuration>,
        tolerance: f64,
    ) -> Result<AssemblyEquilibrium> {
        if !(1e-13..=1e-3).contains(&tolerance) {
            return Err(Error::domain(format!(
                "the tolerance is {tolerance}; it must be in [1e-13, 1e-3]"
            )));
        }
        self.within_reach()?;
        if let Some(guess) = guess {
            return self.near(guess, tolerance);
        }
        let starts = self.beginnings(tolerance)?;
        let mut paths: VecDeque<_> = starts.iter().map(|start| (start, BRIEF)).collect();
        let mut best: Option<AssemblyEquilibrium> = None;
        let (mut farthest, mut far): (Option<FailedPath>, bool) = (None, false);
        // Energies of the unstable equilibria from which bodies have fallen.
        let mut left: Vec<f64> = Vec::new();
        while let Some((start, patience)) = paths.pop_front() {
            if patience == FAR && best.is_some() {
                break;
            }
            match self.led(start, patience, tolerance) {
                // Under loads that turn with bodies the index does not rank equilibria.
                Ok(found) if found.index == 0 || self.is_followed(0.0) => return Ok(found),
                Ok(found) => {
                    let again =
                        |energy: &f64| (energy - found.energy).abs() <= ALIKE * energy.abs();
                    if left.iter().any(again) {
                        continue;
                    }
                    left.push(found.energy);
                    let found = self.below(found, tolerance);
                    if found.index == 0 {
                        return Ok(found);
                    }
                    if best
                        .as_ref()
                        .is_none_or(|best| found.order() < best.order())
                    {
                        best = Some(found);
                    }
                }
                Err(lost)
                    if lost.long
                        && let Some(why) = self.drawn_straight() =>
                {
                    farthest = Some(FailedPath { why, ..lost });
                    break;
                }
                Err(lost) => {
                    // One path that was too long is followed farther, if the others lead to nothing.
                    if lost.long && !far {
                        paths.push_back((start, FAR));
                        far = true;
                    }
                    if farthest.as_ref().is_none_or(|far| lost.part >= far.part) {
                        farthest = Some(lost);
                    }
                }
            }
        }
        best.ok_or_else(|| match farthest {
            Some(lost) if lost.part >= 1.0 => lost.why.context(
                "no equilibrium was found at the ends of the paths from the unloaded rods and from slightly bent ones; give a guess",
            ),
            Some(lost) => lost.why.context(format!(
                "no equilibrium was found; of the paths from the unloaded rods and from slightly bent ones the farthest came {:.1} % \
                 of its way; give a guess, or lower the loads and follow a branch up to them",
                100.0 * lost.part
            )),
            None => Error::no_convergence("no equilibrium was found; give a guess"),
        })
    }

    /// Starts of homotopy paths: the unloaded rods, and bent ones.
    fn beginnings(&self, tolerance: f64) -> Result<Vec<(Configuration, AssemblyRoute)>> {
        let straight = std::iter::once((AssemblyRoute::Unloaded, [0.0; 3], false));
        let bent = BENDS.iter().enumerate();
        let bent = bent.map(|(k, (bend, other))| (AssemblyRoute::Bent(k), *bend, *other));
        let origin = vec![BodyMotion::at_rest(Isometry3::identity()); self.carriers().len()];
        let starts = straight.chain(bent).map(|(route, bend, other)| {
            let charts = (0..self.links().len()).map(|k| {
                let sign = if other && k % 2 == 1 { -1.0 } else { 1.0 };
                let bend = match self.links()[k].bent_about {
                    Some(normal) => Vector3::ith(normal, bend[0] + bend[1]),
                    None => Vector3::from(bend),
                };
                join(&(bend * sign), &Vector3::zeros())
            });
            let start = self.laid_out(charts.collect(), &origin, tolerance)?;
            Ok((start, route))
        });
        starts.collect()
    }

    /// Bodies at rest at the ends of the unloaded rods, each at the end of the first rod that reaches it. Rods that
    /// close a loop need not meet their attachments.
    ///
    /// # Errors
    /// A body that no chain of rods joins to the ground or to a support; as [`super::Link::end`].
    pub fn unloaded(&self, tolerance: f64) -> Result<Configuration> {
        self.let_go(&[], tolerance)
    }

    /// [`Assembly::unloaded`] for bodies without a ground: a body that no chain of rods reaches stands as in
    /// `bodies`, and the rods place the others from there.
    ///
    /// # Errors
    /// As [`Assembly::unloaded`], of bodies that `bodies` does not have.
    pub fn let_go(&self, bodies: &[BodyMotion], tolerance: f64) -> Result<Configuration> {
        let charts = vec![Wrench::zeros(); self.links().len()];
        self.laid_out(charts, bodies, tolerance)
    }

    /// True if a chain of rods joins every body to the ground or to a support.
    pub fn is_held(&self) -> bool {
        let mut held = vec![false; self.carriers().len()];
        for _ in 0..held.len() {
            // A joint holds the body that carries the joint, and the body holds the joint.
            for (node, carrier) in self.carriers().iter().enumerate() {
                match carrier.joint().map(Guide::parent) {
                    Some(None) => held[node] = true,
                    Some(Some(parent)) => {
                        let both = held[node] || held[parent];
                        (held[node], held[parent]) = (both, both);
                    }
                    None => {}
                }
            }
            for link in self.links() {
                let ends = [&link.from, &link.to].map(|site| site.carried_by());
                if ends.iter().any(|end| end.is_none_or(|body| held[body])) {
                    ends.iter().flatten().for_each(|body| held[*body] = true);
                }
            }
        }
        held.iter().all(|held| *held)
    }

    /// Poses with joints turned to where the ends of their rods stand that are free to turn there. Rods with joints at
    /// both ends are left as they are.
    fn turned_joints(&self, mut bodies: Vec<BodyMotion>) -> Vec<BodyMotion> {
        for link in self.links() {
            let node = |site: &Attachment| {
                let node = site.carried_by()?;
                self.carriers()[node].joint().map(|joint| (node, joint))
            };
            let (rod, fixed, (number, joint)) = match (node(&link.from), node(&link.to)) {
                (None, Some(node)) => (Ok(link.rod.clone()), &link.from, node),
                (Some(node), None) => (link.rod.reversed(), &link.to, node),
                _ => continue,
            };
            let half = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
            let turned = |pose: Isometry3<f64>| match node(&link.to) {
                Some(_) => pose,
                None => pose * half,
            };
            let clamp = turned(fixed.at(0.0, &bodies).pose);
            let at = bodies[number].pose.translation.vector;
            let free = || {
                let rod = rod
                    .ok()?
                    .with_clamp(clamp.translation.vector, clamp.rotation);
                let problem = Problem::new(rod, EndConditions::ball(at), 1e-9).ok()?;
                let found = problem.solve(None).ok()?;
                problem.sections(&found.base, &[1.0]).ok()?.pop()
            };
            if let Some(end) = free() {
                let frame = joint.frame(0.0, &bodies);
                let seen = turned(end.pose());
                let pose = joint.pose(&frame, &joint.coordinates(&frame, &seen));
                bodies[number] = BodyMotion::at_rest(if joint.is_ball() { seen } else { pose });
            }
        }
        bodies
    }

    /// A guess for [`Assembly::equilibrium`] from poses of the bodies alone: each rod in an equilibrium between its
    /// attachments, slightly bent if none is found.
    pub fn held(&self, bodies: Vec<BodyMotion>, tolerance: f64) -> Configuration {
        let bent = join(&Vector3::from(BENDS[0].0), &Vector3::zeros());
        let bodies = self.turned_joints(bodies);
        let chart = |link: &Link| {
            let (base, tip) = (link.from().at(0.0, &bodies), link.to().at(0.0, &bodies));
            let end = base.pose.inv_mul(&tip.pose);
            let link = link.with_base_rotation(&base.pose.rotation);
            if link.is_pinned() {
                return link.spanning(&end, tolerance);
            }
            let found = link.held_at(&end, tolerance).ok()?.solve(None).ok()?;
            Some(found.base.component_div(&link.units()))
        };
        let charts = self.links().iter();
        let charts = charts.map(|link| chart(link).unwrap_or(bent)).collect();
        Configuration {
            bodies,
            charts,
            spins: Vec::new(),
        }
    }

    /// The equilibrium that Newton's method finds from a guess near by.
    pub(crate) fn equilibrium_beside(
        &self,
        guess: &Configuration,
        tolerance: f64,
    ) -> Option<AssemblyEquilibrium> {
        let statics = Statics::new(self, guess, tolerance);
        let x = statics.frame.unknowns(self, guess);
        let root = solved(&statics, &x, tolerance).ok()?;
        self.described(&statics, &root, AssemblyRoute::Guess).ok()
    }

    fn near(&self, guess: &Configuration, tolerance: f64) -> Result<AssemblyEquilibrium> {
        if guess.bodies.len() != self.carriers().len() || guess.charts.len() != self.links().len() {
            return Err(Error::domain(format!(
                "the guess has {} bodies and {} rods; the assembly has {} and {}",
                guess.bodies.len(),
                guess.charts.len(),
                self.carriers().len(),
                self.links().len()
            )));
        }
        let statics = Statics::new(self, guess, tolerance);
        let x = statics.frame.unknowns(self, guess);
        let direct = solved(&statics, &x, tolerance)
            .and_then(|root| self.described(&statics, &root, AssemblyRoute::Guess));
        let found = match direct {
            Ok(found) => found,
            Err(direct) => {
                let start = (guess.clone(), AssemblyRoute::FromGuess);
                let led = |patience| self.led(&start, patience, tolerance);
                let found = match led(BRIEF) {
                    Err(lost) if lost.long && self.drawn_straight().is_none() => led(FAR),
                    found => found,
                };
                found.map_err(|lost| {
                    direct.context(format!(
                        "no equilibrium near the guess, and the path that takes its residual back ends after {:.1} % of its way; \
                         give a guess nearer to an equilibrium, or none",
                        100.0 * lost.part
                    ))
                })?
            }
        };
        // Newton's method may converge far away: a result farther than the total rod length is not near the guess.
        let reach: f64 = self.links().iter().map(|link| link.rod().length()).sum();
        let moved = guess.bodies.iter().zip(&found.now.bodies).map(|(a, b)| {
            let (a, b) = (a.pose.translation.vector, b.pose.translation.vector);
            (a - b).norm()
        });
        let moved = moved.fold(0.0, f64::max);
        if !(moved <= reach) {
            return Err(Error::no_convergence(format!(
                "no equilibrium near the guess: that to which it leads is {:.1} times as far away as all rods together are long; give a guess \
                 nearer to an equilibrium, or none",
                moved / reach
            )));
        }
        Ok(found)
    }

    /// End of the homotopy from a configuration, or the reason and distance of its failure.
    fn led(
        &self,
        (from, route): &(Configuration, AssemblyRoute),
        patience: PathBounds,
        tolerance: f64,
    ) -> std::result::Result<AssemblyEquilibrium, FailedPath> {
        let mut statics = Statics::new(self, from, tolerance);
        let (mut x, mut stuck) = (statics.frame.unknowns(self, from), false);
        let begun = statics
            .linearised(&x, 0.0)
            .map_err(FailedPath::at_once)?
            .residual;
        if begun.amax() > tolerance {
            statics.start = Some(begun);
            (x, stuck) = statics.followed(x, patience)?;
            statics.start = None;
        }
        let settled = stuck.then(|| settled(&statics, &x, tolerance)).flatten();
        let found = settled.map_or_else(|| solved(&statics, &x, tolerance), Ok);
        found
            .and_then(|root| self.described(&statics, &root, *route))
            .map_err(|why| FailedPath {
                part: 1.0,
                ..FailedPath::at_once(why)
            })
    }

    /// Best equilibrium to which bodies fall from an unstable one, or the unstable one itself if they fall to none.
    fn below(&self, found: AssemblyEquilibrium, tolerance: f64) -> AssemblyEquilibrium {
        let statics = Statics::new(self, &found.now, tolerance);
        let x = statics.frame.unknowns(self, &found.now);
        let mut best = found;
        for way in [1.0, -1.0] {
            let fallen = statics.fallen(&x, way);
            let lower = fallen
                .and_then(|x| solved(&statics, &x, tolerance).ok())
                .and_then(|root| self.described(&statics, &root, best.route).ok());
            if let Some(lower) = lower.filter(|lower| lower.order() < best.order()) {
                best = lower;
            }
        }
        best
    }

    fn described(
        &self,
        statics: &Statics<'_>,
        root: &Root,
        route: AssemblyRoute,
    ) -> Result<AssemblyEquilibrium> {
        let now = statics.frame.configuration(self, root.x.as_slice());
        // During the search a body may pass the end of a groove, along the extension of the spline's last piece.
        Body::within_ends(self.carriers(), &now.bodies)?;
        let points = self.points(0.0, &now.bodies, &now.charts, statics.tolerance)?;
        let index = if self.has_turning() {
            0
        } else {
            self.index(0.0, &now, statics.tolerance.max(1e-11))
                .map_err(|why| why.context("the index of an equilibrium that was found"))?
        };
        Ok(AssemblyEquilibrium {
            energy: self.statical_energy(&now, &points),
            stored: points.iter().map(|point| point.end.energy).sum(),
            index,
            residual: statics.frame.residual(self, &now.bodies, &points).amax(),
            correction: root.correction,
            route,
            now,
        })
    }

    pub(super) fn statical_energy(&self, now: &Configuration, points: &[super::LinkPoint]) -> f64 {
        let bodies = self.carriers().iter().zip(&now.bodies);
        let potential: f64 = bodies
            .map(|(carrier, place)| {
                let joint =
                    |guide: &Guide| guide.potential(&guide.frame(0.0, &now.bodies), &place.pose);
                carrier.potential(0.0, &place.pose) + carrier.guide().map_or(0.0, joint)
            })
            .sum();
        let rods = points
            .iter()
            .map(|point| point.end.energy + point.potential());
        rods.sum::<f64>() + potential
    }

    /// Places joints on bodies that are placed, and bodies at joints that are placed, each joint as it is unloaded.
    fn place_joints(&self, placed: &mut [Option<Isometry3<f64>>]) {
        for (node, carrier) in self.carriers().iter().enumerate() {
            let Some(joint) = carrier.joint() else {
                continue;
            };
            match joint.parent() {
                None => placed[node] = Some(joint.frame(0.0, &[])),
                Some(parent) => match (placed[node], placed[parent]) {
                    (None, Some(pose)) => placed[node] = Some(pose * joint.on().place),
                    (Some(pose), None) => {
                        let pose = pose * joint.on().place.inverse();
                        placed[parent] = Some(self.carriers()[parent].confined(pose));
                    }
                    _ => {}
                },
            }
        }
    }

    /// Poses of bodies given the charts of the rods, rod by rod from the ground: a body stands at the end of the
    /// first rod that reaches it, preferring rods welded at both ends. Ball joints are laid out as welds.
    ///
    /// # Errors
    /// A body that no chain of rods joins to the ground.
    fn laid_out(
        &self,
        charts: Vec<Wrench>,
        bodies: &[BodyMotion],
        tolerance: f64,
    ) -> Result<Configuration> {
        let ends = self.links().iter().zip(&charts);
        let ends = ends.map(|(link, q)| Ok(link.end(q, tolerance)?.pose));
        let ends = ends.collect::<Result<Vec<Isometry3<f64>>>>()?;
        let mut placed: Vec<Option<Isometry3<f64>>> = vec![None; self.carriers().len()];
        // A ball joint leaves the rotation of a body open: rods that are welded at both ends lead first.
        let mut by_joints = false;
        self.place_joints(&mut placed);
        loop {
            let before = placed.iter().flatten().count();
            let rods = self.links().iter().zip(&ends);
            for (link, end) in rods.filter(|(link, _)| by_joints || !link.joint().turns()) {
                let seen = |site: &Attachment| match &site.on {
                    AttachedTo::Body(body) => placed[*body].map(|pose| pose * site.place),
                    _ => Some(site.at(0.0, &[]).pose),
                };
                let (base, tip) = (seen(&link.from), seen(&link.to));
                let new = match (&link.from.on, &link.to.on, base, tip) {
                    (_, AttachedTo::Body(body), Some(base), None) => {
                        Some((*body, base * end * link.to.place.inverse()))
                    }
                    (AttachedTo::Body(body), _, None, Some(tip)) => {
                        Some((*body, tip * end.inverse() * link.from.place.inverse()))
                    }
                    _ => None,
                };
                if let Some((body, pose)) = new {
                    placed[body] = Some(self.carriers()[body].confined(pose));
                }
            }
            self.place_joints(&mut placed);
            let led = placed.iter().flatten().count() > before;
            if led || !by_joints {
                by_joints = !led;
                continue;
            }
            // If the rods lead no further, continue from the next body.
            by_joints = false;
            let next = placed.iter().position(Option::is_none);
            match next.and_then(|body| Some((body, bodies.get(body)?.pose))) {
                Some((body, pose)) => placed[body] = Some(pose),
                None => break,
            }
        }
        let bodies = placed.into_iter().enumerate().map(|(body, pose)| {
            pose.map(BodyMotion::at_rest).ok_or_else(|| {
                Error::domain(format!(
                    "no chain of rods joins {} to the ground or to a support: it has no equilibrium of its own; hold it by \
                     a rod",
                    self.carriers[body].called(body)
                ))
            })
        });
        Ok(Configuration {
            bodies: bodies.collect::<Result<_>>()?,
            charts,
            spins: Vec::new(),
        })
    }
}
