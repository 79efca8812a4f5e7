//! Linearised interval of a taut rod, and its condensation to the ends.
//!
//! The variations (phi, mu), turns and changes of the couple over kappa, are collocated at the rod's own stages
//! ([`super::interval`]),
//! ```text
//! phi' = (E_uu [m] + E_uv [n]) phi + kappa E_uu mu + E_uv dn,          E = R C R^T,
//! mu'  = ([n] rho' + [dn] r')/kappa,   rho' = (E_vu [m] + E_vv [n] - [R v]) phi + kappa E_vu mu + E_vv dn,
//! ```
//! and mu is eliminated first: if shear and flexure are not coupled, its stages are a quadrature. The right-hand
//! sides are the residuals of the rod's equations, or the terms that are quadratic in the first derivatives of a
//! motion.

// Matrix entries are addressed by their indices.
#![allow(clippy::needless_range_loop)]

use super::interval::{FrameAndCouple, RodUnderForce, STAGES, Scheme, Slope};
use crate::error::Result;
use crate::math::se3::{Turn, conjugate, join, product};
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3, Vector6};

const SIZE: usize = 3 * STAGES;
/// Columns of an interval: turn and couple at its start, the force, and 1 for the residual.
const COLUMNS: usize = 10;
const FORCE: usize = 6;
const REST: usize = 9;

pub(super) type ColumnBlock = SMatrix<f64, 3, COLUMNS>;

/// An interval with its stages eliminated: columns are turn and couple (over kappa) at its start, dn, and the
/// residual.
pub(super) struct Condensed {
    pub turns: [ColumnBlock; STAGES],
    pub couples: [ColumnBlock; STAGES],
    pub end: SMatrix<f64, 6, COLUMNS>,
    /// Change of r(1) - r(0), and its value.
    pub way: ColumnBlock,
    pub length: Vector3<f64>,
    /// Relative changes of the lengths of the stages' quaternions.
    lengths: [f64; STAGES],
    /// Factors of the equations of the stages of phi.
    stages: PivotedFactors,
}

/// An interval linearised at its stages.
pub(super) struct IntervalVariations {
    pub h: f64,
    kappa: f64,
    pub slopes: [Slope; STAGES],
    /// Coefficients of phi in phi' and in rho'.
    by_turn: [Matrix3<f64>; STAGES],
    way_by_turn: [Matrix3<f64>; STAGES],
    /// Coefficients of dn in phi' and mu'.
    pub by_force: [[Matrix3<f64>; 2]; STAGES],
    /// [n].
    pull: [Matrix3<f64>; STAGES],
    /// Stages of mu by the terms of mu' without mu, if shear and flexure are coupled.
    transfer: Option<DMatrix<f64>>,
}

/// Right-hand sides of the variations of an interval: h times the residuals of phi', mu' and rho' at the stages, and
/// the jumps of phi and mu at its end.
pub(super) struct Residual {
    pub turned: [Vector3<f64>; STAGES],
    pub bent: [Vector3<f64>; STAGES],
    pub moved: [Vector3<f64>; STAGES],
    pub jump: Vector6<f64>,
    /// Relative changes of the lengths of the stages' quaternions.
    lengths: [f64; STAGES],
}

impl Residual {
    pub const NONE: Self = {
        let none = [Vector3::new(0.0, 0.0, 0.0); STAGES];
        Self {
            turned: none,
            bent: none,
            moved: none,
            jump: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            lengths: [0.0; STAGES],
        }
    };
}

