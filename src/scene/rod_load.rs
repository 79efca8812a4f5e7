//! Loads of `[[load]]` on rods: at ends, at stations, along parts.

use super::{LoadAlong, Parameter, Rod, Scene};
use crate::error::{Error, Result};
use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use nalgebra::Vector3;
use serde::Serialize;

/// Place of a load on a rod.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LoadPlace {
    /// The end, s = length, in statics of one rod.
    End {
        /// `"end"`.
        on: EndWord,
    },
    /// One place inside the rod; in a motion also the end, for a load that turns with the rod's own end.
    Station {
        /// Arclength of the unloaded rod.
        s: f64,
    },
    /// Part of the rod; the load is per length of the unloaded rod.
    Along {
        /// Arclength of its beginning.
        from: f64,
        /// Arclength of its end.
        to: f64,
    },
}

/// The word for the end of a rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EndWord {
    /// s = length.
    End,
}

/// A constant load on a rod: a force and a couple.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RodLoad {
    /// Number in the list `[[load]]` of the scene.
    #[serde(skip)]
    pub number: usize,
    /// Place of the load.
    #[serde(flatten)]
    pub place: LoadPlace,
    /// Force; along a part of the rod per length.
    pub force: [f64; 3],
    /// Couple; along a part of the rod per length.
    pub couple: [f64; 3],
    /// Frame of force and couple. False: the world. True: the directors of the section.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub follows: bool,
    /// Common factor of force and couple; default 1.
    pub factor: f64,
}

impl RodLoad {
    /// True for a dead force inside the rod.
    pub(super) fn is_dead_force(&self) -> bool {
        !(self.follows || self.is_on_end()) && self.force != [0.0; 3]
    }

    /// True for a load on the end.
    pub(super) fn is_on_end(&self) -> bool {
        matches!(self.place, LoadPlace::End { .. })
    }

    /// True for a load on one place inside the rod.
    pub(super) fn is_at_station(&self) -> bool {
        matches!(self.place, LoadPlace::Station { .. })
    }

    /// True for a load at the end of a rod of the length `length`, which turns with the end in a motion.
    pub(super) fn turns_with_end(&self, length: f64) -> bool {
        matches!(self.place, LoadPlace::Station { s } if s >= length)
    }

    /// Force and couple times the factor.
    pub(super) fn applied(&self) -> [Vector3<f64>; 2] {
        [self.force, self.couple].map(|vector| Vector3::from(vector) * self.factor)
    }

    /// Vector `x`, a force or a couple, where this load acts inside a rod of this length; zero on the end.
    fn spread(&self, x: Vector3<f64>, length: f64) -> Result<DistributedLoad> {
        match self.place {
            LoadPlace::End { .. } => DistributedLoad::constant(Vector3::zeros()),
            LoadPlace::Station { .. } if self.turns_with_end(length) => {
                DistributedLoad::at_end(x / length)
            }
            LoadPlace::Station { s } => DistributedLoad::at_place(s / length, x / length),
            LoadPlace::Along { from, to } => {
                let to = (to / length).min(1.0);
                DistributedLoad::between(from / length, to, vec![x])
            }
        }
        .map_err(|why: Error| why.context(format!("load[{}]", self.number)))
    }
}

/// Sum of loads; zero without loads.
fn sum(loads: impl Iterator<Item = Result<DistributedLoad>>) -> Result<DistributedLoad> {
    let mut whole = DistributedLoad::constant(Vector3::zeros())?;
    for load in loads {
        whole = whole.plus(&load?)?;
    }
    Ok(whole)
}

impl Rod {
    /// Dead forces of the list on the rod, its end left out; zero without such forces.
    ///
    /// # Errors
    /// A place outside of the rod.
    pub fn dead_forces(&self) -> Result<DistributedLoad> {
        let dead = self.loads.iter().filter(|load| load.is_dead_force());
        sum(dead.map(|load| load.spread(load.applied()[0], self.length)))
    }

    /// True if the list has a load inside the rod without a potential: a couple, or a load that turns with the rod.
    pub(crate) fn has_turning_loads(&self) -> bool {
        let mut inside = self.loads.iter().filter(|load| !load.is_on_end());
        inside.any(|load| load.follows || load.couple != [0.0; 3])
    }

    /// Loads of the list inside the rod that have no potential.
    ///
    /// # Errors
    /// A place outside of the rod.
    pub(super) fn turning_loads(&self) -> Result<LoadsWithoutPotential> {
        let listed = |follows: bool, part: usize| {
            let those = self
                .loads
                .iter()
                .filter(move |load| load.follows == follows);
            sum(those.map(|load| load.spread(load.applied()[part], self.length)))
        };
        Ok(LoadsWithoutPotential {
            follower_force: listed(true, 0)?,
            couple: listed(false, 1)?,
            follower_couple: listed(true, 1)?,
        })
    }
}

impl Scene {
    /// Loads of a rod in statics that have no potential; `None` without such loads. A load counts that a branch may
    /// vary from 0.
    ///
    /// # Errors
    /// As [`LoadAlong::on`]; a place outside of the rod.
    pub fn followers(&self) -> Result<Option<LoadsWithoutPotential>> {
        let any = self.rod.has_turning_loads() || self.varies(Parameter::is_listed_couple);
        if !(any || self.is_followed_along()) {
            return Ok(None);
        }
        let along = LoadAlong::on(&self.loads.follower, self.rod.length)?;
        let along = along.mapped(|f| f * self.loads.load);
        let listed = self.rod.turning_loads()?;
        Ok(Some(LoadsWithoutPotential {
            follower_force: along.plus(&listed.follower_force)?,
            ..listed
        }))
    }
}
