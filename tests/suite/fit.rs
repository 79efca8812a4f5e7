//! Fits of scenes to data: agreement with closed forms, unidentifiable parameters, refusals.

use nalgebra::DVector;
use snaprod::study::{Data, Fit, FitRecord, Silent, Sweep, Vary};

/// A cantilever with a heavy end: the transverse frequency is omega^2 = 3 EI/(m L^3).
const SWING: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
rest = "straight"
[run]
duration = 1.0
"#;

/// A bent rod with its end released.
const SCENE: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
lambda = 3.0
p = 0.5
[loads]
drag = 0.2
[run]
duration = 2.0
"#;

fn fit(scene: &str, data: &str, free: &[&str], given: &[&str], noise: &[(&str, f64)]) -> FitRecord {
    let names: Vec<String> = given.iter().map(|name| (*name).to_owned()).collect();
    let noise: Vec<(String, f64)> = noise.iter().map(|(n, x)| ((*n).to_owned(), *x)).collect();
    let free = free.iter().map(|text| Vary::free(text).unwrap()).collect();
    let data = Data::parse(data).unwrap();
    let fit = Fit::new(scene.to_owned(), Vec::new(), free, data, &names, &noise).unwrap();
    let found = (0..3).filter_map(|k| fit.search(&fit.start(k, 7), &mut Silent).unwrap());
    let found = found.collect();
    fit.best(found, 3, &mut Silent).unwrap()
}

/// Frequencies at five masses with explicit errors: omega = x g with x = sqrt(EI) is linear in x, so that the best x
/// and its standard error are those of a regression through the origin. Catches a wrong weight, Jacobian, variance or
/// degree of freedom.
#[test]
fn frequencies_give_the_stiffness_of_the_regression() {
    let errors = [0.011, -0.007, 0.004, -0.012, 0.009];
    let masses = [0.5, 1.0, 2.0, 3.0, 5.0];
    let length: f64 = 1.0;
    let g = masses.map(|m: f64| (3.0 / (m * length.powi(3))).sqrt());
    let omega: Vec<f64> = (0..5).map(|i| 1.3 * g[i] + errors[i]).collect();
    let (g, omega) = (DVector::from_row_slice(&g), DVector::from_vec(omega));
    let x = g.dot(&omega) / g.norm_squared();
    let variance = (&omega - &g * x).norm_squared() / 4.0;
    let error = (variance / g.norm_squared()).sqrt();
    let mut data = "body.mass,modes.angular_frequencies.0\n".to_owned();
    for (m, omega) in masses.iter().zip(&omega) {
        data += &format!("{m},{omega:.17}\n");
    }
    for range in [
        "rod.bending_stiffness=0.5:4",
        "rod.bending_stiffness=log:0.5:4",
    ] {
        let found = fit(SWING, &data, &[range], &["body.mass"], &[]);
        let stiffness = &found.parameters[0];
        assert!(
            (stiffness.value / (x * x) - 1.0).abs() < 1e-7,
            "{}",
            stiffness.value
        );
        // d EI = 2 x d x.
        let own = stiffness.standard_error.unwrap();
        assert!((own / (2.0 * x * error) - 1.0).abs() < 1e-5, "{own}");
        // Student's t for 4 degrees of freedom.
        let half = 2.776_445_105 * own;
        let [low, high] = stiffness.interval.unwrap();
        if range.contains("log") {
            let factor = (half / stiffness.value).exp();
            assert!((high / (stiffness.value * factor) - 1.0).abs() < 1e-6);
        } else {
            assert!(((high - low) / (2.0 * half) - 1.0).abs() < 1e-6);
        }
        assert_eq!(found.freedom, 4);
    }
    // With known noise the standard error follows from the noise, whatever the residual; a repeated measurement counts
    // twice.
    let twice = data.clone() + data.split_once('\n').unwrap().1;
    let noise = [("modes.angular_frequencies.0", 0.02)];
    let free = ["rod.bending_stiffness=0.5:4"];
    let found = fit(SWING, &twice, &free, &["body.mass"], &noise);
    let own = found.parameters[0].standard_error.unwrap();
    let expected = 2.0 * x * 0.02 / (2.0 * g.norm_squared()).sqrt();
    assert!((own / expected - 1.0).abs() < 1e-5, "{own}, {expected}");
    let square = 2.0 * (&omega - &g * x).norm_squared() / 0.02f64.powi(2);
    assert!((found.chi_squared.unwrap() / square - 1.0).abs() < 1e-6);
}

