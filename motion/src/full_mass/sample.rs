//! State of a run of rods with mass at one moment.

use crate::{Labels, Ledger, RodCurve, State};
use nalgebra::{DVector, Isometry3, Matrix3, Rotation3, Vector3, Vector6};
use snaprod_systems::assembly::BodyMotion;
use snaprod_systems::full_mass::assembly::{HeavyAssembly, HeavyState};
use snaprod_systems::full_mass::frames::{Curve, Sections};
use snaprod_systems::full_mass::rod::{HeavyRod, RodState};
use snaprod_systems::math::se3::joined;
use snaprod_systems::section::Strain;
use snaprod_systems::viscoelastic::grid::Grid;
use snaprod_systems::viscoelastic::kinematics::Local;
use std::sync::Arc;

/// State of a run of rods with mass at one moment: one rod with its body, or an assembly. Quantities of one
/// rod are those of the first rod.
#[derive(Debug, Clone)]
pub struct HeavySample {
    t: f64,
    of: SampledModel,
    /// Power lost per length, at the nodes.
    lost: Vec<f64>,
    /// (couple, force) of the rod on the body or support at its end.
    action: Vector6<f64>,
    ledger: Ledger,
    friction: f64,
}

#[derive(Debug, Clone)]
enum SampledModel {
    Rod(Arc<HeavyRod>, Box<RodState>),
    Assembly(Box<SampledAssembly>),
}

#[derive(Debug, Clone)]
struct SampledAssembly {
    assembly: Arc<HeavyAssembly>,
    at: HeavyState,
    places: Vec<BodyMotion>,
    grooves: Vec<Option<Vector3<f64>>>,
    drift: f64,
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
    /// The sample of a state of one rod with its second derivatives; None outside the law's domain.
    pub(super) fn of_rod(rod: &Arc<HeavyRod>, y: &DVector<f64>, second: &[f64]) -> Option<Self> {
        let at = rod.at(y)?;
        let time = rod.time();
        let t = y[time];
        let balance = HeavyRod::balance(rod, t, &at, second)?;
        let [kinetic, rod_kinetic] = rod.kinetic(t, &at);
        let (elastic, lost) = rod.stored(&at)?;
        let energies = [kinetic, rod_kinetic, elastic, rod.potential(t, &at)];
        Some(Self {
            t,
            action: *balance.wrenches.last()?,
            ledger: ledger(energies, y, time),
            friction: y[time + 1],
            lost,
            of: SampledModel::Rod(rod.clone(), Box::new(at)),
        })
    }

    /// The sample of a state of an assembly with its accelerations and multipliers; None outside the law's domain.
    pub(super) fn of_assembly(
        assembly: &Arc<HeavyAssembly>,
        y: &DVector<f64>,
        at: HeavyState,
        unknowns: &DVector<f64>,
    ) -> Option<Self> {
        let (energies, mut lost) = assembly.energies(&at)?;
        let time = assembly.time();
        let [drift, _] = assembly.gap(&at);
        Some(Self {
            t: at.t,
            action: -assembly.end_wrench(0, unknowns.as_slice()),
            ledger: ledger(energies, y, time),
            friction: y[time + 1],
            lost: lost.swap_remove(0),
            of: SampledModel::Assembly(Box::new(SampledAssembly {
                places: at.places(),
                grooves: assembly.groove_forces(&at, unknowns.as_slice())?,
                drift,
                assembly: assembly.clone(),
                at,
            })),
        })
    }

    fn rod(&self, k: usize) -> (&HeavyRod, &RodState) {
        match &self.of {
            SampledModel::Rod(rod, at) => (rod, at),
            SampledModel::Assembly(several) => {
                (&several.assembly.links[k].rod, &several.at.rods[k])
            }
        }
    }

    fn first(&self) -> (&HeavyRod, &RodState) {
        self.rod(0)
    }

    fn several(&self) -> Option<&SampledAssembly> {
        match &self.of {
            SampledModel::Rod(..) => None,
            SampledModel::Assembly(several) => Some(several),
        }
    }
}

impl State for HeavySample {
    fn time(&self) -> f64 {
        self.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.first().1.shape.end()
    }

    fn twist(&self) -> Vector6<f64> {
        let flow = &self.first().1.flow;
        match (flow.spins.last(), flow.velocities.last()) {
            (Some(spin), Some(velocity)) => joined(spin, velocity),
            _ => Vector6::zeros(),
        }
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

    /// Not computed: a rod with mass is in equilibrium only at rest.
    fn distance(&self) -> f64 {
        0.0
    }

    fn equilibrium(&self) -> Option<Labels> {
        None
    }

    fn bodies(&self) -> &[BodyMotion] {
        self.several().map_or(&[], |several| &several.places)
    }

    fn curves(&self, points: usize) -> Vec<RodCurve> {
        let Some(SampledAssembly { assembly, at, .. }) = self.several() else {
            return Vec::new();
        };
        let rods = assembly.links.iter().zip(&at.rods).enumerate();
        let rods =
            rods.map(|(k, (link, moving))| curve(&link.rod, &at.base(k), &moving.strains, points));
        rods.collect()
    }

    fn groove_forces(&self) -> Vec<Option<Vector3<f64>>> {
        self.several()
            .map_or(Vec::new(), |several| several.grooves.clone())
    }

    fn drift(&self) -> f64 {
        self.several().map_or(0.0, |several| several.drift)
    }

    fn strains_of(&self, rod: usize, places: &[f64]) -> Vec<Strain> {
        let (rod, at) = self.rod(rod);
        rod.sections.grid.at_each(&at.strains, places)
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        let density: Vec<Local<1>> = self.lost.iter().map(|d| Local::from([*d])).collect();
        let values = self.first().0.sections.grid.at_each(&density, places);
        values.iter().map(|d| d[0].max(0.0)).collect()
    }

    fn sections(&self, points: usize) -> RodCurve {
        let (rod, at) = self.first();
        let base = match self.several() {
            Some(several) => several.at.base(0),
            None => Isometry3::identity(),
        };
        curve(rod, &base, &at.strains, points)
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
    let first = match curve {
        Curve::Plane => {
            let turn = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
            let turn = Rotation3::from_matrix_unchecked(turn);
            Isometry3::from_parts(nalgebra::Translation3::identity(), turn.into())
        }
        Curve::Space => *base,
    };
    let nodes = fine.grid.nodes().iter().map(|x| x * law.length());
    let places = nodes.chain([law.length()]);
    let sections = (0..shape.positions.len()).map(|i| shape.pose(i));
    std::iter::once((0.0, first))
        .chain(places.zip(sections))
        .collect()
}
