//! Opening of the motion of a straight elastic rod that is let go (theory 2.3).
//!
//! At the straight rod the position of the mass does not determine the force: 1 - x = c(N) y^2, and the pull N comes
//! from the motion along the rod, which is slaved to the motion across (`x'' = (f_x - N)/m`). Close to it the mass
//! also can shake along the rod, at a frequency of order 1/y. But of all motions from rest at (1, 0) only one keeps
//! the pull bounded as t -> 0, and that one is smooth. With `y = O(t^k)`, k = 1 for a velocity across and 2 for a
//! load across,
//! ```text
//! 1 - x = t^2k Z(t),   y = t^k Y(t),   N = f_x + m (1 - x)'' = f_x + t^(2k-2) m M(t)
//! ```
//! with Z, Y, M analytic: from rest N = f_x + 3 (3/5) m a^2 t^2 + .. under the acceleration a; with a velocity v
//! across N(0) = f_x + 2 c(N(0)) m v^2. (1 - x)'' and y'' are found at Gauss points of [0, until] by collocation,
//! with Newton's method and the derivative c'(N) of the law of shortening. From `until` on the chart takes over:
//! there a shaking would be slow enough to be followed, and there is none.
//!
//! A rod of small mass m moves across as its end does times w(s), the shape of the beam under N: (mu + m int w^2 ds)
//! y'' = .. + m int w (g - e) ds (theory 2.9 of a straight rod; e is the acceleration of the clamp). The part of its
//! inertia along the rod is smaller by the order y^2. That part is left to the chart, so such an opening ends where y
//! is small.

use super::sheet::Phase;
use nalgebra::{DMatrix, DVector, Vector2};
use snaprod_systems::body::{EndMotion, PointMass};
use snaprod_systems::elastica::Equilibrium;
use snaprod_systems::elastica::straight_beam::{
    AlmostStraight, EULER, MOST_PULL, unstable_push_error,
};
use snaprod_systems::error::{Error, Message, Quantity, Result};
use snaprod_systems::manifold::{DeflectionInertia, DeflectionState};
use snaprod_systems::math::gauss::{Rule, legendre};

/// Collocation points.
const POINTS: usize = 16;
/// Relative size of a velocity component that counts as rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Longest opening, in units of sqrt(m L^3/EI): a fraction of the period of the rod's vibration across, 3.6.
const LONGEST: f64 = 0.5;
/// Largest of the last two Legendre coefficients of M and of y'', relative to the largest of all.
const TAIL: f64 = 1e-13;
/// Convergence of Newton's method: the change of all values, relative to the largest.
const SETTLED: f64 = 1e-13;
/// Largest deflection of the end for a handover to the motion next to the straight rod, for a rod of known mass.
const HANDED_OVER: f64 = 1e-4;
/// Newton rounds after which the derivatives c'(N) are kept.
const SLOPES: usize = 3;
/// Parts of the opening whose state may stand for t = 0, where the chart has none: the first in which the rod
/// has bent enough to differ from the straight one.
const INITIAL: [f64; 4] = [1e-40, 1e-20, 1e-10, 1e-5];

/// The motion of a straight rod from t = 0 to `until`.
pub struct Opening {
    /// End of the opening: the motion goes on in the chart.
    pub until: f64,
    body: PointMass<2>,
    velocity: f64,
    /// k of y = O(t^k).
    order: i32,
    rods: AlmostStraight,
    rule: Rule,
    /// Legendre coefficients from values at the Gauss points.
    modes: DMatrix<f64>,
    /// M at the Gauss points of [0, until].
    inward: DVector<f64>,
    /// y'' at the Gauss points.
    across: DVector<f64>,
    /// Powers of the time-dependent forces and of drag at the Gauss points.
    power: DVector<f64>,
    loss: DVector<f64>,
}

