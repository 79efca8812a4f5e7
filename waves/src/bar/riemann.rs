//! Riemann problems of two uniform states, and of a state at an end of the bar (docs/bars.md 1, 3).

use super::{Law1d, Material, Wave};
use snaprod_core::error::{Error, Result};

/// The state between the two waves of a Riemann problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Star {
    /// Stretch.
    pub stretch: f64,
    /// Velocity.
    pub velocity: f64,
    /// Stress.
    pub stress: f64,
    /// The parts of the wave towards -X, the foremost first.
    pub left: Vec<Wave>,
    /// The parts of the wave towards +X, the foremost first.
    pub right: Vec<Wave>,
}

impl Material {
    /// Solves the Riemann problem of the states \[stretch, velocity\] `left` and `right` exactly.
    ///
    /// # Errors
    /// States outside the reach of the law; states that part or meet so fast that the state between is outside.
    pub fn riemann(&self, left: [f64; 2], right: [f64; 2]) -> Result<Star> {
        let [stretch, velocity] = self.between(left, right)?;
        Ok(Star {
            stretch,
            velocity,
            stress: self.stress(stretch),
            left: self.waves(left[0], stretch),
            right: self.waves(right[0], stretch),
        })
    }

    /// \[stretch, velocity\] between the waves, see [`Material::riemann`].
    pub(super) fn between(&self, left: [f64; 2], right: [f64; 2]) -> Result<[f64; 2]> {
        self.check(left[0])?;
        self.check(right[0])?;
        self.star(left, right).ok_or_else(|| {
            Error::unreachable(format!(
                "the states {left:?} and {right:?} of [stretch, velocity] meet or part so fast that no stretch between {} and {} \
                 stands between them",
                self.reach()[0],
                self.reach()[1]
            ))
        })
    }

    /// The stretch behind the wave into the stretch `ahead` that changes the velocity by `rise`, see
    /// [`Law1d::velocity_jump`]: at a wall, or at a mass of known velocity.
    ///
    /// # Errors
    /// A rise that no stretch in the reach of the law gives.
    pub fn behind(&self, ahead: f64, rise: f64) -> Result<f64> {
        self.check(ahead)?;
        self.stretch_behind(ahead, rise)
            .ok_or_else(|| {
                Error::unreachable(format!(
                    "no wave into the stretch {ahead} changes the velocity by {rise}: the stretch would leave ({}, {}), where the \
                     stress of the bar grows",
                    self.reach()[0],
                    self.reach()[1]
                ))
            })
    }
}
