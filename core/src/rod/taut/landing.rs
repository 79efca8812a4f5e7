//! Landing of a taut rod that has lost its equilibrium with its ends held: the flow along the fast layer, as for
//! slack rods,
//! ```text
//! e_T = e^(Q w) - e,       e^ the inverse law, Q w the resultants of the wrench w that holds the end,
//! ```
//! in implicit steps: with e_old the strains before a step of the length h those after it are
//! ```text
//! e = (e_old + h e^(Q w))/(1 + h),
//! ```
//! A step is thus a rod of another law, softer and bent, whose equilibrium is collocated as any other. The turn of
//! the rod bounds the length of a step, whatever lam: a strong pull makes the layer stiff, and a loop slides along a
//! taut rod at a rate of exp(-lam).

use super::interval::{FrameAndCouple, RodUnderForce, STAGES, Scheme};
use super::{Shape, Solved, Spring, Tip};
use crate::error::{Error, Result};
use crate::math::se3::{frame, rotation_vector};
use crate::rod::scaled_law::Response;
use crate::section::Strain;
use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3, Vector6};
use std::borrow::Cow;

/// First, shortest and longest step, in units of the layer's time.
const FIRST: f64 = 0.03;
const SHORTEST: f64 = 1e-9;
const LONGEST: f64 = 1e9;
/// Largest turn of a section in a step, in radians; if all turn less than a third of it, the next step may be longer.
const TURN: f64 = 0.15;
/// Most steps of a landing.
const STEPS: usize = 3_000;
/// Largest changes of a strain in the push off the fold, times lam.
const PUSHES: [f64; 3] = [0.03, 0.003, 0.0003];
/// Part of the push at which a returning flow is judged to have left the fold to the wrong side.
const BACK: f64 = 0.5;
/// Multiple of the push beyond which the flow has left the fold.
const AWAY: f64 = 3.0;
/// Strain rates over lam below which the flow is near an equilibrium, which is then solved for; and the largest
/// distance, in radians, at which the solution counts as that equilibrium.
const NEAR: f64 = 1e-3;
const SAME: f64 = 0.1;
/// Largest relative change of the rates in a step longer than `FIRST`; rates below `STILL` times lam count as that.
const CHANGE: f64 = 0.5;
const STILL: f64 = 1e-7;
/// Tolerance of the implicit steps.
const TOLERANCE: f64 = 1e-7;
/// Meshes are made for lam times this factor: shapes on the way are steeper.
const STEEPER: f64 = 1.5;
/// Stiffness of the spring beside the landed end, over the string's.
const BESIDE: f64 = 16.0;
/// Least distance of the ends in the stiffness of the string.
const NEAREST: f64 = 0.05;

/// A shape on the way through the fast layer: the stored energy, and sections from the base to the end.
pub type Fallen = (f64, Vec<Isometry3<f64>>);

/// The strains of a rod along a mesh.
#[derive(Debug, Clone)]
struct Strains {
    places: Vec<f64>,
    stages: Vec<[Strain; STAGES]>,
}

/// An implicit step of the layer: the strains before the step, and its length.
#[derive(Debug)]
pub(super) struct LayerStep {
    before: Strains,
    step: f64,
}

impl Strains {
    fn at(&self, s: f64) -> Strain {
        let after = self.places.partition_point(|place| *place <= s);
        let k = after.clamp(1, self.stages.len()) - 1;
        let (from, to) = (self.places[k], self.places[k + 1]);
        let (x, nodes) = ((s - from) / (to - from), &Scheme::get().nodes);
        let mut found = Strain::zeros();
        for (i, strain) in self.stages[k].iter().enumerate() {
            let others = (0..STAGES).filter(|j| *j != i);
            let by: f64 = others
                .map(|j| (x - nodes[j]) / (nodes[i] - nodes[j]))
                .product();
            found += strain * by;
        }
        found
    }

    /// a + by (b - c).
    fn plus(&self, by: f64, b: &Self, c: &Self) -> Self {
        let all = self.stages.iter().zip(&b.stages).zip(&c.stages);
        Self {
            places: self.places.clone(),
            stages: all
                .map(|((a, b), c)| std::array::from_fn(|i| a[i] + (b[i] - c[i]) * by))
                .collect(),
        }
    }

    fn difference(&self, other: &Self) -> Self {
        let all = self.stages.iter().zip(&other.stages);
        Self {
            places: self.places.clone(),
            stages: all
                .map(|(a, b)| std::array::from_fn(|i| a[i] - b[i]))
                .collect(),
        }
    }

    /// The largest strain.
    fn size(&self) -> f64 {
        let all = self.stages.iter().flatten();
        all.map(|e| e.amax()).fold(0.0, f64::max)
    }

    /// Largest rate of turn of the sections along s.
    fn steepest(&self) -> f64 {
        let rates = self
            .stages
            .iter()
            .flatten()
            .map(|e| e.fixed_rows::<3>(0).norm());
        rates.fold(0.0, f64::max)
    }

    fn distance(&self, other: &Self) -> f64 {
        self.difference(other).size()
    }
}

