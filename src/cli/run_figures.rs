//! The figures of a run, from its record.

use super::files::number;
use super::rod_figures;
use nalgebra::{Isometry3, Vector3};
use snaprod::Result;
use snaprod::elastica::{fold_curve, stable_grid};
use snaprod::manifold::Sign;
use snaprod::motion::Ledger;
use snaprod::motion::viscoelastic::Layer;
use snaprod::plot::{
    self, AxisUnits, Curve, DrawnShape, Energies, LayerFigure, LayerRun, LineStyle, Lines,
    LossGroup, Paper, Patch, PathOnSurface, RodShapes, Series, Sheets, SnapLosses, Snapshots,
    SpaceBody, SpaceRod, SpaceWay, StrainMap,
};
use snaprod::scene::Units;
use snaprod::study::run::{
    FigureState, ModelKind, Moment, RunBody, RunRecord, SingleMotion, places,
};
use snaprod::study::{outline, outline_in_plane};

/// Number of shapes drawn at even times: of an elastic rod, in addition to the shapes at the first snaps, and of a
/// viscoelastic rod.
const SHAPES_ON_SHEET: usize = 9;
const SHAPES: usize = 11;
/// Number of snaps with both shapes drawn.
const SNAPS: usize = 2;
/// Points of the solution surface along p and along lam.
const ROWS: usize = 56;
const COLUMNS: usize = 40;
/// Columns of a strain map.
const MAP_COLUMNS: usize = 400;
/// Decades of the dissipation density that the colours resolve.
const DECADES: f64 = 8.0;
/// Bound on the displacement of the end, in lengths of the rod, up to which a passage counts as a snap: the body stays.
const MAX_SNAP_DISPLACEMENT: f64 = 0.05;
/// Strains below this part of the largest one are not drawn.
const SMALL: f64 = 1e-3;

/// The data of a figure of a run.
#[derive(Debug, Clone)]
pub enum RunFigure {
    /// The rod in a plane at several times.
    Snapshots(Snapshots),
    /// The ledger against time.
    Energies(Energies),
    /// An elastic motion on its sheets.
    Surface(PathOnSurface),
    /// The rod in space at several times.
    Shapes(RodShapes),
    /// Path of the end of a rod in space.
    Path(SpaceWay),
    /// A Poincaré section: position and velocity at whole periods.
    Section(Lines),
    /// A strain over time and arclength.
    Strain(StrainMap),
    /// Passage with the largest dissipation and the end nearly at rest, in stretched time.
    Layer(LayerFigure),
    /// Energy dissipated in passages against energy released.
    Losses(SnapLosses),
}

impl RunFigure {
    /// The figure as an SVG document.
    ///
    /// # Errors
    /// Data without anything to show.
    pub fn draw(&self, paper: &Paper) -> Result<String> {
        match self {
            Self::Snapshots(data) => plot::snapshots(data, paper),
            Self::Energies(data) => plot::energies(data, paper),
            Self::Surface(data) => plot::path_on_surface(data, paper),
            Self::Shapes(data) => plot::rod_shapes(data, paper),
            Self::Path(data) => plot::space_way(data, paper),
            Self::Section(data) => plot::lines(data, paper),
            Self::Strain(data) => plot::strain_map(data, paper),
            Self::Layer(data) => plot::layer(data, paper),
            Self::Losses(data) => plot::dissipated_against_released(data, paper),
        }
    }
}

