//! Crossings of branches: simple branch points, and changes of the index without a sign change of a determinant.

use super::elimination::{Place, Svd};
use super::newton_on_branch::{Corrected, Cubic, Space};
use super::rounding::{AtRoot, solver};
use super::special_points::{Bracket, MAX_DEPTH, Sample, Special, SpecialKind, Status, lowest};
use nalgebra::{DMatrix, DVector};

/// Distance, relative to 1 + the norm of the place, up to which rounding splits a multiple crossing.
const SPLIT: f64 = 1e-6;
/// Largest singular value, relative to the largest of all, that counts as zero at a crossing.
const CROSSING: f64 = 1e-4;

/// Border of A = [F_x F_p] near a branch point: the left and right near-kernels l and V of A at a guess.
struct Border {
    left: DVector<f64>,
    right: DMatrix<f64>,
    /// The largest singular value of A.
    size: f64,
}

/// The regular system of a branch point at (z, b): F + b l = 0, gamma = 0.
struct Bordered {
    matrix: DMatrix<f64>,
    /// (left, gamma) of M^T (left, gamma) = (0, 1), M = [A l; V^T 0].
    left: DVector<f64>,
    /// W of M (W, *) = (0, I).
    kernel: DMatrix<f64>,
    /// F + b l, then gamma.
    value: DVector<f64>,
}

impl Border {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let n = matrix.nrows();
        let kernels = Svd::new(matrix);
        Self {
            left: kernels.left.column(n - 1).into_owned(),
            right: kernels.right.columns(n - 1, 2).into_owned(),
            size: kernels.values[0],
        }
    }

    fn at(&self, space: &Space<'_>, z: &Place, b: f64) -> Option<Bordered> {
        let (matrix, residual) = space.matrix(z)?;
        let n = residual.len();
        let mut m = DMatrix::zeros(n + 2, n + 2);
        m.view_mut((0, 0), (n, n + 1)).copy_from(&matrix);
        m.view_mut((0, n + 1), (n, 1)).copy_from(&self.left);
        m.view_mut((n, 0), (2, n + 1))
            .copy_from(&self.right.transpose());
        let mut last = DVector::zeros(n + 2);
        last[n + 1] = 1.0;
        let left = m.transpose().full_piv_lu().solve(&last)?;
        let mut unit = DMatrix::zeros(n + 2, 2);
        unit[(n, 0)] = 1.0;
        unit[(n + 1, 1)] = 1.0;
        let kernel = m.full_piv_lu().solve(&unit)?;
        let mut value = DVector::zeros(n + 2);
        value.rows_mut(0, n).copy_from(&(residual + &self.left * b));
        value.rows_mut(n, 2).copy_from(&left.rows(n, 2));
        Some(Bordered {
            matrix,
            left,
            kernel,
            value,
        })
    }

    /// Matrix d(F + b l, gamma)/d(z, b); `gradient` is d gamma/dz.
    fn system(&self, at: &Bordered, gradient: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.left.len();
        let mut system = DMatrix::zeros(n + 2, n + 2);
        system.view_mut((0, 0), (n, n + 1)).copy_from(&at.matrix);
        system.view_mut((0, n + 1), (n, 1)).copy_from(&self.left);
        system.view_mut((n, 0), (2, n + 1)).copy_from(gradient);
        system
    }
}

impl Bordered {
    /// The gradient of gamma by z: -left^T A'[W].
    fn gradient(&self, space: &Space<'_>, z: &Place) -> Option<DMatrix<f64>> {
        let n = self.matrix.nrows();
        let left = self.left.rows(0, n);
        let mut rows = DMatrix::zeros(2, n + 1);
        for k in 0..2 {
            let direction = Place::from_slice(&self.kernel.column(k).as_slice()[..=n]);
            let bend = space.bend_along(z, &direction)?;
            rows.set_row(k, &(-(left.transpose() * bend)).row(0));
        }
        Some(rows)
    }
}

