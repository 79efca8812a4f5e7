//! Options and words of derivatives: `--by FIELD`, `--stiffness`.

use super::Refusal;
use super::check::{SceneArgs, no_start};
use super::files::number;
use clap::Args;
use serde_json::Value;
use snaprod::scene::ScalarField;
use snaprod::study::FirstOrder;
use std::fmt::Write;

/// Fields by which results are differentiated.
#[derive(Args)]
pub struct ByArgs {
    /// Differentiate all numbers of the result by a field of the scene, as in --by rod.length; may be repeated.
    #[arg(long, value_name = "FIELD")]
    pub by: Vec<String>,
}

impl ByArgs {
    /// The fields with their values in the scene.
    pub fn fields(&self, scene: &SceneArgs) -> Result<Vec<ScalarField>, Refusal> {
        if self.by.is_empty() {
            return Ok(Vec::new());
        }
        let text = scene.with_overrides()?;
        let fields = self.by.iter().map(|path| text.field(path));
        let fields: snaprod::Result<Vec<_>> = fields.collect();
        fields.map_err(|e| no_start(&scene.path, &e.context("--by")))
    }
}

/// Derivatives that the command `equilibrium` is asked for.
#[derive(Args)]
pub struct FirstOrderArgs {
    #[command(flatten)]
    pub by: ByArgs,
    /// Give stiffness and compliance of the end, of stations and of bodies.
    #[arg(long)]
    pub stiffness: bool,
}

impl FirstOrderArgs {
    /// Derivatives and responses asked for.
    pub fn asked(&self, scene: &SceneArgs) -> Result<FirstOrder, Refusal> {
        Ok(FirstOrder {
            by: self.by.fields(scene)?,
            responses: self.stiffness,
        })
    }
}

/// Derivatives and responses of a summary, a line each.
pub fn text(summary: &Value) -> String {
    let mut text = String::new();
    for (field, found) in summary["derivatives"].as_object().into_iter().flatten() {
        let why = summary["no_derivatives"][field].as_str();
        if let Some(why) = why {
            let _ = writeln!(text, "no derivative by {field}: {why}");
            continue;
        }
        let _ = writeln!(text, "derivatives by {field}");
        lines(&mut text, "", found);
    }
    if let Value::Object(responses) = &summary["responses"] {
        let _ = writeln!(text, "responses, (rotation, place) to (couple, force)");
        responses
            .iter()
            .for_each(|(name, value)| lines(&mut text, name, value));
    }
    text
}

/// A line for each number, vector of numbers or word, after its path.
fn lines(text: &mut String, path: &str, value: &Value) {
    let under = |name: &str| match path {
        "" => name.to_owned(),
        _ => format!("{path}.{name}"),
    };
    match value {
        Value::Object(fields) => {
            let fields = fields.iter();
            fields.for_each(|(name, field)| lines(text, &under(name), field));
        }
        Value::Array(items) if items.iter().any(Value::is_array) => {
            let items = items.iter().enumerate();
            items.for_each(|(k, item)| lines(text, &under(&k.to_string()), item));
        }
        Value::Array(items) => {
            let numbers = items.iter().filter_map(Value::as_f64).map(number);
            let _ = writeln!(
                text,
                "  {path:<28} {}",
                numbers.collect::<Vec<_>>().join(", ")
            );
        }
        Value::Number(x) => {
            let _ = writeln!(
                text,
                "  {path:<28} {}",
                number(x.as_f64().unwrap_or(f64::NAN))
            );
        }
        Value::String(word) => {
            let _ = writeln!(text, "  {path:<28} {word}");
        }
        Value::Null => {
            let _ = writeln!(text, "  {path:<28} none");
        }
        Value::Bool(_) => {}
    }
}
