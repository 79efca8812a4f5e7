//! Readers of internal friction and Maxwell branches of `[rod]`.

use super::fields::{BARRIER, DAMPING, MAXWELL, PROPORTIONAL, SPACE};
use super::matrix::{definite, rows};
use super::ranges::{ETA, EXPONENT, MODULUS, NON_NEGATIVE, Rule, VALUE, VISCOSITY};
use super::reader::Reader;
use super::rod::RodTraits;
use super::section::half_widths;
use super::table::{Absent, Alternative, MissingField, Table};
use crate::scene::{BarrierTerm, Damping, FaultKind, FrictionLaw, Maxwell, PowerLaw, StrainMatrix};
use toml::Spanned;
use toml::de::DeValue;

/// Bound on the number of Maxwell branches of one rod.
const BRANCHES: usize = 32;
const FORMS: &str = "an array of six viscosities, in the order u1 u2 u3 v1 v2 v3; six such rows; or a table such as \
                     { proportional = 0.05 }, a time";
const BRANCH_FORMS: &str = "an array of six stiffnesses, in the order u1 u2 u3 v1 v2 v3; six such rows; or \
                            { proportional = 0.5 }, so many times the stiffness of the section";
const ROW: &str = "an array of six finite numbers, in the order u1 u2 u3 v1 v2 v3";
const MATRIX: &str = "six numbers, or six rows of six, in the order u1 u2 u3 v1 v2 v3";

/// Conditions on a matrix over the strains, and the physical consequence of a violation.
struct MatrixConditions {
    forms: &'static str,
    diagonal: &'static Rule,
    consequence: &'static str,
}

const FRICTION: MatrixConditions = MatrixConditions {
    forms: FORMS,
    diagonal: &VISCOSITY,
    consequence: "friction would feed energy to the rod (AMV (2.33))",
};
const SPRING: MatrixConditions = MatrixConditions {
    forms: BRANCH_FORMS,
    diagonal: &MODULUS,
    consequence: "the branch would store negative energy",
};

/// Reads `rod.damping`; `Some(None)` for an elastic rod. `rigid` marks the strains that the section holds rigid, if the
/// section was read.
pub(super) fn damping(rod: &Table, rigid: Option<[bool; 6]>) -> Option<Option<Damping>> {
    let reader = rod.reader;
    let Some(value) = rod.get("damping") else {
        return Some(None);
    };
    let field = rod.field("damping");
    match value.get_ref() {
        DeValue::Table(_) => by_table(reader, &field, value, rigid).map(Some),
        DeValue::Float(_) | DeValue::Integer(_) => bare_number(reader, &field, value),
        _ => Some(Some(Damping {
            viscosity: matrix(reader, &field, value, rigid, &FRICTION)?,
            law: FrictionLaw::Linear,
        })),
    }
}

/// Reads a single number: 0 means an elastic rod, any other number is a fault.
fn bare_number(reader: &Reader, field: &str, value: &Spanned<DeValue>) -> Option<Option<Damping>> {
    let x = reader.number(field, value, &NON_NEGATIVE)?;
    if x == 0.0 {
        return Some(None);
    }
    let hint = format!(
        "one number does not say how flexure, twist, shear and stretch share it; \
         {{ proportional = {x:?} }} is {x:?} times the stiffness of each"
    );
    reader.fault(FaultKind::Type, field, value, FORMS, hint);
    None
}

fn by_table<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rigid: Option<[bool; 6]>,
) -> Option<Damping> {
    let table = reader.table(field, value, &DAMPING, FORMS)?;
    let time = table.optional("proportional");
    let viscosity = table.maybe("viscosity", |field, value| {
        array_matrix(reader, field, value, MATRIX, rigid, &FRICTION)
    });
    let power = power(&table);
    let barrier = table.maybe("barrier", |field, value| {
        barrier(reader, field, value, rigid)
    });
    let viscosity = table.either(
        Alternative {
            name: "proportional",
            value: time.map(|x| x.map(StrainMatrix::Proportional)),
        },
        Alternative {
            name: "viscosity",
            value: viscosity,
        },
        "keep one of them",
        &MissingField {
            name: "proportional",
            allowed: "a time > 0, viscosity over stiffness; or viscosity, a matrix",
            example: "proportional = 0.05",
        },
    );
    let law = match (power?, barrier?) {
        (None, None) => Some(FrictionLaw::Linear),
        (Some(power), None) => {
            let matrix = table.get("viscosity").is_some();
            let hint =
                "the rate is measured by the stiffness of the section: write `proportional = 0.05`";
            table.conflict("viscosity", &["exponent"], hint);
            (!matrix).then_some(FrictionLaw::Power(power))
        }
        (None, Some(barrier)) => Some(FrictionLaw::Barrier(barrier)),
        (Some(_), Some(_)) => {
            let hint = "a law is a power of the rate, or has a barrier: keep one of the two";
            table.conflict("barrier", &["exponent", "rate"], hint);
            None
        }
    };
    Some(Damping {
        viscosity: viscosity?,
        law: law?,
    })
}

