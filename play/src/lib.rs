//! Functions of the library for docs/play.html. Each function writes its answer as numbers into one buffer, and returns
//! the count of numbers.
//!
//! Units: length of the rod 1, bending stiffness 1.

use nalgebra::Vector2;
use snaprod_core::elastica::{DraggedRod, DraggedSnap, Elastica, Equilibrium, FoldLine};
use snaprod_core::manifold::Multivalued;
use std::sync::Mutex;

/// Distance from the clamp at which a swinging mass is thrown back at the latest, in lengths of the rod.
///
/// A taut rod is straight but for a bend of length N^(-1/2) at the clamp, with N the pull. At the angle a between the
/// clamp and the way to the mass, 1 - r = 4 sin^2(a/4) N^(-1/2). The pull (4 sin^2(a/4)/(1 - r))^2 throws the mass back
/// before full reach, without loss. Only along the clamp, where a is small, does the mass come as far as this.
const TAUT: f64 = 1.0 - 1e-5;

/// The rod in the hand, the snaps of its last move, and the last answer.
struct Stage {
    rod: Option<DraggedRod>,
    snaps: Vec<DraggedSnap>,
    answer: Vec<f64>,
}

static STAGE: Mutex<Stage> = Mutex::new(Stage {
    rod: None,
    snaps: Vec::new(),
    answer: Vec::new(),
});

/// Writes an answer; returns the length, -1 without an answer.
fn told(answer: impl FnOnce(&mut Stage) -> Option<Vec<f64>>) -> i32 {
    // Nothing panics while it is locked.
    let Ok(mut stage) = STAGE.lock() else {
        return -1;
    };
    let Some(numbers) = answer(&mut stage) else {
        return -1;
    };
    stage.answer = numbers;
    stage.answer.len() as i32
}

/// Address of the numbers of the last answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const f64 {
    STAGE
        .lock()
        .map_or(std::ptr::null(), |stage| stage.answer.as_ptr())
}

/// Takes the stable equilibrium (p, w) into the hand. No numbers; -1 if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn hold(p: f64, w: f64) -> i32 {
    told(|stage| {
        stage.rod = Some(DraggedRod::new(Vector2::new(p, w)).ok()?);
        stage.snaps.clear();
        Some(Vec::new())
    })
}

/// Drags the end to (x, y): for every snap on the way p, w of the fold, p, w of the landing, x, y, and the energy
/// that is released. -1 if the rod did not get there.
#[unsafe(no_mangle)]
pub extern "C" fn drag(x: f64, y: f64) -> i32 {
    told(|stage| {
        stage.snaps = stage.rod.as_mut()?.drag_to(&Vector2::new(x, y)).ok()?;
        Some(stage.snaps.iter().flat_map(numbers_of).collect())
    })
}

fn numbers_of(s: &DraggedSnap) -> [f64; 7] {
    [
        s.from[0], s.from[1], s.to[0], s.to[1], s.place[0], s.place[1], s.released,
    ]
}

/// Lets a mass 1 at the end move for `duration` from the velocity (vx, vy), under gravity down and drag: its velocity
/// then, and what [`drag`] answers for the snaps on the way. Steps of Verlet, shorter where the rod is nearly straight
/// or the mass is fast. Near full reach the pull of the taut rod throws the mass back. -1 if the rod did not get there.
#[unsafe(no_mangle)]
pub extern "C" fn swing(vx: f64, vy: f64, gravity: f64, drag: f64, duration: f64) -> i32 {
    told(|stage| {
        let rod = stage.rod.as_mut()?;
        let (mut v, mut left) = (Vector2::new(vx, vy), duration);
        stage.snaps.clear();
        let force = |rod: &DraggedRod, v: Vector2<f64>| {
            let e = Equilibrium::new(rod.chart()[0], rod.chart()[1]).ok()?;
            Some(Vector2::from(e.force) - Vector2::new(0.0, gravity) - v * drag)
        };
        while left > 0.0 {
            let room = (1.0 - rod.place().norm()).max(1e-6);
            let step = left.min(4e-3).min(0.05 * room / v.norm().max(1.0));
            let half = v + force(rod, v)? * (0.5 * step);
            let target = rod.place() + half * step;
            let out = target.normalize();
            if target.norm() > TAUT && half.dot(&out) > 0.0 {
                // The limit of the throw by the pull, which has no loss.
                v -= out * (2.0 * v.dot(&out));
                left -= step;
                continue;
            }
            stage.snaps.extend(rod.drag_to(&target).ok()?);
            v = half + force(rod, half)? * (0.5 * step);
            left -= step;
        }
        let snaps = stage.snaps.iter().flat_map(numbers_of);
        Some([v.x, v.y].into_iter().chain(snaps).collect())
    })
}

/// The layer of snap `number` of the last move: how many numbers each shape has, then those of each: its energy, and
/// x, y from clamp to end.
#[unsafe(no_mangle)]
pub extern "C" fn layer(number: usize) -> i32 {
    told(|stage| {
        let shapes = &stage.snaps.get(number)?.shapes;
        let size = 1 + 2 * shapes.first()?.sections.len();
        let mut numbers = vec![size as f64];
        for shape in shapes {
            numbers.push(shape.elastic);
            numbers.extend(shape.sections.iter().flat_map(|[x, y, _]| [*x, *y]));
        }
        Some(numbers)
    })
}

/// The rod in the hand: p, w, lambda, theta(1), x, y, energy, force (x, y), number and sign of its sheet.
#[unsafe(no_mangle)]
pub extern "C" fn state() -> i32 {
    told(|stage| {
        let q = stage.rod.as_ref()?.chart();
        let e = Equilibrium::new(q[0], q[1]).ok()?;
        let [fx, fy] = e.force;
        let sheet = [f64::from(e.sheet.mode), e.sheet.sign.value()];
        Some(vec![
            e.p, e.w, e.lambda, e.theta1, e.x, e.y, e.energy, fx, fy, sheet[0], sheet[1],
        ])
    })
}

/// The shape of the equilibrium (p, w): x, y of so many sections from the clamp to the end.
#[unsafe(no_mangle)]
pub extern "C" fn shape(p: f64, w: f64, sections: usize) -> i32 {
    told(|_| {
        let curve = Equilibrium::new(p, w).ok()?.curve(sections);
        Some(curve.iter().flat_map(|at| [at.x, at.y]).collect())
    })
}

/// All stable equilibria with the end at (x, y): p, w of each, lowest energy first.
#[unsafe(no_mangle)]
pub extern "C" fn stable(x: f64, y: f64) -> i32 {
    told(|_| {
        let found = Elastica.stable_at(&Vector2::new(x, y)).ok()?;
        Some(found.iter().flat_map(|q| [q[0], q[1]]).collect())
    })
}

/// The upper half of the first fold curve over the disc: x, y of its points.
#[unsafe(no_mangle)]
pub extern "C" fn border() -> i32 {
    told(|_| {
        let line = FoldLine::new(1).ok()?;
        Some(line.points.iter().flat_map(|q| [q.x, q.y]).collect())
    })
}
