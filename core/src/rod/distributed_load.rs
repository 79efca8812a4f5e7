//! Dead loads along a rod: its weight, or any force per length (theory 3.8).
//!
//! With f the force per unloaded length, n' = -f and m' = -r' x n give
//!
//! ```text
//! n(s) = n(0) - int_0^s f,   m(s) = m(0) - r x n(s) - w(s),   w' = r x f,   w(0) = 0.
//! ```
//!
//! n(s) is known beforehand; w is integrated along the rod, and in the tangent dw' = rho x f. A force F at one place
//! is a jump there: n falls by F, w grows by r x F, dw by rho x F, the work by F.r. The integration is cut at the jump.
//! A rod without load has the empty state `()`: its integration is bit for bit that of a program without loads along
//! rods.

use super::Rod;
use super::scaled_law::SAME_BREAK;
use crate::error::{Error, Result};
use crate::math::piecewise::Piecewise;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// A dead load along a rod: force per unloaded length in the world, piece by piece a polynomial in x = s/L, and forces
/// at places between the pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct DistributedLoad {
    pieces: Vec<Piece>,
}

/// A piece of the load, from one break to the next.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    from: f64,
    /// Force at `from` over the length of the rod, 0 at the base.
    jump: Vector3<f64>,
    /// int f dx from the base to `from`, with the jump there.
    before: Vector3<f64>,
    /// c_0, c_1, ... in powers of x - from.
    coefficients: Vec<Vector3<f64>>,
}

impl Piece {
    fn density(&self, x: f64) -> Vector3<f64> {
        let rest = self.coefficients.iter().rev();
        rest.fold(Vector3::zeros(), |sum, c| sum * (x - self.from) + c)
    }

    fn integral_to(&self, x: f64) -> Vector3<f64> {
        let (rest, x) = (self.coefficients.iter().enumerate().rev(), x - self.from);
        self.before + x * rest.fold(Vector3::zeros(), |sum, (k, c)| sum * x + c / (k + 1) as f64)
    }

    /// The coefficients in powers of x - `from`.
    fn coefficients_about(&self, from: f64) -> Vec<Vector3<f64>> {
        let mut c = self.coefficients.clone();
        // Repeated Horner scheme (Taylor shift).
        for first in 0..c.len().saturating_sub(1) {
            for k in (first..c.len() - 1).rev() {
                let next = c[k + 1];
                c[k] += next * (from - self.from);
            }
        }
        c
    }
}

/// Most rows of a table: every row is a break of the integration along the rod.
const ROWS: usize = 500;

