//! Light rods that joints with axes carry, or that join each other without a body, in motion: their charts and the
//! coordinates of their nodes together (theory 3.3).
//!
//! A joint without mass turns until no couple is left about its axes. A node without mass goes to where its rods and
//! its loads balance. Rods that share nodes form a group. The twists of the rods' ends relative to their bases, as all
//! but the nodes move, are xi. The actions A on the coordinates y of the nodes change by b as all but the nodes move.
//! Charts q and coordinates obey
//! ```text
//! J q' - D y' = xi,       A_q q' + A_y y' = -b.
//! ```
//! The matrix is singular at the folds of the group. An axis with viscous friction c has c y' = A instead of its row:
//! its angle does not change while a rod snaps.

use super::attachment::Attachment;
use super::body::{Body, BodyMotion};
use super::configuration::Evaluated;
use super::guide::Guide;
use super::network::Assembly;
use super::rod_element::{Link, LinkPoint};
use super::stiffness::carried;
use crate::error::{Error, Message, Result};
use crate::manifold::adjugate_times;
use crate::math::se3::{halves, join};
use crate::rod::Wrench;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3xX, Matrix6xX, SMatrix, SVector, Vector3, Vector6,
};

/// Largest number of Newton steps to a configuration of a rod, and the change of the unknowns that ends them.
const STEPS: usize = 30;
const SHORT: f64 = 1e-13;

/// A node of a group.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroupNode {
    /// Number among the bodies.
    pub number: usize,
    /// Index of the first coordinate among those of the group, and the count of coordinates.
    pub first: usize,
    pub count: usize,
    /// Place in the group of the node that carries the joint.
    pub parent: Option<usize>,
}

/// Light rods joined by nodes without mass, with the nodes.
pub(super) struct JoinedRods<'a> {
    /// Rods by number, in growing order. The first one leads the group.
    pub rods: Vec<(usize, &'a Link)>,
    /// Nodes in an order in which each follows the node of its joint.
    pub nodes: Vec<GroupNode>,
    /// Number of coordinates.
    pub count: usize,
    carriers: &'a [Body],
}

/// Linear equations of a group in dimensionless unknowns: the charts, then angles, and shifts over the length of the
/// first rod.
pub(super) struct JoinedEquations {
    /// Matrix.
    pub matrix: DMatrix<f64>,
    /// Right-hand side of the rates.
    pub drive: DVector<f64>,
    /// Right-hand side of a Newton step onto the attachments.
    pub gap: DVector<f64>,
    /// Loss to viscous friction in the joints.
    pub loss: f64,
    /// Number of components of the charts.
    charts: usize,
}

impl Assembly {
    /// The node without mass that an attachment belongs to: the one that carries its joint, if that has no mass.
    fn root(&self, site: &Attachment) -> Option<usize> {
        let massless = |body: &usize| self.carriers[*body].is_massless();
        let node = site.carried_by().filter(massless)?;
        let parent = self.carriers[node].joint().and_then(Guide::parent);
        Some(parent.filter(massless).unwrap_or(node))
    }

