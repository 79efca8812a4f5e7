//! Viscoelastic rods: the Jacobian, and identities that hold along every run.

use crate::memory::allocations;
use nalgebra::{Complex, DVector, Isometry3, Matrix3, Matrix6, SVector, Vector2, Vector3, Vector6};
use snaprod::body::{EndBody, PointMass, RigidBody, TimeLoad};
use snaprod::math::registers::Registers;
use snaprod::motion::viscoelastic::{Hold, ViscousRun, ViscousSample, ViscousStart, ViscousSystem};
use snaprod::motion::{Event, Options, Outcome};
use snaprod::section::rate::{
    Carreau, FrictionBarrier, KelvinVoigt, Maxwell, RateLaw, Viscoelastic, Viscosity,
};
use snaprod::section::{Barrier, Linear, SectionLaw};
use snaprod::solve::system::{Factor, Linearised, System};
use snaprod::viscoelastic::end_pose::gap;
use snaprod::viscoelastic::grid::Grid;
use snaprod::viscoelastic::kinematics::{Kinematics, Local};
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use snaprod::viscoelastic::reduced::Reduced;
use snaprod::viscoelastic::space::Space;
use std::sync::Arc;

/// All samples of a run at growing `times`, each asked for in the step that reaches it, and how the run ended.
pub fn sampled<K, B, const M: usize, const D: usize>(
    run: &mut ViscousRun<'_, K, B, M, D>,
    times: &[f64],
) -> (Vec<ViscousSample<K, M, D>>, Outcome)
where
    K: Kinematics<M, D> + Clone,
    B: EndBody<D, Pose = K::Pose>,
{
    let mut samples = Vec::new();
    while let Some(event) = run.next() {
        match event {
            Event::Step { to, .. } => {
                while let Some(t) = times.get(samples.len())
                    && *t <= to * (1.0 + 1e-14)
                {
                    samples.push(run.sample(t.min(to)).expect("a sample in the last step"));
                }
            }
            Event::Stop(outcome) => return (samples, outcome),
            _ => {}
        }
    }
    panic!("the run was over before it began")
}

/// Pseudo-random numbers in (-1, 1).
fn noise(k: usize) -> f64 {
    ((k as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0
}

/// Symmetric positive definite without a zero.
fn full(diagonal: [f64; 6], salt: usize) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| {
        let off = 0.15 * noise(salt + 6 * i.min(j) + i.max(j));
        (diagonal[i] * diagonal[j]).sqrt() * if i == j { 1.0 } else { off }
    })
}

/// Fields of degree 3: number 0 lies inside the cone of [`HALF_WIDTHS`].
fn field<const M: usize>(grid: &Grid, active: &[usize; M], number: usize) -> Vec<Local<M>> {
    const INSIDE: [[f64; 4]; 6] = [
        [0.5, 0.9, -0.6, 0.3],
        [-0.4, 0.8, 0.5, -0.7],
        [0.9, -0.7, 0.4, 0.2],
        [0.1, -0.1, 0.05, 0.0],
        [-0.1, 0.05, 0.1, 0.02],
        [1.1, 0.1, -0.1, 0.03],
    ];
    let at = |s: f64, a: usize| {
        let x = 2.0 * s - 1.0;
        let coefficient = |k: usize| match number {
            0 => INSIDE[active[a]][k],
            _ => noise(number + 7 * a + k),
        };
        (0..4).map(|k| coefficient(k) * x.powi(k as i32)).sum()
    };
    let nodes = grid.nodes().iter();
    nodes.map(|s| Local::from_fn(|a, _| at(*s, a))).collect()
}

const HALF_WIDTHS: [f64; 2] = [0.1, 0.25];

