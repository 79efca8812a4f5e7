//! Run of an assembly.

use super::record::{AssemblyMoment, AssemblyRunBranch, AssemblyRunRecord, BodyMoment};
use crate::assembly::{BodyMotion, Contact, Joint};
use crate::error::{Error, Result};
use crate::motion::{
    Event, LedgerClosure, LightReference, LightSnap, Motion, Observer, Outcome, Snap, SnapEnd,
    State, drive,
};
use crate::scene::{AssemblyScene, AssemblySetup, Run, Scales, Scene, Units};
use crate::study::decimate::Thinned;
use crate::study::light_rod_reference::LightRods;
use crate::study::neglected_mass::{
    FoldPassed, FoldTreatment, MassEffect, RodsAtRest, Validity, passed,
};
use crate::study::run::Bounces;
use crate::study::run::Bounds;
use crate::study::run::recorder::{INNER_IN_SPACE, STEP_ENDS, outcome_after_audit};
use crate::study::run::shapes::{Shapes, at_times, poses};
use crate::study::run::table::{ledger_cells, ledger_columns, rod_kinetic};
use crate::study::run::trajectory_name;
use crate::study::run::tree::tree;
use crate::study::{Cell, Column, Hooks, Sink, Solid, Table};
use nalgebra::{Isometry3, Vector6};

/// Largest number of samples kept for figures; at the limit every second one is dropped.
const KEPT: usize = 4000;
/// Sections of a rod that is drawn, less one.
const SECTIONS: usize = 60;

