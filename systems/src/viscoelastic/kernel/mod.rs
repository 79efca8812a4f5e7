//! Small motions of the end of a straight rod: spring, dashpot and memory (AMV Sec. 6).
//!
//! Linearised at the straight unloaded state, with elastic tangent B(s), viscosity A(s) and Q(s) of the straight rod,
//! ```text
//! A e_t + B e = Q w1,    d = int Q^T e ds,    Q = [ I  (L - s)[k]x ]
//!                                                 [ 0       I      ],
//! ```
//! Here w1 = (m, n) acts on the end and d = (z(L), dr(L)) is its small rotation and displacement; Q^T is M(s) of
//! (6.14b). In Laplace form d = G(p) w1, G(p) = int Q^T (A p + B)^-1 Q ds. The response of the end at rest before
//! t = 0 is
//! ```text
//! w1 = A_end V + R(0) d - int_0^t k(t - tau) d(tau) dtau = A_end V + int_0^t R(t - tau) V(tau) dtau,    V = d_t,
//! ```
//! with the dashpot A_end = (int Q^T A^-1 Q)^-1, the relaxation function R and the memory kernel k = -R_t.
//!
//! # Condition for no memory
//! Under the inner product <f, g> = int f.A g the operator T = A^-1 B is symmetric and positive. The strain fields
//! S = {A^-1 Q w} are those that a wrench starts from rest. G(p) is the resolvent of -T, compressed to S. It is the
//! inverse of a polynomial p A_end + B_end - a spring beside a dashpot - if and only if T maps S into itself:
//! ```text
//! B(s) A(s)^-1 Q(s) = Q(s) X    with one X for all s.                                                  (*)
//! ```
//! With nothing rigid Q(L) = I gives X = B(L) A(L)^-1. AMV have L(s) = A(s)^-1 Q(s) A(L) and C = -A^-1 B, so (*)
//! is C(s) L(s) = L(s) C(L), their (6.15): sufficient as AMV say, and necessary too. Case by case:
//!
//! * A = tau B, also tapered: C = -I/tau, no memory at all.
//! * Uniform, A and B diagonal: with the retardation rates x_i = B_ii/A_ii of the strains the condition is
//!   x(u1) = x(v2) and x(u2) = x(v1): flexure and shear in a plane must retard alike. Twist and stretch are free.
//!   Flexure thus has memory in general, as AMV say. In one plane the memory is a single exponential of rate
//!   (x_s g_b + x_b g_s)/(g_b + g_s) between the two, with g_b = L^2/(12 A_b), g_s = 1/A_s.
//! * Unshearable (and inextensible) rods have no shear rate to differ from. If A and B are diagonal and uniform,
//!   flexure has *no* memory to first order, even if the two planes and twist retard differently. In the plane (*)
//!   reads EI/eta = const along the rod. AMV's claim of memory in flexure is about C(s) as a 6 x 6 matrix. Without
//!   shear, memory has three sources: rates that vary along the rod, coupled flexure and twist that retard differently,
//!   and finite deflections, since Q changes with the shape. For a uniform planar rod, free to move along itself, two
//!   histories with the same final position left wrenches that differ by the fifth order of the deflection (computed).
//! * Rates that vary along s - tapered viscosity on a uniform rod - give memory to every motion, also to purely
//!   longitudinal and twisting ones: units in series that retard differently.
//!
//! # Numbers
//! The rod is taken at the nodes of a [`Grid`](super::grid::Grid), where T is diagonal in modal strains; off S it has
//! eigenvalues r_k, and k(t) = sum_k f_k f_k^T exp(-r_k t) is a finite sum without numerical inversion. Uniform rods
//! are exact at any number of nodes. Otherwise the nodes are refined until G(p) converges
//! ([`MemoryKernel::accuracy`]); convergence is spectral between breaks. Rates come with an absolute
//! error of a few ulp of the largest.
//! Nonlinear laws enter by their tangents at rest.
//!
//! # Maxwell branches
//! With E = F F^T and zeta = F^T z the branch stores 1/2 |F^T e - zeta|^2 and dissipates time |zeta_t|^2: its dashpot
//! is one more set of strains that retard, with viscosity `time` and no load of its own. All of the above holds with
//! (e, zeta) in place of e; S is not mapped into itself, every section has memory, and R falls over the times of the
//! branches.

