//! Equilibrium of a rod from its base wrench: an initial-value problem from the clamp (theory Sec. 3).
//!
//! Dimension-free, in the frame of the clamp: arclength sigma = s/L in [0, 1], couples in B/L, forces in B/L^2,
//! energies in B/L. The balance laws are solved: n is constant and m(s) = m(0) - r x n, so that |n| and n.m hold
//! exactly (under a load along the rod see `distributed_load`). Frame and centreline are left to integrate,
//!
//! ```text
//! R' = R [u]x,   r' = R v,   (u, v) = e(R^T m, R^T n, s),
//! ```
//!
//! the rotation as a quaternion q' = q (0, u)/2 whose length does not matter: R(q) divides by |q|^2, so the directors
//! are orthonormal to rounding whatever the step. The tangent is integrated alongside: with dR = [phi]x R, dr = rho
//!
//! ```text
//! phi' = R (C_uu R^T tau + C_uv R^T nu),   rho' = phi x R v + R (C_vu R^T tau + C_vv R^T nu),
//! tau = dm(0) - r x dn - rho x n + m x phi,   nu = dn + n x phi.
//! ```

use super::collocation::Collocated;
use super::distributed_load::{LoadState, Place};
use super::scaled_law::ScaledLaw;
use crate::error::{Error, Result};
use crate::math::se3::Turn;
use crate::section::Compliance;
use crate::solve::cost::Cost;
use crate::solve::dop853::{Dop853, State, Step};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};

/// A base wrench (m(0), n): couple and force in the frame of the clamp.
pub type Wrench = Vector6<f64>;

/// Number of columns of a rod whose law varies in time: one, d/dt at a given base wrench. The power of the drive is in
/// place of the energy.
pub(super) const TIME: usize = 1;

/// Frame, centreline, energy and `K` columns of the tangent at one section; `C` is the additional state of a load
/// along the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LineState<const K: usize, C = ()> {
    pub(super) s: f64,
    q: [f64; 4],
    r: [f64; 3],
    energy: f64,
    /// phi (three rows), then rho (three rows).
    pub(super) tangent: [[f64; K]; 6],
    pub(super) carried: C,
}

impl<const K: usize, C: LoadState<K>> LineState<K, C> {
    /// The clamp: no displacement, no rotation.
    pub(super) fn clamp() -> Self {
        Self {
            s: 0.0,
            q: [1.0, 0.0, 0.0, 0.0],
            r: [0.0; 3],
            energy: 0.0,
            tangent: [[0.0; K]; 6],
            carried: C::NOTHING,
        }
    }

    /// The end of the rod: frame and centreline, energy, and the tangent by columns.
    pub(super) fn from_end_data(
        q: [f64; 4],
        r: [f64; 3],
        energy: f64,
        columns: &[[f64; 6]; K],
    ) -> Self {
        Self {
            s: 1.0,
            q,
            r,
            energy,
            tangent: std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])),
            carried: C::NOTHING,
        }
    }

    /// A section at `s`, with its directors as columns and the energy up to it: nothing of the load is taken yet.
    pub(super) fn at_section(
        s: f64,
        rotation: &Matrix3<f64>,
        r: &Vector3<f64>,
        energy: f64,
    ) -> Self {
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation));
        Self {
            s,
            q: [q.w, q.i, q.j, q.k],
            r: (*r).into(),
            energy,
            ..Self::clamp()
        }
    }

    /// Arclength.
    pub(super) fn s(&self) -> f64 {
        self.s
    }

    /// Mutable reference to the arclength.
    pub(super) fn place(&mut self) -> &mut f64 {
        &mut self.s
    }

    /// The state at another arclength `s`, to step over a break of the law.
    pub(super) fn at(&self, s: f64) -> Self {
        Self { s, ..*self }
    }

    /// Position.
    pub(super) fn position(&self) -> Vector3<f64> {
        Vector3::from(self.r)
    }

    /// Directors d1, d2, d3 as columns.
    pub(super) fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&directors(&self.q).map(Vector3::from))
    }

    /// The rotation as a unit quaternion.
    pub(super) fn turn(&self) -> Turn {
        Turn::from(self.q).normalize()
    }

    /// Stored energy between clamp and section.
    pub(super) fn energy(&self) -> f64 {
        self.energy
    }

    /// Steps over a break of the integration at `s`, with the forces and couples there.
    pub(super) fn cross(&mut self, load: &C::Load, s: f64) {
        let (d, r) = (directors(&self.q), self.r);
        let (phi, rho) = halves(&self.tangent);
        let place = Place {
            d: &d,
            r: &r,
            phi,
            rho,
        };
        self.carried.cross(load, s, &place);
    }

    /// This section as the start of a stretch: columns 6..9 are its turn, and nothing of the load is taken yet.
    pub(super) fn as_start(&self) -> Self {
        let mut start = Self {
            tangent: [[0.0; K]; 6],
            carried: C::NOTHING,
            ..*self
        };
        for j in 6..K {
            start.tangent[j - 6][j] = 1.0;
        }
        start
    }

    /// This state without the part of the load.
    pub(super) fn without_load(&self) -> LineState<K> {
        LineState {
            s: self.s,
            q: self.q,
            r: self.r,
            energy: self.energy,
            tangent: self.tangent,
            carried: (),
        }
    }

    /// (m, n) at the section under the base wrench `b`, in the clamp's frame.
    pub(super) fn resultants(&self, b: &Wrench, load: &C::Load) -> (Vector3<f64>, Vector3<f64>) {
        let n = Vector3::from(self.carried.force(load, &[b[3], b[4], b[5]], self.s));
        let mut m = Vector3::new(b[0], b[1], b[2]) - self.position().cross(&n);
        self.carried.subtract_couple(m.as_mut());
        (m, n)
    }
}

