//! Invariants of all rods: first integrals, derivatives, changes of frame and units, limits.

use crate::support::{assert_close, base_wrench, json, list, rod, rows, tapers};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use snaprod::rod::{EndConditions, Problem, Rod, RodEnd};
use snaprod::section::{
    Along, Barrier, DualNum, Hyperelastic, Linear, SectionLaw, StoredEnergy, Varying,
};
use std::f64::consts::PI;
use std::sync::Arc;

/// Stiffening bending and torsion, and a barrier against zero stretch; isotropic.
#[derive(Debug)]
struct Stiffening;

impl StoredEnergy for Stiffening {
    fn energy<D: DualNum<Primitive = f64> + Copy>(&self, _s: f64, e: &[D; 6]) -> D {
        let bending = e[0] * e[0] + e[1] * e[1];
        let all = bending + e[2] * e[2];
        let shear = e[3] * e[3] + e[4] * e[4];
        bending * 0.2 + all * 0.3 + all * all * 0.05 + shear * 40.0
            - (e[5].ln() - e[5] + 1.0) * 100.0
    }

    fn is_uniform(&self) -> bool {
        true
    }
}

/// Shared section law, since rods own their laws.
#[derive(Debug, Clone)]
pub(super) struct Shared(pub(super) Arc<dyn SectionLaw>);

impl SectionLaw for Shared {
    fn energy(&self, s: f64, e: &Vector6<f64>) -> snaprod::Result<f64> {
        self.0.energy(s, e)
    }
    fn resultants(&self, s: f64, e: &Vector6<f64>) -> snaprod::Result<Vector6<f64>> {
        self.0.resultants(s, e)
    }
    fn tangent(&self, s: f64, e: &Vector6<f64>) -> snaprod::Result<Matrix6<f64>> {
        self.0.tangent(s, e)
    }
    fn inverse(&self, s: f64, w: &Vector6<f64>) -> snaprod::Result<snaprod::section::Inverse> {
        self.0.inverse(s, w)
    }
    fn is_uniform(&self) -> bool {
        self.0.is_uniform()
    }
    fn breaks(&self) -> Vec<f64> {
        self.0.breaks()
    }
}

pub(super) fn diagonal(bending: [f64; 2]) -> Linear {
    Linear::diagonal(bending, 0.7)
        .and_then(|law| law.with_shear([90.0, 90.0]))
        .and_then(|law| law.with_axial(200.0))
        .expect("a law")
}

/// Every pair of strains coupled, diagonally dominant after scaling.
pub(super) fn coupled() -> Linear {
    let d: [f64; 6] = [1.0, 1.3, 0.8, 8.0, 9.0, 14.0];
    let stiffness = Matrix6::from_fn(|i, j| {
        let c = if i == j {
            1.0
        } else {
            0.15 * ((i + j) as f64).sin()
        };
        c * d[i] * d[j]
    });
    Linear::full(stiffness).expect("a law")
}

/// A table that tapers, jumps at 0.4 and bends at 0.7.
fn table() -> Varying {
    let nodes = |k: f64| {
        Along::table(&[
            (0.0, k),
            (0.4, 0.8 * k),
            (0.4, 0.5 * k),
            (0.7, 0.6 * k),
            (2.0, 0.9 * k),
        ])
        .expect("a table")
    };
    Varying::diagonal([nodes(1.2), nodes(1.0)], nodes(0.7))
        .and_then(|law| law.with_rest([0.3.into(), nodes(0.4)], 0.9.into()))
        .expect("a law")
}

