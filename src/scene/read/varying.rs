//! Numbers of a rod in space that may vary along the rod.

use super::fields::ALONG;
use super::phrases::Short;
use super::ranges::{Rule, VALUE};
use super::reader::Reader;
use super::table::{Absent, Table};
use crate::error::Result;
use crate::scene::{Along, FaultKind};
use toml::Spanned;
use toml::de::DeValue;

/// Bound on the number of coefficients of a polynomial.
const COEFFICIENTS: usize = 16;

/// Forms accepted by [`along`] for stiffnesses.
pub(super) const ALONG_WORDS: &str = "a number > 0, or a table such as { s = [0.0, 1.0], values = [1.0, 0.5] } or \
                           { polynomial = [1.0, -0.5] }";

/// Forms accepted by [`along`] for sizes of a section.
pub(super) const SIZE_WORDS: &str = "a number > 0, or a table such as { s = [0.0, 1.0], values = [0.02, 0.01] } or \
                           { polynomial = [0.02, -0.01] }";

/// Relative difference of numbers meant to be equal that counts as rounding.
pub(super) const ROUNDING: f64 = 1e-12;

/// Reads a number, or its variation along the rod. Every value must satisfy `rule`.
pub(super) fn along<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rule: &Rule,
    length: Option<f64>,
) -> Option<Along> {
    if !value.get_ref().is_table() {
        return reader.number(field, value, rule).map(Along::from);
    }
    let table = reader.table(field, value, &ALONG, ALONG_WORDS)?;
    if table.get("polynomial").is_none() {
        return by_points(&table, rule, length);
    }
    for name in ["s", "values"] {
        table.conflict(name, &["polynomial"], "keep one of the two forms");
    }
    if table.get("s").is_some() || table.get("values").is_some() {
        return None;
    }
    table.read("polynomial", "", Absent::Fault, |field, value| {
        let polynomial = polynomial(reader, field, value, &VALUE)?;
        // For a rule without a sign condition the bounds on the coefficients suffice.
        if !(rule.holds)(-1.0)
            && let Some(x) = not_positive(&polynomial)
        {
            let hint = Some(format!("it is not > 0 at s / length = {x:.6}"));
            let allowed = "> 0 everywhere on the rod, 0 <= s / length <= 1";
            return reader.refuse(FaultKind::Value, field, value, allowed, hint);
        }
        made(reader, field, value, Along::polynomial(&polynomial))
    })
}

/// Unwraps the library's result; reports its error as a fault.
fn made<T>(reader: &Reader, field: &str, value: &Spanned<DeValue>, made: Result<T>) -> Option<T> {
    made.map_err(|error| {
        let allowed = "a number, or how it varies along the rod";
        reader.fault(FaultKind::Value, field, value, allowed, error.to_string());
    })
    .ok()
}

/// Reads a polynomial in s/length.
pub(super) fn polynomial(
    reader: &Reader,
    field: &str,
    value: &Spanned<DeValue>,
    rule: &Rule,
) -> Option<Vec<f64>> {
    let allowed = "an array of 1 to 16 finite numbers, c0 + c1 x + ..., x = s / length";
    let number = |field: &str, value: &_| reader.number(field, value, rule);
    let list = reader.list(field, value, allowed, &number)?;
    if !(1..=COEFFICIENTS).contains(&list.len()) {
        let hint = Some(format!("it has {} elements", list.len()));
        return reader.refuse(FaultKind::Value, field, value, allowed, hint);
    }
    list.into_iter().collect()
}

