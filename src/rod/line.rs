//! The equilibrium of a rod from its base wrench: an initial-value problem from the clamp (theory Sec. 3).
//!
//! Dimension-free, in the frame of the clamp: arclength sigma = s/L in [0, 1], couples in B/L, forces in B/L^2,
//! energies in B/L. The balance laws are solved: n is constant and m(s) = m(0) - r x n, so that |n| and n.m hold
//! exactly. Left to integrate are frame and centreline,
//!
//! ```text
//! R' = R [u]x,   r' = R v,   (u, v) = e(R^T m, R^T n, s),
//! ```
//!
//! the rotation as a quaternion q' = q (0, u)/2 whose length does not matter: R(q) divides by |q|^2, so the directors
//! are orthonormal to rounding whatever the step. The tangent is carried along: with dR = [phi]x R, dr = rho
//!
//! ```text
//! phi' = R (C_uu R^T tau + C_uv R^T nu),   rho' = phi x R v + R (C_vu R^T tau + C_vv R^T nu),
//! tau = dm(0) - r x dn - rho x n + m x phi,   nu = dn + n x phi.
//! ```

use super::section::{Compliance, SectionLaw, UniformLinear};
use crate::error::{Error, Result};
use crate::solve::dop853::{Dop853, State, Step, Work};
use nalgebra::{Complex, Matrix3, Matrix6, RowVector3, Vector3, Vector6};
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

/// A base wrench (m(0), n): couple and force in the frame of the clamp.
pub type Wrench = Vector6<f64>;

/// Frame, centreline, energy and `K` columns of the tangent at one section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Section<const K: usize> {
    s: f64,
    q: [f64; 4],
    r: [f64; 3],
    energy: f64,
    /// phi (three rows), then rho (three rows).
    pub(super) tangent: [[f64; K]; 6],
}

impl<const K: usize> Section<K> {
    /// The clamp: no displacement, no rotation.
    pub(super) fn clamp() -> Self {
        Self {
            s: 0.0,
            q: [1.0, 0.0, 0.0, 0.0],
            r: [0.0; 3],
            energy: 0.0,
            tangent: [[0.0; K]; 6],
        }
    }

    /// Arclength.
    pub(super) fn s(&self) -> f64 {
        self.s
    }

    /// Position.
    pub(super) fn position(&self) -> Vector3<f64> {
        Vector3::from(self.r)
    }

    /// Directors d1, d2, d3 as columns.
    pub(super) fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&directors(&self.q).map(Vector3::from))
    }

    /// Stored energy from the clamp to here.
    pub(super) fn energy(&self) -> f64 {
        self.energy
    }
}

impl<const K: usize> State for Section<K> {
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
    }

    /// Frame and centreline count by their own size; the tangent by the largest entry of each column's half, since it
    /// multiplies wrenches that are known to the tolerance.
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
        // The worse of the two, so that many small columns do not hide a poor shape.
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
fn directors(q: &[f64; 4]) -> [[f64; 3]; 3] {
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
fn along(d: &[[f64; 3]; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| x[0] * d[0][i] + x[1] * d[1][i] + x[2] * d[2][i])
}

/// phi and rho of a tangent, as arrays: their lengths are known, so no bound is checked.
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
    // Half first: C R^T.
    let half: [[f64; 3]; 3] = std::array::from_fn(|k| {
        std::array::from_fn(|j| (0..3).map(|l| c[(row + k, column + l)] * d[l][j]).sum())
    });
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| d[k][i] * half[k][j]).sum()))
}

/// A section law in dimension-free form, its inverse hoisted if it is linear and uniform.
#[derive(Debug, Clone)]
pub(super) struct ScaledLaw {
    law: std::sync::Arc<dyn SectionLaw>,
    hoisted: Option<UniformLinear>,
    length: f64,
    stiffness: f64,
    /// Where the integration stops and starts again, in (0, 1), and 1.
    pieces: Vec<f64>,
    /// Flexures and twist added to the law's: the imperfection of a continuation.
    bend: Vector3<f64>,
    /// 1 from the clamp to the end, -1 from the end to the clamp.
    sense: f64,
}

