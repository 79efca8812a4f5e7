//! The fast viscous layer: landing of a rod that leaves an equilibrium with its end held.
//!
//! With a small viscosity the jump is the gradient flow of the bending energy at fixed r(1) (theory 2.6): u = theta',
//! u_T = q . n - u, q(s) = J (r(1) - r(s)), J(a, b) = (-b, a), with n such that r(1) stays. Its spectrum lies in
//! [-1, small], but a rod with a loop slides along itself at a rate of order exp(-lam): up to 1e9 time units. The
//! fall itself is integrated by an explicit method. The slow rest is integrated by a linearly implicit one, whose
//! steps grow as the flow slows down and become Newton's.

use super::chart::amplitude;
use super::equilibrium::Equilibrium;
use crate::error::{Error, Result};
use crate::manifold::{ENERGY_ROUNDING, Multivalued, energy_allows_landing, invert_near};
use crate::math::gauss::Rule;
use crate::math::product::{Matrix, cosines_and_sines};
use crate::solve::dop853::Dop853;
use crate::solve::lu::Lu;
use crate::solve::system::Factor;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use std::f64::consts::PI;
use std::sync::OnceLock;

type NodeValues = DVector<f64>;

/// Number of Gauss nodes for u under the load lam. Bends have the width 1/lam, so n nodes leave an error of
/// exp(-pi n/lam). It must stay below the force of order exp(-lam) that moves a loop, here by exp(-9).
fn nodes(lam: f64) -> usize {
    ((8.0 + lam * (lam + 9.0) / PI) as usize)
        .clamp(8, MOST_NODES)
        .next_multiple_of(8)
}

/// Most nodes of a layer.
const MOST_NODES: usize = 120;

/// Shortest departure along the kernel, as a change of u relative to u, far enough to leave the fold.
const DEPARTURE: f64 = 5e-3;
/// Speed |u_T|/|u| that the departure must exceed; it is lengthened until then, to 1/3 at most. The energy of a rod
/// with a loop is so flat that rounding would otherwise steer the flow.
const STEERED: f64 = 1e-10;
/// A polished landing nearer than this (relative, in u) is the fold itself: Newton's method finds a
/// double root only to about the square root of rounding.
const SAME: f64 = 1e-4;
/// Step control of the flow.
struct StepControl {
    /// Longest departure. Its square is an error, below exp(-lam), the force that moves a loop, up to lam = 10 or so.
    /// For larger lam the shortest departure is taken.
    departure: f64,
    /// Error per step, relative to u.
    tolerance: f64,
    /// Longest step of the fall, in time units.
    stride: f64,
}

/// Step control if only the landing counts: the flow must choose the basin, with errors below the departure. The
/// landing itself is polished.
const LANDING: StepControl = StepControl {
    departure: 3e-2,
    tolerance: 2e-3,
    stride: 4.5,
};
/// Step control if the shapes on the way are shown.
const SHOWN: StepControl = StepControl {
    departure: DEPARTURE,
    tolerance: 2e-4,
    stride: 0.5,
};
/// Speed |u_T|/|u| above which the rod falls: all rates of the flow are then similar, and steps are explicit, of
/// order 8, stable up to 6.
const FALLING: f64 = 1e-2;
/// Speed |u_T|/|u| below which a landing is tried.
const SLOW: f64 = 1e-5;
/// Speed |u_T|/|u| below which the flow is at rest, even next to the departure (a fold close to a cusp).
const AT_REST: f64 = 1e-13;
/// Coefficients of the Rosenbrock method, GAMMA on the diagonal: of the stages in the shape (A) and in their sum over
/// h (C), of the result and of its error. The fourth stage takes the flow from the third.
const GAMMA: f64 = 0.572_82;
const A2: f64 = 2.0;
const A3: [f64; 2] = [1.867_943_637_803_922, 0.234_444_971_139_915_6];
const C2: f64 = -7.137_615_036_412_31;
const C3: [f64; 2] = [2.580_708_087_951_457, 0.651_595_007_644_797_5];
const C4: [f64; 3] = [
    -2.137_148_994_382_534,
    -0.321_466_969_123_762_6,
    -0.694_974_250_178_177_9,
];
const RESULT: [f64; 4] = [
    2.255_570_073_418_735,
    0.287_049_326_218_679_2,
    0.435_317_943_184_018,
    1.093_502_252_409_163,
];
const ERROR: [f64; 4] = [
    -0.281_543_193_214_115_5,
    -0.072_761_991_249_349_2,
    -0.108_219_620_149_531_1,
    -1.093_502_252_409_163,
];
/// Largest growth of ln|u_T| in a step: the method follows growth by a rational function with a pole at 1/GAMMA.
const GROWTH: f64 = 0.5;
/// First step, as a multiple of the inverse of the fastest rate.
const FIRST: f64 = 2.0;
/// Most steps of a layer (twenty are usual), and bound of a step's length in time units.
const MOST_STEPS: usize = 1000;
const LONGEST: f64 = 1e15;

