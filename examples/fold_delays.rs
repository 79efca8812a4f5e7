//! Delay of a rod with friction or mass at a fold (theory 2.8), and its limits by the normal form of the fold.
//!
//! Three snaps. Friction alone: half of the released energy is lost at 2.338107 T_v after the fold as the viscosity
//! goes to 0, extrapolated in eta^(1/3). Mass alone: the amplitude of the critical shape crosses 0 at 0.715359 T_i as
//! the rod's mass goes to 0, extrapolated in eps^(1/5). Friction alone in an assembly: two arches with a turning heavy
//! body between them, one of which passes its fold.
//!
//! `cargo run --release --example fold_delays` runs the first snap and the assembly. With `-- all` it runs all three
//! snaps, which takes a minute.

use nalgebra::Vector2;
use serde_json::Value;
use snaprod::elastica::{Elastica, Equilibrium, FoldNormalForm, RodInertia};
use snaprod::motion::{Event, LightReference, LightSnap, Motion, State};
use snaprod::scene::{AssemblySetup, Scene};
use snaprod::study::run::{Fields, Prepared, run};
use snaprod::study::{Silent, Table};
use std::f64::consts::LN_2;

type Failure = Box<dyn std::error::Error>;

/// Starts before a fold: lambda, p, velocity; nodes of the full rod.
const SNAPS: [(&str, f64, f64, [f64; 2], usize); 3] = [
    ("S1", 6.4292, 0.855, [-0.799, -0.033], 20),
    ("S2", 5.7354, 2.334, [0.934, 0.359], 28),
    // atanh 0.6 = ln 2.
    ("R", 6.3, LN_2, [0.0, -0.5], 20),
];
/// Escape by friction, the first zero of Airy's function, and the zero of y'' = t + y^2.
const VISCOUS: f64 = 2.338_107_410;
const ZERO: f64 = 0.715_359;
const VISCOSITIES: [f64; 3] = [1e-3, 1e-4, 1e-5];
const MASSES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Points along the rod at which shapes are compared; an even number of intervals.
const PLACES: usize = 200;

fn main() -> Result<(), Failure> {
    let all = std::env::args().any(|argument| argument == "all");
    let snaps = if all { &SNAPS[..] } else { &SNAPS[..1] };
    for &(name, lambda, p, [vx, vy], nodes) in snaps {
        let scene = |set: &[String]| -> Result<Scene, Failure> {
            let text = format!(
                "[rod]\nmodel = \"elastica\"\nlength = 1.0\nbending_stiffness = 1.0\nmass = 1e-3\n[body]\nmass = 1.0\n\
                 [start]\nlambda = {lambda}\np = {p}\nvelocity = [{vx:?}, {vy:?}]\n[run]\nduration = 1.0\n"
            );
            let set: Vec<&str> = set.iter().map(String::as_str).collect();
            Ok(Scene::parse_with(&text, &set)?)
        };
        let mut late = Vec::new();
        for eta in VISCOSITIES {
            let set = [format!("rod.damping={eta:e}"), "run.tolerance=1e-8".into()];
            let scene = scene(&set)?;
            let t = half_release(&scene, eta)?;
            println!(
                "{name} eta {eta:.0e}: half of the energy is released {t:.4} T_v after the fold"
            );
            late.push((eta.cbrt(), t));
        }
        let limit = at_zero(&late);
        println!("{name} limit {limit:.4}, {VISCOUS:.4} by theory");
        assert!((limit / VISCOUS - 1.0).abs() < 0.01);

        let mut late = Vec::new();
        for eps in MASSES {
            let set = [
                "rod.inertia=\"full\"".to_owned(),
                format!("rod.mass={eps:e}"),
                format!("rod.damping={{ proportional = {:e} }}", 0.02 * eps),
                format!("rod.nodes={nodes}"),
                // Start vibrations are below this tolerance, and damped.
                "run.tolerance=1e-6".into(),
            ];
            let t = zero(&scene, &set, eps)?;
            println!("{name} eps {eps:.0e}: the amplitude is 0 at {t:.4} T_i after the fold");
            late.push((eps.powf(0.2), t));
        }
        let limit = at_zero(&late);
        println!("{name} limit {limit:.4}, {ZERO:.4} by theory");
        assert!((limit / ZERO - 1.0).abs() < 0.02);
    }
    let mut late = Vec::new();
    for eta in VISCOSITIES {
        let t = half_release_of_arch(eta)?;
        println!("arch eta {eta:.0e}: half of the energy is released {t:.4} T_v after the fold");
        late.push((eta.cbrt(), t));
    }
    let limit = at_zero(&late);
    println!("arch limit {limit:.4}, {VISCOUS:.4} by theory");
    assert!((limit / VISCOUS - 1.0).abs() < 0.03);
    Ok(())
}

