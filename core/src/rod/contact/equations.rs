//! Equations of a rod with given touches, and their derivatives.

use super::super::ivp::Wrench;
use super::super::planar::Plane;
use super::super::problem::{EndVariation, Trial};
use super::closest_points::TouchedSteps;
use super::touched_rod::{TouchedRod, TouchedSection, first_columns};
use super::{ContactProblem, Line, ScaledTouch};
use crate::error::{Error, Result};
use crate::obstacle::Gap;
use crate::solve::newton;
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3, Vector6};

/// Steps near an equilibrium that is neutral, and the singular values that count as zero, over the largest.
const NEUTRAL_STEPS: usize = 12;
const LOST_RANK: f64 = 1e-8;
/// Least length, below zero, of a line that shrinks to a point.
const SHRINKING: f64 = 0.02;
/// Cosine between directions that are equal.
const PARALLEL: f64 = 1.0 - 1e-9;

/// A rod with given touches, at trial unknowns.
#[derive(Debug, Clone)]
pub(super) struct Touching {
    /// Base wrench in the clamp's frame and the units of the rod.
    pub(super) b: Wrench,
    pub(super) touches: Vec<ScaledTouch>,
}

/// Equations and derivatives at [`Touching`].
pub(super) struct Balanced {
    pub(super) residual: DVector<f64>,
    pub(super) jacobian: DMatrix<f64>,
}

/// Sections at the touches with the gaps there, and the end beyond a touch.
pub(super) struct Stations {
    pub(super) at: Vec<(TouchedSection, Gap)>,
    pub(super) end: TouchedSection,
}

impl ContactProblem {
    /// Unknowns of the base wrench by columns, and equations of the end condition by rows: all in space, three in a
    /// plane.
    fn chart(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let Some(plane) = &self.plane else {
            return (DMatrix::identity(6, 6), DMatrix::identity(6, 6));
        };
        let mut columns = DMatrix::zeros(6, 3);
        let mut rows = DMatrix::zeros(3, 6);
        for k in 0..3 {
            let unit = nalgebra::Vector3::ith(k, 1.0);
            columns.set_column(k, &plane.wrench(&unit));
        }
        let normal = plane.normal();
        for (k, (direction, _, _)) in plane.conditions(&self.problem).into_iter().enumerate() {
            let direction = plane.lift(direction);
            for i in 0..3 {
                rows[(0, i)] = normal[i];
                rows[(1 + k, 3 + i)] = self.problem.axes[i].dot(&direction);
            }
        }
        (columns, rows)
    }

    /// The number of unknowns of the base wrench.
    pub(super) fn wrench_unknowns(&self) -> usize {
        if self.plane.is_some() { 3 } else { 6 }
    }

    /// The unknowns: those of the base wrench, then reaction and place of each touch.
    pub(super) fn unknowns(&self, at: &Touching) -> DVector<f64> {
        let (columns, _) = self.chart();
        let wrench = columns.tr_mul(&at.b);
        let touches = at.touches.iter().flat_map(|touch| {
            let length = touch.line.map_or(0.0, |line| line.length);
            let values = [touch.reaction, touch.s, length];
            let has = touch.has();
            (0..3).filter(move |i| has[*i]).map(move |i| values[i])
        });
        let all: Vec<f64> = wrench.iter().copied().chain(touches).collect();
        DVector::from_vec(all)
    }

    /// The rod at the unknowns `x`, with touches of the kind of `kind`.
    ///
    /// # Errors
    /// A place beyond the rod.
    pub(super) fn touching(&self, x: &DVector<f64>, kind: &[ScaledTouch]) -> Result<Touching> {
        let (columns, _) = self.chart();
        let count = columns.ncols();
        let b: DVector<f64> = &columns * x.rows(0, count);
        let mut rest = x.iter().skip(count).copied();
        let mut touches = Vec::with_capacity(kind.len());
        for touch in kind {
            let mut next = |has: bool, other: f64| {
                if has {
                    rest.next().unwrap_or(f64::NAN)
                } else {
                    other
                }
            };
            let [reacts, slides, grows] = touch.has();
            let reaction = next(reacts, touch.reaction);
            let s = next(slides, touch.s);
            let line = touch.line.map(|line| Line {
                length: next(grows, line.length),
                ..line
            });
            let moved = ScaledTouch {
                reaction,
                s,
                line,
                ..*touch
            };
            let to = moved.to();
            let holds = !slides || s > 0.0 && s < 1.0;
            if !(holds && (!grows || to > s - SHRINKING && to < 1.0)) {
                return Err(Error::no_convergence(format!(
                    "a touch of obstacle {} has left the rod: s/L = {s:.6} to {to:.6}",
                    touch.surface + 1
                )));
            }
            touches.push(moved);
        }
        Ok(Touching {
            b: Vector6::from_column_slice(b.as_slice()),
            touches,
        })
    }

