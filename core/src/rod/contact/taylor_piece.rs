//! Pieces of the planar elastica from one section on under a given force, by Taylor series in arclength.
//!
//! With the tangent t = (c, s) = (cos theta, sin theta), curvature k and the constant force n, in units B = 1,
//!
//! ```text
//! k' = n_x s - n_y c,   c' = -s k,   s' = c k,   r' = t.
//! ```
//!
//! The coefficients follow by Cauchy products, and those of the variations by the variations of the products. The
//! number of steps depends on the length of the piece alone, so that an end is smooth in the unknowns but for jumps of
//! rounding where the number changes.

use nalgebra::{Matrix4, Vector2, Vector4};

/// Highest power of a series.
const ORDER: usize = 20;
/// Length of a step times the largest rate of the tangent's turn: the first term left out is below rounding.
const REACH: f64 = 1.0;
/// Most steps of a piece.
const MOST_STEPS: f64 = 4000.0;

type Series = [f64; ORDER + 1];

/// A section of a planar rod: place, angle of the tangent and curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaneSection {
    pub(super) r: Vector2<f64>,
    pub(super) theta: f64,
    pub(super) curvature: f64,
}

impl PlaneSection {
    /// The unit tangent.
    pub(super) fn tangent(&self) -> Vector2<f64> {
        let (sin, cos) = self.theta.sin_cos();
        Vector2::new(cos, sin)
    }
}

/// Series of tangent, curvature and angle about the start of a step.
#[derive(Debug, Clone)]
struct Step {
    from: PlaneSection,
    length: f64,
    cos: Series,
    sin: Series,
    curvature: Series,
}

/// A piece of the elastica: its steps from the start on.
#[derive(Debug, Clone)]
pub(super) struct TaylorPiece {
    pub(super) force: Vector2<f64>,
    steps: Vec<Step>,
    pub(super) end: PlaneSection,
}

/// The end of a piece by theta, curvature, n_x and n_y at its start: rows x, y, theta, curvature.
pub(super) type PieceTangent = Matrix4<f64>;

fn product(a: &Series, b: &Series, k: usize) -> f64 {
    let pairs = a[..=k].iter().zip(b[..=k].iter().rev());
    pairs.map(|(a, b)| a * b).sum()
}

/// A polynomial, and its integral from 0, at x.
fn value(series: &Series, x: f64) -> f64 {
    series.iter().rev().fold(0.0, |sum, a| sum * x + a)
}

fn integral(series: &Series, x: f64) -> f64 {
    let terms = series.iter().enumerate().rev();
    x * terms.fold(0.0, |sum, (k, a)| sum * x + a / (k as f64 + 1.0))
}

impl Step {
    fn new(from: PlaneSection, force: &Vector2<f64>, length: f64) -> Self {
        let zero = [0.0; ORDER + 1];
        let (mut cos, mut sin, mut curvature) = (zero, zero, zero);
        (sin[0], cos[0]) = from.theta.sin_cos();
        curvature[0] = from.curvature;
        for k in 0..ORDER {
            let over = 1.0 / (k as f64 + 1.0);
            curvature[k + 1] = (force.x * sin[k] - force.y * cos[k]) * over;
            cos[k + 1] = -product(&sin, &curvature, k) * over;
            sin[k + 1] = product(&cos, &curvature, k) * over;
        }
        Self {
            from,
            length,
            cos,
            sin,
            curvature,
        }
    }

    /// The section at the distance x from the start of the step.
    fn section(&self, x: f64) -> PlaneSection {
        PlaneSection {
            r: self.from.r + Vector2::new(integral(&self.cos, x), integral(&self.sin, x)),
            theta: self.from.theta + integral(&self.curvature, x),
            curvature: value(&self.curvature, x),
        }
    }

