//! Printed report of `snaprod memory`.

use crate::cli::files::number;
use nalgebra::Matrix6;
use snaprod::scene::Units;
use snaprod::study::memory::{EndJoint, MemoryRecord, ROUNDING, RelaxationTerm};
use std::fmt::Write;
use std::path::Path;

/// Number of terms of the relaxation function printed.
const SHOWN: usize = 12;
/// Least share of a printed term.
const FAINT: f64 = 1e-4;

/// Error of the kernel above which the report has a remark.
const COARSE: f64 = 1e-8;

/// Number with six digits, enough for comparison.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) {
        number(rounded)
    } else {
        format!("{rounded:e}")
    }
}

/// The report.
pub fn text(response: &MemoryRecord, times: &[f64], out: Option<&Path>) -> String {
    let kernel = &response.kernel;
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        let _ = writeln!(text, "{}", format!("{name:<13}{value}").trim_end());
    };
    line("end", described(response.end));
    line("", "linearised about the straight unloaded rod");
    if response.nonlinear {
        line(
            "note",
            "nonlinear friction is replaced by its viscosity in the straight rod at rate zero",
        );
    }
    let found = kernel.commuting();
    line(
        "(6.15)",
        &if found.holds {
            format!("C L = L C(end) holds: relative defect {:.1e}", found.defect)
        } else {
            format!(
                "C L = L C(end) does not hold: relative defect {}, largest at s = {}{}",
                short(found.defect),
                short(found.at),
                Units::suffix(response.units.length())
            )
        },
    );
    line("", &response.meaning());
    line("", "");
    for row in directions(response) {
        line("", &row);
    }
    let coupled: Vec<String> = [
        ("spring", kernel.relaxed()),
        ("R(0)", kernel.glassy()),
        ("dashpot", kernel.instantaneous()),
    ]
    .iter()
    .filter_map(|(name, matrix)| coupled(response, name, matrix))
    .collect();
    if !coupled.is_empty() {
        line(
            "",
            "each with the other components held; off-diagonal entries:",
        );
    }
    for row in &coupled {
        line("", row);
    }
    line("", "");
    if response.forgets_all() {
        for &i in &response.shown {
            line("equivalent", &equation(response, i));
        }
    } else {
        line(
            "memory",
            "w = A_end V + int R(t - tau) V(tau) dtau,  R(t) = spring + sum of weight exp(-rate t)",
        );
        for row in terms(response) {
            line("", &row);
        }
    }
    line(
        "accuracy",
        &format!("{:.0e}, relative", kernel.accuracy().max(f64::EPSILON)),
    );
    if kernel.accuracy() > COARSE {
        line(
            "note",
            "the section varies along the rod faster than the nodes resolve: the rates above approximate a continuous spectrum",
        );
    }
    if let Some(out) = out {
        line(
            "written",
            &format!(
                "{} times from {} to {}{} to {}",
                times.len(),
                short(times[0]),
                short(times[times.len() - 1]),
                Units::suffix(response.units.time()),
                out.display()
            ),
        );
    }
    text
}

fn described(end: EndJoint) -> &'static str {
    match end {
        EndJoint::Planar => {
            "a mass on an end that is free to turn, in the plane: displacement y across the rod, force n_y"
        }
        EndJoint::Ball => {
            "a mass on an end that is free to turn: displacement r, force n along d1, d2, d3 of the clamp"
        }
        EndJoint::Welded => {
            "a body welded to the end: rotation z, displacement r, couple m, force n along d1, d2, d3 of the clamp"
        }
    }
}

/// Lines of cells in aligned columns.
fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |k: usize| {
        rows.iter()
            .filter_map(|row| Some(row.get(k)?.chars().count()))
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    rows.iter()
        .map(|row| {
            let cells = row.iter().zip(&widths);
            cells
                .map(|(cell, width)| format!("{cell:<width$}  "))
                .collect::<String>()
        })
        .collect()
}