impl RodUnderForce<'_> {
    /// The interval linearised at its stages; None if the equations of the stages of mu are singular.
    ///
    /// # Errors
    /// A law that refuses.
    pub fn variations(
        &self,
        from: f64,
        to: f64,
        stages: &[FrameAndCouple; STAGES],
    ) -> Result<Option<IntervalVariations>> {
        let (h, kappa) = (to - from, self.kappa);
        let slopes = self.slopes(from, to, stages)?;
        let zero = Matrix3::zeros();
        let mut pull = [zero; STAGES];
        let mut by_turn = [zero; STAGES];
        let mut way_by_turn = [zero; STAGES];
        let mut by_force = [[zero; 2]; STAGES];
        for (i, slope) in slopes.iter().enumerate() {
            let [uu, uv, vu, vv] = &slope.e;
            let bend = stages[i].m.cross_matrix();
            let along = slope.r.cross_matrix();
            pull[i] = slope.n.cross_matrix();
            by_turn[i] = uu * bend + uv * pull[i];
            way_by_turn[i] = vu * bend + vv * pull[i] - along;
            by_force[i] = [*uv, (pull[i] * vv - along) / kappa];
        }
        let mut found = IntervalVariations {
            h,
            kappa,
            slopes,
            by_turn,
            way_by_turn,
            by_force,
            pull,
            transfer: None,
        };
        let mut shears = found.slopes.iter().zip(&pull);
        let coupled = shears.any(|(slope, pull)| pull * slope.e[2] != zero);
        if coupled {
            found.transfer = found.inverse_stage_matrix();
        }
        Ok((found.transfer.is_some() || !coupled).then_some(found))
    }

    /// Residual of the equations of the interval from `ends[0]` to `ends[1]`.
    pub fn residual(
        &self,
        by: &IntervalVariations,
        ends: [&FrameAndCouple; 2],
        stages: &[FrameAndCouple; STAGES],
    ) -> Residual {
        let scheme = Scheme::get();
        let [first, last] = ends;
        let mut left = Residual::NONE;
        for (i, slope) in by.slopes.iter().enumerate() {
            let (mut turn, mut couple) = (Turn::zeros(), Vector3::zeros());
            for j in 0..STAGES {
                let d = scheme.differentiate[i][j];
                turn += (stages[j].turn - first.turn) * d;
                couple += (stages[j].m - first.m) * d;
            }
            let off = product(&(slope.turn * by.h - turn), &conjugate(&stages[i].turn))
                / stages[i].turn.norm_squared();
            left.turned[i] = 2.0 * Vector3::new(off[1], off[2], off[3]);
            left.bent[i] = (slope.n.cross(&slope.r) * by.h - couple) / self.kappa;
            for (length, a) in left.lengths.iter_mut().zip(&scheme.integrate) {
                *length += a[i] * off[0];
            }
        }
        let mut off = first.turn * scheme.start - last.turn;
        let mut jump = (first.m * scheme.start - last.m) / self.kappa;
        for (stage, d) in stages.iter().zip(&scheme.end) {
            off += stage.turn * *d;
            jump += stage.m * (d / self.kappa);
        }
        let off = product(&off, &conjugate(&last.turn)) / last.turn.norm_squared();
        left.jump = Vector6::new(
            2.0 * off[1],
            2.0 * off[2],
            2.0 * off[3],
            jump.x,
            jump.y,
            jump.z,
        );
        left
    }
}

impl IntervalVariations {
    /// Inverse matrix of the equations of the stages of mu, if shear and flexure are coupled.
    fn inverse_stage_matrix(&self) -> Option<DMatrix<f64>> {
        let scheme = Scheme::get();
        let mut matrix = DMatrix::zeros(SIZE, SIZE);
        for i in 0..STAGES {
            for j in 0..STAGES {
                let mut block = Matrix3::identity() * scheme.differentiate[i][j];
                if i == j {
                    block -= self.pull[i] * self.slopes[i].e[2] * self.h;
                }
                matrix
                    .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                    .copy_from(&block);
            }
        }
        matrix.try_inverse()
    }

    /// rho' at stage `i` by the columns of the interval, without its residual.
    pub fn way_slope(&self, i: usize, by: &Condensed) -> ColumnBlock {
        let mut moved = self.way_by_turn[i] * by.turns[i];
        if self.transfer.is_some() {
            moved += self.slopes[i].e[2] * by.couples[i] * self.kappa;
        }
        let mut by_force = moved.fixed_columns_mut::<3>(FORCE);
        by_force += self.slopes[i].e[3];
        moved
    }

    /// Stages of mu by the terms of mu' without mu.
    fn stages_by(&self, i: usize, k: usize) -> Matrix3<f64> {
        match &self.transfer {
            Some(whole) => whole.fixed_view::<3, 3>(3 * i, 3 * k).into_owned(),
            None => Matrix3::identity() * Scheme::get().integrate[i][k],
        }
    }

    /// h times the coefficient of phi in mu' at stage `k`.
    fn pull(&self, k: usize) -> Matrix3<f64> {
        self.pull[k] * self.way_by_turn[k] * (self.h / self.kappa)
    }

