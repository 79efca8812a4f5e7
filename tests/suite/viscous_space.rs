//! Rods in space: the curve of a strain field, Q, and their derivatives.

use crate::support::{assert_close, exponential, worst};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix4, SVector, UnitQuaternion, Vector3, Vector6,
};
use snaprod::viscoelastic::grid::Grid;
use snaprod::viscoelastic::kinematics::{Kinematics, Local};
use snaprod::viscoelastic::space::{FramedCurve, Space};

/// (u, v) at s: smooth, no symmetry, |u| up to about 2 `size`.
fn field(s: f64, size: f64) -> Vector6<f64> {
    let x = 2.0 * s - 1.0;
    Vector6::new(
        size * (0.7 + 0.9 * x - 0.6 * x * x * x),
        size * (-0.5 + 0.8 * x * x),
        size * (1.1 - 0.7 * x + 0.4 * x.powi(4)),
        0.2 - 0.1 * x,
        -0.15 + 0.2 * x * x,
        1.1 + 0.1 * x,
    )
}

/// Rates of change of (u, v) at s, or a second set of them.
fn rates(s: f64, which: u8) -> Vector6<f64> {
    let x = 2.0 * s - 1.0;
    if which == 0 {
        Vector6::new(
            0.4 - x,
            0.8 + 0.3 * x * x,
            -0.6 * x,
            0.3,
            -0.5 * x,
            0.2 - 0.4 * x * x,
        )
    } else {
        Vector6::new(-0.7, 0.2 + x, 0.5 * x * x, -0.2 * x, 0.4, 0.3 * x)
    }
}

/// The first three strains, and the further strains of M.
fn part<const M: usize>(e: &Vector6<f64>) -> Local<M> {
    Local::from_fn(|k, _| e[if k < 3 { k } else { k + 6 - M }])
}

/// All six strains of a rod with M of them.
fn whole<const M: usize>(e: &Vector6<f64>) -> Vector6<f64> {
    let mut all = Vector6::new(e[0], e[1], e[2], 0.0, 0.0, 1.0);
    for k in 9 - M..6 {
        all[k] = e[k];
    }
    all
}

fn at_nodes<const M: usize>(grid: &Grid, e: impl Fn(f64) -> Vector6<f64>) -> Vec<Local<M>> {
    grid.nodes().iter().map(|s| part(&e(*s))).collect()
}

fn curve<const M: usize>(grid: &Grid, strains: &[Local<M>]) -> FramedCurve {
    Kinematics::<M, 6>::shape(&Space::<M, 6>::new(), grid, strains).expect("a shape")
}

fn rotation(pose: &Isometry3<f64>) -> Matrix3<f64> {
    pose.rotation.to_rotation_matrix().into_inner()
}

/// exp(s u) and int_0^s exp(s u) v for constant strains.
fn helix(e: &Vector6<f64>, s: f64) -> (Matrix3<f64>, Vector3<f64>) {
    let (u, v) = (
        Vector3::new(e[0], e[1], e[2]),
        Vector3::new(e[3], e[4], e[5]),
    );
    let angle = u.norm();
    let axis = u / angle;
    let along = axis * axis.dot(&v);
    let (sin, cos) = (angle * s).sin_cos();
    let turned = UnitQuaternion::from_scaled_axis(u * s).to_rotation_matrix();
    let r = along * s + (v - along) * (sin / angle) + axis.cross(&v) * ((1.0 - cos) / angle);
    (turned.into_inner(), r)
}

/// R and r at s by Magnus' method of order 4 with h -> 0, independent of quaternions and grids.
fn fine(e: impl Fn(f64) -> Vector6<f64>, s: f64, steps: usize) -> (Matrix3<f64>, Vector3<f64>) {
    let twist = |s: f64| {
        let e = e(s);
        let mut xi = Matrix4::zeros();
        xi.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&Vector3::new(e[0], e[1], e[2]).cross_matrix());
        xi.fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&Vector3::new(e[3], e[4], e[5]));
        xi
    };
    let with = |steps: usize| {
        let h = s / steps as f64;
        let off = 3.0_f64.sqrt() / 6.0;
        (0..steps).fold(Matrix4::identity(), |g, k| {
            let middle = h * (k as f64 + 0.5);
            let (a, b) = (twist(middle - off * h), twist(middle + off * h));
            let turn = (a + b) * (0.5 * h) + (a * b - b * a) * (0.5 * off * h * h);
            g * exponential(&turn)
        })
    };
    let g = (with(2 * steps) * 16.0 - with(steps)) / 15.0;
    (
        g.fixed_view::<3, 3>(0, 0).into_owned(),
        g.fixed_view::<3, 1>(0, 3).into_owned(),
    )
}

