//! Results at every width of registers: the program, capped by `SNAPROD_REGISTERS`.

use crate::program::{Answer, Place, Table};
use crate::support::text_of;
use snaprod::math::registers::{VARIABLE, Width};

/// Scenes whose kernels work in wide registers, with the bound on the difference of two widths in units of each
/// column's largest value. The conditions of docs/accuracy.md times some rounding errors are a tenth of the bounds.
const SCENES: [(&str, &[&str], f64); 5] = [
    ("snap", &["run"], 1e-9),
    ("strip", &["run"], 1e-9),
    ("platform", &["run"], 1e-7),
    ("creep", &["run"], 1e-8),
    ("lateral", &["branch"], 1e-7),
];

fn at(width: &str, place: &Place, arguments: &[&str]) -> Answer {
    let mut command = place.command(arguments);
    Answer::of(command.env(VARIABLE, width).output().unwrap())
}

/// Catches a kernel wrong at one width alone, and a cap without effect: narrow registers must give the results of wide
/// ones, but not to the last digit of all of them.
#[test]
fn narrow_registers_give_what_wide_ones_do() {
    let mut apart = false;
    for (name, command, bound) in SCENES {
        let place = Place::new(&format!("widths-{name}"));
        place.write("scene.toml", &text_of(name));
        let tables: Vec<String> = (Width::ALL.iter())
            .map(|width| {
                let arguments = [command, &["scene.toml", "--out", "out"]].concat();
                let answer = at(width.name(), &place, &arguments);
                assert_eq!(
                    answer.code,
                    0,
                    "{name} at {}: {}",
                    width.name(),
                    answer.stderr
                );
                let file = ["out/trajectory.csv", "out/branch.csv"];
                file.map(|file| place.join(file))
                    .iter()
                    .find(|file| file.exists())
                    .map(std::fs::read_to_string)
            })
            .map(|table| table.expect("a table").unwrap())
            .collect();
        let [scalar, wide] = [0, tables.len() - 1].map(|k| Table::parse(&tables[k]));
        for (width, text) in Width::ALL.iter().zip(&tables) {
            apart |= text != &tables[0];
            let table = Table::parse(text);
            for column in &scalar.columns {
                let (Some(here), Some(there)) = (numbers(&table, column), numbers(&wide, column))
                else {
                    continue;
                };
                let largest = there
                    .iter()
                    .fold(1e-2_f64, |largest, x| largest.max(x.abs()));
                let (last, expected) = (here.last().unwrap(), there.last().unwrap());
                let off = (last - expected).abs() / largest;
                assert!(
                    off < bound,
                    "{name}, {column} at {}: {last} for {expected}",
                    width.name()
                );
            }
        }
    }
    // A processor with two or more lanes gives other last digits than scalar arithmetic.
    assert!(
        apart || Width::in_use() == Width::Scalar,
        "the cap changes no digit"
    );
}

/// Numbers of a column; `None` if it holds words or gaps.
fn numbers(table: &Table, column: &str) -> Option<Vec<f64>> {
    table
        .texts(column)
        .iter()
        .map(|text| text.parse().ok())
        .collect()
}

/// Catches a misspelt cap that is ignored, so that a bug report shows another width than stated.
#[test]
fn a_cap_that_is_no_width_is_refused() {
    let place = Place::new("widths-refused");
    place.write("scene.toml", &text_of("snap"));
    let answer = at("avx1024", &place, &["check", "scene.toml"]);
    assert_eq!(answer.code, 2);
    for word in [VARIABLE, "avx1024", "scalar", "avx2", "unset"] {
        assert!(answer.stderr.contains(word), "no {word}: {}", answer.stderr);
    }
    // The width in use never exceeds the cap of the whole suite.
    if let Some(cap) = Width::from_environment().unwrap() {
        assert!(Width::in_use() <= cap);
    }
}
