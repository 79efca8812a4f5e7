//! Error against work of bodies on elastic rods in space, and energy over long times: `cargo bench --bench long_runs`
//! (in space that takes hours; `-- 100` for a hundred periods takes some minutes; `-- stiff` prints the table of stiff rods
//! alone, `-- chains` that of chains of rods, `-- plane` those of a hundred thousand periods in the plane).
//!
//! One uniform linear rod with a welded body, kicked: a motion without folds. Its exact end is that of a run at the tolerance
//! 1e-13. A period is that of the slowest mode about the equilibrium.

use nalgebra::{Isometry3, Matrix3, Vector2, Vector3, Vector6};
use snaprod::assembly::{Assembly, Attachment, Carrier, Configuration, Joint, Link, Place};
use snaprod::body::{Body, RigidBody};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, Outcome, Run, Sample, State};
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
        bodies: vec![Place {
            pose: link.end(&Vector6::zeros(), 1e-14).expect("an end").pose,
            twist: Vector6::new(0.4, -0.6, 0.5, 0.3, 0.5, 0.1),
        }],
        charts: vec![Vector6::zeros()],
        spins: Vec::new(),
    };
    let carriers = vec![Carrier::rigid(body)];
    (
        Assembly::new(carriers, vec![link]).expect("an assembly"),
        start,
    )
}

fn options(duration: f64, tolerance: f64, method: Method) -> Options {
    let options = Options::new(duration).and_then(|o| o.with_tolerance(tolerance));
    options.expect("options").with_method(method)
}

fn run(duration: f64, tolerance: f64, method: Method) -> AssemblyRun {
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

/// A mass of 1 hung by a ball joint under a pull of 20 B/L^2 on a straight rod of bending stiffness 1, which swings with the speed 0.01 at its
/// lowest; and rings if it starts `stretched` by so much more. One unit of time is 0.8 periods of the swing.
fn hanging(stiffness: f64, stretched: f64) -> (Assembly, Configuration) {
    let pull = 20.0;
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| {
            law.with_shear([stiffness, stiffness])?
                .with_axial(stiffness)
        })
        .expect("a law");
    let mass = Body::<3>::new(1.0)
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
        bodies: vec![Place {
            pose: Isometry3::translation(0.0, 0.0, low),
            twist: Vector6::new(0.0, 0.0, 0.0, 9e-3, 4e-3, 0.0),
        }],
        charts: vec![q],
        spins: Vec::new(),
    };
    let carriers = vec![Carrier::point(mass)];
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

/// Chains of as many rods as bodies, hung from the ground: what a right-hand side costs for each of them.
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

