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
//! assert_eq!(scene.run()?.tolerance, 1e-10); // a default
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scene with faults is still read to its end: [`Faults`] holds every fault with its line, the field, the value, the
//! allowed values and a hint. The example has the kappa of a straight rod, a negative mass, and a misspelt field:
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
//! Quantities are in one consistent system of units of the user's choice; [`Scales`] converts to the library's units,
//! in which length, bending stiffness and mass are 1.
//!
//! With `damping` in `[rod]` the rod is viscoelastic: it may start from any strain field, and moves fast instead of
//! snapping.
//!
//! The content determines the kind of scene: `rod.model = "elastica"` lies in the plane, `"cosserat"` in space; with
//! `[body]` and `[run]` it is a motion, with `[end]` a scene of statics. Several rods and bodies, `[[rod]]` and
//! `[[body]]`, are an assembly ([`AssemblyScene`]), at rest or with `[run]` in motion. `rod.model = "bar"` is a bar
//! with mass in longitudinal motion ([`BarScene`]).

mod acting;
mod assembly;
mod bar;
mod branch;
mod contact;
mod ends;
mod fault;
mod flow;
mod groove;
mod inflation;
mod joint;
mod loads;
mod lower;
mod mass_policy;
mod obstacle;
mod parameter;
mod print;
mod read;
mod registry;
mod rod;
mod rod_load;
mod run;
mod scalar_field;
mod scales;
mod section;
mod start;
mod station;
mod tendon;
mod units;
mod wall;

pub use crate::body::{Block, History, Pulse, Ramp, Sine};
pub use crate::motion::LandingRule;
pub use crate::section::rate::{Damping, FrictionLaw, Maxwell, PowerLaw, StrainMatrix};
pub use crate::section::{
    Along, BarrierTerm, Diagonal, Profile, Rest, Rigid, Shape, ShapeSettings, Stiffness,
    StrainName, Transverse,
};
pub use crate::solve::integrator::Method;
pub use acting::SteeredForce;
pub use assembly::{AssemblyBody, AssemblyRod, AssemblyScene, Extent, FreeRod, Guess, Site};
pub use bar::BarScene;
pub use branch::{Continue, Second, Solve};
pub use contact::{BodyShape, ContactMethod, ContactPair, ContactRules, RodsInContact};
pub use ends::{
    Body, Clamp, ClampMotion, Component, End, Joint, Orientation, Rotation, Translation, Turn,
};
pub use fault::{Fault, FaultKind, Faults, ReadError};
pub use flow::{
    FlowEndScene, FlowMedium, FlowScene, FlowStart, Lumped, OutsidePressure, TubeFlow, WallFriction,
};
pub use groove::{Groove, GrooveCircle, GrooveLine};
pub use inflation::{InflationScene, InflationStart, Mover, PistonScale, PistonScene, PistonStart};
pub use joint::{SiteJoint, SlideAxis, TurnAxis};
pub use loads::{Force, Load, LoadAlong, Loads};
pub use lower::{
    AssemblySetup, ElasticPlane, ElasticSpace, HeavyPlane, HeavySpace, ModelKind, MotionModel,
    PlacedJoint, Setup, SpaceField, SpaceStart, ViscousPlane, ViscousSpace,
};
pub use mass_policy::RodMassNote;
pub use obstacle::{Obstacle, ObstacleShape};
pub use parameter::Parameter;
pub(crate) use read::{is_count, nearest};
pub use read::{json_schema, reference};
pub use rod::{Bends, Inertia, Material, Model, Rod};
pub use rod_load::{EndWord, LoadPlace, RodLoad};
pub use run::Run;
pub use scalar_field::{ScalarField, SceneText};
pub use scales::{Dimensionless, Scales};
pub use section::{Barrier, Drive, Full, Outline, Section};
pub use start::{
    EndLoad, EndPose, InitialShape, RelaxedAt, Sheet, SheetName, Start, Straight, StrainField,
    StrainRate,
};
pub use station::Station;
pub use tendon::{Pull, Tendon};
pub use units::Units;
pub use wall::{
    MembraneLoad, MembraneScene, TubeLaw, TubeLoad, TubeScene, TubeWall, WallBranch, WallParameter,
    WallScene, WallStiffness,
};

