//! Quantities of one state of a motion, for every model.

use super::Ledger;
use super::contact::ContactSample;
use super::run::Sample;
use super::viscoelastic::{ViscousSample, near_equilibrium};
use nalgebra::{Isometry3, Matrix3, Rotation3, Vector2, Vector3, Vector6};
use snaprod_systems::assembly::{BodyMotion, Configuration};
use snaprod_systems::elastica::chart::ChartPoint;
use snaprod_systems::elastica::{Elastica, Equilibrium};
use snaprod_systems::manifold::{EquilibriumManifold, Sheet};
use snaprod_systems::math::difference::derivative;
use snaprod_systems::math::frame::Frame;
use snaprod_systems::math::se3::{halves, join};
use snaprod_systems::section::Strain;
use snaprod_systems::viscoelastic::grid::Grid;
use snaprod_systems::viscoelastic::kinematics::{Kinematics, Local};
use snaprod_systems::viscoelastic::plane::Plane;
use snaprod_systems::viscoelastic::space::{FramedCurve, Space};

/// A state of a motion, in the frame of the clamp and in the units of the rod (length 1).
///
/// Rods in a plane lie in the plane of x and y and start along x. Their sections have d3 along the tangent
/// and d1 along z, so that u1 is the curvature.
pub trait State {
    /// Time.
    fn time(&self) -> f64;

    /// Pose of the end.
    fn pose(&self) -> Isometry3<f64>;

    /// (angular velocity of the end's directors, velocity of the end). For elastic rods the angular velocity
    /// is not computed: 0.
    fn twist(&self) -> Vector6<f64>;

    /// (couple, force) of the rod on the body: minus the end wrench w1.
    fn action(&self) -> Vector6<f64>;

    /// Energies.
    fn ledger(&self) -> Ledger;

    /// Energy dissipated by friction in the rod up to now, without drag and snaps; 0 for elastic rods.
    fn friction(&self) -> f64 {
        0.0
    }

    /// Energy of waves too fast for the steps that the method has taken out up to now, part of the dissipated energy;
    /// 0 for methods without such a loss.
    fn numerical_loss(&self) -> f64 {
        0.0
    }

    /// Relative distance of the rod from equilibrium, in [0, 1], as [`ViscousSample::distance`]; 0 for elastic rods,
    /// which are in equilibrium, and for rods with mass, which are in equilibrium only at rest.
    fn distance(&self) -> f64 {
        0.0
    }

    /// The equilibrium of the elastica that the rod is in, or near; None if there is none, or the model names none.
    fn equilibrium(&self) -> Option<Labels> {
        None
    }

    /// The Morse index of the rod with its end held; None off equilibrium.
    fn index(&self) -> Option<usize> {
        self.equilibrium().map(|labels| labels.index)
    }

    /// Poses and velocities of bodies and rods of an assembly, in the world; None in models of one rod whose
    /// body is at its end.
    fn configuration(&self) -> Option<&Configuration> {
        None
    }

    /// Poses and twists of the bodies of an assembly, in the world; empty for one rod with a body at its end.
    fn bodies(&self) -> &[BodyMotion] {
        self.configuration().map_or(&[], |now| &now.bodies)
    }

    /// Sections of the rods of an assembly that have strains of their own, each as [`State::sections`], in
    /// the world. Empty if the configuration contains the curves.
    fn curves(&self, _points: usize) -> Vec<RodCurve> {
        Vec::new()
    }

    /// Forces of grooves on the bodies in them, in the world frame of [`State::configuration`].
    fn groove_forces(&self) -> Vec<Option<Vector3<f64>>> {
        Vec::new()
    }

    /// Contacts with obstacles; None without obstacles.
    fn contact(&self) -> Option<&ContactSample> {
        None
    }

    /// Largest distance of rod ends from their attachments, in radians and lengths of the rod. It is nonzero
    /// only if poses and charts are both in the state.
    fn drift(&self) -> f64 {
        0.0
    }

