//! State vectors of an assembly and their rates (theory 3.3).
//!
//! A state holds the pose and the velocity of every body, the coordinates of joints with axes, the chart of every rod,
//! and the spins of rods with mass between two ball joints. Time, the work of loads and supports, and the loss to drag
//! follow. Poses and charts are redundant: the gap between them is the error of the integration.
//!
//! ```text
//! place' = V,   M V' = wrenches of the rods + loads,   q_k' = J_k^-1 xi_k,
//! ```
//! Here xi_k is the twist of the end of rod k relative to its base. Near the fold of a rod, det J_k = 0, time itself
//! is slowed: t' = det J_k/d, and q_k' = adj(J_k) xi_k/d. Both are smooth through the fold, at which t' = 0.

use super::body::{Body, BodyMotion};
use super::configuration::{Configuration, Evaluated, Integrals, Spin};
use super::guide::Guide;
use super::joined_rods::GroupNode;
use super::network::Assembly;
use super::rod_element::{LinkPoint, RodChart};
use crate::manifold::adjugate_times;
use crate::math::se3::{halves, join, spin, unit};
use crate::rod::Wrench;
use nalgebra::{
    DVector, Isometry3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector4, Vector6,
};
use std::ops::Range;

/// Slowed time near folds of several rods. With x = det J/(det J where slowing began) for each rod,
/// t' = 1/(the sum of 1/x): for one rod x itself, for several about the least x. The sign of t' is that of the x that
/// vanishes first. If all vanish together, as in a symmetric assembly, t' vanishes with them.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowedTime {
    /// Rods by number, each with det J at the start of slowing.
    pub rods: Vec<(usize, f64)>,
}

impl SlowedTime {
    /// Slowed time near the fold of one rod.
    pub fn one(link: usize, scale: f64) -> Self {
        Self {
            rods: vec![(link, scale)],
        }
    }

    /// t', and t'/det J of each of the rods in turn; `det` gives det J of a rod.
    pub fn clock(&self, det: impl Fn(usize) -> f64) -> (f64, Vec<f64>) {
        let x: Vec<f64> = self.rods.iter().map(|(k, scale)| det(*k) / scale).collect();
        let share = |k: usize| {
            let others = (0..x.len()).filter(|j| *j != k);
            1.0 / (1.0 + others.map(|j| x[k] / x[j]).sum::<f64>())
        };
        let least = (0..x.len()).min_by(|a, b| x[*a].abs().total_cmp(&x[*b].abs()));
        let rate = least.map_or(1.0, |k| x[k] * share(k));
        let rods = self.rods.iter().enumerate();
        (rate, rods.map(|(k, (_, scale))| share(k) / scale).collect())
    }
}

/// Reactions on the bodies that depend on the motion, such as contact forces.
pub trait Reactions {
    /// Adds to the wrenches (couple, force) on the bodies at their reference points, in the world. `free` are the
    /// accelerations without the reactions. The result is None where no reactions exist.
    fn react(
        &self,
        at: &Evaluated,
        free: &[Vector6<f64>],
        wrenches: &mut [Vector6<f64>],
    ) -> Option<ReactionPower>;
}

/// Powers of reactions.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReactionPower {
    /// Power of moving obstacles on the bodies.
    pub power: f64,
    /// Power lost to friction.
    pub loss: f64,
}

/// Components of a spin in a state: the quaternion of the base directors, and the rate.
const SPIN_NUMBERS: usize = 5;
/// Tolerance for evaluating a state for display, if the state was not evaluated in full.
const SHOWN: f64 = 1e-12;

/// Monitored quantities of a rod in motion.
#[derive(Debug, Clone, Copy, Default)]
pub struct RodMonitor {
    /// det J: 0 at a fold.
    pub det: f64,
    /// J, in radians and rod lengths.
    pub jacobian: Matrix6<f64>,
    /// xi, the right-hand side of J q' = xi, in radians and rod lengths.
    pub drive: Vector6<f64>,
    /// Gap between rod end and attachment, in radians and rod lengths.
    pub gap: f64,
    /// Chart that suits the present pull.
    pub better: RodChart,
}

