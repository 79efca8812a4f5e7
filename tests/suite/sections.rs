//! Section laws: linear, from shape and material, varying, with the barrier, a user's own.

use crate::support::assert_close;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use proptest::prelude::*;
use snaprod::rod::section::{
    Along, Barrier, Compliance, DualNum, Hyperelastic, Linear, Material, Profile, Resultant,
    SectionLaw, Shape, StoredEnergy, Strain, Varying,
};
use std::fmt::Debug;
use std::sync::atomic::{AtomicUsize, Ordering};

const STRAIGHT: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Each component of a - b is small against `size` of that component.
#[track_caller]
fn assert_near(a: &Vector6<f64>, b: &Vector6<f64>, tolerance: f64, size: &Vector6<f64>) {
    for k in 0..6 {
        assert!(
            (a[k] - b[k]).abs() <= tolerance * size[k],
            "component {k}: {:e} and {:e}, off by {:e}",
            a[k],
            b[k],
            a[k] - b[k]
        );
    }
}

/// D (A A^T + 1) D with sizes D over decades: condition below 40 apart from the units.
fn spd() -> impl Strategy<Value = (Matrix6<f64>, Vector6<f64>)> {
    let entries = prop::array::uniform32(-1.0..1.0_f64);
    let more = prop::array::uniform4(-1.0..1.0_f64);
    let decades = prop::array::uniform6(-4.0..4.0_f64);
    (entries, more, decades).prop_map(|(entries, more, decades)| {
        let a = Matrix6::from_iterator(entries.into_iter().chain(more));
        let sizes = Vector6::from(decades).map(|d| 10_f64.powf(d));
        let core = a * a.transpose() + Matrix6::identity();
        let scaled = core.map_with_location(|i, j, x| x * sizes[i] * sizes[j]);
        (0.5 * (scaled + scaled.transpose()), sizes)
    })
}

proptest! {
    /// Catches an inverse that is not the inverse of this matrix and this rest, a wrong energy, units that spoil it.
    #[test]
    fn linear_law_and_its_inverse(
        (stiffness, sizes) in spd(),
        push in prop::array::uniform6(-1.0..1.0_f64),
        rest in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let law = Linear::full(stiffness).unwrap().with_rest([rest[0], rest[1]], rest[2]).unwrap();
        // Deviations of one unit of energy or so, and the rest strains in the same units.
        let deviation = Vector6::from(push).component_div(&sizes);
        let e = law.rest() + deviation;
        let deviation = e - law.rest();
        let w = law.resultants(0.3, &e).unwrap();
        let found = law.inverse(0.3, &w).unwrap();
        let size = e.abs() + sizes.map(f64::recip);
        assert_near(&found.strain, &e, 1e-13, &size);
        let back = stiffness * (&found.compliance * &w);
        assert_near(&back, &w, 1e-13, &(8.0 * sizes));
        let by_hand = 0.5 * deviation.dot(&(stiffness * deviation));
        assert_close(law.energy(0.3, &e).unwrap(), by_hand, 1e-13, 1e-3, "energy");
        assert_close(found.energy, by_hand, 1e-13, 1e-3, "energy of the inverse");
        let unit = found.compliance.matrix() * law.tangent(0.3, &e).unwrap();
        for i in 0..6 {
            for j in 0..6 {
                let want = f64::from(u8::from(i == j));
                prop_assert!((unit[(i, j)] * sizes[i] / sizes[j] - want).abs() < 1e-13);
            }
        }
    }
}

fn coupled() -> Matrix6<f64> {
    let a = Matrix6::from_fn(|i, j| ((3 * i + 5 * j) as f64).sin());
    let sizes = Vector6::new(1.0, 1.2, 0.8, 10.0, 11.0, 17.0);
    let core = a * a.transpose() + Matrix6::identity();
    core.map_with_location(|i, j, x| x * sizes[i] * sizes[j])
}