impl Opening {
    /// The opening of a motion from the straight rod with a velocity across, which is to last until `duration`.
    ///
    /// # Errors
    /// A velocity along the rod; nothing that drives the mass across; a push beyond Euler's load; a pull
    /// beyond the bound; loads or speeds for which no opening of sensible length is found.
    pub fn new(body: &PointMass<2>, velocity: Vector2<f64>, duration: f64) -> Result<Self> {
        let v = velocity[1];
        // A velocity across, seen from a turned clamp, has rounding along the rod.
        let along = velocity[0].abs() > ROUNDING * v.abs();
        if along || !velocity.iter().all(|v| v.is_finite()) {
            let given =
                Message::from("velocity = ").list(velocity.as_slice(), |_| Quantity::Velocity);
            return Err(Error::domain(given.words(
                ": a straight rod lets its end move across only, so the first component must be 0; give a velocity along the \
                 rod to a rod that is bent a little (lambda and kappa in [start])",
            )));
        }
        let straight = Vector2::new(1.0, 0.0);
        let loads = |t: f64| {
            let free = body.action(t, &straight, &Vector2::new(0.0, v), &Vector2::zeros());
            free.acceleration * body.mass()
        };
        let longest = LONGEST * body.mass().sqrt();
        let mut until = longest.min(body.next_break(0.0)).min(duration);
        let at_once = loads(0.0);
        if body.rod().is_some() {
            let speed = v
                .abs()
                .max((HANDED_OVER * at_once[1].abs() / body.mass()).sqrt());
            until = until.min(2.0 * HANDED_OVER / speed);
        }
        let idle = |i: usize| loads(until * i as f64 / POINTS as f64)[1] == 0.0;
        if v == 0.0 && (0..=POINTS).all(idle) {
            if at_once[0] < -EULER {
                return Err(unstable_push_error(-at_once[0]));
            }
            return Err(Error::domain(
                "nothing acts across the straight rod at t = 0, so it stays as it is; give a load across (gravity or dead in \
                 [loads]), a velocity across, or a rod that is bent a little (lambda and kappa in [start])",
            ));
        }
        // A load that only grows from 0 makes y of third order in time, which this form represents as well.
        let order = if v == 0.0 { 2 } else { 1 };
        let pull = initial_pull(body, at_once[0], v)?;
        for _ in 0..60 {
            let rule = Rule::new(POINTS);
            let start = |i: usize, _| loads(until * rule.nodes[i])[1] / body.mass();
            let mut opening = Self {
                until,
                body: body.clone(),
                velocity: v,
                order,
                rods: AlmostStraight::new(2.0 * pull),
                modes: rule.matrices().1,
                inward: DVector::zeros(POINTS),
                across: DVector::from_fn(POINTS, start),
                power: DVector::zeros(POINTS),
                loss: DVector::zeros(POINTS),
                rule,
            };
            if order == 1 {
                opening.inward.fill((pull - at_once[0]) / body.mass());
            }
            let part = if opening.settle().is_some() && opening.resolved() {
                match opening.too_high() {
                    None => return Ok(opening),
                    Some(times) => 0.99 * times.powf(-1.0 / f64::from(order)),
                }
            } else {
                0.6
            };
            until *= part;
        }
        Err(Error::no_convergence(
            Message::from("the motion of the straight rod under the load ")
                .list(at_once.as_slice(), |_| Quantity::Force)
                .words(" with the velocity ")
                .number(v, Quantity::Velocity)
                .words(
                    " could not be begun: it changes too fast at t = 0; begin with a rod that is bent a little (lambda and \
                     kappa in [start])",
                ),
        ))
    }

    /// Weights of the values at the points in the value at `part` in [0, 1] of the opening.
    fn interpolate(&self, part: f64) -> DVector<f64> {
        self.modes
            .tr_mul(&legendre(2.0 * part - 1.0, POINTS).into())
    }

    /// Weights of the values at the points in `int_0^1 weight(x) f(x part) dx`.
    fn moment(&self, part: f64, weight: impl Fn(f64) -> f64) -> DVector<f64> {
        let mut row = DVector::zeros(POINTS);
        for (&x, &w) in self.rule.nodes.iter().zip(&self.rule.weights) {
            row += self.interpolate(part * x) * (w * weight(x));
        }
        row
    }

    /// The exponent of t in N - f_x.
    fn power_of_pull(&self) -> i32 {
        2 * self.order - 2
    }

