//! Derivatives of the balance in blocks, and block elimination rod by rod.
//!
//! With A the block of a rod against its own strains, and b the columns of bodies and multipliers,
//! ```text
//! [A_k  b_k] [x_k]   [r_k]
//! [c_k  d  ] [y  ] = [s  ],        (d - sum c_k A_k^-1 b_k) y = s - sum c_k A_k^-1 r_k.
//! ```

use super::{BodyNow, HeavyAssembly, HeavyBalance, HeavyState};
use crate::full_mass::maxwell_nodes::Memory;
use crate::full_mass::rod::Derivatives;
use crate::solve::lu::Lu;
use crate::solve::system::{Factor, Scalar};
use nalgebra::{ComplexField, DMatrix, DVector};
use std::sync::Arc;

/// Derivatives by displacements, by velocities, or by accelerations.
#[derive(Debug, Clone)]
pub(super) struct Level {
    rods: Vec<RodBlocks>,
    /// Block of bodies and bases against each other.
    free: DMatrix<f64>,
}

/// Blocks of one rod: its balance, its share in the bodies' balance, and its end; each by the strains and by bodies
/// and bases.
#[derive(Debug, Clone)]
struct RodBlocks {
    own: DMatrix<f64>,
    own_by_free: DMatrix<f64>,
    free_by_own: DMatrix<f64>,
    end_by_own: DMatrix<f64>,
    end_by_free: DMatrix<f64>,
}

/// All derivatives of the balance.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    /// By displacements, velocities, accelerations; or by accelerations alone.
    levels: Vec<Level>,
    /// By the multiplier of each rod: its own balance, and the bodies' balance.
    by_wrench: Vec<[DMatrix<f64>; 2]>,
}

/// A right-hand side or a solution: per rod, and for bodies, bases and multipliers together.
#[derive(Debug, Clone)]
pub(super) struct BlockVector<T: ComplexField> {
    pub rods: Vec<DVector<T>>,
    pub free: DVector<T>,
}

/// Factors of the block matrix.
#[derive(Debug)]
pub(super) struct Factored<T: Scalar> {
    rods: Vec<RodFactor<T>>,
    /// Schur complement: bodies and bases before the multipliers.
    small: Lu,
    scale: Vec<f64>,
}

#[derive(Debug)]
struct RodFactor<T: Scalar> {
    lu: Lu,
    scale: Vec<f64>,
    /// A^-1 b: columns of bodies and bases, then of the multipliers.
    answer: DMatrix<T>,
    /// Rows c, in the same order.
    below: DMatrix<T>,
    /// Index of the first multiplier.
    start: usize,
}

/// Linear combination of levels that forms a matrix, for the balance and for the ends: (factor, level).
pub(super) struct LevelCombination<'a, T> {
    pub balance: &'a [(T, usize)],
    pub ends: &'a [(T, usize)],
    /// Maxwell branches of the rods, which respond to displacements at this rate; None if they carry no load.
    pub memory: Option<(T, &'a [Memory])>,
}

impl HeavyAssembly {
    /// Derivatives by accelerations and multipliers alone.
    pub(super) fn mass_blocks(&self, at: &HeavyState) -> Option<Blocks> {
        let mut whole = Vec::with_capacity(self.links.len());
        for (link, moving) in self.links.iter().zip(&at.rods) {
            let (mass, turned) = link.rod.mass_matrix(at.t, moving)?;
            whole.push((mass, turned.end()));
        }
        let mut free = DMatrix::zeros(self.layout.free, self.layout.free);
        for (number, (carrier, body)) in self.carriers.iter().zip(&at.bodies).enumerate() {
            let mass = carrier.mass();
            let crate::assembly::BodyMotion { pose, twist } = &body.place;
            let linear = mass.linear(at.t, pose, twist, &nalgebra::Vector6::zeros())?;
            let own = self.body_seat(number, body).by;
            free += own.tr_mul(&(linear.by_acceleration * own.clone()));
        }
        let whole: Vec<(&DMatrix<f64>, &DMatrix<f64>)> =
            whole.iter().map(|(mass, end)| (mass, end)).collect();
        let columns: Vec<_> = whole
            .iter()
            .zip(self.links.iter().zip(&at.seats))
            .map(|((mass, end), (link, (from, to)))| {
                let m = link.rod.size();
                let mut ends = through_base(end, m, &from.by);
                if let Some(seat) = to {
                    ends -= &seat.by;
                }
                (through_base(mass, m, &from.by), ends)
            })
            .collect();
        let level = self.level(at, &whole, &columns, free);
        Some(Blocks {
            by_wrench: self.by_wrench(at, whole.iter().map(|(_, end)| *end)),
            levels: vec![level],
        })
    }

