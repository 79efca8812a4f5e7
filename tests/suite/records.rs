//! Tables of records.

use snaprod::study::{Cell, Column, Csv, Sink, Table};

fn table() -> Table {
    Table::new(
        "branch",
        vec![
            Column::reals("x", "m", "position of the end along x"),
            Column::integers("index", "Morse index"),
            Column::words("label", "label of a special point"),
        ],
    )
}

/// Catches a streamed table that differs from the table in memory, and a number that does not read back exactly.
/// Catches a missing value that is printed, and a word that breaks its line.
#[test]
fn a_table_streams_as_it_is_kept() {
    let rows: [[Cell; 3]; 4] = [
        [0.1f64.into(), 2usize.into(), "SC1".into()],
        [(-0.0).into(), Cell::Missing, Cell::Missing],
        [1e-300.into(), None::<usize>.into(), "a, \"b\"".into()],
        [Cell::Missing, 0usize.into(), "".into()],
    ];
    let mut kept: Vec<Table> = Vec::new();
    let number = kept.begin(table()).unwrap();
    let mut csv = Csv::new(Vec::new(), &table()).unwrap();
    for row in &rows {
        kept.row(number, row).unwrap();
        csv.row(row).unwrap();
    }
    let streamed = String::from_utf8(csv.finish().unwrap()).unwrap();
    assert_eq!(
        streamed,
        "x,index,label\n0.1,2,SC1\n0.0,,\n1e-300,,\"a, \"\"b\"\"\"\n,0,\n"
    );
    assert_eq!(kept[0].csv(), streamed);
    assert_eq!((kept[0].rows(), kept[0].reals("x")[2]), (4, 1e-300));
    let json = serde_json::to_value(&kept[0]).unwrap();
    assert_eq!(json["columns"][1]["values"][0], 2);
    assert_eq!(json["columns"][0]["unit"], "m");
}

/// Catches a mismatched row that is accepted, or partly stored.
#[test]
fn a_row_that_does_not_fit_is_refused() {
    let mut table = table();
    assert!(table.push(&[1.0.into()]).is_err());
    assert!(table.push(&[1.0.into(), "x".into(), "y".into()]).is_err());
    assert_eq!(table.rows(), 0);
}
