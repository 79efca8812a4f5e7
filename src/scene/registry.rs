//! The registry: every number of a scene with its path, its quantity, its range and a reference to its place.

use super::parameter::*;
use super::{
    AssemblyBody, AssemblyRod, AssemblyScene, Body, BodyShape, Clamp, ClampMotion, Component,
    Damping, Diagonal, End, Extent, Force, FrictionLaw, Groove, History, InitialShape, Joint, Load,
    LoadAlong, LoadPlace, Loads, Maxwell, Orientation, Pull, Pulse, Ramp, RelaxedAt, Rod, RodLoad,
    Scene, SceneKind, Section, Sine, Site, SiteJoint, Start, StrainField, StrainMatrix, StrainRate,
    Tendon, Translation, Turn,
};
use crate::error::Quantity;
use crate::section::Along;

/// A number of a scene.
pub(super) struct Number<'a> {
    pub path: Parameter,
    pub of: Quantity,
    pub range: Range,
    pub slot: &'a mut f64,
}

/// Range of a number in the library's units: overflow and underflow are excluded.
#[derive(Clone, Copy, Default)]
pub(super) enum Range {
    /// Every number.
    #[default]
    Any,
    /// The square is finite: energies and powers contain squares.
    Square,
    /// The number, > 0 in the scene, is a normal float.
    Normal,
    /// The number is a normal float, and its square is finite.
    NormalSquare,
}

use Range::{Any, Normal, NormalSquare, Square};

impl Range {
    /// True if the range contains x.
    pub fn holds(self, x: f64) -> bool {
        let (square, normal) = ((x * x).is_finite(), x.is_normal());
        match self {
            Any => true,
            Square => square,
            Normal => normal,
            NormalSquare => square && normal,
        }
    }
}

/// Bearer of the loads in a scene of one rod.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Loaded {
    /// The body, in a motion.
    Body,
    /// The rod, at rest. Gravity needs its mass.
    Rod { has_mass: bool },
}

/// List of numbers of a scene. New ones are added to a table, with a range.
#[derive(Default)]
pub(super) struct Registry<'a> {
    pub numbers: Vec<Number<'a>>,
    table: &'static str,
    /// Index of the table among several.
    k: usize,
    range: Range,
}

impl Scene {
    /// Numbers of the scene: inputs of [`Scene::dimensionless`], and parameters of branches.
    pub(super) fn numbers(&mut self) -> Vec<Number<'_>> {
        let mut all = Registry::default();
        let loads = &mut self.loads;
        match &mut self.kind {
            SceneKind::Bar(_)
            | SceneKind::Flow(_)
            | SceneKind::Inflation(_)
            | SceneKind::Wall(_) => {}
            SceneKind::Assembly(assembly) => {
                all.vary(&GRAVITY, each(&mut loads.gravity));
                all.assembly(assembly);
            }
            SceneKind::Rod => {
                let has_mass = self.rod.mass().is_some();
                let on = match &self.end {
                    Some(_) => Loaded::Rod { has_mass },
                    None => Loaded::Body,
                };
                if let Some(end) = &mut self.end {
                    all.end(end);
                }
                all.clamp(&mut self.clamp);
                let along = [&loads.distributed, &loads.follower];
                all.rod(&mut self.rod, along, !self.stations.is_empty());
                if let Some(body) = &mut self.body {
                    all.body(body);
                }
                all.start(&mut self.start);
                all.loads(loads, on);
            }
        }
        for (k, station) in self.stations.iter_mut().enumerate() {
            all.at("station[]", k, Any);
            all.add("s", Quantity::Length, [&mut station.s]);
        }
        for (k, obstacle) in self.obstacles.iter_mut().enumerate() {
            all.at("obstacle[]", k, Any);
            all.add("friction", Quantity::Ratio, &mut obstacle.friction);
            all.add("restitution", Quantity::Ratio, &mut obstacle.restitution);
            if let Some(motion) = &mut obstacle.motion {
                let displaced = &mut motion.translate;
                all.translation("obstacle[].motion.translate", k, displaced);
                all.turn("obstacle[].motion.turn", k, &mut motion.turn);
            }
            all.at("obstacle[]", k, Any);
            for (field, i, slot) in obstacle.shape.lengths_mut() {
                all.push(field, i, Quantity::Length, slot);
            }
        }
        all.at("contact", 0, Any);
        let rules = &mut self.contact;
        all.add("friction", Quantity::Ratio, [&mut rules.friction]);
        all.add("restitution", Quantity::Ratio, [&mut rules.restitution]);
        all.add("gap", Quantity::Ratio, &mut rules.gap);
        all.add("stick", Quantity::Ratio, &mut rules.stick);
        all.add("settle_speed", Quantity::Velocity, &mut rules.settle_speed);
        if let Some(run) = &mut self.run {
            all.at("run", 0, Normal);
            all.add("duration", Quantity::Time, [&mut run.duration]);
        }
        all.numbers
    }
}

