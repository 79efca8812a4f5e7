//! The partitioned coupling of fluid and wall of the report on veins, as a demonstration of how it fails.
//!
//! One backward Euler step of a fluid of the sound speed c_f in a tube without mass. Pulses in the tube have the
//! speed c, and the pressure is held at both ends. The report iterates p = Fluid(Wall(p)) to a fixed point. The map
//! has the eigenvalues
//!
//! ```text
//! -[(c k tau)^2 + (c/c_f)^2]^-1,   k = pi/L, 2 pi/L, ..
//! ```
//!
//! The iteration diverges for c tau pi/L < 1, and the worse the shorter the step is. A wall in equilibrium needs no
//! iteration: pressure and area are solved for together. [`super::FlowVolumes`] takes the area alone as its unknown.

use nalgebra::{DMatrix, DVector};

/// Largest number of iterations.
pub const MOST: u32 = 600;
/// Relative change at which an iteration has converged.
const SMALL: f64 = 1e-8;

/// One step of the coupled fluid and wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoupledStep {
    /// Elements along the tube, at least 2.
    pub elements: usize,
    /// Length L.
    pub length: f64,
    /// Speed c of pulses in the tube.
    pub pulse_speed: f64,
    /// Sound speed c_f of the fluid.
    pub sound_speed: f64,
    /// Step tau in time.
    pub step: f64,
}

/// Iteration for the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Iteration {
    /// p <- (1 - w) p + w Fluid(Wall(p)) with the relaxation w; 1 is the plain one.
    Relaxed(f64),
    /// Every third iterate is extrapolated at every point by itself (Steffensen, Aitken), (48) of the report.
    Steffensen,
}

impl CoupledStep {
    /// The operator (c/c_f)^2 - (c tau)^2 d^2/dx^2 on the pressures inside.
    fn fluid(&self) -> DMatrix<f64> {
        let n = self.elements - 1;
        let h = self.length / self.elements as f64;
        let bend = (self.pulse_speed * self.step / h).powi(2);
        let compressed = (self.pulse_speed / self.sound_speed).powi(2);
        DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => compressed + 2.0 * bend,
            1 => -bend,
            _ => 0.0,
        })
    }

    /// The largest modulus of an eigenvalue of Fluid(Wall(.)), by the discrete wave of the length 2 L.
    pub fn spectral_radius(&self) -> f64 {
        let h = self.length / self.elements as f64;
        let wave = 2.0 / h * (0.5 * std::f64::consts::PI * h / self.length).sin();
        let stiff = (self.pulse_speed * wave * self.step).powi(2);
        1.0 / (stiff + (self.pulse_speed / self.sound_speed).powi(2))
    }

    /// The relaxation that converges fastest, 2/(2 + mu), mu the spectral radius.
    pub fn best_relaxation(&self) -> f64 {
        2.0 / (2.0 + self.spectral_radius())
    }

    /// The pressures inside under the sources of the n - 1 inner points, by one solution of the coupled equations.
    pub fn together(&self, sources: &[f64]) -> Option<DVector<f64>> {
        let n = self.elements - 1;
        let all = self.fluid() + DMatrix::identity(n, n);
        all.lu().solve(&DVector::from_column_slice(sources))
    }

    /// Iterations to the solution of [`CoupledStep::together`] from no pressure, to 1e-8; `None` after [`MOST`].
    pub fn iterations(&self, iteration: Iteration, sources: &[f64]) -> Option<u32> {
        let n = self.elements - 1;
        let solver = self.fluid().lu();
        let solution = self.together(sources)?;
        let sources = DVector::from_column_slice(sources);
        let map = |p: &DVector<f64>| solver.solve(&(&sources - p));
        let mut p = DVector::zeros(n);
        let mut last: Vec<DVector<f64>> = vec![p.clone()];
        for k in 1..=MOST {
            let next = map(&p)?;
            p = match iteration {
                Iteration::Relaxed(part) => &p * (1.0 - part) + next * part,
                Iteration::Steffensen => next,
            };
            last.push(p.clone());
            if let (Iteration::Steffensen, [a, b, c]) = (iteration, &last[..]) {
                p = DVector::from_fn(n, |i, _| {
                    let (first, second) = (b[i] - a[i], c[i] - b[i]);
                    let curve = second - first;
                    if curve == 0.0 {
                        c[i]
                    } else {
                        a[i] - first * first / curve
                    }
                });
                last = vec![p.clone()];
            }
            if !(p.amax() < f64::MAX) {
                return None;
            }
            if (&p - &solution).amax() <= SMALL * solution.amax() {
                return Some(k);
            }
        }
        None
    }
}