impl ScaledLaw {
    pub(super) fn new(
        law: std::sync::Arc<dyn SectionLaw>,
        length: f64,
        stiffness: f64,
    ) -> Result<Self> {
        let mut pieces: Vec<f64> = law.breaks().iter().map(|s| s / length).collect();
        if pieces.windows(2).any(|pair| !(pair[0] < pair[1])) || pieces.iter().any(|s| s.is_nan()) {
            return Err(Error::domain(format!(
                "the section law's breaks {pieces:?} (in s/length) are not in growing order"
            )));
        }
        pieces.retain(|s| *s > 0.0 && *s < 1.0);
        pieces.push(1.0);
        let mut scaled = Self {
            hoisted: None,
            law,
            length,
            stiffness,
            pieces,
            bend: Vector3::zeros(),
            sense: 1.0,
        };
        scaled.hoisted = scaled.law.uniform_linear().map(|linear| UniformLinear {
            rest: scaled.strain_in(&linear.rest),
            compliance: scaled.compliance_in(&linear.compliance),
        });
        Ok(scaled)
    }

    /// The law with flexures and twist added.
    pub(super) fn bent(&self, bend: Vector3<f64>) -> Self {
        let mut bent = self.clone();
        if let Some(linear) = &mut bent.hoisted {
            for i in 0..3 {
                linear.rest[i] += self.sense * (bend[i] - self.bend[i]);
            }
        }
        bent.bend = bend;
        bent
    }

    /// The law seen from the end of the rod: s counts from there, and frame and centreline run backwards, as if every strain
    /// had changed its sign.
    pub(super) fn reversed(&self) -> Self {
        let mut reversed = self.clone();
        reversed.sense = -self.sense;
        if let Some(linear) = &mut reversed.hoisted {
            linear.rest = -linear.rest;
            linear.compliance = linear.compliance.times(-1.0);
        }
        let inner = self.pieces.iter().rev().skip(1).map(|s| 1.0 - s);
        reversed.pieces = inner.chain([1.0]).collect();
        reversed
    }

    /// The law without dimensions, if it is linear and uniform.
    pub(super) fn uniform(&self) -> Option<&UniformLinear> {
        self.hoisted.as_ref()
    }

    /// Where an integration stops and starts again, in (0, 1), and 1.
    pub(super) fn pieces(&self) -> &[f64] {
        &self.pieces
    }

    /// As [`SectionLaw::planar_about`].
    pub(super) fn planar_about(&self) -> [bool; 2] {
        self.law.planar_about()
    }

    /// Flexural compliances about d1 and d2 of the unloaded clamp.
    pub(super) fn flexures(&self) -> [f64; 2] {
        self.inverse(0.0, &Vector6::zeros()).map_or([1.0; 2], |at| {
            let c = at.compliance.matrix();
            [c[(0, 0)], c[(1, 1)]]
        })
    }

    /// The unloaded flexure, if the law is uniform, linear, untwisted and the same in all planes through d3 but for it.
    pub(super) fn is_isotropic(&self) -> Option<Vector3<f64>> {
        let linear = self.hoisted.as_ref()?;
        let Compliance::Diagonal(c) = &linear.compliance else {
            return None;
        };
        let rest = &linear.rest;
        let same =
            c[0] == c[1] && c[3] == c[4] && rest[2] == 0.0 && rest[3] == 0.0 && rest[4] == 0.0;
        same.then(|| Vector3::new(rest[0], rest[1], 0.0))
    }

    fn strain_in(&self, e: &Vector6<f64>) -> Vector6<f64> {
        let l = self.length;
        Vector6::new(l * e[0], l * e[1], l * e[2], e[3], e[4], e[5])
    }