/// Quantities of a load in time and of its rate.
const FORCE: [Quantity; 2] = [Quantity::Force, Quantity::ForceRate];
const COUPLE: [Quantity; 2] = [Quantity::Couple, Quantity::CoupleRate];

/// Numbers with their indices.
fn each<const N: usize>(values: &mut [f64; N]) -> impl Iterator<Item = (usize, &mut f64)> {
    values.iter_mut().enumerate()
}

/// Numbers uniform along the rod, with indices.
fn uniform<'a>(
    values: impl IntoIterator<Item = &'a mut Along>,
) -> impl Iterator<Item = (usize, &'a mut f64)> {
    let each = values.into_iter().enumerate();
    each.filter_map(|(i, along)| Some((i, along.constant_mut()?)))
}

/// The number of a constant history.
fn constant(history: &mut History) -> Option<(usize, &mut f64)> {
    match history {
        History::Constant(x) => Some((0, x)),
        _ => None,
    }
}

/// Given tensions, with the indices of their tendons.
fn tensions(tendons: &mut [Tendon]) -> impl Iterator<Item = (usize, &mut f64)> {
    let each = tendons.iter_mut().enumerate();
    each.filter_map(|(i, tendon)| match &mut tendon.pull {
        Pull::Tension(tension) => constant(tension).map(|(_, tension)| (i, tension)),
        Pull::Length(_) => None,
    })
}

/// The angle of an orientation that is given by axis and angle.
fn angle(orientation: &mut Orientation) -> Option<(usize, &mut f64)> {
    match orientation {
        Orientation::Rotation(rotation) => Some((0, &mut rotation.angle)),
        _ => None,
    }
}

impl<'a> Registry<'a> {
    /// Sets the table and the range of the numbers that follow.
    fn at(&mut self, table: &'static str, k: usize, range: Range) {
        (self.table, self.k, self.range) = (table, k, range);
    }

    fn push(&mut self, field: &'static str, i: usize, of: Quantity, slot: &'a mut f64) {
        self.numbers.push(Number {
            path: Parameter::new(self.table, self.k, field, i),
            of,
            range: self.range,
            slot,
        });
    }

    /// Adds the numbers of a field.
    fn add(
        &mut self,
        field: &'static str,
        of: Quantity,
        slots: impl IntoIterator<Item = &'a mut f64>,
    ) {
        for (i, slot) in slots.into_iter().enumerate() {
            self.push(field, i, of, slot);
        }
    }

