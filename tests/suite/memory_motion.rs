//! The memory kernel against full nonlinear motions of small size.

use crate::support::{assert_close, exponential, worst};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SVector, Vector1, Vector2, Vector6};
use snaprod::body::{EndBody, PointMass, RigidBody};
use snaprod::motion::viscoelastic::{ViscousRun, ViscousStart};
use snaprod::motion::{Event, Options};
use snaprod::section::Linear;
use snaprod::section::rate::{KelvinVoigt, Maxwell, Viscoelastic, Viscosity};
use snaprod::viscoelastic::kernel::{MemoryKernel, Mode};
use snaprod::viscoelastic::kinematics::{Kinematics, Local};
use snaprod::viscoelastic::material::Material;
use snaprod::viscoelastic::plane::Plane;
use snaprod::viscoelastic::space::Space;
use std::sync::Arc;

/// Times at which motions are compared, 0 first.
const SAMPLES: usize = 25;

/// The end wrench w1 at `SAMPLES` times of a run.
fn wrenches<K, B, const M: usize, const D: usize>(
    mut run: ViscousRun<'_, K, B, M, D>,
) -> Vec<DVector<f64>>
where
    K: Kinematics<M, D> + Clone,
    B: EndBody<D, Pose = K::Pose>,
{
    let flat = |w: &SVector<f64, D>| DVector::from_column_slice(w.as_slice());
    let last = run.duration();
    let mut found = vec![flat(&run.first().flow.wrench)];
    while let Some(event) = run.next() {
        if let Event::Step { to, .. } = event {
            while found.len() < SAMPLES {
                let t = last * found.len() as f64 / (SAMPLES - 1) as f64;
                let t = if to >= t * (1.0 - 1e-13) {
                    t.min(to)
                } else {
                    break;
                };
                found.push(flat(&run.sample(t).unwrap().flow.wrench));
            }
        }
    }
    assert_eq!(found.len(), SAMPLES);
    found
}

/// The end wrench of the linear motion with memory: mass V' = -w1, d' = V, h_k' = -rate_k h_k + f_k.V and w1 = A_end
/// V + R(inf) d + sum f_k h_k/rate_k. The solution is the exponential of the matrix. `parts` are the active components
/// of the end.
fn with_memory(
    kernel: &MemoryKernel,
    modes: &[Mode],
    parts: &[usize],
    mass: &[f64],
    d: &[f64],
    v: &[f64],
    duration: f64,
) -> Vec<DVector<f64>> {
    let n = parts.len();
    let block = |m: Matrix6<f64>| DMatrix::from_fn(n, n, |i, j| m[(parts[i], parts[j])]);
    let forces = DMatrix::from_fn(n, modes.len(), |i, k| modes[k].force[parts[i]]);
    // State (V, d, h).
    let size = 2 * n + modes.len();
    let mut wrench = DMatrix::zeros(n, size);
    wrench
        .columns_mut(0, n)
        .copy_from(&block(kernel.instantaneous()));
    wrench.columns_mut(n, n).copy_from(&block(kernel.relaxed()));
    let mut system = DMatrix::zeros(size, size);
    for k in 0..modes.len() {
        let column = forces.column(k) / modes[k].rate;
        wrench.column_mut(2 * n + k).copy_from(&column);
        system[(2 * n + k, 2 * n + k)] = -modes[k].rate;
    }
    system
        .view_mut((2 * n, 0), (modes.len(), n))
        .copy_from(&forces.transpose());
    for i in 0..n {
        system[(n + i, i)] = 1.0;
        system.row_mut(i).copy_from(&(wrench.row(i) / -mass[i]));
    }
    let mut state = DVector::zeros(size);
    state.rows_mut(0, n).copy_from_slice(v);
    state.rows_mut(n, n).copy_from_slice(d);
    let step = exponential(&(system * (duration / (SAMPLES - 1) as f64)));
    (0..SAMPLES)
        .map(|_| {
            let here = &wrench * &state;
            state = &step * &state;
            here
        })
        .collect()
}

/// Largest difference of two histories; NaN is infinite.
fn apart(a: &[DVector<f64>], b: &[DVector<f64>]) -> f64 {
    let pairs = a.iter().zip(b);
    worst(pairs.map(|(a, b)| worst((a - b).iter().map(|x| x.abs()))))
}

/// Largest entry of a history.
fn size(history: &[DVector<f64>]) -> f64 {
    history.iter().map(DVector::amax).fold(0.0, f64::max)
}

/// sum of factor x history.
fn sum(parts: &[(f64, &[DVector<f64>])]) -> Vec<DVector<f64>> {
    let at = |k: usize| {
        let zero = DVector::zeros(parts[0].1[k].len());
        parts.iter().fold(zero, |sum, (x, h)| sum + &h[k] * *x)
    };
    (0..SAMPLES).map(at).collect()
}

fn options(duration: f64) -> Options {
    Options::new(duration)
        .unwrap()
        .with_tolerance(1e-13)
        .unwrap()
}

