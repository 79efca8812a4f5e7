//! A state of a planar rod that touches obstacles.

use super::Sample;
use crate::contact::{ContactSample, RodContactNow, RodPartner, Rubbing};
use crate::ledger::Ledger;
use crate::state::{RodCurve, SectionState, State, bent, planar};
use nalgebra::{Isometry3, Vector6};
use snaprod_systems::manifold::EquilibriumManifold;
use snaprod_systems::rod::contact::{SheetSection, TouchPoint, TouchedSheet};
use snaprod_systems::section::Strain;

/// Step of the differences for velocities along the rod, as a change of the chart.
const CHANGE: f64 = 1e-4;

/// A state on a sheet of a rod with touches.
pub(super) struct TouchedSample<'a> {
    sheet: &'a TouchedSheet,
    sample: Sample<2>,
}

/// A touch as a contact of rod 0; `obstacles` has the obstacle of each surface.
pub(super) fn contact_of(touch: &TouchPoint, obstacles: &[usize]) -> RodContactNow {
    RodContactNow {
        rod: 0,
        partner: RodPartner::Obstacle(obstacles[touch.surface]),
        s: touch.s,
        point: touch.position,
        normal: touch.normal,
        normal_force: touch.reaction,
        stretch: [touch.s; 2],
        rubbing: Rubbing::default(),
    }
}

impl<'a> TouchedSample<'a> {
    /// The state, with its touches among the contacts.
    pub fn new(sheet: &'a TouchedSheet, mut sample: Sample<2>, obstacles: &[usize]) -> Self {
        let touches = sheet.touches(&sample.phase.q).unwrap_or_default();
        let contact = sample.contact.get_or_insert_default();
        contact.rods = (touches.iter())
            .map(|touch| contact_of(touch, obstacles))
            .collect();
        Self { sheet, sample }
    }

    fn at(&self, places: &[f64]) -> Vec<SheetSection> {
        let sections = self.sheet.sections(&self.sample.phase.q, places);
        sections.unwrap_or_default()
    }

    /// Velocities (turn, x, y) of sections; NaN on a fold.
    fn velocities(&self, places: &[f64]) -> Option<Vec<Vector6<f64>>> {
        let q = self.sample.phase.q;
        let rate = (self.sheet.point(&q)?.jacobian.lu()).solve(&self.sample.phase.v)?;
        let speed = rate.norm();
        if speed == 0.0 {
            return Some(vec![Vector6::zeros(); places.len()]);
        }
        let dt = CHANGE / speed;
        let beside = |dt: f64| self.sheet.sections(&(q + rate * dt), places);
        let (before, after) = (beside(-dt)?, beside(dt)?);
        let pairs = before.iter().zip(&after);
        let twist = pairs.map(|(a, b)| {
            let (a, b) = (a.shape, b.shape);
            let (sin, cos) = (b.theta - a.theta).sin_cos();
            let turn = sin.atan2(cos);
            Vector6::new(0.0, 0.0, turn, b.x - a.x, b.y - a.y, 0.0) / (2.0 * dt)
        });
        Some(twist.collect())
    }
}

impl State for TouchedSample<'_> {
    fn time(&self) -> f64 {
        self.sample.phase.t
    }

    fn pose(&self) -> Isometry3<f64> {
        let end = self.at(&[1.0]).first().map_or(0.0, |end| end.shape.theta);
        planar(self.sample.pose[0], self.sample.pose[1], end)
    }

    fn twist(&self) -> Vector6<f64> {
        let v = self.sample.phase.v;
        Vector6::new(0.0, 0.0, 0.0, v[0], v[1], 0.0)
    }

    fn action(&self) -> Vector6<f64> {
        let force = self.sample.force;
        Vector6::new(0.0, 0.0, 0.0, force[0], force[1], 0.0)
    }

    fn ledger(&self) -> Ledger {
        self.sample.ledger
    }

    fn index(&self) -> Option<usize> {
        Some(self.sample.index)
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.sample.contact.as_ref()
    }

    fn strains_of(&self, _rod: usize, places: &[f64]) -> Vec<Strain> {
        let sections = self.at(places);
        sections.iter().map(|at| bent(at.shape.curvature)).collect()
    }

    fn moving_sections(&self, _rod: usize, places: &[f64]) -> Vec<SectionState> {
        let unknown = || vec![Vector6::repeat(f64::NAN); places.len()];
        let twists = self.velocities(places).unwrap_or_else(unknown);
        let sections = self.at(places);
        let pairs = sections.iter().zip(twists);
        pairs
            .map(|(SheetSection { shape, force: n }, twist)| {
                let (sin, cos) = shape.theta.sin_cos();
                let force = [n[0] * sin - n[1] * cos, n[0] * cos + n[1] * sin];
                SectionState {
                    pose: planar(shape.x, shape.y, shape.theta),
                    twist,
                    strain: bent(shape.curvature),
                    resultants: Vector6::new(shape.curvature, 0.0, 0.0, 0.0, force[0], force[1]),
                }
            })
            .collect()
    }

    fn sections(&self, points: usize) -> RodCurve {
        let last = points.max(2) - 1;
        let places: Vec<f64> = (0..=last).map(|k| k as f64 / last as f64).collect();
        let sections = self.at(&places);
        sections
            .iter()
            .map(|SheetSection { shape, .. }| (shape.s, planar(shape.x, shape.y, shape.theta)))
            .collect()
    }
}
