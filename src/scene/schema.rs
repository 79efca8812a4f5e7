//! What a scene may hold: fields, sets, defaults, and what they require of each other.

use super::fault::{FaultKind, Faults};
use super::kind::{Kind, kind_of};
use super::reader::{Need, Reader, Rule, Short, Spec, Table};
use super::sources::Sources;
use super::viscous_schema::{
    Memory, curvature, damping, landing_is_free, method, planar_nodes, planar_relaxation,
    planar_relaxed,
};
use super::{
    Body, Clamp, Force, Joint, Landing, Loads, Model, Place, Rest, Rod, Run, Scene, Section, Sheet,
    SheetName, Solve, Start, Units, spatial_schema, statics_schema,
};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use Need::{Or, Required};

const TOP: Spec = Spec {
    name: "",
    fields: &["units", "rod", "body", "start", "loads", "run"],
    barred: &[],
};
const ROD: Spec = Spec {
    name: "rod",
    fields: &[
        "model",
        "length",
        "bending_stiffness",
        "damping",
        "relaxation",
        "nodes",
    ],
    barred: &[],
};
const BODY: Spec = Spec {
    name: "body",
    fields: &["mass"],
    barred: &[],
};
const START: Spec = Spec {
    name: "start",
    fields: &[
        "lambda",
        "kappa",
        "p",
        "position",
        "sheet",
        "curvature",
        "relaxed",
        "velocity",
    ],
    barred: &[],
};
const LOADS: Spec = Spec {
    name: "loads",
    fields: &["gravity", "dead", "drag", "force"],
    barred: &[],
};
const RUN: Spec = Spec {
    name: "run",
    fields: &[
        "duration",
        "tolerance",
        "method",
        "landing",
        "branches",
        "samples",
        "max_steps",
        "max_snaps",
    ],
    barred: &[],
};
const FORCE: Spec = Spec {
    name: "loads.force",
    fields: &["direction", "amplitude", "frequency", "phase"],
    barred: &[],
};
const SHEET: Spec = Spec {
    name: "sheet",
    fields: &["mode", "sign", "near"],
    barred: &[],
};
const LANDING: Spec = Spec {
    name: "landing",
    fields: &["mode", "sign"],
    barred: &[],
};
/// Where a field that stands in the wrong table may belong.
pub(super) const HOMES: [&Spec; 6] = [&TOP, &ROD, &BODY, &START, &LOADS, &RUN];

pub(super) const SILENT: fn(f64) -> Option<&'static str> = |_| None;
pub(super) const FINITE: Rule = Rule {
    allowed: "a finite number",
    holds: f64::is_finite,
    hint: SILENT,
};
pub(super) const POSITIVE: Rule = Rule {
    allowed: "a finite number > 0",
    holds: |x| 0.0 < x && x < f64::INFINITY,
    hint: SILENT,
};
pub(super) const NON_NEGATIVE: Rule = Rule {
    allowed: "a finite number >= 0",
    holds: |x| (0.0..f64::INFINITY).contains(&x),
    hint: SILENT,
};
const LAMBDA: Rule = Rule {
    allowed: "a number in (0, 1e4]",
    holds: |x| 0.0 < x && x <= 1e4,
    hint: SILENT,
};
const KAPPA: Rule = Rule {
    allowed: "a number in (-1, 1), not 0",
    holds: |x| -1.0 < x && x < 1.0 && x != 0.0,
    hint: |x| match x.abs() {
        0.0 => Some("kappa = 0 is the straight rod, whatever lambda: bend it a little"),
        1.0 => {
            Some("kappa = 1 is the infinitely taut rod; write p, kappa = tanh p, for a rod near it")
        }
        _ => None,
    },
};
const P: Rule = Rule {
    allowed: "a number in [-1e4, 1e4], not 0",
    holds: |x| (-1e4..=1e4).contains(&x) && x != 0.0,
    hint: |x| (x == 0.0).then_some("p = 0 is the straight rod, whatever lambda: bend it a little"),
};
pub(super) const TOLERANCE: Rule = Rule {
    allowed: "a number in [1e-14, 1e-2]",
    holds: |x| (1e-14..=1e-2).contains(&x),
    hint: SILENT,
};
/// lambda exceeds mode * pi, so that no mode above 1e4 / pi is in reach of lambda <= 1e4.
const MODES: (usize, usize) = (0, 3000);
/// Relative width around |r| = L within which a position counts as on the circle: the rounding of
/// the norm.
pub(super) const ON_CIRCLE: f64 = 4.0 * f64::EPSILON;

