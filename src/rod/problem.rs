//! Problems: what is held and what is loaded at the rod's end, and the equations this gives for the base wrench.

use super::line::{self, Wrench};
use super::{Rod, RodSection};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3, Vector6};

/// The end condition, in the world frame. Each component of position is held or loaded; the orientation is held
/// (a clamp) or free under a couple (a ball joint, a free end).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    /// Held components of the position; None where the force is given.
    pub position: [Option<f64>; 3],
    /// Held orientation; None where the couple is given.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// n(L), used where the position is free.
    pub force: Vector3<f64>,
    /// m(L), used where the orientation is free.
    pub couple: Vector3<f64>,
    /// Force and couple are given along the directors at the end; only if nothing is held.
    pub follower: bool,
}

impl End {
    /// A free end under a dead force and couple.
    pub fn load(force: Vector3<f64>, couple: Vector3<f64>) -> Self {
        Self {
            position: [None; 3],
            orientation: None,
            force,
            couple,
            follower: false,
        }
    }

    /// A free end under force and couple that turn with it: components along the directors.
    pub fn follower(force: Vector3<f64>, couple: Vector3<f64>) -> Self {
        Self {
            follower: true,
            ..Self::load(force, couple)
        }
    }

    /// A ball joint at a position.
    pub fn ball(position: Vector3<f64>) -> Self {
        Self {
            position: [Some(position.x), Some(position.y), Some(position.z)],
            ..Self::load(Vector3::zeros(), Vector3::zeros())
        }
    }

    /// A clamp in a pose.
    pub fn pose(position: Vector3<f64>, orientation: UnitQuaternion<f64>) -> Self {
        Self {
            orientation: Some(orientation),
            ..Self::ball(position)
        }
    }

    /// True if some of the position or the orientation is held.
    pub fn holds(&self) -> bool {
        self.orientation.is_some() || self.position.iter().any(Option::is_some)
    }
}

/// A rod with an end condition, in the clamp's frame and the numerics' units.
#[derive(Debug, Clone)]
pub struct Problem {
    pub(super) rod: Rod,
    pub(super) end: End,
    /// The world's axes seen from the clamp.
    pub(super) axes: [Vector3<f64>; 3],
    /// Targets, by world component: position where held, force where not.
    pub(super) targets: [f64; 3],
    pub(super) orientation: Option<Matrix3<f64>>,
    pub(super) couple: Vector3<f64>,
    pub(super) tolerance: f64,
}

/// The rod's end at a trial wrench: pose, and its derivatives by the six components of the wrench.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub(super) b: Wrench,
    pub(super) r: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    /// Rows phi, rho; columns m(0), n. The last three columns only if the problem needs them.
    pub(super) tangent: [[f64; 6]; 6],
}

impl Problem {
    /// Checks that the end condition makes sense and can be met.
    ///
    /// # Errors
    /// A number that is not finite; a follower load on a held end; a position out of the reach of an inextensible rod.
    pub fn new(rod: Rod, end: End, tolerance: f64) -> Result<Self> {
        if !(1e-14..=1e-3).contains(&tolerance) {
            return Err(Error::domain(format!(
                "the tolerance is {tolerance}; it must be in [1e-14, 1e-3]"
            )));
        }
        let numbers = end.force.iter().chain(end.couple.iter()).copied();
        if !numbers
            .chain(end.position.iter().flatten().copied())
            .all(f64::is_finite)
        {
            return Err(Error::domain(
                "forces, couples and positions of the end must be finite",
            ));
        }
        if end.follower && end.holds() {
            return Err(Error::domain(
                "a follower load needs a free end: leave out the held position and orientation, or follower",
            ));
        }
        let (couple, force) = rod.units();
        let turn = rod.clamp.rotation.inverse();
        let origin = rod.clamp.translation.vector;
        let targets = std::array::from_fn(|i| match end.position[i] {
            Some(x) => (x - origin[i]) / rod.length,
            None => end.force[i] / force,
        });
        if let ([Some(_), Some(_), Some(_)], true) = (end.position, rod.is_inextensible()?) {
            let reach = Vector3::from(targets).norm();
            if !(reach < 1.0) {
                return Err(Error::unreachable(format!(
                    "the end is held at a distance of {:.9} from the clamp, but the rod is inextensible and {} long; \
                     hold it nearer, or give the rod an axial stiffness",
                    reach * rod.length,
                    rod.length
                )));
            }
        }
        // Follower loads live in the frame of the end, whatever the clamp's.
        let given = end.couple / couple;
        Ok(Self {
            axes: std::array::from_fn(|i| turn * Vector3::ith(i, 1.0)),
            targets,
            orientation: end
                .orientation
                .map(|q| *(turn * q).to_rotation_matrix().matrix()),
            couple: if end.follower { given } else { turn * given },
            rod,
            end,
            tolerance,
        })
    }

