//! All equilibria at a given end position, below a given load.
//!
//! Below Euler's load, lam < pi/2, no two equilibria have the same end, and neither have two taut rods, p > lam + 1
//! (theory 2.4): Newton's method finds the one, if there is one. The rest of the half strip p > 0, 0 < lam < lam_max
//! is subdivided (mirror images serve p < 0). In a box with centre c and Jacobian J the tip is r_c + J
//! dq + remainder. The remainder is bounded by the second derivatives at the centre and by bounds of the third over
//! the box. A box is dropped when no dq in it can reach the target, accepted when the map is one-to-one on it and
//! Newton's method lands inside, and halved otherwise. Boxes that never decide shrink onto folds through the target,
//! where two equilibria are one.
//!
//! Completeness rests on the proven bounds (core/tests/box_bounds/proof.rs; theory 2.4) and on the rounding of double
//! precision. An independent count guards both. The signs of det over all equilibria found must add up to the
//! winding number of the curve lam = lam_max about the target. The rest of the strip's border maps to (1, 0) and does
//! not count.

use super::box_bounds::{
    Bending, BoxCoordinate, Local, TipRange, chart_point, injective, mirror_derivative, quick_tip,
};
use super::chart::ChartPoint;
use super::curvature::{TipDerivatives, cross, dot};
use super::equilibrium::{Equilibrium, tip};
use super::folds;
use crate::error::{Error, Result};
use crate::math::small_sort::sort_few;
use std::f64::consts::FRAC_PI_2;

/// Equilibrium at a given end position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundEquilibrium {
    /// The equilibrium.
    pub equilibrium: Equilibrium,
    /// Morse index with the end position held; at a fold, the index on its lower side.
    pub index: usize,
    /// True if the target lies on a fold (to rounding) and two equilibria coincide.
    pub degenerate: bool,
    /// Distance between the rod's end and the target.
    pub residual: f64,
}

impl FoundEquilibrium {
    /// Stable: index 0 and not about to vanish.
    pub fn stable(&self) -> bool {
        self.index == 0 && !self.degenerate
    }
}

/// Message for the point (1, 0).
pub const STRAIGHT: &str =
    "the rod is straight, under any load along itself: the force is not determined by the position";

/// Largest lam for which the bounds are proven.
const MOST_LOAD: f64 = 60.0;
/// Most boxes examined before the search gives up.
const MOST_BOXES: usize = 4_000_000;
/// Half width below which a box counts as a piece of a fold.
const FOLD_WIDTH: f64 = 2e-8;
/// Least lam of the boxes, a little less than pi/2, and largest p - lam of their region.
pub(super) const LOADED: f64 = 1.5;
pub(super) const MAX_P_BEYOND_LAM: f64 = 1.1;
/// Distance of equilibria that may be the pair of a fold: a pair is resolved only to the square root of rounding.
const NEIGHBOURS: f64 = 1e-5;
/// Value of p at which logarithmic columns (small p: the tip scales with p) give way to linear ones.
const LINEAR_FROM: f64 = 1.0;
/// Boxes are tested for one-to-one-ness on themselves widened by this factor, so that a root on a
/// border belongs to one of the two at least.
const WIDEN: f64 = 1.25;

/// Every equilibrium with end (x, y) and lambda < `lambda_max`, ordered by lambda.
///
/// Accuracy: each is polished to a residual of a few ulp. Cost: under half a millisecond at lambda_max = 14.
///
/// # Errors
/// A point outside the disc |r| < 1 (unreachable, or only the straight rod), lambda_max not in
/// (0, 60], or a search that failed its count.
pub fn equilibria_at(x: f64, y: f64, lambda_max: f64) -> Result<Vec<FoundEquilibrium>> {
    if !(x.is_finite() && y.is_finite()) {
        return Err(Error::domain(format!(
            "the position ({x}, {y}) must be finite"
        )));
    }
    if !(0.0 < lambda_max && lambda_max <= MOST_LOAD) {
        return Err(Error::domain(format!(
            "lambda_max = {lambda_max} must lie in (0, {MOST_LOAD}]"
        )));
    }
    let radius = x.hypot(y);
    if !(radius < 1.0) {
        return Err(Error::unreachable(if x == 1.0 && y == 0.0 {
            format!("at (1, 0) {STRAIGHT}")
        } else {
            format!(
                "({x}, {y}) is at distance {radius} from the clamp: an inextensible rod of length 1 reaches the open disc |r| < 1 and the point (1, 0)"
            )
        }));
    }
    let mut search = TipSearch::new(x, y, lambda_max);
    search.run()?;
    let mut found = search.found;
    sort_few(&mut found, |each| each.equilibrium.lambda);
    pair_up(&mut found);
    check_count(&found, x, y, lambda_max)?;
    Ok(found)
}

