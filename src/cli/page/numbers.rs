//! Compact encoding of the numbers of a page, at the resolution of a screen.

use serde_json::{Value, json};

/// Largest whole number of the encoding; -TOP - 1 encodes a missing value.
const TOP: f64 = 32767.0;

/// Values of one range as whole numbers of 16 bits: value = mid + step q. The error is at most half a step, 1/131068 of
/// the range.
pub fn quantized(values: &[f64]) -> Value {
    let finite = values.iter().filter(|x| x.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
        (a.min(*x), b.max(*x))
    });
    let (mid, half) = if low <= high {
        (0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low)
    } else {
        (0.0, 0.0)
    };
    let step = if half > 0.0 { half / TOP } else { 1.0 };
    let whole = |x: &f64| {
        if x.is_finite() {
            ((x - mid) / step).round().clamp(-TOP, TOP) as i16
        } else {
            i16::MIN
        }
    };
    let bytes: Vec<u8> = values.iter().flat_map(|x| whole(x).to_le_bytes()).collect();
    json!({ "mid": mid, "step": step, "q": base64(&bytes) })
}

/// Components of unit vectors, in bytes: 127 encodes 1.
pub fn units(values: impl Iterator<Item = f64>) -> String {
    let bytes: Vec<u8> = values
        .map(|x| ((127.0 * x).round().clamp(-127.0, 127.0) as i8).to_le_bytes()[0])
        .collect();
    base64(&bytes)
}

/// A number rounded to 12 digits.
pub fn short(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// Base64 encoding of RFC 4648.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let byte = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let all = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            text.push(if i <= three.len() {
                char::from(LETTERS[(all >> (18 - 6 * i)) as usize & 63])
            } else {
                '='
            });
        }
    }
    text
}
