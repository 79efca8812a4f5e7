//! Figures of a viscoelastic run: shapes, energies, strain over (t, s), the layer of a snap, losses.

use super::recorder::Moment;
use super::{Done, Refusal, places};
use crate::cli::figures::{labels, path_folds};
use crate::cli::files::write_figure;
use snaprod::dynamics::Ledger;
use snaprod::dynamics::viscous::Layer;
use snaprod::plot::{
    self, Curve, Energies, LayerFigure, LayerRun, LossGroup, Shape, SnapLosses, Snapshots,
    StrainMap,
};
use snaprod::scene::{Scales, Scene, ViscousSetup};
use std::path::Path;

/// Shapes drawn at even times; shapes of a layer.
const SHAPES: usize = 11;
/// Columns of the strain map.
const COLUMNS: usize = 400;
/// Decades of the dissipation density that are told apart.
const DECADES: f64 = 8.0;

/// Writes the figures of a run that has a motion to show.
pub(super) fn write(
    out: &Path,
    scene: &Scene,
    setup: &ViscousSetup,
    done: &Done,
    png: bool,
) -> Result<(), Refusal> {
    let track = &done.record.track;
    let (Some(first), Some(last)) = (track.first(), track.last()) else {
        return Ok(());
    };
    // A run that got nowhere has nothing to draw.
    if !(first.t < last.t) {
        return Ok(());
    }
    let figure = Figure {
        k: setup.scales,
        units: labels(scene),
        done,
        // The drawn time is stretched by the viscosity in the scene's units: T is time over viscosity.
        viscosity: setup.viscosity * setup.scales.viscosity(),
        driven: setup.body.is_driven(),
    };
    write_figure(
        out,
        "snapshots",
        &plot::snapshots(&figure.snapshots()?)?,
        png,
    )?;
    write_figure(out, "energies", &plot::energies(&figure.energies())?, png)?;
    write_figure(out, "strain", &plot::strain_map(&figure.strain())?, png)?;
    if let Some(layer) = figure.layer() {
        write_figure(out, "layer", &plot::layer(&layer)?, png)?;
        let losses = plot::dissipated_against_released(&figure.losses())?;
        write_figure(out, "losses", &losses, png)?;
    }
    Ok(())
}

struct Figure<'a> {
    k: Scales,
    units: plot::Units,
    done: &'a Done,
    viscosity: f64,
    driven: bool,
}

