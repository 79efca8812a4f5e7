//! Readers of `[rod.section]` and `[rod.rest]`.

use super::fields::{BARRIER, CIRCLE, DRIVE, Kinds, PLANE, RECTANGLE, SECTION, TUBE};
use super::matrix::{definite, rows};
use super::phrases::Short;
use super::ranges::{SIZE, STIFFNESS, VALUE};
use super::reader::Reader;
use super::table::{Absent, Alternative, MissingField, Table};
use super::tendon::number_or_history;
use super::varying::{ALONG_WORDS, SIZE_WORDS, along};
use crate::scene::{
    Along, Barrier, BarrierTerm, Diagonal, Drive, FaultKind, Full, Outline, Profile, Rest, Rigid,
    Section, Shape, ShapeSettings, Stiffness, StrainName, Transverse,
};
use crate::section::{Material, RestDrive};
use std::ops::Range;
use toml::Spanned;
use toml::de::DeValue;

/// Kinds of sections by the field that identifies them, in order of priority, with the index ranges of their fields in
/// [`SECTION`].
const KINDS: [(&str, Range<usize>); 4] = [
    ("stiffness", 19..21),
    ("shape", 4..20),
    ("law", 0..6),
    ("bending", 2..6),
];

/// Reads `[rod.section]`.
pub(super) fn section(table: &Table, length: Option<f64>) -> Option<Section> {
    let given = |name: &str| table.has(name);
    if !table.given(&OUTLINES).is_empty() {
        return with_outline(table, length).map(Section::Outline);
    }
    let fields: Vec<&'static str> = SECTION.names(Kinds::MAX).collect();
    // Without an identifying field the kind with most fields given is assumed; the identifying field is then reported
    // as missing.
    let count = |own: &Range<usize>| fields[own.clone()].iter().filter(|f| given(f)).count();
    let named = KINDS.iter().find(|(name, _)| given(name));
    let meant = || KINDS.iter().max_by_key(|(_, own)| count(own));
    let kind = named.or_else(meant).filter(|(_, own)| count(own) > 0);
    let Some((kind, own)) = kind else {
        let hint = "write `bending = [1.0, 1.0]` and `torsion = 0.7` in [rod.section]".to_owned();
        table.reader.record(
            FaultKind::Missing,
            table.at,
            table.path(),
            None,
            "a section law: bending and torsion; or stiffness, 6 x 6; or shape, with its sizes and young; or circle, tube or rectangle with rod.material",
            Some(hint),
        );
        return None;
    };
    let all = fields;
    let fields = &all[own.clone()];
    let strangers = all.iter().filter(|field| !fields.contains(field));
    let strangers: Vec<_> = strangers.filter(|field| given(field)).collect();
    for stranger in &strangers {
        let hint = match *kind {
            "bending" if **stranger == "barrier" => "write law = \"barrier\" beside it",
            "bending" => "it belongs to a section by stiffness or by shape: keep one of them",
            "stiffness" => "the matrix is the whole law; strains that cannot occur go into `rigid`",
            "shape" => "the stiffnesses follow from the shape: keep one of them",
            _ => "this law has bending, torsion, shear, axial and barrier",
        };
        let own = fields.iter().find(|field| given(field)).unwrap_or(kind);
        table.conflict(stranger, &[own], hint);
    }
    let section = match *kind {
        "stiffness" => full(table).map(Section::Full),
        "shape" => profile(table, length).map(Section::Profile),
        "law" => law(table, length),
        _ => diagonal(table, length).map(Section::Diagonal),
    };
    section.filter(|_| strangers.is_empty())
}

