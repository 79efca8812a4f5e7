//! Reader of `[rod]`.

use super::fields::{ASSEMBLY, MATERIAL, OUTLINE, PLANE, REST_STRAINS, SECTION, STATICS};
use super::friction::{self, needs_damping};
use super::rest_shape::rest_shape;
use super::section::{drive, outline, rest, rest_inside_barrier, section};
use super::table::Table;
use super::tendon::tendons;
use super::varying::polynomial;
use crate::scene::{
    Bends, Damping, Diagonal, Drive, FaultKind, Inertia, Material, Maxwell, Model, Outline, Rest,
    Rod, Section, ShapeSettings, Stiffness, StrainMatrix, Tendon,
};
use crate::section::Centreline;
use toml::Spanned;
use toml::de::DeValue;

/// Properties of the rod on which the rest of the scene depends, known even if `[rod]` has faults.
#[derive(Clone, Copy)]
pub(super) struct RodTraits {
    /// True with damping.
    pub damped: bool,
    /// True with Maxwell branches.
    pub relaxes: bool,
    /// True with inertia = "full".
    pub heavy: bool,
    /// True with inertia = "first-order".
    pub light: bool,
}

impl RodTraits {
    /// True if the strains are independent of the pose of the end, as of a viscoelastic or heavy rod.
    pub fn has_strains(self) -> bool {
        self.damped || self.heavy
    }

    /// Properties from `[rod]` as written.
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
        let inertia = |word: &str| {
            let value = rod.get("inertia");
            value.is_some_and(|value| value.get_ref().as_str() == Some(word))
        };
        Self {
            heavy: inertia("full"),
            light: inertia("first-order"),
            damped: rod.get("damping").is_some_and(|value| !zero(value)),
            relaxes: branches.is_some_and(|value| {
                let list = value.get_ref().as_array();
                list.is_none_or(|list| !list.is_empty())
            }),
        }
    }
}

/// Parts of a rod, each `None` if faulty.
pub(super) struct RodParts {
    model: Option<Model>,
    pub length: Option<f64>,
    material: Option<Option<Material>>,
    bends: Option<Bends>,
    pub section: Option<Section>,
    rest: Option<Rest>,
    drive: Option<Option<Drive>>,
    tendons: Option<Vec<Tendon>>,
    damping: Option<Option<Damping>>,
    relaxation: Option<Vec<Maxwell<StrainMatrix>>>,
    nodes: Option<Option<usize>>,
    contact_diameter: Option<Option<f64>>,
    mass: Option<Option<f64>>,
    inertia: Option<Option<Inertia>>,
    section_inertia: Option<Option<[f64; 3]>>,
    centreline: Option<Centreline>,
}

impl RodParts {
    /// The rod without friction, even if its friction has faults.
    pub fn elastic(&self) -> Option<Rod> {
        Some(Rod {
            model: self.model?,
            length: self.length?,
            material: self.material?,
            bends: self.bends?,
            section: self.section.clone()?,
            rest: self.rest.clone()?,
            drive: self.drive.clone()?,
            tendons: self.tendons.clone()?,
            loads: Vec::new(),
            damping: None,
            relaxation: Vec::new(),
            nodes: None,
            contact_diameter: self.contact_diameter?,
            mass: self.mass?,
            inertia: self.inertia?,
            inertia_chosen: false,
            section_inertia: self.section_inertia?,
            centreline: self.centreline.clone(),
        })
    }

    pub fn rod(self) -> Option<Rod> {
        Some(Rod {
            damping: self.damping.clone()?,
            relaxation: self.relaxation.clone()?,
            nodes: self.nodes?,
            ..self.elastic()?
        })
    }
}

