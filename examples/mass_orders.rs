//! Light rods, first-order mass and full mass compared: error and cost.
//!
//! A bent rod swings smoothly under a dead load (`docs/validation/mass.md`). Let eps be the mass of the rod over that
//! of the body. Without the rod's mass the error of the end is of order 1 in eps; with the first-order correction it
//! is of order 2.
//!
//! `cargo run --release --example mass_orders`; with a directory as argument it writes its figures there:
//! `cargo run --release --example mass_orders -- figures`; without one the two heaviest rods are enough

use snaprod::motion::{Event, Motion};
use snaprod::plot::{self, LineStyle, Lines, Series};
use snaprod::scene::Scene;
use snaprod::study::run::Prepared;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

const SCENE: &str = r#"
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = 0.1
[body]
mass = 1.0
[start]
lambda = 1.41421356
p = -1.6088
velocity = [0.0, 0.3]
[loads]
dead = [0.0, -2.0]
[run]
duration = 0.5
tolerance = 1e-9
"#;
const MASSES: [f64; 4] = [0.1, 0.03, 0.01, 0.003];
const SAMPLES: usize = 50;
const DURATION: f64 = 0.5;
const KINDS: [&str; 3] = ["none", "first-order", "full"];

/// Positions of the end at equidistant times, and processor time in milliseconds.
fn run(eps: f64, inertia: &str) -> Result<(Vec<[f64; 2]>, f64), Failure> {
    let mut set = vec![
        format!("rod.mass={eps}"),
        format!("rod.inertia={inertia:?}"),
    ];
    if inertia == "full" {
        set.push("rod.nodes=10".to_owned());
    }
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    let prepared = Prepared::new(&Scene::parse_with(SCENE, &set)?)?;
    // The system counts time in ticks, so short runs are repeated.
    let repeats = if inertia == "full" { 1 } else { 300 };
    let motions = (0..repeats).map(|_| prepared.motion());
    let motions = motions.collect::<Result<Vec<_>, _>>()?;
    let (clock, mut places) = (Clock::new(), Vec::new());
    for motion in motions {
        places = sampled(motion)?;
    }
    Ok((places, clock.milliseconds() / f64::from(repeats)))
}

/// Processor time of the process, if the system reports one; wall time on other systems.
struct Clock {
    wall: Instant,
    core: Option<f64>,
}

impl Clock {
    fn new() -> Self {
        Self {
            wall: Instant::now(),
            core: Self::on_core(),
        }
    }

    fn on_core() -> Option<f64> {
        let text = std::fs::read_to_string("/proc/self/schedstat").ok()?;
        let nanoseconds = text.split_whitespace().next()?.parse::<f64>().ok()?;
        Some(nanoseconds * 1e-6)
    }

    fn milliseconds(&self) -> f64 {
        match (self.core, Self::on_core()) {
            (Some(from), Some(to)) => to - from,
            _ => self.wall.elapsed().as_secs_f64() * 1e3,
        }
    }
}

fn sampled(mut motion: Box<dyn Motion<'_> + '_>) -> Result<Vec<[f64; 2]>, Failure> {
    let mut places = Vec::new();
    while let Some(event) = motion.advance() {
        let Event::Step { to, .. } = event else {
            continue;
        };
        loop {
            let t = DURATION * (places.len() + 1) as f64 / SAMPLES as f64;
            if t > to || places.len() + 1 == SAMPLES {
                break;
            }
            let state = motion.sample(t).ok_or("outside the step")?;
            let r = state.pose().translation.vector;
            places.push([r.x, r.y]);
        }
    }
    let r = motion.now().pose().translation.vector;
    places.push([r.x, r.y]);
    Ok(places)
}

fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let each = a.iter().zip(b);
    each.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

fn main() -> Result<(), Failure> {
    let (mut errors, mut costs) = ([Vec::new(), Vec::new()], [const { Vec::new() }; 3]);
    // The lightest rods take longest; without a figure the first order suffices.
    let directory = std::env::args().nth(1);
    let masses = &MASSES[..if directory.is_some() { MASSES.len() } else { 2 }];
    for &eps in masses {
        let mut found = Vec::new();
        for (kind, cost) in KINDS.iter().zip(&mut costs) {
            let (places, ms) = run(eps, kind)?;
            assert_eq!(places.len(), SAMPLES);
            cost.push(ms);
            found.push(places);
        }
        for (error, places) in errors.iter_mut().zip(&found) {
            error.push(apart(places, &found[2]));
        }
        let last = |of: &[f64]| of[of.len() - 1];
        println!(
            "eps {eps:<6} off by {:.1e} without mass, {:.1e} to first order; {:.2} ms, {:.2} ms, {:.0} ms in full",
            last(&errors[0]),
            last(&errors[1]),
            last(&costs[0]),
            last(&costs[1]),
            last(&costs[2]),
        );
    }
    for (error, bounds) in errors.iter().zip([0.8..1.1, 1.7..2.05]) {
        for k in 1..masses.len() {
            let order = (error[k - 1] / error[k]).ln() / (masses[k - 1] / masses[k]).ln();
            println!("order {order:.3}");
            assert!(bounds.contains(&order));
        }
    }
    if let Some(directory) = directory {
        for (name, figure) in [
            ("mass_orders", error_figure(&errors)),
            ("mass_costs", cost_figure(&costs)),
        ] {
            std::fs::write(
                format!("{directory}/{name}.svg"),
                plot::lines(&figure, &plot::Paper::SCREEN)?,
            )?;
        }
    }
    Ok(())
}

fn series(name: &str, y: &[f64], trace: LineStyle) -> Series {
    Series {
        name: name.into(),
        x: MASSES.to_vec(),
        y: y.to_vec(),
        trace,
        ..Series::default()
    }
}

const X_LABEL: &str = "mass of the rod over that of the body, ε";

fn error_figure([none, first]: &[Vec<f64>; 2]) -> Lines {
    let power = |from: f64, order: i32| -> Vec<f64> {
        MASSES
            .iter()
            .map(|eps| from * (eps / MASSES[0]).powi(order))
            .collect()
    };
    Lines {
        x_label: X_LABEL.into(),
        y_label: "largest error of the end's place, t ≤ 0.5 √(μℓ³/EI) (ℓ)".into(),
        x_log: true,
        y_log: true,
        series: vec![
            series("without mass", none, LineStyle::LineMarks),
            series("to first order", first, LineStyle::LineMarks),
            series("∝ ε", &power(1.6 * none[0], 1), LineStyle::Dashed),
            series("∝ ε²", &power(1.6 * first[0], 2), LineStyle::Dashed),
        ],
        ..Lines::default()
    }
}

fn cost_figure([none, first, full]: &[Vec<f64>; 3]) -> Lines {
    Lines {
        x_label: X_LABEL.into(),
        y_label: "time on one core, t ≤ 0.5 √(μℓ³/EI) (ms)".into(),
        x_log: true,
        y_log: true,
        series: vec![
            series("without mass", none, LineStyle::LineMarks),
            series("to first order", first, LineStyle::LineMarks),
            series("in full, 10 nodes, undamped", full, LineStyle::LineMarks),
        ],
        ..Lines::default()
    }
}