    fn compliance_in(&self, c: &Compliance) -> Compliance {
        let (b, l) = (self.stiffness, self.length);
        // u L = C_uu (B/L) L m; v = C_vv (B/L^2) n.
        let weight = |i: usize| if i < 3 { 1.0 } else { 1.0 / l };
        match c {
            Compliance::Diagonal(c) => {
                Compliance::Diagonal(Vector6::from_fn(|i, _| b * weight(i).powi(2) * c[i]))
            }
            Compliance::Full(c) => Compliance::Full(Matrix6::from_fn(|i, j| {
                b * weight(i) * weight(j) * c[(i, j)]
            })),
        }
    }

    /// Strains and energy under the local resultants `w`, and the compliance, lent if it is hoisted.
    #[inline]
    pub(super) fn inverse(&self, s: f64, w: &Vector6<f64>) -> Result<Response<'_>> {
        if let Some(linear) = &self.hoisted {
            let change = &linear.compliance * w;
            return Ok(Response {
                strain: linear.rest + change,
                energy: 0.5 * self.sense * w.dot(&change),
                compliance: Cow::Borrowed(&linear.compliance),
            });
        }
        let (b, l) = (self.stiffness, self.length);
        let (couple, force) = (b / l, b / (l * l));
        let user = Vector6::new(
            couple * w[0],
            couple * w[1],
            couple * w[2],
            force * w[3],
            force * w[4],
            force * w[5],
        );
        let s = if self.sense < 0.0 { 1.0 - s } else { s };
        let inverse = self.law.inverse(s * l, &user)?;
        let mut strain = self.strain_in(&inverse.strain);
        for i in 0..3 {
            strain[i] += self.bend[i];
        }
        let compliance = self.compliance_in(&inverse.compliance);
        Ok(Response {
            strain: strain * self.sense,
            energy: inverse.energy / force,
            compliance: Cow::Owned(compliance.times(self.sense)),
        })
    }
}

/// What a section does under its resultants.
pub(super) struct Response<'a> {
    pub(super) strain: Vector6<f64>,
    pub(super) energy: f64,
    pub(super) compliance: Cow<'a, Compliance>,
}

/// The right-hand side for one base wrench: n, m at the start of the integration, and their variations by columns.
struct Flow<'a, const K: usize> {
    law: &'a ScaledLaw,
    m: [f64; 3],
    n: [f64; 3],
    dm: [[f64; K]; 3],
    dn: [[f64; K]; 3],
    refusal: Option<Error>,
}

impl<'a, const K: usize> Flow<'a, K> {
    fn new(law: &'a ScaledLaw, b: &Wrench, dm: [[f64; K]; 3], dn: [[f64; K]; 3]) -> Self {
        Self {
            law,
            m: [b[0], b[1], b[2]],
            n: [b[3], b[4], b[5]],
            dm,
            dn,
            refusal: None,
        }
    }

    fn slope(&mut self, at: &Section<K>) -> Option<Section<K>> {
        let mut slope = Section::clamp();
        self.write_slope(at, &mut slope)?;
        Some(slope)
    }

