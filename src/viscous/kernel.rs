//! Small motions of the end of a straight rod: spring, dashpot and memory (AMV Sec. 6).
//!
//! Linearised at the straight unloaded state, with elastic tangent B(s), viscosity A(s) and Q(s) of the straight rod,
//! ```text
//! A e_t + B e = Q w1,    d = int Q^T e ds,    Q = [ I  (L - s)[k]x ]
//!                                                 [ 0       I      ],
//! ```
//! where w1 = (m, n) acts on the end and d = (z(L), dr(L)) is its small rotation and displacement; Q^T is M(s) of
//! (6.14b). In Laplace form d = G(p) w1, G(p) = int Q^T (A p + B)^-1 Q ds, and the response of the end at rest before
//! t = 0 is
//! ```text
//! w1 = A_end V + R(0) d - int_0^t k(t - tau) d(tau) dtau = A_end V + int_0^t R(t - tau) V(tau) dtau,    V = d_t,
//! ```
//! with the dashpot A_end = (int Q^T A^-1 Q)^-1, the relaxation function R and the memory kernel k = -R_t.
//!
//! # When there is no memory
//! Under the inner product <f, g> = int f.A g the operator T = A^-1 B is symmetric and positive, and the strain fields
//! S = {A^-1 Q w} are those that a wrench starts from rest. G(p) is the resolvent of -T, compressed to S. It is the
//! inverse of a polynomial p A_end + B_end - a spring beside a dashpot - if and only if T maps S into itself:
//! ```text
//! B(s) A(s)^-1 Q(s) = Q(s) X    with one X for all s.                                                  (*)
//! ```
//! With nothing rigid Q(L) = I gives X = B(L) A(L)^-1, and since L(s) = A(s)^-1 Q(s) A(L) and C = -A^-1 B in AMV, (*) is
//! C(s) L(s) = L(s) C(L), which is (6.15): sufficient as AMV say, and necessary too. What it asks for, case by case:
//!
//! * A = tau B, also tapered: C = -I/tau, no memory at all.
//! * Uniform, A and B diagonal: with the retardation rates x_i = B_ii/A_ii of the strains the condition is
//!   x(u1) = x(v2) and x(u2) = x(v1): flexure and shear in the same plane must retard alike. Twist and stretch are free.
//!   So flexure has memory in general, as AMV say. In one plane it is a single exponential of rate
//!   (x_s g_b + x_b g_s)/(g_b + g_s) between the two, with g_b = L^2/(12 A_b), g_s = 1/A_s.
//! * Unshearable (and inextensible) rods have no shear to disagree with: uniform flexure has *no* memory to first order,
//!   even if the two planes and twist retard differently. In the plane (*) reads EI/eta = const along the rod. AMV's
//!   claim of memory in flexure is about C(s) as a 6 x 6 matrix. Without shear memory comes with rates that vary along
//!   the rod, and with finite deflections, where Q changes with the shape: for a uniform planar rod, left to move along
//!   itself, two histories with the same end leave wrenches that differ at the fifth order of the deflection.
//! * Rates that vary along s - tapered viscosity on a uniform rod - give memory to every motion, also to purely
//!   longitudinal and twisting ones: units in series that retard differently.
//!
//! # Numbers
//! The rod is taken at the nodes of a [`Grid`], where T is diagonal in modal strains; off S it has
//! eigenvalues r_k, and k(t) = sum_k f_k f_k^T exp(-r_k t) is a finite sum without numerical inversion. Uniform rods are
//! exact at any number of nodes. Otherwise the nodes are refined until G(p) stands still ([`MemoryKernel::accuracy`]);
//! convergence is spectral between breaks. Rates come with an absolute error of a few ulp of the largest.
//! Nonlinear laws enter by their tangents at rest.
//!
//! # Maxwell branches
//! With E = F F^T and zeta = F^T z the branch stores 1/2 |F^T e - zeta|^2 and dissipates time |zeta_t|^2: its dashpot is
//! one more set of strains that retard, with viscosity `time` and no load of its own. All of the above holds with
//! (e, zeta) in place of e; S is not mapped into itself, every section has memory, and R falls over the times of the
//! branches.

