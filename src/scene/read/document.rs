//! Documents generated from the tables of fields: a JSON Schema for editors, and a reference in Markdown.

use super::fields::{
    ASSEMBLY, BAR, FLOWS, Field, Form, INFLATIONS, Kinds, MEMBRANES, Need, PLANE, SPACE, STATICS,
    Spec, TOP, TUBES,
};
use super::phrases::listed;
use crate::scene::{Scene, SceneKind, WallScene};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Letters of components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The JSON Schema (2020-12) of scenes, for completion and checks in editors of TOML.
///
/// The schema lists the tables and fields, with types, defaults and one line of documentation each. Conditions between
/// fields and some sets of numbers are left to [`Scene::parse`](crate::scene::Scene::parse).
pub fn json_schema() -> Value {
    let mut schema = object(&TOP);
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("A scene of snaprod");
    schema
}

fn object(spec: &Spec) -> Value {
    let mut properties: Map<String, Value> = Map::new();
    for field in spec.fields {
        let mut property = form(&field.form);
        property["description"] = json!(describe(field));
        if let Some(default) = default(field) {
            property["default"] = default;
        }
        if let Some(other) = properties.get_mut(field.name)
            && is_same_table(other, &property)
        {
            continue;
        }
        // A field with different meanings in different kinds of scenes may have any of them.
        let property = match properties.remove(field.name) {
            Some(Value::Object(mut other)) if other.len() == 1 && other.contains_key("anyOf") => {
                if let Some(list) = other.get_mut("anyOf").and_then(Value::as_array_mut) {
                    list.push(property);
                }
                Value::Object(other)
            }
            Some(other) => json!({ "anyOf": [other, property] }),
            None => property,
        };
        properties.insert(field.name.to_owned(), property);
    }
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

/// True if both are the same table. If `other` is an array of this table, the array form is added to `table`.
fn is_same_table(table: &mut Value, other: &Value) -> bool {
    let of = |table: &Value, other: &Value| {
        other["properties"].is_object() && table["properties"] == other["properties"]
    };
    if of(table, &other["items"]) {
        table["type"] = json!(["object", "array"]);
        table["items"] = other["items"].clone();
        return true;
    }
    of(table, other)
}

fn describe(field: &Field) -> String {
    let unit = match field.unit {
        "" => String::new(),
        unit => format!(" [{unit}]"),
    };
    format!("{}{unit}", field.doc)
}

/// The default as JSON, if the default is a plain value.
fn default(field: &Field) -> Option<Value> {
    let Need::Or(text) = field.need else {
        return None;
    };
    let table: toml::Table = format!("x = {text}").parse().ok()?;
    serde_json::to_value(table.get("x")?).ok()
}

fn form(form: &Form) -> Value {
    let numbers = |count: usize| json!({ "type": "array", "items": { "type": "number" }, "minItems": count, "maxItems": count });
    match form {
        Form::Number(rule) => match ((rule.holds)(0.0), (rule.holds)(-0.5)) {
            (false, false) => json!({ "type": "number", "exclusiveMinimum": 0 }),
            (true, false) => json!({ "type": "number", "minimum": 0 }),
            _ => json!({ "type": "number" }),
        },
        Form::Count(least, most) => {
            json!({ "type": "integer", "minimum": least, "maximum": most })
        }
        Form::Flag => json!({ "type": "boolean" }),
        Form::Name | Form::Word([]) => json!({ "type": "string" }),
        Form::Word(words) => json!({ "enum": words }),
        Form::Vector(_) => {
            json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 3 })
        }
        Form::Numbers(count) => numbers(*count),
        Form::List => json!({ "type": "array", "items": { "type": "number" } }),
        Form::Rows(count) => json!({ "type": "array", "items": numbers(*count) }),
        Form::Table(spec) => object(spec),
        Form::Array(inner) => json!({ "type": "array", "items": self::form(inner) }),
        Form::OneOf(forms) => {
            let forms: Vec<Value> = forms.iter().map(self::form).collect();
            json!({ "anyOf": forms })
        }
    }
}

