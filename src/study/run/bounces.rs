//! The bounces of taut rods in a run, as it keeps and tells them.

use super::summary::object;
use crate::motion::Bounce;
use crate::scene::{Scales, Units};
use serde_json::{Map, Value, json};

/// Bounces that are kept one by one.
const KEPT: usize = 1000;

/// The bounces of a branch, in the units of the rod; in one of a single rod in the world frame.
#[derive(Debug, Clone, Default)]
pub struct Bounces {
    /// The first of them.
    pub first: Vec<Bounce>,
    /// How many there were.
    pub count: usize,
    /// The one that friction would change most.
    pub hardest: Option<Bounce>,
}

impl Bounces {
    /// Takes one.
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

    /// How many there were in these branches, and the one that friction would change most.
    pub fn of<'a>(branches: impl Iterator<Item = &'a Self> + Clone) -> Option<(usize, &'a Bounce)> {
        let hardest = branches.clone().filter_map(|b| b.hardest.as_ref());
        let hardest = hardest.min_by(|a, b| a.viscosity().total_cmp(&b.viscosity()))?;
        Some((branches.map(|b| b.count).sum(), hardest))
    }

    /// As summary.json has those of all branches, each as `one` tells it; None where there was none.
    pub(in crate::study) fn json<'a>(
        branches: impl Iterator<Item = &'a Self> + Clone,
        one: impl Fn(&Bounce) -> Value,
    ) -> Option<Value> {
        let (count, hardest) = Self::of(branches.clone())?;
        let first: Vec<Value> = branches.flat_map(|b| &b.first).map(&one).collect();
        Some(json!({ "count": count, "hardest": one(hardest), "first": first }))
    }

    /// What friction would do to them, in words; of the one rod in a plane the viscosity is told, elsewhere that over the stiffness.
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
        let (viscosity, scale) = match planar {
            true => ("viscosity", k.viscosity()),
            false => ("viscosity over its stiffness", k.time),
        };
        Some(format!(
            "{count} {} of the taut rod, lambda up to {:.3e}: friction changes them unless the rod's {viscosity} is far below {:.1e}{unit}, at which \
             the hardest one would lose its energy",
            if count == 1 { "bounce" } else { "bounces" },
            hardest.lambda,
            hardest.viscosity() * scale,
        ))
    }
}

/// What is told of any bounce; `place` names where the end was and how it moved.
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
