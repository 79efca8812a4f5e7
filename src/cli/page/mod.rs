//! Pages: one HTML file that holds its data, its drawing and its words, and asks for nothing else.

mod branch;
mod motion;
mod numbers;
mod sheets;

pub use branch::branch_data;
pub use motion::{Scenery, motion_data};
pub use sheets::sheets_data;

use super::check::SceneArgs;
use super::files::rounded;
use serde_json::Value;

/// A page beside its figures takes no more than this, in bytes; figures that would are named and left out.
const MOST: usize = 295_000;

/// What a page shows.
pub struct Page {
    /// What it is of.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// What is drawn: the numbers, made by the library.
    pub data: Value,
    /// What the program says of it.
    pub words: String,
    /// What happened, a line each: the time, what it was, its numbers.
    pub events: Vec<[String; 3]>,
    /// Figures, as SVG, by name.
    pub figures: Vec<(String, String)>,
    /// The scene as its user wrote it.
    pub scene: String,
}

/// The program that all pages have.
const SHARED: [&str; 3] = [
    include_str!("data.js"),
    include_str!("plane.js"),
    include_str!("space.js"),
];

/// The kinds of pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It plays a motion.
    Motion,
    /// It shows branches and the shapes along them.
    Branch,
    /// It shows the solution sheets of the elastica.
    Sheets,
}

impl Kind {
    fn scripts(self) -> &'static [&'static str] {
        match self {
            Self::Motion => &[include_str!("player.js"), include_str!("motion.js")],
            Self::Branch => &[include_str!("branch.js")],
            Self::Sheets => &[include_str!("sheets.js")],
        }
    }
}

impl Page {
    /// The file.
    pub fn html(&self) -> String {
        let name = escaped(&self.name);
        let section = |heading: &str, inner: &str| match inner {
            "" => String::new(),
            _ => format!("<section><h2>{heading}</h2>{inner}</section>\n"),
        };
        let text = |text: &str| match text.trim_end() {
            "" => String::new(),
            text => format!("<pre>{}</pre>", escaped(text)),
        };
        let words = section("What came of it", &text(&self.words));
        let events = section("Events", &self.event_table());
        let scene = section("Scene", &text(&self.scene));
        let data = script_text(&self.data);
        let scripts = [&SHARED, self.kind.scripts()].concat().join("\n");
        let (page, style) = (include_str!("page.html"), include_str!("page.css"));
        let parts = [page, style, &words, &events, &scene, &data, &scripts];
        let taken: usize = parts.iter().map(|part| part.len()).sum();
        let figures = figures(&self.figures, MOST.saturating_sub(taken));
        let body = [words, events, section("Figures", &figures), scene].concat();
        // Names stand between the parts; what is put in is not looked into again.
        let parts = page.split("@@");
        let filled = parts.enumerate().map(|(k, part)| match (k % 2, part) {
            (0, part) => part,
            (_, "name") => &name,
            (_, "style") => style,
            (_, "body") => &body,
            (_, "data") => &data,
            _ => &scripts,
        });
        filled.collect()
    }

    fn event_table(&self) -> String {
        if self.events.is_empty() {
            return String::new();
        }
        let row = |[t, kind, rest]: &[String; 3]| {
            let cells = [t, kind, rest].map(|cell| format!("<td>{}</td>", escaped(cell)));
            format!("<tr>{}</tr>", cells.concat())
        };
        let rows: String = self.events.iter().map(row).collect();
        format!(
            "<table><thead><tr><th>t</th><th>what</th><th>numbers</th></tr></thead><tbody>{rows}</tbody></table>"
        )
    }
}

/// The figures that fit into `most` bytes, and the names of the others.
fn figures(figures: &[(String, String)], mut most: usize) -> String {
    let mut shown = String::new();
    let mut others = Vec::new();
    for (name, svg) in figures {
        // Within HTML an SVG needs no name space, which would look like an address.
        let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
        match most.checked_sub(svg.len()) {
            Some(left) => {
                most = left;
                shown += &format!("<figure>{svg}<figcaption>{name}.svg</figcaption></figure>\n");
            }
            None => others.push(format!("{name}.svg")),
        }
    }
    if !others.is_empty() {
        let others = others.join(", ");
        shown += &format!("<p>Too large for this page, and beside it: {others}.</p>");
    }
    shown
}

/// Events as lines: time, kind and numbers.
pub fn event_rows(events: &[Value]) -> Vec<[String; 3]> {
    /// Events that are told one by one.
    const SHOWN: usize = 60;
    let number = |value: &Value| match value.as_f64() {
        Some(x) if value.is_f64() => rounded(x, 6),
        _ => value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned),
    };
    let row = |event: &Value| {
        let time = ["t", "peak"].iter().find_map(|name| event.get(*name));
        let others = event.as_object().into_iter().flatten();
        let others = others.filter_map(|(name, value)| {
            let plain = !matches!(name.as_str(), "t" | "kind" | "time_error");
            let sheet = || {
                Some(format!(
                    "S_{}^{}",
                    value.get("mode")?,
                    value.get("sign")?.as_str()?
                ))
            };
            match value {
                Value::Object(_) => sheet().map(|sheet| format!("{name} {sheet}")),
                Value::Array(_) | Value::Null => None,
                _ if plain => Some(format!("{name} {}", number(value))),
                _ => None,
            }
        });
        let kind = event["kind"].as_str().unwrap_or_default();
        [
            time.map(number).unwrap_or_default(),
            kind.to_owned(),
            others.collect::<Vec<_>>().join(", "),
        ]
    };
    let mut rows: Vec<[String; 3]> = events.iter().take(SHOWN).map(row).collect();
    if events.len() > SHOWN {
        let more = format!("and {} more, in events.json", events.len() - SHOWN);
        rows.push([String::new(), "...".to_owned(), more]);
    }
    rows
}

/// The scene as its user wrote it, with what was set on the command line.
pub fn scene_text(given: &SceneArgs) -> String {
    // It was read a moment ago; without it the page is complete but for these words.
    let mut text = std::fs::read_to_string(&given.path).unwrap_or_default();
    for set in &given.set {
        text += &format!("\n# --set {set}");
    }
    text
}

/// The name of a scene's file.
pub fn name(given: &SceneArgs) -> String {
    let stem = given.path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Text of a page.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// JSON within a script: no "<" in it, which could end the script.
fn script_text(data: &Value) -> String {
    data.to_string().replace('<', "\\u003c")
}
