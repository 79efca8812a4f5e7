//! The massless, frictionless reference rod beside a rod with friction or mass, and the folds that it passes.
//!
//! A rod with friction or mass does not jump. A light rod, with neither, whose end is moved along the same
//! path does: it follows its sheet, falls at the fold and lands where the viscous layer takes it. This light
//! rod is followed from step to step, in the plane and in space ([`MasslessRod`]).

mod plane;
mod space;

pub use space::LightInSpace;

use super::contact::RodPartner;
use super::snap::{Snap, SnapEnd};
use super::{Ledger, State};
use nalgebra::{DMatrix, DVector, Isometry3, UnitQuaternion, Vector3};
use snaprod_systems::assembly::{BodyMotion, Configuration};
use snaprod_systems::math::se3::{halves, inverse_left_jacobian, join, left_jacobian};
use std::fmt;

/// Tolerances of the light rod along the path, and of the folds.
const FOLLOWED: f64 = 1e-9;
const FINE: f64 = 1e-12;
/// Longest piece of the path of the end over which the light rod is continued at once.
const PIECE: f64 = 0.01;
/// Most pieces of a step.
const PIECES: f64 = 200.0;
/// Change of the chart point over a piece, relative to 1 + its norm, beyond which the solution lies on another sheet.
const JUMP: f64 = 0.5;
/// Number of steps after which a lost light rod is searched for again.
const PATIENCE: usize = 50;
/// Overshoot, in lengths of a piece, up to which a fold beyond a piece belongs to the piece.
const SLACK: f64 = 0.05;
/// Most halvings of a piece in the search for its fold.
const HALVINGS: usize = 16;
/// Most Newton steps to a fold.
const NEWTON: usize = 40;
/// Chart increment, relative to 1 + its size, of the differences of the fold function. The gradient guides
/// the search; the result does not contain it.
const ASIDE: f64 = 1e-7;
/// Convergence of the search for a fold: a Newton step below the first, relative to 1 + the chart, or below
/// the second if rounding stalls it.
const FOUND: [f64; 2] = [1e-12, 1e-8];
/// Two shapes are alike if they differ by less than this part of the deviation from the unloaded shape.
const ALIKE: f64 = 0.5;
/// Number of sections at which shapes are compared.
const PLACES: usize = 17;

/// Arc lengths of the sections at which shapes are compared, in (0, 1).
fn places() -> Vec<f64> {
    let middle = |k: usize| (k as f64 + 0.5) / PLACES as f64;
    (0..PLACES).map(middle).collect()
}

/// A fold that the light rod has passed.
#[derive(Debug, Clone, PartialEq)]
pub struct LightSnap {
    /// The snap of the light rod.
    pub snap: Snap,
    /// Energies of the rod with friction or mass at that time. They are interpolated linearly over the step
    /// until the motion is asked for them.
    pub ledger: Ledger,
}

/// A time interval in which the light rod is unknown; folds in the interval are not reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnknownInterval {
    /// Number of the rod in an assembly.
    pub rod: usize,
    /// Start of the interval.
    pub from: f64,
    /// Time at which the light rod was found again; None if never.
    pub until: Option<f64>,
    /// Reason of the loss.
    pub why: LossReason,
}

/// Reason why a light rod is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossReason {
    /// No equilibrium resembles the rod at the start.
    Unlike,
    /// Neither the next equilibrium nor a fold was found.
    Unfollowed,
    /// The landing from the fold was not found.
    NoLanding,
    /// The rod touches itself or another rod, which the light rod does not.
    Touches,
}

impl fmt::Display for LossReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unlike => "no stable equilibrium was found whose shape is like that of the rod",
            Self::Unfollowed => {
                "neither its next equilibrium nor a fold was found, as where a rod is pulled straight"
            }
            Self::NoLanding => "it passes a fold from which no landing was found",
            Self::Touches => "the rod touches itself or another, which a light rod does not do here",
        })
    }
}

