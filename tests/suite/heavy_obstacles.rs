//! Rods with all of their mass among obstacles, through the barrier: against closed forms, Coulomb's law and
//! differences.

use crate::heavy_assemblies::{given, link, weld};
use crate::support::text_of;
use nalgebra::{DVector, Isometry3, Matrix3, Vector3};
use snaprod::assembly::{Attachment, Body, BodyMotion};
use snaprod::body::RigidBody;
use snaprod::contact::Obstacle;
use snaprod::full_mass::assembly::HeavyAssembly;
use snaprod::full_mass::elements::{BarrierStrength, ElementAssembly, Mesh};
use snaprod::full_mass::obstacles::{BallOnBody, Bearer, ObstaclesOfRods, RoundSurface};
use snaprod::scene::Scene;
use snaprod::solve::system::{Linearised, System};
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table};

/// A run with the tables of trajectory and contacts.
pub(crate) struct Ran {
    pub record: RunRecord,
    pub trajectory: Table,
    pub contacts: Table,
}

/// Runs a scene to its end. No gap comes to zero, and the ledger closes within `open` of its largest energy.
pub(crate) fn ran(text: &str, open: f64) -> Ran {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap_or_else(|why| panic!("{why}"));
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent);
    let record = record.unwrap_or_else(|why| panic!("{why}"));
    assert!(record.reason().is_none(), "{:?}", record.reason());
    let contacts = record.branches[0].contacts.as_ref().expect("contacts");
    assert!(contacts.least_gap > 0.0, "a gap of {}", contacts.least_gap);
    let mut named = |name: &str| {
        let at = tables.iter().position(|table| table.name == name);
        tables.swap_remove(at.unwrap_or_else(|| panic!("no table {name}")))
    };
    let (trajectory, contacts) = (named("trajectory"), named("contacts"));
    let total = trajectory.reals("total");
    let energies = ["rod_kinetic", "potential", "elastic", "dissipated"].iter();
    let energies = energies.flat_map(|name| trajectory.reals(name));
    let largest = energies.fold(0.0, |most: f64, x| most.max(x.abs()));
    let off = total.iter().map(|x| (x - total[0]).abs());
    let off = off.fold(0.0, f64::max);
    assert!(
        off <= open * largest,
        "the ledger is open by {off} of {largest}"
    );
    Ran {
        record,
        trajectory,
        contacts,
    }
}

impl Ran {
    pub fn last(&self, column: &str) -> f64 {
        *self.trajectory.reals(column).last().expect("rows")
    }

    /// A column of the contacts at the last time.
    pub fn last_contacts(&self, column: &str) -> Vec<f64> {
        let t = self.contacts.reals("t");
        let end = *t.last().expect("a contact");
        assert_eq!(end, self.last("t"), "the last contact is not at the end");
        let rows = t.iter().zip(self.contacts.reals(column));
        rows.filter(|(t, _)| **t == end).map(|(_, x)| *x).collect()
    }
}

/// A rod of length, mass and bending stiffness 1 at a height above a floor, clamped or free.
fn above_floor(clamp: &str, gravity: [f64; 3], rest: &str) -> String {
    format!(
        r#"
        [rod]
        model = "cosserat"
        length = 1.0
        mass = 1.0
        inertia = "full"
        contact_diameter = 0.02
        damping = {{ proportional = 0.03 }}
        section = {{ bending = [1.0, 1.0], torsion = 0.8, shear = [1e4, 1e4], axial = 2e4 }}
        [clamp]
        {clamp}
        tangent = [1.0, 0.0, 0.0]
        [start]
        rest = "straight"
        [loads]
        gravity = {gravity:?}
        {rest}
        "#
    )
}

const FLOOR: &str = r#"
    [[obstacle]]
    name = "floor"
    plane = { normal = [0.0, 0.0, 1.0] }
    "#;

