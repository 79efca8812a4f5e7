//! Scaling of scenes between the user's units and the library's.

use proptest::prelude::*;
use snaprod::error::Quantity;
use snaprod::scene::{ElasticPlane, Force, History, InitialShape, Scene, Section, Sine, Units};
use std::path::Path;

fn scene_file(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Scene::read(&folder.join(format!("{name}.toml"))).unwrap_or_else(|error| panic!("{error}"))
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-14 * a.abs().max(b.abs()), "{a} {b}");
}

/// L = 0.5 m, EI = 0.02 N m^2, m = 0.05 kg by hand: L^2 = 1/4, L^3 = 1/8.
#[test]
fn si_scales() {
    let scene = scene_file("si");
    let scales = scene.scales().unwrap();
    close(scales.force, 0.08);
    close(scales.energy, 0.04);
    close(scales.time, 0.3125_f64.sqrt());
    close(scales.velocity, 0.8_f64.sqrt());
    close(scales.acceleration, 1.6);
    close(scales.drag, 0.08 / 0.8_f64.sqrt());
    let free = scene.dimensionless().unwrap();
    close(free.loads.gravity[1], -9.81 / 1.6);
    let duration = scene.run().unwrap().duration;
    close(
        scales.inward(Quantity::Time, duration),
        2.0 / 0.3125_f64.sqrt(),
    );
    let InitialShape::Position { position, .. } = free.start.place else {
        panic!()
    };
    close(position[0], 0.58);
    assert_eq!(Units::label("x", scene.units.length()), "x (m)");
    assert_eq!(Units::label("x", Units::Dimensionless.length()), "x");
}

fn with_units(length: f64, stiffness: f64, mass: f64, drag: f64) -> Scene {
    let mut scene = scene_file("forced");
    scene.rod.length = length;
    scene.rod.section = Section::Bending(stiffness);
    scene.body.as_mut().unwrap().mass = mass;
    scene.loads.gravity = [0.3, -9.81, 0.0];
    scene.loads.dead = [-2.0, 0.7, 0.0];
    scene.loads.drag = drag;
    scene.loads.force[0].direction = [1.0, 2.0, 0.0];
    sine(&mut scene.loads.force[0]).phase = 0.4;
    scene
}

fn sine(force: &mut Force) -> &mut Sine {
    match &mut force.size {
        History::Sine(sine) => sine,
        other => panic!("{other:?}"),
    }
}

/// The load on the mass at time t and velocity v, in the scene's own units.
fn load(scene: &Scene, t: f64, v: [f64; 2]) -> [f64; 2] {
    let mut force = scene.loads.force[0].clone();
    let direction = force.unit();
    let force = sine(&mut force);
    let angle = std::f64::consts::TAU * force.frequency * t + force.phase;
    std::array::from_fn(|i| {
        scene.body().unwrap().mass * scene.loads.gravity[i] + scene.loads.dead[i]
            - scene.loads.drag * v[i]
            + direction[i] * force.amplitude * angle.sin()
    })
}

proptest! {
    /// Newton's law holds in both systems of units: the acceleration by the loads, computed in the library's units and
    /// scaled back, is that computed in the user's. This couples the scales of force, time, velocity, acceleration and
    /// drag.
    #[test]
    fn newtons_law_scales(
        length in 1e-3..1e3_f64, stiffness in 1e-3..1e3_f64, mass in 1e-3..1e3_f64,
        drag in 0.0..10.0_f64, t in 0.0..3.0_f64, v in [-5.0..5.0_f64, -5.0..5.0_f64],
    ) {
        let mut scene = with_units(length, stiffness, mass, drag);
        scene.start.velocity = [v[0], v[1], 0.0];
        let scales = scene.scales().unwrap();
        let free = scene.dimensionless().unwrap();
        let theirs = load(&scene, t, v);
        let mut force = free.loads.force[0].clone();
        let direction = force.unit();
        let force = sine(&mut force);
        let angle = std::f64::consts::TAU * force.frequency * t / scales.time + force.phase;
        let [x, y, _] = direction.map(|c| c * force.amplitude * angle.sin());
        let size = theirs[0].hypot(theirs[1]) + 10.0 * drag + mass * 10.0 + 3.0;
        for (i, harmonic) in [x, y].into_iter().enumerate() {
            let ours = free.loads.gravity[i] + free.loads.dead[i] - free.loads.drag * free.start.velocity[i] + harmonic;
            // As a force, and as an acceleration of the user's mass.
            prop_assert!((ours * scales.force - theirs[i]).abs() < 1e-12 * size);
            let acceleration = ours * scales.length / scales.time.powi(2);
            prop_assert!((acceleration * mass - theirs[i]).abs() < 1e-12 * size);
        }
        // Kinetic and elastic energy on one scale; work and power likewise.
        close(scales.mass * scales.velocity.powi(2), scales.energy);
        close(scales.force * scales.length, scales.energy);
        close(scales.drag * scales.velocity.powi(2) * scales.time, scales.energy);
        close(scales.energy * length, stiffness);
    }

    /// A scene in centimetres, grams and milliseconds is the same without units.
    #[test]
    fn units_drop_out(length in 0.1..10.0_f64, stiffness in 0.1..10.0_f64, mass in 0.1..10.0_f64) {
        let si = with_units(length, stiffness, mass, 0.3);
        let (l, m, s) = (1e2, 1e3, 1e3);
        let force = m * l / (s * s);
        let mut other = with_units(length * l, stiffness * force * l * l, mass * m, 0.3 * m / s);
        other.start.velocity = si.start.velocity.map(|v| v * l / s);
        other.loads.gravity = si.loads.gravity.map(|g| g * l / (s * s));
        other.loads.dead = si.loads.dead.map(|f| f * force);
        sine(&mut other.loads.force[0]).amplitude *= force;
        sine(&mut other.loads.force[0]).frequency /= s;
        let (a, b) = (si.dimensionless().unwrap(), other.dimensionless().unwrap());
        for i in 0..2 {
            close(a.start.velocity[i], b.start.velocity[i]);
            close(a.loads.gravity[i], b.loads.gravity[i]);
            close(a.loads.dead[i], b.loads.dead[i]);
        }
        close(a.loads.drag, b.loads.drag);
        let [one, two] = [a, b].map(|mut free| *sine(&mut free.loads.force[0]));
        close(one.amplitude, two.amplitude);
        close(one.frequency, two.frequency);
    }
}