impl<const K: usize, C: LoadState<K>> State for LineState<K, C> {
    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.s += a * x.s;
        self.energy += a * x.energy;
        for i in 0..4 {
            self.q[i] += a * x.q[i];
        }
        for i in 0..3 {
            self.r[i] += a * x.r[i];
        }
        for i in 0..6 {
            for j in 0..K {
                self.tangent[i][j] += a * x.tangent[i][j];
            }
        }
        self.carried.axpy(a, &x.carried);
    }

    /// Error norm: frame and centreline in units of their size, which is about 1; energy and every entry of the
    /// tangent relative to 1 + their size. The tangent multiplies wrenches that are known to the tolerance.
    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        let mut sum = (self.energy / (1.0 + to.energy.abs())).powi(2);
        sum += self.q.iter().map(|e| e * e).sum::<f64>();
        sum += self.r.iter().map(|e| e * e).sum::<f64>();
        let mut tangent = 0.0;
        for i in 0..6 {
            for j in 0..K {
                let scale = 1.0 + from.tangent[i][j].abs().max(to.tangent[i][j].abs());
                tangent += (self.tangent[i][j] / scale).powi(2);
            }
        }
        let (before, after) = (&from.carried, &to.carried);
        (self.carried).add_errors(before, after, &mut sum, &mut tangent);
        // The larger of the two, since many small columns must not hide a poor shape.
        let shape = sum / 4.0;
        if K == 0 {
            shape
        } else {
            shape.max(tangent / (3.0 * K as f64))
        }
    }
}

/// Directors of a quaternion of any length > 0.
#[inline]
pub(super) fn directors(q: &[f64; 4]) -> [[f64; 3]; 3] {
    let [w, x, y, z] = *q;
    let scale = 2.0 / (w * w + x * x + y * y + z * z);
    let (wx, wy, wz) = (scale * w * x, scale * w * y, scale * w * z);
    let (xx, xy, xz) = (scale * x * x, scale * x * y, scale * x * z);
    let (yy, yz, zz) = (scale * y * y, scale * y * z, scale * z * z);
    [
        [1.0 - (yy + zz), xy + wz, xz - wy],
        [xy - wz, 1.0 - (xx + zz), yz + wx],
        [xz + wy, yz - wx, 1.0 - (xx + yy)],
    ]
}

#[inline]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// sum_k x_k d_k.
#[inline]
fn combine_directors(d: &[[f64; 3]; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| x[0] * d[0][i] + x[1] * d[1][i] + x[2] * d[2][i])
}