    /// Adds parameters of branches, with the indices of components.
    fn vary(&mut self, of: &Variable, slots: impl IntoIterator<Item = (usize, &'a mut f64)>) {
        let range = match of.role {
            Role::Ends | Role::Along => Square,
            Role::Rod | Role::Rest | Role::Tendon | Role::Obstacle | Role::Size => Any,
        };
        let k = if of.table.ends_with("[]") { self.k } else { 0 };
        self.at(of.table, k, range);
        for (i, slot) in slots {
            self.push(of.field, i, of.of, slot);
        }
    }

    fn end(&mut self, end: &'a mut End) {
        // A load factor without loads is no number of the scene.
        let turning = end.follower_force.iter().chain(&end.follower_couple);
        let mut loads = end.force.iter().chain(&end.couple).chain(turning);
        let is_loaded = loads.any(|x| *x != 0.0);
        let turns = end.is_loaded() && !end.follower;
        let free = end.position.map(|component| component == Component::Free);
        self.vary(&END_FORCE, each(&mut end.force).filter(|(i, _)| free[*i]));
        if end.orientation.is_none() {
            self.vary(&END_COUPLE, each(&mut end.couple));
        }
        if turns {
            self.vary(&END_FOLLOWER_FORCE, each(&mut end.follower_force));
            self.vary(&END_FOLLOWER_COUPLE, each(&mut end.follower_couple));
        }
        if is_loaded {
            self.vary(&END_LOAD, [(0, &mut end.load)]);
        }
        let held = end.position.iter_mut().enumerate();
        let held = held.filter_map(|(i, component)| match component {
            Component::Held(x) => Some((i, x)),
            Component::Free => None,
        });
        self.vary(&END_POSITION, held);
        self.vary(&END_ANGLE, end.orientation.as_mut().and_then(angle));
    }

    /// Adds the numbers of the clamp.
    pub fn clamp(&mut self, clamp: &'a mut Clamp) {
        self.vary(&CLAMP_POSITION, each(&mut clamp.position));
        self.vary(&CLAMP_ANGLE, angle(&mut clamp.orientation));
        if let Some(motion) = &mut clamp.motion {
            self.motion(motion);
        }
    }

    /// Adds the numbers of the motion of a clamp.
    pub fn motion(&mut self, motion: &'a mut ClampMotion) {
        self.translation("clamp.motion.translate", 0, &mut motion.translate);
        self.turn("clamp.motion.turn", 0, &mut motion.turn);
    }

    /// Adds the numbers of a rotation in time.
    fn turn(&mut self, table: &'static str, k: usize, turn: &'a mut Option<Turn>) {
        self.at(table, k, Any);
        match turn {
            None => {}
            Some(Turn::About { angle, .. }) => {
                self.history([Quantity::Ratio, Quantity::AngularVelocity], angle);
            }
            Some(Turn::Vectors { table }) => {
                for [time, vector @ ..] in table {
                    self.add("time", Quantity::Time, [time]);
                    self.add("vector[]", Quantity::Ratio, vector);
                }
            }
        }
    }

    /// Adds the numbers of a displacement in time.
    fn translation(
        &mut self,
        table: &'static str,
        k: usize,
        translate: &'a mut Option<Translation>,
    ) {
        self.at(table, k, Any);
        match translate {
            None => {}
            Some(Translation::Sine { sine, .. }) => self.sine(Quantity::Length, sine),
            Some(Translation::Table(rows)) => {
                for row in rows {
                    let (time, place) = row.split_at_mut(1);
                    self.add("time", Quantity::Time, time);
                    self.add("place[]", Quantity::Length, place);
                }
            }
        }
    }

    /// Adds the numbers of a time history of one quantity, whose rate has the other quantity.
    fn history(&mut self, [size, rate]: [Quantity; 2], f: &'a mut History) {
        let time = Quantity::Time;
        match f {
            History::Constant(x) => self.add("constant", size, [x]),
            History::Rate { rate: x } => self.add("rate", rate, [x]),
            History::Sine(sine) => self.sine(size, sine),
            History::Ramp(Ramp {
                from,
                to,
                start,
                until,
            }) => {
                self.add("ramp.from", size, [from]);
                self.add("ramp.to", size, [to]);
                self.add("ramp.start", time, [start]);
                self.add("ramp.until", time, [until]);
            }
            History::Pulse(Pulse {
                at,
                width,
                amplitude,
            }) => {
                self.add("pulse.at", time, [at]);
                self.add("pulse.amplitude", size, [amplitude]);
                self.at(self.table, self.k, Normal);
                self.add("pulse.width", time, [width]);
            }
            History::Block(block) => {
                self.add("block.size", size, [&mut block.size]);
                self.add("block.start", time, [&mut block.start]);
                self.add("block.until", time, [&mut block.until]);
            }
            History::Table(rows) => {
                for [t, x] in rows {
                    self.add("table.time", time, [t]);
                    self.add("table.size", size, [x]);
                }
            }
            History::Custom(_) => {}
        }
    }

    fn sine(&mut self, size: Quantity, sine: &'a mut Sine) {
        self.add("amplitude", size, [&mut sine.amplitude]);
        self.add("frequency", Quantity::Rate, [&mut sine.frequency]);
    }

    /// Adds the numbers of a rod under a load along its length. `has_stations`: stations lie on the rod.
    fn rod(&mut self, rod: &'a mut Rod, loads: [&LoadAlong; 2], has_stations: bool) {
        // Tables and stations hold arclengths up to the length, so the length cannot vary alone.
        let is_table = |along: &Along| !along.nodes().is_empty();
        let shape = rod.section.shape();
        let in_shape = shape.is_some_and(|shape| shape.sizes().any(is_table));
        let linear = match &mut rod.section {
            Section::Diagonal(linear) => Some(linear),
            Section::Barrier(law) => Some(&mut law.linear),
            _ => None,
        };
        let section = linear.as_deref();
        let in_section = |law: &Diagonal| law.stiffnesses().any(|(_, along)| is_table(along));
        let in_table = |load: &LoadAlong| matches!(load, LoadAlong::Table { .. });
        if !(in_shape
            || has_stations
            || loads.into_iter().any(in_table)
            || section.is_some_and(in_section)
            || rod.rest.all().any(is_table)
            || rod
                .drive
                .iter()
                .any(|drive| drive.shape.each().any(is_table))
            || rod.tendons.iter().any(Tendon::has_places)
            || rod.loads.iter().any(|load| !load.is_on_end()))
        {
            self.vary(&LENGTH, [(0, &mut rod.length)]);
        }
        if let Some(law) = linear {
            let bending = law.bending.iter_mut().enumerate();
            let bending = bending.filter_map(|(i, b)| Some((i, b.elastic_mut()?.constant_mut()?)));
            self.vary(&BENDING, bending);
            self.vary(&TORSION, uniform(law.torsion.elastic_mut()));
            self.vary(
                &SHEAR,
                uniform(law.shear.elastic_mut().into_iter().flatten()),
            );
            self.vary(&AXIAL, uniform(law.axial.elastic_mut()));
        }
        self.vary(&CURVATURE, uniform(&mut rod.rest.curvature));
        self.vary(&TWIST, uniform([&mut rod.rest.twist]));
        self.vary(
            &DRIVE,
            rod.drive
                .iter_mut()
                .filter_map(|drive| constant(&mut drive.amplitude)),
        );
        self.vary(&TENSION, tensions(&mut rod.tendons));
        self.listed(&mut rod.loads);
        if let Some(damping) = &mut rod.damping {
            self.damping(damping);
        }
        for (k, Maxwell { modulus, time }) in rod.relaxation.iter_mut().enumerate() {
            self.at("rod.relaxation[]", k, Square);
            let factor = Quantity::Ratio;
            self.matrix("stiffness[]", Quantity::Stiffness, factor, modulus);
            self.at("rod.relaxation[]", k, Normal);
            self.add("time", Quantity::Time, [time]);
        }
    }

    fn damping(&mut self, Damping { viscosity, law }: &'a mut Damping) {
        let range = match viscosity {
            StrainMatrix::Bending(_) | StrainMatrix::Proportional(_) => NormalSquare,
            StrainMatrix::Diagonal(_) | StrainMatrix::Full(_) => Square,
        };
        self.at("rod.damping", 0, range);
        let factor = Quantity::Time;
        self.matrix("viscosity[]", Quantity::Viscosity, factor, viscosity);
        match law {
            FrictionLaw::Linear => {}
            FrictionLaw::Power(power) => {
                self.at("rod.damping", 0, Normal);
                self.add("rate", Quantity::CurvatureRate, [&mut power.rate]);
            }
            FrictionLaw::Barrier(barrier) => {
                let strength = Quantity::Viscosity(5, 5);
                self.at("rod.damping.barrier", 0, Normal);
                self.add("strength", strength, [&mut barrier.strength]);
                self.add("half_widths[]", Quantity::Length, &mut barrier.half_widths);
            }
        }
    }

    /// Adds a matrix over the strains: the quantities are those of an entry, and of a factor of the section law.
    fn matrix(
        &mut self,
        field: &'static str,
        entry: fn(usize, usize) -> Quantity,
        factor: Quantity,
        matrix: &'a mut StrainMatrix,
    ) {
        match matrix {
            StrainMatrix::Bending(x) => self.add(field, entry(0, 0), [x]),
            StrainMatrix::Proportional(x) => self.add("proportional", factor, [x]),
            StrainMatrix::Diagonal(all) => {
                each(all).for_each(|(i, x)| self.push(field, i, entry(i, i), x));
            }
            StrainMatrix::Full(rows) => {
                let all = rows.as_flattened_mut().iter_mut().enumerate();
                all.for_each(|(k, x)| self.push(field, k, entry(k / 6, k % 6), x));
            }
        }
    }

    /// Adds the numbers of the body of one rod.
    pub fn body(&mut self, body: &'a mut Body) {
        self.at("body", 0, Any);
        self.add("mass", Quantity::Mass, [&mut body.mass]);
        self.shape("body", 0, body.shape.as_mut());
        self.groove(body.groove.as_mut());
        if let Joint::Weld {
            offset,
            inertia,
            rotor,
        } = &mut body.joint
        {
            self.at("body", 0, Square);
            self.extent(offset, inertia, rotor);
        }
    }

    /// Adds the lengths of the shape of a body.
    fn shape(&mut self, table: &'static str, k: usize, shape: Option<&'a mut BodyShape>) {
        for (field, i, slot) in shape.into_iter().flat_map(BodyShape::lengths_mut) {
            // A box without thickness is a plate.
            self.at(table, k, if *slot == 0.0 { Any } else { Normal });
            self.push(field, i, Quantity::Length, slot);
        }
        self.at(table, k, Any);
    }

    /// Adds the lengths of a groove. Its directions are of any length, and have no unit.
    fn groove(&mut self, groove: Option<&'a mut Groove>) {
        let length = Quantity::Length;
        match groove {
            None => {}
            Some(Groove::Line { line }) => {
                self.add("groove.line.point.xyz", length, &mut line.point);
            }
            Some(Groove::Circle { circle }) => {
                self.add("groove.circle.centre.xyz", length, &mut circle.centre);
                self.add("groove.circle.radius", length, [&mut circle.radius]);
            }
            Some(Groove::Spline { spline, .. }) => {
                self.add("groove.spline[]", length, spline.as_flattened_mut());
            }
        }
    }

    fn extent(
        &mut self,
        offset: &'a mut [f64; 3],
        inertia: &'a mut [[f64; 3]; 3],
        rotor: &'a mut [f64; 3],
    ) {
        self.add("offset.xyz", Quantity::Length, offset);
        self.add("rotor.xyz", Quantity::RotationalDrag, rotor);
        for (k, x) in inertia.as_flattened_mut().iter_mut().enumerate() {
            let is_diagonal = k % 4 == 0;
            self.range = if is_diagonal { NormalSquare } else { Square };
            self.push("inertia[]", k, Quantity::Inertia, x);
        }
    }

    /// Adds the numbers of the start.
    pub fn start(&mut self, start: &'a mut Start) {
        self.at("start", 0, Square);
        self.add("velocity.xyz", Quantity::Velocity, &mut start.velocity);
        let spin = &mut start.angular_velocity;
        self.add("angular_velocity.xyz", Quantity::AngularVelocity, spin);
        match &mut start.place {
            InitialShape::Kappa { .. }
            | InitialShape::P { .. }
            | InitialShape::Rest { .. }
            | InitialShape::Settled { .. } => {}
            InitialShape::Position { position, .. } => {
                self.add("position.xyz", Quantity::Length, position);
            }
            InitialShape::Curvature { curvature } => {
                self.add("curvature[]", Quantity::Curvature, curvature);
            }
            InitialShape::Strain { strain } => {
                self.strains("start.strain", Quantity::of_strain, strain);
            }
            InitialShape::Equilibrium { equilibrium } => {
                self.at("start.equilibrium", 0, Square);
                self.add("force.xyz", Quantity::Force, &mut equilibrium.force);
                self.add("couple.xyz", Quantity::Couple, &mut equilibrium.couple);
            }
            InitialShape::Pose { pose } => {
                self.at("start.pose", 0, Square);
                self.add("position.xyz", Quantity::Length, &mut pose.position);
            }
        }
        match &mut start.relaxed {
            RelaxedAt::Start | RelaxedAt::Unloaded => {}
            RelaxedAt::Curvature(curvature) => {
                self.at("start", 0, Square);
                self.add("relaxed[]", Quantity::Curvature, curvature);
            }
            RelaxedAt::Strain(strain) => {
                self.strains("start.relaxed", Quantity::of_strain, strain);
            }
        }
        match &mut start.rate {
            None => {}
            Some(StrainRate::Curvature(rate)) => {
                self.at("start", 0, Square);
                self.add("curvature_rate[]", Quantity::CurvatureRate, rate);
            }
            Some(StrainRate::Strain(rate)) => {
                let of = [Quantity::CurvatureRate, Quantity::Rate];
                self.strains("start.strain_rate", |i| of[i / 3], rate);
            }
        }
    }

    /// Adds the coefficients of a field of strains, or of their rates.
    fn strains(
        &mut self,
        table: &'static str,
        of: impl Fn(usize) -> Quantity,
        field: &'a mut StrainField,
    ) {
        const NAMES: [&str; 6] = ["u1[]", "u2[]", "u3[]", "v1[]", "v2[]", "v3[]"];
        self.at(table, 0, Square);
        for (i, polynomial) in field.0.iter_mut().enumerate() {
            self.add(NAMES[i], of(i), polynomial.iter_mut().flatten());
        }
    }

    /// Adds the numbers of the loads of one rod, or of one body of an assembly.
    pub fn loads(&mut self, loads: &'a mut Loads, on: Loaded) {
        let is_loaded =
            loads.gravity != [0.0; 3] || !loads.distributed.is_zero() || !loads.follower.is_zero();
        if on != (Loaded::Rod { has_mass: false }) {
            self.vary(&GRAVITY, each(&mut loads.gravity));
        }
        self.along(("loads.distributed", &DISTRIBUTED), &mut loads.distributed);
        if on != Loaded::Body {
            self.along(("loads.follower", &FOLLOWER), &mut loads.follower);
        }
        // A load factor without loads is no number of the scene.
        if on != Loaded::Body && is_loaded {
            self.vary(&LOADS_LOAD, [(0, &mut loads.load)]);
        }
        self.at("loads", 0, Square);
        self.add("dead.xyz", Quantity::Force, &mut loads.dead);
        self.add("drag", Quantity::Drag, [&mut loads.drag]);
        let drag = &mut loads.rotational_drag;
        self.add("rotational_drag", Quantity::RotationalDrag, [drag]);
        self.in_time("loads.force[]", |i| i, FORCE, &mut loads.force);
        match &mut loads.couple {
            Load::Constant(couple) => {
                self.at("loads", 0, Square);
                self.add("couple.xyz", Quantity::Couple, couple);
            }
            Load::InTime(parts) => self.in_time("loads.couple[]", |i| i, COUPLE, parts),
        }
    }

    /// Adds the loads of the list on a rod.
    fn listed(&mut self, loads: &'a mut [RodLoad]) {
        for load in loads {
            let RodLoad {
                number,
                place,
                force,
                couple,
                factor,
                ..
            } = load;
            self.k = *number;
            if matches!(place, LoadPlace::Along { .. }) {
                self.at("load[]", *number, Square);
                self.add("force_per_length.xyz", Quantity::Distributed, force);
                self.add("couple_per_length.xyz", Quantity::Force, couple);
            } else {
                self.vary(&LISTED_FORCE, each(force));
                self.vary(&LISTED_COUPLE, each(couple));
            }
            self.vary(&LISTED_FACTOR, [(0, factor)]);
            self.at("load[]", *number, Any);
            match place {
                LoadPlace::End { .. } => {}
                LoadPlace::Station { s } => self.add("s", Quantity::Length, [s]),
                LoadPlace::Along { from, to } => {
                    self.add("from", Quantity::Length, [from]);
                    self.add("to", Quantity::Length, [to]);
                }
            }
        }
    }

    /// Adds a load along a rod.
    fn along(&mut self, (table, constant): (&'static str, &Variable), load: &'a mut LoadAlong) {
        let of = Quantity::Distributed;
        match load {
            LoadAlong::Constant(force) => self.vary(constant, each(force)),
            LoadAlong::Polynomial { polynomial } => {
                self.at(table, 0, Square);
                self.add("polynomial[]", of, polynomial.as_flattened_mut());
            }
            LoadAlong::Table { table: rows } => {
                self.at(table, 0, Square);
                for [s, force @ ..] in rows {
                    self.add("table.s", Quantity::Length, [s]);
                    self.add("table.force.xyz", of, force);
                }
            }
        }
    }

    /// Adds loads in time, a table each, of one quantity and its rate.
    fn in_time(
        &mut self,
        table: &'static str,
        index: impl Fn(usize) -> usize,
        of: [Quantity; 2],
        parts: &'a mut [Force],
    ) {
        for (i, part) in parts.iter_mut().enumerate() {
            self.at(table, index(i), Square);
            self.history(of, &mut part.size);
        }
    }

    /// Adds the numbers of body k of an assembly.
    pub fn assembly_body(&mut self, k: usize, body: &'a mut AssemblyBody) {
        let is_massless = body.is_massless();
        self.k = k;
        match &mut body.force {
            Load::Constant(force) => self.vary(&BODY_FORCE, each(force)),
            Load::InTime(parts) => self.in_time("body[].force", |_| k, FORCE, parts),
        }
        match &mut body.couple {
            // A point mass takes no couple.
            Load::Constant(_) if body.extent.is_none() => {}
            Load::Constant(couple) => self.vary(&BODY_COUPLE, each(couple)),
            Load::InTime(parts) => self.in_time("body[].couple", |_| k, COUPLE, parts),
        }
        self.at("body[]", k, Any);
        self.add("mass", Quantity::Mass, [&mut body.mass]);
        self.shape("body[]", k, body.shape.as_mut());
        self.groove(body.groove.as_mut());
        self.at("body[]", k, Square);
        let (v, w) = (&mut body.velocity, &mut body.angular_velocity);
        self.add("velocity.xyz", Quantity::Velocity, v);
        self.add("angular_velocity.xyz", Quantity::AngularVelocity, w);
        self.add("drag", Quantity::Drag, [&mut body.drag]);
        let drag = &mut body.rotational_drag;
        self.add("rotational_drag", Quantity::RotationalDrag, [drag]);
        if let Some(guess) = &mut body.guess {
            self.add("guess.position.xyz", Quantity::Length, &mut guess.position);
        }
        if let Some(place) = &mut body.place {
            self.add("position.xyz", Quantity::Length, &mut place.position);
        }
        if let Some(extent) = body.extent.as_mut().filter(|_| !is_massless) {
            let Extent {
                offset,
                inertia,
                rotor,
            } = extent;
            self.extent(offset, inertia, rotor);
        }
    }

    /// Adds the constant couple or force in a joint.
    fn joint(&mut self, [couple, force]: [&Variable; 2], joint: &'a mut SiteJoint) {
        if joint.couple_mut().is_some() {
            self.vary(couple, joint.couple_mut().map(|x| (0, x)));
        } else {
            self.vary(force, joint.force_mut().map(|x| (0, x)));
        }
    }

    /// Adds the numbers of the bodies of an assembly, and of places on the ground.
    fn assembly(&mut self, assembly: &'a mut AssemblyScene) {
        for (k, body) in assembly.bodies.iter_mut().enumerate() {
            self.assembly_body(k, body);
        }
        for (k, rod) in assembly.rods.iter_mut().enumerate() {
            self.k = k;
            let AssemblyRod { from, to, .. } = rod;
            let (joint, place) = split(from);
            self.joint([&FROM_COUPLE, &FROM_FORCE], joint);
            let from = place;
            let (joint, place) = split(to);
            self.joint([&TO_COUPLE, &TO_FORCE], joint);
            let to = place;
            self.vary(&FROM_POSITION, from.0.into_iter().flat_map(each));
            self.vary(&TO_POSITION, to.0.into_iter().flat_map(each));
            self.vary(&TENSION_OF, tensions(&mut rod.rod.tendons));
            self.listed(&mut rod.rod.loads);
            self.k = k;
            self.vary(&FROM_ANGLE, from.1.and_then(angle));
            self.vary(&TO_ANGLE, to.1.and_then(angle));
        }
    }
}

/// Position and orientation of an attachment on the ground; none of one on a body.
type PlaceOnGround<'a> = (Option<&'a mut [f64; 3]>, Option<&'a mut Orientation>);

/// Joint of an attachment, and its place on the ground.
fn split(site: &mut Site) -> (&mut SiteJoint, PlaceOnGround<'_>) {
    let is_on_ground = site.body.is_none();
    let place = is_on_ground.then_some((&mut site.position, &mut site.orientation));
    (&mut site.joint, place.unzip())
}