impl Assembly {
    pub(super) fn starts(&self) -> impl Iterator<Item = (usize, &Body)> {
        let mut next = 0;
        self.carriers().iter().map(move |carrier| {
            next += carrier.numbers();
            (next - carrier.numbers(), carrier)
        })
    }

    /// Bodies that have a mass, each with its number and the index of its first component in a state.
    fn masses(&self) -> impl Iterator<Item = (usize, usize, &Body)> {
        let all = self.starts().enumerate();
        all.filter(|(_, (_, carrier))| !carrier.is_massless())
            .map(|(body, (start, carrier))| (body, start, carrier))
    }

    /// Indices of the coordinates of a node in a state.
    fn node_slots(&self, node: usize) -> Range<usize> {
        let start = self.carriers()[..node].iter().map(Body::numbers).sum();
        start..start + self.carriers()[node].numbers()
    }

    /// Indices in a state of the nodes of the group of rod `k`.
    fn group_slots(&self, k: usize) -> Vec<usize> {
        let group = self.joined_with(k);
        let nodes = group.iter().flat_map(|group| &group.nodes);
        nodes
            .flat_map(|node| self.node_slots(node.number))
            .collect()
    }

    /// Coordinates in a state of the joints of rod `k`, and of the nodes that it shares with others.
    pub fn joints_of(&self, state: &DVector<f64>, k: usize) -> Vec<f64> {
        let slots = self.group_slots(k);
        slots.into_iter().map(|slot| state[slot]).collect()
    }

    /// The state with other coordinates of the joints of rod `k`, as [`Assembly::joints_of`].
    #[must_use]
    pub fn with_joints_of(
        &self,
        mut state: DVector<f64>,
        k: usize,
        coordinates: &[f64],
    ) -> DVector<f64> {
        for (slot, y) in self.group_slots(k).into_iter().zip(coordinates) {
            state[slot] = *y;
        }
        state
    }

    fn chart_start(&self) -> usize {
        self.carriers().iter().map(Body::numbers).sum()
    }

    /// Indices of the chart of rod `k` in a state.
    pub fn chart_slots(&self, k: usize) -> Range<usize> {
        let start = self.chart_start() + 6 * k;
        start..start + 6
    }

    /// Index of time in a state; work and drag follow.
    pub fn time_slot(&self) -> usize {
        let charts = self.chart_slots(self.links().len()).start;
        self.spin_slots()
            .last()
            .map_or(charts, |(_, slots)| slots.end)
    }

    /// Indices in a state of the bodies' poses, and of their velocities; the latter include the spins of rods, which
    /// have rates of their own.
    pub fn slots(&self) -> [Vec<usize>; 2] {
        let (mut places, mut velocities) = (Vec::new(), Vec::new());
        for (_, start, carrier) in self.masses() {
            let end = start + carrier.numbers();
            places.extend(start..end - carrier.freedoms());
            velocities.extend(end - carrier.freedoms()..end);
        }
        velocities.extend(self.spin_slots().flat_map(|(_, slots)| slots));
        [places, velocities]
    }

    /// Writes the rates of the bodies' poses alone, which need no rods.
    pub fn write_place_rates(&self, state: &DVector<f64>, out: &mut DVector<f64>) {
        let time = state[self.time_slot()];
        for (_, start, carrier) in self.masses() {
            let slots = start..start + carrier.numbers();
            let (from, to) = (
                &state.as_slice()[slots.clone()],
                &mut out.as_mut_slice()[slots],
            );
            carrier.write_rates(time, from, &Vector6::zeros(), 1.0, to);
        }
    }

    /// Rods with mass between two ball joints, each with the indices of its spin in a state.
    pub(super) fn spin_slots(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        let start = self.chart_slots(self.links.len()).start;
        let rods = self.light_rods().map(|(k, _)| k);
        let spinning = rods.filter(|k| self.links[*k].is_pinned());
        spinning.enumerate().map(move |(i, k)| {
            let from = start + SPIN_NUMBERS * i;
            (k, from..from + SPIN_NUMBERS)
        })
    }

