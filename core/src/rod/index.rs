//! Morse index of an equilibrium by conjugate points (theory Sec. 3).
//!
//! With n given along the rod and both ends' rotations held, the second variation is a functional of the rotation
//! field alone. Its index is the number of conjugate points, where the 3 x 3 matrix J(s) = d phi/d m(0) is singular.
//! J and its conjugate variable P (J^T P is symmetric) span a Lagrangian plane with three angles a_k, tan a_k =
//! eigenvalues of kappa J P^-1. The angles start from 0 and grow through a multiple of pi at each conjugate point.
//! Their sum is the angle of det(P + i kappa J), followed along the rod; with their remainders at its end it gives
//! the count. No root is sought, double points count twice, and unshearable and inextensible rods need no special
//! treatment.
//!
//! * Rotation held at the end: a_k counts floor(a_k/pi).
//! * Free to turn: floor(a_k/pi + 1/2), since the end's stiffness P J^-1 adds its negative eigenvalues. A dead force
//!   n on the arm c of the end makes that stiffness P J^-1 - S, S = ([n][c] + [c][n])/2. The angles are then those of
//!   P - S J, counted as S grows from 0.
//! * Each held component of the position takes away a negative eigenvalue of d r(1)/d n, if there is one
//!   (Haynsworth).
//!
//! A turn about the clamp that a symmetry makes free is known (see `zero_modes`), and left out. Other neutral modes
//! show in the numbers alone.
//!
//! A buckled column with the same stiffness in all planes can turn about its axis. At given n it then has a neutral
//! mode, whose angle is a multiple of pi up to noise. The mode counts as stable. If it moves the end, d r(1)/d n is
//! unbounded along that motion, with the sign of a stable mode.