/// Reads every field before returning `None`, for a complete list of faults.
pub(super) fn rod(table: &Table) -> RodParts {
    let kind = table.reader.kind.get();
    let planar = kind == PLANE;
    let model = if planar {
        table.word("model", &[Model::Elastica])
    } else {
        table.word("model", &[Model::Cosserat, Model::Elastica])
    };
    let bare = kind == ASSEMBLY && model == Some(Model::Elastica);
    let model = if bare { Some(Model::Cosserat) } else { model };
    let given = table.has("length").then(|| table.number("length"));
    let unloaded = (table.has("rest") && !planar).then(|| table.inner("rest", &REST_STRAINS));
    let shape = match &unloaded {
        Some(Some(inner)) => rest_shape(table, inner, given.flatten()),
        _ => Some(None),
    };
    let length = match (given, &shape) {
        (Some(length), _) => length,
        (None, Some(Some(shape))) => Some(shape.length),
        (None, Some(None)) => table.number("length"),
        // The shape has a fault of its own.
        (None, None) => None,
    };
    let material = material(table);
    let (bends, section) = if planar {
        (
            table.word("bends", &[Bends::Weak, Bends::Strong]),
            planar_section(table),
        )
    } else if bare {
        (Some(Bends::Weak), bare_section(table))
    } else {
        if table.has("bending_stiffness") && kind == ASSEMBLY {
            let hint = "a Cosserat rod has two: write section = { bending = [..], torsion = .. }";
            let allowed = "left out where model is not \"elastica\"";
            table.fault(FaultKind::Conflict, "bending_stiffness", allowed, hint);
        }
        (Some(Bends::Weak), spatial_section(table, length, material))
    };
    let centreline = shape
        .iter()
        .flatten()
        .find_map(|shape| shape.centreline.clone());
    let rest = match unloaded {
        Some(inner) => inner.and_then(|inner| {
            let rest = match shape? {
                Some(shape) => shape.rest,
                None => rest(&inner, length)?,
            };
            let known = section.as_ref().zip(length);
            let inside = known.is_none_or(|(section, length)| {
                rest_inside_barrier(&inner, section, &rest, length)
            });
            inside.then_some(rest)
        }),
        None => Some(Rest::default()),
    };
    let drive = if planar {
        Some(None)
    } else {
        drive(table, length, section.as_ref())
    };
    let tendons = if planar {
        Some(Vec::new())
    } else {
        tendons(table, length)
    };
    let rigid = section.as_ref().map(Section::rigid);
    let (damping, relaxation, nodes) = match kind {
        STATICS => (Some(None), Some(Vec::new()), Some(None)),
        ASSEMBLY => {
            if light_is_elastic(table) {
                (
                    friction::damping(table, rigid),
                    friction::branches(table, rigid),
                    nodes(table),
                )
            } else {
                (None, Some(Vec::new()), None)
            }
        }
        PLANE => (
            friction::planar_damping(table),
            friction::planar_branches(table),
            nodes(table),
        ),
        _ => (
            friction::damping(table, rigid),
            friction::branches(table, rigid),
            nodes(table),
        ),
    };
    let contact_diameter = contact_diameter(table);
    let (mass, inertia, section_inertia) = match kind {
        STATICS => (table.optional("mass"), Some(None), Some(None)),
        _ => (
            table.optional("mass"),
            inertia(table, section.as_ref(), material),
            section_inertia(table, section.as_ref()),
        ),
    };
    RodParts {
        model,
        length,
        material,
        bends,
        section,
        rest,
        drive,
        tendons,
        damping,
        relaxation,
        nodes,
        contact_diameter,
        mass,
        inertia,
        section_inertia,
        centreline,
    }
}

/// Section of a rod of a planar assembly that bends alone.
fn bare_section(table: &Table) -> Option<Section> {
    if !table.has("bending_stiffness") {
        table.missing(
            "bending_stiffness",
            "a finite number > 0, where model is \"elastica\"",
            "bending_stiffness = 1.0",
        );
        return None;
    }
    if table.has("section") {
        let hint = "with a section write model = \"cosserat\"";
        table.conflict("section", &["bending_stiffness"], hint);
        return None;
    }
    let bending = table.number("bending_stiffness")?;
    Some(Section::Diagonal(Diagonal {
        bending: [bending.into(), bending.into()],
        torsion: bending.into(),
        shear: Stiffness::Rigid,
        axial: Stiffness::Rigid,
    }))
}

