//! Viscoelastic rods: strains with memory, and the end wrench of a moving end (theory Sec. 5).
//!
//! The rod has no inertia. Its state is the field of strains e(s) (and of the strains of its Maxwell branches). An
//! end wrench w1 makes the local resultants Q(s) w1. The part that the stored energy does not take is the overstress,
//! and a rate law turns it into strain rates (AMV (2.37)):
//! ```text
//! e_t = R(e, Q w1 - S(e, z), s),        V = int Q^T e_t ds        (AMV (5.3), (5.4)).
//! ```
//! V is the velocity of the end, so w1 follows from the positive definite G = int Q^T dR Q (AMV (5.10)); pose and
//! shape follow from the strains.
//!
//! * [`crate::section::rate`]: laws of friction, D(e, e_t) and its inverse R: Kelvin-Voigt, Carreau, a barrier at
//!   total compression, a user's potential. [`Viscoelastic`](crate::section::rate::Viscoelastic) joins one with a
//!   stored energy and Maxwell branches.
//! * [`material`]: a dimensionless viscoelastic section, restricted to the M of its six strains that can change.
//! * [`grid`]: Gauss nodes along the rod, in elements between the points at which its law is not smooth; integrals,
//!   values between nodes, and the Legendre tails that measure the resolution of a field.
//! * [`kinematics`]: the interface of a shape: pose of the end, Q and their derivatives. [`plane`]: inextensible rods
//!   in a plane, the angle integrated exactly. [`space`]: rods in space with 3, 4 or 6 strains, the rotation by
//!   collocation.
//! * [`reduced`]: the rod as seen from its end. For given strains and memory it turns V into w1 and e_t, or w1 into
//!   e_t, with the linearisation for implicit steps.
//! * [`end_pose`]: the pose of the end as numbers in a state, for implicit steps that hold the place and not the
//!   velocity.
//! * [`kernel`]: small motions about the straight rod: spring, dashpot, memory kernel, and the condition (6.15) for
//!   no memory.
//!
//! The motion with a body is in `motion::viscoelastic`.

pub mod end_pose;
pub mod grid;
pub mod kernel;
pub mod kinematics;
pub mod loads_at_nodes;
pub mod material;
pub mod plane;
pub mod reduced;
pub mod resolution;
pub mod space;
pub mod system;
