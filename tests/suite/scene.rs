//! Scenes: what is accepted, and what is refused and where.

use proptest::prelude::*;
use snaprod::scene::{
    Fault, FaultKind, Faults, InTime, Landing, Place, ReadError, Scene, Section, Sheet, SheetName,
    Sine, Straight, Units,
};
use std::path::{Path, PathBuf};

/// The scene of the reference, every table and nearly every field of it.
const EXAMPLE: &str = r#"[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]                      # line 7
lambda = 6.3
kappa = 0.6
velocity = [0.0, -0.5]
[loads]
gravity = [0.0, 0.0]
dead = [0.0, 0.0]
drag = 0.0
force = { direction = [0.0, 1.0], amplitude = 0.5, frequency = 2.0, phase = 0.0 }
[run]
duration = 3.0
tolerance = 1e-10
landing = "viscous"
samples = 400
"#;

fn faults(text: &str) -> Vec<Fault> {
    match Scene::parse(text) {
        Ok(scene) => panic!("accepted: {scene:?}"),
        Err(faults) => faults.as_slice().to_vec(),
    }
}

/// EXAMPLE with `from` (which must occur) replaced by `to`.
fn example(from: &str, to: &str) -> String {
    assert!(EXAMPLE.contains(from), "{from}");
    EXAMPLE.replacen(from, to, 1)
}

/// The one fault of EXAMPLE with `from` replaced by `to`.
fn fault(from: &str, to: &str) -> Fault {
    let found = faults(&example(from, to));
    assert_eq!(found.len(), 1, "{found:#?}");
    found[0].clone()
}

fn scene(from: &str, to: &str) -> Scene {
    Scene::parse(&example(from, to)).unwrap_or_else(|faults| panic!("{faults}"))
}

fn scene_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let names = ["snap", "oscillation", "forced", "bounce", "si"];
    names
        .map(|name| folder.join(format!("{name}.toml")))
        .to_vec()
}

#[test]
fn example_is_accepted() {
    let scene = Scene::parse(EXAMPLE).unwrap();
    assert_eq!(scene.units, Units::Dimensionless);
    assert_eq!(
        (
            scene.rod.length,
            scene.rod.section.clone(),
            scene.body().unwrap().mass
        ),
        (1.0, Section::Bending(1.0), 1.0)
    );
    let place = Place::Kappa {
        lambda: 6.3,
        kappa: 0.6,
    };
    assert_eq!(scene.start.place, place);
    assert_eq!(place.chart(), Some((6.3, 0.6_f64.atanh())));
    assert_eq!(scene.start.velocity, [0.0, -0.5, 0.0]);
    assert_eq!(scene.loads.force.len(), 1);
    let sine = Sine {
        amplitude: 0.5,
        frequency: 2.0,
        phase: 0.0,
    };
    assert_eq!(scene.loads.force[0].size, InTime::Sine(sine));
    let run = scene.run().unwrap();
    assert_eq!(
        (run.duration, run.tolerance, run.samples),
        (3.0, 1e-10, 400)
    );
    assert_eq!(run.landing, Landing::Viscous);
}

#[test]
fn defaults_are_filled_in() {
    let text = "[rod]\nmodel='elastica'\nlength=1\nbending_stiffness=2\n[body]\nmass=3\n\
                [start]\nposition=[0, -0.5]\n[run]\nduration=4";
    let scene = Scene::parse(text).unwrap();
    let place = Place::Position {
        position: [0.0, -0.5, 0.0],
        sheet: Sheet::Stable,
    };
    let run = scene.run().unwrap();
    assert_eq!(
        (scene.start.place.clone(), scene.start.velocity),
        (place, [0.0; 3])
    );
    assert_eq!(
        (
            scene.loads.gravity,
            scene.loads.drag,
            scene.loads.force.len()
        ),
        ([0.0; 3], 0.0, 0)
    );
    assert_eq!((run.tolerance, run.samples), (1e-10, 400));
    assert_eq!((run.branches, run.max_snaps), (64, 100_000));
    assert_eq!(scene.rod.section, Section::Bending(2.0));
}

