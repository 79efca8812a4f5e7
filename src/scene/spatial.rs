//! Scenes of motion in space: a viscoelastic rod, a body at its end, a start, loads and a run.

use super::viscous::power_entries;
use super::{Clamp, CosseratRod, Force, Method, Orientation, PowerLaw, Relaxed, StrainName, Units};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

/// A scene of motion in space with its defaults filled in: `model = "cosserat"` with `[body]` and `[run]`.
///
/// It serialises to a scene again. The fields are plain data; only [`SpatialMotion::parse`] and
/// [`SpatialMotion::read`] check them. Quantities are in one consistent system of units of the user's choice.
///
/// ```
/// use snaprod::scene::{Joint, SpatialMotion};
/// let scene = SpatialMotion::parse(
///     r#"
///     [rod]
///     model = "cosserat"
///     length = 1.0
///     damping = { proportional = 0.05 }
///     [rod.section]
///     bending = [1.0, 1.5]
///     torsion = 0.7
///     [body]
///     mass = 1.0
///     joint = "ball"
///     [start]
///     equilibrium = { force = [0.5, 0.0, -3.0] }
///     [run]
///     duration = 3.0
///     "#,
/// )?;
/// assert_eq!(scene.body.joint, Joint::Ball);
/// # Ok::<(), snaprod::scene::Faults>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialMotion {
    /// The system of units of every quantity below.
    pub units: Units,
    /// `[rod]`: the rod.
    pub rod: ViscousRod,
    /// `[clamp]`: the pose of the base, s = 0.
    pub clamp: Clamp,
    /// `[body]`: the body at the end, s = length.
    pub body: SpatialBody,
    /// `[start]`: shape of the rod, and velocity of its end.
    pub start: SpatialStart,
    /// `[loads]`: what acts on the body beside the rod.
    pub loads: SpatialLoads,
    /// `[run]`: how long, and how accurately.
    pub run: SpatialRun,
}

/// A viscoelastic rod in space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViscousRod {
    /// Length, section law and rest strains. With Maxwell branches the section law is that after a long time.
    #[serde(flatten)]
    pub elastic: CosseratRod,
    /// Internal friction.
    pub damping: SpatialDamping,
    /// Maxwell branches (Prony series), at most 32; default none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub relaxation: Vec<SpatialMaxwell>,
    /// A fixed number of strain nodes, 4..=400; default chosen and adapted by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
}

/// A symmetric matrix over the strains (u1, u2, u3, v1, v2, v3). Rows and columns of strains that the section holds
/// rigid have no effect.
#[derive(Debug, Clone, PartialEq)]
pub enum StrainMatrix {
    /// Its diagonal: an array of six numbers.
    Diagonal([f64; 6]),
    /// By rows: an array of six arrays.
    Full(Box<[[f64; 6]; 6]>),
    /// So many times the stiffness of the section at its unloaded strains: `{ proportional = factor }`.
    Proportional(f64),
}

impl StrainMatrix {
    /// The rows; `None` if it is in proportion to the section.
    pub fn rows(&self) -> Option<[[f64; 6]; 6]> {
        match self {
            Self::Diagonal(diagonal) => {
                let mut rows = [[0.0; 6]; 6];
                for (i, x) in diagonal.iter().enumerate() {
                    rows[i][i] = *x;
                }
                Some(rows)
            }
            Self::Full(rows) => Some(**rows),
            Self::Proportional(_) => None,
        }
    }

    /// Every entry (i, j) times `entry(i, j)`, a factor of proportionality times `factor`.
    pub(super) fn scaled(&self, entry: impl Fn(usize, usize) -> f64, factor: f64) -> Self {
        match self {
            Self::Diagonal(diagonal) => {
                Self::Diagonal(std::array::from_fn(|i| diagonal[i] * entry(i, i)))
            }
            Self::Full(rows) => {
                let row = |i: usize| std::array::from_fn(|j| rows[i][j] * entry(i, j));
                Self::Full(Box::new(std::array::from_fn(row)))
            }
            Self::Proportional(x) => Self::Proportional(x * factor),
        }
    }

    /// Every number of it.
    pub(super) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Diagonal(diagonal) => diagonal.to_vec(),
            Self::Full(rows) => rows.as_flattened().to_vec(),
            Self::Proportional(x) => vec![*x],
        }
    }
}

impl Serialize for StrainMatrix {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Diagonal(diagonal) => diagonal.serialize(serializer),
            Self::Full(rows) => rows.serialize(serializer),
            Self::Proportional(factor) => {
                let mut table = serializer.serialize_map(Some(1))?;
                table.serialize_entry("proportional", factor)?;
                table.end()
            }
        }
    }
}

/// Internal friction of a rod in space, w = dW/de + D(e, e_t) (AMV (2.20)).
///
/// In a scene the matrix H alone, or a table: `{ proportional = 0.05, exponent = 0.5, rate = 1.0 }`,
/// `{ proportional = 0.05, barrier = { strength = 0.1, half_widths = [0.05, 0.05] } }`; with `viscosity` in place of
/// `proportional`, H is any matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct SpatialDamping {
    /// H, stiffness times time, positive definite in the strains that are not rigid;
    /// [`StrainMatrix::Proportional`] is a time > 0.
    pub viscosity: StrainMatrix,
    /// How D follows from H.
    pub law: FrictionLaw,
}

/// How friction depends on strains and rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// Kelvin-Voigt, D = H e_t.
    Linear,
    /// D = H e_t (1 + e_t.K e_t/(B rate^2))^((exponent - 1)/2), H in proportion to K, the stiffness of the section at its
    /// unloaded strains, and B the reference bending stiffness of the rod
    /// ([`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)): for flexure alone that of
    /// [`Damping`](super::Damping).
    Power(PowerLaw),
    /// D = H e_t and friction that is infinite at total compression (AMV (2.40), (2.41)).
    Barrier(FrictionBarrier),
}

