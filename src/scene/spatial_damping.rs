//! What `[rod]` of a scene of motion in space may hold for friction and relaxation.

use super::along_schema::{SIZE, VALUE};
use super::fault::FaultKind;
use super::matrix_schema::{definite, rows};
use super::reader::{Need, Reader, Rule, Spec, Table};
use super::schema::NON_NEGATIVE;
use super::viscous_schema::{power, relaxation, relaxation_time};
use super::{Damping, FrictionBarrier, FrictionLaw, Maxwell, StrainMatrix};
use toml::Spanned;
use toml::de::DeValue;

use Need::{Or, Required};

const DAMPING: Spec = Spec {
    name: "damping",
    fields: &["proportional", "viscosity", "exponent", "rate", "barrier"],
    barred: &[],
};
const BARRIER: Spec = Spec {
    name: "barrier",
    fields: &["strength", "half_widths"],
    barred: &[],
};
const PROPORTIONAL: Spec = Spec {
    name: "proportional",
    fields: &["proportional"],
    barred: &[],
};

const FORMS: &str = "an array of six viscosities, in the order u1 u2 u3 v1 v2 v3; six such rows; or a table such as \
                     { proportional = 0.05 }, a time";
const BRANCH_FORMS: &str = "an array of six stiffnesses, in the order u1 u2 u3 v1 v2 v3; six such rows; or \
                            { proportional = 0.5 }, so many times the stiffness of the section";
const ROW: &str = "an array of six finite numbers, in the order u1 u2 u3 v1 v2 v3";
const MATRIX: &str = "six numbers, or six rows of six, in the order u1 u2 u3 v1 v2 v3";

/// Entries of viscosities on the diagonal.
const VISCOSITY: Rule = Rule {
    allowed: "a finite number > 0 where the section does not hold the strain rigid",
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some("without viscosity a strain has no rate; it must be > 0, however small"),
        _ => (SIZE.hint)(x),
    },
};
/// Entries of Maxwell branches on the diagonal.
const MODULUS: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: |x| VALUE_RANGE.contains(&x),
    hint: VALUE.hint,
};
const VALUE_RANGE: std::ops::RangeInclusive<f64> = 0.0..=1e40;

/// What a matrix must be, and what follows if it is not.
struct Kind {
    forms: &'static str,
    diagonal: Rule,
    factor: Rule,
    consequence: &'static str,
}

const FRICTION: Kind = Kind {
    forms: FORMS,
    diagonal: VISCOSITY,
    factor: SIZE,
    consequence: "friction would feed energy to the rod (AMV (2.33))",
};
const SPRING: Kind = Kind {
    forms: BRANCH_FORMS,
    diagonal: MODULUS,
    factor: NON_NEGATIVE,
    consequence: "the branch would store negative energy",
};

/// Reads `rod.damping`. `rigid`: the strains that the section holds, if the section was read.
pub(super) fn damping(rod: &Table, rigid: Option<[bool; 6]>) -> Option<Damping> {
    let reader = rod.reader;
    let Some(value) = rod.get("damping") else {
        let hint = "write `damping = { proportional = 0.05 }` in [rod]; the motion of elastic rods in space is planned";
        let (kind, at, field) = (FaultKind::Missing, rod.at, rod.field("damping"));
        reader.record(kind, at, &field, None, FORMS, Some(hint.to_owned()));
        return None;
    };
    let field = rod.field("damping");
    match value.get_ref() {
        DeValue::Table(_) => by_table(reader, &field, value, rigid),
        DeValue::Float(_) | DeValue::Integer(_) => {
            bare_number(reader, &field, value);
            None
        }
        _ => Some(Damping {
            viscosity: matrix(reader, &field, value, rigid, &FRICTION)?,
            law: FrictionLaw::Linear,
        }),
    }
}

fn bare_number(reader: &Reader, field: &str, value: &Spanned<DeValue>) {
    let Some(x) = reader.number(field, value, NON_NEGATIVE) else {
        return;
    };
    if x == 0.0 {
        let hint = "the motion of elastic rods in space is planned".to_owned();
        reader.fault(FaultKind::Planned, field, value.span(), FORMS, Some(hint));
        return;
    }
    let hint = format!(
        "one number does not say how flexure, twist, shear and stretch share it; \
         {{ proportional = {x:?} }} is {x:?} times the stiffness of each"
    );
    reader.fault(FaultKind::Type, field, value.span(), FORMS, Some(hint));
}

