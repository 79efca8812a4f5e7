//! Linear section laws: diagonal and full, from shape and material, varying along the rod.

use crate::support::assert_close;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use proptest::prelude::*;
use snaprod::section::{
    Along, Barrier, Linear, Material, Profile, Resultant, SectionLaw, Shape, ShapeSettings, Strain,
    Transverse, Varying,
};
use std::fmt::Debug;

pub const STRAIGHT: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Each component of a - b is small against `size` of that component.
#[track_caller]
pub fn assert_near(a: &Vector6<f64>, b: &Vector6<f64>, tolerance: f64, size: &Vector6<f64>) {
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

pub fn coupled() -> Matrix6<f64> {
    let a = Matrix6::from_fn(|i, j| ((3 * i + 5 * j) as f64).sin());
    let sizes = Vector6::new(1.0, 1.2, 0.8, 10.0, 11.0, 17.0);
    let core = a * a.transpose() + Matrix6::identity();
    core.map_with_location(|i, j, x| x * sizes[i] * sizes[j])
}

/// Catches constraints made from the wrong block: the inverse of K has to be restricted *after* constraining.
/// Reference: a bordered system with multipliers.
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
/// director, a shear factor not Cowper's. The torsion constants: the series in 30 digits by mpmath, 0.1406 and 0.229
/// in Timoshenko and Goodier's table; the shear factors: Cowper's table for nu = 0.3.
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
    let material = isotropic(10.0, 0.25);
    let shape = Shape::Rectangle {
        width: 2.0,
        height: 3.0,
    };
    let law = profile(shape, material).law().unwrap();
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
        outer_radius: 1.0 + 5e-9,
        thickness: 1e-8,
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
                outer_radius: 0.3,
                thickness: 0.3,
            },
            0.886,
        ),
    ] {
        assert_close(shape.cowper_factor(0.3), want, 1e-3, 0.0, "Cowper's factor");
    }

    let mut given = profile(shape, material);
    given.set.torsion_constant = Some(5.0);
    given.set.shear_factor = Some(0.5);
    let given = given.law().unwrap();
    assert_eq!(
        given.stiffness().diagonal().as_slice()[2..5],
        [20.0, 12.0, 12.0]
    );
    // nu = 1/2 survives the way through G.
    let rubber = moduli(1.7, isotropic(1.7, 0.5).shear());
    assert!(profile(round, rubber).law().is_ok());
}

fn isotropic(young: f64, poisson: f64) -> Material {
    let transverse = Transverse::Poisson(poisson);
    Material { young, transverse }
}

fn moduli(young: f64, shear: f64) -> Material {
    let transverse = Transverse::ShearModulus(shear);
    Material { young, transverse }
}

fn profile(shape: Shape, material: Material) -> Profile {
    Profile {
        shape,
        material,
        set: ShapeSettings::default(),
    }
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
    let before = table.at(0.5 - 1e-12, 1.0).unwrap();
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
    // Couplings by indices, each with the invariant planes.
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
        // u1-u3 couples the plane of bending about d1 with the complement, but lies wholly in the complement of
        // bending about d2.
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

#[track_caller]
pub fn refused<T: Debug>(result: snaprod::Result<T>, part: &str, said: &mut Vec<String>) {
    let message = result.expect_err(part).to_string();
    assert!(message.contains(part), "{message:?} does not say {part:?}");
    assert!(!said.contains(&message), "said twice: {message}");
    said.push(message);
}

/// Catches accepted bad input, and a refusal that does not name the fault.
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
        "the resultants m1 = NaN",
        said,
    );

    let disc = Shape::Circle { radius: 1.0 };
    let of = |material| profile(disc, material).law();
    refused(of(isotropic(1.0, 0.51)), "Poisson's ratio = 0.51", said);
    refused(of(isotropic(1.0, -1.0)), "Poisson's ratio = -1", said);
    refused(of(isotropic(0.0, 0.3)), "Young's modulus = 0", said);
    refused(of(moduli(1.0, -1.0)), "shear modulus = -1", said);
    let material = isotropic(1.0, 0.3);
    let shaped = |shape| profile(shape, material).law();
    refused(shaped(Shape::Circle { radius: 0.0 }), "radius = 0", said);
    refused(
        shaped(Shape::Rectangle {
            width: -1.0,
            height: 1.0,
        }),
        "width = -1",
        said,
    );
    refused(
        shaped(Shape::Rectangle {
            width: 1.0,
            height: f64::NAN,
        }),
        "height = NaN",
        said,
    );
    refused(
        shaped(Shape::Tube {
            outer_radius: f64::NAN,
            thickness: 1.0,
        }),
        "outer radius = NaN",
        said,
    );
    refused(
        shaped(Shape::Tube {
            outer_radius: 1.0,
            thickness: 0.0,
        }),
        "thickness = 0",
        said,
    );
    let mut set = profile(disc, material);
    set.set.torsion_constant = Some(0.0);
    refused(set.law(), "torsion constant = 0", said);
    set.set.shear_factor = Some(-1.0);
    refused(set.law(), "shear factor = -1", said);
    refused(of(moduli(1.0, 0.1)), "give the shear factor", said);

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
    refused(table.at(0.8, 1.0), "s = 0.8 lies outside the table", said);
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
}