    /// The rod.
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// The rod at `count` (at least 2) evenly spaced sections under a base wrench in the world frame.
    ///
    /// # Errors
    /// As [`Rod::shape`].
    pub fn shape(&self, base: &Wrench, count: usize) -> Result<Vec<RodSection>> {
        let last = count.max(2) - 1;
        let at: Vec<f64> = (0..=last)
            .map(|i| self.rod.length * i as f64 / last as f64)
            .collect();
        self.rod.shape(base, &at, self.tolerance)
    }

    /// True if the loads have a potential: no follower load, no couple at an end that is free to turn.
    pub fn is_conservative(&self) -> bool {
        !self.end.follower && (self.end.orientation.is_some() || self.couple == Vector3::zeros())
    }

    /// The number of unknowns: m(0), and the components of n that are not given.
    pub fn unknowns(&self) -> usize {
        if self.end.follower {
            return 6;
        }
        3 + self.end.position.iter().flatten().count()
    }

    /// The base wrench of the unknowns.
    pub(super) fn wrench(&self, x: &DVector<f64>) -> Wrench {
        if self.end.follower {
            return Vector6::from_column_slice(x.as_slice());
        }
        let mut unknown = x.iter().skip(3);
        let mut n = Vector3::zeros();
        for i in 0..3 {
            let component = match self.end.position[i] {
                Some(_) => *unknown.next().expect("one unknown for each held component"),
                None => self.targets[i],
            };
            n += self.axes[i] * component;
        }
        Vector6::new(x[0], x[1], x[2], n.x, n.y, n.z)
    }

    /// The unknowns of a base wrench; components of n that are given are left out.
    pub(super) fn unknowns_of(&self, b: &Wrench) -> DVector<f64> {
        if self.end.follower {
            return DVector::from_column_slice(b.as_slice());
        }
        let n = b.fixed_rows::<3>(3).into_owned();
        let held = (0..3).filter(|i| self.end.position[*i].is_some());
        let mut x = vec![b[0], b[1], b[2]];
        x.extend(held.map(|i| n.dot(&self.axes[i])));
        DVector::from_vec(x)
    }

    /// The end of the rod at the unknowns.
    pub(super) fn trial(&self, x: &DVector<f64>) -> Result<Trial> {
        let b = self.wrench(x);
        let mut tangent = [[0.0; 6]; 6];
        // With the force given, three columns do.
        let (r, rotation) = if x.len() == 3 {
            let (end, _) = line::end::<3>(&self.rod.law, &b, self.tolerance)?;
            for (row, from) in tangent.iter_mut().zip(&end.tangent) {
                row[..3].copy_from_slice(from);
            }
            (end.position(), end.rotation())
        } else {
            let (end, _) = line::end::<6>(&self.rod.law, &b, self.tolerance)?;
            tangent = end.tangent;
            (end.position(), end.rotation())
        };
        Ok(Trial {
            b,
            r,
            rotation,
            tangent,
        })
    }

