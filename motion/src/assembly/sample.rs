//! Samples of the state of an assembly.

use crate::contact::ContactSample;
use crate::ledger::Ledger;
use crate::state::{RodCurve, SectionState, State};
use nalgebra::{Isometry3, Vector3, Vector6};
use snaprod_systems::assembly::{
    Assembly, BodyMotion, Configuration, Evaluated, MovingSection, Tether,
};
use snaprod_systems::math::se3::join;
use snaprod_systems::rod::RodSection;
use snaprod_systems::section::Strain;
use std::sync::Arc;

/// Tolerance of the sections of a sample.
const SHAPE: f64 = 1e-12;

/// The state of an assembly at one moment.
#[derive(Debug, Clone)]
pub struct AssemblySample {
    assembly: Arc<Assembly>,
    /// Bodies, rods, time.
    pub at: Evaluated,
    /// Energies, and the work exchanged since the start.
    pub ledger: Ledger,
    /// Morse index of every rod with its ends held; 0 under loads along it that turn with it, where there is none.
    pub indices: Vec<usize>,
    /// Contacts with obstacles; None without obstacles.
    pub contact: Option<ContactSample>,
}

impl AssemblySample {
    pub(super) fn new(
        assembly: Arc<Assembly>,
        at: Evaluated,
        released: f64,
        indices: &[usize],
    ) -> Self {
        let at = assembly.with_joint_rates(at);
        let [kinetic, elastic, potential] = assembly.energies(&at);
        let rod_kinetic = assembly.rod_kinetic(&at, SHAPE);
        let ledger = Ledger {
            rod_kinetic,
            kinetic,
            elastic,
            potential,
            dissipated: released + at.integrals.drag,
            work: at.integrals.work,
        };
        Self {
            assembly,
            at,
            ledger,
            indices: indices.to_vec(),
            contact: None,
        }
    }

    /// Sections of rod `link` at arc lengths in [0, 1], in growing order, seen from its base; empty if the
    /// rod cannot be integrated.
    pub fn rod_sections(&self, link: usize, places: &[f64]) -> Vec<RodSection> {
        let point = &self.at.points[link];
        let time = self.at.integrals.time;
        let Ok(rod) = self.assembly.links()[link].seen_at(time, &point.base.pose.rotation) else {
            return Vec::new();
        };
        let at: Vec<f64> = places.iter().map(|s| s * rod.rod().length()).collect();
        let held = point.held();
        let q = &self.at.now.charts[link];
        rod.shape(q, &held, &at, SHAPE).unwrap_or_default()
    }

    /// Rod `link` as a tether ([`Tether::of`]); `None` with joints that have axes.
    pub fn tether(&self, link: usize) -> Option<Tether> {
        if self.assembly.is_jointed(link) {
            return None;
        }
        Tether::of(self.assembly.links().get(link)?, self.at.points.get(link)?)
    }

    /// Effective mass against the pull of a tether ([`Tether::resistance`]).
    pub(super) fn resistance(&self, link: usize, tether: &Tether) -> Option<f64> {
        tether.resistance(&self.assembly, link, &self.at)
    }

    /// Largest distance of rod ends from their attachments.
    pub fn drift(&self) -> f64 {
        self.assembly.drift(&self.at)
    }
}

/// Quantities of one rod are those of the first rod, or without rods those of the first body.
impl State for AssemblySample {
    fn time(&self) -> f64 {
        self.at.integrals.time
    }

    fn pose(&self) -> Isometry3<f64> {
        match (self.at.points.first(), self.at.now.bodies.first()) {
            (Some(point), _) => point.end.pose,
            (None, Some(body)) => body.pose,
            (None, None) => Isometry3::identity(),
        }
    }

    fn twist(&self) -> Vector6<f64> {
        let rod = self.at.points.first().zip(self.assembly.links().first());
        match (rod, self.at.now.bodies.first()) {
            (Some((point, link)), _) => point.end_twist(link),
            (None, Some(body)) => body.twist,
            (None, None) => Vector6::zeros(),
        }
    }

    fn action(&self) -> Vector6<f64> {
        if self.at.points.is_empty() {
            return Vector6::zeros();
        }
        self.assembly.end_action(0, &self.at, SHAPE)
    }

    fn drift(&self) -> f64 {
        Self::drift(self)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.contact.as_ref()
    }

    fn index(&self) -> Option<usize> {
        // Loads that turn with a rod have no potential: the equilibria of such a rod have no index.
        (!self.assembly.has_turning()).then(|| self.indices.iter().sum())
    }

    fn configuration(&self) -> Option<&Configuration> {
        Some(&self.at.now)
    }

    /// The bodies without the nodes of joints.
    fn bodies(&self) -> &[BodyMotion] {
        &self.at.now.bodies[..self.assembly.solids().len()]
    }

    fn groove_forces(&self) -> Vec<Option<Vector3<f64>>> {
        let mut forces = self.assembly.groove_forces(&self.at);
        forces.truncate(self.assembly.solids().len());
        forces
    }

    fn strains_of(&self, rod: usize, places: &[f64]) -> Vec<Strain> {
        self.rod_sections(rod, places)
            .iter()
            .map(|section| section.strain)
            .collect()
    }

    fn moving_sections(&self, rod: usize, places: &[f64]) -> Vec<SectionState> {
        let held = self.assembly.links().get(rod).map(|link| link.rod());
        let free = || {
            Some(
                self.assembly
                    .free()
                    .get(rod - self.assembly.links().len())?
                    .rod(),
            )
        };
        let Some(given) = held.or_else(free) else {
            return Vec::new();
        };
        let at: Vec<f64> = places.iter().map(|s| s * given.length()).collect();
        let sections = self.assembly.moving_sections(&self.at, rod, &at, SHAPE);
        let state = |MovingSection { section, twist }| {
            let pose = section.pose();
            let back = pose.rotation.inverse();
            SectionState {
                pose,
                twist,
                strain: section.strain,
                resultants: join(&(back * section.couple), &(back * section.force)),
            }
        };
        sections
            .unwrap_or_default()
            .into_iter()
            .map(state)
            .collect()
    }

    fn sections(&self, points: usize) -> RodCurve {
        let last = points.max(2) - 1;
        let places: Vec<f64> = (0..=last).map(|k| k as f64 / last as f64).collect();
        self.rod_sections(0, &places)
            .iter()
            .map(|section| (section.s, section.pose()))
            .collect()
    }
}