/// Merges two neighbours with the same sign of det: a fold lies between them, within rounding of the target.
fn pair_up(found: &mut Vec<FoundEquilibrium>) {
    found.dedup_by(|next, one| {
        let [e, f] = [&one.equilibrium, &next.equilibrium];
        let near = (e.p - f.p).abs() < NEIGHBOURS * (1.0 + e.p.abs()) * e.p.abs().min(1.0)
            && f.lambda - e.lambda < NEIGHBOURS * (1.0 + e.lambda);
        let alike = near && !one.degenerate && !next.degenerate && one.index == next.index;
        if alike {
            one.degenerate = true;
            one.index = folds::index(e.p, e.w - amplitude_step(e)).unwrap_or(one.index);
        }
        alike
    });
}

#[derive(Debug, Clone, Copy)]
struct InversionBox {
    kind: BoxCoordinate,
    first: f64,
    lam: f64,
    a: f64,
    b: f64,
    /// Targets still within reach of the box: the point, its mirror image.
    alive: [bool; 2],
}

struct TipSearch {
    /// Point (1 - x, y), and its mirror image.
    targets: [[f64; 2]; 2],
    lambda_max: f64,
    queue: Vec<InversionBox>,
    found: Vec<FoundEquilibrium>,
    /// Shrunk boxes without a decision, with the index of their target.
    pieces: Vec<(InversionBox, usize)>,
    boxes: usize,
}

