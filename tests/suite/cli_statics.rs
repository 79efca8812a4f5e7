//! Command line of `snaprod equilibrium` and `snaprod branch`.

use crate::program::{Answer, Place, Table, close, keys};
use crate::support::SAMPLE;
use serde_json::Value;
use snaprod::elastica::{Equilibrium, equilibria_at, fold_distance};
use std::f64::consts::PI;

/// A rod that can only bend and twist, of length 1.
fn stiff(bending: [f64; 2], torsion: f64, rest: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\n[rod.section]\nbending = {bending:?}\ntorsion = {torsion:?}\n{rest}\n"
    )
}

/// The planar elastica in space, its end held by a ball joint at (0.6, 0) of its plane (z, x).
fn elastica(rest: &str) -> String {
    stiff(
        [1000.0, 1.0],
        1000.0,
        &format!(
            "[end]\nposition = [0.0, 0.0, 0.6]\n[continue]\nparameter = \"end.position.x\"\n{rest}"
        ),
    )
}

fn run(place: &Place, command: &str, scene: &str) -> Answer {
    place.write("scene.toml", scene);
    place.run(&[command, "scene.toml", "--out", "out", "--json"])
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().unwrap();
    assert_eq!(list.len(), N);
    std::array::from_fn(|i| list[i].as_f64().unwrap())
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

#[track_caller]
fn near<const N: usize>(a: [f64; N], b: [f64; N], tolerance: f64) {
    for i in 0..N {
        let size = b[i].abs().max(1.0);
        assert!((a[i] - b[i]).abs() <= tolerance * size, "{a:?} {b:?}");
    }
}

/// Catches inconsistent printed numbers: loads, balance of moments, section law, energy and centreline are checked
/// against each other.
#[test]
fn an_equilibrium_balances() {
    let place = Place::new("equilibrium");
    let found = run(&place, "equilibrium", SAMPLE).json(0);
    keys(&found, &["index", "stable", "conservative", "path"]);
    let position = numbers::<3>(&found["position"]);
    let q = numbers::<4>(&found["quaternion"]);
    let (base_force, base_couple) = (
        numbers::<3>(&found["base_force"]),
        numbers::<3>(&found["base_couple"]),
    );
    near(numbers(&found["tip_force"]), [1.0, -2.0, 0.5], 1e-9);
    near(numbers(&found["tip_couple"]), [0.3, 0.2, -0.8], 1e-9);
    near(base_force, [1.0, -2.0, 0.5], 1e-9);
    let arm = cross(position, base_force);
    let balance = std::array::from_fn(|i| base_couple[i] - arm[i]);
    near(balance, [0.3, 0.2, -0.8], 1e-9);
    assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-14 && q[0] >= 0.0);
    assert!(found["residual"].as_f64().unwrap() < 1e-9);
    assert_eq!(found["index"], 0);

    assert_eq!(
        place.files("out"),
        ["equilibrium.json", "equilibrium.svg", "shape.csv"]
    );
    assert_eq!(place.json("out/equilibrium.json"), found);
    let shape = Table::parse(&place.read("out/shape.csv"));
    let row =
        |names: &[&str]| -> Vec<Vec<f64>> { names.iter().map(|name| shape.column(name)).collect() };
    let (r, d) = (
        row(&["x", "y", "z"]),
        row(&[
            "d1x", "d1y", "d1z", "d2x", "d2y", "d2z", "d3x", "d3y", "d3z",
        ]),
    );
    let e = row(&["u1", "u2", "u3", "v1", "v2", "v3"]);
    let w = row(&["m1", "m2", "m3", "n1", "n2", "n3"]);
    let (s, energy) = (shape.column("s"), shape.column("energy"));
    let last = s.len() - 1;
    assert!(s[0] == 0.0 && (s[last] - 1.0).abs() < 1e-15);
    near(std::array::from_fn(|i| r[i][last]), position, 1e-12);
    // The third column of the rotation of the quaternion.
    let [qw, qx, qy, qz] = q;
    let d3 = [
        2.0 * (qx * qz + qw * qy),
        2.0 * (qy * qz - qw * qx),
        1.0 - 2.0 * (qx * qx + qy * qy),
    ];
    near(std::array::from_fn(|i| d[6 + i][last]), d3, 1e-12);
    let stiffness = [1.0, 1.5, 0.7, 100.0, 120.0, 300.0];
    let strain = |i: usize, k: usize| e[i][k] - if i == 5 { 1.0 } else { 0.0 };
    let density = |k: usize| -> f64 {
        (0..6)
            .map(|i| 0.5 * stiffness[i] * strain(i, k).powi(2))
            .sum()
    };
    let (mut stored, h) = (0.0, 1.0 / last as f64);
    for k in 0..=last {
        for i in 0..6 {
            let want = stiffness[i] * strain(i, k);
            assert!(
                (w[i][k] - want).abs() < 1e-9 * (1.0 + want.abs()),
                "row {k}"
            );
        }
        // r' = R v, by central differences.
        if 0 < k && k < last {
            for i in 0..3 {
                let slope = (r[i][k + 1] - r[i][k - 1]) / (2.0 * h);
                let want = (0..3).map(|j| d[3 * j + i][k] * e[3 + j][k]).sum::<f64>();
                assert!((slope - want).abs() < 1e-4, "row {k}: {slope} {want}");
            }
        }
        let simpson = match k {
            _ if k == 0 || k == last => 1.0,
            _ if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        stored += simpson * h / 3.0 * density(k);
    }
    assert!((energy[last] - stored).abs() < 1e-8, "{stored}");
    close(&found["energy"], stored, 1e-8);
}

/// Catches a wrong sign or frame, against independent numbers (a cantilever under a transverse force, and a rod bent
/// to most of a circle); text whose numbers differ from the JSON; unrequested files.
#[test]
fn cantilevers_agree_with_independent_numbers() {
    let place = Place::new("cantilever");
    for (force, w, u, angle) in [
        (1.0, 0.3017207738, 0.0564332363, 0.4613519497),
        (10.0, 0.8106090249, 0.5549955978, 1.4302855388),
    ] {
        let text = stiff(
            [1.0, 1.0],
            1.0,
            &format!("[end]\nforce = [{force:?}, 0.0, 0.0]"),
        );
        place.write("scene.toml", &text);
        let found = place.run(&["equilibrium", "scene.toml", "--json"]).json(0);
        near(numbers(&found["position"]), [w, 0.0, 1.0 - u], 2e-10);
        let q = [f64::cos(0.5 * angle), 0.0, f64::sin(0.5 * angle), 0.0];
        near(numbers(&found["quaternion"]), q, 2e-10);
        let text = place.run(&["equilibrium", "scene.toml", "-v"]);
        let energy = found["energy"].as_f64().unwrap().to_string();
        assert!(text.text().contains(&energy), "{energy} not in {text:?}");
    }
    let scene = stiff([1.0, 1.0], 1.0, "[end]\ncouple = [0.0, 3.0, 0.0]");
    place.write("scene.toml", &scene);
    let found = place.run(&["equilibrium", "scene.toml", "--json"]).json(0);
    let position = [(1.0 - f64::cos(3.0)) / 3.0, 0.0, f64::sin(3.0) / 3.0];
    near(numbers(&found["position"]), position, 1e-10);
    assert_eq!(place.files("."), ["scene.toml"]);
}

/// Catches rounding printed as a force, and a small load suppressed as rounding.
#[test]
fn rounding_is_not_printed_as_a_value() {
    let place = Place::new("rounding");
    let printed = |end: &str| {
        place.write("scene.toml", &stiff([1.0, 1.0], 1.0, end));
        let answer = place.run(&["equilibrium", "scene.toml"]);
        assert_eq!(answer.code, 0, "{answer:?}");
        answer.stdout
    };
    for end in ["position = [0.6, 0.0, 0.6]", "force = [1.0, 0.0, 0.0]"] {
        let text = printed(&format!("[end]\n{end}"));
        let mut values = text.lines().filter(|line| !line.starts_with("residual"));
        assert!(values.all(|line| !line.contains("e-1")), "{text}");
    }
    let small = printed("[end]\nforce = [1e-9, 0.0, 0.0]");
    let lines: Vec<&str> = small.lines().collect();
    assert!(lines[4] == "tip force      1e-9, 0, 0", "{small}");
    assert_eq!(lines[5], "tip couple     0, 0, 0");
}

const COLUMNS: &str = "branch,parameter,arclength,x,y,z,qw,qx,qy,qz,base_fx,base_fy,base_fz,base_mx,base_my,base_mz,\
                       tip_fx,tip_fy,tip_fz,tip_mx,tip_my,tip_mz,energy,index,residual,label";

/// Catches folds missed or misplaced, against an independent continuation code; rows off equilibrium, inconsistent
/// files, and a branch that ends early without notice.
#[test]
fn a_branch_has_its_folds() {
    let place = Place::new("branch");
    let scene = elastica("to = -0.75\nboth = true\npoints = 160\nmax_step = 0.3");
    let summary = run(&place, "branch", &scene).json(1);
    assert_eq!(
        place.files("out"),
        [
            "branch.csv",
            "branch.svg",
            "shapes.svg",
            "special_points.json"
        ]
    );
    assert_eq!(place.json("out/special_points.json"), summary);
    let stop = summary["stop"].as_array().unwrap();
    let stop = stop.last().unwrap().as_str().unwrap();
    for words in [
        "branch 0",
        "short of end.position.x = -0.75",
        "160 points",
        "raise",
    ] {
        assert!(stop.contains(words), "{stop}");
    }
    assert_eq!(summary["complete"], false);

    let points = summary["special_points"].as_array().unwrap();
    // The mirror image may be met first.
    let first = points.iter().find(|point| point["kind"] == "fold").unwrap();
    let side = -first["parameter"].as_f64().unwrap().signum();
    let mut folds = points.iter().filter(|point| point["kind"] == "fold");
    for want in [-0.612021928121196, 0.606265086391384, -0.604399349559271] {
        let fold = folds.next().unwrap();
        let found = side * fold["parameter"].as_f64().unwrap();
        assert!((found - want).abs() < 3e-11, "{found} {want}");
        assert_eq!(fold["status"], "converged");
    }
    let text = place.read("out/branch.csv");
    assert_eq!(text.lines().next(), Some(COLUMNS));
    let table = Table::parse(&text);
    let column = |name: &str| table.column(name);
    let (p, x, z, residual) = (
        column("parameter"),
        column("x"),
        column("z"),
        column("residual"),
    );
    let (fx, fz, my) = (column("base_fx"), column("base_fz"), column("base_my"));
    let arclength = column("arclength");
    for i in 0..p.len() {
        assert!((x[i] - p[i]).abs() < 1e-8 && (z[i] - 0.6).abs() < 1e-8 && residual[i] < 1e-7);
        let size = 1.0 + fx[i].hypot(fz[i]);
        assert!(
            (my[i] - z[i] * fx[i] + x[i] * fz[i]).abs() < 1e-7 * size,
            "row {i}"
        );
        assert!(i == 0 || arclength[i] > arclength[i - 1], "row {i}");
    }
    let label = table.columns.len() - 1;
    for point in points {
        let mut rows = table
            .rows
            .iter()
            .filter(|row| row[label] == point["label"].as_str().unwrap());
        let row = rows.next().unwrap();
        assert_eq!(row[1].parse::<f64>().ok(), point["parameter"].as_f64());
        assert_eq!(row[2].parse::<f64>().ok(), point["arclength"].as_f64());
        assert!(rows.next().is_none());
    }
    let text = place.run(&["branch", "scene.toml", "--out", "out"]);
    assert_eq!((text.code, text.stderr.as_str()), (1, ""));
    assert!(text.stdout.contains(stop), "{}", text.stdout);
}

/// Catches a fold curve that leaves the folds, misses its cusps or stops at them. Every row is a fold of the closed
/// form of the planar elastica, and the cusps are those of the reference, known to 25 digits.
#[test]
fn fold_curves_are_those_of_the_elastica() {
    let place = Place::new("fold-curve");
    let scene = elastica(
        "to = -0.75\nmax_step = 0.3\nsecond = { parameter = \"end.position.z\", from = -0.2, to = 0.95, max_step = 0.1, points = 170 }",
    );
    let summary = run(&place, "branch", &scene).json(1);
    let points = summary["fold_curves"]["special_points"].as_array().unwrap();
    let cusps: Vec<&Value> = points
        .iter()
        .filter(|point| point["kind"] == "cusp")
        .collect();
    assert_eq!(cusps.len(), 2, "{points:?}");
    let data =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/folds.csv"));
    let data = data.unwrap();
    let rows = data.lines().filter(|line| line.starts_with("cusp,1,"));
    let mut count = 0;
    for row in rows {
        let field = |i: usize| row.split(',').nth(i).unwrap().parse::<f64>().unwrap();
        let (x, y) = (field(5), field(6));
        let at = |cusp: &&&Value| (cusp["second"].as_f64().unwrap() - x).abs() < 1e-10;
        let cusp = cusps.iter().find(at).unwrap();
        assert!(
            (cusp["parameter"].as_f64().unwrap().abs() - y.abs()).abs() < 1e-10,
            "{cusp}"
        );
        count += 1;
    }
    assert_eq!(count, 2);
    let table = Table::parse(&place.read("out/fold_curve.csv"));
    assert_eq!(
        table.columns[..4],
        ["curve", "parameter", "second", "arclength"]
    );
    let column = |name: &str| table.column(name);
    let (p, q, fx, fz) = (
        column("parameter"),
        column("second"),
        column("base_fx"),
        column("base_fz"),
    );
    let (qw, qy) = (column("qw"), column("qy"));
    let mut checked = 0;
    for i in 0..p.len() {
        let lambda = fx[i].hypot(fz[i]).sqrt();
        // Beyond this load rods have a tight loop, and wrench and angle of a row no longer determine the rod to 1e-6.
        if lambda > 15.0 {
            continue;
        }
        checked += 1;
        // kappa = sin((theta(1) - alpha)/2); the position of the end gives the sign.
        let alpha = f64::atan2(-fx[i], -fz[i]);
        let kappa = (qy[i].atan2(qw[i]) - 0.5 * alpha).sin();
        let fold = [kappa, -kappa].into_iter().any(|kappa| {
            let e = Equilibrium::from_lambda_kappa(lambda, kappa).unwrap();
            (e.x - q[i]).abs() < 1e-6
                && (e.y - p[i]).abs() < 1e-6
                && fold_distance(&e).unwrap().abs() < 1e-5
        });
        assert!(
            fold,
            "row {i}: ({}, {}), lambda {lambda}, kappa {kappa}",
            q[i], p[i]
        );
    }
    assert!(checked > 100, "only {checked} rows");
    // Very tight loops have an empty index: the next fold is too near to be distinguished.
    for (i, index) in table.texts("index").iter().enumerate() {
        let tight = fx[i].hypot(fz[i]) > 12.5 * 12.5;
        assert!(
            index == "0" || tight && index.is_empty(),
            "row {i}: {index}"
        );
    }
    assert!(place.files("out").contains(&"fold_curve.svg".to_owned()));
    let figure = place.read("out/fold_curve.svg");
    assert!(figure.contains("CP1") && figure.contains("end.position.z"));
}

/// Catches branches that are not switched at their branch points, or wrong ones: Euler's loads, and the post-buckled
/// cantilever of the tables on both sides.
#[test]
fn switching_follows_buckled_columns() {
    let place = Place::new("switch");
    let euler = 0.25 * PI * PI;
    let loads = [1.015396866, 1.518388793].map(|ratio| ratio * euler);
    let scene = stiff(
        [1.5, 1.0],
        0.8,
        &format!(
            "[end]\nforce = [0.0, 0.0, -1.0]\n[continue]\nparameter = \"end.load\"\nfrom = 0.0\nto = 12.0\nat = {loads:?}\nswitch = true"
        ),
    );
    let summary = run(&place, "branch", &scene).json(0);
    let points = summary["special_points"].as_array().unwrap();
    for (point, ratio) in points.iter().zip([1.0, 1.5]) {
        assert_eq!(point["kind"], "branch point");
        close(&point["parameter"], ratio * euler, 1e-10);
    }
    let table = Table::parse(&place.read("out/branch.csv"));
    let (branch, p) = (table.column("branch"), table.column("parameter"));
    let (x, z, index) = (table.column("x"), table.column("z"), table.column("index"));
    for (load, x1, z1) in [
        (loads[0], 0.2194130424, 0.9697309074),
        (loads[1], 0.7915394965, 0.3489893004),
    ] {
        let sides: Vec<f64> = (0..p.len())
            .filter(|&i| p[i] == load && branch[i] > 0.0 && (z[i] - z1).abs() < 2e-8)
            .map(|i| {
                assert_eq!(index[i], 0.0);
                x[i]
            })
            .collect();
        assert_eq!(sides.len(), 2, "load {load}");
        assert!((sides[0] + sides[1]).abs() < 1e-8 && (sides[0].abs() - x1).abs() < 2e-8);
    }
}

/// Catches a deflated search that finds nothing, finds the known branch again, or does not report its effort.
#[test]
fn deflation_finds_the_other_side() {
    let place = Place::new("deflate");
    let scene = stiff(
        [2.0, 1.0],
        0.8,
        "[end]\nposition = [0.3, 0.0, 0.6]\n[continue]\nparameter = \"end.position.x\"\nto = 0.1\npoints = 40\ndeflate = true",
    );
    let answer = run(&place, "branch", &scene);
    let summary: Value = serde_json::from_str(&answer.stdout).unwrap();
    assert!(
        summary["deflation"]["found"].as_u64().unwrap() >= 2,
        "{summary}"
    );
    let values = numbers::<5>(&summary["deflation"]["values"]);
    let remarks = summary["remarks"].to_string();
    for words in [
        "deflation found",
        "5 values of end.position.x",
        "there may be more",
    ] {
        assert!(remarks.contains(words), "{remarks}");
    }
    let table = Table::parse(&place.read("out/branch.csv"));
    let column = |name: &str| table.column(name);
    let (branch, p, energy) = (column("branch"), column("parameter"), column("energy"));
    let wrench = [
        "base_fx", "base_fy", "base_fz", "base_mx", "base_my", "base_mz",
    ]
    .map(column);
    for value in values {
        let here: Vec<usize> = (0..p.len()).filter(|&i| p[i] == value).collect();
        assert!(here.len() >= 2, "at {value}: {here:?}");
        for (k, &i) in here.iter().enumerate() {
            for &j in &here[..k] {
                let apart = wrench
                    .iter()
                    .map(|w| (w[i] - w[j]).powi(2))
                    .sum::<f64>()
                    .sqrt();
                assert!(
                    apart > 1e-4,
                    "branches {} and {} meet at {value}",
                    branch[i],
                    branch[j]
                );
            }
        }
    }
    // The other stable equilibrium in the plane.
    for value in values {
        let planar = equilibria_at(0.6, value, 8.0).unwrap();
        let stable: Vec<f64> = planar
            .iter()
            .filter(|e| e.stable())
            .map(|e| e.equilibrium.energy)
            .collect();
        assert_eq!(stable.len(), 2);
        for u in stable {
            let met = |i: usize| p[i] == value && (energy[i] - u).abs() < 1e-8;
            assert!((0..p.len()).any(met), "energy {u} at {value}");
        }
    }
}

/// Catches bad input that is accepted, panics or leaves files, and a message without the field, the admissible values
/// or advice.
#[test]
fn bad_statics_are_refused() {
    let place = Place::new("bad-statics");
    let cut = |from: &str, to: &str| {
        assert!(SAMPLE.contains(from), "{from}");
        SAMPLE.replacen(from, to, 1)
    };
    let load = "force = [1.0, -2.0, 0.5]\ncouple = [0.3, 0.2, -0.8]\n";
    let end = |lines: &str| cut(load, lines);
    let go = |lines: &str| format!("{SAMPLE}[continue]\n{lines}\n");
    let indefinite = "stiffness = [[1,0,0,0,0,0],[0,1,0,0,0,0],[0,0,1,0,0,20],[0,0,0,100,0,0],[0,0,0,0,100,0],[0,0,20,0,0,300]]\n";
    let law = "bending = [1.0, 1.5]\ntorsion = 0.7\nshear = [100.0, 120.0]              # \"rigid\" for unshearable\n\
               axial = 300.0                       # \"rigid\" for inextensible\n";
    let reach =
        "[end]\nposition = [0.3, 0.0, 0.6]\n[continue]\nparameter = \"end.position.z\"\nto = 1.0";
    let pose = |q: &str| end(&format!("position = [0.3, 0.0, 0.6]\nquaternion = {q}\n"));
    for (command, text, words) in [
        (
            "equilibrium",
            cut(law, indefinite),
            &["rod.section.stiffness", "positive definite", "not convex"][..],
        ),
        (
            "equilibrium",
            stiff([1.0, 1.0], 1.0, "[end]\nposition = [0.9, 0.0, 0.6]"),
            &["end.position", "nearer", "distance 1.08"],
        ),
        (
            "equilibrium",
            stiff([1.0, 1.0], 1.0, "[end]\nposition = [0.0, 0.0, 1.0]"),
            &["end.position", "taut", "a little inside"],
        ),
        (
            "equilibrium",
            cut("torsion = 0.7", "torsion = 0.0"),
            &["rod.section.torsion = 0.0", "> 0", "rigid"],
        ),
        (
            "equilibrium",
            pose("[2.0, 0.0, 0.0, 0.0]"),
            &["end.quaternion", "rotation", "its norm is 2", "divide"],
        ),
        (
            "equilibrium",
            pose("[0.0, 0.0, 0.0, 0.0]"),
            &["end.quaternion", "it is zero", "[1, 0, 0, 0]"],
        ),
        (
            "equilibrium",
            pose("[1.0, 0.0, 0.0]"),
            &["end.quaternion", "four finite numbers", "3 elements"],
        ),
        (
            "equilibrium",
            end("forse = [1, 0, 0]\n"),
            &["end.forse", "unknown", "did you mean `force`"],
        ),
        (
            "equilibrium",
            end("force = [nan, 0, 0]\n"),
            &["end.force[0] = nan", "finite"],
        ),
        (
            "equilibrium",
            end("force = [inf, 0, 0]\n"),
            &["end.force[0] = inf", "finite"],
        ),
        (
            "equilibrium",
            cut("length = 1.0", "length = -1.0"),
            &["rod.length = -1.0", "> 0"],
        ),
        (
            "equilibrium",
            end("position = [0.3, 0.0, 0.6]\nfollower = true\n"),
            &["end.follower", "false"],
        ),
        (
            "equilibrium",
            SAMPLE.split_once("[end]").unwrap().0.to_owned(),
            &["end: missing", "add `[end]`"],
        ),
        (
            "branch",
            SAMPLE.to_owned(),
            &["no [continue]", "parameter ="],
        ),
        (
            "branch",
            go("parameter = \"end.load\"\nfrom = 2\nto = 2"),
            &["continue.to = 2", "another number"],
        ),
        (
            "branch",
            go("parameter = \"end.lod\"\nto = 2"),
            &["continue.parameter", "end.load", "did you mean"],
        ),
        (
            "branch",
            go("parameter = \"end.position.x\"\nto = 2"),
            &["continue.parameter", "not held", "end.position"],
        ),
        (
            "branch",
            go("parameter = \"end.load\"\nto = 2\nstep = 0"),
            &["continue.step = 0", "(0, 1]"],
        ),
        (
            "branch",
            go("parameter = \"rod.length\"\nto = 0"),
            &["continue.to = 0", "> 0"],
        ),
        (
            "branch",
            stiff([1.0, 1.0], 1.0, reach),
            &["continue.to = 1.0", "nearer", "distance 1.04"],
        ),
        (
            "branch",
            go(
                "parameter = \"end.load\"\nto = 2\nsecond = { parameter = \"rod.section.torsion\", from = 1, to = 2 }",
            ),
            &["continue.second.from = 1", "0.7"],
        ),
    ] {
        let answer = run(&place, command, &text);
        let said = answer.refusal();
        for word in words {
            assert!(said.contains(word), "{word:?} not in {said}");
        }
        assert!(said.contains("scene.toml"), "{said}");
        assert_eq!(place.files("."), ["scene.toml"], "{said}");
    }
    place.write("file", "");
    place.write("scene.toml", &go("parameter = \"end.load\"\nto = 1.1"));
    for command in ["equilibrium", "branch"] {
        let answer = place.run(&[command, "scene.toml", "--out", "file/x"]);
        assert!(answer.refusal().contains("file/x") && answer.stderr.contains("--out"));
    }
    assert_eq!(place.files("."), ["file", "scene.toml"]);
}

/// Catches the refusal of a valid but unusual scene.
#[test]
fn odd_statics_are_solved() {
    let place = Place::new("odd-statics");
    let end = |lines: &str| format!("{}{lines}\n", SAMPLE.split_once("force").unwrap().0);
    let solved = |text: &str| run(&place, "equilibrium", text).json(0);
    // A quaternion with rounding in its norm; the end at the clamp; taut, stretched rods; an end that is free.
    let turned = "position = [0.3, 0.0, 0.6]\nquaternion = [1.000000001, 0.0, 0.0, 0.0]";
    near(
        numbers(&solved(&end(turned))["position"]),
        [0.3, 0.0, 0.6],
        1e-9,
    );
    let loop_ = solved(&end("position = [0.0, 0.0, 0.0]"));
    near(numbers(&loop_["position"]), [0.0, 0.0, 0.0], 1e-9);
    let taut = solved(&end("position = [0.0, 0.0, 1.1]"));
    near(numbers(&taut["base_force"]), [0.0, 0.0, 30.0], 1e-9);
    let free = solved(&end(""));
    near(numbers(&free["position"]), [0.0, 0.0, 1.0], 1e-12);
    assert_eq!(free["energy"], 0.0);
}

/// Catches a lost branch missing from the exit code or from the first line of the output: a round column of an assembly
/// has no isolated branch.
#[test]
fn a_lost_branch_is_an_exit_code_and_the_first_line() {
    let place = Place::new("lost-branch");
    let column = "[[rod]]\nname = \"column\"\nmodel = \"cosserat\"\nlength = 1.0\n\
                  section = { bending = [1.0, 1.0], torsion = 0.8 }\n\
                  from = { position = [0.0, 0.0, 0.0] }\nto = { body = \"top\" }\n\
                  [[body]]\nname = \"top\"\nforce = [0.0, 0.0, -1.0]\n\
                  [continue]\nparameter = \"body.top.force.z\"\nfrom = -0.5\nto = -3.0\nswitch = true\n";
    let summary = run(&place, "branch", column).json(1);
    assert_eq!(summary["complete"], false);
    let lost = summary["lost"][0].as_str().expect("what is lost");
    let told = place.run(&["branch", "scene.toml", "--out", "anew", "--no-figures"]);
    assert_eq!(told.code, 1, "{told:?}");
    assert_eq!(told.stdout.lines().next(), Some(&*format!("lost: {lost}")));
}
