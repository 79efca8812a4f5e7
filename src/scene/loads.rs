//! Loads of a scene on the body; in statics, along the rod.

use super::Rod;
use crate::body::{History, LoadFunction};
use crate::error::Result;
use crate::rod::DistributedLoad;
use nalgebra::Vector3;
use serde::Serialize;

/// Loads on the body, in the world; in statics, where no body exists, on the rod. Every default is zero.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Loads {
    /// Acceleration of gravity: force mass * gravity at the centre of mass; in statics on the mass of the rod.
    pub gravity: [f64; 3],
    /// Constant force at the centre of mass.
    pub dead: [f64; 3],
    /// Dead force per length of the unloaded rod.
    #[serde(skip_serializing_if = "LoadAlong::is_zero")]
    pub distributed: LoadAlong,
    /// In statics: force per length of the unloaded rod along its directors, with which it turns.
    #[serde(skip_serializing_if = "LoadAlong::is_zero")]
    pub follower: LoadAlong,
    /// In statics: the common factor of gravity and forces along the rod; default 1.
    pub load: f64,
    /// Couple; 0 for a point mass.
    pub couple: Load,
    /// Drag coefficient >= 0: force -drag * velocity of the centre of mass, at the centre of mass.
    pub drag: f64,
    /// Rotational drag >= 0: couple -rotational_drag * angular velocity on a welded body.
    pub rotational_drag: f64,
    /// Time-dependent forces at the centre of mass, added up.
    pub force: Vec<Force>,
    /// Functions of time and of the motion: [`Scene::act`](super::Scene::act).
    #[serde(skip)]
    pub functions: Vec<LoadFunction>,
}

impl Default for Loads {
    fn default() -> Self {
        Self {
            gravity: [0.0; 3],
            dead: [0.0; 3],
            distributed: LoadAlong::default(),
            follower: LoadAlong::default(),
            load: 1.0,
            couple: Load::default(),
            drag: 0.0,
            rotational_drag: 0.0,
            force: Vec::new(),
            functions: Vec::new(),
        }
    }
}

/// A force per length of the unloaded rod, along the axes of the world, or along the directors for one that turns.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LoadAlong {
    /// Uniform along the rod.
    Constant([f64; 3]),
    /// A polynomial in s/length.
    Polynomial {
        /// Coefficients c0, c1, ... of the polynomial.
        polynomial: Vec<[f64; 3]>,
    },
    /// Piecewise linear along the rod.
    Table {
        /// Rows (s, force per length at s), s increasing from 0 to the length.
        table: Vec<[f64; 4]>,
    },
}

impl Default for LoadAlong {
    fn default() -> Self {
        Self::Constant([0.0; 3])
    }
}

impl LoadAlong {
    /// True if the load vanishes.
    pub fn is_zero(&self) -> bool {
        let none = |force: &[f64]| force.iter().all(|x| *x == 0.0);
        match self {
            Self::Constant(force) => none(force),
            Self::Polynomial { polynomial } => none(polynomial.as_flattened()),
            Self::Table { table } => table.iter().all(|row| none(&row[1..])),
        }
    }

    /// The load on a rod of this length, in the form of the solver.
    ///
    /// # Errors
    /// As [`DistributedLoad::table`].
    pub fn on(&self, length: f64) -> Result<DistributedLoad> {
        match self {
            Self::Constant(force) => DistributedLoad::constant((*force).into()),
            Self::Polynomial { polynomial } => {
                DistributedLoad::polynomial(polynomial.iter().map(|c| (*c).into()).collect())
            }
            Self::Table { table } => {
                let row = |row: &[f64; 4]| (row[0] / length, Vector3::new(row[1], row[2], row[3]));
                let mut rows: Vec<_> = table.iter().map(row).collect();
                if let Some(last) = rows.last_mut() {
                    // The reader has checked that the last s equals the length; 1.0 avoids the rounding of the
                    // division.
                    last.0 = 1.0;
                }
                DistributedLoad::table(&rows)
            }
        }
    }

