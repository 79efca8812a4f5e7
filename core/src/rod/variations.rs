//! Variations of a rod from clamp to end, and the angle that counts its conjugate points (see `index`).

use super::line::{Flow, LineState, STEP_LIMIT, Wrench, rate, unit_columns};
use super::scaled_law::ScaledLaw;
use super::weight::Carried;
use crate::error::{Error, Result};
use crate::solve::dop853::Dop853;
use nalgebra::{Complex, Matrix3, RowVector3, Vector3};
use std::f64::consts::{PI, TAU};

/// The rod's end with variations that stay well apart under any load: their columns are mixed on the way.
#[derive(Debug, Clone)]
pub(super) struct Variations<const K: usize> {
    /// The end; columns 0..3 of its tangent keep n, columns 3..6 (if any) vary n by unit vectors.
    pub(super) end: LineState<K>,
    /// Force at the end.
    pub(super) n: Vector3<f64>,
    /// dm(0) - dw(1) of each column: what varies the couple at the end beside force and place there.
    pub(super) dm: [[f64; K]; 3],
    /// J and P at the end: conjugate variables, J^T P symmetric.
    pub(super) conjugate: (Matrix3<f64>, Matrix3<f64>),
    /// Angle of det(P + i kappa J) from clamp to end, followed without jumps: J = phi, P = dm + m x phi/2 of columns 0..3.
    pub(super) angle: f64,
    /// The weight kappa.
    pub(super) weight: f64,
    /// How much the rod makes of an error at its clamp: the size of the unmixed columns at the end over the compliance.
    pub(super) growth: f64,
}

/// The load along a rod, and its base wrench.
struct Loaded<'a, const K: usize, C: Carried<K>> {
    load: &'a C::Load,
    b: &'a Wrench,
}

/// (J, P) of columns 0..3, which keep n: P = dm(0) + n x rho - dw + m x phi/2. With the last term J^T P is symmetric.
fn conjugate<const K: usize, C: Carried<K>>(
    at: &LineState<K, C>,
    rod: &Loaded<'_, K, C>,
    dm: &[[f64; K]; 3],
) -> (Matrix3<f64>, Matrix3<f64>) {
    let block = |rows: &[[f64; K]]| Matrix3::from_fn(|i, j| rows[i][j]);
    let (m, n) = at.resultants(rod.b, rod.load);
    let j = block(&at.tangent[..3]);
    let rho = block(&at.tangent[3..]);
    let mut given = *dm;
    at.carried.take_columns(&mut given);
    let p = block(&given) + n.cross_matrix() * rho + 0.5 * m.cross_matrix() * j;
    (j, p)
}

/// det(P + i kappa J) and the rate of its angle along the rod: P' = n x rho' + (m' x phi + m x phi')/2 with a load along it, too.
fn turning<const K: usize, C: Carried<K>>(
    at: &LineState<K, C>,
    slope: &LineState<K, C>,
    rod: &Loaded<'_, K, C>,
    dm: &[[f64; K]; 3],
    weight: f64,
) -> Option<(Complex<f64>, f64)> {
    let (j, p) = conjugate(at, rod, dm);
    let block = |rows: &[[f64; K]]| Matrix3::from_fn(|i, j| rows[i][j]);
    let (m, n) = at.resultants(rod.b, rod.load);
    let dj = block(&slope.tangent[..3]);
    let dp = n.cross_matrix() * block(&slope.tangent[3..])
        + 0.5 * (n.cross(&slope.position()).cross_matrix() * j + m.cross_matrix() * dj);
    let whole = p.zip_map(&j, |p, j| Complex::new(p, weight * j));
    let rate = dp.zip_map(&dj, |p, j| Complex::new(p, weight * j));
    Some((
        whole.determinant(),
        (whole.try_inverse()? * rate).trace().im,
    ))
}

