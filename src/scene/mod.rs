//! Scenes: a rod, a body, a start, loads and a run, written in TOML.
//!
//! ```
//! use snaprod::scene::Scene;
//! let scene = Scene::parse(
//!     r#"
//!     [rod]
//!     model = "elastica"
//!     length = 1.0
//!     bending_stiffness = 1.0
//!     [body]
//!     mass = 1.0
//!     [start]
//!     lambda = 6.3
//!     kappa = 0.6
//!     [run]
//!     duration = 3.0
//!     "#,
//! )?;
//! assert_eq!(scene.run.tolerance, 1e-10); // a default
//! # Ok::<(), snaprod::scene::Faults>(())
//! ```
//!
//! A scene is read to its end whatever is wrong with it, and [`Faults`] holds every fault with its
//! line, the field, the value, what is allowed and what to do. Here the kappa of a straight rod, a
//! mass that is none, and a slip of the pen:
//!
//! ```
//! # use snaprod::scene::Scene;
//! let text = r#"
//! [rod]
//! model = "elastica"
//! lenght = 1.0
//! bending_stiffness = 1.0
//! [body]
//! mass = -1.0
//! [start]
//! lambda = 6.3
//! kappa = 0.0
//! [run]
//! duration = 3.0
//! "#;
//! let faults = Scene::parse(text).unwrap_err();
//! let lines: Vec<usize> = faults.into_iter().map(|fault| fault.line).collect();
//! assert_eq!(lines, [4, 7, 10]);
//! ```
//!
//! Quantities are in one consistent system of units of the user's choice; [`Scales`] leads into the
//! library's units, in which length, bending stiffness and mass are 1.
//!
//! With `damping` in `[rod]` the rod is viscoelastic: it may start from any strain field, and has no snaps but fast motion.
//!
//! Rods in space have scenes of their own: of statics, [`Statics`], and of motion, [`SpatialMotion`]. [`read_any`] takes
//! any kind.

mod along_schema;
mod build;
mod build_motion;
mod build_rod;
mod build_viscous;
mod continue_schema;
mod fault;
mod kind;
mod matrix_schema;
mod motion_setup;
mod parameter;
mod reader;
mod scales;
mod schema;
mod section_schema;
mod spatial;
mod spatial_damping;
mod spatial_scales;
mod spatial_schema;
mod statics;
mod statics_schema;
mod viscous;
mod viscous_schema;

pub use build::Setup;
pub use build_viscous::ViscousSetup;
pub use fault::{Fault, FaultKind, Faults, ReadError};
pub use motion_setup::{MotionSetup, MotionState, Moving, SpaceField, WithRun};
pub use parameter::Parameter;
pub use scales::{Dimensionless, Harmonic, Scales};
pub use spatial::{
    EndLoad, EndPose, FrictionBarrier, FrictionLaw, Joint, SpatialBody, SpatialDamping,
    SpatialLoads, SpatialMaxwell, SpatialMotion, SpatialPlace, SpatialRun, SpatialStart,
    StrainField, StrainMatrix, ViscousRod,
};
pub use spatial_scales::SpatialDimensionless;
pub use statics::{
    Along, Barrier, BarrierTerm, Clamp, Component, Continue, CosseratRod, Diagonal, End, Full,
    Guess, LawName, Orientation, Rest, Rigid, Rotation, Second, Section, Shape, Shaped, Solve,
    Statics, Stiffness, StrainName, Transverse,
};
pub use viscous::{Damping, Friction, Maxwell, Method, PowerLaw, Relaxed};

use crate::Error;
use kind::Kind;
use serde::Serialize;
use std::path::Path;

/// A scene with its defaults filled in.
///
/// It serialises to a scene again: what a run prints as its resolved scene can be run.
/// The fields are plain data; only [`Scene::parse`] and [`Scene::read`] check them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// The system of units of every quantity below.
    pub units: Units,
    /// `[rod]`: the rod.
    pub rod: Rod,
    /// `[body]`: the body at its free end.
    pub body: Body,
    /// `[start]`: where and how fast the body starts.
    pub start: Start,
    /// `[loads]`: what acts on the body beside the rod.
    pub loads: Loads,
    /// `[run]`: how long, how accurately, and what a snap does.
    pub run: Run,
}

