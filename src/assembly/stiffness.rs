//! The stiffness of a whole assembly against small displacements of its bodies, and its index (theory 3.4).

use super::{Assembly, Configuration, Joint, LinkPoint, On, Place};
use crate::error::{Error, Result};
use crate::math::se3::halves;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix, Vector6};

/// A twist of the reference point of a body as one of a place `lever` away, all along the axes of the world.
fn carried(lever: &nalgebra::Vector3<f64>) -> Matrix6<f64> {
    let mut carried = Matrix6::identity();
    carried
        .fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&-lever.cross_matrix());
    carried
}

fn diagonal(turn: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(turn);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
    both
}

/// phi x f for a small turn phi, as a matrix on phi.
fn turning(m: &nalgebra::Vector3<f64>, n: &nalgebra::Vector3<f64>) -> SMatrix<f64, 6, 3> {
    let mut turned = SMatrix::<f64, 6, 3>::zeros();
    turned
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&-m.cross_matrix());
    turned
        .fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&-n.cross_matrix());
    turned
}

impl LinkPoint {
    /// Derivatives of the wrenches on base and end (each at its attachment, in the world) by twists of base and end: 12 x 12,
    /// and the chart's by the same: 6 x 12. None at a fold.
    fn linear(
        &self,
        joint: Joint,
        units: &Vector6<f64>,
    ) -> Option<(SMatrix<f64, 12, 12>, SMatrix<f64, 6, 12>)> {
        let turn = self.base.pose.rotation.to_rotation_matrix();
        let back = diagonal(&turn.matrix().transpose());
        let arm = self.tip.pose.translation.vector - self.base.pose.translation.vector;
        // xi = back (twist of the end - that of the base carried to it).
        let mut drive = SMatrix::<f64, 6, 12>::zeros();
        drive
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(&(-back * carried(&arm)));
        drive.fixed_view_mut::<6, 6>(0, 6).copy_from(&back);
        if joint == Joint::Ball {
            drive.fixed_rows_mut::<3>(0).fill(0.0);
        }
        let chart = self.end.jacobian.full_piv_lu().try_inverse()? * drive;
        // dm(0), dn in the base; dm(1) = dm(0) - dr x n - r x dn.
        let physical = Matrix6::from_diagonal(units);
        let change = physical * chart;
        let moved = self.end.tangent * change;
        let (r, n) = (self.end.pose.translation.vector, self.end.force);
        let dm0 = change.fixed_rows::<3>(0).into_owned();
        let dn = change.fixed_rows::<3>(3).into_owned();
        let dm1 = dm0 + n.cross_matrix() * moved.fixed_rows::<3>(3) - r.cross_matrix() * dn;
        let matrix = turn.matrix();
        let mut by = SMatrix::<f64, 12, 12>::zeros();
        by.fixed_rows_mut::<3>(0).copy_from(&(matrix * dm0));
        by.fixed_rows_mut::<3>(3).copy_from(&(matrix * dn));
        by.fixed_rows_mut::<3>(6).copy_from(&(matrix * -dm1));
        by.fixed_rows_mut::<3>(9).copy_from(&(matrix * -dn));
        // The base's turn takes the wrenches along.
        for (row, wrench) in [(0, self.wrenches()[0]), (6, self.wrenches()[1])] {
            let (m, n) = halves(&wrench);
            let mut block = by.fixed_view_mut::<6, 3>(row, 0);
            block += turning(&m, &n);
        }
        Some((by, chart))
    }
}

/// What small displacements of the bodies do.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// Minus the derivative of the balance about the reference points by (rotation, translation) of the bodies, in the world:
    /// K, symmetric at an equilibrium under loads that have a potential.
    pub matrix: DMatrix<f64>,
    /// The mass matrix M about the reference points.
    pub mass: DMatrix<f64>,
    /// Minus the derivative of the balance by the velocities: drag.
    pub damping: DMatrix<f64>,
    /// Derivatives of the charts, rod by rod: 6 rows each.
    pub charts: DMatrix<f64>,
}

impl Assembly {
    /// The wrench on every body, rods and loads together, about its reference point; 0 at an equilibrium. Point masses have
    /// three components.
    pub fn balance(&self, t: f64, bodies: &[Place], points: &[LinkPoint]) -> DVector<f64> {
        let wrenches = self.wrenches(bodies, points);
        let parts =
            self.carriers()
                .iter()
                .zip(bodies)
                .zip(&wrenches)
                .map(|((carrier, place), wrench)| {
                    let all = wrench + carrier.load(t, &place.pose);
                    DVector::from_column_slice(&all.as_slice()[6 - carrier.freedoms()..])
                });
        let parts: Vec<f64> = parts
            .flat_map(|part| part.iter().copied().collect::<Vec<_>>())
            .collect();
        DVector::from_vec(parts)
    }

