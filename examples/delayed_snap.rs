//! Delayed snap (pseudo-bistability) of a viscoelastic rod, and its delay.
//!
//! A rod of glassy stiffness 1 + 0.5 + 0.8 and long-time stiffness 1 has been held buckled downwards until its Maxwell
//! branches relaxed. At t = 0 the dead load on its mass becomes (-4, f). The relaxed rod bears f up to 1.6628, the
//! frozen rod up to 4.4490. For f between the two the rod waits, creeps, and snaps. The delay grows as 1/sqrt(f -
//! 1.6628), with a factor that follows from equilibria alone: creep passes a fold slowly. Without branches the mass
//! swings and snaps already for f > 1.5534, past a saddle: that delay grows only logarithmically.
//!
//! `cargo run --release --example delayed_snap`; with a directory as argument it writes its figure there:
//! `cargo run --release --example delayed_snap -- figures`

use nalgebra::{Matrix6, Vector1, Vector2};
use snaprod::body::PointMass;
use snaprod::elastica::Equilibrium;
use snaprod::motion::viscoelastic::{ViscousRun, ViscousStart};
use snaprod::motion::{Event, Options};
use snaprod::plot::{self, LineStyle, Lines, Series};
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Maxwell, Viscoelastic, Viscosity};
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use std::f64::consts::PI;
use std::sync::Arc;

type Failure = Box<dyn std::error::Error>;

/// Viscosity, and the Maxwell branches: stiffness and time.
const ETA: f64 = 0.02;
const BRANCHES: [(f64, f64); 2] = [(0.5, 0.3), (0.8, 3.0)];
/// The loads that the rod can bear at rest, relaxed and frozen (tests/data/viscous_prony.json).
const RELAXED: f64 = 1.662_769_634_192_433_8;
const FROZEN: f64 = 4.449_017_350_900_633;
/// Load f, and times of crossing y = 0 with and without the branches, by an independent code.
const REFERENCE: [(f64, f64, f64); 5] = [
    (2.0, 26.007_432_371_038_09, 3.571_807_518_095_325_4),
    (2.25, 15.544_379_161_886_578, 3.096_035_113_420_978_5),
    (2.5, 10.520_223_750_286_291, 2.786_778_173_575_068),
    (3.0, 5.711_041_814_239_878, 2.390_046_178_141_381_5),
    (3.5, 3.794_768_408_718_688, 2.136_642_011_044_793),
];

fn main() -> Result<(), Failure> {
    let start = Equilibrium::from_lambda_kappa(2.0, -0.8024065)?;
    let with =
        |f: f64| crossing(&start, f, &BRANCHES)?.ok_or_else(|| Failure::from("it never snaps"));
    let without = |f: f64| crossing(&start, f, &[]);

    println!("     f     crossing  without branches");
    let mut table: Vec<(f64, f64, f64)> = Vec::new();
    for f in [1.7, 1.8, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0, 4.4, 4.6, 5.0] {
        let found = (f, with(f)?, without(f)?.ok_or("it never snaps")?);
        println!("{f:6.2} {:12.7} {:17.7}", found.1, found.2);
        if let Some((_, wanted, wanted_without)) = REFERENCE.iter().find(|row| row.0 == f) {
            assert!((found.1 - wanted).abs() < 1e-6 && (found.2 - wanted_without).abs() < 1e-6);
        }
        table.push(found);
    }

    let fold = Bottleneck::new()?;
    assert!((fold.load - RELAXED).abs() < 1e-10);
    println!(
        "the relaxed rod bears {:.12}; beyond, delay = {:.6}/sqrt(f - that) + ...",
        fold.load, fold.factor
    );
    let mut near: Vec<(f64, f64)> = Vec::new();
    for excess in [1e-1, 1e-2, 1e-3, 1e-4] {
        let delay = with(RELAXED + excess)?;
        let power = near
            .last()
            .map(|(e, d)| (delay / d).ln() / (excess / e).ln());
        let power = power.map_or_else(String::new, |power| format!("power {power:.4}"));
        println!(
            "{excess:8.0e} {delay:12.6}  delay x sqrt = {:9.6}  {power}",
            delay * excess.sqrt()
        );
        near.push((excess, delay));
    }
    // delay = C/sqrt(excess) + c: the last two give C.
    let [.., a, b] = near[..] else { unreachable!() };
    let limit = (b.1 - a.1) / (b.0.sqrt().recip() - a.0.sqrt().recip());
    println!("limit of delay x sqrt: {limit:.6}");
    assert!((limit / fold.factor - 1.0).abs() < 1e-3);

    // Without branches the rod snaps sooner, since the mass overshoots its equilibrium: past a saddle, not a fold.
    let (mut low, mut high) = (1.0, RELAXED);
    while high - low > 1e-13 {
        let f = 0.5 * (low + high);
        *(if without(f)?.is_some() {
            &mut high
        } else {
            &mut low
        }) = f;
    }
    println!("without branches it snaps beyond {high:.12}; the delay grows by a logarithm:");
    let mut steps = Vec::new();
    let mut before: Option<f64> = None;
    for excess in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let delay = without(high + excess)?.ok_or("it never snaps")?;
        let step = before.map(|before| delay - before);
        println!(
            "{excess:8.0e} {delay:12.6}  {}",
            step.map_or_else(String::new, |step| format!("{step:.6} more"))
        );
        steps.extend(step);
        before = Some(delay);
    }
    let [.., a, b] = steps[..] else {
        unreachable!()
    };
    assert!((a / b - 1.0).abs() < 1e-3);

    if let Some(directory) = std::env::args().nth(1) {
        near.extend(
            table
                .iter()
                .filter(|row| row.0 > 1.79)
                .map(|row| (row.0 - RELAXED, row.1)),
        );
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let svg = plot::lines(&figure(&near, &table, fold.factor), &plot::Paper::SCREEN)?;
        std::fs::write(format!("{directory}/delayed_snap.svg"), svg)?;
    }
    Ok(())
}

