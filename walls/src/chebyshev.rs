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
    /// Terms of the integral from the start of the interval.
    sums: [f64; TERMS + 1],
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
        let mut so_far = 0.0;
        for piece in &mut pieces {
            let start = series(&piece.sums, -1.0)[0];
            piece.sums[0] += so_far - start;
            so_far = series(&piece.sums, 1.0)[0];
        }
        Ok(Self { pieces })
    }

    /// Value and derivative at `x`; outside of the interval the nearest piece is continued.
    #[inline]
    pub fn at(&self, x: f64) -> (f64, f64) {
        self.piece(x).at(x)
    }

    /// \[integral from the start of the interval, value, first derivative, second derivative\] at `x`, as
    /// [`Pieces::at`].
    pub fn jet(&self, x: f64) -> [f64; 4] {
        let piece = self.piece(x);
        let t = (x - piece.centre) / piece.half;
        let [value, slope, bend] = series(&piece.terms, t);
        let integral = series(&piece.sums, t)[0];
        [
            integral,
            value,
            slope / piece.half,
            bend / (piece.half * piece.half),
        ]
    }

    #[inline]
    fn piece(&self, x: f64) -> &Piece {
        let beyond = |piece: &&Piece| x <= piece.centre + piece.half;
        let last = self.pieces.len() - 1;
        self.pieces
            .iter()
            .find(beyond)
            .unwrap_or(&self.pieces[last])
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
        let terms: [f64; TERMS] = std::array::from_fn(term);
        // The integral of T_k is (T_(k+1)/(k+1) - T_(k-1)/(k-1))/2; the constant follows from the pieces before.
        let of = |k: usize| terms.get(k).copied().unwrap_or(0.0);
        let sum = |k: usize| match k {
            0 => 0.0,
            1 => half * (of(0) - 0.5 * of(2)),
            k => half * (of(k - 1) - of(k + 1)) / (2 * k) as f64,
        };
        Ok(Self {
            centre,
            half,
            terms,
            sums: std::array::from_fn(sum),
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

/// Value, first and second derivative of a Chebyshev series at `t` in \[-1, 1\].
fn series(terms: &[f64], t: f64) -> [f64; 3] {
    let (mut b, mut d, mut e) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for term in terms[1..].iter().rev() {
        e = [4.0 * d[0] + 2.0 * t * e[0] - e[1], e[0]];
        d = [2.0 * (b[0] + t * d[0]) - d[1], d[0]];
        b = [term + 2.0 * t * b[0] - b[1], b[0]];
    }
    [
        terms[0] + t * b[0] - b[1],
        b[0] + t * d[0] - d[1],
        2.0 * d[0] + t * e[0] - e[1],
    ]
}
