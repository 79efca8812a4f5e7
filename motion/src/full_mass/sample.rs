//! State of a run of rods with mass at one moment.

use crate::{Ledger, RodCurve, SectionState, State};
use nalgebra::{DVector, Isometry3, Vector3, Vector6};
use snaprod_systems::assembly::BodyMotion;
use snaprod_systems::full_mass::assembly::{HeavyAssembly, HeavyState};
use snaprod_systems::full_mass::frames::Sections;
use snaprod_systems::full_mass::rod::{Balance, HeavyRod, RodState};
use snaprod_systems::section::Strain;
use snaprod_systems::viscoelastic::grid::Grid;
use snaprod_systems::viscoelastic::kinematics::Local;
use std::sync::Arc;

/// State of a run of rods with mass at one moment. Quantities of one rod are those of the first rod.
#[derive(Debug, Clone)]
pub struct HeavySample {
    assembly: Arc<HeavyAssembly>,
    at: HeavyState,
    places: Vec<BodyMotion>,
    grooves: Vec<Option<Vector3<f64>>>,
    drift: f64,
    balances: Vec<Balance>,
    /// Power lost per length, at the nodes.
    lost: Vec<f64>,
    /// (couple, force) of the rod on the body or support at its end.
    action: Vector6<f64>,
    ledger: Ledger,
    friction: f64,
}

/// The ledger from energies and from the integrals after index `time` of a state vector.
fn ledger(
    [kinetic, rod_kinetic, elastic, potential]: [f64; 4],
    y: &DVector<f64>,
    time: usize,
) -> Ledger {
    Ledger {
        kinetic,
        rod_kinetic,
        elastic,
        potential,
        dissipated: y[time + 1] + y[time + 3],
        work: y[time + 2],
    }
}

impl HeavySample {
    /// The sample of a state with its accelerations and multipliers; None outside the law's domain.
    pub(super) fn new(
        assembly: &Arc<HeavyAssembly>,
        y: &DVector<f64>,
        at: HeavyState,
        unknowns: &[f64],
    ) -> Option<Self> {
        let balance = assembly.balance(&at, unknowns)?;
        let (energies, mut lost) = assembly.energies(&at)?;
        let time = assembly.time();
        Some(Self {
            action: *balance.rods.first()?.wrenches.last()?,
            ledger: ledger(energies, y, time),
            friction: y[time + 1],
            lost: lost.swap_remove(0),
            places: at.places(),
            grooves: assembly.groove_forces(&balance, unknowns),
            balances: balance.rods,
            drift: assembly.gap(&at)[0],
            assembly: assembly.clone(),
            at,
        })
    }

    fn rod(&self, k: usize) -> (&HeavyRod, &RodState) {
        (&self.assembly.links[k].rod, &self.at.rods[k])
    }

    fn curve(&self, k: usize, points: usize) -> RodCurve {
        let (rod, at) = self.rod(k);
        curve(rod, &self.at.base(k), &at.strains, points)
    }
}

impl State for HeavySample {
    fn time(&self) -> f64 {
        self.at.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.rod(0).1.shape.end()
    }

    fn twist(&self) -> Vector6<f64> {
        self.rod(0).1.flow.end()
    }

    fn action(&self) -> Vector6<f64> {
        self.action
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    fn bodies(&self) -> &[BodyMotion] {
        &self.places
    }

    fn curves(&self, points: usize) -> Vec<RodCurve> {
        let rods = 0..self.assembly.links.len();
        rods.map(|k| self.curve(k, points)).collect()
    }

    fn groove_forces(&self) -> Vec<Option<Vector3<f64>>> {
        self.grooves.clone()
    }

    fn drift(&self) -> f64 {
        self.drift
    }

    fn strains_of(&self, rod: usize, places: &[f64]) -> Vec<Strain> {
        let (rod, at) = self.rod(rod);
        rod.sections.grid.at_each(&at.strains, places)
    }

    fn moving_sections(&self, rod: usize, places: &[f64]) -> Vec<SectionState> {
        let motions = self.assembly.motions_of(&self.at, rod, places);
        let (heavy, at) = self.rod(rod);
        let resultants = heavy.resultants(at, &self.balances[rod]);
        let resultants = heavy.sections.grid.at_each(&resultants, places);
        let each = motions.into_iter().zip(self.strains_of(rod, places));
        each.zip(resultants)
            .map(|((motion, strain), resultants)| SectionState {
                pose: motion.pose,
                twist: motion.twist,
                strain,
                resultants,
            })
            .collect()
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        let density: Vec<Local<1>> = self.lost.iter().map(|d| Local::from([*d])).collect();
        let values = self.rod(0).0.sections.grid.at_each(&density, places);
        values.iter().map(|d| d[0].max(0.0)).collect()
    }

    fn sections(&self, points: usize) -> RodCurve {
        self.curve(0, points)
    }
}

/// Sections of a rod that begins at `base`, from its strains at the nodes: base, `points` on every element,
/// end. Empty if the strains are too large for a shape.
fn curve(rod: &HeavyRod, base: &Isometry3<f64>, strains: &[Strain], points: usize) -> RodCurve {
    let grid = &rod.sections.grid;
    let fine = Grid::clone(&grid.finer(points.max(8)));
    let strains = grid.carried(strains, &fine);
    let law = &rod.given.law;
    let curve = rod.given.curve;
    let fine = Sections::new(fine, law.active(), curve, law.length());
    let Some(shape) = fine.shape(base, &strains) else {
        return Vec::new();
    };
    let first = curve.base(base);
    let nodes = fine.grid.nodes().iter().map(|x| x * law.length());
    let places = nodes.chain([law.length()]);
    let sections = (0..shape.positions.len()).map(|i| shape.pose(i));
    std::iter::once((0.0, first))
        .chain(places.zip(sections))
        .collect()
}