    /// The six strains of rod number `rod` at arc lengths in [0, 1], in growing order. Models of one rod
    /// ignore the number.
    fn strains_of(&self, rod: usize, places: &[f64]) -> Vec<Strain>;

    /// The six strains of the first rod at arc lengths in [0, 1].
    fn strains_at(&self, places: &[f64]) -> Vec<Strain> {
        self.strains_of(0, places)
    }

    /// Dissipation per length and time at arc lengths in [0, 1], in growing order; 0 for elastic rods.
    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        vec![0.0; places.len()]
    }

    /// Sections in motion of rod number `rod` at arc lengths in [0, 1], in growing order. Rods with a free end come
    /// after the others. Empty if the strains give no shape. Velocities of light rods are differences between
    /// equilibria, with errors of some 1e-8 of the largest.
    fn moving_sections(&self, rod: usize, places: &[f64]) -> Vec<SectionState>;

    /// Sections from the clamp to the end: `points` of them for a rod on a sheet, `points` per element and
    /// the two ends for a rod with strains. Empty if the strains give no shape.
    fn sections(&self, points: usize) -> RodCurve;
}

/// A section of a rod in motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionState {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// (angular velocity, velocity); NaN for a light rod at a fold, where velocities are infinite.
    pub twist: Vector6<f64>,
    /// The six strains.
    pub strain: Strain,
    /// (couple, force) along the directors.
    pub resultants: Vector6<f64>,
}

/// Sections of a rod from its base to its end, each by its arclength in the unstrained rod and its pose.
pub type RodCurve = Vec<(f64, Isometry3<f64>)>;

/// A pose in the clamp's frame and in units of the rod's length, converted to the world: `clamp` is the pose
/// of the clamp in the world, `length` the length of the rod.
pub fn outward(clamp: &Isometry3<f64>, length: f64, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let pose = clamp * pose;
    Isometry3::from_parts((pose.translation.vector * length).into(), pose.rotation)
}

/// Converts all sections of a curve, and their arc lengths, as [`outward`].
pub fn curve_outward(clamp: &Isometry3<f64>, length: f64, curve: &mut RodCurve) {
    for (s, pose) in curve {
        (*s, *pose) = (*s * length, outward(clamp, length, pose));
    }
}

/// The end of a rod in the world, in units of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndInWorld {
    /// Pose.
    pub pose: Isometry3<f64>,
    /// Angular velocity; infinite or NaN at some ends that turn freely.
    pub spin: Vector3<f64>,
    /// Velocity, finite also where the angular velocity is not.
    pub velocity: Vector3<f64>,
    /// Couple of the rod on the body.
    pub couple: Vector3<f64>,
    /// Force of the rod on the body.
    pub force: Vector3<f64>,
}

impl EndInWorld {
    /// The end in a state that is seen from the clamp.
    pub fn new(clamp: &Frame<3>, state: &dyn State) -> Self {
        let (frame, pose, twist) = (clamp.of_poses(), state.pose(), state.twist());
        let place = join(&Vector3::zeros(), &pose.translation.vector);
        let straight = join(&Vector3::zeros(), &halves(&twist).1);
        let (couple, force) = halves(&frame.outward(&state.action()));
        Self {
            pose: clamp.pose() * pose,
            spin: halves(&frame.absolute_velocity(&place, &twist)).0,
            velocity: halves(&frame.absolute_velocity(&place, &straight)).1,
            couple,
            force,
        }
    }
}

/// A state, borrowed from the motion or made on demand.
pub enum StateRef<'a> {
    /// Stored in the motion.
    Kept(&'a dyn State),
    /// Made on demand.
    Made(Box<dyn State + 'a>),
}

impl<'a> std::ops::Deref for StateRef<'a> {
    type Target = dyn State + 'a;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Kept(state) => *state,
            Self::Made(state) => &**state,
        }
    }
}

/// Chart point, sheet and index of an equilibrium of the elastica.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labels {
    /// Chart: p.
    pub p: f64,
    /// Chart: w.
    pub w: f64,
    /// Sheet.
    pub sheet: Sheet,
    /// Morse index.
    pub index: usize,
}

