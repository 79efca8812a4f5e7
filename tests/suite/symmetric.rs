//! Structure-preserving steps: symmetry, reversibility, order 12, and energy conservation in long motions.

use crate::eightfold::OneByOne;
use crate::support::worst;
use nalgebra::{Isometry3, Matrix3, SVector, Vector2, Vector3, Vector4, Vector6, vector};
use snaprod::assembly::{Assembly, Attachment, Body, BodyMotion, Configuration, Joint, Link};
use snaprod::body::{PointMass, RigidBody};
use snaprod::elastica::{Elastica, Equilibrium};
use snaprod::manifold::Multivalued;
use snaprod::motion::assembly::AssemblyRun;
use snaprod::motion::{Event, Motion, Options, Outcome, Run};
use snaprod::rod::Rod;
use snaprod::section::Linear;
use snaprod::solve::dop853;
use snaprod::solve::gauss::{Gauss, Reversible};
use snaprod::solve::integrator::Method;

/// Position and velocity of a planet about a sun at the origin.
#[derive(Debug, Clone, Copy)]
struct Planet(Vector4<f64>);

impl dop853::State for Planet {
    fn axpy(&mut self, a: f64, x: &Self) {
        self.0 += a * x.0;
    }

    fn mean_square(&self, from: &Self, to: &Self) -> f64 {
        dop853::State::mean_square(&self.0, &from.0, &to.0)
    }
}

impl Reversible for Planet {
    /// Steps longer where the planet is far: as r^(3/2).
    fn pace_squared(&self, at: &Self) -> f64 {
        (at.0.x * at.0.x + at.0.y * at.0.y).powf(-1.5)
    }
}

impl Planet {
    /// At its nearest, on an ellipse of half axis 1.
    fn new(eccentricity: f64) -> Self {
        let e = eccentricity;
        Self(vector![1.0 - e, 0.0, 0.0, ((1.0 + e) / (1.0 - e)).sqrt()])
    }

    fn slope(&self, out: &mut Self) -> Option<()> {
        let r3 = (self.0.x * self.0.x + self.0.y * self.0.y).powf(1.5);
        out.0 = vector![self.0.z, self.0.w, -self.0.x / r3, -self.0.y / r3];
        Some(())
    }

    fn energy(&self) -> f64 {
        0.5 * (self.0.z.powi(2) + self.0.w.powi(2)) - 1.0 / self.0.x.hypot(self.0.y)
    }

    fn turned(&self) -> Self {
        Self(vector![self.0.x, self.0.y, -self.0.z, -self.0.w])
    }
}

/// Takes `steps` steps of the fixed length `h`, which is below the length allowed by the tolerance.
fn flown(from: Planet, h: f64, steps: usize, mut look: impl FnMut(&Planet)) -> Planet {
    let mut slope = from;
    from.slope(&mut slope).expect("a slope");
    let mut solver = Gauss::new(from, slope, 2.0 * h, 1e-2).expect("a start");
    for _ in 0..steps {
        solver.step(Planet::slope, h).expect("a step");
        look(solver.state());
    }
    *solver.state()
}

/// Would catch a wrong digit of the tableau, and stages that are not solved to rounding.
#[test]
fn the_order_is_twelve() {
    let end = |steps: usize| flown(Planet::new(0.3), 5.0 / steps as f64, steps, |_| ());
    let exact = end(64).0;
    let [coarse, fine] = [7, 14].map(|steps| (end(steps).0 - exact).norm());
    let order = (coarse / fine).log2();
    assert!(
        (11.3..12.8).contains(&order),
        "{order}: {coarse:e} {fine:e}"
    );
}

