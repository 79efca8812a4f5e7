//! All equilibria at a given end position, below a given load.
//!
//! The half strip p > 0, 0 < lam < lam_max is subdivided (mirror images serve p < 0). In a box with
//! centre c and Jacobian J the tip is r_c + J dq + remainder, bounded by the second derivatives at the
//! centre and bounds of the third over the box; a box is dropped when no dq in it can reach the target, accepted when
//! the map is one-to-one on it and Newton's method lands inside, and halved otherwise. Boxes that
//! never decide shrink onto folds through the target, where two equilibria are one.
//!
//! Completeness rests on those bounds, measured and widened (see [`Bending`]; a property test samples
//! them afresh), and on a count that knows nothing of them: the signs of det
//! over all equilibria found must add up to the winding number of the curve lam = lam_max about the
//! target, since the rest of the strip's border maps to (1, 0).

use super::chart::{ChartPoint, amplitude};
use super::curvature::{TipDerivatives, cross, dot};
use super::equilibrium::{Equilibrium, tip};
use super::folds;
use crate::error::{Error, Result};

/// One of the equilibria at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The equilibrium.
    pub equilibrium: Equilibrium,
    /// Morse index with the end position held; of a degenerate one, that of its lower side.
    pub index: usize,
    /// True if the target lies on a fold (to rounding) and this is two equilibria in one.
    pub degenerate: bool,
    /// Distance of its end from the target.
    pub residual: f64,
}

impl Found {
    /// Stable: index 0 and not about to vanish.
    pub fn stable(&self) -> bool {
        self.index == 0 && !self.degenerate
    }
}

/// Most boxes examined before the search gives up.
const MOST_BOXES: usize = 4_000_000;
/// Half width of a box at which it counts as a piece of a fold.
const FOLD_WIDTH: f64 = 2e-8;
/// p where the logarithmic columns (p small: the tip scales with p) give way to linear ones.
const LINEAR_FROM: f64 = 1.0;
/// Boxes are tested for one-to-one-ness on themselves widened by this factor, so that a root on a
/// border belongs to one of the two at least.
const WIDEN: f64 = 1.25;

/// Every equilibrium with end (x, y) and lambda < `lambda_max`, ordered by lambda.
///
/// Accuracy: each is polished to a residual of a few ulp. Cost: about a millisecond at lambda_max = 14.
///
/// # Errors
/// A point outside the disc |r| < 1 (unreachable, or only the straight rod), lambda_max not in
/// (0, 60], or a search that failed its count.
pub fn equilibria_at(x: f64, y: f64, lambda_max: f64) -> Result<Vec<Found>> {
    if !(x.is_finite() && y.is_finite()) {
        return Err(Error::domain(format!(
            "the position ({x}, {y}) must be finite"
        )));
    }
    if !(0.0 < lambda_max && lambda_max <= 60.0) {
        return Err(Error::domain(format!(
            "lambda_max = {lambda_max} must lie in (0, 60]"
        )));
    }
    let radius = x.hypot(y);
    if !(radius < 1.0) {
        return Err(Error::unreachable(if x == 1.0 && y == 0.0 {
            "at (1, 0) the rod is straight, under any load along itself: the force is not determined by the position"
                .to_owned()
        } else {
            format!(
                "({x}, {y}) is at distance {radius} from the clamp: an inextensible rod of length 1 reaches the open disc |r| < 1 and the point (1, 0)"
            )
        }));
    }
    let mut search = Search::new(x, y, lambda_max);
    search.run()?;
    let mut found = search.found;
    found.sort_by(|a, b| a.equilibrium.lambda.total_cmp(&b.equilibrium.lambda));
    check_count(&found, x, y, lambda_max)?;
    Ok(found)
}

/// How the map bends over a box: second derivatives at its centre, bounds of the third all over it,
/// in the box's own coordinates.
#[derive(Debug, Clone, Copy)]
struct Bending {
    /// pp, pl, ll at the centre, each as (1 - x, y).
    second: [[f64; 2]; 3],
    /// Bounds of ppp, ppl, pll, lll, each as (x, y).
    third: [[f64; 2]; 4],
}

