//! Rate laws: AMV (2.33) - (2.41), (8.1).

use crate::sections::{STRAIGHT, coupled, refused};
use crate::support::assert_close;
use nalgebra::{Matrix6, Vector6};
use snaprod::section::rate::{
    Carreau, DissipationPotential, Dissipative, FrictionBarrier, KelvinVoigt, Maxwell, RateLaw,
    SmallViscosity, Viscoelastic, Viscosity,
};
use snaprod::section::{Along, Barrier, DualNum, Linear, Resultant, SectionLaw, Strain, Varying};
use std::sync::Arc;

const HALF_WIDTHS: [f64; 2] = [0.2, 0.1];
const STRENGTH: f64 = 2.5;
const ONSET: f64 = 0.7;

fn full() -> Viscosity {
    Viscosity::full(coupled()).unwrap()
}

/// Formulas of the built-in laws, for automatic differentiation: an independent way to inverse and derivatives.
#[derive(Debug, Clone, Copy)]
struct Formula {
    /// Exponent of Carreau's law; 1 leaves it out.
    exponent: f64,
    friction: bool,
}

impl DissipationPotential for Formula {
    fn potential<D: DualNum<Primitive = f64> + Copy>(
        &self,
        _s: f64,
        e: &[D; 6],
        rate: &[D; 6],
    ) -> D {
        let h = coupled();
        let mut square = D::from(0.0);
        for i in 0..6 {
            for j in 0..6 {
                square += rate[i] * rate[j] * h[(i, j)];
            }
        }
        // int q f(q) dq.
        let power = 0.5 * (self.exponent + 1.0);
        let mut sum = ((square / ONSET + 1.0).powf(power) - 1.0) * (0.5 * ONSET / power);
        if self.friction {
            let [h1, h2] = HALF_WIDTHS;
            let bent = e[0] * rate[0] * (h2 * h2) + e[1] * rate[1] * (h1 * h1);
            let flat = e[0] * e[0] * (h2 * h2) + e[1] * e[1] * (h1 * h1);
            let depth = e[5] - flat / e[5];
            let grows = rate[5] - bent * 2.0 / e[5] + flat * rate[5] / (e[5] * e[5]);
            sum += grows * grows / depth * (0.5 * STRENGTH);
        }
        sum
    }
}

/// Coupled in strains and rates, without a closed form.
#[derive(Debug)]
struct Joined;

impl DissipationPotential for Joined {
    fn potential<D: DualNum<Primitive = f64> + Copy>(
        &self,
        s: f64,
        e: &[D; 6],
        rate: &[D; 6],
    ) -> D {
        let mut sum = D::from(0.0);
        for k in 0..6 {
            let turned = rate[k] + rate[(k + 1) % 6] * 0.3;
            let stiff = (e[k] * e[(k + 2) % 6] * 0.4).exp() * (1.0 + s);
            sum += stiff * ((turned * turned + 1.0).sqrt() - 1.0 + turned * turned * 0.1);
        }
        sum
    }

    fn rigid(&self) -> [bool; 3] {
        [false, true, false]
    }
}

fn laws() -> Vec<(&'static str, Arc<dyn RateLaw>)> {
    let held = || full().with_rigid([true, true, false]).unwrap();
    let carreau = |p| Carreau::new(full(), ONSET, p).unwrap();
    let thin = Arc::new(Carreau::new(held(), ONSET, 0.3).unwrap());
    vec![
        ("Kelvin-Voigt", Arc::new(KelvinVoigt::new(full()))),
        ("held", Arc::new(KelvinVoigt::new(held()))),
        ("thinning", Arc::new(carreau(0.3))),
        ("thickening", Arc::new(carreau(3.0))),
        (
            "friction",
            Arc::new(FrictionBarrier::new(full(), HALF_WIDTHS, STRENGTH).unwrap()),
        ),
        (
            "held friction",
            Arc::new(FrictionBarrier::new(held(), HALF_WIDTHS, STRENGTH).unwrap()),
        ),
        ("small", Arc::new(SmallViscosity::new(thin, 1e-3).unwrap())),
        ("own", Arc::new(Dissipative::new(Joined))),
    ]
}

/// Pseudo-random numbers in (-1, 1).
fn vector(seed: usize) -> Vector6<f64> {
    Vector6::from_fn(|i, _| ((7 * i + 13 * seed + 1) as f64 * 1.7).sin())
}

