//! Results to first order: derivatives by fields of the scene, stiffness and compliance of equilibria.

mod by_fields;
mod json_numbers;
mod responses;

pub(in crate::study) use by_fields::by_field;
pub use by_fields::{Derivatives, FieldDerivative};
pub use responses::{EndResponse, Responses};

use super::assembly::AssemblyEquilibriumRecord;
use super::equilibrium::EquilibriumRecord;
use crate::error::Result;
use crate::scene::{ScalarField, Scene};
use serde_json::Value;

/// Derivatives that are asked of an equilibrium, beside the equilibrium itself.
#[derive(Debug, Clone, Default)]
pub struct FirstOrder {
    /// Fields by which all numbers of the equilibrium are differentiated.
    pub by: Vec<ScalarField>,
    /// True if stiffness and compliance of ends, stations and bodies are asked for.
    pub responses: bool,
}

impl FirstOrder {
    /// Puts what is asked for into the summary of the equilibrium of one rod.
    ///
    /// # Errors
    /// A scene to which derivatives do not apply.
    pub fn of_rod(
        &self,
        scene: &Scene,
        record: &EquilibriumRecord,
        summary: &mut Value,
    ) -> Result<()> {
        if !self.by.is_empty() {
            by_fields::of_rod(scene, &record.found, &self.by)?.put_into(summary);
        }
        if self.responses {
            responses::of_rod(scene, &record.found)?.put_into(summary);
        }
        Ok(())
    }

    /// Puts what is asked for into the summary of the equilibrium of an assembly.
    ///
    /// # Errors
    /// A scene to which derivatives do not apply.
    pub fn of_assembly(
        &self,
        scene: &Scene,
        record: &AssemblyEquilibriumRecord,
        summary: &mut Value,
    ) -> Result<()> {
        if !self.by.is_empty() {
            by_fields::of_assembly(scene, &record.found, &self.by)?.put_into(summary);
        }
        if self.responses {
            responses::of_assembly(scene, &record.found)?.put_into(summary);
        }
        Ok(())
    }

    /// Error if anything is asked of a scene that has no derivatives.
    ///
    /// # Errors
    /// Anything that is asked for.
    pub fn refused(&self, why: &str) -> Result<()> {
        if self.by.is_empty() && !self.responses {
            return Ok(());
        }
        Err(crate::error::Error::domain(why))
    }
}