    /// Groups of rods that nodes without mass join, by the first rod of each.
    pub(super) fn joined(&self) -> Vec<JoinedRods<'_>> {
        if !self.has_nodes() {
            return Vec::new();
        }
        let roots = self.links.iter();
        let roots: Vec<[Option<usize>; 2]> = roots
            .map(|link| [&link.from, &link.to].map(|site| self.root(site)))
            .collect();
        let mut leaders: Vec<usize> = (0..roots.len()).collect();
        for k in 0..roots.len() {
            for other in 0..k {
                let meets = |root: &Option<usize>| root.is_some() && roots[other].contains(root);
                if roots[k].iter().any(meets) {
                    let [a, b] = [leaders[k], leaders[other]];
                    leaders[..=k]
                        .iter_mut()
                        .filter(|leader| **leader == a || **leader == b)
                        .for_each(|leader| *leader = a.min(b));
                }
            }
        }
        let leads = (0..roots.len()).filter(|k| leaders[*k] == *k);
        let groups = leads.map(|k| {
            let rods = (k..roots.len()).filter(|rod| leaders[*rod] == k);
            self.group(rods.map(|rod| (rod, &self.links[rod])).collect())
        });
        groups.filter(|group| group.count > 0).collect()
    }

    /// The group of some rods.
    fn group<'a>(&'a self, rods: Vec<(usize, &'a Link)>) -> JoinedRods<'a> {
        let mut group = JoinedRods {
            rods,
            nodes: Vec::new(),
            count: 0,
            carriers: &self.carriers,
        };
        let sites = group.rods.clone().into_iter();
        for site in sites.flat_map(|(_, link)| [&link.from, &link.to]) {
            let Some(root) = self.root(site) else {
                continue;
            };
            let parent = group.with_node(root, None);
            if let Some(node) = site.carried_by().filter(|node| *node != root) {
                group.with_node(node, Some(parent));
            }
        }
        group
    }

    /// The group that rod `k` belongs to; `None` of a rod without joints and nodes.
    pub(super) fn joined_with(&self, k: usize) -> Option<JoinedRods<'_>> {
        let mut groups = self.joined().into_iter();
        groups.find(|group| group.has(k))
    }

    /// True if rod `k` has a joint with axes, or ends on a node without mass.
    pub fn is_jointed(&self, k: usize) -> bool {
        self.joined_with(k).is_some()
    }

    /// True if a rod has a joint with axes.
    pub fn has_joints(&self) -> bool {
        self.carriers
            .iter()
            .any(|carrier| carrier.joint().is_some())
    }

    /// True if a rod has a joint with axes, or ends on a node without mass.
    pub fn has_nodes(&self) -> bool {
        self.carriers.iter().any(Body::is_massless)
    }

    /// Names of rod `k` and of the rods joined to rod `k` by nodes without mass.
    pub fn rods_joined_with(&self, k: usize) -> Vec<String> {
        let group = self.joined_with(k);
        let rods = group.map_or(vec![k], |group| {
            group.rods.iter().map(|(rod, _)| *rod).collect()
        });
        rods.into_iter().map(|rod| self.rod_name(rod)).collect()
    }

    /// Determinants that vanish at the folds of the rods, as in [`super::RodMonitor`]. That of a group is the first
    /// rod's; its other rods have 1.
    pub fn fold_determinants(&self, at: &Evaluated) -> Vec<f64> {
        let points = at.points.iter();
        let mut dets: Vec<f64> = points
            .map(|point| point.end.jacobian.determinant())
            .collect();
        for group in self.joined() {
            let equations = group.equations_at(at);
            for (k, _) in &group.rods {
                dets[*k] = 1.0;
            }
            dets[group.leader()] = adjugate_times(&equations.matrix, &equations.drive).0;
        }
        dets
    }

    /// The configuration with the rates of joints and nodes in the twists of the nodes; where a group stands at a fold,
    /// nodes move with their carriers.
    #[must_use]
    pub fn with_joint_rates(&self, mut at: Evaluated) -> Evaluated {
        for group in self.joined() {
            let equations = group.equations_at(&at);
            let Some(found) = equations.matrix.full_piv_lu().solve(&equations.drive) else {
                continue;
            };
            let y = group.coordinates_of(&found);
            group.set_twists(&mut at, &y);
        }
        at
    }

    /// Morse index of rod `k` with the carriers of its joints held: that of the rod with its ends held, and the
    /// negative directions of its joints. Axes with friction are held. The first rod of a group has the index of the
    /// group, the others 0.
    ///
    /// # Errors
    /// As [`Link::index`].
    pub fn index_of_rod(&self, k: usize, at: &Evaluated, tolerance: f64) -> Result<usize> {
        let held = |k: usize| {
            let (point, q) = (&at.points[k], &at.now.charts[k]);
            let seen = self.links[k].seen_at(at.integrals.time, &point.base.pose.rotation)?;
            seen.index(q, &point.held(), tolerance)
        };
        let Some(group) = self.joined_with(k) else {
            return held(k);
        };
        if group.leader() != k {
            return Ok(0);
        }
        let mut index = 0;
        for (rod, _) in &group.rods {
            index += held(*rod)?;
        }
        let free = group.free();
        if free.is_empty() {
            return Ok(index);
        }
        let equations = group.equations_at(at);
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                equations.matrix[(rows[i], columns[j])]
            })
        };
        let chart: Vec<usize> = (0..equations.charts).collect();
        let follows = part(&chart, &chart)
            .full_piv_lu()
            .solve(&part(&chart, &free));
        let follows = follows.ok_or_else(|| {
            Error::ill_conditioned(format!(
                "{} with its ends held stands at a fold, where the index of its joints is undefined",
                self.rods_joined_with(k).join(", ")
            ))
        })?;
        // The action falls with its coordinate where the joint is stable.
        let stiffness = part(&free, &chart) * follows - part(&free, &free);
        let values = (&stiffness + stiffness.transpose()).symmetric_eigenvalues();
        let zero = 10.0 * tolerance * (1.0 + values.amax());
        Ok(index + values.iter().filter(|x| **x < -zero).count())
    }

    /// Newton's method for the chart and the joints of rod `k`, which shares no node with another rod. The carriers
    /// are held. The method begins at a configuration of all bodies and the chart `q`.
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
        let group = self
            .joined_with(k)
            .ok_or_else(|| Error::domain("the rod has no joints"))?;
        let (mut q, mut bodies) = (*q, bodies.to_vec());
        let link = self.links[k].with_chart_by_pull();
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let point = link.point(t, &bodies, &q, tolerance)?;
            let equations = group.equations(t, &bodies, &[&point]);
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
            group.move_by(t, &mut bodies, &(group.coordinates_of(&change) * part));
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