fn assert_same<'a>(
    got: impl IntoIterator<Item = &'a f64>,
    want: impl IntoIterator<Item = &'a f64>,
    tolerance: f64,
    what: &str,
) {
    let (got, want): (Vec<_>, Vec<_>) = (got.into_iter().collect(), want.into_iter().collect());
    assert_eq!(got.len(), want.len(), "{what}");
    let size = want.iter().map(|x| x.abs()).fold(1e-3, f64::max);
    for (k, (g, w)) in got.iter().zip(&want).enumerate() {
        assert_close(**g, **w, tolerance, size, &format!("{what}, entry {k}"));
    }
}

/// Largest difference of two matrices of any shape; NaN is infinite.
fn distance<'a>(a: impl IntoIterator<Item = &'a f64>, b: impl IntoIterator<Item = &'a f64>) -> f64 {
    worst(a.into_iter().zip(b).map(|(a, b)| (a - b).abs()))
}

/// f'(0) of a vector function by central differences of order 6.
fn slope(f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let h = 8e-3;
    let across = |k: f64| f(k * h) - f(-k * h);
    (across(1.0) * 45.0 - across(2.0) * 9.0 + across(3.0)) / (60.0 * h)
}

/// A helix in closed form: sides, signs and senses of every strain; nodes, end and sections between, few turns and ten.
#[test]
fn constant_strains_make_a_helix() {
    for (turning, nodes, tolerance) in [(1.0, 16, 2e-15), (4.0, 24, 4e-15), (30.0, 72, 3e-14)] {
        let e = Vector6::new(1.2 * turning, -0.7 * turning, 1.5 * turning, 0.2, -0.3, 1.1);
        for breaks in [vec![], vec![0.2, 0.65]] {
            let counts = vec![nodes; breaks.len() + 1];
            let grid = Grid::new(&breaks, &counts);
            let strains = at_nodes::<6>(&grid, |_| e);
            let shape = curve(&grid, &strains);
            for (i, s) in grid.nodes().iter().enumerate() {
                let (frame, r) = helix(&e, *s);
                assert_same(&shape.directors()[i], &frame, tolerance, "R at a node");
                let off = (shape.positions()[i] - r).norm();
                assert!(off <= tolerance, "r at node {i} of {nodes}: {off:e}");
            }
            for s in [0.0, 0.1, 0.2, 0.437, 0.9, 1.0] {
                let (frame, r) = helix(&e, s);
                let section = Space::<6, 6>::new().section_at(&grid, &shape, &strains, s);
                assert_same(&rotation(&section), &frame, 4.0 * tolerance, "R between");
                let off = (section.translation.vector - r).norm();
                assert!(off <= tolerance, "r({s}), {nodes} nodes: {off:e}");
            }
            let (frame, r) = helix(&e, 1.0);
            let end = Kinematics::<6, 6>::pose(&Space::new(), &shape);
            assert_same(&rotation(&end), &frame, tolerance, "R(1)");
            assert!((end.translation.vector - r).norm() <= tolerance, "r(1)");
        }
    }
}