    fn write_slope(&mut self, at: &Section<K>, slope: &mut Section<K>) -> Option<()> {
        let d = directors(&at.q);
        let n = &self.n;
        let rxn = cross(&at.r, n);
        let m: [f64; 3] = std::array::from_fn(|i| self.m[i] - rxn[i]);
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
        let r = along(&d, &[e[3], e[4], e[5]]);
        slope.s = 1.0;
        slope.q = [
            -(x * u1 + y * u2 + z * u3),
            w * u1 + y * u3 - z * u2,
            w * u2 + z * u1 - x * u3,
            w * u3 + x * u2 - y * u1,
        ];
        slope.r = r;
        slope.energy = inverse.energy;
        if K > 0 {
            let (phi, rho) = halves(&at.tangent);
            let mut tau = cross_columns(&m, phi);
            let lever = cross_columns(&at.r, &self.dn);
            let pull = cross_columns(n, rho);
            let mut nu = cross_columns(n, phi);
            for i in 0..3 {
                for j in 0..K {
                    tau[i][j] += self.dm[i][j] - lever[i][j] + pull[i][j];
                    nu[i][j] += self.dn[i][j];
                }
            }
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
        slope.q.iter().all(|x| x.is_finite()).then_some(())
    }
}

/// Steps beyond which an integration is given up: a rod wound up thousands of times.
pub(super) const STEP_LIMIT: u64 = 2_000;

/// A rate of change of the rod's variables along s that sets the first step and bounds the steps of the index.
pub(super) fn rate(law: &ScaledLaw, b: &Wrench) -> Result<f64> {
    let inverse = law.inverse(0.0, b)?;
    let c = inverse.compliance.matrix().fixed_view::<3, 3>(0, 0).norm();
    let force = b.fixed_rows::<3>(3).norm();
    Ok(1.0 + inverse.strain.fixed_rows::<3>(0).norm() + (c * force).sqrt())
}

/// A first step for the integrator's error control to improve.
pub(super) fn first_step(law: &ScaledLaw, b: &Wrench, tolerance: f64) -> Result<f64> {
    Ok((6.0 * tolerance.powf(0.125) / rate(law, b)?).min(1.0))
}

/// Integrates from the clamp to s = 1 and shows every accepted step.
fn integrate<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    columns: [[[f64; K]; 3]; 2],
    tolerance: f64,
    mut each: impl FnMut(&Step<Section<K>>, &mut dyn FnMut(&Section<K>) -> Option<Section<K>>),
) -> Result<(Section<K>, Work)> {
    let start = Section::<K>::clamp();
    let [dm, dn] = columns;
    let mut flow = Flow::new(law, b, dm, dn);
    let stuck = |refusal: Option<Error>, s: f64| {
        let why = refusal.unwrap_or_else(|| {
            Error::no_convergence(format!(
                "the integration along the rod cannot go on; the base wrench {:?} (units B/L, B/L^2) is too large",
                b.as_slice()
            ))
        });
        why.context(format!("at s = {s:.6} of the length"))
    };
    let h = first_step(law, b, tolerance)?;
    let slope = flow
        .slope(&start)
        .ok_or_else(|| stuck(flow.refusal.take(), 0.0))?;
    let mut solver = Dop853::new(start, slope, h, tolerance);
    let mut step = solver.blank();
    for &end in &law.pieces {
        loop {
            let s = solver.state().s;
            let left = end - s;
            if left <= 1e-14 {
                break;
            }
            if solver
                .step_into(|x, slope| flow.write_slope(x, slope), left, &mut step)
                .is_err()
            {
                return Err(stuck(flow.refusal.take(), s));
            }
            each(&step, &mut |x| flow.slope(x));
            if solver.work().steps > STEP_LIMIT {
                return Err(stuck(None, s));
            }
        }
    }
    Ok((*solver.state(), solver.work()))
}

/// Unit columns: d/dm(0) for 0..3 and d/dn for 3..6.
fn unit_columns<const K: usize>() -> [[[f64; K]; 3]; 2] {
    let mut columns = [[[0.0; K]; 3]; 2];
    for j in 0..K {
        columns[j / 3][j % 3][j] = 1.0;
    }
    columns
}

/// The end of the rod with `K` columns: 0 for the shape alone, 3 for d/dm(0), 6 for the whole tangent.
pub(super) fn end<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    tolerance: f64,
) -> Result<(Section<K>, Work)> {
    integrate(law, b, unit_columns(), tolerance, |_, _| ())
}

/// The clamp seen from the end, whose directors are the axes and which bears the force `n` and no couple, under the reversed
/// law, with the columns d/dn.
pub(super) fn clamp_from_end<const K: usize>(
    reversed: &ScaledLaw,
    n: &Vector3<f64>,
    tolerance: f64,
) -> Result<Section<K>> {
    let mut dn = [[0.0; K]; 3];
    for (i, row) in dn.iter_mut().enumerate().take(K) {
        row[i] = 1.0;
    }
    let b = Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
    let columns = [[[0.0; K]; 3], dn];
    integrate(reversed, &b, columns, tolerance, |_, _| ()).map(|(end, _)| end)
}