/// A motion from its start, and the Morse index at the start (`None` if unknown or not in equilibrium).
pub type AssemblyMotion = (Box<dyn Motion<'static>>, Option<usize>);

/// A scene of a moving assembly ready to run.
pub struct AssemblyPrepared {
    pub(in crate::study) setup: AssemblySetup,
    pub(in crate::study) scene: Scene,
    run: Run,
}

impl AssemblyPrepared {
    /// Scales the scene.
    ///
    /// # Errors
    /// A scene of one rod, or of statics; errors that [`Scene::parse`] cannot detect from the numbers alone.
    pub fn new(scene: &Scene) -> Result<Self> {
        Ok(Self {
            setup: AssemblySetup::new(scene).map_err(|e| scene.in_own_units(e))?,
            scene: scene.clone(),
            run: scene.run()?.clone(),
        })
    }

    /// The motion from its start, and the Morse index of the equilibrium at the start, if any.
    ///
    /// # Errors
    /// A start from which no motion is possible.
    pub fn motion(&self) -> Result<AssemblyMotion> {
        let motion = self.setup.motion(&self.scene);
        motion.map_err(|e| self.scene.in_own_units(e))
    }

    /// A state in the world and the scene's units.
    fn moment(&self, state: &dyn State) -> AssemblyMoment {
        AssemblyMoment {
            index: state.index(),
            ..self.passing(state)
        }
    }

    /// A state in the world without the index, the expensive part.
    pub(in crate::study) fn passing(&self, state: &dyn State) -> AssemblyMoment {
        let (k, ledger) = (&self.setup.scales, state.ledger());
        let mut grooves = state.groove_forces().into_iter();
        let body = |place: &BodyMotion| {
            let mut pose = place.pose;
            pose.translation.vector *= k.length;
            BodyMoment {
                pose,
                velocity: place.twist.fixed_rows::<3>(3) * k.velocity,
                angular_velocity: place.twist.fixed_rows::<3>(0) / k.time,
                groove: grooves.next().flatten().map(|force| force * k.force),
            }
        };
        AssemblyMoment {
            t: self.run.output_time(state.time(), k.time),
            bodies: state.bodies().iter().map(body).collect(),
            ledger: ledger.scaled(k.energy),
            total: ledger.total() * k.energy,
            index: None,
        }
    }

    /// Every rod now, from base to end.
    pub(in crate::study) fn shapes(&self, state: &dyn State, points: usize) -> Result<Shapes> {
        let Some(now) = state.configuration() else {
            let mut curves = state.curves(points);
            for (s, pose) in curves.iter_mut().flatten() {
                *s *= self.setup.scales.length;
                pose.translation.vector *= self.setup.scales.length;
            }
            return Ok(curves);
        };
        self.setup.shapes(state.time(), now, points)
    }

    /// Poses of the sections of every rod.
    pub(in crate::study) fn sections(
        &self,
        state: &dyn State,
        points: usize,
    ) -> Result<Vec<Vec<Isometry3<f64>>>> {
        let curves = self.shapes(state, points)?;
        Ok(curves.into_iter().map(poses).collect())
    }

    /// Light rods that accompany the rods with fully followed mass, from the first state.
    fn beside(&self, first: &dyn State) -> LightRods {
        let rods = self.setup.light_rods(&self.scene).into_iter();
        let rods = rods.map(|rod| LightReference::new(Box::new(rod), first));
        LightRods::new(rods.collect())
    }

    /// Names of the rods in the order of shapes: those with a free end last.
    pub fn names(&self) -> Vec<String> {
        let held = self.rod_names().into_iter();
        held.chain(self.free_names()).collect()
    }

    /// Joints of base and end of each rod to the ground, in the order of `names`; `None` at a body or free end.
    pub fn grounds(&self) -> Vec<[Option<Joint>; 2]> {
        let given = self.scene.assembly().into_iter();
        given.flat_map(AssemblyScene::grounds).collect()
    }

    fn grooved(&self) -> Vec<bool> {
        let given = self.scene.assembly().into_iter();
        let bodies = given.flat_map(|given| &given.bodies);
        bodies.map(|body| body.groove.is_some()).collect()
    }

    fn thickness(&self) -> Vec<Option<f64>> {
        let given = self.scene.assembly().into_iter();
        let rods = given.flat_map(|given| &given.rods);
        rods.map(|rod| rod.rod.thickness()).collect()
    }

    pub(in crate::study) fn body_names(&self) -> Vec<String> {
        let given = self.scene.assembly().into_iter();
        let bodies = given.flat_map(|given| &given.bodies);
        bodies.map(|body| body.name.clone()).collect()
    }

    pub(in crate::study) fn solids(&self) -> Vec<Solid> {
        let given = self.scene.assembly().into_iter();
        let bodies = given.flat_map(|given| &given.bodies);
        bodies.map(Solid::of).collect()
    }

    fn rod_names(&self) -> Vec<String> {
        let given = self.scene.assembly().into_iter();
        let rods = given.flat_map(|given| &given.rods);
        rods.map(|rod| rod.name.clone()).collect()
    }

    /// True if the mass of a rod is followed.
    fn feels_rods(&self) -> bool {
        self.setup.is_heavy() || self.setup.assembly.light_rods().next().is_some()
    }

    /// The trajectory before the run: names, units and meanings of its columns.
    pub fn columns(&self) -> Table {
        self.trajectory(0)
    }

    /// The trajectory of a branch, without rows.
    fn trajectory(&self, branch: usize) -> Table {
        let bodies = self.body_names();
        let bodies = bodies.iter().zip(self.grooved());
        trajectory(
            trajectory_name(branch),
            bodies,
            self.feels_rods(),
            self.scene.units,
        )
    }

    /// Row of the trajectory for a moment.
    fn row(&self, at: &AssemblyMoment) -> Vec<Cell> {
        let numbers = at.bodies.iter().flat_map(BodyMoment::numbers);
        let mut row: Vec<Cell> = std::iter::once(at.t)
            .chain(numbers)
            .map(Cell::Real)
            .collect();
        row.extend(ledger_cells(&at.ledger, at.total));
        if self.feels_rods() {
            row.push(Cell::Real(at.ledger.rod_kinetic));
        }
        row.push(at.index.into());
        row
    }

    fn free_names(&self) -> Vec<String> {
        let given = self.scene.assembly().into_iter();
        let rods = given.flat_map(|given| &given.free);
        rods.map(|rod| rod.name.clone()).collect()
    }
}

/// Effect of the mass of the rods at the equilibrium under the loads at t = 0. `None` where no mass is known or all
/// of it is followed, and where no equilibrium is found.
///
/// # Errors
/// As [`AssemblyPrepared::new`].
pub fn small_mass(scene: &Scene) -> Result<Option<MassEffect>> {
    let setup = AssemblySetup::new(scene).map_err(|e| scene.in_own_units(e))?;
    if setup.is_heavy() {
        return Ok(None);
    }
    Ok(RodsAtRest::assembly(scene, &setup).map(|resting| resting.mass))
}

/// The rods of an assembly at `times`, as in [`crate::study::run::shapes`] for one rod; rods with a free end come
/// last.
///
/// # Errors
/// As [`crate::study::run::shapes`].
pub fn shapes(
    prepared: &AssemblyPrepared,
    times: &[f64],
    points: usize,
    hooks: &mut dyn Hooks,
) -> Result<Vec<Shapes>> {
    let (mut motion, _) = prepared.motion()?;
    let unit = prepared.setup.scales.time;
    // Light rods take the number of intervals, one less than `points`.
    let mut shape = |state: &dyn State| prepared.shapes(state, points.max(2) - 1);
    at_times(&mut *motion, times, unit, hooks, &mut shape)
}

/// The trajectory of an assembly's run at `times` only, as in [`crate::study::run::samples`] for one rod.
///
/// # Errors
/// As [`crate::study::run::samples`].
pub fn samples(prepared: &AssemblyPrepared, times: &[f64], hooks: &mut dyn Hooks) -> Result<Table> {
    let (mut motion, _) = prepared.motion()?;
    let unit = prepared.setup.scales.time;
    let mut row = |state: &dyn State| Ok(prepared.row(&prepared.moment(state)));
    let rows = at_times(&mut *motion, times, unit, hooks, &mut row)?;
    let mut table = prepared.trajectory(0);
    for row in &rows {
        table.push(row)?;
    }
    Ok(table)
}

/// Runs an assembly from the start that [`AssemblyPrepared::motion`] has found, with all branches under landing =
/// "all". Rows of the tables `trajectory`, `trajectory-1`, ... go to `sink` during the run. A run that ends early is
/// no error, as in [`run`](crate::study::run::run).
///
/// # Errors
/// Rows refused by the sink.
pub fn run(
    prepared: &AssemblyPrepared,
    (motion, start_index): AssemblyMotion,
    sink: &mut dyn Sink,
    hooks: &mut dyn Hooks,
) -> Result<AssemblyRunRecord> {
    let scene = serde_json::to_value(&prepared.scene)
        .map_err(|e| Error::io("the scene cannot be written").caused_by(e))?;
    let total = motion.now().ledger().total();
    let scales = prepared.setup.scales;
    let most = prepared.run.branches;
    let (branches, cut) = tree(motion, most, |stem, motion| {
        let (first, first_shapes) = {
            let now = motion.now();
            (prepared.moment(&*now), prepared.sections(&*now, SECTIONS)?)
        };
        let mut closing = LedgerClosure::new(total);
        closing.look(&motion.now().ledger());
        let trajectory = sink.begin(prepared.trajectory(stem.id))?;
        let moments = match motion.resolution() {
            _ if hooks.pictures() == 0 => 0,
            None => INNER_IN_SPACE,
            Some(_) => STEP_ENDS,
        };
        let mut recorder = Recorder {
            prepared,
            sink,
            moments,
            hooks,
            trajectory,
            closing,
            snaps: Vec::new(),
            bounces: Bounces::default(),
            beside: prepared.beside(&*motion.now()),
            track: Thinned::new(KEPT),
        };
        let outcome = drive(motion, prepared.run.samples, &mut recorder)?;
        let Recorder {
            mut closing,
            snaps,
            bounces,
            beside,
            track,
            ..
        } = recorder;
        let (crossed, lost) = beside.told();
        let last = motion.now();
        closing.look(&last.ledger());
        let wrench = |snap: &Snap, end: &SnapEnd| {
            let q = Vector6::from_column_slice(end.q.as_slice());
            prepared.setup.base_wrench(snap.rod, &q, &snap.base)
        };
        let all = stem.entered.iter().chain(&snaps);
        let wrenches = all.map(|snap| Ok([wrench(snap, &snap.from)?, wrench(snap, &snap.to)?]));
        let light = |end: &SnapEnd, rod: usize| {
            let q = Vector6::from_column_slice(end.q.as_slice());
            prepared.setup.light_wrench(rod, &q)
        };
        let of = |LightSnap { snap, .. }: &LightSnap| {
            Ok([light(&snap.from, snap.rod)?, light(&snap.to, snap.rod)?])
        };
        let branch = AssemblyRunBranch {
            snap_wrenches: wrenches.collect::<Result<_>>()?,
            crossed_wrenches: crossed.iter().map(of).collect::<Result<_>>()?,
            crossed,
            lost,
            stem,
            first,
            last: prepared.moment(&*last),
            first_shapes,
            last_shapes: prepared.sections(&*last, SECTIONS)?,
            touching: match &outcome {
                Outcome::SelfContact(contact) => Some(Contact {
                    at: [0, 1].map(|i| prepared.setup.arclength(contact.rods[i], contact.at[i])),
                    gap: contact.gap * scales.length,
                    ..*contact
                }),
                _ => None,
            },
            track: track.list,
            outcome: outcome_after_audit(
                outcome.clone(),
                &closing,
                prepared.run.tolerance,
                last.time(),
            ),
            cost: motion.cost(),
            unfelt: motion.time_without_mass() * scales.time,
            resolution: motion.resolution(),
            snaps,
            bounces,
            closing: closing.scaled(scales.energy),
        };
        Ok((branch, outcome))
    })?;
    let heavy = prepared.setup.is_heavy();
    // For fully followed mass only the passed folds are evaluated.
    let asked = !heavy || branches.iter().any(|branch| !branch.crossed.is_empty());
    let resting = if !asked {
        None
    } else {
        RodsAtRest::assembly(&prepared.scene, &prepared.setup)
    };
    let folds = resting
        .as_ref()
        .map_or(Vec::new(), |resting| folds(resting, &branches, &scales));
    let validity = resting.filter(|_| !heavy).map(|resting| Validity {
        bounces: branches
            .iter()
            .flat_map(|branch| &branch.bounces.first)
            .filter_map(|bounce| resting.bounced(bounce))
            .collect(),
        folds: folds.clone(),
        rest: resting.mass,
        damped: false,
    });
    Ok(AssemblyRunRecord {
        validity,
        folds,
        units: prepared.scene.units,
        scales,
        scene,
        bodies: prepared.body_names(),
        rods: prepared.rod_names(),
        free: prepared.free_names(),
        thickness: prepared.thickness(),
        solids: prepared.solids(),
        duration: prepared.run.duration,
        bounds: Bounds {
            tolerance: prepared.run.tolerance,
            steps: prepared.run.max_steps,
            snaps: prepared.run.max_snaps,
            branches: most,
            fixed_nodes: prepared.scene.rod.nodes.is_some(),
        },
        branches,
        cut,
        start_index,
        masses: prepared.scene.mass_notes(),
    })
}

/// Folds passed in the branches of a run: snaps of the rods, or of the light rods that accompany them.
fn folds(resting: &RodsAtRest, branches: &[AssemblyRunBranch], scales: &Scales) -> Vec<FoldPassed> {
    let of = |branch: &AssemblyRunBranch| {
        let last = (branch.last.t, branch.last.ledger);
        let rest = (scales, &resting.mass);
        let snaps: Vec<_> = branch.all_snaps().map(|snap| (snap, None)).collect();
        let jumps = (branch.stem.id, FoldTreatment::Jump);
        let mut all = passed(jumps, &snaps, last, rest, |snap| resting.passed(snap));
        let crossed = branch.crossed.iter();
        let crossed = crossed.map(|c| (&c.snap, Some(c.ledger.scaled(scales.energy))));
        let crossed: Vec<_> = crossed.collect();
        let heavy = (branch.stem.id, FoldTreatment::Mass);
        let alone = |snap: &Snap| resting.passed_alone(snap);
        all.extend(passed(heavy, &crossed, last, rest, alone));
        all
    };
    branches.iter().flat_map(of).collect()
}

/// The trajectory, without rows.
fn trajectory<'a>(
    name: String,
    bodies: impl Iterator<Item = (&'a String, bool)>,
    felt: bool,
    u: Units,
) -> Table {
    let mut columns = vec![Column::reals("t", u.time(), "time")];
    let per_time = match u.time() {
        "" => "",
        _ => "rad/s",
    };
    let groups = [
        (&["x", "y", "z"][..], u.length(), "position"),
        (&["qw", "qx", "qy", "qz"], "", "quaternion"),
        (&["vx", "vy", "vz"], u.velocity(), "velocity"),
        (&["wx", "wy", "wz"], per_time, "angular velocity"),
    ];
    for (body, grooved) in bodies {
        for (names, unit, meaning) in groups {
            let named = names.iter().map(|name| {
                Column::reals(
                    format!("{body}.{name}"),
                    unit,
                    format!("{meaning} of the frame of {body}, in the world"),
                )
            });
            columns.extend(named);
        }
        let force = ["groove_x", "groove_y", "groove_z"].iter().map(|name| {
            let meaning = format!("force of the groove on {body}, in the world");
            Column::reals(format!("{body}.{name}"), u.force(), meaning)
        });
        columns.extend(force.filter(|_| grooved));
    }
    columns.extend(ledger_columns(u));
    columns.extend(felt.then(|| rod_kinetic(u)));
    let meaning = "Morse indices of the rods with their ends held, added up: 0 is stable";
    columns.push(Column::integers("index", meaning));
    Table::new(name, columns)
}

/// Observer of the motion of an assembly.
struct Recorder<'r> {
    prepared: &'r AssemblyPrepared,
    sink: &'r mut dyn Sink,
    hooks: &'r mut dyn Hooks,
    trajectory: usize,
    closing: LedgerClosure,
    snaps: Vec<Snap>,
    bounces: Bounces,
    beside: LightRods,
    track: Thinned<AssemblyMoment>,
    /// Moments per step for figures, in addition to samples.
    moments: usize,
}

