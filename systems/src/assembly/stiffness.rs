//! Stiffness matrix of an assembly against small displacements of its bodies, and its Morse index (theory 3.4).

use super::attachment::Attachment;
use super::body::BodyMotion;
use super::configuration::Configuration;
use super::guide::Guide;
use super::network::Assembly;
use super::rod_element::{EndKind, Link, LinkPoint};
use crate::error::{Error, Result};
use crate::math::se3::{halves, join};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix6, Matrix6xX, SMatrix, Vector3, Vector6,
};

/// Transfer of a twist from the reference point of a body to a point `lever` away, along the axes of the world.
pub(super) fn carried(lever: &Vector3<f64>) -> Matrix6<f64> {
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

/// Change of the couple of a force `n` at `lever` under a small rotation phi of the body:
/// d(lever x n) = (phi x lever) x n.
pub(super) fn lever_turned(lever: &Vector3<f64>, n: &Vector3<f64>) -> Matrix6<f64> {
    let mut turned = Matrix6::zeros();
    turned
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(n.cross_matrix() * lever.cross_matrix()));
    turned
}

/// An attachment with the places of the bodies, the index of the first velocity of each, and their own twists.
type PlacedAttachment<'a> = (
    &'a Attachment,
    &'a [BodyMotion],
    (&'a [usize], &'a [Matrix6xX<f64>]),
);

/// Rotation of the end, in radians per rod length of the attachment's motion, beyond which the rod is at a fold.
const STEEP: f64 = 1e7;

impl LinkPoint {
    /// Twist of the end of the rod `link`, relative to the base. On a ball joint its spin is NaN at a fold, at which
    /// the end turns infinitely fast.
    pub fn end_twist(&self, link: &Link) -> Vector6<f64> {
        let twist = self.relative_twist();
        if !link.joint().turns() {
            return twist;
        }
        let scale = link.gap_scale(&self.end);
        let svd = (scale * self.end.jacobian).svd(true, true);
        let largest = svd.singular_values.max();
        let (Some(v), Ok(mut q)) = (
            &svd.v_t,
            svd.solve(&(scale * self.drive()), f64::EPSILON * largest),
        ) else {
            return Vector6::repeat(f64::NAN);
        };
        if self.end.is_taut() {
            // Rate of the force beside the spring, whose far end moves along.
            let pulled = halves(&twist).1 * self.end.pulled();
            let mut force = q.fixed_rows_mut::<3>(3);
            force += pulled;
        }
        let turned = self.end.tangent.fixed_rows::<3>(0);
        let mut spin = turned * q;
        if let Some(along) = &self.end.along {
            spin += along.turned.fixed_rows::<3>(0) * self.base_spin();
        }
        if let Some(driven) = &self.driven {
            spin += driven.turn;
        }
        // The axial force of a straight rod has no determined rate, either, but does not affect the rotation.
        let steep = (0..6).any(|i| {
            let least = svd.singular_values[i].max(f64::EPSILON * largest);
            (turned * v.row(i).transpose()).norm() > STEEP * least
        });
        if steep {
            spin.fill(f64::NAN);
        }
        join(&spin, &halves(&twist).1)
    }

    /// [`relative_by_twists`] of the attachments.
    pub(super) fn relative_by_twists(&self) -> SMatrix<f64, 6, 12> {
        relative_by_twists(&self.base.pose, &self.tip.pose)
    }

    /// Right-hand side [`LinkPoint::drive`] as a function of the twists of base and end in the world.
    pub(super) fn drive_by_twists(&self) -> SMatrix<f64, 6, 12> {
        let mut drive = self.end.drive * self.relative_by_twists();
        if let Some(along) = &self.end.along {
            let turn = self.base.pose.rotation.to_rotation_matrix();
            let mut turns = drive.fixed_columns_mut::<3>(0);
            turns -= along.prescribed * turn.matrix().transpose();
        }
        drive
    }

    /// Wrenches on base and end from m(0), n, m(1) in the base, each at its attachment, in the world.
    fn wrenches_of<const K: usize>(&self, resultants: &SMatrix<f64, 9, K>) -> SMatrix<f64, 12, K> {
        let turn = self.base.pose.rotation.to_rotation_matrix();
        let part = |row: usize| turn.matrix() * resultants.fixed_rows::<3>(row);
        let mut by = SMatrix::<f64, 12, K>::zeros();
        by.fixed_rows_mut::<3>(0).copy_from(&part(0));
        by.fixed_rows_mut::<3>(3).copy_from(&part(3));
        by.fixed_rows_mut::<3>(6).copy_from(&-part(6));
        by.fixed_rows_mut::<3>(9).copy_from(&-part(3));
        by
    }