fn diagonal(table: &Table, length: Option<f64>) -> Option<Diagonal> {
    let reader = table.reader;
    let number = |field: &str, value| along(reader, field, value, &STIFFNESS, length);
    let or_rigid = |field: &str, value, allowed: &str| match rigid(reader, field, value, allowed)? {
        Some(Rigid::Rigid) => Some(Stiffness::Rigid),
        None => number(field, value).map(Stiffness::Elastic),
    };
    let bending = table.read("bending", PAIR, Absent::Fault, |field, value| {
        let each = |field: &str, value| or_rigid(field, value, "\"rigid\" or a stiffness > 0");
        let pair = reader.array(field, value, PAIR, &each)?;
        if pair == [Stiffness::Rigid, Stiffness::Rigid] {
            let hint = "a rod bends about d1 or about d2; give one of them a number";
            let allowed = "two stiffnesses, at most one of them \"rigid\"";
            return reader.refuse(
                FaultKind::Value,
                field,
                value,
                allowed,
                Some(hint.to_owned()),
            );
        }
        Some(pair)
    });
    let torsion = table.read("torsion", ALONG_WORDS, Absent::Fault, |field, value| {
        or_rigid(field, value, "\"rigid\" or a stiffness > 0")
    });
    let shear = table.read("shear", "", Absent::Or(Stiffness::Rigid), |field, value| {
        let allowed = "\"rigid\" or an array of two stiffnesses > 0, along d1 and d2";
        match rigid(reader, field, value, allowed)? {
            Some(Rigid::Rigid) => Some(Stiffness::Rigid),
            None => reader
                .array(field, value, allowed, &number)
                .map(Stiffness::Elastic),
        }
    });
    let axial = table.read("axial", "", Absent::Or(Stiffness::Rigid), |field, value| {
        or_rigid(field, value, "\"rigid\" or a stiffness > 0")
    });
    Some(Diagonal {
        bending: bending?,
        torsion: torsion?,
        shear: shear?,
        axial: axial?,
    })
}

const PAIR: &str = "an array of two stiffnesses > 0, about d1 and d2; one may be \"rigid\"";

/// Reads the field `rigid`: some of `names`, and at most one flexure.
fn rigid_strains(table: &Table, names: &[StrainName]) -> Option<Vec<StrainName>> {
    let reader = table.reader;
    let words: Vec<_> = names.iter().map(|name| (name.as_str(), *name)).collect();
    let list: Vec<_> = words.iter().map(|(word, _)| *word).collect();
    let one = format!("one of {}", list.join(", "));
    let allowed = format!("an array of some of {}", list.join(", "));
    table.read("rigid", &allowed, Absent::Or(Vec::new()), |field, value| {
        let name = |field: &str, value: &_| reader.choice(field, value, &words, &one);
        let mut names = reader.all(field, value, &allowed, &name)?;
        names.sort();
        names.dedup();
        if names.starts_with(&[StrainName::U1, StrainName::U2]) {
            let hint = "a rod bends about d1 or about d2".to_owned();
            let allowed = "names with at most one of u1 and u2";
            return reader.refuse(FaultKind::Value, field, value, allowed, Some(hint));
        }
        Some(names)
    })
}

/// Reads the word "rigid"; `Some(None)` if the value is no string.
fn rigid(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    allowed: &str,
) -> Option<Option<Rigid>> {
    match value.get_ref() {
        DeValue::String(_) => {
            let words = [("rigid", Rigid::Rigid)];
            reader.choice(field, value, &words, allowed).map(Some)
        }
        _ => Some(None),
    }
}

fn full(table: &Table) -> Option<Full> {
    let reader = table.reader;
    let rigid = rigid_strains(table, &StrainName::ALL);
    let allowed = "six rows of six numbers, in the order u1 u2 u3 v1 v2 v3";
    let stiffness = table.read("stiffness", allowed, Absent::Fault, |field, value| {
        let row_words = "an array of six finite numbers, in the order u1 u2 u3 v1 v2 v3";
        let rows = rows(reader, field, value, allowed, row_words)?;
        let rigid = rigid.as_deref()?;
        let free = StrainName::ALL.iter().filter(|name| !rigid.contains(name));
        let free: Vec<usize> = free.map(|name| *name as usize).collect();
        let consequence = "the law is not convex";
        definite(reader, field, value, rows, &free, &STIFFNESS, consequence)
    });
    Some(Full {
        stiffness: stiffness?,
        rigid: rigid?,
    })
}