/// Follows the variations of the rod from clamp to end: `K` = 3 at constant n, `K` = 6 with variations of n.
pub(super) fn variations<const K: usize, C: Carried<K>>(
    (law, load): (&ScaledLaw, &C::Load),
    b: &Wrench,
    tolerance: f64,
) -> Result<Variations<K>> {
    let rod = &Loaded { load, b };
    let lost = || Error::no_convergence("the variations along the rod could not be followed");
    let rate = rate(law, b)?;
    let [c1, c2] = law.flexures();
    let weight = 2.0 * rate / (c1 + c2);
    let longest = 1.2 / rate;
    let [dm, dn] = unit_columns();
    let mut flow = Flow::<K, C>::new(law, load, b, dm, dn);
    let state = LineState::clamp();
    let slope = flow.slope(&state).ok_or_else(lost)?;
    let mut turn = turning(&state, &slope, rod, &flow.dm, weight).ok_or_else(lost)?;
    let mut solver = Dop853::new(state, slope, longest, tolerance);
    let mut step = solver.blank();
    let (mut angle, mut growth, mut h_max) = (0.0, 1.0, longest);
    let mut pieces = law.pieces().iter().peekable();
    while let Some(&&(_, to)) = pieces.peek() {
        let left = to - solver.state().s();
        if left <= 1e-14 {
            pieces.next();
            if let Some(&&(from, _)) = pieces.peek() {
                let state = solver.state().at(from);
                let slope = flow.slope(&state).ok_or_else(lost)?;
                turn = turning(&state, &slope, rod, &flow.dm, weight).ok_or_else(lost)?;
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
            .map_err(|_| flow.refusal.take().unwrap_or_else(lost))?;
        let next = turning(&step.to, step.end_slope(), rod, &flow.dm, weight).ok_or_else(lost)?;
        // The turn is known up to whole turns; its rates at both ends say which, if they agree with it and with each other.
        let turned = (next.0 / turn.0).arg();
        let [before, after] = [turn.1, next.1].map(|rate| step.h * rate);
        let expected = 0.5 * (before + after);
        let whole = ((expected - turned) / TAU).round() * TAU;
        let known = (turned + whole - expected).abs() < 1.0;
        if !(known && before.abs().max(after.abs()) < PI) {
            solver.rewind(step.from, step.stage_slopes()[0]);
            h_max = 0.5 * step.h;
            if solver.cost().steps > STEP_LIMIT {
                return Err(lost());
            }
            continue;
        }
        angle += turned + whole;
        h_max = longest;
        turn = next;
        let size = step.to.tangent.as_flattened().iter();
        if size.fold(0.0_f64, |size, x| size.max(x.abs())) > GROWN {
            let (mut state, mut slope) = (step.to, *step.end_slope());
            growth *= separate(&mut state, &mut slope, &mut flow, rod).ok_or_else(lost)?;
            // The mixing has a positive determinant: the angle stays.
            turn = turning(&state, &slope, rod, &flow.dm, weight).ok_or_else(lost)?;
            solver.rewind(state, slope);
        }
        if solver.cost().steps > STEP_LIMIT {
            return Err(lost());
        }
    }
    let end = *solver.state();
    let entries = end.tangent.as_flattened().iter();
    let reached = growth * entries.fold(1.0_f64, |size, x| size.max(x.abs()));
    let compliance = law.inverse(0.0, b)?.compliance.matrix().norm();
    let conjugate = conjugate(&end, rod, &flow.dm);
    let mut dm = flow.dm;
    end.carried.take_columns(&mut dm);
    Ok(Variations {
        growth: reached / compliance.max(1.0),
        n: end.resultants(b, load).1,
        end: end.bare(),
        dm,
        conjugate,
        angle,
        weight,
    })
}

/// Size of the tangent beyond which its columns are mixed.
const GROWN: f64 = 30.0;

/// Makes columns 0..3 of (J, P) orthonormal and takes their part out of the others; the equations are linear, so
/// state, slope and dm(0) mix alike. Returns the size they had.
fn separate<const K: usize, C: Carried<K>>(
    state: &mut LineState<K, C>,
    slope: &mut LineState<K, C>,
    flow: &mut Flow<'_, K, C>,
    rod: &Loaded<'_, K, C>,
) -> Option<f64> {
    let (j, p) = conjugate(state, rod, &flow.dm);
    let gram = j.transpose() * j + p.transpose() * p;
    let mixing = gram.cholesky()?.l().transpose().try_inverse()?;
    for row in rows(state, slope, flow) {
        let mixed = RowVector3::new(row[0], row[1], row[2]) * mixing;
        row[..3].copy_from_slice(mixed.as_slice());
    }
    let (j, p) = (j * mixing, p * mixing);
    for column in 3..K {
        let entry = |rows: &[[f64; K]]| Vector3::from_fn(|i, _| rows[i][column]);
        let (phi, rho) = (entry(&state.tangent[..3]), entry(&state.tangent[3..]));
        let (m, n) = state.resultants(rod.b, rod.load);
        let mut given = flow.dm;
        state.carried.take_columns(&mut given);
        let dm = entry(&given) + n.cross(&rho) + 0.5 * m.cross(&phi);
        let part = j.transpose() * phi + p.transpose() * dm;
        for row in rows(state, slope, flow) {
            row[column] -= part[0] * row[0] + part[1] * row[1] + part[2] * row[2];
        }
    }
    Some(gram.trace().sqrt())
}

/// Everything that mixes alike.
fn rows<'a, const K: usize, C: Carried<K>>(
    state: &'a mut LineState<K, C>,
    slope: &'a mut LineState<K, C>,
    flow: &'a mut Flow<'_, K, C>,
) -> impl Iterator<Item = &'a mut [f64; K]> {
    (state.tangent.iter_mut())
        .chain(slope.tangent.iter_mut())
        .chain(flow.dm.iter_mut())
        .chain(state.carried.columns())
        .chain(slope.carried.columns())
}
