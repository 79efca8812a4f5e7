//! Use of rough Jacobians: Newton's iteration of an implicit step first tries a cheaper one
//! ([`super::system::System::roughly_linearised`]), which is judged by the contraction of the iteration.

/// Contraction of Newton's iteration beyond which rough Jacobians are doubted, in the mean of about `MEAN` steps.
const ROUGH: f64 = 0.2;
const MEAN: f64 = 4.0;
/// Steps of a trial with exact Jacobians.
const TRIAL: u32 = 4;
/// Exact Jacobians pay if they multiply the logarithm of the contraction by this factor: iterations are fewer by the
/// same factor.
const BETTER: f64 = 2.0;
/// Steps for which a verdict holds: at first, and at most; each holds twice as long as the one before.
const PATIENCE: u32 = 16;
const PATIENCE_LIMIT: u32 = 1024;
/// Smaller contractions count as this value.
const LEAST: f64 = 0.02;

/// Statistics that decide between rough and exact Jacobians.
#[derive(Debug, Clone, Copy)]
pub(super) struct RoughJacobianPolicy {
    /// True if the Jacobian in use is rough.
    pub(super) used: bool,
    /// Steps left with exact Jacobians, and whether these are a trial.
    whole: u32,
    trying: bool,
    /// Steps left with rough Jacobians, whatever their contraction.
    trusted: u32,
    /// Steps for which the next verdict holds.
    patience: u32,
    /// Mean logarithms of the contraction: with rough Jacobians, and of the present trial.
    usual: f64,
    tried: f64,
}

impl RoughJacobianPolicy {
    /// Initial statistics: rough Jacobians are assumed to be good.
    pub(super) const HOPED: Self = Self {
        used: false,
        whole: 0,
        trying: false,
        trusted: 0,
        patience: PATIENCE,
        usual: -8.0,
        tried: 0.0,
    };

    /// The statistics for a restarted integration, which has no Jacobian yet.
    pub(super) fn restarted(self) -> Self {
        Self {
            used: false,
            ..self
        }
    }

    /// True if the next Jacobian may be rough.
    pub(super) fn is_due(&self) -> bool {
        self.whole == 0
    }

    /// Records the contraction of Newton's iteration; 1 if it failed.
    pub(super) fn record_contraction(&mut self, contraction: f64) {
        let log = contraction.max(LEAST).ln();
        if self.used {
            self.usual += (log - self.usual) / MEAN;
            self.trusted = self.trusted.saturating_sub(1);
            if self.trusted == 0 && self.usual > ROUGH.ln() {
                (self.whole, self.trying, self.tried) = (TRIAL, true, 0.0);
            }
            return;
        }
        self.tried += log / f64::from(TRIAL);
        self.whole = self.whole.saturating_sub(1);
        if self.whole > 0 || !std::mem::take(&mut self.trying) {
            return;
        }
        if self.tried < BETTER * self.usual {
            self.whole = self.patience;
            self.usual = Self::HOPED.usual;
        } else {
            self.trusted = self.patience;
        }
        self.patience = (2 * self.patience).min(PATIENCE_LIMIT);
    }
}
