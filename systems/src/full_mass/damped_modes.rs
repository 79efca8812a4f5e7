//! Eigenvalues of small motions with friction and memory, in the space of the vibrations.

use super::vibration::Vibration;
use crate::error::{Error, Result};
use crate::math::small_sort::{sort_eigenvalues, sort_few};
use crate::spectrum::eigenvalues;
use nalgebra::{Complex, DMatrix, DVector};

/// Relative stiffness of a Maxwell branch below which a direction of its springs is rounding.
const SOFTEST: f64 = 1e-12;

/// In a closed loop of rods self-stresses relax at the rates of the dashpots while the rods rest. A rate that equals
/// one of these up to this relative difference is no motion.
const OWN: f64 = 1e-10;

/// A Maxwell branch of a rod.
pub(super) struct Branch {
    /// First coordinate of the branch's rod.
    pub first: usize,
    /// Modulus over these coordinates, symmetric and positive semidefinite.
    pub modulus: DMatrix<f64>,
    /// Relaxation time.
    pub time: f64,
}

/// A Maxwell branch projected on the vibrations.
struct Springs {
    /// Modulus E over the vibrations' amplitudes.
    modulus: DMatrix<f64>,
    /// L with scale E scale = L L^T, one column for each direction in which the springs pull. Other directions get no
    /// dashpot: its rate -1/tau would be an eigenvalue once per vibration, mostly of other rods, and such
    /// multiplicity can stall the QR iteration.
    pull: DMatrix<f64>,
    time: f64,
}

impl Springs {
    fn new(branch: &Branch, modes: &[Vibration], scale: &[f64]) -> Self {
        let n = modes.len();
        let rows = |i: usize| modes[i].shape.rows(branch.first, branch.modulus.nrows());
        let pushed: Vec<DVector<f64>> = (0..n).map(|i| &branch.modulus * rows(i)).collect();
        let modulus = DMatrix::from_fn(n, n, |i, j| rows(i).dot(&pushed[j]));
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            0.5 * (modulus[(i, j)] + modulus[(j, i)]) * scale[i] * scale[j]
        });
        let found = scaled.symmetric_eigen();
        let least = SOFTEST * found.eigenvalues.max();
        let pulling: Vec<usize> = (0..n).filter(|i| found.eigenvalues[*i] > least).collect();
        let mut pull = found.eigenvectors.select_columns(&pulling);
        for (mut column, i) in pull.column_iter_mut().zip(&pulling) {
            column *= found.eigenvalues[*i].sqrt();
        }
        Self {
            modulus,
            pull,
            time: branch.time,
        }
    }
}

