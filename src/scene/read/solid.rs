//! Mass and inertia of a body: as numbers, or from the shape and sizes of a solid with its density or mass.

use super::fields::SOLID;
use super::phrases::Short;
use super::ranges::SIZE;
use super::reader::Reader;
use super::table::Table;
use crate::scene::FaultKind;
use nalgebra::Matrix3;
use std::f64::consts::PI;
use toml::Spanned;
use toml::de::DeValue;

/// Relative rounding by which a principal moment may exceed the sum of the others.
const FLAT: f64 = 1e-9;

/// Mass and inertia of a body; the inertia is `Some(None)` if the scene gives none.
pub(super) struct Matter {
    pub mass: Option<f64>,
    pub inertia: Option<Option<[[f64; 3]; 3]>>,
}

/// True if the body has an extension.
pub(super) fn has_extent(table: &Table) -> bool {
    table.has("inertia") || table.has("solid")
}

/// Reads the mass, and the inertia, either with `inertia` or from a solid.
pub(super) fn matter(
    table: &Table,
    inertia: impl FnOnce() -> Option<Option<[[f64; 3]; 3]>>,
) -> Matter {
    if !table.has("solid") {
        return Matter {
            mass: table.number("mass"),
            inertia: inertia(),
        };
    }
    let none = Matter {
        mass: None,
        inertia: None,
    };
    if table.has("inertia") {
        table.conflict(
            "inertia",
            &["solid"],
            "a solid has its own: keep one of them",
        );
        return none;
    }
    let Some(inner) = table.inner("solid", &SOLID) else {
        return none;
    };
    let (shape, density) = (shape(&inner), inner.optional("density"));
    let mass = match (table.has("mass"), inner.has("density")) {
        (true, true) => {
            table.conflict(
                "mass",
                &["solid.density"],
                "the one follows from the other: keep one of them",
            );
            None
        }
        (false, false) => {
            inner.missing(
                "density",
                "a finite number > 0, or `mass` of the body",
                "density = 7850.0",
            );
            None
        }
        (true, false) => table.number("mass"),
        (false, true) => shape
            .as_ref()
            .zip(density.flatten())
            .map(|((volume, _), density)| density * volume),
    };
    let (Some(mass), Some((_, per_mass))) = (mass, shape) else {
        return none;
    };
    let moments = per_mass.map(|moment| mass * moment);
    if ![mass].iter().chain(&moments).all(|x| (SIZE.holds)(*x)) {
        let hint = format!(
            "its mass is {}, and its moments are {}, {} and {}: choose units nearer to the rod's size",
            Short(mass),
            Short(moments[0]),
            Short(moments[1]),
            Short(moments[2])
        );
        let allowed = "a solid whose mass and moments of inertia are in [1e-40, 1e40]";
        table.fault(FaultKind::Value, "solid", allowed, hint);
        return none;
    }
    let [a, b, c] = moments;
    Matter {
        mass: Some(mass),
        inertia: Some(Some([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]])),
    }
}

/// True if the inertia is possible: no principal moment exceeds the sum of the other two. Otherwise reports the fault.
pub(super) fn is_of_a_body(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    inertia: &[[f64; 3]; 3],
) -> bool {
    let matrix = Matrix3::from_fn(|i, j| inertia[i][j]);
    let mut moments: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    let [a, b, c] = [moments[0], moments[1], moments[2]];
    if c <= (a + b) * (1.0 + FLAT) {
        return true;
    }
    let hint = format!(
        "its principal moments are {}, {} and {}: no distribution of mass has these",
        Short(a),
        Short(b),
        Short(c)
    );
    let allowed = "the inertia of a body: each principal moment at most the sum of the other two";
    reader.fault(FaultKind::Value, field, value, allowed, hint);
    false
}

/// Reads a solid: volume, and moments of inertia over mass, about the centre along the axes.
fn shape(table: &Table) -> Option<(f64, [f64; 3])> {
    let given = table.given(&["box", "cylinder", "ball"]);
    let allowed = "one of box = [a, b, c], cylinder = [diameter, length] along the third axis and ball = diameter";
    let [one] = given[..] else {
        match given.last() {
            Some(other) => table.fault(FaultKind::Conflict, other, allowed, "keep one of them"),
            None => table.missing("box", allowed, "box = [0.1, 0.1, 0.1]"),
        }
        return None;
    };
    let reader = table.reader;
    match one {
        "box" => {
            let sides = table.maybe("box", |field, value| reader.vector(field, value, &SIZE))?;
            let [a, b, c] = sides?;
            let moment = |p: f64, q: f64| (p * p + q * q) / 12.0;
            Some((a * b * c, [moment(b, c), moment(a, c), moment(a, b)]))
        }
        "cylinder" => {
            let number = |field: &str, value: &_| reader.number(field, value, &SIZE);
            let sizes = table.maybe("cylinder", |field, value| {
                reader.array(
                    field,
                    value,
                    "an array of two finite numbers > 0, [diameter, length]",
                    &number,
                )
            })?;
            let [diameter, length]: [f64; 2] = sizes?;
            let square = 0.25 * diameter * diameter;
            let across = 0.25 * square + length * length / 12.0;
            Some((PI * square * length, [across, across, 0.5 * square]))
        }
        _ => {
            let diameter = table.optional("ball")??;
            let moment = 0.1 * diameter * diameter;
            Some((PI / 6.0 * diameter.powi(3), [moment; 3]))
        }
    }
}
