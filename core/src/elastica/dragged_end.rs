//! Rod whose end is dragged quasistatically: equilibria between snaps.

use super::viscous_landing::LayerShape;
use super::{Elastica, Equilibrium};
use crate::error::{Error, Message, Quantity, Result};
use crate::manifold::{EquilibriumManifold, Multivalued, adjugate_times, fold_kernel, invert_near};
use nalgebra::Vector2;

/// Longest stride of the end.
const STRIDE: f64 = 0.02;
/// Shortest stride of the end: where none this short succeeds the rod is at a fold, up to the square root of this.
const LEAST: f64 = 1e-12;
/// Largest distance of a stride's shape from the tangent's prediction, relative to the change. Next to a fold, where
/// the shape changes as the square root of the remaining way, this allows half of that way.
const FORETOLD: f64 = 0.3;
/// Most snaps of one move; more indicate a failed computation.
const MOST_SNAPS: usize = 16;

/// Planar elastica with its end in a hand. The stable equilibrium is followed to the fold where it ends, and the
/// viscous layer leads from there to the next one (theory 2.6). Units: length 1, bending stiffness 1.
///
/// ```
/// # use snaprod_core as snaprod;
/// use snaprod::elastica::{DraggedRod, Elastica};
/// use snaprod::manifold::Multivalued;
/// use nalgebra::Vector2;
///
/// // Of the three stable rods with their end at (0.5, -0.35) the last has a loop; drawn up, it loses it.
/// let stable = Elastica.stable_at(&Vector2::new(0.5, -0.35))?;
/// let mut rod = DraggedRod::new(stable[2])?;
/// let snaps = rod.drag_to(&Vector2::new(0.5, 0.35))?;
/// assert_eq!(snaps.len(), 1);
/// assert!((snaps[0].place.y + 0.067).abs() < 1e-3 && snaps[0].released > 20.0);
/// # Ok::<(), snaprod::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct DraggedRod {
    q: Vector2<f64>,
    place: Vector2<f64>,
}

/// Snap of a dragged rod.
#[derive(Debug, Clone, PartialEq)]
pub struct DraggedSnap {
    /// Chart point (p, w) of the fold, to six digits.
    pub from: Vector2<f64>,
    /// Chart point of the landing.
    pub to: Vector2<f64>,
    /// Position of the end.
    pub place: Vector2<f64>,
    /// Energy dissipated by the layer: elastic energy before minus after.
    pub released: f64,
    /// Shapes of the layer, the first next to the fold; empty if only the landing is known.
    pub shapes: Vec<LayerShape>,
}

impl DraggedRod {
    /// The rod at the stable equilibrium `q` = (p, w).
    ///
    /// # Errors
    /// A point outside the chart, or one that is not stable.
    pub fn new(q: Vector2<f64>) -> Result<Self> {
        let at = Equilibrium::new(q[0], q[1])?;
        let index = Elastica.index(&q)?;
        if index > 0 {
            return Err(Error::domain(format!(
                "the equilibrium (p, w) = ({}, {}) has the index {index}; a rod that is dragged must be stable: give one of index 0",
                q[0], q[1]
            )));
        }
        Ok(Self {
            q,
            place: Vector2::new(at.x, at.y),
        })
    }

    /// Chart point (p, w) of the rod.
    pub fn chart(&self) -> Vector2<f64> {
        self.q
    }

    /// Position of the end.
    pub fn place(&self) -> Vector2<f64> {
        self.place
    }

    /// Drags the end to `target` along a straight line; returns the snaps in order.
    ///
    /// # Errors
    /// A target outside the disc |r| < 1, which no bent rod reaches, a layer that does not settle, or a loop drawn
    /// too tight for double precision. The rod then stays at the last equilibrium.
    pub fn drag_to(&mut self, target: &Vector2<f64>) -> Result<Vec<DraggedSnap>> {
        if !(target.norm() < 1.0) {
            return Err(Error::domain(
                Message::from("the end cannot be dragged to ")
                    .list(target.as_slice(), |_| Quantity::Length)
                    .words(": its distance from the clamp must be below ")
                    .number(1.0, Quantity::Length)
                    .words(", the length of the rod"),
            ));
        }
        let mut snaps = Vec::new();
        while let Some(direction) = self.glide(target)? {
            Elastica.check_resolution(&self.q)?;
            if snaps.len() == MOST_SNAPS {
                return Err(Error::no_convergence(format!(
                    "the rod snapped {MOST_SNAPS} times on one way; drag it in shorter ones"
                )));
            }
            snaps.push(self.snap(&direction)?);
        }
        Ok(snaps)
    }

    /// Follows the equilibrium towards `target`; `None` on arrival. At a fold, the direction in the chart in which the
    /// rod came to the fold.
    fn glide(&mut self, target: &Vector2<f64>) -> Result<Option<Vector2<f64>>> {
        let (mut stride, mut direction) = (STRIDE, Vector2::zeros());
        loop {
            let way = target - self.place;
            let left = way.norm();
            if left == 0.0 {
                return Ok(None);
            }
            let goal = if stride < left {
                self.place + way * (stride / left)
            } else {
                *target
            };
            let at = Elastica.point(&self.q).ok_or_else(continuation_error)?;
            let (det, scaled) = adjugate_times(&at.jacobian, &(goal - at.pose));
            let foretold = scaled / det;
            match self.continue_to(&goal, &foretold) {
                Some(next) => {
                    (direction, self.q, self.place) = (next - self.q, next, goal);
                    stride = (2.0 * stride).min(STRIDE);
                }
                None if stride > LEAST => stride = 0.5 * stride.min(left),
                // A rod that starts at the fold leaves along the predicted step.
                None if direction == Vector2::zeros() => return Ok(Some(foretold)),
                None => return Ok(Some(direction)),
            }
        }
    }

    /// Stable equilibrium at `goal` that continues the current one; `foretold` is the tangent's chart step.
    fn continue_to(&self, goal: &Vector2<f64>, foretold: &Vector2<f64>) -> Option<Vector2<f64>> {
        let guess = self.q + foretold;
        let next = invert_near(&Elastica, goal, &guess, 1e-15).ok()?.q;
        let rounding = 1e-12 * (1.0 + self.q.norm());
        let near = (next - guess).norm() <= FORETOLD * foretold.norm() + rounding;
        (near && Elastica.index(&next).ok()? == 0).then_some(next)
    }

    /// Snaps from the fold approached in the chart direction `direction`.
    fn snap(&mut self, direction: &Vector2<f64>) -> Result<DraggedSnap> {
        let fold = Elastica.point(&self.q).ok_or_else(continuation_error)?;
        let kernel = fold_kernel(&fold.jacobian)?;
        let leaving = kernel * kernel.dot(direction).signum();
        let (shapes, to) = match Elastica.layer(&self.q, &leaving) {
            Ok(found) => found,
            Err(_) => (Vec::new(), Elastica.settle(&self.q, &leaving)?),
        };
        let landing = Elastica.point(&to).ok_or_else(continuation_error)?;
        let from = std::mem::replace(&mut self.q, to);
        Ok(DraggedSnap {
            from,
            to,
            place: self.place,
            released: fold.energy - landing.energy,
            shapes,
        })
    }
}

fn continuation_error() -> Error {
    Error::domain("the rod has left its chart")
}
