//! Error against work of bodies on elastic rods in space: `cargo bench --bench long_runs`.
//!
//! `-- stiff` prints only the table of stiff rods, `-- chains` only that of chains of rods. Motions over a hundred
//! thousand periods: `-- plane` takes ten minutes, `-- space` some hours (`-- space 100`: a hundred periods;
//! `-- space 100 auto 1e-8`, `-- space 100 parting`: one row).
//!
//! One uniform linear rod with a welded body, kicked: a motion without folds. The reference end is that of a run at
//! the tolerance 1e-13. A period is that of the slowest mode about the equilibrium.

use nalgebra::{DVector, Isometry3, Matrix3, SVector, Vector2, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, Outcome, Run, State};
use snaprod::rod::Rod;
use snaprod::section::Linear;
use snaprod::solve::integrator::Method;
use std::f64::consts::PI;
use std::time::Instant;

fn assembly() -> (Assembly, Configuration) {
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| law.with_shear([120.0, 120.0])?.with_axial(300.0))
        .and_then(|law| law.with_rest([0.3, 0.1], 0.2))
        .expect("a law");
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.3, 0.2, 0.25)))
        .and_then(|body| body.with_centre(Vector3::new(0.05, 0.0, 0.1)))
        .and_then(|body| body.with_gravity(Vector3::new(0.3, 0.0, -0.5)))
        .expect("a body");
    let link = Link::new(
        Rod::new(1.0, law).expect("a rod"),
        Attachment::ground(Isometry3::identity()),
        Attachment::body(0, Isometry3::identity()),
        Joint::Weld,
    );
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose: link.end(&Vector6::zeros(), 1e-14).expect("an end").pose,
            twist: Vector6::new(0.4, -0.6, 0.5, 0.3, 0.5, 0.1),
        }],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let carriers = vec![Body::rigid(body)];
    (
        Assembly::new(carriers, vec![link]).expect("an assembly"),
        start,
    )
}

fn options(duration: f64, tolerance: f64, method: Method) -> Options {
    let options = Options::new(duration).and_then(|o| o.with_tolerance(tolerance));
    options.expect("options").with_method(method)
}

fn run(duration: f64, tolerance: f64, method: Method) -> AssemblyRun<'static> {
    let (assembly, start) = assembly();
    AssemblyRun::new(assembly, &start, options(duration, tolerance, method)).expect("a run")
}

fn work_precision() {
    println!("| tolerance | error | steps | right-hand sides | ms | us a right-hand side |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let end = |tolerance: f64| {
        let mut run = run(2.0, tolerance, Method::Auto);
        while run.advance().is_some() {}
        run
    };
    let place = |run: &AssemblyRun| run.sample_now().at.now.bodies[0];
    let exact = place(&end(1e-13));
    for k in 4..=12 {
        let tolerance = 10f64.powi(-k);
        let mut best = f64::INFINITY;
        let mut last = None;
        for _ in 0..5 {
            let start = Instant::now();
            last = Some(end(tolerance));
            best = best.min(start.elapsed().as_secs_f64());
        }
        let done = last.expect("a run");
        let (here, cost) = (place(&done), done.cost());
        let off = (here.pose.translation.vector - exact.pose.translation.vector)
            .norm()
            .max(here.pose.rotation.angle_to(&exact.pose.rotation))
            .max((here.twist - exact.twist).norm());
        println!(
            "| 1e-{k} | {off:.1e} | {} | {} | {:.2} | {:.1} |",
            cost.steps,
            cost.evaluations,
            1e3 * best,
            1e6 * best / cost.evaluations as f64
        );
    }
}

