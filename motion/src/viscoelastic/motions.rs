//! Viscoelastic motions boxed behind the trait [`Motion`], so that callers do not compile the generic runs again.

use super::contacts::AroundRod;
use super::run::{ViscousRun, ViscousStart};
use crate::{Motion, Options};
use nalgebra::Isometry3;
use snaprod_systems::body::{EndBody, Mass, PointMass};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::rod::{DistributedLoad, LoadsWithoutPotential};
use snaprod_systems::section::rate::Viscoelastic;
use snaprod_systems::section::{LawInTime, Strain, StrainName};
use snaprod_systems::viscoelastic::kinematics::Local;
use snaprod_systems::viscoelastic::material::Material;
use snaprod_systems::viscoelastic::plane::Plane;
use snaprod_systems::viscoelastic::space::Space;

/// Loads along a rod in space, in the frame of the clamp and the units of the rod, and its elastic law in time.
#[derive(Debug, Clone, Default)]
pub struct AlongRod {
    /// Dead forces.
    pub dead: Option<DistributedLoad>,
    /// Loads without a potential.
    pub turning: Option<LoadsWithoutPotential>,
    /// The elastic law, if it varies in time.
    pub law_in_time: Option<LawInTime>,
}

/// The strains of a rod in space that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeStrains {
    /// u1, u2, u3: shear and stretch are rigid.
    Flexure,
    /// u1, u2, u3, v3: shear is rigid.
    Stretch,
    /// All six.
    All,
}

impl AlongRod {
    fn on<const M: usize>(self, material: Material<M>) -> Material<M> {
        material
            .under(self.dead)
            .turned_by(self.turning)
            .with_law_in_time(self.law_in_time)
    }
}

impl FreeStrains {
    /// The strains that a section leaves free; `rigid`: which strains are held.
    ///
    /// # Errors
    /// Shear and stretch held rigid in a combination without kinematics; flexure or twist held rigid.
    pub fn of(rigid: [bool; 6]) -> Result<Self> {
        let [u1, u2, u3, rigid @ ..] = rigid;
        if u1 || u2 || u3 {
            return Err(Error::domain(
                "rod.section holds flexure or twist rigid: a rod with friction and without mass bends and twists freely; \
                 write inertia = \"full\" in [rod], or leave out its friction, or give the strain a stiffness",
            ));
        }
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

    /// Names of the strains.
    pub fn names(self) -> &'static [StrainName] {
        use StrainName::{U1, U2, U3, V3};
        match self {
            Self::Flexure => &[U1, U2, U3],
            Self::Stretch => &[U1, U2, U3, V3],
            Self::All => &StrainName::ALL,
        }
    }
}

/// The motion of a mass on a viscoelastic rod in the plane, among obstacles if there are any.
///
/// # Errors
/// As [`ViscousRun::new`] and [`ViscousRun::among_obstacles`].
pub fn in_plane<'a>(
    material: Material<1>,
    body: &'a PointMass<2>,
    start: &ViscousStart<'_, 1, 2>,
    around: Option<AroundRod<'a>>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let shared = body.is_damped() || body.is_driven() || material.varies_in_time();
    let run = ViscousRun::new(Plane, material, body, start, options)?;
    Ok(Box::new(match around {
        Some(around) => run.among_obstacles(around, shared)?,
        None => run,
    }))
}

/// The motion of a body at the end of a viscoelastic rod in space, with the kinematics of its strains and its joint.
/// The start gives all six strains, and the twist of the end (angular velocity first; a ball joint takes the velocity
/// alone). Among obstacles if there are any.
///
/// # Errors
/// As [`ViscousRun::new`] and [`ViscousRun::among_obstacles`].
pub fn in_space<'a>(
    section: Viscoelastic,
    strains: FreeStrains,
    along: AlongRod,
    carried: &'a Mass,
    start: &ViscousStart<'_, 6, 6>,
    around: Option<AroundRod<'a>>,
    options: Options,
) -> Result<Box<dyn Motion<'a> + 'a>> {
    let in_time = along.turning.is_some() || along.law_in_time.is_some();
    let task = StartRun {
        start,
        around,
        shared: in_time || carried.is_damped() || carried.is_driven(),
        options,
    };
    dispatch(section, along, strains, carried, task)
}

/// A task on a rod in space, generic in the numbers of its strains (M) and of its end velocities (D).
pub(super) trait InSpace<'a> {
    /// Result of the task.
    type Output;

    /// Runs the task for these numbers.
    fn with<B, const M: usize, const D: usize>(
        self,
        material: Material<M>,
        body: &'a B,
    ) -> Result<Self::Output>
    where
        B: EndBody<D, Pose = Isometry3<f64>>;
}

/// Chooses M and D by strains and joint, and runs the task.
pub(super) fn dispatch<'a, T: InSpace<'a>>(
    section: Viscoelastic,
    along: AlongRod,
    strains: FreeStrains,
    carried: &'a Mass,
    task: T,
) -> Result<T::Output> {
    match carried {
        Mass::Rigid(body) => with_body::<_, _, 6>(section, along, strains, body, task),
        Mass::Point(body) => with_body::<_, _, 3>(section, along, strains, body, task),
    }
}

fn with_body<'a, B, T: InSpace<'a>, const D: usize>(
    section: Viscoelastic,
    along: AlongRod,
    strains: FreeStrains,
    body: &'a B,
    task: T,
) -> Result<T::Output>
where
    B: EndBody<D, Pose = Isometry3<f64>>,
{
    match strains {
        FreeStrains::Flexure => task.with::<B, 3, D>(
            along.on(Material::new(section, Space::<3, D>::places())?),
            body,
        ),
        FreeStrains::Stretch => task.with::<B, 4, D>(
            along.on(Material::new(section, Space::<4, D>::places())?),
            body,
        ),
        FreeStrains::All => task.with::<B, 6, D>(
            along.on(Material::new(section, Space::<6, D>::places())?),
            body,
        ),
    }
}

/// The task that begins a run.
struct StartRun<'a, 's, 'f> {
    start: &'s ViscousStart<'f, 6, 6>,
    around: Option<AroundRod<'a>>,
    shared: bool,
    options: Options,
}

impl<'a> InSpace<'a> for StartRun<'a, '_, '_> {
    type Output = Box<dyn Motion<'a> + 'a>;

    fn with<B, const M: usize, const D: usize>(
        self,
        material: Material<M>,
        body: &'a B,
    ) -> Result<Self::Output>
    where
        B: EndBody<D, Pose = Isometry3<f64>>,
    {
        let active = |strain: &Strain| -> Local<M> { material.active_of(strain) };
        let relaxed = self
            .start
            .relaxed
            .map(|field| move |x: f64| active(&field(x)));
        let start = ViscousStart {
            strain: &|x| active(&(self.start.strain)(x)),
            relaxed: relaxed.as_ref().map(|f| f as &dyn Fn(f64) -> Local<M>),
            // A ball joint takes the velocity alone.
            velocity: self.start.velocity.fixed_rows::<D>(6 - D).into_owned(),
        };
        let run = ViscousRun::new(
            Space::<M, D>::new(),
            material.clone(),
            body,
            &start,
            self.options,
        )?;
        Ok(Box::new(match self.around {
            Some(around) => run.among_obstacles(around, self.shared)?,
            None => run,
        }))
    }
}
