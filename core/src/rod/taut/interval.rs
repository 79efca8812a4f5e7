//! One interval of a taut rod: Gauss collocation of frame and couple under a given force, and what is left of it when its
//! stages are eliminated.
//!
//! With f the slope and D the inverse of Butcher's matrix the stages y_i of an interval of length h from y_0 satisfy
//! ```text
//! sum_j D_ij (y_j - y_0) = h f(y_i),      y_1 = y_0 + sum_i d_i (y_i - y_0),   d = D^T b.
//! ```
//! In this form no stage slope, which may be of the size of lam h, is added up: it holds for any lam h. The variations
//! (phi, mu), turns and changes of the couple over kappa, are collocated at the same places,
//! ```text
//! phi' = (E_uu [m] + E_uv [n]) phi + kappa E_uu mu + E_uv dn,          E = R C R^T,
//! mu'  = ([n] rho' + [dn] r')/kappa,   rho' = (E_vu [m] + E_vv [n] - [R v]) phi + kappa E_vu mu + E_vv dn,
//! ```
//! and mu is eliminated first: where shear and flexure are not coupled its stages are a quadrature.

// Entries of matrices are told by their indices.
#![allow(clippy::needless_range_loop)]

use super::super::scaled_law::{Response, ScaledLaw};
use super::fall::Creeping;
use crate::error::Result;
use crate::math::gauss::Rule;
use crate::math::se3::{Turn, conjugate, exponential, frame, product, spin};
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3, Vector6};
use std::sync::OnceLock;

/// Stages. An even number: R(z) of the method has no real pole, which a growing mode could meet.
pub(super) const STAGES: usize = 8;
const SIZE: usize = 3 * STAGES;
/// What an interval depends on: turn and couple at its start, the force, and 1 for the residual.
const COLUMNS: usize = 10;
const FORCE: usize = 6;
const REST: usize = 9;

type Block = SMatrix<f64, 3, COLUMNS>;

/// Frame and couple of a section, in the directors of the clamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::rod) struct Section {
    pub turn: Turn,
    pub m: Vector3<f64>,
}

impl Section {
    fn varied(&self, phi: &Vector3<f64>, m: &Vector3<f64>) -> Self {
        Self {
            turn: product(&exponential(phi), &self.turn),
            m: self.m + m,
        }
    }
}

/// The Gauss method with [`STAGES`] stages.
pub(super) struct Scheme {
    pub nodes: [f64; STAGES],
    pub weights: [f64; STAGES],
    /// Butcher's A.
    integrate: [[f64; STAGES]; STAGES],
    /// D = A^-1, and its sums over rows.
    differentiate: [[f64; STAGES]; STAGES],
    rows: [f64; STAGES],
    /// d, and 1 - sum d.
    end: [f64; STAGES],
    start: f64,
    /// The last Legendre coefficients of a function at the nodes.
    modes: [[f64; STAGES]; 3],
}

impl Scheme {
    pub fn get() -> &'static Self {
        static SCHEME: OnceLock<Scheme> = OnceLock::new();
        SCHEME.get_or_init(|| {
            let rule = Rule::new(STAGES);
            let (integrate, modes) = rule.matrices();
            let table =
                |m: &DMatrix<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
            let inverse = integrate
                .clone()
                .try_inverse()
                .expect("Butcher's matrix of Gauss' method is regular");
            let differentiate: [[f64; STAGES]; STAGES] = table(&inverse);
            let end: [f64; STAGES] = std::array::from_fn(|j| {
                (0..STAGES)
                    .map(|i| rule.weights[i] * differentiate[i][j])
                    .sum()
            });
            Self {
                nodes: std::array::from_fn(|i| rule.nodes[i]),
                weights: std::array::from_fn(|i| rule.weights[i]),
                integrate: table(&integrate),
                rows: differentiate.map(|row| row.iter().sum()),
                differentiate,
                start: 1.0 - end.iter().sum::<f64>(),
                end,
                modes: std::array::from_fn(|k| std::array::from_fn(|j| modes[(STAGES - 3 + k, j)])),
            }
        })
    }

    /// Values at `x` in [0, 1] of the polynomial through the start and the stages, as weights of these.
    pub fn interpolate(&self, x: f64) -> [f64; STAGES + 1] {
        let at: [f64; STAGES + 1] =
            std::array::from_fn(|i| if i == 0 { 0.0 } else { self.nodes[i - 1] });
        std::array::from_fn(|i| {
            let others = (0..=STAGES).filter(|j| *j != i);
            others.map(|j| (x - at[j]) / (at[i] - at[j])).product()
        })
    }
}

/// Centreline, energy and smoothness of an interval as it is.
pub(super) struct Passed {
    /// r(1) - r(0).
    pub way: Vector3<f64>,
    pub energy: f64,
    /// Estimated error of frame and couple over kappa at its end.
    pub error: f64,
    /// By how much sections turn along it, in radians.
    pub turn: f64,
}

