//! Exact reductions of a rod with a body to ordinary differential equations.

use crate::support::assert_close;
use nalgebra::{
    Complex, Isometry3, Matrix3, Matrix4, Matrix6, Translation3, UnitQuaternion, Vector3, Vector4,
    Vector6,
};
use snaprod::Result;
use snaprod::body::{Body, RigidBody, TimeLoad};
use snaprod::motion::reduction::{Carried, Kind, ReducedSample, Reduction, Start};
use snaprod::section::rate::{FrictionBarrier, Maxwell, Rate, RateLaw, Viscoelastic, Viscosity};
use snaprod::section::{Along, Barrier, Linear, Resultant, SectionLaw, Strain, Varying};
use std::sync::Arc;

/// Overstress H e_t, with some strains rigid; of its own, so that the tests stand apart from the library's laws.
#[derive(Debug)]
pub struct Dashpots {
    pub viscosity: Matrix6<f64>,
    pub rigid: [bool; 6],
    pub taper: f64,
}

impl RateLaw for Dashpots {
    fn rate(&self, s: f64, _: &Strain, overstress: &Resultant) -> Result<Rate> {
        let mut fluidity = (self.viscosity * (1.0 - self.taper * s))
            .try_inverse()
            .expect("positive definite");
        for k in (0..6).filter(|k| self.rigid[*k]) {
            fluidity.row_mut(k).fill(0.0);
            fluidity.column_mut(k).fill(0.0);
        }
        Ok(Rate {
            rate: fluidity * overstress,
            by_overstress: fluidity,
            by_strain: Matrix6::zeros(),
        })
    }

    fn overstress(&self, s: f64, _: &Strain, rate: &Strain) -> Result<Resultant> {
        Ok(self.viscosity * rate * (1.0 - self.taper * s))
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn rigid(&self) -> [bool; 6] {
        self.rigid
    }
}

pub const STIFFNESS: [f64; 6] = [1.0, 1.3, 0.8, 2.0, 2.5, 3.0];
pub const VISCOSITY: [f64; 6] = [0.2, 0.3, 0.15, 0.5, 0.6, 0.4];

pub fn diagonal(entries: [f64; 6]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::from(entries))
}

pub fn section(stiffness: Matrix6<f64>, viscosity: Matrix6<f64>) -> Viscoelastic {
    Viscoelastic {
        elastic: Arc::new(Linear::full(stiffness).expect("a law")),
        rate: Arc::new(Dashpots {
            viscosity,
            rigid: [false; 6],
            taper: 0.0,
        }),
        branches: Vec::new(),
    }
}

pub fn plain() -> Viscoelastic {
    section(diagonal(STIFFNESS), diagonal(VISCOSITY))
}

/// A clamp away from the origin and askew.
pub fn clamp() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.3, -0.2, 1.1),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.5, -0.8, 0.3)),
    )
}

/// A vector of the clamp's frame in the world frame.
pub fn world(x: f64, y: f64, z: f64) -> Vector3<f64> {
    clamp().rotation * Vector3::new(x, y, z)
}

pub fn moving(omega: Vector3<f64>, v: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z)
}

pub fn still() -> Vector3<f64> {
    Vector3::zeros()
}

fn straight(twist: f64, stretch: f64) -> Strain {
    Strain::new(0.0, 0.0, twist, 0.0, 0.0, stretch)
}

pub fn recognise(
    section: &Viscoelastic,
    carried: &Carried,
    strain: Strain,
    velocity: Vector6<f64>,
) -> Result<Reduction, String> {
    let start = Start {
        time: 0.0,
        strains: &[strain, strain, strain],
        branches: &[],
        velocity,
    };
    Reduction::recognise(section, &clamp(), carried, &start).map_err(|e| e.to_string())
}

fn inertia() -> Matrix3<f64> {
    Matrix3::new(0.3, 0.05, 0.0, 0.05, 0.4, 0.0, 0.0, 0.0, 0.25)
}

/// A welded body with its centre of mass at the end.
pub fn welded(mass: f64) -> RigidBody {
    RigidBody::new(mass, inertia()).expect("a body")
}