    /// All derivatives of a balance.
    pub(super) fn blocks(
        &self,
        at: &HeavyState,
        balance: &HeavyBalance,
        unknowns: &[f64],
    ) -> Option<Blocks> {
        let faster = DVector::from_column_slice(&unknowns[..self.layout.free]);
        let size = self.layout.free;
        let mut free = [0; 3].map(|_| DMatrix::zeros(size, size));
        for (number, (carrier, body)) in self.carriers.iter().zip(&at.bodies).enumerate() {
            let mass = carrier.mass();
            let BodyNow { place, .. } = body;
            let wrench = &balance.wrenches[number];
            let linear = mass.linear(at.t, &place.pose, &place.twist, wrench)?;
            let seat = self.body_seat(number, body);
            let aside = self.seat_linear(&seat, &at.bodies, &faster);
            let by_place = linear.by_pose * &seat.by
                + linear.by_velocity * aside.twist_by_place
                + linear.by_acceleration * aside.by_place;
            let by_velocity =
                linear.by_velocity * &seat.by + linear.by_acceleration * aside.by_velocity;
            free[0] += seat.by.tr_mul(&by_place);
            free[1] += seat.by.tr_mul(&by_velocity);
            free[2] += seat.by.tr_mul(&(linear.by_acceleration * &seat.by));
            self.add_lever(&mut free[0], &seat, &at.bodies, wrench);
        }
        for axis in at.all_axes() {
            let (z, law) = (axis.velocity, &axis.axis.law);
            free[0][(z, z)] += law.stiffness;
            free[1][(z, z)] += law.damping;
        }
        let mut found: Vec<Derivatives> = Vec::with_capacity(self.links.len());
        let mut columns: [Vec<_>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for (k, (link, (from, to))) in self.links.iter().zip(&at.seats).enumerate() {
            let d = link.rod.derivatives(at.t, &at.rods[k], &balance.rods[k])?;
            let aside = self.seat_linear(from, &at.bodies, &faster);
            let through =
                |d: &DMatrix<f64>, by: &DMatrix<f64>| through_base(d, link.rod.size(), by);
            let along = |[place, rate, second]: [&DMatrix<f64>; 3]| {
                [
                    through(place, &from.by)
                        + through(rate, &aside.twist_by_place)
                        + through(second, &aside.by_place),
                    through(rate, &from.by) + through(second, &aside.by_velocity),
                    through(second, &from.by),
                ]
            };
            let own = along([&d.by_strain, &d.by_rate, &d.mass]);
            let mut ends = along(d.end.each_ref());
            if let Some(seat) = to {
                let aside = self.seat_linear(seat, &at.bodies, &faster);
                ends[0] -= aside.by_place;
                ends[1] -= aside.by_velocity;
                ends[2] -= &seat.by;
                let wrench = self.end_wrench(k, unknowns);
                self.add_lever(&mut free[0], seat, &at.bodies, &wrench);
            }
            self.add_lever(&mut free[0], from, &at.bodies, &balance.rods[k].base);
            for ((columns, own), end) in columns.iter_mut().zip(own).zip(ends) {
                columns.push((own, end));
            }
            found.push(d);
        }
        let levels = free.into_iter().enumerate().map(|(j, free)| {
            let whole: Vec<_> = found
                .iter()
                .map(|d| ([&d.by_strain, &d.by_rate, &d.mass][j], &d.end[j]))
                .collect();
            self.level(at, &whole, &columns[j], free)
        });
        Some(Blocks {
            levels: levels.collect(),
            by_wrench: self.by_wrench(at, found.iter().map(|d| &d.end[2])),
        })
    }

    /// A level from the derivatives of rods and their ends, with their bases, and from the columns of bodies and
    /// bases in both.
    fn level(
        &self,
        at: &HeavyState,
        whole: &[(&DMatrix<f64>, &DMatrix<f64>)],
        columns: &[(DMatrix<f64>, DMatrix<f64>)],
        mut free: DMatrix<f64>,
    ) -> Level {
        let all = self.links.iter().zip(&at.seats).zip(whole).zip(columns);
        let rods = all.map(|(((link, (from, _)), (d, end)), (own, ends))| {
            let m = link.rod.size();
            let rows = link.to.as_ref().map_or(0..0, super::Tie::rows);
            let base = d.nrows() - m;
            let by = from.by.rows(0, base);
            free += by.tr_mul(&own.rows(m, base));
            RodBlocks {
                own: d.view((0, 0), (m, m)).into_owned(),
                own_by_free: own.rows(0, m).into_owned(),
                free_by_own: by.tr_mul(&d.view((m, 0), (base, m))),
                end_by_own: end.view((rows.start, 0), (rows.len(), m)).into_owned(),
                end_by_free: ends.rows(rows.start, rows.len()).into_owned(),
            }
        });
        Level {
            rods: rods.collect(),
            free,
        }
    }

    /// Columns of the multipliers, from the twists of the ends by strains and base.
    fn by_wrench<'a>(
        &self,
        at: &HeavyState,
        ends: impl Iterator<Item = &'a DMatrix<f64>>,
    ) -> Vec<[DMatrix<f64>; 2]> {
        let all = self.links.iter().zip(&at.seats).zip(ends);
        all.map(|((link, (from, to)), end)| {
            let m = link.rod.size();
            let rows = link.to.as_ref().map_or(0..0, super::Tie::rows);
            let end = end.rows(rows.start, rows.len()).into_owned();
            let mut free = -through_base(&end, m, &from.by).transpose();
            if let Some(seat) = to {
                free += seat.by.rows(rows.start, rows.len()).transpose();
            }
            [-end.columns(0, m).transpose(), free]
        })
        .collect()
    }
}

