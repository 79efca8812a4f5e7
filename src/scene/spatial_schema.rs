//! What a scene of motion in space may hold: fields, sets, defaults, and what they require of each other.

use super::along_schema::{SIZE, VALUE, not_positive};
use super::fault::FaultKind;
use super::matrix_schema::{definite, rows};
use super::reader::{Need, Reader, Rule, Spec, Table};
use super::schema::{NON_NEGATIVE, POSITIVE, TOLERANCE, forces, is_normal, open, required, units};
use super::section_schema::{REST, SECTION};
use super::spatial_damping::{branches, damping};
use super::statics_schema::{CLAMP, REACH, clamp, cosserat_rod, norm, orientation, too_far};
use super::viscous_schema::{Memory, method, nodes, polynomial, relaxed};
use super::{
    Body, Clamp, EndLoad, EndPose, Joint, Landing, Loads, Place, Relaxed, Rod, Run, Scene, Solve,
    Start, StrainField, StrainName,
};
use toml::Spanned;
use toml::de::DeValue;

use Need::{Or, Required};

const KEEP_ONE: &str = "with [body] and [run] the scene is one of motion, with [end], [solve] or [continue] one of statics: keep one of \
                        the two";
pub(super) const TOP: Spec = Spec {
    name: "",
    fields: &["units", "rod", "clamp", "body", "start", "loads", "run"],
    barred: &[
        ("end", KEEP_ONE),
        ("solve", KEEP_ONE),
        ("continue", KEEP_ONE),
    ],
};
const ROD: Spec = Spec {
    name: "rod",
    fields: &[
        "model",
        "length",
        "section",
        "rest",
        "damping",
        "relaxation",
        "nodes",
    ],
    barred: &[],
};
const BODY: Spec = Spec {
    name: "body",
    fields: &["mass", "joint", "offset", "inertia"],
    barred: &[],
};
const START: Spec = Spec {
    name: "start",
    fields: &[
        "strain",
        "equilibrium",
        "pose",
        "relaxed",
        "velocity",
        "angular_velocity",
    ],
    barred: &[],
};
const STRAIN: Spec = Spec {
    name: "strain",
    fields: &["u1", "u2", "u3", "v1", "v2", "v3"],
    barred: &[],
};
const EQUILIBRIUM: Spec = Spec {
    name: "equilibrium",
    fields: &["force", "couple"],
    barred: &[],
};
const POSE: Spec = Spec {
    name: "pose",
    fields: &["position", "quaternion", "rotation"],
    barred: &[],
};
const LOADS: Spec = Spec {
    name: "loads",
    fields: &["gravity", "dead", "couple", "drag", "force"],
    barred: &[],
};
const RUN: Spec = Spec {
    name: "run",
    fields: &[
        "duration",
        "tolerance",
        "method",
        "reduce",
        "samples",
        "max_steps",
    ],
    barred: &[(
        "landing",
        "a rod with damping finds its own way through a snap",
    )],
};
/// Where a field that stands in the wrong table may belong.
pub(super) const HOMES: [&Spec; 9] = [
    &TOP, &ROD, &SECTION, &REST, &CLAMP, &BODY, &START, &LOADS, &RUN,
];

const MOMENT: Rule = Rule {
    allowed: "a finite number > 0",
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some("a body without extension is a point mass: write joint = \"ball\""),
        _ => (SIZE.hint)(x),
    },
};

/// Reads everything before it gives up anything.
pub(super) fn resolve(top: &Table) -> Option<Scene> {
    let units = units(top);
    let rod_table = required(top, &ROD, &HOMES, "model = \"cosserat\"");
    let memory = rod_table.as_ref().map(Memory::of);
    let rod = rod_table.as_ref().map(rod);
    let (elastic, rod) = rod.map_or((None, None), |(elastic, rod)| (elastic, rod));
    let clamp = match top.get("clamp") {
        None => Some(Clamp::default()),
        Some(value) => open(top, value, &CLAMP, &HOMES).and_then(|table| clamp(&table)),
    };
    let body_table = required(top, &BODY, &HOMES, "mass = 1.0");
    let weld = body_table.as_ref().and_then(joint);
    let body = body_table.and_then(|table| body(&table, weld));
    let known = Known {
        elastic: elastic.as_ref(),
        clamp: clamp.as_ref(),
        weld,
        memory,
    };
    let start = match top.get("start") {
        None => Some(Start::default()),
        Some(value) => open(top, value, &START, &HOMES).and_then(|table| start(&table, known)),
    };
    let loads = match top.get("loads") {
        None => Some(Loads::default()),
        Some(value) => open(top, value, &LOADS, &HOMES).and_then(|table| loads(&table, weld)),
    };
    let run = required(top, &RUN, &HOMES, "duration = 3.0").and_then(|table| run(&table));
    let scene = Scene {
        units: units?,
        rod: rod?,
        clamp: clamp?,
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
            "in units in which the scales of force B/L^2, time sqrt(m L^3/B), ..., and all that is measured by them, \
             with their squares, are numbers",
            Some("they over- or underflow: choose units nearer to the rod's size".to_owned()),
        );
        return None;
    }
    Some(scene)
}