    /// Derivatives of the wrenches by the chart.
    pub(super) fn wrenches_by_chart(&self) -> SMatrix<f64, 12, 6> {
        let mut by = self.wrenches_of(&self.end.resultants);
        if let Some(along) = &self.end.along {
            let turn = self.base.pose.rotation.to_rotation_matrix();
            let mut tip = by.fixed_rows_mut::<3>(9);
            tip -= turn.matrix() * along.taken;
        }
        by
    }

    /// Derivatives of the wrenches by twists of base and end at fixed chart: the wrenches turn with the base. A
    /// relative rotation of the ends changes the couples of a taut rod, and a displacement the force of the spring
    /// beside its end.
    pub(super) fn wrenches_by_turns(&self) -> SMatrix<f64, 12, 12> {
        let mut by = SMatrix::<f64, 12, 12>::zeros();
        if let Some(along) = self.end.chord() {
            // The force turns with the chord between the attachments, whatever their rotations.
            let chord = self.tip.pose.translation.vector - self.base.pose.translation.vector;
            let along = self.base.pose.rotation * along;
            let across = nalgebra::Matrix3::identity() - along * along.transpose();
            let n = self.base.pose.rotation * self.end.force;
            let turned = across * (n.dot(&along) / chord.norm());
            for (row, column, sign) in [(3, 3, -1.0), (3, 9, 1.0), (9, 3, 1.0), (9, 9, -1.0)] {
                by.fixed_view_mut::<3, 3>(row, column)
                    .copy_from(&(turned * sign));
            }
            return by;
        }
        let back = self.base.pose.rotation.inverse().to_rotation_matrix();
        if let EndKind::Taut {
            turned: Some(turned),
            ..
        } = &self.end.kind
        {
            let between = self.wrenches_of(turned) * back.matrix();
            by.fixed_columns_mut::<3>(0).copy_from(&-between);
            by.fixed_columns_mut::<3>(6).copy_from(&between);
        }
        let pulled = self.end.pulled();
        if pulled != 0.0 {
            let by_force = self.wrenches_by_chart().fixed_columns::<3>(3).into_owned();
            by += by_force * self.relative_by_twists().fixed_rows::<3>(3) * pulled;
        }
        for (i, wrench) in self.wrenches().iter().enumerate() {
            let (m, n) = halves(wrench);
            for (j, f) in [m, n].iter().enumerate() {
                let mut block = by.fixed_view_mut::<3, 3>(6 * i + 3 * j, 0);
                block -= f.cross_matrix();
            }
        }
        if let Some(along) = &self.end.along {
            // The load does not turn with the base.
            let turn = self.base.pose.rotation.to_rotation_matrix();
            let couple = turn.matrix() * along.turned.fixed_rows::<3>(6) * back.matrix();
            let mut block = by.fixed_view_mut::<3, 3>(6, 0);
            block -= couple;
            let mut block = by.fixed_view_mut::<3, 3>(9, 0);
            block -= turn.matrix() * along.force_turned * back.matrix();
            let base = |row| turn.matrix() * along.base.fixed_rows::<3>(row) * back.matrix();
            for (row, change) in [(0, base(0)), (3, base(3)), (9, -base(3))] {
                let mut block = by.fixed_view_mut::<3, 3>(row, 0);
                block += change;
            }
        }
        by
    }

    /// Derivatives of the wrenches, and of the chart, by twists of base and end, with the rod in equilibrium. None at
    /// a fold, and for a straight inextensible rod.
    fn linear(&self, link: &Link) -> Option<(SMatrix<f64, 12, 12>, SMatrix<f64, 6, 12>)> {
        let drive = link.gap_scale(&self.end) * self.drive_by_twists();
        let chart = link.regular(&self.end)?.solve(&drive)?;
        let by = self.wrenches_by_chart() * chart + self.wrenches_by_turns();
        Some((by, chart))
    }
}

/// Twist of the end attachment relative to the base, along the base's directors, as a function of the twists of base
/// and end in the world.
pub(super) fn relative_by_twists(
    base: &Isometry3<f64>,
    tip: &Isometry3<f64>,
) -> SMatrix<f64, 6, 12> {
    let back = diagonal(&base.rotation.to_rotation_matrix().matrix().transpose());
    let arm = tip.translation.vector - base.translation.vector;
    let mut relative = SMatrix::<f64, 6, 12>::zeros();
    relative
        .fixed_view_mut::<6, 6>(0, 0)
        .copy_from(&(-back * carried(&arm)));
    relative.fixed_view_mut::<6, 6>(0, 6).copy_from(&back);
    relative
}

