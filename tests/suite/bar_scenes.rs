//! Scenes of bars: reading, refusal, running, writing; the examples of the thesis through the program's records.

use crate::support::{assert_close, json, number};
use serde_json::Value;
use snaprod::scene::{FaultKind, Scene};
use snaprod::study::bar::{BarPrepared, BarRecord, run};
use snaprod::study::{Silent, Table};
use std::path::Path;

fn bundled(name: &str, set: &[&str]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    Scene::read_with(&path, set).expect("a scene")
}

fn ran(scene: &Scene) -> (BarRecord, Vec<Table>) {
    let mut tables = Vec::new();
    let prepared = BarPrepared::new(scene).expect("a bar");
    let record = run(&prepared, &mut tables, &mut Silent).expect("a run");
    (record, tables)
}

/// Catches a summary without the contracted numbers, or with wrong ones: the pulse and the sine of the thesis, with
/// cells and loads changed from outside.
#[test]
fn examples_tell_their_shocks() {
    let given = json("waves/rod_exact_given.json");
    let shock = &given["step_load_on_rod_at_rest"][1]["unload_to_zero_shock"];
    let (record, tables) = ran(&bundled(
        "pulse",
        &["rod.cells=150", "run.duration=0.003", "run.samples=151"],
    ));
    let summary = record.summary();
    assert_close(
        number(&summary["breaking"], "time"),
        0.002,
        1e-9,
        0.0,
        "breaking",
    );
    assert_close(
        number(&summary["breaking"], "position"),
        3.0,
        1e-9,
        0.0,
        "breaking",
    );
    let shocks = summary["shocks"].as_array().expect("shocks");
    let late: Vec<&Value> = shocks
        .iter()
        .filter(|s| number(s, "time") > 0.00231)
        .collect();
    assert_eq!(late.len(), 35, "one a sample");
    for seen in &late {
        assert_close(
            -number(seen, "speed"),
            number(shock, "speed"),
            2e-3,
            0.0,
            "speed",
        );
        assert_close(number(seen, "loss_rate"), 82.17, 1e-2, 0.0, "loss");
    }
    assert_eq!(
        record.shocks.len(),
        1,
        "one shock from its birth to the end"
    );
    assert_eq!(summary["outcome"], "end_of_time");
    let table = &tables[0];
    assert_eq!(table.rows(), 151);
    let balance = ["kinetic", "elastic", "dissipated"].map(|name| table.reals(name)[150]);
    assert_close(
        balance.iter().sum(),
        table.reals("work")[150],
        1e-12,
        0.0,
        "ledger",
    );
    assert_eq!(tables[1].name, "waves");
    assert_eq!(tables[1].rows(), 151 * 150);
    assert!(
        record
            .events()
            .iter()
            .any(|event| event["kind"] == "breaking")
    );
    assert_eq!(record.rays.len(), 16);

    // Half the load: the plateau follows the law.
    let (gentle, _) = ran(&bundled(
        "pulse",
        &[
            "rod.cells=60",
            "loads.force.block.size=1.0",
            "run.duration=0.001",
            "run.samples=2",
        ],
    ));
    let tip = gentle.last().expect("an end").ends[1];
    assert_close(tip.stress, 1.0 / 0.0314, 1e-12, 0.0, "stress of the load");

    let (sine, _) = ran(&bundled(
        "sine",
        &["run.duration=0.0046", "run.samples=231"],
    ));
    let summary = sine.summary();
    assert_close(
        number(&summary["breaking"], "time"),
        0.001802922904,
        1e-6,
        0.0,
        "breaking",
    );
    assert_close(
        number(&summary["breaking"], "position"),
        3.0 - 0.9949696601,
        1e-6,
        0.0,
        "breaking",
    );
    assert_close(number(&summary["wall"], "max"), 78.0, 1e-2, 0.0, "wall");
    assert_close(number(&summary["wall"], "min"), -105.7, 1e-2, 0.0, "wall");
    let last = summary["shocks"].as_array().expect("shocks").iter();
    let mut last: Vec<f64> = last
        .filter(|s| number(s, "time") == 0.0046)
        .map(|s| number(s, "position"))
        .collect();
    last.sort_by(f64::total_cmp);
    assert_eq!(last.len(), 2, "{last:?}");
    assert!(
        (last[0] - 1.143).abs() < 0.01 && (last[1] - 1.233).abs() < 0.01,
        "{last:?}"
    );
    let (small, _) = ran(&bundled(
        "pulse_small",
        &["run.duration=0.002", "run.samples=2"],
    ));
    assert_close(
        small.last().unwrap().ends[1].stress,
        0.0,
        1e-9,
        1.0,
        "unloaded",
    );
}

