//! Planar rods under a load along them, computed as rods in space that stay in their plane.
//!
//! The closed form of the planar elastica has no load along the rod. The equivalent rod in space is stiff out of its
//! plane. At the clamp d3 is along the tangent, and d1, the axis of bending, is normal to the plane.

use super::clamp::{self, out_of_plane};
use super::elastic_space::ElasticSpace;
use super::planar;
use super::rod::rotation;
use crate::error::{Error, Quantity, Result};
use crate::full_mass::assembly::EITHER_SIDE;
use crate::scene::{
    Diagonal, EndPose, Inertia, InitialShape, Model, Orientation, RodLoad, Scene, Section,
    Stiffness,
};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

/// Largest distance of a straight rod's end from the line of the clamp, in lengths of the rod.
const STRAIGHT_OFFSET: f64 = 1e-9;
/// Ratio of the out-of-plane bending and torsional stiffness to the planar bending stiffness.
const OUT_OF_PLANE_STIFFNESS: f64 = 1e4;

/// Rotation to the directors at the clamp: d1 normal to the plane, d3 along +x.
fn planar_directors() -> UnitQuaternion<f64> {
    let axes = Matrix3::from_columns(&[Vector3::z(), -Vector3::y(), Vector3::x()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

impl Scene {
    /// The scene in space of an elastic planar rod with a load along it; `None` for every other rod.
    ///
    /// # Errors
    /// As [`Scene::planar_in_space`].
    pub(crate) fn bearing_in_plane(&self) -> Result<Option<Self>> {
        let elastic = self.is_planar() && self.rod.damping.is_none();
        if elastic && (self.light_load()?.is_some() || self.light_turning_loads()?.is_some()) {
            self.planar_in_space().map(Some)
        } else {
            Ok(None)
        }
    }

    /// The scene in space with the same small motions as a light planar rod under a load along it; `None` for every
    /// other planar rod.
    ///
    /// # Errors
    /// A rod with friction; as [`Scene::planar_in_space`].
    pub(crate) fn lifted_for_modes(&self) -> Result<Option<Self>> {
        // Small motions of a first-order rod bent by its weight have no closed form; its motion has.
        if let Some(weighing) = self.massless_with_weight()? {
            return weighing.planar_in_space().map(Some);
        }
        if self.light_load()?.is_some() && self.rod.damping.is_some() {
            return Err(Error::domain(
                "the small motions of a planar rod with friction under a load along it are not found: write model = \"cosserat\", or leave out the mass of the \
                 rod (a material by E, without a density)",
            ));
        }
        self.bearing_in_plane()
    }

    /// For a planar rod with first-order inertia that its weight bends: the same scene with weight but without inertia.
    /// `None` for every other rod.
    fn massless_with_weight(&self) -> Result<Option<Self>> {
        if !self.rod.is_light() {
            return Ok(None);
        }
        let gravity = Vector2::new(self.loads.gravity[0], self.loads.gravity[1]);
        let along = clamp::planar(&self.dimensionless()?.clamp)?
            .map_or(gravity, |support| support.at(0.0).inward(&gravity));
        if along.y == 0.0 {
            return Ok(None);
        }
        let mut weighing = self.clone();
        weighing.rod.inertia = Some(Inertia::None);
        if matches!(self.start.place, InitialShape::Rest { .. }) {
            weighing.start.place = InitialShape::Settled { settled: true };
        }
        Ok(Some(weighing))
    }

    /// An error if all loads lie along the clamp and buckle the rod: the side to which it settles is then undetermined.
    /// `lifted` is the scene in space.
    fn reject_symmetric_buckling(&self, lifted: &Self) -> Result<()> {
        let support = clamp::planar(&self.dimensionless()?.clamp)?;
        let frame = support.map(|support| support.at(0.0));
        let across = |force: &Vector3<f64>| {
            let force = Vector2::new(force.x, force.y);
            frame.map_or(force, |frame| frame.inward(&force)).y
        };
        let turned = |load: &RodLoad| load.follows && load.force[1] != 0.0;
        if self.rod.loads.iter().any(turned) {
            return Ok(());
        }
        let on_end = planar::body(&self.dimensionless()?)?.load(0.0).y;
        let along = lifted.light_load()?.is_none_or(|load| {
            let across = load.mapped(|force| Vector3::new(across(force), 0.0, 0.0));
            across.is_zero()
        });
        if on_end != 0.0 || !along {
            return Ok(());
        }
        let end = *ElasticSpace::new(lifted)?.end();
        if end.translation.vector.y.abs() <= STRAIGHT_OFFSET {
            Ok(())
        } else {
            Err(Error::ambiguous(EITHER_SIDE).context("[start]"))
        }
    }

    /// The planar scene with its rod and its clamp in space; the start is left as it is.
    ///
    /// # Errors
    /// As [`crate::scene::Rod::bending_stiffness`].
    pub(in crate::scene) fn lifted_from_plane(&self) -> Result<Self> {
        let mut lifted = self.clone();
        let stiffness = self.rod.bending_stiffness()?;
        let rod = &mut lifted.rod;
        rod.mass = self.rod.mass();
        for load in rod.loads.iter_mut().filter(|load| load.follows) {
            // Given along the tangent, d3, and the normal, -d2.
            let [tangent, normal, _] = load.force;
            load.force = [0.0, -normal, tangent];
        }
        (rod.model, rod.material) = (Model::Cosserat, None);
        rod.section = Section::Diagonal(Diagonal {
            bending: [
                stiffness.into(),
                (OUT_OF_PLANE_STIFFNESS * stiffness).into(),
            ],
            torsion: (OUT_OF_PLANE_STIFFNESS * stiffness).into(),
            shear: Stiffness::Rigid,
            axial: Stiffness::Rigid,
        });
        let q = (rotation(&self.clamp.orientation) * planar_directors()).into_inner();
        lifted.clamp.orientation = Orientation::Quaternion([q.w, q.i, q.j, q.k]);
        lifted.clamp.motion = self.clamp.motion.as_ref().map(out_of_plane);
        Ok(lifted)
    }

    /// The planar scene as one in space, without friction of the rod. An equilibrium of the planar elastica at the
    /// start gives the pose of the end and an initial guess of the shape; the equilibrium under a load along the rod
    /// differs from it.
    ///
    /// # Errors
    /// As the start of a planar scene.
    pub(in crate::scene) fn planar_in_space(&self) -> Result<Self> {
        let (plain, scales) = (self.dimensionless()?, self.scales()?);
        let mut lifted = self.lifted_from_plane()?;
        lifted.rod.damping = None;
        lifted.rod.relaxation = Vec::new();
        // The initial equilibrium is that of the clamp's pose at t = 0.
        let clamp = clamp::clamp_in_space(&plain.clamp)?
            .map_or_else(Isometry3::identity, |support| support.pose(0.0));
        match &self.start.place {
            InitialShape::Settled { .. } => self.reject_symmetric_buckling(&lifted)?,
            InitialShape::Rest { .. } => {
                return Err(Error::domain(
                    "[start] rest: an elastic rod under its weight, or another load along it, does not rest straight: write settled = true, a position, or \
                     lambda and kappa; or give it friction (damping), or leave out its mass, or follow that (inertia = \"full\", or, under its weight \
                     alone, \"first-order\")",
                ));
            }
            _ => {
                if let Some(at) = planar::start(self, &plain)? {
                    let out = |x: Vector2<f64>| clamp.rotation * Vector3::new(x.x, x.y, 0.0);
                    let curvature = at.section(0.0)?.curvature;
                    let pull = Vector2::new(at.alpha.cos(), at.alpha.sin());
                    let total = self.load_along()?.total(self.rod.length);
                    let n = out(pull) * scales.outward(Quantity::Force, -at.lambda.powi(2)) + total;
                    let couple = scales.outward(Quantity::Couple, curvature);
                    lifted.start.wrench = Some([0.0, 0.0, couple, n.x, n.y, n.z]);
                    let place = (clamp.translation.vector + out(Vector2::new(at.x, at.y)))
                        * self.rod.length;
                    lifted.start.place = InitialShape::Pose {
                        pose: EndPose {
                            position: place.into(),
                            orientation: None,
                        },
                    };
                }
            }
        }
        Ok(lifted)
    }
}
