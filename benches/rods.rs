//! Rods in space: `cargo bench --bench rods`.

use divan::{Bencher, black_box};
use nalgebra::{Vector3, Vector6};
use snaprod::Result;
use snaprod::rod::{
    Chart, EndConditions, FreeEnd, Path, Problem, ProblemChart, Rod, RodFamily, Spatial,
};
use snaprod::section::Linear;
use snaprod::solve::arclength::{Continuation, Options};

fn main() {
    divan::main();
}

fn sample() -> Rod {
    let law = Linear::diagonal([1.0, 1.5], 0.7)
        .and_then(|law| law.with_shear([100.0, 120.0]))
        .and_then(|law| law.with_axial(300.0))
        .unwrap();
    Rod::new(1.0, law).unwrap()
}

/// Equilibrium with its 6 x 6 tangent under a moderate wrench, by tolerance; aim: 10 us at an accuracy of 1e-10.
#[divan::bench(args = [1e-6, 1e-8, 1e-10, 1e-12], sample_count = 200)]
fn end_with_tangent(bencher: Bencher, tolerance: f64) {
    let rod = sample();
    let base = Vector6::new(1.66, 0.96, -0.48, 1.0, -2.0, 0.5);
    bencher.bench(|| rod.end(black_box(&base), tolerance).unwrap());
}

/// The Morse index at the same wrench.
#[divan::bench(sample_count = 200)]
fn index(bencher: Bencher) {
    let rod = sample();
    let base = Vector6::new(1.66, 0.96, -0.48, 1.0, -2.0, 0.5);
    let end = rod.end(&base, 1e-11).unwrap().section.position;
    let problem = Problem::new(rod, EndConditions::ball(end), 1e-11).unwrap();
    bencher.bench(|| problem.index_at(black_box(&base)).unwrap());
}

/// The end load of the sample scene, from the unloaded rod.
#[divan::bench(sample_count = 100)]
fn equilibrium_from_the_unloaded_rod(bencher: Bencher) {
    let end = EndConditions::load(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.3, 0.2, -0.8));
    let problem = Problem::new(sample(), end, 1e-11).unwrap();
    bencher.bench(|| problem.solve(None).unwrap());
}

/// The rod of the planar comparison with its end held at (0.6, y), in space.
fn held_at(y: f64) -> Result<Problem> {
    let rod = Rod::new(1.0, Linear::diagonal([2.0, 1.0], 0.8)?)?;
    Problem::new(rod, EndConditions::ball(Vector3::new(y, 0.0, 0.6)), 1e-11)
}

/// 200 points of the branch, with index and special points; aim: 100 ms, and AUTO's 55-156 us a point (planar, no
/// index).
fn branch<C: Chart + Copy + Sync>(bencher: Bencher, chart: C) {
    let start = held_at(0.3).and_then(|p| p.solve(None)).unwrap();
    let options = Options {
        initial_step: 0.3,
        max_step: 0.3,
        weight: 10.0,
        max_points: 200,
        ..Options::between(0.75, -0.75)
    };
    let family = RodFamily::in_chart(held_at, false, 1.5, chart);
    let x = family.unknowns(&start.base, 0.3).unwrap();
    bencher.bench(|| {
        let trace = Continuation::new(&family, x.clone(), 0.3, options.clone())
            .unwrap()
            .trace();
        assert!(trace.points.len() > 100, "{}", trace.stop);
        trace.evaluations
    });
}

/// Chart by the base wrench: six unknowns, any end.
#[divan::bench(sample_count = 10)]
fn branch_by_base_wrench(bencher: Bencher) {
    branch(bencher, Spatial);
}

/// Chart by the force on an end without couple: three unknowns, in space. The command takes this chart if branches are
/// switched.
#[divan::bench(sample_count = 10)]
fn branch_by_end_force(bencher: Bencher) {
    branch(bencher, FreeEnd);
}

/// Planar chart: three unknowns; the index is that in space.
#[divan::bench(sample_count = 10)]
fn branch_in_plane(bencher: Bencher) {
    let path = held_at(0.3).unwrap().with_path(Path::Planar);
    match path.choose_chart(None).unwrap().0 {
        ProblemChart::Planar(plane) => branch(bencher, plane),
        other => panic!("{other:?}"),
    }
}

/// Closed-form chart: two unknowns; the index is that in space.
#[divan::bench(sample_count = 10)]
fn branch_in_closed_form(bencher: Bencher) {
    match held_at(0.3).unwrap().choose_chart(None).unwrap().0 {
        ProblemChart::ClosedForm(chart) => branch(bencher, chart),
        other => panic!("{other:?}"),
    }
}
