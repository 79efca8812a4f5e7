//! `rod.model = "bar"`: longitudinal waves in a bar with mass.

use crate::bar::{Bar, End, Material, Scheme, Stress};
use crate::body::History;
use crate::error::Result;
use serde_json::{Map, Value, json};

/// A bar, its ends, its load and its run, in the scene's units. The computation uses these units without scaling.
#[derive(Debug, Clone, PartialEq)]
pub struct BarScene {
    /// Length of the undeformed bar.
    pub length: f64,
    /// Area of the undeformed cross-section.
    pub area: f64,
    /// Mass per undeformed volume.
    pub density: f64,
    /// Stress law.
    pub law: Stress,
    /// Numerical scheme.
    pub scheme: Scheme,
    /// Number of cells or elements, or of nodes of the spectral scheme.
    pub cells: usize,
    /// Permission to use a scheme that is unstable at every step.
    pub unstable: bool,
    /// True for each of the ends X = 0 and X = length that is held.
    pub walls: [bool; 2],
    /// Mass attached at X = length; `None`: no mass.
    pub mass: Option<f64>,
    /// Force along +X at X = length; `None`: no force.
    pub force: Option<History>,
    /// Uniform stretch at the start.
    pub stretch: f64,
    /// Uniform velocity at the start.
    pub velocity: f64,
    /// Duration of the motion.
    pub duration: f64,
    /// Number of equally spaced output times.
    pub samples: usize,
    /// Bound on the time step; `None`: the scheme's own bound.
    pub time_step: Option<f64>,
}

impl BarScene {
    /// The bar in the form of the solver.
    ///
    /// # Errors
    /// Numbers that make no stress law.
    pub fn bar(&self) -> Result<Bar> {
        let force = || self.force.clone().unwrap_or(History::Constant(0.0));
        let end = |wall, mass: Option<f64>, force: History| match (wall, mass) {
            (true, _) => End::Wall,
            (false, Some(mass)) => End::Mass { mass, force },
            (false, None) => End::Loaded(force),
        };
        let ends = [
            end(self.walls[0], None, History::Constant(0.0)),
            end(self.walls[1], self.mass, force()),
        ];
        let material = Material::new(&self.law, self.density)?;
        let start = [self.stretch, self.velocity];
        Ok(Bar::new(material, self.length, self.area, ends)?.started(move |_| start))
    }

    /// TOML tables of the scene.
    pub(super) fn tables(&self) -> Map<String, Value> {
        let law = match &self.law {
            Stress::Linear(modulus) => json!({ "linear": modulus }),
            Stress::NeoHookean(c) => json!({ "neo_hookean": c }),
            Stress::Mooney(c1, c2) => json!({ "mooney": [c1, c2] }),
            Stress::Biderman(b) => json!({ "biderman": b }),
            Stress::Polynomial(a) => json!({ "polynomial": a }),
            Stress::Table(rows) => json!({ "table": rows }),
        };
        let held = |wall| if wall { "wall" } else { "free" };
        let mut tables = Map::new();
        let mut add = |name: &str, table: Value| tables.insert(name.to_owned(), table);
        let mut run = json!({ "duration": self.duration, "samples": self.samples });
        if let Some(step) = self.time_step {
            run["time_step"] = json!(step);
        }
        let mut rod = json!({
            "model": "bar", "length": self.length, "area": self.area, "density": self.density, "law": law,
            "scheme": self.scheme.name(), "cells": self.cells, "base": held(self.walls[0]), "tip": held(self.walls[1]),
        });
        if self.unstable {
            rod["unstable"] = json!(true);
        }
        add("rod", rod);
        if let Some(mass) = self.mass {
            add("body", json!({ "mass": mass }));
        }
        if let Some(force) = &self.force {
            add("loads", json!({ "force": force }));
        }
        add(
            "start",
            json!({ "stretch": self.stretch, "velocity": self.velocity }),
        );
        add("run", run);
        tables
    }
}
