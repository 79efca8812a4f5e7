//! Light walls under pressure: `[tube]` and `[membrane]`.

use super::Units;
use crate::error::{Error, Result};
use crate::flow::{FlowLaw, Place};
use crate::membrane::gas::Vessel;
use crate::membrane::{Inflated, InflatedState};
use crate::ring::Ring;
use crate::tube::{PowerLaw, ThickWall, Tube, TubeSection};
use serde_json::{Map, Value, json};

/// A wall under pressure at rest, in the scene's units. The computation uses these units without scaling.
#[derive(Debug, Clone, PartialEq)]
pub enum WallScene {
    /// A section of a tube.
    Tube(TubeScene),
    /// A membrane.
    Membrane(MembraneScene),
}

/// The wall of a tube.
#[derive(Debug, Clone, PartialEq)]
pub struct TubeWall {
    /// Radius of the middle line without load.
    pub radius: f64,
    /// Thickness without load.
    pub thickness: Option<f64>,
    /// Stiffness of the wall.
    pub stiffness: WallStiffness,
    /// Number of lobes.
    pub mode: u32,
    /// Wall law.
    pub law: TubeLaw,
    /// Stretch along the axis.
    pub stretch: f64,
}

/// A section of a tube.
#[derive(Debug, Clone, PartialEq)]
pub struct TubeScene {
    /// The wall.
    pub wall: TubeWall,
    /// Density of the fluid; `None`: no speed of pulses is told.
    pub density: Option<f64>,
    /// Load or area of the section.
    pub state: TubeLoad,
    /// The branch to follow, if any.
    pub follow: Option<WallBranch>,
}

/// Stiffness of the wall of a tube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WallStiffness {
    /// Young's modulus E and Poisson's ratio nu.
    Material([f64; 2]),
    /// Bending stiffness D per axial length.
    Bending(f64),
}

/// Wall law of a tube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TubeLaw {
    /// An inextensible ring, round up to its buckling.
    Ring,
    /// A ring that stretches along itself.
    Extensible,
    /// A thick round wall of neo-Hookean material.
    NeoHookean,
    /// Kp (alpha^m - alpha^n): the exponents [m, n].
    Power([f64; 2]),
}

/// Load of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TubeLoad {
    /// Pressure outside less inside.
    Pressure(f64),
    /// Area over that of the unloaded section.
    Area(f64),
}

/// A membrane at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct MembraneScene {
    /// Shape, material and sizes.
    pub membrane: Inflated,
    /// Constants of Biderman's law, which has the others as parts.
    pub constants: [f64; 4],
    /// The load, or the stretch.
    pub state: MembraneLoad,
    /// The branch to follow, if any.
    pub follow: Option<WallBranch>,
}

/// Load of a membrane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MembraneLoad {
    /// Pressure inside less outside.
    Pressure(f64),
    /// Stretch at the pole.
    Stretch(f64),
    /// Contents p V of gas in the membrane and its vessel.
    Gas {
        /// p V, absolute.
        contents: f64,
        /// The vessel.
        vessel: Vessel,
    },
}

/// A branch of a wall in one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallBranch {
    /// The parameter that varies.
    pub parameter: WallParameter,
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of evenly spaced points.
    pub points: usize,
}

/// Parameter of the branch of a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallParameter {
    /// `outside.pressure`
    Pressure,
    /// `tube.area`
    Area,
    /// `membrane.stretch`
    Stretch,
}

impl WallParameter {
    /// Path of the parameter in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pressure => "outside.pressure",
            Self::Area => "tube.area",
            Self::Stretch => "membrane.stretch",
        }
    }

    /// Unit of the parameter.
    pub fn unit(self, units: Units) -> &'static str {
        match self {
            Self::Pressure => units.stress(),
            Self::Area | Self::Stretch => "",
        }
    }
}

impl TubeWall {
    /// The tube in the form of the library. A stretch along the axis makes an incompressible wall narrower and thinner
    /// by its root; of another Poisson's ratio by the power -nu.
    ///
    /// # Errors
    /// Numbers that make no wall.
    pub fn tube(&self) -> Result<Tube> {
        let thickness = || {
            self.thickness.ok_or_else(|| {
                Error::domain("this wall needs tube.thickness: add `thickness = 1e-3` in [tube]")
            })
        };
        let (narrower, bending) = match self.stiffness {
            WallStiffness::Bending(stiffness) => (1.0, stiffness),
            WallStiffness::Material([modulus, nu]) => {
                let narrower = self.stretch.powf(-nu);
                let thin = thickness()? * narrower;
                (narrower, modulus * thin.powi(3) / (12.0 * (1.0 - nu * nu)))
            }
        };
        let radius = self.radius * narrower;
        match self.law {
            TubeLaw::Ring => Ok(Tube::ring(Ring::new(self.mode)?, radius, bending)),
            TubeLaw::Extensible => {
                let stiffness = 12.0 * (self.radius / thickness()?).powi(2);
                Ok(Tube::ring(
                    Ring::extensible(self.mode, stiffness)?,
                    radius,
                    bending,
                ))
            }
            TubeLaw::NeoHookean => {
                let WallStiffness::Material([modulus, _]) = self.stiffness else {
                    return Err(Error::domain(
                        "a neo-Hookean wall needs tube.material in place of tube.stiffness",
                    ));
                };
                let thickness = thickness()?;
                Ok(Tube::neo_hookean(ThickWall {
                    shear_modulus: modulus / 3.0,
                    inner_radius: self.radius - 0.5 * thickness,
                    thickness,
                    stretch: self.stretch,
                }))
            }
            TubeLaw::Power([inflated, collapsed]) => {
                let law = PowerLaw {
                    stiffness: bending / radius.powi(3),
                    inflated,
                    collapsed,
                };
                Tube::power(law, radius)
            }
        }
    }