/// Laws of every kind for the given strains, with two Maxwell branches, full matrices and a rest shape that is not
/// straight; one law without memory, with constant matrices.
fn laws(rigid: [bool; 3]) -> Vec<(&'static str, Viscoelastic)> {
    let base = Linear::full(full([1.0, 1.4, 0.8, 30.0, 40.0, 60.0], 3))
        .and_then(|law| law.rigid(rigid)?.with_rest([0.2, -0.3], 0.4))
        .expect("a law");
    let linear: Arc<dyn SectionLaw> = Arc::new(base);
    let h = || {
        Viscosity::full(full([0.3, 0.2, 0.25, 2.0, 3.0, 2.5], 77))
            .and_then(|h| h.with_rigid(rigid))
            .expect("a viscosity")
    };
    let proportional = KelvinVoigt::proportional(linear.clone(), 0.2).expect("a law");
    let carreau = |p| Carreau::new(h(), 0.5, p).expect("a law");
    type Pair = (&'static str, Arc<dyn SectionLaw>, Arc<dyn RateLaw>);
    let mut pairs: Vec<Pair> = vec![
        ("full", linear.clone(), Arc::new(KelvinVoigt::new(h()))),
        ("proportional", linear.clone(), Arc::new(proportional)),
        ("thinning", linear.clone(), Arc::new(carreau(0.4))),
        ("thickening", linear.clone(), Arc::new(carreau(2.5))),
    ];
    if !rigid[2] {
        let friction = FrictionBarrier::new(h(), HALF_WIDTHS, 0.3).expect("a law");
        let barrier: Arc<dyn SectionLaw> =
            Arc::new(Barrier::new(base, HALF_WIDTHS, 2.0).expect("a law"));
        pairs.push(("friction", linear, Arc::new(friction.clone())));
        pairs.push(("barrier", barrier.clone(), Arc::new(KelvinVoigt::new(h()))));
        pairs.push(("both", barrier, Arc::new(friction)));
    }
    let branch = |e, salt, time| Maxwell::new(full(e, salt), time).expect("a branch");
    let law = |(name, elastic, rate)| {
        let law = Viscoelastic::new(elastic, rate)
            .and_then(|law| law.with_branch(branch([0.5, 0.7, 0.4, 10.0, 9.0, 20.0], 11, 0.3)))
            .and_then(|law| law.with_branch(branch([0.2, 0.1, 0.4, 5.0, 9.0, 3.0], 31, 5.0)));
        (name, law.expect("a section"))
    };
    let constant = Viscoelastic::new(pairs[0].1.clone(), pairs[0].2.clone()).expect("a section");
    let mut laws: Vec<_> = pairs.into_iter().map(law).collect();
    laws.push(("without memory", constant));
    laws
}

/// Offset, full inertia, gravity, loads of every kind, both drags.
fn welded() -> RigidBody {
    let inertia = Matrix3::new(0.5, 0.05, -0.02, 0.05, 0.4, 0.03, -0.02, 0.03, 0.3);
    RigidBody::new(1.3, inertia)
        .and_then(|body| body.with_centre(Vector3::new(0.2, -0.1, 0.15)))
        .and_then(|body| body.with_gravity(Vector3::new(0.3, -1.0, 0.2)))
        .and_then(|body| body.with_dead_force(Vector3::new(0.1, 0.2, 0.3)))
        .and_then(|body| body.with_dead_couple(Vector3::new(0.4, -0.2, 0.3)))
        .and_then(|body| body.with_drag(0.3)?.with_rotational_drag(0.2))
        .expect("a body")
        .with_force(force())
}

fn force() -> TimeLoad<3> {
    TimeLoad::sine(Vector3::new(0.3, 0.2, -0.4), 2.0, 0.1).unwrap()
}

fn point() -> PointMass<3> {
    PointMass::new(0.8)
        .and_then(|body| {
            body.with_drag(0.4)?
                .with_gravity(Vector3::new(0.1, 0.2, -1.0))
        })
        .expect("a body")
        .with_force(force())
}

/// Jacobian against differences along smooth changes; solutions of the shifted system against products, for any vector.
fn differentiates<K, B, const M: usize, const D: usize>(
    name: &str,
    kinematics: K,
    active: [usize; M],
    law: Viscoelastic,
    body: &B,
) where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    let what = format!("{name}, M = {M}, D = {D}");
    let grid = Arc::new(Grid::new(&[0.4], &[14, 15]));
    let branches = law.branches.len();
    let mut system = ViscousSystem::new(
        Reduced {
            kinematics,
            material: Material::new(law, active).expect("a material"),
            grid: grid.clone(),
        },
        body,
        Hold::Velocity,
    );
    let state = |number: usize| {
        let memory: Vec<_> = (0..branches)
            .map(|k| field(&grid, &active, 900 + 50 * k + number))
            .collect();
        let v = SVector::<f64, D>::from_fn(|i, _| noise(number + 400 + i));
        system.state(&field(&grid, &active, number), &memory, &v)
    };
    let mut y = state(0);
    let inner = system.layout().time();
    let field = system.layout().velocity();
    y[inner] = 0.7;
    let jacobian = system.linearised(&y).expect("a Jacobian");
    let n = y.len();
    for which in 1..3 {
        let change = state(100 * which);
        let slope = |t: f64| {
            let mut out = DVector::zeros(n);
            system
                .slope(&(&y + &change * t), &mut out)
                .expect("a slope");
            out
        };
        let h = 3e-4;
        let across = |k: f64| slope(k * h) - slope(-k * h);
        let difference = (across(1.0) * 45.0 - across(2.0) * 9.0 + across(3.0)) / (60.0 * h);
        let exact = jacobian.times(&change);
        for (from, count) in [(0, field), (field, D)] {
            let size = exact.rows(from, count).amax();
            let off = (difference.rows(from, count) - exact.rows(from, count)).amax() / size;
            assert!(off <= 1e-9, "{what}: derivative off by {off:e}");
        }
    }
    let x = DVector::from_fn(n, |i, _| Complex::new(noise(i), noise(2 * n + i)));
    let products = [x.map(|x| x.re), x.map(|x| x.im)].map(|part| jacobian.times(&part));
    let product = products[0].zip_map(&products[1], Complex::new);
    for sigma in [(3.0, 1.0), (1e4, -2e4), (0.2, 0.0), (30.0, 80.0)] {
        let sigma = Complex::new(sigma.0, sigma.1);
        let mut b = &x * sigma - &product;
        let factor = jacobian.shifted(sigma).expect("a factor");
        assert!(factor.solve(&mut b));
        let off = (b - &x).rows(0, inner).map(Complex::norm).amax();
        assert!(off <= 1e-10, "{what}: solution at {sigma} off by {off:e}");
    }
    for sigma in [2.0, 300.0] {
        let mut b = x.map(|x| x.re) * sigma - &products[0];
        let factor = jacobian.shifted(sigma).expect("a factor");
        assert!(factor.solve(&mut b));
        let off = (b - x.map(|x| x.re)).rows(0, inner).amax();
        assert!(off <= 1e-10, "{what}: solution at {sigma} off by {off:e}");
    }
    stages_are_states(&what, &mut system, &y, 1.5);
    if name == "full" {
        stages_are_states(&what, &mut system, &y, 80.0);
    }
    rough_is_whole(&what, &mut system, y);
}

