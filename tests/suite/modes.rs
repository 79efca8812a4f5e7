//! Natural frequencies and mode shapes of scenes.

use crate::program::Place;
use crate::support::{frequencies, modes_of};
use nalgebra::{Complex, Vector2};
use snaprod::body::PointMass;
use snaprod::elastica::{Elastica, EndStiffness, equilibrium_under_load, fold_at};
use snaprod::motion::{Event, Options, Run};
use snaprod::study::ModesRecord;
use std::f64::consts::{FRAC_PI_2, TAU};

fn close(got: f64, want: f64, tolerance: f64) {
    let error = (got - want).abs();
    assert!(error <= tolerance * want.abs(), "{got:?}, want {want:?}");
}

/// Length 2, stiffness 5, mass 0.5; `more` follows in [start].
fn planar(more: &str) -> String {
    format!(
        "[rod]\nmodel = \"elastica\"\nlength = 2.0\nbending_stiffness = 5.0\n[body]\nmass = 0.5\n[run]\nduration = 1.0\n[start]\n{more}\n"
    )
}

/// The planar rod with equal bending stiffnesses, in space; its clamp points along x.
fn spatial(more: &str) -> String {
    format!(
        "[rod]\nmodel = \"cosserat\"\nlength = 2.0\nsection = {{ bending = [5.0, 5.0], torsion = 3.0 }}\n\
         [clamp]\nrotation = {{ axis = [0.0, 1.0, 0.0], angle = {FRAC_PI_2:?} }}\n\
         [body]\nmass = 0.5\njoint = \"ball\"\n[run]\nduration = 1.0\n[start]\n{more}\n"
    )
}

/// A uniform rod of mass 1 with the given body, as a single rod and as an assembly of one; `loads` act on the body.
fn with_mass(body: &str, loads: &str) -> [ModesRecord; 2] {
    let rod = "model = \"cosserat\"\nlength = 1.0\nmass = 1.0\ninertia = \"full\"\n\
               section = { bending = [1.0, 1.6], torsion = 1.0 }\nsection_inertia = [1e-11, 1e-11, 2e-11]\n";
    let body = format!("{body}\ninertia = [1e-11, 1e-11, 1e-11]\n");
    let rest = "[start]\nsettled = true\n[run]\nduration = 1.0\n";
    let alone = format!("[rod]\n{rod}[body]\n{body}[loads]\n{loads}\n{rest}");
    let chain = format!(
        "[[rod]]\nname = \"r\"\n{rod}from = {{ position = [0.0, 0.0, 0.0] }}\nto = {{ body = \"m\" }}\n\
         [[body]]\nname = \"m\"\n{body}{loads}\n{rest}"
    );
    [alone, chain].map(|text| modes_of(&text))
}

fn are_among(found: &ModesRecord, exact: &[[f64; 2]], tolerance: f64) {
    let found = found.motions.eigenvalues.as_deref().unwrap_or_default();
    for [re, im] in exact {
        let s = Complex::new(*re, *im);
        let near = |other: &Complex<f64>| (s - other).norm() < tolerance * s.norm();
        assert!(found.iter().any(near), "{s} among {found:?}");
    }
}

/// Catches stability of a single rod with mass judged by the symmetric part of its stiffness under a follower load,
/// and eigenvalues of too few vibrations. Beck's column flutters from P = 20.05 EI/L^2 on. For exact eigenvalues s the
/// ansatz w = sum c_k exp(k x), B k^4 + P k^2 + s^2 = 0, has det = 0. The conditions are w = w' = 0 at the clamp and
/// w'' = w''' = 0 at the end without a body (mpmath, 30 digits).
#[test]
fn becks_column_flutters() {
    let slow = [
        [0.0, 6.3706598618248],
        [0.0, 6.6274066834721],
        [0.0, 16.259829762528],
    ];
    let growing = [
        [0.83999916235143, 11.003221513342],
        [-0.83999916235143, 11.003221513342],
    ];
    for (load, flutters, exact) in [
        (15.0, false, &slow[..]),
        (20.0, false, &[]),
        (20.1, true, &[]),
        (20.2, true, &growing),
    ] {
        let force = format!(
            "force = {{ direction = [0.0, 0.0, -1.0], constant = {load:?}, follower = true }}"
        );
        for record in with_mass("mass = 1e-7", &force) {
            let motions = &record.motions;
            assert_eq!((motions.stable, motions.conservative), (!flutters, false));
            assert!(motions.modes.is_empty());
            are_among(&record, exact, 2e-6);
        }
    }
}

