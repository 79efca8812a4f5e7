//! Equilibria of a planar rod with given touches as a sheet over the place of the rod's end: a chart about one of them.
//!
//! The unknowns u of a rod with given touches are its base wrench, and reaction and place of each touch. They meet the
//! equations C(u) = 0: the end carries no couple, and each touch has gap and slope zero. Two freedoms are left, those
//! of the end's place. With T an orthonormal basis of the kernel of dC at a centre u_0, in scaled unknowns, the chart q
//! is
//!
//! ```text
//! C(u) = 0,   T^T S^-1 (u - u_0) = q.
//! ```
//!
//! The chart is smooth through folds, where the end's place alone determines nothing. It is local: a motion that
//! leaves it goes on in a chart about another centre.

use super::active_set::ROUNDING;
use super::closest_points::{Probe, minima};
use super::equations::Touching;
use super::taylor_piece::{PlaneSection, TaylorPiece};
use super::{
    ContactGuess, ContactOptions, ContactProblem, GuessedTouch, ScaledTouch, Surface, TouchPoint,
};
use crate::elastica::PlanarSection;
use crate::error::{Error, Result};
use crate::manifold::{EquilibriumManifold, ManifoldPoint, Multivalued, Sheet, Sign};
use crate::math::se3::join;
use crate::obstacle::{Feature, Gap};
use crate::rod::{EndConditions, Path, Problem, Rod};
use crate::section::Linear;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix2, Matrix2xX, Matrix4xX, RowDVector, Vector2, Vector3,
};
use std::sync::Arc;

/// Unknowns of the base wrench: the couple, and the force along x and y.
const WRENCH: usize = 3;
/// Largest |q| of a chart.
const EDGE: f64 = 0.6;
/// Part of [`EDGE`] beyond which a motion should go on about another centre.
const MIDDLE: f64 = 0.6;
/// |q| up to which a motion stays in a chart in any case.
const NEAR: f64 = 0.05;
/// The chart must still hold at this multiple of q.
const AHEAD: f64 = 1.5;
/// Newton steps within a chart, and Newton steps to the centre of a chart.
const STEPS: usize = 12;
const STEPS_TO_CENTRE: usize = 30;
/// Scaled length of a Newton step behind which the next one is rounding, and that of a step that is rounding.
const SQUARED: f64 = 2e-8;
const NO_STEP: f64 = 1e-14;
/// Largest scaled length of a first Newton step, and of a Newton step over the one before it.
const FIRST_STEP: f64 = 0.02;
const CONTRACTION: f64 = 0.25;
/// Step of the differences that give the second derivatives of the unknowns at the centre.
const SECOND: f64 = 1e-3;
/// Residual of a centre that is none, relative to the unknowns.
const POOR: f64 = 1e-9;
/// Singular values that count as zero, over the largest, where a centre is found.
const LOST_RANK: f64 = 1e-10;
/// |det| below which a motion slows its own time, over the squared norm of the derivative of the place.
const PACE: f64 = 0.05;
/// Places along the rod at which the sign of the couple is looked at.
const LOOKS: usize = 64;
/// Distance along the rod below which a closest point is the touch itself, and that of a closest point from an end that
/// belongs to the end.
const SAME_TOUCH: f64 = 1e-6;
const AT_END: f64 = 1e-9;
/// Tolerance of the problem that gives the index.
const TOLERANCE: f64 = 1e-13;

/// A planar elastica from its clamp on, in units of its length and stiffness, among obstacles.
#[derive(Debug, Clone)]
pub struct ElasticaAmong {
    problem: ContactProblem,
}

impl ElasticaAmong {
    /// The rod of length 1 and stiffness 1 with its clamp in a pose, whose d1 is the axis of positive turns, among
    /// surfaces in the world.
    ///
    /// # Errors
    /// A clamp inside a surface; surfaces that are not symmetric about the plane of the rod.
    pub fn new(clamp: &Isometry3<f64>, surfaces: Vec<Surface>) -> Result<Self> {
        let rod = Rod::new(1.0, Linear::diagonal([1.0, 1.0], 1.0)?)?;
        let rod = rod.with_clamp(clamp.translation.vector, clamp.rotation);
        // The place of the end is an unknown of a sheet: any place will do.
        let end = EndConditions::ball(clamp.translation.vector);
        let problem = Problem::new(rod, end, TOLERANCE)?.with_path(Path::Planar);
        let problem = ContactProblem::new(problem, surfaces, ContactOptions::default())?;
        let normal = problem.plane.as_ref().map(|plane| plane.normal());
        if !normal.is_some_and(|normal| normal.x.abs() > 1.0 - 1e-9) {
            return Err(Error::domain(
                "the obstacles are not symmetric about the plane of the rod",
            ));
        }
        Ok(Self { problem })
    }

