//! A run of an assembly of rods with mass.

use super::model::{Begun, Model};
use super::sample::curve;
use crate::assembly::Place;
use crate::creep::grid::Grid;
use crate::creep::kinematics::Local;
use crate::error::{Error, Result};
use crate::inertia::assembly::{HeavyAssembly, HeavyState};
use crate::inertia::rod::{HeavyRod, Moving};
use crate::motion::{Labels, Ledger, State};
use crate::section::Strain;
use crate::solve::system::AnySystem;
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3, Vector6};
use std::sync::Arc;

/// How an assembly of rods with mass starts.
pub struct HeavyAssemblyStart<'a> {
    /// Places and twists of the bodies.
    pub bodies: Vec<Place>,
    /// The rods.
    pub rods: Vec<RodStart<'a>>,
    /// True: at the equilibrium under all loads at the time 0 that is near.
    pub settled: bool,
    /// True: with the rates at which rods without mass would follow the bodies.
    pub following: bool,
}

/// How one of its rods starts.
pub struct RodStart<'a> {
    /// Turn of the base in the world, where it is on a ball joint.
    pub base: UnitQuaternion<f64>,
    /// All strains at s in [0, 1].
    pub strain: Box<dyn Fn(f64) -> Strain + 'a>,
    /// How fast they change; not asked for where rods follow.
    pub rate: Box<dyn Fn(f64) -> Strain + 'a>,
}

/// Nodes on the elements of every rod, from those of all in a row.
fn split(given: &HeavyAssembly, counts: &[usize]) -> Vec<Vec<usize>> {
    let mut at = 0;
    let rods = given.links.iter().map(|link| {
        let elements = link.rod.given.breaks().len() + 1;
        at += elements;
        counts[at - elements..at].to_vec()
    });
    rods.collect()
}

/// The assembly at so many nodes at the start.
pub(super) fn begun(
    given: &HeavyAssembly,
    start: &HeavyAssemblyStart<'_>,
    counts: &[usize],
) -> Result<Begun> {
    let assembly = given.with_nodes(&split(given, counts))?;
    let field = |link: &HeavyRod, f: &dyn Fn(f64) -> Strain| -> Vec<f64> {
        let nodes = link.sections.grid.nodes().iter();
        link.coordinates(&nodes.map(|s| f(*s)).collect::<Vec<Strain>>())
    };
    let rods = || assembly.links.iter().zip(&start.rods);
    let strains: Vec<_> = rods()
        .map(|(link, at)| field(&link.rod, &*at.strain))
        .collect();
    let rates: Vec<_> = rods()
        .map(|(link, at)| field(&link.rod, &*at.rate))
        .collect();
    let finite = strains
        .iter()
        .chain(&rates)
        .flatten()
        .all(|x| x.is_finite());
    if !finite {
        return Err(Error::domain(
            "the strains at the start and their rates must be finite",
        ));
    }
    let bases: Vec<_> = start.rods.iter().map(|rod| rod.base).collect();
    let mut y = assembly.closed(&assembly.state(&start.bodies, &bases, &strains, &rates))?;
    if start.settled {
        y = assembly.settled(&y)?;
    }
    if start.following {
        let twists: Vec<_> = start.bodies.iter().map(|place| place.twist).collect();
        y = assembly.following(&y, &twists)?;
    }
    Ok((Box::new(Arc::new(assembly)), y))
}

impl Model for Arc<HeavyAssembly> {
    fn system(&self) -> &dyn AnySystem {
        &**self
    }

    fn time(&self) -> usize {
        HeavyAssembly::time(self)
    }

    fn sample(&self, y: &DVector<f64>, implicit: bool) -> Option<Box<dyn State>> {
        let at = self.at(y)?;
        let unknowns = match implicit {
            true => DVector::from_column_slice(self.second(y)),
            false => self.accelerations(&at)?,
        };
        Some(Box::new(HeavyAssemblySample::new(self, y, at, &unknowns)?))
    }