/// Two arches of different length and stiffness in a row. A heavy body between them turns and tilts. In an assembly
/// rods with friction have all of their mass, here almost none.
fn arches(eta: f64) -> String {
    let turn = "quaternion = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]";
    let mass = 1e-4 * eta;
    let rod = |name: &str, from: &str, to: &str, own: &str| {
        format!(
            "[[rod]]\nname = \"{name}\"\nmodel = \"cosserat\"\n{own}\nmass = {mass:e}\nsection_inertia = [{0:e}, {0:e}, {1:e}]\ninertia = \"full\"\n\
             damping = {{ proportional = {eta:e} }}\nnodes = 16\nfrom = {{ {from}, {turn} }}\nto = {{ {to}, {turn} }}\n",
            1e-4 * mass,
            2e-4 * mass,
        )
    };
    let right = "length = 1.25\nsection = { bending = [1.5625, 2.34375], torsion = 1.875 }";
    let left = "length = 1.0\nsection = { bending = [1.0, 1.5], torsion = 1.2 }";
    let body = "body = \"m\"";
    let [near, far] = [
        "position = [0.0, 0.0, 0.0]",
        "position = [2.0475, 0.0, 0.0]",
    ];
    format!(
        "{}{}[[body]]\nname = \"m\"\nmass = 1000.0\ninertia = [1000.0, 1000.0, 1000.0]\nguess = {{ position = [0.91, 0.0, 0.0] }}\n\
         angular_velocity = [0.3, 0.0, 1.0]\n[run]\nduration = 0.5\ntolerance = 1e-6\n",
        rod("right", body, far, right),
        rod("left", near, body, left)
    )
}

/// Time from the fold of an arch until friction has dissipated half of the energy released, in units of T_v. Both
/// quantities come from the run's report of the fold.
fn half_release_of_arch(eta: f64) -> Result<f64, Failure> {
    let scene = Scene::parse(&arches(eta))?;
    let prepared = Prepared::new(&scene)?;
    let mut tables: Vec<Table> = Vec::new();
    let record = run(&prepared, Fields::None, &mut tables, &mut Silent)?;
    let events = record.events();
    let fold = events.iter().find(|event| event["kind"] == "fold");
    let fold = fold.ok_or("no fold was passed")?;
    let number = |path: &str| {
        fold.pointer(path)
            .and_then(Value::as_f64)
            .ok_or("no number")
    };
    let (begun, released) = (number("/t")?, number("/released")?);
    let setup = AssemblySetup::new(&scene)?;
    let (mut motion, _) = setup.motion(&scene)?;
    // In the units of the library.
    let (begun, half) = (
        begun / setup.scales.time,
        0.5 * released / setup.scales.energy,
    );
    let mut before = None;
    while let Some(event) = motion.advance() {
        let Event::Step { from, to } = event else {
            continue;
        };
        if to < begun {
            continue;
        }
        let mut lost = |t: f64| {
            motion
                .sample(t)
                .map(|at| at.ledger().dissipated)
                .ok_or("outside the step")
        };
        let first = match before {
            None => lost(begun)?,
            Some(first) => first,
        };
        before = Some(first);
        if lost(to)? - first < half {
            continue;
        }
        let (mut low, mut high) = (from.max(begun), to);
        for _ in 0..40 {
            let t = 0.5 * (low + high);
            *(if lost(t)? - first < half {
                &mut low
            } else {
                &mut high
            }) = t;
        }
        return Ok((high - begun) * setup.scales.time * VISCOUS / number("/mass/viscous_delay")?);
    }
    Err("half of the energy is not released".into())
}

/// The polynomial through all points, at x = 0.
fn at_zero(points: &[(f64, f64)]) -> f64 {
    let term = |(i, (x, y)): (usize, &(f64, f64))| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        y * others
            .map(|(_, (other, _))| other / (other - x))
            .product::<f64>()
    };
    points.iter().enumerate().map(term).sum()
}

/// The fold with its normal form.
fn passage(fold: &LightSnap) -> Result<FoldNormalForm, Failure> {
    let q = &fold.snap.from.q;
    let v = Vector2::new(fold.snap.velocity[0], fold.snap.velocity[1]);
    Ok(FoldNormalForm::new(q[0], q[1], &v)?)
}

/// Time from the fold until `found` becomes positive, a function of the state that is negative before. Follows the
/// motion up to that point.
fn follow(
    motion: &mut dyn Motion<'_>,
    found: &mut dyn FnMut(&dyn State, &LightSnap) -> f64,
) -> Result<(LightSnap, f64), Failure> {
    let mut beside = LightReference::new(Box::new(Elastica), &*motion.now());
    let mut fold: Option<LightSnap> = None;
    while let Some(event) = motion.advance() {
        let Event::Step { from, to } = event else {
            if let Event::Stop(outcome) = event {
                return Err(format!("{outcome}").into());
            }
            continue;
        };
        fold = fold.or(beside.step(&*motion.now()).into_iter().next());
        let Some(fold) = &fold else { continue };
        if found(&*motion.now(), fold) < 0.0 {
            continue;
        }
        let (mut low, mut high) = (from, to);
        for _ in 0..40 {
            let t = 0.5 * (low + high);
            let state = motion.sample(t).ok_or("outside the step")?;
            *(if found(&*state, fold) < 0.0 {
                &mut low
            } else {
                &mut high
            }) = t;
        }
        return Ok((fold.clone(), high - fold.snap.t));
    }
    Err("no fold was passed".into())
}