/// Without end wrench no term depends on the rod's rotation, and the rough Jacobian is exact: products and solutions
/// of every form agree.
fn rough_is_whole<K, B, const M: usize, const D: usize>(
    what: &str,
    system: &mut ViscousSystem<K, &B, M, D>,
    mut y: DVector<f64>,
) where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    let (layout, rod) = (system.layout(), &system.rod);
    let at = rod.configuration(system.strains(&y), system.memory(&y));
    let at = at.expect("a shape");
    let free = rod.under(&at, &SVector::zeros()).expect("rates");
    let v = rod.moved(&at, &free);
    y.fixed_rows_mut::<D>(layout.velocity()).copy_from(&v);
    let x = DVector::from_fn(y.len(), |i, _| Complex::new(noise(i), noise(i + 7)));
    for hold in [Hold::Velocity, Hold::Together, Hold::Place] {
        system.hold = hold;
        let whole = system.linearised(&y).expect("a Jacobian");
        let rough = system.roughly_linearised(&y).expect("a Jacobian");
        let real = x.map(|x| x.re);
        let product = whole.times(&real);
        let off = (rough.times(&real) - &product).amax() / product.amax();
        assert!(off <= 1e-11, "{what}, {hold:?}: product off by {off:e}");
        for sigma in [(3.0, 1.0), (1e4, -2e4), (0.2, 0.0), (30.0, 80.0)] {
            let sigma = Complex::new(sigma.0, sigma.1);
            let [whole, rough] = [&whole, &rough].map(|jacobian| {
                let mut b = x.clone();
                assert!(jacobian.shifted(sigma).expect("a factor").solve(&mut b));
                b
            });
            let size = whole.map(Complex::norm).amax();
            let off = (whole - rough).map(Complex::norm).amax() / size;
            assert!(off <= 1e-9, "{what}, {hold:?}: {sigma} off by {off:e}");
        }
    }
}

