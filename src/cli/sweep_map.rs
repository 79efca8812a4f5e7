//! Data of the map of a sweep over two fields and of the curves of a sweep over one field; names of fields and columns
//! in words, with units.

use super::sheets::figures::sheet_name;
use snaprod::manifold::{Sheet, Sign};
use snaprod::plot::{OutcomeMap, Outcomes, SweptAxis, SweptCurves};
use snaprod::scene::{Scene, Units};
use snaprod::study::sweep::{Rows, Sweep};

/// Bound on the number of panels of curves.
const MOST_CURVES: usize = 6;

/// Map over the two fields: of numbers if a single column is shown whose values are not all whole, otherwise of words.
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

/// Curves over the one field: the numeric columns that are not constant. Colours show the number of snaps, or without
/// it the outcome.
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
            Some(name) if differ => column_in_words(name),
            _ => String::new(),
        },
        x: axis(sweep, 0),
        curves: known.iter().filter_map(curve).take(MOST_CURVES).collect(),
        words: if differ { words } else { Vec::new() },
    }
}

/// A varied field with its values.
fn axis(sweep: &Sweep, k: usize) -> SweptAxis {
    // If the first point is no valid scene, the last one is.
    let ends = [0, sweep.points() - 1].map(|point| sweep.scene(point).ok());
    let one = &sweep.vary()[k];
    let values = (0..one.count().unwrap_or(0)).map(|i| one.on_grid(i));
    SweptAxis {
        label: field(&ends, &one.path),
        values: values.map(|x| x.parse().unwrap_or(f64::NAN)).collect(),
        log: one.is_logarithmic(),
    }
}

/// Name of a column in words, with its unit.
fn label(sweep: &Sweep, column: &str) -> String {
    let unit = sweep
        .described(column)
        .map_or(String::new(), |[unit, _]| unit);
    Units::label(&column_in_words(column), &unit)
}

/// A field in words with its unit, `start velocity x (m/s)` for `start.velocity[0]`. The unit agrees with figures of
/// runs at both ends of the sweep.
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

/// Name of a column in words: `dissipated at the end` for `end.dissipated`, `t of the last event` for `events.-1.t`.
fn column_in_words(column: &str) -> String {
    let mut parts: Vec<&str> = column.split('.').collect();
    // Components have letters.
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

/// Title of a map of sheets: `sheet at the end` for the columns `end.mode` and `end.sign`; `None` for other columns.
fn where_sheets_are_told(columns: &[String]) -> Option<String> {
    let [mode, sign] = columns else {
        return None;
    };
    let of = mode.strip_suffix("mode")?;
    (sign.strip_suffix("sign") == Some(of)).then(|| column_in_words(&format!("{of}sheet")))
}

/// Name of the sheet of "mode sign"; other words stay unchanged.
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
