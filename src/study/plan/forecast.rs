//! Forecast of the cost of a whole run, from the first part of the run.

/// Ratio of the steps of two successive checkpoints.
const RATIO: f64 = 1.25;
/// Paces are measured from a half, and from an eighth, of the time reached by the trial.
const SINCE: [f64; 2] = [2.0, 8.0];
/// Forecasts are compared from the checkpoint on where a fourth of the seconds was spent, and an eighth of the time
/// reached. Earlier ones belong to the start of the run.
const COMPARED_SECONDS: f64 = 4.0;
const COMPARED_TIME: f64 = 8.0;
/// A forecast falls if it is below this fraction of the forecast two checkpoints before, as while steps grow.
const FALLEN: f64 = 0.7;
/// Smallest number of checkpoints for a pace.
const FEWEST: usize = 3;

/// A checkpoint of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Checkpoint {
    /// Steps so far.
    pub steps: u64,
    /// The fraction of the duration so far.
    pub fraction: f64,
    /// Seconds of processor time so far.
    pub seconds: f64,
}

/// Number of steps at the next checkpoint, the same in every trial, whatever the speed of the machine.
pub(super) fn next_checkpoint(steps: u64) -> u64 {
    (steps + 1).max((steps as f64 * RATIO) as u64)
}

/// Seconds of processor time for a whole run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Lower end of the range.
    pub least: f64,
    /// Cost if the run continues at its recent pace.
    pub likely: f64,
    /// Upper end of the range.
    pub most: f64,
}

impl Forecast {
    /// Forecast of a run that the trial completed in `seconds`.
    pub(super) fn known(seconds: f64) -> Self {
        Self {
            least: seconds,
            likely: seconds,
            most: seconds,
        }
    }

    /// Forecast from the checkpoints of a trial, the last of which is its end; `None` for too few.
    ///
    /// Each checkpoint yields a cost of the whole at two paces. `likely` is the geometric mean of the least and the
    /// last of these. The range is that of all of them, widened by the factor 1 + unseen share. A run that `loses`
    /// energy may come to rest: the lower end of its range is then the cost of the trial.
    pub(super) fn of(checkpoints: &[Checkpoint], loses: bool) -> Option<Self> {
        let last = checkpoints.last()?;
        let compared = |at: &Checkpoint| {
            at.seconds >= last.seconds / COMPARED_SECONDS
                && at.fraction >= last.fraction / COMPARED_TIME
        };
        let ends = (FEWEST..=checkpoints.len()).filter(|end| compared(&checkpoints[end - 1]));
        let told: Vec<[f64; 2]> = ends.filter_map(|end| whole(&checkpoints[..end])).collect();
        let middle = |[least, most]: &[f64; 2]| (least * most).sqrt();
        let likely = middle(told.last()?);
        let likely = (likely * told.iter().map(middle).fold(likely, f64::min)).sqrt();
        let unseen = 2.0 - last.fraction.min(1.0);
        let least = told.iter().fold(f64::INFINITY, |all, one| all.min(one[0]));
        let most = told.iter().fold(0.0, |all: f64, one| all.max(one[1]));
        let spent = last.seconds;
        Some(Self {
            least: if loses {
                spent
            } else {
                spent.max(least / unseen)
            },
            likely: likely.max(spent),
            most: most * unseen,
        })
    }
}

/// Least and greatest seconds of the whole, by the two paces at the last checkpoint; `None` for too few checkpoints.
pub(super) fn whole(checkpoints: &[Checkpoint]) -> Option<[f64; 2]> {
    let last = checkpoints.last().filter(|last| last.fraction > 0.0)?;
    if checkpoints.len() < FEWEST {
        return None;
    }
    let all = SINCE.map(|part| {
        let since = last.fraction / part;
        let pace = (last.seconds - spent(checkpoints, since)) / (last.fraction - since);
        last.seconds + (1.0 - last.fraction).max(0.0) * pace
    });
    Some([all[0].min(all[1]), all[0].max(all[1])])
}

/// True while forecasts fall from checkpoint to checkpoint, or are too few to compare.
pub(super) fn falls(checkpoints: &[Checkpoint]) -> bool {
    let before = checkpoints.len().saturating_sub(2);
    match (whole(&checkpoints[..before]), whole(checkpoints)) {
        (Some([_, before]), Some([_, now])) => now < FALLEN * before,
        _ => true,
    }
}

