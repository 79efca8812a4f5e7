//! Nonlinear section laws: the barrier against total compression, user-defined stored energy.

use crate::sections::{STRAIGHT, assert_near, coupled, refused};
use crate::support::assert_close;
use nalgebra::{Matrix6, Vector6};
use proptest::prelude::*;
use snaprod::section::{
    Barrier, Compliance, DualNum, Hyperelastic, Linear, Resultant, SectionLaw, StoredEnergy, Strain,
};

/// Formula of the barrier law, for automatic differentiation: an independent way to its derivatives.
#[derive(Debug)]
struct Formula {
    stiffness: Matrix6<f64>,
    rest: [f64; 6],
    half_widths: [f64; 2],
    strength: f64,
}

impl StoredEnergy for Formula {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
        let [h1, h2] = self.half_widths;
        let mut sum = D::from(0.0);
        for i in 0..6 {
            for j in 0..6 {
                sum +=
                    (e[i] - self.rest[i]) * (e[j] - self.rest[j]) * (0.5 * self.stiffness[(i, j)]);
            }
        }
        let q = |x: &[D; 6]| x[5] * x[5] - x[0] * x[0] * (h2 * h2) - x[1] * x[1] * (h1 * h1);
        let r = self.rest;
        let at_rest = r[5] * r[5] - (h2 * r[0]).powi(2) - (h1 * r[1]).powi(2);
        let along = (e[0] - r[0]) * (h2 * h2 * r[0]) + (e[1] - r[1]) * (h1 * h1 * r[1])
            - (e[5] - r[5]) * r[5];
        sum - ((q(e) / at_rest).ln() + along * (2.0 / at_rest)) * self.strength
    }

    fn admissible(&self, _s: f64, e: &Strain) -> bool {
        let [h1, h2] = self.half_widths;
        e[5] > (h2 * e[0]).hypot(h1 * e[1])
    }

    fn start(&self, _s: f64) -> Strain {
        self.rest.into()
    }
}

fn barrier(stiffness: Matrix6<f64>, rest: [f64; 3]) -> (Barrier, Hyperelastic<Formula>) {
    let base = Linear::full(stiffness).unwrap();
    let base = base.with_rest([rest[0], rest[1]], rest[2]).unwrap();
    let (half_widths, strength) = ([0.2, 0.1], 2.5);
    let formula = Formula {
        stiffness,
        rest: (*base.rest()).into(),
        half_widths,
        strength,
    };
    let law = Barrier::new(base, half_widths, strength).unwrap();
    (law, Hyperelastic::new(formula))
}