    /// The end of the step by theta, curvature, n_x and n_y at its start.
    fn tangent(&self, force: &Vector2<f64>) -> PieceTangent {
        let by_one = |j: usize| {
            let zero = [0.0; ORDER + 1];
            let (mut cos, mut sin, mut curvature) = (zero, zero, zero);
            let by = |i: usize| if i == j { 1.0 } else { 0.0 };
            curvature[0] = by(1);
            for k in 0..ORDER {
                let over = 1.0 / (k as f64 + 1.0);
                curvature[k + 1] = (force.x * sin[k] - force.y * cos[k] + by(2) * self.sin[k]
                    - by(3) * self.cos[k])
                    * over;
                cos[k + 1] =
                    -(product(&sin, &self.curvature, k) + product(&self.sin, &curvature, k)) * over;
                sin[k + 1] =
                    (product(&cos, &self.curvature, k) + product(&self.cos, &curvature, k)) * over;
            }
            let x = self.length;
            Vector4::new(
                integral(&cos, x),
                integral(&sin, x),
                integral(&curvature, x),
                value(&curvature, x),
            )
        };
        let [by_curvature, by_x, by_y] = [1, 2, 3].map(by_one);
        // A turn of start and force together turns the end.
        let way = Vector2::new(
            integral(&self.cos, self.length),
            integral(&self.sin, self.length),
        );
        let turned = Vector4::new(-way.y, way.x, 1.0, 0.0);
        let by_theta = turned + by_x * force.y - by_y * force.x;
        Matrix4::from_columns(&[by_theta, by_curvature, by_x, by_y])
    }
}

impl TaylorPiece {
    /// The piece of a length from a section on, under the force n of what lies beyond a section on what lies before.
    /// None if it turns too fast for a bounded number of steps.
    pub(super) fn new(from: PlaneSection, force: Vector2<f64>, length: f64) -> Option<Self> {
        let size = force.norm();
        // k^2/2 + n.t is constant along the piece.
        let most = (from.curvature * from.curvature + 4.0 * size).sqrt();
        let count = (length * most.max(size.sqrt()) / REACH).ceil().max(1.0);
        if !(count <= MOST_STEPS) {
            return None;
        }
        let h = length / count;
        let mut at = from;
        let steps = (0..count as usize).map(|_| {
            let step = Step::new(at, &force, h);
            at = step.section(h);
            step
        });
        let steps = steps.collect();
        Some(Self {
            force,
            steps,
            end: at,
        })
    }

    /// The derivatives of the end.
    pub(super) fn tangent(&self) -> PieceTangent {
        let mut all = Matrix4::zeros();
        (all[(2, 0)], all[(3, 1)]) = (1.0, 1.0);
        for step in &self.steps {
            let own = step.tangent(&self.force);
            let mut next = own;
            // Columns theta and curvature of the step act on the rows of its start; n acts on each step by itself.
            let start = all.fixed_rows::<2>(2).into_owned();
            let carried = own.fixed_columns::<2>(0) * start;
            next.fixed_columns_mut::<2>(0).fill(0.0);
            next += carried;
            let mut moved = Matrix4::zeros();
            moved
                .fixed_rows_mut::<2>(0)
                .copy_from(&all.fixed_rows::<2>(0));
            all = next + moved;
        }
        all
    }

    /// Length.
    pub(super) fn length(&self) -> f64 {
        self.steps.iter().map(|step| step.length).sum()
    }

    /// The section at a distance from the start of the piece.
    pub(super) fn section(&self, x: f64) -> PlaneSection {
        let Some(first) = self.steps.first() else {
            return self.end;
        };
        let k = (x / first.length).floor().max(0.0) as usize;
        let k = k.min(self.steps.len() - 1);
        self.steps[k].section(x - k as f64 * first.length)
    }

    /// Distances of the ends of the steps from the start of the piece.
    pub(super) fn ends(&self) -> impl Iterator<Item = f64> + '_ {
        let h = self.steps.first().map_or(0.0, |step| step.length);
        (1..=self.steps.len()).map(move |k| k as f64 * h)
    }

    /// Stored energy: by the first integral.
    pub(super) fn energy(&self) -> f64 {
        let Some(first) = self.steps.first().map(|step| step.from) else {
            return 0.0;
        };
        let first_integral =
            0.5 * first.curvature * first.curvature + self.force.dot(&first.tangent());
        first_integral * self.length() - self.force.dot(&(self.end.r - first.r))
    }
}