impl DistributedLoad {
    /// A constant load along the rod, such as the weight of a uniform one.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn constant(force: Vector3<f64>) -> Result<Self> {
        Self::polynomial(vec![force])
    }

    /// f = c_0 + c_1 x + c_2 x^2 + ..., x = s/L, the base at 0.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn polynomial(coefficients: Vec<Vector3<f64>>) -> Result<Self> {
        Self::of(vec![(0.0, Vector3::zeros(), coefficients)])
    }

    /// Linear between the rows (x, f) of a table, x = s/L growing from 0 to 1. Its kinks are breaks of the
    /// integration along the rod.
    ///
    /// # Errors
    /// Fewer than 2 or more than 500 rows; places that do not grow from 0 to 1; a number that is not finite.
    pub fn table(rows: &[(f64, Vector3<f64>)]) -> Result<Self> {
        let grows = rows.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let whole = rows.first().is_some_and(|row| row.0 == 0.0)
            && rows.last().is_some_and(|row| row.0 == 1.0);
        if !((2..=ROWS).contains(&rows.len()) && grows && whole) {
            return Err(Error::domain(format!(
                "a table of a load along the rod has 2 to {ROWS} rows at places that grow from 0 to the length of the rod"
            )));
        }
        let pieces = rows.windows(2).map(|pair| {
            let (from, to) = (pair[0], pair[1]);
            let slope = (to.1 - from.1) / (to.0 - from.0);
            (from.0, Vector3::zeros(), vec![from.1, slope])
        });
        Self::of(pieces.collect())
    }

    /// A force at x = s/L, divided by the length of the rod.
    ///
    /// # Errors
    /// A place that is not inside the rod; a component that is not finite.
    pub fn at_place(x: f64, force_per_length: Vector3<f64>) -> Result<Self> {
        if !(x > 0.0 && x < 1.0) {
            return Err(Error::domain(format!(
                "a force on the rod acts at s/L = {x}; it must be between the base, 0, and the end, 1"
            )));
        }
        let none = Vector3::zeros();
        Self::of(vec![
            (0.0, none, Vec::new()),
            (x, force_per_length, Vec::new()),
        ])
    }

    /// A load at the end, x = 1, divided by the length of the rod: for loads without a potential, which turn with the
    /// end. A dead force there belongs to the body at the end.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn at_end(force_per_length: Vector3<f64>) -> Result<Self> {
        let none = Vector3::zeros();
        Self::of(vec![
            (0.0, none, Vec::new()),
            (1.0, force_per_length, Vec::new()),
        ])
    }

    /// A load on the part of the rod between two places x = s/L, and none elsewhere: c_0 + c_1 x + ....
    ///
    /// # Errors
    /// Places that do not grow, or are beyond the rod; a component that is not finite.
    pub fn between(from: f64, to: f64, coefficients: Vec<Vector3<f64>>) -> Result<Self> {
        if !(from >= 0.0 && from < to && to <= 1.0) {
            return Err(Error::domain(format!(
                "a load acts along the rod from s/L = {from} to {to}; the places must grow, from 0 at least to 1 at most"
            )));
        }
        let whole = Self::polynomial(coefficients)?;
        let none = Vector3::zeros();
        let mut pieces = vec![(from, none, whole.at(from).coefficients_about(from))];
        if from > 0.0 {
            pieces.insert(0, (0.0, none, Vec::new()));
        }
        if to < 1.0 {
            pieces.push((to, none, Vec::new()));
        }
        Self::of(pieces)
    }

    /// f = g(x) times a vector, g piece by piece a polynomial in x = s/L, such as the weight of a tapered rod.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn along(force: Vector3<f64>, by: &Piecewise) -> Result<Self> {
        let none = Vector3::zeros();
        let pieces = by.pieces().iter();
        let piece =
            |(from, c): &(f64, Vec<f64>)| (*from, none, c.iter().map(|c| force * *c).collect());
        Self::of(pieces.map(piece).collect())
    }

    fn of(pieces: Vec<(f64, Vector3<f64>, Vec<Vector3<f64>>)>) -> Result<Self> {
        let numbers = pieces
            .iter()
            .flat_map(|(_, jump, c)| c.iter().chain([jump]).flatten());
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return Err(Error::domain(
                "the components of a load along the rod must be finite",
            ));
        }
        let mut made: Vec<Piece> = Vec::with_capacity(pieces.len());
        for (from, jump, coefficients) in pieces {
            let before = made
                .last()
                .map_or(Vector3::zeros(), |last| last.integral_to(from));
            made.push(Piece {
                from,
                jump,
                before: before + jump,
                coefficients,
            });
        }
        Ok(Self { pieces: made })
    }

    /// The sum of two loads.
    ///
    /// # Errors
    /// A sum that is not finite.
    pub fn plus(&self, other: &Self) -> Result<Self> {
        let places = self.pieces.iter().chain(&other.pieces);
        let mut breaks: Vec<f64> = places.map(|piece| piece.from).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        let pieces = breaks.into_iter().map(|from| {
            let (mut sum, mut more) = (
                self.at(from).coefficients_about(from),
                other.at(from).coefficients_about(from),
            );
            if sum.len() < more.len() {
                std::mem::swap(&mut sum, &mut more);
            }
            for (sum, c) in sum.iter_mut().zip(more) {
                *sum += c;
            }
            let jump = |load: &Self| {
                let there = load.pieces.iter().find(|piece| piece.from == from);
                there.map_or_else(Vector3::zeros, |piece| piece.jump)
            };
            (from, jump(self) + jump(other), sum)
        });
        Self::of(pieces.collect())
    }

    /// This load with every force changed by a linear map, such as a rotation or a change of units.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Self {
        let pieces = self.pieces.iter().map(|piece| Piece {
            from: piece.from,
            jump: map(&piece.jump),
            before: map(&piece.before),
            coefficients: piece.coefficients.iter().map(&map).collect(),
        });
        Self {
            pieces: pieces.collect(),
        }
    }

    /// The load f(1 - x) on the rod begun at its other end.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut pieces: Vec<Piece> = Vec::with_capacity(self.pieces.len());
        let ends = self.pieces.iter().skip(1).map(|piece| piece.from);
        let ends: Vec<f64> = ends.chain([1.0]).collect();
        let jumps = self.pieces.iter().skip(1).map(|piece| piece.jump);
        let jumps: Vec<_> = jumps.chain([Vector3::zeros()]).collect();
        for ((piece, end), jump) in self.pieces.iter().zip(ends).zip(jumps).rev() {
            let mut coefficients = piece.coefficients_about(end);
            for c in coefficients.iter_mut().skip(1).step_by(2) {
                c.neg_mut();
            }
            let from = 1.0 - end;
            let before = pieces
                .last()
                .map_or(Vector3::zeros(), |last| last.integral_to(from));
            pieces.push(Piece {
                from,
                jump,
                before: before + jump,
                coefficients,
            });
        }
        Self { pieces }
    }

    /// The piece at x; that of the inside of the rod at x = 1.
    #[inline]
    fn at(&self, x: f64) -> &Piece {
        let last = self.pieces.len() - 1;
        let later = self.pieces[1..]
            .iter()
            .rposition(|piece| piece.from <= x && piece.from < 1.0);
        &self.pieces[later.map_or(0, |k| k + 1).min(last)]
    }

    /// f at x = s/L.
    #[inline]
    pub fn density(&self, x: f64) -> Vector3<f64> {
        self.at(x).density(x)
    }

    /// int f dx from the base to x = s/L, without a load at the end: the force on that part of a rod of length 1.
    #[inline]
    pub fn integral_to(&self, x: f64) -> Vector3<f64> {
        self.at(x).integral_to(x)
    }

    /// The whole force on a rod of this length.
    pub fn total(&self, length: f64) -> Vector3<f64> {
        self.integral_to(1.0) * length
    }

    /// Places x = s/L inside the rod at which the load is not smooth, in growing order.
    pub fn breaks(&self) -> Vec<f64> {
        let inside = self.pieces.iter().skip(1).map(|piece| piece.from);
        inside.filter(|from| *from < 1.0).collect()
    }

    /// Forces at single places x = s/L, divided by the length of the rod.
    pub fn points(&self) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        let jumps = self.pieces.iter().map(|piece| (piece.from, piece.jump));
        jumps.filter(|(_, jump)| *jump != Vector3::zeros())
    }

    /// The force at a break x of the integration, divided by the length; 0 elsewhere.
    #[inline]
    fn jump_at(&self, x: f64) -> Vector3<f64> {
        let near = |from: f64| from > x - 0.1 * SAME_BREAK && from < x + 0.9 * SAME_BREAK;
        let here = self.pieces.iter().filter(|piece| near(piece.from));
        here.fold(Vector3::zeros(), |sum, piece| sum + piece.jump)
    }

    /// True if there is no load at all.
    pub fn is_zero(&self) -> bool {
        self.coefficients().all(|c| *c == Vector3::zeros())
    }

    /// The coefficients of all pieces and the forces between them: vectors that span the directions of the load.
    fn coefficients(&self) -> impl Iterator<Item = &Vector3<f64>> {
        let pieces = self.pieces.iter();
        pieces.flat_map(|piece| piece.coefficients.iter().chain([&piece.jump]))
    }
}