/// A rod without mass and friction, given by its equilibria with the end held at a pose seen from the clamp.
pub trait MasslessRod {
    /// Number of the rod in an assembly.
    fn number(&self) -> usize {
        0
    }

    /// Pose and twist of the end seen from the clamp.
    fn end(&self, state: &dyn State) -> BodyMotion {
        BodyMotion {
            pose: state.pose(),
            twist: state.twist(),
        }
    }

    /// Residual of the end under the chart point `q` at the site, to this tolerance; None outside the chart.
    fn held(&self, q: &DVector<f64>, site: &BodyMotion, tolerance: f64) -> Option<EndResidual>;

    /// The equilibrium at `site` by Newton's method from `guess`.
    fn inverted(
        &self,
        guess: &DVector<f64>,
        site: &BodyMotion,
        tolerance: f64,
    ) -> Option<DVector<f64>>;

    /// The stable equilibrium with a shape like that of the rod in `state`.
    fn matching_equilibrium(&self, state: &dyn State) -> Option<DVector<f64>>;

    /// The landing after `fold`.
    fn landing(&self, fold: &DVector<f64>, site: &BodyMotion) -> Option<DVector<f64>>;

    /// One end of a snap, and the energy from which the released energy is computed.
    fn snap_end(&self, q: &DVector<f64>, site: &BodyMotion) -> Option<(SnapEnd, f64)>;

    /// Distance between two poses, over the degrees of freedom that are held.
    fn apart(&self, a: &BodyMotion, b: &BodyMotion) -> f64;

    /// Pose and velocity of the end in the form a snap reports, and the configuration.
    fn report_end(
        &self,
        q: &DVector<f64>,
        site: &BodyMotion,
    ) -> (DVector<f64>, DVector<f64>, Option<Configuration>);
}

/// Residual of a light rod whose end is to be at a given site.
pub struct EndResidual {
    /// Difference: site minus end.
    pub gap: DVector<f64>,
    /// Derivative of the end by the chart point.
    pub jacobian: DMatrix<f64>,
    /// Velocity of the site.
    pub drive: DVector<f64>,
    /// Fold function; zero at folds.
    pub fold: f64,
    /// True for the alternative chart: fold functions of different charts cannot be compared.
    pub other: bool,
}

/// The light rod that accompanies a rod with friction or mass, in the frame of the clamp.
pub struct LightReference {
    rod: Box<dyn MasslessRod>,
    /// None while the light rod is lost, as next to a straight rod in the plane.
    at: Option<LightEquilibrium>,
    lost: Vec<UnknownInterval>,
    last: EndSample,
    patience: usize,
    /// True once the rod has touched a rod.
    touched: bool,
}

/// An equilibrium of the light rod.
#[derive(Debug, Clone)]
struct LightEquilibrium {
    /// Chart point.
    q: DVector<f64>,
    /// Sign of the fold function (true: positive), and whether the chart is the alternative one.
    side: (bool, bool),
}

impl LightEquilibrium {
    fn new(rod: &dyn MasslessRod, q: DVector<f64>, site: &BodyMotion) -> Option<Self> {
        let held = rod.held(&q, site, FOLLOWED)?;
        Some(Self {
            q,
            side: (held.fold > 0.0, held.other),
        })
    }

    /// The equilibrium with a shape like that of the rod in `state`.
    fn matching_equilibrium(rod: &dyn MasslessRod, state: &dyn State) -> Option<Self> {
        Self::new(rod, rod.matching_equilibrium(state)?, &rod.end(state))
    }
}

/// Motion of the end at one moment.
#[derive(Debug, Clone, Copy)]
struct EndSample {
    t: f64,
    place: BodyMotion,
    ledger: Ledger,
}

impl EndSample {
    fn new(rod: &dyn MasslessRod, state: &dyn State) -> Self {
        Self {
            t: state.time(),
            place: rod.end(state),
            ledger: state.ledger(),
        }
    }

