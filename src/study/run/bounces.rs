//! Bounces of taut rods in a run: storage and JSON.

use super::summary::object;
use crate::motion::Bounce;
use crate::scene::{Scales, Units};
use serde_json::{Map, Value, json};

/// Number of bounces stored individually.
const KEPT: usize = 1000;

/// Bounces of a branch, in the units of the rod (for a single rod: in the world frame).
#[derive(Debug, Clone, Default)]
pub struct Bounces {
    /// The first KEPT bounces.
    pub first: Vec<Bounce>,
    /// Number of bounces.
    pub count: usize,
    /// The bounce that friction would change most.
    pub hardest: Option<Bounce>,
}

impl Bounces {
    /// Adds a bounce.
    pub(in crate::study) fn add(&mut self, bounce: Bounce) {
        self.count += 1;
        let softer = |other: &Bounce| other.viscosity() <= bounce.viscosity();
        if !self.hardest.as_ref().is_some_and(softer) {
            self.hardest = Some(bounce.clone());
        }
        if self.first.len() < KEPT {
            self.first.push(bounce);
        }
    }

    /// Number of bounces in these branches, and the one most sensitive to friction.
    pub fn of<'a>(branches: impl Iterator<Item = &'a Self> + Clone) -> Option<(usize, &'a Bounce)> {
        let hardest = branches.clone().filter_map(|b| b.hardest.as_ref());
        let hardest = hardest.min_by(|a, b| a.viscosity().total_cmp(&b.viscosity()))?;
        Some((branches.map(|b| b.count).sum(), hardest))
    }

    /// Entry of summary.json for all branches; `one` formats a bounce. `None` without bounces.
    pub(in crate::study) fn json<'a>(
        branches: impl Iterator<Item = &'a Self> + Clone,
        one: impl Fn(&Bounce) -> Value,
    ) -> Option<Value> {
        let (count, hardest) = Self::of(branches.clone())?;
        let first: Vec<Value> = branches.flat_map(|b| &b.first).map(&one).collect();
        Some(json!({ "count": count, "hardest": one(hardest), "first": first }))
    }

    /// Remark on the effect of friction on the bounces: for a single planar rod in terms of the viscosity, otherwise
    /// of viscosity over stiffness.
    pub(in crate::study) fn text<'a>(
        branches: impl Iterator<Item = &'a Self> + Clone,
        (k, units): (&Scales, Units),
        planar: bool,
    ) -> Option<String> {
        let (count, hardest) = Self::of(branches)?;
        let unit = match (units, planar) {
            (Units::Dimensionless, _) => "",
            (Units::Si, true) => " N m^2 s",
            (Units::Si, false) => " s",
        };
        let (viscosity, scale) = if planar {
            ("viscosity", k.viscosity())
        } else {
            ("viscosity/stiffness", k.time)
        };
        Some(format!(
            "{count} {} at full reach (lambda up to {:.3e}). They are elastic only if the rod's {viscosity} << {:.1e}{unit}; \
             otherwise set the rod's `damping`",
            if count == 1 { "bounce" } else { "bounces" },
            hardest.lambda,
            hardest.viscosity() * scale,
        ))
    }
}

/// JSON entry of a bounce; `place` has position and velocity of the end.
pub(in crate::study) fn bounce_json(
    bounce: &Bounce,
    k: &Scales,
    place: Map<String, Value>,
) -> Map<String, Value> {
    let mut told = object(json!({ "kind": "bounce", "t": bounce.t * k.time }));
    told.extend(place);
    told.extend(object(json!({
        "tension": bounce.tension * k.force,
        "lam": bounce.lambda,
        "elastic": bounce.elastic * k.energy,
        "friction_time": bounce.viscosity() * k.time,
    })));
    told
}
