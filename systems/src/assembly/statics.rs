//! Equilibria of an assembly under its loads at t = 0.
//!
//! Newton's method needs a start near by. Without one, rods are laid out unloaded along the tree of attachments from the ground,
//! which leaves a gap where they close a loop, and the residual homotopy R(y) = (1 - lambda) (R(y0) + springs) brings gaps and loads
//! together from what they are there to zero; its path is followed through its limit points. Rods slightly bent by couples
//! serve where the unloaded ones lead to an unstable equilibrium (a straight column) or begin singular (straight and
//! inextensible ones that hold each other): the bend goes with the residual.

use super::equations::Frame;
use super::{Assembly, Carrier, Configuration, Joint, On, Place};
use crate::error::{Error, Result};
use crate::math::se3::joined;
use crate::rod::Wrench;
use crate::solve::arclength::{Continuation, Options, Stop};
use crate::solve::family::{Family, Linearised};
use crate::solve::newton;
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};

/// An equilibrium of an assembly.
#[derive(Debug, Clone, PartialEq)]
pub struct AssemblyEquilibrium {
    /// Where everything is.
    pub now: Configuration,
    /// Stored energy and potential of the constant forces, those along rods included. Couples and loads in time have none.
    pub energy: f64,
    /// Morse index with the bodies free; 0 is stable. Under loads without a potential ([`Assembly::is_conservative`]) that of the
    /// symmetric part of the stiffness, which does not decide stability.
    pub index: usize,
    /// The largest of the equations left over: gaps in radians and lengths of the rod, balance in B/L and B/L^2.
    pub residual: f64,
    /// Length of Newton's last correction, in radians, mean lengths of the rods, and B/L, B/L^2 of each rod.
    pub correction: f64,
    /// How it was reached.
    pub route: AssemblyRoute,
}

/// How an equilibrium was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AssemblyRoute {
    /// By Newton's method from the guess.
    Guess,
    /// Along the homotopy from the guess.
    FromGuess,
    /// Along the homotopy from the unloaded rods.
    Unloaded,
    /// Along the homotopy from rods slightly bent, in the way of this number.
    Bent(usize),
}

impl AssemblyRoute {
    /// True if it led from the guess.
    pub fn is_near_guess(self) -> bool {
        matches!(self, Self::Guess | Self::FromGuess)
    }
}

/// Couples (B/L) that bend the rods of a start, and whether every second rod is bent the other way. Generic directions, so that
/// no symmetry is kept.
const BENDS: [([f64; 3], bool); 6] = [
    ([0.011, 0.023, 0.001], false),
    ([0.021, -0.013, -0.002], true),
    ([-0.12, -0.22, 0.015], true),
    ([-0.2, 0.14, 0.01], false),
    ([0.7, 0.4, 0.05], true),
    ([-0.5, 0.8, -0.05], false),
];
/// Springs, in the units of the balance, that hold the bodies at the start of a homotopy and slacken along it: what nothing else
/// holds (a body that can spin about a ball joint) would leave no path.
const SPRING: f64 = 0.1;
/// How near its end a homotopy may be stuck: an equilibrium that is free to move is a singular end.
const NEARLY: f64 = 0.99;
/// Singular values below this part of the Jacobian are directions in which the equilibrium is free to move.
const NEUTRAL: f64 = 1e-7;
/// Longest step of a path to taut rods, in the units of charts.
const FAR: f64 = 1e12;
/// Steps of least length at most.
const MOST_SETTLING: usize = 20;
/// What is left of the equations of what nothing holds is rounding up to this many times the tolerance: under a load that nothing bears steps
/// end, too, far away or where no step makes it less.
const LEFT: f64 = 1e3;

/// A path that led nowhere: how far it came, why no farther, and whether it was too long, as others would be.
struct Lost {
    part: f64,
    why: Error,
    heavy: bool,
}

