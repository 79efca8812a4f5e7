//! A section law whose tensions and driven rest strains are histories in time.

use super::{Driven, Measures, RestDrive, SectionLaw, Tendon, Tendons, law_in_units, reverse_law};
use crate::error::{Error, Result};
use crate::math::history::History;
use std::sync::Arc;

/// A section law in time: that of a rod at rest, with driven rest strains and tendons on top.
#[derive(Debug, Clone)]
pub struct LawInTime {
    base: Arc<dyn SectionLaw>,
    drive: Option<(RestDrive, History)>,
    tendons: Vec<(Tendon, History)>,
    length: f64,
    units: Measures,
    reversed: bool,
}

impl LawInTime {
    /// The law of a rod of this length. `base` has neither drive nor tendons; histories give the amplitude of the drive
    /// and the tensions. All are in the user's units; the law that comes out, and its time, are in `units`.
    ///
    /// # Errors
    /// As [`Driven::new`], [`Tendons::new`] and [`History::checked`]; a history that jumps.
    pub fn new(
        base: Arc<dyn SectionLaw>,
        drive: Option<(RestDrive, History)>,
        tendons: Vec<(Tendon, History)>,
        length: f64,
        units: Measures,
    ) -> Result<Self> {
        let law = Self {
            base,
            drive,
            tendons,
            length,
            units,
            reversed: false,
        };
        for history in law.histories() {
            let history = history.clone().checked()?;
            if matches!(history, History::Block(_)) {
                return Err(Error::domain(
                    "a tension or a drive in time jumps; let it grow by a ramp or a table",
                ));
            }
        }
        law.at(0.0)?;
        Ok(law)
    }

    /// The law of the rod begun at its other end.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        self.reversed = !self.reversed;
        self
    }

    fn histories(&self) -> impl Iterator<Item = &History> {
        let drive = self.drive.iter().map(|(_, amplitude)| amplitude);
        drive.chain(self.tendons.iter().map(|(_, tension)| tension))
    }

    /// Section law at time `t`, with the rates of its tensions and of its drive.
    ///
    /// # Errors
    /// A tension < 0, a number that is not finite.
    pub fn at(&self, t: f64) -> Result<Arc<dyn SectionLaw>> {
        let now = |history: &History| {
            let [x, rate, _] = history.with_rates(t * self.units.time);
            (x, rate * self.units.time)
        };
        let mut law = self.base.clone();
        if let Some((shape, amplitude)) = &self.drive {
            let (amplitude, rate) = now(amplitude);
            law = Arc::new(Driven::new(law, shape.clone(), amplitude, self.length)?.changing(rate));
        }
        if !self.tendons.is_empty() {
            let pulled = self.tendons.iter().map(|(tendon, tension)| {
                let (tension, rate) = now(tension);
                let tendon = Tendon {
                    tension,
                    ..tendon.clone()
                };
                (tendon, rate)
            });
            let (tendons, rates) = pulled.unzip();
            law = Arc::new(Tendons::new(law, tendons, self.length)?.changing(rates));
        }
        let law = law_in_units(law, self.units);
        Ok(if self.reversed {
            let length = self.length / self.units.length;
            Arc::new(reverse_law(law, length))
        } else {
            law
        })
    }

    /// True while a number changes.
    pub fn moves(&self, t: f64) -> bool {
        let t = t * self.units.time;
        self.histories()
            .any(|history| history.with_rates(t)[1] != 0.0)
    }

    /// The first time after `t` at which a number is not smooth; infinite if none is left. The law at the double just
    /// below that time is the law before the break, whatever the rounding of the units.
    pub fn next_break(&self, t: f64) -> f64 {
        let unit = self.units.time;
        let next = self.histories().map(|history| history.next_break(t * unit));
        let next = next.fold(f64::INFINITY, f64::min);
        let mut found = next / unit;
        while found.is_finite() && found * unit < next {
            found = found.next_up();
        }
        while found.is_finite() && found.next_down() * unit >= next {
            found = found.next_down();
        }
        found
    }
}