/// Linear response of an assembly to small displacements of the bodies.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// Minus the derivative of the balance about the reference points by (rotation, translation) of the bodies, in
    /// the world: K, symmetric at an equilibrium under loads that have a potential.
    pub matrix: DMatrix<f64>,
    /// The mass matrix M about the reference points.
    pub mass: DMatrix<f64>,
    /// Minus the derivative of the balance by the velocities: drag, and the gyroscopic couples of rotors (skew).
    pub damping: DMatrix<f64>,
    /// Derivatives of the charts by the displacements: 6 rows per rod.
    pub charts: DMatrix<f64>,
}

impl Assembly {
    /// Twists of each body per unit of the body's own velocities.
    pub fn own_twists(&self, bodies: &[BodyMotion]) -> Vec<Matrix6xX<f64>> {
        let all = self.carriers().iter().zip(bodies);
        all.map(|(carrier, place)| match carrier.guide() {
            Some(guide) => guide.twists(&guide.frame(0.0, bodies), &place.pose),
            None => carrier.free_twists(&place.pose),
        })
        .collect()
    }

    /// Twist of an attachment per unit of the velocities that move it: those of its body, or those of its joint and
    /// of the body that carries the joint. Each part comes with the index of its first velocity.
    pub(super) fn twists_of(
        &self,
        site: &Attachment,
        bodies: &[BodyMotion],
        (starts, own): (&[usize], &[Matrix6xX<f64>]),
    ) -> Vec<(usize, Matrix6xX<f64>)> {
        let Some((body, lever)) = site.lever(bodies) else {
            return Vec::new();
        };
        let mut parts = vec![(starts[body], carried(&lever) * &own[body])];
        if let Some(parent) = self.carriers()[body].joint().and_then(Guide::parent) {
            let [node, from] = [body, parent].map(|k| bodies[k].pose.translation.vector);
            let mut twists = carried(&(node + lever - from)) * &own[parent];
            if self.carriers()[body].joint().is_some_and(Guide::is_ball) {
                twists.fixed_rows_mut::<3>(0).fill(0.0);
            }
            parts.push((starts[parent], twists));
        }
        parts
    }

    /// Adds `sign` times the change of the action of a fixed wrench at an attachment, as motions turn levers and the
    /// axes of joints.
    pub(super) fn add_turned(
        &self,
        to: &mut DMatrix<f64>,
        sign: f64,
        (site, bodies, (starts, own)): PlacedAttachment<'_>,
        wrench: &Vector6<f64>,
    ) {
        let Some((body, lever)) = site.lever(bodies) else {
            return;
        };
        let n = halves(wrench).1;
        let mut around = |arm: &Vector3<f64>, k: usize| {
            let turned = lever_turned(arm, &n) * sign;
            add(to, (starts[k], starts[k]), &turned, [&own[k]; 2]);
        };
        let Some(joint) = self.carriers()[body].guide() else {
            around(&lever, body);
            return;
        };
        around(&lever, body);
        let (frame, pose) = (joint.frame(0.0, bodies), &bodies[body].pose);
        let here = site.moved(bodies, wrench);
        let turned = joint.turned_action(&frame, pose, &here);
        if turned.second_by_first != 0.0 {
            to[(starts[body] + 1, starts[body])] += sign * turned.second_by_first;
        }
        let Some(parent) = joint.parent() else {
            return;
        };
        let spins = own[parent].fixed_rows::<3>(0);
        for (i, by_spin) in turned.by_spin.iter().enumerate() {
            let row = by_spin.transpose() * spins * sign;
            let mut view = to.view_mut((starts[body] + i, starts[parent]), row.shape());
            view += row;
        }
        let [node, from] = [body, parent].map(|k| bodies[k].pose.translation.vector);
        let arm = node + lever - from;
        let turned = lever_turned(&arm, &n) * sign;
        add(
            to,
            (starts[parent], starts[parent]),
            &turned,
            [&own[parent]; 2],
        );
        for (i, couple) in joint.slid(&frame, &n) {
            let column = spins.tr_mul(&couple) * sign;
            let mut view = to.view_mut((starts[parent], starts[body] + i), column.shape());
            view += column;
        }
    }

