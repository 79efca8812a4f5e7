//! Fixed obstacles, and the surfaces of rods with mass and of their bodies, which touch the obstacles and each other.

use crate::contact::Obstacle;
use crate::error::{Error, Result};
use nalgebra::{Isometry3, Vector3};

/// Largest and least width of the barrier, in lengths of the shortest rod.
const WIDEST: f64 = 0.05;
const NARROWEST: f64 = 1e-8;

/// A round surface that touches obstacles: the sections of a rod, or a ball or point on a body.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundSurface {
    /// Radius; 0 for a line or a point.
    pub radius: f64,
    /// Coefficient of friction with each obstacle; `None` for an obstacle that is passed through.
    pub friction: Vec<Option<f64>>,
}

/// The body that carries a ball or point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bearer {
    /// The listed body of this number.
    Listed(usize),
    /// The unnamed body at the free end of a rod, by the number of the rod.
    EndOf(usize),
}

/// A ball or point on a body.
#[derive(Debug, Clone, PartialEq)]
pub struct BallOnBody {
    /// The body.
    pub on: Bearer,
    /// Place of the centre in the frame of the body.
    pub centre: Vector3<f64>,
    /// Mass of the body.
    pub mass: f64,
    /// The surface.
    pub surface: RoundSurface,
}

/// Fixed obstacles, and the surfaces of rods and bodies that touch obstacles through a barrier of small width. Rods
/// touch each other and themselves through the same barrier.
#[derive(Debug, Clone)]
pub struct ObstaclesOfRods {
    /// The obstacles, in the frame of the motion.
    pub obstacles: Vec<Obstacle>,
    /// The frame of the motion in the world.
    pub frame: Isometry3<f64>,
    /// Surface of each rod.
    pub rods: Vec<RoundSurface>,
    /// Coefficient of friction of each rod with each rod; `None` for rods that pass through each other. Empty where no
    /// rods touch each other.
    pub between: Vec<Vec<Option<f64>>>,
    /// Balls and points on bodies.
    pub balls: Vec<BallOnBody>,
    /// Distance from a surface within which the barrier pushes.
    pub gap: f64,
    /// Displacement at which friction has its full size. Sticking surfaces give way by less.
    pub stick: f64,
}

impl ObstaclesOfRods {
    /// Checks the numbers; `length` is that of the shortest rod.
    ///
    /// # Errors
    /// A width of the barrier outside of [1e-8, 0.05] rod lengths; a displacement of sticking surfaces that is not
    /// positive and finite; a radius or a coefficient that is negative or not finite; a list of another length; rods
    /// without thickness that touch each other.
    pub fn checked(self, length: f64) -> Result<Self> {
        if !(NARROWEST * length..=WIDEST * length).contains(&self.gap) {
            return Err(Error::domain(format!(
                "the gap of the barrier = {} rod lengths must lie in [{NARROWEST}, {WIDEST}]",
                self.gap / length
            )));
        }
        if !(self.stick > 0.0 && self.stick.is_finite()) {
            return Err(Error::domain(format!(
                "the displacement of sticking surfaces = {} must be finite and > 0",
                self.stick
            )));
        }
        for surface in self.surfaces() {
            let coefficients = surface.friction.iter().flatten();
            let mut numbers = coefficients.chain([&surface.radius]);
            if !numbers.all(|x| (0.0..f64::INFINITY).contains(x)) {
                return Err(Error::domain(
                    "radii and coefficients of friction must be finite and >= 0",
                ));
            }
            if surface.friction.len() != self.obstacles.len() {
                return Err(Error::domain(format!(
                    "{} coefficients of friction for {} obstacles",
                    surface.friction.len(),
                    self.obstacles.len()
                )));
            }
        }
        let rubbing = self.between.iter().flatten().flatten();
        if !rubbing
            .into_iter()
            .all(|x| (0.0..f64::INFINITY).contains(x))
        {
            return Err(Error::domain(
                "coefficients of friction of two rods must be finite and >= 0",
            ));
        }
        let count = self.rods.len();
        let sized = self.between.iter().all(|row| row.len() == count);
        if !(self.between.is_empty() || sized && self.between.len() == count) {
            return Err(Error::domain(
                "the coefficients of friction of rods with each other must be a square table of the rods",
            ));
        }
        if !(self.thinnest_pair() > 0.0) {
            return Err(Error::domain(
                "rods that touch each other must have a thickness",
            ));
        }
        Ok(self)
    }

    /// Coefficient of friction of two rods, or of a rod with itself; `None` if the two pass through each other.
    pub fn between(&self, rod: usize, other: usize) -> Option<f64> {
        *self.between.get(rod)?.get(other)?
    }

    /// True if rods touch each other or themselves.
    pub fn rods_meet(&self) -> bool {
        self.between.iter().flatten().any(Option::is_some)
    }

    /// True if rods rub on each other.
    pub fn rods_rub(&self) -> bool {
        let mut all = self.between.iter().flatten().flatten();
        all.any(|friction| *friction > 0.0)
    }

    /// Least sum of two radii, over the rods that touch each other; infinite without any.
    pub fn thinnest_pair(&self) -> f64 {
        let pairs = (0..self.rods.len()).flat_map(|k| (0..self.rods.len()).map(move |l| (k, l)));
        let met = pairs.filter(|(k, l)| self.between(*k, *l).is_some());
        let each = met.map(|(k, l)| self.rods[k].radius + self.rods[l].radius);
        each.fold(f64::INFINITY, f64::min)
    }

    /// The least radius of an obstacle with that of a rod that touches the obstacle; infinite for planes and tubes.
    pub fn thinnest(&self) -> f64 {
        let each = self.rods.iter().flat_map(|surface| {
            let pairs = self.obstacles.iter().zip(&surface.friction);
            let touched = pairs.filter(|(_, friction)| friction.is_some());
            touched.map(|(obstacle, _)| obstacle.least_radius() + surface.radius)
        });
        each.fold(f64::INFINITY, f64::min)
    }

    /// True if something rubs.
    pub fn rubs(&self) -> bool {
        let mut all = self
            .surfaces()
            .flat_map(|surface| surface.friction.iter().flatten());
        self.rods_rub() || all.any(|friction| *friction > 0.0)
    }

    fn surfaces(&self) -> impl Iterator<Item = &RoundSurface> {
        let balls = self.balls.iter().map(|ball| &ball.surface);
        self.rods.iter().chain(balls)
    }
}