use crate::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// A scene with its defaults filled in, in the units of its user.
///
/// A scene serialises to a scene: the resolved scene that a run prints can be run again. The fields are plain data;
/// only [`Scene::parse`] and [`Scene::read`] check them. Vectors have three components; in the plane the third is 0
/// and is not written.
///
/// ```
/// use snaprod::scene::{Parameter, Scene};
/// let scene = Scene::parse(
///     r#"
///     [rod]
///     model = "cosserat"
///     length = 1.0
///     [rod.section]
///     bending = [1.0, 1.5]
///     torsion = 0.7
///     [end]
///     force = [1.0, -2.0, 0.5]
///     "#,
/// )?;
/// let load: Parameter = "end.force.y".parse()?;
/// assert_eq!(scene.value(&load), -2.0);
/// assert_eq!(scene.with(&load, 3.0).end()?.force, [1.0, 3.0, 0.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(remote = "Self")]
pub struct Scene {
    /// The system of units of every quantity.
    pub units: Units,
    /// `[rod]`: the rod; in an assembly the first rod.
    pub rod: Rod,
    /// `[clamp]`: the pose of the rod's base, s = 0.
    pub clamp: Clamp,
    /// `[body]`: the body at the rod's end, s = length, in a scene of motion; `None` for a rod of full mass whose end
    /// is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<Body>,
    /// `[end]`: supports and loads of the rod's end, in a scene of statics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<End>,
    /// `[start]`: initial shape and velocity; in statics the initial guess.
    pub start: Start,
    /// `[loads]`: loads on the body; in statics on the rod.
    pub loads: Loads,
    /// `[[station]]`: places on rods that the tables follow.
    #[serde(rename = "station", skip_serializing_if = "Vec::is_empty")]
    pub stations: Vec<Station>,
    /// `[[obstacle]]`: solids that neither the rod nor the body enters.
    #[serde(rename = "obstacle", skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
    /// `[contact]`: rules of contact.
    #[serde(skip_serializing_if = "ContactRules::are_default")]
    pub contact: ContactRules,
    /// `[run]`: duration and accuracy of the motion, time steps, landing rule.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<Run>,
    /// `[solve]`: tolerance and algorithm for equilibria.
    pub solve: Solve,
    /// `[continue]`: the branch of equilibria to follow, if any.
    #[serde(rename = "continue", skip_serializing_if = "Option::is_none")]
    pub continuation: Option<Continue>,
    /// Several rods and bodies, or a bar, whose data stand here; a scene of one rod has its data in the fields above.
    #[serde(skip)]
    pub kind: SceneKind,
}

/// Kind of a scene, with the data of the kind.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum SceneKind {
    /// One rod, in the plane or in space.
    #[default]
    Rod,
    /// Several rods and bodies, `[[rod]]` and `[[body]]`. [`Scene::rod`] is the first rod. There are neither clamp nor
    /// body nor end.
    Assembly(AssemblyScene),
    /// A bar with mass, `rod.model = "bar"`. Of the other fields only the units and the run are used.
    Bar(BarScene),
    /// A flow in a tube, `[tube]` with `[run]`. Of the other fields only the units are used.
    Flow(FlowScene),
    /// A membrane in motion, `[membrane]` with `[run]`. Of the other fields only the units are used.
    Inflation(InflationScene),
    /// A wall under pressure at rest, `[tube]` or `[membrane]`. Of the other fields only the units are used.
    Wall(WallScene),
}

impl Scene {
    /// Reads a scene from TOML text.
    ///
    /// # Errors
    /// Every fault of the scene; only a syntax fault (not TOML at all) comes alone.
    pub fn parse(text: &str) -> std::result::Result<Self, Faults> {
        Self::parse_with(text, &[])
    }

    /// Reads a scene from TOML text in which `overrides` replace or add fields, each `path=value`: a dotted path into
    /// the document, `loads.force[0].amplitude`, and a value in TOML syntax.
    ///
    /// ```
    /// # let text = "[rod]\nmodel = 'elastica'\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n[start]\n\
    /// #     lambda = 6.3\nkappa = 0.6\n[run]\nduration = 3.0";
    /// use snaprod::scene::Scene;
    /// let scene = Scene::parse_with(text, &["body.mass=2.0", "rod.damping={ proportional = 0.1 }"])?;
    /// assert_eq!(scene.body()?.mass, 2.0);
    /// let faults = Scene::parse_with(text, &["body.mass=-2"]).unwrap_err();
    /// assert!(faults.to_string().starts_with("--set body.mass=-2: body.mass = -2: must be"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Scene::parse`]; a fault in an override names it instead of a line ([`Fault::set`]).
    pub fn parse_with(text: &str, overrides: &[&str]) -> std::result::Result<Self, Faults> {
        read::scene(&read::Sources::new(text, overrides))
    }

