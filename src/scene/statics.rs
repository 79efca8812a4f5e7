//! Scenes of statics: a rod in space, its clamp, its end, and a branch to follow.

use super::{Model, Parameter, Units};
use crate::rod::Path;
use serde::Serialize;

/// A scene of statics with its defaults filled in: `model = "cosserat"`.
///
/// It serialises to a scene again. The fields are plain data; only [`Statics::parse`] and [`Statics::read`]
/// check them. Quantities are in one consistent system of units of the user's choice.
///
/// ```
/// use snaprod::scene::{Parameter, Statics};
/// let scene = Statics::parse(
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
/// assert_eq!(scene.with(&load, 3.0).end.force, [1.0, 3.0, 0.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statics {
    /// The system of units of every quantity below.
    pub units: Units,
    /// `[rod]`: the rod.
    pub rod: CosseratRod,
    /// `[clamp]`: the pose of the base, s = 0.
    pub clamp: Clamp,
    /// `[end]`: what holds or loads the end, s = length.
    pub end: End,
    /// `[start]`: where the search begins.
    pub start: Guess,
    /// `[solve]`: how accurately, and by which path.
    pub solve: Solve,
    /// `[continue]`: the branch to follow, if any.
    #[serde(rename = "continue", skip_serializing_if = "Option::is_none")]
    pub continuation: Option<Continue>,
}

/// A rod in space. Directors d1, d2, d3; unloaded, without rest strains, it runs along d3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CosseratRod {
    /// The rod model, [`Model::Cosserat`].
    pub model: Model,
    /// Length L > 0 of the unloaded rod.
    pub length: f64,
    /// `[rod.section]`: the section law.
    pub section: Section,
    /// `[rod.rest]`: strains without load.
    pub rest: Rest,
}

/// A section law.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Section {
    /// Stiffnesses of each strain by itself.
    Diagonal(Diagonal),
    /// A full matrix of stiffnesses.
    Full(Full),
    /// From the shape of the cross-section and the material.
    Shaped(Shaped),
    /// [`Diagonal`] with a barrier against total compression.
    Barrier(Barrier),
}

impl Section {
    /// True if neither shear nor stretch is possible: the arclength is that of the unloaded rod.
    pub fn is_inextensible(&self) -> bool {
        self.rigid()[3..].iter().all(|rigid| *rigid)
    }

    /// Which strains, in the order of [`StrainName`], are held at their rest values.
    pub fn rigid(&self) -> [bool; 6] {
        let held = |shear: bool, axial: bool| [false, false, false, shear, shear, axial];
        let diagonal =
            |d: &Diagonal| held(d.shear == Stiffness::Rigid, d.axial == Stiffness::Rigid);
        match self {
            Self::Diagonal(law) => diagonal(law),
            Self::Full(full) => StrainName::ALL.map(|name| full.rigid.contains(&name)),
            Self::Shaped(shaped) => held(shaped.shear.is_some(), shaped.axial.is_some()),
            Self::Barrier(law) => diagonal(&law.linear),
        }
    }
}

/// A number that is the same all along the rod, or varies with s.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Along {
    /// Everywhere the same.
    Constant(f64),
    /// Piecewise linear.
    Table {
        /// Arclengths of the unloaded rod, growing, from 0 to L; at least 2.
        s: Vec<f64>,
        /// The value at each.
        values: Vec<f64>,
    },
    /// c0 + c1 x + c2 x^2 + ..., x = s/L.
    Polynomial {
        /// c0, c1, ...; from 1 to 16 of them.
        polynomial: Vec<f64>,
    },
}

impl Along {
    /// The value at arclength `s` of a rod of this length.
    pub fn at(&self, s: f64, length: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Polynomial { polynomial } => {
                let x = s / length;
                polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c)
            }
            Self::Table { s: nodes, values } => {
                let last = nodes.len().min(values.len()).saturating_sub(1);
                if last == 0 {
                    return values.first().copied().unwrap_or(f64::NAN);
                }
                let i = nodes.partition_point(|node| *node <= s).clamp(1, last);
                let part = (s - nodes[i - 1]) / (nodes[i] - nodes[i - 1]);
                (1.0 - part) * values[i - 1] + part * values[i]
            }
        }
    }

    fn is_table(&self) -> bool {
        matches!(self, Self::Table { .. })
    }

    /// The number, if it is the same all along the rod.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Self::Constant(value) => Some(*value),
            _ => None,
        }
    }
}