/// Figures of a run, each with the name of its file; without progress only the shapes of an assembly. A branched run is
/// drawn along the line from the trunk to the last branch.
pub fn run_figures(record: &RunRecord) -> Vec<(String, Result<RunFigure>)> {
    let (line, header) = (RunFigures::of(record), &record.header);
    let named = |name: &str, figure: RunFigure| (name.to_owned(), Ok(figure));
    // Bodies without rods have no shapes of rods.
    let has_rods = !header.rods.is_empty();
    let shapes = || named("shapes", RunFigure::Shapes(line.shapes()));
    if !moves(record) {
        let drawn = header.is_assembly() && has_rods;
        return drawn.then(shapes).into_iter().collect();
    }
    let energies = || named("energies", RunFigure::Energies(line.energies()));
    let losses = || {
        line.losses()
            .map(|data| named("losses", RunFigure::Losses(data)))
    };
    let path = |name: &str, body: usize| named(name, RunFigure::Path(line.path(body)));
    let snapshots = || {
        let figure = line.snapshots().map(RunFigure::Snapshots);
        ("snapshots".to_owned(), figure)
    };
    if let Some(period) = header.run.strobe {
        // The path between whole periods is unknown.
        let section = RunFigure::Section(line.section(period));
        return vec![named("poincare", section), energies()];
    }
    match header.model {
        None => {
            let bodies = header.bodies.iter().enumerate();
            let paths = bodies.map(|(k, body)| path(&format!("path_{}", body.name), k));
            let shapes = has_rods.then(shapes);
            let first = shapes.into_iter().chain([energies()]);
            first.chain(paths).collect()
        }
        Some(ModelKind::Sheet) => vec![
            snapshots(),
            energies(),
            ("surface".to_owned(), line.surface().map(RunFigure::Surface)),
        ],
        Some(ModelKind::Planar) => {
            let strain = named("strain", RunFigure::Strain(line.strain(0, "")));
            let layer = line
                .layer()
                .map(|data| named("layer", RunFigure::Layer(data)));
            let first = [snapshots(), energies(), strain];
            first.into_iter().chain(layer).chain(losses()).collect()
        }
        Some(ModelKind::ElasticSpace | ModelKind::Space) => {
            let drawn = line.drawn_strains();
            // A rod that only stretches is one line at all times.
            let bends = drawn.iter().any(|i| header.strains[*i].1 != 5);
            let shapes = bends.then(shapes);
            let strains = drawn.iter().map(|i| {
                let (name, _) = header.strains[*i];
                let figure = RunFigure::Strain(line.named_strain(*i));
                named(&format!("strain_{name}"), figure)
            });
            let first = shapes.into_iter().chain([path("path", 0), energies()]);
            first.chain(strains).chain(losses()).collect()
        }
    }
}

/// True if time goes on in a run.
pub fn moves(record: &RunRecord) -> bool {
    record.branches[0].first.t < record.last().last.t
}

/// First fold of an elastic rod about its clamp, the border of its sheet; both halves, since the rod may swing over.
/// Empty if the clamp moves, or if the rod is loaded along its length, which changes the folds.
///
/// # Errors
/// As [`fold_curve`].
pub fn first_folds(way: &[Moment], record: &RunRecord) -> Result<Vec<Curve>> {
    let length = record.header.scales.length;
    let Some(first) = way.first().filter(|_| !record.header.loaded) else {
        return Ok(Vec::new());
    };
    let moved = |moment: &Moment| {
        let way = first.clamp.inv_mul(&moment.clamp);
        way.translation.vector.norm() > 1e-6 * length || way.rotation.angle() > 1e-6
    };
    if way.iter().any(moved) {
        return Ok(Vec::new());
    }
    let half = fold_curve(1, 0.01, 8.0, 0.05)?;
    let fold = |side: f64| {
        let points = half
            .iter()
            .map(|f| [f.equilibrium.x, side * f.equilibrium.y]);
        // The curve begins and ends at the straight rod, with no loop or a vanishing one.
        let straight = || std::iter::once([1.0, 0.0]);
        let points = straight().chain(points).chain(straight());
        Curve::new(points.map(|at| first.placed(at.map(|x| x * length))))
    };
    Ok(vec![fold(1.0), fold(-1.0)])
}

/// Name of the marked times. A rod with friction does not snap: a fold or a push takes it away from equilibrium for
/// some time.
pub fn snaps_name(record: &RunRecord) -> &'static str {
    match record.passages().next() {
        Some(_) => "away from equilibrium",
        None => "snap",
    }
}

/// Data of the figures: one motion, in the units of its labels.
struct RunFigures<'r> {
    record: &'r RunRecord,
    line: SingleMotion,
    units: AxisUnits,
}

