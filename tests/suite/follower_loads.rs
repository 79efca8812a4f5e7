//! Loads that turn with a rod, beside dead ones, and rest strains that are driven: rods at rest, against integration
//! from the free end and closed forms.

use crate::support::assert_close;
use nalgebra::{Vector3, Vector6};
use snaprod::scene::Scene;
use snaprod::study::{BranchRecord, EquilibriumRecord, Silent, branch, equilibrium};

fn scene(text: &str) -> Scene {
    Scene::parse(text).unwrap_or_else(|faults| panic!("{faults}\n{text}"))
}

fn solved(text: &str) -> EquilibriumRecord {
    equilibrium(&scene(text)).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

fn followed(text: &str) -> BranchRecord {
    branch(&scene(text), &mut Silent).unwrap_or_else(|why| panic!("{why}\n{text}"))
}

const ROD: &str = "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.0], torsion = 1.0 }\n";

/// (theta, x, z, curvature) at the base of a cantilever under loads along its directors alone, of length and stiffness
/// 1: from the free end, where all is known, by RK4. The end is at the origin along z; p = p0 + p1 s along d1, t along
/// d3, and the force (q1, q3) on the end.
fn from_the_free_end([p0, p1, t]: [f64; 3], [q1, q3]: [f64; 2]) -> [f64; 4] {
    // y = (theta, x, z, curvature, n1, n3).
    let slope = |s: f64, y: &Vector6<f64>| {
        let (sin, cos) = y[0].sin_cos();
        let (k, n1, n3) = (y[3], y[4], y[5]);
        Vector6::new(k, sin, cos, -n1, -k * n3 - (p0 + p1 * s), k * n1 - t)
    };
    const STEPS: usize = 1000;
    let h = -1.0 / STEPS as f64;
    let mut y = Vector6::new(0.0, 0.0, 0.0, 0.0, q1, q3);
    for step in 0..STEPS {
        let s = 1.0 + h * step as f64;
        let a = slope(s, &y);
        let b = slope(s + 0.5 * h, &(y + a * (0.5 * h)));
        let c = slope(s + 0.5 * h, &(y + b * (0.5 * h)));
        let d = slope(s + h, &(y + c * h));
        y += (a + (b + c) * 2.0 + d) * (h / 6.0);
    }
    [y[0], y[1], y[2], y[3]]
}

/// Catches a load that does not turn with the rod, one that is missing from the tangent, and an index where there is
/// none.
#[test]
fn pressure_and_thrust_turn_with_the_rod() {
    for (along, end) in [
        ([20.0, 0.0, 0.0], [0.0, 0.0]),
        ([8.0, 2.0, -3.0], [1.0, -2.0]),
    ] {
        let [p0, p1, t] = along;
        let found = solved(&format!(
            "{ROD}[loads]\nfollower = {{ polynomial = [[{p0}, 0.0, {t}], [{p1}, 0.0, 0.0]] }}\n\
             [end]\nfollower_force = [{}, 0.0, {}]\n",
            end[0], end[1]
        ));
        let [theta, x, z, curvature] = from_the_free_end(along, end);
        // The base turned back to the origin along z.
        let (sin, cos) = theta.sin_cos();
        let place = Vector3::new(-(x * cos - z * sin), 0.0, -(x * sin + z * cos));
        let off = (found.found.end.position - place).norm();
        assert!(off < 1e-9, "{along:?}: off by {off:e}");
        assert_close(found.found.base[1], curvature, 1e-9, 1.0, "base couple");
        let d3 = found.found.end.directors.column(2);
        assert!((d3 - Vector3::new(-theta.sin(), 0.0, theta.cos())).norm() < 1e-9);
        assert!(!found.indexed && found.summary()["index"].is_null());
    }
}

/// Catches a dead load that turns with the end, or a follower load that keeps its direction in the world.
#[test]
fn dead_and_following_loads_meet_at_one_end() {
    let (force, couple) = (Vector3::new(0.5, -2.0, -0.6), Vector3::new(0.5, 1.0, 0.8));
    let found = solved(
        "[rod]\nmodel = \"cosserat\"\nlength = 1.0\nsection = { bending = [1.0, 1.3], torsion = 0.8 }\n\
         [end]\nforce = [0.5, -2.0, -0.6]\nfollower_couple = [0.5, 1.0, 0.8]\n",
    );
    let end = &found.found.end;
    let (m, n) = snaprod::math::se3::halves(&found.found.base);
    assert!((end.couple - end.directors * couple).norm() < 1e-9);
    assert!((end.force - force).norm() + (n - force).norm() < 1e-9);
    assert!((m - end.couple - end.position.cross(&force)).norm() < 1e-9);
    // Collocation of another code.
    let place = Vector3::new(0.33442622281501, -0.48348175679339, 0.74503253508368);
    assert!((end.position - place).norm() < 1e-9);
}

/// Catches a branch point of a load without potential that is missed or false: a circular arch between clamps under
/// pressure buckles at k^2 - 1, k tan(a) cot(k a) = 1 (known).
#[test]
fn a_clamped_arch_buckles_under_pressure() {
    let a = std::f64::consts::FRAC_PI_3;
    let length = 2.0 * a;
    let (sin, cos) = length.sin_cos();
    let found = followed(&format!(
        "[rod]\nmodel = \"cosserat\"\nlength = {length}\nrest = {{ curvature = [0.0, 1.0] }}\n\
         section = {{ bending = [1e3, 1.0], torsion = 1e3 }}\n\
         [loads]\nfollower = [1.0, 0.0, 0.0]\nload = 0.0\n\
         [end]\nposition = [{}, 0.0, {sin}]\nrotation = {{ axis = [0.0, 1.0, 0.0], angle = {length} }}\n\
         [continue]\nparameter = \"loads.load\"\nto = 22.0\n",
        1.0 - cos
    ));
    let residual = |k: f64| k * a.tan() / (k * a).tan() - 1.0;
    let (mut low, mut high) = (4.3_f64, 4.45_f64);
    assert!(residual(low) > 0.0 && residual(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if residual(middle) > 0.0 {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    let specials = &found.branches.specials;
    assert_eq!(specials.len(), 1, "{specials:?}");
    let critical = found.branches.points.reals("parameter");
    let at = critical.iter().map(|p| (p - (low * low - 1.0)).abs());
    assert!(at.fold(f64::INFINITY, f64::min) < 1e-8, "critical pressure");
}

/// Catches a drive that is not a rest strain: a cantilever takes it without energy, and between a clamp and a ball
/// joint a uniform drive is a couple at the joint.
#[test]
fn driven_rest_strains_bend_rods() {
    let drive =
        "drive = { curvature = [0.0, { polynomial = [0.0, 0.0, 1.0] }], amplitude = 3.0 }\n";
    let found = solved(&format!("{ROD}{drive}[end]\n"));
    // theta = s^3: Simpson's rule for the end.
    const PARTS: usize = 2000;
    let weight = |i: usize| {
        if i == 0 || i == PARTS {
            1.0
        } else {
            2.0 + 2.0 * (i % 2) as f64
        }
    };
    let sum = |f: fn(f64) -> f64| {
        let at = |i: usize| weight(i) * f((i as f64 / PARTS as f64).powi(3));
        (0..=PARTS).map(at).sum::<f64>() / (3 * PARTS) as f64
    };
    let place = Vector3::new(sum(f64::sin), 0.0, sum(f64::cos));
    assert!((found.found.end.position - place).norm() < 1e-9);
    assert!(found.found.end.energy.abs() < 1e-20);

    let held = "position = [0.2, 0.0, 0.85]\n";
    let driven = "drive = { curvature = [0.0, 1.0], amplitude = 0.7 }\n";
    let driven = solved(&format!("{ROD}{driven}[end]\n{held}"));
    let pushed = solved(&format!("{ROD}[end]\n{held}couple = [0.0, 0.7, 0.0]\n"));
    let middle = |found: &EquilibriumRecord| found.sections[100].position;
    assert!((middle(&driven) - middle(&pushed)).norm() < 1e-8);
}
