//! Attachments of rods' ends and the joints between them.

use super::body::BodyMotion;
use crate::body::Support;
use crate::math::se3::{halves, join};
use nalgebra::{Isometry3, Vector3, Vector6};
use std::ops::Range;

/// Carrier of an attachment.
#[derive(Debug, Clone)]
pub enum AttachedTo {
    /// The ground; the pose is in the world.
    Ground,
    /// A moving support; the pose is in the support's frame.
    Support(Box<Support<3>>),
    /// A body, by number; the pose is in the body's frame.
    Body(usize),
}

impl AttachedTo {
    /// True if both carriers keep their relative pose at all times.
    pub fn moves_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Body(a), Self::Body(b)) => a == b,
            (Self::Body(_), _) | (_, Self::Body(_)) => false,
            (Self::Ground, Self::Ground) => true,
            (Self::Ground, Self::Support(one)) | (Self::Support(one), Self::Ground) => {
                one.is_fixed()
            }
            (Self::Support(one), Self::Support(other)) => one.moves_with(other),
        }
    }
}

/// Joint between an end of a rod and its attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Joint {
    /// The directors of the rod's end turn with the attachment.
    #[default]
    Weld,
    /// The end is free to turn and bears no couple.
    Ball,
}

impl Joint {
    /// True if the joint leaves rotations of the end free.
    pub fn turns(self) -> bool {
        match self {
            Self::Weld => false,
            Self::Ball => true,
        }
    }

    /// Components of the twist of the end (rotation, position) that the joint holds.
    pub fn held(self) -> Range<usize> {
        match self {
            Self::Weld => 0..6,
            Self::Ball => 3..6,
        }
    }
}

/// Attachment of a rod's end: point and directors in the frame of the carrier.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// Carrier: ground, support or body.
    pub on: AttachedTo,
    /// Pose in the carrier's frame.
    pub place: Isometry3<f64>,
}

impl Attachment {
    /// An attachment to the ground.
    pub fn ground(place: Isometry3<f64>) -> Self {
        Self {
            on: AttachedTo::Ground,
            place,
        }
    }

    /// An attachment to a moving support, in the support's frame.
    pub fn support(support: Support<3>) -> Self {
        Self {
            on: AttachedTo::Support(Box::new(support)),
            place: Isometry3::identity(),
        }
    }

    /// An attachment to a body.
    pub fn body(number: usize, place: Isometry3<f64>) -> Self {
        Self {
            on: AttachedTo::Body(number),
            place,
        }
    }

    /// Number of the carrying body, if any.
    pub fn carried_by(&self) -> Option<usize> {
        match self.on {
            AttachedTo::Body(body) => Some(body),
            AttachedTo::Ground | AttachedTo::Support(_) => None,
        }
    }

    /// Pose and twist in the world.
    pub fn at(&self, t: f64, bodies: &[BodyMotion]) -> BodyMotion {
        match &self.on {
            AttachedTo::Ground => BodyMotion::at_rest(self.place),
            AttachedTo::Support(support) => {
                let frame = support.at(t);
                let lever = join(&Vector3::zeros(), &self.place.translation.vector);
                BodyMotion {
                    pose: frame.pose() * self.place,
                    twist: frame
                        .of_poses()
                        .absolute_velocity(&lever, &Vector6::zeros()),
                }
            }
            AttachedTo::Body(body) => {
                let BodyMotion { pose, twist } = bodies[*body];
                let (omega, v) = halves(&twist);
                let lever = pose.rotation * self.place.translation.vector;
                BodyMotion {
                    pose: pose * self.place,
                    twist: join(&omega, &(v + omega.cross(&lever))),
                }
            }
        }
    }

    /// The carrying body with the lever from its reference point, in the world.
    pub(super) fn lever(&self, bodies: &[BodyMotion]) -> Option<(usize, Vector3<f64>)> {
        let body = self.carried_by()?;
        let lever = bodies[body].pose.rotation * self.place.translation.vector;
        Some((body, lever))
    }

    /// Moves a wrench on the attachment to the reference point of its body.
    pub(super) fn moved(&self, bodies: &[BodyMotion], wrench: &Vector6<f64>) -> Vector6<f64> {
        let Some((_, lever)) = self.lever(bodies) else {
            return *wrench;
        };
        let (m, n) = halves(wrench);
        join(&(m + lever.cross(&n)), &n)
    }

    /// True if a support carries the attachment and moves.
    pub(super) fn moves(&self) -> bool {
        match &self.on {
            AttachedTo::Support(support) => !support.is_fixed(),
            AttachedTo::Ground | AttachedTo::Body(_) => false,
        }
    }

    /// First time after `t` at which the motion of a support is not smooth; infinite if none is left.
    pub(super) fn next_break(&self, t: f64) -> f64 {
        match &self.on {
            AttachedTo::Support(support) => support.next_break(t),
            AttachedTo::Ground | AttachedTo::Body(_) => f64::INFINITY,
        }
    }
}
