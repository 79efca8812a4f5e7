//! Quantities of a moment: sections, strains, bodies, and how well the elements resolve them.

use super::system::{Moving, accelerated, by_spin, point, point_rate};
use super::{ElementAssembly, ElementMoment, ElementRod, Freedoms, RodElement};
use crate::assembly::BodyMotion;
use crate::body::Mass;
use crate::math::se3::{Turn, unit};
use crate::section::Strain;
use nalgebra::{DVector, Isometry3, Vector3, Vector6};

/// Stiffness of the springs of rigid strains, over that of the first ones, in the test of a plane.
const SOFT: f64 = 1e-6;
/// Rounding error of the forces in the rods, over their stiffness.
const ROUNDING: f64 = 1e-12;

/// Polynomial of Lagrange through `nodes` at x: values of the basis.
pub(super) fn lagrange(nodes: &[f64], x: f64) -> Vec<f64> {
    let value = |i: usize| -> f64 {
        let others = (0..nodes.len()).filter(|j| *j != i);
        others
            .map(|j| (x - nodes[j]) / (nodes[i] - nodes[j]))
            .product()
    };
    (0..nodes.len()).map(value).collect()
}

/// Sum of the vectors with their weights.
fn weighted(weights: &[f64], vectors: &[Vector3<f64>]) -> Vector3<f64> {
    let pairs = weights.iter().zip(vectors);
    pairs.fold(Vector3::zeros(), |sum, (weight, vector)| {
        sum + vector * *weight
    })
}

impl ElementRod {
    /// Number of the element at s, and the place in it, in [0, 1].
    pub(super) fn element_at(&self, s: f64) -> (usize, f64) {
        let last = self.elements.len() - 1;
        let number = self.elements.partition_point(|e| e.to < s).min(last);
        let element = &self.elements[number];
        (number, (s - element.from) / (element.to - element.from))
    }
}

impl ElementAssembly {
    /// Pose of the section of rod `k` at s in [0, 1].
    pub fn section(&self, at: &ElementMoment, k: usize, s: f64) -> Isometry3<f64> {
        let (number, x) = self.rods[k].element_at(s);
        let nodes = &at.nodes[k][self.rods[k].elements[number].nodes.clone()];
        let (mut position, mut turn) = (Vector3::zeros(), Turn::zeros());
        for (node, value) in nodes.iter().zip(lagrange(&self.table.nodes, x)) {
            position += node.position * value;
            turn += node.turn * value;
        }
        Isometry3::from_parts(position.into(), unit(&turn))
    }

