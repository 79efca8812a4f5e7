//! The interface of a motion of any model, and the loop that takes samples at even times.

use super::event::{Event, Outcome};
use super::saved_state::SavedState;
use super::snap::Snap;
use super::state::{State, StateRef};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::rod::Fallen;
use snaprod_systems::solve::cost::Cost;

/// A motion step by step, in the units of the rod: the interface of every model for driving and recording.
pub trait Motion<'a> {
    /// Advances to the next event; None after [`Event::Stop`].
    fn advance(&mut self) -> Option<Event>;

    /// The initial state as given. It may lie a first small step before the integration, as for starts on a fold.
    fn given(&self) -> StateRef<'_>;

    /// The state now.
    fn now(&self) -> StateRef<'_>;

    /// The state just before the last snap, with the same pose and velocity.
    fn before_snap(&self) -> Option<StateRef<'_>> {
        None
    }

    /// Shapes of the rod during `snap`, the last one, by the fast viscous layer: sections from the base on,
    /// in the directors of the base and the units of the motion. None if another rule chose the landing.
    fn fall(&self, snap: &Snap) -> Option<Vec<Fallen>> {
        snap.fall()
    }

    /// The state at a time within the last step; None outside it.
    fn sample(&mut self, t: f64) -> Option<StateRef<'_>>;

    /// Everything from which the motion goes on, at a time within the last step or at its end.
    ///
    /// # Errors
    /// A time outside the last step; a state that cannot be saved, with the reason.
    fn save(&mut self, _t: f64) -> Result<SavedState> {
        Err(Error::domain(
            "the state of a rod that touches obstacles cannot be saved: write rods = \"none\" in [contact], or follow the run \
             to its end",
        ))
    }

    /// Goes on from a saved state of the same method. Loads, friction and other laws may have changed since: the change
    /// of energy at the state is booked as work.
    ///
    /// # Errors
    /// The state of another method or of other rods; a state in which the rods cannot be.
    fn restore(&mut self, _saved: &SavedState) -> Result<()> {
        Err(Error::domain(
            "a rod that touches obstacles does not go on from a saved state",
        ))
    }

    /// Sees anew the loads at the end of the last step, after one that the owner steers has changed
    /// there. States within the last step are no longer to be sampled.
    ///
    /// # Errors
    /// Contacts without forces under the new loads.
    fn renew(&mut self) -> Result<()>;

    /// End of time.
    fn duration(&self) -> f64;

    /// Ends the motion at its next step, with [`Outcome::Interrupted`].
    fn interrupt(&mut self);

    /// Cost so far.
    fn cost(&self) -> Cost;

    /// State variables of the integration at present, in no order.
    fn carries(&self) -> Vec<StateVariables>;

    /// Resolution of the strains along the rod; None for models without strain fields.
    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// Why strains at nodes follow rods with mass where elements do by default; None if there is no such choice.
    fn why_no_elements(&self) -> Option<&str> {
        None
    }

    /// Total time in which the first-order mass of a rod was not followed, as between a fold and the landing.
    fn time_without_mass(&self) -> f64 {
        0.0
    }

    /// The motion that follows from `snap`, one of those of [`Outcome::Branched`].
    ///
    /// # Errors
    /// A snap of another motion; a model that does not branch.
    fn branch(&self, _snap: &Snap) -> Result<Box<dyn Motion<'a> + 'a>> {
        Err(Error::domain("this motion does not branch"))
    }
}

/// A group of the numbers that make up the state of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateVariables {
    /// Name of the group.
    pub what: &'static str,
    /// Size of the group.
    pub numbers: usize,
}

impl StateVariables {
    /// The groups of `parts` that are not empty.
    pub(super) fn some<const K: usize>(parts: [(&'static str, usize); K]) -> Vec<Self> {
        let parts = parts.into_iter().filter(|(_, numbers)| *numbers > 0);
        parts
            .map(|(what, numbers)| Self { what, numbers })
            .collect()
    }
}

/// Resolution of the strains along the rod so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Most nodes.
    pub most_nodes: usize,
    /// Largest relative size of the last coefficients of a strain field.
    pub tail: f64,
    /// Largest relative size of the last coefficients of the strain rates; None for rods without mass, whose
    /// rates are no field of their own.
    pub rate_tail: Option<f64>,
}

/// An observer of a motion.
pub trait Observer {
    /// One of the evenly spaced samples.
    ///
    /// # Errors
    /// Any error of the observer; the run ends with it.
    fn sample(&mut self, state: &dyn State) -> Result<()>;

    /// Every event but the stop, steps included, with the motion after the event.
    ///
    /// # Errors
    /// Any error of the observer; the run ends with it.
    fn event(&mut self, _event: &Event, _motion: &mut dyn Motion<'_>) -> Result<()> {
        Ok(())
    }

    /// Least number of moments per step, its end included, that [`Observer::look`] receives; 0: none. The
    /// moments are the samples if these are as many, else even in time.
    fn moments(&self) -> usize {
        0
    }

    /// Receives one of the moments of [`Observer::moments`], in the order of time.
    fn look(&mut self, _state: &dyn State) {}

    /// Called after every step; false interrupts the run.
    fn go_on(&mut self, time: f64) -> bool;
}

/// Drives `motion` to its end: `samples` >= 2 samples at even times over [0, duration], first and last included; a
/// motion that ends early adds its last state. A branch that starts in the middle has no samples before its start.
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
                    let between = if samples_do { moments.min(1) } else { moments };
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