/// Landing of the elastica from the equilibrium `q` = (p, w) of `rods`, left in the chart direction `leaving`.
///
/// On the first fold curve the landing is well determined up to lam of about 14 (the same for step tolerances a
/// hundred times apart). Rods with a loop beyond that lie within exp(-lam) of their mirror image's basin: the landing
/// may be on either side. Above lam of about 20 the energy changes along the slide of the loop by less than rounding,
/// and doubles cannot determine the direction. A flow that stalls there is given the stable equilibrium of lowest
/// energy. On a fold between two unstable sheets (the second curve and beyond) the rod has several ways to leave, and
/// the landing is one of several.
///
/// # Errors
/// A flow that does not come to rest, without a stable equilibrium to fall back on.
pub(super) fn settle(
    rods: &impl Multivalued<2>,
    q: &Vector2<f64>,
    leaving: &Vector2<f64>,
) -> Result<Vector2<f64>> {
    flow(rods, q, leaving, &LANDING, &mut |_, _, _| ())
}

/// Shape in the viscous layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerShape {
    /// Time since the departure, in units of the viscosity of flexure over the bending stiffness.
    pub time: f64,
    /// Stored energy.
    pub elastic: f64,
    /// Sections (x, y, theta): the clamp, the Gauss nodes, the end.
    pub sections: Vec<[f64; 3]>,
}

/// Shapes of the layer of [`settle`] after every step, and the landing.
///
/// # Errors
/// As [`settle`].
pub(super) fn shapes(
    rods: &impl Multivalued<2>,
    q: &Vector2<f64>,
    leaving: &Vector2<f64>,
) -> Result<(Vec<LayerShape>, Vector2<f64>)> {
    let mut shapes = Vec::new();
    let landed = flow(rods, q, leaving, &SHOWN, &mut |rod, u, time| {
        shapes.push(LayerShape {
            time,
            elastic: 0.5 * rod.mean(u, u),
            sections: rod.sections(u),
        });
    })?;
    Ok((shapes, landed))
}

/// Integrates the flow to its landing; `seen` receives the curvature and the time after every step.
fn flow(
    rods: &impl Multivalued<2>,
    q: &Vector2<f64>,
    leaving: &Vector2<f64>,
    care: &StepControl,
    seen: &mut dyn FnMut(&DiscreteRod, &NodeValues, f64),
) -> Result<Vector2<f64>> {
    let start = Equilibrium::new(q[0], q[1])?;
    let rod = DiscreteRod::new(Vector2::new(start.x, start.y), nodes(start.lambda));
    let origin = rod.curvature(&start)?;
    let departure = (-0.5 * start.lambda)
        .exp()
        .min(care.departure)
        .max(DEPARTURE);
    let mut u = rod.departed(q, leaving, departure, &origin)?;
    let (mut h, mut time, mut before) = (FIRST, 0.0, None);
    let mut rejected = false;
    let lies_lower = |landed: &Vector2<f64>| {
        let at = rods.point(landed);
        at.is_some_and(|at| energy_allows_landing(start.energy, at.energy, ENERGY_ROUNDING))
    };
    seen(&rod, &u, time);
    for _ in 0..MOST_STEPS {
        let bent = rod.bent(&u);
        let (rate, n) = rod.rate(&u, &bent);
        let (size, speed) = (u.norm(), rate.norm());
        if !(speed.is_finite() && (1e-12..LONGEST).contains(&h)) {
            break;
        }
        if speed < SLOW * size
            && let Some((landed, shape)) = rod.polish_landing(rods, &u, n)
            && ((shape - &origin).norm() > SAME * size || speed < AT_REST * size)
            && lies_lower(&landed)
            && rods.index(&landed)? == 0
        {
            return Ok(landed);
        }
        if speed > FALLING * size {
            let Some((next, taken, then)) = rod.explicit_step(&u, &rate, h, care) else {
                break;
            };
            (u, time, h, before) = (next, time + taken, then, None);
            rejected = false;
            seen(&rod, &u, time);
            continue;
        }
        if let Some((then, step)) = before.take() {
            let growth = f64::ln(speed / then) / step;
            if growth * h > GROWTH {
                h = GROWTH / growth;
            }
        }
        let Some((next, error)) = rod.step(&u, &bent, &rate, n, h) else {
            h *= 0.1;
            continue;
        };
        let ratio = error / (care.tolerance * size);
        if ratio <= 1.0 {
            (u, time, before) = (next, time + h, Some((speed, h)));
            seen(&rod, &u, time);
        }
        let factor = 0.9 / ratio.max(1e-12).sqrt().sqrt();
        // The flow leaves the fold ever faster: a step that fails is far too long.
        let most = if rejected { 1.0 } else { 5.0 };
        rejected = !(ratio <= 1.0);
        h *= if factor > 0.2 { factor.min(most) } else { 0.2 };
    }
    rods.landings(q)?.into_iter().next().ok_or_else(|| {
        Error::no_convergence(format!(
            "the viscous layer from (p, w) = ({}, {}) does not settle; \
             the rod may rest on an unstable equilibrium: start from a slightly different pose, or choose another landing rule",
            q[0], q[1]
        ))
    })
}