/// Would catch steps that are not their own inverse, as with any step choice by the error of the last step.
#[test]
fn steps_turned_round_lead_back_to_rounding() {
    let start = Planet::new(0.6);
    let far = flown(start, 0.3, 1000, |_| ());
    let back = flown(far.turned(), 0.3, 1000, |_| ());
    let off = (back.turned().0 - start.0).norm();
    // Rounding grows along a Kepler orbit in proportion to the square of time.
    assert!(off < 1e-10, "{off:e}");
    // Single steps are inverse to rounding itself.
    let back = flown(flown(start, 0.3, 1, |_| ()).turned(), 0.3, 1, |_| ());
    let off = (back.turned().0 - start.0).norm();
    assert!(off < 1e-15, "{off:e}");
}

/// Would catch a defect of the energy of one sign: over a thousand orbits it would be a hundred times that of ten.
#[test]
fn the_energy_of_a_planet_does_not_drift() {
    let start = Planet::new(0.6);
    let mut worst = [0.0_f64; 2];
    let mut count = 0;
    flown(start, 0.6, 10_000, |planet| {
        count += 1;
        let error = (planet.energy() - start.energy()).abs();
        worst[usize::from(count > 100)] = worst[usize::from(count > 100)].max(error);
    });
    assert!(worst[0] > 1e-13, "steps too small to tell: {worst:?}");
    assert!(worst[1] < 1.5 * worst[0], "{worst:?}");
}

fn options(duration: f64, tolerance: f64, method: Method) -> Options {
    let options = Options::new(duration).and_then(|o| o.with_tolerance(tolerance));
    options.expect("options").with_method(method)
}

/// The largest error of the energy over the first part of a motion, and over all of it.
fn errors<'a>(motion: &mut dyn Motion<'a>, first: f64) -> [f64; 2] {
    let total = motion.now().ledger().total();
    let mut worst = [0.0_f64; 2];
    while let Some(event) = motion.advance() {
        match event {
            Event::Step { to, .. } => {
                let error = (motion.now().ledger().total() - total).abs();
                assert!(error.is_finite());
                worst[1] = worst[1].max(error);
                if to <= first {
                    worst[0] = worst[1];
                }
            }
            Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
            Event::Bounce(_) => {}
            other => panic!("{other:?}"),
        }
    }
    worst
}

/// A mass on an elastica that swings widely under a dead load.
fn swing(
    body: &PointMass<2>,
    duration: f64,
    tolerance: f64,
    method: Method,
) -> Run<'_, Elastica, 2> {
    swing_on(&Elastica, body, options(duration, tolerance, method))
}

fn swing_on<'a, M: Multivalued<2>>(
    manifold: &'a M,
    body: &'a PointMass<2>,
    options: Options,
) -> Run<'a, M, 2> {
    let rest = Equilibrium::from_lambda_kappa(1.9, 0.35).expect("an equilibrium");
    Run::new(
        manifold,
        body,
        [rest.p, rest.w].into(),
        Vector2::zeros(),
        options,
    )
    .expect("a run")
}

/// Long-term energy: the error of explicit steps grows with time, that of symmetric steps does not. Would catch any
/// step with a defect of one sign, and a step choice that depends on the past. Collocation steps, as long as their
/// error allows, lose more than symmetric ones, too.
#[test]
fn the_energy_in_the_plane_does_not_drift() {
    let body = PointMass::<2>::new(1.0)
        .and_then(|b| b.with_dead_force(vector![-8.0, -2.0]))
        .expect("a body");
    let [first, all] = errors(&mut swing(&body, 1200.0, 1e-8, Method::Symmetric), 130.0);
    assert!(all < 5.0 * first, "{first:e}, later {all:e}");
    assert!(all < 5e-9, "{all:e}");
    let mut explicit = swing_on(&OneByOne, &body, options(1200.0, 1e-8, Method::Auto));
    let [first, drifted] = errors(&mut explicit, 130.0);
    assert!(
        drifted > 4.0 * first && drifted > 50.0 * all,
        "explicit: {first:e}, later {drifted:e}; symmetric: {all:e}"
    );
    let [_, fitted] = errors(&mut swing(&body, 1200.0, 1e-8, Method::Auto), 130.0);
    assert!(
        fitted > 50.0 * all && fitted < drifted,
        "by collocation: {fitted:e}; explicit {drifted:e}; symmetric: {all:e}"
    );
}

