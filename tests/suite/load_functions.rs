//! Functions of time and of the motion as loads on bodies, in every model.

use nalgebra::Vector3;
use snaprod::body::{BodyState, BodyWrench, LoadFunction};
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, Simulation, run};
use snaprod::study::{Cell, Silent, Table};
use std::sync::atomic::{AtomicBool, Ordering};

/// A scene of the repository with settings.
fn scene(name: &str, set: &[&str]) -> Scene {
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Scene::read_with(path.as_ref(), set).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A force at the centre of mass.
fn force(force: Vector3<f64>) -> BodyWrench {
    BodyWrench {
        force,
        ..BodyWrench::default()
    }
}

/// The state of a motion at a time: names of its columns, and numbers; words and gaps are NaN.
struct Row {
    names: Vec<String>,
    numbers: Vec<f64>,
}

impl Row {
    fn at(scene: &Scene, t: f64) -> Self {
        let mut simulation = Simulation::new(scene).unwrap_or_else(|e| panic!("{e}"));
        simulation.advance(t).unwrap_or_else(|e| panic!("{e}"));
        let columns = simulation.columns().columns.into_iter();
        let number = |cell: &Cell| match cell {
            Cell::Real(x) => *x,
            Cell::Integer(n) => *n as f64,
            Cell::Word(_) | Cell::Missing => f64::NAN,
        };
        Self {
            names: columns.map(|column| column.name.into_owned()).collect(),
            numbers: simulation.row().unwrap().iter().map(number).collect(),
        }
    }

    fn number(&self, name: &str) -> f64 {
        let k = self.names.iter().position(|one| one == name);
        self.numbers[k.unwrap_or_else(|| panic!("no column {name}"))]
    }

    /// Largest relative distance of all columns except work and loss.
    fn distance(&self, other: &Self) -> f64 {
        assert_eq!(self.names, other.names);
        let each = (0..self.names.len()).map(|k| {
            let [a, b] = [self, other].map(|row| row.numbers[k]);
            match (self.names[k].as_str(), a.is_nan(), b.is_nan()) {
                ("work" | "dissipated" | "friction", ..) | (_, true, true) => 0.0,
                (_, false, false) => (a - b).abs() / (1.0 + a.abs().max(b.abs())),
                _ => f64::INFINITY,
            }
        });
        each.fold(0.0, f64::max)
    }
}

/// A scene whose body has a drag.
struct Dragged {
    name: &'static str,
    set: &'static [&'static str],
    /// Name of the body; empty for one rod.
    body: &'static str,
    /// Centre of mass in the frame of the body.
    centre: [f64; 3],
    drag: f64,
    t: f64,
    /// Largest distance of the function from the drag.
    allowed: f64,
}

impl Dragged {
    /// One rod with its centre of mass at the end.
    const fn rod(name: &'static str, drag: f64, t: f64, allowed: f64) -> Self {
        Self {
            name,
            set: &[],
            body: "",
            centre: [0.0; 3],
            drag,
            t,
            allowed,
        }
    }

    const fn with(mut self, set: &'static [&'static str]) -> Self {
        self.set = set;
        self
    }

    const fn of(mut self, body: &'static str, centre: [f64; 3]) -> Self {
        (self.body, self.centre) = (body, centre);
        self
    }
}

const DRAGGED: [Dragged; 10] = [
    // Planar elastica: through a snap, let go straight in SI units, on a moving clamp.
    Dragged::rod("snap", 3.0, 0.06, 1e-9),
    Dragged::rod("strip", 0.3, 0.1, 1e-9).with(&["rod.damping=0.0"]),
    Dragged::rod("forced", 1.0, 0.4, 1e-8),
    // Friction, in the plane, and in space with a body off the axis.
    Dragged::rod("viscous", 2.0, 0.2, 1e-8),
    Dragged::rod("whirl", 2.0, 0.1, 1e-7).of("", [0.0, 0.0, 0.1]),
    // One elastic rod in space, and an assembly.
    Dragged::rod("pendulum", 1.0, 0.05, 1e-7),
    Dragged::rod("platform", 2.0, 0.1, 1e-7).of("platform", [0.05, 0.02, 0.1]),
    // The free end of a rod with mass, among obstacles.
    Dragged::rod("cable_over_drum", 0.5, 0.002, 1e-9),
    // Contacts: a body on a rod, and a body alone.
    Dragged::rod("bounce_on_floor", 1.0, 0.5, 1e-7),
    Dragged::rod("rocking_block", 0.5, 0.2, 1e-7).of("block", [0.0; 3]),
];

