//! Instructions per kernel under callgrind, compared with a snapshot: `cargo bench --bench instructions` fails if a
//! kernel takes 5 % more than benches/instructions.json; `-- renew` rewrites the file.
//!
//! Counts do not depend on the load of the machine. They depend on the compiler, its checks and the registers of the
//! processor: the file has counts by all three, and only equal combinations are compared. Valgrind does not show
//! 512-bit registers, so gains from them are not measured.

use nalgebra::{DVector, Vector1, Vector2, Vector6};
use serde_json::{Map, Value, json};
use snaprod::bar::{Bar, BarMotion as _, End, FiniteVolumes, Material as Stuff, Stress};
use snaprod::body::{History, PointMass};
use snaprod::elastica::{Elastica, LightRod, equilibria_at};
use snaprod::manifold::{EquilibriumManifold, Multivalued, invert_near};
use snaprod::math::jacobi::sn_cn_dn;
use snaprod::math::registers::Width;
use snaprod::motion::viscoelastic::{Hold, ViscousSystem};
use snaprod::motion::{Event, Options, Run};
use snaprod::rod::Rod;
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Viscoelastic, Viscosity};
use snaprod::solve::system::System;
use snaprod::viscoelastic::grid::Grid;
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use snaprod::viscoelastic::reduced::Reduced;
use std::hint::black_box;
use std::process::{Command, ExitCode};
use std::sync::Arc;

/// Runs a prepared kernel; returns the number of repetitions.
type Work = Box<dyn FnMut() -> u64>;

