//! Facts of a run known before its start: model, units, names, bounds, treatment of masses.

use super::joints::RunJoint;
use crate::assembly::Joint;
use crate::error::Quantity;
use crate::motion::Outcome;
use crate::scene::{ModelKind, Obstacle, RodMassNote, Run, Scales, Units};
use crate::study::Solid;
use crate::study::stations::PlacedStation;

/// Facts of a run known before its start, in the units of the scene.
#[derive(Debug, Clone)]
pub struct RunHeader {
    /// Model of the one rod; `None` for an assembly.
    pub model: Option<ModelKind>,
    /// True if the mass of rods is followed in full.
    pub full: bool,
    /// The scene's units.
    pub units: Units,
    /// Scales from units of the (first) rod and body to units of the scene.
    pub scales: Scales,
    /// The scene, with its defaults.
    pub scene: serde_json::Value,
    /// The `[run]` table of the scene: duration, tolerance, bounds, samples.
    pub run: Run,
    /// True if the scene fixes the strain nodes.
    pub fixed_nodes: bool,
    /// Bodies, in order; the one body of a rod has no name.
    pub bodies: Vec<RunBody>,
    /// Rods, in order, those with a free end last; the one rod of a scene has no name.
    pub rods: Vec<RunRod>,
    /// Stations on the rods.
    pub stations: Vec<PlacedStation>,
    /// The obstacles of the scene.
    pub obstacles: Vec<Obstacle>,
    /// Width of the barrier of obstacles, in lengths of the shortest rod; `None` without a barrier.
    pub barrier_gap: Option<f64>,
    /// True if bodies hit obstacles or each other.
    pub has_contact: bool,
    /// Joints with axes, whose angles and shifts are columns.
    pub joints: Vec<RunJoint>,
    /// True if the ledger contains kinetic energy of rods.
    pub heavy: bool,
    /// True if forces in time do work on the body of one rod.
    pub driven: bool,
    /// True if its weight, or another load along it, bends the one rod: the sheets of the light elastica do not apply.
    pub loaded: bool,
    /// Treatment of the mass of each elastic rod of known mass.
    pub masses: Vec<RodMassNote>,
    /// The viscosity of a planar rod at small rates.
    pub viscosity: Option<f64>,
    /// Moving strains of the one rod: names, and indices in (u1, .. v3).
    pub strains: Vec<(&'static str, usize)>,
}

/// A body of a run.
#[derive(Debug, Clone)]
pub struct RunBody {
    /// Name; empty for the one body of a rod.
    pub name: String,
    /// The body as figures show it.
    pub solid: Solid,
    /// True for a free end, where no body is.
    pub is_end: bool,
}

/// A rod of a run.
#[derive(Debug, Clone)]
pub struct RunRod {
    /// Name; empty for the one rod of a scene.
    pub name: String,
    /// Diameter for contact; `None` without contact detection.
    pub thickness: Option<f64>,
    /// Joints of base and end to the ground; `None` at a body or free end.
    pub grounds: [Option<Joint>; 2],
    /// True if the end of the rod is free.
    pub free: bool,
}

impl RunBody {
    /// True if the body slides in a groove.
    pub fn is_grooved(&self) -> bool {
        self.solid.groove.is_some()
    }
}

impl RunHeader {
    /// True for several rods and bodies.
    pub fn is_assembly(&self) -> bool {
        self.model.is_none()
    }

    /// True if rods move in space.
    pub fn in_space(&self) -> bool {
        self.model.is_none_or(ModelKind::in_space)
    }

    /// True if rods are always in equilibrium, with snaps.
    pub fn is_elastic(&self) -> bool {
        self.model.map_or(!self.full, ModelKind::is_elastic)
    }

    /// True for one planar rod on its sheets.
    pub fn is_sheet(&self) -> bool {
        self.model == Some(ModelKind::Sheet)
    }

    /// Name of rod `rod` of an assembly; `None` for one rod.
    pub fn rod_name(&self, rod: usize) -> Option<&str> {
        let rod = self.rods.get(rod).filter(|_| self.is_assembly())?;
        Some(&rod.name)
    }

    /// Rods held at both ends.
    pub fn held(&self) -> impl Iterator<Item = &RunRod> {
        self.rods.iter().filter(|rod| !rod.free)
    }

    /// Message for `cut` branches that were not followed.
    pub(super) fn cut(&self, cut: usize) -> String {
        let were = if cut == 1 {
            "branch was"
        } else {
            "branches were"
        };
        format!(
            "{cut} {were} not followed: the bound branches = {} was reached; raise it in [run]",
            self.run.branches
        )
    }

    /// Reason for an early end, without its time.
    pub(super) fn reason(&self, outcome: &Outcome) -> String {
        match outcome {
            Outcome::StepLimit => format!(
                "the bound max_steps = {} was reached; raise it in [run]",
                self.run.max_steps
            ),
            Outcome::SnapLimit => format!(
                "the bound max_snaps = {} was reached; raise it in [run]",
                self.run.max_snaps
            ),
            Outcome::Stuck(stuck) => stuck
                .message()
                .in_units(&self.scales.of_messages(self.units))
                .to_string(),
            Outcome::SelfContact(contact) => self.touching(contact.rods, contact.at),
            Outcome::RodTouch(touch) => {
                let name = self.obstacles.get(touch.obstacle);
                let s = self.scales.outward(Quantity::Length, touch.s);
                format!(
                    "{} {} {:?} at s = {s:.6}{}; {}",
                    self.rod_name(touch.rod).unwrap_or("the rod"),
                    touch.bound.verb(),
                    name.map_or("", |obstacle| &obstacle.name),
                    Units::suffix(self.units.length()),
                    touch.bound.why()
                )
            }
            Outcome::GrooveEnd(body) if self.is_assembly() => {
                let body = self.bodies.get(*body).map_or("", |body| &body.name);
                format!(
                    "{body} has come to the end of its groove; make the groove longer, or close it"
                )
            }
            outcome => outcome.to_string(),
        }
    }

    /// Message for a contact of two rods at these arclengths.
    fn touching(&self, rods: [usize; 2], at: [f64; 2]) -> String {
        let place = |s: f64| format!("s = {s:.6}{}", Units::suffix(self.units.length()));
        let [a, b] = rods.map(|rod| self.rod_name(rod).unwrap_or("the rod"));
        let (s, to) = (place(at[0]), place(at[1]));
        let where_ = if a == b {
            format!("{a} touches itself at {s} and {to}")
        } else {
            format!("{a} at {s} touches {b} at {to}")
        };
        format!(
            "{where_}; the run does not follow the forces of this contact: rods that all have inertia = \"full\" touch each other at a run.tolerance of 1e-5 or more; to ignore contact, set contact_diameter = 0 in the rod"
        )
    }
}