/// An interval with its stages eliminated: columns are turn and couple (over kappa) at its start, dn, and the residual.
pub(super) struct Condensed {
    turns: [Block; STAGES],
    couples: [Block; STAGES],
    pub end: SMatrix<f64, 6, COLUMNS>,
    /// Change of r(1) - r(0), and that as it is.
    pub way: Block,
    pub length: Vector3<f64>,
    /// Relative changes of the lengths of the stages' quaternions.
    lengths: [f64; STAGES],
}

/// What a section does at a stage.
pub(super) struct Slope {
    turn: Turn,
    /// R u of the strains, and r' = R v.
    u: Vector3<f64>,
    pub r: Vector3<f64>,
    energy: f64,
    /// R C R^T by blocks: uu, uv, vu, vv.
    pub e: [Matrix3<f64>; 4],
}

/// The rod under a given force.
pub(super) struct Pulled<'a> {
    pub law: &'a ScaledLaw,
    pub n: Vector3<f64>,
    /// The unit of couples: sqrt|n|.
    pub kappa: f64,
    /// A step of the fast layer, if this is one.
    pub creeping: Option<&'a Creeping>,
}

impl Pulled<'_> {
    /// The strains under resultants along the directors.
    pub(super) fn inverse(&self, s: f64, local: &Vector6<f64>) -> Result<Response<'_>> {
        let inverse = self.law.inverse(s, local)?;
        Ok(match self.creeping {
            Some(step) => step.after(s, inverse),
            None => inverse,
        })
    }

    fn slope(&self, s: f64, at: &Section) -> Result<Slope> {
        let turn = frame(&at.turn);
        let (m, n) = (turn.tr_mul(&at.m), turn.tr_mul(&self.n));
        let local = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
        let inverse = self.inverse(s, &local)?;
        let (u, v) = (
            inverse.strain.fixed_rows::<3>(0).into_owned(),
            inverse.strain.fixed_rows::<3>(3).into_owned(),
        );
        let c = inverse.compliance.matrix();
        let block = |i: usize, j: usize| turn * c.fixed_view::<3, 3>(i, j) * turn.transpose();
        Ok(Slope {
            turn: spin(&at.turn, &u),
            u: turn * u,
            r: turn * v,
            energy: inverse.energy,
            e: [block(0, 0), block(0, 3), block(3, 0), block(3, 3)],
        })
    }

    pub(super) fn slopes(
        &self,
        (from, to): (f64, f64),
        stages: &[Section; STAGES],
    ) -> Result<[Slope; STAGES]> {
        let scheme = Scheme::get();
        let mut found = Vec::with_capacity(STAGES);
        for (x, at) in scheme.nodes.iter().zip(stages) {
            found.push(self.slope(from + x * (to - from), at)?);
        }
        let found: std::result::Result<[Slope; STAGES], _> = found.try_into();
        Ok(found.unwrap_or_else(|_| unreachable!("as many slopes as stages")))
    }

    /// Centreline and energy along an interval, and an estimate of its error.
    ///
    /// What the stages cannot follow of the slope is the first Legendre mode that they leave out, taken from the last ones that they
    /// have. The node sees it times the same mode of Green's function, which is no less than that of exp(z x), z = lam h.
    pub fn passed(&self, (from, to): (f64, f64), stages: &[Section; STAGES]) -> Result<Passed> {
        let (scheme, h) = (Scheme::get(), to - from);
        let slopes = self.slopes((from, to), stages)?;
        let (mut way, mut energy) = (Vector3::zeros(), 0.0);
        let mut modes = [Vector6::<f64>::zeros(); 3];
        let (mut rate, mut turn) = (0.0_f64, 0.0_f64);
        for (j, slope) in slopes.iter().enumerate() {
            let weight = h * scheme.weights[j];
            way += slope.r * weight;
            energy += slope.energy * weight;
            let couple = self.n.cross(&slope.r) / self.kappa;
            for (mode, by) in modes.iter_mut().zip(&scheme.modes) {
                for i in 0..3 {
                    mode[i] += h * by[j] * slope.u[i];
                    mode[3 + i] += h * by[j] * couple[i];
                }
            }
            let growth = (slope.e[0].norm() * self.n.norm()).sqrt();
            rate = rate.max(growth + slope.u.norm());
            turn = turn.max(h * slope.u.norm());
        }
        let [a, b, c] = modes.map(|mode| mode.amax());
        // Modes of one parity may vanish: two steps back and one back, the slower decay counts.
        let ratio = |later: f64, earlier: f64| {
            if later <= 1e-17 {
                0.0
            } else {
                (later / earlier).min(1.0)
            }
        };
        let tail = (c * ratio(b.max(c), a.max(b))).max(b * ratio(c, a));
        let z = h * rate;
        let green = (1..=STAGES).fold(1.0, |product, k| product * 0.5 * z / (2.0 * k as f64 - 1.0));
        Ok(Passed {
            way,
            energy,
            error: tail * green.min(1.0),
            turn,
        })
    }

    /// The interval from `ends[0]` to `ends[1]` linearised.
    ///
    /// # Errors
    /// A law that refuses; stages that are singular.
    pub fn condensed(
        &self,
        (from, to): (f64, f64),
        ends: [&Section; 2],
        stages: &[Section; STAGES],
    ) -> Result<Option<Condensed>> {
        let (scheme, h, kappa) = (Scheme::get(), to - from, self.kappa);
        let slopes = self.slopes((from, to), stages)?;
        let [first, last] = ends;
        let pull = self.n.cross_matrix();
        let zero = Matrix3::zeros();
        let mut by_turn = [zero; STAGES];
        let mut of_couple = [zero; STAGES];
        let mut of_couple_own = [zero; STAGES];
        let mut of_way = [zero; STAGES];
        let mut by_force = [[zero; 2]; STAGES];
        let (mut lengths, mut turned, mut bent) = (
            [0.0; STAGES],
            [Vector3::zeros(); STAGES],
            [Vector3::zeros(); STAGES],
        );
        for (i, slope) in slopes.iter().enumerate() {
            let [uu, uv, vu, vv] = &slope.e;
            let bend = stages[i].m.cross_matrix();
            let along = slope.r.cross_matrix();
            by_turn[i] = uu * bend + uv * pull;
            of_way[i] = vu * bend + vv * pull - along;
            of_couple[i] = pull * of_way[i] / kappa;
            of_couple_own[i] = pull * vu;
            by_force[i] = [*uv, (pull * vv - along) / kappa];
            let (mut turn, mut couple) = (Turn::zeros(), Vector3::zeros());
            for j in 0..STAGES {
                let d = scheme.differentiate[i][j];
                turn += (stages[j].turn - first.turn) * d;
                couple += (stages[j].m - first.m) * d;
            }
            let off = product(&(slope.turn * h - turn), &conjugate(&stages[i].turn))
                / stages[i].turn.norm_squared();
            turned[i] = 2.0 * Vector3::new(off[1], off[2], off[3]);
            bent[i] = (self.n.cross(&slope.r) * h - couple) / kappa;
            for (length, a) in lengths.iter_mut().zip(&scheme.integrate) {
                *length += a[i] * off[0];
            }
        }
        // mu = T (rows mu_0 + h G phi + h B dn + residual).
        let coupled = of_couple_own.iter().any(|m| *m != zero);
        let transfer = if coupled {
            let mut matrix = DMatrix::zeros(SIZE, SIZE);
            for i in 0..STAGES {
                for j in 0..STAGES {
                    let mut block = Matrix3::identity() * scheme.differentiate[i][j];
                    if i == j {
                        block -= of_couple_own[i] * h;
                    }
                    matrix
                        .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                        .copy_from(&block);
                }
            }
            let Some(inverse) = matrix.try_inverse() else {
                return Ok(None);
            };
            Some(inverse)
        } else {
            None
        };
        let through = |i: usize, k: usize| match &transfer {
            Some(whole) => whole.fixed_view::<3, 3>(3 * i, 3 * k).into_owned(),
            None => Matrix3::identity() * scheme.integrate[i][k],
        };
        // What mu has of everything but phi.
        let mut couples = [Block::zeros(); STAGES];
        for (i, own) in couples.iter_mut().enumerate() {
            for k in 0..STAGES {
                let by = through(i, k);
                let mut own_start = own.fixed_columns_mut::<3>(3);
                own_start += by * scheme.rows[k];
                let mut own_force = own.fixed_columns_mut::<3>(FORCE);
                own_force += by * by_force[k][1] * h;
                let mut own_rest = own.fixed_columns_mut::<1>(REST);
                own_rest += by * bent[k];
            }
        }
        let mut system = [[0.0; SIZE + COLUMNS]; SIZE];
        for i in 0..STAGES {
            let gain = slopes[i].e[0] * (h * kappa);
            for k in 0..STAGES {
                let mut block = if coupled {
                    -(gain * through(i, k) * of_couple[k]) * h
                } else {
                    -(gain * of_couple[k]) * (h * scheme.integrate[i][k])
                };
                for a in 0..3 {
                    block[(a, a)] += scheme.differentiate[i][k];
                }
                if i == k {
                    block -= by_turn[i] * h;
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
                right[(a, REST)] += turned[i][a];
                for b in 0..3 {
                    right[(a, FORCE + b)] += h * by_force[i][0][(a, b)];
                }
                for b in 0..COLUMNS {
                    system[3 * i + a][SIZE + b] = right[(a, b)];
                }
            }
        }
        if !eliminated(&mut system) {
            return Ok(None);
        }
        let turns: [Block; STAGES] =
            std::array::from_fn(|i| Block::from_fn(|a, b| system[3 * i + a][SIZE + b]));
        let pulls: [Block; STAGES] = std::array::from_fn(|k| of_couple[k] * turns[k] * h);
        for (i, own) in couples.iter_mut().enumerate() {
            for (k, pull) in pulls.iter().enumerate() {
                *own += if coupled {
                    through(i, k) * pull
                } else {
                    pull * scheme.integrate[i][k]
                };
            }
        }
        let (mut turn, mut couple) = (Block::zeros(), Block::zeros());
        let (mut way, mut length) = (Block::zeros(), Vector3::zeros());
        let mut off = first.turn * scheme.start - last.turn;
        let mut jump = (first.m * scheme.start - last.m) / kappa;
        for a in 0..3 {
            turn[(a, a)] = scheme.start;
            couple[(a, 3 + a)] = scheme.start;
        }
        for i in 0..STAGES {
            let d = scheme.end[i];
            turn += turns[i] * d;
            couple += couples[i] * d;
            off += stages[i].turn * d;
            jump += stages[i].m * (d / kappa);
            let weight = h * scheme.weights[i];
            length += slopes[i].r * weight;
            let mut moved = of_way[i] * turns[i];
            if coupled {
                moved += slopes[i].e[2] * couples[i] * kappa;
            }
            let mut by = moved.fixed_columns_mut::<3>(FORCE);
            by += slopes[i].e[3];
            way += moved * weight;
        }
        let off = product(&off, &conjugate(&last.turn)) / last.turn.norm_squared();
        for a in 0..3 {
            turn[(a, REST)] += 2.0 * off[1 + a];
            couple[(a, REST)] += jump[a];
        }
        let mut end = SMatrix::<f64, 6, COLUMNS>::zeros();
        end.fixed_rows_mut::<3>(0).copy_from(&turn);
        end.fixed_rows_mut::<3>(3).copy_from(&couple);
        Ok(Some(Condensed {
            turns,
            couples,
            end,
            way,
            length,
            lengths,
        }))
    }
}

