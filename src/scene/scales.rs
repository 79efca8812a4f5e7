//! From the user's units to those of the library, and back.

use super::{
    BarrierTerm, Body, Clamp, ClampMotion, Damping, EndLoad, EndPose, Force, FrictionLaw, InTime,
    Joint, Loads, Maxwell, Place, PowerLaw, Pulse, Ramp, Relaxed, Scene, Sine, Start, StrainField,
    StrainMatrix, Translation, Turn, TurnAngle, Units,
};
use crate::error::{Error, Quantity, Result};
use crate::section::Measures;

/// The library's units of each quantity, measured in the user's: a value in the scene is the
/// library's number times the scale.
///
/// The library's units are those in which the rod's length L, its bending stiffness EI (in space its reference stiffness,
/// [`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)) and the body's mass m are 1. All others follow: force EI/L^2, energy EI/L, and, from
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

    /// What sections are measured by: [`Viscoelastic::measured`](crate::section::rate::Viscoelastic::measured).
    pub fn measures(&self) -> Measures {
        Measures {
            length: self.length,
            stiffness: self.stiffness(),
            time: self.time,
        }
    }

    /// Scale of the viscosity eta of m = eta theta'_t: EI * time.
    pub fn viscosity(&self) -> f64 {
        self.stiffness() * self.time
    }

    /// Scale of the rate of a curvature, 1/(length * time).
    pub fn curvature_rate(&self) -> f64 {
        1.0 / self.length / self.time
    }

    /// The units of messages, which are made in those of the rod: for [`Error::in_units`].
    pub fn of_messages(&self, units: Units) -> impl Fn(Quantity) -> (f64, &'static str) {
        let k = *self;
        move |of| {
            let size = match of {
                Quantity::Time => k.time,
                Quantity::Length => k.length,
                Quantity::Velocity => k.velocity,
                Quantity::AngularVelocity | Quantity::Rate => 1.0 / k.time,
                Quantity::Force => k.force,
                Quantity::Couple => k.energy,
                Quantity::Curvature => 1.0 / k.length,
                Quantity::Ratio => 1.0,
            };
            (size, units.symbol(of))
        }
    }

    /// True if no scale over- or underflows.
    pub(super) fn are_normal(&self) -> bool {
        let all = [self.length, self.force, self.energy, self.mass];
        let more = [self.time, self.velocity, self.acceleration, self.drag];
        all.iter().chain(&more).all(|scale| scale.is_normal())
    }
}

/// A scene of motion in the library's units: length, bending stiffness and mass are 1. The elastic law of the section is
/// left to [`Viscoelastic::measured`](crate::section::rate::Viscoelastic::measured).
#[derive(Debug, Clone, PartialEq)]
pub struct Dimensionless {
    /// Friction; a proportional one is a time.
    pub damping: Option<Damping>,
    /// Maxwell branches.
    pub relaxation: Vec<Maxwell>,
    /// The pose of the base.
    pub clamp: Clamp,
    /// The body; its mass is 1.
    pub body: Body,
    /// The start.
    pub start: Start,
    /// The loads. Gravity is also its force.
    pub loads: Loads,
    /// Duration.
    pub duration: f64,
}

impl Scene {
    /// The scales of length L, bending stiffness EI (in space the reference stiffness B of the rod) and mass.
    ///
    /// # Errors
    /// As [`Scene::body`] and, in space, [`Scene::cosserat_rod`].
    pub fn scales(&self) -> Result<Scales> {
        let stiffness = match self.is_planar() {
            true => self.rod.bending_stiffness()?,
            false => self.cosserat_rod()?.reference_stiffness(),
        };
        Ok(Scales::new(self.rod.length, stiffness, self.body()?.mass))
    }

    /// An error that was made in the units of the rod, in those of the scene.
    pub fn in_own_units(&self, error: Error) -> Error {
        match self.scales() {
            Ok(scales) => error.in_units(&scales.of_messages(self.units)),
            Err(_) => error,
        }
    }

