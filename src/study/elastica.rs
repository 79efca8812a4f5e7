//! Equilibria of the planar elastica of length 1 and bending stiffness 1: one by its labels, or all with the end at a
//! point.

use super::record::{Cell, Column, Table};
use crate::elastica::inversion::STRAIGHT;
use crate::elastica::{
    Elastica, Equilibrium, FoundEquilibrium, PlanarSection, equilibria_at, fold_distance,
};
use crate::error::{Error, Result};
use crate::manifold::EquilibriumManifold;
use nalgebra::Vector2;
use serde_json::{Value, json};

/// One equilibrium with sections of the rod.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticaRecord {
    /// Labels in all charts, end, energy and force.
    pub equilibrium: Equilibrium,
    /// Morse index with the end position held: 0 is stable.
    pub index: usize,
    /// Increase of lambda at constant kappa up to the first fold, negative beyond it. `None` if not resolved in
    /// double precision, where it is hundreds.
    pub fold_distance: Option<f64>,
    /// Requested sections.
    pub sections: Vec<PlanarSection>,
}

/// Describes an equilibrium, with its sections at the arclengths `at` in [0, 1].
///
/// ```
/// use snaprod::elastica::Equilibrium;
/// use snaprod::study::elastica;
/// let record = elastica(Equilibrium::from_lambda_kappa(6.3, 0.6)?, &[1.0])?;
/// // Stable, near the first fold.
/// assert!(record.index == 0 && (record.fold_distance.unwrap() - 0.3434402645620).abs() < 1e-11);
/// assert_eq!(record.shape()?.reals("x"), [record.equilibrium.x]);
/// # Ok::<(), snaprod::Error>(())
/// ```
///
/// # Errors
/// kappa = 0, the straight rod; an arclength outside [0, 1]; an index beyond double precision, or above a million.
pub fn elastica(equilibrium: Equilibrium, at: &[f64]) -> Result<ElasticaRecord> {
    let e = equilibrium;
    if e.kappa == 0.0 {
        return Err(Error::domain(
            "kappa = 0 is the straight rod, whatever lambda: its end is at (1, 0), its energy 0",
        ));
    }
    let sections = at.iter().map(|&s| e.section(s));
    Ok(ElasticaRecord {
        index: Elastica.index(&Vector2::new(e.p, e.w))?,
        // Not resolved for |p| > 345, where the fold is hundreds away.
        fold_distance: fold_distance(&e).ok(),
        sections: sections.collect::<Result<_>>()?,
        equilibrium,
    })
}

impl ElasticaRecord {
    /// True if the energy is minimal among shapes with the same end.
    pub fn is_stable(&self) -> bool {
        self.index == 0
    }

    /// JSON form.
    pub fn summary(&self) -> Value {
        let e = &self.equilibrium;
        let section = |s: &PlanarSection| json!({ "s": s.s, "theta": s.theta, "curvature": s.curvature, "x": s.x, "y": s.y });
        let mut summary = labels(e);
        summary["x"] = e.x.into();
        summary["y"] = e.y.into();
        summary["one_minus_x"] = e.one_minus_x.into();
        summary["energy"] = e.energy.into();
        summary["force"] = json!(e.force);
        summary["index"] = self.index.into();
        summary["stable"] = self.is_stable().into();
        summary["fold_distance"] = self.fold_distance.into();
        summary["sections"] = self.sections.iter().map(section).collect();
        summary
    }

    /// Sections: a row for each.
    ///
    /// # Errors
    /// None that is known of.
    pub fn shape(&self) -> Result<Table> {
        let mut table = Table::new(
            "shape",
            vec![
                Column::reals("s", "", "arclength from the clamp"),
                Column::reals("theta", "", "angle of the tangent"),
                Column::reals("curvature", "", "theta'(s), the couple"),
                Column::reals("x", "", "position along the clamp's tangent"),
                Column::reals("y", "", "position across it"),
            ],
        );
        for s in &self.sections {
            table.push(&[s.s, s.theta, s.curvature, s.x, s.y].map(Cell::Real))?;
        }
        Ok(table)
    }
}