    fn gap(&self, surface: usize, r: &Vector2<f64>) -> PlaneGap {
        PlaneGap::from(&self.problem.gap(surface, &lifted(r)))
    }

    fn world(&self, v: &Vector2<f64>) -> Vector3<f64> {
        self.problem.rod().clamp.rotation * lifted(v)
    }
}

/// A gap in the plane of the rod, seen from the clamp.
#[derive(Debug, Clone, Copy)]
struct PlaneGap {
    value: f64,
    normal: Vector2<f64>,
    hessian: Matrix2<f64>,
    feature: Feature,
}

impl From<&Gap> for PlaneGap {
    fn from(gap: &Gap) -> Self {
        let h = &gap.hessian;
        Self {
            value: gap.value,
            normal: flat(&gap.normal),
            hessian: Matrix2::new(h[(2, 2)], -h[(2, 1)], -h[(1, 2)], h[(1, 1)]),
            feature: gap.feature,
        }
    }
}

impl PlaneGap {
    /// Slope of the gap along the rod.
    fn slope(&self, at: &PlaneSection) -> f64 {
        self.normal.dot(&at.tangent())
    }

    /// Relative curvature of rod and surface, where the slope is zero.
    fn curvature(&self, at: &PlaneSection) -> f64 {
        let t = at.tangent();
        t.dot(&(self.hessian * t)) + at.curvature * self.normal.dot(&Vector2::new(-t.y, t.x))
    }
}

/// The scales of the unknowns: of forces and of places.
fn scale_at(unknowns: &DVector<f64>) -> DVector<f64> {
    let force = 1.0 + unknowns.rows(0, WRENCH).norm();
    let place = |i: usize| i > WRENCH && (i - WRENCH) % 2 == 1;
    DVector::from_fn(unknowns.len(), |i, _| if place(i) { 1.0 } else { force })
}

/// A vector of the clamp's frame in the plane: x along d3, y along -d2.
fn flat(v: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(v.z, -v.y)
}

fn lifted(v: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(0.0, -v.y, v.x)
}

/// A planar rod with given touches: its equilibria as a smooth surface over the place of its end, about one of them.
///
/// Lengths are in units of the rod's length, forces in B/L^2. The place of the end is seen from the clamp: x along the
/// rod at the clamp, y across, so that d1 of the clamp is the axis of a positive turn from x to y.
#[derive(Debug, Clone)]
pub struct TouchedSheet {
    among: Arc<ElasticaAmong>,
    /// Surfaces of the touches.
    surfaces: Vec<usize>,
    centre: DVector<f64>,
    scale: DVector<f64>,
    /// T, by columns.
    kernel: DMatrix<f64>,
    /// Second derivatives of the scaled unknowns at the centre, by q1 q1, q1 q2 and q2 q2.
    second: [DVector<f64>; 3],
    /// The index, if it is known from a neighbouring chart.
    index: Option<usize>,
}

/// A section of a rod on a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetSection {
    /// Place, angle of the tangent and curvature.
    pub shape: PlanarSection,
    /// Force of the part beyond the section on the part before; at a touch that before the touch.
    pub force: Vector2<f64>,
}

/// The room up to a bound of a sheet, at a place of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// The kind of the bound.
    pub bound: Bound,
    /// Number of the surface.
    pub surface: usize,
    /// Arclength over the length of the rod.
    pub s: f64,
    /// The room: a distance, a reaction or a relative curvature, in units of the rod; negative beyond the bound.
    pub left: f64,
}

/// A bound of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// The rod comes to touch a surface: the room is the gap.
    Touch,
    /// A touch would have to pull: the room is its reaction.
    Release,
    /// A touch becomes a line: the room is the relative curvature of rod and surface.
    Line,
    /// A touch slides off the end of the rod, or to the clamp: the room is the distance from there.
    End,
}

