//! The first part of a run, by which the cost of the whole is told.

use crate::error::Result;
use crate::motion::LandingRule;
use crate::scene::{Scene, Units};
use crate::study::record::Nowhere;
use crate::study::run::Fields;
use crate::study::{Hooks, any};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// The first part of a run, or all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The fraction of its duration that it came to.
    pub fraction: f64,
    /// Seconds that this took, the search for the start among them.
    pub seconds: f64,
    /// The pace of its last steps; None of fewer than two.
    pub pace: Option<Pace>,
    /// Steps, and right-hand sides; None of a bar, whose steps follow from its cells.
    pub work: Option<[u64; 2]>,
    /// Why it ended before its time, if it did so by itself.
    pub reason: Option<String>,
    /// True if it branches at snaps, so that nothing is known of the whole.
    pub branches: bool,
}

/// How fast a run goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Seconds that the whole duration takes in steps like the last ones.
    pub seconds: f64,
    /// True if the steps still grow, as those of a rod with friction do that is let go: the rest takes less than that, if they shrink no more.
    pub grows: bool,
}

/// The last steps are one in so many, and they grow if they are longer by this factor than as many before them.
const LAST: usize = 4;
const LONGER: f64 = 1.5;
/// Parts of these steps, of which the one that took least tells what a step costs: other programs took their time from the rest.
const PARTS: usize = 4;
/// Steps that are remembered; of more every second is forgotten.
const MARKS: usize = 4096;
/// Bounds beyond this many seconds say nothing.
const FAR: f64 = 86400.0;

impl Pace {
    /// From what was remembered of the steps.
    fn of(marks: &[Mark]) -> Option<Self> {
        let end = marks.len().checked_sub(1)?;
        let few = (end / LAST).max(1);
        let steps = |from: usize, to: usize| (marks[to].step - marks[from].step) as f64;
        let length = |from: usize, to: usize| {
            let way = marks[to].fraction - marks[from].fraction;
            Some(way / steps(from, to)).filter(|length| *length > 0.0)
        };
        let middle = end.checked_sub(few)?;
        let last = length(middle, end)?;
        let before = middle
            .checked_sub(few)
            .and_then(|from| length(from, middle));
        let first = end.saturating_sub(2 * few);
        let part = ((end - first) / PARTS).max(1);
        let costs = (first..=end - part).step_by(part).map(|from| {
            let spent = marks[from + part].at - marks[from].at;
            spent.as_secs_f64() / steps(from, from + part)
        });
        Some(Self {
            seconds: costs.fold(f64::INFINITY, f64::min) / last,
            grows: before.is_none_or(|before| last > LONGER * before),
        })
    }
}

impl Trial {
    /// Seconds that the whole run may take, figures and files aside, if it goes on as it began; None where nothing tells that.
    pub fn expected(&self) -> Option<f64> {
        self.whole().filter(|(_, grows)| !grows).map(|(all, _)| all)
    }

    /// Seconds of which it takes less, where its steps still grow and if they shrink no more.
    pub fn at_most(&self) -> Option<f64> {
        self.whole().filter(|(_, grows)| *grows).map(|(all, _)| all)
    }

    /// Seconds of the whole in steps like the last ones, and whether these grow.
    fn whole(&self) -> Option<(f64, bool)> {
        let rest = 1.0 - self.fraction;
        match self.pace {
            _ if self.branches || self.reason.is_some() => None,
            _ if rest <= 0.0 => Some((self.seconds, false)),
            pace => pace.map(|pace| (self.seconds + pace.seconds * rest, pace.grows)),
        }
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "fraction": self.fraction,
            "seconds": self.seconds,
            "steps": self.work.map(|work| work[0]),
            "evaluations": self.work.map(|work| work[1]),
            "reason": self.reason,
            "expected_seconds": self.expected(),
            "at_most_seconds": self.at_most(),
        })
    }

    pub(super) fn text(&self, duration: f64, units: Units) -> String {
        let spent = long(self.seconds);
        let work = match self.work {
            Some([steps, evaluations]) => {
                format!(" ({steps} steps, {evaluations} right-hand sides)")
            }
            None => String::new(),
        };
        if self.fraction >= 1.0 && self.reason.is_none() && !self.branches {
            return format!("all of it, done as a trial, took {spent}{work}");
        }
        let at = format!(
            "{} of {} {}",
            plain(self.fraction * duration),
            plain(duration),
            units.time()
        );
        let came = format!("a trial of {spent} came to t = {}{work}", at.trim_end());
        match (&self.reason, self.branches, self.whole()) {
            (Some(reason), ..) => format!("{came}, where the run ends: {reason}"),
            (None, true, _) => format!(
                "{came} of one branch; at every snap the run branches, which multiplies its cost"
            ),
            (None, false, Some((all, false))) => format!(
                "{came}: about {} for the whole, figures and files aside, if it goes on as it began",
                long(all)
            ),
            (None, false, Some((all, true))) if all < FAR => format!(
                "{came}, and its steps still grow: {} for the whole or less, if they shrink no more, figures and files aside; more --seconds tell it better",
                long(all)
            ),
            (None, false, Some((_, true))) => format!(
                "{came}, and its steps still grow, by far too short yet to tell the cost of the whole; give it more --seconds"
            ),
            (None, false, None) => format!(
                "{came}, too few steps to tell the cost of the whole; give it more --seconds"
            ),
        }
    }
}