/// Catches false certainty: frequencies determine EI/m alone, and a range without the best value ends at its bound.
#[test]
fn what_the_data_do_not_tell_is_said() {
    let data = "modes.angular_frequencies.0\n1.9\n1.91\n1.92\n";
    let both = ["rod.bending_stiffness=0.5:4", "body.mass=0.5:2"];
    let found = fit(SWING, data, &both, &[], &[]);
    assert!(
        found
            .parameters
            .iter()
            .all(|one| one.standard_error.is_none())
    );
    assert!(
        found
            .remarks
            .iter()
            .any(|remark| remark.contains("do not separate")),
        "{:?}",
        found.remarks
    );
    let found = fit(SWING, data, &["rod.bending_stiffness=2:4"], &[], &[]);
    let one = &found.parameters[0];
    assert!(
        one.at_bound && one.value == 2.0 && one.interval.is_none(),
        "{one:?}"
    );
    assert!(
        found
            .remarks
            .iter()
            .any(|remark| remark.contains("end of its range"))
    );
}

/// Positions determine EI/m alone. Catches a rank decided below the accuracy of the differences, which gave errors of
/// 42511 in ranges of length 2. Catches remarks that name no fields or wrong ones, and a determined field called
/// undetermined.
#[test]
fn fields_that_a_motion_does_not_tell_apart_are_named() {
    let film = |bending: f64, loads: &str| {
        let scene = SCENE.replace("drag = 0.2", loads).replace(
            "bending_stiffness = 1.0",
            &format!("bending_stiffness = {bending}"),
        );
        let scene = snaprod::scene::Scene::parse(&scene).unwrap();
        let times: Vec<f64> = (0..=20).map(|k| 0.02 * f64::from(k)).collect();
        let table = snaprod::study::dispatch::samples(&scene, &times, &mut Silent).unwrap();
        let mut data = "t,x,y\n".to_owned();
        for (k, t) in times.iter().enumerate() {
            // Errors independent of every field.
            let [a, b] = [13.0, 7.0].map(|by| 4e-4 * (by * (k * k) as f64).sin());
            let [x, y] = ["x", "y"].map(|name| table.reals(name)[k]);
            data += &format!("{t:e},{:e},{:e}\n", x + a, y + b);
        }
        data
    };
    let bending = |range: &str| format!("rod.bending_stiffness={range}");
    let mass = "body.mass=0.5:2";
    let data = film(1.4, "gravity = [0.0, -1.0]");
    let scene = SCENE.replace("drag = 0.2", "gravity = [0.0, -1.0]");
    for (range, tolerance) in [
        ("0.5:3", 1e-9),
        ("0.01:100", 1e-9),
        ("log:0.1:10", 1e-6),
        ("0.5:3", 1e-4),
    ] {
        let scene = scene.replace(
            "duration = 2.0",
            &format!("duration = 2.0\ntolerance = {tolerance:e}"),
        );
        let found = fit(
            &scene,
            &data,
            &[&bending(range), mass, "loads.gravity.1=-3:0"],
            &[],
            &[],
        );
        let named = "do not separate the free fields rod.bending_stiffness, body.mass:";
        assert!(
            found.remarks.iter().any(|r| r.contains(named)),
            "{range}: {:?}",
            found.remarks
        );
        assert!(
            found
                .parameters
                .iter()
                .all(|one| one.standard_error.is_none())
        );
        let found = fit(
            &scene,
            &data,
            &[&bending(range), "loads.gravity.1=-3:0"],
            &[],
            &[],
        );
        assert!(
            found.parameters.iter().all(|one| one.interval.is_some()),
            "{range}: {:?}",
            found.remarks
        );
    }
    // The tolerance changes the numbers of the run, but cannot be fitted to data.
    let found = fit(
        &scene,
        &data,
        &[&bending("0.5:3"), "run.tolerance=log:1e-12:1e-9"],
        &[],
        &[],
    );
    let [stiffness, tolerance] = &found.parameters[..] else {
        panic!("{found:?}")
    };
    assert!(stiffness.interval.is_some() && tolerance.standard_error.is_none());
    assert!(
        found
            .remarks
            .iter()
            .any(|r| r.contains("do not determine run.tolerance")),
        "{:?}",
        found.remarks
    );
}

