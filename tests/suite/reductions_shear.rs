//! Exact reductions in shear: the condition AMV (6.19).

use crate::reductions::{
    Dashpots, STIFFNESS, VISCOSITY, diagonal, moving, plain, recognise, run, section, still,
    welded, whole,
};
use crate::support::assert_close;
use nalgebra::Vector3;
use snaprod::body::{History, Mass, TimeLoad};
use snaprod::motion::reduction::ReductionKind;
use snaprod::section::Strain;
use std::sync::Arc;

/// Catches a refused shear beam: with rigid flexure and twist, shear and stretch are independent oscillators, even
/// under an oblique load on a body with its centre beside the end.
#[test]
fn with_rigid_flexure_any_shear_is_exact() {
    let mut section = plain();
    section.rate = Arc::new(Dashpots {
        viscosity: diagonal(VISCOSITY),
        rigid: [true, true, true, false, false, false],
        taper: 0.0,
    });
    let (mass, load) = (0.7, [0.2, -0.1, 0.3]);
    let body = welded(mass)
        .with_centre(Vector3::new(0.2, 0.1, 0.5))
        .and_then(|b| b.with_dead_force(Vector3::new(load[0], load[1], load[2])))
        .expect("a body");
    let (x0, v0) = ([0.1, -0.2, 0.05], [0.3, 0.2, -0.1]);
    let strain = Strain::new(0.0, 0.0, 0.0, x0[0], x0[1], 1.0 + x0[2]);
    let start = moving(still(), Vector3::new(v0[0], v0[1], v0[2]));
    let carried = Mass::Rigid(body);
    let reduction = recognise(&section, &carried, strain, start).expect("it is");
    assert_eq!(reduction.kind(), ReductionKind::Shearing);
    assert!(reduction.is_identical());
    let equivalent = reduction.equivalent().expect("a law");
    for (i, mode) in equivalent.modes.iter().enumerate() {
        let want = (STIFFNESS[3 + i] / mass).sqrt();
        assert_close(mode.natural_frequency, want, 1e-13, 0.0, "frequency");
    }
}

/// Catches an unchecked condition (6.19). Shear is exact if it decays at a root of its oscillator and the load keeps
/// the stretch that directs the force through the clamp; at another rate it is not.
#[test]
fn shear_that_dies_out_may_be_exact() {
    let mut viscosity = diagonal(VISCOSITY);
    viscosity[(3, 3)] = 3.0;
    let section = section(diagonal(STIFFNESS), viscosity);
    let (mass, a, h, b): (f64, f64, f64, f64) = (0.7, STIFFNESS[3], 3.0, STIFFNESS[5]);
    let sigma = (h - (h * h - 4.0 * mass * a).sqrt()) / (2.0 * mass);
    // n = lambda v.
    let lambda = a - h * sigma;
    let stretch = b / (b - lambda);
    let body = welded(mass)
        .with_dead_force(Vector3::new(0.0, 0.0, lambda * stretch))
        .expect("a body");
    let carried = Mass::Rigid(body);
    let strain = Strain::new(0.0, 0.0, 0.0, 0.3, 0.0, stretch);
    let start = |speed: f64| moving(still(), Vector3::new(-0.3 * speed, 0.0, 0.0));
    let reduction = recognise(&section, &carried, strain, start(sigma)).expect("it is");
    assert_eq!(reduction.kind(), ReductionKind::Shearing);
    assert!(!reduction.is_identical());
    for sample in run(&section, &carried, strain, start(sigma), &[0.5, 1.5]) {
        let want = 0.3 * (-sigma * sample.time).exp();
        assert_close(sample.strain[3], want, 1e-10, 1.0, "shear");
        assert_close(sample.strain[5], stretch, 1e-10, 1.0, "stretch");
    }
    let why = recognise(&section, &carried, strain, start(1.1 * sigma)).expect_err("not exact");
    assert!(
        why.contains("not shearing: the force does not go through the clamp"),
        "{why}"
    );
}

/// For the path v3 = a + b sin t with v1 by (6.19): shear v1 and stretch v3, their first and second derivatives, and
/// lambda in n = lambda v.
fn path(t: f64) -> ([f64; 3], [f64; 3], f64) {
    let (shear, eta, axial, zeta) = (STIFFNESS[3], VISCOSITY[3], STIFFNESS[5], VISCOSITY[5]);
    let (a, b): (f64, f64) = (1.2, 0.1);
    let y = [a + b * t.sin(), b * t.cos(), -b * t.sin()];
    let root = (a * a - b * b).sqrt();
    let angle = |t: f64| ((a * (0.5 * t).tan() + b) / root).atan();
    let inverse = 2.0 / root * (angle(t) - angle(0.0));
    let lambda = (axial * (y[0] - 1.0) + zeta * y[1]) / y[0];
    let lambda_t = (axial * y[1] / y[0] + zeta * (y[2] * y[0] - y[1] * y[1]) / y[0]) / y[0];
    let integral = (axial - shear) * t - axial * inverse + zeta * (y[0] / a).ln();
    let x = 0.2 * (integral / eta).exp();
    let growth = (lambda - shear) / eta;
    let x = [x, x * growth, x * (growth * growth + lambda_t / eta)];
    (x, y, lambda)
}

/// Catches (6.19) checked only for constant forces. A motion in shear and stretch under a load constructed for it is
/// exact; under another load the start is refused at once, or later, when the rod bends.
#[test]
fn a_load_can_be_made_for_shear() {
    let section = plain();
    let mass = 0.7;
    let driven = |factor: fn(f64) -> f64| {
        let force = move |q: [f64; 3], lambda: f64| [mass * q[2] + lambda * q[0], 0.0, 0.0];
        let across = move |t| {
            let (x, _, lambda) = path(t);
            force(x, lambda).map(|f| f * factor(t))
        };
        let along = move |t| {
            let (_, y, lambda) = path(t);
            force(y, lambda)
        };
        let load = |direction, history: History| TimeLoad::new(direction, history).unwrap();
        let across = History::custom(across, Vec::new());
        let along = History::custom(along, Vec::new());
        Mass::Rigid(
            welded(mass)
                .with_force(load(Vector3::new(1.0, 0.0, 0.0), across))
                .with_force(load(Vector3::new(0.0, 0.0, 1.0), along)),
        )
    };
    let (x, y, _) = path(0.0);
    let strain = Strain::new(0.0, 0.0, 0.0, x[0], 0.0, y[0]);
    let start = moving(still(), Vector3::new(x[1], 0.0, y[1]));
    let reduction = recognise(&section, &driven(|_| 1.0), strain, start).expect("it is");
    assert_eq!(
        (reduction.kind(), reduction.is_identical()),
        (ReductionKind::Shearing, false)
    );
    for sample in run(&section, &driven(|_| 1.0), strain, start, &[0.5, 1.0, 2.0]) {
        let (x, y, _) = path(sample.time);
        assert_close(sample.strain[3], x[0], 1e-10, 1.0, "shear");
        assert_close(sample.strain[5], y[0], 1e-10, 1.0, "stretch");
    }
    let why = recognise(&section, &driven(|_| 1.1), strain, start).expect_err("not exact");
    assert!(why.contains("is lost at the rate"), "{why}");
    let later = recognise(&section, &driven(|t| 1.0 + t * t), strain, start).expect("at first");
    assert!(!later.is_identical());
    let Mass::Rigid(body) = driven(|t| 1.0 + t * t) else {
        unreachable!()
    };
    let left = whole::<_, 6, 6>(&section, &body, (strain, strain), start, &[2.0], 1e-10);
    assert!(left[0].spread > 1e-3, "{}", left[0].spread);
}