/// Derivatives by bodies and bases: those by the rod's base, the columns of `rod` behind its `size` strains, times the
/// motion of the base. Zero for a base without columns, which does not move.
pub(super) fn through_base(rod: &DMatrix<f64>, size: usize, base: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = rod.ncols() - size;
    rod.columns(size, columns) * base.rows(0, columns)
}

/// out += m x.
fn add<T: Scalar>(out: &mut [T], m: &DMatrix<f64>, x: &[T]) {
    for (column, x) in m.column_iter().zip(x) {
        for (out, m) in out.iter_mut().zip(column.iter()) {
            *out += T::from_real(*m) * *x;
        }
    }
}

impl Blocks {
    /// Number of velocities of bodies and bases.
    fn free(&self) -> usize {
        self.levels[0].free.nrows()
    }

    /// A level by index; the last is that of the accelerations.
    pub fn level(&self, at: usize) -> &Level {
        &self.levels[at]
    }

    /// Factors of the mass matrix, the last level alone.
    pub fn mass(&self) -> Option<Factored<f64>> {
        let last = [(1.0, self.levels.len() - 1)];
        self.factored(&LevelCombination {
            balance: &last,
            ends: &last,
            memory: None,
        })
    }

    /// Factors of a combination of levels with the multipliers; None if singular.
    pub fn factored<T: Scalar>(&self, mix: &LevelCombination<'_, T>) -> Option<Factored<T>> {
        let free = self.free();
        let held: usize = self.by_wrench.iter().map(|by| by[0].ncols()).sum();
        let mut small = DMatrix::<T>::zeros(free + held, free + held);
        for (factor, j) in mix.balance {
            small
                .view_mut((0, 0), (free, free))
                .zip_apply(&self.levels[*j].free, |s, m| {
                    *s += *factor * T::from_real(m)
                });
        }
        let mut rods = Vec::with_capacity(self.by_wrench.len());
        let mut start = free;
        for (k, [own_by_wrench, free_by_wrench]) in self.by_wrench.iter().enumerate() {
            let (m, ties) = own_by_wrench.shape();
            let sum = |of: &[(T, usize)], pick: fn(&RodBlocks) -> &DMatrix<f64>| {
                let mut sum =
                    pick(&self.levels[of[0].1].rods[k]).map(|x| of[0].0 * T::from_real(x));
                for (factor, j) in &of[1..] {
                    let m = pick(&self.levels[*j].rods[k]);
                    sum.zip_apply(m, |s, m| *s += *factor * T::from_real(m));
                }
                sum
            };
            let mut own = sum(mix.balance, |part| &part.own);
            if let Some((sigma, memory)) = mix.memory {
                memory[k].stiffen(sigma, &mut own);
            }
            // Rows and columns are scaled to a diagonal of size 1, since weights of nodes and stiffnesses of strains
            // differ in size.
            let scale: Vec<f64> = (0..m).map(|i| 1.0 / own[(i, i)].modulus().sqrt()).collect();
            if !scale.iter().all(|x| x.is_finite()) {
                return None;
            }
            for j in 0..m {
                for i in 0..m {
                    own[(i, j)] *= T::from_real(scale[i] * scale[j]);
                }
            }
            let mut answer = DMatrix::<T>::zeros(m, free + ties);
            answer
                .columns_mut(0, free)
                .copy_from(&sum(mix.balance, |part| &part.own_by_free));
            answer
                .columns_mut(free, ties)
                .copy_from(&own_by_wrench.map(T::from_real));
            let scaled = |x: &mut DMatrix<T>| {
                for (mut row, scale) in x.row_iter_mut().zip(&scale) {
                    row *= T::from_real(*scale);
                }
            };
            scaled(&mut answer);
            let lu = Lu::new(&own)?;
            for mut column in answer.column_iter_mut() {
                let mut x = column.clone_owned();
                if !lu.solve(&mut x) {
                    return None;
                }
                column.copy_from(&x);
            }
            scaled(&mut answer);
            let mut below = DMatrix::<T>::zeros(free + ties, m);
            below
                .rows_mut(0, free)
                .copy_from(&sum(mix.balance, |part| &part.free_by_own));
            below
                .rows_mut(free, ties)
                .copy_from(&sum(mix.ends, |part| &part.end_by_own));
            let mut gone = -(&below * &answer);
            gone.view_mut((0, free), (free, ties))
                .zip_apply(free_by_wrench, |s, m| *s += T::from_real(m));
            let ends = sum(mix.ends, |part| &part.end_by_free);
            gone.view_mut((free, 0), (ties, free))
                .zip_apply(&ends, |s, m| *s += m);
            let place = |i: usize| if i < free { i } else { i - free + start };
            for j in 0..free + ties {
                for i in 0..free + ties {
                    small[(place(i), place(j))] += gone[(i, j)];
                }
            }
            rods.push(RodFactor {
                lu,
                scale,
                answer,
                below,
                start,
            });
            start += ties;
        }
        let largest =
            |row: nalgebra::RowDVector<T>| row.iter().map(|x| x.modulus()).fold(0.0, f64::max);
        let scale: Vec<f64> = small
            .row_iter()
            .map(|row| 1.0 / largest(row.into_owned()))
            .collect();
        if !scale.iter().all(|x| x.is_finite()) {
            return None;
        }
        for (mut row, scale) in small.row_iter_mut().zip(&scale) {
            row *= T::from_real(*scale);
        }
        let small = Lu::new(&small)?;
        Some(Factored { rods, small, scale })
    }

