//! Step limits of the schemes by experiment: growth of small disturbances of a linear bar.
//!
//! The thesis proves h/dt > sqrt(6) c (5.28) for consistent and h/dt > sqrt(2) c (5.34) for lumped mass. These
//! suffice while the motion is smooth, but instability begins later, at c dt/h = 1/sqrt(3) and 1.

use super::{Bar, BarMotion, End, Lattice, Material, Scheme, Stress};
use snaprod_core::body::History;
use snaprod_core::error::Result;
use std::f64::consts::PI;

/// Elements of the experiments.
const ELEMENTS: usize = 60;

/// Growth per step of small disturbances of a linear bar, at r = c dt/h, over `steps` steps: that of the fastest
/// wave, 1 if none grows.
///
/// # Errors
/// A scheme that is none on linear elements.
pub fn growth(scheme: Scheme, r: f64, steps: usize) -> Result<f64> {
    let material = Material::new(&Stress::Linear(1.0), 1.0)?;
    let ends = [End::Wall, End::Loaded(History::Constant(0.0))];
    let bar = Bar::new(material, ELEMENTS as f64, 1.0, ends)?;
    // The shortest wave, with all others mixed in.
    let bar = bar.started(|x| {
        [
            1.0 + 1e-6 * ((PI * x).cos() + 0.1 * (13.7 * x * x).sin()),
            0.0,
        ]
    });
    let mut lattice = Lattice::new(&bar, scheme, ELEMENTS, Some(r), true)?;
    let half = steps / 2;
    let mut grown = 0.0;
    for step in 0..steps {
        let until = (step + 1) as f64 * r;
        if lattice.advance(until).is_err() {
            return Ok(f64::INFINITY);
        }
        if step % 10 == 9 {
            let size = lattice.deviation(1.0) / 1e-6;
            lattice.deviation(1.0 / size);
            if step >= half {
                grown += size.ln();
            }
        }
    }
    Ok((grown / (steps - half) as f64).exp())
}

/// The greatest c dt/h without growth, to `tolerance`, by bisection between 0 and 2.
///
/// # Errors
/// A scheme that is none on linear elements.
pub fn stable_limit(scheme: Scheme, tolerance: f64) -> Result<f64> {
    let (mut low, mut high) = (0.0, 2.0);
    while high - low > tolerance {
        let r = 0.5 * (low + high);
        // Bounded waves vary by a factor of about 30 over 2000 steps.
        if growth(scheme, r, 2000)? < 1.004 {
            low = r
        } else {
            high = r
        }
    }
    Ok(0.5 * (low + high))
}
