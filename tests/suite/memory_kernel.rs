//! Small motions of the end of a straight rod: spring, dashpot, memory (AMV Sec. 6).

use crate::sections::{coupled, refused};
use crate::support::assert_close;
use nalgebra::{Matrix6, Vector6};
use snaprod::section::rate::{Carreau, KelvinVoigt, Maxwell, RateLaw, Viscoelastic, Viscosity};
use snaprod::section::{Along, Linear, Varying};
use snaprod::viscoelastic::kernel::{MemoryKernel, commuting};
use std::sync::Arc;

type Matrices = fn(f64) -> [Matrix6<f64>; 2];

/// Viscosity A(s) and stiffness B(s), nothing rigid.
fn section(matrices: Matrices) -> Viscoelastic {
    let viscosity = Varying::by(move |s| Linear::full(matrices(s)[0]));
    let rate = KelvinVoigt::new(Viscosity::from_varying(viscosity).unwrap());
    let elastic = Varying::by(move |s| Linear::full(matrices(s)[1]));
    Viscoelastic::new(Arc::new(elastic), Arc::new(rate)).unwrap()
}

fn diagonal(entries: [f64; 6]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::from(entries))
}

/// Viscosities and retardation rates of a uniform rod.
fn uniform(rates: [f64; 6], viscosities: [f64; 6]) -> Viscoelastic {
    let law = |entries: Matrix6<f64>| Linear::full(entries).unwrap();
    let a = diagonal(viscosities);
    let rate = KelvinVoigt::new(Viscosity::full(a).unwrap());
    let elastic = law(a * diagonal(rates));
    Viscoelastic::new(Arc::new(elastic), Arc::new(rate)).unwrap()
}

/// Q(s): m = m1 + (L - s) k x n, by hand.
fn transfer(arm: f64) -> Matrix6<f64> {
    let mut q = Matrix6::identity();
    (q[(0, 4)], q[(1, 3)]) = (-arm, arm);
    q
}

/// Joined, tapered, not proportional.
fn general(s: f64) -> [Matrix6<f64>; 2] {
    let a = coupled() * 0.1 + diagonal([0.2, 0.1, 0.3, 1.0, 2.0, 3.0]) * (1.0 + s);
    let turned = coupled().map_with_location(|i, j, x| if (i + j) % 2 == 0 { x } else { -x });
    [a, turned * (1.5 - s * 0.5)]
}

/// A tapered beam in the plane of u2 and v1: flexure and shear with rates that vary.
fn beam(s: f64) -> [Matrix6<f64>; 2] {
    [
        diagonal([1.0, 0.1 + 0.2 * s, 1.0, 1.0 + s, 1.0, 1.0]),
        diagonal([1.0, 2.0 - s, 1.0, 30.0, 1.0, 1.0]),
    ]
}

const TIMES: [f64; 5] = [0.0, 0.01, 0.1, 1.0, 5.0];

#[track_caller]
fn near(got: &Matrix6<f64>, want: &Matrix6<f64>, tolerance: f64, what: &str) {
    // Entry by entry against the diagonal: units play no part.
    for i in 0..6 {
        for j in 0..6 {
            let size = (want[(i, i)].abs() * want[(j, j)].abs()).sqrt();
            assert!(
                (got[(i, j)] - want[(i, j)]).abs() <= tolerance * size,
                "{what}, entry ({i}, {j}): {:e}, {:e}",
                got[(i, j)],
                want[(i, j)]
            );
        }
    }
}