impl Bending {
    /// Bounds of the third derivatives where the first coordinate runs over [from, to] and lam below
    /// `lam`: measured for lam <= 60 (largest values over lines of 4000 points), each constant at
    /// least 1.2 times the largest value found. They grow like powers of lam, scale with p^2 and p
    /// near the straight rod, and fall off with exp(lam - p) where the rod is still taut.
    fn third(kind: Column, from: f64, to: f64, lam: f64) -> [[f64; 2]; 4] {
        let slight = lam.min(1.0);
        let (x, y, scale) = match kind {
            Column::Log => {
                let p = to.exp();
                (
                    [
                        28.0 + 0.09 * lam.powi(3),
                        10.0 + 0.28 * lam * lam,
                        9.0 + 0.8 * lam,
                        10.0,
                    ],
                    [
                        6.0 + 0.09 * lam.powi(3),
                        3.0 + 0.25 * lam * lam,
                        3.0 + 0.8 * lam,
                        4.0,
                    ],
                    [p * p, p],
                )
            }
            Column::Linear => {
                let both = [
                    6.0 + 0.11 * lam.powi(3),
                    4.0 + 0.4 * lam * lam,
                    6.0 + 1.4 * lam,
                    11.0,
                ];
                let taut = (4.0 * (lam - from).exp()).min(1.0);
                (both, both, [taut * taut, taut])
            }
        };
        let fade = [slight * slight, slight, 1.0, 1.0];
        std::array::from_fn(|k| [x[k] * scale[0] * fade[k], y[k] * scale[1] * fade[k]])
    }

    /// Bound along the direction `e` of what the linear part leaves out over half widths (a, b).
    fn remainder(&self, e: [f64; 2], a: f64, b: f64) -> f64 {
        let quadratic = [a * a, 2.0 * a * b, b * b];
        let cubic = [a * a * a, 3.0 * a * a * b, 3.0 * a * b * b, b * b * b];
        let second: f64 = (0..3)
            .map(|k| dot(e, self.second[k]).abs() * quadratic[k])
            .sum();
        let third: f64 = (0..4)
            .map(|k| (e[0].abs() * self.third[k][0] + e[1].abs() * self.third[k][1]) * cubic[k])
            .sum();
        0.5 * second + third / 6.0
    }

    /// Bounds of the change of the two columns of the Jacobian over half widths (a, b), as (x, y).
    fn column_change(&self, a: f64, b: f64) -> [[f64; 2]; 2] {
        let half = [0.5 * a * a, a * b, 0.5 * b * b];
        std::array::from_fn(|column| {
            std::array::from_fn(|i| {
                self.second[column][i].abs() * a
                    + self.second[column + 1][i].abs() * b
                    + (0..3)
                        .map(|k| self.third[column + k][i] * half[k])
                        .sum::<f64>()
            })
        })
    }

    /// What each coordinate adds to the remainder by itself.
    fn shares(&self, a: f64, b: f64) -> (f64, f64) {
        let size = |v: [f64; 2]| v[0].abs() + v[1].abs();
        (
            (3.0 * size(self.second[0]) + size(self.third[0]) * a) * a * a,
            (3.0 * size(self.second[2]) + size(self.third[3]) * b) * b * b,
        )
    }
}

/// First coordinate of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    /// ln p.
    Log,
    /// p.
    Linear,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    kind: Column,
    first: f64,
    lam: f64,
    a: f64,
    b: f64,
    /// Which of the two targets (the point, its mirror image) it may still hold.
    alive: [bool; 2],
}

/// Where Newton's method from a box ended.
enum Landing {
    /// At a root (p, lam) in the box.
    Inside(f64, f64),
    /// Away from the box.
    Outside,
    /// Nowhere yet.
    Undecided,
}

struct Search {
    /// (1 - x, y) and its mirror image.
    targets: [[f64; 2]; 2],
    lambda_max: f64,
    queue: Vec<Cell>,
    found: Vec<Found>,
    boxes: usize,
}

/// The tip and its derivatives over the box's coordinates, as (1 - x, y).
struct Local {
    tip: [f64; 2],
    along_first: [f64; 2],
    along_lam: [f64; 2],
}

/// The chart point of a box coordinate.
fn chart_point(kind: Column, first: f64, lam: f64) -> Result<(f64, ChartPoint)> {
    let p = match kind {
        Column::Log => first.exp(),
        Column::Linear => first,
    };
    Ok((p, ChartPoint::at_load(p, lam)?))
}

impl Local {
    fn new(kind: Column, p: f64, at: &ChartPoint) -> Self {
        let (one_minus_x, y) = tip(p, at);
        let stretch = if kind == Column::Log { p } else { 1.0 };
        let i = &at.integrals;
        let lam_p = i.lam_p();
        let mirror = |[x, y]: [f64; 2]| [-x, y];
        let along_lam = mirror(at.column_w.map(|v| v * i.d));
        let along_p = mirror(at.column_p);
        Self {
            tip: [one_minus_x, y],
            along_first: std::array::from_fn(|k| (along_p[k] - along_lam[k] * lam_p) * stretch),
            along_lam,
        }
    }