/// A stiffness, or none: the strain is held at its rest value.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stiffness<T> {
    /// Held.
    Rigid,
    /// Elastic.
    #[serde(untagged)]
    Elastic(T),
}

/// Stiffnesses of each strain by itself. Every number is > 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagonal {
    /// Couple per flexure about d1 and d2, force times length squared.
    pub bending: [Along; 2],
    /// Couple per twist, force times length squared.
    pub torsion: Along,
    /// Force per shear along d1 and d2; default rigid (unshearable).
    pub shear: Stiffness<[Along; 2]>,
    /// Force per stretch; default rigid (inextensible).
    pub axial: Stiffness<Along>,
}

impl Diagonal {
    /// True if a stiffness is given by a table in s.
    pub(super) fn has_tables(&self) -> bool {
        let shear = match &self.shear {
            Stiffness::Elastic(shear) => shear.iter().any(Along::is_table),
            Stiffness::Rigid => false,
        };
        let axial = match &self.axial {
            Stiffness::Elastic(axial) => axial.is_table(),
            Stiffness::Rigid => false,
        };
        self.bending.iter().any(Along::is_table) || self.torsion.is_table() || shear || axial
    }
}

/// A full law, w = K (e - rest).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Full {
    /// K by rows, in the order of [`StrainName`]. Symmetric; positive definite in the strains that are not
    /// rigid. Rows and columns of rigid strains have no effect.
    pub stiffness: [[f64; 6]; 6],
    /// Strains held at their rest values, each once, in growing order; not all six.
    pub rigid: Vec<StrainName>,
}

/// The strains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StrainName {
    /// Flexure about d1.
    U1,
    /// Flexure about d2.
    U2,
    /// Twist.
    U3,
    /// Shear along d1.
    V1,
    /// Shear along d2.
    V2,
    /// Stretch.
    V3,
}

impl StrainName {
    /// All six, in order: `name as usize` is the place in (u1, u2, u3, v1, v2, v3).
    pub const ALL: [Self; 6] = [Self::U1, Self::U2, Self::U3, Self::V1, Self::V2, Self::V3];

    /// As it is written in a scene.
    pub fn as_str(self) -> &'static str {
        ["u1", "u2", "u3", "v1", "v2", "v3"][self as usize]
    }
}

/// A cross-section of a homogeneous isotropic material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shaped {
    /// Its shape.
    #[serde(flatten)]
    pub shape: Shape,
    /// Young's modulus E > 0, force per area.
    pub young: f64,
    /// The other elastic constant.
    #[serde(flatten)]
    pub transverse: Transverse,
    /// Shear stiffness = factor * G * area, in (0, 1]; without it, that of the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_factor: Option<f64>,
    /// Torsional stiffness = G * constant, > 0, length to the fourth; without it, that of St Venant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torsion_constant: Option<f64>,
    /// `"rigid"`: unshearable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear: Option<Rigid>,
    /// `"rigid"`: inextensible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial: Option<Rigid>,
}

/// The word `"rigid"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rigid {
    /// Held at its rest value.
    Rigid,
}

/// Shapes of a cross-section; every length > 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Shape {
    /// A solid circle.
    Circle {
        /// Its radius.
        radius: f64,
    },
    /// A solid rectangle.
    Rectangle {
        /// Side along d1.
        width: f64,
        /// Side along d2.
        height: f64,
    },
    /// A round tube.
    Tube {
        /// Outer radius.
        outer_radius: f64,
        /// Thickness of the wall, < outer radius.
        thickness: f64,
    },
}

/// The elastic constant beside Young's modulus.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Transverse {
    /// Shear modulus G > 0, force per area.
    ShearModulus(f64),
    /// Poisson's ratio in (-1, 0.5].
    Poisson(f64),
}

impl Transverse {
    /// Shear modulus G: E / (2 (1 + nu)) if Poisson's ratio is given.
    pub fn shear_modulus(self, young: f64) -> f64 {
        match self {
            Self::ShearModulus(modulus) => modulus,
            Self::Poisson(ratio) => young / (2.0 * (1.0 + ratio)),
        }
    }
}