/// phi and rho of a tangent, as arrays of known length: no bound is checked.
#[inline]
fn halves<const K: usize>(tangent: &[[f64; K]; 6]) -> (&[[f64; K]; 3], &[[f64; K]; 3]) {
    let (phi, rho) = tangent.split_at(3);
    (
        phi.try_into().expect("three rows"),
        rho.try_into().expect("three rows"),
    )
}

#[inline]
fn halves_mut<const K: usize>(
    tangent: &mut [[f64; K]; 6],
) -> (&mut [[f64; K]; 3], &mut [[f64; K]; 3]) {
    let (phi, rho) = tangent.split_at_mut(3);
    (
        phi.try_into().expect("three rows"),
        rho.try_into().expect("three rows"),
    )
}

/// a x B column by column, B of three rows.
#[inline]
fn cross_columns<const K: usize>(a: &[f64; 3], b: &[[f64; K]; 3]) -> [[f64; K]; 3] {
    let mut c = [[0.0; K]; 3];
    for j in 0..K {
        c[0][j] = a[1] * b[2][j] - a[2] * b[1][j];
        c[1][j] = a[2] * b[0][j] - a[0] * b[2][j];
        c[2][j] = a[0] * b[1][j] - a[1] * b[0][j];
    }
    c
}

/// c += A b column by column.
#[inline]
fn add_product<const K: usize>(c: &mut [[f64; K]; 3], a: &[[f64; 3]; 3], b: &[[f64; K]; 3]) {
    for i in 0..3 {
        for j in 0..K {
            c[i][j] += a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
        }
    }
}

/// R diag(c) R^T.
#[inline]
fn turned_diagonal(d: &[[f64; 3]; 3], c: &[f64; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            c[0] * d[0][i] * d[0][j] + c[1] * d[1][i] * d[1][j] + c[2] * d[2][i] * d[2][j]
        })
    })
}

/// R C R^T for the 3 x 3 block of C at (row, column).
fn turned_block(d: &[[f64; 3]; 3], c: &Matrix6<f64>, row: usize, column: usize) -> [[f64; 3]; 3] {
    // C R^T first.
    let half: [[f64; 3]; 3] = std::array::from_fn(|k| {
        std::array::from_fn(|j| (0..3).map(|l| c[(row + k, column + l)] * d[l][j]).sum())
    });
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| d[k][i] * half[k][j]).sum()))
}

/// Right-hand side for one base wrench: n, m at the start of the integration, and their variations by columns.
pub(super) struct WrenchFlow<'a, const K: usize, C: LoadState<K> = ()> {
    law: &'a ScaledLaw,
    load: &'a C::Load,
    m: [f64; 3],
    n: [f64; 3],
    pub(super) dm: [[f64; K]; 3],
    dn: [[f64; K]; 3],
    pub(super) refusal: Option<Error>,
}

impl<'a, const K: usize, C: LoadState<K>> WrenchFlow<'a, K, C> {
    pub(super) fn new(
        law: &'a ScaledLaw,
        load: &'a C::Load,
        b: &Wrench,
        dm: [[f64; K]; 3],
        dn: [[f64; K]; 3],
    ) -> Self {
        Self {
            law,
            load,
            m: [b[0], b[1], b[2]],
            n: [b[3], b[4], b[5]],
            dm,
            dn,
            refusal: None,
        }
    }

    pub(super) fn slope(&mut self, at: &LineState<K, C>) -> Option<LineState<K, C>> {
        let mut slope = LineState::clamp();
        self.write_slope(at, &mut slope)?;
        Some(slope)
    }

