//! Reader of `[start]`.

use super::ends::{ON_CIRCLE, ORIENTATION, REACH, norm, orientation, too_far};
use super::fields::{EQUILIBRIUM, LANDING, PLANE, POSE, SHEET, STATICS, STRAIN, Spec};
use super::friction::needs_damping;
use super::phrases::Short;
use super::ranges::{FINITE, KAPPA, LAMBDA, VALUE};
use super::reader::Reader;
use super::rod::{RodTraits, curvature};
use super::table::{Absent, Table};
use super::varying::{not_positive, polynomial};
use crate::manifold;
use crate::scene::{
    Clamp, EndLoad, EndPose, FaultKind, InitialShape, LandingRule, RelaxedAt, Rod, Sheet,
    SheetName, Start, Straight, StrainField, StrainName, StrainRate,
};
use toml::Spanned;
use toml::de::DeValue;

/// Parts of the scene on which the start depends, as far as readable.
#[derive(Clone, Copy)]
pub(super) struct Known<'k> {
    /// The rod without friction.
    pub elastic: Option<&'k Rod>,
    pub clamp: Option<&'k Clamp>,
    pub weld: Option<bool>,
    pub memory: Option<RodTraits>,
}

pub(super) fn start(table: &Table, known: Known) -> Option<Start> {
    match table.reader.kind.get() {
        PLANE => planar(table, known),
        STATICS => {
            let reader = table.reader;
            let wrench = table.maybe("wrench", |field, value| reader.vector(field, value, &VALUE));
            Some(Start {
                wrench: wrench?,
                ..Start::default()
            })
        }
        _ => spatial(table, known),
    }
}

fn planar(table: &Table, known: Known) -> Option<Start> {
    let reader = table.reader;
    let velocity = table.vector("velocity");
    let with_clamp = table.flag("with_clamp");
    let imperfection = table.number("imperfection");
    let lambda = table.optional("lambda");
    let kappa = table.optional("kappa");
    let p = table.optional("p");
    let position = table.maybe("position", |field, value| {
        let position = reader.point(field, value, &FINITE)?;
        reachable(reader, field, value, position, known)
    });
    let allowed = r#""stable", "lowest" or a table such as { mode = 1, sign = "-" }"#;
    let sheet = table.read(
        "sheet",
        allowed,
        Absent::Or(Sheet::Stable),
        |field, value| {
            let words = [("stable", Sheet::Stable), ("lowest", Sheet::Lowest)];
            word_or_name(reader, field, value, &words, allowed, &SHEET, Sheet::Named)
        },
    );
    if known.memory.is_some_and(|memory| !memory.has_strains()) {
        let why = "an elastic rod is in equilibrium at every instant: its start is lambda and kappa, or a position";
        needs_damping(table, "curvature", why);
    }
    let bent = table.maybe("curvature", |field, value| curvature(table, field, value));
    let rate = rate(
        table,
        "curvature_rate",
        "curvature",
        known.memory,
        velocity.is_some_and(|v| v != [0.0; 3]),
        |field, value| curvature(table, field, value).map(StrainRate::Curvature),
    );
    let words = "the curvature to which the branches are relaxed, [c0, c1, ...]";
    let relaxed = relaxed(table, known.memory, words, |field, value| {
        curvature(table, field, value).map(RelaxedAt::Curvature)
    });
    let unloaded = unloaded(table);

    let consistent = one_place(table);
    let (velocity, with_clamp, imperfection) = (velocity?, with_clamp?, imperfection?);
    let (lambda, kappa, p) = (lambda?, kappa?, p?);
    let (position, sheet) = (position?, sheet?);
    let (bent, relaxed, unloaded, rate) = (bent?, relaxed?, unloaded?, rate?);
    consistent.then_some(())?;
    let place = match (lambda, kappa, p, position, bent) {
        (Some(lambda), Some(kappa), None, None, None) => InitialShape::Kappa { lambda, kappa },
        (Some(lambda), None, Some(p), None, None) => InitialShape::P { lambda, p },
        (None, None, None, Some(None), None) => STRAIGHT,
        (None, None, None, Some(Some(position)), None) => {
            InitialShape::Position { position, sheet }
        }
        (None, None, None, None, Some(curvature)) => InitialShape::Curvature { curvature },
        // `one_place` has reported all other combinations.
        _ => match unloaded {
            Some(place) => place,
            None => {
                let hint = "write settled = true, or where else the rod starts, as `lambda = 6.3` and `kappa = 0.6`";
                return table.refuse(
                    FaultKind::Value,
                    "settled",
                    "true where no other start is given",
                    hint,
                );
            }
        },
    };
    Some(Start {
        place,
        relaxed,
        rate,
        velocity,
        imperfection,
        with_clamp,
        ..Start::default()
    })
}

