//! Completeness of docs/output.md: every column of every table and every number of summary.json and events.json, with
//! unit and meaning.

use crate::program::Place;
use serde_json::{Value, json};
use snaprod::scene::{FlowMedium, Scene};
use snaprod::study::run::Fields;
use snaprod::study::{
    FirstOrder, Silent, Table, all_equilibria, branch, dispatch, memory, modes, wall,
};
use std::collections::{BTreeMap, BTreeSet};

/// Scenes of motion with overrides that shorten them; together they have every kind of table and event.
const MOTIONS: &[(&str, &[(&str, &str)])] = &[
    ("snap", &[("duration = 3.0", "duration = 0.1")]),
    (
        "snap",
        &[
            ("duration = 3.0", "duration = 1.0"),
            ("\"viscous\"", "\"all\""),
        ],
    ),
    (
        "snap",
        &[
            ("duration = 3.0", "duration = 0.1"),
            (
                "bending_stiffness = 1.0",
                "bending_stiffness = 1.0\nmass = 0.01\ninertia = \"none\"",
            ),
        ],
    ),
    (
        "bounce_on_floor",
        &[("tolerance = 1e-13", "[contact]\nfriction = 0.15")],
    ),
    ("strip_at_wall", &[]),
    (
        "cable_on_floor",
        &[
            ("gap = 1e-3", "halve = true\ngap = 1e-3"),
            ("duration = 0.5", "duration = 0.2"),
        ],
    ),
    (
        "plectoneme",
        &[
            (
                "table = [[0.0, 0.0], [16.0, 32.0]]",
                "table = [[0.0, 0.0], [8.0, 30.0]]",
            ),
            (
                "duration = 16.0\nsamples = 33",
                "duration = 6.0\nsamples = 4",
            ),
        ],
    ),
    ("bounce", &[("duration = 20.0", "duration = 2.0")]),
    ("viscous", &[("duration = 3.0", "duration = 0.2")]),
    ("heavy_snap", &[("duration = 0.2", "duration = 0.06")]),
    (
        "heavy_cantilever",
        &[
            (
                "damping = { proportional = 0.002 }",
                "damping = { proportional = 0.002 }\nrelaxation = [{ stiffness = 0.001, time = 0.3 }]",
            ),
            (
                "duration = 2.0\nsamples = 801",
                "duration = 0.002\ntolerance = 1e-4",
            ),
        ],
    ),
    ("flying_beam", &[("duration = 10.0", "duration = 0.01")]),
    ("free_beam", &[("duration = 1.0", "duration = 0.05")]),
    ("gyroscope", &[("duration = 60.0", "duration = 0.1")]),
    ("whirl", &[("duration = 10.0", "duration = 0.1")]),
    ("platform", &[("duration = 3.0", "duration = 0.1")]),
    (
        "platform",
        &[
            ("duration = 3.0", "duration = 0.1"),
            (
                "velocity = [0.3, 0.1, 0.0]",
                "groove = { line = { point = [0.0, 0.0, 0.0], direction = [0.0, 0.0, 1.0] } }\nvelocity = [0.0, 0.0, 0.3]",
            ),
        ],
    ),
    ("plunge", &[("duration = 4.0", "duration = 0.1")]),
    ("wire", &[("duration = 0.2", "duration = 0.05")]),
    ("through", &[("duration = 12.0", "duration = 3.0")]),
    ("heavy_arch", &[("duration = 0.5", "duration = 0.001")]),
    ("pulse_small", &[("duration = 0.004", "duration = 0.003")]),
    ("tube_riemann", &[("cells = 300", "cells = 60")]),
    (
        "vein",
        &[
            ("cells = 30", "cells = 8"),
            ("duration = 0.06", "duration = 0.035"),
        ],
    ),
    ("starling", &[]),
    ("balloon_step", &[("duration = 20.0", "duration = 12.5")]),
    ("balloon_step", &[("pressure = 2.6", "pressure = 7.0")]),
    (
        "disc_in_motion",
        &[
            (
                "ramp = { to = 1.65, until = 2e-3 }",
                "block = { size = 3.0, until = 4e-3 }",
            ),
            ("elements = 40", "elements = 10"),
        ],
    ),
    ("piston", &[("duration = 16.0", "duration = 1.0")]),
];