/// By position, the slopes of several states at once are those of each state: nine of them, more than fit in a
/// register, one with `scaled` curvatures, which may be unresolved by the nodes: then shapes are found one by one.
fn stages_are_states<K, B, const M: usize, const D: usize>(
    what: &str,
    system: &mut ViscousSystem<K, &B, M, D>,
    y: &DVector<f64>,
    scaled: f64,
) where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    system.hold = Hold::Place;
    let layout = system.layout();
    let states: Vec<_> = (0..9)
        .map(|k| {
            let mut y = y.clone();
            let size = if k == 4 {
                scaled
            } else {
                1.0 + 0.01 * k as f64
            };
            for node in 0..layout.nodes {
                // Curvatures alone are scaled: other strains are near the edge of some laws.
                for e in 0..M.min(3) {
                    y[node * M + e] *= size;
                }
            }
            for i in 0..D {
                y[layout.wrench() + i] = noise(40 * k + i);
                y[layout.velocity() + i] = noise(40 * k + i + 7);
            }
            y
        })
        .collect();
    let mut slopes = states.clone();
    system.balances(&states, &mut slopes).expect("slopes");
    let fields: Vec<_> = (states.iter())
        .map(|y| {
            (
                y.as_slice(),
                y.fixed_rows::<D>(layout.wrench()).into_owned(),
            )
        })
        .collect();
    let mut resultants = states.clone();
    let mut heads: Vec<_> = (resultants.iter_mut().map(DVector::as_mut_slice)).collect();
    let mut ends = vec![None; fields.len()];
    let rod = &system.rod;
    let room = &mut K::Room::default();
    let together = (rod.kinematics).loaded(&rod.grid, None, &fields, &mut heads, &mut ends, room);
    let wide = K::PLACE != 2 && Registers::in_use().is_some();
    assert_eq!(together, wide && scaled < 10.0, "{what}");
    assert_eq!(rod.material.constant().is_some(), layout.branches == 0);
    // After its workspace is allocated, a right-hand side allocates no memory.
    if scaled < 10.0 {
        for hold in [Hold::Velocity, Hold::Together, Hold::Place] {
            system.hold = hold;
            let again = &mut slopes.clone();
            system.balances(&states, again).expect("slopes");
            let count = allocations(|| system.balances(&states, again).expect("slopes"));
            assert_eq!(count, 0, "{what}, {hold:?}");
        }
        system.hold = Hold::Place;
    }
    for (k, (y, slope)) in states.iter().zip(&slopes).enumerate() {
        let rod = &system.rod;
        let at = rod.configuration(system.strains(y), system.memory(y));
        let at = at.expect("a shape");
        let w = y.fixed_rows::<D>(layout.wrench()).into_owned();
        let flow = rod.under(&at, &w).expect("rates");
        let near = |found: &[f64], exact: &[f64], name: &str| {
            let size = exact.iter().fold(1.0_f64, |max, x| max.max(x.abs()));
            for (a, b) in found.iter().zip(exact) {
                let off = (a - b).abs() / size;
                assert!(off < 1e-11, "{what}, state {k}: {name} off by {off:e}");
            }
        };
        let rates: Vec<f64> = flow.rates.iter().flat_map(|r| r.iter().copied()).collect();
        near(&slope.as_slice()[..rates.len()], &rates, "rates");
        let lost = slope[layout.time() + 1];
        near(&[lost], &[rod.dissipated(&at, &flow)], "dissipation");
        let pose = rod.kinematics.pose(&at.shape);
        let mut reached = vec![0.0; K::PLACE];
        K::place(&pose, &mut reached);
        let place = &y.as_slice()[layout.place()..layout.wrench()];
        let gap = gap::<D>(place, &reached);
        near(&slope.as_slice()[layout.wrench()..], gap.as_slice(), "gap");
        let motion = system
            .body
            .motion(y[layout.time()], &pose, &system.velocity(y), &-w);
        let found = &slope.as_slice()[layout.velocity()..layout.time()];
        near(found, motion.acceleration.as_slice(), "acceleration");
    }
}

