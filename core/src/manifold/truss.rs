//! The von Mises truss under a soft spring: the smallest manifold with folds, in closed form.
//!
//! Two bars, springs of stiffness k, run from (-1, 0) and (1, 0) to an apex at height a, the chart;
//! unloaded it stands at height h. A spring of stiffness c joins the apex to the body at height z,
//! the pose. With the lengths l = sqrt(1 + a^2), L = sqrt(1 + h^2) and sigma = c / 2k,
//! ```text
//! E = k (l - L)^2,   F = dE/da = 2k a (1 - L/l),   z = a + F/c,   U = E + F^2/2c,   w = -F,
//! dz/da = 1 + (1 - L/l^3) / sigma,   dU = F dz = -w dz.
//! ```
//! With z held the energy E + c (z - a)^2/2 has the slope c (z(a) - z) and the curvature c dz/da:
//! the sign of dz/da is the Morse index, and the viscous layer is a flow on the line, from one root
//! of z(a) = z to the next. For sigma < L - 1 there are two folds, where l^3 = L / (1 + sigma), at
//! heights of the body on an astroid: (sigma |z|)^(2/3) = L^(2/3) - (1 + sigma)^(2/3).

use crate::error::{Error, Result, check_positive};
use crate::manifold::{EquilibriumManifold, ManifoldPoint, Multivalued, Sheet, Sign};
use crate::solve::roots::chandrupatla;
use nalgebra::{Matrix1, Vector1};

/// A truss of half span 1, its apex joined to the body by a spring.
///
/// Sheets: with folds at a = +-f, S_0^+ is a >= f, S_0^- is a <= -f (both stable), S_1^+ lies between
/// (unstable). Without folds there is S_0^+ alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truss {
    height: f64,
    /// Natural length of a bar, L.
    length: f64,
    bars: f64,
    spring: f64,
    /// The fold f > 0, if there is one.
    fold: Option<f64>,
}

/// Distance, relative to f, within which a point counts as the fold: there z differs by rounding.
const ON_FOLD: f64 = 1e-8;

impl Truss {
    /// A truss that stands at `height` h, of two bars of stiffness `bars` k each, under a spring of
    /// stiffness `spring` c.
    ///
    /// # Errors
    /// A parameter that is not positive and finite.
    pub fn new(height: f64, bars: f64, spring: f64) -> Result<Self> {
        for (name, value) in [("height", height), ("bars", bars), ("spring", spring)] {
            check_positive(name, value)?;
        }
        let length = height.hypot(1.0);
        let sigma = 0.5 * spring / bars;
        // l^3 = L / (1 + sigma), in a form that keeps the digits of a small f.
        let excess = height * height / (length + 1.0) - sigma;
        let squared = (2.0 / 3.0 * (excess / (1.0 + sigma)).ln_1p()).exp_m1();
        let fold = (squared > 0.0).then(|| squared.sqrt());
        Ok(Self {
            height,
            length,
            bars,
            spring,
            fold,
        })
    }

    /// The apex height f > 0 of the upper fold; the lower is -f. None if the spring is too stiff.
    pub fn fold(&self) -> Option<f64> {
        self.fold
    }

    /// 1 - L/l, to full accuracy near a = h.
    fn strain(&self, a: f64) -> f64 {
        let l = a.hypot(1.0);
        (a - self.height) * (a + self.height) / (l * (l + self.length))
    }

    /// z(a).
    fn pose(&self, a: f64) -> f64 {
        a + 2.0 * self.bars * a * self.strain(a) / self.spring
    }

    /// dz/da.
    fn slope(&self, a: f64) -> f64 {
        1.0 + 2.0 * self.bars / self.spring * (1.0 - self.length / a.hypot(1.0).powi(3))
    }

    /// Root a >= f (a >= 0 without folds) of z(a) = z, if z is not below this sheet. On the sheet z(a) grows, and
    /// z(a) >= a beyond h, which brackets the root.
    fn upper(&self, z: f64) -> Option<f64> {
        let (low, high) = (self.fold.unwrap_or(0.0), self.height.max(z));
        let off = |a: f64| self.pose(a) - z;
        if off(low) > 0.0 {
            return None;
        }
        chandrupatla(off, (low, off(low)), (high, off(high)), 0.0)
    }

    /// Root a <= -f of z(a) = z, by symmetry: z(a) is odd.
    fn lower(&self, z: f64) -> Option<f64> {
        self.upper(-z).map(|a| -a)
    }
}

impl EquilibriumManifold<1> for Truss {
    fn point(&self, q: &Vector1<f64>) -> Option<ManifoldPoint<1>> {
        let a = q[0];
        let l = a.hypot(1.0);
        let strain = self.strain(a);
        let force = 2.0 * self.bars * a * strain;
        let energy = self.bars * (l * strain).powi(2) + 0.5 * force * force / self.spring;
        energy.is_finite().then(|| ManifoldPoint {
            pose: Vector1::new(self.pose(a)),
            force: Vector1::new(-force),
            energy,
            jacobian: Matrix1::new(self.slope(a)),
            // Limit of dz/da for large a.
            pace: 1.0 + 2.0 * self.bars / self.spring,
        })
    }

    fn index(&self, q: &Vector1<f64>) -> Result<usize> {
        let slope = self.slope(q[0]);
        if slope.is_nan() {
            return Err(Error::domain(format!("a = {} is no apex height", q[0])));
        }
        Ok(usize::from(slope < 0.0))
    }
}

impl Multivalued<1> for Truss {
    fn sheet(&self, q: &Vector1<f64>) -> Sheet {
        let (mode, sign) = match self.fold {
            None => (0, Sign::Plus),
            Some(f) if q[0].abs() < f * (1.0 - ON_FOLD) => (1, Sign::Plus),
            Some(_) => (0, Sign::of(q[0])),
        };
        Sheet { mode, sign }
    }

    fn stable_at(&self, pose: &Vector1<f64>) -> Result<Vec<Vector1<f64>>> {
        let z = pose[0];
        if !z.is_finite() {
            return Err(Error::domain(format!("the pose z = {z} must be finite")));
        }
        // The energy E + c (z - a)^2/2 is even in (a, z): the side of z is the lower of two.
        let mut found = if z < 0.0 {
            vec![self.lower(z), self.upper(z)]
        } else {
            vec![self.upper(z), self.lower(z)]
        };
        if self.fold.is_none() {
            found.truncate(1);
        }
        Ok(found.into_iter().flatten().map(Vector1::new).collect())
    }

    fn settle(&self, q: &Vector1<f64>, leaving: &Vector1<f64>) -> Result<Vector1<f64>> {
        let (a, direction) = (q[0], leaving[0]);
        let stays = |f: f64| {
            a.abs() > f * (1.0 + ON_FOLD)
                || a.abs() >= f * (1.0 - ON_FOLD) && a * direction >= 0.0
                || direction == 0.0
                || direction.is_nan()
        };
        if !a.is_finite() || self.fold.is_none_or(stays) {
            return Err(Error::domain(format!(
                "the truss does not leave a = {a} in the direction {direction}: it is stable on that side"
            )));
        }
        let z = self.pose(a);
        let landed = if direction > 0.0 {
            self.upper(z)
        } else {
            self.lower(z)
        };
        landed.map(Vector1::new).ok_or_else(|| {
            Error::no_convergence(format!("no stable truss found from a = {a} at z = {z}"))
        })
    }
}