/// Kernel name, and preparation, which is not counted.
type Kernel = (&'static str, fn() -> Work);

const KERNELS: [Kernel; 9] = [
    ("chart point with first derivatives", chart_point),
    (
        "planar right-hand side with its share of the integrator",
        right_hand_side,
    ),
    ("the same with the rod's mass to first order", first_order),
    ("sn, cn, dn", jacobi),
    ("warm inversion", inversion),
    ("all equilibria at a point", equilibria),
    ("end of a rod with its tangent", rod_end),
    ("viscoelastic right-hand side, 24 nodes", viscous),
    ("finite volumes, a cell and a step", volumes),
];
/// Largest accepted relative growth of a count.
const LOSS: f64 = 0.05;

fn main() -> ExitCode {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    match asked.iter().position(|word| word == "count") {
        Some(i) => count(&asked[i + 1]),
        None => held(asked.iter().any(|word| word == "renew")),
    }
}

/// Runs a kernel once to warm up and once to be counted; prints the number of repetitions and the registers used.
fn count(index: &str) -> ExitCode {
    let index: usize = index.parse().expect("the number of a kernel");
    let mut work = KERNELS[index].1();
    work();
    println!("{} {}", counted(&mut work), Width::in_use().name());
    ExitCode::SUCCESS
}

/// Callgrind counts while this function runs.
#[inline(never)]
fn counted(work: &mut Work) -> u64 {
    black_box(work())
}

/// Counts all kernels; compares with the snapshot or renews the file.
fn held(renew: bool) -> ExitCode {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/instructions.json");
    let text = std::fs::read_to_string(path).expect("benches/instructions.json");
    let mut snapshots: Map<String, Value> = serde_json::from_str(&text).expect("a JSON object");
    let Some(version) = printed(Command::new("valgrind").arg("--version")) else {
        println!("skipped: there is no valgrind");
        return ExitCode::SUCCESS;
    };
    let mut found = Map::new();
    let mut setting = String::new();
    for (i, (name, _)) in KERNELS.iter().enumerate() {
        let (each, registers) = under_callgrind(i);
        setting = registers;
        found.insert((*name).to_owned(), json!(each));
    }
    let compiler = printed(Command::new("rustc").arg("--version")).expect("a compiler");
    let checks = if cfg!(debug_assertions) {
        ", with checks"
    } else {
        ""
    };
    let key = format!("{compiler}, {} {setting}{checks}", std::env::consts::ARCH);
    println!("{key} ({version})");
    let was = snapshots.get(&key).cloned();
    let mut lost = false;
    for (name, _) in KERNELS {
        let now = found[name].as_f64().expect("a count");
        let before = was.as_ref().and_then(|was| was[name].as_f64());
        let change = before.map_or(String::new(), |before| {
            let worse = now > (1.0 + LOSS) * before;
            lost |= worse;
            let word = if worse { ", more than is allowed" } else { "" };
            format!(" ({:+.1} %{word})", 100.0 * (now / before - 1.0))
        });
        println!("{now:>12.1} {name}{change}");
    }
    if renew {
        snapshots.insert(key, Value::Object(found));
        let text = serde_json::to_string_pretty(&snapshots).expect("JSON");
        std::fs::write(path, text + "\n").expect("the snapshot");
    } else if was.is_none() {
        let known: Vec<&String> = snapshots.keys().collect();
        println!("not compared: the snapshot has counts of {known:?}; `-- renew` adds these");
    } else if lost {
        println!(
            "a kernel takes more than {:.0} % more instructions; if it must, `-- renew`",
            100.0 * LOSS
        );
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Standard output of a program that succeeds; `None` after a failure.
fn printed(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Instructions per repetition of a kernel, to a tenth, and the registers available.
fn under_callgrind(kernel: usize) -> (f64, String) {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg("--toggle-collect=*instructions*counted*")
        .arg(std::env::current_exe().expect("this program"))
        .args(["count", &kernel.to_string()])
        .output()
        .expect("valgrind runs");
    let (said, told) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    let collected = told
        .lines()
        .find_map(|line| line.split_once("Collected : "));
    let collected = collected.and_then(|(_, number)| number.trim().parse::<f64>().ok());
    let (Some(collected), Some((times, registers))) = (collected, said.trim().split_once(' '))
    else {
        panic!(
            "callgrind says nothing of {}: {said}{told}",
            KERNELS[kernel].0
        );
    };
    let times: f64 = times.parse().expect("how often");
    (
        (10.0 * collected / times).round() / 10.0,
        registers.to_owned(),
    )
}

fn chart_point() -> Work {
    Box::new(|| {
        const POINTS: u64 = 2000;
        for i in 0..POINTS {
            let q = Vector2::new(0.2 + 1e-3 * i as f64, 1.0 + 1e-3 * i as f64);
            let _ = black_box(Elastica.point(black_box(&q)));
        }
        POINTS
    })
}

/// Motion W over three units of time.
fn motion(body: PointMass<2>) -> Work {
    let q = Elastica.stable_at(&Vector2::new(-0.2, 0.5)).unwrap()[0];
    let options = Options::new(3.0).unwrap().with_tolerance(1e-10).unwrap();
    Box::new(move || {
        let mut run = Run::new(&Elastica, &body, q, Vector2::zeros(), options).unwrap();
        while !matches!(run.next(), Some(Event::Stop(_))) {}
        run.cost().evaluations
    })
}

fn loaded() -> PointMass<2> {
    let body = PointMass::new(1.0).unwrap();
    body.with_dead_force(Vector2::new(-8.0, -2.0)).unwrap()
}

fn right_hand_side() -> Work {
    motion(loaded())
}

fn first_order() -> Work {
    motion(loaded().with_rod(Arc::new(LightRod {
        mass: 0.05,
        gravity: Vector2::zeros(),
    })))
}

fn jacobi() -> Work {
    Box::new(|| {
        const POINTS: u64 = 6000;
        for kc in [0.9, 0.5, 0.1, 1e-2, 1e-4, 1e-8] {
            for i in 0..POINTS / 6 {
                let _ = black_box(sn_cn_dn(black_box(6e-3 * i as f64), black_box(kc)));
            }
        }
        POINTS
    })
}

fn inversion() -> Work {
    let q = Vector2::new(0.7, 2.2);
    let at = Elastica.point(&q).unwrap().pose;
    Box::new(move || {
        const POINTS: u64 = 300;
        for i in 0..POINTS {
            let pose = at + Vector2::new(1e-5 * i as f64, -1e-5 * i as f64);
            let _ = black_box(invert_near(
                &Elastica,
                black_box(&pose),
                black_box(&q),
                1e-13,
            ));
        }
        POINTS
    })
}

fn equilibria() -> Work {
    let points = [
        (0.3, -0.5),
        (0.5, 0.0),
        (-0.3, 0.0),
        (0.9, 0.0),
        (0.1, -0.14),
    ];
    Box::new(move || {
        for (x, y) in points {
            let _ = black_box(equilibria_at(black_box(x), black_box(y), 14.0));
        }
        points.len() as u64
    })
}

fn rod_end() -> Work {
    let law = Linear::diagonal([1.0, 1.5], 0.7)
        .and_then(|law| law.with_shear([100.0, 120.0]))
        .and_then(|law| law.with_axial(300.0));
    let rod = Rod::new(1.0, law.unwrap()).unwrap();
    let base = Vector6::new(1.66, 0.96, -0.48, 1.0, -2.0, 0.5);
    Box::new(move || {
        const ENDS: u64 = 50;
        for _ in 0..ENDS {
            let _ = black_box(rod.end(black_box(&base), 1e-10));
        }
        ENDS
    })
}

fn viscous() -> Work {
    let rate = KelvinVoigt::new(Viscosity::diagonal([0.1; 2], 0.1).unwrap());
    let elastic = Linear::diagonal([1.0; 2], 1.0).unwrap();
    let law = Viscoelastic::new(Arc::new(elastic), Arc::new(rate)).unwrap();
    let material = Material::new(law, [0]).unwrap();
    let body = PointMass::new(1.0).unwrap();
    Box::new(move || {
        const SLOPES: u64 = 200;
        let system = ViscousSystem::new(
            Reduced {
                kinematics: Plane,
                material: material.clone(),
                grid: Arc::new(Grid::uniform(24)),
            },
            &body,
            Hold::Place,
        );
        let strain = |s: &f64| Vector1::new(1.5 - s);
        let strains: Vec<_> = system.rod.grid.nodes().iter().map(strain).collect();
        let y = system.state(&strains, &[], &Vector2::new(0.1, -0.5));
        let mut slope = DVector::zeros(y.len());
        for _ in 0..SLOPES {
            system.slope(black_box(&y), &mut slope).unwrap();
        }
        SLOPES
    })
}

fn volumes() -> Work {
    let rubber = Stuff::new(&Stress::Mooney(24.0, 1.5), 1e-4).unwrap();
    let sine = End::Loaded(History::sine(1.7, std::f64::consts::TAU / 0.002, 0.0));
    let bar = Bar::new(rubber, 3.0, 0.0314, [End::Wall, sine]).unwrap();
    Box::new(move || {
        let mut volumes = FiniteVolumes::new(&bar, 300).unwrap();
        volumes.advance(0.001).unwrap();
        volumes.updates()
    })
}
