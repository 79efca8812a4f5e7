//! Small vibrations of an assembly about an equilibrium.

use super::configuration::Configuration;
use super::free_end::{evenly, placed};
use super::network::Assembly;
use super::rod_element::LinkPoint;
use crate::error::{Error, Result};
use crate::math::small_sort::{sort_eigenvalues, sort_few};
use crate::rod::RodSection;
use crate::solve::positive_definite::definite;
use crate::spectrum::eigenvalues;
use nalgebra::{Complex, DMatrix, DVector, Vector6};

/// Natural frequencies without drag and rotors: K x = omega^2 M x.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// omega^2, ascending.
    pub squares: Vec<f64>,
    /// Angular frequencies, ascending; for an instability (omega^2 < 0) -sqrt(-omega^2), minus its rate of growth.
    pub frequencies: Vec<f64>,
    /// x by columns, x^T M x = 1: (rotation, translation of the reference point) body by body, in the world.
    pub shapes: DMatrix<f64>,
    /// Changes of the charts, by columns: 6 rows a rod, in units B/L, B/L^2.
    pub charts: DMatrix<f64>,
    /// Bound of the squares of neutral motions: 0 if the stiffness is positive definite beyond rounding.
    pub neutral: f64,
    /// True at index 0: no frequency is imaginary, and no rod unstable with its ends held.
    pub stable: bool,
}

/// Squares of neutral motions: bound in units of the rod, and relative to the largest square.
const NEUTRAL: f64 = 1e-10;
const ROUNDING: f64 = 1e-14;

/// Cholesky factor of a mass matrix, with the indices of its velocities.
type MassFactor<'a> = (&'a DMatrix<f64>, &'a [usize]);

/// Modes of an assembly with straight inextensible rods, and the shift of omega^2.
pub(super) struct SoftModes {
    pub squares: Vec<f64>,
    shapes: DMatrix<f64>,
    charts: DMatrix<f64>,
    pub shift: f64,
}

impl Modes {
    /// Configuration displaced along the mode of this number (from 0), for drawing: bodies by amplitude times shape,
    /// and the rods' charts with them. Ends meet to first order in the amplitude.
    ///
    /// # Errors
    /// No such mode.
    pub fn displaced(
        &self,
        assembly: &Assembly,
        now: &Configuration,
        mode: usize,
        amplitude: f64,
    ) -> Result<Configuration> {
        if mode >= self.squares.len() {
            return Err(Error::domain(format!(
                "mode {mode} of {} (they are counted from 0)",
                self.squares.len()
            )));
        }
        let (x, dq) = (
            self.shapes.column(mode) * amplitude,
            self.charts.column(mode) * amplitude,
        );
        let mut moved = now.clone();
        moved.bodies = assembly.displaced(&now.bodies, x.as_slice());
        for (q, dq) in moved.charts.iter_mut().zip(dq.as_slice().chunks(6)) {
            *q += Vector6::from_column_slice(dq);
        }
        Ok(moved)
    }
}

impl Assembly {
    /// Frequencies and mode shapes about an equilibrium at t = 0, drag and rotors left out. A rigid direction of the
    /// assembly, along a straight inextensible rod, has no mode. If the stiffness is positive definite, slow motions
    /// have full relative accuracy however fast the others are; else squares have an error of rounding times the
    /// largest.
    ///
    /// # Errors
    /// A configuration with neither stiffness nor compliance; friction in a joint; as [`super::Link::index`].
    pub fn modes(&self, now: &Configuration, tolerance: f64) -> Result<Modes> {
        self.check_joints_without_friction()?;
        let points = self.points(0.0, &now.bodies, &now.charts, tolerance)?;
        let massive = self.massive();
        if massive.is_empty() {
            return Err(Error::domain(
                "no body has a mass, and so nothing has a frequency: give a [[body]] mass and inertia",
            ));
        }
        let root = self.mass_root(now, &points, &massive)?;
        let index = self.index(0.0, now, tolerance)?;
        let (squares, shapes, charts, holds) = match self.stiffness(0.0, &now.bodies, &points) {
            Ok(stiffness) => {
                let following = following(&stiffness.matrix, &massive)?;
                let matrix = following.tr_mul(&(&stiffness.matrix * &following));
                let matrix = reduced(&root, &matrix)?;
                let (mut squares, mut y) = symmetric(&matrix);
                let holds = slow_ones(&matrix, &mut squares, &mut y);
                let shapes = following * back(&root, &y)?;
                let charts = &stiffness.charts * &shapes;
                (squares, shapes, charts, holds)
            }
            Err(_) => {
                let soft = self.soft_modes(now, &points, (&root, &massive), tolerance)?;
                (soft.squares, soft.shapes, soft.charts, false)
            }
        };
        let largest = squares.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
        Ok(Modes {
            neutral: if holds {
                0.0
            } else {
                NEUTRAL.max(ROUNDING * largest)
            },
            frequencies: squares
                .iter()
                .map(|x| x.signum() * x.abs().sqrt())
                .collect(),
            squares,
            shapes,
            charts,
            stable: index == 0,
        })
    }

