//! Pages: one HTML file with its data, drawing code and text, without network access.

mod branch;
mod equilibria;
mod motion;
mod numbers;
mod sheets;

pub use branch::branch_data;
pub use equilibria::equilibria_data;
pub use motion::{MotionContext, motion_data};
pub use sheets::sheets_data;

use super::check::SceneArgs;
use super::files::rounded;
use serde_json::Value;
use snaprod::scene::Units;

/// Bound on the bytes of a page; figures that do not fit are named and left out.
const MOST: usize = 295_000;

/// Contents of a page.
pub struct Page {
    /// Name of the scene.
    pub name: String,
    /// Kind of the page.
    pub kind: PageKind,
    /// Numbers to draw, made by the library.
    pub data: Value,
    /// Report that the program printed.
    pub words: String,
    /// Events, one per line after a header line: time, kind, numbers.
    pub events: Vec<[String; 3]>,
    /// Figures, as SVG, by name.
    pub figures: Vec<(String, String)>,
    /// Text of the scene as written by the user.
    pub scene: String,
}

/// Scripts that all pages share.
const SHARED: [&str; 3] = [
    include_str!("data.js"),
    include_str!("plane.js"),
    include_str!("space.js"),
];

/// The kinds of pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PageKind {
    /// A motion that can be played.
    Motion,
    /// Branches and the shapes along them.
    Branch,
    /// A list of equilibria.
    Equilibria,
    /// Solution sheets of the elastica.
    Sheets,
}

impl PageKind {
    fn scripts(self) -> &'static [&'static str] {
        match self {
            Self::Motion => &[include_str!("player.js"), include_str!("motion.js")],
            Self::Branch => &[include_str!("branch.js")],
            Self::Equilibria => &[include_str!("equilibria.js")],
            Self::Sheets => &[include_str!("sheets.js")],
        }
    }
}

impl Page {
    /// The page as HTML.
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
        let words = section("Results", &text(&self.words));
        let events = section("Events", &self.event_table());
        let scene = match &*text(&self.scene) {
            "" => String::new(),
            scene => format!("<details><summary>Scene</summary>{scene}</details>\n"),
        };
        let footer = concat!(
            "<footer>Made by snaprod ",
            env!("CARGO_PKG_VERSION"),
            "; shapes and numbers are the program's, drawn to 1/65000 of their range.</footer>\n"
        );
        let data = script_text(&self.data);
        let scripts = [&SHARED, self.kind.scripts()].concat().join("\n");
        let (page, style) = (include_str!("page.html"), include_str!("page.css"));
        let parts = [
            page, style, &words, &events, &scene, footer, &data, &scripts,
        ];
        let taken: usize = parts.iter().map(|part| part.len()).sum();
        let figures = figures(&self.figures, MOST.saturating_sub(taken));
        let body = [
            words,
            events,
            section("Figures", &figures),
            scene,
            footer.to_owned(),
        ]
        .concat();
        // Names alternate with parts of the template; inserted text is not searched again.
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
        let row = |tag: &str, row: &[String; 3]| {
            let cells = row
                .each_ref()
                .map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell)));
            format!("<tr>{}</tr>", cells.concat())
        };
        let Some((heading, events)) = self.events.split_first() else {
            return String::new();
        };
        let events: String = events.iter().map(|event| row("td", event)).collect();
        format!(
            "<table><thead>{}</thead><tbody>{events}</tbody></table>",
            row("th", heading)
        )
    }
}

/// The figures that fit into `most` bytes, and the names of the others.
fn figures(figures: &[(String, String)], mut most: usize) -> String {
    let mut shown = String::new();
    let mut others = Vec::new();
    for (name, svg) in figures {
        // An SVG inside HTML needs no name space, which would look like an address.
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
        shown +=
            &format!("<p>Figures too large for this page, in the same directory: {others}.</p>");
    }
    shown
}

/// Events as lines after a header line: time, kind and numbers, in words and with units.
pub fn event_rows(events: &[Value], units: Units) -> Vec<[String; 3]> {
    /// Number of events listed.
    const SHOWN: usize = 60;
    if events.is_empty() {
        return Vec::new();
    }
    let row = |event: &Value| {
        let time = ["t", "peak"].iter().find_map(|name| event.get(*name));
        let others = event.as_object().into_iter().flatten();
        let others = others.filter_map(|(name, value)| told(name, value, units));
        let kind = match event["kind"].as_str().unwrap_or_default() {
            "self_contact" => "contact",
            "layer" => "passage away from equilibrium",
            "light_rod_lost" => "light rod lost",
            kind => kind,
        };
        [
            time.map(in_words).unwrap_or_default(),
            kind.to_owned(),
            others.collect::<Vec<_>>().join(", "),
        ]
    };
    let heading = [&*Units::label("time", units.time()), "event", "numbers"].map(str::to_owned);
    let mut rows = vec![heading];
    rows.extend(events.iter().take(SHOWN).map(row));
    if events.len() > SHOWN {
        let more = format!("and {} more, in events.json", events.len() - SHOWN);
        rows.push([String::new(), "...".to_owned(), more]);
    }
    rows
}

/// Text of one field of an event; `None` for fields with a column of their own, without a plain number, or without
/// information.
fn told(name: &str, value: &Value, units: Units) -> Option<String> {
    let (words, symbol) = match name {
        "t" | "peak" | "kind" | "time_error" => return None,
        "whole" => {
            return (value == false).then(|| "cut off by the start or end of the run".to_owned());
        }
        "x" | "y" | "z" => (name, units.length()),
        "s" => ("at s =", units.length()),
        "vx" => ("velocity along x", units.velocity()),
        "vy" => ("velocity along y", units.velocity()),
        "vz" => ("velocity along z", units.velocity()),
        "released" => ("energy released", units.energy()),
        "dissipated" => ("energy dissipated", units.energy()),
        "elastic_from" => ("elastic energy before", units.energy()),
        "elastic_to" => ("elastic energy after", units.energy()),
        "from" | "to" | "until" if value.is_number() => (name, units.time()),
        "choices" => ("stable equilibria found at lower energy:", ""),
        "reached" => ("reached by the viscous flow:", ""),
        "parent" => ("from branch", ""),
        "rods" => ("of", ""),
        _ => (name, ""),
    };
    let number = match value {
        Value::Object(end) => {
            format!("S_{}^{}", end.get("mode")?, end.get("sign")?.as_str()?)
        }
        Value::Array(pair) => {
            let plain = pair.iter().all(|one| one.is_number() || one.is_string());
            plain.then(|| pair.iter().map(in_words).collect::<Vec<_>>().join(" and "))?
        }
        Value::Null => return None,
        plain => in_words(plain),
    };
    Some(format!("{words} {number} {symbol}").trim_end().to_owned())
}

/// A rounded number, or a word.
fn in_words(value: &Value) -> String {
    match value.as_f64() {
        Some(x) if value.is_f64() => rounded(x, 6),
        _ => value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned),
    }
}

/// Text of the scene as written by the user, with the overrides of the command line.
pub fn scene_text(given: &SceneArgs) -> String {
    // The file was read a moment ago; if gone now, the page only lacks this text.
    let mut text = given.text().unwrap_or_default();
    for set in &given.set {
        text += &format!("\n# --set {set}");
    }
    text
}

/// Text escaped for HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// JSON within a script, without "<", which could end the script.
fn script_text(data: &Value) -> String {
    data.to_string().replace('<', "\\u003c")
}
