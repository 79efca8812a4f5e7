//! Rods with a free end.

use super::attachment::Attachment;
use super::body::BodyMotion;
use crate::error::Result;
use crate::rod::{Rod, RodSection, Wrench};
use nalgebra::{Isometry3, Vector3};

/// A rod held by one attachment, without load. Without mass it keeps its unloaded shape and rides on its base: it
/// bears no wrench, stores no energy and is in no equation.
#[derive(Debug, Clone)]
pub struct FreeRod {
    rod: Rod,
    pub(super) from: Attachment,
}

impl FreeRod {
    /// A rod welded to an attachment at its base, s = 0; the rod's own clamp is not used.
    pub fn new(rod: Rod, from: Attachment) -> Self {
        let rod = rod.with_clamp(Vector3::zeros(), nalgebra::UnitQuaternion::identity());
        Self { rod, from }
    }

    /// The rod.
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// Sections at `count` + 1 arclengths in the world at time `t`.
    ///
    /// # Errors
    /// As [`Rod::shape`].
    pub fn shape(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        count: usize,
        tolerance: f64,
    ) -> Result<Vec<RodSection>> {
        let at = evenly(self.rod.length(), count);
        self.sections(t, bodies, &at, tolerance)
    }

    /// Sections at arclengths in growing order in the world at time `t`.
    ///
    /// # Errors
    /// As [`Rod::shape`].
    pub(super) fn sections(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<RodSection>> {
        let sections = self.rod.shape(&Wrench::zeros(), at, tolerance)?;
        Ok(placed(sections, &self.from.at(t, bodies).pose))
    }
}

/// `count` + 1 arclengths from 0 to `length`.
pub(super) fn evenly(length: f64, count: usize) -> Vec<f64> {
    let at = (0..=count).map(|i| length * i as f64 / count.max(1) as f64);
    at.collect()
}

/// Sections relative to the base, moved into the world.
pub(super) fn placed(sections: Vec<RodSection>, base: &Isometry3<f64>) -> Vec<RodSection> {
    let turn = base.rotation.to_rotation_matrix();
    let each = sections.into_iter().map(|section| RodSection {
        position: base.translation.vector + turn * section.position,
        directors: turn.matrix() * section.directors,
        couple: turn * section.couple,
        force: turn * section.force,
        ..section
    });
    each.collect()
}