/// Eigenvalues s of the `count` slowest motions exp(s t), Im s >= 0, ordered by Im s: the `count` slowest
/// oscillations, and all creep in the shapes of the `count` slowest vibrations. The space is that of these vibrations
/// of mass 1, with this stiffness (symmetric if all loads have a potential), damping and these Maxwell branches.
///
/// # Errors
/// Eigenvalues that are not found.
pub(super) fn decaying(
    modes: &[Vibration],
    [stiffness, damping]: [&DMatrix<f64>; 2],
    conservative: bool,
    branches: &[Branch],
    count: usize,
) -> Result<Vec<Complex<f64>>> {
    let n = modes.len();
    let inner = |m: &DMatrix<f64>| {
        let pushed: Vec<DVector<f64>> = modes.iter().map(|mode| m * &mode.shape).collect();
        DMatrix::from_fn(n, n, |i, j| modes[i].shape.dot(&pushed[j]))
    };
    let friction = inner(damping);
    let push = if conservative {
        DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| modes[i].square))
    } else {
        inner(stiffness)
    };
    let slow: Vec<f64> = modes
        .iter()
        .map(|mode| 1.0 / mode.square.abs().sqrt())
        .collect();
    // With the stiffness Omega S Omega, (Omega x, x')' = [0, Omega; -Omega S, -C] (Omega x, x'). The inverse of that
    // matrix has the eigenvalues 1/s, so that slow motions keep their digits beside the fast ones. A neutral motion
    // has no 1/s.
    let held = if slow.iter().all(|slow| slow.is_finite()) {
        DMatrix::from_fn(n, n, |i, j| push[(i, j)] * slow[i] * slow[j]).try_inverse()
    } else {
        None
    };
    let turned = held.is_some();
    // A neutral motion strains no spring.
    let scale = slow.iter().map(|x| if x.is_finite() { *x } else { 1.0 });
    let scale: Vec<f64> = scale.collect();
    let branches = branches.iter();
    let branches: Vec<Springs> = branches
        .map(|branch| Springs::new(branch, modes, &scale))
        .collect();
    let dashpots: usize = branches.iter().map(|springs| springs.pull.ncols()).sum();
    let size = 2 * n + dashpots;
    let mut whole = DMatrix::zeros(size, size);
    let mut first = 2 * n;
    if let Some(given) = held {
        for j in 0..n {
            for i in 0..n {
                whole[(i, j)] = -friction[(i, j)] * slow[i] * slow[j];
            }
            whole[(j, n + j)] = -slow[j];
            whole[(n + j, j)] = slow[j];
        }
        // With the strains z of dashpots, z' = (x - z)/tau, d = L^T Omega z.
        for Springs { pull, time, .. } in &branches {
            let mut driven = whole.view_mut((0, first), pull.shape());
            driven.copy_from(&(pull * -*time));
            first += pull.ncols();
        }
        let above = given * whole.rows(0, n);
        whole.rows_mut(0, n).copy_from(&above);
        first = 2 * n;
        for Springs { pull, time, .. } in &branches {
            let mut own = whole.rows_mut(first, pull.ncols());
            own.copy_from(&pull.tr_mul(&above));
            for i in first..first + pull.ncols() {
                whole[(i, i)] -= time;
            }
            first += pull.ncols();
        }
    } else {
        whole.view_mut((0, n), (n, n)).fill_with_identity();
        whole.view_mut((n, 0), (n, n)).copy_from(&-&push);
        whole.view_mut((n, n), (n, n)).copy_from(&-&friction);
        for Springs {
            modulus,
            pull,
            time,
        } in &branches
        {
            let pull = DMatrix::from_fn(n, pull.ncols(), |i, j| pull[(i, j)] / scale[i]);
            let mut springs = whole.view_mut((n, 0), (n, n));
            springs -= modulus;
            whole.view_mut((n, first), pull.shape()).copy_from(&pull);
            let mut driven = whole.view_mut((first, 0), (pull.ncols(), n));
            driven.copy_from(&(pull.transpose() / *time));
            for i in first..first + pull.ncols() {
                whole[(i, i)] = -1.0 / time;
            }
            first += pull.ncols();
        }
    }
    let found = eigenvalues(whole).ok_or_else(|| {
        Error::no_convergence(format!(
            "the eigenvalues of {size} motions with friction and memory were not found: leave out a branch of relaxation or a rod's \
             damping, or change one of their numbers a little"
        ))
    })?;
    let all = found.iter().map(|x| if turned { x.inv() } else { *x });
    let mut upper: Vec<Complex<f64>> = all.filter(|s| s.im >= 0.0 && s.re.is_finite()).collect();
    sort_few(&mut upper, |s| s.norm());
    // Creep rates of fast vibrations lie densely at the rates of the section: report a rate if a slow vibration leads
    // its shape.
    let led_by = |s: f64| {
        let s = s * (1.0 + 1e-11);
        let scale = |i: usize| 1.0 / (modes[i].square.abs().sqrt() + s.abs());
        let balance = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { s * s } else { 0.0 };
            let springs = branches.iter().map(|springs| {
                springs.modulus[(i, j)] * s * springs.time / (1.0 + s * springs.time)
            });
            let sum = push[(i, j)] + s * friction[(i, j)] + own + springs.sum::<f64>();
            sum * scale(i) * scale(j)
        });
        // Singular except for rounding and a relative shift of s by 1e-11: the solution is the shape of the motion.
        let even = DVector::from_element(n, 1.0);
        balance.lu().solve(&even).map_or(0, |shape| shape.iamax())
    };
    let moves = |s: f64| {
        let mut dashpots = branches.iter().map(|springs| 1.0 + s * springs.time);
        dashpots.all(|apart| apart.abs() > OWN)
    };
    let mut left = count;
    upper.retain(|s| {
        if s.im == 0.0 {
            moves(s.re) && led_by(s.re) < count
        } else {
            let told = left > 0;
            left = left.saturating_sub(1);
            told
        }
    });
    sort_eigenvalues(&mut upper);
    Ok(upper)
}