/// Catches a remark that asks for noise although the noise was given, with as many fields as numbers but an
/// undetermined combination; also a half-printed interval: in JSON an infinite end is null.
#[test]
fn as_many_fields_as_numbers_and_endless_intervals_are_told() {
    let (data, omega) = (
        "modes.angular_frequencies.0\n1.7\n1.71\n",
        "modes.angular_frequencies.0",
    );
    let both = ["rod.bending_stiffness=0.5:4", "body.mass=0.5:2"];
    for noise in [&[][..], &[(omega, 0.01)]] {
        let found = fit(SWING, data, &both, &[], noise);
        let said = |part: &str| found.remarks.iter().any(|remark| remark.contains(part));
        assert!(
            said("do not separate") && !said("--noise"),
            "{:?}",
            found.remarks
        );
    }
    let one = "modes.angular_frequencies.0\n1.7\n";
    let found = fit(SWING, one, &["rod.bending_stiffness=log:0.1:10"], &[], &[]);
    assert!(
        found
            .remarks
            .iter()
            .any(|r| r.contains("give it by --noise")),
        "{:?}",
        found.remarks
    );
    let found = fit(
        SWING,
        one,
        &["rod.bending_stiffness=log:0.1:10"],
        &[],
        &[(omega, 1e9)],
    );
    assert!(found.parameters[0].interval.is_none());
    assert!(
        found.remarks.iter().any(|r| r.contains("is not finite")),
        "{:?}",
        found.remarks
    );
}

/// A noiseless trajectory gives back its parameters, with missing cells and rows in any order: catches columns or rows
/// that are mixed up.
#[test]
fn a_trajectory_gives_back_what_made_it() {
    let noise = [("x", 1e-3), ("vy", 1e-3)];
    let scene =
        snaprod::scene::Scene::parse(&SCENE.replace("stiffness = 1.0", "stiffness = 1.7")).unwrap();
    let prepared = snaprod::study::run::Prepared::new(&scene).unwrap();
    let times: Vec<f64> = (0..21).map(|k| 0.03 * f64::from((8 * k) % 21)).collect();
    let table = snaprod::study::run::samples(&prepared, &times, &mut Silent).unwrap();
    let mut data = "# from above\nvy,t,x\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        let (vy, x) = (table.reals("vy")[k], table.reals("x")[k]);
        assert!((table.reals("t")[k] - t).abs() <= 1e-15);
        match k % 5 {
            2 => data += &format!(",{t:e},{x:e}\n"),
            3 => data += &format!("{vy:e},{t:e},nan\n\n"),
            _ => data += &format!("{vy:e},{t:e},{x:e}\n"),
        }
    }
    let free = ["rod.bending_stiffness=1:3", "loads.drag=log:0.05:0.5"];
    let found = fit(SCENE, &data, &free, &[], &[]);
    for (one, truth) in found.parameters.iter().zip([1.7, 0.2]) {
        assert!((one.value / truth - 1.0).abs() < 1e-6, "{one:?}");
    }
    // A drag whose range excludes the true value stays at its bound: stiffness and standard error are those for this
    // drag.
    let walled = fit(SCENE, &data, &[free[0], "loads.drag=0.3:0.5"], &[], &noise);
    let alone = fit(
        &SCENE.replace("drag = 0.2", "drag = 0.3"),
        &data,
        &free[..1],
        &[],
        &noise,
    );
    assert!(walled.parameters[1].at_bound && walled.parameters[1].interval.is_none());
    let [own, other] = [&walled, &alone].map(|found| &found.parameters[0]);
    assert!(
        (own.value / other.value - 1.0).abs() < 1e-6,
        "{own:?}, {other:?}"
    );
    let ratio = own.standard_error.unwrap() / other.standard_error.unwrap();
    assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    assert_eq!(
        found.columns[0].data.iter().filter(|x| x.is_nan()).count(),
        4
    );
    // Ends of searches that differ only by rounding count as one.
    assert_eq!(found.effort[..2], [3, 3]);
}

/// A sweep over a list as data, without the number of the point and the reason of a failed run.
fn measured(scene: &str, vary: &str, columns: &[&str]) -> String {
    let vary = vec![Vary::parse(vary).unwrap()];
    let names = [&[&*vary[0].path][..], columns].concat().join(",");
    let columns = columns.iter().map(|name| (*name).to_owned()).collect();
    let sweep = Sweep::new(scene.to_owned(), Vec::new(), vary, None, columns).unwrap();
    let rows = sweep.rows(0..sweep.points(), &mut Silent).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[1..cells.len() - 1].join(",") + "\n"
    };
    names + "\n" + &rows.lines().map(row).collect::<String>()
}