/// A cantilever at a small height h sinks onto a floor. With the weight q per length, l^4 = 72 h/q is the free length,
/// q l/3 the reaction where the rod touches down, and q beyond. Catches a barrier that pushes too much or too little,
/// a wrong sum over the points, and a distance to the floor that does not fall with the gap.
#[test]
fn a_heavy_cantilever_lies_on_a_floor() {
    let (height, q): (f64, f64) = (0.004, 20.0);
    let rest = [4e-4, 2e-4].map(|gap| {
        let clamp = format!("position = [0.0, 0.0, {}]", height + 0.01);
        let run = format!("[contact]\ngap = {gap:e}\n{FLOOR}\n[run]\nduration = 4.0\nsamples = 5");
        let ran = ran(&above_floor(&clamp, [0.0, 0.0, -q], &run), 0.05);
        assert!(ran.last("rod_kinetic") < 1e-8);
        let lies = ran.last("z") - 0.01;
        assert!(lies > 0.8 * gap && lies < gap, "{lies} at the gap {gap}");
        // The floor is at the height of the barrier.
        let free = (72.0 * (height - lies) / q).powf(0.25);
        let normal: f64 = ran.last_contacts("normal").iter().sum();
        let wanted = q * (1.0 - free) + q * free / 3.0;
        assert!(
            (normal / wanted - 1.0).abs() < 4e-3,
            "{normal} for {wanted}"
        );
        let begins = ran.last_contacts("s_from")[0];
        assert!((begins - free).abs() < 0.045, "{begins} for {free}");
        lies
    });
    assert!((rest[0] / rest[1] - 2.0).abs() < 0.2, "{rest:?}");
}

/// A rod on a slope. Below the angle of friction the rod stays where it is for ever: catches friction that creeps.
/// Above it the rod slides with g (sin - mu cos), and friction takes its force times the way: catches a wrong size or
/// direction of friction, and a loss that is not booked.
#[test]
fn friction_holds_a_rod_on_a_slope_or_slides_by_its_law() {
    let slope = |mu: f64, duration: f64| {
        let clamp = "free = true\nposition = [0.0, 0.0, 0.0109]";
        let run = format!(
            "[contact]\ngap = 1e-3\nfriction = {mu}\n{FLOOR}\n[run]\nduration = {duration}\nsamples = 3"
        );
        ran(&above_floor(clamp, [2.0, 0.0, -10.0], &run), 2e-3)
    };
    let holds = slope(0.25, 200.0);
    let x = holds.trajectory.reals("x");
    assert!((x[2] - x[1]).abs() < 2e-5, "from {} to {}", x[1], x[2]);
    let tangential: f64 = holds.last_contacts("tangential").iter().sum();
    assert!((tangential - 2.0).abs() < 1e-4, "{tangential}");
    let states = holds.contacts.words("state");
    assert!(states.last().is_some_and(|state| *state == "stick"));
    let slides = slope(0.1, 1.0);
    let way = slides.last("x") - 1.0;
    // While the rod bounces at first, friction sets in anew at each touch.
    assert!((way - 0.5).abs() < 1e-2, "{way}");
    let lost = slides.last("friction_lost");
    assert!((lost / (0.1 * 10.0 * way) - 1.0).abs() < 1e-2, "{lost}");
    let cone = slides.record.branches[0]
        .contacts
        .as_ref()
        .and_then(|c| c.max_cone);
    assert!(cone.is_some_and(|cone| cone.abs() < 1e-9), "{cone:?}");
}

/// The cable of the gallery comes to rest: its weight lies on the floor, a barrier away, and what it lost is booked.
/// Catches energy that contacts create, and a closing loss that is left out.
#[test]
fn a_cable_dropped_on_a_floor_comes_to_rest() {
    let ran = ran(&text_of("cable_on_floor"), 2e-3);
    let weight = 9.81 * 1100.0 * 0.5 * std::f64::consts::PI * 0.005_f64.powi(2);
    let normal: f64 = ran.last_contacts("normal").iter().sum();
    assert!(
        (normal / weight - 1.0).abs() < 1e-3,
        "{normal} for {weight}"
    );
    assert!(ran.last("rod_kinetic") < 1e-7 * weight);
    for end in ["z", "base_z"] {
        let lies = ran.last(end) - 0.005;
        assert!(lies > 0.0 && lies < 5e-4, "{end}: {lies}");
    }
    assert!(ran.last("closing_lost") > 0.1 * ran.last("dissipated"));
    let events = &ran.record.branches[0]
        .contacts
        .as_ref()
        .expect("contacts")
        .rod_events;
    assert_eq!(events.first().map(|event| event.key()), Some("touch"));
}

