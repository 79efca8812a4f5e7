//! Cost of contact, as ratios within one run: `cargo bench --bench contacts`.
//!
//! A motion with an obstacle that nothing reaches over the same without one, in the plane and in space; and a ball that
//! bounces a thousand times.

use snaprod::scene::Scene;
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table};
use std::time::Instant;

/// Repetitions of a timing, of which the best counts.
const REPEATS: usize = 7;

const PLANE: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
[body]
mass = 1.0
[start]
lambda = 1.3241896270224394
p = -0.25
[loads]
dead = [-0.5, -0.3]
[run]
duration = 50.0
samples = 2
"#;
const SPACE: &str = r#"
[rod]
model = "cosserat"
length = 1.0
section = { bending = [1.0, 2.0], torsion = 0.8, shear = "rigid", axial = "rigid" }
[body]
mass = 1.0
inertia = [0.01, 0.01, 0.01]
[start]
equilibrium = { force = [-1.0, 0.3, 0.2] }
[run]
duration = 10.0
samples = 2
"#;
const BALL: &str = r#"
[[body]]
name = "ball"
solid = { ball = 0.2, density = 240.0 }
shape = "solid"
position = [0.0, 0.0, 1.1]
[loads]
gravity = [0.0, 0.0, -2.0]
[[obstacle]]
plane = { normal = [0.0, 0.0, 1.0] }
restitution = 1.0
[run]
duration = 2000.0
samples = 2
"#;

/// Seconds of the motion of a scene, and its events.
fn seconds(text: &str) -> (f64, usize) {
    let scene = Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}"));
    let prepared = Prepared::new(&scene).expect("a scene");
    let timed = (0..REPEATS).map(|_| {
        let mut tables: Vec<Table> = Vec::new();
        let from = Instant::now();
        let record = run(&prepared, Fields::None, &mut tables, &mut Silent).expect("a run");
        (from.elapsed().as_secs_f64(), record.events().len())
    });
    timed
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .expect("repetitions")
}

fn main() {
    for (name, text, far) in [
        (
            "plane",
            PLANE,
            "plane = { point = [0.0, -5.0], normal = [0.0, 1.0] }",
        ),
        (
            "space",
            SPACE,
            "plane = { point = [0.0, -5.0, 0.0], normal = [0.0, 1.0, 0.0] }",
        ),
    ] {
        let (bare, _) = seconds(text);
        let (among, _) = seconds(&format!("{text}\n[[obstacle]]\n{far}\n"));
        println!(
            "{name}: an obstacle that nothing reaches costs {:.3}",
            among / bare
        );
    }
    let (time, bounces) = seconds(BALL);
    println!("{bounces} bounces of a ball: {:.1} ms", 1e3 * time);
}
