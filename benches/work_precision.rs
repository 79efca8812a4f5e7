//! Error against time: `cargo bench --bench work_precision`, or a part of it: `-- motions`, `-- ledger`, `-- mass`.
//!
//! For motions W, B, H (references of 30 digits) and the snap run (reference in quadruple precision): error at
//! the end, work and time for each tolerance, and what 1e-7 costs, by interpolation. The peer, a
//! compiled closed form (C++, Boost, RKF78, chart coordinates as state) takes about 8 ms, 150 ms and
//! 67 ms for 1e-7 on W, B, H at 0.65-0.8 us a right-hand side; our aim is half of that.

use nalgebra::Vector2;
use snaprod::body::{Body, TimeLoad};
use snaprod::elastica::{Elastica, Equilibrium, LightRod};
use snaprod::manifold::Multivalued;
use snaprod::motion::{Event, Options, Run};
use std::f64::consts::SQRT_2;
use std::sync::Arc;
use std::time::Instant;

/// A problem: body, start, velocity, duration, state (r, v) at the end, the peer's milliseconds.
struct Problem {
    name: &'static str,
    body: Body<2>,
    q: Vector2<f64>,
    v: Vector2<f64>,
    duration: f64,
    end: [f64; 4],
    peer_ms: Option<f64>,
}

/// Right-hand sides per millisecond of the peer, at 0.725 us each (given: 0.65 to 0.8).
const PEER_PER_MS: f64 = 1e3 / 0.725;

impl Problem {
    fn motion(name: &'static str, load: [f64; 2], peer_ms: f64) -> Self {
        let path = format!(
            "{}/tests/data/motion_{name}.json",
            env!("CARGO_MANIFEST_DIR")
        );
        let text = std::fs::read_to_string(path).expect("reference motion");
        let data: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
        let rows = data["rows"].as_array().expect("rows");
        let row = |i: usize| -> Vec<f64> {
            rows[i]
                .as_array()
                .expect("a row")
                .iter()
                .map(|v| v.as_f64().expect("a number"))
                .collect()
        };
        let (first, last) = (row(0), row(rows.len() - 1));
        Self {
            name,
            body: Body::new(1.0)
                .unwrap()
                .with_dead_force(load.into())
                .unwrap(),
            q: Elastica
                .stable_at(&Vector2::new(first[1], first[2]))
                .unwrap()[0],
            v: Vector2::zeros(),
            duration: last[0],
            end: [last[1], last[2], last[3], last[4]],
            peer_ms: Some(peer_ms),
        }
    }

    fn snap() -> Self {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/snap_run.json");
        let text = std::fs::read_to_string(path).expect("reference snap run");
        let data: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
        let rows = data["rows"].as_array().expect("rows");
        let last = &rows[rows.len() - 1];
        let end = ["x", "y", "vx", "vy"].map(|key| {
            let digits = last[key].as_str().expect("a decimal string");
            digits.parse().expect("a number")
        });
        let start = Equilibrium::from_lambda_kappa(6.3, 0.6).unwrap();
        Self {
            name: "snap",
            body: Body::new(1.0).unwrap(),
            q: Vector2::new(start.p, start.w),
            v: Vector2::new(0.0, -0.5),
            duration: 3.0,
            end,
            peer_ms: None,
        }
    }

    fn run(&self, tolerance: f64) -> ([f64; 4], u64, u64) {
        let options = Options::new(self.duration)
            .unwrap()
            .with_tolerance(tolerance)
            .unwrap();
        let mut run = Run::new(&Elastica, &self.body, self.q, self.v, options).unwrap();
        while !matches!(run.next(), Some(Event::Stop(_))) {}
        let end = run.now();
        let state = [end.pose[0], end.pose[1], end.phase.v[0], end.phase.v[1]];
        (state, run.cost().evaluations, run.cost().steps)
    }
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let parts: [(&str, fn()); 3] = [("motions", motions), ("ledger", ledgers), ("mass", masses)];
    let some = parts
        .iter()
        .any(|(name, _)| asked.iter().any(|a| a == name));
    for (name, part) in parts {
        if !some || asked.iter().any(|a| a == name) {
            part();
            println!();
        }
    }
    if let Some(peak) = peak_memory() {
        println!("peak memory of this process: {peak:.1} MB");
    }
}

fn ledgers() {
    for (name, body) in ledger_scenes() {
        println!("{}", ledger(name, &body));
    }
}

fn masses() {
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        for start in ROD_MASS {
            println!("{}", rod_mass(start, tolerance));
        }
    }
}

