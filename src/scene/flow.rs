//! Flows in tubes: `[tube]` with `[run]`.

use super::TubeWall;
use crate::body::History;
use crate::error::Result;
use crate::flow::starling::Starling;
use crate::flow::{FlowEnd, FlowState, FlowTube, Friction, Place, Reservoir};
use serde_json::{Map, Value, json};
use std::sync::Arc;

/// A flow in a tube, in the scene's units. The computation uses these units without scaling.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowScene {
    /// The wall.
    pub wall: TubeWall,
    /// The tube with its fluid, or a lumped one.
    pub medium: FlowMedium,
    /// Duration of the motion.
    pub duration: f64,
    /// Number of equally spaced output times.
    pub samples: usize,
    /// Bound on the time step; `None`: the speed of waves alone bounds the step.
    pub time_step: Option<f64>,
}

/// A tube with a length, or a lumped one.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowMedium {
    /// A tube with a length.
    Tube(TubeFlow),
    /// A Starling resistor.
    Lumped(Lumped),
}

/// A tube with a length, its fluid, surroundings, ends and start.
#[derive(Debug, Clone, PartialEq)]
pub struct TubeFlow {
    /// Length.
    pub length: f64,
    /// Number of cells.
    pub cells: usize,
    /// Density of the fluid.
    pub density: f64,
    /// Friction at the wall.
    pub friction: WallFriction,
    /// Pressure outside.
    pub outside: OutsidePressure,
    /// The ends x = 0 and x = length.
    pub ends: [FlowEndScene; 2],
    /// Area and velocity at the start.
    pub start: FlowStart,
}

/// Friction at the wall, with the kinematic viscosity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WallFriction {
    /// None.
    None,
    /// 8 pi nu u.
    Linear(f64),
    /// Darcy's law with its two regimes.
    Darcy(f64),
}

/// Pressure outside.
#[derive(Debug, Clone, PartialEq)]
pub enum OutsidePressure {
    /// In time, the same along the tube.
    Uniform(History),
    /// Rows \[x, p\] along the tube.
    Table(Vec<[f64; 2]>),
}

/// The system beyond an end.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowEndScene {
    /// The tube goes on.
    Open,
    /// No flow.
    Closed,
    /// A flow into the tube upstream, out of the tube downstream.
    Flow(History),
    /// An inflow faster than waves: flow and area A/A0.
    Supercritical {
        /// Flow into the tube.
        flow: f64,
        /// Area A/A0.
        area: f64,
    },
    /// A reservoir.
    Reservoir(Reservoir),
}

/// Area over A0 and velocity at the start.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowStart {
    /// One state everywhere.
    Uniform([f64; 2]),
    /// Rows \[x, A/A0\], and the velocity.
    Table(Vec<[f64; 2]>, f64),
    /// Two states.
    Riemann {
        /// \[area, velocity\] left of `at`.
        left: [f64; 2],
        /// \[area, velocity\] right of `at`.
        right: [f64; 2],
        /// Place at which the two states meet.
        at: f64,
    },
}

/// A Starling resistor, in the units of its wall law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lumped {
    /// Inertances l1, l2.
    pub inertance: [f64; 2],
    /// Resistances r1, r2.
    pub resistance: [f64; 2],
    /// Volume of the collapsible part over its area, lam.
    pub volume: f64,
    /// Part chi of the dynamic pressure that is lost.
    pub loss: f64,
    /// Pressure outside, E.
    pub outside: f64,
    /// Pressures Pu, Pd at the ends.
    pub pressure: [f64; 2],
    /// Area at the start; `None`: the equilibrium, with the inflow 2 % above.
    pub area: Option<f64>,
}

/// The value of a table at `x`, linear between its rows.
fn interpolated(rows: &[[f64; 2]], x: f64) -> f64 {
    let after = rows
        .partition_point(|row| row[0] <= x)
        .clamp(1, rows.len() - 1);
    let ([a, from], [b, to]) = (rows[after - 1], rows[after]);
    from + (to - from) * ((x - a) / (b - a)).clamp(0.0, 1.0)
}

impl FlowScene {
    /// The tube in the form of the library; `None` for a lumped one.
    ///
    /// # Errors
    /// A wall law without a flow.
    pub fn tube(&self) -> Result<Option<FlowTube>> {
        let FlowMedium::Tube(tube) = &self.medium else {
            return Ok(None);
        };
        let (law, place) = self.wall.flow_law()?;
        let (outside, table) = match &tube.outside {
            OutsidePressure::Uniform(history) => (history.clone(), None),
            OutsidePressure::Table(rows) => (History::Constant(0.0), Some(rows.clone())),
        };
        let places = move |x: f64| Place {
            outside: table.as_ref().map_or(0.0, |rows| interpolated(rows, x)),
            ..place
        };
        let friction = match tube.friction {
            WallFriction::None => Friction::None,
            WallFriction::Linear(viscosity) => Friction::Linear(viscosity),
            WallFriction::Darcy(viscosity) => Friction::Darcy(viscosity),
        };
        let end = |end: &FlowEndScene| match end {
            FlowEndScene::Open => FlowEnd::Open,
            FlowEndScene::Closed => FlowEnd::Closed,
            FlowEndScene::Flow(history) => FlowEnd::Flow(history.clone()),
            FlowEndScene::Supercritical { flow, area } => FlowEnd::Supercritical(FlowState {
                area: *area,
                velocity: flow / (area * place.area),
            }),
            FlowEndScene::Reservoir(reservoir) => FlowEnd::Reservoir(reservoir.clone()),
        };
        let start = tube.start.clone();
        Ok(Some(FlowTube {
            law,
            length: tube.length,
            density: tube.density,
            places: Arc::new(places),
            outside,
            friction,
            ends: [end(&tube.ends[0]), end(&tube.ends[1])],
            start: Arc::new(move |x| start.at(x)),
        }))
    }