/// The load in the clamp's frame and the numerics' units: B/L^3.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ScaledLoad {
    load: DistributedLoad,
    /// Constant of the potential in B/L: potential of a rod shrunk to its clamp.
    ground: f64,
}

impl ScaledLoad {
    /// True if the load has the direction of the unit vector `axis` everywhere, or its opposite.
    pub(super) fn is_along(&self, axis: &Vector3<f64>) -> bool {
        let mut all = self.load.coefficients();
        all.all(|c| axis.cross(c).norm() <= 1e-12 * c.norm())
    }

    pub(super) fn new(load: &DistributedLoad, rod: &Rod) -> Self {
        let (couple, force) = rod.units();
        let turn = rod.clamp.rotation.inverse();
        let scale = rod.length / force;
        let ground = -load.total(rod.length).dot(&rod.clamp.translation.vector) / couple;
        Self {
            load: load.mapped(|c| turn * c * scale),
            ground,
        }
    }

    /// A load along the directors.
    pub(super) fn turning(load: &DistributedLoad, rod: &Rod) -> Self {
        let scale = rod.length / rod.units().1;
        Self {
            load: load.mapped(|c| c * scale),
            ground: 0.0,
        }
    }

    /// Couples along the rod, in the world or, if they turn, along the directors.
    pub(super) fn couples(load: &DistributedLoad, rod: &Rod, turning: bool) -> Self {
        let scale = rod.length / rod.units().0;
        let turn = if turning {
            UnitQuaternion::identity()
        } else {
            rod.clamp.rotation.inverse()
        };
        Self {
            load: load.mapped(|c| turn * c * scale),
            ground: 0.0,
        }
    }

    /// The zero load.
    pub(super) fn nothing() -> Self {
        let piece = Piece {
            from: 0.0,
            jump: Vector3::zeros(),
            before: Vector3::zeros(),
            coefficients: Vec::new(),
        };
        Self {
            load: DistributedLoad {
                pieces: vec![piece],
            },
            ground: 0.0,
        }
    }

