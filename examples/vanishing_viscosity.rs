//! Limit of small viscosity: viscous runs through the three snaps of scenes/three_snaps.toml, compared with the
//! elastic run with viscous landings (AMV Sec. 8).
//!
//! On the sheets the error is of order eta, once drag has removed the memory of earlier snaps. A fold is passed
//! slowly: the snap is late by a time of order eta^(2/3), and right after the snap the errors of position and lost
//! energy have the same order. In this scene the mass bounces off the circle of the straight rod 0.02 after each snap.
//! The bounce dissipates a further part, of order eta with a large factor: the total loss is off by a eta - b
//! eta^(2/3).
//!
//! `cargo run --release --example vanishing_viscosity`; with a directory as argument it writes its figures there:
//! `cargo run --release --example vanishing_viscosity -- figures`

use nalgebra::{Vector1, Vector2};
use snaprod::body::{PointMass, TimeLoad};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::motion::viscoelastic::{Layer, ViscousRun, ViscousSample, ViscousStart};
use snaprod::motion::{Event, Options, Run, Snap, State};
use snaprod::plot::{
    self, Curve, DrawnShape, LayerFigure, LayerRun, LineStyle, Lines, LossesOverTime, Series, Slope,
};
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Viscoelastic, Viscosity};
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use std::f64::consts::PI;
use std::sync::Arc;

type Failure = Box<dyn std::error::Error + Send + Sync>;
type Sample = ViscousSample<Plane, 1, 2>;

const DEAD: f64 = -3.7;
const DRAG: f64 = 8.0;
/// Amplitude and angular frequency of the force on the mass.
const SWING: f64 = 55.7;
const TURNING: f64 = 2.0 * PI * 0.119;
const DURATION: f64 = 15.5;
/// Times before and after each snap (5.430, 9.631, 13.833), on the sheets.
const BEFORE: [f64; 3] = [5.3, 9.5, 13.7];
const AFTER: [f64; 3] = [7.5, 11.7, 15.5];
/// Delay after a snap at which states are compared, before the bounce.
const SOON: f64 = 0.005;
const ETA: [f64; 7] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// Below this viscosity snaps are over before the bounce.
const SMALL: f64 = 1.1e-4;
/// Viscosities whose first layer is drawn, and the interval of stretched time shown.
const DRAWN: [f64; 3] = [1e-4, 1e-5, 1e-6];
const STRETCH: [f64; 2] = [-9.0, 6.0];

fn main() -> Result<(), Failure> {
    let elastic = Elastic::run()?;
    // Two at a time: the runs are independent.
    let half = |first: usize| {
        ETA.iter()
            .skip(first)
            .step_by(2)
            .map(|eta| Viscous::run(*eta, &elastic))
    };
    let (even, odd) = std::thread::scope(|scope| {
        let odd = scope.spawn(|| half(1).collect::<Result<Vec<_>, Failure>>());
        (half(0).collect::<Result<Vec<_>, Failure>>(), odd.join())
    });
    let odd = odd.map_err(|_| "a run panicked")??;
    let mut runs: Vec<Viscous> = even?.into_iter().chain(odd).collect();
    runs.sort_by(|a, b| b.eta.total_cmp(&a.eta));

    let series = series(&elastic, &runs);
    report(&elastic, &runs, &series);
    if let Some(directory) = std::env::args().nth(1) {
        let write =
            |name: &str, svg: String| std::fs::write(format!("{directory}/{name}.svg"), svg);
        write(
            "vanishing_viscosity",
            plot::lines(&convergence(&series), &plot::Paper::SCREEN)?,
        )?;
        write(
            "layer",
            plot::layer(&layer(&elastic, &runs)?, &plot::Paper::SCREEN)?,
        )?;
        write(
            "losses_over_time",
            plot::losses_over_time(&losses(&elastic, &runs), &plot::Paper::SCREEN)?,
        )?;
    }
    Ok(())
}

/// The mass of the scene and its loads.
fn body() -> snaprod::Result<PointMass<2>> {
    Ok(PointMass::new(1.0)?
        .with_dead_force(Vector2::new(DEAD, 0.0))?
        .with_drag(DRAG)?
        .with_force(TimeLoad::sine(Vector2::new(0.0, SWING), TURNING, 0.0)?))
}

/// The rod at the start.
fn rest() -> snaprod::Result<Equilibrium> {
    Equilibrium::from_lambda_kappa(1.923538, 0.7583543)
}

/// Data of the elastic run.
struct Elastic {
    snaps: Vec<Snap>,
    /// Positions at the times of [`times`].
    positions: Vec<Vector2<f64>>,
    velocities: Vec<Vector2<f64>>,
}