    /// Packs a configuration into a state.
    pub fn state(&self, now: &Configuration, integrals: &Integrals) -> DVector<f64> {
        let time = self.time_slot();
        let mut state = DVector::zeros(time + 3);
        for ((start, carrier), place) in self.starts().zip(&now.bodies) {
            let numbers = &mut state.as_mut_slice()[start..start + carrier.numbers()];
            match carrier.joint() {
                None => carrier.write(place, numbers),
                Some(joint) => {
                    let frame = joint.frame(integrals.time, &now.bodies);
                    numbers.copy_from_slice(&joint.coordinates(&frame, &place.pose));
                }
            }
        }
        for (k, q) in now.charts.iter().enumerate() {
            state.as_mut_slice()[self.chart_slots(k)].copy_from_slice(q.as_slice());
        }
        self.write_spins(now, &mut state);
        state.as_mut_slice()[time..].copy_from_slice(&[
            integrals.time,
            integrals.work,
            integrals.drag,
        ]);
        state
    }

    /// Writes a node of a group into a state.
    fn write_node(
        &self,
        node: &GroupNode,
        t: f64,
        bodies: &[BodyMotion],
        state: &mut DVector<f64>,
    ) {
        let carrier = &self.carriers[node.number];
        let numbers = &mut state.as_mut_slice()[self.node_slots(node.number)];
        let place = &bodies[node.number];
        match carrier.joint() {
            None => carrier.write(place, numbers),
            Some(joint) => {
                let y = joint.coordinates(&joint.frame(t, bodies), &place.pose);
                numbers.copy_from_slice(&y);
            }
        }
    }

    /// Unpacks the configuration of a state.
    pub fn configuration(&self, state: &DVector<f64>) -> Configuration {
        let numbers = state.as_slice();
        let t = state[self.time_slot()];
        let mut bodies: Vec<BodyMotion> = Vec::with_capacity(self.carriers().len());
        for (start, carrier) in self.starts() {
            let numbers = &numbers[start..start + carrier.numbers()];
            let place = match carrier.joint() {
                None => carrier.read(numbers),
                Some(joint) => joint.carried(t, &bodies, numbers),
            };
            bodies.push(place);
        }
        Configuration {
            bodies,
            charts: self.charts(state),
            spins: self.read_spins(state),
        }
    }

    /// Charts read from a state.
    fn charts(&self, state: &DVector<f64>) -> Vec<Wrench> {
        let slots = (0..self.links().len()).map(|k| self.chart_slots(k));
        slots
            .map(|slots| Vector6::from_column_slice(&state.as_slice()[slots]))
            .collect()
    }

    /// The spins of a state.
    fn read_spins(&self, state: &DVector<f64>) -> Vec<Option<Spin>> {
        let mut spins = Vec::new();
        for (k, slots) in self.spin_slots() {
            spins.resize(self.links.len(), None);
            let numbers = &state.as_slice()[slots];
            spins[k] = Some(Spin {
                turn: unit(&Vector4::from_column_slice(&numbers[..4])),
                rate: numbers[4],
            });
        }
        spins
    }

    /// Writes the spins of a configuration into a state; an unknown spin gets the world's axes and rate 0.
    fn write_spins(&self, now: &Configuration, state: &mut DVector<f64>) {
        for (k, slots) in self.spin_slots() {
            let p = now
                .spin(k)
                .map_or_else(UnitQuaternion::identity, |spin| spin.turn);
            let rate = now.spin(k).map_or(0.0, |spin| spin.rate);
            state.as_mut_slice()[slots].copy_from_slice(&[p.w, p.i, p.j, p.k, rate]);
        }
    }