impl Scene {
    /// Reads a scene from TOML text.
    ///
    /// # Errors
    /// Every fault of the scene; only a syntax fault (not TOML at all) comes alone.
    pub fn parse(text: &str) -> Result<Self, Faults> {
        schema::scene(text)
    }

    /// Reads a scene from bytes, which must be UTF-8.
    ///
    /// # Errors
    /// As [`Scene::parse`], or one syntax fault at the first byte that is not UTF-8.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Faults> {
        Self::parse(utf8(bytes)?)
    }

    /// Reads a scene from a file.
    ///
    /// # Errors
    /// The file cannot be read, or the scene has faults.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        read_file(path, Self::from_bytes)
    }
}

impl Statics {
    /// Reads a scene of statics from TOML text.
    ///
    /// # Errors
    /// As [`Scene::parse`].
    pub fn parse(text: &str) -> Result<Self, Faults> {
        statics_schema::statics(text)
    }

    /// Reads a scene of statics from bytes, which must be UTF-8.
    ///
    /// # Errors
    /// As [`Scene::from_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Faults> {
        Self::parse(utf8(bytes)?)
    }

    /// Reads a scene of statics from a file.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        read_file(path, Self::from_bytes)
    }
}

impl SpatialMotion {
    /// Reads a scene of motion in space from TOML text.
    ///
    /// # Errors
    /// As [`Scene::parse`].
    pub fn parse(text: &str) -> Result<Self, Faults> {
        spatial_schema::motion(text)
    }

    /// Reads a scene of motion in space from bytes, which must be UTF-8.
    ///
    /// # Errors
    /// As [`Scene::from_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Faults> {
        Self::parse(utf8(bytes)?)
    }

    /// Reads a scene of motion in space from a file.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        read_file(path, Self::from_bytes)
    }
}

/// A scene of any kind. It serialises to that scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AnyScene {
    /// A body on a planar rod, in motion.
    Dynamics(Box<Scene>),
    /// A rod in space, at rest.
    Statics(Box<Statics>),
    /// A body on a rod in space, in motion.
    SpatialMotion(Box<SpatialMotion>),
}

/// Reads a scene of the kind that its content says: `rod.model = "elastica"` is planar dynamics, `"cosserat"` with
/// `[body]` and `[run]` motion in space, with `[end]` statics.
///
/// # Errors
/// As [`Scene::parse`]. Where `rod.model` is missing or misspelt, or the tables are those of several kinds, the faults are
/// those of the kind that most of the scene looks like.
pub fn parse_any(text: &str) -> Result<AnyScene, Faults> {
    match kind::guess_kind(text) {
        Kind::Planar => Scene::parse(text).map(|scene| AnyScene::Dynamics(Box::new(scene))),
        Kind::Statics => Statics::parse(text).map(|scene| AnyScene::Statics(Box::new(scene))),
        Kind::Motion => {
            SpatialMotion::parse(text).map(|scene| AnyScene::SpatialMotion(Box::new(scene)))
        }
    }
}

/// Reads a scene of any kind from a file, as [`parse_any`].
///
/// # Errors
/// The file cannot be read, or the scene has faults.
pub fn read_any(path: &Path) -> Result<AnyScene, ReadError> {
    read_file(path, |bytes| parse_any(utf8(bytes)?))
}

/// The text, or one syntax fault at the first byte that is not UTF-8.
fn utf8(bytes: &[u8]) -> Result<&str, Faults> {
    std::str::from_utf8(bytes).map_err(|error| {
        let text = String::from_utf8_lossy(bytes);
        let reader = reader::Reader::new(&text);
        reader.syntax(error.valid_up_to(), "the text is not UTF-8 from here on");
        Faults::new(reader.into_faults())
    })
}

fn read_file<T>(
    path: &Path,
    parse: impl FnOnce(&[u8]) -> Result<T, Faults>,
) -> Result<T, ReadError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| {
        ReadError::File(Error::io(error.to_string()).context(format!("reading {file}")))
    })?;
    parse(&bytes).map_err(|faults| ReadError::Scene { file, faults })
}

/// The system of units, for labels: it changes no number. Top-level `units = "si"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Any consistent system; labels carry no symbol.
    #[default]
    Dimensionless,
    /// Metre, kilogram, second.
    Si,
}

