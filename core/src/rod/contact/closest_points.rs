//! Shape of a rod under its touches, and the places where it comes closest to a surface.
//!
//! The gap h(s) is Lipschitz: |h'| <= |r'|. An interval is cut in halves until it is short against the curvatures of
//! rod and surface, 1/(|kappa| + |H|); the slope h' is then a cubic up to an error far below its curvature, and the
//! roots of the cubic tell the minima. No interval is skipped for its samples, so that a thin peg between two of them
//! is found.

use super::super::distributed_load::{LoadMoment, ScaledLoad};
use super::super::ivp::{Wrench, WrenchFlow};
use super::super::planar::Plane;
use super::lying::Lying;
use super::touched_rod::{LoadedRod, Moving, Onward, Piece, Stop, Stretch, TouchedSection, stops};
use super::{ContactProblem, ScaledTouch};
use crate::error::{Error, Result};
use crate::solve::cost::Cost;
use nalgebra::Vector3;

/// Length of the intervals over the radius of curvature of rod and surface together.
const SHORT: f64 = 0.15;
/// The shortest interval, for surfaces without a radius.
const SHORTEST: f64 = 1e-7;
/// Length at the clamp and at the end of the rod within which a minimum belongs to the end.
const AT_END: f64 = 1e-9;

/// The steps of the integration along a rod with touches.
pub(super) struct TouchedSteps<'a> {
    rod: LoadedRod<'a>,
    pieces: Vec<Piece<0>>,
    /// Work int f.r ds of the load along the rod.
    pub(super) work: f64,
}

/// A place where the rod is closest to a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Low {
    pub(super) surface: usize,
    pub(super) s: f64,
    /// True for the end of the rod.
    pub(super) at_end: bool,
    pub(super) gap: f64,
    /// Place of the centreline, and the normal of the surface there.
    pub(super) r: Vector3<f64>,
    pub(super) normal: Vector3<f64>,
}

/// The gap at one section, with its first two derivatives along the rod.
#[derive(Debug, Clone, Copy)]
pub(super) struct Probe {
    pub(super) s: f64,
    pub(super) r: Vector3<f64>,
    pub(super) normal: Vector3<f64>,
    pub(super) gap: f64,
    pub(super) slope: f64,
    pub(super) curvature: f64,
    /// Curvatures of rod and surface together.
    pub(super) bend: f64,
}

impl Probe {
    fn low(&self, surface: usize, at_end: bool) -> Low {
        Low {
            surface,
            s: if at_end { 1.0 } else { self.s },
            at_end,
            gap: self.gap,
            r: self.r,
            normal: self.normal,
        }
    }
}

impl ContactProblem {
    /// The rod under a base wrench and touches.
    pub(super) fn shape_of(&self, b: &Wrench, touches: &[ScaledTouch]) -> Result<TouchedSteps<'_>> {
        let rod = self.loaded();
        let normal = self.plane.as_ref().map(Plane::normal);
        let stops = stops(touches);
        let places: Vec<f64> = stops.iter().map(Stop::place).collect();
        let mut pieces = Vec::with_capacity(stops.len());
        rod.walk::<0>(
            b,
            &places,
            |piece| pieces.push(piece),
            |k, here, energy| {
                let push = |touch: &ScaledTouch| {
                    let gap = self.gap(touch.surface, &here.r);
                    Onward::Free(gap.normal * touch.reaction)
                };
                Ok(match stops[k] {
                    Stop::End => Onward::Free(Vector3::zeros()),
                    Stop::Touch(i, _) if touches[i].line.is_some() => {
                        let gap = |k: usize, r: &Vector3<f64>| self.gap(k, r);
                        let lying = rod.lying(&touches[i], (here, energy), gap, normal.as_ref())?;
                        Onward::Lies(Box::new(lying))
                    }
                    Stop::Touch(i, _) | Stop::Lift(i, _) => push(&touches[i]),
                })
            },
        )?;
        let works = pieces.iter().map(|piece| match piece {
            Piece::Free(stretch) => stretch.work(),
            Piece::Lying(lying) => lying.work(rod.load),
        });
        Ok(TouchedSteps {
            rod,
            work: works.sum(),
            pieces,
        })
    }

    /// The places where the rod is closest to each surface: minima of the gap inside, and the end if the gap falls
    /// towards it. Clamp and places of the gap's maxima are left out.
    pub(super) fn lows(&self, shape: &TouchedSteps<'_>) -> Result<Vec<Low>> {
        let mut lows = Vec::new();
        for surface in 0..self.surfaces.len() {
            let probe = |s: f64| self.probe(shape, surface, s);
            let mut before = probe(0.0)?;
            for piece in &shape.pieces {
                let places: Vec<f64> = match piece {
                    Piece::Free(stretch) => stretch.steps.iter().map(|step| step.to.s).collect(),
                    Piece::Lying(lying) => vec![lying.to],
                };
                for to in places {
                    let after = probe(to)?;
                    minima(&before, &after, &probe, &mut |low| {
                        if low.s > AT_END && low.s < 1.0 - AT_END {
                            lows.push(low.low(surface, false));
                        }
                    })?;
                    before = after;
                }
            }
            if before.slope < 0.0 {
                lows.push(before.low(surface, true));
            }
        }
        Ok(lows)
    }

    fn probe(&self, shape: &TouchedSteps<'_>, surface: usize, s: f64) -> Result<Probe> {
        let here = shape.section(s)?;
        let gap = self.gap(surface, &here.r);
        let turn = here.turn.norm();
        Ok(Probe {
            s,
            r: here.r,
            normal: gap.normal,
            gap: gap.value,
            slope: here.slope(&gap),
            curvature: here.relative_curvature(&gap),
            bend: turn + gap.hessian.norm(),
        })
    }
}

