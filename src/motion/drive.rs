//! The loop over a run that samples it at even times and tells an observer.

use super::run::{Outcome, Run, RunEvent, Sample};
use super::snap::Snap;
use crate::error::Result;
use crate::manifold::Multivalued;

/// Who watches a run.
pub trait Observer<const N: usize> {
    /// One of the evenly spaced samples.
    ///
    /// # Errors
    /// Whatever keeps the observer from taking it; the run then ends with that error.
    fn sample(&mut self, sample: &Sample<N>) -> Result<()>;

    /// A snap, with the state of the run just before and just after it.
    ///
    /// # Errors
    /// As above.
    fn snap(&mut self, snap: &Snap<N>, before: &Sample<N>, after: &Sample<N>) -> Result<()>;

    /// Asked after every step; false interrupts the run.
    fn go_on(&mut self, time: f64) -> bool;
}

/// Drives `run` to its end: `samples` >= 2 samples at even times over [start, duration], first and
/// last included; a run that ends early adds its last state.
///
/// # Errors
/// Those of the observer.
pub fn drive<M: Multivalued<N>, const N: usize>(
    run: &mut Run<'_, M, N>,
    samples: usize,
    observer: &mut impl Observer<N>,
) -> Result<Outcome<N>> {
    let last = samples.max(2) - 1;
    let duration = run.duration();
    let time_of = |k: usize| {
        if k == last {
            duration
        } else {
            duration * k as f64 / last as f64
        }
    };
    // A branch starts in the middle: the samples before it belong to its parent.
    let given = run.given();
    let mut next = (0..=last)
        .find(|&k| time_of(k) >= given.phase.t)
        .unwrap_or(last);
    if time_of(next) == given.phase.t {
        observer.sample(&given)?;
        next += 1;
    }
    let mut before = run.now();
    // `before` is kept only where a snap follows.
    while let Some(event) = run.next() {
        match event {
            RunEvent::Step { to, .. } => {
                while next <= last && time_of(next) <= to {
                    if let Some(sample) = run.sample(time_of(next)) {
                        observer.sample(&sample)?;
                    }
                    next += 1;
                }
                if run.at_fold() {
                    before = run.now();
                }
                if !observer.go_on(to) {
                    run.interrupt();
                }
            }
            RunEvent::Snap(snap) => {
                observer.snap(&snap, &before, &run.now())?;
            }
            RunEvent::Stop(outcome) => {
                if next <= last {
                    observer.sample(&run.now())?;
                }
                return Ok(outcome);
            }
        }
    }
    Ok(Outcome::EndOfTime)
}
