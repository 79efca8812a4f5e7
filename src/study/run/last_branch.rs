//! A single motion from a record: from the start to the end of the branch that ran last.

use super::record::{Frame, Moment, RunRecord};
use crate::elastica::Equilibrium;
use crate::error::Result;
use nalgebra::Point3;

/// Sections of the axis of an elastic rod.
const SECTIONS: usize = 120;

/// A motion through all branches that lead to the last one.
#[derive(Debug, Clone)]
pub struct SingleMotion {
    /// Moments in the order of time, with the states before and after every snap.
    pub way: Vec<Moment>,
    /// Samples with their strains, in the order of time; empty for a planar elastic rod.
    pub track: Vec<Frame>,
    /// Snaps, then passages of a rod with friction: time, and place of the end in the plane.
    pub snaps: Vec<(f64, [f64; 2])>,
}

impl RunRecord {
    /// The line of branches from the trunk to the last one that was run.
    pub fn line(&self) -> SingleMotion {
        let k = &self.scales;
        let mut ids = vec![self.last().id];
        while let Some(parent) = ids.last().and_then(|id| self.branches[*id].parent) {
            ids.push(parent);
        }
        let mut line = SingleMotion {
            way: Vec::new(),
            track: Vec::new(),
            snaps: Vec::new(),
        };
        for branch in ids.iter().rev().map(|id| &self.branches[*id]) {
            for snap in branch.entered.iter().chain(&branch.snaps) {
                let place = [snap.pose[0] * k.length, snap.pose[1] * k.length];
                line.snaps.push((snap.t * k.time, place));
            }
            if branch.parent.is_some() {
                line.way.push(branch.first.clone());
            }
            line.way.extend_from_slice(&branch.way);
            line.track.extend_from_slice(&branch.track);
            let last = line.way.last().map(|moment| moment.t);
            if self.strobe.is_none() && last.is_none_or(|t| t < branch.last.t) {
                line.way.push(branch.last.clone());
            }
        }
        if !line.way.is_empty() {
            let peaks = self.passages().map(|layer| layer.peak);
            let passed: Vec<_> = peaks.map(|t| (t, line.at(t).place())).collect();
            line.snaps.extend(passed);
        }
        line
    }

    /// Axis of a planar elastic rod at a moment, in the world frame: the clamp may be turned, and move.
    ///
    /// # Errors
    /// A moment without labels.
    pub fn axis(&self, moment: &Moment) -> Result<Vec<[f64; 2]>> {
        let length = self.scales.length;
        let sections = moment.elastica()?.curve(SECTIONS);
        let placed = |x: f64, y: f64| moment.placed([x * length, y * length]);
        Ok(sections.iter().map(|s| placed(s.x, s.y)).collect())
    }
}

impl SingleMotion {
    /// The first moment at or after time t, otherwise the last one; requires a nonempty line.
    pub fn at(&self, t: f64) -> &Moment {
        let next = self.way.partition_point(|moment| moment.t < t);
        &self.way[next.min(self.way.len() - 1)]
    }
}

impl Moment {
    /// Position of the end in the plane.
    pub fn place(&self) -> [f64; 2] {
        let r = self.position();
        [r.x, r.y]
    }

    /// World coordinates of a point (x, y) given along and across the clamp's tangent.
    pub fn placed(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = self.clamp * Point3::new(x, y, 0.0);
        [at.x, at.y]
    }

    /// The elastica in which a planar rod is, or to which it is near.
    ///
    /// # Errors
    /// A moment without labels.
    pub fn elastica(&self) -> Result<Equilibrium> {
        let named = self.labels.map(|labels| (labels.p, labels.w));
        let (p, w) = named.unwrap_or((f64::NAN, f64::NAN));
        Equilibrium::new(p, w)
    }
}