    /// Refuses friction in joints of rods without mass, whose angles would be states of the small motions.
    fn check_joints_without_friction(&self) -> Result<()> {
        let mut joints = self.carriers().iter();
        let joint = joints.position(|carrier| {
            let axes = carrier.joint().map(super::guide::Guide::laws);
            axes.is_some_and(|laws| laws.iter().any(|law| law.damping > 0.0))
        });
        match joint {
            None => Ok(()),
            Some(node) => Err(Error::domain(format!(
                "{} has damping, which the small motions of rods without their own mass leave out: set damping = 0, or give the rods their \
                 mass and inertia = \"full\"",
                self.carriers()[node].called(node)
            ))),
        }
    }

    /// Eigenvalues s of small motions exp(s t) about an equilibrium at t = 0, with drag, rotors and loads that turn
    /// with bodies. The system M x'' + C x' + K x = 0 has two for each velocity that is not rigid, in order of
    /// imaginary, then real part. A real part above zero is an instability; a rotor can stabilise an unstable
    /// stiffness.
    ///
    /// # Errors
    /// As [`Assembly::modes`]; eigenvalues that do not converge.
    pub fn eigenvalues(&self, now: &Configuration, tolerance: f64) -> Result<Vec<Complex<f64>>> {
        self.check_joints_without_friction()?;
        let points = self.points(0.0, &now.bodies, &now.charts, tolerance)?;
        let massive = self.massive();
        let root = self.mass_root(now, &points, &massive)?;
        let (k, c) = match self.stiffness(0.0, &now.bodies, &points) {
            Ok(stiffness) => {
                let following = following(&stiffness.matrix, &massive)?;
                let [k, c] = [&stiffness.matrix, &stiffness.damping]
                    .map(|matrix| following.tr_mul(&(matrix * &following)));
                (reduced(&root, &k)?, reduced(&root, &c)?)
            }
            Err(_) => {
                let c = self.damping(now, &points)?;
                let c = reduced(&root, &c.select_rows(&massive).select_columns(&massive))?;
                self.flexible(now, &points, (&root, &massive), &c, tolerance)?
            }
        };
        let n = k.nrows();
        // Velocities are scaled by the largest frequency, which balances the blocks.
        let rate = k.norm().sqrt().max(f64::MIN_POSITIVE);
        let mut first = DMatrix::zeros(2 * n, 2 * n);
        first.view_mut((0, n), (n, n)).fill_diagonal(rate);
        first.view_mut((n, 0), (n, n)).copy_from(&(-k / rate));
        first.view_mut((n, n), (n, n)).copy_from(&-c);
        let mut values = eigenvalues(first).ok_or_else(|| {
            Error::no_convergence("the eigenvalues of small motions did not converge")
        })?;
        sort_eigenvalues(&mut values);
        Ok(values)
    }

    /// Stiffness and damping c, in L^T x, without the directions that would stretch an inextensible rod. Those are
    /// the left and right null space of L^T (K + shift M)^-1 L; the rest is inverted. The matrix need not be
    /// symmetric.
    fn flexible(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
        (root, massive): MassFactor<'_>,
        c: &DMatrix<f64>,
        tolerance: f64,
    ) -> Result<(DMatrix<f64>, DMatrix<f64>)> {
        let (compliance, _, shift) = self.shifted_compliance(now, points, (root, massive))?;
        let compliance = root.transpose() * compliance.select_rows(massive) * root;
        let svd = compliance.clone().svd(true, false);
        let directions = svd.u.unwrap_or_default();
        let rigid = tolerance.max(1e-12) * svd.singular_values.amax();
        let kept: Vec<usize> = (0..directions.ncols())
            .filter(|i| svd.singular_values[*i] > rigid)
            .collect();
        let basis = directions.select_columns(&kept);
        let inner = basis.transpose() * compliance * &basis;
        let mut stiffness = inner.try_inverse().ok_or_else(|| {
            Error::ill_conditioned("the assembly has neither stiffness nor compliance")
        })?;
        for i in 0..kept.len() {
            stiffness[(i, i)] -= shift;
        }
        Ok((stiffness, basis.transpose() * c * basis))
    }

