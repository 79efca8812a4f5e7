//! Rounding errors of roots, by stochastic sampling.
//!
//! A computed phi is phi + e, with e its rounding. The root of phi + e is off by S^-1 e, where S = d phi/dz. The
//! module measures e by second differences, (phi(z + d) + phi(z - d))/2 - phi(z). Over short distances d these are
//! rounding alone, for phi is linear there. Each, mapped by S^-1, is a sample of the error of the root (stochastic
//! arithmetic: J. Vignes, Math. Comput. Simul. 35 (1993) 233-261).

use nalgebra::{DMatrix, DVector};

/// Distances in units of the last digit of the unknowns. Distances of a few digits alone may change nothing: the
/// place of the end of a stiff rod changes by a digit only if its force changes by many.
const DISTANCES: [f64; 4] = [2.0, 128.0, 8192.0, 524_288.0];
/// Number of samples of the error.
const SAMPLES: u64 = 12;
/// The error is at most the largest sample times this. Normal roundings exceed the bound once in 10^4.
const MARGIN: f64 = 4.0;

/// A function near its root.
pub(crate) struct AtRoot<'a, Phi, Solve> {
    /// The root.
    pub z: &'a DVector<f64>,
    /// phi at the root.
    pub value: &'a DVector<f64>,
    /// phi; None where it is undefined.
    pub phi: Phi,
    /// S^-1 of a vector; None if S is singular.
    pub solve: Solve,
}

impl<Phi, Solve> AtRoot<'_, Phi, Solve>
where
    Phi: Fn(&DVector<f64>) -> Option<DVector<f64>>,
    Solve: Fn(&DVector<f64>) -> Option<DVector<f64>>,
{
    /// Absolute values of one sample of the errors.
    fn sample(&self, number: u64) -> Option<DVector<f64>> {
        let z = self.z;
        let distance = DISTANCES[number as usize % DISTANCES.len()] * f64::EPSILON;
        let change = DVector::from_fn(z.len(), |i, _| {
            random_part(number, i as u64) * distance * z[i].abs().max(1.0)
        });
        let beside = ((self.phi)(&(z + &change))? + (self.phi)(&(z - &change))?) / 2.0;
        let moved = (self.solve)(&(beside - self.value))?;
        let finite = moved.iter().all(|moved| moved.is_finite());
        finite.then(|| moved.abs())
    }

    /// Bounds of the errors of the components of the root. None if phi or S^-1 is undefined.
    pub fn errors(&self) -> Option<DVector<f64>> {
        let mut largest = self.sample(0)?;
        for number in 1..SAMPLES {
            largest = largest.sup(&self.sample(number)?);
        }
        Some(largest * MARGIN)
    }

    /// True if a distance from the root may be rounding, that is, lies within the error bound.
    pub fn explains(&self, distance: f64) -> bool {
        let explained = |number| {
            self.sample(number)
                .is_some_and(|moved| MARGIN * moved.norm() >= distance)
        };
        (0..SAMPLES).any(explained)
    }
}

/// S^-1 of a square matrix; None if it is singular.
pub(crate) fn solver(system: DMatrix<f64>) -> impl Fn(&DVector<f64>) -> Option<DVector<f64>> {
    let factors = system.full_piv_lu();
    move |right| factors.solve(right)
}

/// A number in [-1, -1/2) or [1/2, 1), from a hash of both numbers.
fn random_part(sample: u64, i: u64) -> f64 {
    let mixed = (sample * 0x9E37_79B9 + i * 0x85EB_CA6B + 1).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    let mixed = mixed ^ (mixed >> 32);
    let size = 0.5 + (mixed >> 33) as f64 / (1_u64 << 32) as f64;
    if mixed.count_ones().is_multiple_of(2) {
        size
    } else {
        -size
    }
}
