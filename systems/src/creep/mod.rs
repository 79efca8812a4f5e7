//! Viscoelastic rods: strains with memory, and the end wrench that goes with a moving end (theory Sec. 5).
//!
//! The rod has no inertia. Its state is the field of strains e(s) (and of the strains of its Maxwell branches). The
//! local resultants that an end wrench w1 brings about are Q(s) w1; what of them the stored energy does not take is the
//! overstress, and a rate law turns it into strain rates (AMV (2.37)):
//! ```text
//! e_t = R(e, Q w1 - S(e, z), s),        V = int Q^T e_t ds        (AMV (5.3), (5.4)).
//! ```
//! V is the velocity of the end, so that w1 follows from the positive definite G = int Q^T dR Q (AMV (5.10)); pose and
//! shape follow from the strains.
//!
//! * [`crate::section::rate`]: laws of friction, D(e, e_t) and its inverse R: Kelvin-Voigt, Carreau, a barrier at
//!   total compression, a user's potential. [`Viscoelastic`](crate::section::rate::Viscoelastic) joins one with a
//!   stored energy and Maxwell branches.
//! * [`material`]: such a section without dimensions, seen through those M of its six strains that can change.
//! * [`grid`]: Gauss nodes along the rod, in elements between the places where its law is not smooth; integrals, values
//!   between nodes, and the Legendre tails that say how well a field is resolved.
//! * [`kinematics`]: what a shape must give: pose of the end, Q and their derivatives. [`plane`]: inextensible rods
//!   in a plane, the angle integrated exactly. [`space`]: rods in space with 3, 4 or 6 strains, the rotation by
//!   collocation.
//! * [`reduced`]: the rod seen from its end. At given strains and memory it turns V into w1 and e_t, or w1 into e_t,
//!   with the linearisation that implicit steps use.
//! * [`place`]: the pose of the end as numbers in a state, for implicit steps that hold the place and not the velocity.
//! * [`kernel`]: small motions about the straight rod: spring, dashpot, memory kernel, and when there is none (6.15).
//!
//! The motion with a body is in `motion::creep`.

pub mod grid;
pub mod kernel;
pub mod kinematics;
pub mod material;
pub mod place;
pub mod plane;
pub mod reduced;
pub mod resolution;
pub mod space;
pub mod system;