impl JoinedEquations {
    /// Largest action left on a coordinate without friction, in B/L and B/L^2 of the first rod.
    pub fn unbalanced(&self) -> f64 {
        let actions = self.gap.rows(self.charts, self.gap.len() - self.charts);
        actions.amax()
    }
}

impl JoinedRods<'_> {
    /// Number of the first rod.
    pub fn leader(&self) -> usize {
        self.rods[0].0
    }

    /// True if rod `k` is one of the group.
    pub fn has(&self, k: usize) -> bool {
        self.rods.iter().any(|(rod, _)| *rod == k)
    }

    /// True if rods join each other without a body.
    pub fn is_frame(&self) -> bool {
        let mut nodes = self.nodes.iter();
        nodes.any(|node| self.carriers[node.number].joint().is_none())
    }

    /// Joints at the ends of the first rod, 0 for the base and 1 for the end, each with its node.
    pub fn joints(&self) -> Vec<(usize, &Guide, GroupNode)> {
        let link = self.rods[0].1;
        let ends = [&link.from, &link.to].into_iter().enumerate();
        let joints = ends.filter_map(|(end, site)| {
            let number = site.carried_by()?;
            let node = self.nodes.iter().find(|node| node.number == number)?;
            Some((end, self.carrier(node).joint()?, *node))
        });
        joints.collect()
    }

    fn carrier(&self, node: &GroupNode) -> &Body {
        &self.carriers[node.number]
    }

    /// The place of a node in the group, where the node is added if it is new.
    fn with_node(&mut self, number: usize, parent: Option<usize>) -> usize {
        if let Some(place) = self.nodes.iter().position(|node| node.number == number) {
            return place;
        }
        let count = self.carriers[number].freedoms();
        self.nodes.push(GroupNode {
            number,
            first: self.count,
            count,
            parent,
        });
        self.count += count;
        self.nodes.len() - 1
    }

    /// Number of components of the charts.
    fn charts(&self) -> usize {
        6 * self.rods.len()
    }

    /// Indices among the unknowns of the coordinates without friction.
    pub fn free(&self) -> Vec<usize> {
        let all = self.nodes.iter().flat_map(|node| {
            let joint = self.carrier(node).joint();
            let damped = move |a: usize| joint.is_some_and(|on| on.laws()[a].damping > 0.0);
            let own = (0..node.count).filter(move |a| !damped(*a));
            own.map(move |a| self.charts() + node.first + a)
        });
        all.collect()
    }

    /// Units of the coordinates: 1 for angles, the length of the first rod for shifts.
    pub fn units(&self) -> DVector<f64> {
        let length = self.rods[0].1.rod.length();
        let mut units = DVector::from_element(self.count, 1.0);
        for node in &self.nodes {
            let turnings = self.carrier(node).turnings();
            let mut shifts = units.rows_mut(node.first + turnings, node.count - turnings);
            shifts.fill(length);
        }
        units
    }

    /// Coordinates, or their rates, from the dimensionless unknowns.
    pub fn coordinates_of(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        let own = unknowns.rows(self.charts(), self.count);
        own.component_mul(&self.units())
    }

    /// Newton step of the unknowns onto the attachments, with no action left on the nodes.
    pub fn correction(&self, at: &Evaluated) -> Option<DVector<f64>> {
        let equations = self.equations_at(at);
        equations.matrix.full_piv_lu().solve(&equations.gap)
    }

    /// Moves the nodes by changes of their coordinates.
    pub fn move_by(&self, t: f64, bodies: &mut [BodyMotion], by: &DVector<f64>) {
        let before = bodies.to_vec();
        for node in &self.nodes {
            let by = &by.as_slice()[node.first..node.first + node.count];
            let pose = &before[node.number].pose;
            bodies[node.number] = match self.carrier(node).joint() {
                None => BodyMotion::at_rest(self.carrier(node).moved(pose, by)),
                Some(guide) => {
                    let y = guide.coordinates(&guide.frame(t, &before), pose);
                    let y: Vec<f64> = y.iter().zip(by).map(|(y, by)| y + by).collect();
                    guide.carried(t, bodies, &y)
                }
            };
        }
    }

    /// Adds to the twists of the nodes, and of the rods' attachments on nodes, the part by rates of the coordinates.
    fn set_twists(&self, at: &mut Evaluated, rates: &DVector<f64>) {
        let t = at.integrals.time;
        let own = self.own_twists(t, &at.now.bodies);
        let ends = self.rods.iter().map(|(_, link)| {
            [&link.from, &link.to].map(|site| self.twists_of(site, &at.now.bodies, &own))
        });
        for ((k, _), [base, tip]) in self.rods.iter().zip(ends.collect::<Vec<_>>()) {
            at.points[*k].base.twist += base * rates;
            at.points[*k].tip.twist += tip * rates;
        }
        let twists = self.nodes.iter().map(|node| {
            let site = Attachment::body(node.number, Isometry3::identity());
            self.twists_of(&site, &at.now.bodies, &own) * rates
        });
        for (node, twist) in self.nodes.iter().zip(twists.collect::<Vec<_>>()) {
            at.now.bodies[node.number].twist += twist;
        }
    }

    /// Twists of each node per unit of its own coordinates, with the carrier of its joint at rest.
    fn own_twists(&self, t: f64, bodies: &[BodyMotion]) -> Vec<Matrix6xX<f64>> {
        let each = self.nodes.iter().map(|node| {
            let pose = &bodies[node.number].pose;
            match self.carrier(node).joint() {
                None => self.carrier(node).free_twists(pose),
                Some(guide) => guide.twists(&guide.frame(t, bodies), pose),
            }
        });
        each.collect()
    }

    /// Twist of an attachment by all coordinates.
    fn twists_of(
        &self,
        site: &Attachment,
        bodies: &[BodyMotion],
        own: &[Matrix6xX<f64>],
    ) -> Matrix6xX<f64> {
        let mut twists = Matrix6xX::zeros(self.count);
        for (place, arm) in self.arms(site, bodies) {
            let moved = carried(&arm) * &own[place];
            let first = self.nodes[place].first;
            twists.columns_mut(first, moved.ncols()).copy_from(&moved);
        }
        twists
    }

    /// The nodes of the group that move an attachment, each with the arm from its reference point.
    fn arms(&self, site: &Attachment, bodies: &[BodyMotion]) -> Vec<(usize, Vector3<f64>)> {
        let Some((number, lever)) = site.lever(bodies) else {
            return Vec::new();
        };
        let Some(place) = self.nodes.iter().position(|node| node.number == number) else {
            return Vec::new();
        };
        let mut arms = vec![(place, lever)];
        if let Some(parent) = self.nodes[place].parent {
            let [node, from] = [number, self.nodes[parent].number]
                .map(|body| bodies[body].pose.translation.vector);
            arms.push((parent, node + lever - from));
        }
        arms
    }

    /// The equations at an evaluated configuration.
    pub fn equations_at(&self, at: &Evaluated) -> JoinedEquations {
        let points: Vec<&LinkPoint> = self.rods.iter().map(|(k, _)| &at.points[*k]).collect();
        self.equations(at.integrals.time, &at.now.bodies, &points)
    }

    /// The equations at time `t`; nodes move with their carriers, or stand, in `bodies` and in `points`, which are
    /// those of the group's rods.
    pub fn equations(
        &self,
        t: f64,
        bodies: &[BodyMotion],
        points: &[&LinkPoint],
    ) -> JoinedEquations {
        let (charts, units) = (self.charts(), self.units());
        let size = charts + self.count;
        let first = self.rods[0].1.units();
        let mut weights = DVector::from_element(self.count, 1.0);
        let own = self.own_twists(t, bodies);
        let mut scaled = own.clone();
        for (node, scaled) in self.nodes.iter().zip(&mut scaled) {
            let turnings = self.carrier(node).turnings();
            for a in 0..node.count {
                weights[node.first + a] = 1.0 / if a < turnings { first[0] } else { first[3] };
                scaled.column_mut(a).scale_mut(units[node.first + a]);
            }
        }
        // Rows of the balance: twists by coordinates, over the units of couples and forces.
        let rows: Vec<Matrix6xX<f64>> = self
            .nodes
            .iter()
            .zip(&own)
            .map(|(node, own)| {
                let mut rows = own.clone();
                for a in 0..node.count {
                    rows.column_mut(a).scale_mut(weights[node.first + a]);
                }
                rows
            })
            .collect();
        let mut matrix = DMatrix::zeros(size, size);
        let (mut drive, mut gap) = (DVector::zeros(size), DVector::zeros(size));
        let mut sums = vec![Vector6::zeros(); self.nodes.len()];
        for (i, ((_, link), point)) in self.rods.iter().zip(points).enumerate() {
            let chart = 6 * i;
            let scale = link.gap_scale(&point.end);
            matrix
                .fixed_view_mut::<6, 6>(chart, chart)
                .copy_from(&(scale * point.end.jacobian));
            drive
                .fixed_rows_mut::<6>(chart)
                .copy_from(&(scale * point.drive()));
            gap.fixed_rows_mut::<6>(chart)
                .copy_from(&(scale * point.gap()));
            if point.end.is_taut() {
                // The couples of a taut rod follow from its force.
                gap.fixed_rows_mut::<3>(chart).fill(0.0);
            }
            let sites = [&link.from, &link.to];
            let moved = sites.map(|site| self.twists_of(site, bodies, &scaled));
            let by_twists = scale * point.drive_by_twists();
            let by_turns = point.wrenches_by_turns();
            let mut by_coordinates = DMatrix::zeros(12, self.count);
            for (end, moved) in moved.iter().enumerate() {
                let mut block = matrix.view_mut((chart, charts), (6, self.count));
                block -= by_twists.fixed_columns::<6>(6 * end) * moved;
                by_coordinates += by_turns.fixed_columns::<6>(6 * end) * moved;
            }
            let mut standing = SVector::<f64, 12>::zeros();
            standing.fixed_rows_mut::<6>(0).copy_from(&point.base.twist);
            standing.fixed_rows_mut::<6>(6).copy_from(&point.tip.twist);
            let (by_chart, by_time): (SMatrix<f64, 12, 6>, SVector<f64, 12>) =
                (point.wrenches_by_chart(), by_turns * standing);
            for (end, (site, wrench)) in sites.into_iter().zip(point.wrenches()).enumerate() {
                let n = halves(&wrench).1;
                for (place, arm) in self.arms(site, bodies) {
                    let node = &self.nodes[place];
                    let act = (carried(&arm) * &rows[place]).transpose();
                    let row = charts + node.first;
                    let mut block = matrix.view_mut((row, chart), (node.count, 6));
                    block += &act * by_chart.fixed_rows::<6>(6 * end);
                    let mut block = matrix.view_mut((row, charts), (node.count, self.count));
                    block += &act * by_coordinates.rows(6 * end, 6);
                    // The arm moves with the attachment, and with the node.
                    let turns = rows[place].fixed_rows::<3>(0).transpose();
                    let mut arms: Matrix3xX<f64> = moved[end].fixed_rows::<3>(3).into_owned();
                    let reference = Attachment::body(node.number, Isometry3::identity());
                    arms -= self
                        .twists_of(&reference, bodies, &scaled)
                        .fixed_rows::<3>(3);
                    block -= turns * n.cross_matrix() * arms;
                    let mut part = drive.rows_mut(row, node.count);
                    part -= &act * by_time.fixed_rows::<6>(6 * end);
                    let mut part = gap.rows_mut(row, node.count);
                    part -= &act * wrench;
                    let (m, n) = halves(&wrench);
                    sums[place] += join(&(m + arm.cross(&n)), &n);
                }
            }
        }
        let mut loss = 0.0;
        for (place, node) in self.nodes.iter().enumerate() {
            let row = charts + node.first;
            let pose = &bodies[node.number].pose;
            let Some(guide) = self.carrier(node).joint() else {
                let load = self.carrier(node).load(t, pose);
                let mut part = gap.rows_mut(row, node.count);
                part -= rows[place].tr_mul(&load);
                let turned = self.carrier(node).mass().load_by_turn(t, pose);
                let spins = scaled[place].fixed_rows::<3>(0);
                let mut block = matrix.view_mut((row, row), (node.count, node.count));
                for (i, turned) in turned.iter().enumerate() {
                    block += rows[place].fixed_rows::<3>(3 * i).tr_mul(&(turned * spins));
                }
                continue;
            };
            let frame = guide.on().at(t, bodies);
            let spin = halves(&frame.twist).0;
            let turned = guide.turned_action(&frame.pose, pose, &sums[place]);
            let laws = guide.actions(&frame.pose, pose);
            for (a, law) in guide.laws().iter().enumerate() {
                let (i, weight) = (row + a, weights[node.first + a]);
                if law.damping > 0.0 {
                    let action = own[place].column(a).dot(&sums[place]) + laws[a];
                    matrix.row_mut(i).fill(0.0);
                    matrix[(i, i)] = 1.0;
                    drive[i] = action / (law.damping * units[node.first + a]);
                    gap[i] = 0.0;
                    loss += action * action / law.damping;
                    continue;
                }
                if a == 1 {
                    matrix[(i, i - 1)] += turned.second_by_first * weight;
                }
                if let Some(parent) = node.parent {
                    let spins = scaled[parent].fixed_rows::<3>(0);
                    let by = turned.by_spin[a].transpose() * spins * weight;
                    let mut part =
                        matrix.view_mut((i, charts + self.nodes[parent].first), by.shape());
                    part += by;
                }
                matrix[(i, i)] -= law.stiffness * units[node.first + a] * weight;
                drive[i] -= turned.by_spin[a].dot(&spin) * weight;
                gap[i] -= laws[a] * weight;
            }
        }
        JoinedEquations {
            matrix,
            drive,
            gap,
            loss,
            charts,
        }
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