/// Catches constraints made from the wrong block: the inverse of K has to be restricted *after* constraining, which a
/// bordered system with multipliers does by another road.
#[test]
fn rigid_strains_are_constraints() {
    let stiffness = coupled();
    let w = Resultant::new(0.3, -0.7, 0.2, 4.0, -3.0, 5.0);
    for marked in [
        [true, false, false],
        [false, true, true],
        [true, true, false],
        [true, true, true],
    ] {
        let law = Linear::full(stiffness).unwrap().rigid(marked).unwrap();
        let law = law.with_rest([0.1, -0.2], 0.3).unwrap();
        let found = law.inverse(0.0, &w).unwrap();
        let held: Vec<usize> = (3..6).filter(|k| marked[k - 3]).collect();
        let n = 6 + held.len();
        let mut border = DMatrix::zeros(n, n);
        border.view_mut((0, 0), (6, 6)).copy_from(&stiffness);
        for (k, i) in held.iter().enumerate() {
            border[(6 + k, *i)] = 1.0;
            border[(*i, 6 + k)] = 1.0;
        }
        let mut right = DVector::zeros(n);
        right.rows_mut(0, 6).copy_from(&w);
        let solved = border.lu().solve(&right).unwrap();
        let want = Strain::new(0.1, -0.2, 0.3, 0.0, 0.0, 1.0) + solved.fixed_rows::<6>(0);
        assert_near(&found.strain, &want, 1e-14, &Vector6::repeat(1.0));
        for i in held {
            assert_eq!(found.strain[i], STRAIGHT[i], "held exactly");
            let matrix = found.compliance.matrix();
            assert!(
                matrix
                    .row(i)
                    .iter()
                    .chain(matrix.column(i).iter())
                    .all(|x| *x == 0.0)
            );
        }
        assert_close(
            law.energy(0.0, &found.strain).unwrap(),
            found.energy,
            1e-13,
            0.0,
            "energy",
        );
    }
}

/// Catches a constraint that is not the limit of large stiffnesses: the difference falls as their inverse.
#[test]
fn rigid_is_the_limit_of_stiff() {
    let w = Resultant::new(0.3, -0.7, 0.2, 4.0, -3.0, 5.0);
    let rigid = Linear::full(coupled())
        .unwrap()
        .rigid([true, false, true])
        .unwrap();
    let limit = rigid.inverse(0.0, &w).unwrap().strain;
    let off = |stiff: f64| {
        let mut stiffness = coupled();
        stiffness[(3, 3)] += stiff;
        stiffness[(5, 5)] += stiff;
        let law = Linear::full(stiffness).unwrap();
        (law.inverse(0.0, &w).unwrap().strain - limit).norm()
    };
    for stiff in [1e6, 1e7, 1e8] {
        let rate = (off(stiff) / off(10.0 * stiff)).log10();
        assert_close(rate, 1.0, 1e-2, 0.0, "order in 1/stiffness");
    }
}