fn law(table: &Table, length: Option<f64>) -> Option<Section> {
    let reader = table.reader;
    #[derive(Clone, PartialEq)]
    enum Word {
        Linear,
        Barrier,
    }
    let words = [("linear", Word::Linear), ("barrier", Word::Barrier)];
    let allowed = r#""linear" or "barrier""#;
    let word = table.read("law", allowed, Absent::Fault, |field, value| {
        reader.choice(field, value, &words, allowed)
    });
    let linear = diagonal(table, length);
    if word == Some(Word::Linear) {
        let alone = table.get("barrier").is_none();
        table.conflict(
            "barrier",
            &["law"],
            "write law = \"barrier\", or leave it out",
        );
        return linear.filter(|_| alone).map(Section::Diagonal);
    }
    let mut elastic = true;
    if word == Some(Word::Barrier)
        && let Some(linear) = &linear
        && linear.axial == Stiffness::Rigid
    {
        let allowed = "a stiffness > 0 where the law is \"barrier\"";
        let hint = "a rod that cannot be compressed needs no barrier: write `axial = 300.0`, or leave out the law";
        let kind = match table.get("axial") {
            Some(_) => FaultKind::Conflict,
            None => FaultKind::Missing,
        };
        let (at, span) = match table.get("axial") {
            Some(value) => (value.span().start, Some(value.span())),
            None => (table.at, None),
        };
        let hint = Some(hint.to_owned());
        reader.record(kind, at, &table.field("axial"), span, allowed, hint);
        elastic = false;
    }
    let allowed = "a table such as { strength = 1.0, half_widths = [0.05, 0.05] }";
    let barrier = table.read("barrier", allowed, Absent::Fault, |field, value| {
        let table = reader.table(field, value, &BARRIER, allowed)?;
        let strength = table.number("strength");
        let half_widths = half_widths(&table);
        Some(BarrierTerm {
            strength: strength?,
            half_widths: half_widths?,
        })
    });
    if let Some(linear) = &linear {
        elastic &= uniform(table, linear);
    }
    word?;
    let (linear, barrier) = (linear?, barrier?);
    elastic.then_some(Section::Barrier(Barrier { linear, barrier }))
}

/// True if no stiffness varies along the rod, as required by a law with a barrier; otherwise reports the faults.
fn uniform(table: &Table, law: &Diagonal) -> bool {
    let varying = law
        .stiffnesses()
        .filter(|(_, along)| along.constant().is_none());
    let mut names: Vec<&str> = varying
        .map(|(name, _)| name.trim_end_matches("[0]").trim_end_matches("[1]"))
        .collect();
    names.dedup();
    for name in &names {
        let allowed = "the same all along the rod where the law has a barrier";
        table.fault(FaultKind::Conflict, name, allowed, None);
    }
    names.is_empty()
}

/// Reads the half widths of a barrier.
pub(super) fn half_widths(table: &Table) -> Option<[f64; 2]> {
    let words = "an array of two finite numbers > 0, along d1 and d2";
    table.read("half_widths", words, Absent::Fault, |field, value| {
        let number = |field: &str, value: &_| table.reader.number(field, value, &SIZE);
        table.reader.array(field, value, words, &number)
    })
}

/// Shapes of a section whose material is `rod.material`.
pub(super) const OUTLINES: [&str; 3] = ["circle", "tube", "rectangle"];