    /// Reads a scene from bytes, which must be UTF-8.
    ///
    /// # Errors
    /// As [`Scene::parse`], or one syntax fault at the first byte that is not UTF-8.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, Faults> {
        Self::parse(utf8(bytes)?)
    }

    /// Reads a scene from a file.
    ///
    /// # Errors
    /// The file cannot be read, or the scene has faults.
    pub fn read(path: &Path) -> std::result::Result<Self, ReadError> {
        Self::read_with(path, &[])
    }

    /// Reads a scene from a file, as [`Scene::parse_with`].
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read_with(path: &Path, overrides: &[&str]) -> std::result::Result<Self, ReadError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path);
        Self::read_bytes(file, bytes, path.parent(), overrides)
    }

    /// Reads a scene from a stream, as [`Scene::parse_with`]; the scene's files are looked for in the current
    /// directory. Faults and errors call the stream `name`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read_from(
        name: &str,
        stream: &mut impl std::io::Read,
        overrides: &[&str],
    ) -> std::result::Result<Self, ReadError> {
        let mut bytes = Vec::new();
        let read = stream.read_to_end(&mut bytes).map(|_| bytes);
        Self::read_bytes(name.to_owned(), read, None, overrides)
    }

    fn read_bytes(
        file: String,
        bytes: std::io::Result<Vec<u8>>,
        directory: Option<&Path>,
        overrides: &[&str],
    ) -> std::result::Result<Self, ReadError> {
        let bytes = bytes.map_err(|error| {
            ReadError::File(Error::io(format!("reading {file}")).caused_by(error))
        })?;
        utf8(&bytes)
            .and_then(|text| {
                let sources = read::Sources::new(text, overrides);
                read::scene(&sources.in_directory(directory.unwrap_or(Path::new(""))))
            })
            .map_err(|faults| ReadError::Scene { file, faults })
    }

    /// Rods and bodies of an assembly; `None` for one rod or a bar.
    pub fn assembly(&self) -> Option<&AssemblyScene> {
        match &self.kind {
            SceneKind::Assembly(assembly) => Some(assembly),
            _ => None,
        }
    }

    /// Data of a bar; `None` for one rod or an assembly.
    pub fn bar(&self) -> Option<&BarScene> {
        match &self.kind {
            SceneKind::Bar(bar) => Some(bar),
            _ => None,
        }
    }

    pub(crate) fn bar_mut(&mut self) -> Option<&mut BarScene> {
        match &mut self.kind {
            SceneKind::Bar(bar) => Some(bar),
            _ => None,
        }
    }

    /// A scene of a kind that has its data in itself, a bar or a wall; the fields of rods are empty.
    pub(crate) fn without_rods(units: Units, kind: SceneKind) -> Self {
        let length = match &kind {
            SceneKind::Bar(bar) => bar.length,
            _ => 1.0,
        };
        let rod = Rod {
            model: Model::Bar,
            length,
            material: None,
            bends: Bends::Weak,
            section: Section::Bending(0.0),
            rest: Rest::default(),
            damping: None,
            drive: None,
            tendons: Vec::new(),
            loads: Vec::new(),
            relaxation: Vec::new(),
            nodes: None,
            contact_diameter: None,
            mass: None,
            inertia: None,
            inertia_chosen: false,
            section_inertia: None,
            centreline: None,
        };
        Self {
            units,
            rod,
            clamp: Clamp::default(),
            body: None,
            end: None,
            start: Start::default(),
            loads: Loads::default(),
            stations: Vec::new(),
            obstacles: Vec::new(),
            contact: ContactRules::default(),
            run: None,
            solve: Solve::default(),
            continuation: None,
            kind,
        }
    }

    /// Data of a wall under pressure; `None` for rods and bars.
    pub fn wall(&self) -> Option<&WallScene> {
        match &self.kind {
            SceneKind::Wall(wall) => Some(wall),
            _ => None,
        }
    }

    /// Data of a flow in a tube; `None` for scenes of another kind.
    pub fn flow(&self) -> Option<&FlowScene> {
        match &self.kind {
            SceneKind::Flow(flow) => Some(flow),
            _ => None,
        }
    }

    /// Data of a membrane in motion; `None` for scenes of another kind.
    pub fn inflation(&self) -> Option<&InflationScene> {
        match &self.kind {
            SceneKind::Inflation(inflation) => Some(inflation),
            _ => None,
        }
    }

    /// True for a medium in motion, a bar, a flow or a membrane: it has a run of its own, and is always a motion.
    pub fn is_medium(&self) -> bool {
        self.is_bar() || self.flow().is_some() || self.inflation().is_some()
    }

    /// True for several rods and bodies.
    pub fn is_assembly(&self) -> bool {
        self.assembly().is_some()
    }

    /// True for a bar.
    pub fn is_bar(&self) -> bool {
        self.bar().is_some()
    }

    /// True if the rod lies in the plane: `rod.model = "elastica"`.
    pub fn is_planar(&self) -> bool {
        self.rod.model == Model::Elastica
    }

    /// True if the scene is one of motion: it has `[run]`, and not `[end]`.
    pub fn is_motion(&self) -> bool {
        self.run.is_some()
    }

    /// `[body]`.
    ///
    /// # Errors
    /// A scene of statics has none, nor has a rod of full mass whose end is free.
    pub fn body(&self) -> Result<&Body> {
        self.body.as_ref().ok_or_else(|| match self.kind {
            SceneKind::Rod if self.is_motion() => Error::domain(
                "the end of this rod is free, and what is asked for is that of a body there: add [body] with `mass = 1.0`",
            ),
            SceneKind::Bar(_) => of_a_bar(),
            SceneKind::Flow(_) => of_a_flow(),
            SceneKind::Inflation(_) => of_an_inflation(),
            SceneKind::Wall(_) => of_a_wall(),
            SceneKind::Assembly(_) => several(),
            SceneKind::Rod => at_rest(),
        })
    }

    /// Mass of the body of a motion of one rod, or that of the rod if its end is free.
    ///
    /// # Errors
    /// A scene of statics; a rod without body and without mass.
    pub(crate) fn carried_mass(&self) -> Result<f64> {
        match (&self.body, self.rod.mass()) {
            (None, Some(mass)) if self.is_motion() => Ok(mass),
            _ => Ok(self.body()?.mass),
        }
    }

    /// The groove in which the body of one rod slides.
    pub(crate) fn groove(&self) -> Option<&Groove> {
        self.body.as_ref()?.groove.as_ref()
    }

    /// `[run]`.
    ///
    /// # Errors
    /// A scene of statics has none.
    pub fn run(&self) -> Result<&Run> {
        self.run.as_ref().ok_or_else(|| match self.kind {
            SceneKind::Bar(_) => of_a_bar(),
            SceneKind::Flow(_) => of_a_flow(),
            SceneKind::Inflation(_) => of_an_inflation(),
            SceneKind::Wall(_) => of_a_wall(),
            SceneKind::Assembly(_) => Error::domain(
                "this assembly has no [run]: use `snaprod equilibrium`, or add [run] with `duration = 3.0`",
            ),
            SceneKind::Rod => at_rest(),
        })
    }

    /// `[end]`.
    ///
    /// # Errors
    /// A scene of motion has none.
    pub fn end(&self) -> Result<&End> {
        self.end.as_ref().ok_or_else(|| match self.kind {
            SceneKind::Bar(_) => of_a_bar(),
            SceneKind::Flow(_) => of_a_flow(),
            SceneKind::Inflation(_) => of_an_inflation(),
            SceneKind::Wall(_) => of_a_wall(),
            SceneKind::Assembly(_) => several(),
            SceneKind::Rod => Error::domain(
                "this is a scene of motion: use `snaprod run`; one of statics has [end] in place of [body] and [run]",
            ),
        })
    }
}

