//! Conversion between the user's units and the library's.

use super::{
    Body, Clamp, ClampMotion, Damping, FrictionLaw, History, InitialShape, Joint, Load, LoadAlong,
    Loads, Maxwell, RelaxedAt, Scene, Sine, Start, StrainField, StrainMatrix, StrainRate,
    Translation, Units,
};
use crate::error::{Error, Quantity, Result};
use crate::section::Measures;

/// The library's unit of each quantity, measured in the user's: a value in the scene is the library's number times the
/// scale.
///
/// In the library's units the rod's length L, its bending stiffness EI (in space its reference stiffness,
/// [`Rod::reference_stiffness`](crate::rod::Rod::reference_stiffness)) and the body's mass m are 1. All other units
/// follow: force EI/L^2, energy EI/L, and, from mass * length / time^2 = force, time sqrt(m L^3/EI).
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

    /// True if length, bending stiffness and mass are 1 in the scene's units, which then equal the library's.
    pub fn are_one(&self) -> bool {
        self.length == 1.0 && self.stiffness() == 1.0 && self.mass == 1.0
    }

    /// Scale of bending stiffness, EI = energy * length.
    pub fn stiffness(&self) -> f64 {
        self.energy * self.length
    }

    /// Units for sections, see [`Viscoelastic::measured`](crate::section::rate::Viscoelastic::measured).
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

    /// Conversion of messages from the rod's units to the scene's, for [`Error::in_units`].
    pub fn of_messages(&self, units: Units) -> impl Fn(Quantity) -> (f64, &'static str) {
        let scales = *self;
        move |of| (scales.unit(of), units.symbol(of))
    }

    /// The library's unit of a quantity, in the user's units.
    pub fn unit(&self, of: Quantity) -> f64 {
        match of {
            Quantity::Ratio => 1.0,
            Quantity::Length => self.length,
            Quantity::Time => self.time,
            Quantity::Rate | Quantity::AngularVelocity => 1.0 / self.time,
            Quantity::Velocity => self.velocity,
            Quantity::Acceleration => self.acceleration,
            Quantity::Inertia => self.mass * self.length * self.length,
            Quantity::Force => self.force,
            Quantity::Distributed => self.force / self.length,
            Quantity::ForceRate => self.force / self.time,
            Quantity::CoupleRate => self.energy / self.time,
            Quantity::Couple => self.energy,
            Quantity::Drag => self.drag,
            Quantity::RotationalDrag => self.energy * self.time,
            Quantity::Curvature => 1.0 / self.length,
            Quantity::CurvatureRate => 1.0 / (self.length * self.time),
            Quantity::Stiffness(i, j) => 1.0 / self.compliance(i, j),
            Quantity::Viscosity(i, j) => self.time / self.compliance(i, j),
        }
    }

    /// Converts a number of the scene to the library's units. Every conversion goes through this function.
    pub fn inward(&self, of: Quantity, x: f64) -> f64 {
        // Multiplication by a known inverse avoids a second rounding.
        match of {
            Quantity::Rate | Quantity::AngularVelocity => x * self.time,
            Quantity::Curvature => x * self.length,
            Quantity::CurvatureRate => x * self.length * self.time,
            Quantity::Stiffness(i, j) => x * self.compliance(i, j),
            Quantity::Viscosity(i, j) => x * (self.compliance(i, j) / self.time),
            _ => x / self.unit(of),
        }
    }

    /// Inverse of the unit of a stiffness: couples are scaled by B/L, forces by B/L^2, flexures and twist by 1/L.
    fn compliance(&self, i: usize, j: usize) -> f64 {
        let size = |i: usize| if i < 3 { 1.0 } else { self.length };
        size(i) * size(j) / self.stiffness()
    }

    fn convert_inward(&self, numbers: Vec<Number<'_>>) {
        for number in numbers {
            *number.value = self.inward(number.of, *number.value);
        }
    }

    /// Loads in the library's units.
    pub fn loads(&self, mut loads: Loads) -> Loads {
        let mut numbers = Numbers::default();
        numbers.loads(&mut loads);
        self.convert_inward(numbers.0);
        loads
    }

    /// The motion of a support in the library's units.
    pub fn motion(&self, mut motion: ClampMotion) -> ClampMotion {
        let mut numbers = Numbers::default();
        numbers.motion(&mut motion);
        self.convert_inward(numbers.0);
        motion
    }

    /// True if no scale over- or underflows.
    pub(super) fn are_normal(&self) -> bool {
        let all = [self.length, self.force, self.energy, self.mass];
        let more = [self.time, self.velocity, self.acceleration, self.drag];
        all.iter().chain(&more).all(|scale| scale.is_normal())
    }
}