/// Discretised rod with its end held.
struct DiscreteRod {
    held: Vector2<f64>,
    on: &'static GaussNodes,
}

/// Gauss nodes and integration matrices.
struct GaussNodes {
    s: NodeValues,
    weights: NodeValues,
    /// (integrate f)_i = int_0^{s_i} f.
    integrate: Matrix,
    /// (outer f)_i = int_0^{s_i} f - int_0^1 f, and its transpose.
    outer: Matrix,
    transposed: Matrix,
    /// integrate . outer.
    twice: DMatrix<f64>,
}

/// Shape of the rod.
struct ShapeAtNodes {
    cos: NodeValues,
    sin: NodeValues,
    /// Lever q(s) = J (r(1) - r(s)), by components.
    lever: [NodeValues; 2],
    tip: Vector2<f64>,
}

/// The flow linearised at a shape: I - gamma h J, factorised.
struct LayerJacobian<'a> {
    rod: &'a DiscreteRod,
    bent: &'a ShapeAtNodes,
    /// 1/(1 + gamma h).
    damped: f64,
    /// n . (cos, sin), times gamma h/(1 + gamma h).
    along: NodeValues,
    lu: Lu,
}

impl<'a> LayerJacobian<'a> {
    fn new(
        rod: &'a DiscreteRod,
        bent: &'a ShapeAtNodes,
        rate: &NodeValues,
        n: Vector2<f64>,
        gamma: f64,
    ) -> Option<Self> {
        let (damped, share) = (1.0 / (1.0 + gamma), gamma / (1.0 + gamma));
        let nodes = rate.len();
        let along = (&bent.cos * n[0] + &bent.sin * n[1]) * share;
        let [q_x, q_y] = &bent.lever;
        let weighed = [rate, q_x, q_y].map(|f| f.component_mul(&rod.on.weights));
        let [turning, by_x, by_y] = rod.on.transposed.times(weighed.each_ref());
        let swept = rod.on.integrate.times([q_x, q_y]);
        let mut matrix = DMatrix::identity(nodes + 2, nodes + 2);
        for (j, along) in along.iter().enumerate() {
            let (mut column, twice) = (matrix.column_mut(j), rod.on.twice.column(j));
            column.rows_mut(0, nodes).axpy(-along, &twice, 1.0);
        }
        for (j, (weighed, turned)) in [by_x, by_y].iter().zip([&bent.cos, &bent.sin]).enumerate() {
            let at = nodes + j;
            matrix.view_mut((0, at), (nodes, 1)).copy_from(&-&swept[j]);
            let row = weighed.component_mul(&along) + turning.component_mul(turned) * share;
            matrix
                .view_mut((at, 0), (1, nodes))
                .copy_from(&row.transpose());
            for (l, other) in bent.lever.iter().enumerate() {
                matrix[(at, nodes + l)] = rod.mean(&bent.lever[j], other);
            }
        }
        let lu = Lu::new(&matrix)?;
        Some(Self {
            rod,
            bent,
            damped,
            along,
            lu,
        })
    }

    /// Solution k of (I - gamma h J) k = b.
    fn solve(&self, b: &NodeValues) -> NodeValues {
        let nodes = b.len();
        let b = b * self.damped;
        let [swept] = self.rod.on.integrate.times([&b]);
        let mut found = swept.push(0.0).push(0.0);
        // A non-finite solution gives a non-finite error, and the step is refused.
        self.lu.solve(&mut found);
        let bends = found.rows(0, nodes).component_mul(&self.along);
        let [q_x, q_y] = &self.bent.lever;
        let ends = q_x * found[nodes] + q_y * found[nodes + 1];
        let [turned] = self.rod.on.outer.times([&bends]);
        b + turned + ends
    }
}