fn of_a_wall() -> Error {
    Error::domain(
        "this is a wall under pressure at rest, [tube] or [membrane]: use `snaprod equilibrium` or, with [continue], `snaprod branch`",
    )
}

fn of_a_flow() -> Error {
    Error::domain("this is a flow in a tube, [tube] with [run]: use `snaprod run`")
}

fn of_an_inflation() -> Error {
    Error::domain(
        "this is a membrane in motion, [membrane] with [run]: use `snaprod run`; without [run], [body] and density it is at rest",
    )
}

fn of_a_bar() -> Error {
    Error::domain("this is a bar in longitudinal motion, model = \"bar\": use `snaprod run`")
}

fn several() -> Error {
    Error::domain(
        "this is an assembly of several rods, [[rod]]: use `snaprod equilibrium`, or `snaprod run` where it has [run]",
    )
}

fn at_rest() -> Error {
    Error::domain(
        "this is a scene of statics: use `snaprod equilibrium` or `snaprod branch`; one of motion has [body] and [run] in place \
         of [end]",
    )
}

/// Decodes UTF-8 text, or reports one syntax fault at the first byte that is not UTF-8.
fn utf8(bytes: &[u8]) -> std::result::Result<&str, Faults> {
    std::str::from_utf8(bytes).map_err(|error| {
        let sources = read::Sources::new(&String::from_utf8_lossy(bytes), &[]);
        let message = "the text is not UTF-8 from here on";
        read::not_toml(&sources, error.valid_up_to(), message)
    })
}