mod modal;

use crate::error::{Error, Result};
use crate::section::rate::{Viscoelastic, inverse_of_free};
use modal::{EndUnits, Node, compliances, flat, nodes, off_the_moving, total};
use nalgebra::{Matrix6, Vector6};

/// A relative defect of (6.15) below this is rounding.
const ROUNDING: f64 = 1e-10;
/// A term f f^T exp(-rate t) of the memory kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Decay rate of the memory, > 0.
    pub rate: f64,
    /// f, a wrench (m, n) per displacement and square root of time.
    pub force: Vector6<f64>,
}

/// The linearised response of the end of a straight viscoelastic rod (see the module's head, in short: a spring, a
/// dashpot, and a sum of decaying exponentials as memory). Matrices take displacements or velocities (rotation z,
/// displacement r) to wrenches (m, n), in the frame of the straight rod; rows and columns of components that the end
/// does not carry, and of a stretch that is held rigid, are zero.
///
/// ```
/// # use snaprod_systems as snaprod;
/// # use snaprod::section::Linear;
/// # use snaprod::viscoelastic::kernel::{MemoryKernel, commuting};
/// # use snaprod::section::rate::{KelvinVoigt, Viscoelastic, Viscosity};
/// # use std::sync::Arc;
/// let elastic = Linear::diagonal([1.0, 1.0], 0.7)?.with_shear([50.0, 50.0])?;
/// let viscosity = Viscosity::diagonal([0.1, 0.1], 0.05)?.with_shear([2.0, 2.0])?;
/// let rod = Viscoelastic::new(Arc::new(elastic), Arc::new(KelvinVoigt::new(viscosity)))?;
/// // Flexure retards at the rate 10, shear at 25: the end remembers, with one exponential in each plane.
/// assert!(!commuting(&rod, 1.0)?.holds);
/// let kernel = MemoryKernel::new(&rod, 1.0)?;
/// let rate = (25.0 / 1.2 + 10.0 / 2.0) / (1.0 / 1.2 + 1.0 / 2.0);
/// assert_eq!(kernel.modes().len(), 2);
/// assert!((kernel.modes()[0].rate - rate).abs() < 1e-12 * rate);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct MemoryKernel {
    nodes: Vec<Node>,
    /// Components of the end that move, and carry a wrench determined by the motion.
    reach: [bool; 6],
    commuting: Commuting,
    instantaneous: Matrix6<f64>,
    glassy: Matrix6<f64>,
    relaxed: Matrix6<f64>,
    modes: Vec<Mode>,
    /// A(L), B(L), if nothing is rigid and the end carries couple and force.
    end: Option<(Matrix6<f64>, Matrix6<f64>)>,
    accuracy: f64,
}

/// Deviation of a rod from (6.15).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commuting {
    /// True if (6.15) holds to rounding: the response of the end has no memory.
    pub holds: bool,
    /// Largest defect of B A^-1 Q = Q X over the rod with the best X, relative to the largest B A^-1 Q. The norm is
    /// that of the dissipation of a wrench. Dimensionless; at most about 1.
    pub defect: f64,
    /// The point s of the largest defect.
    pub at: f64,
}

/// Condition (6.15) for this section on a straight rod of this length, with an end that carries couple and force.
///
/// # Errors
/// As [`MemoryKernel::new`].
pub fn commuting(section: &Viscoelastic, length: f64) -> Result<Commuting> {
    let (nodes, _) = nodes(section, length, [true; 6])?;
    Ok(defect(&nodes, &EndUnits::new(&nodes)?, length))
}

fn defect(nodes: &[Node], end: &EndUnits, length: f64) -> Commuting {
    let shapes: Vec<_> = nodes.iter().map(|node| &node.load * end.unit).collect();
    let faster =
        |k: usize| shapes[k].map_with_location(|i, _, entry: f64| entry * nodes[k].rates[i]);
    let best = (0..nodes.len()).fold(Matrix6::zeros(), |sum, k| {
        sum + shapes[k].transpose() * faster(k) * nodes[k].weight
    });
    let size = (0..nodes.len()).fold(0.0_f64, |max, k| max.max(faster(k).norm()));
    let (defect, at) = (0..nodes.len())
        .map(|k| ((faster(k) - &shapes[k] * best).norm() / size, nodes[k].s))
        .fold(
            (0.0, length),
            |worst, here| {
                if here.0 > worst.0 { here } else { worst }
            },
        );
    Commuting {
        holds: defect <= ROUNDING,
        defect,
        at,
    }
}