impl Space<'_> {
    /// A simple branch point: bracketed by the determinant, then polished with a system that is regular at the point.
    pub fn branch_point(&self, a: &Sample, b: &Sample) -> Special {
        let test = |s: &Sample| Some(s.on.branching);
        let rough = self.bracket(a, b, false, 0.05, test);
        let (fa, fb) = (rough.left.on.branching, rough.right.on.branching);
        let cubic = Cubic::new(
            rough.left.place_and_tangent(),
            rough.right.place_and_tangent(),
        );
        let t = (fa / (fa - fb)).clamp(0.0, 1.0);
        let t = if t.is_finite() { t } else { 0.5 };
        if let Some((place, error)) = self.polish_branch_point(&cubic.at(t), cubic.length) {
            let t = cubic_fraction(&cubic, &place, t);
            let on = Corrected {
                place,
                tangent: cubic.slope(t).unit(),
                branching: 0.0,
                regularity: 0.0,
                error,
                ..rough.best.on
            };
            let at = Sample {
                on,
                arclength: rough.left.arclength + t * rough.width(),
                index: None,
                event: None,
            };
            let mut special = self.special(SpecialKind::BranchPoint, &at, &rough, error);
            special.status = Status::Converged;
            special.error_p = error / self.weight;
            special.error_x.fill(error);
            return special;
        }
        let found = self.bracket(&rough.left, &rough.right, false, 1e-8, test);
        let (best, width) = (&found.best, found.width());
        let mut special = self.special(SpecialKind::BranchPoint, best, &found, width);
        if special.is_converged() && width > 1e-6 * (1.0 + best.on.place.norm()) {
            let why = "noise hides the determinant's root, and the regular system did not converge";
            special.status = Status::Guess(why.into());
        }
        special
    }

    /// Newton on F + b left = 0, left^T [F_x F_p] = 0 for (z, b): regular at a simple branch point.
    ///
    /// The second condition is written with the bordered matrix M = [A l; V^T 0], A = [F_x F_p], l and V the left and
    /// right near-kernels at the guess. gamma in M^T (left, gamma) = (0, 1) vanishes with the condition. Its gradient
    /// along w is -left^T A'[w] W with M (W, *) = (0, I). Residuals are exact; A' comes from central differences,
    /// kept over the iterations.
    pub fn polish_branch_point(&self, guess: &Place, length: f64) -> Option<(Place, f64)> {
        let n = guess.x.len();
        let mut z = guess.clone();
        let mut gradient: Option<DMatrix<f64>> = None;
        let (matrix, _) = self.matrix(&z)?;
        let border = Border::new(&matrix);
        let mut b = 0.0;
        let mut before = f64::INFINITY;
        for iteration in 0..12 {
            let at = border.at(self, &z, b)?;
            let fresh = gradient.is_none() || iteration == 1;
            if fresh {
                gradient = Some(at.gradient(self, &z)?);
            }
            let system = border.system(&at, gradient.as_ref()?);
            let step = system.full_piv_lu().solve(&-at.value)?;
            let move_by = Place::from_slice(&step.as_slice()[..=n]);
            let moved = move_by.norm();
            z = z + move_by;
            b += step[n + 1];
            if !(moved.is_finite() && (&z - guess).norm() <= length) {
                return None;
            }
            let scale = 1.0 + z.norm();
            let stalled =
                iteration > 1 && moved > 0.3 * before && (fresh || moved <= 1e-11 * scale);
            if moved <= 1e-13 * scale || stalled {
                // An imperfect crossing has b != 0: no branch point.
                let size = border.size + gradient.as_ref()?.norm() * length;
                let perfect = b.abs() <= 1e-7 * size * scale;
                let good = moved <= 1e-9 * scale && perfect;
                return good.then_some((z, moved.max(4.0 * f64::EPSILON * scale)));
            }
            if moved > 0.1 * before && moved > 1e-11 * scale {
                gradient = None;
            }
            before = moved;
        }
        None
    }

    /// Displacement of a branch point by rounding of F and of its derivatives.
    pub fn rounding_of_branch_point(&self, z: &Place) -> Option<Place> {
        let n = z.x.len();
        let border = Border::new(&self.matrix(z)?.0);
        let at = border.at(self, z, 0.0)?;
        let system = border.system(&at, &at.gradient(self, z)?);
        let phi = |all: &DVector<f64>| {
            let z = Place::from_slice(&all.as_slice()[..=n]);
            Some(border.at(self, &z, all[n + 1])?.value)
        };
        let at_root = AtRoot {
            z: &z.flat().push(0.0),
            value: &at.value,
            phi,
            solve: solver(system),
        };
        Some(Place::from_slice(&at_root.errors()?.as_slice()[..=n]))
    }

    /// [F_x F_p], N x (n + 1), in scaled coordinates, and F.
    pub fn matrix(&self, z: &Place) -> Option<(DMatrix<f64>, DVector<f64>)> {
        self.evaluations.set(self.evaluations.get() + 1);
        let (n, p) = (z.x.len(), z.p / self.weight);
        let at = self
            .family
            .linearised(&z.x, p)
            .ok()?
            .checked(&z.x, p)
            .ok()?;
        let mut matrix = DMatrix::zeros(n, n + 1);
        matrix.view_mut((0, 0), (n, n)).copy_from(&at.jacobian);
        matrix.set_column(n, &(at.slope / self.weight));
        Some((matrix, at.residual))
    }

    /// The derivative of [F_x F_p] along a direction, by central differences: error about 1e-9.
    pub fn bend_along(&self, z: &Place, direction: &Place) -> Option<DMatrix<f64>> {
        let h = 3e-5 * (1.0 + z.norm()) / direction.norm();
        let (plus, _) = self.matrix(&(z + direction * h))?;
        let (minus, _) = self.matrix(&(z + direction * -h))?;
        Some((plus - minus) / (2.0 * h))
    }

    /// A change of the index without a sign change of a determinant. |det|^(1 / jump), signed by the index, is smooth
    /// at a regular crossing; if not smooth, the search falls back to bisection.
    pub fn stability_change(&self, a: &Sample, b: &Sample, found: &mut Vec<Special>) {
        let Some((low, high)) = a.index.zip(b.index) else {
            return;
        };
        let power = 1.0 / low.abs_diff(high) as f64;
        let test = |s: &Sample| {
            let size = s.on.branching.abs().powf(power).max(f64::MIN_POSITIVE);
            Some(if s.index? == low { size } else { -size })
        };
        let end = Bracket {
            converged: true,
            ..self.bracket(a, b, true, 1e-9, test)
        };
        // At a double crossing the determinant is smallest. A mode outside this chart leaves no root of the
        // determinant; only the bracket itself then gives the place.
        let size = |s: &Sample| s.on.branching.abs();
        let (best, whole) = (&end.best, b.arclength - a.arclength);
        let near = (best.arclength - end.left.arclength).abs() < 1e-3 * whole;
        let best = if near && size(best) < 1e-3 * size(a).min(size(b)) {
            &end.best
        } else if size(&end.left) < size(&end.right) {
            &end.left
        } else {
            &end.right
        };
        let width = end.width();
        let mut special = self.special(SpecialKind::StabilityChange, best, &end, width);
        // Near a multiple crossing the corrector loses digits as the distance shrinks.
        if width <= 1e-6 * (1.0 + best.on.place.norm()) {
            special.status = Status::Converged;
        }
        let mut rest = Vec::new();
        if end.right.index != b.index {
            rest = self.search(&end.right, b, MAX_DEPTH);
        }
        // Rounding splits a multiple crossing into several changes of the index: one point for all of them.
        let here = special.point.arclength;
        let apart = SPLIT * (1.0 + best.on.place.norm());
        let twins = (rest.iter()).take_while(|next| next.point.arclength - here <= apart);
        for next in rest.drain(..twins.count()) {
            special.index.1 = next.index.1;
            special.interval.1 = next.interval.1;
        }
        special.point.index = lowest(special.index.0, special.index.1);
        found.push(special);
        found.append(&mut rest);
    }

    /// Displacement along the branch of a crossing by rounding of A = [F_x F_p]: the error of Psi^T A W, which
    /// vanishes at the crossing, over its rate. Psi and W are the near-kernels of A, W without the tangent. None if A
    /// has no near-kernel.
    pub fn rounding_of_crossing(&self, place: &Place, tangent: &Place) -> Option<f64> {
        let (matrix, _) = self.matrix(place)?;
        let n = matrix.nrows();
        let kernels = Svd::new(&matrix);
        let regular = |value: f64| value > CROSSING * kernels.values[0];
        let corank = (0..n).filter(|&k| !regular(kernels.values[k])).count();
        if corank == 0 {
            return None;
        }
        let left = kernels.left.columns(n - corank, corank).into_owned();
        let along = tangent.flat();
        let mut right = kernels.right.columns(n - corank, corank + 1).into_owned();
        // Basis of the kernel without the tangent: the tangent is projected out, the largest columns stay.
        right -= &along * (along.transpose() * &right);
        let right = Svd::new(&right.transpose())
            .right
            .columns(0, corank)
            .into_owned();
        let seen = |matrix: &DMatrix<f64>| left.transpose() * matrix * &right;
        let rate = seen(&self.bend_along(place, tangent)?).try_inverse()?;
        let value = DVector::from_column_slice(seen(&matrix).as_slice());
        let phi = |z: &DVector<f64>| {
            let (matrix, _) = self.matrix(&Place::from_slice(z.as_slice()))?;
            Some(DVector::from_column_slice(seen(&matrix).as_slice()))
        };
        let moved = |off: &DVector<f64>| {
            let off = DMatrix::from_column_slice(corank, corank, off.as_slice());
            Some(DVector::from_element(1, (&rate * off).norm()))
        };
        let at_root = AtRoot {
            z: &place.flat(),
            value: &value,
            phi,
            solve: moved,
        };
        Some(at_root.errors()?[0])
    }
}

/// Fraction of the cubic at which the cubic is nearest to `place`.
fn cubic_fraction(cubic: &Cubic, place: &Place, guess: f64) -> f64 {
    let mut t = guess;
    for _ in 0..4 {
        let slope = cubic.slope(t);
        t += slope.dot(&(place - &cubic.at(t))) / slope.dot(&slope);
    }
    if t.is_finite() { t } else { guess }
}
