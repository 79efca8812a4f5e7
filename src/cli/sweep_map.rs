//! The map of a sweep over two fields, and the curves of one over one field: their data, and the names of fields and of what is told, in words and with units.

use super::sheets::figures::sheet_name;
use snaprod::manifold::{Sheet, Sign};
use snaprod::plot::{OutcomeMap, Outcomes, SweptAxis, SweptCurves};
use snaprod::scene::{Scene, Units};
use snaprod::study::sweep::{Rows, Sweep};

/// Most panels of curves.
const MOST_CURVES: usize = 6;

/// The map over the two fields: numbers if one column is shown and holds some that are not whole, or words.
pub fn map(sweep: &Sweep, rows: &Rows, columns: &[String]) -> OutcomeMap {
    let mut words = vec![String::new(); rows.cells.len()];
    for column in columns {
        for (word, part) in words.iter_mut().zip(rows.column(column)) {
            if !(word.is_empty() || part.is_empty()) {
                word.push(' ');
            }
            word.push_str(part);
        }
    }
    let of_sheets = where_sheets_are_told(columns);
    if of_sheets.is_some() {
        words.iter_mut().for_each(|word| *word = sheet(word));
    }
    let number = |word: &String| word.parse::<f64>().ok();
    let whole = |word: &String| word.is_empty() || word.parse::<i64>().is_ok();
    let numbers = columns.len() == 1
        && words
            .iter()
            .all(|word| word.is_empty() || number(word).is_some())
        && !words.iter().all(whole);
    let title = of_sheets.unwrap_or_else(|| {
        let told: Vec<String> = columns.iter().map(|column| label(sweep, column)).collect();
        told.join(", ")
    });
    OutcomeMap {
        title: title.clone(),
        x: axis(sweep, 0),
        y: axis(sweep, 1),
        outcomes: if numbers {
            Outcomes::Numbers(
                words
                    .iter()
                    .map(|word| number(word).unwrap_or(f64::NAN))
                    .collect(),
                title,
            )
        } else {
            Outcomes::Words(words)
        },
    }
}

/// The curves over the one field: of what is told those numbers that are not the same everywhere, in the colours of how many snaps there were, or else of
/// what came of it.
pub fn curves(sweep: &Sweep, rows: &Rows) -> SweptCurves {
    let known = sweep.quantities();
    let marked = ["snaps", "outcome"];
    let marked = marked
        .iter()
        .find(|name| known.iter().any(|one| one == **name));
    let words = marked.map_or(Vec::new(), |name| {
        rows.column(name).map(str::to_owned).collect()
    });
    let differ = words.iter().any(|word| *word != words[0]);
    let curve = |column: &String| {
        let cells: Vec<&str> = rows.column(column).collect();
        let number = |cell: &&str| cell.is_empty() || cell.parse::<f64>().is_ok();
        let drawn = cells.iter().all(number)
            && cells.iter().any(|cell| *cell != cells[0])
            && marked.is_none_or(|name| name != column)
            && !column.starts_with("energy_error");
        let values = cells.iter().map(|cell| cell.parse().unwrap_or(f64::NAN));
        drawn.then(|| (label(sweep, column), values.collect()))
    };
    SweptCurves {
        title: match marked {
            Some(name) if differ => told(name),
            _ => String::new(),
        },
        x: axis(sweep, 0),
        curves: known.iter().filter_map(curve).take(MOST_CURVES).collect(),
        words: if differ { words } else { Vec::new() },
    }
}

/// A field that is varied, with its values.
fn axis(sweep: &Sweep, k: usize) -> SweptAxis {
    // Where the first point is no scene, the last one is.
    let ends = [0, sweep.points() - 1].map(|point| sweep.scene(point).ok());
    let one = &sweep.vary()[k];
    let values = (0..one.count().unwrap_or(0)).map(|i| one.on_grid(i));
    SweptAxis {
        label: field(&ends, &one.path),
        values: values.map(|x| x.parse().unwrap_or(f64::NAN)).collect(),
        log: one.is_logarithmic(),
    }
}

