//! The contacts of a moment: what obstacles push, with the reactions and frictions.

use super::{Press, TouchingPoint};
use crate::full_mass::elements::{ElementAssembly, ElementMoment};
use crate::full_mass::obstacles::Bearer;
use nalgebra::{Isometry3, Vector3};

/// A stretch of a rod, or a body, that an obstacle pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarrierContact {
    /// The rod, or the listed body.
    pub of: Touching,
    /// The obstacle.
    pub obstacle: usize,
    /// Centre of the reactions on the surface.
    pub point: Vector3<f64>,
    /// Unit normal, from the obstacle.
    pub normal: Vector3<f64>,
    /// Sum of the reactions.
    pub reaction: f64,
    /// Sum of the frictions.
    pub friction: Vector3<f64>,
    /// Velocity, in the mean over the reactions.
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

impl ElementAssembly {
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
                    let act = |j: usize, other: usize, touching: &TouchingPoint| {
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
                                let mut contact = BarrierContact::begun(k, obstacle, touching);
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
        let _ = self.each_touching_ball(barrier, &at.balls, |k, obstacle, touching| {
            let (ball, press) = (&barrier.given.balls[k], touching.press(barrier));
            if press.reaction[0] > 0.0 {
                let mut contact = BarrierContact::begun(0, obstacle, touching);
                contact.of = Touching::Body(ball.on);
                contact.take(touching, &press, (0.0, ball.surface.radius));
                found.push(contact);
            }
        });
        let frame = &barrier.given.frame;
        found
            .iter()
            .map(|contact| contact.averaged(frame))
            .collect()
    }
}

impl BarrierContact {
    fn begun(rod: usize, obstacle: usize, touching: &TouchingPoint) -> Self {
        Self {
            of: Touching::Rod {
                rod,
                stretch: [f64::INFINITY, f64::NEG_INFINITY],
                centre: 0.0,
            },
            obstacle,
            point: Vector3::zeros(),
            normal: Vector3::zeros(),
            reaction: 0.0,
            friction: Vector3::zeros(),
            slip: Vector3::zeros(),
            coefficient: touching.friction,
        }
    }

    /// Adds a point at the arclength `s` of a rod of this `radius`.
    fn take(&mut self, touching: &TouchingPoint, press: &Press, (s, radius): (f64, f64)) {
        let (n, reaction) = (touching.gap.normal, press.reaction[0]);
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
        mean.point = frame.transform_point(&(self.point * over).into()).coords;
        mean.slip = frame * (self.slip * over);
        mean.friction = frame * self.friction;
        mean.normal = frame * self.normal.normalize();
        mean
    }
}
