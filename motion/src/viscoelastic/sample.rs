//! State of a viscoelastic run at one moment.

use crate::Ledger;
use crate::contact::ContactSample;
use nalgebra::{DVector, Vector6};
use snaprod_systems::body::EndBody;
use snaprod_systems::viscoelastic::grid::Grid;
use snaprod_systems::viscoelastic::kinematics::{AtEnd, Kinematics, Local};
use snaprod_systems::viscoelastic::loads_at_nodes::LoadsAtNodes;
use snaprod_systems::viscoelastic::reduced::{Configuration, Flow};
use snaprod_systems::viscoelastic::system::ViscousSystem;
use std::sync::Arc;

/// State of a viscoelastic run at one moment, with derived quantities.
#[derive(Debug, Clone)]
pub struct ViscousSample<K: Kinematics<M, D>, const M: usize, const D: usize> {
    /// Time.
    pub t: f64,
    /// The nodes.
    pub grid: Arc<Grid>,
    /// Strains, memory, shape, stored energy.
    pub configuration: Configuration<K::Shape, M, D>,
    /// End wrench, strain rates, overstress.
    pub flow: Flow<M, D>,
    /// Pose of the end.
    pub pose: K::Pose,
    /// Velocity of the end.
    pub velocity: AtEnd<D>,
    /// Energies.
    pub ledger: Ledger,
    /// Energy that the rod has dissipated so far: the ledger's dissipation without drag on the body.
    pub friction: f64,
    /// Energy dissipated per length and time, at the nodes.
    pub dissipation: Vec<f64>,
    /// Loads per length at the nodes; `None` without a load.
    pub loads: Option<LoadsAtNodes>,
    /// Contacts of the body; None without obstacles.
    pub contact: Option<ContactSample>,
}

impl<K: Kinematics<M, D>, const M: usize, const D: usize> ViscousSample<K, M, D> {
    /// The sample of a state of `system` with its shape and flow.
    pub(super) fn new<B: EndBody<D, Pose = K::Pose>>(
        system: &ViscousSystem<K, B, M, D>,
        y: &DVector<f64>,
        configuration: Configuration<K::Shape, M, D>,
        flow: Flow<M, D>,
    ) -> Self {
        let pose = system.rod.kinematics.pose(&configuration.shape);
        let velocity = system.velocity(y);
        let time = system.layout().time();
        Self {
            t: y[time],
            grid: system.rod.grid.clone(),
            ledger: Ledger {
                rod_kinetic: 0.0,
                kinetic: system.body.kinetic(y[time], &pose, &velocity),
                elastic: configuration.energy,
                potential: system.body.potential(y[time], &pose) + configuration.potential,
                dissipated: y[time + 1] + y[time + 3],
                work: y[time + 2],
            },
            friction: y[time + 1],
            dissipation: system.rod.dissipation(&configuration, &flow),
            loads: system.rod.material.loads_at(system.rod.grid.nodes()),
            contact: None,
            configuration,
            flow,
            pose,
            velocity,
        }
    }

    /// Resultants (couple, force) along the directors at the nodes.
    pub fn resultants(&self, kinematics: &K) -> Vec<Vector6<f64>> {
        let shape = &self.configuration.shape;
        kinematics.resultants(&self.grid, shape, &self.flow.wrench, self.loads.as_ref())
    }

    /// The strains at arc lengths in [0, 1], in growing order.
    pub fn strains_at(&self, places: &[f64]) -> Vec<Local<M>> {
        self.grid.at_each(&self.configuration.strains, places)
    }

    /// Dissipation per length and time at arc lengths in [0, 1], in growing order.
    pub fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        let density: Vec<Local<1>> = self.dissipation.iter().map(|d| Local::from([*d])).collect();
        // The interpolating polynomial of the nonnegative density may be negative, by the size of its last
        // coefficients.
        let values = self.grid.at_each(&density, places);
        values.iter().map(|d| d[0].max(0.0)).collect()
    }

    /// Distance of the rod from equilibrium, in [0, 1]: o/(o + r) with the root mean squares over the rod of
    /// the overstress, o, and of the resultants that are taken up, r.
    pub fn distance(&self) -> f64 {
        let mean = |field: &[Local<M>]| {
            let squares = field.iter().zip(self.grid.weights());
            squares
                .map(|(x, w)| w * x.norm_squared())
                .sum::<f64>()
                .sqrt()
        };
        let over = mean(&self.flow.overstress);
        if over == 0.0 {
            return 0.0;
        }
        over / (over + mean(&self.configuration.taken))
    }
}
