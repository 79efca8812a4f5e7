//! What viscoelastic scenes may hold beyond elastic ones, and what needs damping.

use super::fault::FaultKind;
use super::reader::{Need, Reader, Rule, Spec, Table};
use super::schema::{FINITE, NON_NEGATIVE, POSITIVE};
use super::{Damping, FrictionLaw, Landing, Maxwell, Method, PowerLaw, Relaxed, StrainMatrix};
use toml::Spanned;
use toml::de::DeValue;

use Need::{Or, Required};

const DAMPING: Spec = Spec {
    name: "damping",
    fields: &["viscosity", "proportional", "exponent", "rate"],
    barred: &[],
};
const MAXWELL: Spec = Spec {
    name: "relaxation",
    fields: &["stiffness", "time"],
    barred: &[],
};

/// Beyond these the inverse of the law loses its digits.
const EXPONENT: Rule = Rule {
    allowed: "a number in [0.1, 10]",
    holds: |x| (0.1..=10.0).contains(&x),
    hint: |x| {
        (x == 0.0)
            .then_some("friction that does not grow with the rate is dry: not a law of this kind")
    },
};
const ETA: Rule = Rule {
    allowed: "a finite number >= 0, stiffness times time; or a table such as \
              { viscosity = 0.1, exponent = 0.5, rate = 1.0 } or { proportional = 0.05 }",
    holds: NON_NEGATIVE.holds,
    hint: |x| {
        (x < 0.0).then_some("friction that feeds energy to the rod has no solution that lasts")
    },
};
/// A size that cannot be 0 where it is written in a table.
const POSITIVE_SIZE: Rule = Rule {
    allowed: POSITIVE.allowed,
    holds: POSITIVE.holds,
    hint: |x| (x == 0.0).then_some("an elastic rod has no damping: leave it out"),
};
/// Fixed numbers of strain nodes.
pub(super) const NODES: (usize, usize) = (4, 400);
/// Maxwell branches of one rod.
const BRANCHES: usize = 32;
/// Coefficients of a polynomial.
const COEFFICIENTS: usize = 16;

/// What the rest of a scene must know of its rod, whatever else is wrong with that.
#[derive(Clone, Copy)]
pub(super) struct Memory {
    /// It has damping.
    pub damped: bool,
    /// It has Maxwell branches.
    pub relaxes: bool,
}

impl Memory {
    /// From `[rod]` as it is written.
    pub fn of(rod: &Table) -> Self {
        let zero = |value: &Spanned<DeValue>| {
            let text = match value.get_ref() {
                DeValue::Float(x) => x.as_str().parse(),
                DeValue::Integer(x) => x.as_str().parse(),
                _ => return false,
            };
            text == Ok(0.0)
        };
        let branches = rod.get("relaxation");
        Self {
            damped: rod.get("damping").is_some_and(|value| !zero(value)),
            relaxes: branches.is_some_and(|value| {
                let list = value.get_ref().as_array();
                list.is_none_or(|list| !list.is_empty())
            }),
        }
    }
}

/// Reports that a field is of no use to a rod that has no damping.
pub(super) fn needs_damping(table: &Table, name: &str, why: &str) {
    let Some(value) = table.get(name) else { return };
    let hint = format!("{why}; write `damping = 0.1` in [rod], or leave it out");
    table.reader.fault(
        FaultKind::Conflict,
        &table.field(name),
        value.span(),
        "left out where the rod has no damping",
        Some(hint),
    );
}