fn energy_in_space(periods: f64, tolerance: f64, method: Method) {
    let (assembly, _) = assembly();
    let found = assembly.equilibrium(None, 1e-10).expect("an equilibrium");
    let slowest = assembly.modes(&found.now, 1e-10).expect("modes");
    let period = 2.0 * PI / slowest.frequencies[0];
    let mut run = run(periods * period, tolerance, method);
    let total = run.sample_now().ledger().total();
    let mut next = 1.0;
    print!("| space | {} | {tolerance:.0e} |", name(method));
    while let Some(event) = run.advance() {
        match event {
            Event::Step { to, .. } => {
                if to >= next * period {
                    print!(" {:.1e} |", run.sample_now().ledger().total() - total);
                    next *= 10.0;
                }
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
    }
    println!(" {} | {} |", run.cost().steps, run.cost().evaluations);
}

/// About that of the motions in the plane, in their units of time.
const PERIOD: f64 = 1.3;

/// A motion in the plane: the body, and its start on the chart with a velocity.
struct Swing {
    body: Body<2>,
    q: Vector2<f64>,
    v: Vector2<f64>,
}

impl Swing {
    /// Under a dead load (-8, -2), which throws the body to and fro; or under one that holds the rod taut, with a velocity.
    fn new(thrown: bool) -> Self {
        let start = match thrown {
            true => Equilibrium::from_lambda_kappa(1.9, 0.35),
            false => Equilibrium::from_lambda_p(4.0, 3.0),
        };
        let start = start.expect("an equilibrium");
        let (load, v) = match thrown {
            true => (Vector2::new(-8.0, -2.0), Vector2::zeros()),
            false => (-Vector2::from(start.force), Vector2::new(0.1, 0.05)),
        };
        let body = Body::new(1.0).and_then(|b| b.with_dead_force(load));
        Self {
            body: body.expect("a body"),
            q: [start.p, start.w].into(),
            v,
        }
    }

    /// The run of so many times [`PERIOD`] from here.
    fn run(&self, periods: f64, tolerance: f64, method: Method) -> Run<'_, Elastica, 2> {
        let options = Options {
            max_steps: 100_000_000,
            ..options(periods * PERIOD, tolerance, method)
        };
        Run::new(&Elastica, &self.body, self.q, self.v, options).expect("a run")
    }

    /// The same body from elsewhere.
    fn from(&self, q: Vector2<f64>, v: Vector2<f64>) -> Self {
        let body = self.body.clone();
        Self { body, q, v }
    }

    /// Where it is after so many periods.
    fn end(&self, periods: f64, tolerance: f64, method: Method) -> Sample<2> {
        let mut run = self.run(periods, tolerance, method);
        let stop = std::iter::from_fn(|| run.next()).find_map(|event| match event {
            Event::Step { .. } => None,
            Event::Stop(outcome) => Some(outcome),
            other => panic!("{other:?}"),
        });
        assert_eq!(stop, Some(Outcome::EndOfTime));
        run.now()
    }
}

/// The samples after 1, 10, 100 .. `periods`, and how many steps and right-hand sides it took.
fn decades(mut run: Run<'_, Elastica, 2>, periods: f64) -> (Vec<Sample<2>>, [u64; 2]) {
    let (mut samples, mut next) = (Vec::new(), 1.0);
    while let Some(event) = run.next() {
        match event {
            Event::Step { to, .. } => {
                while next <= periods && next * PERIOD <= to * (1.0 + 1e-14) {
                    let sample = run.sample((next * PERIOD).min(to));
                    samples.push(sample.expect("a time of the step"));
                    next *= 10.0;
                }
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            other => panic!("{other:?}"),
        }
    }
    let cost = run.cost();
    (samples, [cost.steps, cost.evaluations])
}

/// How far two states are apart in pose and velocity.
fn apart(a: &Sample<2>, b: &Sample<2>) -> f64 {
    (a.pose - b.pose)
        .norm()
        .hypot((a.phase.v - b.phase.v).norm())
}

fn row(numbers: impl IntoIterator<Item = f64>) -> String {
    let cells = numbers.into_iter().map(|x| format!(" {x:.1e} |"));
    cells.collect()
}

/// Energy gained, how far off the start the motion is that is turned round and runs back, and the mean rate at which neighbours part, after so many periods.
fn plane(periods: f64) {
    println!("| motion | steps are | tolerance | after 1 period | 10 | 100 .. |");
    for (motion, thrown) in [("swings", false), ("thrown", true)] {
        let swing = Swing::new(thrown);
        let (mut gained, mut off) = (String::new(), String::new());
        for method in [Method::Auto, Method::Symmetric] {
            for tolerance in [1e-8, 1e-10, 1e-12] {
                let run = swing.run(periods, tolerance, method);
                let start = run.now();
                let (samples, cost) = decades(run, periods);
                let head = format!("| {motion} | {} | {tolerance:.0e} |", name(method));
                let energy = |s: &Sample<2>| s.ledger.total() - start.ledger.total();
                let cells = row(samples.iter().map(energy));
                gained += &format!("{head}{cells} {} | {} |\n", cost[0], cost[1]);
                let returned = samples.iter().map(|s| {
                    let back = swing.from(s.phase.q, -s.phase.v);
                    let mut end = back.end(s.phase.t / PERIOD, tolerance, method);
                    end.phase.v = -end.phase.v;
                    apart(&end, &start)
                });
                off += &format!("{head}{}\n", row(returned));
            }
        }
        println!("Energy gained, steps, right-hand sides:\n{gained}Off the start:\n{off}");
        println!(
            "Neighbours part:\n| {motion} |{}\n",
            row(parting(swing, periods))
        );
    }
}

/// The rate, per period, at which a neighbour's logarithmic distance grew on the average of the first 1, 10, 100 .. periods, brought near again after each of them.
fn parting(mut swing: Swing, periods: f64) -> Vec<f64> {
    const NEAR: f64 = 1e-8;
    let mut by = [Vector2::x() * NEAR, Vector2::zeros()];
    let (mut grown, mut rates, mut next) = (0.0, Vec::new(), 1);
    for period in 1..=periods as u64 {
        let beside = swing.from(swing.q + by[0], swing.v + by[1]);
        let [here, there] = [&swing, &beside].map(|s| s.end(1.0, 1e-12, Method::Explicit).phase);
        by = [there.q - here.q, there.v - here.v];
        let distance = by[0].norm().hypot(by[1].norm());
        by = by.map(|part| part * (NEAR / distance));
        grown += (distance / NEAR).ln();
        swing = swing.from(here.q, here.v);
        if period == next {
            rates.push(grown / period as f64);
            next *= 10;
        }
    }
    rates
}

fn main() {
    if std::env::args().any(|x| x == "stiff") {
        return stiff_rods();
    }
    if std::env::args().any(|x| x == "chains") {
        return chains();
    }
    let periods = std::env::args().skip(1).find_map(|x| x.parse().ok());
    if std::env::args().any(|x| x == "plane") {
        return plane(periods.unwrap_or(100_000.0));
    }
    let periods = periods.unwrap_or(10_000.0);
    work_precision();
    println!(
        "\n| motion | steps are | tolerance | after 1 period | 10 | 100 | 1000 | 10000 | steps | right-hand sides |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for method in [Method::Auto, Method::Symmetric] {
        for tolerance in [1e-8, 1e-10, 1e-12] {
            energy_in_space(periods, tolerance, method);
        }
    }
    println!();
    stiff_rods();
    println!();
    chains();
}
