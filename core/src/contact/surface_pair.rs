//! Properties of a pair of surfaces: friction, restitution, and the law of impact.

use crate::error::{Error, Result};

/// The meaning of the restitution of an impact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ImpactLaw {
    /// Stronge: of the work done by the normal impulse in compression the part restitution^2 comes back.
    #[default]
    Stronge,
    /// Poisson: the normal impulse of restitution is the restitution times that of compression.
    Poisson,
    /// Newton: the normal velocity after the impact is minus the restitution times that before. With friction this
    /// law can create energy; such impacts are refused.
    Newton,
}

impl ImpactLaw {
    /// A stable key: stronge, poisson, newton.
    pub fn key(self) -> &'static str {
        match self {
            Self::Stronge => "stronge",
            Self::Poisson => "poisson",
            Self::Newton => "newton",
        }
    }
}

/// Properties of a pair of surfaces. The default has neither friction nor restitution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfacePair {
    restitution: f64,
    friction: f64,
    law: ImpactLaw,
}

impl SurfacePair {
    /// Surfaces with this restitution and this coefficient of Coulomb friction, under Stronge's law.
    ///
    /// # Errors
    /// A restitution outside [0, 1]; a friction that is negative or not finite.
    pub fn new(restitution: f64, friction: f64) -> Result<Self> {
        if !(0.0..=1.0).contains(&restitution) {
            return Err(Error::domain(format!(
                "restitution = {restitution} must lie in [0, 1]"
            )));
        }
        if !(0.0..f64::INFINITY).contains(&friction) {
            return Err(Error::domain(format!(
                "friction = {friction} must be finite and >= 0"
            )));
        }
        Ok(Self {
            restitution,
            friction,
            law: ImpactLaw::default(),
        })
    }

    /// Sets the law of impact.
    #[must_use]
    pub fn with_law(self, law: ImpactLaw) -> Self {
        Self { law, ..self }
    }

    /// The restitution, in [0, 1].
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// The coefficient of Coulomb friction, >= 0.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// The law of impact.
    pub fn law(&self) -> ImpactLaw {
        self.law
    }
}