/// The first time at which the mass crosses y = 0; `None` if the mass comes to rest before.
fn crossing(start: &Equilibrium, f: f64, branches: &[(f64, f64)]) -> Result<Option<f64>, Failure> {
    let load = Vector2::new(-4.0, f);
    let mut law = Viscoelastic::new(
        Arc::new(Linear::diagonal([1.0; 2], 1.0)?),
        Arc::new(KelvinVoigt::new(Viscosity::diagonal([ETA; 2], ETA)?)),
    )?;
    for &(stiffness, time) in branches {
        let mut modulus = Matrix6::zeros();
        modulus[(0, 0)] = stiffness;
        law = law.with_branch(Maxwell::new(modulus, time)?)?;
    }
    let body = PointMass::new(1.0)?.with_dead_force(load)?;
    let start = ViscousStart {
        strain: &|s| Vector1::new(start.section(s).map_or(f64::NAN, |at| at.curvature)),
        relaxed: None,
        velocity: Vector2::zeros(),
    };
    let material = Material::new(law, [0])?;
    let options = Options::new(1e4)?.with_tolerance(1e-9)?;
    let mut run = ViscousRun::new(Plane, material, &body, &start, options)?;
    while let Some(event) = run.next() {
        let Event::Step { from, to } = event else {
            continue;
        };
        let now = run.now();
        if now.pose.y < 0.0 {
            // At rest, with balanced forces on the mass.
            if now.velocity.norm() < 1e-6 && (load - now.flow.wrench).norm() < 1e-6 {
                return Ok(None);
            }
            continue;
        }
        let (mut low, mut high) = (from, to);
        while high - low > 1e-9 {
            let t = 0.5 * (low + high);
            let y = run.sample(t).ok_or("outside the step")?.pose.y;
            *(if y < 0.0 { &mut low } else { &mut high }) = t;
        }
        return Ok(Some(0.5 * (low + high)));
    }
    Ok(None)
}

/// Fold of the relaxed equilibria under (-4, f), with the speed of the passage.
///
/// The passage is slow: the branches act as viscosities E time, and inertia is negligible. Let y be the height of the
/// mass along the equilibria, whose load is f*(y). Then viscosity times int (d theta'/dy)^2 ds dy/dt = f - f*(y),
/// where f* = load - bend (y - y0)^2/2. Hence the time is pi viscosity int (d theta'/dy)^2 ds sqrt(2/bend)/sqrt(f -
/// load).
struct Bottleneck {
    load: f64,
    /// delay x sqrt(f - load), in the limit.
    factor: f64,
}

