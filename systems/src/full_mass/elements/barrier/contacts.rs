//! The contacts of a moment: what obstacles and rods push, with the reactions and frictions.

use super::{Barrier, Press, TouchingPoint};
use crate::full_mass::elements::{ElementAssembly, ElementMoment};
use crate::full_mass::obstacles::Bearer;
use nalgebra::{Isometry3, Matrix3, Vector3};

/// Distance of neighbouring points of a contact of two rods, over the distance of the points of a rod.
const NEIGHBOURS: f64 = 4.0;

/// A stretch of a rod, or a body, that an obstacle or a rod pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarrierContact {
    /// The rod, or the listed body.
    pub of: Touching,
    /// The obstacle, or the other stretch of a rod.
    pub other: Touched,
    /// Centre of the reactions on the surface.
    pub point: Vector3<f64>,
    /// Unit normal, from the obstacle or the other rod.
    pub normal: Vector3<f64>,
    /// Sum of the reactions.
    pub reaction: f64,
    /// Sum of the frictions.
    pub friction: Vector3<f64>,
    /// Velocity over the other surface, in the mean over the reactions.
    pub slip: Vector3<f64>,
    /// Coefficient of friction.
    pub coefficient: f64,
}

/// The rod or the body at an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touching {
    /// A stretch of a rod, in arclengths of the unloaded rod.
    Rod {
        /// The rod.
        rod: usize,
        /// From and to, and the centre of the reactions.
        stretch: [f64; 2],
        /// Centre of the reactions.
        centre: f64,
    },
    /// The ball or point of a body.
    Body(Bearer),
}

/// The partner of a rod or body at a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touched {
    /// The obstacle of this number.
    Obstacle(usize),
    /// A stretch of a rod, in arclengths of the unloaded rod.
    Rod {
        /// The rod.
        rod: usize,
        /// From and to.
        stretch: [f64; 2],
        /// Centre of the reactions.
        centre: f64,
    },
}

/// A point of a contact of two stretches of rods, seen from the first of the two.
struct PairPoint {
    rods: [usize; 2],
    /// Places along the rods, in [0, 1], and arclengths.
    at: [f64; 2],
    s: [f64; 2],
    /// Largest distances of neighbouring points of one contact, along the rods.
    step: [f64; 2],
    touching: TouchingPoint,
    press: Press,
}