fn strain(seed: usize) -> Strain {
    Strain::from(STRAIGHT) + vector(1000 + seed) * 0.4
}

fn free(law: &dyn RateLaw, mut rate: Strain) -> Strain {
    for (k, rigid) in law.rigid().iter().enumerate() {
        if *rigid {
            rate[k] = 0.0;
        }
    }
    rate
}

/// Catches an inverse (2.37) that is short of roundoff, at any size of the rates, and one that lets a rigid strain
/// move or a reaction act.
#[test]
fn rates_and_overstresses_are_inverse() {
    for (name, law) in laws() {
        for seed in 0..26 {
            let size = 10.0_f64.powf(0.5 * seed as f64 - 6.0);
            let e = strain(seed);
            let rate = free(&*law, vector(seed) * size);
            let mut overstress = law.overstress(0.3, &e, &rate).unwrap();
            for (k, rigid) in law.rigid().iter().enumerate() {
                if *rigid {
                    assert_eq!(overstress[k], 0.0, "{name}");
                    overstress[k] = 17.0 * size;
                }
            }
            let found = law.rate(0.3, &e, &overstress).unwrap();
            let off = (found.rate - rate).amax() / rate.amax();
            assert!(off <= 4e-13, "{name}, size {size:e}: off by {off:e}");
            for (k, rigid) in law.rigid().iter().enumerate() {
                if *rigid {
                    let still = found.by_overstress.row(k).amax()
                        + found.by_overstress.column(k).amax()
                        + found.by_strain.row(k).amax();
                    assert_eq!(found.rate[k].abs() + still, 0.0, "{name}");
                }
            }
        }
    }
}

/// Catches a wrong closed form: rates and both derivatives against those of the potential, inverted and differentiated
/// by machine.
#[test]
fn closed_forms_agree_with_their_potentials() {
    let formula = |exponent, friction| Dissipative::new(Formula { exponent, friction });
    let friction = FrictionBarrier::new(full(), HALF_WIDTHS, STRENGTH).unwrap();
    let cases: [(Box<dyn RateLaw>, _); 4] = [
        (Box::new(KelvinVoigt::new(full())), formula(1.0, false)),
        (
            Box::new(Carreau::new(full(), ONSET, 0.3).unwrap()),
            formula(0.3, false),
        ),
        (
            Box::new(Carreau::new(full(), ONSET, 3.0).unwrap()),
            formula(3.0, false),
        ),
        (Box::new(friction), formula(1.0, true)),
    ];
    for (law, formula) in cases {
        for seed in 0..13 {
            let mut e = strain(seed);
            if seed == 12 {
                // The axis of the cone, and close to total compression beside it.
                (e[0], e[1]) = (0.0, 0.0);
            } else if seed > 8 {
                e[5] = (0.1 * e[0]).hypot(0.2 * e[1]) + 0.1_f64.powi(seed as i32 - 7);
            }
            let w = vector(seed) * 10.0_f64.powf(0.5 * seed as f64 - 3.0);
            let (got, want) = (
                law.rate(0.0, &e, &w).unwrap(),
                formula.rate(0.0, &e, &w).unwrap(),
            );
            let near = |got: &[f64], want: &[f64], what: &str| {
                let size = want.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
                for (got, want) in got.iter().zip(want) {
                    assert!(
                        (got - want).abs() <= 1e-10 * size,
                        "{law:?}, {what}, seed {seed}: {got:e}, {want:e}"
                    );
                }
            };
            near(got.rate.as_slice(), want.rate.as_slice(), "rate");
            let (a, b) = (&got.by_overstress, &want.by_overstress);
            near(a.as_slice(), b.as_slice(), "by overstress");
            near(
                got.by_strain.as_slice(),
                want.by_strain.as_slice(),
                "by strain",
            );
        }
    }
}

