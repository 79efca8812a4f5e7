//! Steered forces: forces on bodies that the owner of a simulation changes while the motion goes on.

use super::{Force, History, Scene, SceneKind, Steered};
use crate::error::{Error, Result};

/// A force on a body along the three axes of the world, in units of the rod.
#[derive(Debug, Clone, PartialEq)]
pub struct SteeredForce {
    /// Name of the body; empty for the body of one rod.
    pub body: String,
    /// Components along the axes.
    pub along: [Steered; 3],
}

impl Scene {
    /// Adds a force of size 0 on a body, to be steered. `body`: its name in an assembly, empty for one rod.
    ///
    /// # Errors
    /// A name that is none of a body; a scene without a body; a bar.
    pub fn steered(&mut self, body: &str) -> Result<SteeredForce> {
        let along: [Steered; 3] = std::array::from_fn(|_| Steered::new(0.0));
        let parts = along.iter().enumerate().map(|(i, size)| Force {
            direction: std::array::from_fn(|j| f64::from(u8::from(i == j))),
            size: History::Steered(size.clone()),
            follower: false,
        });
        match &mut self.kind {
            SceneKind::Rod if body.is_empty() => {
                if self.body.is_none() {
                    return Err(Error::domain(
                        "the scene has no [body] that a force could push",
                    ));
                }
                let planar = self.is_planar();
                self.loads
                    .force
                    .extend(parts.take(if planar { 2 } else { 3 }));
            }
            SceneKind::Assembly(assembly) => {
                let names = assembly.bodies.iter().map(|body| body.name.as_str());
                let names: Vec<&str> = names.collect();
                let Some(k) = names.iter().position(|name| *name == body) else {
                    return Err(Error::domain(format!(
                        "{body:?} is none of the bodies of the scene: {}",
                        names.join(", ")
                    )));
                };
                if assembly.bodies[k].is_massless() {
                    return Err(Error::domain(format!(
                        "the body {body:?} has no mass, and cannot be pushed in a motion"
                    )));
                }
                assembly.bodies[k].force.extend(parts.collect());
            }
            _ => {
                return Err(Error::domain(format!(
                    "{body:?} is none of the bodies of the scene: one rod has one body, without a name"
                )));
            }
        }
        Ok(SteeredForce {
            body: body.to_owned(),
            along,
        })
    }
}