/// A touch of a rod at trial unknowns.
#[derive(Debug, Clone, Copy)]
struct Touched {
    s: f64,
    reaction: f64,
    at: PlaneSection,
    gap: PlaneGap,
}

/// The rod at trial unknowns.
struct TouchedShape {
    /// The touches, in the order of the sheet.
    touches: Vec<Touched>,
    /// Pieces from the clamp on, each with its start.
    pieces: Vec<(f64, TaylorPiece)>,
}

/// Equations with their derivatives by the unknowns: the couple at the end, gap and slope of each touch; and the place
/// of the end.
struct Equations {
    value: DVector<f64>,
    by: DMatrix<f64>,
    place_by: DMatrix<f64>,
}

/// A point of a sheet with the rod there.
struct There {
    x: DVector<f64>,
    shape: TouchedShape,
    place_by: DMatrix<f64>,
    /// du/dq.
    by_chart: DMatrix<f64>,
}

impl Equations {
    /// Residual and derivatives by the scaled unknowns, each equation divided by the norm of its derivatives. The end
    /// of a taut rod amplifies changes of the base wrench exponentially.
    fn normalised(&self, scale: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        normalised(self.value.clone(), &self.by, scale)
    }
}

fn normalised(
    mut value: DVector<f64>,
    by: &DMatrix<f64>,
    scale: &DVector<f64>,
) -> (DVector<f64>, DMatrix<f64>) {
    let mut by = by * DMatrix::from_diagonal(scale);
    for (value, mut row) in value.iter_mut().zip(by.row_iter_mut()) {
        let norm = row.norm().max(f64::MIN_POSITIVE);
        *value /= norm;
        row /= norm;
    }
    (value, by)
}

impl TouchedShape {
    fn end(&self) -> PlaneSection {
        let (_, last) = self.pieces.last().expect("a rod has a piece");
        last.end
    }

    fn end_force(&self) -> Vector2<f64> {
        let (_, last) = self.pieces.last().expect("a rod has a piece");
        last.force
    }

    fn section(&self, s: f64) -> (PlaneSection, Vector2<f64>) {
        let behind = self.pieces.partition_point(|(from, _)| *from < s);
        let (from, piece) = &self.pieces[behind.saturating_sub(1)];
        (piece.section(s - from), piece.force)
    }
}

impl TouchedSheet {
    /// The sheet about the equilibrium with the touches of `guess` and the end at the place `pose`, seen from the
    /// clamp.
    ///
    /// # Errors
    /// Touches of the end, or lines; no equilibrium near the guess.
    pub fn new(
        among: Arc<ElasticaAmong>,
        guess: &ContactGuess,
        pose: &Vector2<f64>,
    ) -> Result<Self> {
        let Touching { b, touches } = among.problem.inward(guess)?;
        if touches
            .iter()
            .any(|touch| touch.at_end || touch.line.is_some())
        {
            return Err(Error::domain(
                "a sheet is that of a rod with touches at points between its ends",
            ));
        }
        let force = flat(&b.fixed_rows::<3>(3).into_owned());
        let wrench = [b[0], force.x, force.y];
        let pairs = touches.iter().flat_map(|touch| [touch.reaction, touch.s]);
        let x: Vec<f64> = wrench.into_iter().chain(pairs).collect();
        let size = x.len();
        let centre = DVector::from_vec(x);
        let none = DVector::zeros(size);
        let mut sheet = Self {
            surfaces: touches.iter().map(|touch| touch.surface).collect(),
            scale: scale_at(&centre),
            centre,
            kernel: DMatrix::zeros(size, 2),
            second: [none.clone(), none.clone(), none],
            index: None,
            among,
        };
        sheet.centre = sheet.polished(pose)?;
        sheet.orient()?;
        Ok(sheet)
    }

    /// This sheet in a chart about `q`. The index is constant up to the next fold.
    ///
    /// # Errors
    /// A point outside the chart.
    pub fn about(&self, q: &Vector2<f64>, index: usize) -> Result<Self> {
        let mut sheet = self.clone();
        sheet.centre = self.there(q).ok_or_else(outside)?.x;
        sheet.index = Some(index);
        sheet.scale = scale_at(&sheet.centre);
        sheet.orient()?;
        Ok(sheet)
    }