    /// Writes the rates of the spins, times `pace`, to match those of the charts in `charts`. `changes` has omega_t
    /// of the rods whose inertia is on. Any other rod keeps its spin rate.
    pub(super) fn write_spin_rates(
        &self,
        state: &DVector<f64>,
        points: &[LinkPoint],
        charts: &[Wrench],
        changes: &[(usize, f64)],
        pace: f64,
        out: &mut DVector<f64>,
    ) {
        for (k, slots) in self.spin_slots() {
            let omega = points[k].turning(&charts[k], pace);
            let p = Vector4::from_column_slice(&state.as_slice()[slots.clone()][..4]);
            let turned = spin(&p, &(unit(&p).inverse() * omega));
            let change = changes.iter().find(|(rod, _)| *rod == k);
            let own = &mut out.as_mut_slice()[slots];
            own[..4].copy_from_slice(turned.as_slice());
            own[4] = change.map_or(0.0, |(_, change)| change * pace);
        }
    }

    /// Time and integrals of a state.
    pub fn integrals(&self, state: &DVector<f64>) -> Integrals {
        let time = self.time_slot();
        Integrals {
            time: state[time],
            work: state[time + 1],
            drag: state[time + 2],
        }
    }

    /// Evaluates the rods of a state; None where a rod's law or its length of integration refuses.
    pub fn evaluated(&self, state: &DVector<f64>, tolerance: f64) -> Option<Evaluated> {
        let mut now = self.configuration(state);
        let integrals = self.integrals(state);
        let placed = |k| self.placed(integrals.time, &now, k, tolerance).ok();
        let points: Vec<LinkPoint> = (0..self.links().len()).map(placed).collect::<Option<_>>()?;
        // Integrated directors depart from the chord by the integration error.
        for (spin, point) in now.spins.iter_mut().zip(&points) {
            if let Some(spin) = spin {
                spin.turn = point.base.pose.rotation;
            }
        }
        // The couple of a taut rod follows from its force.
        for ((link, point), q) in self.links().iter().zip(&points).zip(&mut now.charts) {
            if point.end.is_taut() {
                let couple = point.end.base_couple / link.units()[0];
                q.fixed_rows_mut::<3>(0).copy_from(&couple);
            }
        }
        Some(Evaluated {
            now,
            integrals,
            points,
        })
    }

    /// Writes the rates of `state`; None outside the domain of a law. `tolerance` is that along the rods; `seen`
    /// receives the monitored quantities of every rod.
    pub fn write_slope(
        &self,
        state: &DVector<f64>,
        slowed: Option<&SlowedTime>,
        tolerance: f64,
        out: &mut DVector<f64>,
        seen: impl FnMut(usize, RodMonitor),
    ) -> Option<()> {
        self.write_slope_under(None, state, slowed, tolerance, out, seen)
    }

