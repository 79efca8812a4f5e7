//! Rods in space: the curve of a strain field, Q, and their derivatives.

use crate::support::assert_close;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix4, SVector, UnitQuaternion, Vector3, Vector6,
};
use snaprod::viscous::grid::Grid;
use snaprod::viscous::kinematics::{Kinematics, Local};
use snaprod::viscous::space::{Curve, Space};

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

/// The first three strains, and of the others those that M has.
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

fn curve<const M: usize>(grid: &Grid, strains: &[Local<M>]) -> Curve {
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
fn fine(e: impl Fn(f64) -> Vector6<f64>, s: f64) -> (Matrix3<f64>, Vector3<f64>) {
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
            g * ((a + b) * (0.5 * h) + (a * b - b * a) * (0.5 * off * h * h)).exp()
        })
    };
    let g = (with(400) * 16.0 - with(200)) / 15.0;
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
    a.into_iter().zip(b).fold(0.0, |most: f64, (a, b)| {
        let off = (a - b).abs();
        if off <= most || off > most {
            most.max(off)
        } else {
            f64::INFINITY
        }
    })
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

/// Strains that vary, against another integration: spectral convergence at the nodes, the end twice as fast, and a
/// defect that does not hide the errors of the nodes.
#[test]
fn the_curve_converges_spectrally() {
    let e = |s| field(s, 4.0);
    let (frame, r) = fine(e, 1.0);
    let mut last = f64::INFINITY;
    for nodes in [8, 12, 16, 20, 24] {
        let grid = Grid::uniform(nodes);
        let shape = curve(&grid, &at_nodes::<6>(&grid, e));
        let end = distance(&rotation(shape.end()), &frame)
            .max(distance(&shape.end().translation.vector, &r));
        let mut inside = 0.0_f64;
        for (i, s) in grid.nodes().iter().enumerate().step_by(3) {
            let (frame, r) = fine(e, *s);
            inside = inside
                .max(distance(&shape.directors()[i], &frame))
                .max(distance(&shape.positions()[i], &r));
        }
        let defect = Kinematics::<6, 6>::defect(&Space::new(), &grid, &shape);
        println!("{nodes} nodes: end {end:.1e}, inside {inside:.1e}, defect {defect:.1e}");
    }
}
