//! Section laws: relations between the strains and the resultants of a cross-section.
//!
//! Strains e = (u1, u2, u3, v1, v2, v3): flexure, flexure, twist, shear, shear, stretch, all components along the
//! directors. Resultants w = (m1, m2, m3, n1, n2, n3): couple and force. A law is hyperelastic, w = dW/de with W(e,
//! s) strictly convex, so that the inverse e(w) exists (AMV (2.28)).
//!
//! * [`Linear`]: diagonal or full stiffness, intrinsic curvature and twist, unshearable and inextensible rods.
//! * [`Varying`]: linear laws that vary along the rod. [`Profile`]: linear laws from shape and material.
//! * [`Barrier`]: total compression costs infinite energy. [`Hyperelastic`]: a user's own stored energy.
//! * [`Tendons`]: any law of a rod with tendons of given tension.
//! * [`Driven`]: any law with rest strains that are driven. [`LawInTime`]: drive and tensions as histories.

mod barrier;
mod centreline;
mod coordinates;
mod driven;
mod in_rod_units;
mod in_time;
mod jet;
mod linear;
pub(crate) mod newton;
mod profile;
mod profile_along;
pub mod rate;
mod shape_along;
mod stored_energy;
mod tendons;
mod varying;

pub use barrier::{Barrier, BarrierTerm};
pub use centreline::Centreline;
pub(crate) use coordinates::reverse_law;
pub use driven::{Driven, RestDrive};
pub use in_rod_units::{Measures, law_in_units};
pub use in_time::LawInTime;
pub use linear::Linear;
/// Numbers with derivatives, for [`StoredEnergy`].
pub use num_dual::DualNum;
pub use profile::{Material, Profile, Rigid, Shape, ShapeSettings, Transverse};
pub use profile_along::Along;
pub use shape_along::MassAlong;
pub use stored_energy::{Hyperelastic, StoredEnergy};
pub use tendons::{Route, Tendon, Tendons};
pub use varying::{Diagonal, Rest, Stiffness, Varying};

use crate::error::Result;
use nalgebra::{Matrix6, Vector6};
use std::fmt::Debug;

/// (u1, u2, u3, v1, v2, v3): flexure, flexure, twist (per length); shear, shear, stretch (1 when unstretched).
pub type Strain = Vector6<f64>;

/// (m1, m2, m3, n1, n2, n3): couple and force along the directors.
pub type Resultant = Vector6<f64>;

/// The strains by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum StrainName {
    /// Flexure about d1.
    U1,
    /// Flexure about d2.
    U2,
    /// Twist.
    U3,
    /// Shear along d1.
    V1,
    /// Shear along d2.
    V2,
    /// Stretch.
    V3,
}

impl StrainName {
    /// All six, in order: `name as usize` is the place in (u1, u2, u3, v1, v2, v3).
    pub const ALL: [Self; 6] = [Self::U1, Self::U2, Self::U3, Self::V1, Self::V2, Self::V3];

    /// Name as written in scenes.
    pub fn as_str(self) -> &'static str {
        ["u1", "u2", "u3", "v1", "v2", "v3"][self as usize]
    }
}

/// Compliance de/dw, symmetric, positive definite; only semidefinite if a strain is held rigid.
// Boxing the matrix would cost an allocation at every section of every rod.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compliance {
    /// A diagonal matrix, given by its diagonal.
    Diagonal(Vector6<f64>),
    /// A full symmetric matrix.
    Full(Matrix6<f64>),
}

impl Compliance {
    /// The compliance as a 6 x 6 matrix.
    pub fn matrix(&self) -> Matrix6<f64> {
        match self {
            Self::Diagonal(entries) => Matrix6::from_diagonal(entries),
            Self::Full(matrix) => *matrix,
        }
    }

    /// The compliance times a number.
    pub(crate) fn times(self, factor: f64) -> Self {
        match self {
            Self::Diagonal(entries) => Self::Diagonal(entries * factor),
            Self::Full(matrix) => Self::Full(matrix * factor),
        }
    }
}

impl std::ops::Mul<&Resultant> for &Compliance {
    type Output = Strain;

    fn mul(self, w: &Resultant) -> Strain {
        match self {
            Compliance::Diagonal(entries) => entries.component_mul(w),
            Compliance::Full(matrix) => matrix * w,
        }
    }
}

/// Result of the inverse law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverse {
    /// The strains e(w).
    pub strain: Strain,
    /// W(e(w)), stored energy per length.
    pub energy: f64,
    /// de/dw.
    pub compliance: Compliance,
}