/// Catches derivatives inconsistent with the rates, by central differences extrapolated to order 4.
#[test]
fn derivatives_are_those_of_the_rates() {
    for (name, law) in laws() {
        for seed in 0..3 {
            let (e, w) = (strain(seed), vector(seed) * 3.0);
            let found = law.rate(0.3, &e, &w).unwrap();
            for k in 0..6 {
                let mut step = Vector6::zeros();
                let difference = |e_step: Vector6<f64>, w_step: Vector6<f64>| {
                    let of = |h: f64| {
                        let at = |h: f64| law.rate(0.3, &(e + e_step * h), &(w + w_step * h));
                        (at(h).unwrap().rate - at(-h).unwrap().rate) / (2.0 * h)
                    };
                    (of(1e-3) * 4.0 - of(2e-3)) / 3.0
                };
                step[k] = 1.0;
                let by_strain = difference(step, Vector6::zeros());
                let by_overstress = difference(Vector6::zeros(), step);
                for (got, want, what) in [
                    (found.by_strain, by_strain, "strain"),
                    (found.by_overstress, by_overstress, "overstress"),
                ] {
                    let off = (got.column(k) - want).amax() / got.amax().max(1e-300);
                    assert!(
                        off <= 1e-8 || want.amax() == 0.0,
                        "{name}, by {what} {k}: {off:e}"
                    );
                }
            }
        }
    }
}

/// Catches laws that are not monotone (2.33), have a slope that is not symmetric positive definite (2.38), or yield
/// work.
#[test]
fn laws_are_monotone_and_dissipate() {
    for (name, law) in laws() {
        for seed in 0..40 {
            let e = strain(seed);
            let sized = |seed: usize| {
                let size = 10.0_f64.powf(3.0 * (seed as f64 * 0.9).sin());
                free(&*law, vector(seed) * size)
            };
            let (a, b) = (sized(seed), sized(seed + 77));
            let at = |rate: &Strain| law.overstress(0.6, &e, rate).unwrap();
            assert!((at(&a) - at(&b)).dot(&(a - b)) > 0.0, "{name}, (2.33)");
            assert!(at(&a).dot(&a) > 0.0, "{name}, dissipation");
            let slope = law.rate(0.6, &e, &at(&a)).unwrap().by_overstress;
            let slope = slope
                + Matrix6::from_diagonal(&Vector6::from_fn(|k, _| {
                    f64::from(u8::from(law.rigid()[k]))
                }));
            let size = slope.amax();
            assert!(
                (slope - slope.transpose()).amax() <= 1e-14 * size,
                "{name}, symmetry"
            );
            assert!(slope.cholesky().is_some(), "{name}, (2.38)");
        }
    }
}

/// Catches the wrong power at large rates (2.34) and a plateau that is not one.
#[test]
fn carreau_goes_from_plateau_to_power() {
    for p in [0.2, 0.5, 2.0, 4.0] {
        let law = Carreau::new(full(), ONSET, p).unwrap();
        let e = Strain::from(STRAIGHT);
        let per_rate = |size: f64| {
            let rate = vector(3) * size;
            law.overstress(0.0, &e, &rate).unwrap().dot(&rate) / rate.norm()
        };
        let slope = |size: f64| (per_rate(2.0 * size) / per_rate(size)).log2();
        assert_close(slope(1e9), p, 1e-9, 1.0, "power");
        assert_close(slope(1e-9), 1.0, 1e-9, 1.0, "plateau");
    }
}

/// At the flexure rate given for the weakest axis of the local section, friction is 2^((p - 1)/2) of its plateau, and
/// the corresponding overstress gives about that rate. Catches the axis of another section, or the stronger one, also
/// for axes that turn along the rod and are far from alike.
#[test]
fn carreau_leaves_its_plateau_at_the_flexure_that_is_given() {
    let (p, flexure) = (0.4, 0.3);
    let along = Varying::by(|s| {
        let turn = nalgebra::Rotation2::new(0.7 + s);
        let bending = turn * nalgebra::Matrix2::new(2.0 - s, 0.0, 0.0, 1e5) * turn.inverse();
        let mut matrix = Matrix6::from_diagonal_element(3.0);
        matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(&bending);
        Linear::full(matrix)
    });
    let viscosity = Viscosity::from_varying(along).unwrap();
    let law = Carreau::from_flexure(viscosity.clone(), flexure, p).unwrap();
    let e = Strain::from(STRAIGHT);
    for s in [0.0_f64, 0.4, 1.0] {
        let (sin, cos) = (0.7 + s).sin_cos();
        let rate = Strain::new(cos, sin, 0.0, 0.0, 0.0, 0.0) * flexure;
        let wanted = viscosity.at(s).unwrap().matrix * rate * 2.0_f64.powf(0.5 * (p - 1.0));
        let found = law.overstress(s, &e, &rate).unwrap();
        assert!(
            (found - wanted).norm() < 1e-9 * wanted.norm(),
            "{found} {wanted}"
        );
        let back = law.rate(s, &e, &found).unwrap().rate;
        assert!((back - rate).norm() < 1e-9 * flexure, "{back} {rate}");
    }
}