/// Catches a kernel that differs from the nonlinear rod's, and a wrong factor or sign between the two. The planar
/// elastica with a Maxwell branch is released from a small deflection in which it has been held for long. The wrench
/// over the amplitude a tends to that of the kernel with a^2; without its a^2 term it agrees to 1e-9.
#[test]
fn a_small_planar_motion_remembers_by_the_kernel() {
    let (viscosity, branch, time, mass, duration) = (1.5, 2.0, 0.4, 0.8, 3.0);
    let friction = Viscosity::diagonal([viscosity; 2], viscosity).unwrap();
    let mut modulus = Matrix6::zeros();
    modulus[(0, 0)] = branch;
    let law = Viscoelastic::new(
        Arc::new(Linear::diagonal([1.0; 2], 1.0).unwrap()),
        Arc::new(KelvinVoigt::new(friction)),
    )
    .unwrap()
    .with_branch(Maxwell::new(modulus, time).unwrap())
    .unwrap();
    let y = [false, false, false, false, true, false];
    let kernel = MemoryKernel::carrying(&law, 1.0, y).unwrap();
    // Held at a = 1: the wrench is R(inf) a, and the branch is relaxed.
    let linear = |modes| with_memory(&kernel, modes, &[4], &[mass], &[1.0], &[0.0], duration);
    let want = linear(kernel.modes());
    let body = PointMass::new(mass).unwrap();
    let of = |a: f64| {
        let start = ViscousStart {
            strain: &|s| Vector1::new(3.0 * a * (1.0 - s)),
            relaxed: None,
            velocity: Vector2::zeros(),
        };
        let material = Material::new(law.clone(), [0]).unwrap();
        let run = ViscousRun::new(Plane, material, &body, &start, options(duration)).unwrap();
        let lateral = |w: DVector<f64>| DVector::from_element(1, w[1] / a);
        wrenches(run).into_iter().map(lateral).collect::<Vec<_>>()
    };
    let off = |history: &[DVector<f64>]| apart(history, &want) / size(&want);
    let (whole, half) = (of(1e-2), of(5e-3));
    assert_close(off(&whole) / off(&half), 4.0, 1e-3, 0.0, "order 2");
    assert!(off(&whole) <= 1e-4, "{:e}", off(&whole));
    let without_squares = off(&sum(&[(4.0 / 3.0, &half), (-1.0 / 3.0, &whole)]));
    assert!(without_squares <= 1e-9, "{without_squares:e}");
    // The memory contributes a part.
    assert!(off(&linear(&[])) > 0.02, "{:e}", off(&linear(&[])));
}

/// Small motions in space, where shear and flexure retard at different times: six components at once. The wrench over
/// the amplitude a is off by a (twist couples with bending), its part odd in a by a^2.
#[test]
fn a_small_motion_in_space_remembers_by_the_kernel() {
    let stiffness = [1.0, 1.4, 0.8, 8.0, 12.0, 15.0];
    let retardation = [0.3, 0.45, 0.2, 0.12, 0.06, 0.1];
    let viscosity: [f64; 6] = std::array::from_fn(|i| stiffness[i] * retardation[i]);
    let elastic = Linear::diagonal([stiffness[0], stiffness[1]], stiffness[2])
        .unwrap()
        .with_shear([stiffness[3], stiffness[4]])
        .unwrap()
        .with_axial(stiffness[5])
        .unwrap();
    let friction = Viscosity::full(Matrix6::from_diagonal(&viscosity.into())).unwrap();
    let law = Viscoelastic::new(Arc::new(elastic), Arc::new(KelvinVoigt::new(friction))).unwrap();
    let kernel = MemoryKernel::new(&law, 1.0).unwrap();
    assert_eq!(kernel.modes().len(), 2);
    let (mass, inertia, duration) = (0.7, [0.3, 0.5, 0.4], 3.0);
    let masses = [inertia[0], inertia[1], inertia[2], mass, mass, mass];
    let velocity = [0.7, -0.4, 0.5, 0.9, -1.0, 0.3];
    let parts = [0, 1, 2, 3, 4, 5];
    let linear = |modes| {
        with_memory(
            &kernel, modes, &parts, &masses, &[0.0; 6], &velocity, duration,
        )
    };
    let want = linear(kernel.modes());
    let body = RigidBody::new(mass, Matrix3::from_diagonal(&inertia.into())).unwrap();
    let rest: Local<6> = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let of = |a: f64| {
        let start = ViscousStart {
            strain: &|_| rest,
            relaxed: None,
            velocity: Vector6::from(velocity) * a,
        };
        let material = Material::new(law.clone(), [0, 1, 2, 3, 4, 5]).unwrap();
        let run = ViscousRun::new(
            Space::<6, 6>::new(),
            material,
            &body,
            &start,
            options(duration),
        )
        .unwrap();
        wrenches(run).into_iter().map(|w| w / a).collect::<Vec<_>>()
    };
    let off = |history: &[DVector<f64>]| apart(history, &want) / size(&want);
    let [whole, back, half, half_back] = [1e-2, -1e-2, 5e-3, -5e-3].map(of);
    assert_close(off(&whole) / off(&half), 2.0, 0.02, 0.0, "order 1");
    let odd = sum(&[(0.5, &whole), (0.5, &back)]);
    let odd_half = sum(&[(0.5, &half), (0.5, &half_back)]);
    assert_close(off(&odd) / off(&odd_half), 4.0, 1e-2, 0.0, "order 2");
    let without_squares = off(&sum(&[(4.0 / 3.0, &odd_half), (-1.0 / 3.0, &odd)]));
    assert!(without_squares <= 1e-9, "{without_squares:e}");
    assert!(off(&linear(&[])) > 0.02, "{:e}", off(&linear(&[])));
}
