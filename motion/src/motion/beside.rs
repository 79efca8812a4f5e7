//! The light rod beside one with friction or mass: which folds of the equilibria the motion of the end passes.
//!
//! A rod with friction or mass does not jump. The rod without either, whose end is moved as this one's is, does: it follows its sheet, falls
//! at the fold and lands where the viscous layer takes it. That is what is followed here, from step to step, at the cost of some microseconds each.

use super::snap::{LandingRule, Snap, SnapEnd, landings};
use super::{Ledger, State};
use crate::elastica::chart::ChartPoint;
use crate::elastica::{Elastica, Equilibrium, fold_on_path};
use crate::manifold::{EquilibriumManifold, Multivalued, invert_near};
use crate::math::se3::halves;
use nalgebra::{DVector, UnitQuaternion, Vector2};

/// The light rod is followed over pieces of the way no longer than this.
const PIECE: f64 = 0.01;
/// Most pieces of a step.
const PIECES: f64 = 200.0;
/// Change of the chart point over a piece beyond which another sheet was met.
const JUMP: f64 = 0.5;
/// Places at which shapes are compared, and the largest difference of the curvature relative to it.
const PLACES: usize = 17;
const ALIKE: f64 = 0.5;
/// Steps after which a rod that was lost is looked for again.
const PATIENCE: usize = 50;

/// A fold that the light rod has passed.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossed {
    /// What the light rod does there.
    pub snap: Snap,
    /// The energies of the rod that is not light, at that time.
    pub ledger: Ledger,
}

/// The light elastica beside a planar rod, in the frame of a clamp that stands.
#[derive(Debug, Clone)]
pub struct Beside {
    /// (p, w); None while it is lost, as next to a straight rod.
    at: Option<Vector2<f64>>,
    last: Seen,
    patience: usize,
}

/// The end at one moment.
#[derive(Debug, Clone, Copy)]
struct Seen {
    t: f64,
    place: Vector2<f64>,
    velocity: Vector2<f64>,
    ledger: Ledger,
}

impl Seen {
    fn new(state: &dyn State) -> Self {
        Self {
            t: state.time(),
            place: state.pose().translation.vector.xy(),
            velocity: halves(&state.twist()).1.xy(),
            ledger: state.ledger(),
        }
    }

    /// Place and its derivative by the fraction of the way to `next`: cubic, by places and velocities at its ends.
    fn towards(&self, next: &Self, x: f64) -> (Vector2<f64>, Vector2<f64>) {
        let h = next.t - self.t;
        let (d, a, b) = (
            next.place - self.place,
            self.velocity * h,
            next.velocity * h,
        );
        let (c2, c3) = (d * 3.0 - a * 2.0 - b, a + b - d * 2.0);
        let place = self.place + (a + (c2 + c3 * x) * x) * x;
        (place, a + (c2 * 2.0 + c3 * (3.0 * x)) * x)
    }
}

impl Beside {
    /// Beside a rod in this state.
    pub fn new(state: &dyn State) -> Self {
        Self {
            at: near(state),
            last: Seen::new(state),
            patience: PATIENCE,
        }
    }

    /// The equilibrium that the rod has come to be in, where that is known.
    pub fn land(&mut self, state: &dyn State) {
        self.at = state
            .equilibrium()
            .map(|labels| Vector2::new(labels.p, labels.w))
            .or(self.at);
    }

    /// Follows the end through a step to `state`; the folds that were passed in it.
    pub fn step(&mut self, state: &dyn State) -> Vec<Crossed> {
        let next = Seen::new(state);
        let last = std::mem::replace(&mut self.last, next);
        let mut passed = Vec::new();
        if self.at.is_none() {
            self.patience = self.patience.saturating_sub(1);
            if self.patience == 0 {
                self.patience = PATIENCE;
                self.at = near(state);
            }
            return passed;
        }
        let pieces = ((next.place - last.place).norm() / PIECE)
            .ceil()
            .clamp(1.0, PIECES);
        for k in 0..pieces as usize {
            let [from, to] = [k as f64 / pieces, (k + 1) as f64 / pieces];
            let Some(q) = self.at else { break };
            let (place, _) = last.towards(&next, to);
            self.at = follow(&q, &place);
            if self.at.is_some() {
                continue;
            }
            let Some((edge, x)) = fold_ahead(&q, (&last, &next), from) else {
                continue;
            };
            // Next to a fold the rod nears it as the root of the way that is left, and Newton's method from the last place is thrown over it.
            let left = (x - to) / (x - from);
            if left > 0.0 && x > to {
                self.at = follow(&(edge + (q - edge) * left.sqrt()), &place);
            }
            if self.at.is_none()
                && let Some((crossed, landed)) = fold(&edge, x, (&last, &next), [from, to])
            {
                passed.push(crossed);
                self.at = follow(&landed, &place);
            }
        }
        passed
    }
}