impl LayerStep {
    /// Response of the step's modified law, `inverse` being that of the law itself.
    pub fn modify_response<'a>(&self, s: f64, mut inverse: Response<'a>) -> Response<'a> {
        let part = self.step / (1.0 + self.step);
        inverse.strain = inverse.strain * part + self.before.at(s) / (1.0 + self.step);
        let compliance = inverse.compliance.into_owned().times(part);
        inverse.compliance = Cow::Owned(compliance);
        inverse
    }
}

impl Shape {
    /// This shape interpolated on another mesh.
    fn interpolated_on(&self, places: &[f64]) -> Self {
        let nodes = &Scheme::get().nodes;
        let at = |s: f64| {
            let mut section = self.at(s);
            section.turn /= section.turn.norm();
            section
        };
        Self {
            nodes: places.iter().map(|s| at(*s)).collect(),
            stages: places
                .windows(2)
                .map(|pair| nodes.map(|x| at(pair[0] + x * (pair[1] - pair[0]))))
                .collect(),
            places: places.to_vec(),
            ..self.clone()
        }
    }

    /// Largest turn of a section between two shapes on the same mesh.
    fn largest_turn(&self, other: &Self) -> f64 {
        let turn = |a: &FrameAndCouple, b: &FrameAndCouple| {
            rotation_vector(&(frame(&a.turn) * frame(&b.turn).transpose())).norm()
        };
        let all = self.stages.iter().zip(&other.stages);
        all.flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| turn(a, b)))
            .fold(0.0, f64::max)
    }
}

