//! Sweeps: rows depend on their points alone, independent of threads and interruptions.

use crate::program::Place;
use snaprod::scene::Scene;
use snaprod::study::sweep::{Sweep, Vary, fields, records};
use snaprod::study::{Silent, Table, dispatch, run};

pub const SCENE: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
lambda = 1.4
p = -1.6
velocity = [0.0, 0.3]
[run]
duration = 0.2
tolerance = 1e-9
"#;

fn swept(vary: &[&str], random: Option<(usize, u64)>, columns: &[&str]) -> Sweep {
    let vary = vary.iter().map(|text| Vary::parse(text).unwrap()).collect();
    let columns = columns.iter().map(|c| (*c).to_owned()).collect();
    Sweep::new(SCENE.to_owned(), Vec::new(), vary, random, columns).unwrap()
}

/// Catches rows of another point, quantities of another run, and chunks that differ from the whole.
#[test]
fn a_row_is_the_run_of_its_scene() {
    let sweep = swept(
        &["start.velocity.1=-0.5:0.5:3", "body.mass=log:0.1:10:3"],
        None,
        &["outcome", "end.x", "end.kinetic", "snaps", "events.-1.t"],
    );
    assert_eq!(sweep.points(), 9);
    let whole = sweep.rows(0..9, &mut Silent).unwrap();
    let parts: String = (sweep.chunks().into_iter())
        .map(|points| sweep.rows(points, &mut Silent).unwrap())
        .collect();
    assert_eq!(whole, parts);
    let rows: Vec<Vec<String>> = whole.lines().map(fields).collect();
    assert_eq!(rows.len(), 9);
    let masses = [0.1f64, 1.0, 10.0];
    for (point, row) in rows.iter().enumerate() {
        let (velocity, mass) = (-0.5 + 0.5 * (point / 3) as f64, masses[point % 3]);
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        assert_eq!((number(0), number(1)), (point as f64, velocity));
        assert!((number(2) / mass - 1.0).abs() < 1e-14, "{row:?}");
        let text = SCENE
            .replace("mass = 1.0", &format!("mass = {}", row[2]))
            .replace("0.3]", &format!("{velocity:?}]"));
        let scene = Scene::parse(&text).unwrap();
        let prepared = run::Prepared::new(&scene).unwrap();
        let mut tables: Vec<Table> = Vec::new();
        let record = run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).unwrap();
        let end = &record.last().last;
        assert_eq!(row[3], "end_of_time");
        assert_eq!(number(4), end.position().x);
        assert_eq!(number(5), end.ledger.kinetic);
        // Without a snap its time is empty, without a reason.
        assert_eq!(&row[6..], ["0", "", ""]);
    }
}

/// Catches random points that depend on the order of threads, leave their range, or are not spread over it; a seed
/// without effect.
#[test]
fn points_at_random_follow_from_seed_and_number() {
    let all = |seed| -> Vec<f64> {
        let sweep = swept(
            &["body.mass=log:0.01:100"],
            Some((4000, seed)),
            &["outcome"],
        );
        let values = (0..4000).map(|point| sweep.values(point)[0].parse::<f64>().unwrap());
        values.map(|mass| mass.log10() / 4.0 + 0.5).collect()
    };
    let (one, other) = (all(1), all(2));
    assert!(one.iter().all(|part| (0.0..1.0).contains(part)));
    assert_eq!(one, all(1));
    assert!(one.iter().zip(&other).all(|(a, b)| a != b));
    // Mean and variance of uniform numbers, within five standard errors.
    for sample in [&one, &other] {
        let mean = sample.iter().sum::<f64>() / 4000.0;
        let square = sample.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>() / 4000.0;
        assert!(
            (mean - 0.5).abs() < 0.023 && (square - 1.0 / 12.0).abs() < 0.006,
            "{mean} {square}"
        );
    }
}