    /// Newton's method on M, with y'' following; None if it does not settle.
    fn settle(&mut self) -> Option<()> {
        let n = self.power_of_pull();
        let parts = self.rule.nodes.clone();
        let rows = |weight: fn(f64, i32) -> f64, exponent: i32| {
            let rows = parts
                .iter()
                .map(|&part| self.moment(part, |x| weight(x, exponent)).transpose());
            DMatrix::from_rows(&rows.collect::<Vec<_>>())
        };
        // Integrated twice and once, divided by the resulting powers of t.
        let twice = rows(|x, n| (1.0 - x) * x.powi(n), n);
        let once = rows(|x, n| x.powi(n), n);
        let rise = rows(|x, n| (1.0 - x) * x.powi(n), 0);
        let speed = rows(|x, n| x.powi(n), 0);
        let mass = self.body.mass();
        let mut before = f64::INFINITY;
        // c'(N) at the points.
        let mut soft = [0.0; POINTS];
        for round in 0..50 {
            let (short, inward) = (&twice * &self.inward, &once * &self.inward);
            let (lift, gain) = (&rise * &self.across, &speed * &self.across);
            let mut gap = DVector::zeros(POINTS);
            let mut slopes = twice.clone();
            let mut across = DVector::zeros(POINTS);
            for i in 0..POINTS {
                let t = self.until * parts[i];
                let y = t * (self.velocity + t * lift[i]);
                let v = Vector2::new(-inward[i] * t.powi(n + 1), self.velocity + t * gain[i]);
                let pose = Vector2::new(1.0 - short[i] * t.powi(n + 2), y);
                let pull = self.pull(t, &pose, &v, self.inward[i])?;
                let bent = self.rods.at(pull, y)?;
                let force = Vector2::new(-bent.pull, -bent.across);
                let mut action = self.body.action(t, &pose, &v, &force);
                self.with_rod(t, &pose, &v, bent.pull, &mut action)?;
                across[i] = action.acceleration[1];
                (self.power[i], self.loss[i]) = (action.power, action.loss);
                gap[i] = short[i] - bent.one_minus_x / t.powi(n + 2);
                if round < SLOPES {
                    soft[i] = self.rods.shortening(bent.pull)?.1;
                }
                let height = y / t.powi(self.order);
                slopes[(i, i)] -= soft[i] * height * height * mass * t.powi(n);
            }
            let step = slopes.lu().solve(&gap)?;
            self.inward -= &step;
            let relative =
                |change: &DVector<f64>, size: f64| change.amax() / size.max(f64::MIN_POSITIVE);
            let change = relative(&step, self.inward.amax())
                .max(relative(&(&across - &self.across), across.amax()));
            self.across = across;
            if change <= SETTLED {
                return Some(());
            }
            // A change that no longer decreases is rounding.
            if !(change < 1e3) || round > 8 && change >= before {
                return (change <= 100.0 * SETTLED).then_some(());
            }
            before = change;
        }
        None
    }

    /// The pull on the rod at the time t for an end at `pose` with velocity v, where M = `inward`; None
    /// outside the range of validity.
    fn pull(&self, t: f64, pose: &Vector2<f64>, v: &Vector2<f64>, inward: f64) -> Option<f64> {
        let loads = self.body.action(t, pose, v, &Vector2::zeros()).acceleration;
        let pull = self.body.mass() * (loads[0] + inward * t.powi(self.power_of_pull()));
        (-EULER < pull && pull < MOST_PULL).then_some(pull)
    }

    /// The rod's part in the motion at the time t, for an end that moves across at `height` with `speed`.
    /// None for a rod without mass or outside the range of validity. The rate of the pull counts in
    /// proportion to the deflection, which is small.
    fn of_mass(&self, t: f64, pull: f64, height: f64, speed: f64) -> Option<DeflectionInertia> {
        let frame = self.body.support().map(|support| support.at(t));
        let at = DeflectionState {
            pull,
            tightening: 0.0,
            height,
            speed,
        };
        self.body.rod()?.deflection_inertia(frame.as_ref(), &at)
    }

    /// The motion across of body and rod together, and the power of a moving clamp on both; None outside the
    /// range of validity.
    fn with_rod(
        &self,
        t: f64,
        pose: &Vector2<f64>,
        v: &Vector2<f64>,
        pull: f64,
        action: &mut EndMotion<2>,
    ) -> Option<()> {
        if self.body.rod().is_none() {
            return Some(());
        }
        let felt = self.of_mass(t, pull, pose[1], v[1])?;
        let (mass, alone) = (self.body.mass(), action.acceleration[1]);
        let across = (mass * alone + felt.force) / (mass + felt.mass);
        action.acceleration[1] = across;
        if let Some(support) = self.body.support() {
            let borne = mass * (across - alone) * support.at(t).velocity_of_fixed_point(pose)[1];
            action.power += borne + felt.pull * across + felt.power;
        }
        Some(())
    }

