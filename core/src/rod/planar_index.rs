//! Morse index of a planar equilibrium among variations within its plane.
//!
//! With n given along the rod the second variation is a functional of one angle. Its index is the number of zeros of
//! j(s) = d theta/d m(0) between clamp and end: the conjugate points in the plane. A free end adds 1 if its stiffness
//! p/j is negative, p the change of the end's couple. Each held component of the place takes away a negative
//! eigenvalue of d r(1)/d n, at held angle or couple of the end (Haynsworth).

use super::ivp::Wrench;
use super::planar::{Flat, FlatLaw, HEAVY_VARIED, Plane, VARIED};
use super::problem::Problem;
use nalgebra::{DMatrix, Matrix2, Vector2};

/// Steps of the integration in each piece of the rod: signs alone are wanted of its results.
const STEPS: usize = 400;
/// Eigenvalues within this part of the whole are those of a neutral mode, which counts as stable.
const ZERO: f64 = 1e-7;

impl Problem {
    /// The index within the plane of the equilibrium with the base wrench `b`, in the units of the numerics; `None`
    /// if the rod cannot be followed, or its load follows the end.
    pub(super) fn index_in_plane(&self, plane: &Plane, b: &Wrench) -> Option<usize> {
        if self.end.follower {
            return None;
        }
        match self.weight {
            None => self.count_in_plane::<VARIED>(plane, b),
            Some(_) => self.count_in_plane::<HEAVY_VARIED>(plane, b),
        }
    }

    fn count_in_plane<const D: usize>(&self, plane: &Plane, b: &Wrench) -> Option<usize> {
        let law = FlatLaw::new(self, plane);
        let (x, _) = plane.in_plane_part(b);
        let slope = |at: &Flat<D>| law.slope::<D>(&x, at).ok();
        let mut at = Flat::<D>::zeros();
        let mut zeros = 0;
        let mut before = 1.0;
        let mut last = 0.0;
        for &(from, to) in self.rod.law.pieces() {
            if from > 0.0 {
                law.cross(&mut at, 0.5 * (last + from));
            }
            last = to;
            let h = (to - from) / STEPS as f64;
            for k in 0..STEPS {
                at[0] = from + k as f64 * h;
                let k1 = slope(&at)?;
                let k2 = slope(&(at + 0.5 * h * k1))?;
                let k3 = slope(&(at + 0.5 * h * k2))?;
                // The last stage stays on the near side of a break.
                let k4 = slope(&(at + h * (1.0 - 1e-12) * k3))?;
                at += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
                let is_end = to >= 1.0 && k + 1 == STEPS;
                let neutral = is_end && at[5].abs() <= ZERO;
                if at[5] * before < 0.0 && !neutral {
                    zeros += 1;
                    before = at[5];
                }
            }
        }
        let rows = |i: usize| [at[i], at[i + 1], at[i + 2]];
        let (turn, dx, dy) = (rows(5), rows(8), rows(11));
        let n = self.force_at_end(plane, &x);
        let place = Vector2::new(at[2], at[3]);
        // Change of the end's couple by m(0) and the two forces.
        let dm: [f64; 3] = std::array::from_fn(|k| {
            let unit = |i: usize| if i == k { 1.0 } else { 0.0 };
            let lever = dx[k] * n.y - dy[k] * n.x + place.x * unit(2) - place.y * unit(1);
            let carried = if D == HEAVY_VARIED {
                at[VARIED + 1 + k]
            } else {
                0.0
            };
            unit(0) - lever - carried
        });
        let first = if self.orientation.is_some() { turn } else { dm };
        if self.orientation.is_none() && dm[0] * before < 0.0 && dm[0].abs() > ZERO {
            zeros += 1;
        }
        let axes: Vec<Vector2<f64>> = (plane.conditions(self).into_iter())
            .filter_map(|(direction, _, held)| held.then_some(direction))
            .collect();
        if axes.is_empty() {
            return Some(zeros);
        }
        // d r(1)/d n at held angle, or couple, of the end.
        let by_couple = Vector2::new(dx[0], dy[0]);
        let along = Vector2::new(first[1], first[2]) / first[0];
        let compliance = Matrix2::new(dx[1], dx[2], dy[1], dy[2]) - by_couple * along.transpose();
        let restricted = DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
            let (a, b) = (&axes[i], &axes[j]);
            0.5 * (a.dot(&(compliance * b)) + b.dot(&(compliance * a)))
        });
        let size = compliance.norm();
        let values = restricted.symmetric_eigenvalues();
        let taken = values.iter().filter(|value| **value < -ZERO * size);
        zeros.checked_sub(taken.count())
    }

    /// Force at the end, in the plane.
    fn force_at_end(&self, plane: &Plane, x: &nalgebra::Vector3<f64>) -> Vector2<f64> {
        let base = Vector2::new(x[1], x[2]);
        match &self.weight {
            Some(weight) => base - plane.flat(&weight.total()),
            None => base,
        }
    }
}
