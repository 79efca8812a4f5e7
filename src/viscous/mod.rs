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
//! * [`law`]: rate laws. [`grid`]: Gauss nodes along the rod. [`kinematics`]: shape and Q from the strains.
//! * [`space`]: rods in space.
//! * [`kernel`]: small motions about the straight rod, and when they have memory.

pub mod grid;
pub mod kernel;
pub mod kinematics;
pub mod law;
pub mod material;
pub mod place;
pub mod plane;
pub mod reduced;
pub mod space;