/// Catches wrong factors of the length, or spurious memory of a spring with a dashpot: stretch and twist of a uniform
/// rod, (6.3).
#[test]
fn longitudinal_motion_is_a_spring_and_a_dashpot() {
    let (length, a, b) = (2.5, 3.0, 12.0);
    let rod = uniform(
        [1.0, 2.0, 3.0, 4.0, 5.0, b / a],
        [1.0, 1.0, 1.0, 1.0, 1.0, a],
    );
    let kernel = MemoryKernel::new(&rod, length).unwrap();
    for t in TIMES {
        let after = kernel.wrench_after_step(t);
        assert_close(after[(5, 5)], b / length, 1e-14, 0.0, "relaxation");
        assert_close(after[(2, 2)], 3.0 / length, 1e-14, 0.0, "twist");
        assert!(kernel.kernel(t)[(5, 5)].abs() <= 1e-14 * b, "memory");
        let want = length / b * -(-b / a * t).exp_m1();
        assert_close(kernel.creep(t)[(5, 5)], want, 1e-14, 0.0, "creep");
        let want = (a + b * t) / length;
        let got = kernel.wrench_at_constant_velocity(t)[(5, 5)];
        assert_close(got, want, 1e-14, 0.0, "velocity");
    }
}

/// Catches memory where A = tau B, tapered and joined: Z = G0^-1 (1 + tau p).
#[test]
fn proportional_viscosity_has_no_memory() {
    let tau = 0.3;
    let rod = section(|s| {
        let b = coupled() * (2.0 - s) + diagonal([s; 6]);
        [b * 0.3, b]
    });
    let kernel = MemoryKernel::new(&rod, 1.0).unwrap();
    let found = commuting(&rod, 1.0).unwrap();
    assert!(found.holds && found.defect <= 1e-12, "{found:?}");
    assert!(kernel.accuracy() <= 1e-13, "{}", kernel.accuracy());
    let relaxed = kernel.relaxed();
    near(&(kernel.instantaneous() / tau), &relaxed, 1e-12, "dashpot");
    near(&kernel.glassy(), &relaxed, 1e-12, "glassy");
    assert!(kernel.kernel(0.1).amax() <= 1e-11 * relaxed.amax());
}

/// Catches a wrong kernel: flexure and shear of a uniform rod in one plane, closed form. With Y(p) = (L^3/12/(A_b p +
/// B_b) + L/(A_s p + B_s))^-1 the force per displacement is Y. The couple per displacement is -L/2 Y in the plane of
/// u2, v1 and +L/2 Y in that of u1, v2.
#[test]
fn flexure_and_shear_remember_by_one_exponential() {
    let length: f64 = 1.4;
    let (a_b, a_s, x_b, x_s) = (0.3, 2.0, 5.0, 17.0);
    let (b_b, b_s) = (a_b * x_b, a_s * x_s);
    let rates = [x_b, x_b, 3.0, x_s, x_s, 9.0];
    let rod = uniform(rates, [a_b, a_b, 1.0, a_s, a_s, 1.0]);
    let kernel = MemoryKernel::new(&rod, length).unwrap();
    assert_eq!(kernel.modes().len(), 2);
    let cubed = length.powi(3) / 12.0;
    let (c, d) = (a_s * cubed + a_b * length, b_s * cubed + b_b * length);
    let r = d / c;
    for t in TIMES {
        let y = -(b_b - a_b * r) * (b_s - a_s * r) / c * (-r * t).exp();
        assert!(y > 0.0);
        let got = kernel.kernel(t);
        for (i, j, want) in [
            (3, 3, y),
            (1, 3, -0.5 * length * y),
            (1, 1, 0.25 * length * length * y),
            (4, 4, y),
            (0, 4, 0.5 * length * y),
            (0, 0, 0.25 * length * length * y),
            (2, 2, 0.0),
            (5, 5, 0.0),
            (0, 1, 0.0),
        ] {
            assert!(
                (got[(i, j)] - want).abs() <= 1e-12 * y,
                "{t}, ({i}, {j}): {:e}, {want:e}",
                got[(i, j)]
            );
        }
    }
    // Storage and loss: Y(i omega) = (B_b + i omega A_b)(B_s + i omega A_s)/(d + i omega c).
    for omega in [0.1, 10.0, 1e4] {
        let up = (
            b_b * b_s - omega * omega * a_b * a_s,
            omega * (a_b * b_s + a_s * b_b),
        );
        let down = (d, omega * c);
        let square = down.0 * down.0 + down.1 * down.1;
        let want = [
            (up.0 * down.0 + up.1 * down.1) / square,
            (up.1 * down.0 - up.0 * down.1) / square,
        ];
        let got = kernel.dynamic_stiffness(omega);
        for k in 0..2 {
            assert_close(got[k][(3, 3)], want[k], 1e-11, 0.0, "dynamic stiffness");
        }
    }
}