    pub(super) fn write_slope(
        &mut self,
        at: &LineState<K, C>,
        slope: &mut LineState<K, C>,
    ) -> Option<()> {
        let d = directors(&at.q);
        let n = &at.carried.force(self.load, &self.n, at.s);
        let rxn = cross(&at.r, n);
        let mut m: [f64; 3] = std::array::from_fn(|i| self.m[i] - rxn[i]);
        at.carried.subtract_couple(&mut m);
        let local = Vector6::new(
            dot(&d[0], &m),
            dot(&d[1], &m),
            dot(&d[2], &m),
            dot(&d[0], n),
            dot(&d[1], n),
            dot(&d[2], n),
        );
        let inverse = match self.law.inverse(at.s, &local) {
            Ok(inverse) => inverse,
            Err(why) => {
                self.refusal = Some(why);
                return None;
            }
        };
        let e = &inverse.strain;
        let [w, x, y, z] = at.q;
        let (u1, u2, u3) = (0.5 * e[0], 0.5 * e[1], 0.5 * e[2]);
        let r = combine_directors(&d, &[e[3], e[4], e[5]]);
        slope.s = 1.0;
        slope.q = [
            -(x * u1 + y * u2 + z * u3),
            w * u1 + y * u3 - z * u2,
            w * u2 + z * u1 - x * u3,
            w * u3 + x * u2 - y * u1,
        ];
        slope.r = r;
        slope.energy = inverse.energy;
        let (phi, rho) = halves(&at.tangent);
        let place = Place {
            d: &d,
            r: &at.r,
            phi,
            rho,
        };
        slope.carried = C::slope(self.load, at.s, &place);
        if K > 0 {
            let mut tau = cross_columns(&m, phi);
            let mut dn = self.dn;
            if let Some(taken) = at.carried.taken_force() {
                for i in 0..3 {
                    for j in 0..K {
                        dn[i][j] -= taken[i][j];
                    }
                }
            }
            let lever = cross_columns(&at.r, &dn);
            let pull = cross_columns(n, rho);
            let mut nu = cross_columns(n, phi);
            for i in 0..3 {
                for j in 0..K {
                    tau[i][j] += self.dm[i][j] - lever[i][j] + pull[i][j];
                    nu[i][j] += dn[i][j];
                }
            }
            at.carried.take_columns(&mut tau);
            let carried = cross_columns(&r, phi);
            let (dphi, drho) = halves_mut(&mut slope.tangent);
            for i in 0..3 {
                for j in 0..K {
                    dphi[i][j] = 0.0;
                    drho[i][j] = -carried[i][j];
                }
            }
            match &*inverse.compliance {
                Compliance::Diagonal(c) => {
                    add_product(dphi, &turned_diagonal(&d, &[c[0], c[1], c[2]]), &tau);
                    if c[3] != 0.0 || c[4] != 0.0 || c[5] != 0.0 {
                        add_product(drho, &turned_diagonal(&d, &[c[3], c[4], c[5]]), &nu);
                    }
                }
                Compliance::Full(c) => {
                    add_product(dphi, &turned_block(&d, c, 0, 0), &tau);
                    add_product(dphi, &turned_block(&d, c, 0, 3), &nu);
                    add_product(drho, &turned_block(&d, c, 3, 0), &tau);
                    add_product(drho, &turned_block(&d, c, 3, 3), &nu);
                }
            }
        }
        if K == TIME {
            match self.law.rates(at.s, e, &local) {
                Ok(None) => slope.energy = 0.0,
                Ok(Some(rates)) => {
                    // At given resultants w = W_e(e, t), and so W_ee e_t = -W_et.
                    let faster = &*inverse.compliance * &-rates.resultants;
                    let (dphi, drho) = halves_mut(&mut slope.tangent);
                    let bend = combine_directors(&d, &[faster[0], faster[1], faster[2]]);
                    let stretch = combine_directors(&d, &[faster[3], faster[4], faster[5]]);
                    for i in 0..3 {
                        dphi[i][0] += bend[i];
                        drho[i][0] += stretch[i];
                    }
                    slope.energy = rates.power;
                }
                Err(why) => {
                    self.refusal = Some(why);
                    return None;
                }
            }
        }
        slope.q.iter().all(|x| x.is_finite()).then_some(())
    }
}

impl<const K: usize, C: LoadState<K>> WrenchFlow<'_, K, C> {
    /// Error of an integration that cannot go on at s.
    pub(super) fn integration_error(&mut self, s: f64) -> Error {
        let b: Wrench = Vector6::from_fn(|i, _| [self.m, self.n][i / 3][i % 3]);
        integration_error(self.law, &b, self.refusal.take(), s)
    }
}

/// Error of an integration that cannot go on at s, possibly since the law refused.
pub(super) fn integration_error(
    law: &ScaledLaw,
    b: &Wrench,
    refusal: Option<Error>,
    s: f64,
) -> Error {
    let why = refusal.unwrap_or_else(|| {
        Error::no_convergence(format!(
            "the integration along the rod cannot go on; the base wrench is too large: {}",
            law.wrench_text(b)
        ))
    });
    why.context(format!("at s = {s:.6} of the length"))
}