#[test]
fn scene_files_are_accepted() {
    for path in scene_files() {
        Scene::read(&path).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// The resolved scene, written out, is a scene with the same content.
#[test]
fn resolved_scene_reads_back() {
    let files = scene_files()
        .into_iter()
        .map(|path| std::fs::read_to_string(path).unwrap());
    let sheet = "position = [0.1, 0.2]\nsheet = { mode = 1, sign = '-', near = 5 }";
    let more = [
        EXAMPLE.to_owned(),
        example("kappa = 0.6", "p = -30.0"),
        example("lambda = 6.3\nkappa = 0.6", sheet),
        example("\"viscous\"", "{ sign = \"+\", mode = 0 }"),
        example("\"viscous\"", "\"all\"\nbranches = 7"),
    ];
    for text in files.chain(more) {
        let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
        let written = toml::to_string(&scene).unwrap();
        let again = Scene::parse(&written).unwrap_or_else(|faults| panic!("{faults}\n{written}"));
        assert_eq!(again, scene);
        let json = serde_json::to_value(&scene).unwrap();
        assert_eq!(json["rod"]["model"], "elastica");
    }
}

#[test]
fn every_fault_is_reported_at_its_line() {
    let text = r#"[rod]
model = "elastic"
lenght = -1.0
bending_stiffness = "1.0"
damping = -0.1
[body]
[start]
lambda = 0
kappa = 0.0
velocity = [0.0, -0.5, 1.0]
[loads]
gravity = [0.0, nan]
drag = -0.1
force = [{ direction = [0, 0], amplitude = 1.0 }, 3]
mass = 1.0
[run]
tolerance = 1e-20
landing = "viscos"
samples = 1.5
"#;
    let found = faults(text);
    let seen: Vec<(usize, &str, FaultKind)> = found
        .iter()
        .map(|f| (f.line, f.field.as_str(), f.kind))
        .collect();
    use FaultKind::*;
    let expected = [
        (2, "rod.model", Value),
        (3, "rod.lenght", Unknown),
        (3, "rod.length", Value),
        (4, "rod.bending_stiffness", Type),
        (5, "rod.damping", Value),
        (6, "body.mass", Missing),
        (8, "start.lambda", Value),
        (9, "start.kappa", Value),
        (10, "start.velocity", Value),
        (12, "loads.gravity[1]", Value),
        (13, "loads.drag", Value),
        (14, "loads.force[0].frequency", Missing),
        (14, "loads.force[0].direction", Value),
        (14, "loads.force[1]", Type),
        (15, "loads.mass", Unknown),
        (16, "run.duration", Missing),
        (17, "run.tolerance", Value),
        (18, "run.landing", Value),
        (19, "run.samples", Type),
    ];
    assert_eq!(seen, expected);
    for fault in &found {
        assert!(!fault.allowed.is_empty(), "{fault}");
    }
}

#[test]
fn faults_print_one_line_each() {
    let text = example("mass = 1.0", "mass = -1.0").replace("0.6", "inf");
    let faults = Scene::parse(&text).unwrap_err();
    let printed = faults.in_file("scene.toml").to_string();
    let expected = "scene.toml:6:8: body.mass = -1.0: must be a finite number > 0\n\
                    scene.toml:9:9: start.kappa = inf: must be a number in (-1, 1), not 0";
    assert_eq!(printed, expected);
    assert_eq!(faults.to_string(), expected.replace("scene.toml:", ""));
    let json = serde_json::to_value(&faults).unwrap();
    assert_eq!(json[0]["field"], "body.mass");
    assert_eq!(json[0]["kind"], "value");
    assert_eq!(json[1]["line"], 9);
}

#[test]
fn non_finite_numbers_are_refused_everywhere() {
    let fields = [
        "length = 1.0",
        "bending_stiffness = 1.0",
        "mass = 1.0",
        "lambda = 6.3",
        "kappa = 0.6",
        "drag = 0.0",
        "amplitude = 0.5",
        "frequency = 2.0",
        "phase = 0.0",
        "duration = 3.0",
        "tolerance = 1e-10",
    ];
    for field in fields {
        let (name, _) = field.split_once(" = ").unwrap();
        for bad in ["nan", "-nan", "inf", "-inf", "1e999"] {
            let fault = fault(field, &format!("{name} = {bad}"));
            assert!(fault.field.ends_with(name), "{fault}");
            assert_eq!(
                (fault.kind, fault.value.as_deref()),
                (FaultKind::Value, Some(bad))
            );
        }
    }
    for (vector, x) in [
        ("[0.0, -0.5]", "[nan, 0]"),
        ("[0.0, 1.0]", "[1, inf]"),
        ("[0.0, 0.0]", "[-inf, 0]"),
    ] {
        assert_eq!(fault(vector, x).kind, FaultKind::Value);
    }
    let at = "position = [nan, 0.1]";
    assert_eq!(
        fault("lambda = 6.3\nkappa = 0.6", at).field,
        "start.position[0]"
    );
}

#[test]
fn ranges_end_where_stated() {
    for good in [
        "lambda = 1e4",
        "lambda = 10_000",
        "lambda = 0x10",
        "lambda = 1e-9",
    ] {
        scene("lambda = 6.3", good);
    }
    for bad in ["lambda = 0.0", "lambda = -1", "lambda = 10000.1"] {
        assert_eq!(fault("lambda = 6.3", bad).field, "start.lambda");
    }
    for good in ["kappa = -0.999", "kappa = 1e-9", "p = 1e4", "p = -19.5"] {
        scene("kappa = 0.6", good);
    }
    for (bad, hint) in [
        ("kappa = 0", "straight"),
        ("kappa = -0.0", "straight"),
        ("kappa = 1.0", "write p"),
        ("kappa = -1", "write p"),
        ("p = 0.0", "straight"),
    ] {
        assert!(fault("kappa = 0.6", bad).hint.unwrap().contains(hint));
    }
    scene("tolerance = 1e-10", "tolerance = 1e-14");
    scene("tolerance = 1e-10", "tolerance = 1e-2");
    assert_eq!(fault("tolerance = 1e-10", "tolerance = 0.011").line, 18);
    assert_eq!(
        scene("samples = 400", "samples = 2").run().unwrap().samples,
        2
    );
    for bad in ["1", "10_000_001", "-5", "99999999999999999999999999"] {
        assert_eq!(fault("samples = 400", &format!("samples = {bad}")).line, 20);
    }
    let whole = fault("samples = 400", "samples = 1e3").hint.unwrap();
    assert!(whole.ends_with(" 1000"), "{whole}");
    assert_eq!(
        scene("samples = 400", "max_snaps = 0")
            .run()
            .unwrap()
            .max_snaps,
        0
    );
    assert_eq!(fault("samples = 400", "branches = 0").field, "run.branches");
}

#[test]
fn unknown_names_get_a_suggestion() {
    let hint = |from, to| fault(from, to).hint.unwrap_or_default();
    assert_eq!(
        hint("bending_stiffness", "stiffness"),
        "did you mean `bending_stiffness`?"
    );
    assert_eq!(hint("mass", "Mass"), "did you mean `mass`?");
    assert_eq!(hint("[body]", "[boby]"), "did you mean `body`?");
    assert_eq!(
        hint("samples = 400", "max-steps = 5"),
        "did you mean `max_steps`?"
    );
    assert_eq!(hint("drag = 0.0", "mass = 2.0"), "`mass` belongs in [body]");
    assert!(hint("samples = 400", "units = \"si\"").contains("top of the file"));
    assert_eq!(
        hint("\"viscous\"", "\"Lowest\""),
        "did you mean \"lowest\"?"
    );
    let stranger = fault("drag = 0.0", "zzzzzzzz = 1");
    assert_eq!(
        (stranger.kind, stranger.line, stranger.column),
        (FaultKind::Unknown, 14, 1)
    );
    assert_eq!(stranger.hint, None);
    assert_eq!(stranger.allowed, "one of gravity, dead, drag, force");
}

#[test]
fn wrong_types_say_what_was_found() {
    let quoted = fault("mass = 1.0", "mass = \"1.0\"");
    assert_eq!(quoted.kind, FaultKind::Type);
    assert_eq!(quoted.allowed, "a finite number > 0");
    let hint = "it is a string: leave out the quotes";
    assert_eq!(quoted.hint.as_deref(), Some(hint));
    for (from, to, found) in [
        ("[0.0, -0.5]", "1.0", "a float"),
        ("\"viscous\"", "true", "a boolean"),
        ("[body]\nmass = 1.0", "[[body]]\nmass = 1.0", "an array"),
        ("duration = 3.0", "duration = 2026-11-21", "a date"),
        ("samples = 400", "samples = 1.5", "a float"),
        ("3.0", "[3.0]", "an array"),
    ] {
        assert_eq!(fault(from, to).hint, Some(format!("it is {found}")));
    }
}

#[test]
fn missing_tables_are_named() {
    let found = faults("units = \"si\"\n");
    let fields: Vec<&str> = found.iter().map(|f| f.field.as_str()).collect();
    assert_eq!(fields, ["rod", "body", "start", "run"]);
    assert!(
        found
            .iter()
            .all(|f| (f.line, f.kind) == (1, FaultKind::Missing))
    );
    assert!(found[1].hint.as_ref().unwrap().contains("`mass = 1.0`"));
    assert_eq!(faults("").len(), 4);
    let mass = fault("mass = 1.0", "");
    assert_eq!(
        (mass.line, mass.hint.unwrap()),
        (5, "write `mass = 1.0` in [body]".to_owned())
    );
}

#[test]
fn start_names_one_equilibrium() {
    let both = fault("kappa = 0.6", "kappa = 0.6\np = 0.7");
    assert_eq!((both.kind, both.line), (FaultKind::Conflict, 10));
    assert!(
        both.allowed.contains("line 10") && both.allowed.contains("start.kappa (line 9)"),
        "{both}"
    );
    let over = fault("kappa = 0.6", "kappa = 0.6\nposition = [0.6, 0.3]");
    assert_eq!((over.kind, over.line), (FaultKind::Conflict, 10));
    let names = ["start.lambda (line 8)", "start.kappa (line 9)"];
    assert!(
        names.iter().all(|name| over.allowed.contains(name)),
        "{over}"
    );
    assert_eq!(
        fault("kappa = 0.6", "kappa = 0.6\nsheet = 'lowest'").field,
        "start.sheet"
    );
    assert_eq!(fault("lambda = 6.3", "").field, "start.lambda");
    assert_eq!(fault("kappa = 0.6", "").field, "start.kappa");
    let none = fault("lambda = 6.3\nkappa = 0.6", "");
    assert_eq!(
        (none.kind, none.field.as_str(), none.line),
        (FaultKind::Missing, "start", 7)
    );
}

#[test]
fn position_is_inside_the_disc() {
    let at = |position: &str| {
        example(
            "lambda = 6.3\nkappa = 0.6",
            &format!("position = {position}"),
        )
    };
    for inside in ["[0.6, 0.3]", "[-0.9, 0.0]", "[0, 0]", "[0.999999, 0.0]"] {
        assert!(Scene::parse(&at(inside)).is_ok(), "{inside}");
    }
    // At full reach along the clamp the rod is straight.
    let straight = Place::Rest {
        rest: Straight::Straight,
    };
    assert_eq!(Scene::parse(&at("[1, 0]")).unwrap().start.place, straight);
    for (outside, hint) in [
        ("[-1, 0]", "straight"),
        ("[0.6, 0.8]", "straight"),
        ("[0.6, 0.81]", "cannot reach"),
        ("[1e300, 1e300]", "cannot reach"),
    ] {
        let found = faults(&at(outside));
        assert_eq!(found.len(), 1);
        assert!(
            found[0].hint.as_ref().unwrap().contains(hint),
            "{}",
            found[0]
        );
    }
    let long = at("[1.2, 0.3]").replace("length = 1.0", "length = 2");
    assert!(Scene::parse(&long).is_ok());
}

#[test]
fn sheets_and_landings() {
    let sheet = snaprod::manifold::Sheet {
        mode: 1,
        sign: snaprod::manifold::Sign::Minus,
    };
    let name = SheetName {
        sheet,
        near: Some(5.5),
    };
    let table = "{ mode = 1, sign = \"-\", near = 5.5 }";
    assert_eq!(
        scene("\"viscous\"", "{ mode = 1, sign = \"-\" }")
            .run()
            .unwrap()
            .landing,
        Landing::Named(sheet)
    );
    let start = format!("position = [0.1, 0.1]\nsheet = {table}");
    let place = scene("lambda = 6.3\nkappa = 0.6", &start).start.place;
    assert_eq!(
        place,
        Place::Position {
            position: [0.1, 0.1, 0.0],
            sheet: Sheet::Named(name)
        }
    );
    assert_eq!(place.chart(), None);
    assert_eq!(
        scene("\"viscous\"", "\"all\"").run().unwrap().landing,
        Landing::All
    );
    let found = faults(&example("\"viscous\"", "{ mode = -1, sgn = 'plus' }"));
    let fields: Vec<&str> = found.iter().map(|f| f.field.as_str()).collect();
    assert_eq!(
        fields,
        ["run.landing.mode", "run.landing.sgn", "run.landing.sign"]
    );
}

#[test]
fn forces_in_all_three_forms() {
    let one = "{ direction = [0.0, 1.0], amplitude = 0.5, frequency = 2.0, phase = 0.0 }";
    let table = scene("samples = 400", "");
    assert_eq!(scene(one, &format!("[{one}]")).loads, table.loads);
    let tail = "\n[[loads.force]]\ndirection=[3,4]\namplitude=-1\nfrequency=0\n\
                [[loads.force]]\ndirection=[0,-1e-300]\namplitude=1\nfrequency=1\n";
    let text = example(&format!("force = {one}\n"), "") + tail;
    let scene = Scene::parse(&text).unwrap();
    assert_eq!(scene.loads.force.len(), 2);
    assert_eq!(scene.loads.force[0].direction, [3.0, 4.0, 0.0]);
    assert!((scene.loads.force[0].unit()[1] - 0.8).abs() < 1e-15);
    assert_eq!(scene.loads.force[1].unit(), [0.0, -1.0, 0.0]);
}

#[test]
fn text_that_is_not_toml() {
    let duplicate = fault("mass = 1.0", "mass = 1.0\nmass = 2.0");
    assert_eq!((duplicate.kind, duplicate.line), (FaultKind::Syntax, 7));
    assert_eq!(
        duplicate.to_string(),
        "7:1: mass = 2.0: not TOML: duplicate key"
    );
    assert_eq!(fault("mass = 1.0", "mass = ").line, 6);
    assert_eq!(fault("[body]", "[body").line, 5);
    let bytes = [EXAMPLE.as_bytes(), b"x = \"\xff\"\n"].concat();
    let faults = Scene::from_bytes(&bytes).unwrap_err();
    assert_eq!(
        (faults.as_slice()[0].line, faults.as_slice()[0].column),
        (21, 6)
    );
}

#[test]
fn a_file_that_is_not_there() {
    let missing = Path::new("no-such-folder/scene.toml");
    let error = Scene::read(missing).unwrap_err();
    assert!(matches!(&error, ReadError::File(error) if error.is_io()));
    assert!(error.to_string().contains("no-such-folder"));
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        check(&bytes)?;
    }

    /// Damaged examples get further than noise: fragments are put in, and spans are cut out.
    #[test]
    fn no_damage_panics(
        edits in prop::collection::vec((0..EXAMPLE.len(), 0..40usize, 0..FRAGMENTS.len()), 1..6),
    ) {
        check(&damaged(EXAMPLE, &edits, &FRAGMENTS))?;
    }
}

const FRAGMENTS: [&str; 24] = [
    "",
    "\n",
    "=",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "nan",
    "-inf",
    "1e999",
    "0x1F",
    "\n[start]\n",
    "\n[[run]]\n",
    "\nkappa = 1\n",
    "\np = 2\n",
    "\nposition = [3, 4]\n",
    "sheet = { mode = 1 }\n",
    "\r\n",
    "é",
    "\u{feff}",
    "\n\"\" = 1\n",
    "\n'a b'.c = 2020-01-01\n",
    "\n[loads.force.direction]\n",
];

/// Accepted, or refused with at least one fault, each on a line of the text.
fn check(bytes: &[u8]) -> Result<(), TestCaseError> {
    match Scene::from_bytes(bytes) {
        Ok(_) => Ok(()),
        Err(faults) => check_faults(bytes, &faults),
    }
}

/// At least one fault, each on a line of the text.
pub fn check_faults(bytes: &[u8], faults: &Faults) -> Result<(), TestCaseError> {
    let lines = String::from_utf8_lossy(bytes).lines().count().max(1);
    prop_assert!(!faults.as_slice().is_empty());
    for fault in faults {
        prop_assert!((1..=lines).contains(&fault.line), "{fault} of {lines}");
        prop_assert!(fault.column >= 1);
        prop_assert_eq!(fault.to_string().lines().count(), 1);
    }
    Ok(())
}

/// Text with fragments put in and spans cut out: edits are (place, length of the cut, fragment).
pub fn damaged(text: &str, edits: &[(usize, usize, usize)], fragments: &[&str]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for &(at, cut, fragment) in edits {
        let at = at % (bytes.len() + 1);
        let end = (at + cut).min(bytes.len());
        bytes.splice(at..end, fragments[fragment].bytes());
    }
    bytes
}

/// Numbers that are fine one by one but whose scales, or whose ratio to them, are not.
#[test]
fn scales_that_overflow_are_a_fault() {
    let soft = example("bending_stiffness = 1.0", "bending_stiffness = 1e-30");
    for text in [
        example("length = 1.0", "length = 1e-200"),
        example("bending_stiffness = 1.0", "bending_stiffness = 1e-320"),
        soft.replace("dead = [0.0, 0.0]", "dead = [1e300, 0.0]"),
    ] {
        let found = faults(&text);
        assert_eq!((found.len(), found[0].field.as_str()), (1, "rod"));
        assert_eq!((found[0].line, found[0].kind), (1, FaultKind::Value));
    }
}