    /// [`Assembly::write_slope`] with reactions on the bodies, such as contact forces.
    pub fn write_slope_under(
        &self,
        reactions: Option<&dyn Reactions>,
        state: &DVector<f64>,
        slowed: Option<&SlowedTime>,
        tolerance: f64,
        out: &mut DVector<f64>,
        mut seen: impl FnMut(usize, RodMonitor),
    ) -> Option<()> {
        let at = self.evaluated(state, tolerance)?;
        let Evaluated {
            now,
            integrals,
            points,
        } = &at;
        let groups = self.joined();
        // The first rod of each group, for every rod.
        let mut leaders: Vec<usize> = (0..points.len()).collect();
        let mut dets = vec![1.0; points.len()];
        let mut joint_loss = 0.0;
        for group in &groups {
            let equations = group.equations_at(&at);
            let (det, all) = adjugate_times(&equations.matrix, &equations.drive);
            for (i, (k, link)) in group.rods.iter().enumerate() {
                let own = all.rows(6 * i, 6);
                out.rows_mut(self.chart_slots(*k).start, 6).copy_from(&own);
                let leads = i == 0;
                let left = if leads { equations.unbalanced() } else { 0.0 };
                leaders[*k] = group.leader();
                dets[*k] = if leads { det } else { 1.0 };
                let monitor = RodMonitor {
                    det: dets[*k],
                    gap: link.apart(&points[*k]).max(left),
                    better: link.suited_chart(&now.charts[*k], &points[*k]),
                    ..RodMonitor::default()
                };
                seen(*k, monitor);
            }
            let y = group.coordinates_of(&all);
            for node in &group.nodes {
                self.write_node_rates(node, state, &y, out);
            }
            joint_loss += equations.loss;
        }
        let joined = |k: usize| groups.iter().any(|group| group.has(k));
        let links = self.links().iter().zip(points).enumerate();
        for (k, (link, point)) in links.filter(|(k, _)| !joined(*k)) {
            let drive = point.drive();
            let (det, scaled) = adjugate_times(&point.end.jacobian, &drive);
            let scale = link.gap_scale(&point.end);
            dets[k] = det;
            let monitor = RodMonitor {
                det,
                jacobian: scale * point.end.jacobian,
                drive: scale * drive,
                gap: link.apart(point),
                better: link.suited_chart(&now.charts[k], point),
            };
            seen(k, monitor);
            out.as_mut_slice()[self.chart_slots(k)].copy_from_slice(scaled.as_slice());
        }
        // Up to here the slopes of the charts are q' det J. The factor t'/det J is finite where det J of a slowed rod
        // vanishes.
        let mut rate = 1.0;
        let mut by_time = vec![None; points.len()];
        if let Some(slowed) = slowed {
            let factors;
            (rate, factors) = slowed.clock(|k| dets[k]);
            for ((k, _), factor) in slowed.rods.iter().zip(factors) {
                by_time[*k] = Some(factor);
            }
        }
        let factor = |k: usize| by_time[leaders[k]].unwrap_or(rate / dets[leaders[k]]);
        let scale = |out: &mut DVector<f64>, slots: Range<usize>, factor: f64| {
            let own = &mut out.as_mut_slice()[slots];
            own.iter_mut().for_each(|x| *x *= factor);
        };
        for k in 0..points.len() {
            scale(out, self.chart_slots(k), factor(k));
        }
        let mut node_power = 0.0;
        for group in &groups {
            for node in &group.nodes {
                let slots = self.node_slots(node.number);
                scale(out, slots, factor(group.leader()));
                node_power += self.power_on_node(node, state, out, &at);
            }
        }
        let mut wrenches = self.wrenches(&now.bodies, points);
        let (mut power, mut loss) = (self.power_on_rods(points), joint_loss);
        let mut spins = Vec::new();
        if self.feels_rods() {
            let together = self.feel_rods(&at, tolerance, &mut wrenches)?;
            power += together.power;
            spins = together.spins;
        }
        if let Some(reactions) = reactions {
            let free = self.accelerations_under(&at, &wrenches);
            let added = reactions.react(&at, &free, &mut wrenches)?;
            power += added.power;
            loss += added.loss;
        }
        let charts = self.charts(out);
        let turning = points.iter().zip(&charts);
        let turning: f64 = turning.map(|(point, by)| point.load_power(by, rate)).sum();
        self.write_spin_rates(state, points, &charts, &spins, rate, out);
        for (body, start, carrier) in self.masses() {
            let slots = start..start + carrier.numbers();
            let (driven, lost) = carrier.write_rates(
                integrals.time,
                &state.as_slice()[slots.clone()],
                &wrenches[body],
                rate,
                &mut out.as_mut_slice()[slots],
            );
            power += driven;
            loss += lost;
        }
        out.as_mut_slice()[self.time_slot()..].copy_from_slice(&[
            rate,
            power * rate + turning + node_power,
            loss * rate,
        ]);
        out.iter().all(|x| x.is_finite()).then_some(())
    }

    /// Writes the rates of a node from the rates of the coordinates of a group.
    fn write_node_rates(
        &self,
        node: &GroupNode,
        state: &DVector<f64>,
        rates: &DVector<f64>,
        out: &mut DVector<f64>,
    ) {
        let (slots, carrier) = (self.node_slots(node.number), &self.carriers[node.number]);
        let rates = &rates.as_slice()[node.first..node.first + node.count];
        if carrier.joint().is_some() {
            out.as_mut_slice()[slots].copy_from_slice(rates);
            return;
        }
        let (from, to) = (
            &state.as_slice()[slots.clone()],
            &mut out.as_mut_slice()[slots],
        );
        let (turn, shift) = rates.split_at(carrier.turnings());
        let [quaternion, position, ..] = carrier.slots();
        if carrier.turns() {
            let p = Vector4::from_column_slice(&from[quaternion.clone()]);
            let omega = Vector3::from_column_slice(turn);
            let turned = spin(&p, &(unit(&p).inverse() * omega));
            to[quaternion].copy_from_slice(turned.as_slice());
        }
        to[position].copy_from_slice(shift);
    }