/// Increasing times of comparison: before each snap, soon after, and later.
fn times(snaps: &[Snap]) -> Vec<f64> {
    (0..snaps.len())
        .flat_map(|k| [BEFORE[k], snaps[k].t + SOON, AFTER[k]])
        .collect()
}

impl Elastic {
    fn run() -> Result<Self, Failure> {
        let (body, rest) = (body()?, rest()?);
        let options = Options::new(DURATION)?.with_tolerance(1e-12)?;
        let start = Vector2::new(rest.p, rest.w);
        let mut run = Run::new(&Elastica, &body, start, Vector2::zeros(), options)?;
        let (mut snaps, mut positions) = (Vec::<Snap>::new(), Vec::new());
        let mut velocities = Vec::new();
        while let Some(event) = run.next() {
            match event {
                Event::Step { to, .. } => loop {
                    let k = positions.len() / 3;
                    let next = match positions.len() % 3 {
                        0 => BEFORE.get(k).copied(),
                        1 => snaps.get(k).map(|snap| snap.t + SOON),
                        _ => AFTER.get(k).copied(),
                    };
                    let Some(t) = next.filter(|t| *t <= to) else {
                        break;
                    };
                    let sample = run.sample(t).ok_or("outside the step")?;
                    positions.push(sample.pose);
                    velocities.push(sample.phase.v);
                },
                Event::Snap(snap) => snaps.push(snap),
                Event::Stop(outcome) => assert_eq!(outcome.key(), "end_of_time"),
                _ => {}
            }
        }
        assert!(snaps.len() == 3 && positions.len() == 9);
        Ok(Self {
            snaps,
            positions,
            velocities,
        })
    }
}

/// Data of a viscous run.
struct Viscous {
    eta: f64,
    /// Positions at the times of [`times`], and energies dissipated in the rod up to these times.
    positions: Vec<Vector2<f64>>,
    velocities: Vec<Vector2<f64>>,
    lost_by: Vec<f64>,
    /// Time and energy dissipated in the rod, at the ends of steps.
    lost: Vec<[f64; 2]>,
    /// Fast passages.
    layers: Vec<Layer>,
    /// The first layer: the ends of steps.
    first: Vec<Moment>,
}

/// A moment of the first layer.
struct Moment {
    t: f64,
    elastic: f64,
    lost: f64,
    power: f64,
    curve: Vec<[f64; 2]>,
}

impl Viscous {
    fn run(eta: f64, elastic: &Elastic) -> Result<Self, Failure> {
        let (body, rest) = (body()?, rest()?);
        let law = Viscoelastic::new(
            Arc::new(Linear::diagonal([1.0; 2], 1.0)?),
            Arc::new(KelvinVoigt::new(Viscosity::diagonal([eta; 2], eta)?)),
        )?;
        let start = ViscousStart {
            strain: &|s| Vector1::new(rest.section(s).map_or(f64::NAN, |at| at.curvature)),
            relaxed: None,
            velocity: Vector2::zeros(),
        };
        let options = Options::new(DURATION)?.with_tolerance(1e-10)?;
        let material = Material::new(law, [0])?;
        let mut run = ViscousRun::new(Plane, material, &body, &start, options)?;
        let mut found = Self {
            eta,
            positions: Vec::new(),
            velocities: Vec::new(),
            lost_by: Vec::new(),
            lost: vec![[0.0; 2]],
            layers: Vec::new(),
            first: Vec::new(),
        };
        let times = times(&elastic.snaps);
        let mut next = times.iter().peekable();
        let snap = elastic.snaps[0].t;
        while let Some(event) = run.next() {
            let to = match event {
                Event::Step { to, .. } => to,
                Event::Layer(layer) => {
                    found.layers.extend(layer.whole.then_some(layer));
                    continue;
                }
                _ => break,
            };
            found.lost.push([to, run.now().friction]);
            while let Some(t) = next.next_if(|t| **t <= to * (1.0 + 1e-14)) {
                let sample = run.sample(t.min(to)).ok_or("outside the step")?;
                found.positions.push(sample.pose);
                found.velocities.push(sample.velocity);
                found.lost_by.push(sample.friction);
            }
            // Interval that contains the first layer.
            if DRAWN.contains(&eta) && (snap - 0.01..snap + 0.1).contains(&to) {
                found.first.push(Moment::of(run.now()));
            }
        }
        assert!((run.time() - DURATION).abs() < 1e-9 && next.peek().is_none());
        Ok(found)
    }

