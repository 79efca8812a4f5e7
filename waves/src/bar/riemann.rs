//! Riemann problems of two uniform states, and of a state at an end of the bar (docs/bars.md 1, 3).

use super::{Material, Wave};
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
        let [stretch, velocity] = self.star(left, right)?;
        Ok(Star {
            stretch,
            velocity,
            stress: self.stress(stretch),
            left: self.waves(left[0], stretch),
            right: self.waves(right[0], stretch),
        })
    }

    /// \[stretch, velocity\] between the waves, see [`Material::riemann`].
    pub(super) fn star(&self, left: [f64; 2], right: [f64; 2]) -> Result<[f64; 2]> {
        self.check(left[0])?;
        self.check(right[0])?;
        let speeds = [left[0], right[0]].map(|lam| self.speed(lam));
        let apart = right[1] - left[1];
        // Guess for two weak waves.
        let guess = (apart + speeds[0] * left[0] + speeds[1] * right[0]) / (speeds[0] + speeds[1]);
        let residual = |lam: f64| {
            let (a, b) = (
                self.velocity_jump(left[0], lam),
                self.velocity_jump(right[0], lam),
            );
            Some((a.0 + b.0 - apart, a.1 + b.1))
        };
        let stretch = self.increasing(guess, residual).ok_or_else(|| {
            Error::unreachable(format!(
                "the states {left:?} and {right:?} of [stretch, velocity] meet or part so fast that no stretch between {} and {} \
                 stands between them",
                self.reach()[0],
                self.reach()[1]
            ))
        })?;
        let (a, b) = (
            self.velocity_jump(left[0], stretch).0,
            self.velocity_jump(right[0], stretch).0,
        );
        Ok([stretch, 0.5 * (left[1] + a + right[1] - b)])
    }

    /// The stretch behind the wave into the stretch `ahead` that changes the velocity by `rise`, see
    /// [`Material::velocity_jump`]: at a wall, or at a mass of known velocity.
    ///
    /// # Errors
    /// A rise that no stretch in the reach of the law gives.
    pub fn behind(&self, ahead: f64, rise: f64) -> Result<f64> {
        self.check(ahead)?;
        let residual = |lam: f64| {
            let (value, slope) = self.velocity_jump(ahead, lam);
            Some((value - rise, slope))
        };
        self.increasing(ahead + rise / self.speed(ahead), residual)
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