    /// Product of a level with displacements (or velocities, accelerations) of rods, bodies and bases: the balance of
    /// the rods, then that of bodies and bases with the ends. Multipliers in `x` do not contribute.
    pub fn times<T: Scalar>(&self, level: usize, x: &BlockVector<T>) -> BlockVector<T> {
        let Level { rods, free } = &self.levels[level];
        let count = self.free();
        let (moved, mut start) = (&x.free.as_slice()[..count], count);
        let mut out = BlockVector {
            rods: Vec::with_capacity(rods.len()),
            free: DVector::zeros(x.free.len()),
        };
        add(&mut out.free.as_mut_slice()[..count], free, moved);
        for (part, x) in rods.iter().zip(&x.rods) {
            let mut own = DVector::zeros(x.len());
            add(own.as_mut_slice(), &part.own, x.as_slice());
            add(own.as_mut_slice(), &part.own_by_free, moved);
            out.rods.push(own);
            let (above, below) = out.free.as_mut_slice().split_at_mut(count);
            add(above, &part.free_by_own, x.as_slice());
            let ties = part.end_by_own.nrows();
            let below = &mut below[start - count..start - count + ties];
            add(below, &part.end_by_own, x.as_slice());
            add(below, &part.end_by_free, moved);
            start += ties;
        }
        out
    }
}