    /// Power, times the pace of `slope`, of the loads without a potential on a node that no joint carries.
    fn power_on_node(
        &self,
        node: &GroupNode,
        state: &DVector<f64>,
        slope: &DVector<f64>,
        at: &Evaluated,
    ) -> f64 {
        let carrier = &self.carriers[node.number];
        if carrier.joint().is_some() || !carrier.mass().is_driven() {
            return 0.0;
        }
        let slots = self.node_slots(node.number);
        let [quaternion, position, ..] = carrier.slots();
        let (from, rates) = (&state.as_slice()[slots.clone()], &slope.as_slice()[slots]);
        // p' = p (body omega)/2.
        let p = Vector4::from_column_slice(&from[quaternion.clone()]);
        let turned = Vector4::from_column_slice(&rates[quaternion]);
        let [p, turned] = [p, turned].map(|p| Quaternion::new(p[0], p[1], p[2], p[3]));
        let omega = (turned * p.conjugate()).imag() * (2.0 / p.norm_squared());
        let velocity = Vector3::from_column_slice(&rates[position]);
        let place = BodyMotion {
            pose: at.now.bodies[node.number].pose,
            twist: join(&omega, &velocity),
        };
        (carrier.motion(at.integrals.time, &place, &Vector6::zeros())).power
    }

    /// Accelerations (angular, linear) of the bodies without the nodes of joints, under wrenches at their reference
    /// points; those of nodes without mass are 0.
    fn accelerations_under(&self, at: &Evaluated, wrenches: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let solids = self.solids().iter().zip(&at.now.bodies).zip(wrenches);
        let motion = solids.map(|((body, place), wrench)| {
            if body.is_massless() {
                return Vector6::zeros();
            }
            (body.motion(at.integrals.time, place, wrench)).acceleration
        });
        motion.collect()
    }

    /// Accelerations (angular, linear) of the bodies without the nodes of joints, under rods without mass and loads.
    pub fn accelerations(&self, at: &Evaluated) -> Vec<Vector6<f64>> {
        self.accelerations_under(at, &self.wrenches(&at.now.bodies, &at.points))
    }

    /// Rates of the twists of free bodies, from the slope of a state by any variable.
    pub fn twist_rates(&self, slope: &DVector<f64>) -> Vec<Vector6<f64>> {
        let solids = self.starts().take(self.solids().len());
        let rate = solids.map(|(start, carrier)| {
            let numbers = &slope.as_slice()[start..start + carrier.numbers()];
            let [_, _, spin, velocity] = carrier.slots().map(|slots| &numbers[slots]);
            let part = |x: &[f64]| match x {
                [x, y, z] => Vector3::new(*x, *y, *z),
                _ => Vector3::zeros(),
            };
            join(&part(spin), &part(velocity))
        });
        rate.collect()
    }

    /// Adds to the twists (angular velocity, velocity) of free bodies in a state, in the world.
    pub fn add_twists(&self, state: &mut DVector<f64>, changes: &[Vector6<f64>]) {
        let solids = self.starts().take(self.solids().len());
        for ((start, carrier), change) in solids.zip(changes) {
            let (angular, linear) = halves(change);
            let [_, _, spin, velocity] = carrier.slots();
            for (slots, by) in [(spin, angular), (velocity, linear)] {
                for (i, slot) in slots.enumerate() {
                    state[start + slot] += by[i];
                }
            }
        }
    }