/// Catches a friction that does not keep the section from total compression (7.14), also under bending: (Omega c + 1)
/// d_t = g.H^-1 w with g and c from the cone by hand; and depths that are not between delta and 2 delta.
#[test]
fn friction_slows_the_approach_to_total_compression() {
    let law = FrictionBarrier::new(full(), HALF_WIDTHS, STRENGTH).unwrap();
    let smooth = KelvinVoigt::new(full());
    let w = Resultant::new(1.0, -2.0, 0.3, 0.2, 0.1, -80.0);
    for k in 1..13 {
        let mut e = strain(k);
        let compressed = (0.1 * e[0]).hypot(0.2 * e[1]);
        e[5] = compressed + 0.1_f64.powi(k as i32);
        let delta = e[5] - compressed;
        let depth = law.depth(&e).unwrap();
        assert!(depth >= delta && depth <= 2.0 * delta * (1.0 + 1e-15));
        let (x, y) = (e[0] / e[5], e[1] / e[5]);
        let grown = 1.0 + 0.01 * x * x + 0.04 * y * y;
        let slope = Vector6::new(-0.02 * x, -0.08 * y, 0.0, 0.0, 0.0, grown);
        let c = slope.dot(&smooth.rate(0.0, &e, &slope).unwrap().rate);
        let push = slope.dot(&smooth.rate(0.0, &e, &w).unwrap().rate);
        assert!(push < 0.0);
        let approach = slope.dot(&law.rate(0.0, &e, &w).unwrap().rate);
        let want = push / (1.0 + c * STRENGTH / depth);
        assert!(
            (approach - want).abs() <= 1e-14 * push.abs().max(1.0),
            "{approach:e}, {want:e}"
        );
    }
}

/// Catches a total compression in finite time: a straight section under a constant pressure n takes the time
/// (H (1 - v3) + strength log(1/v3))/n to v3, here to 1e-12, by Simpson's rule in log v3.
#[test]
fn total_compression_takes_for_ever() {
    let (h, n) = (3.0, 50.0);
    let viscosity = Viscosity::diagonal([1.0, 1.0], 1.0).unwrap();
    let viscosity = viscosity.with_axial(h).unwrap();
    let law = FrictionBarrier::new(viscosity, HALF_WIDTHS, STRENGTH).unwrap();
    let w = Resultant::new(0.0, 0.0, 0.0, 0.0, 0.0, -n);
    let (panels, last) = (300, 1e-12_f64.ln());
    let mut time = 0.0;
    for k in 0..=2 * panels {
        let log = last * k as f64 / (2 * panels) as f64;
        let e = Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, log.exp());
        let weight = match k {
            _ if k == 0 || k == 2 * panels => 1.0,
            _ if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        time += weight * e[5] / law.rate(0.0, &e, &w).unwrap().rate[5];
    }
    time *= last / (6 * panels) as f64;
    let want = (h - STRENGTH * last) / n;
    assert_close(time, want, 1e-8, 0.0, "time");
}

/// Catches a viscosity of another section: tapered tables, and time x tangent of linear, tapered and nonlinear laws,
/// with rigid strains kept.
#[test]
fn viscosities_follow_the_rod() {
    let table = |a, b| Along::table(&[(0.0, a), (0.5, b), (1.0, b)]).unwrap();
    let tapered = Varying::diagonal([table(2.0, 1.0), 1.0.into()], 0.7.into()).unwrap();
    let along = Viscosity::from_varying(tapered.clone()).unwrap();
    assert_close(along.at(0.25).unwrap().matrix[(0, 0)], 1.5, 1e-15, 0.0, "H");
    assert_eq!(along.breaks(), [0.5]);

    let slowed = Viscosity::proportional(Arc::new(tapered), 0.1).unwrap();
    for (s, want) in [(0.25, 0.15), (0.75, 0.1)] {
        assert_close(
            slowed.at(s).unwrap().matrix[(0, 0)],
            want,
            1e-15,
            0.0,
            "time K",
        );
        assert_eq!(slowed.at(s).unwrap().matrix[(4, 4)], 0.0);
    }
    assert_eq!(slowed.rigid(), [false, false, false, true, true, true]);

    let base = Linear::full(coupled()).unwrap();
    let barrier = Arc::new(Barrier::new(base, HALF_WIDTHS, STRENGTH).unwrap());
    let tangent = barrier.tangent(0.0, &STRAIGHT.into()).unwrap();
    let h = Viscosity::proportional(barrier, 0.3)
        .unwrap()
        .at(0.0)
        .unwrap();
    assert!((h.matrix - tangent * 0.3).amax() <= 1e-14 * tangent.amax());
    assert!((h.matrix * h.inverse - Matrix6::identity()).amax() <= 1e-12);
}

