//! Light rods whose ends have joints with axes, in motion: chart and coordinates of the joints together (theory 3.3).
//!
//! A rod without mass turns its joints until no couple is left about their axes. The twist of the end relative to the
//! base as the carriers move is xi. The actions A of the rod and of the laws about the axes change by b as the carriers
//! move. Chart q and coordinates y obey
//! ```text
//! J q' - D y' = xi,       A_q q' + A_y y' = -b.
//! ```
//! The matrix is singular at the folds of the rod with its joints. An axis with viscous friction c has c y' = A
//! instead of its row: its angle does not change while a rod snaps.

use super::body::BodyMotion;
use super::configuration::Evaluated;
use super::guide::Guide;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use crate::error::{Error, Message, Result};
use crate::manifold::adjugate_times;
use crate::math::se3::{halves, join};
use crate::rod::Wrench;
use nalgebra::{DMatrix, DVector, Matrix6xX, SMatrix, SVector};

/// Largest number of unknowns: the chart, and three freedoms at each end.
pub(super) const UNKNOWNS: usize = 12;
/// Largest number of Newton steps to a configuration of a rod, and the change of the unknowns that ends them.
const STEPS: usize = 30;
const SHORT: f64 = 1e-13;

/// A rod with the nodes of the joints at both ends.
pub(super) struct JointedRod<'a> {
    pub link: &'a Link,
    /// For base and end: the node's number, its joint, and the index of its first coordinate among those of the rod.
    pub ends: [Option<(usize, &'a Guide, usize)>; 2],
    /// Number of coordinates.
    pub count: usize,
}

/// Linear equations of a rod in dimensionless unknowns: the chart, then angles and shifts over the rod's length.
pub(super) struct JointedEquations {
    /// Matrix; 1 on the diagonal beyond the unknowns.
    pub matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Right-hand side of the rates.
    pub drive: SVector<f64, UNKNOWNS>,
    /// Right-hand side of a Newton step onto the attachments.
    pub gap: SVector<f64, UNKNOWNS>,
    /// Loss to viscous friction in the joints.
    pub loss: f64,
}

impl Assembly {
    /// Rod `k` with its joints; `None` without axes.
    pub(super) fn jointed(&self, k: usize) -> Option<JointedRod<'_>> {
        let link = self.links.get(k)?;
        let mut count = 0;
        let ends = [&link.from, &link.to].map(|site| {
            let node = site.carried_by()?;
            let guide = self.carriers[node].joint()?;
            count += guide.turnings() + guide.shiftings();
            Some((node, guide, count - guide.turnings() - guide.shiftings()))
        });
        (count > 0).then_some(JointedRod { link, ends, count })
    }

    /// True if rod `k` has a joint with axes.
    pub fn is_jointed(&self, k: usize) -> bool {
        self.jointed(k).is_some()
    }

    /// True if a rod has a joint with axes.
    pub fn has_joints(&self) -> bool {
        self.carriers
            .iter()
            .any(|carrier| carrier.joint().is_some())
    }

    /// Determinants that vanish at the folds of the rods, as in [`super::RodMonitor`].
    pub fn fold_determinants(&self, at: &Evaluated) -> Vec<f64> {
        let points = at.points.iter().enumerate();
        let dets = points.map(|(k, point)| match self.jointed(k) {
            None => point.end.jacobian.determinant(),
            Some(rod) => {
                let equations = rod.equations(at.integrals.time, &at.now.bodies, point);
                adjugate_times(&equations.matrix, &equations.drive).0
            }
        });
        dets.collect()
    }

    /// The configuration with the rates of the joints in the twists of their nodes; where a rod stands at a fold,
    /// nodes move with their carriers.
    #[must_use]
    pub fn with_joint_rates(&self, mut at: Evaluated) -> Evaluated {
        for k in 0..self.links.len() {
            let Some(rod) = self.jointed(k) else { continue };
            let (t, point) = (at.integrals.time, &at.points[k]);
            let equations = rod.equations(t, &at.now.bodies, point);
            let Some(found) = equations.matrix.full_piv_lu().solve(&equations.drive) else {
                continue;
            };
            let y = rod.coordinates_of(&found);
            for (end, (node, guide, first)) in rod.nodes() {
                let frame = guide.frame(t, &at.now.bodies);
                let own = guide.twists(&frame, &at.now.bodies[node].pose);
                let more = &own * y.rows(first, own.ncols());
                at.now.bodies[node].twist += more;
                let point = &mut at.points[k];
                match end {
                    0 => point.base.twist += more,
                    _ => point.tip.twist += more,
                }
            }
        }
        at
    }

    /// Morse index of rod `k` with the carriers of its joints held: that of the rod with its ends held, and the
    /// negative directions of its joints. Axes with friction are held.
    ///
    /// # Errors
    /// As [`Link::index`].
    pub fn index_of_rod(&self, k: usize, at: &Evaluated, tolerance: f64) -> Result<usize> {
        let (t, point, q) = (at.integrals.time, &at.points[k], &at.now.charts[k]);
        let seen = self.links[k].seen_at(t, &point.base.pose.rotation)?;
        let held = seen.index(q, &point.held(), tolerance)?;
        let Some(rod) = self.jointed(k) else {
            return Ok(held);
        };
        let free = rod.free();
        if free.is_empty() {
            return Ok(held);
        }
        let equations = rod.equations(t, &at.now.bodies, point);
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                equations.matrix[(rows[i], columns[j])]
            })
        };
        let chart: Vec<usize> = (0..6).collect();
        let follows = part(&chart, &chart)
            .full_piv_lu()
            .solve(&part(&chart, &free));
        let follows = follows.ok_or_else(|| {
            Error::ill_conditioned(format!(
                "{} with its ends held stands at a fold, where the index of its joints is undefined",
                self.rod_name(k)
            ))
        })?;
        // The action falls with its coordinate where the joint is stable.
        let stiffness = part(&free, &chart) * follows - part(&free, &free);
        let values = (&stiffness + stiffness.transpose()).symmetric_eigenvalues();
        let zero = 10.0 * tolerance * (1.0 + values.amax());
        Ok(held + values.iter().filter(|x| **x < -zero).count())
    }

    /// Newton's method for the chart and the joints of rod `k` with the carriers held, from a configuration of all
    /// bodies and the chart `q`.
    ///
    /// # Errors
    /// No convergence.
    pub(super) fn polished_jointed(
        &self,
        k: usize,
        (t, bodies): (f64, &[BodyMotion]),
        q: &Wrench,
        tolerance: f64,
    ) -> Result<(Wrench, Vec<BodyMotion>)> {
        let rod = self
            .jointed(k)
            .ok_or_else(|| Error::domain("the rod has no joints"))?;
        let (mut q, mut bodies) = (*q, bodies.to_vec());
        let link = rod.link.with_chart_by_pull();
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let point = link.point(t, &bodies, &q, tolerance)?;
            let equations = rod.equations(t, &bodies, &point);
            let size = equations.gap.amax();
            let change = equations.matrix.full_piv_lu().solve(&equations.gap);
            let Some(change) = change.filter(|_| size.is_finite()) else {
                break;
            };
            let scale = 1.0 + q.amax();
            if change.amax() < SHORT * scale || (size <= 1e2 * tolerance && size >= 0.5 * last) {
                return Ok((q, bodies));
            }
            // Far from the solution a full step would lead anywhere.
            let part = (0.3 * scale / change.amax()).min(1.0);
            q += change.fixed_rows::<6>(0) * part;
            rod.move_by(t, &mut bodies, &(rod.coordinates_of(&change) * part));
            last = size;
        }
        Err(Error::no_convergence(
            Message::from(format!(
                "no equilibrium of {} with its joints was found near ",
                self.rod_name(k)
            ))
            .then(self.links()[k].told_wrench(&q))
            .words(" at its base; take a smaller tolerance, or give the rod its mass in full"),
        ))
    }
}