const STRAIGHT: InitialShape = InitialShape::Rest {
    rest: Straight::Straight,
};

/// Reads `rest` or `settled`.
fn unloaded(table: &Table) -> Option<Option<InitialShape>> {
    let rest = match table.get("rest") {
        None => Some(None),
        Some(_) => table.word("rest", &[STRAIGHT]).map(Some),
    };
    let settled = match table.get("settled") {
        None => Some(false),
        Some(_) => table.read("settled", "", Absent::Or(false), |field, value| {
            table.reader.flag(field, value)
        }),
    };
    let settled = settled?.then_some(InitialShape::Settled { settled: true });
    Some(rest?.or(settled))
}

/// True if exactly one equilibrium, position or strain field is named; otherwise reports the faults.
fn one_place(table: &Table) -> bool {
    let chart = table.given(&["lambda", "kappa", "p"]);
    let has = |name: &str| table.has(name);
    if one_of(table, &["curvature", "rest", "settled"]).is_none() {
        return false;
    }
    if has("imperfection") && !has("rest") {
        let others = ["lambda", "kappa", "p", "position", "curvature", "settled"];
        let others = table.given(&others);
        if !others.is_empty() {
            let hint = "it bends a straight rod: write rest = \"straight\", or leave it out";
            table.conflict("imperfection", &others, hint);
            return false;
        }
    }
    let whole = ["curvature", "rest", "settled"];
    if let Some(name) = whole.into_iter().find(|name| has(name)) {
        let others = table.given(&["lambda", "kappa", "p", "position", "sheet"]);
        if !others.is_empty() {
            let hint = "it is the whole shape of the rod: start from it, or from an equilibrium";
            table.conflict(name, &others, hint);
        }
        return others.is_empty();
    }
    let mut consistent = true;
    if has("kappa") && has("p") {
        table.conflict("p", &["kappa"], "kappa = tanh p: keep one of them");
        consistent = false;
    }
    if has("position") {
        if !chart.is_empty() {
            let hint = "start from lambda and kappa, or from a position and a sheet";
            table.conflict("position", &chart, hint);
            consistent = false;
        }
        return consistent;
    }
    if chart.is_empty() {
        let allowed = "an equilibrium: lambda with kappa (or p), or position; or rest = \"straight\"; or, of a rod with damping, curvature";
        let hint = "write `lambda = 6.3` and `kappa = 0.6` in [start]".to_owned();
        let (kind, at) = (FaultKind::Missing, table.at);
        table
            .reader
            .record(kind, at, "start", None, allowed, Some(hint));
        return false;
    }
    if has("sheet") {
        table.conflict(
            "sheet",
            &chart,
            "they name one equilibrium, and so its sheet",
        );
        consistent = false;
    }
    if !has("lambda") {
        table.missing("lambda", LAMBDA.allowed, "lambda = 6.3");
        consistent = false;
    }
    if !has("kappa") && !has("p") {
        table.missing("kappa", KAPPA.allowed, "kappa = 0.6");
        consistent = false;
    }
    consistent
}