    /// The resistor in the form of the library; `None` for a tube with a length.
    ///
    /// # Errors
    /// A wall law without a flow.
    pub fn resistor(&self) -> Result<Option<Starling>> {
        let FlowMedium::Lumped(lumped) = &self.medium else {
            return Ok(None);
        };
        let (law, _) = self.wall.flow_law()?;
        Ok(Some(Starling {
            law,
            inertance: lumped.inertance,
            resistance: lumped.resistance,
            volume: lumped.volume,
            loss: lumped.loss,
            outside: lumped.outside,
            pressure: lumped.pressure,
        }))
    }

    /// TOML tables of the scene.
    pub(super) fn tables(&self) -> Map<String, Value> {
        let mut tables = Map::new();
        let mut tube = self.wall.table();
        match &self.medium {
            FlowMedium::Tube(flow) => {
                tube["length"] = json!(flow.length);
                tube["cells"] = json!(flow.cells);
                let mut fluid = json!({ "density": flow.density });
                let (word, viscosity) = match flow.friction {
                    WallFriction::None => ("none", None),
                    WallFriction::Linear(viscosity) => ("linear", Some(viscosity)),
                    WallFriction::Darcy(viscosity) => ("darcy", Some(viscosity)),
                };
                fluid["friction"] = json!(word);
                if let Some(viscosity) = viscosity {
                    fluid["viscosity"] = json!(viscosity);
                }
                tables.insert("fluid".to_owned(), fluid);
                let pressure = match &flow.outside {
                    OutsidePressure::Uniform(history) => number_or(history),
                    OutsidePressure::Table(rows) => json!({ "table": rows }),
                };
                tables.insert("outside".to_owned(), json!({ "pressure": pressure }));
                for (name, end) in ["upstream", "downstream"].into_iter().zip(&flow.ends) {
                    tables.extend(end.table().map(|table| (name.to_owned(), table)));
                }
                let start = match &flow.start {
                    FlowStart::Uniform([area, velocity]) => {
                        json!({ "area": area, "velocity": velocity })
                    }
                    FlowStart::Table(rows, velocity) => {
                        json!({ "area": { "table": rows }, "velocity": velocity })
                    }
                    FlowStart::Riemann { left, right, at } => {
                        json!({ "left": left, "right": right, "at": at })
                    }
                };
                tables.insert("start".to_owned(), start);
            }
            FlowMedium::Lumped(lumped) => {
                tube["lumped"] = json!({
                    "l1": lumped.inertance[0], "l2": lumped.inertance[1], "lam": lumped.volume,
                    "r1": lumped.resistance[0], "r2": lumped.resistance[1], "chi": lumped.loss, "E": lumped.outside,
                });
                for (name, pressure) in ["upstream", "downstream"].into_iter().zip(lumped.pressure)
                {
                    tables.insert(name.to_owned(), json!({ "pressure": pressure }));
                }
                if let Some(area) = lumped.area {
                    tables.insert("start".to_owned(), json!({ "area": area }));
                }
            }
        }
        let mut run = json!({ "duration": self.duration, "samples": self.samples });
        if let Some(step) = self.time_step {
            run["time_step"] = json!(step);
        }
        tables.insert("run".to_owned(), run);
        tables.insert("tube".to_owned(), tube);
        tables
    }
}

/// A constant as a number, another history as a table.
pub(super) fn number_or(history: &History) -> Value {
    match history {
        History::Constant(value) => json!(value),
        other => json!(other),
    }
}

impl FlowEndScene {
    fn table(&self) -> Option<Value> {
        Some(match self {
            Self::Open => return None,
            Self::Closed => json!({ "closed": true }),
            Self::Flow(history) => json!({ "flow": number_or(history) }),
            Self::Supercritical { flow, area } => json!({ "flow": flow, "area": area }),
            Self::Reservoir(reservoir) => json!({
                "pressure": number_or(&reservoir.pressure), "resistance": reservoir.resistance,
                "inertance": reservoir.inertance, "recovery": reservoir.recovery,
            }),
        })
    }
}

impl FlowStart {
    fn at(&self, x: f64) -> FlowState {
        let [area, velocity] = match self {
            Self::Uniform(state) => *state,
            Self::Table(rows, velocity) => [interpolated(rows, x), *velocity],
            Self::Riemann { left, right, at } => {
                if x < *at {
                    *left
                } else {
                    *right
                }
            }
        };
        FlowState { area, velocity }
    }
}
