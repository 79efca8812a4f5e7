//! Folds passed by rods in a run, and the reliability of the landing after a snap.

use super::MassEffect;
use crate::elastica::FoldNormalForm;
use crate::elastica::first_order_mass::{INERTIAL_ESCAPE, VISCOUS_ESCAPE};
use crate::error::Quantity;
use crate::motion::{Ledger, Snap};
use crate::scene::Scales;
use crate::study::run::summary::object;
use serde_json::{Value, json};

/// Delay, as a fraction of the time to the next event, above which the snap is late.
const SHORT: f64 = 0.2;
/// Number of decay times after which a ringing rod counts as at rest.
const QUIET: f64 = 5.0;
/// Ratio of friction to inertia at a fold above which friction dominates.
const RULES: f64 = 10.0;

/// Treatment of a fold by the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoldTreatment {
    /// Instantaneous jump of the rod.
    Jump,
    /// Friction of the rod is integrated.
    Friction,
    /// Mass and friction are integrated.
    Mass,
}

/// A fold, and the delay of the snap by mass or friction.
#[derive(Debug, Clone)]
pub struct FoldPassed {
    /// Branch of the run on which the fold was passed.
    pub branch: usize,
    /// Name of the rod in an assembly.
    pub rod: Option<String>,
    /// Time of the fold.
    pub t: f64,
    /// Treatment of the fold by the run.
    pub follows: FoldTreatment,
    /// Coefficients of the normal form, in units of the rod.
    pub form: FoldNormalForm,
    /// Delay by the rod's mass alone.
    pub inertial_delay: f64,
    /// Delay by the rod's friction alone; `None` without friction.
    pub viscous_delay: Option<f64>,
    /// eta D0 T_i/(eps M0): friction holds the rod back where it is large, mass where it is small (theory 2.8).
    pub ratio: f64,
    /// Energy released by the light rod at the fold.
    pub released: f64,
    /// Time until the next fold of the same branch, or its end.
    pub until_next: f64,
    /// Change of the energies until then, if the run integrates the rod through the snap.
    pub changes: Option<Ledger>,
    /// Decay x of the rod's slowest vibration until then, as exp(-x); `None` if its decay rate is unknown.
    pub quiet: Option<f64>,
}

/// Reliability of the landing after a snap of a rod with mass, from the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LandingReliability {
    /// The delay is a good part of the time to the next fold.
    Late,
    /// The rod rings without decay.
    Undamped,
    /// The rod still rings at the next event.
    Ringing,
    /// The rod is quiet before the next event.
    Safe,
}

/// Normal form of a fold at a moment of a run in units of the rod, with mass and Kelvin-Voigt time of the rod.
pub(in crate::study) struct PassedFold {
    /// Name of the rod in an assembly.
    pub rod: Option<String>,
    /// Normal form.
    pub form: FoldNormalForm,
    /// Kelvin-Voigt time.
    pub eta: f64,
    /// Mass of the rod relative to the body's.
    pub eps: f64,
}

/// Time and energies at the end of a branch of a run.
pub(in crate::study) struct BranchEnd {
    pub t: f64,
    pub ledger: Ledger,
}

/// Folds of one branch in the order of time, with the energies of a run that continues through them. `last`: the end;
/// `form`: normal form of a fold.
pub(in crate::study) fn passed(
    branch: usize,
    follows: FoldTreatment,
    all: &[(&Snap, Option<Ledger>)],
    last: &BranchEnd,
    k: &Scales,
    rest: &MassEffect,
    form: impl Fn(&Snap) -> Option<PassedFold>,
) -> Vec<FoldPassed> {
    let time = |t: f64| k.outward(Quantity::Time, t);
    let each = all.iter().enumerate();
    let each = each.filter_map(|(i, (snap, ledger))| {
        let next = all.get(i + 1);
        let until = next.map_or(last.t, |(next, _)| time(next.t));
        let then = next.map_or(Some(last.ledger), |(_, ledger)| *ledger);
        let PassedFold {
            rod,
            form,
            eta,
            eps,
        } = form(snap)?;
        let t = time(snap.t);
        let own = rest.rods.iter().find(|of| of.rod == rod);
        let viscous = || time(VISCOUS_ESCAPE * form.viscous(eta));
        Some(FoldPassed {
            branch,
            t,
            follows,
            ratio: eta * form.friction * form.inertial(eps) / (eps * form.mass),
            released: k.outward(Quantity::Couple, snap.released),
            changes: ledger.zip(then).map(|(here, then)| then.less(&here)),
            inertial_delay: time(INERTIAL_ESCAPE * form.inertial(eps)),
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
    /// Delay that the run neglects.
    pub(super) fn delay(&self) -> f64 {
        match self.follows {
            FoldTreatment::Jump => self.inertial_delay.max(self.viscous_delay.unwrap_or(0.0)),
            FoldTreatment::Friction if self.ratio > RULES => 0.0,
            FoldTreatment::Friction => self.inertial_delay,
            FoldTreatment::Mass => 0.0,
        }
    }

    pub(super) fn landing(&self) -> LandingReliability {
        if self.follows == FoldTreatment::Friction && self.ratio > RULES {
            return LandingReliability::Safe;
        }
        if self.delay() > SHORT * self.until_next.max(0.0) {
            return LandingReliability::Late;
        }
        match self.quiet {
            Some(quiet) if quiet >= QUIET => LandingReliability::Safe,
            Some(quiet) if quiet > 0.0 => LandingReliability::Ringing,
            Some(_) | None => LandingReliability::Undamped,
        }
    }

    /// Entries of the event in events.json.
    pub(in crate::study) fn json(&self) -> Value {
        let verdict = match self.landing() {
            _ if self.follows == FoldTreatment::Mass => "followed with its mass",
            LandingReliability::Safe if self.delay() == 0.0 => "slowed by friction, not by mass",
            LandingReliability::Late => "late: the landing is not reliable",
            LandingReliability::Undamped => "undamped: the landing follows a rule, not physics",
            LandingReliability::Ringing => {
                "still vibrates at the next event: the landing is not reliable"
            }
            LandingReliability::Safe => "vibration decays before the next event",
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

    /// Event of a fold passed without a jump, from the event of the light rod's `snap`.
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

    /// Change of the energies until the next fold, if the run integrates the rod through the snap.
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