/// Reads the shape of a rod with `rod.material`.
pub(super) fn outline(table: &Table, length: Option<f64>) -> Option<Shape<Along>> {
    let given = table.given(&OUTLINES);
    let [name] = given.as_slice() else {
        match given.as_slice() {
            [] => {
                let allowed = "a shape: circle, tube or rectangle";
                table.missing(
                    "rectangle",
                    allowed,
                    "rectangle = { width = 0.02, thickness = 0.0005 }",
                );
            }
            [first, others @ ..] => {
                for other in others {
                    table.conflict(other, &[first], "a section has one shape: keep one of them");
                }
            }
        }
        return None;
    };
    let (spec, allowed) = match *name {
        "circle" => (&CIRCLE, "a table such as { diameter = 0.001 }"),
        "tube" => (
            &TUBE,
            "a table such as { diameter = 0.002, thickness = 0.0002 }",
        ),
        _ => (
            &RECTANGLE,
            "a table such as { width = 0.02, thickness = 0.0005 }",
        ),
    };
    let sizes = table
        .reader
        .table(&table.field(name), table.get(name)?, spec, allowed)?;
    let size = |name| size(&sizes, name, length);
    match *name {
        "circle" => Some(Shape::Circle {
            radius: size("diameter")?.times(0.5),
        }),
        "tube" => {
            let (diameter, thickness) = (size("diameter"), size("thickness"));
            let radius = diameter.map(|diameter| diameter.times(0.5));
            tube(&sizes, radius, thickness, length)
        }
        _ => {
            let (width, thickness) = (size("width"), size("thickness"));
            Some(Shape::Rectangle {
                width: width?,
                height: thickness?,
            })
        }
    }
}

/// Reads a size of a shape: a number, or in space its variation along the rod.
fn size(table: &Table, name: &'static str, length: Option<f64>) -> Option<Along> {
    if table.reader.kind.get() == PLANE {
        return table.number(name).map(Along::from);
    }
    table.read(name, SIZE_WORDS, Absent::Fault, |field, value| {
        along(table.reader, field, value, &SIZE, length)
    })
}

fn with_outline(table: &Table, length: Option<f64>) -> Option<Outline> {
    let strangers: Vec<&str> = SECTION
        .names(Kinds::MAX)
        .filter(|name| {
            let own = [
                "shear",
                "axial",
                "shear_factor",
                "torsion_constant",
                "rigid",
            ];
            !own.contains(name) && !OUTLINES.contains(name) && table.get(name).is_some()
        })
        .collect();
    let shape = outline(table, length);
    for stranger in &strangers {
        let hint = "the stiffnesses follow from the shape and rod.material";
        table.conflict(stranger, &table.given(&OUTLINES), hint);
    }
    let set = settings(table);
    let outline = Outline {
        shape: shape?,
        set: set?,
    };
    strangers.is_empty().then_some(outline)
}

fn settings(table: &Table) -> Option<ShapeSettings> {
    let shear_factor = table.optional("shear_factor");
    let torsion_constant = table.optional("torsion_constant");
    let (shear, axial) = (held(table, "shear"), held(table, "axial"));
    let bent = [StrainName::U1, StrainName::U2, StrainName::U3];
    let rigid = rigid_strains(table, &bent)?;
    Some(ShapeSettings {
        held: bent.map(|name| rigid.contains(&name)),
        shear_factor: shear_factor?,
        torsion_constant: torsion_constant?,
        shear: shear?,
        axial: axial?,
    })
}

/// Reads the word "rigid", or `Some(None)` if left out.
fn held(table: &Table, name: &str) -> Option<Option<Rigid>> {
    table.maybe(name, |field, value| {
        let allowed = "\"rigid\", or left out: its stiffness follows from the shape";
        let words = [("rigid", Rigid::Rigid)];
        table.reader.choice(field, value, &words, allowed)
    })
}

fn profile(table: &Table, length: Option<f64>) -> Option<Profile<Along>> {
    let young = table.number("young");
    let transverse = transverse(table);
    let set = settings(table);
    let shape = shape(table, length);
    let (young, transverse) = (young?, transverse?);
    Some(Profile {
        shape: shape?,
        material: Material { young, transverse },
        set: set?,
    })
}

