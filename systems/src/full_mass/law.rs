//! Section law, elastic or with friction, restricted to the free strains.

use crate::error::{Error, Result};
use crate::section::rate::{Maxwell, RateLaw};
use crate::section::{LawInTime, SectionLaw, Strain};
use nalgebra::{DMatrix, Matrix6};
use std::borrow::Cow;
use std::sync::Arc;

/// A section law in the units of the rod, with the strains that can change.
#[derive(Debug, Clone)]
pub struct Law {
    elastic: Arc<dyn SectionLaw>,
    /// The elastic law of every moment, where tensions or rest strains are histories in time.
    in_time: Option<Arc<LawInTime>>,
    friction: Option<Arc<dyn RateLaw>>,
    branches: Vec<Maxwell>,
    active: Vec<usize>,
    length: f64,
    /// d D/d e_t of a uniform linear friction, formed once.
    viscosity: Option<Matrix6<f64>>,
}

/// Energy, resultants and loss of a section at given strains and rates.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// Stored energy per length, including the springs of Maxwell branches.
    pub energy: f64,
    /// dW/de, including the springs of Maxwell branches.
    pub elastic: Strain,
    /// Friction D(e, e_t).
    pub friction: Strain,
    /// Energy lost per length and time, including the dashpots of Maxwell branches.
    pub loss: f64,
    /// Power per length of what changes the law, at fixed strains.
    pub power: f64,
}

/// Derivatives of dW/de + D(e, e_t).
#[derive(Debug, Clone, Copy)]
pub struct Stiffness {
    /// By the strains.
    pub by_strain: Matrix6<f64>,
    /// By the rates.
    pub by_rate: Matrix6<f64>,
}

impl Law {
    /// The elastic law with friction, if any, for the strains `active` (indices among u1 .. v3, in growing order).
    ///
    /// # Errors
    /// A law without an unloaded state at s = 0; an active strain that is held rigid; friction whose viscosity has no
    /// inverse.
    pub fn new(
        elastic: Arc<dyn SectionLaw>,
        friction: Option<Arc<dyn RateLaw>>,
        active: &[usize],
    ) -> Result<Self> {
        let rigid = elastic.rigid();
        if let Some(k) = active.iter().find(|k| rigid[**k]) {
            return Err(Error::domain(format!(
                "the strain number {k} of (u1, u2, u3, v1, v2, v3) is held rigid and cannot be an active one"
            )));
        }
        elastic.unloaded(0.0)?;
        let mut law = Self {
            elastic,
            in_time: None,
            friction: None,
            branches: Vec::new(),
            length: 1.0,
            active: active.to_vec(),
            viscosity: None,
        };
        if let Some(friction) = friction {
            if let Some(fluidity) = friction.uniform_fluidity() {
                law.viscosity = Some(law.inverse(&fluidity)?);
            }
            law.friction = Some(friction);
        }
        Ok(law)
    }

    /// Sets the length of the rod, over which the law's own arclength runs; s is always from 0 to 1. The default
    /// length is 1.
    #[must_use]
    pub fn along(mut self, length: f64) -> Self {
        self.length = length;
        self
    }

    /// Lets the elastic law vary in time. The law given before is that at the time 0, in the same units.
    #[must_use]
    pub fn with_law_in_time(mut self, law: Option<LawInTime>) -> Self {
        self.in_time = law.map(Arc::new);
        self
    }

    /// True if the elastic law varies in time.
    pub fn varies_in_time(&self) -> bool {
        self.in_time.is_some()
    }