/// Catches a torsion constant with too few terms (thin strips) or of the wrong side, second moments about the wrong
/// director, a shear factor not Cowper's. The torsion constants: the series in 30 digits by mpmath, 0.1406 and 0.229 in
/// Timoshenko and Goodier's table; the shear factors: Cowper's table for nu = 0.3.
#[test]
fn shapes_and_materials() {
    for (ratio, want) in [
        (1.0, 0.140_577_014_955_153_7),
        (1.5, 0.195_760_708_875_544_02),
        (2.0, 0.228_681_677_119_570_77),
        (10.0, 0.312_325_037_457_205_4),
        (100.0, 0.331_232_503_745_720_45),
        (1e6, 0.333_333_123_250_374_57),
    ] {
        for (width, height) in [(3.0 * ratio, 3.0), (3.0, 3.0 * ratio)] {
            let got = Shape::Rectangle { width, height }.torsion_constant();
            assert_close(got, want * ratio * 81.0, 1e-15, 0.0, "torsion constant");
        }
    }
    let material = Material::with_poisson(10.0, 0.25).unwrap();
    let shape = Shape::Rectangle {
        width: 2.0,
        height: 3.0,
    };
    let law = Profile::new(shape, material).unwrap().law().unwrap();
    let k = 10.0 * 1.25 / (12.0 + 11.0 * 0.25);
    // u1 turns about d1, along the width: the height counts with its cube.
    let want = [
        10.0 * 2.0 * 27.0 / 12.0,
        10.0 * 3.0 * 8.0 / 12.0,
        4.0 * 8.0 * 3.0 * 0.195_760_708_875_544_02,
        k * 4.0 * 6.0,
        k * 4.0 * 6.0,
        60.0,
    ];
    let got = law.stiffness().diagonal();
    assert_near(&got, &want.into(), 1e-15, &want.into());

    let round = Shape::Circle { radius: 0.3 };
    let pi = std::f64::consts::PI;
    assert_close(round.area(), pi * 0.09, 1e-15, 0.0, "area");
    assert_close(
        round.second_moments()[1],
        pi * 0.0081 / 4.0,
        1e-15,
        0.0,
        "second moment",
    );
    assert_close(
        round.torsion_constant(),
        pi * 0.0081 / 2.0,
        1e-15,
        0.0,
        "polar moment",
    );
    let thin = Shape::Tube {
        outer: 1.0 + 5e-9,
        inner: 1.0 - 5e-9,
    };
    assert_close(
        thin.torsion_constant(),
        2.0 * pi * 1e-8,
        1e-7,
        0.0,
        "thin tube",
    );
    for (shape, want) in [
        (round, 0.886),
        (shape, 0.850),
        (thin, 0.531),
        (
            Shape::Tube {
                outer: 0.3,
                inner: 0.0,
            },
            0.886,
        ),
    ] {
        assert_close(shape.cowper_factor(0.3), want, 1e-3, 0.0, "Cowper's factor");
    }

    let given = Profile::new(shape, material).unwrap();
    let given = given.with_torsion_constant(5.0).unwrap();
    let given = given
        .with_shear_factors([0.5, 0.25])
        .unwrap()
        .law()
        .unwrap();
    assert_eq!(
        given.stiffness().diagonal().as_slice()[2..5],
        [20.0, 12.0, 6.0]
    );
    // nu = 1/2 survives the way through G.
    let rubber = Material::with_poisson(1.7, 0.5).unwrap();
    assert!(Profile::new(round, rubber).unwrap().law().is_ok());
}

/// Catches interpolation from the wrong piece, a break that is not reported, a jump on the wrong side.
#[test]
fn varying_laws() {
    let table = Along::table(&[(0.0, 4.0), (0.5, 2.0), (0.5, 3.0), (1.0, 1.0)]).unwrap();
    let axial = Along::table(&[(0.0, 10.0), (0.25, 20.0), (1.0, 20.0)]).unwrap();
    let curvature = Along::polynomial(&[1.0, -3.0, 0.5]).unwrap();
    let law = Varying::diagonal([table.clone(), 1.5.into()], 0.7.into()).unwrap();
    let law = law.with_axial(axial).unwrap();
    let law = law.with_rest([curvature, 0.0.into()], 0.0.into()).unwrap();
    assert_eq!(law.breaks(), [0.25, 0.5]);
    assert!(!law.is_uniform() && law.uniform_linear().is_none());
    assert_eq!(law.planar_about(), [true, false]);
    let w = Resultant::new(2.0, 3.0, 7.0, 9.0, 9.0, 5.0);
    for (s, bending, axial) in [
        (0.125, 3.5, 15.0),
        (0.5, 3.0, 20.0),
        (0.75, 2.0, 20.0),
        (1.0, 1.0, 20.0),
    ] {
        let u1 = 1.0 - 3.0 * s + 0.5 * s * s;
        let want = Strain::new(u1 + 2.0 / bending, 2.0, 10.0, 0.0, 0.0, 1.0 + 5.0 / axial);
        let found = law.inverse(s, &w).unwrap();
        assert_near(&found.strain, &want, 1e-15, &Vector6::repeat(4.0));
        assert_close(law.unloaded(s).unwrap()[0], u1, 1e-15, 1.0, "rest");
    }
    let before = table.at(0.5 - 1e-12).unwrap();
    assert_close(before, 2.0, 1e-11, 0.0, "left of the jump");

    let constant = Varying::diagonal([1.0.into(), 1.5.into()], 0.7.into()).unwrap();
    let plain = Linear::diagonal([1.0, 1.5], 0.7).unwrap();
    assert_eq!(constant.uniform_linear(), plain.uniform_linear());

    let by = Varying::by(|s| Linear::diagonal([1.0 - s, 1.0], 1.0)).with_breaks(&[0.7, 0.2, 0.7]);
    let by = by.unwrap();
    assert_eq!(by.breaks(), [0.2, 0.7]);
    assert_eq!(by.inverse(0.5, &w).unwrap().strain[0], 4.0);
    let message = by.inverse(1.5, &w).unwrap_err().to_string();
    assert!(
        message.contains("s = 1.5") && message.contains("-0.5"),
        "{message}"
    );
}