/// Reports fields of a rod of an assembly that require inertia = "full".
fn light_is_elastic(rod: &Table) -> bool {
    let told = rod.given(&["damping", "relaxation", "nodes"]);
    if RodTraits::of(rod).heavy || told.is_empty() {
        return true;
    }
    for name in told {
        let hint = "rods of an assembly without mass are elastic; with mass and inertia = \"full\" they can have friction and Maxwell branches, and one rod with \
                    damping is a scene of its own, [rod] and [body]";
        let allowed = "left out where inertia is not \"full\"";
        rod.fault(FaultKind::Conflict, name, allowed, hint);
    }
    false
}

/// Reads `rod.inertia`, and checks the mass of the rod.
fn inertia(
    rod: &Table,
    section: Option<&Section>,
    material: Option<Option<Material>>,
) -> Option<Option<Inertia>> {
    if !rod.has("inertia") {
        return Some(None);
    }
    let choices = [Inertia::None, Inertia::Full, Inertia::FirstOrder];
    let inertia = rod.word("inertia", &choices)?;
    let refuse = |name: &str, allowed: &str, hint: &str| {
        rod.refuse(FaultKind::Conflict, name, allowed, hint.to_owned())
    };
    match inertia {
        Inertia::None => return Some(Some(inertia)),
        Inertia::FirstOrder => {
            let hint = "the correction to first order is for elastic rods: write inertia = \"full\", which has all of the mass, or leave it out";
            if RodTraits::of(rod).damped {
                return refuse("inertia", "\"none\" or \"full\"", hint);
            }
        }
        Inertia::Full => {}
    }
    let dense = matches!(
        material,
        Some(Some(Material {
            density: Some(_),
            ..
        }))
    ) && matches!(section, Some(Section::Outline(_)));
    // Faults of material and section are reported elsewhere.
    let unknown = material.is_none() || section.is_none();
    if !rod.has("mass") && !dense && !unknown {
        let allowed = "the mass of the rod > 0; or a material with a density and a shape";
        rod.missing("mass", allowed, "mass = 0.02");
        return None;
    }
    Some(Some(inertia))
}

fn section_inertia(rod: &Table, section: Option<&Section>) -> Option<Option<[f64; 3]>> {
    if rod.reader.kind.get() == PLANE {
        return Some(None);
    }
    let shape = section.and_then(Section::shape);
    if rod.has("section_inertia") && shape.is_some_and(|shape| shape.uniform().is_none()) {
        let hint = "it follows from the shape, as the mass does";
        let allowed = "left out where the shape varies along the rod";
        return rod.refuse(
            FaultKind::Conflict,
            "section_inertia",
            allowed,
            hint.to_owned(),
        );
    }
    let reader = rod.reader;
    rod.maybe("section_inertia", |field, value| {
        reader.vector(field, value, &super::ranges::SIZE)
    })
}

fn contact_diameter(rod: &Table) -> Option<Option<f64>> {
    let memory = RodTraits::of(rod);
    if rod.has("contact_diameter") && memory.has_strains() && !memory.heavy {
        let hint = "where a rod with friction and without mass touches itself is not looked for; leave it out";
        let allowed = "left out where the rod has damping, but with inertia = \"full\"";
        return rod.refuse(FaultKind::Conflict, "contact_diameter", allowed, hint);
    }
    if rod.knows("contact_diameter") {
        rod.optional("contact_diameter")
    } else {
        Some(None)
    }
}

fn nodes(rod: &Table) -> Option<Option<usize>> {
    let memory = RodTraits::of(rod);
    if !memory.has_strains() {
        let why = "an elastic rod is in equilibrium and has no strains of its own to follow";
        needs_damping(rod, "nodes", why);
    }
    match rod.get("nodes") {
        None => Some(None),
        Some(_) => rod.count("nodes").map(Some),
    }
}

