//! Command line of `snaprod memory`.

use crate::program::{Place, Table, close, keys};
use crate::support::assert_close;
use serde_json::Value;

fn planar(length: f64, bending: f64, friction: &str) -> String {
    format!(
        "[rod]\nmodel = \"elastica\"\nlength = {length:?}\nbending_stiffness = {bending:?}\n{friction}\n[body]\nmass = 1.0\n\
         [start]\nlambda = 2.0\nkappa = 0.8\n[run]\nduration = 1.0\n"
    )
}

/// A rod in space with shear and stretch; `friction` and `rest` are lines of [rod] and of [rod.section].
fn spatial(friction: &str, rest: &str, joint: &str) -> String {
    format!(
        "units = \"si\"\n[rod]\nmodel = \"cosserat\"\nlength = 0.5\n{friction}\n[rod.section]\nbending = [1.0, 1.5]\n\
         torsion = 0.7\nshear = [50.0, 60.0]\naxial = 100.0\n{rest}\n[body]\nmass = 1.0\n{joint}\n[run]\nduration = 3.0\n"
    )
}

const WELD: &str = "inertia = [0.1, 0.1, 0.1]";
const BALL: &str = "joint = \"ball\"";

fn entry(object: &Value, matrix: &str, i: usize, j: usize) -> f64 {
    object[matrix][i][j].as_f64().unwrap()
}