use super::grid::{Grid, more};
use super::law::{Viscoelastic, inverse_of_free, rigid_of};
use crate::error::{Error, Result};
use crate::rod::section::{Resultant, Strain};
use nalgebra::{Cholesky, DMatrix, Dyn, Matrix6, OMatrix, U6, Vector6};

/// Most unknowns (nodes times free strains).
const MOST: usize = 384;
/// The grid is fine enough when G(p) changes by less than this, relative.
const STILL: f64 = 1e-13;
/// How far unloaded strains may be from straight.
const BENT: f64 = 1e-12;
/// A relative defect of (6.15) below this is rounding.
const ROUNDING: f64 = 1e-10;
/// Modes weaker than this, against the fastest rate, are rounding.
const WEAK: f64 = 1e-14;

/// A term f f^T exp(-rate t) of the memory kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// How fast it is forgotten, > 0.
    pub rate: f64,
    /// f, a wrench (m, n) per displacement and square root of time.
    pub force: Vector6<f64>,
}

/// The linearised response of the end of a straight viscoelastic rod (see the module's head, in short: a spring, a
/// dashpot, and a sum of decaying exponentials as memory). Matrices take displacements or velocities (rotation z,
/// displacement r) to wrenches (m, n), in the frame of the straight rod; rows and columns of components that the end
/// does not carry, and of a stretch that is held rigid, are zero.
#[derive(Debug, Clone)]
pub struct MemoryKernel {
    nodes: Vec<Node>,
    /// Which components of the end move, and carry a wrench that follows from the motion.
    reach: [bool; 6],
    instantaneous: Matrix6<f64>,
    glassy: Matrix6<f64>,
    relaxed: Matrix6<f64>,
    modes: Vec<Mode>,
    /// A(L), B(L), where nothing is rigid and the end carries couple and force.
    end: Option<(Matrix6<f64>, Matrix6<f64>)>,
    accuracy: f64,
}

/// How far a rod is from (6.15).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commuting {
    /// True if (6.15) holds to rounding: the response of the end has no memory.
    pub holds: bool,
    /// Largest defect of B A^-1 Q = Q X over the rod with the best X, relative to the largest B A^-1 Q, in the norm in
    /// which a wrench dissipates. No units; at most about 1.
    pub defect: f64,
    /// The place s of the largest defect.
    pub at: f64,
}

/// A row for each modal strain, a column for each component of the end wrench.
type Loads = OMatrix<f64, Dyn, U6>;

/// One place of the rod in modal strains y: e = E y with E E^T = A^-1, E^T B E = diag(rates).
#[derive(Debug, Clone)]
struct Node {
    s: f64,
    weight: f64,
    rates: Vec<f64>,
    /// E^T Q: rows are modal strains.
    load: Loads,
}

impl Node {
    /// load^T diag(f(rate)) load.
    fn sum(&self, f: impl Fn(f64) -> f64) -> Matrix6<f64> {
        let scaled = self
            .load
            .map_with_location(|i, _, entry| entry * f(self.rates[i]));
        self.load.transpose() * scaled * self.weight
    }
}

/// Does (6.15) hold for this section on a straight rod of this length? The end carries couple and force.
///
/// # Errors
/// As [`MemoryKernel::new`].
pub fn commuting(section: &Viscoelastic, length: f64) -> Result<Commuting> {
    let (nodes, _) = nodes(section, length, [true; 6])?;
    let end = End::new(&nodes)?;
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
    Ok(Commuting {
        holds: defect <= ROUNDING,
        defect,
        at,
    })
}

impl MemoryKernel {
    /// The response of an end that is welded to a body: it carries couple and force.
    ///
    /// # Errors
    /// A length that is not finite and > 0; a rod that is not straight and unstretched without load; as [`SectionLaw::inverse`](crate::rod::section::SectionLaw::inverse) and
    /// [`RateLaw::rate`](super::law::RateLaw::rate).
    pub fn new(section: &Viscoelastic, length: f64) -> Result<Self> {
        Self::of(section, length, [true; 6])
    }

    /// The response of an end that is free to turn: it carries force alone, rows and columns of the couple are zero.
    ///
    /// # Errors
    /// As [`MemoryKernel::new`].
    pub fn free_to_turn(section: &Viscoelastic, length: f64) -> Result<Self> {
        Self::of(section, length, [false, false, false, true, true, true])
    }