impl Units {
    /// Symbol of length; like every symbol here, empty if dimensionless.
    pub fn length(self) -> &'static str {
        self.si("m")
    }

    /// Symbol of force.
    pub fn force(self) -> &'static str {
        self.si("N")
    }

    /// Symbol of couple.
    pub fn couple(self) -> &'static str {
        self.si("N m")
    }

    /// Symbol of bending and torsional stiffness.
    pub fn flexural(self) -> &'static str {
        self.si("N m²")
    }

    /// Symbol of curvature and twist.
    pub fn curvature(self) -> &'static str {
        self.si("rad/m")
    }

    /// Symbol of energy.
    pub fn energy(self) -> &'static str {
        self.si("J")
    }

    /// Symbol of time.
    pub fn time(self) -> &'static str {
        self.si("s")
    }

    /// Symbol of mass.
    pub fn mass(self) -> &'static str {
        self.si("kg")
    }

    /// Symbol of velocity.
    pub fn velocity(self) -> &'static str {
        self.si("m/s")
    }

    /// A label for an axis or a column: `x [m]`, or `x` if the symbol is empty.
    pub fn label(name: &str, symbol: &str) -> String {
        match symbol {
            "" => name.to_owned(),
            _ => format!("{name} [{symbol}]"),
        }
    }

    fn si(self, symbol: &'static str) -> &'static str {
        match self {
            Self::Dimensionless => "",
            Self::Si => symbol,
        }
    }
}

/// The rod: inextensible, unshearable, straight when unloaded, without mass; clamped at the origin
/// with its tangent along +x.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rod {
    /// The rod model.
    pub model: Model,
    /// Length L > 0.
    pub length: f64,
    /// Bending stiffness EI > 0, force times length squared; with Maxwell branches that of the rod after a long time.
    pub bending_stiffness: f64,
    /// Internal friction; `None`: elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
    /// Maxwell branches (Prony series), at most 32, only with damping; default none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub relaxation: Vec<Maxwell>,
    /// A fixed number of strain nodes, 4..=400, only with damping; default chosen and adapted by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
}

/// The rod models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// The planar elastica, in closed form.
    Elastica,
    /// The Cosserat rod in space ([`Statics`], [`SpatialMotion`]).
    Cosserat,
}

/// The body: a point mass at the free end; the end is free to turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// Mass > 0.
    pub mass: f64,
}

/// Where and how fast the body starts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Start {
    /// The shape of the rod at the start.
    #[serde(flatten)]
    pub place: Place,
    /// Where the Maxwell branches are relaxed at the start: a polynomial as in [`Place::Curvature`]. Only with Maxwell
    /// branches; default [`Relaxed::Start`].
    #[serde(skip_serializing_if = "Relaxed::is_start")]
    pub relaxed: Relaxed<Vec<f64>>,
    /// Velocity of the body; default at rest.
    pub velocity: [f64; 2],
}

/// An equilibrium of the rod, named in one of three ways; or, of a rod with damping, any shape.
///
/// With n the contact force and alpha its direction,
/// lambda = L sqrt(|n| / EI) and kappa = sin((theta(L) - alpha) / 2); both are numbers in every
/// system of units, and each pair (lambda > 0, kappa in (-1, 1) without 0) is one equilibrium.
/// kappa = 0 is the straight rod, whatever lambda; -kappa is the mirror image of kappa.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Place {
    /// By lambda and kappa.
    Kappa {
        /// lambda, in (0, 1e4].
        lambda: f64,
        /// kappa, in (-1, 1), not 0.
        kappa: f64,
    },
    /// By lambda and p, kappa = tanh p: for rods so nearly taut that kappa rounds to 1.
    P {
        /// lambda, in (0, 1e4].
        lambda: f64,
        /// p, in [-1e4, 1e4], not 0.
        p: f64,
    },
    /// By the position of the body, which several equilibria may share.
    Position {
        /// Position, |position| < L.
        position: [f64; 2],
        /// Which of the equilibria there.
        sheet: Sheet,
    },
    /// By the strain field, whatever the load; only with damping.
    Curvature {
        /// c0, c1, ...: theta' = c0 + c1 x + c2 x^2 + ..., 1/length, x = s/L; from 1 to 16 of them.
        curvature: Vec<f64>,
    },
}

impl Place {
    /// The chart coordinates (lambda, p), if the place is named by them.
    pub fn chart(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Kappa { lambda, kappa } => Some((lambda, kappa.atanh())),
            Self::P { lambda, p } => Some((lambda, p)),
            Self::Position { .. } | Self::Curvature { .. } => None,
        }
    }
}