fn motions() {
    let problems = [
        Problem::motion("W", [-8.0, -2.0], 8.0),
        Problem::motion("B", [0.0, 0.0], 150.0),
        Problem::motion("H", [0.0, 0.0], 67.0),
        Problem::snap(),
    ];
    println!(
        "| motion | tolerance | error at the end | right-hand sides | steps | ms | us per right-hand side |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut notes = Vec::new();
    for problem in &problems {
        let end = problem.end;
        let mut curve: Vec<(f64, f64, f64)> = Vec::new();
        for k in 4..=13 {
            let tolerance = 10f64.powi(-k);
            let (state, evaluations, steps) = problem.run(tolerance);
            // The best of several: the machine's noise only adds.
            let ms = (0..7)
                .map(|_| {
                    let clock = Instant::now();
                    std::hint::black_box(problem.run(tolerance));
                    clock.elapsed().as_secs_f64() * 1e3
                })
                .fold(f64::INFINITY, f64::min);
            let distance = |i: usize| (state[i] - end[i]).hypot(state[i + 1] - end[i + 1]);
            let error = distance(0).max(distance(2));
            curve.push((error, evaluations as f64, ms));
            println!(
                "| {} | 1e-{k} | {error:.1e} | {evaluations} | {steps} | {ms:.3} | {:.3} |",
                problem.name,
                1e3 * ms / evaluations as f64
            );
        }
        if let (Some(peer), Some((evaluations, ms))) = (problem.peer_ms, cost_of(1e-7, &curve)) {
            notes.push(format!(
                "{}: 1e-7 costs {evaluations:.0} right-hand sides (peer about {:.0}: ratio {:.2}) and {ms:.2} ms (peer about {peer}: ratio {:.2}); aim 0.5",
                problem.name,
                peer * PEER_PER_MS,
                evaluations / (peer * PEER_PER_MS),
                ms / peer
            ));
        }
    }
    println!();
    for note in notes {
        println!("{note}");
    }
}

/// Loads under which the ledger is watched for 1000 time units.
fn ledger_scenes() -> [(&'static str, Body<2>); 3] {
    let free = || Body::new(1.0).unwrap();
    let shaken = TimeLoad::sine(Vector2::new(0.0, 8.0), 2.0, 0.0).unwrap();
    [
        ("free", free()),
        (
            "gravity",
            free().with_gravity(Vector2::new(0.0, -3.0)).unwrap(),
        ),
        (
            "drag and forcing",
            free().with_drag(0.1).unwrap().with_force(shaken),
        ),
    ]
}

/// One line on how the ledger closes from the start of the snap run, at tolerance 1e-12.
fn ledger(name: &str, body: &Body<2>) -> String {
    let start = Equilibrium::from_lambda_kappa(6.3, 0.6).unwrap();
    let options = Options::new(1000.0).unwrap().with_tolerance(1e-12).unwrap();
    let q = Vector2::new(start.p, start.w);
    let mut run = Run::new(&Elastica, body, q, Vector2::new(0.0, -0.5), options).unwrap();
    let total = run.now().ledger.total();
    let clock = Instant::now();
    while !matches!(run.next(), Some(Event::Stop(_))) {}
    let end = run.now();
    let error = (end.ledger.total() - total).abs();
    format!(
        "ledger, {name}: t = {}, {} snaps, {} steps in {:.1} s: off by {error:.1e}, {:.1e} of its largest term",
        end.phase.t,
        run.snaps(),
        run.cost().steps,
        clock.elapsed().as_secs_f64(),
        error / end.ledger.largest()
    )
}

/// Motions with the mass of the rod: lambda, p, velocity, dead load, duration.
type Heavy = (f64, f64, [f64; 2], [f64; 2], f64);
const ROD_MASS: [Heavy; 5] = [
    (SQRT_2, -1.6088, [0.0, 0.3], [0.0, -2.0], 5.0),
    (4.0, 0.855, [0.3, 0.1], [-10.0, 3.0], 5.0),
    (10.0, 9.0, [0.3, 0.1], [-84.0, -58.0], 2.0),
    (19.5, 18.5, [0.3, 0.1], [-420.0, -290.0], 0.5),
    (100.0, 99.0, [0.3, 0.1], [-11_000.0, -7500.0], 0.1),
];

/// One line on what following the mass of the rod to first order costs.
fn rod_mass((lam, p, v, load, duration): Heavy, tolerance: f64) -> String {
    let start = Equilibrium::from_lambda_p(lam, p).unwrap();
    let options = Options::new(duration)
        .unwrap()
        .with_tolerance(tolerance)
        .unwrap();
    let none = Body::new(1.0)
        .unwrap()
        .with_dead_force(load.into())
        .unwrap();
    let rod = LightRod {
        mass: 0.01,
        gravity: Vector2::zeros(),
    };
    let first = none.clone().with_rod(Arc::new(rod));
    let [none, first] = [none, first].map(|body| {
        let time = |_| {
            let q = Vector2::new(start.p, start.w);
            let mut run = Run::new(&Elastica, &body, q, v.into(), options).unwrap();
            let clock = Instant::now();
            while !matches!(run.next(), Some(Event::Stop(_))) {}
            1e6 * clock.elapsed().as_secs_f64() / run.cost().evaluations as f64
        };
        (0..30).map(time).fold(f64::INFINITY, f64::min)
    });
    format!(
        "mass of the rod, from lambda = {lam:.2}, tolerance {tolerance:e}: {none:.3} us per right-hand side without, {first:.3} to first order: ratio {:.2}",
        first / none
    )
}

/// Cost of an error by a straight line through log cost against log error.
fn cost_of(error: f64, curve: &[(f64, f64, f64)]) -> Option<(f64, f64)> {
    let fit = |cost: fn(&(f64, f64, f64)) -> f64| {
        let points: Vec<(f64, f64)> = curve
            .iter()
            .filter(|c| (1e-10..1e-4).contains(&c.0))
            .map(|c| (c.0.ln(), cost(c).ln()))
            .collect();
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - mx) * (p.1 - my)) / mean(&|p| (p.0 - mx).powi(2));
        (n >= 2.0).then(|| (my + slope * (error.ln() - mx)).exp())
    };
    Some((fit(|c| c.1)?, fit(|c| c.2)?))
}

/// Largest resident set so far, in MB, where the system tells.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM"))?;
    line.split_whitespace()
        .nth(1)?
        .parse::<f64>()
        .ok()
        .map(|kb| kb / 1024.0)
}