/// Name, law, whether it is transversely isotropic.
fn laws() -> Vec<(&'static str, Shared, bool)> {
    let rest = |law: Linear| law.with_rest([0.8, -0.5], 1.7).expect("a law");
    let isotropic = diagonal([1.0, 1.0]);
    let barrier = |law, widths| Barrier::new(law, widths, 30.0).expect("a law");
    let shared = |law: Arc<dyn SectionLaw>| Shared(law);
    vec![
        ("isotropic", shared(Arc::new(isotropic)), true),
        (
            "diagonal, curved",
            shared(Arc::new(rest(diagonal([1.0, 1.6])))),
            false,
        ),
        (
            "rigid shear and stretch, curved",
            shared(Arc::new(rest(
                Linear::diagonal([1.0, 1.6], 0.7).expect("a law"),
            ))),
            false,
        ),
        ("coupled, curved", shared(Arc::new(rest(coupled()))), false),
        (
            "barrier",
            shared(Arc::new(barrier(isotropic, [0.08, 0.08]))),
            true,
        ),
        (
            "barrier, curved",
            shared(Arc::new(barrier(rest(diagonal([1.0, 1.6])), [0.1, 0.05]))),
            false,
        ),
        (
            "hyperelastic",
            shared(Arc::new(Hyperelastic::new(Stiffening))),
            true,
        ),
        ("table with breaks", shared(Arc::new(table())), false),
        (
            "tapered, coupled",
            shared(Arc::new(Varying::by(|s| {
                Linear::full(coupled().stiffness() * (1.0 - 0.3 * s))
            }))),
            false,
        ),
    ]
}

const WRENCHES: [[f64; 6]; 3] = [
    [2.0, -1.5, 1.2, 4.0, 7.0, -6.0],
    [-1.0, 3.0, -2.0, -9.0, 5.0, 12.0],
    [0.5, 0.4, 4.0, 0.0, 0.3, -15.0],
];

fn halves(w: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        w.fixed_rows::<3>(0).into_owned(),
        w.fixed_rows::<3>(3).into_owned(),
    )
}

fn joined(m: Vector3<f64>, n: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z)
}

/// Catches a wrong balance law, a strain that does not belong to its resultant, directors that drift.
///
/// Along a uniform rod H = m.u + n.v - W is constant. With w = dW/de, H is the conjugate energy W*(w). Along the
/// directors the resultants' components have the derivatives m' = -u x m - v x n, n' = -u x n. Hence dW*/ds = e.w' =
/// u.(-u x m - v x n) + v.(-u x n) = 0. Intrinsic strains are included, as part of W. The twisting couple m3 is
/// constant if the law is transversely isotropic. |n| and n.m are constant for any rod.
#[test]
fn first_integrals_hold_along_the_rod() {
    let at: Vec<f64> = (0..=40).map(|i| i as f64 / 40.0 * 1.7).collect();
    for (name, law, isotropic) in laws() {
        let rod = Rod::new(1.7, law.clone()).expect("a rod");
        for base in WRENCHES.map(Vector6::from) {
            let size = 1.0 + base.norm();
            let shape = rod.shape(&base, &at, 1e-12).expect("a shape");
            let integrals = shape.iter().map(|section| {
                let unit = section.directors.transpose() * section.directors;
                assert!(
                    (unit - Matrix3::identity()).amax() < 2e-15,
                    "{name}: {unit}"
                );
                let m = section.directors.transpose() * section.couple;
                let n = section.directors.transpose() * section.force;
                let (u, v) = halves(&section.strain);
                let stored = law.energy(section.s, &section.strain).expect("an energy");
                [
                    m.dot(&u) + n.dot(&v) - stored,
                    m.z,
                    section.force.norm(),
                    section.force.dot(&section.couple),
                ]
            });
            let integrals: Vec<[f64; 4]> = integrals.collect();
            let uniform = law.is_uniform();
            for now in &integrals {
                for (i, (holds, bar)) in [
                    (uniform, 1e-10),
                    (isotropic, 1e-10),
                    (true, 1e-14),
                    (true, 1e-14),
                ]
                .into_iter()
                .enumerate()
                {
                    let gap = (now[i] - integrals[0][i]).abs() / (size * size);
                    assert!(!holds || gap < bar, "{name}, integral {i}: {gap:e}");
                }
            }
            // Control: other quantities do vary along the rod.
            let moves = |i: usize| {
                integrals
                    .iter()
                    .any(|x| (x[i] - integrals[0][i]).abs() > 1e-3)
            };
            assert!(isotropic || moves(1), "{name}: m3 does not move");
            assert!(uniform || moves(0), "{name}: H does not move");
        }
    }
}