/// The full rod at a sample: the end wrench, brought to s by statics, gives the rates that the sample says at every s
/// (AMV (5.1), (2.37)), and these move the end (5.3), (5.4).
fn full_equations(section: &Viscoelastic, sample: &ReducedSample, ball: bool) {
    let (u, v) = (
        sample.strain.fixed_rows::<3>(0).into_owned(),
        sample.strain.fixed_rows::<3>(3).into_owned(),
    );
    assert_eq!((u.x, u.y), (0.0, 0.0));
    let frame = |s: f64| clamp().rotation * UnitQuaternion::from_scaled_axis(u * s);
    // Where the rod twists v is along its axis.
    assert!(u.z == 0.0 || (v.x, v.y) == (0.0, 0.0));
    let place = |s: f64| clamp().translation.vector + clamp().rotation * v * s;
    let (m1, n1) = (
        sample.wrench.fixed_rows::<3>(0).into_owned(),
        sample.wrench.fixed_rows::<3>(3).into_owned(),
    );
    let mut moved = Vector6::zeros();
    let count = 8;
    for i in 0..=2 * count {
        let s = f64::from(i) / f64::from(2 * count);
        let arm = place(1.0) - place(s);
        let local = moving(
            frame(s).inverse() * (m1 + arm.cross(&n1)),
            frame(s).inverse() * n1,
        );
        let mut overstress = local
            - section
                .elastic
                .resultants(s, &sample.strain)
                .expect("a law");
        for (branch, z) in section.branches.iter().zip(&sample.branches) {
            overstress -= branch.modulus * (sample.strain - z);
        }
        let rate = section
            .rate
            .rate(s, &sample.strain, &overstress)
            .expect("a law")
            .rate;
        let off = (rate - sample.rate).amax();
        assert!(off <= 1e-8, "s = {s}: {rate} {}", sample.rate);
        let weight = match i {
            0 => 1.0,
            _ if i == 2 * count => 1.0,
            _ if i % 2 == 1 => 4.0,
            _ => 2.0,
        } / f64::from(6 * count);
        let turn = frame(s) * rate.fixed_rows::<3>(0).into_owned();
        let shift = frame(s) * rate.fixed_rows::<3>(3).into_owned();
        moved += moving(turn, shift + turn.cross(&arm)) * weight;
    }
    let from = if ball { 3 } else { 0 };
    for k in from..6 {
        assert_close(
            moved[k],
            sample.velocity[k],
            1e-8,
            1.0,
            "velocity of the end",
        );
    }
    let end = place(1.0);
    assert!((sample.pose.translation.vector - end).amax() < 1e-14);
    assert!(sample.pose.rotation.angle_to(&frame(1.0)) < 1e-7);
}

/// Runs to each time, asserts the balance of energy and the full equations, and gives the samples.
pub fn run(
    reduction: &Reduction,
    section: &Viscoelastic,
    times: &[f64],
    ball: bool,
) -> Vec<ReducedSample> {
    let mut run = reduction.run(1e-13).expect("a start");
    let first = run.sample_at(0.0).expect("a start").ledger;
    let samples: Vec<_> = times
        .iter()
        .map(|t| run.sample_at(*t).expect("a sample"))
        .collect();
    for sample in &samples {
        let (ledger, largest) = (&sample.ledger, sample.ledger.largest());
        assert!(ledger.dissipated > 0.0);
        assert_close(ledger.total(), first.total(), 1e-11, largest, "energy");
        full_equations(section, sample, ball);
    }
    samples
}