fn text(name: &str, changes: &[(&str, &str)]) -> String {
    let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let mut text = std::fs::read_to_string(path).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{name}: {from}");
        text = text.replace(from, to);
    }
    if text.contains("units = \"si\"") {
        text
    } else {
        format!(
            "units = \"si\"\n{}",
            text.replace("units = \"dimensionless\"", "")
        )
    }
}

/// The names under each heading: of columns with their units, of JSON as paths.
type Names = BTreeMap<String, BTreeSet<String>>;

/// Names of the scene's bodies and rods become NAME.
fn columns(names: &mut Names, section: &str, table: &Table) {
    for column in &table.columns {
        // Only stations have resultants along directors.
        let station = column.name.rsplit_once('.').map(|(station, _)| station);
        let of_station = station.filter(|name| table.column(&format!("{name}.n3")).is_some());
        let last = column.name.rsplit('.').next().unwrap_or_default();
        let of_joint = last.starts_with("angle") || last.starts_with("shift");
        let section = match of_station {
            Some(_) => "trajectory.csv, stations",
            None if of_joint && section.starts_with("trajectory") => "trajectory.csv, joints",
            None => section,
        };
        let section = names.entry(section.to_owned()).or_default();
        let name = match column.name.rsplit_once('.') {
            Some((_, rest)) => format!("NAME.{rest}"),
            None => column.name.to_string(),
        };
        section.insert(format!("{name} | {}", column.unit));
    }
}

/// The paths of an object's values: `list[]` for a list of objects, NAME for names from the scene; repeated objects
/// (states, bounces, the two sides of a snap) have one name.
fn paths(names: &mut BTreeSet<String>, path: &str, value: &Value) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                let key = match path.rsplit('.').next() {
                    Some("bodies" | "counts" | "free_ends" | "rod_counts" | "rods") => "NAME",
                    _ => key,
                };
                let path = match path {
                    "" => key.to_owned(),
                    _ => format!("{path}.{key}"),
                };
                let path = match path.as_str() {
                    "start" | "end" | "branches[].end" if value.is_object() => "STATE",
                    "bounces.first[]" | "bounces.hardest" => "BOUNCE",
                    "from" | "to" if value.is_object() => "SIDE",
                    path => path,
                };
                paths(names, path, value);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            let path = match path {
                "bounces.first" => "BOUNCE".to_owned(),
                path => format!("{path}[]"),
            };
            list.iter().for_each(|value| paths(names, &path, value));
        }
        _ => {
            names.insert(path.to_owned());
        }
    }
}

fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
    Scene::parse(&text(name, changes)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn written() -> Names {
    let mut names = Names::new();
    for (name, changes) in MOTIONS {
        let scene = scene(name, changes);
        let mut tables: Vec<Table> = Vec::new();
        let found = dispatch::motion(&scene, Fields::Some, &mut tables, &mut Silent).unwrap();
        let flow = scene.flow().map(|flow| match flow.medium {
            FlowMedium::Tube(_) => "a flow",
            FlowMedium::Lumped(_) => "a lumped tube",
        });
        let kind = match (scene.bar(), scene.assembly()) {
            (Some(_), _) => "a bar",
            (_, Some(_)) => "several rods and bodies",
            _ if flow.is_some() => flow.unwrap_or_default(),
            _ if scene.inflation().is_some() => "a membrane in motion",
            _ if scene.is_planar() => "one rod in the plane",
            _ => "one rod in space",
        };
        for table in &tables {
            let file = table.name.split('-').next().unwrap_or_default();
            let kind = if file == "contacts" { "a run" } else { kind };
            columns(&mut names, &format!("{file}.csv, {kind}"), table);
        }
        let mut summary = found.summary;
        summary["scene"] = Value::Null;
        let summaries = match (scene.bar(), flow) {
            (Some(_), _) => "summary.json, a bar".to_owned(),
            (_, Some(flow)) => format!("summary.json, {flow}"),
            _ if scene.inflation().is_some() => format!("summary.json, {kind}"),
            _ => "summary.json".to_owned(),
        };
        paths(names.entry(summaries).or_default(), "", &summary);
        for event in &found.events {
            let kind = match event["kind"].as_str().unwrap() {
                "choke" | "touch" | "line" if flow.is_some() => "choke, touch, line",
                "fold" if scene.inflation().is_some() => "fold, a sphere",
                "snap" if scene.inflation().is_some() => "snap, a piston",
                "burst" | "slack" | "bottom" => "burst, slack, bottom",
                "accumulation" | "slip" | "stick" | "reverse" | "release" | "touch" => "contact",
                kind => kind,
            };
            let kind = format!("events.json, {kind}");
            paths(names.entry(kind).or_default(), "", event);
        }
    }
    for (name, kind) in [
        ("cantilever", "one rod"),
        ("heavy_column", "one rod"),
        ("hook", "one rod"),
        ("peg", "one rod"),
        ("pipe", "one rod"),
        ("arch", "several rods and bodies"),
    ] {
        let (summary, table) = dispatch::rest(&scene(name, &[]), &FirstOrder::default()).unwrap();
        columns(&mut names, &format!("shape.csv, {kind}"), &table);
        let file = format!("equilibrium.json, {kind}");
        paths(names.entry(file).or_default(), "", &summary);
    }
    for (name, kind) in [
        ("latex_tube", "a tube"),
        ("balloon", "a membrane"),
        ("membrane_disc", "a membrane"),
    ] {
        let scene = scene(name, &[]);
        let record = wall::equilibrium(&scene).unwrap();
        columns(&mut names, &format!("shape.csv, {kind}"), &record.shape);
        let file = format!("equilibrium.json, {kind}");
        paths(names.entry(file).or_default(), "", &record.summary);
        let record = wall::branch(&scene).unwrap();
        columns(&mut names, &format!("branch.csv, {kind}"), &record.points);
        // An empty list has no keys.
        if !record.specials.is_empty() {
            let file = "special_points.json, tubes and membranes".to_owned();
            paths(names.entry(file).or_default(), "", &record.summary());
        }
    }
    let pulled = Scene::parse(
        r#"
[[rod]]
name = "a"
model = "cosserat"
length = 1.0
section = { bending = [1.0, 1.2], torsion = 0.8 }
tendon = [{ offset = [0.1, 0.02], tension = 3.0 }]
from = { position = [0.0, 0.0, 0.0] }
to = { body = "m" }
[[body]]
name = "m"
force = [0.0, 0.3, -0.2]
"#,
    );
    let (summary, _) = dispatch::rest(&pulled.unwrap(), &FirstOrder::default()).unwrap();
    let file = "equilibrium.json, several rods and bodies".to_owned();
    paths(names.entry(file).or_default(), "", &summary);
    let joint = [(
        "joint = \"hinge\", axis = [0.0, 1.0, 0.0]",
        "joint = \"universal\", axis = [0.0, 1.0, 0.0], second_axis = [1.0, 0.0, 0.0], slide = [0.0, 0.0, 1.0]",
    )];
    let jointed = dispatch::columns(&scene("toggle", &joint)).unwrap();
    columns(
        &mut names,
        "trajectory.csv, several rods and bodies",
        &jointed,
    );
    let record = all_equilibria(&scene("cantilever", &[]), 14.0, &mut Silent).unwrap();
    columns(&mut names, "equilibria.csv", &record.table().unwrap());
    let mut summary = record.summary();
    for state in summary["equilibria"].as_array_mut().unwrap() {
        assert!(state["equilibrium"]["energy"].is_number());
        state["equilibrium"] = Value::Null;
    }
    paths(
        names.entry("equilibria.json".to_owned()).or_default(),
        "",
        &summary,
    );
    let moved = [
        ("\"end.load\"", "\"obstacle.peg.cylinder.point.z\""),
        ("from = 0.0", "from = -0.4"),
        ("to = 20.0", "to = -0.05"),
    ];
    let peg = scene("peg", &moved);
    let record = snaprod::study::equilibrium(&peg).unwrap();
    let contacts = record.contacts.expect("contacts");
    columns(
        &mut names,
        "contacts.csv",
        &contacts.table(record.units).unwrap(),
    );
    let record = branch(&peg, &mut Silent).unwrap();
    columns(&mut names, "branch.csv", &record.branches.points);
    let mut touching = record.summary();
    let record = branch(&scene("lateral", &[]), &mut Silent).unwrap();
    columns(&mut names, "branch.csv", &record.branches.points);
    let mut summary = record.summary();
    let specials = touching["special_points"].as_array_mut().unwrap();
    summary["special_points"]
        .as_array_mut()
        .unwrap()
        .append(specials);
    summary["scene"] = Value::Null;
    // The keys of a state are the columns of branch.csv.
    for at in summary["special_points"].as_array_mut().unwrap() {
        assert!(at["state"]["energy"].is_number());
        at["state"] = Value::Null;
    }
    paths(
        names.entry("special_points.json".to_owned()).or_default(),
        "",
        &summary,
    );
    let record = modes(&scene("pendulum", &[])).unwrap();
    columns(&mut names, "modes.csv", &record.table().unwrap());
    paths(
        names.entry("summary.json, modes".to_owned()).or_default(),
        "",
        &record.summary(),
    );
    let response = memory::memory(&scene("creep", &[])).unwrap();
    let entries = memory::entries(&response, &[1.0]);
    columns(
        &mut names,
        "kernel.csv",
        &memory::table(&response, &[1.0], &entries),
    );
    names
}

/// The names of the document's tables: under a heading of `###` the first cell of each row, of columns with the unit
/// in the second.
fn documented() -> Names {
    let path = format!("{}/docs/output.md", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let mut names = Names::new();
    let mut section = String::new();
    for line in text.lines() {
        if line.starts_with('#') {
            section = line.trim_start_matches(['#', ' ']).to_owned();
        } else if line.starts_with("| `") {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let is_table = section.contains(".csv");
            for name in cells[0].split(", ") {
                let name = name.trim_matches('`');
                let name = if is_table {
                    format!("{name} | {}", cells[1])
                } else {
                    name.to_owned()
                };
                let fresh = names
                    .entry(section.clone())
                    .or_default()
                    .insert(name.clone());
                assert!(fresh, "{section}: {name} stands twice");
            }
        }
    }
    names
}

/// Catches a column, unit or key missing in docs/output.md, and one documented but absent from every file.
#[test]
fn the_document_of_the_output_is_whole() {
    let (documented, written) = (documented(), written());
    for (section, names) in &written {
        let told = documented
            .get(section)
            .unwrap_or_else(|| panic!("docs/output.md has no table under {section}"));
        let missing: Vec<_> = names.difference(told).collect();
        assert!(
            missing.is_empty(),
            "{section}: docs/output.md lacks {missing:#?}"
        );
        let idle: Vec<_> = told.difference(names).collect();
        assert!(
            idle.is_empty(),
            "{section}: docs/output.md has {idle:#?}, which no file has"
        );
    }
    for section in documented
        .keys()
        .filter(|section| section.contains(".csv") || section.contains(".json"))
    {
        assert!(written.contains_key(section), "{section} is no file");
    }
}

/// A number of so many bytes.
fn little(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .rev()
        .fold(0, |n, b| (n << 8) | usize::from(*b))
}

/// The reals of an NPZ file with their shapes, read by the directory at its end as the ZIP format has it.
fn reals(file: &[u8]) -> BTreeMap<String, (String, Vec<f64>)> {
    let end = &file[file.len() - 22..];
    assert!(end.starts_with(b"PK\x05\x06"));
    let (count, mut at) = (little(&end[10..12]), little(&end[16..20]));
    let mut arrays = BTreeMap::new();
    for _ in 0..count {
        let entry = &file[at..];
        let letters = little(&entry[28..30]);
        let name = String::from_utf8(entry[46..46 + letters].to_vec()).unwrap();
        let (size, start) = (little(&entry[24..28]), little(&entry[42..46]));
        let data = start + 30 + letters;
        let npy = &file[data..data + size];
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00"), "{name}");
        let body = 10 + little(&npy[8..10]);
        assert_eq!(body % 64, 0, "{name}");
        let header = String::from_utf8(npy[10..body].to_vec()).unwrap();
        if header.contains("'<f8'") {
            let shape = header.split(['(', ')']).nth(1).unwrap().to_owned();
            let eight = npy[body..].chunks_exact(8);
            let values = eight.map(|b| f64::from_le_bytes(b.try_into().unwrap()));
            arrays.insert(
                name.trim_end_matches(".npy").to_owned(),
                (shape, values.collect()),
            );
        }
        at += 46 + letters;
    }
    arrays
}

/// Catches arrays that differ from the CSV by a bit, shapes that do not end on the mass, directors that are not
/// orthonormal, and a snap without its two rows. Catches ParaView files with other numbers, or stale ones of an
/// earlier run with more files.
#[test]
fn arrays_and_grids_hold_the_motion() {
    let place = Place::new("outputs");
    place.write(
        "snap.toml",
        &text(
            "snap",
            &[
                ("duration = 3.0", "duration = 0.1"),
                ("samples = 400", "samples = 5"),
            ],
        ),
    );
    std::fs::create_dir(place.join("out")).unwrap();
    place.write("out/run-0042.vtu", "of a longer run");
    let answer = place.run(&[
        "run",
        "snap.toml",
        "--npz",
        "--vtk",
        "--no-figures",
        "--out",
        "out",
    ]);
    assert_eq!((answer.code, answer.stderr.as_str()), (0, ""));
    let read = |name: &str| std::fs::read(place.join(&format!("out/{name}"))).unwrap();
    let csv = String::from_utf8(read("trajectory.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let trajectory = reals(&read("trajectory.npz"));
    let mut compared = 0;
    for (k, name) in rows[0].iter().enumerate() {
        if let Some((_, values)) = trajectory.get(*name) {
            let same = rows[1..]
                .iter()
                .zip(values)
                .all(|(row, x)| row[k].parse() == Ok(*x));
            assert!(same && values.len() == rows.len() - 1, "{name}");
            compared += 1;
        }
    }
    assert_eq!(compared, 16);
    let of = |name: &str| &trajectory[name].1;
    let twice: Vec<usize> = (1..of("t").len())
        .filter(|k| of("t")[*k] == of("t")[k - 1])
        .collect();
    assert_eq!((twice.len(), of("t").len()), (1, 7));
    let [before, after] = [twice[0] - 1, twice[0]];
    let jump = |name: &str| (of(name)[before] - of(name)[after]).abs();
    assert!(["x", "y", "vx", "vy"].iter().all(|name| jump(name) < 1e-13));
    assert!(of("elastic")[before] > of("elastic")[after] + 1.0);
    assert!((of("total")[before] - of("total")[after]).abs() < 1e-9);

    let shapes = reals(&read("shapes.npz"));
    let (shape, position) = &shapes["position"];
    assert_eq!((shape.as_str(), position.len()), ("5,61,3,", 5 * 61 * 3));
    let (directors, s) = (&shapes["directors"].1, &shapes["s"].1);
    for (k, t) in shapes["time"].1.iter().enumerate() {
        let row = of("t").iter().position(|other| other == t).unwrap();
        let end = &position[(61 * k + 60) * 3..][..3];
        let off = (end[0] - of("x")[row]).hypot(end[1] - of("y")[row]);
        assert!(off < 1e-12 && end[2] == 0.0, "at {t}: {off:e}");
        assert!(s[61 * k] == 0.0 && (s[61 * k + 60] - 1.0).abs() < 1e-15);
        for i in 1..61 {
            // The chord of an arc of curvature c and length h is h (1 - (c h)^2/24 ...), at most the arc.
            let [a, b] = [i - 1, i].map(|i| &position[(61 * k + i) * 3..][..3]);
            let (h, chord) = (
                s[61 * k + i] - s[61 * k + i - 1],
                (b[0] - a[0]).hypot(b[1] - a[1]),
            );
            assert!(
                chord <= h * (1.0 + 1e-12) && chord > h * (1.0 - 0.01),
                "{chord} {h}"
            );
            let d3 = &directors[(61 * k + i) * 9 + 6..][..3];
            let along = (d3[0] * (b[0] - a[0]) + d3[1] * (b[1] - a[1])) / chord;
            assert!(
                along > 0.99 && (d3[0].hypot(d3[1]) - 1.0).abs() < 1e-14,
                "{along}"
            );
        }
    }

    assert!(!place.join("out/run-0042.vtu").exists());
    // The file for VTK is HDF5 of the oldest version. The superblock says where the file ends.
    let grid = read("run.vtkhdf");
    assert!(grid.starts_with(b"\x89HDF\r\n\x1a\n"));
    let end = u64::from_le_bytes(grid[40..48].try_into().unwrap());
    assert_eq!(end as usize, grid.len());
    // The arrays stand whole and in order in the file: the times, and the points of all times.
    let holds = |numbers: &[f64]| {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        grid.windows(bytes.len()).any(|part| part == bytes)
    };
    assert!(holds(&shapes["time"].1));
    for k in 0..5 {
        assert!(holds(&position[61 * 3 * k..][..61 * 3]), "{k}");
    }
}

/// Catches a glTF file that is cut, whose joints are off the rod, or that turns a rotation the long way round.
#[test]
fn a_gltf_file_holds_the_motion() {
    let place = Place::new("gltf");
    let scene = format!("{}/scenes/whirl.toml", env!("CARGO_MANIFEST_DIR"));
    let answer = place.run(&[
        "run",
        &scene,
        "--npz",
        "--gltf",
        "--no-figures",
        "--out",
        "out",
        "--set",
        "run.samples=9",
        "--set",
        "run.duration=0.5",
    ]);
    assert_eq!((answer.code, answer.stderr.as_str()), (0, ""));
    let read = |name: &str| std::fs::read(place.join(&format!("out/{name}"))).unwrap();
    let file = read("run.glb");
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(
        (&file[..4], word(4), word(8)),
        (&b"glTF"[..], 2, file.len())
    );
    let text = &file[20..20 + word(12)];
    let gltf: Value = serde_json::from_slice(text).unwrap();
    let numbers = &file[20 + text.len() + 8..];
    assert_eq!(gltf["buffers"][0]["byteLength"], numbers.len());
    let reals = |accessor: &Value| -> Vec<f64> {
        let accessor = &gltf["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &gltf["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [from, count] =
            ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
        let all = numbers[from..from + count].chunks(4);
        all.map(|x| f64::from(f32::from_le_bytes(x.try_into().unwrap())))
            .collect()
    };
    let animation = &gltf["animations"][0];
    let output = |node: &Value, path: &str| {
        let channels = animation["channels"].as_array().unwrap();
        let channel = channels
            .iter()
            .find(|one| one["target"] == json!({ "node": node, "path": path }));
        reals(
            &animation["samplers"][channel.unwrap()["sampler"].as_u64().unwrap() as usize]["output"],
        )
    };
    let shapes = self::reals(&read("shapes.npz"));
    let (_, position) = &shapes["position"];
    let sections = position.len() / 27;
    let joints = gltf["skins"][0]["joints"].as_array().unwrap();
    for (joint, section) in [(joints.first(), 0), (joints.last(), sections - 1)] {
        let places = output(joint.unwrap(), "translation");
        for k in 0..9 {
            let wanted = &position[3 * (sections * k + section)..][..3];
            assert!(
                places[3 * k..][..3]
                    .iter()
                    .zip(wanted)
                    .all(|(a, b)| (a - b).abs() < 1e-6)
            );
        }
        let turns = output(joint.unwrap(), "rotation");
        for two in turns.chunks(4).zip(turns.chunks(4).skip(1)) {
            let along: f64 = two.0.iter().zip(two.1).map(|(a, b)| a * b).sum();
            assert!(along >= 0.0, "{two:?}");
        }
    }
}

/// Catches films that are no drawing, that leave out frames or snaps, and formats that are refused without a reason.
#[test]
fn a_film_moves() {
    let place = Place::new("film");
    let scene = |name: &str| format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    for (name, set) in [("snap", "run.duration=0.2"), ("whirl", "run.duration=0.2")] {
        let answer = place.run(&[
            "run",
            &scene(name),
            "--film",
            "film.svg",
            "--no-figures",
            "--out",
            "out",
            "--set",
            set,
        ]);
        assert_eq!((answer.code, answer.stderr.as_str()), (0, ""));
        let svg = place.read("film.svg");
        let film = roxmltree::Document::parse(&svg).unwrap();
        let animated = film
            .descendants()
            .filter(|node| node.has_tag_name("animate"));
        let times: Vec<(f64, f64)> = animated
            .map(|one| {
                let all = one.attribute("keyTimes").unwrap().split(';');
                let all: Vec<f64> = all.map(|x| x.parse().unwrap()).collect();
                let values: Vec<&str> = one.attribute("values").unwrap().split(';').collect();
                let on = values.iter().position(|value| *value == "visible").unwrap();
                (all[on], all.get(on + 1).copied().unwrap_or(1.0))
            })
            .collect();
        // One frame is shown at every time.
        assert!(times.len() > 60 && times[0].0 == 0.0 && times[times.len() - 1].1 == 1.0);
        assert!(
            times
                .windows(2)
                .all(|pair| pair[0].1 == pair[1].0 && pair[0].0 < pair[0].1)
        );
        assert_eq!(svg.contains("the rod falls"), name == "snap");
        assert_eq!(svg.matches("<svg ").count(), 1);
    }
    let refused = place.run(&["run", &scene("snap"), "--film", "film.avi"]);
    assert!(
        refused.code != 0 && refused.stderr.contains(".svg, .gif or .mp4"),
        "{}",
        refused.stderr
    );
}

/// Catches lost results or shapes of a run with early end and requested shapes.
#[test]
fn a_run_that_ends_short_keeps_its_shapes() {
    let place = Place::new("short");
    let scene = format!("{}/scenes/snap.toml", env!("CARGO_MANIFEST_DIR"));
    let answer = place.run(&[
        "run",
        &scene,
        "--npz",
        "--vtk",
        "--quiet",
        "--no-figures",
        "--out",
        "out",
        "--set",
        "run.max_steps=40",
    ]);
    assert_ne!(answer.code, 0);
    assert!(!answer.stderr.contains("warning"), "{}", answer.stderr);
    let read = |name: &str| std::fs::read(place.join(&format!("out/{name}"))).unwrap();
    let (shapes, trajectory) = (reals(&read("shapes.npz")), reals(&read("trajectory.npz")));
    let end =
        |of: &BTreeMap<String, (String, Vec<f64>)>, name: &str| of[name].1[of[name].1.len() - 1];
    let (shown, run) = (end(&shapes, "time"), end(&trajectory, "t"));
    assert!((shown - run).abs() < 1e-12 && run < 3.0, "{shown} {run}");
    assert_eq!(place.json("out/summary.json")["complete"], false);
}
