//! Rest of rods in elements: the equilibrium of the elements themselves next to a state.
//!
//! The equilibrium of the strains at Gauss nodes is one of the elements up to their error alone. A run that begins
//! there would shake by that error, and its steps would follow the waves.

use super::ElementAssembly;
use super::system::{INTEGRALS, PLACE, TWIST};
use crate::solve::system::{Factor, Linearised, System};
use nalgebra::DVector;

/// Multiple of the mass that Newton's matrix adds to the stiffness, for neutral directions. It is far below the
/// squares of frequencies.
const HOLD: f64 = 1e-4;
/// Most steps, and the size of a step that is rounding, in lengths and radians.
const STEPS: usize = 30;
const CONVERGED: f64 = 1e-11;

impl ElementAssembly {
    /// The state `y` with its places moved to the equilibrium at time 0. None if there is no equilibrium within the
    /// distance `most`, in the mean over places and rotations.
    ///
    /// Clamps and supports must stand, and something must hold the bodies.
    pub fn rested(&self, y: &DVector<f64>, most: f64) -> Option<DVector<f64>> {
        let twists = PLACE * self.sites();
        let count = TWIST * self.sites();
        let mut still = y.clone();
        still.rows_mut(twists, count).fill(0.0);
        let mut slope = DVector::zeros(y.len());
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            self.slope(&still, &mut slope)?;
            slope.rows_mut(self.time(), INTEGRALS).fill(0.0);
            // With velocities 0 the change of the places is (K + HOLD M)^-1 M a, of accelerations a.
            let factor = self.linearised(&still)?.shifted(HOLD.sqrt())?;
            if !factor.solve(&mut slope) {
                return None;
            }
            let step = self.size_of_motion(&slope);
            let places = slope.rows(0, twists);
            let mut moved = still.rows_mut(0, twists);
            moved += places;
            for i in 0..self.sites() {
                let mut turn = still.fixed_rows_mut::<4>(PLACE * i + 3);
                turn.normalize_mut();
            }
            let all = self.size_of_motion(&(&still - y));
            if !(all <= most) {
                return None;
            }
            if step <= CONVERGED || (step <= most && step >= 0.5 * last) {
                still
                    .rows_mut(twists, count)
                    .copy_from(&y.rows(twists, count));
                return Some(still);
            }
            last = step;
        }
        None
    }
}