/// Catches a sign or factor in (6.3), a tilted clamp taken for the world's axes, and gravity without its potential: the
/// damped oscillator in closed form, for a point mass on a ball joint and for a welded body.
#[test]
fn a_mass_on_a_stretching_rod_is_a_damped_oscillator() {
    let (mass, [.., k], [.., c]) = (0.7, STIFFNESS, VISCOSITY);
    let gravity = world(0.0, 0.0, -0.5);
    let ball = Body::<3>::new(mass).and_then(|b| b.with_gravity(gravity));
    let weld = welded(mass)
        .with_centre(Vector3::new(0.0, 0.0, 0.4))
        .and_then(|b| b.with_gravity(gravity));
    let sag = -0.5 * mass / k;
    let (x0, v0) = (0.2, -0.3);
    let (frequency, decay) = ((k / mass).sqrt(), 0.5 * c / mass);
    let damped = (frequency * frequency - decay * decay).sqrt();
    for (carried, is_ball) in [
        (Carried::BallJoint(ball.expect("a body")), true),
        (Carried::Welded(weld.expect("a body")), false),
    ] {
        let section = plain();
        let start = moving(still(), world(0.0, 0.0, v0));
        let reduction =
            recognise(&section, &carried, straight(0.0, 1.0 + x0), start).expect("it is");
        assert_eq!(reduction.kind(), Kind::Longitudinal);
        assert!(reduction.is_identical());
        let times = [0.3, 1.0, 2.5, 6.0];
        for sample in run(&reduction, &section, &times, is_ball) {
            let t = sample.time;
            let (a, b) = (x0 - sag, (v0 + decay * (x0 - sag)) / damped);
            let (sin, cos) = (damped * t).sin_cos();
            let fade = (-decay * t).exp();
            let x = sag + fade * (a * cos + b * sin);
            let v = fade * ((b * damped - decay * a) * cos - (a * damped + decay * b) * sin);
            assert_close(sample.strain[5], 1.0 + x, 1e-11, 1.0, "stretch");
            assert_close(sample.rate[5], v, 1e-11, 1.0, "its rate");
            let want = clamp() * nalgebra::Point3::new(0.0, 0.0, 1.0 + x);
            assert!((sample.pose.translation.vector - want.coords).amax() < 1e-11);
        }
        let equivalent = reduction.equivalent().expect("a law");
        assert_eq!(equivalent.moving, [5]);
        let mode = &equivalent.modes[0];
        assert_close(mode.natural_frequency, frequency, 1e-14, 0.0, "frequency");
        assert_close(mode.damping_ratio, decay / frequency, 1e-14, 0.0, "ratio");
        let shown = equivalent.to_string();
        assert!(
            shown.contains("stiffness 3\n") && shown.contains("dashpot 0.4\n"),
            "{shown}"
        );
    }
}

/// Catches a stiff motion that takes steps of its fastest rate: a strong dashpot, by its two exponentials.
#[test]
fn a_strong_dashpot_costs_few_steps() {
    let (mass, [.., k], c) = (0.7, STIFFNESS, 3e3);
    let mut viscosity = diagonal(VISCOSITY);
    viscosity[(5, 5)] = c;
    let section = section(diagonal(STIFFNESS), viscosity);
    let carried = Carried::BallJoint(Body::new(mass).expect("a body"));
    let (x0, v0) = (0.4, -0.3);
    let start = moving(still(), world(0.0, 0.0, v0));
    let reduction = recognise(&section, &carried, straight(0.0, 1.0 + x0), start).expect("it is");
    let mut run = reduction.run(1e-10).expect("a start");
    let slow = 2.0 * k / (c + (c * c - 4.0 * mass * k).sqrt());
    let fast = k / (mass * slow);
    for t in [1e-3, 1.0, 300.0, 3000.0] {
        let sample = run.sample_at(t).expect("a sample");
        let (a, b) = (
            (fast * x0 + v0) / (fast - slow),
            (slow * x0 + v0) / (slow - fast),
        );
        let want = a * (-slow * t).exp() + b * (-fast * t).exp();
        assert_close(sample.strain[5], 1.0 + want, 1e-8, 1.0, "stretch");
    }
    assert!(run.work().steps < 1000, "{:?}", run.work());
}