/// Strains that vary, and an arc, against another integration: spectral convergence at the nodes, the end twice as
/// fast, and a defect that does not hide the errors of the nodes.
#[test]
fn the_curve_converges_spectrally() {
    let fields: [fn(f64) -> Vector6<f64>; 2] = [
        |s| field(s, 4.0),
        |_| Vector6::new(8.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    ];
    for e in fields {
        let (frame, r) = fine(e, 1.0, 200);
        let mut last = f64::INFINITY;
        for nodes in [8, 12, 16, 20, 24] {
            let grid = Grid::uniform(nodes);
            let shape = curve(&grid, &at_nodes::<6>(&grid, e));
            let end = distance(&rotation(shape.end()), &frame)
                .max(distance(&shape.end().translation.vector, &r));
            let mut inside = 0.0_f64;
            for (i, s) in grid.nodes().iter().enumerate().step_by(3) {
                let (frame, r) = fine(e, *s, 200);
                inside = inside
                    .max(distance(&shape.directors()[i], &frame))
                    .max(distance(&shape.positions()[i], &r));
            }
            let defect = Kinematics::<6, 6>::defect(&Space::new(), &grid, &shape);
            // Rounding of the reference integration.
            let known = inside.max(1e-13);
            assert!(
                inside <= 5.0 * defect.max(2e-14),
                "{nodes}: {inside:e}, {defect:e}"
            );
            assert!(defect <= 100.0 * known, "{nodes}: {inside:e}, {defect:e}");
            assert!(end <= (0.01 * inside).max(1e-13), "{nodes}: end {end:e}");
            assert!(inside <= last, "{nodes}: {inside:e} after {last:e}");
            last = (0.1 * inside).max(1e-13);
        }
    }
}

/// Bends that follow each other tightly: with far too few nodes the frames are orthonormal all the same and the defect
/// says so; with enough of them the curve is right.
#[test]
fn many_turns_take_many_nodes() {
    let e = |s: f64| {
        let x = 2.0 * s - 1.0;
        Vector6::new(
            50.0 * x,
            30.0 - 40.0 * x * x,
            45.0 + 20.0 * x,
            0.1 * x,
            -0.1,
            1.0,
        )
    };
    let (frame, r) = fine(e, 1.0, 1600);
    for (nodes, least, most, tolerance) in [
        (4, 0.5, 1.0, 4.0),
        (10, 0.5, 1.0, 4.0),
        (20, 5e-3, 0.1, 1e-2),
        (40, 1e-7, 1e-5, 1e-11),
        (64, 0.0, 1e-12, 1e-12),
    ] {
        let grid = Grid::uniform(nodes);
        let shape = curve(&grid, &at_nodes::<6>(&grid, e));
        let defect = Kinematics::<6, 6>::defect(&Space::new(), &grid, &shape);
        let end = distance(&rotation(shape.end()), &frame)
            .max(distance(&shape.end().translation.vector, &r));
        assert!(end <= tolerance, "{nodes} nodes: end {end:e}");
        assert!(
            least <= defect && defect <= most,
            "{nodes} nodes: {defect:e}"
        );
        for directors in shape.directors() {
            let off = distance(&(directors.transpose() * directors), &Matrix3::identity());
            assert!(off <= 1e-15, "{nodes} nodes: {off:e}");
            assert!(directors.determinant() > 0.0);
        }
    }
}

/// A strain field on one element and on three gives the same curve.
#[test]
fn elements_agree_with_one() {
    let (one, three) = (Grid::uniform(28), Grid::new(&[0.15, 0.6], &[16, 20, 18]));
    let space = Space::<6, 6>::new();
    let (a, b) = [&one, &three]
        .map(|grid| {
            let strains = at_nodes::<6>(grid, |s| field(s, 3.0));
            let shape = curve(grid, &strains);
            let ends = distance(&rotation(shape.end()), &Matrix3::zeros());
            assert!(ends > 0.1);
            let sections: Vec<f64> = [0.0, 0.1, 0.15, 0.4, 0.6, 0.99, 1.0]
                .iter()
                .flat_map(|s| {
                    let at = space.section_at(grid, &shape, &strains, *s);
                    let mut entries = at.translation.vector.as_slice().to_vec();
                    entries.extend(rotation(&at).iter());
                    entries
                })
                .collect();
            // Integrated over all nodes: the effect of a smooth change on the loads, and on the motion of the end.
            let n = grid.len();
            let w = Vector6::new(0.4, -0.7, 0.3, 1.1, 0.9, -0.8);
            let mut stiffness = DMatrix::zeros(6 * n, 6 * n);
            space.load_stiffness(grid, &shape, &w, &mut stiffness);
            let change = stacked(&at_nodes::<6>(grid, |s| rates(s, 1)));
            let loads: Vec<Local<6>> = (stiffness * &change)
                .as_slice()
                .chunks_exact(6)
                .map(Local::from_column_slice)
                .collect();
            let mut convection = DMatrix::zeros(6, 6 * n);
            let moving = at_nodes::<6>(grid, |s| rates(s, 0));
            space.convection(grid, &shape, &moving, &mut convection);
            let mut entries = sections;
            entries.extend((convection * change).iter());
            for s in [0.05, 0.5, 0.95] {
                entries.extend(grid.at(&loads, s).iter());
            }
            entries
        })
        .into();
    assert_same(&a, &b, 2e-12, "one element or three");
}

fn stacked<const M: usize>(f: &[Local<M>]) -> DVector<f64> {
    DVector::from_iterator(M * f.len(), f.iter().flat_map(|e| e.iter().copied()))
}

/// Every derivative of a rod with M strains and D velocities against differences of the discrete maps themselves.
fn differentiates<const M: usize, const D: usize>(grid: &Grid) {
    let space = Space::<M, D>::new();
    let name = |what: &str| format!("{what}, M = {M}, D = {D}, {:?}", grid.counts());
    let e = |s: f64| whole::<M>(&field(s, 2.0));
    let base = at_nodes::<M>(grid, e);
    let moving = at_nodes::<M>(grid, |s| rates(s, 0));
    let change = at_nodes::<M>(grid, |s| rates(s, 1));
    let along = |direction: &[Local<M>], t: f64| {
        let strains: Vec<Local<M>> = base.iter().zip(direction).map(|(e, d)| e + d * t).collect();
        space.shape(grid, &strains).expect("a shape")
    };
    let shape = along(&moving, 0.0);
    let n = grid.len();
    let velocity = |shape: &FramedCurve| {
        let parts: Vec<SVector<f64, D>> = (0..n)
            .map(|i| space.transfer(shape, i).transpose() * moving[i])
            .collect();
        grid.total(&parts)
    };

    // V: the end moves as the world sees it.
    let v = velocity(&shape);
    let motion = slope(|t| {
        let end = space.pose(&along(&moving, t));
        let mut entries = DVector::zeros(12);
        entries
            .rows_mut(0, 9)
            .copy_from_slice(rotation(&end).as_slice());
        entries.rows_mut(9, 3).copy_from(&end.translation.vector);
        entries
    });
    let spin = Matrix3::from_column_slice(&motion.as_slice()[..9])
        * rotation(&space.pose(&shape)).transpose();
    let turning = Vector3::new(spin.m32, spin.m13, spin.m21);
    let moved = Vector3::from_column_slice(&motion.as_slice()[9..]);
    assert_same(
        v.fixed_rows::<3>(D - 3).iter(),
        &moved,
        2e-12,
        &name("r_t(1)"),
    );
    if D == 6 {
        assert_same(
            v.fixed_rows::<3>(0).iter(),
            &turning,
            2e-12,
            &name("omega(1)"),
        );
    }

    // Q w: components of the balances of moments and forces.
    let w = SVector::<f64, D>::from_fn(|k, _| [1.1, 0.9, -0.8, 0.4, -0.7, 0.3][5 - k]);
    let force = Vector3::from_column_slice(&w.as_slice()[D - 3..]);
    let couple = if D == 6 {
        Vector3::from_column_slice(&w.as_slice()[..3])
    } else {
        Vector3::zeros()
    };
    for i in [0, n / 2, n - 1] {
        let arm = space.pose(&shape).translation.vector - shape.positions()[i];
        let m = shape.directors()[i].tr_mul(&(couple + arm.cross(&force)));
        let n = shape.directors()[i].tr_mul(&force);
        let all = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
        let got = space.transfer(&shape, i) * w;
        assert_same(&got, &part::<M>(&all), 1e-14, &name("Q w"));
    }

    let mut stiffness = DMatrix::from_element(n * M, n * M, 0.25);
    space.load_stiffness(grid, &shape, &w, &mut stiffness);
    stiffness.add_scalar_mut(-0.25);
    let differences = slope(|t| {
        let shape = along(&change, t);
        let loads: Vec<Local<M>> = (0..n).map(|i| space.transfer(&shape, i) * w).collect();
        stacked(&loads)
    });
    let got = &stiffness * stacked(&change);
    assert_same(&got, &differences, 1e-11, &name("d(Q w)"));

    let mut convection = DMatrix::from_element(D, n * M, f64::NAN);
    space.convection(grid, &shape, &moving, &mut convection);
    let differences =
        slope(|t| DVector::from_column_slice(velocity(&along(&change, t)).as_slice()));
    let got = &convection * stacked(&change);
    assert_same(&got, &differences, 1e-11, &name("dV"));

    // Both are derivatives of sum weight_i rate_i . Q_i w = w . V: node by node, to rounding.
    let weighted: Vec<Local<M>> = moving
        .iter()
        .zip(grid.weights())
        .map(|(rate, weight)| rate * *weight)
        .collect();
    assert_same(
        &stiffness.tr_mul(&stacked(&weighted)),
        &convection.tr_mul(&w),
        1e-13,
        &name("power"),
    );

    // A dead force has a potential, and a dead couple has none.
    let weights: Vec<Local<M>> = grid.weights().iter().map(|w| Local::repeat(*w)).collect();
    let hessian = DMatrix::from_diagonal(&stacked(&weights)) * stiffness;
    let off = (&hessian - hessian.transpose()).amax() / hessian.amax();
    assert!(if D == 3 { off <= 1e-14 } else { off > 1e-2 }, "{off:e}");
}

/// Catches wrong signs, sides and senses in V, Q and their derivatives for every choice of strains and end, also across
/// elements.
#[test]
fn derivatives_agree_with_differences() {
    for grid in [Grid::uniform(22), Grid::new(&[0.3, 0.55], &[16, 14, 18])] {
        differentiates::<3, 3>(&grid);
        differentiates::<3, 6>(&grid);
        differentiates::<4, 3>(&grid);
        differentiates::<4, 6>(&grid);
        differentiates::<6, 3>(&grid);
        differentiates::<6, 6>(&grid);
    }
}

/// A change of the strains at one node alone is a polynomial of full degree. The end moves exactly as weight_j Q_j^T;
/// the loads follow up to the unresolved part of such a change, 0.4/n^2.
#[test]
fn changes_at_one_node() {
    let space = Space::<6, 6>::new();
    for nodes in [16, 24] {
        let grid = Grid::uniform(nodes);
        let base = at_nodes::<6>(&grid, |s| field(s, 2.0));
        let shape = curve(&grid, &base);
        let w = Vector6::new(0.4, -0.7, 0.3, 1.1, 0.9, -0.8);
        let mut stiffness = DMatrix::zeros(6 * nodes, 6 * nodes);
        space.load_stiffness(&grid, &shape, &w, &mut stiffness);
        for j in [0, nodes / 3, nodes - 1] {
            for k in 0..6 {
                let changed = slope(|t| {
                    let mut strains = base.clone();
                    strains[j][k] += t;
                    let shape = curve(&grid, &strains);
                    let loads: Vec<Local<6>> =
                        (0..nodes).map(|i| space.transfer(&shape, i) * w).collect();
                    let mut entries = stacked(&loads).insert_rows(0, 3, 0.0);
                    entries
                        .rows_mut(0, 3)
                        .copy_from(&shape.end().translation.vector);
                    entries
                });
                let off = distance(
                    changed.rows(3, 6 * nodes).iter(),
                    stiffness.column(6 * j + k).iter(),
                );
                assert!(
                    off <= 1.0 / (nodes * nodes) as f64,
                    "{nodes} nodes, {j}, {k}: {off:e}"
                );
                let q = space.transfer(&shape, j).transpose() * grid.weights()[j];
                let off = distance(changed.rows(0, 3).iter(), q.fixed_view::<3, 1>(3, k).iter());
                assert!(off <= 1e-10, "{nodes} nodes, {j}, {k}: end {off:e}");
            }
        }
    }
}

/// A rod bent and sheared in a plane stays there exactly, and its angle is the integral of its curvature.
#[test]
fn planar_strains_stay_planar() {
    let grid = Grid::new(&[0.4], &[14, 16]);
    let e = |s: f64| Vector6::new(0.0, 3.0 - 8.0 * s * s, 0.0, 0.1 * s, 0.0, 1.0);
    let shape = curve(&grid, &at_nodes::<6>(&grid, e));
    for (i, s) in grid.nodes().iter().enumerate() {
        let angle = 3.0 * s - 8.0 / 3.0 * s.powi(3);
        let d3 = Vector3::new(angle.sin(), 0.0, angle.cos());
        let off = (shape.directors()[i].column(2) - d3).norm();
        assert!(off <= 1e-12, "d3 at {s}: {off:e}");
        assert_eq!(shape.positions()[i].y, 0.0);
        assert_eq!(shape.directors()[i][(1, 1)], 1.0);
    }
    assert_eq!(shape.end().translation.vector.y, 0.0);
}

/// NaN strains give no shape, nor do strains with a NaN curve.
#[test]
fn no_curve_without_numbers() {
    let grid = Grid::uniform(12);
    let space = Space::<4, 3>::new();
    let good = at_nodes::<4>(&grid, |s| field(s, 1.0));
    assert!(space.shape(&grid, &good).is_some());
    assert!(space.shape(&grid, &good[1..]).is_none());
    for (i, k, bad) in [
        (0, 0, f64::NAN),
        (5, 3, f64::INFINITY),
        (11, 1, f64::NEG_INFINITY),
        (4, 2, 1e300),
        (4, 3, f64::MAX),
    ] {
        let mut strains = good.clone();
        strains[i][k] = bad;
        let shape = space.shape(&grid, &strains);
        let finite = shape.is_none_or(|c| {
            bad.is_finite()
                && c.end().translation.vector.norm().is_finite()
                && c.positions().iter().all(|r| r.norm().is_finite())
                && c.directors()
                    .iter()
                    .all(|d| (d.norm() - 3.0_f64.sqrt()).abs() < 1e-14)
        });
        assert!(finite, "strain {k} at node {i}: {bad}");
    }
}