impl Observer for Recorder<'_> {
    fn sample(&mut self, state: &dyn State) -> Result<()> {
        let at = self.prepared.moment(state);
        let row = self.prepared.row(&at);
        self.closing.measure(state);
        // Other moments come from the steps.
        if self.moments == 0 || self.track.list.is_empty() {
            self.track.show(|| at);
        }
        self.sink.row(self.trajectory, &row)
    }

    fn event(&mut self, event: &Event, motion: &mut dyn Motion<'_>) -> Result<()> {
        if let Event::Step { .. } = event
            && motion.resolution().is_some()
        {
            self.beside.step(motion);
        }
        if let Event::Bounce(bounce) = event {
            self.bounces.add(bounce.clone());
        }
        if let Event::Snap(snap) = event {
            self.snaps.push(snap.clone());
            for state in [motion.before_snap(), Some(motion.now())]
                .into_iter()
                .flatten()
            {
                self.closing.look(&state.ledger());
                let at = self.prepared.moment(&*state);
                self.sink.row(self.trajectory, &self.prepared.row(&at))?;
                self.track.keep(at);
            }
        }
        Ok(())
    }

    fn moments(&self) -> usize {
        self.moments
    }

    fn look(&mut self, state: &dyn State) {
        // The first sample is already recorded.
        let unit = self.prepared.setup.scales.time;
        let t = self.prepared.run.output_time(state.time(), unit);
        if let [only] = self.track.list.as_slice()
            && only.t == t
        {
            return;
        }
        // Without the index, which no figure shows.
        self.track.show(|| self.prepared.passing(state));
    }

    fn go_on(&mut self, time: f64) -> bool {
        let (t, duration) = (
            time * self.prepared.setup.scales.time,
            self.prepared.run.duration,
        );
        self.hooks.progress(t / duration, t);
        !self.hooks.interrupted()
    }
}