/// Compares a function with the drag of a scene. The loss of the drag is the work of the function.
fn compare(one: &Dragged) {
    let Dragged {
        name,
        body,
        t,
        allowed,
        ..
    } = one;
    let field = if body.is_empty() {
        "loads.drag"
    } else {
        "body.0.drag"
    };
    let duration = format!("run.duration={t}");
    let mut set = one.set.to_vec();
    set.push(&duration);
    let mut felt = scene(name, &set);
    felt.loads.drag = 0.0;
    let (drag, centre) = (one.drag, Vector3::from(one.centre));
    let function = move |now: &BodyState| {
        let arm = now.pose.rotation * centre;
        force(-drag * (now.velocity + now.angular_velocity.cross(&arm)))
    };
    felt.act(body, LoadFunction::smooth(function)).unwrap();
    let dragged = format!("{field}={drag:?}");
    let mut bare = scene(name, &set);
    bare.loads.drag = 0.0;
    set.push(&dragged);
    let [bare, felt, given] = [bare, felt, scene(name, &set)].map(|one| Row::at(&one, *t));
    let far = felt.distance(&given);
    assert!(far <= *allowed, "{name}: {far:e}");
    assert!(bare.distance(&given) > 1e2 * allowed, "{name}: no drag");
    let work = felt.number("work") - felt.number("dissipated");
    let loss = given.number("work") - given.number("dissipated");
    assert!(
        (work - loss).abs() <= allowed * (1.0 + loss.abs()),
        "{name}: {work} {loss}"
    );
    assert!(felt.number("work") < bare.number("work"), "{name}");
}

/// Catches a function that is not felt, is felt twice, sees a state in a wrong frame or unit, acts at a wrong point, or
/// whose work the ledger lacks. Reference: the drag of the scene.
#[test]
fn a_function_of_the_velocity_is_drag() {
    DRAGGED.iter().for_each(compare);
}

/// Catches a function that is lost on the way to a rod with its full mass, by strains at nodes.
#[test]
fn a_function_of_the_velocity_is_drag_on_a_rod_with_mass() {
    compare(&Dragged::rod("heavy_snap", 20.0, 0.001, 1e-6));
}

/// Catches a method of elements that leaves functions out.
#[test]
#[ignore = "second tier: 2 s"]
fn a_function_of_the_velocity_is_drag_on_elements() {
    compare(&Dragged::rod("heavy_snap", 20.0, 0.01, 1e-4).with(&["run.tolerance=1e-5"]));
}

/// Catches a couple about a wrong axis or with a wrong sign. Reference: the rotational drag of the scene.
#[test]
fn a_couple_that_depends_on_the_spin_is_rotational_drag() {
    let set = [
        "run.duration=0.1",
        "clamp.rotation={ axis = [1.0, 2.0, 0.5], angle = 0.7 }",
    ];
    let mut felt = scene("whirl", &set);
    let couple = |now: &BodyState| BodyWrench {
        force: Vector3::zeros(),
        couple: -0.4 * now.angular_velocity,
    };
    felt.act("", LoadFunction::smooth(couple)).unwrap();
    let given = scene("whirl", &[set[0], set[1], "loads.rotational_drag=0.4"]);
    let [felt, given] = [felt, given].map(|one| Row::at(&one, 0.1));
    let far = felt.distance(&given);
    assert!(far < 1e-7, "{far:e}");
    assert!(felt.number("work") < -1e-4);
}