    /// Centreline r of rod `k` at the arclength s of the unloaded rod, with dr/ds and d2r/ds2.
    pub fn centreline(&self, at: &ElementMoment, k: usize, s: f64) -> [Vector3<f64>; 3] {
        let rod = &self.rods[k];
        let (number, x) = rod.element_at(s / rod.law().length());
        let element = &rod.elements[number];
        let over = 1.0 / rod.length(element);
        let places: Vec<Vector3<f64>> = (at.nodes[k][element.nodes.clone()].iter())
            .map(|node| node.position)
            .collect();
        // Derivatives at the nodes are polynomials of the nodes' values, interpolated as the values are.
        let derived = |values: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let rows = self.table.at_nodes.iter();
            rows.map(|row| weighted(row, values) * over).collect()
        };
        let slopes = derived(&places);
        let bends = derived(&slopes);
        let basis = lagrange(&self.table.nodes, x);
        [places, slopes, bends].map(|values| weighted(&basis, &values))
    }

    /// Motion of the end of rod `k`.
    pub fn end(&self, at: &ElementMoment, k: usize) -> Option<BodyMotion> {
        Some(at.nodes[k].last()?.motion())
    }

    /// Strains at the Gauss points of an element.
    fn strains_of(&self, at: &ElementMoment, k: usize, element: &RodElement) -> Vec<Strain> {
        let over = 1.0 / self.rods[k].length(element);
        let nodes = &at.nodes[k][element.nodes.clone()];
        let points = self.table.values.iter().zip(&self.table.slopes);
        points
            .map(|(values, slopes)| point(nodes, values, slopes, over).strain())
            .collect()
    }

    /// Masses with the motions of their sites.
    fn moving_masses<'a>(
        &'a self,
        at: &'a ElementMoment,
    ) -> impl Iterator<Item = (&'a Mass, &'a Moving)> {
        let sites = self.sites.iter().zip(&at.sites);
        sites.flat_map(|(site, now)| site.masses.iter().map(move |mass| (mass, now)))
    }

    /// Sum of the sizes of all loads, the largest over `times`; bodies move as at the moment.
    pub(super) fn largest_load(&self, at: &ElementMoment, times: &[f64]) -> f64 {
        let none = Vector6::zeros();
        let force_at = |t: f64| -> f64 {
            let forces = self.moving_masses(at).map(|(mass, now)| {
                let free = mass
                    .motion(t, &now.pose(), &now.twist(), &none)
                    .acceleration;
                mass.mass() * free.fixed_rows::<3>(3).norm()
            });
            forces.sum::<f64>()
        };
        let turning = self.rods.iter().flat_map(|rod| &rod.turning);
        let turning: f64 = turning.map(|load| load.force.norm()).sum();
        let most = |most: f64, t: &f64| f64::max(most, force_at(*t));
        times.iter().fold(0.0, most) + turning
    }

    /// Largest strain of the softest spring under all loads of a time together, in radians and lengths of the rod.
    /// Loads in time are those at `times`; bodies move as at the moment. The pull of a moving mass is that on a circle
    /// with the radius of the rod. 0 without springs.
    pub fn give_under_loads(&self, at: &ElementMoment, times: &[f64]) -> f64 {
        let force = self.largest_load(at, times);
        let speed: f64 = self
            .moving_masses(at)
            .map(|(mass, now)| mass.mass() * now.twist().fixed_rows::<3>(3).norm_squared())
            .sum();
        let gives = self.rods.iter().flat_map(|rod| {
            let length = rod.law().length();
            let pull = force + speed / length;
            rod.springs.iter().map(move |(i, spring)| {
                let lever = if *i < 3 { length.powi(2) } else { 1.0 };
                pull * lever / spring
            })
        });
        gives.fold(0.0, f64::max)
    }

    /// Largest give of the springs: means over elements of strains that are held rigid, in radians and lengths of their
    /// rod, and what joints hold. Errors of the polynomials cancel in the means. `None` outside a law's domain.
    pub fn give(&self, at: &ElementMoment) -> Option<f64> {
        let mut most = 0.0_f64;
        for (k, rod) in self.rods.iter().enumerate() {
            let rod = rod.seen_at(at.t)?;
            for element in rod.elements.iter().filter(|_| !rod.springs.is_empty()) {
                let points = self.table.points.iter().zip(&self.table.weights);
                let mut mean = Strain::zeros();
                for (e, (x, weight)) in self.strains_of(at, k, element).iter().zip(points) {
                    let s = element.from + (element.to - element.from) * x;
                    mean += (e - rod.law().unloaded(s).ok()?) * *weight;
                }
                for (i, _) in &rod.springs {
                    let length = if *i < 3 { rod.law().length() } else { 1.0 };
                    most = most.max(mean[*i].abs() * length);
                }
            }
        }
        let joints = at.joints.iter().map(|(_, action)| action.give);
        Some(joints.fold(most, f64::max))
    }

    /// Strains of rod `k` at places in [0, 1], from those at the Gauss points.
    pub fn strains(&self, at: &ElementMoment, k: usize, places: &[f64]) -> Vec<Strain> {
        let rod = &self.rods[k];
        let of = |s: &f64| {
            let (number, x) = rod.element_at(*s);
            let strains = self.strains_of(at, k, &rod.elements[number]);
            let values = lagrange(&self.table.points, x);
            strains
                .iter()
                .zip(values)
                .fold(Strain::zeros(), |sum, (e, value)| sum + e * value)
        };
        places.iter().map(of).collect()
    }

    /// Resultants (couple, force) of rod `k` along the directors at places in [0, 1], from those at the Gauss points.
    /// `None` outside the law's domain.
    pub fn resultants(
        &self,
        at: &ElementMoment,
        k: usize,
        places: &[f64],
    ) -> Option<Vec<Vector6<f64>>> {
        let rod = self.rods[k].seen_at(at.t)?;
        let of = |s: &f64| {
            let (number, x) = rod.element_at(*s);
            let element = &rod.elements[number];
            let nodes = &at.nodes[k][element.nodes.clone()];
            let over = 1.0 / rod.length(element);
            let turns: Vec<Turn> = nodes
                .iter()
                .map(|node| by_spin(&node.turn) * node.spin)
                .collect();
            let mut sum = Vector6::zeros();
            let table = &*self.table;
            for (g, value) in lagrange(&table.points, x).into_iter().enumerate() {
                let (values, slopes) = (&table.values[g], &table.slopes[g]);
                let here = point(nodes, values, slopes, over);
                let e = here.strain();
                let moving = point_rate(nodes, &turns, values, slopes, over);
                let rate = here.strain_rate(&moving, &e);
                let s = element.from + (element.to - element.from) * table.points[g];
                let answer = rod.answer(s, &e, &rate)?;
                sum += (answer.elastic + answer.friction) * value;
            }
            Some(sum)
        };
        places.iter().map(of).collect()
    }

    /// Dissipation per length and time of rod `k` at places in [0, 1].
    pub fn dissipation(&self, at: &ElementMoment, k: usize, places: &[f64]) -> Vec<f64> {
        let rod = &self.rods[k];
        let points = self.table.points.len();
        let of = |s: &f64| {
            let (number, x) = rod.element_at(*s);
            let lost = &at.lost[k][number * points..(number + 1) * points];
            let values = lagrange(&self.table.points, x);
            lost.iter()
                .zip(values)
                .map(|(d, value)| d * value)
                .sum::<f64>()
                .max(0.0)
        };
        places.iter().map(of).collect()
    }

    /// Motions of the listed bodies.
    pub fn motions(&self, at: &ElementMoment) -> Vec<BodyMotion> {
        let bodies = at.sites[..self.bodies].iter();
        bodies
            .map(|site| BodyMotion {
                pose: site.pose(),
                twist: site.twist(),
            })
            .collect()
    }

    /// (couple, force) of the first rod on the body or support at its end.
    pub fn action(&self, at: &ElementMoment) -> Vector6<f64> {
        let Some((rod, forces)) = self.rods.first().zip(at.forces.first()) else {
            return Vector6::zeros();
        };
        let (Some(node), Some(force)) = (rod.nodes.last(), forces.last()) else {
            return Vector6::zeros();
        };
        let Some(site) = node.turn.site().filter(|_| !rod.is_held) else {
            return *force;
        };
        // A free end: the wrench of the bodies at the end, without the last piece of the rod.
        let (pose, twist) = (at.sites[site].pose(), at.sites[site].twist());
        let bodies = self.sites[site].masses.iter().skip(1);
        let wrenches =
            bodies.filter_map(|mass| mass.wrench(at.t, &pose, &twist, &at.accelerations[site]));
        wrenches.fold(Vector6::zeros(), |sum, wrench| sum + wrench)
    }

    /// For each rod and interval between breaks: the largest of the last coefficients of places in its elements, of
    /// both places and what the rotations of an element move.
    pub fn tails(&self, at: &ElementMoment) -> Vec<Vec<f64>> {
        let of = |(k, rod): (usize, &ElementRod)| {
            let mut first = 0;
            let counts = &self.mesh.elements[k];
            let intervals = counts.iter().map(|count| {
                let elements = &rod.elements[first..first + count];
                first += count;
                let tails = elements.iter().map(|element| {
                    let nodes = &at.nodes[k][element.nodes.clone()];
                    let length = rod.length(element);
                    let tail = |weights: &[f64]| {
                        let (mut position, mut turn) = (Vector3::zeros(), Turn::zeros());
                        for (node, weight) in nodes.iter().zip(weights) {
                            position += node.position * *weight;
                            turn += node.turn * *weight;
                        }
                        position.norm().max(2.0 * length * turn.norm())
                    };
                    let [before, last] = &self.table.tails;
                    tail(last).max(tail(before).min(tail(last) * 4.0))
                });
                tails.fold(0.0, f64::max)
            });
            intervals.collect()
        };
        self.rods.iter().enumerate().map(of).collect()
    }

    /// (angular velocity, velocity) of the section of rod `k` at s in [0, 1], interpolated between the nodes.
    pub(super) fn twist_at(&self, at: &ElementMoment, k: usize, s: f64) -> Vector6<f64> {
        let (number, x) = self.rods[k].element_at(s);
        let nodes = &at.nodes[k][self.rods[k].elements[number].nodes.clone()];
        let values = lagrange(&self.table.nodes, x);
        let parts = nodes.iter().zip(values);
        parts.fold(Vector6::zeros(), |sum, (node, value)| {
            sum + node.motion().twist * value
        })
    }

    /// Motion of the section of rod `k` at s in [0, 1], interpolated between the nodes.
    pub fn motion_at(&self, at: &ElementMoment, k: usize, s: f64) -> BodyMotion {
        BodyMotion {
            pose: self.section(at, k, s),
            twist: self.twist_at(at, k, s),
        }
    }

    /// Largest part of accelerations and velocities out of the plane of the freedoms in a state, relative to the
    /// largest of all; 0 in space. None outside the domain of a law.
    ///
    /// The accelerations are those with soft springs in place of rigid strains, and forces below the rounding of the
    /// stiffnesses count as 0: on light nodes they would be large accelerations.
    pub fn leaves_plane(&self, y: &DVector<f64>) -> Option<f64> {
        if self.freedoms == Freedoms::Space {
            return Some(0.0);
        }
        let soft = self.clone().with_freedoms(Freedoms::Space).with_hold(SOFT);
        let at = soft.moment(y)?;
        let noise = ROUNDING * soft.stiffest();
        let (mut off, mut all) = (0.0_f64, f64::MIN_POSITIVE);
        for (i, (site, wrench)) in at.sites.iter().zip(&at.on_sites).enumerate() {
            let mut felt = *wrench;
            for k in (0..6).filter(|k| !self.is_free(*k)) {
                if felt[k].abs() <= noise {
                    felt[k] = 0.0;
                }
            }
            let (acceleration, ..) = accelerated(at.t, &self.sites[i].masses, site, &felt)?;
            for twist in [site.twist(), soft.freed(i, acceleration)] {
                for k in 0..6 {
                    all = all.max(twist[k].abs());
                    if !self.is_free(k) {
                        off = off.max(twist[k].abs());
                    }
                }
            }
        }
        Some(off / all)
    }

    /// Largest stiffness of the rods at their bases, unloaded, springs of rigid strains included.
    fn stiffest(&self) -> f64 {
        let each = self.rods.iter().map(|rod| {
            let law = rod.law();
            let rest = law.unloaded(0.0).ok();
            let stiffness = rest.and_then(|rest| law.stiffness(0.0, &rest, &Strain::zeros()));
            let own = stiffness.map_or(0.0, |stiffness| stiffness.by_strain.amax());
            let springs = rod.springs.iter().map(|(_, spring)| *spring);
            springs.fold(own, f64::max)
        });
        each.fold(0.0, f64::max)
    }
}
