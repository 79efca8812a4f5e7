//! Newton's matrix of rods in elements: stiffness, damping and masses by pairs of sites, and its factors.

use super::block_lu::{BlockLu, Pattern};
use super::system::{ElementMoment, INTEGRALS, NodeNow, PLACE, TWIST, by_spin, point, point_rate};
use super::{Carrier, ElementAssembly, ElementNode, ElementRod, Freedoms, RodElement};
use crate::math::se3::{Turn, conjugate, halves, join, product};
use crate::section::Strain;
use crate::solve::system::{Factor, Linearised, Scalar};
use nalgebra::{DVector, Matrix3, Matrix4x3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use std::sync::Arc;

/// Matrices of the linearised balance: K, C, M in blocks.
#[derive(Debug)]
struct Matrices<const D: usize> {
    place: Vec<SMatrix<f64, D, D>>,
    velocity: Vec<SMatrix<f64, D, D>>,
    mass: Vec<SMatrix<f64, D, D>>,
    inverse: Vec<SMatrix<f64, D, D>>,
    axes: [usize; D],
}

/// Jacobian of rods in elements.
#[derive(Debug)]
pub struct ElementLinear {
    shared: Arc<SharedMatrices>,
}

#[derive(Debug)]
struct SharedMatrices {
    matrices: Sized,
    pattern: Arc<Pattern>,
    spins: Vec<Matrix4x3<f64>>,
}

#[derive(Debug)]
enum Sized {
    Plane(Matrices<3>),
    Space(Matrices<6>),
}

/// Factors of sigma^2 M + sigma C + K.
#[derive(Debug)]
pub struct ElementFactor<T: Scalar> {
    shared: Arc<SharedMatrices>,
    sigma: T,
    factors: ElementFactors<T>,
}

#[derive(Debug)]
enum ElementFactors<T: Scalar> {
    Plane(BlockLu<T, 3>),
    Space(BlockLu<T, 6>),
}

/// Stiffness and damping of an element by its nodes, 6 x 6 for each pair.
struct ElementStiffness {
    place: Vec<Matrix6<f64>>,
    velocity: Vec<Matrix6<f64>>,
}

impl ElementStiffness {
    /// Adds the obstacles around element `number` of rod `k`.
    fn push_by_obstacles(
        &mut self,
        model: &ElementAssembly,
        (k, number): (usize, usize),
        now: &[NodeNow],
    ) -> Option<()> {
        let pairs = self.place.len();
        let count = pairs.isqrt();
        model.stiffen_element((k, number), now, |i, j, [place, velocity]| {
            if self.velocity.is_empty() {
                self.velocity = vec![Matrix6::zeros(); pairs];
            }
            let add = |block: &mut Matrix6<f64>, part: Matrix3<f64>| {
                let mut forces = block.fixed_view_mut::<3, 3>(3, 3);
                forces += part;
            };
            add(&mut self.place[i * count + j], place);
            add(&mut self.velocity[i * count + j], velocity);
        })
    }
}

impl ElementAssembly {
    /// Derivatives of minus the forces of an element by displacements and velocities of its nodes.
    fn stiffness(
        &self,
        rod: &ElementRod,
        element: &RodElement,
        now: &[NodeNow],
    ) -> Option<ElementStiffness> {
        let nodes = &now[element.nodes.clone()];
        let count = nodes.len();
        let length = rod.length(element);
        let over = 1.0 / length;
        let damped = rod.law().is_damped();
        let spins: Vec<Matrix4x3<f64>> = nodes.iter().map(|node| by_spin(&node.turn)).collect();
        let turns: Vec<Turn> = nodes
            .iter()
            .zip(&spins)
            .map(|(node, by)| by * node.spin)
            .collect();
        let mut found = ElementStiffness {
            place: vec![Matrix6::zeros(); count * count],
            velocity: vec![Matrix6::zeros(); if damped { count * count } else { 0 }],
        };
        let table = &*self.table;
        for (g, x) in table.points.iter().enumerate() {
            let (values, slopes) = (&table.values[g], &table.slopes[g]);
            let at = point(nodes, values, slopes, over);
            let e = at.strain();
            let rate = if damped {
                at.strain_rate(&point_rate(nodes, &turns, values, slopes, over), &e)
            } else {
                Strain::zeros()
            };
            let s = element.from + (element.to - element.from) * x;
            let weight = table.weights[g] * length;
            let answer = rod.answer(s, &e, &rate)?;
            let (held, held_rate) = rod.admitted(s, &e, &rate)?;
            let mut tangent = rod.law().stiffness(s, &held, &held_rate)?;
            for (k, spring) in &rod.springs {
                for by in [&mut tangent.by_strain, &mut tangent.by_rate] {
                    by.row_mut(*k).fill(0.0);
                    by.column_mut(*k).fill(0.0);
                }
                tangent.by_strain[(*k, *k)] = *spring;
            }
            let resultants = (answer.elastic + answer.friction) * weight;
            let (first, second) = at.second(&resultants, &e);
            let gradient = at.gradient(&resultants, &e);
            // Strains and second derivatives by the displacement of each node.
            let mut by_node = Vec::with_capacity(count);
            let mut half = Vec::with_capacity(count);
            for i in 0..count {
                let (value, slope) = (values[i], slopes[i] * over);
                let turn =
                    first.fixed_view::<6, 4>(0, 0) * value + first.fixed_view::<6, 4>(0, 4) * slope;
                let mut by = SMatrix::<f64, 6, 6>::zeros();
                by.fixed_view_mut::<6, 3>(0, 0)
                    .copy_from(&(turn * spins[i]));
                by.fixed_view_mut::<6, 3>(0, 3)
                    .copy_from(&(first.fixed_view::<6, 3>(0, 8) * slope));
                by_node.push(by);
                let turn = second.fixed_view::<11, 4>(0, 0) * value
                    + second.fixed_view::<11, 4>(0, 4) * slope;
                let mut by = SMatrix::<f64, 11, 6>::zeros();
                by.fixed_view_mut::<11, 3>(0, 0)
                    .copy_from(&(turn * spins[i]));
                by.fixed_view_mut::<11, 3>(0, 3)
                    .copy_from(&(second.fixed_view::<11, 3>(0, 8) * slope));
                half.push(by);
            }
            for j in 0..count {
                let pulled = tangent.by_strain * by_node[j] * weight;
                let slowed = tangent.by_rate * by_node[j] * weight;
                for i in 0..count {
                    let (value, slope) = (values[i], slopes[i] * over);
                    let turn = half[j].fixed_view::<4, 6>(0, 0) * value
                        + half[j].fixed_view::<4, 6>(4, 0) * slope;
                    let mut block = by_node[i].tr_mul(&pulled);
                    let turned = spins[i].tr_mul(&turn);
                    for c in 0..6 {
                        for r in 0..3 {
                            block[(r, c)] += turned[(r, c)];
                            block[(3 + r, c)] += slope * half[j][(8 + r, c)];
                        }
                    }
                    found.place[i * count + j] += block;
                    if damped {
                        found.velocity[i * count + j] += by_node[i].tr_mul(&slowed);
                    }
                }
            }
            for i in 0..count {
                let by_turn = gradient.turn * values[i] + gradient.turn_along * (slopes[i] * over);
                let x = product(&by_turn, &conjugate(&nodes[i].turn));
                let couple = Vector3::new(x[1], x[2], x[3]) * 0.5;
                let own = Matrix3::identity() * (-0.25 * x[0]) - couple.cross_matrix() * 0.5;
                let mut block = found.place[i * count + i].fixed_view_mut::<3, 3>(0, 0);
                block += own;
            }
        }
        Some(found)
    }

    fn matrices<const D: usize>(
        &self,
        at: &ElementMoment,
        axes: [usize; D],
    ) -> Option<Matrices<D>> {
        let blocks = self.pattern.blocks();
        let picked = |m: &Matrix6<f64>| SMatrix::<f64, D, D>::from_fn(|i, j| m[(axes[i], axes[j])]);
        let mut place = vec![SMatrix::<f64, D, D>::zeros(); blocks];
        let mut velocity = vec![SMatrix::<f64, D, D>::zeros(); blocks];
        let mut mass = vec![SMatrix::<f64, D, D>::zeros(); self.sites.len()];
        let rods = self.rods.iter().zip(&at.nodes).zip(&at.forces);
        for (k, ((rod, now), forces)) in rods.enumerate() {
            let seen = rod.seen_at(at.t)?;
            for (number, element) in rod.elements.iter().enumerate() {
                let mut found = self.stiffness(&seen, element, now)?;
                found.push_by_obstacles(self, (k, number), now)?;
                let nodes = &rod.nodes[element.nodes.clone()];
                let now = &now[element.nodes.clone()];
                let count = nodes.len();
                for i in 0..count {
                    for j in 0..count {
                        let add = |to: &mut [SMatrix<f64, D, D>], block: &Matrix6<f64>| {
                            self.spread(
                                (&nodes[i], &now[i]),
                                (&nodes[j], &now[j]),
                                block,
                                |a, b, m| {
                                    to[self.pattern.block(a, b)] += picked(m);
                                },
                            );
                        };
                        add(&mut place, &found.place[i * count + j]);
                        if let Some(block) = found.velocity.get(i * count + j) {
                            add(&mut velocity, block);
                        }
                    }
                }
            }
            for ((node, now), load) in rod.nodes.iter().zip(now).zip(&rod.turning) {
                let block = load.stiffness(&now.turn);
                self.spread((node, now), (node, now), &block, |a, b, m| {
                    place[self.pattern.block(a, b)] += picked(m);
                });
            }
            for ((node, now), wrench) in rod.nodes.iter().zip(now).zip(forces) {
                if let Some((site, block)) = turned_lever(node, now, wrench) {
                    place[site] += picked(&block);
                }
            }
        }
        self.stiffen_rods(&at.nodes, |[row, column], [by_place, by_velocity]| {
            self.spread(row, column, &by_place, |a, b, m| {
                place[self.pattern.block(a, b)] += picked(m);
            });
            self.spread(row, column, &by_velocity, |a, b, m| {
                velocity[self.pattern.block(a, b)] += picked(m);
            });
        })?;
        for (joint, (holder, action)) in self.joints.iter().zip(&at.joints) {
            let end = &self.rods[joint.rod].nodes[joint.node];
            let end_now = &at.nodes[joint.rod][joint.node];
            let both = [(&joint.holder, holder), (end, end_now)];
            let found = joint.stiffness([holder, end_now])?;
            for (i, row) in both.into_iter().enumerate() {
                for (j, column) in both.into_iter().enumerate() {
                    self.spread(row, column, &found.place[i][j], |a, b, m| {
                        place[self.pattern.block(a, b)] += picked(m);
                    });
                    self.spread(row, column, &found.velocity[i][j], |a, b, m| {
                        velocity[self.pattern.block(a, b)] += picked(m);
                    });
                }
                if let Some((site, block)) = turned_lever(row.0, row.1, &action.wrenches[i]) {
                    place[site] += picked(&block);
                }
            }
        }
        let on_balls = self.ball_nodes();
        self.stiffen_balls(&at.balls, |k, force, [by_place, by_velocity]| {
            let ball = (&on_balls[k], &at.balls[k]);
            for (to, block) in [(&mut place, by_place), (&mut velocity, by_velocity)] {
                let mut whole = Matrix6::zeros();
                whole.fixed_view_mut::<3, 3>(3, 3).copy_from(&block);
                self.spread(ball, ball, &whole, |a, b, m| {
                    to[self.pattern.block(a, b)] += picked(m)
                });
            }
            let wrench = join(&Vector3::zeros(), &force);
            if let Some((site, block)) = turned_lever(ball.0, ball.1, &wrench) {
                place[site] += picked(&block);
            }
        })?;
        for hold in &self.holds {
            let found = hold.stiffness(&at.sites);
            let ends = [Some(hold.site), hold.carrier()];
            for (i, a) in ends.iter().enumerate() {
                for (j, b) in ends.iter().enumerate() {
                    if let (Some(a), Some(b)) = (a, b) {
                        let block = found.fixed_view::<6, 6>(6 * i, 6 * j).into_owned();
                        place[self.pattern.block(*a, *b)] += picked(&block);
                    }
                }
            }
        }
        for (i, site) in self.sites.iter().enumerate() {
            let (pose, twist) = (at.sites[i].pose(), at.sites[i].twist());
            let acceleration = at.accelerations[i];
            for one in &site.masses {
                let wrench = if site.masses.len() == 1 {
                    at.on_sites[i]
                } else {
                    one.wrench(at.t, &pose, &twist, &acceleration)?
                };
                let linear = one.linear(at.t, &pose, &twist, &wrench)?;
                place[i] += picked(&linear.by_pose);
                velocity[i] += picked(&linear.by_velocity);
                mass[i] += picked(&linear.by_acceleration);
            }
            // What a site cannot do has no equations.
            for (k, axis) in axes.iter().enumerate() {
                let free = if *axis < 3 { site.turns } else { site.shifts };
                if !free {
                    mass[i].row_mut(k).fill(0.0);
                    mass[i].column_mut(k).fill(0.0);
                    mass[i][(k, k)] = 1.0;
                    place[i].row_mut(k).fill(0.0);
                    velocity[i].row_mut(k).fill(0.0);
                }
            }
        }
        let inverse = mass
            .iter()
            .map(|m| m.try_inverse())
            .collect::<Option<_>>()?;
        Some(Matrices {
            place,
            velocity,
            mass,
            inverse,
            axes,
        })
    }

    /// Calls `add` with the parts of a 6 x 6 block of two nodes that belong to pairs of sites.
    fn spread(
        &self,
        (row, row_now): (&ElementNode, &NodeNow),
        (column, column_now): (&ElementNode, &NodeNow),
        block: &Matrix6<f64>,
        mut add: impl FnMut(usize, usize, &Matrix6<f64>),
    ) {
        let simple = |node: &ElementNode, now: &NodeNow| {
            node.shift == node.turn && now.lever == Vector3::zeros()
        };
        if simple(row, row_now) && simple(column, column_now) {
            if let (Carrier::Site(a), Carrier::Site(b)) = (row.turn, column.turn) {
                add(a, b, block);
            }
            return;
        }
        // Displacement of a node per displacement of each carrier: rotation from `turn`, translation from `shift`.
        let parts = |node: &ElementNode, now: &NodeNow| {
            let mut parts = Vec::with_capacity(2);
            if let Carrier::Site(site) = node.turn {
                let mut by = Matrix6::zeros();
                by.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
                parts.push((site, by));
            }
            if let Carrier::Site(site) = node.shift {
                let mut by = Matrix6::zeros();
                by.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
                by.fixed_view_mut::<3, 3>(3, 0)
                    .copy_from(&-now.lever.cross_matrix());
                parts.push((site, by));
            }
            parts
        };
        let columns = parts(column, column_now);
        for (a, by_row) in parts(row, row_now) {
            for (b, by_column) in &columns {
                add(a, *b, &(by_row.tr_mul(block) * by_column));
            }
        }
    }
}

/// Levers turn with their body: derivative of minus the couple lever x force by a turn of the site.
fn turned_lever(
    node: &ElementNode,
    now: &NodeNow,
    wrench: &Vector6<f64>,
) -> Option<(usize, Matrix6<f64>)> {
    let site = node.shift.site()?;
    if now.lever == Vector3::zeros() {
        return None;
    }
    let mut block = Matrix6::zeros();
    let turned = -halves(wrench).1.cross_matrix() * now.lever.cross_matrix();
    block.fixed_view_mut::<3, 3>(0, 0).copy_from(&turned);
    Some((site, block))
}

impl ElementLinear {
    /// The Jacobian at a state; None outside the domain of a law.
    pub(super) fn new(model: &ElementAssembly, y: &DVector<f64>) -> Option<Self> {
        let at = model.moment(y)?;
        let matrices = match model.freedoms {
            Freedoms::Space => Sized::Space(model.matrices(&at, [0, 1, 2, 3, 4, 5])?),
            Freedoms::Plane(axis) => {
                let others = [(axis + 1) % 3 + 3, (axis + 2) % 3 + 3];
                Sized::Plane(model.matrices(&at, [axis, others[0], others[1]])?)
            }
        };
        let spins =
            (0..model.sites.len()).map(|i| by_spin(&y.fixed_rows::<4>(PLACE * i + 3).into_owned()));
        Some(Self {
            shared: Arc::new(SharedMatrices {
                matrices,
                pattern: model.pattern.clone(),
                spins: spins.collect(),
            }),
        })
    }
}

impl SharedMatrices {
    fn count(&self) -> usize {
        self.spins.len()
    }

    fn time(&self) -> usize {
        (PLACE + TWIST) * self.count()
    }

    /// Displacement and velocity of site `i` in a state-like vector.
    fn motion<T: Scalar>(&self, b: &DVector<T>, i: usize) -> [[T; 6]; 2] {
        let mut moved = [T::zero(); 6];
        let mut faster = [T::zero(); 6];
        let twist = PLACE * self.count() + TWIST * i;
        for k in 0..3 {
            moved[3 + k] = b[PLACE * i + k];
            // Columns are at right angles, of length 1/2.
            for l in 0..4 {
                moved[k] += b[PLACE * i + 3 + l] * T::from_real(4.0 * self.spins[i][(l, k)]);
            }
        }
        for (k, faster) in faster.iter_mut().enumerate() {
            *faster = b[twist + k];
        }
        [moved, faster]
    }

    /// Writes displacement and velocity of site `i`.
    fn write<T: Scalar>(&self, b: &mut DVector<T>, i: usize, moved: &[T; 6], faster: &[T; 6]) {
        let twist = PLACE * self.count() + TWIST * i;
        for k in 0..3 {
            b[PLACE * i + k] = moved[3 + k];
        }
        for l in 0..4 {
            let mut x = T::zero();
            for (k, moved) in moved.iter().take(3).enumerate() {
                x += *moved * T::from_real(self.spins[i][(l, k)]);
            }
            b[PLACE * i + 3 + l] = x;
        }
        for (k, faster) in faster.iter().enumerate() {
            b[twist + k] = *faster;
        }
    }

    fn solve<T: Scalar, const D: usize>(
        &self,
        matrices: &Matrices<D>,
        factors: &BlockLu<T, D>,
        sigma: T,
        b: &mut DVector<T>,
    ) {
        let over = T::one() / sigma;
        let count = self.count();
        let axes = &matrices.axes;
        let motions: Vec<[[T; 6]; 2]> = (0..count).map(|i| self.motion(b, i)).collect();
        // (sigma^2 M + sigma C + K) dx = M b_v + (sigma M + C) b_x,   dv = sigma dx - b_x.
        let mut right = vec![[T::zero(); D]; count];
        for (i, [moved, faster]) in motions.iter().enumerate() {
            let mass = &matrices.mass[i];
            for r in 0..D {
                for c in 0..D {
                    let pushed = faster[axes[c]] + sigma * moved[axes[c]];
                    right[i][r] += pushed * T::from_real(mass[(r, c)]);
                }
            }
        }
        let moved: Vec<[T; D]> = motions
            .iter()
            .map(|[moved, _]| std::array::from_fn(|c| moved[axes[c]]))
            .collect();
        self.pattern
            .add_scaled(&matrices.velocity, &moved, &mut right);
        factors.solve(&self.pattern, &mut right);
        for (i, [moved, faster]) in motions.into_iter().enumerate() {
            // Part of a quaternion's change along itself.
            let mut along = [T::zero(); 4];
            for (l, along) in along.iter_mut().enumerate() {
                *along = b[PLACE * i + 3 + l];
                for (k, moved) in moved.iter().take(3).enumerate() {
                    *along -= *moved * T::from_real(self.spins[i][(l, k)]);
                }
            }
            let mut next_velocity: [T; 6] = faster.map(|x| x * over);
            let mut next: [T; 6] = std::array::from_fn(|k| (moved[k] + next_velocity[k]) * over);
            for (r, axis) in axes.iter().enumerate() {
                next[*axis] = right[i][r];
                next_velocity[*axis] = right[i][r] * sigma - moved[*axis];
            }
            self.write(b, i, &next, &next_velocity);
            for (l, along) in along.into_iter().enumerate() {
                b[PLACE * i + 3 + l] += along * over;
            }
        }
        for k in self.time()..self.time() + INTEGRALS {
            b[k] *= over;
        }
    }

    fn times<const D: usize>(&self, matrices: &Matrices<D>, x: &DVector<f64>) -> DVector<f64> {
        let count = self.count();
        let axes = &matrices.axes;
        let motions: Vec<[[f64; 6]; 2]> = (0..count).map(|i| self.motion(x, i)).collect();
        let pick = |of: usize| -> Vec<SVector<f64, D>> {
            let each = motions.iter();
            each.map(|motion| SVector::from_fn(|c, _| motion[of][axes[c]]))
                .collect()
        };
        let mut push = vec![SVector::<f64, D>::zeros(); count];
        self.pattern
            .add_product(&matrices.place, &pick(0), &mut push);
        self.pattern
            .add_product(&matrices.velocity, &pick(1), &mut push);
        let mut out = DVector::zeros(x.len());
        for (i, [_, faster]) in motions.iter().enumerate() {
            let acceleration = -(matrices.inverse[i] * push[i]);
            let mut all = [0.0; 6];
            for (r, axis) in axes.iter().enumerate() {
                all[*axis] = acceleration[r];
            }
            self.write(&mut out, i, faster, &all);
        }
        out
    }
}

impl Linearised for ElementLinear {
    type Factor<T: Scalar> = ElementFactor<T>;

    fn shifted<T: Scalar>(&self, sigma: T) -> Option<ElementFactor<T>> {
        let pattern = &self.shared.pattern;
        let factors = match &self.shared.matrices {
            Sized::Plane(m) => ElementFactors::Plane(m.factored(pattern, sigma)?),
            Sized::Space(m) => ElementFactors::Space(m.factored(pattern, sigma)?),
        };
        Some(ElementFactor {
            shared: self.shared.clone(),
            sigma,
            factors,
        })
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        match &self.shared.matrices {
            Sized::Plane(m) => self.shared.times(m, x),
            Sized::Space(m) => self.shared.times(m, x),
        }
    }
}

impl<const D: usize> Matrices<D> {
    fn factored<T: Scalar>(&self, pattern: &Pattern, sigma: T) -> Option<BlockLu<T, D>> {
        BlockLu::new(
            pattern,
            &[
                (T::one(), &self.place),
                (sigma, &self.velocity),
                (sigma * sigma, &self.mass),
            ],
        )
    }
}

impl ElementFactor<f64> {
    /// True if the factored matrix, which is symmetric, is positive definite.
    pub fn is_positive(&self) -> bool {
        match &self.factors {
            ElementFactors::Plane(factors) => factors.is_positive(&self.shared.pattern),
            ElementFactors::Space(factors) => factors.is_positive(&self.shared.pattern),
        }
    }
}

impl<T: Scalar> Factor<T> for ElementFactor<T> {
    fn solve(&self, b: &mut DVector<T>) -> bool {
        let shared = &*self.shared;
        match (&shared.matrices, &self.factors) {
            (Sized::Plane(m), ElementFactors::Plane(f)) => shared.solve(m, f, self.sigma, b),
            (Sized::Space(m), ElementFactors::Space(f)) => shared.solve(m, f, self.sigma, b),
            _ => return false,
        }
        b.iter().all(|x| x.is_finite())
    }
}
