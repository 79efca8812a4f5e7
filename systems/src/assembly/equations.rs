//! Equations of statics of an assembly and their Jacobian, in dimensionless unknowns.
//!
//! ```text
//! balance of every body = 0,       gap of every rod = 0
//! ```
//! The unknowns are the rotation vectors and displacements of the bodies from a reference frame, and the charts of
//! the rods. Together they are regular at the fold of a single rod, and for straight inextensible rods.

use super::body::BodyMotion;
use super::configuration::Configuration;
use super::guide::Guide;
use super::network::Assembly;
use super::rod_element::{EndKind, Link, LinkPoint};
use super::stiffness::add;
use crate::error::{Error, Result};
use crate::math::se3::{halves, inverse_left_jacobian, left_jacobian};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Matrix6xX, UnitQuaternion, Vector3, Vector6};

/// Bounds on the couples and forces (in B/L, B/L^2) in the chart of a rod that is not taut. Beyond them an
/// integration from the base is worthless and costly.
const WILD: (f64, f64) = (400.0, 2e4);
/// Bound on rotation vectors, which are singular at a full turn.
const TURNED: f64 = 6.0;

/// Relative pivot below which a pivot is rounding: those of rods bent by an angle a are as small as a^2, and their
/// terms are known to 1e-14 or so.
const SINGULAR: f64 = 1e-13;

/// Scales of the unknowns: x = (rotation vector, displacement/length) from the reference of each body, then charts.
#[derive(Debug, Clone)]
pub(super) struct UnknownScales {
    reference: Vec<BodyMotion>,
    length: f64,
    couple: f64,
}

impl UnknownScales {
    pub(super) fn new(
        assembly: &Assembly,
        reference: impl Iterator<Item = Isometry3<f64>>,
    ) -> Self {
        let (length, couple) = assembly.scales();
        Self {
            reference: reference.map(BodyMotion::at_rest).collect(),
            length,
            couple,
        }
    }

    /// Unknowns of a configuration.
    pub(super) fn unknowns(&self, assembly: &Assembly, now: &Configuration) -> DVector<f64> {
        let mut x = Vec::new();
        for ((carrier, place), from) in assembly
            .carriers()
            .iter()
            .zip(&now.bodies)
            .zip(&self.reference)
        {
            if let Some(guide) = carrier.guide() {
                let frames = [
                    guide.frame(0.0, &self.reference),
                    guide.frame(0.0, &now.bodies),
                ];
                let moved = guide.between((&frames[0], &from.pose), (&frames[1], &place.pose));
                let each = moved.iter().enumerate();
                x.extend(each.map(|(i, y)| {
                    if i < guide.turnings() {
                        *y
                    } else {
                        y / self.length
                    }
                }));
                continue;
            }
            let from = &from.pose;
            if carrier.turns() {
                let turn = place.pose.rotation * from.rotation.inverse();
                x.extend(turn.scaled_axis().iter());
            }
            match carrier.slid(from, &place.pose) {
                Some(slid) => x.push(slid / self.length),
                None => {
                    let shift = place.pose.translation.vector - from.translation.vector;
                    x.extend((shift / self.length).iter());
                }
            }
        }
        x.extend(now.charts.iter().flat_map(|q| q.iter()));
        for i in assembly.out_of_plane() {
            x[i] = 0.0;
        }
        DVector::from_vec(x)
    }

    /// Configuration, at rest, from the unknowns.
    pub(super) fn configuration(&self, assembly: &Assembly, x: &[f64]) -> Configuration {
        let (starts, total) = assembly.freedoms();
        let mut own = x[..total].to_vec();
        for (start, carrier) in starts.iter().zip(assembly.carriers()) {
            let shift = &mut own[start + carrier.turnings()..start + carrier.freedoms()];
            shift.iter_mut().for_each(|x| *x *= self.length);
        }
        Configuration {
            bodies: assembly.displaced(&self.reference, &own),
            charts: assembly
                .links()
                .iter()
                .zip(x[total..].chunks(6))
                .map(|(link, q)| {
                    let mut q = Vector6::from_column_slice(q);
                    link.out_of_plane().for_each(|i| q[i] = 0.0);
                    q
                })
                .collect(),
            spins: Vec::new(),
        }
    }