/// Catches eigenvalues of too few vibrations. A mass of 0.3 with drag 1.5 at the end gives w'' = 0 and B w''' = (0.3
/// s^2 + 1.5 s) w. The rod has B k^4 + s^2 = 0 (mpmath, 30 digits). With 24 vibrations the eigenvalues were off by
/// 4e-8.
#[test]
fn drag_at_the_end_of_a_rod_with_mass() {
    let exact = [
        [-1.3953297103019, 1.9147134858867],
        [-1.3911333333196, 2.6493336692566],
        [-0.40775674862962, 17.506207778915],
        [-0.41152151587695, 22.176381065249],
    ];
    for record in with_mass("mass = 0.3", "drag = 1.5") {
        assert!(record.motions.stable);
        are_among(&record, &exact, 5e-9);
    }
}

/// Catches a wrong stiffness across the straight rod, wrong scales, a second frequency along a rigid direction, and a
/// growth rate reported as a frequency. Closed forms of the beam under a pull N = b^2 EI/L^2 and a push, in the plane
/// and in space.
#[test]
fn a_mass_on_a_straight_rod() {
    let unit = 5.0 / (0.5 * 8.0);
    for (b, pulled) in [
        (0.0, true),
        (1e-4, true),
        (1.0, true),
        (12.0, true),
        (1e-3, false),
        (1.0, false),
        (1.5, false),
        (2.0, false),
    ] {
        let square: f64 = match (b, pulled) {
            // N b/(b - tanh b) has lost all digits near b = 0.
            (b, true) if b < 0.1 => 3.0 + 1.2 * b * b,
            (b, false) if b < 0.1 => 3.0 - 1.2 * b * b,
            (b, true) => b * b * b / (b - b.tanh()),
            (b, false) => b * b * b / (b.tan() - b),
        };
        let force = b * b * 5.0 / 4.0 * if pulled { 1.0 } else { -1.0 };
        let want = square.signum() * (unit * square.abs()).sqrt();
        let loads = format!("rest = \"straight\"\n[loads]\ndead = [{force:?}, 0.0]");
        let record = modes_of(&planar(&loads));
        assert!(record.of_start && record.remarks.is_empty());
        let motions = &record.motions;
        assert_eq!((frequencies(&record).len(), motions.rigid), (1, 1));
        close(frequencies(&record)[0], want, 1e-12);
        close(motions.modes[0].shape[1], 2f64.sqrt(), 1e-14);
        assert_eq!(
            (motions.stable, motions.index),
            (want > 0.0, usize::from(want < 0.0))
        );
        assert_eq!(motions.modes[0].period().is_some(), want > 0.0);
        if want > 0.0 {
            let loads = format!("settled = true\n[loads]\ndead = [{force:?}, 0.0, 0.0]");
            let record = modes_of(&spatial(&loads));
            assert_eq!((frequencies(&record).len(), record.motions.rigid), (2, 1));
            frequencies(&record)
                .into_iter()
                .for_each(|omega| close(omega, want, 1e-8));
        }
    }
    close(
        (1.0 / (1.0 - 1f64.tanh())).powi(2),
        4.19452805f64.powi(2),
        1e-8,
    );
}

/// Catches a wrong derivative of the elastica's force: the integrated rod in space has the same frequencies in the
/// plane, near the straight rod and far beyond Euler's load too, and the mode out of the plane.
#[test]
fn bent_rods_in_the_plane_and_in_space() {
    for load in [
        [0.0, -2.5],
        [0.01, 0.1],
        [-12.0, 0.5],
        [4.0, -7.0],
        [-40.0, -30.0],
    ] {
        let [x, y] = load;
        let flat = modes_of(&planar(&format!(
            "settled = true\n[loads]\ndead = [{x:?}, {y:?}]"
        )));
        let space = modes_of(&spatial(&format!(
            "settled = true\n[loads]\ndead = [{x:?}, {y:?}, 0.0]"
        )));
        assert!(flat.of_start && flat.motions.stable && space.motions.stable);
        let out = |shape: &[f64]| shape[2].abs() > 0.5;
        let inside: Vec<_> = space
            .motions
            .modes
            .iter()
            .filter(|mode| !out(&mode.shape))
            .collect();
        assert_eq!(inside.len(), 2);
        for (a, b) in flat.motions.modes.iter().zip(inside) {
            close(b.angular_frequency, a.angular_frequency, 1e-9);
            let apart = (a.shape[0] - b.shape[0]).hypot(a.shape[1] - b.shape[1]);
            assert!(apart < 1e-7, "{load:?}: {:?}, {:?}", a.shape, b.shape);
        }
    }
}