    fn of(section: &Viscoelastic, length: f64, carried: [bool; 6]) -> Result<Self> {
        let (nodes, accuracy) = nodes(section, length, carried)?;
        let end = End::new(&nodes)?;
        let relaxed = inverse_of_free(&total(&nodes, f64::recip), end.still()).ok_or_else(flat)?;
        let whole = carried == [true; 6]
            && section.rate.rigid() == [false; 6]
            && section.branches.is_empty();
        let at_end = match whole {
            true => {
                let [a, b] = compliances(section, length)?;
                let invert = |m: &Matrix6<f64>| inverse_of_free(m, [false; 6]).ok_or_else(flat);
                Some((invert(&a)?, invert(&b)?))
            }
            false => None,
        };
        let (glassy, modes) = off_the_moving(&nodes, &end).ok_or_else(|| {
            Error::no_convergence("the eigenvalues of the retarded rod did not converge")
        })?;
        Ok(Self {
            reach: end.reach,
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
    /// Strains that are held rigid, an end free to turn, Maxwell branches: the strains at the end and their rates do not
    /// then determine the wrench.
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

    /// Which components of (z, r) the end can have: not those it carries no wrench against, nor the displacement along
    /// an inextensible rod.
    pub fn moves(&self) -> [bool; 6] {
        self.reach
    }

    /// How much G(p) changed in the last refinement of the grid, relative: an estimate of the error of all matrices
    /// here, on top of rounding.
    pub fn accuracy(&self) -> f64 {
        self.accuracy
    }

    fn over_modes(&self, f: impl Fn(f64) -> f64) -> Matrix6<f64> {
        self.modes.iter().fold(Matrix6::zeros(), |sum, mode| {
            sum + mode.force * mode.force.transpose() * f(mode.rate)
        })
    }
}

fn flat() -> Error {
    Error::ill_conditioned(
        "stiffnesses or viscosities are too far apart in size: to rounding the end is held in some direction",
    )
}

fn total(nodes: &[Node], f: impl Fn(f64) -> f64 + Copy) -> Matrix6<f64> {
    nodes
        .iter()
        .fold(Matrix6::zeros(), |sum, node| sum + node.sum(f))
}

/// The end in units in which int Q^T A^-1 Q is 1.
struct End {
    reach: [bool; 6],
    /// K^-T of int Q^T A^-1 Q = K K^T; zero rows and columns where the end does not move.
    unit: Matrix6<f64>,
}

impl End {
    fn new(nodes: &[Node]) -> Result<Self> {
        let mut mobility = total(nodes, |_| 1.0);
        let reach = std::array::from_fn(|k| mobility[(k, k)] > 0.0);
        for k in (0..6).filter(|k| !reach[*k]) {
            mobility[(k, k)] = 1.0;
        }
        let lower = Cholesky::new(mobility).ok_or_else(flat)?.l();
        let mut unit = lower
            .solve_lower_triangular(&Matrix6::identity())
            .ok_or_else(flat)?
            .transpose();
        for k in (0..6).filter(|k| !reach[*k]) {
            unit[(k, k)] = 0.0;
        }
        Ok(Self { reach, unit })
    }

    fn still(&self) -> [bool; 6] {
        self.reach.map(|reach| !reach)
    }

    fn physical(&self, matrix: &Matrix6<f64>) -> Matrix6<f64> {
        let product = self.unit * matrix * self.unit.transpose();
        0.5 * (product + product.transpose())
    }
}

/// R(0) and the modes of T off the moving fields S.
fn off_the_moving(nodes: &[Node], end: &End) -> Option<(Matrix6<f64>, Vec<Mode>)> {
    let places: Vec<(usize, usize)> = (0..nodes.len())
        .flat_map(|k| (0..nodes[k].rates.len()).map(move |i| (k, i)))
        .filter(|(k, i)| nodes[*k].load.row(*i).amax() > 0.0)
        .collect();
    let rates: Vec<f64> = places.iter().map(|(k, i)| nodes[*k].rates[*i]).collect();
    let fastest = rates.iter().fold(0.0_f64, |max, rate| max.max(*rate));
    // An orthonormal basis U of S.
    let mut basis = DMatrix::zeros(places.len(), 6);
    for (row, (k, i)) in places.iter().enumerate() {
        let shape = nodes[*k].load.row(*i) * end.unit * nodes[*k].weight.sqrt();
        basis.row_mut(row).copy_from(&shape);
    }
    let mut moved = basis.clone();
    for (row, rate) in rates.iter().enumerate() {
        moved.row_mut(row).scale_mut(*rate);
    }
    let inner = basis.transpose() * &moved;
    let glassy = Matrix6::from_fn(|i, j| inner[(i, j)]);
    // (1 - U U^T) T (1 - U U^T) + 2 fastest U U^T: what belongs to S lies beyond all rates.
    let lifted = &basis * (&inner + DMatrix::identity(6, 6) * (2.0 * fastest));
    let mut operator = &lifted * basis.transpose();
    let cross = &moved * basis.transpose();
    operator -= &cross + cross.transpose();
    for (row, rate) in rates.iter().enumerate() {
        operator[(row, row)] += rate;
    }
    let eigen = operator.try_symmetric_eigen(f64::EPSILON, 0)?;
    let mut modes = Vec::new();
    for (rate, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *rate > 1.5 * fastest {
            continue;
        }
        let force = moved.transpose() * vector;
        if force.amax() > WEAK * fastest {
            modes.push(Mode {
                rate: *rate,
                force: end.unit * Vector6::from_fn(|i, _| force[i]),
            });
        }
    }
    modes.sort_by(|a, b| a.rate.total_cmp(&b.rate));
    Some((end.physical(&glassy), modes))
}

/// The rod at the nodes of a grid that is fine enough, and how much the last refinement changed.
fn nodes(section: &Viscoelastic, length: f64, carried: [bool; 6]) -> Result<(Vec<Node>, f64)> {
    if !(0.0 < length && length.is_finite()) {
        return Err(Error::domain(format!(
            "length = {length} must be finite and > 0"
        )));
    }
    let breaks = section.breaks().into_iter().map(|s| s / length);
    let breaks: Vec<f64> = breaks.filter(|x| 0.0 < *x && *x < 1.0).collect();
    let elements = breaks.len() + 1;
    let free = section.rate.rigid().iter().filter(|rigid| !**rigid).count();
    let strains = free * (1 + section.branches.len());
    let at = |count: usize| -> Result<Vec<Node>> {
        let grid = Grid::new(&breaks, &vec![count; elements]);
        let places = grid.nodes().iter().zip(grid.weights());
        places
            .map(|(x, weight)| node(section, length, length * x, length * weight, carried))
            .collect()
    };
    let mut count = 6;
    let mut coarse = at(4)?;
    loop {
        let fine = at(count)?;
        let change = change(&coarse, &fine);
        let next = more(count);
        if change <= STILL || next * elements * strains > MOST {
            return Ok((fine, change));
        }
        (coarse, count) = (fine, next);
    }
}

/// The largest change of an entry of G(p) over p, against the diagonal.
fn change(coarse: &[Node], fine: &[Node]) -> f64 {
    let rates = || {
        fine.iter()
            .flat_map(|node| {
                let loads = node.load.row_iter().map(|row| row.amax());
                node.rates.iter().copied().zip(loads)
            })
            .filter(|(_, load)| *load > 0.0)
            .map(|(rate, _)| rate)
    };
    let slowest = rates().fold(f64::INFINITY, f64::min);
    let fastest = rates().fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for step in 0..8 {
        // p = 0, between the rates, infinite.
        let p = slowest * (fastest / slowest).powf((f64::from(step) - 1.0) / 5.0);
        let compliance = |rate: f64| match step {
            0 => 1.0 / rate,
            7 => 1.0,
            _ => 1.0 / (p + rate),
        };
        let (old, new) = (total(coarse, compliance), total(fine, compliance));
        for i in 0..6 {
            for j in 0..6 {
                let size = (new[(i, i)] * new[(j, j)]).sqrt();
                if size > 0.0 {
                    worst = worst.max((old[(i, j)] - new[(i, j)]).abs() / size);
                }
            }
        }
    }
    worst
}

/// A^-1 and B^-1 at s, zero rows and columns where a strain is rigid.
fn compliances(section: &Viscoelastic, s: f64) -> Result<[Matrix6<f64>; 2]> {
    let unloaded = section.elastic.inverse(s, &Resultant::zeros())?;
    let bent = (unloaded.strain - Strain::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)).amax();
    if !(bent <= BENT) {
        return Err(Error::domain(format!(
            "the rod must be straight and unstretched without load: at s = {s} its strains are {:?}",
            unloaded.strain.as_slice()
        )));
    }
    let rigid = rigid_of(&unloaded.compliance);
    if rigid != section.rate.rigid() {
        return Err(Error::domain(format!(
            "at s = {s} the elastic law holds rigid {rigid:?} and the rate law {:?}: they must agree",
            section.rate.rigid()
        )));
    }
    let mobility = section
        .rate
        .rate(s, &unloaded.strain, &Resultant::zeros())?
        .by_overstress;
    Ok([mobility, unloaded.compliance.matrix()])
}

fn node(
    section: &Viscoelastic,
    length: f64,
    s: f64,
    weight: f64,
    carried: [bool; 6],
) -> Result<Node> {
    let [mobility, compliance] = compliances(section, s)?;
    let rigid = section.rate.rigid();
    let tangent = inverse_of_free(&compliance, rigid).ok_or_else(flat)?;
    let free: Vec<usize> = (0..6).filter(|k| !rigid[*k]).collect();
    let block = |matrix: &Matrix6<f64>| {
        DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])])
    };
    let root = block(&mobility).cholesky().ok_or_else(flat)?.l();
    let mut springs = block(&tangent);
    let factors: Vec<DMatrix<f64>> = section
        .branches
        .iter()
        .map(|branch| factor(&block(&branch.modulus)))
        .collect::<Option<_>>()
        .ok_or_else(flat)?;
    let more: usize = factors.iter().map(|factor| factor.ncols()).sum();
    let (few, all) = (free.len(), free.len() + more);
    // Strains and dashpots: springs K, roots of the mobility.
    let mut joined = DMatrix::identity(all, all);
    let mut roots = DMatrix::identity(all, all);
    roots.view_mut((0, 0), (few, few)).copy_from(&root);
    let mut first = few;
    for (factor, branch) in factors.iter().zip(&section.branches) {
        let count = factor.ncols();
        springs += factor * factor.transpose();
        joined
            .view_mut((0, first), (few, count))
            .copy_from(&-factor);
        joined
            .view_mut((first, 0), (count, few))
            .copy_from(&-factor.transpose());
        for k in first..first + count {
            roots[(k, k)] = branch.time.sqrt().recip();
        }
        first += count;
    }
    joined.view_mut((0, 0), (few, few)).copy_from(&springs);
    let retarded = roots.transpose() * joined * &roots;
    let retarded = 0.5 * (&retarded + retarded.transpose());
    let eigen = retarded
        .try_symmetric_eigen(f64::EPSILON, 1000)
        .ok_or_else(flat)?;
    if !eigen.eigenvalues.iter().all(|rate| 0.0 < *rate) {
        return Err(flat());
    }
    let arm = length - s;
    let mut transfer = Matrix6::identity();
    (transfer[(0, 4)], transfer[(1, 3)]) = (-arm, arm);
    for k in (0..6).filter(|k| !carried[*k]) {
        transfer.column_mut(k).fill(0.0);
    }
    let moving = Loads::from_fn_generic(Dyn(all), U6, |i, j| {
        free.get(i).map_or(0.0, |k| transfer[(*k, j)])
    });
    Ok(Node {
        s,
        weight,
        rates: eigen.eigenvalues.iter().copied().collect(),
        load: (roots * eigen.eigenvectors).transpose() * moving,
    })
}

/// F with F F^T = modulus, as many columns as its rank. Scaled to a unit diagonal, so that units play no part.
fn factor(modulus: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let roots = modulus.diagonal().map(|entry| entry.max(0.0).sqrt());
    let scaled = modulus.map_with_location(|i, j, entry| match roots[i] * roots[j] {
        0.0 => 0.0,
        size => entry / size,
    });
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let kept: Vec<usize> = (0..roots.len())
        .filter(|k| eigen.eigenvalues[*k] > 1e-14)
        .collect();
    Some(DMatrix::from_fn(roots.len(), kept.len(), |i, k| {
        roots[i] * eigen.eigenvectors[(i, kept[k])] * eigen.eigenvalues[kept[k]].sqrt()
    }))
}