/// Catches a wrong sign, block or transpose anywhere between strains, memory, velocity and wrench, for every law,
/// strain set and end.
#[test]
fn jacobians() {
    let (welded, point) = (welded(), point());
    let flat = PointMass::<2>::new(0.8)
        .and_then(|body| body.with_drag(0.4)?.with_gravity(Vector2::new(0.1, -1.0)))
        .expect("a body");
    for (name, law) in laws([true; 3]) {
        differentiates(name, Plane, [0], law.clone(), &flat);
        differentiates(name, Space::<3, 3>::new(), [0, 1, 2], law.clone(), &point);
        differentiates(name, Space::<3, 6>::new(), [0, 1, 2], law, &welded);
    }
    for (name, law) in laws([true, true, false]) {
        differentiates(name, Space::<4, 6>::new(), [0, 1, 2, 5], law, &welded);
    }
    for (name, law) in laws([false; 3]) {
        let all = [0, 1, 2, 3, 4, 5];
        differentiates(name, Space::<6, 3>::new(), all, law.clone(), &point);
        differentiates(name, Space::<6, 6>::new(), all, law, &welded);
    }
}

/// A law whose rates alone are discontinuous along the rod splits the grid into elements, too.
#[test]
fn viscosity_along_the_rod_cuts_the_grid() {
    use snaprod::section::Varying;
    let thick = |s: f64| if s < 0.3 { 0.4 } else { 0.1 };
    let varying = Varying::by(move |s| Linear::diagonal([thick(s), thick(s)], thick(s)))
        .with_breaks(&[0.3])
        .expect("a law");
    let law = Viscoelastic::new(
        Arc::new(Linear::diagonal([1.0, 1.0], 1.0).expect("a law")),
        Arc::new(KelvinVoigt::new(
            Viscosity::from_varying(varying).expect("a viscosity"),
        )),
    );
    let material = Material::new(law.expect("a section"), [0]).expect("a material");
    assert_eq!(material.breaks(), [0.3]);
}

const RUN: f64 = 1.2;