impl GaussNodes {
    /// Nodes of the count given, a multiple of 8; computed once.
    fn of(count: usize) -> &'static Self {
        static ALL: [OnceLock<GaussNodes>; MOST_NODES / 8] =
            [const { OnceLock::new() }; MOST_NODES / 8];
        ALL[count / 8 - 1].get_or_init(|| Self::new(count))
    }

    fn new(nodes: usize) -> Self {
        let rule = Rule::new(nodes);
        let (integrate, _) = rule.matrices();
        let s = NodeValues::from_vec(rule.nodes);
        let weights = NodeValues::from_vec(rule.weights);
        let outer = DMatrix::from_fn(nodes, nodes, |i, j| integrate[(i, j)] - weights[j]);
        Self {
            twice: &integrate * &outer,
            outer: Matrix::new(&outer),
            transposed: Matrix::new(&outer.transpose()),
            s,
            weights,
            integrate: Matrix::new(&integrate),
        }
    }
}

impl DiscreteRod {
    fn new(held: Vector2<f64>, nodes: usize) -> Self {
        let on = GaussNodes::of(nodes);
        Self { held, on }
    }

    /// Curvature u of an equilibrium at the nodes.
    fn curvature(&self, of: &Equilibrium) -> Result<NodeValues> {
        let mut u = NodeValues::zeros(self.on.s.len());
        for (value, &s) in u.iter_mut().zip(self.on.s.iter()) {
            *value = 2.0 * of.lambda * of.kappa * amplitude(of.p, of.lambda * (1.0 - s))?.sin();
        }
        Ok(u)
    }

    /// Shape at the distance `departure` from `q` along `leaving`. The distance is measured in u, since the chart is
    /// stretched without bound where a rod has a loop (dw = D dlam).
    fn departed(
        &self,
        q: &Vector2<f64>,
        leaving: &Vector2<f64>,
        departure: f64,
        origin: &NodeValues,
    ) -> Result<NodeValues> {
        let mut offset = departure / leaving.norm();
        let mut wanted = departure;
        for _ in 0..80 {
            let beyond = q + leaving * offset;
            let Ok(shape) = Equilibrium::new(beyond[0], beyond[1]).and_then(|e| self.curvature(&e))
            else {
                offset *= 0.1;
                continue;
            };
            let change = (&shape - origin).norm() / (wanted * origin.norm());
            if (0.5..2.0).contains(&change) {
                if wanted > 0.15
                    || self.rate(&shape, &self.bent(&shape)).0.norm() > STEERED * shape.norm()
                {
                    return Ok(shape);
                }
                wanted *= 2.0;
                offset *= 2.0;
            } else {
                offset /= change.clamp(0.1, 10.0);
            }
        }
        Err(Error::no_convergence(format!(
            "no shape next to the fold (p, w) = ({}, {}) could be resolved",
            q[0], q[1]
        )))
    }

    fn bent(&self, u: &NodeValues) -> ShapeAtNodes {
        let [theta] = self.on.integrate.times([u]);
        let [cos, sin] = cosines_and_sines(&theta);
        let [q_x, less_q_y] = self.on.outer.times([&sin, &cos]);
        ShapeAtNodes {
            lever: [q_x, -less_q_y],
            tip: Vector2::new(self.on.weights.dot(&cos), self.on.weights.dot(&sin)),
            cos,
            sin,
        }
    }

    /// Sections (x, y, theta) at the clamp, the nodes and the end of the rod of the curvature u.
    fn sections(&self, u: &NodeValues) -> Vec<[f64; 3]> {
        let [theta] = self.on.integrate.times([u]);
        let [cos, sin] = cosines_and_sines(&theta);
        let [x, y] = self.on.integrate.times([&cos, &sin]);
        let nodes = (0..u.len()).map(|i| [x[i], y[i], theta[i]]);
        let tip = [&cos, &sin, u].map(|f| self.on.weights.dot(f));
        let ends = std::iter::once([0.0; 3]).chain(nodes).chain([tip]);
        ends.collect()
    }

    /// Integral int a b along the rod.
    fn mean(&self, a: &NodeValues, b: &NodeValues) -> f64 {
        (0..a.len()).map(|i| self.on.weights[i] * a[i] * b[i]).sum()
    }