/// A scene of motion in the library's units: length, bending stiffness and mass are 1. The elastic law of the section
/// is not included, see [`Viscoelastic::measured`](crate::section::rate::Viscoelastic::measured).
#[derive(Debug, Clone, PartialEq)]
pub struct Dimensionless {
    /// Friction; the factor of a proportional friction is a time.
    pub damping: Option<Damping>,
    /// Maxwell branches.
    pub relaxation: Vec<Maxwell<StrainMatrix>>,
    /// The pose of the base.
    pub clamp: Clamp,
    /// The body; its mass is 1.
    pub body: Body,
    /// The start.
    pub start: Start,
    /// The loads. As the mass is 1, gravity equals the weight.
    pub loads: Loads,
    /// Duration.
    pub duration: f64,
}

impl Scene {
    /// Scales from length L, bending stiffness EI (in space the reference stiffness B of the rod) and mass; for an
    /// assembly from its first rod and its first body.
    ///
    /// # Errors
    /// As [`Scene::body`] and, in space, [`Scene::cosserat_rod`].
    pub fn scales(&self) -> Result<Scales> {
        let stiffness = if self.is_planar() {
            self.rod.bending_stiffness()?
        } else {
            self.cosserat_rod()?.reference_stiffness()
        };
        let mass = match self.assembly() {
            Some(assembly) => assembly.mass(),
            None => self.body()?.mass,
        };
        Ok(Scales::new(self.rod.length, stiffness, mass))
    }

    /// Converts an error from the rod's units to the scene's.
    pub fn in_own_units(&self, error: Error) -> Error {
        match self.scales() {
            Ok(scales) => error.in_units(&scales.of_messages(self.units)),
            Err(_) => error,
        }
    }

    /// The scene in the library's units; [`Scene::scales`] converts back.
    ///
    /// # Errors
    /// As [`Scene::scales`].
    pub fn dimensionless(&self) -> Result<Dimensionless> {
        let scales = self.scales()?;
        let mut plain = Dimensionless {
            damping: self.rod.damping.clone(),
            relaxation: self.rod.relaxation.clone(),
            clamp: self.clamp.clone(),
            body: self.body()?.clone(),
            start: self.start.clone(),
            loads: self.loads.clone(),
            duration: self.run()?.duration,
        };
        scales.convert_inward(plain.numbers());
        plain.body.mass = 1.0;
        Ok(plain)
    }
}

/// Reference to a number of a scene, with its quantity and range check.
struct Number<'a> {
    of: Quantity,
    check: RangeCheck,
    value: &'a mut f64,
}

/// Range check of a number after conversion to the rod's units: overflow and underflow are excluded.
#[derive(Clone, Copy, PartialEq)]
enum RangeCheck {
    /// The square is finite: energies and powers contain squares.
    Square,
    /// The number, > 0 in the scene, is a normal float: it neither over- nor underflows.
    Positive,
    /// Both checks.
    Both,
    /// No check.
    No,
}

/// List of references to the numbers of a scene.
#[derive(Default)]
struct Numbers<'a>(Vec<Number<'a>>);

impl<'a> Numbers<'a> {
    fn add(&mut self, of: Quantity, values: impl IntoIterator<Item = &'a mut f64>) {
        self.extend(of, RangeCheck::Square, values);
    }

    fn positive(&mut self, of: Quantity, values: impl IntoIterator<Item = &'a mut f64>) {
        self.extend(of, RangeCheck::Positive, values);
    }

    fn extend(
        &mut self,
        of: Quantity,
        check: RangeCheck,
        values: impl IntoIterator<Item = &'a mut f64>,
    ) {
        let number = |value| Number { of, check, value };
        self.0.extend(values.into_iter().map(number));
    }