    /// The wall law of a flow, with A0 and Kp of the tube.
    ///
    /// # Errors
    /// As [`TubeWall::tube`]; a law without a flow.
    pub fn flow_law(&self) -> Result<(FlowLaw, Place)> {
        let hoop = self
            .thickness
            .map(|thickness| 12.0 * (self.radius / thickness).powi(2));
        FlowLaw::of(&self.tube()?, hoop)
    }

    /// TOML table of the wall.
    pub(super) fn table(&self) -> Value {
        let law = match self.law {
            TubeLaw::Ring => json!("ring"),
            TubeLaw::Extensible => json!("extensible"),
            TubeLaw::NeoHookean => json!("neo-hookean"),
            TubeLaw::Power(exponents) => json!({ "power": exponents }),
        };
        let mut table = json!({
            "radius": self.radius, "mode": self.mode, "law": law, "stretch": self.stretch,
        });
        if let Some(thickness) = self.thickness {
            table["thickness"] = json!(thickness);
        }
        match self.stiffness {
            WallStiffness::Material([modulus, nu]) => {
                table["material"] = json!({ "E": modulus, "nu": nu });
            }
            WallStiffness::Bending(stiffness) => table["stiffness"] = json!(stiffness),
        }
        table
    }
}

impl TubeScene {
    /// The section of the scene.
    ///
    /// # Errors
    /// A pressure or an area that no section has.
    pub fn section(&self, tube: &Tube) -> Result<TubeSection> {
        match self.state {
            TubeLoad::Pressure(pressure) => tube.at_pressure(pressure),
            TubeLoad::Area(area) => tube.at_area(area),
        }
    }
}

impl MembraneScene {
    /// The state of the scene.
    ///
    /// # Errors
    /// A load that no state has.
    pub fn equilibrium(&self) -> Result<InflatedState> {
        match self.state {
            MembraneLoad::Pressure(pressure) => self.membrane.at_pressure(pressure),
            MembraneLoad::Stretch(stretch) => self.membrane.at_stretch(stretch),
            MembraneLoad::Gas { contents, vessel } => vessel.at_contents(&self.membrane, contents),
        }
    }
}

impl WallScene {
    /// The branch to follow, if any.
    pub fn follow(&self) -> Option<&WallBranch> {
        match self {
            Self::Tube(tube) => tube.follow.as_ref(),
            Self::Membrane(membrane) => membrane.follow.as_ref(),
        }
    }

    /// TOML tables of the scene.
    pub(super) fn tables(&self) -> Map<String, Value> {
        let mut tables = Map::new();
        let mut add = |name: &str, table: Value| tables.insert(name.to_owned(), table);
        match self {
            Self::Tube(tube) => {
                let mut table = tube.wall.table();
                match tube.state {
                    TubeLoad::Area(area) => table["area"] = json!(area),
                    TubeLoad::Pressure(pressure) => {
                        add("outside", json!({ "pressure": pressure }));
                    }
                }
                if let Some(density) = tube.density {
                    add("fluid", json!({ "density": density }));
                }
                add("tube", table);
            }
            Self::Membrane(scene) => {
                let membrane = &scene.membrane;
                add(
                    "membrane",
                    json!({
                        "shape": membrane.shape.name(), "radius": membrane.radius,
                        "thickness": membrane.thickness, "law": { "biderman": scene.constants },
                    }),
                );
                match scene.state {
                    MembraneLoad::Pressure(pressure) => {
                        add("loads", json!({ "pressure": pressure }));
                    }
                    MembraneLoad::Stretch(stretch) => {
                        add("start", json!({ "stretch": stretch }));
                    }
                    MembraneLoad::Gas { contents, vessel } => {
                        let gas = json!({
                            "contents": contents, "volume": vessel.volume, "outside": vessel.outside,
                        });
                        add("gas", gas);
                    }
                }
            }
        }
        if let Some(follow) = self.follow() {
            let table = json!({
                "parameter": follow.parameter.name(), "from": follow.from, "to": follow.to,
                "points": follow.points,
            });
            add("continue", table);
        }
        tables
    }
}