/// Catches wrong numbers, and a table, figure or JSON file that disagrees with the printed text: the planar rod with a
/// branch is a spring, a dashpot and a Maxwell element in parallel.
#[test]
fn a_planar_rod_with_a_branch() {
    let place = Place::new("memory-planar");
    let friction = "damping = 0.1\nrelaxation = [{ stiffness = 1.0, time = 4.0 }]";
    place.write("scene.toml", &planar(1.0, 1.0, friction));
    let found = place
        .run(&["memory", "scene.toml", "--out", "out", "--json"])
        .json(0);
    keys(
        &found,
        &["units", "meaning", "accuracy", "directions", "times"],
    );
    assert_eq!(found["end"], "planar");
    assert_eq!(found["components"][0], "y");
    assert_eq!(
        (&found["memory"], &found["condition_6_15"]["holds"]),
        (&true.into(), &false.into())
    );
    for (matrix, want) in [("instantaneous", 0.3), ("glassy", 6.0), ("relaxed", 3.0)] {
        assert_close(entry(&found, matrix, 0, 0), want, 1e-12, 0.0, matrix);
    }
    let modes = found["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 1);
    close(&modes[0]["rate"], 0.25, 1e-12);
    close(&modes[0]["weight"][0][0], 3.0, 1e-11);
    close(&found["directions"][0]["forgotten"], 0.5, 1e-12);

    assert_eq!(
        place.files("out"),
        ["kernel.csv", "kernel.svg", "memory.json"]
    );
    let mut saved = place.json("out/memory.json");
    saved["out"] = found["out"].clone();
    assert_eq!(saved, found);
    assert!(place.read("out/kernel.svg").contains("relaxation R"));
    let table = Table::parse(&place.read("out/kernel.csv"));
    assert_eq!(table.columns, ["t", "R_yy", "k_yy", "J_yy"]);
    let column = |name: &str| table.column(name);
    let t = column("t");
    assert_eq!(t.len(), 201);
    // The relaxation lies between the first and the last time.
    assert!(t[0] <= 0.1 * (0.3 / 6.0) && t[200] >= 40.0);
    // J(p) = 1/(p (0.3 p + 3 + 12 p/(1 + 4 p))).
    let root = (24.3_f64 * 24.3 - 4.0 * 1.2 * 3.0).sqrt();
    let (p, q) = ((-24.3 - root) / 2.4, (-24.3 + root) / 2.4);
    let part = |p: f64, q: f64, t: f64| (1.0 + 4.0 * p) * (p * t).exp() / (p * 1.2 * (p - q));
    for (k, &t) in t.iter().enumerate() {
        let creep = 1.0 / 3.0 + part(p, q, t) + part(q, p, t);
        let fades = (-t / 4.0).exp();
        assert_close(column("R_yy")[k], 3.0 + 3.0 * fades, 1e-11, 0.0, "R");
        assert_close(column("k_yy")[k], 0.75 * fades, 1e-10, 0.0, "k");
        assert_close(column("J_yy")[k], creep, 1e-10, 1e-3, "J");
    }

    let answer = place.run(&["memory", "scene.toml"]);
    let text = answer.text();
    for part in ["does not hold", "the Maxwell branch relaxes", "0.25", "50%"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// Catches memory of a rod without any, a missing factor of length or stiffness, and columns of zeros: Kelvin-Voigt
/// alone, with linear and nonlinear friction.
#[test]
fn a_planar_rod_without_a_branch_is_a_spring_and_a_dashpot() {
    let place = Place::new("memory-kelvin-voigt");
    for friction in [
        "damping = 0.7",
        "damping = { viscosity = 0.7, exponent = 0.5, rate = 2.0 }",
    ] {
        place.write("scene.toml", &planar(2.0, 5.0, friction));
        let arguments = [
            "memory",
            "scene.toml",
            "--out",
            "out",
            "--from",
            "0.01",
            "--to",
            "7",
            "--points",
            "11",
        ];
        let answer = place.run(&arguments);
        let text = answer.text();
        for part in [
            "C L = L C(end) holds",
            "no memory",
            "n_y = 1.875 y + 0.2625 dy/dt",
            "11 times from 0.01 to 7",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert_eq!(text.contains("at rate zero"), friction.contains("rate"));
        let found = place.json("out/memory.json");
        assert_eq!(found["memory"], false);
        assert_eq!(found["friction_linearised"], friction.contains("rate"));
        assert_eq!(found["modes"].as_array().unwrap().len(), 0);
        let one = &found["directions"][0];
        close(&one["spring"], 15.0 / 8.0, 1e-13);
        close(&one["dashpot"], 2.1 / 8.0, 1e-13);
        close(&one["retardation_time"], 0.14, 1e-13);
        let table = Table::parse(&place.read("out/kernel.csv"));
        assert_eq!(table.columns, ["t", "R_yy", "J_yy"]);
        let t = table.column("t");
        assert_eq!((t.len(), t[0], t[10]), (11, 0.01, 7.0));
        for (t, creep) in t.iter().zip(table.column("J_yy")) {
            let want = 8.0 / 15.0 * -(-t / 0.14).exp_m1();
            assert_close(creep, want, 1e-12, 0.0, "J");
        }
        place.read("out/kernel.svg");
    }
}

/// Catches interchanged planes, signs or units in space. Flexure and shear of a welded rod have a closed form: one
/// exponential in each plane, (m, n) joined by the half length; twist and stretch have no memory.
#[test]
fn a_welded_rod_remembers_flexure_with_shear() {
    let place = Place::new("memory-weld");
    let friction = "damping = [0.1, 0.2, 0.05, 2.0, 3.0, 5.0]";
    place.write("scene.toml", &spatial(friction, "", WELD));
    let found = place
        .run(&["memory", "scene.toml", "--out", "out", "--json"])
        .json(0);
    assert_eq!(found["end"], "weld");
    assert_eq!(found["units"], "si");
    let length: f64 = 0.5;
    // Flexure u1 goes with the shear v2 in r2, u2 with v1 in r1.
    let mut rates = Vec::new();
    for (turn, shift, sign, a_b, b_b, a_s, b_s) in [
        (0, 4, 1.0, 0.1, 1.0, 3.0, 60.0),
        (1, 3, -1.0, 0.2, 1.5, 2.0, 50.0),
    ] {
        let cubed = length.powi(3) / 12.0;
        let at_once = (cubed / a_b + length / a_s).recip();
        let at_last = (cubed / b_b + length / b_s).recip();
        let entries = [(shift, shift, 1.0), (turn, shift, sign * 0.5 * length)];
        for (i, j, factor) in entries {
            for (matrix, want) in [("instantaneous", at_once), ("relaxed", at_last)] {
                assert_close(
                    entry(&found, matrix, i, j),
                    factor * want,
                    1e-12,
                    0.0,
                    matrix,
                );
            }
        }
        let turning = at_last * 0.25 * length * length + b_b / length;
        assert_close(
            entry(&found, "relaxed", turn, turn),
            turning,
            1e-12,
            0.0,
            "turning",
        );
        let (g_b, g_s) = (cubed / a_b, length / a_s);
        rates.push((b_s / a_s * g_b + b_b / a_b * g_s) / (g_b + g_s));
    }
    rates.sort_by(f64::total_cmp);
    let modes = found["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 2);
    for (mode, rate) in modes.iter().zip(rates) {
        close(&mode["rate"], rate, 1e-12);
    }
    for (k, memory) in [true, true, false, true, true, false].iter().enumerate() {
        assert_eq!(found["directions"][k]["memory"], *memory, "{k}");
    }
    close(&found["directions"][5]["spring"], 200.0, 1e-13);
    close(&found["directions"][5]["dashpot"], 10.0, 1e-13);
    let columns = Table::parse(&place.read("out/kernel.csv")).columns;
    let of = |f: char| columns.iter().filter(|name| name.starts_with(f)).count();
    assert_eq!((of('R'), of('k'), of('J')), (8, 6, 8), "{columns:?}");
    let answer = place.run(&["memory", "scene.toml"]);
    for part in [
        "10 N s/m",
        "N m s",
        "z1r2 13.3333 N,",
        "N s, z2r1 -",
        "largest at s =",
    ] {
        assert!(answer.text().contains(part), "{part}: {}", answer.stdout);
    }
}

/// Catches a verdict of memory if all strains retard alike, and couples at an end free to turn.
#[test]
fn a_ball_under_proportional_friction_has_no_memory() {
    let place = Place::new("memory-ball");
    let friction = "damping = { proportional = 0.05 }";
    place.write("scene.toml", &spatial(friction, "", BALL));
    let found = place.run(&["memory", "scene.toml", "--json"]).json(0);
    assert_eq!(found["end"], "ball");
    assert_eq!(found["components"].as_array().unwrap().len(), 3);
    assert_eq!(found["condition_6_15"]["holds"], true);
    for (k, spring) in [
        (0, (0.125 / 4.5 + 0.5 / 50.0_f64).recip()),
        (1, (0.125 / 3.0 + 0.5 / 60.0_f64).recip()),
        (2, 200.0),
    ] {
        let direction = &found["directions"][k];
        assert_eq!(direction["memory"], false);
        close(&direction["spring"], spring, 1e-12);
        close(&direction["retardation_time"], 0.05, 1e-12);
    }
    // A welded end carries couples too, coupled to the displacements.
    place.write("scene.toml", &spatial(friction, "", WELD));
    let answer = place.run(&["memory", "scene.toml"]);
    let spring = (0.125 / 12.0 / 1.5 + 0.5 / 50.0_f64).recip();
    let equation = answer
        .text()
        .lines()
        .find(|line| line.contains("n1 ="))
        .unwrap()
        .to_owned();
    assert!(
        equation.contains("equivalent") && equation.contains("- ") && equation.contains("dz2/dt")
    );
    let words: Vec<&str> = equation.split_whitespace().collect();
    let at = words.iter().position(|word| *word == "r1").unwrap();
    assert_close(words[at - 1].parse().unwrap(), spring, 1e-5, 0.0, "n1 / r1");
    // A branch in twist alone does not enter the memory of a ball-jointed end.
    let branch = "relaxation = [{ stiffness = [0.0, 0.0, 0.2, 0.0, 0.0, 0.0], time = 1.0 }]";
    for (joint, memory) in [(BALL, false), (WELD, true)] {
        let friction = format!("{friction}\n{branch}");
        place.write("scene.toml", &spatial(&friction, "", joint));
        let found = place.run(&["memory", "scene.toml", "--json"]).json(0);
        assert_eq!(found["memory"], memory, "{joint}");
        assert_eq!(found["condition_6_15"]["holds"], !memory, "{joint}");
    }
    // Nothing is written unless asked for.
    assert_eq!(place.files("."), ["scene.toml"]);
}

/// Catches a scene or option without a kernel that is accepted, and messages without advice.
#[test]
fn what_has_no_kernel_is_refused() {
    let place = Place::new("memory-refused");
    let damped = "damping = [0.1, 0.2, 0.05, 2.0, 3.0, 5.0]";
    let statics = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\n[rod.section]\nbending = [1.0, 1.0]\ntorsion = 1.0\n[end]\n\
                   force = [1.0, 0.0, 0.0]\n";
    for (scene, said) in [
        (planar(1.0, 1.0, ""), "write damping > 0"),
        (statics.to_owned(), "give [rod] damping"),
        (
            spatial(damped, "[rod.rest]\ncurvature = [0.3, 0.0]", WELD),
            "set rest curvature and twist to 0",
        ),
        (
            spatial(damped, "[rod.rest]\ntwist = 0.3", BALL),
            "must be straight",
        ),
        (planar(-1.0, 1.0, "damping = 0.1"), "rod.length"),
    ] {
        place.write("scene.toml", &scene);
        let answer = place.run(&["memory", "scene.toml", "--out", "out"]);
        assert!(answer.refusal().contains(said), "{}", answer.stderr);
    }
    place.write("scene.toml", &planar(1.0, 1.0, "damping = 0.1"));
    for (options, said) in [
        (["--from", "0"], "must be finite and > 0"),
        (["--to", "NaN"], "must be finite and > 0"),
        (["--from", "1e3"], "--from must be less than --to"),
        (["--points", "1"], "from 2 to 100000"),
    ] {
        let answer = place.run(&[
            "memory",
            "scene.toml",
            options[0],
            options[1],
            "--out",
            "out",
        ]);
        assert!(answer.refusal().contains(said), "{}", answer.stderr);
    }
    assert_eq!(place.files("."), ["scene.toml"]);
}
