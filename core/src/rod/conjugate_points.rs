//! Variations of a rod from clamp to end, and the angle that counts its conjugate points (see `index`).

use super::distributed_load::LoadState;
use super::ivp::{LineState, STEP_LIMIT, Wrench, WrenchFlow, rate, unit_columns};
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::solve::dop853::Dop853;
use nalgebra::{Complex, Matrix3, SMatrix, SVector, Vector3};
use std::f64::consts::{PI, TAU};

/// The rod's end with variations that stay independent under any load, since their columns are mixed on the way.
#[derive(Debug, Clone)]
pub(super) struct Variations<const K: usize> {
    /// The end; columns 0..3 of its tangent keep n, columns 3..6 (if any) vary n by unit vectors.
    pub(super) end: LineState<K>,
    /// Force at the end.
    pub(super) n: Vector3<f64>,
    /// dm(0) - dw(1) of each column: the part of the change of the end's couple that is not due to force and place.
    pub(super) dm: [[f64; K]; 3],
    /// J and P at the end: conjugate variables, J^T P symmetric.
    pub(super) conjugate: (Matrix3<f64>, Matrix3<f64>),
    /// Angle of det(P + i kappa J) from clamp to end, followed without jumps: J = phi, P = dm + m x phi/2 of columns
    /// 0..3.
    pub(super) angle: f64,
    /// The weight kappa.
    pub(super) weight: f64,
    /// Amplification of an error at the clamp: size of the unmixed columns at the end over the compliance.
    pub(super) growth: f64,
}

/// The load along a rod, and its base wrench.
struct LoadedBase<'a, const K: usize, C: LoadState<K>> {
    load: &'a C::Load,
    b: &'a Wrench,
}

/// (J, P) of all columns: P = dm(0) + n x rho - dw + m x phi/2. With the last term J^T P of columns 0..3, which keep
/// n, is symmetric.
fn conjugate<const K: usize, C: LoadState<K>>(
    at: &LineState<K, C>,
    rod: &LoadedBase<'_, K, C>,
    dm: &[[f64; K]; 3],
) -> (SMatrix<f64, 3, K>, SMatrix<f64, 3, K>) {
    let block = |rows: &[[f64; K]]| SMatrix::<f64, 3, K>::from_fn(|i, j| rows[i][j]);
    let (m, n) = at.resultants(rod.b, rod.load);
    let j = block(&at.tangent[..3]);
    let rho = block(&at.tangent[3..]);
    let mut given = *dm;
    at.carried.take_columns(&mut given);
    let p = block(&given) + n.cross_matrix() * rho + 0.5 * m.cross_matrix() * j;
    (j, p)
}

/// The first three columns, which keep n.
fn first_three_columns<const K: usize>(all: &SMatrix<f64, 3, K>) -> Matrix3<f64> {
    all.fixed_columns::<3>(0).into_owned()
}

/// P + i kappa J of columns 0..3.
pub(super) fn complex_columns<const K: usize>(
    (j, p): &(SMatrix<f64, 3, K>, SMatrix<f64, 3, K>),
    weight: f64,
) -> Matrix3<Complex<f64>> {
    first_three_columns(p).zip_map(&first_three_columns(j), |p, j| Complex::new(p, weight * j))
}

/// det(P + i kappa J) and the rate of its angle along the rod: P' = n x rho' + (m' x phi + m x phi')/2, also under a
/// load along the rod.
fn angle_rate<const K: usize, C: LoadState<K>>(
    at: &LineState<K, C>,
    slope: &LineState<K, C>,
    rod: &LoadedBase<'_, K, C>,
    dm: &[[f64; K]; 3],
    weight: f64,
) -> Option<(Complex<f64>, f64)> {
    let found = conjugate(at, rod, dm);
    let block = |rows: &[[f64; K]]| Matrix3::from_fn(|i, j| rows[i][j]);
    let (m, n) = at.resultants(rod.b, rod.load);
    let dj = block(&slope.tangent[..3]);
    let dp = n.cross_matrix() * block(&slope.tangent[3..])
        + 0.5
            * (n.cross(&slope.position()).cross_matrix() * first_three_columns(&found.0)
                + m.cross_matrix() * dj);
    let whole = complex_columns(&found, weight);
    let rate = dp.zip_map(&dj, |p, j| Complex::new(p, weight * j));
    Some((
        whole.determinant(),
        (whole.try_inverse()? * rate).trace().im,
    ))
}