    /// Sets kernel and second derivatives of the chart about the centre.
    fn orient(&mut self) -> Result<()> {
        self.kernel = self.kernel_at_centre()?;
        let none = DVector::zeros(self.centre.len());
        self.second = [none.clone(), none.clone(), none];
        if let Some(second) = self.second_at_centre() {
            self.second = second;
        }
        Ok(())
    }

    /// The rod at the unknowns; None where a touch has left the rod.
    fn shape(&self, x: &DVector<f64>) -> Option<TouchedShape> {
        let mut order: Vec<usize> = (0..self.surfaces.len()).collect();
        let place = |i: usize| x[WRENCH + 1 + 2 * i];
        order.sort_by(|i, j| place(*i).total_cmp(&place(*j)));
        let mut touches: Vec<Option<Touched>> = vec![None; order.len()];
        let mut pieces = Vec::with_capacity(order.len() + 1);
        let (mut from, mut force) = (0.0, Vector2::new(x[1], x[2]));
        let mut at = PlaneSection {
            r: Vector2::zeros(),
            theta: 0.0,
            curvature: x[0],
        };
        for i in order {
            let (s, reaction) = (place(i), x[WRENCH + 2 * i]);
            if !(s > from && s < 1.0) {
                return None;
            }
            let piece = TaylorPiece::new(at, force, s - from)?;
            at = piece.end;
            pieces.push((from, piece));
            let gap = self.among.gap(self.surfaces[i], &at.r);
            touches[i] = Some(Touched {
                s,
                reaction,
                at,
                gap,
            });
            force -= gap.normal * reaction;
            from = s;
        }
        pieces.push((from, TaylorPiece::new(at, force, 1.0 - from)?));
        Some(TouchedShape {
            touches: touches.into_iter().flatten().collect(),
            pieces,
        })
    }

