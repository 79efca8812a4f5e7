//! Taylor coefficients of the pendulum and of the tip over a box, in intervals.

use super::super::BoxCoordinate;
use super::{I, at};

/// Number of coefficients along a coordinate: derivatives up to the third.
const M: usize = 4;

/// Taylor coefficients of a function over a box: `[i][j]` is that of dq^i du^j, i + j < M, with q the box's first
/// coordinate and u = lam.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet(pub [[I; M]; M]);

impl Jet {
    fn constant(value: I) -> Self {
        let mut jet = Self([[I::ZERO; M]; M]);
        jet.0[0][0] = value;
        jet
    }

    /// Product up to the degree `degree`.
    fn times(&self, other: &Self, degree: usize) -> Self {
        let mut out = Self::constant(I::ZERO);
        for i in 0..=degree {
            for j in 0..=degree - i {
                for k in 0..=i {
                    for l in 0..=j {
                        out.0[i][j] = out.0[i][j] + self.0[k][l] * other.0[i - k][j - l];
                    }
                }
            }
        }
        out
    }

    /// Derivative of the order (i, j) along q and u.
    pub fn derivative(&self, i: usize, j: usize) -> I {
        let factorial = |n: usize| (1..=n).product::<usize>() as f64;
        self.0[i][j] * at(factorial(i) * factorial(j))
    }

    #[inline(always)]
    fn map2(&self, other: &Self, f: impl Fn(I, I) -> I) -> Self {
        let mut out = *self;
        for i in 0..M {
            for j in 0..M - i {
                out.0[i][j] = f(self.0[i][j], other.0[i][j]);
            }
        }
        out
    }

    fn plus(&self, other: &Self) -> Self {
        self.map2(other, |a, b| a + b)
    }

    fn minus(&self, other: &Self) -> Self {
        self.map2(other, |a, b| a - b)
    }

    fn twice(&self) -> Self {
        self.plus(self)
    }

    fn negative(&self) -> Self {
        Self(self.0.map(|row| row.map(|a| -a)))
    }
}

/// Indices of s and B in the fields.
const S: usize = 5;
const B: usize = 8;

/// Pendulum over a box. The divisor t of the rate of B is kap (coordinate p) or kap/p (coordinate ln p).
#[derive(Clone, Copy)]
pub(super) struct Pendulum {
    kind: BoxCoordinate,
    u: Jet,
    /// Fields p, kap, kap', t, 1/t, s, c, D, B.
    pub fields: [Jet; 9],
}

impl Pendulum {
    /// Series from the enclosures over the box.
    pub fn new(kind: BoxCoordinate, u: I, values: [I; 9]) -> Self {
        let mut u = Jet::constant(u);
        u.0[0][1] = I::ONE;
        let mut new = Self {
            kind,
            u,
            fields: values.map(Jet::constant),
        };
        for degree in 1..M {
            let (by_q, by_u) = (new.by_q(degree - 1), new.by_u(degree - 1));
            for (k, field) in new.fields.iter_mut().enumerate() {
                for i in 1..=degree {
                    let slope = by_q[k].0[i - 1][degree - i];
                    field.0[i][degree - i] = slope / at(i as f64);
                }
                field.0[0][degree] = by_u[k].0[0][degree - 1] / at(degree as f64);
            }
        }
        new
    }

    /// Derivatives along q at fixed u (theory 2.4). With n = D B + s c, m = kap n, f = c D + kap^2 s B:
    /// ```text
    /// s_p = -c m,   c_p = s m,   D_p = -kap c f,   kap B_p = kap'^2 (u - B) - D n
    /// ```
    fn by_q(&self, degree: usize) -> [Jet; 9] {
        let by = |a: &Jet, b: &Jet| a.times(b, degree);
        let [p, kap, kc, t, over, s, c, d, b] = &self.fields;
        let kc2 = by(kc, kc);
        let n = by(d, b).plus(&by(s, c));
        let m = by(kap, &n);
        let f = by(c, d).plus(&by(&by(kap, kap), &by(s, b)));
        let b_q = by(&by(&kc2, &self.u.minus(b)).minus(&by(d, &n)), over);
        let along_p = [
            kc2,
            by(kap, kc).negative(),
            by(c, &m).negative(),
            by(s, &m),
            by(&by(kap, c), &f).negative(),
        ];
        let ([kap_q, kc_q, s_q, c_q, d_q], p_q, t_q) = match self.kind {
            BoxCoordinate::Linear => (along_p, Jet::constant(I::ONE), kc2),
            BoxCoordinate::Log => (along_p.map(|v| by(p, &v)), *p, kc2.minus(t)),
        };
        let over_q = by(&by(over, over), &t_q).negative();
        [p_q, kap_q, kc_q, t_q, over_q, s_q, c_q, d_q, b_q]
    }

    fn by_u(&self, degree: usize) -> [Jet; 9] {
        let by = |a: &Jet, b: &Jet| a.times(b, degree);
        let [_, kap, _, _, _, s, c, d, _] = &self.fields;
        let none = Jet::constant(I::ZERO);
        let sc = by(s, c);
        [
            none,
            none,
            none,
            none,
            none,
            by(c, d),
            by(s, d).negative(),
            by(&by(kap, kap), &sc),
            by(s, s),
        ]
    }

    /// Series of s/lam and B/lam, for lam > 0.
    pub fn over_lam(&self) -> [Jet; 2] {
        let mut over = Jet::constant(I::ZERO);
        let inverse = I::ONE / self.u.0[0][0];
        let mut power = inverse;
        for j in 0..M {
            over.0[0][j] = power;
            power = -(power * inverse);
        }
        [S, B].map(|k| self.fields[k].times(&over, M - 1))
    }

    /// Series of 1 - x and y (for ln p in units of p^2 and p at the centre), and of the end in the turned axes
    /// (X, Y).
    ///
    /// With `sigma` = s/lam, `short` = B/lam, bet = 1 - B/lam and e^(i psi/2) = D + i kap c:
    /// ```text
    /// (X, Y) = (1 - 2 kap^2 bet, 2 kap sigma)
    /// 1 - x  = 2 kap^2 (c^2 + bet - 2 kap^2 c^2 bet - 2 c D sigma)
    /// y      = 2 kap (sigma (1 - 2 kap^2 c^2) - c D (1 - 2 kap^2 bet))
    /// ```
    pub fn tip(&self, [sigma, short]: [Jet; 2]) -> [Jet; 4] {
        let by = |a: &Jet, b: &Jet| a.times(b, M - 1);
        let [_, kap, _, t, _, _, c, d, _] = &self.fields;
        let one = Jet::constant(I::ONE);
        let beta = one.minus(&short);
        let twice = by(kap, kap).twice();
        let (c2, cd) = (by(c, c), by(c, d));
        let back = by(&twice, &c2);
        let along = one.minus(&by(&twice, &beta));
        let x = c2
            .plus(&beta)
            .minus(&by(&back, &beta))
            .minus(&by(&cd, &sigma).twice());
        let y = by(&sigma, &one.minus(&back)).minus(&by(&cd, &along));
        let factor = match self.kind {
            BoxCoordinate::Linear => *kap,
            BoxCoordinate::Log => {
                // Growth of p along ln p: p/p0 = e^dq.
                let mut grown = Jet::constant(I::ONE);
                for i in 1..M {
                    grown.0[i][0] = grown.0[i - 1][0] / at(i as f64);
                }
                by(t, &grown)
            }
        };
        [
            by(&by(&factor, &factor), &x).twice(),
            by(&factor, &y).twice(),
            along,
            by(kap, &sigma).twice(),
        ]
    }
}
