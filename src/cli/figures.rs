//! Figures of a run, from what was recorded: snapshots, energies, the path on the solution surface.

use super::Refusal;
use super::output::Output;
use super::recorder::Branch;
use snaprod::elastica::{Equilibrium, fold_curve, stable_grid};
use snaprod::manifold::Sign;
use snaprod::motion::Sample;
use snaprod::plot::{self, Curve, Energies, Patch, PathOnSurface, Shape, Snapshots};
use snaprod::scene::{Scene, Setup, Units};

/// Shapes drawn at even times, beside those of the first snaps.
const SHAPES: usize = 9;
/// Points of the solution surface along p and along lam.
const ROWS: usize = 56;
const COLUMNS: usize = 40;
/// Snaps whose two shapes are drawn.
const SNAPS: usize = 2;

/// Draws the figures of the first branch that has a motion to show.
pub fn write(out: &Output, scene: &Scene, setup: &Setup, branches: &[Branch]) {
    let Some(line) = line_of(branches) else {
        return;
    };
    let units = labels(scene);
    let figure = Figure { setup, units, line };
    out.figure("snapshots", || figure.snapshots(), plot::snapshots);
    out.figure("energies", || Ok(figure.energies()), plot::energies);
    out.figure("surface", || figure.surface(), plot::path_on_surface);
}

/// Labels of a planar scene's quantities.
pub fn labels(scene: &Scene) -> plot::Units {
    let natural = scene
        .scales()
        .is_ok_and(|k| [k.length, k.stiffness(), k.mass] == [1.0; 3]);
    labels_of(scene.units, scene.rod.length, natural)
}

/// Labels for a rod of this length. Of dimensionless quantities only those of a rod of unit length, stiffness and mass
/// (`natural`) have the natural ones, the others none.
pub fn labels_of(units: Units, rod: f64, natural: bool) -> plot::Units {
    match units {
        Units::Si => plot::Units::si(rod),
        Units::Dimensionless if natural => plot::Units::default(),
        Units::Dimensionless => plot::Units {
            length: String::new(),
            time: String::new(),
            energy: String::new(),
            rod,
        },
    }
}

/// Where the rod can run out of its sheet: the first fold, both halves, for it may swing over.
pub fn path_folds(length: f64) -> Result<Vec<Curve>, Refusal> {
    let half = fold_curve(1, 0.02, 6.0, 0.05)?;
    let fold = |side: f64| {
        Curve::new(
            half.iter()
                .map(|f| [f.equilibrium.x * length, side * f.equilibrium.y * length]),
        )
    };
    Ok(vec![fold(1.0), fold(-1.0)])
}

/// What the figures show: a motion, and its snaps by time and place.
struct Line {
    track: Vec<Sample<2>>,
    snaps: Vec<(f64, [f64; 2])>,
}

/// The line of branches from the trunk to the last one that was run.
fn line_of(branches: &[Branch]) -> Option<Line> {
    let mut ids = vec![branches.last()?.id];
    while let Some(parent) = branches[*ids.last()?].parent {
        ids.push(parent);
    }
    ids.reverse();
    let mut track = Vec::new();
    let mut snaps = Vec::new();
    for id in ids {
        let branch = &branches[id];
        for snap in branch.entered.iter().chain(&branch.snaps) {
            snaps.push((snap.t, [snap.pose[0], snap.pose[1]]));
        }
        if branch.parent.is_some() {
            track.push(branch.first);
        }
        track.extend_from_slice(&branch.track);
        if track
            .last()
            .is_none_or(|s: &Sample<2>| s.phase.t < branch.last.phase.t)
        {
            track.push(branch.last);
        }
    }
    // A run that got nowhere has nothing to draw.
    let goes_on = track.first()?.phase.t < track.last()?.phase.t;
    goes_on.then_some(Line { track, snaps })
}

struct Figure<'a> {
    setup: &'a Setup,
    units: plot::Units,
    line: Line,
}

