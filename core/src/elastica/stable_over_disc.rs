//! Stable equilibria over the disc: number and energy at each end position.
//!
//! The stable region of the chart lies below the first fold curve, and det d(x, y)/d(p, w) has one sign on it. Its
//! border maps to the image of the first fold curve and to the point (1, 0) (kap = 0 and lam = 0). For
//! p -> +-infinity it maps twice to the rim: a taut rod points anywhere once with kap > 0 and once with kap < 0. The
//! number of stable equilibria at a point is the degree of the map there. It is 2 less the winding number about the
//! point of the fold curve's image, run along with p.

use super::atlas::{GridPoint, P_TOP, SPACING, refine_samples, spread};
use super::chart::ChartPoint;
use super::curvature::{TipDerivatives, cross};
use super::folds::{fold_at, fold_curve};
use super::inversion::equilibria_at;
use crate::error::Result;

/// Largest lam of the exhaustive search at grid points where the raster is in doubt.
const LAMBDA_MAX: f64 = 20.0;
/// Radius of the region sampled; energies grow without bound at the rim.
const RIM: f64 = 0.985;
/// The range of p that holds the cusps of a fold curve.
const CUSPS: (f64, f64) = (0.05, 8.0);

/// Half a fold curve, p > 0; the other half is its mirror image.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldLine {
    /// Number of the curve, 1, 2, ...
    pub number: usize,
    /// Points from p = 0, at (1, 0), to p = 300: rods with a loop, near (1, 0) again.
    pub points: Vec<GridPoint>,
    /// Points at which the image of the curve in the (x, y) plane has a cusp.
    pub cusps: Vec<GridPoint>,
}

impl FoldLine {
    /// Samples fold curve `number`, neighbours being at most 0.005 apart over the disc.
    ///
    /// # Errors
    /// A number that [`fold_at`] refuses.
    pub fn new(number: usize) -> Result<Self> {
        let at = |p: f64| {
            let e = fold_at(number, p)?.equilibrium;
            GridPoint::new(p, e.lambda)
        };
        let line = refine_samples(0.0, P_TOP, at, |a, b, step| {
            (a.x - b.x).hypot(a.y - b.y) > SPACING && step > 1e-9
        })?;
        let mut points: Vec<GridPoint> = line.into_iter().map(|(_, q)| q).collect();
        let mut cusps = Vec::new();
        for f in fold_curve(number, CUSPS.0, CUSPS.1, 0.05)? {
            if f.cusp {
                let cusp = GridPoint::new(f.equilibrium.p, f.equilibrium.lambda)?;
                cusps.push(cusp);
                let place = points.partition_point(|q| q.p < cusp.p);
                points.insert(place, cusp);
            }
        }
        Ok(Self {
            number,
            points,
            cusps,
        })
    }
}

/// Image of the stable region, by its border.
#[derive(Debug, Clone, PartialEq)]
pub struct StableRegion {
    /// The first fold curve, the border.
    pub border: FoldLine,
    polygon: Vec<[f64; 2]>,
}

impl StableRegion {
    /// Samples the border.
    ///
    /// # Errors
    /// None in practice; those of [`FoldLine::new`].
    pub fn new() -> Result<Self> {
        let border = FoldLine::new(1)?;
        let mirrored = border.points.iter().rev().map(|q| [q.x, -q.y]);
        let polygon = mirrored
            .chain(border.points.iter().map(|q| [q.x, q.y]))
            .chain([[1.0, 0.0]])
            .collect();
        Ok(Self { border, polygon })
    }