    /// Compliance of all velocities on added springs against wrenches on those with mass, (K + shift M)^-1, with the
    /// response of the charts, and the shift.
    fn shifted_compliance(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
        (root, massive): MassFactor<'_>,
    ) -> Result<(DMatrix<f64>, DMatrix<f64>, f64)> {
        let (length, couple) = self.scales();
        // B/L^3 over the mean of the masses.
        let rotations = self.rotations();
        let shifts: Vec<usize> = (0..root.nrows())
            .filter(|i| !rotations.contains(&massive[*i]))
            .collect();
        let masses: f64 = shifts.iter().map(|i| root.row(*i).norm_squared()).sum();
        let shift = couple / (length * length) * shifts.len() as f64 / masses;
        let springs = root * root.transpose() * shift;
        let total = self.freedoms().1;
        let mut held = DMatrix::zeros(total, total);
        for (i, row) in massive.iter().enumerate() {
            for (j, column) in massive.iter().enumerate() {
                held[(*row, *column)] = springs[(i, j)];
            }
        }
        let (compliance, charts) = self.held_compliance(now, points, &held)?;
        let [compliance, charts] = [compliance, charts].map(|m| m.select_columns(massive));
        Ok((compliance, charts, shift))
    }

    /// Modes without those that would stretch an inextensible rod. If there is no stiffness K, there is the
    /// compliance C of the bodies on added springs, (K + shift M)^-1. With M = L L^T and L^T C L y = mu y,
    /// omega^2 = 1/mu - shift and x = C L y/mu; rigid directions have mu = 0.
    pub(super) fn soft_modes(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
        (root, massive): MassFactor<'_>,
        tolerance: f64,
    ) -> Result<SoftModes> {
        let (compliance, charts, shift) = self.shifted_compliance(now, points, (root, massive))?;
        let own = compliance.select_rows(massive);
        let (inverse, vectors) = symmetric(&(root.transpose() * own * root));
        let rigid = tolerance.max(1e-12) * inverse.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let mut kept: Vec<usize> = (0..inverse.len())
            .filter(|i| inverse[*i].abs() > rigid)
            .collect();
        sort_few(&mut kept, |k| 1.0 / inverse[*k]);
        let mut forces = root * vectors.select_columns(&kept);
        for (mut column, k) in forces.column_iter_mut().zip(&kept) {
            column /= inverse[*k];
        }
        Ok(SoftModes {
            squares: kept.iter().map(|k| 1.0 / inverse[*k] - shift).collect(),
            shapes: compliance * &forces,
            charts: charts * forces,
            shift,
        })
    }

    /// Cholesky factor L of the mass matrix M = L L^T of some velocities. Nodes among them have a unit mass.
    pub(super) fn mass_root(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
        some: &[usize],
    ) -> Result<DMatrix<f64>> {
        let mut mass = self.mass_matrix(now, points)?;
        let massive = self.massive();
        for i in (0..mass.nrows()).filter(|i| !massive.contains(i)) {
            mass[(i, i)] = 1.0;
        }
        let factors = mass.select_rows(some).select_columns(some).cholesky();
        factors.map(|factors| factors.l()).ok_or_else(|| {
            Error::ill_conditioned("the mass matrix is not positive definite to rounding: a body has next to no inertia about some axis")
        })
    }

    /// Shapes of the rods in the world at time `t`, those with a free end last: sections at `count` + 1 arclengths
    /// from end to end.
    ///
    /// # Errors
    /// As [`super::Link::end`].
    pub fn shapes(
        &self,
        t: f64,
        now: &Configuration,
        count: usize,
        tolerance: f64,
    ) -> Result<Vec<Vec<RodSection>>> {
        let links = 0..self.links().len();
        let shape = links.map(|k| {
            let at = evenly(self.links()[k].rod().length(), count);
            self.sections(t, now, k, &at, tolerance)
        });
        let free = self.free().iter();
        shape
            .chain(free.map(|rod| rod.shape(t, &now.bodies, count, tolerance)))
            .collect()
    }

