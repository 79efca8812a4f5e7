//! Membranes in motion: `[membrane]` with `[run]`, under a pressure over time, under gas, or with a piston.

use super::flow::number_or;
use crate::body::{History, PointMass, TimeLoad};
use crate::error::{Error, Result};
use crate::manifold::EquilibriumManifold;
use crate::membrane::breathing::SphereMotion;
use crate::membrane::gas::Vessel;
use crate::membrane::piston::PistonOnBalloon;
use crate::membrane::rings::DiscMotion;
use crate::membrane::{Filling, Inflated, Rubber, Shape};
use nalgebra::Vector1;
use serde_json::{Map, Value, json};

/// A membrane in motion, in the scene's units.
#[derive(Debug, Clone, PartialEq)]
pub struct InflationScene {
    /// Shape, material and sizes.
    pub membrane: Inflated,
    /// Constants of Biderman's law, which has the others as parts.
    pub constants: [f64; 4],
    /// The part with mass: the membrane, or a piston.
    pub mover: Mover,
    /// Duration of the motion.
    pub duration: f64,
    /// Number of equally spaced output times.
    pub samples: usize,
}

/// The part with mass of a membrane in motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Mover {
    /// The membrane itself, at rest and unloaded at the start.
    Membrane {
        /// Mass per unloaded volume.
        density: f64,
        /// Number of rings of a disc.
        elements: usize,
        /// A pressure over time, or gas.
        filling: Filling,
    },
    /// A heavy piston on the vessel of a light balloon.
    Piston(PistonScene),
}

/// A heavy piston on a vessel of gas, with a light balloon.
#[derive(Debug, Clone, PartialEq)]
pub struct PistonScene {
    /// Mass of the piston.
    pub mass: f64,
    /// Area of the piston.
    pub area: f64,
    /// Force on the piston, into the vessel, over time.
    pub force: History,
    /// Content p V of the gas.
    pub contents: f64,
    /// The vessel.
    pub vessel: Vessel,
    /// Stretch of the balloon at the start; `None`: the equilibrium under the force.
    pub stretch: Option<f64>,
    /// Velocity of the piston into the vessel at the start.
    pub velocity: f64,
}

/// A membrane at the start of its motion, in the form of the library.
pub enum InflationStart {
    /// A sphere with mass.
    Sphere(Box<SphereMotion>),
    /// A disc with mass.
    Disc(Box<DiscMotion>),
    /// A piston.
    Piston(Box<PistonStart>),
}

/// A piston at the start of a motion, in the units of [`PistonScale`].
pub struct PistonStart {
    /// The balloon with its vessel.
    pub manifold: PistonOnBalloon,
    /// The piston with its force.
    pub body: PointMass<1>,
    /// Stretch of the balloon.
    pub stretch: f64,
    /// Velocity of the piston.
    pub velocity: f64,
    /// The units.
    pub scale: PistonScale,
}

/// Units of a piston on a balloon: radius and B1 x thickness of the balloon, and the mass of the piston are 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PistonScale {
    /// Unit of length, R0.
    pub length: f64,
    /// Unit of force, B1 d R0.
    pub force: f64,
    /// Unit of time, (m/(B1 d))^(1/2).
    pub time: f64,
}

impl PistonScale {
    /// Unit of energy.
    pub fn energy(&self) -> f64 {
        self.force * self.length
    }

    /// Unit of velocity.
    pub fn velocity(&self) -> f64 {
        self.length / self.time
    }

    fn pressure(&self) -> f64 {
        self.force / self.length.powi(2)
    }

    /// A force over time in these units.
    fn inward(&self, history: &History) -> History {
        let Self { force, time, .. } = *self;
        let next = |at: &f64| Some(history.next_break(*at)).filter(|at| *at < f64::INFINITY);
        let breaks = std::iter::successors(next(&f64::NEG_INFINITY), next);
        let breaks = breaks.map(|at| at / time).collect();
        let history = history.clone();
        let scaled = move |t: f64| {
            let [f, first, second] = history.with_rates(t * time);
            [f, first * time, second * time * time].map(|x| x / force)
        };
        History::custom(scaled, breaks)
    }
}

impl InflationScene {
    /// The membrane at the start.
    ///
    /// # Errors
    /// Numbers that make no motion: gas in a flat disc without a vessel, a piston at the bottom of its vessel or on a
    /// balloon that is slack.
    pub fn start(&self) -> Result<InflationStart> {
        match &self.mover {
            Mover::Membrane {
                density,
                elements,
                filling,
            } => match self.membrane.shape {
                Shape::Sphere => {
                    let motion = SphereMotion::new(self.membrane, *density, filling.clone())?;
                    let folds = self.folds(filling)?;
                    let motion = motion.watching(folds);
                    Ok(InflationStart::Sphere(Box::new(motion)))
                }
                Shape::Disc => {
                    let motion =
                        DiscMotion::new(self.membrane, *density, *elements, filling.clone())?;
                    Ok(InflationStart::Disc(Box::new(motion)))
                }
            },
            Mover::Piston(piston) => {
                let start = piston.start(&self.membrane, self.constants)?;
                Ok(InflationStart::Piston(Box::new(start)))
            }
        }
    }

