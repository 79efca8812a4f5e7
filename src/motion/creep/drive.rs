//! The loop over a viscoelastic run that samples it at even times and tells an observer.

use super::run::{ViscousEvent, ViscousOutcome, ViscousRun};
use super::sample::ViscousSample;
use crate::body::EndBody;
use crate::creep::kinematics::Kinematics;
use crate::error::Result;

/// Who watches a viscoelastic run.
pub trait ViscousObserver<K: Kinematics<M, D>, const M: usize, const D: usize> {
    /// One of the evenly spaced samples.
    ///
    /// # Errors
    /// Whatever keeps the observer from taking it; the run then ends with that error.
    fn sample(&mut self, sample: &ViscousSample<K, M, D>) -> Result<()>;

    /// The state at the end of a step, for what even samples are too coarse to show.
    ///
    /// # Errors
    /// As above.
    fn step(&mut self, sample: &ViscousSample<K, M, D>) -> Result<()>;

    /// Asked after every step; false interrupts the run.
    fn go_on(&mut self, time: f64) -> bool;
}

/// Drives `run` to its end: `samples` >= 2 samples at even times over [0, duration], first and last included; a run that
/// ends early adds its last state.
///
/// # Errors
/// Those of the observer.
pub fn drive_viscous<K, B, const M: usize, const D: usize>(
    run: &mut ViscousRun<'_, K, B, M, D>,
    samples: usize,
    observer: &mut impl ViscousObserver<K, M, D>,
) -> Result<ViscousOutcome>
where
    K: Kinematics<M, D> + Clone,
    B: EndBody<D, Pose = K::Pose>,
{
    let last = samples.max(2) - 1;
    let duration = run.duration();
    let time_of = |k: usize| duration * k as f64 / last as f64;
    observer.sample(run.first())?;
    let mut next = 1;
    while let Some(event) = run.next() {
        match event {
            ViscousEvent::Step { to, .. } => {
                while next < last && time_of(next) <= to {
                    if let Some(sample) = run.sample(time_of(next)) {
                        observer.sample(&sample)?;
                    }
                    next += 1;
                }
                observer.step(run.now())?;
                if !observer.go_on(to) {
                    run.interrupt();
                }
            }
            ViscousEvent::Stop(outcome) => {
                observer.sample(run.now())?;
                return Ok(outcome);
            }
        }
    }
    Ok(ViscousOutcome::EndOfTime)
}