/// The law with a barrier: its energy tends to infinity as the rod is compressed so much that the inner side of
/// a bent section shrinks to nothing (AMV (2.7), (2.26)).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Barrier {
    /// [`LawName::Barrier`].
    pub law: LawName,
    /// The linear part.
    #[serde(flatten)]
    pub linear: Diagonal,
    /// The barrier.
    pub barrier: BarrierTerm,
}

/// Laws by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LawName {
    /// [`Barrier`].
    Barrier,
}

/// The barrier of [`Barrier`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BarrierTerm {
    /// Size of its energy per length, a force > 0.
    pub strength: f64,
    /// Half widths of the cross-section along d1 and d2, >= 0.
    pub half_widths: [f64; 2],
}

/// Strains without load; all default to 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// Flexures about d1 and d2, per length.
    pub curvature: [Along; 2],
    /// Twist, radians per length.
    pub twist: Along,
}

impl Rest {
    /// True if a strain is given by a table in s.
    pub(super) fn has_tables(&self) -> bool {
        self.curvature.iter().any(Along::is_table) || self.twist.is_table()
    }
}

impl Default for Rest {
    fn default() -> Self {
        Self {
            curvature: [Along::Constant(0.0), Along::Constant(0.0)],
            twist: Along::Constant(0.0),
        }
    }
}

/// The pose of the base. Default: at the origin, the directors along the world axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Clamp {
    /// Position.
    pub position: [f64; 3],
    /// Orientation of the directors d1, d2, d3 in the world.
    #[serde(flatten)]
    pub orientation: Orientation,
}

/// A rotation that takes the world axes to the directors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// A unit quaternion [w, x, y, z].
    Quaternion([f64; 4]),
    /// By axis and angle; the angle can be the parameter of a branch.
    Rotation(Rotation),
}

impl Default for Orientation {
    fn default() -> Self {
        Self::Quaternion([1.0, 0.0, 0.0, 0.0])
    }
}

impl Orientation {
    /// As a quaternion [w, x, y, z].
    pub fn quaternion(&self) -> [f64; 4] {
        match self {
            Self::Quaternion(q) => *q,
            Self::Rotation(Rotation { axis, angle }) => {
                let (sin, cos) = (0.5 * angle).sin_cos();
                [cos, axis[0] * sin, axis[1] * sin, axis[2] * sin]
            }
        }
    }
}

/// A rotation about an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rotation {
    /// Unit vector in the world frame.
    pub axis: [f64; 3],
    /// Angle in radians, of any size.
    pub angle: f64,
}

/// What holds or loads the end, s = L: `[end]` may be empty, but not left out.
///
/// Nothing held: a load. The position alone held: a ball joint. Position and orientation held: a clamp. The
/// orientation alone: guided. Single components of the position may be free.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct End {
    /// Position, each component held or free.
    #[serde(skip_serializing_if = "all_free")]
    pub position: [Component; 3],
    /// Orientation of the directors at the end, if it is held; in the world, not relative to the clamp.
    #[serde(flatten)]
    pub orientation: Option<Orientation>,
    /// Force applied to the rod; 0 in held components.
    pub force: [f64; 3],
    /// Couple applied to the rod; 0 if the orientation is held.
    pub couple: [f64; 3],
    /// Common factor of force and couple; default 1.
    pub load: f64,
    /// False (the default): force and couple in the world frame. True: in the frame of the directors at the end.
    pub follower: bool,
}

fn all_free(position: &[Component; 3]) -> bool {
    *position == [Component::Free; 3]
}

impl Default for End {
    fn default() -> Self {
        Self {
            position: [Component::Free; 3],
            orientation: None,
            force: [0.0; 3],
            couple: [0.0; 3],
            load: 1.0,
            follower: false,
        }
    }
}

impl End {
    /// True if neither a component of the position nor the orientation is held.
    pub fn is_loaded(&self) -> bool {
        all_free(&self.position) && self.orientation.is_none()
    }

    /// The position, if every component is held.
    pub fn held_position(&self) -> Option<[f64; 3]> {
        let [x, y, z] = self.position.map(Component::held);
        Some([x?, y?, z?])
    }

    /// Force times [`End::load`].
    pub fn applied_force(&self) -> [f64; 3] {
        self.force.map(|x| self.load * x)
    }

    /// Couple times [`End::load`].
    pub fn applied_couple(&self) -> [f64; 3] {
        self.couple.map(|x| self.load * x)
    }
}

