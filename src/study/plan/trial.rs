//! Trial of the first part of a run, from which the cost of the whole is forecast.

use super::forecast::{Checkpoint, Forecast, falls, next_checkpoint, whole};
use crate::error::Result;
use crate::motion::LandingRule;
use crate::scene::{Scene, Units};
use crate::study::record::DiscardRows;
use crate::study::run::Fields;
use crate::study::{Hooks, dispatch};
use serde_json::{Value, json};
use std::time::Duration;

/// Trial of a run: the first part, or all.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Fraction of the duration reached.
    pub fraction: f64,
    /// Processor time of the trial in seconds, including the search for the start (elapsed time on systems without
    /// such a clock).
    pub seconds: f64,
    /// Forecast for the whole run, without figures and files. `None` after too few steps, and for a run that ends by
    /// itself or branches.
    pub forecast: Option<Forecast>,
    /// True if the motion loses energy and may come to rest.
    pub loses: bool,
    /// Steps and right-hand sides; `None` for a bar, where steps follow from the cells.
    pub work: Option<[u64; 2]>,
    /// Reason for an early end of the run, if any.
    pub reason: Option<String>,
    /// True if the run branches at snaps: no forecast of the whole is possible.
    pub branches: bool,
}

/// A trial exceeds its time while the fraction reached is below this bound, or while its forecasts fall: a stiff
/// start is unlike the rest.
const SEEN: f64 = 0.01;
/// A trial runs to the end of the run if the upper end of the forecast is at most this multiple of the trial time.
const WHOLE: f64 = 3.0;
/// Longest trial, as a multiple of the trial time.
const LONGEST: f64 = 4.0;
/// A motion may come to rest if its losses, extrapolated to the end, reach this fraction of its kinetic and elastic
/// energy.
const LOSS: f64 = 0.01;
/// Longer forecasts, in seconds, are not shown if less than [`SEEN`] was reached.
const FAR: f64 = 86400.0;

impl Trial {
    /// Expected processor time in seconds of the whole run, without figures and files; `None` if unknown.
    pub fn expected(&self) -> Option<f64> {
        self.forecast.map(|forecast| forecast.likely)
    }

    /// Least and greatest processor time in seconds for the whole run; `None` if unknown.
    pub fn range(&self) -> Option<[f64; 2]> {
        self.forecast
            .map(|forecast| [forecast.least, forecast.most])
    }

    fn is_whole(&self) -> bool {
        self.fraction >= 1.0 && self.reason.is_none() && !self.branches
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "fraction": self.fraction,
            "seconds": self.seconds,
            "steps": self.work.map(|work| work[0]),
            "evaluations": self.work.map(|work| work[1]),
            "reason": self.reason,
            "expected_seconds": self.expected(),
            "at_least_seconds": self.range().map(|range| range[0]),
            "at_most_seconds": self.range().map(|range| range[1]),
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
        if self.is_whole() {
            return format!(
                "the trial completed the whole run in {spent}{work}\n          {MEASURED}"
            );
        }
        let at = format!(
            "{} of {} {}",
            plain(self.fraction * duration),
            plain(duration),
            units.time()
        );
        let came = format!("a trial of {spent} reached t = {}{work}", at.trim_end());
        let little = "too short to forecast the whole run; raise --seconds";
        match (&self.reason, self.branches, &self.forecast) {
            (Some(reason), ..) => format!("{came}, where the run ends: {reason}"),
            (None, true, _) => format!(
                "{came} of one branch; at every snap the run branches, which multiplies its cost"
            ),
            (None, false, Some(told)) if self.fraction >= SEEN || told.likely < FAR => format!(
                "{came}\n          about {} for the whole, from {} to {}: {}\n          {MEASURED}",
                long(told.likely),
                long(told.least),
                long(told.most),
                self.assumption(),
            ),
            (None, false, _) => format!("{came}, {little}"),
        }
    }

    /// The assumption of the forecast in words.
    fn assumption(&self) -> &'static str {
        if self.loses {
            "if snaps and impacts stay as frequent as so far; the motion loses energy, and costs little once at rest"
        } else {
            "if snaps and impacts stay as frequent as so far, and the motion becomes no stiffer"
        }
    }
}

/// The unit of the cost in words.
const MEASURED: &str = "seconds of processor time, without figures and files";

/// Seconds in two digits, or in a larger unit.
fn long(seconds: f64) -> String {
    match seconds {
        s if s < 0.01 => "less than 0.01 s".to_owned(),
        s if s < 100.0 => format!("{} s", digits(s, 2)),
        s if s < 6000.0 => format!("{} min", digits(s / 60.0, 2)),
        s if s < 360_000.0 => format!("{} h", digits(s / 3600.0, 2)),
        s => format!("{} days", plain(digits(s / 86400.0, 2))),
    }
}

