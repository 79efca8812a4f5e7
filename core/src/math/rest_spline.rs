//! Splines of degree 5 that start and end at rest.

use nalgebra::{Matrix2, Vector2};

/// The curve of degree 5 between points (t, f) with four continuous derivatives inside and f' = f'' = 0 at both ends;
/// constant beyond them, so that f'' is continuous everywhere.
#[derive(Debug)]
pub struct RestSpline {
    times: Vec<f64>,
    /// (f, f', f'') at the times.
    jets: Vec<[f64; 3]>,
}

impl RestSpline {
    /// The spline through `points`, at least one, with growing times; None if their spacing is too uneven for double
    /// precision.
    ///
    /// f' and f'' at the inner points follow from the continuity of f''' and f'''' there: a block tridiagonal system.
    pub fn new(points: &[[f64; 2]]) -> Option<Self> {
        let inner = points.len().saturating_sub(2);
        // Forward elimination: unknowns x_i = (f', f'') at inner point i obey x_i = carried_i - kept_i x_(i+1).
        let mut kept: Vec<Matrix2<f64>> = Vec::with_capacity(inner);
        let mut carried: Vec<Vector2<f64>> = Vec::with_capacity(inner);
        for i in 0..inner {
            let [a, b, c] = [points[i], points[i + 1], points[i + 2]];
            let (l, r) = (b[0] - a[0], c[0] - b[0]);
            let (rise_l, rise_r) = ((b[1] - a[1]) / l, (c[1] - b[1]) / r);
            let (l2, r2) = (l * l, r * r);
            // Jumps of the third derivative over 12 and of the fourth over 24: left minus right.
            let before = Matrix2::new(-2.0 / l2, -0.25 / l, -7.0 / (l2 * l), -1.0 / l2);
            let mut block = Matrix2::new(
                3.0 / r2 - 3.0 / l2,
                0.75 / l + 0.75 / r,
                -8.0 / (l2 * l) - 8.0 / (r2 * r),
                1.5 / l2 - 1.5 / r2,
            );
            let after = Matrix2::new(2.0 / r2, -0.25 / r, -7.0 / (r2 * r), 1.0 / r2);
            let mut load = Vector2::new(
                5.0 * (rise_r / r2 - rise_l / l2),
                -15.0 * (rise_r / (r2 * r) + rise_l / (l2 * l)),
            );
            if i > 0 {
                block -= before * kept[i - 1];
                load -= before * carried[i - 1];
            }
            let inverse = block.try_inverse()?;
            kept.push(inverse * after);
            carried.push(inverse * load);
        }
        let mut jets: Vec<[f64; 3]> = points.iter().map(|p| [p[1], 0.0, 0.0]).collect();
        let mut next = Vector2::zeros();
        for i in (0..inner).rev() {
            next = carried[i] - kept[i] * next;
            jets[i + 1][1] = next.x;
            jets[i + 1][2] = next.y;
        }
        let times = points.iter().map(|p| p[0]).collect();
        let sound = jets.iter().flatten().all(|x| x.is_finite());
        sound.then_some(Self { times, jets })
    }

    /// (f, f', f'') at `t`.
    pub fn at(&self, t: f64) -> [f64; 3] {
        let after = self.times.partition_point(|s| *s <= t);
        if after == 0 || after == self.times.len() {
            return [self.jets[after.saturating_sub(1)][0], 0.0, 0.0];
        }
        let (a, b) = (self.jets[after - 1], self.jets[after]);
        let h = self.times[after] - self.times[after - 1];
        let u = (t - self.times[after - 1]) / h;
        let (rise, d0, d1) = (b[0] - a[0], a[1] * h, b[1] * h);
        let (s0, s1) = (a[2] * h * h, b[2] * h * h);
        let c2 = 0.5 * s0;
        let c3 = 10.0 * rise - 6.0 * d0 - 4.0 * d1 - 1.5 * s0 + 0.5 * s1;
        let c4 = -15.0 * rise + 8.0 * d0 + 7.0 * d1 + 1.5 * s0 - s1;
        let c5 = 6.0 * rise - 3.0 * (d0 + d1) - 0.5 * (s0 - s1);
        [
            a[0] + u * (d0 + u * (c2 + u * (c3 + u * (c4 + u * c5)))),
            (d0 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h,
            (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (h * h),
        ]
    }
}
