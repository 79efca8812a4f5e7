//! The two ends of a rod: the clamp at the base; the supports, loads and body at the end.

use super::{BodyShape, Groove};
use crate::body::{History, Sine};
use serde::Serialize;

/// The base of the rod. Default: at the origin, the directors along the world axes, in the plane the tangent along +x.
///
/// Orientation and motion are stored in the form the scene gives them; [`Support`](crate::body::Support) is the
/// computed form.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Clamp {
    /// Position.
    pub position: [f64; 3],
    /// Orientation of the directors d1, d2, d3 in the world.
    #[serde(flatten)]
    pub orientation: Orientation,
    /// Prescribed motion; `None`: at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<ClampMotion>,
    /// True if nothing holds the base: the pose is that at the start.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
}

/// Prescribed motion of a clamp.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ClampMotion {
    /// Displacement of the clamp from [`Clamp::position`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translate: Option<Translation>,
    /// Rotation of the clamp about its position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn: Option<Turn>,
}

/// The displacement of a clamp.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Translation {
    /// Rows [t, x, y], in space [t, x, y, z], of increasing times: smooth between them, at rest before and after.
    Table(Vec<Vec<f64>>),
    /// A sine along a direction.
    Sine {
        /// Direction, not zero, of any length.
        direction: [f64; 3],
        /// Displacement along the direction as a function of time.
        #[serde(flatten)]
        sine: Sine,
    },
}

/// The rotation of a clamp, in the plane about its normal.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Turn {
    /// About an axis.
    About {
        /// Axis in the world, not zero, of any length; in the plane +z.
        axis: [f64; 3],
        /// Angle in radians: at a constant rate, a sine, or a table of angles, smooth between them and at rest before
        /// and after.
        #[serde(flatten)]
        angle: History,
    },
    /// By rotation vectors in the world.
    Vectors {
        /// Rows [t, x, y, z] of increasing times, the vectors in radians: smooth between them, at rest before and
        /// after.
        table: Vec<[f64; 4]>,
    },
}

/// A rotation that takes the world axes to the directors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// A unit quaternion [w, x, y, z].
    Quaternion([f64; 4]),
    /// In the plane: the angle of the tangent from +x towards +y, in radians.
    Angle(f64),
    /// By axis and angle; the angle can be the parameter of a branch.
    Rotation(Rotation),
}

impl Default for Orientation {
    fn default() -> Self {
        Self::Quaternion([1.0, 0.0, 0.0, 0.0])
    }
}

impl Orientation {
    /// The rotation as a unit quaternion [w, x, y, z].
    pub fn quaternion(&self) -> [f64; 4] {
        match self {
            Self::Quaternion(q) => *q,
            Self::Angle(angle) => {
                let (sin, cos) = (0.5 * angle).sin_cos();
                [cos, 0.0, 0.0, sin]
            }
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

impl Rotation {
    /// The rotation matrix.
    pub(crate) fn matrix(&self) -> nalgebra::Rotation3<f64> {
        let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::from(self.axis));
        nalgebra::Rotation3::from_axis_angle(&axis, self.angle)
    }
}

/// Supports and loads of the end, s = L: `[end]` may be empty, but not left out.
///
/// Four kinds: nothing held (a load), only the position held (a ball joint), position and orientation held (a clamp),
/// only the orientation held (guided). Single components of the position may be free. In addition to
/// [`EndConditions`](crate::rod::EndConditions), the common load factor and the scene's form of the orientation are
/// stored.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct End {
    /// Position, each component held or free.
    #[serde(skip_serializing_if = "all_free")]
    pub position: [Component; 3],
    /// Orientation of the directors at the end, in the world and not relative to the clamp; `None`: free.
    #[serde(flatten)]
    pub orientation: Option<Orientation>,
    /// Force applied to the rod; 0 in held components.
    pub force: [f64; 3],
    /// Couple applied to the rod; 0 if the orientation is held.
    pub couple: [f64; 3],
    /// Common factor of force and couple; default 1.
    pub load: f64,
    /// Frame of force and couple. False (the default): the world. True: the directors at the end (a follower load).
    pub follower: bool,
    /// Force along the directors at the end, beside the dead one; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub follower_force: [f64; 3],
    /// Couple along the directors at the end, beside the dead one; default 0.
    #[serde(skip_serializing_if = "is_none")]
    pub follower_couple: [f64; 3],
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
            follower_force: [0.0; 3],
            follower_couple: [0.0; 3],
        }
    }
}

impl End {
    /// True if neither a component of the position nor the orientation is held.
    pub fn is_loaded(&self) -> bool {
        all_free(&self.position) && self.orientation.is_none()
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
    /// Free; the force component is given.
    Free,
    /// Held at this coordinate.
    #[serde(untagged)]
    Held(f64),
}

impl Component {
    /// Coordinate at which the component is held; `None` if free.
    pub fn held(self) -> Option<f64> {
        match self {
            Self::Free => None,
            Self::Held(x) => Some(x),
        }
    }
}

/// The body at the end of the rod. Together with the loads it makes a [`PointMass`](crate::body::PointMass) or a
/// [`RigidBody`](crate::body::RigidBody).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// Mass > 0.
    pub mass: f64,
    /// Joint to the end of the rod; in the plane [`Joint::Ball`].
    #[serde(flatten)]
    pub joint: Joint,
    /// Groove in which the end of the rod slides; `None`: no groove.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groove: Option<Groove>,
    /// Shape where the body touches obstacles; `None`: a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<BodyShape>,
}

/// Joint between the body and the end of the rod.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "joint", rename_all = "lowercase")]
pub enum Joint {
    /// A point mass on an end that is free to turn.
    Ball,
    /// A rigid body welded to the end (the default).
    Weld {
        /// Centre of mass relative to the end of the rod, in components along the directors; default 0.
        offset: [f64; 3],
        /// Inertia about the centre of mass, in components along the directors, symmetric positive definite. A scene
        /// may also give the three numbers of the diagonal.
        inertia: [[f64; 3]; 3],
        /// Angular momentum of a symmetric rotor inside, relative to the body, along the directors; default 0.
        #[serde(skip_serializing_if = "is_none")]
        rotor: [f64; 3],
    },
}

/// True for a zero vector, which is left out of a written scene.
pub(super) fn is_none(vector: &[f64; 3]) -> bool {
    *vector == [0.0; 3]
}

impl Joint {
    /// True for [`Joint::Weld`].
    pub fn is_weld(&self) -> bool {
        matches!(self, Self::Weld { .. })
    }
}
