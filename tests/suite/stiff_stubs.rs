//! Stubs: inextensible rods that hardly bend under their loads, practically rigid along themselves.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table};

const LENGTH: f64 = 0.05;
const MASS: f64 = 0.05;
const INERTIA: f64 = 1e-5;
const GRAVITY: f64 = 9.81;

/// Step limit for motions of less than a hundred slow periods; longer runs end there. With an axial force that
/// amplified the rounding of the end position these runs would have taken between 1e5 and 1e9 steps.
const STEPS: u64 = 3000;

/// Transverse position at time `t` of a cantilever's end of stiffness `b` under its load, started with the velocity
/// `v`: the two modes of small vibrations of mass and inertia on the compliance of a cantilever.
fn swung(b: f64, v: f64, t: f64) -> f64 {
    let compliance =
        Matrix2::new(LENGTH * LENGTH / 3.0, LENGTH / 2.0, LENGTH / 2.0, 1.0) * (LENGTH / b);
    let root = Matrix2::from_diagonal(&Vector2::new(MASS.sqrt(), INERTIA.sqrt()));
    let modes = SymmetricEigen::new(root * compliance * root);
    let begun = modes.eigenvectors.transpose() * (root * Vector2::new(v, 0.0));
    let now = Vector2::from_fn(|i, _| {
        let period = modes.eigenvalues[i].sqrt();
        begun[i] * period * (t / period).sin()
    });
    -MASS * GRAVITY * LENGTH.powi(3) / (3.0 * b) + (modes.eigenvectors * now)[0] / MASS.sqrt()
}

/// The stub as a rod alone and as an assembly.
fn stubs(b: f64, v: f64, tolerance: f64) -> [String; 2] {
    let rod = format!(
        "model = \"cosserat\"\nlength = {LENGTH}\nsection = {{ bending = [{b:e}, {b:e}], torsion = {b:e} }}\n"
    );
    let body = format!("mass = {MASS}\ninertia = [{INERTIA}, {INERTIA}, {INERTIA}]\n");
    let loads = format!("[loads]\ngravity = [-{GRAVITY}, 0.0, 0.0]\n");
    let run = format!(
        "[run]\nduration = 0.02\nsamples = 9\nmax_steps = {STEPS}\ntolerance = {tolerance:e}\n"
    );
    [
        format!(
            "[rod]\n{rod}[body]\n{body}{loads}[start]\nsettled = true\nvelocity = [{v}, 0.0, 0.0]\n{run}"
        ),
        format!(
            "[[rod]]\nname = \"r\"\n{rod}from = {{}}\nto = {{ body = \"m\" }}\n[[body]]\nname = \"m\"\n{body}velocity = [{v}, 0.0, 0.0]\n{loads}{run}"
        ),
    ]
}

/// Catches steps that follow the amplified rounding of the axial force, and a visible deviation of the stub: across
/// itself it agrees with the closed form, along itself it may yield by a tenth of the tolerance.
#[test]
fn stubs_swing_as_cantilevers_do() {
    for (b, v, tolerance) in [
        (6e3, 0.0, 1e-8),
        (60.0, 0.0, 1e-10),
        (60.0, 0.1, 1e-8),
        (60.0, 0.1, 1e-10),
        (0.8, 0.0, 1e-11),
    ] {
        for (k, text) in stubs(b, v, tolerance).iter().enumerate() {
            let mut tables: Vec<Table> = Vec::new();
            let scene = Scene::parse(text).unwrap_or_else(|why| panic!("{why}\n{text}"));
            let prepared = Prepared::new(&scene).unwrap();
            let record = run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
            let steps = record.branches[0].cost.steps;
            let names = match k {
                0 => ["x", "z"],
                _ => ["m.x", "m.z"],
            };
            let case = format!("{b:e}, {v}, {tolerance:e}, {k}");
            assert!(
                steps < STEPS && tables[0].reals("t").last() == Some(&0.02),
                "{case}: {steps} steps"
            );
            let table = &tables[0];
            let (times, [x, z]) = (table.reals("t"), names.map(|name| table.reals(name)));
            let size = swung(b, 0.0, 0.0).abs() + v * (MASS * LENGTH.powi(3) / (3.0 * b)).sqrt();
            for ((t, x), z) in times.iter().zip(x).zip(z) {
                let off = (x - swung(b, v, *t)).abs();
                assert!(
                    off < 30.0 * tolerance * LENGTH + 2e-6 * size,
                    "{case}: {x} at {t}, off by {off:e}"
                );
                let short = LENGTH - z;
                assert!(
                    short > -0.3 * tolerance * LENGTH && short < size * size / LENGTH,
                    "{case}: {short:e}"
                );
            }
        }
    }
}