/// A pendulum: mass 1 on a ball joint, pull 20 B/L^2, a straight rod of bending stiffness 1. The speed at its lowest
/// point is 0.01. An initial extra stretch `stretched` excites axial vibrations. One unit of time is 0.8 periods of
/// the swing.
fn hanging(stiffness: f64, stretched: f64) -> (Assembly, Configuration) {
    let pull = 20.0;
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| {
            law.with_shear([stiffness, stiffness])?
                .with_axial(stiffness)
        })
        .expect("a law");
    let mass = PointMass::<3>::new(1.0)
        .and_then(|body| body.with_gravity(Vector3::z() * pull))
        .expect("a mass");
    let here = Isometry3::identity();
    let link = Link::new(
        Rod::new(1.0, law).expect("a rod"),
        Attachment::ground(here),
        Attachment::body(0, here),
        Joint::Ball,
    );
    let mut q = Vector6::zeros();
    q[5] = (pull + stiffness * stretched) / link.units()[5];
    let low = 1.0 + pull / stiffness + stretched;
    let start = Configuration {
        bodies: vec![BodyMotion {
            pose: Isometry3::translation(0.0, 0.0, low),
            twist: Vector6::new(0.0, 0.0, 0.0, 9e-3, 4e-3, 0.0),
        }],
        charts: vec![q],
        spins: Vec::new(),
    };
    let carriers = vec![Body::point(mass)];
    (
        Assembly::new(carriers, vec![link]).expect("an assembly"),
        start,
    )
}

fn stiff_rods() {
    println!(
        "| K | start | tolerance | steps are | steps | implicit | right-hand sides | ms | error of pose | of velocity | energy gained |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for stiffness in [1e4_f64, 1e5, 1e6, 1e7, 1e8] {
        for (start_name, stretched) in [("quiet", 0.0), ("rings", 1e-3 / stiffness.sqrt())] {
            let (assembly, start) = hanging(stiffness, stretched);
            let end = |tolerance: f64, method: Method| {
                let clock = Instant::now();
                let options = options(1.0, tolerance, method);
                let mut run = AssemblyRun::new(assembly.clone(), &start, options).expect("a run");
                let total = run.sample_now().ledger().total();
                while run.advance().is_some() {}
                (run, clock.elapsed().as_secs_f64(), total)
            };
            let place = |run: &AssemblyRun| run.sample_now().at.now.bodies[0];
            let exact = place(&end(1e-11, Method::Explicit).0);
            for tolerance in [1e-6, 1e-8, 1e-10] {
                for method in [Method::Explicit, Method::Implicit, Method::Auto] {
                    let (run, time, total) = end(tolerance, method);
                    let (here, cost) = (place(&run), run.cost());
                    let off = here.pose.translation.vector - exact.pose.translation.vector;
                    println!(
                        "| {stiffness:.0e} | {start_name} | {tolerance:.0e} | {method:?} | {} | {} | {} | {:.1} | {:.1e} | {:.1e} | {:.1e} |",
                        cost.steps,
                        cost.implicit_steps,
                        cost.evaluations,
                        1e3 * time,
                        off.norm(),
                        (here.twist - exact.twist).norm(),
                        run.sample_now().ledger().total() - total
                    );
                }
            }
        }
    }
}

/// Cost of a right-hand side per rod, in chains of equally many rods and bodies hung from the ground.
fn chains() {
    println!("| rods | right-hand sides | us a right-hand side | the same for each rod |");
    println!("| --- | --- | --- | --- |");
    for count in [1, 2, 4, 8, 16] {
        let (one, _) = assembly();
        let (carrier, link) = (&one.carriers()[0], &one.links()[0]);
        let links = (0..count).map(|k| {
            let from = match k {
                0 => Attachment::ground(Isometry3::identity()),
                _ => Attachment::body(k - 1, Isometry3::identity()),
            };
            let to = Attachment::body(k, Isometry3::identity());
            Link::new(link.rod().clone(), from, to, Joint::Weld)
        });
        let chain = Assembly::new(vec![carrier.clone(); count], links.collect());
        let chain = chain.expect("a chain");
        let found = chain.equilibrium(None, 1e-10).expect("an equilibrium");
        let mut start = found.now;
        start.bodies[count - 1].twist = Vector6::new(0.1, -0.2, 0.1, 0.1, 0.2, 0.0);
        let (mut best, mut evaluations) = (f64::INFINITY, 0);
        for _ in 0..5 {
            let options = options(0.2, 1e-8, Method::Explicit);
            let mut run = AssemblyRun::new(chain.clone(), &start, options).expect("a run");
            let clock = Instant::now();
            while run.advance().is_some() {}
            evaluations = run.cost().evaluations;
            best = best.min(clock.elapsed().as_secs_f64() / evaluations as f64);
        }
        println!(
            "| {count} | {evaluations} | {:.1} | {:.1} |",
            1e6 * best,
            1e6 * best / count as f64
        );
    }
}

