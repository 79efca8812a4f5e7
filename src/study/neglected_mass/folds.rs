//! Folds that rods pass in a run, and what becomes of a snap there.

use super::SmallMass;
use crate::elastica::Passage;
use crate::elastica::first_order_mass::{INERTIAL_ESCAPE, VISCOUS_ESCAPE};
use crate::motion::{Ledger, Snap};
use crate::scene::Scales;
use crate::study::run::summary::object;
use serde_json::{Value, json};

/// Delays above this part of the time to the next event are not short.
const SHORT: f64 = 0.2;
/// Decays of the ringing after which a rod counts as at rest.
const QUIET: f64 = 5.0;
/// Friction rules at a fold where it is so many times the inertia.
const RULES: f64 = 10.0;

/// What a run follows at a fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// Nothing: the rod jumps.
    Jump,
    /// The friction of the rod.
    Friction,
    /// Mass and friction.
    Mass,
}

/// A fold, and by how much mass or friction delays the snap.
#[derive(Debug, Clone)]
pub struct FoldPassed {
    /// The branch of the run that passed it.
    pub branch: usize,
    /// The name of its rod in an assembly.
    pub rod: Option<String>,
    /// Its time.
    pub t: f64,
    /// What the run follows of it.
    pub follows: Follows,
    /// The numbers of its normal form, in units of the rod.
    pub form: Passage,
    /// Delay by the rod's mass alone.
    pub inertial_delay: f64,
    /// Delay by its friction alone; None without friction.
    pub viscous_delay: Option<f64>,
    /// eta D0 T_i/(eps M0): friction holds the rod back where it is large, mass where it is small (theory 2.8).
    pub ratio: f64,
    /// The energy that the light rod releases there.
    pub released: f64,
    /// The time until the next fold of the same branch, or its end.
    pub until_next: f64,
    /// How the energies change in that time, where the run follows the rod through the snap.
    pub changes: Option<Ledger>,
    /// How far the rod's slowest vibration has died down by then, as the x in exp(-x); None where its decay is not known.
    pub quiet: Option<f64>,
}

/// What becomes of a snap of a rod with mass, from the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Landing {
    /// It is late by a good part of the time to the next fold.
    Late,
    /// The rod rings for ever.
    Undamped,
    /// The rod still rings at the next event.
    Ringing,
    /// The rod is quiet before.
    Safe,
}

/// What is known of a fold at a moment of a run: the rod's name, its mass, the Kelvin-Voigt time of its friction, and the normal form, in units of
/// the rod.
pub(in crate::study) struct Followed {
    /// Its name in an assembly.
    pub rod: Option<String>,
    /// Normal form.
    pub form: Passage,
    /// Kelvin-Voigt time.
    pub eta: f64,
    /// Mass of the rod, the body's being 1.
    pub eps: f64,
}

/// The folds of one branch, in the order of their times, the energies of the run at each where it goes on through them; `last` is how it ended, and
/// `form` what is known of each.
pub(in crate::study) fn passed(
    (branch, follows): (usize, Follows),
    all: &[(&Snap, Option<Ledger>)],
    last: (f64, Ledger),
    (k, rest): (&Scales, &SmallMass),
    form: impl Fn(&Snap) -> Option<Followed>,
) -> Vec<FoldPassed> {
    let each = all.iter().enumerate();
    let each = each.filter_map(|(i, (snap, ledger))| {
        let next = all.get(i + 1);
        let until = next.map_or(last.0, |(next, _)| next.t * k.time);
        let then = next.map_or(Some(last.1), |(_, ledger)| *ledger);
        let Followed {
            rod,
            form,
            eta,
            eps,
        } = form(snap)?;
        let t = snap.t * k.time;
        let own = rest.rods.iter().find(|of| of.rod == rod);
        let viscous = || VISCOUS_ESCAPE * form.viscous(eta) * k.time;
        Some(FoldPassed {
            branch,
            t,
            follows,
            ratio: eta * form.friction * form.inertial(eps) / (eps * form.mass),
            released: snap.released * k.energy,
            changes: ledger.zip(then).map(|(here, then)| then.less(&here)),
            inertial_delay: INERTIAL_ESCAPE * form.inertial(eps) * k.time,
            viscous_delay: (eta > 0.0).then(viscous),
            until_next: until - t,
            quiet: own
                .and_then(|own| own.decay)
                .map(|decay| decay * (until - t)),
            rod,
            form,
        })
    });
    each.collect()
}

impl FoldPassed {
    /// The delay that the run leaves out.
    pub(super) fn delay(&self) -> f64 {
        match self.follows {
            Follows::Jump => self.inertial_delay.max(self.viscous_delay.unwrap_or(0.0)),
            Follows::Friction if self.ratio > RULES => 0.0,
            Follows::Friction => self.inertial_delay,
            Follows::Mass => 0.0,
        }
    }

    pub(super) fn landing(&self) -> Landing {
        if self.follows == Follows::Friction && self.ratio > RULES {
            return Landing::Safe;
        }
        if self.delay() > SHORT * self.until_next.max(0.0) {
            return Landing::Late;
        }
        match self.quiet {
            Some(quiet) if quiet >= QUIET => Landing::Safe,
            Some(quiet) if quiet > 0.0 => Landing::Ringing,
            Some(_) | None => Landing::Undamped,
        }
    }

    /// Its numbers as an event has them.
    pub(in crate::study) fn json(&self) -> Value {
        let verdict = match self.landing() {
            _ if self.follows == Follows::Mass => "followed with its mass",
            Landing::Safe if self.delay() == 0.0 => "friction holds it back, not its mass",
            Landing::Late => "late: the landing is not safe",
            Landing::Undamped => "rings on: where it lands is a rule, not physics",
            Landing::Ringing => "still rings at the next event: the landing is not safe",
            Landing::Safe => "quiet before the next event",
        };
        json!({
            "viscous_delay": self.viscous_delay,
            "inertial_delay": self.inertial_delay,
            "friction_over_inertia": self.ratio,
            "until_next": self.until_next,
            "ringing_decays": self.quiet,
            "verdict": verdict,
        })
    }

    /// The event of a fold that a rod passes without a jump, from that of the `snap` of the light rod beside it.
    pub(in crate::study) fn event(fold: Option<&Self>, snap: Value) -> Value {
        let mut event = object(snap);
        event.remove("time_error");
        event.insert("kind".to_owned(), json!("fold"));
        if let Some(fold) = fold {
            event.insert("mass".to_owned(), fold.json());
            event.insert("form".to_owned(), fold.form());
            event.insert("energy".to_owned(), json!(fold.energies()));
        }
        Value::Object(event)
    }

    /// How the energies change until the next fold, where the run follows the rod through the snap.
    fn energies(&self) -> Option<Value> {
        let ledger = self.changes?;
        Some(json!({
            "kinetic": ledger.kinetic,
            "rod_kinetic": ledger.rod_kinetic,
            "elastic": ledger.elastic,
            "potential": ledger.potential,
            "dissipated": ledger.dissipated,
            "work": ledger.work,
        }))
    }

    pub(in crate::study) fn form(&self) -> Value {
        json!({
            "A": self.form.drive, "B": self.form.bend, "M0": self.form.mass, "D0": self.form.friction,
        })
    }
}