/// The equations at t = 0, or those of a homotopy.
struct Statics<'a> {
    assembly: &'a Assembly,
    frame: Frame,
    tolerance: f64,
    /// R(y0) of the homotopy, p its parameter; None for the equations themselves.
    start: Option<DVector<f64>>,
}

/// A root and the length of the last correction.
struct Root {
    x: DVector<f64>,
    correction: f64,
}

impl Family for Statics<'_> {
    fn size(&self) -> usize {
        self.assembly.unknowns()
    }

    fn linearised(&self, x: &DVector<f64>, p: f64) -> Result<Linearised> {
        let x = x.as_slice();
        let now = self.frame.configuration(self.assembly, x);
        self.frame.check(self.assembly, x, &now)?;
        let points = self
            .assembly
            .points(0.0, &now.bodies, &now.charts, self.tolerance)?;
        let mut residual = self.frame.residual(self.assembly, &now.bodies, &points);
        let mut jacobian = self.frame.jacobian(self.assembly, x, &now.bodies, &points);
        let Some(start) = &self.start else {
            return Ok(Linearised {
                slope: DVector::zeros(residual.len()),
                residual,
                jacobian,
            });
        };
        let mut slope = start.clone();
        for i in 0..self.assembly.freedoms().1 {
            slope[i] += SPRING * x[i];
            jacobian[(i, i)] -= (1.0 - p) * SPRING;
        }
        residual -= &slope * (1.0 - p);
        Ok(Linearised {
            residual,
            jacobian,
            slope,
        })
    }
}

impl Statics<'_> {
    /// False of what nothing holds where its loads are left, relative to the charts of its rods.
    fn solves(&self, x: &DVector<f64>, tolerance: f64) -> bool {
        let charts = x.iter().skip(self.assembly.freedoms().1);
        let most = charts.fold(1.0, |most: f64, q| most.max(q.abs()));
        let left = || self.linearised(x, 0.0).map(|at| at.residual.amax());
        self.assembly.is_held() || left().is_ok_and(|left| left <= LEFT * tolerance * most)
    }
}

