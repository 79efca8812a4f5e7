//! Initial guess for a taut rod: straight along the force, with the pendulum's boundary layers at both ends.

use super::interval::{FrameAndCouple, RodUnderForce, STAGES, Scheme};
use super::mesh::{first_step, places};
use super::{INTERVALS, Shape, TURNED, Tip};
use crate::error::{Error, Result};
use crate::math::se3::{
    Turn, conjugate, exponential, frame, halves, identity, product, rotation_vector,
};
use crate::rod::distributed_load::{LoadMoment, LoadState};
use crate::rod::ivp::{LineState, Wrench, loaded_sections, sections};
use nalgebra::{Rotation3, UnitQuaternion, Vector3, Vector6};
use std::f64::consts::TAU;

/// Most intervals of a guess; more than those of the rod.
const LIMIT: usize = 10 * INTERVALS;

/// Tolerance of an integration from the base.
const FINE: f64 = 1e-12;

/// Miss of the tip, in radians or couples over sqrt|n|, beyond which a base wrench gives no guess.
const MAX_TIP_MISS: f64 = 0.3;

/// Boundary layer: the rod turns from its held end into the direction of the force.
struct Layer {
    /// Axis and angle of the turn of the end's d3 into the force.
    axis: Vector3<f64>,
    angle: f64,
    lam: f64,
    flexure: f64,
}

impl Layer {
    /// Layer at an end with the d3 `direction`.
    fn new(direction: &Vector3<f64>, n: &Vector3<f64>, flexure: f64) -> Self {
        let across = direction.cross(n);
        let angle = across.norm().atan2(direction.dot(n));
        let axis = across.try_normalize(1e-12 * n.norm()).unwrap_or_else(|| {
            // d3 along the force, or against it: any axis across.
            let aside = Vector3::ith(n.iamin(), 1.0);
            n.cross(&aside).normalize()
        });
        Self {
            axis,
            angle,
            lam: (flexure * n.norm()).sqrt(),
            flexure,
        }
    }

    /// Layer at an end along the pull with the force on the arm `arm`: the layer bears the rest of that force's
    /// couple.
    fn under_force(arm: &Vector3<f64>, n: &Vector3<f64>, flexure: f64) -> Option<Self> {
        let across = n.cross(arm);
        let axis = across.try_normalize(1e-12 * n.norm() * arm.norm())?;
        let whole = across.norm().atan2(arm.dot(n));
        let lam = (flexure * n.norm()).sqrt();
        let couple = |angle: f64| 2.0 * lam * (0.5 * angle).sin() / flexure;
        let (mut low, mut high) = (0.0, whole);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if couple(middle) < n.norm() * arm.norm() * (whole - middle).sin() {
                low = middle
            } else {
                high = middle
            }
        }
        Some(Self {
            axis,
            angle: low,
            lam,
            flexure,
        })
    }

    /// Remaining angle at the distance `way` from the end: the pendulum's separatrix.
    fn remaining_angle(&self, way: f64) -> f64 {
        4.0 * ((0.25 * self.angle).tan() * (-self.lam * way).exp()).atan()
    }

    fn turn(&self, angle: f64) -> Turn {
        exponential(&(self.axis * angle))
    }

    /// Couple of the layer: B times its rate of turn.
    fn couple(&self, angle: f64) -> Vector3<f64> {
        self.axis * (2.0 * self.lam * (0.5 * angle).sin() / self.flexure)
    }
}