    /// Shifts the poses of free bodies in a state by small twists at their reference points, in the world.
    pub fn shift_bodies(&self, state: &mut DVector<f64>, shifts: &[Vector6<f64>]) {
        let solids = self.starts().take(self.solids().len());
        for ((start, carrier), shift) in solids.zip(shifts) {
            let numbers = &mut state.as_mut_slice()[start..start + carrier.numbers()];
            let mut place = carrier.read(numbers);
            let (turn, way) = halves(shift);
            place.pose.translation.vector += way;
            if carrier.turns() {
                let turn = UnitQuaternion::from_scaled_axis(turn);
                place.pose.rotation = turn * place.pose.rotation;
            }
            carrier.write(&place, numbers);
        }
    }

    /// Replaces the chart of rod `k` in a state; the bodies keep their numbers.
    pub fn with_chart(&self, mut state: DVector<f64>, k: usize, q: &Wrench) -> DVector<f64> {
        state.as_mut_slice()[self.chart_slots(k)].copy_from_slice(q.as_slice());
        state
    }

    /// Replaces the charts of all rods in a state.
    pub fn with_charts(&self, state: DVector<f64>, charts: &[Wrench]) -> DVector<f64> {
        let charts = charts.iter().enumerate();
        charts.fold(state, |state, (k, q)| self.with_chart(state, k, q))
    }

    /// Aligns the base directors of rods between two ball joints with their chords, as needed after a change of
    /// chart.
    pub fn align_spins(&self, mut state: DVector<f64>, tolerance: f64) -> DVector<f64> {
        if let Some(at) = self.evaluated(&state, tolerance) {
            self.write_spins(&at.now, &mut state);
        }
        state
    }

    /// Groove parameter and its rate for each body in a groove, with the number of the body.
    pub fn along_grooves(&self, state: &DVector<f64>) -> Vec<(usize, [f64; 2])> {
        let all = self.starts().enumerate();
        let all = all.filter_map(|(body, (start, carrier))| {
            let part = &state.as_slice()[start..start + carrier.numbers()];
            Some((body, carrier.parameter(part)?))
        });
        all.collect()
    }

    /// First body that leaves its groove at an end, from a state and its slope in time. A push from rest counts if
    /// its acceleration exceeds `least`.
    pub fn leaves_groove(
        &self,
        state: &DVector<f64>,
        slope: &DVector<f64>,
        least: f64,
    ) -> Option<usize> {
        let mut all = self.starts();
        all.position(|(start, carrier)| {
            let slots = start..start + carrier.numbers();
            carrier.leaves_groove(
                &state.as_slice()[slots.clone()],
                &slope.as_slice()[slots],
                least,
            )
        })
    }

    /// Forces of the grooves on the bodies; None for a body without groove.
    pub fn groove_forces(&self, at: &Evaluated) -> Vec<Option<Vector3<f64>>> {
        let wrenches = self.felt_wrenches(at, SHOWN);
        let bodies = self.carriers().iter().zip(&at.now.bodies).zip(&wrenches);
        let force = bodies.map(|((carrier, place), wrench)| {
            carrier.groove_force(at.integrals.time, place, wrench)
        });
        force.collect()
    }

    /// Charts that bring the ends of the rods to their attachments, by one Newton step; None at a fold. The position of
    /// the end of a nearly straight rod does not determine its force along the rod, so that force is kept.
    pub fn corrected_charts(&self, at: &Evaluated) -> Option<Vec<Wrench>> {
        let mut joined = vec![None; at.points.len()];
        for group in self.joined() {
            let change = group.correction(at)?;
            for (i, (k, _)) in group.rods.iter().enumerate() {
                joined[*k] = Some(change.fixed_rows::<6>(6 * i).into_owned());
            }
        }
        let rods = self.links().iter().zip(&at.points).zip(&at.now.charts);
        rods.zip(joined)
            .map(|(((link, point), q), joined)| {
                if let Some(change) = joined {
                    return Some(q + change);
                }
                let gap = point.gap();
                let change = match link.chart().slider() {
                    Some(slider) => link.moved_across(&slider, &point.end, &gap),
                    None => point.end.jacobian.full_piv_lu().solve(&gap),
                };
                Some(q + change?)
            })
            .collect()
    }

