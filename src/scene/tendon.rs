//! Tendons of a rod: the route through the sections, and the tension or the length.

use super::Rod;
use crate::Result;
use crate::body::History;
use crate::section::{self, LawInTime, Measures, Route, SectionLaw, Tendons};
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
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pull {
    /// Tension >= 0, constant or, in a motion, in time.
    #[serde(serialize_with = "number_or_table")]
    Tension(History),
    /// Length between base and anchor, > 0; the tendon is slack where its path is shorter. In statics.
    Length(f64),
}

/// Writes a constant history as a number.
pub(super) fn number_or_table<S: serde::Serializer>(
    history: &History,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    match history {
        History::Constant(x) => x.serialize(serializer),
        history => history.serialize(serializer),
    }
}

/// Writes a route; a tendon parallel to the centreline by its offset alone.
fn offset<S: serde::Serializer>(route: &Route, serializer: S) -> Result<S::Ok, S::Error> {
    match route {
        Route::Linear([from, to]) if from == to => from.serialize(serializer),
        route => route.serialize(serializer),
    }
}

impl Tendon {
    /// The given tension; `None` of a tendon of given length.
    fn tension(&self) -> Option<&History> {
        match &self.pull {
            Pull::Tension(tension) => Some(tension),
            Pull::Length(_) => None,
        }
    }

    /// True if arclengths of the rod say where the tendon runs.
    pub(super) fn has_places(&self) -> bool {
        self.to.is_some() || matches!(self.route, Route::Table(_))
    }
}

impl Rod {
    /// Amplitude of the drive, and tensions.
    fn histories(&self) -> impl Iterator<Item = &History> {
        let drive = self.drive.iter().map(|drive| &drive.amplitude);
        drive.chain(self.tendons.iter().filter_map(Tendon::tension))
    }

    /// Name of a field of the rod by which its section law varies in time; `None` for a law that does not.
    pub fn field_in_time(&self) -> Option<&'static str> {
        let varies = |history: &History| !matches!(history, History::Constant(_));
        let drive = self.drive.as_ref().map(|drive| &drive.amplitude);
        if drive.is_some_and(varies) {
            return Some("drive");
        }
        self.histories().any(varies).then_some("tendon")
    }

    /// Section law in time, in `units`; `None` if tensions and drive are constant.
    ///
    /// # Errors
    /// As [`Scene::cosserat_rod`](super::Scene::cosserat_rod).
    pub(in crate::scene) fn law_in_time(&self, units: Measures) -> Result<Option<LawInTime>> {
        if self.field_in_time().is_none() {
            return Ok(None);
        }
        let drive = self.drive.as_ref();
        let drive = drive.map(|drive| (drive.shape.clone(), drive.amplitude.clone()));
        let tensions = self.tendons.iter().filter_map(Tendon::tension).cloned();
        let tendons = self.section_tendons().zip(tensions).collect();
        let base = self.undriven()?.law().clone();
        LawInTime::new(base, drive, tendons, self.length, units).map(Some)
    }

    /// The tendons at t = 0, those of given length slack.
    fn section_tendons(&self) -> impl Iterator<Item = section::Tendon> {
        self.tendons.iter().map(|tendon| section::Tendon {
            route: tendon.route.clone(),
            to: tendon.to.unwrap_or(self.length),
            tension: tendon.tension().map_or(0.0, |tension| tension.at(0.0)),
        })
    }

    /// The law with the rod's tendons, those of given length slack.
    ///
    /// # Errors
    /// As [`Tendons::new`].
    pub(in crate::scene) fn with_tendons(&self, law: Arc<dyn SectionLaw>) -> Result<Tendons> {
        let tendons = self.section_tendons().collect();
        Tendons::new(law, tendons, self.length).map_err(|e| e.context("rod.tendon"))
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