/// Reference motion computed with 30 digits, from rest on the equilibrium of lowest energy.
fn reference(name: &str, body: &PointMass<2>, tolerance: f64) -> f64 {
    let path = format!(
        "{}/tests/data/motion_{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let data: serde_json::Value = serde_json::from_str(&text).expect("data");
    let rows: Vec<[f64; 5]> = serde_json::from_value(data["rows"].clone()).expect("rows");
    let q = Elastica
        .stable_at(&vector![rows[0][1], rows[0][2]])
        .expect("starts")[0];
    let options = options(20.0, tolerance, Method::Symmetric);
    let mut run = Run::new(&Elastica, body, q, Vector2::zeros(), options).expect("a run");
    let (mut next, mut off) = (0, 0.0_f64);
    while let Some(event) = run.next() {
        if let Event::Step { to, .. } = event {
            while next < rows.len() && rows[next][0] <= to {
                let row = rows[next];
                let seen = run.sample(row[0]).expect("inside the step");
                let r = (seen.pose - vector![row[1], row[2]]).norm();
                let v = (seen.phase.v - vector![row[3], row[4]]).norm();
                off = worst([off, r, v]);
                next += 1;
            }
        }
    }
    assert_eq!(next, rows.len());
    off
}

/// Would catch samples that are only as good as a polynomial inside long steps, an end or a bounce that is missed.
#[test]
fn reference_motions_in_the_plane_are_met_inside_the_steps() {
    let free = || PointMass::<2>::new(1.0).expect("a body");
    let loaded = free().with_dead_force(vector![-8.0, -2.0]).expect("a load");
    let error = reference("W", &loaded, 1e-12);
    assert!(error < 1e-9, "W: {error:e}");
    let error = reference("B", &free(), 1e-11);
    assert!(error < 1e-6, "B: {error:e}");
}

/// A fold is found in long steps, and the motion continues (theory 2.6).
#[test]
fn a_snap_in_the_plane_is_the_reference() {
    let start = Equilibrium::from_lambda_kappa(6.3, 0.6).expect("an equilibrium");
    let body = PointMass::<2>::new(1.0).expect("a body");
    let options = options(3.0, 1e-12, Method::Symmetric);
    let q = [start.p, start.w].into();
    let mut run = Run::new(&Elastica, &body, q, vector![0.0, -0.5], options).expect("a run");
    let total = run.now().ledger.total();
    let mut snaps = Vec::new();
    for event in run.by_ref() {
        if let Event::Snap(snap) = event {
            snaps.push(snap);
        }
    }
    assert_eq!(snaps.len(), 1);
    assert!((snaps[0].t - 0.025570197858).abs() < 1e-10);
    let end = run.now();
    assert!((end.pose - vector![0.7925457, -0.1708947]).norm() < 1e-6);
    assert!((end.ledger.total() - total).abs() < 1e-10 * end.ledger.largest());
}

/// A body on a bent rod in space, kicked; optionally with a second body hung on the first by an equal rod.
fn start(second: bool) -> (Assembly, Configuration) {
    let law = Linear::diagonal([1.0, 1.3], 0.8)
        .and_then(|law| law.with_shear([120.0, 120.0])?.with_axial(300.0))
        .and_then(|law| law.with_rest([0.3, 0.1], 0.2))
        .expect("a law");
    let body = RigidBody::new(1.0, Matrix3::from_diagonal(&Vector3::new(0.3, 0.2, 0.25)))
        .and_then(|body| body.with_centre(Vector3::new(0.05, 0.0, 0.1)))
        .and_then(|body| body.with_gravity(Vector3::new(0.3, 0.0, -0.5)))
        .expect("a body");
    let rod = Rod::new(1.0, law).expect("a rod");
    let here = Isometry3::identity();
    let link = |from: Attachment, to: usize| {
        Link::new(rod.clone(), from, Attachment::body(to, here), Joint::Weld)
    };
    let mut links = vec![link(Attachment::ground(here), 0)];
    let end = links[0].end(&Vector6::zeros(), 1e-14).expect("an end").pose;
    let mut bodies = vec![BodyMotion {
        pose: end,
        twist: Vector6::new(0.4, -0.6, 0.5, 0.3, 0.5, 0.1),
    }];
    if second {
        links.push(link(Attachment::body(0, here), 1));
        bodies.push(BodyMotion::at_rest(end * end));
    }
    let now = Configuration {
        charts: vec![Vector6::zeros(); links.len()],
        bodies,
        spins: Vec::new(),
    };
    let carriers = vec![Body::rigid(body); links.len()];
    (Assembly::new(carriers, links).expect("an assembly"), now)
}

fn kicked(method: Method, duration: f64, tolerance: f64) -> AssemblyRun<'static> {
    let (assembly, start) = start(false);
    AssemblyRun::new(assembly, &start, options(duration, tolerance, method)).expect("a run")
}