proptest! {
    /// Catches a wrong formula for the barrier, its gradient or its Hessian (a swapped half-width, a sign, the part at
    /// rest), or an inverse that belongs to another law.
    #[test]
    fn barrier_against_automatic_derivatives(
        u in prop::array::uniform3(-1.0..1.0_f64),
        v in prop::array::uniform2(-1.0..1.0_f64),
        depth in 0.01..3.0_f64,
        rest in prop::array::uniform3(-3.0..3.0_f64),
    ) {
        let (law, formula) = barrier(coupled(), rest);
        let (u1, u2) = (9.0 * u[0], 9.0 * u[1]);
        let v3 = (0.1 * u1).hypot(0.2 * u2) + depth;
        let e = Strain::new(u1, u2, u[2], v[0], v[1], v3);
        let energy = formula.energy(0.0, &e).unwrap();
        assert_close(law.energy(0.0, &e).unwrap(), energy, 1e-12, 1.0, "energy");
        let w = formula.resultants(0.0, &e).unwrap();
        let size = Vector6::repeat(w.amax() + 1.0);
        assert_near(&law.resultants(0.0, &e).unwrap(), &w, 1e-12, &size);
        let tangent = formula.tangent(0.0, &e).unwrap();
        let off = (law.tangent(0.0, &e).unwrap() - tangent).amax();
        prop_assert!(off <= 1e-12 * tangent.amax(), "tangent off by {off}");
        prop_assert!(law.tangent(0.0, &e).unwrap().symmetric_eigenvalues().min() > 0.0);
        for found in [law.inverse(0.0, &w).unwrap(), formula.inverse(0.0, &w).unwrap()] {
            assert_near(&found.strain, &e, 1e-11, &Vector6::repeat(10.0));
            let unit = found.compliance.matrix() * tangent;
            prop_assert!((unit - Matrix6::identity()).amax() < 1e-8);
            assert_close(found.energy, energy, 1e-11, 1.0, "energy of the inverse");
        }
    }

    /// Catches a Newton iteration that leaves the cone, stalls or loses its digits under large resultants. With p =
    /// 1/q the law reads K (e - rest) + 2 beta (p J e - J rest) = w. The p from the axial component must fit the
    /// others and give q back, without cancellation.
    #[test]
    fn barrier_under_any_load(
        direction in prop::array::uniform6(-1.0..1.0_f64),
        decade in -9.0..6.0_f64,
        stiffness in prop::array::uniform6(-1.0..3.0_f64),
        strength in -3.0..2.0_f64,
        thick in prop::array::uniform2(-2.5..0.0_f64),
    ) {
        let direction = Vector6::from(direction);
        prop_assume!(direction.norm() > 0.1);
        let w = direction.normalize() * 10_f64.powf(decade);
        let k = stiffness.map(|d| 10_f64.powf(d));
        let [h1, h2] = thick.map(|d| 10_f64.powf(d));
        let beta = 10_f64.powf(strength);
        let base = Linear::diagonal([k[0], k[1]], k[2]).unwrap();
        let base = base.with_shear([k[3], k[4]]).unwrap().with_axial(k[5]).unwrap();
        let law = Barrier::new(base, [h1, h2], beta).unwrap();
        let found = law.inverse(0.0, &w).unwrap();
        let e = found.strain;
        let compressed = (h2 * e[0]).hypot(h1 * e[1]);
        prop_assert!(e[5] > 0.0 && e[5] >= compressed);
        for i in 2..5 {
            assert_close(e[i], w[i] / k[i], 1e-14, 1e-300, "linear component");
        }
        let terms = k[5] * (e[5] + 1.0) + w[5].abs() + 2.0 * beta;
        let p = (k[5] * (e[5] - 1.0) + 2.0 * beta - w[5]) / (2.0 * beta * e[5]);
        let doubt = 1e-14 * terms / (2.0 * beta * e[5]);
        for (i, h) in [(0, h2), (1, h1)] {
            let stiff = k[i] + 2.0 * beta * p * h * h;
            let slack = 2.0 * beta * doubt * h * h * e[i].abs();
            prop_assert!((stiff * e[i] - w[i]).abs() <= 1e-12 * w.amax() + slack, "component {i}");
        }
        let q = (e[5] - compressed) * (e[5] + compressed);
        let blur = 1e-14 * e[5] * (e[5] + compressed);
        prop_assert!((q - 1.0 / p).abs() <= blur + doubt / (p * p) + 1e-12 * q, "q = {q}, 1/p = {}", 1.0 / p);
        let c = found.compliance.matrix();
        prop_assert!(c.iter().all(|x| x.is_finite()) && (0..6).all(|i| c[(i, i)] > 0.0));
        let steps = law.convergence(&w).unwrap().len();
        prop_assert!(steps <= 5, "{steps} steps");
    }
}

/// Catches a Newton iteration that is only linear, such as one with a wrong Hessian: the residual is squared.
#[test]
fn inverse_converges_quadratically() {
    let (_, law) = barrier(coupled(), [0.5, -1.0, 0.2]);
    let mut squared = 0;
    for w in [
        [3.0, -2.0, 1.0, 1.0, 2.0, -30.0],
        [30.0, 20.0, 1.0, 1.0, 2.0, 30.0],
        [0.1, 0.0, 0.0, 0.0, 0.0, -4000.0],
    ] {
        let residuals = law.convergence(0.0, &w.into()).unwrap();
        assert!(residuals.len() <= 20, "{residuals:?}");
        for pair in residuals.windows(2).filter(|pair| pair[0] < 1e-4) {
            assert!(pair[1] <= 300.0 * pair[0].powi(2) + 1e-15, "{residuals:?}");
            squared += 1;
        }
    }
    assert!(squared >= 5, "only {squared} late steps were seen");
}