/// A run of a full law with branches, and every load: (5.3), (5.4) V is the motion of the pose; (5.6), (5.7) the wrench
/// rate of the differentiated constraint; (5.10) G; (7.3) energy; directors.
fn keeps<const M: usize>(active: [usize; M], law: Viscoelastic) {
    let body = welded();
    let space = Space::<M, 6>::new();
    let start_strain = Vector6::new(0.4, -0.3, 0.2, 0.02, -0.01, 1.0);
    let strain = |s: f64| Local::<M>::from_fn(|a, _| start_strain[active[a]] * (1.0 - 0.3 * s));
    let start = ViscousStart {
        strain: &strain,
        relaxed: None,
        velocity: Vector6::new(0.3, -0.4, 0.2, 0.5, 0.3, -0.2),
    };
    let options = Options::new(RUN)
        .and_then(|o| o.with_tolerance(1e-11))
        .expect("options");
    let material = Material::new(law, active).expect("a material");
    let mut run = ViscousRun::new(space, material.clone(), &body, &start, options).expect("a run");
    let h = 1.5e-3;
    let centres = [0.2, 0.55, 1.1];
    let times: Vec<f64> = centres
        .iter()
        .flat_map(|t| (-3..=3).map(move |k| t + f64::from(k) * h))
        .collect();
    let (samples, outcome) = sampled(&mut run, &times);
    assert_eq!(outcome, Outcome::EndOfTime);
    let total = run.first().ledger.total();
    for (window, t) in samples.chunks_exact(7).zip(centres) {
        let what = format!("M = {M}, t = {t}");
        let across = |f: &dyn Fn(usize) -> SVector<f64, 6>| {
            ((f(4) - f(2)) * 45.0 - (f(5) - f(1)) * 9.0 + (f(6) - f(0))) / (60.0 * h)
        };
        let middle = &window[3];
        let twist = |k: usize| {
            let moved = window[k].pose.rotation * middle.pose.rotation.inverse();
            let (turn, r) = (moved.scaled_axis(), window[k].pose.translation.vector);
            Vector6::new(turn.x, turn.y, turn.z, r.x, r.y, r.z)
        };
        let off = (across(&twist) - middle.velocity).amax();
        assert!(off <= 1e-7, "{what}: V off by {off:e}");

        let (at, flow) = (&middle.configuration, &middle.flow);
        let rod = Reduced {
            kinematics: space,
            material: material.clone(),
            grid: middle.grid.clone(),
        };
        let linear = rod.linear(at, flow).expect("a linearisation");
        let n = middle.grid.len();
        let rates = DVector::from_iterator(n * M, flow.rates.iter().flatten().copied());
        let mut pulled = linear.drift.times(&rates);
        for (branch, z) in material.branches().iter().zip(&at.memory) {
            for (i, z) in z.iter().enumerate() {
                let creep = (at.strains[i] - z) / branch.time;
                let mut rows = pulled.fixed_rows_mut::<M>(i * M);
                rows += linear.fluidity[i] * (branch.modulus * creep);
            }
        }
        let acceleration = body
            .motion(t, &middle.pose, &middle.velocity, &-flow.wrench)
            .acceleration;
        let right = DVector::from_column_slice(acceleration.as_slice())
            - &linear.convection * &rates
            - &linear.gather * pulled;
        let g = &linear.gather * &linear.push;
        assert!((&g - g.transpose()).amax() <= 1e-13 * g.amax(), "{what}: G");
        let factor = g.cholesky().expect("G is positive definite");
        let rate = factor.solve(&right);
        let difference = across(&|k| window[k].flow.wrench);
        let size = 1.0 + flow.wrench.amax();
        let off = (DVector::from_column_slice(difference.as_slice()) - rate).amax() / size;
        assert!(off <= 1e-5, "{what}: wrench rate off by {off:e}");

        let off = (middle.ledger.total() - total).abs();
        assert!(off <= 1e-10, "{what}: energy off by {off:e}");
        assert!(middle.dissipation.iter().all(|d| *d >= -1e-15), "{what}");
        for d in at.shape.directors() {
            assert!((d.transpose() * d - Matrix3::identity()).amax() <= 2e-15);
        }
    }
}

/// Linear laws, full matrices, both barriers, branches, a welded body with every load.
#[test]
fn identities_along_runs() {
    for (_, law) in laws([true; 3]).into_iter().take(2) {
        keeps([0, 1, 2], law);
    }
    for (_, law) in laws([true, true, false]).into_iter().skip(4) {
        keeps([0, 1, 2, 5], law);
    }
    for (_, law) in laws([false; 3]).into_iter().skip(4).take(2) {
        keeps([0, 1, 2, 3, 4, 5], law);
    }
}

