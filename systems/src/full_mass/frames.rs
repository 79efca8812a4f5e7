//! Kinematics of the sections of a rod with mass: poses, velocities, accelerations, and derivatives by the strains.
//!
//! Let A be the integration from the base to a section, u and v the strains, R the directors. With r0, Omega, V, the
//! position, angular velocity and velocity of the base,
//! ```text
//! r = r0 + A tau,   tau = R v;       omega = Omega + A (R u_t),   r_t = V + A (omega x tau + R v_t);
//! omega_t = Omega' + A (R u_tt + omega x R u_t),
//! r_tt = V' + A (omega_t x tau + omega x (omega x tau) + 2 omega x R v_t + R v_tt).
//! ```
//! In space the integrals A (R u_t ..) of rotations are replaced by the exact rates of the rotations by collocation
//! (`section_rotations`). A has one row more than there are nodes: the last is the end. A change of the strains turns
//! R by phi = A (R du); a turn of the base adds to phi. All derivatives follow from dR = phi x R.

mod derivatives;

pub use derivatives::{PoseDerivatives, RateDerivatives};

use super::section_rotations::{Spins, pure, twice};
use crate::math::product::Matrix;
use crate::math::se3::{Turn, halves, join, product};
use crate::section::Strain;
use crate::viscoelastic::grid::Grid;
use crate::viscoelastic::kinematics::Kinematics;
use crate::viscoelastic::space::Space;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Rotation3, Vector3, Vector6};
use std::sync::Arc;

/// Three components of a vector at sections (rows) for changes of the strains (columns).
pub type Triple = [DMatrix<f64>; 3];

/// Discrete kinematics from strains to a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curve {
    /// In the plane of x and y, from the base along x, d1 along z: the angle is the integral of u1 and exact. Of
    /// length 1.
    Plane,
    /// In space, from the clamp along z: rotations by collocation, with their exact velocities.
    Space,
}

impl Curve {
    /// Pose of the base of a rod whose attachment has this pose: in the plane d1 is along z and d3 along x.
    pub fn base(self, attachment: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Plane => {
                let turn = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
                let turn = Rotation3::from_matrix_unchecked(turn);
                Isometry3::from_parts(nalgebra::Translation3::identity(), turn.into())
            }
            Self::Space => *attachment,
        }
    }
}

/// Step of the differences for curvatures of the centreline, as part of the rod's length. The curvatures serve the
/// search for the nearest point, not the distance.
const STRIDE: f64 = 1e-5;

/// Nodes of a rod, and integration from the clamp to each of them and to the end.
#[derive(Debug, Clone)]
pub struct Sections {
    /// The nodes.
    pub grid: Grid,
    /// Integration matrix A. Row i: int_0^{s_i}; the last: over the whole rod.
    up: DMatrix<f64>,
    /// Matrix A and its transpose, for products.
    upward: Matrix,
    downward: Matrix,
    /// Length of the rod.
    length: f64,
    /// Indices among u1 .. v3 of the strains that can change.
    active: Vec<usize>,
    curve: Curve,
}

/// Poses of the sections at the nodes and of the end.
#[derive(Debug, Clone)]
pub struct Shape {
    /// R = \[d1 d2 d3\].
    pub directors: Vec<Matrix3<f64>>,
    /// Positions r.
    pub positions: Vec<Vector3<f64>>,
    /// Position of the base.
    base: Vector3<f64>,
    /// tau = R v at the nodes.
    tangents: Vec<Vector3<f64>>,
    /// Rotation sums of the collocation; None in the plane, where they reduce to A.
    spins: Option<Arc<Spins>>,
    /// Error of the rotations on the nodes, as [`Kinematics::defect`].
    pub defect: f64,
}

/// Velocities of the sections.
#[derive(Debug, Clone)]
pub struct Flow {
    /// Angular velocities omega.
    pub spins: Vec<Vector3<f64>>,
    /// Velocities r_t.
    pub velocities: Vec<Vector3<f64>>,
    /// R u_t and R v_t at the nodes.
    bends: Vec<Vector3<f64>>,
    stretches: Vec<Vector3<f64>>,
    /// In space: y of [`Spins`] relative to the base, and the angular velocity of the base.
    turning: Vec<Turn>,
    base: Vector3<f64>,
}