use super::Problem;
use super::collocation::Collocated;
use super::conjugate_points::{Variations, follow_variations, variations};
use super::distributed_load::LoadMoment;
use super::ivp::Wrench;
use super::taut::Spring;
use super::zero_modes::FreeTurn;
use crate::error::{Error, Result};
use nalgebra::{Complex, DMatrix, DVector, Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

impl Problem {
    /// The Morse index of the equilibrium with the base wrench `base` (world frame): 0 is stable.
    ///
    /// A couple at a free end does work that depends on the path; the symmetric part is taken. A load that follows
    /// the end is taken as dead. Neither index decides stability then ([`Problem::is_conservative`]). A direction in
    /// which the equilibrium can move freely counts as stable.
    ///
    /// # Errors
    /// A wrench that the rod cannot follow.
    pub fn index_at(&self, base: &Wrench) -> Result<usize> {
        self.index(&self.rod.inward(base))
    }

    /// The Morse index under a base wrench in the numerics' units: roughly first, then to the tolerance if an
    /// eigenvalue is near zero.
    pub(super) fn index(&self, b: &Wrench) -> Result<usize> {
        if let Ok(rough) = self.count(b, ROUGH)
            && rough.noise < 1e-2
            && rough.margin > 10.0 * rough.noise
        {
            return Ok(rough.index);
        }
        if let Some(taut) = self.taut_at(b) {
            return self.taut_index(&taut, &Spring::NONE);
        }
        // The index is an integer, right or wrong: a loose tolerance of other results must not loosen this integration.
        let mut tolerance = self.tolerance.min(ROUGH);
        let mut fine = self.count(b, tolerance);
        // An almost straight rod with its end held: the eigenvalues that the held place removes may be undecided at
        // this tolerance.
        while fine.as_ref().is_err_and(Error::is_no_convergence) && tolerance > FINEST_TOLERANCE {
            tolerance = (FINER * tolerance).max(FINEST_TOLERANCE);
            fine = self.count(b, tolerance);
        }
        let fine = fine?;
        // An error at the clamp grows along the rod, as exp(lam) under a pull lam^2. Without growth the sign is as
        // good as the tolerance, and a neutral equilibrium is no error.
        let growth = fine.noise / tolerance;
        if fine.noise > 1e-4 || (growth > 1e3 && fine.margin < fine.noise) {
            return Err(Error::ill_conditioned(format!(
                "the rod is pulled too hard for an integration from its clamp: an error there grows {growth:.0e}-fold along \
                 the rod; lower the load, or tighten solve.tolerance"
            )));
        }
        Ok(fine.index)
    }

    fn count(&self, b: &Wrench, tolerance: f64) -> Result<Count> {
        let held: Vec<usize> = (0..3).filter(|i| self.end.position[*i].is_some()).collect();
        let clamped = self.end.orientation.is_some();
        let turn_of = |end: &Matrix3<f64>, place: &Vector3<f64>| {
            let turn = self.free_turn(b);
            turn.filter(|_| self.is_on_axis(b, place, &end.column(2).into_owned()))
        };
        if held.is_empty() {
            let along = self.variations::<3>(b, tolerance)?;
            let turn = turn_of(&along.end.rotation(), &along.end.position());
            let arm = self.lever(&along.end.rotation()).cross_matrix();
            let n = along.n.cross_matrix();
            let beside = (n * arm + arm * n) * 0.5;
            let (zero, neutral) = (10.0 * tolerance, usize::from(turn.is_some()));
            return Count::at_given_force(&along, clamped, &beside, zero, neutral, tolerance);
        }
        let along = self.variations::<6>(b, tolerance)?;
        let turn = turn_of(&along.end.rotation(), &along.end.position());
        let none = Matrix3::zeros();
        let axes: Vec<Vector3<f64>> = held.iter().map(|i| self.axes[*i]).collect();
        let held = held_position_effect(&along, clamped, &axes, tolerance, turn)?;
        let loaded = Count::at_given_force(&along, clamped, &none, 0.0, held.neutral, tolerance)?;
        let index = loaded.index.checked_sub(held.taken).ok_or_else(|| {
            Error::no_convergence(
                "the index comes out negative: the tolerance is too loose for this load; tighten it, or, where the rod is all but straight, let it stretch (a finite \
                 axial stiffness)",
            )
        })?;
        // Neutral modes that no symmetry tells are undecided.
        let told = usize::from(turn == Some(FreeTurn::AtGivenForce));
        let margin = if held.neutral > told {
            0.0
        } else {
            held.margin
        };
        Ok(Count {
            index,
            margin,
            ..loaded
        })
    }
}

impl Problem {
    fn variations<const K: usize>(&self, b: &Wrench, tolerance: f64) -> Result<Variations<K>> {
        let law = &self.rod.law;
        if let Some(weight) = &self.weight {
            return variations::<K, LoadMoment<K>>(law, weight, b, |kappa| {
                follow_variations(law, weight, b, kappa, tolerance)
            });
        }
        variations::<K, ()>(law, &(), b, |kappa| match Collocated::of(law) {
            Some(rod) => rod.follow_variations(b, kappa, tolerance),
            None => follow_variations(law, &(), b, kappa, tolerance),
        })
    }
}

/// Tolerance of a first, rough count; the count is repeated more tightly if an eigenvalue is near zero.
const ROUGH: f64 = 1e-7;
/// Factor by which the tolerance of a failed count is tightened, and the finest tolerance.
const FINER: f64 = 1e-2;
const FINEST_TOLERANCE: f64 = 1e-13;

/// An index, and the relative margin of the eigenvalue nearest to zero.
struct Count {
    index: usize,
    margin: f64,
    /// Error of the eigenvalues by the integration: a smaller eigenvalue is indistinguishable from zero.
    noise: f64,
}

impl Count {
    /// The index among variations that keep the force n: conjugate points between clamp and end, by the angle of
    /// det(P + i kappa J). `beside` is the S of a force on an arm. Angles less than `zero` beyond a threshold do not
    /// count, and neither do the nearest `neutral`.
    fn at_given_force<const K: usize>(
        along: &Variations<K>,
        clamped: bool,
        beside: &Matrix3<f64>,
        zero: f64,
        neutral: usize,
        tolerance: f64,
    ) -> Result<Self> {
        let (j, p) = along.conjugate;
        let turned = turned_by(&j, &p, beside, along.weight)?;
        let p = p - beside * j;
        // The count grows where an angle of the Lagrangian plane passes a multiple of pi (clamped end), or pi/2
        // beyond one (free end).
        let step = if clamped { 0.0 } else { FRAC_PI_2 };
        let mut beyond = angles(&(along.weight * j), &p)?.map(|a| (a - zero - step).rem_euclid(PI));
        beyond.sort_by(|a, b| a.min(PI - a).total_cmp(&b.min(PI - b)));
        // Margins are measured from the thresholds themselves: an angle left out for `zero` alone is near one.
        let margin = beyond
            .iter()
            .skip(neutral)
            .fold(f64::INFINITY, |margin, a| {
                let from = (a + zero).rem_euclid(PI);
                margin.min(from.min(PI - from) - zero)
            });
        for angle in beyond.iter_mut().take(neutral) {
            if *angle < FRAC_PI_2 {
                *angle += PI;
            }
        }
        let passed = if clamped { 0.0 } else { 3.0 * FRAC_PI_2 };
        let remainders = beyond.iter().sum::<f64>() - passed;
        let count = ((along.angle + turned - remainders) / PI).round();
        if count < 0.0 {
            return Err(Error::no_convergence(
                "the conjugate points of the rod could not be counted; tighten the tolerance",
            ));
        }
        Ok(Self {
            index: count as usize,
            margin,
            noise: tolerance * along.growth,
        })
    }
}

/// Change of the angle of det(P - t S J + i kappa J) as t goes from 0 to 1. With W = J (P + i kappa J)^-1 the
/// determinant is that at t = 0 times det(1 - t S W). Its factors 1 - t mu run along straight lines that miss 0.
fn turned_by(j: &Matrix3<f64>, p: &Matrix3<f64>, s: &Matrix3<f64>, kappa: f64) -> Result<f64> {
    if *s == Matrix3::zeros() {
        return Ok(0.0);
    }
    let complex = |m: &Matrix3<f64>| m.map(|x| Complex::new(x, 0.0));
    let whole = p.zip_map(j, |p, j| Complex::new(p, kappa * j));
    let turn = |inverse: Matrix3<Complex<f64>>| {
        let factors = (complex(s) * complex(j) * inverse).schur().eigenvalues()?;
        Some(factors.map(|mu| (Complex::new(1.0, 0.0) - mu).arg()).sum())
    };
    whole.try_inverse().and_then(turn).ok_or_else(|| {
        Error::no_convergence("the index is undefined: the rod's variations have run together")
    })
}

/// The angles of a Lagrangian plane (X, Y), modulo pi.
fn angles(x: &Matrix3<f64>, y: &Matrix3<f64>) -> Result<[f64; 3]> {
    // An angle near a right angle has no finite tangent. The plane is turned by whichever of four angles keeps all
    // three farthest from a right angle.
    let turned = |turn: f64| {
        let (sin, cos) = turn.sin_cos();
        (x * cos - y * sin, x * sin + y * cos)
    };
    let turn = (0..4)
        .map(|k| FRAC_PI_4 * f64::from(k))
        .max_by(|a, b| {
            let size = |turn: &f64| turned(*turn).1.determinant().abs();
            size(a).total_cmp(&size(b))
        })
        .unwrap_or(0.0);
    let (x, y) = turned(turn);
    let slopes = x * y
        .try_inverse()
        .ok_or_else(|| Error::no_convergence("the rod's variations have run together"))?;
    let slopes = (0.5 * (slopes + slopes.transpose())).symmetric_eigenvalues();
    Ok([slopes.x, slopes.y, slopes.z].map(|slope| turn + slope.atan()))
}

/// Effect of the held place of the end on the index.
struct HeldPlace {
    /// Number of unstable modes that the held place removes.
    taken: usize,
    /// Size of the eigenvalue nearest to zero relative to the terms it comes from.
    margin: f64,
    /// Number of neutral modes while the end's place is free.
    neutral: usize,
}

/// Effect of holding the end's place along `axes`: the negative eigenvalues of d r(1)/d n at held rotation (clamped)
/// or couple of the end.
///
/// An eigenvalue within `zero` of 0 counts as removed if its mode bends the rod, which is then neutral, that is, not
/// unstable. If the mode does not bend the rod, n moves nothing: a straight inextensible rod.
fn held_position_effect(
    along: &Variations<6>,
    clamped: bool,
    axes: &[Vector3<f64>],
    zero: f64,
    turn: Option<FreeTurn>,
) -> Result<HeldPlace> {
    let t = &along.end.tangent;
    let block = |row: usize, column: usize| Matrix3::from_fn(|i, j| t[row + i][column + j]);
    let (phi_m, phi_n, r_m, r_n) = (block(0, 0), block(0, 3), block(3, 0), block(3, 3));
    let (matrix, right) = if clamped {
        (phi_m, phi_n)
    } else {
        let pull = along.n.cross_matrix();
        let dm = |column: usize| Matrix3::from_fn(|i, j| along.dm[i][column + j]);
        let lever = along.end.position().cross_matrix();
        (dm(0) + pull * r_m, dm(3) + pull * r_n - lever)
    };
    let (left, sizes, modes) = decompose(&matrix)?;
    // dm(0) by n at constant rotation, or couple, of the end.
    let mut couple = Matrix3::zeros();
    // Displacements of the end by neutral modes, along the axes: orthonormal.
    let mut moving = Vec::new();
    let mut neutral = 0;
    let least = sizes.imin();
    for k in 0..3 {
        let pushed = right.tr_mul(&left.column(k));
        // A free turn about the clamp keeps the place of the end.
        let is_turn = turn == Some(FreeTurn::AtGivenForce) && k == least;
        if is_turn {
            neutral += 1;
            continue;
        }
        if sizes[k] > 10.0 * zero * sizes.max() {
            couple -= modes.column(k) * pushed.transpose() / sizes[k];
            continue;
        }
        neutral += 1;
        let mut moved = DVector::from_iterator(axes.len(), axes.iter().map(|a| a.dot(&pushed)));
        for other in &moving {
            let part: f64 = moved.dot(other);
            moved -= other * part;
        }
        if moved.norm() > zero.sqrt() * right.norm() {
            moving.push(moved.normalize());
        }
    }
    let compliance = r_n + r_m * couple;
    let mut restricted = DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
        let (a, b) = (&axes[i], &axes[j]);
        0.5 * (a.dot(&(compliance * b)) + b.dot(&(compliance * a)))
    });
    // Relative to the terms, not their sum: if two modes lose stability at once the whole matrix vanishes.
    let size = r_n.norm() + (r_m * couple).norm();
    let mut taken = 0;
    if let Some(FreeTurn::AtHeldPlace(force)) = turn {
        // The place does not change along this force: neutral with the place held, it is unstable or neutral without.
        taken += 1;
        let along = axes.iter().map(|axis| axis.dot(&force));
        moving.push(DVector::from_iterator(axes.len(), along).normalize());
    }
    for moved in &moving {
        let own = moved * moved.transpose();
        let rest = DMatrix::identity(axes.len(), axes.len()) - &own;
        restricted = &rest * restricted * &rest + own * size;
    }
    let eigen = restricted.symmetric_eigen();
    let mut margin = f64::INFINITY;
    for (value, mode) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        let force: Vector3<f64> = axes.iter().zip(mode.iter()).map(|(a, x)| a * *x).sum();
        let bends = (couple * force).norm() > 1e-6;
        if *value < -zero * size || (value.abs() <= zero * size && bends) {
            taken += 1;
        }
        if bends {
            margin = margin.min(value.abs() / size);
        }
    }
    Ok(HeldPlace {
        taken,
        margin,
        neutral,
    })
}

/// Singular value decomposition: left vectors by columns, singular values, right vectors by columns.
fn decompose(matrix: &Matrix3<f64>) -> Result<(Matrix3<f64>, Vector3<f64>, Matrix3<f64>)> {
    let svd = matrix.try_svd(true, true, f64::EPSILON, 1000);
    svd.and_then(|svd| Some((svd.u?, svd.singular_values, svd.v_t?.transpose())))
        .ok_or_else(|| {
            Error::no_convergence("the index is undefined: the rod's variations are not finite")
        })
}