/// Catches a barrier that violates AMV (2.21), (2.24), (2.26), or stresses the natural state.
#[test]
fn barrier_properties() {
    for rest in [[0.0; 3], [4.0, -2.0, 0.3]] {
        let (law, _) = barrier(coupled(), rest);
        let natural = Strain::new(rest[0], rest[1], rest[2], 0.0, 0.0, 1.0);
        assert_eq!(law.resultants(0.0, &natural).unwrap(), Resultant::zeros());
        assert_eq!(law.energy(0.0, &natural).unwrap(), 0.0);
        assert_eq!(law.unloaded(0.0).unwrap(), natural);
        let free = law.inverse(0.0, &Resultant::zeros()).unwrap();
        assert_near(&free.strain, &natural, 1e-15, &Vector6::repeat(4.0));
        // Towards the boundary at fixed curvature the energy grows by beta log 10 a decade, without bound.
        let edge = (0.1_f64 * 3.0).hypot(0.2 * 2.0);
        let energy = |gap: f64| {
            law.energy(0.0, &Strain::new(3.0, 2.0, 0.0, 0.0, 0.0, edge + gap))
                .unwrap()
        };
        for gap in [1e-6, 1e-8, 1e-10] {
            let growth = energy(0.1 * gap) - energy(gap);
            assert_close(
                growth,
                2.5 * 10_f64.ln(),
                1e-4,
                0.0,
                "growth at the boundary",
            );
        }
        // Far out it is at least quadratic.
        let far = |t: f64| {
            law.energy(0.0, &(t * Strain::new(3.0, 2.0, 1.0, 1.0, -1.0, 2.0)))
                .unwrap()
                / (t * t)
        };
        assert_close(far(1e6) / far(1e4), 1.0, 1e-2, 0.0, "quadratic growth");
        for gap in [0.0, -0.1, -2.0, f64::NAN] {
            let error = law
                .energy(0.0, &Strain::new(3.0, 2.0, 0.0, 0.0, 0.0, edge + gap))
                .unwrap_err();
            assert!(error.is_domain(), "{error}");
        }
    }
    // The cone is where every fibre (x1, x2) of the elliptic section keeps its orientation: v3 + u1 x2 - u2 x1 > 0.
    let (law, _) = barrier(coupled(), [0.0; 3]);
    let shrunk = (0..100_000).map(|k| {
        let (sin, cos) = (1e-5 * std::f64::consts::TAU * f64::from(k)).sin_cos();
        2.0 * 0.2 * cos - 3.0 * 0.1 * sin
    });
    let edge = shrunk.fold(0.0, f64::max);
    let at = |v3: f64| law.energy(0.0, &Strain::new(3.0, 2.0, 0.0, 0.0, 0.0, v3));
    assert!(at(edge + 1e-8).is_ok() && at(edge - 1e-8).is_err());
    // The linear stiffness at rest, as the documentation says.
    let (law, _) = barrier(Matrix6::identity(), [0.0; 3]);
    let tangent = law.tangent(0.0, &STRAIGHT.into()).unwrap();
    let want = Vector6::new(1.0 + 5.0 * 0.01, 1.0 + 5.0 * 0.04, 1.0, 1.0, 1.0, 6.0);
    assert!((tangent - Matrix6::from_diagonal(&want)).amax() < 1e-15);
    // Unshearable, with the barrier.
    let base = Linear::diagonal([1.0, 1.0], 1.0)
        .unwrap()
        .with_axial(10.0)
        .unwrap();
    let law = Barrier::new(base, [0.1, 0.1], 1.0).unwrap();
    let found = law
        .inverse(0.0, &Resultant::new(1.0, 2.0, 3.0, 4.0, 5.0, -60.0))
        .unwrap();
    assert_eq!((found.strain[3], found.strain[4]), (0.0, 0.0));
    assert!(law.energy(0.0, &found.strain).is_ok());
    assert_eq!(found.compliance.matrix().row(3).amax(), 0.0);
    assert!(matches!(found.compliance, Compliance::Full(_)));
}

/// A law that stiffens in bending and is coupled.
#[derive(Debug, Default)]
struct Stiffening {
    rigid: [bool; 3],
}

impl StoredEnergy for Stiffening {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, s: f64, e: &[D; 6]) -> D {
        let u = e[0] * e[0] + e[1] * e[1] * 2.0 + e[2] * e[2];
        let v = e[3] * e[3] + e[4] * e[4] + (e[5] - 1.0) * (e[5] - 1.0);
        u * (1.0 + s) + u * u + v * 50.0 + e[2] * (e[5] - 1.0) * 3.0 + (e[0] * 0.5 - e[3]).cosh()
            - 1.0
    }

    fn rigid(&self) -> [bool; 3] {
        self.rigid
    }
}

proptest! {
    /// Catches an inverse that stops early, or derivatives inconsistent with the given energy.
    #[test]
    fn users_law_and_its_inverse(
        e in prop::array::uniform6(-3.0..3.0_f64),
        s in 0.0..1.0_f64,
    ) {
        let law = Hyperelastic::new(Stiffening::default());
        let e = Strain::from(e);
        let w = law.resultants(s, &e).unwrap();
        let found = law.inverse(s, &w).unwrap();
        assert_near(&found.strain, &e, 1e-13, &Vector6::repeat(3.0));
        let unit = found.compliance.matrix() * law.tangent(s, &e).unwrap();
        prop_assert!((unit - Matrix6::identity()).amax() < 1e-12);
        // Differences of the energy: sixth order, rounding 1e-13 / h.
        for k in 0..6 {
            let at = |t: f64| {
                let mut e = e;
                e[k] += 1e-2 * t;
                law.energy(s, &e).unwrap()
            };
            let slope = (45.0 * (at(1.0) - at(-1.0)) - 9.0 * (at(2.0) - at(-2.0)) + at(3.0) - at(-3.0)) / 0.6;
            assert_close(slope, w[k], 1e-8, 1.0, "slope of the energy");
        }
    }
}