/// Seconds, or what is read more easily.
fn long(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => format!("{s:.2} s"),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 2e5 => format!("{:.0} h", s / 3600.0),
        s => format!("{} days", plain((s / 86400.0).round())),
    }
}

/// A number with four digits, with an exponent only where it is very large or small.
fn plain(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    match x == 0.0 || (1e-6..1e7).contains(&x) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

/// That a step was taken: which, when, and to what fraction of the duration it came.
#[derive(Debug, Clone, Copy)]
struct Mark {
    step: u64,
    at: Duration,
    fraction: f64,
}

/// Ends a run when its time is up.
struct Clock {
    begun: Instant,
    given: Duration,
    taken: u64,
    /// Steps that are remembered, evenly chosen, the last one among them.
    marks: Vec<Mark>,
}

impl Hooks for Clock {
    fn interrupted(&mut self) -> bool {
        self.begun.elapsed() >= self.given
    }

    fn progress(&mut self, fraction: f64, _: f64) {
        if self.marks.len() == MARKS {
            let mut odd = false;
            self.marks.retain(|_| {
                odd = !odd;
                !odd
            });
        }
        self.taken += 1;
        self.marks.push(Mark {
            step: self.taken,
            at: self.begun.elapsed(),
            fraction,
        });
    }
}

/// Runs the scene for about so many seconds.
pub(super) fn trial(scene: &Scene, seconds: f64) -> Result<Option<Trial>> {
    if !(seconds > 0.0) {
        return Ok(None);
    }
    let mut clock = Clock {
        begun: Instant::now(),
        given: Duration::from_secs_f64(seconds.min(1e6)),
        taken: 0,
        marks: Vec::new(),
    };
    let found = any::motion(scene, Fields::None, &mut Nowhere, &mut clock)?;
    let spent = clock.begun.elapsed().as_secs_f64();
    let interrupted = found.summary["outcome"] == "interrupted";
    let reason = found.reason.filter(|_| !interrupted);
    let fraction = match clock.marks.last() {
        _ if !interrupted && reason.is_none() => 1.0,
        Some(last) => last.fraction,
        None => 0.0,
    };
    let count = |key: &str| found.summary["work"][key].as_u64();
    let run = scene.run.as_ref();
    Ok(Some(Trial {
        fraction,
        seconds: spent,
        pace: Pace::of(&clock.marks),
        work: count("steps")
            .zip(count("evaluations"))
            .map(<[u64; 2]>::from),
        reason,
        branches: run.is_some_and(|run| run.landing == LandingRule::All),
    }))
}

#[cfg(test)]
mod tests {
    use super::{Mark, Pace};
    use std::time::Duration;

    /// A hundred steps to the fractions `to`, which take 1 ms each but for ten of the last that take ten times as long.
    fn pace(to: impl Fn(u64) -> f64) -> Pace {
        let late = |step: u64| step.saturating_sub(80).min(10);
        let marks = (1..=100).map(|step| Mark {
            step,
            at: Duration::from_millis(step + 9 * late(step)),
            fraction: to(step),
        });
        Pace::of(&marks.collect::<Vec<_>>()).unwrap()
    }

    /// Catches a whole that is told by the mean of all steps where they grow, as if it went on so, and time that other programs took.
    #[test]
    fn the_pace_is_that_of_the_last_steps() {
        let even = pace(|step| 1e-4 * step as f64);
        assert!(
            !even.grows && (even.seconds / 10.0 - 1.0).abs() < 1e-9,
            "{even:?}"
        );
        // Each longer than the last by a quarter: the last ones alone are 1e-3 of the whole.
        let growing = pace(|step| 1e-3 * 1.25_f64.powi(step as i32 - 100));
        assert!(growing.grows && growing.seconds < 30.0, "{growing:?}");
    }
}