    /// Shape of rod `k` in the world at time `t`: its sections at arclengths in growing order. Rods with a free end
    /// come after the others.
    ///
    /// # Errors
    /// As [`super::Link::end`].
    pub fn sections(
        &self,
        t: f64,
        now: &Configuration,
        k: usize,
        at: &[f64],
        tolerance: f64,
    ) -> Result<Vec<RodSection>> {
        let held = self.links().len();
        if let Some(rod) = k.checked_sub(held).and_then(|k| self.free().get(k)) {
            return rod.sections(t, &now.bodies, at, tolerance);
        }
        let (link, q) = (&self.links()[k], &now.charts[k]);
        let point = self.placed(t, now, k, tolerance)?;
        let (base, tip) = (point.base.pose, point.tip.pose);
        let seen = link.seen_at(t, &base.rotation)?;
        Ok(placed(
            seen.shape(q, &base.inv_mul(&tip), at, tolerance)?,
            &base,
        ))
    }
}

/// Motions of all velocities per unit of those with mass, the others in balance.
fn following(stiffness: &DMatrix<f64>, massive: &[usize]) -> Result<DMatrix<f64>> {
    let total = stiffness.nrows();
    let light: Vec<usize> = (0..total).filter(|i| !massive.contains(i)).collect();
    if light.is_empty() {
        return Ok(DMatrix::identity(total, total));
    }
    let rows = stiffness.select_rows(&light);
    let own = rows.select_columns(&light).lu();
    let answer = own.solve(&-rows.select_columns(massive)).ok_or_else(|| {
        Error::ill_conditioned(
            "a joint, or a node without mass, moves without force: no frequency follows from the masses alone; hold it, or give the joint a stiffness",
        )
    })?;
    let mut all = DMatrix::zeros(total, massive.len());
    for (column, row) in massive.iter().enumerate() {
        all[(*row, column)] = 1.0;
    }
    for (i, row) in light.iter().enumerate() {
        all.row_mut(*row).copy_from(&answer.row(i));
    }
    Ok(all)
}

/// L^-1 A L^-T.
fn reduced(root: &DMatrix<f64>, a: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let half = root.solve_lower_triangular(a);
    let whole = half.and_then(|half| root.solve_lower_triangular(&half.transpose()));
    whole
        .map(|whole| whole.transpose())
        .ok_or_else(|| Error::ill_conditioned("the mass matrix is singular"))
}

/// L^-T y.
fn back(root: &DMatrix<f64>, y: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let x = root.transpose().solve_upper_triangular(y);
    x.ok_or_else(|| Error::ill_conditioned("the mass matrix is singular"))
}

/// Replaces the slow half of the eigenpairs by those of the inverse, which have full relative accuracy, if the matrix
/// is positive definite beyond rounding; true if it is.
fn slow_ones(matrix: &DMatrix<f64>, squares: &mut [f64], vectors: &mut DMatrix<f64>) -> bool {
    let Some(factors) = definite(&((matrix + matrix.transpose()) * 0.5)) else {
        return false;
    };
    let (inverse, shapes) = symmetric(&factors.inverse());
    let count = squares.len();
    let [Some(slowest), Some(fastest)] = [inverse.last().map(|x| 1.0 / x), squares.last().copied()]
    else {
        return true;
    };
    let middle = (slowest * fastest).sqrt();
    for i in (0..count).take_while(|i| 1.0 / inverse[count - 1 - i] < middle) {
        squares[i] = 1.0 / inverse[count - 1 - i];
        vectors.set_column(i, &shapes.column(count - 1 - i));
    }
    true
}

/// Eigenvalues, ascending, and vectors of the symmetric part.
fn symmetric(a: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let eigen = ((a + a.transpose()) * 0.5).symmetric_eigen();
    let mut order: Vec<usize> = (0..a.nrows()).collect();
    let values: &DVector<f64> = &eigen.eigenvalues;
    sort_few(&mut order, |i| values[*i]);
    (
        order.iter().map(|i| values[*i]).collect(),
        eigen.eigenvectors.select_columns(&order),
    )
}
