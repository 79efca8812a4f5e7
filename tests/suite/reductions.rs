//! Rods that reduce exactly to springs and dashpots: recognition, and the whole rod against closed forms.

use crate::support::{assert_close, exponential};
use nalgebra::{Complex, Isometry3, Matrix3, Matrix4, Matrix6, SVector, Vector3, Vector4, Vector6};
use snaprod::Result;
use snaprod::body::{EndBody, Mass, PointMass, RigidBody, TimeLoad};
use snaprod::motion::reduction::{ReducedStart, Reduction, ReductionKind};
use snaprod::motion::viscoelastic::{ViscousRun, ViscousStart};
use snaprod::motion::{Event, Options, Outcome};
use snaprod::section::rate::{FrictionBarrier, Maxwell, Rate, RateLaw, Viscoelastic, Viscosity};
use snaprod::section::{Along, Barrier, Linear, Resultant, Strain, Varying};
use snaprod::viscoelastic::kinematics::Local;
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::space::Space;
use std::sync::Arc;

/// Overstress H e_t, with some strains rigid; a separate law, to keep the tests independent of the library's laws.
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
    carried: &Mass,
    strain: Strain,
    velocity: Vector6<f64>,
) -> Result<Reduction, String> {
    let start = ReducedStart {
        time: 0.0,
        strains: &[strain, strain, strain],
        branches: &[],
        velocity,
    };
    Reduction::recognise(section, carried, &start).map_err(|e| e.to_string())
}

fn inertia() -> Matrix3<f64> {
    Matrix3::new(0.3, 0.05, 0.0, 0.05, 0.4, 0.0, 0.0, 0.0, 0.25)
}

/// A welded body with its centre of mass at the end.
pub fn welded(mass: f64) -> RigidBody {
    RigidBody::new(mass, inertia()).expect("a body")
}

/// State of the whole rod at one moment.
pub struct Whole {
    pub time: f64,
    /// Strains and rates, uniform along the rod up to `spread`.
    pub strain: Strain,
    pub rate: Strain,
    pub spread: f64,
    /// Position of the end.
    pub place: Vector3<f64>,
    /// Smallest stretch so far.
    pub least: f64,
    /// The end wrench.
    pub wrench: Vec<f64>,
    pub steps: u64,
}

/// Runs the whole rod to each of the times, with the Maxwell branches relaxed at `relaxed`, and asserts the balance
/// of energy at every step.
pub fn whole<B, const M: usize, const D: usize>(
    section: &Viscoelastic,
    body: &B,
    (strain, relaxed): (Strain, Strain),
    velocity: SVector<f64, D>,
    times: &[f64],
    tolerance: f64,
) -> Vec<Whole>
where
    B: EndBody<D, Pose = Isometry3<f64>>,
{
    let places = Space::<M, D>::places();
    let local = |e: &Strain| Local::<M>::from_fn(|i, _| e[places[i]]);
    let outward = |e: &Local<M>| {
        let mut all = straight(0.0, 1.0);
        places.iter().zip(e.iter()).for_each(|(k, x)| all[*k] = *x);
        all
    };
    let reach = |time: &f64| {
        let material = Material::new(section.clone(), places).expect("a material");
        let start = ViscousStart {
            strain: &|_| local(&strain),
            relaxed: Some(&|_| local(&relaxed)),
            velocity,
        };
        let options = Options::new(*time).and_then(|o| o.with_tolerance(tolerance));
        let space = Space::<M, D>::new();
        let mut run = ViscousRun::new(space, material, body, &start, options.expect("options"))
            .expect("a start");
        let (total, mut least) = (run.first().ledger.total(), f64::INFINITY);
        while let Some(event) = run.next() {
            if let Event::Stop(outcome) = event {
                assert_eq!(outcome, Outcome::EndOfTime);
            }
            let ledger = &run.now().ledger;
            assert_close(
                ledger.total(),
                total,
                100.0 * tolerance,
                ledger.largest(),
                "energy",
            );
            least = least.min(outward(&run.now().configuration.strains[0])[5]);
        }
        let now = run.now();
        let strains = &now.configuration.strains;
        let apart = strains.iter().map(|e| (e - strains[0]).amax());
        assert!(now.ledger.dissipated > 0.0);
        let mut rate = outward(&now.flow.rates[0]);
        (0..6)
            .filter(|k| !places.contains(k))
            .for_each(|k| rate[k] = 0.0);
        Whole {
            time: *time,
            strain: outward(&strains[0]),
            rate,
            spread: apart.fold(0.0, f64::max),
            place: now.pose.translation.vector,
            least,
            wrench: now.flow.wrench.iter().copied().collect(),
            steps: run.cost().steps,
        }
    };
    times.iter().map(reach).collect()
}

/// The whole rod with initially relaxed branches, for all strains and bodies; the strains must stay uniform along the
/// rod.
pub fn run(
    section: &Viscoelastic,
    carried: &Mass,
    strain: Strain,
    velocity: Vector6<f64>,
    times: &[f64],
) -> Vec<Whole> {
    let strains = (strain, strain);
    let v = velocity.fixed_rows::<3>(3);
    let found = match carried {
        Mass::Rigid(body) => whole::<_, 6, 6>(section, body, strains, velocity, times, 1e-13),
        Mass::Point(body) => whole::<_, 6, 3>(section, body, strains, v.into_owned(), times, 1e-13),
    };
    assert!(found.iter().all(|at| at.spread < 1e-10));
    found
}

