//! Morse index of a rod with touches: the second variation of L = U - sum R_i G_i on {delta G_i = 0 : R_i > 0}.
//!
//! The rod is cut into stretches too short to buckle alone. A stretch maps (y, f) at its start to its end, with y =
//! (phi, rho) and f = (dm + m x phi/2, dn). The map is symplectic: y_b = B y_a + A f_a, f_b = D y_a + C f_a.
//! With the end's f as a multiplier its second variation is
//!
//! ```text
//! lambda.y_b - lambda.F lambda/2 - lambda.C^-T y_a + y_a.(C^-1 D) y_a/2,   F = A C^-1 >= 0.
//! ```
//!
//! Every multiplier makes one negative eigenvalue of the whole matrix, also where F is singular (a straight rod that
//! does not stretch). The index is the number of negative eigenvalues less that of multipliers. A touch adds
//!
//! ```text
//! -R [eta.H eta - (r'.H eta + nu.(phi x r'))^2/h''],
//! ```
//!
//! the second term because the touching point slides (theory 3.7; none at the end of the rod), and delta G = 0
//! as one more multiplier. A force on an arm of a free end adds -S as in `super::index`.

use super::equations::{Stations, Touching};
use super::touched_rod::{
    COLUMNS, LoadedRod, Onward, Piece, SAME_PLACE, Stretch, TouchedSection, Transfer,
};
use super::{ContactProblem, ScaledTouch};
use crate::error::{Error, Result};
use crate::math::se3::join;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};

/// Reactions below this size, over 1 + |b|, are zero: the touch may be left.
const NO_REACTION: f64 = 1e-8;
/// Eigenvalues within this size are those of neutral modes. Multipliers and rotations are of size 1.
const NEUTRAL: f64 = 1e-7;
/// Length of a stretch over 1/sqrt(C |n|) and 1/|C m|: a cantilever buckles at pi/2.
const SHORT: f64 = 1.0;
/// Tolerance of the integration: an index is a count, and noise must stay below [`NEUTRAL`].
const TOLERANCE: f64 = 1e-10;
/// Most stretches of a rod.
const MOST: usize = 400;

/// The index with touches held, and with those of no reaction set free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Index {
    pub(super) held: usize,
    pub(super) released: usize,
    pub(super) neutral: usize,
}

/// The second variation of one stretch, by (lambda, y_a, y_b).
struct StretchVariation {
    /// F.
    compliance: Matrix6<f64>,
    /// C^-T.
    carried: Matrix6<f64>,
    /// C^-1 D.
    own: Matrix6<f64>,
}

/// Terms of the second variation of a touch; each can be left out by tests that show what it does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    /// -R eta.H eta.
    pub(super) surface: bool,
    /// R (dh')^2/h''.
    pub(super) sliding: bool,
}

impl Terms {
    pub(super) const ALL: Self = Self {
        surface: true,
        sliding: true,
    };
}

fn symmetric(matrix: &Matrix6<f64>) -> Matrix6<f64> {
    0.5 * (matrix + matrix.transpose())
}

/// [x] in the upper left block.
fn spin(x: &Vector3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&x.cross_matrix());
    matrix
}

impl StretchVariation {
    /// From a stretch, with the couple m_b and the force at its end.
    fn new(stretch: &Stretch<COLUMNS>, end: &TouchedSection) -> Option<Self> {
        let transfer = Transfer::from(stretch);
        let start = &stretch.start;
        // Columns by (dm, dn) at the start and by its turn: dm_c = dm + r_a x dn.
        let of = |row: usize, column: usize| {
            transfer
                .tangent
                .fixed_view::<3, 3>(row, column)
                .into_owned()
        };
        let lever = start.r.cross_matrix();
        let mut a = Matrix6::zeros();
        let mut b = Matrix6::identity();
        for row in [0, 3] {
            a.fixed_view_mut::<3, 3>(row, 0).copy_from(&of(row, 0));
            a.fixed_view_mut::<3, 3>(row, 3)
                .copy_from(&(of(row, 3) + of(row, 0) * lever));
            b.fixed_view_mut::<3, 3>(row, 0).copy_from(&of(row, 6));
        }
        // m_b = m_c - w - r_b x n_b: dm_b = dm + r_a x dn + rho_a x n_a - dw + n_b x rho_b - r_b x dn. A displacement
        // rho_a of the whole stretch changes no couple.
        let dw = |column: usize| transfer.dw.fixed_view::<3, 3>(0, column).into_owned();
        let n_b = end.n.cross_matrix();
        let mut c = Matrix6::identity();
        let mut d = Matrix6::zeros();
        let block = |matrix: &Matrix6<f64>, column: usize| {
            matrix.fixed_view::<3, 3>(3, column).into_owned()
        };
        c.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(Matrix3::identity() - dw(0) + n_b * block(&a, 0)));
        c.fixed_view_mut::<3, 3>(0, 3).copy_from(
            &(lever - end.r.cross_matrix() - dw(3) - dw(0) * lever + n_b * block(&a, 3)),
        );
        d.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(-dw(6) + n_b * block(&b, 0)));
        // Couples with m x phi/2, at both ends.
        let (m_a, m_b) = (spin(&(0.5 * start.m)), spin(&(0.5 * end.m)));
        let b = b - a * m_a;
        let d = d - c * m_a + m_b * b;
        let c = c + m_b * a;
        let inverse = c.try_inverse()?;
        Some(Self {
            compliance: symmetric(&(a * inverse)),
            carried: inverse.transpose(),
            own: symmetric(&(inverse * d)),
        })
    }
}