    /// Adds the entries of a matrix over the strains.
    fn matrix(&mut self, matrix: &'a mut StrainMatrix, entry: fn(usize, usize) -> Quantity) {
        match matrix {
            StrainMatrix::Bending(x) => self.add(entry(0, 0), [x]),
            StrainMatrix::Proportional(x) => self.add(Quantity::Ratio, [x]),
            StrainMatrix::Diagonal(all) => {
                let each = all.iter_mut().enumerate();
                each.for_each(|(i, x)| self.add(entry(i, i), [x]));
            }
            StrainMatrix::Full(rows) => {
                let each = rows.as_flattened_mut().iter_mut().enumerate();
                each.for_each(|(k, x)| self.add(entry(k / 6, k % 6), [x]));
            }
        }
    }

    /// Adds the numbers of a time history of one quantity, whose rate has the other quantity.
    fn history(&mut self, [size, rate]: [Quantity; 2], check: RangeCheck, f: &'a mut History) {
        match f {
            History::Constant(x) => self.extend(size, check, [x]),
            History::Rate { rate: x } => self.extend(rate, check, [x]),
            History::Sine(sine) => self.sine(size, check, sine),
            History::Ramp(ramp) => {
                self.extend(size, check, [&mut ramp.from, &mut ramp.to]);
                self.extend(Quantity::Time, check, [&mut ramp.start, &mut ramp.until]);
            }
            History::Pulse(pulse) => {
                self.extend(Quantity::Time, check, [&mut pulse.at]);
                self.positive(Quantity::Time, [&mut pulse.width]);
                self.extend(size, check, [&mut pulse.amplitude]);
            }
            History::Block(block) => {
                self.extend(size, check, [&mut block.size]);
                self.extend(Quantity::Time, check, [&mut block.start, &mut block.until]);
            }
            History::Table(rows) => {
                for [t, x] in rows {
                    self.extend(Quantity::Time, check, [t]);
                    self.extend(size, check, [x]);
                }
            }
            History::Custom(_) => {}
        }
    }

    fn sine(&mut self, size: Quantity, check: RangeCheck, sine: &'a mut Sine) {
        self.extend(size, check, [&mut sine.amplitude]);
        self.extend(Quantity::Rate, check, [&mut sine.frequency]);
    }

    fn clamp(&mut self, clamp: &'a mut Clamp) {
        self.add(Quantity::Length, &mut clamp.position);
        if let Some(motion) = &mut clamp.motion {
            self.motion(motion);
        }
    }

    fn motion(&mut self, motion: &'a mut ClampMotion) {
        match &mut motion.translate {
            None => {}
            Some(Translation::Sine { sine, .. }) => {
                self.sine(Quantity::Length, RangeCheck::No, sine)
            }
            Some(Translation::Table(rows)) => {
                for row in rows {
                    let (time, place) = row.split_at_mut(1);
                    self.extend(Quantity::Time, RangeCheck::No, time);
                    self.extend(Quantity::Length, RangeCheck::No, place);
                }
            }
        }
        if let Some(turn) = &mut motion.turn {
            let angle = [Quantity::Ratio, Quantity::AngularVelocity];
            self.history(angle, RangeCheck::No, &mut turn.angle);
        }
    }

    fn strains(&mut self, field: &'a mut StrainField) {
        let (bent, stretched) = field.0.split_at_mut(3);
        self.add(Quantity::Curvature, bent.iter_mut().flatten().flatten());
        self.add(Quantity::Ratio, stretched.iter_mut().flatten().flatten());
    }

    fn start(&mut self, start: &'a mut Start) {
        match &mut start.place {
            InitialShape::Kappa { .. }
            | InitialShape::P { .. }
            | InitialShape::Rest { .. }
            | InitialShape::Settled { .. } => {}
            InitialShape::Position { position, .. } => self.add(Quantity::Length, position),
            InitialShape::Curvature { curvature } => self.add(Quantity::Curvature, curvature),
            InitialShape::Strain { strain } => self.strains(strain),
            InitialShape::Equilibrium { equilibrium } => {
                self.add(Quantity::Force, &mut equilibrium.force);
                self.add(Quantity::Couple, &mut equilibrium.couple);
            }
            InitialShape::Pose { pose } => self.add(Quantity::Length, &mut pose.position),
        }
        match &mut start.rate {
            None => {}
            Some(StrainRate::Curvature(field)) => self.add(Quantity::CurvatureRate, field),
            Some(StrainRate::Strain(field)) => {
                let (bent, stretched) = field.0.split_at_mut(3);
                self.add(Quantity::CurvatureRate, bent.iter_mut().flatten().flatten());
                self.add(Quantity::Rate, stretched.iter_mut().flatten().flatten());
            }
        }
        match &mut start.relaxed {
            RelaxedAt::Start | RelaxedAt::Unloaded => {}
            RelaxedAt::Curvature(field) => self.add(Quantity::Curvature, field),
            RelaxedAt::Strain(field) => self.strains(field),
        }
        self.add(Quantity::Velocity, &mut start.velocity);
        self.add(Quantity::AngularVelocity, &mut start.angular_velocity);
    }