/// Catches energies that do not close in strongly nonlinear laws, near total compression, with a branch, drag and a force
/// in time; and a stiffness that is not that of the laws.
#[test]
fn a_barrier_keeps_the_energy_balance() {
    let base = Linear::full(diagonal(STIFFNESS)).expect("a law");
    let barrier = Barrier::new(base, [0.1, 0.2], 0.05).expect("a law");
    let viscosity = Viscosity::full(diagonal(VISCOSITY)).expect("a viscosity");
    let section = Viscoelastic {
        elastic: Arc::new(barrier),
        rate: Arc::new(FrictionBarrier::new(viscosity, [0.1, 0.2], 0.02).expect("a law")),
        branches: vec![Maxwell::new(diagonal(VISCOSITY), 0.5).expect("a branch")],
    };
    let body = welded(1.0)
        .with_drag(0.1)
        .expect("a drag")
        .with_force(TimeLoad::sine(world(0.0, 0.0, 0.8), 2.0, 0.4).unwrap());
    let start = moving(still(), world(0.0, 0.0, -2.0));
    let carried = Carried::Welded(body);
    let reduction = recognise(&section, &carried, straight(0.0, 0.5), start).expect("it is");
    assert!(reduction.is_identical());
    let times: Vec<f64> = (1..=100).map(|i| 0.05 * f64::from(i)).collect();
    let samples = run(&reduction, &section, &times, false);
    let stretches = samples.iter().map(|sample| sample.strain[5]);
    let least = stretches.fold(f64::INFINITY, f64::min);
    assert!(0.0 < least && least < 0.05, "{least}");
    assert!(samples[99].ledger.work.abs() > 0.1);
    // In motion the stiffness has a part from friction that grows as the rod is compressed.
    let (h, at) = (1e-5, &samples[4]);
    let pull = |v3: f64| {
        let e = straight(0.0, v3);
        let overstress = section.rate.overstress(0.0, &e, &at.rate).expect("a law");
        barrier.resultants(0.0, &e).expect("a law")[5] + overstress[5]
    };
    let v3 = at.strain[5];
    let slope = (pull(v3 + h) - pull(v3 - h)) / (2.0 * h);
    let equivalent = reduction.equivalent_at(at).expect("a law");
    assert_close(equivalent.stiffness[(0, 0)], slope, 1e-6, 0.0, "stiffness");
    assert_close(equivalent.drag[(0, 0)], 0.1, 1e-14, 0.0, "drag");
}

/// Catches mixed-up rows of the coupled motion, or an inertia that is not J3: the linear system of twist and stretch by
/// the exponential of its matrix.
#[test]
fn twist_and_stretch_couple_as_the_matrices_say() {
    let (mut k, mut c) = (diagonal(STIFFNESS), diagonal(VISCOSITY));
    (k[(2, 5)], k[(5, 2)]) = (0.6, 0.6);
    (c[(2, 5)], c[(5, 2)]) = (0.1, 0.1);
    // Couplings that half a turn about d3 allows change nothing.
    for (i, j) in [(0, 1), (0, 3), (1, 4), (3, 4)] {
        (k[(i, j)], k[(j, i)]) = (0.2, 0.2);
    }
    let section = section(k, c);
    let (mass, couple, spin_drag) = (0.7, 0.15, 0.05);
    let body = welded(mass)
        .with_dead_couple(world(0.0, 0.0, couple))
        .and_then(|b| b.with_rotational_drag(spin_drag))
        .expect("a body");
    let start = moving(world(0.0, 0.0, 0.9), world(0.0, 0.0, -0.2));
    let carried = Carried::Welded(body);
    let reduction = recognise(&section, &carried, straight(0.3, 1.1), start).expect("it is");
    assert_eq!(reduction.kind(), Kind::Twisting);
    assert_eq!(reduction.moving(), [2, 5]);
    assert!(reduction.is_identical());
    let (j3, k, c) = (0.25, |i, j| k[(i, j)], |i, j| c[(i, j)]);
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        -k(2, 2) / j3, -k(2, 5) / j3, -(c(2, 2) + spin_drag) / j3, -c(2, 5) / j3,
        -k(5, 2) / mass, -k(5, 5) / mass, -c(5, 2) / mass, -c(5, 5) / mass,
    );
    let load = Vector4::new(0.0, 0.0, couple / j3, 0.0);
    let settled = -matrix.try_inverse().expect("regular") * load;
    let first = Vector4::new(0.3, 0.1, 0.9, -0.2);
    for sample in run(&reduction, &section, &[0.4, 1.5, 4.0], false) {
        let want = settled + (matrix * sample.time).exp() * (first - settled);
        let got = [
            sample.strain[2],
            sample.strain[5] - 1.0,
            sample.rate[2],
            sample.rate[5],
        ];
        for (got, want) in got.iter().zip(want.iter()) {
            assert_close(*got, *want, 1e-11, 1.0, "twist and stretch");
        }
    }
    let equivalent = reduction.equivalent().expect("a law");
    let mut want: Vec<_> = matrix.complex_eigenvalues().iter().copied().collect();
    want.sort_by(|a, b| a.im.total_cmp(&b.im).then(a.re.total_cmp(&b.re)));
    for (got, want) in equivalent.eigenvalues.iter().zip(&want) {
        assert!((got - want).norm() < 1e-12, "{got} {want}");
    }
    // Any other coupling bends or shears the rod.
    let mut skew = diagonal(STIFFNESS);
    (skew[(0, 5)], skew[(5, 0)]) = (0.2, 0.2);
    let skewed = self::section(skew, diagonal(VISCOSITY));
    let why = recognise(&skewed, &carried, straight(0.3, 1.1), start).expect_err("it bends");
    assert!(
        why.contains("not twisting: a couple would turn the end"),
        "{why}"
    );
}

