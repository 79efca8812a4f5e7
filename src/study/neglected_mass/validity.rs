//! Validity of neglecting the mass of the rods in a run.

use super::folds::{FoldPassed, FoldTreatment, LandingReliability};
use super::{MassEffect, percent, to_first_order};
use crate::motion::Bounce;
use serde_json::{Value, json};

/// Mass ratio eps above which a first-order treatment of the rod's mass is inaccurate.
const HEAVY: f64 = 0.1;
/// Bounce ratio (friction or rod inertia) above which the motion depends on the model of the bounce.
const HARD: f64 = 0.1;

/// Estimated effects of the mass of light rods in a run, in the units of the scene.
#[derive(Debug, Clone)]
pub struct Validity {
    /// Effects about the equilibrium under the loads at t = 0.
    pub rest: MassEffect,
    /// Folds passed in the run.
    pub folds: Vec<FoldPassed>,
    /// Recorded bounces of taut rods of known mass.
    pub bounces: Vec<BouncePassed>,
    /// True if a rod has friction.
    pub(in crate::study) damped: bool,
}

/// A bounce with the ratios that measure friction and rod inertia.
#[derive(Debug, Clone)]
pub struct BouncePassed {
    /// Name of the rod in an assembly.
    pub rod: Option<String>,
    /// Time of the bounce.
    pub t: f64,
    /// eta lam^2/(m v): friction takes a negligible part of the energy if small.
    pub number: f64,
    /// sqrt(eps) v/(4 sin^2(gam/4)), in space [`Bounce::inertia`]: the rod's mass has a negligible part if small.
    pub inertia: f64,
}

/// A bouncing rod, in library units.
pub(in crate::study) struct BouncingRod {
    /// Name of the rod in an assembly.
    pub name: Option<String>,
    /// Mass of the rod.
    pub mass: f64,
    /// Length of the rod.
    pub length: f64,
    /// Kelvin-Voigt time.
    pub eta: f64,
}

impl BouncePassed {
    /// `time`: library unit of time in the units of the scene.
    pub(in crate::study) fn new(bounce: &Bounce, rod: BouncingRod, time: f64) -> Self {
        Self {
            t: bounce.t * time,
            number: rod.eta * bounce.tension / (bounce.mass * bounce.speed()),
            inertia: bounce.inertia(rod.mass, rod.length),
            rod: rod.name,
        }
    }
}

impl Validity {
    /// One sentence each on the motion, the snaps and the bounces.
    pub fn verdict(&self) -> String {
        let mut parts = vec![self.of_motion()];
        if !self.folds.is_empty() {
            parts.push(self.of_snaps());
        }
        let most = |f: fn(&BouncePassed) -> f64| self.bounces.iter().map(f).fold(0.0, f64::max);
        let (number, inertia) = (most(|b| b.number), most(|b| b.inertia));
        if inertia > HARD || number > HARD {
            let friction = if self.damped {
                format!("friction number up to {number:.1e}, ")
            } else {
                String::new()
            };
            parts.push(format!(
                "bounces depend on the model: {friction}rod mass number up to {inertia:.1e} (elastic bounces need numbers below {HARD})"
            ));
        } else if !self.bounces.is_empty() && !self.damped {
            parts.push(
                "bounces are modelled as elastic: the friction of a real rod damps them".to_owned(),
            );
        }
        parts.join("; ")
    }

    fn of_motion(&self) -> String {
        let rods = &self.rest.rods;
        let several = rods.len() > 1;
        let eps = self.rest.eps().unwrap_or(0.0);
        let shift = self.rest.frequency_shift.map(f64::abs);
        let left = rods.iter().filter(|rod| !rod.followed);
        let left = left
            .filter_map(|rod| rod.eps)
            .fold(None, |most: Option<f64>, eps| {
                Some(most.map_or(eps, |most| most.max(eps)))
            });
        let size = percent(shift.unwrap_or(0.5 * eps));
        let mass = if several {
            "the mass of the rods"
        } else {
            "the rod's mass"
        };
        match left {
            None if eps > HEAVY => format!(
                "{mass} is followed to first order, which needs a rod of less than {HEAVY} of the body's mass: set inertia = \"full\" \
                 (the mass changes the lowest frequency by {})",
                to_first_order(shift.unwrap_or(0.5 * eps))
            ),
            None => format!(
                "{mass} is followed to first order, which changes the lowest frequency by {size} and leaves an error of about {}",
                percent(eps * eps)
            ),
            Some(left) if rods.iter().any(|rod| rod.followed) => format!(
                "the mass of some rods is followed to first order, that of the others ignored: smooth motion accurate to about {}",
                percent(0.5 * left)
            ),
            Some(_) if several => format!("massless rods: smooth motion accurate to about {size}"),
            Some(_) => format!("massless rod: smooth motion accurate to about {size}"),
        }
    }

    fn of_snaps(&self) -> String {
        let longest = self.folds.iter().map(FoldPassed::delay).fold(0.0, f64::max);
        let worst = self.folds.iter().map(FoldPassed::landing).min();
        let decays = self.rest.rods.iter().filter_map(|rod| rod.decay);
        let decay = decays.reduce(f64::min).unwrap_or(0.0);
        let followed = self
            .folds
            .iter()
            .all(|fold| fold.follows == FoldTreatment::Friction);
        match worst.unwrap_or(LandingReliability::Safe) {
            LandingReliability::Safe if longest == 0.0 => {
                "snaps are slowed by friction, not by mass".to_owned()
            }
            worst if followed => format!(
                "rod mass delays snaps by up to {longest:.1e} beyond the delay by friction{}",
                match worst {
                    LandingReliability::Safe => ", and the vibration decays before the next event",
                    _ =>
                        ", and the rod still vibrates at the next event: landings are not reliable",
                }
            ),
            LandingReliability::Late => format!(
                "rod mass delays snaps by up to {longest:.1e}, which is not short against the time to the next event: landings are not reliable"
            ),
            LandingReliability::Undamped => format!(
                "rod mass delays snaps by up to {longest:.1e}; without friction the rod keeps vibrating after a snap, so its landing follows a rule, not physics"
            ),
            LandingReliability::Ringing => format!(
                "rod mass delays snaps by up to {longest:.1e}; the rod still vibrates at the next event (decay as exp(-{decay:.1e} t)): landings are not reliable"
            ),
            LandingReliability::Safe => format!(
                "rod mass delays snaps by up to {longest:.1e}, and the vibration decays before the next event"
            ),
        }
    }

    /// JSON form.
    pub fn json(&self) -> Value {
        let folds = self.folds.iter().map(|fold| {
            let mut json = fold.form();
            json["t"] = fold.t.into();
            if let Some(rod) = &fold.rod {
                json["rod"] = rod.as_str().into();
            }
            json["viscous_delay"] = fold.viscous_delay.into();
            json["inertial_delay"] = fold.inertial_delay.into();
            json
        });
        let bounces = self.bounces.iter().map(|b| {
            let mut json = json!({ "t": b.t, "number": b.number, "inertia_number": b.inertia });
            if let Some(rod) = &b.rod {
                json["rod"] = rod.as_str().into();
            }
            json
        });
        let mut json = self.rest.json();
        json["verdict"] = self.verdict().into();
        json["folds"] = folds.collect();
        json["bounces"] = bounces.collect();
        json
    }
}