/// What the start must know of the rest of the scene, as far as that was read.
#[derive(Clone, Copy)]
struct Known<'k> {
    elastic: Option<&'k Rod>,
    clamp: Option<&'k Clamp>,
    weld: Option<bool>,
    memory: Option<Memory>,
}

/// The elastic rod, whatever is wrong with its friction, and the rod.
fn rod(table: &Table) -> (Option<Rod>, Option<Rod>) {
    let parts = cosserat_rod(table, &HOMES);
    let rigid = parts.section.as_ref().map(|section| section.rigid());
    let (damping, relaxation) = (damping(table, rigid), branches(table, rigid));
    let nodes = nodes(table);
    let elastic = parts.rod();
    let whole = || {
        Some(Rod {
            damping: Some(damping?),
            relaxation: relaxation?,
            nodes: nodes?,
            ..elastic.clone()?
        })
    };
    let rod = whole();
    (elastic, rod)
}

/// True for a weld.
fn joint(body: &Table) -> Option<bool> {
    body.read("joint", "", Or(true), |field, value| {
        let words = [("weld", true), ("ball", false)];
        body.reader
            .choice(field, value, &words, r#""weld" or "ball""#)
    })
}

fn body(table: &Table, weld: Option<bool>) -> Option<Body> {
    let reader = table.reader;
    let mass = table.number("mass", SIZE, Required("mass = 1.0"));
    let offset = table.vector("offset", VALUE, Or([0.0; 3]));
    let allowed =
        "an array of three finite numbers > 0, about the directors; or three rows of three";
    let inertia = table.read("inertia", "", Or(None), |field, value| {
        inertia(reader, field, value, allowed).map(Some)
    });
    let joint = match weld? {
        true => {
            if table.get("inertia").is_none() {
                table.missing("inertia", allowed, "inertia = [0.01, 0.01, 0.01]");
            }
            Joint::Weld {
                offset: offset?,
                inertia: inertia??,
            }
        }
        false => {
            let hint = "an end that is free to turn carries a point mass; a body with extension has joint = \"weld\"";
            table.conflict("inertia", &["joint"], hint);
            let moved = offset != Some([0.0; 3]);
            if moved && offset.is_some() {
                table.conflict("offset", &["joint"], hint);
            }
            inertia?;
            if moved || table.get("inertia").is_some() {
                return None;
            }
            Joint::Ball
        }
    };
    Some(Body { mass: mass?, joint })
}

fn inertia(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    allowed: &str,
) -> Option<[[f64; 3]; 3]> {
    let nested = |list: &toml::de::DeArray| list.iter().any(|row| row.get_ref().is_array());
    if value.get_ref().as_array().is_some_and(nested) {
        let rows = rows(
            reader,
            field,
            value,
            allowed,
            "an array of three finite numbers",
        )?;
        let consequence = "no body has such an inertia";
        return definite(reader, field, value, rows, &[0, 1, 2], MOMENT, consequence);
    }
    let number = |field: &str, value: &_| reader.number(field, value, MOMENT);
    let [a, b, c] = reader.array(field, value, allowed, number)?;
    Some([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]])
}

/// A couple or an angular velocity, which a ball has none of.
fn turning(table: &Table, name: &str, weld: Option<bool>) -> Option<[f64; 3]> {
    let vector = table.vector(name, VALUE, Or([0.0; 3]))?;
    if weld != Some(false) || vector == [0.0; 3] {
        return Some(vector);
    }
    let value = table.get(name)?;
    let hint = "an end that is free to turn takes no couple, and its body is a point; write joint = \"weld\" in [body]";
    table.reader.fault(
        FaultKind::Conflict,
        &table.field(name),
        value.span(),
        "0, or left out, where the joint is a ball",
        Some(hint.to_owned()),
    );
    None
}

fn start(table: &Table, known: Known) -> Option<Start> {
    let reader = table.reader;
    let velocity = table.vector("velocity", VALUE, Or([0.0; 3]));
    let angular_velocity = turning(table, "angular_velocity", known.weld);
    let words = "a strain field such as { u1 = [0.5, -0.5] }";
    let relaxed = relaxed(table, known.memory, words, |field, value| {
        strain(reader, field, value, known.elastic).map(Relaxed::Strain)
    });
    let place = |name: &str, parse: &dyn Fn(&str, _) -> Option<Place>| {
        table.read(name, "", Or(None), |field, value| {
            parse(field, value).map(Some)
        })
    };
    let by_strain = place("strain", &|field, value| {
        strain(reader, field, value, known.elastic).map(|strain| Place::Strain { strain })
    });
    let by_load = place("equilibrium", &|field, value| {
        let allowed = "a table such as { force = [0.0, 0.0, -1.0] }";
        let table = reader.table(field, value, &EQUILIBRIUM, &[], allowed)?;
        let force = table.vector("force", VALUE, Or([0.0; 3]));
        let couple = turning(&table, "couple", known.weld);
        Some(Place::Equilibrium {
            equilibrium: EndLoad {
                force: force?,
                couple: couple?,
            },
        })
    });
    let by_pose = place("pose", &|field, value| {
        pose(reader, field, value, known).map(|pose| Place::Pose { pose })
    });
    let names = ["strain", "equilibrium", "pose"];
    let given: Vec<&str> = names
        .into_iter()
        .filter(|name| table.get(name).is_some())
        .collect();
    if let [first, rest @ ..] = given.as_slice() {
        for name in rest {
            table.conflict(
                name,
                &[first],
                "each is the whole shape of the rod: keep one of them",
            );
        }
        if !rest.is_empty() {
            return None;
        }
    }
    let place = by_strain?.or(by_load?).or(by_pose?);
    Some(Start {
        place: place.unwrap_or_default(),
        relaxed: relaxed?,
        velocity: velocity?,
        angular_velocity: angular_velocity?,
        wrench: None,
    })
}