/// Catches an inverse that ignores constraints on a user's law.
#[test]
fn users_law_with_constraints() {
    let w = Resultant::new(3.0, -4.0, 2.0, 10.0, 5.0, -20.0);
    let law = Stiffening {
        rigid: [true, false, true],
    };
    let law = Hyperelastic::new(law);
    let found = law.inverse(0.5, &w).unwrap();
    assert_eq!((found.strain[3], found.strain[5]), (0.0, 1.0));
    assert_eq!(found.compliance.matrix().row(5).amax(), 0.0);
    // The free resultants of the unconstrained law at these strains equal the given ones.
    let free = Hyperelastic::new(Stiffening::default());
    let back = free.resultants(0.5, &found.strain).unwrap();
    for k in [0, 1, 2, 4] {
        assert_close(back[k], w[k], 1e-14, 1.0, "resultant");
    }
    assert!(
        law.resultants(0.5, &found.strain)
            .unwrap_err()
            .to_string()
            .contains("reaction")
    );
    assert!(
        law.energy(0.5, &(found.strain * 1.1))
            .unwrap_err()
            .to_string()
            .contains("v3")
    );
}

/// Bending energy with two wells.
#[derive(Debug)]
struct TwoWells;

impl StoredEnergy for TwoWells {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
        let others = e[0] * e[0] + e[2] * e[2] + e[3] * e[3] + e[4] * e[4] + e[5] * e[5];
        (e[1] * e[1] - 1.0).powi(2) + others
    }

    fn start(&self, _s: f64) -> Strain {
        Strain::new(0.0, 2.0, 0.0, 0.0, 0.0, 0.0)
    }
}

/// Convex law with resultants below 1.
#[derive(Debug)]
struct Slack;

impl StoredEnergy for Slack {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
        e.iter().map(|x| (*x * *x + 1.0).sqrt()).sum()
    }
}

/// Catches a law that is not strictly convex, or not superlinear, but returns strains.
#[test]
fn users_law_that_is_no_law() {
    let law = Hyperelastic::new(TwoWells);
    // d2W/du2^2 = 12 u2^2 - 4: -4 at 0.
    let message = law.tangent(0.25, &Strain::zeros()).unwrap_err().to_string();
    for part in ["not convex", "s = 0.25", "-4.000e0", "u2"] {
        assert!(message.contains(part), "{message}");
    }
    assert!(
        law.inverse(0.25, &Resultant::new(0.0, -3.0, 0.0, 0.0, 0.0, 0.0))
            .unwrap_err()
            .is_domain()
    );
    assert!(
        law.inverse(0.25, &Resultant::new(0.0, 30.0, 0.0, 0.0, 0.0, 0.0))
            .is_ok()
    );
    let law = Hyperelastic::new(Slack);
    let half = law.inverse(0.0, &Resultant::repeat(0.5)).unwrap().strain;
    assert_near(
        &half,
        &Vector6::repeat(0.5 / 0.75_f64.sqrt()),
        1e-14,
        &Vector6::repeat(1.0),
    );
    let error = law.inverse(0.0, &Resultant::repeat(1.5)).unwrap_err();
    assert!(
        error.is_no_convergence() || error.to_string().contains("not convex"),
        "{error}"
    );
}

/// Catches accepted bad input, and a refusal that does not name the fault.
#[test]
fn bad_input_to_nonlinear_laws() {
    let said = &mut Vec::new();
    let law = Linear::diagonal([1.0, 1.5], 0.7).unwrap();
    let base = law.with_axial(10.0).unwrap();
    refused(Barrier::new(law, [0.1, 0.1], 1.0), "rigid in v3", said);
    refused(
        Barrier::new(base, [0.0, 0.1], 1.0),
        "half_widths[0] = 0",
        said,
    );
    refused(
        Barrier::new(base, [0.1, 0.1], 0.0),
        "barrier strength = 0",
        said,
    );
    let bent = base.with_rest([3.0, 0.0], 0.0).unwrap();
    refused(
        Barrier::new(bent, [0.1, 0.5], 1.0),
        "rest curvature [3, 0]",
        said,
    );
    let law = Barrier::new(base, [0.1, 0.1], 1.0).unwrap();
    refused(
        law.energy(0.0, &Strain::zeros()),
        "total compression: v3 = 0",
        said,
    );
    refused(
        law.inverse(0.0, &Resultant::repeat(f64::INFINITY)),
        "the resultants m1 = inf",
        said,
    );
    let users = Hyperelastic::new(Formula {
        stiffness: Matrix6::identity(),
        rest: STRAIGHT,
        half_widths: [0.1, 0.1],
        strength: 1.0,
    });
    refused(
        users.energy(0.5, &Strain::zeros()),
        "not admissible at s = 0.5",
        said,
    );
}