fn transverse(table: &Table) -> Option<Transverse> {
    let modulus = table.optional("shear_modulus");
    let poisson = table.optional("poisson");
    table.either(
        Alternative {
            name: "shear_modulus",
            value: modulus.map(|x| x.map(Transverse::ShearModulus)),
        },
        Alternative {
            name: "poisson",
            value: poisson.map(|x| x.map(Transverse::Poisson)),
        },
        "E = 2 G (1 + nu): keep one of them",
        &MissingField {
            name: "poisson",
            allowed: "a number in (-1, 0.5]; or shear_modulus > 0",
            example: "poisson = 0.3",
        },
    )
}

fn shape(table: &Table, length: Option<f64>) -> Option<Shape<Along>> {
    #[derive(Clone)]
    enum Word {
        Circle,
        Rectangle,
        Tube,
    }
    let words = [
        ("circle", Word::Circle),
        ("rectangle", Word::Rectangle),
        ("tube", Word::Tube),
    ];
    let allowed = r#""circle", "rectangle" or "tube""#;
    let word = table.read("shape", allowed, Absent::Fault, |field, value| {
        table.reader.choice(field, value, &words, allowed)
    })?;
    let own: &[&str] = match word {
        Word::Circle => &["radius", "diameter"],
        Word::Rectangle => &["width", "height"],
        Word::Tube => &["outer_radius", "outer_diameter", "thickness"],
    };
    let sizes = [
        "radius",
        "diameter",
        "width",
        "height",
        "outer_radius",
        "outer_diameter",
        "thickness",
    ];
    let mut others = table.given(&sizes);
    others.retain(|name| !own.contains(name));
    for other in &others {
        let hint = format!("the sizes of this shape are {}", own.join(", "));
        table.conflict(other, &["shape"], &hint);
    }
    let shape = match word {
        Word::Circle => {
            radius(table, ["radius", "diameter"], length).map(|radius| Shape::Circle { radius })
        }
        Word::Rectangle => {
            let width = size(table, "width", length);
            let height = size(table, "height", length);
            width
                .zip(height)
                .map(|(width, height)| Shape::Rectangle { width, height })
        }
        Word::Tube => {
            let radius = radius(table, ["outer_radius", "outer_diameter"], length);
            tube(table, radius, size(table, "thickness", length), length)
        }
    };
    shape.filter(|_| others.is_empty())
}

/// A tube; a fault unless the wall is thinner than the outer radius all along the rod.
fn tube(
    table: &Table,
    outer_radius: Option<Along>,
    thickness: Option<Along>,
    length: Option<f64>,
) -> Option<Shape<Along>> {
    let (outer_radius, thickness) = (outer_radius?, thickness?);
    // Without a length, a fault of its own, only numbers can be compared.
    let length = length.unwrap_or(1.0);
    let even = (0..=64).map(|i| length * f64::from(i) / 64.0);
    let nodes = [&outer_radius, &thickness]
        .into_iter()
        .flat_map(|size| size.nodes());
    let thick = even.chain(nodes.copied()).find_map(|s| {
        let (outer, wall) = (
            outer_radius.at(s, length).ok()?,
            thickness.at(s, length).ok()?,
        );
        (!(wall < outer)).then_some((s, outer))
    });
    let Some((s, outer)) = thick else {
        return Some(Shape::Tube {
            outer_radius,
            thickness,
        });
    };
    let varies = outer_radius.constant().is_none() || thickness.constant().is_none();
    let place = if varies {
        format!(" at s = {}", Short(s))
    } else {
        String::new()
    };
    let allowed = format!("less than the outer radius, {}{place}", Short(outer));
    let hint = "a tube without a hole is a circle";
    table.refuse(FaultKind::Value, "thickness", allowed, hint)
}