/// A thin bar between the points of a rod that falls fast, in the plane. Catches obstacles that pass between points or
/// through a rod within a step.
#[test]
fn a_rod_does_not_fall_through_a_thin_bar() {
    let text = r#"
        [rod]
        model = "elastica"
        length = 1.0
        bending_stiffness = 1.0
        mass = 1.0
        inertia = "full"
        damping = { proportional = 0.05 }
        [start]
        rest = "straight"
        [loads]
        gravity = [0.0, -60.0]
        [[obstacle]]
        name = "bar"
        segment = { from = [0.613, -0.15], to = [0.6131, -0.15], radius = 0.003 }
        [run]
        duration = 2.0
        samples = 41
        "#;
    let ran = ran(text, 0.02);
    let normal: f64 = ran.last_contacts("normal").iter().sum();
    assert!(normal > 5.0, "{normal}");
    let s = ran.last_contacts("s")[0];
    assert!(s > 0.6 && s < 1.0, "{s}");
    let thin = text.replace("radius = 0.003", "radius = 1e-5");
    let prepared = Prepared::new(&Scene::parse(&thin).unwrap()).unwrap();
    let why = prepared
        .start()
        .err()
        .map(|why| why.to_string())
        .unwrap_or_default();
    assert!(why.contains("too thin for the rod"), "{why}");
}

/// Obstacles that nothing reaches change no digit.
#[test]
fn obstacles_out_of_reach_change_no_digit() {
    let clamp = "position = [0.0, 0.0, 5.0]";
    let run = "[run]\nduration = 0.5\nsamples = 3\ntolerance = 1e-3";
    let gravity = [0.0, 0.0, -10.0];
    let with = ran(
        &above_floor(clamp, gravity, &format!("{FLOOR}\n{run}")),
        1e-2,
    );
    let text = above_floor(clamp, gravity, run);
    let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
    let mut tables: Vec<Table> = Vec::new();
    let prepared = Prepared::new(&scene).unwrap();
    run_alone(&prepared, &mut tables);
    for column in ["x", "z", "vz", "elastic", "dissipated"] {
        assert_eq!(
            with.trajectory.reals(column),
            tables[0].reals(column),
            "{column}"
        );
    }
}

fn run_alone(prepared: &Prepared, tables: &mut Vec<Table>) {
    run(prepared, Fields::None, tables, &mut Silent).unwrap();
}

/// Catches scenes of a kind not built that run, and refusals without a way out.
#[test]
fn scenes_with_obstacles_that_heavy_rods_do_not_follow_are_refused() {
    let good = above_floor(
        "position = [0.0, 0.0, 0.1]",
        [0.0, 0.0, -1.0],
        &format!("{FLOOR}\n[run]\nduration = 0.1"),
    );
    assert_eq!(Scene::parse(&good).unwrap().run().unwrap().tolerance, 1e-3);
    for (from, to, words) in [
        (
            "[run]",
            "[run]\ntolerance = 1e-8",
            "write tolerance = 1e-4 or 1e-3",
        ),
        (
            "[run]",
            "[run]\nmethod = \"explicit\"",
            "leave out run.method",
        ),
        (
            "name = \"floor\"",
            "restitution = 0.5",
            "leave restitution out",
        ),
        (
            "name = \"floor\"",
            "motion = { translate = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.2]] }",
            "leave out the motion of the obstacle",
        ),
        (
            "[run]",
            "[contact]\nmethod = \"exact\"\n[run]",
            "leave out contact.method",
        ),
        (
            "[run]",
            "[contact]\ngap = 0.1\n[run]",
            "a number in [1e-8, 0.05]",
        ),
    ] {
        let faults = Scene::parse(&good.replace(from, to))
            .expect_err(words)
            .to_string();
        assert!(faults.contains(words), "{faults}");
    }
    let deep = good.replace("0.0, 0.0, 0.1]", "0.0, 0.0, -0.02]");
    let prepared = Prepared::new(&Scene::parse(&deep).unwrap()).unwrap();
    let why = prepared
        .start()
        .err()
        .map(|why| why.to_string())
        .unwrap_or_default();
    assert!(why.contains("starts 0.03 inside of a plane"), "{why}");
}

