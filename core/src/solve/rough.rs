//! Rough Jacobians: Newton's iteration of an implicit step tries one that costs less
//! ([`super::system::System::roughly_linearised`]), and whether it serves is seen by how the iteration contracts.

/// Rough Jacobians are doubted where Newton's iteration contracts by less than this in an iteration, in the mean of
/// about so many steps.
const ROUGH: f64 = 0.2;
const MEAN: f64 = 4.0;
/// Steps that are then taken with whole ones.
const TRIAL: u32 = 4;
/// Whole ones are worth their price if they make the logarithm of the contraction so many times what it was:
/// iterations are fewer by as much.
const BETTER: f64 = 2.0;
/// Steps for which such a verdict holds: at first, and at most, for each holds twice as long as the one before.
const PATIENCE: u32 = 16;
const PATIENCE_LIMIT: u32 = 1024;
/// A contraction below this counts as this.
const LEAST: f64 = 0.02;

/// What is known of rough Jacobians: whether they serve is tried.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rough {
    /// The Jacobian in use is one.
    pub(super) used: bool,
    /// Steps to be taken with whole ones, and whether they are a trial.
    whole: u32,
    trying: bool,
    /// Steps to be taken with rough ones, however poor.
    trusted: u32,
    /// How long the next verdict holds.
    patience: u32,
    /// Logarithms of the contraction, in the mean: with rough ones, and of the trial so far.
    usual: f64,
    tried: f64,
}

impl Rough {
    /// Nothing is known, and the best is hoped.
    pub(super) const HOPED: Self = Self {
        used: false,
        whole: 0,
        trying: false,
        trusted: 0,
        patience: PATIENCE,
        usual: -8.0,
        tried: 0.0,
    };

    /// What is known stays known where the integration starts anew, without a Jacobian.
    pub(super) fn anew(self) -> Self {
        Self {
            used: false,
            ..self
        }
    }

    /// Whether the next Jacobian may be one.
    pub(super) fn is_due(&self) -> bool {
        self.whole == 0
    }

    /// Newton's iteration contracted by this; 1 if it failed.
    pub(super) fn seen(&mut self, contraction: f64) {
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