/// Reads a radius, or half a diameter.
fn radius(
    table: &Table,
    [radius, diameter]: [&'static str; 2],
    length: Option<f64>,
) -> Option<Along> {
    let size = |name: &'static str| {
        table.maybe(name, |field, value| {
            along(table.reader, field, value, &SIZE, length)
        })
    };
    let by_radius = size(radius);
    let by_diameter = size(diameter);
    table.either(
        Alternative {
            name: radius,
            value: by_radius,
        },
        Alternative {
            name: diameter,
            value: by_diameter.map(|x| x.map(|diameter| diameter.times(0.5))),
        },
        "keep one of them",
        &MissingField {
            name: radius,
            allowed: SIZE.allowed,
            example: &format!("{radius} = 0.01"),
        },
    )
}

/// Reads `[rod.rest]`.
pub(super) fn rest(table: &Table, length: Option<f64>) -> Option<Rest> {
    let reader = table.reader;
    let default = Rest::default();
    let number = |field: &str, value| along(reader, field, value, &VALUE, length);
    let curvature = table.read(
        "curvature",
        "",
        Absent::Or(default.curvature),
        |field, value| {
            reader.array(
                field,
                value,
                "an array of two curvatures, about d1 and d2",
                &number,
            )
        },
    );
    let twist = table.read("twist", "", Absent::Or(default.twist), number);
    Some(Rest {
        curvature: curvature?,
        twist: twist?,
    })
}

/// Reads `[rod.drive]`.
pub(super) fn drive(
    rod: &Table,
    length: Option<f64>,
    section: Option<&Section>,
) -> Option<Option<Drive>> {
    let reader = rod.reader;
    let allowed =
        "a table such as { curvature = [{ polynomial = [0.0, 1.0] }, 0.0], amplitude = 0.5 }";
    rod.maybe("drive", |field, value| {
        let table = reader.table(field, value, &DRIVE, allowed)?;
        let strains = rest(&table, length);
        let number = |field: &str, value| along(reader, field, value, &VALUE, length);
        let stretch = table.read("stretch", "", Absent::Or(0.0.into()), number);
        let amplitude = number_or_history(&table, "amplitude", &VALUE);
        let (strains, stretch) = (strains?, stretch?);
        if section.is_some_and(|section| section.rigid()[5]) && !stretch.vanishes() {
            let hint =
                "give [rod.section] a number for `axial`: a rod of rigid stretch keeps its length";
            let allowed = "0, or left out, where the section is axially rigid";
            return table.refuse(FaultKind::Conflict, "stretch", allowed, hint);
        }
        Some(Drive {
            shape: RestDrive {
                curvature: strains.curvature,
                twist: strains.twist,
                stretch,
            },
            amplitude: amplitude?,
        })
    })
}

/// Reports a rest curvature with total compression of the rod.
pub(super) fn rest_inside_barrier(
    table: &Table,
    section: &Section,
    rest: &Rest,
    length: f64,
) -> bool {
    let Section::Barrier(law) = section else {
        return true;
    };
    // The bound is a norm of the curvature: on a piecewise linear curvature the maximum is at the nodes.
    let mut places: Vec<f64> = (0..=64).map(|i| length * f64::from(i) / 64.0).collect();
    for along in &rest.curvature {
        places.extend(along.nodes());
    }
    let [h1, h2] = law.barrier.half_widths;
    let shortest = |s: &f64| {
        let [u1, u2] = [0, 1].map(|i| rest.curvature[i].at(*s, length).unwrap_or(f64::NAN));
        (h2 * u1).hypot(h1 * u2)
    };
    let Some(s) = places.iter().find(|s| !(shortest(s) < 1.0)) else {
        return true;
    };
    let hint = format!(
        "at s = {s:.6} it is {:.6} already without load (AMV (2.7))",
        Short(shortest(s))
    );
    let allowed =
        "so small that sqrt((h2 u1)^2 + (h1 u2)^2) < 1, h1 and h2 the half widths of the barrier";
    let (at, span) = match table.get("curvature") {
        Some(value) => (value.span().start, Some(value.span())),
        None => (table.at, None),
    };
    let kind = FaultKind::Value;
    table.reader.record(
        kind,
        at,
        &table.field("curvature"),
        span,
        allowed,
        Some(hint),
    );
    false
}