/// The stable equilibrium at `place` on the same sheet as `q`.
fn follow(q: &Vector2<f64>, place: &Vector2<f64>) -> Option<Vector2<f64>> {
    let found = invert_near(&Elastica, place, q, 1e-12).ok()?.q;
    let side = |q: &Vector2<f64>| ChartPoint::new(q[0], q[1]).fold_function() > 0.0;
    ((found - q).norm() < JUMP * (1.0 + q.norm()) && side(&found) == side(q)).then_some(found)
}

/// The fold that lies ahead of the rod `q` on the way, and the fraction of the way.
fn fold_ahead(
    q: &Vector2<f64>,
    (last, next): (&Seen, &Seen),
    from: f64,
) -> Option<(Vector2<f64>, f64)> {
    let path = |x: f64| {
        let (place, rate) = last.towards(next, x);
        (place.into(), rate.into())
    };
    let lam = ChartPoint::new(q[0], q[1]).integrals.lam;
    let (at, x) = fold_on_path((q[0], lam), &path, from)?;
    Some((Vector2::new(at.p, at.w), x))
}

/// The snap of the light rod from the fold at `x`, and where it lands; None if the fold is not passed between these fractions.
fn fold(
    fold: &Vector2<f64>,
    x: f64,
    (last, next): (&Seen, &Seen),
    [from, to]: [f64; 2],
) -> Option<(Crossed, Vector2<f64>)> {
    let slack = 0.05 * (to - from);
    if !(x > from - slack && x < to + slack) {
        return None;
    }
    let (landed, _) = landings(&Elastica, fold, LandingRule::Viscous).ok()?;
    let landed = *landed.first()?;
    let end = |q: &Vector2<f64>, index: usize| {
        Some(SnapEnd {
            q: DVector::from_column_slice(q.as_slice()),
            sheet: Some(Elastica.sheet(q)),
            index,
            elastic: Elastica.point(q)?.energy,
        })
    };
    let (from, to) = (end(fold, 0)?, end(&landed, 0)?);
    let h = next.t - last.t;
    let (place, rate) = last.towards(next, x);
    let snap = Snap {
        base: UnitQuaternion::identity(),
        t: last.t + x * h,
        time_error: f64::NAN,
        pose: DVector::from_column_slice(place.as_slice()),
        velocity: DVector::from_column_slice((rate / h).as_slice()),
        released: from.elastic - to.elastic,
        from,
        to,
        rod: 0,
        choices: None,
        moving: None,
    };
    let ledger = last.ledger.between(&next.ledger, x);
    Some((Crossed { snap, ledger }, landed))
}

/// The stable equilibrium of the end whose shape is nearest to that of the rod; None if there is none that is like it.
fn near(state: &dyn State) -> Option<Vector2<f64>> {
    if let Some(labels) = state.equilibrium() {
        return Some(Vector2::new(labels.p, labels.w));
    }
    let place = state.pose().translation.vector.xy();
    let places: Vec<f64> = (0..PLACES)
        .map(|k| (k as f64 + 0.5) / PLACES as f64)
        .collect();
    let strains = state.strains_at(&places);
    let size: f64 = strains.iter().map(|e| e[0] * e[0]).sum();
    let apart = |q: &Vector2<f64>| -> Option<f64> {
        let there = Equilibrium::new(q[0], q[1]).ok()?;
        let mut sum = 0.0;
        for (s, e) in places.iter().zip(&strains) {
            sum += (there.section(*s).ok()?.curvature - e[0]).powi(2);
        }
        Some(sum / size)
    };
    let stable = Elastica.stable_at(&place).ok()?;
    let each = stable.into_iter().filter_map(|q| Some((apart(&q)?, q)));
    let (apart, q) = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (apart < ALIKE * ALIKE).then_some(q)
}