/// Reads a scene, or every fault of it.
pub(super) fn scene(sources: &Sources) -> Result<Scene, Faults> {
    read(sources, |reader, document| {
        // Missing tables are reported at the end of the text, where they can be added.
        let end = sources.document().len().saturating_sub(1);
        let top = |spec, homes| Table::open(reader, "", document, end, spec, homes);
        match kind_of(document) {
            Kind::Planar => resolve(&top(&TOP, &HOMES)),
            Kind::Statics => {
                statics_schema::resolve(&top(&statics_schema::TOP, &statics_schema::HOMES))
            }
            Kind::Motion => {
                spatial_schema::resolve(&top(&spatial_schema::TOP, &spatial_schema::HOMES))
            }
        }
    })
}

/// Resolves a document, or gives every fault of it.
pub(super) fn read<T>(
    sources: &Sources,
    resolve: impl FnOnce(&Reader, &DeTable) -> Option<T>,
) -> Result<T, Faults> {
    let reader = Reader::new(sources);
    let document = reader.document();
    match document.and_then(|document| resolve(&reader, &document)) {
        Some(scene) if reader.is_clean() => Ok(scene),
        _ => Err(reader.into_faults()),
    }
}

/// Reads everything before it gives up anything: `?` only after the last field, as in every
/// function below.
fn resolve(top: &Table) -> Option<Scene> {
    let units = units(top);
    let rod_table = required(top, &ROD, &HOMES, "length = 1.0");
    let memory = rod_table.as_ref().map(Memory::of);
    let rod = rod_table.as_ref().and_then(rod);
    let body = required(top, &BODY, &HOMES, "mass = 1.0").and_then(|table| body(&table));
    let length = rod.as_ref().map(|rod| rod.length);
    let start = required(top, &START, &HOMES, "lambda = 6.3")
        .and_then(|table| start(&table, length, memory));
    let loads = match top.get("loads") {
        None => Some(Loads::default()),
        Some(value) => open(top, value, &LOADS, &HOMES).and_then(|table| loads(&table)),
    };
    let run = required(top, &RUN, &HOMES, "duration = 3.0").and_then(|table| run(&table, memory));
    let scene = Scene {
        units: units?,
        rod: rod?,
        clamp: Clamp::default(),
        body: Some(body?),
        end: None,
        start: start?,
        loads: loads?,
        run: Some(run?),
        solve: Solve::default(),
        continuation: None,
    };
    if !is_normal(&scene) {
        top.reader.record(
            FaultKind::Value,
            rod_table.map_or(0, |table| table.at),
            "rod",
            None,
            "in units in which the scales of force EI/L^2, time sqrt(m L^3/EI), ..., and the velocity, the \
             loads and curvatures (with their squares), the viscosities and the duration measured by them, are \
             numbers",
            Some("they over- or underflow: choose units nearer to the rod's size".to_owned()),
        );
        return None;
    }
    Some(scene)
}

/// True if the scales, and all that is measured by them, are numbers. A rod that cannot be made is for those who make it to
/// refuse.
pub(super) fn is_normal(scene: &Scene) -> bool {
    match (scene.scales(), scene.dimensionless()) {
        (Ok(scales), Ok(plain)) => scales.are_normal() && plain.is_finite(),
        _ => true,
    }
}

pub(super) fn units(top: &Table) -> Option<Units> {
    top.read("units", "", Or(Units::default()), |field, value| {
        let words = [("si", Units::Si), ("dimensionless", Units::Dimensionless)];
        let allowed = r#""si" or "dimensionless""#;
        top.reader.choice(field, value, &words, allowed)
    })
}

pub(super) fn required<'a>(
    top: &Table<'a>,
    spec: &Spec,
    homes: &[&Spec],
    example: &str,
) -> Option<Table<'a>> {
    let Some(value) = top.get(spec.name) else {
        let hint = format!("add `[{}]` with a line such as `{example}`", spec.name);
        let allowed = format!("a table with {}", spec.fields.join(", "));
        let (kind, at) = (FaultKind::Missing, top.at);
        top.reader
            .record(kind, at, spec.name, None, allowed, Some(hint));
        return None;
    };
    open(top, value, spec, homes)
}

pub(super) fn open<'a>(
    top: &Table<'a>,
    value: &'a Spanned<DeValue<'a>>,
    spec: &Spec,
    homes: &[&Spec],
) -> Option<Table<'a>> {
    let allowed = format!("a table, [{}]", spec.name);
    top.reader.table(spec.name, value, spec, homes, &allowed)
}