/// For [`beam`], by mpmath.
const DASHPOT: [f64; 3] = [0.4866298767476238, -0.5164501356714284, 0.8756942797629099];
const RELAXATION: [(f64, [f64; 3]); 3] = [
    (
        0.005,
        [5.5176731054959856, -7.417621937365015, 14.577969252288565],
    ),
    (
        0.05,
        [4.70664656601356, -6.382765712312753, 13.176076069586305],
    ),
    (
        0.2,
        [3.859230102170989, -5.263873063344408, 11.616077679056238],
    ),
];
const CREEP: [f64; 3] = [
    0.21704453466714582,
    0.12156561097500838,
    0.10726825170434987,
];

/// Catches a wrong kernel of a tapered rod: flexure and shear against Laplace transforms inverted with 30 digits
/// (Talbot's method, moments of 1/(A p + B) by quadrature), entries (u2, u2), (u2, v1), (v1, v1).
#[test]
fn a_tapered_cantilever_relaxes_as_its_transform_says() {
    let kernel = MemoryKernel::new(&section(beam), 1.0).unwrap();
    let entries = |m: Matrix6<f64>| [m[(1, 1)], m[(1, 3)], m[(3, 3)]];
    let check = |got: [f64; 3], want: [f64; 3], what: &str| {
        for k in 0..3 {
            assert_close(got[k], want[k], 1e-11, 0.0, what);
        }
    };
    check(entries(kernel.instantaneous()), DASHPOT, "dashpot");
    for (t, want) in RELAXATION {
        check(entries(kernel.wrench_after_step(t)), want, "relaxation");
    }
    check(entries(kernel.creep(0.05)), CREEP, "creep");
}

/// G(p) by Simpson's rule.
fn compliance(p: f64, length: f64, matrices: impl Fn(f64) -> [Matrix6<f64>; 2]) -> Matrix6<f64> {
    let panels = 400;
    let mut sum = Matrix6::zeros();
    for k in 0..=2 * panels {
        let s = length * k as f64 / (2 * panels) as f64;
        let weight = match k {
            _ if k == 0 || k == 2 * panels => 1.0,
            _ if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let [a, b] = matrices(s);
        let q = transfer(length - s);
        let inverse = (a * p + b).cholesky().unwrap().inverse();
        sum += q.transpose() * inverse * q * (weight * length / (6 * panels) as f64);
    }
    sum
}

/// Catches rates over four decades that the quadrature does not resolve: an unshearable rod with EI = 1 and viscosity
/// 10^(-1 - 4 s), force after a step of the deflection, by the same inversion of its transform.
#[test]
fn rates_over_four_decades_are_resolved() {
    let elastic = Arc::new(Linear::diagonal([1.0, 1.0], 1.0).unwrap());
    let viscosity = Varying::by(|s| Linear::diagonal([10.0_f64.powf(-1.0 - 4.0 * s), 1.0], 1.0));
    let rate = KelvinVoigt::new(Viscosity::from_varying(viscosity).unwrap());
    let rod = Viscoelastic::new(elastic, Arc::new(rate)).unwrap();
    let kernel = MemoryKernel::new(&rod, 1.0).unwrap();
    for (t, want) in [
        (1e-5, 160.837012075766),
        (1e-3, 32.5478932475302),
        (0.1, 12.3161992671234),
        (1.0, 12.00000305613),
    ] {
        let got = kernel.wrench_after_step(t)[(4, 4)];
        assert_close(got, want, 1e-11, 0.0, "relaxation");
    }
}

/// Catches inconsistent matrices: G(p) by Simpson's rule against the sum of exponentials, for a coupled, tapered rod,
/// with a welded end and with one free to turn.
#[test]
fn stiffness_is_the_inverse_of_the_compliance() {
    let length = 1.3;
    let rod = section(general);
    let welded = MemoryKernel::new(&rod, length).unwrap();
    let turning = MemoryKernel::free_to_turn(&rod, length).unwrap();
    assert!(welded.accuracy() <= 1e-13, "{}", welded.accuracy());
    for p in [0.0, 0.3, 5.0, 40.0, 1e3, 1e6] {
        let compliance = compliance(p, length, general);
        let want = compliance.cholesky().unwrap().inverse();
        near(&welded.stiffness(p), &want, 1e-10, "Z(p)");
        let force = compliance.fixed_view::<3, 3>(3, 3).into_owned();
        let mut want = Matrix6::zeros();
        want.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&force.cholesky().unwrap().inverse());
        near(&turning.stiffness(p), &want, 1e-10, "free to turn");
    }
}