    /// One step of an L-stable Rosenbrock method of order 4 from u, given its rate and resultant; also the difference
    /// from the embedded result of order 3 (Hairer & Wanner, Solving ODEs II, Table IV.7.2, method 6).
    ///
    /// The linearised flow is k -> dq(k) . n - k + q . nu, dq = outer (n . (cos, sin) phi), phi = integrate k. Here
    /// nu keeps int q k contracting at rate 1 while q turns: its change is -int q k - int dq(k) . u_T. The unknowns
    /// are phi, whose matrix needs no product of matrices, and nu.
    fn step(
        &self,
        u: &NodeValues,
        bent: &ShapeAtNodes,
        rate: &NodeValues,
        n: Vector2<f64>,
        h: f64,
    ) -> Option<(NodeValues, f64)> {
        let solver = LayerJacobian::new(self, bent, rate, n, GAMMA * h)?;
        let solve = |b: &NodeValues| solver.solve(b) * (GAMMA * h);
        let flow = |u: &NodeValues| self.rate(u, &self.bent(u)).0;
        let u1 = solve(rate);
        let u2 = solve(&(flow(&(u + &u1 * A2)) + &u1 * (C2 / h)));
        let third = flow(&(u + &u1 * A3[0] + &u2 * A3[1]));
        let u3 = solve(&(&third + &u1 * (C3[0] / h) + &u2 * (C3[1] / h)));
        let u4 = solve(&(third + &u1 * (C4[0] / h) + &u2 * (C4[1] / h) + &u3 * (C4[2] / h)));
        let sum = |c: &[f64; 4]| &u1 * c[0] + &u2 * c[1] + &u3 * c[2] + &u4 * c[3];
        let error = sum(&ERROR).norm();
        error.is_finite().then(|| (u + sum(&RESULT), error))
    }

    /// One step of order 8 from u, given its rate, with the trial length `h`: the next u, the length taken, and the
    /// next trial length.
    fn explicit_step(
        &self,
        u: &NodeValues,
        rate: &NodeValues,
        h: f64,
        care: &StepControl,
    ) -> Option<(NodeValues, f64, f64)> {
        let size = u.norm_squared();
        let mut solver = Dop853::new(u.clone(), rate.clone(), h, care.tolerance);
        let mut step = solver.blank();
        let flow = |u: &NodeValues, out: &mut NodeValues| {
            *out = self.rate(u, &self.bent(u)).0;
            Some(())
        };
        let square =
            |error: &NodeValues, _: &NodeValues, _: &NodeValues| error.norm_squared() / size;
        let taken = solver.step_measured(flow, square, care.stride, &mut step);
        taken.ok()?;
        Some((step.to, step.h, solver.next_step()))
    }

    /// Flow and resultant (u_T, n); the resultant n holds the end.
    fn rate(&self, u: &NodeValues, bent: &ShapeAtNodes) -> (NodeValues, Vector2<f64>) {
        let [q_x, q_y] = &bent.lever;
        let [xx, xy, yy] = [(q_x, q_x), (q_x, q_y), (q_y, q_y)].map(|(a, b)| self.mean(a, b));
        // r_T(1) = int q u_T = held - tip: a drift correction draws the end back to its place.
        let demand = Vector2::new(self.mean(q_x, u), self.mean(q_y, u)) + (self.held - bent.tip);
        let n = Matrix2::new(xx, xy, xy, yy)
            .try_inverse()
            .map_or_else(Vector2::zeros, |inverse| inverse * demand);
        (q_x * n[0] + q_y * n[1] - u, n)
    }

    /// Equilibrium near a slow shape, polished so that its end is at the held place, and its curvature; `None` if the
    /// shape is not yet near an equilibrium.
    fn polish_landing(
        &self,
        rods: &impl Multivalued<2>,
        u: &NodeValues,
        n: Vector2<f64>,
    ) -> Option<(Vector2<f64>, NodeValues)> {
        let lam = n.norm().sqrt();
        let alpha = (-n[1]).atan2(-n[0]);
        let theta1 = self.on.weights.dot(u);
        let half = 0.5 * (theta1 - alpha);
        let p = (half.sin() / half.cos().abs()).asinh();
        let guess = amplitude(p, lam).ok()?;
        let landed = invert_near(rods, &self.held, &Vector2::new(p, guess), 1e-15).ok()?;
        let there = Equilibrium::new(landed.q[0], landed.q[1]).ok()?;
        let shape = self.curvature(&there).ok()?;
        // Reject a polish that has wandered off to another equilibrium.
        ((&shape - u).norm() < 1e-2 * u.norm()).then_some((landed.q, shape))
    }
}