/// Which equilibrium, of those that share the position of the body at the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sheet {
    /// The only stable one (the default). Where several are stable the run must refuse, and list
    /// them.
    Stable,
    /// The one of lowest elastic energy.
    Lowest,
    /// The one so named.
    #[serde(untagged)]
    Named(SheetName),
}

/// An equilibrium by its sheet, S_mode^sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SheetName {
    /// Number of zeros of the curvature theta' inside the rod (inflections), 0..=3000, and the sign of
    /// the curvature at the clamp ("+": the rod leaves it curving to the left, towards +y).
    #[serde(flatten)]
    pub sheet: crate::manifold::Sheet,
    /// Where several equilibria share the name and the position: the one whose lambda is nearest
    /// to this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near: Option<f64>,
}

/// What acts on the body beside the rod. Everything defaults to zero.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Loads {
    /// Acceleration of gravity: force mass * gravity.
    pub gravity: [f64; 2],
    /// Constant force.
    pub dead: [f64; 2],
    /// Drag coefficient >= 0: force -drag * velocity.
    pub drag: f64,
    /// Sinusoidal forces, added up.
    pub force: Vec<Force>,
}

/// A force amplitude * sin(2 pi frequency t + phase) along a direction, in the plane or in space.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(bound(serialize = "[f64; N]: Serialize"))]
pub struct Force<const N: usize = 2> {
    /// Direction, not zero, of any length: only [`Force::unit`] enters the force, so that
    /// `amplitude` is the amplitude.
    pub direction: [f64; N],
    /// Amplitude, a force of either sign.
    pub amplitude: f64,
    /// Frequency >= 0, cycles per time. At 0 the force is constant, amplitude * sin(phase).
    pub frequency: f64,
    /// Phase in radians; default 0.
    pub phase: f64,
}

impl<const N: usize> Force<N> {
    /// The direction at unit length.
    pub fn unit(&self) -> [f64; N] {
        // Scaled by the largest component first, so that the norm neither over- nor underflows.
        let size = self
            .direction
            .iter()
            .fold(0.0_f64, |size, x| size.max(x.abs()));
        let scaled = self.direction.map(|x| x / size);
        let norm = scaled.iter().fold(0.0_f64, |norm, x| norm.hypot(*x));
        scaled.map(|x| x / norm)
    }
}

/// How long, how accurately, and what a snap does.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Duration > 0.
    pub duration: f64,
    /// Tolerance of the time steps, relative, in [1e-14, 1e-2]; default [`Run::TOLERANCE`].
    pub tolerance: f64,
    /// How the run steps through time, only with damping; default [`Method::Auto`].
    #[serde(skip_serializing_if = "Method::is_auto")]
    pub method: Method,
    /// Where a snapping rod lands; default [`Landing::Viscous`], and nothing else with damping.
    pub landing: Landing,
    /// Bound on the number of branches under [`Landing::All`], 1..=10000; default
    /// [`Run::BRANCHES`]. Without effect under the other landings.
    pub branches: usize,
    /// Number of equally spaced times, both ends counted, at which the motion is written,
    /// 2..=10_000_000; default [`Run::SAMPLES`].
    pub samples: usize,
    /// The run stops after so many steps, 1..=1_000_000_000; default [`Run::MAX_STEPS`].
    pub max_steps: usize,
    /// The run stops at the next snap after so many, 0..=1_000_000_000; default
    /// [`Run::MAX_SNAPS`].
    pub max_snaps: usize,
}

impl Run {
    /// Default tolerance.
    pub const TOLERANCE: f64 = 1e-10;
    /// Default bound on branches.
    pub const BRANCHES: usize = 64;
    /// Default number of samples.
    pub const SAMPLES: usize = 400;
    /// Default bound on steps.
    pub const MAX_STEPS: usize = 10_000_000;
    /// Default bound on snaps.
    pub const MAX_SNAPS: usize = 100_000;
}

/// To which equilibrium, of those at the position of a fold, the rod falls.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Landing {
    /// To the one that a rod of small viscosity reaches, the body held fixed (the default).
    Viscous,
    /// To the stable one of lowest elastic energy.
    Lowest,
    /// To every stable one: the run branches.
    All,
    /// To the stable one of this sheet.
    #[serde(untagged)]
    Named(crate::manifold::Sheet),
}