/// Catches loss of digits for nearly straight rods, which are nearly rigid axially. The slightly bent rod has the
/// transverse frequency of the straight one, up to the square of the deflection and rounding divided by it. No stable
/// rod is called unstable.
#[test]
fn next_to_the_straight_rod() {
    for across in [1e-2, 1e-3, 1e-4, 1e-5, 1e-7] {
        for along in [2.5, 0.0, -1.25] {
            let [straight, bent] = [0.0, across].map(|y| {
                let loads = format!("settled = true\n[loads]\ndead = [{along:?}, {y:?}]");
                let record = modes_of(&planar(&loads));
                assert!(record.motions.stable && record.of_start);
                frequencies(&record)[0]
            });
            let deflection = across / (0.5 * straight * straight) / 2.0;
            close(
                bent,
                straight,
                2.0 * deflection * deflection + 1e-14 / deflection,
            );
        }
    }
}

/// Catches a frequency that differs from the program's own motion: small oscillations along each mode about a bent
/// equilibrium, over 40 periods, whose frequency differs by the square of the amplitude.
#[test]
fn small_oscillations_of_a_run() {
    let text = "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\n[body]\nmass = 1.0\n[start]\nsettled = true\n\
                [loads]\ngravity = [-1.0, -2.0]\n[run]\nduration = 1.0\n";
    let record = modes_of(text);
    let load = Vector2::new(-1.0, -2.0);
    let at = equilibrium_under_load(&load).unwrap().unwrap();
    let body = PointMass::new(1.0).unwrap().with_gravity(load).unwrap();
    for mode in &record.motions.modes {
        let shape = Vector2::from_column_slice(&mode.shape);
        let rest = Vector2::new(at.x, at.y);
        let options = Options::new(41.0 * TAU / mode.angular_frequency).unwrap();
        let mut options = options.with_tolerance(1e-13).unwrap();
        options.max_steps = 100_000;
        let q = Vector2::new(at.p, at.w);
        let mut run = Run::new(&Elastica, &body, q, shape * 3e-5, options).unwrap();
        let (mut before, mut crossings) = (0.0, Vec::new());
        let mut last = 0.0;
        while let Some(event) = run.next() {
            let Event::Step { to, .. } = event else {
                continue;
            };
            let mut along = |t: f64| (run.sample(t).unwrap().pose - rest).dot(&shape);
            let now = along(to);
            if before < 0.0 && now >= 0.0 {
                let (mut low, mut high) = (last, to);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if along(middle) < 0.0 {
                        low = middle
                    } else {
                        high = middle
                    }
                }
                crossings.push(low);
            }
            (before, last) = (now, to);
        }
        assert!(crossings.len() >= 40, "{}", crossings.len());
        let periods = (crossings.len() - 1) as f64;
        let omega = TAU * periods / (crossings[crossings.len() - 1] - crossings[0]);
        close(mode.angular_frequency, omega, 1e-6);
    }
}

/// Catches drag with a wrong sign or scale, and a rotor that does work: a mode of the plane decays as an oscillator. A
/// rotor splits whirls but keeps the product of all eigenvalues, det K/det M.
#[test]
fn drag_and_rotors() {
    let drag = 0.3;
    let record = modes_of(&planar(&format!(
        "settled = true\n[loads]\ndead = [0.5, -2.5]\ndrag = {drag:?}"
    )));
    let eigenvalues = record.motions.eigenvalues.as_ref().unwrap();
    let omegas = frequencies(&record);
    assert!(omegas.len() == 2 && eigenvalues.len() == 2);
    for (s, omega) in eigenvalues.iter().zip(omegas) {
        close(s.re, -0.5 * drag / 0.5, 1e-13);
        close(s.norm(), omega, 1e-13);
    }
    let body = |rotor: f64, stretch: &str| {
        format!(
            "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.3], torsion = 0.7{stretch} }}\n[body]\nmass = 1.0\n\
             inertia = [0.02, 0.03, 0.04]\nrotor = [0.0, 0.0, {rotor:?}]\n[start]\nsettled = true\n[run]\nduration = 1.0\n"
        )
    };
    for stretch in ["", ", axial = 80.0"] {
        let slow = modes_of(&body(0.0, stretch));
        assert!(slow.motions.eigenvalues.is_none());
        let fast = modes_of(&body(0.4, stretch));
        let whirls = fast.motions.eigenvalues.as_ref().unwrap();
        assert_eq!(whirls.len(), frequencies(&slow).len());
        assert!(whirls.iter().all(|s| s.re.abs() < 1e-10));
        let product: f64 = whirls.iter().map(|s| s.norm()).product();
        close(product, frequencies(&slow).iter().product(), 1e-10);
    }
}