fn by_points(table: &Table, rule: &Rule, length: Option<f64>) -> Option<Along> {
    let reader = table.reader;
    let s_words = "an array of arclengths that grow from 0 to the length of the rod, at least two; one that stands twice is a jump";
    let s = table.read("s", s_words, Absent::Fault, |field, value| {
        let mut s = reader.numbers(field, value, s_words, &VALUE)?;
        // A place that stands twice is a jump, inside the rod.
        let grows = s.len() >= 2
            && s.windows(2).all(|pair| pair[0] <= pair[1])
            && s.windows(3).all(|three| three[0] < three[2])
            && s[0] < s[1]
            && s[s.len() - 2] < s[s.len() - 1];
        let wrong = match (s.first().copied(), s.last().copied(), length) {
            (Some(first), Some(last), _) if !grows || first != 0.0 => Some(format!(
                "it has {} elements, from {} to {}; a jump, s twice, lies inside the rod",
                s.len(),
                Short(first),
                Short(last)
            )),
            (_, Some(last), Some(length)) if !((last - length).abs() <= ROUNDING * length) => Some(
                format!("it ends at {}, the rod at {}", Short(last), Short(length)),
            ),
            (Some(_), ..) => None,
            _ => Some("it is empty".to_owned()),
        };
        if wrong.is_some() {
            return reader.refuse(FaultKind::Value, field, value, s_words, wrong);
        }
        if let (Some(last), Some(length)) = (s.last_mut(), length) {
            *last = length;
        }
        Some(s)
    });
    if table.has("pieces") {
        return by_pieces(table, rule, s?);
    }
    let allowed = "an array of numbers, one for each of s";
    let values = table.read("values", allowed, Absent::Fault, |field, value| {
        let values = reader.numbers(field, value, allowed, rule)?;
        match &s {
            Some(s) if s.len() != values.len() => {
                let hint = format!("it has {} elements, s has {}", values.len(), s.len());
                reader.refuse(FaultKind::Value, field, value, allowed, hint)
            }
            _ => Some(values),
        }
    });
    let nodes: Vec<_> = s?.into_iter().zip(values?).collect();
    let value = table.get("s")?;
    made(reader, &table.field("s"), value, Along::table(&nodes))
}

/// Polynomials between the places `s`, of numbers that may have any sign.
fn by_pieces(table: &Table, rule: &Rule, s: Vec<f64>) -> Option<Along> {
    let reader = table.reader;
    let words = "an array of polynomials [c0, c1, ...], one between each two neighbours of s";
    if table.has("values") {
        table.conflict("values", &["pieces"], "keep one of them");
        return None;
    }
    if !(rule.holds)(-1.0) {
        let hint = "it is for curvature and twist; here give values, or a polynomial";
        return table.refuse(FaultKind::Conflict, "pieces", "left out here", hint);
    }
    table.read("pieces", words, Absent::Fault, |field, value| {
        let one = |field: &str, value: &_| polynomial(reader, field, value, &VALUE);
        let pieces: Vec<Vec<f64>> = reader.all(field, value, words, &one)?;
        made(reader, field, value, Along::pieces_between(&s, pieces))
    })
}

/// A point of [0, 1] at which the polynomial is not > 0; `None` if there is no such point.
///
/// The polynomial is > 0 on an interval if its Bernstein coefficients are; otherwise the interval is halved (de
/// Casteljau).
pub(super) fn not_positive(polynomial: &[f64]) -> Option<f64> {
    let n = polynomial.len() - 1;
    let binomial =
        |n: usize, k: usize| (0..k).fold(1.0, |b, i| b * (n - i) as f64 / (i + 1) as f64);
    let coefficient = |i: usize| {
        let term = |k: usize| polynomial[k] * binomial(i, k) / binomial(n, k);
        (0..=i).map(term).sum::<f64>()
    };
    let mut parts = vec![(0.0, 1.0, (0..=n).map(coefficient).collect::<Vec<f64>>())];
    while let Some((a, b, right)) = parts.pop() {
        if !(right[0] > 0.0) {
            return Some(a);
        }
        if !(right[n] > 0.0) {
            return Some(b);
        }
        if right.iter().all(|c| *c > 0.0) {
            continue;
        }
        let middle = 0.5 * (a + b);
        // Rounding hides the sign this close to a zero.
        if b - a < 1e-12 {
            return Some(middle);
        }
        let (mut left, mut right) = (vec![right[0]], right);
        for step in 1..=n {
            for i in 0..=n - step {
                right[i] = 0.5 * (right[i] + right[i + 1]);
            }
            left.push(right[0]);
        }
        parts.push((middle, b, right));
        parts.push((a, middle, left));
    }
    None
}