fn name(method: Method) -> &'static str {
    match method {
        Method::Symmetric => "symmetric",
        Method::Auto => "auto",
        _ => "explicit",
    }
}

/// Observation of a motion at one time.
struct Seen<const N: usize> {
    /// Coordinates and velocities, from which the motion can be continued.
    at: [SVector<f64, N>; 2],
    pose: DVector<f64>,
    energy: f64,
}

/// A motion without folds that can start from any state.
trait Swing<const N: usize> {
    /// Approximate period, in the time units of the motion.
    fn period(&self) -> f64;

    fn start(&self) -> [SVector<f64, N>; 2];

    /// Observations at `times` of the motion from a state, with the numbers of steps and right-hand sides.
    fn seen(
        &self,
        from: &[SVector<f64, N>; 2],
        times: &[f64],
        tolerance: f64,
        method: Method,
    ) -> (Vec<Seen<N>>, [u64; 2]);

    /// State after a duration, from a given state.
    fn end(
        &self,
        from: &[SVector<f64, N>; 2],
        duration: f64,
        tolerance: f64,
        method: Method,
    ) -> Seen<N> {
        let (mut seen, _) = self.seen(from, &[duration], tolerance, method);
        seen.pop().expect("an end")
    }
}

fn long(duration: f64, tolerance: f64, method: Method) -> Options {
    Options {
        max_steps: 1_000_000_000,
        ..options(duration, tolerance, method)
    }
}