/// The position; `Some(None)` if the rod is straight there. A position out of reach is a fault.
#[allow(clippy::option_option)]
fn reachable(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    position: [f64; 3],
    known: Known,
) -> Option<Option<[f64; 3]>> {
    let (length, clamp) = (known.elastic?.length, known.clamp?);
    let [x, y] = [0, 1].map(|i| (position[i] - clamp.position[i]) / length);
    let distance = x.hypot(y);
    if distance < 1.0 - ON_CIRCLE {
        return Some(Some(position));
    }
    let [c, _, _, s] = clamp.orientation.quaternion();
    let (cos, sin) = (c * c - s * s, 2.0 * c * s);
    let on_circle = distance <= 1.0 + ON_CIRCLE;
    // On the tangent of the clamp, up to rounding of the position.
    if on_circle && (x * sin - y * cos).abs() <= ON_CIRCLE && x * cos + y * sin > 0.0 {
        return Some(None);
    }
    let shown = Short(distance);
    let hint = if on_circle {
        "it is on the circle |r| = length, where the rod is straight and its tension unbounded; start \
         a little inside, or straight along the clamp: rest = \"straight\""
    .to_owned()
    } else {
        format!("the rod cannot reach so far: |r| / length = {shown:.6}")
    };
    let allowed = format!(
        "inside the disc of radius {}, the length of the rod, around the clamp",
        Short(length)
    );
    reader.refuse(FaultKind::Value, field, value, allowed, hint)
}

/// Reads one of some words, or the name of a sheet.
pub(super) fn word_or_name<'a, T: Clone>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    words: &[(&'static str, T)],
    allowed: &str,
    spec: &'static Spec,
    named: fn(SheetName) -> T,
) -> Option<T> {
    if !value.get_ref().is_table() {
        return reader.choice(field, value, words, allowed);
    }
    let table = reader.table(field, value, spec, allowed)?;
    let mode = table.count("mode");
    let sign = table.word("sign", &[manifold::Sign::Plus, manifold::Sign::Minus]);
    let near = match spec.field("near", PLANE) {
        Some(_) => table.optional("near"),
        None => Some(None),
    };
    Some(named(SheetName {
        sheet: manifold::Sheet {
            mode: mode? as u32,
            sign: sign?,
        },
        near: near?,
    }))
}

fn spatial(table: &Table, known: Known) -> Option<Start> {
    let reader = table.reader;
    let velocity = table.vector("velocity");
    let with_clamp = table.flag("with_clamp");
    let angular_velocity = turning(table, "angular_velocity", known.weld);
    let words = "a strain field such as { u1 = [0.5, -0.5] }";
    let rate = rate(
        table,
        "strain_rate",
        "strain",
        known.memory,
        [velocity, angular_velocity]
            .iter()
            .flatten()
            .any(|v| *v != [0.0; 3]),
        |field, value| {
            let rates = strain(reader, field, value, known.elastic, false)?;
            Some(StrainRate::Strain(rates))
        },
    );
    let relaxed = relaxed(table, known.memory, words, |field, value| {
        strain(reader, field, value, known.elastic, true).map(RelaxedAt::Strain)
    });
    let place =
        |name: &str, parse: &dyn Fn(&str, _) -> Option<InitialShape>| table.maybe(name, parse);
    if known.memory.is_some_and(|memory| !memory.has_strains()) {
        let why = "an elastic rod is in equilibrium at every instant: its start is a pose, an equilibrium under a load, settled, or \
                   rest = \"straight\"";
        needs_damping(table, "strain", why);
    }
    let by_strain = place("strain", &|field, value| {
        strain(reader, field, value, known.elastic, true)
            .map(|strain| InitialShape::Strain { strain })
    });
    let by_load = place("equilibrium", &|field, value| {
        let allowed = "a table such as { force = [0.0, 0.0, -1.0] }";
        let table = reader.table(field, value, &EQUILIBRIUM, allowed)?;
        let force = table.vector("force");
        let couple = turning(&table, "couple", known.weld);
        Some(InitialShape::Equilibrium {
            equilibrium: EndLoad {
                force: force?,
                couple: couple?,
            },
        })
    });
    let by_pose = place("pose", &|field, value| {
        pose(reader, field, value, known).map(|pose| InitialShape::Pose { pose })
    });
    let unloaded = unloaded(table);
    let names = ["strain", "equilibrium", "pose", "rest", "settled"];
    one_of(table, &names)?;
    let place = by_strain?.or(by_load?).or(by_pose?).or(unloaded?);
    Some(Start {
        place: place.unwrap_or_default(),
        relaxed: relaxed?,
        rate: rate?,
        velocity: velocity?,
        angular_velocity: angular_velocity?,
        imperfection: 0.0,
        with_clamp: with_clamp?,
        wrench: None,
    })
}