/// Kinetic energy of a rod of rest curvature `k` whose end moves axially at the speed `v`. The rod is welded at its
/// base and ball-jointed at its end; all its parameters are 1 but `mass` and the axial stiffness `axial`. The axial
/// force changes at the rate N, and the transverse velocity is y_t:
/// ```text
/// y_t = N k (-3 s^2 + 5 s^3 - 2 s^4)/48,     v = N (k^2/320 + 1/axial).
/// ```
fn swayed(k: f64, v: f64, mass: f64, axial: f64) -> f64 {
    let rate = v / (k * k / 320.0 + 1.0 / axial);
    let square = (9.0 / 5.0 - 30.0 / 6.0 + 37.0 / 7.0 - 20.0 / 8.0 + 4.0 / 9.0) / 2304.0;
    0.5 * mass * (rate * k).powi(2) * square
}

/// Catches a nearly straight rod with mass that moves across itself by less than its end motion implies, as if its end
/// were on a slider. Catches a ledger that opens where the slider changes, or where the integration along the rod
/// loses the digits of its axial compliance. The kinetic energy is the closed form up to the square of the curvature,
/// for extensible and inextensible rods. The ledger closes to the tolerance over the shortening of the rod, down to a
/// shortening of 1e-9; below that rounding along the rod opens it.
#[test]
fn all_but_straight_rods_sway_as_their_ends_move() {
    for (k, axial) in [
        (0.03, f64::INFINITY),
        (0.045, f64::INFINITY),
        (0.045, 1e7),
        (0.045, 1e6),
        (0.045, 1e5),
    ] {
        for tolerance in [1e-7, 1e-8, 1e-9] {
            let stretch = if axial.is_finite() {
                format!(", axial = {axial:e}")
            } else {
                String::new()
            };
            let text = format!(
                "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = {{ bending = [1.0, 1.0], torsion = 1.0{stretch} }}\n\
                 rest = {{ curvature = [0.0, {k}] }}\nmass = 1e-3\ninertia = \"first-order\"\n[body]\nmass = 1.0\njoint = \"ball\"\n\
                 [start]\nsettled = true\nvelocity = [0.0, 0.0, -1.0]\n[run]\nduration = 0.003\nsamples = 7\ntolerance = {tolerance:e}\n"
            );
            let scene = Scene::parse(&text).unwrap_or_else(|why| panic!("{why}\n{text}"));
            let mut tables: Vec<Table> = Vec::new();
            let prepared = Prepared::new(&scene).unwrap();
            run(&prepared, Fields::None, &mut tables, &mut Silent).unwrap();
            let case = format!("{k}, {axial:e}, {tolerance:e}");
            let [kinetic, total] = ["rod_kinetic", "total"].map(|name| tables[0].reals(name));
            let off = kinetic[0] / swayed(k, 1.0, 1e-3, axial) - 1.0;
            assert!(off.abs() < 2.0 * k * k, "{case}: off by {off:e}");
            let first = total[0];
            let open = total.iter().map(|x| (x - first).abs()).fold(0.0, f64::max);
            let short = k * k / 24.0;
            let bound = tolerance / short * kinetic[0] + 1e-11;
            assert!(
                open < bound,
                "{case}: the ledger is open by {open:e} > {bound:e}"
            );
        }
    }
}

/// Catches an endless search, or a false equilibrium: two stubs that fit exactly between their clamps bear no
/// transverse load at their joint, because their force would have to be infinite.
#[test]
fn stubs_in_line_bear_no_load_across() {
    let rod = "model = \"cosserat\"\nlength = 0.05\nsection = { bending = [60.0, 60.0], torsion = 50.0 }\n";
    let text = format!(
        "[[rod]]\nname = \"a\"\n{rod}from = {{}}\nto = {{ body = \"p\" }}\n[[rod]]\nname = \"b\"\n{rod}from = {{ body = \"p\" }}\n\
         to = {{ position = [0.0, 0.0, 0.1] }}\n[[body]]\nname = \"p\"\nmass = {MASS}\ninertia = [{INERTIA}, {INERTIA}, {INERTIA}]\n\
         [loads]\ngravity = [-{GRAVITY}, 0.0, 0.0]\n[run]\nduration = 0.01\n"
    );
    let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}\n{text}"));
    let prepared = Prepared::new(&scene).expect("a scene that is understood");
    let refused = prepared.motion().map(drop).expect_err("no equilibrium");
    let said = refused.to_string();
    assert!(
        said.contains("drawn straight") && said.contains("rods that stretch"),
        "{said}"
    );
}