/// Steps a motion with `advance` and calls `look` at the given times.
fn follow<R>(
    run: &mut R,
    times: &[f64],
    advance: impl Fn(&mut R) -> Option<Event>,
    mut look: impl FnMut(&mut R, f64),
) {
    let mut left = times.iter().peekable();
    while let Some(event) = advance(run) {
        match event {
            Event::Step { to, .. } => {
                while let Some(t) = left.next_if(|t| **t <= to * (1.0 + 1e-14)) {
                    look(run, t.min(to));
                }
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
    }
    assert!(left.next().is_none(), "it ended before its time");
}

/// The body on a rod in space of [`assembly`]: a state is the wrench in the chart and the twist.
struct InSpace {
    assembly: Assembly,
    start: [Vector6<f64>; 2],
    period: f64,
}

impl InSpace {
    fn new() -> Self {
        let (assembly, start) = assembly();
        let found = assembly.equilibrium(None, 1e-10).expect("an equilibrium");
        let modes = assembly.modes(&found.now, 1e-10).expect("modes");
        Self {
            assembly,
            start: [start.charts[0], start.bodies[0].twist],
            period: 2.0 * PI / modes.frequencies[0],
        }
    }
}

impl Swing<6> for InSpace {
    fn period(&self) -> f64 {
        self.period
    }

    fn start(&self) -> [Vector6<f64>; 2] {
        self.start
    }

    fn seen(
        &self,
        from: &[Vector6<f64>; 2],
        times: &[f64],
        tolerance: f64,
        method: Method,
    ) -> (Vec<Seen<6>>, [u64; 2]) {
        let [q, twist] = *from;
        let pose = self.assembly.links()[0]
            .end(&q, 1e-14)
            .expect("an end")
            .pose;
        let start = Configuration {
            bodies: vec![BodyMotion { pose, twist }],
            charts: vec![q],
            spins: Vec::new(),
        };
        let options = long(times[times.len() - 1], tolerance, method);
        let run = AssemblyRun::new(self.assembly.clone(), &start, options);
        let (mut run, mut seen) = (run.expect("a run"), Vec::new());
        follow(&mut run, times, AssemblyRun::advance, |run, t| {
            let sample = run.state_at(t).expect("a time of the step");
            let now = &sample.at.now;
            let BodyMotion { pose, twist } = now.bodies[0];
            let rotation = pose.rotation.to_rotation_matrix();
            let pose = pose.translation.vector.iter().chain(rotation.matrix());
            seen.push(Seen {
                at: [now.charts[0], twist],
                pose: DVector::from_vec(pose.copied().collect()),
                energy: sample.ledger().total(),
            });
        });
        let cost = run.cost();
        (seen, [cost.steps, cost.evaluations])
    }
}

/// A motion in the plane: the body, and its start on the chart with a velocity.
struct InPlane {
    body: PointMass<2>,
    start: [Vector2<f64>; 2],
}

impl InPlane {
    /// Under a dead load (-8, -2), which throws the body to and fro; or under one that holds the rod taut, with a
    /// velocity.
    fn new(thrown: bool) -> Self {
        let start = if thrown {
            Equilibrium::from_lambda_kappa(1.9, 0.35)
        } else {
            Equilibrium::from_lambda_p(4.0, 3.0)
        };
        let start = start.expect("an equilibrium");
        let (load, v) = if thrown {
            (Vector2::new(-8.0, -2.0), Vector2::zeros())
        } else {
            (-Vector2::from(start.force), Vector2::new(0.1, 0.05))
        };
        let body = PointMass::new(1.0).and_then(|b| b.with_dead_force(load));
        Self {
            body: body.expect("a body"),
            start: [[start.p, start.w].into(), v],
        }
    }
}

impl Swing<2> for InPlane {
    fn period(&self) -> f64 {
        1.3
    }

    fn start(&self) -> [Vector2<f64>; 2] {
        self.start
    }

    fn seen(
        &self,
        from: &[Vector2<f64>; 2],
        times: &[f64],
        tolerance: f64,
        method: Method,
    ) -> (Vec<Seen<2>>, [u64; 2]) {
        let options = long(times[times.len() - 1], tolerance, method);
        let run = Run::new(&Elastica, &self.body, from[0], from[1], options);
        let (mut run, mut seen) = (run.expect("a run"), Vec::new());
        follow(&mut run, times, Run::next, |run, t| {
            let sample = run.sample(t).expect("a time of the step");
            seen.push(Seen {
                at: [sample.phase.q, sample.phase.v],
                pose: DVector::from_column_slice(sample.pose.as_slice()),
                energy: sample.ledger.total(),
            });
        });
        let cost = run.cost();
        (seen, [cost.steps, cost.evaluations])
    }
}

fn row(numbers: impl IntoIterator<Item = f64>) -> String {
    let cells = numbers.into_iter().map(|x| format!(" {x:.1e} |"));
    cells.collect()
}

/// Times 0 and 1, 10, 100, ... periods.
fn decades(periods: f64, period: f64) -> Vec<f64> {
    let decades = (0..).map(|k| 10f64.powi(k));
    let decades = decades.take_while(|n| *n <= periods);
    std::iter::once(0.0)
        .chain(decades.map(|n| n * period))
        .collect()
}

/// Energy error, reversal error and mean rate of separation of neighbours after 1, 10, 100, ... periods. The reversal
/// error is the distance from the start after running back, from at most `turned` periods.
fn long_runs<const N: usize>(
    motion: &str,
    swing: &impl Swing<N>,
    periods: f64,
    turned: f64,
    kinds: &[(Method, f64)],
) {
    let start = swing.start();
    println!(
        "| motion | steps are | tolerance | energy gained after 1 period | 10 | 100 .. | steps | right-hand sides |"
    );
    let mut off = String::new();
    for &(method, tolerance) in kinds {
        let times = decades(periods, swing.period());
        let (seen, cost) = swing.seen(&start, &times, tolerance, method);
        let (first, later) = seen.split_first().expect("the start");
        let head = format!("| {motion} | {} | {tolerance:.0e} |", name(method));
        let gained = row(later.iter().map(|seen| seen.energy - first.energy));
        println!("{head}{gained} {} | {} |", cost[0], cost[1]);
        let back = times[1..].iter().zip(later);
        let back = back.take_while(|(t, _)| **t <= turned * swing.period());
        let returned = back.map(|(t, seen)| {
            let end = swing.end(&[seen.at[0], -seen.at[1]], *t, tolerance, method);
            let pose = (end.pose - &first.pose).norm();
            pose.hypot((end.at[1] + first.at[1]).norm())
        });
        off += &format!("{head}{}\n", row(returned));
    }
    println!("\nOff the start:\n{off}");
}

/// Prints the rates of [`parting`].
fn part<const N: usize>(motion: &str, swing: &impl Swing<N>, periods: f64) {
    println!(
        "Neighbours part:\n| {motion} |{}\n",
        row(parting(swing, periods))
    );
}

/// Mean growth rate per period of the logarithmic distance of a neighbour over the first 1, 10, 100, ... periods; the
/// neighbour is moved close again after each period.
fn parting<const N: usize>(swing: &impl Swing<N>, periods: f64) -> Vec<f64> {
    const NEAR: f64 = 1e-8;
    let mut here = swing.start();
    let mut by = [SVector::zeros(); 2];
    by[0][0] = NEAR;
    let (mut grown, mut rates, mut next) = (0.0, Vec::new(), 1);
    for period in 1..=periods as u64 {
        let beside = [here[0] + by[0], here[1] + by[1]];
        let [now, there] =
            [here, beside].map(|from| swing.end(&from, swing.period(), 1e-12, Method::Explicit).at);
        by = [there[0] - now[0], there[1] - now[1]];
        let distance = by[0].norm().hypot(by[1].norm());
        by = by.map(|part| part * (NEAR / distance));
        grown += (distance / NEAR).ln();
        here = now;
        if period == next {
            rates.push(grown / period as f64);
            next *= 10;
        }
    }
    rates
}

fn in_plane(periods: f64) {
    let mut kinds = Vec::new();
    for method in [Method::Auto, Method::Symmetric] {
        kinds.extend([1e-8, 1e-10, 1e-12].map(|tolerance| (method, tolerance)));
    }
    for (motion, thrown) in [("swings", false), ("thrown", true)] {
        let swing = InPlane::new(thrown);
        long_runs(motion, &swing, periods, periods, &kinds);
        part(motion, &swing, periods);
    }
}

/// Long runs in space. Reversal and neighbours cover at most a tenth of the periods: a period costs a hundred times
/// that in the plane. `row` selects one row.
fn in_space(periods: f64, row: Option<&[String]>) {
    let mut kinds = Vec::new();
    for method in [Method::Auto, Method::Symmetric, Method::Explicit] {
        kinds.extend([1e-8, 1e-10, 1e-12].map(|tolerance| (method, tolerance)));
    }
    if let Some(row) = row {
        kinds.retain(|(method, tolerance)| row == [name(*method), &format!("{tolerance:e}")]);
    }
    let space = InSpace::new();
    long_runs("space", &space, periods, periods / 10.0, &kinds);
    if row.is_none_or(|row| row == ["parting"]) {
        part("space", &space, periods / 10.0);
    }
}

fn main() {
    let asked: Vec<String> = std::env::args()
        .skip(1)
        .filter(|x| x != "--bench")
        .collect();
    let periods = asked.get(1).and_then(|x| x.parse().ok());
    let periods = periods.unwrap_or(100_000.0);
    match asked.first().map(String::as_str) {
        Some("stiff") => stiff_rods(),
        Some("chains") => chains(),
        Some("plane") => in_plane(periods),
        Some("space") => in_space(periods, asked.get(2..).filter(|row| !row.is_empty())),
        _ => {
            work_precision();
            println!();
            stiff_rods();
            println!();
            chains();
        }
    }
}