impl ContactProblem {
    pub(super) fn index_of(&self, at: &Touching) -> Result<Index> {
        self.index_with(at, Terms::ALL)
    }

    /// The index with some terms of the touches.
    pub(super) fn index_with(&self, at: &Touching, terms: Terms) -> Result<Index> {
        let size = 1.0 + at.b.norm();
        let held = |touch: &ScaledTouch| touch.reaction > NO_REACTION * size;
        let (index, neutral) = self.count(at, terms, |_| true)?;
        let released = if at.touches.iter().all(held) {
            index
        } else {
            self.count(at, terms, held)?.0
        };
        Ok(Index {
            held: index,
            released,
            neutral,
        })
    }

    /// Negative eigenvalues less multipliers, and neutral modes, with the touches that are `held`.
    fn count(
        &self,
        at: &Touching,
        terms: Terms,
        held: impl Fn(&ScaledTouch) -> bool,
    ) -> Result<(usize, usize)> {
        let stations = self.stations(at, &self.shape_of(&at.b, &at.touches)?)?;
        let stops = self.stops(at, &stations)?;
        let mut touches = at.touches.clone();
        touches.sort_by(|a, b| a.s.total_cmp(&b.s));
        // The node of each touch: the first stop at its place.
        let mut stretches = Vec::new();
        let mut ends = Vec::new();
        let mut sections = Vec::new();
        let mut next = 0;
        let rod = LoadedRod {
            tolerance: TOLERANCE,
            ..self.loaded()
        };
        rod.walk::<COLUMNS>(
            &at.b,
            &stops,
            |piece| {
                if let Piece::Free(stretch) = piece {
                    stretches.push(*stretch);
                }
            },
            |k, here, _| {
                ends.push(*here);
                let mut force = Vector3::zeros();
                while let Some(touch) = touches.get(next)
                    && touch.s <= stops[k] + SAME_PLACE
                {
                    let gap = self.gap(touch.surface, &here.r);
                    sections.push((k, *touch, *here, gap));
                    force += gap.normal * touch.reaction;
                    next += 1;
                }
                Ok(Onward::Free(force))
            },
        )?;
        let basis = self.basis();
        let width = basis.ncols();
        let end_basis = self.end_basis(&basis);
        let count = stops.len();
        let constraints: Vec<usize> = (0..sections.len())
            .filter(|i| held(&sections[*i].1))
            .collect();
        // Unknowns: for each stretch lambda, then the y of its end; then the multipliers of the touches.
        let step = 2 * width;
        let last = end_basis.ncols();
        let whole = step * (count - 1) + width + last + constraints.len();
        let mut matrix = DMatrix::zeros(whole, whole);
        let node = |k: usize| {
            let basis = if k + 1 == count { &end_basis } else { &basis };
            (step * k + width, basis)
        };
        let undefined = || Error::no_convergence("the second variation of the rod is undefined");
        for (k, (stretch, end)) in stretches.iter().zip(&ends).enumerate() {
            let part = StretchVariation::new(stretch, end).ok_or_else(undefined)?;
            let lambda = step * k;
            add(
                &mut matrix,
                lambda,
                &basis,
                lambda,
                &basis,
                &-part.compliance,
            );
            let (place, there) = node(k);
            add(
                &mut matrix,
                lambda,
                &basis,
                place,
                there,
                &Matrix6::identity(),
            );
            add(
                &mut matrix,
                place,
                there,
                lambda,
                &basis,
                &Matrix6::identity(),
            );
            if k > 0 {
                let (before, here) = node(k - 1);
                let carried = -part.carried;
                add(&mut matrix, lambda, &basis, before, here, &carried);
                add(
                    &mut matrix,
                    before,
                    here,
                    lambda,
                    &basis,
                    &carried.transpose(),
                );
                add(&mut matrix, before, here, before, here, &part.own);
            }
        }
        for (k, touch, section, gap) in &sections {
            let (place, basis) = node(*k);
            let mut own = Matrix6::zeros();
            if terms.surface {
                own.fixed_view_mut::<3, 3>(3, 3)
                    .copy_from(&(-touch.reaction * gap.hessian));
            }
            let curvature = section.relative_curvature(gap);
            if terms.sliding && !touch.at_end && touch.reaction > 0.0 {
                let along = section.along();
                let slides = join(&along.cross(&gap.normal), &(gap.hessian * along));
                own += slides * slides.transpose() * (touch.reaction / curvature);
            }
            add(&mut matrix, place, basis, place, basis, &own);
        }
        for (j, i) in constraints.iter().enumerate() {
            let (k, _, _, gap) = &sections[*i];
            let (place, basis) = node(*k);
            let row = whole - constraints.len() + j;
            let normal = join(&Vector3::zeros(), &gap.normal);
            for (c, column) in basis.column_iter().enumerate() {
                let entry: f64 = column.iter().zip(normal.iter()).map(|(a, b)| a * b).sum();
                matrix[(row, place + c)] = entry;
                matrix[(place + c, row)] = entry;
            }
        }
        if self.problem.orientation.is_none() {
            let (place, basis) = node(count - 1);
            let n = stations.end.n.cross_matrix();
            let arm = self.problem.lever(&stations.end.rotation).cross_matrix();
            let mut own = Matrix6::zeros();
            own.fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&(-0.5 * (n * arm + arm * n)));
            add(&mut matrix, place, basis, place, basis, &own);
        }
        let values = matrix.symmetric_eigenvalues();
        let negative = values.iter().filter(|value| **value < -NEUTRAL).count();
        let neutral = values.iter().filter(|value| value.abs() <= NEUTRAL).count();
        let multipliers = width * count + constraints.len();
        // A neutral eigenvalue may be that of a multiplier without effect: a touch of a straight rod that is held.
        let index = negative.checked_sub(multipliers);
        let index = index.or((negative + neutral >= multipliers).then_some(0));
        Ok((index.ok_or_else(undefined)?, neutral))
    }

    /// Ends of the stretches: the touches, the end, and places between.
    fn stops(&self, at: &Touching, stations: &Stations) -> Result<Vec<f64>> {
        let [a, b] = self.rod().law.flexures();
        let soft = a.max(b);
        let sections = stations.at.iter().map(|(section, _)| section);
        let mut force = at.b.fixed_rows::<3>(3).norm();
        let mut turn = super::super::ivp::rate(&self.rod().law, &at.b)?;
        for section in sections.chain([&stations.end]) {
            force = force.max(section.n.norm());
            turn = turn.max(section.turn.norm());
        }
        // Between touches the couple grows by |n| at most.
        let rate = turn.max((soft * force).sqrt());
        let count = ((rate / SHORT).ceil().max(4.0) as usize).min(MOST);
        let mut stops: Vec<f64> = (1..=count).map(|k| k as f64 / count as f64).collect();
        stops.extend(at.touches.iter().map(|touch| touch.s));
        stops.sort_by(f64::total_cmp);
        // Stretches far shorter than the others are joined to them, but for the touches.
        let apart = 0.2 / count as f64;
        let is_touch = |s: f64| at.touches.iter().any(|touch| touch.s == s) || s == 1.0;
        let kept = stops.clone();
        stops.retain(|s| {
            is_touch(*s)
                || kept
                    .iter()
                    .all(|other| !is_touch(*other) || (other - s).abs() > apart)
        });
        stops.dedup_by(|b, a| *b - *a <= SAME_PLACE);
        Ok(stops)
    }

    /// Variations (phi, rho) of a section, or resultants, by columns: all in space, three in a plane.
    fn basis(&self) -> DMatrix<f64> {
        let Some(plane) = &self.plane else {
            return DMatrix::identity(6, 6);
        };
        let flat = |x: f64, y: f64| {
            let place = plane.lift(nalgebra::Vector2::new(x, y));
            join(&Vector3::zeros(), &place)
        };
        let turn = join(&plane.normal(), &Vector3::zeros());
        let columns: [Vector6<f64>; 3] = [turn, flat(1.0, 0.0), flat(0.0, 1.0)];
        DMatrix::from_fn(6, 3, |i, j| columns[j][i])
    }

    /// The columns of the basis that the end condition leaves free.
    fn end_basis(&self, basis: &DMatrix<f64>) -> DMatrix<f64> {
        let problem = &self.problem;
        let mut held = Vec::new();
        if problem.orientation.is_some() {
            held.extend((0..3).map(|i| join(&Vector3::ith(i, 1.0), &Vector3::zeros())));
        }
        let places = (0..3).filter(|i| problem.end.position[*i].is_some());
        held.extend(places.map(|i| join(&Vector3::zeros(), &problem.axes[i])));
        let mut free: Vec<nalgebra::DVector<f64>> = Vec::new();
        // Gram-Schmidt: what is left of each column beside what is held, and beside the columns found.
        for column in basis.column_iter() {
            let mut left = column.into_owned();
            for _ in 0..2 {
                for direction in &held {
                    let part: f64 = left.iter().zip(direction.iter()).map(|(a, b)| a * b).sum();
                    left.iter_mut()
                        .zip(direction.iter())
                        .for_each(|(a, b)| *a -= part * b);
                }
                for other in &free {
                    let part = left.dot(other);
                    left -= other * part;
                }
            }
            if left.norm() > 1e-6 {
                free.push(left.normalize());
            }
        }
        DMatrix::from_fn(6, free.len(), |i, j| free[j][i])
    }
}