    /// The load times a factor.
    pub(super) fn times(&self, part: f64) -> Self {
        Self {
            load: self.load.mapped(|c| c * part),
            ground: self.ground * part,
        }
    }

    /// The load turned about the clamp.
    pub(super) fn turned(&self, turn: &Rotation3<f64>) -> Self {
        Self {
            load: self.load.mapped(|c| turn * c),
            ground: self.ground,
        }
    }

    /// Vectors that span the directions of the load.
    pub(super) fn directions(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.load.coefficients()
    }

    /// Accumulated load int_0^s f.
    #[inline]
    pub(super) fn integral_to(&self, s: f64) -> Vector3<f64> {
        self.load.integral_to(s)
    }

    /// Load density f(s).
    #[inline]
    pub(super) fn density(&self, s: f64) -> Vector3<f64> {
        self.load.density(s)
    }

    /// The force at a break of the integration; 0 where none acts.
    #[inline]
    pub(super) fn jump_at(&self, s: f64) -> Vector3<f64> {
        self.load.jump_at(s)
    }

    /// Total load int_0^1 f.
    pub(super) fn total(&self) -> Vector3<f64> {
        self.integral_to(1.0)
    }

    /// Places inside the rod at which the load is not smooth.
    pub(super) fn breaks(&self) -> Vec<f64> {
        self.load.breaks()
    }

    /// Mean along the rod of a function of the force n(s); `base` is n(0).
    pub(super) fn mean(&self, base: &Vector3<f64>, of: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        const PARTS: usize = 64;
        let at = |k: usize| {
            let s = (k as f64 + 0.5) / PARTS as f64;
            of(&(base - self.integral_to(s)))
        };
        (0..PARTS).map(at).sum::<f64>() / PARTS as f64
    }

    /// Potential of the load; `work` is int f.r ds, in B/L.
    pub(super) fn potential(&self, work: f64) -> f64 {
        self.ground - work
    }
}

/// Directors and place of a section, with their variations by columns.
pub(super) struct Place<'a, const K: usize> {
    pub(super) d: &'a [[f64; 3]; 3],
    pub(super) r: &'a [f64; 3],
    pub(super) phi: &'a [[f64; K]; 3],
    pub(super) rho: &'a [[f64; K]; 3],
}