/// Catches an empty cell compared with the model: without a snap there is no snap time, in the measurement and in the
/// fit.
#[test]
fn what_was_not_measured_is_not_asked() {
    let snap = include_str!("../../scenes/snap.toml");
    let text = snap.replace("duration = 3.0", "duration = 0.2");
    let thrown = "start.velocity.1=[-0.5, -0.3, 0.5, 3.0]";
    let data = measured(&text, thrown, &["events.0.t", "end.x"]);
    let empty = data.lines().filter(|line| line.contains(",,"));
    assert_eq!(empty.count(), 1, "{data}");
    let found = fit(
        &text,
        &data,
        &["body.mass=0.7:1.4"],
        &["start.velocity.1"],
        &[],
    );
    let mass = &found.parameters[0];
    assert!((mass.value - 1.0).abs() < 1e-6, "{mass:?}");
}

/// Catches a field moved by rounding to an end of its range: a force in the plane of 2 and 3 has no effect on bending
/// out of it.
#[test]
fn a_field_on_which_nothing_depends_is_told() {
    let beam = r#"
[rod]
model = "cosserat"
length = 1.0
[rod.section]
bending = [1.0, 1.5]
torsion = 0.7
[end]
force = [0.0, -0.5, 0.0]
"#;
    let data = measured(
        beam,
        "end.force.1=[-2.0, -1.5, -1.0, -0.4]",
        &["position.1", "position.2"],
    );
    // An error in the data gives the fit room for improvement.
    let data = data.replacen("0.", "0.001", 1);
    let free = ["rod.section.bending.0=0.5:2", "rod.section.bending.1=0.5:2"];
    let found = fit(beam, &data, &free, &["end.force.1"], &[]);
    let [seen, unseen] = &found.parameters[..] else {
        panic!("{found:?}")
    };
    assert!(seen.standard_error.is_some(), "{seen:?}");
    // The path is the given name.
    assert_eq!(seen.path, "rod.section.bending.0");
    assert!(!unseen.at_bound && unseen.interval.is_none(), "{unseen:?}");
    let told = |remark: &String| remark.contains("do not determine rod.section.bending.1");
    assert!(found.remarks.iter().any(told), "{:?}", found.remarks);
}

/// Catches a missing number of the model used as if present: the differences were NaN, and the field was said to have
/// no effect.
#[test]
fn a_model_without_a_number_is_refused_by_row_and_column() {
    // Released straight under its load, the rod with friction starts far from equilibria; the row before has nothing
    // to compare.
    let scene =
        SWING.replace("[body]", "damping = 0.5\n[body]") + "[loads]\ngravity = [0.0, -1.0]\n";
    let data = Data::parse("t,lam,y\n0.01,,\n0.02,,0.0\n0.05,2.1,\n0.1,2.2,0.1\n").unwrap();
    let free = vec![Vary::free("body.mass=0.5:2").unwrap()];
    let fit = Fit::new(scene, Vec::new(), free, data, &[], &[]).unwrap();
    let found = fit.search(&fit.start(0, 0), &mut Silent).unwrap();
    assert!(found.is_none());
    let why = fit.best(Vec::new(), 1, &mut Silent).unwrap_err();
    let why = why.to_string();
    assert!(
        why.contains("row 3 of the data, t = 0.05") && why.contains("no number lam"),
        "{why}"
    );
}