/// Catches a coupling or a rest strain that leaves the plane unnoticed.
#[test]
fn laws_that_keep_planes() {
    let law = Linear::diagonal([1.0, 1.5], 0.7).unwrap();
    assert_eq!(law.planar_about(), [true, true]);
    assert_eq!(
        law.with_rest([0.1, 0.0], 0.0).unwrap().planar_about(),
        [true, false]
    );
    assert_eq!(
        law.with_rest([0.0, 0.1], 0.0).unwrap().planar_about(),
        [false, true]
    );
    assert_eq!(
        law.with_rest([0.0, 0.0], 0.1).unwrap().planar_about(),
        [false, false]
    );
    // Couplings by their places: each with the planes it leaves whole.
    for (i, j, want) in [
        (0, 1, [false, false]),
        (0, 2, [false, true]),
        (1, 2, [true, false]),
        (0, 3, [false, false]),
        (0, 4, [true, true]),
        (1, 3, [true, true]),
        (2, 4, [false, true]),
        (2, 3, [true, false]),
        (3, 4, [false, false]),
        (2, 5, [false, false]),
    ] {
        let mut stiffness = Matrix6::identity();
        stiffness[(i, j)] = 0.5;
        stiffness[(j, i)] = 0.5;
        let law = Linear::full(stiffness).unwrap();
        // u1-u3 joins the plane of bending about d1 to its outside, but lies wholly outside that about d2.
        let expected = std::array::from_fn(|axis| {
            let inside: [usize; 3] = if axis == 0 { [0, 4, 5] } else { [1, 3, 5] };
            inside.contains(&i) == inside.contains(&j)
        });
        assert_eq!(expected, want, "the table of this test, {i} {j}");
        assert_eq!(law.planar_about(), want, "coupling {i} {j}");
    }
    let law = law.with_axial(100.0).unwrap();
    assert_eq!(
        Barrier::new(law, [0.1, 0.1], 1.0).unwrap().planar_about(),
        [true, true]
    );
}

/// The barrier law as its formula, for automatic differentiation: another road to its derivatives.
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

    /// Catches a Newton iteration that leaves the cone, stalls or loses its digits under large resultants. With
    /// p = 1/q the law reads K (e - rest) + 2 beta (p J e - J rest) = w: p from the axial component must serve the
    /// others and give q back, which needs no small difference.
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

/// Catches a barrier that is not one (AMV (2.21), (2.24), (2.26)), or that stresses the natural state.
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

/// A law that stiffens in bending and is coupled; counts its evaluations.
#[derive(Debug, Default)]
struct Stiffening {
    evaluations: AtomicUsize,
    rigid: [bool; 3],
}

