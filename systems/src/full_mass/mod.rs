//! Rods with mass: Lagrangian systems with the strains at the nodes as generalised coordinates.
//!
//! A rod of mass eps (that of the body is 1) is held at s = 0 and carries the body at s = 1. With q the free strains
//! at the nodes, J the velocities of the sections per strain rate and N the masses, the principle of d'Alembert reads
//! ```text
//! J^T N (J q'' + J' q') + weights (dW/de + D(e, e_t)) = J^T loads,      M = J^T N J.
//! ```
//! Kinematics, masses and their derivatives are those of one discrete system: its energy is an integral of the
//! motion, whatever the number of nodes.
//!
//! * [`law`]: the section law on the strains that can change.
//! * [`frames`]: poses, velocities and accelerations of the sections, and the derivatives of all of them.
//! * `damped_modes`: small motions with friction and memory, in the space of the vibrations.
//! * `maxwell_nodes`: Maxwell branches, which implicit steps eliminate node by node.
//! * `section_rotations`: rotation rates of the sections in space, exact for the rotations by collocation.
//! * `turning_load`: couples along a rod, and loads that turn with its sections.
//! * `mass`: sums over the masses carried by the sections: pieces of the rod, and the body.
//! * [`rod`]: the balance above with its exact linearisation; energies.
//! * [`assembly`]: one or several rods between bodies, the ground and supports: differential equations, equilibria,
//!   rates tangent to the equilibria, small motions.
//! * [`elements`]: the rods as chains of elements, with positions and rotations as coordinates.
//! * [`obstacles`]: fixed obstacles that rods in elements touch.
//! * [`held_vibrations`]: vibrations of a light rod whose ends are held.
//! * [`vibration`]: the slowest vibrations of a stiffness and a mass.
//!
//! The motion is in `motion::full_mass`.

pub mod assembly;
mod damped_modes;
pub mod elements;
pub mod frames;
pub mod held_vibrations;
pub mod law;
mod mass;
mod maxwell_nodes;
pub mod obstacles;
pub mod rod;
mod section_rotations;
mod turning_load;
mod unresolved_waves;
pub mod vibration;
