//! Viscoelastic runs, error against time and nodes: `cargo bench --bench viscous`.
//!
//! Four tables: the planar reference (theory Sec. 5; its digits from an independent code) by tolerance and nodes, with
//! every method that the program and the user can choose; the cost of a right-hand side; a Kelvin-Voigt cantilever in
//! space over 100 oscillations; the three snaps of scenes/three_snaps.toml as the viscosity vanishes.

use nalgebra::{Matrix3, Vector1, Vector2, Vector3, Vector6};
use snaprod::body::{EndBody, PointMass, RigidBody, TimeLoad};
use snaprod::elastica::Equilibrium;
use snaprod::motion::viscoelastic::{Hold, ViscousRun, ViscousStart, ViscousSystem};
use snaprod::motion::{Event, Nodes, Options};
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Viscoelastic, Viscosity};
use snaprod::solve::integrator::Method;
use snaprod::solve::system::System;
use snaprod::viscoelastic::grid::Grid;
use snaprod::viscoelastic::kinematics::Kinematics;
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use snaprod::viscoelastic::reduced::Reduced;
use snaprod::viscoelastic::space::Space;
use std::sync::Arc;
use std::time::Instant;

/// Repetitions of a timing, of which the best counts.
const REPEATS: usize = 5;

fn bending(eta: f64) -> Material<1> {
    let rate = KelvinVoigt::new(Viscosity::diagonal([eta; 2], eta).unwrap());
    let elastic = Linear::diagonal([1.0; 2], 1.0).unwrap();
    let law = Viscoelastic::new(Arc::new(elastic), Arc::new(rate)).unwrap();
    Material::new(law, [0]).unwrap()
}

/// r and v at t = 3 of the reference.
fn reference() -> [f64; 4] {
    let path = format!(
        "{}/../tests/data/viscous_planar.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).expect("reference data");
    let data: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    let rows = data["runs"][0]["rows"].as_array().expect("rows");
    let last = rows.last().expect("a row");
    let number = |key: &str, i: usize| last[key][i].as_f64().expect("a number");
    [
        number("r", 0),
        number("r", 1),
        number("v", 0),
        number("v", 1),
    ]
}

fn finish<K, B, const M: usize, const D: usize>(run: &mut ViscousRun<'_, K, B, M, D>)
where
    K: Kinematics<M, D> + Clone,
    B: EndBody<D, Pose = K::Pose>,
{
    let outcome = run.by_ref().last();
    let Some(Event::Stop(outcome)) = outcome else {
        panic!("a run ends with a stop");
    };
    assert_eq!(outcome.key(), "end_of_time", "{outcome}");
}

fn planar() {
    println!(
        "planar reference to t = 3: error of r and v at the end, work, best time of {REPEATS}"
    );
    println!("tolerance  nodes      method    error     steps (implicit)  slopes   ms");
    let end = reference();
    let body = PointMass::new(1.0).unwrap();
    let choices = [
        (Nodes::Adaptive, Method::Auto),
        (Nodes::Fixed(12), Method::Auto),
        (Nodes::Fixed(16), Method::Auto),
        (Nodes::Fixed(24), Method::Auto),
        (Nodes::Fixed(32), Method::Auto),
        (Nodes::Fixed(24), Method::Implicit),
        (Nodes::Fixed(24), Method::Explicit),
    ];
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        for (nodes, method) in choices {
            if method == Method::Explicit && tolerance != 1e-10 {
                continue;
            }
            let options = Options::new(3.0)
                .and_then(|o| o.with_tolerance(tolerance))
                .unwrap()
                .with_nodes(nodes)
                .with_method(method);
            let start = ViscousStart {
                strain: &|s| Vector1::new(1.5 - 1.5 * s),
                relaxed: None,
                velocity: Vector2::new(0.0, -1.0),
            };
            let mut best = f64::INFINITY;
            let mut line = String::new();
            for _ in 0..if method == Method::Explicit {
                1
            } else {
                REPEATS
            } {
                let clock = Instant::now();
                let mut run = ViscousRun::new(Plane, bending(0.1), &body, &start, options).unwrap();
                finish(&mut run);
                best = best.min(clock.elapsed().as_secs_f64());
                let (now, work) = (run.now(), run.cost());
                let found = [now.pose.x, now.pose.y, now.velocity.x, now.velocity.y];
                let error = found
                    .iter()
                    .zip(end)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                line = format!(
                    "{error:.1e}  {:6} ({:5})    {:7}",
                    work.steps, work.implicit_steps, work.evaluations
                );
            }
            println!(
                "{tolerance:.0e}      {:9}  {method:?}  {line}  {:.1}",
                format!("{nodes:?}").to_lowercase(),
                1e3 * best
            );
        }
    }
}

/// Time of a slope and of a Jacobian with its two factors.
fn slopes() {
    println!("\nright-hand sides: microseconds");
    let body = PointMass::new(1.0).unwrap();
    for nodes in [16, 24, 48] {
        let rod = Reduced {
            kinematics: Plane,
            material: bending(0.1),
            grid: Arc::new(Grid::uniform(nodes)),
        };
        let strains: Vec<_> = rod
            .grid
            .nodes()
            .iter()
            .map(|s| Vector1::new(1.5 - s))
            .collect();
        let system = ViscousSystem::new(rod, &body, Hold::Place);
        let y = system.state(&strains, &[], &Vector2::new(0.1, -0.5));
        time_of(&format!("plane, {nodes} nodes"), &system, y);
    }
    let body = rigid();
    for nodes in [8, 16, 24] {
        let rod = Reduced {
            kinematics: Space::<3, 6>::new(),
            material: spatial(0.05),
            grid: Arc::new(Grid::uniform(nodes)),
        };
        let strains: Vec<_> = rod
            .grid
            .nodes()
            .iter()
            .map(|s| Vector3::new(0.3 + s, 0.5, 0.2 * s))
            .collect();
        let system = ViscousSystem::new(rod, &body, Hold::Place);
        let y = system.state(&strains, &[], &Vector6::repeat(0.1));
        time_of(
            &format!("space, 3 strains, welded, {nodes} nodes"),
            &system,
            y,
        );
    }
}

fn time_of<S: System>(name: &str, system: &S, mut y: nalgebra::DVector<f64>) {
    use snaprod::solve::system::Linearised;
    let mut out = y.clone();
    let best = |f: &mut dyn FnMut()| {
        let mut best = f64::INFINITY;
        for _ in 0..REPEATS {
            let clock = Instant::now();
            for _ in 0..200 {
                f();
            }
            best = best.min(clock.elapsed().as_secs_f64() / 200.0);
        }
        1e6 * best
    };
    let slope = best(&mut || system.slope(&y, &mut out).unwrap());
    system.settle(&mut y).unwrap();
    let balance = best(&mut || system.balance(&y, &mut out).unwrap());
    let jacobian = best(&mut || drop(system.linearised(&y).unwrap()));
    let linear = system.linearised(&y).unwrap();
    let real = best(&mut || drop(linear.shifted(30.0).unwrap()));
    let complex = best(&mut || drop(linear.shifted(nalgebra::Complex::new(30.0, 20.0)).unwrap()));
    println!(
        "{name}: explicit {slope:.2}, implicit {balance:.2}, Jacobian {jacobian:.1}, factors {real:.1} + {complex:.1}"
    );
}

fn spatial(eta: f64) -> Material<3> {
    let rate = KelvinVoigt::new(Viscosity::diagonal([eta, 1.3 * eta], 0.7 * eta).unwrap());
    let elastic = Linear::diagonal([1.0, 1.3], 0.7).unwrap();
    let law = Viscoelastic::new(Arc::new(elastic), Arc::new(rate)).unwrap();
    Material::new(law, [0, 1, 2]).unwrap()
}

fn rigid() -> RigidBody {
    RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.05, 0.04, 0.03)))
        .and_then(|b| b.with_centre(Vector3::new(0.05, 0.0, 0.1)))
        .unwrap()
}

