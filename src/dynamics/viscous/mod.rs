//! Motion of a body on a viscoelastic rod: strains with memory, theory Sec. 5.

mod system;

pub use system::{Layout, ViscousSystem};