impl Labels {
    /// lambda = sqrt(|force|).
    pub fn lambda(&self) -> f64 {
        ChartPoint::new(self.p, self.w).integrals.lam
    }
}

/// A section in the plane with its tangent at the angle `theta` to x: directors (z, d2, tangent).
pub(super) fn planar(x: f64, y: f64, theta: f64) -> Isometry3<f64> {
    let (sin, cos) = theta.sin_cos();
    let directors = Matrix3::new(0.0, sin, cos, 0.0, -cos, sin, 1.0, 0.0, 0.0);
    let turn = Rotation3::from_matrix_unchecked(directors);
    Isometry3::from_parts(Vector3::new(x, y, 0.0).into(), turn.into())
}

/// Relative change of the chart over the step of the differences for velocities along an elastica.
const CHANGE: f64 = 1e-3;

/// The strains of a rod of this curvature in the plane.
pub(super) fn bent(curvature: f64) -> Strain {
    Strain::new(curvature, 0.0, 0.0, 0.0, 0.0, 1.0)
}

/// A rod on a sheet of the elastica.
impl Sample<2> {
    /// The equilibrium; every state of a run lies in the chart.
    fn rod(&self) -> Option<Equilibrium> {
        Equilibrium::new(self.phase.q[0], self.phase.q[1]).ok()
    }
}

impl State for Sample<2> {
    fn time(&self) -> f64 {
        self.phase.t
    }

    fn pose(&self) -> Isometry3<f64> {
        let turned = self.rod().map_or(0.0, |rod| rod.theta1);
        planar(self.pose[0], self.pose[1], turned)
    }

    fn twist(&self) -> Vector6<f64> {
        Vector6::new(0.0, 0.0, 0.0, self.phase.v[0], self.phase.v[1], 0.0)
    }

    fn action(&self) -> Vector6<f64> {
        Vector6::new(0.0, 0.0, 0.0, self.force[0], self.force[1], 0.0)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.contact.as_ref()
    }

    fn equilibrium(&self) -> Option<Labels> {
        Some(Labels {
            p: self.phase.q[0],
            w: self.phase.q[1],
            sheet: self.sheet,
            index: self.index,
        })
    }

    fn strains_of(&self, _rod: usize, places: &[f64]) -> Vec<Strain> {
        let rod = self.rod();
        let curvature = |s: &f64| {
            rod.and_then(|rod| rod.section(*s).ok())
                .map(|at| at.curvature)
        };
        places
            .iter()
            .map(|s| bent(curvature(s).unwrap_or(f64::NAN)))
            .collect()
    }

    fn moving_sections(&self, _rod: usize, places: &[f64]) -> Vec<SectionState> {
        let q = self.phase.q;
        let at = |q: Vector2<f64>| Equilibrium::new(q[0], q[1]).ok();
        let (Some(rod), Some(here)) = (self.rod(), Elastica.point(&q)) else {
            return Vec::new();
        };
        let rate = here.jacobian.lu().solve(&self.phase.v);
        let step = rate.map(|rate| match rate.norm() / (1.0 + q.norm()) {
            0.0 => 0.0,
            speed => CHANGE / speed,
        });
        let beside = |dt: f64, s: f64| at(q + rate? * dt)?.section(s).ok();
        let twist = |s: f64| -> Option<Vector6<f64>> {
            let step = step.filter(|step| step.is_finite())?;
            if step == 0.0 {
                return Some(Vector6::zeros());
            }
            derivative(step, |dt| {
                let (before, after) = (beside(-dt, s)?, beside(dt, s)?);
                let turn = after.theta - before.theta;
                let [x, y] = [after.x - before.x, after.y - before.y];
                Some(Vector6::new(0.0, 0.0, turn, x, y, 0.0))
            })
        };
        let n = -self.force;
        let section = |s: &f64| {
            let section = rod.section(*s).ok()?;
            let (sin, cos) = section.theta.sin_cos();
            let force = [n[0] * sin - n[1] * cos, n[0] * cos + n[1] * sin];
            Some(SectionState {
                pose: planar(section.x, section.y, section.theta),
                twist: twist(*s).unwrap_or(Vector6::repeat(f64::NAN)),
                strain: bent(section.curvature),
                resultants: Vector6::new(section.curvature, 0.0, 0.0, 0.0, force[0], force[1]),
            })
        };
        places
            .iter()
            .map(section)
            .collect::<Option<_>>()
            .unwrap_or_default()
    }

