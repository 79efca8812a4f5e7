//! Runs of one rod with mass and its body.

use super::model::{MassiveRods, ModelAndState};
use super::sample::HeavySample;
use crate::State;
use nalgebra::{DVector, Vector3, Vector6};
use snaprod_systems::assembly::{Contact, Nearness};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::full_mass::rod::{HeavyRod, RodDescription, RodState};
use snaprod_systems::full_mass::system::INTEGRALS;
use snaprod_systems::math::se3::joined;
use snaprod_systems::section::Strain;
use snaprod_systems::solve::system::AnySystem;
use snaprod_systems::viscoelastic::grid::Grid;
use std::sync::Arc;

/// Initial state of a rod with mass.
pub struct HeavyStart<'a> {
    /// All strains at s in [0, 1].
    pub strain: &'a dyn Fn(f64) -> Strain,
    /// Initial rates of the strains.
    pub rate: HeavyRate<'a>,
    /// Strains to which Maxwell branches are relaxed; None: the initial strains.
    pub relaxed: Option<&'a dyn Fn(f64) -> Strain>,
    /// True: start at the stable equilibrium under all loads at the time 0 that is near `strain`.
    pub settled: bool,
}

/// Initial rates of the strains.
pub enum HeavyRate<'a> {
    /// Given rates of the strains at s.
    Strain(&'a dyn Fn(f64) -> Strain),
    /// Strain rates of the rod without mass, from the velocity of its end.
    End(EndVelocity),
}

/// (angular velocity, velocity) of the end of a rod at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EndVelocity {
    /// Seen from the clamp, along the axes of the clamp.
    OnClamp(Vector6<f64>),
    /// In the world, along the axes of the world; on a standing clamp, along those of the rod.
    InWorld(Vector6<f64>),
}

impl EndVelocity {
    /// Velocity of the end of the rod `at` time 0, seen from the clamp.
    fn on_clamp(&self, rod: &HeavyRod, at: &RodState) -> Vector6<f64> {
        match (self, rod.given.grain.support()) {
            (Self::OnClamp(twist), _) | (Self::InWorld(twist), None) => *twist,
            (Self::InWorld(twist), Some(clamp)) => {
                let place = joined(&Vector3::zeros(), &at.shape.end().translation.vector);
                clamp.at(0.0).of_poses().relative(&place, twist)
            }
        }
    }
}

impl MassiveRods for Arc<HeavyRod> {
    fn system(&self) -> &dyn AnySystem {
        &**self
    }

    fn time(&self) -> usize {
        HeavyRod::time(self)
    }

    fn sample(&self, y: &DVector<f64>, implicit: bool) -> Option<Box<dyn State>> {
        let sample = if implicit {
            HeavySample::of_rod(self, y, &y.as_slice()[HeavyRod::time(self) + INTEGRALS..])
        } else {
            let at = self.at(y)?;
            let second = self.accelerations(y[HeavyRod::time(self)], &at)?;
            HeavySample::of_rod(self, y, second.as_slice())
        };
        Some(Box::new(sample?))
    }

    fn rods(&self, y: &DVector<f64>) -> Option<Vec<(&HeavyRod, RodState)>> {
        Some(vec![(&**self, self.at(y)?)])
    }

    fn regridded(&self, y: &DVector<f64>, counts: &[usize]) -> Option<ModelAndState> {
        let at = self.at(y)?;
        let old = &self.sections.grid;
        let grid = Grid::new(&old.breaks(), counts);
        let [strains, rates] = [&at.strains, &at.rates].map(|field| old.carried(field, &grid));
        let next = HeavyRod::new(self.given.clone(), grid.clone()).ok()?;
        let mut state = next.state(&next.coordinates(&strains), &next.coordinates(&rates));
        let (from, to) = (HeavyRod::time(self), next.time());
        let dashpots = self.dashpots(&at);
        let dashpots = dashpots
            .iter()
            .map(|z| next.coordinates(&old.carried(z, &grid)));
        write_dashpots(&next, &mut state, &dashpots.collect::<Vec<_>>().concat());
        state
            .rows_mut(to, INTEGRALS)
            .copy_from(&y.rows(from, INTEGRALS));
        Some((Box::new(Arc::new(next)), state))
    }

    fn next_break(&self, t: f64) -> f64 {
        HeavyRod::next_break(self, t)
    }

    fn nearness(&self, y: &DVector<f64>) -> Option<Nearness> {
        let at = self.at(y)?;
        let tube = self.tube(&at, 0, vec![None])?;
        Some(Nearness::of(&[tube]))
    }

    fn contact(&self, y: &DVector<f64>, near: &Contact) -> Option<Contact> {
        let at = self.at(y)?;
        near.now(&[self.tube(&at, 0, vec![None])?])
    }
}

/// Writes the strains of the dashpots of Maxwell branches, stored after strains and rates in a state.
fn write_dashpots(rod: &HeavyRod, y: &mut DVector<f64>, z: &[f64]) {
    y.as_mut_slice()[2 * rod.size()..rod.time()].copy_from_slice(z);
}

/// The model of the rod with `counts` nodes on the elements, and the initial state.
pub(super) fn begun(
    given: &RodDescription,
    start: &HeavyStart<'_>,
    counts: &[usize],
) -> Result<ModelAndState> {
    let grid = Grid::new(&given.breaks(), counts);
    let places = grid.nodes().to_vec();
    let rod = HeavyRod::new(given.clone(), grid)?;
    let field =
        |f: &dyn Fn(f64) -> Strain| -> Vec<Strain> { places.iter().map(|s| f(*s)).collect() };
    let strains = field(start.strain);
    if !strains.iter().all(|e| e.iter().all(|x| x.is_finite())) {
        return Err(Error::domain("the strains at the start must be finite"));
    }
    let mut q = rod.coordinates(&strains);
    if start.settled {
        q = rod.settled(0.0, &q)?;
    }
    let w = match &start.rate {
        HeavyRate::Strain(rate) => rod.coordinates(&field(*rate)),
        HeavyRate::End(velocity) => {
            let still = vec![0.0; rod.size()];
            let at = rod.moving(&q, &still).ok_or_else(|| {
                Error::domain("the strains at the start are too large for a shape of the rod")
            })?;
            let twist = velocity.on_clamp(&rod, &at);
            let turns = (rod.given.grain.support()).is_some_and(|clamp| clamp.turns());
            if twist == Vector6::zeros() && !turns {
                still
            } else {
                rod.following(0.0, &at, &twist)?
            }
        }
    };
    if !w.iter().all(|x| x.is_finite()) {
        return Err(Error::domain(
            "the rates of the strains at the start must be finite",
        ));
    }
    let mut y = rod.state(&q, &w);
    if let Some(relaxed) = start.relaxed {
        let at = rod.coordinates(&field(relaxed));
        write_dashpots(&rod, &mut y, &at.repeat(given.law.branches().len()));
    }
    if !y.iter().all(|x| x.is_finite()) {
        return Err(Error::domain(
            "the strains to which the Maxwell branches are relaxed must be finite",
        ));
    }
    Ok((Box::new(Arc::new(rod)), y))
}
