//! Figures of a viscoelastic run of either kind: energies, strains over (t, s), losses.

use super::recorder::{Moment, Record};
use super::{Kind, Task, places};
use snaprod::motion::Ledger;
use snaprod::motion::creep::Layer;
use snaprod::plot::{self, Energies, LossGroup, SnapLosses, StrainMap};

/// Columns of the strain map.
const COLUMNS: usize = 400;
/// Decades of the dissipation density that are told apart.
const DECADES: f64 = 8.0;

/// Passages from and to the neighbourhood of equilibrium that end with less elastic energy.
pub fn snaps(layers: &[Layer]) -> impl Iterator<Item = &Layer> {
    let whole = |layer: &&Layer| layer.whole && layer.elastic_to < layer.elastic_from;
    layers.iter().filter(whole)
}

/// The energies over time.
pub fn energies<K: Kind>(
    task: &Task,
    record: &Record<K>,
    layers: &[Layer],
    driven: bool,
) -> Energies {
    let track = &record.track;
    let first = track.first().map_or(0.0, |m| m.ledger.total());
    let column = |f: &dyn Fn(&Ledger) -> f64| track.iter().map(|m| f(&m.ledger)).collect();
    let or_none =
        |used: bool, f: &dyn Fn(&Ledger) -> f64| if used { column(f) } else { Vec::new() };
    let held = track.iter().any(|m| m.ledger.potential != 0.0);
    Energies {
        time: track.iter().map(|m| m.t).collect(),
        kinetic: column(&|l| l.kinetic),
        elastic: column(&|l| l.elastic),
        potential: or_none(held, &|l| l.potential),
        dissipated: column(&|l| l.dissipated),
        work: or_none(driven, &|l| l.work),
        total: column(&|l| l.kinetic + l.elastic + l.potential),
        error: column(&|l| l.total() - first),
        snaps: snaps(layers).map(|l| l.peak).collect(),
        units: task.labels.clone(),
    }
}

/// One of the strains over (t, s), with the dissipation density where there is any.
pub fn strain<K: Kind>(
    task: &Task,
    record: &Record<K>,
    layers: &[Layer],
    strain: usize,
    label: &str,
) -> StrainMap {
    let stride = record.track.len().div_ceil(COLUMNS).max(1);
    let columns: Vec<&Moment<K::Shape>> = record.track.iter().step_by(stride).collect();
    let dissipates = columns
        .iter()
        .any(|m| m.dissipation.iter().any(|d| *d > 0.0));
    let dissipation = columns.iter().map(|m| m.dissipation.clone());
    StrainMap {
        time: columns.iter().map(|m| m.t).collect(),
        s: places().iter().map(|s| s * task.scales.length).collect(),
        strain: columns.iter().map(|m| m.strains[strain].clone()).collect(),
        strain_label: label.to_owned(),
        dissipation: dissipation.filter(|_| dissipates).collect(),
        decades: Some(DECADES),
        snaps: snaps(layers).map(|l| l.peak).collect(),
        units: task.labels.clone(),
        ..StrainMap::default()
    }
}

/// Draws what the passages dissipated, against what they released, if there are any.
pub fn losses(task: &Task, layers: &[Layer]) {
    let snaps: Vec<&Layer> = snaps(layers).collect();
    if snaps.is_empty() {
        return;
    }
    let losses = SnapLosses {
        groups: vec![LossGroup {
            name: "passages".into(),
            released: snaps
                .iter()
                .map(|l| l.elastic_from - l.elastic_to)
                .collect(),
            dissipated: snaps.iter().map(|l| l.dissipated).collect(),
            labels: (1..=snaps.len()).map(|i| i.to_string()).collect(),
        }],
        released_label: "elastic energy released on the way".into(),
        units: task.labels.clone(),
        ..SnapLosses::default()
    };
    let draw = plot::dissipated_against_released;
    task.out.figure("losses", || Ok(losses), draw);
}