    fn bending(kind: Column, p: f64, at: &ChartPoint, third: [[f64; 2]; 4]) -> Bending {
        let t = TipDerivatives::new(at);
        let second = match kind {
            Column::Linear => [t.pp, t.pl, t.ll],
            // d/d(ln p) = p d/dp.
            Column::Log => [
                std::array::from_fn(|k| p * (p * t.pp[k] + t.p[k])),
                t.pl.map(|v| p * v),
                t.ll,
            ],
        };
        Bending {
            second: second.map(|v| mirrored(at, v)),
            third,
        }
    }

    /// The Newton step to the target at distance `gap`.
    fn step(&self, gap: [f64; 2]) -> (f64, f64) {
        let det = cross(self.along_first, self.along_lam);
        (
            cross(gap, self.along_lam) / det,
            cross(self.along_first, gap) / det,
        )
    }
}

/// A derivative of the tip, turned to the fixed axes, as that of (1 - x, y).
fn mirrored(at: &ChartPoint, v: [f64; 2]) -> [f64; 2] {
    let [x, y] = at.to_fixed(v);
    [-x, y]
}

impl Search {
    fn new(x: f64, y: f64, lambda_max: f64) -> Self {
        let distance = (1.0 - x).hypot(y);
        // |theta| <= 4 asin kap bounds the distance of the tip from (1, 0): kap >= distance/7 or so.
        let p_min = (distance / 8.0).min(0.5);
        // Beyond this p the rod with lam <= lambda_max is straight to within half the distance.
        let p_max = (lambda_max + (5.0 / distance).ln()).max(2.0 * LINEAR_FROM);
        let mut queue = Vec::new();
        let rows = lambda_max.ceil();
        let b = 0.5 * lambda_max / rows;
        for (kind, from, to) in [
            (Column::Log, p_min.ln(), LINEAR_FROM.ln()),
            (Column::Linear, LINEAR_FROM, p_max),
        ] {
            let columns = (to - from).ceil();
            let a = 0.5 * (to - from) / columns;
            for i in 0..columns as usize {
                for j in 0..rows as usize {
                    queue.push(Cell {
                        kind,
                        first: from + a * (2 * i + 1) as f64,
                        lam: b * (2 * j + 1) as f64,
                        a,
                        b,
                        alive: [true, true],
                    });
                }
            }
        }
        Self {
            targets: [[1.0 - x, y], [1.0 - x, -y]],
            lambda_max,
            queue,
            found: Vec::new(),
            boxes: 0,
        }
    }

    fn run(&mut self) -> Result<()> {
        while let Some(cell) = self.queue.pop() {
            self.boxes += 1;
            if self.boxes > MOST_BOXES {
                return Err(Error::no_convergence(format!(
                    "the search for all equilibria stopped after {MOST_BOXES} boxes; lower lambda_max"
                )));
            }
            self.examine(cell)?;
        }
        Ok(())
    }

    fn examine(&mut self, mut cell: Cell) -> Result<()> {
        let (p, at) = chart_point(cell.kind, cell.first, cell.lam)?;
        let local = Local::new(cell.kind, p, &at);
        let wide = (WIDEN * cell.a, WIDEN * cell.b);
        let third = Bending::third(
            cell.kind,
            cell.first - wide.0,
            cell.first + wide.0,
            cell.lam + wide.1,
        );
        let bending = Local::bending(cell.kind, p, &at, third);
        let shrunk = cell.a.max(cell.b) < FOLD_WIDTH;
        let mut one_to_one = None;
        for side in 0..2 {
            if !cell.alive[side] {
                continue;
            }
            let target = self.targets[side];
            let gap = [target[0] - local.tip[0], target[1] - local.tip[1]];
            if out_of_reach(&local, gap, &bending, (cell.a, cell.b)) {
                cell.alive[side] = false;
            } else if *one_to_one.get_or_insert_with(|| injective(&local, &bending, wide)) {
                match self.newton(&cell, &local, side, wide) {
                    Landing::Inside(p, lam) => {
                        cell.alive[side] = false;
                        self.accept(p, lam, side, false)?;
                    }
                    Landing::Outside => cell.alive[side] = false,
                    Landing::Undecided => {}
                }
            } else if shrunk {
                cell.alive[side] = false;
                self.accept_fold(&cell, side)?;
            }
        }
        if cell.alive != [false, false] {
            self.split(&cell, &bending);
        }
        Ok(())
    }