/// Accelerations of the sections.
#[derive(Debug, Clone)]
pub struct Accelerations {
    /// Angular accelerations omega_t.
    pub spins: Vec<Vector3<f64>>,
    /// Accelerations r_tt.
    pub accelerations: Vec<Vector3<f64>>,
    /// R u_tt and R v_tt at the nodes.
    bends: Vec<Vector3<f64>>,
    stretches: Vec<Vector3<f64>>,
    /// In space z of [`Spins`].
    turning: Vec<Turn>,
}

/// Number of motions of a base: three rotations, three translations.
pub const BASE: usize = 6;

fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// Product with the three components of a field.
fn summed(matrix: &Matrix, f: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let parts: [_; 3] = std::array::from_fn(|k| DVector::from_fn(f.len(), |j, _| f[j][k]));
    let [x, y, z] = matrix.times(parts.each_ref());
    (0..x.len())
        .map(|i| Vector3::new(x[i], y[i], z[i]))
        .collect()
}

impl Sections {
    /// Sections at the nodes of `grid`, scaled to [0, 1], of a rod of this length.
    pub fn new(grid: Grid, active: &[usize], curve: Curve, length: f64) -> Self {
        let n = grid.len();
        let mut up = DMatrix::zeros(n + 1, n);
        up.rows_mut(0, n).copy_from(&grid.integration());
        for (j, weight) in grid.weights().iter().enumerate() {
            up[(n, j)] = *weight;
        }
        up *= length;
        Self {
            grid,
            upward: Matrix::new(&up),
            downward: Matrix::new(&up.transpose()),
            up,
            length,
            active: active.to_vec(),
            curve,
        }
    }

    /// Number of coordinates: strains that can change, at all nodes.
    pub fn size(&self) -> usize {
        self.grid.len() * self.active.len()
    }

    /// The centreline at an arclength s, and its first and second derivatives; the latter by differences.
    pub fn centreline(&self, shape: &Shape, s: f64) -> [Vector3<f64>; 3] {
        let part = (s / self.length).clamp(0.0, 1.0);
        let tangent = |part: f64| self.grid.at(&shape.tangents, part);
        let (before, after) = ((part - STRIDE).max(0.0), (part + STRIDE).min(1.0));
        let bend = (tangent(after) - tangent(before)) / ((after - before) * self.length);
        [
            shape.base + self.grid.integral_at(&shape.tangents, part) * self.length,
            tangent(part),
            bend,
        ]
    }

    /// Weights of the nodes; their sum is the length.
    pub fn weights(&self) -> impl Iterator<Item = f64> {
        self.grid
            .weights()
            .iter()
            .map(|weight| weight * self.length)
    }

    /// Integral of a field at the nodes up to each section.
    fn up(&self, f: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        summed(&self.upward, f)
    }

    /// Transpose of [`Sections::up`]: from sections to nodes.
    fn down(&self, f: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        summed(&self.downward, f)
    }

    /// [`Sections::up`] of every column.
    fn up_all(&self, f: &Triple) -> Triple {
        self.upward.times_all(f.each_ref())
    }

