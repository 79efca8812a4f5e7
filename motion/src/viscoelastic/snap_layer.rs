//! Layers: fast passages in which the rod is far from equilibrium, such as snaps (AMV (8.6)).

use super::sample::ViscousSample;
use snaprod_systems::viscoelastic::kinematics::Kinematics;

/// A passage between two states next to equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Time at which the rod left the neighbourhood of equilibrium.
    pub from: f64,
    /// Time of return, or end of the run.
    pub to: f64,
    /// Time of largest dissipation rate, among the ends of steps.
    pub peak: f64,
    /// Stored energy at the start.
    pub elastic_from: f64,
    /// Stored energy at the end.
    pub elastic_to: f64,
    /// Energy dissipated by the rod in the layer.
    pub dissipated: f64,
    /// False if the run began or ended in the layer.
    pub whole: bool,
}

impl Layer {
    /// The layer in other units: one unit of time becomes `time`, one of energy `energy`.
    pub fn scaled(&self, time: f64, energy: f64) -> Self {
        Self {
            from: self.from * time,
            to: self.to * time,
            peak: self.peak * time,
            elastic_from: self.elastic_from * energy,
            elastic_to: self.elastic_to * energy,
            dissipated: self.dissipated * energy,
            whole: self.whole,
        }
    }
}

/// A layer begins above the first distance from equilibrium and ends below the second one
/// ([`ViscousSample::distance`]).
const LEAVES: f64 = 0.1;
const RETURNS: f64 = 0.03;

/// Watches a run for layers.
#[derive(Debug)]
pub(super) struct LayerWatch {
    /// The layer under way.
    open: Option<Open>,
}

#[derive(Debug)]
struct Open {
    layer: Layer,
    dissipated: f64,
    last: (f64, f64),
    power: f64,
}

impl Open {
    fn begin<K: Kinematics<M, D>, const M: usize, const D: usize>(
        at: &ViscousSample<K, M, D>,
        whole: bool,
    ) -> Self {
        Self {
            layer: Layer {
                from: at.t,
                to: at.t,
                peak: at.t,
                elastic_from: at.ledger.elastic,
                elastic_to: at.ledger.elastic,
                dissipated: 0.0,
                whole,
            },
            dissipated: at.friction,
            last: (at.t, at.friction),
            power: 0.0,
        }
    }

    fn end<K: Kinematics<M, D>, const M: usize, const D: usize>(
        &mut self,
        at: &ViscousSample<K, M, D>,
    ) {
        let power = (at.friction - self.last.1) / (at.t - self.last.0);
        if power > self.power {
            self.power = power;
            self.layer.peak = 0.5 * (at.t + self.last.0);
        }
        self.last = (at.t, at.friction);
        self.layer.to = at.t;
        self.layer.elastic_to = at.ledger.elastic;
        self.layer.dissipated = at.friction - self.dissipated;
    }
}

impl LayerWatch {
    pub(super) fn new<K: Kinematics<M, D>, const M: usize, const D: usize>(
        first: &ViscousSample<K, M, D>,
    ) -> Self {
        Self {
            open: (first.distance() > LEAVES).then(|| Open::begin(first, false)),
        }
    }

    /// Takes the state after a step; returns a layer that has ended.
    pub(super) fn look<K: Kinematics<M, D>, const M: usize, const D: usize>(
        &mut self,
        now: &ViscousSample<K, M, D>,
    ) -> Option<Layer> {
        let distance = now.distance();
        match &mut self.open {
            Some(open) => {
                open.end(now);
                (distance < RETURNS)
                    .then(|| self.open.take().map(|open| open.layer))
                    .flatten()
            }
            None => {
                if distance > LEAVES {
                    self.open = Some(Open::begin(now, true));
                }
                None
            }
        }
    }

    /// The layer in which the run ends.
    pub(super) fn cut<K: Kinematics<M, D>, const M: usize, const D: usize>(
        &mut self,
        now: &ViscousSample<K, M, D>,
    ) -> Option<Layer> {
        let mut open = self.open.take()?;
        if now.t > open.last.0 {
            open.end(now);
        }
        open.layer.whole = false;
        Some(open.layer)
    }
}