/// Central differences of the end, extrapolated once (Richardson): error h^4 and noise 1e-13/h.
fn differences(rod: &Rod, base: &Vector6<f64>) -> Matrix6<f64> {
    let scale = 1.0 + base.norm();
    let mut matrix = Matrix6::zeros();
    for j in 0..6 {
        let quotient = |h: f64| {
            let end = |h: f64| {
                let mut b = *base;
                b[j] += h;
                rod.end(&b, 1e-13).expect("an end").section
            };
            let (after, before) = (end(h), end(-h));
            let turn = after.directors * before.directors.transpose();
            let spin =
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn))
                    .scaled_axis();
            joined(spin, after.position - before.position) / (2.0 * h)
        };
        let h = 3e-4 * scale;
        let column = (4.0 * quotient(0.5 * h) - quotient(h)) / 3.0;
        matrix.set_column(j, &column);
    }
    matrix
}

/// Catches a missing term in the variational equations, a compliance that is not de/dw, a tangent not turned with
/// the clamp. Rotations and positions apart, so that neither hides the other.
#[test]
fn tangents_agree_with_differences() {
    let clamp = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 2.0));
    for (name, law, _) in laws() {
        let rod = Rod::new(1.3, law)
            .expect("a rod")
            .with_clamp(Vector3::new(3.0, -2.0, 1.0), clamp);
        for base in WRENCHES.map(Vector6::from) {
            let exact = rod.end(&base, 1e-13).expect("an end").tangent;
            let near = differences(&rod, &base);
            for (row, column) in [(0, 0), (0, 3), (3, 0), (3, 3)] {
                let block = |m: &Matrix6<f64>| m.fixed_view::<3, 3>(row, column).into_owned();
                let gap = (block(&exact) - block(&near)).norm() / block(&exact).norm();
                assert!(gap < 1e-7, "{name}, block ({row}, {column}): {gap:e}");
            }
        }
    }
}

/// The end's numbers without units: position, directors, couple and force, energy, tangent.
fn plain(end: &RodEnd, length: f64, couple: f64) -> Vec<f64> {
    let force = couple / length;
    let unit = |i: usize| if i < 3 { couple } else { force };
    let tangent =
        Matrix6::from_fn(|i, j| end.tangent[(i, j)] * unit(j) / if i < 3 { 1.0 } else { length });
    let section = &end.section;
    let mut numbers: Vec<f64> = (section.position / length).iter().copied().collect();
    numbers.extend(section.directors.iter());
    numbers.extend((section.couple / couple).iter());
    numbers.extend((section.force / force).iter());
    numbers.push(section.energy / couple);
    numbers.extend(tangent.iter());
    numbers
}

fn gap(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(1.0_f64, |s, x| s.max(x.abs()));
    let gaps = a.iter().zip(b).map(|(x, y)| (x - y).abs() / size);
    gaps.fold(0.0, |worst, gap| if gap <= worst { worst } else { gap })
}