    /// The scene in the library's units; [`Scene::scales`] leads back.
    ///
    /// # Errors
    /// As [`Scene::scales`].
    pub fn dimensionless(&self) -> Result<Dimensionless> {
        let scales = self.scales()?;
        let over = |scale: f64| move |x: f64| x / scale;
        // Couples are scaled by B/L, forces by B/L^2, flexures and twist by 1/L.
        let size = |i: usize| if i < 3 { 1.0 } else { scales.length };
        let stiffness = |i: usize, j: usize| size(i) * size(j) / scales.stiffness();
        let viscosity = |i, j| stiffness(i, j) / scales.time;
        let damping = |damping: &Damping| Damping {
            viscosity: damping.viscosity.scaled(viscosity, 1.0 / scales.time),
            law: match damping.law {
                FrictionLaw::Linear => FrictionLaw::Linear,
                FrictionLaw::Power(power) => FrictionLaw::Power(PowerLaw {
                    rate: power.rate * scales.length * scales.time,
                    ..power
                }),
                FrictionLaw::Barrier(barrier) => FrictionLaw::Barrier(BarrierTerm {
                    strength: barrier.strength * viscosity(5, 5),
                    half_widths: barrier.half_widths.map(over(scales.length)),
                }),
            },
        };
        let branch = |branch: &Maxwell| Maxwell {
            stiffness: branch.stiffness.scaled(stiffness, 1.0),
            time: branch.time / scales.time,
        };
        let body = self.body()?;
        let inertia = scales.mass * scales.length * scales.length;
        let joint = match &body.joint {
            Joint::Ball => Joint::Ball,
            Joint::Weld { offset, inertia: j } => Joint::Weld {
                offset: offset.map(over(scales.length)),
                inertia: j.map(|row| row.map(over(inertia))),
            },
        };
        let loads = &self.loads;
        Ok(Dimensionless {
            damping: self.rod.damping.as_ref().map(damping),
            relaxation: self.rod.relaxation.iter().map(branch).collect(),
            clamp: clamp(&self.clamp, &scales),
            body: Body { mass: 1.0, joint },
            start: start(&self.start, &scales),
            loads: Loads {
                gravity: loads.gravity.map(over(scales.acceleration)),
                dead: loads.dead.map(over(scales.force)),
                couple: loads.couple.map(over(scales.energy)),
                drag: loads.drag / scales.drag,
                rotational_drag: loads.rotational_drag / (scales.energy * scales.time),
                force: loads
                    .force
                    .iter()
                    .map(|load| force(load, &scales))
                    .collect(),
            },
            duration: self.run()?.duration / scales.time,
        })
    }
}

fn sine(sine: &Sine, scales: &Scales, size: f64) -> Sine {
    Sine {
        amplitude: sine.amplitude / size,
        frequency: sine.frequency * scales.time,
        phase: sine.phase,
    }
}

fn force(force: &Force, scales: &Scales) -> Force {
    let (t, f) = (scales.time, scales.force);
    let size = match &force.size {
        InTime::Sine(size) => InTime::Sine(sine(size, scales, f)),
        InTime::Ramp(ramp) => InTime::Ramp(Ramp {
            from: ramp.from / f,
            to: ramp.to / f,
            start: ramp.start / t,
            until: ramp.until / t,
        }),
        InTime::Pulse(pulse) => InTime::Pulse(Pulse {
            at: pulse.at / t,
            width: pulse.width / t,
            amplitude: pulse.amplitude / f,
        }),
        InTime::Table(rows) => InTime::Table(rows.iter().map(|[s, x]| [s / t, x / f]).collect()),
    };
    Force {
        direction: force.direction,
        size,
    }
}

fn clamp(clamp: &Clamp, scales: &Scales) -> Clamp {
    let length = scales.length;
    let row = |row: &Vec<f64>| {
        let scaled = row.iter().enumerate();
        let scaled = scaled.map(|(i, x)| x / if i == 0 { scales.time } else { length });
        scaled.collect()
    };
    let translate = |translation: &Translation| match translation {
        Translation::Table(rows) => Translation::Table(rows.iter().map(row).collect()),
        Translation::Sine { direction, sine: s } => Translation::Sine {
            direction: *direction,
            sine: sine(s, scales, length),
        },
    };
    let turn = |turn: &Turn| Turn {
        axis: turn.axis,
        angle: match &turn.angle {
            TurnAngle::Rate { rate } => TurnAngle::Rate {
                rate: rate * scales.time,
            },
            TurnAngle::Sine(s) => TurnAngle::Sine(sine(s, scales, 1.0)),
        },
    };
    Clamp {
        position: clamp.position.map(|x| x / length),
        orientation: clamp.orientation,
        motion: clamp.motion.as_ref().map(|motion| ClampMotion {
            translate: motion.translate.as_ref().map(translate),
            turn: motion.turn.as_ref().map(turn),
        }),
    }
}