/// Catches a jump inside a step, on the wrong side of its time or in wrong units of time. Reference: a table and
/// a sine of the scene. Times in seconds are no whole numbers of units of the rod.
#[test]
fn functions_of_time_are_histories() {
    let (from, until) = (0.0137, 0.0611);
    let jump = move |now: &BodyState| {
        let on = from <= now.t && now.t < until;
        force(Vector3::y() * if on { 0.4 } else { 0.0 })
    };
    let sine = |now: &BodyState| force(Vector3::x() * 0.1 * (60.0 * now.t + 0.3).sin());
    for damping in ["rod.damping=0.0", "rod.damping={ proportional = 1e-3 }"] {
        let set = ["run.duration=0.1", damping];
        let mut felt = scene("strip", &set);
        felt.act(
            "",
            LoadFunction::piecewise(jump, vec![from, until]).unwrap(),
        )
        .unwrap();
        felt.act("", LoadFunction::smooth(sine)).unwrap();
        let frequency = 60.0 / std::f64::consts::TAU;
        // Ramps that take a billionth of the run.
        let [after, later] = [from, until].map(|t| t + 1e-10);
        let forces = format!(
            "loads.force=[{{ direction = [0.0, 1.0], table = [[{from}, 0.0], [{after}, 0.4], [{until}, 0.4], [{later}, 0.0]] }}, \
             {{ direction = [1.0, 0.0], amplitude = 0.1, frequency = {frequency:?}, phase = 0.3 }}]"
        );
        let given = scene("strip", &[set[0], set[1], &forces]);
        let [felt, given] = [felt, given].map(|one| Row::at(&one, 0.1));
        let far = felt.distance(&given);
        assert!(far < 1e-8, "{damping}: {far:e}");
        let work = felt.number("work") - given.number("work");
        assert!(work.abs() < 1e-9, "{damping}: {work:e}");
    }
}

/// Catches a function that is held over a step, for which the order of the method is lost. Reference: a body on a
/// spring, x'' = -w^2 x, in closed form. Errors fall with the tolerance. The energy of the spring is the work.
#[test]
fn a_spring_keeps_the_order_of_the_method() {
    let (w, x0) = (3.0_f64, 0.5);
    let text = |tolerance: f64| {
        format!(
            "[[body]]\nname = \"ball\"\nmass = 2.0\nposition = [{x0}, 0.0, 0.0]\nvelocity = [0.0, 1.0, 0.0]\n\
             [run]\nduration = 5.0\ntolerance = {tolerance:e}\n"
        )
    };
    let errors = [1e-4, 1e-7, 1e-10].map(|tolerance| {
        let mut scene = Scene::parse(&text(tolerance)).unwrap();
        let spring = move |now: &BodyState| force(-2.0 * w * w * now.pose.translation.vector);
        scene.act("ball", LoadFunction::smooth(spring)).unwrap();
        let row = Row::at(&scene, 5.0);
        let (sin, cos) = (5.0 * w).sin_cos();
        let [x, y] = [x0 * cos, sin / w];
        let stored = |x: f64, y: f64| w * w * (x * x + y * y);
        let work = stored(x0, 0.0) - stored(x, y);
        let off = [
            row.number("ball.x") - x,
            row.number("ball.y") - y,
            row.number("work") - work,
        ];
        off.iter().fold(0.0_f64, |far, x| far.max(x.abs()))
    });
    assert!(
        errors[0] < 1e-2 && errors[1] < 2e-5 * errors[0].max(1e-2),
        "{errors:?}"
    );
    assert!(
        errors[2] < 1e-8 && errors[2] < 1e-1 * errors[1],
        "{errors:?}"
    );
}

