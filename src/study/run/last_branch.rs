//! A single motion from a record: from the start to the end of the branch that ran last.

use super::moment::{FigureState, Moment};
use super::record::{RunBranch, RunRecord};
use crate::error::{Quantity, Result};

/// Sections of the axis of an elastic rod.
const SECTIONS: usize = 120;

/// A motion through all branches that lead to the last one.
#[derive(Debug, Clone)]
pub struct SingleMotion {
    /// Moments in the order of time, with the states before and after every snap.
    pub way: Vec<Moment>,
    /// Samples with their strains, in the order of time; empty for a planar elastic rod and for an assembly.
    pub track: Vec<FigureState>,
    /// Snaps, then passages of a rod with friction: time, and place of the end in the plane.
    pub snaps: Vec<(f64, [f64; 2])>,
}

impl RunRecord {
    /// Branches from the trunk to the last one that was run.
    pub fn lineage(&self) -> Vec<&RunBranch> {
        let mut all = vec![self.last()];
        while let Some(parent) = all.last().and_then(|branch| branch.parent) {
            all.push(&self.branches[parent]);
        }
        all.reverse();
        all
    }

    /// The line of branches from the trunk to the last one that was run.
    pub fn line(&self) -> SingleMotion {
        let mut line = SingleMotion {
            way: Vec::new(),
            track: Vec::new(),
            snaps: Vec::new(),
        };
        for branch in self.lineage() {
            for snap in branch.all_snaps() {
                line.snaps.push((snap.t, [snap.pose[0], snap.pose[1]]));
            }
            if branch.parent.is_some() {
                line.way.push(branch.first.clone());
            }
            line.way.extend_from_slice(&branch.way);
            line.track.extend_from_slice(&branch.track);
            let last = line.way.last().map(|moment| moment.t);
            if self.header.run.strobe.is_none() && last.is_none_or(|t| t < branch.last.t) {
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
        let length = |x| self.header.scales.outward(Quantity::Length, x);
        let placed = |x: f64, y: f64| moment.placed([length(x), length(y)]);
        if !moment.axis.is_empty() {
            return Ok(moment.axis.iter().map(|[x, y]| placed(*x, *y)).collect());
        }
        let sections = moment.elastica()?.curve(SECTIONS);
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
