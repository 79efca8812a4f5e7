//! A section law seen from the other end of its rod.

use super::{Compliance, Free, Inverse, Resultant, SectionLaw, Strain, UniformLinear};
use crate::error::Result;
use nalgebra::{Matrix6, Vector6};
use std::sync::Arc;

/// The law in arclength from the other end and along directors turned by pi about d1, so that d3 points along the rod
/// again. With T = diag(-1, 1, 1, -1, 1, 1): W*(e, s) = W(T e, L - s).
#[derive(Debug)]
pub(crate) struct Reversed {
    pub law: Arc<dyn SectionLaw>,
    pub length: f64,
}

/// Changes the signs of components 1 and 4 (u1 and v1).
fn turned(x: &Vector6<f64>) -> Vector6<f64> {
    Vector6::new(-x[0], x[1], x[2], -x[3], x[4], x[5])
}

fn turned_matrix(m: &Matrix6<f64>) -> Matrix6<f64> {
    m.map_with_location(|i, j, x| if (i % 3 == 0) == (j % 3 == 0) { x } else { -x })
}

fn turned_compliance(c: &Compliance) -> Compliance {
    match c {
        Compliance::Diagonal(_) => *c,
        Compliance::Full(matrix) => Compliance::Full(turned_matrix(matrix)),
    }
}

impl SectionLaw for Reversed {
    fn energy(&self, s: f64, e: &Strain) -> Result<f64> {
        self.law.energy(self.length - s, &turned(e))
    }

    fn resultants(&self, s: f64, e: &Strain) -> Result<Resultant> {
        let found = self.law.resultants(self.length - s, &turned(e))?;
        Ok(turned(&found))
    }

    fn tangent(&self, s: f64, e: &Strain) -> Result<Matrix6<f64>> {
        let found = self.law.tangent(self.length - s, &turned(e))?;
        Ok(turned_matrix(&found))
    }

    fn free(&self, s: f64, e: &Strain) -> Result<Free> {
        let free = self.law.free(self.length - s, &turned(e))?;
        Ok(Free {
            energy: free.energy,
            resultants: turned(&free.resultants),
            tangent: turned_matrix(&free.tangent),
        })
    }

    fn rigid(&self) -> [bool; 3] {
        self.law.rigid()
    }

    fn inverse(&self, s: f64, w: &Resultant) -> Result<Inverse> {
        let found = self.law.inverse(self.length - s, &turned(w))?;
        Ok(Inverse {
            strain: turned(&found.strain),
            energy: found.energy,
            compliance: turned_compliance(&found.compliance),
        })
    }

    fn uniform_linear(&self) -> Option<UniformLinear> {
        let linear = self.law.uniform_linear()?;
        Some(UniformLinear {
            rest: turned(&linear.rest),
            compliance: turned_compliance(&linear.compliance),
        })
    }

    fn is_linear(&self) -> bool {
        self.law.is_linear()
    }

    fn is_uniform(&self) -> bool {
        self.law.is_uniform()
    }

    fn has_uniform_stiffness(&self) -> bool {
        self.law.has_uniform_stiffness()
    }

    fn planar_about(&self) -> [bool; 2] {
        self.law.planar_about()
    }

    fn breaks(&self) -> Vec<f64> {
        let breaks = self.law.breaks().into_iter().rev();
        breaks.map(|s| self.length - s).collect()
    }
}