/// State of a load, integrated along the rod besides frame and centreline.
pub(super) trait LoadState<const K: usize>: Copy + std::fmt::Debug {
    /// The load itself.
    type Load;
    /// State at the clamp.
    const NOTHING: Self;
    /// self += a x.
    fn axpy(&mut self, a: f64, x: &Self);
    /// Adds the errors of the shape, and of the tangent, squared and relative to the size between `from` and `to`.
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64);
    /// Force n(s) with n(0) = `base`.
    fn force(&self, load: &Self::Load, base: &[f64; 3], s: f64) -> [f64; 3];
    /// Variations of the follower force summed from the clamp to this section, by columns; `None` without such a load.
    fn taken_force(&self) -> Option<&[[f64; K]; 3]> {
        None
    }
    /// Power of the loads without a potential from the clamp to this section, by columns; `None` without such a load.
    fn power(&self) -> Option<&[f64; K]> {
        None
    }
    /// Load density at s.
    fn density(load: &Self::Load, s: f64) -> Vector3<f64>;
    /// Dead force at a break of the integration.
    fn jump(load: &Self::Load, s: f64) -> Vector3<f64>;
    /// Adds the forces and couples at a break of the integration.
    fn cross(&mut self, load: &Self::Load, s: f64, at: &Place<'_, K>);
    /// Subtracts w from m.
    fn subtract_couple(&self, m: &mut [f64; 3]);
    /// Subtracts dw from dm, by columns.
    fn take_columns(&self, dm: &mut [[f64; K]; 3]);
    /// Derivative along the rod at s, with the directors d, r, and their variations phi and rho.
    fn slope(load: &Self::Load, s: f64, at: &Place<'_, K>) -> Self;
    /// Columns of the tangent.
    fn columns(&mut self) -> &mut [[f64; K]];
    /// Work int f.r ds from the clamp to this section.
    fn work(&self) -> f64;
}

impl<const K: usize> LoadState<K> for () {
    type Load = ();
    const NOTHING: Self = ();

    #[inline(always)]
    fn axpy(&mut self, _: f64, (): &Self) {}

    #[inline(always)]
    fn add_errors(&self, (): &Self, (): &Self, _: &mut f64, _: &mut f64) {}

    #[inline(always)]
    fn force(&self, (): &(), base: &[f64; 3], _: f64) -> [f64; 3] {
        *base
    }

    #[inline(always)]
    fn density((): &(), _: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    #[inline(always)]
    fn jump((): &(), _: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    #[inline(always)]
    fn cross(&mut self, (): &(), _: f64, _: &Place<'_, K>) {}

    #[inline(always)]
    fn subtract_couple(&self, _: &mut [f64; 3]) {}

    #[inline(always)]
    fn take_columns(&self, _: &mut [[f64; K]; 3]) {}

    #[inline(always)]
    fn slope((): &(), _: f64, _: &Place<'_, K>) -> Self {}

    #[inline(always)]
    fn columns(&mut self) -> &mut [[f64; K]] {
        &mut []
    }

    fn work(&self) -> f64 {
        0.0
    }
}

/// Couple w of the load with its tangent, and the work of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadMoment<const K: usize> {
    w: [f64; 3],
    dw: [[f64; K]; 3],
    work: f64,
}

impl<const K: usize> LoadMoment<K> {
    /// Adds a couple with its tangent, by columns.
    #[inline]
    pub(super) fn add_couple(&mut self, w: &Vector3<f64>, by: impl Fn(usize) -> Vector3<f64>) {
        for i in 0..3 {
            self.w[i] += w[i];
        }
        for j in 0..K {
            let column = by(j);
            for i in 0..3 {
                self.dw[i][j] += column[i];
            }
        }
    }
}

impl<const K: usize> LoadState<K> for LoadMoment<K> {
    type Load = ScaledLoad;
    const NOTHING: Self = Self {
        w: [0.0; 3],
        dw: [[0.0; K]; 3],
        work: 0.0,
    };

    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.work += a * x.work;
        for i in 0..3 {
            self.w[i] += a * x.w[i];
            for j in 0..K {
                self.dw[i][j] += a * x.dw[i][j];
            }
        }
    }

    #[inline]
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64) {
        let size = |w: &[f64; 3]| w.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        let scale = size(&from.w).max(size(&to.w));
        *shape += (self.work / (1.0 + to.work.abs())).powi(2);
        for i in 0..3 {
            *shape += (self.w[i] / scale).powi(2);
            for j in 0..K {
                let scale = 1.0 + from.dw[i][j].abs().max(to.dw[i][j].abs());
                *tangent += (self.dw[i][j] / scale).powi(2);
            }
        }
    }

    #[inline]
    fn force(&self, load: &ScaledLoad, base: &[f64; 3], s: f64) -> [f64; 3] {
        let gone = load.integral_to(s);
        [base[0] - gone.x, base[1] - gone.y, base[2] - gone.z]
    }

    #[inline]
    fn density(load: &ScaledLoad, s: f64) -> Vector3<f64> {
        load.density(s)
    }

    #[inline]
    fn jump(load: &ScaledLoad, s: f64) -> Vector3<f64> {
        load.jump_at(s)
    }

    #[inline]
    fn cross(&mut self, load: &ScaledLoad, s: f64, at: &Place<'_, K>) {
        self.axpy(1.0, &Self::of_force(&load.jump_at(s), at));
    }

    #[inline]
    fn subtract_couple(&self, m: &mut [f64; 3]) {
        for (m, w) in m.iter_mut().zip(&self.w) {
            *m -= w;
        }
    }

    #[inline]
    fn take_columns(&self, dm: &mut [[f64; K]; 3]) {
        for (row, taken) in dm.iter_mut().zip(&self.dw) {
            for (m, w) in row.iter_mut().zip(taken) {
                *m -= w;
            }
        }
    }

    #[inline]
    fn slope(load: &ScaledLoad, s: f64, at: &Place<'_, K>) -> Self {
        Self::of_force(&load.density(s), at)
    }

    fn columns(&mut self) -> &mut [[f64; K]] {
        &mut self.dw
    }

    fn work(&self) -> f64 {
        self.work
    }
}

impl<const K: usize> LoadMoment<K> {
    /// Couple and work of a dead force f at a section.
    #[inline]
    fn of_force(f: &Vector3<f64>, at: &Place<'_, K>) -> Self {
        let (r, rho) = (Vector3::from(*at.r), at.rho);
        let mut dw = [[0.0; K]; 3];
        for j in 0..K {
            dw[0][j] = rho[1][j] * f.z - rho[2][j] * f.y;
            dw[1][j] = rho[2][j] * f.x - rho[0][j] * f.z;
            dw[2][j] = rho[0][j] * f.y - rho[1][j] * f.x;
        }
        Self {
            w: r.cross(f).into(),
            dw,
            work: f.dot(&r),
        }
    }
}