fn ended<'a>(motion: &mut dyn Motion<'a>) {
    let mut outcome = None;
    while let Some(event) = motion.advance() {
        if let Event::Stop(end) = event {
            outcome = Some(end);
        }
    }
    assert_eq!(outcome, Some(Outcome::EndOfTime));
}

/// Would catch a part of a run that distinguishes forward from backward: after reversal of the final velocities a run
/// returns to the reversed start, in the plane and in space, of one body and of two. (The two runs choose their steps
/// independently and end by a shortened one, so that they agree to the tolerance, not to rounding.)
#[test]
fn whole_runs_turned_round_lead_back() {
    let body = PointMass::<2>::new(1.0)
        .and_then(|b| b.with_dead_force(vector![-8.0, -2.0]))
        .expect("a body");
    let mut there = swing(&body, 10.0, 1e-10, Method::Symmetric);
    let from = (there.now().pose, there.now().phase.v);
    ended(&mut there);
    let end = there.now();
    let set = options(10.0, 1e-10, Method::Symmetric);
    let mut back = Run::new(&Elastica, &body, end.phase.q, -end.phase.v, set).expect("a run");
    ended(&mut back);
    let off = (back.now().pose - from.0)
        .norm()
        .max((back.now().phase.v + from.1).norm());
    assert!(off <= PLANE, "in the plane {off:e} off");
    for (second, duration, bound) in [(false, 8.0, ONE), (true, 4.0, TWO)] {
        let (assembly, from) = start(second);
        let set = || options(duration, 1e-10, Method::Symmetric);
        let mut there = AssemblyRun::new(assembly.clone(), &from, set()).expect("a run");
        ended(&mut there);
        let mut end = there.sample_now().at.now;
        let gone =
            (end.bodies[0].pose.translation.vector - from.bodies[0].pose.translation.vector).norm();
        assert!(gone > 0.05, "it should be elsewhere: {gone}");
        end.bodies
            .iter_mut()
            .for_each(|place| place.twist.neg_mut());
        let mut back = AssemblyRun::new(assembly, &end, set()).expect("a run");
        ended(&mut back);
        let found = back.sample_now().at.now;
        for (a, b) in found.bodies.iter().zip(&from.bodies) {
            let off = (a.pose.translation.vector - b.pose.translation.vector)
                .norm()
                .max(a.pose.rotation.angle_to(&b.pose.rotation))
                .max((a.twist + b.twist).norm());
            assert!(off <= bound, "in space {off:e} off");
        }
    }
}

/// Bounds of the distance from the start, at the tolerance 1e-10.
const PLANE: f64 = 1e-9;
const ONE: f64 = 1e-12;
const TWO: f64 = 1e-12;