impl<'r> RunFigures<'r> {
    fn of(record: &'r RunRecord) -> Self {
        Self {
            record,
            line: record.line(),
            units: rod_figures::scaled(record.header.units, &record.header.scales),
        }
    }

    fn way(&self) -> &[Moment] {
        &self.line.way
    }

    fn track(&self) -> &[FigureState] {
        &self.line.track
    }

    fn times(&self) -> Vec<f64> {
        self.way().iter().map(|moment| moment.t).collect()
    }

    fn snap_times(&self) -> Vec<f64> {
        self.line.snaps.iter().map(|(t, _)| *t).collect()
    }

    fn length(&self) -> f64 {
        self.record.header.scales.length
    }

    fn snapshots(&self) -> Result<Snapshots> {
        let (start, end) = (self.way()[0].t, self.way()[self.way().len() - 1].t);
        let even = |count: usize| {
            (0..count).map(move |i| start + (end - start) * i as f64 / (count - 1) as f64)
        };
        // An elastic rod has a shape at every moment; a rod with its own strains only at the recorded frames.
        let mut chosen: Vec<(&Moment, Vec<[f64; 2]>)> = Vec::new();
        if self.record.header.is_sheet() {
            let mut moments: Vec<&Moment> =
                even(SHAPES_ON_SHEET).map(|t| self.line.at(t)).collect();
            for (t, _) in self.line.snaps.iter().take(SNAPS) {
                moments.extend(self.way().iter().filter(|moment| moment.t == *t));
            }
            moments.sort_by(|a, b| a.t.total_cmp(&b.t));
            for moment in moments {
                chosen.push((moment, self.record.axis(moment)?));
            }
        } else {
            for t in even(SHAPES) {
                let next = self.track().partition_point(|frame| frame.moment.t < t);
                let frame = self.track().get(next).or(self.track().last());
                chosen.extend(frame.map(|frame| (&frame.moment, frame.axis.clone())));
            }
        }
        let ahead = [[0.0, 0.0], [self.length(), 0.0]];
        let walls = chosen
            .iter()
            .map(|(moment, _)| ahead.map(|at| moment.placed(at)));
        let mut walls: Vec<_> = walls.collect();
        walls.dedup();
        let shape = |(moment, axis): (&Moment, Vec<[f64; 2]>)| DrawnShape {
            time: moment.t,
            axis: Curve::new(axis),
        };
        Ok(Snapshots {
            shapes: chosen.into_iter().map(shape).collect(),
            path: Curve::new(self.way().iter().map(Moment::place)),
            folds: first_folds(self.way(), self.record)?,
            snaps: self.line.snaps.iter().map(|(_, at)| *at).collect(),
            snaps_name: snaps_name(self.record).to_owned(),
            walls,
            obstacles: self.obstacles(),
            units: self.units.clone(),
        })
    }

    /// Lines on the obstacles of a motion in the plane, as far as the rod reaches.
    fn obstacles(&self) -> Vec<Curve> {
        let clamp = self.way()[0].clamp.translation.vector;
        let lines = self.record.header.obstacles.iter();
        lines
            .flat_map(|obstacle| outline_in_plane(obstacle, &clamp, self.length()))
            .map(Curve::new)
            .collect()
    }

