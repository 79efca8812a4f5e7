//! Configuration of an assembly: poses and velocities of bodies, charts of rods, time and integrals.

use super::body::BodyMotion;
use super::rod_element::LinkPoint;
use crate::rod::Wrench;
use nalgebra::UnitQuaternion;

/// Poses and velocities of the bodies, and charts (m(0), n) of the rods in their bases' directors, in units B/L,
/// B/L^2.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Configuration {
    /// Poses and velocities of the bodies.
    pub bodies: Vec<BodyMotion>,
    /// Charts of the rods.
    pub charts: Vec<Wrench>,
    /// Spins about the chord of rods with mass between two ball joints, by rod, if known; or empty.
    pub spins: Vec<Option<Spin>>,
}

/// Base directors, and spin about the chord, of a rod between two ball joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spin {
    /// Directors of the base in the world.
    pub turn: UnitQuaternion<f64>,
    /// Angular velocity of the base along the chord.
    pub rate: f64,
}

impl Configuration {
    /// Spin of rod `k`, if known.
    pub fn spin(&self, k: usize) -> Option<&Spin> {
        self.spins.get(k)?.as_ref()
    }
}

/// Time and the integrals of the energy ledger.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Integrals {
    /// Time.
    pub time: f64,
    /// Work of time-dependent loads and of the supports.
    pub work: f64,
    /// Energy lost to drag.
    pub drag: f64,
}

/// A state unpacked, with its rods evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// Poses, velocities and charts.
    pub now: Configuration,
    /// Time and integrals.
    pub integrals: Integrals,
    /// The rods between their attachments.
    pub points: Vec<LinkPoint>,
}