    /// Residual at a configuration with evaluated rods.
    pub(super) fn residual(
        &self,
        assembly: &Assembly,
        bodies: &[BodyMotion],
        points: &[LinkPoint],
    ) -> DVector<f64> {
        let balance = assembly.balance(0.0, bodies, points);
        let total = balance.len();
        let mut residual = DVector::zeros(total + 6 * points.len());
        let force = self.couple / self.length;
        residual.rows_mut(0, total).copy_from(&(balance / force));
        for i in assembly.rotations() {
            residual[i] /= self.length;
        }
        for (k, (link, point)) in assembly.links().iter().zip(points).enumerate() {
            let gap = statical_scale(link, point) * point.gap();
            residual.rows_mut(total + 6 * k, 6).copy_from(&gap);
        }
        for i in assembly.out_of_plane() {
            residual[i] = 0.0;
        }
        residual
    }

    /// Derivative of the residual by the unknowns.
    pub(super) fn jacobian(
        &self,
        assembly: &Assembly,
        x: &[f64],
        bodies: &[BodyMotion],
        points: &[LinkPoint],
    ) -> DMatrix<f64> {
        let (starts, total) = assembly.freedoms();
        let mut matrix = assembly.twist_jacobian(bodies, points);
        let force = self.couple / self.length;
        matrix.rows_mut(0, total).scale_mut(1.0 / force);
        for i in assembly.rotations() {
            matrix.row_mut(i).scale_mut(1.0 / self.length);
        }
        let all = starts.iter().zip(assembly.carriers());
        let all = all.zip(bodies.iter().zip(&self.reference));
        for ((start, carrier), (place, from)) in all {
            if carrier.guide().map_or(carrier.turns(), Guide::is_ball) {
                let turn = left_jacobian(&Vector3::from_column_slice(&x[*start..start + 3]));
                let mut columns = matrix.columns_mut(*start, 3);
                let turned = &columns * turn;
                columns.copy_from(&turned);
            }
            let (shift, count) = (start + carrier.turnings(), carrier.shiftings());
            let stretch = self.length * carrier.stretch(&from.pose, &place.pose);
            matrix.columns_mut(shift, count).scale_mut(stretch);
        }
        for i in assembly.out_of_plane() {
            matrix.row_mut(i).fill(0.0);
            matrix.column_mut(i).fill(0.0);
            matrix[(i, i)] = 1.0;
        }
        matrix
    }

    /// Twists of all bodies, in their own velocities, from the rates of the unknowns at the reference.
    pub(super) fn twists(&self, assembly: &Assembly, x: &DVector<f64>) -> DVector<f64> {
        let total = assembly.freedoms().1;
        let mut twists = x.rows(0, total) * self.length;
        for i in assembly.rotations() {
            twists[i] = x[i];
        }
        twists
    }

    /// Rates of the bodies' unknowns at the reference from their twists.
    pub(super) fn rates(&self, assembly: &Assembly, twists: &DVector<f64>) -> DVector<f64> {
        let mut x = twists / self.length;
        for i in assembly.rotations() {
            x[i] = twists[i];
        }
        x
    }

    /// Twists against which the equations of balance, weighted by `l`, are a power.
    pub(super) fn against(&self, assembly: &Assembly, l: &DVector<f64>) -> DVector<f64> {
        let force = self.couple / self.length;
        let mut twists = l.rows(0, assembly.freedoms().1) / force;
        for i in assembly.rotations() {
            twists[i] /= self.length;
        }
        twists
    }

