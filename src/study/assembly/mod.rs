//! Assemblies: the equilibrium of several rods and bodies, branches of equilibria, and their motion.

mod branch;
mod equilibrium;
mod record;
mod run;

pub use branch::branch;
pub use equilibrium::{AssemblyEquilibriumRecord, equilibrium};
pub use record::{AssemblyMoment, AssemblyRunBranch, AssemblyRunRecord, BodyMoment};
pub use run::{AssemblyPrepared, run};