    /// Stretches at the folds at rest: limit points under a pressure, extrema of the content under gas.
    fn folds(&self, filling: &Filling) -> Result<Vec<f64>> {
        let found = match filling {
            Filling::Pressure(_) => self.membrane.limit_points()?,
            Filling::Gas { vessel, .. } => {
                vessel.folds(&self.membrane, 1.0, Inflated::MOST_STRETCH)?
            }
        };
        Ok(found.iter().map(|at| at.stretch).collect())
    }

    /// TOML tables of the scene.
    pub(super) fn tables(&self) -> Map<String, Value> {
        let membrane = &self.membrane;
        let mut table = json!({
            "shape": membrane.shape.name(), "radius": membrane.radius,
            "thickness": membrane.thickness, "law": { "biderman": self.constants },
        });
        let mut tables = Map::new();
        let mut add = |name: &str, table: Value| tables.insert(name.to_owned(), table);
        let gas = |contents: f64, vessel: &Vessel| json!({ "contents": contents, "volume": vessel.volume, "outside": vessel.outside });
        match &self.mover {
            Mover::Membrane {
                density,
                elements,
                filling,
            } => {
                table["density"] = json!(density);
                if membrane.shape == Shape::Disc {
                    table["elements"] = json!(elements);
                }
                match filling {
                    Filling::Pressure(history) => {
                        add("loads", json!({ "pressure": number_or(history) }));
                    }
                    Filling::Gas { contents, vessel } => {
                        add("gas", gas(*contents, vessel));
                    }
                }
            }
            Mover::Piston(piston) => {
                add("gas", gas(piston.contents, &piston.vessel));
                add("body", json!({ "mass": piston.mass, "area": piston.area }));
                add("loads", json!({ "force": number_or(&piston.force) }));
                let mut start = json!({ "velocity": piston.velocity });
                if let Some(stretch) = piston.stretch {
                    start["stretch"] = json!(stretch);
                }
                add("start", start);
            }
        }
        add("membrane", table);
        add(
            "run",
            json!({ "duration": self.duration, "samples": self.samples }),
        );
        tables
    }
}

impl PistonScene {
    /// Volume that is left in the vessel at a state of the balloon: c/(p + p_a) - V.
    pub fn room(&self, pressure: f64, volume: f64) -> f64 {
        self.contents / (pressure + self.vessel.outside) - volume
    }

    /// The piston at the start, in the units of [`PistonScale`].
    fn start(&self, balloon: &Inflated, constants: [f64; 4]) -> Result<PistonStart> {
        let first = constants[0];
        let scale = PistonScale {
            length: balloon.radius,
            force: first * balloon.thickness * balloon.radius,
            time: (self.mass / (first * balloon.thickness)).sqrt(),
        };
        let volume = scale.length.powi(3);
        let vessel = Vessel::new(
            self.vessel.outside / scale.pressure(),
            self.vessel.volume / volume,
        )?;
        let rubber = Rubber::biderman(constants.map(|constant| constant / first))?;
        let unit = Inflated::new(balloon.shape, rubber, 1.0, 1.0)?;
        let area = self.area / scale.length.powi(2);
        let manifold = PistonOnBalloon::new(unit, vessel, self.contents / scale.energy(), area)?;
        let force = TimeLoad::new(Vector1::new(1.0), scale.inward(&self.force))?;
        let stretch = match self.stretch {
            Some(stretch) => stretch,
            None => {
                let pressure = self.force.at(0.0) / self.area;
                let settled = balloon.at_pressure(pressure);
                let settled = settled.map_err(|error| {
                    error.context(
                        "without start.stretch the balloon is in equilibrium under loads.force",
                    )
                });
                settled?.stretch
            }
        };
        let at = balloon.at_stretch(stretch)?;
        if manifold.point(&Vector1::new(stretch)).is_none() {
            return Err(Error::domain(format!(
                "the gas has the absolute pressure {:?} at the stretch {stretch} of the balloon: it must be > 0, so give \
                 gas.outside or a larger start.stretch",
                at.pressure + self.vessel.outside
            )));
        }
        let room = self.room(at.pressure, at.volume);
        if !(room > 0.0) {
            return Err(Error::domain(format!(
                "the balloon of the volume {:?} holds more than all of the gas, gas.contents = {:?}, at the stretch \
                 {stretch}: give more gas",
                at.volume, self.contents
            )));
        }
        Ok(PistonStart {
            manifold,
            body: PointMass::new(1.0)?.with_force(force),
            stretch,
            velocity: self.velocity / scale.velocity(),
            scale,
        })
    }
}