impl MemoryKernel {
    /// The response of an end that is welded to a body: it carries couple and force.
    ///
    /// # Errors
    /// A length that is not finite and > 0; a rod that is not straight and unstretched without load; as
    /// [`SectionLaw::inverse`](crate::section::SectionLaw::inverse) and
    /// [`RateLaw::rate`](crate::section::rate::RateLaw::rate).
    pub fn new(section: &Viscoelastic, length: f64) -> Result<Self> {
        Self::carrying(section, length, [true; 6])
    }

    /// The response of an end that is free to turn: it carries force alone, rows and columns of the couple are zero.
    ///
    /// # Errors
    /// As [`MemoryKernel::new`].
    pub fn free_to_turn(section: &Viscoelastic, length: f64) -> Result<Self> {
        Self::carrying(section, length, [false, false, false, true, true, true])
    }

    /// The response of an end that carries the marked components of (m, n) and moves freely in the others: rows and
    /// columns of these are zero. A planar rod whose end is free to turn carries n1 or n2 alone.
    ///
    /// # Errors
    /// As [`MemoryKernel::new`]; nothing marked.
    pub fn carrying(section: &Viscoelastic, length: f64, carried: [bool; 6]) -> Result<Self> {
        if carried == [false; 6] {
            return Err(Error::domain(
                "the end carries no wrench: mark at least one component",
            ));
        }
        let (nodes, accuracy) = nodes(section, length, carried)?;
        let end = EndUnits::new(&nodes)?;
        let relaxed = inverse_of_free(&total(&nodes, f64::recip), end.still()).ok_or_else(flat)?;
        let whole = carried == [true; 6]
            && section.rate.rigid() == [false; 6]
            && section.branches.is_empty();
        let at_end = if whole {
            let [a, b] = compliances(section, length)?;
            let invert = |m: &Matrix6<f64>| inverse_of_free(m, [false; 6]).ok_or_else(flat);
            Some((invert(&a)?, invert(&b)?))
        } else {
            None
        };
        let (glassy, modes) = off_the_moving(&nodes, &end).ok_or_else(|| {
            Error::no_convergence("the eigenvalues of the retarded rod did not converge")
        })?;
        Ok(Self {
            reach: end.reach,
            commuting: defect(&nodes, &end, length),
            instantaneous: end.physical(&Matrix6::identity()),
            glassy,
            relaxed,
            modes,
            end: at_end,
            accuracy,
            nodes,
        })
    }

    /// A_end: wrench per velocity at once, the dashpot.
    pub fn instantaneous(&self) -> Matrix6<f64> {
        self.instantaneous
    }

    /// R(0): wrench per displacement right after a step (and after its impulse A_end).
    pub fn glassy(&self) -> Matrix6<f64> {
        self.glassy
    }

    /// R at infinite time, (int Q^T B^-1 Q)^-1: the elastic stiffness of the end.
    pub fn relaxed(&self) -> Matrix6<f64> {
        self.relaxed
    }

    /// R(t): the wrench at t > 0 after a unit step of the displacement at t = 0, without the impulse A_end at the step
    /// itself; zero for t < 0. R is completely monotone: it falls from [`MemoryKernel::glassy`] to
    /// [`MemoryKernel::relaxed`], and w1 = A_end V + int_0^t R(t - tau) V(tau) dtau.
    pub fn wrench_after_step(&self, t: f64) -> Matrix6<f64> {
        if t < 0.0 {
            return Matrix6::zeros();
        }
        self.relaxed + self.over_modes(|rate| (-rate * t).exp() / rate)
    }

    /// The wrench at time t > 0 of an end that has moved at a constant unit velocity since t = 0; zero for t < 0.
    pub fn wrench_at_constant_velocity(&self, t: f64) -> Matrix6<f64> {
        if t < 0.0 {
            return Matrix6::zeros();
        }
        let remembered = self.over_modes(|rate| -(-rate * t).exp_m1() / (rate * rate));
        self.instantaneous + self.relaxed * t + remembered
    }

