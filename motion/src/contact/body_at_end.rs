//! The body at the end of a rod whose strains are a state of their own: its motion under the forces of closed contacts.

use super::bodies::Bodies;
use super::contact_forces::{Closed, Grip, Moment};
use nalgebra::{Isometry3, SMatrix, SVector, Vector3, Vector6};
use snaprod_systems::body::{EndBody, EndLinear, EndMotion, EndPose};
use snaprod_systems::contact::RigidMotion;
use snaprod_systems::math::se3::{halves, join};

/// A body at the end of a rod, on which closed contacts act.
pub(crate) struct BodyAtEnd<'a, B> {
    /// The body as it moves without contacts.
    pub free: &'a B,
    /// Contacts of the body; None without obstacles.
    pub contacts: Option<EndContacts<'a>>,
}

/// Obstacles as they are seen from the clamp of a rod, and the closed contacts of the body at its end.
pub(crate) struct EndContacts<'a> {
    /// The body with its shape, and the obstacles.
    pub system: &'a Bodies,
    /// Latest time at which obstacles are evaluated.
    pub until: f64,
    /// The clamp in the world, which stands.
    clamp: Isometry3<f64>,
    closed: Vec<Closed>,
}

impl<'a> EndContacts<'a> {
    /// Obstacles of which the body touches none.
    pub fn new(system: &'a Bodies, clamp: Isometry3<f64>) -> Self {
        Self {
            system,
            until: f64::MAX,
            clamp,
            closed: Vec::new(),
        }
    }

    /// From now on these contacts act.
    pub fn hold(&mut self, closed: &[Closed]) {
        self.closed = closed.to_vec();
    }

    /// True if one acts.
    fn act_now(&self) -> bool {
        self.closed.iter().any(|closed| closed.grip != Grip::Idle)
    }

    /// A velocity or acceleration of the end as a twist in the world.
    pub fn outward<const D: usize>(&self, v: &SVector<f64, D>) -> Vector6<f64> {
        let linear = Vector3::from_fn(|i, _| match D {
            6 => v[3 + i],
            _ if i < D => v[i],
            _ => 0.0,
        });
        let angular = Vector3::from_fn(|i, _| if D == 6 { v[i] } else { 0.0 });
        let turn = &self.clamp.rotation;
        join(&(turn * angular), &(turn * linear))
    }

    /// The part of a twist in the world that the end of the rod has.
    pub fn inward<const D: usize>(&self, twist: &Vector6<f64>) -> SVector<f64, D> {
        let (angular, linear) = halves(twist);
        let back = self.clamp.rotation.inverse();
        let (angular, linear) = (back * angular, back * linear);
        SVector::from_fn(|i, _| match D {
            6 if i < 3 => angular[i],
            6 => linear[i - 3],
            _ => linear[i],
        })
    }

    /// A place of the world in the frame of the clamp, turned to the world.
    pub fn place(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.clamp.transform_point(&(*x).into()).coords
    }

    /// A direction of the frame of the clamp in the world.
    pub fn direction(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.clamp.rotation * x
    }

    /// The body and the obstacles at the time `t`, with the pose and the velocity of the end seen from the clamp.
    pub fn moment<const D: usize>(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &SVector<f64, D>,
    ) -> Moment<'a> {
        let motion = RigidMotion::new(self.clamp * pose, &self.outward(v));
        Moment::new(self.system, t.min(self.until), vec![motion])
    }

    /// Adds the contact forces to the motion of the body. NaN where no forces keep the contacts.
    fn act<const D: usize>(
        &self,
        t: f64,
        pose: &Isometry3<f64>,
        v: &SVector<f64, D>,
        free: EndMotion<D>,
    ) -> EndMotion<D> {
        let mut now = self.moment(t, pose, v);
        now.accelerations[0] = self.outward(&free.acceleration);
        match now.act(&self.closed) {
            Some(action) => EndMotion {
                acceleration: free.acceleration + self.inward::<D>(&action.accelerations[0]),
                power: free.power + action.work,
                loss: free.loss + action.loss,
            },
            None => EndMotion {
                acceleration: SVector::repeat(f64::NAN),
                ..free
            },
        }
    }
}

impl<B> BodyAtEnd<'_, B> {
    /// The contacts, if one of them acts.
    fn acting(&self) -> Option<&EndContacts<'_>> {
        self.contacts.as_ref().filter(|contacts| contacts.act_now())
    }
}

impl<const D: usize, B: EndBody<D>> EndBody<D> for BodyAtEnd<'_, B> {
    type Pose = B::Pose;

    fn motion(
        &self,
        t: f64,
        pose: &B::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndMotion<D> {
        let free = self.free.motion(t, pose, v, rod);
        match self.acting() {
            None => free,
            Some(contacts) => contacts.act(t, &pose.in_space(), v, free),
        }
    }

    /// Contact forces are an affine function of the acceleration without them, as long as contacts keep their grips.
    /// Its matrix P turns free derivatives into those of the held body. Changes of the directions of contact are left
    /// out: Newton's iteration needs fast terms alone, and these are as slow as the body.
    fn linearised(
        &self,
        t: f64,
        pose: &B::Pose,
        v: &SVector<f64, D>,
        rod: &SVector<f64, D>,
    ) -> EndLinear<D> {
        let free = self.free.linearised(t, pose, v, rod);
        let Some(contacts) = self.acting() else {
            return free;
        };
        let (motion, place) = (self.free.motion(t, pose, v, rod), pose.in_space());
        let held = |change: SVector<f64, D>| {
            let pushed = EndMotion {
                acceleration: motion.acceleration + change,
                ..motion
            };
            contacts.act(t, &place, v, pushed).acceleration
        };
        let still = held(SVector::zeros());
        let mut kept = SMatrix::<f64, D, D>::zeros();
        for i in 0..D {
            let mut unit = SVector::zeros();
            unit[i] = 1.0;
            kept.set_column(i, &(held(unit) - still));
        }
        EndLinear {
            by_pose: kept * free.by_pose,
            by_velocity: kept * free.by_velocity,
            by_wrench: kept * free.by_wrench,
        }
    }

    fn kinetic(&self, t: f64, pose: &B::Pose, v: &SVector<f64, D>) -> f64 {
        self.free.kinetic(t, pose, v)
    }

    fn potential(&self, t: f64, pose: &B::Pose) -> f64 {
        self.free.potential(t, pose)
    }

    fn next_break(&self, t: f64) -> f64 {
        let contacts = self.contacts.as_ref();
        let obstacles = contacts.map_or(f64::INFINITY, |all| all.system.next_break(t));
        self.free.next_break(t).min(obstacles)
    }
}
