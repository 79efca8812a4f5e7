//! Loads without a potential on a piece of a rod with mass: couples, and loads that turn with the section.

use crate::body::{History, RigidBody, TimeLoad};
use crate::error::Result;
use crate::math::se3::{Turn, frame, join};
use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Distance, over the length of the rod, within which a load at one place belongs to a node.
const SAME_PLACE: f64 = 1e-9;

/// Load on a piece of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurningLoad {
    /// Force along the directors.
    pub force: Vector3<f64>,
    /// Couple in the frame of the assembly.
    couple: Vector3<f64>,
    /// Couple along the directors.
    turning_couple: Vector3<f64>,
}

impl TurningLoad {
    fn of(loads: &LoadsWithoutPotential, of: impl Fn(&DistributedLoad) -> Vector3<f64>) -> Self {
        Self {
            force: of(&loads.follower_force),
            couple: of(&loads.couple),
            turning_couple: of(&loads.follower_couple),
        }
    }

    /// The load on pieces (s, length of the piece) of a rod.
    pub fn on_pieces(loads: &LoadsWithoutPotential, pieces: &[(f64, f64)]) -> Self {
        Self::of(loads, |load| {
            let pieces = pieces.iter();
            pieces.fold(Vector3::zeros(), |sum, (s, length)| {
                sum + load.density(*s) * *length
            })
        })
    }

    /// Adds the loads at the single place s of a rod of this length.
    pub fn with_place(mut self, loads: &LoadsWithoutPotential, s: f64, length: f64) -> Self {
        let at = Self::of(loads, |load| at_place(load, s) * length);
        self.force += at.force;
        self.couple += at.couple;
        self.turning_couple += at.turning_couple;
        self
    }

    /// (couple, force) on a piece with this rotation.
    pub fn wrench(&self, turn: &Turn) -> Vector6<f64> {
        let directors = frame(turn);
        join(
            &(self.couple + directors * self.turning_couple),
            &(directors * self.force),
        )
    }

    /// Derivative of minus the wrench by the displacement of the piece: a turn phi changes R c by phi x R c.
    pub fn stiffness(&self, turn: &Turn) -> Matrix6<f64> {
        let directors = frame(turn);
        let mut by = Matrix6::zeros();
        by.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(directors * self.turning_couple).cross_matrix());
        by.fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&(directors * self.force).cross_matrix());
        by
    }

    /// The piece under this load.
    ///
    /// # Errors
    /// An infinite load or NaN.
    pub fn on(&self, piece: RigidBody) -> Result<RigidBody> {
        let constant = |load| TimeLoad::new(load, History::Constant(1.0));
        Ok(piece
            .with_dead_couple(self.couple)?
            .with_follower_force(constant(self.force)?)
            .with_follower_couple(constant(self.turning_couple)?))
    }
}

/// The force, over the length of the rod, of a load at the single place s.
pub(super) fn at_place(load: &DistributedLoad, s: f64) -> Vector3<f64> {
    let near = load
        .points()
        .filter(|(place, _)| (place - s).abs() < SAME_PLACE);
    near.fold(Vector3::zeros(), |sum, (_, force)| sum + force)
}