    /// Number of stable equilibria with the end at (x, y), exact but for points within 1e-5 of a fold.
    pub fn stable_count(&self, x: f64, y: f64) -> usize {
        if x.hypot(y) >= 1.0 {
            return 0;
        }
        let mut turns = 0i64;
        let mut a = self.polygon[self.polygon.len() - 1];
        for &b in &self.polygon {
            if (a[1] > y) != (b[1] > y) {
                let side = (b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1]);
                // Winding number: sides left of (x, y) that cross its horizontal line count -1 upward, +1 downward.
                if b[1] > a[1] && side < 0.0 {
                    turns -= 1;
                } else if b[1] < a[1] && side > 0.0 {
                    turns += 1;
                }
            }
            a = b;
        }
        (2 - turns).max(0) as usize
    }

    /// Energies of the two lowest stable equilibria on n x n points of the square [-1, 1]^2, row by row from y = -1;
    /// NaN where none exists, and beyond |r| = 0.985.
    ///
    /// # Errors
    /// As [`equilibria_at`], which decides where the raster is in doubt, close to folds.
    pub fn lowest_energies(&self, n: usize) -> Result<Vec<[f64; 2]>> {
        let n = n.max(2);
        let mut raster = Raster::new(n);
        raster.fill()?;
        let mut out = vec![[f64::NAN; 2]; n * n];
        for (k, out) in out.iter_mut().enumerate() {
            let (i, j) = (k % n, k / n);
            let [x, y] = [raster.coordinate(i), raster.coordinate(j)];
            if x.hypot(y) > RIM {
                continue;
            }
            let count = self.stable_count(x, y);
            // Rods of p < 0 are the mirror images of those of p > 0.
            let mirror = (n - 1 - j) * n + i;
            let mut energies: Vec<f64> = raster.found[k]
                .iter()
                .chain(&raster.found[mirror])
                .map(|f| f.energy)
                .collect();
            if energies.len() != count {
                // Close to a fold: search all equilibria.
                energies = equilibria_at(x, y, LAMBDA_MAX)?
                    .iter()
                    .filter(|f| f.stable())
                    .map(|f| f.equilibrium.energy)
                    .collect();
            }
            energies.sort_by(f64::total_cmp);
            for (out, energy) in out.iter_mut().zip(energies) {
                *out = energy;
            }
        }
        Ok(out)
    }
}

/// Stable equilibrium, p > 0, with its end at a grid point.
struct StablePoint {
    q: [f64; 2],
    energy: f64,
}

/// Stable half p > 0, cast on a grid.
struct Raster {
    n: usize,
    found: Vec<Vec<StablePoint>>,
}

/// Rows and columns of the sampled half region: interpolation between them starts Newton's method.
const ROWS: usize = 260;
const COLUMNS: usize = 180;

impl Raster {
    fn new(n: usize) -> Self {
        Self {
            n,
            found: (0..n * n).map(|_| Vec::new()).collect(),
        }
    }

    /// Coordinate of grid line `i`.
    fn coordinate(&self, i: usize) -> f64 {
        2.0 * i as f64 / (self.n - 1) as f64 - 1.0
    }

    /// Samples the region below the first fold and casts its cells.
    fn fill(&mut self) -> Result<()> {
        let top = |p: f64| Ok::<_, crate::Error>(fold_at(1, p)?.equilibrium.lambda);
        // The load must not differ much between neighbours either, for Newton's method.
        let place = |q: &GridPoint| [q.x, q.y, 0.3 * q.lambda.ln_1p()];
        let ps = spread(ROWS, 0.0, P_TOP, |p| {
            let top = top(p)?;
            [0.1, 0.3, 0.5, 0.8, 1.0]
                .iter()
                .map(|t| Ok(place(&GridPoint::new(p, t * top)?)))
                .collect()
        })?;
        let mut rows = Vec::with_capacity(ROWS);
        for p in ps {
            let top = top(p)?;
            let line = spread(COLUMNS, 0.0, top, |lambda| {
                Ok(vec![place(&GridPoint::new(p, lambda)?)])
            })?;
            let row: Result<Vec<GridPoint>> =
                line.into_iter().map(|l| GridPoint::new(p, l)).collect();
            rows.push(row?);
        }
        for pair in rows.windows(2) {
            for j in 0..COLUMNS - 1 {
                let (a, b, c, d) = (&pair[0][j], &pair[1][j], &pair[1][j + 1], &pair[0][j + 1]);
                self.cast([a, b, c]);
                self.cast([a, c, d]);
            }
        }
        Ok(())
    }

