//! Loads along a rod at the nodes of its grid, per length, in the frame of the clamp and the units of the rod.

use crate::rod::{DistributedLoad, LoadsWithoutPotential};
use nalgebra::{Matrix3, Vector3};

/// Loads at the nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadsAtNodes {
    /// Dead force at each node.
    pub dead: Vec<Vector3<f64>>,
    /// Load without a potential at each node; empty without such loads.
    pub turning: Vec<TurningAtNode>,
}

/// Load without a potential at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningAtNode {
    /// Force along the directors.
    force: Vector3<f64>,
    /// Couple in the frame of the clamp.
    couple: Vector3<f64>,
    /// Couple along the directors.
    turning_couple: Vector3<f64>,
}

impl LoadsAtNodes {
    /// The loads at points in [0, 1]; `None` without a load.
    pub fn new(
        dead: Option<&DistributedLoad>,
        turning: Option<&LoadsWithoutPotential>,
        places: &[f64],
    ) -> Option<Self> {
        if dead.is_none() && turning.is_none() {
            return None;
        }
        let force = |s: &f64| dead.map_or_else(Vector3::zeros, |load| load.density(*s));
        let one = |loads: &LoadsWithoutPotential, s: f64| TurningAtNode {
            force: loads.follower_force.density(s),
            couple: loads.couple.density(s),
            turning_couple: loads.follower_couple.density(s),
        };
        Some(Self {
            dead: places.iter().map(force).collect(),
            turning: turning.map_or_else(Vec::new, |loads| {
                places.iter().map(|s| one(loads, *s)).collect()
            }),
        })
    }
}

impl TurningAtNode {
    /// Force in the frame of the clamp at a section with these directors.
    pub fn force_at(&self, directors: &Matrix3<f64>) -> Vector3<f64> {
        directors * self.force
    }

    /// Couple in the frame of the clamp at a section with these directors.
    pub fn couple_at(&self, directors: &Matrix3<f64>) -> Vector3<f64> {
        self.couple + self.turned_couple_at(directors)
    }

    /// The part of the couple that turns with the section.
    pub fn turned_couple_at(&self, directors: &Matrix3<f64>) -> Vector3<f64> {
        directors * self.turning_couple
    }
}
