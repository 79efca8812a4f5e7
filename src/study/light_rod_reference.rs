//! Light rods that accompany rods with friction or mass in a run.

use super::exact;
use super::run::RunHeader;
use crate::motion::{LightReference, LightSnap, Motion, State, UnknownInterval};
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

/// Sentence on times and reasons of missing folds.
pub(super) fn note(lost: &[&UnknownInterval], header: &RunHeader) -> Option<String> {
    let [first, more @ ..] = lost else {
        return None;
    };
    let unit = match header.units.time() {
        "" => String::new(),
        symbol => format!(" {symbol}"),
    };
    // Six digits suffice.
    let short = |t: f64| format!("{t:.5e}").parse().map_or_else(|_| exact(t), exact);
    let at = |t: f64| format!("t = {}{unit}", short(t));
    let rod = match header.rod_name(first.rod) {
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
pub(super) fn event(lost: &UnknownInterval, header: &RunHeader) -> Value {
    let mut event = json!({
        "kind": "light_rod_lost",
        "t": lost.from,
        "until": lost.until,
        "reason": lost.why.to_string(),
    });
    if let Some(name) = header.rod_name(lost.rod) {
        event["rod"] = name.into();
    }
    event
}