    fn rods(&self, y: &DVector<f64>) -> Option<Vec<(&HeavyRod, Moving)>> {
        let rods = self.links.iter().map(|link| &link.rod);
        Some(rods.zip(self.at(y)?.rods).collect())
    }

    fn regridded(&self, y: &DVector<f64>, counts: &[usize]) -> Option<Begun> {
        let next = self.with_nodes(&split(self, counts)).ok()?;
        let state = next.closed(&next.carried(self, y)?).ok()?;
        Some((Box::new(Arc::new(next)), state))
    }

    fn held(&self, y: &DVector<f64>, bound: f64) -> Option<DVector<f64>> {
        let [gap, leaving] = self.gap(&self.at(y)?);
        match gap.max(leaving) > bound {
            true => self.closed(y).ok(),
            false => None,
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        HeavyAssembly::next_break(self, t)
    }
}

/// The state of an assembly of rods with mass at one moment.
#[derive(Debug, Clone)]
pub struct HeavyAssemblySample {
    assembly: Arc<HeavyAssembly>,
    at: HeavyState,
    places: Vec<Place>,
    grooves: Vec<Option<Vector3<f64>>>,
    /// Power lost per length at the nodes of the first rod.
    lost: Vec<f64>,
    /// (couple, force) on the end of the first rod.
    action: Vector6<f64>,
    ledger: Ledger,
    friction: f64,
    drift: f64,
}

impl HeavyAssemblySample {
    fn new(
        assembly: &Arc<HeavyAssembly>,
        y: &DVector<f64>,
        at: HeavyState,
        unknowns: &DVector<f64>,
    ) -> Option<Self> {
        let ([kinetic, rod_kinetic, elastic, potential], mut lost) = assembly.energies(&at)?;
        let time = assembly.time();
        let [gap, _] = assembly.gap(&at);
        Some(Self {
            places: at.places(),
            grooves: assembly.groove_forces(&at, unknowns.as_slice())?,
            lost: lost.swap_remove(0),
            action: -assembly.end_wrench(0, unknowns.as_slice()),
            ledger: Ledger {
                kinetic,
                rod_kinetic,
                elastic,
                potential,
                dissipated: y[time + 1] + y[time + 3],
                work: y[time + 2],
            },
            friction: y[time + 1],
            drift: gap,
            assembly: assembly.clone(),
            at,
        })
    }

    fn grid(&self) -> &Grid {
        &self.assembly.links[0].rod.sections.grid
    }
}

/// The first rod stands for all where one is asked for.
impl State for HeavyAssemblySample {
    fn time(&self) -> f64 {
        self.at.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.at.rods[0].shape.end()
    }

    fn twist(&self) -> Vector6<f64> {
        self.at.rods[0].flow.end()
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

    fn bodies(&self) -> &[Place] {
        &self.places
    }

    fn curves(&self, points: usize) -> Vec<Vec<Isometry3<f64>>> {
        let rods = self.assembly.links.iter().zip(&self.at.rods).enumerate();
        let rods =
            rods.map(|(k, (link, at))| curve(&link.rod, &self.at.base(k), &at.strains, points));
        rods.collect()
    }

    fn groove_forces(&self) -> Vec<Option<Vector3<f64>>> {
        self.grooves.clone()
    }

    fn drift(&self) -> f64 {
        self.drift
    }

    fn strains_at(&self, places: &[f64]) -> Vec<Strain> {
        self.grid().at_each(&self.at.rods[0].strains, places)
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        let density: Vec<Local<1>> = self.lost.iter().map(|d| Local::from([*d])).collect();
        let values = self.grid().at_each(&density, places);
        values.iter().map(|d| d[0].max(0.0)).collect()
    }

    fn sections(&self, points: usize) -> Vec<Isometry3<f64>> {
        self.curves(points).swap_remove(0)
    }
}