    /// k(t) = -dR/dt = sum f f^T exp(-rate t), positive semidefinite: the memory in
    /// w1 = A_end V + R(0) d - int_0^t k(t - tau) d(tau) dtau. Zero if the end has no memory, and for t < 0.
    pub fn kernel(&self, t: f64) -> Matrix6<f64> {
        if t < 0.0 {
            return Matrix6::zeros();
        }
        self.over_modes(|rate| (-rate * t).exp())
    }

    /// J(t) = int Q^T B^-1 (1 - exp(-A^-1 B t)) Q ds: the displacement at t under a unit wrench since t = 0; zero for
    /// t < 0.
    pub fn creep(&self, t: f64) -> Matrix6<f64> {
        if t < 0.0 {
            return Matrix6::zeros();
        }
        total(&self.nodes, |rate| -(-rate * t).exp_m1() / rate)
    }

    /// G(p)^-1 = p A_end + R(0) - sum f f^T/(p + rate): Laplace transforms of wrench per displacement, p >= 0.
    pub fn stiffness(&self, p: f64) -> Matrix6<f64> {
        self.instantaneous * p + self.relaxed + self.over_modes(|rate| p / (rate * (p + rate)))
    }

    /// Storage and loss moduli at the angular frequency omega: the wrench is (storage + i loss) times the displacement.
    pub fn dynamic_stiffness(&self, omega: f64) -> [Matrix6<f64>; 2] {
        let part = |rate: f64| omega / rate / (1.0 + (omega / rate) * (omega / rate));
        let storage = self.over_modes(|rate| omega / (rate * rate) * part(rate));
        let loss = self.over_modes(|rate| part(rate) / rate);
        [self.relaxed + storage, self.instantaneous * omega + loss]
    }

    /// The exponentials of the kernel, slowest first; none if the end has no memory.
    pub fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// (6.14a) as AMV have it, in terms of the strains at the end: with d = (z, r)(L)
    /// ```text
    /// d(t) = D e(L, t) + int_0^t N(t - tau) e(L, tau) dtau + transient,
    /// D = int M L ds,    N(t) = int M exp(C t) [C L - L C(L)] ds.
    /// ```
    /// Returns D and N(t), t >= 0. N = 0 is (6.15).
    ///
    /// # Errors
    /// Strains that are held rigid, an end free to turn, Maxwell branches: the strains at the end and their rates do
    /// not then determine the wrench.
    pub fn by_end_strains(&self, t: f64) -> Result<[Matrix6<f64>; 2]> {
        let Some((a, b)) = &self.end else {
            return Err(Error::domain(
                "(6.14) is in terms of the strains at the end, which with their rates determine the wrench only where \
                 nothing is held rigid, there are no Maxwell branches and the end carries couple and force: \
                 use the kernel in terms of displacements",
            ));
        };
        let direct = total(&self.nodes, |_| 1.0) * a;
        // exp(C t) A^-1 Q = E exp(-rates t) E^T Q, and C A^-1 Q = -E rates E^T Q.
        let decay = |rate: f64| (-rate * t).exp();
        let kernel =
            total(&self.nodes, decay) * b - total(&self.nodes, |rate| rate * decay(rate)) * a;
        Ok([direct, kernel])
    }

    /// The free components of (z, r) of the end: those it carries a wrench against, except the displacement along an
    /// inextensible rod.
    pub fn moves(&self) -> [bool; 6] {
        self.reach
    }

    /// Condition (6.15) for this end, in the carried components. Compare [`commuting`].
    pub fn commuting(&self) -> Commuting {
        self.commuting
    }

    /// Relative change of G(p) in the last refinement of the grid: an estimate of the error of all matrices of the
    /// kernel, on top of rounding.
    pub fn accuracy(&self) -> f64 {
        self.accuracy
    }

    fn over_modes(&self, f: impl Fn(f64) -> f64) -> Matrix6<f64> {
        self.modes.iter().fold(Matrix6::zeros(), |sum, mode| {
            sum + mode.force * mode.force.transpose() * f(mode.rate)
        })
    }
}
