//! Assemblies of several rods and bodies: equilibrium and motion. Their branches are in [`branch`](super::branch()).

mod equilibrium;
mod record;
mod run;

pub use equilibrium::{AssemblyEquilibriumRecord, equilibrium};
pub use record::{AssemblyMoment, AssemblyRunBranch, AssemblyRunRecord, BodyMoment};
pub use run::{AssemblyMotion, AssemblyPrepared, run, samples, shapes, small_mass};