fn directions(response: &MemoryRecord) -> Vec<String> {
    let kernel = &response.kernel;
    let mut rows = vec![
        [
            "",
            "spring",
            "R(0)",
            "dashpot A_end",
            "dashpot/spring",
            "forgotten of R(0)",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for &i in &response.shown {
        let spring = kernel.relaxed()[(i, i)];
        let dashpot = kernel.instantaneous()[(i, i)];
        let stiffness = Units::suffix(response.unit(i, i, false));
        let forgotten = response.forgotten(i);
        rows.push(vec![
            response.name(i).to_owned(),
            format!("{}{stiffness}", short(spring)),
            format!("{}{stiffness}", short(kernel.glassy()[(i, i)])),
            format!(
                "{}{}",
                short(dashpot),
                Units::suffix(response.dashpot_unit(i, i))
            ),
            format!(
                "{}{}",
                short(dashpot / spring),
                Units::suffix(response.units.time())
            ),
            if forgotten > ROUNDING {
                format!("{}%", short(100.0 * forgotten))
            } else {
                "nothing".to_owned()
            },
        ]);
    }
    aligned(&rows)
}

/// Text on the off-diagonal entries, if any.
fn coupled(response: &MemoryRecord, name: &str, matrix: &Matrix6<f64>) -> Option<String> {
    let mut entries = Vec::new();
    for (k, &i) in response.shown.iter().enumerate() {
        for &j in &response.shown[k + 1..] {
            if counts(matrix, i, j) {
                let unit = match name {
                    "dashpot" => response.dashpot_unit(i, j),
                    _ => response.unit(i, j, false),
                };
                entries.push(format!(
                    "{} {}{}",
                    response.entry(i, j),
                    short(matrix[(i, j)]),
                    Units::suffix(unit)
                ));
            }
        }
    }
    (!entries.is_empty()).then(|| format!("{name}: {}", entries.join(", ")))
}

/// True if an entry exceeds rounding.
fn counts(matrix: &Matrix6<f64>, i: usize, j: usize) -> bool {
    matrix[(i, j)].abs() > ROUNDING * (matrix[(i, i)] * matrix[(j, j)]).sqrt()
}

/// A component of the wrench in terms of spring and dashpot.
fn equation(response: &MemoryRecord, i: usize) -> String {
    let kernel = &response.kernel;
    let mut text = format!("{} =", response.load(i));
    let mut first = true;
    for (matrix, rate) in [(kernel.relaxed(), false), (kernel.instantaneous(), true)] {
        for &j in response.shown.iter().filter(|&&j| counts(&matrix, i, j)) {
            let x = matrix[(i, j)];
            let sign = match (x < 0.0, first) {
                (true, _) => " -",
                (false, true) => "",
                (false, false) => " +",
            };
            let name = response.name(j);
            let of = if rate {
                format!("d{name}/dt")
            } else {
                name.to_owned()
            };
            let _ = write!(text, "{sign} {} {of}", short(x.abs()));
            first = false;
        }
    }
    text
}

fn terms(response: &MemoryRecord) -> Vec<String> {
    let mut strongest: Vec<&RelaxationTerm> = response.terms.iter().collect();
    strongest.sort_by(|a, b| b.share.total_cmp(&a.share));
    let felt = strongest.iter().filter(|term| term.share > FAINT).count();
    // At least one term is printed, even a small one.
    strongest.truncate(felt.clamp(1, SHOWN));
    strongest.sort_by(|a, b| a.rate.total_cmp(&b.rate));
    let remembering: Vec<usize> = (response.shown.iter().copied())
        .filter(|&i| response.forgotten(i) > ROUNDING)
        .collect();
    let mut head = vec!["rate".to_owned(), "time".to_owned()];
    head.extend((remembering.iter()).map(|&i| format!("weight {}", response.entry(i, i))));
    head.push("share of R(0)".to_owned());
    let mut rows = vec![head];
    for term in &strongest {
        let mut row = vec![
            short(term.rate),
            format!(
                "{}{}",
                short(term.rate.recip()),
                Units::suffix(response.units.time())
            ),
        ];
        let glassy = response.kernel.glassy();
        row.extend(remembering.iter().map(|&i| {
            let weight = term.weight[(i, i)];
            if weight > ROUNDING * glassy[(i, i)] {
                short(weight)
            } else {
                "0".to_owned()
            }
        }));
        row.push(format!("{}%", short(100.0 * term.share)));
        rows.push(row);
    }
    let mut lines = aligned(&rows);
    let left = response.terms.len() - strongest.len();
    if left > 0 {
        lines.push(format!("and {left} weaker terms (--json has them all)"));
    }
    lines
}