/// A component of the position of the end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Component {
    /// Free: the component of the force is given.
    Free,
    /// Held here.
    #[serde(untagged)]
    Held(f64),
}

impl Component {
    /// Where it is held, if it is.
    pub fn held(self) -> Option<f64> {
        match self {
            Self::Free => None,
            Self::Held(x) => Some(x),
        }
    }
}

/// Where the search begins.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Guess {
    /// Base wrench (m1, m2, m3, n1, n2, n3) in the world frame; without it, the unloaded rod.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench: Option<[f64; 6]>,
}

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solve {
    /// Tolerance of the equilibria, relative, in [1e-13, 1e-4]; default [`Solve::TOLERANCE`].
    pub tolerance: f64,
    /// The path of the computation; default [`Path::Auto`].
    pub path: Path,
}

impl Solve {
    /// Default tolerance.
    pub const TOLERANCE: f64 = 1e-10;
}

impl Default for Solve {
    fn default() -> Self {
        Self {
            tolerance: Self::TOLERANCE,
            path: Path::Auto,
        }
    }
}

/// A branch of equilibria in one parameter of the scene.
///
/// Steps are lengths along the branch, measured so that a change of the parameter alone by |to - from| has
/// length 1, and so does a change of the base wrench by [`Continue::TYPICAL`] of the rod's own units (B/L for the
/// couple, B/L^2 for the force, B a bending stiffness). Hence 0.01 is at least 100 steps from `from` to `to`, and more
/// where the wrench changes much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Continue {
    /// What varies.
    pub parameter: Parameter,
    /// Its first value; default the one in the scene.
    pub from: f64,
    /// The value at which the branch ends, not `from`.
    pub to: f64,
    /// First step; default [`Continue::STEP`], or the nearest that the bounds allow.
    pub step: f64,
    /// Shortest step, in (0, `max_step`]; default [`Continue::MIN_STEP`].
    pub min_step: f64,
    /// Longest step, at most 1; default [`Continue::MAX_STEP`].
    pub max_step: f64,
    /// A branch ends after so many points, 2..=1_000_000; default [`Continue::POINTS`].
    pub points: usize,
    /// Follow the branches that leave at branch points; default false.
    pub switch: bool,
    /// Also go the other way from `from`, as far as to 2 from - to; default false.
    pub both: bool,
    /// Look for branches that do not meet this one (deflation); default false.
    pub deflate: bool,
    /// Values of the parameter that the branch hits exactly.
    pub at: Vec<f64>,
    /// A second parameter: the curves of folds in both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second: Option<Second>,
}

impl Continue {
    /// The change of the base wrench, in B/L and B/L^2, that counts as much as the whole way of the parameter.
    pub const TYPICAL: f64 = 10.0;
    /// Default first step.
    pub const STEP: f64 = 0.01;
    /// Default shortest step.
    pub const MIN_STEP: f64 = 1e-8;
    /// Default longest step.
    pub const MAX_STEP: f64 = 0.1;
    /// Default number of points.
    pub const POINTS: usize = 200;

    /// Least and greatest value of the parameter on the branch.
    pub fn range(&self) -> (f64, f64) {
        let first = if self.both {
            2.0 * self.from - self.to
        } else {
            self.from
        };
        (first.min(self.to), first.max(self.to))
    }
}

/// The second parameter of fold curves.
///
/// The curves go through the folds of the branch, where this parameter has its value in the scene, and are followed
/// in both directions as long as both parameters stay in their ranges. Steps are measured as in [`Continue`], with
/// |to - from| of this parameter as length 1, and the way of the first parameter counting as much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Second {
    /// What varies, not the first parameter.
    pub parameter: Parameter,
    /// One end of its range; default the value in the scene.
    pub from: f64,
    /// The other end, not `from`. The value in the scene lies between them, or is one of them.
    pub to: f64,
    /// First step; default [`Continue::STEP`], or the nearest that the bounds allow.
    pub step: f64,
    /// Shortest step; default [`Continue::MIN_STEP`].
    pub min_step: f64,
    /// Longest step; default [`Second::MAX_STEP`].
    pub max_step: f64,
    /// A curve ends after so many points in each direction; default [`Second::POINTS`].
    pub points: usize,
}

impl Second {
    /// Default longest step: smooth in a figure.
    pub const MAX_STEP: f64 = 0.05;
    /// Default number of points.
    pub const POINTS: usize = 400;
}