    /// Halves the box along the coordinate that adds more to the remainder.
    fn split(&mut self, cell: &Cell, bending: &Bending) {
        let (first, lam) = bending.shares(cell.a, cell.b);
        let mut child = *cell;
        if first >= lam {
            child.a *= 0.5;
            for sign in [-1.0, 1.0] {
                child.first = cell.first + sign * child.a;
                self.queue.push(child);
            }
        } else {
            child.b *= 0.5;
            for sign in [-1.0, 1.0] {
                child.lam = cell.lam + sign * child.b;
                self.queue.push(child);
            }
        }
    }

    /// Newton's method on a box where the map is one-to-one.
    fn newton(&self, cell: &Cell, centre: &Local, side: usize, wide: (f64, f64)) -> Landing {
        let target = self.targets[side];
        let gap = |local: &Local| [target[0] - local.tip[0], target[1] - local.tip[1]];
        let (mut first, mut lam) = (cell.first, cell.lam);
        let mut step = centre.step(gap(centre));
        let mut strayed = 0;
        for _ in 0..30 {
            (first, lam) = (first + step.0, lam + step.1);
            let far = ((first - cell.first).abs() / wide.0).max((lam - cell.lam).abs() / wide.1);
            if far > 1.0 {
                strayed += 1;
            }
            // On a one-to-one box Newton's method that leaves it and keeps away has no root in it.
            if !(far < 4.0 && lam > 0.0 && strayed < 6) {
                return Landing::Outside;
            }
            let Ok((p, at)) = chart_point(cell.kind, first, lam) else {
                return Landing::Undecided;
            };
            if step.0.abs() <= 1e-12 * (1.0 + first.abs()) && step.1.abs() <= 1e-12 * (1.0 + lam) {
                return if far <= 1.0 {
                    Landing::Inside(p, lam)
                } else {
                    Landing::Outside
                };
            }
            let local = Local::new(cell.kind, p, &at);
            step = local.step(gap(&local));
        }
        Landing::Undecided
    }

    fn accept(&mut self, p: f64, lam: f64, side: usize, degenerate: bool) -> Result<()> {
        if !(lam < self.lambda_max) {
            return Ok(());
        }
        let signed = if side == 0 { p } else { -p };
        // The mirror image of the target was searched on p > 0; on the axis both searches count.
        let known = self.found.iter().any(|f| {
            let e = &f.equilibrium;
            let tolerance = if degenerate || f.degenerate {
                1e-5
            } else {
                1e-9
            };
            (e.p - signed).abs() < tolerance * (1.0 + p) * p.min(1.0)
                && (e.lambda - lam).abs() < tolerance * (1.0 + lam)
        });
        if known {
            return Ok(());
        }
        let equilibrium = Equilibrium::new(signed, amplitude(signed, lam)?)?;
        let target = self.targets[0];
        let residual = (equilibrium.one_minus_x - target[0]).hypot(equilibrium.y - target[1]);
        self.found.push(Found {
            equilibrium,
            index: if degenerate {
                // On the fold itself rounding decides: take the lower side.
                folds::index(signed, equilibrium.w - aside(&equilibrium))?
            } else {
                folds::index(signed, equilibrium.w)?
            },
            degenerate,
            residual,
        });
        Ok(())
    }

    /// A box that shrank without deciding: the target is on a fold, or within rounding of one. Newton's
    /// method on (det = 0, the tip right along the direction that the columns still span).
    fn accept_fold(&mut self, cell: &Cell, side: usize) -> Result<()> {
        let (mut p, mut at) = chart_point(cell.kind, cell.first, cell.lam)?;
        let mut lam = cell.lam;
        let target = self.targets[side];
        for _ in 0..8 {
            let t = TipDerivatives::new(&at);
            let (det, gradient) = t.det_with_gradient();
            let (one_minus_x, y) = tip(p, &at);
            let (column_p, column_lam) = (mirrored(&at, t.p), mirrored(&at, t.l));
            let along = if dot(column_p, column_p) > dot(column_lam, column_lam) {
                column_p
            } else {
                column_lam
            };
            let gap = dot(along, [target[0] - one_minus_x, target[1] - y]);
            let row = [dot(along, column_p), dot(along, column_lam)];
            let scale = cross(gradient, row);
            let step = (
                cross([-det, gap], [gradient[1], row[1]]) / scale,
                cross([gradient[0], row[0]], [-det, gap]) / scale,
            );
            if !(step.0.hypot(step.1) < 1e-3 * p.min(1.0)) {
                break;
            }
            (p, lam) = (p + step.0, lam + step.1);
            at = ChartPoint::at_load(p, lam)?;
        }
        self.accept(p, lam, side, true)
    }
}

/// Amplitude by which to step below a fold: 1e-6 of the load (dw = D dlam). The index grows along w.
fn aside(e: &Equilibrium) -> f64 {
    1e-6 * e.lambda * ChartPoint::new(e.p, e.w).integrals.d
}