    fn sections(&self, points: usize) -> RodCurve {
        let curve = self.rod().map_or(Vec::new(), |rod| rod.curve(points));
        curve
            .iter()
            .map(|at| (at.s, planar(at.x, at.y, at.theta)))
            .collect()
    }
}

/// A viscoelastic rod in the plane.
impl State for ViscousSample<Plane, 1, 2> {
    fn time(&self) -> f64 {
        self.t
    }

    fn pose(&self) -> Isometry3<f64> {
        let turned = self.configuration.shape.end_angle();
        planar(self.pose[0], self.pose[1], turned)
    }

    fn twist(&self) -> Vector6<f64> {
        let weighted = self.flow.rates.iter().zip(self.grid.weights());
        let spin: f64 = weighted.map(|(rate, weight)| rate[0] * weight).sum();
        Vector6::new(0.0, 0.0, spin, self.velocity[0], self.velocity[1], 0.0)
    }

    fn action(&self) -> Vector6<f64> {
        -Vector6::new(0.0, 0.0, 0.0, self.flow.wrench[0], self.flow.wrench[1], 0.0)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    fn distance(&self) -> f64 {
        self.distance()
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.contact.as_ref()
    }

    fn equilibrium(&self) -> Option<Labels> {
        let near = near_equilibrium(self)?;
        Some(Labels {
            p: near.p,
            w: near.w,
            sheet: near.sheet,
            index: Elastica.index(&[near.p, near.w].into()).ok()?,
        })
    }

    fn strains_of(&self, _rod: usize, places: &[f64]) -> Vec<Strain> {
        let strains = self.strains_at(places);
        strains.iter().map(|e| bent(e[0])).collect()
    }

    fn moving_sections(&self, _rod: usize, places: &[f64]) -> Vec<SectionState> {
        let (grid, at) = (&self.grid, &self.configuration);
        let tangents = at.shape.tangents();
        let mut spins = vec![Local::<1>::zeros(); grid.len()];
        grid.integrate(&self.flow.rates, &mut spins);
        let turned = spins.iter().zip(tangents);
        let velocities: Vec<_> = turned
            .map(|(spin, t)| Vector2::new(-t.y, t.x) * spin[0])
            .collect();
        let strains = self.strains_at(places);
        let resultants = grid.at_each(&self.resultants(&Plane), places);
        let each = places.iter().zip(strains).zip(resultants);
        each.map(|((s, strain), resultants)| {
            let r = grid.integral_at(tangents, *s);
            let theta = grid.integral_at(&at.strains, *s)[0];
            let spin = grid.integral_at(&self.flow.rates, *s)[0];
            let v = grid.integral_at(&velocities, *s);
            SectionState {
                pose: planar(r.x, r.y, theta),
                twist: Vector6::new(0.0, 0.0, spin, v.x, v.y, 0.0),
                strain: bent(strain[0]),
                resultants,
            }
        })
        .collect()
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        self.dissipation_at(places)
    }

    fn sections(&self, points: usize) -> RodCurve {
        let fine = self.grid.finer(points.max(8));
        let strains = self.grid.carried(&self.configuration.strains, &fine);
        let Some(shape) = Plane.shape(&fine, &strains) else {
            return Vec::new();
        };
        let inner = shape.positions().iter().zip(shape.tangents());
        let inner = inner.map(|(r, tangent)| planar(r.x, r.y, tangent.y.atan2(tangent.x)));
        let end = planar(shape.end().x, shape.end().y, shape.end_angle());
        with_ends(&fine, planar(0.0, 0.0, 0.0), inner, end)
    }
}

/// A viscoelastic rod in space.
impl<const M: usize, const D: usize> State for ViscousSample<Space<M, D>, M, D> {
    fn time(&self) -> f64 {
        self.t
    }

