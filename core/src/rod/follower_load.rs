//! Loads along a rod that turn with its directors, such as pressure or thrust, beside dead ones (theory 3.8).
//!
//! With p(s) along the directors f = R p is not known beforehand: the force g = int f that the rod has taken is
//! integrated, with its variation,
//!
//! ```text
//! n(s) = n(0) - int_0^s f_dead - g,   g' = R p,   dg' = phi x R p,
//! w' = r x f,   dw' = rho x f + r x (phi x R p).
//! ```
//!
//! Such a load has no potential.

use super::distributed_load::{LoadMoment, LoadState, Place, ScaledLoad};
use nalgebra::Vector3;

/// Loads along a rod in the numerics' units: one in the clamp's frame, one along the directors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadsAlong {
    pub(super) dead: ScaledLoad,
    pub(super) turning: ScaledLoad,
}

/// Couple and force of the loads along the rod from the clamp to a section, with the variations of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FollowedMoment<const K: usize> {
    /// Couple w of all loads; work of the dead one.
    moment: LoadMoment<K>,
    g: [f64; 3],
    dg: [[f64; K]; 3],
}

impl<const K: usize> LoadState<K> for FollowedMoment<K> {
    type Load = LoadsAlong;
    const NOTHING: Self = Self {
        moment: LoadMoment::NOTHING,
        g: [0.0; 3],
        dg: [[0.0; K]; 3],
    };

    #[inline]
    fn axpy(&mut self, a: f64, x: &Self) {
        self.moment.axpy(a, &x.moment);
        for i in 0..3 {
            self.g[i] += a * x.g[i];
            for j in 0..K {
                self.dg[i][j] += a * x.dg[i][j];
            }
        }
    }

    #[inline]
    fn add_errors(&self, from: &Self, to: &Self, shape: &mut f64, tangent: &mut f64) {
        (self.moment).add_errors(&from.moment, &to.moment, shape, tangent);
        let size = |g: &[f64; 3]| g.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        let scale = size(&from.g).max(size(&to.g));
        for i in 0..3 {
            *shape += (self.g[i] / scale).powi(2);
            for j in 0..K {
                let scale = 1.0 + from.dg[i][j].abs().max(to.dg[i][j].abs());
                *tangent += (self.dg[i][j] / scale).powi(2);
            }
        }
    }

    #[inline]
    fn force(&self, load: &LoadsAlong, base: &[f64; 3], s: f64) -> [f64; 3] {
        let dead = self.moment.force(&load.dead, base, s);
        std::array::from_fn(|i| dead[i] - self.g[i])
    }

    #[inline]
    fn taken_force(&self) -> Option<&[[f64; K]; 3]> {
        Some(&self.dg)
    }

    #[inline]
    fn density(load: &LoadsAlong, s: f64) -> Vector3<f64> {
        load.dead.density(s)
    }

    #[inline]
    fn subtract_couple(&self, m: &mut [f64; 3]) {
        LoadState::<K>::subtract_couple(&self.moment, m);
    }

    #[inline]
    fn take_columns(&self, dm: &mut [[f64; K]; 3]) {
        self.moment.take_columns(dm);
    }

    #[inline]
    fn slope(load: &LoadsAlong, s: f64, at: &Place<'_, K>) -> Self {
        let p = load.turning.density(s);
        let d = at.d.map(Vector3::from);
        let f = d[0] * p.x + d[1] * p.y + d[2] * p.z;
        let r = Vector3::from(*at.r);
        let column = |of: &[[f64; K]; 3], j: usize| Vector3::new(of[0][j], of[1][j], of[2][j]);
        let mut moment = LoadMoment::slope(&load.dead, s, at);
        moment.add_couple(&r.cross(&f), |j| {
            column(at.rho, j).cross(&f) + r.cross(&column(at.phi, j).cross(&f))
        });
        let mut dg = [[0.0; K]; 3];
        for j in 0..K {
            let turned = column(at.phi, j).cross(&f);
            for (row, x) in dg.iter_mut().zip(turned.iter()) {
                row[j] = *x;
            }
        }
        Self {
            moment,
            g: f.into(),
            dg,
        }
    }

    #[inline]
    fn columns(&mut self) -> &mut [[f64; K]] {
        self.moment.columns()
    }

    fn work(&self) -> f64 {
        LoadState::<K>::work(&self.moment)
    }
}
