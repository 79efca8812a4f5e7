//! Viscoelastic motions behind the one trait [`Motion`]: whoever asks for one by these functions compiles none of them again.

use super::run::{ViscousRun, ViscousStart};
use super::sample::ViscousSample;
use crate::body::{Body, EndBody};
use crate::creep::kinematics::{AtEnd, Local};
use crate::creep::material::Material;
use crate::creep::plane::Plane;
use crate::creep::space::Space;
use crate::error::{Error, Result};
use crate::motion::reduction::Carried;
use crate::motion::{Motion, Options, State};
use crate::section::rate::Viscoelastic;
use crate::section::{Strain, StrainName};
use nalgebra::Isometry3;

/// The strains of a rod in space that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moving {
    /// u1, u2, u3: shear and stretch are rigid.
    Flexure,
    /// u1, u2, u3, v3: shear is rigid.
    Stretch,
    /// All six.
    All,
}

impl Moving {
    /// Those that a section does not hold rigid; `rigid` says it of v1, v2, v3.
    ///
    /// # Errors
    /// Shear and stretch held rigid in a combination that has no kinematics.
    pub fn of(rigid: [bool; 3]) -> Result<Self> {
        match rigid {
            [true, true, true] => Ok(Self::Flexure),
            [true, true, false] => Ok(Self::Stretch),
            [false, false, false] => Ok(Self::All),
            _ => {
                let named = |held: bool| {
                    let names = ["v1", "v2", "v3"].iter().zip(rigid);
                    let list: Vec<&str> = names
                        .filter(|(_, is)| *is == held)
                        .map(|(n, _)| *n)
                        .collect();
                    list.join(" and ")
                };
                let (still, free) = (named(true), named(false));
                Err(Error::domain(format!(
                    "rod.section holds {still} rigid and lets {free} move: in a motion v1, v2 and v3 are all rigid, or v1 and v2 \
                     alone, or none; give {still} a stiffness in [rod.section], or hold {free} rigid, too"
                )))
            }
        }
    }

    /// Their names.
    pub fn names(self) -> &'static [StrainName] {
        use StrainName::{U1, U2, U3, V3};
        match self {
            Self::Flexure => &[U1, U2, U3],
            Self::Stretch => &[U1, U2, U3, V3],
            Self::All => &StrainName::ALL,
        }
    }
}

/// The motion of a mass on a viscoelastic rod in the plane.
///
/// # Errors
/// As [`ViscousRun::new`].
pub fn in_plane<'a>(
    material: Material<1>,
    body: &'a Body<2>,
    start: &ViscousStart<'_, 1, 2>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let run = ViscousRun::new(Plane, material, body, start, options)?;
    Ok(Box::new(run))
}

/// The motion of what a viscoelastic rod in space carries, with the kinematics that its strains and its joint ask for. The start gives all six
/// strains, and the twist of the end (angular velocity first; a ball joint takes the velocity alone).
///
/// # Errors
/// As [`ViscousRun::new`].
pub fn in_space<'a>(
    section: Viscoelastic,
    strains: Moving,
    carried: &'a Carried,
    start: &ViscousStart<'_, 6, 6>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    match carried {
        Carried::Welded(body) => with_body(section, strains, body, start, start.velocity, options),
        Carried::BallJoint(body) => {
            let velocity = start.velocity.fixed_rows::<3>(3).into_owned();
            with_body(section, strains, body, start, velocity, options)
        }
    }
}

fn with_body<'a, B, const D: usize>(
    section: Viscoelastic,
    strains: Moving,
    body: &'a B,
    start: &ViscousStart<'_, 6, 6>,
    velocity: AtEnd<D>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>>
where
    B: EndBody<D, Pose = Isometry3<f64>>,
{
    match strains {
        Moving::Flexure => with_strains::<B, 3, D>(section, body, start, velocity, options),
        Moving::Stretch => with_strains::<B, 4, D>(section, body, start, velocity, options),
        Moving::All => with_strains::<B, 6, D>(section, body, start, velocity, options),
    }
}

fn with_strains<'a, B, const M: usize, const D: usize>(
    section: Viscoelastic,
    body: &'a B,
    start: &ViscousStart<'_, 6, 6>,
    velocity: AtEnd<D>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>>
where
    B: EndBody<D, Pose = Isometry3<f64>>,
    ViscousSample<Space<M, D>, M, D>: State,
{
    let material = Material::new(section, Space::<M, D>::places())?;
    let active = |strain: &Strain| -> Local<M> { material.active_of(strain) };
    let relaxed = start.relaxed.map(|field| move |x: f64| active(&field(x)));
    let start = ViscousStart {
        strain: &|x| active(&(start.strain)(x)),
        relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Local<M>),
        velocity,
    };
    let run = ViscousRun::new(
        Space::<M, D>::new(),
        material.clone(),
        body,
        &start,
        options,
    )?;
    Ok(Box::new(run))
}
