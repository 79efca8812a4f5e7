//! From the user's units to those of the library, and back.

use super::{Force, Maxwell, Place, PowerLaw, Relaxed, Scene};
use std::f64::consts::TAU;

/// The library's units of each quantity, measured in the user's: a value in the scene is the
/// library's number times the scale.
///
/// The library's units are those in which the rod's length L, its bending stiffness EI and the
/// body's mass m are 1. All others follow: force EI/L^2, energy EI/L, and, from
/// mass * length / time^2 = force, time sqrt(m L^3/EI).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// L.
    pub length: f64,
    /// EI / L^2.
    pub force: f64,
    /// EI / L.
    pub energy: f64,
    /// m.
    pub mass: f64,
    /// sqrt(m L^3 / EI).
    pub time: f64,
    /// length / time = sqrt(EI / (m L)).
    pub velocity: f64,
    /// force / mass = EI / (m L^2).
    pub acceleration: f64,
    /// force / velocity = sqrt(m EI / L^3).
    pub drag: f64,
}

impl Scales {
    /// The scales of a planar scene's rod and body.
    pub fn of(scene: &Scene) -> Self {
        let rod = &scene.rod;
        Self::new(rod.length, rod.bending_stiffness, scene.body.mass)
    }

    /// The scales of a length, a bending stiffness and a mass.
    pub fn new(length: f64, stiffness: f64, mass: f64) -> Self {
        let energy = stiffness / length;
        let force = energy / length;
        let velocity = (energy / mass).sqrt();
        Self {
            length,
            force,
            energy,
            mass,
            time: length / velocity,
            velocity,
            acceleration: force / mass,
            drag: force / velocity,
        }
    }

    /// Scale of bending stiffness, EI = energy * length.
    pub fn stiffness(&self) -> f64 {
        self.energy * self.length
    }

    /// Scale of the viscosity eta of m = eta theta'_t: EI * time.
    pub fn viscosity(&self) -> f64 {
        self.stiffness() * self.time
    }

    /// Scale of the rate of a curvature, 1/(length * time).
    pub fn curvature_rate(&self) -> f64 {
        1.0 / self.length / self.time
    }

    /// A force in the library's units.
    pub(super) fn harmonic<const N: usize>(&self, force: &Force<N>) -> Harmonic<N> {
        Harmonic {
            direction: force.unit(),
            amplitude: force.amplitude / self.force,
            angular_frequency: TAU * (force.frequency * self.time),
            phase: force.phase,
        }
    }

    /// True if no scale over- or underflows.
    pub(super) fn are_normal(&self) -> bool {
        let all = [self.length, self.force, self.energy, self.mass];
        let more = [self.time, self.velocity, self.acceleration, self.drag];
        all.iter().chain(&more).all(|scale| scale.is_normal())
    }
}

/// The start, the loads and the duration of a scene in the library's units: L = EI = m = 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Dimensionless {
    /// The shape at the start; a position is in units of L, a curvature in units of 1/L.
    pub place: Place,
    /// Viscosity eta of the rod, > 0; 0 if it is elastic.
    pub viscosity: f64,
    /// How the friction departs from being linear.
    pub power: Option<PowerLaw>,
    /// Maxwell branches.
    pub relaxation: Vec<Maxwell>,
    /// Where they are relaxed at the start.
    pub relaxed: Relaxed<Vec<f64>>,
    /// Velocity at the start.
    pub velocity: [f64; 2],
    /// Acceleration of gravity, which is also its force.
    pub gravity: [f64; 2],
    /// Constant force.
    pub dead: [f64; 2],
    /// Drag coefficient: force -drag * velocity.
    pub drag: f64,
    /// Sinusoidal forces.
    pub forces: Vec<Harmonic>,
    /// Duration.
    pub duration: f64,
}

/// A force direction * amplitude * sin(angular_frequency * t + phase), in the plane or in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic<const N: usize = 2> {
    /// Unit vector.
    pub direction: [f64; N],
    /// Amplitude.
    pub amplitude: f64,
    /// Angular frequency >= 0: 2 pi times the frequency.
    pub angular_frequency: f64,
    /// Phase in radians.
    pub phase: f64,
}

impl<const N: usize> Harmonic<N> {
    /// The force at time `t`.
    pub fn at(&self, t: f64) -> [f64; N] {
        let size = self.amplitude * (self.angular_frequency * t + self.phase).sin();
        self.direction.map(|component| component * size)
    }
}

impl Dimensionless {
    /// True if every number is finite, with its square, as energies and powers have it, and the duration
    /// is not 0.
    pub(super) fn is_finite(&self) -> bool {
        let field = |field: &Vec<f64>| field.iter().all(|c| (c * c).is_finite());
        let start = match &self.place {
            Place::Curvature { curvature } => field(curvature),
            _ => true,
        };
        let relaxed = match &self.relaxed {
            Relaxed::At(curvature) => field(curvature),
            _ => true,
        };
        let power = self.power.iter().map(|power| power.rate);
        let branches = self.relaxation.iter();
        let friction = self.viscosity == 0.0 || self.viscosity.is_normal();
        let memory = branches.clone().all(|branch| branch.stiffness.is_finite())
            && power
                .chain(branches.map(|branch| branch.time))
                .all(f64::is_normal);
        let vectors = [self.velocity, self.gravity, self.dead];
        let harmonics = self.forces.iter();
        vectors.iter().flatten().all(|x| (x * x).is_finite())
            && harmonics
                .flat_map(|f| [f.amplitude, f.angular_frequency])
                .all(|x| (x * x).is_finite())
            && (self.drag * self.drag).is_finite()
            && self.duration > 0.0
            && self.duration.is_finite()
            && (start && relaxed && friction && memory)
    }
}

impl Scene {
    /// The scene in the library's units; [`Scales::of`] leads back.
    pub fn dimensionless(&self) -> Dimensionless {
        let scales = Scales::of(self);
        let over = |scale: f64| move |x: f64| x / scale;
        let place = match &self.start.place {
            Place::Position { position, sheet } => Place::Position {
                position: position.map(over(scales.length)),
                sheet: sheet.clone(),
            },
            Place::Curvature { curvature } => Place::Curvature {
                curvature: curvature.iter().map(|c| c * scales.length).collect(),
            },
            chart => chart.clone(),
        };
        let rod = &self.rod;
        let viscosity = |damping: super::Damping| match damping.size {
            super::Friction::Viscosity(viscosity) => viscosity / scales.stiffness() / scales.time,
            super::Friction::Proportional(time) => time / scales.time,
        };
        let power = |power: PowerLaw| PowerLaw {
            rate: power.rate * scales.length * scales.time,
            ..power
        };
        let branch = |branch: &Maxwell| Maxwell {
            stiffness: branch.stiffness / scales.stiffness(),
            time: branch.time / scales.time,
        };
        let field = |field: Vec<f64>| field.iter().map(|c| c * scales.length).collect();
        let loads = &self.loads;
        Dimensionless {
            place,
            viscosity: rod.damping.map_or(0.0, viscosity),
            power: rod.damping.and_then(|damping| damping.power).map(power),
            relaxation: rod.relaxation.iter().map(branch).collect(),
            relaxed: self.start.relaxed.clone().map(field),
            velocity: self.start.velocity.map(over(scales.velocity)),
            gravity: loads.gravity.map(over(scales.acceleration)),
            dead: loads.dead.map(over(scales.force)),
            drag: loads.drag / scales.drag,
            forces: loads
                .force
                .iter()
                .map(|force| scales.harmonic(force))
                .collect(),
            duration: self.run.duration / scales.time,
        }
    }
}