fn start(start: &Start, scales: &Scales) -> Start {
    let over = |scale: f64| move |x: f64| x / scale;
    let curvature = |field: &Vec<f64>| field.iter().map(|c| c * scales.length).collect();
    let strain = |field: &StrainField| {
        let scaled = |i: usize| {
            let by = if i < 3 { scales.length } else { 1.0 };
            Some(field.0[i].as_ref()?.iter().map(|c| c * by).collect())
        };
        StrainField(std::array::from_fn(scaled))
    };
    let place = match &start.place {
        Place::Position { position, sheet } => Place::Position {
            position: position.map(over(scales.length)),
            sheet: sheet.clone(),
        },
        Place::Curvature { curvature: c } => Place::Curvature {
            curvature: curvature(c),
        },
        Place::Strain { strain: field } => Place::Strain {
            strain: strain(field),
        },
        Place::Equilibrium { equilibrium } => Place::Equilibrium {
            equilibrium: EndLoad {
                force: equilibrium.force.map(over(scales.force)),
                couple: equilibrium.couple.map(over(scales.energy)),
            },
        },
        Place::Pose { pose } => Place::Pose {
            pose: EndPose {
                position: pose.position.map(over(scales.length)),
                ..*pose
            },
        },
        Place::Kappa { .. } | Place::P { .. } | Place::Rest { .. } | Place::Settled { .. } => {
            start.place.clone()
        }
    };
    Start {
        place,
        relaxed: match &start.relaxed {
            Relaxed::Curvature(field) => Relaxed::Curvature(curvature(field)),
            Relaxed::Strain(field) => Relaxed::Strain(strain(field)),
            other => other.clone(),
        },
        velocity: start.velocity.map(over(scales.velocity)),
        angular_velocity: start.angular_velocity.map(|w| w * scales.time),
        wrench: start.wrench,
    }
}

impl Dimensionless {
    /// Viscosity eta of a planar rod; 0 if it is elastic.
    pub fn viscosity(&self) -> f64 {
        self.damping
            .as_ref()
            .map_or(0.0, |damping| damping.viscosity(1.0))
    }

    /// True if every number is finite, with its square, as energies and powers have it, and none that is > 0 underflows.
    pub(super) fn is_finite(&self) -> bool {
        let (mut numbers, mut positive) = (Vec::new(), vec![self.duration]);
        if let Some(damping) = &self.damping {
            numbers.extend(damping.viscosity.numbers());
            match damping.law {
                FrictionLaw::Linear => {}
                FrictionLaw::Power(power) => positive.push(power.rate),
                FrictionLaw::Barrier(BarrierTerm {
                    strength,
                    half_widths,
                }) => positive.extend([strength, half_widths[0], half_widths[1]]),
            }
            if let StrainMatrix::Bending(x) | StrainMatrix::Proportional(x) = damping.viscosity {
                positive.push(x);
            }
        }
        for branch in &self.relaxation {
            numbers.extend(branch.stiffness.numbers());
            positive.push(branch.time);
        }
        if let Joint::Weld { offset, inertia } = &self.body.joint {
            numbers.extend(offset);
            numbers.extend(inertia.as_flattened());
            positive.extend([0, 1, 2].map(|i| inertia[i][i]));
        }
        let Start {
            place,
            relaxed,
            velocity,
            angular_velocity,
            ..
        } = &self.start;
        match place {
            Place::Kappa { .. } | Place::P { .. } | Place::Rest { .. } | Place::Settled { .. } => {}
            Place::Position { position, .. } => numbers.extend(position),
            Place::Curvature { curvature } => numbers.extend(curvature),
            Place::Strain { strain } => numbers.extend(strain.0.iter().flatten().flatten()),
            Place::Equilibrium { equilibrium: load } => {
                numbers.extend(load.force.iter().chain(&load.couple))
            }
            Place::Pose { pose } => numbers.extend(pose.position),
        }
        match relaxed {
            Relaxed::Start | Relaxed::Unloaded => {}
            Relaxed::Curvature(field) => numbers.extend(field),
            Relaxed::Strain(field) => numbers.extend(field.0.iter().flatten().flatten()),
        }
        let loads = &self.loads;
        let vectors = [
            self.clamp.position,
            *velocity,
            *angular_velocity,
            loads.gravity,
            loads.dead,
            loads.couple,
        ];
        numbers.extend(vectors.as_flattened());
        numbers.extend([loads.drag, loads.rotational_drag]);
        for force in &loads.force {
            match &force.size {
                InTime::Sine(sine) => numbers.extend([sine.amplitude, sine.frequency]),
                InTime::Ramp(r) => numbers.extend([r.from, r.to, r.start, r.until]),
                InTime::Pulse(pulse) => {
                    numbers.extend([pulse.at, pulse.amplitude]);
                    positive.push(pulse.width);
                }
                InTime::Table(rows) => numbers.extend(rows.as_flattened()),
            }
        }
        numbers.iter().all(|x| (x * x).is_finite()) && positive.iter().all(|x| x.is_normal())
    }
}