/// The seconds at which a `fraction` was reached, linear between checkpoints; before the first one, its own seconds.
fn spent(checkpoints: &[Checkpoint], fraction: f64) -> f64 {
    let next = checkpoints.partition_point(|at| at.fraction < fraction);
    let Some(before) = next.checked_sub(1) else {
        return checkpoints[0].seconds;
    };
    let (from, to) = (checkpoints[before], checkpoints[next]);
    let part = (fraction - from.fraction) / (to.fraction - from.fraction);
    from.seconds + part * (to.seconds - from.seconds)
}

#[cfg(test)]
mod tests {
    use super::{Checkpoint, Forecast, next_checkpoint};

    /// Forecast from the first `steps` of a run; `to` maps a step to (fraction, seconds).
    fn told(steps: u64, loses: bool, to: impl Fn(u64) -> (f64, f64)) -> Forecast {
        let points = std::iter::successors(Some(1), |k| Some(next_checkpoint(*k)));
        let mut points: Vec<u64> = points.take_while(|k| *k < steps).collect();
        points.push(steps);
        let points = points.into_iter().map(|steps| {
            let (fraction, seconds) = to(steps);
            Checkpoint {
                steps,
                fraction,
                seconds,
            }
        });
        Forecast::of(&points.collect::<Vec<_>>(), loses).expect("a forecast")
    }

    /// Runs whose total cost is known by a formula. Catches a stiff start that is extrapolated to the end, a range
    /// without the true cost, and a motion that comes to rest below its range.
    #[test]
    fn what_is_known_by_a_formula_is_foretold() {
        let log = |k: u64| 1e-6 * 1.3_f64.powi(k as i32);
        let cases: [(&str, u64, f64, &dyn Fn(u64) -> (f64, f64)); 4] = [
            // A start of 2 s, then even steps.
            ("even", 100, 12.0, &|k| {
                (1e-3 * k as f64, 2.0 + 0.01 * k as f64)
            }),
            // Steps that grow by a third up to a length of 1e-3, each of 0.01 s.
            ("stiff start", 60, 10.0 + 0.33, &|k| {
                let turn = 27; // Where log(k) is about 1e-3, and growth is over.
                match k <= turn {
                    true => (log(k), 0.01 * k as f64),
                    false => (log(turn) + 1e-3 * (k - turn) as f64, 0.01 * k as f64),
                }
            }),
            // An event of 1 s at every odd tenth of the time, 0.01 s for every other step.
            ("events", 40, 6.0, &|k| {
                let events = (k + 10) / 20;
                (0.01 * k as f64, events as f64 + 0.01 * k as f64)
            }),
            // Constant cost per step, and steps per time that grow: 10 s for a time t of t^2.
            ("ever slower", 250, 10.0, &|k| {
                ((k as f64 / 1000.0).sqrt(), 0.01 * k as f64)
            }),
        ];
        for (name, steps, takes, to) in cases {
            let found = told(steps, false, to);
            // A run that slows down ever more violates the assumption: only the size of its likely cost is checked.
            assert!(
                name == "ever slower" || found.least <= takes && takes <= found.most,
                "{name}: {takes} s, {found:?}"
            );
            let off = found.likely / takes;
            assert!(1.0 / 3.0 < off && off < 3.0, "{name}: {takes} s, {found:?}");
            let resting = told(steps, true, to);
            assert_eq!(resting.least, to(steps).1, "{name}");
            assert_eq!(
                (resting.likely, resting.most),
                (found.likely, found.most),
                "{name}"
            );
        }
        // One event of 1 s, after which the motion comes to rest and costs nothing.
        let resting = told(40, true, |k| {
            (0.01 * k as f64, f64::from(u8::from(k >= 20)))
        });
        assert!(
            resting.least <= 1.0 && 1.0 <= resting.most,
            "one event: {resting:?}"
        );
        let even = told(100, false, cases[0].3);
        assert!((even.likely / 12.0 - 1.0).abs() < 1e-9, "{even:?}");
    }
}