impl Condensed {
    /// Applies the changes of the start (turn, couple over kappa) and of the force to the stages.
    pub fn correct(
        &self,
        (start, force): (&Vector6<f64>, &Vector3<f64>),
        part: f64,
        kappa: f64,
        stages: &mut [Section; STAGES],
    ) {
        for (i, stage) in stages.iter_mut().enumerate() {
            let of = |block: &Block| -> Vector3<f64> { moved(block, start, force) * part };
            *stage = stage.varied(&of(&self.turns[i]), &(of(&self.couples[i]) * kappa));
            stage.turn *= 1.0 + part * self.lengths[i];
        }
    }

    /// The largest turn and change of couple over kappa that [`Condensed::correct`] would make.
    pub fn change(&self, start: &Vector6<f64>, force: &Vector3<f64>) -> f64 {
        let of = |block: &Block| moved(block, start, force).amax();
        (0..STAGES).fold(0.0, |most: f64, i| {
            most.max(of(&self.turns[i])).max(of(&self.couples[i]))
        })
    }
}

/// What a stage does that is told by `block`.
fn moved(block: &Block, start: &Vector6<f64>, force: &Vector3<f64>) -> Vector3<f64> {
    let by_force = block.fixed_columns::<3>(FORCE) * force;
    block.fixed_columns::<6>(0) * start + by_force + block.column(REST)
}

/// Varies a node.
pub(super) fn correct(node: &mut Section, change: &Vector6<f64>, part: f64, kappa: f64) {
    let phi = change.fixed_rows::<3>(0) * part;
    let m = change.fixed_rows::<3>(3) * (part * kappa);
    *node = node.varied(&phi, &m);
}

/// Solves in place for the last columns, rows exchanged for the largest pivot; false if a pivot vanishes.
fn eliminated<const W: usize>(system: &mut [[f64; W]; SIZE]) -> bool {
    for k in 0..SIZE {
        let (mut best, mut largest) = (k, 0.0);
        for (i, row) in system.iter().enumerate().skip(k) {
            if row[k].abs() > largest {
                (best, largest) = (i, row[k].abs());
            }
        }
        if !(largest > 0.0 && largest.is_finite()) {
            return false;
        }
        system.swap(k, best);
        let (above, below) = system.split_at_mut(k + 1);
        let pivot = &above[k];
        let inverse = 1.0 / pivot[k];
        for row in below {
            let factor = row[k] * inverse;
            if factor != 0.0 {
                for (x, p) in row[k + 1..].iter_mut().zip(&pivot[k + 1..]) {
                    *x -= factor * p;
                }
            }
        }
    }
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
    true
}