    /// The stiffness at a configuration at rest.
    ///
    /// # Errors
    /// A rod at its fold, with its number.
    pub fn stiffness(&self, t: f64, bodies: &[Place], points: &[LinkPoint]) -> Result<Stiffness> {
        let (starts, total) = self.freedoms();
        let mut sum = Stiffness {
            matrix: DMatrix::zeros(total, total),
            mass: DMatrix::zeros(total, total),
            damping: DMatrix::zeros(total, total),
            charts: DMatrix::zeros(6 * points.len(), total),
        };
        for (k, (link, point)) in self.links().iter().zip(points).enumerate() {
            let (by, chart) = point.linear(link.joint(), &link.units()).ok_or_else(|| {
                Error::ill_conditioned(format!(
                    "rod {k} is exactly at a fold, where it has no stiffness; move the configuration a little"
                ))
            })?;
            let sites = [link.from(), link.to()];
            let lever = |i: usize| match sites[i].on {
                On::Body(body) => Some((
                    body,
                    bodies[body].pose.rotation * sites[i].place.translation.vector,
                )),
                _ => None,
            };
            for i in 0..2 {
                let Some((row, arm)) = lever(i) else { continue };
                let skip = 6 - self.carriers()[row].freedoms();
                let onto = carried(&arm).transpose();
                for j in 0..2 {
                    let Some((column, other)) = lever(j) else {
                        continue;
                    };
                    let block = onto * by.fixed_view::<6, 6>(6 * i, 6 * j) * carried(&other);
                    add(
                        &mut sum.matrix,
                        (starts[row], starts[column]),
                        &-block,
                        (skip, 6 - self.carriers()[column].freedoms()),
                    );
                }
                // The lever turns with the body: d(lever x n) = (phi x lever) x n.
                let n = halves(&point.wrenches()[i]).1;
                let mut block = Matrix6::zeros();
                block
                    .fixed_view_mut::<3, 3>(0, 0)
                    .copy_from(&(n.cross_matrix() * arm.cross_matrix()));
                if skip == 0 {
                    add(&mut sum.matrix, (starts[row], starts[row]), &-block, (0, 0));
                }
            }
            for j in 0..2 {
                let Some((column, other)) = lever(j) else {
                    continue;
                };
                let block = chart.fixed_columns::<6>(6 * j) * carried(&other);
                let skip = 6 - self.carriers()[column].freedoms();
                for i in 0..6 {
                    for c in skip..6 {
                        sum.charts[(6 * k + i, starts[column] + c - skip)] += block[(i, c)];
                    }
                }
            }
        }
        let wrenches = self.wrenches(bodies, points);
        for (((carrier, place), wrench), start) in self
            .carriers()
            .iter()
            .zip(bodies)
            .zip(&wrenches)
            .zip(starts)
        {
            let [by_pose, by_velocity, by_wrench] = carrier.linear(t, &place.pose, wrench);
            let mass = by_wrench
                .try_inverse()
                .ok_or_else(|| Error::ill_conditioned("a body without inertia"))?;
            let size = (carrier.freedoms(), carrier.freedoms());
            let mut view = sum.matrix.view_mut((start, start), size);
            view -= &mass * by_pose;
            let mut view = sum.damping.view_mut((start, start), size);
            view -= &mass * by_velocity;
            sum.mass.view_mut((start, start), size).copy_from(&mass);
        }
        Ok(sum)
    }

    /// The Morse index of the whole with the bodies free: the rods' indices with their ends held and the negative eigenvalues
    /// of the stiffness (Haynsworth). 0 is stable.
    ///
    /// # Errors
    /// As [`Assembly::stiffness`] and [`super::Link::index`].
    pub fn index(&self, t: f64, now: &Configuration, tolerance: f64) -> Result<usize> {
        let points = self.points(t, &now.bodies, &now.charts, tolerance)?;
        let stiffness = self.stiffness(t, &now.bodies, &points)?;
        let symmetric = (&stiffness.matrix + stiffness.matrix.transpose()) * 0.5;
        let negative = symmetric
            .symmetric_eigenvalues()
            .iter()
            .filter(|x| **x < 0.0)
            .count();
        let rods = self
            .links()
            .iter()
            .zip(&now.charts)
            .map(|(link, q)| link.index(q, tolerance));
        rods.sum::<Result<usize>>().map(|held| held + negative)
    }
}

fn add(to: &mut DMatrix<f64>, at: (usize, usize), block: &Matrix6<f64>, skip: (usize, usize)) {
    for i in skip.0..6 {
        for j in skip.1..6 {
            to[(at.0 + i - skip.0, at.1 + j - skip.1)] += block[(i, j)];
        }
    }
}