    /// The law of the time `t`; None where it is not defined.
    pub fn seen_at(&self, t: f64) -> Option<Cow<'_, Self>> {
        let mut seen = Cow::Borrowed(self);
        if let Some(in_time) = &self.in_time {
            seen.to_mut().elastic = in_time.at(t).ok()?;
        }
        Some(seen)
    }

    /// First time after `t` at which the law does not vary smoothly.
    pub fn next_break(&self, t: f64) -> f64 {
        let in_time = self.in_time.as_ref();
        in_time.map_or(f64::INFINITY, |law| law.next_break(t))
    }

    /// Adds Maxwell branches in parallel.
    #[must_use]
    pub fn with_branches(mut self, branches: Vec<Maxwell>) -> Self {
        self.branches = branches;
        self
    }

    /// Maxwell branches.
    pub fn branches(&self) -> &[Maxwell] {
        &self.branches
    }

    /// Length of the rod.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Indices among u1 .. v3 of the strains that can change.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// True if the section loses energy.
    pub fn is_damped(&self) -> bool {
        self.friction.is_some() || !self.branches.is_empty()
    }

    /// Points in (0, 1) at which the law is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.elastic.breaks();
        breaks.extend(self.friction.iter().flat_map(|law| law.breaks()));
        breaks.iter_mut().for_each(|s| *s /= self.length);
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks.retain(|s| *s > 1e-12 && *s < 1.0 - 1e-12);
        breaks
    }

    /// Unloaded strains at s.
    ///
    /// # Errors
    /// A law without an unloaded state at s.
    pub fn unloaded(&self, s: f64) -> Result<Strain> {
        self.elastic.unloaded(s * self.length)
    }

    /// All six strains: the active ones as given, the others as in `rest`, the unloaded strains at the section.
    pub fn all(&self, rest: &Strain, active: &[f64]) -> Strain {
        let mut all = *rest;
        for (k, e) in self.active.iter().zip(active) {
            all[*k] = *e;
        }
        all
    }

    /// All six rates; those of rigid strains are 0.
    pub fn rates(&self, active: &[f64]) -> Strain {
        let mut all = Strain::zeros();
        for (k, e) in self.active.iter().zip(active) {
            all[*k] = *e;
        }
        all
    }

    /// Energy and resultants. `springs` are the strains of the springs of the Maxwell branches, empty if these carry
    /// no load. None outside the law's domain.
    pub fn answer(&self, s: f64, e: &Strain, rate: &Strain, springs: &[Strain]) -> Option<Answer> {
        let s = s * self.length;
        let free = self.elastic.free(s, e).ok()?;
        let friction = match (&self.viscosity, &self.friction) {
            (Some(viscosity), _) => viscosity * rate,
            (None, Some(law)) => law.overstress(s, e, rate).ok()?,
            (None, None) => Strain::zeros(),
        };
        let mut answer = Answer {
            energy: free.energy,
            elastic: free.resultants,
            loss: friction.dot(rate),
            friction,
            power: 0.0,
        };
        if self.in_time.is_some() {
            let rates = self.elastic.rates(s, e, &free.resultants).ok()?;
            answer.power = rates.map_or(0.0, |rates| rates.power);
        }
        for (branch, spring) in self.branches.iter().zip(springs) {
            let pull = branch.modulus * spring;
            let twice = spring.dot(&pull);
            answer.elastic += pull;
            answer.energy += 0.5 * twice;
            answer.loss += twice / branch.time;
        }
        Some(answer)
    }

    /// Derivatives of the resultants, without Maxwell branches; None outside the law's domain.
    pub fn stiffness(&self, s: f64, e: &Strain, rate: &Strain) -> Option<Stiffness> {
        let s = s * self.length;
        let mut by_strain = self.elastic.free(s, e).ok()?.tangent;
        let by_rate = match (&self.viscosity, &self.friction) {
            (Some(viscosity), _) => *viscosity,
            (None, Some(law)) => {
                // The law gives its inverse e_t(e, D): dD = C^-1 (de_t - B de).
                let overstress = law.overstress(s, e, rate).ok()?;
                let there = law.rate(s, e, &overstress).ok()?;
                let inverse = self.inverse(&there.by_overstress).ok()?;
                by_strain -= inverse * there.by_strain;
                inverse
            }
            (None, None) => Matrix6::zeros(),
        };
        Some(Stiffness { by_strain, by_rate })
    }

    /// Inverse on the active strains, zero elsewhere.
    fn inverse(&self, matrix: &Matrix6<f64>) -> Result<Matrix6<f64>> {
        let count = self.active.len();
        let block = DMatrix::from_fn(count, count, |i, j| {
            matrix[(self.active[i], self.active[j])]
        });
        let inverse = block.try_inverse().ok_or_else(|| {
            Error::domain("the friction of the section has no viscosity in one of its strains")
        })?;
        let mut all = Matrix6::zeros();
        for (i, k) in self.active.iter().enumerate() {
            for (j, l) in self.active.iter().enumerate() {
                all[(*k, *l)] = inverse[(i, j)];
            }
        }
        Ok(all)
    }
}