impl RodUnderForce<'_> {
    /// Strains of the law under the resultants of a shape.
    fn strains(&self, shape: &Shape) -> Result<Strains> {
        let nodes = &Scheme::get().nodes;
        let mut stages = Vec::with_capacity(shape.stages.len());
        for (pair, sections) in shape.places.windows(2).zip(&shape.stages) {
            let mut strains = [Strain::zeros(); STAGES];
            for ((x, at), strain) in nodes.iter().zip(sections).zip(&mut strains) {
                let turn = frame(&at.turn);
                let s = pair[0] + x * (pair[1] - pair[0]);
                let n = self.with_force(&shape.n).force(s);
                let (m, n) = (turn.tr_mul(&at.m), turn.tr_mul(&n));
                let local = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
                *strain = self.inverse(s, &local)?.strain;
            }
            stages.push(strains);
        }
        Ok(Strains {
            places: shape.places.clone(),
            stages,
        })
    }

    /// Rod at rest after it leaves the fold `shape` towards one of the rods `beside`, its end held in its place `at`
    /// by `tip`. Of two ways down, the lower one is taken. With `shown`, the shapes after every step are returned
    /// too.
    ///
    /// # Errors
    /// A law that refuses; a flow that does not settle.
    pub(super) fn land_from_fold(
        &self,
        shape: &Shape,
        beside: [&Shape; 2],
        tip: &Tip,
        at: Vector3<f64>,
        tolerance: f64,
        shown: bool,
    ) -> Result<(Vec<Fallen>, Solved, Spring)> {
        let lam = self.pull_number();
        // Sections turn by their strains, and shapes on the way may be steeper than the fold's.
        let turning = self.strains(shape)?.steepest();
        let places = self.even_places(STEEPER * lam.max(turning), TOLERANCE)?;
        let [here, ahead, behind] =
            [shape, beside[0], beside[1]].map(|shape| shape.interpolated_on(&places));
        let fold = self.strains(&here)?;
        let (ahead, behind) = (self.strains(&ahead)?, self.strains(&behind)?);
        let unit = lam / ahead.distance(&behind);
        let mut found: Option<(Vec<Fallen>, Solved, Spring)> = None;
        for size in PUSHES {
            for side in [size, -size] {
                let pushed = fold.plus(side * unit, &ahead, &behind);
                let mut way = Vec::new();
                // A shape that cannot be shown does not stop the landing.
                let mut seen = |shape: &Shape, strains: &Strains| {
                    if shown {
                        way.extend(self.fallen_shape(shape, strains));
                    }
                };
                let rested = self.flow(&here, &fold, pushed, tip, at, &mut seen);
                let rest = |shape| self.rest(shape, tip, at, tolerance).ok();
                let Some((solved, spring)) = rested.and_then(rest) else {
                    continue;
                };
                if found
                    .as_ref()
                    .is_none_or(|(_, lowest, _)| solved.whole_energy() < lowest.whole_energy())
                {
                    found = Some((way, solved, spring));
                }
            }
            if found.is_some() {
                break;
            }
        }
        found.ok_or_else(|| {
            Error::no_convergence(format!(
                "the taut rod that left its fold does not come to rest within {STEPS} steps of the fast layer"
            ))
        })
    }

    /// Equilibrium near a shape, with the end held at `at` as `tip` says.
    pub(super) fn rest(
        &self,
        shape: Shape,
        tip: &Tip,
        at: Vector3<f64>,
        tolerance: f64,
    ) -> Result<(Solved, Spring)> {
        let held = Spring {
            stiffness: f64::INFINITY,
            at,
        };
        let there = self.with_force_and_unit(shape.n);
        let shape = there
            .refine_until_accurate(shape, tip, &held, tolerance)?
            .shape;
        // The force is now known, and beside a spring the equilibrium is the same.
        let spring = Spring {
            stiffness: BESIDE * shape.n.norm() / at.norm().max(NEAREST),
            at,
        };
        let there = self.with_force_and_unit(shape.n);
        Ok((
            there.refine_until_accurate(shape, tip, &spring, tolerance)?,
            spring,
        ))
    }

    fn is_stable(&self, shape: &Shape, tip: &Tip, at: Vector3<f64>) -> bool {
        let Ok((found, spring)) = self.rest(shape.clone(), tip, at, TOLERANCE) else {
            return false;
        };
        let axes = [0, 1, 2].map(|i| Vector3::ith(i, 1.0));
        let there = self.with_force_and_unit(found.shape.n);
        let compliance = spring.alone(&found.by_force.position);
        compliance.is_ok_and(|compliance| {
            let index = there.index(&found.shape, tip, &compliance, &axes, None);
            index.is_ok_and(|index| index == 0)
        })
    }

    /// Shape with the given strains, in the directors of the clamp and units of the rod.
    fn fallen_shape(&self, shape: &Shape, strains: &Strains) -> Option<Fallen> {
        let scheme = Scheme::get();
        let pose = |place: Vector3<f64>, at: &FrameAndCouple| {
            let directors = Rotation3::from_matrix_unchecked(frame(&(at.turn / at.turn.norm())));
            Isometry3::from_parts(
                place.into(),
                UnitQuaternion::from_rotation_matrix(&directors),
            )
        };
        let (mut place, mut energy) = (Vector3::zeros(), 0.0);
        let mut sections = vec![pose(place, &shape.nodes[0])];
        let pieces = shape
            .places
            .windows(2)
            .zip(&shape.stages)
            .zip(&strains.stages);
        for (k, ((ends, stages), strains)) in pieces.enumerate() {
            let h = ends[1] - ends[0];
            for (i, (at, strain)) in stages.iter().zip(strains).enumerate() {
                let weight = h * scheme.weights[i];
                place += frame(&at.turn) * strain.fixed_rows::<3>(3) * weight;
                let s = ends[0] + scheme.nodes[i] * h;
                energy += self.law.energy(s, strain).ok()? * weight;
            }
            sections.push(pose(place, &shape.nodes[k + 1]));
        }
        Some((energy, sections))
    }

    /// sqrt(F L^2/B) with the larger bending stiffness.
    fn pull_number(&self) -> f64 {
        (self.law.flexures()[0].max(self.law.flexures()[1]) * self.n.norm()).sqrt()
    }

    /// Shape near rest at the end of the flow from `pushed`; every shape on the way is passed to `way` with its
    /// strains. None if the flow falls back to the fold, or does not settle.
    fn flow(
        &self,
        here: &Shape,
        fold: &Strains,
        pushed: Strains,
        tip: &Tip,
        at: Vector3<f64>,
        way: &mut dyn FnMut(&Shape, &Strains),
    ) -> Option<Shape> {
        let held = Spring {
            stiffness: f64::INFINITY,
            at,
        };
        let (lam, start) = (self.pull_number(), pushed.distance(fold));
        let (mut shape, mut strains, mut h) = (here.clone(), pushed, FIRST);
        let mut rate: Option<Strains> = None;
        for _ in 0..STEPS {
            if !(h > SHORTEST) {
                return None;
            }
            let step = LayerStep {
                before: strains.clone(),
                step: h,
            };
            let creeping = RodUnderForce {
                creeping: Some(&step),
                ..*self
            };
            let mut next = shape.clone();
            let taken = creeping.newton(&mut next, tip, &held, TOLERANCE);
            let turned = next.largest_turn(&shape);
            if !(matches!(taken, Ok(Some(_))) && turned <= TURN) {
                h *= 0.4;
                continue;
            }
            let after = creeping.strains(&next).ok()?;
            let now = self.strains(&next).ok()?.difference(&after);
            // A step much longer than the time of growth would stay with an unstable equilibrium.
            let size = now.size();
            let change = rate.as_ref().map_or(0.0, |rate| {
                now.distance(rate) / rate.size().max(size).max(STILL * lam)
            });
            if change > CHANGE && h > FIRST {
                h *= 0.4;
                continue;
            }
            (shape, strains, rate) = (next, after, Some(now));
            way(&shape, &strains);
            let away = strains.distance(fold);
            if away < BACK * start {
                return None;
            }
            if away > AWAY * start && (size < NEAR * lam || h >= LONGEST) {
                let mut last = shape.clone();
                if matches!(self.newton(&mut last, tip, &held, TOLERANCE), Ok(Some(_)))
                    && last.largest_turn(&shape) < SAME
                    && (size < STILL * lam || self.is_stable(&last, tip, at))
                {
                    way(&last, &self.strains(&last).ok()?);
                    return Some(last);
                }
            }
            if turned < TURN / 3.0 && change < CHANGE / 3.0 {
                h = (2.0 * h).min(LONGEST);
            }
        }
        None
    }
}
