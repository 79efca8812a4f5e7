//! Scenes: accepted input, refused input, and the place of each fault.

use proptest::prelude::*;
use snaprod::scene::{
    Fault, FaultKind, Faults, History, InitialShape, LandingRule, ReadError, Scene, Section, Sheet,
    SheetName, Sine, Straight, Units,
};
use std::path::{Path, PathBuf};

/// The scene of the reference, with every table and nearly every field.
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
    let place = InitialShape::Kappa {
        lambda: 6.3,
        kappa: 0.6,
    };
    assert_eq!(scene.start.place, place);
    assert_eq!(place.chart(), Some((6.3, 0.6_f64.atanh())));
    assert_eq!(scene.start.velocity, [0.0, -0.5, 0.0]);
    assert_eq!(scene.loads.force.len(), 1);
    let sine = Sine {
        mean: 0.0,
        amplitude: 0.5,
        frequency: 2.0,
        phase: 0.0,
    };
    assert_eq!(scene.loads.force[0].size, History::Sine(sine));
    let run = scene.run().unwrap();
    assert_eq!(
        (run.duration, run.tolerance, run.samples),
        (3.0, 1e-10, 400)
    );
    assert_eq!(run.landing, LandingRule::Viscous);
}

#[test]
fn defaults_are_filled_in() {
    let text = "[rod]\nmodel='elastica'\nlength=1\nbending_stiffness=2\n[body]\nmass=3\n\
                [start]\nposition=[0, -0.5]\n[run]\nduration=4";
    let scene = Scene::parse(text).unwrap();
    let place = InitialShape::Position {
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
    // One slip is one fault, even if the suggested field has another type.
    assert_eq!(
        hint("drag = 0.0", "drags = \"much\""),
        "did you mean `drag`?"
    );
    let stranger = fault("drag = 0.0", "zzzzzzzz = 1");
    assert_eq!(
        (stranger.kind, stranger.line, stranger.column),
        (FaultKind::Unknown, 14, 1)
    );
    assert_eq!(stranger.hint, None);
    assert_eq!(
        stranger.allowed,
        "one of gravity, dead, distributed, drag, force"
    );
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
    let straight = InitialShape::Rest {
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
        LandingRule::Named(sheet)
    );
    let start = format!("position = [0.1, 0.1]\nsheet = {table}");
    let place = scene("lambda = 6.3\nkappa = 0.6", &start).start.place;
    assert_eq!(
        place,
        InitialShape::Position {
            position: [0.1, 0.1, 0.0],
            sheet: Sheet::Named(name)
        }
    );
    assert_eq!(place.chart(), None);
    assert_eq!(
        scene("\"viscous\"", "\"all\"").run().unwrap().landing,
        LandingRule::All
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

/// Valid single numbers with overflowing scales or ratios.
#[test]
fn scales_that_overflow_are_a_fault() {
    let soft = example("bending_stiffness = 1.0", "bending_stiffness = 1e-30");
    for (text, field) in [
        (example("length = 1.0", "length = 1e-200"), "rod.length"),
        (
            example("bending_stiffness = 1.0", "bending_stiffness = 1e-320"),
            "rod.bending_stiffness",
        ),
        (
            example("bending_stiffness = 1.0", "bending_stiffness = 1e300"),
            "rod.bending_stiffness",
        ),
        (
            soft.replace("dead = [0.0, 0.0]", "dead = [1e300, 0.0]"),
            "rod",
        ),
    ] {
        let found = faults(&text);
        let fields: Vec<&str> = found.iter().map(|fault| fault.field.as_str()).collect();
        assert_eq!(fields, [field]);
        assert_eq!(found[0].kind, FaultKind::Value);
        let named = found[0]
            .to_string()
            .contains("loads.dead.x over- or underflows");
        assert_eq!(named, field == "rod");
    }
}

/// The strip of README and tutorial: steel, 0.3 m x 20 mm x 0.5 mm, straight.
const STRIP: &str = r#"[rod]
model = "elastica"
length = 0.3
material = { E = 200e9, nu = 0.3 }
section = { rectangle = { width = 0.020, thickness = 0.0005 } }
damping = { proportional = 1e-3 }
[body]
mass = 0.05
[start]
rest = "straight"
[loads]
gravity = [0.0, -9.81]
[run]
duration = 1.0
tolerance = 1e-10
"#;

/// EI of a strip that lies flat is E b h^3/12, on edge E h b^3/12; a tube is a disc less its hole. Catches a section
/// that bends the wrong way, and diameters taken for radii.
#[test]
fn a_rod_of_a_material() {
    let parse = |text: &str| Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let stiffness = |text: &str| parse(text).rod.bending_stiffness().unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-14 * b, "{a} {b}");
    let flat = 200e9 * 0.02 * 0.0005_f64.powi(3) / 12.0;
    near(stiffness(STRIP), flat);
    let turned = STRIP.replace(
        "width = 0.020, thickness = 0.0005",
        "width = 0.0005, thickness = 0.02",
    );
    near(stiffness(&turned), flat);
    let strong = STRIP.replace("[body]", "bends = \"strong\"\n[body]");
    near(stiffness(&strong), 200e9 * 0.0005 * 0.02_f64.powi(3) / 12.0);
    let round = |section: &str| {
        let rectangle = "{ rectangle = { width = 0.020, thickness = 0.0005 } }";
        STRIP.replace(rectangle, section)
    };
    let disc = |d: f64| 200e9 * std::f64::consts::PI * d.powi(4) / 64.0;
    near(
        stiffness(&round("{ circle = { diameter = 0.003 } }")),
        disc(0.003),
    );
    let tube = round("{ tube = { diameter = 0.003, thickness = 0.0005 } }");
    assert!((stiffness(&tube) / (disc(0.003) - disc(0.002)) - 1.0).abs() < 1e-13);
    let steel = parse(&STRIP.replace("{ E = 200e9, nu = 0.3 }", "\"steel\""));
    assert_eq!(steel.units, Units::Si);
    assert!((steel.rod.mass().unwrap() - 7850.0 * 0.3 * 0.02 * 0.0005).abs() < 1e-16);

    // In space bending about d1 is the flat way, and stretch E A.
    let space = STRIP
        .replace("elastica", "cosserat")
        .replace("mass = 0.05", "mass = 0.05\njoint = \"ball\"")
        .replace("[0.0, -9.81]", "[0.0, -9.81, 0.0]");
    let rod = parse(&space).cosserat_rod().unwrap();
    let unloaded = rod.law().unloaded(0.0).unwrap();
    let stiffness = rod.law().tangent(0.0, &unloaded).unwrap();
    near(stiffness[(0, 0)], flat);
    near(stiffness[(1, 1)], 200e9 * 0.0005 * 0.02_f64.powi(3) / 12.0);
    near(stiffness[(5, 5)], 200e9 * 0.02 * 0.0005);

    for text in [STRIP.to_owned(), strong, tube, space] {
        let scene = parse(&text);
        assert_eq!(parse(&toml::to_string(&scene).unwrap()), scene);
    }
}

/// Catches a material without a shape, a stiffness given in two ways, and invalid constants.
#[test]
fn faults_of_a_rod_of_a_material() {
    let section = "section = { rectangle = { width = 0.020, thickness = 0.0005 } }\n";
    let material = "material = { E = 200e9, nu = 0.3 }\n";
    for (from, to, field, words) in [
        (section, "", "rod.section", "rectangle = {"),
        (material, "", "rod.material", "material = \"steel\""),
        (
            "{ E = 200e9, nu = 0.3 }",
            "\"steal\"",
            "rod.material",
            "did you mean \"steel\"",
        ),
        ("nu = 0.3", "nu = 0.6", "rod.material.nu", "(-1, 0.5]"),
        (
            "nu = 0.3",
            "nu = 0.3, G = 1e9",
            "rod.material.G",
            "keep one",
        ),
        (
            "width = 0.020, ",
            "",
            "rod.section.rectangle.width",
            "width = 0.02",
        ),
        (
            section,
            "section = {}\n",
            "rod.section.rectangle",
            "a shape",
        ),
        (
            section,
            "section = { tube = { diameter = 0.1, thickness = 0.05 } }\n",
            "rod.section.tube.thickness",
            "hole",
        ),
        (
            material,
            "material = \"steel\"\nbending_stiffness = 1.0\n",
            "rod.bending_stiffness",
            "keep it or them",
        ),
        (
            "rest = \"straight\"",
            "rest = \"bent\"",
            "start.rest",
            "\"straight\"",
        ),
        (
            "rest = \"straight\"",
            "rest = \"straight\"\nsettled = true",
            "start.settled",
            "keep one",
        ),
        (
            "rest = \"straight\"",
            "rest = \"straight\"\nlambda = 1.0",
            "start.rest",
            "start.lambda",
        ),
        ("1e-10", "1e-14", "run.tolerance", "1e-13"),
    ] {
        assert!(STRIP.contains(from), "{from}");
        let found = faults(&STRIP.replace(from, to));
        assert_eq!(found.len(), 1, "{found:#?}");
        assert_eq!(found[0].field, field, "{}", found[0]);
        assert!(found[0].to_string().contains(words), "{}", found[0]);
    }
}

/// Catches loads in time and clamp motions that are not read, not written, or accepted although invalid.
#[test]
fn loads_and_clamps_in_time() {
    let force = |text: &str| STRIP.replace("[run]", &format!("force = {text}\n[run]"));
    let clamp = |text: &str| format!("{STRIP}[clamp]\n{text}\n");
    for text in [
        force("{ direction = [0, 1], ramp = { to = 2.0, until = 0.5 } }"),
        force(
            "[{ direction = [0, 1], pulse = { at = 0.2, width = 0.1, amplitude = 3 } }, { direction = [1, 0], table = [[0, 0], [1, 2]] }]",
        ),
        clamp("position = [0.1, 0.2]\nangle = 0.3"),
        clamp("motion = { translate = [[0, 0, 0], [1, 0.1, 0.0]], turn = { rate = 2.0 } }"),
        clamp(
            "motion = { translate = { direction = [0, 1], amplitude = 0.01, frequency = 2 }, turn = { amplitude = 0.1, frequency = 1 } }",
        ),
    ] {
        let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
        let written = toml::to_string(&scene).unwrap();
        assert_eq!(Scene::parse(&written).as_ref(), Ok(&scene), "{written}");
    }
    for (text, field) in [
        (
            force("{ direction = [0, 1], ramp = { to = 2.0, until = 0.0 } }"),
            "loads.force.ramp.until",
        ),
        (
            force("{ direction = [0, 1], ramp = { to = 2, until = 1 }, amplitude = 1 }"),
            "loads.force.amplitude",
        ),
        (
            force("{ direction = [0, 1], table = [[0, 0], [0, 2]] }"),
            "loads.force.table",
        ),
        (
            force("{ direction = [0, 1], table = [] }"),
            "loads.force.table",
        ),
        (
            clamp("motion = { translate = [[0, 0], [1, 1]] }"),
            "clamp.motion.translate[0]",
        ),
        (
            clamp("motion = { turn = { rate = 1, amplitude = 1 } }"),
            "clamp.motion.turn.rate",
        ),
        (clamp("quaternion = [1, 0, 0, 0]"), "clamp.quaternion"),
    ] {
        let found = faults(&text);
        assert_eq!(found[0].field, field, "{found:#?}");
    }
}

/// Catches an override of a wrong field, or with a fault attributed to a line of the text.
#[test]
fn overrides() {
    let with = |overrides: &[&str]| Scene::parse_with(EXAMPLE, overrides);
    let scene = with(&[
        "rod.damping=0.2",
        "run.samples = 7",
        "loads.force.amplitude=3",
    ])
    .unwrap();
    assert_eq!(scene.rod.damping.unwrap().viscosity(1.0), 0.2);
    assert_eq!(scene.run.unwrap().samples, 7);
    let sine = &scene.loads.force[0].size;
    assert!(matches!(sine, History::Sine(sine) if sine.amplitude == 3.0));
    for (text, words) in [
        (
            "body.mass=-1",
            "--set body.mass=-1: body.mass = -1: must be a finite number > 0",
        ),
        ("body.mas=1", "--set body.mas=1: body.mas = 1: unknown"),
        ("body.mass", "PATH=VALUE"),
        ("rod.model=elastica", "needs its quotes"),
        ("loads.force[3].amplitude=1", "no such element"),
        ("body.mass.x=1", "no table"),
        ("=1", "no field"),
        (
            "start.velocity[2]=1",
            "start.velocity has no element 2: write start.velocity[0] to start.velocity[1]",
        ),
        ("rest.curvature[1]=6", "the scene has no rest,"),
    ] {
        let faults = with(&[text]).unwrap_err();
        let fault = &faults.as_slice()[0];
        assert_eq!(fault.set.as_deref(), Some(text), "{faults}");
        assert!(faults.to_string().contains(words), "{faults}");
    }
}

/// Catches a wrong element or component chosen by name or letter, and a refused unknown name without the list of valid
/// names.
#[test]
fn overrides_name_elements() {
    let platform = include_str!("../../scenes/platform.toml");
    let with = |text: &str, set: &str| format!("{:?}", Scene::parse_with(text, &[set]).unwrap());
    let left = with(platform, "rod.left.from.position.y=0.3");
    assert_eq!(left, with(platform, "rod[1].from.position[1]=0.3"));
    assert_ne!(left, with(platform, "rod.right.from.position.y=0.3"));
    let velocity = with(EXAMPLE, "start.velocity.y=0.25");
    assert_eq!(velocity, with(EXAMPLE, "start.velocity.1=0.25"));
    assert_ne!(velocity, with(EXAMPLE, "start.velocity.x=0.25"));

    let faults = Scene::parse_with(platform, &["rod.near.length=1"]).unwrap_err();
    let words =
        "rod has no element near: write rod[0] to rod[2], or rod.front, rod.left, rod.right";
    assert!(faults.to_string().contains(words), "{faults}");
}

/// Catches a reader whose cost grows with the square of the number of faults.
#[test]
fn very_many_faults() {
    let many: String = (0..50_000).map(|i| format!("key{i} = 1\n")).collect();
    let faults = Scene::parse(&many).unwrap_err();
    assert_eq!(faults.count(), 50_004);
    assert_eq!(faults.as_slice().len(), 1000);
    let printed = faults.to_string();
    assert_eq!(printed.lines().count(), 101);
    assert!(printed.ends_with("and 49904 more faults"));
    let large = fault("mass = 1.0", "mass = 1.0\nzzzz = 1e308");
    assert!(large.to_string().len() < 200, "{large}");
}
