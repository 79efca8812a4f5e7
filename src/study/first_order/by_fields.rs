//! Derivatives of an equilibrium by fields of its scene.
//!
//! The unknowns x of an equilibrium solve F(x, p) = 0, where p is the value of the field. The implicit function theorem
//! gives their derivative v ([`crate::solve::implicit_derivative`]). Every number g of the summary has the derivative
//! of g(x + h v, p + h) by h, an extrapolated difference at known unknowns. The field enters F and g through the whole
//! scene, which is read anew with every check. No equilibrium is solved for a difference.

use super::json_numbers::{differentiable, numbers, with_numbers};
use crate::assembly::{Assembly, AssemblyEquilibrium, AssemblyFamily};
use crate::error::{Error, Result};
use crate::rod::{BothEnds, Chart, Equilibrium, RodFamily, Spatial, Wrench};
use crate::scene::{AssemblySetup, Pull, ScalarField, Scene};
use crate::solve::extrapolated_slope::Slope;
use crate::solve::implicit_derivative::response;
use crate::solve::parametrised_problem::Family;
use crate::study::assembly;
use crate::study::equilibrium::described_by;
use crate::study::tendons::{Pulled, TendonsRecord};
use nalgebra::DVector;
use serde_json::{Map, Value};

/// Tolerance of the integration along the rods.
const FINEST: f64 = 1e-13;
/// Largest change of the unknowns over the first step of the differences of the summary, relative to 1 + |x|.
const CHANGE: f64 = 0.02;

/// Derivatives of the numbers of an equilibrium by one field.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldDerivative {
    /// Path of the field.
    pub field: String,
    /// The derivatives in the layout of the summary, with their estimated errors likewise; or the reason why there are
    /// none.
    pub found: std::result::Result<[Value; 2], String>,
}

/// Derivatives of an equilibrium by fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Derivatives(pub Vec<FieldDerivative>);

impl Derivatives {
    /// Adds `derivatives`, `derivative_errors` and, where some are missing, `no_derivatives`.
    pub fn put_into(self, summary: &mut Value) {
        let [mut values, mut errors, mut reasons] = [Map::new(), Map::new(), Map::new()];
        for FieldDerivative { field, found } in self.0 {
            match found {
                Ok([value, error]) => {
                    values.insert(field.clone(), value);
                    errors.insert(field, error);
                }
                Err(why) => {
                    values.insert(field.clone(), Value::Null);
                    reasons.insert(field, why.into());
                }
            }
        }
        summary["derivatives"] = values.into();
        summary["derivative_errors"] = errors.into();
        if !reasons.is_empty() {
            summary["no_derivatives"] = reasons.into();
        }
    }
}

/// The scene of a field at a value, integrated as finely as rounding allows.
pub(super) fn fine(mut scene: Scene) -> Scene {
    scene.solve.tolerance = FINEST;
    scene
}

/// Derivative by one field: `summary` describes the unknowns at a value of the field.
pub(in crate::study) fn by_field(
    field: &ScalarField,
    family: &dyn Family,
    x: &DVector<f64>,
    summary: impl Fn(&DVector<f64>, f64) -> Result<Value>,
) -> FieldDerivative {
    let p = field.value;
    let found = || -> Result<[Value; 2]> {
        let here = response(family, x, p)?;
        let layout = differentiable(summary(&here.x, p)?);
        let count = numbers(&layout).len();
        let v = &here.by.value;
        let short = CHANGE * (1.0 + here.x.norm()) / v.norm().max(f64::MIN_POSITIVE);
        let slope = Slope::at(here.step.min(short), &mut |h| {
            let there = differentiable(summary(&(&here.x + v * h), p + h)?);
            let all = numbers(&there);
            if all.len() == count {
                return Ok(DVector::from_vec(all));
            }
            Err(Error::domain(
                "the equilibria on both sides of this value have other numbers",
            ))
        })?;
        let put = |of: &DVector<f64>| with_numbers(&layout, &mut of.iter().copied());
        Ok([put(&slope.value), put(&slope.error)])
    };
    FieldDerivative {
        field: field.path.clone(),
        found: found().map_err(|why| why.to_string()),
    }
}