fn rod(table: &Table) -> Option<Rod> {
    let words = r#""elastica""#;
    let example = Required(r#"model = "elastica""#);
    let model = table.read("model", words, example, |field, value| {
        let models = [("elastica", Model::Elastica)];
        table.reader.choice(field, value, &models, words)
    });
    let length = table.number("length", POSITIVE, Required("length = 1.0"));
    let stiffness = Required("bending_stiffness = 1.0");
    let bending_stiffness = table.number("bending_stiffness", POSITIVE, stiffness);
    let (damping, relaxation, nodes) = (
        damping(table),
        planar_relaxation(table),
        planar_nodes(table),
    );
    Some(Rod {
        model: model?,
        length: length?,
        section: Section::Bending(bending_stiffness?),
        rest: Rest::default(),
        damping: damping?,
        relaxation: relaxation?,
        nodes: nodes?,
    })
}

fn body(table: &Table) -> Option<Body> {
    let mass = table.number("mass", POSITIVE, Required("mass = 1.0"));
    Some(Body {
        mass: mass?,
        joint: Joint::Ball,
    })
}

fn start(table: &Table, length: Option<f64>, memory: Option<Memory>) -> Option<Start> {
    let velocity = table.vector("velocity", FINITE, Or([0.0; 2])).map(in_plane);
    let lambda = table.optional("lambda", LAMBDA);
    let kappa = table.optional("kappa", KAPPA);
    let p = table.optional("p", P);
    let position = table.read("position", "", Or(None), |field, value| {
        let position = table.reader.vector(field, value, FINITE)?;
        reachable(table.reader, field, value, position, length?).then_some(Some(position))
    });
    let words = [("stable", Sheet::Stable), ("lowest", Sheet::Lowest)];
    let allowed = r#""stable", "lowest" or a table such as { mode = 1, sign = "-" }"#;
    let sheet = table.read("sheet", allowed, Or(Sheet::Stable), |field, value| {
        word_or_name(
            table.reader,
            field,
            value,
            &words,
            allowed,
            &SHEET,
            Sheet::Named,
        )
    });

    let curvature = curvature(table, memory);
    let relaxed = planar_relaxed(table, memory);

    let consistent = one_place(table);
    let (velocity, lambda, kappa, p) = (velocity?, lambda?, kappa?, p?);
    let (position, sheet) = (position?, sheet?);
    let (curvature, relaxed) = (curvature?, relaxed?);
    consistent.then_some(())?;
    let place = match (lambda, kappa, p, position, curvature) {
        (Some(lambda), Some(kappa), None, None, None) => Place::Kappa { lambda, kappa },
        (Some(lambda), None, Some(p), None, None) => Place::P { lambda, p },
        (None, None, None, Some(position), None) => Place::Position {
            position: in_plane(position),
            sheet,
        },
        (None, None, None, None, Some(curvature)) => Place::Curvature { curvature },
        // `one_place` has reported every other case.
        _ => return None,
    };
    Some(Start {
        place,
        relaxed,
        velocity,
        ..Start::default()
    })
}

/// A vector of the plane.
fn in_plane([x, y]: [f64; 2]) -> [f64; 3] {
    [x, y, 0.0]
}

/// True if exactly one equilibrium, position or strain field is named; else the faults.
fn one_place(table: &Table) -> bool {
    let given = |name: &&str| table.get(name).is_some();
    let chart: Vec<&str> = ["lambda", "kappa", "p"].into_iter().filter(given).collect();
    let has = |name: &str| given(&name);
    if has("curvature") {
        let others = ["lambda", "kappa", "p", "position", "sheet"];
        let others: Vec<&str> = others.into_iter().filter(given).collect();
        if !others.is_empty() {
            let hint = "it is the whole shape of the rod: start from it, or from an equilibrium";
            table.conflict("curvature", &others, hint);
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
        let allowed = "an equilibrium: lambda with kappa (or p), or position; or, of a rod with damping, curvature";
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

/// True if the free end can be at `position`; else the fault.
fn reachable(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    position: [f64; 2],
    length: f64,
) -> bool {
    let [x, y] = position.map(|component| component / length);
    let distance = x.hypot(y);
    let shown = Short(distance);
    if distance < 1.0 - ON_CIRCLE {
        return true;
    }
    let hint = if distance <= 1.0 + ON_CIRCLE {
        "it is on the circle |r| = length, where the rod is straight and its tension unbounded; start \
         a little inside"
            .to_owned()
    } else {
        format!("the rod cannot reach so far: |r| / length = {shown:.6}")
    };
    let allowed = format!(
        "inside the disc of radius {}, the length of the rod, around the clamp",
        Short(length)
    );
    reader.fault(FaultKind::Value, field, value.span(), allowed, Some(hint));
    false
}

/// One of some words, or the name of a sheet.
fn word_or_name<'a, T: Clone>(
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
    let table = reader.table(field, value, spec, &[], allowed)?;
    let (least, most) = MODES;
    let allowed = format!("an integer from {least} to {most}");
    let mode = table.read("mode", &allowed, Required("mode = 1"), |field, value| {
        reader.count(field, value, MODES)
    });
    let allowed = r#""+" or "-""#;
    let sign = table.read(
        "sign",
        allowed,
        Required(r#"sign = "-""#),
        |field, value| {
            let signs = [
                ("+", crate::manifold::Sign::Plus),
                ("-", crate::manifold::Sign::Minus),
            ];
            reader.choice(field, value, &signs, allowed)
        },
    );
    let near = if spec.fields.contains(&"near") {
        table.optional("near", LAMBDA)
    } else {
        Some(None)
    };
    Some(named(SheetName {
        sheet: crate::manifold::Sheet {
            mode: mode? as u32,
            sign: sign?,
        },
        near: near?,
    }))
}

fn loads(table: &Table) -> Option<Loads> {
    let gravity = table.vector("gravity", FINITE, Or([0.0; 2]));
    let dead = table.vector("dead", FINITE, Or([0.0; 2]));
    let drag = table.number("drag", NON_NEGATIVE, Or(0.0));
    let force = forces::<2>(table);
    Some(Loads {
        gravity: in_plane(gravity?),
        dead: in_plane(dead?),
        couple: [0.0; 3],
        drag: drag?,
        force: force?,
    })
}

/// Reads `loads.force`.
pub(super) fn forces<const N: usize>(loads: &Table) -> Option<Vec<Force>> {
    let reader = loads.reader;
    loads.read("force", "", Or(Vec::new()), |field, value| {
        let DeValue::Array(array) = value.get_ref() else {
            return Some(vec![force::<N>(reader, field, value)?]);
        };
        let read = |(i, value)| force::<N>(reader, &format!("{field}[{i}]"), value);
        let forces: Vec<Option<Force>> = array.iter().enumerate().map(read).collect();
        forces.into_iter().collect()
    })
}

fn force<'a, const N: usize>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
) -> Option<Force> {
    let (allowed, words, example) = match N {
        2 => (
            "a table such as { direction = [0.0, 1.0], amplitude = 0.5, frequency = 2.0 }, or an array of them",
            "an array of two finite numbers, [x, y], not both 0",
            "direction = [0.0, 1.0]",
        ),
        _ => (
            "a table such as { direction = [0.0, 1.0, 0.0], amplitude = 0.5, frequency = 2.0 }, or an array of \
             them",
            "an array of three finite numbers, [x, y, z], not all 0",
            "direction = [0.0, 1.0, 0.0]",
        ),
    };
    let table = reader.table(field, value, &FORCE, &[], allowed)?;
    let (allowed, example) = (words, Required(example));
    let direction = table.read("direction", allowed, example, |field, value| {
        let direction: [f64; N] = reader.vector(field, value, FINITE)?;
        if direction == [0.0; N] {
            reader.fault(FaultKind::Value, field, value.span(), allowed, None);
            return None;
        }
        Some(std::array::from_fn(|i| {
            direction.get(i).copied().unwrap_or(0.0)
        }))
    });
    let amplitude = table.number("amplitude", FINITE, Required("amplitude = 0.5"));
    let frequency = table.number("frequency", NON_NEGATIVE, Required("frequency = 2.0"));
    let phase = table.number("phase", FINITE, Or(0.0));
    Some(Force {
        direction: direction?,
        amplitude: amplitude?,
        frequency: frequency?,
        phase: phase?,
    })
}

fn run(table: &Table, memory: Option<Memory>) -> Option<Run> {
    let duration = table.number("duration", POSITIVE, Required("duration = 3.0"));
    let tolerance = table.number("tolerance", TOLERANCE, Or(Run::TOLERANCE));
    let words = [
        ("viscous", Landing::Viscous),
        ("lowest", Landing::Lowest),
        ("all", Landing::All),
    ];
    let allowed = r#""viscous", "lowest", "all" or a table such as { mode = 0, sign = "+" }"#;
    let landing = table.read("landing", allowed, Or(Landing::Viscous), |field, value| {
        word_or_name(
            table.reader,
            field,
            value,
            &words,
            allowed,
            &LANDING,
            |name| Landing::Named(name.sheet),
        )
    });
    landing_is_free(table, memory, landing.as_ref());
    let method = method(table, memory);
    let branches = table.count("branches", (1, 10_000), Run::BRANCHES);
    let samples = table.count("samples", (2, 10_000_000), Run::SAMPLES);
    let max_steps = table.count("max_steps", (1, 1_000_000_000), Run::MAX_STEPS);
    let max_snaps = table.count("max_snaps", (0, 1_000_000_000), Run::MAX_SNAPS);
    Some(Run {
        duration: duration?,
        tolerance: tolerance?,
        method: method?,
        reduce: true,
        landing: landing?,
        branches: branches?,
        samples: samples?,
        max_steps: max_steps?,
        max_snaps: max_snaps?,
    })
}