    fn pose(&self) -> Isometry3<f64> {
        self.pose
    }

    fn twist(&self) -> Vector6<f64> {
        let velocity: Vector3<f64> = self.velocity.fixed_rows::<3>(D - 3).into_owned();
        let spin = if D == 6 {
            self.velocity.fixed_rows::<3>(0).into_owned()
        } else {
            // omega(1) = int R u_t ds.
            let directors = self.configuration.shape.directors().iter();
            directors
                .zip(&self.flow.rates)
                .zip(self.grid.weights())
                .fold(Vector3::zeros(), |sum, ((frame, rate), weight)| {
                    sum + frame * rate.fixed_rows::<3>(0) * *weight
                })
        };
        join(&spin, &velocity)
    }

    fn action(&self) -> Vector6<f64> {
        let force: Vector3<f64> = self.flow.wrench.fixed_rows::<3>(D - 3).into_owned();
        let couple = if D == 6 {
            self.flow.wrench.fixed_rows::<3>(0).into_owned()
        } else {
            Vector3::zeros()
        };
        -join(&couple, &force)
    }

    fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    fn distance(&self) -> f64 {
        self.distance()
    }

    fn contact(&self) -> Option<&ContactSample> {
        self.contact.as_ref()
    }

    fn strains_of(&self, _rod: usize, places: &[f64]) -> Vec<Strain> {
        let active: Vec<Local<M>> = self.strains_at(places);
        let space = Space::<M, D>::new();
        active.iter().map(|e| space.strain(e)).collect()
    }

    fn moving_sections(&self, rod: usize, places: &[f64]) -> Vec<SectionState> {
        let space = Space::<M, D>::new();
        let (grid, at) = (&self.grid, &self.configuration);
        let [spins, velocities] = space.rates_along(grid, &at.shape, &at.strains, &self.flow.rates);
        let resultants = grid.at_each(&self.resultants(&space), places);
        let each = places.iter().zip(self.strains_of(rod, places));
        each.zip(resultants)
            .map(|((s, strain), resultants)| SectionState {
                pose: space.section_at(grid, &at.shape, &at.strains, *s),
                twist: join(
                    &grid.integral_at(&spins, *s),
                    &grid.integral_at(&velocities, *s),
                ),
                strain,
                resultants,
            })
            .collect()
    }

    fn dissipation_at(&self, places: &[f64]) -> Vec<f64> {
        self.dissipation_at(places)
    }

    fn sections(&self, points: usize) -> RodCurve {
        let fine = self.grid.finer(points.max(8));
        let strains = self.grid.carried(&self.configuration.strains, &fine);
        framed(&fine, Space::<M, D>::new().shape(&fine, &strains))
    }
}

/// Sections at the nodes of a curve and at its ends.
fn framed(grid: &Grid, curve: Option<FramedCurve>) -> RodCurve {
    let Some(curve) = curve else {
        return Vec::new();
    };
    let nodes = curve.positions().iter().zip(curve.directors());
    let inner = nodes.map(|(r, frame)| {
        Isometry3::from_parts((*r).into(), Rotation3::from_matrix_unchecked(*frame).into())
    });
    with_ends(grid, Isometry3::identity(), inner, *curve.end())
}

/// The poses at the nodes of a grid on [0, 1] and at its two ends.
fn with_ends(
    grid: &Grid,
    base: Isometry3<f64>,
    inner: impl Iterator<Item = Isometry3<f64>>,
    end: Isometry3<f64>,
) -> RodCurve {
    let nodes = grid.nodes().iter().copied();
    std::iter::once((0.0, base))
        .chain(nodes.zip(inner))
        .chain([(1.0, end)])
        .collect()
}
