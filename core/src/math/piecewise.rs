//! Polynomials piece by piece on [0, 1], such as the area of a section along a rod.

/// A function on [0, 1] that is a polynomial on each piece. At a jump the piece that begins there holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Piecewise(Vec<(f64, Vec<f64>)>);

impl Piecewise {
    /// Pieces (from, c_0, c_1, ...), each in powers of x - `from`, by growing `from`; the first begins at 0.
    pub fn new(pieces: Vec<(f64, Vec<f64>)>) -> Self {
        Self(pieces)
    }

    /// The pieces.
    pub fn pieces(&self) -> &[(f64, Vec<f64>)] {
        &self.0
    }

    /// The value at x.
    pub fn at(&self, x: f64) -> f64 {
        let (from, coefficients) = self.piece(x);
        let rest = coefficients.iter().rev();
        rest.fold(0.0, |sum, c| sum * (x - from) + c)
    }

    /// Integral from 0 to 1.
    pub fn integral(&self) -> f64 {
        let ends = self.0.iter().skip(1).map(|piece| piece.0).chain([1.0]);
        let each = self.0.iter().zip(ends).map(|((from, coefficients), to)| {
            let (rest, h) = (coefficients.iter().enumerate().rev(), to - from);
            h * rest.fold(0.0, |sum, (k, c)| sum * h + c / (k + 1) as f64)
        });
        each.sum()
    }

    /// This function times a number.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        let all = self.0.iter_mut().flat_map(|piece| &mut piece.1);
        all.for_each(|c| *c *= factor);
        self
    }

    /// The function of 1 - x.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let ends = self.0.iter().skip(1).map(|piece| piece.0).chain([1.0]);
        let pieces = self.0.iter().zip(ends).map(|((from, _), to)| {
            // The piece in powers of x - to; odd powers change their sign.
            let mut c = self.shifted(*from, to);
            for c in c.iter_mut().skip(1).step_by(2) {
                *c = -*c;
            }
            (1.0 - to, c)
        });
        let mut pieces: Vec<_> = pieces.collect();
        pieces.reverse();
        Self(pieces)
    }

    /// Sum of two functions.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        self.combined(other, |a, b| {
            let c = |k: usize, of: &[f64]| of.get(k).copied().unwrap_or(0.0);
            (0..a.len().max(b.len()))
                .map(|k| c(k, a) + c(k, b))
                .collect()
        })
    }

    /// Product of two functions.
    #[must_use]
    pub fn by(&self, other: &Self) -> Self {
        self.combined(other, |a, b| {
            let mut product = vec![0.0; a.len() + b.len() - 1];
            for (i, a) in a.iter().enumerate() {
                for (j, b) in b.iter().enumerate() {
                    product[i + j] += a * b;
                }
            }
            product
        })
    }

    fn combined(&self, other: &Self, of: impl Fn(&[f64], &[f64]) -> Vec<f64>) -> Self {
        let both = self.0.iter().chain(&other.0);
        let mut places: Vec<f64> = both.map(|piece| piece.0).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let piece = |from: f64| (from, of(&self.about(from), &other.about(from)));
        Self(places.into_iter().map(piece).collect())
    }

    fn piece(&self, x: f64) -> &(f64, Vec<f64>) {
        let later = self.0[1..].iter().rposition(|piece| piece.0 <= x);
        &self.0[later.map_or(0, |k| k + 1)]
    }

    /// Coefficients in powers of x - `place` of the piece there, by the repeated scheme of Horner.
    fn about(&self, place: f64) -> Vec<f64> {
        self.shifted(place, place)
    }

    /// Coefficients in powers of x - `place` of the piece at x = `of`.
    fn shifted(&self, of: f64, place: f64) -> Vec<f64> {
        let (from, coefficients) = self.piece(of);
        let mut c = coefficients.clone();
        for first in 0..c.len().saturating_sub(1) {
            for k in (first..c.len() - 1).rev() {
                c[k] += c[k + 1] * (place - from);
            }
        }
        c
    }
}