/// Catches wrong relaxation of Maxwell branches (one of rank 1): the compliance with B + sum E p time/(1 + p time), by
/// Simpson's rule; and (6.14) or a verdict of no memory in spite of branches.
#[test]
fn branches_are_memory_of_the_section() {
    let line = Vector6::new(0.3, -1.0, 0.5, 2.0, 1.0, -4.0);
    let moduli = [(coupled() * 0.7, 0.2), (line * line.transpose(), 3.0)];
    let rod = |matrices| {
        moduli.iter().fold(section(matrices), |rod, (e, time)| {
            rod.with_branch(Maxwell::new(*e, *time).unwrap()).unwrap()
        })
    };
    let kernel = MemoryKernel::new(&rod(general), 1.0).unwrap();
    for p in [0.0, 0.2, 3.0, 30.0, 1e4] {
        let extra = moduli.iter().fold(Matrix6::zeros(), |sum, (e, time)| {
            sum + e * (p * time / (1.0 + p * time))
        });
        let want = compliance(p, 1.0, |s| {
            let [a, b] = general(s);
            [a, b + extra]
        });
        let want = want.cholesky().unwrap().inverse();
        near(&kernel.stiffness(p), &want, 1e-9, "Z(p)");
    }
    near(
        &kernel.wrench_after_step(0.0),
        &kernel.glassy(),
        1e-11,
        "0+",
    );
    assert!(kernel.by_end_strains(0.0).is_err());
    let proportional = rod(|s| {
        let b = coupled() * (2.0 - s);
        [b * 0.3, b]
    });
    let found = commuting(&proportional, 1.0).unwrap();
    assert!(!found.holds && found.defect > 0.01, "{found:?}");
}

/// Catches a relaxation that is not completely monotone, matrices that are not symmetric, ends that do not meet.
#[test]
fn relaxation_falls_from_glassy_to_relaxed() {
    let kernel = MemoryKernel::new(&section(general), 1.0).unwrap();
    let positive = |m: Matrix6<f64>, what: &str| {
        let size = m.amax();
        assert!((m - m.transpose()).amax() <= 1e-14 * size, "{what}");
        assert!(m.symmetric_eigenvalues().min() >= -1e-13 * size, "{what}");
    };
    near(
        &kernel.wrench_after_step(0.0),
        &kernel.glassy(),
        1e-12,
        "0+",
    );
    near(
        &kernel.wrench_after_step(1e9),
        &kernel.relaxed(),
        1e-15,
        "late",
    );
    for pair in TIMES.windows(2) {
        let at = |t| kernel.wrench_after_step(t);
        positive(at(pair[0]) - at(pair[1]), "falls");
        positive(
            kernel.kernel(pair[0]) - kernel.kernel(pair[1]),
            "memory falls",
        );
        positive(kernel.kernel(pair[1]), "memory");
        positive(kernel.creep(pair[1]) - kernel.creep(pair[0]), "creep");
    }
    // k = -R', R = (force at constant velocity)'.
    let (t, h) = (0.05, 1e-4);
    let slope = |f: &dyn Fn(f64) -> Matrix6<f64>| {
        let of = |h: f64| (f(t + h) - f(t - h)) / (2.0 * h);
        (of(h) * 4.0 - of(2.0 * h)) / 3.0
    };
    near(
        &-slope(&|t| kernel.wrench_after_step(t)),
        &kernel.kernel(t),
        1e-7,
        "k",
    );
    let of_ramp = slope(&|t| kernel.wrench_at_constant_velocity(t));
    near(&of_ramp, &kernel.wrench_after_step(t), 1e-9, "R");
    assert!(kernel.modes().iter().all(|mode| mode.rate > 0.0));
}