/// True if no point of the box can reach the target: along some direction the gap exceeds what the
/// linear part and the remainder can make.
fn out_of_reach(local: &Local, gap: [f64; 2], bending: &Bending, (a, b): (f64, f64)) -> bool {
    // The tip, like the target, is known to a few ulp: a target on a fold must not slip through.
    let rounding = 1e-15 * (local.tip[0].abs() + local.tip[1].abs());
    let beyond = |e: [f64; 2]| {
        let reach = dot(e, local.along_first).abs() * a + dot(e, local.along_lam).abs() * b;
        let excess = dot(e, gap).abs() - reach;
        excess > 0.0 && excess > bending.remainder(e, a, b) + rounding * (e[0].abs() + e[1].abs())
    };
    beyond(gap)
        || beyond([-local.along_lam[1], local.along_lam[0]])
        || beyond([-local.along_first[1], local.along_first[0]])
        || beyond([1.0, 0.0])
        || beyond([0.0, 1.0])
}

/// True if the map is one-to-one on the box: |J^-1 (J(q) - J)| < 1 there, in the box's own norm.
fn injective(local: &Local, bending: &Bending, (a, b): (f64, f64)) -> bool {
    let det = cross(local.along_first, local.along_lam);
    let [change_first, change_lam] = bending.column_change(a, b);
    // Rows of |adj J|, scaled to the box.
    let row_first = [local.along_lam[1].abs() / a, local.along_lam[0].abs() / a];
    let row_lam = [
        local.along_first[1].abs() / b,
        local.along_first[0].abs() / b,
    ];
    let size = |row: [f64; 2]| dot(row, change_first) * a + dot(row, change_lam) * b;
    size(row_first).max(size(row_lam)) < det.abs()
}

/// The signed count of the equilibria against the winding number of lam = lam_max.
fn check_count(found: &[Found], x: f64, y: f64, lambda_max: f64) -> Result<()> {
    // Near the border an equilibrium is found or not by rounding, and the curve passes the target.
    if found
        .iter()
        .any(|f| f.equilibrium.lambda > lambda_max * (1.0 - 1e-9))
    {
        return Ok(());
    }
    let signed: i64 = found
        .iter()
        .filter(|f| !f.degenerate)
        .map(|f| if f.index.is_multiple_of(2) { 1 } else { -1 })
        .sum();
    let winding = winding(x, y, lambda_max)?;
    // A double root counts nothing, but the triple root at a cusp counts one, of either sign.
    let degenerate = found.iter().filter(|f| f.degenerate).count();
    if signed.abs_diff(winding) <= degenerate as u64 {
        Ok(())
    } else {
        Err(Error::no_convergence(format!(
            "the equilibria found at ({x}, {y}) count {signed} with their signs, but the curve lambda = {lambda_max} winds {winding} times about the point: one was missed; please report this point"
        )))
    }
}

/// Winding number about (x, y) of the tip along lam = lam_max, p from +infinity to -infinity.
fn winding(x: f64, y: f64, lam: f64) -> Result<i64> {
    let gap = |p: f64| -> Result<[f64; 2]> {
        let (one_minus_x, tip_y) = tip(p, &ChartPoint::at_load(p, lam)?);
        Ok([(1.0 - x) - one_minus_x, tip_y - y])
    };
    let p_end = lam + (10.0 / (1.0 - x).hypot(y)).ln().max(2.0);
    // The tip's speed along p is at most of order lam: steps follow the distance from the target, and are
    // short enough for no loop of the curve to be passed over.
    let mut p = p_end;
    let mut here = [1.0 - x, -y];
    let mut angle = 0.0;
    while p > -p_end {
        let mut step = 0.25f64.min(1.0 / lam);
        let next = loop {
            let next = gap((p - step).max(-p_end))?;
            let moved = (next[0] - here[0]).hypot(next[1] - here[1]);
            if moved < 0.5 * here[0].hypot(here[1]) || step < 1e-9 {
                break next;
            }
            step *= 0.5;
        };
        angle += cross(here, next).atan2(dot(here, next));
        here = next;
        p -= step;
    }
    let close = [1.0 - x, -y];
    angle += cross(here, close).atan2(dot(here, close));
    Ok((angle / std::f64::consts::TAU).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_loads_pass_the_count() {
        for [x, y] in [[0.275, -0.525], [0.45, -0.625]] {
            let found = equilibria_at(x, y, 60.0).unwrap();
            assert_eq!(found.iter().filter(|f| f.stable()).count(), 3, "({x}, {y})");
        }
    }
}