/// A rod integrated from clamp to end with `K` = 3 columns at constant n, or `K` = 6 with variations of n.
pub(super) struct FollowedRod<const K: usize, C = ()> {
    pub(super) end: LineState<K, C>,
    /// dm(0) of each column.
    pub(super) dm: [[f64; K]; 3],
    /// Angle of det(P + i kappa J) from clamp to end.
    pub(super) angle: f64,
    /// Factor by which mixing reduced the columns between clamp and end.
    pub(super) growth: f64,
}

/// The variations of a rod integrated by `follow`, given kappa.
pub(super) fn variations<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    follow: impl FnOnce(f64) -> Result<FollowedRod<K, C>>,
) -> Result<Variations<K>> {
    let [c1, c2] = law.flexures();
    let weight = 2.0 * rate(law, b)? / (c1 + c2);
    let found = follow(weight)?;
    let end = &found.end;
    let (j, p) = conjugate(end, &LoadedBase { load, b }, &found.dm);
    let compliance = law.inverse(0.0, b)?.compliance.matrix().norm();
    let mut dm = found.dm;
    end.carried.take_columns(&mut dm);
    Ok(Variations {
        growth: found.growth * size(end).max(1.0) / compliance.max(1.0),
        n: end.resultants(b, load).1,
        end: end.without_load(),
        dm,
        conjugate: (first_three_columns(&j), first_three_columns(&p)),
        angle: found.angle,
        weight,
    })
}

/// The largest size of an entry of the tangent.
fn size<const K: usize, C>(at: &LineState<K, C>) -> f64 {
    let entries = at.tangent.as_flattened().iter();
    entries.fold(0.0, |size, x| size.max(x.abs()))
}

/// Error: the variations could not be followed.
pub(super) fn variations_error() -> Error {
    Error::no_convergence("the variations along the rod could not be followed")
}