/// Catches a wrong verdict on (6.15): against C L - L C(1) formed by hand, and against the memory of the kernel.
/// Couplings of flexure and shear matter in their plane alone; varying rates matter even to an unshearable rod.
#[test]
fn memory_is_what_6_15_says() {
    let joined = uniform(
        [5.0, 7.0, 3.0, 7.0, 5.0, 2.0],
        [1.0, 0.5, 2.0, 9.0, 4.0, 3.0],
    );
    let apart = uniform(
        [5.0, 7.0, 3.0, 7.1, 5.0, 2.0],
        [1.0, 0.5, 2.0, 9.0, 4.0, 3.0],
    );
    for (rod, holds) in [(&joined, true), (&apart, false), (&section(general), false)] {
        let found = commuting(rod, 1.0).unwrap();
        assert_eq!(found.holds, holds, "{found:?}");
        let kernel = MemoryKernel::new(rod, 1.0).unwrap();
        assert_eq!(kernel.modes().is_empty(), holds);
        // By hand.
        let at = |s: f64| {
            let unloaded = rod.elastic.unloaded(s).unwrap();
            let zero = Vector6::zeros();
            let a = rod.rate.rate(s, &unloaded, &zero).unwrap().by_overstress;
            let a = a.try_inverse().unwrap();
            (a, rod.elastic.tangent(s, &unloaded).unwrap())
        };
        let c = |s: f64| -at(s).0.try_inverse().unwrap() * at(s).1;
        let worst = (0..10)
            .map(|k| {
                let s = 0.1 * f64::from(k);
                let l = at(s).0.try_inverse().unwrap() * transfer(1.0 - s) * at(1.0).0;
                (c(s) * l - l * c(1.0)).amax() / (c(s) * l).amax()
            })
            .fold(0.0, f64::max);
        assert_eq!(worst <= 1e-12, holds, "{worst:e}");
        let [_, memory] = kernel.by_end_strains(0.02).unwrap();
        assert_eq!(memory.amax() <= 1e-12, holds, "{memory}");
    }
    let unshearable = |viscosity: Varying| {
        let elastic = Arc::new(Linear::diagonal([1.0, 2.0], 3.0).unwrap());
        let rate = KelvinVoigt::new(Viscosity::from_varying(viscosity).unwrap());
        let rod = Viscoelastic::new(elastic, Arc::new(rate)).unwrap();
        let kernel = MemoryKernel::new(&rod, 1.0).unwrap();
        assert_eq!(kernel.moves(), [true, true, true, true, true, false]);
        assert!(kernel.by_end_strains(0.1).is_err());
        (commuting(&rod, 1.0).unwrap(), kernel)
    };
    // Different rates in both planes and in twist, but constant along the rod: no memory, with or without (6.14).
    let (found, kernel) =
        unshearable(Varying::diagonal([0.1.into(), 0.3.into()], 0.05.into()).unwrap());
    assert!(found.holds && kernel.modes().is_empty(), "{found:?}");
    for (k, stiffness, viscosity) in [(4, 1.0, 0.1), (3, 2.0, 0.3)] {
        assert_close(
            kernel.relaxed()[(k, k)],
            12.0 * stiffness,
            1e-13,
            0.0,
            "3 EI",
        );
        assert_close(
            kernel.instantaneous()[(k, k)],
            12.0 * viscosity,
            1e-13,
            0.0,
            "H",
        );
    }
    // Flexure coupled with twist in the stiffness but not in the viscosity.
    let mut joined = diagonal([1.0, 2.0, 3.0, 1.0, 1.0, 1.0]);
    (joined[(1, 2)], joined[(2, 1)]) = (0.5, 0.5);
    let joined = Linear::full(joined).unwrap().rigid([true; 3]).unwrap();
    let rate = KelvinVoigt::new(Viscosity::diagonal([0.1, 0.2], 0.3).unwrap());
    let rod = Viscoelastic::new(Arc::new(joined), Arc::new(rate)).unwrap();
    assert!(!commuting(&rod, 1.0).unwrap().holds);
    let tapered = Along::table(&[(0.0, 0.1), (1.0, 0.2)]).unwrap();
    let (found, kernel) =
        unshearable(Varying::diagonal([tapered, 0.3.into()], 0.05.into()).unwrap());
    assert!(!found.holds && found.defect > 0.05, "{found:?}");
    let memory = kernel.kernel(0.0);
    assert!(memory[(4, 4)] > 0.1 && memory[(3, 3)].abs() <= 1e-12);
}