/// Ends a run by a failure of its function at a given time, and looks at the rows.
fn fail(name: &str, body: &str, t: f64) {
    let duration = format!("run.duration={}", 2.0 * t);
    let mut scene = scene(name, &[&duration]);
    // After its first failure the function fails at all times.
    let failed = AtomicBool::new(false);
    let fails = move |now: &BodyState| {
        failed.fetch_or(now.t >= t, Ordering::Relaxed);
        let dead = failed.load(Ordering::Relaxed);
        force(Vector3::x() * if dead { f64::NAN } else { 0.01 })
    };
    scene.act(body, LoadFunction::smooth(fails)).unwrap();
    let prepared = Prepared::new(&scene).unwrap();
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
    assert!(record.reason().is_some(), "{name}");
    let last = tables[0].rows() - 1;
    let Cell::Real(end) = tables[0].columns[0].cell(last) else {
        panic!("{name}: no time");
    };
    assert!(0.4 * t < end && end <= t, "{name}: {end}");
}

/// Catches a run that hangs or panics where steps collapse, of models with dear steps.
#[test]
#[ignore = "second tier: 4 s"]
fn a_function_that_fails_ends_runs_of_dear_steps() {
    fail("pendulum", "", 0.05);
    fail("heavy_snap", "", 0.002);
}

/// Catches a run that hangs, panics or loses its rows when a function fails, and a couple on a point mass that is left
/// out in silence.
#[test]
fn a_function_that_fails_ends_the_run_with_what_was_computed() {
    fail("snap", "", 0.04);
    fail("viscous", "", 0.1);
    fail("whirl", "", 0.05);
    fail("platform", "platform", 0.05);
    fail("rocking_block", "block", 0.1);
    let mut scene = scene("snap", &["run.duration=0.01"]);
    let couple = |_: &BodyState| BodyWrench {
        force: Vector3::zeros(),
        couple: Vector3::z(),
    };
    scene.act("", LoadFunction::smooth(couple)).unwrap();
    let ends = Simulation::new(&scene).and_then(|mut one| one.advance(0.01));
    assert!(ends.is_err());
}

/// Catches functions that a state, a copy or a change of the scene loses, and studies that leave functions out.
#[test]
fn functions_stay_with_a_simulation_and_are_refused_elsewhere() {
    let set = ["run.duration=0.02"];
    let mut plain = scene("snap", &set);
    let why = plain.act("tip", LoadFunction::smooth(|_| BodyWrench::default()));
    assert!(
        why.unwrap_err()
            .to_string()
            .contains("one rod has one body")
    );
    let push = |now: &BodyState| force(Vector3::y() * 30.0 * now.pose.translation.x);
    let before = plain.clone();
    plain.act("", LoadFunction::smooth(push)).unwrap();
    let mut whole = Simulation::new(&plain).unwrap();
    whole.advance(0.01).unwrap();
    let state = whole.state().unwrap();
    let mut again = whole.copy().unwrap();
    let mut changed = whole.copy().unwrap();
    changed.change(&before).unwrap();
    let mut other = Simulation::new(&plain).unwrap();
    other.restore(&state).unwrap();
    let mut ends = Vec::new();
    for one in [&mut whole, &mut again, &mut changed, &mut other] {
        one.advance(0.02).unwrap();
        let Cell::Real(x) = one.row().unwrap()[2] else {
            panic!("no number");
        };
        ends.push(x);
    }
    assert!(ends.iter().all(|x| (x - ends[0]).abs() < 1e-9), "{ends:?}");
    let without = Row::at(&before, 0.02);
    assert!((without.numbers[2] - ends[0]).abs() > 1e-4);
    for why in [
        snaprod::study::modes(&plain).map(drop).unwrap_err(),
        snaprod::study::memory(&plain).map(drop).unwrap_err(),
        snaprod::study::run::derivatives(&plain, &[])
            .map(drop)
            .unwrap_err(),
    ] {
        assert!(why.to_string().contains("functions as loads"), "{why}");
    }
    let late = LoadFunction::piecewise(|_| BodyWrench::default(), vec![2.0, 1.0]);
    assert!(late.unwrap_err().to_string().contains("[2.0, 1.0]"));
}
