//! One motion out of a record: from the start to the end of the branch that ran last.

use super::ModelKind;
use super::record::{Frame, Moment, RunRecord};
use crate::elastica::Equilibrium;
use crate::error::Result;
use nalgebra::Point3;

/// Sections of the axis of an elastic rod.
const SECTIONS: usize = 120;

/// A motion through all branches that lead to the last one.
#[derive(Debug, Clone)]
pub struct Line {
    /// Samples in the order of time, with both sides of every snap.
    pub track: Vec<Frame>,
    /// Snaps, then passages of a rod with friction: time, and place of the end in the plane.
    pub snaps: Vec<(f64, [f64; 2])>,
}

impl RunRecord {
    /// The line of branches from the trunk to the last one that was run.
    pub fn line(&self) -> Line {
        let k = &self.scales;
        let mut ids = vec![self.last().id];
        while let Some(parent) = ids.last().and_then(|id| self.branches[*id].parent) {
            ids.push(parent);
        }
        let mut line = Line {
            track: Vec::new(),
            snaps: Vec::new(),
        };
        let track = &mut line.track;
        for branch in ids.iter().rev().map(|id| &self.branches[*id]) {
            for snap in branch.entered.iter().chain(&branch.snaps) {
                let place = [snap.pose[0] * k.length, snap.pose[1] * k.length];
                line.snaps.push((snap.t * k.time, place));
            }
            if branch.parent.is_some() {
                track.push(Frame::bare(&branch.first));
            }
            track.extend_from_slice(&branch.track);
            let last = track.last().map(|frame| frame.moment.t);
            if self.kind == ModelKind::Sheet && last.is_none_or(|t| t < branch.last.t) {
                track.push(Frame::bare(&branch.last));
            }
        }
        if !line.track.is_empty() {
            let peaks = self.passages().map(|layer| layer.peak);
            let passed: Vec<_> = peaks.map(|t| (t, line.at(t).moment.place())).collect();
            line.snaps.extend(passed);
        }
        line
    }

    /// The axis of a rod in the plane at one of its frames, in the world: a clamp may be turned, and move.
    ///
    /// # Errors
    /// An elastic rod without labels.
    pub fn axis(&self, frame: &Frame) -> Result<Vec<[f64; 2]>> {
        if self.kind != ModelKind::Sheet {
            return Ok(frame.axis.clone());
        }
        let length = self.scales.length;
        let sections = frame.moment.elastica()?.curve(SECTIONS);
        let placed = |x: f64, y: f64| frame.moment.placed([x * length, y * length]);
        Ok(sections.iter().map(|s| placed(s.x, s.y)).collect())
    }
}

impl Line {
    /// The first frame from this time on, or the last one; there must be one.
    pub fn at(&self, t: f64) -> &Frame {
        let next = self.track.partition_point(|frame| frame.moment.t < t);
        &self.track[next.min(self.track.len() - 1)]
    }
}

impl Frame {
    /// A frame of a rod that has no strains of its own.
    fn bare(moment: &Moment) -> Self {
        Self {
            moment: moment.clone(),
            strains: Vec::new(),
            dissipation: Vec::new(),
            axis: Vec::new(),
        }
    }
}

impl Moment {
    /// Place of the end in the plane.
    pub fn place(&self) -> [f64; 2] {
        let r = self.position();
        [r.x, r.y]
    }

    /// In the world, a point of the plane by its coordinates from the clamp, along the rod's tangent there and across it.
    pub fn placed(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = self.clamp * Point3::new(x, y, 0.0);
        [at.x, at.y]
    }

    /// The elastica that a planar rod is in, or near.
    ///
    /// # Errors
    /// A moment without labels.
    pub fn elastica(&self) -> Result<Equilibrium> {
        let named = self.labels.map(|labels| (labels.p, labels.w));
        let (p, w) = named.unwrap_or((f64::NAN, f64::NAN));
        Equilibrium::new(p, w)
    }
}
