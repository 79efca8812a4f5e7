//! Assemblies: the equilibrium of several rods and bodies, and their motion. Their branches are those of [`branch`](super::branch()).

mod equilibrium;
mod record;
mod run;

pub use equilibrium::{AssemblyEquilibriumRecord, equilibrium};
pub use record::{AssemblyMoment, AssemblyRunBranch, AssemblyRunRecord, BodyMoment};
pub use run::{AssemblyPrepared, run, samples, shapes, small_mass};