fn barrier<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rigid: Option<[bool; 6]>,
) -> Option<BarrierTerm> {
    let allowed = "a table such as { strength = 0.1, half_widths = [0.05, 0.05] }";
    let table = reader.table(field, value, &BARRIER, allowed)?;
    let strength = table.number("strength");
    let half_widths = half_widths(&table);
    if rigid.is_some_and(|rigid| rigid[5]) {
        let allowed = "left out where the section holds the stretch rigid";
        let hint = "a rod that cannot be compressed needs no barrier: write `axial = 300.0` in [rod.section]";
        return reader.refuse(FaultKind::Conflict, field, value, allowed, hint);
    }
    Some(BarrierTerm {
        strength: strength?,
        half_widths: half_widths?,
    })
}

/// Reads a matrix over the strains in any of its forms.
fn matrix<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rigid: Option<[bool; 6]>,
    kind: &MatrixConditions,
) -> Option<StrainMatrix> {
    if value.get_ref().is_table() {
        let table = reader.table(field, value, &PROPORTIONAL, kind.forms)?;
        let factor = table.number("proportional")?;
        return Some(StrainMatrix::Proportional(factor));
    }
    array_matrix(reader, field, value, kind.forms, rigid, kind)
}

fn array_matrix(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    allowed: &str,
    rigid: Option<[bool; 6]>,
    kind: &MatrixConditions,
) -> Option<StrainMatrix> {
    let nested = |list: &toml::de::DeArray| list.iter().any(|row| row.get_ref().is_array());
    if value.get_ref().as_array().is_some_and(nested) {
        let rows: [[f64; 6]; 6] = rows(reader, field, value, allowed, ROW)?;
        // Without the section the rigid strains are unknown, so no row is checked.
        let free: Vec<usize> = (0..6)
            .filter(|i| rigid.is_some_and(|rigid| !rigid[*i]))
            .collect();
        let (diagonal, consequence) = (kind.diagonal, kind.consequence);
        let rows = definite(reader, field, value, rows, &free, diagonal, consequence)?;
        return Some(StrainMatrix::Full(Box::new(rows)));
    }
    let number = |field: &str, value: &_| reader.number(field, value, &VALUE);
    let diagonal: [f64; 6] = reader.array(field, value, allowed, &number)?;
    let elements = value.get_ref().as_array().into_iter().flatten();
    let mut sound = true;
    for (i, value) in elements.enumerate() {
        if rigid.is_some_and(|rigid| !rigid[i]) {
            sound &= reader
                .number(&format!("{field}[{i}]"), value, kind.diagonal)
                .is_some();
        }
    }
    sound.then_some(StrainMatrix::Diagonal(diagonal))
}

/// Reads `rod.relaxation`.
pub(super) fn branches(
    rod: &Table,
    rigid: Option<[bool; 6]>,
) -> Option<Vec<Maxwell<StrainMatrix>>> {
    relaxes_with_damping(rod);
    let allowed = "an array of tables such as { stiffness = { proportional = 0.5 }, time = 2.0 }, one for each Maxwell \
                   branch";
    relaxation(rod, allowed, |table| {
        let stiffness = table.read("stiffness", BRANCH_FORMS, Absent::Fault, |field, value| {
            matrix(table.reader, field, value, rigid, &SPRING)
        });
        let time = relaxation_time(table);
        Some(Maxwell {
            modulus: stiffness?,
            time: time?,
        })
    })
}

fn relaxes_with_damping(rod: &Table) {
    if !RodTraits::of(rod).damped {
        let why = "Maxwell branches alone give a jump of the load no rate, so they stand beside a damping > 0, \
                   however small";
        needs_damping(rod, "relaxation", why);
    }
}