    /// Casts a triangle of the chart: its image, taken as flat, is searched for grid points.
    fn cast(&mut self, corners: [&GridPoint; 3]) {
        let [a, b, c] = corners.map(|q| [q.x, q.y]);
        let from = |o: [f64; 2], to: [f64; 2]| [to[0] - o[0], to[1] - o[1]];
        let area = cross(from(a, b), from(a, c));
        if area == 0.0 {
            return;
        }
        let (n, scale) = (self.n, 0.5 * (self.n - 1) as f64);
        let lines = |axis: usize| {
            let (lo, hi) = (
                a[axis].min(b[axis]).min(c[axis]),
                a[axis].max(b[axis]).max(c[axis]),
            );
            let first = ((lo + 1.0) * scale - 1e-9).ceil().max(0.0) as usize;
            let last = ((hi + 1.0) * scale + 1e-9).floor() as usize;
            first..(last + 1).min(n)
        };
        for j in lines(1) {
            for i in lines(0) {
                let r = [self.coordinate(i), self.coordinate(j)];
                let share = [
                    cross(from(r, b), from(r, c)) / area,
                    cross(from(r, c), from(r, a)) / area,
                    cross(from(r, a), from(r, b)) / area,
                ];
                if share.iter().all(|&s| s > -1e-9) {
                    let mean = |f: fn(&GridPoint) -> f64| {
                        (0..3).map(|k| share[k] * f(corners[k])).sum::<f64>()
                    };
                    self.meet(i, j, [mean(|q| q.p), mean(|q| q.lambda)]);
                }
            }
        }
    }

    /// Records the equilibrium near (p, lam) with its end at the grid point (i, j), once.
    fn meet(&mut self, i: usize, j: usize, start: [f64; 2]) {
        let place = j * self.n + i;
        let Some(met) = polish(start, [self.coordinate(i), self.coordinate(j)]) else {
            return;
        };
        // Two triangles with a common side may both hold the point.
        let close = |a: f64, b: f64| (a - b).abs() < 1e-7 * (1.0 + a.abs());
        let known = |f: &StablePoint| close(f.q[0], met.q[0]) && close(f.q[1], met.q[1]);
        let list = &mut self.found[place];
        if !list.iter().any(known) {
            list.push(met);
        }
    }
}

/// Newton's method in (p, lam) for the end at `r`, started close by; `None` if it leaves the neighbourhood of the
/// start or the stable region.
fn polish(start: [f64; 2], r: [f64; 2]) -> Option<StablePoint> {
    let mut q = start;
    for _ in 0..12 {
        if !(q[0] > 0.0 && q[1] > 0.0) {
            return None;
        }
        let at = ChartPoint::at_load(q[0], q[1]).ok()?;
        let tip = at.to_fixed(at.turned);
        let gap = [r[0] - tip[0], r[1] - tip[1]];
        if gap[0].hypot(gap[1]) < 1e-11 {
            let strayed = (q[0] - start[0]).abs() > 0.9 * (0.9 + start[0])
                || (q[1] - start[1]).abs() > 0.9 * (0.9 + start[1]);
            // On the stable side the fold function is positive, as for slightly loaded rods.
            return (!strayed && at.fold_function() > 0.0).then(|| StablePoint {
                q,
                energy: at.energy(),
            });
        }
        let t = TipDerivatives::new(&at);
        let (along_p, along_lam) = (at.to_fixed(t.p), at.to_fixed(t.l));
        let det = cross(along_p, along_lam);
        q[0] += cross(gap, along_lam) / det;
        q[1] += cross(along_p, gap) / det;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_are_those_of_the_inversion() {
        let n = 81;
        let region = StableRegion::new().unwrap();
        let grid = region.lowest_energies(n).unwrap();
        let along = |i: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
        for (k, energies) in grid.iter().enumerate().filter(|(k, _)| k % 53 == 0) {
            let (x, y) = (along(k % n), along(k / n));
            if x.hypot(y) > 0.8 {
                continue;
            }
            let mut expected: Vec<f64> = equilibria_at(x, y, 25.0)
                .unwrap()
                .iter()
                .filter(|f| f.stable())
                .map(|f| f.equilibrium.energy)
                .collect();
            expected.sort_by(f64::total_cmp);
            for (m, &energy) in energies.iter().enumerate() {
                match expected.get(m) {
                    Some(e) => assert!((energy - e).abs() < 1e-6 * e, "({x}, {y}): {energy}, {e}"),
                    None => assert!(energy.is_nan(), "({x}, {y}): {energy}"),
                }
            }
        }
    }
}