/// Friction at total compression.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionBarrier {
    /// What it adds to the axial viscosity of the straight unstretched rod > 0, force times time.
    pub strength: f64,
    /// Half widths of the cross-section along d1 and d2, > 0.
    pub half_widths: [f64; 2],
}

impl Serialize for SpatialDamping {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.law == FrictionLaw::Linear {
            return self.viscosity.serialize(serializer);
        }
        let mut table = serializer.serialize_map(None)?;
        match &self.viscosity {
            StrainMatrix::Proportional(time) => table.serialize_entry("proportional", time)?,
            matrix => table.serialize_entry("viscosity", matrix)?,
        }
        match self.law {
            FrictionLaw::Linear => {}
            FrictionLaw::Power(power) => power_entries(&mut table, Some(power))?,
            FrictionLaw::Barrier(barrier) => table.serialize_entry("barrier", &barrier)?,
        }
        table.end()
    }
}

/// A Maxwell branch of a rod in space: with z the strain of its dashpot it adds E (e - z) to the resultants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialMaxwell {
    /// E, positive semidefinite in the strains that are not rigid; [`StrainMatrix::Proportional`] is a number >= 0.
    pub stiffness: StrainMatrix,
    /// Its relaxation time > 0.
    pub time: f64,
}

/// The body at the end of the rod.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialBody {
    /// Mass > 0.
    pub mass: f64,
    /// How it is fixed to the end.
    #[serde(flatten)]
    pub joint: Joint,
}

/// How the body is fixed to the end of the rod.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "joint", rename_all = "lowercase")]
pub enum Joint {
    /// A point mass on an end that is free to turn.
    Ball,
    /// A rigid body welded to the end (the default).
    Weld {
        /// Its centre of mass, from the end of the rod, in components along the directors there; default 0.
        offset: [f64; 3],
        /// Its inertia about the centre of mass, in components along the directors, symmetric positive definite; in a
        /// scene also the three numbers of its diagonal.
        inertia: [[f64; 3]; 3],
    },
}

impl Joint {
    /// True for [`Joint::Weld`].
    pub fn is_weld(&self) -> bool {
        matches!(self, Self::Weld { .. })
    }
}

/// Shape of the rod at the start, and velocity of its end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialStart {
    /// The shape.
    #[serde(flatten)]
    pub place: SpatialPlace,
    /// Where the Maxwell branches are relaxed; default [`Relaxed::Start`].
    #[serde(skip_serializing_if = "Relaxed::is_start")]
    pub relaxed: Relaxed<StrainField>,
    /// Velocity of the end of the rod, in the world; default 0.
    pub velocity: [f64; 3],
    /// Angular velocity of the body, in the world; default 0, and 0 for a ball.
    pub angular_velocity: [f64; 3],
}

impl Default for SpatialStart {
    fn default() -> Self {
        Self {
            place: SpatialPlace::Strain(StrainField::default()),
            relaxed: Relaxed::Start,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
        }
    }
}

/// The shape of the rod at the start, given in one of three ways.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SpatialPlace {
    /// The strain field, whatever the load; the default is the unloaded rod.
    Strain(StrainField),
    /// The equilibrium under a load at the end.
    Equilibrium(EndLoad),
    /// An equilibrium with the end held in this pose.
    Pose(EndPose),
}

/// A strain field: for each strain, in the order of [`StrainName`], a polynomial in x = s/L, c0 + c1 x + ..., from 1 to 16
/// coefficients; `None`: as in the unloaded rod.
///
/// In a scene `{ u1 = [0.5, -0.5], v3 = [1.1] }`. Strains that the section holds rigid are not given; v3 > 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StrainField(pub [Option<Vec<f64>>; 6]);

impl StrainField {
    /// The polynomial of a strain.
    pub fn polynomial(&self, name: StrainName) -> Option<&[f64]> {
        self.0[name as usize].as_deref()
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
    /// Orientation of the directors; `None` for a ball, and only there.
    #[serde(flatten)]
    pub orientation: Option<Orientation>,
}

/// What acts on the body beside the rod, in the world. Everything defaults to zero.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SpatialLoads {
    /// Acceleration of gravity: force mass * gravity at the centre of mass.
    pub gravity: [f64; 3],
    /// Constant force at the centre of mass.
    pub dead: [f64; 3],
    /// Constant couple; 0 for a ball.
    pub couple: [f64; 3],
    /// Drag coefficient >= 0: force -drag * velocity of the centre of mass, at the centre of mass.
    pub drag: f64,
    /// Sinusoidal forces at the centre of mass, added up.
    pub force: Vec<Force<3>>,
}

/// How long, and how accurately.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialRun {
    /// Duration > 0.
    pub duration: f64,
    /// Tolerance, relative, in [1e-14, 1e-2]; default [`SpatialRun::TOLERANCE`].
    pub tolerance: f64,
    /// How the run steps through time; default [`Method::Auto`].
    pub method: Method,
    /// Whether a longitudinal, twisting or shearing motion of a uniform rod is integrated as the body's ordinary
    /// differential equation, which is exact ([`Reduction`](crate::motion::reduction::Reduction)); default true.
    pub reduce: bool,
    /// Number of equally spaced times, both ends counted, at which the motion is written, 2..=10_000_000; default
    /// [`Run::SAMPLES`](super::Run::SAMPLES).
    pub samples: usize,
    /// The run stops after so many steps, 1..=1_000_000_000; default [`Run::MAX_STEPS`](super::Run::MAX_STEPS).
    pub max_steps: usize,
}

impl SpatialRun {
    /// Default tolerance.
    pub const TOLERANCE: f64 = 1e-8;
}
