//! Record of small motions about the equilibrium of a model.

use super::{Mode, RelaxationRates, SmallMotions, Station, ToSceneUnits};
use crate::assembly::Body;
use crate::math::se3::halves;
use nalgebra::{Complex, Vector6};

/// Eigenvalues with a real part above this, relative to the largest of them, are growing motions.
const GROWING: f64 = 1e-8;

/// Small motions about an equilibrium, in the frame and the units of a model.
pub(super) struct FoundMotions {
    pub coordinates: Coordinates,
    /// The Morse index, the bodies being free.
    pub index: usize,
    /// True if all loads have a potential.
    pub conservative: bool,
    /// True if loads turn with bodies. Eigenvalues alone then describe the motions, and there are no modes.
    pub followed: bool,
    /// False for rods that are unstable with the bodies held. Counts with loads that turn with bodies, where the index
    /// does not decide.
    pub held_stable: bool,
    /// Squares of frequencies of at most this size count as 0.
    pub neutral: f64,
    /// By rising square of the frequency.
    pub modes: Vec<FoundMode>,
    /// As [`SmallMotions::rigid`].
    pub rigid: usize,
    /// As [`SmallMotions::change`].
    pub change: f64,
    /// With friction, drag, rotors or couples: those with Im s >= 0, by Im s.
    pub eigenvalues: Option<Vec<Complex<f64>>>,
    pub creep: Option<RelaxationRates>,
    /// The rods in equilibrium.
    pub rods: Vec<Vec<Station>>,
}

/// A mode of mass 1.
pub(super) struct FoundMode {
    /// Square of the angular frequency; negative for an instability.
    pub square: f64,
    /// Twists of the bodies (angular first).
    pub twists: Vec<Vector6<f64>>,
    /// The rods displaced to one side and to the other.
    pub rods: [Vec<Vec<Station>>; 2],
    /// Difference of the amplitudes of `rods`.
    pub apart: f64,
}

/// Components of the motion of bodies in the shape of a mode.
pub(super) struct Coordinates {
    names: Vec<String>,
    /// For each body, true if it turns.
    turns: Vec<bool>,
}

impl Coordinates {
    /// Components of a point in the plane.
    pub fn in_plane() -> Self {
        Self {
            names: ["dx", "dy"].map(String::from).to_vec(),
            turns: vec![false],
        }
    }

    /// Components of bodies in space. A prefix names the body if there are several bodies.
    pub fn in_space(bodies: &[Body]) -> Self {
        let several = bodies.len() > 1;
        let of = |(number, body): (usize, &Body)| {
            let prefix = match (body.name(), several) {
                (Some(name), _) => format!("{name}."),
                (None, true) => format!("body{number}_"),
                (None, false) => String::new(),
            };
            let names = ["rx", "ry", "rz", "dx", "dy", "dz"];
            let names = &names[if body.turns() { 0 } else { 3 }..];
            let names = names.iter().map(|name| format!("{prefix}{name}"));
            names.collect::<Vec<_>>()
        };
        Self {
            names: bodies.iter().enumerate().flat_map(of).collect(),
            turns: bodies.iter().map(Body::turns).collect(),
        }
    }

    /// Components of these twists of mass 1, in the world and the units of the scene.
    fn shape(&self, twists: &[Vector6<f64>], outward: &ToSceneUnits) -> Vec<f64> {
        let per = 1.0 / outward.scales.mass.sqrt();
        let mut world = Vec::new();
        for (turns, twist) in self.turns.iter().zip(twists) {
            let (turn, shift) = halves(twist);
            if *turns {
                let turn = outward.clamp.rotation * turn * (per / outward.scales.length);
                world.extend(turn.iter());
            }
            world.extend((outward.clamp.rotation * shift * per).iter());
        }
        world.truncate(self.names.len());
        world
    }
}

impl FoundMotions {
    /// The record, in the world and the units of the scene, without the effect of a neglected mass.
    pub fn described(self, outward: &ToSceneUnits) -> SmallMotions {
        let time = outward.scales.time;
        let all = self.eigenvalues.as_deref().unwrap_or_default();
        let fastest = all.iter().fold(0.0, |a: f64, s| a.max(s.norm()));
        let decays = all.iter().all(|s| s.re <= GROWING * fastest);
        let held = if self.followed {
            self.held_stable
        } else {
            self.index == 0
        };
        let mode = |found: &FoundMode| {
            let [before, after] = &found.rods;
            let mode = Mode {
                angular_frequency: self.frequency(found.square) / time,
                shape: self.coordinates.shape(&found.twists, outward),
                rods: outward.rates([before, after], found.apart),
            };
            mode.oriented()
        };
        SmallMotions {
            index: self.index,
            stable: held && (self.conservative || decays),
            conservative: self.conservative,
            modes: self.modes.iter().map(mode).collect(),
            rigid: self.rigid,
            change: self.change,
            eigenvalues: self
                .eigenvalues
                .as_ref()
                .map(|all| all.iter().map(|s| s / time).collect()),
            creep: self.creep,
            mass: None,
            rods: outward.stations(&self.rods),
            coordinates: self.coordinates.names,
        }
    }

    /// Angular frequency from its square. A negative square at a stable equilibrium is rounding and counts as 0. At
    /// others the frequency is minus the growth rate.
    fn frequency(&self, square: f64) -> f64 {
        if square.abs() <= self.neutral || self.index == 0 && square < 0.0 {
            0.0
        } else {
            square.signum() * square.abs().sqrt()
        }
    }
}