    /// Refuses unknowns too far from any solution.
    pub(super) fn check(&self, assembly: &Assembly, x: &[f64], now: &Configuration) -> Result<()> {
        let (starts, _) = assembly.freedoms();
        for (body, (start, carrier)) in starts.iter().zip(assembly.carriers()).enumerate() {
            let turnings = &x[*start..start + carrier.turnings()];
            let turn = turnings.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(turn < TURNED) {
                return Err(Error::domain(format!(
                    "{} has turned by {turn:.1} radians from where the search began, near a full turn",
                    carrier.called(body)
                )));
            }
        }
        for (k, (link, q)) in assembly.links().iter().zip(&now.charts).enumerate() {
            let (m, n) = halves(q);
            let [base, tip] = [link.from(), link.to()].map(|site| site.at(0.0, &now.bodies).pose);
            let held = base.inv_mul(&tip);
            let finite = n.iter().all(|x| x.is_finite());
            let taut = finite && link.with_base_rotation(&base.rotation).is_taut(q, &held);
            if !(taut || m.norm() < WILD.0 && n.norm() < WILD.1) {
                return Err(Error::ill_conditioned(format!(
                    "{} would bear the couple {:.1e} and the force {:.1e} at its base, in B/L and B/L^2; {:.0e} and {:.0e} are the \
                     most that can be integrated from there",
                    assembly.rod_name(k),
                    m.norm(),
                    n.norm(),
                    WILD.0,
                    WILD.1
                )));
            }
        }
        Ok(())
    }
}

/// Scales of the gap of a rod in the equations of statics. The sign of a taut rod gives their determinant
/// the sign of the chart of the base wrench. A branch may then change from one chart to the other.
fn statical_scale(link: &Link, point: &LinkPoint) -> Matrix6<f64> {
    let mut scale = link.gap_scale(&point.end);
    if let Some(taut) = point.end.taut() {
        scale.fixed_columns_mut::<3>(0).scale_mut(taut.sign);
    }
    scale
}

impl LinkPoint {
    /// Derivatives of the gap by twists of base and end, and by the chart.
    fn gap_derivatives(&self) -> (nalgebra::SMatrix<f64, 6, 12>, Matrix6<f64>) {
        let mut by_twists = self.drive_by_twists();
        let mut by_chart = -self.end.jacobian;
        if matches!(self.end.kind, EndKind::Welded { .. }) {
            // The gap is log W, W = (wanted rotation) R(1)^T; dW is the spin of the wanted rotation minus W times
            // that of R(1).
            let gap = halves(&self.gap()).0;
            let log = inverse_left_jacobian(&gap);
            let turn = UnitQuaternion::from_scaled_axis(gap).to_rotation_matrix();
            let spins = self.end.tangent;
            if let Some(along) = &self.end.along {
                // The effect of a load on the end as the base turns is a spin of R(1), too.
                let back = self.base.pose.rotation.inverse().to_rotation_matrix();
                let spun = along.turned.fixed_rows::<3>(0) * back.matrix();
                let mut turns = by_twists.fixed_view_mut::<3, 3>(0, 0);
                turns += spun - turn.matrix() * spun;
            }
            let first = log * by_twists.fixed_rows::<3>(0);
            by_twists.fixed_rows_mut::<3>(0).copy_from(&first);
            let first = -(log * turn.matrix()) * spins.fixed_rows::<3>(0);
            by_chart.fixed_rows_mut::<3>(0).copy_from(&first);
        }
        (by_twists, by_chart)
    }
}