/// Reads `rod.material`.
fn material(rod: &Table) -> Option<Option<Material>> {
    let names = [
        ("steel", Material::STEEL),
        ("aluminium", Material::ALUMINIUM),
        ("nitinol", Material::NITINOL),
        ("PET", Material::PET),
        ("silicone", Material::SILICONE),
    ];
    let allowed = "\"steel\", \"aluminium\", \"nitinol\", \"PET\", \"silicone\" or a table such as { E = 200e9, nu = 0.3 }";
    let reader = rod.reader;
    rod.maybe("material", |field, value| {
        if !value.get_ref().is_table() {
            return reader.choice(field, value, &names, allowed);
        }
        let table = reader.table(field, value, &MATERIAL, allowed)?;
        let (young, poisson, shear) =
            (table.number("E"), table.optional("nu"), table.optional("G"));
        let density = table.optional("density");
        let (poisson, shear) = (poisson?, shear?);
        if poisson.is_some() && shear.is_some() {
            table.conflict("G", &["nu"], "E = 2 G (1 + nu): keep one of them");
            return None;
        }
        if poisson.is_none() && shear.is_none() && reader.kind.get() != PLANE {
            table.missing("nu", "a number in (-1, 0.5]; or G > 0", "nu = 0.3");
            return None;
        }
        Some(Material {
            young: young?,
            poisson,
            shear,
            density: density?,
        })
    })
}

/// Reads the bending stiffness of a planar rod, or the shape of its material.
fn planar_section(rod: &Table) -> Option<Section> {
    let given = |name: &str| rod.has(name);
    if !given("material") && !given("section") {
        if given("bends") {
            let hint = "it says which way a shape bends; `bending_stiffness` is that of the plane";
            rod.conflict("bends", &["bending_stiffness"], hint);
        }
        return rod.number("bending_stiffness").map(Section::Bending);
    }
    if given("bending_stiffness") {
        let both = rod.given(&["material", "section"]);
        let hint = "it follows from material and section: keep it or them";
        rod.conflict("bending_stiffness", &both, hint);
        return None;
    }
    if !given("material") {
        let allowed = "what the shape is made of: a name, or a table with E";
        rod.missing("material", allowed, "material = \"steel\"");
    }
    if !rod.has("section") {
        let example = "section = { rectangle = { width = 0.02, thickness = 0.0005 } }";
        rod.missing("section", "the shape of the cross-section", example);
        return None;
    }
    let shape = outline(&rod.inner("section", &OUTLINE)?, None)?;
    let set = ShapeSettings::default();
    given("material").then_some(Section::Outline(Outline { shape, set }))
}

fn spatial_section(
    rod: &Table,
    length: Option<f64>,
    material: Option<Option<Material>>,
) -> Option<Section> {
    let reader = rod.reader;
    if !rod.has("section") {
        let hint = match material {
            Some(Some(_)) => "write `section = { circle = { diameter = 0.001 } }` in [rod]",
            _ => "add `[rod.section]` with `bending = [1.0, 1.0]` and `torsion = 0.7`",
        };
        let allowed = "a section law: stiffnesses, or shape and material";
        let (kind, hint) = (FaultKind::Missing, Some(hint.to_owned()));
        reader.record(kind, rod.at, &rod.field("section"), None, allowed, hint);
        return None;
    }
    let table = rod.inner("section", &SECTION)?;
    let section = section(&table, length);
    match (&section, rod.get("material")) {
        (Some(Section::Outline(_)), None) => {
            let allowed = "what the shape is made of: a name, or a table with E and nu";
            rod.missing("material", allowed, "material = \"steel\"");
            None
        }
        (Some(Section::Outline(_)) | None, _) | (_, None) => section,
        (Some(_), Some(_)) => {
            let hint = "this section has its own stiffnesses or moduli; a shape of the material is \
                        section = { circle = { diameter = 0.001 } }";
            rod.conflict("material", &["section"], hint);
            None
        }
    }
}

/// Reads a curvature along a planar rod.
pub(super) fn curvature(table: &Table, field: &str, value: &Spanned<DeValue>) -> Option<Vec<f64>> {
    polynomial(table.reader, field, value, &super::ranges::FINITE)
}