/// Catches a message that does not name the faulty line, column or option.
#[test]
fn bad_data_are_refused_by_name() {
    let read = |text: &str| Data::parse(text).unwrap_err().to_string();
    let cases = [
        (read(""), "empty"),
        (read("1,2\n3,4\n"), "line of names"),
        (read("t,x\n"), "no rows"),
        (read("t,x,t\n0,1,2\n"), "two columns t"),
        (read("t,x\n0,1\n0.5\n"), "line 3"),
        (read("t,x\n0,one\n"), "x = one"),
    ];
    for (message, part) in cases {
        assert!(message.contains(part), "{message}");
    }
    // Numbers not read from text: with an infinite one the middle of a range was the best.
    let names = ["t", "x"].map(str::to_owned).to_vec();
    let rows = vec![vec![0.0, f64::NAN], vec![0.1, f64::NEG_INFINITY]];
    let message = Data::new(names, rows).unwrap_err().to_string();
    assert!(
        message.contains("row 2 of the data, x = -inf: must be finite"),
        "{message}"
    );
    let free = |text: &str| Vary::free(text).unwrap_err().to_string();
    for text in [
        "rod.length",
        "rod.length=1",
        "rod.length=2:1",
        "rod.length=1:2:3",
        "rod.length=[1, 2]",
        "rod.length=log:0:1",
    ] {
        let message = free(text);
        assert!(
            message.contains(&format!("--free {text}:")) && message.contains("PATH=FROM:TO"),
            "{message}"
        );
    }
    let message = free("run.samples=5:50");
    assert!(
        message.contains("run.samples is a whole number"),
        "{message}"
    );
    let made = |data: &str, free: &[&str], given: &[&str], noise: &[(&str, f64)]| {
        let names: Vec<String> = given.iter().map(|name| (*name).to_owned()).collect();
        let noise: Vec<(String, f64)> = noise.iter().map(|(n, x)| ((*n).to_owned(), *x)).collect();
        let free = free.iter().map(|text| Vary::free(text).unwrap()).collect();
        let data = Data::parse(data).unwrap();
        let fit = Fit::new(SCENE.to_owned(), Vec::new(), free, data, &names, &noise)?;
        let found = fit.search(&fit.start(0, 0), &mut Silent)?;
        fit.best(found.into_iter().collect(), 1, &mut Silent)
            .map(drop)
    };
    let one = ["rod.bending_stiffness=1:2"];
    let cases = [
        (made("t,x\n0,1\n", &[], &[], &[]), "--free"),
        (made("t,x\n0,1\n", &[one[0], one[0]], &[], &[]), "twice"),
        (made("t,x\n0,1\n", &one, &["x"], &[]), "--given x"),
        (made("x\n1\n", &one, &["y"], &[]), "--given y"),
        (
            made("t,x\n0,1\n", &one, &[], &[("x", -1.0)]),
            "--noise x=-1",
        ),
        (made("t,x\n0,1\n", &one, &[], &[("z", 1.0)]), "--noise z"),
        (
            made("t,x\n0,1\n", &one, &[], &[("t", 0.1)]),
            "--noise t=0.1: the column is not compared",
        ),
        (
            made(
                "body.mass,x\n1,1\n",
                &one,
                &["body.mass"],
                &[("body.mass", 0.1)],
            ),
            "--noise body.mass=0.1: the column is not compared",
        ),
        (
            made(
                "body.mass,x\n1,1\n",
                &["body.mass=1:2"],
                &["body.mass"],
                &[],
            ),
            "--given body.mass: the field is free",
        ),
        // An exactly fitted column would take all the weight.
        (
            made("t,x,y\n0,1,1\n0.1,,1\n", &one, &[], &[]),
            "--noise x=SIGMA",
        ),
        (made("t,x\n,1\n", &one, &[], &[]), "has no t"),
        (
            made("t,x\n0,1\n-0.1,1\n", &one, &[], &[]),
            "row 2 of the data, t = -0.1",
        ),
        (made("t\n1\n", &one, &[], &[]), "nothing to compare"),
        (made("t,x\n0,\n", &one, &[], &[]), "no number"),
        (
            made(
                "x\n1\n",
                &["rod.bending_stiffness=1:2", "body.mass=1:2"],
                &[],
                &[],
            ),
            "2 fields are free",
        ),
        (made("t,height\n0,1\n", &one, &[], &[]), "height"),
        (made("end.height\n1\n", &one, &[], &[]), "end.height"),
        (
            made("t,x\n0,1\n", &["rod.bending_stiffness=-2:-1"], &[], &[]),
            "bending_stiffness",
        ),
    ];
    for (result, part) in cases {
        let message = result.unwrap_err().to_string();
        assert!(message.contains(part), "{part}: {message}");
    }
    let bar = include_str!("../../scenes/heavy_bar.toml").to_owned();
    let free = vec![Vary::free("body.mass=0.5:2").unwrap()];
    let over_time = Data::parse("t,tip.x\n1,1.1\n2,1.2\n").unwrap();
    let refused = Fit::new(bar, Vec::new(), free, over_time, &[], &[]).unwrap_err();
    assert!(
        refused.to_string().contains("--given run.duration"),
        "{refused}"
    );
}