/// The reference of every field, in Markdown: docs/scene.md.
pub fn reference() -> String {
    let mut text = String::from(
        "# Scenes\n\n\
         A scene is a TOML file. It describes a rod, its supports, the body it carries, the loads, and the requested\n\
         computation. This page lists every table and field. `snaprod schema --markdown` prints it from the tables that the\n\
         reader of scenes uses.\n\n\
         The content decides the kind of a scene. `rod.model = \"elastica\"` lies in the plane, `\"cosserat\"` in space. A scene\n\
         with `[body]` and `[run]` is a motion, one with `[end]` is a scene of statics. The column *in* says which kinds have a\n\
         field: P, motion in the plane; M, motion in space; S, statics in space; A, assemblies; B, bars with mass in\n\
         longitudinal motion, `rod.model = \"bar\"`; T, sections of tubes, `[tube]` in place of `[rod]`; F, flows in\n\
         tubes, `[tube]` with `[run]`; I, inflated membranes at rest, `[membrane]`; J, membranes in motion, `[membrane]` with\n\
         `[run]`.\n\n\
         Tables `[[rod]]` and `[[body]]`, with two brackets, make an assembly: several rods and bodies in space. Each rod joins\n\
         two places, on bodies or on the ground; in a motion one of them is on a body. An assembly is at rest or, with `[run]`,\n\
         in motion. `[[rod]]` has the fields of `[rod]`, and also name, from and to.\n\n\
         Quantities are in any consistent system of units; the units given here are those of `units = \"si\"`. Vectors have two\n\
         components in the plane and three in space. In the plane the rod leaves the clamp along +x. In space the rod has\n\
         directors d1, d2, d3 and leaves along d3; `bending[0]` is the stiffness about d1. The command line can replace any\n\
         number: `--set rod.damping=0.2`. A number, a name or, in a vector, a letter selects an element of a list:\n\
         `start.velocity[1]`, `body.platform.mass`, `start.velocity.y`.\n\n\
         The axes of a rectangle, seen along the rod (d3 points at you):\n\n\
         ```text\n\
         \x20        d2\n\
         \x20        ^\n\
         \x20 +------|------+\n\
         \x20 |      +------|--> d1     thickness, along d2\n\
         \x20 +-------------+\n\
         \x20   width, along d1         bending[0] = E width thickness^3 / 12, about d1: the weak way of a flat strip\n\
         ```\n",
    );
    table(&mut text, &TOP, "At the top of the file");
    let mut done: Vec<&'static str> = vec![""];
    let mut waiting: Vec<(String, &'static Spec)> = inner("", &TOP);
    while !waiting.is_empty() {
        let (path, spec) = waiting.remove(0);
        if done.contains(&spec.name) {
            continue;
        }
        done.push(spec.name);
        let title = match path.matches('.').count() {
            0 => format!("`[{path}]`"),
            _ => format!("`{path}`"),
        };
        table(&mut text, spec, &title);
        let deeper = inner(&path, spec);
        waiting.splice(0..0, deeper);
    }
    text
}

impl Scene {
    /// Description in words, `start velocity x`, and SI unit of the field at a path (`start.velocity[0]`,
    /// `start.velocity.0` or `start.velocity.x`). The unit of a pure number is empty. `None` if scenes of this kind
    /// have no such field.
    pub fn described(&self, path: &str) -> Option<(String, &'static str)> {
        let kind = self.kind_of_fields();
        let mut specs: Vec<&'static Spec> = vec![&TOP];
        let (mut words, mut unit): (Vec<String>, _) = (Vec::new(), "");
        // The field whose elements the next step of the path may name.
        let mut list: Option<&'static Form> = None;
        for step in path
            .split(['.', '['])
            .map(|step| step.trim_end_matches(']'))
        {
            if let Some(form) = list.take() {
                let number = step.parse::<usize>().ok();
                let axis = AXES.iter().position(|axis| *axis == step);
                let element = match number.or(axis) {
                    Some(k) if is_vector(form) => Some(format!(" {}", AXES.get(k)?)),
                    _ => number.map(|k| format!("[{k}]")),
                };
                if let Some(element) = element {
                    words.last_mut()?.push_str(&element);
                    continue;
                }
            }
            let Some(field) = specs.iter().find_map(|spec| spec.field(step, kind)) else {
                // After `body` or `rod` the step may be the name of one.
                let of = ["body", "rod"].iter().find(|of| words == [**of])?;
                self.has_named(of, step).then_some(())?;
                words.push(step.to_owned());
                continue;
            };
            let word = step.replace('_', " ");
            // The description of a load omits the word `loads`.
            if word != "loads" {
                words.push(word);
            }
            // The columns of a table have different units.
            unit = if field.unit.contains(',') {
                ""
            } else {
                field.unit
            };
            let mut tables = Vec::new();
            collect(&field.form, "", &mut tables);
            specs = tables.into_iter().map(|(_, spec)| spec).collect();
            list = Some(&field.form);
        }
        Some((words.join(" "), unit))
    }

    /// True if a body or a rod of an assembly has this name.
    fn has_named(&self, of: &str, name: &str) -> bool {
        self.assembly().is_some_and(|assembly| match of {
            "body" => assembly.bodies.iter().any(|body| body.name == name),
            _ => {
                let held = assembly.rods.iter().any(|rod| rod.name == name);
                held || assembly.free.iter().any(|rod| rod.name == name)
            }
        })
    }

    /// Kind of the scene in the tables of fields.
    pub(super) fn kind_of_fields(&self) -> Kinds {
        match self.kind {
            SceneKind::Bar(_) => BAR,
            SceneKind::Flow(_) => FLOWS,
            SceneKind::Inflation(_) => INFLATIONS,
            SceneKind::Wall(WallScene::Tube(_)) => TUBES,
            SceneKind::Wall(WallScene::Membrane(_)) => MEMBRANES,
            SceneKind::Assembly(_) => ASSEMBLY,
            SceneKind::Rod if self.is_planar() => PLANE,
            SceneKind::Rod if self.is_motion() => SPACE,
            SceneKind::Rod => STATICS,
        }
    }
}

/// True if the value may be a vector, whose components have letters.
fn is_vector(form: &Form) -> bool {
    match form {
        Form::Vector(_) => true,
        Form::OneOf(forms) => forms.iter().any(is_vector),
        _ => false,
    }
}

/// The tables inside a table, each with its path.
fn inner(path: &str, spec: &'static Spec) -> Vec<(String, &'static Spec)> {
    let mut found = Vec::new();
    for field in spec.fields {
        let path = match path {
            "" => field.name.to_owned(),
            _ => format!("{path}.{}", field.name),
        };
        collect(&field.form, &path, &mut found);
    }
    found
}

fn collect(form: &'static Form, path: &str, found: &mut Vec<(String, &'static Spec)>) {
    match form {
        Form::Table(spec) => found.push((path.to_owned(), spec)),
        Form::Array(form) => collect(form, path, found),
        Form::OneOf(forms) => forms.iter().for_each(|form| collect(form, path, found)),
        _ => {}
    }
}