/// Most steps of an integration: reached by a rod wound up thousands of times.
pub(super) const STEP_LIMIT: u64 = 2_000;

/// Rate of change of the rod's variables along s. Sets the first step and bounds the steps of the index.
pub(super) fn rate(law: &ScaledLaw, b: &Wrench) -> Result<f64> {
    let inverse = law.inverse(0.0, b)?;
    let c = inverse.compliance.matrix().fixed_view::<3, 3>(0, 0).norm();
    let force = b.fixed_rows::<3>(3).norm();
    Ok(1.0 + inverse.strain.fixed_rows::<3>(0).norm() + (c * force).sqrt())
}

/// First step, which the integrator's error control then improves.
pub(super) fn first_step(law: &ScaledLaw, b: &Wrench, tolerance: f64) -> Result<f64> {
    Ok((6.0 * tolerance.powf(0.125) / rate(law, b)?).min(1.0))
}

/// Access to the arclength of a state, and the function that takes a state over a break.
pub(super) struct Passage<S, X: Fn(&mut S, f64)> {
    pub place: fn(&mut S) -> &mut f64,
    pub cross: X,
}

/// Integrates `flow` over the pieces of the rod from `start`, at s = 0, and shows every accepted step. `first` is the
/// first step.
///
/// # Errors
/// The arclength at which the integration fails.
pub(super) fn over_pieces<
    S: State + Copy,
    X: Fn(&mut S, f64),
    F: FnMut(&S, &mut S) -> Option<()>,
>(
    law: &ScaledLaw,
    start: S,
    Passage { place, cross }: Passage<S, X>,
    first: f64,
    tolerance: f64,
    mut flow: F,
    mut each: impl FnMut(&Step<S>, &mut F),
) -> std::result::Result<(S, Cost), f64> {
    let mut state = start;
    let mut slope = start;
    flow(&state, &mut slope).ok_or(0.0)?;
    let mut solver = Dop853::new(state, slope, first, tolerance);
    let mut step = solver.blank();
    let mut end = 0.0;
    for (k, &(from, to)) in law.pieces().iter().enumerate() {
        if k > 0 {
            // Slope on the far side of the break.
            state = *solver.state();
            cross(&mut state, 0.5 * (end + from));
            *place(&mut state) = from;
            flow(&state, &mut slope).ok_or(from)?;
            solver.rewind(state, slope);
        }
        loop {
            state = *solver.state();
            let s = *place(&mut state);
            if to - s <= 1e-14 {
                break;
            }
            let taken = solver.step_into(&mut flow, to - s, &mut step);
            if taken.is_err() || solver.cost().steps > STEP_LIMIT {
                return Err(s);
            }
            each(&step, &mut flow);
        }
        end = to;
    }
    Ok((*solver.state(), solver.cost()))
}

/// Integrates over the pieces of the law and shows every accepted step. The columns of the tangent begin as those of
/// `start`.
pub(super) fn integrate<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    start: (LineState<K, C>, [[[f64; K]; 3]; 2]),
    tolerance: f64,
    mut each: impl FnMut(
        &Step<LineState<K, C>>,
        &mut dyn FnMut(&LineState<K, C>) -> Option<LineState<K, C>>,
    ),
) -> Result<(LineState<K, C>, Cost)> {
    let (clamp, [dm, dn]) = start;
    let mut flow = WrenchFlow::<K, C>::new(law, load, b, dm, dn);
    let first = first_step(law, b, tolerance)?;
    let found = over_pieces(
        law,
        clamp,
        Passage {
            place: LineState::place,
            cross: |state: &mut LineState<K, C>, s| state.cross(load, s),
        },
        first,
        tolerance,
        |at, slope| flow.write_slope(at, slope),
        |step, flow| {
            each(step, &mut |at| {
                let mut slope = LineState::clamp();
                flow(at, &mut slope)?;
                Some(slope)
            })
        },
    );
    found.map_err(|s| flow.integration_error(s))
}

/// Unit columns: d/dm(0) for 0..3 and d/dn for 3..6.
pub(super) fn unit_columns<const K: usize>() -> [[[f64; K]; 3]; 2] {
    let mut columns = [[[0.0; K]; 3]; 2];
    for j in 0..K.min(6) {
        columns[j / 3][j % 3][j] = 1.0;
    }
    columns
}

