//! Small motions of a body on a viscoelastic rod about an equilibrium.

use super::motions::{AlongRod, FreeStrains, InSpace, dispatch};
use nalgebra::Isometry3;
use snaprod_systems::body::{EndBody, Mass, PointMass};
use snaprod_systems::error::{Error, Result};
use snaprod_systems::section::Strain;
use snaprod_systems::section::rate::Viscoelastic;
use snaprod_systems::solve::system::System;
use snaprod_systems::viscoelastic::grid::{Grid, more};
use snaprod_systems::viscoelastic::kinematics::{AtEnd, Kinematics, Local};
use snaprod_systems::viscoelastic::material::Material;
use snaprod_systems::viscoelastic::plane::Plane;
use snaprod_systems::viscoelastic::reduced::Reduced;
use snaprod_systems::viscoelastic::space::Space;
use snaprod_systems::viscoelastic::system::{Hold, Rates, ViscousSystem};
use std::sync::Arc;

/// Initial number of nodes per element.
const FIRST: usize = 8;
/// Most strains and dashpots, all nodes together: eigenvalues cost the third power.
const MOST: usize = 300;
/// Convergence bound: relative change of an eigenvalue from a grid to a finer grid.
const STILL: f64 = 1e-10;

/// The eigenvalues of small motions, in the units of the rod.
#[derive(Debug, Clone, PartialEq)]
pub struct SmallCreep {
    /// Eigenvalues s of motions exp(s t) of the body on the rod, and those of the rod's own motions near them.
    pub rates: Rates,
    /// Relative change of the eigenvalues in the last refinement of the grid.
    pub change: f64,
}

/// Small motions of a mass on a viscoelastic rod in the plane about the equilibrium with these strains at arc
/// lengths in [0, 1]. Friction is linearised at rest; Maxwell branches are relaxed.
///
/// # Errors
/// Strains outside the law's domain; eigenvalues that do not converge; errors of `strains`.
pub fn small_in_plane(
    material: Material<1>,
    body: &PointMass<2>,
    strains: &dyn Fn(&[f64]) -> Result<Vec<Local<1>>>,
) -> Result<SmallCreep> {
    refined(&Plane, &material, body, strains)
}

/// Small motions of a body on a viscoelastic rod in space; `strains` are all six.
///
/// # Errors
/// As [`small_in_plane`].
pub fn small_in_space(
    section: Viscoelastic,
    moving: FreeStrains,
    along: AlongRod,
    carried: &Mass,
    strains: &dyn Fn(&[f64]) -> Result<Vec<Strain>>,
) -> Result<SmallCreep> {
    dispatch(section, along, moving, carried, Small { strains })
}

struct Small<'s> {
    strains: &'s dyn Fn(&[f64]) -> Result<Vec<Strain>>,
}

impl<'a> InSpace<'a> for Small<'_> {
    type Output = SmallCreep;

    fn with<B, const M: usize, const D: usize>(
        self,
        material: Material<M>,
        body: &'a B,
    ) -> Result<SmallCreep>
    where
        B: EndBody<D, Pose = Isometry3<f64>>,
    {
        let strains = |at: &[f64]| -> Result<Vec<Local<M>>> {
            let all = (self.strains)(at)?;
            Ok(all.iter().map(|e| material.active_of(e)).collect())
        };
        refined(&Space::<M, D>::new(), &material, body, &strains)
    }
}

/// The eigenvalues on finer and finer grids, until they converge.
fn refined<K, B, const M: usize, const D: usize>(
    kinematics: &K,
    material: &Material<M>,
    body: &B,
    strains: &dyn Fn(&[f64]) -> Result<Vec<Local<M>>>,
) -> Result<SmallCreep>
where
    K: Kinematics<M, D>,
    B: EndBody<D, Pose = K::Pose>,
{
    let breaks = material.breaks();
    let elements = breaks.len() + 1;
    let branches = material.branches().len();
    let at = |nodes: usize| -> Result<Rates> {
        let grid = Grid::new(&breaks, &vec![nodes; elements]);
        let field = strains(grid.nodes())?;
        let system = ViscousSystem::new(
            Reduced {
                kinematics: kinematics.clone(),
                material: material.clone(),
                grid: Arc::new(grid),
            },
            body,
            Hold::Velocity,
        );
        let y = system.state(&field, &vec![field.clone(); branches], &AtEnd::zeros());
        let linear = system.linearised(&y).ok_or_else(|| {
            Error::domain("the equilibrium is outside the domain of the law of friction")
        })?;
        linear.rates(system.rod.grid.weights()).ok_or_else(|| {
            Error::no_convergence("the eigenvalues of small motions did not converge")
        })
    };
    let mut nodes = FIRST;
    let mut last = at(nodes)?;
    loop {
        nodes = more(nodes);
        let next = at(nodes)?;
        let change = if next.body.len() == last.body.len() {
            next.body
                .iter()
                .zip(&last.body)
                .map(|(a, b)| (a - b).norm() / a.norm().max(f64::MIN_POSITIVE))
                .fold(0.0, f64::max)
        } else {
            f64::INFINITY
        };
        if change <= STILL || more(nodes) * elements * M * (1 + branches) > MOST {
            return Ok(SmallCreep {
                rates: next,
                change,
            });
        }
        last = next;
    }
}
