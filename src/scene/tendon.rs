//! Tendons of a rod: the route through the sections, and the tension or the length.

use super::Rod;
use crate::Result;
use crate::section::{self, Route, SectionLaw, Tendons};
use serde::Serialize;
use std::sync::Arc;

/// A frictionless tendon through the sections of a rod. The ground, or what holds the rod's base, holds the tendon at
/// s = 0; its anchor is fixed to the rod.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tendon {
    /// Offsets from the centreline along d1 and d2.
    #[serde(rename = "offset", serialize_with = "offset")]
    pub route: Route,
    /// Arclength of its anchor; `None`: the end of the rod.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Given tension or given length.
    #[serde(flatten)]
    pub pull: Pull,
}

/// Tension or length of a tendon, whichever the scene gives.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pull {
    /// Tension >= 0.
    Tension(f64),
    /// Length between base and anchor, > 0; the tendon is slack where its path is shorter. In statics.
    Length(f64),
}

/// Writes a route; a tendon parallel to the centreline by its offset alone.
fn offset<S: serde::Serializer>(route: &Route, serializer: S) -> Result<S::Ok, S::Error> {
    match route {
        Route::Linear([from, to]) if from == to => from.serialize(serializer),
        route => route.serialize(serializer),
    }
}

impl Tendon {
    /// True if arclengths of the rod say where the tendon runs.
    pub(super) fn has_places(&self) -> bool {
        self.to.is_some() || matches!(self.route, Route::Table(_))
    }
}

impl Rod {
    /// The law with the rod's tendons, those of given length slack.
    ///
    /// # Errors
    /// As [`Tendons::new`].
    pub(in crate::scene) fn with_tendons(&self, law: Arc<dyn SectionLaw>) -> Result<Tendons> {
        let tendons = self.tendons.iter().map(|tendon| section::Tendon {
            route: tendon.route.clone(),
            to: tendon.to.unwrap_or(self.length),
            tension: match tendon.pull {
                Pull::Tension(tension) => tension,
                Pull::Length(_) => 0.0,
            },
        });
        Tendons::new(law, tendons.collect(), self.length).map_err(|e| e.context("rod.tendon"))
    }

    /// The section law with the tendons; `None` without tendons.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`](super::Scene::cosserat_rod).
    pub fn tendon_law(&self) -> Result<Option<Tendons>> {
        if self.tendons.is_empty() {
            return Ok(None);
        }
        let law = self.backbone()?.law().clone();
        self.with_tendons(law).map(Some)
    }
}