/// End poses and energies of a scene, carried over by a map of the world.
fn scene(
    vector: impl Fn(Vector3<f64>) -> Vector3<f64>,
    axial: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> (Vec<Isometry3<f64>>, Vec<[f64; 2]>) {
    let all = [0, 1, 2, 3, 4, 5];
    let base = Linear::diagonal([1.0, 1.0], 0.7)
        .and_then(|law| law.with_shear([40.0, 40.0])?.with_axial(60.0))
        .expect("a law");
    let elastic = Arc::new(Barrier::new(base, [0.2, 0.2], 2.0).expect("a law"));
    let h = Viscosity::diagonal([0.1, 0.1], 0.05)
        .and_then(|h| h.with_shear([2.0, 2.0])?.with_axial(3.0))
        .expect("a viscosity");
    let law = Viscoelastic::new(elastic, Arc::new(Carreau::new(h, 1.0, 0.5).expect("a law")));
    let turned = Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(&vector));
    let inertia = Matrix3::new(0.2, 0.03, -0.02, 0.03, 0.3, 0.01, -0.02, 0.01, 0.25);
    let body = RigidBody::new(1.0, turned * inertia * turned.transpose())
        .and_then(|body| body.with_centre(vector(Vector3::new(0.2, 0.1, 0.1))))
        .and_then(|body| body.with_gravity(vector(Vector3::new(0.5, 1.0, -0.5))))
        .and_then(|body| body.with_dead_couple(axial(Vector3::new(0.2, -0.4, 0.3))))
        .expect("a body");
    let (spin, v) = (
        axial(Vector3::new(0.5, 0.2, -0.6)),
        vector(Vector3::new(0.3, -0.5, 0.1)),
    );
    let strain = |s: f64| {
        let u = axial(Vector3::new(0.5 - s, 0.3, 0.8 * s));
        let v = vector(Vector3::new(0.02 * s, -0.03, 1.05));
        Vector6::new(u.x, u.y, u.z, v.x, v.y, v.z)
    };
    let start = ViscousStart {
        strain: &strain,
        relaxed: None,
        velocity: Vector6::new(spin.x, spin.y, spin.z, v.x, v.y, v.z),
    };
    let options = Options::new(2.0).expect("options");
    let material = Material::new(law.expect("a section"), all).expect("a material");
    let mut run =
        ViscousRun::new(Space::<6, 6>::new(), material, &body, &start, options).expect("a run");
    let (samples, outcome) = sampled(&mut run, &[0.3, 1.0, 2.0]);
    assert_eq!((outcome, samples.len()), (Outcome::EndOfTime, 3));
    let energies = |s: &ViscousSample<_, 6, 6>| [s.ledger.elastic, s.ledger.dissipated];
    (
        samples.iter().map(|s| s.pose).collect(),
        samples.iter().map(energies).collect(),
    )
}

/// Objectivity: a scene turned about the axis of the clamp (the section has no preferred side), and its mirror image.
#[test]
fn turned_and_mirrored_scenes() {
    let (poses, energies) = scene(|v| v, |v| v);
    let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.7).into_inner();
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    for (map, handed) in [(turn, 1.0), (mirror, -1.0)] {
        let (others, same) = scene(|v| map * v, |v| map * v * handed);
        for k in 0..3 {
            let off = (others[k].translation.vector - map * poses[k].translation.vector).amax();
            assert!(off <= 1e-9, "handed {handed}, sample {k}: r off by {off:e}");
            let [r, other] = [&poses[k], &others[k]].map(|p| p.rotation.to_rotation_matrix());
            let off = (other.matrix() - map * r.matrix() * map.transpose()).amax();
            assert!(off <= 1e-9, "handed {handed}, sample {k}: R off by {off:e}");
            for i in 0..2 {
                let off = (same[k][i] - energies[k][i]).abs();
                assert!(off <= 1e-9, "handed {handed}, sample {k}: energy {off:e}");
            }
        }
    }
}