/// Catches a sign or factor in (6.3), and gravity without its potential: the damped oscillator in closed form, for a
/// point mass on a ball joint and for a welded body.
#[test]
fn a_mass_on_a_stretching_rod_is_a_damped_oscillator() {
    let (mass, [.., k], [.., c]) = (0.7, STIFFNESS, VISCOSITY);
    let gravity = Vector3::new(0.0, 0.0, -0.5);
    let ball = PointMass::<3>::new(mass).and_then(|b| b.with_gravity(gravity));
    let weld = welded(mass)
        .with_centre(Vector3::new(0.0, 0.0, 0.4))
        .and_then(|b| b.with_gravity(gravity));
    let sag = -0.5 * mass / k;
    let (x0, v0) = (0.2, -0.3);
    let (frequency, decay) = ((k / mass).sqrt(), 0.5 * c / mass);
    let damped = (frequency * frequency - decay * decay).sqrt();
    for carried in [
        Mass::Point(ball.expect("a body")),
        Mass::Rigid(weld.expect("a body")),
    ] {
        let section = plain();
        let (strain, start) = (
            straight(0.0, 1.0 + x0),
            moving(still(), Vector3::new(0.0, 0.0, v0)),
        );
        let reduction = recognise(&section, &carried, strain, start).expect("it is");
        assert_eq!(reduction.kind(), ReductionKind::Longitudinal);
        assert!(reduction.is_identical());
        let times = [0.3, 1.0, 2.5, 6.0];
        for sample in run(&section, &carried, strain, start, &times) {
            let t = sample.time;
            let (a, b) = (x0 - sag, (v0 + decay * (x0 - sag)) / damped);
            let (sin, cos) = (damped * t).sin_cos();
            let fade = (-decay * t).exp();
            let x = sag + fade * (a * cos + b * sin);
            let v = fade * ((b * damped - decay * a) * cos - (a * damped + decay * b) * sin);
            assert_close(sample.strain[5], 1.0 + x, 1e-11, 1.0, "stretch");
            assert_close(sample.rate[5], v, 1e-11, 1.0, "its rate");
            assert!((sample.place - Vector3::new(0.0, 0.0, 1.0 + x)).amax() < 1e-11);
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

/// Catches step sizes limited by the fastest rate of a stiff motion: a strong dashpot, by its two exponentials.
#[test]
fn a_strong_dashpot_costs_few_steps() {
    let (mass, [.., k], c) = (0.7, STIFFNESS, 3e3);
    let mut viscosity = diagonal(VISCOSITY);
    viscosity[(5, 5)] = c;
    let section = section(diagonal(STIFFNESS), viscosity);
    let body = PointMass::new(mass).expect("a body");
    let (x0, v0) = (0.4, -0.3);
    let slow = 2.0 * k / (c + (c * c - 4.0 * mass * k).sqrt());
    let fast = k / (mass * slow);
    let (strain, start) = (straight(0.0, 1.0 + x0), Vector3::new(0.0, 0.0, v0));
    let times = [1e-3, 1.0, 300.0, 3000.0];
    for sample in whole::<_, 6, 3>(&section, &body, (strain, strain), start, &times, 1e-10) {
        let (a, b) = (
            (fast * x0 + v0) / (fast - slow),
            (slow * x0 + v0) / (slow - fast),
        );
        let t = sample.time;
        let want = a * (-slow * t).exp() + b * (-fast * t).exp();
        assert_close(sample.strain[5], 1.0 + want, 1e-8, 1.0, "stretch");
        assert!(sample.steps < 1000, "{}", sample.steps);
    }
}

/// Catches energies that do not close, or strains that do not stay uniform along the rod. Cases: strongly nonlinear
/// laws, near total compression, with a branch, drag and a force in time.
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
        .with_force(TimeLoad::sine(Vector3::new(0.0, 0.0, 0.8), 2.0, 0.4).unwrap());
    let start = moving(still(), Vector3::new(0.0, 0.0, -2.0));
    let carried = Mass::Rigid(body);
    let reduction = recognise(&section, &carried, straight(0.0, 0.5), start).expect("it is");
    assert!(reduction.is_identical());
    let found = run(&section, &carried, straight(0.0, 0.5), start, &[5.0]);
    let least = found[0].least;
    assert!(0.0 < least && least < 0.05, "{least}");
    let equivalent = reduction.equivalent().expect("a law");
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
        .with_dead_couple(Vector3::new(0.0, 0.0, couple))
        .and_then(|b| b.with_rotational_drag(spin_drag))
        .expect("a body");
    let start = moving(Vector3::new(0.0, 0.0, 0.9), Vector3::new(0.0, 0.0, -0.2));
    let carried = Mass::Rigid(body);
    let reduction = recognise(&section, &carried, straight(0.3, 1.1), start).expect("it is");
    assert_eq!(reduction.kind(), ReductionKind::Twisting);
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
    for sample in run(
        &section,
        &carried,
        straight(0.3, 1.1),
        start,
        &[0.4, 1.5, 4.0],
    ) {
        let want = settled + exponential(&(matrix * sample.time)) * (first - settled);
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

/// Catches a branch that does not relax, or is missing in the energies: a mass on the three-parameter solid, whose
/// motion is a sum of exponentials with the roots of a cubic.
#[test]
fn a_maxwell_branch_adds_a_root() {
    let mut section = plain();
    let (modulus, time) = (1.7, 0.6);
    section.branches = vec![Maxwell {
        modulus: diagonal([0.3, 0.3, 0.2, 0.5, 0.5, modulus]),
        time,
    }];
    let (mass, [.., k], [.., c]) = (0.7, STIFFNESS, VISCOSITY);
    let body = PointMass::new(mass).expect("a body");
    let carried = Mass::Point(body.clone());
    let (x0, v0, z0) = (0.25, -0.1, -0.15);
    let field = vec![straight(0.0, 1.0 + z0); 2];
    let start = ReducedStart {
        time: 0.0,
        strains: &[straight(0.0, 1.0 + x0)],
        branches: &[field],
        velocity: moving(still(), Vector3::new(0.0, 0.0, v0)),
    };
    let reduction = Reduction::recognise(&section, &carried, &start).expect("it is");
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
    let strains = (straight(0.0, 1.0 + x0), straight(0.0, 1.0 + z0));
    let (v, times) = (Vector3::new(0.0, 0.0, v0), [0.2, 1.0, 3.0]);
    for sample in whole::<_, 6, 3>(&section, &body, strains, v, &times, 1e-13) {
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

/// Catches an inextensible rod treated as extensible: an inextensible, unshearable rod twists, and a reaction bears
/// the body's axial weight.
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
        .with_gravity(Vector3::new(0.0, 0.0, -2.0))
        .expect("a body");
    let start = moving(Vector3::new(0.0, 0.0, 0.5), still());
    let carried = Mass::Rigid(body.clone());
    let twisted = straight(0.4, 1.0);
    let reduction = recognise(&section, &carried, twisted, start).expect("it is");
    assert_eq!(
        (reduction.kind(), reduction.moving()),
        (ReductionKind::Twisting, vec![2])
    );
    let found = whole::<_, 3, 6>(&section, &body, (twisted, twisted), start, &[1.2], 1e-13);
    let sample = &found[0];
    let decay = 0.5 * 0.15 / 0.25;
    let damped = (0.8f64 / 0.25 - decay * decay).sqrt();
    let b = (0.5 + decay * 0.4) / damped;
    let (sin, cos) = (damped * 1.2).sin_cos();
    let want = (-decay * 1.2).exp() * (0.4 * cos + b * sin);
    assert_close(sample.strain[2], want, 1e-11, 1.0, "twist");
    assert_close(sample.wrench[5], -1.4, 1e-12, 0.0, "reaction");
}

/// Catches a motion with memory accepted as exact, and a refusal without a reason.
#[test]
fn what_is_not_exact_is_refused_with_its_reason() {
    let section = plain();
    let free = || Mass::Rigid(welded(0.7));
    let axial = moving(still(), Vector3::new(0.0, 0.0, 0.3));
    let rest = straight(0.0, 1.0);
    let expect = |section: &Viscoelastic, carried: &Mass, strain, velocity, word: &str| {
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
        .with_dead_force(Vector3::new(0.01, 0.0, 1.0))
        .expect("a body");
    expect(
        &section,
        &Mass::Rigid(oblique),
        rest,
        axial,
        "not longitudinal: a force across the motion would move the end",
    );
    let offset = welded(0.7)
        .with_centre(Vector3::new(0.1, 0.0, 0.0))
        .expect("a body");
    expect(
        &section,
        &Mass::Rigid(offset),
        rest,
        axial,
        "the centre of mass is off the axis",
    );
    let mut skew = inertia();
    (skew[(0, 2)], skew[(2, 0)]) = (0.05, 0.05);
    let skew = Mass::Rigid(RigidBody::new(0.7, skew).expect("a body"));
    let spin = moving(Vector3::new(0.0, 0.0, 0.3), still());
    expect(&section, &skew, rest, spin, "not a principal axis");
    expect(
        &section,
        &free(),
        rest,
        moving(Vector3::new(0.2, 0.0, 0.0), still()),
        "the end starts with omega1",
    );
    let ball = Mass::Point(PointMass::new(0.7).expect("a body"));
    expect(
        &section,
        &ball,
        straight(0.2, 1.0),
        axial,
        "not longitudinal: a couple",
    );
    // A uniform section with strains that differ along the rod.
    let start = ReducedStart {
        time: 0.0,
        strains: &[rest, straight(0.0, 1.1)],
        branches: &[],
        velocity: axial,
    };
    let why = Reduction::recognise(&section, &free(), &start).expect_err("memory");
    assert!(
        why.to_string().contains("not the same all along the rod"),
        "{why}"
    );
}
