//! The order in which faces are painted.
//!
//! Sorting by the depth of their middles is wrong for long faces and for sheets that lie close together.
//! So every two faces that overlap on the canvas are compared where they overlap, and the order obeys
//! these comparisons; the depth of the middle decides only what they leave open.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What the order depends on.
pub(crate) trait Layer {
    /// Corners on the canvas.
    fn outline(&self) -> &[(f64, f64)];
    /// Mean depth, growing towards the eye.
    fn depth(&self) -> f64;
    /// Depth at a pixel inside the outline; `None` if the face is seen edge-on.
    fn depth_at(&self, pixel: (f64, f64)) -> Option<f64>;
    /// Which sheet it belongs to.
    fn sheet(&self) -> usize;
}

/// Overlaps of less than so many square pixels are not compared.
const LEAST_OVERLAP: f64 = 0.02;

/// Indices of the faces from back to front. Where two sheets are closer than `tie`, the one with the lower
/// number is in front: their true order would be lost in the faces' flatness.
pub(crate) fn order<F: Layer>(faces: &[F], tie: f64) -> Vec<usize> {
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
    let mut heap: BinaryHeap<Farthest> = (0..n)
        .filter(|&i| waiting[i] == 0)
        .map(|i| Farthest(faces[i].depth(), i))
        .collect();
    let mut by_depth: Vec<usize> = (0..n).collect();
    by_depth.sort_by(|&a, &b| faces[a].depth().total_cmp(&faces[b].depth()));
    let mut rest = by_depth.into_iter();
    let mut done = vec![false; n];
    let mut out = Vec::with_capacity(n);
    while out.len() < n {
        let next = match heap.pop() {
            Some(Farthest(_, i)) => i,
            None => match rest.find(|&i| !done[i]) {
                Some(i) => i,
                None => break,
            },
        };
        if done[next] {
            continue;
        }
        done[next] = true;
        out.push(next);
        for &front in &in_front_of[next] {
            let front = front as usize;
            waiting[front] -= 1;
            if waiting[front] == 0 && !done[front] {
                heap.push(Farthest(faces[front].depth(), front));
            }
        }
    }
    out
}

/// Orders a heap so that the farthest comes first, and among equals the first.
struct Farthest(f64, usize);

impl PartialEq for Farthest {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Farthest {}
impl PartialOrd for Farthest {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Farthest {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

/// Pairs of faces whose bounding boxes overlap, by a sweep from left to right.
fn overlapping<F: Layer>(faces: &[F]) -> Vec<(usize, usize)> {
    let boxes: Vec<[f64; 4]> = faces
        .iter()
        .map(|face| {
            let start = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
            face.outline().iter().fold(start, |b, p| {
                [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)]
            })
        })
        .collect();
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

/// True if a is behind b where they overlap; `None` if that cannot or need not be told.
fn compare<F: Layer>(a: &F, b: &F, tie: f64) -> Option<bool> {
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

/// Twice the area, positive if the corners run like x to y.
fn area(polygon: &[(f64, f64)]) -> f64 {
    (0..polygon.len())
        .map(|i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            a.0 * b.1 - a.1 * b.0
        })
        .sum()
}

/// The middle of what two convex polygons have in common.
fn middle_of_overlap(a: &[(f64, f64)], b: &[(f64, f64)]) -> Option<(f64, f64)> {
    let sense = area(b).signum();
    let mut common = a.to_vec();
    for i in 0..b.len() {
        let (p, q) = (b[i], b[(i + 1) % b.len()]);
        let inside =
            |c: (f64, f64)| sense * ((q.0 - p.0) * (c.1 - p.1) - (q.1 - p.1) * (c.0 - p.0));
        let mut kept = Vec::with_capacity(common.len() + 1);
        for (k, &c) in common.iter().enumerate() {
            let d = common[(k + 1) % common.len()];
            let (ic, id) = (inside(c), inside(d));
            if ic >= 0.0 {
                kept.push(c);
            }
            if (ic >= 0.0) != (id >= 0.0) {
                let t = ic / (ic - id);
                kept.push((c.0 + t * (d.0 - c.0), c.1 + t * (d.1 - c.1)));
            }
        }
        common = kept;
        if common.len() < 3 {
            return None;
        }
    }
    if area(&common).abs() < 2.0 * LEAST_OVERLAP {
        return None;
    }
    let n = common.len() as f64;
    let sum = common
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    Some((sum.0 / n, sum.1 / n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle whose depth rises with x.
    struct Ramp(Vec<(f64, f64)>, [f64; 2], usize);

    impl Layer for Ramp {
        fn outline(&self) -> &[(f64, f64)] {
            &self.0
        }
        fn depth(&self) -> f64 {
            self.depth_at((0.5 * (self.0[0].0 + self.0[2].0), 0.0))
                .unwrap_or(0.0)
        }
        fn depth_at(&self, pixel: (f64, f64)) -> Option<f64> {
            Some(self.1[0] + self.1[1] * pixel.0)
        }
        fn sheet(&self) -> usize {
            self.2
        }
    }

    fn ramp(x: [f64; 2], depth: [f64; 2], sheet: usize) -> Ramp {
        let corners = vec![(x[0], 0.0), (x[1], 0.0), (x[1], 9.0), (x[0], 9.0)];
        Ramp(corners, depth, sheet)
    }

    #[test]
    fn order_is_that_of_the_overlap_not_of_the_middles() {
        // The long face is nearer on average, but behind the short one where both are.
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
