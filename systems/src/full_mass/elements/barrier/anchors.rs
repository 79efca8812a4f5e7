//! Anchors of friction, which follow slipping points and go over to other meshes.

use crate::full_mass::elements::{ElementAssembly, ElementMoment};
use nalgebra::DVector;
use std::sync::Arc;

impl ElementAssembly {
    /// True if surfaces rub.
    pub fn rubs(&self) -> bool {
        let barrier = self.barrier.as_ref();
        barrier.is_some_and(|barrier| barrier.given.rubs())
    }

    /// The assembly with anchors after a step to a moment.
    #[must_use]
    pub fn anchored(mut self, at: &ElementMoment) -> Self {
        let Some(barrier) = self.barrier.clone().filter(|barrier| barrier.given.rubs()) else {
            return self;
        };
        let mut anchors = self.surface_places(&barrier, at);
        for (k, rod) in self.rods.iter().enumerate() {
            for (number, element) in rod.elements.iter().enumerate() {
                let first = self.first_point(&barrier, k, number);
                let nodes = &at.nodes[k][element.nodes.clone()];
                let _ = self.each_touching(&barrier, (k, number), nodes, |j, _, touching, _| {
                    anchors[first + j] = touching.point.place - touching.held(&barrier);
                });
            }
        }
        let first = self.first_point(&barrier, self.rods.len(), 0);
        let _ = self.each_touching_ball(&barrier, &at.balls, |k, _, touching, _| {
            anchors[first + k] = touching.point.place - touching.held(&barrier);
        });
        let near = (barrier.given.rods_rub()).then(|| self.anchored_rods(&barrier, at));
        if let Some(own) = &mut self.barrier {
            own.anchors = Arc::new(anchors);
            own.near = near.map(Arc::new).or(own.near.take());
        }
        self
    }

    /// The assembly in the state `y` with the displacements of `from` from its anchors in the state `before`.
    pub fn anchored_as(
        mut self,
        from: &Self,
        y: &DVector<f64>,
        before: &DVector<f64>,
    ) -> Option<Self> {
        let (Some(own), Some(old)) = (self.barrier.clone(), &from.barrier) else {
            return Some(self);
        };
        if old.anchors.is_empty() {
            return Some(self);
        }
        let (places, held) = (
            self.surface_places(&own, &self.moment(y)?),
            from.surface_places(old, &from.moment(before)?),
        );
        let mut anchors = places.clone();
        for (k, rod) in self.rods.iter().enumerate() {
            for (number, element) in rod.elements.iter().enumerate() {
                let first = self.first_point(&own, k, number);
                for j in 0..own.values.len() {
                    let x = j as f64 / own.intervals() as f64;
                    let s = element.from + (element.to - element.from) * x;
                    let (there, x) = from.rods[k].element_at(s);
                    let nearest = (x * old.intervals() as f64).round() as usize;
                    let old_point = from.first_point(old, k, there) + nearest;
                    anchors[first + j] -= held[old_point] - old.anchors[old_point];
                }
            }
        }
        let [new_balls, old_balls] = [(&self, &own), (from, old)]
            .map(|(model, barrier)| model.first_point(barrier, self.rods.len(), 0));
        for k in 0..own.given.balls.len() {
            anchors[new_balls + k] -= held[old_balls + k] - old.anchors[old_balls + k];
        }
        let near = if own.given.rods_rub() {
            let [at, before] = [self.moment(y)?, from.moment(before)?];
            Some(self.anchored_rods_as(&own, &at, (from, old), &before))
        } else {
            None
        };
        if let Some(own) = &mut self.barrier {
            own.anchors = Arc::new(anchors);
            own.near = near.map(Arc::new).or(own.near.take());
        }
        Some(self)
    }
}
