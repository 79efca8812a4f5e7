//! Start of a scene: shape of the rod, and velocity of its end.

use super::{Orientation, StrainName};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

/// Shape of the rod at the start, and velocity of its end. In statics only the initial guess counts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Start {
    /// The shape of the rod.
    #[serde(flatten)]
    pub place: InitialShape,
    /// Strain field at which the Maxwell branches are relaxed; default [`RelaxedAt::Start`].
    #[serde(skip_serializing_if = "RelaxedAt::is_start")]
    pub relaxed: RelaxedAt,
    /// Initial strain rates of a rod with mass; `None`: the rates of a massless rod that follows its end.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub rate: Option<StrainRate>,
    /// Velocity of the end of the rod; default 0.
    pub velocity: [f64; 3],
    /// Angular velocity of a welded body; default 0, and 0 for a point mass.
    pub angular_velocity: [f64; 3],
    /// In the plane, for a rod that starts straight: a small angle of the end in radians. Its sign selects the side to
    /// which the rod buckles; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub imperfection: f64,
    /// True if the velocities are added to those of the end carried by the clamp at t = 0. False (the default): they
    /// are velocities in the world.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub with_clamp: bool,
    /// In statics: initial guess of the base wrench (m1, m2, m3, n1, n2, n3) in the world frame; `None`: the unloaded
    /// rod.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench: Option<[f64; 6]>,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Shape of the rod at the start: an equilibrium, or, for a rod with damping, any shape.
///
/// In the plane, with n the contact force and alpha its direction, lambda = L sqrt(|n| / EI) and
/// kappa = sin((theta(L) - alpha) / 2). Both are dimensionless.
/// Each pair (lambda > 0, kappa in (-1, 1) without 0) is one equilibrium.
/// kappa = 0 is the straight rod for every lambda; -kappa is the mirror image of kappa.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum InitialShape {
    /// In the plane, by lambda and kappa.
    Kappa {
        /// lambda, in (0, 1e4].
        lambda: f64,
        /// kappa, in (-1, 1), not 0.
        kappa: f64,
    },
    /// In the plane, by lambda and p, kappa = tanh p: for rods so nearly taut that kappa rounds to 1.
    P {
        /// lambda, in (0, 1e4].
        lambda: f64,
        /// p, in [-1e4, 1e4], not 0.
        p: f64,
    },
    /// In the plane, by the position of the body, which several equilibria may share.
    Position {
        /// Position, |position| < L.
        position: [f64; 3],
        /// Selects one of the equilibria at this position.
        sheet: Sheet,
    },
    /// In the plane, by the curvature, for any load; only with damping.
    Curvature {
        /// c0, c1, ...: theta' = c0 + c1 x + c2 x^2 + ..., 1/length, x = s/L; from 1 to 16 of them.
        curvature: Vec<f64>,
    },
    /// The unloaded rod: `rest = "straight"`.
    Rest {
        /// The word `"straight"`.
        rest: Straight,
    },
    /// The equilibrium under the loads at t = 0, a stable one if a few starts lead to one: `settled = true`.
    Settled {
        /// true.
        settled: bool,
    },
    /// In space, by the strain field, for any load; the default is the unloaded rod.
    Strain {
        /// The strains. An empty field is not written: an elastic rod may also start unloaded, but has no such field.
        #[serde(skip_serializing_if = "StrainField::is_unloaded")]
        strain: StrainField,
    },
    /// In space, the equilibrium under a load at the end.
    Equilibrium {
        /// The load.
        equilibrium: EndLoad,
    },
    /// In space, an equilibrium with the end held in this pose.
    Pose {
        /// The pose.
        pose: EndPose,
    },
}

impl Default for InitialShape {
    fn default() -> Self {
        let strain = StrainField::default();
        Self::Strain { strain }
    }
}

impl InitialShape {
    /// Chart coordinates (lambda, p), if the shape is given by them.
    pub fn chart(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Kappa { lambda, kappa } => Some((lambda, kappa.atanh())),
            Self::P { lambda, p } => Some((lambda, p)),
            _ => None,
        }
    }
}