/// Would catch a step clock that differs between the two directions, and samples off the motion.
#[test]
#[ignore = "second tier: 3 s"]
fn the_energy_in_space_stays_and_the_motion_is_the_same() {
    let [first, all] = errors(&mut kicked(Method::Symmetric, 60.0, 1e-6), 30.0);
    assert!(all < 3.0 * first, "{first:e}, later {all:e}");
    assert!(all < 1e-8, "{all:e}");
    let [_, drifted] = errors(&mut kicked(Method::Auto, 60.0, 1e-6), 30.0);
    assert!(
        drifted > 20.0 * all,
        "explicit {drifted:e}, symmetric {all:e}"
    );
    let seen = |method, tolerance| {
        let mut run = kicked(method, 2.0, tolerance);
        let mut seen = Vec::new();
        while let Some(event) = run.advance() {
            if let Event::Step { to, .. } = event {
                while (seen.len() as f64) * 0.37 <= to {
                    let at = run
                        .state_at(seen.len() as f64 * 0.37)
                        .expect("inside the step");
                    seen.push(at.at.now.bodies[0]);
                }
            }
        }
        seen
    };
    let (a, b) = (seen(Method::Symmetric, 1e-10), seen(Method::Auto, 1e-12));
    assert_eq!((a.len(), b.len()), (6, 6));
    for (a, b) in a.iter().zip(&b) {
        let off = (a.pose.translation.vector - b.pose.translation.vector)
            .norm()
            .max(a.pose.rotation.angle_to(&b.pose.rotation))
            .max((a.twist - b.twist).norm());
        assert!(off < 1e-9, "{off:e}");
    }
}

/// A strip that is hard to bend out of its plane snaps in space where the elastica does, by steps that pass through
/// the fold; implicit ones leave the fold to explicit ones.
#[test]
fn a_snap_in_space_is_that_of_the_plane() {
    let start = Equilibrium::from_lambda_kappa(6.3, 0.6).expect("an equilibrium");
    let q: SVector<f64, 2> = [start.p, start.w].into();
    let at = snaprod::manifold::EquilibriumManifold::point(&Elastica, &q).expect("in the chart");
    let lifted = |v: Vector2<f64>| Vector3::new(v.y, 0.0, v.x);
    let law = Linear::diagonal([20.0, 1.0], 20.0).and_then(|law| law.rigid([true; 3]));
    let rod = Rod::new(1.0, law.expect("a law")).expect("a rod");
    let here = Isometry3::identity();
    let link = Link::new(
        rod,
        Attachment::ground(here),
        Attachment::body(0, here),
        Joint::Ball,
    );
    let bent = start.section(0.0).expect("a section").curvature;
    let n = lifted(-at.force);
    let chart = Vector6::new(0.0, bent, 0.0, n.x, n.y, n.z).component_div(&link.units());
    let place = BodyMotion {
        pose: Isometry3::from_parts(lifted(at.pose).into(), Default::default()),
        twist: Vector6::new(0.0, 0.0, 0.0, -0.5, 0.0, 0.0),
    };
    let now = Configuration {
        bodies: vec![place],
        charts: vec![chart],
        spins: Vec::new(),
    };
    let mass = Body::point(PointMass::new(1.0).expect("a mass"));
    let assembly = Assembly::new(vec![mass], vec![link]).expect("an assembly");
    for method in [Method::Symmetric, Method::Implicit] {
        let options = options(0.2, 1e-10, method);
        let mut run = AssemblyRun::new(assembly.clone(), &now, options).expect("a run");
        let total = run.now().ledger().total();
        let mut snaps = Vec::new();
        while let Some(event) = run.advance() {
            match event {
                Event::Snap(snap) => snaps.push(snap.t),
                Event::Stop(outcome) => assert_eq!(outcome, Outcome::EndOfTime),
                _ => {}
            }
        }
        assert_eq!(snaps.len(), 1);
        assert!((snaps[0] - 0.025570197858).abs() < 1e-10, "{snaps:?}");
        let ledger = run.now().ledger();
        assert!((ledger.total() - total).abs() < 1e-10 * ledger.largest());
    }
}