/// Reports all but the first of these fields if several are given.
fn one_of(table: &Table, names: &[&'static str]) -> Option<()> {
    let given = table.given(names);
    let [first, rest @ ..] = given.as_slice() else {
        return Some(());
    };
    for name in rest {
        let hint = "each is the whole shape of the rod: keep one of them";
        table.conflict(name, &[first], hint);
    }
    rest.is_empty().then_some(())
}

/// Reads a couple or an angular velocity, which must vanish for a ball joint.
pub(super) fn turning(table: &Table, name: &str, weld: Option<bool>) -> Option<[f64; 3]> {
    let vector = table.vector(name)?;
    if weld != Some(false) || vector == [0.0; 3] {
        return Some(vector);
    }

    let hint = "an end that is free to turn takes no couple, and its body is a point; write joint = \"weld\" in [body]";
    table.refuse(
        FaultKind::Conflict,
        name,
        "0, or left out, where the joint is a ball",
        hint,
    )
}

fn strain<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rod: Option<&Rod>,
    whole: bool,
) -> Option<StrainField> {
    let allowed = "a table such as { u1 = [0.5, -0.5] }: polynomials in s / length";
    let table = reader.table(field, value, &STRAIN, allowed)?;
    let rigid = rod.map_or([false; 6], |rod| rod.section.rigid());
    let read = StrainName::ALL.map(|name| {
        table.maybe(name.as_str(), |field, value| {
            if rigid[name as usize] {
                let hint =
                    "the section holds it at its rest value: give it a stiffness in [rod.section]";
                let kind = FaultKind::Conflict;
                return reader.refuse(kind, field, value, "left out where it is rigid", hint);
            }
            let coefficients = polynomial(reader, field, value, &VALUE)?;
            if whole
                && name == StrainName::V3
                && let Some(x) = not_positive(&coefficients)
            {
                let hint = Some(format!(
                    "it is not > 0 at s / length = {x:.6}: total compression"
                ));
                let allowed = "> 0 everywhere on the rod, 0 <= s / length <= 1";
                return reader.refuse(FaultKind::Value, field, value, allowed, hint);
            }
            Some(coefficients)
        })
    });
    let [u1, u2, u3, v1, v2, v3] = read;
    Some(StrainField([u1?, u2?, u3?, v1?, v2?, v3?]))
}

fn pose<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    known: Known,
) -> Option<EndPose> {
    let allowed =
        "a table such as { position = [0.5, 0.0, 0.5], quaternion = [1.0, 0.0, 0.0, 0.0] }";
    let table = reader.table(field, value, &POSE, allowed)?;
    let words = "an array of three finite numbers, [x, y, z]";
    let position = table.read("position", words, Absent::Fault, |field, value| {
        let position: [f64; 3] = reader.vector(field, value, &VALUE)?;
        let (Some(rod), Some(clamp)) = (known.elastic, known.clamp) else {
            return Some(position);
        };
        let apart: [f64; 3] = std::array::from_fn(|i| position[i] - clamp.position[i]);
        match too_far(norm(&apart), rod.length).filter(|_| rod.section.is_inextensible()) {
            None => Some(position),
            hint => reader.refuse(FaultKind::Value, field, value, REACH, hint),
        }
    });
    let orientation = orientation(&table)?;
    match (known.weld, orientation) {
        (Some(true), None) => {
            let allowed =
                "a unit quaternion [w, x, y, z], or rotation, or tangent, where the body is welded";
            table.missing("quaternion", allowed, "quaternion = [1.0, 0.0, 0.0, 0.0]");
            return None;
        }
        (Some(false), Some(_)) => {
            for name in table.given(&ORIENTATION) {
                let hint = "an end that is free to turn is where it is, whichever way it points";
                let allowed = "left out where the joint is a ball";
                table.fault(FaultKind::Conflict, name, allowed, hint);
            }
            return None;
        }
        _ => {}
    }
    Some(EndPose {
        position: position?,
        orientation,
    })
}

