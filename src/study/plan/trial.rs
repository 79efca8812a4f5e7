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
    /// Seconds that the whole duration takes at the pace of its steps but the first; None of fewer than two.
    pub pace: Option<f64>,
    /// Steps, and right-hand sides; None of a bar, whose steps follow from its cells.
    pub work: Option<[u64; 2]>,
    /// Why it ended before its time, if it did so by itself.
    pub reason: Option<String>,
    /// True if it branches at snaps, so that nothing is known of the whole.
    pub branches: bool,
}

impl Trial {
    /// Seconds that the whole run may take, figures and files aside, if it goes on as it began; None where nothing tells that.
    pub fn expected(&self) -> Option<f64> {
        let rest = 1.0 - self.fraction;
        match self.pace {
            _ if self.branches || self.reason.is_some() => None,
            _ if rest <= 0.0 => Some(self.seconds),
            pace => pace.map(|pace| self.seconds + pace * rest),
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
            "{:.3e} of {duration:e} {}",
            self.fraction * duration,
            units.time()
        );
        let came = format!("a trial of {spent} came to t = {}{work}", at.trim_end());
        match (&self.reason, self.branches, self.expected()) {
            (Some(reason), ..) => format!("{came}, where the run ends: {reason}"),
            (None, true, _) => format!(
                "{came} of one branch; at every snap the run branches, which multiplies its cost"
            ),
            (None, false, Some(all)) => format!(
                "{came}: about {} for the whole, figures and files aside, if it goes on as it began",
                long(all)
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
        s => format!("{:.3e} days", s / 86400.0),
    }
}

/// Ends a run when its time is up.
struct Clock {
    begun: Instant,
    given: Duration,
    /// When the first and the last step were taken, and to what fraction they came.
    steps: Option<[(Instant, f64); 2]>,
}

impl Hooks for Clock {
    fn interrupted(&mut self) -> bool {
        self.begun.elapsed() >= self.given
    }

    fn progress(&mut self, fraction: f64, _: f64) {
        let now = (Instant::now(), fraction);
        let first = self.steps.map_or(now, |[first, _]| first);
        self.steps = Some([first, now]);
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
        steps: None,
    };
    let found = any::motion(scene, Fields::None, &mut Nowhere, &mut clock)?;
    let spent = clock.begun.elapsed().as_secs_f64();
    let interrupted = found.summary["outcome"] == "interrupted";
    let reason = found.reason.filter(|_| !interrupted);
    let fraction = match clock.steps {
        _ if !interrupted && reason.is_none() => 1.0,
        Some([_, (_, last)]) => last,
        None => 0.0,
    };
    let pace = clock.steps.and_then(|[(begun, from), (ended, to)]| {
        (to > from).then(|| (ended - begun).as_secs_f64() / (to - from))
    });
    let count = |key: &str| found.summary["work"][key].as_u64();
    let run = scene.run.as_ref();
    Ok(Some(Trial {
        fraction,
        seconds: spent,
        pace,
        work: count("steps")
            .zip(count("evaluations"))
            .map(<[u64; 2]>::from),
        reason,
        branches: run.is_some_and(|run| run.landing == LandingRule::All),
    }))
}