/// A number rounded to `count` digits.
fn digits(x: f64, count: usize) -> f64 {
    format!("{x:.*e}", count - 1).parse().unwrap_or(x)
}

/// A number with four digits, with an exponent only where it is very large or small.
fn plain(x: f64) -> String {
    let rounded = digits(x, 4);
    if x == 0.0 || (1e-6..1e7).contains(&x) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Processor time of this thread, independent of other programs.
#[cfg(any(
    target_os = "linux",
    target_os = "android",
    target_os = "freebsd",
    target_vendor = "apple"
))]
fn processor_time() -> Duration {
    use nix::time::{ClockId, clock_gettime};
    let now = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID);
    now.map_or(Duration::ZERO, Duration::from)
}

/// Elapsed time since the first call, on systems without a clock of the processor time.
#[cfg(not(any(
    target_os = "linux",
    target_os = "android",
    target_os = "freebsd",
    target_vendor = "apple"
)))]
fn processor_time() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static FIRST: OnceLock<Instant> = OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed()
}

/// Ends a trial at one of the checkpoints, so that its length depends little on the speed of the machine.
struct Clock {
    begun: Duration,
    given: f64,
    now: Checkpoint,
    checkpoints: Vec<Checkpoint>,
}

impl Clock {
    /// A clock of a trial of about `given` seconds that begins now.
    fn new(given: f64) -> Self {
        Self {
            begun: processor_time(),
            given,
            now: Checkpoint {
                steps: 0,
                fraction: 0.0,
                seconds: 0.0,
            },
            checkpoints: Vec::new(),
        }
    }

    fn spent(&self) -> f64 {
        processor_time().saturating_sub(self.begun).as_secs_f64()
    }

    /// All checkpoints, and one at the current state of the run.
    fn all(mut self) -> Vec<Checkpoint> {
        if self.now.steps > self.checkpoints.last().map_or(0, |last| last.steps) {
            self.checkpoints.push(self.now);
        }
        self.checkpoints
    }
}

impl Hooks for Clock {
    fn interrupted(&mut self) -> bool {
        let spent = self.spent();
        if spent < self.given {
            return false;
        }
        let at_checkpoint = self.checkpoints.last() == Some(&self.now);
        let is_short = || {
            let told = whole(&self.checkpoints);
            told.is_some_and(|[_, most]| most <= WHOLE * self.given)
        };
        spent >= LONGEST * self.given
            || at_checkpoint
                && self.now.fraction >= SEEN
                && !falls(&self.checkpoints)
                && !is_short()
    }

    fn progress(&mut self, fraction: f64, _: f64) {
        self.now = Checkpoint {
            steps: self.now.steps + 1,
            fraction,
            seconds: self.spent(),
        };
        if self.now.steps
            >= self
                .checkpoints
                .last()
                .map_or(1, |last| next_checkpoint(last.steps))
        {
            self.checkpoints.push(self.now);
        }
    }
}

/// Runs the scene for about `seconds` of processor time.
pub(super) fn trial(scene: &Scene, seconds: f64) -> Result<Option<Trial>> {
    if !(seconds > 0.0) {
        return Ok(None);
    }
    let mut clock = Clock::new(seconds);
    let found = dispatch::motion(scene, Fields::None, &mut DiscardRows, &mut clock)?;
    let spent = clock.spent();
    let interrupted = found.summary["outcome"] == "interrupted";
    let reason = found.reason.filter(|_| !interrupted);
    let fraction = if interrupted || reason.is_some() {
        clock.now.fraction
    } else {
        1.0
    };
    let energy = |key: &str| found.summary["end"][key].as_f64().unwrap_or(0.0);
    let loses =
        energy("dissipated") > LOSS * fraction * (energy("kinetic") + energy("elastic")).abs();
    let branches = scene
        .run
        .as_ref()
        .is_some_and(|run| run.landing == LandingRule::All);
    let forecast = match (&reason, branches, interrupted) {
        (Some(_), ..) | (_, true, _) => None,
        (None, false, false) => Some(Forecast::known(spent)),
        (None, false, true) => Forecast::of(&clock.all(), loses),
    };
    let count = |key: &str| found.summary["work"][key].as_u64();
    Ok(Some(Trial {
        fraction,
        seconds: spent,
        forecast,
        loses,
        work: count("steps")
            .zip(count("evaluations"))
            .map(<[u64; 2]>::from),
        reason,
        branches,
    }))
}
