//! Motion of a point mass on a manifold, at eight nodes at once.

use super::PointMass;
use crate::manifold::{EightPoints, Eightfold};
use crate::math::Row;
use crate::math::lanes8::Eight;
use crate::math::real::Real;
use crate::solve::lobatto::{NodeRows, Sweeps};
use nalgebra::SVector;
use pulp::Simd;

/// A point mass at the end of a rod, on a sheet of its manifold, in the independent variable of theory 2.5. Rows: q,
/// v, t, work of non-potential loads, loss to drag.
pub struct EightMotion<'a, const N: usize> {
    chart: Box<dyn Eightfold<N> + Send>,
    body: &'a PointMass<N>,
    orientation: f64,
    points: EightPoints<N>,
    /// Factor of adj(d pose/d q) v.
    slow: Row,
    /// Time after which loads and clamp are constant.
    pub until: f64,
}

impl<'a, const N: usize> EightMotion<'a, N> {
    /// The motion of `body` in a chart on a sheet of this orientation, +1 or -1.
    pub fn new(
        chart: Box<dyn Eightfold<N> + Send>,
        body: &'a PointMass<N>,
        orientation: f64,
    ) -> Self {
        Self {
            chart,
            body,
            orientation,
            points: EightPoints::default(),
            slow: [0.0; 8],
            until: f64::MAX,
        }
    }

    /// Acceleration, power and loss under loads in time or on a moving clamp, node by node, times the rate of time.
    fn driven(&self, at: &NodeRows, rate: &Row, slopes: &mut NodeRows) {
        for i in 0..8 {
            let vector = |rows: &[Row]| SVector::<f64, N>::from_fn(|k, _| rows[k][i]);
            let [pose, force] = [&self.points.pose, &self.points.force].map(|of| vector(of));
            let (t, v) = (at.0[2 * N][i].min(self.until), vector(&at.0[N..]));
            let action = (self.body).action(t, &pose, &v, &force);
            for k in 0..N {
                slopes.0[N + k][i] = action.acceleration[k] * rate[i];
            }
            slopes.0[2 * N + 1][i] = action.power * rate[i];
            slopes.0[2 * N + 2][i] = action.loss * rate[i];
        }
    }
}

impl<const N: usize> Sweeps for EightMotion<'_, N> {
    const PLACES: usize = N;
    const ROWS: usize = 2 * N + 3;

    /// The rows behind the time, work and loss, are constant if there is neither drag nor dependence on time.
    fn changing(&self) -> usize {
        if self.is_timed() || self.body.drag != 0.0 {
            Self::ROWS
        } else {
            2 * N + 1
        }
    }

    fn is_timed(&self) -> bool {
        self.body.support.is_some() || self.body.is_timed()
    }

    fn begin(&mut self) {
        self.chart.begin();
    }

    #[inline(always)]
    fn forces<S: Simd>(&mut self, simd: S, at: &NodeRows, slopes: &mut NodeRows) -> bool {
        let Some(q) = at.0.first_chunk() else {
            return false;
        };
        if !self.chart.points(q, &mut self.points) {
            return false;
        }
        let [det, pace] = [
            Eight::of(simd, self.points.det),
            Eight::of(simd, self.points.pace),
        ];
        // Reciprocal root: root and inverse in parallel, not one after the other.
        let square = det.times_plus(det, pace * pace);
        let slow = square.sqrt() * (square.inverse() * self.orientation);
        let rate = slow * det;
        self.slow = slow.numbers();
        slopes.0[2 * N] = rate.numbers();
        let body = self.body;
        if self.is_timed() {
            self.driven(at, &rate.numbers(), slopes);
            return true;
        }
        let lighter = rate * (1.0 / body.mass);
        let mut loss = rate.with(0.0);
        for k in 0..N {
            let v = Eight::of(simd, at.0[N + k]);
            let force = Eight::of(simd, self.points.force[k]) + v.with(body.constant[k]);
            slopes.0[N + k] = ((force - v * body.drag) * lighter).numbers();
            loss = v.times_plus(v, loss);
        }
        slopes.0[2 * N + 1] = [0.0; 8];
        slopes.0[2 * N + 2] = (loss * rate * body.drag).numbers();
        true
    }

    #[inline(always)]
    fn moves<S: Simd>(&mut self, simd: S, at: &NodeRows, slopes: &mut NodeRows) {
        let slow = Eight::of(simd, self.slow);
        for k in 0..N {
            let mut sum = slow.with(0.0);
            for j in 0..N {
                let by = Eight::of(simd, self.points.adjugate[k][j]);
                sum = by.times_plus(Eight::of(simd, at.0[N + j]), sum);
            }
            slopes.0[k] = (sum * slow).numbers();
        }
    }
}