    fn loads(&mut self, loads: &'a mut Loads) {
        self.add(Quantity::Acceleration, &mut loads.gravity);
        self.add(Quantity::Force, &mut loads.dead);
        match &mut loads.distributed {
            LoadAlong::Constant(force) => self.add(Quantity::Distributed, force),
            LoadAlong::Polynomial { polynomial } => {
                self.add(Quantity::Distributed, polynomial.as_flattened_mut());
            }
            LoadAlong::Table { table } => {
                for [s, force @ ..] in table {
                    self.add(Quantity::Length, [s]);
                    self.add(Quantity::Distributed, force);
                }
            }
        }
        self.add(Quantity::Drag, [&mut loads.drag]);
        self.add(Quantity::RotationalDrag, [&mut loads.rotational_drag]);
        for force in &mut loads.force {
            let size = [Quantity::Force, Quantity::ForceRate];
            self.history(size, RangeCheck::Square, &mut force.size);
        }
        match &mut loads.couple {
            Load::Constant(couple) => self.add(Quantity::Couple, couple),
            Load::InTime(parts) => {
                for part in parts {
                    let size = [Quantity::Couple, Quantity::CoupleRate];
                    self.history(size, RangeCheck::Square, &mut part.size);
                }
            }
        }
    }
}

impl Dimensionless {
    /// Every number of the scene, with its quantity.
    fn numbers(&mut self) -> Vec<Number<'_>> {
        let mut all = Numbers::default();
        all.positive(Quantity::Time, [&mut self.duration]);
        if let Some(damping) = &mut self.damping {
            match &mut damping.viscosity {
                StrainMatrix::Bending(x) => {
                    all.extend(Quantity::Viscosity(0, 0), RangeCheck::Both, [x]);
                }
                StrainMatrix::Proportional(x) => all.extend(Quantity::Time, RangeCheck::Both, [x]),
                matrix => all.matrix(matrix, Quantity::Viscosity),
            }
            match &mut damping.law {
                FrictionLaw::Linear => {}
                FrictionLaw::Power(power) => {
                    all.positive(Quantity::CurvatureRate, [&mut power.rate]);
                }
                FrictionLaw::Barrier(barrier) => {
                    all.positive(Quantity::Viscosity(5, 5), [&mut barrier.strength]);
                    all.positive(Quantity::Length, &mut barrier.half_widths);
                }
            }
        }
        for branch in &mut self.relaxation {
            all.matrix(&mut branch.modulus, Quantity::Stiffness);
            all.positive(Quantity::Time, [&mut branch.time]);
        }
        if let Joint::Weld {
            offset,
            inertia,
            rotor,
        } = &mut self.body.joint
        {
            all.add(Quantity::Length, offset);
            all.add(Quantity::RotationalDrag, rotor);
            for (i, row) in inertia.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    let check = if i == j {
                        RangeCheck::Both
                    } else {
                        RangeCheck::Square
                    };
                    all.extend(Quantity::Inertia, check, [entry]);
                }
            }
        }
        all.clamp(&mut self.clamp);
        all.start(&mut self.start);
        all.loads(&mut self.loads);
        all.0
    }

    /// True if every number passes its range check.
    pub(super) fn has_finite_numbers(mut self) -> bool {
        self.numbers().iter().all(|number| {
            let x = *number.value;
            let (square, normal) = ((x * x).is_finite(), x.is_normal());
            match number.check {
                RangeCheck::Square => square,
                RangeCheck::Positive => normal,
                RangeCheck::Both => square && normal,
                RangeCheck::No => true,
            }
        })
    }
}