impl JointedEquations {
    /// Largest action left in a joint without friction, in B/L and B/L^2.
    pub fn unbalanced(&self) -> f64 {
        self.gap.rows(6, UNKNOWNS - 6).amax()
    }
}

impl<'a> JointedRod<'a> {
    /// Nodes, each with its end: 0 for the base, 1 for the end.
    pub fn nodes(&self) -> impl Iterator<Item = (usize, (usize, &'a Guide, usize))> {
        let ends = self.ends.iter().enumerate();
        ends.filter_map(|(end, node)| Some((end, (*node)?)))
    }

    /// Indices among the unknowns of the coordinates without friction.
    pub fn free(&self) -> Vec<usize> {
        let all = self.nodes().flat_map(|(_, (_, guide, first))| {
            let laws = guide.laws().iter().enumerate();
            laws.filter(|(_, law)| law.damping == 0.0)
                .map(move |(a, _)| 6 + first + a)
        });
        all.collect()
    }

    /// Units of the coordinates: 1 for angles, the rod's length for shifts.
    pub fn units(&self) -> DVector<f64> {
        let length = self.link.rod.length();
        let mut units = DVector::from_element(self.count, 1.0);
        for (_, (_, guide, first)) in self.nodes() {
            units
                .rows_mut(first + guide.turnings(), guide.shiftings())
                .fill(length);
        }
        units
    }

    /// Coordinates, or their rates, from the dimensionless unknowns.
    pub fn coordinates_of(&self, unknowns: &SVector<f64, UNKNOWNS>) -> DVector<f64> {
        let own = DVector::from_column_slice(&unknowns.as_slice()[6..6 + self.count]);
        own.component_mul(&self.units())
    }

    /// Newton step of the unknowns onto the attachments, with no action left in the joints.
    pub fn correction(&self, at: &Evaluated, point: &LinkPoint) -> Option<SVector<f64, UNKNOWNS>> {
        let equations = self.equations(at.integrals.time, &at.now.bodies, point);
        equations.matrix.full_piv_lu().solve(&equations.gap)
    }

    /// Moves the nodes by changes of their coordinates.
    pub fn move_by(&self, t: f64, bodies: &mut [BodyMotion], by: &DVector<f64>) {
        for (_, (node, guide, first)) in self.nodes() {
            let frame = guide.frame(t, bodies);
            let by = &by.as_slice()[first..first + guide.turnings() + guide.shiftings()];
            let pose = guide.moved((&frame, &bodies[node].pose), &frame, by);
            let y = guide.coordinates(&frame, &pose);
            bodies[node] = guide.carried(t, bodies, &y);
        }
    }

    /// The equations at time `t`; nodes move with their carriers in `bodies` and in `point`.
    pub fn equations(&self, t: f64, bodies: &[BodyMotion], point: &LinkPoint) -> JointedEquations {
        let link = self.link;
        let scale = link.gap_scale(&point.end);
        let units = self.units();
        let (couple, force) = (1.0 / link.units()[0], 1.0 / link.units()[3]);
        let twists: [Option<Matrix6xX<f64>>; 2] = self.ends.map(|end| {
            let (node, guide, first) = end?;
            let mut own = guide.twists(&guide.frame(t, bodies), &bodies[node].pose);
            for (mut column, unit) in own
                .column_iter_mut()
                .zip(units.rows(first, units.len() - first).iter())
            {
                column *= *unit;
            }
            Some(own)
        });
        let mut equations = JointedEquations {
            matrix: SMatrix::identity(),
            drive: SVector::zeros(),
            gap: SVector::zeros(),
            loss: 0.0,
        };
        let JointedEquations {
            matrix,
            drive,
            gap,
            loss,
        } = &mut equations;
        let by_twists = scale * point.drive_by_twists();
        matrix
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(&(scale * point.end.jacobian));
        drive
            .fixed_rows_mut::<6>(0)
            .copy_from(&(scale * point.drive()));
        gap.fixed_rows_mut::<6>(0).copy_from(&(scale * point.gap()));
        if point.end.is_taut() {
            // The couples of a taut rod follow from its force.
            gap.fixed_rows_mut::<3>(0).fill(0.0);
        }
        for (end, (_, _, first)) in self.nodes() {
            if let Some(own) = &twists[end] {
                let columns = -by_twists.fixed_columns::<6>(6 * end) * own;
                matrix
                    .view_mut((0, 6 + first), columns.shape())
                    .copy_from(&columns);
            }
        }
        let (by_chart, by_turns) = (point.wrenches_by_chart(), point.wrenches_by_turns());
        let wrenches = point.wrenches();
        let mut moving = SVector::<f64, 12>::zeros();
        moving.fixed_rows_mut::<6>(0).copy_from(&point.base.twist);
        moving.fixed_rows_mut::<6>(6).copy_from(&point.tip.twist);
        let turned_wrenches = by_turns * moving;
        for (end, (node, guide, first)) in self.nodes() {
            let Some(own) = &twists[end] else { continue };
            let frame = guide.on().at(t, bodies);
            let (pose, spin) = (&bodies[node].pose, halves(&frame.twist).0);
            let turned = guide.turned_action(&frame.pose, pose, &wrenches[end]);
            let laws = guide.actions(&frame.pose, pose);
            for (a, law) in guide.laws().iter().enumerate() {
                let (row, unit) = (6 + first + a, units[first + a]);
                let along = own.column(a) / unit;
                let action = along.dot(&wrenches[end]) + laws[a];
                if law.damping > 0.0 {
                    drive[row] = action / (law.damping * unit);
                    *loss += action * action / law.damping;
                    continue;
                }
                let weight = if a < guide.turnings() { couple } else { force };
                let along = along * weight;
                matrix[(row, row)] = 0.0;
                let by = along.tr_mul(&by_chart.fixed_rows::<6>(6 * end));
                matrix.fixed_view_mut::<1, 6>(row, 0).copy_from(&by);
                for (other, (_, _, from)) in self.nodes() {
                    let Some(others) = &twists[other] else {
                        continue;
                    };
                    let block = by_turns.fixed_view::<6, 6>(6 * end, 6 * other);
                    let by = along.tr_mul(&(block * others));
                    matrix.view_mut((row, 6 + from), by.shape()).copy_from(&by);
                }
                if a == 1 {
                    matrix[(row, row - 1)] += turned.second_by_first * weight;
                }
                matrix[(row, row)] -= law.stiffness * unit * weight;
                let changed = along.dot(&turned_wrenches.fixed_rows::<6>(6 * end));
                drive[row] = -changed - turned.by_spin[a].dot(&spin) * weight;
                gap[row] = -action * weight;
            }
        }
        equations
    }
}

impl Guide {
    /// The node at the coordinates `y`, moving with the carrier.
    pub(super) fn carried(&self, t: f64, bodies: &[BodyMotion], y: &[f64]) -> BodyMotion {
        let frame = self.on().at(t, bodies);
        let pose = self.pose(&frame.pose, y);
        let (omega, v) = halves(&frame.twist);
        let arm = pose.translation.vector - frame.pose.translation.vector;
        BodyMotion {
            pose,
            twist: join(&omega, &(v + omega.cross(&arm))),
        }
    }
}