/// Reads `rod.damping` of a planar rod; `None` inside if it is elastic.
pub(super) fn damping(rod: &Table) -> Option<Option<Damping>> {
    let reader = rod.reader;
    rod.read("damping", "", Or(None), |field, value| {
        match value.get_ref() {
            DeValue::Table(_) => {
                let table = reader.table(field, value, &DAMPING, &[], ETA.allowed)?;
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
        let viscosity = reader.number(field, value, ETA)?;
        Some((viscosity != 0.0).then_some(Damping {
            viscosity: StrainMatrix::Bending(viscosity),
            law: FrictionLaw::Linear,
        }))
    })
}

fn friction(table: &Table) -> Option<StrainMatrix> {
    let viscosity = table.optional("viscosity", POSITIVE_SIZE);
    let time = table.optional("proportional", POSITIVE_SIZE);
    match (viscosity?, time?) {
        (Some(viscosity), None) => Some(StrainMatrix::Bending(viscosity)),
        (None, Some(time)) => Some(StrainMatrix::Proportional(time)),
        (Some(_), Some(_)) => {
            let hint = "viscosity = proportional * bending_stiffness: keep one of them";
            table.conflict("proportional", &["viscosity"], hint);
            None
        }
        (None, None) => {
            let allowed = "a finite number > 0, stiffness times time; or proportional, a time";
            table.missing("viscosity", allowed, "viscosity = 0.1");
            None
        }
    }
}

/// `exponent` and `rate`: both or neither.
pub(super) fn power(table: &Table) -> Option<Option<PowerLaw>> {
    let exponent = table.optional("exponent", EXPONENT);
    let rate = table.optional("rate", POSITIVE);
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
    rod.read("relaxation", "", Or(Vec::new()), |field, value| {
        let one = |field: &str, value| {
            let example = "a table such as { stiffness = 0.5, time = 2.0 }";
            branch(&reader.table(field, value, &MAXWELL, &[], example)?)
        };
        let list = reader.list(field, value, allowed, one)?;
        if list.len() > BRANCHES {
            let hint = Some(format!("it has {} branches", list.len()));
            let allowed = format!("an array of at most {BRANCHES} tables");
            reader.fault(FaultKind::Value, field, value.span(), allowed, hint);
            return None;
        }
        list.into_iter().collect()
    })
}

/// Reads `rod.nodes` of a planar rod.
pub(super) fn planar_nodes(rod: &Table) -> Option<Option<usize>> {
    if !Memory::of(rod).damped {
        let why = "an elastic rod is in equilibrium and has no strains of its own to follow";
        needs_damping(rod, "nodes", why);
    }
    nodes(rod)
}

/// Reads the Maxwell branches of a planar rod.
pub(super) fn planar_relaxation(rod: &Table) -> Option<Vec<Maxwell>> {
    if !Memory::of(rod).damped {
        let why = "Maxwell branches alone give a jump of the load no rate, so they stand beside a damping > 0, \
                   however small";
        needs_damping(rod, "relaxation", why);
    }
    let allowed =
        "an array of tables such as { stiffness = 0.5, time = 2.0 }, one for each Maxwell branch";
    relaxation(rod, allowed, |table| {
        let stiffness = table.number("stiffness", NON_NEGATIVE, Required("stiffness = 0.5"));
        let time = relaxation_time(table);
        Some(Maxwell {
            stiffness: StrainMatrix::Bending(stiffness?),
            time: time?,
        })
    })
}

pub(super) fn relaxation_time(table: &Table) -> Option<f64> {
    table.number("time", POSITIVE, Required("time = 2.0"))
}

/// Reads `rod.nodes`.
pub(super) fn nodes(rod: &Table) -> Option<Option<usize>> {
    rod.read("nodes", "", Or(None), |field, value| {
        rod.reader.count(field, value, NODES).map(Some)
    })
}

/// A polynomial in s/length.
pub(super) fn polynomial(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    rule: Rule,
) -> Option<Vec<f64>> {
    let allowed = "an array of 1 to 16 finite numbers, c0 + c1 x + ..., x = s / length";
    let number = |field: &str, value: &_| reader.number(field, value, rule);
    let list = reader.list(field, value, allowed, number)?;
    if !(1..=COEFFICIENTS).contains(&list.len()) {
        let hint = Some(format!("it has {} elements", list.len()));
        reader.fault(FaultKind::Value, field, value.span(), allowed, hint);
        return None;
    }
    list.into_iter().collect()
}

/// Reads `start.curvature`.
pub(super) fn curvature(start: &Table, memory: Option<Memory>) -> Option<Option<Vec<f64>>> {
    if memory.is_some_and(|memory| !memory.damped) {
        let why = "an elastic rod is in equilibrium at every instant: its start is lambda and kappa, or a position";
        needs_damping(start, "curvature", why);
    }
    start.read("curvature", "", Or(None), |field, value| {
        polynomial(start.reader, field, value, FINITE).map(Some)
    })
}

/// Reads `start.relaxed`, a strain field in it by `strain`.
pub(super) fn relaxed<'a>(
    start: &Table<'a>,
    memory: Option<Memory>,
    field_words: &str,
    strain: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<Relaxed>,
) -> Option<Relaxed> {
    let reader = start.reader;
    if memory.is_some_and(|memory| !memory.relaxes)
        && let Some(value) = start.get("relaxed")
    {
        let hint = "nothing else remembers the shape; write `relaxation = [{ stiffness = 0.5, time = 2.0 }]` in \
                    [rod], or leave it out";
        let allowed = "left out where the rod has no Maxwell branches";
        let (kind, field) = (FaultKind::Conflict, start.field("relaxed"));
        reader.fault(kind, &field, value.span(), allowed, Some(hint.to_owned()));
    }
    start.read("relaxed", "", Or(Relaxed::Start), |field, value| {
        match value.get_ref() {
            DeValue::Boolean(true) => Some(Relaxed::Start),
            DeValue::Boolean(false) => Some(Relaxed::Unloaded),
            DeValue::Array(_) | DeValue::Table(_) => strain(field, value),
            other => {
                let quoted = matches!(other.as_str(), Some("true" | "false"));
                let hint = quoted.then_some("leave out the quotes");
                let allowed = format!(
                    "true (relaxed to the shape of the start), false (to the unloaded rod), or {field_words}"
                );
                reader.wrong_type(field, value, &allowed, hint);
                None
            }
        }
    })
}

/// Reads `start.relaxed` of a planar rod.
pub(super) fn planar_relaxed(start: &Table, memory: Option<Memory>) -> Option<Relaxed> {
    let words = "the curvature to which the branches are relaxed, [c0, c1, ...]";
    relaxed(start, memory, words, |field, value| {
        polynomial(start.reader, field, value, FINITE).map(Relaxed::Curvature)
    })
}

/// Reads `run.method`.
pub(super) fn method(run: &Table, memory: Option<Memory>) -> Option<Method> {
    if memory.is_some_and(|memory| !memory.damped) {
        let why = "an elastic run has one method";
        needs_damping(run, "method", why);
    }
    run.read("method", "", Or(Method::Auto), |field, value| {
        let words = [
            ("auto", Method::Auto),
            ("explicit", Method::Explicit),
            ("implicit", Method::Implicit),
        ];
        let allowed = r#""auto", "explicit" or "implicit""#;
        run.reader.choice(field, value, &words, allowed)
    })
}

/// Reports a landing rule that damping leaves no room for.
pub(super) fn landing_is_free(run: &Table, memory: Option<Memory>, landing: Option<&Landing>) {
    let damped = memory.is_some_and(|memory| memory.damped);
    let ruled = landing.is_some_and(|landing| *landing != Landing::Viscous);
    if let (true, true, Some(value)) = (damped, ruled, run.get("landing")) {
        let hint = "a rod with damping finds its own way through a snap; leave out one of the two";
        run.reader.fault(
            FaultKind::Conflict,
            &run.field("landing"),
            value.span(),
            "\"viscous\", or left out, where the rod has damping",
            Some(hint.to_owned()),
        );
    }
}