impl Level {
    /// Dense matrix, rods before bodies and bases.
    pub fn dense(&self) -> DMatrix<f64> {
        let sizes = self.rods.iter().map(|part| part.own.nrows());
        let first: usize = sizes.sum();
        let free = self.free.nrows();
        let mut whole = DMatrix::zeros(first + free, first + free);
        whole
            .view_mut((first, first), (free, free))
            .copy_from(&self.free);
        let mut at = 0;
        for part in &self.rods {
            let m = part.own.nrows();
            whole.view_mut((at, at), (m, m)).copy_from(&part.own);
            whole
                .view_mut((at, first), (m, free))
                .copy_from(&part.own_by_free);
            whole
                .view_mut((first, at), (free, m))
                .copy_from(&part.free_by_own);
            at += m;
        }
        whole
    }
}

impl<T: Scalar> Factored<T> {
    /// Overwrites the right-hand side with the solution; false on failure.
    pub fn solve(&self, b: &mut BlockVector<T>) -> bool {
        let held = |start: usize, ties: usize| start..start + ties;
        let free = self.rods.first().map_or(0, |rod| rod.start);
        for (rod, b_own) in self.rods.iter().zip(&mut b.rods) {
            for (b, scale) in b_own.iter_mut().zip(&rod.scale) {
                *b *= T::from_real(*scale);
            }
            if !rod.lu.solve(b_own) {
                return false;
            }
            for (b, scale) in b_own.iter_mut().zip(&rod.scale) {
                *b *= T::from_real(*scale);
            }
            let gone = &rod.below * &*b_own;
            for i in 0..free {
                b.free[i] -= gone[i];
            }
            for (i, j) in held(rod.start, gone.len() - free).enumerate() {
                b.free[j] -= gone[free + i];
            }
        }
        for (b, scale) in b.free.iter_mut().zip(&self.scale) {
            *b *= T::from_real(*scale);
        }
        if !self.small.solve(&mut b.free) {
            return false;
        }
        for (rod, b_own) in self.rods.iter().zip(&mut b.rods) {
            let ties = rod.answer.ncols() - free;
            let mut y = DVector::zeros(free + ties);
            y.rows_mut(0, free).copy_from(&b.free.rows(0, free));
            y.rows_mut(free, ties)
                .copy_from(&b.free.rows(rod.start, ties));
            *b_own -= &rod.answer * y;
        }
        b.free.iter().all(|x| x.is_finite())
    }
}

/// Blocks that several factors share.
pub(super) type Shared = Arc<Blocks>;
