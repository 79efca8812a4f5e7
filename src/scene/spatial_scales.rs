//! Scenes of motion in space in the library's units: length, reference bending stiffness and mass are 1.

use super::scales::Harmonic;
use super::{
    Clamp, EndLoad, EndPose, FrictionBarrier, FrictionLaw, Joint, PowerLaw, Relaxed, Scales,
    SpatialBody, SpatialDamping, SpatialMaxwell, SpatialMotion, SpatialPlace, SpatialStart,
    StrainField, StrainMatrix,
};
use crate::Result;

/// A scene of motion in space in units of the rod's length L, its reference bending stiffness B
/// ([`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)) and the mass of the body. The section law is that
/// of [`SpatialMotion::cosserat_rod`].
#[derive(Debug, Clone, PartialEq)]
pub struct SpatialDimensionless {
    /// Friction; a proportional one is a time.
    pub damping: SpatialDamping,
    /// Maxwell branches.
    pub relaxation: Vec<SpatialMaxwell>,
    /// The pose of the base.
    pub clamp: Clamp,
    /// The body; its mass is 1.
    pub body: SpatialBody,
    /// The start.
    pub start: SpatialStart,
    /// Acceleration of gravity, which is also its force.
    pub gravity: [f64; 3],
    /// Constant force.
    pub dead: [f64; 3],
    /// Constant couple.
    pub couple: [f64; 3],
    /// Drag coefficient.
    pub drag: f64,
    /// Sinusoidal forces.
    pub forces: Vec<Harmonic<3>>,
    /// Duration.
    pub duration: f64,
}

impl SpatialMotion {
    /// The scales of length L, reference bending stiffness B and mass.
    ///
    /// # Errors
    /// As [`SpatialMotion::cosserat_rod`].
    pub fn scales(&self) -> Result<Scales> {
        let stiffness = self.cosserat_rod()?.reference_stiffness();
        Ok(Scales::new(
            self.rod.elastic.length,
            stiffness,
            self.body.mass,
        ))
    }

    /// The scene in the library's units; [`SpatialMotion::scales`] leads back.
    ///
    /// # Errors
    /// As [`SpatialMotion::cosserat_rod`].
    pub fn dimensionless(&self) -> Result<SpatialDimensionless> {
        let scales = self.scales()?;
        let over = |scale: f64| move |x: f64| x / scale;
        // Couples are scaled by B/L, forces by B/L^2, flexures and twist by 1/L.
        let size = |i: usize| if i < 3 { 1.0 } else { scales.length };
        let stiffness = |i: usize, j: usize| size(i) * size(j) / scales.stiffness();
        let viscosity = |i, j| stiffness(i, j) / scales.time;
        let damping = SpatialDamping {
            viscosity: (self.rod.damping.viscosity).scaled(viscosity, 1.0 / scales.time),
            law: match self.rod.damping.law {
                FrictionLaw::Linear => FrictionLaw::Linear,
                FrictionLaw::Power(power) => FrictionLaw::Power(PowerLaw {
                    rate: power.rate * scales.length * scales.time,
                    ..power
                }),
                FrictionLaw::Barrier(barrier) => FrictionLaw::Barrier(FrictionBarrier {
                    strength: barrier.strength * viscosity(5, 5),
                    half_widths: barrier.half_widths.map(over(scales.length)),
                }),
            },
        };
        let branch = |branch: &SpatialMaxwell| SpatialMaxwell {
            stiffness: branch.stiffness.scaled(stiffness, 1.0),
            time: branch.time / scales.time,
        };
        let inertia = scales.mass * scales.length * scales.length;
        let joint = match &self.body.joint {
            Joint::Ball => Joint::Ball,
            Joint::Weld { offset, inertia: j } => Joint::Weld {
                offset: offset.map(over(scales.length)),
                inertia: j.map(|row| row.map(over(inertia))),
            },
        };
        let field = |field: &StrainField| {
            let scaled = |i: usize| {
                let by = if i < 3 { scales.length } else { 1.0 };
                Some(field.0[i].as_ref()?.iter().map(|c| c * by).collect())
            };
            StrainField(std::array::from_fn(scaled))
        };
        let place = match &self.start.place {
            SpatialPlace::Strain(strain) => SpatialPlace::Strain(field(strain)),
            SpatialPlace::Equilibrium(load) => SpatialPlace::Equilibrium(EndLoad {
                force: load.force.map(over(scales.force)),
                couple: load.couple.map(over(scales.energy)),
            }),
            SpatialPlace::Pose(pose) => SpatialPlace::Pose(EndPose {
                position: pose.position.map(over(scales.length)),
                ..*pose
            }),
        };
        let loads = &self.loads;
        Ok(SpatialDimensionless {
            damping,
            relaxation: self.rod.relaxation.iter().map(branch).collect(),
            clamp: Clamp {
                position: self.clamp.position.map(over(scales.length)),
                ..self.clamp
            },
            body: SpatialBody { mass: 1.0, joint },
            start: SpatialStart {
                place,
                relaxed: self.start.relaxed.clone().map(|strain| field(&strain)),
                velocity: self.start.velocity.map(over(scales.velocity)),
                angular_velocity: self.start.angular_velocity.map(|w| w * scales.time),
            },
            gravity: loads.gravity.map(over(scales.acceleration)),
            dead: loads.dead.map(over(scales.force)),
            couple: loads.couple.map(over(scales.energy)),
            drag: loads.drag / scales.drag,
            forces: loads
                .force
                .iter()
                .map(|force| scales.harmonic(force))
                .collect(),
            duration: self.run.duration / scales.time,
        })
    }
}

impl SpatialDimensionless {
    /// True if every number is finite, with its square, and none that is > 0 underflows.
    pub(super) fn is_finite(&self) -> bool {
        let mut numbers = self.damping.viscosity.numbers();
        let mut positive = vec![self.duration];
        match self.damping.law {
            FrictionLaw::Linear => {}
            FrictionLaw::Power(power) => positive.push(power.rate),
            FrictionLaw::Barrier(FrictionBarrier {
                strength,
                half_widths,
            }) => positive.extend([strength, half_widths[0], half_widths[1]]),
        }
        if let StrainMatrix::Proportional(time) = self.damping.viscosity {
            positive.push(time);
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
        let fields = [
            match &self.start.place {
                SpatialPlace::Strain(field) => Some(field),
                _ => None,
            },
            match &self.start.relaxed {
                Relaxed::At(field) => Some(field),
                _ => None,
            },
        ];
        for field in fields.into_iter().flatten() {
            numbers.extend(field.0.iter().flatten().flatten());
        }
        match &self.start.place {
            SpatialPlace::Strain(_) => {}
            SpatialPlace::Equilibrium(load) => {
                numbers.extend(load.force.iter().chain(&load.couple))
            }
            SpatialPlace::Pose(pose) => numbers.extend(pose.position),
        }
        let SpatialStart {
            velocity,
            angular_velocity,
            ..
        } = &self.start;
        let vectors = [self.clamp.position, *velocity, *angular_velocity];
        numbers.extend(vectors.as_flattened());
        numbers.extend([self.gravity, self.dead, self.couple].as_flattened());
        numbers.push(self.drag);
        for force in &self.forces {
            numbers.extend([force.amplitude, force.angular_frequency]);
        }
        numbers.iter().all(|x| (x * x).is_finite()) && positive.iter().all(|x| x.is_normal())
    }
}