/// Catches a printed scene that differs from the scene read.
#[test]
fn scenes_of_bars_are_written_again() {
    for name in ["pulse", "pulse_small", "sine", "heavy_bar"] {
        let scene = bundled(name, &[]);
        let printed = toml::to_string(&scene).expect("TOML");
        assert_eq!(Scene::parse(&printed).expect("a scene"), scene, "{printed}");
    }
    let all = [
        "rod.law={ biderman = [0.2, 0.0, 0.0, 0.02] }",
        "rod.law={ table = [[0.5, -3.0], [1.0, 0.0], [2.0, 2.0]] }",
        "rod.law={ polynomial = [1.0, 0.1] }",
        "rod.law={ linear = 2.0 }",
    ];
    for law in all {
        let scene = bundled(
            "heavy_bar",
            &[
                law,
                "rod.scheme=\"finite-volume\"",
                "run.duration=0.1",
                "start.stretch=1.01",
                "rod.base=\"free\"",
            ],
        );
        let printed = toml::to_string(&scene).expect("TOML");
        assert_eq!(Scene::parse(&printed).expect("a scene"), scene, "{printed}");
        ran(&scene);
    }
}

/// Catches a faulty bar that is accepted, or refused without a reason.
#[test]
fn faults_of_bars_are_named() {
    let text =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/pulse.toml"))
            .unwrap();
    for (set, kind, said) in [
        (
            "rod.scheme=\"stretch-taylor\"",
            FaultKind::Value,
            "|g|^2 = 1 + m^4/4",
        ),
        ("rod.scheme=\"upwind\"", FaultKind::Value, "finite-volume"),
        ("rod.area=-1.0", FaultKind::Value, "> 0"),
        (
            "rod.law={ mooney = [24.0] }",
            FaultKind::Value,
            "two numbers",
        ),
        (
            "rod.law={ mooney = [-24.0, 0.0] }",
            FaultKind::Value,
            "must grow",
        ),
        (
            "rod.law={ linear = 1.0, mooney = [24.0, 1.5] }",
            FaultKind::Conflict,
            "one law",
        ),
        ("rod.tip=\"wall\"", FaultKind::Value, "leave out"),
        ("rod.cells=2", FaultKind::Value, "4 or more"),
        ("start.stretch=0.0", FaultKind::Value, "> 0"),
        ("loads.force.block.until=-1.0", FaultKind::Value, "> 0"),
        ("rod.bending_stiffness=1.0", FaultKind::Unknown, "one of"),
        ("clamp.position=[0.0, 0.0]", FaultKind::Unknown, "one of"),
    ] {
        let faults = Scene::parse_with(&text, &[set]).expect_err(set);
        let all = faults.to_string();
        assert!(all.contains(said), "{set}: {all}");
        assert!(
            faults.into_iter().any(|fault| fault.kind == kind),
            "{set}: {all}"
        );
    }
    let shown = Scene::parse_with(
        &text,
        &[
            "rod.scheme=\"stretch-taylor\"",
            "rod.unstable=true",
            "run.time_step=1e-5",
            "rod.cells=60",
        ],
    );
    let (record, _) = ran(&bundled(
        "sine",
        &[
            "rod.scheme=\"stretch-taylor\"",
            "rod.unstable=true",
            "run.time_step=1e-5",
            "rod.cells=60",
            "run.duration=0.0025",
        ],
    ));
    assert!(shown.is_ok());
    assert_eq!(record.outcome(), "stuck");
    assert!(
        record
            .reason()
            .expect("a reason")
            .contains("unstable at every step")
    );
    let bar = bundled("pulse", &[]);
    for refused in [
        bar.run().map(drop),
        bar.end().map(drop),
        bar.body().map(drop),
    ] {
        assert!(refused.unwrap_err().to_string().contains("snaprod run"));
    }
}

/// Catches a heavy end that is not that of the library: comparison with the converged motion of the data, under
/// another push.
#[test]
fn heavy_bar_follows_its_next_order() {
    let (record, _) = ran(&bundled(
        "heavy_bar",
        &["run.duration=2.0", "run.samples=21"],
    ));
    let prepared = BarPrepared::new(&bundled("heavy_bar", &[])).unwrap();
    let times: Vec<f64> = record.moments.iter().map(|at| at.time).collect();
    let corrected = snaprod::bar::heavy::reduced(prepared.bar(), true, &times).unwrap();
    for (at, [r, _]) in record.moments.iter().zip(corrected) {
        assert_close(at.ends[1].position, r, 2e-3, 0.0, "place of the mass");
    }
    assert_close(
        record.summary()["eps"].as_f64().unwrap(),
        0.1,
        1e-12,
        0.0,
        "eps",
    );
}

/// Catches an envelope bound that knows only the reflection of the load's own wave. A bar is compressed at the start,
/// and its load compresses it further. The first shock is predicted if the base holds the bar. With a free base
/// another wave comes first, and no shock is predicted.
#[test]
fn breaking_is_told_before_any_other_wave_alone() {
    let told = |base: &str| {
        let text = format!(
            "[rod]\nmodel = \"bar\"\nlength = 1.0\narea = 1.0\ndensity = 1.0\nlaw = {{ polynomial = [1.0, -3.0] }}\ncells = 50\nbase = \"{base}\"\n\
             [run]\nduration = 1.0\nsamples = 3\n[start]\nstretch = 0.9\n\
             [loads]\nforce = {{ ramp = {{ from = -0.13, to = -0.43, start = 0.0, until = 0.2 }} }}\n"
        );
        let (record, _) = ran(&Scene::parse(&text).expect("a scene"));
        record.summary()["breaking"].clone()
    };
    assert!(number(&told("wall"), "time") > 0.5, "{}", told("wall"));
    assert_eq!(told("free"), Value::Null);
}
