//! Choice of the chart for a problem: space, plane or closed form, with the reason.

use super::chart::Spatial;
use super::closed_form::ClosedForm;
use super::free_end::FreeEnd;
use super::ivp::Wrench;
use super::planar::Plane;
use super::problem::Problem;
use crate::error::{Error, Result};

/// Kind of chart in which a problem is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "kebab-case")
)]
pub enum Path {
    /// The simplest of the others that is valid.
    #[default]
    Auto,
    /// Six unknowns in space.
    Spatial,
    /// Three unknowns in a plane of symmetry of law, clamp and end condition.
    Planar,
    /// The elastica in closed form: two unknowns, no integration.
    ClosedForm,
}

impl Path {
    /// "auto", "spatial", "planar" or "closed-form".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Spatial => "spatial",
            Self::Planar => "planar",
            Self::ClosedForm => "closed-form",
        }
    }
}

/// The chosen path, and the reason why it is not a simpler one.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenPath {
    /// Spatial, planar or closed form.
    pub path: Path,
    /// The reason, as a sentence.
    pub why: String,
}

impl ChosenPath {
    pub(super) fn new(path: Path, why: impl Into<String>) -> Self {
        Self {
            path,
            why: why.into(),
        }
    }
}

/// A chart that is valid for a problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProblemChart {
    /// In space.
    Spatial(Spatial),
    /// In space, the end bearing no couple.
    FreeEnd(FreeEnd),
    /// In a plane.
    Planar(Plane),
    /// In closed form.
    ClosedForm(ClosedForm),
}

impl ProblemChart {
    /// True if the unknowns have the same meaning: numbers of the law may differ, the plane may not.
    pub fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Spatial(_), Self::Spatial(_)) | (Self::FreeEnd(_), Self::FreeEnd(_)) => true,
            (Self::Planar(a), Self::Planar(b)) => a == b,
            (Self::ClosedForm(a), Self::ClosedForm(b)) => a.plane() == b.plane(),
            _ => false,
        }
    }
}

impl Problem {
    /// Chart of any problem in space: the force on the end if it bears no couple, or else the base wrench.
    pub fn charted_in_space(&self) -> ProblemChart {
        // A ball joint on the axis bears no force across: a free turn needs the equations of the couple for its phase.
        if self.has_free_end() && !(self.end.holds() && self.turns_freely_about_clamp()) {
            ProblemChart::FreeEnd(FreeEnd)
        } else {
            ProblemChart::Spatial(Spatial)
        }
    }

    /// This problem, to be solved by the given path.
    #[must_use]
    pub fn with_path(mut self, path: Path) -> Self {
        self.path = path;
        self
    }

    /// The chart of the requested path, or the simplest, and the reason. The chart includes the base wrench `guess`
    /// (world frame) from which the search is to begin: between two planes of symmetry it decides.
    ///
    /// # Errors
    /// A path that is not valid for this problem; the message says why.
    pub fn choose_chart(&self, guess: Option<&Wrench>) -> Result<(ProblemChart, ChosenPath)> {
        let asked = |path: Path| format!("solve.path = \"{}\" was asked for", path.as_str());
        let spatial = |why: String| (self.charted_in_space(), ChosenPath::new(Path::Spatial, why));
        let refused = |why: &str| {
            Err(Error::domain(format!(
                "solve.path = \"{}\" does not hold here: {why}; use \"auto\"",
                self.path.as_str()
            )))
        };
        if self.path == Path::Spatial {
            return Ok(spatial(asked(Path::Spatial)));
        }
        let guess = guess.map(|base| self.rod.inward(base));
        let plane = match self.plane(guess.as_ref()) {
            Ok(plane) => plane,
            Err(why) if self.path == Path::Auto => {
                return Ok(spatial(format!("the data are not planar: {why}")));
            }
            Err(why) => return refused(&why),
        };
        let planar = |why: String| {
            (
                ProblemChart::Planar(plane),
                ChosenPath::new(Path::Planar, why),
            )
        };
        if self.path == Path::Planar {
            return Ok(planar(asked(Path::Planar)));
        }
        match self.closed_form(&plane) {
            Ok(chart) => Ok((
                ProblemChart::ClosedForm(chart),
                ChosenPath::new(
                    Path::ClosedForm,
                    match self.path {
                        Path::Auto => "the rod is the planar elastica: straight, uniform, unshearable, inextensible, \
                             no couple at its end"
                            .to_owned(),
                        path => asked(path),
                    },
                ),
            )),
            Err(why) if self.path == Path::Auto => {
                Ok(planar(format!("the data are planar; no closed form: {why}")))
            }
            Err(why) => refused(why),
        }
    }
}
