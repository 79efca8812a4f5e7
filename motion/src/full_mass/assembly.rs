//! Runs of an assembly of rods with mass.

use super::model::{MassiveRods, ModelAndState};
use super::sample::HeavySample;
use crate::State;
use nalgebra::{DVector, UnitQuaternion};
use snaprod_systems::assembly::{BodyMotion, Contact, Nearness};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::full_mass::assembly::HeavyAssembly;
use snaprod_systems::full_mass::rod::{HeavyRod, RodState};
use snaprod_systems::section::Strain;
use snaprod_systems::solve::system::AnySystem;
use std::sync::Arc;

/// Initial state of an assembly of rods with mass.
pub struct HeavyAssemblyStart<'a> {
    /// Poses and twists of the bodies.
    pub bodies: Vec<BodyMotion>,
    /// The rods.
    pub rods: Vec<RodStart<'a>>,
    /// True: start at the nearby equilibrium under all loads at the time 0.
    pub settled: bool,
    /// True: start with the rates at which rods without mass would follow the bodies.
    pub following: bool,
}

/// Initial state of one rod.
pub struct RodStart<'a> {
    /// Rotation of the base in the world; used for a base on a ball joint.
    pub base: UnitQuaternion<f64>,
    /// All strains at s in [0, 1].
    pub strain: Box<dyn Fn(f64) -> Strain + 'a>,
    /// Strains to which the Maxwell branches are relaxed; None: the initial strains.
    pub relaxed: Option<Box<dyn Fn(f64) -> Strain + 'a>>,
    /// Initial rates of the strains; not used with `following`.
    pub rate: Box<dyn Fn(f64) -> Strain + 'a>,
}

/// Splits the node counts of all elements in a row by rods.
fn split(given: &HeavyAssembly, counts: &[usize]) -> Vec<Vec<usize>> {
    let mut at = 0;
    let rods = given.links.iter().map(|link| {
        let elements = link.rod.given.breaks().len() + 1;
        at += elements;
        counts[at - elements..at].to_vec()
    });
    rods.collect()
}

impl HeavyAssemblyStart<'_> {
    /// The assembly with `counts` nodes on the elements of all rods in a row, and its initial state.
    ///
    /// # Errors
    /// Strains and rates that are not finite, ends off their attachments; with `settled` or `following` a
    /// failed search for the equilibrium or the rates.
    pub fn at_nodes(
        &self,
        given: &HeavyAssembly,
        counts: &[usize],
    ) -> Result<(HeavyAssembly, DVector<f64>)> {
        let assembly = given.with_nodes(&split(given, counts))?;
        let field = |link: &HeavyRod, f: &dyn Fn(f64) -> Strain| -> Vec<f64> {
            let nodes = link.sections.grid.nodes().iter();
            link.coordinates(&nodes.map(|s| f(*s)).collect::<Vec<Strain>>())
        };
        let rods = || assembly.links.iter().zip(&self.rods);
        let strains: Vec<_> = rods()
            .map(|(link, at)| field(&link.rod, &*at.strain))
            .collect();
        let rates: Vec<_> = rods()
            .map(|(link, at)| field(&link.rod, &*at.rate))
            .collect();
        let finite = strains
            .iter()
            .chain(&rates)
            .flatten()
            .all(|x| x.is_finite());
        if !finite {
            return Err(Error::domain(
                "the strains at the start and their rates must be finite",
            ));
        }
        let bases: Vec<_> = self.rods.iter().map(|rod| rod.base).collect();
        let mut y = assembly.closed(&assembly.state(&self.bodies, &bases, &strains, &rates))?;
        if self.settled {
            y = assembly.settled(&y)?;
        }
        if self.following {
            let twists: Vec<_> = self.bodies.iter().map(|place| place.twist).collect();
            y = assembly.following(&y, &twists)?;
        }
        let relaxed = rods().map(|(link, at)| {
            let strain = at.relaxed.as_ref()?;
            Some(field(&link.rod, &**strain))
        });
        let y = assembly.relaxed(y, &relaxed.collect::<Vec<_>>());
        Ok((assembly, y))
    }
}

/// The model and initial state of a run.
pub(super) fn begun(
    given: &HeavyAssembly,
    start: &HeavyAssemblyStart<'_>,
    counts: &[usize],
) -> Result<ModelAndState> {
    let (assembly, y) = start.at_nodes(given, counts)?;
    Ok((Box::new(Arc::new(assembly)), y))
}

impl MassiveRods for Arc<HeavyAssembly> {
    fn system(&self) -> &dyn AnySystem {
        &**self
    }

    fn time(&self) -> usize {
        HeavyAssembly::time(self)
    }

    fn sample(&self, y: &DVector<f64>, implicit: bool) -> Option<Box<dyn State>> {
        let at = self.at(y)?;
        let unknowns = if implicit {
            DVector::from_column_slice(self.second(y))
        } else {
            self.accelerations(&at)?
        };
        Some(Box::new(HeavySample::of_assembly(self, y, at, &unknowns)?))
    }

    fn rods(&self, y: &DVector<f64>) -> Option<Vec<(&HeavyRod, RodState)>> {
        let rods = self.links.iter().map(|link| &link.rod);
        Some(rods.zip(self.at(y)?.rods).collect())
    }

    fn regridded(&self, y: &DVector<f64>, counts: &[usize]) -> Option<ModelAndState> {
        let next = self.with_nodes(&split(self, counts)).ok()?;
        let state = next.closed(&next.carried(self, y)?).ok()?;
        Some((Box::new(Arc::new(next)), state))
    }

    fn project_constraints(&self, y: &DVector<f64>, bound: f64) -> Option<DVector<f64>> {
        let [gap, leaving] = self.gap(&self.at(y)?);
        if gap.max(leaving) > bound {
            self.closed(y).ok()
        } else {
            None
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        HeavyAssembly::next_break(self, t)
    }

    fn along_grooves(&self, y: &DVector<f64>) -> Vec<(usize, [f64; 2], [f64; 2])> {
        HeavyAssembly::along_grooves(self, y)
    }

    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness> {
        let at = self.at(y)?;
        let tubes = self.tubes(&at);
        (!tubes.is_empty()).then(|| Nearness::of(&tubes))
    }

    fn rod_name(&self, rod: usize) -> String {
        HeavyAssembly::rod_name(self, rod)
    }

    fn contact(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact> {
        near.now(&self.tubes(&self.at(y)?))
    }
}