    /// The equations and their derivatives by the unknowns.
    ///
    /// # Errors
    /// A wrench that the rod cannot follow.
    pub(super) fn balanced(&self, at: &Touching) -> Result<Balanced> {
        let normal = self.plane.as_ref().map(Plane::normal);
        let gap = |k: usize, r: &Vector3<f64>| self.gap(k, r);
        let rod: TouchedRod = (self.loaded()).touched(&at.b, &at.touches, normal.as_ref(), gap)?;
        let (columns, _) = self.chart();
        let end = &rod.end;
        let rows = self.end_rows(&at.touches, end)?;
        let trial = Trial::bare(end.r, end.rotation, end.m, end.n);
        let value = self.problem.residual(&trial);
        let varied = &rod.varied;
        let all = varied.phi.ncols();
        // m(1) = m_c - r x n(1).
        let d_m: Matrix3xX<f64> =
            &varied.dm + end.n.cross_matrix() * &varied.rho - end.r.cross_matrix() * &varied.dn;
        let mut by_all = DMatrix::zeros(6, all);
        for j in 0..all {
            let by = EndVariation::<1> {
                phi: varied.phi.column(j).into_owned(),
                r: varied.rho.column(j).into_owned(),
                m: d_m.column(j).into_owned(),
                n: varied.dn.column(j).into_owned(),
            };
            by_all.set_column(j, &self.problem.equations_by(&trial, &value, &by));
        }
        let count = columns.ncols();
        let size = count + all - 6;
        let in_chart = |row: &DMatrix<f64>| {
            let mut found = DMatrix::zeros(row.nrows(), size);
            found
                .columns_mut(0, count)
                .copy_from(&(row.columns(0, 6) * &columns));
            found
                .columns_mut(count, all - 6)
                .copy_from(&row.columns(6, all - 6));
            found
        };
        let mut jacobian = DMatrix::zeros(size, size);
        let mut row = rows.nrows();
        jacobian
            .rows_mut(0, row)
            .copy_from(&in_chart(&(&rows * by_all)));
        let mut sections = Vec::with_capacity(at.touches.len());
        let places = first_columns(&at.touches);
        for ((touch, (section, varied)), column) in at.touches.iter().zip(&rod.touches).zip(places)
        {
            let gap = self.gap(touch.surface, &section.r);
            let tangent = section.tangent();
            let mut moved = varied.rho.clone();
            // dd3 = phi x d3 + u x d3 ds.
            let mut turned = -tangent.cross_matrix() * &varied.phi;
            let mut couple: Matrix3xX<f64> = &varied.dm + section.n.cross_matrix() * &varied.rho
                - section.r.cross_matrix() * &varied.dn;
            if let [_, Some(place), _] = touch.columns(column) {
                let slides = |by: &mut Matrix3xX<f64>, slope: Vector3<f64>| {
                    let moved = by.column(place) + slope;
                    by.set_column(place, &moved);
                };
                slides(&mut moved, section.along());
                slides(&mut turned, section.turn.cross(&tangent));
                slides(&mut couple, section.n.cross(&section.along()));
            }
            let across = normal.unwrap_or_default().transpose();
            let rows = [
                gap.normal.transpose() * &moved,
                (gap.hessian * tangent).transpose() * &moved + gap.normal.transpose() * &turned,
                across * &couple,
                gap.normal.transpose() * &varied.dn,
            ];
            for number in Self::rows_of(touch) {
                let by = DMatrix::from_fn(1, all, |_, j| rows[*number][j]);
                jacobian.row_mut(row).copy_from(&in_chart(&by).row(0));
                row += 1;
            }
            sections.push((*section, gap));
        }
        let stations = Stations {
            at: sections,
            end: *end,
        };
        Ok(Balanced {
            residual: self.residual(&at.touches, &stations)?,
            jacobian,
        })
    }

