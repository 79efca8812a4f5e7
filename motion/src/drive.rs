//! A motion seen from outside, whatever model is integrated, and the loop that samples it at even times.

use super::event::{Event, Outcome};
use super::snap::Snap;
use super::state::{Seen, State};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::rod::Fallen;
use snaprod_systems::solve::cost::Cost;

/// A motion step by step, in the units of the rod: what every model offers to those who drive and record it.
pub trait Motion<'a> {
    /// Goes on to the next event; None after [`Event::Stop`].
    fn advance(&mut self) -> Option<Event>;

    /// The state that the motion was given; it may lie a first small step before what is integrated, as at a fold.
    fn given(&self) -> Seen<'_>;

    /// The state now.
    fn now(&self) -> Seen<'_>;

    /// The state just before the last snap, which left pose and velocity as they were.
    fn before_snap(&self) -> Option<Seen<'_>> {
        None
    }

    /// The shapes through which the rod fell in the last snap, which was this one, from its base on: sections in the directors there, in the units of the
    /// motion. They are those of the fast viscous layer. None where another rule chose the landing.
    fn fall(&self, snap: &Snap) -> Option<Vec<Fallen>> {
        snap.fall()
    }

    /// The state at a time within the last step; None outside it.
    fn sample(&mut self, t: f64) -> Option<Seen<'_>>;

    /// End of time.
    fn duration(&self) -> f64;

    /// Ends the motion at its next step, with [`Outcome::Interrupted`].
    fn interrupt(&mut self);

    /// What it cost so far.
    fn cost(&self) -> Cost;

    /// What it carries from step to step now, in no order.
    fn carries(&self) -> Vec<Carried>;

    /// How the strains along the rod are resolved; None for a model that has no strains of its own to follow.
    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// For how long it has not felt the mass of a rod that it feels elsewhere, to first order, as between a fold and the landing.
    fn unfelt(&self) -> f64 {
        0.0
    }

    /// The motion that follows from `snap`, one of those of [`Outcome::Branched`].
    ///
    /// # Errors
    /// A snap that is not of this motion; a model that does not branch.
    fn branch(&self, _snap: &Snap) -> Result<Box<dyn Motion<'a> + 'a>> {
        Err(Error::domain("this motion does not branch"))
    }
}

/// Numbers that a motion carries from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Carried {
    /// What they are.
    pub what: &'static str,
    /// How many.
    pub numbers: usize,
}

impl Carried {
    /// These of them that there are any of.
    pub(super) fn some<const K: usize>(parts: [(&'static str, usize); K]) -> Vec<Self> {
        let parts = parts.into_iter().filter(|(_, numbers)| *numbers > 0);
        parts
            .map(|(what, numbers)| Self { what, numbers })
            .collect()
    }
}

/// How the strains along the rod were resolved so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Most nodes.
    pub most_nodes: usize,
    /// Largest relative size of the last coefficients of a field.
    pub tail: f64,
    /// Of the strain rates, where the rod has mass and they are a field of their own.
    pub rate_tail: Option<f64>,
}

/// Who watches a motion.
pub trait Observer {
    /// One of the evenly spaced samples.
    ///
    /// # Errors
    /// Whatever keeps the observer from taking it; the run then ends with that error.
    fn sample(&mut self, state: &dyn State) -> Result<()>;

    /// Every event but the stop, steps included, with the motion as it stands after it.
    ///
    /// # Errors
    /// As above.
    fn event(&mut self, _event: &Event, _motion: &mut dyn Motion<'_>) -> Result<()> {
        Ok(())
    }

    /// Of how many moments of every step, its end among them, [`Observer::look`] is told at least; 0: of none. They are the samples where these
    /// are as many, else even in time.
    fn moments(&self) -> usize {
        0
    }

    /// One of these moments, in the order of time.
    fn look(&mut self, _state: &dyn State) {}

    /// Asked after every step; false interrupts the run.
    fn go_on(&mut self, time: f64) -> bool;
}

/// Drives `motion` to its end: `samples` >= 2 samples at even times over [0, duration], first and last included; one that
/// ends early adds its last state. A branch that starts in the middle has no samples before its start.
///
/// # Errors
/// Those of the observer.
pub fn drive(
    motion: &mut dyn Motion<'_>,
    samples: usize,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let last = samples.max(2) - 1;
    let duration = motion.duration();
    let time_of = |k: usize| duration * k as f64 / last as f64;
    let mut next = {
        let given = motion.given();
        let next = (0..last).find(|&k| time_of(k) >= given.time());
        match next.unwrap_or(last) {
            k if time_of(k) == given.time() => {
                observer.sample(&*given)?;
                k + 1
            }
            k => k,
        }
    };
    while let Some(event) = motion.advance() {
        match event {
            Event::Stop(outcome) => {
                if next <= last {
                    observer.sample(&*motion.now())?;
                }
                return Ok(outcome);
            }
            event => {
                if let Event::Step { from, to } = event {
                    let moments = observer.moments();
                    let inside = (next..last).take_while(|k| time_of(*k) <= to).count();
                    let samples_do = inside >= moments;
                    let mut seen = from;
                    while next < last && time_of(next) <= to {
                        if let Some(state) = motion.sample(time_of(next)) {
                            observer.sample(&*state)?;
                            if moments > 0 && samples_do {
                                observer.look(&*state);
                                seen = time_of(next);
                            }
                        }
                        next += 1;
                    }
                    let between = match samples_do {
                        true => moments.min(1),
                        false => moments,
                    };
                    for k in (1..=between).filter(|_| seen < to) {
                        let t = from + (to - from) * k as f64 / between as f64;
                        if let Some(state) = motion.sample(t) {
                            observer.look(&*state);
                        }
                    }
                    if !observer.go_on(to) {
                        motion.interrupt();
                    }
                }
                observer.event(&event, motion)?;
            }
        }
    }
    Ok(Outcome::EndOfTime)
}