/// What is told of each point, in words, with its unit.
fn label(sweep: &Sweep, column: &str) -> String {
    let unit = sweep
        .described(column)
        .map_or(String::new(), |[unit, _]| unit);
    Units::label(&told(column), &unit)
}

/// A field in words, `start velocity x (m/s)` for `start.velocity[0]`, with the unit that figures of runs of the scenes at both ends of the sweep give.
fn field(ends: &[Option<Scene>; 2], path: &str) -> String {
    let mut scenes = ends.iter().flatten();
    let described = scenes.clone().find_map(|s| Some((s, s.described(path)?)));
    let Some((scene, (name, unit))) = described else {
        return path.to_owned();
    };
    let unit = match scene.units {
        Units::Si => unit,
        Units::Dimensionless if unit == "rad" => unit,
        Units::Dimensionless if scenes.all(|s| s.scales().is_ok_and(|k| k.are_one())) => {
            natural(unit)
        }
        Units::Dimensionless => "",
    };
    Units::label(&name, unit)
}

/// A unit of SI in terms of the rod and the body: length ℓ, bending stiffness EI, mass μ.
fn natural(unit: &str) -> &'static str {
    match unit {
        "m" => "ℓ",
        "s" => "√(μℓ³/EI)",
        "kg" => "μ",
        "m/s" => "√(EI/μℓ)",
        "rad/s" | "Hz" => "√(EI/μℓ³)",
        "m/s²" => "EI/μℓ²",
        "N" => "EI/ℓ²",
        "N m" => "EI/ℓ",
        "N m²" => "EI",
        "N/m" => "EI/ℓ³",
        "1/m" => "1/ℓ",
        "kg m²" => "μℓ²",
        "N s/m" => "√(μEI/ℓ³)",
        "N m s" => "√(μEI ℓ)",
        "N m² s" => "√(μEI ℓ³)",
        _ => "",
    }
}

/// What is told of each point, in words: `dissipated at the end` for `end.dissipated`, `t of the last event` for `events.-1.t`.
fn told(column: &str) -> String {
    let mut parts: Vec<&str> = column.split('.').collect();
    // A component has a letter.
    if let [
        ..,
        "position" | "velocity" | "angular_velocity" | "groove_force",
        k,
    ] = parts.as_mut_slice()
    {
        *k = match *k {
            "0" => "x",
            "1" => "y",
            "2" => "z",
            other => other,
        };
    }
    let (what, of) = match parts.as_slice() {
        ["end", "bodies", what @ ..] | ["end", what @ ..] => (what, " at the end".to_owned()),
        ["start", "bodies", what @ ..] | ["start", what @ ..] => (what, " at the start".to_owned()),
        ["least" | "greatest", ..] => (parts.as_slice(), " along the run".to_owned()),
        ["events", k, what @ ..] => {
            let (what, of) = match what {
                ["from", what @ ..] => (what, "before"),
                ["to", what @ ..] => (what, "after"),
                what => (what, "of"),
            };
            let event = match k.parse::<i64>() {
                Ok(-1) => "the last event".to_owned(),
                Ok(k) if k >= 0 => format!("event {}", k + 1),
                _ => format!("event {k}"),
            };
            (what, format!(" {of} {event}"))
        }
        what => (what, String::new()),
    };
    what.join(" ").replace('_', " ") + &of
}

/// Where the sheets are that are told by mode and sign: `sheet at the end` of `end.mode` and `end.sign`; None where other things are told.
fn where_sheets_are_told(columns: &[String]) -> Option<String> {
    let [mode, sign] = columns else {
        return None;
    };
    let of = mode.strip_suffix("mode")?;
    (sign.strip_suffix("sign") == Some(of)).then(|| told(&format!("{of}sheet")))
}

/// The name of the sheet of a mode and a sign; what is none stays as it is.
fn sheet(word: &str) -> String {
    let named = || {
        let (mode, sign) = word.split_once(' ')?;
        let sign = match sign {
            "+" => Sign::Plus,
            "-" => Sign::Minus,
            _ => return None,
        };
        let mode = mode.parse().ok()?;
        Some(sheet_name(Sheet { mode, sign }))
    };
    named().unwrap_or_else(|| word.to_owned())
}