/// All roots of x^3 + a x^2 + b x + c.
fn cubic([a, b, c]: [f64; 3]) -> [Complex<f64>; 3] {
    let p = |x: Complex<f64>| ((x + a) * x + b) * x + c;
    let mut roots = [0, 1, 2].map(|i| Complex::new(0.4, 0.9).powi(i) * 2.0);
    for _ in 0..200 {
        for i in 0..3 {
            let others = (roots[i] - roots[(i + 1) % 3]) * (roots[i] - roots[(i + 2) % 3]);
            roots[i] -= p(roots[i]) / others;
        }
    }
    roots
}

/// Catches a branch that does not relax, or is not in the energies: a mass on the three-parameter solid, whose motion is
/// a sum of exponentials with the roots of a cubic.
#[test]
fn a_maxwell_branch_adds_a_root() {
    let mut section = plain();
    let (modulus, time) = (1.7, 0.6);
    section.branches = vec![Maxwell {
        modulus: diagonal([0.3, 0.3, 0.2, 0.5, 0.5, modulus]),
        time,
    }];
    let (mass, [.., k], [.., c]) = (0.7, STIFFNESS, VISCOSITY);
    let carried = Carried::BallJoint(Body::new(mass).expect("a body"));
    let (x0, v0, z0) = (0.25, -0.1, -0.15);
    let field = vec![straight(0.0, 1.0 + z0); 2];
    let start = Start {
        time: 0.0,
        strains: &[straight(0.0, 1.0 + x0)],
        branches: &[field],
        velocity: moving(still(), world(0.0, 0.0, v0)),
    };
    let reduction = Reduction::recognise(&section, &clamp(), &carried, &start).expect("it is");
    // (mass x^2 + c x + k)(time x + 1) + modulus time x = 0.
    let lead = mass * time;
    let roots = cubic([
        (mass + c * time) / lead,
        (c + (k + modulus) * time) / lead,
        k / lead,
    ]);
    let a0 = -(k * x0 + c * v0 + modulus * (x0 - z0)) / mass;
    // sum A_i = x0, sum A_i r_i = v0, sum A_i r_i^2 = a0.
    let amplitude = |i: usize| {
        let (r, p, q) = (roots[i], roots[(i + 1) % 3], roots[(i + 2) % 3]);
        (p * q * x0 - (p + q) * v0 + a0) / ((r - p) * (r - q))
    };
    for sample in run(&reduction, &section, &[0.2, 1.0, 3.0], true) {
        let x: Complex<f64> = (0..3)
            .map(|i| amplitude(i) * (roots[i] * sample.time).exp())
            .sum();
        assert_close(sample.strain[5], 1.0 + x.re, 1e-11, 1.0, "stretch");
    }
    let equivalent = reduction.equivalent().expect("a law");
    assert_eq!(equivalent.eigenvalues.len(), 3);
    for root in roots {
        let off = equivalent.eigenvalues.iter().map(|e| (e - root).norm());
        assert!(off.fold(f64::INFINITY, f64::min) < 1e-12, "{root}");
    }
}

