//! Rods with all of their mass that touch each other and themselves: against differences, conservation laws, closed
//! forms.

use crate::heavy_assemblies::{given, link, weld};
use nalgebra::{DVector, Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use snaprod::assembly::{Attachment, Body, BodyMotion};
use snaprod::body::RigidBody;
use snaprod::full_mass::assembly::HeavyAssembly;
use snaprod::full_mass::elements::{BarrierStrength, ElementAssembly, Mesh};
use snaprod::full_mass::obstacles::{ObstaclesOfRods, RoundSurface};
use snaprod::solve::system::{Linearised, System};
use std::f64::consts::TAU;

/// Radius, pitch and turns of a coil, and the thickness at which its turns touch.
const COIL: [f64; 4] = [0.15, 0.105, 2.2, 0.1];

/// The section of the coil at s in [0, 1].
fn coil(s: f64) -> BodyMotion {
    let [radius, pitch, turns, _] = COIL;
    let phi = TAU * turns * s;
    let place = Vector3::new(radius * phi.cos(), radius * phi.sin(), pitch * turns * s);
    let along = Vector3::new(-radius * phi.sin(), radius * phi.cos(), pitch / TAU).normalize();
    let out = Vector3::new(phi.cos(), phi.sin(), 0.0);
    let turn = Rotation3::from_basis_unchecked(&[out, along.cross(&out), along]);
    let half = UnitQuaternion::from_rotation_matrix(&turn);
    BodyMotion::at_rest(Isometry3::from_parts(Translation3::from(place), half))
}

/// A coil on a body, whose turns push each other with this friction, in a state that moves; with anchors of the state
/// before a displacement.
fn coiled(friction: f64, settling: f64) -> (ElementAssembly, DVector<f64>) {
    let [radius, pitch, turns, thick] = COIL;
    let length = turns * (TAU * radius).hypot(pitch);
    let rod = given(0.4, 0.0, length, Vector3::zeros(), &[0, 1, 2, 3, 4, 5]);
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.03, 0.02, 0.04));
    let body = RigidBody::new(1.0, inertia).unwrap();
    let on = Attachment::body(0, Isometry3::identity());
    let links = vec![link(rod, 6, weld(on), None)];
    let touching = ObstaclesOfRods {
        obstacles: Vec::new(),
        frame: Isometry3::identity(),
        rods: vec![RoundSurface {
            radius: 0.5 * thick,
            friction: Vec::new(),
        }],
        between: vec![vec![Some(friction)]],
        balls: Vec::new(),
        gap: 0.02,
        stick: 0.01,
    };
    let touching = touching.checked(1.0).unwrap();
    let assembly = HeavyAssembly::new(vec![Body::rigid(body)], links).unwrap();
    let mesh = Mesh {
        elements: vec![vec![6]],
        degree: 6,
    };
    let model = ElementAssembly::new(&assembly.among(touching), mesh).unwrap();
    let strength = BarrierStrength {
        push: 300.0,
        settling,
    };
    let model = model.with_barrier_strength(Some(strength));
    let nodes: Vec<BodyMotion> = model.places(0).iter().map(|s| coil(*s)).collect();
    let mut y = model.state(&[nodes[0]], &[nodes]);
    let (time, sites) = (model.time(), model.sites());
    // Quaternions of one sign along the rod.
    for i in 1..sites {
        let dot: f64 = (3..7).map(|k| y[7 * i + k] * y[7 * (i - 1) + k]).sum();
        if dot < 0.0 {
            (3..7).for_each(|k| y[7 * i + k] = -y[7 * i + k]);
        }
    }
    let moment = model.moment(&y).unwrap();
    let model = model.with_near_rods(&moment, 0.0).anchored(&moment);
    for i in 0..sites {
        for k in 0..3 {
            y[7 * i + k] += 1e-3 * (1.7 * (3 * i + k) as f64 + 0.4).sin();
        }
    }
    for i in 7 * sites..time {
        y[i] += 0.05 * (1.3 * i as f64 + 0.1).sin();
    }
    assert!(model.moment(&y).unwrap().barrier() > 0.0);
    (model, y)
}

fn slope(model: &ElementAssembly, y: &DVector<f64>) -> DVector<f64> {
    let mut out = DVector::zeros(y.len());
    System::slope(model, y, &mut out).unwrap();
    out
}

/// Energies of a smooth motion are kept, and the loss at closing and to friction is booked. Catches forces that are not
/// those of the energy, a nearest place that does not follow, a wrong lever of friction, and a wrong rate of a gap.
#[test]
fn forces_of_rods_on_each_other_are_those_of_their_energy() {
    for (friction, settling) in [(0.0, 0.0), (0.0, 1.5), (0.4, 1.5)] {
        let (model, y) = coiled(friction, settling);
        let rate = slope(&model, &y);
        let total = |y: &DVector<f64>| -> f64 {
            let moment = model.moment(y).unwrap();
            let books = y.as_slice()[model.time() + 1..].iter();
            let lost: f64 = books.enumerate().map(|(i, x)| if i == 1 { -x } else { *x }).sum();
            model.energies(&moment).iter().sum::<f64>() + lost
        };
        let h = 1e-5;
        let change = (total(&(&y + &rate * h)) - total(&(&y - &rate * h))) / (2.0 * h);
        let barrier = |h: f64| model.moment(&(&y + &rate * h)).unwrap().barrier();
        let size = ((barrier(h) - barrier(-h)) / (2.0 * h)).abs();
        assert!(size > 1e-3, "{size}");
        assert!(
            change.abs() < 1e-5 * size,
            "friction {friction}, settling {settling}: {change:e} of {size:e}"
        );
    }
}

/// Newton's matrix is that of differences. Friction leaves out what turns with the normal.
#[test]
fn the_matrix_of_rods_that_touch_is_that_of_differences() {
    for (friction, bound) in [(0.0, 1e-5), (0.4, 3e-2)] {
        let (model, y) = coiled(friction, 1.5);
        let (time, sites) = (model.time(), model.sites());
        let mut x = DVector::zeros(y.len());
        for i in 0..sites {
            for k in 0..3 {
                x[7 * i + k] = (0.9 * (3 * i + k) as f64 + 0.2).sin();
            }
        }
        for i in 7 * sites..time {
            x[i] = 0.1 * (0.7 * i as f64).sin();
        }
        let found = System::linearised(&model, &y).unwrap().times(&x);
        let step = 1e-7;
        let wanted = (slope(&model, &(&y + &x * step)) - slope(&model, &(&y - &x * step))) / (2.0 * step);
        let speeds = 7 * sites..time;
        // Forces of rods on each other alone: the matrix of the rod is that of differences of second derivatives.
        let size = wanted.rows(speeds.start, speeds.len()).amax();
        let off = (found - &wanted).rows(speeds.start, speeds.len()).amax();
        assert!(off < bound * size, "friction {friction}: {off:e} of {size:e}");
    }
}