/// The word `"straight"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Straight {
    /// The unloaded rod.
    Straight,
}

/// Selection of one equilibrium among those at the initial position of the body.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sheet {
    /// The only stable one (the default). If several are stable the run refuses and lists them.
    Stable,
    /// The one of lowest elastic energy.
    Lowest,
    /// The one on the named sheet.
    #[serde(untagged)]
    Named(SheetName),
}

/// An equilibrium named by its sheet, S_mode^sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SheetName {
    /// Number of zeros of the curvature theta' inside the rod (inflections), 0..=3000, and the sign of the curvature at
    /// the clamp ("+": the rod curves to the left, towards +y).
    #[serde(flatten)]
    pub sheet: crate::manifold::Sheet,
    /// Value of lambda that selects among several equilibria of this sheet and position: the nearest one counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near: Option<f64>,
}

/// A strain field: for each strain, in the order of [`StrainName`], a polynomial in x = s/L, c0 + c1 x + ..., from 1
/// to 16 coefficients; `None`: as in the unloaded rod.
///
/// In a scene `{ u1 = [0.5, -0.5], v3 = [1.1] }`. Strains that the section holds rigid are not given; v3 > 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StrainField(pub [Option<Vec<f64>>; 6]);

impl StrainField {
    /// The polynomial of a strain.
    pub fn polynomial(&self, name: StrainName) -> Option<&[f64]> {
        self.0[name as usize].as_deref()
    }

    /// True if every strain is that of the unloaded rod.
    pub fn is_unloaded(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// The value of a strain at x = s/L; `None`: as in the unloaded rod.
    pub fn at(&self, name: StrainName, x: f64) -> Option<f64> {
        let polynomial = self.polynomial(name)?;
        Some(polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c))
    }
}

impl Serialize for StrainField {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut table = serializer.serialize_map(None)?;
        for name in StrainName::ALL {
            if let Some(polynomial) = self.polynomial(name) {
                table.serialize_entry(name.as_str(), polynomial)?;
            }
        }
        table.end()
    }
}

/// Strain rates of a rod with mass at the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum StrainRate {
    /// In the plane, the rate of the curvature: c0, c1, ... of c0 + c1 x + ..., x = s/L.
    #[serde(rename = "curvature_rate")]
    Curvature(Vec<f64>),
    /// In space, the rates of the strains; 0 where none is given.
    #[serde(rename = "strain_rate")]
    Strain(StrainField),
}

/// The strain field to which the Maxwell branches are relaxed at the start: the shape in which the rod has been held
/// for a long time.
///
/// In a scene `relaxed = true`, `relaxed = false`, or the strain field, in the plane the curvature `[c0, c1, ...]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum RelaxedAt {
    /// `true`, the default: the strain field of the start. The branches carry no stress yet.
    #[default]
    Start,
    /// `false`: the unloaded rod. The rod was deformed in an instant.
    Unloaded,
    /// In the plane, this curvature.
    Curvature(Vec<f64>),
    /// In space, these strains.
    Strain(StrainField),
}

impl RelaxedAt {
    pub(super) fn is_start(&self) -> bool {
        matches!(self, Self::Start)
    }
}

impl Serialize for RelaxedAt {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Start => true.serialize(serializer),
            Self::Unloaded => false.serialize(serializer),
            Self::Curvature(curvature) => curvature.serialize(serializer),
            Self::Strain(field) => field.serialize(serializer),
        }
    }
}

/// A load at the end of the rod, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EndLoad {
    /// Force; default 0.
    pub force: [f64; 3],
    /// Couple; default 0, and 0 for a ball.
    pub couple: [f64; 3],
}

/// A pose of the end of the rod, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EndPose {
    /// Position.
    pub position: [f64; 3],
    /// Orientation of the directors; `None` for a ball joint, and only for a ball joint.
    #[serde(flatten)]
    pub orientation: Option<Orientation>,
}