/// A tilted and moved clamp is equivalent to a world turned and moved the other way. Catches a start, velocity or load
/// rotated into the frame of the clamp the wrong way, and an omitted clamp motion.
#[test]
fn a_tilted_clamp_is_a_turned_world() {
    let text = |start: &str, clamp: &str, gravity: [f64; 2]| {
        format!(
            "[rod]\nmodel = 'elastica'\nlength = 2.0\nbending_stiffness = 3.0\n[body]\nmass = 0.5\n[start]\n{start}\n\
             [loads]\ngravity = {gravity:?}\n[run]\nduration = 1.0\n[clamp]\n{clamp}"
        )
    };
    let setup = |text: &str| ElasticPlane::new(&Scene::parse(text).unwrap()).unwrap();
    let (sin, cos) = 0.4_f64.sin_cos();
    let outward = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
    let ([x, y], velocity, gravity) = ([1.2, 0.7], [0.3, -0.2], [0.5, -4.0]);
    let [a, b] = outward([x, y]);
    let tilted = format!(
        "position = [{:?}, {:?}]\nsheet = 'lowest'\nvelocity = {:?}",
        a + 0.1,
        b - 0.3,
        outward(velocity)
    );
    let tilted = setup(&text(
        &tilted,
        "position = [0.1, -0.3]\nangle = 0.4",
        outward(gravity),
    ));
    let plain = format!("position = [{x}, {y}]\nsheet = 'lowest'\nvelocity = {velocity:?}");
    let plain = setup(&text(&plain, "", gravity));
    let [p, q] = [&tilted, &plain].map(|setup| setup.start.as_ref().unwrap().p);
    assert!((p - q).abs() < 1e-12 * q.abs());
    assert!((tilted.velocity - plain.velocity).norm() < 1e-14);
    assert!((tilted.body.load(0.0) - plain.body.load(0.0)).norm() < 1e-13);

    // Shaken along y with amplitude 0.1 at 2 Hz, the clamp leaves at 0.4 pi, and the body at rest stays behind.
    let shaken = "motion = { translate = { direction = [0, 2], amplitude = 0.1, frequency = 2 }, turn = { rate = 0.5 } }";
    let start = "position = [1.2, 0.7]\nsheet = 'lowest'";
    let shaken = setup(&text(start, shaken, gravity));
    let scale = (3.0_f64 / (0.5 * 2.0)).sqrt();
    let wanted = [0.5 * y, -0.4 * std::f64::consts::PI - 0.5 * x].map(|v| v / scale);
    for (v, wanted) in shaken.velocity.iter().zip(wanted) {
        assert!((v - wanted).abs() < 1e-12, "{}", shaken.velocity);
    }
}

/// Catches times changed by rounding in the conversion to units of the rod and back: 0.049999999999999996 in place of
/// 0.05.
#[test]
fn times_are_those_that_were_asked_for() {
    use snaprod::study::{Silent, Table, run};
    for rod in ["", "damping = 0.01\n"] {
        for stiffness in [0.3, 0.7, 1.1] {
            let text = format!(
                "[rod]\nmodel = \"elastica\"\nlength = 1.3\nbending_stiffness = {stiffness}\n{rod}[body]\nmass = 0.7\n\
                 [start]\nposition = [0.9, 0.5]\nsheet = 'lowest'\n[run]\nduration = 0.05\nsamples = 8\n"
            );
            let scene = Scene::parse(&text).unwrap_or_else(|faults| panic!("{faults}"));
            let prepared = run::Prepared::new(&scene).expect("a scene that runs");
            let mut tables: Vec<Table> = Vec::new();
            run::run(&prepared, run::Fields::None, &mut tables, &mut Silent).expect("a record");
            let asked: Vec<f64> = (0..8).map(|k| 0.05 * (f64::from(k) / 7.0)).collect();
            assert_eq!(tables[0].reals("t"), asked, "{stiffness} {rod}");
        }
    }
}