impl Bottleneck {
    fn new() -> Result<Self, Failure> {
        let held = |kappa: f64| -> Result<(f64, Equilibrium), Failure> {
            // The load on the rod is -lam^2 (cos alpha, sin alpha): its part along x is -4.
            let off = |lambda: f64| -> Result<f64, Failure> {
                let rod = Equilibrium::from_lambda_kappa(lambda, kappa)?;
                Ok(lambda * lambda * rod.alpha.cos() - 4.0)
            };
            let (mut a, mut b) = (2.0, 2.05);
            let (mut at_a, mut at_b) = (off(a)?, off(b)?);
            for _ in 0..60 {
                if at_b == at_a || (b - a).abs() < 1e-15 {
                    break;
                }
                (a, b) = (b, b - at_b * (b - a) / (at_b - at_a));
                (at_a, at_b) = (at_b, off(b)?);
            }
            let rod = Equilibrium::from_lambda_kappa(b, kappa)?;
            Ok((-b * b * rod.alpha.sin(), rod))
        };
        // The largest load, by its slope along kappa.
        let h = 1e-3;
        let slope = |kappa: f64| -> Result<f64, Failure> {
            let f = |i: f64| Ok::<_, Failure>(held(kappa + i * h)?.0);
            Ok((f(-2.0)? - f(2.0)? + 8.0 * (f(1.0)? - f(-1.0)?)) / (12.0 * h))
        };
        // From the start towards the straight rod.
        let (mut kappa, step) = (-0.8, 0.01);
        let first = slope(kappa)?;
        while slope(kappa + step)? * first > 0.0 {
            kappa += step;
        }
        let (mut low, mut high) = (kappa, kappa + step);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            *(if slope(middle)? * first > 0.0 {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        let (before, at, after) = (held(low - h)?, held(low)?, held(low + h)?);
        let dy = (after.1.y - before.1.y) / (2.0 * h);
        let bend = -(after.0 + before.0 - 2.0 * at.0) / (h * h) / (dy * dy);
        let mut squares = 0.0;
        let sections = 2000;
        for i in 0..sections {
            let s = (f64::from(i) + 0.5) / f64::from(sections);
            let change = after.1.section(s)?.curvature - before.1.section(s)?.curvature;
            squares += (change / (2.0 * h * dy)).powi(2) / f64::from(sections);
        }
        let viscosity = ETA
            + BRANCHES
                .iter()
                .map(|(stiffness, time)| stiffness * time)
                .sum::<f64>();
        Ok(Self {
            load: at.0,
            factor: PI * viscosity * squares * (2.0 / bend).sqrt(),
        })
    }
}

/// Delay against the excess of the load.
fn figure(near: &[(f64, f64)], table: &[(f64, f64, f64)], factor: f64) -> Lines {
    let ends = [near[0].0, 1.0];
    Lines {
        x_label: "load beyond what the relaxed rod bears, f − 1.6628 (EI/ℓ²)".into(),
        y_label: "time until y = 0 is crossed (√(μℓ³/EI))".into(),
        x_log: true,
        y_log: true,
        series: vec![
            Series {
                name: "with Maxwell branches".into(),
                x: near.iter().map(|p| p.0).collect(),
                y: near.iter().map(|p| p.1).collect(),
                trace: LineStyle::LineMarks,
                ..Series::default()
            },
            Series {
                name: "without".into(),
                x: table.iter().map(|row| row.0 - RELAXED).collect(),
                y: table.iter().map(|row| row.2).collect(),
                trace: LineStyle::LineMarks,
                ..Series::default()
            },
            Series {
                name: "passage of the fold, C/√(f − 1.6628)".into(),
                x: ends.to_vec(),
                y: ends.iter().map(|e| factor / e.sqrt()).collect(),
                trace: LineStyle::Dashed,
                ..Series::default()
            },
            Series {
                name: "what the frozen rod bears".into(),
                x: vec![FROZEN - RELAXED; 2],
                y: vec![1.0, 3e3],
                trace: LineStyle::Dashed,
                ..Series::default()
            },
        ],
        ..Lines::default()
    }
}