    /// The path over the disc on the stable part of the solution surface, with height theta(1). The surface consists of
    /// two halves up to the first fold, their rim.
    fn surface(&self) -> Result<PathOnSurface> {
        let length = self.length();
        let place = |x: f64, y: f64, theta1: f64| [x * length, y * length, theta1];
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
                ..Patch::default()
            });
        }
        let mut path = Vec::new();
        let mut jumps = Vec::new();
        let mut last: Option<&Moment> = None;
        for moment in self.way() {
            // A rod with touches lies on no sheet of the free rod.
            if moment.labels.is_none() {
                path.push([f64::NAN; 3]);
                last = None;
                continue;
            }
            let rod = moment.elastica()?;
            let here = place(rod.x, rod.y, rod.theta1);
            // The two sides of a snap have the same time.
            if last.is_some_and(|l| l.t == moment.t && l.labels != moment.labels) {
                jumps.push([path[path.len() - 1], here]);
                path.push([f64::NAN; 3]);
            }
            path.push(here);
            last = Some(moment);
        }
        let from_clamp = |moment: &Moment| moment.clamp != Isometry3::identity();
        let sheets = Sheets {
            patches,
            from_clamp: self.way().iter().any(from_clamp),
            units: self.units.clone(),
            ..Sheets::default()
        };
        Ok(PathOnSurface {
            sheets,
            path,
            jumps,
        })
    }

    fn energies(&self) -> Energies {
        let states = self.way().iter().map(|moment| (moment.t, &moment.ledger));
        let states: Vec<(f64, &Ledger)> = states.collect();
        let mut energies = rod_figures::energies(
            &states,
            self.record.header.driven,
            self.snap_times(),
            self.units.clone(),
        );
        energies.snaps_name = snaps_name(self.record).to_owned();
        energies
    }

    /// A strain over (t, s), with the dissipation density if there is any.
    fn strain(&self, strain: usize, label: &str) -> StrainMap {
        let stride = self.track().len().div_ceil(MAP_COLUMNS).max(1);
        // Every `stride`-th frame and the last one: the map covers the whole motion.
        let chosen = self.track().iter().step_by(stride);
        let last = self
            .track()
            .last()
            .filter(|_| !(self.track().len() - 1).is_multiple_of(stride));
        let columns: Vec<&FigureState> = chosen.chain(last).collect();
        let dissipates = columns
            .iter()
            .any(|f| f.dissipation.iter().any(|d| *d > 0.0));
        let dissipation = columns.iter().map(|f| f.dissipation.clone());
        StrainMap {
            time: columns.iter().map(|f| f.moment.t).collect(),
            s: places().iter().map(|s| s * self.length()).collect(),
            strain: columns.iter().map(|f| f.strains[strain].clone()).collect(),
            strain_label: label.to_owned(),
            dissipation: dissipation.filter(|_| dissipates).collect(),
            decades: Some(DECADES),
            snaps: self.snap_times(),
            snaps_name: snaps_name(self.record).to_owned(),
            units: self.units.clone(),
            ..StrainMap::default()
        }
    }

    /// A strain of a rod in space; the stretch is shown minus 1.
    fn named_strain(&self, i: usize) -> StrainMap {
        let (what, turns) = match self.record.header.strains[i].1 {
            0 => ("flexure u1", true),
            1 => ("flexure u2", true),
            2 => ("twist u3", true),
            3 => ("shear v1", false),
            4 => ("shear v2", false),
            _ => ("stretch v3 − 1", false),
        };
        let label = match self.units.length.as_str() {
            length if turns && !length.is_empty() => Units::label(what, &format!("1/{length}")),
            _ => what.to_owned(),
        };
        let mut map = self.strain(i, &label);
        if self.record.header.strains[i].1 == 5 {
            map.strain.iter_mut().flatten().for_each(|v3| *v3 -= 1.0);
        }
        map
    }

    /// Flexures and twist above SMALL of the largest of them; without any, the shear or stretch with the largest range.
    fn drawn_strains(&self) -> Vec<usize> {
        let values = |i: usize| {
            let frames = self.track().iter();
            frames.flat_map(move |f| f.strains[i].iter().copied())
        };
        let size = |i: usize| values(i).fold(0.0_f64, |most, x| most.max(x.abs()));
        // Flexures and twist come first; one that the section holds rigid has no column.
        let all = self.record.header.strains.iter();
        let turning: Vec<f64> = (0..all.filter(|(_, k)| *k < 3).count()).map(size).collect();
        let largest = turning.iter().copied().fold(0.0, f64::max);
        if largest * self.length() > SMALL {
            let drawn = (0..turning.len()).filter(|i| turning[*i] > SMALL * largest);
            return drawn.collect();
        }
        let span = |i: usize| {
            let (low, high) = values(i).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                (a.min(x), b.max(x))
            });
            high - low
        };
        let most = (0..self.record.header.strains.len())
            .map(|i| {
                let scale = if i < turning.len() {
                    self.length()
                } else {
                    1.0
                };
                (scale * span(i), i)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        most.map(|(_, i)| i).into_iter().collect()
    }

    fn time_label(&self) -> String {
        Units::label("time", &self.units.time)
    }

    /// Rods in space at several times, with the bodies of the first and the last; where time does not go on, once.
    fn shapes(&self) -> RodShapes {
        let moving = moves(self.record);
        let shapes = self.record.branches.iter().flat_map(|b| &b.shapes);
        let rods = shapes
            .take(if moving { usize::MAX } else { 1 })
            .flat_map(|at| {
                let rods = at.rods.iter().zip(&self.record.header.rods);
                rods.map(|(shape, rod)| SpaceRod {
                    value: moving.then_some(at.t),
                    colour: Some(0),
                    ..rod_figures::posed(shape.iter(), &rod.grounds)
                })
            });
        let ends = [self.way().first(), self.way().last().filter(|_| moving)];
        let ends = ends.into_iter().flatten();
        RodShapes {
            rods: rods.collect(),
            bodies: ends
                .flat_map(|moment| self.bodies(moment, moving.then_some(moment.t)))
                .collect(),
            value_label: self.time_label(),
            // Ribbons of several rods would cover each other.
            ribbon: if self.record.header.is_assembly() {
                0.0
            } else {
                0.03 * self.length()
            },
            // Each rod draws its own attachments to the ground.
            clamp: false,
            ..self.surroundings()
        }
    }

    /// The bodies at a moment.
    fn bodies(&self, moment: &Moment, value: Option<f64>) -> impl Iterator<Item = SpaceBody> {
        let bodies = self.record.header.bodies.iter().zip(&moment.bodies);
        let bodies = bodies.filter(|(body, _)| !body.is_end);
        bodies.map(move |(body, at)| rod_figures::body(&body.solid, &at.pose, value, Some(0)))
    }

    /// Paths of the bodies' centres, and their grooves.
    fn surroundings(&self) -> RodShapes {
        let bodies = self.record.header.bodies.iter().enumerate();
        let paths = bodies.clone().map(|(k, body)| {
            let poses = self.poses(k);
            poses.map(|pose| body.solid.centre(pose).into()).collect()
        });
        let grooves =
            bodies.map(|(k, body)| body.solid.groove_around(self.poses(k), self.length()));
        let places: Vec<Vector3<f64>> = (self.way().iter())
            .flat_map(|moment| &moment.bodies)
            .map(|body| body.pose.translation.vector)
            .collect();
        let obstacles = self.record.header.obstacles.iter();
        RodShapes {
            paths: paths.collect(),
            obstacles: obstacles.flat_map(|each| outline(each, &places)).collect(),
            grooves: grooves.collect(),
            triads: false,
            units: self.units.clone(),
            ..RodShapes::default()
        }
    }

    /// Poses of body `body` along the way.
    fn poses(&self, body: usize) -> impl ExactSizeIterator<Item = &Isometry3<f64>> + Clone {
        self.way()
            .iter()
            .map(move |moment| &moment.bodies[body].pose)
    }

    /// Path of the end of one rod, or of the centre of a body of an assembly.
    fn path(&self, body: usize) -> SpaceWay {
        let RunBody { name, solid, .. } = &self.record.header.bodies[body];
        let point = |pose: &Isometry3<f64>| {
            if self.record.header.is_assembly() {
                solid.centre(pose).into()
            } else {
                pose.translation.vector.into()
            }
        };
        SpaceWay {
            title: name.clone(),
            time: self.times(),
            points: self.poses(body).map(point).collect(),
            groove: solid.groove_along(self.poses(body)),
            snaps: self.snap_times(),
            snaps_name: snaps_name(self.record).to_owned(),
            units: self.units.clone(),
        }
    }

    /// Velocity against position at whole periods, for the component with the largest range.
    fn section(&self, period: f64) -> Lines {
        let whole = |t: f64| (t / period - (t / period).round()).abs() < 1e-6;
        let seen: Vec<&Moment> = self.way().iter().filter(|moment| whole(moment.t)).collect();
        let values = |i: usize| seen.iter().map(move |moment| moment.position()[i]);
        let span = |i: &usize| {
            values(*i).fold(f64::NEG_INFINITY, f64::max) - values(*i).fold(f64::INFINITY, f64::min)
        };
        let i = (0..3)
            .max_by(|a, b| span(a).total_cmp(&span(b)))
            .unwrap_or(0);
        let name = ["x", "y", "z"][i];
        Lines {
            title: format!("once in {} {}", number(period), self.units.time)
                .trim_end()
                .to_owned(),
            x_label: Units::label(name, &self.units.length),
            y_label: Units::label(
                &format!("velocity along {name}"),
                self.record.header.units.velocity(),
            ),
            series: vec![Series {
                x: values(i).collect(),
                y: seen.iter().map(|moment| moment.end().velocity[i]).collect(),
                trace: LineStyle::Dots,
                ..Series::default()
            }],
            ..Lines::default()
        }
    }

    /// Passage with the largest loss among the passages without displacement of the end.
    fn layer(&self) -> Option<LayerFigure> {
        let passages = &self.record.last().passages;
        passages.iter().find_map(|passage| self.layer_of(passage))
    }

    /// A passage in which the end stays in place, in time over viscosity from the peak of the dissipation; `None` if
    /// the end moves.
    fn layer_of(&self, passage: &[FigureState]) -> Option<LayerFigure> {
        let viscosity = self.record.header.viscosity?;
        let (begin, end) = (passage.first()?.moment.t, passage.last()?.moment.t);
        let layer: &Layer = self
            .record
            .passages()
            .find(|l| begin <= l.peak && l.peak <= end)?;
        let stretched = |t: f64| (t - layer.peak) / viscosity;
        let inside: Vec<&FigureState> = passage
            .iter()
            .filter(|f| (layer.from..=layer.to).contains(&f.moment.t))
            .collect();
        let (fold, landing) = (inside.first()?, inside.last()?);
        let way = landing.moment.position() - fold.moment.position();
        if way.norm() > MAX_SNAP_DISPLACEMENT * self.length() {
            return None;
        }
        // Even steps of the dissipated energy resolve the change of shape.
        let lost = |f: &FigureState| f.moment.friction;
        let (low, high) = (lost(fold), lost(landing));
        let curve = |f: &FigureState| Curve::new(f.axis.iter().copied());
        let shapes = (1..SHAPES - 1)
            .filter_map(|i| {
                let level = low + (high - low) * i as f64 / (SHAPES - 1) as f64;
                inside.iter().find(|f| lost(f) >= level)
            })
            .map(|f| DrawnShape {
                time: stretched(f.moment.t),
                axis: curve(f),
            })
            .collect();
        Some(LayerFigure {
            fold: curve(fold),
            landing: curve(landing),
            shapes,
            runs: vec![LayerRun {
                eta: viscosity,
                stretched: inside.iter().map(|f| stretched(f.moment.t)).collect(),
                elastic: inside.iter().map(|f| f.moment.ledger.elastic).collect(),
                dissipated: inside.iter().map(|f| lost(f) - low).collect(),
            }],
            units: self.units.clone(),
            ..LayerFigure::default()
        })
    }

    /// Energy dissipated in passages against energy released; `None` without passages.
    fn losses(&self) -> Option<SnapLosses> {
        let passages: Vec<&Layer> = self.record.passages().collect();
        if passages.is_empty() {
            return None;
        }
        let released = passages.iter().map(|l| l.elastic_from - l.elastic_to);
        Some(SnapLosses {
            groups: vec![LossGroup {
                name: "passages".into(),
                released: released.collect(),
                dissipated: passages.iter().map(|l| l.dissipated).collect(),
                labels: (1..=passages.len()).map(|i| i.to_string()).collect(),
            }],
            released_label: "elastic energy released on the way".into(),
            units: self.units.clone(),
            ..SnapLosses::default()
        })
    }
}