/// Catches missing files, an exit code that hides a refusal, and a free field that does not exist.
#[cfg(feature = "cli")]
#[test]
fn the_program_fits_and_refuses() {
    let place = crate::program::Place::new("fit");
    place.write("bent.toml", SCENE);
    let film = [
        "run.samples=9",
        "run.duration=0.4",
        "rod.bending_stiffness=1.2",
    ];
    let set: Vec<&str> = film.iter().flat_map(|text| ["--set", text]).collect();
    let run = [&["run", "bent.toml", "--out", "film"][..], &set].concat();
    place.run(&run).text();
    let table = crate::program::Table::parse(&place.read("film/trajectory.csv"));
    let [t, x, y] = ["t", "x", "y"].map(|name| table.texts(name));
    let mut film = "t,x,y\n".to_owned();
    for k in 0..t.len() {
        let x = if k == 3 { "" } else { &x[k] };
        film += &format!("{},{x},{}\n", t[k], y[k]);
    }
    place.write("film.csv", &film);
    let free = "rod.bending_stiffness=0.5:3";
    let answer = place.run(&[
        "fit",
        "bent.toml",
        "film.csv",
        "--free",
        free,
        "--starts",
        "2",
        "--noise",
        "x=1e-3",
    ]);
    let text = answer.text();
    assert!(
        text.contains("rod.bending_stiffness = 1.2, standard error")
            && text.contains("noise 1.00e-3 (given)"),
        "{text}"
    );
    assert_eq!(
        place.files("out/bent-fit"),
        ["curve.csv", "fit.csv", "fit.json", "fit.svg"]
    );
    let found: serde_json::Value =
        serde_json::from_str(&place.read("out/bent-fit/fit.json")).unwrap();
    assert_eq!(found["columns"][0]["points"], 8);
    let figure = place.read("out/bent-fit/fit.svg");
    assert!(figure.contains("measured") && figure.contains("data − model"));
    let refused = place.run(&[
        "fit",
        "bent.toml",
        "film.csv",
        "--free",
        "rod.stiffnes=0.5:3",
    ]);
    assert!(refused.refusal().contains("stiffnes"), "{refused:?}");
}

/// Young's modulus of aluminium rods between fixed grips, from three peak loads of a laboratory. Critical loads are E
/// p(L), so that the least squares are in closed form: P (1 - P/EA + P/GA) = 4 pi^2 EI/L^2, GA with the shear factor
/// 0.888641 (reference of acceptance-rods 26). Catches a branch fitted as one equilibrium, a branch point of another
/// row, and an interval of other degrees of freedom than two.
#[test]
fn buckling_loads_give_the_modulus() {
    let rod = r#"
units = "si"
[rod]
model = "cosserat"
length = 0.4981
material = { E = 68.947e9, nu = 0.33 }
section = { circle = { diameter = 0.00634 } }
[end]
position = [0.0, 0.0, "free"]
rotation = { axis = [0, 0, 1], angle = 0 }
force = [0.0, 0.0, -1.0]
[continue]
parameter = "end.force.z"
from = -400.0
to = -5000.0
step = 0.5
max_step = 0.5
"#;
    let data = "rod.length,continue.from,continue.to,BP1\n0.2412,-3600,-5000,-4352.15918\n\
                0.3412,-1800,-2500,-2117.97974\n0.4981,-840,-1200,-849.59418\n";
    let free = vec![Vary::free("rod.material.E=7e10:9e10").unwrap()];
    let given = ["rod.length", "continue.from", "continue.to"].map(str::to_owned);
    let data = Data::parse(data).unwrap();
    let fit = Fit::new(rod.to_owned(), Vec::new(), free, data, &given, &[]).unwrap();
    let found = fit.search(&fit.start(0, 0), &mut Silent).unwrap();
    let found = fit.best(found.into_iter().collect(), 1, &mut Silent);
    let modulus = &found.unwrap().parameters[0];
    let (value, error) = (80_125_390_732.045, 1_995_729_074.681_4);
    assert!((modulus.value / value - 1.0).abs() < 1e-9, "{modulus:?}");
    let sigma = modulus.standard_error.unwrap();
    assert!((sigma / error - 1.0).abs() < 1e-8, "{modulus:?}");
    // Student's t with two degrees of freedom: 0.95 sqrt(2/(1 - 0.95^2)).
    let t = 0.95 * (2.0 / (1.0 - 0.95f64.powi(2))).sqrt();
    let [low, high] = modulus.interval.unwrap();
    assert!(
        ((high - low) / (2.0 * t * error) - 1.0).abs() < 1e-8,
        "{modulus:?}"
    );
}