/// Catches a quantity in the wrong units or frame: lengths and stiffnesses in other units (rods of a micrometre to a
/// thousand kilometres), the clamp elsewhere, give the same numbers to rounding.
#[test]
fn units_and_frames_do_not_matter() {
    let data = json("rod_ivp.json");
    for row in rows(&data, "rows", 22).iter().filter(|row| !tapers(row)) {
        let model = rod(row);
        let (length, base) = (model.length(), base_wrench(row));
        let here = model.end(&base, 1e-12).expect("an end");
        let (m, n) = halves(&base);

        for (long, stiff) in [(1e-6, 1e-9), (1e6, 1e11), (0.37, 210.0)] {
            // Units of u and v; couples and forces.
            let unit = |i: usize| if i < 3 { 1.0 } else { 1.0 / long };
            let section = &row["section"];
            let rest = list(&section["rest"]);
            let given = Matrix6::from_row_slice(&list(&section["stiffness"]));
            let mut rigid = [false; 3];
            for i in list(&section["rigid"]) {
                rigid[i as usize - 3] = true;
            }
            let stiffness = Matrix6::from_fn(|i, j| {
                let k = if i == j && i >= 3 && rigid[i - 3] {
                    1.0
                } else {
                    given[(i, j)]
                };
                stiff * unit(i) * unit(j) * k
            });
            let law = Linear::full(stiffness)
                .and_then(|law| law.rigid(rigid))
                .and_then(|law| law.with_rest([rest[0] / long, rest[1] / long], rest[2] / long))
                .expect("a law");
            let (couple, force) = (stiff / long, stiff / (long * long));
            let other = Rod::new(length * long, law).expect("a rod");
            let there = other
                .end(&joined(m * couple, n * force), 1e-12)
                .expect("an end");
            let apart = gap(&plain(&here, 1.0, 1.0), &plain(&there, long, couple));
            assert!(apart < 1e-12, "{}, units {long}: {apart:e}", row["name"]);
            assert_eq!(here.steps, there.steps);
        }

        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(1.0, -2.0, 0.7));
        let shift = Vector3::new(0.3, 0.2, -0.5);
        let moved = model.clone().with_clamp(shift, turn);
        let mut there = moved
            .end(&joined(turn * m, turn * n), 1e-12)
            .expect("an end");
        let back = turn.inverse();
        let section = &mut there.section;
        section.position = back * (section.position - shift);
        section.directors = back.to_rotation_matrix() * section.directors;
        section.couple = back * section.couple;
        section.force = back * section.force;
        let mut twice = Matrix6::zeros();
        for i in [0, 3] {
            twice
                .fixed_view_mut::<3, 3>(i, i)
                .copy_from(back.to_rotation_matrix().matrix());
        }
        there.tangent = twice * there.tangent * twice.transpose();
        let apart = gap(&plain(&here, 1.0, 1.0), &plain(&there, 1.0, 1.0));
        assert!(apart < 1e-12, "{}, moved: {apart:e}", row["name"]);
    }
}

/// Catches an end condition read in the wrong frame or units: partly held ends, the world's axes permuted with the
/// clamp, lengths and stiffnesses in other units.
#[test]
fn problems_do_not_depend_on_frames_and_units() {
    // x to y, y to z, z to x.
    let turn = UnitQuaternion::from_axis_angle(
        &nalgebra::Unit::new_normalize(Vector3::repeat(1.0)),
        2.0 * PI / 3.0,
    );
    let cycle = |v: Vector3<f64>| Vector3::new(v.z, v.x, v.y);
    let (long, stiff) = (0.37, 210.0);
    let (couple, force) = (stiff / long, stiff / (long * long));
    let shift = Vector3::new(0.5, -0.25, 2.0);
    let rod = |long: f64, stiff: f64| {
        let shear = stiff / (long * long);
        let law = Linear::diagonal([stiff, 1.5 * stiff], 0.7 * stiff)
            .and_then(|law| law.with_shear([100.0 * shear, 120.0 * shear]))
            .and_then(|law| law.with_axial(300.0 * shear))
            .expect("a law");
        Rod::new(long, law).expect("a rod")
    };
    let tilted = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, -0.2));
    for (held, orientation) in [
        ([true, false, true], None),
        ([false, true, false], Some(tilted)),
        ([true, true, false], Some(tilted)),
        ([true; 3], None),
        ([true; 3], Some(tilted)),
    ] {
        let place = Vector3::new(0.2, -0.1, 0.85);
        let end = EndConditions {
            position: std::array::from_fn(|i| held[i].then_some(place[i])),
            orientation,
            force: Vector3::new(1.5, -0.7, 0.4),
            ..EndConditions::load(Vector3::zeros(), Vector3::zeros())
        };
        let moved = cycle(place * long) + shift;
        let other = EndConditions {
            position: std::array::from_fn(|i| held[(i + 2) % 3].then_some(moved[i])),
            orientation: orientation.map(|q| turn * q),
            force: cycle(end.force * force),
            ..end
        };
        let solve = |rod: Rod, end: EndConditions| {
            Problem::new(rod, end, 1e-12)
                .and_then(|p| p.solve(None))
                .expect("an equilibrium")
        };
        let here = solve(rod(1.0, 1.0), end);
        let there = solve(rod(long, stiff).with_clamp(shift, turn), other);
        let (m, n) = halves(&here.base);
        let want = joined(cycle(m), cycle(n));
        let (m, n) = halves(&there.base);
        let got = joined(m / couple, n / force);
        let apart = (got - want).norm() / (1.0 + want.norm());
        assert!(apart < 1e-10, "{held:?}: {apart:e}");
        assert_eq!(here.index, there.index, "{held:?}");
        let position = (there.end.position - shift) / long - cycle(here.end.position);
        assert!(position.norm() < 1e-10, "{held:?}: {position}");
        assert_close(
            there.end.energy / couple,
            here.end.energy,
            1e-10,
            1.0,
            "energy",
        );
    }
}