impl StoredEnergy for Stiffening {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, s: f64, e: &[D; 6]) -> D {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
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
    /// Catches an inverse that stops early, or derivatives that are not those of the energy given.
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

/// Catches an inverse that wastes Newton steps or ignores constraints on a user's law.
#[test]
fn users_law_with_constraints() {
    let w = Resultant::new(3.0, -4.0, 2.0, 10.0, 5.0, -20.0);
    let law = Stiffening {
        rigid: [true, false, true],
        ..Stiffening::default()
    };
    let law = Hyperelastic::new(law);
    let found = law.inverse(0.5, &w).unwrap();
    assert_eq!((found.strain[3], found.strain[5]), (0.0, 1.0));
    assert_eq!(found.compliance.matrix().row(5).amax(), 0.0);
    // The free resultants of the unconstrained law at these strains are those given.
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

/// Convex, but its resultants stay below 1.
#[derive(Debug)]
struct Slack;

impl StoredEnergy for Slack {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
        e.iter().map(|x| (*x * *x + 1.0).sqrt()).sum()
    }
}

/// Catches a law that is not strictly convex, or not superlinear, and gives strains nevertheless.
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

#[track_caller]
fn refused<T: Debug>(result: snaprod::Result<T>, part: &str, said: &mut Vec<String>) {
    let message = result.expect_err(part).to_string();
    assert!(message.contains(part), "{message:?} does not say {part:?}");
    assert!(!said.contains(&message), "said twice: {message}");
    said.push(message);
}

/// Catches bad input that passes, or that is refused with a message that does not name it.
#[test]
fn every_bad_input_has_its_message() {
    let said = &mut Vec::new();
    let law = Linear::diagonal([1.0, 1.5], 0.7).unwrap();
    refused(
        Linear::diagonal([0.0, 1.0], 1.0),
        "bending stiffness about d1 = 0",
        said,
    );
    refused(
        Linear::diagonal([1.0, -2.0], 1.0),
        "bending stiffness about d2 = -2",
        said,
    );
    refused(
        Linear::diagonal([1.0, 2.0], f64::NAN),
        "torsional stiffness = NaN",
        said,
    );
    refused(
        Linear::diagonal([1.0, 1e-310], 1.0),
        "its inverse overflows",
        said,
    );
    refused(
        law.with_shear([1.0, f64::INFINITY]),
        "shear stiffness along d2 = inf",
        said,
    );
    refused(law.with_axial(-1.0), "axial stiffness = -1", said);
    refused(
        law.with_rest([0.0, f64::NAN], 0.0),
        "rest curvature[1] = NaN",
        said,
    );
    refused(
        law.with_rest([0.0, 0.0], f64::INFINITY),
        "rest twist = inf",
        said,
    );
    let with = |entries: &[(usize, usize, f64)]| {
        let mut matrix = Matrix6::identity();
        for (i, j, value) in entries {
            matrix[(*i, *j)] = *value;
        }
        Linear::full(matrix)
    };
    refused(
        with(&[(0, 3, 0.1)]),
        "stiffness[3][0] = 0 and stiffness[0][3] = 0.1",
        said,
    );
    refused(with(&[(0, 3, f64::NAN)]), "stiffness[0][3] = NaN", said);
    refused(
        with(&[(4, 1, 1.5), (1, 4, 1.5)]),
        "minor of u2 and v2",
        said,
    );
    let pairs: Vec<_> = [(0, 1), (1, 2), (0, 2)]
        .into_iter()
        .flat_map(|(i, j)| [(i, j, -0.6), (j, i, -0.6)])
        .collect();
    refused(with(&pairs), "smallest eigenvalue is -2.000e-1", said);
    refused(
        law.energy(0.0, &Strain::repeat(f64::NAN)),
        "must be finite",
        said,
    );
    refused(
        law.energy(0.0, &Strain::zeros()),
        "v3 = 0 is held rigid at 1",
        said,
    );
    refused(
        law.resultants(0.0, &STRAIGHT.into()),
        "n1 is a reaction",
        said,
    );
    refused(
        law.inverse(0.0, &Resultant::repeat(f64::NAN)),
        "the resultants [NaN",
        said,
    );

    let material = Material::with_poisson(1.0, 0.3).unwrap();
    refused(
        Material::with_poisson(1.0, 0.51),
        "Poisson's ratio = 0.51",
        said,
    );
    refused(
        Material::with_poisson(1.0, -1.0),
        "Poisson's ratio = -1",
        said,
    );
    refused(
        Material::with_poisson(0.0, 0.3),
        "Young's modulus = 0",
        said,
    );
    refused(Material::with_shear(1.0, -1.0), "shear modulus = -1", said);
    let profile = |shape| Profile::new(shape, material);
    refused(profile(Shape::Circle { radius: 0.0 }), "radius = 0", said);
    refused(
        profile(Shape::Rectangle {
            width: -1.0,
            height: 1.0,
        }),
        "width = -1",
        said,
    );
    refused(
        profile(Shape::Rectangle {
            width: 1.0,
            height: f64::NAN,
        }),
        "height = NaN",
        said,
    );
    refused(
        profile(Shape::Tube {
            outer: f64::NAN,
            inner: 1.0,
        }),
        "outer radius = NaN",
        said,
    );
    refused(
        profile(Shape::Tube {
            outer: 1.0,
            inner: 1.0,
        }),
        "inner radius = 1",
        said,
    );
    let disc = Shape::Circle { radius: 1.0 };
    refused(
        profile(disc).unwrap().with_torsion_constant(0.0),
        "torsion constant = 0",
        said,
    );
    refused(
        profile(disc).unwrap().with_shear_factors([1.0, -1.0]),
        "shear factor[1] = -1",
        said,
    );
    let odd = Material::with_shear(1.0, 0.1).unwrap();
    refused(
        Profile::new(disc, odd).unwrap().law(),
        "give the shear factors",
        said,
    );

    refused(Along::table(&[(0.0, 1.0)]), "has 1 nodes", said);
    refused(
        Along::table(&[(0.0, 1.0), (1.0, f64::NAN)]),
        "node 1 = (1, NaN)",
        said,
    );
    refused(
        Along::table(&[(0.0, 1.0), (1.0, 1.0), (0.5, 1.0)]),
        "s = 1 stands before s = 0.5",
        said,
    );
    refused(
        Along::table(&[(0.0, 1.0), (0.5, 1.0), (0.5, 1.0), (0.5, 2.0), (1.0, 1.0)]),
        "s = 0.5 stands too often",
        said,
    );
    refused(
        Along::table(&[(0.0, 1.0), (0.0, 2.0), (1.0, 1.0)]),
        "s = 0 stands too often",
        said,
    );
    refused(Along::polynomial(&[]), "at least one", said);
    let table = Along::table(&[(0.0, 1.0), (0.5, -1.0), (0.75, 1.0)]).unwrap();
    refused(table.at(0.8), "s = 0.8 lies outside the table", said);
    refused(
        Varying::diagonal([1.0.into(), table], 1.0.into()),
        "bending[1] at s = 0.5 = -1",
        said,
    );
    let sinking = Along::polynomial(&[1.0, -2.0]).unwrap();
    let varying = Varying::diagonal([1.0.into(), 1.0.into()], sinking).unwrap();
    refused(
        varying.inverse(0.75, &Resultant::zeros()),
        "s = 0.75: the torsional stiffness = -0.5",
        said,
    );
    let by = Varying::by(move |_| Ok(law));
    refused(
        by.clone().with_axial(1.0.into()),
        "axial cannot be set",
        said,
    );
    refused(by.with_breaks(&[f64::NAN]), "break s = NaN", said);

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
        "the resultants [inf",
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
