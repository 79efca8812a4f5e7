//! Numbers of a rod in space, and how they may vary along it.

use super::Along;
use super::fault::FaultKind;
use super::reader::{Need, Reader, Rule, Short, Spec, Table};
use toml::Spanned;
use toml::de::DeValue;

use Need::Required;

const ALONG: Spec = Spec {
    name: "along",
    fields: &["s", "values", "polynomial"],
    barred: &[],
};

/// What [`along`] accepts, for stiffnesses.
pub(super) const ALONG_WORDS: &str = "a number > 0, or a table such as { s = [0.0, 1.0], values = [1.0, 0.5] } or \
                           { polynomial = [1.0, -0.5] }";

/// Sizes within which no scale made of them over- or underflows.
pub(super) const SIZES: (f64, f64) = (1e-40, 1e40);
/// A number whose square is one.
pub(super) const VALUE: Rule = Rule {
    allowed: "a finite number",
    holds: |x| x.abs() <= SIZES.1,
    hint: |x| {
        let large = x.is_finite() && !(x.abs() <= SIZES.1);
        large.then_some("its size is above 1e40: choose units nearer to the rod's size")
    },
};
/// A number > 0 from which scales are made.
pub(super) const SIZE: Rule = Rule {
    allowed: "a finite number > 0",
    holds: |x| (SIZES.0..=SIZES.1).contains(&x),
    hint: |x| {
        let extreme = 0.0 < x && x < f64::INFINITY && !(SIZES.0..=SIZES.1).contains(&x);
        extreme.then_some("it is not in [1e-40, 1e40]: choose units nearer to the rod's size")
    },
};
pub(super) const STIFFNESS: Rule = Rule {
    allowed: SIZE.allowed,
    holds: SIZE.holds,
    hint: |x| match x {
        0.0 => Some(
            "with a zero stiffness the load determines no strain; a strain that cannot occur is \"rigid\"",
        ),
        _ if x < 0.0 => Some("with a negative stiffness the law is not convex"),
        f64::INFINITY => Some("a strain that cannot occur is \"rigid\""),
        _ => (SIZE.hint)(x),
    },
};
/// Relative difference of numbers meant to be equal that counts as rounding.
pub(super) const ROUNDING: f64 = 1e-12;

/// A number, or how it varies along the rod. Every value satisfies `rule`.
pub(super) fn along<'a>(
    reader: &'a Reader<'a>,
    field: &str,
    value: &'a Spanned<DeValue<'a>>,
    rule: Rule,
    length: Option<f64>,
) -> Option<Along> {
    if !value.get_ref().is_table() {
        return reader.number(field, value, rule).map(Along::Constant);
    }
    let table = reader.table(field, value, &ALONG, &[], ALONG_WORDS)?;
    if table.get("polynomial").is_none() {
        return by_points(&table, rule, length);
    }
    for name in ["s", "values"] {
        table.conflict(name, &["polynomial"], "keep one of the two forms");
    }
    if table.get("s").is_some() || table.get("values").is_some() {
        return None;
    }
    let allowed = "an array of 1 to 16 finite numbers, c0 + c1 x + ..., x = s / length";
    table.read(
        "polynomial",
        allowed,
        Required("polynomial = [1.0, -0.5]"),
        |field, value| {
            let number = |field: &str, value: &_| reader.number(field, value, VALUE);
            let list = reader.list(field, value, allowed, number)?;
            if !(1..=16).contains(&list.len()) {
                let hint = Some(format!("it has {} elements", list.len()));
                reader.fault(FaultKind::Value, field, value.span(), allowed, hint);
                return None;
            }
            let polynomial: Vec<f64> = list.into_iter().collect::<Option<_>>()?;
            // Only rules of numbers > 0 are more than bounds.
            if !(rule.holds)(-1.0)
                && let Some(x) = not_positive(&polynomial)
            {
                let hint = Some(format!("it is not > 0 at s / length = {x:.6}"));
                let allowed = "> 0 everywhere on the rod, 0 <= s / length <= 1";
                reader.fault(FaultKind::Value, field, value.span(), allowed, hint);
                return None;
            }
            Some(Along::Polynomial { polynomial })
        },
    )
}

fn by_points(table: &Table, rule: Rule, length: Option<f64>) -> Option<Along> {
    let reader = table.reader;
    let s_words = "an array of arclengths that grow from 0 to the length of the rod, at least two";
    let s = table.read("s", s_words, Required("s = [0.0, 1.0]"), |field, value| {
        let number = |field: &str, value: &_| reader.number(field, value, VALUE);
        let list = reader.list(field, value, s_words, number)?;
        let mut s: Vec<f64> = list.into_iter().collect::<Option<_>>()?;
        let grows = s.len() >= 2 && s.windows(2).all(|pair| pair[0] < pair[1]);
        let wrong = match (s.first().copied(), s.last().copied(), length) {
            (Some(first), Some(last), _) if !grows || first != 0.0 => Some(format!(
                "it has {} elements, from {} to {}; a jump is a short ramp",
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
            reader.fault(FaultKind::Value, field, value.span(), s_words, wrong);
            return None;
        }
        if let (Some(last), Some(length)) = (s.last_mut(), length) {
            *last = length;
        }
        Some(s)
    });
    let allowed = "an array of numbers, one for each of s";
    let values = table.read(
        "values",
        allowed,
        Required("values = [1.0, 0.5]"),
        |field, value| {
            let number = |field: &str, value: &_| reader.number(field, value, rule);
            let list = reader.list(field, value, allowed, number)?;
            let values: Vec<f64> = list.into_iter().collect::<Option<_>>()?;
            match &s {
                Some(s) if s.len() != values.len() => {
                    let hint = format!("it has {} elements, s has {}", values.len(), s.len());
                    reader.fault(FaultKind::Value, field, value.span(), allowed, Some(hint));
                    None
                }
                _ => Some(values),
            }
        },
    );
    Some(Along::Table {
        s: s?,
        values: values?,
    })
}

/// Somewhere in [0, 1] where the polynomial is not > 0, if there is such a place.
///
/// It is > 0 on an interval where its Bernstein coefficients are; else the interval is halved (de Casteljau).
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
        // Nearer to a zero than rounding lets us see.
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
