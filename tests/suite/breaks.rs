//! Ends of runs, and breaks of loads and clamp motions, at critical moments.

use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, RunRecord, run};
use snaprod::study::{Silent, Table};

fn parsed(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn recorded(text: &str) -> RunRecord {
    let prepared = Prepared::new(&parsed(text)).unwrap_or_else(|why| panic!("{why}\n{text}"));
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).expect("a record");
    assert_eq!(record.reason(), None, "{text}");
    record
}

/// A rod under decreasing load, with a fold at t = [`FOLD`].
fn unloading(duration: f64, tolerance: f64, loads: &str) -> String {
    format!(
        "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n\
         [start]\nlambda = 6.3\nkappa = 0.6\nvelocity = [0.0, -0.5]\n[loads]\n{loads}\n\
         [run]\nduration = {duration:?}\nsamples = 2\ntolerance = {tolerance:?}\n"
    )
}

const FOLD: f64 = 0.025570197858357242;

/// Catches a run that ends as stuck because its end time, or a break of a load, lies at a fold or just before it,
/// where time nearly stands still.
#[test]
fn ends_and_breaks_next_to_a_fold() {
    let before = [
        0.0, 1e-15, 1e-13, 1.6e-12, 2.8e-12, 1.4e-11, 2.5e-11, 1e-9, 1e-7, -1e-13, -1e-12,
    ];
    for tolerance in [1e-6, 1e-10, 1e-12] {
        for before in before {
            let end = FOLD - before;
            let last = recorded(&unloading(end, tolerance, "")).branches[0].last.t;
            assert!((last - end).abs() <= 1e-11, "{before:e}: {last:?}");
        }
    }
    for before in before {
        let force = format!(
            "force = {{ direction = [1.0, 0.0], table = [[0.0, 0.0], [{:?}, 0.0], [{:?}, 3.0]] }}",
            FOLD - before,
            FOLD + 0.1
        );
        let record = recorded(&unloading(0.1, 1e-10, &force));
        assert_eq!(record.branches[0].snaps.len(), 1, "{before:e}");
    }
}

/// Catches a missed break: a part of a step failed to converge, because rounding in the forces is just above the
/// tolerance.
#[test]
fn a_break_within_a_rough_step() {
    let text = |tolerance: f64| {
        format!(
            "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n[start]\nrest = \"straight\"\n\
             [loads]\ngravity = [1.6446769746584469, -2.7517424510760753]\ndead = [1.516286746352502, 1.6201427582070607]\n\
             drag = 0.7591339802173286\nforce = [\n\
             {{ direction = [-0.23768394879471222, 0.5747749652947103], pulse = {{ at = 0.3, width = 0.2, amplitude = -1.1136937712356012 }} }},\n\
             {{ direction = [0.517423338989198, 0.7109493161183387], table = [[0.0, 0.0], [0.2, -2.429281976348419], [0.45, -2.3132932521810208]] }}]\n\
             [run]\nduration = 0.5\nsamples = 2\ntolerance = {tolerance:?}\n"
        )
    };
    let [rough, fine] =
        [1e-10, 1e-12].map(|tolerance| recorded(&text(tolerance)).last().last.position());
    assert!((rough - fine).norm() < 1e-8, "{rough} {fine}");
}

