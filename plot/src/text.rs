//! Formatting of numbers, and the width of text.

/// Advance widths of U+0020..U+007E in DejaVu Sans, thousandths of the font size.
#[rustfmt::skip]
const ASCII: [u16; 95] = [
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636,
    636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632,
    575, 775, 752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685,
    611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579,
    278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
];

/// The width of `text` at font size `size`: exact for ASCII without kerning, close for the rest.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    let thousandths: u32 = text
        .chars()
        .map(|ch| match ch {
            ' '..='~' => u32::from(ASCII[ch as usize - 32]),
            '⁰'..='ₜ' | '²' | '³' | '¹' => 410,
            '−' => 838,
            _ => 640,
        })
        .sum();
    size * f64::from(thousandths) / 1000.0
}

/// `value` with `decimals` digits after the point, a real minus sign, and no minus before zero.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        None => text,
        Some(rest) if rest.chars().all(|ch| ch == '0' || ch == '.') => rest.to_string(),
        Some(rest) => format!("−{rest}"),
    }
}

/// A whole number as superscript.
pub(crate) fn superscript(n: i32) -> String {
    n.to_string()
        .chars()
        .map(|ch| match ch {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            // U+2070 is the superscript nought; 4..9 follow at their offsets.
            digit => char::from_u32(0x2070 + (digit as u32 - '0' as u32)).unwrap_or(digit),
        })
        .collect()
}

/// 10 to the power n; 1 and 10 are written out.
pub(crate) fn power_of_ten(n: i32) -> String {
    match n {
        0 => "1".to_string(),
        1 => "10".to_string(),
        _ => format!("10{}", superscript(n)),
    }
}

/// `mantissa * 10^n` for axes whose numbers are too large or too small to write out.
pub(crate) fn scientific(value: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let power = format!("10{}", superscript(exponent.parse().unwrap_or(0)));
    match mantissa {
        "1" => power,
        "-1" => format!("−{power}"),
        _ => format!("{}·{power}", mantissa.replace('-', "−")),
    }
}

/// A number with at most `digits` significant digits, without a needless fraction: 0.05, but 10⁻⁴.
pub(crate) fn short(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    if rounded == 0.0 || (0.01..1e4).contains(&rounded.abs()) {
        format!("{rounded}").replace('-', "−")
    } else {
        scientific(rounded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_as_in_a_journal() {
        assert_eq!(fixed(-0.25, 2), "−0.25");
        assert_eq!(fixed(-1e-9, 1), "0.0");
        assert_eq!(power_of_ten(-12), "10⁻¹²");
        assert_eq!(power_of_ten(0), "1");
        assert_eq!(scientific(-2.5e-7), "−2.5·10⁻⁷");
        assert!(width("mm", 10.0) > width("ii", 10.0));
    }
}