impl ElementAssembly {
    /// The contacts of rods with each other: stretches along which points of both rods follow each other.
    fn contacts_of_rods(&self, barrier: &Barrier, at: &ElementMoment) -> Vec<BarrierContact> {
        let mut points = Vec::new();
        let _ = self.each_rod_touch(barrier, &at.nodes, |_, touch| {
            let (mut touching, mut press) = (touch.at, touch.at.press(barrier));
            if !(press.reaction[0] > 0.0) {
                return;
            }
            let [a, b] = &touch.sides;
            let (first, second) = if (a.rod, a.s) <= (b.rod, b.s) {
                (a, b)
            } else {
                touching = touching.turned();
                press.friction = -press.friction;
                (b, a)
            };
            // The place where the surfaces meet.
            touching.point.place = touch.place();
            let both = [first, second];
            let length = |rod: usize| self.rods[rod].law().length();
            let step = both.map(|side| {
                let element = &self.rods[side.rod].elements[side.element];
                NEIGHBOURS * (element.to - element.from) / barrier.intervals() as f64
            });
            points.push(PairPoint {
                rods: both.map(|side| side.rod),
                at: both.map(|side| side.s),
                s: both.map(|side| side.s * length(side.rod)),
                step,
                touching,
                press,
            });
        });
        points.sort_by(|a, b| {
            (a.rods, a.at[0])
                .partial_cmp(&(b.rods, b.at[0]))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let mut found: Vec<(BarrierContact, [f64; 2])> = Vec::new();
        for point in &points {
            let begun = found.iter_mut().rev().find(|(contact, last)| {
                let near =
                    |k: usize| (point.at[k] - last[k]).abs() < point.step[0].max(point.step[1]);
                contact.rods() == Some(point.rods) && near(0) && near(1)
            });
            match begun {
                Some((contact, last)) => {
                    contact.take_pair(point);
                    *last = point.at;
                }
                None => {
                    let mut contact = BarrierContact::begun(
                        point.rods[0],
                        Touched::Rod {
                            rod: point.rods[1],
                            stretch: [f64::INFINITY, f64::NEG_INFINITY],
                            centre: 0.0,
                        },
                        &point.touching,
                    );
                    contact.take_pair(point);
                    found.push((contact, point.at));
                }
            }
        }
        found.into_iter().map(|(contact, _)| contact).collect()
    }

    /// The contacts of a moment: stretches of rods whose points are pushed one after the other.
    pub fn barrier_contacts(&self, at: &ElementMoment) -> Vec<BarrierContact> {
        let Some(barrier) = &self.barrier else {
            return Vec::new();
        };
        let mut found: Vec<BarrierContact> = Vec::new();
        for (k, rod) in self.rods.iter().enumerate() {
            for obstacle in 0..barrier.given.obstacles.len() {
                let mut open: Option<(f64, BarrierContact)> = None;
                for (number, element) in rod.elements.iter().enumerate() {
                    let nodes = &at.nodes[k][element.nodes.clone()];
                    let step = (element.to - element.from) / barrier.intervals() as f64;
                    let act = |j: usize,
                               other: usize,
                               touching: &TouchingPoint,
                               _: &Matrix3<f64>| {
                        let press = touching.press(barrier);
                        if other != obstacle || !(press.reaction[0] > 0.0) {
                            return;
                        }
                        let s = element.from + step * j as f64;
                        let radius = barrier.given.rods[k].radius;
                        let length = rod.law().length();
                        match &mut open {
                            Some((last, contact)) if s - *last < 1.5 * step => {
                                contact.take(touching, &press, (s * length, radius));
                                *last = s;
                            }
                            _ => {
                                found.extend(open.take().map(|(_, contact)| contact));
                                let mut contact =
                                    BarrierContact::begun(k, Touched::Obstacle(obstacle), touching);
                                contact.take(touching, &press, (s * length, radius));
                                open = Some((s, contact));
                            }
                        }
                    };
                    let _ = self.each_touching(barrier, (k, number), nodes, act);
                }
                found.extend(open.take().map(|(_, contact)| contact));
            }
        }
        let _ = self.each_touching_ball(barrier, &at.balls, |k, obstacle, touching, _| {
            let (ball, press) = (&barrier.given.balls[k], touching.press(barrier));
            if press.reaction[0] > 0.0 {
                let mut contact = BarrierContact::begun(0, Touched::Obstacle(obstacle), touching);
                contact.of = Touching::Body(ball.on);
                contact.take(touching, &press, (0.0, ball.surface.radius));
                found.push(contact);
            }
        });
        found.extend(self.contacts_of_rods(barrier, at));
        let frame = &barrier.given.frame;
        found
            .iter()
            .map(|contact| contact.averaged(frame))
            .collect()
    }
}

impl BarrierContact {
    fn begun(rod: usize, other: Touched, touching: &TouchingPoint) -> Self {
        Self {
            of: Touching::Rod {
                rod,
                stretch: [f64::INFINITY, f64::NEG_INFINITY],
                centre: 0.0,
            },
            other,
            point: Vector3::zeros(),
            normal: Vector3::zeros(),
            reaction: 0.0,
            friction: Vector3::zeros(),
            slip: Vector3::zeros(),
            coefficient: touching.friction,
        }
    }

    /// The two rods of a contact of rods.
    fn rods(&self) -> Option<[usize; 2]> {
        match (self.of, self.other) {
            (Touching::Rod { rod: a, .. }, Touched::Rod { rod: b, .. }) => Some([a, b]),
            _ => None,
        }
    }

    /// Adds a point of two rods.
    fn take_pair(&mut self, point: &PairPoint) {
        self.take(&point.touching, &point.press, (point.s[0], 0.0));
        if let Touched::Rod {
            stretch, centre, ..
        } = &mut self.other
        {
            let s = point.s[1];
            *stretch = [stretch[0].min(s), stretch[1].max(s)];
            *centre += s * point.press.reaction[0];
        }
    }

    /// Adds a point at the arclength `s` of a rod of this `radius`.
    fn take(&mut self, touching: &TouchingPoint, press: &Press, (s, radius): (f64, f64)) {
        let (n, reaction) = (touching.normal, press.reaction[0]);
        if let Touching::Rod {
            stretch, centre, ..
        } = &mut self.of
        {
            *stretch = [stretch[0].min(s), stretch[1].max(s)];
            *centre += s * reaction;
        }
        self.reaction += reaction;
        self.friction += press.friction;
        self.point += (touching.point.place - n * radius) * reaction;
        self.normal += n * reaction;
        self.slip += touching.point.velocity * reaction;
    }

    /// The contact with means in place of sums over the reactions, in the world outside of the `frame`.
    fn averaged(&self, frame: &Isometry3<f64>) -> Self {
        let mut mean = *self;
        let over = 1.0 / self.reaction;
        if let Touching::Rod { centre, .. } = &mut mean.of {
            *centre *= over;
        }
        if let Touched::Rod { centre, .. } = &mut mean.other {
            *centre *= over;
        }
        mean.point = frame.transform_point(&(self.point * over).into()).coords;
        mean.slip = frame * (self.slip * over);
        mean.friction = frame * self.friction;
        mean.normal = frame * self.normal.normalize();
        mean
    }
}