/// Catches a viscosity stored in the place of another, or scaled, on the way through a law.
#[test]
fn a_diagonal_viscosity_is_the_diagonal_that_is_given() {
    let viscosity = Viscosity::diagonal([0.7, 1.1], 0.4)
        .and_then(|h| h.with_shear([2.0, 3.0])?.with_axial(5.0))
        .and_then(|h| h.at(0.0))
        .unwrap();
    // Components in the order u1, u2, u3, v1, v2, v3.
    let given = Vector6::new(0.7, 1.1, 0.4, 2.0, 3.0, 5.0);
    assert_eq!(viscosity.matrix, Matrix6::from_diagonal(&given));
    let inverse = Matrix6::from_diagonal(&given.map(|x| 1.0 / x));
    assert!((viscosity.inverse - inverse).amax() < 1e-15);
}

/// Catches (8.1) with eta on the wrong side.
#[test]
fn small_viscosity_scales_the_rates() {
    let law = Arc::new(Carreau::new(full(), ONSET, 0.5).unwrap());
    let small = SmallViscosity::new(law.clone(), 1e-3).unwrap();
    let (e, rate) = (strain(1), vector(2));
    let want = law.overstress(0.0, &e, &(rate * 1e-3)).unwrap();
    assert_eq!(small.overstress(0.0, &e, &rate).unwrap(), want);
}

/// Catches branches that count wrongly in the stiffness at short and long times.
#[test]
fn stiffness_relaxes_from_branch_to_branch() {
    let elastic = Arc::new(Linear::diagonal([1.0, 1.5], 0.7).unwrap());
    let rate = Arc::new(KelvinVoigt::proportional(elastic.clone(), 0.1).unwrap());
    let section = Viscoelastic::new(elastic.clone(), rate)
        .unwrap()
        .with_branch(Maxwell::proportional(&*elastic, 0.5, 2.0).unwrap())
        .unwrap()
        .with_branch(Maxwell::new(Matrix6::identity() * 4.0, 1.0).unwrap())
        .unwrap();
    for (t, want) in [
        (0.0, 5.5),
        (f64::INFINITY, 1.0),
        (1.0, 1.0 + 0.5 * (-0.5_f64).exp() + 4.0 * (-1.0_f64).exp()),
    ] {
        let found = section.stiffness_after(0.5, t).unwrap();
        assert_close(found[(0, 0)], want, 1e-15, 0.0, "stiffness");
        assert_eq!(found[(5, 5)], 0.0);
    }
}

#[derive(Debug)]
struct Faulty(f64, f64);

impl DissipationPotential for Faulty {
    fn potential<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, _e: &[D; 6], r: &[D; 6]) -> D {
        let sum = r.iter().fold(D::from(0.0), |sum, x| sum + *x * *x);
        sum * 0.5 + r[2] * self.0 + r[1] * r[1] * self.1
    }
}