fn table(text: &mut String, spec: &Spec, title: &str) {
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n## {title}\n\n| field | in | value | unit | without it | meaning |\n|---|---|---|---|---|---|\n"
    );
    for field in spec.fields {
        let without = match field.need {
            Need::Yes(_) => "must be given".to_owned(),
            Need::Or(default) => format!("`{default}`"),
            Need::No => String::new(),
        };
        let (kinds, value) = (kinds(field.on), words(&field.form).replace('|', "\\|"));
        let (unit, doc) = (field.unit, field.doc.replace('|', "\\|"));
        let _ = writeln!(
            text,
            "| `{}` | {kinds} | {value} | {unit} | {without} | {doc} |",
            field.name
        );
    }
}

fn kinds(on: Kinds) -> String {
    let letters = [
        (PLANE, "P"),
        (SPACE, "M"),
        (STATICS, "S"),
        (ASSEMBLY, "A"),
        (BAR, "B"),
        (TUBES, "T"),
        (MEMBRANES, "I"),
        (INFLATIONS, "J"),
        (FLOWS, "F"),
    ];
    let those = letters.iter().filter(|(kind, _)| on & kind != 0);
    let those: Vec<&str> = those.map(|(_, letter)| *letter).collect();
    those.join(" ")
}

/// Description of a value in words.
fn words(form: &Form) -> String {
    match form {
        Form::Number(rule) | Form::Vector(rule) => {
            let allowed = rule.allowed.split(';').next().unwrap_or_default();
            match form {
                Form::Vector(_) => "a vector".to_owned(),
                _ => allowed.to_owned(),
            }
        }
        Form::Count(least, most) => format!("an integer from {least} to {most}"),
        Form::Flag => "true or false".to_owned(),
        Form::Name => "a name".to_owned(),
        Form::Word([]) => "a path such as `end.force.y`".to_owned(),
        Form::Word(words) => listed(words),
        Form::Numbers(count) => format!("{count} numbers"),
        Form::List => "an array of numbers".to_owned(),
        Form::Rows(count) => format!("an array of rows of {count} numbers"),
        Form::Table(_) => "a table".to_owned(),
        Form::Array(inner) => format!("an array, each {}", words(inner)),
        Form::OneOf(forms) => {
            let all: Vec<String> = forms.iter().map(words).collect();
            all.join("; or ")
        }
    }
}