/// Catches a wrong (6.14): its transform D + N(p) = G(p) (A(1) p + B(1)), time integral by Simpson's rule.
#[test]
fn the_kernel_of_6_14_is_that_of_the_end_strains() {
    let kernel = MemoryKernel::new(&section(general), 1.0).unwrap();
    let [a, b] = general(1.0);
    let (p, panels) = (6.0, 600);
    let last = 36.0 / p;
    let mut transform = kernel.by_end_strains(0.0).unwrap()[0];
    for k in 0..=2 * panels {
        // t = last x^2 puts the panels where the kernel is steep.
        let x = k as f64 / (2 * panels) as f64;
        let weight = match k {
            _ if k == 0 || k == 2 * panels => 1.0,
            _ if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let t = last * x * x;
        let [_, memory] = kernel.by_end_strains(t).unwrap();
        transform += memory * ((-p * t).exp() * weight * 2.0 * last * x / (6 * panels) as f64);
    }
    let want = kernel.stiffness(p).try_inverse().unwrap() * (a * p + b);
    let off = (transform - want).amax() / want.amax();
    assert!(off <= 1e-8, "{off:e}");
}

/// Catches accepted bad input, nonlinear laws used without linearisation, and times before the start.
#[test]
fn what_has_no_kernel_is_refused() {
    let said = &mut Vec::new();
    let elastic = Linear::diagonal([1.0, 1.5], 0.7).unwrap();
    let viscosity = || Viscosity::diagonal([0.1, 0.2], 0.3).unwrap();
    let rate: Arc<dyn RateLaw> = Arc::new(KelvinVoigt::new(viscosity()));
    let rod = Viscoelastic::new(Arc::new(elastic), rate.clone()).unwrap();
    for length in [0.0, f64::NAN] {
        let part = format!("length = {length}");
        refused(MemoryKernel::new(&rod, length), &part, said);
    }
    let kernel = MemoryKernel::new(&rod, 1.0).unwrap();
    assert_eq!(
        kernel.wrench_after_step(-1.0).amax() + kernel.creep(-1.0).amax(),
        0.0
    );
    refused(kernel.by_end_strains(1.0), "held rigid", said);
    let carreau = Arc::new(Carreau::new(viscosity(), 1.0, 0.3).unwrap());
    let thinning = Viscoelastic::new(Arc::new(elastic), carreau).unwrap();
    let same = MemoryKernel::new(&thinning, 1.0).unwrap();
    near(
        &same.instantaneous(),
        &kernel.instantaneous(),
        1e-14,
        "plateau",
    );

    let bent = elastic.with_rest([0.2, 0.0], 0.0).unwrap();
    let bent = Viscoelastic::new(Arc::new(bent), rate).unwrap();
    refused(MemoryKernel::new(&bent, 1.0), "must be straight", said);
}