/// Catches accepted bad input, and a refusal that does not name the fault.
#[test]
fn every_bad_law_has_its_message() {
    let said = &mut Vec::new();
    let nan = f64::NAN;
    let diagonal = || Viscosity::diagonal([1.0, 1.0], 1.0).unwrap();
    refused(
        Viscosity::diagonal([1.0, -2.0], 1.0),
        "bending viscosity[1] = -2",
        said,
    );
    refused(
        Viscosity::diagonal([1.0, 1.0], nan),
        "torsional viscosity = NaN",
        said,
    );
    refused(
        diagonal().with_shear([0.0, 1.0]),
        "shear viscosity[0] = 0",
        said,
    );
    refused(
        diagonal().with_axial(-1.0),
        "axial viscosity = -1 must be",
        said,
    );
    let mut skew = coupled();
    skew[(1, 0)] += 1.0;
    refused(Viscosity::full(skew), "viscosity matrix", said);
    refused(Viscosity::full(-coupled()), "must be finite and > 0", said);
    let elastic = Arc::new(Linear::diagonal([1.0, 1.5], 0.7).unwrap());
    refused(
        Viscosity::proportional(elastic.clone(), 0.0),
        "time = 0",
        said,
    );
    let slowed = Viscosity::proportional(elastic.clone(), 1.0).unwrap();
    refused(slowed.with_axial(1.0), "axial viscosity cannot be", said);
    refused(Carreau::new(full(), 0.0, 0.5), "onset = 0", said);
    refused(Carreau::new(full(), 1.0, -0.5), "exponent = -0.5", said);
    refused(Carreau::from_flexure(full(), 0.0, 0.5), "rate = 0", said);
    refused(
        FrictionBarrier::new(full(), [0.1, nan], 1.0),
        "half_widths[1] = NaN",
        said,
    );
    refused(
        FrictionBarrier::new(full(), [0.1, 0.1], 0.0),
        "strength = 0",
        said,
    );
    refused(
        FrictionBarrier::new(diagonal(), [0.1, 0.1], 1.0),
        "v3 rigid",
        said,
    );
    let law = Arc::new(KelvinVoigt::new(diagonal()));
    refused(SmallViscosity::new(law.clone(), -1.0), "eta = -1", said);

    let e = Strain::from(STRAIGHT);
    let mut bad = Resultant::zeros();
    bad[1] = nan;
    refused(
        law.rate(0.0, &e, &bad),
        "overstress must be finite: number 2 of 6 is NaN",
        said,
    );
    refused(
        law.overstress(0.0, &e, &bad),
        "strain rates must be finite",
        said,
    );
    bad = Resultant::zeros();
    bad[5] = 0.1;
    refused(
        law.overstress(0.0, &e, &bad),
        "v3 is held rigid: its rate is 0.1",
        said,
    );
    let friction = FrictionBarrier::new(full(), HALF_WIDTHS, STRENGTH).unwrap();
    let crushed = Strain::new(10.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    refused(
        friction.rate(0.0, &crushed, &bad),
        "total compression: v3 = 1",
        said,
    );
    let steep = Carreau::new(full(), 1.0, 1e-3).unwrap();
    refused(
        steep.rate(0.0, &e, &(bad * 1e6)),
        "rates that overflow",
        said,
    );

    let pushed = Dissipative::new(Faulty(0.5, 0.0));
    refused(pushed.rate(0.0, &e, &bad), "no slope at rest", said);
    let lost = Dissipative::new(Faulty(0.0, -3.0));
    refused(lost.rate(0.0, &e, &bad), "rate of u2", said);

    refused(
        Viscoelastic::new(elastic.clone(), Arc::new(KelvinVoigt::new(full()))),
        "elastic law holds v1 rigid",
        said,
    );
    let soft = Arc::new(elastic.with_axial(1.0).unwrap());
    refused(
        Viscoelastic::new(soft, law.clone()),
        "rate law holds v3 rigid",
        said,
    );
    let section = Viscoelastic::new(elastic, law).unwrap();
    let branch = |modulus, time| Maxwell { modulus, time };
    let unit = Matrix6::<f64>::identity();
    refused(
        section.clone().with_branch(branch(unit, 0.0)),
        "branch 0: relaxation time = 0",
        said,
    );
    refused(
        section.clone().with_branch(branch(-unit, 1.0)),
        "modulus[0][0] = -1",
        said,
    );
    refused(
        section.clone().with_branch(branch(skew, 1.0)),
        "must be equal",
        said,
    );
    let mut large = unit;
    (large[(0, 1)], large[(1, 0)]) = (2.0, 2.0);
    refused(
        section.clone().with_branch(branch(large, 1.0)),
        "modulus[1][0] = 2",
        said,
    );
    let ring = Matrix6::from_fn(|i, j| match (i, j) {
        _ if i == j => 1.0,
        _ if i < 3 && j < 3 => -0.9,
        _ => 0.0,
    });
    refused(
        section.clone().with_branch(branch(ring, 1.0)),
        "smallest eigenvalue",
        said,
    );
    refused(
        section.with_branch(branch(unit * nan, 1.0)),
        "must be finite",
        said,
    );
}
