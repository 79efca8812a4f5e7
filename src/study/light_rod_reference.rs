//! Light rods that accompany rods with friction or mass in a run.

use super::exact;
use crate::motion::{LightReference, LightSnap, Motion, State, UnknownInterval};
use crate::scene::{Scales, Units};
use serde_json::{Value, json};

/// Light rods of a run, with the folds they have passed.
pub(super) struct LightRods {
    rods: Vec<LightReference>,
    crossed: Vec<LightSnap>,
}

impl LightRods {
    pub fn new(rods: Vec<LightReference>) -> Self {
        Self {
            rods,
            crossed: Vec::new(),
        }
    }

    /// Advances the light rods through the last step of `motion`.
    pub fn step(&mut self, motion: &mut dyn Motion<'_>) {
        for rod in &mut self.rods {
            let passed = rod.step(&*motion.now());
            for mut crossed in passed {
                if let Some(state) = motion.sample(crossed.snap.t) {
                    crossed.ledger = state.ledger();
                }
                self.crossed.push(crossed);
            }
        }
    }

    /// Puts the light rods into the shapes of a state near equilibrium.
    pub fn land(&mut self, state: &dyn State) {
        for rod in &mut self.rods {
            rod.land(state);
        }
    }

    /// Passed folds, and intervals without a light rod, in the order of time.
    pub fn told(mut self) -> (Vec<LightSnap>, Vec<UnknownInterval>) {
        self.crossed.sort_by(|a, b| a.snap.t.total_cmp(&b.snap.t));
        let lost = self.rods.iter().flat_map(LightReference::lost).copied();
        let mut lost: Vec<UnknownInterval> = lost.collect();
        lost.sort_by(|a, b| a.from.total_cmp(&b.from));
        (self.crossed, lost)
    }
}

/// Sentence on times and reasons of missing folds; `names` of the rods of an assembly.
pub(super) fn note(
    lost: &[&UnknownInterval],
    names: &[String],
    (scales, units): (&Scales, Units),
) -> Option<String> {
    let [first, more @ ..] = lost else {
        return None;
    };
    let unit = match units.time() {
        "" => String::new(),
        symbol => format!(" {symbol}"),
    };
    // Six digits suffice.
    let short = |t: f64| format!("{t:.5e}").parse().map_or_else(|_| exact(t), exact);
    let at = |t: f64| format!("t = {}{unit}", short(t * scales.time));
    let rod = match names.get(first.rod) {
        Some(name) => format!("rod {name:?}"),
        None => "the rod".to_owned(),
    };
    let until = match first.until {
        Some(t) => format!("until {}", at(t)),
        None => "from then on".to_owned(),
    };
    let again = match more.len() {
        0 => String::new(),
        1 => "; 1 more such interval is in events.json".to_owned(),
        n => format!("; {n} more such intervals are in events.json"),
    };
    Some(format!(
        "at {} the light rod that accompanies {rod} is lost: {}; folds {until} are not recorded{again}",
        at(first.from),
        first.why
    ))
}

/// Event of a lost light rod.
pub(super) fn event(lost: &UnknownInterval, names: &[String], scales: &Scales) -> Value {
    let mut event = json!({
        "kind": "light_rod_lost",
        "t": lost.from * scales.time,
        "until": lost.until.map(|t| t * scales.time),
        "reason": lost.why.to_string(),
    });
    if let Some(name) = names.get(lost.rod) {
        event["rod"] = name.as_str().into();
    }
    event
}
