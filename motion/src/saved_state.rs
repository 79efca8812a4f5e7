//! Saved states of motions: all numbers from which a motion goes on.

use super::ledger::Ledger;
use snaprod_systems::error::{Error, Result};
use std::collections::BTreeMap;

/// All numbers from which a motion goes on, as named lists in the units of the motion.
///
/// A state belongs to a method: [`Motion::restore`](crate::Motion::restore) refuses the state of another one.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedState {
    /// Method that the state belongs to.
    pub method: String,
    /// Time.
    pub t: f64,
    /// Parts by name, such as "chart", "velocity", "strains", "bodies".
    pub parts: BTreeMap<String, Vec<f64>>,
}

/// Name of the part with the energies of the ledger.
const LEDGER: &str = "ledger";

impl SavedState {
    /// A state with its energies and without further parts.
    pub(crate) fn new(method: &str, t: f64, ledger: &Ledger) -> Self {
        let state = Self {
            method: method.to_owned(),
            t,
            parts: BTreeMap::new(),
        };
        let energies = [
            ledger.kinetic,
            ledger.rod_kinetic,
            ledger.elastic,
            ledger.potential,
            ledger.dissipated,
            ledger.work,
        ];
        state.with(LEDGER, energies)
    }

    /// The state with one more part.
    pub(crate) fn with(mut self, name: &str, numbers: impl IntoIterator<Item = f64>) -> Self {
        self.parts
            .insert(name.to_owned(), numbers.into_iter().collect());
        self
    }

    /// Checks that the state is one of `method`.
    ///
    /// # Errors
    /// The state of another method; a time that is not finite.
    pub(crate) fn check(&self, method: &str) -> Result<()> {
        if self.method != method {
            return Err(Error::domain(format!(
                "this is a state of {}, and the scene moves by {method}: take the state of a run of the same scene",
                self.method
            )));
        }
        let parts = self.parts.iter();
        let numbers = parts.flat_map(|(name, list)| list.iter().map(move |x| (name.as_str(), *x)));
        for (name, x) in numbers.chain([("t", self.t)]) {
            if !x.is_finite() {
                return Err(Error::domain(format!(
                    "the part {name} of the state has the number {x}; all must be finite"
                )));
            }
        }
        Ok(())
    }

    /// The numbers of a part.
    ///
    /// # Errors
    /// A part that is missing.
    pub(crate) fn part(&self, name: &str) -> Result<&[f64]> {
        let found = self.parts.get(name).map(Vec::as_slice);
        found.ok_or_else(|| Error::domain(format!("the state has no part {name}")))
    }

    /// The numbers of a part of fixed size.
    ///
    /// # Errors
    /// A part that is missing, or of another size.
    pub(crate) fn array<const K: usize>(&self, name: &str) -> Result<[f64; K]> {
        let found = self.sized(name, K)?;
        Ok(std::array::from_fn(|i| found[i]))
    }

    /// The numbers of a part that must be `size` of them.
    ///
    /// # Errors
    /// A part that is missing, or of another size.
    pub(crate) fn sized(&self, name: &str, size: usize) -> Result<&[f64]> {
        let found = self.part(name)?;
        if found.len() != size {
            return Err(Error::domain(format!(
                "the part {name} of the state has {} numbers; this motion has {size}",
                found.len()
            )));
        }
        Ok(found)
    }

    /// The counts in a part.
    ///
    /// # Errors
    /// A part that is missing, or numbers that are no counts from 1 to 10000.
    pub(crate) fn counts(&self, name: &str) -> Result<Vec<usize>> {
        let count = |x: &f64| {
            let is_one = x.fract() == 0.0 && (1.0..=1e4).contains(x);
            is_one.then_some(*x as usize).ok_or_else(|| {
                Error::domain(format!(
                    "the part {name} of the state has the number {x}; it must be a count from 1 to 10000"
                ))
            })
        };
        self.part(name)?.iter().map(count).collect()
    }

    /// The energies.
    ///
    /// # Errors
    /// A part that is missing, or of another size.
    pub(crate) fn ledger(&self) -> Result<Ledger> {
        let [kinetic, rod_kinetic, elastic, potential, dissipated, work] = self.array(LEDGER)?;
        Ok(Ledger {
            kinetic,
            rod_kinetic,
            elastic,
            potential,
            dissipated,
            work,
        })
    }

    /// Work that a change of loads or laws has done since the state was saved: the change of potential and elastic
    /// energy at the same state. Rounding of equal energies counts as 0.
    ///
    /// # Errors
    /// Those of [`SavedState::ledger`].
    pub(crate) fn work_of_change(&self, now: &Ledger) -> Result<f64> {
        let before = self.ledger()?;
        let change = now.elastic - before.elastic + now.potential - before.potential;
        let rounding = ROUNDING * (1.0 + before.largest());
        Ok(if change.abs() > rounding { change } else { 0.0 })
    }
}

/// Relative change of energies that is rounding.
const ROUNDING: f64 = 1e-11;

/// The refusal to save a state at a time outside of the last step.
pub(crate) fn outside_step(t: f64) -> Error {
    Error::domain(format!("t = {t} is not within the last step"))
}