    /// The first layer in stretched time, counted from its largest rate of dissipation; energies are counted from its
    /// beginning.
    fn stretched(&self) -> Result<(Vec<f64>, Vec<&Moment>), Failure> {
        let largest = (1..self.first.len() - 1)
            .max_by(|i, j| self.first[*i].power.total_cmp(&self.first[*j].power));
        let k = largest.ok_or("no layer")?;
        // Vertex of the parabola through three moments.
        let [a, b, c] =
            [k - 1, k, k + 1].map(|i| (self.first[i].t - self.first[k].t, self.first[i].power));
        let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
        let bend = (right - left) / (c.0 - a.0);
        let peak = self.first[k].t + 0.5 * (a.0 + b.0) - 0.5 * left / bend;
        let inside = |m: &&Moment| {
            let stretched = (m.t - peak) / self.eta;
            (STRETCH[0]..=STRETCH[1]).contains(&stretched)
        };
        let moments: Vec<_> = self.first.iter().filter(inside).collect();
        Ok((
            moments.iter().map(|m| (m.t - peak) / self.eta).collect(),
            moments,
        ))
    }
}

/// Points of the rod's axis.
fn axis(sample: &Sample) -> Vec<[f64; 2]> {
    let sections = sample.sections(60);
    let points = sections.iter().map(|(_, at)| at.translation);
    points.map(|r| [r.x, r.y]).collect()
}

impl Moment {
    fn of(sample: &Sample) -> Self {
        Self {
            t: sample.t,
            elastic: sample.ledger.elastic,
            lost: sample.friction,
            power: sample
                .dissipation
                .iter()
                .zip(sample.grid.weights())
                .map(|(d, w)| d * w)
                .sum(),
            curve: axis(sample),
        }
    }
}

/// Errors of one kind against the viscosity.
struct Errors {
    name: String,
    /// Expected order, and the accepted deviation between neighbours in eta.
    order: (f64, f64),
    /// (eta, error).
    points: Vec<(f64, f64)>,
}

fn series(elastic: &Elastic, runs: &[Viscous]) -> Vec<Errors> {
    let errors = |name: String, order, f: &dyn Fn(&Viscous) -> f64| Errors {
        name,
        order,
        points: runs
            .iter()
            .filter(|run| order.0 == 1.0 || run.eta < SMALL)
            .map(|run| (run.eta, f(run)))
            .collect(),
    };
    let position = |run: &Viscous, i: usize| (run.positions[i] - elastic.positions[i]).norm();
    let fold = 2.0 / 3.0;
    let mut all = Vec::new();
    for k in 0..3 {
        all.push(errors(
            format!("position before snap {}", k + 1),
            (1.0, 0.05),
            &|run| position(run, 3 * k),
        ));
    }
    for k in 0..3 {
        all.push(errors(
            format!("delay of snap {}", k + 1),
            (fold, 0.02),
            &|run| run.layers[k].peak - elastic.snaps[k].t,
        ));
    }
    for k in 0..3 {
        all.push(errors(
            format!("velocity right after snap {}", k + 1),
            (fold, 0.05),
            &|run| (run.velocities[3 * k + 1] - elastic.velocities[3 * k + 1]).norm(),
        ));
    }
    for k in 0..3 {
        all.push(errors(
            format!("loss in snap {}, relative", k + 1),
            (fold, 0.05),
            &|run| {
                let lost = run.lost_by[3 * k + 1] - run.lost_by[3 * k];
                (lost / elastic.snaps[k].released - 1.0).abs()
            },
        ));
    }
    all
}

/// Prints the errors with their orders, and asserts the orders.
fn report(elastic: &Elastic, runs: &[Viscous], series: &[Errors]) {
    for (k, snap) in elastic.snaps.iter().enumerate() {
        println!(
            "snap {} of the elastic run at {:.9} releases {:.9}",
            k + 1,
            snap.t,
            snap.released
        );
    }
    println!("errors of the viscous runs, and their orders:");
    for errors in series {
        let (wanted, off) = errors.order;
        println!("{} (order {wanted:.3})", errors.name);
        let mut before: Option<(f64, f64)> = None;
        for &(eta, error) in &errors.points {
            let order = before.map(|(coarse, before)| (before / error).ln() / (coarse / eta).ln());
            let shown = order.map_or_else(|| "-".into(), |order| format!("{order:.3}"));
            println!("    eta = {eta:5.0e}  {error:10.3e}  {shown:>6}");

            assert!(
                order.is_none_or(|order| (order - wanted).abs() < off),
                "{}: {order:?}",
                errors.name
            );
            before = Some((eta, error));
        }
    }
    // Through the snap and the bounce, until the body rests on the sheet: two of the runs give a and b.
    println!(
        "loss through snap and bounce, relative to what the snap releases, less 1; and a eta - b eta^(2/3):"
    );
    for (k, snap) in elastic.snaps.iter().enumerate() {
        let excess =
            |run: &Viscous| (run.lost_by[3 * k + 2] - run.lost_by[3 * k]) / snap.released - 1.0;
        let [first, .., second] = runs.iter().filter(|run| run.eta < 1e-5).collect::<Vec<_>>()[..]
        else {
            continue;
        };
        // x / eta = a - b eta^(-1/3).
        let (x, y) = (excess(first) / first.eta, excess(second) / second.eta);
        let (u, v) = (first.eta.cbrt().recip(), second.eta.cbrt().recip());
        let b = (x - y) / (v - u);
        let a = x + b * u;
        println!("snap {}: a = {a:.0}, b = {b:.1}", k + 1);
        for run in runs {
            let law = a * run.eta - b * run.eta.cbrt().powi(2);
            println!(
                "    eta = {:5.0e}  {:10.3e}  {law:10.3e}",
                run.eta,
                excess(run)
            );
            let off = (excess(run) - law).abs();
            assert!(off < 0.05 * law.abs() || run.eta > 1.1e-5);
        }
    }
}