/// Reads `start.curvature_rate` or `strain_rate` of a rod with mass; the field `beside` is then required.
fn rate<'a>(
    start: &Table<'a>,
    name: &str,
    beside: &str,
    memory: Option<RodTraits>,
    moves: bool,
    read: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<StrainRate>,
) -> Option<Option<StrainRate>> {
    if start.has(name) {
        if memory.is_some_and(|memory| !memory.heavy) {
            let hint = "the strains of a rod without mass have no rates of their own; write inertia = \"full\" and mass = 0.02 in [rod]";
            let allowed = "left out where the rod has no mass";
            return start.refuse(FaultKind::Conflict, name, allowed, hint);
        }
        if !start.has(beside) {
            let hint = format!(
                "of a rod in equilibrium the strains change as it follows its end, by `velocity`; write `{beside}` too, or leave it out"
            );
            return start.refuse(
                FaultKind::Conflict,
                name,
                format!("left out without `{beside}`"),
                hint,
            );
        }
        let twice = start.given(&["velocity", "angular_velocity"]);
        if moves {
            let hint = "both say how fast the rod moves: keep one of them";
            start.conflict(name, &twice, hint);
            return None;
        }
    }
    start.maybe(name, read)
}

/// Reads `start.relaxed`; `strain` reads a strain field.
pub(super) fn relaxed<'a>(
    start: &Table<'a>,
    memory: Option<RodTraits>,
    field_words: &str,
    strain: impl FnOnce(&str, &'a Spanned<DeValue<'a>>) -> Option<RelaxedAt>,
) -> Option<RelaxedAt> {
    let reader = start.reader;
    if memory.is_some_and(|memory| !memory.relaxes) {
        let hint = "nothing else remembers the shape; write `relaxation = [{ stiffness = 0.5, time = 2.0 }]` in \
                    [rod], or leave it out";
        let allowed = "left out where the rod has no Maxwell branches";
        start.fault(FaultKind::Conflict, "relaxed", allowed, hint);
    }
    start.read("relaxed", "", Absent::Or(RelaxedAt::Start), |field, value| {
        match value.get_ref() {
            DeValue::Boolean(true) => Some(RelaxedAt::Start),
            DeValue::Boolean(false) => Some(RelaxedAt::Unloaded),
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

/// Reads `run.landing`.
pub(super) fn landing(run: &Table, memory: Option<RodTraits>) -> Option<LandingRule> {
    let words = [
        ("viscous", LandingRule::Viscous),
        ("lowest", LandingRule::Lowest),
        ("all", LandingRule::All),
    ];
    let planar = run.reader.kind.get() == PLANE;
    let allowed = if planar {
        r#""viscous", "lowest", "all" or a table such as { mode = 0, sign = "+" }"#
    } else {
        r#""viscous", "lowest", "all" or a table such as { order = 2 }"#
    };
    let landing = run.read(
        "landing",
        allowed,
        Absent::Or(LandingRule::Viscous),
        |field, value| {
            if !planar && value.get_ref().is_table() {
                let table = run.reader.table(field, value, &LANDING, allowed)?;
                let order = table.count("order")?;
                return Some(LandingRule::Ordered { order });
            }
            let named = |name: SheetName| LandingRule::Named(name.sheet);
            word_or_name(run.reader, field, value, &words, allowed, &LANDING, named)
        },
    );
    let passes = memory.is_some_and(RodTraits::has_strains);
    let damped = memory.is_some_and(|memory| memory.damped);
    if passes && !damped && landing.is_some_and(|landing| landing != LandingRule::Viscous) {
        let hint = "a rod with mass finds its own way through a snap; leave out one of the two";
        let allowed = "\"viscous\", or left out, where the rod has mass";
        run.fault(FaultKind::Conflict, "landing", allowed, hint);
    }
    if damped && landing.is_some_and(|landing| landing != LandingRule::Viscous) {
        let hint = "a rod with damping finds its own way through a snap; leave out one of the two";
        run.fault(
            FaultKind::Conflict,
            "landing",
            "\"viscous\", or left out, where the rod has damping",
            hint,
        );
    }
    landing
}