impl Stretch<0> {
    /// Work of the load along the stretch.
    fn work(&self) -> f64 {
        use super::super::distributed_load::LoadState;
        LoadState::<0>::work(&self.end.carried)
    }
}

impl TouchedSteps<'_> {
    /// The state at s in [0, 1], with the constants of its stretch; at a touch that before the touch.
    pub(super) fn state(&self, s: f64) -> Result<(Moving<0>, Wrench)> {
        let last = self.pieces.len().saturating_sub(1);
        let here = self.pieces.iter().position(|each| s <= each.end());
        let stretch = match self.pieces.get(here.unwrap_or(last)) {
            None => return Err(Error::domain("the rod has no length")),
            Some(Piece::Lying(lying)) => return Ok(lying.state(self.rod.load, s)),
            Some(Piece::Free(stretch)) => stretch,
        };
        let b = stretch.constants;
        let steps = &stretch.steps;
        let at = steps.iter().position(|step| s <= step.to.s);
        let Some(step) = at.map_or(steps.last(), |k| steps.get(k)) else {
            return Ok((stretch.end, b));
        };
        let part = s - step.from.s;
        if part <= 0.0 {
            return Ok((step.from, b));
        }
        if s >= step.to.s {
            return Ok((step.to, b));
        }
        let (law, load) = (self.rod.law, self.rod.load);
        let mut flow = WrenchFlow::<0, LoadMoment<0>>::new(law, load, &b, [[]; 3], [[]; 3]);
        let found = step.redo(|at| flow.slope(at), part, &mut Cost::default());
        let found = found.ok_or_else(|| {
            Error::no_convergence("a section between the steps along the rod could not be computed")
        })?;
        Ok((found.to, b))
    }

    /// The stretches that lie on surfaces.
    pub(super) fn lying(&self) -> impl Iterator<Item = &Lying> {
        self.pieces.iter().filter_map(|piece| match piece {
            Piece::Lying(lying) => Some(&**lying),
            Piece::Free(_) => None,
        })
    }

    /// The load along the rod.
    pub(super) fn load(&self) -> &ScaledLoad {
        self.rod.load
    }

    /// The section at s in [0, 1]; at a touch that before the touch.
    pub(super) fn section(&self, s: f64) -> Result<TouchedSection> {
        let (state, b) = self.state(s)?;
        TouchedSection::new(self.rod.law, self.rod.load, &state, &b)
    }
}

/// Shows the minima of the gap between two probes.
pub(super) fn minima(
    a: &Probe,
    b: &Probe,
    probe: &impl Fn(f64) -> Result<Probe>,
    found: &mut impl FnMut(Probe),
) -> Result<()> {
    let length = b.s - a.s;
    if length > SHORTEST && length * a.bend.max(b.bend).max(1.0) > SHORT {
        let middle = probe(0.5 * (a.s + b.s))?;
        minima(a, &middle, probe, found)?;
        return minima(&middle, b, probe, found);
    }
    if a.slope < 0.0 && b.slope >= 0.0 {
        found(bottom(a, b, probe)?);
        return Ok(());
    }
    // A dip between two slopes of one sign: the cubic of the slope has its extremum beyond zero.
    let dips = if a.slope < 0.0 {
        a.curvature > 0.0 && b.curvature < 0.0
    } else {
        a.curvature < 0.0 && b.curvature > 0.0
    };
    if dips && a.slope * b.slope > 0.0 {
        let part = a.curvature / (a.curvature - b.curvature);
        let middle = probe(a.s + part * length)?;
        if middle.slope * a.slope < 0.0 {
            let (from, to) = if a.slope < 0.0 {
                (*a, middle)
            } else {
                (middle, *b)
            };
            found(bottom(&from, &to, probe)?);
        }
    }
    Ok(())
}

/// The root of the slope between two probes where it grows through zero: Newton's method kept within the bracket.
fn bottom(a: &Probe, b: &Probe, probe: &impl Fn(f64) -> Result<Probe>) -> Result<Probe> {
    let (mut low, mut high) = (*a, *b);
    let mut at = if low.slope.abs() < high.slope.abs() {
        low
    } else {
        high
    };
    for _ in 0..60 {
        let mut next = at.s - at.slope / at.curvature;
        if !(next > low.s && next < high.s) {
            next = 0.5 * (low.s + high.s);
        }
        let moved = (next - at.s).abs();
        at = probe(next)?;
        if at.slope < 0.0 {
            low = at;
        } else {
            high = at;
        }
        if moved < 1e-14 || high.s - low.s < 1e-14 {
            break;
        }
    }
    Ok(at)
}
