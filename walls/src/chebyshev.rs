//! Functions of one number as Chebyshev series, piece by piece, with their derivatives.

use snaprod_core::{Error, Result};

/// Terms of the series of one piece.
const TERMS: usize = 24;
/// Halvings of an interval before a function counts as not smooth.
const HALVINGS: u32 = 12;

/// A smooth function on an interval, as Chebyshev series on pieces of the interval.
#[derive(Debug, Clone)]
pub(crate) struct Pieces {
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone)]
struct Piece {
    centre: f64,
    half: f64,
    terms: [f64; TERMS],
}

impl Pieces {
    /// Interpolates `f` on [`from`, `to`] at Chebyshev points. Intervals are halved until the last three terms of
    /// each series are below `error`.
    ///
    /// # Errors
    /// Those of `f`; a function that is not smooth.
    pub fn new(
        (from, to): (f64, f64),
        error: f64,
        f: &mut dyn FnMut(f64) -> Result<f64>,
    ) -> Result<Self> {
        let mut pieces = Vec::new();
        let mut open = vec![(from, to, HALVINGS)];
        while let Some((a, b, halvings)) = open.pop() {
            let piece = Piece::new(a, b, f)?;
            if piece.terms[TERMS - 3..]
                .iter()
                .all(|term| term.abs() < error)
            {
                pieces.push(piece);
                continue;
            }
            if halvings == 0 {
                return Err(Error::no_convergence(format!(
                    "no table of error {error} was found near {a}"
                )));
            }
            let middle = 0.5 * (a + b);
            open.push((middle, b, halvings - 1));
            open.push((a, middle, halvings - 1));
        }
        Ok(Self { pieces })
    }

    /// Value and derivative at `x`; outside of the interval the nearest piece is continued.
    #[inline]
    pub fn at(&self, x: f64) -> (f64, f64) {
        let beyond = |piece: &&Piece| x <= piece.centre + piece.half;
        let last = self.pieces.len() - 1;
        let piece = self
            .pieces
            .iter()
            .find(beyond)
            .unwrap_or(&self.pieces[last]);
        piece.at(x)
    }
}

impl Piece {
    fn new(a: f64, b: f64, f: &mut dyn FnMut(f64) -> Result<f64>) -> Result<Self> {
        let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
        let angle = |j: usize| std::f64::consts::PI * (j as f64 + 0.5) / TERMS as f64;
        let mut values = [0.0; TERMS];
        for (j, value) in values.iter_mut().enumerate() {
            *value = f(centre + half * angle(j).cos())?;
        }
        let term = |k: usize| {
            let sum: f64 = (0..TERMS)
                .map(|j| values[j] * (k as f64 * angle(j)).cos())
                .sum();
            sum * if k == 0 { 1.0 } else { 2.0 } / TERMS as f64
        };
        Ok(Self {
            centre,
            half,
            terms: std::array::from_fn(term),
        })
    }

    /// Clenshaw's recurrence, differentiated.
    #[inline]
    fn at(&self, x: f64) -> (f64, f64) {
        let t = (x - self.centre) / self.half;
        let (mut b1, mut b2, mut d1, mut d2) = (0.0, 0.0, 0.0, 0.0);
        for term in self.terms[1..].iter().rev() {
            (d1, d2) = (2.0 * (b1 + t * d1) - d2, d1);
            (b1, b2) = (term + 2.0 * t * b1 - b2, b1);
        }
        let value = self.terms[0] + t * b1 - b2;
        (value, (b1 + t * d1 - d2) / self.half)
    }
}