/// The sections at the given arclengths in [0, 1], in growing order.
pub(super) fn sections<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    tolerance: f64,
    at: &[f64],
) -> Result<Vec<Section<K>>> {
    let mut found = Vec::with_capacity(at.len());
    let mut next = at.iter().peekable();
    while next.next_if(|s| **s <= 0.0).is_some() {
        found.push(Section::clamp());
    }
    let mut work = Work::default();
    let mut lost = false;
    let (last, _) = integrate(law, b, unit_columns(), tolerance, |step, f| {
        // Redone at full order, not interpolated: a reader may differentiate what is printed.
        while let Some(s) = next.next_if(|s| **s <= step.to.s) {
            let part = s - step.from.s;
            match step.redo(&mut *f, part, &mut work) {
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

/// The rod's end with variations that stay well apart under any load: their columns are mixed on the way.
#[derive(Debug, Clone)]
pub(super) struct Variations<const K: usize> {
    /// The end; columns 0..3 of its tangent keep n, columns 3..6 (if any) vary n by unit vectors.
    pub(super) end: Section<K>,
    /// dm(0) of each column.
    pub(super) dm: [[f64; K]; 3],
    /// Angle of det(P + i kappa J) from clamp to end, followed without jumps: J = phi, P = dm + m x phi/2 of columns 0..3.
    pub(super) angle: f64,
    /// The weight kappa.
    pub(super) weight: f64,
    /// How much the rod makes of an error at its clamp: the size of the unmixed columns at the end over the compliance.
    pub(super) growth: f64,
}

impl<const K: usize> Variations<K> {
    /// (J, P) at the end under the wrench `b`: conjugate variables, J^T P symmetric.
    pub(super) fn conjugate(&self, b: &Wrench) -> (Matrix3<f64>, Matrix3<f64>) {
        conjugate(&self.end, b, &self.dm)
    }
}

/// (J, P) of columns 0..3: n is constant, so P = dm(0) + n x rho + m x phi/2. With the last term J^T P is symmetric.
fn conjugate<const K: usize>(
    at: &Section<K>,
    b: &Wrench,
    dm: &[[f64; K]; 3],
) -> (Matrix3<f64>, Matrix3<f64>) {
    let block = |rows: &[[f64; K]]| Matrix3::from_fn(|i, j| rows[i][j]);
    let n = Vector3::new(b[3], b[4], b[5]);
    let m = Vector3::new(b[0], b[1], b[2]) - at.position().cross(&n);
    let j = block(&at.tangent[..3]);
    let rho = block(&at.tangent[3..]);
    let p = block(dm) + n.cross_matrix() * rho + 0.5 * m.cross_matrix() * j;
    (j, p)
}

/// det(P + i kappa J) and the rate of its angle along the rod.
fn turning<const K: usize>(
    at: &Section<K>,
    slope: &Section<K>,
    b: &Wrench,
    dm: &[[f64; K]; 3],
    weight: f64,
) -> Option<(Complex<f64>, f64)> {
    let (j, p) = conjugate(at, b, dm);
    let block = |rows: &[[f64; K]]| Matrix3::from_fn(|i, j| rows[i][j]);
    let n = Vector3::new(b[3], b[4], b[5]);
    let m = Vector3::new(b[0], b[1], b[2]) - at.position().cross(&n);
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
pub(super) fn variations<const K: usize>(
    law: &ScaledLaw,
    b: &Wrench,
    tolerance: f64,
) -> Result<Variations<K>> {
    let lost = || Error::no_convergence("the variations along the rod could not be followed");
    let rate = rate(law, b)?;
    let [c1, c2] = law.flexures();
    let weight = 2.0 * rate / (c1 + c2);
    let longest = 1.2 / rate;
    let [dm, dn] = unit_columns();
    let mut flow = Flow::<K>::new(law, b, dm, dn);
    let state = Section::clamp();
    let slope = flow.slope(&state).ok_or_else(lost)?;
    let mut turn = turning(&state, &slope, b, &flow.dm, weight).ok_or_else(lost)?;
    let mut solver = Dop853::new(state, slope, longest, tolerance);
    let mut step = solver.blank();
    let (mut angle, mut growth, mut h_max) = (0.0, 1.0, longest);
    let mut piece = 0;
    while piece < law.pieces.len() {
        let left = law.pieces[piece] - solver.state().s;
        if left <= 1e-14 {
            piece += 1;
            continue;
        }
        solver
            .step_into(
                |x, slope| flow.write_slope(x, slope),
                h_max.min(left),
                &mut step,
            )
            .map_err(|_| flow.refusal.take().unwrap_or_else(lost))?;
        let next = turning(&step.to, step.end_slope(), b, &flow.dm, weight).ok_or_else(lost)?;
        // The turn is known up to whole turns; its rates at both ends say which, if they agree with it and with each other.
        let turned = (next.0 / turn.0).arg();
        let [before, after] = [turn.1, next.1].map(|rate| step.h * rate);
        let expected = 0.5 * (before + after);
        let whole = ((expected - turned) / TAU).round() * TAU;
        if !((turned + whole - expected).abs() < 1.0 && before.abs().max(after.abs()) < PI) {
            solver.rewind(step.from, step.stage_slopes()[0]);
            h_max = 0.5 * step.h;
            if solver.work().steps > STEP_LIMIT {
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
            growth *= separate(&mut state, &mut slope, &mut flow, b).ok_or_else(lost)?;
            // The mixing has a positive determinant: the angle stays.
            turn = turning(&state, &slope, b, &flow.dm, weight).ok_or_else(lost)?;
            solver.rewind(state, slope);
        }
        if solver.work().steps > STEP_LIMIT {
            return Err(lost());
        }
    }
    let end = *solver.state();
    let entries = end.tangent.as_flattened().iter();
    let reached = growth * entries.fold(1.0_f64, |size, x| size.max(x.abs()));
    let compliance = law.inverse(0.0, b)?.compliance.matrix().norm();
    Ok(Variations {
        growth: reached / compliance.max(1.0),
        end,
        dm: flow.dm,
        angle,
        weight,
    })
}

/// Size of the tangent beyond which its columns are mixed.
const GROWN: f64 = 30.0;

/// Makes columns 0..3 of (J, P) orthonormal and takes their part out of the others; the equations are linear, so
/// state, slope and dm(0) mix alike. Returns the size they had.
fn separate<const K: usize>(
    state: &mut Section<K>,
    slope: &mut Section<K>,
    flow: &mut Flow<'_, K>,
    b: &Wrench,
) -> Option<f64> {
    let (j, p) = conjugate(state, b, &flow.dm);
    let gram = j.transpose() * j + p.transpose() * p;
    let mixing = gram.cholesky()?.l().transpose().try_inverse()?;
    let rows = (state.tangent.iter_mut())
        .chain(slope.tangent.iter_mut())
        .chain(flow.dm.iter_mut());
    for row in rows {
        let mixed = RowVector3::new(row[0], row[1], row[2]) * mixing;
        row[..3].copy_from_slice(mixed.as_slice());
    }
    let (j, p) = (j * mixing, p * mixing);
    for column in 3..K {
        let n = Vector3::new(b[3], b[4], b[5]);
        let entry = |rows: &[[f64; K]]| Vector3::from_fn(|i, _| rows[i][column]);
        let (phi, rho) = (entry(&state.tangent[..3]), entry(&state.tangent[3..]));
        let m = Vector3::new(b[0], b[1], b[2]) - state.position().cross(&n);
        let dm = entry(&flow.dm) + n.cross(&rho) + 0.5 * m.cross(&phi);
        let part = j.transpose() * phi + p.transpose() * dm;
        let rows = (state.tangent.iter_mut())
            .chain(slope.tangent.iter_mut())
            .chain(flow.dm.iter_mut());
        for row in rows {
            row[column] -= part[0] * row[0] + part[1] * row[1] + part[2] * row[2];
        }
    }
    Some(gram.trace().sqrt())
}