/// Catches a division by a load, a size of rounding taken absolute: no load, couples alone (a helix in closed form),
/// a force alone, loads of 1e-300.
#[test]
fn vanishing_loads_have_their_limits() {
    let (bending, torsion) = (1.0, 0.7);
    let rod = |law: Linear| Rod::new(1.0, law).expect("a rod");
    let isotropic = diagonal([bending; 2]);

    for m in [
        Vector3::new(1.0, -2.0, 3.0),
        Vector3::new(0.0, 2.0 * PI, 0.0),
        Vector3::new(0.0, 0.0, 5.0),
    ] {
        // R = exp(s m/B) exp(s (1/C - 1/B) m3 e3); r is the integral of its d3.
        let end = rod(isotropic)
            .end(&joined(m, Vector3::zeros()), 1e-13)
            .expect("an end")
            .section;
        let turn = Rotation3::from_scaled_axis(m / bending)
            * Rotation3::from_scaled_axis(Vector3::z() * (m.z * (1.0 / torsion - 1.0 / bending)));
        let (angle, cross) = (m.norm() / bending, (m / bending).cross_matrix());
        let position = Vector3::z()
            + cross * Vector3::z() * ((1.0 - angle.cos()) / angle.powi(2))
            + cross * cross * Vector3::z() * ((angle - angle.sin()) / angle.powi(3));
        assert!((end.directors - turn.matrix()).amax() < 1e-11, "{m}");
        assert!((end.position - position).amax() < 1e-11, "{m}");
        assert_close(
            end.energy,
            0.5 * (m.xy().norm_squared() / bending + m.z * m.z / torsion),
            1e-12,
            1.0,
            "energy",
        );
    }

    let pulled = rod(isotropic)
        .end(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 30.0), 1e-12)
        .expect("an end")
        .section;
    assert_close(pulled.position.z, 1.15, 1e-14, 1.0, "stretched");

    for (name, law, _) in laws() {
        let rod = Rod::new(1.3, law).expect("a rod");
        let free = rod.end(&Vector6::zeros(), 1e-12).expect("an end");
        let tiny = rod
            .end(&Vector6::repeat(1e-300), 1e-12)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let apart = gap(&plain(&free, 1.0, 1.0), &plain(&tiny, 1.0, 1.0));
        assert!(apart < 1e-14, "{name}: {apart:e}");
        let problem = Problem::new(
            rod,
            EndConditions::load(Vector3::repeat(1e-300), Vector3::zeros()),
            1e-12,
        );
        let found = problem.and_then(|p| p.solve(None)).expect("an equilibrium");
        assert!((found.end.position - free.section.position).norm() < 1e-12);
        assert_eq!(found.index, 0, "{name}");
    }
}

