//! Derivatives of natural frequencies by fields of the scene.
//!
//! The equilibrium moves with the field by the implicit function theorem. The eigenvalue problem K x = omega^2 M x is
//! formed at the moved unknowns, and its frequencies are differenced along the field. No equilibrium is solved again.

use super::assembled::{ALONG, resting};
use crate::assembly::{Assembly, AssemblyFamily, Configuration};
use crate::error::{Error, Result};
use crate::scene::{AssemblySetup, ElasticSpace, InitialShape, ScalarField, Scales, Scene};
use crate::study::first_order::{Derivatives, by_field};
use serde_json::json;

/// Least relative distance of two frequencies whose modes are told apart.
const APART: f64 = 1e-5;

/// Assembly of a scene with its scales.
type Model = (Assembly, Scales);

/// The model of the scene of an assembly, or of one rod in space with its start at the equilibrium.
fn model(scene: &Scene, of_start: bool) -> Result<Model> {
    if scene.is_assembly() {
        let setup = AssemblySetup::new(scene)?;
        return Ok((setup.assembly, setup.scales));
    }
    let mut still = scene.frozen_at_start()?;
    if !of_start {
        still.start.place = InitialShape::Settled { settled: true };
    }
    let model = ElasticSpace::new(&still)?;
    Ok((model.assembly()?.0, model.common.scales))
}

/// Angular frequencies in the scene's units, ascending.
fn frequencies((assembly, scales): &Model, now: &Configuration) -> Result<Vec<f64>> {
    let modes = assembly.modes(now, ALONG)?;
    let each = modes.squares.iter().map(|square| {
        let neutral = square.abs() <= modes.neutral;
        let size = if neutral { 0.0 } else { square.abs().sqrt() };
        square.signum() * size / scales.time
    });
    Ok(each.collect())
}

/// Derivatives of the angular frequencies of [`super::modes()`] by fields, for rods in space without mass of their own.
///
/// # Errors
/// A planar scene; rods with their full mass; no equilibrium found; frequencies that coincide.
pub fn derivatives(scene: &Scene, fields: &[ScalarField]) -> Result<Derivatives> {
    scene.refuse_functions("derivatives of frequencies")?;
    let refuse = |why: &str| Err(Error::domain(why));
    scene.has_no_obstacles()?;
    if scene.is_planar() {
        return refuse(
            "frequencies are differentiated in space alone: write the rod with model = \"cosserat\", or take differences of a sweep",
        );
    }
    if scene.rod.is_heavy() {
        return refuse(
            "frequencies are not differentiated with the full mass of rods: leave out inertia = \"full\", or take differences of a sweep",
        );
    }
    let (now, of_start) = if scene.is_assembly() {
        (AssemblySetup::new(scene)?.start_equilibrium()?.now, true)
    } else {
        let at = resting(&scene.frozen_at_start()?)?;
        (at.at.1, at.of_start)
    };
    let known = frequencies(&model(scene, of_start)?, &now)?;
    let largest = known.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let close = |pair: &[f64]| pair[1] - pair[0] <= APART * largest;
    if let Some(pair) = known.windows(2).find(|pair| close(pair)) {
        return Err(Error::domain(format!(
            "two frequencies coincide, {} and {}: each alone has no derivative there; break the symmetry of the scene a little",
            pair[0], pair[1]
        )));
    }
    let each = fields.iter().map(|field| {
        let at = |p: f64| model(&field.scene(p)?, of_start);
        let assembly = |p: f64| Ok(at(p)?.0);
        let family = AssemblyFamily::new(assembly, &now, field.value, true, 1.0, ALONG)?;
        let x = family.unknowns(&now, field.value)?;
        Ok(by_field(field, &family, &x, |x, p| {
            let now = family.state(x, p)?.now;
            Ok(json!({ "angular_frequencies": frequencies(&at(p)?, &now)? }))
        }))
    });
    each.collect::<Result<_>>().map(Derivatives)
}