/// Energy, resultants and tangent in the strains that are not rigid: [`SectionLaw::free`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Free {
    /// Stored energy W per length.
    pub energy: f64,
    /// dW/de; zero for rigid strains.
    pub resultants: Resultant,
    /// d^2W/de^2; rows and columns of rigid strains are zero.
    pub tangent: Matrix6<f64>,
}

impl Free {
    fn new(
        energy: f64,
        mut resultants: Resultant,
        mut tangent: Matrix6<f64>,
        rigid: [bool; 6],
    ) -> Self {
        for k in (0..6).filter(|k| rigid[*k]) {
            resultants[k] = 0.0;
            tangent.row_mut(k).fill(0.0);
            tangent.column_mut(k).fill(0.0);
        }
        Self {
            energy,
            resultants,
            tangent,
        }
    }
}

/// Rates of a section law W(e, s, t) at given strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawRates {
    /// W_t: the power of the drive per length.
    pub power: f64,
    /// W_et: the rate of the resultants; zero for rigid strains.
    pub resultants: Resultant,
}

/// A linear law that is uniform along the rod: e = rest + C w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniformLinear {
    /// Strains without load.
    pub rest: Strain,
    /// Compliance C.
    pub compliance: Compliance,
}

/// A hyperelastic section law. `s` is the arclength from the clamp in the unloaded state, 0 <= s <= L.
pub trait SectionLaw: Debug + Send + Sync {
    /// W(e, s): stored energy per length.
    ///
    /// # Errors
    /// Strains outside the law's domain (total compression), or that break a constraint.
    fn energy(&self, s: f64, e: &Strain) -> Result<f64>;

    /// w = dW/de.
    ///
    /// # Errors
    /// As [`SectionLaw::energy`]; a constrained law, whose resultants are reactions.
    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant>;

    /// d^2 W/de^2.
    ///
    /// # Errors
    /// As [`SectionLaw::resultants`]; a tangent that is not positive definite.
    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>>;

    /// Energy, resultants and tangent in the free strains; reactions of rigid strains are left out.
    ///
    /// # Errors
    /// As [`SectionLaw::energy`].
    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        Ok(Free {
            energy: self.energy(s, e)?,
            resultants: self.resultants(s, e)?,
            tangent: self.tangent(s, e)?,
        })
    }

    /// Marks of the rigid strains; none by default.
    fn rigid(&self) -> [bool; 6] {
        [false; 6]
    }

    /// The inverse law (AMV (2.28)): strains, energy and compliance under given resultants, to roundoff.
    ///
    /// # Errors
    /// A law that is not convex on the way, or no convergence; the message says where.
    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse>;

    /// Rates of a law that varies in time, at the strains `e` of the resultants `w`. `None`: the law stands still.
    ///
    /// # Errors
    /// As [`SectionLaw::free`].
    fn rates(&self, _s: f64, _e: &Strain, _w: &Resultant) -> Result<Option<LawRates>> {
        Ok(None)
    }

    /// The law in its simplest form, if it is linear and uniform: its inverse is then formed only once.
    fn uniform_linear(&self) -> Option<UniformLinear> {
        None
    }

    /// True if the strains are linear in the resultants, at every s.
    fn is_linear(&self) -> bool {
        self.uniform_linear().is_some()
    }

    /// True if the law does not depend on s.
    fn is_uniform(&self) -> bool;

    /// True if the stiffness at the unloaded strains does not depend on s, though these strains may. False may also
    /// mean "unknown".
    fn has_uniform_stiffness(&self) -> bool {
        self.is_uniform()
    }

    /// The strains without load.
    ///
    /// # Errors
    /// As [`SectionLaw::inverse`].
    fn unloaded(&self, s: f64) -> Result<Strain> {
        Ok(self.inverse(s, &Resultant::zeros())?.strain)
    }

    /// True if planar data stay planar. Entry 0 is for bending about d1, in the plane of d2 and d3 (u1, v2, v3
    /// alone); entry 1 for bending about d2, in the plane of d3 and d1 (u2, v1, v3 alone).
    ///
    /// True means: the other strains are (0, 0, 0) everywhere along the rod if the resultants conjugate to them are
    /// zero. False may also mean "unknown".
    fn planar_about(&self) -> [bool; 2] {
        [false; 2]
    }

    /// Interior points in s where the law is not smooth, in growing order: an integration along the rod is restarted
    /// at these points.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// Marks of all six strains from those of v1, v2, v3.
fn six([v1, v2, v3]: [bool; 3]) -> [bool; 6] {
    [false, false, false, v1, v2, v3]
}

/// Indices of the strains in and out of the plane of bending about d1 (axis 0) or d2 (axis 1).
fn planar_strains(axis: usize) -> [[usize; 3]; 2] {
    [[axis, 4 - axis, 5], [1 - axis, 2, 3 + axis]]
}