/// Time from the fold until friction has dissipated half of the energy released, in units of T_v.
fn half_release(scene: &Scene, eta: f64) -> Result<f64, Failure> {
    let prepared = Prepared::new(scene)?;
    let mut motion = prepared.motion()?;
    let (fold, late) = follow(&mut *motion, &mut |state, fold| {
        state.ledger().dissipated - fold.ledger.dissipated - 0.5 * fold.snap.released
    })?;
    Ok(late / passage(&fold)?.viscous(eta))
}

/// Time from the fold to the zero of the amplitude of the critical shape, in units of T_i. The rod is light until 10
/// T_i before the fold.
fn zero(
    scene: &dyn Fn(&[String]) -> Result<Scene, Failure>,
    set: &[String],
    eps: f64,
) -> Result<f64, Failure> {
    let prepared = Prepared::new(&scene(&[])?)?;
    let mut light = prepared.motion()?;
    let snap = loop {
        match light.advance().ok_or("no fold was passed")? {
            Event::Snap(snap) => break snap,
            _ => continue,
        }
    };
    let v = Vector2::new(snap.velocity[0], snap.velocity[1]);
    let scale = FoldNormalForm::new(snap.from.q[0], snap.from.q[1], &v)?.inertial(eps);
    let before = (snap.t - 10.0 * scale).max(0.0);
    let mut light = prepared.motion()?;
    while !matches!(light.advance(), Some(Event::Step { to, .. }) if to >= before) {}
    let state = light.sample(before).ok_or("outside the step")?;
    let at = state.equilibrium().ok_or("the light rod is nowhere")?;
    let v = state.twist();
    let mut set = set.to_vec();
    set.push(format!("start.lambda={:e}", at.lambda()));
    set.push(format!("start.p={:e}", at.p));
    set.push(format!("start.velocity=[{:e}, {:e}]", v[3], v[4]));
    let prepared = Prepared::new(&scene(&set)?)?;
    let mut motion = prepared.motion()?;
    let mut shapes: Option<[Vec<Vector2<f64>>; 2]> = None;
    let (fold, late) = follow(&mut *motion, &mut |state, fold| {
        let [there, critical] = shapes.get_or_insert_with(|| critical(fold));
        let now = axis(&|s| state.strains_at(s).iter().map(|e| e[0]).collect());
        // Vibrations of the held rod are orthogonal with respect to mass.
        let terms = now.iter().zip(there).zip(critical);
        terms.map(|((r, r0), z)| (r - *r0).dot(z)).sum()
    })?;
    Ok(late / passage(&fold)?.inertial(eps))
}

/// Points of the axis for a given curvature, by Simpson's rule.
fn axis(curvature: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<Vector2<f64>> {
    let h = 1.0 / PLACES as f64;
    let places: Vec<f64> = (0..=2 * PLACES).map(|k| 0.5 * h * k as f64).collect();
    let curvature = curvature(&places);
    let mut angle = vec![0.0];
    for k in 0..2 * PLACES {
        // The midpoint of every second interval, by the parabola through three values.
        let k0 = k - k % 2;
        let [a, b, c] = [curvature[k0], curvature[k0 + 1], curvature[k0 + 2]];
        let part = match k % 2 {
            0 => (5.0 * a + 8.0 * b - c) / 12.0,
            _ => (-a + 8.0 * b + 5.0 * c) / 12.0,
        };
        angle.push(angle[k] + 0.5 * h * part);
    }
    let mut r = vec![Vector2::zeros()];
    for k in 0..PLACES {
        let tangent = |i: usize| Vector2::new(angle[i].cos(), angle[i].sin());
        let mean = (tangent(2 * k) + tangent(2 * k + 1) * 4.0 + tangent(2 * k + 2)) / 6.0;
        r.push(r[k] + mean * h);
    }
    r
}

/// The shape at the fold, and its derivative along the critical direction towards the landing.
fn critical(fold: &LightSnap) -> [Vec<Vector2<f64>>; 2] {
    let q = &fold.snap.from.q;
    let fold = Equilibrium::new(q[0], q[1]).expect("the fold is in the chart");
    let rod = RodInertia::new(q[0], q[1]).expect("the fold is not taut");
    let svd = rod.end().0.svd(false, true);
    let right = svd.v_t.expect("asked for");
    let z = right.row(svd.singular_values.imin()).transpose();
    // On the stable side the chart's w is smaller.
    let shape = |h: f64| {
        let at = Equilibrium::from_lambda_p(fold.lambda + h * z[1], fold.p + h * z[0]);
        let at = at.expect("next to the fold");
        let curvature = |s: &f64| at.section(*s).map_or(f64::NAN, |at| at.curvature);
        (at.w, axis(&|places| places.iter().map(curvature).collect()))
    };
    let h = 1e-4;
    let ((w0, before), (w1, after)) = (shape(-h), shape(h));
    let sign = (w1 - w0).signum();
    let change = before.iter().zip(&after).map(|(a, b)| (b - a) * sign);
    [shape(0.0).1, change.collect()]
}