/// Derivatives of the equilibrium of one rod.
///
/// # Errors
/// Obstacles; tendons of given length.
pub(super) fn of_rod(
    scene: &Scene,
    found: &Equilibrium,
    fields: &[ScalarField],
) -> Result<Derivatives> {
    let refuse = |why: &str| Err(Error::domain(why));
    if !scene.obstacles.is_empty() {
        return refuse(
            "derivatives are not computed for rods among obstacles; leave out [[obstacle]], or take differences of a sweep",
        );
    }
    let held = |pull: &Pull| matches!(pull, Pull::Length(_));
    if scene.rod.tendons.iter().any(|tendon| held(&tendon.pull)) {
        return refuse(
            "derivatives are not computed with tendons of given length; give their tensions, as the equilibrium tells them",
        );
    }
    let problem = fine(scene.clone()).problem()?;
    if problem.is_taut(&found.base, &found.end) {
        in_chart(&BothEnds::new(&problem, None), found, fields)
    } else {
        in_chart(&Spatial, found, fields)
    }
}

fn in_chart<C: Chart + Clone>(
    chart: &C,
    found: &Equilibrium,
    fields: &[ScalarField],
) -> Result<Derivatives> {
    let each = fields.iter().map(|field| {
        let problem = |p: f64| fine(field.scene(p)?).problem();
        let family = RodFamily::in_chart(problem, true, 1.0, chart.clone());
        let x = family.unknowns(&found.base, field.value)?;
        let summary = |x: &DVector<f64>, p: f64| {
            let scene = fine(field.scene(p)?);
            let problem = scene.problem()?;
            let base = problem.rod().outward_wrench(&chart.wrench(&problem, x)?);
            described_at(scene, chart, x, base, found)
        };
        Ok(by_field(field, &family, &x, summary))
    });
    each.collect::<Result<_>>().map(Derivatives)
}

/// The summary of a rod at these unknowns, in equilibrium or beside one.
fn described_at<C: Chart>(
    scene: Scene,
    chart: &C,
    x: &DVector<f64>,
    base: Wrench,
    like: &Equilibrium,
) -> Result<Value> {
    let problem = scene.problem()?;
    let law = scene.rod.tendon_law()?;
    let along = |places: &[f64]| chart.sections(&problem, x, places);
    let tendons = law.map(|law| TendonsRecord::of(&law, scene.rod.length, along));
    let pulled = Pulled {
        found: Equilibrium {
            base,
            end: chart.end(&problem, x)?,
            potential: problem.potential(&base)?,
            ..like.clone()
        },
        tendons: tendons.transpose()?,
        problem: problem.clone(),
        scene,
    };
    Ok(described_by(pulled, &along)?.summary())
}

/// Derivatives of the equilibrium of an assembly.
///
/// # Errors
/// Those of the scene.
pub(super) fn of_assembly(
    scene: &Scene,
    found: &AssemblyEquilibrium,
    fields: &[ScalarField],
) -> Result<Derivatives> {
    if AssemblySetup::new(scene)?.is_heavy() {
        return Err(Error::domain(
            "derivatives are not computed for rods with their full mass; leave out inertia = \"full\", which does not change an equilibrium",
        ));
    }
    let each = fields.iter().map(|field| {
        let setup = |p: f64| AssemblySetup::new(&fine(field.scene(p)?));
        let at = |p: f64| -> Result<Assembly> { Ok(setup(p)?.assembly) };
        let family = AssemblyFamily::new(at, &found.now, field.value, true, 1.0, FINEST)?;
        let x = family.unknowns(&found.now, field.value)?;
        let summary = |x: &DVector<f64>, p: f64| {
            let scene = fine(field.scene(p)?);
            let state = family.state(x, p)?;
            let there = AssemblyEquilibrium {
                now: state.now,
                energy: state.energy,
                stored: state.stored,
                ..found.clone()
            };
            let setup = AssemblySetup::new(&scene)?;
            Ok(assembly::described(&scene, &setup, there)?.summary())
        };
        Ok(by_field(field, &family, &x, summary))
    });
    each.collect::<Result<_>>().map(Derivatives)
}