    /// The equations of a shape. Variations of a section are those at a touch that moves along the rod.
    fn equations(&self, shape: &TouchedShape) -> Equations {
        let count = self.surfaces.len();
        let size = WRENCH + 2 * count;
        let unit = |i: usize| RowDVector::from_fn(size, |_, j| f64::from(u8::from(i == j)));
        // Rows x, y, theta, curvature of the section, and the force.
        let mut section = Matrix4xX::zeros(size);
        section.set_row(3, &unit(0));
        let mut force = Matrix2xX::zeros(size);
        force.set_row(0, &unit(1));
        force.set_row(1, &unit(2));
        let mut moved = RowDVector::zeros(size);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|i, j| shape.touches[*i].s.total_cmp(&shape.touches[*j].s));
        let mut value = DVector::zeros(1 + 2 * count);
        let mut by = DMatrix::zeros(1 + 2 * count, size);
        for (k, (_, piece)) in shape.pieces.iter().enumerate() {
            let touch = order.get(k).copied();
            let to = touch.map_or_else(|| RowDVector::zeros(size), |i| unit(WRENCH + 1 + 2 * i));
            let tangent = piece.tangent();
            let mut start = Matrix4xX::zeros(size);
            start.rows_mut(0, 2).copy_from(&section.rows(2, 2));
            start.rows_mut(2, 2).copy_from(&force);
            let end = piece.end;
            let t = end.tangent();
            let growth = [
                t.x,
                t.y,
                end.curvature,
                piece.force.x * t.y - piece.force.y * t.x,
            ];
            let longer = &to - &moved;
            let mut next = tangent * start;
            for (row, growth) in growth.into_iter().enumerate() {
                let mut all = next.row(row) + &longer * growth;
                if row < 2 {
                    all += section.row(row);
                }
                next.set_row(row, &all);
            }
            section = next;
            moved = to;
            let Some(i) = touch else { break };
            let Touched { at, gap, .. } = &shape.touches[i];
            let place = section.rows(0, 2).into_owned();
            let (nu, across) = (gap.normal, Vector2::new(-t.y, t.x));
            let row = 1 + 2 * i;
            (value[row], value[row + 1]) = (gap.value, gap.slope(at));
            by.set_row(row, &(nu.transpose() * &place));
            let turned = section.row(2) * nu.dot(&across);
            by.set_row(row + 1, &((gap.hessian * t).transpose() * &place + turned));
            let reaction = shape.touches[i].reaction;
            force -= gap.hessian * place * reaction;
            for j in 0..2 {
                force[(j, WRENCH + 2 * i)] -= nu[j];
            }
        }
        value[0] = shape.end().curvature;
        by.set_row(0, &section.row(3));
        Equations {
            value,
            by,
            place_by: section.rows(0, 2).into_owned(),
        }
    }

    /// The unknowns at the centre: Newton steps of least scaled length, which work on a fold too.
    fn polished(&self, pose: &Vector2<f64>) -> Result<DVector<f64>> {
        let mut x = self.centre.clone();
        let mut last = f64::INFINITY;
        let lost = || {
            Error::no_convergence(
                "no equilibrium with these touches was found at the place of the end",
            )
        };
        for _ in 0..STEPS_TO_CENTRE {
            let shape = self.shape(&x).ok_or_else(lost)?;
            let equations = self.equations(&shape);
            let rows = equations.value.len();
            let mut value = equations.value.resize_vertically(rows + 2, 0.0);
            value.rows_mut(rows, 2).copy_from(&(shape.end().r - pose));
            let mut by = equations.by.resize_vertically(rows + 2, 0.0);
            by.rows_mut(rows, 2).copy_from(&equations.place_by);
            let (residual, by) = normalised(value, &by, &self.scale);
            let error = residual.norm();
            if error < ROUNDING && error >= 0.5 * last {
                return Ok(x);
            }
            last = error;
            let svd = by.svd(true, true);
            let least = LOST_RANK * svd.singular_values.max();
            let step = svd.solve(&residual, least).map_err(|_| lost())?;
            x -= step.component_mul(&self.scale);
        }
        if last < POOR { Ok(x) } else { Err(lost()) }
    }

    fn kernel_at_centre(&self) -> Result<DMatrix<f64>> {
        let lost = || Error::no_convergence("the kernel of the touches was not found");
        let shape = self.shape(&self.centre).ok_or_else(lost)?;
        let (_, by) = self.equations(&shape).normalised(&self.scale);
        let size = by.ncols();
        // Two rows of zeros make the matrix square: their right singular vectors are the kernel.
        let svd = by.resize_vertically(size, 0.0).svd(false, true);
        let turned = svd.v_t.ok_or_else(lost)?;
        Ok(turned.rows(size - 2, 2).transpose())
    }

    /// Second derivatives at the centre, by differences of the first: they are for first guesses alone.
    fn second_at_centre(&self) -> Option<[DVector<f64>; 3]> {
        let scaled = |q: Vector2<f64>| -> Option<DMatrix<f64>> {
            let mut by = self.there(&q)?.by_chart;
            for (mut row, scale) in by.row_iter_mut().zip(self.scale.iter()) {
                row /= *scale;
            }
            Some(by)
        };
        let along = |axis: usize| -> Option<DMatrix<f64>> {
            let step = Vector2::ith(axis, SECOND);
            Some((scaled(step)? - scaled(-step)?) / (2.0 * SECOND))
        };
        let [first, second] = [along(0)?, along(1)?];
        let columns = [first.column(0), first.column(1), second.column(1)];
        Some(columns.map(|column| column.into_owned()))
    }

    /// The equilibrium at `q`; None outside the chart.
    ///
    /// Taut rods amplify a change of the base wrench exponentially along their length, and Newton's method is sure only
    /// close to a solution: Newton's steps must contract from the first, and the chart ends where they do not.
    fn there(&self, q: &Vector2<f64>) -> Option<There> {
        if !(q.norm() <= EDGE) {
            return None;
        }
        let along = self.kernel.transpose();
        let [a, b, c] = &self.second;
        let mut y: DVector<f64> =
            &self.kernel * q + a * (0.5 * q.x * q.x) + b * (q.x * q.y) + c * (0.5 * q.y * q.y);
        let (mut sure, mut longest) = (false, FIRST_STEP);
        for _ in 0..STEPS {
            let x = &self.centre + y.component_mul(&self.scale);
            let shape = self.shape(&x)?;
            let equations = self.equations(&shape);
            let (value, by) = equations.normalised(&self.scale);
            let (size, rows) = (y.len(), value.len());
            let mut matrix = by.resize_vertically(size, 0.0);
            matrix.rows_mut(rows, 2).copy_from(&along);
            let mut residual = value.resize_vertically(size, 0.0);
            residual.rows_mut(rows, 2).copy_from(&(&along * &y - q));
            let lu = matrix.lu();
            let step = lu.solve(&residual)?;
            let length = step.norm();
            if sure || length <= NO_STEP {
                let mut given = DMatrix::zeros(size, 2);
                given[(rows, 0)] = 1.0;
                given[(rows + 1, 1)] = 1.0;
                let by_chart = DMatrix::from_diagonal(&self.scale) * lu.solve(&given)?;
                return Some(There {
                    x,
                    shape,
                    place_by: equations.place_by,
                    by_chart,
                });
            }
            if !(length <= longest) {
                return None;
            }
            (sure, longest) = (length <= SQUARED, CONTRACTION * length);
            y -= step;
        }
        None
    }

    /// True if a motion at `q` should go on in a chart about another centre.
    pub fn is_left(&self, q: &Vector2<f64>) -> bool {
        let far = q.norm();
        !(far <= MIDDLE * EDGE) || far > NEAR && self.there(&(q * AHEAD)).is_none()
    }

    /// The base wrench and the touches at `q`, as a guess; None outside the chart.
    pub fn guess(&self, q: &Vector2<f64>) -> Option<ContactGuess> {
        let x = self.there(q)?.x;
        let couple = self.among.problem.rod().clamp.rotation * Vector3::x() * x[0];
        let touches = self.surfaces.iter().enumerate();
        Some(ContactGuess {
            base: join(&couple, &self.among.world(&Vector2::new(x[1], x[2]))),
            touches: touches
                .map(|(i, surface)| GuessedTouch {
                    surface: *surface,
                    s: Some(x[WRENCH + 1 + 2 * i]),
                    reaction: x[WRENCH + 2 * i],
                    length: 0.0,
                })
                .collect(),
        })
    }

    /// The rates of the reactions of all touches while the end moves with the velocity `v`, in the order of the guess;
    /// None outside the chart, and on a fold.
    pub fn reaction_rates(&self, q: &Vector2<f64>, v: &Vector2<f64>) -> Option<Vec<f64>> {
        let there = self.there(q)?;
        let rate = there.point()?.jacobian.lu().solve(v)?;
        let all = &there.by_chart * rate;
        Some(
            (0..self.surfaces.len())
                .map(|i| all[WRENCH + 2 * i])
                .collect(),
        )
    }

    /// The touches at `q` in the world, in the order of their guess; None outside the chart.
    pub fn touches(&self, q: &Vector2<f64>) -> Option<Vec<TouchPoint>> {
        let shape = self.there(q)?.shape;
        let origin = self.among.problem.rod().clamp.translation.vector;
        let each = shape.touches.iter().zip(&self.surfaces);
        Some(
            each.map(|(touch, surface)| TouchPoint {
                surface: *surface,
                s: touch.s,
                at_end: false,
                reaction: touch.reaction,
                line: None,
                position: origin + self.among.world(&touch.at.r),
                normal: self.among.world(&touch.gap.normal),
                relative_curvature: touch.gap.curvature(&touch.at),
                feature: touch.gap.feature,
            })
            .collect(),
        )
    }

    /// The bounds of the sheet with the room up to each at `q`; None outside the chart.
    pub fn rooms(&self, q: &Vector2<f64>) -> Option<Vec<Room>> {
        let shape = self.there(q)?.shape;
        let mut rooms = Vec::new();
        for (touch, surface) in shape.touches.iter().zip(&self.surfaces) {
            let room = |bound: Bound, left: f64| Room {
                bound,
                surface: *surface,
                s: touch.s,
                left,
            };
            rooms.push(room(Bound::Release, touch.reaction));
            rooms.push(room(Bound::Line, touch.gap.curvature(&touch.at)));
            rooms.push(room(Bound::End, touch.s.min(1.0 - touch.s) - SAME_TOUCH));
        }
        for surface in 0..self.among.problem.surfaces.len() {
            for (s, left) in self.lows(&shape, surface).ok()? {
                let own = shape.touches.iter().zip(&self.surfaces);
                let mut own = own.filter(|(_, other)| **other == surface);
                if !own.any(|(touch, _)| (touch.s - s).abs() < SAME_TOUCH) {
                    rooms.push(Room {
                        bound: Bound::Touch,
                        surface,
                        s,
                        left,
                    });
                }
            }
        }
        Some(rooms)
    }

    /// Places between the ends where the rod is closest to a surface, with the gaps there.
    fn lows(&self, shape: &TouchedShape, surface: usize) -> Result<Vec<(f64, f64)>> {
        let probe = |s: f64| -> Result<Probe> {
            let (at, _) = shape.section(s);
            let gap = self.among.gap(surface, &at.r);
            Ok(Probe {
                s,
                r: lifted(&at.r),
                normal: lifted(&gap.normal),
                gap: gap.value,
                slope: gap.slope(&at),
                curvature: gap.curvature(&at),
                bend: at.curvature.abs() + gap.hessian.norm(),
            })
        };
        let mut lows = Vec::new();
        let mut before = probe(0.0)?;
        for (from, piece) in &shape.pieces {
            for end in piece.ends() {
                let after = probe(from + end)?;
                minima(&before, &after, &probe, &mut |low: Probe| {
                    if low.s > AT_END && low.s < 1.0 - AT_END {
                        lows.push((low.s, low.gap));
                    }
                })?;
                before = after;
            }
        }
        Ok(lows)
    }

    /// Sections of the rod at places s in [0, 1], seen from the clamp. None outside the chart.
    pub fn sections(&self, q: &Vector2<f64>, at: &[f64]) -> Option<Vec<SheetSection>> {
        let shape = self.there(q)?.shape;
        let section = |s: &f64| {
            let (at, force) = shape.section(*s);
            SheetSection {
                shape: PlanarSection {
                    s: *s,
                    theta: at.theta,
                    curvature: at.curvature,
                    x: at.r.x,
                    y: at.r.y,
                },
                force,
            }
        };
        Some(at.iter().map(section).collect())
    }
}