/// The largest errors of the three snaps, whose curves nearly coincide.
fn convergence(series: &[Errors]) -> Lines {
    let names = [
        "position on the sheet, before a snap (ℓ)",
        "delay of a snap (√(μℓ³/EI))",
        "velocity right after a snap (√(EI/μℓ))",
        "loss in a snap, relative",
    ];
    let largest = |(name, three): (&str, &[Errors])| Series {
        name: name.into(),
        x: three[0].points.iter().map(|p| p.0).collect(),
        y: (0..three[0].points.len())
            .map(|i| three.iter().fold(0.0, |m: f64, e| m.max(e.points[i].1)))
            .collect(),
        trace: LineStyle::LineMarks,
        ..Series::default()
    };
    let slope = |order: f64, name: &str, series: usize| Slope {
        order,
        name: name.into(),
        series: Some(series),
    };
    let series = names.into_iter().zip(series.chunks(3));
    Lines {
        series: series.map(largest).collect(),
        slopes: vec![slope(1.0, "1", 0), slope(2.0 / 3.0, "2/3", 1)],
        x_label: "viscosity η (√(EI·μℓ³))".into(),
        y_label: "difference from the elastic run, largest of three snaps".into(),
        x_log: true,
        y_log: true,
        ..Lines::default()
    }
}

/// Curves of the rod at the two ends of a snap, and of a viscous run between them; energies of all runs drawn.
fn layer(elastic: &Elastic, runs: &[Viscous]) -> Result<LayerFigure, Failure> {
    let snap = &elastic.snaps[0];
    let curve = |q: Vector2<f64>| -> Result<Curve, Failure> {
        Ok(Curve::new(
            Equilibrium::new(q.x, q.y)?
                .curve(100)
                .iter()
                .map(|at| [at.x, at.y]),
        ))
    };
    let mut figure = LayerFigure {
        fold: curve([snap.from.q[0], snap.from.q[1]].into())?,
        landing: curve([snap.to.q[0], snap.to.q[1]].into())?,
        released: Some(snap.released),
        ..LayerFigure::default()
    };
    for run in runs.iter().filter(|run| DRAWN.contains(&run.eta)) {
        let (stretched, moments) = run.stretched()?;
        let lost = |m: &&Moment| m.lost - moments[0].lost;
        let all = moments.last().map_or(0.0, lost);
        // Shapes at the smallest viscosity, at given parts of the energy loss.
        figure.shapes = [
            0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97,
        ]
        .into_iter()
        .filter_map(|part| (0..moments.len()).find(|k| lost(&moments[*k]) >= all * part))
        .map(|k| DrawnShape {
            time: stretched[k],
            axis: Curve::new(moments[k].curve.iter().copied()),
        })
        .collect();
        figure.runs.push(LayerRun {
            eta: run.eta,
            elastic: moments.iter().map(|m| m.elastic).collect(),
            dissipated: moments.iter().map(lost).collect(),
            stretched,
        });
    }
    Ok(figure)
}

fn losses(elastic: &Elastic, runs: &[Viscous]) -> LossesOverTime {
    let mut released = 0.0;
    LossesOverTime {
        snaps: elastic.snaps.iter().map(|snap| snap.t).collect(),
        released: elastic
            .snaps
            .iter()
            .map(|snap| {
                released += snap.released;
                released
            })
            .collect(),
        runs: runs
            .iter()
            .filter(|run| (0.9e-5..1.1e-3).contains(&run.eta))
            .map(|run| Series {
                name: format!(
                    "dissipated in the rod, η = 10⁻{}",
                    ["³", "⁴", "⁵"][(-run.eta.log10()).round() as usize - 3]
                ),
                x: run.lost.iter().map(|p| p[0]).collect(),
                y: run.lost.iter().map(|p| p[1]).collect(),
                ..Series::default()
            })
            .collect(),
        ..LossesOverTime::default()
    }
}