/// Reports a field that has no effect on a rod without damping.
pub(super) fn needs_damping(table: &Table, name: &str, why: &str) {
    let example = match table.reader.kind.get() {
        SPACE => "{ proportional = 0.1 }",
        _ => "0.1",
    };
    let hint = format!("{why}; write `damping = {example}` in [rod], or leave it out");
    table.fault(
        FaultKind::Conflict,
        name,
        "left out where the rod has no damping",
        hint,
    );
}

/// Reads `rod.damping` of a planar rod; `Some(None)` for an elastic rod.
pub(super) fn planar_damping(rod: &Table) -> Option<Option<Damping>> {
    let reader = rod.reader;
    rod.read("damping", "", Absent::Or(None), |field, value| {
        match value.get_ref() {
            DeValue::Table(_) => {
                let table = reader.table(field, value, &DAMPING, ETA.allowed)?;
                let (viscosity, power) = (friction(&table), power(&table));
                let (viscosity, law) = (viscosity?, power?);
                let law = law.map_or(FrictionLaw::Linear, FrictionLaw::Power);
                return Some(Some(Damping { viscosity, law }));
            }
            DeValue::Array(_) => {
                let hint = "matrices are for the six strains of a Cosserat rod";
                reader.wrong_type(field, value, ETA.allowed, Some(hint));
                return None;
            }
            _ => {}
        }
        let viscosity = reader.number(field, value, &ETA)?;
        Some((viscosity != 0.0).then_some(Damping {
            viscosity: StrainMatrix::Bending(viscosity),
            law: FrictionLaw::Linear,
        }))
    })
}

fn friction(table: &Table) -> Option<StrainMatrix> {
    let viscosity = table.optional("viscosity");
    let time = table.optional("proportional");
    table.either(
        Alternative {
            name: "viscosity",
            value: viscosity.map(|x| x.map(StrainMatrix::Bending)),
        },
        Alternative {
            name: "proportional",
            value: time.map(|x| x.map(StrainMatrix::Proportional)),
        },
        "viscosity = proportional * bending_stiffness: keep one of them",
        &MissingField {
            name: "viscosity",
            allowed: "a finite number > 0, stiffness times time; or proportional, a time",
            example: "viscosity = 0.1",
        },
    )
}

/// Reads `exponent` and `rate`: both or neither.
pub(super) fn power(table: &Table) -> Option<Option<PowerLaw>> {
    let exponent = table.optional("exponent");
    let rate = table.optional("rate");
    match (exponent?, rate?) {
        (Some(exponent), Some(rate)) => Some(Some(PowerLaw { exponent, rate })),
        (None, None) => Some(None),
        (Some(_), None) => {
            let allowed = "the rate of the curvature > 0 at which the power sets in";
            table.missing("rate", allowed, "rate = 1.0");
            None
        }
        (None, Some(_)) => {
            table.missing("exponent", EXPONENT.allowed, "exponent = 0.5");
            None
        }
    }
}

/// Reads `relaxation`, each branch by `branch`.
pub(super) fn relaxation<T>(
    rod: &Table,
    allowed: &str,
    branch: impl Fn(&Table) -> Option<T>,
) -> Option<Vec<T>> {
    let reader = rod.reader;
    rod.read("relaxation", "", Absent::Or(Vec::new()), |field, value| {
        let one = |field: &str, value| {
            let example = "a table such as { stiffness = 0.5, time = 2.0 }";
            branch(&reader.table(field, value, &MAXWELL, example)?)
        };
        let list = reader.list(field, value, allowed, &one)?;
        if list.len() > BRANCHES {
            let hint = format!("it has {} branches", list.len());
            let allowed = format!("an array of at most {BRANCHES} tables");
            return reader.refuse(FaultKind::Value, field, value, allowed, hint);
        }
        list.into_iter().collect()
    })
}

/// Reads the Maxwell branches of a planar rod.
pub(super) fn planar_branches(rod: &Table) -> Option<Vec<Maxwell<StrainMatrix>>> {
    relaxes_with_damping(rod);
    let allowed =
        "an array of tables such as { stiffness = 0.5, time = 2.0 }, one for each Maxwell branch";
    relaxation(rod, allowed, |table| {
        let stiffness = table.number("stiffness");
        let time = relaxation_time(table);
        Some(Maxwell {
            modulus: StrainMatrix::Bending(stiffness?),
            time: time?,
        })
    })
}

pub(super) fn relaxation_time(table: &Table) -> Option<f64> {
    table.number("time")
}