impl Assembly {
    /// An equilibrium under the constant loads and those in time at t = 0, near `guess` or, without one, reached from the
    /// unloaded rods: a stable one if a few starts lead to one, otherwise that of the lowest index found.
    ///
    /// Bodies that no chain of rods joins to the ground are in equilibrium wherever they are carried together: the search begins with the
    /// first of them in the origin, and ends near by.
    ///
    /// `tolerance` bounds Newton's last correction relative to the unknowns ([`AssemblyEquilibrium::correction`]).
    ///
    /// # Errors
    /// A tolerance outside [1e-13, 1e-3]; rods that are too short; a guess of another assembly; no equilibrium found, with how far the best path came.
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
        let straight = std::iter::once((AssemblyRoute::Unloaded, [0.0; 3], false));
        let bent = BENDS.iter().enumerate();
        let bent = bent.map(|(k, (bend, other))| (AssemblyRoute::Bent(k), *bend, *other));
        let origin = vec![Place::at_rest(Isometry3::identity()); self.carriers().len()];
        let mut best: Option<AssemblyEquilibrium> = None;
        let mut farthest: Option<Lost> = None;
        for (route, bend, other) in straight.chain(bent) {
            let charts = (0..self.links().len()).map(|k| {
                let sign = if other && k % 2 == 1 { -1.0 } else { 1.0 };
                joined(&(Vector3::from(bend) * sign), &Vector3::zeros())
            });
            match self.led(
                &self.laid_out(charts.collect(), &origin, tolerance)?,
                route,
                tolerance,
            ) {
                // Under loads that turn with bodies no index tells one equilibrium from another.
                Ok(found) if found.index == 0 || self.is_followed(0.0) => return Ok(found),
                Ok(found) => {
                    let order = |a: &AssemblyEquilibrium| (a.index, a.energy);
                    if best.as_ref().is_none_or(|best| order(&found) < order(best)) {
                        best = Some(found);
                    }
                }
                Err(lost) => {
                    let heavy = lost.heavy;
                    if heavy || farthest.as_ref().is_none_or(|far| lost.part >= far.part) {
                        farthest = Some(lost);
                    }
                    if heavy {
                        break;
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

    /// The bodies at rest where the unloaded rods bring them, each where the first rod that reaches it ends. Rods that close a loop
    /// need not meet their attachments there.
    ///
    /// # Errors
    /// A body that no chain of rods joins to the ground or to a support; as [`super::Link::end`].
    pub fn unloaded(&self, tolerance: f64) -> Result<Configuration> {
        self.let_go(&[], tolerance)
    }

    /// The same of bodies that need no ground: where no chain of rods leads to it, the first body stands as in `bodies` and the rods
    /// bring the others there.
    ///
    /// # Errors
    /// As [`Assembly::unloaded`], of bodies that `bodies` does not have.
    pub fn let_go(&self, bodies: &[Place], tolerance: f64) -> Result<Configuration> {
        let charts = vec![Wrench::zeros(); self.links().len()];
        self.laid_out(charts, bodies, tolerance)
    }

    /// True if a chain of rods joins every body to the ground or to a support.
    pub fn is_held(&self) -> bool {
        let mut held = vec![false; self.carriers().len()];
        for _ in 0..held.len() {
            for link in self.links() {
                let ends = [&link.from.on, &link.to.on].map(|on| match on {
                    On::Body(body) => Some(*body),
                    _ => None,
                });
                if ends.iter().any(|end| end.is_none_or(|body| held[body])) {
                    ends.iter().flatten().for_each(|body| held[*body] = true);
                }
            }
        }
        held.iter().all(|held| *held)
    }

    /// A guess for [`Assembly::equilibrium`] from places of the bodies alone: every rod in the equilibrium that it is found in
    /// with its ends held there, slightly bent where none is found.
    pub fn held(&self, bodies: Vec<Place>, tolerance: f64) -> Configuration {
        let bent = joined(&Vector3::from(BENDS[0].0), &Vector3::zeros());
        let chart = |link: &super::Link| {
            let (base, tip) = (link.from().at(0.0, &bodies), link.to().at(0.0, &bodies));
            let end = base.pose.inv_mul(&tip.pose);
            let link = link.facing(&base.pose.rotation);
            if link.joint() == super::Joint::Pins {
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
        let statics = self.statics(guess, tolerance);
        let x = statics.frame.unknowns(self, guess);
        let direct = solved(&statics, &x, tolerance)
            .and_then(|root| self.described(&statics, &root, AssemblyRoute::Guess));
        let found = match direct {
            Ok(found) => found,
            Err(direct) => self.led(guess, AssemblyRoute::FromGuess, tolerance).map_err(|lost| {
                direct.context(format!(
                    "no equilibrium near the guess, and the path that takes its residual back ends after {:.1} % of its way; \
                     give a guess nearer to an equilibrium, or none",
                    100.0 * lost.part
                ))
            })?,
        };
        // Newton's method may come from anywhere, to anywhere: farther than the rods are long is not near.
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

    fn statics(&self, now: &Configuration, tolerance: f64) -> Statics<'_> {
        Statics {
            assembly: self,
            frame: Frame::new(self, now.bodies.iter().map(|place| place.pose)),
            tolerance: (0.01 * tolerance).clamp(1e-14, 1e-9),
            start: None,
        }
    }

    /// The end of the homotopy from a configuration, or how far it came and why no farther.
    fn led(
        &self,
        from: &Configuration,
        route: AssemblyRoute,
        tolerance: f64,
    ) -> std::result::Result<AssemblyEquilibrium, Lost> {
        let mut statics = self.statics(from, tolerance);
        let x = statics.frame.unknowns(self, from);
        let lost = |part, why| Lost {
            part,
            why,
            heavy: false,
        };
        let begin = |why| lost(0.0, why);
        let Linearised { residual, .. } = statics.linearised(&x, 0.0).map_err(begin)?;
        let (mut end, mut stuck) = (x.clone(), false);
        if residual.amax() > tolerance {
            statics.start = Some(residual);
            let options = Options {
                initial_step: 0.1,
                max_step: 50.0,
                tolerance: 1e-7,
                max_points: 400,
                special: false,
                ..Options::between(0.0, 1.0)
            };
            let to_end = |options: &Options| {
                Ok(Continuation::new(&statics, x.clone(), 0.0, options.clone())?.trace())
            };
            let mut followed = to_end(&options).map_err(begin)?;
            if let Stop::MaxPoints = followed.stop
                && let Some(why) = self.drawn_straight()
            {
                let far = followed.points.last().map_or(0.0, |point| point.p);
                return Err(Lost {
                    heavy: true,
                    ..lost(far, why)
                });
            }
            if let Stop::MaxPoints = followed.stop {
                // The forces of taut rods are far away, but nothing happens on the way.
                let options = Options {
                    max_step: FAR,
                    ..options
                };
                followed = to_end(&options).map_err(begin)?;
            }
            let far = followed
                .points
                .iter()
                .map(|point| point.p)
                .fold(0.0, f64::max);
            match (followed.stop, followed.points.last()) {
                (Stop::Reached, Some(last)) => end = last.x.clone(),
                (_, Some(last)) if last.p > NEARLY => (end, stuck) = (last.x.clone(), true),
                (Stop::Undefined { reason, .. }, _) => return Err(lost(far, reason)),
                (Stop::MaxPoints, _) => {
                    let why = Error::no_convergence(
                        "the path took too many steps; give a guess, or lower the loads and follow a branch up to them",
                    );
                    return Err(Lost {
                        heavy: true,
                        ..lost(far, why)
                    });
                }
                (stop, _) => return Err(lost(far, Error::no_convergence(stop.to_string()))),
            }
            statics.start = None;
        }
        let settled = stuck.then(|| settled(&statics, &end, tolerance)).flatten();
        let found = settled.map_or_else(|| solved(&statics, &end, tolerance), Ok);
        found
            .and_then(|root| self.described(&statics, &root, route))
            .map_err(|why| lost(1.0, why))
    }

    fn described(
        &self,
        statics: &Statics<'_>,
        root: &Root,
        route: AssemblyRoute,
    ) -> Result<AssemblyEquilibrium> {
        let now = statics.frame.configuration(self, root.x.as_slice());
        // The search itself may go on along what the last piece of a spline is beyond the end.
        Carrier::within_ends(self.carriers(), &now.bodies)?;
        let points = self.points(0.0, &now.bodies, &now.charts, statics.tolerance)?;
        let index = self
            .index(0.0, &now, statics.tolerance.max(1e-11))
            .map_err(|why| why.context("the index of an equilibrium that was found"))?;
        Ok(AssemblyEquilibrium {
            energy: self.statical_energy(&now, &points),
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
            .map(|(carrier, place)| carrier.potential(0.0, &place.pose))
            .sum();
        let rods = points
            .iter()
            .map(|point| point.end.energy + point.potential());
        rods.sum::<f64>() + potential
    }

    /// Bodies where rods with these charts bring them, rod by rod from the ground: a body is where the first rod that reaches it
    /// ends, of those that are welded at both ends if there is one. Ball joints are laid out as welds.
    ///
    /// # Errors
    /// A body that no chain of rods joins to the ground.
    fn laid_out(
        &self,
        charts: Vec<Wrench>,
        bodies: &[Place],
        tolerance: f64,
    ) -> Result<Configuration> {
        let ends = self.links().iter().zip(&charts);
        let ends = ends.map(|(link, q)| Ok(link.end(q, tolerance)?.pose));
        let ends = ends.collect::<Result<Vec<Isometry3<f64>>>>()?;
        let mut placed: Vec<Option<Isometry3<f64>>> = vec![None; self.carriers().len()];
        // A ball joint leaves open how a body is turned: rods that are welded at both ends lead first.
        let mut by_joints = false;
        loop {
            let before = placed.iter().flatten().count();
            let rods = self.links().iter().zip(&ends);
            for (link, end) in rods.filter(|(link, _)| by_joints || link.joint() == Joint::Weld) {
                let seen = |site: &super::Attachment| match &site.on {
                    On::Body(body) => placed[*body].map(|pose| pose * site.place),
                    _ => Some(site.at(0.0, &[]).pose),
                };
                let (base, tip) = (seen(&link.from), seen(&link.to));
                let new = match (&link.from.on, &link.to.on, base, tip) {
                    (_, On::Body(body), Some(base), None) => {
                        Some((*body, base * end * link.to.place.inverse()))
                    }
                    (On::Body(body), _, None, Some(tip)) => {
                        Some((*body, tip * end.inverse() * link.from.place.inverse()))
                    }
                    _ => None,
                };
                if let Some((body, mut pose)) = new {
                    let carrier = &self.carriers()[body];
                    if !carrier.turns() {
                        pose.rotation = UnitQuaternion::identity();
                    }
                    if let Some(groove) = carrier.groove() {
                        let nearest = groove.nearest(&pose.translation.vector);
                        pose.translation.vector = groove.at(nearest)[0];
                    }
                    placed[body] = Some(pose);
                }
            }
            let led = placed.iter().flatten().count() > before;
            if led || !by_joints {
                by_joints = !led;
                continue;
            }
            // Where the rods lead no further, from the next body.
            by_joints = false;
            let next = placed.iter().position(Option::is_none);
            match next.and_then(|body| Some((body, bodies.get(body)?.pose))) {
                Some((body, pose)) => placed[body] = Some(pose),
                None => break,
            }
        }
        let bodies = placed.into_iter().enumerate().map(|(body, pose)| {
            pose.map(Place::at_rest).ok_or_else(|| {
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

/// Newton's method; where it fails, since the equilibrium is one of a continuous family (a column of equal bending stiffnesses
/// buckles any way round, a body turns about a ball joint), steps of least length.
fn solved(statics: &Statics<'_>, x: &DVector<f64>, tolerance: f64) -> Result<Root> {
    let options = newton::Options {
        tolerance,
        ..newton::Options::default()
    };
    let system = |x: &DVector<f64>| {
        let at = statics.linearised(x, 0.0)?;
        Ok((at.residual, at.jacobian))
    };
    match newton::solve(system, x, &options) {
        Ok(found) if statics.solves(&found.x, tolerance) => Ok(Root {
            x: found.x,
            correction: found.correction,
        }),
        found => settled(statics, x, tolerance).ok_or_else(|| match found {
            Err(why) => why,
            Ok(_) => Error::no_convergence("nothing bears the loads"),
        }),
    }
}

fn settled(statics: &Statics<'_>, x: &DVector<f64>, tolerance: f64) -> Option<Root> {
    let (mut x, mut last) = (x.clone(), f64::INFINITY);
    for _ in 0..MOST_SETTLING {
        let at = statics.linearised(&x, 0.0).ok()?;
        let size = at.jacobian.norm();
        let step = at
            .jacobian
            .svd(true, true)
            .solve(&at.residual, NEUTRAL * size)
            .ok()?;
        let correction = step.norm();
        let fine = correction <= tolerance * (1.0 + x.norm());
        let rounding = 4.0 * f64::EPSILON * (1.0 + x.norm());
        if fine && (correction > 0.5 * last || correction <= rounding) {
            return statics
                .solves(&x, tolerance)
                .then_some(Root { x, correction });
        }
        if !fine && !(correction < 0.9 * last) {
            return None;
        }
        last = correction;
        x -= step;
    }
    None
}
