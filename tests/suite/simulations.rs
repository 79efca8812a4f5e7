//! Simulations: pieces against one run, saved states, steered forces and changed loads, in every model.

use snaprod::scene::Scene;
use snaprod::study::run::{Prepared, Simulation, SimulationState, samples};
use snaprod::study::{Cell, Silent};

/// A scene of the repository with settings.
fn scene(name: &str, set: &[&str]) -> Scene {
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Scene::read_with(path.as_ref(), set).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// One kind of run: scene, settings, duration, and the largest relative distance of chained pieces; `None` where states
/// are replayed.
type Kind = (&'static str, &'static [&'static str], f64, Option<f64>);

const KINDS: [Kind; 14] = [
    // Planar elastica, with a snap at 0.0256.
    ("snap", &[], 0.06, Some(1e-8)),
    // A straight start, in SI units.
    ("strip", &["rod.damping=0.0"], 0.1, Some(1e-9)),
    // Loads and a clamp in time.
    ("forced", &[], 0.4, Some(1e-8)),
    // Mass to first order, in the plane.
    ("snap", &["rod.mass=0.01"], 0.06, Some(1e-7)),
    // Friction, in the plane.
    ("viscous", &[], 0.2, Some(1e-9)),
    // Friction with memory.
    ("creep", &[], 0.4, Some(1e-7)),
    // Friction, in space.
    ("whirl", &[], 0.1, Some(1e-6)),
    // One elastic rod in space.
    ("pendulum", &[], 0.1, Some(1e-6)),
    // An assembly.
    ("platform", &[], 0.1, Some(1e-6)),
    // Full mass, by strains at nodes.
    ("heavy_snap", &[], 0.004, Some(1e-5)),
    // Full mass, in elements.
    (
        "heavy_cantilever",
        &["run.tolerance=1e-3"],
        0.05,
        Some(1e-2),
    ),
    // A body on an elastic rod that hits a floor.
    ("bounce_on_floor", &[], 0.5, None),
    // Bodies without rods, in contact.
    ("rocking_block", &[], 0.4, None),
    // A rod that touches an obstacle.
    ("strip_at_wall", &[], 0.004, None),
];

/// Numbers of a row; words and gaps are NaN.
fn numbers(row: &[Cell]) -> Vec<f64> {
    let number = |cell: &Cell| match cell {
        Cell::Real(x) => *x,
        Cell::Integer(n) => *n as f64,
        Cell::Word(_) | Cell::Missing => f64::NAN,
    };
    row.iter().map(number).collect()
}

/// Largest distance of two rows, column by column, relative to 1 + their size.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let each = a
        .iter()
        .zip(b)
        .map(|(a, b)| match (a.is_nan(), b.is_nan()) {
            (true, true) => 0.0,
            (false, false) => (a - b).abs() / (1.0 + a.abs().max(b.abs())),
            _ => f64::INFINITY,
        });
    each.fold(0.0, f64::max)
}

fn shortened(kind: &Kind) -> Scene {
    let (name, set, duration, _) = kind;
    let duration = format!("run.duration={duration}");
    let all: Vec<&str> = set.iter().copied().chain([duration.as_str()]).collect();
    scene(name, &all)
}

/// Ends of the pieces of a run.
fn pieces(duration: f64) -> [f64; 4] {
    [0.23, 0.4, 0.81, 1.0].map(|part| part * duration)
}

/// Catches a piece that changes the steps of the run, a column under a wrong name, an event lost or doubled.
#[test]
fn pieces_of_a_simulation_are_one_run() {
    for kind in &KINDS {
        let scene = shortened(kind);
        let times = pieces(kind.2);
        let prepared = Prepared::new(&scene).unwrap();
        let whole = samples(&prepared, &times, &mut Silent).unwrap();
        let mut simulation = Simulation::new(&scene).unwrap();
        let names = [simulation.columns(), whole.clone()].map(|table| {
            let names = table.columns.into_iter().map(|column| column.name);
            names.collect::<Vec<_>>()
        });
        assert_eq!(names[0], names[1], "{}", kind.0);
        for (k, t) in times.iter().enumerate() {
            simulation
                .advance(*t)
                .unwrap_or_else(|e| panic!("{}: {e}", kind.0));
            let row: Vec<Cell> = whole.columns.iter().map(|c| c.cell(k)).collect();
            let far = distance(&numbers(&simulation.row().unwrap()), &numbers(&row));
            assert!(far <= 1e-13, "{} at {t}: {far:e}", kind.0);
        }
        assert!(simulation.advance(times[0]).unwrap_err().is_domain());
        if kind.0 == "snap" {
            let events = simulation.events().unwrap();
            let snaps: Vec<f64> = events.iter().filter_map(|e| e["t"].as_f64()).collect();
            assert!(
                snaps.len() == 1 && (snaps[0] - 0.0255702).abs() < 1e-3,
                "{snaps:?}"
            );
        }
    }
}

/// Catches a part that a saved state lacks, one that changes on the way through JSON, and energies that are lost where
/// pieces join. Among obstacles states follow the motion once more.
#[test]
fn states_join_pieces_of_a_run_in_every_model() {
    for kind in &KINDS {
        let scene = shortened(kind);
        let times = pieces(kind.2);
        let mut whole = Simulation::new(&scene).unwrap();
        whole.advance(times[0]).unwrap();
        let Some(allowed) = kind.3 else {
            let state = whole.state().unwrap();
            assert_eq!(state.motion.method, SimulationState::REPLAY, "{}", kind.0);
            let mut copy = whole.copy().unwrap();
            whole.advance(times[1]).unwrap();
            copy.advance(times[1]).unwrap();
            let mut rows = vec![&mut whole, &mut copy];
            let mut again = Simulation::new(&scene).unwrap();
            again.restore(&state).unwrap();
            again.advance(times[1]).unwrap();
            rows.push(&mut again);
            let rows: Vec<_> = rows
                .into_iter()
                .map(|one| numbers(&one.row().unwrap()))
                .collect();
            assert!(distance(&rows[0], &rows[1]) == 0.0, "{}", kind.0);
            assert!(distance(&rows[0], &rows[2]) == 0.0, "{}", kind.0);
            continue;
        };
        let mut state = whole.state().unwrap_or_else(|e| panic!("{}: {e}", kind.0));
        for (k, t) in times.iter().enumerate().skip(1) {
            let read = SimulationState::from_json(&state.json()).unwrap();
            assert_eq!(read, state);
            let mut piece = Simulation::new(&scene).unwrap();
            piece
                .restore(&read)
                .unwrap_or_else(|e| panic!("{}: {e}", kind.0));
            whole.advance(*t).unwrap();
            piece
                .advance(*t)
                .unwrap_or_else(|e| panic!("{}: {e}", kind.0));
            let rows = [&mut whole, &mut piece].map(|one| numbers(&one.row().unwrap()));
            let far = distance(&rows[0], &rows[1]);
            assert!(far <= allowed, "{} at piece {k}: {far:e}", kind.0);
            state = piece.state().unwrap();
        }
    }
}

/// Catches a force that acts at a wrong time, in a wrong unit or on a slope of before the change. Reference: the same
/// force as a table in time.
#[test]
fn steered_forces_are_forces_in_time() {
    let one = |name: &str, body: &str, axis: usize, size: f64, duration: f64| {
        let field = if body.is_empty() {
            "loads.force"
        } else {
            "body.0.force"
        };
        let run = format!("run.duration={duration}");
        let (from, until) = (0.3 * duration, 0.7 * duration);
        let mut direction = ["0.0"; 3];
        direction[axis] = "1.0";
        let direction = direction[..if body.is_empty() { 2 } else { 3 }].join(", ");
        // A table whose ramps take a billionth of the run.
        let [after, later] = [from, until].map(|t| t + 1e-9 * duration);
        let table =
            format!("[[{from}, 0.0], [{after}, {size:?}], [{until}, {size:?}], [{later}, 0.0]]");
        let force = format!("{field}=[{{ direction = [{direction}], table = {table} }}]");
        let tabled = scene(name, &[&run, &force]);
        let mut tabled = Simulation::new(&tabled).unwrap();
        let bare = format!(
            "{field}={}",
            if body.is_empty() {
                "[]"
            } else {
                "[0.0, 0.0, 0.0]"
            }
        );
        let mut steered = Simulation::pushed(&scene(name, &[&run, &bare]), &[body]).unwrap();
        let mut push = [0.0; 3];
        push[axis] = size;
        steered.advance(from).unwrap();
        steered.push(0, push).unwrap();
        steered.advance(0.5 * duration).unwrap();
        steered.advance(until).unwrap();
        steered.push(0, [0.0; 3]).unwrap();
        for t in [0.8 * duration, duration] {
            tabled.advance(t).unwrap();
            steered.advance(t).unwrap();
            let rows = [&mut tabled, &mut steered].map(|one| numbers(&one.row().unwrap()));
            let far = distance(&rows[0], &rows[1]);
            assert!(far < 1e-6, "{name} at {t}: {far:e}");
        }
        assert!(steered.events().unwrap().len() == tabled.events().unwrap().len());
    };
    one("snap", "", 1, 3.0, 0.02);
    one("viscous", "", 0, 0.7, 0.2);
    one("heavy_snap", "", 1, 0.5, 0.003);
    one("bounce_on_floor", "", 1, 2.0, 0.5);
    one("platform", "platform", 2, 1.5, 0.1);
    one("rocking_block", "block", 0, 0.2, 0.2);
}

/// Catches a change of loads that is lost, books no work, or acts from another time. Reference: the change as a force
/// in time. A field that cannot change is refused by name, and nothing has happened.
#[test]
fn loads_change_while_a_motion_goes_on() {
    for (name, duration) in [("snap", 0.02), ("viscous", 0.2), ("heavy_snap", 0.003)] {
        let run = format!("run.duration={duration}");
        let half = 0.5 * duration;
        let after = half * (1.0 + 1e-9);
        let force = format!(
            "loads.force=[{{ direction = [0.0, -1.0], table = [[{half}, 0.0], [{after}, 2.0]] }}]"
        );
        let mut tabled = Simulation::new(&scene(name, &[&run, &force])).unwrap();
        let mut changed = Simulation::new(&scene(name, &[&run])).unwrap();
        changed.advance(half).unwrap();
        let before = numbers(&changed.row().unwrap());
        let other = scene(name, &[&run, "body.mass=2.0"]);
        let why = changed.change(&other).unwrap_err().to_string();
        assert!(why.contains("body.mass cannot change"), "{why}");
        assert!(distance(&numbers(&changed.row().unwrap()), &before) == 0.0);
        changed
            .change(&scene(name, &[&run, "loads.dead=[0.0, -2.0]"]))
            .unwrap();
        for one in [&mut tabled, &mut changed] {
            one.advance(duration).unwrap();
        }
        let names = changed.columns();
        let at = |name: &str| names.columns.iter().position(|c| c.name == name).unwrap();
        let rows = [&mut tabled, &mut changed].map(|one| numbers(&one.row().unwrap()));
        for column in ["x", "y", "vx", "vy", "total"] {
            let [a, b] = [0, 1].map(|i| rows[i][at(column)]);
            assert!((a - b).abs() < 1e-6, "{name}, {column}: {a} {b}");
        }
        // The force in time does work; the dead one has a potential, and its work at the change.
        let work = |row: &[f64]| row[at("potential")] - row[at("work")];
        assert!((work(&rows[0]) - work(&rows[1])).abs() < 1e-6, "{name}");
        changed.reset().unwrap();
        changed.advance(half).unwrap();
        assert!(distance(&numbers(&changed.row().unwrap()), &before) < 1e-13);
    }
}