/// Catches a misread text, and a refusal without advice.
#[test]
fn what_is_varied_is_read_or_refused() {
    let values = |text: &str| -> Vec<String> {
        let vary = Vary::parse(text).unwrap();
        (0..vary.count().unwrap())
            .map(|i| vary.on_grid(i))
            .collect()
    };
    assert_eq!(values("a.b.2=1:3:3"), ["1.0", "2.0", "3.0"]);
    // The path keeps its spelling, and every spelling leads to the same field.
    let vary = Vary::parse("a.b.2=1:3:3").unwrap();
    assert_eq!(vary.path, "a.b.2");
    assert!(
        ["a.b.2", "a.b[2]", "a.b.z"]
            .iter()
            .all(|path| vary.is_of(path))
    );
    assert!(
        !["a.b", "a.b.1", "a.b[22]"]
            .iter()
            .any(|path| vary.is_of(path))
    );
    assert_eq!(values("a=log:1e-2:1e2:3")[0], "0.01");
    assert_eq!(values("a=2:5:1"), ["2.0"]);
    assert_eq!(
        values(r#"a=["x, y", [1, 2], 3]"#),
        [r#""x, y""#, "[1, 2]", "3"]
    );
    for (text, why) in [
        ("a", "there is no ="),
        ("=1:2:3", "no path"),
        ("a=1", "two or three parts"),
        ("a=1:x:3", "not numbers"),
        ("a=1:nan:3", "not finite"),
        ("a=log:0:1:3", "> 0"),
        ("a=1:2:0", "whole number"),
        ("a=1:2:2.5", "whole number"),
        ("a=[1, 2", "end in ]"),
        ("a=[1,,2]", "missing"),
    ] {
        let e = Vary::parse(text).unwrap_err().to_string();
        assert!(
            e.contains(why) && e.contains("PATH=FROM:TO:COUNT"),
            "{text}: {e}"
        );
    }
}

/// Catches work lost or repeated in a resumed sweep, a table that depends on the threads, and rows of another sweep.
#[test]
fn a_sweep_goes_on_where_it_was_ended() {
    let place = Place::new("sweep");
    place.write("scene.toml", SCENE);
    let command = |out: &str, threads: &str, count: &str| {
        let first = format!("start.velocity.0=-1:1:{count}");
        place.run(&[
            "sweep",
            "scene.toml",
            "--vary",
            &first,
            "--vary",
            "body.mass=-1:3:4",
            "--out",
            out,
            "--threads",
            threads,
            "--json",
        ])
    };
    let made = command("one", "1", "3").json(0);
    assert_eq!(
        (&made["made"], &made["outcomes"]["refused"]),
        (&12.into(), &3.into())
    );
    let table = place.read("one/sweep.csv");
    // A negative mass gives a row with the error message.
    let row = fields(table.lines().nth(1).unwrap());
    assert!(row.last().unwrap().contains("body.mass"), "{row:?}");
    assert_eq!(table.lines().count(), 13);
    assert!(place.read("one/map.svg").contains("body mass\n"));

    command("two", "2", "3").json(0);
    assert_eq!(place.read("two/sweep.csv"), table);

    // State after a kill: missing chunks, and a partial one.
    std::fs::remove_file(place.join("two/chunks/000003.csv")).unwrap();
    std::fs::remove_file(place.join("two/sweep.csv")).unwrap();
    place.write("two/chunks/000003.17.part", "3,-1.0");
    place.write("two/sweep.17.part", "{");
    let again = command("two", "2", "3").json(0);
    assert_eq!(again["made"], 1);
    assert_eq!(place.read("two/sweep.csv"), table);
    for directory in ["two", "two/chunks"] {
        let files = place.files(directory);
        let left = files.iter().find(|name| name.ends_with(".part"));
        assert!(left.is_none(), "{left:?}");
    }

    let refused = command("two", "2", "2");
    assert!(
        refused
            .refusal()
            .contains("another sweep (it differs in: counts, points)")
    );
    assert_eq!(place.read("two/sweep.csv"), table);
    let refused = place.run(&[
        "sweep",
        "scene.toml",
        "--vary",
        "body.weight=1:2:2",
        "--out",
        "three",
    ]);
    // The message names the scene's file, with or without columns.
    assert!(refused.refusal().contains("scene.toml: --set body.weight"));
    assert!(!place.join("three").exists());
    let refused = command("three", "100000", "2");
    assert!(refused.refusal().contains("1..=1024"), "{refused:?}");
}

/// Catches a map whose columns must be requested again, and duplicate columns, for varied fields that are also
/// requested.
#[test]
fn a_column_stands_in_the_table_once() {
    let place = Place::new("columns");
    place.write("scene.toml", SCENE);
    let grid =
        "sweep scene.toml --vary start.velocity.1=-1:1:2 --vary body.mass=1:2:2 --json --out";
    let run = |rest: &str| {
        let words: Vec<&str> = grid.split(' ').chain(rest.split(' ')).collect();
        place.run(&words)
    };
    let names = |out: &str| {
        let table = place.read(&format!("{out}/sweep.csv"));
        fields(table.lines().next().unwrap())
    };
    let varied = ["point", "start.velocity.1", "body.mass"];

    run("asked --column snaps --map end.mode,end.sign").json(0);
    assert_eq!(
        names("asked"),
        [&varied[..], &["snaps", "end.mode", "end.sign", "why"]].concat()
    );
    let map = place.read("asked/map.svg");
    assert!(map.contains("sheet at the end") && map.contains("S₀⁻"));

    run("usual --map end.sign,snaps,body.mass").json(0);
    let usual = names("usual");
    assert_eq!(usual.iter().filter(|name| *name == "snaps").count(), 1);
    assert_eq!(usual[usual.len() - 2..], ["end.sign", "why"]);

    run("twice --column start.velocity[1] --column start.velocity.y --column body.mass --column end.x --column end.x").json(0);
    assert_eq!(names("twice"), [&varied[..], &["end.x", "why"]].concat());

    assert!(run("none --map ,").refusal().contains("no column is named"));
    // Events differ between points: a column found at no point is reported at the end.
    let said = run("events --column events.7.t").stderr;
    assert!(
        said.contains("--column events.7.t: not found in any point"),
        "{said}"
    );

    // Names invalid at every point are reported before the sweep starts, and its directory stays unused.
    for (asked, why) in [
        ("--map end.modes", "did you mean end.mode? end has"),
        ("--column end", "end has"),
        ("--column end.x.y", "end.x has no fields"),
        ("--column point", "column point: every sweep"),
        ("--map why", "column why: every sweep"),
    ] {
        let refused = run(&format!("wrong {asked}"));
        assert!(refused.refusal().contains(why), "{asked}: {refused:?}");
        assert!(!place.join("wrong").exists());
    }
    let unnamed = place.run(&[
        "sweep",
        "scene.toml",
        "--vary",
        "body.mass=1:2:2",
        "--column",
        "",
    ]);
    assert!(
        unnamed.refusal().contains("its name is empty"),
        "{unnamed:?}"
    );
    run("wrong --map end.mode").json(0);
}

/// Catches removal of foreign files, rows of a sweep with other values between the same ends, a damaged chunk that is
/// not recomputed, and damage reported as another sweep.
#[test]
fn a_directory_holds_the_rows_of_its_sweep_alone() {
    let place = Place::new("owned");
    place.write("scene.toml", SCENE);
    std::fs::create_dir_all(place.join("swept/chunks")).unwrap();
    place.write("swept/chunks/thesis.txt", "mine");
    let run = |vary: &str| {
        let words = ["sweep", "scene.toml", "--vary", vary, "--column", "end.x"];
        place.run(&[&words[..], &["--out", "swept", "--json"]].concat())
    };
    let refused = run("body.mass=1:4:3");
    assert!(
        refused.refusal().contains("thesis.txt is there"),
        "{refused:?}"
    );
    assert_eq!(place.read("swept/chunks/thesis.txt"), "mine");
    std::fs::remove_file(place.join("swept/chunks/thesis.txt")).unwrap();

    run("body.mass=1:4:3").json(0);
    let table = place.read("swept/sweep.csv");
    let refused = run("body.mass=log:1:4:3");
    assert!(
        refused.refusal().contains("(it differs in: logarithmic)"),
        "{refused:?}"
    );

    let chunk = place.read("swept/chunks/000001.csv");
    place.write("swept/chunks/000001.csv", &chunk[..chunk.len() / 2]);
    let again = run("body.mass=1:4:3");
    assert!(again.stderr.contains("000001.csv is damaged"), "{again:?}");
    assert!(again.stdout.contains("\"made\": 1"), "{again:?}");
    assert_eq!(place.read("swept/sweep.csv"), table);

    place.write("swept/sweep.json", "{\"scene\": ");
    let refused = run("body.mass=1:4:3");
    assert!(
        refused.refusal().contains("sweep.json is damaged"),
        "{refused:?}"
    );
}

/// Catches a record that is cut where a value has a line feed.
#[test]
fn values_with_line_feeds_stay_whole() {
    let place = Place::new("feeds");
    place.write("scene.toml", SCENE);
    let vary = "start.velocity=[\n[0.0,\n 0.3],\n[0.0, 0.1]\n]";
    let words = ["sweep", "scene.toml", "--vary", vary, "--column", "end.x"];
    place
        .run(&[&words[..], &["--out", "swept", "--json"]].concat())
        .json(0);
    let table = place.read("swept/sweep.csv");
    let rows: Vec<Vec<String>> = records(&table).map(fields).collect();
    assert_eq!(rows[0], ["point", "start.velocity", "end.x", "why"]);
    assert_eq!((&*rows[1][1], &*rows[2][1]), ("[0.0,\n 0.3]", "[0.0, 0.1]"));
    assert!(rows.len() == 3 && rows[1..].iter().all(|row| row[2].parse::<f64>().is_ok()));
}

/// Catches accepted fractional ranges of integer fields, and real numbers rounded together with them.
#[test]
fn fields_that_count_take_whole_numbers() {
    let values = |vary: &str| -> Vec<String> {
        let sweep = swept(&[vary], None, &["end.x"]);
        let all = 0..sweep.points();
        all.map(|point| sweep.values(point)[0].clone()).collect()
    };
    assert_eq!(values("rod.cells=20:40:3"), ["20", "30", "40"]);
    assert_eq!(
        values("run.samples=log:3:48:5"),
        ["3", "6", "12", "24", "48"]
    );
    assert_eq!(values("rod[1].nodes=4:5:3"), ["4", "4.5", "5"]);
    assert_eq!(values("body.mass=1:3:3"), ["1.0", "2.0", "3.0"]);
    let sweep = swept(&["run.samples=3:5:3"], None, &["end.x"]);
    assert!((0..3).all(|point| sweep.scene(point).is_ok()));
}

/// Catches invalid random values of integer fields, and values drawn never or twice as often as others.
#[test]
fn fields_that_count_are_drawn_whole() {
    let often = |vary: &str| {
        let sweep = swept(&[vary], Some((3000, 1)), &["end.x"]);
        let mut often = std::collections::BTreeMap::new();
        for point in 0..sweep.points() {
            *often.entry(sweep.values(point)[0].clone()).or_insert(0) += 1;
        }
        assert!(sweep.scene(0).is_ok(), "{vary}");
        often
    };
    for (vary, values) in [
        ("run.samples=3:5", vec!["3", "4", "5"]),
        ("run.samples=5.5:2.5", vec!["3", "4", "5"]),
        ("run.samples=4:4", vec!["4"]),
    ] {
        let often = often(vary);
        assert!(often.keys().eq(&values), "{vary}: {often:?}");
        // Even within five standard deviations.
        let even = 3000 / values.len() as i32;
        assert!(often.values().all(|n| (n - even).abs() < 130), "{often:?}");
    }
    // By logarithms each octave is as likely.
    let low = often("run.samples=log:2:127");
    let below: i32 = ["2", "3"].iter().filter_map(|value| low.get(*value)).sum();
    assert!((400..600).contains(&below), "{low:?}");
}

/// Catches a map, or curves over one field, whose axes are labelled by paths, or without units: SI units, units of the
/// rod if length, stiffness and mass stay 1, no units if one of these varies.
#[test]
fn a_map_has_names_and_units() {
    let place = Place::new("map_names");
    place.write("scene.toml", SCENE);
    let si = format!("units = \"si\"\n{SCENE}[loads]\ngravity = [0.0, 0.0]\n");
    place.write("si.toml", &si);
    let map = |scene: &str, second: &str, column: &str| {
        let first = "start.velocity.0=-1:1:2";
        let words = ["sweep", scene, "--vary", first, "--vary", second];
        let rest = ["--map", column, "--out", "map", "--json"];
        place.run(&[&words[..], &rest].concat()).json(0);
        let svg = place.read("map/map.svg");
        std::fs::remove_dir_all(place.join("map")).unwrap();
        svg.replace("\n", "|")
    };
    let rod = map("scene.toml", "loads.drag=0:0.1:2", "end.x");
    for word in [
        "start velocity x (√(EI/μℓ))",
        "drag (√(μEI/ℓ³))",
        "x at the end",
    ] {
        assert!(rod.contains(&format!("|{word}|")), "{word}: {rod}");
    }
    let si = map("si.toml", "loads.gravity.1=-1:0:2", "end.dissipated");
    for word in [
        "start velocity x (m/s)",
        "gravity y (m/s²)",
        "dissipated at the end (J)",
    ] {
        assert!(si.contains(&format!("|{word}|")), "{word}: {si}");
    }
    let one = "sweep si.toml --vary start.velocity.x=-1:1:3 --out one --json";
    let words: Vec<&str> = one.split(' ').collect();
    place.run(&words).json(0);
    let curves = place.read("one/curves.svg").replace('\n', "|");
    for word in ["start velocity x (m/s)", "x at the end (m)"] {
        assert!(curves.contains(&format!("|{word}|")), "{word}: {curves}");
    }
    let masses = map("scene.toml", "body.mass=1:2:2", "snaps");
    for word in ["start velocity x", "body mass", "snaps"] {
        assert!(masses.contains(&format!("|{word}|")), "{word}: {masses}");
    }
}

/// Catches peaks of another run, or of its two ends alone, and a row without peaks because the scene asks for few
/// samples.
#[test]
fn peaks_are_those_of_the_trajectory() {
    let scene = SCENE.replace("0.3]", "2.5]").replace("0.2\n", "2.0\n");
    let columns = [
        "greatest.y",
        "least.y",
        "least.index",
        "greatest.t",
        "end.y",
    ];
    let rows = |samples: usize| {
        let columns = columns.map(str::to_owned).to_vec();
        let vary = vec![Vary::parse("body.mass=[0.5, 2.0]").unwrap()];
        let set = vec![format!("run.samples={samples}")];
        let sweep = Sweep::new(scene.clone(), set, vary, None, columns).unwrap();
        let rows = sweep.rows(0..2, &mut Silent).unwrap();
        rows.lines().map(fields).collect::<Vec<_>>()
    };
    for (mass, row) in [0.5, 2.0].iter().zip(rows(1200)) {
        let mass = format!("body.mass={mass}");
        let scene = Scene::parse_with(&scene, &[mass.as_str(), "run.samples=1200"]).unwrap();
        let mut tables: Vec<Table> = Vec::new();
        dispatch::motion(&scene, run::Fields::None, &mut tables, &mut Silent).unwrap();
        let y = tables[0].reals("y");
        let [least, greatest] = [f64::min, f64::max].map(|of| y.iter().copied().fold(y[0], of));
        let told: Vec<f64> = row[2..5].iter().map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(told, [greatest, least, 0.0], "{row:?}");
        assert!(row[4] == "0" && row[5] == "2.0", "{row:?}");
        assert!(greatest > y[0].max(y[y.len() - 1]) + 1e-3, "no peak inside");
    }
    // Peaks between the samples are found even with two samples.
    for (few, many) in rows(2).iter().zip(rows(1200)) {
        let number = |cell: &String| cell.parse::<f64>().unwrap();
        assert!((number(&few[2]) - number(&many[2])).abs() < 1e-3, "{few:?}");
    }
}

/// Catches columns of assemblies and bars, and numbers of summaries and events, without their units, and components
/// identified only by numbers.
#[test]
fn columns_of_every_kind_have_units() {
    let units = |scene: &str, vary: &str, columns: &[(&str, &str)]| {
        let vary = vec![Vary::parse(vary).unwrap()];
        let sweep = Sweep::new(scene.to_owned(), Vec::new(), vary, None, Vec::new()).unwrap();
        for (column, unit) in columns {
            let [told, meaning] = sweep.described(column).expect(column);
            assert_eq!(told, *unit, "{column}: {meaning}");
            assert!(!meaning.is_empty(), "{column}");
        }
        assert!(sweep.described("outcome").is_none());
    };
    let assembly = include_str!("../../scenes/midspan.toml");
    units(
        assembly,
        "body.mass.mass=0.01:0.02:2",
        &[
            ("end.t", "s"),
            ("end.bodies.mass.position.2", "m"),
            ("end.bodies.mass.position.z", "m"),
            ("start.bodies.mass.velocity.0", "m/s"),
            ("end.bodies.mass.angular_velocity.1", "rad/s"),
            ("end.bodies.mass.quaternion.0", ""),
            ("greatest.mass.z", "m"),
            ("least.elastic", "J"),
            ("events.-1.released", "J"),
            ("energy_error.absolute", "J"),
        ],
    );
    let bar = format!(
        "units = \"si\"\n{}",
        include_str!("../../scenes/pulse.toml")
    );
    units(
        &bar,
        "rod.area=0.03:0.04:2",
        &[
            ("end.tip.x", "m"),
            ("end.tip.v", "m/s"),
            ("end.base.stress", "Pa"),
            ("end.ledger.dissipated_by_faces", "J"),
            ("greatest.tip_stress", "Pa"),
            ("breaking.time", "s"),
            ("breaking.position", "m"),
            ("tip.max", "Pa"),
            ("events.0.X", "m"),
            ("bar_mass", "kg"),
        ],
    );
}

/// Half of a toggle between clamps: half span 12.943, rise 0.386, pushed down at its crown.
const TOGGLE: &str = r#"
[rod]
model = "cosserat"
length = 12.94875457331708
section = { bending = [9270.0, 9270.0], torsion = 9270.0, axial = 1885000.0 }
[clamp]
rotation = { axis = [1, 0, 0], angle = -0.029814233400285155 }
[end]
position = [0.0, "free", 12.943]
rotation = { axis = [1, 0, 0], angle = -0.029814233400285155 }
force = [0.0, -1.0, 0.0]
[solve]
path = "planar"
[continue]
parameter = "end.force.y"
from = 0.0
to = -20.0
step = 0.05
max_step = 0.5
"#;

/// Special points as columns, by order and by value. The loads at the fold and the slopes by EA and B, as central
/// differences, are those of the linearised equations (reference of acceptance-rods 27; P is twice the load of one
/// half, and B dP/dB + EA dP/dEA = P). Catches a branch swept as one equilibrium, the fold of another label, and a
/// point that is missing without a word.
#[test]
fn folds_are_columns_of_a_sweep() {
    let rows = |vary: &str, columns: &[&str]| -> Vec<Vec<String>> {
        let columns = columns.iter().map(|name| (*name).to_owned()).collect();
        let vary = vec![Vary::parse(vary).unwrap()];
        let sweep = Sweep::new(TOGGLE.to_owned(), Vec::new(), vary, None, columns).unwrap();
        let text = sweep.rows(0..sweep.points(), &mut Silent).unwrap();
        text.lines().map(fields).collect()
    };
    let near = |x: f64, y: f64, to: f64| assert!((x / y - 1.0).abs() < to, "{x}, not {y}");
    let (axial, slope) = (1.885e6, 4.969_013_941_744_1e-6);
    let by_axial = rows(
        "rod.section.axial=1884623:1885377:3",
        &["LP1", "LP@-16.9", "LP@-15.6", "LP2", "LP1.y", "BP1"],
    );
    let number = |row: usize, k: usize| by_axial[row][k].parse::<f64>().unwrap();
    near(-2.0 * number(1, 2), 33.861_233_016_363, 1e-9);
    near(
        (number(0, 2) - number(2, 2)) * 2.0 / (4e-4 * axial),
        slope,
        1e-6,
    );
    assert_eq!(by_axial[1][2], by_axial[1][3]);
    assert_eq!(by_axial[1][4], by_axial[1][5]);
    assert!((0.0..0.386).contains(&number(1, 6)), "{by_axial:?}");
    let why = &by_axial[1][8];
    assert!(
        by_axial[1][7].is_empty() && why.contains("no BP1") && why.contains("LP1, LP2"),
        "{why}"
    );
    let by_bending = rows(
        "rod.section.bending=[[9268.146, 9270.0], [9271.854, 9270.0]]",
        &["LP1"],
    );
    let number = |row: usize| by_bending[row][2].parse::<f64>().unwrap();
    near(
        (number(0) - number(1)) * 2.0 / 3.708,
        0.002_642_356_174_341_5,
        1e-6,
    );
    let place = Place::new("special");
    place.write("toggle.toml", TOGGLE);
    let columns = [
        "sweep",
        "toggle.toml",
        "--vary",
        "end.position.z=12.9:12.94:2",
        "--column",
    ];
    let told = place.run(&[&columns[..], &["energy"]].concat());
    assert!(
        told.stderr.contains("take [continue] out"),
        "{}",
        told.stderr
    );
}