impl There {
    fn point(&self) -> Option<ManifoldPoint<2>> {
        let by = &self.place_by * &self.by_chart;
        let jacobian = Matrix2::from_fn(|i, j| by[(i, j)]);
        let energies = self.shape.pieces.iter().map(|(_, piece)| piece.energy());
        let point = ManifoldPoint {
            pose: self.shape.end().r,
            force: -self.shape.end_force(),
            energy: energies.sum(),
            jacobian,
            pace: PACE * jacobian.norm_squared(),
        };
        let all = point.pose.iter().chain(&point.force).chain(&jacobian);
        all.copied().all(f64::is_finite).then_some(point)
    }
}

impl EquilibriumManifold<2> for TouchedSheet {
    fn point(&self, q: &Vector2<f64>) -> Option<ManifoldPoint<2>> {
        self.there(q)?.point()
    }

    fn index(&self, q: &Vector2<f64>) -> Result<usize> {
        if let Some(known) = self.index {
            return Ok(known);
        }
        let There { x, shape, .. } = self.there(q).ok_or_else(outside)?;
        let touches = shape.touches.iter().zip(&self.surfaces);
        let force = lifted(&Vector2::new(x[1], x[2]));
        let at = Touching {
            b: join(&(Vector3::x() * x[0]), &force),
            touches: touches
                .map(|(touch, surface)| ScaledTouch {
                    surface: *surface,
                    s: touch.s,
                    at_end: false,
                    reaction: touch.reaction,
                    line: None,
                })
                .collect(),
        };
        Ok(self.among.problem.index_of(&at)?.held)
    }
}

impl Multivalued<2> for TouchedSheet {
    /// The changes of the couple's sign between the ends, and its sign at the clamp.
    fn sheet(&self, q: &Vector2<f64>) -> Sheet {
        let places: Vec<f64> = (0..LOOKS).map(|k| k as f64 / LOOKS as f64).collect();
        let sections = self.sections(q, &places).unwrap_or_default();
        let couples: Vec<f64> = sections.iter().map(|at| at.shape.curvature).collect();
        let changes = couples.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
        Sheet {
            mode: u32::try_from(changes.count()).unwrap_or(u32::MAX),
            sign: Sign::of(couples.first().copied().unwrap_or(0.0)),
        }
    }

    fn stable_at(&self, _pose: &Vector2<f64>) -> Result<Vec<Vector2<f64>>> {
        Err(no_snap())
    }

    fn settle(&self, _q: &Vector2<f64>, _leaving: &Vector2<f64>) -> Result<Vector2<f64>> {
        Err(no_snap())
    }
}

fn outside() -> Error {
    Error::domain("the point lies outside the chart of a rod with touches")
}

fn no_snap() -> Error {
    Error::unreachable(
        "the rod passes a fold while it touches an obstacle, and would snap; such snaps are not followed",
    )
}