    /// Wrench on each body, rods and loads together, about its reference point, in the body's own velocities: three
    /// components for a point mass; in a groove the last is the force along the groove. 0 at an equilibrium.
    pub fn balance(&self, t: f64, bodies: &[BodyMotion], points: &[LinkPoint]) -> DVector<f64> {
        let (wrenches, own) = (self.wrenches(bodies, points), self.own_twists(bodies));
        let all = self
            .carriers()
            .iter()
            .zip(bodies)
            .zip(wrenches.iter().zip(&own));
        let parts = all.map(|((carrier, place), (wrench, own))| {
            let mut part = own.tr_mul(&(wrench + carrier.load(t, &place.pose)));
            if let Some(guide) = carrier.guide() {
                let actions = guide.actions(&guide.frame(t, bodies), &place.pose);
                part += DVector::from_vec(actions);
            }
            part
        });
        let parts: Vec<f64> = parts
            .flat_map(|part| part.iter().copied().collect::<Vec<_>>())
            .collect();
        DVector::from_vec(parts)
    }

    /// Stiffness matrix, mass matrix and damping about a configuration at rest.
    ///
    /// # Errors
    /// A rod at its fold, with its number.
    pub fn stiffness(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        points: &[LinkPoint],
    ) -> Result<Stiffness> {
        let (starts, total) = self.freedoms();
        let mut sum = Stiffness {
            matrix: DMatrix::zeros(total, total),
            mass: DMatrix::zeros(total, total),
            damping: DMatrix::zeros(total, total),
            charts: DMatrix::zeros(6 * points.len(), total),
        };
        let own = self.own_twists(bodies);
        let charts = Matrix6xX::identity(6);
        for (k, (link, point)) in self.links().iter().zip(points).enumerate() {
            let (by, chart) = point.linear(link).ok_or_else(|| {
                Error::ill_conditioned(format!(
                    "{} is exactly at a fold, or straight and inextensible: it has no stiffness there; use the compliance, \
                     move the configuration a little, or let the rod stretch",
                    self.rod_name(k)
                ))
            })?;
            let sites = [&link.from, &link.to];
            let ends = sites.map(|site| self.twists_of(site, bodies, (&starts, &own)));
            for (i, rows) in ends.iter().enumerate() {
                for (j, columns) in ends.iter().enumerate() {
                    let block = -by.fixed_view::<6, 6>(6 * i, 6 * j);
                    for (row, twists) in rows {
                        for (column, others) in columns {
                            let at = (*row, *column);
                            add(&mut sum.matrix, at, &block, [twists, others]);
                        }
                    }
                }
                let known = (&starts[..], &own[..]);
                let wrench = &point.wrenches()[i];
                self.add_turned(&mut sum.matrix, -1.0, (sites[i], bodies, known), wrench);
            }
            for (j, columns) in ends.iter().enumerate() {
                let block = chart.fixed_columns::<6>(6 * j).into_owned();
                for (column, others) in columns {
                    add(&mut sum.charts, (6 * k, *column), &block, [&charts, others]);
                }
            }
        }
        for (start, carrier) in starts.iter().zip(self.carriers()) {
            let laws = carrier.guide().into_iter().flat_map(Guide::stiffnesses);
            for (i, stiffness) in laws.enumerate() {
                sum.matrix[(start + i, start + i)] += stiffness;
            }
        }
        let parts = self.linear_bodies(t, bodies, points)?;
        for ([mass, by_pose, by_velocity], start) in parts.into_iter().zip(starts) {
            let size = mass.shape();
            let mut view = sum.matrix.view_mut((start, start), size);
            view -= by_pose;
            let mut view = sum.damping.view_mut((start, start), size);
            view -= by_velocity;
            sum.mass.view_mut((start, start), size).copy_from(&mass);
        }
        Ok(sum)
    }

    /// Mass matrix of each body, and derivatives of its loads by pose and velocity, in its own velocities.
    fn linear_bodies(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        points: &[LinkPoint],
    ) -> Result<Vec<[DMatrix<f64>; 3]>> {
        let (wrenches, own) = (self.wrenches(bodies, points), self.own_twists(bodies));
        let all = self.carriers().iter().zip(bodies);
        let parts = all
            .zip(wrenches.iter().zip(&own))
            .map(|((carrier, place), (wrench, own))| {
                let linear = carrier.linear_own(t, &place.pose, wrench, own);
                linear.ok_or_else(|| Error::ill_conditioned("a body without inertia"))
            });
        parts.collect()
    }