impl Figure<'_> {
    fn snapshots(&self) -> Result<Snapshots, Refusal> {
        let k = &self.setup.scales;
        let scaled = |[x, y]: [f64; 2]| [x * k.length, y * k.length];
        let mut chosen: Vec<&Sample<2>> = Vec::new();
        let (start, end) = (
            self.line.track[0].phase.t,
            self.line.track[self.line.track.len() - 1].phase.t,
        );
        for i in 0..SHAPES {
            let t = start + (end - start) * i as f64 / (SHAPES - 1) as f64;
            let at = self.line.track.partition_point(|s| s.phase.t < t);
            chosen.push(&self.line.track[at.min(self.line.track.len() - 1)]);
        }
        for (t, _) in self.line.snaps.iter().take(SNAPS) {
            chosen.extend(self.line.track.iter().filter(|s| s.phase.t == *t));
        }
        chosen.sort_by(|a, b| a.phase.t.total_cmp(&b.phase.t));
        let mut shapes = Vec::new();
        for sample in chosen {
            let rod = Equilibrium::new(sample.phase.q[0], sample.phase.q[1])?;
            shapes.push(Shape {
                time: sample.phase.t * k.time,
                axis: Curve::new(rod.curve(120).iter().map(|s| scaled([s.x, s.y]))),
            });
        }
        Ok(Snapshots {
            shapes,
            path: Curve::new(
                self.line
                    .track
                    .iter()
                    .map(|s| scaled([s.pose[0], s.pose[1]])),
            ),
            folds: path_folds(k.length)?,
            snaps: self.line.snaps.iter().map(|(_, at)| scaled(*at)).collect(),
            units: self.units.clone(),
        })
    }

    /// The path over the disc on the stable part of the solution surface, height theta(1): the two halves
    /// up to the first fold, which are their rims.
    fn surface(&self) -> Result<PathOnSurface, Refusal> {
        let k = &self.setup.scales;
        let place = |x: f64, y: f64, theta1: f64| [x * k.length, y * k.length, theta1];
        let mut patches = Vec::new();
        for (colour, side, name) in [
            (0, Sign::Plus, "stable, κ > 0"),
            (1, Sign::Minus, "stable, κ < 0"),
        ] {
            let points = stable_grid(side, ROWS, COLUMNS)?;
            patches.push(Patch {
                name: name.into(),
                colour,
                rows: ROWS,
                columns: COLUMNS,
                points: points.iter().map(|g| place(g.x, g.y, g.theta1)).collect(),
            });
        }
        let mut path = Vec::new();
        let mut jumps = Vec::new();
        let mut last: Option<&Sample<2>> = None;
        for sample in &self.line.track {
            let rod = Equilibrium::new(sample.phase.q[0], sample.phase.q[1])?;
            let here = place(rod.x, rod.y, rod.theta1);
            // The two sides of a snap share their time.
            if last.is_some_and(|l| l.phase.t == sample.phase.t && l.phase.q != sample.phase.q) {
                jumps.push([path[path.len() - 1], here]);
                path.push([f64::NAN; 3]);
            }
            path.push(here);
            last = Some(sample);
        }
        Ok(PathOnSurface {
            patches,
            path,
            jumps,
            units: self.units.clone(),
            ..PathOnSurface::default()
        })
    }

    fn energies(&self) -> Energies {
        let k = &self.setup.scales;
        let first = self.line.track[0].ledger.total();
        let column = |f: &dyn Fn(&Sample<2>) -> f64| {
            self.line.track.iter().map(|s| f(s) * k.energy).collect()
        };
        let body = &self.setup.body;
        // A term that is zero throughout is left out.
        let or_none = |used: bool, f: &dyn Fn(&Sample<2>) -> f64| {
            if used { column(f) } else { Vec::new() }
        };
        let lossy = self.line.track.iter().any(|s| s.ledger.dissipated != 0.0);
        let held = self.line.track.iter().any(|s| s.ledger.potential != 0.0);
        Energies {
            time: self.line.track.iter().map(|s| s.phase.t * k.time).collect(),
            kinetic: column(&|s| s.ledger.kinetic),
            elastic: column(&|s| s.ledger.elastic),
            potential: or_none(held, &|s| s.ledger.potential),
            dissipated: or_none(lossy, &|s| s.ledger.dissipated),
            work: or_none(body.is_driven(), &|s| s.ledger.work),
            total: column(&|s| s.ledger.kinetic + s.ledger.elastic + s.ledger.potential),
            error: column(&|s| s.ledger.total() - first),
            snaps: self.line.snaps.iter().map(|(t, _)| t * k.time).collect(),
            units: self.units.clone(),
        }
    }
}