/// All equilibria with the end at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct EquilibriaRecord {
    /// Point of the end.
    pub at: [f64; 2],
    /// Upper bound of lambda.
    pub lambda_max: f64,
    /// Equilibria by growing lambda.
    pub found: Vec<FoundEquilibrium>,
    /// Remark on the point: at (1, 0) the rod is straight, and the list is empty.
    pub note: Option<&'static str>,
}

/// Finds all equilibria with the end at `at` and lambda < `lambda_max`, in about a millisecond for lambda_max = 14
/// and a tenth of a second for 60.
///
/// ```
/// use snaprod::study::equilibria;
/// let record = equilibria([0.3, 0.2], 10.0)?;
/// let table = record.table()?;
/// let stable = table.integers("index").iter().filter(|index| **index == Some(0));
/// assert!(stable.count() > 1 && table.reals("lam").is_sorted());
/// # Ok::<(), snaprod::Error>(())
/// ```
///
/// # Errors
/// Those of [`equilibria_at`], except at (1, 0).
pub fn equilibria(at: [f64; 2], lambda_max: f64) -> Result<EquilibriaRecord> {
    let straight = at == [1.0, 0.0];
    let found = if straight {
        Vec::new()
    } else {
        equilibria_at(at[0], at[1], lambda_max)?
    };
    Ok(EquilibriaRecord {
        at,
        lambda_max,
        found,
        note: straight.then_some(STRAIGHT),
    })
}

impl EquilibriaRecord {
    /// JSON form.
    pub fn summary(&self) -> Value {
        let one = |f: &FoundEquilibrium| {
            let mut one = labels(&f.equilibrium);
            one["elastic"] = f.equilibrium.energy.into();
            one["force"] = json!(f.equilibrium.force);
            one["index"] = f.index.into();
            one["stable"] = f.stable().into();
            one["degenerate"] = f.degenerate.into();
            one["residual"] = f.residual.into();
            one
        };
        let list: Vec<Value> = self.found.iter().map(one).collect();
        let mut summary =
            json!({ "at": self.at, "lambda_max": self.lambda_max, "equilibria": list });
        if let Some(note) = self.note {
            summary["note"] = note.into();
        }
        summary
    }

    /// A row for each equilibrium.
    ///
    /// # Errors
    /// None that is known of.
    pub fn table(&self) -> Result<Table> {
        let mut table = Table::new(
            "equilibria",
            vec![
                Column::integers("mode", "the mode j of its sheet S_j^+-"),
                Column::words("sign", "the sign of its sheet"),
                Column::reals("lam", "", "lambda = sqrt(|force|)"),
                Column::reals("p", "", "chart coordinate, kappa = tanh p"),
                Column::reals("w", "", "chart coordinate, amplitude at the clamp"),
                Column::reals("alpha", "", "angle of the force"),
                Column::reals("theta1", "", "angle of the tangent at the end"),
                Column::reals("elastic", "", "elastic energy"),
                Column::integers("index", "Morse index: 0 is stable"),
                Column::words("degenerate", "\"fold\" where it is two in one"),
                Column::reals("residual", "", "distance of its end from the point"),
            ],
        );
        for found in &self.found {
            let e = &found.equilibrium;
            table.push(&[
                (e.sheet.mode as usize).into(),
                e.sheet.sign.as_str().into(),
                e.lambda.into(),
                e.p.into(),
                e.w.into(),
                e.alpha.into(),
                e.theta1.into(),
                e.energy.into(),
                found.index.into(),
                if found.degenerate { "fold" } else { "" }.into(),
                found.residual.into(),
            ])?;
        }
        Ok(table)
    }
}

/// JSON of the labels of an equilibrium.
fn labels(e: &Equilibrium) -> Value {
    json!({
        "lam": e.lambda,
        "p": e.p,
        "w": e.w,
        "kappa": e.kappa,
        "mode": e.sheet.mode,
        "sign": e.sheet.sign.as_str(),
        "k": e.k,
        "beta": e.beta,
        "alpha": e.alpha,
        "theta1": e.theta1,
    })
}
