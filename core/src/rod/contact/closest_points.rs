//! Shape of a rod under its touches, and the places where it comes closest to a surface.
//!
//! The gap h(s) is Lipschitz: |h'| <= |r'|. An interval is cut in halves until it is short against the curvatures of
//! rod and surface, 1/(|kappa| + |H|); the slope h' is then a cubic up to an error far below its curvature, and the
//! roots of the cubic tell the minima. No interval is skipped for its samples, so that a thin peg between two of them
//! is found.

use super::super::distributed_load::LoadMoment;
use super::super::ivp::{Wrench, WrenchFlow};
use super::touched_rod::{LoadedRod, Moving, Section, Stretch};
use super::{ContactProblem, Touch};
use crate::error::{Error, Result};
use crate::solve::cost::Cost;
use nalgebra::Vector3;

/// Length of the intervals over the radius of curvature of rod and surface together.
const SHORT: f64 = 0.15;
/// The shortest interval, for surfaces without a radius.
const SHORTEST: f64 = 1e-7;
/// The part of the rod at its clamp, and about an end, where a minimum is that of the end.
const AT_END: f64 = 1e-9;

/// The steps of the integration along a rod with touches.
pub(super) struct Shape<'a> {
    rod: LoadedRod<'a>,
    stretches: Vec<Stretch<0>>,
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
struct Probe {
    s: f64,
    r: Vector3<f64>,
    normal: Vector3<f64>,
    gap: f64,
    slope: f64,
    curvature: f64,
    /// Curvatures of rod and surface together.
    bend: f64,
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
    pub(super) fn shape_of(&self, b: &Wrench, touches: &[Touch]) -> Result<Shape<'_>> {
        let rod = self.loaded();
        let mut sorted = touches.to_vec();
        sorted.sort_by(|a, b| a.s.total_cmp(&b.s));
        let mut stops: Vec<f64> = sorted.iter().map(|touch| touch.s).collect();
        stops.push(1.0);
        let mut stretches = Vec::with_capacity(stops.len());
        rod.walk::<0>(
            b,
            &stops,
            |stretch| stretches.push(stretch),
            |k, here| match sorted.get(k) {
                Some(touch) => self.gap(touch.surface, &here.r).normal * touch.reaction,
                None => Vector3::zeros(),
            },
        )?;
        let works = stretches.iter().map(Stretch::work);
        Ok(Shape {
            rod,
            work: works.sum(),
            stretches,
        })
    }

    /// The places where the rod is closest to each surface: minima of the gap inside, and the end if the gap falls
    /// towards it. Clamp and places of the gap's maxima are left out.
    pub(super) fn lows(&self, shape: &Shape<'_>) -> Result<Vec<Low>> {
        let mut lows = Vec::new();
        for surface in 0..self.surfaces.len() {
            let probe = |s: f64| self.probe(shape, surface, s);
            let mut before = probe(0.0)?;
            for step in shape.stretches.iter().flat_map(|stretch| &stretch.steps) {
                let after = probe(step.to.s)?;
                minima(&before, &after, &probe, &mut |low| {
                    if low.s > AT_END && low.s < 1.0 - AT_END {
                        lows.push(low.low(surface, false));
                    }
                })?;
                before = after;
            }
            if before.slope < 0.0 {
                lows.push(before.low(surface, true));
            }
        }
        Ok(lows)
    }

    fn probe(&self, shape: &Shape<'_>, surface: usize, s: f64) -> Result<Probe> {
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

impl Shape<'_> {
    /// The state at s in [0, 1], with the constants of its stretch; at a touch that before the touch.
    pub(super) fn state(&self, s: f64) -> Result<(Moving<0>, &Wrench)> {
        let last = self.stretches.len().saturating_sub(1);
        let here = self.stretches.iter().position(|each| s <= each.end.s);
        let Some(stretch) = self.stretches.get(here.unwrap_or(last)) else {
            return Err(Error::domain("the rod has no length"));
        };
        let steps = &stretch.steps;
        let at = steps.iter().position(|step| s <= step.to.s);
        let Some(step) = at.map_or(steps.last(), |k| steps.get(k)) else {
            return Ok((stretch.end, &stretch.constants));
        };
        let part = s - step.from.s;
        if part <= 0.0 {
            return Ok((step.from, &stretch.constants));
        }
        if s >= step.to.s {
            return Ok((step.to, &stretch.constants));
        }
        let (law, load, b) = (self.rod.law, self.rod.load, &stretch.constants);
        let mut flow = WrenchFlow::<0, LoadMoment<0>>::new(law, load, b, [[]; 3], [[]; 3]);
        let found = step.redo(|at| flow.slope(at), part, &mut Cost::default());
        let found = found.ok_or_else(|| {
            Error::no_convergence("a section between the steps along the rod could not be computed")
        })?;
        Ok((found.to, b))
    }

    /// The section at s in [0, 1]; at a touch that before the touch.
    pub(super) fn section(&self, s: f64) -> Result<Section> {
        let (state, b) = self.state(s)?;
        Section::new(self.rod.law, self.rod.load, &state, b)
    }
}

/// Shows the minima of the gap between two probes.
fn minima(
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
