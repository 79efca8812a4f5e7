//! Initial states of rods with mass and their bodies.

use crate::{Ledger, Options};
use nalgebra::{DVector, UnitQuaternion, Vector3, Vector6};
use snaprod_systems::assembly::BodyMotion;
use snaprod_systems::error::{Error, Result};
use snaprod_systems::full_mass::assembly::{HeavyAssembly, HeavyLink};
use snaprod_systems::full_mass::rod::HeavyRod;
use snaprod_systems::math::se3::join;
use snaprod_systems::section::Strain;

/// Initial state of rods with mass.
pub struct HeavyStart<'a> {
    /// Poses and twists of the bodies of the list.
    pub bodies: Vec<BodyMotion>,
    /// The rods.
    pub rods: Vec<RodStart<'a>>,
    /// Coordinates of the joints with axes, as [`HeavyAssembly::with_joints_at`]; or none, where all are 0.
    pub joints: Vec<f64>,
    /// True: start at the nearby equilibrium under all loads at the time 0, a stable one if all ends are free.
    pub settled: bool,
    /// True: start with the rates at which rods without mass would follow the bodies.
    pub following: bool,
}

/// A strain, or a rate of strain, at s in [0, 1].
pub type StrainAt<'a> = Box<dyn Fn(f64) -> Strain + 'a>;

/// Initial state of one rod.
pub struct RodStart<'a> {
    /// Rotation of the base in the world; used for a base on a ball joint.
    pub base: UnitQuaternion<f64>,
    /// All strains at s in [0, 1].
    pub strain: StrainAt<'a>,
    /// Strains to which the Maxwell branches are relaxed; None: the initial strains.
    pub relaxed: Option<StrainAt<'a>>,
    /// Initial rates of the strains; not used with `following`.
    pub rate: StrainAt<'a>,
    /// Velocity of a body of the rod's own; used with `following`. None: at rest.
    pub velocity: Option<EndVelocity>,
}

/// (angular velocity, velocity) of the end of a rod at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EndVelocity {
    /// Seen from the clamp, along the axes of the clamp.
    OnClamp(Vector6<f64>),
    /// In the world, along the axes of the world; on a standing clamp, along those of the rod.
    InWorld(Vector6<f64>),
}

impl EndVelocity {
    /// Velocity at time 0 of the end of a rod at `place`, seen from the clamp.
    fn on_clamp(&self, rod: &HeavyRod, place: Vector3<f64>) -> Vector6<f64> {
        match (self, rod.given.grain.support()) {
            (Self::OnClamp(twist), _) | (Self::InWorld(twist), None) => *twist,
            (Self::InWorld(twist), Some(clamp)) => {
                let place = join(&Vector3::zeros(), &place);
                clamp.at(0.0).of_poses().relative(&place, twist)
            }
        }
    }
}

/// Splits the node counts of all elements in a row by rods.
pub(super) fn split(given: &HeavyAssembly, counts: &[usize]) -> Vec<Vec<usize>> {
    let mut at = 0;
    let rods = given.links.iter().map(|link| {
        let elements = link.rod.given.breaks().len() + 1;
        at += elements;
        counts[at - elements..at].to_vec()
    });
    rods.collect()
}

/// First step of a settled start, over the duration. The slopes there are rounding, which asks for far shorter steps.
const FROM_REST: f64 = 1e-2;

impl HeavyStart<'_> {
    /// The first step to try from a settled state with this ledger; None if something moves.
    pub(super) fn step_from_rest(&self, ledger: &Ledger, options: &Options) -> Option<f64> {
        let moves = ledger.kinetic + ledger.rod_kinetic;
        (self.settled && moves == 0.0).then_some(FROM_REST * options.duration)
    }

    /// The rods with `counts` nodes on the elements of all rods in a row, and their initial state.
    ///
    /// # Errors
    /// Strains and rates that are not finite, ends off their attachments; with `settled` or `following` a
    /// failed search for the equilibrium or the rates.
    pub fn at_nodes(
        &self,
        given: &HeavyAssembly,
        counts: &[usize],
    ) -> Result<(HeavyAssembly, DVector<f64>)> {
        let assembly = given.with_nodes(&split(given, counts))?;
        let rods = || assembly.links.iter().zip(&self.rods);
        let strains: Vec<_> = rods().map(|(link, at)| field(link, &*at.strain)).collect();
        finite(&strains, "the strains at the start")?;
        let rates: Vec<_> = rods().map(|(link, at)| field(link, &*at.rate)).collect();
        finite(&rates, "the rates of the strains at the start")?;
        let bases: Vec<_> = self.rods.iter().map(|rod| rod.base).collect();
        let y = assembly.state(&self.bodies, &bases, &strains, &rates);
        let mut y = assembly.closed(&assembly.with_joints_at(y, &self.joints))?;
        if self.settled {
            y = assembly.settled(&y)?;
        }
        if self.following {
            y = assembly.following(&y, &self.twists(&assembly, &y)?)?;
        }
        let relaxed = rods().map(|(link, at)| Some(field(link, &**at.relaxed.as_ref()?)));
        let relaxed: Vec<_> = relaxed.collect();
        let given = relaxed.iter().flatten();
        finite(
            given,
            "the strains to which the Maxwell branches are relaxed",
        )?;
        let y = assembly.relaxed(y, &relaxed);
        Ok((assembly, y))
    }

    /// Twists of all bodies in the state `y`: listed bodies first, then bodies of rods.
    fn twists(&self, assembly: &HeavyAssembly, y: &DVector<f64>) -> Result<Vec<Vector6<f64>>> {
        let at = assembly.at(y).ok_or_else(|| {
            Error::domain("the strains at the start are too large for a shape of the rods")
        })?;
        let rods = assembly.links.iter().zip(&at.rods).zip(&self.rods);
        let own = rods.filter(|((link, _), _)| link.rod.given.body.is_some());
        let own = own.map(|((link, at), start)| {
            let velocity = start.velocity.as_ref();
            let place = at.shape.end().translation.vector;
            velocity.map_or(Vector6::zeros(), |v| v.on_clamp(&link.rod, place))
        });
        let listed = self.bodies.iter().map(|place| place.twist);
        Ok(listed.chain(own).collect())
    }
}

/// Coordinates of a field at the nodes of a rod.
fn field(link: &HeavyLink, f: &dyn Fn(f64) -> Strain) -> Vec<f64> {
    let nodes = link.rod.sections.grid.nodes().iter();
    link.rod
        .coordinates(&nodes.map(|s| f(*s)).collect::<Vec<Strain>>())
}

fn finite<'a>(fields: impl IntoIterator<Item = &'a Vec<f64>>, what: &str) -> Result<()> {
    if fields.into_iter().flatten().all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(Error::domain(format!("{what} must be finite")))
    }
}