/// Catches modes about a start that is not an equilibrium, an ignored start that is one, and a frame that does not
/// turn with its clamp.
#[test]
fn which_equilibrium() {
    let load = "[loads]\ngravity = [0.0, -3.0]";
    let bent = modes_of(&planar(&format!("settled = true\n{load}")));
    // Held out of equilibrium, and moving.
    let begun = modes_of(&planar(&format!(
        "position = [1.6, 0.5]\nsheet = \"lowest\"\nvelocity = [0.0, 1.0]\n{load}"
    )));
    assert!(bent.of_start && !begun.of_start);
    assert!(
        begun.remarks[0].contains("is not an equilibrium"),
        "{:?}",
        begun.remarks
    );
    assert_eq!(begun.motions, bent.motions);
    let turned = modes_of(&planar(&format!(
        "settled = true\n[clamp]\nangle = {FRAC_PI_2:?}\n[loads]\ngravity = [3.0, 0.0]"
    )));
    for (a, b) in bent.motions.modes.iter().zip(&turned.motions.modes) {
        close(b.angular_frequency, a.angular_frequency, 1e-12);
        let across = a.shape[0] * b.shape[0] + a.shape[1] * b.shape[1];
        assert!(across.abs() < 1e-12, "{:?}, {:?}", a.shape, b.shape);
    }
    // An unstable equilibrium chosen by name, with its load given: the motion grows.
    let column = "rest = \"straight\"\n[loads]\ndead = [-4.0, 0.0]";
    assert_eq!(modes_of(&planar(column)).motions.index, 1);
    // Buckled to the side of its imperfection.
    let column = modes_of(&planar(
        "rest = \"straight\"\nimperfection = -0.01\n[loads]\ndead = [-4.0, 0.0]",
    ));
    let rod = &column.motions.rods[0];
    assert!(column.motions.stable && rod[rod.len() - 1].position.y < -0.5);
    let fold = fold_at(1, 1.0).unwrap().equilibrium;
    assert!(EndStiffness::at(fold.p, fold.w).is_err());
}

/// Catches files that differ from the printed text, a failing figure, and an accepted scene of statics.
#[test]
fn the_command_and_its_files() {
    let place = Place::new("modes");
    for (text, count) in [
        (planar("settled = true\n[loads]\ndead = [0.5, -2.5]"), 2),
        (
            spatial("settled = true\n[loads]\ndead = [0.5, -2.5, 0.3]"),
            3,
        ),
    ] {
        place.write("scene.toml", &text);
        let found = place
            .run(&["modes", "scene.toml", "--out", "out", "--json"])
            .json(0);
        assert_eq!(
            found["angular_frequencies"].as_array().unwrap().len(),
            count
        );
        assert_eq!(
            (&found["stable"], &found["index"]),
            (&true.into(), &0.into())
        );
        assert_eq!(place.json("out/summary.json"), found);
        assert_eq!(
            place.files("out"),
            ["modes.csv", "modes.svg", "summary.json"]
        );
        assert_eq!(place.read("out/modes.csv").lines().count(), 1 + count);
        let figure = place.read("out/modes.svg");
        // Skip the description for screen readers.
        let (_, figure) = figure.split_once("</desc>").unwrap();
        assert_eq!(figure.matches("mode ").count(), count);
    }
    place.write("statics.toml", "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n[end]\n");
    let answer = place.run(&["modes", "statics.toml"]);
    assert_eq!(answer.code, 2);
    assert!(answer.stderr.contains("scene of statics"), "{answer:?}");
}