    /// Interval with its stages eliminated, with zero residual; None if the stages are singular.
    pub fn condense(&self) -> Option<Condensed> {
        let (scheme, h) = (Scheme::get(), self.h);
        let coupled = self.transfer.is_some();
        let pulls: [Matrix3<f64>; STAGES] = std::array::from_fn(|k| self.pull(k));
        // The terms of mu without phi: mu = T (rows mu_0 + h G phi + h B dn + residual).
        let mut couples = [ColumnBlock::zeros(); STAGES];
        for (i, own) in couples.iter_mut().enumerate() {
            for k in 0..STAGES {
                let by = self.stages_by(i, k);
                let mut own_start = own.fixed_columns_mut::<3>(3);
                own_start += by * scheme.rows[k];
                let mut own_force = own.fixed_columns_mut::<3>(FORCE);
                own_force += by * self.by_force[k][1] * h;
            }
        }
        let mut system = [[0.0; SIZE + REST]; SIZE];
        for i in 0..STAGES {
            let gain = self.gain(i);
            for k in 0..STAGES {
                let mut block = if coupled {
                    -(gain * self.stages_by(i, k) * pulls[k])
                } else {
                    -(gain * pulls[k]) * scheme.integrate[i][k]
                };
                for a in 0..3 {
                    block[(a, a)] += scheme.differentiate[i][k];
                }
                if i == k {
                    block -= self.by_turn[i] * h;
                }
                for a in 0..3 {
                    for b in 0..3 {
                        system[3 * i + a][3 * k + b] = block[(a, b)];
                    }
                }
            }
            let mut right = gain * couples[i];
            for a in 0..3 {
                right[(a, a)] += scheme.rows[i];
                for b in 0..3 {
                    right[(a, FORCE + b)] += h * self.by_force[i][0][(a, b)];
                }
                for b in 0..REST {
                    system[3 * i + a][SIZE + b] = right[(a, b)];
                }
            }
        }
        let stages = eliminate(&mut system)?;
        let turns = std::array::from_fn(|i| {
            ColumnBlock::from_fn(|a, b| match b {
                REST => 0.0,
                _ => system[3 * i + a][SIZE + b],
            })
        });
        let mut found = Condensed {
            turns,
            couples,
            end: SMatrix::zeros(),
            way: ColumnBlock::zeros(),
            length: Vector3::zeros(),
            lengths: [0.0; STAGES],
            stages,
        };
        for k in 0..STAGES {
            let pull = pulls[k] * found.turns[k];
            for (i, own) in found.couples.iter_mut().enumerate() {
                *own += if coupled {
                    self.stages_by(i, k) * pull
                } else {
                    pull * scheme.integrate[i][k]
                };
            }
        }
        for i in 0..STAGES {
            let (d, weight) = (scheme.end[i], h * scheme.weights[i]);
            let mut turn = found.end.fixed_rows_mut::<3>(0);
            turn += found.turns[i] * d;
            let mut couple = found.end.fixed_rows_mut::<3>(3);
            couple += found.couples[i] * d;
            found.length += self.slopes[i].r * weight;
            found.way += self.way_slope(i, &found) * weight;
        }
        for a in 0..6 {
            found.end[(a, a)] += scheme.start;
        }
        Some(found)
    }

    /// h times the coefficient of mu in phi' at stage `i`.
    fn gain(&self, i: usize) -> Matrix3<f64> {
        self.slopes[i].e[0] * (self.h * self.kappa)
    }
}

impl Condensed {
    /// This interval with the residual `left`.
    pub fn with_residual(mut self, by: &IntervalVariations, left: &Residual) -> Self {
        let scheme = Scheme::get();
        let through = |forces: &[Vector3<f64>; STAGES], i: usize| -> Vector3<f64> {
            let parts = forces.iter().enumerate();
            parts.map(|(k, force)| by.stages_by(i, k) * force).sum()
        };
        let bent: [Vector3<f64>; STAGES] = std::array::from_fn(|i| through(&left.bent, i));
        let mut turns = [0.0; SIZE];
        for i in 0..STAGES {
            let right = by.gain(i) * bent[i] + left.turned[i];
            turns[3 * i..3 * i + 3].copy_from_slice(right.as_slice());
        }
        self.stages.solve(&mut turns);
        let turns: [Vector3<f64>; STAGES] =
            std::array::from_fn(|i| Vector3::from_column_slice(&turns[3 * i..3 * i + 3]));
        let pulls = std::array::from_fn(|k| by.pull(k) * turns[k]);
        let mut end = left.jump;
        for i in 0..STAGES {
            let couple = bent[i] + through(&pulls, i);
            self.turns[i].set_column(REST, &turns[i]);
            self.couples[i].set_column(REST, &couple);
            end += join(&turns[i], &couple) * scheme.end[i];
        }
        self.end.set_column(REST, &end);
        let way = (0..STAGES).map(|i| {
            let slope = by.way_slope(i, &self).column(REST) * by.h;
            (slope + left.moved[i]) * scheme.weights[i]
        });
        let way: Vector3<f64> = way.sum();
        self.way.set_column(REST, &way);
        self.lengths = left.lengths;
        self
    }

