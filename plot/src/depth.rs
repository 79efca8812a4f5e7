//! Painting order of faces.
//!
//! Sorting by the depth of their middles is wrong for long faces and for sheets that lie close together. So
//! every two faces that overlap on the canvas are compared at the overlap, and the order obeys these
//! comparisons. The depth of the middle decides only between the rest.

use super::geometry::{Pixel, area, cut, hull, middle};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Properties of a face that determine the order.
pub(crate) trait DepthOrdered {
    /// Corners on the canvas.
    fn outline(&self) -> &[Pixel];
    /// Mean depth, growing towards the eye.
    fn depth(&self) -> f64;
    /// Depth at a pixel inside the outline; `None` if the face is seen edge-on.
    fn depth_at(&self, pixel: Pixel) -> Option<f64>;
    /// Number of the sheet of the face.
    fn sheet(&self) -> usize;
}

/// Smallest overlap, in square pixels, at which faces are compared.
const LEAST_OVERLAP: f64 = 0.02;

/// Indices of the faces from back to front. Of two sheets closer than `tie`, the one with the lower number is
/// in front: the true order is lost in the flatness of the faces.
pub(crate) fn order<F: DepthOrdered>(faces: &[F], tie: f64) -> Vec<usize> {
    let n = faces.len();
    let mut in_front_of: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut waiting = vec![0u32; n];
    for (a, b) in overlapping(faces) {
        if let Some(behind) = compare(&faces[a], &faces[b], tie) {
            let (back, front) = if behind { (a, b) } else { (b, a) };
            in_front_of[back].push(front as u32);
            waiting[front] += 1;
        }
    }
    // Kahn's algorithm, farthest first; a cycle is broken at its farthest face.
    let mut by_depth: Vec<usize> = (0..n).collect();
    by_depth.sort_by(|&a, &b| faces[a].depth().total_cmp(&faces[b].depth()));
    let mut rank = vec![0; n];
    for (k, &i) in by_depth.iter().enumerate() {
        rank[i] = k;
    }
    let free = (0..n).filter(|&i| waiting[i] == 0);
    let mut heap: BinaryHeap<Reverse<usize>> = free.map(|i| Reverse(rank[i])).collect();
    let mut rest = 0..n;
    let mut done = vec![false; n];
    let mut out = Vec::with_capacity(n);
    while let Some(next) = heap.pop().map(|r| r.0).or_else(|| rest.next()) {
        let next = by_depth[next];
        if std::mem::replace(&mut done[next], true) {
            continue;
        }
        out.push(next);
        for &front in &in_front_of[next] {
            let front = front as usize;
            waiting[front] -= 1;
            if waiting[front] == 0 && !done[front] {
                heap.push(Reverse(rank[front]));
            }
        }
    }
    out
}

/// Pairs of faces whose bounding boxes overlap, by a sweep from left to right.
fn overlapping<F: DepthOrdered>(faces: &[F]) -> Vec<(usize, usize)> {
    let outlines = faces.iter().map(DepthOrdered::outline);
    let boxes: Vec<[f64; 4]> = outlines.map(|o| hull(o.iter().copied())).collect();
    let mut queue: Vec<usize> = (0..faces.len()).collect();
    queue.sort_by(|&a, &b| boxes[a][0].total_cmp(&boxes[b][0]));
    let mut active: Vec<usize> = Vec::new();
    let mut pairs = Vec::new();
    for &b in &queue {
        active.retain(|&a| boxes[a][2] > boxes[b][0]);
        for &a in &active {
            if boxes[a][1] < boxes[b][3] && boxes[b][1] < boxes[a][3] {
                pairs.push((a, b));
            }
        }
        active.push(b);
    }
    pairs
}

/// True if a is behind b at their overlap; `None` without an overlap or a certain answer.
fn compare<F: DepthOrdered>(a: &F, b: &F, tie: f64) -> Option<bool> {
    let pixel = middle_of_overlap(a.outline(), b.outline())?;
    let (da, db) = (a.depth_at(pixel)?, b.depth_at(pixel)?);
    if (da - db).abs() < tie {
        return match a.sheet().cmp(&b.sheet()) {
            Ordering::Equal => None,
            order => Some(order == Ordering::Greater),
        };
    }
    Some(da < db)
}

/// The middle of the intersection of two convex polygons.
fn middle_of_overlap(a: &[Pixel], b: &[Pixel]) -> Option<Pixel> {
    let sense = area(b).signum();
    let mut common: Vec<[f64; 2]> = a.iter().map(|p| [p.0, p.1]).collect();
    for i in 0..b.len() {
        let (p, q) = (b[i], b[(i + 1) % b.len()]);
        let inside =
            |c: &[f64; 2]| sense * ((q.0 - p.0) * (c[1] - p.1) - (q.1 - p.1) * (c[0] - p.0));
        common = cut(common, inside);
        if common.len() < 3 {
            return None;
        }
    }
    let common: Vec<Pixel> = common.iter().map(|c| (c[0], c[1])).collect();
    (area(&common).abs() >= 2.0 * LEAST_OVERLAP).then(|| middle(&common))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle whose depth rises with x.
    struct DepthRamp(Vec<Pixel>, [f64; 2], usize);

    impl DepthOrdered for DepthRamp {
        fn outline(&self) -> &[Pixel] {
            &self.0
        }
        fn depth(&self) -> f64 {
            self.depth_at((0.5 * (self.0[0].0 + self.0[2].0), 0.0))
                .unwrap_or(0.0)
        }
        fn depth_at(&self, pixel: Pixel) -> Option<f64> {
            Some(self.1[0] + self.1[1] * pixel.0)
        }
        fn sheet(&self) -> usize {
            self.2
        }
    }

    fn ramp(x: [f64; 2], depth: [f64; 2], sheet: usize) -> DepthRamp {
        let corners = vec![(x[0], 0.0), (x[1], 0.0), (x[1], 9.0), (x[0], 9.0)];
        DepthRamp(corners, depth, sheet)
    }

    #[test]
    fn order_is_that_of_the_overlap_not_of_the_middles() {
        // The long face is nearer on average, but behind the short one where the two overlap.
        let faces = [
            ramp([0.0, 100.0], [0.0, 1.0], 0),
            ramp([0.0, 10.0], [20.0, 0.0], 0),
        ];
        assert!(faces[0].depth() > faces[1].depth());
        assert_eq!(order(&faces, 0.01), [0, 1]);
    }

    #[test]
    fn of_two_close_sheets_the_first_is_in_front() {
        let faces = [
            ramp([0.0, 10.0], [0.0, 0.0], 0),
            ramp([0.0, 10.0], [0.001, 0.0], 1),
        ];
        assert_eq!(order(&faces, 0.01), [1, 0]);
        assert_eq!(order(&faces, 1e-6), [0, 1]);
    }
}