/// Catches overflow and lost digits under heavy loads and at extreme ratios of stiffness.
#[test]
fn heavy_loads_and_stiffness_ratios_have_their_limits() {
    // A long rod under tension lambda^2 at 60 degrees to the clamp: but for exp(-lambda), theta = angle - 4
    // atan(tan(angle/4) exp(-lambda s)) and the couple at the clamp is 2 lambda sin(angle/2). Errors at s grow like
    // exp(lambda s).
    let (lambda, angle) = (25.0_f64, PI / 3.0);
    let along = |lambda: f64| lambda.powi(2) * Vector3::new(angle.sin(), 0.0, angle.cos());
    let rod = |out_of_plane: f64| {
        Rod::new(
            1.0,
            Linear::diagonal([out_of_plane, 1.0], 0.7).expect("a law"),
        )
        .expect("a rod")
    };
    let base = joined(Vector3::y() * lambda, along(lambda));
    let at = [0.02, 0.1, 0.3, 0.5, 1.0];
    let shape = rod(2.0).shape(&base, &at, 1e-13).expect("a shape");
    for section in &shape[..4] {
        let theta = section.directors[(0, 2)].atan2(section.directors[(2, 2)]);
        let layer = angle - 4.0 * ((0.25 * angle).tan() * (-lambda * section.s).exp()).atan();
        let noise = 1e-12 * (lambda * section.s).exp();
        assert_close(theta, layer, noise, 1.0, "theta in the layer");
    }
    assert!(shape[4].position.norm() <= 1.0 && shape[4].energy.is_finite());
    for out_of_plane in [1.0, 3.0] {
        let lambda = 9.0;
        let end = EndConditions::load(along(lambda), Vector3::zeros());
        let problem = Problem::new(rod(out_of_plane), end, 1e-12);
        let found = problem.and_then(|p| p.solve(None)).expect("an equilibrium");
        assert_close(
            found.base[1],
            lambda,
            8.0 * (-2.0 * lambda).exp(),
            1.0,
            "couple",
        );
        assert_eq!(found.index, 0);
    }

    // B4 at P = 1: bending in a plane. The stiffnesses out of the plane do not matter; those of shear and stretch do.
    let (deflection, shortening) = (0.301_720_773_8, 0.056_433_236_3);
    for (other, torsion) in [(1e6, 1.0), (1e6, 1e6), (1.0, 1e-3), (1.0, 1e6)] {
        for stiff in [None, Some(1e10)] {
            let mut law = Linear::diagonal([other, 1.0], torsion).expect("a law");
            if let Some(k) = stiff {
                law = law
                    .with_shear([k; 2])
                    .and_then(|law| law.with_axial(k))
                    .expect("a law");
            }
            let rod = Rod::new(1.0, law).expect("a rod");
            let problem = Problem::new(
                rod,
                EndConditions::load(Vector3::x(), Vector3::zeros()),
                1e-12,
            );
            let found = problem.and_then(|p| p.solve(None)).expect("an equilibrium");
            let r = found.end.position;
            assert_close(r.x, deflection, 1e-9, 1.0, "deflection");
            assert_close(1.0 - r.z, shortening, 1e-9, 1.0, "shortening");
            assert_eq!(found.index, 0, "{other}, {torsion}");
        }
    }
    // A torsional stiffness of 1e-6 makes the variations oscillate a thousand times: refused, if not solved.
    let limp = Linear::diagonal([1.0, 1.0], 1e-6).expect("a law");
    let rod = Rod::new(1.0, limp).expect("a rod");
    let problem = Problem::new(
        rod,
        EndConditions::load(Vector3::x(), Vector3::zeros()),
        1e-12,
    );
    match problem.and_then(|p| p.solve(None)) {
        Ok(found) => assert_close(found.end.position.x, deflection, 1e-9, 1.0, "limp"),
        Err(why) => assert!(why.to_string().contains("wind the rod up"), "{why}"),
    }
    // A force across both axes bends the soft one alone.
    let law = Linear::diagonal([1e6, 1.0], 1e6).expect("a law");
    let problem = Problem::new(
        Rod::new(1.0, law).expect("a rod"),
        EndConditions::load(Vector3::new(1.0, 1.0, 0.0), Vector3::zeros()),
        1e-12,
    );
    let r = problem
        .and_then(|p| p.solve(None))
        .expect("an equilibrium")
        .end
        .position;
    assert_close(r.x, deflection, 3e-6, 1.0, "soft");
    assert!(r.y > 0.0 && r.y < 1e-6, "stiff: {}", r.y);
}