/// Adds P^T M Q at (row, column).
fn add(
    matrix: &mut DMatrix<f64>,
    row: usize,
    left: &DMatrix<f64>,
    column: usize,
    right: &DMatrix<f64>,
    block: &Matrix6<f64>,
) {
    let block = left.transpose() * DMatrix::from_column_slice(6, 6, block.as_slice()) * right;
    let (rows, columns) = block.shape();
    let mut view = matrix.view_mut((row, column), (rows, columns));
    view += block;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obstacle::Obstacle;
    use crate::rod::contact::{ContactGuess, ContactOptions, GuessedTouch, Surface};
    use crate::rod::{EndConditions, Path, Problem, Rod};
    use crate::section::Linear;
    use nalgebra::UnitQuaternion;

    fn rod() -> Rod {
        let law = Linear::diagonal([1.0, 1.0], 1.0).expect("a law");
        Rod::new(1.0, law).expect("a rod")
    }

    /// The touching rod of a solution without a guess, or from one.
    fn touching(
        problem: &ContactProblem,
        guess: Option<&ContactGuess>,
    ) -> (Touching, ContactGuess) {
        let found = problem.solve(guess).expect("an equilibrium");
        let touches = found.touches.iter().map(GuessedTouch::from);
        let guess = ContactGuess {
            base: found.base,
            touches: touches.collect(),
        };
        (problem.inward(&guess).expect("a guess"), guess)
    }

    /// Catches a sliding term that is left out, or has the wrong sign: the strip at a wall is stable by this term alone
    /// (theory 3.7; thrust 88, index 1 without the term).
    #[test]
    fn strip_is_stable_because_its_touch_slides() {
        let clamp = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * std::f64::consts::PI);
        let end = EndConditions::pose(Vector3::new(1.0 - 0.02646034508058697, 0.0, 0.0), clamp);
        let rod = rod().with_clamp(Vector3::zeros(), clamp);
        let problem = Problem::new(rod, end, 1e-12).expect("a problem");
        let wall = Obstacle::plane(Vector3::new(0.0, -0.1, 0.0), Vector3::y()).expect("a plane");
        let wall = Surface::new(wall, 0.0).expect("a surface");
        let problem = problem.with_path(Path::Planar);
        let problem = ContactProblem::new(problem, vec![wall], ContactOptions::default());
        let problem = problem.expect("a contact problem");
        let (at, _) = touching(&problem, None);
        let index = |terms| problem.index_with(&at, terms).expect("an index").held;
        assert_eq!(index(Terms::ALL), 0);
        let without = Terms {
            sliding: false,
            ..Terms::ALL
        };
        assert_eq!(index(without), 1);
    }

    /// Catches a term of the surface's curvature that is left out. A rod beyond a sphere's centre slips off. Without
    /// the term it would seem stable.
    #[test]
    fn rod_on_a_sphere_slips_off_by_the_curvature_of_the_sphere() {
        let pushed = |aside: f64| {
            let end = EndConditions {
                position: [Some(0.0), Some(0.0), None],
                orientation: Some(UnitQuaternion::identity()),
                ..EndConditions::load(Vector3::zeros(), Vector3::zeros())
            };
            let problem = Problem::new(rod(), end, 1e-12).expect("a problem");
            let sphere = Obstacle::sphere(Vector3::new(aside, 0.0, 0.48), 0.1, false);
            let surface = Surface::new(sphere.expect("a sphere"), 0.02).expect("a surface");
            let problem = problem.with_path(Path::Spatial);
            ContactProblem::new(problem, vec![surface], ContactOptions::default())
                .expect("a contact problem")
        };
        let (_, guess) = touching(&pushed(0.01), None);
        let far = pushed(-0.01);
        let (at, _) = touching(&far, Some(&guess));
        let index = |terms| far.index_with(&at, terms).expect("an index").held;
        assert_eq!(index(Terms::ALL), 1);
        let without = Terms {
            surface: false,
            ..Terms::ALL
        };
        assert_eq!(index(without), 0);
    }
}
