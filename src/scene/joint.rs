//! Joints of rod ends to bodies and to the ground, as fields of a scene.

use crate::assembly::Joint;
use serde::Serialize;

/// Joint of a rod's end to its attachment: what it leaves free, and the laws of its free axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
#[serde(tag = "joint", rename_all = "lowercase")]
pub enum SiteJoint {
    /// Holds everything.
    #[default]
    Weld,
    /// Holds the place alone: no couple.
    Ball,
    /// Free about one axis.
    Hinge(TurnAxis),
    /// Free about two axes: the first stays with the attachment, the second with the rod.
    Universal {
        /// The first axis and the law of both; the couple acts about the first.
        #[serde(flatten)]
        first: TurnAxis,
        /// Second axis, across the first, along the directors of the attachment where the joint is not turned.
        second_axis: [f64; 3],
    },
    /// Free along one direction; directors are held.
    Slider(SlideAxis),
    /// Free along one direction and to turn: a ball joint that slides.
    Roller(SlideAxis),
}

/// Axis about which a joint is free, along the directors of the attachment, with the law of its angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TurnAxis {
    /// Axis, not 0, of any length.
    pub axis: [f64; 3],
    /// Direction of an additional slide of the joint, free of force; `None`: no slide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slide: Option<[f64; 3]>,
    /// Couple about the axis on the rod; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub couple: f64,
    /// Couple per angle of a spring in the joint; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub stiffness: f64,
    /// Angle at which the spring is unloaded; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub rest: f64,
    /// Couple per rate of the angle of viscous friction in the joint; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub damping: f64,
}

/// Direction along which a joint is free, along the directors of the attachment, with the law of its shift.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlideAxis {
    /// Direction, not 0, of any length.
    pub axis: [f64; 3],
    /// Force along the direction on the rod; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub force: f64,
    /// Force per length of a spring in the joint; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub stiffness: f64,
    /// Shift at which the spring is unloaded; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub rest: f64,
    /// Force per rate of the shift of viscous friction in the joint; default 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub damping: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl SiteJoint {
    /// Joint between the rod and what the axes of this joint carry; without axes, the attachment.
    pub fn of_rod(&self) -> Joint {
        match self {
            Self::Ball | Self::Roller(_) => Joint::Ball,
            _ => Joint::Weld,
        }
    }

    /// Joint of the same look: what turns is drawn as a ball joint.
    pub fn shown(&self) -> Joint {
        match self {
            Self::Weld | Self::Slider(_) => Joint::Weld,
            _ => Joint::Ball,
        }
    }

    /// True for a joint with axes of its own.
    pub fn is_guided(&self) -> bool {
        !matches!(self, Self::Weld | Self::Ball)
    }

    /// Viscous friction of the free axes; 0 without axes.
    pub fn damping(&self) -> f64 {
        match self {
            Self::Weld | Self::Ball => 0.0,
            Self::Hinge(turn) | Self::Universal { first: turn, .. } => turn.damping,
            Self::Slider(slide) | Self::Roller(slide) => slide.damping,
        }
    }

    /// Word of the joint in a scene.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Weld => "weld",
            Self::Ball => "ball",
            Self::Hinge(_) => "hinge",
            Self::Universal { .. } => "universal joint",
            Self::Slider(_) => "slider",
            Self::Roller(_) => "roller",
        }
    }

    /// Constant couple of a turn.
    pub(super) fn couple_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Hinge(turn) | Self::Universal { first: turn, .. } => Some(&mut turn.couple),
            _ => None,
        }
    }

    /// Constant force of a slide.
    pub(super) fn force_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Slider(slide) | Self::Roller(slide) => Some(&mut slide.force),
            _ => None,
        }
    }
}
