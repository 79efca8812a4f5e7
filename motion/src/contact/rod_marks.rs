//! Places along a rod in motion, and the one that is nearest to an obstacle.

use nalgebra::Vector3;
use snaprod_systems::contact::Gap;

/// Halvings of the nearest place on a cubic.
const HALVINGS: usize = 40;

/// A place of a rod in the world, and its derivative by arclength.
#[derive(Clone, Copy)]
pub(crate) struct Mark {
    /// Fraction of the length of the rod.
    pub s: f64,
    pub x: Vector3<f64>,
    pub along: Vector3<f64>,
}

/// Places of one rod, in the order of arclength.
pub(crate) type Marks = Vec<Mark>;

impl Mark {
    /// The place at the fraction `u` of the way to the next mark, on the cubic with both tangents.
    fn between(&self, next: &Self, u: f64) -> Self {
        let ds = next.s - self.s;
        let [d0, d1] = [self.along * ds, next.along * ds];
        let (v, jump) = (1.0 - u, next.x - self.x);
        let x = self.x + jump * (u * u * (3.0 - 2.0 * u)) + (d0 * v - d1 * u) * (u * v);
        let rate = jump * (6.0 * u * v) + d0 * (v * (1.0 - 3.0 * u)) + d1 * (u * (3.0 * u - 2.0));
        Self {
            s: self.s + u * ds,
            x,
            along: rate / ds,
        }
    }
}

/// The place of a rod that is nearest to an obstacle.
pub(crate) struct NearestPlace {
    pub obstacle: usize,
    /// The mark before the place.
    pub first: usize,
    pub s: f64,
    pub gap: f64,
}

/// The least gap of a rod, given by `marks`, from the obstacles, with its place. The ends of the
/// rod are held by others and do not count.
pub(crate) fn nearest_place(
    marks: &[Mark],
    gaps: impl Iterator<Item = (usize, impl Fn(&Vector3<f64>) -> Gap)>,
    apart: [f64; 2],
) -> Option<NearestPlace> {
    let mut least: Option<NearestPlace> = None;
    for (obstacle, distance) in gaps {
        let mut take = |first: usize, s: f64, gap: f64| {
            let counts = apart[0] < s && s < apart[1];
            if counts && least.as_ref().is_none_or(|least| gap < least.gap) {
                least = Some(NearestPlace {
                    obstacle,
                    first,
                    s,
                    gap,
                });
            }
        };
        let seen = |mark: &Mark| {
            let gap = distance(&mark.x);
            (gap.value, gap.normal.dot(&mark.along))
        };
        let values: Vec<(f64, f64)> = marks.iter().map(seen).collect();
        for (i, pair) in values.windows(2).enumerate() {
            let [(gap, falls), (_, rises)] = *pair else {
                continue;
            };
            take(i, marks[i].s, gap);
            if falls >= 0.0 || rises <= 0.0 {
                continue;
            }
            let mut ends = [0.0, 1.0];
            for _ in 0..HALVINGS {
                let u = 0.5 * (ends[0] + ends[1]);
                let falling = seen(&marks[i].between(&marks[i + 1], u)).1 < 0.0;
                ends[usize::from(!falling)] = u;
            }
            let place = marks[i].between(&marks[i + 1], ends[1]);
            take(i, place.s, seen(&place).0);
        }
    }
    least
}

/// Largest displacement of the places of a rod between two moments.
pub(crate) fn way_of(from: &[Mark], to: &[Mark]) -> f64 {
    let ways = from.iter().zip(to).map(|(a, b)| (b.x - a.x).norm());
    ways.fold(0.0, f64::max)
}