/// Integrates the variations of any rod by explicit steps.
pub(super) fn follow_variations<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    weight: f64,
    tolerance: f64,
) -> Result<FollowedRod<K, C>> {
    let rod = &LoadedBase { load, b };
    let longest = 1.2 / rate(law, b)?;
    let [dm, dn] = unit_columns();
    let mut flow = WrenchFlow::<K, C>::new(law, load, b, dm, dn);
    let state = LineState::clamp();
    let slope = flow.slope(&state).ok_or_else(variations_error)?;
    let mut turn =
        angle_rate(&state, &slope, rod, &flow.dm, weight).ok_or_else(variations_error)?;
    let mut solver = Dop853::new(state, slope, longest, tolerance);
    let mut step = solver.blank();
    let (mut angle, mut growth, mut h_max) = (0.0, 1.0, longest);
    let mut pieces = law.pieces().iter().peekable();
    while let Some(&&(_, to)) = pieces.peek() {
        let left = to - solver.state().s();
        if left <= 1e-14 {
            pieces.next();
            if let Some(&&(from, _)) = pieces.peek() {
                let mut state = solver.state().at(from);
                state.cross(load, 0.5 * (to + from));
                let slope = flow.slope(&state).ok_or_else(variations_error)?;
                turn = angle_rate(&state, &slope, rod, &flow.dm, weight)
                    .ok_or_else(variations_error)?;
                solver.rewind(state, slope);
            }
            continue;
        }
        solver
            .step_into(
                |x, slope| flow.write_slope(x, slope),
                h_max.min(left),
                &mut step,
            )
            .map_err(|_| flow.refusal.take().unwrap_or_else(variations_error))?;
        let next = angle_rate(&step.to, step.end_slope(), rod, &flow.dm, weight)
            .ok_or_else(variations_error)?;
        // The angle is known modulo whole turns. The rates at both ends decide, if they agree with the angle and with
        // each other.
        let turned = (next.0 / turn.0).arg();
        let [before, after] = [turn.1, next.1].map(|rate| step.h * rate);
        let expected = 0.5 * (before + after);
        let whole = ((expected - turned) / TAU).round() * TAU;
        let known = (turned + whole - expected).abs() < 1.0;
        if !(known && before.abs().max(after.abs()) < PI) {
            solver.rewind(step.from, step.stage_slopes()[0]);
            h_max = 0.5 * step.h;
            if solver.cost().steps > STEP_LIMIT {
                return Err(variations_error());
            }
            continue;
        }
        angle += turned + whole;
        h_max = longest;
        turn = next;
        if size(&step.to) > MIXING_SIZE {
            let (mut state, mut slope) = (step.to, *step.end_slope());
            growth *= separate_columns(&mut state, &mut slope, &mut flow, rod)
                .ok_or_else(variations_error)?;
            // The mixing matrix has a positive determinant: the angle is unchanged.
            turn =
                angle_rate(&state, &slope, rod, &flow.dm, weight).ok_or_else(variations_error)?;
            solver.rewind(state, slope);
        }
        if solver.cost().steps > STEP_LIMIT {
            return Err(variations_error());
        }
    }
    Ok(FollowedRod {
        end: *solver.state(),
        dm: flow.dm,
        angle,
        growth,
    })
}

/// Size of the tangent at which the columns are mixed.
pub(super) const MIXING_SIZE: f64 = 30.0;

/// Makes columns 0..3 of (J, P) orthonormal and removes their part from the others. The equations are linear, so
/// state, slope and dm(0) mix alike. Returns the previous size of the three.
fn separate_columns<const K: usize, C: LoadState<K>>(
    state: &mut LineState<K, C>,
    slope: &mut LineState<K, C>,
    flow: &mut WrenchFlow<'_, K, C>,
    rod: &LoadedBase<'_, K, C>,
) -> Option<f64> {
    let (mixing, size) = mixing_matrix(&conjugate(state, rod, &flow.dm))?;
    let rows = (state.tangent.iter_mut())
        .chain(slope.tangent.iter_mut())
        .chain(flow.dm.iter_mut())
        .chain(state.carried.columns())
        .chain(slope.carried.columns());
    for row in rows {
        *row = (mixing.transpose() * SVector::from(*row)).into();
    }
    Some(size)
}

/// Mixing matrix, of positive determinant, that makes columns 0..3 of (J, P) orthonormal and removes their part from
/// the others; and the size of the three.
pub(super) fn mixing_matrix<const K: usize>(
    (j, p): &(SMatrix<f64, 3, K>, SMatrix<f64, 3, K>),
) -> Option<(SMatrix<f64, K, K>, f64)> {
    let gram = first_three_columns(j).transpose() * j + first_three_columns(p).transpose() * p;
    let square = first_three_columns(&gram);
    let one = square.cholesky()?.l().transpose().try_inverse()?;
    let mut mixing = SMatrix::<f64, K, K>::identity();
    mixing.fixed_view_mut::<3, 3>(0, 0).copy_from(&one);
    // Projection of a column x on the orthonormal ones e = x_0 one: e (e^T x) = x_0 (one one^T) (x_0^T x).
    for column in 3..K {
        let part = one * (one.transpose() * gram.column(column));
        mixing.view_mut((0, column), (3, 1)).copy_from(&(-part));
    }
    Some((mixing, square.trace().sqrt()))
}