/// Catches a wrong derivative of the barrier, of its losses or of friction: Newton's matrix is that of differences, for
/// a rod in a tube and a ball on a body that is beside its place.
#[test]
fn the_matrix_among_obstacles_is_that_of_differences() {
    let rod = given(
        0.4,
        0.05,
        1.0,
        Vector3::new(0.3, -0.2, -1.0),
        &[0, 1, 2, 3, 4, 5],
    );
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.03, 0.02, 0.04));
    let body = RigidBody::new(1.0, inertia).unwrap();
    let on = Attachment::body(0, Isometry3::identity());
    let links = vec![link(rod, 6, weld(on), None)];
    let tube = Obstacle::cylinder(Vector3::zeros(), Vector3::z(), 0.1, true).unwrap();
    let floor = Obstacle::plane(Vector3::new(0.0, 0.0, -0.1), Vector3::z()).unwrap();
    let surface = |radius, friction: [Option<f64>; 2]| RoundSurface {
        radius,
        friction: friction.to_vec(),
    };
    let obstacles = ObstaclesOfRods {
        obstacles: vec![tube, floor],
        frame: Isometry3::identity(),
        rods: vec![surface(0.06, [Some(0.3), None])],
        balls: vec![BallOnBody {
            on: Bearer::Listed(0),
            centre: Vector3::new(0.01, 0.02, 0.0),
            mass: 1.0,
            surface: surface(0.07, [None, Some(0.0)]),
        }],
        between: Vec::new(),
        gap: 0.05,
        stick: 0.02,
    };
    let obstacles = obstacles.checked(1.0).unwrap();
    let assembly = HeavyAssembly::new(vec![Body::rigid(body)], links).unwrap();
    let mesh = Mesh {
        elements: vec![vec![2]],
        degree: 3,
    };
    let model = ElementAssembly::new(&assembly.among(obstacles), mesh).unwrap();
    let strength = BarrierStrength {
        push: 30.0,
        settling: 1.5,
    };
    let model = model.with_barrier_strength(Some(strength));
    let places = model.places(0).iter();
    let at = |s: &f64| BodyMotion::at_rest(Isometry3::translation(0.02, 0.01, *s));
    let nodes: Vec<BodyMotion> = places.map(at).collect();
    let base = BodyMotion::at_rest(Isometry3::translation(0.02, 0.01, 0.0));
    let y = model.state(&[base], &[nodes]);
    let moment = model.moment(&y).unwrap();
    let model = model.anchored(&moment);
    let (time, sites) = (model.time(), model.sites());
    let mut y = y;
    for i in 0..sites {
        for k in 0..3 {
            y[7 * i + k] += 4e-3 * (1.7 * (3 * i + k) as f64 + 0.4).sin();
        }
    }
    for i in 7 * sites..time {
        y[i] += 0.05 * (1.3 * i as f64 + 0.1).sin();
    }
    assert!(model.moment(&y).unwrap().barrier() > 0.0);
    assert!(model.barrier_contacts(&model.moment(&y).unwrap()).len() >= 2);
    let mut x = DVector::zeros(y.len());
    for i in 0..sites {
        for k in 0..3 {
            x[7 * i + k] = (0.9 * (3 * i + k) as f64 + 0.2).sin();
        }
    }
    for i in 7 * sites..time {
        x[i] = 0.1 * (0.7 * i as f64).sin();
    }
    let found = System::linearised(&model, &y).unwrap().times(&x);
    let slope = |h: f64| {
        let mut out = DVector::zeros(y.len());
        System::slope(&model, &(&y + &x * h), &mut out).unwrap();
        out
    };
    let step = 1e-7;
    let wanted = (slope(step) - slope(-step)) / (2.0 * step);
    let speeds = 7 * sites..time;
    let size = wanted.rows(speeds.start, speeds.len()).amax();
    let off = (found - &wanted).rows(speeds.start, speeds.len()).amax();
    assert!(off < 2e-2 * size, "{off:e} of {size:e}");
}