fn by_table<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rigid: Option<[bool; 6]>,
) -> Option<Damping> {
    let table = reader.table(field, value, &DAMPING, &[], FORMS)?;
    let time = table.optional("proportional", SIZE);
    let viscosity = table.read("viscosity", "", Or(None), |field, value| {
        array_matrix(reader, field, value, MATRIX, rigid, &FRICTION).map(Some)
    });
    let power = power(&table);
    let barrier = table.read("barrier", "", Or(None), |field, value| {
        barrier(reader, field, value, rigid).map(Some)
    });
    let viscosity = match (time?, viscosity?) {
        (Some(time), None) => Some(StrainMatrix::Proportional(time)),
        (None, Some(matrix)) => Some(matrix),
        (Some(_), Some(_)) => {
            table.conflict("viscosity", &["proportional"], "keep one of them");
            None
        }
        (None, None) => {
            let allowed = "a time > 0, viscosity over stiffness; or viscosity, a matrix";
            table.missing("proportional", allowed, "proportional = 0.05");
            None
        }
    };
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
) -> Option<FrictionBarrier> {
    let allowed = "a table such as { strength = 0.1, half_widths = [0.05, 0.05] }";
    let table = reader.table(field, value, &BARRIER, &[], allowed)?;
    let strength = table.number("strength", SIZE, Required("strength = 0.1"));
    let example = Required("half_widths = [0.05, 0.05]");
    let words = "an array of two finite numbers > 0, along d1 and d2";
    let half_widths = table.read("half_widths", words, example, |field, value| {
        let number = |field: &str, value: &_| reader.number(field, value, SIZE);
        reader.array(field, value, words, number)
    });
    if rigid.is_some_and(|rigid| rigid[5]) {
        let allowed = "left out where the section holds the stretch rigid";
        let hint = "a rod that cannot be compressed needs no barrier: write `axial = 300.0` in [rod.section]".to_owned();
        reader.fault(
            FaultKind::Conflict,
            field,
            value.span(),
            allowed,
            Some(hint),
        );
        return None;
    }
    Some(FrictionBarrier {
        strength: strength?,
        half_widths: half_widths?,
    })
}

/// A matrix over the strains in any of its forms.
fn matrix<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rigid: Option<[bool; 6]>,
    kind: &Kind,
) -> Option<StrainMatrix> {
    if value.get_ref().is_table() {
        let table = reader.table(field, value, &PROPORTIONAL, &[], kind.forms)?;
        let example = Required("proportional = 0.5");
        let factor = table.number("proportional", kind.factor, example)?;
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
    kind: &Kind,
) -> Option<StrainMatrix> {
    let nested = |list: &toml::de::DeArray| list.iter().any(|row| row.get_ref().is_array());
    if value.get_ref().as_array().is_some_and(nested) {
        let rows: [[f64; 6]; 6] = rows(reader, field, value, allowed, ROW)?;
        // Without the section it is not known which rows matter.
        let free: Vec<usize> = (0..6)
            .filter(|i| rigid.is_some_and(|rigid| !rigid[*i]))
            .collect();
        let (diagonal, consequence) = (kind.diagonal, kind.consequence);
        let rows = definite(reader, field, value, rows, &free, diagonal, consequence)?;
        return Some(StrainMatrix::Full(Box::new(rows)));
    }
    let number = |field: &str, value: &_| reader.number(field, value, VALUE);
    let diagonal: [f64; 6] = reader.array(field, value, allowed, number)?;
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
pub(super) fn branches(rod: &Table, rigid: Option<[bool; 6]>) -> Option<Vec<Maxwell>> {
    let allowed = "an array of tables such as { stiffness = { proportional = 0.5 }, time = 2.0 }, one for each Maxwell \
                   branch";
    relaxation(rod, allowed, |table| {
        let example = Required("stiffness = { proportional = 0.5 }");
        let stiffness = table.read("stiffness", BRANCH_FORMS, example, |field, value| {
            matrix(table.reader, field, value, rigid, &SPRING)
        });
        let time = relaxation_time(table);
        Some(Maxwell {
            stiffness: stiffness?,
            time: time?,
        })
    })
}