    /// This interval of a rod that stays in the plane with the unit normal `normal`. Out of the plane an unloaded rod
    /// takes its place, which is never neutral.
    pub fn in_plane(mut self, normal: &Vector3<f64>, h: f64) -> Self {
        let about = normal * normal.transpose();
        let inside = Matrix3::identity() - about;
        let project = |block: &mut ColumnBlock, rows: &Matrix3<f64>| {
            for (column, by) in [(0, &about), (3, &about), (FORCE, &inside)] {
                let part = rows * block.fixed_columns::<3>(column) * by;
                block.fixed_columns_mut::<3>(column).copy_from(&part);
            }
            let rest = rows * block.column(REST);
            block.set_column(REST, &rest);
        };
        for block in self.turns.iter_mut().chain(&mut self.couples) {
            project(block, &about);
        }
        for row in [0, 3] {
            let mut block: ColumnBlock = self.end.fixed_rows::<3>(row).into_owned();
            project(&mut block, &about);
            let mut own = block.fixed_columns_mut::<3>(row);
            own += inside;
            if row == 0 {
                let mut by_couple = block.fixed_columns_mut::<3>(3);
                by_couple += inside * h;
            }
            self.end.fixed_rows_mut::<3>(row).copy_from(&block);
        }
        project(&mut self.way, &inside);
        let mut give = self.way.fixed_columns_mut::<3>(FORCE);
        give += about * h;
        self
    }

    /// Applies the changes of the start (turn, couple over kappa) and of the force to the stages.
    pub fn correct(
        &self,
        start: &Vector6<f64>,
        force: &Vector3<f64>,
        part: f64,
        kappa: f64,
        stages: &mut [FrameAndCouple; STAGES],
    ) {
        for (i, stage) in stages.iter_mut().enumerate() {
            let of =
                |block: &ColumnBlock| -> Vector3<f64> { stage_change(block, start, force) * part };
            *stage = stage.varied(&of(&self.turns[i]), &(of(&self.couples[i]) * kappa));
            stage.turn *= 1.0 + part * self.lengths[i];
        }
    }

    /// Largest turn and change of couple over kappa that [`Condensed::correct`] would make.
    pub fn change(&self, start: &Vector6<f64>, force: &Vector3<f64>) -> f64 {
        let of = |block: &ColumnBlock| stage_change(block, start, force).amax();
        (0..STAGES).fold(0.0, |most: f64, i| {
            most.max(of(&self.turns[i])).max(of(&self.couples[i]))
        })
    }
}

/// Change of a stage by the columns of `block`.
fn stage_change(block: &ColumnBlock, start: &Vector6<f64>, force: &Vector3<f64>) -> Vector3<f64> {
    let by_force = block.fixed_columns::<3>(FORCE) * force;
    block.fixed_columns::<6>(0) * start + by_force + block.column(REST)
}

/// LU factors of a matrix with exchanged rows.
struct PivotedFactors {
    triangles: [[f64; SIZE]; SIZE],
    exchanged: [usize; SIZE],
}

impl PivotedFactors {
    fn solve(&self, x: &mut [f64; SIZE]) {
        for (k, with) in self.exchanged.iter().enumerate() {
            x.swap(k, *with);
        }
        for (i, row) in self.triangles.iter().enumerate() {
            let known: f64 = row[..i].iter().zip(&*x).map(|(l, x)| l * x).sum();
            x[i] -= known;
        }
        for (i, row) in self.triangles.iter().enumerate().rev() {
            let known: f64 = row[i + 1..]
                .iter()
                .zip(&x[i + 1..])
                .map(|(u, x)| u * x)
                .sum();
            x[i] = (x[i] - known) / row[i];
        }
    }
}

/// Solves in place for the last columns, with partial pivoting; None if a pivot vanishes.
fn eliminate<const W: usize>(system: &mut [[f64; W]; SIZE]) -> Option<PivotedFactors> {
    let mut exchanged = [0; SIZE];
    for k in 0..SIZE {
        let (mut best, mut largest) = (k, 0.0);
        for (i, row) in system.iter().enumerate().skip(k) {
            if row[k].abs() > largest {
                (best, largest) = (i, row[k].abs());
            }
        }
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        exchanged[k] = best;
        system.swap(k, best);
        let (above, below) = system.split_at_mut(k + 1);
        let pivot = &above[k];
        let inverse = 1.0 / pivot[k];
        for row in below {
            let factor = row[k] * inverse;
            row[k] = factor;
            if factor != 0.0 {
                for (x, p) in row[k + 1..].iter_mut().zip(&pivot[k + 1..]) {
                    *x -= factor * p;
                }
            }
        }
    }
    let triangles = std::array::from_fn(|i| std::array::from_fn(|j| system[i][j]));
    for k in (0..SIZE).rev() {
        let (above, below) = system.split_at_mut(k + 1);
        let row = &mut above[k];
        for (j, other) in below.iter().enumerate() {
            let factor = row[k + 1 + j];
            for (x, y) in row[SIZE..].iter_mut().zip(&other[SIZE..]) {
                *x -= factor * y;
            }
        }
        let inverse = 1.0 / row[k];
        row[SIZE..].iter_mut().for_each(|x| *x *= inverse);
    }
    Some(PivotedFactors {
        triangles,
        exchanged,
    })
}