    /// Pose of the end at the fraction `x` of the path to `next`, with the twist per unit of `x`. Position
    /// and rotation vector are cubic in `x`, by their values and rates at both ends.
    fn towards(&self, next: &Self, x: f64) -> BodyMotion {
        let h = next.t - self.t;
        let cubic = |d: Vector3<f64>, a: Vector3<f64>, b: Vector3<f64>| {
            let (c2, c3) = (d * 3.0 - a * 2.0 - b, a + b - d * 2.0);
            (
                (a + (c2 + c3 * x) * x) * x,
                a + (c2 * 2.0 + c3 * (3.0 * x)) * x,
            )
        };
        let (here, there) = (&self.place.pose, &next.place.pose);
        let [(w0, v0), (w1, v1)] = [self, next].map(|seen| halves(&(seen.place.twist * h)));
        let turn = (there.rotation * here.rotation.inverse()).scaled_axis();
        let (moved, rate) = cubic(there.translation.vector - here.translation.vector, v0, v1);
        let (turned, turning) = cubic(turn, w0, inverse_left_jacobian(&turn) * w1);
        BodyMotion {
            pose: Isometry3::from_parts(
                (here.translation.vector + moved).into(),
                UnitQuaternion::from_scaled_axis(turned) * here.rotation,
            ),
            twist: join(&(left_jacobian(&turned) * turning), &rate),
        }
    }
}

impl LightReference {
    /// The light `rod` that starts from the equilibrium resembling `state`.
    pub fn new(rod: Box<dyn MasslessRod>, state: &dyn State) -> Self {
        let mut beside = Self {
            at: LightEquilibrium::matching_equilibrium(&*rod, state),
            lost: Vec::new(),
            last: EndSample::new(&*rod, state),
            rod,
            patience: PATIENCE,
            touched: false,
        };
        if beside.at.is_none() {
            beside.lose(state.time(), LossReason::Unlike);
        }
        beside
    }

    /// Intervals in which the light rod was unknown.
    pub fn lost(&self) -> &[UnknownInterval] {
        &self.lost
    }

    fn lose(&mut self, from: f64, why: LossReason) {
        self.patience = PATIENCE;
        self.lost.push(UnknownInterval {
            rod: self.rod.number(),
            from,
            until: None,
            why,
        });
    }

    /// True if the rod touches itself or another rod in `state`.
    fn touches(&self, state: &dyn State) -> bool {
        let own = self.rod.number();
        let contacts = state.contact().into_iter().flat_map(|all| &all.rods);
        let mut of_rods = contacts.filter_map(|at| match at.partner {
            RodPartner::Rod { rod, .. } => Some([at.rod, rod]),
            RodPartner::Obstacle(_) => None,
        });
        of_rods.any(|rods| rods.contains(&own))
    }

    /// Restarts the light rod at the equilibrium resembling `state`, if one is found.
    pub fn land(&mut self, state: &dyn State) {
        if self.touched {
            return;
        }
        let Some(like) = LightEquilibrium::matching_equilibrium(&*self.rod, state) else {
            return;
        };
        if self.at.is_none()
            && let Some(lost) = self.lost.last_mut()
        {
            lost.until = Some(state.time());
        }
        self.at = Some(like);
    }

    /// Follows the end through a step to `state`; returns the folds passed in the step.
    pub fn step(&mut self, state: &dyn State) -> Vec<LightSnap> {
        let next = EndSample::new(&*self.rod, state);
        let last = std::mem::replace(&mut self.last, next);
        let mut passed = Vec::new();
        if self.touched {
            return passed;
        }
        if self.touches(state) {
            self.touched = true;
            if self.at.take().is_some() {
                self.lose(last.t, LossReason::Touches);
            }
            return passed;
        }
        let Some(mut at) = self.at.take() else {
            self.patience = self.patience.saturating_sub(1);
            if self.patience == 0 {
                self.patience = PATIENCE;
                self.land(state);
            }
            return passed;
        };
        let way = EndPath {
            rod: &*self.rod,
            ends: (last, next),
        };
        let length = self.rod.apart(&last.place, &next.place);
        let pieces = (length / PIECE).ceil().clamp(1.0, PIECES);
        for k in 0..pieces as usize {
            let piece = [k as f64 / pieces, (k + 1) as f64 / pieces];
            match way.cross_piece(at, piece, &mut passed) {
                Ok(there) => at = there,
                Err((x, why)) => {
                    self.lose(last.t + x * (next.t - last.t), why);
                    return passed;
                }
            }
        }
        self.at = Some(at);
        passed
    }
}