/// Clamp with unit columns; columns 6..9 are its turn at a given base wrench and load.
pub(super) fn clamp_with_columns<const K: usize, C: LoadState<K>>()
-> (LineState<K, C>, [[[f64; K]; 3]; 2]) {
    let mut clamp = LineState::clamp();
    for j in 6..K {
        clamp.tangent[j - 6][j] = 1.0;
    }
    (clamp, unit_columns())
}

/// End of the rod with `K` columns: 0 for the shape alone, 3 for d/dm(0), 6 for the whole tangent, 9 with a turn of
/// the clamp.
pub(super) fn end<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    tolerance: f64,
) -> Result<(LineState<K>, Cost)> {
    if let Some(rod) = Collocated::of(law) {
        return rod.end(b, 0, tolerance);
    }
    loaded_end(law, &(), b, tolerance)
}

/// End of a rod under a load along it.
pub(super) fn loaded_end<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    tolerance: f64,
) -> Result<(LineState<K, C>, Cost)> {
    let (mut end, cost) = integrate(law, load, b, clamp_with_columns(), tolerance, |_, _| ())?;
    end.cross(load, 1.0);
    Ok((end, cost))
}

/// End of a rod whose law varies in time, with the column of time.
pub(super) fn end_in_time<C: LoadState<TIME>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    tolerance: f64,
) -> Result<LineState<TIME, C>> {
    let start = (LineState::clamp(), [[[0.0; TIME]; 3]; 2]);
    integrate(law, load, b, start, tolerance, |_, _| ()).map(|(end, _)| end)
}

/// Sections between the steps of the integration, the first and the last included.
pub(super) fn steps(law: &ScaledLaw, b: &Wrench, tolerance: f64) -> Result<Vec<LineState<0>>> {
    let mut all = vec![LineState::clamp()];
    integrate(law, &(), b, clamp_with_columns(), tolerance, |step, _| {
        all.push(step.to)
    })?;
    Ok(all)
}

/// The clamp seen from the end, under the reversed law, with the columns d/dn. The axes are the directors of the end,
/// which bears the force `n` and no couple.
pub(super) fn clamp_from_end<const K: usize>(
    reversed: &ScaledLaw,
    n: &Vector3<f64>,
    tolerance: f64,
) -> Result<LineState<K>> {
    let b = Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
    if let Some(rod) = Collocated::of(reversed) {
        return rod.end(&b, 3, tolerance).map(|(end, _)| end);
    }
    let dn = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let columns = (LineState::clamp(), [[[0.0; K]; 3], dn]);
    integrate(reversed, &(), &b, columns, tolerance, |_, _| ()).map(|(end, _)| end)
}

/// Sections at the given arclengths in [0, 1], in growing order.
pub(super) fn sections<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    tolerance: f64,
    at: &[f64],
) -> Result<Vec<LineState<K>>> {
    loaded_sections(law, &(), b, tolerance, at)
}

/// Sections of a rod under a load along it, at the given arclengths in [0, 1], in growing order.
pub(super) fn loaded_sections<const K: usize, C: LoadState<K>>(
    law: &ScaledLaw,
    load: &C::Load,
    b: &Wrench,
    tolerance: f64,
    at: &[f64],
) -> Result<Vec<LineState<K, C>>> {
    let mut found = Vec::with_capacity(at.len());
    let mut next = at.iter().peekable();
    while next.next_if(|s| **s <= 0.0).is_some() {
        found.push(LineState::clamp());
    }
    let mut cost = Cost::default();
    let mut lost = false;
    let (last, _) = integrate(law, load, b, clamp_with_columns(), tolerance, |step, f| {
        // Recomputed at full order, not interpolated: a reader may differentiate the printed values.
        while let Some(s) = next.next_if(|s| **s <= step.to.s) {
            let part = s - step.from.s;
            match step.redo(&mut *f, part, &mut cost) {
                Some(there) => found.push(there.to),
                None => lost = true,
            }
        }
    })?;
    if lost {
        return Err(Error::no_convergence(
            "a section inside a step along the rod could not be computed: the section law refuses its resultants",
        ));
    }
    for _ in next {
        found.push(last);
    }
    Ok(found)
}