    /// Kinetic and potential energy of the rod at the time t; 0 for a rod without mass or outside the range
    /// of validity.
    pub fn of_rod(&self, t: f64) -> [f64; 2] {
        let found = self
            .state(t)
            .and_then(|(pose, v, pull)| self.of_mass(t, pull, pose[1], v[1]));
        found.map_or([0.0; 2], |felt| felt.energies)
    }

    /// Ratio of the final deflection to the largest one for a handover, if above 1; for a rod of known mass.
    fn too_high(&self) -> Option<f64> {
        self.body.rod()?;
        let (pose, ..) = self.state(self.until)?;
        let times = pose[1].abs() / HANDED_OVER;
        (times > 1.0).then_some(times)
    }

    /// True if the polynomials are of a degree high enough.
    fn resolved(&self) -> bool {
        [&self.inward, &self.across].iter().all(|values| {
            let modes = &self.modes * *values;
            modes.rows(POINTS - 2, 2).amax() <= TAIL * modes.amax()
        })
    }

    /// The state at the time t in [0, until]. None would be a fault of the program.
    pub fn at(&self, t: f64) -> Option<Phase<2>> {
        let shown = INITIAL.map(|part| t.max(part * self.until));
        shown.into_iter().find_map(|shown| self.shown(t, shown))
    }

    /// Integral up to the time t of the values at the Gauss points, times `weight`.
    fn integral(&self, t: f64, values: &DVector<f64>, weight: impl Fn(f64) -> f64) -> f64 {
        self.moment(t / self.until, weight).dot(values)
    }

    /// Position and velocity of the end at the time t, and the pull; None outside the range of validity.
    fn state(&self, t: f64) -> Option<(Vector2<f64>, Vector2<f64>, f64)> {
        let n = self.power_of_pull();
        let y = t * (self.velocity + t * self.integral(t, &self.across, |x| 1.0 - x));
        let short = t.powi(n + 2) * self.integral(t, &self.inward, |x| (1.0 - x) * x.powi(n));
        let v = Vector2::new(
            -t.powi(n + 1) * self.integral(t, &self.inward, |x| x.powi(n)),
            self.velocity + t * self.integral(t, &self.across, |_| 1.0),
        );
        let pose = Vector2::new(1.0 - short, y);
        let inward = self.interpolate(t / self.until).dot(&self.inward);
        Some((pose, v, self.pull(t, &pose, &v, inward)?))
    }

    /// The state at the time t, with the chart point of the time `shown`; None if that has no chart point.
    fn shown(&self, t: f64, shown: f64) -> Option<Phase<2>> {
        let (pose, _, pull) = self.state(shown)?;
        let [p, w] = self.rods.at(pull, pose[1])?.chart();
        Equilibrium::new(p, w).ok()?;
        Some(Phase {
            q: Vector2::new(p, w),
            v: self.state(t)?.1,
            t,
            work: t * self.integral(t, &self.power, |_| 1.0),
            drag_loss: t * self.integral(t, &self.loss, |_| 1.0),
        })
    }
}

/// The pull at t = 0 under the load `along` the rod and with the velocity v across: N = f_x + 2 c(N) m v^2.
fn initial_pull(body: &PointMass<2>, along: f64, v: f64) -> Result<f64> {
    let swing = body.mass() * v * v;
    // c lies between 1/2 and 0.62.
    let mut pull = along + 1.2 * swing;
    if !(pull < MOST_PULL) {
        return Err(Error::domain(
            Message::from("load and velocity pull the straight rod with ")
                .number(pull, Quantity::Force)
                .words("; a start from the straight rod is served below ")
                .number(MOST_PULL, Quantity::Force)
                .words(
                    ": lower them, or begin with a rod that is bent a little (lambda and kappa in [start])",
                ),
        ));
    }
    let rods = AlmostStraight::new(pull);
    for _ in 0..40 {
        let Some((c, _)) = (pull > -EULER).then(|| rods.shortening(pull)).flatten() else {
            return Err(unstable_push_error(-pull));
        };
        pull = along + 2.0 * c * swing;
    }
    Ok(pull)
}