/// 100 oscillations of a welded body on a Kelvin-Voigt cantilever; the slowest mode has a period of about 2 pi
/// sqrt(1/3).
fn cantilever() {
    println!("\nspatial cantilever, 16 nodes, tolerance 1e-8, 100 oscillations: seconds");
    let body = rigid();
    for eta in [0.1, 0.01, 0.001, 1e-4] {
        let options = Options::new(100.0 * 2.0 * std::f64::consts::PI / 3f64.sqrt())
            .and_then(|o| o.with_tolerance(1e-8))
            .unwrap()
            .with_nodes(Nodes::Fixed(16));
        let start = ViscousStart {
            strain: &|_| Vector3::new(0.0, 0.0, 0.0),
            relaxed: None,
            velocity: Vector6::new(0.1, -0.2, 0.3, 0.6, 0.3, 0.0),
        };
        // An inextensible straight rod admits no axial end velocity, so the start is slightly bent.
        let start = ViscousStart {
            strain: &|s| Vector3::new(0.2, 0.1 - 0.1 * s, 0.1),
            ..start
        };
        let clock = Instant::now();
        let mut run =
            ViscousRun::new(Space::<3, 6>::new(), spatial(eta), &body, &start, options).unwrap();
        let total = run.first().ledger.total();
        finish(&mut run);
        let work = run.cost();
        println!(
            "eta {eta:.0e}: {:.2} s, {} steps ({} implicit), {} slopes, ledger {:.1e}",
            clock.elapsed().as_secs_f64(),
            work.steps,
            work.implicit_steps,
            work.evaluations,
            (run.now().ledger.total() - total).abs()
        );
    }
}

/// The scene three_snaps.toml as eta -> 0.
fn vanishing() {
    println!("\nthree snaps as eta -> 0, tolerances 1e-8 and 1e-10: steps, slopes, seconds");
    let body = PointMass::new(1.0)
        .and_then(|b| b.with_dead_force(Vector2::new(-3.7, 0.0)))
        .and_then(|b| b.with_drag(8.0))
        .unwrap()
        .with_force(
            TimeLoad::sine(Vector2::new(0.0, 55.7), std::f64::consts::TAU * 0.119, 0.0).unwrap(),
        );
    let rest = Equilibrium::from_lambda_kappa(1.923538, 0.7583543).unwrap();
    for tolerance in [1e-8, 1e-10] {
        for eta in [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
            let options = Options::new(15.5)
                .and_then(|o| o.with_tolerance(tolerance))
                .unwrap();
            let start = ViscousStart {
                strain: &|s| Vector1::new(rest.section(s).unwrap().curvature),
                relaxed: None,
                velocity: Vector2::zeros(),
            };
            let clock = Instant::now();
            let mut run = ViscousRun::new(Plane, bending(eta), &body, &start, options).unwrap();
            finish(&mut run);
            let work = run.cost();
            println!(
                "tolerance {tolerance:.0e}, eta {eta:.0e}: {:6} ({:6} implicit), {:7}, {:.2}",
                work.steps,
                work.implicit_steps,
                work.evaluations,
                clock.elapsed().as_secs_f64()
            );
        }
    }
}

fn main() {
    // The tables named on the command line, or all.
    let named: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let parts: [(&str, fn()); 4] = [
        ("slopes", slopes),
        ("planar", planar),
        ("cantilever", cantilever),
        ("vanishing", vanishing),
    ];
    for (name, part) in parts {
        if named.is_empty() || named.iter().any(|n| n == name) {
            part();
        }
    }
}