impl Assembly {
    /// Derivatives of balance and gaps by the twists of the bodies and the charts of the rods.
    fn twist_jacobian(&self, bodies: &[BodyMotion], points: &[LinkPoint]) -> DMatrix<f64> {
        let (starts, total) = self.freedoms();
        let size = total + 6 * points.len();
        let mut matrix = DMatrix::zeros(size, size);
        let own_twists = self.own_twists(bodies);
        let charts = Matrix6xX::identity(6);
        for (k, (link, point)) in self.links().iter().zip(points).enumerate() {
            let own = total + 6 * k;
            let (gap_by_twists, gap_by_chart) = point.gap_derivatives();
            let scale = statical_scale(link, point);
            add(
                &mut matrix,
                (own, own),
                &(scale * gap_by_chart),
                [&charts; 2],
            );
            let by_chart = point.wrenches_by_chart();
            let by_turn = point.wrenches_by_turns();
            let sites = [&link.from, &link.to];
            let parts = sites.map(|site| self.twists_of(site, bodies, (&starts, &own_twists)));
            for (i, rows) in parts.iter().enumerate() {
                for (start, twists) in rows {
                    let along = scale * gap_by_twists.fixed_columns::<6>(6 * i);
                    add(&mut matrix, (own, *start), &along, [&charts, twists]);
                    let along = by_chart.fixed_rows::<6>(6 * i).into_owned();
                    add(&mut matrix, (*start, own), &along, [twists, &charts]);
                    for (j, columns) in parts.iter().enumerate() {
                        let block = by_turn.fixed_view::<6, 6>(6 * i, 6 * j).into_owned();
                        for (other, others) in columns {
                            add(&mut matrix, (*start, *other), &block, [twists, others]);
                        }
                    }
                }
                let known = (&starts[..], &own_twists[..]);
                self.add_turned(
                    &mut matrix,
                    1.0,
                    (sites[i], bodies, known),
                    &point.wrenches()[i],
                );
            }
        }
        for (start, carrier) in starts.iter().zip(self.carriers()) {
            let laws = carrier.guide().into_iter().flat_map(Guide::stiffnesses);
            for (i, stiffness) in laws.enumerate() {
                matrix[(start + i, start + i)] -= stiffness;
            }
        }
        let wrenches = self.wrenches(bodies, points);
        let all = self.carriers().iter().zip(bodies).zip(&own_twists);
        for (((carrier, place), twists), (start, wrench)) in all.zip(starts.iter().zip(&wrenches)) {
            let [couple, force] = carrier.mass().load_by_turn(0.0, &place.pose);
            let mut turned = Matrix6::zeros();
            turned.fixed_view_mut::<3, 3>(0, 0).copy_from(&couple);
            turned.fixed_view_mut::<3, 3>(3, 0).copy_from(&force);
            add(&mut matrix, (*start, *start), &turned, [twists; 2]);
            // The tangent of a groove turns along the groove.
            if let Some((_, bend)) = carrier.tangent(&place.pose) {
                let last = start + carrier.turnings();
                let load = carrier.load(0.0, &place.pose);
                matrix[(last, last)] += bend.dot(&halves(&(wrench + load)).1);
            }
        }
        matrix
    }

    /// Compliance at an equilibrium: twists of the bodies, and changes of the charts, per small wrench on the bodies.
    /// It exists for straight inextensible rods; the stiffness, its inverse, does not.
    ///
    /// # Errors
    /// A neutral equilibrium, which wrenches move without bound.
    pub fn compliance(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
    ) -> Result<(DMatrix<f64>, DMatrix<f64>)> {
        let total = self.freedoms().1;
        self.held_compliance(now, points, &DMatrix::zeros(total, total))
    }

    /// Compliance with every body also held by springs of the stiffness `held`.
    pub(super) fn held_compliance(
        &self,
        now: &Configuration,
        points: &[LinkPoint],
        held: &DMatrix<f64>,
    ) -> Result<(DMatrix<f64>, DMatrix<f64>)> {
        let total = held.nrows();
        let frame = UnknownScales::new(self, now.bodies.iter().map(|place| place.pose));
        let mut matrix = self.twist_jacobian(&now.bodies, points);
        let mut bodies = matrix.view_mut((0, 0), (total, total));
        bodies -= held;
        // Scales wrenches and displacements to the frame's units: rows and columns become comparable.
        let force = frame.couple / frame.length;
        let (mut by, mut of) = (vec![1.0 / force; total], vec![frame.length; total]);
        for i in self.rotations() {
            (by[i], of[i]) = (1.0 / frame.couple, 1.0);
        }
        let mut right = DMatrix::zeros(matrix.nrows(), total);
        for i in 0..total {
            matrix.row_mut(i).scale_mut(by[i]);
            matrix.column_mut(i).scale_mut(of[i]);
            right[(i, i)] = -by[i];
        }
        let factors = matrix.full_piv_lu();
        let pivots = factors.u().diagonal().abs();
        let mut answer = factors
            .solve(&right)
            .filter(|answer| pivots.min() > SINGULAR * pivots.max() && answer.iter().all(|x| x.is_finite()))
            .ok_or_else(|| {
                Error::ill_conditioned(
                    "the assembly can move without force, or its rods hold each other in more ways than they can deform; let the \
                     rods stretch, or move the configuration a little",
                )
            })?;
        for (i, of) in of.into_iter().enumerate() {
            answer.row_mut(i).scale_mut(of);
        }
        Ok((
            answer.rows(0, total).into_owned(),
            answer.rows(total, 6 * points.len()).into_owned(),
        ))
    }
}