/// Outcome of a piece that Newton's method does not bridge.
enum PieceOutcome {
    /// The fold is still ahead; the equilibrium at the end of the piece.
    Before(LightEquilibrium),
    /// The fold was passed: its chart point, and the fraction of the path.
    Fold(DVector<f64>, f64),
}

/// The path of the end of the light rod through one step.
struct EndPath<'a> {
    rod: &'a dyn MasslessRod,
    ends: (EndSample, EndSample),
}

impl EndPath<'_> {
    fn place(&self, x: f64) -> BodyMotion {
        self.ends.0.towards(&self.ends.1, x)
    }

    /// The equilibrium at the end of a piece of the path; its folds are added to `passed`. On failure the
    /// fraction at which the rod was lost, and why.
    fn cross_piece(
        &self,
        at: LightEquilibrium,
        [from, to]: [f64; 2],
        passed: &mut Vec<LightSnap>,
    ) -> Result<LightEquilibrium, (f64, LossReason)> {
        if let Some(there) = self.followed(&at, to) {
            return Ok(there);
        }
        match self.resolve_piece(at, from, to) {
            Some(PieceOutcome::Before(there)) => Ok(there),
            Some(PieceOutcome::Fold(fold, x)) => {
                let (crossed, landed) = self.snap_at(&fold, x).ok_or((x, LossReason::NoLanding))?;
                passed.push(crossed);
                self.followed(&landed, to)
                    .ok_or((x, LossReason::Unfollowed))
            }
            None => Err((from, LossReason::Unfollowed)),
        }
    }

    /// The equilibrium at the fraction `to` of the path, on the same sheet as `at`.
    fn followed(&self, at: &LightEquilibrium, to: f64) -> Option<LightEquilibrium> {
        self.solve_near(at, &at.q, to)
    }

    /// The equilibrium at the fraction `to` on the sheet of `at`, sought from `guess`.
    fn solve_near(
        &self,
        at: &LightEquilibrium,
        guess: &DVector<f64>,
        to: f64,
    ) -> Option<LightEquilibrium> {
        let site = self.place(to);
        let found = self.rod.inverted(guess, &site, FOLLOWED)?;
        let near = (&found - &at.q).norm() < JUMP * (1.0 + at.q.norm());
        let found = LightEquilibrium::new(self.rod, found, &site)?;
        let same = found.side.1 != at.side.1 || found.side.0 == at.side.0;
        (near && same).then_some(found)
    }

    /// Treats a piece over which Newton's method fails between the fractions `from` and `end`. If the fold is
    /// not found either, the rod is followed closer to it by bisection.
    fn resolve_piece(
        &self,
        mut at: LightEquilibrium,
        mut from: f64,
        end: f64,
    ) -> Option<PieceOutcome> {
        let mut to = end;
        for _ in 0..HALVINGS {
            let slack = SLACK * (to - from);
            let fold = self.fold_near(&at.q, from, to);
            if let Some((fold, x)) = fold.filter(|fold| fold.1 >= from - slack) {
                // Near the fold the chart varies as the root of the path that is left; Newton's method from
                // the last point would overshoot.
                let left = (x - to) / (x - from);
                let guess = &fold + (&at.q - &fold) * left.max(0.0).sqrt();
                if x > to
                    && let Some(found) = self.solve_near(&at, &guess, to)
                {
                    if to == end {
                        return Some(PieceOutcome::Before(found));
                    }
                    (at, from, to) = (found, to, end);
                    continue;
                }
                if x <= to + slack {
                    return Some(PieceOutcome::Fold(fold, x));
                }
            }
            let middle = 0.5 * (from + to);
            match self.followed(&at, middle) {
                Some(nearer) => (at, from) = (nearer, middle),
                None => to = middle,
            }
        }
        None
    }

    /// The fold near `q`, by Newton's method on end pose and fold function together, regular at a fold that
    /// is crossed. Returns the chart point and the fraction of the path.
    fn fold_near(&self, q: &DVector<f64>, from: f64, to: f64) -> Option<(DVector<f64>, f64)> {
        let n = q.len();
        let unit = self.rod.held(q, &self.place(from), FINE)?;
        let span = to - from;
        // Residual as a function of chart point and fraction of the piece.
        let system = |q: &DVector<f64>, part: f64| -> Option<(EndResidual, DVector<f64>)> {
            let mut held = self.rod.held(q, &self.place(from + part * span), FINE)?;
            if held.other != unit.other {
                return None;
            }
            held.fold /= unit.fold;
            let mut residual = held.gap.clone().insert_row(n, 0.0);
            residual[n] = held.fold;
            Some((held, residual))
        };
        let (mut q, mut part) = (q.clone(), 0.0);
        let (mut held, mut residual) = system(&q, part)?;
        let mut before = f64::INFINITY;
        for _ in 0..NEWTON {
            let mut matrix = DMatrix::zeros(n + 1, n + 1);
            matrix.view_mut((0, 0), (n, n)).copy_from(&held.jacobian);
            matrix
                .view_mut((0, n), (n, 1))
                .copy_from(&(&held.drive * -span));
            for k in 0..n {
                let mut aside = q.clone();
                aside[k] += ASIDE * (1.0 + q[k].abs());
                let change = system(&aside, part)?.0.fold - held.fold;
                matrix[(n, k)] = -change / (aside[k] - q[k]);
            }
            let step = matrix.full_piv_lu().solve(&residual)?;
            let [along, on] = [step.rows(0, n).norm(), step[n].abs()];
            let scale = 1.0 + q.norm();
            // On a short path the pose of the end determines few digits of the fraction.
            let moved = on * (held.drive.norm() * span.abs()).min(1.0);
            let length = (along / scale).max(moved);
            if length <= FOUND[0] || length <= FOUND[1] && length > 0.3 * before {
                return Some((&q + step.rows(0, n), from + (part + step[n]) * span));
            }
            before = length;
            // Trust region: the step is bounded by the curvature of the chart.
            let mut share = (JUMP * scale / along).min(4.0 / on).min(1.0);
            let size = residual.norm();
            loop {
                let trial = (&q + step.rows(0, n) * share, part + step[n] * share);
                match system(&trial.0, trial.1) {
                    Some(there) if there.1.norm() < size || share == 1.0 && size < 1e-8 => {
                        (q, part) = trial;
                        (held, residual) = there;
                        break;
                    }
                    _ => share *= 0.5,
                }
                if share < 1e-4 {
                    return None;
                }
            }
        }
        None
    }

    /// The snap of the light rod at `fold`, and the equilibrium of the landing.
    fn snap_at(&self, fold: &DVector<f64>, x: f64) -> Option<(LightSnap, LightEquilibrium)> {
        let (last, next) = &self.ends;
        let h = next.t - last.t;
        let mut site = self.place(x);
        site.twist /= h;
        let landed = self.rod.landing(fold, &site)?;
        let (from, before) = self.rod.snap_end(fold, &site)?;
        let (to, after) = self.rod.snap_end(&landed, &site)?;
        let (pose, velocity, moving) = self.rod.report_end(fold, &site);
        let snap = Snap {
            base: UnitQuaternion::identity(),
            t: last.t + x * h,
            time_error: f64::NAN,
            pose,
            velocity,
            released: before - after,
            from,
            to,
            rod: self.rod.number(),
            joints: Vec::new(),
            choices: None,
            reached: Some(true),
            moving: moving.map(Box::new),
        };
        let ledger = last.ledger.between(&next.ledger, x);
        Some((
            LightSnap { snap, ledger },
            LightEquilibrium::new(self.rod, landed, &site)?,
        ))
    }
}