fn strain<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rod: Option<&Rod>,
) -> Option<StrainField> {
    let allowed = "a table such as { u1 = [0.5, -0.5] }: polynomials in s / length";
    let table = reader.table(field, value, &STRAIN, &[], allowed)?;
    let rigid = rod.map_or([false; 6], |rod| rod.section.rigid());
    let read = StrainName::ALL.map(|name| {
        table.read(name.as_str(), "", Or(None), |field, value| {
            if rigid[name as usize] {
                let hint =
                    "the section holds it at its rest value: give it a stiffness in [rod.section]";
                let (kind, hint) = (FaultKind::Conflict, Some(hint.to_owned()));
                reader.fault(
                    kind,
                    field,
                    value.span(),
                    "left out where it is rigid",
                    hint,
                );
                return None;
            }
            let coefficients = polynomial(reader, field, value, VALUE)?;
            if name == StrainName::V3
                && let Some(x) = not_positive(&coefficients)
            {
                let hint = Some(format!(
                    "it is not > 0 at s / length = {x:.6}: total compression"
                ));
                let allowed = "> 0 everywhere on the rod, 0 <= s / length <= 1";
                reader.fault(FaultKind::Value, field, value.span(), allowed, hint);
                return None;
            }
            Some(Some(coefficients))
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
    let table = reader.table(field, value, &POSE, &[], allowed)?;
    let example = Required("position = [0.5, 0.0, 0.5]");
    let words = "an array of three finite numbers, [x, y, z]";
    let position = table.read("position", words, example, |field, value| {
        let position: [f64; 3] = reader.vector(field, value, VALUE)?;
        let (Some(rod), Some(clamp)) = (known.elastic, known.clamp) else {
            return Some(position);
        };
        let apart: [f64; 3] = std::array::from_fn(|i| position[i] - clamp.position[i]);
        match too_far(norm(&apart), rod.length).filter(|_| rod.section.is_inextensible()) {
            None => Some(position),
            hint => {
                reader.fault(FaultKind::Value, field, value.span(), REACH, hint);
                None
            }
        }
    });
    let orientation = orientation(&table)?;
    match (known.weld, orientation) {
        (Some(true), None) => {
            let allowed = "a unit quaternion [w, x, y, z], or rotation, where the body is welded";
            table.missing("quaternion", allowed, "quaternion = [1.0, 0.0, 0.0, 0.0]");
            return None;
        }
        (Some(false), Some(_)) => {
            let given = ["quaternion", "rotation"].into_iter();
            for name in given.filter(|name| table.get(name).is_some()) {
                let value = table.get(name)?;
                let hint = Some(
                    "an end that is free to turn is where it is, whichever way it points"
                        .to_owned(),
                );
                let (kind, field) = (FaultKind::Conflict, table.field(name));
                let allowed = "left out where the joint is a ball";
                reader.fault(kind, &field, value.span(), allowed, hint);
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

fn loads(table: &Table, weld: Option<bool>) -> Option<Loads> {
    let gravity = table.vector("gravity", VALUE, Or([0.0; 3]));
    let dead = table.vector("dead", VALUE, Or([0.0; 3]));
    let couple = turning(table, "couple", weld);
    let drag = table.number("drag", NON_NEGATIVE, Or(0.0));
    let force = forces::<3>(table);
    Some(Loads {
        gravity: gravity?,
        dead: dead?,
        couple: couple?,
        drag: drag?,
        force: force?,
    })
}

fn run(table: &Table) -> Option<Run> {
    let duration = table.number("duration", POSITIVE, Required("duration = 3.0"));
    let tolerance = table.number("tolerance", TOLERANCE, Or(Run::TOLERANCE_IN_SPACE));
    let method = method(table, None);
    let reduce = table.read("reduce", "true or false", Or(true), |field, value| {
        table.reader.flag(field, value)
    });
    let samples = table.count("samples", (2, 10_000_000), Run::SAMPLES);
    let max_steps = table.count("max_steps", (1, 1_000_000_000), Run::MAX_STEPS);
    Some(Run {
        duration: duration?,
        tolerance: tolerance?,
        method: method?,
        reduce: reduce?,
        landing: Landing::Viscous,
        branches: Run::BRANCHES,
        samples: samples?,
        max_steps: max_steps?,
        max_snaps: Run::MAX_SNAPS,
    })
}