impl RodUnderForce<'_> {
    /// Places of the nodes.
    ///
    /// # Errors
    /// More nodes than a rod may have.
    fn places(&self, lam: f64, tolerance: f64, longest: f64) -> Result<Vec<f64>> {
        if !(longest * LIMIT as f64 > 1.0) {
            return Err(Error::no_convergence(format!(
                "a taut rod whose sections turn so fast along it needs intervals of {longest:.0e} of its length, more than {LIMIT} of them; lower the couple on its \
                 end, or its twist at rest"
            )));
        }
        let pieces = self.law.pieces();
        let breaks = pieces.iter().skip(1).map(|(from, _)| *from);
        let loads = self.weight.iter().flat_map(|weight| weight.breaks());
        Ok(places(
            lam.max(1.0),
            breaks.chain(loads),
            tolerance,
            longest,
        ))
    }

    /// Places of the nodes with layers at both ends, and in between at most `longest` apart.
    pub(super) fn layered_places(&self, tolerance: f64, longest: f64) -> Result<Vec<f64>> {
        let (lam, _) = self.lam(0.0, &Vector6::zeros())?;
        self.places(lam, tolerance, longest)
    }

    /// Places of the nodes without layers, for sections that turn at the rate `lam`.
    pub(super) fn even_places(&self, lam: f64, tolerance: f64) -> Result<Vec<f64>> {
        self.places(lam, tolerance, first_step(tolerance) / lam.max(1.0))
    }

    /// The rod integrated from the base wrench `b`, if the integration succeeds and ends near `tip`.
    pub(super) fn integrate_from_base(
        &self,
        b: &Wrench,
        tip: &Tip,
        tolerance: f64,
    ) -> Option<Shape> {
        let places = self.even_places(self.lam(0.0, b).ok()?.0, tolerance).ok()?;
        let inner = &Scheme::get().nodes;
        let mut at = vec![0.0];
        for pair in places.windows(2) {
            at.extend(inner.map(|x| pair[0] + x * (pair[1] - pair[0])));
            at.push(pair[1]);
        }
        let n = halves(b).1;
        let all = match self.weight {
            None => frames_and_couples(&sections::<0>(self.law, b, FINE, &at).ok()?, b, &()),
            Some(weight) => frames_and_couples(
                &loaded_sections::<0, LoadMoment<0>>(self.law, weight, b, FINE, &at).ok()?,
                b,
                weight,
            ),
        };
        let last = all.last()?;
        let missed = match tip {
            Tip::Turned(target) => rotation_vector(&(target * frame(&last.turn).transpose())),
            Tip::Loaded { couple, arm } => {
                (couple + (frame(&last.turn) * arm).cross(&self.force(1.0)) - last.m) / self.kappa
            }
        };
        (missed.norm() < MAX_TIP_MISS).then(|| Shape {
            nodes: all.iter().step_by(STAGES + 1).copied().collect(),
            stages: all
                .chunks_exact(STAGES + 1)
                .map(|chunk| std::array::from_fn(|i| chunk[1 + i]))
                .collect(),
            places,
            n,
            tolerance,
        })
    }

    /// sqrt(c |n|) of the softer flexure at `s`, and the mean flexure.
    fn lam(&self, s: f64, local: &Wrench) -> Result<(f64, f64)> {
        let c = self.law.inverse(s, local)?.compliance.matrix();
        let most = self.n.norm().max(self.force(1.0).norm());
        let lam = (c[(0, 0)].max(c[(1, 1)]) * most).sqrt();
        Ok((lam, 0.5 * (c[(0, 0)] + c[(1, 1)])))
    }

    /// Guess: straight along the force between the layers. Under a load along the rod the force turns, and the guess
    /// is a string.
    pub(super) fn guess_shape(&self, b: &Wrench, tip: &Tip, tolerance: f64) -> Result<Shape> {
        let (m0, n) = halves(b);
        let (pull, at_end) = (n.normalize(), self.force(1.0));
        let about = match tip {
            Tip::Turned(_) => m0.dot(&pull),
            Tip::Loaded { couple, .. } => couple.dot(&pull),
        };
        // The middle of the rod, and the steepest layer.
        let local = Vector6::new(0.0, 0.0, about, 0.0, 0.0, n.norm());
        let middle = self.law.inverse(0.5, &local)?;
        let [(steep, near), (steeper, far)] = [self.lam(0.0, &local)?, self.lam(1.0, &local)?];
        let lam = steep.max(steeper);
        let first = Layer::new(&Vector3::z(), &n, near);
        let straight = first.turn(first.angle);
        let twisted = middle.strain[2];
        // Rotation of the force at the base into the force at a place.
        let swung = |s: f64| match self.weight {
            None => identity(),
            Some(_) => {
                let string = Layer::new(&pull, &self.force(s), near);
                string.turn(string.angle)
            }
        };
        let (last, twist) = match tip {
            Tip::Loaded { arm, .. } => {
                let end = product(&exponential(&(pull * twisted)), &straight);
                let end = product(&swung(1.0), &end);
                (
                    Layer::under_force(&(frame(&end) * arm), &at_end, far),
                    twisted,
                )
            }
            Tip::Turned(target) => {
                let layer = Layer::new(&target.column(2).into_owned(), &at_end, far);
                let wanted = UnitQuaternion::from_rotation_matrix(
                    &Rotation3::from_matrix_unchecked(*target),
                );
                let end = product(
                    &layer.turn(layer.angle),
                    &Turn::new(wanted.w, wanted.i, wanted.j, wanted.k),
                );
                let between = product(&end, &conjugate(&product(&swung(1.0), &straight)));
                // Remaining rotation about the pull.
                let pull = at_end.normalize();
                let along = Vector3::new(between[1], between[2], between[3]).dot(&pull);
                let angle = 2.0 * along.atan2(between[0]);
                let angle = angle - TAU * (angle / TAU).round();
                let whole = ((twisted - angle) / TAU).round();
                (Some(layer), angle + TAU * whole)
            }
        };
        let torsion = middle.compliance.matrix()[(2, 2)];
        let rest = self.law.inverse(0.5, &Vector6::zeros())?.strain[2];
        let couple = match tip {
            Tip::Turned(_) if torsion > 0.0 => (twist - rest) / torsion,
            _ => about,
        };
        let section = |s: f64| {
            let mut turn = product(&exponential(&(pull * (twist * s))), &straight);
            turn = product(&swung(s), &turn);
            let mut m = self.force(s).normalize() * couple;
            if let Some(layer) = &last {
                let left = layer.remaining_angle(1.0 - s);
                turn = product(&layer.turn(-left), &turn);
                m -= layer.couple(left);
            }
            let left = first.remaining_angle(s);
            turn = product(&first.turn(-left), &turn);
            m += first.couple(left);
            FrameAndCouple { turn, m }
        };
        let places = self.places(lam, tolerance, TURNED / twist.abs())?;
        let mut shape = Shape::from_sections(places, n, tolerance, section);
        shape.nodes[0] = FrameAndCouple {
            turn: identity(),
            ..shape.nodes[0]
        };
        Ok(shape)
    }
}

/// Frames and couples of sections.
fn frames_and_couples<C: LoadState<0>>(
    found: &[LineState<0, C>],
    b: &Wrench,
    load: &C::Load,
) -> Vec<FrameAndCouple> {
    let section = |at: &LineState<0, C>| FrameAndCouple {
        turn: at.turn(),
        m: at.resultants(b, load).0,
    };
    found.iter().map(section).collect()
}