    /// The curve of the strains at the nodes, begun at `base`; None if the strains are too large.
    pub fn shape(&self, base: &Isometry3<f64>, strains: &[Strain]) -> Option<Shape> {
        let turn = base.rotation.to_rotation_matrix().into_inner();
        let mut spins = None;
        let (mut directors, defect) = match self.curve {
            Curve::Plane => {
                let bends: Vec<_> = strains.iter().map(|e| Vector3::z() * e[0]).collect();
                let angles = self.up(&bends);
                let directors: Vec<_> = angles.iter().map(|angle| planar(angle.z)).collect();
                // Truncation error of the positions, from the last coefficients of (cos, sin).
                let tangents: Vec<Vector3<f64>> =
                    directors.iter().map(|r| r.column(2).into_owned()).collect();
                let tails = self.grid.tails(&tangents[..strains.len()]);
                let sizes = tails.iter().zip(self.grid.counts());
                let defect = sizes
                    .map(|(tail, n)| tail.now / n as f64)
                    .fold(0.0, f64::max);
                (directors, defect)
            }
            Curve::Space => {
                let space = Space::<6, 6>::new();
                let scaled: Vec<Strain> = strains.iter().map(|e| e * self.length).collect();
                let curve = space.shape(&self.grid, &scaled)?;
                let mut directors = curve.directors().to_vec();
                directors.push(curve.end().rotation.to_rotation_matrix().into_inner());
                let bends = strains.iter().map(|e| e.fixed_rows::<3>(0).into_owned());
                let bends: Vec<Vector3<f64>> = bends.collect();
                spins = Some(Arc::new(Spins::new(&self.up, &bends, &turn)?));
                (directors, space.defect(&self.grid, &curve))
            }
        };
        directors.iter_mut().for_each(|r| *r = turn * *r);
        let tangents: Vec<Vector3<f64>> = directors
            .iter()
            .zip(strains)
            .map(|(r, e)| r * e.fixed_rows::<3>(3))
            .collect();
        let base = base.translation.vector;
        let mut positions = self.up(&tangents);
        positions.iter_mut().for_each(|r| *r += base);
        let end = positions.last()?;
        end.iter().all(|x| x.is_finite()).then_some(Shape {
            directors,
            positions,
            base,
            tangents,
            spins,
            defect,
        })
    }

    /// Velocities of the sections at these strain rates, with the twist `base` of the base.
    pub fn flow(&self, shape: &Shape, base: &Vector6<f64>, rates: &[Strain]) -> Flow {
        let [bends, stretches] = outward(shape, rates);
        let (spin, velocity) = halves(base);
        let turning = match &shape.spins {
            Some(all) => all.halved(|j| pure(&bends[j])),
            None => Vec::new(),
        };
        let spins = beyond(
            spin,
            match &shape.spins {
                Some(_) => turning.iter().map(twice).collect(),
                None => self.up(&bends),
            },
        );
        let grown: Vec<_> = (0..rates.len())
            .map(|j| spins[j].cross(&shape.tangents[j]) + stretches[j])
            .collect();
        Flow {
            velocities: beyond(velocity, self.up(&grown)),
            spins,
            bends,
            stretches,
            turning,
            base: spin,
        }
    }

    /// Accelerations of the sections from `base`, those of the base, and `second`, the second derivatives of the
    /// strains.
    pub fn change(
        &self,
        shape: &Shape,
        flow: &Flow,
        base: &Vector6<f64>,
        second: &[Strain],
    ) -> Accelerations {
        let [bends, stretches] = outward(shape, second);
        let (spin, velocity) = halves(base);
        let n = second.len();
        let mut turning = Vec::new();
        let seen = match &shape.spins {
            Some(all) => {
                let y = &flow.turning;
                turning =
                    all.halved(|j| product(&y[j], &pure(&flow.bends[j])) * 2.0 + pure(&bends[j]));
                let pairs = turning.iter().zip(y);
                let seen =
                    pairs.map(|(z, y)| twice(&(z - product(y, y))) + flow.base.cross(&twice(y)));
                seen.collect()
            }
            None => {
                let faster = (0..n).map(|j| bends[j] + flow.spins[j].cross(&flow.bends[j]));
                self.up(&faster.collect::<Vec<_>>())
            }
        };
        let spins = beyond(spin, seen);
        let grown: Vec<_> = (0..n)
            .map(|j| {
                let (omega, tau) = (&flow.spins[j], &shape.tangents[j]);
                spins[j].cross(tau)
                    + omega.cross(&(omega.cross(tau) + flow.stretches[j] * 2.0))
                    + stretches[j]
            })
            .collect();
        Accelerations {
            accelerations: beyond(velocity, self.up(&grown)),
            spins,
            bends,
            stretches,
            turning,
        }
    }

