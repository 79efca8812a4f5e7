//! The state of a run of a rod with mass at one moment.

use crate::creep::grid::Grid;
use crate::creep::kinematics::Local;
use crate::inertia::frames::{Curve, Sections};
use crate::inertia::rod::HeavyRod;
use crate::math::se3::joined;
use crate::motion::{Labels, Ledger, State};
use crate::section::Strain;
use nalgebra::{DVector, Isometry3, Matrix3, Rotation3, Vector6};
use std::sync::Arc;

/// The state of a run of a rod with mass at one moment.
#[derive(Debug, Clone)]
pub struct HeavySample {
    /// Time.
    pub t: f64,
    rod: Arc<HeavyRod>,
    /// All strains at the nodes.
    pub strains: Vec<Strain>,
    /// Their rates.
    pub rates: Vec<Strain>,
    /// Power lost per length, at the nodes.
    dissipation: Vec<f64>,
    pose: Isometry3<f64>,
    twist: Vector6<f64>,
    /// (couple, force) of the rod on the body.
    action: Vector6<f64>,
    ledger: Ledger,
    friction: f64,
    /// How well the nodes resolve rotations and positions.
    pub defect: f64,
}

impl HeavySample {
    /// The sample of a state with its second derivatives; None outside the law's domain.
    pub(super) fn new(rod: &Arc<HeavyRod>, y: &DVector<f64>, second: &[f64]) -> Option<Self> {
        let at = rod.at(y)?;
        let time = rod.time();
        let t = y[time];
        let balance = HeavyRod::balance(rod, t, &at, second)?;
        let [kinetic, rod_kinetic] = rod.kinetic(t, &at);
        let (elastic, dissipation) = rod.stored(&at)?;
        let twist = joined(at.flow.spins.last()?, at.flow.velocities.last()?);
        Some(Self {
            t,
            pose: at.shape.end(),
            twist,
            action: *balance.wrenches.last()?,
            ledger: Ledger {
                kinetic,
                rod_kinetic,
                elastic,
                potential: rod.potential(t, &at),
                dissipated: y[time + 1] + y[time + 3],
                work: y[time + 2],
            },
            friction: y[time + 1],
            dissipation,
            defect: at.shape.defect,
            strains: at.strains,
            rates: at.rates,
            rod: rod.clone(),
        })
    }

    fn grid(&self) -> &Grid {
        &self.rod.sections.grid
    }
}

impl State for HeavySample {
    fn time(&self) -> f64 {
        self.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.pose
    }

    fn twist(&self) -> Vector6<f64> {
        self.twist
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

    /// A rod with mass is in equilibrium nowhere but at rest: how far it is from it is not told.
    fn distance(&self) -> f64 {
        0.0
    }

    fn equilibrium(&self) -> Option<Labels> {
        None
    }

    fn strains_at(&self, places: &[f64]) -> Vec<Strain> {
        self.grid().at_each(&self.strains, places)
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        let density: Vec<Local<1>> = self.dissipation.iter().map(|d| Local::from([*d])).collect();
        let values = self.grid().at_each(&density, places);
        values.iter().map(|d| d[0].max(0.0)).collect()
    }

    fn sections(&self, points: usize) -> Vec<Isometry3<f64>> {
        curve(&self.rod, &Isometry3::identity(), &self.strains, points)
    }
}

/// Sections of a rod with these strains at its nodes that begins at `base`: that one, `points` on every element, the end; none if the
/// strains are too large for a shape.
pub(super) fn curve(
    rod: &HeavyRod,
    base: &Isometry3<f64>,
    strains: &[Strain],
    points: usize,
) -> Vec<Isometry3<f64>> {
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
    let sections = (0..shape.positions.len()).map(|i| shape.pose(i));
    std::iter::once(first).chain(sections).collect()
}
