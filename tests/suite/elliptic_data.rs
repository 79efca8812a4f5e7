//! The reference data of the elliptic kernel, and the error of a computed value against it.

use snaprod::math::DomainError;
use snaprod::math::{elliptic as e, jacobi as j};
use std::collections::BTreeMap;

/// One value of tests/data/elliptic.csv (columns: see tools/elliptic_reference.py).
pub struct Row {
    pub function: String,
    pub region: String,
    pub input: [f64; 3],
    pub value: f64,
    pub rest: f64,
    pub slope: f64,
}

/// Rows by (function, region) in the order of the file.
pub fn load() -> Vec<((String, String), Vec<Row>)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/elliptic.csv");
    let text = std::fs::read_to_string(path).expect("tests/data/elliptic.csv is part of the tree");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("function,region,a,b,c,value,rest,slope"));
    let mut groups: Vec<((String, String), Vec<Row>)> = Vec::new();
    let mut index = BTreeMap::new();
    for line in lines {
        let row = parse(line).unwrap_or_else(|| panic!("bad line: {line}"));
        let key = (row.function.clone(), row.region.clone());
        let at = *index.entry(key.clone()).or_insert_with(|| {
            groups.push((key, Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push(row);
    }
    assert_eq!(groups.len(), 146, "groups of function and region");
    for (key, rows) in &groups {
        assert!(rows.len() >= 25, "{key:?}: only {} points", rows.len());
    }
    groups
}

fn parse(line: &str) -> Option<Row> {
    let (function, line) = line.split_once(",\"")?;
    let (region, line) = line.split_once("\",")?;
    let numbers: Vec<f64> = line
        .split(',')
        .map(|s| s.parse().ok())
        .collect::<Option<_>>()?;
    let &[a, b, c, value, rest, slope] = &numbers[..] else {
        return None;
    };
    Some(Row {
        function: function.into(),
        region: region.into(),
        input: [a, b, c],
        value,
        rest,
        slope,
    })
}

/// Our value of the row's function.
pub fn ours(row: &Row) -> Result<f64, DomainError> {
    let [a, b, c] = row.input;
    match row.function.as_str() {
        "K" => e::complete_k(a),
        "E" => e::complete_e(a),
        "B" => e::complete_b(a),
        "K_kc" => e::complete(a).map(|v| v.k_kc),
        "E_kc" => e::complete(a).map(|v| v.e_kc),
        "F(phi)" => e::incomplete_f(a, b),
        "E(phi)" => e::incomplete_e(a, b),
        "B(phi)" => e::incomplete_b(a, b),
        "F_kc(phi)" => e::incomplete(a, b).map(|v| v.f_kc),
        "E_kc(phi)" => e::incomplete(a, b).map(|v| v.e_kc),
        "sn" => j::jacobi(a, b).map(|v| v.sn),
        "cn" => j::jacobi(a, b).map(|v| v.cn),
        "dn" => j::jacobi(a, b).map(|v| v.dn),
        "am" => j::jacobi(a, b).map(|v| v.am),
        "cd" => j::jacobi(a, b).map(|v| v.cd()),
        "sd" => j::jacobi(a, b).map(|v| v.sd()),
        "RF" => e::carlson_rf(a, b, c),
        "RD" => e::carlson_rd(a, b, c),
        other => panic!("no such function: {other}"),
    }
}

impl Row {
    /// True if errors are measured by the conditioning in u.
    pub fn is_conditioned(&self) -> bool {
        matches!(
            self.function.as_str(),
            "sn" | "cn" | "dn" | "am" | "cd" | "sd"
        )
    }

    /// The error in ulp of the true value; for Jacobi functions f of u, in eps (|f| + |u f'(u)|).
    /// A wrong sign or NaN is an infinite error.
    pub fn error(&self, got: f64) -> f64 {
        if got.is_nan() || got.signum() != self.value.signum() {
            return f64::INFINITY;
        }
        let unit = if self.is_conditioned() {
            f64::EPSILON * (self.value.abs() + self.slope)
        } else {
            ulp(self.value)
        };
        ((got - self.value) - self.rest).abs() / unit
    }
}

fn ulp(x: f64) -> f64 {
    let x = x.abs();
    f64::from_bits(x.to_bits() + 1) - x
}
