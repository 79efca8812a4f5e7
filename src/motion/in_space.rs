//! What a state of a motion in space shows, whether the rod has strains to integrate or is an exact reduction.

use super::Ledger;
use super::creep::ViscousSample;
use super::reduction::ReducedSample;
use crate::creep::grid::Grid;
use crate::creep::kinematics::{Kinematics, Local};
use crate::creep::space::{Curve, Space};
use crate::math::se3::joined;
use crate::section::Strain;
use nalgebra::{Isometry3, Rotation3, Vector3, Vector6};

/// A state of a motion in space, in the frame of the clamp and in the units of the run (length 1).
pub trait InSpace {
    /// Time.
    fn time(&self) -> f64;

    /// Pose of the end.
    fn pose(&self) -> Isometry3<f64>;

    /// (angular velocity of the end's directors, velocity of the end).
    fn twist(&self) -> Vector6<f64>;

    /// (couple, force) of the rod on the body: minus the end wrench w1.
    fn action(&self) -> Vector6<f64>;

    /// Energies.
    fn ledger(&self) -> Ledger;

    /// How far the rod is from equilibrium, in [0, 1], as [`ViscousSample::distance`]; 0 for a reduction, whose sections
    /// move alike.
    fn distance(&self) -> f64;

    /// The six strains at places in [0, 1], in growing order.
    fn strains_at(&self, places: &[f64]) -> Vec<Strain>;

    /// Dissipation per length and time at places in [0, 1], in growing order.
    fn dissipation_at(&self, places: &[f64]) -> Vec<f64>;

    /// Sections from the clamp to the end, `points` on every element beside the two ends; empty if the strains give no
    /// shape.
    fn sections(&self, points: usize) -> Vec<Isometry3<f64>>;
}

impl<const M: usize, const D: usize> InSpace for ViscousSample<Space<M, D>, M, D> {
    fn time(&self) -> f64 {
        self.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.pose
    }

    fn twist(&self) -> Vector6<f64> {
        let velocity: Vector3<f64> = self.velocity.fixed_rows::<3>(D - 3).into_owned();
        let spin = if D == 6 {
            self.velocity.fixed_rows::<3>(0).into_owned()
        } else {
            // omega(1) = int R u_t ds.
            let directors = self.configuration.shape.directors().iter();
            directors
                .zip(&self.flow.rates)
                .zip(self.grid.weights())
                .fold(Vector3::zeros(), |sum, ((frame, rate), weight)| {
                    sum + frame * rate.fixed_rows::<3>(0) * *weight
                })
        };
        joined(&spin, &velocity)
    }

    fn action(&self) -> Vector6<f64> {
        let force: Vector3<f64> = self.flow.wrench.fixed_rows::<3>(D - 3).into_owned();
        let couple = if D == 6 {
            self.flow.wrench.fixed_rows::<3>(0).into_owned()
        } else {
            Vector3::zeros()
        };
        -joined(&couple, &force)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn distance(&self) -> f64 {
        self.distance()
    }

    fn strains_at(&self, places: &[f64]) -> Vec<Strain> {
        let active: Vec<Local<M>> = self.strains_at(places);
        let space = Space::<M, D>::new();
        active.iter().map(|e| space.strain(e)).collect()
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        self.dissipation_at(places)
    }

    fn sections(&self, points: usize) -> Vec<Isometry3<f64>> {
        let counts = vec![points.max(8); self.grid.elements().len()];
        let fine = Grid::new(&self.grid.breaks(), &counts);
        let strains = self.grid.carried(&self.configuration.strains, &fine);
        framed(Space::<M, D>::new().shape(&fine, &strains))
    }
}

impl InSpace for ReducedSample {
    fn time(&self) -> f64 {
        self.time
    }

    fn pose(&self) -> Isometry3<f64> {
        self.pose
    }

    fn twist(&self) -> Vector6<f64> {
        self.velocity
    }

    fn action(&self) -> Vector6<f64> {
        -self.wrench
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn distance(&self) -> f64 {
        0.0
    }

    fn strains_at(&self, places: &[f64]) -> Vec<Strain> {
        vec![self.strain; places.len()]
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        vec![self.friction; places.len()]
    }

    fn sections(&self, points: usize) -> Vec<Isometry3<f64>> {
        let grid = Grid::uniform(points.max(8));
        framed(Space::<6, 6>::new().shape(&grid, &vec![self.strain; grid.len()]))
    }
}

/// The sections of a curve, with those at its ends.
fn framed(curve: Option<Curve>) -> Vec<Isometry3<f64>> {
    let Some(curve) = curve else {
        return Vec::new();
    };
    let nodes = curve.positions().iter().zip(curve.directors());
    let inner = nodes.map(|(r, frame)| {
        Isometry3::from_parts((*r).into(), Rotation3::from_matrix_unchecked(*frame).into())
    });
    std::iter::once(Isometry3::identity())
        .chain(inner)
        .chain([*curve.end()])
        .collect()
}