    /// Minus the derivative of the balance by the velocities.
    pub(super) fn damping(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
    ) -> Result<DMatrix<f64>> {
        let (starts, total) = self.freedoms();
        let mut matrix = DMatrix::zeros(total, total);
        let parts = self.linear_bodies(0.0, &now.bodies, points)?;
        for ([_, _, by_velocity], start) in parts.iter().zip(starts) {
            let mut view = matrix.view_mut((start, start), by_velocity.shape());
            view -= by_velocity;
        }
        Ok(matrix)
    }

    /// The mass matrix M about the reference points.
    pub(super) fn mass_matrix(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
    ) -> Result<DMatrix<f64>> {
        let (starts, total) = self.freedoms();
        let mut matrix = DMatrix::zeros(total, total);
        for ([mass, ..], start) in self
            .linear_bodies(0.0, &now.bodies, points)?
            .iter()
            .zip(starts)
        {
            matrix
                .view_mut((start, start), mass.shape())
                .copy_from(mass);
        }
        Ok(matrix)
    }

    /// Morse index of the assembly with the bodies free: the rods' indices with their ends held plus the negative
    /// eigenvalues of the stiffness (Haynsworth). 0 is stable. An eigenvalue within the tolerance of zero, relative
    /// to the largest, is neutral and does not count. With a straight inextensible rod there is no stiffness, and the
    /// frequencies decide.
    ///
    /// # Errors
    /// As [`super::Link::index`]; a configuration with neither stiffness nor compliance.
    pub fn index(&self, t: f64, now: &Configuration, tolerance: f64) -> Result<usize> {
        let points = self.points(t, &now.bodies, &now.charts, tolerance)?;
        let negative = match self.stiffness(t, &now.bodies, &points) {
            _ if self.freedoms().1 == 0 => 0,
            Ok(stiffness) => {
                let mut matrix = stiffness.matrix;
                // Motions that a symmetry leaves free count as held: rounding could make their stiffness negative.
                let free = self.free_displacements(now, &points);
                let size = matrix.amax();
                for z in free.column_iter() {
                    matrix += z * z.transpose() * (size / z.norm_squared().max(f64::MIN_POSITIVE));
                }
                self.negative(&matrix, tolerance)
            }
            Err(_) => {
                // The index does not depend on the masses: nodes count with a mass of their own.
                let all: Vec<usize> = (0..self.freedoms().1).collect();
                let root = self.mass_root(now, &points, &all)?;
                let soft = self.soft_modes(now, &points, (&root, &all), tolerance)?;
                let below = -10.0 * tolerance * soft.shift;
                soft.squares.iter().filter(|x| **x < below).count()
            }
        };
        let rods = self.links().iter().zip(&points).zip(&now.charts);
        let held = rods
            .map(|((link, point), q)| {
                let seen = link.seen_at(t, &point.base.pose.rotation)?;
                seen.index(q, &point.held(), tolerance)
            })
            .sum::<Result<usize>>()?;
        Ok(held + negative)
    }

    /// Number of negative eigenvalues of a stiffness, beyond rounding.
    fn negative(&self, matrix: &DMatrix<f64>, tolerance: f64) -> usize {
        let mut scaled = (matrix + matrix.transpose()) * 0.5;
        // Scales rows and columns alike to comparable size, as far as they exceed rounding. Congruence keeps the
        // signs.
        let congruent = |scaled: &mut DMatrix<f64>, i: usize, factor: f64| {
            scaled.row_mut(i).scale_mut(factor);
            scaled.column_mut(i).scale_mut(factor);
        };
        for i in self.rotations() {
            congruent(&mut scaled, i, 1.0 / self.scales().0);
        }
        let largest = scaled.amax();
        for i in 0..scaled.nrows() {
            let own = scaled[(i, i)].abs().max(1e-6 * largest);
            congruent(&mut scaled, i, 1.0 / own.sqrt());
        }
        let values = scaled.symmetric_eigenvalues();
        let zero = 10.0 * tolerance * values.amax();
        values.iter().filter(|x| **x < -zero).count()
    }
}

/// Adds a block from twists to wrenches as one in the velocities of row and column.
pub(super) fn add(
    to: &mut DMatrix<f64>,
    at: (usize, usize),
    block: &Matrix6<f64>,
    own: [&Matrix6xX<f64>; 2],
) {
    let projected = own[0].tr_mul(&(block * own[1]));
    let mut view = to.view_mut(at, projected.shape());
    view += projected;
}