impl Figure<'_> {
    fn track(&self) -> &[Moment] {
        &self.done.record.track
    }

    /// Passages from and to the neighbourhood of equilibrium that end with less elastic energy.
    fn snaps(&self) -> impl Iterator<Item = &Layer> {
        let layers = self.done.layers.iter();
        layers.filter(|layer| layer.whole && layer.elastic_to < layer.elastic_from)
    }

    fn shape(&self, moment: &Moment, time: f64) -> Shape {
        Shape {
            time,
            axis: self.curve(moment),
        }
    }

    fn curve(&self, moment: &Moment) -> Curve {
        Curve::new(
            moment
                .curve
                .iter()
                .map(|[x, y]| [x * self.k.length, y * self.k.length]),
        )
    }

    fn snapshots(&self) -> Result<Snapshots, Refusal> {
        let track = self.track();
        let (start, end) = (track[0].t, track[track.len() - 1].t);
        let mut shapes = Vec::new();
        for i in 0..SHAPES {
            let t = start + (end - start) * i as f64 / (SHAPES - 1) as f64;
            let at = track.partition_point(|m| m.t < t).min(track.len() - 1);
            shapes.push(self.shape(&track[at], track[at].t * self.k.time));
        }
        let scaled = |m: &Moment| [m.pose[0] * self.k.length, m.pose[1] * self.k.length];
        let at = |layer: &Layer| {
            let i = track.partition_point(|m| m.t < layer.peak);
            scaled(&track[i.min(track.len() - 1)])
        };
        Ok(Snapshots {
            shapes,
            path: Curve::new(track.iter().map(scaled)),
            folds: path_folds(self.k.length)?,
            snaps: self.snaps().map(at).collect(),
            units: self.units.clone(),
        })
    }

    fn energies(&self) -> Energies {
        let track = self.track();
        let k = &self.k;
        let first = track[0].ledger.total();
        let column =
            |f: &dyn Fn(&Ledger) -> f64| track.iter().map(|m| f(&m.ledger) * k.energy).collect();
        let or_none =
            |used: bool, f: &dyn Fn(&Ledger) -> f64| if used { column(f) } else { Vec::new() };
        let held = track.iter().any(|m| m.ledger.potential != 0.0);
        Energies {
            time: track.iter().map(|m| m.t * k.time).collect(),
            kinetic: column(&|l| l.kinetic),
            elastic: column(&|l| l.elastic),
            potential: or_none(held, &|l| l.potential),
            dissipated: column(&|l| l.dissipated),
            work: or_none(self.driven, &|l| l.work),
            total: column(&|l| l.kinetic + l.elastic + l.potential),
            error: column(&|l| l.total() - first),
            snaps: self.snaps().map(|l| l.peak * k.time).collect(),
            units: self.units.clone(),
        }
    }

    fn strain(&self) -> StrainMap {
        let k = &self.k;
        let stride = self.track().len().div_ceil(COLUMNS);
        let columns: Vec<&Moment> = self.track().iter().step_by(stride).collect();
        let density = k.energy / k.length / k.time;
        let scaled = |values: &[f64], unit: f64| values.iter().map(|v| v * unit).collect();
        StrainMap {
            time: columns.iter().map(|m| m.t * k.time).collect(),
            s: places().iter().map(|s| s * k.length).collect(),
            strain: columns
                .iter()
                .map(|m| scaled(&m.strain, 1.0 / k.length))
                .collect(),
            dissipation: columns
                .iter()
                .map(|m| scaled(&m.dissipation, density))
                .collect(),
            decades: Some(DECADES),
            snaps: self.snaps().map(|l| l.peak * k.time).collect(),
            units: self.units.clone(),
            ..StrainMap::default()
        }
    }

    /// The passage with the largest loss, in stretched time from where it left the neighbourhood of equilibrium.
    fn layer(&self) -> Option<LayerFigure> {
        let passage = &self.done.record.passage;
        let (begin, end) = (passage.first()?, passage.last()?);
        let layer = self
            .snaps()
            .find(|l| begin.t <= l.peak && l.peak <= end.t)?;
        let k = &self.k;
        let stretched = |t: f64| (t - layer.peak) * k.time / self.viscosity;
        let inside: Vec<&Moment> = passage
            .iter()
            .filter(|m| (layer.from..=layer.to).contains(&m.t))
            .collect();
        let (fold, landing) = (inside.first()?, inside.last()?);
        // Even in the energy that is lost: that is where the shape changes.
        let lost = |m: &Moment| m.ledger.dissipated;
        let (low, high) = (lost(fold), lost(landing));
        let shapes = (1..SHAPES - 1)
            .filter_map(|i| {
                let level = low + (high - low) * i as f64 / (SHAPES - 1) as f64;
                inside.iter().find(|m| lost(m) >= level)
            })
            .map(|m| self.shape(m, stretched(m.t)))
            .collect();
        Some(LayerFigure {
            fold: self.curve(fold),
            landing: self.curve(landing),
            shapes,
            runs: vec![LayerRun {
                eta: self.viscosity,
                stretched: inside.iter().map(|m| stretched(m.t)).collect(),
                elastic: inside.iter().map(|m| m.ledger.elastic * k.energy).collect(),
                dissipated: inside.iter().map(|m| (lost(m) - low) * k.energy).collect(),
            }],
            released: Some((layer.elastic_from - layer.elastic_to) * k.energy),
            units: self.units.clone(),
            ..LayerFigure::default()
        })
    }

    fn losses(&self) -> SnapLosses {
        let energy = self.k.energy;
        let snaps: Vec<&Layer> = self.snaps().collect();
        SnapLosses {
            groups: vec![LossGroup {
                name: "passages".into(),
                released: snaps
                    .iter()
                    .map(|l| (l.elastic_from - l.elastic_to) * energy)
                    .collect(),
                dissipated: snaps.iter().map(|l| l.dissipated * energy).collect(),
                labels: (1..=snaps.len()).map(|i| i.to_string()).collect(),
            }],
            units: self.units.clone(),
            ..SnapLosses::default()
        }
    }
}