    /// J^T f of couples and forces on the sections, in the order of the coordinates.
    pub fn gathered(
        &self,
        shape: &Shape,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> Vec<f64> {
        let [moments, beyond] = self.beyond(shape, couples, forces);
        let mut out = Vec::with_capacity(self.size());
        for ((directors, m), p) in shape.directors.iter().zip(&moments).zip(&beyond) {
            for k in &self.active {
                let part = if *k < 3 { m } else { p };
                out.push(directors.column(*k % 3).dot(part));
            }
        }
        out
    }

    /// Resultants (couple, force) along the directors at the nodes that balance couples and forces of the rod on masses
    /// at the sections, those of rigid strains among them.
    pub fn resultants(
        &self,
        shape: &Shape,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> Vec<Vector6<f64>> {
        let [moments, beyond] = self.beyond(shape, couples, forces);
        let nodes = shape.directors.iter().zip(self.weights());
        let nodes = nodes.zip(moments.iter().zip(&beyond));
        nodes
            .map(|((directors, weight), (m, p))| {
                -join(&directors.tr_mul(m), &directors.tr_mul(p)) / weight
            })
            .collect()
    }

    /// weight_j times the moment and the force at node j of couples and forces on the sections beyond.
    fn beyond(
        &self,
        shape: &Shape,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> [Vec<Vector3<f64>>; 2] {
        let [arms, beyond] = self.borne(shape, couples, forces);
        let moments: Vec<Vector3<f64>> = match &shape.spins {
            Some(spins) => spins
                .gathered(&arms)
                .iter()
                .map(|m| twice(m) * 0.5)
                .collect(),
            None => self.down(&arms),
        };
        [moments, beyond]
    }

    /// Resultant wrench on the base of couples and forces on the sections.
    pub fn on_base(
        &self,
        shape: &Shape,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> Vector6<f64> {
        let (mut couple, mut force) = (Vector3::zeros(), Vector3::zeros());
        for ((m, n), r) in couples.iter().zip(forces).zip(&shape.positions) {
            couple += m + (r - shape.base).cross(n);
            force += n;
        }
        join(&couple, &force)
    }

    /// Couples at the sections plus the moments of the forces on the tangents, and weight_j times the total force
    /// beyond node j.
    fn borne(
        &self,
        shape: &Shape,
        couples: &[Vector3<f64>],
        forces: &[Vector3<f64>],
    ) -> [Vec<Vector3<f64>>; 2] {
        let beyond = self.down(forces);
        let mut arms = couples.to_vec();
        for (j, p) in beyond.iter().enumerate() {
            arms[j] += shape.tangents[j].cross(p);
        }
        [arms, beyond]
    }
}

impl Accelerations {
    /// The acceleration of the end.
    pub fn end(&self) -> Vector6<f64> {
        let last = self.spins.len() - 1;
        join(&self.spins[last], &self.accelerations[last])
    }
}

impl Flow {
    /// The twist of the end.
    pub fn end(&self) -> Vector6<f64> {
        let last = self.spins.len() - 1;
        join(&self.spins[last], &self.velocities[last])
    }
}

fn last_rows(of: [&Triple; 2]) -> DMatrix<f64> {
    let last = of[0][0].nrows() - 1;
    let rows: Vec<_> = (0..6).map(|k| of[k / 3][k % 3].row(last)).collect();
    DMatrix::from_rows(&rows)
}

/// Fields integrated from a starting value.
fn beyond(begin: Vector3<f64>, mut field: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    field.iter_mut().for_each(|x| *x += begin);
    field
}

impl Shape {
    /// The pose of a section; the end is the last.
    pub fn pose(&self, i: usize) -> Isometry3<f64> {
        let turn = Rotation3::from_matrix_unchecked(self.directors[i]);
        Isometry3::from_parts(self.positions[i].into(), turn.into())
    }

    /// The pose of the end.
    pub fn end(&self) -> Isometry3<f64> {
        self.pose(self.positions.len() - 1)
    }
}

/// R du and R dv at the nodes.
fn outward(shape: &Shape, rates: &[Strain]) -> [Vec<Vector3<f64>>; 2] {
    [0, 3].map(|first| {
        let pairs = shape.directors.iter().zip(rates);
        pairs.map(|(r, e)| r * e.fixed_rows::<3>(first)).collect()
    })
}

/// Directors of a section in the plane, at the angle of the tangent to x; d1 is along z.
fn planar(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = angle.sin_cos();
    Matrix3::new(0.0, sin, cos, 0.0, -cos, sin, 1.0, 0.0, 0.0)
}