    /// The load together with the weight of a rod under gravity, and the dead forces of the list; `None` if all vanish.
    ///
    /// # Errors
    /// As [`LoadAlong::on`]; a weight that is not finite.
    pub fn with_weight(&self, rod: &Rod, gravity: [f64; 3]) -> Result<Option<DistributedLoad>> {
        let whole = self.and_weight(rod, gravity)?.plus(&rod.dead_forces()?)?;
        Ok(Some(whole).filter(|load| !load.is_zero()))
    }

    /// The load together with the weight of a rod under gravity.
    ///
    /// # Errors
    /// As [`LoadAlong::on`]; a weight that is not finite.
    pub(super) fn and_weight(&self, rod: &Rod, gravity: [f64; 3]) -> Result<DistributedLoad> {
        let density = rod.mass().map_or(0.0, |mass| mass / rod.length);
        let mean = Vector3::from(gravity) * density;
        let weight = match rod.mass_along() {
            Some(along) => DistributedLoad::along(mean, along.density())?,
            None => DistributedLoad::constant(mean)?,
        };
        if self.is_zero() {
            Ok(weight)
        } else {
            weight.plus(&self.on(rod.length)?)
        }
    }
}

/// A force or a couple on a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Load {
    /// Constant, in the world.
    Constant([f64; 3]),
    /// Sum of forces that vary in time or turn with the body.
    InTime(Vec<Force>),
}

impl Default for Load {
    fn default() -> Self {
        Self::Constant([0.0; 3])
    }
}

impl Load {
    /// The constant part of the load.
    pub fn constant(&self) -> [f64; 3] {
        match self {
            Self::Constant(vector) => *vector,
            Self::InTime(_) => [0.0; 3],
        }
    }

    /// Adds loads to this one.
    pub(super) fn extend(&mut self, more: Vec<Force>) {
        if more.is_empty() {
            return;
        }
        let is_dead = |part: &Force| !(part.follower || part.varies());
        if let Self::Constant(vector) = self
            && more.iter().all(is_dead)
        {
            for part in more {
                let size = part.size.at(0.0);
                let unit = part.unit();
                *vector = std::array::from_fn(|i| vector[i] + unit[i] * size);
            }
            return;
        }
        let mut parts = match std::mem::take(self) {
            Self::Constant(vector) if vector == [0.0; 3] => Vec::new(),
            Self::Constant(vector) => vec![Force::constant(vector, false)],
            Self::InTime(parts) => parts,
        };
        parts.extend(more);
        *self = Self::InTime(parts);
    }

    /// True if the load vanishes.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The parts that vary in time or turn with the body.
    pub fn in_time(&self) -> &[Force] {
        match self {
            Self::Constant(_) => &[],
            Self::InTime(parts) => parts,
        }
    }
}

/// A force or a couple along a direction, as a function of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Force {
    /// Direction, not zero, of any length: only [`Force::unit`] enters the force.
    pub direction: [f64; 3],
    /// Size as a function of time. A custom one is in units of the rod and is not written to a scene.
    #[serde(flatten)]
    pub size: History,
    /// Frame of the direction. False (the default): the world. True: the body (a follower load).
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub follower: bool,
}

impl Loads {
    /// True if a load changes in time.
    pub fn vary(&self) -> bool {
        self.force
            .iter()
            .chain(self.couple.in_time())
            .any(Force::varies)
    }
}

impl Force {
    /// A constant force, not zero, in the world or along the directors of a body.
    pub fn constant(vector: [f64; 3], follower: bool) -> Self {
        let size = vector.iter().fold(0.0_f64, |size, x| size.hypot(*x));
        Self {
            direction: vector,
            size: History::Constant(size),
            follower,
        }
    }

    /// True if the size changes in time.
    pub fn varies(&self) -> bool {
        !matches!(self.size, History::Constant(_))
    }

    /// The direction at unit length.
    pub fn unit(&self) -> [f64; 3] {
        // Division by the largest component keeps the norm from overflow and underflow.
        let size = self
            .direction
            .iter()
            .fold(0.0_f64, |size, x| size.max(x.abs()));
        let scaled = self.direction.map(|x| x / size);
        let norm = scaled.iter().fold(0.0_f64, |norm, x| norm.hypot(*x));
        scaled.map(|x| x / norm)
    }
}
