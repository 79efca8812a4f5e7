//! Effect of the mass of light rods: changes at an equilibrium, and validity of a run without mass (theory 2.8, 2.9,
//! 3.9).

mod fold_at_rest;
mod folds;
mod plane;
mod space;
mod validity;

pub use fold_at_rest::{FoldAtRest, MassOrigin};
pub(in crate::study) use folds::{BranchEnd, PassedFold, passed};
pub use folds::{FoldPassed, FoldTreatment};
pub(in crate::study) use plane::{PlanarRodMass, viscosity};
pub(in crate::study) use space::{RodsAtRest, standing};
pub(in crate::study) use validity::BouncingRod;
pub use validity::{BouncePassed, Validity};

use crate::scene::Units;
use serde_json::{Value, json};

/// Relative changes of a frequency from this size on exceed the range of a first-order estimate.
const MEANT: f64 = 0.5;

/// Effect of the mass of light rods at an equilibrium, in the units of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct MassEffect {
    /// Relative change of the lowest frequency of small motions about the equilibrium under the loads at t = 0, to
    /// first order. `None` without a stable equilibrium, for a straight planar rod under an axial load, and if
    /// unknown.
    pub frequency_shift: Option<f64>,
    /// The rods of known mass.
    pub rods: Vec<RodMass>,
}

/// Mass and vibration of one rod at the equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub struct RodMass {
    /// Name of the rod in an assembly.
    pub rod: Option<String>,
    /// Mass of the rod over the mass of the (lighter) body; `None` without a body.
    pub eps: Option<f64>,
    /// Lowest angular frequency of the rod's vibrations with fixed ends; `None` if unstable with fixed ends.
    pub frequency: Option<f64>,
    /// Decay rate of this vibration, per time; 0 without friction.
    pub decay: Option<f64>,
    /// True if the mass is followed to first order.
    pub followed: bool,
}

impl RodMass {
    /// Sentence on the vibration with fixed ends; `called`: name of the rod.
    fn vibration(&self, called: &str, units: Units) -> Option<String> {
        let rate = match units.time() {
            "" => String::new(),
            time => format!(" rad/{time}"),
        };
        let ends = if self.rod.is_some() { "ends" } else { "end" };
        let omega = self.frequency?;
        let decay = match self.decay {
            Some(decay) if decay > 0.0 => format!(", which decays as exp(-{decay:.2e} t)"),
            _ => ", without friction".to_owned(),
        };
        Some(format!(
            "with its {ends} held {called} vibrates at omega {omega:.4e}{rate} and above{decay}"
        ))
    }

    fn json(&self) -> Value {
        json!({
            "rod": self.rod,
            "eps": self.eps,
            "rod_frequency": self.frequency,
            "rod_decay": self.decay,
        })
    }
}

impl MassEffect {
    /// Largest ratio of a rod's mass to the mass of a body.
    pub fn eps(&self) -> Option<f64> {
        let all = self.rods.iter().filter_map(|rod| rod.eps);
        all.max_by(f64::total_cmp)
    }

    /// The rod of a scene with a single, unnamed rod.
    fn single(&self) -> Option<&RodMass> {
        match self.rods.as_slice() {
            [rod] if rod.rod.is_none() => Some(rod),
            _ => None,
        }
    }

    /// One sentence.
    pub fn text(&self, units: Units) -> String {
        let shift = self
            .frequency_shift
            .map(|shift| format!("the lowest frequency by {}", to_first_order(shift)));
        if let Some(rod) = self.single() {
            let mut parts = Vec::new();
            parts.extend(rod.eps.map(|eps| {
                let lowers = shift.map(|shift| format!(", which lowers {shift}"));
                format!(
                    "the rod has {eps:.2e} of the body's mass{}",
                    lowers.unwrap_or_default()
                )
            }));
            let called = if rod.eps.is_some() { "it" } else { "the rod" };
            parts.extend(rod.vibration(called, units));
            return parts.join("; ");
        }
        let rods = self.rods.iter().map(|rod| {
            let name = rod.rod.as_deref().unwrap_or_default();
            let eps = rod
                .eps
                .map(|eps| format!(" has {eps:.2e} of the mass of the lighter body"));
            let vibration = rod.vibration("it", units).map(|words| format!(" {words}"));
            let parts: Vec<String> = [eps, vibration].into_iter().flatten().collect();
            format!("rod {name:?}{}", parts.join(";"))
        });
        let all = shift.map(|shift| format!("the mass of the rods lowers {shift}"));
        rods.chain(all).collect::<Vec<_>>().join("; ")
    }

    /// JSON form: one object for a single rod, otherwise with a list of the rods.
    pub fn json(&self) -> Value {
        match self.single() {
            Some(rod) => json!({
                "eps": rod.eps,
                "frequency_shift": self.frequency_shift,
                "rod_frequency": rod.frequency,
                "rod_decay": rod.decay,
            }),
            None => json!({
                "eps": self.eps(),
                "frequency_shift": self.frequency_shift,
                "rods": self.rods.iter().map(RodMass::json).collect::<Vec<_>>(),
            }),
        }
    }
}

/// Formats a relative change that is known to first order.
fn to_first_order(change: f64) -> String {
    if change.abs() < MEANT {
        percent(change)
    } else {
        "more than its first order can tell".to_owned()
    }
}

fn percent(x: f64) -> String {
    match 100.0 * x.abs() {
        x if x >= 10.0 => format!("{x:.0} %"),
        x if x >= 0.1 => format!("{x:.1} %"),
        x => format!("{x:.0e} %"),
    }
}