/// Catches a rod reported as lost at a break of its clamp's motion, because the last observation was behind the break.
/// Time is slowed for a rod near a fold, in an assembly and alone.
#[test]
fn a_clamp_breaks_where_time_is_slowed() {
    let rod =
        "model = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.7], torsion = 0.8 }\n";
    let place = "position = [0.6012, -0.1791, -0.6985]\nquaternion = [-0.26818748140833476, 0.9477008751180381, 0.12062037443176886, -0.1240534215098416]\n\
                 motion = { translate = [[0.1, 0.0, 0.0, 0.0], [0.2, 0.02184, -0.0169, 0.03809], [0.35, 0.04806, 0.000542, 0.04985]], \
                 turn = { axis = [-0.8461, 0.1995, -0.9372], amplitude = 0.1592, frequency = 1.112, phase = 3.663 } }";
    let body = "mass = 1.0\ninertia = [0.05, 0.07, 0.09]\noffset = [0.06632, 0.01471, -0.04301]\nrotor = [0.1416, 0.1959, -0.1646]\n";
    let loads = "force = [{ direction = [0.9556, 0.04225, 0.09686], amplitude = 1.154, frequency = 2.969, phase = 1.0, follower = true }]\n\
                 couple = [{ direction = [0.1784, -0.7335, 0.2671], constant = -0.3351, follower = true }]\ndrag = 1.469\nrotational_drag = 0.1\n";
    let thrown =
        "velocity = [0.3639, -0.383, -0.1047]\nangular_velocity = [0.1536, -0.2416, 0.1217]\n";
    let run_ = "[run]\nduration = 0.4\nsamples = 2\ntolerance = 1e-9\n";
    let alone = format!(
        "[rod]\n{rod}[clamp]\n{place}\n[body]\n{body}[start]\nsettled = true\n{thrown}[loads]\n{loads}{run_}"
    );
    let chain = format!(
        "[[rod]]\nname = \"r\"\n{rod}from = {{ {} }}\nto = {{ body = \"b\" }}\n[[body]]\nname = \"b\"\n{body}{loads}{thrown}[start]\nsettled = true\n{run_}",
        place.replace('\n', ", ")
    );
    let alone = recorded(&alone).last().last.position();
    let prepared = Prepared::new(&parsed(&chain)).expect("an assembly");
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent).expect("a record");
    assert_eq!(record.reason(), None);
    let apart = record.last().last.bodies[0].pose.translation.vector - alone;
    assert!(apart.norm() < 1e-6, "{apart}");
}

/// Catches a straight start that is refused for the rounding of its velocity, in the frame of a turned clamp.
#[test]
fn a_straight_start_on_a_turned_clamp() {
    for angle in [0.0_f64, 0.7342008, 1.9, -2.3, 3.0] {
        let (s, c) = angle.sin_cos();
        let record = recorded(&format!(
            "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[clamp]\nangle = {angle:?}\n[body]\nmass = 1.0\n\
             [start]\nrest = \"straight\"\nvelocity = [{:?}, {:?}]\n[run]\nduration = 0.5\nsamples = 2\ntolerance = 1e-11\n",
            -0.3 * s,
            0.3 * c
        ));
        let end = record.last().last.position();
        let along = c * end.x + s * end.y;
        let across = c * end.y - s * end.x;
        // The slope of a cantilever: across it acts as a spring of 3 EI/L^3, stiffened by inextensibility.
        assert!(
            across > 0.05 && (along - 1.0 + 0.6 * across * across).abs() < 0.02 * across * across,
            "{along} {across}"
        );
    }
}

/// Catches symmetric steps that stay short for good after a rejected step that had been cut at a break, in the plane
/// and in space. Close rows of a table made thousands of steps out of a hundred.
#[test]
fn a_break_shortens_no_symmetric_steps_behind_it() {
    let plane = "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n\
                 [start]\nlambda = 1.9\nkappa = 0.35\n[loads.force]\ndirection = [-1.0, -0.25]\n";
    let space = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\n\
                 section = { bending = [1.0, 1.2], torsion = 0.8, shear = [100.0, 120.0], axial = 300.0 }\n\
                 rest = { curvature = [0.6, 0.1], twist = 0.2 }\n[body]\nmass = 1.0\njoint = \"ball\"\n\
                 [start]\nvelocity = [0.1, 0.2, 0.0]\n[loads.force]\ndirection = [0.3, 1.0, 0.0]\n";
    for (text, [whole, first, second]) in [(plane, [8.0, 7.0, 9.0]), (space, [0.1, 0.3, 0.5])] {
        let steps = |rows: &str| {
            let record = recorded(&format!(
                "{text}table = [[0.0, {whole:?}], {rows} [30.0, {whole:?}]]\n\
                 [run]\nduration = 4.0\ntolerance = 1e-8\nmethod = \"symmetric\"\nsamples = 2\nmax_steps = 2000\n"
            ));
            record.summary()["work"]["steps"].as_u64().expect("steps")
        };
        let near = format!("[1.0, {first:?}], [1.0001, {second:?}],");
        let (none, two) = (steps(""), steps(&near));
        assert!(2 * two < 3 * none, "{two} steps, {none} without breaks");
    }
}
