//! Rods as equilibrium manifolds (theory Sec. 1): a body on a ball joint in dimension 3, a welded body in dimension
//! 6.

use super::free_end::FreeEndTrial;
use super::problem::{EndConditions, Problem};
use super::scaled_law::ScaledLaw;
use super::{Rod, ivp};
use crate::error::Result;
use crate::manifold::{EquilibriumManifold, ManifoldPoint};
use crate::math::se3::{halves, join, rotation_vector};
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

/// A rod that holds a point: chart q = force on the rod's end along its directors, in units B/L^2; pose = position of
/// the end in the world; m(L) = 0.
#[derive(Debug, Clone)]
pub struct BallJointed {
    rod: Rod,
    reversed: ScaledLaw,
    tolerance: f64,
}

/// A rod that holds a body welded to it: chart q = base wrench (m(0), n) along the clamp's axes, in units B/L and
/// B/L^2; pose = (rotation vector of the end's directors, position of the end) in the world.
///
/// Rows of the Jacobian are the spin of the directors and the velocity of the end; the force is the couple and force
/// of the rod on the body. [`EquilibriumManifold::gap`] compares rotations as rotations.
#[derive(Debug, Clone)]
pub struct Welded {
    rod: Rod,
    tolerance: f64,
}

impl BallJointed {
    /// `tolerance` is that of the integration along the rod, in [1e-14, 1e-3].
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-3].
    pub fn new(rod: Rod, tolerance: f64) -> Result<Self> {
        check(&rod, tolerance)?;
        Ok(Self {
            reversed: rod.law.reversed(),
            rod,
            tolerance,
        })
    }
}

impl Welded {
    /// `tolerance` is that of the integration along the rod, in [1e-14, 1e-3].
    ///
    /// # Errors
    /// A tolerance outside [1e-14, 1e-3].
    pub fn new(rod: Rod, tolerance: f64) -> Result<Self> {
        check(&rod, tolerance)?;
        Ok(Self { rod, tolerance })
    }
}

fn check(rod: &Rod, tolerance: f64) -> Result<()> {
    Problem::new(
        rod.clone(),
        EndConditions::load(Vector3::zeros(), Vector3::zeros()),
        tolerance,
    )
    .map(|_| ())
}

impl EquilibriumManifold<3> for BallJointed {
    fn point(&self, q: &Vector3<f64>) -> Option<ManifoldPoint<3>> {
        let at = FreeEndTrial::new::<3>(&self.reversed, q, self.tolerance).ok()?;
        let (couple, force) = self.rod.units();
        let turn = self.rod.clamp.rotation.to_rotation_matrix();
        let length = self.rod.length;
        Some(ManifoldPoint {
            pose: self.rod.clamp.translation.vector + turn * at.r * length,
            force: turn * at.n * -force,
            energy: at.energy * couple,
            jacobian: turn.matrix() * at.d_r * length,
            pace: length.powi(3) / (1.0 + q.norm()),
        })
    }

    fn index(&self, q: &Vector3<f64>) -> Result<usize> {
        let at = FreeEndTrial::new::<0>(&self.reversed, q, self.tolerance)?;
        let turn = self.rod.clamp.rotation;
        let end = self.rod.clamp.translation.vector + turn * at.r * self.rod.length;
        Problem::unchecked(self.rod.clone(), EndConditions::ball(end), self.tolerance)
            .index(&at.wrench())
    }
}

impl EquilibriumManifold<6> for Welded {
    fn point(&self, q: &Vector6<f64>) -> Option<ManifoldPoint<6>> {
        let (at, _) = ivp::end::<6>(&self.rod.law, q, self.tolerance).ok()?;
        let (couple, force) = self.rod.units();
        let turn = *self.rod.clamp.rotation.to_rotation_matrix().matrix();
        let length = self.rod.length;
        let (m, n) = halves(q);
        let m = m - at.position().cross(&n);
        let block = |row: usize, column: usize| {
            turn * Matrix3::from_fn(|i, j| at.tangent[row + i][column + j])
        };
        let mut jacobian = Matrix6::zeros();
        for (row, scale) in [(0, 1.0), (3, length)] {
            for column in [0, 3] {
                jacobian
                    .fixed_view_mut::<3, 3>(row, column)
                    .copy_from(&(block(row, column) * scale));
            }
        }
        let (turned, place) = (
            rotation_vector(&(turn * at.rotation())),
            self.rod.clamp.translation.vector + turn * at.position() * length,
        );
        let (m, n) = (turn * m * -couple, turn * n * -force);
        Some(ManifoldPoint {
            pose: join(&turned, &place),
            force: join(&m, &n),
            energy: at.energy() * couple,
            jacobian,
            pace: length.powi(3) / (1.0 + q.norm()),
        })
    }

    fn index(&self, q: &Vector6<f64>) -> Result<usize> {
        let section =
            self.rod
                .outward(&ivp::end::<0>(&self.rod.law, q, self.tolerance)?.0, q, &())?;
        let rotation = Rotation3::from_matrix_unchecked(section.directors);
        let end = EndConditions::pose(section.position, rotation.into());
        Problem::unchecked(self.rod.clone(), end, self.tolerance).index(q)
    }

    fn gap(&self, at: &ManifoldPoint<6>, pose: &Vector6<f64>) -> Vector6<f64> {
        let rotation = |pose: &Vector6<f64>| Rotation3::new(halves(pose).0);
        let turn = rotation(pose) * rotation(&at.pose).inverse();
        join(
            &rotation_vector(turn.matrix()),
            &(halves(pose).1 - halves(&at.pose).1),
        )
    }
}