    /// Closes the gaps of a state: charts are [`Assembly::corrected_charts`]; for nearly straight rods the bodies are
    /// moved.
    pub fn close_gaps(&self, mut state: DVector<f64>, at: &Evaluated) -> Option<DVector<f64>> {
        for group in self.joined() {
            let change = group.coordinates_of(&group.correction(at)?);
            let mut bodies = at.now.bodies.clone();
            group.move_by(at.integrals.time, &mut bodies, &change);
            for node in &group.nodes {
                self.write_node(node, at.integrals.time, &bodies, &mut state);
            }
        }
        Some(self.slide_bodies(self.with_charts(state, &self.corrected_charts(at)?), at))
    }

    /// Moves bodies along nearly straight rods onto the rods' ends. A body in a groove is not moved.
    pub fn slide_bodies(&self, mut state: DVector<f64>, at: &Evaluated) -> DVector<f64> {
        let mut bodies = at.now.bodies.clone();
        let starts: Vec<_> = self.starts().collect();
        for (link, point) in self.links().iter().zip(&at.points) {
            let Some(slider) = link.chart().slider() else {
                continue;
            };
            let missing = slider.along.dot(&halves(&point.gap()).1);
            let way = point.base.pose.rotation * slider.along * missing;
            let (to, from) = (link.to.carried_by(), link.from.carried_by());
            let moved = to.map(|body| (body, -way)).or(from.map(|body| (body, way)));
            if let Some((body, way)) = moved.filter(|(k, _)| starts[*k].1.is_free()) {
                let (start, carrier) = starts[body];
                bodies[body].pose.translation.vector += way;
                let slots = start..start + carrier.numbers();
                carrier.write(&bodies[body], &mut state.as_mut_slice()[slots]);
            }
        }
        state
    }

    /// At the start of a motion: lets the ends of slack inextensible rods slide by less than the tolerance
    /// ([`super::Link::allow`]). True if one does so at once.
    pub fn allow_sliding(&mut self, tolerance: f64, at: &Evaluated) -> bool {
        let mut slides = false;
        let jointed: Vec<bool> = (0..self.links.len()).map(|k| self.is_jointed(k)).collect();
        let links = self.links.iter_mut().zip(&at.points).zip(jointed);
        for ((link, point), _) in links.filter(|(_, jointed)| !jointed) {
            link.allow(tolerance);
            if let Some(slider) = link.suited_slider(&point.end) {
                link.set_chart(RodChart::OnSlider(slider));
                slides = true;
            }
        }
        slides
    }

    /// Kinetic, elastic and potential energy.
    pub fn energies(&self, at: &Evaluated) -> [f64; 3] {
        let t = at.integrals.time;
        let bodies = || self.carriers().iter().zip(&at.now.bodies);
        [
            bodies()
                .filter(|(carrier, _)| !carrier.is_massless())
                .map(|(carrier, place)| carrier.kinetic(t, place))
                .sum(),
            at.points.iter().map(|point| point.end.energy).sum(),
            bodies()
                .map(|(carrier, place)| {
                    let joint = |joint: &Guide| {
                        joint.potential(&joint.frame(t, &at.now.bodies), &place.pose)
                    };
                    carrier
                        .joint()
                        .map_or_else(|| carrier.potential(t, &place.pose), joint)
                })
                .chain(at.points.iter().map(LinkPoint::potential))
                .sum(),
        ]
    }

    /// Largest gap between rod ends and attachments, in radians and rod lengths.
    pub fn drift(&self, at: &Evaluated) -> f64 {
        let rods = self.links().iter().zip(&at.points);
        let apart = rods.map(|(link, point)| link.apart(point));
        let groups = self.joined();
        let left = groups
            .iter()
            .map(|group| group.equations_at(at).unbalanced());
        apart.chain(left).fold(0.0, f64::max)
    }

    /// Bodies at rest with the given poses.
    pub fn at_rest(&self, poses: &[Isometry3<f64>]) -> Vec<BodyMotion> {
        poses
            .iter()
            .map(|pose| BodyMotion::at_rest(*pose))
            .collect()
    }
}