/// Catches a rod without stretch that is taken to stretch: an inextensible, unshearable rod twists, and the body's weight
/// along it is borne by a reaction.
#[test]
fn an_inextensible_rod_twists() {
    let law = Linear::diagonal([1.0, 1.3], 0.8).expect("a law");
    let mut section = plain();
    section.elastic = Arc::new(law);
    section.rate = Arc::new(Dashpots {
        viscosity: diagonal(VISCOSITY),
        rigid: [false, false, false, true, true, true],
        taper: 0.0,
    });
    let body = welded(0.7)
        .with_gravity(world(0.0, 0.0, -2.0))
        .expect("a body");
    let start = moving(world(0.0, 0.0, 0.5), still());
    let carried = Carried::Welded(body);
    let reduction = recognise(&section, &carried, straight(0.4, 1.0), start).expect("it is");
    assert_eq!(
        (reduction.kind(), reduction.moving()),
        (Kind::Twisting, vec![2])
    );
    let mut run = reduction.run(1e-13).expect("a start");
    let sample = run.sample_at(1.2).expect("a sample");
    let decay = 0.5 * 0.15 / 0.25;
    let damped = (0.8f64 / 0.25 - decay * decay).sqrt();
    let b = (0.5 + decay * 0.4) / damped;
    let (sin, cos) = (damped * 1.2).sin_cos();
    let want = (-decay * 1.2).exp() * (0.4 * cos + b * sin);
    assert_close(sample.strain[2], want, 1e-11, 1.0, "twist");
    assert_close(sample.resultants[5], -1.4, 1e-14, 0.0, "reaction");
}

/// Catches a motion with memory that is taken for an exact one, and a refusal that does not say why.
#[test]
fn what_is_not_exact_is_refused_with_its_reason() {
    let section = plain();
    let free = || Carried::Welded(welded(0.7));
    let axial = moving(still(), world(0.0, 0.0, 0.3));
    let rest = straight(0.0, 1.0);
    let expect = |section: &Viscoelastic, carried: &Carried, strain, velocity, word: &str| {
        let why = recognise(section, carried, strain, velocity).expect_err(word);
        assert!(why.contains(word), "{word}: {why}");
    };
    let bent = Strain::new(0.1, 0.0, 0.0, 0.0, 0.0, 1.0);
    expect(&section, &free(), bent, axial, "the rod is bent");
    let mut tapered = plain();
    tapered.rate = Arc::new(Dashpots {
        viscosity: diagonal(VISCOSITY),
        rigid: [false; 6],
        taper: 0.3,
    });
    expect(&tapered, &free(), rest, axial, "the section varies");
    let along = |a: f64| Along::polynomial(&[a, -0.1 * a]).expect("a polynomial");
    tapered.rate = section.rate.clone();
    tapered.elastic =
        Arc::new(Varying::diagonal([along(1.0), along(1.0)], along(1.0)).expect("a law"));
    expect(&tapered, &free(), rest, axial, "the section varies");
    let mut arch = plain();
    let curved = Linear::full(diagonal(STIFFNESS)).and_then(|l| l.with_rest([0.1, 0.0], 0.0));
    arch.elastic = Arc::new(curved.expect("a law"));
    expect(&arch, &free(), rest, axial, "not straight without load");
    let oblique = welded(0.7)
        .with_dead_force(world(0.01, 0.0, 1.0))
        .expect("a body");
    expect(
        &section,
        &Carried::Welded(oblique),
        rest,
        axial,
        "not longitudinal: a force across the motion would move the end",
    );
    let offset = welded(0.7)
        .with_centre(Vector3::new(0.1, 0.0, 0.0))
        .expect("a body");
    expect(
        &section,
        &Carried::Welded(offset),
        rest,
        axial,
        "the centre of mass is off the axis",
    );
    let mut skew = inertia();
    (skew[(0, 2)], skew[(2, 0)]) = (0.05, 0.05);
    let skew = Carried::Welded(RigidBody::new(0.7, skew).expect("a body"));
    let spin = moving(world(0.0, 0.0, 0.3), still());
    expect(&section, &skew, rest, spin, "not a principal axis");
    expect(
        &section,
        &free(),
        rest,
        moving(world(0.2, 0.0, 0.0), still()),
        "the end starts with omega1",
    );
    let ball = Carried::BallJoint(Body::new(0.7).expect("a body"));
    expect(
        &section,
        &ball,
        straight(0.2, 1.0),
        axial,
        "not longitudinal: a couple",
    );
    // A uniform section with strains that differ along the rod.
    let start = Start {
        time: 0.0,
        strains: &[rest, straight(0.0, 1.1)],
        branches: &[],
        velocity: axial,
    };
    let why = Reduction::recognise(&section, &clamp(), &free(), &start).expect_err("memory");
    assert!(
        why.to_string().contains("not the same all along the rod"),
        "{why}"
    );
}