    /// The equations and their derivatives at a trial.
    pub(super) fn equations(&self, trial: &Trial) -> (DVector<f64>, DMatrix<f64>) {
        let size = self.unknowns();
        let block =
            |row: usize, column: usize| Matrix3::from_fn(|i, j| trial.tangent[row + i][column + j]);
        let (m0, n) = halves(&trial.b);
        let held: Vec<usize> = (0..3).filter(|i| self.end.position[*i].is_some()).collect();
        // Directions of n that the unknowns move.
        let ways: Vec<Vector3<f64>> = if self.end.follower {
            (0..3).map(|i| Vector3::ith(i, 1.0)).collect()
        } else {
            held.iter().map(|i| self.axes[*i]).collect()
        };
        let columns = |left: Matrix3<f64>, right: Matrix3<f64>| {
            let mut d = DMatrix::zeros(3, size);
            d.view_mut((0, 0), (3, 3)).copy_from(&left);
            for (k, way) in ways.iter().enumerate() {
                d.column_mut(3 + k).copy_from(&(right * way));
            }
            d
        };
        let d_phi = columns(block(0, 0), block(0, 3));
        let d_r = columns(block(3, 0), block(3, 3));
        let m = m0 - trial.r.cross(&n);
        let mut value = DVector::zeros(size);
        let mut matrix = DMatrix::zeros(size, size);
        // m(1) = m(0) - r x n.
        let d_m = columns(Matrix3::identity(), -trial.r.cross_matrix()) + n.cross_matrix() * &d_r;
        if let Some(target) = &self.orientation {
            let phi = rotation_vector(&(trial.rotation * target.transpose()));
            value.rows_mut(0, 3).copy_from(&phi);
            matrix
                .rows_mut(0, 3)
                .copy_from(&(inverse_left_jacobian(&phi) * d_phi));
        } else if self.end.follower {
            let back = trial.rotation.transpose();
            let d_n = columns(Matrix3::zeros(), Matrix3::identity());
            value.rows_mut(0, 3).copy_from(&(back * m - self.couple));
            matrix
                .rows_mut(0, 3)
                .copy_from(&(back * (d_m + m.cross_matrix() * &d_phi)));
            value
                .rows_mut(3, 3)
                .copy_from(&(back * n - Vector3::from(self.targets)));
            matrix
                .rows_mut(3, 3)
                .copy_from(&(back * (d_n + n.cross_matrix() * &d_phi)));
        } else {
            value.rows_mut(0, 3).copy_from(&(m - self.couple));
            matrix.rows_mut(0, 3).copy_from(&d_m);
        }
        for (k, &i) in held.iter().enumerate() {
            value[3 + k] = self.axes[i].dot(&trial.r) - self.targets[i];
            matrix
                .row_mut(3 + k)
                .copy_from(&(self.axes[i].transpose() * &d_r));
        }
        (value, matrix)
    }

    /// Equations and derivatives at the unknowns.
    pub(super) fn evaluate(&self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>)> {
        Ok(self.equations(&self.trial(x)?))
    }

    /// The section at the end of the rod.
    pub(super) fn end_section(&self, x: &DVector<f64>) -> Result<RodSection> {
        let b = self.wrench(x);
        let (end, _) = line::end::<0>(&self.rod.law, &b, self.tolerance)?;
        self.rod.outward(&end, &b)
    }
}

/// (m(0), n).
pub(super) fn halves(b: &Wrench) -> (Vector3<f64>, Vector3<f64>) {
    (
        b.fixed_rows::<3>(0).into_owned(),
        b.fixed_rows::<3>(3).into_owned(),
    )
}

/// The rotation vector of a rotation, of length at most pi.
fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_matrix_eps(rotation, 1e-15, 100, UnitQuaternion::identity()).scaled_axis()
}

/// d(rotation vector)/d(spin): I - [phi]x/2 + c [phi]x^2.
fn inverse_left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let angle = phi.norm();
    let c = if angle < 1e-2 {
        let square = angle * angle;
        1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
    };
    let cross = phi.cross_matrix();
    Matrix3::identity() - 0.5 * cross + c * cross * cross
}

impl Problem {
    /// The Morse index of the equilibrium with the base wrench `base` (world frame): 0 is stable.
    ///
    /// # Errors
    /// A wrench that the rod cannot follow.
    pub fn index_at(&self, base: &Wrench) -> Result<usize> {
        self.index(&self.unknowns_of(&self.rod.inward(base)))
    }

    /// The Morse index at the unknowns.
    pub(super) fn index(&self, x: &DVector<f64>) -> Result<usize> {
        let b = self.wrench(x);
        let (end, _) = line::end::<6>(&self.rod.law, &b, self.tolerance)?;
        let trial = Trial {
            b,
            r: end.position(),
            rotation: end.rotation(),
            tangent: end.tangent,
        };
        super::index::index(&self.rod, &self.end, &self.axes, &trial, self.tolerance)
    }
}