impl TipSearch {
    fn new(x: f64, y: f64, lambda_max: f64) -> Self {
        let distance = (1.0 - x).hypot(y);
        // |theta| <= 4 asin kap, so the tip is within 2 sin(2 asin kap) < 4 kap of (1, 0): p > kap >
        // distance/4.
        let p_min = (distance / 8.0).min(0.5);
        let p_max = lambda_max + MAX_P_BEYOND_LAM;
        let mut queue = Vec::new();
        let rows = (lambda_max - LOADED).max(0.0).ceil();
        let b = 0.5 * (lambda_max - LOADED) / rows;
        for (kind, from, to) in [
            (BoxCoordinate::Log, p_min.ln(), LINEAR_FROM.ln()),
            (BoxCoordinate::Linear, LINEAR_FROM, p_max),
        ] {
            let columns = (to - from).ceil();
            let a = 0.5 * (to - from) / columns;
            for i in 0..columns as usize {
                for j in 0..rows as usize {
                    queue.push(InversionBox {
                        kind,
                        first: from + a * (2 * i + 1) as f64,
                        lam: LOADED + b * (2 * j + 1) as f64,
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
            pieces: Vec::new(),
            boxes: 0,
        }
    }

    fn run(&mut self) -> Result<()> {
        self.find_unique_roots()?;
        while let Some(cell) = self.queue.pop() {
            self.boxes += 1;
            if self.boxes > MOST_BOXES {
                return Err(Error::no_convergence(format!(
                    "the search for all equilibria stopped after {MOST_BOXES} boxes; lower lambda_max"
                )));
            }
            self.examine(cell)?;
        }
        // Undecided boxes next to resolved roots are no folds, so roots come first.
        for (cell, side) in std::mem::take(&mut self.pieces) {
            self.accept_fold(&cell, side)?;
        }
        Ok(())
    }

    /// Equilibria below Euler's load and of taut rods, by Newton's method from the limits of small and of strong
    /// force. For a nearly straight rod 1 - x is proportional to y^2, by a factor that changes little with the force.
    /// The unknowns are therefore fitted to y and (1 - x)/y^2 of the target, down to rounding. Roots of other kinds
    /// are left to the boxes.
    fn find_unique_roots(&mut self) -> Result<()> {
        let side = usize::from(self.targets[0][1] < 0.0);
        let [one_minus_x, y] = self.targets[side];
        if y == 0.0 {
            return Ok(());
        }
        // A small force perpendicular to the rod bends it by y = lam^2/3, with kap = sin(pi/4) = tanh p.
        let across = (0.5f64.sqrt().atanh(), (3.0 * y).sqrt());
        // A strong pull at the angle alpha puts the end on the ray of alpha, (4/lam) sin^2(alpha/4) short of the rim,
        // and p = lam - ln(2 tan(alpha/4)) (theory 2.3).
        let quarter = 0.25 * y.atan2(1.0 - one_minus_x);
        let radius = y.hypot(1.0 - one_minus_x);
        let short = (one_minus_x * (2.0 - one_minus_x) - y * y) / (1.0 + radius);
        let lam = (4.0 * quarter.sin().powi(2) / short).clamp(LOADED, MOST_LOAD);
        let pulled = (lam - (2.0 * quarter.tan()).ln(), lam);
        let found = [across, pulled].map(|(p, lam)| self.by_shape(side, p, lam));
        // Each kind has one root, but near the straight rod, within the digits of the target, it may appear twice.
        let mut taken = [false; 2];
        for (p, lam) in found.into_iter().flatten() {
            let kinds = [lam < FRAC_PI_2, p > lam + 1.0];
            if kinds != [false; 2] && !(0..2).any(|k| kinds[k] && taken[k]) {
                taken = [0, 1].map(|k| kinds[k] || taken[k]);
                self.accept(p, lam, side, false)?;
            }
        }
        Ok(())
    }

    /// Newton's method for the logarithms of y and (1 - x)/y^2; `None` if it does not converge to the target.
    fn by_shape(&self, side: usize, p: f64, mut lam: f64) -> Option<(f64, f64)> {
        const TRIES: usize = 80;
        const ROUNDING: f64 = 1e-9;
        let mut first = p.ln();
        let mut last = f64::INFINITY;
        for _ in 0..TRIES {
            if !(-40.0 < first && first < 5.5 && 0.0 < lam && lam < 2.0 * MOST_LOAD) {
                return None;
            }
            let (p, at) = chart_point(BoxCoordinate::Log, first, lam).ok()?;
            let (step, miss) = Local::new(BoxCoordinate::Log, p, &at).by_shape(self.targets[side]);
            if miss < ROUNDING && miss >= last {
                return Some((p, lam));
            }
            first += step.0.clamp(-0.5, 0.5);
            lam *= 1.0 + (step.1 / lam).clamp(-0.3, 0.3);
            last = miss;
        }
        None
    }

    fn examine(&mut self, mut cell: InversionBox) -> Result<()> {
        let taut = cell.first - cell.a > cell.lam + cell.b + MAX_P_BEYOND_LAM;
        if taut && cell.kind == BoxCoordinate::Linear {
            return Ok(());
        }
        let width = cell.a.max(cell.b);
        let (p, at, local) = Local::at_centre(cell.kind, cell.first, cell.lam, width)?;
        let (a, b) = (WIDEN * cell.a, WIDEN * cell.b);
        let radius = length(at.turned);
        let third = Bending::third(cell.kind, p, a, cell.lam, b, radius);
        let bending = Local::bending(cell.kind, p, &at, third);
        let reach = TipRange::new(&local, &bending, cell.a, cell.b);
        let mut one_to_one = None;
        for side in 0..2 {
            if !cell.alive[side] {
                continue;
            }
            let target = self.targets[side];
            let gap = [target[0] - local.tip[0], target[1] - local.tip[1]];
            if reach.misses(gap) {
                cell.alive[side] = false;
                continue;
            }
            let alone = *one_to_one.get_or_insert_with(|| injective(&local, &bending, a, b));
            let root = if alone {
                self.newton(&cell, &local, side, a, b)
            } else {
                None
            };
            if let Some((p, lam)) = root {
                cell.alive[side] = false;
                self.accept(p, lam, side, false)?;
            } else if width < FOLD_WIDTH {
                cell.alive[side] = false;
                self.pieces.push((cell, side));
            }
        }
        if cell.alive != [false, false] {
            self.split(&cell, &bending);
        }
        Ok(())
    }

    /// Halves the box along the coordinate that adds more to the remainder.
    fn split(&mut self, cell: &InversionBox, bending: &Bending) {
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

    /// Newton's method on a box where the map is one-to-one: the only root in the widened box. If none is found one
    /// may still exist, and the box is halved.
    fn newton(
        &self,
        cell: &InversionBox,
        centre: &Local,
        side: usize,
        a: f64,
        b: f64,
    ) -> Option<(f64, f64)> {
        let target = self.targets[side];
        let gap = |local: &Local| [target[0] - local.tip[0], target[1] - local.tip[1]];
        let (mut first, mut lam) = (cell.first, cell.lam);
        let mut step = centre.step(gap(centre));
        for _ in 0..30 {
            (first, lam) = (first + step.0, lam + step.1);
            let far = ((first - cell.first).abs() / a).max((lam - cell.lam).abs() / b);
            if !(far < 4.0 && lam > 0.0) {
                return None;
            }
            let (p, at) = chart_point(cell.kind, first, lam).ok()?;
            if step.0.abs() <= 1e-12 * (1.0 + first.abs()) && step.1.abs() <= 1e-12 * (1.0 + lam) {
                return (far <= 1.0).then_some((p, lam));
            }
            let local = Local::new(cell.kind, p, &at);
            step = local.step(gap(&local));
        }
        None
    }

    fn accept(&mut self, p: f64, lam: f64, side: usize, degenerate: bool) -> Result<()> {
        if !(lam < self.lambda_max) {
            return Ok(());
        }
        let signed = if side == 0 { p } else { -p };
        // The mirror image of the target was sought on p > 0; for a target on the axis both searches count.
        let is_here = |f: &FoundEquilibrium| {
            let e = &f.equilibrium;
            let tolerance = if degenerate || f.degenerate {
                NEIGHBOURS
            } else {
                1e-9
            };
            (e.p - signed).abs() < tolerance * (1.0 + p) * p.min(1.0)
                && (e.lambda - lam).abs() < tolerance * (1.0 + lam)
        };
        let here: Vec<&FoundEquilibrium> = self.found.iter().filter(|f| is_here(f)).collect();
        // Newton's method may have found one of an unresolved pair.
        let half_a_pair = degenerate && matches!(here[..], [one] if !one.degenerate);
        if half_a_pair {
            self.found.retain(|f| !is_here(f));
        } else if !here.is_empty() {
            return Ok(());
        }
        let equilibrium = Equilibrium::from_lambda_p(lam, signed)?;
        let target = self.targets[0];
        let residual = (equilibrium.one_minus_x - target[0]).hypot(equilibrium.y - target[1]);
        self.found.push(FoundEquilibrium {
            equilibrium,
            index: if degenerate {
                // On the fold rounding decides: take the lower side.
                folds::index(signed, equilibrium.w - amplitude_step(&equilibrium))?
            } else {
                folds::index(signed, equilibrium.w)?
            },
            degenerate,
            residual,
        });
        Ok(())
    }

    /// Accepts an undecided box as a fold through the target, or within rounding of it. Newton's method solves
    /// det = 0 and fits the tip in the direction that the columns still span.
    fn accept_fold(&mut self, cell: &InversionBox, side: usize) -> Result<()> {
        let (mut p, mut at) = chart_point(cell.kind, cell.first, cell.lam)?;
        let mut lam = cell.lam;
        let target = self.targets[side];
        for _ in 0..8 {
            let t = TipDerivatives::new(&at);
            let (det, gradient) = t.det_with_gradient();
            let (one_minus_x, y) = tip(p, &at);
            let (column_p, column_lam) = (mirror_derivative(&at, t.p), mirror_derivative(&at, t.l));
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

/// Step in amplitude below a fold: 1e-6 of the load (dw = D dlam). The index grows with w.
fn amplitude_step(e: &Equilibrium) -> f64 {
    1e-6 * e.lambda * ChartPoint::new(e.p, e.w).integrals.d
}

/// Checks the signed count of the equilibria against the winding number of lam = lam_max.
fn check_count(found: &[FoundEquilibrium], x: f64, y: f64, lambda_max: f64) -> Result<()> {
    // For an equilibrium on the border lam = lam_max the curve passes through the target, and rounding decides whether
    // the equilibrium is found.
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
    let winding = winding(x, y, lambda_max);
    // A double root counts 0, the triple root at a cusp counts 1, of either sign.
    let degenerate = found.iter().filter(|f| f.degenerate).count();
    if signed.abs_diff(winding) <= degenerate as u64 {
        Ok(())
    } else {
        Err(Error::no_convergence(format!(
            "the equilibria found at ({x}, {y}) count {signed} with their signs, but the curve lambda = {lambda_max} winds {winding} times about the point: one was missed; please report this point"
        )))
    }
}

/// Winding number about (x, y) of the tip along lam = lam_max, p from +infinity to -infinity. The half p < 0 is the
/// mirror image of the half p > 0, each closed at (1, 0). Its winding about the point is therefore that of the half
/// p > 0 about the mirror image of the point.
fn winding(x: f64, y: f64, lam: f64) -> i64 {
    let from = |tip: [f64; 2]| [1.0 - x - tip[0], tip[1] - y];
    let mirrored = |tip: [f64; 2]| [1.0 - x - tip[0], tip[1] + y];
    let end = [0.0; 2];
    let p_end = lam + (10.0 / (1.0 - x).hypot(y)).ln().max(2.0);
    // The tip's speed along p is at most of order lam. Steps are bounded by the distance from the target, and short
    // enough not to skip a loop of the curve.
    let mut p = p_end;
    let mut here = end;
    let mut angle = 0.0;
    while p > 0.0 {
        let mut step = 0.25f64.min(1.0 / lam);
        let next = loop {
            // The middle, kap = 0, is the straight rod.
            let next = if step < p {
                quick_tip(p - step, lam)
            } else {
                end
            };
            let moved = length([next[0] - here[0], next[1] - here[1]]);
            let room = length(from(here)).min(length(mirrored(here)));
            if moved < 0.5 * room || step < 1e-9 {
                break next;
            }
            step *= 0.5;
        };
        angle += turn(from(here), from(next)) + turn(mirrored(here), mirrored(next));
        here = next;
        p -= step;
    }
    angle += turn(from(here), from(end)) + turn(mirrored(here), mirrored(end));
    (angle / std::f64::consts::TAU).round() as i64
}

/// The angle from one vector to another.
fn turn(a: [f64; 2], b: [f64; 2]) -> f64 {
    cross(a, b).atan2(dot(a, b))
}

fn length(v: [f64; 2]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches an equilibrium below Euler's load, or of a taut rod, that Newton's method misses or finds twice. Rods
    /// range from nearly straight ones, whose ends determine the force least, to bent ones.
    #[test]
    fn what_is_alone_is_found() {
        for i in 0..400 {
            let part = |k: i32| f64::from(i % k) / f64::from(k);
            let (lam, p) = match i % 2 {
                0 => (0.03 + 1.47 * part(37), (4.0 * part(61) - 3.0).exp()),
                _ => {
                    let lam = LOADED + 12.0 * part(53);
                    (lam, lam + MAX_P_BEYOND_LAM + 9.0 * part(41).powi(2))
                }
            };
            let one = Equilibrium::from_lambda_p(lam, p).unwrap();
            let alone = |f: &FoundEquilibrium| {
                let e = &f.equilibrium;
                if i % 2 == 0 {
                    e.lambda < LOADED + 0.01
                } else {
                    e.p > e.lambda + 1.0 && e.lambda > LOADED - 0.01
                }
            };
            let found = equilibria_at(one.x, one.y, 14.0).unwrap();
            let found: Vec<_> = found.iter().filter(|f| alone(f)).collect();
            assert_eq!(found.len(), 1, "{lam} {p}");
            // The target has sixteen digits of x; these limit the digits of (1 - x)/y^2, and so of the force.
            let digits = f64::EPSILON / one.one_minus_x / lam.powi(2).min(0.01);
            let off = (found[0].equilibrium.lambda / lam - 1.0).abs();
            assert!(
                off < 1e-12 + 300.0 * digits,
                "{lam} {p}: {off:e} {digits:e}"
            );
        }
    }

    /// Catches a target on a fold whose two equilibria are split by rounding and counted as two of one kind.
    #[test]
    fn targets_on_folds_are_told_as_two_in_one() {
        for i in 0..120 {
            let fold = folds::fold_at(1, 0.1 * f64::from(i) - 5.97).unwrap();
            let fold = fold.equilibrium;
            let found = equilibria_at(fold.x, fold.y, 14.0).unwrap();
            let here = |f: &&FoundEquilibrium| {
                let e = &f.equilibrium;
                (e.p - fold.p).abs() < 1e-4 && (e.lambda - fold.lambda).abs() < 1e-4
            };
            let here: Vec<_> = found.iter().filter(here).collect();
            let one = here.len() == 1 && here[0].degenerate && here[0].index == 0;
            let two = here.len() == 2 && here[0].index + here[1].index == 1;
            let none = here.is_empty();
            assert!(one || two || none, "{} {here:?}", fold.p);
        }
        let found = equilibria_at(0.953_339_767_946_033, 0.247_455_688_383_211_66, 14.0);
        assert_eq!(found.unwrap().len(), 2);
    }

    #[test]
    fn large_loads_pass_the_count() {
        for [x, y] in [[0.275, -0.525], [0.45, -0.625]] {
            let found = equilibria_at(x, y, 60.0).unwrap();
            assert_eq!(found.iter().filter(|f| f.stable()).count(), 3, "({x}, {y})");
        }
    }
}
