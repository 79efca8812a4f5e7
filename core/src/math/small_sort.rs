//! Insertion sort of a few items by a number.

use nalgebra::Complex;

/// Sorts a few items by a number, by insertion: the standard sort is compiled anew, at length, for every type.
pub fn sort_few<T>(items: &mut [T], key: impl Fn(&T) -> f64) {
    for i in 1..items.len() {
        let mut j = i;
        while j > 0 && key(&items[j]) < key(&items[j - 1]) {
            items.swap(j, j - 1);
            j -= 1;
        }
    }
}

/// Sorts eigenvalues of motions by frequency (imaginary part), then by rate (real part).
pub fn sort_eigenvalues(values: &mut [Complex<f64>]) {
    sort_few(values, |value| value.re);
    sort_few(values, |value| value.im);
}