    /// The equations of a touch: gap (0) and slope (1), or the couple of the surface's curvature (2), and the force
    /// across the rod (3) at a clamp.
    fn rows_of(touch: &ScaledTouch) -> &'static [usize] {
        match touch.line {
            None if touch.at_end => &[0],
            None => &[0, 1],
            Some(line) if line.from_clamp => &[2, 3],
            Some(_) => &[0, 1, 2],
        }
    }

    /// The equations of the end condition by rows. A rod that lies on a surface up to its end meets those across the
    /// surface by itself; that along the rod remains.
    ///
    /// # Errors
    /// An end that is held in one direction, oblique to the surface.
    fn end_rows(&self, touches: &[ScaledTouch], end: &TouchedSection) -> Result<DMatrix<f64>> {
        let (_, rows) = self.chart();
        let Some(plane) = self
            .plane
            .as_ref()
            .filter(|_| touches.iter().any(ScaledTouch::goes_on_to_end))
        else {
            return Ok(rows);
        };
        let tangent = end.tangent();
        let conditions = plane.conditions(&self.problem);
        let alike = conditions[0].2 == conditions[1].2;
        let mut along = DMatrix::zeros(1, 6);
        for (k, (direction, _, _)) in conditions.iter().enumerate() {
            let part = plane.lift(*direction).dot(&tangent);
            if alike || part.abs() > PARALLEL {
                along += rows.row(1 + k) * part;
            } else if part.abs() > 1.0 - PARALLEL {
                return Err(Error::unreachable(
                    "line contact: the rod lies along an obstacle up to its end, which is held in one direction oblique to the obstacle",
                ));
            }
        }
        Ok(along)
    }

    /// Sections at the touches and at the end of a shape.
    ///
    /// # Errors
    /// A section that cannot be computed.
    pub(super) fn stations(&self, at: &Touching, shape: &TouchedSteps<'_>) -> Result<Stations> {
        let mut end = shape.section(1.0)?;
        let mut found = Vec::with_capacity(at.touches.len());
        for touch in &at.touches {
            // The shape lies on the surface from the clamp on; the base wrench is that before.
            let section = match touch.line {
                Some(line) if line.from_clamp => self.loaded().clamp(&at.b)?,
                _ => shape.section(touch.s)?,
            };
            let gap = self.gap(touch.surface, &section.r);
            if touch.at_end {
                end.n -= gap.normal * touch.reaction;
            }
            found.push((section, gap));
        }
        Ok(Stations { at: found, end })
    }

    /// The equations: end condition, then those of each touch.
    ///
    /// # Errors
    /// An end that is held in one direction, oblique to a surface on which it lies; a rod that cannot lie there.
    pub(super) fn residual(
        &self,
        touches: &[ScaledTouch],
        stations: &Stations,
    ) -> Result<DVector<f64>> {
        let Stations { at, end } = stations;
        let rows = self.end_rows(touches, end)?;
        let trial = Trial::bare(end.r, end.rotation, end.m, end.n);
        let value = self.problem.residual(&trial);
        let mut all: Vec<f64> = (rows * DVector::from_column_slice(value.as_slice()))
            .as_slice()
            .to_vec();
        let normal = self.plane.as_ref().map(Plane::normal);
        for (touch, (section, gap)) in touches.iter().zip(at) {
            let couple = match (touch.line, normal) {
                (Some(_), Some(normal)) => {
                    let lying = self.loaded().lying(
                        touch,
                        (section, 0.0),
                        |k, r| self.gap(k, r),
                        Some(&normal),
                    )?;
                    normal.dot(&(section.m - lying.start.m))
                }
                _ => 0.0,
            };
            let values = [
                gap.value,
                gap.normal.dot(&section.tangent()),
                couple,
                gap.normal.dot(&section.n),
            ];
            all.extend(Self::rows_of(touch).iter().map(|number| values[*number]));
        }
        Ok(DVector::from_vec(all))
    }

    /// Newton's method for given touches from a guess.
    ///
    /// # Errors
    /// No convergence.
    pub(super) fn polish(&self, guess: &Touching) -> Result<Touching> {
        let kind = &guess.touches;
        let options = newton::Options {
            tolerance: self.problem.correction(),
            max_iterations: 40,
            ..newton::Options::default()
        };
        let system = |x: &DVector<f64>| {
            let found = self.balanced(&self.touching(x, kind)?)?;
            Ok((found.residual, found.jacobian))
        };
        match newton::solve(system, &self.unknowns(guess), &options) {
            Ok(solved) => self.touching(&solved.x, kind),
            Err(_) => self.neutral(guess).ok_or_else(|| {
                let places = guess.touches.iter().map(|touch| {
                    let s = touch.s * self.rod().length;
                    format!("obstacle {} at s = {s:.6}", touch.surface + 1)
                });
                let places: Vec<String> = places.collect();
                let with = match &places[..] {
                    [] => "no touch".to_owned(),
                    places => format!("touches of {}", places.join(", ")),
                };
                Error::no_convergence(format!(
                    "no equilibrium was found with {with}: near a fold, or where a touch comes to the held end of the rod, there is none; \
                     give a guess, or follow a branch"
                ))
            }),
        }
    }

    /// The equilibrium near a guess where the equations lose rank, as of a rod that may turn freely: steps of least
    /// length.
    fn neutral(&self, guess: &Touching) -> Option<Touching> {
        let mut x = self.unknowns(guess);
        for _ in 0..NEUTRAL_STEPS {
            let at = self.touching(&x, &guess.touches).ok()?;
            let Balanced { residual, jacobian } = self.balanced(&at).ok()?;
            if residual.norm() < self.problem.correction() * (1.0 + x.norm()) {
                return Some(at);
            }
            let svd = jacobian.svd(true, true);
            let zero = LOST_RANK * svd.singular_values.max();
            x -= svd.solve(&residual, zero).ok()?;
        }
        None
    }
}
